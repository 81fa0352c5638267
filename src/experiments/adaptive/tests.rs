//! Quick runs: the measure itself, and that refined meshes beat uniform ones by it.

use super::measure::sized;
use super::*;
use crate::mesh::Mesh;
use crate::raycast::software::SoftwareCaster;

#[test]
fn refined_mesh_needs_fewer_elements_than_the_uniform_one_and_more_than_the_best_quadtree() {
    for (case, most) in CASES.iter().zip([0.8, 1.0]) {
        let outcome = measure(case, Extent::Quick).unwrap();
        for m in outcome.ours.iter().chain([&outcome.uniform]) {
            println!("{}: {} elements, {:?}, mesh alone {}", case.name, m.elements, m.errors, m.mesh_error);
        }
        println!("{}: any quadtree {}", case.name, outcome.best);
        let share = outcome.share(|m| m.mesh_error).expect("one of the wanted errors is met");
        let best = outcome.best / outcome.uniform.elements as f64;
        assert!(best <= share && share <= most, "{}: {share}, best {best}", case.name);
        assert!(outcome.ours.len() <= N_TRIES && outcome.uniform.errors.bilinear > 0.0);
    }
}

#[test]
fn reference_against_itself_has_no_error_but_that_of_its_vertices() {
    let scene = Scene::parse(CASES[1].text, Path::new("scene.toml")).unwrap();
    let target = MeshTarget::MaxElementM(0.25);
    let options = SolveOptions::default();
    let reference = Reference::new(&scene, target, 1, &options).unwrap();
    let scene = sized(&scene, target);
    let coarse = Mesh::build(&scene);
    let same =
        Mesh::build_with(&scene, &coarse.subdivision().split(&vec![true; coarse.elements.len()])).unwrap();
    let mut caster = SoftwareCaster::new(same.cast_patches());
    let solution = crate::radiosity::solve(&scene, &same, &mut caster, &options, &mut |_| {}).unwrap();
    let meshed = measure::Meshed { mesh: same, solution, refined: None };
    let errors = reference.errors(&meshed);
    assert!(errors.constant < 1e-12, "{}", errors.constant);
    let alone = reference.interpolation_error(&meshed.mesh);
    assert!((alone - errors.bilinear).abs() < 1e-6, "{alone} vs {}", errors.bilinear);
    // A full tree is the uniform mesh; pruning for no error keeps all of it.
    let trees = Quadtrees::new(&scene, target, 2, &reference);
    let n = trees.fewest(alone * (1.0 + 1e-9));
    assert!(n <= meshed.mesh.elements.len() as f64 + 1e-6, "{n}");
    assert!(trees.fewest(2.0 * alone) < n);
}

/// `cargo test --release --lib adaptive -- --ignored --nocapture`
#[test]
#[ignore = "minutes: every case at full size"]
fn every_case_takes_at_most_its_share_of_the_uniform_mesh() {
    let mut wrong = Vec::new();
    for case in &CASES {
        let started = std::time::Instant::now();
        let outcome = measure(case, Extent::Full).unwrap();
        for m in [&outcome.uniform].into_iter().chain(&outcome.ours) {
            println!("{}: {} elements, {:?}, mesh alone {}", case.name, m.elements, m.errors, m.mesh_error);
        }
        let share = outcome.share(|m| m.errors.bilinear);
        let best = outcome.best / outcome.uniform.elements as f64;
        println!("{}: {share:?}, any quadtree {best:.3}, {:?}", case.name, started.elapsed());
        if share.is_none_or(|s| s > case.share) {
            wrong.push((case.name, share));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
