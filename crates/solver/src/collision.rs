//! One collision, piece by piece (theory eqs. 3.1 to 3.13, items 16-19): test, offsets, effective mass, impulse,
//! linear and angular response. The five steps of the notes' recap, for body against body and for body against
//! obstacle (an obstacle has zero inverse masses, a particle zero inverse inertia). Knows no shapes: the point,
//! the normal and the gap come from whoever detects.

use crate::problem::{InverseMass, Twist};
use carom_math::{Column, Inertia, Space};

/// Step 1, after detection: bodies collide when they touch and approach (theory eq. 3.2). Without this test a pair
/// that separates already would be pulled together.
pub fn collides(gap: f64, normal_velocity: f64) -> bool {
    gap <= 0.0 && normal_velocity < 0.0
}

/// Step 2: offset of the contact point from a centre of mass, r = x - x_c \[m\].
pub fn offset<S: Space>(point: S::Vector, center: S::Vector) -> S::Vector {
    point - center
}

/// Velocity of a's point relative to b's along the normal \[m/s\]; < 0 when they approach.
pub fn normal_velocity<S: Space>(
    normal: S::Vector,
    (velocity_a, arm_a): (&Twist<S>, S::Vector),
    (velocity_b, arm_b): (&Twist<S>, S::Vector),
) -> f64 {
    normal.dot(velocity_a.at(arm_a) - velocity_b.at(arm_b))
}

/// Step 3: effective mass along a unit direction \[kg\],
/// 1/m_eff = 1/m_a + 1/m_b + (r_a x n)^T I_a^-1 (r_a x n) + (r_b x n)^T I_b^-1 (r_b x n).
/// Infinite when neither body can move.
pub fn effective_mass<S: Space>(
    direction: S::Vector,
    (mass_a, arm_a): (&InverseMass<S>, S::Vector),
    (mass_b, arm_b): (&InverseMass<S>, S::Vector),
) -> f64 {
    let (ma, mb) = (S::moment(arm_a, direction), S::moment(arm_b, direction));
    let turning = ma.dot(mass_a.angular.apply(ma)) + mb.dot(mass_b.angular.apply(mb));
    1.0 / (mass_a.linear + mass_b.linear + turning)
}

/// Step 3: impulse of an isolated collision \[N s\], gamma = -(1 + c_r) m_eff u_n, and none for contacts that
/// do not approach.
pub fn normal_impulse(normal_velocity: f64, restitution: f64, effective_mass: f64) -> f64 {
    if normal_velocity < 0.0 { -(1.0 + restitution) * effective_mass * normal_velocity } else { 0.0 }
}

/// Step 4: v + m^-1 j.
pub fn linear_response<S: Space>(
    velocity: S::Vector,
    mass: &InverseMass<S>,
    impulse: S::Vector,
) -> S::Vector {
    velocity + impulse * mass.linear
}

/// Step 5: w + I^-1 (r x j).
pub fn angular_response<S: Space>(
    spin: S::Spin,
    mass: &InverseMass<S>,
    arm: S::Vector,
    impulse: S::Vector,
) -> S::Spin {
    spin + mass.angular.apply(S::moment(arm, impulse))
}

/// Steps 4 and 5 together: an impulse at a point of a body (item 16).
pub fn apply_impulse<S: Space>(
    velocity: &Twist<S>,
    mass: &InverseMass<S>,
    arm: S::Vector,
    impulse: S::Vector,
) -> Twist<S> {
    Twist {
        linear: linear_response(velocity.linear, mass, impulse),
        angular: angular_response::<S>(velocity.angular, mass, arm, impulse),
    }
}

/// Steps 2 to 5 for two bodies: new velocities of a and b, and the impulse gamma.
pub fn collide<S: Space>(
    (a, mass_a, arm_a): (&Twist<S>, &InverseMass<S>, S::Vector),
    (b, mass_b, arm_b): (&Twist<S>, &InverseMass<S>, S::Vector),
    normal: S::Vector,
    restitution: f64,
) -> (Twist<S>, Twist<S>, f64) {
    let speed = normal_velocity(normal, (a, arm_a), (b, arm_b));
    let mass = effective_mass(normal, (mass_a, arm_a), (mass_b, arm_b));
    if !mass.is_finite() {
        return (*a, *b, 0.0);
    }
    let gamma = normal_impulse(speed, restitution, mass);
    let impulse = normal * gamma;
    (apply_impulse(a, mass_a, arm_a, impulse), apply_impulse(b, mass_b, arm_b, -impulse), gamma)
}

/// Kinetic energy lost by one frictionless collision: 1/2 m_eff (1 - c_r^2) u_n^2 \[J\] (theory chapter 3).
pub fn energy_lost(normal_velocity: f64, restitution: f64, effective_mass: f64) -> f64 {
    if normal_velocity < 0.0 {
        0.5 * effective_mass * (1.0 - restitution * restitution) * normal_velocity * normal_velocity
    } else {
        0.0
    }
}
