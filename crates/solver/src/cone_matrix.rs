//! Norms of the small blocks of a contact matrix. Knows no contacts.

use carom_math::Sym3;

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
    let squared =
        Sym3 { diagonal: [gram(0, 0), gram(1, 1), gram(2, 2)], off: [gram(0, 1), gram(0, 2), gram(1, 2)] };
    squared.eigen().0.into_iter().fold(0.0, f64::max).sqrt()
}
