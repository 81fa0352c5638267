//! `render --reconstruct` from outside: every method, its rules, what the report counts, what is refused.

#[path = "common/place.rs"]
mod place;

use place::{Place, scene};

/// A small picture from a solution that is there.
fn render(place: &Place, scene: &str, more: &[&str]) -> (serde_json::Value, String) {
    let mut args = vec!["render", scene, "--solution", "s.radsol", "--width", "24", "--height", "24"];
    args.extend(["--shadow-strata", "1", "-o", "p.exr", "--report", "r.json"]);
    args.extend(more);
    let text = place.exits(0, &args).stdout;
    (place.json("r.json"), text)
}

#[test]
fn render_takes_every_method_and_says_which() {
    let (place, cube) = (Place::new(), scene("lit-cube"));
    place.exits(0, &["solve", &cube, "-o", "s.radsol"]);
    let mut means = Vec::new();
    for method in ["constant", "bilinear", "quadratic", "cubic-triangle", "hermite", "hermite-limited"] {
        let (report, text) = render(&place, &cube, &["--reconstruct", method]);
        assert_eq!(report["options"]["reconstruct"], method);
        assert!(text.contains(&format!("{method} reconstruction")), "{text}");
        means.push(report["mean_luminance_w_m2_sr"].as_f64().unwrap());
        // Smooth light: nothing to limit, nothing to clamp.
        assert_eq!(report["limited_vertices"], 0, "{method}");
        assert_eq!(report["clamped_pixels"], 0, "{method}");
        assert_eq!(text.contains("0 vertices limited"), method == "hermite-limited", "{text}");
    }
    for mean in &means {
        assert!((mean / means[0] - 1.0).abs() < 0.02, "{means:?}");
    }
}

#[test]
fn render_takes_the_rules_and_tells_those_that_are_not_the_usual_ones() {
    let (place, cube) = (Place::new(), scene("lit-cube"));
    place.exits(0, &["solve", &cube, "-o", "s.radsol", "--unshot", "0.1"]);
    let rules = ["--gradients", "seed-edge-normals", "--twists", "adini"];
    let (report, text) = render(&place, &cube, &rules);
    assert_eq!(report["options"]["gradients"], "seed-edge-normals");
    assert_eq!(report["options"]["twists"], "adini");
    assert!(text.contains("seed-edge-normals gradients, adini twists"), "{text}");
    let (usual, text) = render(&place, &cube, &[]);
    assert_eq!(usual["options"]["gradients"], "least-squares");
    assert!(!text.contains("gradients"), "{text}");
    assert_ne!(report["mean_luminance_w_m2_sr"], usual["mean_luminance_w_m2_sr"]);
}

#[test]
fn rules_without_use_and_unknown_methods_are_refused_by_name() {
    let (place, cube) = (Place::new(), scene("lit-cube"));
    place.refused(&["render", &cube, "--reconstruct", "cubic"], "cubic-triangle");
    place.refused(&["render", &cube, "--gradients", "none"], "least-squares");
    place.refused(
        &["render", &cube, "--reconstruct", "bilinear", "--gradients", "zero"],
        "--gradients has no use with --reconstruct bilinear",
    );
    place.refused(
        &["render", &cube, "--reconstruct", "quadratic", "--twists", "zero"],
        "--twists has no use with --reconstruct quadratic",
    );
}
