//! Quantising: formats and margins first, then the surface offset as a property at several widths.

use proptest::prelude::*;
use rtl_model::datapath::ray_patch::intersect;

use super::*;

fn formats(f: u32, d: u32, t: u32) -> Formats {
    Formats { coord_frac_bits: f, dir_frac_bits: d, t_frac_bits: t, ..Formats::default() }
}

fn parallelogram(corner: DVec3, u: DVec3, v: DVec3) -> CastPatch {
    CastPatch { corners: [corner, corner + u, corner + u + v, corner + v], is_triangle: false }
}

fn vector(range: std::ops::Range<f64>) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(range).prop_map(DVec3::from_array)
}

fn quantizer(points: &[DVec3]) -> Quantizer {
    Quantizer::new(&Formats::default(), &[], points).unwrap()
}

#[test]
fn quantizer_of_a_scene_takes_the_smallest_power_of_two_that_leaves_room() {
    let q = quantizer(&[DVec3::ZERO, DVec3::new(3.9, 1.0, 1.0)]);
    assert_eq!(q.half_m(), 2.0);
    let q = quantizer(&[DVec3::ZERO, DVec3::new(4.0, 1.0, 1.0)]);
    assert_eq!(q.half_m(), 4.0, "a full cube leaves no room for lifted points");
}

#[test]
fn quantizer_of_a_scene_too_far_away_is_refused_with_its_place() {
    let far = DVec3::splat(1e12);
    let error = Quantizer::new(&Formats::default(), &[], &[far, far + DVec3::ONE]).unwrap_err();
    assert!(matches!(error, QuantizeError::TooFar { .. }), "{error}");
    let error = Quantizer::new(&Formats::default(), &[], &[]).unwrap_err();
    assert_eq!(error, QuantizeError::Empty);
    let error = Quantizer::new(&Formats::default(), &[], &[DVec3::NAN]).unwrap_err();
    assert!(matches!(error, QuantizeError::NotFinite { what: "point", index: 0, .. }), "{error}");
    let error = Quantizer::new(&formats(7, 8, 8), &[], &[DVec3::ZERO]).unwrap_err();
    assert!(matches!(error, QuantizeError::Format(_)), "{error}");
}

#[test]
fn point_outside_the_cube_has_no_words_and_its_ray_is_refused_with_index_and_place() {
    let q = quantizer(&[DVec3::ZERO, DVec3::ONE]);
    let outside = q.center() + DVec3::new(q.half_m(), 0.0, 0.0);
    assert_eq!(q.point(outside), None);
    assert!(q.point(q.center() - DVec3::new(q.half_m(), 0.0, 0.0)).is_some(), "-1 is a word");
    match q.ray(7, &Ray::unbounded(outside, DVec3::X)) {
        Err(CastError::BadRay { index: 7, what }) => assert!(what.contains("outside"), "{what}"),
        other => panic!("{other:?}"),
    }
    let targets = RayBundle::Targets { apex: DVec3::ZERO, points: vec![DVec3::ONE, outside] };
    assert!(matches!(q.bundle(4, &targets), Err(CastError::BadRay { index: 5, .. })));
    let same = RayBundle::Targets { apex: DVec3::ZERO, points: vec![DVec3::ONE, DVec3::ZERO] };
    assert!(matches!(q.bundle(4, &same), Err(CastError::BadRay { index: 5, .. })));
}

#[test]
fn ray_with_t_min_is_refused() {
    let q = quantizer(&[DVec3::ZERO, DVec3::ONE]);
    let ray = Ray { t_min: 0.5, ..Ray::unbounded(DVec3::ZERO, DVec3::X) };
    assert!(matches!(q.ray(3, &ray), Err(CastError::BadRay { index: 3, .. })));
}

#[test]
fn direction_that_would_round_to_one_is_halved_once_more() {
    assert_eq!(direction_words(DVec3::new(1.0 - 1e-9, 0.5, 0.0), 8), ([128, 64, 0], 1));
    assert_eq!(direction_words(DVec3::new(0.75, -0.25, 0.0), 8), ([192, -64, 0], 0));
    assert_eq!(direction_words(DVec3::new(3.0, 0.0, 2f64.powi(-7) * 1.5), 8).0, [192, 0, 1]);
    // Ties to even: 2.5 and 3.5 steps of the least bit.
    assert_eq!(direction_words(DVec3::new(0.5, 2.5 / 256.0, 3.5 / 256.0), 8).0, [128, 2, 4]);
}

#[test]
fn t_max_of_a_segment_is_exact_and_an_infinite_one_is_the_limit() {
    let q = quantizer(&[DVec3::ZERO, DVec3::new(1.5, 1.5, 1.5)]);
    assert_eq!(q.half_m(), 1.0);
    let ray = q.ray(0, &Ray::to_point(DVec3::ZERO, DVec3::new(0.75, 0.0, 0.0))).unwrap();
    assert_eq!((ray.words.dir[0], ray.words.t_max), (3 << 22, 1 << 24));
    let ray = q.ray(0, &Ray::unbounded(DVec3::ZERO, DVec3::X)).unwrap();
    assert_eq!(ray.words.t_max, Formats::default().t_limit());
    // dir 1e-3 long: one unit of host t is 1e-3 m; the hit comes back in host units.
    let ray = q.ray(0, &Ray::unbounded(DVec3::ZERO, DVec3::new(2f64.powi(-10), 0.0, 0.0))).unwrap();
    let hit = q.hit(&ray, HitWords { t: 1 << 24, patch: 3, facing: rtl_model::datapath::Facing::Back });
    assert_eq!(hit, RayHit { t: 512.0, patch: PatchId(3), facing: Facing::Back });
}

#[test]
fn tile_words_keep_every_direction_inside_the_format() {
    for (f, d) in [(24, 24), (8, 8), (12, 28)] {
        let q = Quantizer::new(&formats(f, d, 24), &[], &[DVec3::ZERO, DVec3::ONE]).unwrap();
        let tile = RayBundle::Tile {
            apex: DVec3::splat(0.5),
            corner: DVec3::new(-0.31, -0.31, 0.999_999_999),
            step_u: DVec3::new(0.077, 0.0, 1e-10),
            step_v: DVec3::new(0.0, 0.0771, 1e-10),
            n: 8,
            m: 8,
        };
        let words = q.bundle(0, &tile).unwrap();
        for i in 0..64 {
            let ray = words.ray(q.formats(), i);
            let (host, board) = (tile.ray(i).dir.normalize(), DVec3::from_array(ray.dir.map(f64::from)));
            let bound = 3f64.sqrt() * 2f64.powi(-(d as i32)) * 2.0;
            assert!((board.normalize() - host).length() <= bound, "ray {i} at D = {d}");
        }
    }
}

proptest! {
    #[test]
    fn default_width_through_the_fixed_crate_gives_the_words_of_the_run_time_path(x in -1.0..1.0f64) {
        prop_assert_eq!(coordinate_word(x, 24), coordinate_word_at_run_time(x, 24));
        prop_assert_eq!(direction_word(x, 24), direction_word_at_run_time(x, 24));
        let tie = ((x * 1e6).round() + 0.5) * 2f64.powi(-24);
        prop_assert_eq!(coordinate_word(tie, 24), coordinate_word_at_run_time(tie, 24));
    }

    #[test]
    fn dequantised_words_are_exact_points_within_half_a_step(
        a in vector(-100.0..100.0), b in vector(-100.0..100.0), w in 0.0..1.0f64, f in 8u32..=28
    ) {
        let q = Quantizer::new(&formats(f, 24, 24), &[], &[a, b]).unwrap();
        let p = a.lerp(b, w);
        let words = q.point(p).unwrap();
        let back = q.dequantize(words);
        let step = q.half_m() * 2f64.powi(-(f as i32));
        prop_assert!((back - p).abs().max_element() <= 0.5 * step * (1.0 + 1e-9));
        prop_assert_eq!(q.point(back), Some(words));
        prop_assert_eq!((back - q.center()) / step, DVec3::from_array(words.map(f64::from)));
    }
}

/// The widths at which the offset is tested.
const WIDTHS: [(u32, u32, u32); 6] =
    [(8, 8, 8), (8, 24, 24), (24, 8, 24), (24, 24, 8), (12, 10, 14), (24, 24, 24)];

#[derive(Clone, Debug)]
struct Scenario {
    patch: CastPatch,
    normal: DVec3,
    st: [f64; 2],
    other: DVec3,
    widths: (u32, u32, u32),
}

/// A parallelogram or triangle in a cube of 2 m, a place on it and a point on its front side.
fn scenario() -> impl Strategy<Value = Scenario> {
    let shapes = (vector(-0.4..0.4), vector(-0.5..0.5), vector(-0.5..0.5), any::<bool>());
    (shapes, 0.0..1.0f64, 0.0..1.0f64, vector(-1.0..1.0), 0..WIDTHS.len()).prop_filter_map(
        "a patch with an area, the other point in front",
        |((corner, u, v, is_triangle), s, t, other, widths)| {
            let normal = u.cross(v).try_normalize()?;
            let mut patch = parallelogram(corner, u, v);
            patch.is_triangle = is_triangle;
            let st = if is_triangle && s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] };
            let front = normal.dot(other - corner);
            let slender = u.length() * v.length() / u.cross(v).length();
            (front > 0.0 && slender < 50.0).then_some(Scenario {
                patch,
                normal,
                st,
                other,
                widths: WIDTHS[widths],
            })
        },
    )
}

impl Scenario {
    fn point(&self) -> DVec3 {
        let [v0, v1, v2, v3] = self.patch.corners;
        if self.patch.is_triangle {
            v0 + self.st[0] * (v1 - v0) + self.st[1] * (v2 - v0)
        } else {
            v0 + self.st[0] * (v1 - v0) + self.st[1] * (v3 - v0)
        }
    }

    fn quantizer(&self) -> Quantizer {
        let (f, d, t) = self.widths;
        let corners = [DVec3::splat(-1.0), DVec3::ONE];
        Quantizer::new(&formats(f, d, t), &[self.patch], &corners).unwrap()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn ray_that_leaves_a_surface_from_the_offset_upward_never_meets_it(s in scenario(), d in vector(-1.0..1.0)) {
        let q = s.quantizer();
        let d = if d.dot(s.normal) < 0.0 { -d } else { d };
        prop_assume!(d.length() > 1e-3);
        let ray = Ray::unbounded(s.point() + q.surface_offset_m() * s.normal, d);
        let words = q.ray(0, &ray).unwrap().words;
        prop_assert_eq!(intersect(q.formats(), &words, &q.patch(0, &s.patch).unwrap()), None);
    }

    #[test]
    fn shadow_ray_to_a_lifted_sample_is_never_blocked_by_its_emitter(s in scenario()) {
        let q = s.quantizer();
        let lift = q.surface_offset_m() * s.normal;
        prop_assume!(s.normal.dot(s.other - s.patch.corners[0]) > 2.0 * q.surface_offset_m());
        let patch = q.patch(0, &s.patch).unwrap();
        let ray = Ray::to_point(s.other, s.point() + lift);
        let words = q.ray(0, &ray).unwrap().words;
        prop_assert_eq!(intersect(q.formats(), &words, &patch), None);

        let [v0, v1, _, v3] = s.patch.corners;
        let (n, m) = (3, 4);
        let fan = RayBundle::Fan {
            apex: s.other, corner: v0 + lift, edge_u: v1 - v0, edge_v: v3 - v0, n, m, jitter: s.st,
        };
        let targets = RayBundle::Targets { apex: s.other, points: vec![s.point() + lift] };
        for bundle in [fan, targets] {
            let words = q.bundle(0, &bundle).unwrap();
            for i in 0..words.n_rays() {
                prop_assert_eq!(intersect(q.formats(), &words.ray(q.formats(), i), &patch), None, "ray {}", i);
            }
        }
    }

    #[test]
    fn wall_of_the_stated_thickness_stops_every_ray_from_points_lifted_off_its_front(
        normal in vector(-1.0..1.0), center in vector(-0.1..0.1), place in prop::array::uniform2(-0.1..0.1f64),
        tilt in prop::array::uniform2(-0.7..0.7f64), widths in 0..WIDTHS.len(),
    ) {
        prop_assume!(normal.length() > 1e-3);
        let n = normal.normalize();
        let (t1, t2) = crate::geom::tangent_frame(n);
        let face = |c: DVec3| parallelogram(c - 0.5 * (t1 + t2), t1, t2);
        let (f, d, t) = WIDTHS[widths];
        let cube = [DVec3::splat(-1.0), DVec3::ONE];
        let q = Quantizer::new(&formats(f, d, t), &[], &cube).unwrap();
        // The back face stands behind the front; rays downward from lifted points meet the front first.
        let (front, back) = (face(center), face(center - q.wall_thickness_m() * n));
        let origin = center + place[0] * t1 + place[1] * t2 + q.surface_offset_m() * n;
        let words = q.ray(0, &Ray::unbounded(origin, tilt[0] * t1 + tilt[1] * t2 - n)).unwrap().words;
        let hits = [front, back].map(|p| intersect(q.formats(), &words, &q.patch(0, &p).unwrap()));
        let [Some(front), Some(back)] = hits else { panic!("{hits:?}") };
        prop_assert!(front.t < back.t);
    }
}

#[test]
fn bundle_with_ends_on_the_apex_word_becomes_rays_of_one_step_toward_them() {
    let q = Quantizer::new(&formats(8, 16, 16), &[], &[DVec3::splat(-0.9), DVec3::splat(0.9)]).unwrap();
    let step = q.half_m() / 256.0;
    let apex = q.dequantize([10, -20, 30]);
    let near = [DVec3::new(0.1, -0.3, 0.2), DVec3::new(0.4, 0.1, -0.2)].map(|part| apex + step * part);
    let targets = RayBundle::Targets { apex, points: vec![near[0], near[1], apex + DVec3::X * 0.5] };
    let BundleWords::Targets { points, .. } = q.bundle(0, &targets).unwrap() else { panic!("targets") };
    assert_eq!(points[..2], [[10, -21, 30], [11, -20, 30]]);
    // A fan over those places, 2 x 1 strata: its samples are listed instead.
    let edge_u = near[1] - near[0];
    let fan =
        RayBundle::Fan { apex, corner: near[0], edge_u, edge_v: DVec3::ZERO, n: 2, m: 1, jitter: [0.0; 2] };
    let words = q.bundle(0, &fan).unwrap();
    assert_eq!(words.validate(q.formats()), Ok(()));
    assert!(matches!(&words, BundleWords::Targets { points, .. } if points[0] == [10, -21, 30]), "{words:?}");
    // Farther away a fan stays one.
    let corner = apex + DVec3::X * 0.2;
    let fan = RayBundle::Fan { apex, corner, edge_u, edge_v: DVec3::Y * 0.1, n: 2, m: 2, jitter: [0.5; 2] };
    assert!(matches!(q.bundle(0, &fan).unwrap(), BundleWords::Fan { .. }));
}
