//! Eight numbers side by side in f32: one register holds the same quantity of eight contacts; or four in f64, for what
//! needs them. One text runs on every processor: what a machine offers is found at run time, and `dispatch` is the door
//! to it. Products and sums are rounded one by one, never fused, so that every machine gets the same bits. Knows no physics.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod four;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
mod halves;
#[cfg(target_arch = "aarch64")]
mod neon;
mod portable;
mod real;
#[cfg(target_arch = "x86_64")]
mod sse2;

pub use four::Four;
pub use portable::Portable;
pub use real::Real;

/// Numbers in a register, whatever the machine: what is laid out in memory does not depend on it.
pub const WIDTH: usize = 8;

/// Eight numbers in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Eight(pub [f32; WIDTH]);

impl Eight {
    /// The first four numbers, and the others.
    #[inline(always)]
    pub fn halves(self) -> [Quad; 2] {
        let [a, b, c, d, e, f, g, h] = self.0;
        [Quad([a, b, c, d]), Quad([e, f, g, h])]
    }
}

/// Four numbers in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(16))]
pub struct Quad(pub [f32; 4]);

/// What a processor does with eight numbers at once. `max` and `min` return their second argument when either is NaN.
pub trait Lanes: Copy + Send + Sync + 'static {
    /// Eight numbers in registers.
    type Reals: Copy + Send + Sync;
    /// Four numbers of f64 in registers.
    type Four: Four;
    /// Four numbers from memory.
    fn four(self, x: &[f64; 4]) -> Self::Four;
    /// The same number four times.
    fn four_of(self, x: f64) -> Self::Four;
    /// The same number eight times.
    fn all(self, x: f32) -> Self::Reals;
    /// From memory.
    fn load(self, x: &Eight) -> Self::Reals;
    /// To memory.
    fn store(self, x: Self::Reals) -> Eight;
    /// a + b.
    fn add(self, a: Self::Reals, b: Self::Reals) -> Self::Reals;
    /// a - b.
    fn sub(self, a: Self::Reals, b: Self::Reals) -> Self::Reals;
    /// a b.
    fn mul(self, a: Self::Reals, b: Self::Reals) -> Self::Reals;
    /// a / b.
    fn div(self, a: Self::Reals, b: Self::Reals) -> Self::Reals;
    /// a > b ? a : b.
    fn max(self, a: Self::Reals, b: Self::Reals) -> Self::Reals;
    /// a < b ? a : b.
    fn min(self, a: Self::Reals, b: Self::Reals) -> Self::Reals;
    /// Square root.
    fn sqrt(self, a: Self::Reals) -> Self::Reals;
    /// a < b ? yes : no.
    fn if_less(self, a: Self::Reals, b: Self::Reals, yes: Self::Reals, no: Self::Reals) -> Self::Reals;
    /// Whether a < b in some lane.
    #[inline(always)]
    fn somewhere_less(self, a: Self::Reals, b: Self::Reals) -> bool {
        let marks = self.store(self.if_less(a, b, self.all(1.0), self.all(0.0)));
        marks.0.iter().fold(0, |bits, mark| bits | mark.to_bits()) != 0
    }
    /// Two numbers in the bits of one, each rounded to eight bits of mantissa.
    fn pair(self, one: Self::Reals, other: Self::Reals) -> Self::Reals;
    /// The two numbers of a pair.
    fn parts(self, pair: Self::Reals) -> (Self::Reals, Self::Reals);
    /// Eight records of eight numbers turned into eight quantities of eight records, or back.
    fn turn(self, rows: [Self::Reals; WIDTH]) -> [Self::Reals; WIDTH];
    /// Eight records of four numbers turned into four quantities of eight records.
    fn columns(self, rows: [Quad; WIDTH]) -> [Self::Reals; 4];
    /// And back.
    fn rows(self, columns: [Self::Reals; 4]) -> [Quad; WIDTH];
    /// Does a job with this processor's instructions.
    fn run<J: Job>(self, job: J) -> J::Output;
}

/// Something to do with lanes.
pub trait Job {
    /// What comes of it.
    type Output;
    /// Does it; to be inlined, or the compiler cannot use the registers.
    fn work<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// Does a job with the best instructions that this machine has.
pub fn dispatch<J: Job>(job: J) -> J::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(lanes) = pulp::x86::V3::try_new() {
        return lanes.run(job);
    }
    in_fours(job)
}

/// Does a job in registers of four numbers, two for eight; in none where a machine has none.
pub fn in_fours<J: Job>(job: J) -> J::Output {
    #[cfg(target_arch = "x86_64")]
    let four = pulp::x86::V1::try_new();
    #[cfg(target_arch = "aarch64")]
    let four = pulp::aarch64::Neon::try_new();
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    if let Some(four) = four {
        return halves::Halves(four).run(job);
    }
    Portable.run(job)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Exercise<'a>(&'a [Eight]);

    impl Job for Exercise<'_> {
        type Output = Vec<[u32; WIDTH]>;
        #[inline(always)]
        fn work<L: Lanes>(self, lanes: L) -> Self::Output {
            let mut out = Vec::new();
            for pair in self.0.windows(2) {
                let (a, b) = (lanes.load(&pair[0]), lanes.load(&pair[1]));
                let mut tell = |x: L::Reals| out.push(lanes.store(x).0.map(f32::to_bits));
                tell(lanes.add(lanes.mul(a, b), a));
                tell(lanes.sub(a, lanes.div(b, a)));
                tell(lanes.max(a, b));
                tell(lanes.min(a, b));
                tell(lanes.sqrt(lanes.mul(a, a)));
                tell(lanes.if_less(a, b, lanes.all(1.0), lanes.all(2.0)));
                tell(lanes.all(f32::from(lanes.somewhere_less(a, b))));
                let (one, other) = lanes.parts(lanes.pair(a, b));
                tell(one);
                tell(other);
            }
            for rows in self.0.chunks_exact(WIDTH) {
                let mut turned = [lanes.all(0.0); WIDTH];
                for (turned, row) in turned.iter_mut().zip(rows) {
                    *turned = lanes.load(row);
                }
                for column in lanes.turn(turned) {
                    out.push(lanes.store(column).0.map(f32::to_bits));
                }
                let mut quads = [Quad::default(); WIDTH];
                for (quad, row) in quads.iter_mut().zip(rows) {
                    *quad = row.halves()[1];
                }
                let columns = lanes.columns(quads);
                for column in columns {
                    out.push(lanes.store(column).0.map(f32::to_bits));
                }
                for (quad, back) in quads.iter().zip(lanes.rows(columns)) {
                    assert_eq!(quad.0.map(f32::to_bits), back.0.map(f32::to_bits));
                }
            }
            out
        }
    }

    struct ExerciseFour<'a>(&'a [[f64; 4]]);

    impl Job for ExerciseFour<'_> {
        type Output = (Vec<[u64; 4]>, Vec<u32>);
        #[inline(always)]
        fn work<L: Lanes>(self, lanes: L) -> Self::Output {
            let (mut out, mut sets) = (Vec::new(), Vec::new());
            for pair in self.0.windows(2) {
                let (a, b) = (lanes.four(&pair[0]), lanes.four(&pair[1]));
                let all = [
                    a * b + a,
                    a - b / a,
                    a.max(b),
                    a.min(b),
                    (a * a).sqrt(),
                    -a,
                    a.abs(),
                    a.if_less(b, lanes.four_of(1.0), lanes.four_of(2.0)),
                    a.as_f32(),
                    a.like(0.1),
                    lanes.four(&b.to_f32().map(f64::from)),
                ];
                out.extend(all.map(|x| x.store().map(f64::to_bits)));
                sets.push(a.less(b));
                let turned = Four::turned([a, b, a + b, a - b]);
                out.extend(turned.map(|x| x.store().map(f64::to_bits)));
                let back = Four::turned(turned).map(|x| x.store().map(f64::to_bits));
                assert_eq!(back[..2], [pair[0].map(f64::to_bits), pair[1].map(f64::to_bits)]);
            }
            (out, sets)
        }
    }

    #[test]
    fn every_processor_gives_the_same_bits_of_four_numbers() {
        let numbers: Vec<[f64; 4]> = (numbers().iter())
            .map(|n| std::array::from_fn(|k| f64::from(n.0[k]) * (1.0 + 1e-9 * f64::from(n.0[7 - k]))))
            .collect();
        let any = |bits: u64| if f64::from_bits(bits).is_nan() { 0 } else { bits };
        let bits = |(numbers, sets): (Vec<[u64; 4]>, Vec<u32>)| {
            (numbers.into_iter().map(|n| n.map(any)).collect::<Vec<_>>(), sets)
        };
        assert_eq!(bits(dispatch(ExerciseFour(&numbers))), bits(Portable.run(ExerciseFour(&numbers))));
    }

    fn numbers() -> Vec<Eight> {
        let special = [0.0, -0.0, 1e-41, f32::INFINITY, f32::NEG_INFINITY, 1.0, f32::MAX, -3.5e-8];
        let mut all = vec![Eight(special)];
        let mut x = 1u32;
        for _ in 0..63 {
            all.push(Eight(std::array::from_fn(|_| {
                x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (x as f32 / 4e9 - 0.5) * 3.0_f32.powi((x % 21) as i32 - 10)
            })));
        }
        all
    }

    #[test]
    fn every_processor_gives_the_same_bits() {
        let numbers = numbers();
        assert_eq!(dispatch(Exercise(&numbers)), Portable.run(Exercise(&numbers)));
        assert_eq!(in_fours(Exercise(&numbers)), Portable.run(Exercise(&numbers)));
    }

    #[test]
    fn one_lane_that_is_less_is_somewhere() {
        struct Least(Eight, Eight);
        impl Job for Least {
            type Output = bool;
            #[inline(always)]
            fn work<L: Lanes>(self, lanes: L) -> bool {
                lanes.somewhere_less(lanes.load(&self.0), lanes.load(&self.1))
            }
        }
        for k in 0..WIDTH {
            let (same, mut less) = (Eight([1.0; WIDTH]), Eight([1.0; WIDTH]));
            less.0[k] = 0.5;
            assert!(
                dispatch(Least(less, same)) && in_fours(Least(less, same)) && Portable.run(Least(less, same))
            );
            less.0[k] = f32::NAN;
            for (a, b) in [(same, same), (less, same), (same, less)] {
                assert!(!dispatch(Least(a, b)) && !in_fours(Least(a, b)) && !Portable.run(Least(a, b)));
            }
        }
    }

    #[test]
    fn a_pair_holds_both_numbers_to_eight_bits() {
        let (one, other) = (Portable.all(0.731_234), Portable.all(-1.234_5e-7));
        let (a, b) = Portable.parts(Portable.pair(one, other));
        assert!((a[0] / one[0] - 1.0).abs() < 1.0 / 256.0 && (b[0] / other[0] - 1.0).abs() < 1.0 / 256.0);
    }

    #[test]
    fn turning_twice_changes_nothing() {
        let rows: [[f32; WIDTH]; WIDTH] =
            std::array::from_fn(|i| std::array::from_fn(|k| (8 * i + k) as f32));
        let turned = Portable.turn(rows);
        assert_eq!(turned[3][5], rows[5][3]);
        assert_eq!(Portable.turn(turned), rows);
        let quads = rows.map(|row| Eight(row).halves()[1]);
        assert_eq!(Portable.columns(quads), turned[4..]);
        assert_eq!(Portable.rows(Portable.columns(quads)), quads);
    }
}
