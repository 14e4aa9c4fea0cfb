//! Eight numbers in one register of AVX2, or four of f64. The token is the proof that the processor has it, so no `unsafe` is needed.

use super::{Eight, Four, Job, Lanes, Quad, WIDTH};
use pulp::x86::V3;
use std::arch::x86_64::{__m128, __m256, __m256d};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Four numbers of f64 and the token.
#[derive(Clone, Copy)]
pub struct Doubles(V3, __m256d);

macro_rules! operator {
    ($trait:ident, $name:ident, $with:ident) => {
        impl $trait for Doubles {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Doubles(self.0, self.0.avx.$with(self.1, other.1))
            }
        }
    };
}
operator!(Add, add, _mm256_add_pd);
operator!(Sub, sub, _mm256_sub_pd);
operator!(Mul, mul, _mm256_mul_pd);
operator!(Div, div, _mm256_div_pd);

impl Neg for Doubles {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let avx = self.0.avx;
        Doubles(self.0, avx._mm256_xor_pd(self.1, avx._mm256_set1_pd(-0.0)))
    }
}

impl Four for Doubles {
    #[inline(always)]
    fn turned([a, b, c, d]: [Self; 4]) -> [Self; 4] {
        let (lanes, avx) = (a.0, a.0.avx);
        let (low, high) = (avx._mm256_unpacklo_pd(a.1, b.1), avx._mm256_unpackhi_pd(a.1, b.1));
        let (later, last) = (avx._mm256_unpacklo_pd(c.1, d.1), avx._mm256_unpackhi_pd(c.1, d.1));
        [
            Doubles(lanes, avx._mm256_permute2f128_pd::<0x20>(low, later)),
            Doubles(lanes, avx._mm256_permute2f128_pd::<0x20>(high, last)),
            Doubles(lanes, avx._mm256_permute2f128_pd::<0x31>(low, later)),
            Doubles(lanes, avx._mm256_permute2f128_pd::<0x31>(high, last)),
        ]
    }
    #[inline(always)]
    fn store(self) -> [f64; 4] {
        pulp::cast(self.1)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Doubles(self.0, self.0.avx._mm256_max_pd(self.1, other.1))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Doubles(self.0, self.0.avx._mm256_min_pd(self.1, other.1))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        let avx = self.0.avx;
        Doubles(self.0, avx._mm256_andnot_pd(avx._mm256_set1_pd(-0.0), self.1))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Doubles(self.0, self.0.avx._mm256_sqrt_pd(self.1))
    }
    #[inline(always)]
    fn if_less(self, other: Self, yes: Self, no: Self) -> Self {
        let less = self.0.avx._mm256_cmp_pd::<{ std::arch::x86_64::_CMP_LT_OQ }>(self.1, other.1);
        Doubles(self.0, self.0.avx._mm256_blendv_pd(no.1, yes.1, less))
    }
    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        let less = self.0.avx._mm256_cmp_pd::<{ std::arch::x86_64::_CMP_LT_OQ }>(self.1, other.1);
        self.0.avx._mm256_movemask_pd(less) as u32
    }
    #[inline(always)]
    fn like(self, x: f64) -> Self {
        Doubles(self.0, self.0.avx._mm256_set1_pd(x))
    }
    #[inline(always)]
    fn to_f32(self) -> [f32; 4] {
        pulp::cast(self.0.avx._mm256_cvtpd_ps(self.1))
    }
    #[inline(always)]
    fn as_f32(self) -> Self {
        let avx = self.0.avx;
        Doubles(self.0, avx._mm256_cvtps_pd(avx._mm256_cvtpd_ps(self.1)))
    }
}

/// Rounds to the upper half of the bits, ties away from zero.
#[inline(always)]
fn half(lanes: V3, x: __m256) -> __m256 {
    let rounded = lanes.avx2._mm256_add_epi32(pulp::cast(x), lanes.avx._mm256_set1_epi32(0x8000));
    lanes.avx._mm256_and_ps(pulp::cast(rounded), upper(lanes))
}

#[inline(always)]
fn upper(lanes: V3) -> __m256 {
    pulp::cast(lanes.avx._mm256_set1_epi32(0xffff_0000_u32 as i32))
}

/// Rows i, i + 1 interleaved, lower and upper halves of each 128 bits.
#[inline(always)]
fn woven(lanes: V3, a: __m256, b: __m256) -> (__m256, __m256) {
    (lanes.avx._mm256_unpacklo_ps(a, b), lanes.avx._mm256_unpackhi_ps(a, b))
}

/// The first four quantities of four rows from their woven pairs.
#[inline(always)]
fn quarter(lanes: V3, one: (__m256, __m256), other: (__m256, __m256)) -> [__m256; 4] {
    let avx = lanes.avx;
    [
        avx._mm256_shuffle_ps::<0x44>(one.0, other.0),
        avx._mm256_shuffle_ps::<0xee>(one.0, other.0),
        avx._mm256_shuffle_ps::<0x44>(one.1, other.1),
        avx._mm256_shuffle_ps::<0xee>(one.1, other.1),
    ]
}

/// Two records of four numbers in one register: halves that are read from memory need no turn between halves later.
#[inline(always)]
fn both(lanes: V3, low: Quad, high: Quad) -> __m256 {
    let (low, high): (__m128, __m128) = (pulp::cast(low.0), pulp::cast(high.0));
    lanes.avx._mm256_insertf128_ps::<1>(lanes.avx._mm256_castps128_ps256(low), high)
}

impl Lanes for V3 {
    type Reals = __m256;
    type Four = Doubles;
    #[inline(always)]
    fn four(self, x: &[f64; 4]) -> Doubles {
        Doubles(self, pulp::cast(*x))
    }
    #[inline(always)]
    fn four_of(self, x: f64) -> Doubles {
        Doubles(self, self.avx._mm256_set1_pd(x))
    }
    #[inline(always)]
    fn all(self, x: f32) -> __m256 {
        self.avx._mm256_set1_ps(x)
    }
    #[inline(always)]
    fn load(self, x: &Eight) -> __m256 {
        pulp::cast(x.0)
    }
    #[inline(always)]
    fn store(self, x: __m256) -> Eight {
        Eight(pulp::cast(x))
    }
    #[inline(always)]
    fn add(self, a: __m256, b: __m256) -> __m256 {
        self.avx._mm256_add_ps(a, b)
    }
    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        self.avx._mm256_sub_ps(a, b)
    }
    #[inline(always)]
    fn mul(self, a: __m256, b: __m256) -> __m256 {
        self.avx._mm256_mul_ps(a, b)
    }
    #[inline(always)]
    fn div(self, a: __m256, b: __m256) -> __m256 {
        self.avx._mm256_div_ps(a, b)
    }
    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        self.avx._mm256_max_ps(a, b)
    }
    #[inline(always)]
    fn min(self, a: __m256, b: __m256) -> __m256 {
        self.avx._mm256_min_ps(a, b)
    }
    #[inline(always)]
    fn sqrt(self, a: __m256) -> __m256 {
        self.avx._mm256_sqrt_ps(a)
    }
    #[inline(always)]
    fn if_less(self, a: __m256, b: __m256, yes: __m256, no: __m256) -> __m256 {
        let less = self.avx._mm256_cmp_ps::<{ std::arch::x86_64::_CMP_LT_OQ }>(a, b);
        self.avx._mm256_blendv_ps(no, yes, less)
    }
    #[inline(always)]
    fn somewhere_less(self, a: __m256, b: __m256) -> bool {
        let less = self.avx._mm256_cmp_ps::<{ std::arch::x86_64::_CMP_LT_OQ }>(a, b);
        self.avx._mm256_movemask_ps(less) != 0
    }
    #[inline(always)]
    fn pair(self, one: __m256, other: __m256) -> __m256 {
        let low = self.avx2._mm256_srli_epi32::<16>(pulp::cast(half(self, other)));
        self.avx._mm256_or_ps(half(self, one), pulp::cast(low))
    }
    #[inline(always)]
    fn parts(self, pair: __m256) -> (__m256, __m256) {
        let low = self.avx2._mm256_slli_epi32::<16>(pulp::cast(pair));
        (self.avx._mm256_and_ps(pair, upper(self)), pulp::cast(low))
    }
    #[inline(always)]
    fn turn(self, r: [__m256; WIDTH]) -> [__m256; WIDTH] {
        let low = quarter(self, woven(self, r[0], r[1]), woven(self, r[2], r[3]));
        let high = quarter(self, woven(self, r[4], r[5]), woven(self, r[6], r[7]));
        let avx = self.avx;
        [
            avx._mm256_permute2f128_ps::<0x20>(low[0], high[0]),
            avx._mm256_permute2f128_ps::<0x20>(low[1], high[1]),
            avx._mm256_permute2f128_ps::<0x20>(low[2], high[2]),
            avx._mm256_permute2f128_ps::<0x20>(low[3], high[3]),
            avx._mm256_permute2f128_ps::<0x31>(low[0], high[0]),
            avx._mm256_permute2f128_ps::<0x31>(low[1], high[1]),
            avx._mm256_permute2f128_ps::<0x31>(low[2], high[2]),
            avx._mm256_permute2f128_ps::<0x31>(low[3], high[3]),
        ]
    }
    #[inline(always)]
    fn columns(self, [a, b, c, d, e, f, g, h]: [Quad; WIDTH]) -> [__m256; 4] {
        let (ae, bf) = (both(self, a, e), both(self, b, f));
        let (cg, dh) = (both(self, c, g), both(self, d, h));
        quarter(self, woven(self, ae, bf), woven(self, cg, dh))
    }
    #[inline(always)]
    fn rows(self, [a, b, c, d]: [__m256; 4]) -> [Quad; WIDTH] {
        let pairs = quarter(self, woven(self, a, b), woven(self, c, d));
        let mut out = [Quad::default(); WIDTH];
        for k in 0..4 {
            let [low, high]: [[f32; 4]; 2] = pulp::cast(pairs[k]);
            (out[k], out[4 + k]) = (Quad(low), Quad(high));
        }
        out
    }
    #[inline(always)]
    fn run<J: Job>(self, job: J) -> J::Output {
        struct Behind<J>(V3, J);
        impl<J: Job> pulp::NullaryFnOnce for Behind<J> {
            type Output = J::Output;
            #[inline(always)]
            fn call(self) -> J::Output {
                self.1.work(self.0)
            }
        }
        self.vectorize(Behind(self, job))
    }
}
