//! The flow of a ball that lies on an obstacle at rest without friction, and has no other contact: one round of the
//! general way (`rounds.rs`), after which the place that came out has the same contact, in closed form.

use super::alone::{Held, Passage, Rules};
use super::contacts::is_fresh;
use super::flow::{Stick, flips};
use super::leaving::Found;
use super::memory::TURNED;
use super::rounds::{ONE_SIDE, Place, SAME_ARM, SAME_NORMAL};
use super::timeline::Timeline;
use crate::bodies::Bodies;
use crate::narrow_phase::{InCommon, Touch};
use carom_geometry::{ContactPoint, Geometry};
use carom_math::{Column, Pose, Rotation};
use carom_solver::methods::ladder::Resting;
use carom_solver::{Contact, Impulse, InverseMass, Twist};

/// A body and an obstacle at rest that it may touch.
pub(super) struct Beside<'b, S: Geometry> {
    /// The body.
    body: usize,
    obstacle: usize,
    pair: (usize, usize),
    collider: &'b S::Collider,
    wall: &'b S::Collider,
    /// Where the obstacle's shape is.
    pose: Pose<S>,
}

impl<'b, S: Geometry> Beside<'b, S> {
    /// A body beside the other one of a pair; `None` where one of them has no shape.
    pub fn of(bodies: &'b Bodies<S>, body: usize, pair: (usize, usize)) -> Option<Self> {
        let obstacle = if pair.0 == body { pair.1 } else { pair.0 };
        let (collider, wall) =
            (bodies.data[body].collider.as_ref()?, bodies.data[obstacle].collider.as_ref()?);
        Some(Beside { body, obstacle, pair, collider, wall, pose: bodies.shape_pose(obstacle) })
    }

    /// The body's place in the pair.
    fn slot(&self) -> usize {
        usize::from(self.pair.1 == self.body)
    }
}

impl<S: Geometry> Timeline<'_, '_, S> {
    /// Lays a ball on its obstacle for a flow that begins with this contact; `None` where it does not lie there all the
    /// way.
    pub(super) fn lie(
        &self,
        beside: &Beside<S>,
        (first, feature): (Touch<S>, u64),
        passage: &mut Passage<S>,
        (rules, all): (&Rules, &mut Found<S>),
    ) -> Option<()> {
        let (i, pair, slot) = (beside.body, beside.pair, beside.slot());
        let (bodies, limits) = (&*self.bodies, &self.common.limits);
        let (ball, other) = (&bodies.data[i], &bodies.data[beside.obstacle]);
        if ball.turning_arm > 0.0 || !S::touch_once(beside.collider, beside.wall) {
            return None;
        }
        let (m, before) = (&bodies.motion, passage.before);
        let (origin, seat) = (m.position[i], m.position[beside.obstacle]);
        // the obstacle rests: its point has no velocity
        let sign = [1.0, -1.0][slot];
        let along = |v: &Twist<S>, arm: S::Vector, normal: S::Vector| sign * v.at(arm).dot(normal);
        let approach = along(&before, first.point - origin, first.normal);
        let (is_fresh, pressed_as) = self.lies(&first, approach)?;
        // where the ball would be half-way at the velocity that it has, and its contact there
        let margin = 4.0 * limits.touching(ball, other) + self.reaches[pair.0] + self.reaches[pair.1];
        let half_way = |after: &Twist<S>| origin + (before.linear + after.linear) * 0.5 * (0.5 * rules.dt);
        let guessed = half_way(&before);
        let half_turned = passage.half_turned;
        let again = |middle: S::Vector, all: &mut Found<S>| -> Option<Place<S>> {
            let p = self.point_of(beside, (&half_turned, middle), margin, &mut all.points)?;
            (p.feature == feature).then_some(Place { point: p.point, normal: p.normal })
        };
        let place = again(guessed, all)?;
        if place.normal != first.normal {
            return None;
        }
        let arm = place.point - guessed;
        let at_start = along(&before, arm, place.normal);
        let arms = if slot == 0 { [arm, place.point - seat] } else { [place.point - seat, arm] };
        let contact = Contact {
            id: first.id,
            a: 0,
            b: 1,
            normal: place.normal,
            arm_a: arms[0],
            arm_b: arms[1],
            gap: first.gap,
            // what has arrived closes no more
            target: if rules.stick == Stick::End { -0.0 - at_start } else { -0.0 },
            slip_target: S::Slip::ZERO,
            restitution: first.restitution,
            friction: first.friction,
        };
        let mass = InverseMass {
            linear: ball.inverse_mass,
            angular: S::turned(&ball.inverse_inertia, &half_turned),
        };
        let (normal, target, velocity) = (place.normal * sign, contact.target, rules.summed(passage));
        let resting = Resting { normal, arm, target, mass, velocity };
        let (impulse, report) = self.tools.solver.solve_resting(&resting, &rules.solve)?;
        let force = contact.normal * impulse;
        let mut after = passage.free;
        after.add_scaled(&mass.apply(&Twist::new(force, S::moment(arm, force))), sign);
        // the place that came out has the same contact
        let middle = half_way(&after);
        let found = if middle == guessed { place } else { again(middle, all)? };
        let moved = (found.point - middle - arm).norm() / (SAME_ARM * ball.extent);
        let leaned = (place.normal - found.normal).norm() / SAME_NORMAL;
        let one_side = found.normal.dot(first.normal) > ONE_SIDE;
        let came = (before.linear + after.linear) * (0.5 * rules.dt) * sign;
        let is_deep = first.gap + first.normal.dot(came) < -0.5 * limits.overlap(ball, other);
        if !one_side || leaned.max(moved) > 1.0 || is_deep {
            return None;
        }
        let known = &self.common.warm.contacts;
        let is_flipped = flips(approach, at_start, limits) && approach.abs() > known.turned(first.id);
        passage.after = after;
        passage.held = Some(all.held.len());
        all.held.push(Held {
            body: i,
            touch: Touch { point: found.point, normal: found.normal, ..first },
            contact: Contact { a: pair.0, b: pair.1, ..contact },
            impulse: Impulse { normal: impulse, tangent: S::Slip::ZERO },
            report,
            pressed_as,
            is_new: is_fresh || is_flipped,
            closing: at_start + along(&after, arm, place.normal),
            turned: TURNED * ((arm - (first.point - origin)).norm() * after.angular.norm()),
        });
        Some(())
    }

    /// Whether a contact with this normal velocity \[m/s\] is new where the flow begins, and its place among those that pressed
    /// before; `None` where it does not persist, or is not without friction.
    fn lies(&self, t: &Touch<S>, u: f64) -> Option<(bool, Option<usize>)> {
        let limits = &self.common.limits;
        let plain = t.friction == 0.0 && t.rolling == 0.0 && t.spinning == 0.0;
        let deep = -t.gap > limits.overlap(&self.bodies.data[t.a], &self.bodies.data[t.b]);
        let pressed_as = self.common.warm.contacts.pressed_as(t.id);
        let pressed = pressed_as.is_some();
        let rest = limits.rest_speed_of(t.restitution);
        // what comes faster strikes, or has not arrived
        let persists = u <= rest.max(limits.still_speed) && u >= -limits.slowest(pressed);
        (plain && !deep && persists).then(|| (is_fresh(u, pressed, rest, limits), pressed_as))
    }

    /// The contact of a body with an obstacle and its feature, where it is the only one within a margin \[m\].
    pub(super) fn touch_of(
        &self,
        beside: &Beside<S>,
        margin: f64,
        points: &mut Vec<ContactPoint<S>>,
    ) -> Option<(Touch<S>, u64)> {
        let m = &self.bodies.motion;
        let i = beside.body;
        let point = self.point_of(beside, (&m.rotation[i], m.position[i]), margin, points)?;
        let of_all = InCommon::of(self.bodies, self.common.settings, beside.pair);
        Some((of_all.touch(&point), point.feature))
    }

    /// The contact point of a body, so turned and at a place, with an obstacle, where it is the only one within a margin
    /// \[m\].
    #[inline]
    fn point_of(
        &self,
        beside: &Beside<S>,
        (rotation, place): (&S::Rotation, S::Vector),
        margin: f64,
        points: &mut Vec<ContactPoint<S>>,
    ) -> Option<ContactPoint<S>> {
        let Beside { collider, wall, pose, .. } = beside;
        let wall_is_a = beside.slot() == 1;
        if let Some(radius) = self.bodies.data[beside.body].ball_radius
            && let Some(point) = S::contact_with_wall((place, radius), (wall, pose), wall_is_a, margin)
        {
            return point;
        }
        let center = self.bodies.data[beside.body].mass_properties.center;
        let own = match center == S::Vector::ZERO {
            true => Pose::new(place, *rotation),
            false => Pose::new(place - rotation.rotate(center), *rotation),
        };
        points.clear();
        match wall_is_a {
            true => S::contacts(wall, pose, collider, &own, margin, points),
            false => S::contacts(collider, &own, wall, pose, margin, points),
        }
        match **points {
            [point] => Some(point),
            _ => None,
        }
    }
}
