//! The summaries that end a run: aligned plain text, one screen, SI prefixes.
//!
//! ```text
//! label     value, value, value
//! ```

use crate::radiosity::refine::RefineReport;
use std::fmt::Write as _;

use super::board_text::{all_blocks_table, block_kinds_table, board_lines};
use super::grid::picture_text;
use super::kinds;
use super::si::{count, percent, share, si, significant};
use super::{
    CompareReport, PassOneReport, ProbedPoint, RenderReport, SceneFacts, SimulateReport, SolveReport, Timings,
};
use crate::radiosity::summary::IlluminanceRange;
use crate::raycast::Purpose;
use crate::reconstruct::{Method, ReconstructOptions};
use crate::render::{Filter, Region, RenderMethod, RenderOptions, Transport};
use crate::units::Rgb;

/// Width of the label column.
const LABEL: usize = 11;

/// Longest line (characters).
pub(crate) const WIDTH: usize = 100;

pub(crate) fn line(out: &mut String, label: &str, text: impl std::fmt::Display) {
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{label:<LABEL$}{text}");
}

/// Writes items behind a label, on as many lines as they need.
pub(crate) fn wrapped(out: &mut String, label: &str, items: &[String], separator: &str) {
    let (mut text, mut label) = (String::new(), label);
    for (i, item) in items.iter().enumerate() {
        let end = if i + 1 == items.len() { "" } else { separator };
        if !text.is_empty() && text.len() + item.len() + end.trim_end().len() > WIDTH - LABEL {
            line(out, label, text.trim_end());
            (text, label) = (String::new(), "");
        }
        text.push_str(item);
        text.push_str(end);
    }
    line(out, label, text);
}

/// What `render` ends with.
pub fn render_summary(r: &RenderReport) -> String {
    let mut out = String::new();
    scene_line(&mut out, &r.scene);
    if let Some(pass_1) = &r.pass_1 {
        pass_1_lines(&mut out, pass_1);
        surfaces_table(&mut out, pass_1);
    }
    let o = &r.options;
    let rays = samples_text(r);
    let how = method_text(o);
    line(
        &mut out,
        "pass 2",
        format_args!("{} x {} pixels, {rays} per pixel, {how}, {} caster", o.width, o.height, r.caster),
    );
    if let Some(missed) = r.share_not_two_pass {
        let what = match o.transport {
            Transport::Full => "in the picture",
            Transport::TwoPass => "dropped",
        };
        let missed = percent(missed);
        line(
            &mut out,
            "",
            format_args!("{missed} of the light came by paths that two-pass does not model: {what}"),
        );
    }
    film_line(&mut out, r);
    direct_lines(&mut out, r);
    reconstruction_line(&mut out, r);
    if let Some(ambient) = r.ambient_w_m2 {
        let e = si(ambient.sum() / 3.0, "W/m^2");
        line(
            &mut out,
            "ambient",
            format_args!("{e} (mean of r, g, b) added to the stored light, in no account"),
        );
    }
    match &r.board {
        Some(board) => {
            board_lines(&mut out, board);
            block_kinds_table(&mut out, board);
        }
        None => kinds::kind_lines(&mut out, &r.rays_by_kind),
    }
    for (i, picture) in r.pictures.iter().enumerate() {
        let how = match picture.exposure {
            Some(e) if e.auto => format!("sRGB, EV {:+.2} (auto)", e.ev),
            Some(e) => format!("sRGB, EV {:+.2}", e.ev),
            None => "linear, W/m^2/sr".to_owned(),
        };
        line(
            &mut out,
            if i == 0 { "pictures" } else { "" },
            format_args!("{}  {how}", picture.path.display()),
        );
    }
    for (i, picture) in r.false_colour.iter().enumerate() {
        let label = if i == 0 && r.pictures.is_empty() { "pictures" } else { "" };
        line(&mut out, label, picture_text(picture));
    }
    time_line(&mut out, &r.timings);
    out
}

/// Which sources were sampled, and what shadow rays that took.
fn direct_lines(out: &mut String, r: &RenderReport) {
    let Some(direct) = &r.direct else { return };
    if let Some(s) = direct.selection.filter(|s| s.sources > 0) {
        let stored = s.stored_hidden + s.stored_smooth + s.stored_weak;
        let pairs = (s.sampled + stored).max(1) as f64;
        line(
            out,
            "sources",
            format_args!(
                "{} of {} sampled somewhere; by patch {} sampled, stored {} hidden, {} smooth, {} weak; {} chose them",
                s.sampled_sources,
                s.sources,
                percent(s.sampled as f64 / pairs),
                percent(s.stored_hidden as f64 / pairs),
                percent(s.stored_smooth as f64 / pairs),
                percent(s.stored_weak as f64 / pairs),
                si(s.shadow.rays as f64, "rays"),
            ),
        );
    }
    let shadow = direct.shadow;
    let per_pair = shadow.rays as f64 / shadow.pairs.max(1) as f64;
    line(
        out,
        "shadows",
        format_args!(
            "{} for {} of a point and a source, {per_pair:.2} each; {} more were known to be blocked ({})",
            si(shadow.rays as f64, "rays"),
            si(shadow.pairs as f64, "pairs"),
            si(shadow.known_blocked as f64, "rays"),
            si(shadow.occluder_tests as f64, "tests by the host"),
        ),
    );
}

/// How pass 2 finds light.
fn method_text(o: &RenderOptions) -> String {
    let reconstruction = format!("{} reconstruction", o.reconstruct.name());
    match o.method {
        RenderMethod::TwoPass => format!("two-pass, {reconstruction}"),
        RenderMethod::FullRadiosity => format!("full-radiosity, {reconstruction}"),
        RenderMethod::Whitted => "whitted, constant ambient light".to_owned(),
        RenderMethod::Path => {
            let paths = count(u64::from(o.paths), if o.paths == 1 { "path" } else { "paths" });
            format!("path tracing, {paths} per ray, {} transport", o.transport.name())
        }
    }
}

/// Camera rays a pixel.
fn samples_text(r: &RenderReport) -> String {
    let o = &r.options;
    match o.adaptive {
        Some(a) if a.max > o.samples => {
            format!("{} to {} rays ({:.2})", o.samples, a.max, r.mean_rays_per_pixel)
        }
        _ => count(u64::from(o.samples), if o.samples == 1 { "ray" } else { "rays" }),
    }
}

/// Region, filter, quality and interruption, where there is anything to tell.
fn film_line(out: &mut String, r: &RenderReport) {
    let o = &r.options;
    let mut told = Vec::new();
    if let Some(q) = &r.quality {
        let elements =
            q.elements.map_or("the scene's elements".to_owned(), |n| count(n.into(), "elements wanted"));
        let rays = match q.contrast {
            None => count(q.samples.into(), "camera rays a pixel"),
            Some(c) => format!("{} to {} camera rays a pixel (contrast {c})", q.samples, q.max_samples),
        };
        let shadows =
            format!("{n} x {n} shadow rays at most to {}", percent(q.shadow_error), n = q.shadow_strata);
        told.push(format!("{} quality: {elements}, {rays}, {shadows}", q.name));
    }
    if let Some(region) = o.region {
        let Region { x, y, width, height } = region;
        told.push(format!("region of {width} x {height} at {x}, {y}"));
    }
    if o.filter != Filter::Box {
        let n = count(r.negative_pixels, "pixels");
        let negative = if r.negative_pixels > 0 { format!(", {n} negative made 0") } else { String::new() };
        told.push(format!("{} filter{negative}", o.filter.name()));
    }
    if let Some(p) = &r.partial {
        told.push(format!("stopped with {} done", percent(p.done)));
    }
    if !told.is_empty() {
        wrapped(out, "", &told, "; ");
    }
}

/// What the reconstruction had to mend, and rules that are not the usual ones; nothing where there is nothing to tell.
fn reconstruction_line(out: &mut String, r: &RenderReport) {
    if !r.options.method.needs_pass_1() {
        return;
    }
    let (o, usual) = (r.options.reconstruction(), ReconstructOptions::default());
    let mut told = Vec::new();
    if !matches!(o.method, Method::Constant | Method::Bilinear) {
        if o.gradients != usual.gradients {
            told.push(format!("{} gradients", o.gradients.name()));
        }
        if o.twists != usual.twists {
            told.push(format!("{} twists", o.twists.name()));
        }
    }
    if o.method == Method::HermiteLimited {
        told.push(format!("{} limited", count(r.limited_vertices as u64, "vertices")));
    }
    if r.clamped_pixels > 0 {
        let n_pixels = u64::from(r.options.width) * u64::from(r.options.height);
        let part = percent(share(r.clamped_pixels, n_pixels));
        told.push(format!("{} ({part}) with negative light made 0", count(r.clamped_pixels, "pixels")));
    }
    if !told.is_empty() {
        line(out, "", format_args!("stored light: {}", told.join(", ")));
    }
}

/// What `solve` ends with.
pub fn solve_summary(r: &SolveReport) -> String {
    let mut out = String::new();
    scene_line(&mut out, &r.scene);
    pass_1_lines(&mut out, &r.pass_1);
    surfaces_table(&mut out, &r.pass_1);
    match &r.board {
        Some(board) => {
            board_lines(&mut out, board);
            block_kinds_table(&mut out, board);
        }
        None => kinds::kind_lines(&mut out, &r.rays_by_kind),
    }
    time_line(&mut out, &r.timings);
    out
}

/// What `simulate` ends with; `all_blocks`: a row for every block, not for every kind.
pub fn simulate_summary(r: &SimulateReport, all_blocks: bool) -> String {
    let mut out = String::new();
    if let Some(scene) = &r.scene {
        scene_line(&mut out, scene);
    }
    let file = r.rays_file.as_ref().map(|f| format!(": {}", f.display())).unwrap_or_default();
    line(&mut out, "workload", format_args!("{}{file}", r.workload));
    if let Some(w) = &r.warm_up {
        line(
            &mut out,
            "warm-up",
            format_args!(
                "not counted: the first {}, {}, {} (asked: {})",
                count(w.commands, if w.commands == 1 { "command" } else { "commands" }),
                count(w.cycles, "cycles"),
                count(w.rays, "rays"),
                count(w.asked_cycles, "cycles")
            ),
        );
    }
    board_lines(&mut out, &r.board);
    if all_blocks {
        all_blocks_table(&mut out, &r.board);
    } else {
        block_kinds_table(&mut out, &r.board);
    }
    super::observed_text::observed_lines(&mut out, r.observed.as_ref());
    time_line(&mut out, &r.timings);
    out
}

/// The table of `probe`.
pub fn probe_table(points: &[ProbedPoint]) -> String {
    let by_chance = points.iter().any(|p| p.standard_error_w_m2.is_some());
    let mut out =
        format!("{:>28}  {:>22}  {:>33}  {:>12}", "at (m)", "normal", "irradiance r g b (W/m^2)", "lux");
    out.push_str(if by_chance { "  +- standard error r g b (W/m^2)\n" } else { "\n" });
    for p in points {
        let [r, g, b] = p.irradiance_w_m2.0;
        let _ = write!(
            out,
            "{:>28}  {:>22}  {r:>11.5e}{g:>11.4e}{b:>11.4e}  {:>12.4}",
            format!("{:.4} {:.4} {:.4}", p.at.x, p.at.y, p.at.z),
            format!("{:.3} {:.3} {:.3}", p.normal.x, p.normal.y, p.normal.z),
            p.illuminance_lx
        );
        if let Some(Rgb([r, g, b])) = p.standard_error_w_m2 {
            let _ = write!(out, "  {r:>11.1e}{g:>10.1e}{b:>10.1e}");
        }
        out.push('\n');
    }
    out
}

/// What `compare` prints.
pub fn compare_summary(r: &CompareReport) -> String {
    let d = &r.difference;
    let mut out = String::new();
    let of_all = |n: u64| format!("{n} of {} pixels ({})", d.n_pixels, percent(share(n, d.n_pixels)));
    line(&mut out, "differ", of_all(d.n_differing));
    line(
        &mut out,
        "over 1 %",
        format_args!("{} by more than 1 % of the mean luminance", of_all(d.n_over_1_percent)),
    );
    line(&mut out, "over 5 %", format_args!("{} by more than 5 %", of_all(d.n_over_5_percent)));
    if d.n_not_finite > 0 {
        line(&mut out, "not finite", of_all(d.n_not_finite));
    }
    match d.max_at {
        Some([x, y]) => line(
            &mut out,
            "largest",
            format_args!(
                "{:.4e} W/m^2/sr = {} of the mean, at column {x}, row {y}",
                d.max_absolute,
                percent(d.max_relative)
            ),
        ),
        None => line(&mut out, "largest", "0"),
    }
    line(&mut out, "RMSE", format_args!("{} of the mean luminance", percent(d.rmse_relative)));
    line(
        &mut out,
        "mean",
        format_args!("{:.6e} and {:.6e} W/m^2/sr", d.mean_luminance_a, d.mean_luminance_b),
    );
    if let Some(bands) = &r.mach_bands {
        let at = bands.largest_at.map_or(String::new(), |[x, y]| format!(", most at column {x}, row {y}"));
        line(
            &mut out,
            "creases",
            format_args!(
                "RMS second difference {:.3e} and {:.3e} of the mean luminance per square of a pixel",
                bands.rms_a, bands.rms_b
            ),
        );
        line(
            &mut out,
            "new bands",
            format_args!("{:.3e} RMS, {:.3e} at the 99th percentile{at}", bands.rms_added, bands.p99_added),
        );
    }
    if let Some(scale) = r.band_scale {
        line(&mut out, "band map", format_args!("A left, B right; white and black at {scale:.3e}"));
    }
    if let Some(limit) = d.threshold {
        let verdict = if r.passed { "passed" } else { "FAILED" };
        line(
            &mut out,
            verdict,
            format_args!("{} over the threshold {}", of_all(d.n_over_threshold), percent(limit)),
        );
    }
    out
}

pub(super) fn scene_line(out: &mut String, s: &SceneFacts) {
    line(
        out,
        "scene",
        format_args!(
            "{}: {} surfaces, {} elements, {} patches",
            s.path.display(),
            s.n_surfaces,
            s.n_elements,
            s.n_patches
        ),
    );
}

fn refinement_lines(out: &mut String, r: &RefineReport) {
    line(
        out,
        "mesh",
        format_args!(
            "refined: {} elements ({} for balance; uniform {}, at most {}), {} to decide; estimated error of \
             interpolation {} (wanted {})",
            r.n_elements,
            r.n_for_balance,
            r.n_uniform,
            r.n_limit,
            count(r.n_rays, "rays"),
            percent(r.estimated_error),
            percent(r.wanted_error),
        ),
    );
    if r.n_cut_by_count + r.n_cut_by_depth > 0 {
        line(
            out,
            "",
            format_args!(
                "cut off: {} splits by the limit on elements, {} elements by the limit of {} splits inside each other",
                r.n_cut_by_count, r.n_cut_by_depth, r.max_depth
            ),
        );
    }
    if r.lines.n_segments > 0 {
        line(
            out,
            "",
            format_args!(
                "shadow lines: {} segments on patches, {} element edges stand for them (C-1)",
                r.lines.n_segments, r.lines.n_flagged_edges
            ),
        );
    }
    if r.lines.skipped {
        line(out, "", format_args!("shadow lines: not looked for, too many edges and patches"));
    }
    if r.lines.n_penumbra_segments > 0 {
        line(
            out,
            "",
            format_args!(
                "borders of penumbras: {} segments on patches, {} element edges stand for them (C0)",
                r.lines.n_penumbra_segments, r.lines.n_c0_edges
            ),
        );
    }
    if r.lines.n_emitters_skipped > 0 {
        line(
            out,
            "",
            format_args!(
                "borders of penumbras: {} emitting surfaces not looked at (weaker, curved, or too many edges)",
                r.lines.n_emitters_skipped
            ),
        );
    }
}

fn pass_1_lines(out: &mut String, r: &PassOneReport) {
    if let Some(refinement) = &r.refinement {
        refinement_lines(out, refinement);
    }
    let p = &r.pass_1;
    let from = p.loaded_from.as_ref().map(|f| format!(" (from {})", f.display())).unwrap_or_default();
    line(
        out,
        "pass 1",
        format_args!(
            "{} by {}, {}, row-sum error {} mean, {} max{from}",
            count(p.n_shots as u64, "shots"),
            count(p.n_shooters as u64, "patches"),
            count(p.n_rays, "rays"),
            percent(r.row_sum_error.mean),
            percent(r.row_sum_error.max),
        ),
    );
    if r.reciprocity.n_pairs > 0 {
        line(
            out,
            "",
            format_args!(
                "reciprocity error {} RMS, {} max over {}{}",
                percent(r.reciprocity.rms),
                percent(r.reciprocity.max),
                count(r.reciprocity.n_pairs, "pairs of patches"),
                if p.exact { "; exact: a dense linear solve" } else { "" },
            ),
        );
    }
    if let Some(earlier) = &p.earlier {
        line(
            out,
            "",
            format_args!(
                "going on from {} with {}, {}",
                count(u64::from(earlier.n_solves), "solves"),
                count(earlier.n_shots, "shots"),
                count(earlier.n_rays, "rays"),
            ),
        );
    }
    if let Some(error) = &p.error_estimate {
        line(
            out,
            "bundles",
            format_args!(
                "{} in {} rounds shot the rest: standard error {} of the mean irradiance (RMS over the elements)",
                count(error.n_rays, "rays"),
                error.n_rounds,
                percent(error.relative_rms),
            ),
        );
    }
    let a = &r.account;
    let w = |rgb: crate::units::Rgb| si(rgb.sum(), "W");
    let emitted = a.emitted_w.sum();
    let residual = if emitted == 0.0 { 0.0 } else { a.residual_w.sum() / emitted };
    line(
        out,
        "energy",
        format_args!(
            "emitted {} = absorbed {} + unshot {} + openings {} + specular {} + backs {}",
            w(a.emitted_w),
            w(a.absorbed_w),
            w(a.unshot_w),
            w(a.lost_w),
            w(a.specular_w),
            w(a.back_w),
        ),
    );
    line(
        out,
        "",
        format_args!("+ residual {} ({} of the emitted); r + g + b", w(a.residual_w), percent(residual)),
    );
}

/// Surfaces that the table lists.
const LISTED_SURFACES: usize = 10;
/// Widest name in it.
const NAME_WIDTH: usize = 24;

/// Irradiance and illuminance of the surfaces, the largest of many, and of all together.
fn surfaces_table(out: &mut String, r: &PassOneReport) {
    let all = r.surfaces.len();
    let mut shown: Vec<usize> = (0..all).collect();
    shown.sort_by(|a, b| r.surfaces[*b].area_m2.total_cmp(&r.surfaces[*a].area_m2));
    shown.truncate(LISTED_SURFACES);
    shown.sort_unstable();
    let short = |name: &str| match name.char_indices().nth(NAME_WIDTH) {
        Some(_) => format!("{}...", name.chars().take(NAME_WIDTH - 3).collect::<String>()),
        None => name.to_owned(),
    };
    let mut row = |name: &str, cells: [String; 5]| {
        let [area, w_m2, mean, min, max] = cells;
        let _ = writeln!(out, "{name:<NAME_WIDTH$} {area:>11}  {w_m2:>26}  {mean:>10} {min:>10} {max:>10}");
    };
    let heads = ["area (m^2)", "E mean r g b (W/m^2)", "mean (lx)", "min (lx)", "max (lx)"];
    row("surface", heads.map(str::to_owned));
    let cells = |area_m2: f64, e: crate::units::Rgb, lx: IlluminanceRange| {
        let [red, green, blue] = e.0;
        let numbers = [lx.mean, lx.min, lx.max].map(significant);
        let [mean, min, max] = numbers;
        [significant(area_m2), format!("{red:.2e} {green:.2e} {blue:.2e}"), mean, min, max]
    };
    for s in shown.iter().map(|i| &r.surfaces[*i]) {
        row(&short(&s.name), cells(s.area_m2, s.mean_irradiance_w_m2, s.illuminance_lx));
    }
    let t = &r.totals;
    let name = match all - shown.len() {
        0 => "all".to_owned(),
        more => format!("all, with {more} more"),
    };
    row(&name, cells(t.area_m2, t.mean_irradiance_w_m2, t.illuminance_lx));
    out.push('\n');
}

/// Longest line of phases behind its label (characters).
const TIME_LINE: usize = WIDTH - LABEL;

pub(super) fn time_line(out: &mut String, t: &Timings) {
    let mut text = format!("{} (", si(t.total_seconds, "s"));
    let mut label = "wall time";
    for (i, phase) in t.phases.iter().enumerate() {
        let end = if i + 1 == t.phases.len() { ")" } else { ", " };
        let item = format!("{} {}{end}", phase.name, si(phase.seconds, "s"));
        if text.len() + item.len() > TIME_LINE {
            line(out, label, text.trim_end());
            (text, label) = (String::new(), "");
        }
        text.push_str(&item);
    }
    line(out, label, text);
    if let Some(casting) = &t.ray_casting {
        kinds::time_line(out, casting);
    }
}

/// A purpose as people read it.
pub fn purpose_name(purpose: Purpose) -> &'static str {
    match purpose {
        Purpose::Primary => "primary",
        Purpose::FormFactor => "form factors",
        Purpose::Selection => "selection",
        Purpose::Shadow => "shadow",
        Purpose::Specular => "specular",
        Purpose::Probe => "probe",
        Purpose::Bounce => "bounce",
    }
}
