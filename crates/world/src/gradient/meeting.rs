//! What makes a moment, as an equation g = 0 on the flows that end there (theory eq. 10.6): the gap of a contact that
//! arrives, the slip of one that stops. A change of the states moves the moment by dt = -(g_s ds)/g', g' the rate of g
//! along the flows.

use super::flowing::{Scene, point_of, poses};
use super::lift;
use super::sums::{StateBar, add};
use super::touching::{Nearby, SpotSlopes, carried, cross, dot};
use crate::contact_id::contact_id;
use crate::narrow_phase::Touch;
use crate::stepping::events::tape::{Flow, Tape};
use carom_geometry::Geometry;
use carom_math::{Column, Pose, Rotation, Space};
use carom_solver::Twist;

/// Slips below this are none \[m/s\].
const NO_SLIP: f64 = 1e-9;
/// Gap over a pair's size up to which a contact has arrived \[1\].
const ARRIVED: f64 = 1e-9;

/// A slip that stops: what is left of it over its speed, contact, speed, direction, and what is left.
type Stopping<V> = (f64, usize, f64, V, V);

/// The derivatives of an equation that makes a moment.
#[derive(Default)]
pub struct Equation {
    /// By the states of bodies (in the world) at the moment; of obstacles too.
    pub ends: Vec<(usize, StateBar)>,
    /// By the poses half-way of the first flow's members; empty for none.
    pub mids: Vec<[f64; 6]>,
    /// By the states at the first flow's start; empty for none.
    pub starts: Vec<StateBar>,
}

/// The gap of the contact that arrives; `None` where it has not, or where bodies come from another event just then.
pub fn arrival<S: Geometry>(
    scene: &Scene<S>,
    tape: &Tape<S>,
    flows: &[Flow<S>],
    (a, b): (usize, usize),
    id: u64,
    moment: f64,
) -> Option<Equation> {
    let bodies = scene.bodies;
    let pose = |i: usize| -> Option<Pose<S>> {
        if !bodies.is_dynamic(i) {
            let m = &tape.origin;
            let turn = S::Rotation::about(m.angular_velocity[i] * moment);
            return Some(Pose::new(m.position[i] + m.velocity[i] * moment, m.rotation[i].then(&turn)));
        }
        let member = |f: &Flow<S>| f.members.binary_search(&i).ok().map(|k| f.end.pose(k));
        flows.iter().find_map(member)
    };
    let near = Nearby::of(bodies, (a, b), [pose(a)?, pose(b)?])?;
    let serials = (bodies.data[a].serial, bodies.data[b].serial);
    let spot = near.here.iter().find(|p| contact_id(serials.0, serials.1, p.feature) == id)?;
    let size = bodies.data[a].extent.min(bodies.data[b].extent);
    if spot.gap.abs() > ARRIVED * size {
        return None;
    }
    let slopes = near.slopes(id, spot.normal, spot.point)?;
    let mut ends = Vec::new();
    for (body, first) in [(a, 0), (b, 6)] {
        let mut bar = [0.0; 12];
        (0..6).for_each(|k| bar[k] = slopes[first + k].gap);
        ends.push((body, bar));
    }
    Some(Equation { ends, ..Equation::default() })
}

/// The slip, along its first direction, of the contact that has come nearest to its stop.
pub fn stop<S: Geometry>(scene: &Scene<S>, flow: &Flow<S>) -> Option<Equation> {
    let contacts = &flow.last.problem.contacts;
    let slipping = |t: &&Touch<S>| t.friction > 0.0;
    let mut best: Option<Stopping<S::Vector>> = None;
    for (k, t) in flow.touches.iter().enumerate().filter(|(_, t)| slipping(t)) {
        let at = |i: usize| flow.start.twist(i).at(t.point - flow.start.position[i]);
        let slip = along_surface::<S>(at(t.a) - at(t.b), t.normal);
        let speed = slip.norm();
        let c = &contacts[k];
        let left = flow.end.twist(c.a).at(c.arm_a) - flow.end.twist(c.b).at(c.arm_b);
        let left = along_surface::<S>(left, c.normal);
        if speed > NO_SLIP {
            let direction = slip * (1.0 / speed);
            let rest = left.dot(direction).abs() / speed;
            if best.as_ref().is_none_or(|b| rest < b.0) {
                best = Some((rest, k, speed, direction, left));
            }
        }
    }
    let (_, k, speed, direction, left) = best?;
    let count = flow.members.len();
    let mut equation =
        Equation { ends: Vec::new(), mids: vec![[0.0; 6]; count], starts: vec![[0.0; 12]; count] };
    let c = &contacts[k];
    let mut own = scene.bodies.some(&flow.members);
    // at the end the arms are those of half-way
    own.motion.copy_from(&flow.start);
    for i in [c.a, c.b] {
        let arm = if i == c.a { c.arm_a } else { c.arm_b };
        own.motion.position[i] = flow.last.touches[k].point - arm;
        crate::integrate::turn_freely(scene.settings.integrator, &mut own, i, 0.5 * flow.last.time);
    }
    let slopes = slopes_of(&own, (c.a, c.b), c.id, c.normal, point_of(&own, c));
    let ends = Slip {
        twists: [flow.end.twist(c.a), flow.end.twist(c.b)],
        arms: [c.arm_a, c.arm_b],
        normal: c.normal,
    };
    let bars = ends.pull(direction, &slopes);
    for (side, member) in [c.a, c.b].into_iter().enumerate() {
        let mut bar = [0.0; 12];
        bar[6..].copy_from_slice(&bars[side].0);
        equation.ends.push((flow.members[member], bar));
        add(&mut equation.mids[member], &bars[side].1, 1.0);
    }
    // the first direction turns with the first slip
    let t = &flow.touches[k];
    let across = (left - direction * left.dot(direction)) * (1.0 / speed);
    if across.norm() > 0.0 {
        own.motion.copy_from(&flow.start);
        let m = &flow.start;
        let arms = [t.point - m.position[t.a], t.point - m.position[t.b]];
        let slopes = slopes_of(&own, (t.a, t.b), t.id, t.normal, t.point);
        let starts = Slip { twists: [m.twist(t.a), m.twist(t.b)], arms, normal: t.normal };
        for (member, bar) in [t.a, t.b].into_iter().zip(starts.pull(across, &slopes)) {
            add(&mut equation.starts[member][..6], &bar.1, 1.0);
            add(&mut equation.starts[member][6..], &bar.0, 1.0);
        }
    }
    Some(equation)
}

fn along_surface<S: Space>(v: S::Vector, normal: S::Vector) -> S::Vector {
    v - normal * normal.dot(v)
}

/// How a contact changes with its bodies where they are.
fn slopes_of<S: Geometry>(
    own: &crate::bodies::Bodies<S>,
    pair: (usize, usize),
    id: u64,
    normal: S::Vector,
    point: S::Vector,
) -> SpotSlopes {
    let near = Nearby::of(own, pair, poses(&own.motion, pair));
    let found = near.and_then(|n| n.slopes(id, normal, point));
    found.unwrap_or_else(|| carried((own.is_dynamic(pair.0), own.is_dynamic(pair.1))))
}

/// A contact's slip (u - n n.u) of two bodies.
struct Slip<S: Space> {
    twists: [Twist<S>; 2],
    arms: [S::Vector; 2],
    normal: S::Vector,
}

impl<S: Space> Slip<S> {
    /// Derivatives of the slip's component along a direction by each body's velocities, and by its pose.
    fn pull(&self, direction: S::Vector, slopes: &SpotSlopes) -> [([f64; 6], [f64; 6]); 2] {
        let n = lift::vector::<S>(self.normal);
        let d = lift::vector::<S>(direction);
        let relative = lift::vector::<S>(self.twists[0].at(self.arms[0]) - self.twists[1].at(self.arms[1]));
        let (across, through) = (dot(n, d), dot(n, relative));
        let along: [f64; 3] = std::array::from_fn(|k| d[k] - across * n[k]);
        let mut bars = [([0.0; 6], [0.0; 6]); 2];
        let mut point = [0.0; 3];
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let (arm, w) = (lift::vector::<S>(self.arms[side]), lift::spin::<S>(self.twists[side].angular));
            let (turning, tip) = (cross(arm, along), cross(along, w));
            for k in 0..3 {
                bars[side].0[k] = sign * along[k];
                bars[side].0[3 + k] = sign * turning[k];
                bars[side].1[k] -= sign * tip[k];
                point[k] += sign * tip[k];
            }
        }
        let normal: [f64; 3] = std::array::from_fn(|k| -through * d[k] - across * relative[k]);
        for (k, spot) in slopes.iter().enumerate() {
            bars[k / 6].1[k % 6] += dot(point, spot.point) + dot(normal, spot.normal);
        }
        bars
    }
}
