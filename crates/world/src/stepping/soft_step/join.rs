//! What chunks of pairs found, one behind the other: of one chunk as it lies, of several copied by the workers, each a part.

use super::SoftStep;
use super::face::Met;
use super::find::Found;
use super::memory::Seen;
use super::tally::Tally;
use crate::narrow_phase::Chunk;
use carom_geometry::Geometry;
use carom_math::Workers;
use carom_solver::soft::Patch;
use std::mem::swap;

impl<S: Geometry> SoftStep<S> {
    /// Gives the lists back to the one chunk that they came from, which writes them anew where they lie.
    pub(super) fn give_back(&mut self) {
        let mut parts = self.found.parts();
        if let (Some(chunk), None) = (parts.next(), parts.next()) {
            let found = chunk.found();
            swap(&mut self.met, &mut found.met);
            swap(&mut self.fresh, &mut found.fresh);
            swap(&mut self.patches, &mut found.patches);
        }
    }

    /// Takes in what the chunks found, in their order.
    pub(super) fn join(&mut self, workers: &Workers) {
        self.tally = Tally::default();
        self.kinds.clear();
        if self.found.parts().len() > 1 {
            return self.copy_all(workers);
        }
        let Some(found) = self.found.parts().map(Chunk::found).next() else {
            self.met.clear();
            self.fresh.clear();
            return self.patches.clear();
        };
        self.tally = found.tally;
        swap(&mut self.met, &mut found.met);
        swap(&mut self.fresh, &mut found.fresh);
        swap(&mut self.kinds, &mut found.kinds);
        swap(&mut self.patches, &mut found.patches);
    }

    /// Copies what several chunks found.
    fn copy_all(&mut self, workers: &Workers) {
        let all: Vec<&Found<S>> = self.found.parts().map(|chunk| &*chunk.found()).collect();
        let mut met = room_for(&mut self.met, all.iter().map(|found| found.met.as_slice()));
        let mut seen = room_for(&mut self.fresh, all.iter().map(|found| found.fresh.as_slice()));
        let (mut patches, mut pairs) = self.patches.room_for(met.len());
        let (mut copies, mut before) = (Vec::with_capacity(all.len()), 0);
        for from in &all {
            let (own_met, own_seen, own_patches, own_pairs);
            (own_met, met) = met.split_at_mut(from.met.len());
            (own_patches, patches) = patches.split_at_mut(from.met.len());
            (own_pairs, pairs) = pairs.split_at_mut(from.met.len());
            (own_seen, seen) = seen.split_at_mut(from.fresh.len());
            let (to, patches) = ((own_met, own_seen), (own_patches, own_pairs));
            copies.push(Part { from, kinds: self.kinds.len() as u32, before, to, patches });
            self.tally.join(&from.tally);
            self.kinds.extend_from_slice(&from.kinds);
            before += from.fresh.len() as u32;
        }
        workers.share(copies, Part::copy);
        let mut first = 0;
        for found in all {
            self.patches.take_rare(first, &found.patches);
            first += found.met.len();
        }
    }
}

/// A list as long as some together. What was there is not forgotten first, to be written once.
fn room_for<'a, T: Clone + 'a>(list: &mut Vec<T>, lists: impl Iterator<Item = &'a [T]> + Clone) -> &mut [T] {
    match lists.clone().flatten().next() {
        Some(one) => list.resize(lists.map(<[T]>::len).sum(), one.clone()),
        None => list.clear(),
    }
    list
}

/// A chunk's part of the lists.
struct Part<'a, S: Geometry> {
    from: &'a Found<S>,
    /// Coefficients, and faces seen anew, of the chunks before.
    kinds: u32,
    before: u32,
    to: (&'a mut [Met<S>], &'a mut [Seen<S>]),
    patches: (&'a mut [Patch<S>], &'a mut [(u32, u32)]),
}

impl<S: Geometry> Part<'_, S> {
    fn copy(&mut self) {
        let (met, seen) = &mut self.to;
        self.patches.0.copy_from_slice(self.from.patches.list());
        self.patches.1.copy_from_slice(&self.from.patches.pairs);
        seen.copy_from_slice(&self.from.fresh);
        for (to, met) in met.iter_mut().zip(&self.from.met) {
            *to = *met;
            to.kind += self.kinds;
            to.seen += if met.again { 0 } else { self.before };
        }
    }
}
