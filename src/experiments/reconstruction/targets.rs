//! What must hold, and what the rows say.
//!
//! ```text
//! Run at 8 x 8, Graded, shadow runs, literal rows --> Checks, sentences
//! ```

use super::lit_cube::Light;
use super::literal::{Returned, Scaled};
use super::measure::{BILINEAR, CONSTANT, HERMITE, LIMITED, LITERAL, ZERO};
use super::pictures::Shown;
use super::scenes::{Graded, Run, STATED};
use crate::experiments::Check;
use crate::reconstruct::metrics::Metrics;

/// Least gain of Hermite over bilinear by part of the lit cube: L2, and band where one is stated.
const GAINS: [(f64, Option<f64>); 3] = [(2.5, Some(5.0)), (2.5, Some(5.0)), (1.4, None)];
/// Least gain of grading in L2 of the indirect light.
const GRADED_GAIN: f64 = 2.0;

/// How much better Hermite is than bilinear, by a metric, part by part.
fn gains(run: &Run, name: &str, metric: impl Fn(&Metrics) -> f64) -> Vec<f64> {
    let (ours, theirs) = (run.by(name), run.by(BILINEAR));
    ours.parts.iter().zip(&theirs.parts).map(|(o, t)| metric(t) / metric(o)).collect()
}

/// The lit cube at 8 x 8 elements a wall.
pub fn cube_checks(run: &Run) -> Vec<Check> {
    let l2 = gains(run, HERMITE, |m| m.l2);
    let band = gains(run, HERMITE, |m| m.band);
    let h1 = gains(run, HERMITE, |m| m.h1);
    let mut checks = Vec::new();
    for (p, (part, (least_l2, least_band))) in run.parts.iter().zip(GAINS).enumerate() {
        checks.push(Check::new(
            l2[p] >= least_l2,
            format!("lit-cube, {part}: L2 {:.2} times better than bilinear, at least {least_l2}", l2[p]),
        ));
        if let Some(least) = least_band {
            checks.push(Check::new(
                band[p] >= least,
                format!("lit-cube, {part}: band {:.2} times under bilinear's, at least {least}", band[p]),
            ));
        }
        checks.push(Check::new(
            h1[p] > 1.0,
            format!("lit-cube, {part}: gradient error {:.2} times under bilinear's, more than 1", h1[p]),
        ));
    }
    for name in [ZERO, LITERAL] {
        let (l2, band) = (gains(run, name, |m| m.l2), gains(run, name, |m| m.band));
        let missed = (0..2).all(|p| l2[p] < GAINS[p].0 || GAINS[p].1.is_some_and(|least| band[p] < least));
        checks.push(Check::new(
            missed,
            format!(
                "lit-cube: `{name}` does not reach both on floor or side wall (L2 {:.2} and {:.2}, band {:.2} and {:.2} times)",
                l2[0], l2[1], band[0], band[1]
            ),
        ));
    }
    checks
}

/// Vertices of the lit cube's floor and sides that are limited: none.
pub fn limiter_check(n_limited: usize) -> Check {
    Check::new(
        n_limited == 0,
        format!("lit-cube: {n_limited} vertices of floor and side walls are limited, 0 allowed"),
    )
}

/// The point light's shadow under the limiter.
pub fn overshoot_check(run: &Run) -> Check {
    let of = |name: &str| 100.0 * run.by(name).all.overshoot;
    Check::new(
        run.by(LIMITED).all.overshoot <= OVERSHOOT_NONE,
        format!(
            "point-shadow, {}: `hermite-limited` overshoots by {:.4} % of the mean (bilinear {:.4} %, `hermite` {:.2} %)",
            run.mesh,
            of(LIMITED),
            of(BILINEAR),
            of(HERMITE)
        ),
    )
}

/// What counts as no overshoot: the error of a smooth maximum between vertices.
pub const OVERSHOOT_NONE: f64 = 1e-3;

/// Grading's gain on the indirect light.
pub fn graded_checks(rows: &[Graded]) -> Vec<Check> {
    // Four patches a wall leave bilinear just short of it: there the default method's.
    let stated = |g: &&Graded| g.n > STATED || g.way.name == HERMITE;
    let indirect = rows.iter().filter(|g| g.light == Light::Indirect).filter(stated);
    let check = |g: &Graded| {
        let [even, graded] = g.l2.last().copied().unwrap_or_default();
        Check::new(
            even >= GRADED_GAIN * graded,
            format!(
                "lit-cube, {} elements a wall, {}: grading gains {:.2} in L2 of the indirect light, at least {GRADED_GAIN}",
                g.n,
                g.way.name,
                even / graded
            ),
        )
    };
    indirect.map(check).collect()
}

/// The literal rule's share on a regular grid.
pub fn literal_check(rows: &[Returned]) -> Check {
    let small = rows.iter().filter(|r| r.slope <= 0.011).map(|r| r.shares[0]);
    let worst = small.map(|s| (s - 0.5).abs()).fold(0.0, f64::max);
    let others =
        rows.iter().flat_map(|r| [r.shares[1], r.shares[2]]).map(|s| (s - 1.0).abs()).fold(0.0, f64::max);
    Check::new(
        worst < 1e-4 && !rows.is_empty(),
        format!(
            "seed-edge-normals returns half of a small slope (within {worst:.1e}); facet-normals and least-squares return all of \
             it at every scale (within {others:.1e})"
        ),
    )
}

/// What the lit cube's rows say.
pub fn cube_says(run: &Run) -> Vec<String> {
    let mut says = Vec::new();
    for (p, part) in run.parts.iter().enumerate() {
        let of = |name: &str| &run.by(name).parts[p];
        let (ours, theirs) = (of(HERMITE), of(BILINEAR));
        says.push(format!(
            "lit-cube at 8 x 8, {part}: `hermite` has an L2 error of {:.2} % where bilinear has {:.2} % ({:.1} times less), a \
             gradient error of {:.1} % ({:.1} %), and a band of {:.4} 1/m ({:.4} 1/m: {:.1} times less).",
            100.0 * ours.l2,
            100.0 * theirs.l2,
            theirs.l2 / ours.l2,
            100.0 * ours.h1,
            100.0 * theirs.h1,
            ours.band,
            theirs.band,
            theirs.band / ours.band,
        ));
    }
    says.push(format!("Over all three walls {}.", best_by_metric(run)));
    says
}

/// Which method is best by which metric.
fn best_by_metric(run: &Run) -> String {
    let best = |metric: fn(&Metrics) -> f64| {
        let rows = run.rows.iter().map(|(way, m)| (way.name, metric(&m.all)));
        rows.min_by(|a, b| a.1.total_cmp(&b.1)).map_or("none", |(name, _)| name)
    };
    format!(
        "the smallest L2 error is `{}`'s, the smallest gradient error `{}`'s, the smallest band `{}`'s",
        best(|m| m.l2),
        best(|m| m.h1),
        best(|m| m.band),
    )
}

/// Fitted orders of convergence between the two finest even meshes.
pub fn order_says(runs: &[&Run]) -> Option<String> {
    let [.., coarse, fine] = runs else { return None };
    let order = |name: &str, metric: fn(&Metrics) -> f64| {
        let ratio = metric(&coarse.by(name).all) / metric(&fine.by(name).all);
        ratio.ln() / (coarse.element_m / fine.element_m).ln()
    };
    Some(format!(
        "Halving the elements from {} to {}: L2 falls with the power {:.2} of their size for bilinear and {:.2} for `hermite`, \
         gradient errors with {:.2} and {:.2}, bands with {:.2} and {:.2}. Edges where walls meet, with their a + c d^0.68, keep \
         every method from its order for smooth fields.",
        coarse.mesh,
        fine.mesh,
        order(BILINEAR, |m| m.l2),
        order(HERMITE, |m| m.l2),
        order(BILINEAR, |m| m.h1),
        order(HERMITE, |m| m.h1),
        order(BILINEAR, |m| m.band),
        order(HERMITE, |m| m.band),
    ))
}

/// Where grading gains and where it loses.
pub fn graded_says(rows: &[Graded], parts: &[&str]) -> Vec<String> {
    let mut says = Vec::new();
    for g in rows {
        let light = if g.light == Light::Direct { "direct" } else { "indirect" };
        let named = || parts.iter().copied().chain(["all"]).zip(&g.l2).filter(|(_, [even, _])| *even > 0.0);
        let list = |wins: bool| {
            let of = named().filter(|(_, [even, graded])| (graded < even) == wins);
            let told: Vec<String> = of.map(|(part, [e, g])| format!("{part} {:.2}", e / g)).collect();
            if told.is_empty() { "nowhere".to_owned() } else { told.join(", ") }
        };
        says.push(format!(
            "Grading, {light} light, {} elements a wall, `{}`: times better {}; worse {}.",
            g.n,
            g.way.name,
            list(true),
            list(false)
        ));
    }
    says
}

/// A scene with a shadow or a dense reference: best methods by metric, and overshoot.
pub fn scene_says(run: &Run) -> String {
    let of = |name: &str| &run.by(name).all;
    let (b, h, l) = (of(BILINEAR), of(HERMITE), of(LIMITED));
    let bands = || run.rows.iter().filter(|(way, _)| way.name != CONSTANT).map(|(_, m)| m.all.band);
    let (least, most) = (bands().fold(f64::INFINITY, f64::min), bands().fold(0.0, f64::max));
    let alike = match most < 1.15 * least {
        true => {
            " Bands of all that interpolate are alike: what the mesh does not resolve, and noise, outweigh the method."
        }
        false => "",
    };
    format!(
        "{}, {}: L2 {:.2} % bilinear, {:.2} % `hermite`, {:.2} % limited; band {:.3}, {:.3}, {:.3} 1/m; overshoot {:.2}, {:.2}, \
         {:.2} %; negative over {:.2}, {:.2}, {:.2} % of the area; {}.{alike}",
        run.scene,
        run.mesh,
        100.0 * b.l2,
        100.0 * h.l2,
        100.0 * l.l2,
        b.band,
        h.band,
        l.band,
        100.0 * b.overshoot,
        100.0 * h.overshoot,
        100.0 * l.overshoot,
        100.0 * b.negative_share,
        100.0 * h.negative_share,
        100.0 * l.negative_share,
        best_by_metric(run),
    )
}

/// The finding on the literal rule, with its derivation.
pub fn literal_says(returned: &[Returned], scaled: &[Scaled]) -> Vec<String> {
    let mut says = vec![
        "The 1992 paper's rule read literally takes the mean of unit normals of a vertex's edges, each upright in the plane of \
         its edge in (x, y, radiosity). On a regular grid with slopes p along x and q along y the edges give (-p, 0, 1) / sqrt(1 \
         + p^2) twice and (0, -q, 1) / sqrt(1 + q^2) twice. Their sum has the slope p / (1 + sqrt((1 + p^2) / (1 + q^2))) along \
         x: p/2 for small slopes, whatever the grid's spacing, since each edge knows only its own direction, and only half of \
         them lie along x. As p grows that slope tends to 1, whatever p: one and a squared slope are added under the root, so \
         the answer depends on the units of radiosity and of length."
            .to_owned(),
    ];
    if let (Some(low), Some(high)) = (returned.first(), returned.last()) {
        says.push(format!(
            "Measured: `seed-edge-normals` returns {:.4} of a slope of {} and {:.6} of a slope of {}.",
            low.shares[0], low.slope, high.shares[0], high.slope
        ));
    }
    let range = |k: usize| {
        let all = || scaled.iter().map(|s| 100.0 * s.l2[k]);
        (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max))
    };
    let (literal, facets, fit) = (range(0), range(1), range(2));
    says.push(format!(
        "The lit cube's relative L2 error, from a lamp of {} to one of {} W/m^2: {:.3} to {:.3} % with `seed-edge-normals`, {:.3} to \
         {:.3} % with `facet-normals`, {:.3} to {:.3} % with `least-squares`.",
        scaled.first().map_or(0.0, |s| s.factor),
        scaled.last().map_or(0.0, |s| s.factor),
        literal.0,
        literal.1,
        facets.0,
        facets.1,
        fit.0,
        fit.1
    ));
    says
}

/// What pictures say.
pub fn shown_says(shown: &[Shown]) -> Vec<String> {
    let added = |view: &str, way: &str| {
        let of = shown.iter().find(|s| s.view == view && s.way == way);
        of.and_then(|s| s.bands).map(|b| b.rms_added)
    };
    let mut views: Vec<&str> = shown.iter().map(|s| s.view).collect();
    views.dedup();
    let say = |view: &str| {
        let (b, h) = (added(view, BILINEAR)?, added(view, HERMITE)?);
        Some(format!(
            "Picture of {view}: bilinear adds creases of {b:.2e} RMS to the reference's, `hermite` {h:.2e}: {:.1} times less.",
            b / h
        ))
    };
    views.into_iter().filter_map(say).collect()
}
