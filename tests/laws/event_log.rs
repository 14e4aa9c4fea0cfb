//! The log of a step of the scheme `events`: what it tells is all that happened, and nothing that was taken back
//! (theory section 8.4). From a body's velocity before a step and the log follows its velocity after it; pieces of its
//! way fill the step; sums of contacts are sums of the log.

use crate::harness::*;
use carom::{BodySpec, Column, EventKind, EventLog, PieceKind, Scheme, Settings, World};

in_plane_and_space!(
    velocities_follow_from_the_log_alone,
    ways_fill_the_step_and_impacts_take_no_time,
    a_bounce_is_one_impact_at_its_moment,
    a_slide_that_ends_within_a_step_is_two_flows,
    contacts_are_sums_over_the_step,
    steps_of_a_fixed_length_have_no_log,
    the_log_is_the_same_twice,
);

/// Balls and blocks that fall on each other and on the floor, bounce, slide and roll.
fn shower<S: Dimension>() -> World<S> {
    let mut w = world::<S>(Settings { dt: 0.05, scheme: Scheme::Events, ..Settings::default() });
    add_floor(&mut w, 0.4, 0.3);
    for k in 0..5 {
        let shape = if k == 3 { S::block(0.24, 0.18) } else { S::ball(0.1) };
        let place = S::at(0.05 * f64::from(k), 0.15 + 0.27 * f64::from(k));
        let body = BodySpec::heavy(shape, 1.0 + f64::from(k)).at(place).moving(S::at(0.4, 0.0));
        add(&mut w, &format!("body{k}"), body.friction(0.3).restitution(0.3));
    }
    w
}

fn log<S: Dimension>(w: &World<S>) -> &EventLog<S> {
    w.last_events().expect("the scheme keeps a log")
}

pub fn velocities_follow_from_the_log_alone<S: Dimension>() {
    let mut w = shower::<S>();
    let (mut worst, mut records): (f64, usize) = (0.0, 0);
    for _ in 0..16 {
        let before = w.bodies().motion.velocity.clone();
        step(&mut w);
        records += log(&w).contacts.len();
        for (i, v) in before.iter().enumerate().skip(1) {
            let mut momentum = (*v + S::at(0.0, -G) * 0.05) * w.bodies().data[i].mass_properties.mass;
            for r in &log(&w).contacts {
                if r.a == i {
                    momentum += r.impulse;
                }
                if r.b == i {
                    momentum -= r.impulse;
                }
            }
            worst = worst.max((w.bodies().momentum(i) - momentum).norm());
        }
    }
    assert!(records > 30, "{records} records");
    at_most(worst, 1e-13, "momentum that the log does not tell [kg m/s]");
}

pub fn ways_fill_the_step_and_impacts_take_no_time<S: Dimension>() {
    let mut w = shower::<S>();
    let mut divided = 0;
    for _ in 0..16 {
        let begun = w.time();
        step(&mut w);
        for i in 1..w.bodies().len() {
            let mut at = begun;
            let mut act = None;
            let mine: Vec<_> = log(&w).pieces.iter().filter(|p| p.body == i).collect();
            for p in &mine {
                close(p.time, at, 1e-14, "beginning of a piece [s]");
                assert!(act.is_none_or(|a| p.act > a), "acts follow each other");
                assert_eq!(p.length > 0.0, matches!(p.kind, PieceKind::Flow | PieceKind::Fallback));
                (at, act) = (at + p.length, Some(p.act));
            }
            if !mine.is_empty() {
                divided += 1;
                close(at, w.time(), 1e-14, "end of the last piece [s]");
            }
        }
        let in_time = log(&w).contacts.iter().all(|r| r.kind.is_impact() == (r.length == 0.0));
        assert!(in_time, "impacts take no time, flows some");
    }
    assert!(divided > 5, "events divided {divided} ways");
}

/// Falls .2 m onto a floor with e = 1/2: one impact, of m (1 + e) v.
pub fn a_bounce_is_one_impact_at_its_moment<S: Dimension>() {
    let mut w = world::<S>(Settings { dt: 0.5, scheme: Scheme::Events, ..Settings::default() });
    add_floor(&mut w, 0.0, 0.0);
    let ball = BodySpec::heavy(S::ball(0.1), 2.0).at(S::at(0.0, 0.3)).restitution(0.5);
    add(&mut w, "ball", ball.friction(0.0));
    w.step(0.25).expect("a step");
    let [hit] = log(&w).contacts.as_slice() else { panic!("one record: {:?}", log(&w).contacts) };
    let speed = (2.0 * G * 0.2_f64).sqrt();
    assert_eq!(hit.kind, EventKind::Impact);
    close(hit.time, speed / G, 1e-13, "moment [s]");
    close(hit.impulse.norm(), 2.0 * 1.5 * speed, 1e-12, "impulse [N s]");
    close(S::up(hit.point), 0.0, 1e-12, "height of the point [m]");
    let kinds: Vec<_> = log(&w).pieces.iter().map(|p| p.kind).collect();
    assert_eq!(kinds, [PieceKind::Flow, PieceKind::Impact, PieceKind::Flow]);
}

/// A block at .3 m/s on mu = .5 stops after v / (mu g): trial flows beyond it are not told.
pub fn a_slide_that_ends_within_a_step_is_two_flows<S: Dimension>() {
    let mut w = world::<S>(Settings { dt: 0.1, scheme: Scheme::Events, ..Settings::default() });
    add_floor(&mut w, 0.5, 0.0);
    let block = BodySpec::heavy(S::block(0.4, 0.2), 2.0).at(S::at(0.0, 0.1)).moving(S::at(0.3, 0.0));
    add(&mut w, "block", block.friction(0.5));
    step(&mut w);
    let flows: Vec<_> = log(&w).pieces.iter().map(|p| (p.kind, p.length)).collect();
    let [(PieceKind::Flow, slide), (PieceKind::Flow, rest)] = flows.as_slice() else { panic!("{flows:?}") };
    close(*slide, 0.3 / (0.5 * G), 1e-9, "length of the slide [s]");
    close(slide + rest, 0.1, 1e-15, "length of both [s]");
}

pub fn contacts_are_sums_over_the_step<S: Dimension>() {
    let mut w = shower::<S>();
    let mut early = 0;
    for _ in 0..16 {
        step(&mut w);
        let sums = w.last_sums().expect("sums");
        assert_eq!(sums.len(), w.touches().len());
        let (mut total, mut told) = (S::Vector::ZERO, S::Vector::ZERO);
        log(&w).contacts.iter().for_each(|r| total += r.impulse);
        sums.iter().for_each(|s| told += s.impulse);
        at_most((total - told).norm(), 1e-13, "impulse that sums do not have [N s]");
        early += w.touches().len() - w.last_problem().0.contacts.len();
    }
    assert!(early > 0, "some contacts only acted early in a step");
}

pub fn steps_of_a_fixed_length_have_no_log<S: Dimension>() {
    let mut w = shower::<S>();
    w.set_settings(Settings { scheme: Scheme::FixedStep, ..w.settings().clone() }).expect("settings");
    step(&mut w);
    assert!(w.last_events().is_none() && w.last_sums().is_none());
}

pub fn the_log_is_the_same_twice<S: Dimension>() {
    let logs = || {
        let mut w = shower::<S>();
        (0..16).map(|_| (step(&mut w), log(&w).clone()).1).collect::<Vec<_>>()
    };
    assert_eq!(logs(), logs());
}
