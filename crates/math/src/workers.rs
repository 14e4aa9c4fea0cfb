//! Workers: threads that take turns at work in stages. A stage is cut into chunks whose size no number of workers decides,
//! and what chunks found is joined in their order, so that one worker and thirty give the same bits. Each begins with the
//! chunks of its own share, which are near it from the stage before, and whoever is free takes from the others'. A stage
//! begins when the one before is done, not when all workers have come, so that a worker that another process keeps away
//! delays nobody. Between stages workers wait by giving their time away, between regions they sleep after a while. One
//! worker is the same text without threads. Knows no physics.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// A handle on threads that are kept while handles are; one worker, the default, has none and works where it is called.
#[derive(Clone, Debug, Default)]
pub struct Workers(Option<Arc<threads::Threads>>);

impl Workers {
    /// Most workers that can be had \[1\].
    pub const MOST: usize = 256;

    /// Chunks that nobody is called for \[1\].
    const FEW: usize = 3;

    /// So many workers, whoever calls among them. In a page there is one whatever is asked, with the same bits.
    ///
    /// # Errors
    /// What the system says when it has no more threads.
    pub fn new(count: usize) -> Result<Self, String> {
        let threads = if count > 1 { Some(Arc::new(threads::Threads::new(count)?)) } else { None };
        Ok(Workers(threads))
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.0.as_ref().map_or(1, |threads| threads.count)
    }

    /// One worker has nobody to share with.
    pub fn is_alone(&self) -> bool {
        self.0.is_none()
    }

    /// So few items are done before others have come.
    fn is_for_one(&self, items: usize, size: usize) -> bool {
        self.is_alone() || items <= Self::FEW * size
    }

    /// Stage s of the plan has `plan[s]` chunks. Every worker that comes takes part by a call of `part` with its turns, and
    /// each chunk is a turn of one of them. A worker that panics ends the region, and the caller panics.
    pub fn stages(&self, plan: &[u32], part: impl Fn(Turns<'_>) + Sync) {
        self.stages_beside(plan, &part, &part);
    }

    /// The same where the caller takes part in a way of its own, with what only its thread may touch.
    pub fn stages_beside(&self, plan: &[u32], part: impl Fn(Turns<'_>) + Sync, own: impl FnOnce(Turns<'_>)) {
        match &self.0 {
            Some(threads) if plan.iter().any(|chunks| *chunks > 1) => {
                let board = Board::new(plan, threads.count);
                let turns = |seat| Turns::new(plan, Some(&board), seat);
                threads.together(&|seat| part(turns(seat)), || own(turns(0)));
            }
            _ => own(Turns::new(plan, None, 0)),
        }
    }

    /// Works over items in chunks of `size`: `work` gets the place of a chunk's first item, its items, and a memory as it was left;
    /// the memories are the parts of `memory` then, in the order of the chunks. One worker has one chunk, and so have few items.
    pub fn over<I: Sync, M: Default + Send>(
        &self,
        items: &[I],
        size: usize,
        memory: &mut Memory<M>,
        work: impl Fn(usize, &[I], &mut M) + Sync,
    ) {
        let size = if self.is_for_one(items.len(), size) { items.len().max(1) } else { size };
        let count = items.len().div_ceil(size);
        while memory.all.len() < count {
            memory.all.push(Mutex::default());
        }
        memory.used = count;
        let memories = &memory.all[..count];
        self.stages(&[count as u32], |turns| {
            for (_, chunk) in turns {
                let first = chunk * size;
                let end = items.len().min(first + size);
                work(first, &items[first..end], &mut lock(&memories[chunk]));
            }
        });
    }

    /// The same, and `join` gets the memories one after another.
    pub fn chunks<I: Sync, M: Default + Send>(
        &self,
        items: &[I],
        size: usize,
        memory: &mut Memory<M>,
        work: impl Fn(usize, &[I], &mut M) + Sync,
        join: impl FnMut(&mut M),
    ) {
        self.over(items, size, memory, work);
        memory.parts().for_each(join);
    }

    /// Works on items in chunks of `size`: `work` gets the place of a chunk's first item, and its items. Few are one chunk.
    pub fn each<T: Send>(&self, items: &mut [T], size: usize, work: impl Fn(usize, &mut [T]) + Sync) {
        if self.is_for_one(items.len(), size) {
            return work(0, items);
        }
        let parts = items.chunks_mut(size).enumerate().map(|(k, items)| (k * size, items)).collect();
        self.share(parts, |(first, items)| work(*first, items));
    }

    /// Whether all of some items are so: chunks of `size` are asked until one says no. Few are one chunk.
    pub fn all<I: Sync>(&self, items: &[I], size: usize, is_so: impl Fn(&I) -> bool + Sync) -> bool {
        if self.is_for_one(items.len(), size) {
            return items.iter().all(is_so);
        }
        let one_is_not = AtomicBool::new(false);
        self.stages(&[items.len().div_ceil(size) as u32], |turns| {
            for (_, chunk) in turns {
                let own = &items[chunk * size..items.len().min((chunk + 1) * size)];
                if !one_is_not.load(Ordering::Relaxed) && !own.iter().all(&is_so) {
                    one_is_not.store(true, Ordering::Relaxed);
                }
            }
        });
        !one_is_not.into_inner()
    }

    /// Works on columns of something that is cut into stretches: each has so many of some of its items, ascending, and beside each
    /// item one of a list. Few are one stretch.
    pub fn along<C: Cut, T: Send>(
        &self,
        (columns, some, beside): (C, &[u32], &mut [T]),
        size: usize,
        work: impl Fn(&mut C, u32, &mut T) + Sync,
    ) {
        let each = |columns: &mut C, own: &[u32], beside: &mut [T]| {
            own.iter().zip(beside).for_each(|(item, beside)| work(columns, *item, beside));
        };
        if self.is_for_one(some.len(), size) {
            let mut columns = columns;
            return each(&mut columns, some, beside);
        }
        let (mut parts, mut rest) = (Vec::with_capacity(some.len().div_ceil(size)), columns);
        for (own, beside) in some.chunks(size).zip(beside.chunks_mut(size)) {
            let stretch;
            (stretch, rest) = rest.cut_behind(own[own.len() - 1] as usize);
            parts.push((stretch, own, beside));
        }
        self.share(parts, |(stretch, own, beside)| each(stretch, own, beside));
    }

    /// Works on parts of something, each for itself.
    pub fn share<P: Send>(&self, parts: Vec<P>, work: impl Fn(&mut P) + Sync) {
        let parts: Vec<_> = parts.into_iter().map(Mutex::new).collect();
        self.stages(&[parts.len() as u32], |turns| {
            for (_, part) in turns {
                work(&mut lock(&parts[part]));
            }
        });
    }
}

/// Columns of items that can be cut in two, for workers to write their own stretches.
pub trait Cut: Sized + Send {
    /// Up to an item, and what is behind it.
    fn cut_behind(self, item: usize) -> (Self, Self);
}

/// What chunks work in; kept from call to call, so that nothing is asked of the heap.
#[derive(Debug)]
pub struct Memory<M> {
    all: Vec<Mutex<M>>,
    /// How many of them the last call took.
    used: usize,
}

impl<M> Default for Memory<M> {
    fn default() -> Self {
        Memory { all: Vec::new(), used: 0 }
    }
}

impl<M> Memory<M> {
    /// The memories that the last call worked in, in the order of its chunks.
    pub fn parts(&mut self) -> impl ExactSizeIterator<Item = &mut M> {
        self.all[..self.used]
            .iter_mut()
            .map(|memory| memory.get_mut().unwrap_or_else(PoisonError::into_inner))
    }
}

/// A lock that nobody waits for: a chunk is one worker's. After a panic the memory is as good as before.
pub fn lock<M>(memory: &Mutex<M>) -> std::sync::MutexGuard<'_, M> {
    memory.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Where a region stands.
struct Board {
    /// Each worker's share of the open stage: what it did in stages before is near it.
    shares: Vec<Share>,
    /// Chunks of the open stage that are done.
    done: AtomicU32,
}

/// The open stage, and below it the next chunk of a share that nobody took. Apart from the others in memory.
#[derive(Default)]
#[repr(align(128))]
struct Share(AtomicU64);

/// A stage that no plan has.
const OVER: u64 = u64::MAX;

impl Board {
    fn new(plan: &[u32], workers: usize) -> Self {
        let board =
            Board { shares: (0..workers).map(|_| Share::default()).collect(), done: AtomicU32::new(0) };
        board.open(plan, 0);
        board
    }
    /// First chunk of a share of a stage.
    fn first(&self, chunks: u32, share: usize) -> u32 {
        (u64::from(chunks) * share as u64 / self.shares.len() as u64) as u32
    }
    /// Opens a stage, or the first one after it that has chunks. Turns may begin while it does; the last share, which is opened
    /// last, is never empty, so that the stage is not over before it is open.
    fn open(&self, plan: &[u32], stage: usize) {
        let empty = plan[stage..].iter().take_while(|chunks| **chunks == 0).count();
        let stage = stage + empty;
        let chunks = plan.get(stage).copied().unwrap_or(0);
        for (k, share) in self.shares.iter().enumerate() {
            share.0.store((stage as u64) << 32 | u64::from(self.first(chunks, k)), Ordering::Release);
        }
    }
}

/// The turns of a worker, as (stage, chunk). A stage's turns begin when all of the one before are done, whoever did them.
pub struct Turns<'a> {
    plan: &'a [u32],
    /// None of who is alone.
    board: Option<&'a Board>,
    /// Whose share it takes first.
    seat: usize,
    stage: usize,
    /// Alone: the stage's next chunk.
    next: u32,
    /// A chunk was taken and is not done.
    holds: bool,
}

impl Iterator for Turns<'_> {
    type Item = (usize, usize);

    #[inline]
    fn next(&mut self) -> Option<(usize, usize)> {
        self.next_while(|| {})
    }
}

impl<'a> Turns<'a> {
    /// Looks for the next chunk to come before it gives its time away \[1\]: some microseconds, which a chunk of others takes. Who gave
    /// it away comes late.
    const PATIENCE: u32 = 200;

    fn new(plan: &'a [u32], board: Option<&'a Board>, seat: usize) -> Self {
        Turns { plan, board, seat, stage: 0, next: 0, holds: false }
    }

    /// Whose turns they are: 0 is the caller.
    pub fn seat(&self) -> usize {
        self.seat
    }

    /// The next turn; `waits` is called at every look for it that finds others at work.
    #[inline]
    pub fn next_while(&mut self, waits: impl FnMut()) -> Option<(usize, usize)> {
        if let Some(board) = self.board {
            return self.among(board, waits);
        }
        while self.next >= *self.plan.get(self.stage)? {
            (self.stage, self.next) = (self.stage + 1, 0);
        }
        self.next += 1;
        Some((self.stage, self.next as usize - 1))
    }

    #[inline(never)]
    fn among(&mut self, board: &Board, mut waits: impl FnMut()) -> Option<(usize, usize)> {
        if std::mem::take(&mut self.holds) {
            // what all did in this stage is seen by who opens the next, and by who takes a turn in that
            let done = board.done.fetch_add(1, Ordering::AcqRel) + 1;
            if done == self.plan[self.stage] {
                board.done.store(0, Ordering::Relaxed);
                board.open(self.plan, self.stage + 1);
            }
        }
        let mut looks = 0;
        loop {
            for k in 0..board.shares.len() {
                let share = (self.seat + k) % board.shares.len();
                let place = &board.shares[share].0;
                let ticket = place.load(Ordering::Acquire);
                let (stage, chunk) = ((ticket >> 32) as usize, ticket as u32);
                let end = board.first(*self.plan.get(stage)?, share + 1);
                let (taken, seen) = (Ordering::Acquire, Ordering::Relaxed);
                if chunk < end && place.compare_exchange(ticket, ticket + 1, taken, seen).is_ok() {
                    (self.stage, self.holds) = (stage, true);
                    return Some((stage, chunk as usize));
                }
            }
            waits();
            if looks < Self::PATIENCE {
                looks += 1;
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
    }
}

impl Drop for Turns<'_> {
    /// Who leaves with a chunk that is not done has panicked: nobody must wait for it.
    fn drop(&mut self) {
        if let (true, Some(board)) = (self.holds, self.board) {
            board.shares.iter().for_each(|share| share.0.store(OVER, Ordering::Release));
        }
    }
}

#[cfg(not(target_arch = "wasm32"))]
mod threads {
    use std::cell::Cell;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::{Duration, Instant};

    /// How long a worker that has nothing to do looks for work before it sleeps: to be woken takes a tenth of a millisecond,
    /// and a step has a dozen regions.
    const LINGERS: Duration = Duration::from_micros(300);

    /// Looks before a worker gives its time away \[1\].
    const PATIENCE: u32 = 40;

    /// Threads that sleep until they are called.
    #[derive(Debug)]
    pub struct Threads {
        /// Workers, the caller among them.
        pub count: usize,
        pool: rayon::ThreadPool,
        /// Who looks for work.
        awake: Arc<AtomicUsize>,
        /// A process that was forked off has the memory and not the threads.
        process: u32,
    }

    impl Threads {
        pub fn new(count: usize) -> Result<Self, String> {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(count - 1)
                .thread_name(|k| format!("carom {}", k + 1))
                .build()
                .map_err(|e| e.to_string())?;
            Ok(Threads { count, pool, awake: Arc::default(), process: std::process::id() })
        }

        /// Calls `part` once in every other worker with its seat, and `own` here, the seat of which is 0; comes back when all
        /// did, and panics when one did.
        pub fn together(&self, part: &(impl Fn(usize) + Sync), own: impl FnOnce()) {
            if std::process::id() != self.process {
                return own();
            }
            for _ in self.awake.load(Ordering::Relaxed)..self.count - 1 {
                let awake = Arc::clone(&self.awake);
                awake.fetch_add(1, Ordering::Relaxed);
                self.pool.spawn(move || linger(&awake));
            }
            let here = AtomicUsize::new(self.count - 1);
            self.pool.in_place_scope(|scope| {
                for _ in 1..self.count {
                    scope.spawn(|_| {
                        part(rayon::current_thread_index().map_or(0, |k| k + 1));
                        here.fetch_sub(1, Ordering::Release);
                    });
                }
                own();
                // what is left takes less than to sleep and be woken; who panicked is not waited for here
                let gone = || here.load(Ordering::Acquire) == 0;
                (0..100 * PATIENCE).any(|looks| gone() || wait(looks));
            });
        }
    }

    /// Waits for a moment; false, for more are to come.
    fn wait(looks: u32) -> bool {
        if looks < PATIENCE {
            std::hint::spin_loop()
        } else {
            std::thread::yield_now()
        }
        false
    }

    thread_local! {
        static IS_AWAKE: Cell<bool> = const { Cell::new(false) };
    }

    /// Takes part in what is called for until nothing was for a while.
    fn linger(awake: &AtomicUsize) {
        // one that looks for work may find this
        if !IS_AWAKE.replace(true) {
            let (mut last, mut looks) = (Instant::now(), 0);
            while last.elapsed() < LINGERS {
                if rayon::yield_now() == Some(rayon::Yield::Executed) {
                    (last, looks) = (Instant::now(), 0);
                } else {
                    wait(looks);
                    looks += 1;
                }
            }
            IS_AWAKE.set(false);
        }
        awake.fetch_sub(1, Ordering::Relaxed);
    }
}

#[cfg(target_arch = "wasm32")]
mod threads {
    /// None.
    #[derive(Debug)]
    pub struct Threads {
        /// Workers that were asked for.
        pub count: usize,
    }

    impl Threads {
        pub fn new(count: usize) -> Result<Self, String> {
            Ok(Threads { count })
        }
        pub fn together(&self, _part: &(impl Fn(usize) + Sync), own: impl FnOnce()) {
            own();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    const COUNTS: [usize; 5] = [1, 2, 3, 8, 32];

    #[test]
    fn every_chunk_is_one_turn_and_stages_come_one_after_another() {
        let plan = [3, 0, 1, 200, 0, 7];
        for count in COUNTS {
            let workers = Workers::new(count).unwrap();
            assert_eq!(workers.count(), count);
            for _ in 0..50 {
                let turns: Vec<Vec<AtomicUsize>> =
                    plan.iter().map(|n| (0..*n).map(|_| AtomicUsize::new(0)).collect()).collect();
                workers.stages(&plan, |mine| {
                    for (stage, chunk) in mine {
                        turns[stage][chunk].fetch_add(1, Ordering::Relaxed);
                        let before = turns[..stage].iter().flatten();
                        assert!(before.into_iter().all(|n| n.load(Ordering::Relaxed) == 1));
                    }
                });
                assert!(turns.iter().flatten().all(|n| n.load(Ordering::Relaxed) == 1));
            }
        }
    }

    #[test]
    fn chunks_are_joined_in_their_order() {
        let items: Vec<usize> = (0..1000).collect();
        for count in COUNTS {
            let (workers, mut memory) = (Workers::new(count).unwrap(), Memory::<Vec<usize>>::default());
            for _ in 0..20 {
                let mut out = Vec::new();
                let work = |first: usize, items: &[usize], out: &mut Vec<usize>| {
                    assert_eq!(first, items[0]);
                    out.extend(items.iter().filter(|i| *i % 3 == 0));
                };
                workers.chunks(&items, 7, &mut memory, work, |found| out.append(found));
                assert!(out.iter().copied().eq((0..1000).step_by(3)));
            }
            // parts are those of the last call
            workers.over(&items[..9], 3, &mut memory, |_, items, out| out.extend(items));
            assert!(memory.parts().flat_map(|out| out.drain(..)).eq(0..9));
            workers.chunks(&[], 7, &mut memory, |_, _: &[u8], _| unreachable!(), |_| unreachable!());
        }
    }

    #[test]
    fn each_item_is_worked_on_once() {
        for count in COUNTS {
            let mut items = vec![1; 500];
            let work = |first: usize, items: &mut [usize]| {
                for (k, item) in items.iter_mut().enumerate() {
                    *item += first + k;
                }
            };
            Workers::new(count).unwrap().each(&mut items, 16, work);
            assert!(items.iter().enumerate().all(|(k, item)| *item == k + 1));
        }
    }

    #[test]
    fn one_that_is_not_so_is_found_wherever_it_is() {
        let items: Vec<usize> = (0..500).collect();
        for count in COUNTS {
            let workers = Workers::new(count).unwrap();
            assert!(workers.all(&items, 16, |item| *item < 500) && workers.all(&items[..0], 16, |_| false));
            for bad in [0, 15, 16, 250, 499] {
                assert!(!workers.all(&items, 16, |item| *item != bad), "{bad} of {count} workers");
            }
        }
    }

    /// A stretch of a column.
    struct Stretch<'a>(usize, &'a mut [u32]);

    impl Cut for Stretch<'_> {
        fn cut_behind(self, item: usize) -> (Self, Self) {
            let (own, rest) = self.1.split_at_mut(item + 1 - self.0);
            (Stretch(self.0, own), Stretch(item + 1, rest))
        }
    }

    #[test]
    fn each_of_some_items_of_columns_is_worked_on_once() {
        let some: Vec<u32> = (0..900).filter(|i| i % 3 != 1).collect();
        for count in COUNTS {
            let (mut column, mut beside) = (vec![0; 1000], vec![0; some.len()]);
            let workers = Workers::new(count).unwrap();
            for items in [some.as_slice(), &some[..20], &[]] {
                column.fill(0);
                workers.along((Stretch(0, &mut column), items, &mut beside), 16, |own, i, beside| {
                    own.1[i as usize - own.0] += i + 1;
                    *beside = i;
                });
                let of = |i: u32| if items.contains(&i) { i + 1 } else { 0 };
                assert!((0..1000).all(|i| column[i as usize] == of(i)));
                assert_eq!(&beside[..items.len()], items);
            }
        }
    }

    #[test]
    fn a_panic_of_any_worker_is_the_callers_and_workers_go_on_after_it() {
        for count in COUNTS {
            let workers = Workers::new(count).unwrap();
            for bad in [0, 17, 99] {
                let fails = || {
                    workers.stages(&[100, 5], |turns| {
                        for (stage, chunk) in turns {
                            assert!(stage == 0, "no stage begins after one that failed");
                            assert!(chunk != bad, "chunk {chunk} of {count} workers");
                        }
                    });
                };
                let told = std::panic::catch_unwind(std::panic::AssertUnwindSafe(fails)).unwrap_err();
                let told = told.downcast_ref::<String>().unwrap();
                assert!(told.contains(&format!("chunk {bad}")), "{told}");
                let mut items = vec![0; 64];
                workers.each(&mut items, 4, |_, items| items.fill(1));
                assert!(items.iter().all(|x| *x == 1));
            }
        }
    }
}
