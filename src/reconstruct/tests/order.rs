//! How fast errors fall, and on what kind of light.

use std::f64::consts::PI;

use super::*;

/// L2 error over the surface by a 5 x 5 midpoint rule in each element.
fn l2(mesh: &Mesh, r: &Reconstruction, f: &dyn Fn(DVec3) -> f64) -> f64 {
    let mut sum = 0.0;
    for (e, element) in mesh.elements.iter().enumerate() {
        for k in 0..25 {
            let st = DVec2::new(0.1 + 0.2 * f64::from(k % 5), 0.1 + 0.2 * f64::from(k / 5));
            let at = SurfacePoint { element: ElementId(e as u32), st };
            let error = r.evaluate_unclamped(mesh, at).0[0] - f(mesh.position(at));
            sum += error * error * element.area_m2 / 25.0;
        }
    }
    sum.sqrt()
}

fn wave(x: f64, y: f64) -> (f64, [f64; 2], [f64; 3]) {
    let (a, b) = (PI, 1.5 * PI);
    let ((s, c), (t, d)) = ((a * x + 0.3).sin_cos(), (b * y).sin_cos());
    (2.0 + s * d, [a * c * d, -b * s * t], [-a * a * s * d, -a * b * c * t, -b * b * s * d])
}

/// Slope of a straight line through log(error) over log(n), n = 8, 16, 32, 64.
fn order(make: impl Fn(&Mesh) -> Reconstruction) -> f64 {
    let errors = [8, 16, 32, 64].map(|n| {
        let mesh = square(n);
        l2(&mesh, &make(&mesh), &|x| wave(x.x, x.y).0).log2()
    });
    (3.0 * (errors[0] - errors[3]) + (errors[1] - errors[2])) / 10.0
}

#[test]
fn l2_error_of_a_smooth_field_falls_with_the_order_of_the_method() {
    let f = |x: DVec3| wave(x.x, x.y).0;
    let fitted = |method: Method| order(|mesh| sampled(mesh, method, &f));
    let (constant, bilinear) = (fitted(Method::Constant), fitted(Method::Bilinear));
    assert!((constant - 1.0).abs() < 0.1, "constant {constant}");
    assert!((bilinear - 2.0).abs() < 0.1, "bilinear {bilinear}");
    for method in SMOOTH {
        let fitted = fitted(method);
        println!("{}: order {fitted:.3} with least-squares gradients", method.name());
        assert!(fitted >= 2.8, "{method:?} {fitted}");
    }
}

#[test]
fn l2_error_of_hermite_from_given_gradients_falls_with_order_four() {
    for (second, twists) in [(true, TwistRule::Fit), (false, TwistRule::Adini)] {
        let options = ReconstructOptions { twists, ..Method::Hermite.into() };
        let given = order(|mesh| known(mesh, options, &wave, second));
        println!("hermite: order {given:.3} with given gradients, Hessians given: {second}");
        assert!(given >= 3.8, "{given}");
    }
}

#[test]
fn hermite_beats_bilinear_on_the_light_of_a_square_lamp() {
    let mesh = square(8);
    let error = |method: Method| l2(&mesh, &sampled(&mesh, method, &below_a_lamp), &below_a_lamp);
    let (bilinear, hermite) = (error(Method::Bilinear), error(Method::Hermite));
    assert!(hermite < 0.2 * bilinear, "{hermite} vs {bilinear}");
}

#[test]
fn hermite_on_a_sphere_beats_bilinear_and_meets_across_the_seam() {
    let mesh = mesh_of([Shape::Sphere { center: DVec3::ZERO, radius: 1.0, inward: false }], 100);
    let f = |x: DVec3| 2.0 + x.normalize().dot(v(0.6, -0.48, 0.64));
    let (bilinear, hermite) = (worst(&mesh, Method::Bilinear, &f), worst(&mesh, Method::Hermite, &f));
    assert!(hermite < 0.2 * bilinear, "{hermite} vs {bilinear}");
}
