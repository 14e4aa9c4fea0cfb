//! Bodies that are alone in a step of `events` go through it by themselves, without sets and problems (theory section
//! 8.7). That is a matter of cost: a step that somebody differentiates has everybody go the general way, and finds the same
//! motion to the last bit, the same contacts, forces, events and memory, and the same lines to rounding.

use crate::harness::*;
use carom::gradient::{Plan, Rollout};
use carom::solver::Impulse;
use carom::{BodySpec, Contact, EventRecord, EventSettings, PlasticArrivals, Scheme, Settings, World};

in_plane_and_space!(
    bodies_fare_alone_as_they_do_in_company,
    a_ball_alone_on_a_floor_without_friction_keeps_what_it_has,
    a_ball_alone_meets_a_wall_where_the_wall_is,
);

/// Steps of company.
const STEPS: usize = 100;

fn settings<S: Dimension>(plastic_arrivals: PlasticArrivals, dt: f64) -> Settings<S> {
    let events = EventSettings { plastic_arrivals, ..EventSettings::default() };
    Settings { dt, scheme: Scheme::Events, tolerance: 1e-8, events, ..Settings::default() }
}

/// Balls that slide alone, by twos, past each other and into each other, fall, bounce, turn, and lie on each other.
fn company<S: Dimension>(plastic_arrivals: PlasticArrivals, dt: f64) -> World<S> {
    let mut w = world::<S>(settings(plastic_arrivals, dt));
    add_floor(&mut w, 0.0, 0.0);
    let mut put = |name: &str, at: [f64; 2], speed: f64, change: &dyn Fn(BodySpec<S>) -> BodySpec<S>| {
        let ball = BodySpec::dense(S::ball(0.1), 1000.0).at(S::at(at[0], at[1])).moving(S::at(speed, 0.0));
        add(&mut w, name, change(ball.friction(0.0).restitution(0.0)));
    };
    let plain = |ball| ball;
    put("rests", [0.0, 0.1], 0.0, &plain);
    put("slides", [1.0, 0.1], 2.0, &plain);
    put("follows", [0.79, 0.1], 2.0, &plain);
    put("comes", [4.0, 0.1], -1.5, &plain);
    put("falls", [-1.0, 0.4], -0.3, &plain);
    put("bounces", [-2.0, 0.5], 0.2, &|ball: BodySpec<S>| ball.restitution(0.5));
    put("rubs", [-3.0, 0.1], 1.0, &|ball: BodySpec<S>| ball.friction(0.3));
    put("left", [-5.1, 0.1], 0.0, &plain);
    put("right", [-4.89, 0.1], 0.0, &plain);
    put("upon", [-5.0, 0.29], 0.0, &plain);
    put("far", [-9.0, 5.0], 1.0, &plain);
    let block = BodySpec::dense(S::block(0.3, 0.2), 500.0).at(S::at(7.0, 0.1)).moving(S::at(-0.5, 0.0));
    add(&mut w, "block", block.friction(0.0).restitution(0.0));
    let wall = BodySpec::fixed(S::block(0.2, 2.0)).at(S::at(9.0, 1.0));
    add(&mut w, "wall", wall.friction(0.0).restitution(0.0));
    w
}

/// The contacts of the last step by name, with their impulses.
fn contacts<S: Dimension>(w: &World<S>) -> Vec<(Contact<S>, Impulse<S>)> {
    let (problem, impulses, _) = w.last_problem();
    let mut all: Vec<_> = problem.contacts.iter().copied().zip(impulses.contacts.iter().copied()).collect();
    all.sort_by_key(|c| c.0.id);
    all
}

/// What contacts did in the last step, by name; acts of different bodies are numbered as they were taken. That somebody
/// stood by and got nothing where others were slowed is not told of who is alone.
fn records<S: Dimension>(w: &World<S>) -> Vec<EventRecord<S>> {
    let log = w.last_events().expect("events have a log");
    let acted = log.contacts.iter().filter(|r| r.impulse != S::at(0.0, 0.0) || !r.kind.is_impact());
    let mut all: Vec<EventRecord<S>> = acted.map(|r| EventRecord { act: 0, ..*r }).collect();
    all.sort_by(|a, b| a.id.cmp(&b.id).then(a.time.total_cmp(&b.time)));
    all
}

/// Steps of the same world that somebody differentiates.
fn taped<S: Dimension>(w: &mut World<S>, steps: usize) -> Rollout<S> {
    let plan = Plan { steps, dt: None, loads: Vec::new(), stretch: None };
    Rollout::record(w, &plan).unwrap_or_else(|e| panic!("{e}"))
}

pub fn bodies_fare_alone_as_they_do_in_company<S: Dimension>() {
    for dt in [1e-3, 1e-2, 5e-2] {
        let mut w = company::<S>(PlasticArrivals::AtTheirMoment, dt);
        let scale = w.energy().total();
        let whole = taped(&mut w, STEPS);
        for k in 0..STEPS {
            let one = taped(&mut w, 1);
            let general = one.world();
            step(&mut w);
            let place = format!("step {k} of {dt}");
            assert_eq!(bits(&w), bits(general), "{place}");
            assert_eq!(contacts(&w), contacts(general), "{place}");
            assert_eq!(records(&w), records(general), "{place}");
            assert_eq!(w.touches().len(), general.touches().len(), "{place}");
            for (a, b) in w.ledger().lines().into_iter().zip(general.ledger().lines()) {
                assert!((a - b).abs() <= 1e-13 * scale, "{a} for {b}, {place}");
            }
            // what the steps before told is the same too
            let (mine, theirs) = (&w.bodies().motion, &whole.states()[k + 1]);
            assert_eq!((&mine.position, &mine.velocity), (&theirs.position, &theirs.velocity), "{place}");
            assert_eq!(mine.angular_velocity, theirs.angular_velocity, "{place}");
        }
    }
}

/// Case: no force along the floor, none that works; the weight is carried.
pub fn a_ball_alone_on_a_floor_without_friction_keeps_what_it_has<S: Dimension>() {
    for plastic_arrivals in [PlasticArrivals::AtTheirMoment, PlasticArrivals::WithinTheStep] {
        let mut w = world::<S>(settings(plastic_arrivals, 0.01));
        add_floor(&mut w, 0.0, 0.0);
        let ball = BodySpec::heavy(S::ball(0.1), 2.0).at(S::at(0.0, 0.1)).moving(S::at(3.0, 0.0));
        add(&mut w, "ball", ball.friction(0.0).restitution(0.0));
        let start = w.energy().total();
        run(&mut w, 10.0, |w, r| {
            close(normal_force(w, 1, 0), 2.0 * G, 1e-11, "weight [N]");
            assert_eq!((r.contacts, r.events.islands), (1, 1));
            let solve = r.contact_solve.as_ref().expect("a contact that presses");
            assert_eq!((solve.contacts, solve.islands.len(), solve.islands[0].first_body), (1, 1, 1));
            let certificate = w.certificate(carom::Phase::Contact, Some(1)).expect("it touches");
            at_most(certificate.residual, 1e-12, "certificate [m/s]");
        });
        close(S::along(w.bodies().motion.position[1]), 30.0, 1e-11, "way [m]");
        close(height(&w, 1), 0.1, 1e-14, "on the floor [m]");
        close(w.energy().total(), start, 1e-14 * start, "energy [J]");
    }
}

/// A wall comes into reach in the very step in which the ball meets it.
pub fn a_ball_alone_meets_a_wall_where_the_wall_is<S: Dimension>() {
    for plastic_arrivals in [PlasticArrivals::AtTheirMoment, PlasticArrivals::WithinTheStep] {
        let mut w = world::<S>(settings(plastic_arrivals, 0.1));
        add_floor(&mut w, 0.0, 0.0);
        let ball = BodySpec::heavy(S::ball(0.1), 1.0).at(S::at(0.0, 0.1)).moving(S::at(20.0, 0.0));
        add(&mut w, "ball", ball.friction(0.0).restitution(0.0));
        let wall = BodySpec::fixed(S::block(0.02, 2.0)).at(S::at(15.0, 1.0));
        add(&mut w, "wall", wall.friction(0.0).restitution(0.0));
        run(&mut w, 1.0, |_, _| {});
        close(S::along(w.bodies().motion.position[1]), 15.0 - 0.11, 1e-9, "at the wall [m]");
        at_most(speed(&w, 1), 1e-9, "at rest [m/s]");
    }
}
