//! The film loop over a shader that is a function of the ray: regions, orders and ends give the same bits.

use std::path::PathBuf;

use glam::DVec3;

use super::*;
use crate::raycast::null::NullCaster;
use crate::scene::{Material, MaterialId, Meshing, Shape, Surface};
use crate::units::Radiance;

/// A scene that no ray of a [`NullCaster`] meets.
fn scene() -> Scene {
    let material = Material {
        name: "grey".to_owned(),
        reflectance: Rgb::splat(0.5),
        specular: Rgb::BLACK,
        transmission: Rgb::BLACK,
        ior: 1.0,
    };
    let surface = Surface {
        name: "floor".to_owned(),
        material: MaterialId(0),
        shape: Shape::Triangle([DVec3::ZERO, DVec3::X, DVec3::Y]),
        two_sided: false,
        smooth_group: 0,
        exitance: Rgb::BLACK,
    };
    Scene {
        path: PathBuf::new(),
        camera: None,
        materials: vec![material],
        surfaces: vec![surface],
        lights: Vec::new(),
        continuity: Vec::new(),
        meshing: Meshing::default(),
        warnings: Vec::new(),
    }
}

/// Light from beyond: a bright band with slanted edges, an emitter, and noise by the ray's key on one side.
struct Sky {
    noise: f64,
}

impl Shader for Sky {
    fn see(
        &mut self,
        _: &mut dyn RayCaster,
        rays: &[CameraRay],
        _: Vec<Option<RayHit>>,
    ) -> Result<Vec<Seen>, CastError> {
        let seen = |ray: &CameraRay| {
            let d = ray.ray.dir;
            let band = if (d.x + 0.3 * d.y).abs() < 0.2 { 0.8 } else { 0.1 };
            let noise = if d.y > 0.0 { self.noise * crate::sampling::unit_pair(ray.key())[0] } else { 0.0 };
            Seen {
                radiance: Radiance(Rgb([band + noise, band, 0.2 + noise])),
                emits: d.y > 0.3 && d.x > 0.3,
                irradiance: Some(Rgb::splat(d.x + 2.0)),
                ..Seen::default()
            }
        };
        Ok(rays.iter().map(seen).collect())
    }
}

fn camera() -> Camera {
    Camera { eye: DVec3::ZERO, target: DVec3::NEG_Z, up: DVec3::Y, fov_y_deg: 60.0 }
}

/// The picture, ended before wave `end`.
fn ended(options: &RenderOptions, end: usize) -> Rendering {
    let scene = scene();
    let mesh = Mesh::build(&scene);
    let (mut waves, mut last) = (0, 0.0);
    let film = FilmLoop {
        scene: &scene,
        mesh: &mesh,
        camera: &camera(),
        options,
        shader: &mut Sky { noise: 0.2 },
        stop: &mut || {
            waves += 1;
            waves > end
        },
        progress: &mut |done| {
            assert!(done > last && done <= 1.0, "{done} after {last}");
            last = done;
        },
    };
    let picture = film.run(&mut NullCaster).unwrap();
    assert!((picture.done - last).abs() < 1e-12, "{} done, {last} told", picture.done);
    picture
}

fn rendered(options: &RenderOptions) -> Rendering {
    ended(options, usize::MAX)
}

fn options(samples: u32, max: u32, filter: Filter) -> RenderOptions {
    let exposure = Exposure::Auto;
    RenderOptions {
        width: 45,
        height: 38,
        samples,
        filter,
        irradiance: true,
        adaptive: (max > samples).then_some(AdaptiveSampling { max, contrast: 0.05, exposure }),
        ..RenderOptions::default()
    }
}

const FILTERS: [Filter; 4] = [Filter::Box, Filter::Tent, Filter::Gaussian, Filter::Mitchell];

#[test]
fn any_region_has_the_bits_of_the_whole_picture_filter_margins_and_adaptive_rays_included() {
    let regions =
        [[0, 0, 45, 38], [0, 0, 1, 1], [44, 37, 1, 1], [9, 7, 8, 17], [16, 16, 8, 8], [13, 0, 20, 3]];
    for filter in FILTERS {
        for (min, max) in [(1, 1), (3, 3), (1, 16), (2, 7)] {
            let whole = rendered(&options(min, max, filter));
            for [x, y, width, height] in regions {
                let region = Region { x, y, width, height };
                let part = rendered(&RenderOptions { region: Some(region), ..options(min, max, filter) });
                assert_eq!((part.film.width, part.film.height), (width as usize, height as usize));
                assert!(part.n_camera_rays <= whole.n_camera_rays);
                for i in 0..region.n_pixels() {
                    let (px, py) = region.pixel(i);
                    let of = (py * 45 + px) as usize;
                    let told = format!("{filter:?} {min}..{max} {region:?} at {px}, {py}");
                    assert_eq!(part.film.pixels[i], whole.film.pixels[of], "{told}");
                    assert_eq!(part.film.emitter[i], whole.film.emitter[of], "{told}");
                    assert_eq!(part.rays_per_pixel[i], whole.rays_per_pixel[of], "{told}");
                    let e = |picture: &Rendering, i: usize| picture.irradiance.as_ref().unwrap()[i];
                    assert_eq!(e(&part, i), e(&whole, of), "{told}");
                }
            }
        }
    }
}

#[test]
fn small_region_costs_a_small_part_of_the_rays() {
    let region = Some(Region { x: 16, y: 16, width: 8, height: 8 });
    let part = rendered(&RenderOptions { region, ..options(4, 4, Filter::Box) });
    assert_eq!(part.n_camera_rays, 4 * 64);
}

#[test]
fn coarse_first_gives_the_same_bits_and_its_first_waves_a_whole_picture() {
    for filter in FILTERS {
        for (min, max) in [(5, 5), (2, 16)] {
            let plain = options(min, max, filter);
            let coarse = RenderOptions { coarse_first: true, width: 150, height: 140, ..plain.clone() };
            let fine = RenderOptions { coarse_first: false, ..coarse.clone() };
            let (coarse_picture, fine_picture) = (rendered(&coarse), rendered(&fine));
            assert_eq!(coarse_picture.film, fine_picture.film);
            assert_eq!(coarse_picture.rays_per_pixel, fine_picture.rays_per_pixel);
            // 342 tiles are two bands.
            let after_two = ended(&coarse, 2);
            assert!(after_two.rays_per_pixel.iter().all(|n| *n == 1));
            assert_eq!(after_two.n_unrendered_pixels(), 0);
            let after_two = ended(&fine, 2);
            assert!(after_two.n_unrendered_pixels() > 0 && after_two.rays_per_pixel.contains(&2));
        }
    }
}

#[test]
fn stopped_picture_shows_what_it_has_and_says_how_much_of_the_work_that_is() {
    let of = RenderOptions { coarse_first: true, width: 150, height: 140, ..options(4, 4, Filter::Tent) };
    let none = ended(&of, 0);
    assert_eq!((none.done, none.n_unrendered_pixels(), none.n_camera_rays), (0.0, 150 * 140, 0));
    assert!(none.film.pixels.iter().all(|p| p.is_black()));
    let some = ended(&of, 5);
    assert!((some.done - 5.0 / 8.0).abs() < 1e-12);
    assert!(some.rays_per_pixel.iter().all(|n| [2, 3].contains(n)));
    assert!(some.film.pixels.iter().all(|p| p.0[1] > 0.05), "no pixel is black or dimmed");
    let one_band = ended(&of, 1);
    let black = one_band.film.pixels.iter().filter(|p| p.is_black()).count() as u64;
    assert_eq!(black, one_band.n_unrendered_pixels());
    assert!(black > 0);
}

#[test]
fn adaptive_rays_go_to_edges_and_noise_only_and_end_between_min_and_max() {
    let picture = rendered(&options(1, 16, Filter::Box));
    let count = |x: usize, y: usize| picture.rays_per_pixel[y * 45 + x];
    assert!(picture.rays_per_pixel.iter().all(|n| (1..=16).contains(n)));
    let edges = picture.rays_per_pixel.iter().filter(|n| **n == 16).count();
    assert!(edges > 30, "{edges} pixels at an edge");
    // The lower right is flat: y from -0.2 down, right of the band.
    assert!((24..38).all(|y| (36..45).all(|x| count(x, y) == 1)));
    let mean = picture.mean_rays_per_pixel();
    assert!(mean > 1.2 && mean < 9.0, "{mean}");
    let rays: u64 = picture.rays_per_pixel.iter().map(|n| u64::from(*n)).sum();
    let look = 32 * (38 * 32 / 45);
    assert_eq!(picture.n_camera_rays, rays + look, "and a look to find the exposure");
}

#[test]
fn adaptive_sampling_up_to_the_least_is_none_and_a_threshold_of_one_casts_edges_of_the_scene_only() {
    let fixed = rendered(&options(3, 3, Filter::Box));
    let adaptive = Some(AdaptiveSampling::up_to(3));
    let same = rendered(&RenderOptions { adaptive, ..options(3, 3, Filter::Box) });
    assert_eq!((fixed.film, fixed.n_camera_rays), (same.film, same.n_camera_rays));
    let exposure = Exposure::Ev(0.0);
    let adaptive = Some(AdaptiveSampling { max: 16, contrast: 1.0, exposure });
    let blind = rendered(&RenderOptions { adaptive, ..options(1, 1, Filter::Box) });
    let emitters = blind.rays_per_pixel.iter().filter(|n| **n > 1).count();
    assert_eq!(emitters, 0, "nothing is met, so there are no edges");
}

#[test]
fn rounds_go_to_four_then_double_up_to_the_most() {
    assert_eq!(rounds(1, 16), [1..4, 4..8, 8..16]);
    assert_eq!(rounds(3, 16), [3..6, 6..12, 12..16]);
    assert_eq!(rounds(1, 2), [1..2]);
    assert_eq!(rounds(8, 16), [8..16]);
    assert!(rounds(5, 5).is_empty());
}

#[test]
#[should_panic(expected = "region 40,0,10,10")]
fn region_outside_of_the_picture_is_our_own_fault_here() {
    let scene = scene();
    let mesh = Mesh::build(&scene);
    let solution = crate::radiosity::Solution::dark(&mesh);
    let region = Some(Region { x: 40, y: 0, width: 10, height: 10 });
    let options = RenderOptions { region, ..options(1, 1, Filter::Box) };
    let _ =
        crate::render::render(&scene, &camera(), &mesh, &solution, &mut NullCaster, &options, &mut |_| {});
}
