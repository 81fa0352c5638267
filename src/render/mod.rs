//! Pass 2: camera bundles, shading, specular recursion.
//!
//! ```text
//! camera.rs tiles (Morton) --closest_hits--> trait Shader (shader.rs) --Seen--> film/ (sampling, filter, region)
//!                                              |-- two_pass.rs: stored and sampled light
//!                                              '-- path/: path tracing
//! ```
//! A wave is one sample of all pixels of a band of tiles. The order of queries and sums is fixed, so the picture has the
//! same bits for any number of threads.

mod camera;
mod film;
mod method;
pub mod path;
mod shader;
mod surfaces;
mod two_pass;

use crate::direct::{DirectOptions, SelectionCounts, ShadowCounts};
use crate::image::Film;
use crate::mesh::Mesh;
use crate::radiosity::Solution;
use crate::raycast::{CastError, RayCaster};
use crate::reconstruct::{GradientRule, Method, ReconstructOptions, TwistRule};
use crate::scene::{Camera, Scene};
use crate::units::Irradiance;
use film::FilmLoop;
pub use film::{
    AdaptiveSampling, CONTRAST, Filter, MAX_SAMPLES, Region, RegionError, camera_bundles, camera_ray_numbers,
};
pub use method::{RenderMethod, Transport};
use path::{PathOptions, PathTracer};
use shader::Shader;
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
    /// Camera rays per pixel, 1..=16 (stratified; 1 = the pixel's centre); with adaptive sampling the first ones.
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
    /// More rays for pixels that want them; none: `samples` for all.
    #[serde(default)]
    pub adaptive: Option<AdaptiveSampling>,
    /// From rays to pixels.
    #[serde(default)]
    pub filter: Filter,
    /// The part of the picture that is rendered; none: all of it.
    #[serde(default)]
    pub region: Option<Region>,
    /// Cast the first ray of all pixels before the second of any, so that a picture that is stopped is a whole one. Same
    /// bits.
    #[serde(default)]
    pub coarse_first: bool,
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
            adaptive: None,
            filter: Filter::Box,
            region: None,
            coarse_first: false,
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
    /// Camera rays per pixel, row by row.
    pub rays_per_pixel: Vec<u8>,
    /// Pixels that a filter's lobes made negative and that were made 0.
    pub n_negative_pixels: u64,
    /// Share of the work that is done: 1 unless it was stopped.
    pub done: f64,
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
    /// Mean number of camera rays of a pixel shown.
    pub fn mean_rays_per_pixel(&self) -> f64 {
        let sum: u64 = self.rays_per_pixel.iter().map(|n| u64::from(*n)).sum();
        sum as f64 / self.rays_per_pixel.len().max(1) as f64
    }

    /// Pixels without a ray: black, because rendering was stopped.
    pub fn n_unrendered_pixels(&self) -> u64 {
        self.rays_per_pixel.iter().filter(|n| **n == 0).count() as u64
    }

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

/// Renders a solved scene.
///
/// # Errors
/// When the caster fails.
///
/// # Panics
/// When the options' region is no part of their picture; see [`Region::check`].
pub fn render(
    scene: &Scene,
    camera: &Camera,
    mesh: &Mesh,
    solution: &Solution,
    caster: &mut dyn RayCaster,
    options: &RenderOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<Rendering, CastError> {
    render_until(scene, camera, mesh, solution, caster, options, progress, &mut || false)
}

/// As [`render`], until `stop` says true: it is asked before every wave.
///
/// # Errors
/// When the caster fails.
///
/// # Panics
/// As [`render`].
#[expect(clippy::too_many_arguments, reason = "what `render` takes, and when to stop")]
pub fn render_until(
    scene: &Scene,
    camera: &Camera,
    mesh: &Mesh,
    solution: &Solution,
    caster: &mut dyn RayCaster,
    options: &RenderOptions,
    progress: &mut dyn FnMut(f64),
    stop: &mut dyn FnMut() -> bool,
) -> Result<Rendering, CastError> {
    if let Some(Err(e)) = options.region.map(|region| region.check(options.width, options.height)) {
        panic!("{e}");
    }
    let mut shader = shader_of(scene, mesh, solution, caster, options)?;
    let film = FilmLoop { scene, mesh, camera, options, shader: shader.as_mut(), stop, progress };
    let rendering = film.run(caster)?;
    Ok(Rendering {
        limited_vertices: shader.limited_vertices(),
        direct: shader.direct(),
        missed_share: shader.missed_share(),
        ..rendering
    })
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

#[cfg(test)]
mod tests;
