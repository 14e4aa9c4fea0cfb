//! `carom-contact scaling`: cost against size on walls and lattices of 1e2 to 1e5 contacts. First-order methods: CPU
//! time of one iteration, on the bodies and on the assembled W. `exact`: CPU time to the tolerance. With `--piles`,
//! piles of so many bodies in place of these: `pgs`, `nncg` and `exact` to the tolerance, or to the limit.
//! `carom-contact hard`: `exact` on the problems of 5,000 contacts that cost it most.

use crate::clock::thread_seconds;
use crate::options::Options;
use crate::piles::settled;
use crate::solvers;
use carom::solver::{FrictionProblem, FrictionSettings, Impulses, SolveSettings, SolverKind};
use carom::{ContactProblem, ShapeError, Spatial};
use carom_scenes::contact_problems::{Variation, brick_wall, matrix_form, sphere_lattice};
use carom_scenes::results::save;

const COLUMNS: &str = "family,contacts,bodies,solver,form,what,seconds,microseconds_per_contact,solved,err_nat,\
                       err_scaled,factorisations,peak_memory_mb";
/// Rows of walls: 100 to 1e5 contacts, 4,804 among them.
const WALLS: [usize; 8] = [4, 7, 12, 20, 25, 36, 63, 112];
/// Balls along an edge of a lattice: 63 to 96,256 contacts, 4,896 among them.
const EDGES: [usize; 8] = [3, 5, 7, 10, 12, 15, 22, 32];
/// Methods whose cost is told per iteration.
const FIRST_ORDER: [&str; 3] = ["pgs", "nncg", "apgd"];

/// Rows of the walls that are sheared: 1,060 and 4,804 contacts.
const SHEARED: [usize; 2] = [12, 25];
/// Balls along an edge of the lattices that are pushed: 1,408 and 4,896 contacts.
const PUSHED: [usize; 2] = [8, 12];

/// Solvers that are let run to the tolerance on piles.
const PATIENT: [&str; 3] = ["pgs", "nncg", "exact"];

struct Lines {
    all: Vec<String>,
}

/// One measured cost.
struct Cost<'a> {
    solver: &'a str,
    form: &'a str,
    what: &'a str,
    seconds: f64,
    /// solved, err_nat, err_scaled, factorisations
    reached: String,
}

impl Lines {
    fn push(&mut self, family: &str, problem: &ContactProblem<Spatial>, cost: &Cost) {
        let (contacts, bodies) = (problem.contacts.len(), problem.inverse_masses.len() - 1);
        let each = 1e6 * cost.seconds / contacts as f64;
        println!(
            "{family:<8} {contacts:>7} {:<6} {:<7} {:<14} {:>12.4} ms {each:>10.3} us per contact  {}",
            cost.solver,
            cost.form,
            cost.what,
            1e3 * cost.seconds,
            cost.reached
        );
        self.all.push(format!(
            "{family},{contacts},{bodies},{},{},{},{:.4e},{each:.4},{},{:.0}",
            cost.solver,
            cost.form,
            cost.what,
            cost.seconds,
            if cost.reached.is_empty() { ",,," } else { &cost.reached },
            peak_memory()
        ));
    }
}

/// Most memory that this process has held \[MB\]; 0 where the system does not tell.
fn peak_memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) / 1024.0
}

/// Seconds of one iteration: the least of three differences between a long and a short run, longer for small problems.
fn per_iteration(contacts: usize, mut run: impl FnMut(usize) -> f64) -> f64 {
    let short = 5;
    let long = short + (200_000 / contacts.max(1)).clamp(20, 2000);
    let differences = (0..3).map(|_| (run(long) - run(short)) / (long - short) as f64);
    differences.fold(f64::INFINITY, f64::min).max(0.0)
}

fn bodies_iteration(kind: SolverKind, problem: &ContactProblem<Spatial>) -> f64 {
    let mut solver = kind.make::<Spatial>();
    per_iteration(problem.contacts.len(), |iterations| {
        let mut impulses = Impulses::zero(problem);
        let start = thread_seconds();
        solver.solve(
            problem,
            &SolveSettings { iterations, tolerance: 0.0, ..SolveSettings::default() },
            &mut impulses,
        );
        thread_seconds() - start
    })
}

fn matrix_iteration(name: &str, problem: &FrictionProblem) -> f64 {
    let mut solver = solvers::make(name).expect("a name of the list");
    per_iteration(problem.contacts(), |iterations| {
        let mut impulses = vec![0.0; problem.velocity.len()];
        let settings = FrictionSettings { iterations, tolerance: 0.0, ..FrictionSettings::default() };
        let start = thread_seconds();
        solver.solve(problem, &settings, &mut impulses, &mut carom::solver::unwatched);
        thread_seconds() - start
    })
}

fn exact_on_matrix(problem: &FrictionProblem, options: &Options) -> (f64, String, bool) {
    let mut solver = solvers::make("exact").expect("a name of the list");
    let settings = FrictionSettings { tolerance: options.tolerance, ..FrictionSettings::default() };
    let mut impulses = vec![0.0; problem.velocity.len()];
    let start = thread_seconds();
    let mut watch = |_: &carom::solver::Progress| thread_seconds() - start < options.limit;
    let o = solver.solve(problem, &settings, &mut impulses, &mut watch);
    let seconds = thread_seconds() - start;
    let told =
        format!("{},{:.1e},{:.1e},{}", o.solved, o.measure.natural, o.measure.scaled, o.factorisations);
    (seconds, told, seconds < options.limit)
}

/// |q| over the root of the number of contacts \[m/s\]: the judge takes the errors of all contacts together, next to |q|,
/// where the solver takes the largest of one.
fn usual_velocity(problem: &FrictionProblem) -> f64 {
    let squared: f64 = problem.velocity.iter().map(|q| q * q).sum();
    (squared / problem.contacts().max(1) as f64).sqrt()
}

/// CPU time to the tolerance on the bodies, what was reached, and whether that took less than the limit.
fn on_bodies(
    kind: SolverKind,
    problem: &ContactProblem<Spatial>,
    matrix: &FrictionProblem,
    options: &Options,
) -> (f64, String, bool) {
    let mut solver = kind.make::<Spatial>();
    let mut impulses = Impulses::zero(problem);
    let tolerance = options.tolerance * usual_velocity(matrix);
    let settings = SolveSettings { iterations: usize::MAX, tolerance, ..SolveSettings::default() };
    let start = thread_seconds();
    let mut watch = |_: &carom::solver::Progress| thread_seconds() - start < options.limit;
    let outcome = solver.solve_watched(problem, &settings, &mut impulses, &mut watch);
    let seconds = thread_seconds() - start;
    let m = carom::solver::measure(matrix, &impulses.flat());
    let solved = m.solves(options.tolerance);
    let told = format!("{solved},{:.1e},{:.1e},{}", m.natural, m.scaled, outcome.iterations);
    (seconds, told, seconds < options.limit)
}

/// Which forms of `exact` still come within the limit.
struct StillFast {
    matrix: bool,
    bodies: bool,
}

fn all_of(
    family: &str,
    problem: &ContactProblem<Spatial>,
    options: &Options,
    still: &mut StillFast,
    lines: &mut Lines,
) {
    let matrix = matrix_form(problem);
    for kind in SolverKind::ALL.into_iter().filter(|k| FIRST_ORDER.contains(&k.name())) {
        if options.wants(kind.name()) {
            let seconds = bodies_iteration(kind, problem);
            let cost = Cost {
                solver: kind.name(),
                form: "bodies",
                what: "per iteration",
                seconds,
                reached: String::new(),
            };
            lines.push(family, problem, &cost);
        }
    }
    for name in solvers::names(3).into_iter().filter(|n| FIRST_ORDER.contains(n) && options.wants(n)) {
        let seconds = matrix_iteration(name, &matrix);
        let cost =
            Cost { solver: name, form: "matrix", what: "per iteration", seconds, reached: String::new() };
        lines.push(family, problem, &cost);
    }
    if !options.wants("exact") {
        return;
    }
    let what = format!("to {:e}", options.tolerance);
    if still.matrix {
        let (seconds, reached, within) = exact_on_matrix(&matrix, options);
        lines.push(family, problem, &Cost { solver: "exact", form: "matrix", what: &what, seconds, reached });
        still.matrix = within;
    }
    if still.bodies {
        let (seconds, reached, within) = on_bodies(SolverKind::Exact, problem, &matrix, options);
        lines.push(family, problem, &Cost { solver: "exact", form: "bodies", what: &what, seconds, reached });
        still.bodies = within;
    }
}

/// Piles that carom has poured, by sweeps alone and by `exact`.
fn piles(options: &Options) -> Result<(), String> {
    let mut lines = Lines { all: Vec::new() };
    let what = format!("to {:e}", options.tolerance);
    for &bodies in &options.piles {
        let problem = settled(bodies)?;
        let matrix = matrix_form(&problem);
        for kind in
            SolverKind::ALL.into_iter().filter(|k| PATIENT.contains(&k.name()) && options.wants(k.name()))
        {
            let (seconds, reached, _) = on_bodies(kind, &problem, &matrix, options);
            let cost = Cost { solver: kind.name(), form: "bodies", what: &what, seconds, reached };
            lines.push("pile", &problem, &cost);
            save(options.out.as_deref(), "piles.csv", COLUMNS, &lines.all)?;
        }
    }
    Ok(())
}

/// Prints and saves `hard.csv`: lattices of balls pushed at random and sheared walls, on the bodies, by every seed; to the
/// tolerance, or to the limit.
///
/// # Errors
/// What the file system says.
pub fn hard(options: &Options) -> Result<(), String> {
    let mut lines = Lines { all: Vec::new() };
    let what = format!("to {:e}", options.tolerance);
    for seed in options.seed..options.seed + options.seeds {
        let pushed = PUSHED.iter().map(|&n| ("pushed", sphere_lattice(n, &Variation::perturbed(seed))));
        let sheared = SHEARED.iter().map(|&n| ("sheared", brick_wall(n, n, &Variation::sheared(seed))));
        for (family, problem) in pushed.chain(sheared) {
            let problem = problem.map_err(|e| e.to_string())?;
            if problem.contacts.len() > options.largest {
                continue;
            }
            let (seconds, reached, _) =
                on_bodies(SolverKind::Exact, &problem, &matrix_form(&problem), options);
            let cost = Cost { solver: "exact", form: "bodies", what: &what, seconds, reached };
            lines.push(family, &problem, &cost);
            save(options.out.as_deref(), "hard.csv", COLUMNS, &lines.all)?;
        }
    }
    Ok(())
}

/// Prints and saves `scaling.csv`, for piles `piles.csv`. A form of `exact` that takes longer than the limit is left out
/// of larger problems.
///
/// # Errors
/// What the file system says.
pub fn run(options: &Options) -> Result<(), String> {
    if !options.piles.is_empty() {
        return piles(options);
    }
    type Make = fn(usize, &Variation) -> Result<ContactProblem<Spatial>, ShapeError>;
    let families: [(&str, Make, &[usize]); 2] =
        [("wall", |n, v| brick_wall(n, n, v), &WALLS), ("lattice", |n, v| sphere_lattice(n, v), &EDGES)];
    let variation = Variation::perturbed(options.seed);
    let mut lines = Lines { all: Vec::new() };
    for (family, make, sizes) in families {
        let mut still = StillFast { matrix: true, bodies: true };
        for &size in sizes {
            let problem = make(size, &variation).map_err(|e| e.to_string())?;
            if problem.contacts.len() <= options.largest {
                all_of(family, &problem, options, &mut still, &mut lines);
                // large problems take minutes: what is measured is kept whatever happens then
                save(options.out.as_deref(), "scaling.csv", COLUMNS, &lines.all)?;
            }
        }
    }
    Ok(())
}
