//! A flow and its adjoint: half a turn, the kick at the mean place, half a turn (theory eqs. 8.2 and 10.5),
//!   (q, w) -> (q_h, w_h),   x_h = x + tau (v + y)/4,   kick,   x' = x + tau (v + y)/2,   (q_h, w_y) -> (q', w').

use super::holding::{Hold, Solved, still_speed};
use super::kick::{Held, Kick, Member, Pulled};
use super::lift;
use super::sums::{StateBar, Sums, add};
use super::touching::{Nearby, carried};
use super::turning::{Slopes, Spinning};
use crate::bodies::{Bodies, Motion};
use crate::force::Wrench;
use crate::integrate::turn_freely;
use crate::narrow_phase::Touch;
use crate::settings::Settings;
use crate::stepping::events::flow::Stick;
use crate::stepping::events::tape::Flow;
use carom_geometry::Geometry;
use carom_math::{Column, Pose};
use carom_solver::{Contact, ContactProblem, Impulses, Twist};

/// The pair that was looked around last.
type Looked<S> = Option<((usize, usize), Option<Nearby<S>>)>;

/// What all steps of a rollout have in common.
pub struct Scene<'a, S: Geometry> {
    /// The bodies; their motion is not read.
    pub bodies: &'a Bodies<S>,
    /// The choices of the run.
    pub settings: &'a Settings<S>,
}

/// Cotangents of what a flow was given.
pub struct FlowBars {
    /// States of its members at its start.
    pub start: Vec<StateBar>,
    /// Its length.
    pub time: f64,
    /// All else.
    pub kick: Pulled,
}

/// A flow ready to be differentiated.
pub struct FlowAdjoint {
    /// Members in the world.
    pub members: Vec<usize>,
    /// The pairs of bodies (world) of its contacts.
    pairs: Vec<(usize, usize)>,
    movable: Vec<bool>,
    time: f64,
    /// v + y of each member; twice the velocity of an obstacle.
    sums: Vec<[f64; 3]>,
    first: Vec<Slopes>,
    second: Vec<Option<Slopes>>,
    kick: Kick,
    /// What stops slips that are none yet, before the flow.
    settle: Option<Kick>,
}

/// Velocities of a solved flow: before the kick, after it, and those that friction acts against.
pub struct Velocities<S: Geometry> {
    /// At the start of the kick, half a turn done.
    pub before: Vec<Twist<S>>,
    /// After it.
    pub after: Vec<Twist<S>>,
    /// U.
    pub against: Vec<Twist<S>>,
}

/// Velocities of a flow from its problem.
pub fn velocities<S: Geometry>(flow: &Flow<S>, before: Vec<Twist<S>>) -> Velocities<S> {
    let against = flow.last.problem.velocities_after(&flow.last.impulses);
    let after = match flow.stick {
        Stick::End => against.clone(),
        Stick::Mean => {
            let own = against.iter().zip(&before);
            own.map(|(u, b)| Twist::new(u.linear - b.linear, u.angular - b.angular)).collect()
        }
    };
    Velocities { before, after, against }
}

impl FlowAdjoint {
    /// Prepares a flow.
    pub fn of<S: Geometry>(scene: &Scene<S>, flow: &Flow<S>, wrenches: &[Wrench<S>]) -> Self {
        let time = flow.last.time;
        let Half { own, v, sums, first, second } = half_way(scene, flow);
        let loads: Vec<Wrench<S>> = flow.members.iter().map(|&i| wrenches[i]).collect();
        let fall = scene.settings.gravity.norm() * time;
        let solved = Solved {
            problem: &flow.last.problem,
            impulses: &flow.last.impulses,
            against: &v.against,
            still: still_speed(&flow.last.problem, &v.against, fall),
        };
        let (kappa, bounce) = if flow.stick == Stick::Mean { (1.0, 0.0) } else { (0.0, 1.0) };
        let held = held(&own, &solved, |_| bounce);
        let members = members(&own, &v.before, &v.after, &loads);
        let gravity = lift::vector::<S>(scene.settings.gravity);
        let settle = settle(scene, flow, &solved.holds(), solved.still);
        FlowAdjoint {
            settle,
            pairs: world_pairs(&flow.last.problem, &flow.members),
            movable: (0..flow.members.len()).map(|k| own.is_dynamic(k)).collect(),
            members: flow.members.clone(),
            time,
            sums,
            first,
            second,
            kick: Kick::of::<S>(members, held, (time, kappa, 0.25 * time), gravity),
        }
    }

    /// Takes cotangents of the states at the end, and of the poses half-way (place, turn), to those of the start.
    pub fn pull(&self, end: &[StateBar], mid: &[[f64; 6]]) -> FlowBars {
        let count = self.members.len();
        let (mut start, mut after, mut turn) =
            (vec![[0.0; 12]; count], vec![[0.0; 6]; count], vec![[0.0; 3]; count]);
        let mut time = 0.0;
        let quarter = 0.25 * self.time;
        for k in 0..count {
            let (bar, sum) = (&end[k], &self.sums[k]);
            turn[k] = [mid[k][3], mid[k][4], mid[k][5]];
            if let Some(second) = &self.second[k] {
                let (q, w, h) = second.pull([bar[3], bar[4], bar[5]], [bar[9], bar[10], bar[11]]);
                time += 0.5 * h;
                add(&mut turn[k], &q, 1.0);
                add(&mut after[k][3..], &w, 1.0);
                for i in 0..3 {
                    start[k][i] += bar[i];
                    start[k][6 + i] += 2.0 * quarter * bar[i];
                    after[k][i] += bar[6 + i] + 2.0 * quarter * bar[i];
                    time += 0.5 * bar[i] * sum[i];
                }
            }
            self.pull_mid(k, &mid[k][..3], &mut start[k], &mut time);
            if self.movable[k] {
                add(&mut after[k][..3], &mid[k][..3], quarter);
            }
        }
        let kick = self.kick.pull(&after);
        for k in 0..count {
            self.pull_mid(k, &kick.pose[k][..3], &mut start[k], &mut time);
            add(&mut turn[k], &kick.pose[k][3..], 1.0);
            add(&mut start[k][6..9], &kick.before[k][..3], 1.0);
            let spin = [kick.before[k][3], kick.before[k][4], kick.before[k][5]];
            let (q, w, h) = self.first[k].pull(turn[k], spin);
            add(&mut start[k][3..6], &q, 1.0);
            add(&mut start[k][9..], &w, 1.0);
            time += 0.5 * h;
        }
        time += kick.time;
        if let Some(settle) = &self.settle {
            self.pull_settle(settle, &mut start);
        }
        FlowBars { start, time, kick }
    }

    /// The stop of slips at the start.
    fn pull_settle(&self, settle: &Kick, start: &mut [StateBar]) {
        let after: Vec<[f64; 6]> = start.iter().map(|b| std::array::from_fn(|k| b[6 + k])).collect();
        let pulled = settle.pull(&after);
        for (k, bar) in start.iter_mut().enumerate() {
            if self.movable[k] {
                bar[6..].fill(0.0);
            }
            add(&mut bar[6..], &pulled.before[k], 1.0);
            add(&mut bar[..6], &pulled.pose[k], 1.0);
        }
    }

    /// A cotangent of a place half-way, x + tau (v + y)/4; what it says of y is the caller's.
    fn pull_mid(&self, k: usize, place: &[f64], start: &mut StateBar, time: &mut f64) {
        // an obstacle's y is its v
        let share = if self.movable[k] { 0.25 } else { 0.5 } * self.time;
        for i in 0..3 {
            start[i] += place[i];
            start[6 + i] += share * place[i];
            *time += 0.25 * place[i] * self.sums[k][i];
        }
    }

    /// Adds what a pull said of masses, loads and coefficients to sums.
    pub fn gather(&self, pulled: &Pulled, step: usize, sums: &mut Sums) {
        gather(pulled, &self.members, &self.pairs, step, sums);
    }
}

/// A flow half-way: the bodies where the kick finds them, its velocities, and the turns before and after.
struct Half<S: Geometry> {
    own: Bodies<S>,
    v: Velocities<S>,
    sums: Vec<[f64; 3]>,
    first: Vec<Slopes>,
    second: Vec<Option<Slopes>>,
}

fn half_way<S: Geometry>(scene: &Scene<S>, flow: &Flow<S>) -> Half<S> {
    let (bodies, time) = (scene.bodies, flow.last.time);
    let spinning: Vec<Spinning> =
        flow.members.iter().map(|&i| Spinning::of(bodies, i, scene.settings.integrator)).collect();
    let mut own = bodies.some(&flow.members);
    own.motion.copy_from(&flow.start);
    let mut first = Vec::new();
    for (k, s) in spinning.iter().enumerate() {
        let m = &own.motion;
        let (q, w) = (lift::rotation::<S>(&m.rotation[k]), lift::spin::<S>(m.angular_velocity[k]));
        first.push(s.slopes(q, w, 0.5 * time));
        turn_freely(scene.settings.integrator, &mut own, k, 0.5 * time);
    }
    let before = (0..flow.members.len()).map(|k| own.motion.twist(k)).collect();
    let v = velocities(flow, before);
    let mut sums = Vec::new();
    for k in 0..flow.members.len() {
        let sum =
            if own.is_dynamic(k) { v.before[k].linear + v.after[k].linear } else { v.before[k].linear * 2.0 };
        own.motion.position[k] = flow.start.position[k] + sum * (0.25 * time);
        sums.push(lift::vector::<S>(sum));
    }
    let onwards = |(k, s): (usize, &Spinning)| {
        let (q, w) = (lift::rotation::<S>(&own.motion.rotation[k]), lift::spin::<S>(v.after[k].angular));
        own.is_dynamic(k).then(|| s.slopes(q, w, 0.5 * time))
    };
    let second = spinning.iter().enumerate().map(onwards).collect();
    Half { own, v, sums, first, second }
}

/// The kick that stops the slips of contacts which stick from the flow's start on (theory eq. 10.7). A little slip
/// there is used up by friction in as little time; the mean-velocity law by itself would throw it back, and back again.
fn settle<S: Geometry>(scene: &Scene<S>, flow: &Flow<S>, holds: &[Hold], still: f64) -> Option<Kick> {
    let slip = |t: &Touch<S>| {
        let at = |i: usize| flow.start.twist(i).at(t.point - flow.start.position[i]);
        let u = at(t.a) - at(t.b);
        (u - t.normal * t.normal.dot(u)).norm()
    };
    let rests = |k: usize| holds[k] == Hold::Stick && slip(&flow.touches[k]) <= still;
    if flow.stick == Stick::End || !(0..holds.len()).any(rests) {
        return None;
    }
    let mut own = scene.bodies.some(&flow.members);
    own.motion.copy_from(&flow.start);
    let mut near: Looked<S> = None;
    let mut held = Vec::new();
    for (k, t) in flow.touches.iter().enumerate().filter(|(k, _)| holds[*k] != Hold::Open) {
        let pair = (t.a, t.b);
        if near.as_ref().is_none_or(|n| n.0 != pair) {
            near = Some((pair, Nearby::of(&own, pair, poses(&own.motion, pair))));
        }
        let found = near.as_ref().and_then(|n| n.1.as_ref()).and_then(|n| n.slopes(t.id, t.normal, t.point));
        let hold = match holds[k] {
            Hold::Slip if slip(t) > still => Hold::Slip,
            Hold::Stick if rests(k) => Hold::Stick,
            _ => Hold::Smooth,
        };
        held.push(Held {
            contact: k,
            a: t.a,
            b: t.b,
            hold,
            normal: lift::vector::<S>(t.normal),
            point: lift::vector::<S>(t.point),
            slopes: found.unwrap_or_else(|| carried((own.is_dynamic(t.a), own.is_dynamic(t.b)))),
            impulse: [0.0; 3],
            press: 0.0,
            friction: t.friction,
            bounce: 0.0,
        });
    }
    let twists: Vec<Twist<S>> = (0..own.len()).map(|k| own.motion.twist(k)).collect();
    let members = members(&own, &twists, &twists, &vec![Wrench::default(); own.len()]);
    Some(Kick::of::<S>(members, held, (0.0, 0.0, 0.0), [0.0; 3]))
}

/// Adds what a kick's pull says to sums.
pub fn gather(pulled: &Pulled, members: &[usize], pairs: &[(usize, usize)], step: usize, sums: &mut Sums) {
    for (k, &i) in members.iter().enumerate() {
        sums.mass[i] += pulled.mass[k];
        sums.inertia[i] += pulled.inertia[k];
        add(&mut sums.loads[step][i], &pulled.load[k], 1.0);
    }
    add(&mut sums.gravity, &pulled.gravity, 1.0);
    for &(contact, friction, _) in &pulled.contacts {
        let (a, b) = pairs[contact];
        sums.pair(a, b, friction, 0.0);
    }
}

/// The bodies of a problem's contacts in the world.
pub fn world_pairs<S: Geometry>(problem: &ContactProblem<S>, members: &[usize]) -> Vec<(usize, usize)> {
    problem.contacts.iter().map(|c| (members[c.a], members[c.b])).collect()
}

/// The members of a kick where they are.
pub fn members<S: Geometry>(
    own: &Bodies<S>,
    before: &[Twist<S>],
    after: &[Twist<S>],
    loads: &[Wrench<S>],
) -> Vec<Member> {
    let columns = |linear: S::Vector, angular: S::Spin| {
        let ([a, b, c], [x, y, z]) = (lift::vector::<S>(linear), lift::spin::<S>(angular));
        [a, b, c, x, y, z]
    };
    let of = |k: usize| {
        let d = &own.data[k];
        let dynamic = own.is_dynamic(k);
        let (b, a) = (&before[k], if dynamic { &after[k] } else { &before[k] });
        Member {
            before: columns(b.linear, b.angular),
            after: columns(a.linear, a.angular),
            place: lift::vector::<S>(own.motion.position[k]),
            mass: dynamic.then_some(d.mass_properties.mass),
            inertia: (d.inverse_inertia != <S::Inertia as carom_math::Inertia<S::Spin>>::ZERO)
                .then(|| lift::inertia::<S>(&own.inertia(k))),
            load: columns(loads[k].force, loads[k].torque),
        }
    };
    (0..own.len()).map(of).collect()
}

/// The contacts that hold, with their derivatives at the bodies' poses.
pub fn held<S: Geometry>(own: &Bodies<S>, solved: &Solved<S>, bounce: impl Fn(usize) -> f64) -> Vec<Held> {
    let holds = solved.holds();
    let (problem, impulses): (&ContactProblem<S>, &Impulses<S>) = (solved.problem, solved.impulses);
    let mut near: Looked<S> = None;
    let mut all = Vec::new();
    for (k, (c, hold)) in
        problem.contacts.iter().zip(holds).enumerate().filter(|(_, (_, h))| *h != Hold::Open)
    {
        let pair = (c.a, c.b);
        if near.as_ref().is_none_or(|n| n.0 != pair) {
            near = Some((pair, Nearby::of(own, pair, poses(&own.motion, pair))));
        }
        let point = point_of(own, c);
        let found = near.as_ref().and_then(|n| n.1.as_ref()).and_then(|n| n.slopes(c.id, c.normal, point));
        let slopes = found.unwrap_or_else(|| carried((own.is_dynamic(c.a), own.is_dynamic(c.b))));
        let g = &impulses.contacts[k];
        all.push(Held {
            contact: k,
            a: c.a,
            b: c.b,
            hold,
            normal: lift::vector::<S>(c.normal),
            point: lift::vector::<S>(point),
            slopes,
            impulse: lift::vector::<S>(c.to_world(g)),
            press: g.normal,
            friction: c.friction,
            bounce: bounce(k),
        });
    }
    all
}

/// Poses of two bodies.
pub fn poses<S: Geometry>(motion: &Motion<S>, (a, b): (usize, usize)) -> [Pose<S>; 2] {
    [motion.pose(a), motion.pose(b)]
}

/// A contact's point: by the arm of a movable body, which is that of the last round of places and velocities; that of
/// an obstacle may be an earlier round's.
pub fn point_of<S: Geometry>(own: &Bodies<S>, c: &Contact<S>) -> S::Vector {
    if own.is_dynamic(c.a) { own.motion.position[c.a] + c.arm_a } else { own.motion.position[c.b] + c.arm_b }
}
