//! How far surfaces can come within the step ahead: what contacts are looked for. Speeds are those that bodies have, with
//! what gravity and applied loads add in the step; impacts may double them.

use crate::abreast::Abreast;
use crate::bodies::{Bodies, BodyData};
use crate::body::BodyKind;
use crate::force::Wrench;
use crate::settings::{Scheme, Settings};
use crate::stepping::soft_step::AGAIN;
use carom_geometry::Geometry;
use carom_math::wide::{inner, minus, plus};
use carom_math::{Column, Inertia, Number, Pose, Precise, Rotation, Space, Wide};
use carom_solver::Twist;

/// Share of a body's size that it flies in a step for it to matter when it is halted, in the plane and in space: what flies behind it
/// stands in it by no more than that where nobody looked. In the plane it never matters: that all contacts of what falls are looked for
/// takes a drum's fall a third longer there, and in space hardly (ADR 13).
pub(crate) const SWIFT: [f64; 2] = [f64::INFINITY, 0.3];

/// The step ahead.
pub struct Ahead<'a, S: Geometry> {
    /// The bodies at its start.
    pub bodies: &'a Bodies<S>,
    /// The settings.
    pub settings: &'a Settings<S>,
    /// Its length \[s\].
    pub dt: f64,
    /// What applied loads do to the surface of each body \[m/s^2\]; empty without loads.
    pub pulls: &'a [f64],
    /// How strong gravity is \[m/s^2\].
    gravity: f64,
}

impl<S: Geometry> Clone for Ahead<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Geometry> Copy for Ahead<'_, S> {}

/// What a load does to the surface of a body \[m/s^2\]: |f|/m + |I^-1 t| arm.
pub fn pull<S: Geometry>(bodies: &Bodies<S>, i: usize, load: &Wrench<S>) -> f64 {
    if !bodies.is_dynamic(i) || *load == Wrench::default() {
        return 0.0;
    }
    let inverse = bodies.inverse_mass(i);
    let turning = inverse.angular.apply(load.torque).norm();
    let arm = if turning > 0.0 { bodies.data[i].reach_of_turning() } else { 0.0 };
    load.force.norm() * inverse.linear + turning * arm
}

impl<'a, S: Geometry> Ahead<'a, S> {
    /// The step ahead of bodies as they are.
    pub fn new(bodies: &'a Bodies<S>, settings: &'a Settings<S>, dt: f64, pulls: &'a [f64]) -> Self {
        Ahead { bodies, settings, dt, pulls, gravity: settings.gravity.norm() }
    }

    /// A body in it.
    pub fn mover(&self, i: usize) -> Mover<S> {
        let mut mover = Mover::of(&self.bodies.data[i], i, 0);
        mover.moved(self);
        mover
    }
}

/// A body in the step ahead, all that pairs are asked of it side by side in memory.
#[derive(Clone, Copy)]
pub struct Mover<S: Space> {
    /// Its index.
    pub index: usize,
    /// Its serial.
    pub serial: u64,
    /// Place of the centre of mass \[m\].
    pub position: S::Vector,
    /// Attitude.
    pub rotation: S::Rotation,
    /// Velocities.
    pub twist: Twist<S>,
    /// Largest extent \[m\].
    pub extent: f64,
    /// How far a point of its surface moves per radian of turning \[m\].
    pub arm: f64,
    /// The least that its surface is thought to come in a step \[m\]; 0 for what impulses do not move.
    pub least: f64,
    /// What gravity and loads do to its surface \[m/s^2\]: rates, for it may sleep through steps of other lengths.
    pub falls: f64,
    /// What loads alone do \[m/s^2\].
    pub pull: f64,
    /// The shape's frame from the centre of mass, backwards \[m\].
    center: S::Vector,
    /// How far a point of its surface is from the shape's frame at most \[m\]; 0 where turning moves none.
    pub reach: f64,
    groups: u32,
    collides_with: u32,
    /// Bodies of one number have the same surface.
    pub surface: u32,
    can_move: bool,
    is_dynamic: bool,
    /// Its shape has faces, edges and corners alone.
    is_angular: bool,
}

impl<S: Geometry> Mover<S> {
    /// A body whose motion is not known yet.
    pub fn of(d: &BodyData<S>, index: usize, surface: u32) -> Self {
        let center = d.mass_properties.center;
        Mover {
            index,
            serial: d.serial,
            position: S::Vector::ZERO,
            rotation: S::Rotation::IDENTITY,
            twist: Twist::default(),
            extent: d.extent,
            arm: d.reach_of_turning(),
            least: 0.0,
            falls: 0.0,
            pull: 0.0,
            center,
            reach: d.turning_arm + center.norm(),
            groups: d.groups,
            collides_with: d.collides_with,
            surface,
            can_move: d.inverse_mass > 0.0,
            is_dynamic: d.kind == BodyKind::Dynamic,
            is_angular: d.is_angular,
        }
    }

    /// Takes in its motion, and what the step ahead is for it.
    #[inline(always)]
    pub fn moved(&mut self, ahead: &Ahead<S>) {
        let (motion, i) = (&ahead.bodies.motion, self.index);
        (self.position, self.rotation) = (motion.position[i], motion.rotation[i]);
        (self.twist.linear, self.twist.angular) = (motion.velocity[i], motion.angular_velocity[i]);
        self.pull = ahead.pulls.get(i).copied().unwrap_or(0.0);
        let least = if ahead.settings.scheme == Scheme::SoftStep { AGAIN } else { 5e-4 };
        self.least = if self.is_dynamic { least * self.extent } else { 0.0 };
        self.falls = if self.is_dynamic { ahead.gravity + self.pull } else { self.pull };
    }

    /// Whether all of some bodies want to collide with each other by their groups, as far as that is told by what all have in common.
    pub fn all_collide(some: &[Self]) -> bool {
        let (groups, with) = some.iter().fold((!0, !0), |all, m| (all.0 & m.groups, all.1 & m.collides_with));
        groups & with != 0
    }

    /// Whether a speed \[m/s\] takes it so far in a step that it matters when it is halted.
    #[inline(always)]
    pub fn is_swift(&self, speed: f64, dt: f64) -> bool {
        self.is_dynamic && speed * dt >= SWIFT[S::DIM - 2] * self.extent
    }

    /// Pose of the shape's own frame: the centre of mass is at its local `center`.
    #[inline(always)]
    pub fn shape_pose(&self) -> Pose<S> {
        if self.center == S::Vector::ZERO {
            return Pose::new(self.position, self.rotation);
        }
        Pose::new(self.position - self.rotation.rotate(self.center), self.rotation)
    }

    /// Largest speed of its surface in a step before impacts \[m/s\].
    #[inline(always)]
    pub fn speed(&self, dt: f64) -> f64 {
        let linear = self.twist.linear.norm();
        if !self.extent.is_finite() {
            return linear; // a wall, maybe a driven one; that it does not turn much is the user's matter
        }
        linear + self.arm * self.twist.angular.norm() + self.falls * dt
    }

    /// How far its surface can come in a step \[m\], at twice its speed for what impacts may make of it: its share
    /// of a pair's margin. At least 5e-4 of its size and at most half of it, so that a contact is never felt from further
    /// away than that; where contacts are used again while bodies hardly move, at least as far as they may move then.
    #[inline(always)]
    pub fn margin(&self, ahead: &Ahead<S>, speed: f64) -> f64 {
        if let Some(margin) = ahead.settings.contact_margin {
            return 0.5 * margin;
        }
        if !self.is_dynamic {
            return (speed * ahead.dt).min(self.extent); // no impact changes its speed
        }
        (2.0 * speed * ahead.dt).clamp(self.least, self.extent)
    }
}

/// Two bodies side by side.
#[derive(Clone, Copy)]
pub struct Couple<'a, S: Space> {
    /// Body a.
    pub a: &'a Mover<S>,
    /// Body b.
    pub b: &'a Mover<S>,
}

impl<S: Space> Couple<'_, S> {
    /// Their indices.
    #[inline]
    pub fn indices(&self) -> (usize, usize) {
        (self.a.index, self.b.index)
    }

    /// Their serials.
    #[inline]
    pub fn serials(&self) -> (u64, u64) {
        (self.a.serial, self.b.serial)
    }

    /// Whether one of them can move and both want to collide.
    #[inline]
    pub fn may_meet(&self) -> bool {
        let (a, b) = (self.a, self.b);
        (a.can_move || b.can_move) && a.groups & b.collides_with != 0 && b.groups & a.collides_with != 0
    }

    /// Whether both have faces, edges and corners alone.
    #[inline]
    pub fn are_angular(&self) -> bool {
        self.a.is_angular && self.b.is_angular
    }

    /// Whether body a is the smaller one.
    #[inline]
    pub fn a_is_small(&self) -> bool {
        self.a.extent <= self.b.extent
    }
}

impl<'a, S: Space> Couple<'a, S> {
    /// The smaller one, and the larger one.
    #[inline]
    pub fn by_size(&self) -> [&'a Mover<S>; 2] {
        if self.a_is_small() { [self.a, self.b] } else { [self.b, self.a] }
    }
}

/// How fast surfaces of pairs can come towards each other, as they move now \[m/s\]. Of each its smaller body and its larger one are
/// asked for.
#[inline(always)]
pub fn closing<'a, S: Geometry, P: Abreast<[&'a Mover<S>; 2]>>(pairs: P) -> P::Number {
    Moving::closing(&motion(pairs, 0), &motion(pairs, 1), pairs.read(|pair| pair[0].arm))
}

/// How bodies move, in numbers of a kind.
#[derive(Clone, Copy)]
pub(crate) struct Moving<S: Wide, R: Number> {
    pub place: S::Vectors<R>,
    pub velocity: S::Vectors<R>,
    pub spin: S::Spins<R>,
}

impl<S: Wide, R: Precise> Moving<S, R> {
    /// How fast surfaces of smaller bodies and larger ones can come towards each other \[m/s\]: |v + w x r| + |dw| arm of [`within`].
    #[inline(always)]
    pub fn closing(small: &Self, large: &Self, arm: R) -> R {
        let swing = S::wide_swing(&large.spin, &minus(&small.place, &large.place));
        let passing = minus(&small.velocity, &plus(&large.velocity, &swing));
        let turning = minus(&small.spin, &large.spin);
        inner(&passing, &passing).root() + inner(&turning, &turning).root() * arm
    }
}

/// The margins of pairs in a soft step of length `dt` \[m\], as [`within`] has them.
#[inline(always)]
pub(crate) fn approach<'a, S: Geometry, P: Abreast<[&'a Mover<S>; 2]>>(
    pairs: P,
    closing: P::Number,
    dt: f64,
) -> P::Number {
    let falls = pairs.read(|[a, b]| (a.falls + b.falls) * dt);
    let (least, twice) = (pairs.read(|[a, b]| a.least + b.least), pairs.read(|_| 2.0 * dt));
    within((closing, falls), least, twice)
}

/// The margins of pairs in a soft step \[m\], of two of its lengths \[s\]: how far two surfaces can come towards each other in it, at twice
/// their speed of approach and what gravity and loads add to it \[m/s\], and no less than the least \[m\]. What flies side by side hardly
/// meets, however fast it is; in a drum that turns, what lies on its wall. Seen from the larger body every point of the smaller one moves
/// at |v + w x r| + |dw| arm, with the velocities v and spins w of the larger one and dw of both against each other. What a hit of
/// this step does to others is the meeting's matter.
#[inline(always)]
pub(crate) fn within<R: Precise>((closing, falls): (R, R), least: R, twice: R) -> R {
    let margin = twice * (closing + falls);
    least.choose(margin, margin, least)
}

/// How the smaller bodies of pairs move, or the larger ones.
#[inline(always)]
fn motion<'a, S: Geometry, P: Abreast<[&'a Mover<S>; 2]>>(pairs: P, i: usize) -> Moving<S, P::Number> {
    Moving {
        place: pairs.several(|pair, k| pair[i].position[k]),
        velocity: pairs.several(|pair, k| pair[i].twist.linear[k]),
        spin: pairs.several(|pair, k| pair[i].twist.angular[k]),
    }
}
