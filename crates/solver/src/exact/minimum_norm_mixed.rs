//! The least impulses beside bounded rows, rolling and spinning friction and box friction (theory section 7.9). A moment
//! has another unit than an impulse, and no length of the problem makes them comparable; so moments come first: those
//! of contacts that do not roll or spin are the least, sum of squares in N^2 m^2 s^2, and of all impulses with these
//! moments contacts' and rows' are the least, sum of squares in the rows' own units (contacts': N^2 s^2). Structures at
//! rest that need no moments so carry what they carry without them. Moments of contacts that roll or spin are tied to
//! the normal impulse, and count with neither. Both searches are those of plain contacts, on wider faces.

use super::bodies::Rows;
use super::mass_roots::MassRoots;
use super::minimum_norm::{REST, Sought, Space as Systems};
use super::operator::Operator;
use super::whole_face::{Part, Pressed, WholeFace};
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, FrictionLaw, Impulse, Impulses, Twist};
use crate::resistance::PreparedResistance;
use carom_math::{Column, Space};

/// Unit of moments beside forces while the least moments are looked for, over the contacts' own lengths. Forces cost its
/// square, and a proximal term takes them out again: each round leaves about the square of what was off.
const SHORT: f64 = 1e-2;
/// Most rounds of it.
const ROUNDS: usize = 30;
/// Moments are known when a round changes them by less than this share of the largest normal impulse times the length.
const SETTLED: f64 = 1e-13;

/// The parts of a problem with the faces that the velocities of a solution allow; contacts first, then bounded rows.
/// Components: normal, tangents, moments.
struct Parts<'a, S: Space, const D: usize> {
    problem: &'a ContactProblem<S>,
    prepared: &'a Prepared<S>,
    roots: MassRoots,
    faces: Vec<WholeFace<D>>,
    /// Moment per normal impulse of contacts that roll or spin \[m\].
    tied: Vec<S::Spin>,
    /// The resistance of each contact.
    resisted: Vec<Option<usize>>,
    /// Largest velocity \[m/s\].
    size: f64,
    /// Unit of moments \[m\]; 0 where none is free.
    unit: f64,
}

/// The least impulses with the velocities of those found; `None` where no step leads to them. `ask` counts a
/// factorisation, and forbids it by false. D = 1 + SLIP + SPIN.
pub fn least<S: Space, const D: usize>(
    problem: &ContactProblem<S>,
    prepared: &Prepared<S>,
    found: &Impulses<S>,
    ask: &mut dyn FnMut() -> bool,
) -> Option<Impulses<S>> {
    let mut parts = Parts::<S, D>::of(problem, prepared, found);
    if parts.roots.count() == 0 {
        return None;
    }
    let mut x = parts.columns(found);
    if parts.unit > 0.0 {
        x = parts.least_moments(x, ask)?;
        parts.hold_moments(&x);
    }
    let moments = x.clone();
    x.iter_mut().for_each(|x| x[1 + S::SLIP..].fill(0.0));
    let zero = vec![[0.0; D]; x.len()];
    let forces = parts.nearest(&mut parts.systems(0.0), &x, &zero, ask)?;
    Some(parts.impulses(&forces, &moments))
}

/// The largest velocity error of no impulses at all \[m/s\], or 1.
pub fn largest_velocity<S: Space>(problem: &ContactProblem<S>, prepared: &Prepared<S>) -> f64 {
    let errors = prepared.velocity_errors(problem, &Impulses::zero(problem));
    let plain = errors.len() - problem.resistances.len() * S::SPIN;
    let turning = prepared.resistances.iter().zip(errors[plain..].chunks_exact(S::SPIN));
    let turning = turning.flat_map(|(r, w)| r.parts().map(|p| length(&w[p.first..p.end]) * p.length));
    let largest = errors[..plain].iter().map(|e| e.abs()).chain(turning).fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}

fn length(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Puts `factor` times a direction into `along`: that of an impulse, which knows it better than a slow slip does, or
/// against the slip.
fn tie(along: &mut [f64], impulse: &[f64], slip: &[f64], factor: f64) {
    let pulled = length(impulse);
    let (of, size) = if pulled > 0.0 { (impulse, pulled) } else { (slip, -length(slip)) };
    along.iter_mut().zip(of).for_each(|(a, v)| *a = factor * v / size);
}

impl<'a, S: Space, const D: usize> Parts<'a, S, D> {
    fn of(problem: &'a ContactProblem<S>, prepared: &'a Prepared<S>, found: &Impulses<S>) -> Self {
        let count = problem.contacts.len();
        let mut roots = MassRoots::default();
        roots.update(problem);
        let mut resisted = vec![None; count];
        problem.resistances.iter().enumerate().for_each(|(k, r)| resisted[r.contact] = Some(k));
        let mut parts = Parts {
            problem,
            prepared,
            roots,
            faces: Vec::new(),
            tied: vec![S::Spin::ZERO; count],
            resisted,
            size: largest_velocity(problem, prepared),
            unit: 0.0,
        };
        let errors = prepared.velocity_errors(problem, found);
        let width = 1 + S::SLIP;
        let (contacts, others) = errors.split_at(count * width);
        let (rows, spins) = others.split_at(problem.rows.len());
        let mut lengths = Vec::new();
        for (i, u) in contacts.chunks_exact(width).enumerate() {
            let spin = parts.resisted[i].map(|k| &spins[k * S::SPIN..][..S::SPIN]);
            let face = parts.face(i, u, spin, found, &mut lengths);
            parts.faces.push(face);
        }
        let rest = REST * parts.size;
        for (row, &error) in problem.rows.iter().zip(rows) {
            parts.faces.push(match error {
                e if e > rest && row.lo.is_finite() => WholeFace::Between(row.lo, row.lo),
                e if e < -rest && row.hi.is_finite() => WholeFace::Between(row.hi, row.hi),
                _ => WholeFace::Between(row.lo, row.hi),
            });
        }
        if !lengths.is_empty() {
            parts.unit = SHORT * lengths.iter().sum::<f64>() / lengths.len() as f64;
        }
        parts
    }

    /// The face of a contact with velocity error `u` and relative spin; `lengths` takes those of free moments.
    fn face(
        &mut self,
        i: usize,
        u: &[f64],
        spin: Option<&[f64]>,
        found: &Impulses<S>,
        lengths: &mut Vec<f64>,
    ) -> WholeFace<D> {
        let (rest, friction) = (REST * self.size, self.problem.contacts[i].friction);
        if u[0] > rest {
            return WholeFace::Open;
        }
        let mut pressed = Pressed { along: [0.0; D], parts: [Part::default(); 4], least: 0.0 };
        pressed.along[0] = 1.0;
        let mut used = 0;
        let mut free = |first: usize, count: usize, limit: f64| {
            pressed.parts[used] = Part { first, count, limit };
            used += 1;
        };
        let boxed = S::SLIP > 1 && self.problem.friction_law == FrictionLaw::Box;
        let step = if boxed { 1 } else { S::SLIP };
        for first in (1..=S::SLIP).step_by(step).filter(|_| friction > 0.0) {
            let own = first..first + step;
            if length(&u[own.clone()]) <= rest {
                free(first, step, friction);
            } else {
                let pulled = &found.contacts[i].tangent.as_slice()[first - 1..][..step];
                tie(&mut pressed.along[own.clone()], pulled, &u[own], friction);
            }
        }
        if let (Some(k), Some(spin)) = (self.resisted[i], spin) {
            let resistance: &PreparedResistance<S> = &self.prepared.resistances[k];
            for p in resistance.parts().filter(|p| p.limit > 0.0) {
                let own = p.first..p.end;
                if length(&spin[own.clone()]) * p.length <= rest {
                    free(1 + S::SLIP + p.first, p.end - p.first, p.limit);
                    lengths.push(p.length);
                } else {
                    let turned = &found.moments[k].as_slice()[own.clone()];
                    let mut tied = [0.0; 3];
                    tie(&mut tied[own.clone()], turned, &spin[own.clone()], p.limit);
                    own.for_each(|j| self.tied[i][j] = tied[j]);
                }
            }
        }
        WholeFace::Pressed(pressed)
    }

    /// Impulses as columns, moments in units of `unit`; those that are tied are not among them.
    fn columns(&self, impulses: &Impulses<S>) -> Vec<[f64; D]> {
        let mut all = vec![[0.0; D]; self.faces.len()];
        for (i, (x, g)) in all.iter_mut().zip(&impulses.contacts).enumerate() {
            x[0] = g.normal;
            x[1..=S::SLIP].copy_from_slice(g.tangent.as_slice());
            if let Some(k) = self.resisted[i] {
                for j in self.free_moments(i) {
                    x[j] = impulses.moments[k][j - 1 - S::SLIP] / self.unit;
                }
            }
        }
        for (x, l) in all[impulses.contacts.len()..].iter_mut().zip(&impulses.rows) {
            x[0] = *l;
        }
        all
    }

    /// Components of a contact that are moments and not tied.
    fn free_moments(&self, i: usize) -> impl Iterator<Item = usize> + use<S, D> {
        let parts = match self.faces[i] {
            WholeFace::Pressed(pressed) => pressed.parts,
            _ => [Part::default(); 4],
        };
        parts.into_iter().flat_map(|p| p.first..p.first + p.count).filter(|j| *j > S::SLIP)
    }

    /// The systems, and B, with moments in a unit \[m\]; 0 leaves them out.
    fn systems(&self, unit: f64) -> (Operator<D>, Systems<D>) {
        let mut rows =
            Rows { freedoms: S::DOF, bodies: self.roots.count(), pairs: Vec::new(), values: Vec::new() };
        let mut push = |bodies: [usize; 2], both: &[[Twist<S>; D]; 2]| {
            rows.pairs.push(bodies.map(|body| self.roots.place(body)));
            for (body, side) in bodies.into_iter().zip(both) {
                for row in side {
                    self.roots.push::<S>(body, (&row.linear, &row.angular), 1.0, &mut rows.values);
                }
            }
        };
        for (i, c) in self.prepared.contacts.iter().enumerate() {
            push([c.normal.a as usize, c.normal.b as usize], &self.contact_rows(i, unit));
        }
        for row in &self.problem.rows {
            let side = |on: Twist<S>| std::array::from_fn(|k| if k == 0 { on } else { Twist::default() });
            push([row.a, row.b], &[side(row.on_a), side(row.on_b)]);
        }
        let operator = Operator::Bodies(rows.clone());
        let norms = (0..operator.count()).map(|i| length(operator.diagonal_block(i).as_flattened()));
        let mean = norms.sum::<f64>() / operator.count() as f64;
        (operator, Systems::on_bodies(rows, mean))
    }

    /// The rows of J of one contact on its two bodies; what is tied to the normal impulse turns with it.
    fn contact_rows(&self, i: usize, unit: f64) -> [[Twist<S>; D]; 2] {
        let (c, contact) = (&self.prepared.contacts[i], &self.problem.contacts[i]);
        let mut both = [[Twist::default(); D]; 2];
        for k in 0..=S::SLIP {
            let row = if k == 0 { &c.normal } else { &c.tangents[k - 1] };
            both[0][k] = Twist::new(row.direction, row.moment_a);
            both[1][k] = Twist::new(-row.direction, -row.moment_b);
        }
        let tied = contact.moment_to_world(self.tied[i]);
        both[0][0].angular += tied;
        both[1][0].angular -= tied;
        for j in self.free_moments(i) {
            let one = S::Spin::from_fn(|k| if k == j - 1 - S::SLIP { unit } else { 0.0 });
            let axis = contact.moment_to_world(one);
            both[0][j] = Twist::new(S::Vector::ZERO, axis);
            both[1][j] = Twist::new(S::Vector::ZERO, -axis);
        }
        both
    }

    /// The point of the faces nearest to a centre with the velocities of `found`.
    fn nearest(
        &self,
        (operator, systems): &mut (Operator<D>, Systems<D>),
        found: &[[f64; D]],
        centre: &[[f64; D]],
        ask: &mut dyn FnMut() -> bool,
    ) -> Option<Vec<[f64; D]>> {
        let sought = Sought { operator, size: self.size, faces: &self.faces, found, centre };
        sought.find(systems, ask)
    }

    /// Impulses whose free moments are the least: proximal points in all but the moments.
    fn least_moments(
        &mut self,
        found: Vec<[f64; D]>,
        ask: &mut dyn FnMut() -> bool,
    ) -> Option<Vec<[f64; D]>> {
        let unit = self.unit;
        for face in &mut self.faces {
            if let WholeFace::Pressed(pressed) = face {
                let moments = pressed.parts.iter_mut().filter(|p| p.first > S::SLIP);
                moments.for_each(|p| p.limit /= unit);
            }
        }
        let mut systems = self.systems(unit);
        let mut x = vec![[0.0; D]; found.len()];
        for _ in 0..ROUNDS {
            let mut centre = x.clone();
            centre.iter_mut().for_each(|x| x[1 + S::SLIP..].fill(0.0));
            let next = self.nearest(&mut systems, &found, &centre, ask)?;
            let largest = next.iter().map(|x| x[0].abs()).fold(0.0, f64::max);
            let moved = next.iter().zip(&x).flat_map(|(a, b)| (1 + S::SLIP..D).map(|k| (a[k] - b[k]).abs()));
            let settled = moved.fold(0.0, f64::max) * SHORT <= SETTLED * largest;
            x = next;
            if settled {
                return Some(x);
            }
        }
        None
    }

    /// Takes free moments out of the faces: they are known, and ask for some normal impulse.
    fn hold_moments(&mut self, x: &[[f64; D]]) {
        for (face, x) in self.faces.iter_mut().zip(x) {
            if let WholeFace::Pressed(pressed) = face {
                for p in pressed.parts.iter_mut().filter(|p| p.first > S::SLIP && p.count > 0) {
                    pressed.least = pressed.least.max(length(&x[p.first..p.first + p.count]) / p.limit);
                    p.count = 0;
                }
            }
        }
    }

    /// Impulses from forces, and from the columns that hold the free moments.
    fn impulses(&self, forces: &[[f64; D]], moments: &[[f64; D]]) -> Impulses<S> {
        let mut all = Impulses::zero(self.problem);
        for (i, (g, x)) in all.contacts.iter_mut().zip(forces).enumerate() {
            *g = Impulse { normal: x[0], tangent: S::Slip::from_fn(|k| x[1 + k]) };
            if let Some(k) = self.resisted[i] {
                all.moments[k] =
                    S::Spin::from_fn(|j| x[0] * self.tied[i][j] + self.unit * moments[i][1 + S::SLIP + j]);
            }
        }
        for (l, x) in all.rows.iter_mut().zip(&forces[self.problem.contacts.len()..]) {
            *l = x[0];
        }
        all
    }
}
