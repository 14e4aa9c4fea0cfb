//! The solvers of problems in matrix form, by name.

use crate::exact::Exact;
use crate::friction_solver::FrictionSolver;
use crate::methods::on_matrix::OnMatrix;
use crate::methods::{apgd::Apgd, enumeration::Enumeration, lemke::Lemke, nncg::Nncg, pgs::Sweeps};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// The solvers of problems in matrix form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrictionSolverKind {
    /// Projected Gauss-Seidel sweeps.
    #[default]
    Pgs,
    /// Conjugate gradients over the same sweeps.
    Nncg,
    /// Accelerated projected gradients: products with W only.
    Apgd,
    /// Lemke's pivoting: problems without friction.
    Lemke,
    /// Every combination of contact modes: an oracle for a handful of contacts.
    Enumeration,
    /// Interior point and Newton on the nonassociated law: true Coulomb friction to any tolerance.
    Exact,
}

impl FrictionSolverKind {
    /// All solvers.
    pub const ALL: [FrictionSolverKind; 6] = [
        FrictionSolverKind::Pgs,
        FrictionSolverKind::Nncg,
        FrictionSolverKind::Apgd,
        FrictionSolverKind::Lemke,
        FrictionSolverKind::Enumeration,
        FrictionSolverKind::Exact,
    ];
    /// The name as users write it.
    pub fn name(self) -> &'static str {
        match self {
            FrictionSolverKind::Pgs => "pgs",
            FrictionSolverKind::Nncg => "nncg",
            FrictionSolverKind::Apgd => "apgd",
            FrictionSolverKind::Lemke => "lemke",
            FrictionSolverKind::Enumeration => "enumeration",
            FrictionSolverKind::Exact => "exact",
        }
    }
    /// A fresh solver of this kind.
    pub fn make(self) -> Box<dyn FrictionSolver> {
        match self {
            FrictionSolverKind::Pgs => Box::new(OnMatrix::<Sweeps>::default()),
            FrictionSolverKind::Nncg => Box::new(OnMatrix::<Nncg>::default()),
            FrictionSolverKind::Apgd => Box::new(OnMatrix::<Apgd>::default()),
            FrictionSolverKind::Lemke => Box::new(Lemke),
            FrictionSolverKind::Enumeration => Box::new(Enumeration),
            FrictionSolverKind::Exact => Box::<Exact>::default(),
        }
    }
}

impl FromStr for FrictionSolverKind {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        FrictionSolverKind::ALL.into_iter().find(|k| k.name() == name).ok_or_else(|| {
            let known = FrictionSolverKind::ALL.map(FrictionSolverKind::name).join(", ");
            format!("unknown solver {name:?} of problems in matrix form; known: {known}")
        })
    }
}
