//! The rounds of a flow: where contacts hold depends on the velocities, and these on where contacts hold. A round takes
//! the contacts at the mean places that the last one led to, solves there, and finds the velocities of the next. Rounds
//! before the last are solved only as well as their places are known.

use super::contacts::Active;
use super::flow::Stick;
use super::joints::{self, Held};
use super::together::{Halt, LastFlow, Together, Tools};
use crate::bodies::Motion;
use crate::narrow_phase::{Touch, normal_velocity};
use crate::observe::report::SolveReport;
use crate::warm_start::WarmStart;
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::{ContactProblem, Twist};

/// Most rounds between places and velocities.
const MOST: usize = 12;
/// Change of a unit normal below which the round is the last \[1\].
const SAME_NORMAL: f64 = 3e-15;
/// Change of a contact's arms below which the round is the last, over the body's size \[1\].
const SAME_ARM: f64 = 1e-13;
/// Residual of a round that is not the last, over what the change of the contacts' normals makes of the velocities.
const SHARE: f64 = 1e-2;
/// Cosine below which a contact of the same name counts as another one \[1\].
const ONE_SIDE: f64 = 0.7;

/// A flow in the making.
pub struct Rounds<'a, S: Geometry> {
    /// Its length \[s\].
    pub time: f64,
    /// Its contacts.
    pub active: &'a Active<S>,
    stick: Stick,
    /// Where the bodies were.
    pub start: Motion<S>,
    /// Normal velocities of the contacts at the start \[m/s\].
    pub approaches: Vec<f64>,
    /// Velocities half turned, without and with the loads, and those that the last round ends with.
    pub before: Vec<Twist<S>>,
    free: Vec<Twist<S>>,
    /// The last.
    pub after: Vec<Twist<S>>,
    /// The contacts at the middle.
    pub touches: Vec<Touch<S>>,
    targets: Vec<f64>,
    /// Problem and impulses of the last round.
    pub last: LastFlow<S>,
    /// The joints through the rounds.
    pub held: Held<S>,
    /// True where there are joints.
    pub jointed: bool,
    corners: bool,
    kept: bool,
    /// How much the last change of places was over what may be \[1\].
    change: f64,
    /// Residual that the last round was solved to \[m/s\].
    tolerance: f64,
    /// True where the first round starts from the forces known.
    warm: bool,
    judged: Option<SolveReport>,
    /// Rounds taken.
    pub taken: usize,
}

/// What rounds may begin with: velocities at the end, and the forces that made them.
pub struct Guess<S: Geometry> {
    after: Vec<Twist<S>>,
    forces: WarmStart<S>,
}

impl<S: Geometry> Rounds<'_, S> {
    /// What the rounds so far say, as the beginning of others with more contacts.
    pub fn guess(&self) -> Guess<S> {
        let mut forces = WarmStart::default();
        forces.store(&self.last.problem, &self.last.impulses, self.time);
        Guess { after: self.after.clone(), forces }
    }
}

impl<S: Geometry> Together<'_, S> {
    /// Begins the rounds of a flow; bodies turn to its middle.
    pub fn begin_rounds<'a>(
        &mut self,
        time: f64,
        active: &'a Active<S>,
        stick: Stick,
        guess: Option<Guess<S>>,
    ) -> Rounds<'a, S> {
        let start = self.bodies.motion.clone();
        let Active { touches, closing, .. } = active;
        let approaches = touches.iter().map(|t| normal_velocity(&self.bodies, t)).collect();
        self.turn(0.5 * time);
        let before = self.twists();
        let free = self.loaded(&before, time);
        let mut last = LastFlow { time, stick, ..std::mem::take(&mut self.last) };
        last.problem.contacts.clear();
        last.closing.clone_from(closing);
        let warm = guess.is_some() || self.settings.events.warm_start;
        let after = match guess {
            Some(guess) => {
                self.forces = Some(guess.forces);
                guess.after
            }
            None => self.first_guess(touches, &before, &free),
        };
        Rounds {
            time,
            active,
            stick,
            start,
            approaches,
            before,
            free,
            after,
            touches: Vec::new(),
            targets: closing.iter().map(|c| -2.0 * c).collect(),
            last,
            held: Held::new(&self.bodies.joints),
            jointed: !self.bodies.joints.is_empty(),
            corners: closing.iter().any(|c| *c > 0.0) && self.turns_on_corners(touches),
            kept: true,
            change: f64::INFINITY,
            tolerance: f64::INFINITY,
            warm,
            judged: self.worst[0].clone(),
            taken: 0,
        }
    }

    /// Where contacts hold, bodies keep the velocities they have; others take those of their loads.
    fn first_guess(&self, active: &[Touch<S>], before: &[Twist<S>], free: &[Twist<S>]) -> Vec<Twist<S>> {
        let mut after = free.to_vec();
        for t in active {
            (after[t.a], after[t.b]) = (before[t.a], before[t.b]);
        }
        for j in &self.bodies.joints.all {
            after[j.a] = before[j.a];
            j.b.inspect(|&b| after[b] = before[b]);
        }
        after
    }

    /// Takes rounds until places and velocities agree, or there were enough.
    pub fn take_rounds(&mut self, rounds: &mut Rounds<S>, tools: &mut Tools<S>) -> Result<(), Halt> {
        let most = if rounds.jointed { joints::ROUNDS } else { MOST };
        while rounds.taken < most && !self.round(rounds, most, tools)? {}
        Ok(())
    }

    /// Takes a round; true when it was the last.
    pub fn round(&mut self, rounds: &mut Rounds<S>, most: usize, tools: &mut Tools<S>) -> Result<bool, Halt> {
        let (active, first) = (&rounds.active.touches, rounds.taken == 0);
        self.bring_to_middle(rounds);
        let at_mean = self.at_mean(active, &rounds.start.position);
        let joints_settled = !rounds.jointed || self.joints_settled(&mut rounds.held);
        rounds.change = if first {
            // how far the normals turn on the way says how far off guessed ones may be
            active.iter().zip(&at_mean).map(|(s, m)| (s.normal - m.normal).norm()).fold(0.0, f64::max)
                / SAME_NORMAL
        } else {
            self.change(&rounds.touches, &at_mean, &rounds.last.problem)
        };
        rounds.touches = at_mean;
        let as_asked = rounds.tolerance <= self.limits.tolerance;
        if !first && as_asked && rounds.kept && joints_settled && rounds.change <= 1.0 {
            return Ok(true); // the same arms, at the places that came out
        }
        let is_last = rounds.taken + 1 == most;
        rounds.tolerance = if is_last { 0.0 } else { self.tolerance_of(rounds) }.max(self.limits.tolerance);
        self.solve_round(rounds, tools)?;
        rounds.taken += 1;
        rounds.after.clone_from(&rounds.free);
        rounds.last.problem.apply(&rounds.last.impulses, &mut rounds.after);
        if rounds.jointed {
            self.aim(&mut rounds.held, &rounds.start.position, (&rounds.before, &rounds.after), rounds.time);
        } else if active.is_empty() {
            return Ok(true);
        }
        if rounds.corners {
            self.correct_gaps(rounds);
        }
        Ok(false)
    }

    /// Puts the bodies half-way between the start and where the last round leads.
    fn bring_to_middle(&mut self, rounds: &Rounds<S>) {
        for i in 0..self.bodies.len() {
            let mean = (rounds.before[i].linear + rounds.after[i].linear) * 0.5;
            self.bodies.motion.position[i] = rounds.start.position[i] + mean * (0.5 * rounds.time);
        }
    }

    /// How well a round need be solved \[m/s\]: joints and gaps follow from its velocities, so that theirs must be good.
    fn tolerance_of(&self, rounds: &Rounds<S>) -> f64 {
        if rounds.jointed || rounds.corners {
            return 0.0;
        }
        SHARE * rounds.change.min(1.0 / SAME_NORMAL) * SAME_NORMAL * self.limits.fastest
    }

    /// Assembles and solves a round.
    fn solve_round(&mut self, rounds: &mut Rounds<S>, tools: &mut Tools<S>) -> Result<(), Halt> {
        let Rounds { last, touches, targets, before, free, .. } = rounds;
        self.assemble(touches, targets, before, free, rounds.stick, &mut last.problem);
        if rounds.jointed {
            self.hold(&rounds.held, before, rounds.stick, &mut last.problem);
        }
        last.impulses.fit(&last.problem);
        if rounds.taken == 0 && rounds.warm {
            last.impulses.reset(&last.problem);
            self.forces.as_ref().unwrap_or(self.warm).load(&last.problem, rounds.time, &mut last.impulses);
        }
        if touches.is_empty() && !rounds.jointed {
            return Ok(());
        }
        // only the last round's solve is the flow's; its iterations are those of all
        let iterations = |worst: &Option<SolveReport>| worst.as_ref().map_or(0, |w| w.iterations);
        let spent = iterations(&self.worst[0]) - iterations(&rounds.judged);
        self.worst[0].clone_from(&rounds.judged);
        let mut impulses = std::mem::take(&mut last.impulses);
        self.solve_to(rounds.tolerance, &last.problem, &mut impulses, tools)?;
        last.impulses = impulses;
        if let Some(worst) = &mut self.worst[0] {
            worst.iterations += spent;
        }
        Ok(())
    }

    /// Looks where the gaps of closing contacts come to, and corrects their targets.
    fn correct_gaps(&mut self, rounds: &mut Rounds<S>) {
        let mean = self.bodies.motion.clone();
        let (before, after) = (rounds.before.as_slice(), rounds.after.as_slice());
        self.bring_to_end(&rounds.start.position, before, after, rounds.time);
        let Active { touches, closing, .. } = rounds.active;
        let gaps = self.gaps_of(touches);
        self.bodies.motion.copy_from(&mean);
        let (problem, asked) =
            (&rounds.last.problem, (touches.as_slice(), closing.as_slice(), gaps.as_slice()));
        rounds.kept = self.keep_gaps(problem, (before, after), asked, rounds.time, &mut rounds.targets);
    }

    /// The active contacts where the bodies are now, found again by name; those that are gone are carried along.
    fn at_mean(&mut self, active: &[Touch<S>], origin: &[S::Vector]) -> Vec<Touch<S>> {
        let mut found = Vec::with_capacity(active.len());
        let mut near: Vec<Touch<S>> = Vec::new();
        for pair in active.chunk_by(|s, t| (s.a, s.b) == (t.a, t.b)) {
            let (a, b) = (pair[0].a, pair[0].b);
            near.clear();
            let near_by = self.limits.touching(&self.bodies.data[a], &self.bodies.data[b]);
            let margin = 4.0 * near_by + self.reaches[a] + self.reaches[b];
            self.find((a, b), margin, &mut near);
            for t in pair {
                let again = near.iter().find(|n| n.id == t.id && n.normal.dot(t.normal) > ONE_SIDE);
                found.push(match again {
                    Some(n) => Touch { gap: t.gap, ..*n },
                    None => Touch { point: t.point + self.carried(t, origin), ..*t },
                });
            }
        }
        found
    }

    /// How a contact point has moved with its bodies.
    fn carried(&self, t: &Touch<S>, origin: &[S::Vector]) -> S::Vector {
        let moved = |i: usize| self.bodies.motion.position[i] - origin[i];
        match (self.bodies.is_dynamic(t.a), self.bodies.is_dynamic(t.b)) {
            (true, true) => (moved(t.a) + moved(t.b)) * 0.5,
            (true, false) => moved(t.a),
            (false, _) => moved(t.b),
        }
    }

    /// How much the contacts' frames and arms differ from those that the problem was solved with, over what may be.
    fn change(&self, old: &[Touch<S>], new: &[Touch<S>], problem: &ContactProblem<S>) -> f64 {
        let mut change = 0.0_f64;
        for ((o, n), c) in old.iter().zip(new).zip(&problem.contacts) {
            let size = self.bodies.data[n.a].extent.min(self.bodies.data[n.b].extent);
            let arm = |i: usize, was: S::Vector| {
                let moves = self.bodies.is_dynamic(i);
                if moves { (n.point - self.bodies.motion.position[i] - was).norm() } else { 0.0 }
            };
            let arms = arm(n.a, c.arm_a).max(arm(n.b, c.arm_b)) / (SAME_ARM * size);
            change = change.max((o.normal - n.normal).norm() / SAME_NORMAL).max(arms);
        }
        change
    }

    fn assemble(
        &self,
        touches: &[Touch<S>],
        targets: &[f64],
        before: &[Twist<S>],
        free: &[Twist<S>],
        stick: Stick,
        problem: &mut ContactProblem<S>,
    ) {
        crate::assembly::begin(problem, &self.bodies, self.settings.friction_law);
        problem.velocities.clear();
        problem.velocities.extend_from_slice(free);
        if stick == Stick::Mean {
            for (v, b) in problem.velocities.iter_mut().zip(before) {
                v.add_scaled(b, 1.0);
            }
        }
        for (t, target) in touches.iter().zip(targets) {
            let mut contact = crate::assembly::contact(&self.bodies, t, *target);
            if stick == Stick::End {
                contact.target -= contact.relative_velocity(before).0;
            }
            problem.contacts.push(contact);
            crate::assembly::resist(problem, t);
        }
    }
}
