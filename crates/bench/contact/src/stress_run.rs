//! `carom-contact stress`: random impulses and friction on every base problem; the solved share per family, and what
//! was not solved with its best errors and its strict-feasibility value.

use crate::clock::thread_seconds;
use crate::families::small;
use crate::options::Options;
use crate::solvers;
use carom::solver::{FrictionProblem, FrictionSettings};
use carom_scenes::contact_problems::{read_flat, stress::AMPLITUDES, stress::FRICTION_FACTORS, stressed};
use carom_scenes::results::save;
use std::collections::BTreeMap;
use std::path::Path;

const COLUMNS: &str = "family,problem,contacts,amplitude,friction_factor,seed,solver,solved,err_nat,err_scaled,\
                       factorisations,seconds,strict_feasibility";

/// Family, name and problem of each file of a folder: the family is the name up to the first digit.
fn from_folder(folder: &Path) -> Result<Vec<(String, String, FrictionProblem)>, String> {
    let told = |e: std::io::Error| format!("{}: {e}", folder.display());
    let mut paths: Vec<_> =
        std::fs::read_dir(folder).map_err(told)?.filter_map(|e| Some(e.ok()?.path())).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "bin"));
    paths.sort();
    let mut all = Vec::new();
    for path in paths {
        let bytes = std::fs::read(&path).map_err(told)?;
        let problem = read_flat(&mut bytes.as_slice()).map_err(|e| format!("{}: {e}", path.display()))?;
        let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let family = name.split(|c: char| c.is_ascii_digit() || c == '-').next().unwrap_or(&name);
        // a complementarity problem has no friction to change
        if problem.dimension > 1 {
            all.push((family.trim_end_matches(['_', 's']).to_string(), name.clone(), problem));
        }
    }
    Ok(all)
}

/// Solved and all, per family.
type Counts = BTreeMap<String, [usize; 2]>;

/// Prints the solved share per family and saves `stress.csv`.
///
/// # Errors
/// What the file system says.
pub fn run(options: &Options) -> Result<(), String> {
    let mut bases = match &options.folder {
        Some(folder) => from_folder(folder)?,
        None => Vec::new(),
    };
    for made in small(options.seed).map_err(|e| e.to_string())? {
        bases.push((made.family.to_string(), made.name, made.matrix));
    }
    bases.retain(|b| b.2.contacts() <= options.largest);
    let mut lines = Vec::new();
    let named: Vec<String> =
        if options.solvers.is_empty() { vec!["exact".into()] } else { options.solvers.clone() };
    for name in &named {
        let mut counts = Counts::new();
        for (family, base, problem) in &bases {
            for (k, (amplitude, factor)) in cases().enumerate() {
                for turn in 0..options.seeds {
                    let seed = 1000 * (options.seed + turn) + k as u64;
                    let harder = stressed(problem, amplitude, factor, seed);
                    let (solved, line) = one(name, &harder, options)?;
                    let count = counts.entry(family.clone()).or_default();
                    *count = [count[0] + usize::from(solved), count[1] + 1];
                    if !solved {
                        println!("not solved: {base} a {amplitude} mu x {factor} seed {seed}: {line}");
                    }
                    lines.push(format!(
                        "{family},{base},{},{amplitude},{factor},{seed},{name},{line}",
                        problem.contacts()
                    ));
                }
            }
        }
        tell(name, &counts);
    }
    save(options.out.as_deref(), "stress.csv", COLUMNS, &lines)
}

fn cases() -> impl Iterator<Item = (f64, f64)> {
    AMPLITUDES.into_iter().flat_map(|a| FRICTION_FACTORS.into_iter().map(move |f| (a, f)))
}

fn one(name: &str, problem: &FrictionProblem, options: &Options) -> Result<(bool, String), String> {
    let mut solver = solvers::make(name).ok_or_else(|| format!("no solver {name:?}"))?;
    let settings = FrictionSettings { tolerance: options.tolerance, ..FrictionSettings::default() };
    let mut impulses = vec![0.0; problem.velocity.len()];
    let start = thread_seconds();
    let mut watch = |_: &carom::solver::Progress| thread_seconds() - start < options.limit;
    let outcome = solver.solve(problem, &settings, &mut impulses, &mut watch);
    let seconds = thread_seconds() - start;
    let m = &outcome.measure;
    let feasible = outcome.strict_feasibility.map_or(String::new(), |t| format!("{t:.3e}"));
    let line = format!(
        "{},{:.3e},{:.3e},{},{seconds:.4e},{feasible}",
        outcome.solved, m.natural, m.scaled, outcome.factorisations
    );
    Ok((outcome.solved, line))
}

fn tell(name: &str, counts: &Counts) {
    let mut total = [0, 0];
    for (family, [solved, all]) in counts {
        println!(
            "{name}: {family:<34} {solved:>5} of {all:>5}  {:6.2} %",
            100.0 * *solved as f64 / *all as f64
        );
        total = [total[0] + solved, total[1] + all];
    }
    let share = 100.0 * total[0] as f64 / total[1].max(1) as f64;
    println!("{name}: {:<34} {:>5} of {:>5}  {share:6.2} %", "all", total[0], total[1]);
}
