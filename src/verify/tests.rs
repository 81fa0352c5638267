//! Verifying rays in all kinds of bundles over random scenes, where nothing may be found; quotas.

use proptest::prelude::*;
use rtl_model::board::Board;
use rtl_model::fixed::Rounding;
use rtl_model::memory_image::MemoryImage;
use rtl_model::spec::BoardSpec;

use super::run::verify_subject;
use super::subject::{Real, Subject};
use super::*;
use crate::geom::{DVec3, Ray};
use crate::raycast::RayBundle;
use crate::raycast::functional::FunctionalCaster;
use crate::raycast::null::NullCaster;
use crate::raycast::recording::RecordedGroup;
use crate::raycast::recording::RecordingCaster;
use crate::raycast::{CastPatch, Query, RayCaster};
use crate::report::Timings;
use crate::sampling::{hash, unit_pair};

#[path = "fault_tests.rs"]
mod faults;

/// Numbers in [0, 1) in a row.
struct Random {
    seed: u64,
    n: u64,
}

impl Random {
    fn unit(&mut self) -> f64 {
        self.n += 1;
        unit_pair(hash(self.seed, 17, self.n))[0]
    }

    fn point(&mut self, size: f64) -> DVec3 {
        let mut word = || size * (2.0 * self.unit() - 1.0);
        DVec3::new(word(), word(), word())
    }
}

/// Patches of all sizes: triangles, parallelograms and bent quads, some of which share edges or planes.
fn patches(random: &mut Random, n: usize) -> Vec<CastPatch> {
    let mut patches: Vec<CastPatch> = Vec::new();
    for i in 0..n {
        let size = 0.4 * random.unit() * random.unit();
        let (corner, u, v) = (random.point(0.5), random.point(size), random.point(size));
        let bend = if i % 3 == 0 { random.point(0.2 * size) } else { DVec3::ZERO };
        let mut corners = [corner, corner + u, corner + u + v + bend, corner + v];
        if let (Some(last), 1) = (patches.last(), i % 4) {
            // A neighbour across an edge of the last one.
            (corners[0], corners[1]) = (last.corners[1], last.corners[0]);
        }
        let is_triangle = i % 2 == 0;
        if is_triangle {
            corners[3] = corners[2];
        }
        patches.push(CastPatch { corners, is_triangle });
    }
    patches
}

/// A bundle of each kind.
fn bundles(random: &mut Random) -> Vec<RayBundle> {
    let apex = random.point(0.8);
    let jitter = [random.unit(), random.unit()];
    let (corner, edge_u, edge_v) = (random.point(0.4), random.point(0.2), random.point(0.2));
    let away = |p: DVec3| if (p - apex).length() < 0.1 { apex + DVec3::splat(0.1) } else { p };
    vec![
        RayBundle::Tile {
            apex,
            corner: random.point(1.0),
            step_u: random.point(0.1),
            step_v: random.point(0.3),
            n: 5,
            m: 3,
        },
        RayBundle::Fan { apex: DVec3::splat(-0.7), corner, edge_u, edge_v, n: 4, m: 3, jitter },
        RayBundle::Hemisphere {
            apex,
            normal: random.point(1.0).normalize(),
            spin: 6.0 * random.unit(),
            n: 5,
            m: 4,
            jitter,
        },
        RayBundle::Targets { apex, points: (0..7).map(|_| away(random.point(0.8))).collect() },
    ]
}

fn explicit(random: &mut Random, n: usize) -> Vec<Ray> {
    let ray = |i| {
        let ray = Ray::unbounded(random.point(0.8), random.point(2.0));
        if i % 2 == 0 { ray } else { Ray { t_max: random.unit(), ..ray } }
    };
    (0..n).map(ray).collect()
}

/// A scene on a board, with rays.
struct Fixture {
    patches: Vec<CastPatch>,
    spec: BoardSpec,
    caster: FunctionalCaster,
    workload: Vec<(PurposeRays, Vec<RecordedGroup>)>,
}

fn formats(f: u32, d: u32, t: u32) -> Formats {
    Formats { coord_frac_bits: f, dir_frac_bits: d, t_frac_bits: t, ..Formats::default() }
}

fn fixture(seed: u64, formats: Formats, n_patches: usize, n_rounds: usize) -> Fixture {
    let mut random = Random { seed, n: 0 };
    let patches = patches(&mut random, n_patches);
    let spec = BoardSpec { formats, grid_log2: Some(3), ..BoardSpec::preset("minimal").unwrap() };
    let corners = [DVec3::splat(-0.9), DVec3::splat(0.9)];
    let caster = FunctionalCaster::new(&formats, spec.grid_log2, &patches, &corners).unwrap();
    let mut inner = NullCaster;
    let mut recorder = RecordingCaster::new(&mut inner, 0.0, u64::MAX);
    for _ in 0..n_rounds {
        let (nearest, any) = (bundles(&mut random), bundles(&mut random));
        recorder.closest_hits(Purpose::Primary, Query::Bundles(&nearest)).unwrap();
        recorder.any_hits(Purpose::Shadow, Query::Bundles(&any)).unwrap();
        let rays = explicit(&mut random, 30);
        recorder.closest_hits(Purpose::Specular, Query::Rays(&rays)).unwrap();
        recorder.any_hits(Purpose::FormFactor, Query::Rays(&rays)).unwrap();
    }
    let workload = chosen(recorder.into_recordings(), u64::MAX);
    Fixture { patches, spec, caster, workload }
}

fn options(n_clocked: u64) -> VerifyOptions {
    VerifyOptions {
        n_rays: u64::MAX,
        n_clocked,
        first_test_bits: vec![8, 12],
        solve: SolveOptions::default(),
        picture: RenderOptions::default(),
        compare_image: false,
    }
}

impl Fixture {
    fn image(&self) -> &MemoryImage {
        self.caster.image()
    }

    fn verify(&self, subject: &impl Subject, n_clocked: u64) -> Verification {
        let board = Board::new(&self.spec, self.image().clone()).unwrap();
        let (patches, quantizer) = (&self.patches, self.caster.quantizer());
        let case = Case { patches, quantizer, board, workload: self.workload.clone() };
        let mut told = Vec::new();
        let verification =
            verify_subject(subject, case, &options(n_clocked), &mut Timings::default(), &mut |share| {
                told.push(share)
            });
        assert!(told.is_sorted() && told.last() == Some(&1.0), "{told:?}");
        verification.unwrap()
    }

    /// All verified rays, in order: purpose, mode, words.
    fn rays(&self) -> Vec<(Purpose, bool, RayWords)> {
        let real = Real { image: self.image() };
        let rays = rays::quantise(self.caster.quantizer(), self.workload.clone(), &real).unwrap();
        let of = |g: &rays::Group| {
            let words = rays.of(g).iter().map(|r| (g.purpose, g.any_hit, r.words));
            words.collect::<Vec<_>>()
        };
        rays.groups.iter().flat_map(of).collect()
    }
}

/// Narrow and wide words, each format alone narrow, rounded products.
fn widths() -> impl Strategy<Value = Formats> {
    let full = prop_oneof![
        Just(formats(24, 24, 24)),
        Just(formats(8, 8, 8)),
        Just(formats(28, 8, 32)),
        Just(formats(8, 28, 24)),
        Just(formats(24, 24, 8)),
        (10u32..=28, 10u32..=28, 10u32..=32).prop_map(|(f, d, t)| formats(f, d, t)),
    ];
    let rounding = prop_oneof![
        2 => Just(Rounding::NearestEven),
        1 => Just(Rounding::HalfAway),
        1 => Just(Rounding::Floor)
    ];
    (full, rounding, prop_oneof![3 => Just(None), 1 => (0u32..12).prop_map(Some)]).prop_map(
        |(formats, rounding, drop)| {
            let cross_keep_bits = drop.map(|drop| 2 * formats.coord_frac_bits - drop);
            Formats { rounding, cross_keep_bits, ..formats }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn verify_of_random_scenes_finds_no_mismatch_explains_every_difference_and_keeps_the_bound_of_t(
        seed in any::<u64>(), formats in widths()
    ) {
        let rounded = formats.cross_drop() > 0;
        let fixture = fixture(seed, formats, 60, 6);
        let found = fixture.verify(&Real { image: fixture.image() }, 0);
        prop_assert_eq!(found.n_mismatches, 0, "{:?}", found.first_mismatch);
        prop_assert_eq!(found.misclassified.unexplained, 0, "{:?}", found.first_unexplained);
        prop_assert!(found.t_error.max_of_bound.is_none_or(|share| share <= 1.0), "{:?}", found.t_error);
        prop_assert!(rounded || found.t_error.n_bounded > 0, "{:?}", found.t_error);
        prop_assert_eq!(found.oracle_scope == OracleScope::TestedPatches, rounded);
        let by_purpose: u64 = found.misclassified_by_purpose.iter().map(|(_, m)| m.total()).sum();
        prop_assert_eq!(by_purpose, found.misclassified.total());
        prop_assert!(found.t_error.n > 0 && found.n_wire_tests > 0);
        prop_assert!(found.passed() && found.n_rays() == 6 * (2 * (15 + 12 + 20 + 7) + 60));
        for wire in &found.wires {
            prop_assert!(wire.seen.is_some() == wire.observed && wire.seen <= Some(wire.max_magnitude), "{:?}", wire);
        }
        for share in &found.first_test {
            prop_assert_eq!(share.saved + share.inside + share.undecided, share.tests);
            prop_assert_eq!((share.tests, share.wrong), (found.n_wire_tests, 0));
        }
    }
}

#[test]
fn verify_at_wide_and_narrow_words_misclassifies_more_at_narrow_ones() {
    let share = |bits| {
        let fixture = fixture(7, formats(bits, bits, bits), 100, 20);
        let found = fixture.verify(&Real { image: fixture.image() }, 0);
        assert!(found.t_error.median_steps > 0.0 && found.t_error.max_of_bound > Some(0.05));
        let m = found.misclassified;
        m.edge + m.depth_tie + m.t_step
    };
    let (narrow, wide) = (share(8), share(24));
    assert!(narrow > 10 && wide == 0, "{narrow} at 8 bits, {wide} at 24");
}

#[test]
fn verify_with_part_of_the_rays_on_the_clocked_board_finds_no_mismatch() {
    let fixture = fixture(3, Formats::default(), 40, 3);
    let found = fixture.verify(&Real { image: fixture.image() }, 150);
    assert_eq!(found.n_mismatches, 0, "{:?}", found.first_mismatch);
    assert!((150..400).contains(&found.n_clocked), "{}", found.n_clocked);
    assert_eq!(found.oracle_scope, OracleScope::AllPatches);
    assert_eq!(fixture.verify(&Real { image: fixture.image() }, 0).n_clocked, 0);
}

#[test]
fn quotas_are_equal_and_what_one_cannot_use_goes_to_the_others() {
    assert_eq!(quotas(90, &[100, 100, 100]), [30, 30, 30]);
    assert_eq!(quotas(90, &[10, 100, 100]), [10, 40, 40]);
    assert_eq!(quotas(90, &[100, 10, 20]), [60, 10, 20]);
    assert_eq!(quotas(90, &[20, 10, 30]), [20, 10, 30]);
    assert_eq!(quotas(2, &[9, 9, 9]).iter().sum::<u64>(), 2);
    assert!(quotas(5, &[]).is_empty());
}
