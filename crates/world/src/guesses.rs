//! Directions in which pairs were apart when last looked at, one number each: what `Geometry::contacts_near` begins with. They
//! decide nothing but the work, so a direction is kept to a millionth of a radian, and whoever looks at a pair writes its own.

use carom_math::{Column, Space};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Bits of a component.
const BITS: u32 = 21;
/// Largest component, as a number of steps.
const MOST: f64 = ((1 << (BITS - 1)) - 1) as f64;

/// A direction, or none.
#[derive(Default)]
pub(crate) struct Guess(AtomicU64);

impl Guess {
    /// The direction, of unit length.
    #[inline]
    pub fn get<S: Space>(&self) -> Option<S::Vector> {
        let bits = self.0.load(Relaxed);
        if bits == 0 {
            return None;
        }
        let number = |k: usize| (bits >> (BITS as usize * k)) & ((1 << BITS) - 1);
        S::Vector::from_fn(|k| number(k) as f64 - MOST - 1.0).normalized()
    }

    /// Takes in a direction of unit length.
    #[inline]
    pub fn set<S: Space>(&self, direction: Option<S::Vector>) {
        let number = |x: f64| (MOST * x).round() as i64 + MOST as i64 + 1;
        let packed =
            |d: S::Vector| (0..S::DIM).fold(0, |bits, k| bits | (number(d[k]) as u64) << (BITS as usize * k));
        self.0.store(direction.map_or(0, packed), Relaxed);
    }
}

/// The guesses of some pairs handed on to others, both in lexicographic order; new pairs have none.
pub(crate) fn hand_on(from: (&[(u32, u32)], &mut Vec<Guess>), pairs: &[(u32, u32)], room: &mut Vec<Guess>) {
    let (old, guesses) = from;
    room.clear();
    let mut known = old.iter().zip(guesses.drain(..)).peekable();
    for pair in pairs {
        while known.next_if(|(one, _)| *one < pair).is_some() {}
        room.push(known.next_if(|(one, _)| *one == pair).map_or_else(Guess::default, |(_, guess)| guess));
    }
    drop(known);
    std::mem::swap(guesses, room);
}

#[cfg(test)]
mod tests {
    use super::*;
    use carom_math::{Planar, Spatial, vec2, vec3};

    #[test]
    fn a_direction_is_kept_to_a_millionth() {
        let guess = Guess::default();
        assert_eq!(guess.get::<Spatial>(), None);
        for k in 0..100 {
            let (u, v) = (0.1 * f64::from(k), 0.37 * f64::from(k));
            let direction = vec3(u.cos() * v.sin(), u.sin() * v.sin(), v.cos());
            guess.set::<Spatial>(Some(direction));
            let kept = guess.get::<Spatial>().expect("a direction");
            assert!((kept - direction).norm() < 2e-6 && (kept.norm() - 1.0).abs() < 1e-15);
            let direction = vec2(u.cos(), u.sin());
            guess.set::<Planar>(Some(direction));
            assert!((guess.get::<Planar>().expect("a direction") - direction).norm() < 2e-6);
        }
        guess.set::<Spatial>(None);
        assert_eq!(guess.get::<Spatial>(), None);
    }

    #[test]
    fn pairs_that_stay_keep_their_guesses() {
        let old = [(0, 1), (0, 3), (1, 2), (4, 5)];
        let mut guesses: Vec<Guess> =
            old.iter().map(|p| Guess(AtomicU64::new(u64::from(p.0 + 10 * p.1)))).collect();
        let new = [(0, 2), (0, 3), (1, 2), (2, 3), (4, 5), (6, 7)];
        hand_on((&old, &mut guesses), &new, &mut Vec::new());
        let numbers: Vec<u64> = guesses.iter().map(|g| g.0.load(Relaxed)).collect();
        assert_eq!(numbers, [0, 30, 21, 0, 54, 0]);
    }
}
