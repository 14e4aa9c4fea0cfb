//! Records of numbers side by side in memory, which lanes take eight at a time and turn into quantities of eight records.

use crate::lanes::{Eight, Lanes, Quad, Real, WIDTH};
use crate::several::{Plain, Several};
use std::fmt::Debug;

/// Four or eight numbers.
pub trait Record: Plain + Debug + Default + PartialEq + 'static {
    /// One value for each number.
    type Columns<T: Plain>: Several<T>;
    /// Eight records turned into quantities.
    fn columns<L: Lanes>(lanes: L, rows: [Self; WIDTH]) -> Self::Columns<Real<L>>;
    /// And back.
    fn rows<L: Lanes>(columns: Self::Columns<Real<L>>) -> [Self; WIDTH];
    /// The numbers, zeros behind them.
    fn eight(self) -> Eight;
    /// The first of eight numbers.
    fn of(numbers: Eight) -> Self;
}

impl Record for Quad {
    type Columns<T: Plain> = [T; 4];
    #[inline(always)]
    fn columns<L: Lanes>(lanes: L, rows: [Self; WIDTH]) -> [Real<L>; 4] {
        Real::columns(lanes, rows)
    }
    #[inline(always)]
    fn rows<L: Lanes>(columns: [Real<L>; 4]) -> [Self; WIDTH] {
        Real::rows(columns)
    }
    #[inline(always)]
    fn eight(self) -> Eight {
        let [a, b, c, d] = self.0;
        Eight([a, b, c, d, 0.0, 0.0, 0.0, 0.0])
    }
    #[inline(always)]
    fn of(numbers: Eight) -> Self {
        numbers.halves()[0]
    }
}

impl Record for Eight {
    type Columns<T: Plain> = [T; WIDTH];
    #[inline(always)]
    fn columns<L: Lanes>(lanes: L, rows: [Self; WIDTH]) -> [Real<L>; WIDTH] {
        let mut numbers = [Real::all(lanes, 0.0); WIDTH];
        for k in 0..WIDTH {
            numbers[k] = Real::load(lanes, &rows[k]);
        }
        Real::turn(numbers)
    }
    #[inline(always)]
    fn rows<L: Lanes>(columns: [Real<L>; WIDTH]) -> [Self; WIDTH] {
        let mut rows = [Eight::default(); WIDTH];
        for (row, turned) in rows.iter_mut().zip(Real::turn(columns)) {
            *row = turned.store();
        }
        rows
    }
    #[inline(always)]
    fn eight(self) -> Eight {
        self
    }
    #[inline(always)]
    fn of(numbers: Eight) -> Self {
        numbers
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Portable;

    fn records_turned_and_turned_back_are_what_they_were<R: Record>() {
        let rows: [R; WIDTH] =
            std::array::from_fn(|i| R::of(Eight(std::array::from_fn(|k| (WIDTH * i + k) as f32))));
        let columns = R::columns(Portable, rows);
        for (k, column) in columns.slice().iter().enumerate() {
            assert_eq!(column.store().0, std::array::from_fn(|i| rows[i].eight().0[k]));
        }
        assert_eq!(R::rows(columns), rows);
    }

    #[test]
    fn records_of_four_and_of_eight_numbers_turn() {
        records_turned_and_turned_back_are_what_they_were::<Quad>();
        records_turned_and_turned_back_are_what_they_were::<Eight>();
        assert_eq!(Quad([1.0, 2.0, 3.0, 4.0]).eight().0, [1.0, 2.0, 3.0, 4.0, 0.0, 0.0, 0.0, 0.0]);
    }
}
