//! What a patch gave in a step, as one wrench about the mean of its points: as it was solved, not shared out among them.

use super::face::Face;
use super::patches::rolling_axis;
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::Twist;
use carom_solver::soft::PatchResult;

/// Impulses of a patch on body a; b gets the opposite.
pub(super) struct Given<S: Geometry> {
    /// Mean of the points \[m\].
    centre: S::Vector,
    /// Impulse \[N s\].
    impulse: S::Vector,
    /// Its moment about the centre, with that of friction about the normal and of rolling friction \[N m s\].
    moment: S::Spin,
}

impl<S: Geometry> Given<S> {
    /// From a face, and its patch's impulses along the normal and across it.
    pub fn of(face: &Face<S>, result: &PatchResult<S>) -> Self {
        let (spots, normal) = (&face.spots, face.spots.normal);
        let centre = spots.centre();
        let (mut impulse, mut moment) = (S::Vector::ZERO, S::Spin::ZERO);
        for i in 0..face.len() {
            let pressed = normal * f64::from(result.normal[i]);
            impulse += pressed;
            moment += S::moment(spots.points[i] - centre, pressed);
        }
        for k in 0..S::SLIP {
            impulse += S::tangent(normal, k) * f64::from(result.rubbing[k]);
            moment += rolling_axis::<S>(normal, k) * f64::from(result.rolling[k]);
        }
        if S::SPIN > S::SLIP {
            let about = f64::from(result.rubbing[S::SLIP]);
            moment += S::Spin::from_fn(|c| normal[c] * about);
        }
        Given { centre, impulse, moment }
    }

    /// Its work along a motion of a body whose centre of mass is at a place \[J\].
    pub fn work(&self, place: S::Vector, twist: &Twist<S>) -> f64 {
        self.impulse.dot(twist.at(self.centre - place)) + self.moment.dot(twist.angular)
    }
}
