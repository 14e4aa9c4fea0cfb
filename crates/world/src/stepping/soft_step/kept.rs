//! Which faces of a step something is remembered of: all of them, as a rule.

/// Places of faces.
#[derive(Default)]
pub(super) struct Kept {
    count: usize,
    /// Them where they are not all.
    some: Option<Vec<u32>>,
    room: Vec<u32>,
}

impl Kept {
    /// All of so many faces.
    pub fn keep_all(&mut self, count: usize) {
        self.forget();
        self.count = count;
    }

    /// Those of so many faces that fit.
    pub fn keep(&mut self, count: usize, fits: impl Fn(usize) -> bool) {
        self.forget();
        let mut some = std::mem::take(&mut self.room);
        some.extend((0..count).filter(|k| fits(*k)).map(|k| k as u32));
        self.count = some.len();
        if some.len() == count { self.room = some } else { self.some = Some(some) }
    }

    /// None; the memory stays.
    fn forget(&mut self) {
        if let Some(some) = self.some.take() {
            self.room = some;
        }
        self.room.clear();
    }

    /// How many they are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether they are all.
    pub fn is_all(&self) -> bool {
        self.some.is_none()
    }

    /// The face that is kept at a place.
    #[inline]
    pub fn face(&self, place: usize) -> usize {
        self.some.as_ref().map_or(place, |some| some[place] as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_are_kept_all_or_some_of_them() {
        let mut kept = Kept::default();
        let told = |kept: &Kept| (0..kept.len()).map(|place| kept.face(place)).collect::<Vec<_>>();
        for _ in 0..2 {
            kept.keep(5, |k| k % 2 == 0);
            assert!(!kept.is_all() && told(&kept) == [0, 2, 4]);
            kept.keep(3, |_| true);
            assert!(kept.is_all() && told(&kept) == [0, 1, 2]);
            kept.keep_all(2);
            assert!(kept.is_all() && told(&kept) == [0, 1]);
            kept.keep(2, |_| false);
            assert!(!kept.is_all() && kept.len() == 0);
        }
    }
}
