//! A system of four unknowns by the minors of its halves (Laplace's expansion along pairs of rows): it waits for no pivots.

/// Unknowns.
pub const FOUR: usize = 4;
/// Pairs of columns; the k-th from the front and from the back are all four.
const PAIRS: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
/// The sign of a pair before the others in a determinant.
const SIGNS: [f64; 6] = [1.0, -1.0, 1.0, 1.0, -1.0, 1.0];

/// x of M x = b, M by rows; where M is singular there are numbers that are none, or huge. What cancels is not mended.
#[inline(always)]
pub fn four_unknowns([a, b, c, d]: &[[f64; FOUR]; FOUR], right: &[f64; FOUR]) -> [f64; FOUR] {
    let (above, below) = (minors(a, b), minors(c, d));
    let determinant: f64 = (0..6).map(|k| SIGNS[k] * above[k] * below[5 - k]).sum();
    let inverse = 1.0 / determinant;
    // rows in which the right-hand sides cancel: x is across them
    let upper = across(&mixed((a, right[1]), (b, right[0])), &below);
    let lower = across(&mixed((c, right[3]), (d, right[2])), &above);
    std::array::from_fn(|i| (upper[i] + lower[i]) * inverse)
}

/// Of two rows, for every pair of columns.
#[inline(always)]
fn minors(a: &[f64; FOUR], b: &[f64; FOUR]) -> [f64; 6] {
    std::array::from_fn(|k| a[PAIRS[k].0] * b[PAIRS[k].1] - a[PAIRS[k].1] * b[PAIRS[k].0])
}

/// The second row times its number less the first times its own.
#[inline(always)]
fn mixed((a, over_a): (&[f64; FOUR], f64), (b, over_b): (&[f64; FOUR], f64)) -> [f64; FOUR] {
    std::array::from_fn(|i| b[i] * over_b - a[i] * over_a)
}

/// The cofactors of a row in front of two rows with these minors.
#[inline(always)]
fn across(row: &[f64; FOUR], minors: &[f64; 6]) -> [f64; FOUR] {
    let ([p, q, r, s], [m01, m02, m03, m12, m13, m23]) = (*row, *minors);
    [
        q * m23 - r * m13 + s * m12,
        r * m03 - p * m23 - s * m02,
        p * m13 - q * m03 + s * m01,
        q * m02 - p * m12 - r * m01,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_put_together_is_found() {
        let m = [[0.0, 2.0, -1.0, 3.0], [1.0, 0.5, 0.0, -2.0], [4.0, -1.0, 1.0, 0.0], [0.0, 0.0, 7.0, 1.0]];
        let x = [3.0, -1.0, 0.25, 2.0];
        let right = m.map(|row| row.iter().zip(&x).map(|(m, x)| m * x).sum());
        for (found, x) in four_unknowns(&m, &right).iter().zip(&x) {
            assert!((found - x).abs() < 1e-13, "{found} is not {x}");
        }
        let twice = [m[0], m[1], m[0], m[3]];
        assert!(four_unknowns(&twice, &[1.0, 2.0, 3.0, 4.0]).iter().any(|x| !x.is_finite()));
    }
}
