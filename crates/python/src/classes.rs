//! The Python classes, stamped for the plane and for space from one text: PyO3 classes cannot be generic. Every
//! method is one line into a generic function; what users read about them is in `python/carom`.

use crate::arguments::{self, BodyArguments, PlainMass};
use crate::body::{self, AtPoint, Carried};
use crate::chunk::{self, Manner};
use crate::errors;
use crate::gradient::{self, PlainCotangents, PlainFlag, Recorded};
use crate::joint::{self, JointArguments};
use crate::pieces::{self, Collided, PlainContacts, PlainHits, PlainNearest, PlainPose, PlainSide};
use crate::problem::{PlainCsr, PlainResidual, Problem};
use crate::records::{self, Field};
use crate::settings;
use crate::shared::Core;
use crate::step::{self, PlainFinding, PlainGroup};
use crate::views;
use carom::{Ledger, Planar, Settings, SolveSettings, Space, Spatial, World};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

macro_rules! stamp {
    ($space:ty, $world:ident, $problem:ident, $pieces:ident, $rollout:ident) => {
        /// A world: bodies, settings, time.
        #[pyclass(frozen, module = "carom._carom")]
        pub struct $world {
            core: Core<$space>,
        }

        impl $world {
            /// Shares a world with Python.
            pub fn of(world: World<$space>) -> Self {
                $world { core: Core::new(world) }
            }
        }

        #[pymethods]
        impl $world {
            #[new]
            fn new(py: Python<'_>) -> PyResult<Self> {
                World::new(Settings::default()).map(Self::of).map_err(|e| errors::build(py, &e))
            }
            fn set(&self, py: Python<'_>, name: &str, json: &str) -> PyResult<()> {
                settings::set(py, &mut self.core.loan(py)?.world, name, json)
            }
            fn settings(&self, py: Python<'_>) -> PyResult<String> {
                Ok(settings::as_json(self.core.loan(py)?.world.settings()))
            }
            fn threads(&self, py: Python<'_>) -> PyResult<usize> {
                Ok(self.core.loan(py)?.world.threads())
            }
            fn set_threads(&self, py: Python<'_>, threads: usize) -> PyResult<()> {
                self.core.loan(py)?.world.set_threads(threads).map_err(|e| errors::build(py, &e))
            }
            fn step_times(&self, py: Python<'_>) -> PyResult<(f64, f64, f64, f64)> {
                let times = self.core.loan(py)?.world.step_times();
                Ok((times.pairs, times.contacts, times.solve, times.rest))
            }
            fn set_pair(&self, py: Python<'_>, one: &str, other: &str, json: Option<&str>) -> PyResult<()> {
                settings::set_pair(py, &mut self.core.loan(py)?.world, (one, other), json)
            }
            fn pairs(&self, py: Python<'_>) -> PyResult<Vec<(String, String, String)>> {
                Ok(settings::pairs(&self.core.loan(py)?.world))
            }
            fn add(&self, py: Python<'_>, name: &str, arguments: BodyArguments) -> PyResult<()> {
                body::add(&self.core, py, name, &arguments)
            }
            fn remove(&self, py: Python<'_>, name: &str) -> PyResult<()> {
                body::remove(&self.core, py, name)
            }
            fn add_joint(&self, py: Python<'_>, name: &str, arguments: JointArguments) -> PyResult<()> {
                joint::add(&self.core, py, name, &arguments)
            }
            fn remove_joint(&self, py: Python<'_>, name: &str) -> PyResult<()> {
                joint::remove(&self.core, py, name)
            }
            fn joint_names(&self, py: Python<'_>) -> PyResult<Vec<String>> {
                Ok(self.core.loan(py)?.world.bodies().joints.names.clone())
            }
            fn joint<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
                joint::read(&self.core, py, name)
            }
            fn names(&self, py: Python<'_>) -> PyResult<Vec<String>> {
                Ok(self.core.loan(py)?.world.bodies().names.clone())
            }
            fn index(&self, py: Python<'_>, name: &str) -> PyResult<usize> {
                body::index(&self.core, py, name)
            }
            fn has(&self, py: Python<'_>, name: &str) -> PyResult<bool> {
                Ok(self.core.loan(py)?.world.bodies().find(name).is_some())
            }
            fn count(&self, py: Python<'_>) -> PyResult<usize> {
                Ok(self.core.loan(py)?.world.bodies().len())
            }
            fn time(&self, py: Python<'_>) -> PyResult<f64> {
                Ok(self.core.loan(py)?.world.time())
            }
            fn asleep<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
                let loan = self.core.loan(py)?;
                let bodies = loan.world.bodies();
                Ok(PyArray1::from_iter(py, (0..bodies.len()).map(|i| bodies.is_asleep(i))))
            }
            fn wake(&self, py: Python<'_>, name: &str) -> PyResult<bool> {
                body::wake(&self.core, py, name)
            }
            fn masses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
                let inverse: Vec<f64> =
                    self.core.loan(py)?.world.bodies().data.iter().map(|d| 1.0 / d.inverse_mass).collect();
                Ok(PyArray1::from_vec(py, inverse))
            }
            fn view<'py>(slf: &Bound<'py, Self>, which: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
                views::view(&slf.get().core, slf.as_any(), which)
            }
            fn constants<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
                body::constants(&self.core, py, name)
            }
            fn read<'py>(
                &self,
                py: Python<'py>,
                name: &str,
                which: usize,
            ) -> PyResult<Bound<'py, PyArray1<f64>>> {
                body::read(&self.core, py, name, which)
            }
            fn write(&self, py: Python<'_>, name: &str, which: usize, values: Vec<f64>) -> PyResult<()> {
                body::write(&self.core, py, name, which, &values)
            }
            fn carried(&self, py: Python<'_>, name: &str) -> PyResult<Carried> {
                body::carried(&self.core, py, name)
            }
            fn set_momenta(
                &self,
                py: Python<'_>,
                name: &str,
                linear: Vec<f64>,
                angular: Vec<f64>,
            ) -> PyResult<()> {
                body::set_momenta(&self.core, py, name, &linear, &angular)
            }
            fn inertia_about(
                &self,
                py: Python<'_>,
                name: &str,
                axis: Vec<f64>,
                point: Option<Vec<f64>>,
            ) -> PyResult<f64> {
                body::inertia_about(&self.core, py, name, &axis, point)
            }
            fn velocity_at<'py>(
                &self,
                py: Python<'py>,
                name: &str,
                point: Vec<f64>,
            ) -> PyResult<Bound<'py, PyArray1<f64>>> {
                body::at_point(&self.core, py, name, AtPoint::Velocity, &point)
            }
            fn to_world<'py>(
                &self,
                py: Python<'py>,
                name: &str,
                point: Vec<f64>,
            ) -> PyResult<Bound<'py, PyArray1<f64>>> {
                body::at_point(&self.core, py, name, AtPoint::ToWorld, &point)
            }
            fn to_body<'py>(
                &self,
                py: Python<'py>,
                name: &str,
                point: Vec<f64>,
            ) -> PyResult<Bound<'py, PyArray1<f64>>> {
                body::at_point(&self.core, py, name, AtPoint::ToBody, &point)
            }
            fn apply_wrench(
                &self,
                py: Python<'_>,
                name: &str,
                force: Vec<f64>,
                torque: Vec<f64>,
                at: Option<Vec<f64>>,
            ) -> PyResult<()> {
                body::apply_wrench(&self.core, py, name, &force, &torque, at)
            }
            fn apply_impulse(
                &self,
                py: Python<'_>,
                name: &str,
                impulse: Vec<f64>,
                at: Option<Vec<f64>>,
            ) -> PyResult<()> {
                body::apply_impulse(&self.core, py, name, &impulse, at)
            }
            fn add_force(&self, py: Python<'_>, name: &str, function: Py<PyAny>) -> PyResult<()> {
                self.core.fields.set(&mut self.core.loan(py)?.world, name, function);
                Ok(())
            }
            fn remove_force(&self, py: Python<'_>, name: &str) -> PyResult<bool> {
                Ok(self.core.fields.remove(&mut self.core.loan(py)?.world, name))
            }
            fn force_fields(&self, py: Python<'_>) -> PyResult<Vec<String>> {
                Ok(self.core.loan(py)?.world.force_fields().map(String::from).collect())
            }
            fn step<'py>(
                &self,
                py: Python<'py>,
                dt: Option<f64>,
                progress: Option<Py<PyAny>>,
            ) -> PyResult<Bound<'py, PyTuple>> {
                step::step(&self.core, py, dt, progress)
            }
            fn explain(&self, py: Python<'_>, step: u64) -> PyResult<Option<Vec<PlainFinding>>> {
                step::explain(&self.core, py, step)
            }
            fn certificate(
                &self,
                py: Python<'_>,
                phase: &str,
                island: Option<&str>,
            ) -> PyResult<Option<String>> {
                step::certificate(&self.core, py, phase, island)
            }
            fn last_problem<'py>(
                &self,
                py: Python<'py>,
                phase: &str,
            ) -> PyResult<($problem, Bound<'py, PyArray1<f64>>)> {
                let (inner, impulses) = step::last_problem(&self.core, py, phase)?;
                Ok(($problem { inner }, impulses))
            }
            fn advance<'py>(
                &self,
                py: Python<'py>,
                count: usize,
                dt: f64,
                every: usize,
                explains: bool,
                progress: Option<Py<PyAny>>,
            ) -> PyResult<(Bound<'py, PyDict>, Option<Py<PyAny>>)> {
                let manner = Manner { every, explains, progress };
                let (recorded, error) = chunk::advance(&self.core, py, count, dt, manner)?;
                Ok((recorded, error.map(|e| e.into_value(py).into_any())))
            }
            fn frame<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
                chunk::frame(&self.core, py)
            }
            fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u8>>> {
                step::contacts(&self.core, py)
            }
            fn events<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u8>>> {
                step::events(&self.core, py)
            }
            fn energy(&self, py: Python<'_>) -> PyResult<(f64, f64, f64)> {
                step::energy(&self.core, py)
            }
            fn momenta(&self, py: Python<'_>) -> PyResult<(Vec<f64>, Vec<f64>)> {
                step::momenta(&self.core, py)
            }
            fn ledger(&self, py: Python<'_>) -> PyResult<[f64; Ledger::NAMES.len()]> {
                Ok(self.core.loan(py)?.world.ledger().lines())
            }
            fn set_groups(&self, py: Python<'_>, groups: Vec<(String, Option<Vec<String>>)>) -> PyResult<()> {
                step::set_groups(&self.core, py, groups)
            }
            fn groups(&self, py: Python<'_>) -> PyResult<Vec<(String, Option<Vec<String>>)>> {
                step::groups(&self.core, py)
            }
            fn group_ledgers(&self, py: Python<'_>) -> PyResult<Vec<PlainGroup>> {
                step::group_ledgers(&self.core, py)
            }
            fn problem(&self, py: Python<'_>, dt: Option<f64>, phase: &str) -> PyResult<$problem> {
                step::problem(&self.core, py, dt, phase).map(|inner| $problem { inner })
            }
            fn record(
                &self,
                py: Python<'_>,
                steps: usize,
                dt: Option<f64>,
                loads: PyReadonlyArray1<'_, f64>,
                stretch: Option<usize>,
            ) -> PyResult<$rollout> {
                gradient::record(&self.core, py, (steps, dt), &loads, stretch).map(|inner| $rollout { inner })
            }
            fn snapshot(&self, py: Python<'_>) -> PyResult<String> {
                step::snapshot(&self.core, py)
            }
            fn restore(&self, py: Python<'_>, text: &str) -> PyResult<()> {
                step::restore(&self.core, py, text)
            }
            #[staticmethod]
            fn contact_fields() -> Vec<Field> {
                records::contact_fields::<$space>()
            }
            #[staticmethod]
            fn action_fields() -> Vec<Field> {
                records::action_fields::<$space>()
            }
            #[staticmethod]
            fn event_fields() -> Vec<Field> {
                records::event_fields::<$space>()
            }
            #[staticmethod]
            fn piece_fields() -> Vec<Field> {
                records::piece_fields::<$space>()
            }
            #[staticmethod]
            fn step_fields() -> Vec<Field> {
                records::step_fields::<$space>()
            }
            fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
                self.core.fields.traverse(&visit)
            }
            fn __clear__(&self) {
                self.core.fields.clear();
            }
        }

        /// A contact problem.
        #[pyclass(frozen, module = "carom._carom")]
        pub struct $problem {
            inner: Problem<$space>,
        }

        #[pymethods]
        impl $problem {
            #[staticmethod]
            fn from_json(py: Python<'_>, text: &str) -> PyResult<Self> {
                Problem::from_json(py, text).map(|inner| $problem { inner })
            }
            fn to_json(&self) -> String {
                self.inner.to_json()
            }
            fn counts(&self) -> (usize, usize, usize, usize) {
                self.inner.counts()
            }
            fn pairs(&self) -> Vec<(usize, usize)> {
                self.inner.pairs()
            }
            fn matrix<'py>(&self, py: Python<'py>, which: &str) -> PlainCsr<'py> {
                self.inner.matrix(py, which)
            }
            fn vector<'py>(&self, py: Python<'py>, which: &str) -> Bound<'py, PyArray1<f64>> {
                self.inner.vector(py, which)
            }
            fn residual(
                &self,
                py: Python<'_>,
                impulse: Vec<f64>,
                law: Option<&str>,
            ) -> PyResult<PlainResidual> {
                self.inner.residual(py, &impulse, law)
            }
            fn residuals<'py>(
                &self,
                py: Python<'py>,
                impulse: Vec<f64>,
                law: Option<&str>,
            ) -> PyResult<Bound<'py, PyArray1<f64>>> {
                self.inner.residuals(py, &impulse, law)
            }
            fn certificate(
                &self,
                py: Python<'_>,
                impulse: Vec<f64>,
                law: Option<&str>,
                body: Option<usize>,
            ) -> PyResult<Option<String>> {
                self.inner.certificate(py, &impulse, law, body)
            }
            #[expect(clippy::too_many_arguments, reason = "keywords of one Python method")]
            fn solve<'py>(
                &self,
                py: Python<'py>,
                solver: &str,
                budget: (usize, usize),
                tolerance: f64,
                impulses: &str,
                law: Option<&str>,
                start: Option<Vec<f64>>,
            ) -> PyResult<Bound<'py, PyDict>> {
                let (iterations, factorisations) = budget;
                let impulses = crate::arguments::impulse_choice(py, impulses)?;
                let settings = SolveSettings {
                    iterations,
                    tolerance,
                    factorisations,
                    impulses,
                    content: None,
                    polish: false,
                };
                self.inner.solve(py, solver, settings, law, start.as_deref())
            }
        }

        /// Recorded steps, to be differentiated.
        #[pyclass(frozen, module = "carom._carom")]
        pub struct $rollout {
            inner: Recorded<$space>,
        }

        #[pymethods]
        impl $rollout {
            fn states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
                self.inner.states(py)
            }
            fn flags(&self) -> Vec<PlainFlag> {
                self.inner.flags()
            }
            fn stretch(&self) -> usize {
                self.inner.stretch()
            }
            fn pullback<'py>(
                &self,
                py: Python<'py>,
                cotangents: PlainCotangents<'py>,
            ) -> PyResult<Bound<'py, PyDict>> {
                self.inner.pullback(py, cotangents)
            }
        }

        /// Geometry and single collisions.
        #[pyclass(frozen, module = "carom._carom")]
        pub struct $pieces;

        #[pymethods]
        impl $pieces {
            #[staticmethod]
            fn mass_properties(py: Python<'_>, shape: &str, density: f64) -> PyResult<PlainMass> {
                pieces::mass_properties::<$space>(py, shape, density)
            }
            #[staticmethod]
            fn mass_properties_of(
                py: Python<'_>,
                shape: &str,
                density: &Bound<'_, PyAny>,
                tolerance: f64,
            ) -> PyResult<PlainMass> {
                pieces::mass_properties_of::<$space>(py, shape, density, tolerance)
            }
            #[staticmethod]
            fn contacts<'py>(
                py: Python<'py>,
                shape_a: &str,
                pose_a: PlainPose,
                shape_b: &str,
                pose_b: PlainPose,
                margin: f64,
            ) -> PyResult<PlainContacts<'py>> {
                pieces::contacts::<$space>(py, (shape_a, &pose_a), (shape_b, &pose_b), margin)
            }
            #[staticmethod]
            fn closest(
                py: Python<'_>,
                shape_a: &str,
                pose_a: PlainPose,
                shape_b: &str,
                pose_b: PlainPose,
                reach: f64,
            ) -> PyResult<Option<PlainNearest>> {
                pieces::closest::<$space>(py, (shape_a, &pose_a), (shape_b, &pose_b), reach)
            }
            #[staticmethod]
            fn raycast<'py>(
                py: Python<'py>,
                shape: &str,
                pose: PlainPose,
                origins: PyReadonlyArray1<'py, f64>,
                directions: PyReadonlyArray1<'py, f64>,
                reach: f64,
            ) -> PyResult<PlainHits<'py>> {
                pieces::raycast::<$space>(py, (shape, &pose), &origins, &directions, reach)
            }
            #[staticmethod]
            fn offset(point: Vec<f64>, center: Vec<f64>) -> PyResult<Vec<f64>> {
                pieces::offset::<$space>(&point, &center)
            }
            #[staticmethod]
            fn normal_velocity(normal: Vec<f64>, a: PlainSide, b: PlainSide) -> PyResult<f64> {
                pieces::normal_velocity::<$space>(&normal, &a, &b)
            }
            #[staticmethod]
            fn effective_mass(direction: Vec<f64>, a: PlainSide, b: PlainSide) -> PyResult<f64> {
                pieces::effective_mass::<$space>(&direction, &a, &b)
            }
            #[staticmethod]
            fn respond(side: PlainSide, impulse: Vec<f64>) -> PyResult<(Vec<f64>, Vec<f64>)> {
                pieces::respond::<$space>(&side, &impulse)
            }
            #[staticmethod]
            fn collide(a: PlainSide, b: PlainSide, normal: Vec<f64>, restitution: f64) -> PyResult<Collided> {
                pieces::collide::<$space>(&a, &b, &normal, restitution)
            }
            #[staticmethod]
            fn rotation(values: Vec<f64>) -> PyResult<Vec<f64>> {
                pieces::rotation::<$space>(&values)
            }
            /// The shape with its numbers as the engine reads them; a refusal names the field.
            #[staticmethod]
            fn check_shape(py: Python<'_>, shape: &str) -> PyResult<()> {
                let shape = arguments::shape::<$space>(py, shape)?;
                <$space as carom::Geometry>::collider(&shape).map(|_| ()).map_err(|e| errors::shape(py, e))
            }
            #[classattr]
            const SPACE: &'static str = <$space as Space>::NAME;
        }
    };
}

stamp!(Planar, PlanarWorld, PlanarProblem, PlanarPieces, PlanarRollout);
stamp!(Spatial, SpatialWorld, SpatialProblem, SpatialPieces, SpatialRollout);
