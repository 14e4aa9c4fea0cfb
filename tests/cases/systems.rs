//! Many bodies: cases C31 to C33.

use crate::cases::{events, without_weight};
use crate::harness::scenes::elastic_gas;
use crate::harness::*;
use carom::{BodySpec, Column, World};

in_plane_and_space!(
    bodies_that_collide_with_friction_keep_their_momenta,
    an_elastic_gas_keeps_its_energy_and_never_overlaps,
    the_same_scene_gives_the_same_bits_on_any_number_of_threads,
    the_order_of_bodies_changes_no_wrench,
);

/// A hundred bodies that run together with spin, friction and unlike masses, and nothing else in the world; balls, or
/// balls and blocks in turn.
fn brawl<S: Dimension>(dt: f64, blocks: bool, overlap: f64) -> World<S> {
    let mut settings = without_weight::<S>(dt);
    settings.events.overlap = overlap;
    let mut w = world(settings);
    let mut dice = Dice(31);
    for k in 0..100 {
        let place = S::at(0.3 * (k % 10) as f64, 0.3 * (k / 10) as f64);
        let shape = if blocks && k % 2 == 0 { S::block(0.2, 0.16) } else { S::ball(0.1) };
        let spin = S::Spin::from_fn(|_| dice.between(-4.0, 4.0));
        let velocity = (S::at(1.5, 1.5) - place) * 1.0 + S::Vector::from_fn(|_| dice.between(-1.0, 1.0));
        let spec = BodySpec::heavy(shape, dice.between(0.5, 2.0)).at(place).moving(velocity).spinning(spin);
        add(&mut w, &format!("body {k}"), spec.friction(0.5).restitution(if k % 3 == 0 { 0.5 } else { 0.0 }));
    }
    w
}

/// What a brawl loses.
struct Leaks {
    /// Change of P over the sum of the bodies' own \[1\].
    of_p: f64,
    /// Change of L over the sum of the bodies' own \[1\].
    of_l: f64,
    arrivals: usize,
    projections: usize,
}

fn leaks<S: Dimension>(mut w: World<S>, time: f64, mut tell: impl FnMut(f64)) -> Leaks {
    let own = |w: &World<S>| {
        let b = w.bodies();
        let p: f64 = (0..b.len()).map(|i| b.momentum(i).norm()).sum();
        (p, (0..b.len()).map(|i| b.angular_momentum(i).norm()).sum::<f64>())
    };
    let ((p, mut l), before) = (own(&w), w.momenta());
    let (mut arrivals, mut projections) = (0, 0);
    run(&mut w, time, |w, r| {
        arrivals += r.events.arrivals;
        projections += r.events.projections;
        // bodies that fly apart have larger moments of momentum, and so larger rounding
        l = l.max(own(w).1);
        tell(w.time());
    });
    let after = w.momenta();
    let (of_p, of_l) =
        ((after.linear - before.linear).norm() / p, (after.angular - before.angular).norm() / l);
    Leaks { of_p, of_l, arrivals, projections }
}

/// Case C31 for a time, in steps of 2e-4 s. Between balls nothing is projected. Where corners turn on faces overlaps are,
/// and that displaces angular momentum, though no momentum: without it L stays too.
pub fn momenta_stay<S: Dimension>(time: f64, mut tell: impl FnMut(f64)) {
    for (what, blocks, overlap) in [
        ("balls", false, 1e-9),
        ("balls and blocks", true, 1e-9),
        ("balls and blocks, no projection", true, 1.0),
    ] {
        let found = leaks(brawl::<S>(2e-4, blocks, overlap), time, &mut tell);
        println!("measured: C31 {what}: {} arrivals, {} projections", found.arrivals, found.projections);
        assert!(found.arrivals > 10, "they collide: {} times", found.arrivals);
        at_most(found.of_p, 1e-13, &format!("C31 P lost, {what} [1]"));
        if found.projections == 0 {
            at_most(found.of_l, 1e-13, &format!("C31 L lost, {what} [1]"));
        } else {
            println!("measured: C31 L displaced by {} projections: {:.1e}", found.projections, found.of_l);
        }
        assert!(blocks && overlap < 1.0 || found.projections == 0, "{what} need no projection");
    }
}

/// Case C31 for a fifth of a second; 10,000 steps in `make laws`.
pub fn bodies_that_collide_with_friction_keep_their_momenta<S: Dimension>() {
    momenta_stay::<S>(0.2, |_| ());
}

/// Case C32: 216 elastic balls in a box, in space; 36 discs in the plane.
pub fn an_elastic_gas_keeps_its_energy_and_never_overlaps<S: Dimension>() {
    let mut w = elastic_gas::<S>(without_weight(0.01));
    let energy = w.energy().total();
    let (mut deepest, mut arrivals) = (0.0_f64, 0);
    run(&mut w, 2.0, |_, r| {
        deepest = deepest.min(r.deepest.map_or(0.0, |d| d.0)).min(-r.events.deepest);
        arrivals += r.events.arrivals;
        assert_eq!(r.events.capped, 0, "no step is capped");
    });
    assert!(arrivals > 100, "they collide: {arrivals} times");
    close(w.energy().total() / energy, 1.0, 1e-12, &format!("C32 energy after {arrivals} collisions [1]"));
    at_most(-deepest, 1e-9, "C32 overlap [m]");
}

/// Falling, colliding, sliding bodies.
fn heap<S: Dimension>() -> World<S> {
    let mut w = world::<S>(events(0.01));
    add_floor(&mut w, 0.5, 0.3);
    let mut dice = Dice(11);
    for k in 0..8 {
        let place = S::at(dice.between(-0.5, 0.5), 0.4 + 0.35 * f64::from(k));
        let spec = if k % 2 == 0 {
            BodySpec::dense(S::ball(0.15), 800.0).restitution(0.4)
        } else {
            BodySpec::dense(S::block(0.3, 0.2), 900.0).turned(leaning::<S>(dice.between(-1.0, 1.0)))
        };
        add(
            &mut w,
            &format!("body {k}"),
            spec.at(place).spinning(S::turn(dice.between(-3.0, 3.0))).friction(0.4),
        );
    }
    w
}

/// Case C33: one world alone, two at a time and eight at a time go alike to the last bit.
pub fn the_same_scene_gives_the_same_bits_on_any_number_of_threads<S: Dimension>() {
    let go = || {
        let mut w = heap::<S>();
        settle(&mut w, 0.7);
        bits(&w)
    };
    let alone = go();
    for threads in [1, 2, 8] {
        let all: Vec<Vec<u64>> = std::thread::scope(|scope| {
            let running: Vec<_> = (0..threads).map(|_| scope.spawn(go)).collect();
            running.into_iter().map(|one| one.join().expect("a thread")).collect()
        });
        assert!(all.iter().all(|bits| *bits == alone), "{threads} threads change bits");
    }
}

/// Case C33: bodies added in another order, so contacts in another order: what they exert on each other stays.
pub fn the_order_of_bodies_changes_no_wrench<S: Dimension>() {
    let forces = [[0, 1, 2], [2, 1, 0], [1, 2, 0]].map(|order| {
        let mut w = world::<S>(events(0.01));
        add_floor(&mut w, 0.5, 0.0);
        for k in order {
            let mass = [1.0, 1.0, 1e3][k];
            let block = BodySpec::heavy(S::block(1.0, 1.0), mass).at(S::at(0.0, 0.5 + k as f64));
            add(&mut w, &format!("box {k}"), block.friction(0.5));
        }
        settle(&mut w, 0.1);
        let index = |name: &str| w.index(name).expect("added");
        [("floor", "box 0"), ("box 0", "box 1"), ("box 1", "box 2")]
            .map(|(a, b)| normal_force(&w, index(a), index(b)))
    });
    for (k, other) in forces.iter().enumerate().skip(1) {
        for (got, wanted) in other.iter().zip(forces[0]) {
            at_most((got - wanted).abs() / wanted, 1e-10, &format!("C33 change of a wrench, order {k} [1]"));
        }
    }
}
