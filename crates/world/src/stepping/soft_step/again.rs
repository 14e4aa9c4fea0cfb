//! Contacts used again. While the bodies of a pair have hardly moved against each other since the narrow phase looked at it,
//! and hardly turned, the points and the normal that it found stand, and gaps follow from the bodies' motion since then, exactly: with dp and R of a body and
//! e = R^T n - n, a point r from its centre moves by n.dp + e.r along n. It saves the search, and it steadies: points that
//! are found anew at every step jump between corners that lie on each other, and lose their forces when they do.
//! Only faces on faces: what rolls needs its points anew, and so does what will move by more than that in the step, which a
//! push may take to parts of the other body that were far.

use super::memory::{PatchForce, Walk};
use crate::ahead::Ahead;
use crate::narrow_phase::{Findings, Known, touches_of};
use carom_geometry::{ContactPoint, Geometry};
use carom_math::{Column, Rotation};

/// Share of the smaller body's size by which both may have moved against each other, and turned, since \[1\]. Points are
/// looked for at least as far.
pub const AGAIN: f64 = 0.01;

/// Knows the contacts of the step before that stand.
pub struct Again<'a, S: Geometry> {
    /// The step ahead.
    pub ahead: Ahead<'a, S>,
    /// The patches of the step before.
    pub before: &'a [PatchForce],
}

impl<S: Geometry> Known<S> for Again<'_, S> {
    fn append(&self, (a, b): (usize, usize), out: &mut Findings<S>) -> bool {
        let data = &self.ahead.bodies.data;
        let pair = (data[a].serial, data[b].serial);
        let mut walk = Walk::from(self.before, out.place, pair);
        let known = walk.of(pair);
        out.place = Some(walk.place());
        let [patch] = known else { return false };
        if patch.count < S::DIM {
            return false;
        }
        let size = data[a].extent.min(data[b].extent);
        let (moved_a, moved_b) = (self.motion(a, patch, 0), self.motion(b, patch, 1));
        // what both moved by together takes the points along
        let drift = (moved_a.by - moved_b.by).norm() + moved_a.swing + moved_b.swing;
        // not a number where an attitude was none
        if drift.is_nan() || drift > AGAIN * size {
            return false;
        }
        // what was pushed since may come to other parts of the other body in this step; how far it falls was known
        if self.ahead.coming((a, b)) > AGAIN * size {
            return false;
        }
        let normal = column::<S::Vector>(&patch.seen.normal);
        out.points.clear();
        for i in 0..patch.count {
            let point = column::<S::Vector>(&patch.seen.points[i]);
            let (by_a, by_b) = (moved_a.of(point), moved_b.of(point));
            let gap = patch.seen.gaps[i] + normal.dot(by_a - by_b);
            let point = point + (by_a + by_b) * 0.5;
            out.points.push(ContactPoint { point, normal, gap, feature: 0, curvature: 0.0 });
        }
        let first = out.touches.len();
        touches_of(self.ahead.bodies, self.ahead.settings, (a, b), &out.points, &mut out.touches);
        for (touch, id) in out.touches[first..].iter_mut().zip(&patch.ids) {
            touch.id = *id;
        }
        out.known.push(pair);
        true
    }
}

impl<S: Geometry> Again<'_, S> {
    /// How a body moved since its pair was looked at.
    fn motion(&self, i: usize, patch: &PatchForce, which: usize) -> Moved<S> {
        let from = column::<S::Vector>(&patch.seen.places[which]);
        let by = self.ahead.bodies.motion.position[i] - from;
        let before = S::Rotation::from_slice(&patch.seen.attitudes[which][..S::Rotation::LEN]);
        let now = self.ahead.bodies.motion.rotation[i];
        if by == S::Vector::ZERO && before == Some(now) {
            return Moved { from, by, turn: None, swing: 0.0 };
        }
        let Some(before) = before else {
            return Moved { from, by, turn: None, swing: f64::INFINITY };
        };
        let turn = before.inverse().then(&now);
        // a small turn is as long as its numbers are apart, of a quaternion twice as long
        let apart = now.as_slice().iter().zip(before.as_slice()).map(|(a, b)| (a - b) * (a - b));
        let angle = apart.sum::<f64>().sqrt() * if S::SPIN == 1 { 1.0 } else { 2.0 };
        let arm = self.ahead.bodies.data[i].reach_of_turning();
        let swing = if angle > 0.0 { angle * arm } else { 0.0 };
        Moved { from, by, turn: Some(turn), swing }
    }
}

/// A body's motion since its pair was looked at.
struct Moved<S: Geometry> {
    from: S::Vector,
    by: S::Vector,
    turn: Option<S::Rotation>,
    /// The farthest that turning carried a point of its surface \[m\].
    swing: f64,
}

impl<S: Geometry> Moved<S> {
    /// How a point of the body moved.
    fn of(&self, point: S::Vector) -> S::Vector {
        let arm = point - self.from;
        self.by + self.turn.map_or(S::Vector::ZERO, |turn| turn.rotate(arm) - arm)
    }
}

fn column<C: Column>(numbers: &[f64; 3]) -> C {
    C::from_fn(|k| numbers[k])
}
