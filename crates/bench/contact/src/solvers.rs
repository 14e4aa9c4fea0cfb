//! carom's solvers of friction problems in matrix form, by name. A new one is one line.

use crate::cone_programs::ConePrograms;
use carom::solver::FrictionSolver;
use carom::solver::exact::Exact;

type Make = fn() -> Box<dyn FrictionSolver>;

/// Name, rows per contact it takes, and how to make it.
const SOLVERS: [(&str, &[usize], Make); 1] = [("exact", &[1, 2, 3], || Box::new(Exact))];
/// What is carried for comparison, not for use: clarabel in a fixed-point loop.
const COMPARED: (&str, Make) = ("clarabel", || Box::new(ConePrograms));

/// Names of the solvers that take problems of so many rows per contact.
pub fn names(rows_per_contact: usize) -> Vec<&'static str> {
    SOLVERS.iter().filter(|s| s.1.contains(&rows_per_contact)).map(|s| s.0).collect()
}

/// The same with what is carried for comparison alone.
pub fn names_and_compared(rows_per_contact: usize) -> Vec<&'static str> {
    let mut all = names(rows_per_contact);
    all.push(COMPARED.0);
    all
}

/// A fresh solver, or `None` for a name that is not known.
pub fn make(name: &str) -> Option<Box<dyn FrictionSolver>> {
    let ours = SOLVERS.iter().map(|s| (s.0, s.2)).chain([COMPARED]);
    ours.into_iter().find(|s| s.0 == name).map(|s| s.1())
}
