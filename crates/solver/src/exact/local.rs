//! One contact solved exactly, the others held: W_ii r_i + b = u with Coulomb's law (theory chapter 7). Take-off when
//! b_N >= 0; else eliminate r_N: with S the Schur complement of W_NN and g the slip at r_T = 0, stick is
//! r_T = -S^-1 g, and slip (S + alpha) r_T = -g with |r_T| = mu r_N, a scalar equation in alpha that is decreasing
//! between its ends, so a bracketed Newton iteration never fails.

/// What the solution of one contact needs of its diagonal block, made once.
#[derive(Clone, Copy, Debug)]
pub struct Local<const D: usize> {
    mu: f64,
    /// 1 / W_NN; 0 for a contact that no impulse moves.
    inverse: f64,
    /// W_NT / W_NN and W_TN.
    pulls: [f64; 2],
    pushed: [f64; 2],
    /// Entries (1, 1), (2, 2), (1, 2) of the inverse of the symmetric part of S; none where it is singular.
    stick: Option<[f64; 3]>,
    /// Half the difference of the entries of S off the diagonal.
    skew: f64,
    /// Eigenvalues of the symmetric part of S, the larger first, and the axis of the larger.
    values: [f64; 2],
    axis: [f64; 2],
    /// alpha of the last slip; 0 for none.
    alpha: f64,
}

/// Relative change of alpha below which t follows it to first order: what that leaves is squared, and the next sweep
/// goes on from there.
const CLOSE: f64 = 1e-3;

impl<const D: usize> Local<D> {
    /// From the diagonal block and the coefficient of friction.
    pub fn new(w: &[[f64; D]; D], mu: f64) -> Self {
        let w = w.as_flattened();
        let inverse = if w[0] > 0.0 { 1.0 / w[0] } else { 0.0 };
        let mut local = Local {
            mu,
            inverse,
            pulls: [0.0; 2],
            pushed: [0.0; 2],
            stick: None,
            skew: 0.0,
            values: [0.0; 2],
            axis: [1.0, 0.0],
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
                local.stick = Some([c / determinant, a / determinant, -h / determinant]);
            }
            (local.values, local.axis) = eigen(a, c, h);
        }
        local
    }

    /// The impulse at velocity `b` without it; `old` is the impulse it has now, which stands in for the part of an
    /// asymmetric block that the eigenbasis leaves out.
    #[inline(always)]
    pub fn solve(&mut self, b: &[f64; D], old: &[f64; D]) -> [f64; D] {
        let mut r = [0.0; D];
        // a contact that no impulse moves (NaN included) is left alone
        if b[0] >= 0.0 || !(self.inverse > 0.0) {
            return r;
        }
        match D {
            1 => r[0] = -b[0] * self.inverse,
            2 => (r[0], r[1]) = self.in_the_plane([b[0], b[1]]),
            _ => {
                let found = self.in_space([b[0], b[1], b[2]], [old[1], old[2]]);
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
    fn in_space(&mut self, b: [f64; 3], old: [f64; 2]) -> [f64; 3] {
        let (mu, pulls, axis) = (self.mu, self.pulls, self.axis);
        let free = -b[0] * self.inverse;
        if mu <= 0.0 {
            return [free, 0.0, 0.0];
        }
        let g = [
            b[1] + self.pushed[0] * free + self.skew * old[1],
            b[2] + self.pushed[1] * free - self.skew * old[0],
        ];
        if let Some([a, c, h]) = self.stick {
            let tangent = [-(a * g[0] + h * g[1]), -(c * g[1] + h * g[0])];
            let normal = free - pulls[0] * tangent[0] - pulls[1] * tangent[1];
            let squared = tangent[0] * tangent[0] + tangent[1] * tangent[1];
            if normal >= 0.0 && squared <= mu * mu * normal * normal {
                return [normal, tangent[0], tangent[1]];
            }
        }
        let turn = |v: [f64; 2]| [axis[0] * v[0] + axis[1] * v[1], axis[0] * v[1] - axis[1] * v[0]];
        let (normal, t) = slipping(self.values, turn(g), turn(pulls), (free, mu), &mut self.alpha);
        [normal, axis[0] * t[0] - axis[1] * t[1], axis[1] * t[0] + axis[0] * t[1]]
    }
}

/// Eigenvalues, larger first, of \[a h; h c\], and the unit axis of the larger.
fn eigen(a: f64, c: f64, h: f64) -> ([f64; 2], [f64; 2]) {
    let (mean, difference) = (0.5 * (a + c), 0.5 * (a - c));
    let radius = (difference * difference + h * h).sqrt();
    let values = [mean + radius, (mean - radius).max(0.0)];
    let axis = if difference >= 0.0 { [difference + radius, h] } else { [h, radius - difference] };
    let size = (axis[0] * axis[0] + axis[1] * axis[1]).sqrt();
    let axis = if size > 0.0 { [axis[0] / size, axis[1] / size] } else { [1.0, 0.0] };
    (values, axis)
}

/// Slip in the eigenbasis: t_k = -g_k / (d_k + alpha) with |t| = mu n, n = free - coupling . t; starts from `last`
/// when that is positive, and leaves alpha there.
#[inline(always)]
fn slipping(
    d: [f64; 2],
    g: [f64; 2],
    coupling: [f64; 2],
    (free, mu): (f64, f64),
    last: &mut f64,
) -> (f64, [f64; 2]) {
    let (mut low, mut high) = (0.0, f64::INFINITY);
    let mut alpha = *last;
    if !(alpha > 0.0) {
        let pull = (g[0] * g[0] + g[1] * g[1]).sqrt();
        alpha = (pull / (mu * free) - 0.5 * (d[0] + d[1])).max(0.0);
    }
    if !(alpha > 0.0) {
        alpha = 1e-3 * d[0];
    }
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
        } else if change.abs() <= CLOSE * alpha {
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
