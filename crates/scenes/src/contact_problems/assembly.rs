//! Places bodies and states contacts between them, and hands out the contact problem. Body 0 is the floor. Lengths
//! in m, the last axis points up, depth exists in space only.

use crate::chance::Chance;
use crate::contact_problems::variation::Variation;
use crate::stage::Stage;
use carom::{Column, Contact, ContactProblem, Inertia, Twist, solver::InverseMass};

/// Index of the floor among the bodies.
pub const FLOOR: usize = 0;
/// Density of all bodies, before mass factors \[kg/m^DIM\].
const DENSITY: f64 = 1000.0;

/// A contact problem while it is put together.
pub struct Assembly<S: Stage> {
    problem: ContactProblem<S>,
    centres: Vec<S::Vector>,
    chance: Chance,
    variation: Variation,
}

/// A point or a direction from (along, deep, up); the plane has no depth.
pub fn at<S: Stage>([along, deep, up]: [f64; 3]) -> S::Vector {
    let spatial = [along, deep, up];
    let planar = [along, up];
    S::Vector::from_fn(|k| if S::DIM == 3 { spatial[k] } else { planar[k] })
}

impl<S: Stage> Assembly<S> {
    /// Only the floor, an obstacle whose origin is the origin.
    pub fn new(variation: &Variation) -> Self {
        let problem = ContactProblem::new(vec![InverseMass::default()], vec![Twist::default()]);
        Assembly {
            problem,
            centres: vec![S::Vector::ZERO],
            chance: Chance::new(variation.seed),
            variation: *variation,
        }
    }
    /// Adds a body of a shape whose centre of mass is its origin, `mass_factor` times as heavy as its size says,
    /// leaning by `lean` \[rad\]; returns its index.
    pub fn body(
        &mut self,
        shape: &S::Shape,
        mass_factor: f64,
        centre: [f64; 3],
        lean: f64,
    ) -> Result<usize, carom::ShapeError> {
        let properties = S::mass_properties(shape, DENSITY * mass_factor)?;
        let inertia = S::turned(&properties.inertia, &S::lean(lean));
        // a positive mass of positive extent has an invertible inertia
        let angular = inertia.inverse().unwrap_or(S::Inertia::ZERO);
        let v = self.variation;
        let reach = v.jitter * S::extent(shape);
        let displaced = at::<S>(centre) + S::Vector::from_fn(|_| self.chance.between(-reach, reach));
        let mut linear = S::Vector::from_fn(|_| self.chance.between(-v.speed, v.speed));
        let spin = S::Spin::from_fn(|_| self.chance.between(-v.speed, v.speed));
        linear[0] += v.shear * centre[2];
        linear[S::DIM - 1] -= v.gravity * v.time_step;
        self.problem.inverse_masses.push(InverseMass { linear: 1.0 / properties.mass, angular });
        self.problem.velocities.push(Twist::new(linear, spin));
        self.centres.push(displaced);
        Ok(self.centres.len() - 1)
    }
    /// States a contact at a point with the unit normal from b to a.
    pub fn touch(&mut self, a: usize, b: usize, point: S::Vector, normal: S::Vector, gap: f64) {
        let [low, high] = self.variation.friction;
        self.problem.contacts.push(Contact {
            id: self.problem.contacts.len() as u64,
            a,
            b,
            normal,
            arm_a: point - self.centres[a],
            arm_b: point - self.centres[b],
            gap,
            target: 0.0,
            slip_target: S::Slip::ZERO,
            restitution: 0.0,
            friction: self.chance.between(low, high),
        });
    }
    /// States the corner contacts of a flat joint from `ends[0]` to `ends[1]`, both (along, up), `width` deep about
    /// `middle`: two in the plane, four in space. The normal (along, up) is from b to a, of length 1.
    pub fn joint(
        &mut self,
        (a, b): (usize, usize),
        ends: [[f64; 2]; 2],
        normal: [f64; 2],
        (middle, width): (f64, f64),
    ) {
        let sides: &[f64] = if S::DIM == 3 { &[-0.5, 0.5] } else { &[0.0] };
        for side in sides {
            for [along, up] in ends {
                let point = at::<S>([along, middle + side * width, up]);
                self.touch(a, b, point, at::<S>([normal[0], 0.0, normal[1]]), 0.0);
            }
        }
    }
    /// The joint of a level face at height `up` between `low` and `high` along x: a lies on b.
    pub fn rest(&mut self, a: usize, b: usize, [low, high]: [f64; 2], up: f64, deep: (f64, f64)) {
        self.joint((a, b), [[low, up], [high, up]], [0.0, 1.0], deep);
    }
    /// States the contact of two balls of one radius \[m\] on the line between their centres, where they are.
    pub fn balls(&mut self, a: usize, b: usize, radius: f64) {
        let apart = self.centres[a] - self.centres[b];
        let distance = apart.norm();
        let normal = apart * (1.0 / distance);
        let point = self.centres[b] + apart * 0.5;
        self.touch(a, b, point, normal, distance - 2.0 * radius);
    }
    /// States the contact of a ball with the floor below it, where the ball is.
    pub fn ball_on_floor(&mut self, ball: usize, radius: f64) {
        let mut point = self.centres[ball];
        let height = point[S::DIM - 1];
        point[S::DIM - 1] = 0.0;
        self.touch(ball, FLOOR, point, at::<S>([0.0, 0.0, 1.0]), height - radius);
    }
    /// The problem.
    pub fn finish(self) -> ContactProblem<S> {
        self.problem
    }
}

/// Cosine and sine of an angle \[rad\], the same bits everywhere.
pub fn cosine_sine(angle: f64) -> [f64; 2] {
    carom::Turn::from_angle(angle).0
}
