//! The linear complementarity problem w = M z + q, 0 <= w _|_ z >= 0, by Lemke's method with a lexicographic
//! ratio test against cycling (theory eqs. 5.28 and 5.30; Cottle, Pang and Stone 2009, chapter 4). Dense;
//! knows nothing of contact. Rows and columns are scaled by powers of two first, so that light and heavy
//! bodies count alike, and the last basic solution is refined against the caller's own product M z + q.

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

/// Entries of the scaled tableau below this share of their column are rounding, not pivots.
const NO_PIVOT: f64 = 1e-12;
/// What rounding leaves in a scaled tableau's right-hand side: ratios closer than this are ties.
const NOISE: f64 = 1e-13;
/// A basic solution with an error below this is accepted at once.
const ACCURATE: f64 = 1e-12;
/// The largest error that still counts as a solution when no attempt was accurate.
const TOLERABLE: f64 = 1e-9;

/// What the caller knows of its problem beyond M and q.
pub struct Judge<'a> {
    /// M z + q, formed as accurately as the caller can.
    pub slack: &'a dyn Fn(&[f64]) -> Vec<f64>,
    /// How wrong z is, relative to what its entries do one by one \[1\].
    pub error: &'a dyn Fn(&[f64]) -> f64,
}

/// Tableau of w - M z - d z0 = q: columns w | z | z0 | q, one row per basic variable. The columns of w hold the
/// inverse of the basis.
struct Tableau {
    n: usize,
    width: usize,
    cells: Vec<f64>,
    /// Basic variable of each row: w_i = i, z_i = n + i, z0 = 2n.
    basis: Vec<usize>,
    pivot_row: Vec<f64>,
}

impl Tableau {
    fn new(m: &[Vec<f64>], q: &[f64], cover: &[f64]) -> Self {
        let n = q.len();
        let width = 2 * n + 2;
        let mut cells = vec![0.0; n * width];
        for (i, row) in cells.chunks_exact_mut(width).enumerate() {
            row[i] = 1.0;
            row[n..2 * n].iter_mut().zip(&m[i]).for_each(|(cell, x)| *cell = -x);
            row[2 * n] = -cover[i];
            row[2 * n + 1] = q[i];
        }
        Tableau { n, width, cells, basis: (0..n).collect(), pivot_row: Vec::new() }
    }
    fn at(&self, row: usize, column: usize) -> f64 {
        self.cells[row * self.width + column]
    }
    /// Value of the basic variable of a row.
    fn value(&self, row: usize) -> f64 {
        self.at(row, self.width - 1)
    }

    fn pivot(&mut self, r: usize, column: usize) {
        let row = &mut self.cells[r * self.width..(r + 1) * self.width];
        let p = 1.0 / row[column];
        row.iter_mut().for_each(|x| *x *= p);
        row[column] = 1.0;
        self.pivot_row.clear();
        self.pivot_row.extend_from_slice(row);
        for (i, row) in self.cells.chunks_exact_mut(self.width).enumerate() {
            let factor = row[column];
            if i != r && factor != 0.0 {
                row.iter_mut().zip(&self.pivot_row).for_each(|(x, y)| *x -= factor * y);
                row[column] = 0.0;
            }
        }
        self.basis[r] = column;
    }

    /// The same basis reached again from a fresh tableau by elimination with the largest pivots, which sheds the
    /// rounding that the path has gathered.
    fn refreshed(&self, mut fresh: Tableau) -> Tableau {
        let mut free = vec![true; self.n];
        let (slacks, others): (Vec<usize>, Vec<usize>) = self.basis.iter().partition(|&&b| b < self.n);
        slacks.iter().for_each(|&b| free[b] = false); // w_i is basic in row i already
        for column in others {
            let largest = (0..self.n)
                .filter(|&r| free[r])
                .max_by(|&r, &s| fresh.at(r, column).abs().total_cmp(&fresh.at(s, column).abs()))
                .expect("as many rows as basic variables");
            fresh.pivot(largest, column);
            free[largest] = false;
        }
        fresh
    }

    /// The row that leaves: least ratio q/a over a > 0, ties broken by the rows of the inverse basis (the w
    /// columns), lexicographically; z0 leaves as soon as it may, for then the problem is solved.
    fn leaving(&self, column: usize) -> Option<usize> {
        let largest = (0..self.n).map(|r| self.at(r, column).abs()).fold(0.0, f64::max);
        let floor = NO_PIVOT * largest.max(NO_PIVOT);
        let mut tied: Vec<usize> = (0..self.n).filter(|&r| self.at(r, column) > floor).collect();
        for k in std::iter::once(self.width - 1).chain(0..self.n) {
            let ratio = |r: usize| self.at(r, k) / self.at(r, column);
            let least = tied.iter().map(|&r| ratio(r)).fold(f64::INFINITY, f64::min);
            let blur = |r: usize| NOISE * (1.0 / self.at(r, column) + 10.0 * least.abs());
            tied.retain(|&r| ratio(r) <= least + blur(r));
            if let Some(&z0) = tied.iter().find(|&&r| self.basis[r] == 2 * self.n) {
                return Some(z0);
            }
            if tied.len() <= 1 {
                break;
            }
        }
        // rows that rounding cannot tell apart: the largest pivot is the safest
        tied.into_iter().max_by(|&r, &s| self.at(r, column).total_cmp(&self.at(s, column)))
    }
}

/// One run along Lemke's path; `refresh` pivots apart the tableau is built anew.
fn path(
    m: &[Vec<f64>],
    q: &[f64],
    cover: &[f64],
    most_pivots: usize,
    refresh: usize,
) -> (LcpEnd, Tableau, usize) {
    let n = q.len();
    let mut t = Tableau::new(m, q, cover);
    let need = |i: usize| q[i] / cover[i];
    let first = (0..n).min_by(|&i, &j| need(i).total_cmp(&need(j))).unwrap_or(0);
    t.pivot(first, 2 * n);
    let mut entering = n + first; // the complement of w_first
    for pivots in 1..most_pivots {
        let Some(r) = t.leaving(entering) else {
            return (LcpEnd::Ray, t, pivots);
        };
        let left = t.basis[r];
        t.pivot(r, entering);
        if left == 2 * n {
            return (LcpEnd::Solved, t, pivots);
        }
        if pivots % refresh == 0 {
            t = t.refreshed(Tableau::new(m, q, cover));
        }
        entering = if left < n { left + n } else { left - n };
    }
    (LcpEnd::OutOfPivots, t, most_pivots)
}

/// The basic solution of a tableau, refined: with x the basic values and B the basis, x += B^-1 (q - B x),
/// where q - B x = (M z + q) - w is formed from the caller's product.
fn basic_solution(t: &Tableau, slack: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let n = t.n;
    let mut x: Vec<f64> = (0..n).map(|r| t.value(r)).collect();
    let mut best = (f64::INFINITY, Vec::new());
    for _ in 0..4 {
        let mut z = vec![0.0; n];
        let mut w = vec![0.0; n];
        for (&b, &value) in t.basis.iter().zip(&x) {
            if b < n {
                w[b] = value
            } else if b < 2 * n {
                z[b - n] = value
            }
        }
        let error: Vec<f64> = slack(&z).iter().zip(&w).map(|(s, w)| s - w).collect();
        let size = error.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
        if size.is_nan() || size >= best.0 {
            break;
        }
        best = (size, z);
        for (r, value) in x.iter_mut().enumerate() {
            let inverse = &t.cells[r * t.width..r * t.width + n];
            *value += inverse.iter().zip(&error).map(|(b, e)| b * e).sum::<f64>();
        }
    }
    let (_, mut z) = best;
    z.resize(n, 0.0);
    z.iter_mut().for_each(|z| *z = z.max(0.0));
    z
}

/// The power of two at or below a positive number; 1 for zero and for what is too small or large to scale by.
fn power(x: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    if (1e-250..1e250).contains(&x) { f64::from_bits(x.to_bits() & EXPONENT) } else { 1.0 }
}

/// Powers of two d_i that bring the diagonal of D M D near one; a row without diagonal (a friction limit, a bound)
/// takes the size of its partners.
fn scales(m: &[Vec<f64>]) -> Vec<f64> {
    let n = m.len();
    let mut d: Vec<f64> =
        (0..n).map(|i| if m[i][i] != 0.0 { power(1.0 / m[i][i].abs().sqrt()) } else { 0.0 }).collect();
    let known = d.clone();
    for i in (0..n).filter(|&i| known[i] == 0.0) {
        let partner = (0..n).map(|j| (m[i][j].abs().max(m[j][i].abs())) * known[j]).fold(0.0, f64::max);
        d[i] = power(1.0 / partner);
    }
    d
}

/// Solves an LCP; returns how it ended, z, and the pivots spent.
pub fn solve_lcp(m: &[Vec<f64>], q: &[f64], most_pivots: usize) -> (LcpEnd, Vec<f64>, usize) {
    let terms = |row: &[f64], z: &[f64]| row.iter().zip(z).map(|(a, z)| a * z).sum::<f64>();
    let slack = |z: &[f64]| -> Vec<f64> { m.iter().zip(q).map(|(row, q)| terms(row, z) + q).collect() };
    let error = |z: &[f64]| {
        let mut worst: (f64, f64) = (0.0, f64::MIN_POSITIVE);
        for (i, (w, z_i)) in slack(z).iter().zip(z).enumerate() {
            let size = m[i].iter().zip(z).map(|(a, z)| (a * z).abs()).sum::<f64>() + q[i].abs();
            // without a diagonal z_i and w_i have no common unit: the plain difference has to do
            let own = if m[i][i] > 0.0 { z_i * m[i][i] } else { *z_i };
            let wrong = if w.is_nan() || own.is_nan() { f64::INFINITY } else { own.min(*w).abs() };
            worst = (worst.0.max(wrong), worst.1.max(size));
        }
        worst.0 / worst.1
    };
    solve_lcp_with(m, q, &Judge { slack: &slack, error: &error }, most_pivots)
}

/// The same with M z + q formed and answers judged by the caller.
pub fn solve_lcp_with(
    m: &[Vec<f64>],
    q: &[f64],
    judge: &Judge,
    most_pivots: usize,
) -> (LcpEnd, Vec<f64>, usize) {
    let n = q.len();
    if q.iter().all(|&x| x >= 0.0) {
        return (LcpEnd::Solved, vec![0.0; n], 0);
    }
    let d = scales(m);
    let largest = q.iter().zip(&d).fold(0.0, |m: f64, (q, d)| m.max((q * d).abs()));
    if !largest.is_finite() {
        return (LcpEnd::Ray, vec![0.0; n], 0);
    }
    let unit = power(largest); // z = unit d z', w = unit w' / d
    let scaled_m: Vec<Vec<f64>> =
        m.iter().zip(&d).map(|(row, di)| row.iter().zip(&d).map(|(x, dj)| x * di * dj).collect()).collect();
    let scaled_q: Vec<f64> = q.iter().zip(&d).map(|(q, d)| q * d / unit).collect();
    let unscaled = |z: &[f64]| -> Vec<f64> { z.iter().zip(&d).map(|(z, d)| z * d * unit).collect() };
    let slack = |z: &[f64]| -> Vec<f64> {
        (judge.slack)(&unscaled(z)).iter().zip(&d).map(|(w, d)| w * d / unit).collect()
    };
    let error = |z: &[f64]| (judge.error)(&unscaled(z));
    let (end, z, pivots) =
        attempts(&scaled_m, &scaled_q, &Judge { slack: &slack, error: &error }, most_pivots);
    (end, unscaled(&z), pivots)
}

/// The plain path first; then with the tableau rebuilt often; then along other covering vectors, which lead
/// past most degeneracies and rays. The first accurate solution is taken, else the best.
fn attempts(m: &[Vec<f64>], q: &[f64], judge: &Judge, most_pivots: usize) -> (LcpEnd, Vec<f64>, usize) {
    let n = q.len();
    let (mut spent, mut first_end) = (0, None);
    let mut best = (f64::INFINITY, vec![0.0; n]);
    for attempt in 0..4 {
        let refresh = if attempt == 0 { most_pivots } else { (n / 4).max(20) };
        // attempts 2 and 3: positive numbers without structure, the fractional parts of k * golden ratio
        let spread = if attempt < 2 { 0.0 } else { attempt as f64 };
        let cover: Vec<f64> =
            (1..=n).map(|k| 1.0 + spread * (k as f64 * 0.618_033_988_749_895).fract()).collect();
        let (end, tableau, pivots) = path(m, q, &cover, most_pivots, refresh);
        spent += pivots;
        first_end.get_or_insert(end);
        if end == LcpEnd::Solved {
            let z = basic_solution(&tableau, judge.slack);
            let error = (judge.error)(&z);
            if error < best.0 {
                best = (error, z);
            }
            if best.0 <= ACCURATE {
                break;
            }
        }
    }
    let end = match first_end {
        _ if best.0 <= TOLERABLE => LcpEnd::Solved,
        Some(LcpEnd::Ray) => LcpEnd::Ray,
        _ => LcpEnd::OutOfPivots,
    };
    (end, best.1, spent)
}
