//! Impacts of several bodies at once under each law: cases C10 to C13 and C32, items 20 to 23 (theory chapter 4).
//! Outcomes are read as velocities after one weightless step, which the kick leaves alone.

use crate::harness::scenes::elastic_gas;
use crate::harness::*;
use carom::solver::delassus::delassus;
use carom::world::Phase;
use carom::{BodySpec, Column, ImpactLaw, Impulses, Settings, SolverKind, World};

in_plane_and_space!(
    bernoulli_s_three_balls_split_as_each_law_says,
    a_simultaneous_impact_keeps_mirror_symmetry,
    a_cradle_does_what_each_law_says,
    a_cradle_with_tiny_gaps_passes_the_blow_on_under_every_law,
    every_solver_finds_the_same_simultaneous_impact,
    separating_neighbours_do_not_make_energy,
    two_particles_exchange_by_their_masses,
    the_simultaneous_law_loses_what_its_formula_says,
    an_elastic_gas_on_a_line_keeps_its_speeds,
    an_elastic_gas_keeps_its_energy,
);

/// A weightless world in which touching balls of radius .1 and mass 1 meet elastically, without friction.
pub fn table<S: Dimension>(law: ImpactLaw, balls: &[(S::Vector, S::Vector)]) -> World<S> {
    let mut w = world::<S>(Settings { impact: Some(law), ..weightless(1e-3) });
    for (k, (place, velocity)) in balls.iter().enumerate() {
        let ball = BodySpec::heavy(S::ball(0.1), 1.0).at(*place).moving(*velocity);
        add(&mut w, &format!("ball {k}"), ball.friction(0.0).restitution(1.0));
    }
    w
}

/// Balls in a row along, touching or with gaps, with these speeds.
pub fn row<S: Dimension>(law: ImpactLaw, gap: f64, speeds: &[f64]) -> World<S> {
    let balls = speeds.iter().enumerate().map(|(k, v)| (S::at(k as f64 * (0.2 + gap), 0.0), S::at(*v, 0.0)));
    table(law, &balls.collect::<Vec<_>>())
}

pub fn speeds<S: Dimension>(w: &World<S>) -> Vec<f64> {
    w.bodies().motion.velocity.iter().map(|v| S::along(*v)).collect()
}

/// A cue ball at 1 m/s that touches two balls at +-30 degrees.
fn bernoulli<S: Dimension>(law: ImpactLaw) -> World<S> {
    let (c, s) = (0.2 * 0.75_f64.sqrt(), 0.1);
    let still = S::Vector::ZERO;
    let mut w = table::<S>(law, &[(still, S::at(1.0, 0.0)), (S::at(c, s), still), (S::at(c, -s), still)]);
    step(&mut w);
    w
}

/// Case C10. The sequential law takes the fastest approach, and of equal ones the first.
pub fn bernoulli_s_three_balls_split_as_each_law_says<S: Dimension>() {
    let r = 3.0_f64.sqrt();
    let cases = [
        (ImpactLaw::GeneralizedReflections, [(-0.2, 0.0), (0.6, r / 5.0), (0.6, -r / 5.0)]),
        (ImpactLaw::Newton, [(-0.2, 0.0), (0.6, r / 5.0), (0.6, -r / 5.0)]),
        (ImpactLaw::Moreau, [(-0.2, 0.0), (0.6, r / 5.0), (0.6, -r / 5.0)]),
        (ImpactLaw::Poisson, [(-0.2, 0.0), (0.6, r / 5.0), (0.6, -r / 5.0)]),
        (ImpactLaw::Sequential, [(-0.125, -r / 8.0), (0.75, r / 4.0), (0.375, -r / 8.0)]),
    ];
    for (law, wanted) in cases {
        let w = bernoulli::<S>(law);
        for (k, (along, up)) in wanted.iter().enumerate() {
            let v = w.bodies().motion.velocity[k];
            // solver tolerance 1e-12 m/s; the balls touch to rounding
            close(S::along(v), *along, 1e-11, &format!("C10 ball {k} along, {law:?} [m/s]"));
            close(S::up(v), *up, 1e-11, &format!("C10 ball {k} up, {law:?} [m/s]"));
        }
    }
}

/// Case C10, symmetry of the laws that solve contacts together.
pub fn a_simultaneous_impact_keeps_mirror_symmetry<S: Dimension>() {
    for law in ImpactLaw::ALL.into_iter().filter(|l| *l != ImpactLaw::Sequential) {
        let w = bernoulli::<S>(law);
        let v = &w.bodies().motion.velocity;
        close(S::along(v[1]) - S::along(v[2]), 0.0, 1e-12, &format!("C10 targets along, {law:?} [m/s]"));
        close(S::up(v[1]) + S::up(v[2]), 0.0, 1e-12, &format!("C10 targets across, {law:?} [m/s]"));
        close(S::up(v[0]), 0.0, 1e-12, &format!("C10 cue across, {law:?} [m/s]"));
    }
}

/// Case C11.
pub fn a_cradle_does_what_each_law_says<S: Dimension>() {
    let third = 1.0 / 3.0;
    let shared: [(&[f64], &[f64]); 4] = [
        (&[1.0, 0.0, 0.0], &[-third, 2.0 * third, 2.0 * third]),
        (&[1.0, 0.0, 0.0, 0.0], &[-0.5, 0.5, 0.5, 0.5]),
        (&[1.0, 0.0, 0.0, 0.0, 0.0], &[-0.6, 0.4, 0.4, 0.4, 0.4]),
        (&[1.0, 1.0, 0.0, 0.0, 0.0], &[-0.2, -0.2, 0.8, 0.8, 0.8]),
    ];
    let passed_on: [(&[f64], &[f64]); 4] = [
        (&[1.0, 0.0, 0.0], &[0.0, 0.0, 1.0]),
        (&[1.0, 0.0, 0.0, 0.0], &[0.0, 0.0, 0.0, 1.0]),
        (&[1.0, 0.0, 0.0, 0.0, 0.0], &[0.0, 0.0, 0.0, 0.0, 1.0]),
        (&[1.0, 1.0, 0.0, 0.0, 0.0], &[0.0, 0.0, 0.0, 1.0, 1.0]),
    ];
    for law in ImpactLaw::ALL {
        let passes_on = matches!(law, ImpactLaw::GeneralizedReflections | ImpactLaw::Sequential);
        let cases = if passes_on { passed_on } else { shared };
        for (before, after) in cases {
            let mut w = row::<S>(law, 0.0, before);
            step(&mut w);
            for (k, (got, wanted)) in speeds(&w).iter().zip(after).enumerate() {
                close(*got, *wanted, 1e-10, &format!("C11 {} balls, ball {k}, {law:?} [m/s]", after.len()));
            }
        }
    }
}

/// Case C11 with gaps of 1e-6 of a ball, which are none to the touch tolerance: a row of single collisions.
pub fn a_cradle_with_tiny_gaps_passes_the_blow_on_under_every_law<S: Dimension>() {
    for law in ImpactLaw::ALL {
        let mut w = row::<S>(law, 2e-7, &[1.0, 0.0, 0.0, 0.0, 0.0]);
        settle(&mut w, 0.01);
        for (k, (got, wanted)) in speeds(&w).iter().zip([0.0, 0.0, 0.0, 0.0, 1.0]).enumerate() {
            close(*got, wanted, 1e-12, &format!("C11 with gaps, ball {k}, {law:?} [m/s]"));
        }
    }
}

/// The impact law is one thing, the solver another: all agree that can solve this (direct refuses contacts that let go).
pub fn every_solver_finds_the_same_simultaneous_impact<S: Dimension>() {
    for solver in [SolverKind::Pgs, SolverKind::PgsMatrix, SolverKind::Lemke] {
        let mut w = row::<S>(ImpactLaw::Newton, 0.0, &[1.0, 0.0, 0.0, 0.0]);
        w.set_settings(Settings { solver: Some(solver), tolerance: 1e-11, ..w.settings().clone() })
            .expect("possible");
        step(&mut w);
        for (got, wanted) in speeds(&w).iter().zip([-0.5, 0.5, 0.5, 0.5]) {
            // three contacts amplify the residual by their condition, about 6
            close(*got, wanted, 1e-10, &format!("C11 by {} [m/s]", solver.name()));
        }
    }
}

/// Errata E34 and E35: three balls at (10, -1, 0), of which two separate already, end at (-1, 0, 10).
pub fn separating_neighbours_do_not_make_energy<S: Dimension>() {
    for law in [ImpactLaw::Newton, ImpactLaw::Sequential] {
        let mut w = row::<S>(law, 0.0, &[10.0, -1.0, 0.0]);
        let energy = w.energy().total();
        step(&mut w);
        for (got, wanted) in speeds(&w).iter().zip([-1.0, 0.0, 10.0]) {
            close(*got, wanted, 1e-11, &format!("E35 by {law:?} [m/s]"));
        }
        close(w.energy().total(), energy, 1e-11 * energy, &format!("E35 energy by {law:?} [J]"));
    }
}

/// Items 21 and 47: two particles, v' = v -+ (1 + e) m_eff u/m.
pub fn two_particles_exchange_by_their_masses<S: Dimension>() {
    let (ma, mb, restitution) = (2.0, 5.0, 0.4);
    let mut w = world::<S>(weightless(1e-3));
    let particle =
        |mass: f64| BodySpec::particle(Some(S::ball(0.1)), mass).friction(0.7).restitution(restitution);
    add(&mut w, "a", particle(ma).moving(S::at(3.0, 0.0)));
    add(&mut w, "b", particle(mb).at(S::at(0.2, 0.0)).moving(S::at(-1.0, 0.0)));
    step(&mut w);
    let impulse = (1.0 + restitution) * 4.0 / (1.0 / ma + 1.0 / mb);
    close(speed(&w, 0), 3.0 - impulse / ma, 1e-12, "item 21 particle a [m/s]");
    close(speed(&w, 1), -1.0 + impulse / mb, 1e-12, "item 21 particle b [m/s]");
}

/// Item 23 and theory eq. 4.22: with one common e, Delta T = -1/2 (1-e)/(1+e) gamma.A gamma, exactly.
pub fn the_simultaneous_law_loses_what_its_formula_says<S: Dimension>() {
    for restitution in [0.0, 0.3, 0.8] {
        let mut w = world::<S>(Settings { restitution_mixing: carom::Mixing::Min, ..weightless(1e-3) });
        // a block that lands flat on two blocks and a ball: coupled contacts, rotation included
        let body =
            |shape: S::Shape, mass: f64| BodySpec::heavy(shape, mass).friction(0.0).restitution(restitution);
        add(
            &mut w,
            "plank",
            body(S::block(1.0, 0.1), 3.0)
                .at(S::at(0.0, 0.05))
                .moving(S::at(0.0, -2.0))
                .spinning(S::turn(0.3)),
        );
        add(&mut w, "left", body(S::block(0.2, 0.2), 1.0).at(S::at(-0.35, -0.1)));
        add(&mut w, "right", body(S::ball(0.1), 2.0).at(S::at(0.3, -0.1)));
        let energy = w.energy().total();
        let problem = w.problem(1e-3, Phase::Impact).expect("possible");
        assert!(problem.contacts.len() >= 3, "all contacts strike at once");
        step(&mut w);
        assert_eq!(w.touches().len(), problem.contacts.len(), "every touch takes part");
        let impulses =
            Impulses::<S> { contacts: w.last_strikes().to_vec(), rows: Vec::new(), moments: Vec::new() };
        let gamma = impulses.flat();
        let product: f64 = delassus(&problem).times(&gamma).iter().zip(&gamma).map(|(a, g)| a * g).sum();
        let loss = -0.5 * (1.0 - restitution) / (1.0 + restitution) * product;
        // one round; the residual 1e-12 m/s times impulses of a few N s
        close(w.energy().total() - energy, loss, 1e-10, &format!("item 23 loss at e = {restitution} [J]"));
    }
}

/// Case C12: equal masses on a line between walls swap their speeds, so that the multiset of speeds is constant.
pub fn an_elastic_gas_on_a_line_keeps_its_speeds<S: Dimension>() {
    let mut w = world::<S>(Settings { impact: Some(ImpactLaw::Sequential), ..weightless(1e-3) });
    for (name, place, normal) in [("left", -0.5, 1.0), ("right", 14.5, -1.0)] {
        let wall = BodySpec::fixed(S::wall(S::at(normal, 0.0))).at(S::at(place, 0.0));
        add(&mut w, name, wall.friction(0.0).restitution(1.0));
    }
    let mut dice = Dice(12);
    for k in 0..50 {
        let ball = BodySpec::heavy(S::ball(0.1), 1.0).at(S::at(0.29 * k as f64, 0.0));
        let velocity = S::at(dice.between(-1.0, 1.0), 0.0);
        add(&mut w, &format!("ball {k}"), ball.moving(velocity).friction(0.0).restitution(1.0));
    }
    let sorted = |w: &World<S>| {
        let mut all: Vec<f64> = w.bodies().motion.velocity[2..].iter().map(|v| S::along(*v).abs()).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    let before = sorted(&w);
    let mut impacts = 0;
    run(&mut w, 10.0, |_, r| impacts += usize::from(r.impact_solve.is_some()));
    let worst = before.iter().zip(sorted(&w)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(impacts > 500, "there were {impacts} impacts");
    at_most(worst, 1e-12, "C12 change of the multiset of speeds over 10 s [m/s]");
}

/// Case C32: 216 elastic balls in a box, in space; 36 discs in the plane.
pub fn an_elastic_gas_keeps_its_energy<S: Dimension>() {
    for law in ImpactLaw::ALL {
        let mut w = elastic_gas::<S>(Settings { impact: Some(law), ..weightless(2e-3) });
        let energy = w.energy().total();
        let (mut deepest, mut impacts) = (0.0_f64, 0);
        run(&mut w, 2.0, |_, r| {
            deepest = deepest.min(r.deepest.map_or(0.0, |d| d.0));
            impacts += r.impact_solve.as_ref().map_or(0, |s| s.contacts);
        });
        assert!(impacts > 100, "there were {impacts} contacts in impacts");
        // common e = 1: every law loses nothing; the residual 1e-12 m/s per solve
        close(w.energy().total() / energy, 1.0, 1e-12, &format!("C32 energy, {law:?}, {impacts} contacts"));
        // a ball struck within the step can overrun another by h |u| before it is seen
        at_most(-deepest, 2e-3 * 12.0, &format!("C32 overlap, {law:?} [m]"));
    }
}

/// Case C13: three equal particles in a row, the middle one going to and fro. Above e = 7 - 4 sqrt 3 the collisions
/// end; below it they may never end, and the relative velocities die out instead (theory eq. 4.27).
#[test]
fn three_inelastic_balls_collapse_below_the_critical_restitution() {
    let critical = 7.0 - 4.0 * 3.0_f64.sqrt();
    // relative velocities (u1, u2) of the two contacts after alternating collisions, counted to 10,000
    let collisions = |e: f64, start: [f64; 3]| {
        let mut w = row::<carom::Planar>(ImpactLaw::Sequential, 0.0, &start);
        let settings = Settings { restitution_mixing: carom::Mixing::Min, ..w.settings().clone() };
        w.set_settings(settings).expect("possible");
        for k in 0..3 {
            w.bodies_mut().data[k].restitution = e;
        }
        let report = step(&mut w);
        let v = speeds(&w);
        (report.impact_solve.expect("they meet").iterations, v[1] - v[0], v[2] - v[1])
    };
    let starts =
        (0..200).map(|k| [1.0, -1.0 + 0.01 * f64::from(k), -1.0]).filter(|v| v[0] > v[1] || v[1] > v[2]);
    let (mut most, mut trapped) = (0, 0);
    for start in starts {
        let (count, left, right) = collisions(critical + 0.02, start);
        most = most.max(count);
        assert!(
            left > 1e-6 && right > 1e-6,
            "above the critical e they part: {left:e}, {right:e} from {start:?}"
        );
        let (_, left, right) = collisions(critical - 0.02, start);
        trapped += usize::from(left.abs() < 1e-9 && right.abs() < 1e-9);
    }
    println!(
        "measured: C13 most collisions above the critical e: {most}; trapped below it: {trapped} of 200"
    );
    assert!(most < 60, "above the critical e there were {most} collisions");
    assert!(trapped > 0, "below the critical e some never part");
}
