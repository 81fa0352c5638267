//! Faults put into the board, which must be found and told exactly.

use std::collections::BTreeMap;

use rtl_model::board::{BoardError, Work};
use rtl_model::datapath::bundle::BundleWords;
use rtl_model::datapath::ray_patch::{Taps, taps};
use rtl_model::functional::{RayTrace, trace, trace_observed};
use rtl_model::memory_image::MemoryImage;
use rtl_model::oracle::WireName;

use super::*;

/// A board with one fault.
struct Faulty<'a> {
    image: &'a MemoryImage,
    /// t of this ray's hits is one step too large.
    t_of: Option<RayWords>,
    /// The any-hit bit of this ray is lost.
    bit_of: Option<RayWords>,
    /// The lowest bit of edge value 2 of tests with this patch is turned over.
    edge_value_of: Option<u32>,
    /// The lowest bit of the divisor of tests with this patch is turned over.
    divisor_of: Option<u32>,
    /// Ray 3 of hemispheres leans aside by a step.
    bundle_ray: bool,
    /// The dual-precision unit never hits.
    blind_unit: bool,
    /// The clocked board turns every answer over.
    clocked: bool,
}

impl<'a> Faulty<'a> {
    fn none(image: &'a MemoryImage) -> Faulty<'a> {
        Faulty {
            image,
            t_of: None,
            bit_of: None,
            edge_value_of: None,
            divisor_of: None,
            bundle_ray: false,
            blind_unit: false,
            clocked: false,
        }
    }
}

impl Subject for Faulty<'_> {
    fn image(&self) -> &MemoryImage {
        self.image
    }
    fn expand(&self, bundle: &BundleWords, i: usize) -> RayWords {
        let mut ray = bundle.ray(&self.image.formats, i);
        if self.bundle_ray && i == 3 && matches!(bundle, BundleWords::Hemisphere { .. }) {
            ray.dir[1] ^= 1;
        }
        ray
    }
    fn trace(
        &self,
        ray: &RayWords,
        any_hit: bool,
        tested: &mut dyn FnMut(&PatchWords, Option<HitWords>),
    ) -> RayTrace {
        let mut trace = trace_observed(self.image, ray, any_hit, tested);
        if self.t_of == Some(*ray) {
            trace.hit.iter_mut().for_each(|hit| hit.t += 1);
        }
        if self.bit_of == Some(*ray) && any_hit {
            trace.hit = None;
        }
        trace
    }
    fn taps(&self, ray: &RayWords, patch: &PatchWords) -> Taps {
        let mut taps = taps(&self.image.formats, ray, patch);
        if self.edge_value_of == Some(patch.id) {
            taps.e[2] ^= 1;
        }
        if self.divisor_of == Some(patch.id) {
            taps.triangles.iter_mut().flatten().take(1).for_each(|triangle| triangle.den_shifted ^= 1);
        }
        taps
    }
    fn dual_precision(&self, bits: u32, ray: &RayWords, patch: &PatchWords) -> Option<HitWords> {
        let hit = Real { image: self.image }.dual_precision(bits, ray, patch);
        hit.filter(|_| !self.blind_unit)
    }
    fn clocked_nearest(
        &self,
        board: &mut Board,
        work: Work<'_>,
    ) -> Result<Vec<Option<HitWords>>, BoardError> {
        let hits = board.trace_nearest(work)?;
        let fault = |hit: Option<HitWords>| hit.map(|hit| HitWords { patch: hit.patch ^ 1, ..hit });
        Ok(if self.clocked { hits.into_iter().map(fault).collect() } else { hits })
    }
    fn clocked_any(&self, board: &mut Board, work: Work<'_>) -> Result<Vec<bool>, BoardError> {
        let bits = board.trace_any(work)?;
        Ok(bits.into_iter().map(|bit| bit != self.clocked).collect())
    }
}

#[test]
fn verify_a_board_with_one_wrong_t_names_the_ray_both_answers_and_the_patches() {
    let fixture = fixture(11, Formats::default(), 60, 4);
    let rays = fixture.rays();
    let hits = |ray: &RayWords| trace(fixture.image(), ray, false).hit;
    let (_, _, ray) = rays.iter().rfind(|(_, any, ray)| !any && hits(ray).is_some()).unwrap();
    let true_hit = hits(ray).unwrap();
    let found = fixture.verify(&Faulty { t_of: Some(*ray), ..Faulty::none(fixture.image()) }, 0);
    // Explicit rays are asked for the nearest and for any hit.
    let same = rays.iter().filter(|(_, _, words)| words == ray).count() as u64;
    assert_eq!(found.n_mismatches, same);
    assert!(!found.passed());
    let first = found.first_mismatch.unwrap();
    let earlier = rays.iter().position(|(_, _, words)| words == ray).unwrap();
    assert_eq!((first.compared, first.model), (Compared::NearestHit, Model::Functional));
    assert_eq!(first.index, earlier as u64);
    assert_eq!(first.ray, *ray);
    assert_eq!((first.purpose, first.any_hit), (rays[earlier].0, rays[earlier].1));
    assert_eq!(first.oracle, Some(true_hit));
    assert_eq!(first.board, Some(HitWords { t: true_hit.t + 1, ..true_hit }));
    assert_eq!(first.patches[0].id, true_hit.patch);
    let mut ids: Vec<u32> = first.patches.iter().map(|p| p.id).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), first.patches.len(), "each patch once");
}

#[test]
fn verify_a_board_that_loses_a_hit_bit_names_the_ray_and_both_bits() {
    let fixture = fixture(12, Formats::default(), 60, 4);
    let rays = fixture.rays();
    let (index, (_, _, ray)) = rays
        .iter()
        .enumerate()
        .find(|(_, (p, any, ray))| {
            *any && *p == Purpose::Shadow && trace(fixture.image(), ray, true).hit.is_some()
        })
        .unwrap();
    let found = fixture.verify(&Faulty { bit_of: Some(*ray), ..Faulty::none(fixture.image()) }, 0);
    assert_eq!(found.n_mismatches, 1);
    let first = found.first_mismatch.unwrap();
    assert_eq!(first.compared, Compared::AnyHit { board: false, oracle: true });
    assert_eq!((first.index, first.purpose, first.any_hit), (index as u64, Purpose::Shadow, true));
    assert_eq!((first.board, first.oracle), (None, trace(fixture.image(), ray, false).hit));
}

#[test]
fn verify_a_board_with_a_wrong_edge_value_names_the_wire_with_both_values() {
    let fixture = fixture(13, Formats::default(), 60, 4);
    // A patch that some ray is tested with.
    let mut tested = BTreeMap::new();
    for (_, any_hit, ray) in fixture.rays() {
        trace_observed(fixture.image(), &ray, any_hit, |patch, _| {
            *tested.entry(patch.id).or_insert(0u64) += 1;
        });
    }
    let (&id, &n_tests) = tested.iter().next_back().unwrap();
    let found = fixture.verify(&Faulty { edge_value_of: Some(id), ..Faulty::none(fixture.image()) }, 0);
    assert_eq!(found.n_mismatches, n_tests);
    let first = found.first_mismatch.unwrap();
    let Compared::Wire(wire) = first.compared else { panic!("{:?}", first.compared) };
    assert_eq!(wire.wire, WireName::E(2));
    assert_eq!(wire.board, wire.oracle ^ 1);
    assert_eq!(first.patches[0].id, id);
    let exact = taps(&fixture.image().formats, &first.ray, &first.patches[0]);
    assert_eq!(wire.oracle, exact.e[2]);
    // The last wire of a test too: every wire is compared.
    let found = fixture.verify(&Faulty { divisor_of: Some(id), ..Faulty::none(fixture.image()) }, 0);
    assert_eq!(found.n_mismatches, n_tests);
    let Compared::Wire(wire) = found.first_mismatch.unwrap().compared else { panic!("a wire") };
    assert_eq!(wire.wire, WireName::DenShifted(0));
}

#[test]
fn verify_a_bundle_generator_that_is_off_by_one_names_the_ray_that_it_should_have_made() {
    let fixture = fixture(14, Formats::default(), 60, 2);
    let found = fixture.verify(&Faulty { bundle_ray: true, ..Faulty::none(fixture.image()) }, 0);
    // Two hemispheres a round.
    assert_eq!(found.n_mismatches, 4);
    let first = found.first_mismatch.unwrap();
    let Compared::BundleRay { oracle } = first.compared else { panic!("{:?}", first.compared) };
    assert_eq!(first.ray, RayWords { dir: [oracle.dir[0], oracle.dir[1] ^ 1, oracle.dir[2]], ..oracle });
    assert_eq!(fixture.rays()[first.index as usize].2, oracle);
}

#[test]
fn verify_a_first_test_unit_that_never_hits_counts_it_wrong_and_does_not_pass() {
    let fixture = fixture(15, Formats::default(), 60, 2);
    let found = fixture.verify(&Faulty { blind_unit: true, ..Faulty::none(fixture.image()) }, 0);
    assert_eq!((found.n_mismatches, found.first_test.len()), (0, 2));
    assert!(found.first_test.iter().all(|share| share.wrong > 0));
    assert!(!found.passed());
}

#[test]
fn verify_a_clocked_board_that_answers_otherwise_counts_each_ray() {
    let fixture = fixture(16, Formats::default(), 60, 3);
    let found = fixture.verify(&Faulty { clocked: true, ..Faulty::none(fixture.image()) }, 100_000);
    let rays = fixture.rays();
    assert_eq!(found.n_clocked, rays.len() as u64);
    let nearest_misses =
        rays.iter().filter(|(_, any, ray)| !any && trace(fixture.image(), ray, false).hit.is_none());
    assert_eq!(found.n_mismatches, found.n_clocked - nearest_misses.count() as u64);
    let first = found.first_mismatch.unwrap();
    assert_eq!((first.model, first.compared), (Model::Clocked, Compared::NearestHit));
    assert_eq!(first.board.unwrap().patch ^ 1, first.oracle.unwrap().patch);
}
