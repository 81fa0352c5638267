//! Malformed scene files: each is refused with one line that names the place and the fault; nothing panics.

use std::path::Path;

use proptest::prelude::*;
use radiosity_engine::scene::Scene;

#[path = "common/malformed.rs"]
mod malformed;

#[path = "common/damage.rs"]
mod damage;

use damage::{apply, damage};
use malformed::{VALID, cases};

#[test]
fn load_of_each_malformed_scene_names_place_value_and_expectation() {
    let cases = cases();
    assert!(cases.len() >= 40, "{} cases", cases.len());
    let mut wrong = Vec::new();
    for case in &cases {
        let folder = tempfile::tempdir().unwrap();
        let path = case.write(folder.path());
        let error = match Scene::load(&path) {
            Ok(_) => {
                wrong.push(format!("{}: accepted", case.name));
                continue;
            }
            Err(error) => error,
        };
        let shown = error.to_string();
        let start = match case.place {
            Some((line, column)) => format!("{}:{line}:{column}: ", path.display()),
            None => format!("{}: ", path.display()),
        };
        let lacks = case.words.iter().find(|w| !shown.contains(*w));
        if !shown.starts_with(&start) || lacks.is_some() || shown.contains('\n') {
            wrong.push(format!("{}: expected {start}... with {:?}, is {shown}", case.name, case.words));
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

#[test]
fn names_of_malformed_scenes_are_unique_and_their_base_is_valid() {
    let mut names: Vec<_> = cases().iter().map(|c| c.name).collect();
    let n = names.len();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), n);
    let scene = Scene::parse(VALID, Path::new("scene.toml")).unwrap();
    assert!(scene.warnings.is_empty());
}

#[cfg(unix)]
#[test]
fn load_of_a_mesh_behind_a_link_out_of_the_folder_is_refused_as_outside() {
    let outside = tempfile::tempdir().unwrap();
    std::fs::write(outside.path().join("table.obj"), "v 0 0 0\n").unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink(outside.path(), folder.path().join("link")).unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, format!("{VALID}\n[[mesh]]\nfile = \"link/table.obj\"\n")).unwrap();
    let shown = Scene::load(&path).unwrap_err().to_string();
    assert!(shown.contains("outside the scene's folder"), "{shown}");
}

#[test]
fn load_of_a_folder_that_holds_a_scene_suggests_it() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), VALID).unwrap();
    let shown = Scene::load(folder.path()).unwrap_err().to_string();
    assert!(shown.contains("did you mean") && shown.contains("scene.toml"), "{shown}");
}

/// The texts of all shipped scenes.
fn shipped() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files: Vec<_> = std::fs::read_dir(root)
        .unwrap()
        .map(|entry| entry.unwrap().path().join("scene.toml"))
        .filter(|path| path.is_file())
        .collect();
    files.sort();
    assert!(files.len() >= 8);
    files.iter().map(|path| std::fs::read_to_string(path).unwrap()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn load_of_damaged_shipped_scenes_never_panics_and_faults_are_one_line_with_a_place(
        which in any::<prop::sample::Index>(),
        damages in prop::collection::vec(damage(), 1..5),
    ) {
        thread_local! {
            static TEXTS: Vec<String> = shipped();
            static FOLDER: tempfile::TempDir = tempfile::tempdir().unwrap();
        }
        let mut bytes = TEXTS.with(|texts| which.get(texts).clone().into_bytes());
        for damage in &damages {
            apply(&mut bytes, damage);
        }
        let path = FOLDER.with(|folder| folder.path().join("scene.toml"));
        std::fs::write(&path, &bytes).unwrap();
        if let Err(error) = Scene::load(&path) {
            let shown = error.to_string();
            prop_assert!(!shown.contains('\n') && !shown.contains('\0'), "{shown}");
            let place = error.place.expect("a damaged file still has text to point into");
            let n_lines = bytes.split(|b| *b == b'\n').count();
            prop_assert!((1..=n_lines).contains(&place.line), "{shown}");
            prop_assert!(place.text.get(place.span.clone()).is_some(), "{shown}");
        }
    }
}

#[test]
fn scene_error_as_a_diagnostic_shows_the_line_and_points_at_the_value() {
    let text = VALID.replace("reflectance = 0.5", "reflectance = 1.2");
    let error = Scene::parse(&text, Path::new("scene.toml")).unwrap_err();
    let mut shown = String::new();
    let handler = miette::NarratableReportHandler::new();
    handler.render_report(&mut shown, &error).unwrap();
    assert!(shown.contains("scene.toml:10:15"), "{shown}");
    assert!(shown.contains("snippet line 10: reflectance = 1.2"), "{shown}");
    assert!(shown.contains("label at line 10, columns 15 to 17"), "{shown}");
}
