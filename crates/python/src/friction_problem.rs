//! Friction problems in matrix form as Python values: measured and solved from arrays, without the interpreter's
//! lock, stopped by Ctrl-C. Converts and guards; knows no physics.

use crate::errors;
use crate::lookout::Lookout;
use carom::solver::exact::Exact;
use carom::solver::{
    Csr, FrictionOutcome, FrictionProblem, FrictionSettings, FrictionSolver, FrictionSolverKind, Measure,
    Progress, measure,
};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::time::Instant;

/// u = W r + q in contact frames with Coulomb's law at every contact; does not change.
#[pyclass(frozen, module = "carom._carom", name = "FrictionProblem")]
pub struct PyFrictionProblem {
    inner: FrictionProblem,
}

/// Names of the solvers of these problems.
pub fn solver_names() -> Vec<&'static str> {
    let others = FrictionSolverKind::ALL.map(FrictionSolverKind::name);
    std::iter::once("exact").chain(others.into_iter().filter(|name| *name != "exact")).collect()
}

/// A fresh solver by name.
fn make(name: &str) -> Option<Box<dyn FrictionSolver>> {
    match name {
        "exact" => Some(Box::<Exact>::default()),
        other => other.parse::<FrictionSolverKind>().ok().map(FrictionSolverKind::make),
    }
}

/// Whole numbers that count or point: none below zero.
fn places(py: Python<'_>, field: &str, list: &PyReadonlyArray1<'_, i64>) -> PyResult<Vec<usize>> {
    let refuse = |x: &i64| {
        errors::argument(
            py,
            field,
            &format!("must be >= 0, got {x}"),
            "give the arrays of a compressed-row matrix",
        )
    };
    list.as_array().iter().map(|x| usize::try_from(*x).map_err(|_| refuse(x))).collect()
}

fn plain_measure<'py>(py: Python<'py>, m: &Measure) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("err_nat", m.natural)?;
    dict.set_item("err_scaled", m.scaled)?;
    dict.set_item("cone", m.cone)?;
    dict.set_item("penetration", m.penetration)?;
    dict.set_item("complementarity", m.complementarity)?;
    dict.set_item("slip_alignment", m.slip_alignment)?;
    dict.set_item("take_off", m.take_off)?;
    dict.set_item("stick", m.stick)?;
    dict.set_item("slip", m.slip)?;
    Ok(dict)
}

#[pymethods]
impl PyFrictionProblem {
    #[new]
    fn new(
        py: Python<'_>,
        dimension: usize,
        data: PyReadonlyArray1<'_, f64>,
        indices: PyReadonlyArray1<'_, i64>,
        indptr: PyReadonlyArray1<'_, i64>,
        q: PyReadonlyArray1<'_, f64>,
        mu: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Self> {
        let velocity = q.as_array().to_vec();
        let matrix = Csr {
            shape: (velocity.len(), velocity.len()),
            starts: places(py, "indptr", &indptr)?,
            indices: places(py, "indices", &indices)?,
            values: data.as_array().to_vec(),
        };
        let inner =
            FrictionProblem { dimension, matrix: matrix.into(), velocity, friction: mu.as_array().to_vec() };
        inner.check().map_err(|e| errors::problem(py, &e))?;
        Ok(PyFrictionProblem { inner })
    }

    fn measure<'py>(
        &self,
        py: Python<'py>,
        impulses: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let flat = self.impulses(py, "impulse", &impulses)?;
        let found = py.detach(|| measure(&self.inner, &flat));
        plain_measure(py, &found)
    }

    #[pyo3(signature = (solver, tolerance, iterations, factorisations, impulses, start, tell))]
    #[expect(clippy::too_many_arguments, reason = "keywords of one Python method")]
    fn solve<'py>(
        &self,
        py: Python<'py>,
        solver: &str,
        tolerance: f64,
        iterations: usize,
        factorisations: usize,
        impulses: &str,
        start: Option<PyReadonlyArray1<'py, f64>>,
        tell: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        if make(solver).is_none() {
            let problem = format!("must be one of {}, got {solver:?}", solver_names().join(", "));
            return Err(errors::argument(py, "solver", &problem, "choose one of them"));
        }
        let choice = crate::arguments::impulse_choice(py, impulses)?;
        let mut impulses = match start {
            Some(flat) => self.impulses(py, "start", &flat)?,
            None => vec![0.0; self.inner.velocity.len()],
        };
        let settings = FrictionSettings { tolerance, iterations, factorisations, impulses: choice };
        let mut lookout = Lookout::stoppable(tell);
        let outcome = py.detach(|| {
            let mut method = make(solver).expect("a name of the list has a solver");
            let started = Instant::now();
            let mut outcome =
                method.solve(&self.inner, &settings, &mut impulses, &mut |at: &Progress| lookout.look(at));
            // what is solved at once reads no clock of its own
            if outcome.seconds == 0.0 {
                outcome.seconds = started.elapsed().as_secs_f64();
            }
            outcome
        });
        let dict = plain_outcome(py, &outcome)?;
        dict.set_item("impulse", PyArray1::from_vec(py, impulses))?;
        dict.set_item("stopped", lookout.stopped())?;
        dict.set_item("error", lookout.take().map(|e| e.into_value(py)))?;
        Ok(dict)
    }
}

impl PyFrictionProblem {
    fn impulses(&self, py: Python<'_>, field: &str, flat: &PyReadonlyArray1<'_, f64>) -> PyResult<Vec<f64>> {
        let flat = flat.as_array().to_vec();
        let n = self.inner.velocity.len();
        if flat.len() == n && flat.iter().all(|x| x.is_finite()) {
            return Ok(flat);
        }
        let problem = format!("must be {n} finite numbers, got {}", flat.len());
        Err(errors::argument(py, field, &problem, "give the normal, then the tangents of each contact [N s]"))
    }
}

fn plain_outcome<'py>(py: Python<'py>, outcome: &FrictionOutcome) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("solved", outcome.solved)?;
    dict.set_item("measure", plain_measure(py, &outcome.measure)?)?;
    let stages: Vec<(&str, usize)> = outcome.stages.iter().map(|s| (s.name, s.iterations)).collect();
    dict.set_item("stages", stages)?;
    dict.set_item("factorisations", outcome.factorisations)?;
    dict.set_item("seconds", outcome.seconds)?;
    dict.set_item("reason", outcome.reason.as_str())?;
    dict.set_item("strict_feasibility", outcome.strict_feasibility)?;
    Ok(dict)
}
