//! The front in each pair of the first objectives, before the points that it dominates.

use super::{Chart, Drawing, axis_title, file_key, scale_for};
use crate::explore::metric::Goal;
use crate::explore::results::Results;
use crate::explore::results::pareto::{Front, REFERENCE, minimised};
use crate::explore::results::words::{metric_text, point_text, shortened, summary};
use crate::plot::{Mark, Panel, Series, Sheet};
use crate::report::si::percent;

/// Objectives that are paired.
const PAIRED: usize = 3;
/// Characters of a legend's line.
const LEGEND: usize = 44;

pub(super) fn charts(results: &Results, front: &Front) -> Vec<Chart> {
    let first = &front.objectives[..front.objectives.len().min(PAIRED)];
    let pairs = first.iter().enumerate().flat_map(|(i, x)| first[i + 1..].iter().map(move |y| (*x, *y)));
    pairs.filter(|_| front.n_compared > 0).map(|(x, y)| chart(results, front, x, y)).collect()
}

fn chart(results: &Results, front: &Front, x: usize, y: usize) -> Chart {
    let of = |m: usize| {
        let rows = (0..results.rows.len()).filter(|i| front.rank[*i].is_some());
        rows.map(|i| results.rows[i].metrics[m].unwrap_or(f64::NAN)).collect::<Vec<f64>>()
    };
    let (xs, ys) = (of(x), of(y));
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let (fx, x_title) = axis_title(&results.metrics[x], largest(&xs));
    let (fy, y_title) = axis_title(&results.metrics[y], largest(&ys));
    let better = |m: usize| match results.metrics[m].goal {
        Goal::Minimise => "less is better",
        Goal::Maximise => "more is better",
    };
    let mut panel = Panel::new(
        format!("{} against {}", results.metrics[y].name, results.metrics[x].name),
        (&format!("{x_title}, {}", better(x)), scale_for(&xs, false)),
        (&y_title, scale_for(&ys, false)),
    );
    let mut notes = vec![summary(results, front.members.len())];
    let place = |row: usize| {
        let value = |m: usize| results.rows[row].metrics[m].unwrap_or(f64::NAN);
        (fx * value(x), fy * value(y))
    };
    let dominated: Vec<usize> =
        (0..results.rows.len()).filter(|i| front.rank[*i].is_some_and(|r| r > 0)).collect();
    let n_dominated = dominated.len();
    panel.series.push(Series::new(
        format!("dominated ({n_dominated})"),
        Mark::Faint,
        0,
        dominated.into_iter().map(place),
    ));
    let two = front.objectives.len() == 2;
    if two {
        panel.series.push(Series::new(
            "border of what is dominated",
            Mark::Dashed,
            1,
            stairs(results, front, x, y, place),
        ));
    }
    let members = front.members.iter().map(|row| place(*row));
    panel.series.push(Series::new(format!("front ({})", front.members.len()), Mark::Dots, 1, members));
    for (m, colour) in [(x, 2), (y, 3)] {
        if let Some((row, _)) = front.best(results, m).filter(|(row, _)| front.rank[*row].is_some()) {
            let value = metric_text(results, &results.rows[row], m);
            let name =
                format!("best {}: {value}, point {}", results.metrics[m].name, results.rows[row].ordinal);
            panel.series.push(Series::new(shortened(&name, LEGEND), Mark::Ring, colour, [place(row)]));
            let point = point_text(results, &results.rows[row]);
            notes.push(format!("Best {}: {value} at {point}.", results.metrics[m].name));
        }
    }
    if let Some(share) = front.hypervolume {
        let of = if two { "both" } else { "all" };
        notes.push(format!(
            "The front dominates {} of the box between the best values and a point {} ranges beyond them in {of} \
             objectives (normalised hypervolume).",
            percent(share),
            REFERENCE
        ));
    }
    if !two {
        let n = front.objectives.len();
        notes.push(format!(
            "The front is that of all {n} objectives: in two of them some of its points are behind others."
        ));
    }
    let name =
        format!("pareto-{}-{}", file_key(&results.metrics[x].name), file_key(&results.metrics[y].name));
    let sheet = Sheet { title: results.question.clone(), notes, panels: vec![panel] };
    Chart { name, drawing: Drawing::Sheet(sheet) }
}

/// From each point of a front of two objectives, along x and then along y to the next.
fn stairs(
    results: &Results,
    front: &Front,
    x: usize,
    y: usize,
    place: impl Fn(usize) -> (f64, f64),
) -> Vec<(f64, f64)> {
    let mut order = front.members.clone();
    let key = |row: &usize| {
        let value =
            |m: usize| minimised(results.rows[*row].metrics[m].unwrap_or(f64::NAN), results.metrics[m].goal);
        (value(x), value(y))
    };
    order.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
    let mut path = Vec::new();
    for pair in order.windows(2) {
        let [a, b] = [place(pair[0]), place(pair[1])];
        path.extend([a, (b.0, a.1), b]);
    }
    path
}
