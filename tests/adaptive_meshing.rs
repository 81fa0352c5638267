//! Adaptive meshing from outside: solved, kept in a file, drawn again from it.

#[path = "common/place.rs"]
mod place;

use place::{Place, scene};

#[test]
fn refined_solution_is_drawn_from_its_file_as_in_one_run() {
    let place = Place::new();
    let scene = scene("point-room");
    let mesh = ["--elements", "150", "--adaptive", "on"];
    let solve =
        place.exits(0, &[&["solve", &scene, "-o", "s.radsol", "--report", "s.json"], &mesh[..]].concat());
    assert!(solve.stdout.contains("refined:"), "{}", solve.stdout);
    let report = place.json("s.json");
    let number = |key: &str| report["refinement"][key].as_u64().unwrap();
    assert_eq!(report["scene"]["n_elements"].as_u64(), Some(number("n_elements")));
    assert!(number("n_elements") <= number("n_limit") && number("n_rays") > 0);
    assert_eq!(report["refinement"]["lines"]["skipped"].as_bool(), Some(false), "nothing was too large");

    let picture = ["--width", "24", "--height", "24", "--shadow-strata", "1"];
    let whole = [&["render", &scene, "-o", "whole.exr"], &mesh[..], &picture].concat();
    place.exits(0, &whole);
    let loaded = ["render", &scene, "-o", "loaded.exr", "--elements", "150", "--solution", "s.radsol"];
    place.exits(0, &[&loaded[..], &picture].concat());
    assert_eq!(
        std::fs::read(place.path("whole.exr")).unwrap(),
        std::fs::read(place.path("loaded.exr")).unwrap()
    );
    let other = ["render", &scene, "-o", "no.exr", "--elements", "900", "--solution", "s.radsol"];
    place.refused(&other, "made for another geometry");
    let both = [&loaded[..4], &["--solution", "s.radsol", "--adaptive", "off"]].concat();
    place.refused(&both, "--adaptive has no use with --solution");
}

/// The point room with a plate in it that throws a shadow on the floor.
fn shadow_scene(place: &Place, intensity: &str) -> String {
    let room = std::fs::read_to_string(scene("point-room")).unwrap();
    let (head, light) = room.split_once("intensity = ").expect("a light");
    let rest = light.split_once('\n').map_or("", |(_, rest)| rest);
    let plate = "[[surface]]\nname = \"plate\"\nmaterial = \"wall\"\ntwo_sided = true\n\
                 quad = [[0.7, 0.7, 0.5], [1.3, 0.7, 0.5], [1.3, 1.3, 0.5], [0.7, 1.3, 0.5]]\n";
    let name = format!("shadow-{intensity}.toml");
    std::fs::write(place.path(&name), format!("{head}intensity = {intensity}\n{rest}\n{plate}")).unwrap();
    name
}

#[test]
fn refined_solution_with_shadow_lines_is_drawn_from_its_file_and_goes_on_in_another_light() {
    let place = Place::new();
    let scene = shadow_scene(&place, "10.0");
    let mesh = ["--elements", "200", "--adaptive", "on"];
    let solve =
        place.exits(0, &[&["solve", &scene, "-o", "s.radsol", "--report", "s.json"], &mesh[..]].concat());
    assert!(solve.stdout.contains("stand for them (C-1)"), "{}", solve.stdout);
    let report = place.json("s.json");
    let flagged = report["refinement"]["lines"]["n_flagged_edges"].as_u64().unwrap();
    assert!(flagged > 10, "{flagged}");
    let picture = ["--width", "24", "--height", "24", "--shadow-strata", "1"];
    place.exits(0, &[&["render", &scene, "-o", "whole.exr"], &mesh[..], &picture].concat());
    let loaded = ["render", &scene, "--elements", "200", "--solution", "s.radsol"];
    place.exits(0, &[&loaded[..], &["-o", "loaded.exr"], &picture].concat());
    assert_eq!(
        std::fs::read(place.path("whole.exr")).unwrap(),
        std::fs::read(place.path("loaded.exr")).unwrap()
    );
    // Another light: the mesh with its lines stays.
    let brighter = shadow_scene(&place, "20.0");
    let on = ["solve", &brighter, "-o", "t.radsol", "--elements", "200", "--continue-from", "s.radsol"];
    place.exits(0, &on);
}

#[test]
fn refined_solve_has_the_same_file_for_any_number_of_threads() {
    let place = Place::new();
    let scene = scene("point-room");
    for threads in ["1", "3"] {
        let out = format!("{threads}.radsol");
        place.exits(
            0,
            &["solve", &scene, "-o", &out, "--elements", "100", "--adaptive", "on", "--threads", threads],
        );
    }
    assert_eq!(
        std::fs::read(place.path("1.radsol")).unwrap(),
        std::fs::read(place.path("3.radsol")).unwrap()
    );
}
