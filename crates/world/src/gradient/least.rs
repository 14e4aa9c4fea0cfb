//! Least-squares solutions of least norm by Householder's QR with column pivoting, on both sides: where contacts are
//! redundant the equations of a step are singular, and what is left undetermined are impulses that move nothing.
//! Dense: about 4/3 n^3 operations for n equations. Knows no contacts.

/// Share of the largest pivot below which a row says nothing new \[1\].
const RANK: f64 = 1e-10;
/// Rounds of scaling by rows and columns.
const SCALINGS: usize = 3;

/// The reflection 1 - beta v v^T, v zero above `first`.
struct Mirror {
    first: usize,
    v: Vec<f64>,
    beta: f64,
}

impl Mirror {
    /// The mirror that makes a column zero below `first`, and what stands at `first` then.
    fn of(column: &[f64], first: usize) -> (Self, f64) {
        let mut v = vec![0.0; column.len()];
        v[first..].copy_from_slice(&column[first..]);
        let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let head = if v[first] > 0.0 { -norm } else { norm };
        v[first] -= head;
        let square = v.iter().map(|x| x * x).sum::<f64>();
        let beta = if square > 0.0 { 2.0 / square } else { 0.0 };
        (Mirror { first, v, beta }, head)
    }
    fn apply(&self, x: &mut [f64]) {
        let along: f64 = self.v[self.first..].iter().zip(&x[self.first..]).map(|(v, x)| v * x).sum();
        let k = self.beta * along;
        for (x, v) in x[self.first..].iter_mut().zip(&self.v[self.first..]) {
            *x -= k * v;
        }
    }
}

/// A factored square matrix A, for A^T x = b.
pub struct Transposed {
    /// Reflections of A^T's columns, and the triangle they leave, column by column.
    left: Vec<Mirror>,
    triangle: Vec<Vec<f64>>,
    /// Rows of A in the order in which they were taken.
    order: Vec<usize>,
    /// Reflections of the triangle's rows where it is wider than high, and the triangle they leave, row by row.
    right: Vec<Mirror>,
    narrow: Vec<Vec<f64>>,
    row_scale: Vec<f64>,
    column_scale: Vec<f64>,
}

impl Transposed {
    /// Factors a matrix given row by row.
    pub fn of(mut a: Vec<Vec<f64>>) -> Self {
        let n = a.len();
        let (row_scale, column_scale) = scale(&mut a);
        // columns of A^T are the rows of A
        let mut triangle = a;
        let mut order: Vec<usize> = (0..n).collect();
        let mut left: Vec<Mirror> = Vec::with_capacity(n);
        let mut largest = 0.0;
        for k in 0..n {
            let size = |c: &[f64]| c[k..].iter().map(|x| x * x).sum::<f64>();
            let best = (k..n).max_by(|&i, &j| size(&triangle[i]).total_cmp(&size(&triangle[j]))).unwrap_or(k);
            triangle.swap(k, best);
            order.swap(k, best);
            let norm = size(&triangle[k]).sqrt();
            largest = f64::max(largest, norm);
            if norm <= RANK * largest {
                break;
            }
            let (mirror, head) = Mirror::of(&triangle[k], k);
            for c in &mut triangle[k + 1..] {
                mirror.apply(c);
            }
            triangle[k][k] = head;
            triangle[k][k + 1..].fill(0.0);
            left.push(mirror);
        }
        let (right, narrow) = narrowed(&triangle, left.len());
        Transposed { left, triangle, order, right, narrow, row_scale, column_scale }
    }

    /// The x of least norm with |A^T x - b| least, in the scales of rows and columns.
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let (n, rank) = (b.len(), self.left.len());
        let mut y: Vec<f64> = b.iter().zip(&self.column_scale).map(|(b, s)| b * s).collect();
        self.left.iter().for_each(|m| m.apply(&mut y));
        let mut z = vec![0.0; n];
        if rank == n {
            for i in (0..n).rev() {
                let known: f64 = (i + 1..n).map(|j| self.triangle[j][i] * z[j]).sum();
                z[i] = (y[i] - known) / self.triangle[i][i];
            }
        } else {
            for i in 0..rank {
                let known: f64 = (0..i).map(|j| self.narrow[i][j] * z[j]).sum();
                z[i] = (y[i] - known) / self.narrow[i][i];
            }
            self.right.iter().rev().for_each(|m| m.apply(&mut z));
        }
        let mut x = vec![0.0; n];
        for (z, &row) in z.iter().zip(&self.order) {
            x[row] = z * self.row_scale[row];
        }
        x
    }
}

/// The first `rank` rows of a triangle given by columns, made a triangle themselves by reflections from the right.
fn narrowed(triangle: &[Vec<f64>], rank: usize) -> (Vec<Mirror>, Vec<Vec<f64>>) {
    let n = triangle.len();
    if rank == n {
        return (Vec::new(), Vec::new());
    }
    let mut rows: Vec<Vec<f64>> = (0..rank).map(|i| triangle.iter().map(|c| c[i]).collect()).collect();
    let mut right = Vec::with_capacity(rank);
    for k in 0..rank {
        let (mirror, head) = Mirror::of(&rows[k], k);
        for r in &mut rows[k + 1..] {
            mirror.apply(r);
        }
        rows[k][k] = head;
        right.push(mirror);
    }
    (right, rows)
}

/// Makes rows and columns of about the same size, and says by which factors: masses and lengths do not decide then
/// which rows count as dependent.
fn scale(a: &mut [Vec<f64>]) -> (Vec<f64>, Vec<f64>) {
    let n = a.len();
    let (mut rows, mut columns) = (vec![1.0; n], vec![1.0; n]);
    let factor = |largest: f64| if largest > 0.0 { 1.0 / largest.sqrt() } else { 1.0 };
    for _ in 0..SCALINGS {
        for (row, scale) in a.iter_mut().zip(&mut rows) {
            let k = factor(row.iter().fold(0.0, |m: f64, x| m.max(x.abs())));
            row.iter_mut().for_each(|x| *x *= k);
            *scale *= k;
        }
        for (j, scale) in columns.iter_mut().enumerate() {
            let k = factor(a.iter().fold(0.0, |m: f64, row| m.max(row[j].abs())));
            a.iter_mut().for_each(|row| row[j] *= k);
            *scale *= k;
        }
    }
    (rows, columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transposed_times(a: &[Vec<f64>], x: &[f64]) -> Vec<f64> {
        (0..x.len()).map(|j| a.iter().zip(x).map(|(row, x)| row[j] * x).sum()).collect()
    }

    #[test]
    fn a_regular_matrix_is_solved() {
        let a = vec![vec![2.0, 1e3, 0.0], vec![0.0, 3e-3, 1.0], vec![-1.0, 0.5, 4e2]];
        let x = [0.3, -0.7, 1.1];
        let b = transposed_times(&a, &x);
        let found = Transposed::of(a).solve(&b);
        assert!(x.iter().zip(&found).all(|(x, f)| (x - f).abs() < 1e-12), "{found:?}");
    }

    #[test]
    fn a_singular_matrix_gives_a_solution_where_there_is_one_and_shares_it_among_equal_rows() {
        // the last two rows are the same equation
        let a = vec![vec![1.0, 2.0, 2.0], vec![3.0, 1.0, 1.0], vec![3.0, 1.0, 1.0]];
        let b = transposed_times(&a, &[0.5, 0.25, 0.75]);
        let found = Transposed::of(a.clone()).solve(&b);
        let again = transposed_times(&a, &found);
        assert!(b.iter().zip(&again).all(|(x, f)| (x - f).abs() < 1e-13), "{again:?}");
        assert!((found[1] - found[2]).abs() < 1e-13 && (found[1] - 0.5).abs() < 1e-13, "{found:?}");
    }
}
