//! carom's solvers of friction problems in matrix form, by name. A new one is one line.

use crate::cone_programs::ConePrograms;
use carom::solver::exact::Exact;
use carom::solver::{FrictionSolver, FrictionSolverKind};

type Make = fn() -> Box<dyn FrictionSolver>;

/// Name, rows per contact it takes, and how to make it.
const SOLVERS: [(&str, &[usize], Make); 5] = [
    ("exact", &[1, 2, 3], || Box::<Exact>::default()),
    ("pgs", &[1, 2, 3], || FrictionSolverKind::Pgs.make()),
    ("nncg", &[1, 2, 3], || FrictionSolverKind::Nncg.make()),
    ("apgd", &[1, 2, 3], || FrictionSolverKind::Apgd.make()),
    ("lemke", &[1], || FrictionSolverKind::Lemke.make()),
];
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
