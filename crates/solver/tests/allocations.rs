//! What `exact` asks the machine for while solves of one size follow one another: nothing, once the contact graph and each
//! stage have been seen and every buffer has its size. The dense factorisation with pivots, to which a jammed pile in
//! space falls back, is a library's and asks for its own. One test, for the counter sees all threads.

#[path = "common/mod.rs"]
#[macro_use]
mod common;
#[allow(dead_code)]
#[path = "contact/scenes.rs"]
mod scenes;

use carom_math::{Planar, Space, Spatial};
use carom_solver::{ContactProblem, Impulses, SolveSettings, SolverKind, Stop};
use common::Random;
use scenes::{FALL, pile, stack, wall};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};
use std::alloc::System;

#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// The same bodies with velocities changed by up to a share of those that gravity gives.
fn stirred<S: Space>(problem: &ContactProblem<S>, share: f64, random: &mut Random) -> ContactProblem<S> {
    let mut later = problem.clone();
    let moves = later.velocities.iter_mut().zip(&problem.inverse_masses).filter(|(_, m)| !m.is_fixed());
    for (v, _) in moves {
        v.add_scaled(&random.twist(1.0), share * FALL);
    }
    later
}

/// Solves that bring all stages and sizes about.
const FIRST: usize = 6;
/// Solves that are counted.
const COUNTED_SOLVES: usize = 6;

/// Allocations and bytes of solves after the first ones, from cold and from the impulses before in turn; a mark of all
/// bits of the impulses is printed.
fn asked_for<S: Space>(what: &str, problem: &ContactProblem<S>) -> (usize, usize) {
    let settings = SolveSettings { tolerance: 1e-8 * FALL, ..SolveSettings::default() };
    let mut solver = SolverKind::Exact.make();
    let mut random = Random::new(7);
    let mut impulses = Impulses::zero(problem);
    let (mut calls, mut bytes, mut factorisations) = (0, 0, 0);
    let mut mark = 0xcbf2_9ce4_8422_2325_u64;
    for round in 0..FIRST + COUNTED_SOLVES {
        let later = stirred(problem, 0.01 * (1 + round % 3) as f64, &mut random);
        if round % 2 == 0 {
            impulses.reset(&later);
        }
        let before = Region::new(COUNTED);
        let outcome = solver.solve(&later, &settings, &mut impulses);
        let change = before.change();
        assert_eq!(outcome.stop, Stop::Converged, "{what}, round {round}: {outcome:?}");
        if round >= FIRST {
            calls += change.allocations + change.reallocations;
            bytes += change.bytes_allocated;
        }
        factorisations += outcome.factorisations;
        for x in impulses.flat() {
            mark = (mark ^ x.to_bits()).wrapping_mul(0x0100_0000_01b3);
        }
    }
    let contacts = problem.contacts.len();
    println!(
        "{} {what}: {contacts} contacts, {factorisations} factorisations, {calls} calls for {bytes} bytes, impulses \
         {mark:016x}",
        S::NAME
    );
    (calls, bytes)
}

#[test]
fn solves_of_one_size_ask_for_no_memory() {
    let mut random = Random::new(3);
    let mut all = vec![
        ("wall", asked_for("wall", &wall::<Spatial>(7, 6, 0.5))),
        ("wall", asked_for("wall", &wall::<Planar>(12, 8, 0.5))),
        ("wall without friction", asked_for("wall without friction", &wall::<Spatial>(5, 4, 0.0))),
        ("stack", asked_for("stack", &stack::<Spatial>(&[1.0; 4], 0.5))),
    ];
    all.push(("pile", asked_for("pile", &pile::<Planar>(10, 0.4, 1.0, &mut random))));
    for (what, (calls, bytes)) in all {
        assert_eq!((calls, bytes), (0, 0), "{what}");
    }
    // 2,000 calls per solve, most of them the library's; 30,000 before memory was kept
    let (calls, _) = asked_for("jammed pile", &pile::<Spatial>(5, 0.4, 1.0, &mut random));
    assert!(calls <= 3_000 * COUNTED_SOLVES, "{calls} calls");
}
