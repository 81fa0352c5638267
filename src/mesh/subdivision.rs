//! How every patch is cut into elements: a quadtree a patch, as one row of bits; and where less than C1 continues.
//!
//! ```text
//! node --pre-order--> 1 = split, its four quarters follow; 0 = an element        2 x 2 elements: 1 0 0 0 0
//! ```
//! Elements of a mesh stand in the same order, so bits and elements name each other. Quarters are numbered as in
//! `split.rs`; their numbers, two bits a level, are an element's [`Place`] in its patch.

use serde::{Deserialize, Serialize};

use super::Discontinuity;
use crate::scene::MAX_ELEMENTS;

/// Deepest level of an element under its patch.
pub const MAX_LEVEL: u32 = 12;
/// Most elements that a subdivision may hold.
const MAX_LEAVES: usize = 4 * MAX_ELEMENTS as usize;
const LEVEL_BITS: u32 = 4;

/// Where an element lies in the quadtree of its patch. Places of elements of one patch order as the elements do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Place(
    /// Quarter numbers, two bits a level, the first at the top; the level in the lowest four bits.
    u32,
);

impl Place {
    /// The whole patch.
    pub const ROOT: Place = Place(0);

    /// Splits that lead to it: 0 for a whole patch, 1 for a quarter.
    pub fn level(self) -> u32 {
        self.0 & ((1 << LEVEL_BITS) - 1)
    }

    /// Quarter `k` of it.
    ///
    /// # Panics
    /// At [`MAX_LEVEL`].
    pub fn quarter(self, k: u32) -> Place {
        let level = self.level() + 1;
        assert!(level <= MAX_LEVEL && k < 4, "quarter {k} of a place at level {}", level - 1);
        Place((self.0 | k << (32 - 2 * level)) + 1)
    }

    /// The place that it is a quarter of; `None` for a whole patch.
    pub fn parent(self) -> Option<Place> {
        self.level().checked_sub(1).map(|level| self.at_level(level))
    }

    /// The place that holds it at `level`, at most its own.
    pub fn at_level(self, level: u32) -> Place {
        let level = level.min(self.level());
        // Two steps: a shift by all 32 bits is none.
        let kept = if level == 0 { 0 } else { u32::MAX << (32 - 2 * level) };
        Place(self.0 & kept | level)
    }

    /// The quarters that lead to it, from the patch down.
    pub fn quarters(self) -> impl Iterator<Item = u32> {
        (1..=self.level()).map(move |level| self.0 >> (32 - 2 * level) & 3)
    }
}

/// The quadtrees of all patches of a mesh.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Subdivision {
    n_patches: u32,
    n_bits: u64,
    /// Bit i in word i / 64, low bits first; the rest of the last word is 0.
    words: Vec<u64>,
    /// Edges of its elements across which less continues.
    discontinuities: Vec<Discontinuity>,
}

/// Why a subdivision is none, or not one of this scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubdivisionError {
    /// Made for another number of patches.
    #[error("subdivides {found} patches, the scene has {expected}")]
    Patches {
        /// Patches that it subdivides.
        found: u32,
        /// Patches of the scene.
        expected: u32,
    },
    /// Too few or too many bits.
    #[error("{n_bits} bits in {n_words} words do not make {n_patches} quadtrees")]
    Bits {
        /// Bits that it says to have.
        n_bits: u64,
        /// Words that it has.
        n_words: usize,
        /// Quadtrees that it should have.
        n_patches: u32,
    },
    /// An element deeper than [`MAX_LEVEL`].
    #[error("patch {patch} is split more than {MAX_LEVEL} times over")]
    TooDeep {
        /// Which patch.
        patch: u32,
    },
    /// A discontinuity where no edge is, or that is none.
    #[error("no discontinuity is possible on edge {edge} of element {element}")]
    Edge {
        /// Which element.
        element: u32,
        /// Which edge of it.
        edge: u8,
    },
    /// Discontinuities on elements that the balance of 2:1 has to split.
    #[error("discontinuities on trees that are not balanced 2:1")]
    Unbalanced,
    /// Over four times the largest mesh that a scene may ask for.
    #[error("over {MAX_LEAVES} elements")]
    TooMany,
}

impl Subdivision {
    /// The trees of `n_patches` patches in which exactly the nodes that `is_split` names are split.
    pub fn new(n_patches: u32, mut is_split: impl FnMut(u32, Place) -> bool) -> Subdivision {
        let mut made = Subdivision { n_patches, n_bits: 0, words: Vec::new(), discontinuities: Vec::new() };
        let mut open = Vec::new();
        for patch in 0..n_patches {
            open.push(Place::ROOT);
            while let Some(place) = open.pop() {
                let split = place.level() < MAX_LEVEL && is_split(patch, place);
                made.push(split);
                if split {
                    open.extend((0..4).rev().map(|k| place.quarter(k)));
                }
            }
        }
        made
    }

    fn push(&mut self, bit: bool) {
        let at = self.n_bits % 64;
        if at == 0 {
            self.words.push(0);
        }
        if let Some(word) = self.words.last_mut() {
            *word |= u64::from(bit) << at;
        }
        self.n_bits += 1;
    }

    /// The same elements, with less than C1 across these edges of theirs, and no others.
    pub fn with_discontinuities(self, discontinuities: Vec<Discontinuity>) -> Subdivision {
        Subdivision { discontinuities, ..self }
    }

    /// Edges of its elements across which less than C1 continues.
    pub fn discontinuities(&self) -> &[Discontinuity] {
        &self.discontinuities
    }

    /// How many patches it subdivides.
    pub fn n_patches(&self) -> u32 {
        self.n_patches
    }

    /// How many elements it makes.
    pub fn n_elements(&self) -> u64 {
        // Every split adds three.
        u64::from(self.n_patches) + 3 * self.words.iter().map(|w| u64::from(w.count_ones())).sum::<u64>()
    }

    /// Memory that it holds (bytes).
    pub fn memory_bytes(&self) -> usize {
        self.words.capacity() * size_of::<u64>()
            + self.discontinuities.capacity() * size_of::<Discontinuity>()
    }

    /// Elements of all patches, patch by patch in order.
    ///
    /// # Errors
    /// When the bits are not `n_patches` quadtrees of bounded depth and size: what came from a file is checked here.
    pub fn leaves(&self) -> Result<Vec<(u32, Place)>, SubdivisionError> {
        let wrong = SubdivisionError::Bits {
            n_bits: self.n_bits,
            n_words: self.words.len(),
            n_patches: self.n_patches,
        };
        if self.n_bits.div_ceil(64) != self.words.len() as u64 || u64::from(self.n_patches) > self.n_bits {
            return Err(wrong);
        }
        let mut leaves = Vec::with_capacity((self.n_bits as usize).min(MAX_LEAVES));
        let mut at = 0;
        let mut open = Vec::new();
        for patch in 0..self.n_patches {
            open.push(Place::ROOT);
            while let Some(place) = open.pop() {
                if at == self.n_bits {
                    return Err(wrong);
                }
                let split = self.words[(at / 64) as usize] >> (at % 64) & 1 == 1;
                at += 1;
                if !split {
                    leaves.push((patch, place));
                } else if place.level() == MAX_LEVEL {
                    return Err(SubdivisionError::TooDeep { patch });
                } else {
                    open.extend((0..4).rev().map(|k| place.quarter(k)));
                }
                if leaves.len() + open.len() > MAX_LEAVES {
                    return Err(SubdivisionError::TooMany);
                }
            }
        }
        let last = self.n_bits % 64;
        let clean = last == 0 || self.words.last().is_none_or(|w| w >> last == 0);
        if at != self.n_bits || !clean {
            return Err(wrong);
        }
        Ok(leaves)
    }

    /// The same with some elements split once more; without discontinuities, which lie on the elements that were.
    ///
    /// # Panics
    /// When `split` has not one flag an element.
    pub fn split(&self, split: &[bool]) -> Subdivision {
        assert_eq!(split.len() as u64, self.n_elements(), "one flag an element");
        let mut made = Subdivision {
            n_patches: self.n_patches,
            n_bits: 0,
            words: Vec::new(),
            discontinuities: Vec::new(),
        };
        let mut flags = split.iter();
        for at in 0..self.n_bits {
            let node = self.words[(at / 64) as usize] >> (at % 64) & 1 == 1;
            let now = node || flags.next() == Some(&true);
            made.push(now);
            if now && !node {
                (0..4).for_each(|_| made.push(false));
            }
        }
        made
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn place_of_quarters_knows_its_way_up_and_orders_like_the_tree() {
        let place = Place::ROOT.quarter(3).quarter(0).quarter(2);
        assert_eq!((place.level(), place.quarters().collect::<Vec<_>>()), (3, vec![3, 0, 2]));
        assert_eq!(place.parent(), Some(Place::ROOT.quarter(3).quarter(0)));
        assert_eq!(place.at_level(0), Place::ROOT);
        assert_eq!(place.at_level(9), place);
        assert!(Place::ROOT.quarter(3).quarter(0) < place && place < Place::ROOT.quarter(3).quarter(1));
        assert!(Place::ROOT.quarter(2).quarter(3) < Place::ROOT.quarter(3));
    }

    #[test]
    fn subdivision_from_damaged_bits_is_refused_by_name() {
        let good = Subdivision::new(3, |_, place| place.level() < 1);
        assert_eq!(good.leaves().unwrap().len(), 12);
        let short = Subdivision { n_bits: 14, ..good.clone() };
        assert!(matches!(short.leaves(), Err(SubdivisionError::Bits { .. })));
        let long = Subdivision { n_bits: 16, ..good.clone() };
        assert!(matches!(long.leaves(), Err(SubdivisionError::Bits { .. })));
        let dirty = Subdivision { words: vec![good.words[0] | 1 << 60], ..good.clone() };
        assert!(matches!(dirty.leaves(), Err(SubdivisionError::Bits { .. })));
        let many = Subdivision { n_bits: u64::MAX, n_patches: u32::MAX, ..good.clone() };
        assert!(matches!(many.leaves(), Err(SubdivisionError::Bits { .. })));
        let deep =
            Subdivision { n_patches: 1, n_bits: 64, words: vec![u64::MAX], discontinuities: Vec::new() };
        assert_eq!(deep.leaves(), Err(SubdivisionError::TooDeep { patch: 0 }));
    }

    proptest! {
        #[test]
        fn subdivision_of_any_trees_decodes_to_the_same_leaves(seed: u64, n in 0..20u32) {
            let coin = |p: u32, place: Place| {
                let id = place.quarters().fold(1, |id, q| 4 * id + u64::from(q));
                place.level() < 5 && crate::sampling::hash(seed, p.into(), id) % 10 < 4
            };
            let made = Subdivision::new(n, coin);
            let leaves = made.leaves().unwrap();
            prop_assert_eq!(leaves.len() as u64, made.n_elements());
            prop_assert!(leaves.is_sorted());
            for (patch, place) in &leaves {
                prop_assert!(!coin(*patch, *place));
                prop_assert!((0..place.level()).all(|l| coin(*patch, place.at_level(l))));
            }
            let bytes = postcard::to_stdvec(&made).unwrap();
            prop_assert_eq!(&postcard::from_bytes::<Subdivision>(&bytes).unwrap(), &made);
            // Splitting every leaf is one level more everywhere.
            let all = made.split(&vec![true; leaves.len()]);
            prop_assert_eq!(all.n_elements(), 4 * made.n_elements());
            let twice: Vec<_> = leaves.iter().flat_map(|&(p, l)| (0..4).map(move |k| (p, l.quarter(k)))).collect();
            prop_assert_eq!(all.leaves().unwrap(), twice);
        }
    }
}
