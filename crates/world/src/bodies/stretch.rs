//! The motion of a stretch of bodies, so that workers write it where it lies, each its own. What it does not do: decide who moves.

use super::Motion;
use carom_math::workers::Cut;
use carom_math::{Pose, Space};
use carom_solver::Twist;

/// The motion of some bodies one after another.
pub(crate) struct MotionStretch<'a, S: Space> {
    /// The first of them.
    first: usize,
    position: &'a mut [S::Vector],
    rotation: &'a mut [S::Rotation],
    velocity: &'a mut [S::Vector],
    angular_velocity: &'a mut [S::Spin],
}

impl<S: Space> Motion<S> {
    /// The motion of all bodies, to be cut.
    pub(crate) fn stretch(&mut self) -> MotionStretch<'_, S> {
        let Motion { position, rotation, velocity, angular_velocity } = self;
        MotionStretch { first: 0, position, rotation, velocity, angular_velocity }
    }
}

impl<S: Space> MotionStretch<'_, S> {
    /// Position and orientation of a body.
    #[inline]
    pub fn pose(&self, i: usize) -> Pose<S> {
        Pose::new(self.position[i - self.first], self.rotation[i - self.first])
    }
    /// Velocity and angular velocity of a body.
    #[inline]
    pub fn twist(&self, i: usize) -> Twist<S> {
        Twist::new(self.velocity[i - self.first], self.angular_velocity[i - self.first])
    }
    /// Sets position and orientation of a body.
    #[inline]
    pub fn set_pose(&mut self, i: usize, pose: &Pose<S>) {
        (self.position[i - self.first], self.rotation[i - self.first]) = (pose.position, pose.rotation);
    }
    /// Sets velocity and angular velocity of a body.
    #[inline]
    pub fn set_twist(&mut self, i: usize, twist: &Twist<S>) {
        (self.velocity[i - self.first], self.angular_velocity[i - self.first]) =
            (twist.linear, twist.angular);
    }
}

impl<S: Space> Cut for MotionStretch<'_, S> {
    fn cut_behind(self, item: usize) -> (Self, Self) {
        let count = item + 1 - self.first;
        let (position, positions) = self.position.split_at_mut(count);
        let (rotation, rotations) = self.rotation.split_at_mut(count);
        let (velocity, velocities) = self.velocity.split_at_mut(count);
        let (angular_velocity, others) = self.angular_velocity.split_at_mut(count);
        (
            MotionStretch { first: self.first, position, rotation, velocity, angular_velocity },
            MotionStretch {
                first: item + 1,
                position: positions,
                rotation: rotations,
                velocity: velocities,
                angular_velocity: others,
            },
        )
    }
}
