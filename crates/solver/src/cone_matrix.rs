//! Norms of the small blocks of a contact matrix. Knows no contacts.

/// Spectral norm of a D x D block (D at most 3) stored row by row: the root of the largest eigenvalue of B^T B.
pub fn spectral_norm<const D: usize>(block: &[f64]) -> f64 {
    if D == 1 {
        return block[0].abs();
    }
    let gram = |i: usize, j: usize| {
        let inside = i < D && j < D;
        if inside { (0..D).map(|k| block[k * D + i] * block[k * D + j]).sum::<f64>() } else { 0.0 }
    };
    if D == 2 {
        let (a, b, c) = (gram(0, 0), gram(1, 1), gram(0, 1));
        return (0.5 * (a + b) + (0.25 * (a - b) * (a - b) + c * c).sqrt()).sqrt();
    }
    let (diagonal, off) = ([gram(0, 0), gram(1, 1), gram(2, 2)], [gram(0, 1), gram(0, 2), gram(1, 2)]);
    largest_eigenvalue(diagonal, off).max(0.0).sqrt()
}

/// The same, and 1 for a block of zeros: what a velocity is divided by to be an impulse.
pub fn norm_or_one<const D: usize>(block: &[f64]) -> f64 {
    let norm = spectral_norm::<D>(block);
    if norm > 0.0 { norm } else { 1.0 }
}

/// The largest eigenvalue of a symmetric 3 x 3 matrix with entries (0, 1), (0, 2), (1, 2) off the diagonal: with mean
/// m, spread p and h = det((A - m) / p) / 2 the eigenvalues are m + p t for the roots of t^3 - 3 t = 2 h (Smith 1961). That is
/// accurate for the eigenvalue that stands apart: the largest for h >= 0, else the smallest, and then the other two are those of A
/// across its direction.
fn largest_eigenvalue(diagonal: [f64; 3], off: [f64; 3]) -> f64 {
    let mean = (diagonal[0] + diagonal[1] + diagonal[2]) / 3.0;
    let [x, y, z] = diagonal.map(|d| d - mean);
    let [a, b, c] = off;
    let spread = ((x * x + y * y + z * z + 2.0 * (a * a + b * b + c * c)) / 6.0).sqrt();
    if spread <= 1e-16 * mean.abs() || spread.is_nan() {
        return mean;
    }
    let scale = 1.0 / spread;
    let [x, y, z, a, b, c] = [x * scale, y * scale, z * scale, a * scale, b * scale, c * scale];
    let half = 0.5 * (x * (y * z - c * c) - a * (a * z - c * b) + b * (a * c - y * b));
    let apart = root_apart(half.abs().min(1.0));
    if half >= 0.0 {
        return mean + spread * apart;
    }
    mean + spread * across([[x, a, b], [a, y, c], [b, c, z]], -apart)
}

/// The root of t^3 - 3 t = 2 h above 1, 0 <= h <= 1: it goes from the root of 3 to 2 nearly straight, so that a parabola through
/// its ends, with its slope at the first, is off by .0034, and three of Newton's steps leave nothing.
#[inline]
fn root_apart(h: f64) -> f64 {
    const FIRST: f64 = 1.732_050_807_568_877_2;
    let mut t = FIRST + h * (1.0 / 3.0 - h * (FIRST - 5.0 / 3.0));
    for _ in 0..3 {
        let squared = t * t;
        t -= (t * (squared - 3.0) - 2.0 * h) / (3.0 * (squared - 1.0));
    }
    t
}

fn dot(u: [f64; 3], v: [f64; 3]) -> f64 {
    u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
}

fn cross(u: [f64; 3], v: [f64; 3]) -> [f64; 3] {
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

/// The larger eigenvalue of A across the direction of its simple eigenvalue `apart`.
fn across(matrix: [[f64; 3]; 3], apart: f64) -> f64 {
    let mut rows = matrix;
    (0..3).for_each(|k| rows[k][k] -= apart);
    let normals = [cross(rows[0], rows[1]), cross(rows[1], rows[2]), cross(rows[2], rows[0])];
    let longest =
        normals.into_iter().fold(normals[0], |best, n| if dot(n, n) > dot(best, best) { n } else { best });
    let unit = |v: [f64; 3]| v.map(|x| x / dot(v, v).sqrt());
    let direction = unit(longest);
    let k = if direction[0].abs() < 0.6 { 0 } else { 1 };
    let first = unit(cross(direction, std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 })));
    let second = cross(direction, first);
    let times = |v: [f64; 3]| matrix.map(|row| dot(row, v));
    let (p, q, r) = (dot(first, times(first)), dot(second, times(second)), dot(first, times(second)));
    0.5 * (p + q) + (0.25 * (p - q) * (p - q) + r * r).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use carom_math::Sym3;

    /// Numbers in \[-1, 1\] from a linear congruence.
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    #[test]
    fn the_largest_eigenvalue_is_that_of_the_full_decomposition() {
        let mut next = numbers(7);
        for case in 0..2000 {
            // double roots at either end among them, and scales over twenty decades
            let scale = 10.0_f64.powi(case % 21 - 10);
            let mut diagonal = [next(), next(), next()].map(|x| x * scale);
            let mut off =
                [next(), next(), next()].map(|x| x * scale * if case % 3 == 0 { 1e-9 } else { 1.0 });
            if case % 5 == 0 {
                diagonal = [diagonal[0], diagonal[0], diagonal[1]];
                off = [0.0; 3];
            }
            let expected = Sym3 { diagonal, off }.eigen().0.into_iter().fold(f64::NEG_INFINITY, f64::max);
            let found = largest_eigenvalue(diagonal, off);
            assert!((found - expected).abs() <= 4e-15 * scale, "{diagonal:?} {off:?}: {found} {expected}");
        }
    }
}
