//! Eight numbers as two registers of four, for processors whose registers hold no more. What such a register can do is all that
//! a processor has to tell.

use super::four::Plain;
use super::{Eight, Job, Lanes, Quad, WIDTH};

/// What a processor does with four numbers at once; `max` and `min` return their second argument when either is NaN.
pub trait Half: Copy + Send + Sync + 'static {
    /// Four numbers in a register.
    type Quad: Copy + Send + Sync;
    /// The same number four times.
    fn all(self, x: f32) -> Self::Quad;
    /// From memory.
    fn load(self, x: [f32; 4]) -> Self::Quad;
    /// To memory.
    fn store(self, x: Self::Quad) -> [f32; 4];
    /// a + b.
    fn add(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// a - b.
    fn sub(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// a b.
    fn mul(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// a / b.
    fn div(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// a > b ? a : b.
    fn max(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// a < b ? a : b.
    fn min(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// Square root.
    fn sqrt(self, a: Self::Quad) -> Self::Quad;
    /// a < b ? yes : no.
    fn if_less(self, a: Self::Quad, b: Self::Quad, yes: Self::Quad, no: Self::Quad) -> Self::Quad;
    /// Two numbers in the bits of one, each rounded to eight bits of mantissa.
    fn pair(self, one: Self::Quad, other: Self::Quad) -> Self::Quad;
    /// The two numbers of a pair.
    fn parts(self, pair: Self::Quad) -> (Self::Quad, Self::Quad);
    /// Four records of four numbers turned into four quantities of four records, or back.
    fn turn(self, rows: [Self::Quad; 4]) -> [Self::Quad; 4];
    /// Does something with this processor's instructions.
    fn call<J: Job>(self, lanes: Halves<Self>, job: J) -> J::Output;
}

/// Two registers side by side.
#[derive(Clone, Copy, Debug)]
pub struct Halves<H>(pub H);

macro_rules! both {
    ($name:ident, $($x:ident),+) => {
        #[inline(always)]
        fn $name(self, $($x: [H::Quad; 2]),+) -> [H::Quad; 2] {
            [self.0.$name($($x[0]),+), self.0.$name($($x[1]),+)]
        }
    };
}

impl<H: Half> Lanes for Halves<H> {
    type Reals = [H::Quad; 2];
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
    fn all(self, x: f32) -> [H::Quad; 2] {
        [self.0.all(x); 2]
    }
    #[inline(always)]
    fn load(self, x: &Eight) -> [H::Quad; 2] {
        let [one, other]: [[f32; 4]; 2] = pulp::cast(x.0);
        [self.0.load(one), self.0.load(other)]
    }
    #[inline(always)]
    fn store(self, x: [H::Quad; 2]) -> Eight {
        Eight(pulp::cast([self.0.store(x[0]), self.0.store(x[1])]))
    }
    both!(add, a, b);
    both!(sub, a, b);
    both!(mul, a, b);
    both!(div, a, b);
    both!(max, a, b);
    both!(min, a, b);
    both!(sqrt, a);
    both!(if_less, a, b, yes, no);
    both!(pair, one, other);
    #[inline(always)]
    fn parts(self, pair: [H::Quad; 2]) -> ([H::Quad; 2], [H::Quad; 2]) {
        let (low, high) = (self.0.parts(pair[0]), self.0.parts(pair[1]));
        ([low.0, high.0], [low.1, high.1])
    }
    #[inline(always)]
    fn turn(self, r: [[H::Quad; 2]; WIDTH]) -> [[H::Quad; 2]; WIDTH] {
        let a = self.0.turn([r[0][0], r[1][0], r[2][0], r[3][0]]);
        let b = self.0.turn([r[4][0], r[5][0], r[6][0], r[7][0]]);
        let c = self.0.turn([r[0][1], r[1][1], r[2][1], r[3][1]]);
        let d = self.0.turn([r[4][1], r[5][1], r[6][1], r[7][1]]);
        [
            [a[0], b[0]],
            [a[1], b[1]],
            [a[2], b[2]],
            [a[3], b[3]],
            [c[0], d[0]],
            [c[1], d[1]],
            [c[2], d[2]],
            [c[3], d[3]],
        ]
    }
    #[inline(always)]
    fn columns(self, [a, b, c, d, e, f, g, h]: [Quad; WIDTH]) -> [[H::Quad; 2]; 4] {
        let lanes = self.0;
        let low = lanes.turn([lanes.load(a.0), lanes.load(b.0), lanes.load(c.0), lanes.load(d.0)]);
        let high = lanes.turn([lanes.load(e.0), lanes.load(f.0), lanes.load(g.0), lanes.load(h.0)]);
        [[low[0], high[0]], [low[1], high[1]], [low[2], high[2]], [low[3], high[3]]]
    }
    #[inline(always)]
    fn rows(self, [a, b, c, d]: [[H::Quad; 2]; 4]) -> [Quad; WIDTH] {
        let mut out = [Quad::default(); WIDTH];
        for half in 0..2 {
            let rows = self.0.turn([a[half], b[half], c[half], d[half]]);
            for k in 0..4 {
                out[4 * half + k] = Quad(self.0.store(rows[k]));
            }
        }
        out
    }
    #[inline(always)]
    fn run<J: Job>(self, job: J) -> J::Output {
        self.0.call(self, job)
    }
}

/// A job, and the lanes that it is to be done in, for a processor's token to call.
pub struct Behind<H, J>(pub Halves<H>, pub J);

impl<H: Half, J: Job> pulp::NullaryFnOnce for Behind<H, J> {
    type Output = J::Output;
    #[inline(always)]
    fn call(self) -> J::Output {
        self.1.work(self.0)
    }
}
