//! Contacts without friction: z >= 0, u = W z + q >= 0, z.u = 0. Sweeps guess who presses, block principal pivots decide
//! (Judice and Pires 1994): the system of those who press is factorised, and every impulse and velocity of the wrong sign
//! changes sides; once that no longer lowers their number, only the last of them does (Murty 1974). From a good start one
//! factorisation is enough. Where those who press hold each other up in more than one way, the system is singular, and the
//! problem is left to the other stages.

use super::normals::Normals;
use crate::linear::Envelope;
use crate::problem::{ContactProblem, Impulse, Impulses, Twist};
use crate::residual::{Residual, residual_of_normals};
use crate::watch::{Progress, Watch};
use carom_math::{Column, Space};

/// Sweeps that guess who presses, where nothing is known of it.
const GUESSES: usize = 8;
/// Contacts up to which a problem is small.
const FEW: usize = 16;
/// Factorisations after which the other stages have their turn.
const MOST: usize = 30;
/// Rounds that may pass in which no fewer have the wrong sign, before one at a time changes sides.
const PATIENCE: usize = 3;
/// Multiply-adds of a factorisation beyond which a sparse factor is cheaper.
const LARGE: f64 = 5e6;
/// Share of the tolerance that signs are judged by.
const SHARE: f64 = 0.3;

/// The method; holds memory between solves, nothing that changes an answer.
#[derive(Clone, Debug, Default)]
pub struct Frictionless<S: Space> {
    normals: Normals<S>,
    /// Those of the other class of sizes: a heap's graph stands from solve to solve, with single balls solved in between.
    others: Normals<S>,
    z: Vec<f64>,
    u: Vec<f64>,
    presses: Vec<bool>,
    /// The place of each that presses among them.
    among: Vec<u32>,
    members: Vec<u32>,
    right: Vec<f64>,
    matrix: Envelope,
    given: Impulses<S>,
    asked: Vec<bool>,
    /// What impulses make of their contacts, for the residual.
    pressed: Vec<f64>,
    after: Vec<Twist<S>>,
}

/// How a solve went that came to its end.
#[derive(Clone, Copy, Debug)]
pub struct Ended {
    /// Of the impulses that it found.
    pub residual: Residual,
    /// Sweeps and factorisations.
    pub iterations: usize,
    /// The latter alone.
    pub factorisations: usize,
}

impl<S: Space> Frictionless<S> {
    /// Solves a problem of contacts without friction and without rows to a tolerance \[m/s\] from the impulses given; `None`,
    /// and they are as they were, where that does not come out.
    pub fn solve(
        &mut self,
        problem: &ContactProblem<S>,
        (tolerance, budget): (f64, usize),
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Option<Ended> {
        self.given.copy_from(impulses);
        let mut asked = std::mem::take(&mut self.asked);
        asked.clear();
        asked.resize(problem.contacts.len(), true);
        let found = self.find((problem, &asked), (tolerance, budget), impulses, watch);
        self.asked = asked;
        let (iterations, factorisations) = found?;
        // measured by the velocities themselves, as everybody else does
        let residual = residual_of_normals(problem, impulses, (&mut self.pressed, &mut self.after));
        if !(residual.absolute <= tolerance) {
            impulses.copy_from(&self.given);
            return None;
        }
        Some(Ended { residual, iterations, factorisations })
    }

    /// The same of the contacts that are asked for, by the velocities that W says, for who measures the impulses; iterations,
    /// and factorisations among them.
    pub fn find(
        &mut self,
        (problem, asked): (&ContactProblem<S>, &[bool]),
        (tolerance, budget): (f64, usize),
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Option<(usize, usize)> {
        let is_large = |contacts: usize| contacts > FEW;
        let count = asked.iter().filter(|asked| **asked).count();
        if is_large(count) != is_large(self.normals.count()) {
            std::mem::swap(&mut self.normals, &mut self.others);
        }
        self.normals.update(problem, asked);
        self.begin(impulses);
        let (mut sweeps, mut factorisations) = (0, 0);
        let mut worst = self.worst();
        if !(worst.0 <= tolerance) {
            if self.z.iter().all(|z| *z == 0.0) {
                (0..GUESSES).for_each(|_| self.sweep());
                self.follow();
                sweeps = GUESSES;
            }
            factorisations = self.pivot(SHARE * tolerance, budget.min(MOST), watch)?;
            worst = self.worst();
        }
        if !(worst.0 <= tolerance) {
            return None;
        }
        for (&k, &z) in self.normals.order.iter().zip(&self.z) {
            impulses.contacts[k as usize] = Impulse { normal: z, tangent: S::Slip::ZERO };
        }
        Some((sweeps + factorisations, factorisations))
    }

    /// The given impulses, and the velocities after them.
    fn begin(&mut self, impulses: &Impulses<S>) {
        let given = |k: &u32| {
            let z = impulses.contacts[*k as usize].normal;
            if z.is_finite() { z.max(0.0) } else { 0.0 }
        };
        self.z.clear();
        self.z.extend(self.normals.order.iter().map(given));
        self.follow();
    }

    /// u = W z + q.
    fn follow(&mut self) {
        let Frictionless { normals, z, u, .. } = self;
        u.clear();
        u.extend((0..normals.count()).map(|i| normals.velocity_after(i, z)));
    }

    /// The largest residual, and whose it is.
    fn worst(&self) -> (f64, usize) {
        let mut worst = (0.0, 0);
        for (i, ((z, u), w)) in self.z.iter().zip(&self.u).zip(&self.normals.diagonal).enumerate() {
            let off = (z * w).min(*u).abs();
            if off > worst.0 || off.is_nan() {
                worst = (off, i);
            }
        }
        worst
    }

    /// One sweep of Gauss and Seidel.
    fn sweep(&mut self) {
        let Frictionless { normals, z, .. } = self;
        for i in 0..normals.count() {
            let w = normals.diagonal[i];
            if w > 0.0 {
                z[i] = (z[i] - normals.velocity_after(i, z) / w).max(0.0);
            }
        }
    }

    /// Pivots until all signs are right to a bound \[m/s\]; the factorisations that it took.
    fn pivot(&mut self, bound: f64, most: usize, watch: &mut Watch) -> Option<usize> {
        let n = self.normals.count();
        self.presses.clear();
        let guess = self.z.iter().zip(&self.u).zip(&self.normals.diagonal).map(|((z, u), w)| z * w > *u);
        self.presses.extend(guess);
        let (mut fewest, mut patience) = (n + 1, PATIENCE);
        for round in 1..=most {
            self.press(bound)?;
            let (mut wrong, mut last) = (0, 0);
            for i in 0..n {
                let off = if self.presses[i] { self.z[i] * self.normals.diagonal[i] } else { self.u[i] };
                if off < -bound {
                    (wrong, last) = (wrong + 1, i);
                }
            }
            if wrong == 0 {
                if self.z.iter().any(|z| *z < 0.0) {
                    self.z.iter_mut().for_each(|z| *z = z.max(0.0));
                    self.follow();
                }
                return Some(round);
            }
            let residual = self.worst().0;
            if !watch(&Progress { stage: "pivots", iterations: round, residual }) {
                return None;
            }
            patience = if wrong < fewest { PATIENCE } else { patience.saturating_sub(1) };
            fewest = fewest.min(wrong);
            if patience == 0 {
                self.presses[last] = !self.presses[last];
                continue;
            }
            for i in 0..n {
                let off = if self.presses[i] { self.z[i] * self.normals.diagonal[i] } else { self.u[i] };
                self.presses[i] ^= off < -bound;
            }
        }
        None
    }

    /// Impulses with which those that press come to rest, and the velocities after them; refined where rounding leaves more
    /// than a bound \[m/s\].
    fn press(&mut self, bound: f64) -> Option<()> {
        self.factorize()?;
        self.right.clear();
        self.right.extend(self.members.iter().map(|&i| -self.normals.velocity[i as usize]));
        self.z.fill(0.0);
        for _ in 0..3 {
            self.matrix.solve(&mut self.right);
            self.members.iter().zip(&self.right).for_each(|(&i, z)| self.z[i as usize] += z);
            self.follow();
            self.right.clear();
            self.right.extend(self.members.iter().map(|&i| -self.u[i as usize]));
            if self.right.iter().all(|u| u.abs() <= bound) {
                break;
            }
        }
        Some(())
    }

    /// Factorises W between those that press.
    fn factorize(&mut self) -> Option<()> {
        let Frictionless { normals, presses, among, members, matrix, .. } = self;
        members.clear();
        among.clear();
        matrix.clear();
        let mut cost = 0.0;
        for i in 0..normals.count() {
            let own = members.len();
            among.push(own as u32);
            if !presses[i] {
                continue;
            }
            members.push(i as u32);
            let before = |(j, w): (usize, f64)| (j < i && presses[j]).then(|| (among[j] as usize, w));
            let first = normals.row(i).filter_map(before).fold(own, |first, (j, _)| first.min(j));
            cost += ((own - first) * (own - first)) as f64;
            if cost > LARGE {
                return None;
            }
            let row = matrix.push(first);
            normals.row(i).filter_map(before).for_each(|(j, w)| row[j - first] += w);
            row[own - first] = normals.diagonal[i];
        }
        matrix.factorize().then_some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ImpulseSolver;
    use crate::problem::{Contact, InverseMass};
    use crate::watch::unwatched;
    use carom_math::{Spatial, Sym3, Vec3, vec3};

    /// Balls of 1 kg and radius 1 in a row on the ground, which some leave, each pushed against the next one.
    fn row(balls: usize, push: impl Fn(usize) -> Vec3) -> ContactProblem<Spatial> {
        let ground = InverseMass { linear: 0.0, angular: Sym3 { diagonal: [0.0; 3], off: [0.0; 3] } };
        let ball = InverseMass { linear: 1.0, angular: Sym3 { diagonal: [2.5; 3], off: [0.0; 3] } };
        let mut masses = vec![ball; balls];
        masses.push(ground);
        let mut velocities: Vec<Twist<Spatial>> =
            (0..balls).map(|k| Twist::new(push(k), Vec3::ZERO)).collect();
        velocities.push(Twist::default());
        let mut problem = ContactProblem::new(masses, velocities);
        let contact = |id: usize, (a, b): (usize, usize), normal: Vec3| Contact {
            id: id as u64,
            a,
            b,
            normal,
            arm_a: -normal,
            arm_b: normal,
            gap: 0.0,
            target: 0.0,
            slip_target: Column::ZERO,
            restitution: 0.0,
            friction: 0.0,
        };
        for k in 0..balls {
            problem.contacts.push(contact(2 * k, (k, balls), vec3(0.0, 0.0, 1.0)));
            if k > 0 {
                let lean = 0.3 * (k as f64).sin();
                let normal = vec3(lean.cos(), 0.0, lean.sin());
                problem.contacts.push(contact(2 * k + 1, (k, k - 1), normal));
            }
        }
        problem
    }

    fn solved(problem: &ContactProblem<Spatial>, given: &Impulses<Spatial>) -> (Impulses<Spatial>, Ended) {
        let mut found = given.clone();
        let ended = Frictionless::default()
            .solve(problem, (1e-13, 2000), &mut found, &mut unwatched)
            .expect("pivots");
        (found, ended)
    }

    #[test]
    fn signs_come_out_right_and_a_good_start_takes_one_factorisation_or_none() {
        let pushes = |scale: f64| {
            move |k: usize| {
                let x = (1.7 * k as f64).sin() - 0.1 * k as f64;
                vec3(scale * x, 0.2, (2.3 * k as f64).cos() - 0.4)
            }
        };
        let problem = row(60, pushes(1.0));
        let (found, ended) = solved(&problem, &Impulses::zero(&problem));
        assert!(ended.factorisations > 0 && crate::residual::residual(&problem, &found).absolute <= 1e-12);
        let pressing = found.contacts.iter().filter(|g| g.normal > 0.0).count();
        assert!(pressing > 20 && pressing < found.contacts.len(), "{pressing}");
        // from the answer nothing is left to do, from that of a problem much like it nearly nothing
        assert_eq!(solved(&problem, &found).1.factorisations, 0);
        let near = row(60, pushes(1.0 + 1e-6));
        assert_eq!(solved(&near, &found).1.factorisations, 1);
    }

    #[test]
    fn contacts_that_hold_each_other_up_are_left_to_others() {
        let mut problem = row(2, |_| vec3(0.0, 0.0, -1.0));
        let twice = problem.contacts[0];
        problem.contacts.push(twice);
        let mut found = Impulses::zero(&problem);
        found.contacts.iter_mut().for_each(|g| g.normal = 0.1);
        let given = found.clone();
        let ended = Frictionless::default().solve(&problem, (1e-13, 2000), &mut found, &mut unwatched);
        assert!(ended.is_none() && found == given);
    }

    /// Balls in a row of which some do not touch the next, one that leaves the ground, and one alone that presses.
    fn islands() -> ContactProblem<Spatial> {
        let push = |k: usize| match k {
            12 => vec3(0.0, 0.0, 1.0),
            13 => vec3(0.0, 0.0, -1.0),
            _ => vec3((1.7 * k as f64).sin() - 0.1 * k as f64, 0.2, (2.3 * k as f64).cos() - 0.4),
        };
        let mut problem = row(14, push);
        for a in [5, 9, 12, 13] {
            problem.contacts.retain(|c| (c.a, c.b) != (a, a - 1));
        }
        problem
    }

    fn climbed(
        problem: &ContactProblem<Spatial>,
        given: &Impulses<Spatial>,
    ) -> (Impulses<Spatial>, crate::Outcome) {
        let mut solver = crate::methods::ladder::Ladder::new("exact", &[crate::SolverKind::Exact]);
        let settings = crate::SolveSettings { tolerance: 1e-13, ..crate::SolveSettings::default() };
        let mut found = given.clone();
        let outcome = solver.solve(problem, &settings, &mut found);
        (found, outcome)
    }

    #[test]
    fn islands_that_are_solved_all_at_once_come_out_as_each_by_itself() {
        let problem = islands();
        let (found, outcome) = climbed(&problem, &Impulses::zero(&problem));
        let kinds: Vec<_> = outcome.islands.iter().map(|i| (i.contacts, i.bodies, i.first_body)).collect();
        assert_eq!(kinds, [(9, 5, 0), (7, 4, 5), (5, 3, 9), (1, 1, 13)], "who leaves is in no island");
        assert!(outcome.residual.absolute <= 1e-13 && outcome.stop == crate::Stop::Converged);
        let largest = outcome.islands.iter().map(|i| i.residual).fold(0.0, f64::max);
        assert_eq!(largest, outcome.residual.absolute);
        for island in &outcome.islands {
            let is_in =
                |c: &Contact<Spatial>| (island.first_body..island.first_body + island.bodies).contains(&c.a);
            let mut own = problem.clone();
            own.contacts.retain(is_in);
            let (alone, report) = climbed(&own, &Impulses::zero(&own));
            assert!((report.islands[0].relative_residual - island.relative_residual).abs() < 1e-12);
            let mine = problem.contacts.iter().zip(&found.contacts).filter(|(c, _)| is_in(c));
            for ((_, mine), alone) in mine.zip(&alone.contacts) {
                assert!((mine.normal - alone.normal).abs() < 1e-12, "{mine:?} {alone:?}");
            }
        }
    }

    #[test]
    fn an_island_that_is_singular_takes_the_others_nothing() {
        let mut problem = islands();
        let twice = problem.contacts[0];
        problem.contacts.push(twice);
        let (found, outcome) = climbed(&problem, &Impulses::zero(&problem));
        assert!(outcome.residual.absolute <= 1e-13, "{outcome:?}");
        assert_eq!(outcome.islands.len(), 4);
        let (known, _) = climbed(&islands(), &Impulses::zero(&islands()));
        for (found, known) in found.contacts.iter().zip(&known.contacts).skip(9) {
            assert!((found.normal - known.normal).abs() < 1e-12);
        }
    }
}
