//! Patches carried from step to step, in the order of their pairs. A pair is named by its bodies' serials, a
//! point by its contact's id; friction is kept in world axes, so that a turned frame starts from the same force.
//! In memory a patch has the numbers of its space; in files it has those of any.

use carom_math::{Column, Several, Space};
use serde::{Deserialize, Serialize};

/// Forces of a patch at the end of a step.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(from = "Filed", into = "Filed", bound = "")]
pub struct PatchForce<S: Space> {
    /// Serials of bodies a and b.
    pub pair: (u64, u64),
    /// Points of the patch.
    pub count: usize,
    /// Contact ids of its points.
    pub ids: S::Points<u64>,
    /// Normal forces of its points \[N\].
    pub normal: S::Points<f64>,
    /// Friction on body a in world axes \[N\].
    pub friction: S::Vector,
    /// Friction's torque about the normal \[N m\].
    pub twist: f64,
    /// Rolling friction on body a in world axes \[N m\].
    pub rolling: S::Spin,
    /// Where its points were found.
    pub seen: Seen<S>,
}

impl<S: Space> PatchForce<S> {
    /// Contact ids of its points; a count from a file may be any.
    #[inline]
    pub fn names(&self) -> &[u64] {
        let ids = self.ids.slice();
        &ids[..self.count.min(ids.len())]
    }
}

impl<S: Space> std::fmt::Debug for PatchForce<S> {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        Filed::from(*self).fmt(out)
    }
}

impl<S: Space> PartialEq for PatchForce<S> {
    fn eq(&self, other: &Self) -> bool {
        Filed::from(*self) == Filed::from(*other)
    }
}

/// A patch as it was when the narrow phase looked at its pair.
#[derive(Clone, Copy)]
pub struct Seen<S: Space> {
    /// Normal.
    pub normal: S::Vector,
    /// Points \[m\].
    pub points: S::Points<S::Vector>,
    /// Gaps \[m\].
    pub gaps: S::Points<f64>,
    /// Places of bodies a and b \[m\].
    pub places: [S::Vector; 2],
    /// Numbers of the attitudes of bodies a and b.
    pub attitudes: [S::Turns<f64>; 2],
}

/// A patch in a file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Filed {
    pair: (u64, u64),
    count: usize,
    ids: [u64; 4],
    normal: [f64; 4],
    friction: [f64; 3],
    twist: f64,
    rolling: [f64; 3],
    seen: FiledSight,
}

/// Where the points of a patch in a file were found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct FiledSight {
    normal: [f64; 3],
    points: [[f64; 3]; 4],
    gaps: [f64; 4],
    places: [[f64; 3]; 2],
    attitudes: [[f64; 4]; 2],
}

/// Numbers with zeros behind them.
fn filled<T: Copy + Default, const N: usize>(numbers: &[T]) -> [T; N] {
    std::array::from_fn(|k| numbers.get(k).copied().unwrap_or_default())
}

/// The first of some numbers.
fn first<T: Copy + Default, A: Several<T>>(numbers: &[T]) -> A {
    let mut out = A::all(T::default());
    out.slice_mut().copy_from_slice(&numbers[..A::LEN]);
    out
}

fn column<C: Column>(numbers: &[f64; 3]) -> C {
    C::from_fn(|k| numbers[k])
}

impl<S: Space> From<PatchForce<S>> for Filed {
    fn from(p: PatchForce<S>) -> Self {
        let seen = &p.seen;
        let points = seen.points.slice();
        Filed {
            pair: p.pair,
            count: p.count,
            ids: filled(p.ids.slice()),
            normal: filled(p.normal.slice()),
            friction: filled(p.friction.as_slice()),
            twist: p.twist,
            rolling: filled(p.rolling.as_slice()),
            seen: FiledSight {
                normal: filled(seen.normal.as_slice()),
                points: std::array::from_fn(|i| points.get(i).map_or([0.0; 3], |p| filled(p.as_slice()))),
                gaps: filled(seen.gaps.slice()),
                places: seen.places.map(|place| filled(place.as_slice())),
                attitudes: [filled(seen.attitudes[0].slice()), filled(seen.attitudes[1].slice())],
            },
        }
    }
}

impl<S: Space> From<Filed> for PatchForce<S> {
    fn from(p: Filed) -> Self {
        let mut points = S::Points::all(S::Vector::ZERO);
        for (to, point) in points.slice_mut().iter_mut().zip(&p.seen.points) {
            *to = column(point);
        }
        PatchForce {
            pair: p.pair,
            count: p.count,
            ids: first(&p.ids),
            normal: first(&p.normal),
            friction: column(&p.friction),
            twist: p.twist,
            rolling: column(&p.rolling),
            seen: Seen {
                normal: column(&p.seen.normal),
                points,
                gaps: first(&p.seen.gaps),
                places: [column(&p.seen.places[0]), column(&p.seen.places[1])],
                attitudes: [first(&p.seen.attitudes[0]), first(&p.seen.attitudes[1])],
            },
        }
    }
}

/// Walks along remembered patches beside pairs that come in the same order.
pub struct Walk<'a, S: Space> {
    forces: &'a [PatchForce<S>],
    next: usize,
}

impl<'a, S: Space> Walk<'a, S> {
    /// From a place, or from where a pair may first be.
    pub fn from(forces: &'a [PatchForce<S>], place: Option<usize>, pair: (u64, u64)) -> Self {
        let next = place.unwrap_or_else(|| forces.partition_point(|f| f.pair < pair));
        Walk { forces, next }
    }
    /// Where it stands.
    pub fn place(&self) -> usize {
        self.next
    }
    /// Places of the patches that a pair had.
    pub fn of(&mut self, pair: (u64, u64)) -> std::ops::Range<usize> {
        while self.forces.get(self.next).is_some_and(|f| f.pair < pair) {
            self.next += 1;
        }
        let first = self.next;
        while self.forces.get(self.next).is_some_and(|f| f.pair == pair) {
            self.next += 1;
        }
        first..self.next
    }
}
