//! Frictional contact in matrix form, the form of public collections: u = W r + q in contact frames, normal first,
//! and per contact r in K, u + mu |u_T| n in K*, orthogonal to each other (De Saxce's form of Coulomb's law;
//! theory chapter 7). Knows no bodies: W is whatever was measured or assembled.

use crate::delassus_blocks::Delassus;
use crate::exact::blocks::squared_length;
use crate::exact::couplings::{places, product, spread};
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

/// What impulses are worth, in the measures of the literature and in velocity units; every entry is zero exactly
/// at a solution.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measure {
    /// |r - P_K(r - u_hat)| / |q|: the natural map with step 1 (Acary, Bremond and Huber 2018). Depends on the unit
    /// of impulse.
    pub natural: f64,
    /// |(r - P_K(r - u_hat / l)) l| / |q| with l the spectral norm of each diagonal block of W: velocity units,
    /// unmoved by a change of the unit of impulse.
    pub scaled: f64,
    /// Largest |r_T| - mu r_N or -r_N over the largest |r|.
    pub cone: f64,
    /// Largest -u_N over the largest entry of q.
    pub penetration: f64,
    /// Largest |u_hat . r| over the largest |r| times the largest entry of q.
    pub complementarity: f64,
    /// Over sliding contacts, largest |u_T + |u_T| r_T / |r_T|| over the largest entry of q.
    pub slip_alignment: f64,
    /// Contacts without impulse.
    pub take_off: usize,
    /// Contacts whose impulse is inside the cone.
    pub stick: usize,
    /// Contacts whose impulse is on the cone while they slip.
    pub slip: usize,
}

impl Measure {
    /// True when natural <= tolerance, scaled <= 10 tolerance and cone <= 1e-12: "solved at tolerance" in
    /// collections of contact problems.
    pub fn solves(&self, tolerance: f64) -> bool {
        self.natural <= tolerance && self.scaled <= 10.0 * tolerance && self.cone <= 1e-12
    }
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

/// |(r - P_K(r - step u_hat)) / step|^2 of one contact \[m^2/s^2\], with one over the step. In each case of the
/// projection the difference is taken by hand: impulses so huge that r - step u_hat rounds to r hide no velocity.
#[inline(always)]
fn natural_map_squared<const D: usize>(
    r: &[f64; D],
    u_hat: &[f64; D],
    (step, inverse): (f64, f64),
    friction: f64,
) -> f64 {
    if D == 1 {
        let apart = r[0] * inverse;
        let nearer = if apart < u_hat[0] { apart } else { u_hat[0] };
        return nearer * nearer;
    }
    let mut x: [f64; D] = std::array::from_fn(|k| r[k] - step * u_hat[k]);
    let (squared, normal) = (square(&x[1..]), x[0] * x[0]);
    if x[0] >= 0.0 && squared <= friction * friction * normal {
        return square(u_hat);
    }
    if x[0] <= 0.0 && friction * friction * squared <= normal {
        return square(r) * (inverse * inverse);
    }
    let (tangent, given) = (squared.sqrt(), length(&r[1..]));
    // r - P(x) = step u_hat + g (-mu, t), g (1 + mu^2) = |x_T| - mu x_N, t = x_T / |x_T|
    let turned: f64 = r[1..].iter().zip(&u_hat[1..]).map(|(r, u)| r * u).sum();
    let longer = (step * square(&u_hat[1..]) - 2.0 * turned) / (tangent + given);
    let over = (given - friction * r[0]) * inverse + longer + friction * u_hat[0];
    let g = over / (1.0 + friction * friction);
    let along = g / tangent;
    x[1..].iter_mut().zip(&u_hat[1..]).for_each(|(x, u)| *x = u + along * *x);
    x[0] = u_hat[0] - g * friction;
    square(&x)
}

/// The larger of two numbers; `a` where b is none.
#[inline(always)]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

#[inline(always)]
fn square(x: &[f64]) -> f64 {
    x.iter().map(|a| a * a).sum()
}

#[inline(always)]
fn length(x: &[f64]) -> f64 {
    square(x).sqrt()
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, a| larger(m, a.abs()))
}

fn not_zero(x: f64) -> f64 {
    if x > 0.0 { x } else { 1.0 }
}

/// Measures impulses against a problem; independent of every solver.
pub fn measure(problem: &FrictionProblem, impulses: &[f64]) -> Measure {
    match problem.dimension {
        1 => measured_in::<1>(problem, impulses),
        2 => measured_in::<2>(problem, impulses),
        _ => measured_in::<3>(problem, impulses),
    }
}

/// Up to so many contacts nothing is allocated for a measure.
const FEW: usize = 16;

/// The same with the number of rows per contact known beforehand.
pub(crate) fn measured_in<const D: usize>(problem: &FrictionProblem, impulses: &[f64]) -> Measure {
    let made = problem.matrix.made(D);
    let (w, norms) = (&*made.matrix, &*made.norms);
    let (impulses, _) = impulses.as_chunks::<D>();
    let count = impulses.len();
    if let [alone] = impulses {
        let row = |r: usize| (0..D).map(|c| w.values[r * D + c] * alone[c]).sum();
        return judged(problem, impulses, norms, &[std::array::from_fn(row)]);
    }
    let size = count * places(D);
    if count > FEW {
        let (mut spaced, mut velocity) = (vec![0.0; size], vec![[0.0; D]; count]);
        spread(impulses, &mut spaced);
        product(&made.couplings, w, &spaced, &mut velocity);
        return judged(problem, impulses, norms, &velocity);
    }
    let mut velocity = [[0.0; D]; FEW];
    if D == 1 {
        // one after another: what is laid out for registers would take longer to ask for
        for (i, velocity) in velocity[..count].iter_mut().enumerate() {
            let row = w.graph.row(i);
            let others = w.graph.neighbours[row.clone()].iter().zip(&w.values[row]);
            velocity[0] = others.map(|(&j, w)| w * impulses[j as usize][0]).sum();
        }
        return judged(problem, impulses, norms, &velocity[..count]);
    }
    let mut spaced = [0.0; 4 * FEW];
    spread(impulses, &mut spaced[..size]);
    product(&made.couplings, w, &spaced[..size], &mut velocity[..count]);
    judged(problem, impulses, norms, &velocity)
}

/// The measures of impulses that add W r = `velocity` to the given velocities.
fn judged<const D: usize>(
    problem: &FrictionProblem,
    impulses: &[[f64; D]],
    norms: &[f64],
    velocity: &[[f64; D]],
) -> Measure {
    let (given, _) = problem.velocity.as_chunks::<D>();
    let size = not_zero(squared_length(&problem.velocity).sqrt());
    let top = not_zero(largest(&problem.velocity));
    let strongest = impulses.iter().map(|r| square(r)).fold(0.0, larger).sqrt().max(1e-300);
    let mut m = Measure::default();
    for (i, (r, &mu)) in impulses.iter().zip(&problem.friction).enumerate() {
        let u: [f64; D] = std::array::from_fn(|k| velocity[i][k] + given[i][k]);
        let slip = length(&u[1..]);
        let mut u_hat = u;
        u_hat[0] += mu * slip;
        m.natural += natural_map_squared(r, &u_hat, (1.0, 1.0), mu);
        m.scaled += natural_map_squared(r, &u_hat, (1.0 / norms[i], norms[i]), mu);
        let tangent = length(&r[1..]);
        m.cone = larger(larger(m.cone, tangent - mu * r[0]), -r[0]);
        m.penetration = larger(m.penetration, -u[0]);
        let power: f64 = r.iter().zip(&u_hat).map(|(r, u)| r * u).sum();
        m.complementarity = larger(m.complementarity, power.abs());
        if r[0] <= 1e-9 * strongest {
            m.take_off += 1;
        } else if tangent > 0.0 && tangent >= mu * r[0] * (1.0 - 1e-6) && slip > 1e-9 * top {
            m.slip += 1;
            let off = |k: usize| u[k] + slip / tangent * r[k];
            m.slip_alignment = m.slip_alignment.max((1..D).map(|k| off(k) * off(k)).sum::<f64>().sqrt());
        } else {
            m.stick += 1;
        }
    }
    // few divisions: they are a part of the time of small problems
    let [over_size, over_strongest, over_top] = [size, strongest, top].map(|size| 1.0 / size);
    m.natural = m.natural.sqrt() * over_size;
    m.scaled = m.scaled.sqrt() * over_size;
    m.cone *= over_strongest;
    m.penetration *= over_top;
    m.complementarity *= over_strongest * over_top;
    m.slip_alignment *= over_top;
    m
}
