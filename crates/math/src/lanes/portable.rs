//! Eight numbers as a plain array, for processors without registers of that width.

use super::four::Plain;
use super::{Eight, Job, Lanes, Quad, WIDTH};

/// Any processor.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

type Reals = [f32; WIDTH];

#[inline(always)]
fn each(a: Reals, b: Reals, f: impl Fn(f32, f32) -> f32) -> Reals {
    let mut out = [0.0; WIDTH];
    for k in 0..WIDTH {
        out[k] = f(a[k], b[k]);
    }
    out
}

/// Rounds to the upper half of the bits, ties away from zero.
#[inline(always)]
fn half(x: f32) -> u32 {
    x.to_bits().wrapping_add(0x8000) & 0xffff_0000
}

impl Lanes for Portable {
    type Reals = Reals;
    type Four = Plain;
    #[inline(always)]
    fn four(self, x: &[f64; 4]) -> Plain {
        Plain(*x)
    }
    #[inline(always)]
    fn four_of(self, x: f64) -> Plain {
        Plain([x; 4])
    }
    #[inline(always)]
    fn all(self, x: f32) -> Reals {
        [x; WIDTH]
    }
    #[inline(always)]
    fn load(self, x: &Eight) -> Reals {
        x.0
    }
    #[inline(always)]
    fn store(self, x: Reals) -> Eight {
        Eight(x)
    }
    #[inline(always)]
    fn add(self, a: Reals, b: Reals) -> Reals {
        each(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: Reals, b: Reals) -> Reals {
        each(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: Reals, b: Reals) -> Reals {
        each(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: Reals, b: Reals) -> Reals {
        each(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn max(self, a: Reals, b: Reals) -> Reals {
        each(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn min(self, a: Reals, b: Reals) -> Reals {
        each(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn sqrt(self, a: Reals) -> Reals {
        each(a, a, |a, _| a.sqrt())
    }
    #[inline(always)]
    fn if_less(self, a: Reals, b: Reals, yes: Reals, no: Reals) -> Reals {
        let mut out = no;
        for k in 0..WIDTH {
            if a[k] < b[k] {
                out[k] = yes[k];
            }
        }
        out
    }
    #[inline(always)]
    fn pair(self, one: Reals, other: Reals) -> Reals {
        each(one, other, |a, b| f32::from_bits(half(a) | (half(b) >> 16)))
    }
    #[inline(always)]
    fn parts(self, pair: Reals) -> (Reals, Reals) {
        let one = each(pair, pair, |x, _| f32::from_bits(x.to_bits() & 0xffff_0000));
        (one, each(pair, pair, |x, _| f32::from_bits(x.to_bits() << 16)))
    }
    #[inline(always)]
    fn turn(self, rows: [Reals; WIDTH]) -> [Reals; WIDTH] {
        let mut out = [[0.0; WIDTH]; WIDTH];
        for i in 0..WIDTH {
            for k in 0..WIDTH {
                out[i][k] = rows[k][i];
            }
        }
        out
    }
    #[inline(always)]
    fn columns(self, rows: [Quad; WIDTH]) -> [Reals; 4] {
        let mut out = [[0.0; WIDTH]; 4];
        for (i, row) in rows.iter().enumerate() {
            for (column, x) in out.iter_mut().zip(row.0) {
                column[i] = x;
            }
        }
        out
    }
    #[inline(always)]
    fn rows(self, columns: [Reals; 4]) -> [Quad; WIDTH] {
        let mut out = [Quad::default(); WIDTH];
        for (i, row) in out.iter_mut().enumerate() {
            row.0 = columns.map(|column| column[i]);
        }
        out
    }
    #[inline(always)]
    fn run<J: Job>(self, job: J) -> J::Output {
        job.work(self)
    }
}
