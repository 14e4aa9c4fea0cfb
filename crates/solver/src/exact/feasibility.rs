//! How far a problem is from losing its solutions: the largest t <= T with u_N >= mu |u_T| + t at every contact for
//! some r, u = W r + q; above 0 a solution exists (theory chapter 7). A convex interior point on
//! max k t - z . W~ z / 2: y = W~ z + q~ - t a, z o y = m e_1, a . z + w = k, (T - t) w = m. Its systems are those of
//! the other stages, bordered by a. For small 1 / k the kinetic energy costs nothing.

use super::scaled::Scaled;
use super::stage::Solve;
use super::step::{Pair, centrality, direction, prepare, reach, take};

/// Steps for each weight.
const STEPS: usize = 40;
/// Weights k per contact; the next one is taken where the last found no r with t > 0.
const WEIGHTS: [f64; 2] = [1e2, 1e4];
/// Complementarity per contact, over the weight, at which t is known well enough.
const KNOWN: f64 = 1e-8;

/// The scalars beside z and y, and what a step changes them by.
struct Scalars {
    t: f64,
    /// T - t, and its multiplier.
    room: f64,
    price: f64,
    weight: f64,
    largest: f64,
    /// a.
    push: Vec<f64>,
}

/// What z . (W~ v) may be over a . z and |t|, where z bounds t.
const BOUND: f64 = 0.5;

/// The largest t found \[m/s\], never above the largest velocity of q. A t above 0 comes with its r; one that is not
/// is told only where z shows that there is no larger one: W^T z = 0 gives t <= q . z / (a . z).
pub fn strict_feasibility<const D: usize>(solve: &mut Solve<'_, D>) -> Option<f64> {
    let count = solve.scaled.count();
    let (mut best, mut bounded) = (f64::NEG_INFINITY, false);
    for weight in WEIGHTS {
        let (found, end) = search(solve, weight * count as f64);
        best = best.max(found);
        bounded |= end;
        if best > 0.0 {
            break;
        }
    }
    (best > 0.0 || (bounded && best.is_finite())).then_some(best)
}

/// The largest t of the search, and whether its z bounds t.
fn search<const D: usize>(solve: &mut Solve<'_, D>, weight: f64) -> (f64, bool) {
    let count = solve.scaled.count();
    let largest = solve.blocks.largest_velocity() / solve.scaled.velocity_unit;
    let push: Vec<f64> = solve.scaled.stretch[..count].iter().map(|p| p[0]).collect();
    // a start of the size of its own residual: from a smaller one steps stay short
    let size = weight / (1.0 + push.iter().sum::<f64>());
    let mut pair = Pair::cold(&solve.scaled, size, &mut solve.pool);
    solve.scaled.velocities(&pair.x, &mut pair.u);
    let high = pair.u[..count].as_flattened().iter().fold(largest, |m, u| m.max(u.abs()));
    pair.y.iter_mut().for_each(|y| y[0] = high);
    let mut s = Scalars { t: 0.0, room: largest, price: size * high / largest, weight, largest, push };
    let mut best = f64::NEG_INFINITY;
    for _ in 0..STEPS {
        solve.scaled.velocities(&pair.x, &mut pair.u);
        best = best.max(margin(&solve.scaled, &pair.u) * solve.scaled.velocity_unit);
        let m = (pair.complementarity(count) * count as f64 + s.room * s.price) / (count + 1) as f64;
        if m < KNOWN * weight / count as f64 || step(solve, &mut pair, &mut s, m).is_none() {
            break;
        }
    }
    let bounded = bounds(solve, &mut pair, &s);
    (best.min(solve.blocks.largest_velocity()), bounded)
}

/// True when z . (W~ v) is nearly nothing for v = z and for v = e_1 everywhere.
fn bounds<const D: usize>(solve: &Solve<'_, D>, pair: &mut Pair<D>, s: &Scalars) -> bool {
    let count = solve.scaled.count();
    let along: f64 = (0..count).map(|i| s.push[i] * pair.x[i][0]).sum();
    let unit = vec![std::array::from_fn(|k| if k == 0 { 1.0 } else { 0.0 }); pair.x.len()];
    [pair.x.clone(), unit].iter().all(|probe| {
        solve.scaled.product(probe, &mut pair.dx);
        let pairs = pair.x[..count].as_flattened().iter().zip(pair.dx[..count].as_flattened());
        let work: f64 = pairs.map(|(z, w)| z * w).sum();
        s.t < 0.0 && work.abs() <= BOUND * along * -s.t
    })
}

/// The smallest u_N - mu |u_T| in units of q~ without the contacts' own units.
fn margin<const D: usize>(scaled: &Scaled<D>, u: &[[f64; D]]) -> f64 {
    let own = |i: usize| {
        let slip = u[i][1..].iter().map(|t| t * t).sum::<f64>().sqrt();
        (u[i][0] - slip) / scaled.stretch[i][0]
    };
    (0..scaled.count()).map(own).fold(f64::INFINITY, f64::min)
}

/// One step; nothing when the numbers end.
fn step<const D: usize>(solve: &mut Solve<'_, D>, pair: &mut Pair<D>, s: &mut Scalars, m: f64) -> Option<()> {
    let (scaled, system) = (&solve.scaled, &mut solve.system);
    let count = scaled.count();
    prepare(scaled, pair, (0.0, 0.0), &mut system.blocks);
    for i in 0..count {
        pair.residual[i] = std::array::from_fn(|k| pair.y[i][k] - pair.u[i][k]);
        pair.residual[i][0] += s.t * s.push[i];
    }
    if !system.factorize() {
        return None;
    }
    // the response to t
    let mut response = vec![[0.0; D]; scaled.velocity.len()];
    (0..count).for_each(|i| response[i][0] = s.push[i]);
    if !system.solve(scaled, &mut response) {
        return None;
    }
    let pushed = |v: &[[f64; D]]| (0..count).map(|i| s.push[i] * v[i][0]).sum::<f64>();
    let (left_weight, left_room) = (s.weight - s.price - pushed(&pair.x), s.largest - s.t - s.room);
    let stiff = pushed(&response) + s.price / s.room;
    let mut go = |pair: &mut Pair<D>, target: f64| -> Option<([f64; 3], f64)> {
        direction(scaled, pair, target, false);
        if !system.solve(scaled, &mut pair.dx) {
            return None;
        }
        let fixed = (target - s.room * s.price - s.price * left_room) / s.room;
        let dt = (left_weight - fixed - pushed(&pair.dx)) / stiff;
        for i in 0..count {
            for k in 0..D {
                pair.dx[i][k] += dt * response[i][k];
            }
        }
        let (room, price) = (left_room - dt, fixed + s.price / s.room * dt);
        let blocked = |x: f64, d: f64| if d < 0.0 { -x / d } else { f64::INFINITY };
        let longest = reach(scaled, pair).min(blocked(s.room, room)).min(blocked(s.price, price));
        (longest.is_finite() || longest > 0.0).then_some(([dt, room, price], longest))
    };
    let (_, affine) = go(pair, 0.0)?;
    let sigma = (1.0 - affine.min(1.0)).powi(3).clamp(1e-4, 0.9);
    let ([dt, room, price], longest) = go(pair, sigma * m)?;
    let mut length = (0.9 * longest).min(1.0);
    while length > 1e-6 && centrality(scaled, pair, length) < 0.01 {
        length *= 0.8;
    }
    take(scaled, pair, length);
    s.t += length * dt;
    s.room += length * room;
    s.price += length * price;
    (pair.is_finite() && s.t.is_finite()).then_some(())
}
