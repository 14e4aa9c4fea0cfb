//! One collision between two bodies, or a body and an obstacle: the pieces of `carom_solver::collision` and the
//! rows of one contact (theory chapter 3).

use crate::common::*;
use carom_math::skew::{cross_planar, skew_planar, skew_spatial};
use carom_math::{Column, Inertia, Planar, Space, Spatial, vec1, vec2};
use carom_solver::collision::*;
use carom_solver::delassus::delassus;
use carom_solver::{ContactProblem, InverseMass, SolverKind, Twist};

/// Two bodies that touch at the tips of their arms.
struct Pair<S: Space> {
    masses: [InverseMass<S>; 2],
    velocities: [Twist<S>; 2],
    arms: [S::Vector; 2],
    normal: S::Vector,
}

impl<S: Space> Pair<S> {
    /// A random pair; turned about, if need be, so that it approaches.
    fn approaching(random: &mut Random) -> Self {
        let mut pair: Self = Pair {
            masses: [random.inverse_mass(), random.inverse_mass()],
            velocities: [random.twist(1.0), random.twist(1.0)],
            arms: [random.column(0.5), random.column(0.5)],
            normal: random.unit(),
        };
        if pair.speed() > 0.0 {
            pair.normal = -pair.normal;
        }
        pair
    }
    fn speed(&self) -> f64 {
        normal_velocity(self.normal, (&self.velocities[0], self.arms[0]), (&self.velocities[1], self.arms[1]))
    }
    fn mass(&self) -> f64 {
        effective_mass(self.normal, (&self.masses[0], self.arms[0]), (&self.masses[1], self.arms[1]))
    }
    fn collide(&self, restitution: f64) -> (Twist<S>, Twist<S>, f64) {
        collide(
            (&self.velocities[0], &self.masses[0], self.arms[0]),
            (&self.velocities[1], &self.masses[1], self.arms[1]),
            self.normal,
            restitution,
        )
    }
    fn problem(&self) -> ContactProblem<S> {
        let mut problem = ContactProblem::new(self.masses.to_vec(), self.velocities.to_vec());
        problem.contacts.push(contact((0, self.arms[0]), (1, self.arms[1]), self.normal));
        problem
    }
    /// Centres that put the contact point at the origin.
    fn positions(&self) -> [S::Vector; 2] {
        [-self.arms[0], -self.arms[1]]
    }
}

/// Item 5, in the plane: [w]x r is w x r, and W = sum (1/m) 1 + (1/I) (1 x r)(1 x r)^T (theory eq. 3.4).
#[test]
fn planar_skew_maps_give_the_contact_matrix() {
    let mut random = Random::new(5);
    for _ in 0..100 {
        let pair = Pair::<Planar>::approaching(&mut random);
        let mut w = [[0.0; 2]; 2];
        for (m, arm) in pair.masses.iter().zip(pair.arms) {
            let turned = cross_planar(1.0, arm);
            let skew = skew_planar(1.0);
            for i in 0..2 {
                assert_close(skew[i][0] * arm[0] + skew[i][1] * arm[1], turned[i], 0.0, "[w]x r");
                for j in 0..2 {
                    w[i][j] += if i == j { m.linear } else { 0.0 } + m.angular.0 * turned[i] * turned[j];
                }
            }
        }
        assert_contact_matrix(&pair, |i, j| w[i][j]);
    }
}

/// Item 5, in space: W = sum (1/m) 1 - [r]x I^-1 [r]x (theory eq. 3.4).
#[test]
fn spatial_skew_maps_give_the_contact_matrix() {
    let mut random = Random::new(6);
    for _ in 0..100 {
        let pair = Pair::<Spatial>::approaching(&mut random);
        let mut w = [[0.0; 3]; 3];
        for (m, arm) in pair.masses.iter().zip(pair.arms) {
            let (skew, inverse) = (skew_spatial(arm), m.angular.rows());
            for i in 0..3 {
                w[i][i] += m.linear;
                for j in 0..3 {
                    for k in 0..9 {
                        w[i][j] -= skew[i][k / 3] * inverse[k / 3][k % 3] * skew[k % 3][j];
                    }
                }
            }
        }
        assert_contact_matrix(&pair, |i, j| w[i][j]);
    }
}

/// The rows of the contact, in its frame, must be frame^T W frame.
fn assert_contact_matrix<S: Space>(pair: &Pair<S>, w: impl Fn(usize, usize) -> f64) {
    let a = delassus(&pair.problem()).dense();
    let mut frame = vec![pair.normal];
    frame.extend((0..S::SLIP).map(|k| S::tangent(pair.normal, k)));
    for (i, p) in frame.iter().enumerate() {
        for (j, q) in frame.iter().enumerate() {
            let wanted: f64 =
                (0..S::DIM * S::DIM).map(|k| p[k / S::DIM] * w(k / S::DIM, k % S::DIM) * q[k % S::DIM]).sum();
            assert_close(a[i][j], wanted, 1e-12, "entry of W");
        }
    }
}

/// Item 16.
fn an_impulse_at_a_point_moves_the_body_like_the_impulse_and_turns_it_like_its_moment<S: Space>() {
    let mut random = Random::new(16);
    for _ in 0..100 {
        let (mass, before) = (random.inverse_mass::<S>(), random.twist::<S>(1.0));
        let (arm, impulse): (S::Vector, S::Vector) = (random.column(0.5), random.column(2.0));
        let after = apply_impulse(&before, &mass, arm, impulse);
        let momentum = (after.linear - before.linear) * (1.0 / mass.linear);
        let inertia = mass.angular.inverse().expect("regular");
        assert_column_close(momentum, impulse, 1e-13, "m dv = j");
        assert_column_close(
            inertia.apply(after.angular - before.angular),
            S::moment(arm, impulse),
            1e-13,
            "I dw = r x j",
        );
        // the work of an impulse is its product with the mean velocity of the point (theory eq. 1.37)
        let work = impulse.dot(before.at(arm) + after.at(arm)) * 0.5;
        let gained = kinetic(&mass, &after) - kinetic(&mass, &before);
        assert_close(gained, work, 1e-12, "work of the impulse");
    }
}

fn kinetic<S: Space>(mass: &InverseMass<S>, v: &Twist<S>) -> f64 {
    let spin = mass.angular.inverse().map_or(0.0, |i| v.angular.dot(i.apply(v.angular)));
    0.5 * (v.linear.norm_squared() / mass.linear + spin)
}

/// Item 17: an obstacle drops out of the effective mass, stays as it is, and its own velocity counts.
fn a_body_bounces_off_an_obstacle_that_keeps_its_velocity<S: Space>() {
    let mut random = Random::new(17);
    for _ in 0..100 {
        let mut pair = Pair::<S>::approaching(&mut random);
        pair.masses[1] = obstacle();
        let m = &pair.masses[0];
        let moment = S::moment(pair.arms[0], pair.normal);
        let wanted = 1.0 / (m.linear + moment.dot(m.angular.apply(moment)));
        assert_close(pair.mass(), wanted, 1e-13 * wanted, "effective mass against an obstacle");
        let (a, b, gamma) = pair.collide(0.7);
        assert_eq!(b, pair.velocities[1]);
        assert!(gamma > 0.0);
        let after = normal_velocity(pair.normal, (&a, pair.arms[0]), (&b, pair.arms[1]));
        assert_close(after, -0.7 * pair.speed(), 1e-13, "restitution");
    }
}

/// Item 18: momentum and angular momentum stay, restitution holds, and the energy lost is that of the formula.
fn two_bodies_collide_and_keep_their_momenta<S: Space>() {
    let mut random = Random::new(18);
    for restitution in [0.0, 0.4, 1.0] {
        for _ in 0..100 {
            let pair = Pair::<S>::approaching(&mut random);
            let (a, b, gamma) = pair.collide(restitution);
            let problem = pair.problem();
            let (p0, l0, t0) = totals(&problem, &pair.positions(), &pair.velocities);
            let (p1, l1, t1) = totals(&problem, &pair.positions(), &[a, b]);
            assert_column_close(p1, p0, 1e-14, "momentum");
            assert_column_close(l1, l0, 1e-14, "angular momentum");
            let after = normal_velocity(pair.normal, (&a, pair.arms[0]), (&b, pair.arms[1]));
            assert_close(after, -restitution * pair.speed(), 1e-13, "restitution");
            assert_close(t0 - t1, energy_lost(pair.speed(), restitution, pair.mass()), 1e-13, "energy lost");
            let by_impulse = 0.5 * (1.0 - restitution) / (1.0 + restitution) * gamma * gamma / pair.mass();
            assert_close(t0 - t1, by_impulse, 1e-13, "energy lost, from the impulse");
        }
    }
}

/// Item 19: the five steps of the recap, called one by one, are the collision.
fn the_five_steps_one_by_one_are_the_collision<S: Space>() {
    let mut random = Random::new(19);
    for _ in 0..100 {
        let pair = Pair::<S>::approaching(&mut random);
        let ([a, b], [mass_a, mass_b], n) = (&pair.velocities, &pair.masses, pair.normal);
        let point: S::Vector = random.column(1.0);
        let centers = [point - pair.arms[0], point - pair.arms[1]];
        // 1 detect, 2 offsets
        let (arm_a, arm_b) = (offset::<S>(point, centers[0]), offset::<S>(point, centers[1]));
        let speed = normal_velocity(n, (a, arm_a), (b, arm_b));
        assert!(collides(0.0, speed) && collides(-0.1, speed));
        // 3 effective mass and impulse
        let gamma = normal_impulse(speed, 0.5, effective_mass(n, (mass_a, arm_a), (mass_b, arm_b)));
        // 4 linear, 5 angular: plus for a, minus for b
        let (push, pull) = (n * gamma, -(n * gamma));
        let new_a = Twist::<S>::new(
            linear_response(a.linear, mass_a, push),
            angular_response::<S>(a.angular, mass_a, arm_a, push),
        );
        let new_b = Twist::<S>::new(
            linear_response(b.linear, mass_b, pull),
            angular_response::<S>(b.angular, mass_b, arm_b, pull),
        );
        let (whole_a, whole_b, whole_gamma) = pair.collide(0.5);
        assert_close(gamma, whole_gamma, 1e-13, "impulse");
        for (got, wanted) in [(new_a, whole_a), (new_b, whole_b)] {
            assert_column_close(got.linear, wanted.linear, 1e-13, "velocity");
            assert_column_close(got.angular, wanted.angular, 1e-12, "spin");
        }
    }
}

/// Item 19, the test of step 1: neither an open gap nor a separating pair collides.
fn a_pair_that_separates_is_left_alone<S: Space>() {
    assert!(!collides(1e-9, -1.0) && !collides(0.0, 0.0) && !collides(-0.1, 1e-9));
    let mut pair = Pair::<S>::approaching(&mut Random::new(20));
    pair.normal = -pair.normal;
    let (a, b, gamma) = pair.collide(1.0);
    assert_eq!((a, b, gamma), (pair.velocities[0], pair.velocities[1], 0.0));
    assert_eq!(energy_lost(pair.speed(), 0.0, pair.mass()), 0.0);
}

/// Two obstacles never collide: no impulse could move them, and none is invented.
fn two_obstacles_exchange_nothing<S: Space>() {
    let mut pair = Pair::<S>::approaching(&mut Random::new(21));
    pair.masses = [obstacle(), obstacle()];
    let (a, b, gamma) = pair.collide(1.0);
    assert_eq!((a, b, gamma), (pair.velocities[0], pair.velocities[1], 0.0));
}

/// Items 17, 18: balls that meet centrally collide like particles, whatever their inertia (theory eq. 3.6).
fn central_impacts_have_the_effective_mass_of_particles<S: Space>() {
    let n: S::Vector = along(0, 1.0);
    let (a, b) = (ball::<S>(2.0, 0.3), ball::<S>(3.0, 0.5));
    let mass = effective_mass(n, (&a, along(0, -0.3)), (&b, along(0, 0.5)));
    assert_close(mass, 1.0 / (1.0 / 2.0 + 1.0 / 3.0), 1e-15, "reduced mass");
}

/// The rod of theory section 3.6: Newton's restitution with friction creates energy, and the work of the impulses
/// shows how much. Every solver that treats normal and friction at once finds these numbers.
#[test]
fn the_rod_at_45_degrees_gains_the_energy_that_the_kick_identity_says() {
    let rod = InverseMass { linear: 1.0, angular: carom_math::Moment(12.0) };
    let half = 0.5 * 0.5f64.sqrt();
    let mut problem = ContactProblem::<Planar>::new(
        vec![rod, obstacle()],
        vec![Twist::new(vec2(0.6, -1.0), vec1(0.0)), Twist::default()],
    );
    let mut c = contact((0, vec2(-half, -half)), (1, vec2(0.0, 0.0)), vec2(0.0, 1.0));
    (c.target, c.restitution, c.friction) = (1.0, 1.0, 0.4);
    problem.contacts.push(c);
    let a = delassus(&problem).dense();
    // the frame's tangent is (-1, 0), the page's (1, 0)
    for (i, j, wanted) in [(0, 0, 2.5), (1, 1, 2.5), (0, 1, 1.5), (1, 0, 1.5)] {
        assert_close(a[i][j], wanted, 1e-15, "W");
    }
    for kind in [SolverKind::Pgs, SolverKind::PgsMatrix, SolverKind::Lemke, SolverKind::Direct] {
        let impulses = solved(&problem, kind, 1e-14);
        let g = impulses.contacts[0];
        assert_close(g.normal, 1.025, 1e-13, kind.name());
        assert_close(-g.tangent[0], 0.375, 1e-13, kind.name());
        let after = problem.velocities_after(&impulses);
        let gained = kinetic(&rod, &after[0]) - kinetic(&rod, &problem.velocities[0]);
        assert_close(gained, 0.1125, 1e-13, kind.name());
    }
}

in_both_spaces! {
    an_impulse_at_a_point_moves_the_body_like_the_impulse_and_turns_it_like_its_moment;
    a_body_bounces_off_an_obstacle_that_keeps_its_velocity;
    two_bodies_collide_and_keep_their_momenta;
    the_five_steps_one_by_one_are_the_collision;
    a_pair_that_separates_is_left_alone;
    two_obstacles_exchange_nothing;
    central_impacts_have_the_effective_mass_of_particles;
}
