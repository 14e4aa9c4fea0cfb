//! Position correction (theory chapter 6): the notes' nudge, and split impulse. Only overlaps of contacts that
//! do not separate are corrected; a body on its way out of an impact leaves by itself. Bodies keep their momenta,
//! linear and of spin; what the displacement does to the energy is the caller's to book.

use crate::assembly;
use crate::bodies::Bodies;
use crate::integrate::set_spin_momentum;
use crate::narrow_phase::Touch;
use crate::settings::{PositionCorrection, Settings};
use carom_geometry::Geometry;
use carom_math::{Column, Rotation};
use carom_solver::methods::pgs::Pgs;
use carom_solver::{ContactProblem, ImpulseSolver, Impulses, SolveSettings, Twist};

/// A contact with the gap and normal velocity that it ends the step with.
#[derive(Clone, Copy, Debug)]
pub struct Overlap<S: Geometry> {
    /// The contact as detected.
    pub touch: Touch<S>,
    /// Gap at the end of the step, to first order \[m\].
    pub gap: f64,
    /// True when the bodies separate fast enough to part by themselves.
    pub leaves: bool,
}

impl<S: Geometry> Overlap<S> {
    /// Depth to be corrected \[m\]; 0 or less when there is none.
    fn excess(&self, slop: f64) -> f64 {
        -(self.gap + slop)
    }
}

/// Memory of the correction.
pub struct Correction<S: Geometry> {
    problem: ContactProblem<S>,
    impulses: Impulses<S>,
    solver: Pgs<S>,
    /// How far the last correction moved each body \[m\] and turned it \[rad\]; empty when it moved none.
    pub moved: Vec<Twist<S>>,
}

impl<S: Geometry> Default for Correction<S> {
    fn default() -> Self {
        let problem = ContactProblem::new(Vec::new(), Vec::new());
        Correction { impulses: Impulses::zero(&problem), problem, solver: Pgs::default(), moved: Vec::new() }
    }
}

impl<S: Geometry> Correction<S> {
    /// Moves overlapping bodies apart; true when anything moved.
    pub fn apply(
        &mut self,
        bodies: &mut Bodies<S>,
        overlaps: &[Overlap<S>],
        settings: &Settings<S>,
        slop: f64,
        dt: f64,
    ) -> bool {
        self.moved.clear();
        if overlaps.iter().all(|o| o.leaves || o.excess(slop) <= 0.0) {
            return false;
        }
        match settings.position_correction {
            PositionCorrection::None => return false,
            PositionCorrection::Nudge => {
                let moved = nudge(bodies, overlaps, settings.correction_fraction, slop);
                self.moved.extend(moved.into_iter().map(|linear| Twist { linear, angular: S::Spin::ZERO }));
            }
            PositionCorrection::SplitImpulse => self.split_impulse(bodies, overlaps, settings, slop, dt),
        }
        true
    }

    fn split_impulse(
        &mut self,
        bodies: &mut Bodies<S>,
        overlaps: &[Overlap<S>],
        settings: &Settings<S>,
        slop: f64,
        dt: f64,
    ) {
        assembly::begin(&mut self.problem, bodies, settings.friction_law);
        self.problem.velocities.fill(Twist::default());
        for o in overlaps {
            let excess = o.excess(slop);
            // an overlap closes by a fraction; a gap may close, but no further; who leaves is only not pushed back
            let target = match (excess > 0.0, o.leaves) {
                (true, true) => 0.0,
                (true, false) => settings.correction_fraction * excess / dt,
                _ => excess / dt,
            };
            let mut c = assembly::contact(bodies, &o.touch, target);
            c.friction = 0.0;
            self.problem.contacts.push(c);
        }
        // joints stay closed, and close what the step left open
        let errors: Vec<f64> = bodies.joint_errors().iter().map(|e| -e / dt).collect();
        bodies.push_joints(&bodies.joint_frames(), &errors, &mut self.problem);
        self.impulses.reset(&self.problem);
        // the correction is a fraction anyway: a tenth of the slop per step is exact enough
        let solve = SolveSettings {
            iterations: settings.iterations.min(30),
            tolerance: 0.1 * slop / dt,
            ..SolveSettings::default()
        };
        self.solver.solve(&self.problem, &solve, &mut self.impulses);
        for (i, v) in self.problem.velocities_after(&self.impulses).iter().enumerate() {
            // no impulse moves an obstacle; an infinite moment times nothing is no number
            let v = if bodies.is_dynamic(i) { *v } else { Twist::default() };
            self.moved.push(Twist { linear: v.linear * dt, angular: v.angular * dt });
            bodies.motion.position[i] += v.linear * dt;
            if v.angular != S::Spin::ZERO {
                let momentum = bodies.spin_momentum(i);
                bodies.motion.rotation[i] =
                    bodies.motion.rotation[i].then(&S::Rotation::about(v.angular * dt));
                set_spin_momentum(bodies, i, momentum);
            }
        }
    }
}

/// Moves each overlapping pair apart along its normal by a fraction of its overlap, shares by inverse mass;
/// later contacts see what earlier ones did (item 26). Gives the way of each body.
fn nudge<S: Geometry>(
    bodies: &mut Bodies<S>,
    overlaps: &[Overlap<S>],
    fraction: f64,
    slop: f64,
) -> Vec<S::Vector> {
    let mut moved = vec![S::Vector::ZERO; bodies.len()];
    for o in overlaps.iter().filter(|o| !o.leaves) {
        let t = &o.touch;
        let gap = o.gap + t.normal.dot(moved[t.a] - moved[t.b]);
        let excess = -(gap + slop);
        let (a, b) = (bodies.data[t.a].inverse_mass, bodies.data[t.b].inverse_mass);
        if excess > 0.0 {
            let push = t.normal * (fraction * excess / (a + b));
            moved[t.a] += push * a;
            moved[t.b] -= push * b;
        }
    }
    for (x, d) in bodies.motion.position.iter_mut().zip(&moved) {
        *x += *d;
    }
    moved
}
