//! What source selection, shadow coherence and adaptive area sampling save: rays, tests, cycles, seconds, at which error.
//!
//! ```text
//! scene --pass 1--> solution --pictures: {full, + selection, + coherence, + adaptive} x {4, 16, 64} rays a lamp--> Run
//!                            `--16 pictures of 64 rays a lamp, other seeds--> reference of 1024
//! Run: shadow rays, RMSE, host seconds (software)     the same in small: tests and cycles of the board
//! ```
//! All pictures of a scene have one solution and one camera ray a pixel, so they differ by direct light alone.
//! Source: Kok, Jansen 1991, 1992; Kok, Jansen, Woodward 1991.

use std::time::Instant;

use super::load::Stage;
use super::plot::{Mark, Panel, Scale, Series};
use super::table::{Table, row};
use super::{Check, Experiment, ExperimentError, Extent, Findings, board};
use crate::direct::{DirectOptions, ShadowSampling};
use crate::frame::RoutedCaster;
use crate::generate::Kind;
use crate::image::Film;
use crate::image::rmse::rmse;
use crate::radiosity::{self, Solution, SolveOptions};
use crate::raycast::Purpose;
use crate::raycast::board::BoardCaster;
use crate::raycast::software::SoftwareCaster;
use crate::render::{self, RenderOptions, Rendering};
use crate::units::Rgb;

#[cfg(test)]
mod tests;

/// The experiment; it is about the host, so `all` leaves it out.
pub const EXPERIMENT: Experiment =
    Experiment { name: "two-pass", title: "What the two-pass method saves of its shadow rays", run };

/// n of n x n rays a lamp.
const STRATA: [u32; 3] = [2, 4, 8];
/// Pictures of the reference.
const REFERENCE_SEEDS: std::ops::Range<u64> = 101..117;
/// Share of full sampling's shadow rays that all savings together may take in the room with many lamps.
const WANTED_SHARE: f64 = 1.0 / 3.0;

/// What is saved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Nothing.
    Full,
    /// Sources are selected.
    Selection,
    /// And occluders remembered.
    Coherence,
    /// And areas sampled adaptively.
    Adaptive,
}

/// All ways, each with what the ways before save, too.
pub const WAYS: [Way; 4] = [Way::Full, Way::Selection, Way::Coherence, Way::Adaptive];

impl Way {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Way::Full => "full",
            Way::Selection => "+ selection",
            Way::Coherence => "+ coherence",
            Way::Adaptive => "+ adaptive",
        }
    }

    /// With at most `strata` x `strata` rays a lamp.
    pub fn options(self, strata: u32) -> DirectOptions {
        let full = DirectOptions::full(strata);
        let stored_share = DirectOptions::default().stored_share;
        match self {
            Way::Full => full,
            Way::Selection => DirectOptions { stored_share, ..full },
            Way::Coherence => DirectOptions { stored_share, shadow_coherence: true, ..full },
            // Half the rays along an edge leave twice the doubt.
            Way::Adaptive => DirectOptions {
                shadow_error: f64::from(STRATA[2]) / f64::from(strata)
                    * DirectOptions::default().shadow_error,
                stored_share,
                shadow_coherence: true,
                shadow_sampling: ShadowSampling::Adaptive,
                ..full
            },
        }
    }
}

/// A scene with its solution.
pub struct Lit {
    /// Its name in tables.
    pub name: &'static str,
    /// Scene and mesh.
    pub stage: Stage,
    /// Pass 1.
    pub solution: Solution,
}

/// What a picture took, and how far it is from the reference.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// What was saved.
    pub way: Way,
    /// Rays a lamp at most.
    pub rays_a_lamp: u32,
    /// Shadow rays of the picture.
    pub shadow_rays: u64,
    /// Rays that chose the sources.
    pub selection_rays: u64,
    /// Seconds of pass 2 on the host.
    pub seconds: f64,
    /// See [`rmse`].
    pub rmse: f64,
    /// Of a smaller picture on the board, a pixel: tests and cycles.
    pub board: [f64; 2],
}

impl Lit {
    /// Solves a stage.
    ///
    /// # Errors
    /// When pass 1 fails.
    pub fn new(name: &'static str, stage: Stage, unshot_share: f64) -> Result<Lit, ExperimentError> {
        let mut software = SoftwareCaster::new(stage.mesh.cast_patches());
        let options = SolveOptions { unshot_share, ..SolveOptions::default() };
        let solution = radiosity::solve(&stage.scene, &stage.mesh, &mut software, &options, &mut |_| {})?;
        Ok(Lit { name, stage, solution })
    }

    /// A picture by the software caster.
    ///
    /// # Errors
    /// When there is no camera.
    pub fn render(&self, direct: DirectOptions, side: u32, seed: u64) -> Result<Rendering, ExperimentError> {
        let mut software = SoftwareCaster::new(self.stage.mesh.cast_patches());
        let options = picture(direct, side, seed);
        let Stage { scene, mesh } = &self.stage;
        let camera = self.stage.camera()?;
        Ok(render::render(scene, &camera, mesh, &self.solution, &mut software, &options, &mut |_| {})?)
    }

    /// The mean of pictures with all rays and other seeds.
    ///
    /// # Errors
    /// As [`Lit::render`].
    pub fn reference(&self, side: u32, seeds: std::ops::Range<u64>) -> Result<Film, ExperimentError> {
        let n = (seeds.end - seeds.start) as f64;
        let mut mean: Option<Film> = None;
        for seed in seeds {
            let film = self.render(DirectOptions::full(STRATA[2]), side, seed)?.film;
            let sum = mean
                .get_or_insert_with(|| Film { pixels: vec![Rgb::BLACK; film.pixels.len()], ..film.clone() });
            sum.pixels.iter_mut().zip(&film.pixels).for_each(|(sum, l)| *sum += *l / n);
        }
        mean.ok_or_else(|| ExperimentError::Scene("no reference".to_owned()))
    }

    /// Tests and cycles of the board for the shadow rays of a picture, a pixel.
    fn on_board(&self, direct: DirectOptions, side: u32) -> Result<[f64; 2], ExperimentError> {
        let patches = self.stage.mesh.cast_patches();
        let mut emulated = BoardCaster::new(&board(|_| {}), &patches, &self.stage.points())?;
        let mut software = SoftwareCaster::new(patches);
        let mut routed = RoutedCaster::new(Purpose::Shadow, &mut emulated, &mut software);
        let Stage { scene, mesh } = &self.stage;
        let (camera, options) = (self.stage.camera()?, picture(direct, side, 1));
        render::render(scene, &camera, mesh, &self.solution, &mut routed, &options, &mut |_| {})?;
        let n_pixels = f64::from(side * side);
        let shadow = emulated.statistics().into_iter().find(|(purpose, _)| *purpose == Purpose::Shadow);
        Ok(shadow
            .map_or([0.0; 2], |(_, s)| [s.canonical.tests as f64 / n_pixels, s.cycles as f64 / n_pixels]))
    }

    /// All ways at all counts.
    ///
    /// # Errors
    /// As [`Lit::render`], and a scene that has no board numbers.
    pub fn runs(&self, side: u32, board_side: u32, reference: &Film) -> Result<Vec<Run>, ExperimentError> {
        let mut runs = Vec::new();
        for way in WAYS {
            for strata in STRATA {
                let options = way.options(strata);
                let start = Instant::now();
                let rendering = self.render(options, side, 1)?;
                let seconds = start.elapsed().as_secs_f64();
                let counts = rendering.direct.unwrap_or_default();
                runs.push(Run {
                    way,
                    rays_a_lamp: strata * strata,
                    shadow_rays: counts.shadow.rays,
                    selection_rays: counts.selection.map_or(0, |s| s.shadow.rays),
                    seconds,
                    rmse: rmse(&rendering.film, reference),
                    board: self.on_board(options, board_side)?,
                });
            }
        }
        Ok(runs)
    }
}

fn picture(direct: DirectOptions, side: u32, seed: u64) -> RenderOptions {
    RenderOptions { width: side, height: side, direct, seed, ..RenderOptions::default() }
}

/// Slope and intercept of the least-squares line through log error over log rays.
fn fit(runs: &[Run]) -> [f64; 2] {
    let points: Vec<[f64; 2]> = runs.iter().map(|r| [(r.shadow_rays as f64).ln(), r.rmse.ln()]).collect();
    let n = points.len() as f64;
    let [mx, my] = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let xx: f64 = points.iter().map(|p| (p[0] - mx).powi(2)).sum();
    let xy: f64 = points.iter().map(|p| (p[0] - mx) * (p[1] - my)).sum();
    let slope = xy / xx;
    [slope, my - slope * mx]
}

/// Shadow rays of a way over those of full sampling, both by their fits, at an error that both reach.
///
/// The error is the geometric mean of the ends of the range that both cover; of the nearest errors when they cover none.
pub fn share_at_equal_error(runs: &[Run], way: Way) -> Option<[f64; 2]> {
    let of = |way: Way| runs.iter().copied().filter(|r| r.way == way).collect::<Vec<Run>>();
    let (full, saved) = (of(Way::Full), of(way));
    let range = |runs: &[Run]| {
        let errors = runs.iter().map(|r| r.rmse);
        [errors.clone().fold(f64::INFINITY, f64::min), errors.fold(0.0, f64::max)]
    };
    let ([a, b], [c, d]) = (range(&full), range(&saved));
    let error = (a.max(c) * b.min(d)).sqrt();
    let rays = |runs: &[Run]| {
        let [slope, intercept] = fit(runs);
        ((error.ln() - intercept) / slope).exp()
    };
    let share = rays(&saved) / rays(&full);
    share.is_finite().then_some([share, error])
}

/// A scene's name, its stage and the unshot share of its solution.
type Setting = (&'static str, Stage, f64);

fn run(extent: Extent) -> Result<Findings, ExperimentError> {
    let settings: Vec<Setting> = vec![
        ("cornell-box", Stage::cornell_box(extent.pick(4000, 1000))?, 1e-3),
        ("furnished-room", Stage::generated(Kind::FurnishedRoom, 12, None)?, 0.01),
        (
            "many-lamps",
            Stage::generated(Kind::ManyLamps, extent.pick(50, 12), extent.pick(None, Some(1500)))?,
            0.05,
        ),
    ];
    let (side, board_side) = (extent.pick(96, 32), extent.pick(24, 8));
    let seeds = REFERENCE_SEEDS.start..extent.pick(REFERENCE_SEEDS.end, REFERENCE_SEEDS.start + 2);
    let mut findings = Findings {
        question: "How many shadow rays, tests, cycles and seconds do source selection, shadow coherence and adaptive area \
                   sampling save, and at which error?"
            .to_owned(),
        method: method(side, board_side, seeds.end - seeds.start),
        tables: Vec::new(),
        panels: Vec::new(),
        pictures: Vec::new(),
        says: Vec::new(),
        checks: Vec::new(),
    };
    let mut all = Vec::new();
    for (name, stage, unshot_share) in settings {
        let lit = Lit::new(name, stage, unshot_share)?;
        let reference = lit.reference(side, seeds.clone())?;
        let runs = lit.runs(side, board_side, &reference)?;
        findings.tables.push(table(name, &runs));
        findings.panels.push(panel(name, &runs));
        findings.says.extend(says(name, &runs));
        findings.checks.extend(checks(&lit, &runs, side)?);
        all.push((name, runs));
    }
    if let Some((name, runs)) = all.last() {
        let share = share_at_equal_error(runs, Way::Adaptive);
        let what = format!(
            "{name}: at equal RMSE all savings together take {} of full sampling's shadow rays, at most {WANTED_SHARE:.3}",
            share.map_or("an unknown share".to_owned(), |[s, _]| format!("{s:.3}")),
        );
        findings.checks.push(Check::new(share.is_some_and(|[s, _]| s <= WANTED_SHARE), what));
    }
    Ok(findings)
}

fn method(side: u32, board_side: u32, n: u64) -> String {
    format!(
        "Pictures of {side} x {side} pixels, one camera ray each, of one solution a scene; each way also saves what those above it \
         save. Rays a lamp: all of them with full sampling, at most with adaptive. RMSE: of linear luminance against the mean of \
         {n} pictures of 64 rays a lamp with other seeds, over the mean, without pixels within one of a lamp, luminances clamped \
         to four means. Selection's rays, from the vertices of the mesh, are spent once a scene, whatever the picture. Seconds are \
         of pass 2 by the software caster on the host, selection included, and differ from run to run; all else is the same on \
         every run. Tests and cycles are those of the default board for the shadow rays of a picture of {board_side} x \
         {board_side}, a pixel."
    )
}

fn table(name: &str, runs: &[Run]) -> Table {
    let columns = [
        "way",
        "rays a lamp",
        "shadow rays",
        "selection rays",
        "RMSE %",
        "board tests a pixel",
        "board cycles a pixel",
        "host s",
    ];
    let mut table = Table::new(name, &columns);
    for r in runs {
        table.push(row![
            r.way.name(),
            r.rays_a_lamp,
            r.shadow_rays,
            r.selection_rays,
            100.0 * r.rmse,
            r.board[0],
            r.board[1],
            r.seconds,
        ]);
    }
    table
}

fn panel(name: &str, runs: &[Run]) -> Panel {
    let x = ("shadow rays of the picture", Scale::Log);
    let mut panel = Panel::new(format!("{name}: error against shadow rays"), x, ("RMSE (%)", Scale::Log));
    for (colour, way) in WAYS.into_iter().enumerate() {
        let of_way = runs.iter().filter(|r| r.way == way);
        let points = of_way.map(|r| (r.shadow_rays as f64, 100.0 * r.rmse));
        panel.series.push(Series::new(way.name(), Mark::Line, colour, points));
    }
    panel
}

fn says(name: &str, runs: &[Run]) -> Vec<String> {
    let mut says = Vec::new();
    for way in [Way::Selection, Way::Coherence, Way::Adaptive] {
        if let Some([share, error]) = share_at_equal_error(runs, way) {
            says.push(format!(
                "{name}, {}: {share:.3} of full sampling's shadow rays at an RMSE of {:.2} % (log-log fits).",
                way.name(),
                100.0 * error,
            ));
        }
    }
    says
}

fn checks(lit: &Lit, runs: &[Run], side: u32) -> Result<Vec<Check>, ExperimentError> {
    let name = lit.name;
    let rmse = |way: Way| runs.iter().filter(move |r| r.way == way).map(|r| r.rmse);
    let same = rmse(Way::Selection).zip(rmse(Way::Coherence)).all(|(a, b)| a == b);
    let on = Way::Adaptive.options(STRATA[2]);
    let off = DirectOptions { shadow_coherence: false, ..on };
    let same_pixels = lit.render(on, side, 1)?.film.pixels == lit.render(off, side, 1)?.film.pixels;
    Ok(vec![
        Check::new(same, format!("{name}: coherence changes no error of full sampling")),
        Check::new(same_pixels, format!("{name}: coherence changes no pixel of adaptive sampling")),
    ])
}
