//! `carom-contact structures`: every solver on what is hard for sweeps: stacks with mass ratios, arches, card houses,
//! tables on many legs. Residual reached, iterations and time.

use crate::families::structures;
use crate::options::Options;
use crate::solvers;
use crate::timing::{Rules, iterations, time};
use carom::solver::FrictionSettings;
use carom_scenes::results::save;

const COLUMNS: &str =
    "problem,family,contacts,solver,solved,err_nat,err_scaled,cone,iterations,factorisations,seconds";

/// Prints and saves `solvers.csv`.
///
/// # Errors
/// What the file system says.
pub fn run(options: &Options) -> Result<(), String> {
    let settings = FrictionSettings { tolerance: options.tolerance, ..FrictionSettings::default() };
    let rules = Rules { limit: options.limit, ..Rules::default() };
    println!(
        "{:<28} {:>8} {:<9} {:>7} {:>9} {:>9} {:>8} {:>7} {:>10}",
        "problem", "contacts", "solver", "solved", "err_nat", "err_scal", "iter.", "fact.", "ms"
    );
    let mut lines = Vec::new();
    for made in structures().map_err(|e| e.to_string())? {
        let problem = &made.matrix;
        for name in solvers::names_and_compared(problem.dimension).into_iter().filter(|n| options.wants(n)) {
            let mut solver = solvers::make(name).expect("a name of the list");
            let timed = time(solver.as_mut(), problem, &settings, &rules);
            let (o, m) = (&timed.outcome, &timed.outcome.measure);
            println!(
                "{:<28} {:>8} {name:<9} {:>7} {:>9.1e} {:>9.1e} {:>8} {:>7} {:>10.3}",
                made.name,
                problem.contacts(),
                if o.solved { "yes" } else { "no" },
                m.natural,
                m.scaled,
                iterations(o),
                o.factorisations,
                1e3 * timed.seconds
            );
            lines.push(format!(
                "{},{},{},{name},{},{:.3e},{:.3e},{:.1e},{},{},{:.4e}",
                made.name,
                made.family,
                problem.contacts(),
                o.solved,
                m.natural,
                m.scaled,
                m.cone,
                iterations(o),
                o.factorisations,
                timed.seconds
            ));
        }
    }
    save(options.out.as_deref(), "solvers.csv", COLUMNS, &lines)
}
