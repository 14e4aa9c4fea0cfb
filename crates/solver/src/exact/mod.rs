//! The exact solver: Coulomb friction to the asked tolerance, one setting for every problem (theory chapter 7):
//! A sweeps with the exact local solution, and Newton from where they end; B interior point on the nonassociated law;
//! C a Newton finisher inside B; D proximal Newton; E one curve followed through its folds; F many sweeps;
//! G a ladder of other starts. On the bodies of heaps F and E come before B. The best iterate of all stages is returned with its
//! errors. Contacts on bodies without friction alone are pivoted before all stages (`frictionless.rs`).

// components are read by their index as in the equations; a negated comparison lets NaN through, as it should
#![allow(clippy::needless_range_loop, clippy::neg_cmp_op_on_partial_ord)]

mod analyses;
mod at_once;
pub(crate) mod blocks;
mod bodies;
mod by_parts;
pub(crate) mod cone;
mod contacts;
pub(crate) mod couplings;
mod equalities;
mod face;
mod feasibility;
mod four_unknowns;
mod frictionless;
mod group_rows;
mod groups;
mod interior_point;
pub(crate) mod judge;
mod krylov;
pub(crate) mod lane;
pub(crate) mod local;
mod local_lanes;
mod mass_roots;
mod matrix_form;
mod memory;
mod minimum_norm;
mod minimum_norm_mixed;
mod mixed;
mod newton;
mod normals;
mod onward;
pub(crate) mod operator;
mod order;
mod packs;
pub(crate) mod parts;
mod path;
mod patient;
mod pivoted;
mod principal_pivots;
mod proximal;
mod root;
pub(crate) mod row;
mod scaled;
mod single;
mod skeleton;
mod small_complementarity;
mod stage;
mod step;
pub(crate) mod sweeps;
mod system;
mod warm;
mod way;
mod whole_face;

use crate::friction_problem::FrictionProblem;
use crate::friction_solver::{Stage, StageList};
use crate::impulse_solver::{Content, ImpulseChoice};
use crate::watch::{Progress, Watch, unwatched};
use analyses::Analyses;
use blocks::Blocks;
pub use contacts::ExactContacts;
use interior_point::{CENTRED, STEPS, Start, interior_point};
use judge::Errors;
pub use matrix_form::Exact;
use memory::Memory;
use path::follow;
use patient::{is_cheap, patient};
use proximal::{error_at, proximal};
use stage::{Solve, StageEnd};
use sweeps::Ended;

/// Weight of the first proximal step.
const WEIGHT: f64 = 0.1;
/// Most factorisations of one proximal stage.
const PROXIMAL: usize = 400;
/// The cold start, then the other starts of the ladder.
const STARTS: [Start; 5] = [
    CENTRED,
    Start { size: 1.0, smoothing: 10.0, centrality: 0.1 },
    Start { size: 0.1, smoothing: 1.0, centrality: 0.1 },
    Start { size: 10.0, smoothing: 0.0, centrality: 1e-3 },
    Start { size: 0.1, smoothing: 10.0, centrality: 1e-3 },
];

/// Stages that mostly follow the sweeps: room for them is asked for at once.
const FOLLOWING: usize = 3;
/// Factorisations after which strict feasibility adds little to the cost.
const WORTH_ASKING: usize = 100;

/// When to be content, and how long to try.
#[derive(Clone, Copy)]
struct Goal {
    tolerance: f64,
    sweeps: usize,
    /// Most sweeps of a stage of many, where these are not cheap beside factorisations.
    patience: usize,
    factorisations: usize,
    impulses: ImpulseChoice,
    /// What will do after how many factorisations.
    content: Option<Content>,
    /// Solutions are taken well below the tolerance.
    polish: bool,
    /// Newton from the sweeps before the interior point. Its answers lie on the edges of the cones where others are
    /// as good, and are worse starts for the next step than the interior point's.
    early: bool,
}

impl Goal {
    /// Sweeps depend on the order of contacts; the least impulses must not.
    fn most_sweeps(&self, is_warm: bool) -> usize {
        match is_warm {
            _ if self.is_least() => 0,
            true => self.sweeps.min(warm::SWEEPS),
            false => self.sweeps,
        }
    }
    fn is_least(&self) -> bool {
        self.impulses == ImpulseChoice::MinimumNorm
    }
}

/// What the stages came to.
struct Answer {
    errors: Errors,
    end: StageEnd,
    stages: StageList,
    factorisations: usize,
    /// True where the least impulses were asked for and not found.
    not_least: bool,
    /// True where the velocities that the impulses lead to came with them.
    has_velocities: bool,
}

impl Answer {
    /// Solved by doing nothing.
    fn nothing() -> Self {
        Answer {
            errors: Errors::default(),
            end: StageEnd::Solved,
            stages: StageList::new(),
            factorisations: 0,
            not_least: false,
            has_velocities: false,
        }
    }
    fn iterations(&self) -> usize {
        self.stages.iter().map(|s| s.iterations).sum()
    }
    fn solved(&self) -> bool {
        self.end == StageEnd::Solved
    }
    fn interrupted(&self) -> bool {
        self.end == StageEnd::Interrupted
    }
    fn out_of_budget(&self) -> bool {
        self.end == StageEnd::OutOfBudget
    }
    /// True where the strict feasibility of what is not solved is worth its factorisations: not after a short budget.
    fn is_worth_asking(&self) -> bool {
        !self.interrupted() && (!self.out_of_budget() || self.factorisations >= WORTH_ASKING)
    }
}

/// The largest t, at most the largest entry of q, with u_N >= mu |u_T| + t at every contact for some r, u = W r + q
/// \[m/s\], as far as an interior point finds it: above 0 a solution exists, at or below 0 none need exist. `None`
/// where no number is found.
pub fn strict_feasibility(problem: &FrictionProblem) -> Option<f64> {
    match problem.dimension {
        1 => feasibility_in::<1>(problem),
        2 => feasibility_in::<2>(problem),
        _ => feasibility_in::<3>(problem),
    }
}

fn feasibility_in<const D: usize>(problem: &FrictionProblem) -> Option<f64> {
    feasibility_of(&Blocks::<D>::of(problem), &mut Analyses::default())
}

/// The same of blocks; its factorisations are beside all budgets.
fn feasibility_of<const D: usize>(blocks: &Blocks<D>, analyses: &mut Analyses) -> Option<f64> {
    let mut watch = unwatched;
    let mut memory = Memory::default();
    let mut solve = Solve::of(blocks, (0.0, usize::MAX), (analyses, &mut memory), &mut watch);
    feasibility::strict_feasibility(&mut solve)
}

/// The pipeline: impulses in r, and where the sweeps end it their velocities in u.
fn solve_blocks<const D: usize>(
    blocks: &Blocks<D>,
    goal: &Goal,
    (r, u): (&mut [[f64; D]], &mut [[f64; D]]),
    (analyses, memory): (&mut Analyses, &mut Memory<D>),
    watch: &mut Watch,
) -> Answer {
    if goal.is_least() {
        r.fill([0.0; D]);
    }
    let given = is_given(r).then(|| memory.pool.copy(r));
    memory.sweeps.begin(blocks, r);
    let limits = (goal.tolerance, goal.most_sweeps(given.is_some()));
    let (count, errors, ended) = sweeps::sweeps(blocks.all(), limits, (r, u), &mut memory.sweeps, watch);
    let mut answer = Answer {
        errors,
        end: if ended == Ended::Interrupted { StageEnd::Interrupted } else { StageEnd::Solved },
        stages: memory.stages_after(count),
        factorisations: 0,
        not_least: goal.is_least(),
        has_velocities: ended == Ended::Solved,
    };
    if ended == Ended::LeftOff {
        factorised(blocks, goal, (r, given.as_deref()), &mut answer, (analyses, memory), watch);
    }
    memory.pool.give(given);
    answer
}

/// True for a start that says something.
fn is_given<const D: usize>(r: &[[f64; D]]) -> bool {
    r.iter().any(|r| *r != [0.0; D])
}

/// What the sweeps leave off, where a factorisation is allowed.
fn factorised<const D: usize>(
    blocks: &Blocks<D>,
    goal: &Goal,
    (r, given): (&mut [[f64; D]], Option<&[[f64; D]]>),
    answer: &mut Answer,
    (analyses, memory): (&mut Analyses, &mut Memory<D>),
    watch: &mut Watch,
) {
    if goal.factorisations == 0 {
        answer.end = StageEnd::OutOfBudget;
        return;
    }
    let limits = (goal.tolerance, goal.factorisations);
    let mut watched = |p: &Progress| watch(p);
    let mut solve = Solve::of(blocks, limits, (analyses, memory), &mut watched);
    (solve.content, solve.polish) = (goal.content, goal.polish);
    second_order(&mut solve, goal, (r, given), answer);
    solve.leave(memory);
}

/// The stages that factorise, from what the sweeps left in r.
fn second_order<const D: usize>(
    solve: &mut Solve<'_, D>,
    goal: &Goal,
    (r, given): (&mut [[f64; D]], Option<&[[f64; D]]>),
    answer: &mut Answer,
) {
    answer.stages.reserve(FOLLOWING);
    solve.scaled.in_cone_units(r, &mut solve.best);
    solve.best_errors = answer.errors;
    answer.end = match given {
        Some(given) => warm::restart(solve, given, &mut answer.stages),
        None if goal.is_least() || !goal.early => StageEnd::Stuck,
        None => {
            let left = solve.pool.copy(&solve.best);
            let end = newton::descend(solve, &left);
            solve.pool.give([left]);
            answer.stages.push(Stage { name: "newton", iterations: solve.system.factorisations });
            end
        }
    };
    if answer.end == StageEnd::Stuck {
        let mut x = solve.vector();
        answer.end = climb(solve, goal, &mut x, &mut answer.stages);
        solve.pool.give([x]);
        if answer.solved() && goal.polish {
            let before = solve.system.factorisations;
            newton::better(solve);
            answer.stages.push(Stage { name: "newton", iterations: solve.system.factorisations - before });
        }
    }
    let least = if goal.is_least() && answer.solved() { minimum_norm::least(solve) } else { None };
    answer.errors = solve.best_errors;
    answer.factorisations = solve.system.factorisations;
    solve.scaled.to_impulses(&solve.best, r);
    if let Some(least) = least {
        r.copy_from_slice(&least);
        answer.not_least = false;
    }
}

/// A stage of the ladder.
#[derive(Clone, Copy)]
enum Rung {
    /// Interior point from a start, leaving its own best iterate.
    Interior(Start),
    /// At most so many steps of it, for another start of sweeps, where a bout of them is worth no more factorisations than this.
    Glance(usize, [f64; 2]),
    /// Proximal Newton from the iterate that the stage before left, with at most so many factorisations.
    Proximal(usize),
    /// The same, if the best errors so far are small: from afar it solves one problem in six, the path nearly all.
    Near(usize),
    /// Many sweeps from there, where a bout of them is worth no more factorisations than this; not where the order of
    /// contacts must not count.
    Sweeps(Sweeping, [f64; 2]),
    /// The path with a smoothing and at most so many factorisations, leaving its own best iterate.
    Path(f64, usize),
}

/// How long many sweeps go on, in factorisations.
#[derive(Clone, Copy)]
struct Sweeping {
    worth: usize,
    /// How long they may lead nowhere.
    patience: f64,
}

/// Bouts of sweeps, in factorisations, that come before the interior point on bodies, and never on a matrix; that come before the
/// path on bodies, and on a matrix; and those whose price does not count.
const FIRST: [f64; 2] = [30.0, 0.0];
const EARLY: [f64; 2] = [100.0, 30.0];
const ANY: [f64; 2] = [f64::INFINITY; 2];

/// What comes before all else where a bout of sweeps is cheap beside factorisations, as on the bodies of heaps. Sweeps that lead
/// nowhere have often come to a place that none leads away from: from another start they do, and often from where the path has come,
/// however far it has: there contacts may have the states of the solution before errors are small.
const HEAPS: [Rung; 9] = [
    Rung::Sweeps(Sweeping { worth: 400, patience: 10.0 }, ANY),
    Rung::Near(20),
    Rung::Glance(8, ANY),
    Rung::Sweeps(Sweeping { worth: 400, patience: 10.0 }, ANY),
    Rung::Near(20),
    Rung::Path(SHARP, 200),
    Rung::Near(60),
    Rung::Sweeps(Sweeping { worth: 1000, patience: f64::INFINITY }, ANY),
    Rung::Near(60),
];

/// The smoothing of the path that is followed first.
const SHARP: f64 = 0.01;

/// Cheap stages first; the later ones are for what the earlier ones do not solve.
const LADDER: [Rung; 19] = [
    Rung::Interior(STARTS[0]),
    Rung::Sweeps(Sweeping { worth: 1000, patience: f64::INFINITY }, EARLY),
    Rung::Glance(20, EARLY),
    Rung::Sweeps(Sweeping { worth: 1000, patience: f64::INFINITY }, EARLY),
    Rung::Near(60),
    Rung::Path(SHARP, 200),
    Rung::Proximal(60),
    Rung::Sweeps(Sweeping { worth: 2000, patience: f64::INFINITY }, ANY),
    Rung::Near(60),
    Rung::Path(1.0, 400),
    Rung::Proximal(PROXIMAL),
    Rung::Interior(STARTS[1]),
    Rung::Proximal(PROXIMAL),
    Rung::Interior(STARTS[2]),
    Rung::Proximal(PROXIMAL),
    Rung::Interior(STARTS[3]),
    Rung::Proximal(PROXIMAL),
    Rung::Interior(STARTS[4]),
    Rung::Proximal(PROXIMAL),
];

/// Errors below which a solution is near.
const NEAR: f64 = 1e-3;
/// Errors below which proximal steps may be as long, and the weight of the first: a start from afar needs more.
const NEARER: f64 = 1e-5;
const WEIGHT_NEARER: f64 = 1e-3;

/// One stage after another until one solves the problem.
fn climb<const D: usize>(
    solve: &mut Solve<'_, D>,
    goal: &Goal,
    x: &mut Vec<[f64; D]>,
    stages: &mut StageList,
) -> StageEnd {
    let mut tried = f64::INFINITY;
    x.clone_from(&solve.best);
    // of the form that the system begins with: one that it falls back to is dearer
    let is_heap = is_cheap(solve, FIRST);
    let most = if is_heap { usize::MAX } else { goal.patience };
    let first: &[Rung] = if is_heap && !goal.is_least() { &HEAPS } else { &[] };
    for (place, &rung) in first.iter().chain(&LADDER).enumerate() {
        let skipped = match rung {
            // from its one start it leads to the same place again
            Rung::Path(SHARP, _) => place >= first.len() && !first.is_empty(),
            Rung::Near(_) => !(solve.best_errors.worst() < NEAR.min(tried)),
            Rung::Glance(_, most) | Rung::Sweeps(_, most) => goal.is_least() || !is_cheap(solve, most),
            _ => false,
        };
        if skipped {
            continue;
        }
        let (before, mut swept) = (solve.system.factorisations, 0);
        let (name, end) = match rung {
            Rung::Interior(start) => ("interior point", interior_point(solve, start, STEPS, x)),
            Rung::Glance(most, _) => ("interior point", interior_point(solve, STARTS[0], most, x)),
            Rung::Proximal(most) => ("proximal newton", proximal(solve, x, WEIGHT, most)),
            Rung::Near(most) => {
                tried = solve.best_errors.worst();
                let weight = if error_at(solve, x) < NEARER { WEIGHT_NEARER } else { WEIGHT };
                ("proximal newton", proximal(solve, x, weight, most))
            }
            Rung::Sweeps(Sweeping { worth, patience }, _) => {
                let (end, sweeps) = patient(solve, (worth, most, patience), x);
                swept = sweeps;
                ("many sweeps", end)
            }
            Rung::Path(smoothing, most) => ("path", follow(solve, (smoothing, most), x)),
        };
        stages.push(Stage { name, iterations: solve.system.factorisations - before + swept });
        if end != StageEnd::Stuck {
            return end;
        }
    }
    StageEnd::Stuck
}
