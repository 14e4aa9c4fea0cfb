//! Books of groups of bodies: energy, momentum and angular momentum by cause close group by group, groups that divide
//! the world add up to it, and lines are what closed forms say (theory sections 6.3 and 8.4). Closure is an identity,
//! so that beside it stand tests of places and of overlaps. Both schemes; runs of ten thousand steps are ignored
//! unless asked for, each with a short twin.

use crate::harness::*;
use crate::laws::determinism::heap;
use crate::laws::ledger::brawl;
use carom::{
    BodySpec, Column, GroupReport, Integrator, LedgerGroup, MomentumLedger, Motion, PositionCorrection,
    Scheme, Settings, SolverKind, Spatial, World, Wrench,
};

in_plane_and_space!(
    groups_that_divide_the_world_add_up_to_it,
    books_of_groups_close_for_every_integrator_and_correction,
    books_of_groups_close_when_solves_are_cut_short,
    books_of_groups_close_with_events_and_loads,
    books_of_groups_close_when_events_do_not_end,
    a_block_that_slides_to_rest_gives_its_momentum_to_the_floor,
    a_blow_takes_from_one_group_what_it_gives_the_other,
    gravity_and_the_floor_share_a_thrown_block_s_momenta,
    books_change_no_bit_of_the_motion,
    groups_that_make_no_sense_are_refused,
    isolated_bodies_keep_their_momenta_while_overlaps_are_corrected,
    a_stack_keeps_its_books_and_its_place,
    a_pile_that_settles_keeps_its_books,
    boxes_that_tumble_keep_their_books,
);

const SCHEMES: [Scheme; 2] = [Scheme::FixedStep, Scheme::Events];

/// All that moves, and its bodies by turns in one of two groups.
fn divide<S: Dimension>(w: &mut World<S>) {
    let movers: Vec<usize> = (0..w.bodies().len()).filter(|&i| w.bodies().is_dynamic(i)).collect();
    let half = |k: usize| {
        let some = movers.iter().enumerate().filter(|(n, _)| n % 2 == k);
        Some(some.map(|(_, &i)| w.bodies().names[i].clone()).collect())
    };
    let group = |name: &str, bodies| LedgerGroup { name: name.into(), bodies };
    let groups = vec![group("all", None), group("even", half(0)), group("odd", half(1))];
    w.set_ledger_groups(groups).expect("the groups are there");
}

fn longest<V: Column>(ledger: &MomentumLedger<V>) -> f64 {
    ledger.lines()[..10].iter().fold(0.0, |m, line| m.max(line.norm()))
}

/// Worst closures seen, of energy, momentum and angular momentum, each over the largest of its size and its lines.
#[derive(Default)]
struct Worst([f64; 3]);

impl Worst {
    /// Looks at the books of a step of some bodies.
    fn see<S: Dimension>(&mut self, w: &World<S>, groups: &[GroupReport<S>]) {
        let b = w.bodies();
        let movers = || (0..b.len()).filter(|&i| b.is_dynamic(i));
        let momentum: f64 = movers().map(|i| b.momentum(i).norm()).sum();
        let weight = w.settings().gravity.norm() * w.settings().dt;
        let push = |i: usize| b.momentum(i).norm() + b.data[i].mass_properties.mass * weight;
        // moments of gravity may cancel to the last bit, their rounding does not
        let arms: f64 =
            movers().map(|i| b.motion.position[i].norm() * push(i) + b.spin_momentum(i).norm()).sum();
        for g in groups {
            let energy = largest_line(&g.ledger).max(g.energy.kinetic()).max(g.energy.potential.abs());
            let found = [
                g.ledger.closure.abs() / energy.max(1e-300),
                g.momentum.closure.norm() / momentum.max(longest(&g.momentum)).max(1e-300),
                g.angular_momentum.closure.norm() / arms.max(longest(&g.angular_momentum)).max(1e-300),
            ];
            for (worst, found) in self.0.iter_mut().zip(found) {
                *worst = worst.max(found);
            }
        }
    }
    /// Asserts that nothing was off by more than a bound.
    fn within(&self, bound: f64, what: &str) {
        for (worst, name) in self.0.iter().zip(["energy", "momentum", "angular momentum"]) {
            at_most(*worst, bound, &format!("closure of {name}, {what} [1]"));
        }
    }
}

fn weather<S: Dimension>() -> Box<dyn carom::ForceField<S>> {
    Box::new(|time: f64, m: &Motion<S>, out: &mut [Wrench<S>]| {
        for (i, w) in out.iter_mut().enumerate() {
            w.force += m.position[i] * -2.0 - m.velocity[i] * 0.3 + S::at((3.0 * time).sin(), 0.0);
            w.torque += m.angular_velocity[i] * -0.01 + S::turn(0.02);
        }
    })
}

/// Runs the heap of all trades, with a moving obstacle, damping and loads, and looks at every step's books.
fn of_the_heap<S: Dimension>(settings: Settings<S>, steps: usize) -> (World<S>, Worst) {
    let mut w = heap::<S>(settings);
    w.set_force_field("weather", weather());
    divide(&mut w);
    let mut worst = Worst::default();
    for k in 0..steps {
        if k % 7 == 0 {
            w.apply_wrench(2 + k % 12, Wrench { force: S::at(40.0, -20.0), torque: S::turn(1.5) });
        }
        let report = step(&mut w);
        worst.see(&w, &report.groups);
    }
    (w, worst)
}

fn events<S: Dimension>(dt: f64) -> Settings<S> {
    Settings { dt, scheme: Scheme::Events, ..Settings::default() }
}

pub fn groups_that_divide_the_world_add_up_to_it<S: Dimension>() {
    for scheme in SCHEMES {
        let (w, _) = of_the_heap::<S>(Settings { scheme, ..Settings::default() }, 120);
        let [all, even, odd] = w.group_ledgers() else { panic!("three groups") };
        let scale = largest_line(w.ledger());
        let lines = even.ledger.lines().into_iter().zip(odd.ledger.lines());
        let whole = w.ledger().lines();
        for (k, (one, other)) in lines.enumerate().take(14) {
            let name = carom::Ledger::NAMES[k];
            close(one + other, whole[k], 1e-11 * scale, &format!("{name} of the halves, {scheme:?} [J]"));
            close(all.ledger.lines()[k], whole[k], 1e-11 * scale, &format!("{name} of all, {scheme:?} [J]"));
        }
        let scale = longest(&all.momentum);
        for (k, name) in MomentumLedger::<S::Vector>::NAMES.iter().enumerate() {
            let of = |g: &GroupReport<S>| (g.momentum.lines()[k], g.angular_momentum.lines()[k]);
            let ((p, l), (p0, l0), (p1, l1)) = (of(all), of(even), of(odd));
            at_most((p0 + p1 - p).norm(), 1e-11 * scale, &format!("momentum, {name} [kg m/s]"));
            at_most((l0 + l1 - l).norm(), 1e-10 * scale, &format!("angular momentum, {name} [kg m^2/s]"));
        }
    }
}

pub fn books_of_groups_close_for_every_integrator_and_correction<S: Dimension>() {
    for integrator in Integrator::ALL {
        for position_correction in
            [PositionCorrection::None, PositionCorrection::Nudge, PositionCorrection::SplitImpulse]
        {
            let settings = Settings::<S> { integrator, position_correction, ..Settings::default() };
            let (_, worst) = of_the_heap(settings, 240);
            // rounding of sums of a few hundred terms
            worst.within(1e-12, &format!("{integrator:?}, {position_correction:?}"));
        }
    }
}

pub fn books_of_groups_close_when_solves_are_cut_short<S: Dimension>() {
    let settings = Settings::<S> { iterations: 2, solver: Some(SolverKind::Pgs), ..Settings::default() };
    of_the_heap(settings, 240).1.within(1e-12, "two sweeps");
}

pub fn books_of_groups_close_with_events_and_loads<S: Dimension>() {
    for integrator in [Integrator::Trapezoid, Integrator::ImplicitMidpoint] {
        let (w, worst) = of_the_heap::<S>(Settings { integrator, ..events(1.0 / 120.0) }, 80);
        worst.within(1e-12, &format!("events, {integrator:?}"));
        assert!(w.ledger().impact_normal < 0.0 && w.ledger().friction < 0.0, "they collide and slide");
    }
}

/// A cap of one event sends every landing through the fallback.
pub fn books_of_groups_close_when_events_do_not_end<S: Dimension>() {
    let mut settings = events::<S>(0.02);
    settings.events.cap = Some(1);
    let (w, worst) = of_the_heap(settings, 60);
    worst.within(1e-12, "events, capped");
    assert!(w.ledger().fallback != 0.0, "a step is capped");
}

/// What leaves a block of 2 kg at 3 m/s is the floor's, exactly: momentum m v, angular momentum by the height of
/// the centre less that of the floor, and the work 1/2 m v^2.
pub fn a_block_that_slides_to_rest_gives_its_momentum_to_the_floor<S: Dimension>() {
    for scheme in SCHEMES {
        let mut w = world::<S>(Settings { scheme, ..exact(1.0 / 240.0) });
        add_floor(&mut w, 0.5, 0.0);
        let block = BodySpec::heavy(S::block(0.4, 0.2), 2.0).at(S::at(0.0, 0.1)).moving(S::at(3.0, 0.0));
        add(&mut w, "block", block.friction(0.5));
        divide(&mut w);
        settle(&mut w, 1.0);
        let all = &w.group_ledgers()[0];
        close(S::along(all.momentum.contact), -6.0, 1e-9, &format!("momentum to the floor, {scheme:?}"));
        close(S::up(all.momentum.gravity), -2.0 * G, 1e-9, "momentum from gravity in a second [kg m/s]");
        close(S::up(all.momentum.contact), 2.0 * G, 1e-9, "momentum from the floor in a second [kg m/s]");
        close(all.ledger.friction, -9.0, 1e-9, "work of friction [J]");
        // L about the origin was -z p = -.1 * 6 in the sense from along to up, and goes
        let given = S::rate(all.angular_momentum.contact) + S::rate(all.angular_momentum.gravity);
        close(given, 0.6, 1e-9, "angular momentum from floor and gravity [kg m^2/s]");
    }
}

/// Two equal balls, elastic: what the runner loses the other gains, on the impact lines of each.
pub fn a_blow_takes_from_one_group_what_it_gives_the_other<S: Dimension>() {
    for scheme in SCHEMES {
        let mut w = world::<S>(Settings { scheme, ..weightless(0.01) });
        for (name, along, speed) in [("runner", -0.3, 2.0), ("other", 0.0, 0.0)] {
            let ball = BodySpec::heavy(S::ball(0.1), 3.0).at(S::at(along, 1.0)).moving(S::at(speed, 0.0));
            add(&mut w, name, ball.restitution(1.0));
        }
        divide(&mut w);
        settle(&mut w, 0.2);
        let [all, runner, other] = w.group_ledgers() else { panic!("three groups") };
        close(runner.ledger.impact_normal, -6.0, 1e-9, &format!("energy of the runner, {scheme:?} [J]"));
        close(other.ledger.impact_normal, 6.0, 1e-9, "energy of the other [J]");
        close(S::along(runner.momentum.impact), -6.0, 1e-9, "momentum of the runner [kg m/s]");
        close(S::rate(other.angular_momentum.impact), -6.0, 1e-9, "angular momentum of the other");
        at_most(all.ledger.impact_normal.abs(), 1e-12, "energy of both [J]");
        at_most(all.momentum.impact.norm(), 1e-12, "momentum of both [kg m/s]");
        at_most(all.angular_momentum.impact.norm(), 1e-12, "angular momentum of both [kg m^2/s]");
    }
}

/// A thrown body in free flight: P changes by m g t, L about the origin by the moment of gravity, and by nothing else.
pub fn gravity_and_the_floor_share_a_thrown_block_s_momenta<S: Dimension>() {
    for scheme in SCHEMES {
        let mut w = world::<S>(Settings { scheme, ..exact(0.01) });
        let block = BodySpec::heavy(S::block(0.4, 0.2), 2.0).at(S::at(1.0, 50.0)).moving(S::at(3.0, 0.0));
        add(&mut w, "block", block.spinning(S::turn(4.0)));
        divide(&mut w);
        settle(&mut w, 2.0);
        let all = &w.group_ledgers()[0];
        close(S::up(all.momentum.gravity), -4.0 * G, 1e-11, &format!("m g t, {scheme:?} [kg m/s]"));
        // -integral of x m g: x = 1 + 3 t
        close(S::rate(all.angular_momentum.gravity), -2.0 * G * 8.0, 1e-10, "moment of gravity [kg m^2/s]");
        at_most(all.angular_momentum.integrator.norm(), 1e-11, "L of free motion [kg m^2/s]");
    }
}

pub fn books_change_no_bit_of_the_motion<S: Dimension>() {
    for scheme in SCHEMES {
        let moved = |kept: bool| {
            let mut w = heap::<S>(Settings { scheme, ..Settings::default() });
            if kept {
                divide(&mut w);
            }
            settle(&mut w, 0.4);
            let books = w.group_ledgers().len();
            (bits(&w), w.ledger().lines().map(f64::to_bits), books)
        };
        let (with, without) = (moved(true), moved(false));
        assert_eq!((&with.0, with.1), (&without.0, without.1), "{scheme:?}");
        assert_eq!((with.2, without.2), (3, 0));
    }
}

pub fn groups_that_make_no_sense_are_refused<S: Dimension>() {
    let mut w = heap::<S>(Settings::default());
    divide(&mut w);
    for (name, bodies, part) in [
        ("", vec!["body0"], "empty"),
        ("a", vec!["nobody"], "nobody"),
        ("a", vec!["floor"], "obstacle"),
        ("a", vec!["body1", "body1"], "twice"),
    ] {
        let bodies = Some(bodies.into_iter().map(String::from).collect());
        let refused = w.set_ledger_groups(vec![LedgerGroup { name: name.into(), bodies }]);
        let text = refused.expect_err("refused").to_string();
        assert!(text.contains(part), "{text}");
        assert_eq!(w.ledger_groups().len(), 3, "the old groups stay");
    }
    let twin = LedgerGroup { name: "a".into(), bodies: None };
    assert!(w.set_ledger_groups(vec![twin.clone(), twin]).is_err());
    // a body that goes leaves its group; a step that fails leaves the books
    w.remove("body0").expect("it is there");
    step(&mut w);
    let before = w.group_ledgers().to_vec();
    assert!(w.step(f64::NAN).is_err());
    assert_eq!(w.group_ledgers(), before);
}

/// Deepest overlap of the bodies where they are now \[m\]; touches of a step with events are from within it.
fn deepest<S: Dimension>(w: &World<S>) -> f64 {
    let b = w.bodies();
    let mut points = Vec::new();
    for i in 0..b.len() {
        for j in (i + 1..b.len()).filter(|&j| b.is_dynamic(i) || b.is_dynamic(j)) {
            let (Some(one), Some(other)) = (&b.data[i].collider, &b.data[j].collider) else { continue };
            S::contacts(one, &b.shape_pose(i), other, &b.shape_pose(j), 0.0, &mut points);
        }
    }
    points.iter().map(|p| -p.gap).fold(0.0, f64::max)
}

/// Case C31: what impacts, friction and free motion leave of P and L; what position correction does to L is its line.
fn isolated<S: Dimension>(mut w: World<S>, steps: usize, what: &str) {
    // closer, so that there are overlaps to correct
    for x in &mut w.motion_mut().position {
        *x = *x * 0.6;
    }
    divide(&mut w);
    let sizes = |w: &World<S>| {
        let b = w.bodies();
        let p: f64 = (0..b.len()).map(|i| b.momentum(i).norm()).sum();
        (p, (0..b.len()).map(|i| b.angular_momentum(i).norm()).sum::<f64>())
    };
    let (p, mut l) = sizes(&w);
    let (before, energy, mut worst, mut contacts) = (w.momenta(), w.energy().total(), Worst::default(), 0);
    for _ in 0..steps {
        let report = step(&mut w);
        worst.see(&w, &report.groups);
        contacts += report.contacts;
        l = l.max(sizes(&w).1);
    }
    assert!(contacts > 50, "{contacts} contacts");
    worst.within(1e-12, what);
    let (after, all) = (w.momenta(), &w.group_ledgers()[0]);
    at_most((after.linear - before.linear).norm() / p, 1e-13, &format!("C31 P, {what} [1]"));
    let corrected = all.angular_momentum.projection;
    let change = after.angular - before.angular - corrected;
    assert!(corrected.norm() > 0.0, "overlaps were corrected");
    at_most(change.norm() / l, 1e-13, &format!("C31 L but for the correction, {what} [1]"));
    at_most(all.angular_momentum.closure.norm() / l, 1e-13, &format!("C31 closure of L, {what} [1]"));
    at_most(all.ledger.closure.abs() / energy, 1e-12, &format!("C31 closure of energy, {what} [1]"));
    at_most(all.momentum.contact.norm() / p, 1e-13, &format!("C31 what contacts gave all, {what} [1]"));
    at_most(deepest(&w), 0.05, &format!("C31 deepest overlap, {what} [m]"));
}

pub fn isolated_bodies_keep_their_momenta_while_overlaps_are_corrected<S: Dimension>() {
    for position_correction in [PositionCorrection::Nudge, PositionCorrection::SplitImpulse] {
        let settings = Settings { dt: 2e-3, position_correction, ..Settings::default() };
        isolated(brawl::<S>(settings, 36), 500, &format!("{position_correction:?}"));
    }
    isolated(brawl::<S>(events(2e-3), 16), 500, "events");
}

#[test]
#[ignore = "a minute: 10,000 steps of 100 bodies"]
fn isolated_bodies_keep_their_momenta_for_ten_thousand_steps() {
    let settings = Settings { dt: 2e-4, ..Settings::default() };
    isolated(brawl::<Spatial>(settings, 100), 10_000, "10,000 steps");
    isolated(brawl::<Spatial>(events(2e-4), 100), 10_000, "10,000 steps with events");
}

/// The books of a run close in each step and over all of it, relative to the energy that there was.
fn books_of_a_run<S: Dimension>(w: &mut World<S>, steps: usize, what: &str) {
    divide(w);
    let (mut worst, mut energy) = (Worst::default(), 0.0_f64);
    for _ in 0..steps {
        let report = step(w);
        worst.see(w, &report.groups);
        energy = energy.max(report.energy.total().abs()).max(report.energy.kinetic());
    }
    worst.within(1e-12, what);
    for g in w.group_ledgers() {
        at_most(g.ledger.closure.abs() / energy, 1e-12, &format!("closure of {} over {what} [1]", g.name));
        let weight = w.settings().gravity.norm() * w.settings().dt * steps as f64;
        let b = w.bodies();
        let moment = |i: usize| b.motion.position[i].norm() * b.data[i].mass_properties.mass * weight;
        let moments: f64 = (0..b.len()).map(moment).sum();
        let (p, l) = (longest(&g.momentum), longest(&g.angular_momentum).max(moments));
        at_most(g.momentum.closure.norm() / p, 1e-12, &format!("closure of P of {} over {what} [1]", g.name));
        at_most(g.angular_momentum.closure.norm() / l, 1e-12, &format!("closure of L of {}", g.name));
    }
}

fn stack<S: Dimension>(scheme: Scheme, steps: usize) {
    let solver = (scheme == Scheme::FixedStep).then_some(SolverKind::Exact);
    let mut w = world::<S>(Settings { scheme, solver, ..exact(1.0 / 240.0) });
    add_floor(&mut w, 0.5, 0.0);
    for k in 0..10 {
        let block = BodySpec::heavy(S::block(0.4, 0.2), 1.0).at(S::at(0.0, 0.1 + 0.2 * f64::from(k)));
        add(&mut w, &format!("block{k}"), block.friction(0.5));
    }
    books_of_a_run(&mut w, steps, &format!("a stack, {scheme:?}, {steps} steps"));
    at_most(deepest(&w), 1e-5, &format!("deepest overlap of a stack, {scheme:?} [m]"));
    for k in 0..10 {
        let wanted = S::at(0.0, 0.1 + 0.2 * k as f64);
        let off = (w.bodies().motion.position[1 + k] - wanted).norm();
        at_most(off, 1e-9, &format!("block {k} off its place, {scheme:?} [m]"));
    }
    let even = &w.group_ledgers()[1];
    let time = steps as f64 / 240.0;
    close(S::up(even.momentum.gravity) / time, -5.0 * G, 1e-9, "weight of five blocks [N]");
    close(S::up(even.momentum.contact) / time, 5.0 * G, 1e-9, "what the others and the floor carry [N]");
}

pub fn a_stack_keeps_its_books_and_its_place<S: Dimension>() {
    SCHEMES.into_iter().for_each(|scheme| stack::<S>(scheme, 200));
}

#[test]
#[ignore = "minutes: 10,000 steps of ten blocks"]
fn a_stack_keeps_its_books_for_ten_thousand_steps() {
    SCHEMES.into_iter().for_each(|scheme| stack::<Spatial>(scheme, 10_000));
}

/// Bodies that fall into a trough of two walls and lie there; boxes come with spin.
fn pile<S: Dimension>(scheme: Scheme, boxes: bool, steps: usize) {
    let mut w = world::<S>(Settings { scheme, dt: 1.0 / 120.0, ..Settings::default() });
    add_floor(&mut w, 0.5, 0.0);
    for (name, side) in [("left", 1.0), ("right", -1.0)] {
        let wall = BodySpec::fixed(S::wall(S::at(side, 0.0))).at(S::at(-0.7 * side, 0.0));
        add(&mut w, name, wall.friction(0.5));
    }
    let mut dice = Dice(5);
    for k in 0..9 {
        let place = S::at(0.4 * f64::from(k % 3) - 0.4, 0.3 + 0.35 * f64::from(k / 3));
        let shape = if boxes || k % 2 == 0 { S::block(0.24, 0.16) } else { S::ball(0.11) };
        let spec = BodySpec::dense(shape, 900.0).at(place).turned(leaning::<S>(dice.between(-0.6, 0.6)));
        let spin = if boxes { S::Spin::from_fn(|_| dice.between(-4.0, 4.0)) } else { S::Spin::ZERO };
        add(&mut w, &format!("body{k}"), spec.spinning(spin).friction(0.5).restitution(0.2));
    }
    let name = if boxes { "tumbling boxes" } else { "a settling pile" };
    books_of_a_run(&mut w, steps, &format!("{name}, {scheme:?}, {steps} steps"));
    // what overlaps, and where it has come to
    let slack = if scheme == Scheme::Events { 1e-9 } else { 5e-3 };
    at_most(deepest(&w), slack, &format!("deepest overlap of {name}, {scheme:?} [m]"));
    let motion = &w.bodies().motion;
    let lowest = (3..12).map(|i| S::up(motion.position[i])).fold(f64::INFINITY, f64::min);
    assert!(lowest >= 0.08 - slack, "nothing is below the floor: {lowest} m");
    assert!((3..12).all(|i| S::along(motion.position[i]).abs() <= 0.7), "nothing is outside");
}

pub fn a_pile_that_settles_keeps_its_books<S: Dimension>() {
    SCHEMES.into_iter().for_each(|scheme| pile::<S>(scheme, false, 100));
}

pub fn boxes_that_tumble_keep_their_books<S: Dimension>() {
    SCHEMES.into_iter().for_each(|scheme| pile::<S>(scheme, true, 80));
}

#[test]
#[ignore = "minutes: 10,000 steps of nine bodies"]
fn piles_keep_their_books_for_ten_thousand_steps() {
    for scheme in SCHEMES {
        pile::<Spatial>(scheme, false, 10_000);
        pile::<Spatial>(scheme, true, 10_000);
    }
}

/// Case C32: 216 elastic balls that fall on a floor and through each other's ways keep their energy and never overlap.
fn elastic_balls(side: usize, steps: usize) {
    let mut w = carom_scenes::simbenchmark::cube(side, 1.101, 1.0, events(1e-3)).expect("the scene");
    w.set_ledger_groups(vec![LedgerGroup { name: "all".into(), bodies: None }]).expect("a group");
    let (first, mut worst, mut off, mut overlap) = (w.energy().total(), Worst::default(), 0.0_f64, 0.0_f64);
    let mut impacts = 0;
    for _ in 0..steps {
        let report = step(&mut w);
        worst.see(&w, &report.groups);
        impacts += report.events.impacts;
        off = off.max((report.energy.total() - first).abs() / first);
        let motion = &w.bodies().motion;
        let radius = carom_scenes::simbenchmark::RADIUS;
        overlap = overlap.max(carom_scenes::simbenchmark::squared_overlap(&motion.position[1..], radius));
    }
    worst.within(1e-12, "elastic balls");
    assert!(impacts > 10, "they collide: {impacts} impacts");
    at_most(off, 1e-12, &format!("C32 energy of {} balls over {steps} steps [1]", side.pow(3)));
    at_most(overlap, 1e-20, "C32 squared overlaps [m^2]");
    let all = &w.group_ledgers()[0];
    at_most(all.momentum.closure.norm() / longest(&all.momentum), 1e-12, "C32 closure of P [1]");
}

#[test]
fn a_small_cube_of_elastic_balls_keeps_energy_and_books() {
    elastic_balls(3, 1_200);
}

#[test]
#[ignore = "a minute: 10,000 steps of 216 balls"]
fn a_cube_of_elastic_balls_keeps_energy_and_books_for_ten_thousand_steps() {
    elastic_balls(6, 10_000);
}
