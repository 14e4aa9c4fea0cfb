//! Pairs that may touch in the step ahead, and their contact points: who is remembered to be apart is not looked at, and shapes that
//! go abreast are looked at side by side. Knows no scheme.

use crate::ahead::Couple;
use crate::meeting::Meeting;
use crate::remembered::Remembered;
use carom_geometry::{ABREAST, ContactPoint, Geometry, Guess, Look};
use carom_math::Pose;
use std::ops::Range;

/// Two bodies that may touch in the step ahead.
pub struct Near<'a, S: Geometry> {
    /// The bodies.
    pub couple: Couple<'a, S>,
    colliders: [&'a S::Collider; 2],
    poses: [&'a Pose<S>; 2],
    /// What is remembered of the pair.
    remembered: Option<&'a Remembered>,
    /// Ways that points of both surfaces have behind them \[m\].
    ways: f64,
    /// Contacts are looked for up to this gap \[m\].
    margin: f64,
}

impl<S: Geometry> Near<'_, S> {
    /// Appends their contact points.
    pub fn contacts(&self, out: &mut Vec<ContactPoint<S>>) {
        if !self.are_apart() {
            self.points(out);
        }
    }

    /// Whether what is remembered of them says that they have none.
    #[inline(always)]
    fn are_apart(&self) -> bool {
        self.remembered.is_some_and(|remembered| remembered.is_apart(self.ways, self.margin))
    }

    /// Appends the contact points of a pair that may have some.
    fn points(&self, out: &mut Vec<ContactPoint<S>>) {
        let ([a, b], [pose_a, pose_b]) = (self.colliders, self.poses);
        let Some(remembered) = self.remembered else {
            return S::contacts(a, pose_a, b, pose_b, self.margin, out);
        };
        let mut guess = remembered.guess::<S>();
        S::contacts_near((a, pose_a), (b, pose_b), self.margin, &mut guess, out);
        remembered.learn(&guess, self.ways);
    }
}

/// A pair that may touch in the step ahead, by its places in the columns.
#[derive(Clone, Copy)]
pub(crate) struct Asked {
    pub i: u32,
    pub j: u32,
    /// Its place among the pairs.
    pub place: usize,
    /// Contacts are looked for up to this gap \[m\].
    pub margin: f64,
}

/// Pairs that may touch in the step ahead, in their order.
pub struct Nears<'a, S: Geometry> {
    pub(crate) asked: &'a [Asked],
    pub(crate) meeting: &'a Meeting<'a, S>,
    pub(crate) colliders: &'a [S::Collider],
    pub(crate) remembered: &'a [Remembered],
}

impl<'a, S: Geometry> Nears<'a, S> {
    /// How many they are.
    pub fn count(&self) -> usize {
        self.asked.len()
    }
    /// The bodies of one.
    #[inline(always)]
    pub fn couple(&self, k: usize) -> Couple<'a, S> {
        let Asked { i, j, .. } = self.asked[k];
        self.meeting.couple(i as usize, j as usize)
    }
    /// A speed that the surfaces of one at least come towards each other with, as [`Meeting::surely_closing`] has it \[m/s\].
    #[inline(always)]
    pub(crate) fn surely_closing(&self, k: usize) -> f64 {
        self.meeting.surely_closing(&self.couple(k), self.asked[k].margin)
    }
    /// The place of one among all pairs.
    #[inline]
    pub fn place(&self, k: usize) -> usize {
        self.asked[k].place
    }
    /// One of them.
    #[inline]
    pub fn near(&self, k: usize) -> Near<'a, S> {
        let Asked { i, j, place, margin } = self.asked[k];
        let (i, j, columns) = (i as usize, j as usize, self.meeting.columns);
        Near {
            couple: self.meeting.couple(i, j),
            colliders: [&self.colliders[i], &self.colliders[j]],
            poses: [&columns.poses[i], &columns.poses[j]],
            remembered: self.remembered.get(place),
            ways: columns.ways[i] + columns.ways[j],
            margin,
        }
    }
}

/// Contact points of some pairs.
pub(crate) struct Points<S: Geometry> {
    all: Vec<ContactPoint<S>>,
    /// Where those of each pair are.
    places: Vec<Range<usize>>,
}

impl<S: Geometry> Default for Points<S> {
    fn default() -> Self {
        Points { all: Vec::new(), places: Vec::new() }
    }
}

impl<S: Geometry> Points<S> {
    /// Those of one of the pairs.
    #[inline]
    pub fn of(&self, k: usize) -> &[ContactPoint<S>] {
        &self.all[self.places[k].clone()]
    }

    /// Makes them those of some of these pairs. Shapes of one kind are looked at side by side.
    pub fn look(&mut self, nears: &Nears<'_, S>, pairs: impl ExactSizeIterator<Item = usize>) {
        self.all.clear();
        self.places.clear();
        self.places.resize(pairs.len(), 0..0);
        let (mut waiting, mut count) = ([(0, 0); ABREAST], 0);
        for (place, k) in pairs.enumerate() {
            let near = nears.near(k);
            if near.are_apart() {
                continue;
            }
            if !S::go_abreast(near.colliders[0], near.colliders[1]) {
                let first = self.all.len();
                near.points(&mut self.all);
                self.places[place] = first..self.all.len();
                continue;
            }
            waiting[count] = (place, k);
            count += 1;
            if count == ABREAST {
                self.look_abreast(nears, &waiting);
                count = 0;
            }
        }
        self.look_abreast(nears, &waiting[..count]);
    }

    /// Adds those of at most four pairs, by their places here and among all, that go abreast.
    fn look_abreast(&mut self, nears: &Nears<'_, S>, waiting: &[(usize, usize)]) {
        let Some(last) = waiting.last() else { return };
        let near = |k: usize| nears.near(waiting.get(k).unwrap_or(last).1);
        let some: [Near<'_, S>; ABREAST] = std::array::from_fn(near);
        let looks = some.each_ref().map(|near| Look {
            colliders: near.colliders,
            poses: near.poses,
            margin: near.margin,
        });
        let mut first = self.all.len();
        let told = S::contacts_abreast(&looks[..waiting.len()], &mut self.all);
        for ((told, near), (place, _)) in told.iter().zip(&some).zip(waiting) {
            self.places[*place] = first..told.end;
            first = told.end;
            if let Some(remembered) = near.remembered {
                remembered.learn(&Guess::<S> { direction: None, apart: told.apart }, near.ways);
            }
        }
    }
}
