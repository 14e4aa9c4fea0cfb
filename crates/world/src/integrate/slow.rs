//! Torque-free rotation that is slow within a step, by the series of Euler's equations (theory chapter 2). With L = I w constant and
//! axes that stand still, those at the step's start: w' = a = -I^-1 (w x L), w'' = b = w x a + I^-1 (w x (w x L)) -
//! I^-1 (a x L), so that after h the spin is w + a h + b h^2/2, and the rotation vector over h is that of the mean spin
//! w + a h/2 + (b/6 + (a x w)/12) h^2 (Magnus' second term). What is left out is of the third order of w h.

use crate::bodies::Bodies;
use carom_geometry::Geometry;
use carom_math::{Column, Rotation};

/// Turns within a step below which the third order is rounding \[rad\].
const SLOW: f64 = 1e-5;

/// The mean of a body's free spin over a time `h` \[s\], whose rotation vector is that times `h`, and the spin at its end \[rad/s\];
/// none where it turns too far for that.
#[inline]
pub fn slow_rotation<S: Geometry>(bodies: &Bodies<S>, i: usize, h: f64) -> Option<(S::Spin, S::Spin)> {
    let spin = bodies.motion.angular_velocity[i];
    (S::SPIN == 3 && spin.norm() * h < SLOW).then(|| series(bodies, i, h))
}

fn series<S: Geometry>(bodies: &Bodies<S>, i: usize, h: f64) -> (S::Spin, S::Spin) {
    let (d, rotation) = (&bodies.data[i], &bodies.motion.rotation[i]);
    let principal = d.axes.unrotate_spin(rotation.unrotate_spin(bodies.motion.angular_velocity[i]));
    let (w, inertia) = (numbers(principal), numbers(d.principal));
    let through = |m: [f64; 3]| [0, 1, 2].map(|k| m[k] / inertia[k]);
    let momentum = [0, 1, 2].map(|k| inertia[k] * w[k]);
    let torque = cross(w, momentum);
    let a = through(torque).map(|x| -x);
    let (turning, along, after) = (cross(w, a), through(cross(w, torque)), through(cross(a, momentum)));
    let b = [0, 1, 2].map(|k| turning[k] + along[k] - after[k]);
    let mean = [0, 1, 2].map(|k| w[k] + h * (0.5 * a[k] + h * (b[k] / 6.0 - turning[k] / 12.0)));
    let end = [0, 1, 2].map(|k| w[k] + h * (a[k] + 0.5 * h * b[k]));
    let to_world = |x: [f64; 3]| rotation.rotate_spin(d.axes.rotate_spin(S::Spin::from_fn(|k| x[k])));
    (to_world(mean), to_world(end))
}

fn numbers<C: Column>(column: C) -> [f64; 3] {
    [0, 1, 2].map(|k| column.as_slice().get(k).copied().unwrap_or_default())
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::splitting::split_rotation;
    use crate::{BodySpec, SpatialShape};
    use carom_math::{Quaternion, Spatial, vec3};

    /// By how much the series misses rotation vector and spin of many small steps, as shares of the spin.
    fn errors(h: f64, steps: usize) -> [f64; 2] {
        let brick = BodySpec::heavy(SpatialShape::Box { size: [0.2, 0.5, 1.0] }, 2.0);
        let turned = Quaternion::about(vec3(0.3, -0.4, 0.5));
        let mut bodies = Bodies::<Spatial>::default();
        bodies.add("brick", brick.turned(turned).spinning(vec3(0.6, 0.8, -0.5))).unwrap();
        let (mean, end) = series(&bodies, 0, h);
        for _ in 0..steps {
            split_rotation(&mut bodies, 0, h / steps as f64);
        }
        let exact = turned.inverse().then(&bodies.motion.rotation[0]).vector() * (1.0 / h);
        [(mean - exact).norm(), (end - bodies.motion.angular_velocity[0]).norm()]
    }

    #[test]
    fn what_the_series_leaves_out_is_of_the_third_order() {
        let (large, small) = (errors(0.04, 100), errors(0.02, 100));
        for (large, small) in large.into_iter().zip(small) {
            assert!(large < 1e-4 && (6.0..10.0).contains(&(large / small)), "{large} {small}");
        }
        // the attitude's rounding over 9e-6 s
        assert!(errors(1e-5 / 1.1, 2).iter().all(|error| *error < 1e-10));
    }
}
