//! From bodies that are near to contacts with names, gaps and coefficients. Knows no velocities' future:
//! what a contact means for the motion is the scheme's matter.

use crate::bodies::Bodies;
use crate::material::Mixing;
use crate::settings::{Scheme, Settings};
use crate::stepping::soft_step::AGAIN;
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
    /// Coefficient of rolling friction \[m\].
    pub rolling: f64,
    /// Coefficient of spinning friction \[m\].
    pub spinning: f64,
    /// Coefficient of restitution of the pair \[1\].
    pub restitution: f64,
    /// Coefficient of tangential restitution of the pair \[1\].
    pub tangential_restitution: f64,
}

/// Appends the contacts of a pair (a, b) of bodies if it knows them.
pub type Known<'a, S> = dyn FnMut(usize, usize, &mut Vec<Touch<S>>) -> bool + 'a;

/// Finds contacts; holds memory and the broad phase's order, nothing that changes an answer.
#[derive(Default)]
pub struct NarrowPhase<S: Geometry> {
    broad: BroadPhase<S>,
    bounds: Vec<Aabb<S>>,
    margins: Vec<f64>,
    speeds: Vec<f64>,
    indices: Vec<usize>,
    movable: Vec<bool>,
    points: Vec<ContactPoint<S>>,
}

impl<S: Geometry> NarrowPhase<S> {
    /// All contacts whose gap is at most the pair's margin, in order of (a, b, feature).
    pub fn update(&mut self, bodies: &Bodies<S>, settings: &Settings<S>, dt: f64, out: &mut Vec<Touch<S>>) {
        self.update_but(bodies, settings, dt, &mut |_, _, _| false, out);
    }

    /// The same, but for pairs whose contacts `known` appends itself; it is asked in order of (a, b).
    pub fn update_but(
        &mut self,
        bodies: &Bodies<S>,
        settings: &Settings<S>,
        dt: f64,
        known: &mut Known<'_, S>,
        out: &mut Vec<Touch<S>>,
    ) {
        out.clear();
        self.prepare(bodies, settings, dt);
        let data = &bodies.data;
        let indices = &self.indices;
        let may_pair = |i: usize, j: usize| {
            let (a, b) = (&data[indices[i]], &data[indices[j]]);
            let moves = a.inverse_mass > 0.0 || b.inverse_mass > 0.0;
            let groups = a.groups & b.collides_with != 0 && b.groups & a.collides_with != 0;
            moves && groups && !bodies.joints.keeps_apart(indices[i], indices[j])
        };
        let pairs = self.broad.update(&self.bounds, &self.movable, &may_pair);
        if share_speeds(pairs, &self.movable, &mut self.speeds) {
            for (k, &i) in indices.iter().enumerate() {
                self.margins[k] = reach(bodies, settings, i, dt, self.speeds[k]);
                let Some(collider) = &data[i].collider else { continue };
                self.bounds[k] = S::bounds(collider, &bodies.shape_pose(i), self.margins[k]);
            }
        }
        for &(i, j) in self.broad.update(&self.bounds, &self.movable, &may_pair) {
            let (a, b) = (self.indices[i as usize], self.indices[j as usize]);
            if known(a, b, out) {
                continue;
            }
            let margin = self.margins[i as usize] + self.margins[j as usize];
            self.points.clear();
            let (Some(ca), Some(cb)) = (&data[a].collider, &data[b].collider) else { continue };
            S::contacts(ca, &bodies.shape_pose(a), cb, &bodies.shape_pose(b), margin, &mut self.points);
            touches_of(bodies, settings, (a, b), &self.points, out);
        }
    }

    /// Bounds of all bodies with a shape, grown by half of each pair's margin.
    fn prepare(&mut self, bodies: &Bodies<S>, settings: &Settings<S>, dt: f64) {
        self.bounds.clear();
        self.margins.clear();
        self.speeds.clear();
        self.indices.clear();
        self.movable.clear();
        for (i, d) in bodies.data.iter().enumerate() {
            let Some(collider) = &d.collider else { continue };
            let speed = speed(bodies, settings, i, dt);
            let margin = reach(bodies, settings, i, dt, speed);
            self.bounds.push(S::bounds(collider, &bodies.shape_pose(i), margin));
            self.margins.push(margin);
            self.speeds.push(speed);
            self.indices.push(i);
            self.movable.push(d.inverse_mass > 0.0);
        }
    }
}

/// Appends the touches of a pair from its contact points.
pub fn touches_of<S: Geometry>(
    bodies: &Bodies<S>,
    settings: &Settings<S>,
    (a, b): (usize, usize),
    points: &[ContactPoint<S>],
    out: &mut Vec<Touch<S>>,
) {
    if points.is_empty() {
        return;
    }
    let data = &bodies.data;
    let pair = bodies.materials.between(data[a].material, data[b].material);
    let mixed = settings.friction_mixing.mix(data[a].friction, data[b].friction);
    let friction = pair.friction.unwrap_or(mixed);
    // either body's softness makes the moment: the larger coefficient is the contact's
    let larger = |one, other| Mixing::Max.mix(one, other);
    let rolling = larger(data[a].rolling_friction, data[b].rolling_friction);
    let rolling = pair.rolling_friction.unwrap_or(rolling);
    let spinning = larger(data[a].spinning_friction, data[b].spinning_friction);
    let spinning = pair.spinning_friction.unwrap_or(spinning);
    let restitution = restitution_of(bodies, settings, (a, b));
    let tangential = (data[a].tangential_restitution, data[b].tangential_restitution);
    let mixed = settings.restitution_mixing.mix(tangential.0, tangential.1);
    let tangential_restitution = pair.tangential_restitution.unwrap_or(mixed);
    out.extend(points.iter().map(|p| Touch {
        id: contact_id(data[a].serial, data[b].serial, p.feature),
        a,
        b,
        point: p.point,
        normal: p.normal,
        gap: p.gap,
        friction,
        rolling,
        spinning,
        restitution,
        tangential_restitution,
    }));
}

/// Restitution of a pair's contacts \[1\].
pub fn restitution_of<S: Geometry>(
    bodies: &Bodies<S>,
    settings: &Settings<S>,
    (a, b): (usize, usize),
) -> f64 {
    let (one, other) = (&bodies.data[a], &bodies.data[b]);
    let mixed = settings.restitution_mixing.mix(one.restitution, other.restitution);
    bodies.materials.between(one.material, other.material).restitution.unwrap_or(mixed)
}

/// Largest speed of a body's surface in a step before impacts \[m/s\].
fn speed<S: Geometry>(bodies: &Bodies<S>, settings: &Settings<S>, i: usize, dt: f64) -> f64 {
    let d = &bodies.data[i];
    let linear = bodies.motion.velocity[i].norm();
    if !d.extent.is_finite() {
        return linear; // a wall, maybe a driven one; that it does not turn much is the user's matter
    }
    let fall = if bodies.is_dynamic(i) { settings.gravity.norm() * dt } else { 0.0 };
    let arm = 0.5 * d.extent + d.mass_properties.center.norm();
    linear + arm * bodies.motion.angular_velocity[i].norm() + fall
}

/// A body that a fast one is about to hit may be fast itself before the step is over: pairs share their speeds.
/// True when that changed one by more than what the margins allow for anyway.
fn share_speeds(pairs: &[(u32, u32)], movable: &[bool], speeds: &mut [f64]) -> bool {
    let own = speeds.to_vec();
    let mut changed = false;
    for &(i, j) in pairs {
        let (i, j) = (i as usize, j as usize);
        let faster = own[i].max(own[j]);
        for k in [i, j] {
            if movable[k] && faster > 2.0 * own[k] && faster > speeds[k] {
                speeds[k] = faster;
                changed = true;
            }
        }
    }
    changed
}

/// How far a body's surface can come in a step \[m\], at twice its speed for what impacts may make of it: its share
/// of a pair's margin. At least 5e-4 of its size and at most half of it, so that a contact is never felt from further
/// away than that; where contacts are used again while bodies hardly move, at least as far as they may move then.
fn reach<S: Geometry>(bodies: &Bodies<S>, settings: &Settings<S>, i: usize, dt: f64, speed: f64) -> f64 {
    if let Some(margin) = settings.contact_margin {
        return 0.5 * margin;
    }
    let extent = bodies.data[i].extent;
    if !bodies.is_dynamic(i) {
        return (speed * dt).min(extent); // no impact changes its speed
    }
    let least = if settings.scheme == Scheme::SoftStep { AGAIN } else { 5e-4 };
    (2.0 * speed * dt).clamp(least * extent, extent)
}

/// A contact's name from its bodies' serials and its feature: a fixed mixing of bits (SplitMix64's).
pub fn contact_id(a: u64, b: u64, feature: u64) -> u64 {
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
