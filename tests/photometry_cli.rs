//! `radeng probe` and false-colour pictures from outside: tables, JSON, CSV, pictures, refusals.

use serde_json::Value;

#[path = "common/place.rs"]
mod place;

use place::{Place, scene};

#[test]
fn probe_prints_a_table_or_the_json_list() {
    let place = Place::new();
    let furnace = scene("furnace");
    let at = ["--at", "0.5,0.5,0", "--normal", "0,0,2", "--at", "0,0.4,0.6", "--normal", "1,0,0"];
    for extra in [&[][..], &["--interpolated"][..]] {
        let mut args = vec!["probe", furnace.as_str(), "--elements", "96", "--json", "--report", "p.json"];
        args.extend(at);
        args.extend(extra);
        let list: Value = serde_json::from_str(&place.exits(0, &args).stdout).unwrap();
        let list = list.as_array().unwrap();
        assert_eq!(list.len(), 2);
        for point in list {
            let e = point["irradiance_w_m2"][1].as_f64().unwrap();
            assert!((e - 1.0).abs() < 0.02, "{extra:?}: {point}");
            assert!((point["illuminance_lx"].as_f64().unwrap() - 179.0 * e).abs() < 1e-6 * 179.0);
        }
        assert_eq!(place.json("p.json")["schema"], "radeng/probe/1");
    }
    let mut args = vec!["probe", furnace.as_str(), "--elements", "96"];
    args.extend(at);
    let table = place.exits(0, &args).stdout;
    assert_eq!(table.lines().count(), 3, "{table}");
    let off = ["--at", "0.5,0.5,0.5", "--normal", "0,0,1", "--interpolated"];
    let mut args = vec!["probe", furnace.as_str(), "--elements", "96"];
    args.extend(off);
    place.refused(&args, "no surface within");
    let turned = ["--at", "0.5,0.5,0", "--normal", "0,0,-1", "--interpolated"];
    let mut args = vec!["probe", furnace.as_str(), "--elements", "96"];
    args.extend(turned);
    place.refused(&args, "the point 0.5, 0.5, 0 with normal 0, 0, -1 lies on the back of surface 'floor'");
    let help = place.exits(0, &["probe", "--help"]).stdout;
    assert!(help.replace('\n', " ").contains("runs pass 1 first unless --solution is given"), "{help}");
}

/// A floor, a camera over it, and a lamp.
const FLOOR: &str = "version = 1\n[camera]\neye = [0.5, 0.5, 3]\ntarget = [0.5, 0.5, 0]\nup = [0, 1, 0]\n\
                     fov_y_deg = 15\n[materials.a]\nreflectance = 0.5\n[[surface]]\nname = \"floor\"\n\
                     material = \"a\"\nquad = [[0,0,0],[1,0,0],[1,1,0],[0,1,0]]\n[[light]]\nkind = \"point\"\n\
                     intensity = 1.0\n";

#[test]
fn probe_of_stored_light_on_the_scene_border_works_on_the_board() {
    let place = Place::new();
    // The lamp lies on the floor's level: nothing but the lifted points makes the board's cube reach above it.
    let scene = FLOOR.replace("eye = [0.5, 0.5, 3]", "eye = [0.5, 0.5, -2]") + "position = [0.5, 0.5, -1]\n";
    std::fs::write(place.path("floor.toml"), scene).unwrap();
    let at = ["--at", "0.5,0.5,0", "--normal", "0,0,1", "--interpolated", "--json"];
    for caster in [&["--caster", "software"][..], &["--caster", "board", "--board", "minimal"][..]] {
        let mut args = vec!["probe", "floor.toml", "--elements", "16"];
        args.extend(at);
        args.extend(caster);
        let list: Value = serde_json::from_str(&place.exits(0, &args).stdout).unwrap();
        assert_eq!(list[0]["irradiance_w_m2"][0].as_f64(), Some(0.0), "{caster:?}");
    }
}

#[test]
fn grid_prints_its_points_and_uniformity_and_writes_csv_picture_and_report() {
    let place = Place::new();
    let furnace = scene("furnace");
    let mut args = vec!["probe", furnace.as_str(), "--elements", "96", "--surface", "floor"];
    args.extend(["--csv", "g.csv", "-o", "g.png", "--report", "g.json"]);
    let text = place.exits(0, &args).stdout;
    for part in [
        "5 x 5 points, cells of 0.200 m x 0.200 m (by EN 12464-1: p = 0.200 m)",
        "E_mean",
        "U0",
        "Ud",
        " lx ",
    ] {
        assert!(text.contains(part), "'{part}' is missing in\n{text}");
    }
    assert!(text.lines().all(|l| l.chars().count() <= 100 || l.starts_with("scene")), "{text}");
    let report = place.json("g.json");
    assert_eq!(report["schema"], "radeng/probe-grid/1");
    assert_eq!(report["points"].as_array().unwrap().len(), 25);
    // E = M / (1 - rho) = 1 W/m^2 everywhere.
    let summary = &report["summary"];
    assert!((summary["mean_lx"].as_f64().unwrap() / 179.0 - 1.0).abs() < 0.02, "{summary}");
    assert!(summary["u0"].as_f64().unwrap() > 0.98 && summary["ud"].as_f64().unwrap() > 0.97, "{summary}");
    assert_eq!(report["picture"]["unit"], "lx");
    let csv = std::fs::read_to_string(place.path("g.csv")).unwrap();
    let rows: Vec<&str> = csv.lines().collect();
    assert_eq!((rows.len(), rows[0].split(',').count(), rows[25].split(',').count()), (26, 12, 12));
    assert!(rows[0].ends_with("illuminance_lx") && rows[1].starts_with("1,1,"), "{}", rows[0]);
    assert_eq!(place.names(), ["g.csv", "g.json", "g.png"]);
    let mut reader =
        png::Decoder::new(std::io::BufReader::new(std::fs::File::open(place.path("g.png")).unwrap()))
            .read_info()
            .unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert!(info.width > 640 && info.height >= 640, "{} x {}", info.width, info.height);

    let mut args = vec!["probe", furnace.as_str(), "--elements", "96", "--grid", "corner=0.2,0.2,0.5"];
    args.extend(["--edge-u", "0.6,0,0", "--edge-v", "0,0.6,0", "--n", "3,2", "--json"]);
    let json: Value = serde_json::from_str(&place.exits(0, &args).stdout).unwrap();
    assert_eq!(json["grid"]["n"], serde_json::json!([3, 2]));
    assert_eq!(json["points"][5]["uv"], serde_json::json!([3, 2]));
    let z: Vec<f64> = (0..6).map(|k| json["points"][k]["normal"][2].as_f64().unwrap()).collect();
    assert_eq!(z, [1.0; 6]);
}

#[test]
fn grids_that_cannot_be_are_refused_by_name() {
    let place = Place::new();
    let furnace = scene("furnace");
    let refused = |args: &[&str], expected: &str| {
        place.refused(&[&["probe", furnace.as_str(), "--elements", "96"][..], args].concat(), expected);
    };
    let plane = ["--grid", "corner=0.2,0.2,0.5", "--edge-u", "0.6,0,0", "--edge-v"];
    refused(&[&plane[..], &["0,0,0"]].concat(), "edge v is 0, 0, 0, 0 m long");
    refused(&[&plane[..], &["0.5,0,0"]].concat(), "lie along one line");
    refused(&[&plane[..], &["0,1,0", "--n", "0,3"]].concat(), "two whole numbers over 0");
    refused(&[&plane[..], &["0,1,0", "--border", "0.4"]].concat(), "a border of 0.4 m leaves nothing");
    refused(&[&plane[..], &["0,1,0", "--scale", "5,5"]].concat(), "--scale 5,5: expected two finite numbers");
    refused(&[&plane[..], &["0,1,0", "-o", "g.exr"]].concat(), ".png");
    refused(&plane[..4], "--edge-v");
    refused(&["--surface", "flor"], "no surface 'flor': it has 'floor'");
    refused(&["--surface", "floor", "--normal", "0,0,-1"], "behind 'floor'");
    refused(&["--surface", "floor", "--at", "0,0,0"], "--at");
    refused(
        &["--at", "0,0,0", "--normal", "0,0,1", "--n", "3,3"],
        "--n has no use without --grid or --surface",
    );
}

#[test]
fn false_colour_pictures_stand_beside_the_others_or_alone() {
    let place = Place::new();
    let furnace = scene("furnace");
    let small = ["render", furnace.as_str(), "--elements", "96", "--width", "16", "--height", "12"];
    let render = |args: &[&str]| place.exits(0, &[&small[..], args].concat()).stdout;
    let text = render(&["--false-colour", "illuminance", "--report", "r.json"]);
    assert_eq!(place.names(), ["furnace-illuminance.png", "r.json"]);
    assert!(text.contains("illuminance in false colour, 0 to 200 lx, linear (auto)"), "{text}");
    let picture = &place.json("r.json")["false_colour"][0];
    assert_eq!((&picture["unit"], &picture["scale"]["hi"]), (&Value::from("lx"), &Value::from(200.0)));
    let both =
        ["-o", "v.png", "--false-colour", "luminance=l.png", "--scale", "1,100", "--scale-kind", "log"];
    let text = render(&both);
    assert!(text.contains("l.png  luminance in false colour, 1 to 100 cd/m^2, logarithmic"), "{text}");
    assert_eq!(place.names(), ["furnace-illuminance.png", "l.png", "r.json", "v.png"]);
    let refused = |args: &[&str], expected: &str| place.refused(&[&small[..], args].concat(), expected);
    refused(&["--false-colour", "glare"], "expected luminance, illuminance or sources");
    refused(&["--false-colour", "luminance=x.exr"], ".png");
    refused(&["--false-colour", "luminance", "--scale", "0,9", "--scale-kind", "log"], "starts over 0");
    let two = ["--false-colour", "luminance", "--false-colour", "illuminance", "--scale", "0,9"];
    refused(&two, "one unit only");
    refused(&["--scale", "0,9"], "no use without --false-colour");
}
