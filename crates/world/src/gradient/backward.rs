//! A step taken back: from cotangents of the states at its end to those at its start (theory section 10.3). Deeds are
//! gone through from the last to the first; each body's cotangent is that of its state after the deed.

use super::flowing::{FlowAdjoint, FlowBars, Scene, gather, held, members, world_pairs};
use super::holding::{Solved, still_speed};
use super::kick::Kick;
use super::lift;
use super::meeting::{Equation, arrival, stop};
use super::sums::{StateBar, Sums, add};
use super::touching::dot;
use super::turning::Spinning;
use crate::bodies::Motion;
use crate::force::Wrench;
use crate::impact::Blow;
use crate::stepping::events::tape::{Cause, Deed, Flow, Tape};
use carom_geometry::Geometry;
use carom_math::Column;

/// Rate of an equation over the speeds in it below which it makes no moment \[1\].
const GRAZING: f64 = 1e-10;

/// A step on the way back.
pub struct Backward<'a, S: Geometry> {
    scene: &'a Scene<'a, S>,
    tape: &'a Tape<S>,
    /// The step's number in the rollout.
    step: usize,
    /// Cotangents of all bodies' states; of obstacles those of the step's start.
    states: &'a mut [StateBar],
    /// Cotangents of the moments.
    moments: Vec<f64>,
    sums: &'a mut Sums,
}

/// Takes cotangents at the end of a step of length `dt` \[s\] to its start.
pub fn backward<S: Geometry>(
    scene: &Scene<S>,
    tape: &Tape<S>,
    (step, dt): (usize, f64),
    states: &mut [StateBar],
    sums: &mut Sums,
) {
    let moments = vec![0.0; tape.moments.len()];
    let mut back = Backward { scene, tape, step, states, moments, sums };
    back.damp(0.5 * dt);
    for i in (0..scene.bodies.len()).filter(|&i| !scene.bodies.is_dynamic(i)) {
        let mut bar = std::mem::take(&mut back.states[i]);
        let pose: [f64; 6] = std::array::from_fn(|k| bar[k]);
        bar[..6].fill(0.0);
        back.states[i] = bar;
        back.carry(i, dt, &pose);
    }
    for deed in tape.deeds.iter().rev() {
        match deed {
            Deed::Meet { moment, flows } => back.meet(*moment, flows),
            Deed::Impact { moment, members, motion, rounds } => {
                rounds.iter().rev().for_each(|round| back.strike(*moment, members, motion, round));
            }
        }
    }
    back.damp(0.5 * dt);
}

impl<S: Geometry> Backward<'_, S> {
    /// Velocities of damped bodies decay.
    fn damp(&mut self, time: f64) {
        for (bar, d) in self.states.iter_mut().zip(&self.scene.bodies.data) {
            let (linear, angular) = (d.linear_damping, d.angular_damping);
            if d.inverse_mass > 0.0 && (linear != 0.0 || angular != 0.0) {
                bar[6..9].iter_mut().for_each(|x| *x *= carom_math::exp(-linear * time));
                bar[9..].iter_mut().for_each(|x| *x *= carom_math::exp(-angular * time));
            }
        }
    }

    /// Takes a cotangent of an obstacle's pose at a time of the step to its start; gives the time's.
    fn carry(&mut self, i: usize, time: f64, pose: &[f64; 6]) -> f64 {
        let m = &self.tape.origin;
        let (v, w) = (lift::vector::<S>(m.velocity[i]), lift::spin::<S>(m.angular_velocity[i]));
        let spinning = Spinning::of(self.scene.bodies, i, self.scene.settings.integrator);
        let slopes = spinning.slopes(lift::rotation::<S>(&m.rotation[i]), w, time);
        let place = [pose[0], pose[1], pose[2]];
        let (turn, spin, rate) = slopes.pull([pose[3], pose[4], pose[5]], [0.0; 3]);
        let bar = &mut self.states[i];
        add(&mut bar[..3], &place, 1.0);
        add(&mut bar[3..6], &turn, 1.0);
        add(&mut bar[6..9], &place, time);
        add(&mut bar[9..], &spin, 1.0);
        rate + dot(place, v)
    }

    /// The same of a state at that time: an obstacle's velocities are those of the start.
    fn carry_any(&mut self, i: usize, time: f64, bar: &StateBar) -> f64 {
        add(&mut self.states[i][6..], &bar[6..], 1.0);
        let pose: [f64; 6] = std::array::from_fn(|k| bar[k]);
        if pose == [0.0; 6] { 0.0 } else { self.carry(i, time, &pose) }
    }

    fn meet(&mut self, moment: usize, flows: &[Flow<S>]) {
        let adjoints: Vec<FlowAdjoint> =
            flows.iter().map(|f| FlowAdjoint::of(self.scene, f, &self.tape.wrenches)).collect();
        let ends: Vec<Vec<StateBar>> = flows.iter().map(|f| self.ends(f)).collect();
        let still: Vec<Vec<[f64; 6]>> = flows.iter().map(|f| vec![[0.0; 6]; f.members.len()]).collect();
        let plain: Vec<FlowBars> =
            adjoints.iter().zip(&ends).zip(&still).map(|((f, e), m)| f.pull(e, m)).collect();
        let whole = self.moments[moment] + plain.iter().map(|b| b.time).sum::<f64>();
        let told = &self.tape.moments[moment];
        let equation = match told.cause {
            Cause::Given | Cause::Turned => None,
            Cause::Arrival(pair, id) => arrival(self.scene, self.tape, flows, pair, id, told.value),
            Cause::Stop => flows.first().and_then(|f| stop(self.scene, f)),
        };
        let mut bars = match equation {
            Some(equation) => self.moved(moment, whole, &equation, (flows, &adjoints), plain, (ends, still)),
            None => plain,
        };
        if let (Cause::Turned, Some((flow, bars))) = (told.cause, flows.iter().zip(&mut bars).next()) {
            self.turned(flow, whole, bars);
        }
        for ((flow, adjoint), bars) in flows.iter().zip(&adjoints).zip(bars) {
            self.take_over(flow, adjoint, &bars);
        }
    }

    /// The flows' cotangents with the moment's share, by the equation that makes it.
    fn moved(
        &mut self,
        moment: usize,
        whole: f64,
        equation: &Equation,
        (flows, adjoints): (&[Flow<S>], &[FlowAdjoint]),
        plain: Vec<FlowBars>,
        (mut ends, mut mids): (Vec<Vec<StateBar>>, Vec<Vec<[f64; 6]>>),
    ) -> Vec<FlowBars> {
        let (mut rate, mut speed) = (0.0, 0.0);
        for (k, (flow, adjoint)) in flows.iter().zip(adjoints).enumerate() {
            let mut own = vec![[0.0; 12]; flow.members.len()];
            for (i, bar) in &equation.ends {
                if let Some(slot) = self.slot(flow, *i) {
                    add(&mut own[slot], bar, 1.0);
                    speed += flow.end.velocity[slot].norm() + flow.end.angular_velocity[slot].norm();
                }
            }
            let mid = if k == 0 && !equation.mids.is_empty() { &equation.mids } else { &mids[k] };
            rate += adjoint.pull(&own, mid).time;
        }
        let m = &self.tape.origin;
        for (i, bar) in equation.ends.iter().filter(|(i, _)| !self.scene.bodies.is_dynamic(*i)) {
            let (v, w) = (lift::vector::<S>(m.velocity[*i]), lift::spin::<S>(m.angular_velocity[*i]));
            rate += dot([bar[0], bar[1], bar[2]], v) + dot([bar[3], bar[4], bar[5]], w);
        }
        if rate.abs() <= GRAZING * speed || rate == 0.0 {
            return plain;
        }
        let factor = -whole / rate;
        let value = self.tape.moments[moment].value;
        for (i, bar) in &equation.ends {
            let scaled = bar.map(|x| factor * x);
            let home = flows.iter().enumerate().find_map(|(k, f)| self.slot(f, *i).map(|s| (k, s)));
            match home {
                Some((k, slot)) => add(&mut ends[k][slot], &scaled, 1.0),
                // the moment's share is in the rate
                None if !self.scene.bodies.is_dynamic(*i) => {
                    self.carry_any(*i, value, &scaled);
                }
                None => add(&mut self.states[*i], &scaled, 1.0),
            }
        }
        for (mid, bar) in mids.iter_mut().take(1).flatten().zip(&equation.mids) {
            add(mid, bar, factor);
        }
        let mut bars: Vec<FlowBars> =
            adjoints.iter().zip(&ends).zip(&mids).map(|((f, e), m)| f.pull(e, m)).collect();
        for (start, bar) in bars.iter_mut().take(1).flat_map(|b| &mut b.start).zip(&equation.starts) {
            add(start, bar, factor);
        }
        bars
    }

    /// Place of a movable body among a flow's members.
    fn slot(&self, flow: &Flow<S>, i: usize) -> Option<usize> {
        flow.members.binary_search(&i).ok().filter(|_| self.scene.bodies.is_dynamic(i))
    }

    /// A flow that ended because it had turned far enough, t = t_begin + TURN/|w|: adds the moment's share.
    fn turned(&mut self, flow: &Flow<S>, whole: f64, bars: &mut FlowBars) {
        let turning = |&k: &usize| {
            let d = &self.scene.bodies.data[flow.members[k]];
            d.inverse_mass > 0.0 && d.turning_arm > 0.0
        };
        let speed = |k: usize| flow.start.angular_velocity[k].norm();
        let fastest = (0..flow.members.len()).filter(turning).max_by(|&j, &k| speed(j).total_cmp(&speed(k)));
        let Some(k) = fastest else { return };
        self.moments[flow.begin] += whole;
        let w = lift::spin::<S>(flow.start.angular_velocity[k]);
        add(&mut bars.start[k][9..], &w, -whole * flow.last.time / dot(w, w));
    }

    /// Cotangents of a flow's end: of its movable members.
    fn ends(&self, flow: &Flow<S>) -> Vec<StateBar> {
        let of = |&i: &usize| if self.scene.bodies.is_dynamic(i) { self.states[i] } else { [0.0; 12] };
        flow.members.iter().map(of).collect()
    }

    /// Puts a flow's cotangents in place of those of its end.
    fn take_over(&mut self, flow: &Flow<S>, adjoint: &FlowAdjoint, bars: &FlowBars) {
        self.moments[flow.begin] -= bars.time;
        let begin = self.tape.moments[flow.begin].value;
        for (bar, &i) in bars.start.iter().zip(&flow.members) {
            if self.scene.bodies.is_dynamic(i) {
                self.states[i] = *bar;
            } else {
                let rate = self.carry_any(i, begin, bar);
                self.moments[flow.begin] += rate;
            }
        }
        adjoint.gather(&bars.kick, self.step, self.sums);
    }

    /// A round of impacts.
    fn strike(&mut self, moment: usize, ids: &[usize], motion: &Motion<S>, round: &Blow<S>) {
        let mut own = self.scene.bodies.some(ids);
        own.motion.copy_from(motion);
        let (before, after) = (&round.problem.velocities, round.problem.velocities_after(&round.impulses));
        let solved = Solved {
            problem: &round.problem,
            impulses: &round.impulses,
            against: &after,
            still: still_speed(&round.problem, &after, 0.0),
        };
        let bounce = |k: usize| if round.bounces[k] { round.problem.contacts[k].restitution } else { 0.0 };
        let held = held(&own, &solved, bounce);
        let none = vec![Wrench::default(); ids.len()];
        let members = members(&own, before, &after, &none);
        let kick = Kick::of::<S>(members, held, (0.0, 0.0, 0.0), [0.0; 3]);
        let of = |&i: &usize| -> [f64; 6] {
            let movable = self.scene.bodies.is_dynamic(i);
            std::array::from_fn(|k| if movable { self.states[i][6 + k] } else { 0.0 })
        };
        let pulled = kick.pull(&ids.iter().map(of).collect::<Vec<_>>());
        let pairs = world_pairs(&round.problem, ids);
        gather(&pulled, ids, &pairs, self.step, self.sums);
        for &(contact, _, bounce) in pulled.contacts.iter().filter(|c| round.bounces[c.0]) {
            let (a, b) = pairs[contact];
            self.sums.pair(a, b, 0.0, bounce);
        }
        let value = self.tape.moments[moment].value;
        for (k, &i) in ids.iter().enumerate() {
            if self.scene.bodies.is_dynamic(i) {
                add(&mut self.states[i][..6], &pulled.pose[k], 1.0);
                self.states[i][6..].copy_from_slice(&pulled.before[k]);
            } else {
                let mut bar = [0.0; 12];
                bar[..6].copy_from_slice(&pulled.pose[k]);
                bar[6..].copy_from_slice(&pulled.before[k]);
                let rate = self.carry_any(i, value, &bar);
                self.moments[moment] += rate;
            }
        }
    }
}
