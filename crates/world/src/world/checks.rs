//! What a step refuses: a length, a motion or a load that is no number, and fixed bodies that shall move.

use super::World;
use super::standing::Written;
use crate::bodies::BodyData;
use crate::body::BodyKind;
use crate::error::StepError;
use crate::impact;
use carom_geometry::Geometry;
use carom_math::{Column, Pose, Rotation};
use carom_solver::Twist;

impl<S: Geometry> World<S> {
    pub(super) fn check_before(&self, dt: f64, as_before: bool) -> Result<(), StepError> {
        if !(dt > 0.0 && dt.is_finite()) {
            let remedy = "give a step length in s".to_string();
            return Err(StepError::Argument {
                field: "dt",
                problem: format!("must be > 0, got {dt}"),
                remedy,
            });
        }
        let (stage, remedy) = ("before the step", "set it to finite numbers");
        if as_before {
            // those that stand were looked at when they came to, and all others after the last step
            if self.written > Written::Nothing {
                let mut looked_at = self.bodies.movers().iter().chain(self.bodies.asleep());
                looked_at.try_for_each(|i| self.check_body(*i as usize, stage, remedy))?;
            }
        } else {
            (0..self.bodies.len()).try_for_each(|i| self.check_body(i, stage, remedy))?;
            self.check_fixed()?;
        }
        impact::check(&self.bodies, &self.settings)?;
        if !self.is_applied {
            return Ok(());
        }
        let bad = self.applied.iter().position(|w| !w.is_finite());
        bad.map_or(Ok(()), |i| {
            let value = format!("{:?}", self.applied[i].force.as_slice());
            Err(self.not_finite(
                i,
                "applied force or torque",
                value,
                "before the step",
                "apply finite numbers",
            ))
        })
    }

    /// Fixed bodies rest, whatever was written into their velocities.
    fn check_fixed(&self) -> Result<(), StepError> {
        let m = &self.bodies.motion;
        for i in (0..self.bodies.len()).filter(|&i| self.bodies.data[i].kind == BodyKind::Fixed) {
            let parts: [(&'static str, &[f64]); 2] = [
                ("velocity", m.velocity[i].as_slice()),
                ("angular_velocity", m.angular_velocity[i].as_slice()),
            ];
            for (field, values) in parts {
                if values.iter().any(|x| *x != 0.0) {
                    let (body, value) = (self.bodies.names[i].clone(), format!("{values:?}"));
                    let remedy = "make it a kinematic body, or leave its velocities alone".into();
                    return Err(StepError::FixedMoves { body, field, value, remedy, time: self.time });
                }
            }
        }
        Ok(())
    }

    pub(super) fn check_after(&self) -> Result<(), StepError> {
        let remedy = "look for extreme velocities, masses or forces, or take a smaller dt";
        self.bodies.movers().iter().try_for_each(|i| self.check_body(*i as usize, "after the step", remedy))
    }

    fn check_body(&self, i: usize, stage: &'static str, remedy: &str) -> Result<(), StepError> {
        let m = &self.bodies.motion;
        let (data, twist) = (&self.bodies.data[i], m.twist(i));
        if data.is_far_from_infinite((&m.pose(i), &twist)) {
            return Ok(());
        }
        let parts: [(&'static str, &[f64]); 4] = [
            ("position", m.position[i].as_slice()),
            ("rotation", m.rotation[i].as_slice()),
            ("velocity", m.velocity[i].as_slice()),
            ("angular_velocity", m.angular_velocity[i].as_slice()),
        ];
        for (field, values) in parts {
            if !values.iter().all(|x| x.is_finite())
                || (field == "rotation" && values.iter().all(|x| *x == 0.0))
            {
                return Err(self.not_finite(i, field, format!("{values:?}"), stage, remedy));
            }
        }
        if data.most_energy(&twist) < 1e300 {
            return Ok(());
        }
        let energy = self.bodies.translational_energy(i) + self.bodies.rotational_energy(i);
        if !energy.is_finite() {
            return Err(self.not_finite(i, "kinetic energy", format!("{energy}"), stage, remedy));
        }
        Ok(())
    }

    fn not_finite(
        &self,
        i: usize,
        field: &'static str,
        value: String,
        stage: &'static str,
        remedy: &str,
    ) -> StepError {
        let body = self.bodies.names[i].clone();
        StepError::NotFinite { body, field, value, stage, remedy: remedy.into(), time: self.time }
    }
}

impl<S: Geometry> BodyData<S> {
    /// What twice its kinetic energy is at most, if it moved so \[J\].
    fn most_energy(&self, Twist { linear, angular }: &Twist<S>) -> f64 {
        self.mass_properties.mass * linear.dot(*linear) + self.principal.max_abs() * angular.dot(*angular)
    }

    /// Whether all its numbers, and their squares, which sums over bodies have, are far from infinite, if it moved so: enough to be
    /// content with, and not asked of every body. False for what is no number, and for a rotation that is none.
    #[inline]
    pub(crate) fn is_far_from_infinite(&self, (pose, twist): (&Pose<S>, &Twist<S>)) -> bool {
        let turn: f64 = pose.rotation.as_slice().iter().map(|x| x * x).sum();
        let speeds = twist.linear.dot(twist.linear) + twist.angular.dot(twist.angular);
        turn > 0.0 && self.most_energy(twist) + pose.position.norm_squared() + speeds + turn < 1e300
    }
}
