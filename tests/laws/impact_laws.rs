//! What each impact law keeps and breaks, through the door that every scheme uses: random systems of contacts that
//! touch, with nothing left to approach afterwards. The guide's table is computed here and must be the page's.

use crate::harness::*;
use crate::laws::impacts::stacked;
use crate::laws::systems::{row, speeds, table};
use carom::geometry::MassProperties;
use carom::impact::{Impacts, Thresholds, Watched};
use carom::{
    BodySpec, Column, EnergyGuard, ImpactLaw, Ledger, Planar, Settings, SolverKind, StepError, Touch, World,
    unwatched,
};

in_plane_and_space!(
    every_law_ends_with_nothing_that_approaches,
    every_law_keeps_momentum,
    no_law_gains_energy_under_the_guard,
    slips_that_turn_round_keep_momentum_and_gain_nothing_under_the_guard,
    moreau_and_one_by_one_gain_nothing_unguarded,
    reflections_without_friction_gain_nothing_even_with_unlike_restitution,
    moreau_loses_at_least_what_its_bound_says,
    poisson_gives_back_its_share_of_compression,
    slow_approaches_end_at_once_on_all_that_touch,
    the_guard_warns_clamps_or_raises,
);

/// Random systems per kind.
const SYSTEMS: u64 = 1000;

/// What a random system is made of.
#[derive(Clone, Copy)]
struct Kind {
    friction: f64,
    /// One coefficient for all contacts; `None`: one for each.
    restitution: Option<f64>,
}

/// One system: bodies in a world, and contacts between them that nothing but their lists holds together.
struct System<S: Dimension> {
    world: World<S>,
    touches: Vec<Touch<S>>,
}

/// Four bodies, some at rest, and an obstacle; six contacts with random arms and normals.
fn system<S: Dimension>(seed: u64, kind: Kind) -> System<S> {
    let mut dice = Dice(seed);
    let mut world = world::<S>(weightless(1e-3));
    let near = |dice: &mut Dice| S::Vector::from_fn(|_| dice.between(-1.0, 1.0));
    add(&mut world, "obstacle", BodySpec::fixed(S::floor()));
    for k in 0..4 {
        let (mass, moment) = (dice.between(0.5, 2.0), dice.between(0.1, 0.5));
        let inertia = S::moment_of(moment);
        let properties = MassProperties { mass, center: S::Vector::ZERO, inertia, error: 0.0 };
        let spec = BodySpec::given(None, properties).at(near(&mut dice));
        // half of them at rest: contacts that a blow reaches only through others
        let pace = if dice.roll() < 0.5 { 0.0 } else { 1.0 };
        let spin = S::Spin::from_fn(|_| dice.between(-1.0, 1.0) * pace);
        let spec = spec.moving(near(&mut dice) * pace).spinning(spin);
        add(&mut world, &format!("body {k}"), spec);
    }
    let pairs = [(1, 0), (2, 0), (2, 1), (3, 2), (4, 3), (4, 1)];
    let mut touches = Vec::new();
    for (k, (a, b)) in pairs.into_iter().enumerate() {
        let normal = near(&mut dice).normalized().expect("not zero");
        let place = world.bodies().motion.position[a];
        touches.push(Touch {
            id: k as u64,
            a,
            b,
            point: place + near(&mut dice) * 0.5,
            normal,
            gap: 0.0,
            friction: kind.friction,
            rolling: 0.0,
            spinning: 0.0,
            restitution: kind.restitution.unwrap_or_else(|| dice.roll()),
            tangential_restitution: 0.0,
        });
    }
    System { world, touches }
}

/// Thresholds of a scheme that stops at impacts: everything touches, and rounds go on to the end.
fn to_the_end(rest_speed: f64) -> Thresholds {
    let noise = 1e-8;
    Thresholds {
        rest_speed,
        elastic_rest_speed: rest_speed,
        still_speed: noise,
        call_speed: noise,
        touching: 1.0,
        dt: 1.0,
        thorough: true,
    }
}

/// What a law made of a system.
struct Struck<S: Dimension> {
    impacts: Impacts<S>,
    ledger: Ledger,
    /// Energy after minus energy before.
    change: f64,
    /// Energy before.
    energy: f64,
    /// The fastest approach that is left.
    approach: f64,
}

fn strike<S: Dimension>(system: &mut System<S>, law: ImpactLaw, energy_guard: EnergyGuard) -> Struck<S> {
    strike_above(system, law, energy_guard, 0.0)
}

fn strike_above<S: Dimension>(
    System { world, touches }: &mut System<S>,
    law: ImpactLaw,
    energy_guard: EnergyGuard,
    rest_speed: f64,
) -> Struck<S> {
    let settings = Settings {
        impact: Some(law),
        energy_guard,
        solver: Some(SolverKind::Auto),
        iterations: 2000,
        tolerance: 1e-11,
        ..weightless::<S>(1e-3)
    };
    let energy = world.energy().kinetic();
    let (mut impacts, mut ledger) = (Impacts::default(), Ledger::default());
    let mut solver = settings.solver_kind().make::<S>();
    let mut watched = Watched { solver: solver.as_mut(), watch: &mut unwatched };
    let bodies = world.bodies_mut();
    impacts.resolve(bodies, touches, &settings, &to_the_end(rest_speed), &mut watched, &mut ledger);
    let approach = touches.iter().map(|t| -carom::narrow_phase::normal_velocity(bodies, t));
    let approach = approach.fold(0.0, f64::max);
    Struck { impacts, ledger, change: world.energy().kinetic() - energy, energy, approach }
}

/// All kinds: with and without friction, one restitution and many.
fn kinds() -> [Kind; 4] {
    [(0.0, Some(0.8)), (0.0, None), (0.5, Some(0.8)), (0.5, None)]
        .map(|(friction, restitution)| Kind { friction, restitution })
}

/// Nothing is left that approaches, whatever the law, and the books hold.
pub fn every_law_ends_with_nothing_that_approaches<S: Dimension>() {
    for law in ImpactLaw::ALL {
        let (mut most, mut ended) = (0, 0);
        for (seed, kind) in (0..SYSTEMS / 10).flat_map(|s| kinds().map(|k| (s, k))) {
            // the rest speed of a step of 1/1000 s: below it there is no end of ever smaller bounces
            let struck = strike_above(&mut system::<S>(seed, kind), law, EnergyGuard::Clamp, 5e-4);
            // twice the noise: the last solve's error beside it
            assert!(struck.approach <= 2e-8, "{law:?}, system {seed}: approach {:e}", struck.approach);
            let booked = struck.ledger.sum();
            assert!((struck.change - booked).abs() <= 1e-12, "{law:?}, system {seed}: {booked}");
            most = most.max(struck.impacts.rounds);
            ended += struck.impacts.ended_plastic;
        }
        println!("measured: {law:?}: at most {most} rounds, {ended} ended plastically");
        assert_eq!(ended, 0, "{law:?}: rounds that do not end by themselves");
    }
}

/// Every law pushes by equal and opposite impulses: bodies that nothing holds keep P and L.
pub fn every_law_keeps_momentum<S: Dimension>() {
    for law in ImpactLaw::ALL {
        for seed in 0..SYSTEMS / 40 {
            let mut free = system::<S>(seed, Kind { friction: 0.5, restitution: None });
            free.touches.retain(|t| t.b != 0);
            let before = free.world.momenta();
            strike(&mut free, law, EnergyGuard::Clamp);
            let after = free.world.momenta();
            at_most((after.linear - before.linear).norm(), 1e-13, &format!("{law:?} momentum [kg m/s]"));
            at_most((after.angular - before.angular).norm(), 1e-13, &format!("{law:?} spin [kg m^2/s]"));
        }
    }
}

/// How many systems of a kind gain energy.
fn gains<S: Dimension>(law: ImpactLaw, kind: Kind, energy_guard: EnergyGuard) -> usize {
    let gains = |seed: &u64| {
        let struck = strike(&mut system::<S>(*seed, kind), law, energy_guard);
        struck.change > 1e-9 * struck.energy
    };
    (0..SYSTEMS).filter(gains).count()
}

/// Theory eq. 3.22 for every law.
pub fn no_law_gains_energy_under_the_guard<S: Dimension>() {
    for (law, kind) in ImpactLaw::ALL.into_iter().flat_map(|l| kinds().map(|k| (l, k))) {
        assert_eq!(gains::<S>(law, kind, EnergyGuard::Clamp), 0, "{law:?} gains");
    }
}

/// Tangential restitution (theory eq. 3.19) of random shares: coupled with the normal it gains energy, where it acts by
/// itself too, and the guard sees it, collision by collision under the sequential law. Free bodies keep P and L.
pub fn slips_that_turn_round_keep_momentum_and_gain_nothing_under_the_guard<S: Dimension>() {
    let turning = |seed: u64, friction: f64| {
        let mut turning = system::<S>(seed, Kind { friction, restitution: Some(1.0) });
        let mut dice = Dice(seed);
        turning.touches.iter_mut().for_each(|t| t.tangential_restitution = dice.roll());
        turning
    };
    for law in [ImpactLaw::Newton, ImpactLaw::GeneralizedReflections, ImpactLaw::Sequential] {
        let (mut gained, mut told) = (0, 0);
        for (seed, friction) in (0..SYSTEMS / 4).flat_map(|s| [(s, 0.5), (s, 2.0)]) {
            let struck = strike(&mut turning(seed, friction), law, EnergyGuard::Clamp);
            assert!(struck.change <= 1e-9 * struck.energy, "{law:?}, system {seed}: gains {}", struck.change);
            assert!((struck.change - struck.ledger.sum()).abs() <= 1e-12, "{law:?}, system {seed}");
            assert!(struck.approach <= 2e-8, "{law:?}, system {seed}: approach {:e}", struck.approach);
            let unguarded = strike(&mut turning(seed, friction), law, EnergyGuard::Warn);
            let gains = unguarded.change > 1e-9 * unguarded.energy;
            gained += usize::from(gains);
            told += usize::from(gains && unguarded.impacts.guarded > 0);
            let mut free = turning(seed, friction);
            free.touches.retain(|t| t.b != 0);
            let before = free.world.momenta();
            strike(&mut free, law, EnergyGuard::Clamp);
            let after = free.world.momenta();
            let moved = (after.linear - before.linear).norm() + (after.angular - before.angular).norm();
            assert!(moved <= 1e-12, "{law:?}, system {seed}: P and L by {moved:e}");
        }
        println!("measured: {law:?}: {gained} of 500 systems gain without the guard");
        assert!(gained > 0 && told == gained, "{law:?}: {told} of {gained} gains are told");
    }
}

/// Theory eqs. 3.21 and 4.20, friction and unlike restitution included.
pub fn moreau_and_one_by_one_gain_nothing_unguarded<S: Dimension>() {
    for (law, kind) in
        [ImpactLaw::Moreau, ImpactLaw::Sequential].into_iter().flat_map(|l| kinds().map(|k| (l, k)))
    {
        assert_eq!(gains::<S>(law, kind, EnergyGuard::Warn), 0, "{law:?} gains");
    }
}

/// Section 4.5: gamma (u+ + u-) = gamma (1 - e) u- <= 0, contact by contact.
pub fn reflections_without_friction_gain_nothing_even_with_unlike_restitution<S: Dimension>() {
    for restitution in [Some(1.0), Some(0.8), None] {
        let kind = Kind { friction: 0.0, restitution };
        assert_eq!(gains::<S>(ImpactLaw::GeneralizedReflections, kind, EnergyGuard::Warn), 0);
    }
}

/// Theory eq. 3.21: Delta T <= -1/2 (1-e)/(1+e) gamma.A gamma, of one round, friction included.
pub fn moreau_loses_at_least_what_its_bound_says<S: Dimension>() {
    let mut rounds = 0;
    for seed in 0..SYSTEMS {
        let restitution = 0.1 * (seed % 11) as f64;
        let mut one = system::<S>(seed, Kind { friction: 0.5, restitution: Some(restitution) });
        let struck = strike(&mut one, ImpactLaw::Moreau, EnergyGuard::Warn);
        if struck.impacts.rounds != 1 {
            continue;
        }
        rounds += 1;
        let problem = &struck.impacts.problem;
        let gamma = struck.impacts.impulses.flat();
        let product = carom::solver::delassus::delassus(problem).times(&gamma);
        let product: f64 = product.iter().zip(&gamma).map(|(a, g)| a * g).sum();
        let bound = -0.5 * (1.0 - restitution) / (1.0 + restitution) * product;
        // the solve's tolerance 1e-11 m/s times impulses of a few N s
        assert!(struck.change <= bound + 1e-9, "system {seed}: {} above {bound}", struck.change);
    }
    assert!(rounds > 10, "{rounds} systems took one round");
}

/// Glocker and Pfeiffer: what compression pressed with comes back e times, and nothing penetrates; between smooth
/// bodies of one restitution that do not separate it is Newton's law.
pub fn poisson_gives_back_its_share_of_compression<S: Dimension>() {
    let poisson = |restitution: f64, speeds_in: &[f64]| {
        let mut w = row::<S>(ImpactLaw::Poisson, 0.0, speeds_in);
        w.set_settings(Settings { restitution_mixing: carom::Mixing::Min, ..w.settings().clone() })
            .expect("yes");
        for data in &mut w.bodies_mut().data {
            data.restitution = restitution;
        }
        step(&mut w);
        speeds(&w)
    };
    for e in [0.0, 0.5, 1.0] {
        // compression makes 1/3 of all, and gives back e times its impulses (2/3, 1/3)
        let wanted = [1.0 - (1.0 + e) * 2.0 / 3.0, (1.0 + e) / 3.0, (1.0 + e) / 3.0];
        for (got, wanted) in poisson(e, &[1.0, 0.0, 0.0]).iter().zip(wanted) {
            close(*got, wanted, 1e-11, &format!("Poisson's cradle, e = {e} [m/s]"));
        }
    }
    // compression (7, 3) comes back as (7, 3.5): the second contact must push on, or bodies would run together
    for (got, wanted) in poisson(1.0, &[10.0, -1.0, 0.0]).iter().zip([-4.0, 6.5, 6.5]) {
        close(*got, wanted, 1e-11, "Poisson's second phase pushes more than its share [m/s]");
    }
}

/// Approaches below the rest speed end in one plastic round on everything that touches, booked as the rest cut.
pub fn slow_approaches_end_at_once_on_all_that_touch<S: Dimension>() {
    for seed in 0..SYSTEMS / 40 {
        let mut slow = system::<S>(seed, Kind { friction: 0.5, restitution: Some(1.0) });
        let law = ImpactLaw::GeneralizedReflections;
        let struck = strike_above(&mut slow, law, EnergyGuard::Clamp, 100.0);
        assert!(struck.impacts.rounds <= 1, "system {seed}: {} rounds", struck.impacts.rounds);
        assert_eq!(struck.ledger.impact_normal, 0.0);
        assert!(struck.ledger.rest_cut <= 0.0 && struck.change <= 0.0);
    }
}

/// A rod of half length 1 at 45 degrees strikes the floor obliquely with e = 1 and friction: by Newton's law it sticks
/// with gamma = W^-1 (2 |u_n|, -u_t), which gains u_t gamma_t/2.
fn trap<S: Dimension>(energy_guard: EnergyGuard) -> World<S> {
    let tip = 1e-3; // the end is a small ball; arms are those of the bare rod
    let half = 0.5_f64.sqrt();
    let properties = MassProperties {
        mass: 1.0,
        center: S::at(half, half - tip),
        inertia: S::moment_of(1.0 / 3.0),
        error: 0.0,
    };
    let rod = BodySpec::given(Some(S::ball(tip)), properties).at(S::at(0.0, half));
    let mut w = world::<S>(Settings { energy_guard, ..weightless(1e-6) });
    add_floor(&mut w, 0.5, 1.0);
    let velocity = S::at(0.5, -(0.75_f64.sqrt()));
    add(&mut w, "rod", rod.moving(velocity).friction(0.5).restitution(1.0));
    w
}

/// Theory section 3.6: the same impact under each guard.
pub fn the_guard_warns_clamps_or_raises<S: Dimension>() {
    let gamma_t = (1.5 * 2.0 * 0.75_f64.sqrt() - 2.5 * 0.5) / 4.0;
    let gain = 0.5 * 0.5 * gamma_t;
    let mut warned = trap::<S>(EnergyGuard::Warn);
    let energy = warned.energy().total();
    let report = step(&mut warned);
    close(warned.energy().total() - energy, gain, 1e-11, "energy gained under warn [J]");
    close(report.impacts.gain, gain, 1e-11, "what the report says of it [J]");
    assert_eq!((report.impacts.guarded, report.impacts.gaining), (1, Some((0, 1))));
    assert!(warned.explain(&report).text().contains("impact law newton gains"));
    let lines = report.ledger.impact_normal + report.ledger.impact_friction;
    close(lines, gain, 1e-11, "the ledger's lines of it [J]");

    let mut clamped = trap::<S>(EnergyGuard::Clamp);
    let report = step(&mut clamped);
    assert!(clamped.energy().total() <= energy * (1.0 + 1e-14), "a clamped impact gains nothing");
    assert_eq!(report.impacts.guarded, 1);
    close(report.impacts.gain, gain, 1e-11, "what the law would have gained [J]");
    assert!(clamped.explain(&report).text().contains("Moreau's law was taken there"));

    let mut raised = trap::<S>(EnergyGuard::Raise);
    let before = (bits(&raised), raised.time(), *raised.ledger());
    let error = raised.step(1e-6).expect_err("it gains");
    let StepError::EnergyGain { bodies: (one, other), law, energy, .. } = &error else { panic!("{error}") };
    assert_eq!((one.as_str(), other.as_str(), *law), ("floor", "rod", "newton"));
    close(*energy, gain, 1e-11, "what the error says [J]");
    assert_eq!((bits(&raised), raised.time(), *raised.ledger()), before, "the world is unchanged");
    let text = error.to_string();
    assert!(text.contains("bodies 'floor' and 'rod'") && text.contains("energy_guard"), "{text}");
}

/// Velocities as the page has them: three decimals, without idle zeros.
fn listed(velocities: &[f64]) -> String {
    let short = |v: &f64| {
        let text = format!("{:.3}", if v.abs() < 5e-4 { 0.0 } else { *v });
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    };
    format!("({})", velocities.iter().map(short).collect::<Vec<_>>().join(", "))
}

fn said(yes: bool) -> String {
    if yes { "yes".into() } else { "no".into() }
}

/// Velocities of Bernoulli's three balls, the targets added in one order or the other.
fn three_balls(law: ImpactLaw, swapped: bool) -> Vec<carom::Vec2> {
    let (c, s) = (0.2 * 0.75_f64.sqrt(), if swapped { -0.1 } else { 0.1 });
    let still = carom::Vec2::ZERO;
    let at = <Planar as Dimension>::at;
    let mut w = table::<Planar>(law, &[(still, at(1.0, 0.0)), (at(c, s), still), (at(c, -s), still)]);
    step(&mut w);
    let v = w.bodies().motion.velocity.clone();
    if swapped { vec![v[0], v[2], v[1]] } else { v }
}

fn cradle(law: ImpactLaw, gap: f64, before: &[f64]) -> Vec<f64> {
    let mut w = row::<Planar>(law, gap, before);
    settle(&mut w, 0.01);
    speeds(&w)
}

/// A column of the page's table: what one law does.
fn column(law: ImpactLaw) -> Vec<String> {
    let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
    let balls = three_balls(law, false);
    let mirrored = (balls[1][1] + balls[2][1]).abs() < 1e-9 && (balls[1][0] - balls[2][0]).abs() < 1e-9;
    let swapped = three_balls(law, true);
    let ordered = balls.iter().zip(&swapped).all(|(a, b)| (*a - *b).norm() < 1e-9);
    let one_in = |n: usize| (0..n).map(|k| if k == 0 { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
    let two_in = [1.0, 1.0, 0.0, 0.0, 0.0];
    let continuous = same(&cradle(law, 0.0, &one_in(5)), &cradle(law, 1e-7, &one_in(5)));
    let mut drop = stacked::<Planar>(0.0, 0.0, law, 1e-3);
    drop.set_settings(Settings { gravity: carom::Vec2::ZERO, ..drop.settings().clone() }).expect("possible");
    let down = <Planar as Dimension>::at(0.0, -1.0);
    drop.motion_mut().velocity[1] = down;
    drop.motion_mut().velocity[2] = down;
    step(&mut drop);
    let dropped = [1, 2].map(|k| drop.bodies().motion.velocity[k][1]);
    let unguarded = |friction: f64, restitution: Option<f64>| {
        let kind = Kind { friction, restitution };
        gains::<Planar>(law, kind, EnergyGuard::Warn).to_string()
    };
    let kept = |seed: u64| {
        let elastic = Kind { friction: 0.0, restitution: Some(1.0) };
        let struck = strike(&mut system::<Planar>(seed, elastic), law, EnergyGuard::Warn);
        struck.change.abs() <= 1e-9 * struck.energy
    };
    vec![
        listed(&cradle(law, 0.0, &one_in(3))),
        listed(&cradle(law, 0.0, &one_in(4))),
        listed(&cradle(law, 0.0, &one_in(5))),
        listed(&cradle(law, 0.0, &two_in)),
        listed(&dropped),
        said(continuous),
        said(mirrored),
        said(ordered),
        (0..SYSTEMS).filter(|seed| kept(*seed)).count().to_string(),
        unguarded(0.0, Some(0.8)),
        unguarded(0.0, None),
        unguarded(0.5, Some(0.8)),
        unguarded(0.5, None),
    ]
}

/// The guide's table of what each law keeps and breaks, computed.
#[test]
fn the_guide_s_table_of_laws_is_what_they_do() {
    let rows = [
        "cradle of 3, one in [m/s]",
        "cradle of 4, one in [m/s]",
        "cradle of 5, one in [m/s]",
        "cradle of 5, two in [m/s]",
        "stacked drop, 3 kg under 1 kg [m/s]",
        "same for no gaps and tiny gaps",
        "mirror symmetry",
        "independent of the contacts' order",
        "of 1000 elastic frictionless systems keep energy",
        "of 1000 gain: no friction, one e",
        "of 1000 gain: no friction, unlike e",
        "of 1000 gain: friction, one e",
        "of 1000 gain: friction, unlike e",
    ];
    let columns = ImpactLaw::ALL.map(column);
    let mut lines = vec![
        format!("| | {} |", ImpactLaw::ALL.map(|l| format!("`{}`", l.name())).join(" | ")),
        format!("|---|{}", "---|".repeat(columns.len())),
    ];
    for (k, row) in rows.iter().enumerate() {
        let cells: Vec<&str> = columns.iter().map(|c| c[k].as_str()).collect();
        lines.push(format!("| {row} | {} |", cells.join(" | ")));
    }
    let computed = lines.join("\n");
    let page = include_str!("../../docs/guide/choosing-an-impact-law.md");
    assert!(page.contains(&computed), "the page's table must be the computed one:\n{computed}");
}
