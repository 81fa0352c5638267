//! Conversions between machine integers, each with its width effect in its name or first line.

/// Widens a 32-bit word to an index: lossless where `usize` has 32 bits or more.
#[inline]
pub(crate) fn index(word: u32) -> usize {
    word as usize
}

/// Narrows to 8 bits by clamping to 0..=255.
#[inline]
pub(crate) fn clamp_to_u8(value: i64) -> u8 {
    u8::try_from(value.clamp(0, 255)).unwrap_or(u8::MAX)
}

/// Narrows to 64 bits by clamping.
#[inline]
pub(crate) fn clamp_to_i64(value: i128) -> i64 {
    i64::try_from(value.clamp(i128::from(i64::MIN), i128::from(i64::MAX))).unwrap_or(0)
}

/// Narrows a count to 32 bits by clamping; a patch memory has fewer than 2^32 words.
#[inline]
pub(crate) fn word_count(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

/// Rounds a real number to the nearest 32-bit word, ties to even; clamps, and NaN gives 0.
pub(crate) fn round_to_word(value: f64) -> i32 {
    libm::rint(value) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clamp_words_at_and_beyond_their_bits_keep_or_clamp() {
        let ends = [i64::MIN, -1, 0, 1, i64::MAX];
        assert_eq!(ends.map(|word| clamp_to_i64(i128::from(word))), ends);
        assert_eq!([i128::MIN, i128::from(i64::MIN) - 1].map(clamp_to_i64), [i64::MIN; 2]);
        assert_eq!([i128::MAX, i128::from(i64::MAX) + 1].map(clamp_to_i64), [i64::MAX; 2]);
        assert_eq!([-1, 0, 255, 256].map(clamp_to_u8), [0, 0, 255, 255]);
        assert_eq!(word_count(7), 7);
    }
}
