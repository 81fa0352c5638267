//! A few rays of a workload in the board's words.
//!
//! ```text
//! RecordedGroups of every purpose --every total/n-th ray, quantised as the board gets it--> (words, any hit)
//! ```

use rtl_model::datapath::RayWords;

use crate::raycast::CastError;
use crate::raycast::quantize::Quantizer;
use crate::raycast::recording::{GroupRays, RecordedGroup};
use crate::verify::PurposeRays;

/// At most `n` of the workload's rays, spread evenly, in its order; bundles as the board's generator makes them.
///
/// # Errors
/// A ray without board numbers.
pub fn spread(
    quantizer: &Quantizer,
    workload: &[(PurposeRays, Vec<RecordedGroup>)],
    n: usize,
) -> Result<Vec<(RayWords, bool)>, CastError> {
    let groups = || workload.iter().flat_map(|(_, groups)| groups);
    let total: usize = groups().map(|group| group.take).sum();
    let n = n.min(total);
    let place = |k: usize| (k as u128 * total as u128 / n.max(1) as u128) as usize;
    let mut rays = Vec::with_capacity(n);
    let mut first = 0;
    for group in groups() {
        let end = first + group.take;
        let mut bundle = None;
        while rays.len() < n && place(rays.len()) < end {
            let i = place(rays.len()) - first;
            let words = match &group.rays {
                GroupRays::Explicit(rays) => quantizer.ray(i, &rays[i])?.words,
                GroupRays::Bundle(host) => {
                    let words = match bundle.take() {
                        Some(words) => words,
                        None => quantizer.bundle(0, host)?,
                    };
                    bundle.insert(words).ray(quantizer.formats(), i)
                }
            };
            rays.push((words, group.any_hit));
        }
        first = end;
    }
    Ok(rays)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec3, Ray};
    use crate::raycast::{CastPatch, Purpose, RayBundle};
    use rtl_model::fixed::Formats;

    #[test]
    fn spread_takes_rays_evenly_over_groups_and_never_more_than_there_are() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let patches = [CastPatch { corners, is_triangle: false }];
        let quantizer = Quantizer::new(&Formats::default(), &patches, &[]).unwrap();
        let explicit = |take| RecordedGroup {
            rays: GroupRays::Explicit(
                (0..4)
                    .map(|i| Ray::unbounded(DVec3::splat(0.25), DVec3::new(1.0, f64::from(i), 0.0)))
                    .collect(),
            ),
            any_hit: false,
            take,
        };
        let points = (1..=6).map(|i| DVec3::new(0.1 * f64::from(i), 0.2, 0.3)).collect();
        let bundle = RayBundle::Targets { apex: DVec3::splat(0.5), points };
        let targets = RecordedGroup { rays: GroupRays::Bundle(bundle.clone()), any_hit: true, take: 6 };
        let purpose = PurposeRays { purpose: Purpose::Primary, cast: 0, verified: 0 };
        let workload = [(purpose, vec![explicit(3), targets]), (purpose, vec![explicit(4)])];
        let all = spread(&quantizer, &workload, 100).unwrap();
        assert_eq!(all.len(), 13);
        assert_eq!(
            all.iter().map(|(_, any)| *any).collect::<Vec<_>>()[2..10],
            [false, true, true, true, true, true, true, false]
        );
        let expected = quantizer.bundle(0, &bundle).unwrap().ray(quantizer.formats(), 4);
        assert_eq!(all[3 + 4].0, expected);
        let some = spread(&quantizer, &workload, 5).unwrap();
        assert_eq!(some, [all[0], all[2], all[5], all[7], all[10]]);
        assert_eq!(spread(&quantizer, &[], 5).unwrap(), []);
    }
}
