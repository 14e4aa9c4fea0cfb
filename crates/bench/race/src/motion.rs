//! The judge of motion: drift, speed at rest, direction of slip and gains of energy, in f64 from poses alone. Velocities are
//! differences of poses over a step, and height is the mean of both ends: for free fall in steps the sum of
//! m |v|^2/2 + w.I w/2 + m g z is then the same in every step. Knows no engine.

use crate::scene::{Asks, Body, DT, GRAVITY, Kind, Scene, finite};
use carom::{Column, Geometry, Inertia, Pose, Rotation};

/// Steps at the end over which speeds at rest are looked for.
pub const LAST: usize = 5;

/// What is known of a body that forces move.
struct Mover<S: Geometry> {
    index: usize,
    mass: f64,
    center: S::Vector,
    inertia: S::Inertia,
    start: Pose<S>,
    launched: S::Vector,
    spun: S::Spin,
}

/// Watches the poses of a run.
pub struct Motion<S: Geometry> {
    movers: Vec<Mover<S>>,
    asks: Asks,
    last: Vec<Pose<S>>,
    /// Energy of the step before and at the start \[J\].
    energy: f64,
    initial: f64,
    gain: f64,
    seen: bool,
    /// Largest speed of each of the last steps, the latest last \[m/s\].
    speeds: Vec<f64>,
}

/// What a run's motion was; NaN where the scene does not ask or nothing was seen.
#[derive(Clone, Copy, Debug)]
pub struct Moved {
    /// Farthest that a body is from where it began \[m\].
    pub drift_max: f64,
    /// Mean distance of the bodies from where they began \[m\].
    pub drift_mean: f64,
    /// Fastest body over the last steps \[m/s\].
    pub speed_max: f64,
    /// Largest angle between a body's way and its launch \[rad\].
    pub slip_direction_error: f64,
    /// Largest gain of mechanical energy in one step over that at the start \[1\].
    pub energy_gain: f64,
}

impl<S: Geometry> Motion<S> {
    /// A watch over a scene.
    ///
    /// # Errors
    /// A moving body without mass.
    pub fn of(scene: &Scene<S>) -> Result<Self, String> {
        let mut movers = Vec::new();
        for (index, body) in scene.bodies.iter().enumerate().filter(|(_, b)| b.kind == Kind::Dynamic) {
            movers.push(mover(index, body).map_err(|e| format!("{}: {e}", scene.name))?);
        }
        let start = scene.bodies.iter().map(|b| b.pose).collect();
        let initial = movers.iter().map(Mover::initial_energy).sum();
        Ok(Motion {
            movers,
            asks: scene.asks,
            last: start,
            energy: initial,
            initial,
            gain: 0.0,
            seen: false,
            speeds: Vec::new(),
        })
    }
    /// Whether poses are wanted after every step, or after the last alone.
    pub fn wants_every_step(&self) -> bool {
        self.asks.closed || self.asks.rests
    }
    /// Sees the poses after a step: after every one, where they are wanted so.
    pub fn see(&mut self, poses: Vec<Pose<S>>) {
        if self.asks.rests {
            let speed = |m: &Mover<S>| (poses[m.index].position - self.last[m.index].position).norm() / DT;
            if self.speeds.len() == LAST {
                self.speeds.remove(0);
            }
            self.speeds.push(self.movers.iter().map(speed).fold(0.0, f64::max));
        }
        if self.asks.closed {
            let energy: f64 =
                self.movers.iter().map(|m| m.energy(&self.last[m.index], &poses[m.index])).sum();
            self.gain = self.gain.max((energy - self.energy) / self.initial);
            self.energy = energy;
            self.seen = true;
        }
        self.last = poses;
    }
    /// What was seen.
    pub fn told(&self) -> Moved {
        let when = |asked: bool, value: f64| if asked { value } else { f64::NAN };
        let fine = self.last.iter().all(finite);
        let way = |m: &Mover<S>| self.last[m.index].position - m.start.position;
        let drifts: Vec<f64> = self.movers.iter().map(|m| way(m).norm()).collect();
        let most = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        let turned = |m: &Mover<S>| angle::<S>(way(m), m.launched);
        let lost = |value: f64| if fine { value } else { f64::INFINITY };
        Moved {
            drift_max: when(self.asks.rests, lost(most(&drifts))),
            drift_mean: when(self.asks.rests, lost(drifts.iter().sum::<f64>() / drifts.len() as f64)),
            speed_max: when(self.asks.rests && !self.speeds.is_empty(), lost(most(&self.speeds))),
            slip_direction_error: when(
                self.asks.slides,
                lost(self.movers.iter().map(turned).fold(0.0, f64::max)),
            ),
            energy_gain: when(self.asks.closed && self.seen, lost(self.gain)),
        }
    }
}

fn mover<S: Geometry>(index: usize, body: &Body<S>) -> Result<Mover<S>, String> {
    let mass = S::mass_properties(&body.shape, body.density).map_err(|e| e.to_string())?;
    Ok(Mover {
        index,
        mass: mass.mass,
        center: mass.center,
        inertia: mass.inertia,
        start: body.pose,
        launched: body.velocity,
        spun: body.spin,
    })
}

impl<S: Geometry> Mover<S> {
    /// Mechanical energy at the start \[J\].
    fn initial_energy(&self) -> f64 {
        let spin = self.start.rotation.unrotate_spin(self.spun);
        self.sum(self.launched, spin, last_of::<S>(self.start.to_world(self.center)))
    }
    /// Mechanical energy over a step from its two ends \[J\].
    fn energy(&self, before: &Pose<S>, after: &Pose<S>) -> f64 {
        let (from, to) = (before.to_world(self.center), after.to_world(self.center));
        let velocity = (to - from) * (1.0 / DT);
        let turn = before.rotation.inverse().then(&after.rotation);
        // the mean angular velocity over the step, in body axes, where the inertia is
        let spin = before.rotation.unrotate_spin(turn.vector() * (1.0 / DT));
        let height = 0.5 * (last_of::<S>(from) + last_of::<S>(to));
        self.sum(velocity, spin, height)
    }
    /// m |v|^2/2 + w.I w/2 + m g z, the spin in body axes \[J\].
    fn sum(&self, velocity: S::Vector, spin: S::Spin, height: f64) -> f64 {
        0.5 * self.mass * velocity.norm_squared()
            + 0.5 * spin.dot(self.inertia.apply(spin))
            + self.mass * GRAVITY * height
    }
}

fn last_of<S: Geometry>(v: S::Vector) -> f64 {
    v.as_slice()[S::DIM - 1]
}

/// Angle between two vectors \[rad\], their heights left out.
fn angle<S: Geometry>(a: S::Vector, b: S::Vector) -> f64 {
    let flat = |v: S::Vector| S::Vector::from_fn(|k| if k + 1 == S::DIM { 0.0 } else { v.as_slice()[k] });
    let (a, b) = (flat(a), flat(b));
    let (Some(a), Some(b)) = (a.normalized(), b.normalized()) else { return f64::NAN };
    // 2 asin(|a - b|/2) keeps its digits for small angles
    2.0 * (0.5 * (a - b).norm()).min(1.0).asin()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Arena;
    use carom::{Planar, Spatial};

    fn scene<S: Arena>(asks: Asks) -> Scene<S> {
        let body = |x: f64| {
            let body = Body::new(Kind::Dynamic, S::block(1.0, 0.5, 0.25), S::place(x, 3.0));
            body.moving(S::place(1.0, 0.0)).spinning(S::spin(0.7))
        };
        Scene { name: "two:1".into(), steps: 1, bodies: vec![body(0.0), body(4.0)], asks }
    }

    fn drift_and_speed_are_those_of_the_poses<S: Arena>() {
        let scene = scene::<S>(Asks { rests: true, closed: false, slides: false });
        let mut motion = Motion::of(&scene).expect("boxes");
        let mut poses: Vec<Pose<S>> = scene.bodies.iter().map(|b| b.pose).collect();
        poses[1].position += S::place(0.003, 0.004);
        motion.see(poses);
        let told = motion.told();
        assert!((told.drift_max - 0.005).abs() < 1e-12, "{told:?}");
        assert!((told.drift_mean - 0.0025).abs() < 1e-12, "{told:?}");
        assert!((told.speed_max - 0.005 / DT).abs() < 1e-9, "{told:?}");
        assert!(told.energy_gain.is_nan() && told.slip_direction_error.is_nan());
    }

    #[test]
    fn drift_and_speed_are_those_of_the_poses_in_both_spaces() {
        drift_and_speed_are_those_of_the_poses::<Planar>();
        drift_and_speed_are_those_of_the_poses::<Spatial>();
    }

    /// Free flight and spin keep the energy; a push shows as a gain of its size.
    fn free_flight_gains_nothing_and_a_push_shows<S: Arena>() {
        let scene = scene::<S>(Asks { rests: false, closed: true, slides: false });
        let mut motion = Motion::of(&scene).expect("boxes");
        let initial = motion.initial;
        let fly = |n: usize| -> Vec<Pose<S>> {
            let t = n as f64 * DT;
            let fall = -0.5 * GRAVITY * DT * DT * (n * (n + 1)) as f64;
            let pose = |b: &Body<S>| Pose::new(b.pose.position + S::place(t, fall), S::lean(0.7 * t));
            scene.bodies.iter().map(pose).collect()
        };
        (1..=40).for_each(|n| motion.see(fly(n)));
        assert!(motion.told().energy_gain < 1e-12, "{:?}", motion.told());
        let mut pushed = fly(41);
        pushed.iter_mut().for_each(|p| p.position += S::place(DT, 0.0));
        motion.see(pushed);
        // from 1 m/s to 2 m/s: m (4 - 1)/2 more
        let mass: f64 = motion.movers.iter().map(|m| m.mass).sum();
        assert!((motion.told().energy_gain - 1.5 * mass / initial).abs() < 1e-9);
    }

    #[test]
    fn free_flight_gains_nothing_and_a_push_shows_in_both_spaces() {
        free_flight_gains_nothing_and_a_push_shows::<Planar>();
        free_flight_gains_nothing_and_a_push_shows::<Spatial>();
    }

    #[test]
    fn the_slip_direction_is_the_angle_between_way_and_launch() {
        let scene = scene::<Spatial>(Asks { rests: false, closed: false, slides: true });
        let mut motion = Motion::of(&scene).expect("boxes");
        let mut poses: Vec<Pose<Spatial>> = scene.bodies.iter().map(|b| b.pose).collect();
        poses[0].position += carom::vec3(1.0, 0.01, 0.2);
        poses[1].position += carom::vec3(1.0, 0.0, 0.0);
        motion.see(poses);
        assert!((motion.told().slip_direction_error - 0.01f64.atan()).abs() < 1e-12);
    }
}
