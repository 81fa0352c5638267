//! The film as meant: quality, sampling, filter, region.
//!
//! ```text
//! RenderArgs + Given --film--> RenderOptions' film part    --elements--> wanted elements
//! ```

use std::borrow::Cow;

use super::args::{FilterArg, PictureArgs, QualityArg, RenderArgs};
use super::error::CliError;
use crate::frame::FrameError;
use crate::image::Film;
use crate::mesh::Mesh;
use crate::render::{AdaptiveSampling, CONTRAST, Filter, RenderOptions, Rendering};
use crate::report::QualityReport;
use crate::report::si::percent;
use crate::scene::{MAX_ELEMENTS, Scene};
use crate::units::Rgb;

/// What a quality means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Quality {
    /// Wanted elements, as a multiple of what the scene's file wants.
    pub elements: f64,
    /// Camera rays of every pixel.
    pub samples: u32,
    /// Most camera rays of a pixel.
    pub max_samples: u32,
    /// Shadow rays: n x n strata at most.
    pub shadow_strata: u32,
    /// Share of the light at a point that they may leave in doubt.
    pub shadow_error: f64,
    /// Contrast that calls for more camera rays.
    pub contrast: f64,
}

impl Quality {
    /// Its values.
    pub fn of(quality: QualityArg) -> Quality {
        match quality {
            QualityArg::Draft => Quality {
                elements: 0.25,
                samples: 1,
                max_samples: 4,
                shadow_strata: 4,
                shadow_error: 0.05,
                contrast: 0.05,
            },
            QualityArg::Normal => Quality {
                elements: 1.0,
                samples: 1,
                max_samples: 8,
                shadow_strata: 8,
                shadow_error: 0.01,
                contrast: CONTRAST,
            },
            QualityArg::High => Quality {
                elements: 4.0,
                samples: 4,
                max_samples: 16,
                shadow_strata: 8,
                shadow_error: 0.005,
                contrast: 0.02,
            },
        }
    }
}

/// The part of the options that makes pixels of rays.
///
/// # Errors
/// A region outside of the picture; a contrast that nothing asks for.
pub(super) fn film(args: &RenderArgs, picture: RenderOptions) -> Result<RenderOptions, CliError> {
    let (film, given) = (&args.film, &args.given);
    if let Some(region) = film.region {
        region.check(picture.width, picture.height).map_err(|e| CliError::Usage(format!("--{e}")))?;
    }
    let quality = film.quality.map(Quality::of);
    let (samples, max) = match quality {
        Some(q) if !given.has("samples") => (q.samples, Some(q.max_samples).filter(|max| *max > q.samples)),
        _ => (args.picture.samples.min, args.picture.samples.max),
    };
    let adaptive = max.map(|max| AdaptiveSampling {
        max,
        contrast: film.contrast.unwrap_or(quality.map_or(CONTRAST, |q| q.contrast)),
        exposure: args.exposure,
    });
    if film.contrast.is_some() && adaptive.is_none() {
        let what = "--contrast has no use without --samples MIN..MAX: every pixel has as many camera rays";
        return Err(CliError::Usage(what.to_owned()));
    }
    let mut direct = picture.direct;
    if let Some(quality) = quality {
        if !given.has("shadow_strata") {
            direct.shadow_strata = quality.shadow_strata;
        }
        if !given.has("shadow_error") {
            direct.shadow_error = quality.shadow_error;
        }
    }
    Ok(RenderOptions {
        samples,
        direct,
        adaptive,
        filter: match film.filter {
            FilterArg::Box => Filter::Box,
            FilterArg::Tent => Filter::Tent,
            FilterArg::Gaussian => Filter::Gaussian,
            FilterArg::Mitchell => Filter::Mitchell,
        },
        region: film.region,
        coarse_first: film.partial,
        ..picture
    })
}

/// What `--quality` meant, for the report.
pub(super) fn quality_report(
    args: &RenderArgs,
    picture: &RenderOptions,
    elements: Option<u32>,
) -> Option<QualityReport> {
    args.film.quality.map(|quality| QualityReport {
        name: match quality {
            QualityArg::Draft => "draft",
            QualityArg::Normal => "normal",
            QualityArg::High => "high",
        },
        elements,
        samples: picture.samples,
        max_samples: picture.adaptive.map_or(picture.samples, |a| a.max),
        contrast: picture.adaptive.map(|a| a.contrast),
        shadow_strata: picture.direct.shadow_strata,
        shadow_error: picture.direct.shadow_error,
    })
}

/// The pixels that have rays, in one row: what the exposure is found from.
pub(super) fn rendered_pixels<'a>(film: &'a Film, rays_per_pixel: &[u8]) -> Cow<'a, Film> {
    if rays_per_pixel.iter().all(|n| *n > 0) {
        return Cow::Borrowed(film);
    }
    let with_rays = || rays_per_pixel.iter().map(|n| *n > 0);
    let pixels: Vec<Rgb> = film.pixels.iter().zip(with_rays()).filter(|(_, r)| *r).map(|(p, _)| *p).collect();
    let emitter = film.emitter.iter().zip(with_rays()).filter(|(_, r)| *r).map(|(e, _)| *e).collect();
    Cow::Owned(Film { width: pixels.len(), height: 1, pixels, emitter })
}

/// What the user should know of a picture that was stopped.
pub(super) fn stopped_warning(rendering: &Rendering) -> Option<String> {
    (rendering.done < 1.0).then(|| {
        let black = rendering.n_unrendered_pixels();
        let all = rendering.rays_per_pixel.len() as u64;
        format!(
            "stopped with {} of pass 2 done: {:.2} camera rays a pixel, {} of {all} pixels have none and are black",
            percent(rendering.done),
            rendering.mean_rays_per_pixel(),
            black
        )
    })
}

/// Wanted elements by `--quality`, where neither `--elements` nor a solution's mesh says how many.
///
/// # Errors
/// A scene that cannot be read.
pub(super) fn elements(args: &RenderArgs) -> Result<Option<u32>, CliError> {
    let quality = args.film.quality.map(Quality::of).filter(|q| q.elements != 1.0);
    let (Some(quality), None, None) = (quality, args.cast.elements, &args.solution) else {
        return Ok(args.cast.elements);
    };
    let scene = Scene::load(&args.scene).map_err(FrameError::from)?;
    let wanted = (quality.elements * Mesh::planned_elements(&scene) as f64).round();
    Ok(Some(wanted.clamp(1.0, f64::from(MAX_ELEMENTS)) as u32))
}

/// Refuses a range of camera rays a pixel.
///
/// # Errors
/// `--samples` is one; `why` it has no use.
pub(super) fn fixed_samples(args: &PictureArgs, why: &str) -> Result<(), CliError> {
    match args.samples.max {
        None => Ok(()),
        Some(max) => {
            let min = args.samples.min;
            Err(CliError::Usage(format!("--samples {min}..{max}: expected one number, 1 to 16: {why}")))
        }
    }
}
