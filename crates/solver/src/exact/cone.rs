//! Algebra of the standard cone L = {v_0 >= |v_T|}, in lanes: projection, the natural map of the contact law with its
//! derivative, Nesterov-Todd scaling, the longest step (theory chapter 7). Knows no matrix.
//! Law: y = W x + q + |y_T| e_1, x o y = 0; below u = W x + q.

use super::lane::{Lane, Lanes, lanes};
use pulp::Simd;

/// Scalar product of the tangents.
#[inline(always)]
pub fn tangent_dot<S: Simd, const D: usize>(a: Lanes<S, D>, b: Lanes<S, D>) -> Lane<S> {
    let mut sum = a[0].like(0.0);
    for k in 1..D {
        sum = a[k].mul_add(b[k], sum);
    }
    sum
}

/// Length of the tangent.
#[inline(always)]
pub fn tangent<S: Simd, const D: usize>(a: Lanes<S, D>) -> Lane<S> {
    if D == 2 { a[D - 1].abs() } else { tangent_dot(a, a).sqrt() }
}

/// Scalar product.
#[inline(always)]
pub fn dot<S: Simd, const D: usize>(a: Lanes<S, D>, b: Lanes<S, D>) -> Lane<S> {
    a[0].mul_add(b[0], tangent_dot(a, b))
}

/// v_0^2 - |v_T|^2: positive inside the cone.
#[inline(always)]
pub fn determinant<S: Simd, const D: usize>(v: Lanes<S, D>) -> Lane<S> {
    let t = tangent(v);
    (v[0] - t) * (v[0] + t)
}

/// Nearest point of the cone |v_T| <= mu v_0.
#[inline(always)]
pub fn project<S: Simd, const D: usize>(v: Lanes<S, D>, mu: Lane<S>) -> Lanes<S, D> {
    let (zero, one) = (mu.like(0.0), mu.like(1.0));
    let t = tangent(v);
    let normal = mu.mul_add(t, v[0]) / mu.mul_add(mu, one);
    let scale = mu * normal / t;
    let polar = -v[0];
    lanes!(zero; k => {
        let outside = if k == 0 { normal } else { scale * v[k] };
        // the polar cone first: without friction it holds what the other test would let pass
        let nearest = t.if_at_most(mu * v[0], v[k], outside);
        (mu * t).if_at_most(polar, zero, nearest)
    })
}

/// x - P_L(x - rho y) with y = u + |u_T| e_1.
#[inline(always)]
pub fn natural_map<S: Simd, const D: usize>(x: Lanes<S, D>, u: Lanes<S, D>, rho: Lane<S>) -> Lanes<S, D> {
    let trial = trial(x, u, rho);
    let nearest = project(trial, rho.like(1.0));
    lanes!(rho; k => x[k] - nearest[k])
}

/// x - rho y with y = u + |u_T| e_1.
#[inline(always)]
fn trial<S: Simd, const D: usize>(x: Lanes<S, D>, u: Lanes<S, D>, rho: Lane<S>) -> Lanes<S, D> {
    let slip = tangent(u);
    lanes!(rho; k => {
        let y = if k == 0 { u[0] + slip } else { u[k] };
        x[k] - rho * y
    })
}

/// The unit tangent of a vector and its length; zero vectors get `fallback` along the first tangent.
#[inline(always)]
fn direction<S: Simd, const D: usize>(v: Lanes<S, D>, fallback: f64) -> (Lanes<S, D>, Lane<S>) {
    let t = tangent(v);
    let tiny = t.like(1e-300);
    let e = lanes!(t; k => match k {
        0 => t.like(0.0),
        1 => t.if_less(tiny, t.like(fallback), v[k] / t),
        _ => t.if_less(tiny, t.like(0.0), v[k] / t),
    });
    (e, t)
}

/// The matrix with eigenvalue a on (1, e), b on (1, -e) and c on tangents perpendicular to e, by rows.
#[inline(always)]
fn from_eigenvalues<S: Simd, const D: usize>(
    e: Lanes<S, D>,
    (a, b, c): (Lane<S>, Lane<S>, Lane<S>),
) -> [Lanes<S, D>; D] {
    let half = a.like(0.5);
    let (mean, half_difference) = ((a + b) * half, (a - b) * half);
    lanes!([mean; D]; i => lanes!(mean; j => match (i, j) {
        (0, 0) => mean,
        (0, k) | (k, 0) => half_difference * e[k],
        _ => {
            let along = (mean - c) * e[i] * e[j];
            if i == j { along + c } else { along }
        }
    }))
}

/// E v with E = 1 - e_1 (0, t)^T: the derivative of y - |y_T| e_1 on the left of a vector.
#[inline(always)]
pub fn shifted<S: Simd, const D: usize>(t: Lanes<S, D>, v: Lanes<S, D>) -> Lanes<S, D> {
    let mut out = v;
    out[0] = v[0] - tangent_dot(t, v);
    out
}

/// E M.
#[inline(always)]
fn shifted_matrix<S: Simd, const D: usize>(t: Lanes<S, D>, m: [Lanes<S, D>; D]) -> [Lanes<S, D>; D] {
    let mut out = m;
    for j in 0..D {
        for k in 1..D {
            out[0][j] = out[0][j] - t[k] * m[k][j];
        }
    }
    out
}

/// M v.
#[inline(always)]
fn times<S: Simd, const D: usize>(m: [Lanes<S, D>; D], v: Lanes<S, D>) -> Lanes<S, D> {
    lanes!(v[0]; k => dot(m[k], v))
}

/// Smallest eigenvalue of the projection's derivative that is used: below it, 1e12 would stand next to 1 in the
/// matrix and its rounding poison the eigenvalue 0.
pub const LEAST: f64 = 1e-6;

/// The Newton step on the natural map: (W + D) dx = rhs, D = E sum (1 - l)/(l rho) v v^T + shift over the
/// eigenpairs (l, v) of the projection's derivative, rhs = -E sum 1/(l rho) (v . F) v. Returns D and rhs.
#[inline(always)]
pub fn newton_block<S: Simd, const D: usize>(
    x: Lanes<S, D>,
    u: Lanes<S, D>,
    (rho, shift, least): (Lane<S>, Lane<S>, f64),
) -> ([Lanes<S, D>; D], Lanes<S, D>) {
    let (zero, one, half) = (rho.like(0.0), rho.like(1.0), rho.like(0.5));
    let trial = trial(x, u, rho);
    let nearest = project(trial, one);
    let map = lanes!(rho; k => x[k] - nearest[k]);
    let (e, t) = direction(trial, 1.0);
    // inside: all 1; polar: all 0; else 1 along (1, e), 0 along (1, -e), (1 + z_0 / t) / 2 across
    let mut inverse = [one, zero, (one + trial[0] / t) * half];
    let mut stiff = inverse;
    for k in 0..3 {
        let outside = t.if_at_most(-trial[0], zero, inverse[k]);
        let value = t.if_at_most(trial[0], one, outside).max(rho.like(least));
        inverse[k] = one / (value * rho);
        stiff[k] = (one - value) * inverse[k];
    }
    let (slip, _) = direction(u, 0.0);
    let mut block = shifted_matrix(slip, from_eigenvalues(e, (stiff[0], stiff[1], stiff[2])));
    for k in 0..D {
        block[k][k] = block[k][k] + shift;
    }
    let pull = times(from_eigenvalues(e, (inverse[0], inverse[1], inverse[2])), map);
    let pull = shifted(slip, pull);
    (block, lanes!(rho; k => -pull[k]))
}

/// The Nesterov-Todd scaling G of a pair inside the cone: G x = G^-1 y = lambda, symmetric, G = eta (w as a
/// hyperbolic reflection).
#[derive(Clone, Copy)]
pub struct Scaling<S: Simd, const D: usize> {
    /// w with w_0^2 - |w_T|^2 = 1.
    pub w: Lanes<S, D>,
    /// Size of G.
    pub eta: Lane<S>,
}

impl<S: Simd, const D: usize> Scaling<S, D> {
    /// The scaling of x and y.
    #[inline(always)]
    pub fn of(x: Lanes<S, D>, y: Lanes<S, D>) -> Self {
        let (size_x, size_y) = (determinant(x).sqrt(), determinant(y).sqrt());
        let a = lanes!(size_x; k => x[k] / size_x);
        let b = lanes!(size_x; k => y[k] / size_y);
        let half = size_x.like(0.5);
        let twice = ((size_x.like(1.0) + dot(a, b)) * half).sqrt() * size_x.like(2.0);
        let w = lanes!(half; k => if k == 0 { (b[0] + a[0]) / twice } else { (b[k] - a[k]) / twice });
        Scaling { w, eta: (size_y / size_x).sqrt() }
    }
    /// G v.
    #[inline(always)]
    pub fn times(&self, v: Lanes<S, D>) -> Lanes<S, D> {
        let along = tangent_dot(self.w, v);
        let carry = v[0] + along / (v[0].like(1.0) + self.w[0]);
        lanes!(along; k => {
            let value = if k == 0 { self.w[0].mul_add(v[0], along) } else { self.w[k].mul_add(carry, v[k]) };
            value * self.eta
        })
    }
    /// G^-1 v.
    #[inline(always)]
    pub fn undo(&self, v: Lanes<S, D>) -> Lanes<S, D> {
        let along = tangent_dot(self.w, v);
        let carry = v[0] - along / (v[0].like(1.0) + self.w[0]);
        lanes!(along; k => {
            let value = if k == 0 { self.w[0] * v[0] - along } else { v[k] - self.w[k] * carry };
            value / self.eta
        })
    }
    /// E G^2 with E from the direction of slip `t`.
    #[inline(always)]
    pub fn squared(&self, t: Lanes<S, D>) -> [Lanes<S, D>; D] {
        let (e, length) = direction(self.w, 0.0);
        let stretch = self.w[0] + length;
        let square = self.eta * self.eta;
        let many = square * stretch * stretch;
        let few = square / (stretch * stretch);
        shifted_matrix(t, from_eigenvalues(e, (many, few, square)))
    }
}

/// The direction of slip of y; zero where it does not slip.
#[inline(always)]
pub fn slip_direction<S: Simd, const D: usize>(y: Lanes<S, D>, smoothing: Lane<S>) -> Lanes<S, D> {
    let t = smoothing.mul_add(smoothing, tangent_dot(y, y)).sqrt();
    let (tiny, zero) = (t.like(1e-300), t.like(0.0));
    lanes!(zero; k => if k == 0 { zero } else { t.if_less(tiny, zero, y[k] / t) })
}

/// Jordan product.
#[inline(always)]
pub fn product<S: Simd, const D: usize>(a: Lanes<S, D>, b: Lanes<S, D>) -> Lanes<S, D> {
    lanes!(a[0]; k => if k == 0 { dot(a, b) } else { a[0].mul_add(b[k], b[0] * a[k]) })
}

/// The solution v of a o v = b.
#[inline(always)]
pub fn quotient<S: Simd, const D: usize>(a: Lanes<S, D>, b: Lanes<S, D>) -> Lanes<S, D> {
    let first = (a[0] * b[0] - tangent_dot(a, b)) / determinant(a);
    lanes!(first; k => if k == 0 { first } else { (b[k] - a[k] * first) / a[0] })
}

/// The longest step from x (inside) along d that stays in the cone; very large when nothing ends it.
#[inline(always)]
pub fn longest_step<S: Simd, const D: usize>(x: Lanes<S, D>, d: Lanes<S, D>) -> Lane<S> {
    let (zero, far) = (x[0].like(0.0), x[0].like(1e30));
    let a = d[0] * d[0] - tangent_dot(d, d);
    let b = (x[0] * d[0] - tangent_dot(x, d)) * x[0].like(2.0);
    let c = determinant(x);
    let down = d[0].if_less(zero, -x[0] / d[0], far);
    let inside = b * b - x[0].like(4.0) * a * c;
    let root = inside.max(zero).sqrt();
    let q = (b + zero.if_less(b, root, -root)) * x[0].like(-0.5);
    let mut least = down;
    for step in [q / a, c / q] {
        let ahead = zero.if_less(step, step, far);
        least = least.min(zero.if_at_most(inside, ahead, far));
    }
    least
}
