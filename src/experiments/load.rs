//! Rays of an experiment, recorded once and run on many boards.
//!
//! ```text
//! scene --host in software, queries kept--> Load: patches and commands in words --run(spec)--> Run: counts, answers
//! ```
//! All boards of an experiment get the same words in the same commands, whatever they answer; `run_all` checks that they
//! answer the same.

use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;
use rtl_model::board::{Board, Work};
use rtl_model::datapath::bundle::BundleWords;
use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::fixed::Formats;
use rtl_model::memory_image::MemoryImage;
use rtl_model::sim::{Cause, CommandMark, Event, EventKind, FifoStatistics};
use rtl_model::spec::BoardSpec;
use rtl_model::statistics::BoardStatistics;

use super::ExperimentError;
use crate::generate::{Kind, generate};
use crate::geom::Ray;
use crate::mesh::{Mesh, PatchId};
use crate::radiosity::{self, SolveError, SolveOptions};
use crate::raycast::quantize::Quantizer;
use crate::raycast::software::SoftwareCaster;
use crate::raycast::{CastError, CastPatch, MAX_BUNDLE_RAYS, Purpose, Query, RayBundle, RayCaster, RayHit};
use crate::render::camera_bundles;
use crate::scene::{Camera, MeshTarget, Scene};

/// The Cornell box as shipped.
const CORNELL_BOX: &str = include_str!("../../scenes/cornell-box/scene.toml");

/// A scene with its mesh.
#[derive(Debug)]
pub struct Stage {
    /// The scene.
    pub scene: Scene,
    /// Its mesh.
    pub mesh: Mesh,
}

impl Stage {
    fn new(text: &str, name: &str, elements: Option<u32>) -> Result<Stage, ExperimentError> {
        let mut scene = Scene::parse(text, Path::new(name)).map_err(Box::new)?;
        if let Some(n) = elements {
            scene.meshing.target = MeshTarget::Elements(n);
        }
        let mesh = Mesh::build(&scene);
        Ok(Stage { scene, mesh })
    }

    /// The Cornell box with about so many elements.
    ///
    /// # Errors
    /// Never: the scene is compiled in.
    pub fn cornell_box(elements: u32) -> Result<Stage, ExperimentError> {
        Stage::new(CORNELL_BOX, "cornell-box", Some(elements))
    }

    /// A generated scene, seed 1, meshed as it says or into about so many elements.
    ///
    /// # Errors
    /// A count that the kind cannot have.
    pub fn generated(kind: Kind, count: u32, elements: Option<u32>) -> Result<Stage, ExperimentError> {
        let text = generate(kind, count, 1).map_err(|e| ExperimentError::Scene(e.to_string()))?.text;
        Stage::new(&text, kind.name(), elements)
    }

    /// The scene's camera.
    ///
    /// # Errors
    /// Never: every scene used here has one.
    pub fn camera(&self) -> Result<Camera, ExperimentError> {
        self.scene.camera.ok_or_else(|| ExperimentError::Scene("no camera".to_owned()))
    }

    /// The camera rays of a picture, one query.
    ///
    /// # Errors
    /// A scene that has no board numbers.
    pub fn primary(&self, width: u32, height: u32) -> Result<Load, ExperimentError> {
        let bundles = camera_bundles(&self.camera()?, width, height);
        Load::of(
            &self.mesh.cast_patches(),
            self.points(),
            &[Kept { any_hit: false, rays: Rays::Bundles(bundles) }],
        )
    }

    /// About `n_rays` rays of pass 1, of its first two queries; of a longer query sixteen stretches spread over it.
    ///
    /// # Errors
    /// A scene that has no board numbers.
    pub fn radiosity(&self, n_rays: usize) -> Result<Load, ExperimentError> {
        let patches = self.mesh.cast_patches();
        let quantizer = Quantizer::new(&Formats::default(), &patches, &self.points())
            .map_err(|e| ExperimentError::Scene(e.to_string()))?;
        let mut software = SoftwareCaster::new(patches.clone());
        let mut log = QueryLog::new(&mut software, quantizer.surface_offset_m(), n_rays, n_rays / 2);
        let solved =
            radiosity::solve(&self.scene, &self.mesh, &mut log, &SolveOptions::default(), &mut |_| {});
        // The log ends the solution when it has enough.
        if let (Err(SolveError::Cast(e)), false) = (solved, log.is_full()) {
            return Err(e.into());
        }
        Load::of(&patches, self.points(), &log.kept)
    }

    /// Where rays start outside the surfaces.
    pub fn points(&self) -> Vec<DVec3> {
        self.scene.camera.iter().map(|camera| camera.eye).collect()
    }
}

/// Rays of a query.
#[derive(Clone, Debug)]
pub enum Rays {
    /// Explicit ones.
    Explicit(Vec<Ray>),
    /// Bundles.
    Bundles(Vec<RayBundle>),
}

/// A query that was kept.
#[derive(Clone, Debug)]
pub struct Kept {
    /// Hit bits instead of nearest hits.
    pub any_hit: bool,
    /// Its rays.
    pub rays: Rays,
}

/// Stretches that are kept of a query that is too long.
const STRETCHES: usize = 16;

/// Keeps queries on their way to another caster; refuses any when it has enough.
#[derive(Debug)]
pub struct QueryLog<'a> {
    inner: &'a mut SoftwareCaster,
    surface_offset_m: f64,
    wanted: usize,
    most: usize,
    n_rays: usize,
    /// The queries, in order.
    pub kept: Vec<Kept>,
}

impl<'a> QueryLog<'a> {
    /// A log of about `wanted` rays, about `most` of each query, with the surface offset of the caster that they are
    /// kept for.
    pub fn new(
        inner: &'a mut SoftwareCaster,
        surface_offset_m: f64,
        wanted: usize,
        most: usize,
    ) -> QueryLog<'a> {
        QueryLog { inner, surface_offset_m, wanted, most, n_rays: 0, kept: Vec::new() }
    }

    /// It has nearly as many rays as were wanted: less than a bundle a stretch is missing.
    pub fn is_full(&self) -> bool {
        self.wanted.saturating_sub(self.n_rays) < STRETCHES * MAX_BUNDLE_RAYS
    }

    fn keep(&mut self, query: Query<'_>, any_hit: bool) -> Result<(), CastError> {
        if self.is_full() {
            return Err(CastError::Board("enough rays".to_owned()));
        }
        if query.n_rays() > 0 {
            let share = (self.most as f64 / query.n_rays() as f64).min(1.0);
            let rays = match query {
                Query::Rays(rays) => Rays::Explicit(stretches(rays, share)),
                Query::Bundles(bundles) => Rays::Bundles(stretches(bundles, share)),
            };
            self.n_rays += match &rays {
                Rays::Explicit(rays) => rays.len(),
                Rays::Bundles(bundles) => bundles.iter().map(RayBundle::n_rays).sum(),
            };
            self.kept.push(Kept { any_hit, rays });
        }
        Ok(())
    }
}

/// The first share of each of sixteen parts of a list.
fn stretches<T: Clone>(all: &[T], share: f64) -> Vec<T> {
    let edge = |k: usize| k * all.len() / STRETCHES;
    let part = |k: usize| &all[edge(k)..edge(k + 1)];
    let kept = |part: &[T]| (part.len() as f64 * share).round() as usize;
    (0..STRETCHES).map(part).flat_map(|part| part[..kept(part)].to_vec()).collect()
}

impl RayCaster for QueryLog<'_> {
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn closest_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
        self.keep(query, false)?;
        self.inner.closest_hits(purpose, query)
    }

    fn any_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        self.keep(query, true)?;
        self.inner.any_hits(purpose, query)
    }

    fn blocked_by(&self, purpose: Purpose, tests: &[(&RayBundle, PatchId)]) -> Vec<u64> {
        self.inner.blocked_by(purpose, tests)
    }

    fn surface_offset_m(&self) -> f64 {
        self.surface_offset_m
    }
}

/// A command's rays in words.
#[derive(Clone, Debug)]
pub enum Words {
    /// Explicit rays.
    Rays(Vec<RayWords>),
    /// Bundles.
    Bundles(Vec<BundleWords>),
}

impl Words {
    fn work(&self) -> Work<'_> {
        match self {
            Words::Rays(rays) => Work::Rays(rays),
            Words::Bundles(bundles) => Work::Bundles(bundles),
        }
    }

    fn n_rays(&self) -> usize {
        match self {
            Words::Rays(rays) => rays.len(),
            Words::Bundles(bundles) => bundles.iter().map(BundleWords::n_rays).sum(),
        }
    }
}

/// Commands of a scene, in the words of the default formats.
#[derive(Clone, Debug)]
pub struct Load {
    patches: Vec<PatchWords>,
    /// Hit bits instead of nearest hits, and the words, of each command.
    pub commands: Vec<(bool, Words)>,
}

/// The answers of a run, in ray order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answers {
    nearest: Vec<Option<HitWords>>,
    any: Vec<bool>,
}

/// What a board did with a load.
#[derive(Clone, Debug)]
pub struct Run {
    /// What it counted.
    pub statistics: BoardStatistics,
    /// What it answered.
    pub answers: Answers,
    /// Of its cycles, those of low-resolution casts; 0 unless watched.
    pub cast_cycles: u64,
    /// Busiest and mean cluster's ICU work, each summed over the commands (cycles).
    pub icu_work: [f64; 2],
    /// What its FIFOs counted.
    pub links: Vec<FifoStatistics>,
}

impl Load {
    /// The words of queries to a scene of these patches; `points` are where rays start outside them.
    ///
    /// # Errors
    /// What has no board numbers.
    pub fn of(patches: &[CastPatch], points: Vec<DVec3>, kept: &[Kept]) -> Result<Load, ExperimentError> {
        let scene = |what: String| ExperimentError::Scene(what);
        let quantizer =
            Quantizer::new(&Formats::default(), patches, &points).map_err(|e| scene(e.to_string()))?;
        let words = patches.iter().enumerate().map(|(id, patch)| {
            quantizer
                .patch(id as u32, patch)
                .ok_or_else(|| scene(format!("patch {id} lies outside the cube")))
        });
        let words = words.collect::<Result<_, _>>()?;
        let mut commands = Vec::new();
        for Kept { any_hit, rays } in kept {
            let command = match rays {
                Rays::Explicit(rays) => {
                    let rays = rays.iter().enumerate().map(|(i, r)| Ok(quantizer.ray(i, r)?.words));
                    Words::Rays(rays.collect::<Result<_, CastError>>()?)
                }
                Rays::Bundles(bundles) => {
                    let bundles = bundles.iter().enumerate().map(|(i, b)| quantizer.bundle(i, b));
                    Words::Bundles(bundles.collect::<Result<_, CastError>>()?)
                }
            };
            commands.push((*any_hit, command));
        }
        Ok(Load { patches: words, commands })
    }

    /// Rays in all.
    pub fn n_rays(&self) -> usize {
        self.commands.iter().map(|(_, words)| words.n_rays()).sum()
    }

    /// Patches of the scene.
    pub fn n_patches(&self) -> usize {
        self.patches.len()
    }

    /// The same rays, each by itself instead of in a bundle.
    pub fn explicit(&self) -> Load {
        let formats = Formats::default();
        let expand = |words: &Words| match words {
            Words::Rays(rays) => Words::Rays(rays.clone()),
            Words::Bundles(bundles) => {
                let rays = |b: &BundleWords| (0..b.n_rays()).map(|i| b.ray(&formats, i)).collect::<Vec<_>>();
                Words::Rays(bundles.iter().flat_map(rays).collect())
            }
        };
        let commands = self.commands.iter().map(|(any_hit, words)| (*any_hit, expand(words))).collect();
        Load { patches: self.patches.clone(), commands }
    }

    /// A board with this scene loaded.
    ///
    /// # Errors
    /// An unusable specification, or a scene too large for it.
    pub fn board(&self, spec: &BoardSpec) -> Result<Board, ExperimentError> {
        Ok(Board::new(spec, MemoryImage::for_board(spec, &self.patches))?)
    }

    /// Runs the commands on a new board.
    ///
    /// # Errors
    /// As [`Load::board`], or a watchdog.
    pub fn run(&self, spec: &BoardSpec) -> Result<Run, ExperimentError> {
        self.run_with(spec, false)
    }

    /// As [`Load::run`], and tells the cycles of low-resolution casts.
    ///
    /// # Errors
    /// As [`Load::run`].
    pub fn run_watched(&self, spec: &BoardSpec) -> Result<Run, ExperimentError> {
        self.run_with(spec, true)
    }

    fn run_with(&self, spec: &BoardSpec, watched: bool) -> Result<Run, ExperimentError> {
        let mut board = self.board(spec)?;
        let (mut answers, mut watch) = (Answers::default(), CastWatch::default());
        let mut icu_work = [0.0; 2];
        let mut before = board.statistics();
        for (any_hit, words) in &self.commands {
            let work = words.work();
            let mut sink = |events: &[Event]| watch.take(events);
            match (any_hit, watched) {
                (true, false) => answers.any.extend(board.trace_any(work)?),
                (false, false) => answers.nearest.extend(board.trace_nearest(work)?),
                (true, true) => answers.any.extend(board.trace_any_observed(work, &mut sink)?),
                (false, true) => answers.nearest.extend(board.trace_nearest_observed(work, &mut sink)?),
            }
            let now = board.statistics();
            let clusters = cluster_work(&now.since(&before), spec.clusters.count);
            icu_work[0] += clusters.iter().copied().fold(0.0, f64::max);
            icu_work[1] += clusters.iter().sum::<f64>() / clusters.len() as f64;
            before = now;
        }
        let links = board.link_statistics();
        Ok(Run { statistics: before, answers, cast_cycles: watch.cycles, icu_work, links })
    }

    /// Runs the commands on each board, and checks that all answer the same.
    ///
    /// # Errors
    /// As [`Load::run`]; answers that differ.
    pub fn run_all(&self, specs: &[BoardSpec]) -> Result<Vec<Run>, ExperimentError> {
        let runs: Vec<Run> = specs.par_iter().map(|spec| self.run(spec)).collect::<Result<_, _>>()?;
        same_answers(&runs)?;
        Ok(runs)
    }
}

/// Checks that runs of the same rays answered the same.
///
/// # Errors
/// [`ExperimentError::Answers`] when they did not.
pub fn same_answers(runs: &[Run]) -> Result<(), ExperimentError> {
    match runs.iter().position(|run| run.answers != runs[0].answers) {
        Some(point) => Err(ExperimentError::Answers { point }),
        None => Ok(()),
    }
}

/// Work of the ICUs of each cluster (cycles).
fn cluster_work(statistics: &BoardStatistics, n_clusters: u32) -> Vec<f64> {
    let mut work = vec![0.0; n_clusters as usize];
    for (c, sum) in work.iter_mut().enumerate() {
        let prefix = format!("cluster{c}.");
        let icus = statistics.blocks.iter();
        let icus = icus.filter(|b| b.block.starts_with(&prefix) && b.block.ends_with(".icu"));
        *sum = icus.map(|b| b.of(Cause::Work)).sum::<u64>() as f64;
    }
    work
}

/// Sums the cycles from each low-resolution cast's mark to that of its command's bundles.
#[derive(Default)]
struct CastWatch {
    clock: u64,
    began: Option<u64>,
    cycles: u64,
}

impl CastWatch {
    fn take(&mut self, events: &[Event]) {
        for event in events {
            match event.kind() {
                Some(EventKind::Clock) => self.clock = u64::from(event.payload()),
                Some(EventKind::Command) => {
                    let now = event.cycle(self.clock);
                    if event.payload() == CommandMark::LowResolution as u32 {
                        self.began = Some(now);
                    } else if event.payload() == CommandMark::Bundles as u32 {
                        self.cycles += self.began.take().map_or(0, |began| now - began);
                    }
                }
                _ => {}
            }
        }
    }
}

impl Run {
    /// Rays a second at the board's clock.
    pub fn rays_per_second(&self, spec: &BoardSpec) -> f64 {
        self.statistics.canonical.rays as f64 / self.seconds(spec)
    }

    /// Seconds at the board's clock.
    pub fn seconds(&self, spec: &BoardSpec) -> f64 {
        self.statistics.cycles as f64 / (1e6 * spec.clock_mhz)
    }

    /// Cycles a ray.
    pub fn cycles_per_ray(&self) -> f64 {
        self.statistics.cycles as f64 / self.statistics.canonical.rays as f64
    }

    /// Lines (64 B) a ray that a memory level took from the next; 0 for a level that is not there.
    pub fn lines_per_ray(&self, level: &str) -> f64 {
        let bytes = self.statistics.memory.iter().filter(|l| l.level == level).map(|l| l.bytes).sum::<u64>();
        bytes as f64 / 64.0 / self.statistics.canonical.rays as f64
    }

    /// Lines (64 B) a ray that were written to a memory level's next one; of the DRAM, into it.
    pub fn written_lines_per_ray(&self, level: &str) -> f64 {
        let levels = self.statistics.memory.iter().filter(|l| l.level == level);
        let bytes = levels.map(|l| l.written_bytes).sum::<u64>();
        bytes as f64 / 64.0 / self.statistics.canonical.rays as f64
    }

    /// Busiest cluster's ICU work over the mean cluster's.
    pub fn imbalance(&self) -> f64 {
        self.icu_work[0] / self.icu_work[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_keep_the_share_of_every_part_in_order_and_all_when_it_is_one() {
        let all: Vec<usize> = (0..1600).collect();
        assert_eq!(stretches(&all, 1.0), all);
        let kept = stretches(&all, 0.1);
        assert_eq!(kept.len(), 160);
        assert!(kept.iter().all(|i| i % 100 < 10) && kept.is_sorted());
        assert!(stretches(&all[..3], 1.0).len() == 3 && stretches(&all[..0], 0.5).is_empty());
    }

    #[test]
    fn radiosity_load_has_about_as_many_rays_as_asked_for() {
        let load = Stage::cornell_box(300).unwrap().radiosity(6000).unwrap();
        assert!((4000..=9000).contains(&load.n_rays()), "{} rays", load.n_rays());
        assert!(load.commands.len() >= 2 && load.commands.iter().any(|(any_hit, _)| *any_hit));
    }
}
