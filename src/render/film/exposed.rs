//! What the camera rays saw, pixel by pixel, until the picture is developed.
//!
//! ```text
//! Seen of pixel i --add--> sums (box) or every ray (wider filters) --develop--> Rendering of the region shown
//! ```
//! The box needs a sum per pixel; other filters keep 24 bytes for every camera ray.

use super::filter::{self, Filter};
use super::places::Places;
use super::region::Region;
use crate::image::Film;
use crate::render::shader::Seen;
use crate::render::{RenderOptions, Rendering};
use crate::units::{Irradiance, Rgb};

/// What is kept of radiance.
#[derive(Debug)]
enum Kept {
    /// Per pixel, each ray times `unit`.
    Sums { unit: f64, sums: Vec<Rgb> },
    /// Per pixel, in the order of its rays.
    Rays(Vec<Vec<Rgb>>),
}

/// An exposed film.
#[derive(Debug)]
pub(super) struct Exposed {
    region: Region,
    kept: Kept,
    n_rays: Vec<u8>,
    emitter: Vec<bool>,
    clamped: Vec<bool>,
    back_hits: Vec<u64>,
    /// Sums of what the pixel's rays met and of sources sampled there, and how many met any.
    received: Option<Vec<(Rgb, f64, u32)>>,
}

impl Exposed {
    /// Of a region's pixels; `n_rays`: as many as each pixel will have, where that is known.
    pub fn new(region: Region, n_surfaces: usize, options: &RenderOptions, n_rays: Option<u32>) -> Exposed {
        let n = region.n_pixels();
        let kept = match options.filter {
            Filter::Box => {
                let unit = 1.0 / f64::from(n_rays.unwrap_or(1));
                Kept::Sums { unit, sums: vec![Rgb::BLACK; n] }
            }
            _ => Kept::Rays(vec![Vec::new(); n]),
        };
        Exposed {
            region,
            kept,
            n_rays: vec![0; n],
            emitter: vec![false; n],
            clamped: vec![false; n],
            back_hits: vec![0; n_surfaces],
            received: options.irradiance.then(|| vec![(Rgb::BLACK, 0.0, 0); n]),
        }
    }

    /// Takes what a ray of pixel `i` of the region sees.
    pub fn add(&mut self, i: usize, seen: &Seen) {
        match &mut self.kept {
            Kept::Sums { unit, sums } => sums[i] += seen.radiance.0 * *unit,
            Kept::Rays(rays) => rays[i].push(seen.radiance.0),
        }
        self.n_rays[i] += 1;
        self.emitter[i] |= seen.emits;
        self.clamped[i] |= seen.clamped;
        if let Some(surface) = seen.back {
            self.back_hits[surface.0 as usize] += 1;
        }
        if let (Some(received), Some(e)) = (&mut self.received, seen.irradiance) {
            let (sum, sources, n) = &mut received[i];
            *sum += e;
            *sources += seen.sampled_sources;
            *n += 1;
        }
    }

    /// The picture of `shown`.
    pub fn develop(
        self,
        shown: Region,
        n_camera_rays: u64,
        done: f64,
        filter: Filter,
        places: Places,
    ) -> Rendering {
        let at: Vec<usize> = (0..shown.n_pixels())
            .filter_map(|i| {
                let (x, y) = shown.pixel(i);
                self.region.index(x, y)
            })
            .collect();
        let (pixels, n_negative) = match &self.kept {
            Kept::Sums { unit, sums } => {
                let mean = |i: &usize| match f64::from(self.n_rays[*i]) * unit {
                    0.0 => Rgb::BLACK,
                    1.0 => sums[*i],
                    share => sums[*i] / share,
                };
                (at.iter().map(mean).collect(), 0)
            }
            Kept::Rays(rays) => {
                let filtered = filter::gather(filter, places, shown, self.region, rays);
                (filtered.pixels, filtered.n_negative)
            }
        };
        let emitter = (0..shown.n_pixels()).map(|i| self.shows_emitter(shown.pixel(i), filter)).collect();
        Rendering {
            film: Film { width: shown.width as usize, height: shown.height as usize, pixels, emitter },
            back_hits: self.back_hits,
            n_camera_rays,
            irradiance: self.received.as_ref().map(|received| {
                let mean = |(sum, _, n): (Rgb, f64, u32)| (n > 0).then(|| Irradiance(sum / f64::from(n)));
                at.iter().map(|i| mean(received[*i])).collect()
            }),
            sampled_sources: self.received.map(|received| {
                let mean = |(_, sources, n): (Rgb, f64, u32)| (n > 0).then(|| sources / f64::from(n));
                at.iter().map(|i| mean(received[*i])).collect()
            }),
            direct: None,
            missed_share: None,
            clamped: at.iter().map(|i| self.clamped[*i]).collect(),
            limited_vertices: 0,
            rays_per_pixel: at.iter().map(|i| self.n_rays[*i]).collect(),
            n_negative_pixels: n_negative,
            done,
        }
    }

    /// True where light of a pixel that shows an emitter gets to pixel (x, y) through the filter.
    fn shows_emitter(&self, (x, y): (u32, u32), filter: Filter) -> bool {
        let reach = filter.reach();
        let (xs, ys) = (x.saturating_sub(reach)..=x + reach, y.saturating_sub(reach)..=y + reach);
        let mut around = ys.flat_map(|y| xs.clone().filter_map(move |x| self.region.index(x, y)));
        around.any(|i| self.emitter[i])
    }
}
