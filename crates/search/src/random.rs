//! Deterministic pseudo-random numbers, for perturbations and restarts.

/// Deterministic pseudo-random numbers (`SplitMix64`).
pub struct Random(pub u64);

impl Random {
    /// Returns a number from 0 to `limit - 1`; `limit` is at least 1.
    pub fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        let limit = limit.max(1) as u64;
        usize::try_from((z ^ (z >> 31)).checked_rem(limit).unwrap_or(0)).unwrap_or(0)
    }
}
