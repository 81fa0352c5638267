//! Words to build a pair from, and the numbers that are made of them.

/// Words of one pair. Words of 0 build the simplest pair, so shrinking them shrinks the pair.
pub type Words = [i32; 32];

/// Takes words one after the other; beyond the last it begins anew.
pub struct Draw<'a> {
    words: &'a Words,
    next: usize,
}

impl<'a> Draw<'a> {
    /// From the first word on.
    pub fn new(words: &'a Words) -> Draw<'a> {
        Draw { words, next: 0 }
    }

    /// A word of any value.
    pub fn word(&mut self) -> i32 {
        let word = self.words[self.next % self.words.len()];
        self.next += 1;
        word
    }

    /// From -2^bits up to, not including, 2^bits; `bits` up to 31.
    pub fn signed(&mut self, bits: u32) -> i32 {
        self.word() >> (31 - bits)
    }

    /// Three of [`Draw::signed`].
    pub fn signed_point(&mut self, bits: u32) -> [i32; 3] {
        [0; 3].map(|_| self.signed(bits))
    }

    /// From 0 up to, not including, n.
    pub fn below(&mut self, n: u32) -> u32 {
        self.word().unsigned_abs() % n
    }

    /// One of the values.
    pub fn of<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.word().unsigned_abs() as usize % values.len()]
    }
}

/// SplitMix64 (Steele, Lea, Flood 2014): words for the long runs.
pub struct SplitMix {
    state: u64,
}

impl SplitMix {
    /// One stream a seed.
    pub fn new(seed: u64) -> SplitMix {
        SplitMix { state: seed }
    }

    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Words of one pair.
    pub fn words(&mut self) -> Words {
        let mut words = [0; 32];
        for two in words.chunks_exact_mut(2) {
            let bits = self.next();
            two[0] = (bits as u32).cast_signed();
            two[1] = ((bits >> 32) as u32).cast_signed();
        }
        words
    }
}
