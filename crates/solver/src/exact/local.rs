//! One contact solved exactly, the others held: W_ii r_i + b = u with Coulomb's law (theory chapter 7). Take-off when
//! b_N >= 0; else eliminate r_N: with S the Schur complement of W_NN and g the slip at r_T = 0, stick is
//! r_T = -S^-1 g, and slip (S + alpha) r_T = -g with |r_T| = mu r_N, a scalar equation in alpha that is decreasing
//! between its ends, so a bracketed Newton iteration never fails.

use pulp::Simd;

/// What the solution of one contact needs of its diagonal block, made once.
#[derive(Clone, Copy, Debug)]
pub struct Local<const D: usize> {
    mu: f64,
    /// 1 / W_NN; 0 for a contact that no impulse moves.
    inverse: f64,
    /// W_NT / W_NN and W_TN.
    pulls: [f64; 2],
    /// The former in the eigenbasis below.
    turned_pulls: [f64; 2],
    pushed: [f64; 2],
    /// Entries (1, 1), (2, 2), (1, 2) of the inverse of the symmetric part of S; none where it is singular.
    stick: Option<[f64; 3]>,
    /// Those entries of the symmetric part itself.
    schur: [f64; 3],
    /// Half the difference of the entries of S off the diagonal.
    skew: f64,
    /// Eigenvalues of the symmetric part of S, the larger first, and the axis of the larger; the axis is none until the
    /// contact slips.
    values: [f64; 2],
    axis: [f64; 2],
    /// alpha of the last slip; 0 for none.
    alpha: f64,
}

/// Relative change of alpha below which t follows it to first order: what that leaves is squared, and the next sweep
/// goes on from there.
const CLOSE: f64 = 1e-3;
/// The same where none comes back: its square is rounding.
const CLOSEST: f64 = 1e-8;

/// Most solutions of a contact alone; corrections below this share of its impulse are the last: what an asymmetric block
/// leaves out is a small part of them.
const ROUNDS: usize = 8;
const SMALL: f64 = 1e-12;

impl<const D: usize> Local<D> {
    /// From the diagonal block and the coefficient of friction.
    pub fn new(w: &[[f64; D]; D], mu: f64) -> Self {
        let w = w.as_flattened();
        let inverse = if w[0] > 0.0 { 1.0 / w[0] } else { 0.0 };
        let mut local = Local {
            mu,
            inverse,
            pulls: [0.0; 2],
            turned_pulls: [0.0; 2],
            pushed: [0.0; 2],
            stick: None,
            schur: [0.0; 3],
            skew: 0.0,
            values: [0.0; 2],
            axis: [0.0; 2],
            alpha: 0.0,
        };
        let schur = |i: usize, j: usize| w[D * i + j] - w[D * i] * w[j] * inverse;
        if D > 1 {
            (local.pulls[0], local.pushed[0]) = (w[1] * inverse, w[D]);
        }
        if D == 2 {
            local.values[0] = schur(1, 1);
        }
        if D == 3 {
            (local.pulls[1], local.pushed[1]) = (w[2] * inverse, w[2 * D]);
            let (a, c, left, right) = (schur(1, 1), schur(2, 2), schur(1, 2), schur(2, 1));
            let h = 0.5 * (left + right);
            local.skew = 0.5 * (left - right);
            let determinant = a * c - h * h;
            if determinant > 1e-14 * (a * a + c * c) {
                let inverse = 1.0 / determinant;
                local.stick = Some([c * inverse, a * inverse, -h * inverse]);
            }
            local.schur = [a, c, h];
        }
        local
    }

    /// The impulse at velocity `b` without it; `old` is the impulse it has now, which stands in for the part of an
    /// asymmetric block that the eigenbasis leaves out.
    #[inline(always)]
    pub fn solve(&mut self, b: &[f64; D], old: &[f64; D]) -> [f64; D] {
        self.solve_by::<false, false, false>(b, old)
    }
    /// The same in less time where the last slip is near: sweeps over couplings, one after another, wait for it.
    #[inline(always)]
    pub fn solve_near<S: Simd>(&mut self, b: &[f64; D], old: &[f64; D]) -> [f64; D] {
        // registers of four are those of machines that multiply and add at once
        if S::F64_LANES == 4 {
            self.solve_by::<true, true, false>(b, old)
        } else {
            self.solve_by::<true, false, false>(b, old)
        }
    }
    /// The same where no sweep comes back: to rounding where the block is symmetric, else the part left out follows
    /// `old`, and this is repeated until it stands.
    #[inline(always)]
    pub fn solve_alone(&mut self, b: &[f64; D], old: &[f64; D]) -> [f64; D] {
        self.solve_by::<true, false, true>(b, old)
    }
    /// The impulse of a contact that no other presses on, at velocity `b` without it, and the solutions that it took.
    #[inline(always)]
    pub fn solve_only(&mut self, b: &[f64; D]) -> ([f64; D], usize) {
        let mut found = [0.0; D];
        let mut rounds = 0;
        while rounds < ROUNDS {
            let before = found;
            found = self.solve_alone(b, &before);
            rounds += 1;
            let stands = |k: usize| (found[k] - before[k]).abs() <= SMALL * found[0];
            if self.is_symmetric() || (0..D).all(stands) {
                break;
            }
        }
        (found, rounds)
    }
    /// An impulse that goes by a factor beyond the solution `found` from `old`, on the cone; open where either is.
    #[inline(always)]
    pub fn beyond(&self, found: &[f64; D], old: &[f64; D], factor: f64) -> [f64; D] {
        let mut r = [0.0; D];
        for k in 0..D {
            r[k] = old[k] + factor * (found[k] - old[k]);
        }
        if found[0] == 0.0 || r[0] < 0.0 {
            return [0.0; D];
        }
        let squared: f64 = r[1..].iter().map(|t| t * t).sum();
        let bound = self.mu * r[0];
        if squared > bound * bound {
            let scale = bound / squared.sqrt();
            r[1..].iter_mut().for_each(|t| *t *= scale);
        }
        r
    }
    /// True where one solution alone is the last.
    pub fn is_symmetric(&self) -> bool {
        // the larger eigenvalue is at least half of their sum
        self.skew.abs() <= 0.5 * f64::EPSILON * (self.schur[0] + self.schur[1])
    }

    #[inline(always)]
    fn solve_by<const QUICKLY: bool, const FUSED: bool, const ALONE: bool>(
        &mut self,
        b: &[f64; D],
        old: &[f64; D],
    ) -> [f64; D] {
        let mut r = [0.0; D];
        // a contact that no impulse moves (NaN included) is left alone
        if b[0] >= 0.0 || !(self.inverse > 0.0) {
            return r;
        }
        match D {
            1 => r[0] = -b[0] * self.inverse,
            2 => (r[0], r[1]) = self.in_the_plane([b[0], b[1]]),
            _ => {
                let found = self.in_space::<QUICKLY, FUSED, ALONE>([b[0], b[1], b[2]], [old[1], old[2]]);
                r.copy_from_slice(&found);
            }
        }
        r
    }

    #[inline(always)]
    fn in_the_plane(&self, b: [f64; 2]) -> (f64, f64) {
        let (mu, pull, schur) = (self.mu, self.pulls[0], self.values[0]);
        let free = -b[0] * self.inverse;
        let slip = b[1] + self.pushed[0] * free;
        if schur > 0.0 {
            let tangent = -slip / schur;
            let normal = free - pull * tangent;
            if normal >= 0.0 && tangent.abs() <= mu * normal {
                return (normal, tangent);
            }
        }
        let likely = if slip > 0.0 { -1.0 } else { 1.0 };
        for side in [likely, -likely] {
            let divisor = 1.0 + pull * mu * side;
            let normal = free / divisor;
            let tangent = side * mu * normal;
            if divisor > 0.0 && side * (schur * tangent + slip) <= 0.0 {
                return (normal, tangent);
            }
        }
        // jammed for both signs: friction that at least does not pull
        let side = if 1.0 + pull * mu * likely > 0.0 { likely } else { -likely };
        let normal = free / (1.0 + pull * mu * side);
        (normal, side * mu * normal)
    }

    #[inline(always)]
    fn in_space<const QUICKLY: bool, const FUSED: bool, const ALONE: bool>(
        &mut self,
        b: [f64; 3],
        old: [f64; 2],
    ) -> [f64; 3] {
        let (mu, pulls) = (self.mu, self.pulls);
        let free = -b[0] * self.inverse;
        if mu <= 0.0 {
            return [free, 0.0, 0.0];
        }
        let g = [
            plus::<FUSED>(self.pushed[0], free, plus::<FUSED>(self.skew, old[1], b[1])),
            plus::<FUSED>(self.pushed[1], free, plus::<FUSED>(-self.skew, old[0], b[2])),
        ];
        if let Some([a, c, h]) = self.stick {
            // of the opposite sign
            let tangent = [plus::<FUSED>(a, g[0], h * g[1]), plus::<FUSED>(c, g[1], h * g[0])];
            let normal = plus::<FUSED>(pulls[1], tangent[1], plus::<FUSED>(pulls[0], tangent[0], free));
            let squared = plus::<FUSED>(tangent[0], tangent[0], tangent[1] * tangent[1]);
            if normal >= 0.0 && squared <= mu * mu * normal * normal {
                return [normal, -tangent[0], -tangent[1]];
            }
        }
        if self.axis == [0.0; 2] {
            let [a, c, h] = self.schur;
            (self.values, self.axis) = eigen(a, c, h);
            self.turned_pulls = turned(self.axis, pulls);
        }
        let axis = self.axis;
        let (g, pulls) = (turned(axis, g), self.turned_pulls);
        let (values, alpha) = (self.values, &mut self.alpha);
        if ALONE && *alpha == 0.0 {
            *alpha = sharp_alpha(values, g, mu * free);
        }
        let quick =
            if QUICKLY { slipping_near::<FUSED, ALONE>(values, g, pulls, (free, mu), alpha) } else { None };
        let (normal, t) = match quick {
            Some(found) => found,
            None => slipping(values, g, pulls, (free, mu), (alpha, if ALONE { CLOSEST } else { CLOSE })),
        };
        [normal, axis[0] * t[0] - axis[1] * t[1], axis[1] * t[0] + axis[0] * t[1]]
    }
}

/// a b + c, rounded once where the machine does that in one instruction.
#[inline(always)]
pub(super) fn plus<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// A tangent in the basis that begins with this axis.
#[inline(always)]
fn turned(axis: [f64; 2], v: [f64; 2]) -> [f64; 2] {
    [axis[0] * v[0] + axis[1] * v[1], axis[0] * v[1] - axis[1] * v[0]]
}

/// Eigenvalues, larger first, of \[a h; h c\], and the unit axis of the larger.
fn eigen(a: f64, c: f64, h: f64) -> ([f64; 2], [f64; 2]) {
    let (mean, difference) = (0.5 * (a + c), 0.5 * (a - c));
    let radius = (difference * difference + h * h).sqrt();
    let values = [mean + radius, (mean - radius).max(0.0)];
    let axis = if difference >= 0.0 { [difference + radius, h] } else { [h, radius - difference] };
    let size = (axis[0] * axis[0] + axis[1] * axis[1]).sqrt();
    let inverse = 1.0 / size;
    let axis = if size > 0.0 { [axis[0] * inverse, axis[1] * inverse] } else { [1.0, 0.0] };
    (values, axis)
}

/// Steps that are tried before the bracketed ones.
const QUICK: usize = 6;
/// Change of alpha, as a share of what it is added to, that is small enough for them: sweeps come back before its
/// square matters.
const NEAR: f64 = 0.2;
/// The same where none comes back: t follows to second order, and the cube is rounding.
const LAST: f64 = 1e-5;
/// Most of alpha that a step takes away where it would take all: no slip has alpha = 0.
const MOST: f64 = 0.75;

/// Slip as below, by steps that wait for one division each and no root: with q = (mu n / |t|)^2 they are Newton's on
/// mu n / |t|, nearly linear in alpha, which is q's times 2 / (1 + q^-1/2), here (1 + 3 q) / (2 (1 + q)): the same to
/// second order. With p = (d_1 + alpha) (d_2 + alpha) all is in terms of T = p t and N = p n. `None` where they do not come near, with `last` as
/// close as they came.
#[inline(always)]
fn slipping_near<const FUSED: bool, const ALONE: bool>(
    d: [f64; 2],
    g: [f64; 2],
    coupling: [f64; 2],
    (free, mu): (f64, f64),
    last: &mut f64,
) -> Option<(f64, [f64; 2])> {
    let near = if ALONE { LAST } else { NEAR };
    let mut alpha = if *last > 0.0 { *last } else { first_alpha(d, g, mu * free) };
    for _ in 0..QUICK {
        let both = [d[1] + alpha, d[0] + alpha];
        let p = both[0] * both[1];
        let inverse = 1.0 / p;
        // of the opposite sign, as is `pull`
        let t = [g[0] * both[0], g[1] * both[1]];
        let pull = plus::<FUSED>(coupling[0], t[0], coupling[1] * t[1]);
        let normal = plus::<FUSED>(free, p, pull);
        let bound = mu * mu * normal;
        let (squared, limit) = (plus::<FUSED>(t[0], t[0], t[1] * t[1]), bound * normal);
        let excess = plus::<FUSED>(-bound, normal, squared);
        let turns = [t[0] * both[0], t[1] * both[1]];
        let lift = plus::<FUSED>(coupling[0], turns[0], coupling[1] * turns[1]);
        let shrink = plus::<FUSED>(t[0], turns[0], t[1] * turns[1]);
        let fall = plus::<FUSED>(limit, shrink, -(bound * lift) * squared);
        let likely = plus::<FUSED>(3.0, limit, squared) * squared;
        let change = 0.25 * p * excess * likely / (fall * (squared + limit));
        // a contact that would pull, and NaN
        if !(normal > 0.0 && fall > 0.0 && change < f64::INFINITY) {
            break;
        }
        let change = if change > -alpha { change } else { -MOST * alpha };
        alpha += change;
        *last = alpha;
        if change.abs() <= near * both[0] {
            let part = change * inverse;
            let shares = [both[0] * part, both[1] * part];
            let left = if ALONE {
                shares.map(|share| plus::<FUSED>(plus::<FUSED>(share, share, -share), 1.0, 1.0))
            } else {
                [plus::<FUSED>(-both[0], part, 1.0), plus::<FUSED>(-both[1], part, 1.0)]
            };
            let t = [t[0] * inverse * left[0], t[1] * inverse * left[1]];
            let normal = plus::<FUSED>(coupling[1], t[1], plus::<FUSED>(coupling[0], t[0], free));
            return Some((normal.max(0.0), [-t[0], -t[1]]));
        }
    }
    None
}

/// alpha without coupling: that for equal eigenvalues, at least what each direction alone asks for; positive where those
/// are.
#[inline(always)]
fn first_alpha(d: [f64; 2], g: [f64; 2], bound: f64) -> f64 {
    let pull = (g[0] * g[0] + g[1] * g[1]).sqrt();
    let inverse = 1.0 / bound;
    let alone = (g[0].abs() * inverse - d[0]).max(g[1].abs() * inverse - d[1]);
    let alpha = (pull * inverse - 0.5 * (d[0] + d[1])).max(alone);
    if alpha > 0.0 { alpha } else { 1e-3 * d[0] }
}

/// alpha without coupling as above, with the eigenvalues' mean weighted by what pulls along them: it is never too large
/// then, and all but exact where the pull is along one.
#[inline(always)]
fn sharp_alpha(d: [f64; 2], g: [f64; 2], bound: f64) -> f64 {
    let squares = [g[0] * g[0], g[1] * g[1]];
    let squared = squares[0] + squares[1];
    let inverse = 1.0 / bound;
    let mean = (squares[0] * d[0] + squares[1] * d[1]) / squared;
    let alone = (g[0].abs() * inverse - d[0]).max(g[1].abs() * inverse - d[1]);
    let alpha = (squared.sqrt() * inverse - mean).max(alone);
    if alpha > 0.0 { alpha } else { 1e-3 * d[0] }
}

/// Slip in the eigenbasis: t_k = -g_k / (d_k + alpha) with |t| = mu n, n = free - coupling . t; starts from `last`
/// when that is positive, and leaves alpha there.
#[inline(always)]
fn slipping(
    d: [f64; 2],
    g: [f64; 2],
    coupling: [f64; 2],
    (free, mu): (f64, f64),
    (last, close): (&mut f64, f64),
) -> (f64, [f64; 2]) {
    let (mut low, mut high) = (0.0, f64::INFINITY);
    let mut alpha = if *last > 0.0 { *last } else { first_alpha(d, g, mu * free) };
    let (mut normal, mut t, mut length) = (free, [0.0; 2], 0.0);
    for _ in 0..60 {
        let both = [d[0] + alpha, d[1] + alpha];
        let product = 1.0 / (both[0] * both[1]);
        let inverse = [both[1] * product, both[0] * product];
        t = [-g[0] * inverse[0], -g[1] * inverse[1]];
        normal = free - coupling[0] * t[0] - coupling[1] * t[1];
        let squared = t[0] * t[0] + t[1] * t[1];
        length = squared.sqrt();
        let excess = length - mu * normal;
        if excess.abs() <= 1e-15 * (length + mu * normal.abs()) {
            break;
        }
        let shrink = t[0] * t[0] * inverse[0] + t[1] * t[1] * inverse[1];
        let lift = coupling[0] * t[0] * inverse[0] + coupling[1] * t[1] * inverse[1];
        // Newton on 1/|t| - 1/(mu n), nearly linear in alpha; on |t| - mu n where n is not positive
        let change = if normal > 0.0 {
            excess * squared * normal / (shrink * mu * normal * normal + lift * squared * length)
        } else {
            excess * length / (shrink + mu * lift * length)
        };
        (low, high) = if excess > 0.0 { (alpha, high) } else { (low, alpha) };
        let mut next = alpha + change;
        if !(next > low && next < high) {
            next = if high.is_finite() { 0.5 * (low + high) } else { 2.0 * alpha + 1e-3 * d[0] };
        } else if change.abs() <= close * alpha {
            *last = next;
            t = [t[0] - t[0] * inverse[0] * change, t[1] - t[1] * inverse[1] * change];
            normal = free - coupling[0] * t[0] - coupling[1] * t[1];
            return (normal.max(0.0), t);
        }
        if next == alpha {
            break;
        }
        alpha = next;
    }
    *last = alpha;
    let normal = normal.max(0.0);
    let scale = if length > 0.0 { mu * normal / length } else { 0.0 };
    (normal, [t[0] * scale, t[1] * scale])
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Numbers in [-1, 1] that look random.
    pub fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    /// A symmetric positive block.
    pub fn block<const D: usize>(next: &mut impl FnMut() -> f64) -> [[f64; D]; D] {
        let root: [[f64; D]; D] = std::array::from_fn(|_| std::array::from_fn(|_| next()));
        let mut w = [[0.0; D]; D];
        for i in 0..D {
            for j in 0..D {
                w[i][j] = (0..D).map(|k| root[i][k] * root[j][k]).sum();
            }
            w[i][i] += 0.1;
        }
        w
    }

    /// Impulses of repeated solutions, each from the one before.
    fn repeated(w: &[[f64; 3]; 3], mu: f64, b: &[f64; 3], near: bool) -> [f64; 3] {
        let mut local = Local::new(w, mu);
        let mut r = [0.0; 3];
        for _ in 0..12 {
            r = if near { local.solve_near::<pulp::Scalar>(b, &r) } else { local.solve(b, &r) };
        }
        r
    }

    #[test]
    fn near_steps_come_to_the_slip_of_the_bracketed_ones() {
        let mut slips = 0;
        for seed in 0..400 {
            let mut next = numbers(seed);
            let w = block::<3>(&mut next);
            let (mu, size) = (next().abs() + 0.01, 10.0_f64.powf(6.0 * next()));
            let b = [-next().abs(), next(), next()].map(|x| size * x);
            let (plain, near) = (repeated(&w, mu, &b, false), repeated(&w, mu, &b, true));
            let largest = plain.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for k in 0..3 {
                assert!((plain[k] - near[k]).abs() <= 1e-12 * largest, "{seed}: {plain:?} {near:?}");
            }
            let tangent = (plain[1] * plain[1] + plain[2] * plain[2]).sqrt();
            slips += usize::from(plain[0] > 0.0 && (tangent - mu * plain[0]).abs() < 1e-9 * largest);
        }
        assert!(slips > 100, "{slips}");
    }

    #[test]
    fn beyond_a_solution_impulses_stay_on_the_cone_and_solutions_stay_where_they_are() {
        let w = [[1.0, 0.2, 0.0], [0.2, 0.8, 0.1], [0.0, 0.1, 0.9]];
        for seed in 0..200 {
            let mut next = numbers(seed);
            let mu = 0.1 + next().abs();
            let mut local = Local::new(&w, mu);
            let b = [next() - 0.5, 2.0 * next(), 2.0 * next()];
            let found = local.solve(&b, &[0.0; 3]);
            let mut old = [next().abs(), next(), next()];
            crate::friction_problem::project_on_cone(&mut old, mu);
            let gone = local.beyond(&found, &old, 1.2);
            let tangent = (gone[1] * gone[1] + gone[2] * gone[2]).sqrt();
            assert!(gone[0] >= 0.0 && tangent <= mu * gone[0] * (1.0 + 1e-15), "{seed}: {gone:?}");
            assert!(found[0] > 0.0 || gone == [0.0; 3], "{seed}: {found:?} {gone:?}");
            let stays = local.beyond(&found, &found, 1.2);
            for k in 0..3 {
                assert!((stays[k] - found[k]).abs() <= 4e-16 * found[0], "{seed}: {found:?} {stays:?}");
            }
        }
    }
}
