//! carom's solvers of friction problems in matrix form, by name. A new one is one line.

use carom::solver::FrictionSolver;
use carom::solver::exact::Exact;

type Make = fn() -> Box<dyn FrictionSolver>;

/// Name, rows per contact it takes, and how to make it.
const SOLVERS: [(&str, &[usize], Make); 1] = [("exact", &[1, 2, 3], || Box::new(Exact))];

/// Names of the solvers that take problems of so many rows per contact.
pub fn names(rows_per_contact: usize) -> Vec<&'static str> {
    SOLVERS.iter().filter(|s| s.1.contains(&rows_per_contact)).map(|s| s.0).collect()
}

/// A fresh solver, or `None` for a name that is not known.
pub fn make(name: &str) -> Option<Box<dyn FrictionSolver>> {
    SOLVERS.iter().find(|s| s.0 == name).map(|s| s.2())
}
