//! First-order methods on bodies: the velocities that follow impulses are the bodies' own, v + M^-1 J^T gamma (theory
//! eq. 5.4), so every pass costs O(contacts) and no matrix is formed. Knows no method.

use crate::cone::{project, project_step};
use crate::impulse_solver::{ImpulseSolver, SolveSettings};
use crate::methods::first_order::{Budget, FirstOrder, Memory, Method, Point};
use crate::methods::judged;
use crate::methods::pgs::{relax_contact, relax_row};
use crate::outcome::{Outcome, Stop};
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, Impulse, Impulses, Twist};
use crate::residual::largest;
use crate::watch::Watch;
use carom_math::{Column, Space};
use std::marker::PhantomData;

/// A first-order method on bodies; holds memory between solves, nothing else.
#[derive(Clone, Debug, Default)]
pub struct OnBodies<S: Space, M> {
    prepared: Prepared<S>,
    at: BodyPoint<S>,
    memory: Memory<BodyPoint<S>>,
    given: Impulses<S>,
    method: PhantomData<M>,
}

impl<S: Space, M: Method> ImpulseSolver<S> for OnBodies<S, M> {
    fn name(&self) -> &'static str {
        M::NAME
    }
    fn work(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Outcome {
        self.given.copy_from(impulses);
        self.prepared.update(problem);
        project(problem, impulses);
        let form = Bodies { problem, prepared: &self.prepared };
        std::mem::swap(&mut self.at.impulses, impulses);
        form.refresh(&mut self.at);
        let SolveSettings { iterations, tolerance, .. } = *settings;
        let budget = Budget { iterations, tolerance, small_change: tolerance };
        let end = M::run(&form, &budget, &mut self.at, &mut self.memory, watch);
        std::mem::swap(&mut self.at.impulses, impulses);
        let mut outcome = judged(problem, &self.prepared, (end.iterations, tolerance), &self.given, impulses);
        if end.interrupted && outcome.stop == Stop::OutOfIterations {
            outcome.stop = Stop::Interrupted;
        }
        outcome
    }
}

/// Impulses and the velocities of all bodies after them.
#[derive(Clone, Debug, Default)]
pub struct BodyPoint<S: Space> {
    impulses: Impulses<S>,
    velocities: Vec<Twist<S>>,
}

impl<S: Space> Point for BodyPoint<S> {
    fn copy_from(&mut self, other: &Self) {
        self.impulses.copy_from(&other.impulses);
        self.velocities.clone_from(&other.velocities);
    }
    fn blend(&mut self, own: f64, (f, x): (f64, &Self), (g, y): (f64, &Self)) {
        let (mine, xs, ys) = (&mut self.impulses, &x.impulses, &y.impulses);
        for ((m, x), y) in mine.contacts.iter_mut().zip(&xs.contacts).zip(&ys.contacts) {
            m.normal = own * m.normal + f * x.normal + g * y.normal;
            m.tangent = m.tangent * own + x.tangent * f + y.tangent * g;
        }
        for ((m, x), y) in mine.rows.iter_mut().zip(&xs.rows).zip(&ys.rows) {
            *m = own * *m + f * x + g * y;
        }
        for ((m, x), y) in mine.moments.iter_mut().zip(&xs.moments).zip(&ys.moments) {
            *m = *m * own + *x * f + *y * g;
        }
        for ((m, x), y) in self.velocities.iter_mut().zip(&x.velocities).zip(&y.velocities) {
            m.linear = m.linear * own + x.linear * f + y.linear * g;
            m.angular = m.angular * own + x.angular * f + y.angular * g;
        }
    }
}

/// A problem with its prepared rows.
struct Bodies<'a, S: Space> {
    problem: &'a ContactProblem<S>,
    prepared: &'a Prepared<S>,
}

impl<S: Space> FirstOrder for Bodies<'_, S> {
    type Point = BodyPoint<S>;
    const SWEEPS_KEEP_VELOCITIES: bool = true;

    fn sweep(&self, at: &mut BodyPoint<S>) -> f64 {
        let v = &mut at.velocities;
        let mut change: f64 = 0.0;
        for ((given, row), l) in self.problem.rows.iter().zip(&self.prepared.rows).zip(&mut at.impulses.rows)
        {
            change = change.max(relax_row(given, row, l, v));
        }
        for (c, g) in self.prepared.contacts.iter().zip(&mut at.impulses.contacts) {
            change = change.max(relax_contact(c, g, self.problem.friction_law, v));
        }
        for (r, m) in self.prepared.resistances.iter().zip(&mut at.impulses.moments) {
            change = change.max(r.relax(at.impulses.contacts[r.contact].normal, m, v));
        }
        change.sqrt()
    }

    fn descend(&self, from: &BodyPoint<S>, step: f64, to: &mut BodyPoint<S>) {
        let (v, law) = (&from.velocities, self.problem.friction_law);
        to.velocities.clone_from(&self.problem.velocities);
        let contacts = self.prepared.contacts.iter().zip(&from.impulses.contacts);
        for ((c, old), new) in contacts.zip(&mut to.impulses.contacts) {
            (*new, _) = project_step(c, old, c.relative_velocity(v), step, law, None);
            c.apply(new, &mut to.velocities);
        }
        let rows = self.problem.rows.iter().zip(&self.prepared.rows).zip(&from.impulses.rows);
        for (((given, row), old), new) in rows.zip(&mut to.impulses.rows) {
            let error = row.velocity(v) - given.target;
            *new = (old - step * error / row.inverse_effective_mass).max(given.lo).min(given.hi);
            row.apply(*new, &mut to.velocities);
        }
        let moments = self.prepared.resistances.iter().zip(&from.impulses.moments);
        for ((r, &old), new) in moments.zip(&mut to.impulses.moments) {
            // moments press the contact's normal impulse too: its step is taken again, with them
            let (c, impulse) = (&self.prepared.contacts[r.contact], &from.impulses.contacts[r.contact]);
            let resisted = Some((r, old, r.spin(v)));
            let (impulse, moment) = project_step(c, impulse, c.relative_velocity(v), step, law, resisted);
            let before = std::mem::replace(&mut to.impulses.contacts[r.contact], impulse);
            let (normal, tangent) = (impulse.normal - before.normal, impulse.tangent - before.tangent);
            c.apply(&Impulse { normal, tangent }, &mut to.velocities);
            *new = moment;
            r.apply(moment, &mut to.velocities);
        }
    }

    fn refresh(&self, at: &mut BodyPoint<S>) {
        at.velocities.clone_from(&self.problem.velocities);
        self.prepared.apply(&at.impulses, &mut at.velocities);
    }

    fn product(&self, [x, y]: [&BodyPoint<S>; 2], [z, w]: [&BodyPoint<S>; 2]) -> f64 {
        let part = |p: &Impulse<S>, q: &Impulse<S>| (p.normal - q.normal, p.tangent - q.tangent);
        let mut sum = 0.0;
        for (i, c) in self.prepared.contacts.iter().enumerate() {
            let (n, t) = part(&x.impulses.contacts[i], &y.impulses.contacts[i]);
            let (m, s) = part(&z.impulses.contacts[i], &w.impulses.contacts[i]);
            sum += n * m * c.normal.inverse_effective_mass + t.dot(s) * c.inverse_tangent_mass;
        }
        for (i, row) in self.prepared.rows.iter().enumerate() {
            let (p, q) = (x.impulses.rows[i] - y.impulses.rows[i], z.impulses.rows[i] - w.impulses.rows[i]);
            sum += p * q * row.inverse_effective_mass;
        }
        for (i, r) in self.prepared.resistances.iter().enumerate() {
            let moment = |p: &BodyPoint<S>| p.impulses.moments[i];
            sum += r.product(moment(x) - moment(y), moment(z) - moment(w));
        }
        sum
    }

    fn curvature(&self, x: &BodyPoint<S>, y: &BodyPoint<S>) -> f64 {
        let mut sum = 0.0;
        for ((c, p), q) in self.prepared.contacts.iter().zip(&x.impulses.contacts).zip(&y.impulses.contacts) {
            let (n, t) = c.relative_velocity(&x.velocities);
            let (m, s) = c.relative_velocity(&y.velocities);
            sum += (p.normal - q.normal) * (n - m) + (p.tangent - q.tangent).dot(t - s);
        }
        for ((row, p), q) in self.prepared.rows.iter().zip(&x.impulses.rows).zip(&y.impulses.rows) {
            sum += (p - q) * (row.velocity(&x.velocities) - row.velocity(&y.velocities));
        }
        for (i, r) in self.prepared.resistances.iter().enumerate() {
            let moved = x.impulses.moments[i] - y.impulses.moments[i];
            sum += moved.dot(r.spin(&x.velocities) - r.spin(&y.velocities));
        }
        sum
    }

    fn residual(&self, at: &BodyPoint<S>) -> f64 {
        largest(self.problem, self.prepared, &at.impulses, &at.velocities).0
    }
}
