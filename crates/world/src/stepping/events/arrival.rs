//! When bodies first meet on their ways through a flow. With a fixed separating normal n the gap of two convex pieces
//! is at least gap + u s - a s^2 / 2, s later, where u is the normal velocity of the nearest points and a bounds the
//! acceleration of all points along n (legend: theory section 8.3). The first root of that bound is never past the
//! arrival, and as a tangent it closes in on it quadratically.

use crate::bodies::{Bodies, Motion};
use crate::narrow_phase::contact_id;
use carom_geometry::{ContactPoint, Geometry};
use carom_math::{Column, Pose, Rotation};

/// Evaluations per pair; grazing pairs need most.
const STEPS: usize = 100;
/// Halvings that bring back a step which went too far.
const HALVINGS: usize = 60;
/// Share of the flow that a pair is left alone which touches and neither approaches nor separates \[1\].
const PAUSE: f64 = 1e-3;

/// The ways of a group's bodies through a flow: positions quadratic in time, rotations by a vector quadratic in time.
pub struct Ways<'a, S: Geometry> {
    /// What does not change.
    pub bodies: &'a Bodies<S>,
    /// Motion at the flow's start.
    pub start: &'a Motion<S>,
    /// Motion at its end.
    pub end: &'a Motion<S>,
    /// Its length \[s\].
    pub time: f64,
}

/// Bounds of a search.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    /// Looked at up to here \[s\].
    pub until: f64,
    /// Gap at which bodies have met \[m\].
    pub arrived: f64,
    /// Approaches up to this are noise \[m/s\].
    pub still_speed: f64,
}

/// Where and how a body is at a moment of its way.
struct Moment<S: Geometry> {
    pose: Pose<S>,
    velocity: S::Vector,
    spin: S::Spin,
}

impl<S: Geometry> Ways<'_, S> {
    fn acceleration(&self, i: usize) -> S::Vector {
        (self.end.velocity[i] - self.start.velocity[i]) * (1.0 / self.time)
    }

    fn at(&self, i: usize, t: f64) -> Moment<S> {
        let (s, e) = (self.start, self.end);
        let a = self.acceleration(i);
        let position = s.position[i] + s.velocity[i] * t + a * (0.5 * t * t);
        let spin0 = s.angular_velocity[i];
        let mut rotation = s.rotation[i];
        let mut spin = spin0;
        if self.bodies.data[i].turning_arm > 0.0 && rotation != e.rotation[i] {
            let whole = rotation.inverse().then(&e.rotation[i]).vector();
            let bend = (whole - spin0 * self.time) * (1.0 / (self.time * self.time));
            rotation = rotation.then(&S::Rotation::about(spin0 * t + bend * (t * t)));
            spin = spin0 + bend * (2.0 * t);
        }
        Moment { pose: Pose::new(position, rotation), velocity: s.velocity[i] + a * t, spin }
    }

    fn shape_pose(&self, i: usize, moment: &Moment<S>) -> Pose<S> {
        let center = moment.pose.rotation.rotate(self.bodies.data[i].mass_properties.center);
        Pose::new(moment.pose.position - center, moment.pose.rotation)
    }

    /// Bound of how fast the two surfaces near each other from now to the flow's end \[m/s\].
    fn fastest(&self, a: usize, b: usize, now: f64) -> f64 {
        let at = |m: &Motion<S>, i: usize| m.velocity[i];
        let relative = |t: f64| {
            let s = t / self.time;
            let of = |i: usize| at(self.start, i) * (1.0 - s) + at(self.end, i) * s;
            (of(a) - of(b)).norm()
        };
        relative(now).max(relative(self.time)) + self.turning(a) + self.turning(b)
    }

    fn turning(&self, i: usize) -> f64 {
        let spin = self.start.angular_velocity[i].norm().max(self.end.angular_velocity[i].norm());
        if spin == 0.0 { 0.0 } else { self.bodies.data[i].turning_arm * spin }
    }

    /// Bound of the acceleration of a body's points that its turning makes \[m/s^2\].
    fn swinging(&self, i: usize) -> f64 {
        let (w0, w1) = (self.start.angular_velocity[i], self.end.angular_velocity[i]);
        let fastest = w0.norm().max(w1.norm());
        let change = (w1 - w0).norm() / self.time;
        if fastest == 0.0 { 0.0 } else { self.bodies.data[i].turning_arm * (change + fastest * fastest) }
    }
}

/// Finds arrivals; keeps memory, nothing that changes an answer.
pub struct Arrivals<S: Geometry> {
    points: Vec<ContactPoint<S>>,
}

impl<S: Geometry> Default for Arrivals<S> {
    fn default() -> Self {
        Arrivals { points: Vec::new() }
    }
}

/// What a look at a pair at a moment says.
enum Look {
    /// A contact has arrived.
    Met(u64),
    /// Nothing arrives before that much later \[s\].
    Safe(f64),
    /// A contact overlaps by more than it may: the look is too late.
    Late,
}

impl<S: Geometry> Arrivals<S> {
    /// First moment within the search at which a contact of the pair arrives that `ignored` does not name, and its
    /// name.
    pub fn first(
        &mut self,
        ways: &Ways<S>,
        (a, b): (usize, usize),
        search: &Search,
        ignored: &dyn Fn(u64) -> bool,
    ) -> Option<(f64, u64)> {
        let mut t = 0.0;
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut halvings = 0;
        for _ in 0..STEPS + HALVINGS {
            match self.look(ways, (a, b), t, search, ignored) {
                Look::Met(id) => return Some((t, id)),
                Look::Late if halvings < HALVINGS && t > 0.0 => {
                    high = t;
                    halvings += 1;
                    t = 0.5 * (low + high);
                    if t <= low || t >= high {
                        return self.deepest(ways, (a, b), high, ignored).map(|id| (high, id));
                    }
                }
                Look::Late => return self.deepest(ways, (a, b), t, ignored).map(|id| (t, id)),
                Look::Safe(later) => {
                    low = t;
                    t += later;
                    if high.is_finite() {
                        t = t.min(0.5 * (low + high));
                    }
                    if t >= search.until {
                        return None;
                    }
                    t = t.max(low + f64::EPSILON * ways.time);
                }
            }
        }
        None
    }

    fn find(&mut self, ways: &Ways<S>, a: usize, b: usize, t: f64, margin: f64) -> [Moment<S>; 2] {
        let moments = [ways.at(a, t), ways.at(b, t)];
        self.points.clear();
        let (Some(ca), Some(cb)) = (&ways.bodies.data[a].collider, &ways.bodies.data[b].collider) else {
            return moments;
        };
        let (pose_a, pose_b) = (ways.shape_pose(a, &moments[0]), ways.shape_pose(b, &moments[1]));
        S::contacts(ca, &pose_a, cb, &pose_b, margin, &mut self.points);
        moments
    }

    fn look(
        &mut self,
        ways: &Ways<S>,
        (a, b): (usize, usize),
        t: f64,
        search: &Search,
        ignored: &dyn Fn(u64) -> bool,
    ) -> Look {
        let fastest = ways.fastest(a, b, t);
        let margin = fastest * (ways.time - t) + search.arrived;
        let [at_a, at_b] = self.find(ways, a, b, t, margin);
        let (serial_a, serial_b) = (ways.bodies.data[a].serial, ways.bodies.data[b].serial);
        let pulled = ways.acceleration(a) - ways.acceleration(b);
        let swinging = ways.swinging(a) + ways.swinging(b);
        let mut safe = f64::INFINITY;
        for p in &self.points {
            let id = contact_id(serial_a, serial_b, p.feature);
            if ignored(id) {
                continue;
            }
            let of = |m: &Moment<S>| m.velocity + S::swing(m.spin, p.point - m.pose.position);
            let u = p.normal.dot(of(&at_a) - of(&at_b));
            let bend = (swinging - p.normal.dot(pulled)).max(0.0);
            if p.gap <= search.arrived {
                if u < -search.still_speed {
                    let late = p.gap < -4.0 * search.arrived && t > 0.0;
                    return if late { Look::Late } else { Look::Met(id) };
                }
                // on its way out it comes back no sooner than this
                let out = if bend > 0.0 { (u + search.still_speed) / bend } else { f64::INFINITY };
                safe = safe.min(out.max(PAUSE * ways.time));
            } else {
                safe = safe.min(first_root(p.gap, u, bend));
            }
        }
        Look::Safe(safe)
    }

    /// The contact of least gap at a moment.
    fn deepest(
        &mut self,
        ways: &Ways<S>,
        (a, b): (usize, usize),
        t: f64,
        ignored: &dyn Fn(u64) -> bool,
    ) -> Option<u64> {
        self.find(ways, a, b, t, 0.0);
        let (serial_a, serial_b) = (ways.bodies.data[a].serial, ways.bodies.data[b].serial);
        let named = self.points.iter().map(|p| (p.gap, contact_id(serial_a, serial_b, p.feature)));
        let mine = named.filter(|(_, id)| !ignored(*id));
        mine.min_by(|x, y| x.0.total_cmp(&y.0)).map(|(_, id)| id)
    }
}

/// Smallest s > 0 with gap + u s - bend s^2 / 2 = 0; infinite without one.
fn first_root(gap: f64, u: f64, bend: f64) -> f64 {
    let root = (u * u + 2.0 * bend * gap).sqrt() - u;
    if root > 0.0 { 2.0 * gap / root } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::first_root;

    #[test]
    fn the_first_root_is_that_of_the_parabola_and_infinite_without_one() {
        assert_eq!(first_root(1.0, -2.0, 0.0), 0.5);
        assert_eq!(first_root(1.0, 2.0, 0.0), f64::INFINITY);
        let s = first_root(0.3, 0.7, 9.81);
        assert!((0.3 + 0.7 * s - 0.5 * 9.81 * s * s).abs() < 1e-15);
    }
}
