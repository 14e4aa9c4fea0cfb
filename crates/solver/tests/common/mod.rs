//! What the solver's tests share: numbers without a seed of their own, bodies, and problems with known
//! structure, written once for the plane and for space. Knows no solver.
#![allow(dead_code)] // every test file takes what it needs

use carom_math::{Column, Inertia, Rotation, Space};
use carom_solver::{
    BoundedRow, Contact, ContactProblem, FrictionLaw, Impulses, InverseMass, Outcome, Resistance,
    SolveSettings, SolverKind, Stop, Twist,
};

/// Runs a test written over a space in the plane and in space.
#[macro_export]
macro_rules! in_both_spaces {
    ($($(#[$attribute:meta])* $name:ident;)*) => {$(
        mod $name {
            $(#[$attribute])*
            #[test]
            fn planar() {
                super::$name::<carom_math::Planar>();
            }
            $(#[$attribute])*
            #[test]
            fn spatial() {
                super::$name::<carom_math::Spatial>();
            }
        }
    )*};
}

/// Free pseudo-random numbers from a fixed start: splitmix64 (Steele, Lea and Flood 2014).
pub struct Random(u64);

impl Random {
    /// A sequence of its own for every start.
    pub fn new(start: u64) -> Self {
        Random(start)
    }
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    /// In \[low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / (1u64 << 53) as f64)
    }
    /// 0, 1, ..., n - 1.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
    /// True in this share of cases.
    pub fn chance(&mut self, share: f64) -> bool {
        self.between(0.0, 1.0) < share
    }
    /// A column with entries in \[-size, size).
    pub fn column<C: Column>(&mut self, size: f64) -> C {
        C::from_fn(|_| self.between(-size, size))
    }
    /// A unit vector.
    pub fn unit<C: Column>(&mut self) -> C {
        loop {
            let v: C = self.column(1.0);
            if v.norm() > 0.1
                && let Some(unit) = v.normalized()
            {
                return unit;
            }
        }
    }
    /// A twist with entries in \[-size, size).
    pub fn twist<S: Space>(&mut self, size: f64) -> Twist<S> {
        Twist::new(self.column(size), self.column(size))
    }
    /// A body's inverse mass: masses within a factor of ten, principal moments of a real body, turned.
    pub fn inverse_mass<S: Space>(&mut self) -> InverseMass<S> {
        let mass = self.between(0.3, 3.0);
        let extents = [self.between(0.2, 1.0), self.between(0.2, 1.0), self.between(0.2, 1.0)];
        InverseMass {
            linear: 1.0 / mass,
            angular: self.turned::<S>(&box_inverse_inertia::<S>(mass, extents)),
        }
    }
    /// An inverse inertia seen from a random orientation.
    pub fn turned<S: Space>(&mut self, inertia: &S::Inertia) -> S::Inertia {
        S::turned(inertia, &S::Rotation::about(self.column(3.0)))
    }
}

/// Inverse inertia of a homogeneous box with these edges, about its centre (theory eq. 1.28).
pub fn box_inverse_inertia<S: Space>(mass: f64, edges: [f64; 3]) -> S::Inertia {
    let [x, y, z] = edges.map(|e| e * e * mass / 12.0);
    let moments = if S::SPIN == 1 { vec![x + y] } else { vec![y + z, x + z, x + y, 0.0, 0.0, 0.0] };
    S::Inertia::from_entries(&moments).and_then(|i| i.inverse()).expect("a box has a regular inertia")
}

/// Inverse inertia of a solid ball (of a disc in the plane).
pub fn ball_inverse_inertia<S: Space>(mass: f64, radius: f64) -> S::Inertia {
    let moment = mass * radius * radius * if S::SPIN == 1 { 0.5 } else { 0.4 };
    let entries = if S::SPIN == 1 { vec![moment] } else { vec![moment, moment, moment, 0.0, 0.0, 0.0] };
    S::Inertia::from_entries(&entries).and_then(|i| i.inverse()).expect("a ball has a regular inertia")
}

/// A body that nothing moves.
pub fn obstacle<S: Space>() -> InverseMass<S> {
    InverseMass { linear: 0.0, angular: S::Inertia::ZERO }
}

/// A mass without rotation.
pub fn particle<S: Space>(mass: f64) -> InverseMass<S> {
    InverseMass { linear: 1.0 / mass, angular: S::Inertia::ZERO }
}

/// A solid ball.
pub fn ball<S: Space>(mass: f64, radius: f64) -> InverseMass<S> {
    InverseMass { linear: 1.0 / mass, angular: ball_inverse_inertia::<S>(mass, radius) }
}

/// A homogeneous box, axes along the world's.
pub fn brick<S: Space>(mass: f64, edges: [f64; 3]) -> InverseMass<S> {
    InverseMass { linear: 1.0 / mass, angular: box_inverse_inertia::<S>(mass, edges) }
}

/// The `k`-th axis as a vector of given length.
pub fn along<C: Column>(k: usize, length: f64) -> C {
    C::from_fn(|i| if i == k { length } else { 0.0 })
}

/// A vector from its first two numbers; further ones are zero.
pub fn flat<C: Column>(x: f64, y: f64) -> C {
    C::from_fn(|i| [x, y, 0.0][i])
}

/// A twist without rotation.
pub fn moving<S: Space>(velocity: S::Vector) -> Twist<S> {
    Twist::new(velocity, S::Spin::ZERO)
}

/// A contact between the centres' surroundings: arms as given, closed, without friction or restitution.
pub fn contact<S: Space>(
    (a, arm_a): (usize, S::Vector),
    (b, arm_b): (usize, S::Vector),
    normal: S::Vector,
) -> Contact<S> {
    let (gap, target, slip_target) = (0.0, 0.0, S::Slip::ZERO);
    Contact { id: 0, a, b, normal, arm_a, arm_b, gap, target, slip_target, restitution: 0.0, friction: 0.0 }
}

/// Sets Newton's targets -c_r u_n of the simultaneous law for all contacts from the present velocities.
pub fn bounce<S: Space>(problem: &mut ContactProblem<S>, restitution: f64) {
    for c in &mut problem.contacts {
        c.restitution = restitution;
        c.target = -restitution * c.relative_velocity(&problem.velocities).0;
    }
}

/// What a random problem is made of.
#[derive(Clone, Copy)]
pub struct Recipe {
    pub bodies: usize,
    pub contacts: usize,
    pub rows: usize,
    /// Largest coefficient of friction; half of the contacts of a problem with friction have some.
    pub friction: f64,
    pub law: FrictionLaw,
}

/// Bodies of random shape and velocity with random contacts and bounded rows; body 0 is an obstacle.
/// The targets allow some velocity (u >= target has a solution: targets are those of a random twist,
/// lowered), so the frictionless problem is solvable.
pub fn random_problem<S: Space>(random: &mut Random, recipe: Recipe) -> ContactProblem<S> {
    let mut masses = vec![obstacle::<S>()];
    masses.extend((1..recipe.bodies).map(|_| random.inverse_mass::<S>()));
    let mut velocities = vec![Twist::default()];
    velocities.extend((1..recipe.bodies).map(|_| random.twist::<S>(1.0)));
    let mut allowed = vec![Twist::default()];
    allowed.extend((1..recipe.bodies).map(|_| random.twist::<S>(0.5)));
    let mut problem = ContactProblem::new(masses, velocities);
    problem.friction_law = recipe.law;
    for id in 0..recipe.contacts {
        let (a, b) = pair(random, recipe.bodies);
        let (arm_a, arm_b) = (random.column(0.5), random.column(0.5));
        let mut c = Contact { id: id as u64, ..contact((a, arm_a), (b, arm_b), random.unit()) };
        c.target = c.relative_velocity(&allowed).0 - random.between(0.0, 0.3);
        if recipe.friction > 0.0 && random.chance(0.8) {
            c.friction = random.between(0.0, recipe.friction);
        }
        problem.contacts.push(c);
    }
    for id in 0..recipe.rows {
        let (a, b) = pair(random, recipe.bodies);
        let (on_a, on_b) = (random.twist::<S>(1.0), random.twist::<S>(1.0));
        let (lo, hi) = match random.below(4) {
            0 => (f64::NEG_INFINITY, f64::INFINITY),
            1 => (0.0, f64::INFINITY),
            2 => (-random.between(0.0, 0.5), random.between(0.0, 0.5)),
            _ => (f64::NEG_INFINITY, 0.1),
        };
        let target = on_a.dot(&allowed[a]) + on_b.dot(&allowed[b]);
        problem.rows.push(BoundedRow { id: id as u64, a, b, on_a, on_b, target, lo, hi });
    }
    problem
}

/// Two different bodies.
fn pair(random: &mut Random, bodies: usize) -> (usize, usize) {
    let a = random.below(bodies);
    let b = (a + 1 + random.below(bodies - 1)) % bodies;
    (a, b)
}

/// Total momentum, angular momentum about the origin, and kinetic energy of the bodies that can move; bodies
/// without inertia do not turn.
pub fn totals<S: Space>(
    problem: &ContactProblem<S>,
    positions: &[S::Vector],
    velocities: &[Twist<S>],
) -> (S::Vector, S::Spin, f64) {
    let (mut p, mut l, mut t) = (S::Vector::ZERO, S::Spin::ZERO, 0.0);
    for ((m, v), &x) in problem.inverse_masses.iter().zip(velocities).zip(positions) {
        if m.linear > 0.0 {
            let momentum = v.linear * (1.0 / m.linear);
            p += momentum;
            l += S::moment(x, momentum);
            t += 0.5 * momentum.dot(v.linear);
        }
        if let Some(inertia) = m.angular.inverse() {
            let spin = inertia.apply(v.angular);
            l += spin;
            t += 0.5 * spin.dot(v.angular);
        }
    }
    (p, l, t)
}

/// Kinetic energy of the bodies that can move.
pub fn kinetic_energy<S: Space>(problem: &ContactProblem<S>, velocities: &[Twist<S>]) -> f64 {
    totals(problem, &vec![S::Vector::ZERO; velocities.len()], velocities).2
}

/// Fails unless two numbers agree.
#[track_caller]
pub fn assert_close(got: f64, wanted: f64, tolerance: f64, what: &str) {
    assert!(
        (got - wanted).abs() <= tolerance,
        "{what}: got {got:.17e}, wanted {wanted:.17e}, off by {:.3e}",
        got - wanted
    );
}

/// Fails unless two columns agree component by component.
#[track_caller]
pub fn assert_column_close<C: Column>(got: C, wanted: C, tolerance: f64, what: &str) {
    let error = (got - wanted).max_abs();
    assert!(error <= tolerance, "{what}: got {got:?}, wanted {wanted:?}, off by {error:.3e}");
}

/// Solves a dense linear system by elimination with partial pivoting; `None` when it is singular.
pub fn solve_dense(mut m: Vec<Vec<f64>>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    let size = m.iter().flatten().fold(0.0, |s: f64, x| s.max(x.abs()));
    for k in 0..n {
        let p = (k..n).max_by(|&i, &j| m[i][k].abs().total_cmp(&m[j][k].abs()))?;
        if m[p][k].abs() <= 1e-13 * size {
            return None;
        }
        m.swap(k, p);
        b.swap(k, p);
        for i in k + 1..n {
            let f = m[i][k] / m[k][k];
            let (top, below) = m.split_at_mut(i);
            below[0].iter_mut().zip(&top[k]).skip(k).for_each(|(x, y)| *x -= f * y);
            b[i] -= f * b[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| m[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / m[k][k];
    }
    Some(b)
}

/// Solves with fresh memory from zero impulses.
pub fn solve<S: Space>(
    problem: &ContactProblem<S>,
    kind: SolverKind,
    iterations: usize,
    tolerance: f64,
) -> (Impulses<S>, Outcome) {
    let mut impulses = Impulses::zero(problem);
    let outcome = kind.make().solve(
        problem,
        &SolveSettings { iterations, tolerance, ..SolveSettings::default() },
        &mut impulses,
    );
    (impulses, outcome)
}

/// Solves and fails unless the residual is small.
#[track_caller]
pub fn solved<S: Space>(problem: &ContactProblem<S>, kind: SolverKind, tolerance: f64) -> Impulses<S> {
    let (impulses, outcome) = solve(problem, kind, 1_000_000, tolerance);
    assert_eq!(outcome.stop, Stop::Converged, "{}: residual {:e}", kind.name(), outcome.residual.absolute);
    impulses
}

/// A row of equal balls along the first axis, all contacts closed; contact i joins balls i and i + 1.
pub fn cradle<S: Space>(speeds: &[f64]) -> ContactProblem<S> {
    let masses = vec![ball::<S>(1.0, 0.5); speeds.len()];
    let velocities = speeds.iter().map(|&v| moving(along(0, v))).collect();
    let mut problem = ContactProblem::new(masses, velocities);
    for i in 0..speeds.len() - 1 {
        let c = contact((i, along(0, 0.5)), (i + 1, along(0, -0.5)), along(0, -1.0));
        problem.contacts.push(Contact { id: i as u64, ..c });
    }
    problem
}

/// Speeds along the first axis.
pub fn speeds<S: Space>(velocities: &[Twist<S>]) -> Vec<f64> {
    velocities.iter().map(|v| v.linear[0]).collect()
}

/// Balls of these masses on top of each other, the lowest on an obstacle (body 0), after a step of gravity that
/// would give each the velocity -gh = -0.04; contact k carries the balls from k on.
pub fn column<S: Space>(masses: &[f64], friction: f64) -> ContactProblem<S> {
    let up = S::DIM - 1;
    let mut problem = ContactProblem::new(vec![obstacle()], vec![Twist::default()]);
    for (k, &mass) in masses.iter().enumerate() {
        problem.inverse_masses.push(ball(mass, 0.5));
        problem.velocities.push(moving(along(up, -0.04)));
        let c = contact((k + 1, along(up, -0.5)), (k, along(up, 0.5)), along(up, 1.0));
        problem.contacts.push(Contact { id: k as u64, friction, ..c });
    }
    problem
}

/// Problems beside each other as one.
pub fn beside<S: Space>(problems: &[ContactProblem<S>]) -> ContactProblem<S> {
    let mut whole = ContactProblem::new(Vec::new(), Vec::new());
    whole.friction_law = problems[0].friction_law;
    for p in problems {
        let (bodies, contacts) = (whole.inverse_masses.len(), whole.contacts.len());
        whole.inverse_masses.extend(&p.inverse_masses);
        whole.velocities.extend(&p.velocities);
        let place = |k: usize| k + bodies;
        whole.contacts.extend(p.contacts.iter().map(|c| Contact { a: place(c.a), b: place(c.b), ..*c }));
        whole.rows.extend(p.rows.iter().map(|r| BoundedRow { a: place(r.a), b: place(r.b), ..*r }));
        let moved = p.resistances.iter().map(|r| Resistance { contact: r.contact + contacts, ..*r });
        whole.resistances.extend(moved);
    }
    whole
}
