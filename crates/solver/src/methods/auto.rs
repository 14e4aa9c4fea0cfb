//! The solver that asks for no more than the residual needs: every island gets the cheap sweep first, and goes on
//! to stronger methods only while its residual is above the tolerance. The outcome's islands say how far each went.
//! Knows no method: the ladder does the climbing.

use crate::impulse_solver::SolverKind;
use crate::methods::ladder::Ladder;
use carom_math::Space;

/// The stages in order. Conjugate gradients take the sweeps on at the same cost each; `exact` solves every contact
/// law to any tolerance by factorising; `lemke` takes what `exact` refuses, bounded rows in small problems.
/// Tried on warm-started steps of the catalogue's stacks, pyramids and card house: `apgd` in the place of `nncg` or
/// as one more rung is no faster anywhere: a hundred iterations are too few for it where they are too few for `nncg`.
/// `exact` straight after `pgs` is faster on stacks and slower on pyramids.
const STAGES: [SolverKind; 4] = [SolverKind::Pgs, SolverKind::Nncg, SolverKind::Exact, SolverKind::Lemke];

/// The solver.
pub fn ladder<S: Space>() -> Ladder<S> {
    Ladder::new("auto", &STAGES)
}
