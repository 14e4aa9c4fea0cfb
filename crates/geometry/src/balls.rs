//! Contact of balls with balls and walls: closed forms, for both spaces. The general way gives the same to rounding and
//! takes ten times as long; balls are what heaps are made of.

use crate::collider::Collider;
use crate::geometry::ContactPoint;
use crate::kernel::{Kernel, Label, NONE, mix, scale};
use crate::wall::{Facing, Wall};
use carom_math::{Column, Pose, Rotation};

/// Distance of centres below which they have no direction, as a fraction of the scale \[1\].
const NO_DIRECTION: f64 = 1e-14;

/// A posed point swept by a ball of a radius \[m\].
pub(crate) struct Ball<'a, S: Kernel> {
    /// The core, a single point.
    pub core: &'a S::Core,
    /// That point in its own frame.
    pub point: S::Vector,
    pub radius: f64,
    pub pose: &'a Pose<S>,
}

impl<'a, S: Kernel> Ball<'a, S> {
    /// The ball that a core swept by a radius is, if it is one.
    pub fn of(core: &'a S::Core, radius: f64, pose: &'a Pose<S>) -> Option<Self> {
        S::only_point(core).map(|point| Ball { core, point, radius, pose })
    }

    /// From an origin \[m\] to the centre. The difference of positions comes first: far from the world's origin it is
    /// small, and the sum exact.
    fn center_from(&self, origin: S::Vector) -> S::Vector {
        let center = self.pose.position - origin;
        if self.point == S::Vector::ZERO { center } else { self.pose.rotation.rotate(self.point) + center }
    }
}

/// The contact of two balls, `None` beyond a margin \[m\]; nothing at all where their centres are one.
pub(crate) fn two_balls<S: Kernel>(a: &Ball<S>, b: &Ball<S>, margin: f64) -> Option<Option<ContactPoint<S>>> {
    let from = b.pose.position;
    let (center_a, center_b) = (a.center_from(from), b.center_from(from));
    // between balls about their frames' origins that distance is the scale
    let is_plain = a.point == S::Vector::ZERO && b.point == S::Vector::ZERO;
    let scale = || {
        let place = Pose::new(a.pose.position - b.pose.position, S::Rotation::IDENTITY);
        NO_DIRECTION * scale::<S>(a.core, b.core, &place)
    };
    let least = || if is_plain { 0.0 } else { scale() };
    between_balls((center_a - center_b, a.radius, b.radius), from + center_b, margin, least)
}

/// The same of balls about the origins of their frames, whose turns do not matter.
#[inline]
pub(crate) fn two_plain_balls<S: Kernel>(
    (place_a, radius_a): (S::Vector, f64),
    (place_b, radius_b): (S::Vector, f64),
    margin: f64,
) -> Option<Option<ContactPoint<S>>> {
    between_balls((place_a - place_b, radius_a, radius_b), place_b, margin, || 0.0)
}

/// The contact of two balls from the way between their centres, their radii and the second one's centre; nothing at all
/// where they are no farther apart than `least` says.
#[inline(always)]
fn between_balls<S: Kernel>(
    (between, radius_a, radius_b): (S::Vector, f64, f64),
    center_b: S::Vector,
    margin: f64,
    least: impl Fn() -> f64,
) -> Option<Option<ContactPoint<S>>> {
    let distance = between.norm();
    let gap = distance - (radius_a + radius_b);
    if gap > margin {
        return Some(None);
    }
    if distance <= least() {
        return None;
    }
    let normal = between * (1.0 / distance);
    // half-way between the surfaces
    let point = center_b + normal * (0.5 * (distance - (radius_a - radius_b)));
    let feature = mix(mix(0, 0), Label::vertices(0, 0).code());
    Some(Some(ContactPoint { feature, point, normal, gap, curvature: 0.0 }))
}

/// The contact of a ball and a wall, `None` beyond a margin \[m\]; `wall_is_a` turns the
/// normal round.
pub(crate) fn ball_on_wall<S: Kernel>(
    ball: &Ball<S>,
    wall: &Wall<S>,
    wall_is_a: bool,
    margin: f64,
) -> Option<ContactPoint<S>> {
    let center = ball.pose.position + ball.center_from(ball.pose.position);
    on_wall((ball.center_from(wall.origin()), center), ball.radius, (wall, wall_is_a), margin)
}

/// The same of a ball about the origin of its frame, whose turn does not matter; nothing where the other is no wall.
#[inline]
pub(crate) fn plain_ball_on_wall<S: Kernel>(
    (place, radius): (S::Vector, f64),
    (wall, pose): (&Collider<S>, &Pose<S>),
    wall_is_a: bool,
    margin: f64,
) -> Option<Option<ContactPoint<S>>> {
    let wall = Wall::of(&wall.form, pose)?;
    let ways = (place - wall.origin(), place + S::Vector::ZERO);
    Some(on_wall(ways, radius, (&wall, wall_is_a), margin))
}

/// The contact of a ball and a wall from the way to the ball's centre from the wall's origin, and that centre.
#[inline(always)]
fn on_wall<S: Kernel>(
    (offset, center): (S::Vector, S::Vector),
    radius: f64,
    (wall, wall_is_a): (&Wall<S>, bool),
    margin: f64,
) -> Option<ContactPoint<S>> {
    let Facing { gap, outward, curvature } = wall.facing(offset);
    let gap = gap - radius;
    if gap > margin {
        return None;
    }
    let point = center - outward * (radius + 0.5 * gap);
    let label = Label { a: [0, NONE], b: [NONE, NONE] };
    let normal = if wall_is_a { -outward } else { outward };
    Some(ContactPoint { feature: mix(0, label.code()), point, normal, gap, curvature })
}
