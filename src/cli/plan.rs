//! The command line as meant: names resolved, values checked, output places tried, before any long work.

use std::path::{Path, PathBuf};

use rtl_model::spec::BoardSpec;

use super::args::{CastArgs, CasterArg, PictureArgs, ReconstructArg, RenderArgs};
use super::error::CliError;
use crate::frame::{CasterChoice, FrameOptions, PassOne};
use crate::geom::DVec3;
use crate::image::files::check_targets;
use crate::image::{OutputError, PictureFormat};
use crate::radiosity::SolveOptions;
use crate::reconstruct::Method;
use crate::render::RenderOptions;

/// The board that is emulated unless another is named.
pub const DEFAULT_BOARD: &str = "delft-1992";

/// Picture files to write, by format.
pub type Pictures = Vec<(PathBuf, PictureFormat)>;

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
        let presets = BoardSpec::preset_names().join(", ");
        return Err(fault(format!("no such file, and no preset of this name (presets: {presets})")));
    }
    let text = std::fs::read_to_string(path).map_err(|e| fault(e.to_string()))?;
    let spec = BoardSpec::from_toml(&text).map_err(|e| fault(e.to_string()))?;
    spec.validate().map_err(|e| fault(e.to_string()))?;
    Ok(spec)
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
/// As [`resolve_caster`].
pub fn resolve_frame(args: &CastArgs, solution: Option<&Path>) -> Result<FrameOptions, CliError> {
    let pass_1 = match solution {
        Some(path) => PassOne::Load(path.to_owned()),
        None => PassOne::Solve(SolveOptions { seed: args.seed, ..SolveOptions::default() }),
    };
    Ok(FrameOptions { elements: args.elements, caster: resolve_caster(args)?, pass_1 })
}

/// Options of pass 2.
pub fn resolve_picture(args: &PictureArgs, reconstruct: ReconstructArg, seed: u64) -> RenderOptions {
    RenderOptions {
        width: args.width,
        height: args.height,
        samples: args.samples,
        shadow_strata: args.shadow_strata,
        reconstruct: match reconstruct {
            ReconstructArg::Constant => Method::Constant,
            ReconstructArg::Bilinear => Method::Bilinear,
            ReconstructArg::Hermite => Method::Hermite,
        },
        seed,
        ..RenderOptions::default()
    }
}

/// The pictures that `render` writes.
///
/// # Errors
/// An extension that names no picture format.
pub fn resolve_pictures(args: &RenderArgs) -> Result<Pictures, CliError> {
    let outputs = if args.output.is_empty() {
        let name = scene_name(&args.scene);
        vec![PathBuf::from(format!("{name}.png")), PathBuf::from(format!("{name}.exr"))]
    } else {
        args.output.clone()
    };
    outputs.into_iter().map(|path| Ok((path.clone(), PictureFormat::of(&path)?))).collect()
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

/// Checks extension and place of all outputs that are no pictures, and the places of all.
///
/// # Errors
/// The first output that cannot be.
pub fn check_outputs<'a>(
    pictures: impl IntoIterator<Item = &'a Path>,
    others: &[(Option<&'a Path>, &'static str)],
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
    Ok(check_targets(all)?)
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
        CastArgs { caster, board: board.map(str::to_owned), elements: None, seed: 1 }
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
    }

    #[test]
    fn outputs_with_a_wrong_extension_or_named_twice_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let (json, png) = (dir.path().join("r.json"), dir.path().join("p.png"));
        check_outputs([png.as_path()], &[(Some(&json), "json"), (None, "radsol")]).unwrap();
        assert!(check_outputs([], &[(Some(&png), "json")]).is_err());
        assert!(check_outputs([png.as_path(), png.as_path()], &[]).is_err());
    }
}
