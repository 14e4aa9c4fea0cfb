//! What impulses are worth to a friction problem, whoever found them. Contacts lie side by side in registers; sums are
//! those of any width.

use crate::delassus_blocks::Made;
use crate::exact::blocks::squared_length;
use crate::exact::cone::{dot, tangent, tangent_dot};
use crate::exact::couplings::{places, spread, velocities};
use crate::exact::lane::{Lane, Lanes, PACK, Sum, lanes, live, load};
use crate::friction_problem::{FrictionProblem, larger};
use crate::registers::{ABREAST, in_fours, in_widest};
use pulp::{Scalar, Simd, WithSimd};

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
    let made = &*problem.matrix.made(D);
    let (r, _) = impulses.as_chunks::<D>();
    let (given, _) = problem.velocity.as_chunks::<D>();
    let size = r.len() * places(D);
    if let ([alone], [given]) = (r, given) {
        let row = |k: usize| (0..D).map(|c| made.matrix.values[k * D + c] * alone[c]).sum::<f64>() + given[k];
        return judged_by(problem, made, r, &[std::array::from_fn(row)]);
    }
    if r.len() > FEW {
        let (mut spaced, mut u) = (vec![0.0; size], vec![[0.0; D]; r.len()]);
        spread(r, &mut spaced);
        velocities(made.couplings.rows(0), given, &spaced, &mut u);
        return judged_by(problem, made, r, &u);
    }
    let (mut spaced, mut u) = ([0.0; 4 * FEW], [[0.0; D]; FEW]);
    if D == 1 {
        // one after another: what is laid out for registers would take longer to ask for
        let graph = &made.matrix.graph;
        for (i, u) in u[..r.len()].iter_mut().enumerate() {
            let row = graph.row(i);
            let others = graph.neighbours[row.clone()].iter().zip(&made.matrix.values[row]);
            u[0] = others.map(|(&j, w)| w * r[j as usize][0]).sum::<f64>() + given[i][0];
        }
        return judged_by(problem, made, r, &u[..r.len()]);
    }
    spread(r, &mut spaced[..size]);
    velocities(made.couplings.rows(0), given, &spaced[..size], &mut u[..r.len()]);
    judged_by(problem, made, r, &u[..r.len()])
}

/// Up to so many contacts of 1, 2 and 3 directions are measured one after another.
const ALONE: [usize; 3] = [FEW, 4, 3];

/// The measures of impulses r with u = W r + q.
pub(crate) fn judged<const D: usize>(problem: &FrictionProblem, r: &[[f64; D]], u: &[[f64; D]]) -> Measure {
    judged_by(problem, &problem.matrix.made(D), r, u)
}

/// The same with what is read of W.
fn judged_by<const D: usize>(
    problem: &FrictionProblem,
    made: &Made,
    r: &[[f64; D]],
    u: &[[f64; D]],
) -> Measure {
    let given = Given { friction: &problem.friction, norms: &made.norms, r, u };
    let not_zero = |x: f64| if x > 0.0 { x } else { 1.0 };
    let size = not_zero(squared_length(&problem.velocity).sqrt());
    let top = not_zero(largest(&problem.velocity));
    let strongest = strongest(r).sqrt().max(1e-300);
    let pass = Pass { given, small: (1e-9 * strongest, 1e-9 * top) };
    let found = match r.len() {
        few if few <= ALONE[D - 1] && D == 1 => pass.of_lines(),
        few if few <= ALONE[D - 1] => in_fours(OneByOne(pass)),
        _ => in_widest(pass),
    };
    // few divisions: they are a part of the time of small problems
    let [over_size, over_strongest, over_top] = [size, strongest, top].map(|size| 1.0 / size);
    Measure {
        natural: found.natural.sqrt() * over_size,
        scaled: found.scaled.sqrt() * over_size,
        cone: found.cone * over_strongest,
        penetration: found.penetration * over_top,
        complementarity: found.power * (over_strongest * over_top),
        slip_alignment: found.astray.sqrt() * over_top,
        take_off: found.take_off,
        stick: r.len() - found.take_off - found.slip,
        slip: found.slip,
    }
}

/// The largest size of a number; what is none is passed over.
fn largest(numbers: &[f64]) -> f64 {
    most_of(numbers, |x| x.abs())
}

/// The square of the largest impulse.
fn strongest<const D: usize>(r: &[[f64; D]]) -> f64 {
    most_of(r, |r| r.iter().map(|x| x * x).sum::<f64>())
}

/// The largest of what items have, side by side where there are many.
#[inline(always)]
fn most_of<T>(items: &[T], size: impl Fn(&T) -> f64) -> f64 {
    let (packs, rest) = items.as_chunks::<ABREAST>();
    let found = rest.iter().map(&size).fold(0.0, larger);
    if packs.is_empty() {
        return found;
    }
    let mut most = [found; ABREAST];
    for pack in packs {
        (0..ABREAST).for_each(|k| most[k] = larger(most[k], size(&pack[k])));
    }
    most.into_iter().fold(0.0, larger)
}

/// What contacts are measured by.
#[derive(Clone, Copy)]
struct Given<'a, const D: usize> {
    friction: &'a [f64],
    norms: &'a [f64],
    r: &'a [[f64; D]],
    u: &'a [[f64; D]],
}

/// The same of the last contacts; those that there are not rest and carry nothing.
struct Last<const D: usize> {
    friction: [f64; PACK],
    norms: [f64; PACK],
    r: [[f64; D]; PACK],
    u: [[f64; D]; PACK],
}

impl<const D: usize> Last<D> {
    fn of(given: &Given<'_, D>, first: usize) -> Self {
        Last {
            friction: last(&given.friction[first..], 0.0),
            norms: last(&given.norms[first..], 1.0),
            r: last(&given.r[first..], [0.0; D]),
            u: last(&given.u[first..], [0.0; D]),
        }
    }
    fn given(&self) -> Given<'_, D> {
        Given { friction: &self.friction, norms: &self.norms, r: &self.r, u: &self.u }
    }
}

/// Fewer numbers than a pack, and what stands for those that there are not.
fn last<T: Copy>(numbers: &[T], none: T) -> [T; PACK] {
    let mut out = [none; PACK];
    out[..numbers.len()].copy_from_slice(numbers);
    out
}

/// Sums and largest numbers over contacts.
#[derive(Default)]
struct Totals {
    natural: f64,
    scaled: f64,
    cone: f64,
    penetration: f64,
    power: f64,
    /// Squared.
    astray: f64,
    take_off: usize,
    slip: usize,
}

/// Measures all contacts: an impulse below the first number is none, a slip below the second neither.
struct Pass<'a, const D: usize> {
    given: Given<'a, D>,
    small: (f64, f64),
}

impl<const D: usize> Pass<'_, D> {
    /// Without friction: r >= 0, u >= 0 and the smaller of r / step and u, plainly, for few contacts wait for no registers.
    fn of_lines(self) -> Totals {
        let Given { norms, r, u, .. } = self.given;
        let mut all = Totals::default();
        let smaller = |a: f64, b: f64| if a < b { a } else { b };
        for ((r, u), norm) in r.iter().zip(u).zip(norms) {
            let (r, u) = (r[0], u[0]);
            let (own, scaled) = (smaller(r, u), smaller(r * norm, u));
            all.natural += own * own;
            all.scaled += scaled * scaled;
            all.cone = larger(all.cone, -r);
            all.penetration = larger(all.penetration, -u);
            all.power = larger(all.power, (r * u).abs());
            all.take_off += usize::from(r <= self.small.0);
        }
        all
    }
}

impl<const D: usize> WithSimd for Pass<'_, D> {
    type Output = Totals;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Totals {
        let Pass { given, small } = self;
        let count = given.r.len();
        let mut sums = Sums::new(simd, small);
        let whole = count - count % S::F64_LANES;
        for first in (0..whole).step_by(S::F64_LANES) {
            sums.add(first, given.at(simd, first), live(simd, 0, PACK));
        }
        if whole < count {
            let rest = Last::of(&given, whole);
            sums.add(whole, rest.given().at(simd, 0), live(simd, whole, count));
        }
        sums.totals()
    }
}

/// The same one after another, in the machine's own instructions.
struct OneByOne<'a, const D: usize>(Pass<'a, D>);

impl<const D: usize> WithSimd for OneByOne<'_, D> {
    type Output = Totals;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Totals {
        self.0.with_simd(Scalar::new())
    }
}

/// Contacts with their impulses, velocities, friction and norms.
struct Place<S: Simd, const D: usize> {
    r: Lanes<S, D>,
    u: Lanes<S, D>,
    mu: Lane<S>,
    norm: Lane<S>,
}

impl<const D: usize> Given<'_, D> {
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, first: usize) -> Place<S, D> {
        Place {
            r: load(simd, self.r, first),
            u: load(simd, self.u, first),
            mu: Lane::load(simd, &self.friction[first..]),
            norm: Lane::load(simd, &self.norms[first..]),
        }
    }
}

/// How near the edge of the cone an impulse is on it.
const EDGE: f64 = 1.0 - 1e-6;

/// What is known so far.
struct Sums<S: Simd> {
    /// What is no impulse, and no slip.
    small: Lane<S>,
    still: Lane<S>,
    natural: Sum,
    scaled: Sum,
    cone: Lane<S>,
    penetration: Lane<S>,
    power: Lane<S>,
    astray: Lane<S>,
    take_off: Lane<S>,
    slip: Lane<S>,
}

impl<S: Simd> Sums<S> {
    #[inline(always)]
    fn new(simd: S, (small, still): (f64, f64)) -> Self {
        let zero = Lane::all(simd, 0.0);
        Sums {
            small: zero.like(small),
            still: zero.like(still),
            natural: Sum::default(),
            scaled: Sum::default(),
            cone: zero,
            penetration: zero,
            power: zero,
            astray: zero,
            take_off: zero,
            slip: zero,
        }
    }
    /// Adds the contacts from `first` on that are there.
    #[inline(always)]
    fn add<const D: usize>(&mut self, first: usize, at: Place<S, D>, there: Lane<S>) {
        let Place { r, u, mu, norm } = at;
        let (zero, one) = (mu.like(0.0), mu.like(1.0));
        let (slip, rubbed) = (tangent(u), tangent(r));
        let mut u_hat = u;
        u_hat[0] = mu.mul_add(slip, u[0]);
        self.natural.add(first, natural_map_squared((r, u_hat, mu, rubbed), (one, one)));
        self.scaled.add(first, natural_map_squared((r, u_hat, mu, rubbed), (one / norm, norm)));
        self.cone = most(most(self.cone, rubbed - mu * r[0]), -r[0]);
        self.penetration = most(self.penetration, -u[0]);
        self.power = most(self.power, dot(r, u_hat).abs());
        let presses = r[0].if_at_most(self.small, zero, there);
        let on_edge = rubbed.if_less(mu * r[0] * one.like(EDGE), zero, presses);
        let slips = self.still.if_less(slip, zero.if_less(rubbed, on_edge, zero), zero);
        self.take_off = self.take_off + (there - presses);
        if S::F64_LANES == 1 && slips.greatest() <= 0.0 {
            return;
        }
        self.slip = self.slip + slips;
        let turn = slip / rubbed;
        let off = lanes!(zero; k => turn.mul_add(r[k], u[k]));
        self.astray = most(self.astray, zero.if_less(slips, tangent_dot(off, off), zero));
    }
    #[inline(always)]
    fn totals(self) -> Totals {
        Totals {
            natural: self.natural.total(),
            scaled: self.scaled.total(),
            cone: self.cone.greatest(),
            penetration: self.penetration.greatest(),
            power: self.power.greatest(),
            astray: self.astray.greatest(),
            take_off: self.take_off.sum() as usize,
            slip: self.slip.sum() as usize,
        }
    }
}

/// The larger of two numbers, `a` where b is none.
#[inline(always)]
fn most<S: Simd>(a: Lane<S>, b: Lane<S>) -> Lane<S> {
    a.if_less(b, b, a)
}

/// |(r - P_K(r - step u_hat)) / step|^2 \[m^2/s^2\] from |r_T|, with one over the step. In each case of the projection the
/// difference is taken by hand: impulses so huge that r - step u_hat rounds to r hide no velocity.
#[inline(always)]
fn natural_map_squared<S: Simd, const D: usize>(
    (r, u_hat, mu, rubbed): (Lanes<S, D>, Lanes<S, D>, Lane<S>, Lane<S>),
    (step, inverse): (Lane<S>, Lane<S>),
) -> Lane<S> {
    let zero = mu.like(0.0);
    let x = lanes!(zero; k => r[k] - step * u_hat[k]);
    let (squared, normal, slope) = (tangent_dot(x, x), x[0] * x[0], mu * mu);
    let (inside, behind) = (dot(u_hat, u_hat), dot(r, r) * (inverse * inverse));
    let cases = Cases { x, flat: (squared, normal), slope, inside, behind };
    if D == 1 || (S::F64_LANES == 1 && cases.choose(-mu.like(1.0)).greatest() >= 0.0) {
        return cases.choose(zero);
    }
    let lean = tangent(x);
    // r - P(x) = step u_hat + g (-mu, t), g (1 + mu^2) = |x_T| - mu x_N, t = x_T / |x_T|
    let twice = tangent_dot(r, u_hat) + tangent_dot(r, u_hat);
    let longer = (step * tangent_dot(u_hat, u_hat) - twice) / (lean + rubbed);
    let over = (rubbed - mu * r[0]) * inverse + longer + mu * u_hat[0];
    let g = over / (slope + mu.like(1.0));
    let along = g / lean;
    let mut off = lanes!(zero; k => along.mul_add(x[k], u_hat[k]));
    off[0] = u_hat[0] - g * mu;
    cases.choose(dot(off, off))
}

/// Where x = r - step u_hat is, and what the map is inside the cone and behind it.
#[derive(Clone, Copy)]
struct Cases<S: Simd, const D: usize> {
    x: Lanes<S, D>,
    /// |x_T|^2 and x_N^2.
    flat: (Lane<S>, Lane<S>),
    /// mu^2.
    slope: Lane<S>,
    inside: Lane<S>,
    behind: Lane<S>,
}

impl<S: Simd, const D: usize> Cases<S, D> {
    /// The map, `beside` where x is neither inside the cone nor behind it.
    #[inline(always)]
    fn choose(&self, beside: Lane<S>) -> Lane<S> {
        let Cases { x, flat: (squared, normal), slope, inside, behind } = *self;
        let zero = slope.like(0.0);
        let below = x[0].if_at_most(zero, (slope * squared).if_at_most(normal, behind, beside), beside);
        zero.if_at_most(x[0], squared.if_at_most(slope * normal, inside, below), below)
    }
}
