//! Progress bars on stderr; nothing where stderr is no terminal.

use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use crate::frame::Progress;
use crate::radiosity::{SolvePhase, SolveProgress};
use crate::report::si::{count, percent, si};

/// Steps of a bar.
const STEPS: u64 = 1000;

/// One bar a phase, the next one when the phase changes.
pub struct Bars {
    /// Unshot share at which pass 1 stops: the end of its bar.
    unshot_target: f64,
    /// Camera rays of the picture, for the rate of pass 2; 0 where rays are only verified.
    n_camera_rays: u64,
    /// The share of pass 2 that is done is that of its camera rays.
    has_rate: bool,
    /// In front of the phase's name.
    title: String,
    current: Option<(Phase, Bar)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Pass 1, patches shoot by kernel.
    Shots,
    /// Pass 1, bundles of rays shoot the rest.
    Stochastic,
    Render,
    Probe,
}

/// A phase's bar.
struct Bar {
    bar: ProgressBar,
    began: Instant,
    /// Shots and rays when it began: a solve that goes on from a checkpoint has some behind it.
    before: [u64; 2],
}

impl Bars {
    /// Bars for a run that stops pass 1 at `unshot_target` and has a picture of `n_camera_rays`.
    pub fn new(unshot_target: f64, n_camera_rays: u64) -> Bars {
        Bars { unshot_target, n_camera_rays, has_rate: true, title: String::new(), current: None }
    }

    /// Without a rate of camera rays: how many will be cast shows only as they are.
    pub fn without_rate(mut self) -> Bars {
        self.has_rate = false;
        self
    }

    /// With a title before each phase: which of several runs it is.
    pub fn titled(mut self, title: &str) -> Bars {
        self.title = title.to_owned();
        self
    }

    /// Shows how far the run is.
    pub fn show(&mut self, progress: Progress) {
        if let Progress::Solve(p) = progress
            && p.resumed
        {
            let (shots, rays) = (p.n_shots, si(p.n_rays as f64, "rays"));
            eprintln!(
                "pass 1 goes on from its checkpoint: {shots} shots, {rays}, {} unshot",
                percent(p.unshot_share)
            );
        }
        let (phase, done) = done(progress, self.unshot_target);
        let n_camera_rays = if self.has_rate { self.n_camera_rays } else { 0 };
        let Bar { bar, began, before } = self.bar(phase, progress);
        let seconds = began.elapsed().as_secs_f64().max(1e-9);
        bar.set_message(match progress {
            Progress::Solve(p) => solve_message(&p, *before, seconds),
            Progress::Probe(_) => String::new(),
            Progress::Render(_) if n_camera_rays == 0 => String::new(),
            Progress::Render(share) => si(share * n_camera_rays as f64 / seconds, "camera rays/s"),
        });
        bar.set_position((done.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }

    /// The phase's bar; a bar of another phase gives way.
    fn bar(&mut self, phase: Phase, progress: Progress) -> &Bar {
        if self.current.as_ref().is_some_and(|(p, _)| *p != phase) {
            self.finish();
        }
        let name = match phase {
            Phase::Shots => "pass 1",
            Phase::Stochastic => "pass 1, bundles",
            Phase::Render if self.n_camera_rays == 0 => "rays",
            Phase::Render => "pass 2",
            Phase::Probe => "points",
        };
        let title = &self.title;
        let before = match progress {
            Progress::Solve(p) => [p.n_shots as u64, p.n_rays],
            Progress::Render(_) | Progress::Probe(_) => [0; 2],
        };
        let (_, bar) = self.current.get_or_insert_with(|| {
            (phase, Bar { bar: new_bar(format!("{title}{name}")), began: Instant::now(), before })
        });
        bar
    }

    /// Removes the bar.
    pub fn finish(&mut self) {
        if let Some((_, bar)) = self.current.take() {
            bar.bar.finish_and_clear();
        }
    }
}

fn new_bar(prefix: String) -> ProgressBar {
    let bar = ProgressBar::new(STEPS);
    // The template is a constant; if it were wrong the default bar would do.
    if let Ok(style) = ProgressStyle::with_template("{prefix} {bar:30} {percent:>3} %  {msg}, {eta} left") {
        bar.set_style(style);
    }
    bar.set_prefix(prefix);
    bar
}

impl Drop for Bars {
    fn drop(&mut self) {
        self.finish();
    }
}

/// The phase, and the share of it that is done.
fn done(progress: Progress, unshot_target: f64) -> (Phase, f64) {
    match progress {
        Progress::Solve(SolveProgress { phase: SolvePhase::Stochastic { done }, .. }) => {
            (Phase::Stochastic, done)
        }
        Progress::Solve(p) => (Phase::Shots, solved_share(p.unshot_share, unshot_target)),
        Progress::Render(share) => (Phase::Render, share),
        Progress::Probe(share) => (Phase::Probe, share),
    }
}

/// Unshot power, shots or rays, and their rate over the `seconds` since there were `before` of them.
fn solve_message(p: &SolveProgress, before: [u64; 2], seconds: f64) -> String {
    let unshot = percent(p.unshot_share);
    match p.phase {
        SolvePhase::Shots => {
            let rate = (p.n_shots as u64).saturating_sub(before[0]) as f64 / seconds;
            format!(
                "{unshot} of the power unshot, {}, {}",
                count(p.n_shots as u64, "shots"),
                si(rate, "shots/s")
            )
        }
        SolvePhase::Stochastic { .. } => {
            let rate = p.n_rays.saturating_sub(before[1]) as f64 / seconds;
            format!("{unshot} of the power unshot, {}, {}", count(p.n_rays, "rays"), si(rate, "rays/s"))
        }
    }
}

/// How far pass 1 is: the unshot power falls about exponentially, so on a logarithmic scale.
fn solved_share(unshot: f64, target: f64) -> f64 {
    if unshot <= target || target >= 1.0 {
        return 1.0;
    }
    if target <= 0.0 { 0.0 } else { (unshot.ln() / target.ln()).clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solved_share_runs_from_nothing_to_all_on_a_log_scale() {
        assert_eq!(solved_share(1.0, 1e-4), 0.0);
        assert!((solved_share(1e-2, 1e-4) - 0.5).abs() < 1e-12);
        assert_eq!(solved_share(1e-4, 1e-4), 1.0);
        assert_eq!(solved_share(0.0, 0.0), 1.0);
        assert_eq!(solved_share(0.5, 0.0), 0.0);
        assert_eq!(solved_share(2.0, 1e-4), 0.0);
    }

    #[test]
    fn pass_1_tells_unshot_power_shots_and_their_rate_and_rounds_of_bundles_by_their_share() {
        let shots = SolveProgress {
            phase: SolvePhase::Shots,
            n_shots: 120,
            n_rays: 50_000,
            unshot_share: 0.01,
            resumed: false,
        };
        let (phase, share) = done(Progress::Solve(shots), 1e-4);
        assert_eq!(phase, Phase::Shots);
        assert!((share - 0.5).abs() < 1e-12);
        assert_eq!(
            solve_message(&shots, [100, 0], 10.0),
            "1.00 % of the power unshot, 120 shots, 2.00 shots/s"
        );
        let rounds = SolveProgress { phase: SolvePhase::Stochastic { done: 0.25 }, ..shots };
        assert_eq!(done(Progress::Solve(rounds), 1e-4), (Phase::Stochastic, 0.25));
        assert_eq!(
            solve_message(&rounds, [0, 40_000], 2.0),
            "1.00 % of the power unshot, 50.0 krays, 5.00 krays/s"
        );
    }
}
