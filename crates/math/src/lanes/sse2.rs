//! Four numbers in one register of SSE2, which every processor of x86-64 has. The token is the proof, so no `unsafe` is needed.

use super::Job;
use super::halves::{Behind, Half, Halves};
use pulp::x86::V1;
use std::arch::x86_64::__m128;

/// The upper half of the bits.
#[inline(always)]
fn upper(lanes: V1) -> __m128 {
    pulp::cast(lanes.sse2._mm_set1_epi32(0xffff_0000_u32 as i32))
}

/// Rounds to the upper half of the bits, ties away from zero.
#[inline(always)]
fn rounded(lanes: V1, x: __m128) -> __m128 {
    let rounded = lanes.sse2._mm_add_epi32(pulp::cast(x), lanes.sse2._mm_set1_epi32(0x8000));
    lanes.sse._mm_and_ps(pulp::cast(rounded), upper(lanes))
}

impl Half for V1 {
    type Quad = __m128;
    #[inline(always)]
    fn all(self, x: f32) -> __m128 {
        self.sse._mm_set1_ps(x)
    }
    #[inline(always)]
    fn load(self, x: [f32; 4]) -> __m128 {
        pulp::cast(x)
    }
    #[inline(always)]
    fn store(self, x: __m128) -> [f32; 4] {
        pulp::cast(x)
    }
    #[inline(always)]
    fn add(self, a: __m128, b: __m128) -> __m128 {
        self.sse._mm_add_ps(a, b)
    }
    #[inline(always)]
    fn sub(self, a: __m128, b: __m128) -> __m128 {
        self.sse._mm_sub_ps(a, b)
    }
    #[inline(always)]
    fn mul(self, a: __m128, b: __m128) -> __m128 {
        self.sse._mm_mul_ps(a, b)
    }
    #[inline(always)]
    fn div(self, a: __m128, b: __m128) -> __m128 {
        self.sse._mm_div_ps(a, b)
    }
    #[inline(always)]
    fn max(self, a: __m128, b: __m128) -> __m128 {
        self.sse._mm_max_ps(a, b)
    }
    #[inline(always)]
    fn min(self, a: __m128, b: __m128) -> __m128 {
        self.sse._mm_min_ps(a, b)
    }
    #[inline(always)]
    fn sqrt(self, a: __m128) -> __m128 {
        self.sse._mm_sqrt_ps(a)
    }
    #[inline(always)]
    fn if_less(self, a: __m128, b: __m128, yes: __m128, no: __m128) -> __m128 {
        let less = self.sse._mm_cmplt_ps(a, b);
        self.sse._mm_or_ps(self.sse._mm_and_ps(less, yes), self.sse._mm_andnot_ps(less, no))
    }
    #[inline(always)]
    fn pair(self, one: __m128, other: __m128) -> __m128 {
        let low = self.sse2._mm_srli_epi32::<16>(pulp::cast(rounded(self, other)));
        self.sse._mm_or_ps(rounded(self, one), pulp::cast(low))
    }
    #[inline(always)]
    fn parts(self, pair: __m128) -> (__m128, __m128) {
        let low = self.sse2._mm_slli_epi32::<16>(pulp::cast(pair));
        (self.sse._mm_and_ps(pair, upper(self)), pulp::cast(low))
    }
    #[inline(always)]
    fn turn(self, r: [__m128; 4]) -> [__m128; 4] {
        let sse = self.sse;
        let (a, b) = (sse._mm_unpacklo_ps(r[0], r[1]), sse._mm_unpacklo_ps(r[2], r[3]));
        let (c, d) = (sse._mm_unpackhi_ps(r[0], r[1]), sse._mm_unpackhi_ps(r[2], r[3]));
        [sse._mm_movelh_ps(a, b), sse._mm_movehl_ps(b, a), sse._mm_movelh_ps(c, d), sse._mm_movehl_ps(d, c)]
    }
    #[inline(always)]
    fn call<J: Job>(self, lanes: Halves<Self>, job: J) -> J::Output {
        self.vectorize(Behind(lanes, job))
    }
}
