//! Four numbers in one register of NEON, which every processor of AArch64 has. The token is the proof, so no `unsafe` is needed.

use super::Job;
use super::halves::{Behind, Half, Halves};
use pulp::aarch64::Neon;
use std::arch::aarch64::{float32x4_t, uint32x4_t};

/// Rounds to the upper half of the bits, ties away from zero.
#[inline(always)]
fn rounded(lanes: Neon, x: float32x4_t) -> uint32x4_t {
    let neon = lanes.neon;
    let rounded = neon.vaddq_u32(neon.vreinterpretq_u32_f32(x), neon.vdupq_n_u32(0x8000));
    neon.vandq_u32(rounded, neon.vdupq_n_u32(0xffff_0000))
}

impl Half for Neon {
    type Quad = float32x4_t;
    #[inline(always)]
    fn all(self, x: f32) -> float32x4_t {
        self.neon.vdupq_n_f32(x)
    }
    #[inline(always)]
    fn load(self, x: [f32; 4]) -> float32x4_t {
        pulp::cast(x)
    }
    #[inline(always)]
    fn store(self, x: float32x4_t) -> [f32; 4] {
        pulp::cast(x)
    }
    #[inline(always)]
    fn add(self, a: float32x4_t, b: float32x4_t) -> float32x4_t {
        self.neon.vaddq_f32(a, b)
    }
    #[inline(always)]
    fn sub(self, a: float32x4_t, b: float32x4_t) -> float32x4_t {
        self.neon.vsubq_f32(a, b)
    }
    #[inline(always)]
    fn mul(self, a: float32x4_t, b: float32x4_t) -> float32x4_t {
        self.neon.vmulq_f32(a, b)
    }
    #[inline(always)]
    fn div(self, a: float32x4_t, b: float32x4_t) -> float32x4_t {
        self.neon.vdivq_f32(a, b)
    }
    // its own `fmax` and `fmin` return NaN where either is, and tell zeros apart
    #[inline(always)]
    fn max(self, a: float32x4_t, b: float32x4_t) -> float32x4_t {
        self.neon.vbslq_f32(self.neon.vcgtq_f32(a, b), a, b)
    }
    #[inline(always)]
    fn min(self, a: float32x4_t, b: float32x4_t) -> float32x4_t {
        self.neon.vbslq_f32(self.neon.vcltq_f32(a, b), a, b)
    }
    #[inline(always)]
    fn sqrt(self, a: float32x4_t) -> float32x4_t {
        self.neon.vsqrtq_f32(a)
    }
    #[inline(always)]
    fn if_less(self, a: float32x4_t, b: float32x4_t, yes: float32x4_t, no: float32x4_t) -> float32x4_t {
        self.neon.vbslq_f32(self.neon.vcltq_f32(a, b), yes, no)
    }
    #[inline(always)]
    fn pair(self, one: float32x4_t, other: float32x4_t) -> float32x4_t {
        let low = self.neon.vshrq_n_u32::<16>(rounded(self, other));
        self.neon.vreinterpretq_f32_u32(self.neon.vorrq_u32(rounded(self, one), low))
    }
    #[inline(always)]
    fn parts(self, pair: float32x4_t) -> (float32x4_t, float32x4_t) {
        let neon = self.neon;
        let bits = neon.vreinterpretq_u32_f32(pair);
        let high = neon.vandq_u32(bits, neon.vdupq_n_u32(0xffff_0000));
        (neon.vreinterpretq_f32_u32(high), neon.vreinterpretq_f32_u32(neon.vshlq_n_u32::<16>(bits)))
    }
    #[inline(always)]
    fn turn(self, r: [float32x4_t; 4]) -> [float32x4_t; 4] {
        let neon = self.neon;
        let (a, b) = (neon.vtrn1q_f32(r[0], r[1]), neon.vtrn2q_f32(r[0], r[1]));
        let (c, d) = (neon.vtrn1q_f32(r[2], r[3]), neon.vtrn2q_f32(r[2], r[3]));
        // pairs of numbers are moved as one
        let wide = |x| neon.vreinterpretq_f64_f32(x);
        let low = |x, y| neon.vreinterpretq_f32_f64(neon.vzip1q_f64(wide(x), wide(y)));
        let high = |x, y| neon.vreinterpretq_f32_f64(neon.vzip2q_f64(wide(x), wide(y)));
        [low(a, c), low(b, d), high(a, c), high(b, d)]
    }
    #[inline(always)]
    fn call<J: Job>(self, lanes: Halves<Self>, job: J) -> J::Output {
        self.vectorize(Behind(lanes, job))
    }
}
