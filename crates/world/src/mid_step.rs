//! Contacts where the kick acts: points and normals at the bodies' places half-way through the step, found again by
//! name (theory section 6.2). With the start's directions a contact that turns would work against its own motion,
//! at first order in the step. Pairs that hardly move keep what they have, only carried along.

use crate::bodies::Bodies;
use crate::contact_id::contact_id;
use crate::narrow_phase::Touch;
use carom_geometry::{ContactPoint, Geometry};
use carom_math::Column;

/// Relative motion in half a step, over the smaller body's size, below which directions count as unchanged \[1\].
const STILL: f64 = 1e-5;
/// Cosine below which a contact of the same name counts as another one \[1\].
const SAME: f64 = 0.7;

/// Memory of the search.
pub struct MidStep<S: Geometry> {
    touches: Vec<Touch<S>>,
    points: Vec<ContactPoint<S>>,
}

impl<S: Geometry> Default for MidStep<S> {
    fn default() -> Self {
        MidStep { touches: Vec::new(), points: Vec::new() }
    }
}

impl<S: Geometry> MidStep<S> {
    /// The touches as found at `origin`, carried along with the bodies to their present places; `turning` finds
    /// points and normals of moving pairs again. Gaps stay those of the start. One entry per touch.
    pub fn update(
        &mut self,
        bodies: &Bodies<S>,
        touches: &[Touch<S>],
        origin: &[S::Vector],
        dt: f64,
        turning: bool,
    ) -> &[Touch<S>] {
        self.touches.clear();
        self.touches
            .extend(touches.iter().map(|t| Touch { point: t.point + shift(bodies, t, origin), ..*t }));
        if turning {
            let mut first = 0;
            while first < touches.len() {
                let pair = (touches[first].a, touches[first].b);
                let count = touches[first..].iter().take_while(|t| (t.a, t.b) == pair).count();
                self.find_again(bodies, first..first + count, dt);
                first += count;
            }
        }
        &self.touches
    }

    fn find_again(&mut self, bodies: &Bodies<S>, run: std::ops::Range<usize>, dt: f64) {
        let (a, b) = (self.touches[run.start].a, self.touches[run.start].b);
        let moved = relative_motion(bodies, &self.touches[run.start], 0.5 * dt);
        let size = bodies.data[a].extent.min(bodies.data[b].extent);
        let (Some(ca), Some(cb)) = (&bodies.data[a].collider, &bodies.data[b].collider) else { return };
        if moved <= STILL * size {
            return;
        }
        let widest = self.touches[run.clone()].iter().map(|t| t.gap).fold(0.0, f64::max);
        self.points.clear();
        S::contacts(
            ca,
            &bodies.shape_pose(a),
            cb,
            &bodies.shape_pose(b),
            widest + 2.0 * moved,
            &mut self.points,
        );
        let (serial_a, serial_b) = (bodies.data[a].serial, bodies.data[b].serial);
        for touch in &mut self.touches[run] {
            let same = |p: &&ContactPoint<S>| contact_id(serial_a, serial_b, p.feature) == touch.id;
            if let Some(p) = self.points.iter().find(same).filter(|p| p.normal.dot(touch.normal) > SAME) {
                touch.point = p.point;
                touch.normal = p.normal;
            }
        }
    }
}

/// How a contact point moves with its bodies: with the mean of both, or with the one that impulses move.
fn shift<S: Geometry>(bodies: &Bodies<S>, t: &Touch<S>, origin: &[S::Vector]) -> S::Vector {
    let moved = |i: usize| bodies.motion.position[i] - origin[i];
    match (bodies.is_dynamic(t.a), bodies.is_dynamic(t.b)) {
        (true, true) => (moved(t.a) + moved(t.b)) * 0.5,
        (true, false) => moved(t.a),
        (false, _) => moved(t.b),
    }
}

/// Bound of how far the surfaces near a contact move against each other in a time \[m\].
fn relative_motion<S: Geometry>(bodies: &Bodies<S>, t: &Touch<S>, time: f64) -> f64 {
    let m = &bodies.motion;
    let at = |i: usize| m.twist(i).at(t.point - m.position[i]);
    let turning = |i: usize| {
        let extent = bodies.data[i].extent;
        if extent.is_finite() { extent * m.angular_velocity[i].norm() } else { 0.0 }
    };
    ((at(t.a) - at(t.b)).norm() + turning(t.a) + turning(t.b)) * time
}
