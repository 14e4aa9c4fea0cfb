//! Tangential restitution (theory eq. 3.19): case C8, Garwin's superball, by both schemes and every law that has it. By
//! fixed steps a ball bounces up to a step early, with the arm to the floor that it has there: what is asked of them to
//! rounding starts on the floor.
//! A ball with I = k m R^2 on a floor, u = v + R w: v' = v - (1 + e_t) k u/(1 + k), R w' = R w - (1 + e_t) u/(1 + k).

use crate::cases::{events, without_weight};
use crate::harness::*;
use carom::{BodySpec, Column, ImpactLaw, MaterialPair, Mixing, Scheme, Settings, Spatial, World, vec3};

in_plane_and_space!(
    a_superball_bounces_as_garwin_says,
    a_part_of_the_slip_turns_round_as_the_coefficient_says,
    a_superball_slips_where_friction_is_short,
    a_superball_bounces_back_and_forth,
    a_superball_thrown_under_a_table_comes_back,
    two_superballs_keep_momentum_and_energy,
    what_does_not_bounce_keeps_coulomb_s_friction,
    laws_without_tangential_restitution_refuse_it,
    pairs_of_materials_say_it_too,
);

/// Radius of the balls \[m\].
const R: f64 = 0.1;

/// The laws that turn slips round.
const TURNING: [ImpactLaw; 3] = [ImpactLaw::Newton, ImpactLaw::GeneralizedReflections, ImpactLaw::Sequential];

/// What a ball is and how it is thrown at the floor, in a world without gravity.
#[derive(Clone, Copy)]
struct Throw {
    friction: f64,
    restitution: f64,
    turned: f64,
    /// Velocity along \[m/s\].
    along: f64,
    /// Velocity towards the floor \[m/s\].
    down: f64,
    /// R times the spin \[m/s\].
    rim: f64,
}

const THROW: Throw = Throw { friction: 10.0, restitution: 1.0, turned: 1.0, along: 2.0, down: 1.0, rim: 0.7 };

/// Both schemes without gravity under a law.
fn schemes<S: Dimension>(law: ImpactLaw) -> [(&'static str, Settings<S>); 2] {
    let impact = Some(law);
    [
        ("events", Settings { impact, ..without_weight(1e-3) }),
        ("fixed_step", Settings { impact, ..weightless(1e-3) }),
    ]
}

fn thrown<S: Dimension>(settings: Settings<S>, throw: &Throw) -> World<S> {
    let above = if settings.scheme == Scheme::Events { 0.5 * R } else { 0.0 };
    let mut w = world::<S>(settings);
    add_floor(&mut w, throw.friction, 0.0);
    let ball = BodySpec::heavy(S::ball(R), 0.3).at(S::at(0.0, R + above)).friction(throw.friction);
    let ball = ball.restitution(throw.restitution).tangential_restitution(throw.turned);
    add(&mut w, "ball", ball.moving(S::at(throw.along, -throw.down)).spinning(S::turn(throw.rim / R)));
    w
}

/// Velocity along and R times the spin of the ball \[m/s\].
fn state<S: Dimension>(w: &World<S>) -> (f64, f64) {
    (speed(w, 1), R * S::rate(w.bodies().motion.angular_velocity[1]))
}

/// Runs until the ball leaves the floor, and until it is clear of it.
fn bounce<S: Dimension>(w: &mut World<S>) {
    let energy = w.energy().kinetic();
    while S::up(w.bodies().motion.velocity[1]) < 0.0 {
        step(w);
    }
    settle(w, 0.01);
    assert!(w.energy().kinetic() <= energy * (1.0 + 1e-14), "a bounce gains no energy");
}

/// Case C8: (3 v - 4 R w)/7 and (-10 v - 3 R w)/7 for the solid sphere, (v - 2 R w)/3 and (-4 v - R w)/3 for the disc.
pub fn a_superball_bounces_as_garwin_says<S: Dimension>() {
    for (law, (scheme, settings)) in TURNING.into_iter().flat_map(|l| schemes::<S>(l).map(|s| (l, s))) {
        for (v, rim) in [(2.0, 0.0), (2.0, 0.7), (0.0, -3.0), (-1.0, 1.0)] {
            let mut w = thrown::<S>(settings.clone(), &Throw { along: v, rim, ..THROW });
            let energy = w.energy().kinetic();
            bounce(&mut w);
            let wanted = if S::ROUNDNESS == 0.4 {
                ((3.0 * v - 4.0 * rim) / 7.0, (-10.0 * v - 3.0 * rim) / 7.0)
            } else {
                ((v - 2.0 * rim) / 3.0, (-4.0 * v - rim) / 3.0)
            };
            let (along, round) = state(&w);
            close(along, wanted.0, 1e-14, &format!("C8 v', {scheme}, {law:?} [m/s]"));
            close(round, wanted.1, 1e-14, &format!("C8 R w', {scheme}, {law:?} [m/s]"));
            let kept = w.energy().kinetic() / energy - 1.0;
            close(kept, 0.0, 1e-14, &format!("C8 energy gained, {scheme}, {law:?} [1]"));
        }
    }
}

/// Eq. 3.19 for any share, whatever the normal restitution; 0 is Coulomb's bounce, which ends rolling.
pub fn a_part_of_the_slip_turns_round_as_the_coefficient_says<S: Dimension>() {
    let k = S::ROUNDNESS;
    for (scheme, settings) in schemes::<S>(ImpactLaw::GeneralizedReflections) {
        for (turned, restitution) in [(0.0, 1.0), (0.3, 0.5), (0.8, 0.5), (1.0, 0.2)] {
            let throw = Throw { turned, restitution, ..THROW };
            let mut w = thrown::<S>(settings.clone(), &throw);
            bounce(&mut w);
            let u = throw.along + throw.rim;
            let (along, round) = state(&w);
            let share = (1.0 + turned) / (1.0 + k);
            close(along, throw.along - share * k * u, 1e-14, &format!("v', e_t = {turned}, {scheme} [m/s]"));
            close(round, throw.rim - share * u, 1e-14, &format!("R w', e_t = {turned}, {scheme} [m/s]"));
            close(along + round, -turned * u, 1e-14, &format!("u', e_t = {turned}, {scheme} [m/s]"));
        }
    }
}

/// Case C8: friction mu (1 + e) |u_n| is not enough below mu = (1 + e_t) k |u|/((1 + k) (1 + e) |u_n|): the ball slips on, and the
/// coefficient no longer matters.
pub fn a_superball_slips_where_friction_is_short<S: Dimension>() {
    let k = S::ROUNDNESS;
    let u = THROW.along + THROW.rim;
    let limit = 2.0 * k * u / ((1.0 + k) * 2.0 * THROW.down);
    for (law, (scheme, settings)) in TURNING.into_iter().flat_map(|l| schemes::<S>(l).map(|s| (l, s))) {
        for friction in [0.05, 0.5 * limit, 0.999 * limit] {
            let mut w = thrown::<S>(settings.clone(), &Throw { friction, ..THROW });
            bounce(&mut w);
            let (along, round) = state(&w);
            let push = 2.0 * friction * THROW.down;
            let what = format!("mu = {friction}, {scheme}, {law:?}");
            close(along, THROW.along - push, 1e-14, &format!("C8 v' slipping, {what} [m/s]"));
            close(round, THROW.rim - push / k, 1e-13, &format!("C8 R w' slipping, {what} [m/s]"));
        }
        let mut w = thrown::<S>(settings, &Throw { friction: 1.001 * limit, ..THROW });
        bounce(&mut w);
        let (along, round) = state(&w);
        close(along + round, -u, 1e-14, &format!("C8 u' just inside the limit, {scheme}, {law:?} [m/s]"));
    }
}

/// Case C8: thrown forward with backspin R w = 5 v/2 (disc: 2 v) a superball comes back, and goes on so for ever: it never leaves
/// the strip that its first fall reaches. Without spin it goes forward at v and at 3 v/7 (v/3) in turn. By fixed steps
/// the speeds are good to the gap of a step over R; the energy is not.
pub fn a_superball_bounces_back_and_forth<S: Dimension>() {
    let (v, fall) = (1.0, 0.5_f64);
    let (back, slow) = if S::ROUNDNESS == 0.4 { (2.5, 3.0 / 7.0) } else { (2.0, 1.0 / 3.0) };
    let reach = v * (2.0 * fall / G).sqrt();
    for (scheme, settings) in [("events", events::<S>(0.01)), ("fixed_step", exact::<S>(0.002))] {
        for (rim, speeds) in [(back * v, [v, -v]), (0.0, [v, slow * v])] {
            let mut w = thrown::<S>(settings.clone(), &Throw { along: v, down: 0.0, rim, ..THROW });
            w.motion_mut().position[1] = S::at(0.0, R + fall);
            let (start, mut before) = (w.energy().total(), 0.0);
            let (mut bounces, mut farthest, mut off, mut worst) = (0, 0.0_f64, 0.0_f64, 0.0_f64);
            run(&mut w, 65.0, |w, r| {
                let up = S::up(w.bodies().motion.velocity[1]);
                bounces += usize::from(before < 0.0 && up > 0.0);
                before = up;
                off = off.max((speed(w, 1) - speeds[bounces % 2]).abs());
                farthest = farthest.max(S::along(w.bodies().motion.position[1]).abs());
                worst = worst.max((r.energy.total() / start - 1.0).abs());
            });
            assert!(bounces >= 100, "{bounces} bounces");
            at_most(worst, 1e-12, &format!("C8 energy over {bounces} bounces, {scheme} [1]"));
            if scheme == "events" {
                at_most(off, 1e-12, &format!("C8 speed along over {bounces} bounces [m/s]"));
                assert!(rim == 0.0 || farthest <= reach + 1e-10, "C8 reach: {farthest} m of {reach} m");
            } else {
                at_most(off, 0.1, &format!("C8 speed along over {bounces} bounces, fixed steps [m/s]"));
            }
        }
    }
}

/// Case C8, Garwin's throw under a table: floor, underside, floor, and -333/343 of the speed comes back (disc: -23/27).
pub fn a_superball_thrown_under_a_table_comes_back<S: Dimension>() {
    let (v, rim) =
        if S::ROUNDNESS == 0.4 { (-333.0 / 343.0, 130.0 / 343.0) } else { (-23.0 / 27.0, 20.0 / 27.0) };
    for law in TURNING {
        let settings = Settings { impact: Some(law), ..without_weight(1e-3) };
        let mut w = thrown::<S>(settings, &Throw { along: 1.0, rim: 0.0, ..THROW });
        let table = BodySpec::fixed(S::wall(S::at(0.0, -1.0))).at(S::at(0.0, 5.0 * R)).friction(10.0);
        add(&mut w, "table", table);
        let (energy, mut before, mut turns) = (w.energy().kinetic(), -1.0, 0);
        while turns < 3 {
            step(&mut w);
            let up = S::up(w.bodies().motion.velocity[1]);
            turns += usize::from(up * before < 0.0);
            before = up;
        }
        let (along, round) = state(&w);
        close(along, v, 1e-14, &format!("C8 v after three bounces, {law:?} [m/s]"));
        close(round, rim, 1e-14, &format!("C8 R w after three bounces, {law:?} [m/s]"));
        close(w.energy().kinetic() / energy, 1.0, 1e-14, &format!("C8 energy, {law:?} [1]"));
    }
}

/// Case C8: two balls of unlike mass and size that meet askew with spin: the slip turns round, and P, L and the energy stay.
pub fn two_superballs_keep_momentum_and_energy<S: Dimension>() {
    for (law, (scheme, settings)) in TURNING.into_iter().flat_map(|l| schemes::<S>(l).map(|s| (l, s))) {
        let mut w = world::<S>(settings);
        for (name, radius, mass, place, velocity, spin) in [
            ("one", 0.1, 1.0, S::at(0.0, 0.0), S::at(1.0, 0.2), 3.0),
            ("other", 0.2, 2.5, S::at(0.35, 0.12), S::at(-1.0, -0.3), -5.0),
        ] {
            let ball =
                BodySpec::heavy(S::ball(radius), mass).at(place).moving(velocity).spinning(S::turn(spin));
            add(&mut w, name, ball.friction(5.0).restitution(1.0).tangential_restitution(1.0));
        }
        let (momenta, energy) = (w.momenta(), w.energy().kinetic());
        settle(&mut w, 0.2);
        let after = w.momenta();
        let what = format!("{scheme}, {law:?}");
        assert!(speed(&w, 1) > -1.0 + 1e-3, "they met: {what}");
        at_most((after.linear - momenta.linear).norm(), 1e-14, &format!("C8 P lost, {what} [kg m/s]"));
        at_most((after.angular - momenta.angular).norm(), 1e-14, &format!("C8 L lost, {what} [kg m^2/s]"));
        close(w.energy().kinetic() / energy, 1.0, 1e-13, &format!("C8 energy of two balls, {what} [1]"));
    }
}

/// Case C8: in space the whole slip turns round, in both directions, and the spin about the normal stays.
#[test]
fn a_superball_in_space_turns_its_slip_in_both_directions() {
    for (scheme, settings) in schemes::<Spatial>(ImpactLaw::GeneralizedReflections) {
        let mut w = thrown::<Spatial>(settings, &THROW);
        let (v, spin) = (vec3(1.3, -0.4, -1.0), vec3(2.0, -3.0, 4.0));
        w.motion_mut().velocity[1] = v;
        w.motion_mut().angular_velocity[1] = spin;
        bounce(&mut w);
        let u = vec3(v[0] - R * spin[1], v[1] + R * spin[0], 0.0);
        let (after, round) = (w.bodies().motion.velocity[1], w.bodies().motion.angular_velocity[1]);
        let wanted = vec3(v[0], v[1], 1.0) - u * (4.0 / 7.0);
        at_most((after - wanted).norm(), 1e-14, &format!("C8 v' in space, {scheme} [m/s]"));
        let wanted = spin - vec3(u[1], -u[0], 0.0) * (10.0 / (7.0 * R));
        at_most((round - wanted).norm(), 1e-12, &format!("C8 w' in space, {scheme} [rad/s]"));
    }
}

/// Blocks that slide, land without restitution or come to rest end as if nothing were said of their slip, bit for bit.
pub fn what_does_not_bounce_keeps_coulomb_s_friction<S: Dimension>() {
    for settings in [events::<S>(0.01), exact::<S>(0.002)] {
        for (height, restitution) in [(0.1, 0.5), (0.3, 0.0)] {
            let end = |turned: f64| {
                let mut w = world::<S>(settings.clone());
                add_floor(&mut w, 0.4, 0.0);
                let block = BodySpec::heavy(S::block(0.3, 0.2), 1.0).at(S::at(0.0, height)).friction(0.4);
                let block = block.restitution(restitution).tangential_restitution(turned);
                add(&mut w, "block", block.moving(S::at(2.0, 0.0)));
                settle(&mut w, 1.0);
                bits(&w)
            };
            assert_eq!(end(1.0), end(0.0), "restitution {restitution}");
        }
    }
}

/// Moreau's law has one e for all of the velocity, Poisson's second phase no target: they say so by name.
pub fn laws_without_tangential_restitution_refuse_it<S: Dimension>() {
    for law in [ImpactLaw::Moreau, ImpactLaw::Poisson] {
        for (scheme, settings) in schemes::<S>(law) {
            let mut w = thrown::<S>(settings.clone(), &THROW);
            let error = w.step(1e-3).expect_err("it has none").to_string();
            let told =
                format!("impact has no tangential restitution: '{}'; body 'ball' asks for 1", law.name());
            assert!(error.contains(&told) && error.contains("generalized_reflections"), "{scheme}: {error}");
            w.set_settings(Settings { impact: Some(ImpactLaw::Newton), ..settings }).expect("possible");
            step(&mut w);
        }
    }
}

/// Bodies mix it as they mix restitution; a pair of materials overrides the mix, and a snapshot keeps both.
pub fn pairs_of_materials_say_it_too<S: Dimension>() {
    let mut w = world::<S>(Settings { restitution_mixing: Mixing::Mean, ..without_weight(1e-3) });
    let floor = BodySpec::fixed(S::floor()).material("stone").tangential_restitution(0.2);
    add(&mut w, "floor", floor);
    let ball = BodySpec::heavy(S::ball(R), 1.0).at(S::at(0.0, R)).material("rubber");
    add(&mut w, "ball", ball.tangential_restitution(0.8));
    step(&mut w);
    assert_eq!(w.touches()[0].tangential_restitution, 0.5, "the mean");
    let pair = MaterialPair { tangential_restitution: Some(0.25), ..MaterialPair::default() };
    w.set_pair("rubber", "stone", pair).expect("both are known");
    let (mut again, _) = World::<S>::from_snapshot(&w.snapshot()).expect("a snapshot");
    for w in [&mut w, &mut again] {
        step(w);
        assert_eq!(w.touches()[0].tangential_restitution, 0.25, "the pair's");
        assert_eq!(w.bodies().data[1].tangential_restitution, 0.8);
    }
    let wrong = MaterialPair { tangential_restitution: Some(1.5), ..MaterialPair::default() };
    let error = w.set_pair("rubber", "stone", wrong).expect_err("above 1").to_string();
    assert!(error.contains("tangential_restitution must be in [0, 1], got 1.5"), "{error}");
    let wrong = BodySpec::heavy(S::ball(R), 1.0).tangential_restitution(-0.1);
    let error = w.add("wrong", wrong).expect_err("below 0").to_string();
    assert!(error.contains("tangential_restitution must be in [0, 1], got -0.1"), "{error}");
}
