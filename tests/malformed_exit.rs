//! Every malformed scene file ends the binary with exit status 2, one message that names place and fault, and no file.

use assert_cmd::cargo::cargo_bin_cmd;

#[path = "common/malformed.rs"]
mod malformed;

#[test]
fn malformed_scene_ends_with_status_2_a_message_with_its_place_and_no_output() {
    let cases = malformed::cases();
    assert!(cases.len() >= 30, "{} cases", cases.len());
    for case in cases {
        let folder = tempfile::tempdir().unwrap();
        let scenes = folder.path().join("in");
        let outputs = folder.path().join("out");
        std::fs::create_dir(&scenes).unwrap();
        std::fs::create_dir(&outputs).unwrap();
        let scene = case.write(&scenes);
        let picture = outputs.join("picture.png");
        let run = cargo_bin_cmd!("radeng")
            .current_dir(&outputs)
            .env("NO_COLOR", "1")
            .args(["render", scene.to_str().unwrap(), "-o", picture.to_str().unwrap()])
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&run.stderr);
        let name = case.name;
        assert_eq!(run.status.code(), Some(2), "{name}:\n{stderr}");
        assert!(!stderr.contains("panicked") && stderr.trim().lines().count() < 30, "{name}:\n{stderr}");
        // The report wraps lines; the place stands on one.
        if let Some((line, column)) = case.place {
            assert!(stderr.contains(&format!("{line}:{column}")), "{name}: no {line}:{column} in\n{stderr}");
        }
        assert!(run.stdout.is_empty(), "{name} printed to stdout");
        assert_eq!(std::fs::read_dir(&outputs).unwrap().count(), 0, "{name} left a file");
    }
}
