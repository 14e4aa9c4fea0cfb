//! The broad phase against all pairs.

use crate::common::*;
use carom_geometry::broad_phase::Changed;
use carom_geometry::{Aabb, BroadPhase};
use carom_math::{Column, Planar, Space, Spatial, Workers};

fn all_pairs<S: Space>(
    bounds: &[Aabb<S>],
    movable: &[bool],
    may_pair: &dyn Fn(usize, usize) -> bool,
) -> Vec<(u32, u32)> {
    let mut pairs = Vec::new();
    for i in 0..bounds.len() {
        for j in i + 1..bounds.len() {
            let (a, b) = (&bounds[i], &bounds[j]);
            let overlap = (0..S::DIM).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k]);
            if overlap && (movable[i] || movable[j]) && may_pair(i, j) {
                pairs.push((i as u32, j as u32));
            }
        }
    }
    pairs
}

/// Keeps pairs one by one.
fn sift(may_pair: &(dyn Fn(usize, usize) -> bool + Sync)) -> impl Fn(&mut Vec<(u32, u32)>) + Sync {
    |pairs| pairs.retain(|(i, j)| may_pair(*i as usize, *j as usize))
}

/// Boxes of all kinds: many small, some large, some equal, some touching, some points, some unbounded.
fn boxes<S: Space>(random: &mut Random, count: usize) -> Vec<Aabb<S>> {
    let mut boxes: Vec<Aabb<S>> = Vec::new();
    for i in 0..count {
        let center = S::Vector::from_fn(|_| 5.0 * random.signed());
        let size = [0.2, 1.0, 8.0][random.below(3)];
        let half = S::Vector::from_fn(|_| size * random.unit());
        let mut b = Aabb { min: center - half, max: center + half };
        match random.below(12) {
            0 if i > 0 => b = boxes[random.below(i)],
            1 if i > 0 => {
                // touches an earlier one exactly
                let other = boxes[random.below(i)];
                if other.max.is_finite() {
                    b.max += other.max - b.min;
                    b.min = other.max;
                }
            }
            2 => b.max = b.min,
            3 if random.below(4) == 0 => b.min = S::Vector::from_fn(|_| f64::NEG_INFINITY),
            4 if random.below(8) == 0 => {
                b.min = S::Vector::from_fn(|_| f64::NEG_INFINITY);
                b.max = S::Vector::from_fn(|_| f64::INFINITY);
            }
            5 => {
                let far = S::Vector::from_fn(|_| 1e12);
                b = Aabb { min: b.min - far, max: b.max + far };
            }
            _ => {}
        }
        boxes.push(b);
    }
    boxes
}

fn equals_all_pairs<S: Space>() {
    let mut random = Random::new(31);
    let mut phase = BroadPhase::<S>::new();
    for round in 0..60 {
        let count = [0, 1, 2, 5, 40, 200][round % 6];
        let bounds = boxes::<S>(&mut random, count);
        let movable: Vec<bool> = (0..count).map(|_| random.unit() < 0.7).collect();
        let may_pair = |i: usize, j: usize| !(i * 7 + j).is_multiple_of(5);
        let expected = all_pairs(&bounds, &movable, &may_pair);
        assert_eq!(phase.update(&bounds, &movable, &may_pair), expected, "round {round}");
        assert!(expected.windows(2).all(|w| w[0] < w[1]));
    }
}

#[test]
fn it_finds_all_pairs_and_only_them_in_order() {
    equals_all_pairs::<Planar>();
    equals_all_pairs::<Spatial>();
}

#[test]
fn the_pairs_do_not_depend_on_what_was_asked_before() {
    let mut random = Random::new(32);
    let bounds = boxes::<Spatial>(&mut random, 100);
    let movable = vec![true; 100];
    let mut used = BroadPhase::<Spatial>::new();
    for _ in 0..5 {
        let other = boxes::<Spatial>(&mut random, 50);
        used.update(&other, &movable[..50], &|_, _| true);
    }
    let fresh = BroadPhase::<Spatial>::new().update(&bounds, &movable, &|_, _| true).to_vec();
    assert_eq!(used.update(&bounds, &movable, &|_, _| true), fresh);
}

#[test]
fn fixed_bodies_never_pair_with_each_other_and_the_filter_sees_ordered_pairs() {
    let unit = Aabb::<Planar> { min: Column::ZERO, max: Column::from_fn(|_| 1.0) };
    let seen = std::sync::Mutex::new(Vec::new());
    let mut phase = BroadPhase::<Planar>::new();
    let pairs = phase.update(&[unit; 4], &[false, true, false, false], &|i, j| {
        seen.lock().unwrap().push((i, j));
        j != 3
    });
    assert_eq!(pairs, [(0, 1), (1, 2)]);
    assert!(seen.into_inner().unwrap().iter().all(|(i, j)| i < j));
}

/// Boxes whose sizes are spread evenly over orders of magnitude, in a heap about `center`.
fn of_all_sizes<S: Space>(random: &mut Random, count: usize, orders: f64, center: f64) -> Vec<Aabb<S>> {
    let one = |random: &mut Random| {
        let size = 10f64.powf(-orders * random.unit());
        let at = S::Vector::from_fn(|_| center + random.signed());
        let half = S::Vector::from_fn(|_| 0.5 * size * (0.3 + 0.7 * random.unit()));
        Aabb { min: at - half, max: at + half }
    };
    (0..count).map(|_| one(random)).collect()
}

fn is_all_pairs<S: Space>(bounds: &[Aabb<S>], what: &str) {
    let movable: Vec<bool> = (0..bounds.len()).map(|i| i % 7 != 3).collect();
    let may_pair = |i: usize, j: usize| !(i + 3 * j).is_multiple_of(11);
    let mut phase = BroadPhase::<S>::new();
    let expected = all_pairs(bounds, &movable, &may_pair);
    for _ in 0..2 {
        assert!(phase.update(bounds, &movable, &may_pair) == expected, "{what}");
    }
    // other boxes in between leave no trace
    phase.update(&bounds[..bounds.len() / 2], &movable[..bounds.len() / 2], &may_pair);
    assert!(phase.update(bounds, &movable, &may_pair) == expected, "{what}, once more");
}

fn holds_for_boxes_of_every_kind<S: Space>() {
    let mut random = Random::new(57);
    for orders in [0.0, 0.3, 1.0, 4.0] {
        for center in [0.0, -3.0, 4e5, 1e9, -1e14, 1e150] {
            let bounds = of_all_sizes::<S>(&mut random, 500, orders, center);
            is_all_pairs(&bounds, &format!("sizes over {orders} orders about {center:e}"));
        }
    }
    let like = of_all_sizes::<S>(&mut random, 300, 0.2, 0.0);
    let moved = |b: &Aabb<S>, by: f64| {
        let by = S::Vector::from_fn(|_| by);
        Aabb { min: b.min + by, max: b.max + by }
    };
    // a heap here, one far away, and one where rows of a fine grid begin anew
    for far in [0.0, 1e3, 65536.0, 1e12] {
        let both: Vec<Aabb<S>> = like
            .iter()
            .chain(&like)
            .enumerate()
            .map(|(k, b)| moved(b, if k < like.len() { 0.0 } else { far }))
            .collect();
        is_all_pairs(&both, &format!("two heaps {far:e} apart"));
    }
    is_all_pairs(&[like[0]; 150], "all at the same place");
    is_all_pairs(&[Aabb { max: like[0].min, ..like[0] }; 150], "points at the same place");
    let odd = |number: f64, axis: usize| {
        like.iter()
            .enumerate()
            .map(|(k, b)| {
                let mut b = *b;
                if k % 5 == 0 {
                    b.max[axis] = number
                }
                if k % 10 == 0 {
                    b.min[axis] = -number
                }
                b
            })
            .collect::<Vec<Aabb<S>>>()
    };
    for axis in 0..S::DIM {
        for number in [f64::INFINITY, f64::NAN, f64::MAX, 0.0, -0.0] {
            is_all_pairs(&odd(number, axis), &format!("{number} on axis {axis}"));
        }
    }
}

#[test]
fn it_finds_all_pairs_of_mixed_sizes_at_the_same_place_far_away_and_without_bounds() {
    holds_for_boxes_of_every_kind::<Planar>();
    holds_for_boxes_of_every_kind::<Spatial>();
}

/// Boxes side by side whose faces meet exactly: touching counts, and neither rows nor sizes may lose it.
fn counts_touching<S: Space>() {
    for (scale, origin) in [(1.0, 0.0), (0.1, 7.3), (1.0 / 3.0, -1e6), (1e-3, 12.0)] {
        let side = 6usize;
        let cell = |k: usize| S::Vector::from_fn(|axis| (k / side.pow(axis as u32) % side) as f64);
        let bounds: Vec<Aabb<S>> = (0..side.pow(S::DIM as u32))
            .map(|k| {
                let place = |more: f64| S::Vector::from_fn(|axis| origin + scale * (cell(k)[axis] + more));
                Aabb { min: place(0.0), max: place(1.0) }
            })
            .collect();
        is_all_pairs(&bounds, &format!("cells of {scale} from {origin}"));
    }
}

#[test]
fn boxes_that_only_touch_are_pairs() {
    counts_touching::<Planar>();
    counts_touching::<Spatial>();
}

/// Boxes alike in rows, larger ones in trees, some that stand and sleep: as many pairs on one thread as on several.
fn several_workers_find_the_same_pairs<S: Space>() {
    let mut random = Random::new(7);
    let count = 1500;
    let small = |random: &mut Random| {
        let center = S::Vector::from_fn(|_| 20.0 * random.signed());
        let half = S::Vector::from_fn(|_| 0.5 + 0.2 * random.unit());
        Aabb { min: center - half, max: center + half }
    };
    let mut bounds: Vec<Aabb<S>> = (0..count).map(|_| small(&mut random)).collect();
    bounds.extend(boxes::<S>(&mut random, 500));
    let movable: Vec<bool> = (0..bounds.len()).map(|_| random.unit() < 0.8).collect();
    let may_pair = |i: usize, j: usize| !(i + 2 * j).is_multiple_of(7);
    let asleep: Vec<u32> =
        (0..bounds.len() as u32).filter(|i| i % 9 == 0 && bounds[*i as usize].is_finite()).collect();
    let others: Vec<u32> = (0..bounds.len() as u32)
        .filter(|i| asleep.binary_search(i).is_err() && (movable[*i as usize] || i % 5 == 0))
        .collect();
    let changed =
        Changed { others: &others, asleep: &asleep, stands_as_before: false, sleeps_as_before: false };
    let pairs = |threads: usize| {
        let (mut phase, workers) = (BroadPhase::<S>::new(), Workers::new(threads).unwrap());
        phase.update_some((&bounds, &movable), changed, &sift(&may_pair), &workers).to_vec()
    };
    let alone = pairs(1);
    assert!(alone.len() > 1000, "{}", alone.len());
    for threads in [2, 3, 8] {
        assert_eq!(pairs(threads), alone, "{threads} threads");
    }
    let mut phase = BroadPhase::<S>::new();
    assert_eq!(phase.update(&bounds, &movable, &may_pair), all_pairs(&bounds, &movable, &may_pair));
}

#[test]
fn any_number_of_workers_finds_the_same_pairs() {
    several_workers_find_the_same_pairs::<Planar>();
    several_workers_find_the_same_pairs::<Spatial>();
}

/// Told which boxes stand, and that they stand as before, it finds the same pairs as when it looks at all of them.
fn standing_boxes_cost_no_look_and_no_pair<S: Space>() {
    let mut random = Random::new(91);
    for round in 0..20 {
        let count = [3, 40, 300][round % 3];
        let mut bounds = boxes::<S>(&mut random, count);
        let movable: Vec<bool> = (0..count).map(|_| random.unit() < 0.3).collect();
        // some that nothing moves are not said to stand
        let others: Vec<u32> =
            (0..count as u32).filter(|i| movable[*i as usize] || random.unit() < 0.1).collect();
        let may_pair = |i: usize, j: usize| !(i + 2 * j).is_multiple_of(7);
        let (mut phase, workers) = (BroadPhase::<S>::new(), Workers::default());
        for step in 0..4 {
            let changed = Changed {
                others: &others,
                asleep: &[],
                stands_as_before: step > 0,
                sleeps_as_before: step > 0,
            };
            let told = phase.update_some((&bounds, &movable), changed, &sift(&may_pair), &workers);
            assert_eq!(told, all_pairs(&bounds, &movable, &may_pair), "round {round}, step {step}");
            let fresh = boxes::<S>(&mut random, count);
            for i in others.iter().map(|i| *i as usize) {
                bounds[i] = fresh[i];
            }
        }
    }
}

#[test]
fn what_stands_is_found_without_being_looked_at() {
    standing_boxes_cost_no_look_and_no_pair::<Planar>();
    standing_boxes_cost_no_look_and_no_pair::<Spatial>();
}

/// Boxes that sleep make the pairs that all boxes make, but those with each other and with what stands.
fn sleeping_boxes_make_pairs_with_what_is_awake_alone<S: Space>() {
    let mut random = Random::new(17);
    for round in 0..30 {
        let count = [3, 40, 300][round % 3];
        let mut bounds = boxes::<S>(&mut random, count);
        let movable: Vec<bool> = (0..count).map(|_| random.unit() < 0.6).collect();
        let may_pair = |i: usize, j: usize| !(i + 2 * j).is_multiple_of(7);
        let driven: Vec<bool> = (0..count).map(|_| random.unit() < 0.2).collect();
        let mut sleeps = vec![false; count];
        let (mut phase, workers) = (BroadPhase::<S>::new(), Workers::default());
        for step in 0..6 {
            let again = step % 2 == 0; // who sleeps changes at every other step, and nothing else does then
            if again {
                let falls = |i: usize, random: &mut Random| {
                    movable[i] && bounds[i].is_finite() && random.unit() < 0.5
                };
                sleeps = (0..count).map(|i| falls(i, &mut random)).collect();
            }
            let list = |fits: &dyn Fn(usize) -> bool| -> Vec<u32> {
                (0..count).filter(|i| fits(*i)).map(|i| i as u32).collect()
            };
            let asleep = list(&|i| sleeps[i]);
            let others = list(&|i| (movable[i] || driven[i]) && !sleeps[i]);
            let changed = Changed {
                others: &others,
                asleep: &asleep,
                stands_as_before: step > 0,
                sleeps_as_before: !again,
            };
            let is_awake = |i: usize| (movable[i] || driven[i]) && !sleeps[i];
            let expected =
                all_pairs(&bounds, &movable, &|i, j| may_pair(i, j) && (is_awake(i) || is_awake(j)));
            let told = phase.update_some((&bounds, &movable), changed, &sift(&may_pair), &workers);
            assert_eq!(told, expected, "round {round}, step {step}");
            let fresh = boxes::<S>(&mut random, count);
            for i in others.iter().map(|i| *i as usize) {
                bounds[i] = fresh[i];
            }
        }
    }
}

#[test]
fn what_sleeps_is_found_by_what_is_awake() {
    sleeping_boxes_make_pairs_with_what_is_awake_alone::<Planar>();
    sleeping_boxes_make_pairs_with_what_is_awake_alone::<Spatial>();
}
