//! Repeatable randomness: every sampling pattern is a hash of (seed, who asks), never of time or order.
//!
//! ```text
//! seed, ids --splitmix64 per word--> 64 bits --> [0, 1)
//! ```
//! Source: Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators" (the finaliser).

/// A well-mixed function of a seed and two ids.
pub(crate) fn hash(seed: u64, a: u64, b: u64) -> u64 {
    mix(mix(mix(seed).wrapping_add(a)).wrapping_add(b))
}

/// A bijective hash of a word.
pub(crate) fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

/// The upper 32 bits and the lower 32 bits of a hash as two numbers in [0, 1).
pub(crate) fn unit_pair(hash: u64) -> [f64; 2] {
    let unit = |bits: u64| bits as f64 / 4_294_967_296.0;
    [unit(hash >> 32), unit(hash & 0xffff_ffff)]
}

/// Van der Corput's sequence in base 2.
pub(crate) fn radical_inverse(k: u32) -> f64 {
    f64::from(k.reverse_bits()) * (1.0 / 4_294_967_296.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hash_of_neighbouring_ids_spreads_evenly_over_four_strata() {
        let mut counts = [0; 4];
        for id in 0..4000 {
            counts[(hash(1, id / 40, id) % 4) as usize] += 1;
        }
        assert!(counts.iter().all(|c| (850..1150).contains(c)), "{counts:?}");
    }

    #[test]
    fn unit_pair_of_many_hashes_has_mean_one_half() {
        let n = 10_000;
        let sum =
            (0..n).map(|i| unit_pair(hash(7, 3, i))).fold([0.0, 0.0], |s, u| [s[0] + u[0], s[1] + u[1]]);
        assert!(sum.iter().all(|s| (s / n as f64 - 0.5).abs() < 0.02), "{sum:?}");
    }
}
