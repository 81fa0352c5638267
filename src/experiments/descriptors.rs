//! What bundle descriptors save on the bus against explicit rays, and what that saves in cycles.
//!
//! ```text
//! tiles, fans, hemispheres --descriptors | the same rays in words, one by one--> default board, bus clocks --> bytes, cycles
//! ```

use rayon::prelude::*;
use rtl_model::spec::BoardSpec;

use super::load::{Kept, Load, Rays, Run, Stage, same_answers};
use super::plot::{Mark, Panel, Scale, Series};
use super::table::{Table, digits, row};
use super::{Check, ExperimentError, Extent, Findings, board};
use crate::mesh::ElementId;
use crate::raycast::RayBundle;
use crate::raycast::quantize::Quantizer;
use crate::scene::Shape;

/// Bus clocks (MHz); the second is the default board's.
const CLOCKS: [f64; 4] = [12.5, 25.0, 50.0, 100.0];

/// Rays of one kind.
pub(super) struct Case {
    name: &'static str,
    /// A run a clock.
    pub(super) descriptors: Vec<Run>,
    /// A run a clock.
    pub(super) explicit: Vec<Run>,
}

/// Fans to the lamp, and hemispheres, from every so many elements.
fn gathers(stage: &Stage, n_points: usize) -> Result<[Vec<RayBundle>; 2], ExperimentError> {
    let patches = stage.mesh.cast_patches();
    let formats = board(|_| {}).formats;
    let quantizer = Quantizer::new(&formats, &patches, &stage.points())
        .map_err(|e| ExperimentError::Scene(e.to_string()))?;
    let offset = quantizer.surface_offset_m();
    let lamp = stage.scene.surfaces.iter().find_map(|s| match s.shape {
        Shape::Quad(corners) if !s.exitance.is_black() => Some(corners),
        _ => None,
    });
    let lamp = lamp.ok_or_else(|| ExperimentError::Scene("no lamp".to_owned()))?;
    let n = stage.mesh.elements.len();
    let (mut fans, mut hemispheres) = (Vec::new(), Vec::new());
    for k in 0..n_points.min(n) {
        let element = &stage.mesh.elements[k * n / n_points.min(n)];
        let id = ElementId((k * n / n_points.min(n)) as u32);
        let Some((point, _)) = stage.mesh.quadrature(id).points().first().copied() else { continue };
        let normal = element.normal;
        let apex = point + offset * normal;
        let below = 0.5 * (lamp[0] + lamp[2]) - apex;
        if below.dot(normal) > 0.0 {
            let (edge_u, edge_v) = (lamp[1] - lamp[0], lamp[3] - lamp[0]);
            fans.push(RayBundle::Fan { apex, corner: lamp[0], edge_u, edge_v, n: 8, m: 8, jitter: [0.5; 2] });
        }
        hemispheres.push(RayBundle::Hemisphere { apex, normal, spin: 0.0, n: 8, m: 8, jitter: [0.5; 2] });
    }
    Ok([fans, hemispheres])
}

pub(super) fn cases(extent: Extent) -> Result<Vec<Case>, ExperimentError> {
    let stage = Stage::cornell_box(extent.pick(1200, 300))?;
    let side = extent.pick(96, 32);
    let [fans, hemispheres] = gathers(&stage, extent.pick(250, 40))?;
    let load = |bundles: Vec<RayBundle>, any_hit| {
        let kept = [Kept { any_hit, rays: Rays::Bundles(bundles) }];
        Load::of(&stage.mesh.cast_patches(), stage.points(), &kept)
    };
    let loads = [
        ("tiles, nearest hit", stage.primary(side, side)?),
        ("fans, any hit", load(fans, true)?),
        ("hemispheres, nearest hit", load(hemispheres, false)?),
    ];
    let specs: Vec<BoardSpec> = CLOCKS.map(|mhz| board(|b| b.bus.clock_mhz = mhz)).to_vec();
    let mut cases = Vec::new();
    for (name, bundled) in loads {
        let single = bundled.explicit();
        let run = |load: &Load| -> Result<Vec<Run>, ExperimentError> {
            specs.par_iter().map(|spec| load.run(spec)).collect()
        };
        let case = Case { name, descriptors: run(&bundled)?, explicit: run(&single)? };
        let all: Vec<Run> = case.descriptors.iter().chain(&case.explicit).cloned().collect();
        same_answers(&all)?;
        cases.push(case);
    }
    Ok(cases)
}

/// Bytes a ray, down and up.
pub(super) fn bytes(run: &Run) -> [f64; 2] {
    let s = &run.statistics;
    [s.bus_down_bytes, s.bus_up_bytes].map(|b| b as f64 / s.canonical.rays as f64)
}

pub(super) fn run(extent: Extent) -> Result<Findings, ExperimentError> {
    let cases = cases(extent)?;
    let columns = [
        "rays",
        "sent as",
        "bus clock (MHz)",
        "bytes/ray down",
        "bytes/ray up",
        "cycles/ray",
        "krays/s",
        "bus busy (%)",
    ];
    let mut table = Table::new("Bytes and cycles a ray", &columns);
    let clock = board(|_| {});
    // Cycles of the bus are told in its own clock.
    let busy = |run: &Run, mhz: f64| {
        let s = &run.statistics;
        100.0 * (s.bus_down_cycles + s.bus_up_cycles) as f64 * clock.clock_mhz / mhz / s.cycles as f64
    };
    for c in &cases {
        for (how, runs) in [("descriptors", &c.descriptors), ("explicit rays", &c.explicit)] {
            for (mhz, run) in CLOCKS.iter().zip(runs) {
                let [down, up] = bytes(run);
                let rate = 1e-3 * run.rays_per_second(&clock);
                table.push(row![c.name, how, *mhz, down, up, run.cycles_per_ray(), rate, busy(run, *mhz)]);
            }
        }
    }
    let mut rates = Panel::new(
        "Throughput over the bus clock, board at 25 MHz",
        ("bus clock (MHz)", Scale::Log),
        ("krays/s at the board's clock", Scale::Linear { from_zero: true }),
    );
    for (i, c) in cases.iter().enumerate() {
        let line = |runs: &[Run]| -> Vec<(f64, f64)> {
            CLOCKS.iter().zip(runs).map(|(mhz, run)| (*mhz, 1e-3 * run.rays_per_second(&clock))).collect()
        };
        let name = |how: &str| format!("{}: {how}", c.name);
        rates.series.push(Series::new(name("descriptors"), Mark::Line, i + 1, line(&c.descriptors)));
        rates.series.push(Series::new(name("explicit"), Mark::Dashed, i + 1, line(&c.explicit)));
    }
    let names = cases.iter().map(|c| c.name.to_owned()).collect();
    let mut traffic = Panel::new(
        "Bytes on the bus",
        ("", Scale::Names(names)),
        ("bytes a ray", Scale::Linear { from_zero: true }),
    );
    for (i, (name, explicit, way)) in [
        ("descriptors, down", false, 0),
        ("explicit, down", true, 0),
        ("descriptors, up", false, 1),
        ("explicit, up", true, 1),
    ]
    .into_iter()
    .enumerate()
    {
        let of = |c: &Case| bytes(if explicit { &c.explicit[1] } else { &c.descriptors[1] })[way];
        let bars = cases.iter().enumerate().map(|(k, c)| (k as f64, of(c)));
        traffic.series.push(Series::new(name, Mark::Bars, i + 1, bars));
    }
    let mut says = Vec::new();
    for c in &cases {
        let ([down, up], [down_each, up_each]) = (bytes(&c.descriptors[1]), bytes(&c.explicit[1]));
        let faster = |k: usize| c.explicit[k].cycles_per_ray() / c.descriptors[k].cycles_per_ray();
        says.push(format!(
            "{}: {} bytes a ray go down instead of {} ({} times fewer), {} instead of {} come up. Explicit rays take {} \
             times the cycles with a bus of {} MHz, {} times at {} MHz and {} times at {} MHz.",
            c.name,
            digits(down),
            digits(down_each),
            digits(down_each / down),
            digits(up),
            digits(up_each),
            digits(faster(0)),
            CLOCKS[0],
            digits(faster(1)),
            CLOCKS[1],
            digits(faster(3)),
            CLOCKS[3],
        ));
    }
    says.push(
        "Descriptors save nothing on the way up: every ray's nearest hit comes back by itself, and only hit bits come back 64 \
         at a time."
            .to_owned(),
    );
    let same_up = cases.iter().all(|c| bytes(&c.descriptors[0])[1] == bytes(&c.explicit[0])[1]);
    Ok(Findings {
        question: "A bundle's descriptor stands for up to 64 rays. What does that save on the host bus, and what in cycles, \
                   against sending every ray by itself?"
            .to_owned(),
        method: "The default board; camera tiles of the Cornell box, fans of shadow rays to its lamp and hemisphere gathers from \
                 its elements, 64 rays a bundle, as descriptors and as the same rays in words; four bus clocks, 32 bit. Explicit \
                 rays come in chunks of the same 64, so the board finds the same neighbours together."
            .to_owned(),
        tables: vec![table],
        panels: vec![rates, traffic],
        pictures: Vec::new(),
        says,
        checks: vec![
            Check::new(true, "descriptors and explicit rays are answered alike at every clock (the run stops otherwise)"),
            Check::new(same_up, "as many bytes come up for either"),
        ],
    })
}
