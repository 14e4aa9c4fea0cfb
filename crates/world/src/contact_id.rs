//! Names of contacts from step to step, by the serials of their bodies and a feature of their shapes. Knows no shapes.

/// A contact's name from its bodies' serials and its feature: a fixed mixing of bits (SplitMix64's).
pub fn contact_id(a: u64, b: u64, feature: u64) -> u64 {
    PairId::of((a, b)).contact(feature)
}

/// What the names of a pair's contacts have in common.
#[derive(Clone, Copy)]
pub(crate) struct PairId(u64);

impl PairId {
    /// Of a pair by its serials.
    #[inline]
    pub fn of((a, b): (u64, u64)) -> Self {
        PairId(mix_bits(mix_bits(a.wrapping_add(0x9e37_79b9_7f4a_7c15)) ^ b))
    }
    /// The name of its contact with a feature.
    #[inline]
    pub fn contact(self, feature: u64) -> u64 {
        mix_bits(self.0 ^ feature)
    }
}

#[inline]
fn mix_bits(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
