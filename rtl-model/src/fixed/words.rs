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

/// Narrows a count to 32 bits by clamping; a patch memory has fewer than 2^32 words.
#[inline]
pub(crate) fn word_count(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

/// Rounds a real number to the nearest 32-bit word, ties to even; clamps, and NaN gives 0.
pub(crate) fn round_to_word(value: f64) -> i32 {
    libm::rint(value) as i32
}
