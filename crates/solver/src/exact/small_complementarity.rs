//! Complementarity problems of a few unknowns on the stack: Gauss-Seidel sweeps, which are enough where few impulses
//! press on each other; up to four contacts that all press, as those of a body at rest do; then Lemke's path in a condensed
//! tableau. What is degenerate is left to more careful ways.

use super::four_unknowns::{FOUR, four_unknowns};
use super::local::plus;
use super::operator::Matrix;
use crate::friction_problem::larger;
use crate::registers::in_fours;
use pulp::{Simd, WithSimd};

/// Most unknowns.
pub const LARGEST: usize = 8;
/// Sweeps before pivots: one costs less than one of them.
const SWEEPS: usize = 2;
/// Pivots below this share of their column, and ratios closer than this, are left to others.
const DOUBTFUL: f64 = 1e-10;

/// M by rows, q and its size, for N unknowns: where there are fewer, those of the rest have ones on the diagonal and are not pushed.
struct Small<const N: usize> {
    rows: [[f64; N]; N],
    q: [f64; N],
    size: f64,
}

/// z >= 0, w = M z + q >= 0, z.w = 0 to the tolerance, in terms of |q|; the name of what found z, which begins as zeros and
/// has room for the most unknowns, and its rounds. `None`, with anything in z, where neither does.
pub fn solved(m: &Matrix, q: &[f64], tolerance: f64, z: &mut [f64]) -> Option<(&'static str, usize)> {
    if q.iter().all(|q| *q >= 0.0) {
        return Some(("sweeps", 0));
    }
    match q.len() {
        ..=4 => in_fours(Solved::<4, 4, 6>(m, q, tolerance, z.first_chunk_mut()?)),
        5..=6 => in_fours(Solved::<6, 8, 8>(m, q, tolerance, z.first_chunk_mut()?)),
        _ => in_fours(Solved::<8, 8, 10>(m, q, tolerance, z.first_chunk_mut()?)),
    }
}

/// The same for at most N unknowns; the tableau has N + 2 = C columns of R >= N numbers.
struct Solved<'a, const N: usize, const R: usize, const C: usize>(
    &'a Matrix,
    &'a [f64],
    f64,
    &'a mut [f64; N],
);

impl<const N: usize, const R: usize, const C: usize> WithSimd for Solved<'_, N, R, C> {
    type Output = Option<(&'static str, usize)>;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let Solved(m, q, tolerance, z) = self;
        let small = Small::<N>::of(m, q);
        let fused = S::F64_LANES == 4;
        let swept =
            if fused { small.swept::<true>(tolerance, z) } else { small.swept::<false>(tolerance, z) };
        if let Some(rounds) = swept {
            return Some(("sweeps", rounds));
        }
        if small.all_press(q.len(), tolerance, z) {
            return Some(("pivots", 1));
        }
        Some(("pivots", small.along_path::<R, C>(z)?))
    }
}

impl<const N: usize> Small<N> {
    #[inline(always)]
    fn of(matrix: &Matrix, velocity: &[f64]) -> Self {
        let n = velocity.len().min(N);
        let (mut rows, mut q) = ([[0.0; N]; N], [0.0; N]);
        let (full, _) = matrix.values.as_chunks::<N>();
        if let (Ok(velocity), true) = (<[f64; N]>::try_from(velocity), matrix.graph.neighbours.len() == N * N)
        {
            q = velocity;
            (0..N).for_each(|i| rows[i] = full[i]);
            return Small { rows, q, size: size_of(&q) };
        }
        q[..n].copy_from_slice(&velocity[..n]);
        let size = size_of(&q);
        for i in 0..n {
            let (others, values) = matrix.row(i);
            others.iter().zip(values).for_each(|(&j, x)| rows[i][j as usize] = *x);
        }
        (n..N).for_each(|i| (rows[i][i], q[i]) = (1.0, size));
        Small { rows, q, size }
    }
    /// Sweeps from zero; how many were enough.
    #[inline(always)]
    fn swept<const FUSED: bool>(&self, tolerance: f64, z: &mut [f64; N]) -> Option<usize> {
        if !(0..N).all(|i| self.rows[i][i] > 0.0) {
            return None;
        }
        let (mut inverse, mut columns) = ([0.0; N], [[0.0; N]; N]);
        for i in 0..N {
            inverse[i] = 1.0 / self.rows[i][i];
            (0..N).for_each(|j| columns[j][i] = self.rows[i][j]);
        }
        let mut w = self.q;
        for sweep in 1..=SWEEPS {
            for k in 0..N {
                // back and forth, so that the order of the unknowns does not matter
                let i = if sweep % 2 == 0 { k } else { N - 1 - k };
                let next = larger(0.0, plus::<FUSED>(-w[i], inverse[i], z[i]));
                let moved = next - z[i];
                z[i] = next;
                (0..N).for_each(|j| w[j] = plus::<FUSED>(columns[i][j], moved, w[j]));
            }
            let mut squared = 0.0;
            for i in 0..N {
                let weight = z[i] * self.rows[i][i];
                let off = if w[i] < weight { w[i] } else { weight };
                squared += off * off;
            }
            let bound = 0.1 * tolerance * self.size;
            if squared <= bound * bound {
                return Some(sweep);
            }
        }
        None
    }
    /// The impulses that stop all of up to four contacts, the first so many of N; false where they are more, or not all press.
    #[inline(always)]
    fn all_press(&self, contacts: usize, tolerance: f64, z: &mut [f64; N]) -> bool {
        if N != FOUR {
            return false;
        }
        let (mut rows, mut right) = ([[0.0; FOUR]; FOUR], [0.0; FOUR]);
        for i in 0..FOUR.min(N) {
            (0..FOUR.min(N)).for_each(|j| rows[i][j] = self.rows[i][j]);
            right[i] = if i < contacts { -self.q[i] } else { 0.0 };
        }
        let found = four_unknowns(&rows, &right);
        let mut squared = 0.0;
        for (row, right) in rows.iter().zip(&right) {
            let off = row.iter().zip(&found).map(|(m, z)| m * z).sum::<f64>() - right;
            squared += off * off;
        }
        let bound = 0.1 * tolerance * self.size;
        let press = found.iter().all(|z| *z >= 0.0) && squared <= bound * bound;
        if press {
            z.iter_mut().zip(&found).for_each(|(z, found)| *z = *found);
        }
        press
    }
    /// Lemke's path: basic = columns (other variables, 1), of which all are zero but the one that enters.
    /// Variables: w_i = i, z_i = N + i, the covering one 2 N; its column is N, that of 1 is N + 1.
    #[inline(always)]
    fn along_path<const R: usize, const C: usize>(&self, z: &mut [f64; N]) -> Option<usize> {
        let mut columns = [[0.0; R]; C];
        // place of a variable that is not basic, by its number
        let mut place = [0_u8; 2 * LARGEST + 1];
        let (mut basic, mut other) = ([0_u8; N], [0_u8; C]);
        for i in 0..N {
            (0..N).for_each(|j| columns[j][i] = self.rows[i][j]);
            (columns[N][i], columns[N + 1][i]) = (COVER[i], self.q[i]);
            (basic[i], other[i], place[N + i]) = (i as u8, (N + i) as u8, i as u8);
        }
        (other[N], place[2 * N]) = (2 * N as u8, N as u8);
        let (mut leaving, mut least) = (0, f64::INFINITY);
        for i in 0..N {
            let need = self.q[i] * INVERSE_COVER[i];
            (leaving, least) = if need < least { (i, need) } else { (leaving, least) };
        }
        let cover = leaving;
        let (mut column, mut inverse) = (N, INVERSE_COVER[leaving]);
        for pivots in 1..=4 * N + 4 {
            exchange(&mut columns, (leaving, column), inverse);
            std::mem::swap(&mut basic[leaving], &mut other[column]);
            let left = other[column] as usize;
            place[left] = column as u8;
            if left == 2 * N {
                z.fill(0.0);
                for i in (0..N).filter(|&i| basic[i] as usize >= N) {
                    z[basic[i] as usize - N] = columns[N + 1][i];
                }
                return (0..N).all(|i| columns[N + 1][i] >= 0.0).then_some(pivots);
            }
            column = place[if left < N { left + N } else { left - N }] as usize;
            (leaving, inverse) = row_to_leave(&columns[column], &columns[N + 1], cover)?;
        }
        None
    }
}

/// A covering vector that ties no two rows of one kind: one plus fractional parts of multiples of the golden ratio.
const COVER: [f64; LARGEST] = [1.618, 1.236, 1.854, 1.472, 1.090, 1.708, 1.326, 1.944];
/// One over it.
const INVERSE_COVER: [f64; LARGEST] = {
    let mut inverse = [0.0; LARGEST];
    let mut i = 0;
    while i < LARGEST {
        inverse[i] = 1.0 / COVER[i];
        i += 1;
    }
    inverse
};

#[inline(always)]
fn size_of<const N: usize>(q: &[f64; N]) -> f64 {
    q.iter().map(|q| q * q).sum::<f64>().sqrt()
}

/// Rows of the unit matrix.
static UNIT: [[f64; LARGEST]; LARGEST] = {
    let mut unit = [[0.0; LARGEST]; LARGEST];
    let mut i = 0;
    while i < LARGEST {
        unit[i][i] = 1.0;
        i += 1;
    }
    unit
};

/// The basic variable of a row and the variable of a column change places, `inverse` being one over their number.
#[inline(always)]
fn exchange<const R: usize, const C: usize>(
    columns: &mut [[f64; R]; C],
    (r, c): (usize, usize),
    inverse: f64,
) {
    // products with zeros and ones: numbers that are chosen one by one are no registers, and a number written alone is
    // waited for by the register that is read over it
    let (mut others, mut pivots) = ([0.0; R], columns[c]);
    for i in 0..R {
        others[i] = 1.0 - UNIT[r % LARGEST][i];
        pivots[i] = others[i] * pivots[i] + UNIT[r % LARGEST][i];
    }
    for column in columns.iter_mut() {
        let own = -column[r] * inverse;
        (0..R).for_each(|i| column[i] = others[i] * column[i] + pivots[i] * own);
    }
    (0..R).for_each(|i| columns[c][i] = pivots[i] * inverse);
}

/// The row whose variable first falls to zero as the column's grows, and one over its number there; `None` for a ray, and where two do at once, but
/// for the covering variable, which is in the row `cover`: it may always leave, and then the problem is solved.
#[inline(always)]
fn row_to_leave<const R: usize>(column: &[f64; R], ones: &[f64; R], cover: usize) -> Option<(usize, f64)> {
    let (mut sizes, mut inverses, mut ratios) = ([0.0; R], [0.0; R], [f64::INFINITY; R]);
    (0..R).for_each(|i| sizes[i] = column[i].abs());
    let largest = of_all(sizes, larger);
    for i in 0..R {
        inverses[i] = 1.0 / column[i];
        let falls = column[i] < -DOUBTFUL * largest;
        ratios[i] = if falls { -ones[i] * inverses[i] } else { f64::INFINITY };
    }
    let least = of_all(ratios, |a, b| if b < a { b } else { a });
    if least == f64::INFINITY {
        return None;
    }
    let close = least + DOUBTFUL * (least.abs() + 1.0 / largest);
    let near = (0..R).fold(0_u32, |near, i| near | u32::from(ratios[i] <= close) << i);
    let row = if near >> cover & 1 == 1 { cover } else { near.trailing_zeros() as usize };
    (row == cover || near.is_power_of_two()).then(|| (row, inverses[row]))
}

/// What is made of all numbers two by two, halves of them side by side.
#[inline(always)]
fn of_all<const R: usize>(mut numbers: [f64; R], two: impl Fn(f64, f64) -> f64) -> f64 {
    let mut half = R / 2;
    while half > 0 {
        (0..half).for_each(|i| numbers[i] = two(numbers[i], numbers[i + half]));
        half /= 2;
    }
    numbers[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::Graph;

    fn matrix(dense: &[&[f64]]) -> Matrix {
        let n = dense.len() as u32;
        let starts = (0..=n).map(|i| i * n).collect();
        let neighbours = (0..n * n).map(|k| k % n).collect();
        let graph = Graph::new(vec![1; n as usize], starts, neighbours);
        Matrix::new(graph, dense.concat())
    }

    fn check(dense: &[&[f64]], q: &[f64], how: &str) {
        let mut z = [0.0; LARGEST];
        let (name, _) = solved(&matrix(dense), q, 1e-12, &mut z).expect("it is solved");
        assert_eq!(name, how);
        for (i, row) in dense.iter().enumerate() {
            let w = row.iter().zip(&z).map(|(m, z)| m * z).sum::<f64>() + q[i];
            assert!(z[i] >= 0.0 && w >= -1e-12 && (z[i] * w).abs() < 1e-12, "{z:?}");
        }
    }

    #[test]
    fn what_presses_on_later_ones_alone_is_swept() {
        check(&[&[1.0, 0.0, 0.0], &[2.0, 1.0, 0.0], &[2.0, 2.0, 1.0]], &[-1.0, -3.0, -7.0], "sweeps");
    }

    #[test]
    fn what_presses_around_is_pivoted() {
        // Murty's cyclic P-matrix
        check(&[&[1.0, 2.0, 0.0], &[0.0, 1.0, 2.0], &[2.0, 0.0, 1.0]], &[-1.0, -1.0, -1.0], "pivots");
        // nothing is asked for
        check(&[&[0.0, 3.0], &[1.0, 0.0]], &[1.0, 0.0], "sweeps");
        // semidefinite with a zero on its diagonal (Cottle, Pang and Stone 2009)
        let m: &[&[f64]] = &[
            &[11.0, 0.0, 10.0, -1.0],
            &[0.0, 11.0, 10.0, -1.0],
            &[10.0, 10.0, 21.0, -1.0],
            &[1.0, 1.0, 1.0, 0.0],
        ];
        check(m, &[50.0, 50.0, 10.0, -6.0], "pivots");
    }

    #[test]
    fn contacts_that_all_press_are_one_system_and_others_are_not() {
        let chain: &[&[f64]] = &[&[2.0, -1.9, 0.0], &[-1.9, 4.0, -1.9], &[0.0, -1.9, 2.0]];
        let rounds = |m: &[&[f64]], q: &[f64]| {
            solved(&matrix(m), q, 1e-12, &mut [0.0; LARGEST]).map(|(name, rounds)| (name, rounds == 1))
        };
        check(chain, &[-1.0, 0.5, -2.0], "pivots");
        assert_eq!(rounds(chain, &[-1.0, 0.5, -2.0]), Some(("pivots", true)));
        // the last one opens
        let longer: &[&[f64]] = &[
            &[2.0, -1.9, 0.0, 0.0],
            &[-1.9, 4.0, -1.9, 0.0],
            &[0.0, -1.9, 4.0, -1.9],
            &[0.0, 0.0, -1.9, 4.0],
        ];
        check(longer, &[-1.0, -1.0, -2.0, 30.0], "pivots");
        assert_eq!(rounds(longer, &[-1.0, -1.0, -2.0, 30.0]), Some(("pivots", false)));
        // a beam on four supports carries itself in more ways than one: the system is singular
        let supports = [-3.0, -1.0, 1.5, 3.0];
        let beam = supports.map(|x| supports.map(|y| 1.0 + x * y));
        let (beam, q) = (beam.each_ref().map(|row| &row[..]), supports.map(|x| -1.0 - 0.2 * x));
        assert_ne!(rounds(&beam, &q), Some(("pivots", true)));
    }

    #[test]
    fn rays_and_ties_are_left_to_others() {
        let (mut z, m) = ([0.0; LARGEST], matrix(&[&[0.0, -1.0], &[-1.0, 0.0]]));
        assert!(solved(&m, &[-1.0, -2.0], 1e-12, &mut z).is_none());
        let tied: &[&[f64]] = &[&[0.0, 1.0, 1.0], &[1.0, 0.0, 1.0], &[-1.0, -1.0, 0.0]];
        assert!(solved(&matrix(tied), &[0.0, 0.0, -1.0], 1e-12, &mut [0.0; LARGEST]).is_none());
    }
}
