//! What pairs are remembered by from step to step: a direction along which they were apart, with which `Geometry::contacts_near`
//! begins, and how far bodies may move before the pair need be looked at again. Neither decides anything but the work, so a
//! direction is kept to a millionth of a radian, and whoever looks at a pair writes its own.

use carom_geometry::Guess;
use carom_math::{Column, Space};
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

/// What is remembered of some pairs handed on to others, both in lexicographic order; of new pairs it is nothing.
pub(crate) fn hand_on(
    (old, remembered): (&[(u32, u32)], &mut Vec<Remembered>),
    pairs: &[(u32, u32)],
    room: &mut Vec<Remembered>,
) {
    room.clear();
    let mut known = old.iter().zip(remembered.drain(..)).peekable();
    for pair in pairs {
        while known.next_if(|(one, _)| *one < pair).is_some() {}
        room.push(known.next_if(|(one, _)| *one == pair).map_or_else(Remembered::default, |known| known.1));
    }
    drop(known);
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
        let of = |number: u64| Remembered { direction: number.into(), ..Remembered::default() };
        let mut all: Vec<Remembered> = old.iter().map(|p| of(u64::from(p.0 + 10 * p.1))).collect();
        let new = [(0, 2), (0, 3), (1, 2), (2, 3), (4, 5), (6, 7)];
        hand_on((&old, &mut all), &new, &mut Vec::new());
        let numbers: Vec<u64> = all.iter().map(|g| g.direction.load(Relaxed)).collect();
        assert_eq!(numbers, [0, 30, 21, 0, 54, 0]);
    }
}
