//! When bodies first meet on their ways. With a fixed separating normal n the gap of two convex pieces is at least
//! gap + u s - a s^2 / 2, s later, where u is the normal velocity of the nearest points and a bounds the acceleration
//! of all points along n (theory section 8.3); where a surface is hollow its curvature times the square of the speed
//! adds to it. The first root of that bound is never past the arrival, and as a tangent it closes in on it
//! quadratically.

use super::limits::Limits;
use crate::bodies::Bodies;
use crate::contact_id::contact_id;
use carom_geometry::{ContactPoint, Geometry};
use carom_math::{Column, Pose, Rotation};

/// Looks per pair; grazing pairs need most.
const LOOKS: usize = 160;
/// Halvings that bring back a look which came too late.
const HALVINGS: usize = 60;
/// Share of the step that a pair is left alone which touches and neither approaches nor separates \[1\].
pub const PAUSE: f64 = 1e-3;

/// The way of a body: position quadratic in time, rotation by a vector quadratic in time.
#[derive(Clone, Copy, Debug)]
pub struct Way<S: Geometry> {
    /// Where it begins within the step \[s\].
    pub begin: f64,
    /// Up to when it is valid \[s\].
    pub until: f64,
    position: S::Vector,
    velocity: S::Vector,
    acceleration: S::Vector,
    rotation: S::Rotation,
    spin: S::Spin,
    bend: S::Spin,
    arm: f64,
}

/// Where a body is and how it moves at a moment.
#[derive(Clone, Copy, Debug)]
pub struct State<S: Geometry> {
    /// Centre of mass \[m\].
    pub position: S::Vector,
    /// Orientation.
    pub rotation: S::Rotation,
    /// Velocity \[m/s\].
    pub velocity: S::Vector,
    /// Angular velocity \[rad/s\].
    pub spin: S::Spin,
}

impl<S: Geometry> Way<S> {
    /// The way between two states; `arm` is how far turning carries a point of the surface per radian.
    pub fn between(begin: f64, until: f64, start: &State<S>, end: &State<S>, arm: f64) -> Self {
        let time = until - begin;
        // a way of no length is a place
        let rate = if time > 0.0 { 1.0 / time } else { 0.0 };
        let mut bend = S::Spin::ZERO;
        if arm > 0.0 && start.rotation != end.rotation {
            let whole = start.rotation.inverse().then(&end.rotation).vector();
            bend = (whole - start.spin * time) * (rate * rate);
        }
        Way {
            begin,
            until,
            position: start.position,
            velocity: start.velocity,
            acceleration: (end.velocity - start.velocity) * rate,
            rotation: start.rotation,
            spin: start.spin,
            bend,
            arm,
        }
    }

    /// The state at a moment of the step \[s\].
    pub fn at(&self, moment: f64) -> State<S> {
        let t = moment - self.begin;
        let position = self.position + self.velocity * t + self.acceleration * (0.5 * t * t);
        let velocity = self.velocity + self.acceleration * t;
        if self.arm == 0.0 || (self.spin == S::Spin::ZERO && self.bend == S::Spin::ZERO) {
            return State { position, rotation: self.rotation, velocity, spin: self.spin };
        }
        let turn = S::Rotation::about(self.spin * t + self.bend * (t * t));
        let rotation = self.rotation.then(&turn);
        State { position, rotation, velocity, spin: self.spin + self.bend * (2.0 * t) }
    }

    /// Largest speed of turning from now on \[m/s\].
    fn turning(&self) -> f64 {
        let fastest = self.fastest_spin();
        if fastest == 0.0 { 0.0 } else { self.arm * fastest }
    }

    fn fastest_spin(&self) -> f64 {
        if self.arm == 0.0 {
            return 0.0;
        }
        let end = self.spin + self.bend * (2.0 * (self.until - self.begin));
        self.spin.norm().max(end.norm())
    }

    /// Bound of the acceleration of points that turning makes \[m/s^2\].
    fn swinging(&self) -> f64 {
        let fastest = self.fastest_spin();
        let change = 2.0 * self.bend.norm();
        if fastest == 0.0 && change == 0.0 { 0.0 } else { self.arm * (change + fastest * fastest) }
    }
}

/// Two bodies that may meet, and when to look.
pub struct Search<'a, S: Geometry> {
    /// The bodies.
    pub pair: (usize, usize),
    /// First moment to look at \[s\].
    pub from: f64,
    /// Not looked at from here on \[s\].
    pub until: f64,
    /// What does not change of the bodies.
    pub bodies: &'a Bodies<S>,
    /// Their ways.
    pub ways: &'a [Way<S>],
    /// Bounds of the step.
    pub limits: &'a Limits,
    /// Contacts that are not meant, ascending.
    pub ignored: &'a [u64],
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
    /// First moment of the search at which a contact of the pair arrives, and its name.
    pub fn first(&mut self, search: &Search<S>) -> Option<(f64, u64)> {
        let mut t = search.from;
        if t >= search.until {
            return None;
        }
        let (mut low, mut high) = (t, f64::INFINITY);
        let mut halvings = 0;
        for _ in 0..LOOKS {
            match self.look(search, t) {
                Look::Met(id) => return Some((t, id)),
                Look::Safe(later) => {
                    low = t;
                    t += later;
                    if high.is_finite() {
                        t = t.min(0.5 * (low + high));
                    }
                    if t >= search.until {
                        return None;
                    }
                    t = t.max(low + f64::EPSILON * search.limits.dt);
                }
                Look::Late => {
                    high = t;
                    halvings += 1;
                    t = 0.5 * (low + high);
                    if halvings > HALVINGS || t <= low || t >= high {
                        return self.deepest(search, high).map(|id| (high, id));
                    }
                }
            }
        }
        None
    }

    fn find(&mut self, search: &Search<S>, t: f64, margin: f64) -> [State<S>; 2] {
        let (a, b) = search.pair;
        let states = [search.ways[a].at(t), search.ways[b].at(t)];
        self.points.clear();
        let data = &search.bodies.data;
        if let (Some(ca), Some(cb)) = (&data[a].collider, &data[b].collider) {
            let [one, other] = states.map(|s| s.position);
            if let (Some(r), Some(s)) = (data[a].ball_radius, data[b].ball_radius)
                && let Some(found) = S::contact_of_balls((one, r), (other, s), margin)
            {
                self.points.extend(found);
                return states;
            }
            let place = |i: usize, s: &State<S>| {
                let center = s.rotation.rotate(data[i].mass_properties.center);
                Pose::new(s.position - center, s.rotation)
            };
            S::contacts(ca, &place(a, &states[0]), cb, &place(b, &states[1]), margin, &mut self.points);
        }
        states
    }

    fn name(search: &Search<S>, p: &ContactPoint<S>) -> u64 {
        let (a, b) = search.pair;
        contact_id(search.bodies.data[a].serial, search.bodies.data[b].serial, p.feature)
    }

    fn look(&mut self, search: &Search<S>, t: f64) -> Look {
        let (a, b) = (&search.ways[search.pair.0], &search.ways[search.pair.1]);
        let pulled = a.acceleration - b.acceleration;
        let rest = search.until - t;
        let now = (a.velocity - b.velocity) + a.acceleration * (t - a.begin) - b.acceleration * (t - b.begin);
        let fastest = now.norm().max((now + pulled * rest).norm()) + a.turning() + b.turning();
        let arrived = search.limits.arrived;
        let [at_a, at_b] = self.find(search, t, fastest * rest + arrived);
        let swinging = a.swinging() + b.swinging();
        let mut safe = f64::INFINITY;
        for p in &self.points {
            let id = Self::name(search, p);
            if search.ignored.binary_search(&id).is_ok() {
                continue;
            }
            let of = |s: &State<S>| s.velocity + S::swing(s.spin, p.point - s.position);
            let u = p.normal.dot(of(&at_a) - of(&at_b));
            // hollow surfaces come nearer on a straight way too
            let hollow = if p.curvature > 0.0 { p.curvature * fastest * fastest } else { 0.0 };
            let bend = (swinging - p.normal.dot(pulled) + hollow).max(0.0);
            if p.gap <= arrived {
                if u < -search.limits.still_speed {
                    let late = p.gap < -4.0 * arrived && t > search.from;
                    return if late { Look::Late } else { Look::Met(id) };
                }
                // on its way out it comes back no sooner than this
                let out = if bend > 0.0 { (u + search.limits.still_speed) / bend } else { f64::INFINITY };
                safe = safe.min(out.max(PAUSE * search.limits.dt));
            } else {
                safe = safe.min(first_root(p.gap, u, bend));
            }
        }
        Look::Safe(safe)
    }

    /// The contact of least gap at a moment.
    fn deepest(&mut self, search: &Search<S>, t: f64) -> Option<u64> {
        self.find(search, t, search.limits.arrived);
        let named = self.points.iter().map(|p| (p.gap, Self::name(search, p)));
        let meant = named.filter(|(_, id)| search.ignored.binary_search(id).is_err());
        meant.min_by(|x, y| x.0.total_cmp(&y.0)).map(|(_, id)| id)
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
