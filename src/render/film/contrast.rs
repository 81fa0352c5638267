//! Which pixels want more rays.
//!
//! ```text
//! rays of a pixel --tone (sRGB of the exposed luminance, 0..1)--> mean, standard error; first hits --> Signature
//! after the first rays: another signature next to it, |mean - neighbour's mean| > contrast, or standard error > contrast / 4
//! later:                standard error > contrast / 4
//! ```
//! Tones, because the eye is the judge: where the picture is white or black nothing needs sampling. The exposure is the
//! user's, or found by a look of 32 x 32 rays at the whole picture, so that a region does not change it.
//! Source: Mitchell 1987, "Generating antialiased images at low sampling densities" (contrast between neighbours).

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::region::Region;
use crate::image::Exposure;
use crate::image::png::srgb_encode;
use crate::mesh::Mesh;
use crate::raycast::{Facing, RayHit};
use crate::scene::{MaterialId, Scene, SurfaceId};
use crate::units::Rgb;

/// Adaptive image sampling.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveSampling {
    /// Most camera rays of a pixel, up to 16.
    pub max: u32,
    /// Difference of tones (0..1) between neighbours that calls for more rays.
    pub contrast: f64,
    /// Exposure by which radiance becomes a tone.
    pub exposure: Exposure,
}

/// The usual threshold, measured on the Cornell box.
pub const CONTRAST: f64 = 0.03;

impl AdaptiveSampling {
    /// Up to `max` rays, by the usual contrast and the picture's own exposure.
    pub fn up_to(max: u32) -> AdaptiveSampling {
        AdaptiveSampling { max, contrast: CONTRAST, exposure: Exposure::Auto }
    }
}

/// Standard error that calls for more rays, as a part of the contrast between neighbours that does.
const ERROR_SHARE: f64 = 0.25;

/// Normals of one surface that differ by more than this (cosine of 30 degrees) are an edge: more than facets of a ball do.
const EDGE_COSINE: f64 = 0.866;

/// Normals and distances (share of 1 m and the distance) that differ by less are of one plane.
const PLANE: f64 = 1e-6;

/// The tone of a radiance (W/m^2/sr) that is `scale` times as bright on the display.
fn tone(radiance: Rgb, scale: f64) -> f64 {
    srgb_encode((radiance.luminance() * scale).clamp(0.0, 1.0))
}

/// What a ray meets first, as far as edges go: nothing, or a side of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Signature(Option<Side>);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Side {
    surface: SurfaceId,
    material: MaterialId,
    normal: DVec3,
    /// Of its patch's plane, along the normal (m).
    distance: f64,
    emits: bool,
}

impl Signature {
    pub fn of(scene: &Scene, mesh: &Mesh, hit: Option<RayHit>, emits: bool) -> Signature {
        Signature(hit.map(|hit| {
            let patch = &mesh.patches[hit.patch.0 as usize];
            let turn = if hit.facing == Facing::Front { 1.0 } else { -1.0 };
            let corner = mesh.vertices[patch.corners.vertices()[0].0 as usize].position;
            Side {
                surface: patch.surface,
                material: scene.surfaces[patch.surface.0 as usize].material,
                normal: turn * patch.normal,
                distance: turn * patch.normal.dot(corner),
                emits,
            }
        }))
    }

    /// True where there is an edge between the two.
    fn differs(&self, other: &Signature) -> bool {
        match (self.0, other.0) {
            (None, None) => false,
            (Some(one), Some(other)) => one.differs(&other),
            _ => true,
        }
    }
}

impl Side {
    /// Surfaces of one material in one plane have no edge between them.
    fn differs(&self, other: &Side) -> bool {
        let near = PLANE * (1.0 + self.distance.abs());
        let one_plane =
            self.normal.abs_diff_eq(other.normal, PLANE) && (self.distance - other.distance).abs() < near;
        let one_surface = self.surface == other.surface || self.material == other.material && one_plane;
        !one_surface || self.emits != other.emits || self.normal.dot(other.normal) < EDGE_COSINE
    }
}

/// What is known of a pixel's rays.
#[derive(Clone, Copy, Debug, Default)]
struct PixelTones {
    n: u32,
    sum: f64,
    sum_of_squares: f64,
    first: Option<Signature>,
    /// Not all rays have the first's signature.
    mixed: bool,
}

impl PixelTones {
    fn mean(&self) -> f64 {
        self.sum / f64::from(self.n.max(1))
    }

    /// Of the mean; 0 where one ray says nothing about it.
    fn standard_error(&self) -> f64 {
        if self.n < 2 {
            return 0.0;
        }
        let n = f64::from(self.n);
        let variance = (self.sum_of_squares - self.sum * self.sum / n) / (n - 1.0);
        (variance.max(0.0) / n).sqrt()
    }
}

/// The tones of a region's pixels.
#[derive(Debug)]
pub(super) struct Tones {
    region: Region,
    /// Display-linear value of unit radiance.
    scale: f64,
    contrast: f64,
    pixels: Vec<PixelTones>,
}

impl Tones {
    pub fn new(region: Region, scale: f64, contrast: f64) -> Tones {
        Tones { region, scale, contrast, pixels: vec![PixelTones::default(); region.n_pixels()] }
    }

    /// Takes a ray of pixel `index` of the region.
    pub fn add(&mut self, index: usize, radiance: Rgb, signature: Signature) {
        let tone = tone(radiance, self.scale);
        let pixel = &mut self.pixels[index];
        pixel.n += 1;
        pixel.sum += tone;
        pixel.sum_of_squares += tone * tone;
        pixel.mixed |= pixel.first.get_or_insert(signature).differs(&signature);
    }

    /// Which pixels of `among`, inside the region, want more rays; `first`: none has had more than the first ones.
    pub fn wanting(&self, among: Region, first: bool) -> Vec<bool> {
        (0..among.n_pixels())
            .into_par_iter()
            .map(|i| {
                let (x, y) = among.pixel(i);
                self.region.index(x, y).is_some_and(|own| {
                    let pixel = &self.pixels[own];
                    pixel.standard_error() > ERROR_SHARE * self.contrast
                        || first && (pixel.mixed || self.stands_out(x, y, pixel))
                })
            })
            .collect()
    }

    /// True where one of the eight neighbours shows something else.
    fn stands_out(&self, x: u32, y: u32, pixel: &PixelTones) -> bool {
        let (xs, ys) = (x.saturating_sub(1)..=x + 1, y.saturating_sub(1)..=y + 1);
        let mut around = ys.flat_map(|y| xs.clone().filter_map(move |x| self.region.index(x, y)));
        around.any(|i| {
            let other = &self.pixels[i];
            let edge = match (&pixel.first, &other.first) {
                (Some(own), Some(other)) => own.differs(other),
                _ => false,
            };
            edge || (pixel.mean() - other.mean()).abs() > self.contrast
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLOOR_SIDE: Side = Side {
        surface: SurfaceId(0),
        material: MaterialId(0),
        normal: DVec3::Z,
        distance: 2.0,
        emits: false,
    };
    const FLOOR: Signature = Signature(Some(FLOOR_SIDE));

    /// A region of one row of pixels with these rays.
    fn row(pixels: &[&[(f64, Signature)]]) -> Tones {
        let mut tones = Tones::new(Region::whole(pixels.len() as u32, 1), 1.0, 0.05);
        for (i, rays) in pixels.iter().enumerate() {
            rays.iter().for_each(|(l, signature)| tones.add(i, Rgb::splat(*l), *signature));
        }
        tones
    }

    fn wanting(pixels: &[&[(f64, Signature)]], first: bool) -> Vec<bool> {
        row(pixels).wanting(Region::whole(pixels.len() as u32, 1), first)
    }

    #[test]
    fn flat_pixels_want_nothing_and_a_step_wants_its_two_sides_only() {
        let (dark, light) = ((0.2, FLOOR), (0.5, FLOOR));
        assert_eq!(wanting(&[&[dark], &[dark], &[dark]], true), [false; 3]);
        assert_eq!(wanting(&[&[dark], &[dark], &[light], &[light]], true), [false, true, true, false]);
        assert_eq!(
            wanting(&[&[dark], &[light]], false),
            [false; 2],
            "later only the rays' own spread counts"
        );
    }

    #[test]
    fn step_of_radiance_counts_by_its_tone() {
        // A step of 0.03 is 0.1 tones in the dark, 0.016 in the light and nothing beyond white.
        let step = |low: f64| wanting(&[&[(low, FLOOR)], &[(low + 0.03, FLOOR)]], true);
        assert_eq!((step(0.01), step(0.8), step(3.0)), (vec![true; 2], vec![false; 2], vec![false; 2]));
    }

    #[test]
    fn edge_of_surface_normal_or_lamp_wants_rays_at_equal_tones() {
        let edge = |other: Signature| wanting(&[&[(0.5, FLOOR)], &[(0.5, other)]], true);
        assert_eq!(edge(FLOOR), [false; 2]);
        assert_eq!(edge(Signature(None)), [true; 2]);
        let side = |side: Side| edge(Signature(Some(side)));
        assert_eq!(side(Side { normal: DVec3::X, ..FLOOR_SIDE }), [true; 2]);
        assert_eq!(side(Side { emits: true, ..FLOOR_SIDE }), [true; 2]);
        let facet = DVec3::new(0.3, 0.0, 1.0).normalize();
        assert_eq!(side(Side { normal: facet, ..FLOOR_SIDE }), [false; 2], "17 degrees: a facet");
        let next = Side { surface: SurfaceId(1), ..FLOOR_SIDE };
        assert_eq!(side(next), [false; 2], "the floor's other part");
        assert_eq!(side(Side { material: MaterialId(1), ..next }), [true; 2]);
        assert_eq!(side(Side { distance: 2.1, ..next }), [true; 2], "a shelf over the floor");
    }

    #[test]
    fn spread_of_a_pixels_own_rays_wants_more_until_their_mean_is_sure() {
        let rays = |n: usize| -> Vec<(f64, Signature)> {
            (0..n).map(|k| (if k % 2 == 0 { 0.4 } else { 0.6 }, FLOOR)).collect()
        };
        // Tones .665 and .798: a standard error of .067 / sqrt(n - 1), under .0125 from 30 rays on.
        for (n, wants) in [(1, false), (2, true), (4, true), (16, true), (64, false)] {
            assert_eq!(wanting(&[&rays(n)], false), [wants], "{n} rays");
        }
    }
}
