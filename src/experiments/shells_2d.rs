//! The trend of 1990 in two dimensions: do shells move fewer patches a ray than the grid does?
//!
//! ```text
//! segments-2d scene, a patch a segment; random points of the plane z = h/2 --bundles of 64 rays in the plane-->
//!     grid | shells, with a cache per element | without --> patch lines a ray
//! ```
//! A patch transfer is a line (64 B, one record) that a module's patch cache takes from the next level; without a cache
//! every read of a record is one, but for reads of a line that is already on its way.
//! Source: Shen, Deprettere, Dewilde 1990.

use glam::DVec3;
use rtl_model::spec::{BoardSpec, MemoryLevels, Partition, Scheduling};

use super::load::{Kept, Load, Rays, Run};
use super::plot::{Mark, Panel, Scale, Series};
use super::table::{Table, digits, row};
use super::{Check, ExperimentError, Extent, Findings, board};
use crate::generate::{Kind, generate};
use crate::raycast::{CastPatch, MAX_BUNDLE_RAYS, RayBundle};
use crate::sampling::{hash, unit_pair};
use crate::scene::{Scene, Shape};

/// Width of a bundle (degrees) and its name.
const BUNDLES: [(f64, &str); 2] = [(360.0, "all around"), (45.0, "of 45 degrees")];

/// Partition and memory, with their names.
const BOARDS: [(Partition, MemoryLevels, &str); 4] = [
    (Partition::Grid, MemoryLevels::OneLevel, "grid, cache"),
    (Partition::Shells, MemoryLevels::OneLevel, "shells, cache"),
    (Partition::Grid, MemoryLevels::None, "grid, no cache"),
    (Partition::Shells, MemoryLevels::None, "shells, no cache"),
];

/// All boards on one scene and kind of bundle.
pub(super) struct Point {
    pub(super) n_segments: u32,
    bundle: usize,
    grid_log2: u32,
    pub(super) runs: Vec<Run>,
}

/// Bundles from random points of the middle plane of the box of `patches`, `degrees` wide.
fn bundles(patches: &[CastPatch], degrees: f64, n_bundles: u64) -> Vec<RayBundle> {
    let corners = || patches.iter().flat_map(|p| p.corners);
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    let z = 0.5 * (low.z + high.z);
    let n = MAX_BUNDLE_RAYS;
    (0..n_bundles)
        .map(|i| {
            let [u, v] = unit_pair(hash(1, 2, i)).map(|u| 0.01 + 0.98 * u);
            let [turn, _] = unit_pair(hash(1, 3, i));
            let apex = (low + (high - low) * DVec3::new(u, v, 0.0)).with_z(z);
            let target = |k: usize| {
                let angle = std::f64::consts::TAU * (turn + degrees / 360.0 * (k as f64 + 0.5) / n as f64);
                let (sin, cos) = angle.sin_cos();
                // Where the ray meets the walls.
                let reach = |from: f64, low: f64, high: f64, d: f64| match d {
                    d if d > 0.0 => (high - from) / d,
                    d if d < 0.0 => (low - from) / d,
                    _ => f64::INFINITY,
                };
                let t = reach(apex.x, low.x, high.x, cos).min(reach(apex.y, low.y, high.y, sin));
                apex + t * DVec3::new(cos, sin, 0.0)
            };
            RayBundle::Targets { apex, points: (0..n).map(target).collect() }
        })
        .collect()
}

/// The surfaces of a flat world, a patch each.
fn patches(n_segments: u32) -> Result<Vec<CastPatch>, ExperimentError> {
    let text =
        generate(Kind::Segments2d, n_segments, 1).map_err(|e| ExperimentError::Scene(e.to_string()))?.text;
    let scene = Scene::parse(&text, std::path::Path::new("segments-2d")).map_err(Box::new)?;
    let quads = scene.surfaces.iter().filter_map(|s| match s.shape {
        Shape::Quad(corners) => Some(CastPatch { corners, is_triangle: false }),
        _ => None,
    });
    Ok(quads.collect())
}

/// The grid on which a board in grid partition needs the fewest cycles: the automatic one is made for three dimensions.
fn best_grid(load: &Load, spec: &BoardSpec) -> Result<u32, ExperimentError> {
    let specs: Vec<BoardSpec> = (3..=6).map(|g| BoardSpec { grid_log2: Some(g), ..spec.clone() }).collect();
    let runs = load.run_all(&specs)?;
    Ok((3..).zip(&runs).min_by_key(|(_, run)| run.statistics.cycles).map_or(5, |(g, _)| g))
}

pub(super) fn points(extent: Extent) -> Result<Vec<Point>, ExperimentError> {
    let counts: &[u32] = extent.pick(&[25, 50, 100, 200, 400, 800], &[50, 400]);
    let specs: Vec<BoardSpec> = BOARDS
        .iter()
        .map(|(partition, memory, _)| {
            board(|b| (b.partition, b.memory, b.scheduling) = (*partition, *memory, Scheduling::Static))
        })
        .collect();
    let mut points = Vec::new();
    for (bundle, (degrees, _)) in BUNDLES.iter().enumerate() {
        for &n_segments in counts {
            let patches = patches(n_segments)?;
            let load = |n_bundles| {
                let rays = Rays::Bundles(bundles(&patches, *degrees, n_bundles));
                Load::of(&patches, Vec::new(), &[Kept { any_hit: false, rays }])
            };
            let grid_log2 = best_grid(&load(extent.pick(16, 4))?, &specs[0])?;
            let specs: Vec<BoardSpec> =
                specs.iter().map(|s| BoardSpec { grid_log2: Some(grid_log2), ..s.clone() }).collect();
            let runs = load(extent.pick(64, 16))?.run_all(&specs)?;
            points.push(Point { n_segments, bundle, grid_log2, runs });
        }
    }
    Ok(points)
}

pub(super) fn run(extent: Extent) -> Result<Findings, ExperimentError> {
    let points = points(extent)?;
    let columns = [
        "bundles",
        "segments",
        "cells a side",
        "board",
        "patch lines/ray",
        "DRAM lines/ray",
        "tests/ray",
        "cells/ray",
        "cycles/ray",
    ];
    let mut table = Table::new("Transfers a ray", &columns);
    let lines = |p: &Point, b: usize| p.runs[b].lines_per_ray("patch_cache");
    for p in &points {
        for (b, (.., name)) in BOARDS.iter().enumerate() {
            let run = &p.runs[b];
            let c = &run.statistics.canonical;
            table.push(row![
                BUNDLES[p.bundle].1,
                p.n_segments,
                1_u64 << p.grid_log2,
                *name,
                lines(p, b),
                run.lines_per_ray("dram"),
                c.tests as f64 / c.rays as f64,
                c.cells as f64 / c.rays as f64,
                run.cycles_per_ray(),
            ]);
        }
    }
    let of_bundle = |bundle: usize| points.iter().filter(move |p| p.bundle == bundle);
    let mut panels = Vec::new();
    for (bundle, (_, name)) in BUNDLES.iter().enumerate() {
        let mut panel = Panel::new(
            format!("Patch transfers, bundles of 64 rays {name}"),
            ("segments", Scale::Log),
            ("lines of 64 B a ray", Scale::Log),
        );
        for (b, (.., name)) in BOARDS.iter().enumerate() {
            let xy = of_bundle(bundle).map(|p| (f64::from(p.n_segments), lines(p, b)));
            panel.series.push(Series::new(*name, Mark::Line, b + 1, xy));
        }
        panels.push(panel);
    }
    let mut says = Vec::new();
    for (bundle, (_, name)) in BUNDLES.iter().enumerate() {
        for (grid, shells, memory) in [(0, 1, "with a cache per element"), (2, 3, "without a cache")] {
            let ratio = |p: &Point| lines(p, shells) / lines(p, grid);
            let (first, last) = (of_bundle(bundle).next(), of_bundle(bundle).next_back());
            let (Some(first), Some(last)) = (first, last) else { continue };
            let all = of_bundle(bundle).count();
            let count = |which: &dyn Fn(f64) -> bool| of_bundle(bundle).filter(|p| which(ratio(p))).count();
            let (fewer, more) = (count(&|r| r < 0.98), count(&|r| r > 1.02));
            let trend = match (fewer, more) {
                (0, _) => "The trend of 1990 does not show",
                (_, 0) => "The trend of 1990 shows",
                _ => "The trend of 1990 shows in part",
            };
            says.push(format!(
                "Bundles {name}, {memory}: shells take {} times the grid's transfers at {} segments and {} times at {}; fewer at \
                 {fewer}, as many within 2 % at {}, more at {more} of {all} numbers of segments. {}.",
                digits(ratio(first)),
                first.n_segments,
                digits(ratio(last)),
                last.n_segments,
                all - fewer - more,
                trend,
            ));
        }
    }
    let dram = |p: &Point| p.runs[1].lines_per_ray("dram") / p.runs[0].lines_per_ray("dram");
    let cycles = |p: &Point| p.runs[1].cycles_per_ray() / p.runs[0].cycles_per_ray();
    let range = |f: &dyn Fn(&Point) -> f64| {
        let (low, high) =
            points.iter().map(f).fold((f64::INFINITY, 0.0_f64), |(a, b), x| (a.min(x), b.max(x)));
        format!("{} to {} times", digits(low), digits(high))
    };
    says.push(format!(
        "Patches are not all that moves: with the tested masks that shells keep a bundle and the cells' lists, shells read {} \
         the grid's lines from the DRAM (both with a cache), and take {} its cycles.",
        range(&dram),
        range(&cycles)
    ));
    let n_rays = points.first().map_or(0, |p| p.runs[0].statistics.canonical.rays);
    Ok(Findings {
        question: "The paper of 1990 finds, in two dimensions, that shells need fewer patch transfers a ray than a grid through \
                   which every ray goes by itself. Does this board show that trend?"
            .to_owned(),
        method: format!(
            "Random segments of the unit square, extruded into quads (`radeng generate segments-2d`, seed 1), a patch each; \
             {n_rays} rays in the plane z = h/2 from random points, 64 a bundle, all around or 45 degrees wide. The default \
             board with static scheduling, in grid and in shells on the same cells (of 8, 16, 32, 64 a side those that take the grid \
             the fewest cycles), with a 4 KiB patch cache a module (memory one-level) and \
             without (none). A patch transfer is a line of 64 B that a module's patch port takes from the next level."
        ),
        tables: vec![table],
        panels,
        pictures: Vec::new(),
        says,
        checks: vec![Check::new(true, "all four boards answer every ray alike (the run stops otherwise)")],
    })
}
