//! Lemke's complementary pivoting, exact for linear complementarity w = M z + q, 0 <= w _|_ z >= 0
//! (theory chapter 5, item 33). Friction enters through Stewart and Trinkle's rows, exact where the friction
//! limit is polyhedral: in the plane, and with the box law. Dense, O(n^3): the oracle for small problems.

use crate::delassus::{Csr, delassus_of, right_hand_side};
use crate::impulse_solver::{ImpulseSolver, SolveSettings};
use crate::lcp::{LcpEnd, solve_lcp};
use crate::outcome::{Outcome, Stop};
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, FrictionLaw, Impulses};
use crate::residual::residual_of;
use carom_math::Space;

/// Unknowns beyond which the dense tableau is refused: 2,000 need 64 MB and seconds.
const LARGEST: usize = 2000;

/// Lemke's method.
#[derive(Clone, Debug, Default)]
pub struct Lemke;

impl<S: Space> ImpulseSolver<S> for Lemke {
    fn name(&self) -> &'static str {
        "lemke"
    }
    fn solve(&mut self, problem: &ContactProblem<S>, settings: &SolveSettings, impulses: &mut Impulses<S>) -> Outcome {
        if problem.scalar_rows() == 0 {
            return Outcome::nothing_to_do();
        }
        let prepared = Prepared::of(problem);
        let refused = |reason: String, pivots: usize, impulses: &Impulses<S>| Outcome {
            iterations: pivots,
            residual: residual_of(problem, &prepared, impulses),
            stop: Stop::Refused(reason),
        };
        let unknowns = match Unknowns::of(problem) {
            Ok(unknowns) => unknowns,
            Err(reason) => return refused(reason, 0, impulses),
        };
        let a = delassus_of(problem, &prepared);
        let (m, q) = unknowns.system(&a, &right_hand_side(problem));
        let (end, z, pivots) = solve_lcp(&m, &q, 50 * (q.len() + 10));
        match end {
            LcpEnd::Solved => {
                *impulses = unknowns.impulses(problem, &z);
                Outcome::judged(pivots, residual_of(problem, &prepared, impulses), settings.tolerance)
            }
            LcpEnd::Ray => refused("ends on a ray: the problem has no solution that pivoting can reach".into(), pivots, impulses),
            LcpEnd::OutOfPivots => refused(format!("no end after {pivots} pivots"), pivots, impulses),
        }
    }
}

/// What a nonnegative unknown of the LCP stands for.
#[derive(Clone, Copy, Debug)]
enum Unknown {
    /// sign * impulse of a scalar row, counted from `offset`.
    Impulse { row: usize, sign: f64, offset: f64 },
    /// Slip speed shared by the two directions of a tangent, with the normal row and its friction.
    Slip { normal: usize, friction: f64, plus: usize, minus: usize },
    /// Excess over the upper bound's complement of the unknown `of`, whose width is given.
    Excess { of: usize, width: f64 },
}

/// The map between a contact problem and its LCP.
struct Unknowns {
    all: Vec<Unknown>,
}

impl Unknowns {
    fn of<S: Space>(problem: &ContactProblem<S>) -> Result<Self, String> {
        let frictional = problem.contacts.iter().any(|c| c.friction > 0.0);
        if S::SLIP > 1 && frictional && problem.friction_law == FrictionLaw::Disc {
            return Err("the friction disc of space is not a linear complementarity problem; choose \
                        friction_law = \"box\", friction 0, or another solver"
                .into());
        }
        let width = 1 + S::SLIP;
        let mut all = Vec::new();
        for (i, c) in problem.contacts.iter().enumerate() {
            let normal = i * width;
            all.push(Unknown::Impulse { row: normal, sign: 1.0, offset: 0.0 });
            for row in (normal + 1..normal + width).filter(|_| c.friction > 0.0) {
                let plus = all.len();
                all.push(Unknown::Impulse { row, sign: 1.0, offset: 0.0 });
                all.push(Unknown::Impulse { row, sign: -1.0, offset: 0.0 });
                all.push(Unknown::Slip { normal, friction: c.friction, plus, minus: plus + 1 });
            }
        }
        for (k, r) in problem.rows.iter().enumerate() {
            let row = problem.contacts.len() * width + k;
            let of = all.len();
            match (r.lo.is_finite(), r.hi.is_finite()) {
                (true, false) => all.push(Unknown::Impulse { row, sign: 1.0, offset: r.lo }),
                (false, true) => all.push(Unknown::Impulse { row, sign: -1.0, offset: r.hi }),
                (false, false) => {
                    all.push(Unknown::Impulse { row, sign: 1.0, offset: 0.0 });
                    all.push(Unknown::Impulse { row, sign: -1.0, offset: 0.0 });
                }
                (true, true) => {
                    all.push(Unknown::Impulse { row, sign: 1.0, offset: r.lo });
                    all.push(Unknown::Excess { of, width: r.hi - r.lo });
                }
            }
        }
        if all.len() > LARGEST {
            return Err(format!("{} unknowns; the dense tableau of lemke takes at most {LARGEST}", all.len()));
        }
        Ok(Unknowns { all })
    }

    /// Offsets of all scalar rows: impulses = offsets + sum of signed unknowns.
    fn offsets(&self, rows: usize) -> Vec<f64> {
        let mut offsets = vec![0.0; rows];
        for u in &self.all {
            if let Unknown::Impulse { row, offset, .. } = *u {
                offsets[row] += offset;
            }
        }
        offsets
    }

    /// The matrix M and vector q of the LCP.
    fn system(&self, a: &Csr, b: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
        let n = self.all.len();
        let dense = a.dense();
        let base = a.times(&self.offsets(b.len()));
        let mut m = vec![vec![0.0; n]; n];
        let mut q = vec![0.0; n];
        for (i, u) in self.all.iter().enumerate() {
            match *u {
                Unknown::Impulse { row, sign, .. } => {
                    q[i] = sign * (base[row] - b[row]);
                    for (j, other) in self.all.iter().enumerate() {
                        match *other {
                            Unknown::Impulse { row: r, sign: s, .. } => m[i][j] = sign * s * dense[row][r],
                            Unknown::Slip { plus, minus, .. } if plus == i || minus == i => m[i][j] = 1.0,
                            Unknown::Excess { of, .. } if of == i => m[i][j] = 1.0,
                            _ => {}
                        }
                    }
                }
                Unknown::Slip { normal, friction, plus, minus } => {
                    for (j, other) in self.all.iter().enumerate() {
                        if matches!(*other, Unknown::Impulse { row, .. } if row == normal) {
                            m[i][j] = friction;
                        }
                    }
                    m[i][plus] = -1.0;
                    m[i][minus] = -1.0;
                }
                Unknown::Excess { of, width } => {
                    m[i][of] = -1.0;
                    q[i] = width;
                }
            }
        }
        (m, q)
    }

    /// Impulses from the LCP's unknowns.
    fn impulses<S: Space>(&self, problem: &ContactProblem<S>, z: &[f64]) -> Impulses<S> {
        let mut flat = self.offsets(problem.scalar_rows());
        for (u, &value) in self.all.iter().zip(z) {
            if let Unknown::Impulse { row, sign, .. } = *u {
                flat[row] += sign * value;
            }
        }
        Impulses::from_flat(problem, &flat).expect("one number per scalar row")
    }
}
