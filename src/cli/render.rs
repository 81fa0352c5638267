//! `radeng render`: both passes, pictures, report, summary.

use std::path::Path;

use rtl_model::sim::FifoStatistics;

use super::args::RenderArgs;
use super::film;
use super::interrupt::Interrupt;
use super::plan;
use super::progress::Bars;
use super::{CliError, Outcome, method};
use crate::frame::{self, CasterChoice, Frame, FrameOptions, PassOne};
use crate::image::exr::encode_exr;
use crate::image::false_colour::{FalseColour, Field, Quantity};
use crate::image::hdr::encode_hdr;
use crate::image::png::{self, encode_png};
use crate::image::{Exposure, OutputFiles, PictureFormat};
use crate::photometry::LUMENS_PER_WATT;
use crate::radiosity::SolveOptions;
use crate::radiosity::summary::summarise;
use crate::raycast::metered::Meter;
use crate::render::{Region, RenderOptions, Rendering};
use crate::report::{
    self, BackHits, BoardReport, PartialReport, PassOneReport, PictureFact, RayCastingTime, RenderReport,
    ScaledPicture, SceneFacts, Timings,
};

pub(super) fn run(args: &RenderArgs) -> Result<Outcome, CliError> {
    let pictures = plan::resolve_pictures(args)?;
    let (look, in_false_colour) = plan::resolve_false_colour(args)?;
    let mut others: Vec<_> = in_false_colour.iter().map(|(p, _)| (Some(p.as_path()), "png")).collect();
    others.push((args.report.as_deref(), "json"));
    others.push((args.film.sample_map.as_deref(), "png"));
    plan::check_outputs(
        pictures.iter().map(|(p, _)| p.as_path()),
        &others,
        &[Some(&args.scene), args.solution.as_deref(), args.cast.board.as_deref().map(Path::new)],
    )?;
    let picture = plan::resolve_picture(&args.picture, plan::resolve_reconstruction(args)?, args.cast.seed);
    let mut picture = film::film(args, picture)?;
    method::resolve(args, &mut picture)?;
    let mut options = plan::resolve_frame(&args.cast, args.solution.as_deref())?;
    options.elements = film::elements(args)?;
    picture.ambient = args.ambient;
    picture.irradiance = in_false_colour.iter().any(|(_, quantity)| *quantity != Quantity::Luminance);

    let mut bars = Bars::new(SolveOptions::default().unshot_share, n_camera_rays(&picture));
    if picture.adaptive.is_some() {
        bars = bars.without_rate();
    }
    let (mut interrupt, partial) = (Interrupt::default(), args.film.partial);
    let stop = &mut || partial && interrupt.stop();
    let show = &mut |p| bars.show(p);
    let mut frame = frame::render_frame_until(&args.scene, &options, &picture, show, stop)?;
    bars.finish();
    frame.warnings.extend(interrupt.warning());
    frame.warnings.extend(film::stopped_warning(&frame.rendering));

    let mut files = OutputFiles::new();
    let facts = stage_pictures(&mut frame, &pictures, args.exposure, &mut files)?;
    let scaled = stage_false_colour(&mut frame, &in_false_colour, look, &mut files)?;
    stage_sample_map(&mut frame, args.film.sample_map.as_deref(), &picture, &mut files)?;
    let mut report = document(&frame, &options, picture, facts, scaled);
    report.quality = film::quality_report(args, &report.options, options.elements);
    if let Some(path) = &args.report {
        files.stage(path, report::to_json(&report));
    }
    files.commit()?;
    let text = report::terminal::render_summary(&report);
    let mut warnings = report.warnings;
    warnings.extend(plan::finish_pass_1(&options));
    Ok(Outcome { text, warnings, stopped: frame.rendering.done < 1.0, ..Outcome::default() })
}

/// Camera rays of a picture.
pub(super) fn n_camera_rays(picture: &RenderOptions) -> u64 {
    let region = picture.region.unwrap_or(Region::whole(picture.width, picture.height));
    region.n_pixels() as u64 * u64::from(picture.samples)
}

fn stage_pictures(
    frame: &mut Frame,
    pictures: &plan::Pictures,
    exposure: Exposure,
    files: &mut OutputFiles,
) -> Result<Vec<PictureFact>, CliError> {
    let film = &frame.rendering.film;
    frame.timings.measure("encode", || {
        let resolved = exposure.resolve(&film::rendered_pixels(film, &frame.rendering.rays_per_pixel));
        let mut facts = Vec::with_capacity(pictures.len());
        for (path, format) in pictures {
            let (bytes, exposure) = match format {
                PictureFormat::Exr => (encode_exr(film)?, None),
                PictureFormat::Hdr => (encode_hdr(film)?, None),
                PictureFormat::Png => (encode_png(film, resolved)?, Some(resolved)),
            };
            files.stage(path, bytes);
            facts.push(PictureFact { path: path.clone(), exposure });
        }
        Ok(facts)
    })
}

/// The number of rays of each pixel, as grey levels.
fn stage_sample_map(
    frame: &mut Frame,
    path: Option<&Path>,
    picture: &RenderOptions,
    files: &mut OutputFiles,
) -> Result<(), CliError> {
    let Some(path) = path else { return Ok(()) };
    let most = picture.adaptive.map_or(picture.samples, |a| a.max);
    let Rendering { film, rays_per_pixel, .. } = &frame.rendering;
    files.stage(path, png::encode_counts(film.width, film.height, rays_per_pixel, most)?);
    Ok(())
}

fn stage_false_colour(
    frame: &mut Frame,
    pictures: &plan::FalseColourPictures,
    look: FalseColour,
    files: &mut OutputFiles,
) -> Result<Vec<ScaledPicture>, CliError> {
    let Rendering { film, irradiance, sampled_sources, .. } = &frame.rendering;
    if pictures.is_empty() {
        return Ok(Vec::new());
    }
    frame.timings.measure("false colour", || {
        let mut facts = Vec::with_capacity(pictures.len());
        for (path, quantity) in pictures {
            let field = match (quantity, irradiance, sampled_sources) {
                (Quantity::Sources, _, Some(sampled)) => Field::sources(film.width, film.height, sampled),
                (Quantity::Illuminance, Some(irradiance), _) => {
                    Field::illuminance(film.width, film.height, irradiance)
                }
                _ => Field::luminance(film),
            };
            let (bytes, scale) = field.encode_png(look)?;
            files.stage(path, bytes);
            facts.push(ScaledPicture::new(path, *quantity, scale, look.colours));
        }
        Ok(facts)
    })
}

fn document(
    frame: &Frame,
    options: &FrameOptions,
    picture: RenderOptions,
    pictures: Vec<PictureFact>,
    false_colour: Vec<ScaledPicture>,
) -> RenderReport {
    let names = frame.scene.surfaces.iter().map(|s| s.name.clone());
    let back_hits = names.zip(&frame.rendering.back_hits).filter(|(_, rays)| **rays > 0);
    RenderReport {
        schema: RenderReport::SCHEMA,
        scene: SceneFacts::new(&frame.scene, &frame.mesh),
        caster: frame.caster,
        options: picture,
        pictures,
        ambient_w_m2: frame.ambient,
        false_colour,
        mean_luminance_w_m2_sr: frame.rendering.film.mean_luminance(),
        mean_luminance_cd_m2: LUMENS_PER_WATT * frame.rendering.film.mean_luminance(),
        n_camera_rays: frame.rendering.n_camera_rays,
        direct: frame.rendering.direct,
        mean_rays_per_pixel: frame.rendering.mean_rays_per_pixel(),
        negative_pixels: frame.rendering.n_negative_pixels,
        partial: (frame.rendering.done < 1.0).then(|| PartialReport {
            done: frame.rendering.done,
            unrendered_pixels: frame.rendering.n_unrendered_pixels(),
        }),
        quality: None,
        rays_by_kind: report::kinds::by_kind(&frame.meter),
        limited_vertices: frame.rendering.limited_vertices,
        clamped_pixels: frame.rendering.n_clamped_pixels(),
        back_hits: back_hits.map(|(surface, rays)| BackHits { surface, rays: *rays }).collect(),
        share_not_two_pass: frame.rendering.missed_share,
        pass_1: frame.solution.as_ref().zip(frame.solve_options).map(|(solution, solve_options)| {
            let surfaces = summarise(&frame.scene, &frame.mesh, solution);
            PassOneReport::new(solution, solve_options, loaded_from(&options.pass_1), surfaces)
                .refined(frame.refinement.clone())
        }),
        board: board_report(options, frame.board.as_ref(), &frame.links),
        timings: clocked(&frame.timings, &frame.meter, frame.caster),
        warnings: frame.warnings.clone(),
    }
}

/// Wall times with what of them was ray casting.
pub(super) fn clocked(timings: &Timings, meter: &Meter, caster: &str) -> Timings {
    let ray_casting = Some(RayCastingTime::new(meter, caster, timings.total_seconds));
    Timings { ray_casting, ..timings.clone() }
}

/// The file that a solution was read from.
pub(super) fn loaded_from(pass_1: &PassOne) -> Option<std::path::PathBuf> {
    match pass_1 {
        PassOne::Load(path) => Some(path.clone()),
        PassOne::Solve(_) | PassOne::Planned(_) => None,
    }
}

/// The board's part of a report.
pub(super) fn board_report(
    options: &FrameOptions,
    statistics: Option<&frame::StatisticsByPurpose>,
    links: &[FifoStatistics],
) -> Option<BoardReport> {
    let (CasterChoice::Board(spec), Some(statistics)) = (&options.caster, statistics) else { return None };
    Some(BoardReport::new(spec, statistics, links))
}
