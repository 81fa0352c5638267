//! The fit, and the savings of a small picture.

use super::*;

fn run_of(way: Way, shadow_rays: u64, rmse: f64) -> Run {
    Run { way, rays_a_lamp: 0, shadow_rays, selection_rays: 0, seconds: 0.0, rmse, board: [0.0; 2] }
}

#[test]
fn share_at_equal_error_of_two_power_laws_is_their_ratio() {
    let law = |way, rays: [u64; 3], factor: f64| {
        rays.map(|n| run_of(way, (n as f64 * factor) as u64, 1.0 / (n as f64).sqrt()))
    };
    let mut runs = law(Way::Full, [100, 400, 1600], 1.0).to_vec();
    runs.extend(law(Way::Adaptive, [200, 800, 3200], 0.25));
    let [share, error] = share_at_equal_error(&runs, Way::Adaptive).unwrap();
    assert!((share - 0.25).abs() < 1e-9, "{share}");
    assert!((1.0 / 40.0..1.0 / 10.0).contains(&error));
}

#[test]
fn savings_of_a_small_cornell_box_cost_little_error_and_coherence_none() {
    let lit = Lit::new("cornell-box", Stage::cornell_box(1000).unwrap(), 0.05).unwrap();
    let reference = lit.reference(32, 101..103).unwrap();
    let of = |way: Way| {
        let rendering = lit.render(way.options(8), 32, 1).unwrap();
        (rendering.direct.unwrap().shadow.rays, rmse(&rendering.film, &reference))
    };
    let [full, selection, coherence, adaptive] = WAYS.map(of);
    assert!(selection.0 <= full.0);
    assert_eq!(coherence.1, selection.1);
    assert!(adaptive.0 * 4 < full.0, "{} of {}", adaptive.0, full.0);
    assert!(adaptive.1 < 0.05, "{}", adaptive.1);
}
