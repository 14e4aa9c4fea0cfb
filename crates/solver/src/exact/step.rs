//! The passes over contacts of an interior point step, in lanes.

use super::blocks::product_of;
use super::cone::{
    Scaling, determinant, dot, longest_step, product, quotient, shifted, slip_direction, tangent_dot,
};
use super::lane::{Lane, Lanes, Sum, lanes, live, load, store};
use super::memory::Pool;
use super::scaled::Scaled;
use super::stage::store_block;
use crate::registers::in_widest;
use pulp::{Simd, WithSimd};

/// The iterate of the interior point, its direction and what a step needs in between.
#[derive(Clone, Debug, Default)]
pub struct Pair<const D: usize> {
    pub x: Vec<[f64; D]>,
    pub y: Vec<[f64; D]>,
    /// W~ x + q~.
    pub u: Vec<[f64; D]>,
    pub dx: Vec<[f64; D]>,
    pub dy: Vec<[f64; D]>,
    affine_x: Vec<[f64; D]>,
    affine_y: Vec<[f64; D]>,
    /// A direction put aside.
    aside_x: Vec<[f64; D]>,
    aside_y: Vec<[f64; D]>,
    /// y - u - |y_T| e_1.
    pub residual: Vec<[f64; D]>,
    /// d of the equations above.
    pub pull: Vec<[f64; D]>,
    /// The scaling: w, then eta.
    pub w: Vec<[f64; D]>,
    pub eta: Vec<f64>,
    /// Direction of slip.
    slip: Vec<[f64; D]>,
    /// Sums over contacts of x.y, x.dy + y.dx, dx.dy.
    sums: [f64; 3],
}

impl<const D: usize> Pair<D> {
    /// x = size e, y = e.
    pub fn cold(scaled: &Scaled<D>, size: f64, pool: &mut Pool<D>) -> Self {
        let n = scaled.velocity.len();
        let mut pair = pool.pair();
        let unit = |s: f64| std::array::from_fn(|k| if k == 0 { s } else { 0.0 });
        for (vector, value) in [(&mut pair.x, unit(size)), (&mut pair.y, unit(1.0))] {
            vector.clear();
            vector.resize(n, value);
        }
        let Pair { u, dx, dy, affine_x, affine_y, aside_x, aside_y, residual, pull, w, slip, .. } = &mut pair;
        for vector in [u, dx, dy, affine_x, affine_y, aside_x, aside_y, residual, pull, w, slip] {
            vector.clear();
            vector.resize(n, [0.0; D]);
        }
        pair.eta.clear();
        pair.eta.resize(n, 1.0);
        pair.sums = [0.0; 3];
        pair
    }
    /// m = x.y per contact.
    pub fn complementarity(&self, count: usize) -> f64 {
        product_of(self.x[..count].as_flattened(), self.y[..count].as_flattened()) / count as f64
    }
    /// x.y after a step along the present direction.
    pub fn complementarity_after(&self, step: f64) -> f64 {
        self.sums[0] + step * (self.sums[1] + step * self.sums[2])
    }
    /// Keeps the present direction as the affine one.
    pub fn keep_affine(&mut self) {
        self.affine_x.copy_from_slice(&self.dx);
        self.affine_y.copy_from_slice(&self.dy);
    }
    /// Becomes another, whose scaling it takes too.
    pub fn copy_from(&mut self, other: &Self) {
        self.x.clone_from(&other.x);
        self.y.clone_from(&other.y);
        self.u.clone_from(&other.u);
        self.dx.clone_from(&other.dx);
        self.dy.clone_from(&other.dy);
        self.affine_x.clone_from(&other.affine_x);
        self.affine_y.clone_from(&other.affine_y);
        self.aside_x.clone_from(&other.aside_x);
        self.aside_y.clone_from(&other.aside_y);
        self.residual.clone_from(&other.residual);
        self.pull.clone_from(&other.pull);
        self.w.clone_from(&other.w);
        self.eta.clone_from(&other.eta);
        self.slip.clone_from(&other.slip);
        self.sums = other.sums;
    }
    /// Puts the present direction aside.
    pub fn put_aside(&mut self) {
        self.aside_x.copy_from_slice(&self.dx);
        self.aside_y.copy_from_slice(&self.dy);
    }
    /// Makes the one put aside the present direction again.
    pub fn take_back(&mut self) {
        std::mem::swap(&mut self.dx, &mut self.aside_x);
        std::mem::swap(&mut self.dy, &mut self.aside_y);
    }
    /// True when no number is infinite or NaN.
    pub fn is_finite(&self) -> bool {
        let finite = |v: &[[f64; D]]| v.as_flattened().iter().all(|x| x.is_finite());
        finite(&self.x) && finite(&self.y)
    }
}

struct Prepare<'a, const D: usize>(&'a Scaled<D>, &'a mut Pair<D>, (f64, f64), &'a mut [[[f64; D]; D]]);

impl<const D: usize> WithSimd for Prepare<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Prepare(scaled, pair, (smoothing, share), blocks) = self;
        let share = Lane::all(simd, share);
        let smoothing = Lane::all(simd, smoothing);
        for first in (0..scaled.count()).step_by(S::F64_LANES) {
            let (x, y) = (load(simd, &pair.x, first), load(simd, &pair.y, first));
            let u = load(simd, &pair.u, first);
            let slip = slip_direction(y, smoothing);
            let slip = lanes!(share; k => share * slip[k]);
            let length = smoothing.mul_add(smoothing, tangent_dot(y, y)).sqrt() - smoothing;
            let residual = lanes!(length; k => if k == 0 { y[0] - u[0] - length } else { y[k] - u[k] });
            let scaling = Scaling::of(x, y);
            store(residual, &mut pair.residual, first);
            store(scaling.w, &mut pair.w, first);
            scaling.eta.store(&mut pair.eta[first..]);
            store(slip, &mut pair.slip, first);
            store_block(scaling.squared(slip), blocks, first);
        }
    }
}

/// Scaling, residual, direction of slip and D = E G^2 of every contact, with a share of the slip in E.
pub fn prepare<const D: usize>(
    scaled: &Scaled<D>,
    pair: &mut Pair<D>,
    (smoothing, share): (f64, f64),
    blocks: &mut [[[f64; D]; D]],
) {
    in_widest(Prepare(scaled, pair, (smoothing, share), blocks));
}

#[inline(always)]
fn scaling<S: Simd, const D: usize>(simd: S, pair: &Pair<D>, first: usize) -> Scaling<S, D> {
    Scaling { w: load(simd, &pair.w, first), eta: Lane::load(simd, &pair.eta[first..]) }
}

struct Direction<'a, const D: usize>(&'a Scaled<D>, &'a mut Pair<D>, f64, bool);

impl<const D: usize> WithSimd for Direction<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Direction(scaled, pair, target, corrected) = self;
        let target = Lane::all(simd, target);
        for first in (0..scaled.count()).step_by(S::F64_LANES) {
            let scaling = scaling(simd, pair, first);
            let lambda = scaling.times(load(simd, &pair.x, first));
            let square = product(lambda, lambda);
            let mut c = lanes!(target; k => if k == 0 { target - square[0] } else { -square[k] });
            if corrected {
                let dx = scaling.times(load(simd, &pair.affine_x, first));
                let dy = scaling.undo(load(simd, &pair.affine_y, first));
                let bend = product(dx, dy);
                c = lanes!(target; k => c[k] - bend[k]);
            }
            let pull = quotient(lambda, c);
            let drive = shifted(load(simd, &pair.slip, first), scaling.times(pull));
            let residual: Lanes<S, D> = load(simd, &pair.residual, first);
            store(pull, &mut pair.pull, first);
            store(lanes!(target; k => drive[k] + residual[k]), &mut pair.dx, first);
        }
    }
}

/// Writes the right-hand side of the step towards complementarity `target` into dx.
pub fn direction<const D: usize>(scaled: &Scaled<D>, pair: &mut Pair<D>, target: f64, corrected: bool) {
    in_widest(Direction(scaled, pair, target, corrected));
}

struct Reach<'a, const D: usize>(&'a Scaled<D>, &'a mut Pair<D>);

impl<const D: usize> WithSimd for Reach<'_, D> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Reach(scaled, pair) = self;
        let count = scaled.count();
        let (zero, far) = (Lane::all(simd, 0.0), Lane::all(simd, 1e30));
        let mut longest = far;
        let mut sums = [Sum::default(); 3];
        for first in (0..count).step_by(S::F64_LANES) {
            let live = live(simd, first, count);
            let scaling = scaling(simd, pair, first);
            let (x, y) = (load(simd, &pair.x, first), load(simd, &pair.y, first));
            let dx = load(simd, &pair.dx, first);
            let (pull, scaled_dx): (Lanes<S, D>, _) = (load(simd, &pair.pull, first), scaling.times(dx));
            let dy = scaling.times(lanes!(zero; k => pull[k] - scaled_dx[k]));
            store(dy, &mut pair.dy, first);
            let step = longest_step(x, dx).min(longest_step(y, dy));
            longest = longest.min(zero.if_less(live, step, far));
            let products = [dot(x, y), dot(x, dy) + dot(dx, y), dot(dx, dy)];
            for (sum, product) in sums.iter_mut().zip(products) {
                sum.add(first, zero.if_less(live, product, zero));
            }
        }
        pair.sums = sums.map(Sum::total);
        longest.least()
    }
}

/// dy of the present dx, the sums over contacts, and the longest step that stays in the cones.
pub fn reach<const D: usize>(scaled: &Scaled<D>, pair: &mut Pair<D>) -> f64 {
    in_widest(Reach(scaled, pair))
}

/// a + step d.
#[inline(always)]
fn ahead<S: Simd, const D: usize>(
    step: Lane<S>,
    a: &[[f64; D]],
    d: &[[f64; D]],
    first: usize,
) -> Lanes<S, D> {
    let simd = step.simd();
    let (a, d): (Lanes<S, D>, Lanes<S, D>) = (load(simd, a, first), load(simd, d, first));
    lanes!(step; k => step.mul_add(d[k], a[k]))
}

struct Centrality<'a, const D: usize>(&'a Scaled<D>, &'a Pair<D>, f64);

impl<const D: usize> WithSimd for Centrality<'_, D> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Centrality(scaled, pair, step) = self;
        let count = scaled.count();
        let (zero, far) = (Lane::all(simd, 0.0), Lane::all(simd, 1e300));
        let length = Lane::all(simd, step);
        let (mut least, mut sum) = (far, Sum::default());
        for first in (0..count).step_by(S::F64_LANES) {
            let live = live(simd, first, count);
            let x = ahead(length, &pair.x, &pair.dx, first);
            let y = ahead(length, &pair.y, &pair.dy, first);
            let both = (determinant(x) * determinant(y)).max(zero);
            least = least.min(zero.if_less(live, both, far));
            sum.add(first, zero.if_less(live, dot(x, y), zero));
        }
        least.least().sqrt() / (sum.total() / count as f64)
    }
}

/// The least sqrt(det x_i det y_i) over m after a step.
pub fn centrality<const D: usize>(scaled: &Scaled<D>, pair: &Pair<D>, step: f64) -> f64 {
    in_widest(Centrality(scaled, pair, step))
}

/// `v` with its normal number just above its tangent where rounding left it on or outside the cone.
#[inline(always)]
fn inside<S: Simd, const D: usize>(mut v: Lanes<S, D>) -> Lanes<S, D> {
    let (one, smallest) = (v[0].like(1.0 + 1e-15), v[0].like(1e-290));
    let tangent = tangent_dot(v, v).sqrt();
    let least = one * tangent + smallest;
    let normal = (v[0] - tangent).if_less(v[0].like(1e-15) * v[0], least, v[0]);
    v[0] = v[0].if_at_most(smallest, least, normal);
    v
}

struct Take<'a, const D: usize>(&'a Scaled<D>, &'a mut Pair<D>, f64);

impl<const D: usize> WithSimd for Take<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Take(scaled, Pair { x, y, dx, dy, .. }, step) = self;
        let (zero, length, count) = (Lane::all(simd, 0.0), Lane::all(simd, step), scaled.count());
        for first in (0..count).step_by(S::F64_LANES) {
            let live = live(simd, first, count);
            for (v, d) in [(&mut *x, &*dx), (&mut *y, &*dy)] {
                let (before, after) = (load(simd, v, first), inside(ahead(length, v, d, first)));
                store(lanes!(zero; k => zero.if_less(live, after[k], before[k])), v, first);
            }
        }
    }
}

/// Takes the step; what rounding leaves on or outside the cone is put just inside.
pub fn take<const D: usize>(scaled: &Scaled<D>, pair: &mut Pair<D>, step: f64) {
    in_widest(Take(scaled, pair, step));
}
