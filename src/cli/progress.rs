//! Progress bars on stderr; nothing where stderr is no terminal.

use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use crate::frame::Progress;
use crate::report::si::{percent, si};

/// Steps of a bar.
const STEPS: u64 = 1000;

/// One bar a phase, the next one when the phase changes.
pub struct Bars {
    /// Unshot share at which pass 1 stops: the end of its bar.
    unshot_target: f64,
    /// Camera rays of the picture, for the rate of pass 2; 0 where rays are only verified.
    n_camera_rays: u64,
    /// In front of the phase's name.
    title: String,
    current: Option<(Phase, (ProgressBar, Instant))>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    Solve,
    Render,
    Probe,
}

impl Bars {
    /// Bars for a run that stops pass 1 at `unshot_target` and has a picture of `n_camera_rays`.
    pub fn new(unshot_target: f64, n_camera_rays: u64) -> Bars {
        Bars { unshot_target, n_camera_rays, title: String::new(), current: None }
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
        let (phase, done) = match progress {
            Progress::Solve(p) => (Phase::Solve, solved_share(p.unshot_share, self.unshot_target)),
            Progress::Render(share) => (Phase::Render, share),
            Progress::Probe(share) => (Phase::Probe, share),
        };
        let n_camera_rays = self.n_camera_rays;
        let (bar, started) = self.bar(phase);
        let seconds = started.elapsed().as_secs_f64().max(1e-9);
        bar.set_message(match progress {
            Progress::Solve(p) => {
                format!("{} unshot, {}", percent(p.unshot_share), si(p.n_shots as f64 / seconds, "shots/s"))
            }
            Progress::Probe(_) => String::new(),
            Progress::Render(_) if n_camera_rays == 0 => String::new(),
            Progress::Render(share) => si(share * n_camera_rays as f64 / seconds, "camera rays/s"),
        });
        bar.set_position((done.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }

    /// The phase's bar and when it began; a bar of another phase gives way.
    fn bar(&mut self, phase: Phase) -> &(ProgressBar, Instant) {
        if self.current.as_ref().is_some_and(|(p, _)| *p != phase) {
            self.finish();
        }
        let name = match phase {
            Phase::Solve => "pass 1",
            Phase::Render if self.n_camera_rays == 0 => "rays",
            Phase::Render => "pass 2",
            Phase::Probe => "points",
        };
        let title = &self.title;
        let (_, bar) =
            self.current.get_or_insert_with(|| (phase, (new_bar(format!("{title}{name}")), Instant::now())));
        bar
    }

    /// Removes the bar.
    pub fn finish(&mut self) {
        if let Some((_, (bar, _))) = self.current.take() {
            bar.finish_and_clear();
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
}
