//! The charts of a sweep, each as SVG and PNG.
//!
//! ```text
//! Results --Front--> pareto.rs: a pair of objectives each     --curves--> against.rs: metrics along an axis
//!         `--effects--> heat.rs: metrics by axes               `--stalls--> stalls.rs: the ICUs' cycles by cause
//! ```

mod against;
mod heat;
mod pareto;
mod stalls;

pub(super) use against::metrics as shown_metrics;
pub(super) use heat::direction;
use plotters::prelude::DrawingBackend;

use super::curve::Curve;
use super::pareto::Front;
use super::sensitivity::MetricEffects;
use super::{MetricColumn, Results};
use crate::plot::{Area, DrawError, Figure, Scale, Sheet};

/// A chart: the name of its files, and what is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Name of the files, without extension.
    pub name: String,
    /// What is drawn.
    pub drawing: Drawing,
}

/// What is drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Drawing {
    /// Panels.
    Sheet(Sheet),
    /// Cells of colours.
    Heat(heat::HeatMap),
}

impl Figure for Drawing {
    fn size(&self) -> (u32, u32) {
        match self {
            Drawing::Sheet(sheet) => sheet.size(),
            Drawing::Heat(map) => map.size(),
        }
    }

    fn draw<DB: DrawingBackend>(&self, root: &Area<DB>) -> Result<(), DrawError<DB>> {
        match self {
            Drawing::Sheet(sheet) => sheet.draw(root),
            Drawing::Heat(map) => map.draw(root),
        }
    }
}

/// Every chart that these results have rows for.
pub fn charts(results: &Results, front: &Front, curves: &[Curve], effects: &[MetricEffects]) -> Vec<Chart> {
    let mut all = pareto::charts(results, front);
    all.extend(curves.iter().map(|curve| against::chart(results, front, curve)));
    all.extend(heat::chart(results, effects));
    all.extend(stalls::chart(results, front));
    all
}

/// A part of a file's name.
fn file_key(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '_' }).collect()
}

/// Numbers over a wide range are read on a logarithmic scale.
fn scale_for(values: &[f64], from_zero: bool) -> Scale {
    let (low, high) = values.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(*v), b.max(*v)));
    if low > 0.0 && high > 12.0 * low { Scale::Log } else { Scale::Linear { from_zero } }
}

/// A metric's title along an axis, and what its values are multiplied by.
fn axis_title(metric: &MetricColumn, largest: f64) -> (f64, String) {
    let (factor, unit) = super::words::scaled_unit(&metric.unit, largest);
    let title = if unit.is_empty() { metric.name.clone() } else { format!("{} ({unit})", metric.name) };
    (factor, title)
}
