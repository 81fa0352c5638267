//! The limiter: nothing overshoots at kinks, and smooth light is left alone.

use proptest::prelude::*;

use super::*;

/// Grey, so that luminance's factor is every channel's.
fn grey(mesh: &Mesh, f: &dyn Fn(DVec3) -> f64) -> Vec<Rgb> {
    mesh.vertices.iter().map(|v| Rgb::splat(f(v.position))).collect()
}

/// Furthest that elements are outside the values of their own corners, and the furthest outside 0..1.
fn overshoot(mesh: &Mesh, r: &Reconstruction, of: impl Fn(ElementId) -> bool) -> (f64, f64) {
    let (mut own, mut unit) = (0.0_f64, 0.0_f64);
    for (e, element) in (0..).map(ElementId).zip(&mesh.elements).filter(|(e, _)| of(*e)) {
        let n = element.corners.vertices().len();
        // Those of hanging vertices are not the measured ones.
        let corners = (0..n).map(|k| r.evaluate_unclamped(mesh, on_edge(mesh, (e, k), 0.0)).0[0]);
        let (low, high) = (corners.clone().fold(f64::MAX, f64::min), corners.fold(f64::MIN, f64::max));
        for k in 0..11 * 11 {
            let (s, t) = (f64::from(k % 11) / 10.0, f64::from(k / 11) / 10.0);
            if matches!(element.corners, Corners::Triangle(_)) && s + t > 1.0 {
                continue;
            }
            let at = SurfacePoint { element: e, st: DVec2::new(s, t) };
            let value = r.evaluate_unclamped(mesh, at).0[0];
            own = own.max(value - high).max(low - value);
            unit = unit.max(value - 1.0).max(-value);
        }
    }
    (own, unit)
}

fn triangles() -> Mesh {
    let (a, b, c, d) = (v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.));
    mesh_of([Shape::Triangle([a, b, c]), Shape::Triangle([a, c, d])], 128)
}

#[test]
fn a_step_overshoots_unlimited_and_not_limited() {
    let step = |x: DVec3| if x.x > 0.45 { 1.0 } else { 0.0 };
    for mesh in [square(8), triangles()] {
        let values = grey(&mesh, &step);
        let of = |method: Method| Reconstruction::new(&mesh, method, &values, &[]);
        let unlimited = overshoot(&mesh, &of(Method::Hermite), |_| true).1;
        assert!(unlimited > 0.05, "{unlimited}");
        let limited = of(Method::HermiteLimited);
        assert!(overshoot(&mesh, &limited, |_| true).1 < 1e-12);
        assert!(limited.limited_vertices() > 0);
        assert!(limited.limited().is_sorted());
        // Only near the step.
        for v in limited.limited() {
            assert!((mesh.vertices[v.0 as usize].position.x - 0.45).abs() < 0.3);
        }
    }
    // The design's figure for a unit step on a grid of quads.
    let mesh = square(8);
    let values = grey(&mesh, &step);
    let r = Reconstruction::new(&mesh, Method::Hermite, &values, &[]);
    let extremes = |pick: fn(f64, f64) -> f64, start: f64| {
        let row = mesh.elements.len() as u32;
        (0..row)
            .flat_map(|e| (0..=200).map(move |k| (e, f64::from(k) / 200.0)))
            .map(|(e, s)| SurfacePoint { element: ElementId(e), st: DVec2::new(s, 0.5) })
            .map(|at| r.evaluate_unclamped(&mesh, at).0[0])
            .fold(start, pick)
    };
    let (low, high) = (extremes(f64::min, 1.0), extremes(f64::max, 0.0));
    assert!((low + 0.074).abs() < 5e-4 && (high - 1.074).abs() < 5e-4, "{low} {high}");
}

#[test]
fn a_curved_shadow_edge_does_not_overshoot_when_limited() {
    for n in [8, 16, 23] {
        let mesh = square(n);
        let lit = |x: DVec3| if (x - v(0.1, 0.2, 0.)).length() > 0.55 { 0.8 - 0.2 * x.x } else { 0.02 };
        let values = grey(&mesh, &lit);
        let limited = Reconstruction::new(&mesh, Method::HermiteLimited, &values, &[]);
        let range = |r: &Reconstruction| {
            places(&mesh)
                .into_iter()
                .map(|at| r.evaluate_unclamped(&mesh, at).0[0])
                .fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)))
        };
        let (low, high) = range(&limited);
        assert!(low >= 0.02 - 1e-12 && high <= 0.8 + 1e-12, "{n}: {low} {high}");
        let unlimited = range(&Reconstruction::new(&mesh, Method::Hermite, &values, &[]));
        assert!(unlimited.0 < 0.0, "{unlimited:?}");
    }
}

#[test]
fn smooth_light_is_not_limited() {
    for n in [8, 16, 32] {
        for mesh in [
            square(n),
            mesh_of([Shape::Quad([v(0., 0., 0.), v(1., 0.2, 0.), v(1.7, 1.0, 0.), v(0.7, 0.8, 0.)])], n * n),
        ] {
            let smooth: [&dyn Fn(DVec3) -> f64; 3] = [
                &below_a_lamp,
                &|x| 2.0 + (3.0 * x.x).sin() * (2.0 * x.y).cos(),
                // An inflection, at which the second difference is next to nothing.
                &|x| 1.0 + (6.0 * (x.x - 0.5)).tanh(),
            ];
            for (k, f) in smooth.into_iter().enumerate() {
                let r = Reconstruction::new(&mesh, Method::HermiteLimited, &grey(&mesh, f), &[]);
                assert_eq!(r.limited_vertices(), 0, "field {k} on {n} x {n}");
            }
        }
    }
}

#[test]
fn a_step_across_hanging_vertices_does_not_overshoot_when_limited() {
    let quad = Shape::Quad([v(0., 0., 0.), v(1., 0., 0.), v(1., 1., 0.), v(0., 1., 0.)]);
    for seed in 0..12 {
        let mesh = refined(smooth([quad.clone()]), 64, seed);
        let lit = |x: DVec3| if (x - v(0.1, 0.2, 0.)).length() > 0.55 { 1.0 } else { 0.0 };
        let values = grey(&mesh, &lit);
        let of = |method: Method| {
            let r = Reconstruction::new(&mesh, method, &values, &[]);
            assert!(largest_gap(&mesh, &r) < 1e-12);
            overshoot(&mesh, &r, |_| true).1
        };
        let (limited, unlimited) = (of(Method::HermiteLimited), of(Method::Hermite));
        assert!(limited < 1e-12 && unlimited > 0.05, "{seed}: {limited:e} {unlimited}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn limited_elements_stay_between_their_corners_on_monotone_data(
        rises in prop::collection::vec((0..4u8, 0.0..1.0f64), 32), triangular: bool, n in 4..12u32
    ) {
        // Rises along x and along y; three in four are small, so that there are kinks.
        let mesh = if triangular { triangles() } else { square(n) };
        let rise = |(kind, size): (u8, f64)| if kind == 0 { size } else { 0.001 * size };
        let climbed = |along: f64, rises: &[(u8, f64)]| -> f64 {
            rises.iter().zip(0..).filter(|(_, k)| f64::from(*k) / 16.0 < along).map(|(r, _)| rise(*r)).sum()
        };
        let f = |x: DVec3| climbed(x.x, &rises[..16]) + climbed(x.y, &rises[16..]);
        let values = grey(&mesh, &f);
        let r = Reconstruction::new(&mesh, Method::HermiteLimited, &values, &[]);
        let touched = |e: ElementId| {
            mesh.elements[e.0 as usize].corners.vertices().iter().all(|v| r.limited().contains(v))
        };
        let (own, _) = overshoot(&mesh, &r, touched);
        prop_assert!(own < 1e-11, "{}", own);
    }
}
