//! Which pixels are shown, and which need rays for them.
//!
//! ```text
//! Region (shown) --+ filter's reach--> needed --to whole tiles--> refined --+ 1 pixel of neighbours--> based
//! ```
//! Without adaptive sampling only `needed` pixels get rays. Tiles and bands are always those of the whole picture, so
//! that a pixel of a region has the bits that it has in the whole picture.

use serde::{Deserialize, Serialize};

use crate::render::camera::TILE;

/// A rectangle of pixels, from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
}

/// A region that is no part of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "region {},{},{},{} (x, y, width, height) does not lie in the picture of {width} x {height} pixels",
    .region.x, .region.y, .region.width, .region.height
)]
pub struct RegionError {
    /// As asked for.
    pub region: Region,
    /// Columns of the picture.
    pub width: u32,
    /// Rows of the picture.
    pub height: u32,
}

impl Region {
    /// A whole picture.
    pub fn whole(width: u32, height: u32) -> Region {
        Region { x: 0, y: 0, width, height }
    }

    /// Checks that it has pixels, all of them in a picture of `width` x `height`.
    ///
    /// # Errors
    /// [`RegionError`] with both.
    pub fn check(self, width: u32, height: u32) -> Result<(), RegionError> {
        let fits = |at: u32, n: u32, all: u32| n > 0 && at.checked_add(n).is_some_and(|end| end <= all);
        if fits(self.x, self.width, width) && fits(self.y, self.height, height) {
            Ok(())
        } else {
            Err(RegionError { region: self, width, height })
        }
    }

    /// How many pixels.
    pub fn n_pixels(self) -> usize {
        self.width as usize * self.height as usize
    }

    /// True when it has pixel (x, y).
    pub fn contains(self, x: u32, y: u32) -> bool {
        self.index(x, y).is_some()
    }

    /// Number of pixel (x, y) in it, row by row.
    pub(super) fn index(self, x: u32, y: u32) -> Option<usize> {
        let (column, row) = (x.checked_sub(self.x)?, y.checked_sub(self.y)?);
        (column < self.width && row < self.height)
            .then_some(row as usize * self.width as usize + column as usize)
    }

    /// Pixel number `i`.
    pub(super) fn pixel(self, i: usize) -> (u32, u32) {
        let width = self.width as usize;
        (self.x + (i % width) as u32, self.y + (i / width) as u32)
    }

    /// With `by` pixels around, inside of `picture`.
    fn grown(self, by: u32, picture: Region) -> Region {
        let (x, y) = (self.x.saturating_sub(by), self.y.saturating_sub(by));
        let right = (self.x + self.width + by).min(picture.width);
        let bottom = (self.y + self.height + by).min(picture.height);
        Region { x, y, width: right - x, height: bottom - y }
    }

    /// Out to whole camera tiles, inside of `picture`.
    fn tiled(self, picture: Region) -> Region {
        let (x, y) = (self.x / TILE * TILE, self.y / TILE * TILE);
        let right = (self.x + self.width).next_multiple_of(TILE).min(picture.width);
        let bottom = (self.y + self.height).next_multiple_of(TILE).min(picture.height);
        Region { x, y, width: right - x, height: bottom - y }
    }

    /// True when the two share a pixel.
    pub(super) fn touches(self, other: Region) -> bool {
        let overlap = |a: u32, n: u32, b: u32, m: u32| a < b + m && b < a + n;
        overlap(self.x, self.width, other.x, other.width)
            && overlap(self.y, self.height, other.y, other.height)
    }
}

/// The pixels of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pixels {
    /// The picture that the camera sees.
    pub picture: Region,
    /// What is shown.
    pub shown: Region,
    /// What gets more rays where it needs them; empty of meaning without adaptive sampling.
    pub refined: Region,
    /// What gets the first rays.
    pub based: Region,
}

impl Pixels {
    /// For `shown` of a picture, a filter that reaches so many pixels, with or without adaptive sampling.
    pub fn new(picture: Region, shown: Region, reach: u32, adaptive: bool) -> Pixels {
        let needed = shown.grown(reach, picture);
        let refined = if adaptive { needed.tiled(picture) } else { needed };
        let based = if adaptive { refined.grown(1, picture) } else { needed };
        Pixels { picture, shown, refined, based }
    }

    /// Column and row of a pixel by its index in the whole picture.
    pub fn place(&self, pixel: usize) -> (u32, u32) {
        self.picture.pixel(pixel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn region_in_a_picture_is_taken_and_one_that_leaves_it_is_refused_with_both_sizes() {
        let region = |x, y, width, height| Region { x, y, width, height };
        for good in [region(0, 0, 1, 1), region(3, 2, 7, 6), region(9, 7, 1, 1), region(0, 0, 10, 8)] {
            good.check(10, 8).unwrap();
        }
        for bad in [
            region(0, 0, 0, 1),
            region(0, 0, 1, 0),
            region(4, 2, 7, 6),
            region(3, 3, 7, 6),
            region(10, 0, 1, 1),
            region(u32::MAX, 0, 2, 1),
        ] {
            let e = bad.check(10, 8).unwrap_err().to_string();
            assert!(e.contains(&format!("{},{},{},{}", bad.x, bad.y, bad.width, bad.height)), "{e}");
            assert!(e.contains("10 x 8"), "{e}");
        }
    }

    #[test]
    fn pixels_of_a_region_are_numbered_row_by_row() {
        let region = Region { x: 3, y: 5, width: 4, height: 2 };
        let all: Vec<_> = (0..region.n_pixels()).map(|i| region.pixel(i)).collect();
        assert_eq!(all, [(3, 5), (4, 5), (5, 5), (6, 5), (3, 6), (4, 6), (5, 6), (6, 6)]);
        for (i, (x, y)) in all.into_iter().enumerate() {
            assert_eq!(region.index(x, y), Some(i));
        }
        for (x, y) in [(2, 5), (7, 5), (3, 4), (3, 7)] {
            assert_eq!(region.index(x, y), None);
        }
    }

    #[test]
    fn pixels_for_a_region_reach_as_far_as_the_filter_and_for_adaptive_sampling_to_tiles_and_their_neighbours()
     {
        let picture = Region::whole(100, 40);
        let shown = Region { x: 18, y: 1, width: 5, height: 3 };
        let plain = Pixels::new(picture, shown, 2, false);
        assert_eq!(plain.based, Region { x: 16, y: 0, width: 9, height: 6 });
        let adaptive = Pixels::new(picture, shown, 2, true);
        assert_eq!(adaptive.refined, Region { x: 16, y: 0, width: 16, height: 8 });
        assert_eq!(adaptive.based, Region { x: 15, y: 0, width: 18, height: 9 });
        let whole = Pixels::new(picture, picture, 2, true);
        assert_eq!((whole.refined, whole.based), (picture, picture));
    }
}
