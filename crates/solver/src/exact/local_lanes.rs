//! One contact solved exactly, the others held (`local.rs`), for as many contacts at once as a register holds: W_ii is
//! symmetric, and slip is found in the basis in which W_ii is given, so that nothing but W_ii and alpha is kept. With
//! A = adj(S + alpha) and p = det(S + alpha) slip is t = -A g / p; all is in terms of T = p t and N = p n, and each step
//! on alpha waits for one division.

use super::lane::{Lane, Lanes};
use pulp::Simd;

/// Numbers of a contact that its solution reads: the blocks' entries on and above the diagonal, row by row, then 1 / W_NN
/// (0 for a contact that no impulse moves) and mu.
pub const GIVEN: [usize; 3] = [3, 5, 8];

/// Most steps on alpha.
const STEPS: usize = 5;
/// Change of alpha next to S + alpha that is small enough: t follows it to first order, and sweeps come back before its
/// square matters.
const NEAR: f64 = 0.1;
/// Of alpha that a step takes away where it would take all.
const MOST: f64 = 0.75;
/// Least determinant of S, next to its diagonal squared, with which a contact can stick.
const REGULAR: f64 = 1e-14;

/// Impulses at velocities `b` without them, W_NN and all else in `given`; alpha is that of the last slip, 0 for none.
/// One in the last lane where the solution was not found.
#[inline(always)]
pub fn solve<S: Simd, const D: usize>(
    given: &[Lane<S>],
    b: Lanes<S, D>,
    alpha: &mut Lane<S>,
) -> (Lanes<S, D>, Lane<S>) {
    let zero = b[0].like(0.0);
    let mut out = [zero; D];
    let mut missed = zero;
    let (inverse, mu) = (given[GIVEN[D - 1] - 2], given[GIVEN[D - 1] - 1]);
    let free = -b[0] * inverse;
    match D {
        1 => out[0] = free,
        2 => {
            let found = in_the_plane([given[0], given[1], given[2]], [b[0], b[1]], (free, inverse, mu));
            out[0] = found[0];
            out[1] = found[1];
        }
        _ => {
            let block = [given[0], given[1], given[2], given[3], given[4], given[5]];
            let found = in_space(block, [b[1], b[2]], (free, inverse, mu), alpha);
            out.copy_from_slice(&found.0);
            missed = found.1;
        }
    }
    // taking off, and what no impulse moves
    for k in 0..D {
        out[k] = zero.if_less(free, out[k], zero);
    }
    (out, zero.if_less(free, missed, zero))
}

#[inline(always)]
fn in_the_plane<S: Simd>(
    [_, coupled, own]: [Lane<S>; 3],
    b: [Lane<S>; 2],
    (free, inverse, mu): (Lane<S>, Lane<S>, Lane<S>),
) -> [Lane<S>; 2] {
    let (zero, one) = (mu.like(0.0), mu.like(1.0));
    let pull = coupled * inverse;
    let schur = own - coupled * pull;
    let slip = coupled.mul_add(free, b[1]);
    let stuck = -slip / schur;
    let pressed = free - pull * stuck;
    // what leaves stick is zero or less
    let bound = mu * pressed - stuck.abs();
    let sticks = zero.if_less(schur, zero.if_at_most(bound, zero.if_at_most(pressed, one, zero), zero), zero);
    let likely = zero.if_less(slip, -one, one);
    let one_way = slides(likely, (pull, schur, slip), (free, mu));
    let other_way = slides(-likely, (pull, schur, slip), (free, mu));
    // jammed for both signs: friction that at least does not pull
    let jammed = zero.if_less((pull * mu).mul_add(likely, one), one, zero);
    let first = zero.if_less(one_way[2], one, zero.if_less(other_way[2], zero, jammed));
    let normal = zero.if_less(first, one_way[0], other_way[0]);
    let tangent = zero.if_less(first, one_way[1], other_way[1]);
    [zero.if_less(sticks, pressed, normal), zero.if_less(sticks, stuck, tangent)]
}

/// Impulses of a slip towards one side, and one where the slip is towards it.
#[inline(always)]
fn slides<S: Simd>(
    side: Lane<S>,
    (pull, schur, slip): (Lane<S>, Lane<S>, Lane<S>),
    (free, mu): (Lane<S>, Lane<S>),
) -> [Lane<S>; 3] {
    let (zero, one) = (mu.like(0.0), mu.like(1.0));
    let divisor = (pull * mu).mul_add(side, one);
    let normal = free / divisor;
    let tangent = side * mu * normal;
    let against = (side * schur.mul_add(tangent, slip)).if_at_most(zero, one, zero);
    [normal, tangent, zero.if_less(divisor, against, zero)]
}

/// adj([a h; h c]) v.
#[inline(always)]
fn turned<S: Simd>((a, c, h): (Lane<S>, Lane<S>, Lane<S>), v: [Lane<S>; 2]) -> [Lane<S>; 2] {
    [c.mul_add(v[0], -(h * v[1])), a.mul_add(v[1], -(h * v[0]))]
}

/// Impulses, and one where they were not found.
#[inline(always)]
fn in_space<S: Simd>(
    [_, n1, n2, own1, own12, own2]: [Lane<S>; 6],
    b: [Lane<S>; 2],
    (free, inverse, mu): (Lane<S>, Lane<S>, Lane<S>),
    alpha: &mut Lane<S>,
) -> ([Lane<S>; 3], Lane<S>) {
    let (zero, one) = (mu.like(0.0), mu.like(1.0));
    let pulls = [n1 * inverse, n2 * inverse];
    let (a, c, h) = (own1 - n1 * pulls[0], own2 - n2 * pulls[1], own12 - n1 * pulls[1]);
    let g = [n1.mul_add(free, b[0]), n2.mul_add(free, b[1])];
    let (determinant, squares) = (a * c - h * h, a.mul_add(a, c * c));
    let scale = one / determinant;
    // of the opposite sign
    let adjoint = turned((a, c, h), g);
    let stuck = [adjoint[0] * scale, adjoint[1] * scale];
    let pressed = pulls[0].mul_add(stuck[0], pulls[1].mul_add(stuck[1], free));
    let bound = mu * pressed;
    let within = stuck[0].mul_add(stuck[0], stuck[1] * stuck[1]).if_at_most(bound * bound, one, zero);
    let within = zero.if_at_most(pressed, within, zero);
    let sticks = (squares.like(REGULAR) * squares).if_less(determinant, within, zero);
    // without friction, or off, there is nothing to find
    let idle = zero.if_less(mu, zero.if_less(free, sticks, one), one);
    if idle.least() == 1.0 {
        let normal = zero.if_less(sticks, pressed, free);
        return (
            [normal, zero.if_less(sticks, -stuck[0], zero), zero.if_less(sticks, -stuck[1], zero)],
            zero,
        );
    }
    let slip = slipping((a, c, h), g, pulls, (free, mu), (alpha, idle));
    let normal = zero.if_less(sticks, pressed, zero.if_less(mu, slip.0[0], free));
    let sliding = [zero.if_less(mu, slip.0[1], zero), zero.if_less(mu, slip.0[2], zero)];
    let tangent = [zero.if_less(sticks, -stuck[0], sliding[0]), zero.if_less(sticks, -stuck[1], sliding[1])];
    ([normal, tangent[0], tangent[1]], zero.if_less(idle, zero, one - slip.1))
}

/// Slip where not `idle`, and one where it was found.
#[inline(always)]
fn slipping<S: Simd>(
    (a, c, h): (Lane<S>, Lane<S>, Lane<S>),
    g: [Lane<S>; 2],
    pulls: [Lane<S>; 2],
    (free, mu): (Lane<S>, Lane<S>),
    (last, idle): (&mut Lane<S>, Lane<S>),
) -> ([Lane<S>; 3], Lane<S>) {
    let (zero, one) = (mu.like(0.0), mu.like(1.0));
    let mut alpha = zero.if_less(*last, *last, first_alpha((a, c, h), g, mu * free));
    let (mut found, mut slip) = (zero, [zero; 3]);
    for _ in 0..STEPS {
        let (c_more, a_more) = (c + alpha, a + alpha);
        let p = a_more * c_more - h * h;
        let inverse = one / p;
        // of the opposite sign, as is `pull`
        let t = turned((a_more, c_more, h), g);
        let pull = pulls[0].mul_add(t[0], pulls[1] * t[1]);
        let normal = free.mul_add(p, pull);
        let bound = mu * mu * normal;
        let (squared, limit) = (t[0].mul_add(t[0], t[1] * t[1]), bound * normal);
        let excess = squared - limit;
        let turns = turned((a_more, c_more, h), t);
        let lift = pulls[0].mul_add(turns[0], pulls[1] * turns[1]);
        let shrink = t[0].mul_add(turns[0], t[1] * turns[1]);
        let fall = limit.mul_add(shrink, -(bound * lift * squared));
        let likely = limit.like(3.0).mul_add(limit, squared) * squared;
        let change = limit.like(0.25) * p * excess * likely / (fall * (squared + limit));
        // a contact that would pull, and NaN
        let sound = zero.if_less(
            normal,
            zero.if_less(fall, change.abs().if_less(change.like(1e300), one, zero), zero),
            zero,
        );
        let change = (-alpha).if_less(change, change, alpha.like(-MOST) * alpha);
        let going = zero.if_less(found, zero, sound);
        alpha = zero.if_less(going, alpha + change, alpha);
        let near = (change.abs() * (a_more + c_more)).if_at_most(p.like(NEAR) * p, going, zero);
        let part = change * inverse;
        let tangent = [inverse * (t[0] - part * turns[0]), inverse * (t[1] - part * turns[1])];
        let pressed = pulls[0].mul_add(tangent[0], pulls[1].mul_add(tangent[1], free));
        let now = [pressed.max(zero), -tangent[0], -tangent[1]];
        for k in 0..3 {
            slip[k] = zero.if_less(near, now[k], slip[k]);
        }
        found = found.max(near);
        if found.max(idle).least() == 1.0 {
            break;
        }
    }
    *last = zero.if_less(idle, *last, zero.if_less(found, alpha, zero));
    (slip, found)
}

/// alpha without coupling to the normal, from what it is along the pull and across all.
#[inline(always)]
fn first_alpha<S: Simd>((a, c, h): (Lane<S>, Lane<S>, Lane<S>), g: [Lane<S>; 2], bound: Lane<S>) -> Lane<S> {
    let zero = a.like(0.0);
    let squared = g[0].mul_add(g[0], g[1] * g[1]);
    let own =
        (a * g[0] * g[0]).mul_add(a.like(1.0), c * g[1] * g[1] + h.like(2.0) * h * g[0] * g[1]) / squared;
    let alpha = squared.sqrt() / bound - own;
    zero.if_less(alpha, alpha, a.like(1e-3) * (a + c))
}

#[cfg(test)]
mod tests {
    use super::super::local::Local;
    use super::super::local::tests::{block, numbers};
    use super::*;
    use crate::exact::lane::PACK;
    use pulp::{Arch, WithSimd};

    struct Solved<const D: usize>([[f64; D]; D], f64, [f64; D]);

    impl<const D: usize> WithSimd for Solved<D> {
        type Output = ([f64; D], f64);
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let Solved(w, mu, b) = self;
            let mut given = [Lane::all(simd, 0.0); 8];
            let mut place = 0;
            for k in 0..D {
                for c in k..D {
                    given[place] = Lane::all(simd, w[k][c]);
                    place += 1;
                }
            }
            given[place] = Lane::all(simd, 1.0 / w[0][0]);
            given[place + 1] = Lane::all(simd, mu);
            let mut velocity = [Lane::all(simd, 0.0); D];
            (0..D).for_each(|k| velocity[k] = Lane::all(simd, b[k]));
            let (mut alpha, mut found) = (Lane::all(simd, 0.0), (velocity, velocity[0]));
            // sweeps come back: alpha is that of the solution before
            for _ in 0..12 {
                found = solve(&given, velocity, &mut alpha);
            }
            let mut out = [0.0; D];
            let mut row = [0.0; PACK];
            for k in 0..D {
                found.0[k].store(&mut row);
                out[k] = row[0];
            }
            (out, found.1.greatest())
        }
    }

    fn lanes_come_to_the_bracketed_solution<const D: usize>() -> usize {
        let mut missed = 0;
        for seed in 0..400 {
            let mut next = numbers(seed);
            let w = block::<D>(&mut next);
            let (mu, size) = (next().abs() + 0.01, 10.0_f64.powf(6.0 * next()));
            let b: [f64; D] =
                std::array::from_fn(|k| size * if k == 0 { 0.2 - next().abs() } else { next() });
            let mut local = Local::new(&w, mu);
            let mut expected = [0.0; D];
            for _ in 0..12 {
                expected = local.solve(&b, &expected);
            }
            let (found, not_found) = Arch::new().dispatch(Solved(w, mu, b));
            if not_found > 0.0 {
                missed += 1;
                continue;
            }
            let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for k in 0..D {
                assert!((found[k] - expected[k]).abs() <= 1e-11 * largest, "{seed}: {found:?} {expected:?}");
            }
        }
        missed
    }

    #[test]
    fn contacts_side_by_side_come_to_what_each_comes_to_alone() {
        assert_eq!(lanes_come_to_the_bracketed_solution::<1>(), 0);
        assert_eq!(lanes_come_to_the_bracketed_solution::<2>(), 0);
        // what is not found is solved alone
        assert!(lanes_come_to_the_bracketed_solution::<3>() < 12);
    }
}
