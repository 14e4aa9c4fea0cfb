//! Stage A: Gauss-Seidel sweeps with the exact local solution, as long as they promise to be cheaper than the
//! interior point. Knows the problem in its own units.

use super::blocks::{Blocks, Section};
use super::couplings::{self, Couplings, places, spread};
use super::judge::{Errors, errors_of};
use super::local::Local;
use super::operator::Operator;
use super::row::row_times;
use crate::registers::in_fours;
use crate::watch::{Progress, Watch};
use pulp::{Simd, WithSimd};

/// How the sweeps ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ended {
    /// The errors are small enough.
    Solved,
    /// A factorising method is expected to be cheaper, or the sweeps are spent.
    LeftOff,
    /// Whoever watched asked to stop.
    Interrupted,
}

/// How far a sweep moved the impulses, as velocities; NaN included.
#[derive(Clone, Copy, Debug, Default)]
pub struct Change {
    /// Of the contact that moved most \[m/s\].
    pub largest: f64,
    /// Squares of all contacts added up \[m^2/s^2\].
    pub squared: f64,
}

/// What the solutions of single contacts need.
pub fn locals<const D: usize>(blocks: &Blocks<D>) -> Vec<Local<D>> {
    blocks.diagonal.iter().zip(&blocks.friction).map(|(w, &mu)| Local::new(w, mu)).collect()
}

struct Sweep<'a, const D: usize> {
    blocks: &'a Blocks<D>,
    locals: &'a mut [Local<D>],
    r: &'a mut [[f64; D]],
    bodies: &'a mut [f64],
}

impl<const D: usize> WithSimd for Sweep<'_, D> {
    type Output = Change;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Change {
        let Sweep { blocks, locals, r, bodies } = self;
        let mut change = Change::default();
        for (i, local) in locals.iter_mut().enumerate() {
            let mut b = match &blocks.operator {
                Operator::Matrix(m) => row_times(simd, m, i, r),
                Operator::Bodies(rows) => rows.relative(i, bodies),
            };
            let (old, block) = (r[i], &blocks.diagonal[i]);
            for k in 0..D {
                let own: f64 = (0..D).map(|c| block[k][c] * old[c]).sum();
                b[k] += blocks.velocity[i][k] - own;
            }
            let found = local.solve(&b, &old);
            let moved = change.add(blocks.norms[i], &found, &old);
            if let Operator::Bodies(rows) = &blocks.operator {
                rows.push(i, &moved, bodies);
            }
            r[i] = found;
        }
        Change { largest: change.largest.sqrt(), ..change }
    }
}

impl Change {
    /// Adds what one contact, whose block has this norm, moved; its largest is squared until the sweep ends.
    #[inline(always)]
    fn add<const D: usize>(&mut self, norm: f64, found: &[f64; D], old: &[f64; D]) -> [f64; D] {
        let mut moved = [0.0; D];
        let mut squared = 0.0;
        for k in 0..D {
            moved[k] = found[k] - old[k];
            squared += moved[k] * moved[k];
        }
        squared *= norm * norm;
        self.squared += squared;
        self.largest = if squared > self.largest || squared.is_nan() { squared } else { self.largest };
        moved
    }
}

/// Sweeps over couplings go by this factor beyond the solution of each contact: a quarter to a half fewer of them lead
/// as far. Theory has the best factor between 1.1, where each sweep leaves two fifths of the error, and 1.5 for nine tenths.
const RELAXATION: f64 = 1.2;

/// The same where W has couplings laid out for it; impulses lie `places` numbers apart, locals and they from the first
/// contact of the section on.
struct CoupledSweep<'a, const D: usize> {
    section: Section<'a, D>,
    couplings: &'a Couplings,
    locals: &'a mut [Local<D>],
    r: &'a mut [f64],
}

impl<const D: usize> WithSimd for CoupledSweep<'_, D> {
    type Output = Change;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Change {
        let CoupledSweep { section, couplings, locals, r } = self;
        let mut change = Change::default();
        let rows = couplings.rows::<D>(section.first);
        let given = section.velocity().iter().zip(section.norms()).zip(rows);
        for (i, (local, ((velocity, &norm), row))) in locals.iter_mut().zip(given).enumerate() {
            let b = row.pull(simd, velocity, r);
            let own = &mut r[i * places(D)..][..D];
            let mut old = [0.0; D];
            old.copy_from_slice(own);
            let found = local.solve_near::<S>(&b, &old);
            own.copy_from_slice(&local.beyond(&found, &old, RELAXATION));
            change.add(norm, &found, &old);
        }
        Change { largest: change.largest.sqrt(), ..change }
    }
}

/// One sweep over all contacts; `bodies` holds B^T r where W is given by rows on bodies.
pub fn sweep<const D: usize>(
    blocks: &Blocks<D>,
    locals: &mut [Local<D>],
    r: &mut [[f64; D]],
    bodies: &mut [f64],
) -> Change {
    in_fours(Sweep { blocks, locals, r, bodies })
}

/// u = W r + q; leaves B^T r in `bodies`.
pub fn velocities<const D: usize>(
    blocks: &Blocks<D>,
    r: &[[f64; D]],
    u: &mut [[f64; D]],
    bodies: &mut Vec<f64>,
) {
    blocks.operator.product(r, u, bodies);
    for (u, q) in u.iter_mut().zip(&blocks.velocity[..blocks.count()]) {
        for k in 0..D {
            u[k] += q[k];
        }
    }
}

/// Nanoseconds of a sweep per coupled pair and per contact of 1, 2 and 3 directions; the latter two through bodies.
const PER_COUPLING: [f64; 3] = [0.5, 0.8, 1.3];
const PER_CONTACT: [f64; 3] = [3.0, 5.0, 14.0];
const THROUGH_BODIES: [f64; 3] = [27.0, 27.0, 52.0];
/// What a sweep that is not over couplings takes \[ns\].
pub fn sweep_price<const D: usize>(blocks: &Blocks<D>) -> f64 {
    match &blocks.operator {
        Operator::Matrix(m) => {
            PER_COUPLING[D - 1] * m.graph.neighbours.len() as f64
                + THROUGH_BODIES[D - 1] * blocks.count() as f64
        }
        Operator::Bodies(_) => THROUGH_BODIES[D - 1] * blocks.count() as f64,
    }
}

/// Share of an interior point solve that sweeps may cost before they are asked what they lead to: couplings, bodies.
const TRIAL: [f64; 2] = [0.08, 0.15];

/// Share of an interior point solve that the sweeps that are left may cost: couplings, bodies. Forecasts on matrices grow
/// as sweeps go on, and condensed contacts make the interior point cheaper than its price.
const DEAR: [f64; 2] = [0.4, 0.7];

/// How fast the changes of the sweeps fall, and what error goes with a change.
#[derive(Clone, Debug, Default)]
struct Decay {
    changes: Vec<f64>,
    /// Error over change when it was last measured.
    error_over_change: f64,
}

impl Decay {
    /// Nothing is known yet.
    fn begin(&mut self) {
        self.changes.clear();
        self.changes.reserve(USUAL);
        self.error_over_change = 1.0;
    }
    /// The error expected now.
    fn error(&self) -> f64 {
        self.error_over_change * self.changes.last().copied().unwrap_or(f64::INFINITY)
    }
    /// Sweeps left until the error is at the tolerance. They slow down as what falls fast is gone: how far off the end
    /// seemed half of the sweeps ago says by how much; infinite when the changes do not fall.
    fn left(&self, tolerance: f64) -> f64 {
        let (now, before) = (self.changes.len(), self.changes.len() / 2);
        let (left, then) = (self.left_after(now, tolerance), self.left_after(before, tolerance));
        let later = (now as f64 + left - before as f64 - then) / (now - before) as f64;
        // an end that was not in sight does not recede
        left * (1.0 + if later > 0.0 { later } else { 0.0 })
    }
    /// Sweeps left after n of them as though they fell on as they do.
    fn left_after(&self, n: usize, tolerance: f64) -> f64 {
        let span = 4.min(n - 1);
        let fall = self.changes[n - 1] / self.changes[n - 1 - span];
        if fall < 1.0 {
            let error = self.error_over_change * self.changes[n - 1];
            (span as f64 * libm::log(tolerance / error) / libm::log(fall)).max(0.0)
        } else {
            f64::INFINITY
        }
    }
}

/// What sweeps need beside the problem, kept from solve to solve.
#[derive(Clone, Debug, Default)]
pub struct SweepMemory<const D: usize> {
    locals: Vec<Local<D>>,
    decay: Decay,
    /// B^T r.
    bodies: Vec<f64>,
    /// r as sweeps over couplings keep it.
    spaced: Vec<f64>,
    best: Vec<[f64; D]>,
}

impl<const D: usize> SweepMemory<D> {
    /// Gets ready for sweeps from r over the contacts of a problem, or of its parts one after another.
    pub fn begin(&mut self, blocks: &Blocks<D>, r: &[[f64; D]]) {
        self.locals.clear();
        let diagonal = blocks.diagonal.iter().zip(&blocks.friction);
        self.locals.extend(diagonal.map(|(w, &mu)| Local::new(w, mu)));
        self.spaced.clear();
        if blocks.couplings.is_some() {
            self.spaced.resize(blocks.count() * places(D), 0.0);
            spread(r, &mut self.spaced);
        }
        self.best.clear();
        self.best.extend_from_slice(r);
    }
    /// One sweep over r, or over what is kept of it.
    fn sweep(&mut self, section: Section<'_, D>, r: &mut [[f64; D]]) -> Change {
        let SweepMemory { locals, spaced, bodies, .. } = self;
        match &section.blocks.couplings {
            Some(couplings) => {
                let locals = &mut locals[section.range()];
                let r = &mut spaced[section.first * places(D)..][..section.count * places(D)];
                in_fours(CoupledSweep { section, couplings, locals, r })
            }
            None => sweep(section.blocks, locals, r, bodies),
        }
    }
    /// Brings r to where the sweeps are, and measures it.
    fn measure(&mut self, section: Section<'_, D>, r: &mut [[f64; D]], u: &mut [[f64; D]]) -> Errors {
        let (r_own, u_own) = (&mut r[..section.count], &mut u[..section.count]);
        match &section.blocks.couplings {
            Some(couplings) => {
                let spaced = &self.spaced[section.first * places(D)..][..section.count * places(D)];
                let each = spaced.chunks_exact(places(D));
                r_own.iter_mut().zip(each).for_each(|(r, spaced)| r.copy_from_slice(&spaced[..D]));
                couplings::velocities(couplings.rows(section.first), section.velocity(), spaced, u_own);
            }
            None => velocities(section.blocks, r, u, &mut self.bodies),
        }
        errors_of(section, r, u)
    }
    /// Measures the start; where W has couplings and there are no impulses, nothing is multiplied, and nothing is
    /// measured where a contact approaches so fast that its error alone is too large.
    fn measure_start(
        &mut self,
        section: Section<'_, D>,
        too_fast: f64,
        (r, u): (&mut [[f64; D]], &mut [[f64; D]]),
    ) -> Errors {
        let count = section.count;
        if section.blocks.couplings.is_none() || r[..count].iter().any(|r| *r != [0.0; D]) {
            return self.measure(section, r, u);
        }
        let given = &section.velocity()[..count];
        // of -u_hat the cone is -u_N / sqrt(1 + mu^2) away from the origin
        let approaches = |(q, mu): (&[f64; D], &f64)| -q[0] > too_fast * (1.0 + mu);
        if given.iter().zip(section.friction()).any(approaches) {
            return Errors::default();
        }
        u[..count].copy_from_slice(given);
        errors_of(section, r, u)
    }
}

/// What sweeps cost and what is done instead, in nanoseconds.
struct Prices {
    sweep: f64,
    interior_point: f64,
    contacts: f64,
    /// Share of an interior point solve that is far for sweeps whose errors are spread.
    far: f64,
    /// Sweeps run through bodies, where starts are mostly warm and fall steadily.
    through_bodies: bool,
}

impl Prices {
    fn of<const D: usize>(section: Section<'_, D>) -> Self {
        let (contacts, couplings) = (section.count as f64, section.pairs() as f64);
        let through_bodies_alone = section.blocks.couplings.is_none();
        let through_couplings = PER_COUPLING[D - 1] * couplings + PER_CONTACT[D - 1] * contacts;
        let through_bodies = THROUGH_BODIES[D - 1] * contacts;
        Prices {
            contacts,
            far: FAR[D - 1],
            sweep: if through_bodies_alone { through_bodies } else { through_couplings },
            through_bodies: through_bodies_alone,
            interior_point: 14.0 * (250.0 * contacts + 30.0 * couplings) + 2000.0,
        }
    }
    /// True where errors are spread over many contacts and sweeps, which fall fastest at first, are far from the end at the
    /// pace that they have: no later stage needs what more of them would find.
    fn say_hopeless(&self, k: usize, decay: &Decay, tolerance: f64) -> bool {
        if self.through_bodies
            || k < HOPELESS
            || !k.is_multiple_of(LOOK[0])
            || !(decay.error() * self.contacts > SPREAD)
        {
            return false;
        }
        let left = decay.left_after(k, tolerance);
        left * self.sweep > self.far * self.interior_point && (left.is_finite() || k > HOPELESS)
    }
    /// True where k sweeps are spent and those that are left are expected to cost more than an interior point.
    fn say_stop(&self, k: usize, decay: &Decay, tolerance: f64) -> bool {
        let spent = k as f64 * self.sweep;
        let bodies = usize::from(self.through_bodies);
        if self.say_hopeless(k, decay, tolerance) {
            return true;
        }
        if k < LEARNING || !k.is_multiple_of(LOOK[bodies]) || spent <= TRIAL[bodies] * self.interior_point {
            return false;
        }
        let left = if self.through_bodies { decay.left_after(k, tolerance) } else { decay.left(tolerance) };
        let need = left * self.sweep;
        need > DEAR[bodies] * self.interior_point
            || (spent > 0.6 * self.interior_point && need > 0.3 * self.interior_point)
    }
}

/// Sweeps before they may be said to lead nowhere, and errors times contacts that are spread wide.
const HOPELESS: usize = 8;
const SPREAD: f64 = 20.0;
/// Share of an interior point solve that what is left of sweeps may cost then, by directions: in the plane lattices fall
/// as steadily to the end as they begin.
const FAR: [f64; 3] = [0.4, 0.4, 0.2];
/// Sweeps before their decay says anything.
const LEARNING: usize = 6;
/// An error that looks no larger than so many tolerances after them is measured: few sweeps more are needed.
const SOON: f64 = 100.0;
/// Sweeps between two looks at what they lead to: couplings, bodies.
const LOOK: [usize; 2] = [4, 1];
/// More sweeps are rare.
const USUAL: usize = 64;

/// Sweeps until solved or until more sweeps cost more than an interior point solve, and leaves the best impulses in r,
/// the start among them; where they solve the problem also their velocities in u. Costs in nanoseconds on one core of 2026,
/// from the sizes alone, so that the choice is the same everywhere. The error is measured when the changes promise that it is
/// small enough, and now and then. Impulses and velocities from the first contact of the section on; `memory` has begun.
pub fn sweeps<const D: usize>(
    section: Section<'_, D>,
    (tolerance, most): (f64, usize),
    (r, u): (&mut [[f64; D]], &mut [[f64; D]]),
    memory: &mut SweepMemory<D>,
    watch: &mut Watch,
) -> (usize, Errors, Ended) {
    let (count, contacts) = (section.count, section.range());
    let (prices, size) = (Prices::of(section), section.size());
    memory.decay.begin();
    let too_fast = if most > 0 { 2.0 * tolerance * size } else { f64::INFINITY };
    let mut found = memory.measure_start(section, too_fast, (r, u));
    if found.solves(tolerance) {
        return (0, found, Ended::Solved);
    }
    let mut best = found;
    let mut end = (0, Ended::LeftOff);
    let mut measured = 0;
    for k in 1..=most {
        end.0 = k;
        let change = memory.sweep(section, r);
        let change = if section.blocks.by_contact { change.largest } else { change.squared.sqrt() } / size;
        let decay = &mut memory.decay;
        decay.changes.push(change);
        let over = k == most || !change.is_finite();
        let leave = over || prices.say_stop(k, decay, tolerance);
        let soon = !prices.through_bodies && k == LEARNING && decay.error() < SOON * tolerance;
        if !(leave || soon) && decay.error() > tolerance && k < measured + k / 2 + LEARNING {
            continue;
        }
        measured = k;
        found = memory.measure(section, r, u);
        if found.solves(tolerance) {
            return (k, found, Ended::Solved);
        }
        if found.worst() < best.worst() {
            best = found;
            memory.best[contacts.clone()].copy_from_slice(&r[..count]);
        }
        if !watch(&Progress { stage: "sweeps", iterations: k, residual: found.worst() }) {
            end.1 = Ended::Interrupted;
            break;
        }
        if change > 0.0 {
            memory.decay.error_over_change = found.worst() / change;
        }
        // what the error is may speak for going on, where most starts are cold
        let goes_on = !prices.through_bodies && !prices.say_stop(k, &memory.decay, tolerance);
        if leave && (over || !goes_on) {
            break;
        }
    }
    r[..count].copy_from_slice(&memory.best[contacts]);
    (end.0, best, end.1)
}
