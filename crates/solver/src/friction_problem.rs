//! Frictional contact in matrix form, the form of public collections: u = W r + q in contact frames, normal first,
//! and per contact r in K, u + mu |u_T| n in K*, orthogonal to each other (De Saxce's form of Coulomb's law;
//! theory chapter 7). Knows no bodies: W is whatever was measured or assembled.

use crate::delassus_blocks::Delassus;
use crate::problem::ProblemError;

/// Find r with u = W r + q and Coulomb's law at every contact; contact i owns rows d i .. d i + d - 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrictionProblem {
    /// Rows per contact: 1 without friction (a linear complementarity problem), 2 in the plane, 3 in space.
    pub dimension: usize,
    /// W, the Delassus operator; it need not be symmetric.
    pub matrix: Delassus,
    /// q: the relative velocities without impulses \[m/s\].
    pub velocity: Vec<f64>,
    /// Coefficient of friction per contact \[1\].
    pub friction: Vec<f64>,
}

impl FrictionProblem {
    /// Number of contacts.
    pub fn contacts(&self) -> usize {
        self.friction.len()
    }
    /// Brings W into the blocks that solvers work on; the first solve does it otherwise.
    pub fn prepare(&self) {
        self.matrix.made(self.dimension);
    }
    /// Checks shapes and numbers of a problem that came from outside.
    ///
    /// # Errors
    /// [`ProblemError`] naming the first array or entry that does not fit.
    pub fn check(&self) -> Result<(), ProblemError> {
        let refuse = |place: &str, problem: String, remedy: &str| {
            Err(ProblemError { place: place.into(), problem, remedy: remedy.into() })
        };
        if !(1..=3).contains(&self.dimension) {
            return refuse("dimension", format!("is {}", self.dimension), "use 1, 2 or 3 rows per contact");
        }
        let n = self.dimension * self.contacts();
        let w = &self.matrix;
        if w.shape != (n, n) || self.velocity.len() != n {
            let sizes = format!("W is {:?}, q has {} entries", w.shape, self.velocity.len());
            return refuse(
                "matrix",
                sizes,
                "give dimension x contacts rows and columns, and as many velocities",
            );
        }
        let sorted = w.starts.len() == n + 1
            && w.starts[0] == 0
            && w.starts.windows(2).all(|p| p[0] <= p[1])
            && w.starts[n] == w.indices.len()
            && w.indices.len() == w.values.len();
        if !sorted || w.indices.iter().any(|&j| j >= n) {
            return refuse(
                "matrix",
                "is no compressed-row matrix".into(),
                "give ascending starts and columns < n",
            );
        }
        if let Some(k) = w.values.iter().position(|x| !x.is_finite()) {
            return refuse("matrix", format!("value {k} is {}", w.values[k]), "give finite numbers");
        }
        if let Some(k) = self.velocity.iter().position(|x| !x.is_finite()) {
            return refuse("velocity", format!("entry {k} is {}", self.velocity[k]), "give finite numbers");
        }
        if let Some(k) = self.friction.iter().position(|x| !(x.is_finite() && *x >= 0.0)) {
            return refuse(
                "friction",
                format!("entry {k} is {}", self.friction[k]),
                "give finite numbers >= 0",
            );
        }
        Ok(())
    }
}

/// How far outside the cone, as a share of |r_T|^2, an impulse is as good as on it: a few roundings.
const ON_THE_CONE: f64 = 1e-14;

/// True for what is inside the cone |x_T| <= mu x_N or on it to rounding.
pub(crate) fn is_on_cone(x: &[f64], friction: f64) -> bool {
    let squared: f64 = x[1..].iter().map(|t| t * t).sum();
    x[0] >= 0.0 && squared <= friction * friction * x[0] * x[0] * (1.0 + ON_THE_CONE)
}

/// Projects (normal, tangents) on the cone |x_T| <= mu x_N, in place.
pub fn project_on_cone(x: &mut [f64], friction: f64) {
    let tangent = x[1..].iter().map(|t| t * t).sum::<f64>().sqrt();
    // without friction the cone is a ray, and 0 <= 0 x_N says nothing of the sign of x_N
    if x[0] >= 0.0 && tangent <= friction * x[0] {
        return;
    }
    if friction * tangent <= -x[0] {
        x.fill(0.0);
        return;
    }
    let normal = (x[0] + friction * tangent) / (1.0 + friction * friction);
    let scale = friction * normal / tangent;
    x[0] = normal;
    x[1..].iter_mut().for_each(|t| *t *= scale);
}

/// The larger of two numbers; `a` where b is none.
#[inline(always)]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
