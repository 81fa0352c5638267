//! `radeng verify`: board against oracle, bit for bit, and against software, once or for every value of a sweep.
//!
//! ```text
//! arguments --sweep.rs--> boards --frame::verify_scene, one after the other--> Findings --> report, plot, vectors
//! ```
//! A mismatch ends with status 1, its wires on stdout, and a file that replays it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use rtl_model::spec::BoardSpec;

use super::args::VerifyArgs;
use super::plan::DEFAULT_BOARD;
use super::progress::Bars;
use super::sweep::Sweep;
use super::{CliError, Outcome, film, plan};
use crate::frame::{self, Verified};
use crate::image::{OutputError, OutputFiles};
use crate::reconstruct::ReconstructOptions;
use crate::report::{self, Findings, SceneFacts, SweepReport, SweepRow, Timings, VerifyReport};
use crate::vectors::{self, VectorsFormat};
use crate::verify::{Compared, Mismatch, Model, VerifyOptions};

/// Where the first mismatch goes unless another place is named.
const MISMATCH_FILE: &str = "radeng-mismatch.csv";

pub(super) fn run(args: &VerifyArgs) -> Result<Outcome, CliError> {
    let vectors = format_of(args.vectors.as_deref())?;
    let mismatch = format_of(args.mismatch.as_deref())?;
    plan::check_outputs(
        [&args.vectors, &args.mismatch].into_iter().flatten().map(PathBuf::as_path),
        &[(args.report.as_deref(), "json"), (args.plot.as_deref(), "svg")],
        &[Some(&args.scene), Some(Path::new(&args.board))],
    )?;
    film::fixed_samples(&args.picture, "every pixel is verified alike")?;
    let board = plan::resolve_board(&args.board)?;
    let sweep = args.sweep.as_deref().map(|text| Sweep::parse(text, &board)).transpose()?;
    let options = options(args, sweep.is_some());
    let mut session =
        Session { args, options, first: None, warnings: Vec::new(), timings: Timings::default() };

    let mut files = OutputFiles::new();
    let mut facts = None;
    let (findings, sweep) = match sweep {
        None => {
            let verified = session.verify(&board, "")?;
            facts.get_or_insert_with(|| SceneFacts::new(&verified.scene, &verified.mesh));
            if let (Some(path), Some(format)) = (&args.vectors, vectors) {
                let n = args.vector_rays as usize;
                let sample = session
                    .timings
                    .measure("vectors", || vectors::sample(&verified.image, &verified.sample, n));
                files.stage(path, sample.to_bytes(format));
            }
            (Some(findings(&verified)), None)
        }
        Some(sweep) => {
            let mut rows = Vec::new();
            for (value, board) in &sweep.boards {
                let verified = session.verify(board, &format!("{} = {value}, ", sweep.parameter))?;
                facts.get_or_insert_with(|| SceneFacts::new(&verified.scene, &verified.mesh));
                rows.push(SweepRow { value: *value, findings: findings(&verified) });
            }
            (None, Some(SweepReport { parameter: sweep.parameter, rows }))
        }
    };
    // A sweep has at least one value.
    let Some(scene) = facts else { return Err(CliError::Usage("--sweep: no values".to_owned())) };
    if let (Some(path), Some(sweep)) = (&args.plot, &sweep) {
        let svg = report::sweep_plot::sweep_svg(sweep, &plan::scene_name(&args.scene), &board.name);
        files.stage(path, svg.map_err(CliError::Plot)?.into_bytes());
    }
    let mut runs = findings.iter().chain(sweep.iter().flat_map(|s| s.rows.iter().map(|row| &row.findings)));
    let passed = runs.all(Findings::passed);
    let mismatch_text = session.first.take().map(|first| session.first_mismatch(first, mismatch));
    let Session { options, timings, warnings, .. } = session;
    let report = VerifyReport {
        schema: VerifyReport::SCHEMA,
        scene,
        board,
        options,
        passed,
        findings,
        sweep,
        timings,
        warnings,
    };
    if let Some(path) = &args.report {
        files.stage(path, report::to_json(&report));
    }
    files.commit()?;
    let mut text = report::verify_text::verify_summary(&report);
    text.extend(mismatch_text);
    Ok(Outcome { text, warnings: report.warnings, check_failed: !passed, ..Outcome::default() })
}

/// The format of a vectors file to write.
fn format_of(path: Option<&Path>) -> Result<Option<VectorsFormat>, CliError> {
    let Some(path) = path else { return Ok(None) };
    let format = VectorsFormat::of(path).ok_or_else(|| OutputError::Target {
        path: path.to_owned(),
        what: "expected a name that ends in .csv or .rvec".to_owned(),
    })?;
    Ok(Some(format))
}

fn options(args: &VerifyArgs, is_sweep: bool) -> VerifyOptions {
    let mut first_test_bits = args.first_test.clone();
    first_test_bits.sort_unstable();
    first_test_bits.dedup();
    VerifyOptions {
        n_rays: u64::from(args.rays),
        n_clocked: u64::from(args.clocked),
        first_test_bits,
        solve: plan::resolve_solve(args.seed, &args.pass_1),
        picture: plan::resolve_picture(&args.picture, ReconstructOptions::default(), args.seed),
        compare_image: if is_sweep { args.image } else { !args.no_image },
    }
}

fn findings(verified: &Verified) -> Findings {
    let formats = verified.quantizer.formats();
    let step_m = verified.quantizer.half_m() / f64::from(1_u32 << formats.coord_frac_bits);
    Findings::new(&verified.verification, step_m)
}

/// The first mismatch of all runs with what replays it.
struct First {
    vectors: vectors::Vectors,
    mismatch: Mismatch,
    /// Which run of a sweep.
    title: String,
}

/// The runs of a command.
struct Session<'a> {
    args: &'a VerifyArgs,
    options: VerifyOptions,
    first: Option<First>,
    warnings: Vec<String>,
    timings: Timings,
}

impl Session<'_> {
    /// Verifies one board.
    fn verify(&mut self, board: &BoardSpec, title: &str) -> Result<Verified, CliError> {
        let mut bars = Bars::new(self.options.solve.unshot_share, 0).titled(title);
        let args = self.args;
        let show = &mut |p| bars.show(p);
        let verified = frame::verify_scene(&args.scene, args.elements, board, &self.options, show)?;
        bars.finish();
        for phase in &verified.timings.phases {
            self.timings.add_to(phase.name, phase.seconds);
        }
        for warning in &verified.warnings {
            if !self.warnings.contains(warning) {
                self.warnings.push(warning.clone());
            }
        }
        let found = &verified.verification;
        if found.n_rays() == 0 {
            let what = format!("{}: the scene casts no rays, nothing to verify", args.scene.display());
            return Err(CliError::Usage(what));
        }
        if found.misclassified.unexplained > 0 {
            let n = found.misclassified.unexplained;
            self.warnings
                .push(format!("{title}{n} rays differ between board and software for no known cause"));
        }
        if let Some(ratio) = found.t_error.max_of_bound.filter(|ratio| ratio.is_nan() || *ratio > 1.0) {
            self.warnings.push(format!("{title}an error of t is {ratio} times its derived bound"));
        }
        if let (None, Some(mismatch)) = (&self.first, &found.first_mismatch) {
            self.first = Some(First {
                vectors: vectors::of_mismatch(&verified.image, mismatch),
                mismatch: mismatch.clone(),
                title: title.to_owned(),
            });
        }
        Ok(verified)
    }

    /// Writes the first mismatch and tells it, with the command that replays it.
    fn first_mismatch(&mut self, first: First, format: Option<VectorsFormat>) -> String {
        let mut text =
            report::side_by_side::mismatch_text(&first.title, &first.vectors.formats, &first.mismatch);
        let path = self.args.mismatch.clone().unwrap_or_else(|| PathBuf::from(MISMATCH_FILE));
        let mut file = OutputFiles::new();
        file.stage(&path, first.vectors.to_bytes(format.unwrap_or(VectorsFormat::Csv)));
        // What was found is worth more than its file.
        match file.commit() {
            Ok(()) => {
                let board = match self.args.board.as_str() {
                    DEFAULT_BOARD => String::new(),
                    other => format!(" --board {other}"),
                };
                let _ = write!(
                    text,
                    "\nwritten    {0}\nreplay     radeng simulate --rays {0}{board}\n",
                    path.display()
                );
                // The file holds one explicit ray.
                let beyond = match (&first.mismatch.compared, first.mismatch.model) {
                    (Compared::BundleRay { .. }, _) => {
                        "the bundle generator, which an explicit ray does not use"
                    }
                    (_, Model::Clocked) => "the clocked board with a bundle's other rays around this one",
                    _ => return text,
                };
                let _ = writeln!(text, "           may find nothing wrong: the fault showed in {beyond}");
            }
            Err(e) => self.warnings.push(format!("the first mismatch could not be written: {e}")),
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use rtl_model::datapath::{HitWords, PatchWords, RayWords};
    use rtl_model::fixed::Formats;
    use rtl_model::memory_image::MemoryImage;

    use super::*;
    use crate::cli::{Command, CommandLine};
    use crate::raycast::Purpose;
    use crate::vectors::{Expected, Vectors};
    use crate::verify::{Compared, Model};

    fn first() -> First {
        let corners = [[-10, -10, 50], [10, -10, 50], [10, 10, 50], [-10, 10, 50]];
        let patch = PatchWords { corners, is_triangle: false, id: 0 };
        let mismatch = Mismatch {
            compared: Compared::NearestHit,
            any_hit: false,
            model: Model::Functional,
            purpose: Purpose::Primary,
            index: 5,
            ray: RayWords { origin: [0; 3], dir: [0, 0, 1 << 23], t_max: 1 << 26 },
            board: None,
            oracle: Some(HitWords { t: 100, patch: 0, facing: rtl_model::datapath::Facing::Back }),
            patches: vec![patch],
        };
        let image = MemoryImage::build(&Formats::default(), &[patch], None);
        First { vectors: vectors::of_mismatch(&image, &mismatch), mismatch, title: String::new() }
    }

    /// Tells `first`, with `--mismatch path`, on the minimal board.
    fn told(path: &Path) -> (String, Vec<String>) {
        let path = path.to_str().unwrap();
        let line = ["radeng", "verify", "s.toml", "--board", "minimal", "--mismatch", path];
        let Command::Verify(args) = CommandLine::try_parse_from(line).unwrap().command else { panic!() };
        let options = options(&args, false);
        let (warnings, timings) = (Vec::new(), Timings::default());
        let mut session = Session { args: &args, options, first: None, warnings, timings };
        let text = session.first_mismatch(first(), format_of(args.mismatch.as_deref()).unwrap());
        (text, session.warnings)
    }

    #[test]
    fn mismatch_is_written_and_told_with_the_command_that_replays_it() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["m.csv", "m.rvec"] {
            let path = dir.path().join(name);
            let (text, warnings) = told(&path);
            assert!(warnings.is_empty(), "{warnings:?}");
            let command = format!("replay     radeng simulate --rays {} --board minimal\n", path.display());
            assert!(text.ends_with(&command), "{text}");
            assert!(text.contains("first mismatch: primary ray 5, the nearest hit"), "{text}");
            let bytes = std::fs::read(&path).unwrap();
            assert_eq!(VectorsFormat::sniff(&bytes), VectorsFormat::of(&path));
            let vectors = Vectors::from_bytes(&bytes).unwrap();
            assert_eq!(vectors.rays[0].expected, Some(Expected::Nearest(first().mismatch.oracle)));
        }
    }

    #[test]
    fn mismatch_that_cannot_be_written_is_still_told() {
        let (text, warnings) = told(Path::new("/no/such/folder/m.csv"));
        assert!(text.contains("first mismatch") && !text.contains("replay"), "{text}");
        assert!(warnings[0].contains("/no/such/folder/m.csv"), "{warnings:?}");
    }

    #[test]
    fn first_test_widths_are_sorted_and_images_are_off_in_sweeps_unless_asked_for() {
        let parsed = |extra: &[&str]| {
            let line = [&["radeng", "verify", "s.toml"][..], extra].concat();
            match CommandLine::try_parse_from(line).unwrap().command {
                Command::Verify(args) => args,
                _ => panic!(),
            }
        };
        let args = parsed(&["--first-test", "10,6,10"]);
        assert_eq!(options(&args, false).first_test_bits, [6, 10]);
        assert!(options(&args, false).compare_image && !options(&args, true).compare_image);
        assert!(!options(&parsed(&["--no-image"]), false).compare_image);
        assert!(options(&parsed(&["--sweep", "t_frac_bits=8..9", "--image"]), true).compare_image);
        let defaults = options(&parsed(&[]), false);
        assert_eq!((defaults.n_rays, defaults.n_clocked), (1_000_000, 20_000));
        assert_eq!(defaults.first_test_bits, [6, 8, 10, 12, 16]);
    }
}
