//! Contact problems as Python values: matrices, vectors, solves, files.

use crate::errors;
use crate::lookout::Lookout;
use crate::step::{PlainStage, plain_stages};
use carom::solver::{Csr, Entry, Residual, contact_residuals, delassus, file, residual};
use carom::{
    Certificate, ContactProblem, FrictionLaw, Geometry, Impulses, IslandReport, SolveSettings, SolverKind,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A problem that does not change.
pub struct Problem<S: Geometry> {
    inner: ContactProblem<S>,
}

/// A sparse matrix: values, columns, starts of rows, shape.
pub type PlainCsr<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<i64>>, (usize, usize));

fn plain_csr(py: Python<'_>, m: Csr) -> PlainCsr<'_> {
    let whole = |list: Vec<usize>| PyArray1::from_iter(py, list.into_iter().map(|i| i as i64));
    (PyArray1::from_vec(py, m.values), whole(m.indices), whole(m.starts), m.shape)
}

/// Residual \[m/s\], relative residual \[1\], worst entry: ("contact" | "row", index).
pub type PlainResidual = (f64, f64, Option<(&'static str, usize)>);

fn plain_residual(r: &Residual) -> PlainResidual {
    let worst = r.worst.map(|e| match e {
        Entry::Contact(i) => ("contact", i),
        Entry::Row(i) => ("row", i),
    });
    (r.absolute, r.relative, worst)
}

/// Friction law by name.
fn law(py: Python<'_>, name: &str) -> PyResult<FrictionLaw> {
    match name {
        "disc" => Ok(FrictionLaw::Disc),
        "box" => Ok(FrictionLaw::Box),
        other => {
            let problem = format!("must be 'disc' or 'box', got {other:?}");
            Err(errors::argument(py, "friction_law", &problem, "choose 'disc' or 'box'"))
        }
    }
}

impl<S: Geometry> Problem<S> {
    /// Wraps a problem.
    pub fn new(inner: ContactProblem<S>) -> Self {
        Problem { inner }
    }
    /// A checked problem from JSON.
    ///
    /// # Errors
    /// `BuildError` naming the wrong entry.
    pub fn from_json(py: Python<'_>, text: &str) -> PyResult<Self> {
        file::from_json(text).map(Problem::new).map_err(|e| errors::problem(py, &e))
    }
    /// The problem as JSON.
    pub fn to_json(&self) -> String {
        file::to_json(&self.inner)
    }
    /// Bodies, contacts, general rows, contacts with rolling or spinning friction.
    pub fn counts(&self) -> (usize, usize, usize, usize) {
        let p = &self.inner;
        (p.inverse_masses.len(), p.contacts.len(), p.rows.len(), p.resistances.len())
    }
    /// "J", "M" (inverse masses) or "A".
    pub fn matrix<'py>(&self, py: Python<'py>, which: &str) -> PlainCsr<'py> {
        let m = match which {
            "J" => delassus::jacobian(&self.inner),
            "M" => delassus::inverse_mass_matrix(&self.inner),
            _ => delassus::delassus(&self.inner),
        };
        plain_csr(py, m)
    }
    /// "b" or "target" over scalar rows; "friction", "restitution" or "gap" over contacts.
    pub fn vector<'py>(&self, py: Python<'py>, which: &str) -> Bound<'py, PyArray1<f64>> {
        let p = &self.inner;
        let contacts = || p.contacts.iter();
        let numbers = match which {
            "b" => delassus::right_hand_side(p),
            "target" => delassus::targets(p),
            "friction" => contacts().map(|c| c.friction).collect(),
            "restitution" => contacts().map(|c| c.restitution).collect(),
            _ => contacts().map(|c| c.gap).collect(),
        };
        PyArray1::from_vec(py, numbers)
    }
    /// Bodies a and b of every contact.
    pub fn pairs(&self) -> Vec<(usize, usize)> {
        self.inner.contacts.iter().map(|c| (c.a, c.b)).collect()
    }

    fn under(&self, py: Python<'_>, name: Option<&str>) -> PyResult<ContactProblem<S>> {
        let mut problem = self.inner.clone();
        if let Some(name) = name {
            problem.friction_law = law(py, name)?;
        }
        Ok(problem)
    }

    fn impulses(&self, py: Python<'_>, flat: &[f64]) -> PyResult<Impulses<S>> {
        Impulses::from_flat(&self.inner, flat).ok_or_else(|| {
            let problem = format!("must have {} numbers, got {}", self.inner.scalar_rows(), flat.len());
            errors::argument(py, "impulse", &problem, "give one row per contact: normal, then tangents [N s]")
        })
    }

    /// Residual of impulses in the order of the scalar rows.
    ///
    /// # Errors
    /// `BuildError` for a wrong count or law.
    pub fn residual(&self, py: Python<'_>, flat: &[f64], law: Option<&str>) -> PyResult<PlainResidual> {
        let impulses = self.impulses(py, flat)?;
        let problem = self.under(py, law)?;
        Ok(plain_residual(&residual(&problem, &impulses)))
    }

    /// Residual of every contact for impulses in the order of the scalar rows.
    ///
    /// # Errors
    /// `BuildError` for a wrong count or law.
    pub fn residuals<'py>(
        &self,
        py: Python<'py>,
        flat: &[f64],
        law: Option<&str>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let impulses = self.impulses(py, flat)?;
        let problem = self.under(py, law)?;
        Ok(PyArray1::from_vec(py, contact_residuals(&problem, &impulses)))
    }

    /// Certificate of impulses in the order of the scalar rows, as JSON; of the island of a body where one is given,
    /// and nothing when nothing touches that body.
    ///
    /// # Errors
    /// `BuildError` for a wrong count, law or body.
    pub fn certificate(
        &self,
        py: Python<'_>,
        flat: &[f64],
        law: Option<&str>,
        body: Option<usize>,
    ) -> PyResult<Option<String>> {
        let impulses = self.impulses(py, flat)?;
        let problem = self.under(py, law)?;
        let found = Certificate::narrowed(&problem, &impulses, body);
        Ok(found.map(|certificate| certificate.to_json()))
    }

    /// Solves without the interpreter's lock: a dictionary with impulse, velocity, residual, iterations, stop.
    ///
    /// # Errors
    /// `BuildError` for an unknown solver or law, or a warm start of a wrong length.
    pub fn solve<'py>(
        &self,
        py: Python<'py>,
        solver: &str,
        settings: SolveSettings,
        friction_law: Option<&str>,
        start: Option<&[f64]>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let kind: SolverKind = solver.parse().map_err(|_| {
            let known = SolverKind::ALL.map(|k| format!("'{}'", k.name())).join(", ");
            let problem = format!("must be one of {known}, got {solver:?}");
            errors::argument(py, "solver", &problem, &format!("choose one of {known}"))
        })?;
        let problem = self.under(py, friction_law)?;
        let mut impulses = match start {
            Some(flat) => self.impulses(py, flat)?,
            None => Impulses::zero(&problem),
        };
        let mut lookout = Lookout::new(None);
        let watch = &mut lookout;
        let (outcome, impulses, velocities) = py.detach(|| {
            let watch = &mut |progress: &_| watch.look(progress);
            let outcome = kind.make::<S>().solve_watched(&problem, &settings, &mut impulses, watch);
            let velocities = problem.velocities_after(&impulses);
            (outcome, impulses, velocities)
        });
        if let Some(raised) = lookout.take() {
            return Err(raised);
        }
        let dict = PyDict::new(py);
        dict.set_item("impulse", PyArray1::from_vec(py, impulses.flat()))?;
        dict.set_item("velocity", twists::<S>(py, &velocities)?)?;
        dict.set_item("residual", plain_residual(&outcome.residual))?;
        dict.set_item("iterations", outcome.iterations)?;
        dict.set_item("factorisations", outcome.factorisations)?;
        dict.set_item("status", outcome.stop.name())?;
        dict.set_item("reason", outcome.stop.reason())?;
        let islands: Vec<PlainIsland> =
            outcome.islands.iter().map(|island| plain_island(&problem, island, settings.tolerance)).collect();
        dict.set_item("islands", islands)?;
        dict.set_item("strict_feasibility", outcome.strict_feasibility)?;
        Ok(dict)
    }
}

/// An island as in `step`, with bodies by index.
type PlainIsland =
    (usize, usize, usize, usize, f64, f64, Option<(usize, usize)>, Vec<PlainStage>, String, Option<f64>);

fn plain_island<S: Geometry>(
    problem: &ContactProblem<S>,
    island: &IslandReport,
    tolerance: f64,
) -> PlainIsland {
    let pair = island.worst.map(|entry| match entry {
        Entry::Contact(k) => (problem.contacts[k].a, problem.contacts[k].b),
        Entry::Row(k) => (problem.rows[k].a, problem.rows[k].b),
    });
    (
        island.contacts,
        island.rows,
        island.bodies,
        island.first_body,
        island.residual,
        island.relative_residual,
        pair,
        plain_stages(island),
        island.why_further(tolerance),
        island.strict_feasibility,
    )
}

/// Velocities as an (n, DOF) array: linear, then angular.
fn twists<'py, S: Geometry>(py: Python<'py>, all: &[carom::Twist<S>]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let mut numbers = Vec::with_capacity(all.len() * S::DOF);
    for t in all {
        numbers.extend(crate::arrays::flat(&[t.linear]));
        numbers.extend(crate::arrays::flat(&[t.angular]));
    }
    crate::arrays::matrix(py, numbers, S::DOF)
}
