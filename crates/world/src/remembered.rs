//! What pairs are remembered by from step to step: a direction along which they were apart, with which `Geometry::contacts_near`
//! begins, and how far bodies may move before the pair need be looked at again. Neither decides anything but the work, so a
//! direction is kept to a millionth of a radian, and whoever looks at a pair writes its own.

use carom_geometry::Guess;
use carom_math::{Column, Space, Workers};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Bits of a component.
const BITS: u32 = 21;
/// Largest component, as a number of steps.
const MOST: f64 = ((1 << (BITS - 1)) - 1) as f64;
/// Rounding of sums of ways \[1\].
const ROUNDING: f64 = 1e-9;

/// What is remembered of a pair.
#[derive(Default)]
pub(crate) struct Remembered {
    /// A direction in the bits of one number; 0 for none.
    direction: AtomicU64,
    /// The bits of a gap \[m\] with the ways that both bodies had behind them then; 0 where none is known.
    level: AtomicU64,
}

impl Remembered {
    /// The same for another list.
    fn again(&self) -> Self {
        let number = |bits: &AtomicU64| bits.load(Relaxed).into();
        Remembered { direction: number(&self.direction), level: number(&self.level) }
    }

    /// What to begin a look with.
    #[inline]
    pub fn guess<S: Space>(&self) -> Guess<S> {
        let bits = self.direction.load(Relaxed);
        let number = |k: usize| (bits >> (BITS as usize * k)) & ((1 << BITS) - 1);
        let direction = || S::Vector::from_fn(|k| number(k) as f64 - MOST - 1.0).normalized();
        Guess { direction: if bits == 0 { None } else { direction() }, ..Guess::default() }
    }

    /// Takes in what a look left, at which points of both bodies' surfaces had at most such ways behind them \[m\].
    #[inline]
    pub fn learn<S: Space>(&self, guess: &Guess<S>, ways: f64) {
        let number = |x: f64| (MOST * x).round() as i64 + MOST as i64 + 1;
        let packed =
            |d: S::Vector| (0..S::DIM).fold(0, |bits, k| bits | (number(d[k]) as u64) << (BITS as usize * k));
        self.direction.store(guess.direction.map_or(0, packed), Relaxed);
        let level = if guess.apart > 0.0 { guess.apart + ways } else { 0.0 };
        self.level.store(level.to_bits(), Relaxed);
    }

    /// Whether they are farther apart than a margin \[m\] for certain, with such ways behind them.
    #[inline]
    pub fn is_apart(&self, ways: f64, margin: f64) -> bool {
        f64::from_bits(self.level.load(Relaxed)) > (ways + margin) * (1.0 + ROUNDING) + ROUNDING
    }
}

/// Pairs that a worker takes at a time.
const PAIRS: usize = 512;

/// What is remembered of some pairs handed on to others, both in lexicographic order; of new pairs it is nothing.
pub(crate) fn hand_on(
    (old, remembered): (&[(u32, u32)], &mut Vec<Remembered>),
    pairs: &[(u32, u32)],
    room: &mut Vec<Remembered>,
    workers: &Workers,
) {
    // what was there is written over
    room.resize_with(pairs.len(), Remembered::default);
    let known = remembered.as_slice();
    let old = &old[..old.len().min(known.len())];
    workers.each(room, PAIRS, |first, room| {
        let own = &pairs[first..first + room.len()];
        let mut at = own.first().map_or(0, |least| old.partition_point(|pair| pair < least));
        for (to, pair) in room.iter_mut().zip(own) {
            while old.get(at).is_some_and(|one| one < pair) {
                at += 1;
            }
            *to = if old.get(at) == Some(pair) { known[at].again() } else { Remembered::default() };
        }
    });
    std::mem::swap(remembered, room);
}

#[cfg(test)]
mod tests {
    use super::*;
    use carom_math::{Planar, Spatial, vec2, vec3};

    fn kept<S: Space>(direction: S::Vector) -> S::Vector {
        let pair = Remembered::default();
        pair.learn::<S>(&Guess { direction: Some(direction), apart: 0.1 }, 2.0);
        pair.guess::<S>().direction.expect("a direction")
    }

    #[test]
    fn a_direction_is_kept_to_a_millionth() {
        assert_eq!(Remembered::default().guess::<Spatial>(), Guess::default());
        for k in 0..100 {
            let (u, v) = (0.1 * f64::from(k), 0.37 * f64::from(k));
            let direction = vec3(u.cos() * v.sin(), u.sin() * v.sin(), v.cos());
            assert!((kept::<Spatial>(direction) - direction).norm() < 2e-6);
            assert!((kept::<Spatial>(direction).norm() - 1.0).abs() < 1e-15);
            let direction = vec2(u.cos(), u.sin());
            assert!((kept::<Planar>(direction) - direction).norm() < 2e-6);
        }
    }

    #[test]
    fn a_pair_is_apart_until_its_bodies_have_moved_by_its_gap() {
        let pair = Remembered::default();
        assert!(!pair.is_apart(0.0, 0.0));
        pair.learn::<Planar>(&Guess { direction: None, apart: 0.3 }, 7.0);
        assert!(pair.is_apart(7.0, 0.2) && pair.is_apart(7.19, 0.1) && !pair.is_apart(7.21, 0.1));
        pair.learn::<Planar>(&Guess { direction: None, apart: -0.1 }, 7.0);
        assert!(!pair.is_apart(0.0, 0.0));
    }

    #[test]
    fn pairs_that_stay_are_remembered() {
        let old = [(0, 1), (0, 3), (1, 2), (4, 5)];
        let of = |number: u64| Remembered { direction: number.into(), level: (number + 1).into() };
        let mut all: Vec<Remembered> = old.iter().map(|p| of(u64::from(p.0 + 10 * p.1))).collect();
        let new = [(0, 2), (0, 3), (1, 2), (2, 3), (4, 5), (6, 7)];
        hand_on((&old, &mut all), &new, &mut Vec::new(), &Workers::default());
        let numbers = |all: &[Remembered]| -> Vec<[u64; 2]> {
            all.iter().map(|g| [g.direction.load(Relaxed), g.level.load(Relaxed)]).collect()
        };
        assert_eq!(numbers(&all), [[0, 0], [30, 31], [21, 22], [0, 0], [54, 55], [0, 0]]);
        // of pairs that were forgotten nothing is known, and what lay in the room is not taken for it
        let mut room = std::mem::take(&mut all);
        hand_on((&new, &mut all), &new[..3], &mut room, &Workers::default());
        assert_eq!(numbers(&all), [[0, 0]; 3]);
    }

    #[test]
    fn workers_hand_on_what_one_does() {
        let pairs = |step: u32| -> Vec<(u32, u32)> {
            let all = (0..3000).filter(move |k| k % step != 1);
            all.map(|k| (k / 4, k / 4 + 1 + k % 4)).collect()
        };
        let (old, new) = (pairs(5), pairs(3));
        let of = |k: u64| Remembered { direction: (k + 1).into(), level: (2 * k).into() };
        let told = |workers: &Workers| -> Vec<[u64; 2]> {
            let mut all: Vec<Remembered> = (0..old.len() as u64).map(of).collect();
            hand_on((&old, &mut all), &new, &mut Vec::new(), workers);
            all.iter().map(|one| [one.direction.load(Relaxed), one.level.load(Relaxed)]).collect()
        };
        let alone = told(&Workers::default());
        assert!(alone.len() == new.len() && alone.iter().filter(|one| one[0] > 0).count() > 1500);
        for count in [2, 3, 8] {
            assert_eq!(alone, told(&Workers::new(count).unwrap()));
        }
    }
}
