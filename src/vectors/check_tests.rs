//! Vectors of a small scene, run: what holds, what a changed answer or wire shows, how a mismatch is replayed.

use rtl_model::datapath::Facing;
use rtl_model::fixed::{Formats, Rounding};

use super::*;
use crate::raycast::Purpose;
use crate::report::side_by_side::{mismatch_text, wrong_text};
use crate::vectors::{from_csv, of_mismatch, sample, to_csv};
use crate::verify::{Compared, Mismatch, Model};

fn spec() -> BoardSpec {
    BoardSpec::preset("minimal").unwrap()
}

/// Two dozen bent quads and triangles in the cube, rays through it in both modes.
fn scene(formats: Formats, n_rays: usize) -> (MemoryImage, Vec<(RayWords, bool)>) {
    let mut state = 12_345_u64;
    let mut next = |below: i64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        i32::try_from((state >> 33) as i64 % below).unwrap()
    };
    let cube = 1_i64 << formats.coord_frac_bits;
    let unit = 1_i64 << formats.dir_frac_bits;
    let mut patches = Vec::new();
    for id in 0..24 {
        let base = [(); 3].map(|()| next(cube) - (cube / 2) as i32);
        let mut corners = [(); 4].map(|()| base.map(|b| b + next(cube / 2) - (cube / 4) as i32));
        let is_triangle = id % 3 == 0;
        if is_triangle {
            corners[3] = corners[2];
        }
        patches.push(PatchWords { corners, is_triangle, id });
    }
    let rays = (0..n_rays).map(|i| {
        let origin = [(); 3].map(|()| next(2 * cube) - cube as i32);
        let mut dir = [(); 3].map(|()| next(2 * unit - 1) - (unit - 1) as i32);
        dir[i % 3] |= (unit / 2) as i32;
        (RayWords { origin, dir, t_max: formats.t_limit() }, i / 3 % 2 == 1)
    });
    let rays = rays.collect();
    (MemoryImage::build(&formats, &patches, None), rays)
}

#[test]
fn check_of_a_sample_holds_at_every_rounding_of_edge_normals() {
    let base = Formats { coord_frac_bits: 12, dir_frac_bits: 12, t_frac_bits: 14, ..Formats::default() };
    let mut hits = 0;
    for (cross_keep_bits, rounding) in
        [(None, Rounding::NearestEven), (Some(8), Rounding::NearestEven), (Some(10), Rounding::Floor)]
    {
        let formats = Formats { cross_keep_bits, rounding, ..base };
        let (image, rays) = scene(formats, 400);
        let vectors = sample(&image, &rays, 100);
        assert_eq!((vectors.patches.len(), vectors.rays.len()), (24, 100));
        assert!(vectors.tests.len() > 50);
        assert!(vectors.rays.iter().any(|r| r.any_hit) && vectors.rays.iter().any(|r| !r.any_hit));
        let found = check(&vectors, &spec()).unwrap();
        assert!(found.passed(), "{formats:?}: {:?}", found.first_wrong);
        assert_eq!((found.n_rays, found.n_expected, found.spec.formats), (100, 100, formats));
        assert_eq!(found.statistics.canonical.rays, 100);
        hits += vectors.rays.iter().filter(|r| r.expected.is_some_and(|e| e.hit().is_some())).count();
    }
    assert!(hits > 5, "{hits} hits");
}

#[test]
fn check_of_a_wrong_answer_names_the_first_ray_and_shows_every_wire() {
    let (image, rays) = scene(Formats::default(), 60);
    let good = sample(&image, &rays, 60);
    let hit = |r: &&RayVector| r.expected.is_some_and(|e| e.hit().is_some());
    let place = good.rays.iter().position(|r| hit(&r)).unwrap();
    let mut bad = good.clone();
    let Some(Expected::Nearest(Some(answer))) = bad.rays[place].expected else { panic!("no hit") };
    bad.rays[place].expected = Some(Expected::Nearest(Some(HitWords { t: answer.t + 1, ..answer })));
    let last = bad.rays.iter().rposition(|r| r.any_hit).unwrap();
    assert!(last > place);
    bad.rays[last].expected = Some(Expected::Any(bad.rays[last].expected != Some(Expected::Any(true))));
    let found = check(&bad, &spec()).unwrap();
    assert_eq!((found.n_rays_wrong, found.n_tests_wrong), (2, 0));
    let wrong = found.first_wrong.unwrap();
    let Wrong::Ray { place: at, answers, patches } = &wrong else { panic!("{wrong:?}") };
    assert_eq!(*at, place);
    assert_eq!((answers.clocked, answers.functional), (Some(answers.oracle), answers.oracle));
    assert_eq!(patches[0].id, answer.patch);
    let text = wrong_text(&bad, &wrong);
    let patch_title = format!("patch {}, ", answer.patch);
    for word in
        ["file", "board, clocked", "oracle", "words of 2^-24", "t_max", "e01", "num_shifted012", &patch_title]
    {
        assert!(text.contains(word), "'{word}' is missing in\n{text}");
    }
    assert!(text.contains(&(answer.t + 1).to_string()) && text.contains(&answer.t.to_string()), "{text}");
    // Board and oracle agree on every wire: nothing is marked.
    assert!(!text.contains("<-- differ"), "{text}");
}

#[test]
fn check_of_a_wrong_wire_names_the_test_and_marks_the_wire() {
    let (image, rays) = scene(Formats::default(), 30);
    let mut vectors = sample(&image, &rays, 30);
    let n = vectors.tests.len();
    vectors.tests[n - 1].wires.c[1][2] += 1;
    let found = check(&vectors, &spec()).unwrap();
    assert_eq!((found.n_rays_wrong, found.n_tests, found.n_tests_wrong), (0, n as u64, 1));
    let wrong = found.first_wrong.unwrap();
    assert!(matches!(wrong, Wrong::Test { place, .. } if place == n - 1));
    let text = wrong_text(&vectors, &wrong);
    let marked: Vec<&str> = text.lines().filter(|l| l.ends_with("<-- differ")).collect();
    assert_eq!(marked.len(), 1, "{text}");
    assert!(marked[0].trim_start().starts_with("c12.z "), "{text}");
}

#[test]
fn check_with_rounded_normals_takes_the_grid_that_the_answers_were_made_with() {
    let widths = Formats { coord_frac_bits: 12, dir_frac_bits: 12, t_frac_bits: 14, ..Formats::default() };
    let formats = Formats { cross_keep_bits: Some(4), ..widths };
    let (image, rays) = scene(formats, 1000);
    let patches: Vec<PatchWords> = (0..image.n_patches).map(|i| image.patch(i)).collect();
    let image = MemoryImage::build(&formats, &patches, Some(6));
    let vectors = sample(&image, &rays, 1000);
    assert_eq!(vectors.grid_log2, Some(6));
    // A board with another grid, and one that chooses it.
    for own in [Some(1), None] {
        let board = BoardSpec { grid_log2: own, ..spec() };
        let found = check(&vectors, &board).unwrap();
        assert!(found.passed(), "{:?}", found.first_wrong);
        assert_eq!((found.grid_log2, found.spec.grid_log2), (6, Some(6)));
    }
    // Without the record the same answers are wrong on another grid: the record is needed.
    let board = BoardSpec { grid_log2: Some(1), ..spec() };
    let found = check(&Vectors { grid_log2: None, ..vectors }, &board).unwrap();
    assert!(found.n_rays_wrong > 0 && found.grid_log2 == 1, "{} wrong", found.n_rays_wrong);
}

/// A nearest-hit mismatch on the first ray with a hit; its true answer.
fn mismatch(image: &MemoryImage, rays: &[(RayWords, bool)], compared: Compared) -> (Mismatch, HitWords) {
    let answer = |ray: &RayWords| trace_observed(image, ray, false, |_, _| ()).hit.map(|hit| (*ray, hit));
    let (ray, hit) = rays.iter().find_map(|(ray, _)| answer(ray)).unwrap();
    let patches: Vec<PatchWords> =
        (0..image.n_patches).map(|i| image.patch(i)).filter(|p| p.id == hit.patch).collect();
    let facing = if hit.facing == Facing::Front { Facing::Back } else { Facing::Front };
    let mismatch = Mismatch {
        compared,
        any_hit: false,
        model: Model::Clocked,
        purpose: Purpose::Shadow,
        index: 77,
        ray,
        board: Some(hit),
        oracle: Some(HitWords { facing, ..hit }),
        patches,
    };
    (mismatch, hit)
}

#[test]
fn mismatch_file_holds_the_oracles_answer_and_fails_until_the_board_gives_it() {
    let (image, rays) = scene(Formats::default(), 60);
    let (mut wrong, hit) = mismatch(&image, &rays, Compared::NearestHit);
    // The oracle is said to answer another side: so the real board must be found wrong, in the same words.
    let vectors = from_csv(&to_csv(&of_mismatch(&image, &wrong))).unwrap();
    assert_eq!((vectors.patches.len(), vectors.rays.len(), vectors.tests.len()), (24, 1, 0));
    assert_eq!(vectors.grid_log2, Some(image.grid.log2_cells));
    let found = check(&vectors, &spec()).unwrap();
    let answers = found.first_wrong.as_ref().unwrap().answers();
    assert_eq!(answers.expected, Some(Expected::Nearest(wrong.oracle)));
    assert_eq!(answers.clocked, Some(Expected::Nearest(Some(hit))));
    let text = mismatch_text("coord_frac_bits = 24, ", &image.formats, &wrong);
    let title = "first mismatch: coord_frac_bits = 24, shadow ray 77, the nearest hit\n";
    assert!(text.contains(title) && text.contains("board, clocked") && text.contains("front"), "{text}");
    wrong.oracle = Some(hit);
    assert!(check(&of_mismatch(&image, &wrong), &spec()).unwrap().passed());
}

#[test]
fn mismatch_of_a_test_or_a_hit_bit_becomes_a_row_of_its_kind() {
    let (image, rays) = scene(Formats::default(), 60);
    let (test, hit) = mismatch(&image, &rays, Compared::TestHit);
    let vectors = of_mismatch(&image, &test);
    assert_eq!((vectors.rays[0].expected, vectors.tests.len()), (None, 1));
    assert_eq!(vectors.tests[0].hit.map(|h| h.patch), Some(hit.patch));
    assert!(check(&vectors, &spec()).unwrap().passed());
    let (bit, _) = mismatch(&image, &rays, Compared::AnyHit { board: true, oracle: false });
    let vectors = of_mismatch(&image, &bit);
    assert_eq!((vectors.rays[0].any_hit, vectors.rays[0].expected), (true, Some(Expected::Any(false))));
    assert_eq!(check(&vectors, &spec()).unwrap().n_rays_wrong, 1);
    assert!(mismatch_text("", &image.formats, &bit).contains("the hit bit: board hit, oracle miss"));
}

#[test]
fn check_of_nothing_or_beyond_the_patch_memory_is_refused() {
    let (image, rays) = scene(Formats::default(), 3);
    // Without a grid of the file the board's own counts.
    let vectors = Vectors { grid_log2: None, ..sample(&image, &rays, 3) };
    let nothing = Vectors { rays: Vec::new(), tests: Vec::new(), ..vectors.clone() };
    assert!(matches!(check(&nothing, &spec()), Err(CheckError::Nothing)));
    let mut small = BoardSpec { grid_log2: Some(7), ..spec() };
    small.dram.bytes = 4096;
    let e = check(&vectors, &small).unwrap_err();
    assert!(e.to_string().contains("patch memory"), "{e}");
    let no_patches = Vectors { patches: Vec::new(), tests: Vec::new(), ..vectors };
    let found = check(&no_patches, &spec()).unwrap();
    assert_eq!(found.n_rays, 3);
}
