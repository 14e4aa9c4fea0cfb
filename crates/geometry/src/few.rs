//! A short list that lives where it is declared and moves to the heap only when it outgrows its place: what a query of
//! one pair needs, without asking for memory. Knows no geometry.

use std::ops::{Deref, DerefMut};

/// Up to `N` items in place, any number on the heap.
#[derive(Clone, Debug)]
pub struct Few<T, const N: usize> {
    count: usize,
    near: [T; N],
    /// All items while they are more than `N`.
    far: Vec<T>,
}

impl<T: Copy + Default, const N: usize> Default for Few<T, N> {
    #[inline]
    fn default() -> Self {
        Few { count: 0, near: [T::default(); N], far: Vec::new() }
    }
}

impl<T, const N: usize> Deref for Few<T, N> {
    type Target = [T];
    #[inline]
    fn deref(&self) -> &[T] {
        if self.count <= N { &self.near[..self.count] } else { &self.far }
    }
}

impl<T, const N: usize> DerefMut for Few<T, N> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [T] {
        if self.count <= N { &mut self.near[..self.count] } else { &mut self.far }
    }
}

impl<T: Copy + Default, const N: usize> Few<T, N> {
    /// Adds an item at the end.
    #[inline(always)]
    pub fn push(&mut self, item: T) {
        // one place for both cases: the item is written where it stays, without a copy on the way
        let place = if self.count < N {
            self.count += 1;
            &mut self.near[self.count - 1]
        } else {
            self.far_place()
        };
        *place = item;
    }
    #[cold]
    fn far_place(&mut self) -> &mut T {
        if self.count == N {
            self.far.clear();
            self.far.extend_from_slice(&self.near);
        }
        self.far.push(T::default());
        self.count += 1;
        &mut self.far[self.count - 1]
    }
    /// Forgets all items.
    #[inline]
    pub fn clear(&mut self) {
        self.count = 0;
    }
    /// Keeps the first items.
    #[inline]
    pub fn truncate(&mut self, count: usize) {
        if count >= self.count {
            return;
        }
        if self.count > N {
            self.far.truncate(count);
            if count <= N {
                self.near[..count].copy_from_slice(&self.far);
            }
        }
        self.count = count;
    }
    /// Keeps the items that pass, in order.
    #[inline]
    pub fn retain(&mut self, mut passes: impl FnMut(&T) -> bool) {
        let items: &mut [T] = self;
        let mut kept = 0;
        for k in 0..items.len() {
            if passes(&items[k]) {
                if kept < k {
                    items[kept] = items[k];
                }
                kept += 1;
            }
        }
        self.truncate(kept);
    }
}

impl<T: Copy + Default, const N: usize> Extend<T> for Few<T, N> {
    #[inline]
    fn extend<I: IntoIterator<Item = T>>(&mut self, items: I) {
        for item in items {
            self.push(item);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Few;

    #[test]
    fn it_holds_what_a_vector_holds_on_both_sides_of_its_place() {
        for length in 0..12 {
            let mut few = Few::<u32, 4>::default();
            let mut many: Vec<u32> = (0..length).collect();
            few.extend(0..length);
            assert_eq!(few[..], many[..]);
            few.retain(|x| x % 3 != 1);
            many.retain(|x| x % 3 != 1);
            assert_eq!(few[..], many[..]);
            few.push(77);
            many.push(77);
            assert_eq!(few[..], many[..]);
            few.truncate(2);
            many.truncate(2);
            assert_eq!(few[..], many[..]);
            few.clear();
            assert!(few.is_empty());
            few.extend(0..6);
            assert_eq!(few[..], [0, 1, 2, 3, 4, 5]);
        }
    }
}
