//! The command line from outside: help, exit statuses, no file left after a failure, reports that parse.

use radiosity_engine::image::Film;
use radiosity_engine::image::exr::encode_exr;
use radiosity_engine::units::Rgb;
use serde_json::Value;

#[path = "common/place.rs"]
mod place;

use place::{Place, scene};

const SUBCOMMANDS: [&str; 10] =
    ["render", "solve", "probe", "simulate", "trace", "verify", "compare", "info", "generate", "experiment"];

fn write_exr(place: &Place, name: &str, pixels: Vec<Rgb>) {
    let film = Film::from_pixels(pixels.len(), 1, pixels);
    std::fs::write(place.path(name), encode_exr(&film).unwrap()).unwrap();
}

const SMALL: [&str; 6] = ["--elements", "96", "--width", "16", "--height", "12"];

#[test]
fn help_of_every_subcommand_says_what_it_does_and_gives_examples() {
    let place = Place::new();
    let top = place.exits(0, &["--help"]).stdout;
    for name in SUBCOMMANDS {
        assert!(top.contains(name), "{name} is missing in\n{top}");
        let help = place.exits(0, &[name, "--help"]).stdout;
        assert!(help.contains("Examples:") && help.contains("Usage: radeng"), "{name}\n{help}");
    }
}

#[test]
fn bad_flags_exit_with_2_and_name_the_flag() {
    let place = Place::new();
    let furnace = scene("furnace");
    place.refused(&["render", &furnace, "--no-such-flag"], "--no-such-flag");
    place.refused(&["render", &furnace, "--samples", "17"], "17");
    place.refused(&["render", &furnace, "--exposure", "bright"], "bright");
    place.refused(&["render", &furnace, "--elements", "1000000000"], "1000000000");
    place.refused(&["render", &furnace, "--caster", "software", "--board", "minimal"], "--caster software");
    place.refused(&["render", &furnace, "--board", "delft-1991"], "delft-1991");
    place.refused(&["solve", &furnace, "-o", "s.radsol", "--unshot", "0"], "--unshot");
    place.refused(&["probe", &furnace, "--at", "0,0,0", "--at", "1,0,0", "--normal", "0,0,1"], "--normal");
    place.refused(&["probe", &furnace, "--at", "0,0", "--normal", "0,0,1"], "--at '0,0'");
    place.refused(&["probe", &furnace, "--at", "0,0,0", "--normal", "0,0,0"], "not zero");
    place.refused(&["simulate", &furnace, "--workload", "primary", "--rays", "r.csv"], "--rays");
    place.refused(&["render", &furnace, "--seed", "-1"], "0..=18446744073709551615");
    place.refused(&["render", &furnace, "--threads", "0"], "0 is not in 1..=1024");
    place.refused(
        &["probe", &furnace, "--at", "0,2e6,0", "--normal", "0,0,1"],
        "--at 0, 2000000, 0: expected",
    );
    let far = ["probe", &furnace, "--at", "0,0,1e300", "--normal", "0,0,1"];
    place.refused(&far, "--at 0, 0, 1e300: expected coordinates within -1e6 to 1e6 m");
    place.refused(
        &["render", &furnace, "--solution", "f.radsol", "--dense-visibility"],
        "--dense-visibility has no use with --solution",
    );
    place.refused(&["frobnicate"], "frobnicate");
}

#[test]
fn one_render_writes_every_format_that_its_outputs_name() {
    let place = Place::new();
    let outputs = ["-o", "a.hdr", "-o", "a.exr", "-o", "a.PNG"];
    place.exits(0, &[&["render", &scene("furnace")], &outputs[..], &SMALL].concat());
    for (name, magic) in [("a.hdr", &b"#?RADIANCE\n"[..]), ("a.exr", b"v/1\x01"), ("a.PNG", b"\x89PNG")] {
        assert!(std::fs::read(place.path(name)).unwrap().starts_with(magic), "{name}");
    }
}

#[test]
fn outputs_that_cannot_be_are_refused_before_anything_runs() {
    let place = Place::new();
    let furnace = scene("furnace");
    place.refused(&["render", &furnace, "-o", "a.jpg"], ".exr or .hdr (linear) or .png (sRGB)");
    place.refused(&["render", &furnace, "-o", "none/a.png"], "does not exist");
    place.refused(&["render", &furnace, "-o", "a.png", "-o", "a.png"], "named twice");
    place.refused(&["render", &furnace, "-o", "a.png", "-o", "./a.png"], "named twice");
    place.refused(&["render", &furnace, "-o", "a.png/"], "a folder");
    place.refused(&["render", &furnace, "-o", "a.png", "--report", "r.txt"], ".json");
    place.refused(&["solve", &furnace, "-o", "a.png"], ".radsol");
    std::fs::create_dir(place.path("folder.png")).unwrap();
    place.refused(&["render", &furnace, "-o", "folder.png"], "is a folder");
}

#[test]
fn scenes_that_cannot_be_read_exit_with_2_and_leave_no_file() {
    let place = Place::new();
    std::fs::write(place.path("bad.toml"), "version = 1\n[materials.a]\nreflectance = 1.2\n").unwrap();
    std::fs::write(place.path("empty.toml"), "").unwrap();
    std::fs::write(place.path("noise.toml"), [0u8, 159, 146, 150]).unwrap();
    for command in [["render", "-o", "a.png"], ["solve", "-o", "a.radsol"]] {
        let run = |file: &str, expected: &str| {
            place.refused(&[command[0], file, command[1], command[2], "--report", "r.json"], expected);
        };
        run("missing.toml", "missing.toml");
        run("bad.toml", "1.2");
        run("empty.toml", "empty.toml:1:1: the file is empty, expected a scene");
        run("noise.toml", "byte 0x9f at offset 1, expected UTF-8 text");
        run(".", "is a directory, expected a scene file");
    }
    place.refused(&["info", "bad.toml"], "1.2");
    let neither = "no such file, and no preset of this name (presets: delft-1992, minimal)";
    for name in ["missing.toml", "delft-1991"] {
        place.refused(&["info", name], &format!("{name}: {neither}"));
    }
}

#[test]
fn scene_without_a_camera_is_refused_by_render_and_named() {
    let place = Place::new();
    let text = "version = 1\n[materials.a]\nreflectance = 0.5\nemission = 1.0\n[[surface]]\nname = \"s\"\n\
                material = \"a\"\nquad = [[0,0,0],[1,0,0],[1,1,0],[0,1,0]]\n";
    std::fs::write(place.path("blind.toml"), text).unwrap();
    place.refused(&["render", "blind.toml", "-o", "a.png"], "[camera]");
}

#[test]
fn compare_of_pictures_exits_by_its_threshold() {
    let place = Place::new();
    write_exr(&place, "a.exr", vec![Rgb::WHITE; 4]);
    write_exr(&place, "b.exr", vec![Rgb::WHITE, Rgb::WHITE, Rgb::WHITE, Rgb::splat(1.125)]);
    write_exr(&place, "c.exr", vec![Rgb::WHITE; 3]);
    let text = place.exits(0, &["compare", "a.exr", "b.exr"]).stdout;
    assert!(text.contains("1 of 4 pixels"), "{text}");
    place.exits(0, &["compare", "a.exr", "a.exr", "--threshold", "0"]);
    place.exits(0, &["compare", "a.exr", "b.exr", "--threshold", "0.2"]);
    let over = place.run(&["compare", "a.exr", "b.exr", "--threshold", "0.1", "--report", "d.json"]);
    assert_eq!(over.status, 1, "{}{}", over.stdout, over.stderr);
    let report = place.json("d.json");
    assert_eq!(report["schema"], "radeng/compare/1");
    assert_eq!((&report["n_differing"], &report["passed"]), (&Value::from(1), &Value::from(false)));
    assert!((report["max_relative"].as_f64().unwrap() - 0.125).abs() < 1e-6);
}

#[test]
fn compare_of_what_is_no_picture_exits_with_2() {
    let place = Place::new();
    write_exr(&place, "a.exr", vec![Rgb::WHITE; 4]);
    write_exr(&place, "small.exr", vec![Rgb::WHITE; 3]);
    std::fs::write(place.path("noise.exr"), "not a picture").unwrap();
    std::fs::write(place.path("a.png"), "").unwrap();
    place.refused(&["compare", "a.exr", "small.exr"], "4 x 1 and 3 x 1");
    place.refused(&["compare", "a.exr", "noise.exr"], "noise.exr");
    place.refused(&["compare", "a.exr", "none.exr"], "none.exr: no such file, expected an EXR picture");
    std::fs::create_dir(place.path("folder.exr")).unwrap();
    place.refused(&["compare", "folder.exr", "a.exr"], "folder.exr: is a directory, expected an EXR picture");
    place.refused(&["compare", "a.exr", "a.png"], "only .exr");
    place.refused(&["compare", "a.exr", "a.exr", "--threshold", "-1"], "--threshold");
    place.refused(
        &["compare", "a.exr", "a.exr", "--bands", "map.exr"],
        "map.exr: expected a name that ends in .png",
    );
    place.refused(&["compare", "a.exr", "a.exr", "--bands", "m.png", "--band-scale", "0"], "--band-scale 0");
    place.refused(&["compare", "a.exr", "a.exr", "--band-scale", "1"], "--bands");
    place.refused(&["compare", "a.json", "a.json", "--bands", "m.png"], "only pictures have Mach bands");
    assert!(!place.path("m.png").exists());
}

#[test]
fn compare_of_pictures_measures_the_mach_bands_that_the_second_adds_and_draws_them() {
    let place = Place::new();
    let picture = |crease: f64| -> Vec<u8> {
        let value = |k: usize| 1.0 + crease * ((k % 16) as f64 - 8.0).max(0.0);
        let film = Film::from_pixels(16, 9, (0..16 * 9).map(|k| Rgb::splat(value(k))).collect());
        encode_exr(&film).unwrap()
    };
    std::fs::write(place.path("flat.exr"), picture(0.0)).unwrap();
    std::fs::write(place.path("crease.exr"), picture(0.125)).unwrap();
    let args = ["compare", "flat.exr", "crease.exr", "--bands", "map.png", "--report", "d.json"];
    let text = place.exits(0, &args).stdout;
    assert!(text.contains("new bands") && text.contains("most at column 8"), "{text}");
    let bands = &place.json("d.json")["mach_bands"];
    assert_eq!((&bands["n_pixels"], &bands["rms_a"]), (&Value::from(14 * 7), &Value::from(0.0)));
    // One of 14 columns.
    let rms = bands["rms_added"].as_f64().unwrap();
    assert!((rms - 0.125 / 14.0_f64.sqrt()).abs() < 1e-6, "{bands}");
    let png = std::fs::read(place.path("map.png")).unwrap();
    let info = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap().info().size();
    assert_eq!(info, (2 * 16 + 4, 9));
    // Pictures of one row have no second difference, and that is no error.
    write_exr(&place, "row.exr", vec![Rgb::WHITE; 4]);
    let text = place.exits(0, &["compare", "row.exr", "row.exr", "--report", "row.json"]).stdout;
    assert!(!text.contains("creases") && place.json("row.json")["mach_bands"].is_null(), "{text}");
}

#[test]
fn rays_file_with_a_fault_is_refused_with_its_line() {
    let place = Place::new();
    std::fs::write(place.path("rays.csv"), "0,0,0,0,0,1\n0,0,0,0,zero,1\n").unwrap();
    place.refused(&["simulate", &scene("furnace"), "--rays", "rays.csv"], "rays.csv:2: dy is 'zero'");
    std::fs::write(place.path("short.csv"), "# rays\n0,0,0,0,0,1e-300\n").unwrap();
    place.refused(
        &["simulate", &scene("furnace"), "--rays", "short.csv"],
        "short.csv:2: the direction is 0, 0, 1e-300",
    );
    let none = "none.csv: no such file, expected a rays file";
    place.refused(&["simulate", &scene("furnace"), "--rays", "none.csv"], none);
}

#[test]
fn render_without_output_names_writes_png_and_exr_of_the_scene() {
    let place = Place::new();
    let furnace = scene("furnace");
    let mut args = vec!["render", furnace.as_str(), "--report", "r.json"];
    args.extend(SMALL);
    let run = place.exits(0, &args);
    assert_eq!(place.names(), ["furnace.exr", "furnace.png", "r.json"]);
    assert!(run.stdout.contains("furnace.png") && run.stdout.contains("EV"), "{}", run.stdout);
    assert!(run.stdout.lines().count() <= 24, "more than a screen:\n{}", run.stdout);
    let report = place.json("r.json");
    assert_eq!(report["schema"], "radeng/render/1");
    assert_eq!(report["options"]["width"], 16);
    assert_eq!(report["n_camera_rays"], 16 * 12);
    let surfaces = report["surfaces"].as_array().unwrap();
    assert_eq!(surfaces.len(), 6);
    for key in ["name", "area_m2", "emitted_w", "incident_w", "absorbed_w", "mean_radiosity_w_m2"] {
        assert!(!surfaces[0][key].is_null(), "{key}");
    }
    assert!(report["board"].is_null());
}

/// 100 columns but for the line with the scene's path, 40 lines.
fn fits_a_screen(text: &str) {
    let narrow = |l: &str| l.chars().count() <= 100 || l.starts_with("scene") || l.contains(".toml");
    assert!(text.lines().count() <= 40 && text.lines().all(narrow), "more than a screen:\n{text}");
}

#[test]
fn render_with_the_board_prints_its_account_and_the_same_furnace() {
    let place = Place::new();
    let furnace = scene("furnace");
    let mut args = vec!["render", furnace.as_str(), "--caster", "board", "-o", "b.exr", "--report", "r.json"];
    args.extend(SMALL);
    let run = place.exits(0, &args);
    for word in
        ["cycles", "rays/s", "tests/cycle", "ICU utilisation", "bound", "ASSUMED", "least work", "25.0 MHz"]
    {
        assert!(run.stdout.contains(word), "'{word}' is missing in\n{}", run.stdout);
    }
    let (_, after) = run.stdout.split_once("\nboard ").unwrap();
    let (board_part, _) = after.split_once("\npictures ").unwrap();
    fits_a_screen(&format!("board {board_part}"));
    let board = &place.json("r.json")["board"];
    assert!(board["cycles"].as_u64().unwrap() > 0 && board["tests"].as_u64().unwrap() > 0);
    assert!(!board["blocks"].as_array().unwrap().is_empty());
    assert_eq!(board["spec"]["name"], "delft-1992");
    let mut args = vec!["render", furnace.as_str(), "-o", "s.exr"];
    args.extend(SMALL);
    place.exits(0, &args);
    place.exits(0, &["compare", "s.exr", "b.exr", "--threshold", "0.02"]);
}

#[test]
fn solution_of_solve_renders_as_the_scene_itself_and_no_other() {
    let place = Place::new();
    let furnace = scene("furnace");
    place.exits(0, &["solve", &furnace, "-o", "f.radsol", "--elements", "96", "--report", "r.json"]);
    let report = place.json("r.json");
    assert_eq!(report["schema"], "radeng/solve/1");
    assert!(report["row_sum_error"]["max"].is_number());
    let b = &report["surfaces"][0]["mean_radiosity_w_m2"][0];
    assert!((b.as_f64().unwrap() - 1.0).abs() < 0.01, "{b}");

    let render = |name: &str, extra: &[&str]| {
        let mut args = vec!["render", furnace.as_str(), "-o", name];
        args.extend(SMALL);
        args.extend(extra);
        place.exits(0, &args);
    };
    render("loaded.exr", &["--solution", "f.radsol"]);
    render("solved.exr", &[]);
    place.exits(0, &["compare", "loaded.exr", "solved.exr", "--threshold", "0"]);
    std::fs::copy(place.path("f.radsol"), place.path("f.json")).unwrap();
    let replacing = ["render", &furnace, "-o", "x.exr", "--solution", "f.json", "--report", "./f.json"];
    place.refused(&replacing, "would replace the input f.json");
    let cube = scene("lit-cube");
    place.refused(&["render", &cube, "-o", "x.exr", "--solution", "f.radsol"], "f.radsol");
    place.refused(&["render", &furnace, "-o", "x.exr", "--solution", "none.radsol"], "none.radsol");
}

/// A floor, a camera over it, and a lamp.
const FLOOR: &str = "version = 1\n[camera]\neye = [0.5, 0.5, 3]\ntarget = [0.5, 0.5, 0]\nup = [0, 1, 0]\n\
                     fov_y_deg = 15\n[materials.a]\nreflectance = 0.5\n[[surface]]\nname = \"floor\"\n\
                     material = \"a\"\nquad = [[0,0,0],[1,0,0],[1,1,0],[0,1,0]]\n[[light]]\nkind = \"point\"\n\
                     intensity = 1.0\n";

#[test]
fn light_on_a_surface_and_a_coarse_wish_warn_on_stderr() {
    let place = Place::new();
    std::fs::write(place.path("floor.toml"), FLOOR.to_owned() + "position = [0.5, 0.5, 0]\n").unwrap();
    let sphere = "position = [0.5, 0.5, 2]\n[[surface]]\nname = \"ball\"\nmaterial = \"a\"\n\
                  sphere = { center = [0.5, 0.5, 0.5], radius = 0.2 }\n";
    std::fs::write(place.path("ball.toml"), FLOOR.to_owned() + sphere).unwrap();
    let stderr = place.exits(0, &["info", "floor.toml"]).stderr;
    assert!(stderr.contains("light 1 lies on surface 'floor': move it off"), "{stderr}");
    let stderr = place.exits(0, &["info", "ball.toml", "--elements", "1"]).stderr;
    assert!(stderr.contains("elements, 1 were asked for") && !stderr.contains("lies on"), "{stderr}");
    assert_eq!(place.exits(0, &["info", "ball.toml"]).stderr, "");
}

#[test]
fn dense_visibility_casts_more_rays_of_pass_1() {
    let place = Place::new();
    let cube = scene("lit-cube");
    let n_rays = |name: &str, extra: &[&str]| {
        let mut args = vec!["solve", cube.as_str(), "-o", "c.radsol", "--elements", "96", "--report", name];
        args.extend(extra);
        place.exits(0, &args);
        let report = place.json(name);
        let dense = report["pass_1"]["options"]["dense_visibility"].as_bool();
        assert_eq!(dense, Some(!extra.is_empty()), "{report}");
        report["pass_1"]["n_rays"].as_u64().unwrap()
    };
    let (sparse, dense) = (n_rays("s.json", &[]), n_rays("d.json", &["--dense-visibility"]));
    assert!(dense > sparse, "{sparse} {dense}");
    place.exits(
        0,
        &["probe", &cube, "--elements", "96", "--dense-visibility", "--at", "0.5,0.5,0", "--normal", "0,0,1"],
    );
}

#[test]
fn simulate_reports_closed_stall_tables_for_every_workload() {
    let place = Place::new();
    std::fs::write(place.path("rays.csv"), "0.5,0.5,0.5,0,0,1\n0.5,0.5,0.5,1,0.2,0.3\n").unwrap();
    let cube = scene("lit-cube");
    let workloads = [
        (&["--workload", "primary"], "primary", 192),
        (&["--workload", "shadow"], "shadow", 1),
        (&["--rays", "rays.csv"], "rays", 2),
    ];
    for (flags, name, rays_at_least) in workloads {
        let mut args = vec!["simulate", cube.as_str(), "--board", "minimal", "--report", "r.json"];
        args.extend(flags);
        args.extend(SMALL);
        let text = place.exits(0, &args).stdout;
        assert!(text.contains("% of the cycles") && text.contains("patch_loader       1 "), "{name}\n{text}");
        fits_a_screen(&text);
        args.push("--all-blocks");
        let text = place.exits(0, &args).stdout;
        assert!(text.contains("share of the cycles by cause, per block"), "{name}\n{text}");
        assert!(text.contains("\ncluster0.module0.patch_loader "), "{name}\n{text}");
        let report = place.json("r.json");
        assert_eq!((&report["schema"], &report["workload"]), (&"radeng/simulate/1".into(), &name.into()));
        let cycles = report["cycles"].as_u64().unwrap();
        assert!(report["rays"].as_u64().unwrap() >= rays_at_least && cycles > 0, "{name}: {report}");
        let blocks = report["blocks"].as_array().unwrap();
        assert!(!blocks.is_empty(), "{name}");
        for block in blocks {
            let causes = block["cycles"].as_object().unwrap();
            let sum: u64 = causes.values().map(|n| n.as_u64().unwrap()).sum();
            assert_eq!(sum, cycles, "{name}: {}", block["block"]);
        }
        let limits = report["bounds"]["limits"].as_array().unwrap();
        assert!(limits.len() >= 12, "{name}: {limits:?}");
        for limit in limits {
            assert!(limit["cycles"].as_u64().unwrap() <= cycles, "{name}: {limit}");
        }
        assert!(report["energy"]["total_joules"].as_f64().unwrap() > 0.0, "{name}");
        let links = report["links"].as_array().unwrap();
        let on_the_host_side = 500 * report["commands"].as_u64().unwrap();
        for link in links {
            let bins = link["cycles_by_occupancy"].as_array().unwrap();
            let sum: u64 = bins.iter().map(|n| n.as_u64().unwrap()).sum();
            assert_eq!(sum, cycles - on_the_host_side, "{name}: {}", link["link"]);
        }
        assert!(links.len() > 10 && report["warm_up"].is_null(), "{name}");
    }
}

/// 16 clusters of two modules, one of everything, and what lies between.
#[test]
fn simulate_of_boards_of_all_sizes_fits_a_screen() {
    let place = Place::new();
    let cube = scene("lit-cube");
    let large = "name = \"sixteen\"\n[clusters]\ncount = 16\nmodules = 4\n[dispatch]\nlow_resolution_min_bundles = 1\n";
    std::fs::write(place.path("large.toml"), large).unwrap();
    for board in ["delft-1992", "minimal", "large.toml"] {
        let mut args = vec!["simulate", cube.as_str(), "--board", board, "--workload", "all"];
        args.extend(SMALL);
        let text = place.exits(0, &args).stdout;
        fits_a_screen(&text);
        for word in ["form factors", "of what they allow", "the rest:", "memory", "a ray", "least work"] {
            assert!(text.contains(word), "'{word}' is missing for {board}\n{text}");
        }
        assert_eq!(text.contains("low res"), board != "minimal", "{text}");
    }
}

#[test]
fn warm_up_leaves_whole_commands_out_of_every_count() {
    let place = Place::new();
    let cube = scene("lit-cube");
    let simulate = |extra: &[&str]| {
        let mut args = vec!["simulate", cube.as_str(), "--board", "minimal", "--workload", "all"];
        args.extend(SMALL);
        args.extend(extra);
        place.exits(0, &args).stdout
    };
    simulate(&["--report", "all.json"]);
    let all = place.json("all.json");
    let cycles = all["cycles"].as_u64().unwrap();
    let asked = (cycles / 3).to_string();
    let text = simulate(&["--warm-up", &asked, "--report", "rest.json"]);
    assert!(text.contains("warm-up    not counted: the first "), "{text}");
    let rest = place.json("rest.json");
    let left_out = &rest["warm_up"];
    assert_eq!(left_out["asked_cycles"], cycles / 3);
    assert!(left_out["cycles"].as_u64() >= left_out["asked_cycles"].as_u64());
    for count in ["cycles", "commands", "rays", "tests"] {
        let of = |report: &Value| report[count].as_u64().unwrap();
        assert!(of(left_out) > 0 && of(&rest) > 0, "{count}: {left_out}");
        assert_eq!(of(left_out) + of(&rest), of(&all), "{count}");
    }
    let sum = |report: &Value, list: &str, table: &str| -> u64 {
        let cycles = &report[list][0][table];
        match cycles {
            Value::Array(bins) => bins.iter().map(|n| n.as_u64().unwrap()).sum(),
            causes => causes.as_object().unwrap().values().map(|n| n.as_u64().unwrap()).sum(),
        }
    };
    assert_eq!(sum(&rest, "blocks", "cycles"), rest["cycles"].as_u64().unwrap(), "accounts are closed");
    let commands = |report: &Value| 500 * report["commands"].as_u64().unwrap();
    assert_eq!(
        sum(&rest, "links", "cycles_by_occupancy"),
        rest["cycles"].as_u64().unwrap() - commands(&rest),
        "so are the queues' histograms"
    );
    // Nothing is left after the last command.
    let mut args = vec!["simulate", cube.as_str(), "--board", "minimal", "--workload", "all"];
    args.extend(SMALL);
    let more = cycles.to_string();
    args.extend(["--warm-up", &more]);
    place.refused(&args, &format!("--warm-up {cycles}: the whole workload takes {cycles} cycles"));
}

#[test]
fn compare_of_reports_says_what_changed_and_exits_by_its_threshold() {
    let place = Place::new();
    let cube = scene("lit-cube");
    let simulate = |board: &str, report: &str| {
        let mut args = vec!["simulate", cube.as_str(), "--board", board, "--report", report];
        args.extend(SMALL);
        place.exits(0, &args);
    };
    std::fs::write(place.path("wide.toml"), "name = \"delft-1992\"\n[bus]\nwidth_bits = 64\n").unwrap();
    std::fs::write(place.path("grid.toml"), "name = \"delft-1992\"\npartition = \"grid\"\n").unwrap();
    simulate("delft-1992", "a.json");
    simulate("delft-1992", "again.json");
    simulate("wide.toml", "wide.json");
    simulate("grid.toml", "grid.json");
    let same = place.exits(0, &["compare", "a.json", "again.json", "--threshold", "0"]).stdout;
    assert!(same.contains("canonical counters are equal") && same.contains("no parameter differs"), "{same}");
    let wide = place.exits(0, &["compare", "a.json", "wide.json"]).stdout;
    for part in ["canonical counters are equal", "bus.width_bits", "32 -> 64", "bus_up_cycles", "points"] {
        assert!(wide.contains(part), "'{part}' is missing in\n{wide}");
    }
    let over = place.run(&["compare", "a.json", "wide.json", "--threshold", "0.01", "--report", "d.json"]);
    assert_eq!(over.status, 1, "{}{}", over.stdout, over.stderr);
    let report = place.json("d.json");
    assert_eq!((&report["schema"], &report["passed"]), (&"radeng/compare-runs/1".into(), &false.into()));
    assert_eq!(report["counters"][0]["counter"], "cycles");
    let grid = place.exits(0, &["compare", "a.json", "grid.json"]).stdout;
    assert!(
        grid.contains("because these differ: partition") && grid.contains("shells+static -> grid"),
        "{grid}"
    );

    std::fs::write(place.path("half.json"), &std::fs::read(place.path("a.json")).unwrap()[..999]).unwrap();
    std::fs::write(place.path("other.json"), "{\"schema\": \"radeng/probe/1\"}").unwrap();
    std::fs::write(place.path("noise.json"), [0u8, 159, 146, 150]).unwrap();
    write_exr(&place, "a.exr", vec![Rgb::WHITE; 4]);
    std::fs::create_dir(place.path("folder.json")).unwrap();
    place.refused(&["compare", "a.json", "half.json"], "half.json: no JSON, or damaged: EOF");
    place.refused(&["compare", "a.json", "other.json"], "other.json: a report with schema radeng/probe/1");
    place.refused(&["compare", "noise.json", "a.json"], "noise.json: not UTF-8 text");
    place.refused(&["compare", "a.json", "none.json"], "none.json: no such file, expected a JSON report");
    place.refused(&["compare", "folder.json", "a.json"], "folder.json: is a directory");
    place.refused(&["compare", "a.json", "a.exr"], "a.json and a.exr: a picture and a report");
    place.refused(&["compare", "a.json", "a.json", "--threshold", "-1"], "a share of each counter");
    place.refused(&["compare", "a.json", "again.json", "--report", "a.json"], "would replace the input");
    let mut args = vec!["solve", cube.as_str(), "-o", "c.radsol", "--elements", "96", "--caster", "board"];
    args.extend(["--report", "solve.json"]);
    place.exits(0, &args);
    place.refused(&["compare", "a.json", "solve.json"], "two kinds, radeng/simulate/1 and radeng/solve/1");
    place.exits(0, &["compare", "solve.json", "solve.json", "--threshold", "0"]);
}

#[test]
fn info_shows_scenes_and_boards() {
    let place = Place::new();
    let text = place.exits(0, &["info", &scene("furnace"), "--elements", "96"]).stdout;
    for word in ["floor", "elements", "patches", "T-junction", "memory", "camera", "patch memory", "grid of"]
    {
        assert!(text.contains(word), "'{word}' is missing in\n{text}");
    }
    for name in ["delft-1992", "minimal"] {
        let text = place.exits(0, &["info", name]).stdout;
        for word in ["coord_frac_bits", "[I]", "largest magnitude", "peak rates", "energy.test_pj"] {
            assert!(text.contains(word), "'{word}' is missing in\n{text}");
        }
    }
    std::fs::write(place.path("board.toml"), "clock_mhz = -3.0\n").unwrap();
    place.refused(&["info", "board.toml"], "clock_mhz");
    std::fs::write(place.path("board.toml"), "clock_mhz = \"fast\"\n").unwrap();
    place.refused(&["info", "board.toml"], "expected a number");
    place.refused(&["render", &scene("furnace"), "--board", "delft-1991"], "(presets: delft-1992, minimal)");
}

#[test]
fn scene_wound_the_other_way_warns_on_stderr() {
    let place = Place::new();
    let text = "version = 1\n[camera]\neye = [0.5, 0.5, 3]\ntarget = [0.5, 0.5, 0]\nup = [0, 1, 0]\nfov_y_deg = 15\n\
                [materials.a]\nreflectance = 0.5\nemission = 1.0\n[[surface]]\nname = \"turned\"\n\
                material = \"a\"\nquad = [[0,0,0],[0,1,0],[1,1,0],[1,0,0]]\n";
    std::fs::write(place.path("turned.toml"), text).unwrap();
    let simulate = ["simulate", "turned.toml", "--elements", "16", "--width", "16", "--height", "16"];
    for args in [
        &["info", "turned.toml"][..],
        &["render", "turned.toml", "-o", "t.png", "--elements", "16"][..],
        &simulate[..],
    ] {
        let run = place.exits(0, args);
        assert!(
            run.stderr.contains("'turned' 100 %") && run.stderr.contains("Wound the other way"),
            "{}",
            run.stderr
        );
        assert!(!run.stdout.contains("Wound"), "{}", run.stdout);
    }
}

#[test]
fn generated_scene_is_read_by_info_and_replaced_only_by_force() {
    let place = Place::new();
    for kind in ["random-patches", "furnished-room", "segments-2d"] {
        let command = ["generate", kind, "--count", "3", "-o", "a.toml", "--force"];
        let text = place.exits(0, &command).stdout;
        assert!(text.contains("a.toml: ") && text.contains(kind), "{text}");
        let info = place.exits(0, &["info", "a.toml"]);
        assert!(info.stdout.contains("camera     eye") && info.stderr.is_empty(), "{}", info.stderr);
    }
    let file = || std::fs::read(place.path("a.toml")).unwrap();
    let before = file();
    place.refused(&["generate", "random-patches", "--count", "3", "-o", "a.toml"], "--force replaces it");
    assert_eq!(file(), before);
    place.exits(0, &["generate", "segments-2d", "--count", "3", "--seed", "1", "-o", "b.toml"]);
    assert_eq!(std::fs::read(place.path("b.toml")).unwrap(), before);
}

#[test]
fn generate_with_a_count_or_a_name_that_cannot_be_is_refused() {
    let place = Place::new();
    let refused = |kind: &str, count: &str, output: &str, expected: &str| {
        place.refused(&["generate", kind, "--count", count, "-o", output], expected);
    };
    refused("random-patches", "0", "a.toml", "0 is not in 1..=100000");
    refused("random-patches", "100001", "a.toml", "100001 is not in 1..=100000");
    refused("random-patches", "-1", "a.toml", "-1 is not in 1..=100000");
    refused("furnished-room", "1001", "a.toml", "--count 1001: expected 1 to 1000 for furnished-room");
    refused("segments-2d", "10001", "a.toml", "--count 10001: expected 1 to 10000 for segments-2d");
    refused("spheres", "10", "a.toml", "random-patches, furnished-room, many-lamps, segments-2d");
    refused("random-patches", "10", "a.json", "expected a name that ends in .toml");
    refused("random-patches", "10", "none/a.toml", "does not exist");
    place.refused(&["generate", "random-patches", "-o", "a.toml"], "--count");
}

#[test]
fn experiment_writes_plot_and_rows_into_its_folder_and_the_same_bytes_again() {
    let place = Place::new();
    place.refused(&["experiment", "hierarchies"], "'hierarchies' is none of subdivision, queueing,");
    let args = ["experiment", "queueing", "--quick", "-o", "made/board"];
    let first = place.exits(0, &args).stdout;
    assert!(first.contains("Geo/D/1") && first.contains("holds: ") && !first.contains("FAILS"), "{first}");
    let read = |name: &str| std::fs::read(place.path("made/board").join(name)).unwrap();
    let (plot, rows) = (read("queueing.svg"), read("queueing.csv"));
    assert!(plot.starts_with(b"<svg") && rows.starts_with(b"D (cycles),rho,"));
    assert_eq!(place.exits(0, &args).stdout, first);
    assert_eq!((read("queueing.svg"), read("queueing.csv")), (plot, rows));
}
