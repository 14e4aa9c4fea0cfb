//! The linear complementarity problem w = M z + q, 0 <= w _|_ z >= 0, by Lemke's method with a lexicographic
//! ratio test against cycling (Cottle, Pang and Stone, chapter 4). Dense; knows nothing of contact.

/// How the pivoting ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LcpEnd {
    /// z solves the problem.
    Solved,
    /// The method ended on a secondary ray.
    Ray,
    /// The pivots are spent.
    OutOfPivots,
}

/// Tableau of w - M z - d z0 = q: columns w | z | z0 | q, one row per basic variable.
struct Tableau {
    n: usize,
    rows: Vec<Vec<f64>>,
    /// Basic variable of each row: w_i = i, z_i = n + i, z0 = 2n.
    basis: Vec<usize>,
}

impl Tableau {
    fn pivot(&mut self, r: usize, column: usize) {
        let p = 1.0 / self.rows[r][column];
        for x in &mut self.rows[r] {
            *x *= p;
        }
        self.rows[r][column] = 1.0;
        let pivot_row = std::mem::take(&mut self.rows[r]);
        for row in self.rows.iter_mut().filter(|row| !row.is_empty()) {
            let factor = row[column];
            if factor != 0.0 {
                for (x, y) in row.iter_mut().zip(&pivot_row) {
                    *x -= factor * y;
                }
                row[column] = 0.0;
            }
        }
        self.rows[r] = pivot_row;
        self.basis[r] = column;
    }

    /// The row that leaves: least ratio q/a over a > 0, ties broken by the rows of the inverse basis (the w
    /// columns), lexicographically; z0 leaves as soon as it may, for then the problem is solved.
    fn leaving(&self, column: usize) -> Option<usize> {
        let scale = self.rows.iter().map(|row| row[column].abs()).fold(0.0, f64::max);
        let candidates = (0..self.n).filter(|&r| self.rows[r][column] > 1e-12 * scale.max(1e-300));
        let mut best: Option<usize> = None;
        for r in candidates {
            best = Some(match best {
                None => r,
                Some(b) => self.lexicographic_least(b, r, column),
            });
        }
        let best = best?;
        let ratio = |r: usize| self.rows[r][2 * self.n + 1] / self.rows[r][column];
        let z0 = self.basis.iter().position(|&b| b == 2 * self.n);
        match z0 {
            Some(r) if self.rows[r][column] > 1e-12 * scale && ratio(r) <= ratio(best) * (1.0 + 1e-12) + 1e-300 => Some(r),
            _ => Some(best),
        }
    }

    fn lexicographic_least(&self, a: usize, b: usize, column: usize) -> usize {
        let (pa, pb) = (self.rows[a][column], self.rows[b][column]);
        let order = std::iter::once(2 * self.n + 1).chain(0..self.n);
        for k in order {
            let (x, y) = (self.rows[a][k] / pa, self.rows[b][k] / pb);
            if (x - y).abs() > 1e-13 * (x.abs() + y.abs()) {
                return if x < y { a } else { b };
            }
        }
        a.min(b)
    }
}

/// Solves an LCP; returns how it ended, z, and the pivots spent.
pub fn solve_lcp(m: &[Vec<f64>], q: &[f64], most_pivots: usize) -> (LcpEnd, Vec<f64>, usize) {
    let n = q.len();
    if q.iter().all(|&x| x >= 0.0) {
        return (LcpEnd::Solved, vec![0.0; n], 0);
    }
    // rows scaled to their diagonal, so that the covering vector treats light and heavy bodies alike
    let cover: Vec<f64> = (0..n).map(|i| if m[i][i] > 0.0 { m[i][i] } else { 1.0 }).collect();
    let mut t = Tableau { n, rows: Vec::with_capacity(n), basis: (0..n).collect() };
    for i in 0..n {
        let mut row = vec![0.0; 2 * n + 2];
        row[i] = 1.0;
        for j in 0..n {
            row[n + j] = -m[i][j];
        }
        row[2 * n] = -cover[i];
        row[2 * n + 1] = q[i];
        t.rows.push(row);
    }
    let first = (0..n).min_by(|&i, &j| (q[i] / cover[i]).total_cmp(&(q[j] / cover[j]))).expect("n > 0");
    t.pivot(first, 2 * n);
    let mut entering = n + first; // the complement of w_first
    for pivots in 1..most_pivots {
        let Some(r) = t.leaving(entering) else {
            return (LcpEnd::Ray, vec![0.0; n], pivots);
        };
        let left = t.basis[r];
        t.pivot(r, entering);
        if left == 2 * n {
            return (LcpEnd::Solved, basic_solution(&t), pivots);
        }
        entering = if left < n { left + n } else { left - n };
    }
    (LcpEnd::OutOfPivots, vec![0.0; n], most_pivots)
}

fn basic_solution(t: &Tableau) -> Vec<f64> {
    let mut z = vec![0.0; t.n];
    for (row, &b) in t.rows.iter().zip(&t.basis) {
        if (t.n..2 * t.n).contains(&b) {
            z[b - t.n] = row[2 * t.n + 1].max(0.0);
        }
    }
    z
}
