//! Patches carried from step to step, in the order of their pairs. A pair is named by its bodies' serials, a
//! point by its contact's id; friction is kept in world axes, so that a turned frame starts from the same force.
//! In memory a patch has the numbers of its space; in files it has those of any.

use carom_math::{Column, Several, Space};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Forces of a patch at the end of a step.
#[derive(Clone, Copy)]
pub struct PatchForce<S: Space> {
    /// Normal forces of its points \[N\].
    pub normal: S::Points<f64>,
    /// Friction on body a in world axes \[N\].
    pub friction: S::Vector,
    /// Friction's torque about the normal \[N m\].
    pub twist: f64,
    /// Rolling friction on body a in world axes \[N m\].
    pub rolling: S::Spin,
}

impl<S: Space> PatchForce<S> {
    /// No forces.
    pub fn zero() -> Self {
        let (friction, rolling) = (S::Vector::ZERO, S::Spin::ZERO);
        PatchForce { normal: S::Points::all(0.0), friction, twist: 0.0, rolling }
    }
}

/// A patch as it was when the narrow phase looked at its pair.
#[derive(Clone, Copy)]
pub struct Seen<S: Space> {
    /// Serials of bodies a and b.
    pub pair: (u64, u64),
    /// Points of the patch.
    pub count: usize,
    /// Contact ids of its points.
    pub ids: S::Points<u64>,
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

impl<S: Space> Seen<S> {
    /// Contact ids of its points; a count from a file may be any.
    #[inline]
    pub fn names(&self) -> &[u64] {
        let ids = self.ids.slice();
        &ids[..self.count.min(ids.len())]
    }
}

/// What is remembered of patches, in the order of their pairs. Where all of a step stand, what was seen of them is that of the
/// step before, and not copied.
#[derive(Clone, Serialize, Deserialize)]
#[serde(from = "Vec<Filed>", into = "Vec<Filed>", bound = "")]
pub struct PatchList<S: Space> {
    /// Forces at the end of the step.
    pub forces: Vec<PatchForce<S>>,
    /// The patches; as many.
    pub seen: Arc<Vec<Seen<S>>>,
}

impl<S: Space> Default for PatchList<S> {
    fn default() -> Self {
        PatchList { forces: Vec::new(), seen: Arc::default() }
    }
}

impl<S: Space> PatchList<S> {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.forces.is_empty()
    }
    /// Forgets them.
    pub fn clear(&mut self) {
        self.forces.clear();
        if !self.seen.is_empty() {
            self.seen = Arc::default();
        }
    }
    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = (&Seen<S>, &PatchForce<S>)> {
        self.seen.iter().zip(&self.forces)
    }
    /// Keeps those that stay, by their places.
    pub fn retain(&mut self, stays: impl Fn(usize) -> bool) {
        let mut places = 0..self.forces.len();
        self.forces.retain(|_| places.next().is_some_and(&stays));
        let mut places = 0..self.seen.len();
        Arc::make_mut(&mut self.seen).retain(|_| places.next().is_some_and(&stays));
    }
    /// Adds one behind them, whose pair comes last.
    pub fn push(&mut self, seen: Seen<S>, force: PatchForce<S>) {
        self.forces.push(force);
        Arc::make_mut(&mut self.seen).push(seen);
    }
    /// Adds those of another list.
    pub fn merge(&mut self, more: &Self) {
        if more.is_empty() {
            return;
        }
        let mut all: Vec<(Seen<S>, PatchForce<S>)> =
            self.iter().chain(more.iter()).map(|(s, f)| (*s, *f)).collect();
        all.sort_by_key(|(seen, _)| seen.pair);
        let (seen, forces) = all.into_iter().unzip();
        (self.seen, self.forces) = (Arc::new(seen), forces);
    }
}

impl<S: Space> std::fmt::Debug for PatchList<S> {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        Vec::<Filed>::from(self.clone()).fmt(out)
    }
}

impl<S: Space> PartialEq for PatchList<S> {
    fn eq(&self, other: &Self) -> bool {
        Vec::<Filed>::from(self.clone()) == Vec::<Filed>::from(other.clone())
    }
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

impl Filed {
    fn of<S: Space>(seen: &Seen<S>, force: &PatchForce<S>) -> Self {
        let points = seen.points.slice();
        Filed {
            pair: seen.pair,
            count: seen.count,
            ids: filled(seen.ids.slice()),
            normal: filled(force.normal.slice()),
            friction: filled(force.friction.as_slice()),
            twist: force.twist,
            rolling: filled(force.rolling.as_slice()),
            seen: FiledSight {
                normal: filled(seen.normal.as_slice()),
                points: std::array::from_fn(|i| points.get(i).map_or([0.0; 3], |p| filled(p.as_slice()))),
                gaps: filled(seen.gaps.slice()),
                places: seen.places.map(|place| filled(place.as_slice())),
                attitudes: [filled(seen.attitudes[0].slice()), filled(seen.attitudes[1].slice())],
            },
        }
    }

    fn parts<S: Space>(&self) -> (Seen<S>, PatchForce<S>) {
        let mut points = S::Points::all(S::Vector::ZERO);
        for (to, point) in points.slice_mut().iter_mut().zip(&self.seen.points) {
            *to = column(point);
        }
        let seen = Seen {
            pair: self.pair,
            count: self.count,
            ids: first(&self.ids),
            normal: column(&self.seen.normal),
            points,
            gaps: first(&self.seen.gaps),
            places: [column(&self.seen.places[0]), column(&self.seen.places[1])],
            attitudes: [first(&self.seen.attitudes[0]), first(&self.seen.attitudes[1])],
        };
        let force = PatchForce {
            normal: first(&self.normal),
            friction: column(&self.friction),
            twist: self.twist,
            rolling: column(&self.rolling),
        };
        (seen, force)
    }
}

impl<S: Space> From<PatchList<S>> for Vec<Filed> {
    fn from(list: PatchList<S>) -> Self {
        list.iter().map(|(seen, force)| Filed::of(seen, force)).collect()
    }
}

impl<S: Space> From<Vec<Filed>> for PatchList<S> {
    fn from(all: Vec<Filed>) -> Self {
        let (seen, forces) = all.iter().map(Filed::parts).unzip();
        PatchList { forces, seen: Arc::new(seen) }
    }
}

/// Walks along remembered patches beside pairs that come in the same order.
pub struct Walk<'a, S: Space> {
    seen: &'a [Seen<S>],
    next: usize,
}

impl<'a, S: Space> Walk<'a, S> {
    /// From a place, or from where a pair may first be.
    pub fn from(seen: &'a [Seen<S>], place: Option<usize>, pair: (u64, u64)) -> Self {
        let next = place.unwrap_or_else(|| seen.partition_point(|patch| patch.pair < pair));
        Walk { seen, next }
    }
    /// Where it stands.
    pub fn place(&self) -> usize {
        self.next
    }
    /// Places of the patches that a pair had.
    pub fn of(&mut self, pair: (u64, u64)) -> std::ops::Range<usize> {
        while self.seen.get(self.next).is_some_and(|patch| patch.pair < pair) {
            self.next += 1;
        }
        let first = self.next;
        while self.seen.get(self.next).is_some_and(|patch| patch.pair == pair) {
            self.next += 1;
        }
        first..self.next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use carom_math::Planar;

    fn list(pairs: &[u64]) -> PatchList<Planar> {
        let mut list = PatchList::default();
        for serial in pairs {
            let zeros = [0.0; 4];
            let seen = FiledSight {
                normal: [0.0; 3],
                points: [[0.0; 3]; 4],
                gaps: zeros,
                places: [[0.0; 3]; 2],
                attitudes: [zeros; 2],
            };
            let (pair, ids) = ((*serial, serial + 1), [*serial; 4]);
            let (friction, rolling) = ([0.0; 3], [0.0; 3]);
            let normal = [*serial as f64; 4];
            let filed = Filed { pair, count: 1, ids, normal, friction, twist: 0.0, rolling, seen };
            let (seen, force) = filed.parts();
            list.push(seen, force);
        }
        list
    }

    fn serials(list: &PatchList<Planar>) -> Vec<(u64, f64)> {
        list.iter().map(|(seen, force)| (seen.pair.0, force.normal[0])).collect()
    }

    #[test]
    fn patches_keep_their_forces_when_others_come_and_go() {
        let mut all = list(&[1, 4, 6]);
        let before = all.seen.clone();
        all.merge(&list(&[2, 5]));
        assert_eq!(serials(&all), [(1, 1.0), (2, 2.0), (4, 4.0), (5, 5.0), (6, 6.0)]);
        all.retain(|k| k % 2 == 0);
        assert_eq!(serials(&all), [(1, 1.0), (4, 4.0), (6, 6.0)]);
        assert_eq!(before.len(), 3, "who has the list still keeps it");
        assert_eq!(PatchList::from(Vec::<Filed>::from(all.clone())), all);
        all.clear();
        assert!(all.is_empty() && all.seen.is_empty());
    }
}
