//! From bodies that are near to contacts with names, gaps and coefficients. Knows no velocities' future:
//! what a contact means for the motion is the scheme's matter.

use crate::bodies::Bodies;
use crate::settings::Settings;
use carom_geometry::broad_phase::BroadPhase;
use carom_geometry::{Aabb, ContactPoint, Geometry};
use carom_math::{Column, Space};

/// One contact between two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch<S: Space> {
    /// Names the contact from step to step.
    pub id: u64,
    /// Index of body a.
    pub a: usize,
    /// Index of body b.
    pub b: usize,
    /// The one point both bodies use \[m\].
    pub point: S::Vector,
    /// Unit normal from b to a.
    pub normal: S::Vector,
    /// Distance of the surfaces \[m\]; negative when they overlap.
    pub gap: f64,
    /// Coefficient of friction of the pair \[1\].
    pub friction: f64,
    /// Coefficient of restitution of the pair \[1\].
    pub restitution: f64,
}

/// Finds contacts; holds memory and the broad phase's order, nothing that changes an answer.
#[derive(Default)]
pub struct NarrowPhase<S: Geometry> {
    broad: BroadPhase<S>,
    bounds: Vec<Aabb<S>>,
    margins: Vec<f64>,
    indices: Vec<usize>,
    movable: Vec<bool>,
    points: Vec<ContactPoint<S>>,
}

impl<S: Geometry> NarrowPhase<S> {
    /// All contacts whose gap is at most the pair's margin, in order of (a, b, feature).
    pub fn update(&mut self, bodies: &Bodies<S>, settings: &Settings<S>, dt: f64, out: &mut Vec<Touch<S>>) {
        out.clear();
        self.prepare(bodies, settings, dt);
        let data = &bodies.data;
        let indices = &self.indices;
        let may_pair = |i: usize, j: usize| {
            let (a, b) = (&data[indices[i]], &data[indices[j]]);
            let moves = a.inverse_mass > 0.0 || b.inverse_mass > 0.0;
            moves && a.groups & b.collides_with != 0 && b.groups & a.collides_with != 0
        };
        for &(i, j) in self.broad.update(&self.bounds, &self.movable, &may_pair) {
            let (a, b) = (self.indices[i as usize], self.indices[j as usize]);
            let margin = self.margins[i as usize] + self.margins[j as usize];
            self.points.clear();
            let (Some(ca), Some(cb)) = (&data[a].collider, &data[b].collider) else { continue };
            S::contacts(ca, &bodies.shape_pose(a), cb, &bodies.shape_pose(b), margin, &mut self.points);
            let friction = settings.friction_mixing.mix(data[a].friction, data[b].friction);
            let restitution = settings.restitution_mixing.mix(data[a].restitution, data[b].restitution);
            out.extend(self.points.iter().map(|p| Touch {
                id: contact_id(data[a].serial, data[b].serial, p.feature),
                a,
                b,
                point: p.point,
                normal: p.normal,
                gap: p.gap,
                friction,
                restitution,
            }));
        }
    }

    /// Bounds of all bodies with a shape, grown by half of each pair's margin.
    fn prepare(&mut self, bodies: &Bodies<S>, settings: &Settings<S>, dt: f64) {
        self.bounds.clear();
        self.margins.clear();
        self.indices.clear();
        self.movable.clear();
        for (i, d) in bodies.data.iter().enumerate() {
            let Some(collider) = &d.collider else { continue };
            let margin = reach(bodies, settings, i, dt);
            self.bounds.push(S::bounds(collider, &bodies.shape_pose(i), margin));
            self.margins.push(margin);
            self.indices.push(i);
            self.movable.push(d.inverse_mass > 0.0);
        }
    }
}

/// How far a body's surface can come in a step \[m\], with twice its speed for what impacts at the step's start may
/// make of it: its share of a pair's margin. At least 5e-4 and at most half of its size, so that a contact is
/// never felt from further away than that.
fn reach<S: Geometry>(bodies: &Bodies<S>, settings: &Settings<S>, i: usize, dt: f64) -> f64 {
    if let Some(margin) = settings.contact_margin {
        return 0.5 * margin;
    }
    let d = &bodies.data[i];
    let linear = bodies.motion.velocity[i].norm();
    if !d.extent.is_finite() {
        return linear * dt; // a wall that is driven
    }
    let speed = linear + 0.5 * d.extent * bodies.motion.angular_velocity[i].norm();
    if !bodies.is_dynamic(i) {
        return (speed * dt).min(0.5 * d.extent);
    }
    let fall = settings.gravity.norm() * dt;
    (2.0 * (speed + fall) * dt).clamp(5e-4 * d.extent, 0.5 * d.extent)
}

/// A contact's name from its bodies' serials and its feature: a fixed mixing of bits (SplitMix64's).
fn contact_id(a: u64, b: u64, feature: u64) -> u64 {
    let mix = |mut x: u64| {
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    mix(mix(mix(a.wrapping_add(0x9e37_79b9_7f4a_7c15)) ^ b) ^ feature)
}

/// Smallest extent among bodies that can move \[m\]; the scene's length scale. `None` without such bodies.
pub fn smallest_extent<S: Geometry>(bodies: &Bodies<S>) -> Option<f64> {
    let sizes = bodies.data.iter().filter(|d| d.inverse_mass > 0.0 && d.extent > 0.0 && d.extent.is_finite());
    sizes.map(|d| d.extent).min_by(f64::total_cmp)
}

/// Velocity of a's point relative to b's along the normal \[m/s\].
pub fn normal_velocity<S: Geometry>(bodies: &Bodies<S>, t: &Touch<S>) -> f64 {
    let m = &bodies.motion;
    let at = |i: usize| m.twist(i).at(t.point - m.position[i]);
    t.normal.dot(at(t.a) - at(t.b))
}
