//! Film: regions and adaptive sampling on both casters, partial pictures at Ctrl-C, quality, what reports tell of rays by
//! kind; from outside.

use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use radiosity_engine::image::exr::read_exr;
use serde_json::Value;

#[path = "common/place.rs"]
mod place;

use place::{Place, scene};

const COARSE: [&str; 2] = ["--elements", "60"];

#[test]
fn region_written_by_either_caster_has_the_bits_of_the_whole_picture() {
    for caster in ["software", "board"] {
        let place = Place::new();
        let cornell = scene("cornell-box");
        let render = |out: &str, more: &[&str]| {
            let picture = ["--width", "24", "--height", "20", "--samples", "1..4", "--shadow-strata", "2"];
            let args =
                [&["render", &cornell, "--caster", caster, "-o", out][..], &COARSE, &picture, more].concat();
            place.exits(0, &args);
            read_exr(&place.path(out)).unwrap()
        };
        let whole = render("whole.exr", &["--filter", "mitchell"]);
        let part = render("part.exr", &["--filter", "mitchell", "--region", "3,5,11,9"]);
        assert_eq!((part.width, part.height), (11, 9));
        for y in 0..9 {
            for x in 0..11 {
                assert_eq!(part.pixel(x, y), whole.pixel(3 + x, 5 + y), "{caster} at {x}, {y}");
            }
        }
    }
}

#[test]
fn adaptive_picture_has_the_same_bits_for_one_and_three_threads() {
    let place = Place::new();
    let cornell = scene("cornell-box");
    for threads in ["1", "3"] {
        let out = format!("{threads}.exr");
        let args =
            ["render", &cornell, "--threads", threads, "-o", &out, "--samples", "1..16", "--filter", "tent"];
        let size = ["--width", "40", "--height", "40", "--shadow-strata", "2"];
        place.exits(0, &[&args[..], &COARSE, &size].concat());
    }
    let read = |name: &str| std::fs::read(place.path(name)).unwrap();
    assert!(read("1.exr") == read("3.exr"));
}

#[test]
fn regions_and_samples_that_cannot_be_are_refused_with_value_and_size() {
    let place = Place::new();
    let furnace = scene("furnace");
    let refused = |more: &[&str], words: &str| {
        place.refused(&[&["render", &furnace][..], more].concat(), words);
    };
    refused(
        &["--region", "250,0,10,10"],
        "--region 250,0,10,10 (x, y, width, height) does not lie in the picture of 256 x 256 pixels",
    );
    refused(&["--region", "0,0,0,4"], "x,y,width,height");
    refused(&["--samples", "4..2"], "MIN..MAX");
    refused(&["--samples", "1..17"], "MIN..MAX");
    refused(&["--contrast", "0.1"], "--contrast has no use without --samples MIN..MAX");
    refused(&["--samples", "1..4", "--contrast", "0"], "0.001 to 1");
    refused(&["--sample-map", "m.exr"], "ends in .png");
    place.refused(&["simulate", &furnace, "--samples", "1..4"], "--samples 1..4: expected one number");
    place.refused(&["verify", &furnace, "--samples", "1..4"], "--samples 1..4: expected one number");
}

#[test]
fn quality_sets_elements_and_rays_and_single_options_win() {
    let place = Place::new();
    let furnace = scene("furnace");
    let report = |more: &[&str]| -> Value {
        let args =
            ["render", &furnace, "--width", "16", "--height", "12", "-o", "q.png", "--report", "q.json"];
        let run = place.exits(0, &[&args[..], more].concat());
        if more.contains(&"--quality") {
            assert!(run.stdout.contains(&format!("{} quality: ", more[1])), "{}", run.stdout);
        }
        place.json("q.json")
    };
    let plain = report(&[]);
    assert!(plain.get("quality").is_none());
    let normal = report(&["--quality", "normal"]);
    assert_eq!(plain["scene"], normal["scene"], "normal is the scene's own mesh");
    assert_eq!(normal["options"]["adaptive"]["max"], 8);
    let (draft, high) = (report(&["--quality", "draft"]), report(&["--quality", "high"]));
    let elements = |r: &Value| r["scene"]["n_elements"].as_u64().unwrap();
    assert!(2 * elements(&draft) < elements(&normal) && 2 * elements(&normal) < elements(&high));
    let error = |r: &Value| r["options"]["direct"]["shadow_error"].as_f64().unwrap();
    assert!(error(&draft) > error(&normal) && error(&normal) > error(&high));
    let rays = |r: &Value| r["options"]["adaptive"]["max"].as_u64().unwrap();
    assert!(rays(&draft) < rays(&normal) && rays(&normal) < rays(&high));
    assert_eq!(high["quality"]["name"], "high");
    assert_eq!(high["quality"]["max_samples"], high["options"]["adaptive"]["max"]);
    let own = report(&["--quality", "high", "--elements", "96", "--samples", "2", "--shadow-strata", "3"]);
    assert!(own["options"]["adaptive"].is_null());
    assert_eq!(
        (&own["options"]["samples"], &own["options"]["direct"]["shadow_strata"]),
        (&2.into(), &3.into())
    );
    assert_eq!(own["quality"]["elements"], 96);
}

#[test]
fn report_splits_rays_by_kind_and_names_the_share_of_ray_casting() {
    let place = Place::new();
    let cornell = scene("cornell-box");
    for caster in ["software", "board"] {
        let args = ["render", &cornell, "--caster", caster, "-o", "k.png", "--report", "k.json"];
        let size = ["--width", "16", "--height", "16", "--shadow-strata", "2"];
        let run = place.exits(0, &[&args[..], &COARSE, &size].concat());
        let told = match caster {
            "software" => "rays       primary 256 (64.0 a bundle); form factors ",
            _ => "down       up a bundle   full",
        };
        assert!(run.stdout.contains(told), "{}", run.stdout);
        let report = place.json("k.json");
        let kinds = report["rays_by_kind"].as_array().unwrap();
        let names: Vec<_> = kinds.iter().map(|k| k["purpose"].as_str().unwrap()).collect();
        assert_eq!(names, ["primary", "form_factor", "selection", "shadow"]);
        for kind in kinds {
            let n = |key: &str| kind[key].as_u64().unwrap();
            assert_eq!(n("rays"), n("bundle_rays") + n("explicit_rays"), "{kind}");
            assert!(n("hits") <= n("rays") && n("queries") > 0, "{kind}");
        }
        // Camera tiles and shadow rays go down as descriptors; of shadow rays a few ask for what blocks them, one by one.
        for (kind, most) in [(&kinds[0], 0.0), (&kinds[3], 0.1)] {
            let n = |key: &str| kind[key].as_f64().unwrap();
            assert!(n("explicit_rays") <= most * n("rays"), "{kind}");
        }
        let time = &report["timings"]["ray_casting"];
        let share = time["share"].as_f64().unwrap();
        assert!(share > 0.0 && share < 1.0, "{share}");
        if caster == "software" {
            let bound = time["amdahl_bound"].as_f64().unwrap();
            assert!((bound * (1.0 - share) - 1.0).abs() < 1e-9);
            assert!(run.stdout.contains("a board makes all of it at most"), "{}", run.stdout);
        } else {
            assert!(time["amdahl_bound"].is_null());
            for (kind, counted) in kinds.iter().zip(report["board"]["by_purpose"].as_array().unwrap()) {
                assert_eq!(kind["purpose"], counted["purpose"]);
                for same in ["rays", "hits", "bundles"] {
                    assert_eq!(kind[same], counted[same], "{kind} {same}");
                }
            }
        }
    }
}

#[test]
fn specular_rays_go_to_the_board_as_explicit_rays() {
    let place = Place::new();
    let room = r#"
version = 1
[camera]
eye = [0.5, 0.5, 0.9]
target = [0.5, 0.5, 0.0]
up = [0.0, 1.0, 0.0]
fov_y_deg = 60.0
[materials.mirror]
reflectance = 0.0
specular = 0.9
[materials.lamp]
reflectance = 0.5
emission = 1.0
[[surface]]
name = "mirror"
material = "mirror"
quad = [[0,0,0],[1,0,0],[1,1,0],[0,1,0]]
[[surface]]
name = "lamp"
material = "lamp"
quad = [[0,0,1],[0,1,1],[1,1,1],[1,0,1]]
"#;
    std::fs::write(place.path("room.toml"), room).unwrap();
    let size = ["--width", "8", "--height", "8", "--shadow-strata", "2", "--elements", "40"];
    let args = ["render", "room.toml", "--caster", "board", "-o", "m.png", "--report", "m.json"];
    place.exits(0, &[&args[..], &size].concat());
    let report = place.json("m.json");
    let of =
        |list: &Value| list.as_array().unwrap().iter().find(|k| k["purpose"] == "specular").unwrap().clone();
    let specular = of(&report["rays_by_kind"]);
    assert!(specular["rays"].as_u64().unwrap() > 0);
    assert_eq!((&specular["bundles"], &specular["explicit_rays"]), (&0.into(), &specular["rays"]));
    let counted = of(&report["board"]["by_purpose"]);
    assert_eq!(counted["rays"], specular["rays"]);
    assert!(counted["explicit_occupancy"]["units"].as_u64().unwrap() > 0);
}

/// A render of the Cornell box that takes far longer than any test waits.
fn start(place: &Place, partial: bool) -> Child {
    let cornell = scene("cornell-box");
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("radeng"));
    let picture = ["--width", "400", "--height", "400", "--samples", "16", "--shadow-strata", "8"];
    command.current_dir(place.path(".")).args(["render", &cornell, "-o", "p.exr", "--report", "p.json"]);
    command.args(COARSE).args(picture).args(partial.then_some("--partial"));
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn interrupt(child: &Child) {
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
}

fn waited(child: &mut Child) -> std::process::ExitStatus {
    let started = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        if started.elapsed() > Duration::from_secs(60) {
            let _ = child.kill();
            panic!("an interrupted render went on for a minute");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn interrupted_partial_render_writes_the_whole_picture_so_far_and_exits_with_130() {
    let place = Place::new();
    let mut child = start(&place, true);
    std::thread::sleep(Duration::from_secs(4));
    interrupt(&child);
    let status = waited(&mut child);
    let mut stderr = String::new();
    child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
    assert_eq!(status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("of pass 2 done"), "{stderr}");
    let report = place.json("p.json");
    let done = report["partial"]["done"].as_f64().unwrap();
    assert!(done > 0.0 && done < 1.0, "{done}");
    let film = read_exr(&place.path("p.exr")).unwrap();
    assert_eq!((film.width, film.height), (400, 400));
    let black = film.pixels.iter().filter(|p| p.is_black()).count();
    let unrendered = report["partial"]["unrendered_pixels"].as_u64().unwrap() as usize;
    assert!(black >= unrendered && unrendered < 160_000, "{black} black, {unrendered} without a ray");
}

#[test]
fn interrupted_render_leaves_the_files_as_they_were() {
    let place = Place::new();
    std::fs::write(place.path("p.exr"), "old").unwrap();
    let mut child = start(&place, false);
    std::thread::sleep(Duration::from_secs(2));
    interrupt(&child);
    let status = waited(&mut child);
    assert!(!status.success());
    assert_eq!(std::fs::read(place.path("p.exr")).unwrap(), b"old");
    assert_eq!(place.names(), ["p.exr"]);
}
