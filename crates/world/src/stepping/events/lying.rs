//! The flow of a ball that lies on an obstacle at rest without friction, and has no other contact: one round of the
//! general way (`rounds.rs`), after which the place that came out has the same contact, in closed form.

use super::alone::{Held, Passage, Rules};
use super::contacts::is_fresh;
use super::flow::{Stick, flips};
use super::leaving::Found;
use super::memory::TURNED;
use super::rounds::{ONE_SIDE, SAME_ARM, SAME_NORMAL};
use super::timeline::Timeline;
use crate::narrow_phase::{Touch, touches_of};
use carom_geometry::{ContactPoint, Geometry};
use carom_math::{Column, Pose, Rotation};
use carom_solver::{Contact, Impulse, InverseMass, Twist};

/// A body, and the pair that it makes with an obstacle.
pub(super) type Lying = (usize, (usize, usize));

impl<S: Geometry> Timeline<'_, '_, S> {
    /// Lays a ball on its obstacle for a flow that begins with this contact; `None` where it does not lie there all the
    /// way.
    pub(super) fn lie(
        &self,
        lying: Lying,
        (first, feature): (Touch<S>, u64),
        passage: &mut Passage<S>,
        (rules, all): (&Rules, &mut Found<S>),
    ) -> Option<()> {
        let (i, pair) = lying;
        let (bodies, limits) = (&*self.bodies, &self.common.limits);
        let slot = usize::from(pair.1 == i);
        let obstacle = if slot == 1 { pair.0 } else { pair.1 };
        let (ball, other) = (&bodies.data[i], &bodies.data[obstacle]);
        let once = S::touch_once(ball.collider.as_ref()?, other.collider.as_ref()?);
        if !once || ball.turning_arm > 0.0 {
            return None;
        }
        let (m, before) = (&bodies.motion, passage.before);
        let origin = m.position[i];
        let approach = local_contact(&first, [origin, m.position[obstacle]], slot);
        let (mut masses, mut twists) = ([InverseMass::default(); 2], [Twist::default(); 2]);
        twists[slot] = before;
        let approach = approach.normal_velocity(&twists);
        let is_fresh = self.lies(&first, approach)?;
        // where the ball would be half-way at the velocity that it has, and its contact there
        let margin = 4.0 * limits.touching(ball, other) + self.reaches[pair.0] + self.reaches[pair.1];
        let half_way = |after: &Twist<S>| origin + (before.linear + after.linear) * 0.5 * (0.5 * rules.dt);
        let guessed = half_way(&before);
        let again = |middle: S::Vector, all: &mut Found<S>| {
            let p = self.point_of(lying, (&passage.half_turned, middle), margin, all)?;
            (p.feature == feature).then_some(Touch { point: p.point, normal: p.normal, ..first })
        };
        let touch = again(guessed, all)?;
        if touch.normal != first.normal {
            return None;
        }
        masses[slot].linear = ball.inverse_mass;
        masses[slot].angular = S::turned(&ball.inverse_inertia, &passage.half_turned);
        let mut contact = local_contact(&touch, [guessed, m.position[obstacle]], slot);
        let at_start = contact.normal_velocity(&twists);
        if rules.stick == Stick::End {
            contact.target -= at_start;
        }
        twists[slot] = rules.summed(passage);
        let law = self.common.settings.friction_law;
        let solver = &self.tools.solver;
        let (impulse, report) = solver.solve_alone(&contact, (&masses, &twists), law, &rules.solve)?;
        twists[slot] = passage.free;
        push(&contact, &impulse, &masses, &mut twists);
        let after = twists[slot];
        // the place that came out has the same contact
        let middle = half_way(&after);
        let found = if middle == guessed { touch } else { again(middle, all)? };
        let arm = [contact.arm_a, contact.arm_b][slot];
        let moved = (found.point - middle - arm).norm() / (SAME_ARM * ball.extent);
        let leaned = (touch.normal - found.normal).norm() / SAME_NORMAL;
        let one_side = found.normal.dot(first.normal) > ONE_SIDE;
        let came = (before.linear + after.linear) * (0.5 * rules.dt) * [1.0, -1.0][slot];
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
            touch: found,
            contact: Contact { a: pair.0, b: pair.1, ..contact },
            impulse,
            report,
            is_new: is_fresh || is_flipped,
            closing: at_start + contact.normal_velocity(&twists),
            turned: TURNED * ((arm - (first.point - origin)).norm() * after.angular.norm()),
        });
        Some(())
    }

    /// True for a contact with this normal velocity \[m/s\] that is new where the flow begins; `None` where it does not
    /// persist, or is not without friction.
    fn lies(&self, t: &Touch<S>, u: f64) -> Option<bool> {
        let limits = &self.common.limits;
        let plain = t.friction == 0.0 && t.rolling == 0.0 && t.spinning == 0.0;
        let deep = -t.gap > limits.overlap(&self.bodies.data[t.a], &self.bodies.data[t.b]);
        let pressed = self.common.warm.contacts.has_pressed(t.id);
        let rest = limits.rest_speed_of(t.restitution);
        // what comes faster strikes, or has not arrived
        let persists = u <= rest.max(limits.still_speed) && u >= -limits.slowest(pressed);
        (plain && !deep && persists).then(|| is_fresh(u, pressed, rest, limits))
    }

    /// The contact of a body with an obstacle and its feature, where it is the only one within a margin \[m\].
    pub(super) fn touch_of(
        &self,
        lying: Lying,
        margin: f64,
        found: &mut Found<S>,
    ) -> Option<(Touch<S>, u64)> {
        let m = &self.bodies.motion;
        let point = self.point_of(lying, (&m.rotation[lying.0], m.position[lying.0]), margin, found)?;
        found.touches.clear();
        touches_of(self.bodies, self.common.settings, lying.1, &[point], &mut found.touches);
        Some((found.touches[0], point.feature))
    }

    /// The contact point of a body, so turned and at a place, with an obstacle, where it is the only one within a margin
    /// \[m\].
    fn point_of(
        &self,
        (i, pair): Lying,
        (rotation, place): (&S::Rotation, S::Vector),
        margin: f64,
        found: &mut Found<S>,
    ) -> Option<ContactPoint<S>> {
        let bodies = &*self.bodies;
        let (ca, cb) = (bodies.data[pair.0].collider.as_ref()?, bodies.data[pair.1].collider.as_ref()?);
        if let Some(radius) = bodies.data[i].ball_radius {
            let (wall, wall_is_a) = if pair.0 == i { ((cb, pair.1), false) } else { ((ca, pair.0), true) };
            let wall = (wall.0, &bodies.shape_pose(wall.1));
            if let Some(point) = S::contact_with_wall((place, radius), wall, wall_is_a, margin) {
                return point;
            }
        }
        let pose = |k: usize| {
            let center = bodies.data[k].mass_properties.center;
            match (k == i, center == S::Vector::ZERO) {
                (false, _) => bodies.shape_pose(k),
                (true, true) => Pose::new(place, *rotation),
                (true, false) => Pose::new(place - rotation.rotate(center), *rotation),
            }
        };
        found.points.clear();
        S::contacts(ca, &pose(pair.0), cb, &pose(pair.1), margin, &mut found.points);
        match *found.points {
            [point] => Some(point),
            _ => None,
        }
    }
}

/// A contact between two bodies, the ball in this slot, from where both are.
fn local_contact<S: Geometry>(t: &Touch<S>, [ball, obstacle]: [S::Vector; 2], slot: usize) -> Contact<S> {
    let (a, b) = if slot == 0 { (ball, obstacle) } else { (obstacle, ball) };
    Contact {
        id: t.id,
        a: 0,
        b: 1,
        normal: t.normal,
        arm_a: t.point - a,
        arm_b: t.point - b,
        gap: t.gap,
        // what has arrived closes no more
        target: -0.0,
        slip_target: S::Slip::ZERO,
        restitution: t.restitution,
        friction: t.friction,
    }
}

/// Adds what an impulse does to the velocities of a contact's bodies.
fn push<S: Geometry>(
    c: &Contact<S>,
    impulse: &Impulse<S>,
    masses: &[InverseMass<S>; 2],
    v: &mut [Twist<S>; 2],
) {
    let force = c.to_world(impulse);
    v[0].add_scaled(&masses[0].apply(&Twist::new(force, S::moment(c.arm_a, force))), 1.0);
    v[1].add_scaled(&masses[1].apply(&Twist::new(force, S::moment(c.arm_b, force))), -1.0);
}
