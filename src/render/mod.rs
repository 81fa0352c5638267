//! Pass 2: camera bundles, shading, specular recursion.
//!
//! ```text
//! camera.rs tiles (Morton) --closest_hits--> trait Shader (shader.rs) --Seen--> film
//!                                              |-- two_pass.rs: stored and sampled light
//!                                              '-- path/: path tracing
//! ```
//! A wave is one sample of all pixels of a band of tiles. The order of queries and sums is fixed, so the picture has the
//! same bits for any number of threads.

mod camera;
mod method;
pub mod path;
mod shader;
mod surfaces;
mod two_pass;

use crate::direct::{DirectOptions, SelectionCounts, ShadowCounts};
use crate::image::Film;
use crate::mesh::Mesh;
use crate::radiosity::Solution;
use crate::raycast::{CastError, Purpose, Query, RayBundle, RayCaster};
use crate::reconstruct::{GradientRule, Method, ReconstructOptions, TwistRule};
use crate::scene::{Camera, Scene};
use crate::units::{Irradiance, Rgb};
use camera::{Tile, View, morton_tiles};
pub use method::{RenderMethod, Transport};
use path::{PathOptions, PathTracer};
use shader::{CameraRay, Shader};
use two_pass::{Split, TwoPass};

/// How pass 2 is run.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderOptions {
    /// Which light is stored, which is sampled.
    #[serde(default)]
    pub method: RenderMethod,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Camera rays per pixel, 1..=16 (stratified; 1 = the pixel's centre).
    pub samples: u32,
    /// How direct light is found.
    #[serde(default)]
    pub direct: DirectOptions,
    /// Specular recursion depth.
    pub max_depth: u32,
    /// Reconstruction of the stored indirect irradiance.
    pub reconstruct: Method,
    /// Its gradients at the vertices.
    #[serde(default)]
    pub gradients: GradientRule,
    /// Its twists.
    #[serde(default)]
    pub twists: TwistRule,
    /// Seed of every sampling pattern.
    pub seed: u64,
    /// Add the ambient term of what pass 1 left unshot; see `radiosity::ambient`.
    pub ambient: bool,
    /// Keep the irradiance on the surfaces that pixels show first, too.
    pub irradiance: bool,
    /// Of `path`: which paths count.
    #[serde(default)]
    pub transport: Transport,
    /// Of `path`: paths per camera ray.
    #[serde(default = "default_paths")]
    pub paths: u32,
}

/// Paths per camera ray.
pub const DEFAULT_PATHS: u32 = 64;

fn default_paths() -> u32 {
    DEFAULT_PATHS
}

impl Default for RenderOptions {
    fn default() -> Self {
        RenderOptions {
            method: RenderMethod::TwoPass,
            width: 256,
            height: 256,
            samples: 1,
            direct: DirectOptions::default(),
            max_depth: 6,
            reconstruct: Method::Hermite,
            gradients: GradientRule::LeastSquares,
            twists: TwistRule::Fit,
            seed: 1,
            ambient: false,
            irradiance: false,
            transport: Transport::Full,
            paths: DEFAULT_PATHS,
        }
    }
}

/// A rendered picture and what is worth telling about it.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The picture.
    pub film: Film,
    /// Camera rays that first met the black back of a one-sided surface, per scene surface.
    pub back_hits: Vec<u64>,
    /// Camera rays in all.
    pub n_camera_rays: u64,
    /// Irradiance on the surfaces that pixels show first, row by row, where it was asked for: mirrors, glass and lamps
    /// included, `None` where a pixel shows nothing or black backs only.
    pub irradiance: Option<Vec<Option<Irradiance>>>,
    /// Pixels in which reconstructed light came out negative somewhere and was made 0, row by row.
    pub clamped: Vec<bool>,
    /// Vertices whose derivatives the limiter of the reconstruction made smaller.
    pub limited_vertices: usize,
    /// Which sources are stored and which sampled, and what shadow rays that took; where direct light is sampled.
    pub direct: Option<DirectCounts>,
    /// Sources that are sampled where pixels show a surface first, each by its weight, row by row; `None` as in
    /// `irradiance`, and where it was not asked for.
    pub sampled_sources: Option<Vec<Option<f64>>>,
    /// Of `path`: share of the picture's light, in the picture or dropped, that came by paths that the two-pass method does
    /// not model.
    pub missed_share: Option<f64>,
}

/// What direct light took.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct DirectCounts {
    /// Where sources were chosen.
    pub selection: Option<SelectionCounts>,
    /// Shadow rays of the picture, without those of the selection.
    pub shadow: ShadowCounts,
}

impl Rendering {
    /// How many pixels are [`Rendering::clamped`].
    pub fn n_clamped_pixels(&self) -> u64 {
        self.clamped.iter().filter(|c| **c).count() as u64
    }
}

impl RenderOptions {
    /// How `path` traces.
    pub fn path(&self) -> PathOptions {
        let RenderOptions { transport, paths, max_depth, seed, .. } = *self;
        PathOptions { transport, n_paths: paths, max_depth, seed }
    }

    /// Its method of reconstruction with the rules.
    pub fn reconstruction(&self) -> ReconstructOptions {
        ReconstructOptions { method: self.reconstruct, gradients: self.gradients, twists: self.twists }
    }
}

/// Camera tiles per band: bounds the paths held at once.
const TILES_PER_BAND: usize = 256;

/// Most camera rays per pixel.
const MAX_SAMPLES: u32 = 16;

/// Renders a solved scene.
///
/// # Errors
/// When the caster fails.
pub fn render(
    scene: &Scene,
    camera: &Camera,
    mesh: &Mesh,
    solution: &Solution,
    caster: &mut dyn RayCaster,
    options: &RenderOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<Rendering, CastError> {
    let (width, height) = (options.width as usize, options.height as usize);
    let samples = options.samples.clamp(1, MAX_SAMPLES);
    let view = View::new(camera, options.width, options.height);
    let mut shader = shader_of(scene, mesh, solution, caster, options)?;
    let mut picture = Rendering {
        film: Film {
            width,
            height,
            pixels: vec![Rgb::BLACK; width * height],
            emitter: vec![false; width * height],
        },
        back_hits: vec![0; scene.surfaces.len()],
        n_camera_rays: 0,
        irradiance: None,
        clamped: vec![false; width * height],
        limited_vertices: shader.limited_vertices(),
        direct: None,
        sampled_sources: None,
        missed_share: None,
    };
    // Sum of what the pixel's rays met, and how many met any.
    let mut received = options.irradiance.then(|| vec![(Rgb::BLACK, 0.0, 0_u32); width * height]);
    let tiles = morton_tiles(options.width, options.height);
    let n_bands = tiles.len().div_ceil(TILES_PER_BAND) * samples as usize;
    let mut done = 0;
    for band in tiles.chunks(TILES_PER_BAND) {
        for sample in 0..samples {
            let (bundles, rays) = camera_wave(&view, band, sample, samples, options.width);
            let hits = caster.closest_hits(Purpose::Primary, Query::Bundles(&bundles))?;
            picture.n_camera_rays += rays.len() as u64;
            let weight = 1.0 / f64::from(samples);
            for (ray, seen) in rays.iter().zip(shader.see(caster, &rays, hits)?) {
                picture.film.pixels[ray.pixel] += seen.radiance.0 * weight;
                picture.film.emitter[ray.pixel] |= seen.emits;
                picture.clamped[ray.pixel] |= seen.clamped;
                if let Some(surface) = seen.back {
                    picture.back_hits[surface.0 as usize] += 1;
                }
                if let (Some(received), Some(e)) = (&mut received, seen.irradiance) {
                    let (sum, sources, n) = &mut received[ray.pixel];
                    *sum += e;
                    *sources += seen.sampled_sources;
                    *n += 1;
                }
            }
            done += 1;
            progress(done as f64 / n_bands as f64);
        }
    }
    picture.missed_share = shader.missed_share();
    picture.direct = shader.direct();
    if let Some(received) = received {
        let irradiance = |(sum, _, n): &(Rgb, f64, u32)| (*n > 0).then(|| Irradiance(*sum / f64::from(*n)));
        let sources = |(_, sources, n): &(Rgb, f64, u32)| (*n > 0).then(|| sources / f64::from(*n));
        picture.irradiance = Some(received.iter().map(irradiance).collect());
        picture.sampled_sources = Some(received.iter().map(sources).collect());
    }
    Ok(picture)
}

/// The camera bundles of a picture with one ray through the centre of every pixel, in the order in which they are cast.
pub fn camera_bundles(camera: &Camera, width: u32, height: u32) -> Vec<RayBundle> {
    let view = View::new(camera, width, height);
    morton_tiles(width, height).iter().map(|tile| view.bundle(tile, 0, 1)).collect()
}

/// The numbers that the camera rays of pixel (x, y) have, sample by sample, among all camera rays of a picture in the order
/// in which [`render`] casts them.
pub fn camera_ray_numbers(width: u32, height: u32, samples: u32, x: u32, y: u32) -> Vec<u64> {
    let samples = samples.clamp(1, MAX_SAMPLES);
    let tiles = morton_tiles(width, height);
    let pixel = y as usize * width as usize + x as usize;
    let mut before = 0;
    for band in tiles.chunks(TILES_PER_BAND) {
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

/// The shader that a method wants.
fn shader_of<'a>(
    scene: &'a Scene,
    mesh: &'a Mesh,
    solution: &Solution,
    caster: &mut dyn RayCaster,
    options: &RenderOptions,
) -> Result<Box<dyn Shader + 'a>, CastError> {
    let split = match options.method {
        RenderMethod::Path => {
            let tracer = PathTracer::new(scene, mesh, caster.surface_offset_m(), options.path());
            return Ok(Box::new(tracer.with_irradiance(options.irradiance)));
        }
        RenderMethod::TwoPass => Split::Selected,
        RenderMethod::FullRadiosity => Split::AllStored,
        RenderMethod::Whitted => Split::Ambient,
    };
    Ok(Box::new(TwoPass::new(scene, mesh, solution, caster, options, split)?))
}

/// The bundles of one sample of a band of tiles, and their rays.
fn camera_wave(
    view: &View,
    band: &[Tile],
    sample: u32,
    samples: u32,
    width: u32,
) -> (Vec<RayBundle>, Vec<CameraRay>) {
    let bundles: Vec<RayBundle> = band.iter().map(|tile| view.bundle(tile, sample, samples)).collect();
    let mut rays = Vec::with_capacity(band.len() * 64);
    for (tile, bundle) in band.iter().zip(&bundles) {
        for i in 0..bundle.n_rays() {
            rays.push(CameraRay { ray: bundle.ray(i), pixel: tile.pixel(i, width), sample });
        }
    }
    (bundles, rays)
}

#[cfg(test)]
mod tests;
