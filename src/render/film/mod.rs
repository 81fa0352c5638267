//! The film loop: which camera rays are cast, and how what they see becomes pixels.
//!
//! ```text
//! region.rs: pixels --waves.rs: a sample of a band of tiles--> closest_hits --> trait Shader --Seen--> Exposed
//!                       ^-- contrast.rs: pixels that want more, 4, 8, 16 rays --------------------------|
//! Exposed --filter.rs--> Film
//! ```
//! A pixel's bits depend on its rays and its neighbours' alone: they are the same for any number of threads, for any
//! region that has the pixel, and for either order of the waves, band by band or sample by sample.

mod contrast;
mod exposed;
mod filter;
mod places;
mod region;
mod waves;

use super::camera::{Tile, View, morton_tiles};
use super::shader::{CameraRay, Seen, Shader};
use super::{RenderOptions, Rendering};
use crate::image::{Exposure, Film};
use crate::mesh::Mesh;
use crate::raycast::{CastError, RayBundle, RayCaster, RayHit};
use crate::scene::{Camera, Scene};
use crate::units::Rgb;
pub use contrast::{AdaptiveSampling, CONTRAST};
use contrast::{Signature, Tones};
use exposed::Exposed;
pub use filter::Filter;
use places::Places;
use region::Pixels;
pub use region::{Region, RegionError};
use waves::{Sample, Wave};

/// Camera tiles per band: bounds the paths held at once.
const TILES_PER_BAND: usize = 256;

/// Most camera rays per pixel.
pub const MAX_SAMPLES: u32 = 16;

/// Rays that a pixel has after it turned out to want more than one or two: fewer tell little about their spread.
const FIRST_ROUND: u32 = 4;

/// Longer side of the look by which the exposure is found (rays).
const METER_SIDE: u32 = 32;

/// Sample number of its rays: no ray of a picture has it.
const METER_SAMPLE: u32 = 31;

/// Share of the progress that the first rays have when it is not known how many will follow.
const FIRST_SHARE: f64 = 0.5;

/// A film loop, ready to run.
pub(super) struct FilmLoop<'a> {
    pub scene: &'a Scene,
    pub mesh: &'a Mesh,
    pub camera: &'a Camera,
    pub options: &'a RenderOptions,
    pub shader: &'a mut dyn Shader,
    /// True when the loop should end with what it has.
    pub stop: &'a mut dyn FnMut() -> bool,
    pub progress: &'a mut dyn FnMut(f64),
}

/// What stands between two waves.
struct Run {
    view: View,
    pixels: Pixels,
    places: Places,
    /// All tiles of the picture, by band.
    bands: Vec<Vec<Tile>>,
    exposed: Exposed,
    tones: Option<Tones>,
    n_camera_rays: u64,
}

impl FilmLoop<'_> {
    /// The picture, or as much of it as there is when it is stopped.
    ///
    /// # Errors
    /// When the caster fails.
    pub fn run(mut self, caster: &mut dyn RayCaster) -> Result<Rendering, CastError> {
        let options = self.options;
        let picture = Region::whole(options.width, options.height);
        let shown = options.region.unwrap_or(picture);
        let (min, adaptive) = sampling(options);
        let pixels = Pixels::new(picture, shown, options.filter.reach(), adaptive.is_some());
        let places = match adaptive {
            Some(a) => Places::Growing(a.max),
            None => Places::Fixed(min),
        };
        let mut run = Run {
            view: View::new(self.camera, options.width, options.height),
            pixels,
            places,
            bands: bands(options.width, options.height),
            exposed: Exposed::new(
                pixels.based,
                self.scene.surfaces.len(),
                options,
                adaptive.is_none().then_some(min),
            ),
            tones: None,
            n_camera_rays: 0,
        };
        let mut done = 1.0;
        if let Some(adaptive) = adaptive {
            let (scale, n_rays) = self.meter(caster, adaptive.exposure)?;
            run.n_camera_rays += n_rays;
            run.tones = Some(Tones::new(pixels.based, scale, adaptive.contrast));
        }
        let first_share = if adaptive.is_some() { FIRST_SHARE } else { 1.0 };
        if let Some(stopped) = self.first_rays(caster, &mut run, min, first_share)? {
            done = stopped;
        } else if let Some(adaptive) = adaptive
            && let Some(stopped) = self.more_rays(caster, &mut run, min, adaptive.max)?
        {
            done = stopped;
        }
        Ok(run.exposed.develop(pixels.shown, run.n_camera_rays, done, options.filter, places))
    }

    /// `n` rays for every pixel; the share that is done if it was stopped.
    fn first_rays(
        &mut self,
        caster: &mut dyn RayCaster,
        run: &mut Run,
        n: u32,
        share: f64,
    ) -> Result<Option<f64>, CastError> {
        let bands = run.tiles_in(run.pixels.based);
        let waves: Vec<(usize, u32)> = if self.options.coarse_first {
            (0..n).flat_map(|sample| (0..bands.len()).map(move |band| (band, sample))).collect()
        } else {
            (0..bands.len()).flat_map(|band| (0..n).map(move |sample| (band, sample))).collect()
        };
        for (i, (band, number)) in waves.iter().enumerate() {
            if (self.stop)() {
                return Ok(Some(share * i as f64 / waves.len() as f64));
            }
            let sample = Sample { number: *number, place: run.places.at(*number) };
            let wave = Wave::of_tiles(&run.view, &bands[*band], sample, self.options.width);
            self.cast(caster, run, wave)?;
            (self.progress)(share * (i + 1) as f64 / waves.len() as f64);
        }
        Ok(None)
    }

    /// Rays for the pixels that want them, round by round up to `max`; the share that is done if it was stopped.
    fn more_rays(
        &mut self,
        caster: &mut dyn RayCaster,
        run: &mut Run,
        min: u32,
        max: u32,
    ) -> Result<Option<f64>, CastError> {
        let bands = run.tiles_in(run.pixels.refined);
        let rounds = rounds(min, max);
        let mut wanted = vec![true; run.pixels.refined.n_pixels()];
        for (round, numbers) in rounds.iter().enumerate() {
            let Some(tones) = &run.tones else { return Ok(None) };
            let wanting = tones.wanting(run.pixels.refined, round == 0);
            // Who was content stays so.
            wanted.iter_mut().zip(wanting).for_each(|(wanted, wants)| *wanted &= wants);
            let refined = run.pixels.refined;
            let is_wanted = |x: u32, y: u32| refined.index(x, y).is_some_and(|i| wanted[i]);
            let share = |done: f64| {
                let rounds_done = (round as f64 + done) / rounds.len() as f64;
                FIRST_SHARE + (1.0 - FIRST_SHARE) * rounds_done
            };
            let n_waves = bands.len() * numbers.len();
            let waves = bands.iter().flat_map(|band| numbers.clone().map(move |number| (band, number)));
            for (i, (band, number)) in waves.enumerate() {
                if (self.stop)() {
                    return Ok(Some(share(i as f64 / n_waves as f64)));
                }
                let sample = Sample { number, place: run.places.at(number) };
                let wave = Wave::of_wanted(&run.view, band, sample, self.options.width, &is_wanted);
                self.cast(caster, run, wave)?;
                (self.progress)(share((i + 1) as f64 / n_waves as f64));
            }
        }
        Ok(None)
    }

    /// Casts a wave and exposes what its rays see, those outside of what is wanted left out.
    fn cast(&mut self, caster: &mut dyn RayCaster, run: &mut Run, wave: Wave) -> Result<(), CastError> {
        if wave.n_rays() == 0 {
            return Ok(());
        }
        run.n_camera_rays += wave.n_rays() as u64;
        let (rays, hits) = wave.cast(caster)?;
        let based = run.pixels.based;
        let index = |ray: &CameraRay| {
            let (x, y) = run.pixels.place(ray.pixel);
            based.index(x, y)
        };
        let kept = rays.into_iter().zip(hits).filter_map(|(ray, hit)| index(&ray).map(|i| (i, ray, hit)));
        let (mut indices, mut rays, mut hits) = (Vec::new(), Vec::new(), Vec::new());
        for (i, ray, hit) in kept {
            indices.push(i);
            rays.push(ray);
            hits.push(hit);
        }
        let met: Option<Vec<Option<RayHit>>> = run.tones.is_some().then(|| hits.clone());
        let seen = self.shader.see(caster, &rays, hits)?;
        if let (Some(tones), Some(met)) = (&mut run.tones, met) {
            for ((i, seen), hit) in indices.iter().zip(&seen).zip(met) {
                tones.add(*i, seen.radiance.0, Signature::of(self.scene, self.mesh, hit, seen.emits));
            }
        }
        for (i, seen) in indices.into_iter().zip(&seen) {
            run.exposed.add(i, seen);
        }
        Ok(())
    }

    /// Display-linear value of unit radiance, and the rays that it took to find it.
    fn meter(&mut self, caster: &mut dyn RayCaster, exposure: Exposure) -> Result<(f64, u64), CastError> {
        if let Exposure::Ev(_) = exposure {
            return Ok((exposure.resolve(&Film::from_pixels(0, 0, Vec::new())).scale(), 0));
        }
        let longest = self.options.width.max(self.options.height);
        let side = |n: u32| (u64::from(n) * u64::from(METER_SIDE) / u64::from(longest)).max(1) as u32;
        let (width, height) = (side(self.options.width), side(self.options.height));
        let view = View::new(self.camera, width, height);
        let sample = Sample { number: METER_SAMPLE, place: [0.5; 2] };
        let wave = Wave::of_tiles(&view, &morton_tiles(width, height), sample, width);
        let (rays, hits) = wave.cast(caster)?;
        let seen: Vec<Seen> = self.shader.see(caster, &rays, hits)?;
        let mut look = Film::from_pixels(
            width as usize,
            height as usize,
            vec![Rgb::BLACK; width as usize * height as usize],
        );
        for (ray, seen) in rays.iter().zip(seen) {
            look.pixels[ray.pixel] = seen.radiance.0;
            look.emitter[ray.pixel] = seen.emits;
        }
        Ok((exposure.resolve(&look).scale(), rays.len() as u64))
    }
}

impl Run {
    /// The bands' tiles that touch a region.
    fn tiles_in(&self, region: Region) -> Vec<Vec<Tile>> {
        let touches = |t: &&Tile| region.touches(Region { x: t.x, y: t.y, width: t.n, height: t.m });
        let bands = self.bands.iter().map(|band| band.iter().filter(touches).copied().collect::<Vec<_>>());
        bands.filter(|band| !band.is_empty()).collect()
    }
}

/// First rays of every pixel, and adaptive sampling where pixels can have more.
fn sampling(options: &RenderOptions) -> (u32, Option<AdaptiveSampling>) {
    let min = options.samples.clamp(1, MAX_SAMPLES);
    let more = options.adaptive.map(|a| AdaptiveSampling { max: a.max.min(MAX_SAMPLES), ..a });
    (min, more.filter(|a| a.max > min))
}

/// Numbers of the rays that pixels get, round by round, after the first `min`: up to 4, then twice as many as before.
fn rounds(min: u32, max: u32) -> Vec<std::ops::Range<u32>> {
    let mut rounds = Vec::new();
    let mut n = min;
    while n < max {
        let next = (2 * n).max(FIRST_ROUND).min(max);
        rounds.push(n..next);
        n = next;
    }
    rounds
}

fn bands(width: u32, height: u32) -> Vec<Vec<Tile>> {
    morton_tiles(width, height).chunks(TILES_PER_BAND).map(<[Tile]>::to_vec).collect()
}

/// The camera bundles of a picture with one ray through the centre of every pixel, in the order in which they are cast.
pub fn camera_bundles(camera: &Camera, width: u32, height: u32) -> Vec<RayBundle> {
    let view = View::new(camera, width, height);
    morton_tiles(width, height).iter().map(|tile| view.bundle(tile, [0.5; 2])).collect()
}

/// The numbers that the camera rays of pixel (x, y) have, sample by sample, among all camera rays of a picture of `samples`
/// rays a pixel, whole and not coarse first, in the order in which they are cast. With adaptive sampling they have none that
/// is known before.
pub fn camera_ray_numbers(width: u32, height: u32, samples: u32, x: u32, y: u32) -> Vec<u64> {
    let samples = samples.clamp(1, MAX_SAMPLES);
    let pixel = y as usize * width as usize + x as usize;
    let mut before = 0;
    for band in bands(width, height) {
        let mut in_band = 0;
        let mut found = None;
        for tile in band {
            let n_rays = tile.n_rays();
            let place = tile.contains(x, y).then(|| (0..n_rays).find(|i| tile.pixel(*i, width) == pixel));
            found = found.or(place.flatten().map(|i| (in_band + i) as u64));
            in_band += n_rays;
        }
        if let Some(place) = found {
            return (0..u64::from(samples)).map(|s| before + s * in_band as u64 + place).collect();
        }
        before += u64::from(samples) * in_band as u64;
    }
    Vec::new()
}

#[cfg(test)]
mod tests;
