//! A world that Python shares: lent to one call at a time, stepped without the interpreter's lock, with its
//! moving state in memory that numpy arrays may look at. Knows no Python values but errors.
//!
//! A call borrows the world with [`Core::loan`] and gives it back when the loan ends, also by a panic. While a
//! step runs in another thread, or in this one above a force field's callback, there is nothing to lend and
//! the call is refused, so neither data races nor deadlocks can happen.

use crate::errors;
use crate::fields::Fields;
use crate::views::LiveViews;
use carom::{Geometry, Motion, StepReport, World};
use pyo3::prelude::*;
use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What is lent: the world, and the memory that stands in for its motion while viewed arrays rest.
pub struct Held<S: Geometry> {
    /// The world itself.
    pub world: World<S>,
    /// Report of the last single step, for questions about it.
    pub last_report: Option<StepReport<S>>,
    aside: Motion<S>,
    is_broken: bool,
}

impl<S: Geometry> Held<S> {
    fn new(world: World<S>) -> Box<Self> {
        Box::new(Held { world, last_report: None, aside: Motion::default(), is_broken: false })
    }
    /// Puts the viewed memory aside and gives the world a copy to work on.
    fn set_aside(&mut self) {
        std::mem::swap(self.world.motion_mut(), &mut self.aside);
        self.world.motion_mut().copy_from(&self.aside);
    }
    /// Writes the world's motion into the viewed memory and gives that back to the world.
    fn take_back(&mut self) {
        let made = &self.world.bodies().motion;
        // copy_from_slice cannot move the viewed memory; it would panic on another length
        self.aside.position.copy_from_slice(&made.position);
        self.aside.rotation.copy_from_slice(&made.rotation);
        self.aside.velocity.copy_from_slice(&made.velocity);
        self.aside.angular_velocity.copy_from_slice(&made.angular_velocity);
        std::mem::swap(self.world.motion_mut(), &mut self.aside);
    }
}

/// The part of a Python world that is written once for the plane and for space.
pub struct Core<S: Geometry> {
    held: Mutex<Option<Box<Held<S>>>>,
    /// Arrays that look at the motion.
    pub views: LiveViews,
    /// Python functions that act as force fields.
    pub fields: Fields,
}

/// The world, for the duration of one call.
pub struct Loan<'a, S: Geometry> {
    core: &'a Core<S>,
    held: Option<Box<Held<S>>>,
}

impl<S: Geometry> Deref for Loan<'_, S> {
    type Target = Held<S>;
    fn deref(&self) -> &Held<S> {
        self.held.as_deref().expect("a loan holds its world until it ends")
    }
}
impl<S: Geometry> DerefMut for Loan<'_, S> {
    fn deref_mut(&mut self) -> &mut Held<S> {
        self.held.as_deref_mut().expect("a loan holds its world until it ends")
    }
}
impl<S: Geometry> Drop for Loan<'_, S> {
    fn drop(&mut self) {
        if let Some(mut held) = self.held.take() {
            held.is_broken |= std::thread::panicking();
            *self.core.lock() = Some(held);
        }
    }
}

impl<S: Geometry> Core<S> {
    /// Shares a world.
    pub fn new(world: World<S>) -> Self {
        Core {
            held: Mutex::new(Some(Held::new(world))),
            views: LiveViews::default(),
            fields: Fields::default(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Option<Box<Held<S>>>> {
        // held only to take and to put, so nobody can be waiting for it with half a change made
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Borrows the world for this call.
    ///
    /// # Errors
    /// `BusyError` while a step is running; `CaromError` after an internal error in one.
    pub fn loan(&self, py: Python<'_>) -> PyResult<Loan<'_, S>> {
        let loan = self.loan_even_broken(py)?;
        if loan.is_broken { Err(errors::broken(py)) } else { Ok(loan) }
    }

    fn loan_even_broken(&self, py: Python<'_>) -> PyResult<Loan<'_, S>> {
        let held = self.lock().take();
        held.map(|held| Loan { core: self, held: Some(held) }).ok_or_else(|| errors::busy(py))
    }

    /// Borrows the world to add or remove bodies.
    ///
    /// # Errors
    /// As `loan`, and `ViewError` while arrays look at the motion.
    pub fn loan_to_restructure(&self, py: Python<'_>, what: &str) -> PyResult<Loan<'_, S>> {
        self.views.refuse_if_alive(py, what)?;
        self.loan(py)
    }

    /// Replaces the world as a whole, but for its threads; also one that an internal error left half changed.
    ///
    /// # Errors
    /// `BusyError` while a step is running, `ViewError` while arrays look at the motion.
    pub fn replace(&self, py: Python<'_>, mut world: World<S>, what: &str) -> PyResult<()> {
        self.views.refuse_if_alive(py, what)?;
        let mut loan = self.loan_even_broken(py)?;
        world.share_threads(&loan.world);
        loan.held = Some(Held::new(world));
        Ok(())
    }

    /// Lets a job step the world without the interpreter's lock. Viewed arrays keep the state from before the
    /// job until it has ended, so that a thread that reads them meanwhile sees no half-made step.
    ///
    /// # Errors
    /// As `loan`.
    pub fn advance<R: Send>(
        &self,
        py: Python<'_>,
        job: impl FnOnce(&mut World<S>) -> R + Send,
    ) -> PyResult<R> {
        let mut loan = self.loan(py)?;
        let held: &mut Held<S> = &mut loan;
        let is_viewed = self.views.any();
        if is_viewed {
            held.set_aside();
        }
        let world = &mut held.world;
        let result = py.detach(|| job(world));
        if is_viewed {
            held.take_back();
        }
        Ok(result)
    }
}
