//! Contacts on bodies in packs of eight that share no body, so that sweeps solve eight at once, in lanes. What a sweep
//! reads of a pack lies one after another, each quantity of the eight side by side. A pack reads and writes eight pairs of
//! bodies at a time; which contact stands where depends on who touches whom alone, so answers are the same on registers of any
//! width.

use super::blocks::Blocks;
use super::bodies::{NO_BODY, Rows};
use super::lane::{Lane, Lanes, PACK};
use super::local::Local;
use super::local_lanes::{self, GIVEN};
use crate::registers::in_widest;
use pulp::{Simd, WithSimd};

/// Each number of eight contacts side by side.
pub type Eight = [f64; PACK];

/// No contact.
const NOBODYS: u32 = u32::MAX;
/// Packs that are filled at a time.
const OPEN: usize = 32;

/// The contacts of a problem in packs.
#[derive(Clone, Debug, Default)]
pub struct Packs<const D: usize> {
    freedoms: usize,
    bodies: usize,
    /// The contacts of each pack.
    members: Vec<[u32; PACK]>,
    /// Their two bodies; one more than there are, at rest, for what no impulse moves.
    pairs: Vec<[[u32; PACK]; 2]>,
    /// Per pack: rows on the first bodies, D x freedoms, on the second, velocities q, and what `local_lanes` reads.
    given: Vec<Eight>,
    /// alpha of the last slip, per pack.
    alphas: Vec<Eight>,
}

/// A pack that is being filled, with its bodies.
struct Open {
    pack: usize,
    contacts: usize,
    bodies: [u32; 2 * PACK],
}

/// Contacts in packs of those that share no body, each in the first that has room.
fn packs(pairs: &[[u32; 2]]) -> Vec<[u32; PACK]> {
    let mut members: Vec<[u32; PACK]> = Vec::with_capacity(pairs.len() / PACK + OPEN);
    let mut open: Vec<Open> = Vec::with_capacity(OPEN);
    for (i, pair) in pairs.iter().enumerate() {
        let free = |o: &Open| pair.iter().all(|b| *b == NO_BODY || !o.bodies.contains(b));
        let at = open.iter().position(free).unwrap_or_else(|| {
            if open.len() == OPEN {
                open.remove(0);
            }
            open.push(Open { pack: members.len(), contacts: 0, bodies: [NO_BODY; 2 * PACK] });
            members.push([NOBODYS; PACK]);
            open.len() - 1
        });
        let chosen = &mut open[at];
        members[chosen.pack][chosen.contacts] = i as u32;
        chosen.bodies[2 * chosen.contacts..][..2].copy_from_slice(pair);
        chosen.contacts += 1;
        if chosen.contacts == PACK {
            open.remove(at);
        }
    }
    members
}

impl<const D: usize> Packs<D> {
    /// Those of a problem whose W is given by these rows.
    pub fn of(blocks: &Blocks<D>, rows: &Rows<D>) -> Self {
        let members = packs(&rows.pairs);
        let stride = stride::<D>(rows.freedoms);
        let mut pairs = vec![[[rows.bodies as u32; PACK]; 2]; members.len()];
        let mut given = vec![[0.0; PACK]; members.len() * stride];
        let places = pairs.iter_mut().zip(given.chunks_exact_mut(stride));
        for (members, (pairs, given)) in members.iter().zip(places) {
            for (lane, &i) in members.iter().enumerate().filter(|m| *m.1 != NOBODYS) {
                let i = i as usize;
                for side in (0..2).filter(|&side| rows.pairs[i][side] != NO_BODY) {
                    pairs[side][lane] = rows.pairs[i][side];
                }
                write(blocks, rows, i, |place, value| given[place][lane] = value);
            }
        }
        let alphas = vec![[0.0; PACK]; members.len()];
        Packs { freedoms: rows.freedoms, bodies: rows.bodies, members, pairs, given, alphas }
    }
    /// B^T r of the bodies, with room for one at rest.
    pub fn seat(&self, bodies: &mut Vec<f64>) {
        bodies.resize((self.bodies + 1) * self.freedoms, 0.0);
    }
    /// Puts vectors over contacts into the packs' order.
    pub fn spread(&self, r: &[[f64; D]]) -> Vec<f64> {
        let mut out = vec![0.0; self.members.len() * D * PACK];
        for (pack, members) in out.as_chunks_mut::<PACK>().0.chunks_exact_mut(D).zip(&self.members) {
            for (lane, &i) in members.iter().enumerate().filter(|m| *m.1 != NOBODYS) {
                (0..D).for_each(|k| pack[k][lane] = r[i as usize][k]);
            }
        }
        out
    }
    /// Puts what lies in the packs' order back into that of the contacts.
    pub fn collect(&self, own: &[f64], r: &mut [[f64; D]]) {
        for (pack, members) in own.as_chunks::<PACK>().0.chunks_exact(D).zip(&self.members) {
            for (lane, &i) in members.iter().enumerate().filter(|m| *m.1 != NOBODYS) {
                (0..D).for_each(|k| r[i as usize][k] = pack[k][lane]);
            }
        }
    }
    /// One sweep; r in the packs' order.
    pub fn sweep(&mut self, blocks: &Blocks<D>, r: &mut [f64], bodies: &mut [f64]) {
        in_widest(Sweep { packs: self, blocks, r, bodies });
    }
}

/// Numbers of a contact with bodies of so many freedoms.
const fn stride<const D: usize>(freedoms: usize) -> usize {
    2 * D * freedoms + D + GIVEN[D - 1]
}

/// Tells the numbers of a contact, place by place.
fn write<const D: usize>(blocks: &Blocks<D>, rows: &Rows<D>, i: usize, mut put: impl FnMut(usize, f64)) {
    let width = D * rows.freedoms;
    for side in (0..2).filter(|&side| rows.pairs[i][side] != NO_BODY) {
        let values = &rows.values[(2 * i + side) * width..][..width];
        values.iter().enumerate().for_each(|(k, value)| put(side * width + k, *value));
    }
    let mut place = 2 * width;
    let mut next = |value: f64| {
        put(place, value);
        place += 1;
    };
    blocks.velocity[i].iter().for_each(|q| next(*q));
    let block = &blocks.diagonal[i];
    for k in 0..D {
        (k..D).for_each(|c| next(block[k][c]));
    }
    next(if block[0][0] > 0.0 { 1.0 / block[0][0] } else { 0.0 });
    next(blocks.friction[i]);
}

struct Sweep<'a, const D: usize> {
    packs: &'a mut Packs<D>,
    blocks: &'a Blocks<D>,
    r: &'a mut [f64],
    bodies: &'a mut [f64],
}

impl<const D: usize> WithSimd for Sweep<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.packs.freedoms {
            3 => self.over_bodies::<S, 3>(simd),
            _ => self.over_bodies::<S, 6>(simd),
        }
    }
}

impl<const D: usize> Sweep<'_, D> {
    #[inline(always)]
    fn over_bodies<S: Simd, const F: usize>(self, simd: S) {
        let Sweep { packs, blocks, r, bodies } = self;
        let bodies = bodies.as_chunks_mut::<F>().0;
        let places = packs.pairs.iter().zip(packs.given.chunks_exact(stride::<D>(F)));
        let state = packs.alphas.iter_mut().zip(r.as_chunks_mut::<PACK>().0.chunks_exact_mut(D));
        for ((members, (pairs, given)), (alphas, r)) in packs.members.iter().zip(places).zip(state) {
            for first in (0..PACK).step_by(S::F64_LANES) {
                let missed = part::<S, D, F>(simd, first, (pairs, given), (alphas, r), bodies);
                if missed != [0.0; PACK] {
                    for lane in (first..first + S::F64_LANES).filter(|&lane| missed[lane] != 0.0) {
                        alone::<D, F>((members[lane] as usize, lane), blocks, (pairs, given), r, bodies);
                    }
                }
            }
        }
    }
}

/// Eight numbers of a pack, those from `first` on.
#[inline(always)]
fn lane<S: Simd>(simd: S, eight: &Eight, first: usize) -> Lane<S> {
    Lane::load(simd, &eight[first..])
}

/// The velocities of bodies.
#[inline(always)]
fn gather<S: Simd, const F: usize>(simd: S, at: &[u32], bodies: &[[f64; F]]) -> [Lane<S>; F] {
    let mut turned = [[0.0; PACK]; F];
    for (lane, &b) in at.iter().enumerate().take(S::F64_LANES) {
        let body = &bodies[b as usize];
        for j in 0..F {
            turned[j][lane] = body[j];
        }
    }
    let mut out = [Lane::all(simd, 0.0); F];
    for j in 0..F {
        out[j] = Lane::load(simd, &turned[j]);
    }
    out
}

/// Puts them back.
#[inline(always)]
fn scatter<S: Simd, const F: usize>(values: [Lane<S>; F], at: &[u32], bodies: &mut [[f64; F]]) {
    let mut turned = [[0.0; PACK]; F];
    for j in 0..F {
        values[j].store(&mut turned[j]);
    }
    for (lane, &b) in at.iter().enumerate().take(S::F64_LANES) {
        let body = &mut bodies[b as usize];
        for j in 0..F {
            body[j] = turned[j][lane];
        }
    }
}

/// The contacts of a pack from `first` on, as many as fill a register; not zero where one was not solved.
#[inline(always)]
fn part<S: Simd, const D: usize, const F: usize>(
    simd: S,
    first: usize,
    (pairs, given): (&[[u32; PACK]; 2], &[Eight]),
    (alphas, r): (&mut Eight, &mut [Eight]),
    bodies: &mut [[f64; F]],
) -> Eight {
    let zero = Lane::all(simd, 0.0);
    let (rows, rest) = given.split_at(2 * D * F);
    let (velocity, own) = rest.split_at(D);
    let mut v: [[Lane<S>; F]; 2] =
        [gather(simd, &pairs[0][first..], bodies), gather(simd, &pairs[1][first..], bodies)];
    let mut local = [zero; 8];
    for k in 0..GIVEN[D - 1] {
        local[k] = lane(simd, &own[k], first);
    }
    let mut old = [zero; D];
    let mut b = [zero; D];
    for k in 0..D {
        old[k] = lane(simd, &r[k], first);
    }
    for k in 0..D {
        // two sums, so that neither waits for the other
        let (mut one, mut other) = (lane(simd, &velocity[k], first), zero);
        for j in 0..F {
            one = lane(simd, &rows[k * F + j], first).mul_add(v[0][j], one);
            other = lane(simd, &rows[(D + k) * F + j], first).mul_add(v[1][j], other);
        }
        b[k] = one + other;
        for c in 0..D {
            b[k] = b[k] - local[entry::<D>(k, c)] * old[c];
        }
    }
    let mut alpha = lane(simd, alphas, first);
    let (found, missed): (Lanes<S, D>, _) = local_lanes::solve(&local, b, &mut alpha);
    alpha.store(&mut alphas[first..]);
    let mut stay = [0.0; PACK];
    missed.store(&mut stay[first..]);
    for k in 0..D {
        // what was not solved stays as it is, and is solved alone
        let next = zero.if_less(missed, old[k], found[k]);
        next.store(&mut r[k][first..]);
        let moved = next - old[k];
        for j in 0..F {
            v[0][j] = lane(simd, &rows[k * F + j], first).mul_add(moved, v[0][j]);
            v[1][j] = lane(simd, &rows[(D + k) * F + j], first).mul_add(moved, v[1][j]);
        }
    }
    scatter(v[0], &pairs[0][first..], bodies);
    scatter(v[1], &pairs[1][first..], bodies);
    stay
}

/// Where the entry (k, c) of a symmetric block lies.
#[inline(always)]
const fn entry<const D: usize>(k: usize, c: usize) -> usize {
    let (k, c) = if k < c { (k, c) } else { (c, k) };
    k * D + c - k * (k + 1) / 2
}

/// One contact of a pack, by bracketed steps.
#[inline(never)]
fn alone<const D: usize, const F: usize>(
    (i, lane): (usize, usize),
    blocks: &Blocks<D>,
    (pairs, given): (&[[u32; PACK]; 2], &[Eight]),
    r: &mut [Eight],
    bodies: &mut [[f64; F]],
) {
    let both = [bodies[pairs[0][lane] as usize], bodies[pairs[1][lane] as usize]];
    let (mut b, mut old) = (blocks.velocity[i], [0.0; D]);
    (0..D).for_each(|k| old[k] = r[k][lane]);
    for k in 0..D {
        for side in 0..2 {
            (0..F).for_each(|j| b[k] += given[(side * D + k) * F + j][lane] * both[side][j]);
        }
        (0..D).for_each(|c| b[k] -= blocks.diagonal[i][k][c] * old[c]);
    }
    let found = Local::new(&blocks.diagonal[i], blocks.friction[i]).solve(&b, &old);
    for k in 0..D {
        r[k][lane] = found[k];
        for side in 0..2 {
            let body = &mut bodies[pairs[side][lane] as usize];
            (0..F).for_each(|j| body[j] += given[(side * D + k) * F + j][lane] * (found[k] - old[k]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::local::tests::numbers;
    use super::super::operator::Operator;
    use super::super::sweeps::{locals, sweep, velocities};
    use super::*;

    /// Contacts of bodies that look random, some on what cannot move, with enough of them that packs are full.
    fn contacts<const D: usize>(freedoms: usize) -> Blocks<D> {
        let (bodies, count) = (60, 200);
        let mut next = numbers(7);
        let mut rows = Rows { freedoms, bodies, ..Rows::default() };
        for i in 0..count {
            let (a, b) = (i % bodies, (7 * i + i / bodies + 1) % bodies);
            let grounded = i % 5 == 0 || a == b;
            rows.pairs.push([a as u32, if grounded { NO_BODY } else { b as u32 }]);
            rows.values.extend((0..2 * D * freedoms).map(|_| next()));
        }
        let operator = Operator::Bodies(rows);
        let mut blocks = Blocks { operator, ..Blocks::default() };
        for _ in 0..count {
            let mut q = [0.0; D];
            q.iter_mut().for_each(|q| *q = next());
            q[0] -= 0.5;
            blocks.velocity.push(q);
            blocks.friction.push(0.3 + 0.3 * next());
        }
        blocks.read_diagonal();
        blocks.complete();
        blocks
    }

    fn rows<const D: usize>(blocks: &Blocks<D>) -> &Rows<D> {
        match &blocks.operator {
            Operator::Bodies(rows) => rows,
            Operator::Matrix(_) => unreachable!("they are on bodies"),
        }
    }

    #[test]
    fn every_contact_is_in_one_pack_and_no_two_of_a_pack_share_a_body() {
        let blocks = contacts::<3>(6);
        let (rows, mut seen) = (rows(&blocks), vec![0; 200]);
        let members = packs(&rows.pairs);
        assert!(members.len() < 40, "{} packs for 200 contacts", members.len());
        for pack in &members {
            let mut bodies = Vec::new();
            for &i in pack.iter().filter(|i| **i != NOBODYS) {
                seen[i as usize] += 1;
                bodies.extend(rows.pairs[i as usize].into_iter().filter(|b| *b != NO_BODY));
            }
            let all = bodies.len();
            bodies.sort_unstable();
            bodies.dedup();
            assert_eq!(bodies.len(), all);
        }
        assert!(seen.iter().all(|n| *n == 1));
    }

    fn packs_come_to_the_same<const D: usize>(freedoms: usize) {
        let blocks = contacts::<D>(freedoms);
        let zero = vec![[0.0; D]; blocks.velocity.len()];
        let (mut one, mut u, mut bodies) = (zero.clone(), zero.clone(), Vec::new());
        velocities(&blocks, &zero, &mut u, &mut bodies);
        let mut packs = Packs::of(&blocks, rows(&blocks));
        let (mut packed, mut packed_bodies) = (packs.spread(&zero), bodies.clone());
        packs.seat(&mut packed_bodies);
        let mut alone = locals(&blocks);
        for _ in 0..20_000 {
            sweep(&blocks, &mut alone, &mut one, &mut bodies);
            packs.sweep(&blocks, &mut packed, &mut packed_bodies);
        }
        let mut other = zero.clone();
        packs.collect(&packed, &mut other);
        // impulses of redundant contacts may differ, velocities not
        let mut v = zero;
        velocities(&blocks, &one, &mut u, &mut bodies);
        velocities(&blocks, &other, &mut v, &mut bodies);
        for (i, (u, v)) in u.iter().zip(&v).enumerate() {
            for k in 0..D {
                assert!((u[k] - v[k]).abs() < 1e-8, "{D} {freedoms}: contact {i}: {u:?} {v:?}");
            }
        }
    }

    #[test]
    fn sweeps_in_packs_come_to_the_solution_of_sweeps_contact_by_contact() {
        packs_come_to_the_same::<1>(6);
        packs_come_to_the_same::<2>(3);
        packs_come_to_the_same::<3>(6);
    }

    #[test]
    fn sweeps_in_packs_have_the_same_bits_on_registers_of_any_width() {
        let blocks = contacts::<3>(6);
        let zero = vec![[0.0; 3]; blocks.velocity.len()];
        let start = Packs::of(&blocks, rows(&blocks));
        let swept = |narrow: bool| {
            let (mut packs, mut r, mut bodies) = (start.clone(), start.spread(&zero), Vec::new());
            packs.seat(&mut bodies);
            for _ in 0..50 {
                let sweep = Sweep { packs: &mut packs, blocks: &blocks, r: &mut r, bodies: &mut bodies };
                if narrow {
                    sweep.with_simd(pulp::Scalar::new());
                } else {
                    in_widest(sweep);
                }
            }
            r
        };
        assert_eq!(swept(true), swept(false));
    }
}
