//! What each contact got in the last step, whatever scheme took it: impulses of impacts and of persistent contact
//! added up, and whether it stuck or slipped. Read from what the step left behind; changes nothing.

use crate::narrow_phase::Touch;
use crate::observe::event_log::ContactSum;
use crate::world::World;
use carom_geometry::Geometry;
use carom_math::{Column, Space};
use carom_solver::Impulse;

/// What a contact did in the last step: names of [`Push::status`], by its codes.
pub const CONTACT_STATUS: [&str; 4] = ["apart", "sticks", "slips", "strikes"];

/// Share of its limit from which friction counts as at the limit \[1\]: projections land there to rounding.
const AT_THE_LIMIT: f64 = 1.0 - 1e-9;

/// What a contact got in the last step: impulses \[N s\], friction's limit mu gamma_n \[N s\], slip \[m/s\].
pub struct Push<S: Space> {
    /// On a, in the frame of the contact as it was found \[N s\].
    pub total: Impulse<S>,
    strikes: bool,
    friction_size: f64,
    /// Velocity of a's point against b's across the normal, after the step's impulses \[m/s\].
    pub slip: S::Vector,
    /// What of the impulse is the impacts', world axes.
    pub impact: S::Vector,
    /// Normal with which the persistent contact acted.
    pub kick_normal: S::Vector,
    /// Arm from a's centre of mass with which it acted \[m\].
    pub kick_arm: S::Vector,
    /// Rolling and spinning friction on a, world axes, over the whole step.
    pub moment: S::Spin,
}

impl<S: Space> Push<S> {
    /// Friction on a in world axes \[N s\].
    pub fn friction(&self, touch: &Touch<S>) -> S::Vector {
        spread(touch, &self.total)
    }
    /// What it did, as a code into [`CONTACT_STATUS`].
    pub fn status(&self, touch: &Touch<S>) -> usize {
        let at_the_limit = self.friction_size >= AT_THE_LIMIT * touch.friction * self.total.normal;
        match self.total.normal > 0.0 {
            false => 0,
            true if self.strikes => 3,
            true if at_the_limit => 2,
            true => 1,
        }
    }
}

/// Velocity of a's point against b's across the normal, from the arms to both.
fn slip<S: Geometry>(world: &World<S>, t: &Touch<S>, arm_a: S::Vector, arm_b: S::Vector) -> S::Vector {
    let motion = &world.bodies().motion;
    let u = motion.twist(t.a).at(arm_a) - motion.twist(t.b).at(arm_b);
    u - t.normal * u.dot(t.normal)
}

/// Sums over a step with events, touch by touch, as its log has them.
fn summed<S: Geometry>(world: &World<S>, sums: &[ContactSum<S>]) -> Vec<Push<S>> {
    let motion = &world.bodies().motion;
    let push = |(t, sum): (&Touch<S>, &ContactSum<S>)| {
        let arm = |i: usize| t.point - motion.position[i];
        let tangent = S::Slip::from_fn(|i| sum.impulse.dot(S::tangent(t.normal, i)));
        Push {
            total: Impulse { normal: sum.impulse.dot(t.normal), tangent },
            strikes: sum.impact != S::Vector::ZERO,
            friction_size: tangent.norm(),
            slip: slip(world, t, arm(t.a), arm(t.b)),
            impact: sum.impact,
            kick_normal: t.normal,
            kick_arm: arm(t.a),
            moment: sum.moment,
        }
    };
    world.touches().iter().zip(sums).map(push).collect()
}

/// What each of the world's touches got in its last step, in their order.
pub fn pushes<S: Geometry>(world: &World<S>) -> Vec<Push<S>> {
    if let Some(sums) = world.last_sums() {
        return summed(world, sums);
    }
    let motion = &world.bodies().motion;
    let across = |t: &Touch<S>, arm_a: S::Vector, arm_b: S::Vector| slip(world, t, arm_a, arm_b);
    let nothing = Impulse { normal: 0.0, tangent: S::Slip::ZERO };
    let strikes = world.last_strikes().iter().copied().chain(std::iter::repeat(nothing));
    let mut all: Vec<Push<S>> = (world.touches().iter().zip(strikes))
        .map(|(t, total)| {
            let arm = |i: usize| t.point - motion.position[i];
            Push {
                total,
                strikes: total.normal > 0.0,
                friction_size: total.tangent.norm(),
                slip: across(t, arm(t.a), arm(t.b)),
                impact: t.normal * total.normal + spread(t, &total),
                kick_normal: t.normal,
                kick_arm: S::Vector::ZERO,
                moment: S::Spin::ZERO,
            }
        })
        .collect();
    for (push, moment) in all.iter_mut().zip(world.last_strike_moments()) {
        push.moment = *moment;
    }
    let (problem, impulses, indices) = world.last_problem();
    for ((&k, contact), impulse) in indices.iter().zip(&problem.contacts).zip(&impulses.contacts) {
        // the kick's frame may have turned since detection: told in the frame of the contact as it was found
        let (t, force) = (&world.touches()[k], contact.to_world(impulse));
        all[k].total.normal += force.dot(t.normal);
        all[k].total.tangent += S::Slip::from_fn(|i| force.dot(S::tangent(t.normal, i)));
        all[k].friction_size += impulse.tangent.norm();
        (all[k].kick_normal, all[k].kick_arm) = (contact.normal, contact.arm_a);
        // the slip that friction was solved against: at the arms of the kick
        all[k].slip = across(&world.touches()[k], contact.arm_a, contact.arm_b);
    }
    for (r, m) in problem.resistances.iter().zip(&impulses.moments) {
        all[indices[r.contact]].moment += problem.contacts[r.contact].moment_to_world(*m);
    }
    all
}

/// The tangential part of an impulse in world axes.
fn spread<S: Space>(t: &Touch<S>, impulse: &Impulse<S>) -> S::Vector {
    let mut friction = S::Vector::ZERO;
    for k in 0..S::SLIP {
        friction += S::tangent(t.normal, k) * impulse.tangent[k];
    }
    friction
}
