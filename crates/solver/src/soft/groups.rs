//! Groups of islands: each is taken through a whole step before the next, so that what a step reads over and over is near. Bodies
//! of a group have their records side by side. No bit of a motion depends on groups: a patch has the colour that it would have among
//! all, and in a colour no patch asks another. Where obstacles move, which all groups would have to wait for, and where sums over
//! everything lead sweeps on, all are one group. Knows of patches only whom they join.

use crate::islands::Partition;
use std::ops::Range;

/// Patches of a group: with fewer packs are less full, more leave what is near.
const SIZE: usize = 600;

/// Fewer patches than this are one group: where much moves groups are found anew in every step, and what they spare is less until
/// packs go out to memory.
const MANY: usize = 30 * SIZE;

/// Records by group.
pub struct Groups {
    /// Patches of a group, and of how many they are made.
    size: usize,
    many: usize,
    /// What groups were found for: whom patches join, by records in the order that bodies come in, how many of these there are, and
    /// whether groups are wanted.
    pairs: Vec<(u32, u32)>,
    asked: (usize, bool),
    partition: Partition,
    /// Of each island, by its first record: its patches, then its group.
    of_island: Vec<u32>,
    /// Record of each body that comes; none where bodies keep their order.
    places: Vec<u32>,
    /// The first record of each group, and the end.
    starts: Vec<u32>,
}

impl Default for Groups {
    fn default() -> Self {
        Groups::of_size(SIZE, MANY)
    }
}

impl Groups {
    /// Groups of about so many patches, where there are `many`.
    pub fn of_size(size: usize, many: usize) -> Self {
        Groups {
            size,
            many,
            pairs: Vec::new(),
            asked: (0, false),
            partition: Partition::default(),
            of_island: Vec::new(),
            places: Vec::new(),
            starts: vec![0, 0],
        }
    }

    /// All records are one group.
    pub fn make_one(&mut self, records: usize) {
        self.pairs.clear();
        self.asked = (records, false);
        self.places.clear();
        self.starts.clear();
        self.starts.extend([0, records as u32]);
    }

    /// Finds groups for patches between these records, numbered as bodies come; record 0 stands still, and is the only obstacle
    /// where groups are wanted. Tells the place of each record where these change, and writes it into the pairs.
    pub fn find(&mut self, pairs: &mut [(u32, u32)], records: usize, wanted: bool) -> &[u32] {
        let wanted = wanted && pairs.len() >= self.many;
        if !wanted {
            self.make_one(records);
            return &self.places;
        }
        if self.asked != (records, wanted) || self.pairs != pairs {
            self.asked = (records, wanted);
            self.pairs.clear();
            self.pairs.extend_from_slice(pairs);
            self.part(pairs, records);
        }
        if !self.places.is_empty() {
            for (a, b) in pairs {
                (*a, *b) = (self.places[*a as usize], self.places[*b as usize]);
            }
        }
        &self.places
    }

    /// Puts islands into groups, in the order of their first bodies: small ones together, large ones alone.
    fn part(&mut self, pairs: &[(u32, u32)], records: usize) {
        self.partition.reset(records);
        for (a, b) in pairs.iter().filter(|(a, b)| *a != 0 && *b != 0) {
            self.partition.join(*a as usize, *b as usize);
        }
        self.of_island.clear();
        self.of_island.resize(records, 0);
        for (a, b) in pairs {
            let island = self.partition.root(if *a != 0 { *a } else { *b } as usize);
            self.of_island[island] += 1;
        }
        let (mut groups, mut open, mut patches) = (0_u32, None, 0);
        for island in 1..records {
            if self.partition.root(island) != island {
                continue;
            }
            let own = self.of_island[island] as usize;
            if own >= self.size {
                self.of_island[island] = groups;
                groups += 1;
                continue;
            }
            if open.is_none() || patches >= self.size {
                (open, patches) = (Some(groups), 0);
                groups += 1;
            }
            self.of_island[island] = open.unwrap_or_default();
            patches += own;
        }
        self.place(records, groups.max(1) as usize);
    }

    /// Gives records places group by group, in each in the order that they come in. Record 0, which all groups read, stays the first;
    /// where there are several it is nobody's, for who wrote it would do so while others read it.
    fn place(&mut self, records: usize, groups: usize) {
        let group = |groups: &mut Self, record: usize| match record {
            0 => 0,
            _ => groups.of_island[groups.partition.root(record)] as usize,
        };
        let mut next = vec![0_u32; groups + 1];
        (0..records).for_each(|record| next[group(self, record) + 1] += 1);
        (0..groups).for_each(|k| next[k + 1] += next[k]);
        self.starts.clone_from(&next);
        self.places.clear();
        for record in 0..records {
            let place = &mut next[group(self, record)];
            self.places.push(*place);
            *place += 1;
        }
        if groups == 1 {
            self.places.clear();
        } else {
            self.starts[0] = 1;
        }
    }

    /// Records of each group.
    pub fn records(&self) -> impl ExactSizeIterator<Item = Range<usize>> + '_ {
        self.starts.windows(2).map(|ends| ends[0] as usize..ends[1] as usize)
    }

    /// Sorts patches between records in their places by groups, each in the order that they are given in; tells the end of each
    /// group's.
    pub fn sort(&self, pairs: &[(u32, u32)], order: &mut Vec<u32>, ends: &mut Vec<usize>) {
        let groups = self.starts.len() - 1;
        ends.clear();
        order.clear();
        if groups == 1 {
            order.extend(0..pairs.len() as u32);
            ends.push(pairs.len());
            return;
        }
        // the record that moves is the larger one of a pair with the obstacle
        let group = |(a, b): (u32, u32)| self.starts.partition_point(|start| *start <= a.max(b)) - 1;
        ends.resize(groups + 1, 0);
        pairs.iter().for_each(|pair| ends[group(*pair) + 1] += 1);
        (0..groups).for_each(|k| ends[k + 1] += ends[k]);
        order.resize(pairs.len(), 0);
        for (k, pair) in pairs.iter().enumerate() {
            let next = &mut ends[group(*pair)];
            order[*next] = k as u32;
            *next += 1;
        }
        // what was a group's start is its end now
        ends.truncate(groups);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of so many bodies on the obstacle, the bodies of all columns in turn.
    fn columns(heights: &[u32]) -> (Vec<(u32, u32)>, usize) {
        let mut pairs = Vec::new();
        let (mut below, mut record) = (vec![0; heights.len()], 0);
        for level in 0..heights.iter().copied().max().unwrap_or(0) {
            for (column, _) in heights.iter().enumerate().filter(|(_, height)| level < **height) {
                record += 1;
                pairs.push((below[column], record));
                below[column] = record;
            }
        }
        (pairs, record as usize + 1)
    }

    #[test]
    fn small_islands_go_together_and_large_ones_alone() {
        let (given, records) = columns(&[4, 25, 3, 2, 12, 1, 9]);
        let mut groups = Groups::of_size(8, 32);
        let mut pairs = given.clone();
        let places = groups.find(&mut pairs, records, true).to_vec();
        let mut sorted = places.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..records as u32), "each record has a place of its own");
        assert_eq!(places[0], 0, "the obstacle keeps its record");
        let sizes: Vec<usize> = groups.records().map(|records| records.len()).collect();
        // 4, 3 and 2; 25; 12; 1 alone, for 9 is large; the obstacle is nobody's
        assert_eq!(sizes, [9, 25, 12, 1, 9]);
        assert!(groups.records().all(|records| records.start > 0));
        let (mut order, mut ends) = (Vec::new(), Vec::new());
        groups.sort(&pairs, &mut order, &mut ends);
        let mut first = 0;
        for (records, end) in groups.records().zip(&ends) {
            let own = &order[first..*end];
            assert!(own.is_sorted(), "in the order that they are given in");
            for (a, b) in own.iter().map(|k| pairs[*k as usize]) {
                assert!([a, b].iter().all(|i| *i == 0 || records.contains(&(*i as usize))));
            }
            first = *end;
        }
        assert_eq!(first, given.len());
        // found again, without a search, for the same patches
        let mut again = given.clone();
        assert_eq!(groups.find(&mut again, records, true), places);
        assert_eq!(again, pairs);
    }

    #[test]
    fn few_patches_and_those_that_want_none_are_one_group() {
        let (given, records) = columns(&[4, 25, 3, 2, 12, 1, 9]);
        for (size, wanted) in [(8, false), (20, true)] {
            let (mut groups, mut pairs) = (Groups::of_size(size, 4 * size), given.clone());
            assert!(groups.find(&mut pairs, records, wanted).is_empty());
            assert_eq!(pairs, given);
            assert!(groups.records().eq(std::iter::once(0..records)));
        }
    }
}
