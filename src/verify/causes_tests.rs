//! Causes one by one, on scenes where the answer is known.

use rtl_model::datapath::Facing as BoardFacing;

use super::*;
use crate::geom::Ray;
use crate::mesh::PatchId;
use crate::raycast::Facing;

/// A step of the coordinates below.
const STEP: f64 = 1.0 / 4096.0;

fn formats() -> Formats {
    Formats { coord_frac_bits: 12, dir_frac_bits: 12, t_frac_bits: 12, ..Formats::default() }
}

/// A square of side 1 about the z axis.
fn square(z: f64) -> CastPatch {
    let p = |x, y| DVec3::new(x, y, z);
    CastPatch { corners: [p(-0.5, -0.5), p(0.5, -0.5), p(0.5, 0.5), p(-0.5, 0.5)], is_triangle: false }
}

/// A roof whose ridge, from (0, -0.5, 0.5) to (0, 0.5, 0.5), is its diagonal.
fn roof() -> CastPatch {
    let ridge = |y| DVec3::new(0.0, y, 0.5);
    let corners = [ridge(-0.5), DVec3::new(0.5, 0.0, 0.0), ridge(0.5), DVec3::new(-0.5, 0.0, 0.0)];
    CastPatch { corners, is_triangle: false }
}

/// The cause of a difference: board and software name a patch and a distance (the cube's half is 1 m) each, or none.
fn cause(patches: &[CastPatch], ray: &Ray, board: Option<(u32, f64)>, software: Option<(u32, f64)>) -> Cause {
    let quantizer = Quantizer::new(&formats(), patches, &[DVec3::splat(-0.9), DVec3::splat(0.9)]).unwrap();
    assert_eq!(quantizer.half_m(), 1.0);
    let words: Vec<PatchWords> =
        patches.iter().zip(0..).map(|(p, id)| quantizer.patch(id, p).unwrap()).collect();
    let bounds = Bounds::new(&quantizer, patches, &words);
    let words = quantizer.ray(0, ray).unwrap().words;
    let length = board_length(words.dir, 12);
    let t_scale = (ray.dir.length() / length).log2().round().exp2();
    let u_d = unit_error(12);
    let verified = VerifiedRay { host: *ray, words, t_scale, slope: u_d, stretch: u_d };
    let board = board.map(|(patch, distance)| {
        let t = (distance / length / STEP).round() as u64;
        bounds.board(&verified, HitWords { t, patch, facing: BoardFacing::Front })
    });
    let software = software.map(|(patch, distance)| {
        let t = distance / ray.dir.length();
        bounds.software(&verified, &RayHit { t, patch: PatchId(patch), facing: Facing::Front })
    });
    bounds.cause(&verified, board.as_ref(), software.as_ref())
}

/// Straight down from 0.75 above the floor.
fn down(x: f64, y: f64) -> Ray {
    Ray::unbounded(DVec3::new(x, y, 0.75), DVec3::NEG_Z)
}

#[test]
fn cause_at_an_edge_within_two_steps_is_the_edge_and_farther_in_there_is_none() {
    let floor = [square(0.0)];
    let hit = Some((0, 0.75));
    // eps = 2 u_F + 1.5 u_D = 3.03 steps: the direction's largest word is 1/2, so t = 1.5.
    assert_eq!(cause(&floor, &down(0.5 - 3.0 * STEP, 0.1), None, hit), Cause::Edge);
    assert_eq!(cause(&floor, &down(0.5 + 3.0 * STEP, 0.1), hit, None), Cause::Edge);
    assert_eq!(cause(&floor, &down(0.5 - 3.1 * STEP, 0.1), None, hit), Cause::Unexplained);
    // Past the end of the edge.
    assert_eq!(cause(&floor, &down(0.5, 0.5 + 3.1 * STEP), hit, None), Cause::Unexplained);
}

#[test]
fn cause_at_the_diagonal_of_a_planar_quad_is_none() {
    assert_eq!(cause(&[square(0.0)], &down(0.1, 0.1), None, Some((0, 0.75))), Cause::Unexplained);
}

#[test]
fn cause_at_the_ridge_of_a_bent_quad_is_an_edge_only_where_it_is_an_outline() {
    let level = Ray::unbounded(DVec3::new(-0.75, 0.1, 0.5 - STEP), DVec3::X);
    assert_eq!(cause(&[roof()], &level, None, Some((0, 0.75))), Cause::Edge);
    let steep = Ray::unbounded(DVec3::new(0.0, 0.1, 0.9), DVec3::NEG_Z);
    assert_eq!(cause(&[roof()], &steep, None, Some((0, 0.4))), Cause::Unexplained);
}

#[test]
fn cause_of_two_patches_at_one_depth_is_a_tie_and_at_two_depths_none() {
    let scene = |z| [square(0.0), square(z)];
    let answers = |z| (Some((0, 0.75)), Some((1, 0.75 - z)));
    // Two bounds of eps + stretch t + t's rounding each: 2 (3.03 + 1.3 + 0.25) = 9.16 steps, the tiny slack aside.
    let near = answers(9.0 * STEP);
    assert_eq!(cause(&scene(9.0 * STEP), &down(0.1, 0.2), near.0, near.1), Cause::DepthTie);
    let far = answers(9.5 * STEP);
    assert_eq!(cause(&scene(9.5 * STEP), &down(0.1, 0.2), far.0, far.1), Cause::Unexplained);
}

#[test]
fn cause_of_a_hit_at_either_end_of_the_range_is_the_step_of_t() {
    let floor = [square(0.0)];
    let from = |z: f64, end: f64| Ray::to_point(DVec3::new(0.1, 0.2, z), DVec3::new(0.1, 0.2, end));
    assert_eq!(cause(&floor, &from(0.75, -STEP), None, Some((0, 0.75))), Cause::TStep);
    assert_eq!(cause(&floor, &from(0.75, -8.0 * STEP), None, Some((0, 0.75))), Cause::Unexplained);
    assert_eq!(cause(&floor, &from(STEP, -0.75), None, Some((0, STEP))), Cause::TStep);
    assert_eq!(cause(&floor, &from(8.0 * STEP, -0.75), None, Some((0, 8.0 * STEP))), Cause::Unexplained);
}

#[test]
fn least_of_convex_functions_is_found_inside_and_at_the_ends() {
    assert!((least(|t| (t - 1.3).abs() + 2.0, 4.0) - 2.0).abs() < 1e-12);
    assert_eq!(least(|t| t, 4.0), 0.0);
    assert_eq!(least(|t| -t, 4.0), -4.0);
}
