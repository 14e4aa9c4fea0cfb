//! Where every joule goes, and that momentum goes nowhere: closure of the ledger for every integrator, law and
//! correction; signs of its lines; case C31 (theory section 6.3). Closure is an identity, so it is tried where
//! solves fail, too; that the motion is right is other files' matter.

use crate::harness::*;
use crate::laws::determinism::heap;
use carom::{
    BodySpec, Column, FrictionLaw, ImpactLaw, Integrator, Mixing, Motion, PositionCorrection, Settings,
    SolverKind, StepReport, World, Wrench,
};

in_plane_and_space!(
    the_ledger_closes_for_every_integrator_and_correction,
    the_ledger_closes_for_every_law_and_solver,
    the_ledger_closes_when_solves_are_cut_short,
    each_line_of_a_simple_run_is_what_it_says,
    friction_and_impacts_only_take_energy,
    persistent_contacts_do_no_normal_work_on_flat_ground,
    impacts_with_unlike_restitution_do_not_make_energy,
    an_isolated_system_keeps_its_momenta,
    an_isolated_system_keeps_its_momentum_while_overlaps_are_corrected,
    ten_thousand_steps_of_collisions_leave_the_momenta,
    a_split_impulse_leaves_no_velocity_behind,
    a_nudge_halves_an_overlap_each_time,
    the_driven_line_is_the_work_of_the_belt,
    a_spring_field_has_its_work_on_the_applied_line,
);

/// A field that depends on place, velocity and time.
fn weather<S: Dimension>() -> Box<dyn carom::ForceField<S>> {
    Box::new(|time: f64, m: &Motion<S>, out: &mut [Wrench<S>]| {
        for (i, w) in out.iter_mut().enumerate() {
            w.force += m.position[i] * -2.0 - m.velocity[i] * 0.3 + S::at((3.0 * time).sin(), 0.0);
            w.torque += m.angular_velocity[i] * -0.01;
        }
    })
}

/// Runs the heap of all trades for a second and returns the worst closure error relative to the largest line that
/// its step moved, or to the energy's own rounding.
fn worst_closure<S: Dimension>(settings: Settings<S>) -> f64 {
    let mut w = heap::<S>(settings);
    w.set_force_field("weather", weather());
    let mut worst: f64 = 0.0;
    for k in 0..240 {
        if k % 7 == 0 {
            w.apply_wrench(2 + k % 12, Wrench { force: S::at(40.0, -20.0), torque: S::turn(1.5) });
        }
        let r = step(&mut w);
        let scale = largest_line(&r.ledger).max(r.energy.kinetic()).max(r.energy.potential.abs());
        worst = worst.max(r.ledger.closure.abs() / scale);
    }
    worst
}

pub fn the_ledger_closes_for_every_integrator_and_correction<S: Dimension>() {
    for integrator in Integrator::ALL {
        for position_correction in
            [PositionCorrection::None, PositionCorrection::Nudge, PositionCorrection::SplitImpulse]
        {
            let worst =
                worst_closure(Settings::<S> { integrator, position_correction, ..Settings::default() });
            // rounding of sums of a few hundred terms
            at_most(worst, 1e-12, &format!("closure, {integrator:?}, {position_correction:?} [1]"));
        }
    }
}

pub fn the_ledger_closes_for_every_law_and_solver<S: Dimension>() {
    for impact in ImpactLaw::ALL {
        for friction_law in [FrictionLaw::Disc, FrictionLaw::Box] {
            for solver in [SolverKind::Sequential, SolverKind::Pgs, SolverKind::PgsMatrix] {
                let worst = worst_closure(Settings::<S> {
                    impact: Some(impact),
                    friction_law,
                    solver: Some(solver),
                    ..Settings::default()
                });
                at_most(
                    worst,
                    1e-12,
                    &format!("closure, {impact:?}, {friction_law:?}, {} [1]", solver.name()),
                );
            }
        }
    }
}

pub fn the_ledger_closes_when_solves_are_cut_short<S: Dimension>() {
    for iterations in [1, 3] {
        for integrator in Integrator::ALL {
            let worst = worst_closure(Settings::<S> { iterations, integrator, ..Settings::default() });
            at_most(worst, 1e-12, &format!("closure after {iterations} sweeps, {integrator:?} [1]"));
        }
    }
}

/// A block thrown along the floor: gravity does nothing, friction takes everything.
pub fn each_line_of_a_simple_run_is_what_it_says<S: Dimension>() {
    let mut w = world::<S>(exact(1.0 / 240.0));
    add_floor(&mut w, 0.5, 0.0);
    let block = BodySpec::heavy(S::block(0.4, 0.2), 2.0).at(S::at(0.0, 0.1)).moving(S::at(3.0, 0.0));
    add(&mut w, "block", block);
    settle(&mut w, 1.0);
    let l = *w.ledger();
    close(l.friction, -9.0, 1e-9, "friction [J]");
    for (name, line) in carom::Ledger::NAMES.iter().zip(l.lines()) {
        if *name != "friction" {
            at_most(line.abs(), 1e-9, &format!("{name} of a block that slides to rest [J]"));
        }
    }
}

/// Theory section 6.3, what is healthy: friction and impacts take energy, position correction of a heap that falls
/// without overlap hardly gives any.
pub fn friction_and_impacts_only_take_energy<S: Dimension>() {
    for impact in ImpactLaw::ALL {
        let mut w = heap::<S>(Settings { impact: Some(impact), ..exact(1.0 / 240.0) });
        let whole = w.energy().total();
        let check = |r: &StepReport<S>| {
            let l = r.ledger;
            let impacts = l.impact_normal + l.impact_friction + l.rest_cut;
            assert!(impacts <= 1e-9 * whole, "impacts gave {impacts} J at t = {}", r.time);
            let contacts = l.contact_normal + l.friction;
            // a slip that loads reverse within a step: m mu g h times g h at most, per body
            assert!(contacts <= 1e-5 * whole, "contacts gave {contacts} J at t = {}", r.time);
        };
        run(&mut w, 3.0, |_, r| check(r));
        let l = *w.ledger();
        assert!(l.friction < 0.0 && l.impact_normal < 0.0 && l.rest_cut <= 0.0 && l.damping < 0.0);
        at_most(
            l.projection.abs() / whole,
            1e-2,
            &format!("position correction's share of the energy, {impact:?} [1]"),
        );
    }
}

/// Theory eq. 6.10: closed contacts on flat ground do no normal work.
pub fn persistent_contacts_do_no_normal_work_on_flat_ground<S: Dimension>() {
    let mut w = world::<S>(exact(1.0 / 240.0));
    add_floor(&mut w, 0.3, 0.0);
    for k in 0..4 {
        let block = BodySpec::heavy(S::block(0.4, 0.2), 1.0).at(S::at(0.0, 0.1 + 0.2 * f64::from(k)));
        add(&mut w, &format!("block{k}"), block.moving(S::at(0.5 * f64::from(k), 0.0)).friction(0.3));
    }
    let energy = w.energy().kinetic();
    settle(&mut w, 0.1);
    at_most(w.ledger().contact_normal.abs() / energy, 1e-10, "normal work of a sliding stack [1]");
}

/// Item 24's trap: bodies of unlike restitution and friction in one heap of impacts.
pub fn impacts_with_unlike_restitution_do_not_make_energy<S: Dimension>() {
    for impact in ImpactLaw::ALL {
        let settings = Settings {
            impact: Some(impact),
            restitution_mixing: Mixing::Max,
            friction_mixing: Mixing::Max,
            ..exact(2e-3)
        };
        let mut w = world::<S>(Settings { gravity: S::Vector::ZERO, ..settings });
        let mut dice = Dice(99);
        for k in 0..25 {
            let place = S::at(0.25 * f64::from(k % 5), 0.25 * f64::from(k / 5));
            let shape = if k % 2 == 0 { S::block(0.2, 0.14) } else { S::ball(0.1) };
            let spec = BodySpec::heavy(shape, dice.between(0.1, 5.0))
                .at(place)
                .turned(leaning::<S>(dice.between(-1.0, 1.0)));
            // towards the middle
            let spec =
                spec.moving((S::at(0.5, 0.5) - place) * 3.0).spinning(S::turn(dice.between(-9.0, 9.0)));
            add(&mut w, &format!("body{k}"), spec.friction(dice.between(0.0, 1.0)).restitution(dice.roll()));
        }
        let whole = w.energy().total();
        let mut last = whole;
        run(&mut w, 1.0, |_, r| {
            let now = r.energy.total();
            // turning a body out of an overlap changes its energy at constant momentum: another line
            let rise = now - last - r.ledger.projection - r.ledger.integrator;
            // stick on a contact that turns holds at the step's end, not on its mean: theory 6.5
            assert!(rise <= 1e-6 * whole, "energy rose by {rise} J at t = {}, {impact:?}", r.time);
            let l = r.ledger;
            let impacts = l.impact_normal + l.impact_friction + l.rest_cut;
            assert!(impacts <= 1e-9 * whole, "impacts gave {impacts} J at t = {}, {impact:?}", r.time);
            last = now;
        });
        assert!(last < 0.9 * whole, "they collided");
    }
}

/// Bodies that collide with spin, friction and unlike masses, and nothing else in the world.
pub fn brawl<S: Dimension>(settings: Settings<S>, bodies: usize) -> World<S> {
    let mut w = world::<S>(Settings { gravity: S::Vector::ZERO, ..settings });
    let mut dice = Dice(31);
    let side = (bodies as f64).sqrt().ceil() as usize;
    for k in 0..bodies {
        let place = S::at(0.3 * (k % side) as f64, 0.3 * (k / side) as f64);
        let shape = if k % 2 == 0 { S::block(0.2, 0.16) } else { S::ball(0.1) };
        let spin = S::Spin::from_fn(|_| dice.between(-4.0, 4.0));
        let middle = S::at(0.15 * side as f64, 0.15 * side as f64);
        let velocity = (middle - place) * 1.0 + S::Vector::from_fn(|_| dice.between(-1.0, 1.0));
        let spec = BodySpec::heavy(shape, dice.between(0.5, 2.0)).at(place).moving(velocity).spinning(spin);
        add(&mut w, &format!("body{k}"), spec.friction(0.5).restitution(if k % 3 == 0 { 0.5 } else { 0.0 }));
    }
    w
}

/// Largest change of P and L within a step, relative to the sum of the bodies' own.
fn leaks<S: Dimension>(w: &mut World<S>, time: f64) -> (f64, f64) {
    let m = &w.bodies();
    let (mut p, mut l) = (0.0, 0.0);
    for i in 0..m.len() {
        p += m.momentum(i).norm();
        l += m.angular_momentum(i).norm();
    }
    let (mut of_p, mut of_l): (f64, f64) = (0.0, 0.0);
    let mut before = w.momenta();
    run(w, time, |_, r| {
        of_p = of_p.max((r.momenta.linear - before.linear).norm() / p);
        of_l = of_l.max((r.momenta.angular - before.angular).norm() / l);
        before = r.momenta;
    });
    (of_p, of_l)
}

/// Per step, for every integrator that keeps L, every impact law, exact solves or not.
pub fn an_isolated_system_keeps_its_momenta<S: Dimension>() {
    for integrator in Integrator::ALL {
        for (impact, iterations) in
            [(ImpactLaw::Newton, 100), (ImpactLaw::Newton, 2), (ImpactLaw::Sequential, 100)]
        {
            let position_correction = PositionCorrection::None;
            let dt = 1.0 / 240.0;
            let settings = Settings {
                dt,
                integrator,
                impact: Some(impact),
                iterations,
                position_correction,
                ..Settings::default()
            };
            let mut w = brawl::<S>(settings, 16);
            let (of_p, of_l) = leaks(&mut w, 1.0);
            let what = format!("{integrator:?}, {impact:?}, {iterations} sweeps [1]");
            at_most(of_p, 1e-14, &format!("P lost in a step, {what}"));
            // the notes' Euler step does not keep the L of a tumbling body; the plane's bodies do not tumble
            if integrator != Integrator::ExplicitEuler {
                at_most(of_l, 1e-14, &format!("L lost in a step, {what}"));
            }
        }
    }
}

/// Case C31 with position correction: P is kept; L changes with the displacements (theory eq. 6.18).
pub fn an_isolated_system_keeps_its_momentum_while_overlaps_are_corrected<S: Dimension>() {
    for position_correction in [PositionCorrection::Nudge, PositionCorrection::SplitImpulse] {
        let mut w = brawl::<S>(Settings { position_correction, ..Settings::default() }, 16);
        // put everything closer, so that there are overlaps
        for x in &mut w.motion_mut().position {
            *x = *x * 0.6;
        }
        let (of_p, _) = leaks(&mut w, 1.0);
        at_most(of_p, 1e-14, &format!("C31 P lost in a step, {position_correction:?} [1]"));
        let centre = |w: &World<S>| {
            let b = w.bodies();
            (0..b.len())
                .fold(S::Vector::ZERO, |sum, i| sum + b.motion.position[i] * b.data[i].mass_properties.mass)
        };
        let (before, time) = (centre(&w), w.time());
        settle(&mut w, 1.0);
        let moved = centre(&w) - before - w.momenta().linear * (w.time() - time);
        at_most(moved.norm(), 1e-12, "C31 centre of mass moved by corrections [kg m]");
    }
}

/// Case C31: 100 bodies, friction and contacts, no gravity, 10,000 steps. They are short, so that the bodies stay
/// near: each sum x + h v is rounded at the size of x, and that, not the collisions, is what L would show.
pub fn ten_thousand_steps_of_collisions_leave_the_momenta<S: Dimension>() {
    let settings =
        Settings { position_correction: PositionCorrection::None, dt: 2e-4, ..Settings::default() };
    let mut w = brawl::<S>(settings, 100);
    let bodies = w.bodies();
    let (mut p, mut l) = (0.0, 0.0);
    for i in 0..bodies.len() {
        p += bodies.momentum(i).norm();
        l += bodies.angular_momentum(i).norm();
    }
    let before = w.momenta();
    let mut contacts = 0;
    run(&mut w, 2.0, |w, r| {
        contacts += r.contacts;
        // bodies that fly apart have larger moments of momentum, and so larger rounding
        l = l.max((0..w.bodies().len()).map(|i| w.bodies().angular_momentum(i).norm()).sum());
    });
    let after = w.momenta();
    assert!(contacts > 10_000, "there were {contacts} contacts");
    at_most((after.linear - before.linear).norm() / p, 1e-13, "C31 P after 10,000 steps [1]");
    at_most((after.angular - before.angular).norm() / l, 1e-13, "C31 L after 10,000 steps [1]");
}

/// Two balls that overlap by .04 in empty space.
fn overlapping<S: Dimension>(position_correction: PositionCorrection, correction_fraction: f64) -> World<S> {
    let correction_slop = Some(0.0);
    let settings = Settings { position_correction, correction_fraction, correction_slop, ..weightless(0.01) };
    let mut w = world::<S>(settings);
    add(&mut w, "light", BodySpec::heavy(S::ball(0.1), 1.0));
    add(&mut w, "heavy", BodySpec::heavy(S::ball(0.1), 3.0).at(S::at(0.16, 0.0)));
    w
}

fn depth<S: Dimension>(w: &World<S>) -> f64 {
    let m = &w.bodies().motion;
    0.2 - (m.position[1] - m.position[0]).norm()
}

/// Item 26 and theory eq. 6.17: the overlap goes, no kinetic energy stays.
pub fn a_split_impulse_leaves_no_velocity_behind<S: Dimension>() {
    let mut w = overlapping::<S>(PositionCorrection::SplitImpulse, 0.25);
    for k in 1..=20 {
        step(&mut w);
        close(depth(&w), 0.04 * 0.75_f64.powi(k), 1e-12, "item 26 overlap after k corrections [m]");
    }
    assert_eq!(w.energy().kinetic(), 0.0);
    let m = &w.bodies().motion;
    close(
        S::along(m.position[0]) + 3.0 * S::along(m.position[1]),
        3.0 * 0.16,
        1e-14,
        "item 26 centre of mass [kg m]",
    );
}

/// Item 26 and theory eq. 4.18: the notes' nudge.
pub fn a_nudge_halves_an_overlap_each_time<S: Dimension>() {
    let mut w = overlapping::<S>(PositionCorrection::Nudge, 0.5);
    for k in 1..=20 {
        step(&mut w);
        close(depth(&w), 0.04 * 0.5_f64.powi(k), 1e-14, "item 26 overlap after k nudges [m]");
    }
    let m = &w.bodies().motion;
    close(
        S::along(m.position[0]) + 3.0 * S::along(m.position[1]),
        3.0 * 0.16,
        1e-14,
        "item 26 centre of mass [kg m]",
    );
}

/// A belt accelerates a block: it pays the kinetic energy and the heat, 1/2 m v^2 each.
pub fn the_driven_line_is_the_work_of_the_belt<S: Dimension>() {
    let mut w = world::<S>(exact(1.0 / 240.0));
    add(&mut w, "belt", BodySpec::kinematic(S::floor()).moving(S::at(2.0, 0.0)).friction(0.4));
    add(&mut w, "block", BodySpec::heavy(S::block(0.4, 0.2), 3.0).at(S::at(0.0, 0.1)).friction(0.4));
    settle(&mut w, 1.0);
    let l = *w.ledger();
    close(l.friction, -0.5 * 3.0 * 4.0, 1e-9, "heat on the belt [J]");
    close(l.driven, 3.0 * 4.0, 1e-9, "work of the belt [J]");
}

/// A spring as a field: what it took is on the applied line, to the order of the integrator.
pub fn a_spring_field_has_its_work_on_the_applied_line<S: Dimension>() {
    let stiffness = 25.0;
    for (integrator, tolerance) in [
        (Integrator::Trapezoid, 1e-12), // leapfrog's work is summed as it is done: closure
        (Integrator::ImplicitMidpoint, 1e-12),
        (Integrator::Rk4, 1e-12),
    ] {
        let mut w = world::<S>(Settings { integrator, ..weightless(0.01) });
        add(&mut w, "bob", body_of::<S>(None, 1.0, 1.0).at(S::at(1.0, 0.0)));
        let spring =
            move |_: f64, m: &Motion<S>, out: &mut [Wrench<S>]| out[0].force += m.position[0] * -stiffness;
        w.set_force_field("spring", Box::new(spring));
        settle(&mut w, 1.0);
        let (l, kinetic) = (*w.ledger(), w.energy().kinetic());
        close(
            l.applied + l.integrator,
            kinetic,
            tolerance,
            &format!("energy from the spring, {integrator:?} [J]"),
        );
        // and the motion is the cosine, to order 2 or 4 in h w = .05
        let wanted = (stiffness.sqrt() * w.time()).cos();
        let order = if integrator == Integrator::Rk4 { 4 } else { 2 };
        close(
            S::along(w.bodies().motion.position[0]),
            wanted,
            5.0 * 0.05_f64.powi(order),
            "place of the bob [m]",
        );
    }
}
