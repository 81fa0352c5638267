//! The pinhole camera as ray bundles: 8 x 8 pixels a tile, tiles in Morton order.
//!
//! ```text
//! Camera, picture size --> View --tile, sample--> RayBundle::Tile (corner + i step_u + j step_v)
//! ```
//! Pixel (x, y) from the top left; direction = forward + X right + Y up with X, Y on the plane at distance 1.

use glam::DVec3;

use crate::raycast::RayBundle;
use crate::scene::Camera;

/// Side of a camera tile (pixels).
pub(super) const TILE: u32 = 8;

/// A camera and a picture size.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    eye: DVec3,
    /// Direction to the picture's top left corner.
    corner: DVec3,
    step_x: DVec3,
    step_y: DVec3,
}

/// Up to 8 x 8 pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tile {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub n: u32,
    /// Rows.
    pub m: u32,
}

impl View {
    pub fn new(camera: &Camera, width: u32, height: u32) -> View {
        let forward = (camera.target - camera.eye).normalize();
        let right = forward.cross(camera.up).normalize();
        let up = right.cross(forward);
        let half_height = (0.5 * camera.fov_y_deg.to_radians()).tan();
        let pixel = 2.0 * half_height / f64::from(height);
        let (step_x, step_y) = (pixel * right, -pixel * up);
        let corner = forward - 0.5 * f64::from(width) * step_x - 0.5 * f64::from(height) * step_y;
        View { eye: camera.eye, corner, step_x, step_y }
    }

    /// The rays of `tile` through the place [0,1)^2 of each pixel.
    pub fn bundle(&self, tile: &Tile, [dx, dy]: [f64; 2]) -> RayBundle {
        let (x, y) = (f64::from(tile.x) + dx, f64::from(tile.y) + dy);
        RayBundle::Tile {
            apex: self.eye,
            corner: self.corner + x * self.step_x + y * self.step_y,
            step_u: self.step_x,
            step_v: self.step_y,
            n: tile.n,
            m: tile.m,
        }
    }
}

impl Tile {
    /// Its rays, one a pixel.
    pub fn n_rays(&self) -> usize {
        (self.n * self.m) as usize
    }

    /// True when it has pixel (x, y).
    pub fn contains(&self, x: u32, y: u32) -> bool {
        (self.x..self.x + self.n).contains(&x) && (self.y..self.y + self.m).contains(&y)
    }

    /// Index of the pixel of ray `i` in a picture `width` wide.
    pub fn pixel(&self, i: usize, width: u32) -> usize {
        let (column, row) = (i as u32 % self.n, i as u32 / self.n);
        (self.y + row) as usize * width as usize + (self.x + column) as usize
    }
}

/// All tiles of a picture along the Morton curve: neighbours on it see the same patches.
pub(super) fn morton_tiles(width: u32, height: u32) -> Vec<Tile> {
    let mut tiles = Vec::new();
    for y in (0..height).step_by(TILE as usize) {
        for x in (0..width).step_by(TILE as usize) {
            tiles.push(Tile { x, y, n: TILE.min(width - x), m: TILE.min(height - y) });
        }
    }
    tiles.sort_by_key(|t| spread_bits(t.x / TILE) | spread_bits(t.y / TILE) << 1);
    tiles
}

/// Bit i of `x` to bit 2 i.
fn spread_bits(x: u32) -> u64 {
    (0..32).map(|i| u64::from(x >> i & 1) << (2 * i)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera { eye: DVec3::ZERO, target: DVec3::new(0.0, 0.0, -2.0), up: DVec3::Y, fov_y_deg: 90.0 }
    }

    #[test]
    fn tiles_of_any_picture_cover_every_pixel_once() {
        for (width, height) in [(1, 1), (8, 8), (19, 9), (33, 40)] {
            let mut seen = vec![0; (width * height) as usize];
            for tile in morton_tiles(width, height) {
                for i in 0..(tile.n * tile.m) as usize {
                    seen[tile.pixel(i, width)] += 1;
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{width} x {height}");
        }
    }

    #[test]
    fn tiles_of_a_square_picture_follow_the_morton_curve() {
        let order: Vec<_> = morton_tiles(32, 32).iter().take(8).map(|t| (t.x / 8, t.y / 8)).collect();
        assert_eq!(order, [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (3, 0), (2, 1), (3, 1)]);
    }

    #[test]
    fn view_through_a_single_pixel_looks_at_the_target_and_corners_span_the_field_of_view() {
        let view = View::new(&camera(), 1, 1);
        let tile = morton_tiles(1, 1)[0];
        assert!((view.bundle(&tile, [0.5; 2]).ray(0).dir - DVec3::NEG_Z).length() < 1e-15);
        let view = View::new(&camera(), 16, 8);
        assert!((view.corner - DVec3::new(-2.0, 1.0, -1.0)).length() < 1e-12, "{}", view.corner);
    }
}
