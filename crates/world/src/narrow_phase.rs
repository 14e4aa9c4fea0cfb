//! From bodies that are near to contacts with names, gaps and coefficients. Knows no velocities' future:
//! what a contact means for the motion is the scheme's matter.

use crate::bodies::Bodies;
use crate::material::{MaterialPair, Mixing};
use crate::settings::{Scheme, Settings};
use crate::stepping::soft_step::AGAIN;
use carom_geometry::broad_phase::{BroadPhase, Changed};
use carom_geometry::{Aabb, ContactPoint, Geometry};
use carom_math::{Column, Pose, Space};

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

/// Finds contacts; holds memory, the broad phase's order and the boxes of bodies that stand, nothing that changes an
/// answer.
#[derive(Default)]
pub struct NarrowPhase<S: Geometry> {
    broad: BroadPhase<S>,
    /// For which standing bodies and which margin the boxes of those that stand were made.
    made_for: Option<(u64, Option<f64>)>,
    /// For which sleeping bodies their boxes were made.
    slept_for: Option<u64>,
    /// Places in the columns of bodies that may move, and of those that sleep.
    moving: Vec<u32>,
    asleep: Vec<u32>,
    /// Place of each body in the columns; `u32::MAX` of those without a shape.
    places: Vec<u32>,
    bounds: Vec<Aabb<S>>,
    margins: Vec<f64>,
    poses: Vec<Pose<S>>,
    /// Speeds, own ones and those shared with neighbours.
    own: Vec<f64>,
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
        let (stands_as_before, sleeps_as_before) = self.prepare(bodies, settings, dt);
        let data = &bodies.data;
        let indices = &self.indices;
        let may_pair = |i: usize, j: usize| {
            let (a, b) = (&data[indices[i]], &data[indices[j]]);
            let moves = a.inverse_mass > 0.0 || b.inverse_mass > 0.0;
            let groups = a.groups & b.collides_with != 0 && b.groups & a.collides_with != 0;
            moves && groups && !bodies.joints.keeps_apart(indices[i], indices[j])
        };
        let (others, asleep) = (self.moving.as_slice(), self.asleep.as_slice());
        let changed = Changed { others, asleep, stands_as_before, sleeps_as_before };
        let mut pairs = self.broad.update_some(&self.bounds, &self.movable, changed, &may_pair);
        if settings.contact_margin.is_none()
            && share_speeds(pairs, &self.movable, &mut self.speeds, &self.own)
        {
            let faster = |k: &&u32| self.speeds[**k as usize] != self.own[**k as usize];
            for k in self.moving.iter().filter(faster).map(|k| *k as usize) {
                let i = indices[k];
                self.margins[k] = reach(bodies, settings, i, dt, self.speeds[k]);
                let Some(collider) = &data[i].collider else { continue };
                self.bounds[k] = S::bounds(collider, &self.poses[k], self.margins[k]);
            }
            let changed = Changed { others, asleep, stands_as_before: true, sleeps_as_before: true };
            pairs = self.broad.update_some(&self.bounds, &self.movable, changed, &may_pair);
        }
        for &(i, j) in pairs {
            let (i, j) = (i as usize, j as usize);
            let (a, b) = (indices[i], indices[j]);
            if known(a, b, out) {
                continue;
            }
            let margin = self.margins[i] + self.margins[j];
            self.points.clear();
            let (Some(ca), Some(cb)) = (&data[a].collider, &data[b].collider) else { continue };
            S::contacts(ca, &self.poses[i], cb, &self.poses[j], margin, &mut self.points);
            touches_of(bodies, settings, (a, b), &self.points, out);
        }
    }

    /// Bounds of all bodies with a shape, grown by half of each pair's margin; of those that stand or sleep only where they
    /// are others than before. True where they are not, of those that stand and of those that sleep.
    fn prepare(&mut self, bodies: &Bodies<S>, settings: &Settings<S>, dt: f64) -> (bool, bool) {
        let wanted = bodies.standing().map(|number| (number, settings.contact_margin));
        let stands = wanted.is_some() && wanted == self.made_for;
        if !stands {
            self.make_room(bodies);
            self.made_for = wanted;
        }
        let sleeps = stands && self.slept_for == Some(bodies.sleep_number());
        if !sleeps {
            self.part(bodies);
            self.slept_for = Some(bodies.sleep_number());
        }
        let (moving, asleep) = (std::mem::take(&mut self.moving), std::mem::take(&mut self.asleep));
        if stands {
            let slept = if sleeps { &[] } else { asleep.as_slice() };
            moving.iter().chain(slept).for_each(|k| self.place(*k as usize, bodies, settings, dt));
        } else {
            (0..self.indices.len()).for_each(|k| self.place(k, bodies, settings, dt));
        }
        (self.moving, self.asleep) = (moving, asleep);
        (stands, sleeps)
    }

    /// Sorts the bodies that are not fixed by whether they sleep.
    fn part(&mut self, bodies: &Bodies<S>) {
        let places = |list: &[u32], to: &mut Vec<u32>| {
            to.clear();
            to.extend(list.iter().map(|i| self.places[*i as usize]).filter(|k| *k != u32::MAX));
        };
        places(bodies.movers(), &mut self.moving);
        places(bodies.asleep(), &mut self.asleep);
    }

    /// Columns of all bodies with a shape.
    fn make_room(&mut self, bodies: &Bodies<S>) {
        self.indices.clear();
        self.movable.clear();
        self.places.clear();
        self.places.resize(bodies.len(), u32::MAX);
        for (i, d) in bodies.data.iter().enumerate().filter(|(_, d)| d.collider.is_some()) {
            self.places[i] = self.indices.len() as u32;
            self.indices.push(i);
            self.movable.push(d.inverse_mass > 0.0);
        }
        let count = self.indices.len();
        self.bounds.resize(count, Aabb { min: S::Vector::ZERO, max: S::Vector::ZERO });
        self.poses.resize(count, Pose::default());
        for column in [&mut self.margins, &mut self.speeds, &mut self.own] {
            column.resize(count, 0.0);
        }
    }

    /// Box, pose, speed and margin of a body.
    fn place(&mut self, k: usize, bodies: &Bodies<S>, settings: &Settings<S>, dt: f64) {
        let i = self.indices[k];
        let Some(collider) = &bodies.data[i].collider else { return };
        self.speeds[k] = speed(bodies, settings, i, dt);
        self.own[k] = self.speeds[k];
        self.margins[k] = reach(bodies, settings, i, dt, self.speeds[k]);
        self.poses[k] = bodies.shape_pose(i);
        self.bounds[k] = S::bounds(collider, &self.poses[k], self.margins[k]);
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
    let (one, other) = (&bodies.data[a], &bodies.data[b]);
    // what was said of the pair's materials, where something was said of any
    let said = bodies.materials.said_of(one.material, other.material);
    let of = |coefficient: fn(&MaterialPair) -> Option<f64>, mixed: f64| {
        said.and_then(coefficient).unwrap_or(mixed)
    };
    let friction = of(|p| p.friction, settings.friction_mixing.mix(one.friction, other.friction));
    // either body's softness makes the moment: the larger coefficient is the contact's
    let rolling = of(|p| p.rolling_friction, Mixing::Max.mix(one.rolling_friction, other.rolling_friction));
    let spinning =
        of(|p| p.spinning_friction, Mixing::Max.mix(one.spinning_friction, other.spinning_friction));
    let mixing = settings.restitution_mixing;
    let restitution = of(|p| p.restitution, mixing.mix(one.restitution, other.restitution));
    let tangential = mixing.mix(one.tangential_restitution, other.tangential_restitution);
    let tangential_restitution = of(|p| p.tangential_restitution, tangential);
    let name = pair_id(one.serial, other.serial);
    out.extend(points.iter().map(|p| Touch {
        id: mix_bits(name ^ p.feature),
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
    let said = bodies.materials.said_of(one.material, other.material);
    let mixed = settings.restitution_mixing.mix(one.restitution, other.restitution);
    said.and_then(|p| p.restitution).unwrap_or(mixed)
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
fn share_speeds(pairs: &[(u32, u32)], movable: &[bool], speeds: &mut [f64], own: &[f64]) -> bool {
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
    mix_bits(pair_id(a, b) ^ feature)
}

fn pair_id(a: u64, b: u64) -> u64 {
    mix_bits(mix_bits(a.wrapping_add(0x9e37_79b9_7f4a_7c15)) ^ b)
}

fn mix_bits(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
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
