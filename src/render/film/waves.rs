//! Camera rays by the wave: a sample of the pixels of a band of tiles.
//!
//! ```text
//! all pixels of the tiles --> a bundle a tile
//! some of them            --> rectangles of wanted pixels: a bundle each where it holds four or more, else explicit rays
//! ```
//! What goes down depends on the tile and its wanted pixels alone.

use crate::raycast::{CastError, Purpose, Query, RayBundle, RayCaster, RayHit};
use crate::render::camera::{Tile, View};
use crate::render::shader::CameraRay;

/// Rays from which on a descriptor is less to send than the rays themselves, and worth a bundle.
const MIN_BUNDLE_RAYS: usize = 4;

/// One sample of some pixels, not yet cast.
#[derive(Debug, Default)]
pub(super) struct Wave {
    bundles: Vec<RayBundle>,
    bundled: Vec<CameraRay>,
    alone: Vec<CameraRay>,
}

/// Which of a pixel's rays, and where it goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub number: u32,
    pub place: [f64; 2],
}

impl Wave {
    /// One ray of every pixel of the tiles, in a picture `width` wide.
    pub fn of_tiles(view: &View, tiles: &[Tile], sample: Sample, width: u32) -> Wave {
        let mut wave = Wave::default();
        for tile in tiles {
            wave.push(view, tile, sample, width);
        }
        wave
    }

    /// One ray of every pixel of the tiles that is wanted.
    pub fn of_wanted(
        view: &View,
        tiles: &[Tile],
        sample: Sample,
        width: u32,
        wanted: &dyn Fn(u32, u32) -> bool,
    ) -> Wave {
        let mut wave = Wave::default();
        for tile in tiles {
            for part in rectangles(tile, wanted) {
                if part.n_rays() >= MIN_BUNDLE_RAYS {
                    wave.push(view, &part, sample, width);
                } else {
                    let bundle = view.bundle(&part, sample.place);
                    let rays = (0..part.n_rays()).map(|i| camera_ray(&bundle, &part, i, sample, width));
                    wave.alone.extend(rays);
                }
            }
        }
        wave
    }

    fn push(&mut self, view: &View, tile: &Tile, sample: Sample, width: u32) {
        let bundle = view.bundle(tile, sample.place);
        self.bundled.extend((0..tile.n_rays()).map(|i| camera_ray(&bundle, tile, i, sample, width)));
        self.bundles.push(bundle);
    }

    pub fn n_rays(&self) -> usize {
        self.bundled.len() + self.alone.len()
    }

    /// Its rays and what they hit.
    pub fn cast(
        mut self,
        caster: &mut dyn RayCaster,
    ) -> Result<(Vec<CameraRay>, Vec<Option<RayHit>>), CastError> {
        let mut hits = Vec::new();
        if !self.bundles.is_empty() {
            hits = caster.closest_hits(Purpose::Primary, Query::Bundles(&self.bundles))?;
        }
        if !self.alone.is_empty() {
            let rays: Vec<_> = self.alone.iter().map(|ray| ray.ray).collect();
            hits.extend(caster.closest_hits(Purpose::Primary, Query::Rays(&rays))?);
        }
        self.bundled.append(&mut self.alone);
        Ok((self.bundled, hits))
    }
}

fn camera_ray(bundle: &RayBundle, tile: &Tile, i: usize, sample: Sample, width: u32) -> CameraRay {
    CameraRay { ray: bundle.ray(i), pixel: tile.pixel(i, width), sample: sample.number }
}

/// The wanted pixels of a tile as rectangles: from each pixel that none has yet as far right as it goes, then as far down.
fn rectangles(tile: &Tile, wanted: &dyn Fn(u32, u32) -> bool) -> Vec<Tile> {
    let mut left = 0_u64;
    let bit = |column: u32, row: u32| 1_u64 << (row * tile.n + column);
    for row in 0..tile.m {
        for column in 0..tile.n {
            if wanted(tile.x + column, tile.y + row) {
                left |= bit(column, row);
            }
        }
    }
    let mut parts = Vec::new();
    while left != 0 {
        let first = left.trailing_zeros();
        let (column, row) = (first % tile.n, first / tile.n);
        let n = (column..tile.n).take_while(|c| left & bit(*c, row) != 0).count() as u32;
        let run = |row: u32| (column..column + n).map(|c| bit(c, row)).fold(0, |all, b| all | b);
        let m = (row..tile.m).take_while(|r| left & run(*r) == run(*r)).count() as u32;
        left &= !(row..row + m).map(run).fold(0, |all, b| all | b);
        parts.push(Tile { x: tile.x + column, y: tile.y + row, n, m });
    }
    parts
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn rectangles_of_a_full_tile_are_the_tile_and_of_a_frame_its_sides() {
        let tile = Tile { x: 16, y: 8, n: 8, m: 5 };
        assert_eq!(rectangles(&tile, &|_, _| true), [tile]);
        assert!(rectangles(&tile, &|_, _| false).is_empty());
        let frame = rectangles(&tile, &|x, y| x == 16 || x == 23 || y == 8 || y == 12);
        assert_eq!(frame.iter().map(Tile::n_rays).collect::<Vec<_>>(), [8, 4, 4, 6]);
    }

    proptest! {
        #[test]
        fn rectangles_cover_every_wanted_pixel_once_and_no_other(mask: u64, n in 1_u32..=8, m in 1_u32..=8) {
            let tile = Tile { x: 24, y: 40, n, m };
            let wanted = |x: u32, y: u32| mask >> ((y - 40) * 8 + (x - 24)) & 1 == 1;
            let mut covered = vec![0; 64];
            for part in rectangles(&tile, &wanted) {
                for i in 0..part.n_rays() {
                    let pixel = part.pixel(i, 100) as u32;
                    covered[((pixel / 100 - 40) * 8 + pixel % 100 - 24) as usize] += 1;
                }
            }
            for y in 40..48 {
                for x in 24..32 {
                    let inside = tile.contains(x, y) && wanted(x, y);
                    prop_assert_eq!(covered[((y - 40) * 8 + x - 24) as usize], i32::from(inside));
                }
            }
        }
    }
}
