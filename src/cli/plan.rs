//! The command line as meant: names resolved, values checked, output places tried, before any long work.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use rtl_model::spec::BoardSpec;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use super::args::{
    CastArgs, CasterArg, CheckpointArgs, FalseColourArg, FormFactorsArg, GradientsArg, KernelArg,
    PassOneArgs, PictureArgs, ReconstructArg, RenderArgs, SwitchArg, TwistsArg,
};
use super::error::CliError;
use crate::frame::{CasterChoice, FrameOptions, PassOne, SolvePlan};
use crate::geom::DVec3;
use crate::image::false_colour::{FalseColour, Quantity};
use crate::image::files::{check_not_inputs, check_targets};
use crate::image::{OutputError, PictureFormat};
use crate::radiosity::checkpoint::Keeper;
use crate::radiosity::{FormFactorMethod, Kernel, SolveOptions};
use crate::reconstruct::{GradientRule, Method, ReconstructOptions, TwistRule};
use crate::render::RenderOptions;
use crate::report::si::vector;

/// The board that is emulated unless another is named.
pub const DEFAULT_BOARD: &str = "delft-1992";

/// Time between two checkpoints (s).
const CHECKPOINT_SECONDS: f64 = 30.0;

/// Picture files to write, by format.
pub type Pictures = Vec<(PathBuf, PictureFormat)>;

/// False-colour pictures to write, by what they show.
pub type FalseColourPictures = Vec<(PathBuf, Quantity)>;

/// A board by preset name or file.
///
/// # Errors
/// Neither; or the file's first fault.
pub fn resolve_board(name: &str) -> Result<BoardSpec, CliError> {
    let fault = |what: String| CliError::Board { name: name.to_owned(), what };
    if BoardSpec::preset_names().contains(&name) {
        return BoardSpec::preset(name).ok_or_else(|| fault("the preset is missing".to_owned()));
    }
    let path = Path::new(name);
    if !path.exists() {
        return Err(fault(no_file_no_preset()));
    }
    let text = read_text(path, "a board file").map_err(fault)?;
    let spec = BoardSpec::from_toml(&text).map_err(|e| fault(plain_types(&e.to_string())))?;
    spec.validate().map_err(|e| fault(e.to_string()))?;
    Ok(spec)
}

/// What is wrong with a name that is neither.
pub(super) fn no_file_no_preset() -> String {
    format!("no such file, and no preset of this name (presets: {})", BoardSpec::preset_names().join(", "))
}

/// A text file; `expected` says what it should be.
///
/// # Errors
/// Why it cannot be read, in the words that scene files get.
pub fn read_text(path: &Path, expected: &str) -> Result<String, String> {
    if path.is_dir() {
        return Err(format!("is a directory, expected {expected}"));
    }
    std::fs::read_to_string(path).map_err(|e| match e.kind() {
        ErrorKind::NotFound => format!("no such file, expected {expected}"),
        ErrorKind::InvalidData => format!("not UTF-8 text, expected {expected}"),
        _ => format!("cannot be read: {e}"),
    })
}

/// A decoder's message with its type names in plain words.
fn plain_types(message: &str) -> String {
    const EXPECTED: &str = "expected ";
    let Some(at) = message.rfind(EXPECTED) else { return message.to_owned() };
    let (before, wanted) = message.split_at(at + EXPECTED.len());
    let wanted = match wanted.trim() {
        "f64" | "f32" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or more",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "bool" | "a boolean" => "true or false",
        "str" | "string" | "a string" => "text in quotes",
        other if other.starts_with("struct ") => "a table",
        other => other,
    };
    format!("{before}{wanted}")
}

/// Who answers the rays: `--board` alone means the board; with `--caster software` it is a contradiction.
///
/// # Errors
/// The contradiction; a board that cannot be.
pub fn resolve_caster(args: &CastArgs) -> Result<CasterChoice, CliError> {
    let board = |name: &str| Ok(CasterChoice::Board(Box::new(resolve_board(name)?)));
    match (args.caster, args.board.as_deref()) {
        (Some(CasterArg::Software), Some(_)) => {
            Err(CliError::Usage("--board has no use with --caster software".to_owned()))
        }
        (Some(CasterArg::Board), None) => board(DEFAULT_BOARD),
        (_, Some(name)) => board(name),
        (Some(CasterArg::Software) | None, None) => Ok(CasterChoice::Software),
    }
}

/// Options of everything that casts rays.
///
/// # Errors
/// As [`resolve_caster`]; an option of pass 1 where pass 1 does not run.
pub fn resolve_frame(args: &CastArgs, solution: Option<&Path>) -> Result<FrameOptions, CliError> {
    let caster = resolve_caster(args)?;
    let pass_1 = match solution {
        Some(_) if args.keep.checkpoint.is_some() => {
            let what = "--checkpoint has no use with --solution: there is no pass 1 to keep";
            return Err(CliError::Usage(what.to_owned()));
        }
        Some(path) => match pass_1_flag(&args.pass_1) {
            Some(flag) => {
                let what = format!("{flag} has no use with --solution: it is an option of pass 1");
                return Err(CliError::Usage(what));
            }
            None => PassOne::Load(path.to_owned()),
        },
        None => {
            let options = resolve_solve(args.seed, &args.pass_1);
            match resolve_keeper(&args.keep)? {
                None => PassOne::Solve(options),
                Some(keeper) => PassOne::Planned(Box::new(SolvePlan {
                    checkpoint: Some(keeper),
                    caster: caster.identity(),
                    ..SolvePlan::new(options)
                })),
            }
        }
    };
    if args.adaptive.is_some() && solution.is_some() {
        let what = "--adaptive has no use with --solution: its file says how the mesh is refined";
        return Err(CliError::Usage(what.to_owned()));
    }
    let adaptive = args.adaptive.map(|switch| switch == SwitchArg::On);
    Ok(FrameOptions { elements: args.elements, adaptive, caster, pass_1 })
}

/// Where the state of pass 1 is kept; Ctrl-C and SIGTERM end it after its next step, a second one at once.
///
/// # Errors
/// When signals cannot be listened to.
fn resolve_keeper(args: &CheckpointArgs) -> Result<Option<Keeper>, CliError> {
    let Some(folder) = &args.checkpoint else { return Ok(None) };
    let every = Duration::from_secs_f64(args.checkpoint_every.unwrap_or(CHECKPOINT_SECONDS));
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(signal, 128 + signal, stop.clone())
            .and_then(|_| flag::register(signal, stop.clone()))
            .map_err(|e| CliError::Usage(format!("--checkpoint: Ctrl-C cannot be listened to: {e}")))?;
    }
    Ok(Some(Keeper::new(folder, every, stop)))
}

/// After all output is written: removes the checkpoint; what the user should know of it.
pub(super) fn finish_pass_1(options: &FrameOptions) -> Vec<String> {
    match &options.pass_1 {
        PassOne::Planned(plan) => plan.checkpoint.as_ref().map(Keeper::finish).unwrap_or_default(),
        PassOne::Solve(_) | PassOne::Load(_) => Vec::new(),
    }
}

/// Options of pass 1.
pub fn resolve_solve(seed: u64, args: &PassOneArgs) -> SolveOptions {
    let default = SolveOptions::default();
    SolveOptions {
        seed,
        dense_visibility: args.dense_visibility,
        kernel: match args.kernel {
            Some(KernelArg::Polygon) | None => Kernel::Polygon,
            Some(KernelArg::Disc) => Kernel::Disc,
        },
        form_factors: match args.form_factors {
            Some(FormFactorsArg::Vertex) | None => FormFactorMethod::Vertex,
            Some(FormFactorsArg::Hemisphere) => FormFactorMethod::Hemisphere,
        },
        max_shooters: args.max_shooters.map_or(default.max_shooters, |n| n as usize),
        wanted_error: args.wanted_error.unwrap_or(default.wanted_error),
        ..default
    }
}

/// An option of pass 1 that was given, but the seed, which pass 2 uses too.
fn pass_1_flag(args: &PassOneArgs) -> Option<&'static str> {
    let given = [
        (args.dense_visibility, "--dense-visibility"),
        (args.kernel.is_some(), "--kernel"),
        (args.form_factors.is_some(), "--form-factors"),
        (args.max_shooters.is_some(), "--max-shooters"),
        (args.wanted_error.is_some(), "--wanted-error"),
    ];
    given.into_iter().find(|(given, _)| *given).map(|(_, flag)| flag)
}

/// Options of pass 2.
pub fn resolve_picture(args: &PictureArgs, reconstruct: ReconstructOptions, seed: u64) -> RenderOptions {
    RenderOptions {
        width: args.width,
        height: args.height,
        samples: args.samples.min,
        direct: args.direct.resolve(),
        reconstruct: reconstruct.method,
        gradients: reconstruct.gradients,
        twists: reconstruct.twists,
        seed,
        ..RenderOptions::default()
    }
}

/// How `render` fills in between the vertices.
///
/// # Errors
/// Rules that the method has no use for.
pub fn resolve_reconstruction(args: &RenderArgs) -> Result<ReconstructOptions, CliError> {
    let method = match args.reconstruct {
        ReconstructArg::Constant => Method::Constant,
        ReconstructArg::Bilinear => Method::Bilinear,
        ReconstructArg::Quadratic => Method::Quadratic,
        ReconstructArg::CubicTriangle => Method::CubicTriangle,
        ReconstructArg::Hermite => Method::Hermite,
        ReconstructArg::HermiteLimited => Method::HermiteLimited,
    };
    let no_use = |flag: &str, why: &str| {
        CliError::Usage(format!("{flag} has no use with --reconstruct {}: {why}", method.name()))
    };
    let bicubic = matches!(method, Method::Hermite | Method::HermiteLimited);
    if args.gradients.is_some() && matches!(method, Method::Constant | Method::Bilinear) {
        return Err(no_use("--gradients", "it takes values only"));
    }
    if args.twists.is_some() && !bicubic {
        return Err(no_use("--twists", "only bicubic patches have twists"));
    }
    let gradients = args.gradients.map(|rule| match rule {
        GradientsArg::SeedEdgeNormals => GradientRule::SeedEdgeNormals,
        GradientsArg::FacetNormals => GradientRule::FacetNormals,
        GradientsArg::LeastSquares => GradientRule::LeastSquares,
        GradientsArg::Zero => GradientRule::Zero,
    });
    let twists = args.twists.map(|rule| match rule {
        TwistsArg::Zero => TwistRule::Zero,
        TwistsArg::Adini => TwistRule::Adini,
        TwistsArg::Fit => TwistRule::Fit,
    });
    Ok(ReconstructOptions {
        method,
        gradients: gradients.unwrap_or_default(),
        twists: twists.unwrap_or_default(),
    })
}

/// The pictures that `render` writes.
///
/// # Errors
/// An extension that names no picture format.
pub fn resolve_pictures(args: &RenderArgs) -> Result<Pictures, CliError> {
    let outputs = if args.output.is_empty() && !args.false_colour.is_empty() {
        Vec::new()
    } else if args.output.is_empty() {
        let name = scene_name(&args.scene);
        vec![PathBuf::from(format!("{name}.png")), PathBuf::from(format!("{name}.exr"))]
    } else {
        args.output.clone()
    };
    outputs.into_iter().map(|path| Ok((path.clone(), PictureFormat::of(&path)?))).collect()
}

/// The false-colour pictures that `render` writes.
///
/// # Errors
/// Ends that make no scale, or would have two units.
pub fn resolve_false_colour(args: &RenderArgs) -> Result<(FalseColour, FalseColourPictures), CliError> {
    let look = args.scale.resolve().map_err(CliError::Usage)?;
    let path = |arg: &FalseColourArg| match &arg.path {
        Some(path) => path.clone(),
        None => PathBuf::from(format!("{}-{}.png", scene_name(&args.scene), arg.quantity.name())),
    };
    let pictures: FalseColourPictures =
        args.false_colour.iter().map(|arg| (path(arg), arg.quantity)).collect();
    if look.scale.range.is_some() && pictures.iter().any(|(_, quantity)| *quantity != pictures[0].1) {
        let what =
            "--scale LO,HI with luminance (cd/m^2) and illuminance (lx): the ends can have one unit only";
        return Err(CliError::Usage(what.to_owned()));
    }
    if look != FalseColour::default() && pictures.is_empty() {
        let what = "--scale, --scale-kind and --colour-map have no use without --false-colour";
        return Err(CliError::Usage(what.to_owned()));
    }
    Ok((look, pictures))
}

/// What a scene is called: its file's stem, or its folder's name when the file is `scene.toml`.
pub fn scene_name(scene: &Path) -> String {
    let stem = scene.file_stem().map(|s| s.to_string_lossy().into_owned());
    let folder = || {
        let parent = scene.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let parent = parent.canonicalize().ok()?;
        parent.file_name().map(|s| s.to_string_lossy().into_owned())
    };
    match stem {
        Some(stem) if stem != "scene" => stem,
        _ => folder().unwrap_or_else(|| "scene".to_owned()),
    }
}

/// Checks extension and place of all outputs that are no pictures, the places of all, and that none is an input.
///
/// # Errors
/// The first output that cannot be.
pub fn check_outputs<'a>(
    pictures: impl IntoIterator<Item = &'a Path>,
    others: &[(Option<&'a Path>, &'static str)],
    inputs: &[Option<&Path>],
) -> Result<(), CliError> {
    let mut all: Vec<&Path> = pictures.into_iter().collect();
    for (path, extension) in others {
        let Some(path) = path else { continue };
        if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case(extension)) {
            let what = format!("expected a name that ends in .{extension}");
            return Err(OutputError::Target { path: path.to_path_buf(), what }.into());
        }
        all.push(path);
    }
    check_targets(all.iter().copied())?;
    let inputs: Vec<&Path> = inputs.iter().copied().flatten().collect();
    Ok(check_not_inputs(&all, &inputs)?)
}

/// Farthest coordinate of a point (m), as in scene files.
pub const MAX_COORDINATE_M: f64 = 1e6;

/// A point (m), `x,y,z`.
///
/// # Errors
/// As [`parse_vector`]; a coordinate beyond [`MAX_COORDINATE_M`].
pub fn parse_point(flag: &str, text: &str) -> Result<DVec3, CliError> {
    let point = parse_vector(flag, text)?;
    if point.abs().max_element() > MAX_COORDINATE_M {
        return Err(CliError::Usage(format!(
            "{flag} {}: expected coordinates within -1e6 to 1e6 m",
            vector(point)
        )));
    }
    Ok(point)
}

/// Three numbers, `x,y,z`.
///
/// # Errors
/// Anything else, with the flag's name.
pub fn parse_vector(flag: &str, text: &str) -> Result<DVec3, CliError> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    match numbers.as_deref() {
        Some([x, y, z]) => Ok(DVec3::new(*x, *y, *z)),
        _ => Err(CliError::Usage(format!("{flag} '{text}': expected three finite numbers x,y,z"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cast(caster: Option<CasterArg>, board: Option<&str>) -> CastArgs {
        CastArgs {
            caster,
            board: board.map(str::to_owned),
            elements: None,
            adaptive: None,
            seed: 1,
            pass_1: PassOneArgs::default(),
            keep: CheckpointArgs::default(),
        }
    }

    #[test]
    fn caster_without_flags_is_software_and_a_contradiction_is_refused() {
        assert_eq!(resolve_caster(&cast(None, None)).unwrap(), CasterChoice::Software);
        let e = resolve_caster(&cast(Some(CasterArg::Software), Some("minimal"))).unwrap_err();
        assert!(e.to_string().contains("--caster software"), "{e}");
    }

    #[test]
    fn board_preset_alone_means_the_board_is_the_caster() {
        for name in BoardSpec::preset_names() {
            let choice = resolve_caster(&cast(None, Some(name))).unwrap();
            assert!(matches!(choice, CasterChoice::Board(spec) if spec.name == *name), "{name}");
        }
    }

    #[test]
    fn board_of_no_preset_and_no_file_lists_the_presets() {
        let e = resolve_board("delft-1991").unwrap_err().to_string();
        assert!(e.contains("delft-1991") && e.contains("delft-1992") && e.contains("minimal"), "{e}");
    }

    #[test]
    fn board_file_with_a_wrong_type_is_refused_in_plain_words() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("board.toml");
        let fault = |text: &str| {
            std::fs::write(&path, text).unwrap();
            resolve_board(path.to_str().unwrap()).unwrap_err().to_string()
        };
        let e = fault("clock_mhz = \"fast\"\n");
        assert!(e.contains("line 1, column 13") && e.ends_with("expected a number"), "{e}");
        let e = fault("formats = 3\n");
        assert!(e.ends_with("expected a table"), "{e}");
        let e = fault("grid_log2 = 1.5\n");
        assert!(e.ends_with("expected a whole number, 0 or more"), "{e}");
        let e = resolve_board(dir.path().to_str().unwrap()).unwrap_err().to_string();
        assert!(e.ends_with("is a directory, expected a board file"), "{e}");
    }

    #[test]
    fn dense_visibility_reaches_pass_1_and_is_refused_where_none_runs() {
        let pass_1 = PassOneArgs { dense_visibility: true, ..PassOneArgs::default() };
        let args = CastArgs { pass_1, ..cast(None, None) };
        let options = resolve_frame(&args, None).unwrap();
        assert!(matches!(options.pass_1, PassOne::Solve(SolveOptions { dense_visibility: true, .. })));
        let e = resolve_frame(&args, Some(Path::new("a.radsol"))).unwrap_err().to_string();
        assert!(e.contains("--dense-visibility"), "{e}");
    }

    #[test]
    fn scene_name_is_the_stem_or_for_scene_toml_the_folder() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("lit-room");
        std::fs::create_dir(&folder).unwrap();
        assert_eq!(scene_name(&folder.join("scene.toml")), "lit-room");
        assert_eq!(scene_name(&folder.join("night.toml")), "night");
    }

    #[test]
    fn vector_of_three_numbers_parses_and_others_name_the_flag() {
        assert_eq!(parse_vector("--at", "1, -2,3e-1").unwrap(), DVec3::new(1.0, -2.0, 0.3));
        for bad in ["1,2", "1,2,3,4", "a,b,c", "1,2,nan", ""] {
            assert!(parse_vector("--at", bad).unwrap_err().to_string().contains("--at"), "{bad}");
        }
        assert_eq!(parse_point("--at", "-1e6,0,1e6").unwrap(), DVec3::new(-1e6, 0.0, 1e6));
        let far = parse_point("--at", "0,1e300,0").unwrap_err().to_string();
        assert!(far.starts_with("--at 0, 1e300, 0: expected"), "{far}");
    }

    #[test]
    fn outputs_with_a_wrong_extension_or_named_twice_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let (json, png) = (dir.path().join("r.json"), dir.path().join("p.png"));
        check_outputs([png.as_path()], &[(Some(&json), "json"), (None, "radsol")], &[None]).unwrap();
        assert!(check_outputs([], &[(Some(&png), "json")], &[]).is_err());
        assert!(check_outputs([png.as_path(), png.as_path()], &[], &[]).is_err());
        let input = dir.path().join("./r.json");
        let e = check_outputs([], &[(Some(&json), "json")], &[None, Some(&input)]).unwrap_err();
        assert!(e.to_string().contains("input"), "{e}");
    }
}
