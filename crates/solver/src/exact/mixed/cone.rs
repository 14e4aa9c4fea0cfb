//! One cone of a mixed problem: x and y in it, and what a step of the interior point needs of them. The algebra is that
//! of `cone.rs`, one number wide; a half-line is a cone without tangents. Knows no matrix.

use crate::exact::cone::{Scaling, determinant, longest_step, product, quotient, slip_direction};
use crate::exact::lane::Lane;
use pulp::Scalar;

/// A vector in a cone; tangents that are not there are 0.
pub type Vector = [f64; 3];
/// The same as lanes.
pub type Wide = [Lane<Scalar>; 3];

pub fn wide(v: Vector) -> Wide {
    v.map(|x| Lane::all(Scalar::new(), x))
}
pub fn narrow(v: Wide) -> Vector {
    v.map(Lane::number)
}

/// x and y of one cone, in units of the whole, and what a step needs in between.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    /// The row that x_0 comes from, but for a constant, and how much of it.
    pub head: usize,
    pub share: f64,
    /// The rows of x_T.
    pub first: usize,
    pub count: usize,
    pub x: Vector,
    pub y: Vector,
    pub dx: Vector,
    pub dy: Vector,
    /// The affine direction.
    pub affine: [Vector; 2],
    /// The scaling: w, then eta.
    w: Vector,
    eta: f64,
    pub slip: Vector,
    /// d of dy = G (d - G dx).
    pub pull: Vector,
}

impl Cone {
    /// A cone whose x starts at (`x`, 0), with x.y = `size`.
    pub fn new((head, share): (usize, f64), (first, count): (usize, usize), x: f64, size: f64) -> Self {
        let unit = |s: f64| [s, 0.0, 0.0];
        let none = [0.0; 3];
        let (w, slip, pull) = (unit(1.0), none, none);
        let affine = [none; 2];
        Cone {
            head,
            share,
            first,
            count,
            x: unit(x),
            y: unit(size / x),
            dx: none,
            dy: none,
            affine,
            w,
            eta: 1.0,
            slip,
            pull,
        }
    }
    /// The scaling of the last `prepare`.
    pub fn scaling(&self) -> Scaling<Scalar, 3> {
        Scaling { w: wide(self.w), eta: Lane::all(Scalar::new(), self.eta) }
    }
    /// Scaling and direction of slip, times `share`, at the present x and y.
    pub fn prepare(&mut self, smoothing: f64, share: f64) {
        let scaling = Scaling::of(wide(self.x), wide(self.y));
        (self.w, self.eta) = (narrow(scaling.w), scaling.eta.number());
        self.slip =
            narrow(slip_direction(wide(self.y), Lane::all(Scalar::new(), smoothing))).map(|t| share * t);
    }
    /// d for x.y = `target`; G d.
    pub fn aim(&mut self, target: f64, corrected: bool) -> Vector {
        let scaling = self.scaling();
        let lambda = scaling.times(wide(self.x));
        let square = narrow(product(lambda, lambda));
        let mut c = [target - square[0], -square[1], -square[2]];
        if corrected {
            let [dx, dy] = self.affine.map(wide);
            let bend = narrow(product(scaling.times(dx), scaling.undo(dy)));
            c = std::array::from_fn(|k| c[k] - bend[k]);
        }
        let pull = quotient(lambda, wide(c));
        self.pull = narrow(pull);
        narrow(scaling.times(pull))
    }
    /// dx from the step of all rows, dy from it.
    pub fn follow(&mut self, step: &[f64]) {
        let tangent = |k: usize| if k <= self.count { step[self.first + k - 1] } else { 0.0 };
        self.dx = std::array::from_fn(|k| if k == 0 { self.share * step[self.head] } else { tangent(k) });
        self.complete();
    }
    /// dy from dx and the pull.
    pub fn complete(&mut self) {
        let scaling = self.scaling();
        self.dy = narrow(scaling.times(wide(self.left_scaled())));
    }
    /// G dx.
    pub fn scaled_dx(&self) -> Vector {
        narrow(self.scaling().times(wide(self.dx)))
    }
    /// G^-1 dy.
    pub fn left_scaled(&self) -> Vector {
        let along = self.scaled_dx();
        std::array::from_fn(|k| self.pull[k] - along[k])
    }
    /// The longest step that stays in the cones.
    pub fn reach(&self) -> f64 {
        let of = |v: Vector, d: Vector| longest_step(wide(v), wide(d)).number();
        of(self.x, self.dx).min(of(self.y, self.dy))
    }
    /// v + step d.
    pub fn after(v: Vector, d: Vector, step: f64) -> Vector {
        std::array::from_fn(|k| v[k] + step * d[k])
    }
    /// x.y after a step.
    pub fn complementarity(&self, step: f64) -> f64 {
        let (x, y) = (Self::after(self.x, self.dx, step), Self::after(self.y, self.dy, step));
        x.iter().zip(&y).map(|(x, y)| x * y).sum()
    }
    /// sqrt(det x det y) after a step; NaN outside.
    pub fn centrality(&self, step: f64) -> f64 {
        let (x, y) = (Self::after(self.x, self.dx, step), Self::after(self.y, self.dy, step));
        let (x, y) = (determinant(wide(x)).number(), determinant(wide(y)).number());
        if x > 0.0 && y > 0.0 { (x * y).sqrt() } else { f64::NAN }
    }
    /// |y_T|, smoothed.
    pub fn slip_length(&self, smoothing: f64) -> f64 {
        (self.y[1] * self.y[1] + self.y[2] * self.y[2] + smoothing * smoothing).sqrt() - smoothing
    }
}
