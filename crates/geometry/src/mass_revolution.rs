//! Moments of bodies of revolution about z from their profile r(z), run upwards (theory chapter 1):
//!   V = pi int r^2 dz,   int z = pi int z r^2 dz,   int z^2 = pi int z^2 r^2 dz,
//!   int x^2 = int y^2 = pi/4 int r^4 dz,
//! over straight lines (polynomials) and circular arcs r = a + R cos p, z = b + R sin p, dz = R cos p dp
//! (powers of cosine). Exact to rounding. Knows no density.

use crate::mass_moments::Moments;
use carom_math::vec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// A piece of a profile, from lower to higher z. Lengths in metres, angles in radians from the outward radius.
enum Profile {
    /// Straight from (r, z) to (r, z).
    Line([f64; 2], [f64; 2]),
    /// Arc of `radius` about (r, z) between two angles.
    Arc { center: [f64; 2], radius: f64, from: f64, to: f64 },
}

/// Moments \[V, int z, int z^2, int x^2\] / pi of one piece.
fn piece(profile: &Profile) -> [f64; 4] {
    match *profile {
        Profile::Line(from, to) => line(from, to),
        Profile::Arc { center, radius, from, to } => arc(center, radius, from, to),
    }
}

/// The integrals over a line, where int_0^1 (1-t)^m t^n dt = m! n! / (m + n + 1)!.
fn line([r, z]: [f64; 2], [q, y]: [f64; 2]) -> [f64; 4] {
    let rise = y - z;
    let (rr, rq, qq) = (r * r, r * q, q * q);
    let volume = (rr + rq + qq) / 3.0;
    let first = (z * (3.0 * rr + 2.0 * rq + qq) + y * (rr + 2.0 * rq + 3.0 * qq)) / 12.0;
    let second = (z * z * (6.0 * rr + 3.0 * rq + qq)
        + z * y * (3.0 * rr + 4.0 * rq + 3.0 * qq)
        + y * y * (rr + 3.0 * rq + 6.0 * qq))
        / 30.0;
    let across = (rr * rr + rr * rq + rr * qq + rq * qq + qq * qq) / 20.0;
    [volume, first, second, across].map(|x| x * rise)
}

/// The integrals over an arc; c\[n\] = int cos^n, and int cos^n sin = -cos^(n+1)/(n+1), sin^2 = 1 - cos^2.
fn arc([a, b]: [f64; 2], radius: f64, from: f64, to: f64) -> [f64; 4] {
    let ((s0, c0), (s1, c1)) = (libm::sincos(from), libm::sincos(to));
    let mut c = [to - from, s1 - s0, 0.0, 0.0, 0.0, 0.0];
    for n in 2..6 {
        let boundary = c1.powi(n as i32 - 1) * s1 - c0.powi(n as i32 - 1) * s0;
        c[n] = (boundary + (n as f64 - 1.0) * c[n - 2]) / n as f64;
    }
    let with_sine = |n: i32| (c0.powi(n + 1) - c1.powi(n + 1)) / f64::from(n + 1);
    let with_sine_squared = |n: usize| c[n] - c[n + 2];
    let (r, rr) = (radius, radius * radius);
    // r^2 dz = (a^2 cos + 2 a R cos^2 + R^2 cos^3) R dp
    let weights = [a * a * r, 2.0 * a * rr, rr * r];
    let over = |f: &dyn Fn(usize) -> f64| (0..3).map(|i| weights[i] * f(i + 1)).sum::<f64>();
    let volume = over(&|n| c[n]);
    let sine = over(&|n| with_sine(n as i32));
    let sine_squared = over(&with_sine_squared);
    let first = b * volume + r * sine;
    let second = b * b * volume + 2.0 * b * r * sine + rr * sine_squared;
    // r^4 dz with the binomial coefficients of (a + R cos)^4
    let across = r
        * (a.powi(4) * c[1]
            + 4.0 * a.powi(3) * r * c[2]
            + 6.0 * a * a * rr * c[3]
            + 4.0 * a * rr * r * c[4]
            + rr * rr * c[5]);
    [volume, first, second, 0.25 * across]
}

/// Moments about (0, 0, `height`) from the sums over pieces measured from there.
fn assembled([volume, first, second, across]: [f64; 4], height: f64) -> Moments<3> {
    Moments {
        origin: vec3(0.0, 0.0, height),
        measure: PI * volume,
        first: vec3(0.0, 0.0, PI * first),
        second: [[PI * across, 0.0, 0.0], [0.0, PI * across, 0.0], [0.0, 0.0, PI * second]],
    }
}

/// Sums of the pieces' integrals.
fn summed(profile: &[Profile]) -> [f64; 4] {
    profile.iter().map(piece).fold([0.0; 4], |sum, p| std::array::from_fn(|i| sum[i] + p[i]))
}

/// Cylinder along z about the origin, swept by a ball of `rounding` (which may be zero).
pub(crate) fn round_cylinder_moments(height: f64, radius: f64, rounding: f64) -> Moments<3> {
    let (top, outer) = (0.5 * height, radius + rounding);
    let upper = summed(&[
        Profile::Line([outer, 0.0], [outer, top]),
        Profile::Arc { center: [radius, top], radius: rounding, from: 0.0, to: FRAC_PI_2 },
    ]);
    // the lower half mirrors the upper one: the first moment cancels exactly
    assembled([2.0 * upper[0], 0.0, 2.0 * upper[2], 2.0 * upper[3]], 0.0)
}

/// Cone along z, base at -height/2, apex at +height/2, swept by a ball of `rounding` (which may be zero),
/// about a point near its centroid.
pub(crate) fn round_cone_moments(height: f64, radius: f64, rounding: f64) -> Moments<3> {
    let about = |origin: f64| {
        let (base, apex) = (-0.5 * height - origin, 0.5 * height - origin);
        // angle of the slant's outward normal above the base plane
        let slope = libm::atan2(radius, height);
        let (s, c) = libm::sincos(slope);
        let (lift, reach) = (rounding * s, rounding * c);
        let sums = summed(&[
            Profile::Arc { center: [radius, base], radius: rounding, from: -FRAC_PI_2, to: slope },
            Profile::Line([radius + reach, base + lift], [reach, apex + lift]),
            Profile::Arc { center: [0.0, apex], radius: rounding, from: slope, to: FRAC_PI_2 },
        ]);
        assembled(sums, origin)
    };
    let rough = about(-0.25 * height);
    about(rough.center()[2])
}
