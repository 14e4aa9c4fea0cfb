//! Lemke's complementary pivoting, exact for linear complementarity w = M z + q, 0 <= w _|_ z >= 0
//! (theory eqs. 5.28 to 5.30, item 33). Friction enters through Stewart and Trinkle's rows, exact where the
//! friction limit is polyhedral: in the plane, and with the box law. Dense, O(n^3): the reference for small
//! problems.

use crate::cone::project;
use crate::delassus::{Csr, delassus_of, right_hand_side_of};
use crate::friction_measure::measure;
use crate::friction_problem::{FrictionProblem, project_on_cone};
use crate::friction_solver::{FrictionOutcome, FrictionSettings, FrictionSolver, Stage};
use crate::impulse_solver::{ImpulseSolver, SolveSettings};
use crate::lcp::{Judge, LcpEnd, solve_lcp, solve_lcp_with};
use crate::methods::resisted;
use crate::outcome::{Outcome, Stop};
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, FrictionLaw, Impulses};
use crate::residual::residual_of;
use crate::stopwatch::Stopwatch;
use crate::watch::Watch;
use carom_math::Space;
use smallvec::smallvec;

/// Unknowns beyond which the dense tableau is refused: 2,000 need 64 MB and seconds.
const LARGEST: usize = 2000;

/// Lemke's method.
#[derive(Clone, Debug, Default)]
pub struct Lemke;

impl<S: Space> ImpulseSolver<S> for Lemke {
    fn name(&self) -> &'static str {
        "lemke"
    }
    fn refusal(&self, problem: &ContactProblem<S>) -> Option<String> {
        resisted(problem, "lemke")
    }
    fn work(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        _watch: &mut Watch,
    ) -> Outcome {
        let prepared = Prepared::of(problem);
        let refused = |reason: String, pivots: usize, impulses: &Impulses<S>| {
            Outcome::new(pivots, residual_of(problem, &prepared, impulses), Stop::Refused(reason))
        };
        // with friction a wedge can also hold itself; where nothing is asked for, nothing is the answer
        let mut nothing = Impulses::zero(problem);
        project(problem, &mut nothing);
        let residual = residual_of(problem, &prepared, &nothing);
        if residual.absolute == 0.0 {
            *impulses = nothing;
            return Outcome::judged(0, residual, settings.tolerance);
        }
        let unknowns = match Unknowns::of(problem) {
            Ok(unknowns) => unknowns,
            Err(reason) => return refused(reason, 0, impulses),
        };
        let a = delassus_of(problem, &prepared);
        let (m, q) = unknowns.system(&a, &right_hand_side_of(problem, &prepared));
        let slack = |z: &[f64]| unknowns.slack(problem, &prepared, z);
        let error = |z: &[f64]| unknowns.error(problem, &prepared, z);
        let judge = Judge { slack: &slack, error: &error };
        let (end, z, pivots) = solve_lcp_with(&m, &q, &judge, 50 * (q.len() + 10));
        let mut found: Impulses<S> = unknowns.impulses(problem, &z);
        project(problem, &mut found);
        let found_residual = residual_of(problem, &prepared, &found);
        // a right-hand side of rounding has no accurate solution relative to itself; one within the tolerance it has
        let good_enough = found.is_finite() && found_residual.absolute <= settings.tolerance;
        match end {
            end if good_enough || (end == LcpEnd::Solved && found.is_finite()) => {
                *impulses = found;
                Outcome::judged(pivots, found_residual, settings.tolerance)
            }
            LcpEnd::Solved => refused("the impulses outgrow all numbers".into(), pivots, impulses),
            LcpEnd::Ray => refused(ray(problem), pivots, impulses),
            LcpEnd::OutOfPivots => {
                refused(format!("no accurate solution after {pivots} pivots"), pivots, impulses)
            }
        }
    }
}

/// In matrix form only problems without friction (one row per contact).
impl FrictionSolver for Lemke {
    fn name(&self) -> &'static str {
        "lemke"
    }
    fn work(
        &mut self,
        problem: &FrictionProblem,
        settings: &FrictionSettings,
        impulses: &mut [f64],
        _watch: &mut Watch,
    ) -> FrictionOutcome {
        let start = Stopwatch::start();
        let n = problem.velocity.len();
        impulses.iter_mut().filter(|r| !r.is_finite()).for_each(|r| *r = 0.0);
        for (r, &mu) in impulses.chunks_exact_mut(problem.dimension).zip(&problem.friction) {
            project_on_cone(r, mu);
        }
        let (pivots, reason) = if problem.dimension > 1 {
            (
                0,
                "lemke takes problems without friction, with one row per contact; choose another solver"
                    .into(),
            )
        } else if n > LARGEST {
            (0, format!("{n} unknowns; the dense tableau of lemke takes at most {LARGEST}"))
        } else {
            let (end, z, pivots) = solve_lcp(&problem.matrix.dense(), &problem.velocity, 50 * (n + 10));
            if z.iter().all(|z| z.is_finite()) {
                impulses.copy_from_slice(&z);
            }
            let reason = match end {
                LcpEnd::Ray => "ends on a ray: the problem may have no solution".into(),
                _ => format!("no accurate solution after {pivots} pivots"),
            };
            (pivots, reason)
        };
        let seconds = start.seconds();
        let measure = measure(problem, impulses);
        let solved = measure.solves(settings.tolerance);
        FrictionOutcome {
            solved,
            measure,
            stages: smallvec![Stage { name: "pivots", iterations: pivots }],
            factorisations: 0,
            seconds,
            reason: if solved { String::new() } else { reason },
            strict_feasibility: None,
        }
    }
}

/// Why a path can end on a ray.
fn ray<S: Space>(problem: &ContactProblem<S>) -> String {
    if problem.contacts.iter().all(|c| c.friction == 0.0) {
        "ends on a ray: no velocities meet all targets at once".into()
    } else {
        "ends on a ray: the targets contradict each other, or friction jams the bodies against them".into()
    }
}

/// What a nonnegative unknown of the LCP stands for.
#[derive(Clone, Copy, Debug)]
enum Unknown {
    /// sign * impulse of a scalar row, counted from `offset`; its slack also holds the unknown `partner`, the
    /// slip speed or the excess.
    Impulse { row: usize, sign: f64, offset: f64, partner: Option<usize> },
    /// Slip speed shared by the two directions of a tangent, whose limit is friction times the unknown `normal`.
    Slip { normal: usize, friction: f64, plus: usize, minus: usize },
    /// Excess speed at the upper bound of the unknown `of`, which may grow to `width`.
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
            let normal = all.len();
            all.push(Unknown::Impulse { row: i * width, sign: 1.0, offset: 0.0, partner: None });
            if c.friction > 0.0 {
                for k in 0..S::SLIP {
                    let (row, plus) = (i * width + 1 + k, all.len());
                    let partner = Some(plus + 2);
                    all.push(Unknown::Impulse { row, sign: 1.0, offset: 0.0, partner });
                    all.push(Unknown::Impulse { row, sign: -1.0, offset: 0.0, partner });
                    all.push(Unknown::Slip { normal, friction: c.friction, plus, minus: plus + 1 });
                }
            }
        }
        for (k, r) in problem.rows.iter().enumerate() {
            let row = problem.contacts.len() * width + k;
            let mut push = |sign, offset, partner| all.push(Unknown::Impulse { row, sign, offset, partner });
            match (r.lo.is_finite(), r.hi.is_finite()) {
                (true, false) => push(1.0, r.lo, None),
                (false, true) => push(-1.0, r.hi, None),
                (false, false) => {
                    push(1.0, 0.0, None);
                    push(-1.0, 0.0, None);
                }
                (true, true) => {
                    let of = all.len();
                    all.push(Unknown::Impulse { row, sign: 1.0, offset: r.lo, partner: Some(of + 1) });
                    all.push(Unknown::Excess { of, width: r.hi - r.lo });
                }
            }
        }
        if all.len() > LARGEST {
            return Err(format!(
                "{} unknowns; the dense tableau of lemke takes at most {LARGEST}",
                all.len()
            ));
        }
        Ok(Unknowns { all })
    }

    /// All scalar impulses: offsets plus the sum of signed unknowns.
    fn flat(&self, rows: usize, z: &[f64]) -> Vec<f64> {
        let mut flat = vec![0.0; rows];
        for (u, z) in self.all.iter().zip(z) {
            if let Unknown::Impulse { row, sign, offset, .. } = *u {
                flat[row] += offset + sign * z;
            }
        }
        flat
    }

    /// Impulses from the LCP's unknowns.
    fn impulses<S: Space>(&self, problem: &ContactProblem<S>, z: &[f64]) -> Impulses<S> {
        Impulses::from_flat(problem, &self.flat(problem.scalar_rows(), z)).expect("one number per scalar row")
    }

    /// The matrix M and vector q of the LCP.
    fn system(&self, a: &Csr, b: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
        let n = self.all.len();
        let dense = a.dense();
        let base = a.times(&self.flat(b.len(), &vec![0.0; n]));
        let mut m = vec![vec![0.0; n]; n];
        let mut q = vec![0.0; n];
        for (i, u) in self.all.iter().enumerate() {
            match *u {
                Unknown::Impulse { row, sign, partner, .. } => {
                    q[i] = sign * (base[row] - b[row]);
                    for (entry, other) in m[i].iter_mut().zip(&self.all) {
                        if let Unknown::Impulse { row: r, sign: s, .. } = *other {
                            *entry = sign * s * dense[row][r];
                        }
                    }
                    if let Some(partner) = partner {
                        m[i][partner] = 1.0;
                    }
                }
                Unknown::Slip { normal, friction, plus, minus } => {
                    m[i][normal] = friction;
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

    /// M z + q with the velocities formed on the bodies, where impulses that nearly cancel lose no digits.
    fn slack<S: Space>(&self, problem: &ContactProblem<S>, prepared: &Prepared<S>, z: &[f64]) -> Vec<f64> {
        let errors = prepared.velocity_errors(problem, &self.impulses(problem, z));
        let slack = |u: &Unknown| match *u {
            Unknown::Impulse { row, sign, partner, .. } => sign * errors[row] + partner.map_or(0.0, |p| z[p]),
            Unknown::Slip { normal, friction, plus, minus } => friction * z[normal] - (z[plus] + z[minus]),
            Unknown::Excess { of, width } => width - z[of],
        };
        self.all.iter().map(slack).collect()
    }

    /// The residual as a share of the largest velocity that a single impulse makes or that is asked for.
    fn error<S: Space>(&self, problem: &ContactProblem<S>, prepared: &Prepared<S>, z: &[f64]) -> f64 {
        let mut impulses = self.impulses(problem, z);
        project(problem, &mut impulses);
        let nothing = prepared.velocity_errors(problem, &Impulses::zero(problem));
        let contacts =
            prepared.contacts.iter().zip(&impulses.contacts).map(|(c, g)| g.normal / c.normal_mass);
        let rows =
            prepared.rows.iter().zip(&impulses.rows).map(|(r, l)| (l * r.inverse_effective_mass).abs());
        let largest =
            contacts.chain(rows).chain(nothing.iter().map(|u| u.abs())).fold(f64::MIN_POSITIVE, f64::max);
        residual_of(problem, prepared, &impulses).absolute / largest
    }
}
