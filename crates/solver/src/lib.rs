//! Contact problems as values, the solvers that find their impulses behind one trait, and the one residual
//! that judges them all. Knows no shapes, no world and no clock.

pub mod certificate;
pub mod check;
pub mod collision;
pub mod cone;
mod cone_matrix;
pub mod delassus;
mod delassus_blocks;
pub mod diagnosis;
pub mod exact;
pub mod file;
pub mod friction;
pub mod friction_measure;
pub mod friction_problem;
pub mod friction_solver;
pub mod friction_solver_kind;
pub mod impulse_solver;
pub mod islands;
pub mod lcp;
pub mod linear;
pub mod methods;
mod number;
pub mod outcome;
pub mod prepared;
pub mod problem;
mod registers;
pub mod residual;
pub mod resistance;
pub mod soft;
mod stopwatch;
pub mod watch;

pub use certificate::Certificate;
pub use delassus::Csr;
pub use delassus_blocks::Delassus;
pub use diagnosis::{Diagnosis, diagnose};
pub use friction_measure::{Measure, measure};
pub use friction_problem::FrictionProblem;
pub use friction_solver::{FrictionOutcome, FrictionSettings, FrictionSolver, Stage, StageList};
pub use friction_solver_kind::FrictionSolverKind;
pub use impulse_solver::{Content, ImpulseChoice, ImpulseSolver, SolveSettings, SolverKind};
pub use islands::{Islands, Part, Partition};
pub use outcome::{AtOnce, IslandReport, Outcome, StageReport, Stages, Stop};
pub use problem::{
    BoundedRow, Contact, ContactProblem, FrictionLaw, Impulse, Impulses, InverseMass, ProblemError, Twist,
};
pub use residual::{Entry, Residual, contact_residuals, residual};
pub use resistance::Resistance;
pub use stopwatch::Stopwatch;
pub use watch::{Progress, Watch, unwatched};
