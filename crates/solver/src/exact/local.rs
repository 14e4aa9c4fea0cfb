//! One contact solved exactly, the others held: W_ii r + b = u with Coulomb's law (theory chapter 7). Take-off when
//! b_N >= 0; else eliminate r_N: with S the Schur complement of W_NN and g the slip at r_T = 0, stick is
//! r_T = -S^-1 g, and slip (S + alpha) r_T = -g with |r_T| = mu r_N, a scalar equation in alpha that is decreasing
//! between its ends, so a bracketed Newton iteration never fails.

/// The impulse of a contact with diagonal block `w` and velocity `b` without its impulse; `old` is the impulse it
/// has now, which stands in for the part of an asymmetric block that the eigenbasis leaves out.
#[inline]
pub fn solve_contact<const D: usize>(w: &[f64], b: &[f64; D], mu: f64, old: &[f64; D]) -> [f64; D] {
    let mut r = [0.0; D];
    // a contact that no impulse moves (NaN included) is left alone
    if b[0] >= 0.0 || !(w[0] > 0.0) {
        return r;
    }
    match D {
        1 => r[0] = -b[0] / w[0],
        2 => (r[0], r[1]) = in_the_plane([w[0], w[1], w[2], w[3]], [b[0], b[1]], mu),
        _ => {
            let found = in_space(w, [b[0], b[1], b[2]], mu, [old[1], old[2]]);
            r.copy_from_slice(&found);
        }
    }
    r
}

fn in_the_plane([nn, nt, tn, tt]: [f64; 4], b: [f64; 2], mu: f64) -> (f64, f64) {
    let free = -b[0] / nn;
    let schur = tt - tn * nt / nn;
    let slip = b[1] - tn * b[0] / nn;
    if schur > 0.0 {
        let tangent = -slip / schur;
        let normal = -(b[0] + nt * tangent) / nn;
        if normal >= 0.0 && tangent.abs() <= mu * normal {
            return (normal, tangent);
        }
    }
    let likely = if slip > 0.0 { -1.0 } else { 1.0 };
    for side in [likely, -likely] {
        let divisor = 1.0 + nt / nn * mu * side;
        let normal = free / divisor;
        let tangent = side * mu * normal;
        if divisor > 0.0 && side * (schur * tangent + slip) <= 0.0 {
            return (normal, tangent);
        }
    }
    // jammed for both signs: friction that at least does not pull
    let side = if 1.0 + nt / nn * mu * likely > 0.0 { likely } else { -likely };
    let normal = free / (1.0 + nt / nn * mu * side);
    (normal, side * mu * normal)
}

fn in_space(w: &[f64], b: [f64; 3], mu: f64, old: [f64; 2]) -> [f64; 3] {
    let inverse = 1.0 / w[0];
    let free = -b[0] * inverse;
    if mu <= 0.0 {
        return [free, 0.0, 0.0];
    }
    let coupling = [w[1] * inverse, w[2] * inverse];
    let schur = |i: usize, j: usize| w[3 * i + j] - w[3 * i] * w[j] * inverse;
    let (a, c, left, right) = (schur(1, 1), schur(2, 2), schur(1, 2), schur(2, 1));
    let (h, skew) = (0.5 * (left + right), 0.5 * (left - right));
    let g = [b[1] + w[3] * free + skew * old[1], b[2] + w[6] * free - skew * old[0]];
    let determinant = a * c - h * h;
    if determinant > 1e-14 * (a * a + c * c) {
        let tangent = [-(c * g[0] - h * g[1]) / determinant, -(a * g[1] - h * g[0]) / determinant];
        let normal = free - coupling[0] * tangent[0] - coupling[1] * tangent[1];
        let squared = tangent[0] * tangent[0] + tangent[1] * tangent[1];
        if normal >= 0.0 && squared <= mu * mu * normal * normal {
            return [normal, tangent[0], tangent[1]];
        }
    }
    let (values, axis) = eigen(a, c, h);
    let turn = |v: [f64; 2]| [axis[0] * v[0] + axis[1] * v[1], axis[0] * v[1] - axis[1] * v[0]];
    let (normal, t) = slipping(values, turn(g), turn(coupling), free, mu);
    [normal, axis[0] * t[0] - axis[1] * t[1], axis[1] * t[0] + axis[0] * t[1]]
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

/// Slip in the eigenbasis: t_k = -g_k / (d_k + alpha) with |t| = mu n, n = free - coupling . t.
fn slipping(d: [f64; 2], g: [f64; 2], coupling: [f64; 2], free: f64, mu: f64) -> (f64, [f64; 2]) {
    let pull = (g[0] * g[0] + g[1] * g[1]).sqrt();
    let (mut low, mut high) = (0.0, f64::INFINITY);
    let mut alpha = (pull / (mu * free) - 0.5 * (d[0] + d[1])).max(0.0);
    if !(alpha > 0.0) {
        alpha = 1e-3 * d[0];
    }
    let (mut normal, mut t) = (free, [0.0; 2]);
    for _ in 0..60 {
        let inverse = [1.0 / (d[0] + alpha), 1.0 / (d[1] + alpha)];
        t = [-g[0] * inverse[0], -g[1] * inverse[1]];
        normal = free - coupling[0] * t[0] - coupling[1] * t[1];
        let length = (t[0] * t[0] + t[1] * t[1]).sqrt();
        let excess = length - mu * normal;
        if excess.abs() <= 1e-15 * (length + mu * normal.abs()) {
            break;
        }
        if excess > 0.0 {
            low = alpha;
        } else {
            high = alpha;
        }
        let shrink = -(t[0] * t[0] * inverse[0] + t[1] * t[1] * inverse[1]) / length.max(1e-300);
        let lift = coupling[0] * t[0] * inverse[0] + coupling[1] * t[1] * inverse[1];
        // Newton on 1/|t| - 1/(mu n), nearly linear in alpha; on |t| - mu n where n is not positive
        let mut next = if normal > 0.0 {
            let value = 1.0 / length - 1.0 / (mu * normal);
            alpha - value / (-shrink / (length * length) + lift / (mu * normal * normal))
        } else {
            alpha - excess / (shrink - mu * lift)
        };
        if !(next > low && next < high) {
            next = if high.is_finite() { 0.5 * (low + high) } else { 2.0 * alpha + 1e-3 * d[0] };
        }
        if (next - alpha).abs() <= 1e-16 * alpha {
            break;
        }
        alpha = next;
    }
    let normal = normal.max(0.0);
    let length = (t[0] * t[0] + t[1] * t[1]).sqrt();
    let scale = if length > 0.0 { mu * normal / length } else { 0.0 };
    (normal, [t[0] * scale, t[1] * scale])
}
