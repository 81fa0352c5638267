//! The clocked board on a sample of the rays: whole bundles, since a board never sees less. It must retire what the
//! functional model answers.
//!
//! ```text
//! groups of each purpose --spread, whole--> Board: nearest | any --> equal to functional::trace, ray by ray?
//! ```

use rtl_model::board::{Board, BoardError, Work};
use rtl_model::datapath::bundle::BundleWords;
use rtl_model::datapath::{HitWords, RayWords};
use rtl_model::oracle::Oracle;

use super::exact::{Both, Found, mismatch};
use super::rays::{Group, Rays};
use super::subject::Subject;
use super::workload::quotas;
use super::{Compared, Model};
use crate::raycast::CastError;
use crate::sampling::mix;

/// Traces about `n_wanted` of the rays on the clocked board: how many it were, and where it differs.
pub(super) fn check_clocked(
    subject: &impl Subject,
    oracle: &Oracle,
    board: &mut Board,
    rays: &Rays,
    n_wanted: u64,
) -> Result<(u64, Found), CastError> {
    let chosen = choose(rays, n_wanted);
    let (mut n, mut found) = (0, Found::default());
    for any_hit in [false, true] {
        for bundles in [false, true] {
            let groups: Vec<&Group> = chosen
                .iter()
                .copied()
                .filter(|g| g.any_hit == any_hit && g.bundle.is_some() == bundles)
                .collect();
            if groups.is_empty() {
                continue;
            }
            let answers = run(subject, board, rays, &groups, any_hit, bundles)
                .map_err(|error| CastError::Board(error.to_string()))?;
            let mut answers = answers.into_iter();
            for group in groups {
                // Rays of a bundle beyond the verified ones are traced with it and not compared.
                let n_all = group.bundle.as_ref().map_or(group.n, BundleWords::n_rays);
                let of_group: Vec<Clocked> = answers.by_ref().take(n_all).collect();
                for (i, (ray, clocked)) in rays.of(group).iter().zip(of_group).enumerate() {
                    n += 1;
                    let functional = subject.trace(&ray.words, any_hit, &mut |_, _| ()).hit;
                    let compared = match clocked {
                        Clocked::Nearest(hit) if hit != functional => Compared::NearestHit,
                        Clocked::Any(bit) if bit != functional.is_some() => {
                            Compared::AnyHit { board: bit, oracle: functional.is_some() }
                        }
                        _ => continue,
                    };
                    let board = match clocked {
                        Clocked::Nearest(hit) => hit,
                        Clocked::Any(_) => functional,
                    };
                    let oracle = Both::trace(subject, oracle, &ray.words, false).oracle;
                    let both = Both { board, oracle, n_tests: 0 };
                    found.note(|| mismatch(subject, Model::Clocked, group, i, ray.words, compared, both));
                }
            }
        }
    }
    Ok((n, found))
}

/// One answer of the clocked board.
#[derive(Clone, Copy, Debug)]
enum Clocked {
    Nearest(Option<HitWords>),
    Any(bool),
}

fn run(
    subject: &impl Subject,
    board: &mut Board,
    rays: &Rays,
    groups: &[&Group],
    any_hit: bool,
    bundles: bool,
) -> Result<Vec<Clocked>, BoardError> {
    let descriptors: Vec<BundleWords> = groups.iter().filter_map(|g| g.bundle.clone()).collect();
    let words: Vec<RayWords> = match bundles {
        true => Vec::new(),
        false => groups.iter().flat_map(|g| rays.of(g).iter().map(|r| r.words)).collect(),
    };
    let work = if bundles { Work::Bundles(&descriptors) } else { Work::Rays(&words) };
    Ok(match any_hit {
        true => subject.clocked_any(board, work)?.into_iter().map(Clocked::Any).collect(),
        false => subject.clocked_nearest(board, work)?.into_iter().map(Clocked::Nearest).collect(),
    })
}

/// Groups with at least `n_wanted` rays, shared among the purposes and spread over each, in their order.
fn choose(rays: &Rays, n_wanted: u64) -> Vec<&Group> {
    let mut purposes: Vec<_> = rays.groups.iter().map(|g| g.purpose).collect();
    purposes.dedup();
    let of = |purpose| rays.groups.iter().filter(move |g| g.purpose == purpose);
    let available: Vec<u64> = purposes.iter().map(|&p| of(p).map(|g| g.n as u64).sum()).collect();
    let mut chosen = Vec::new();
    for (&purpose, quota) in purposes.iter().zip(quotas(n_wanted, &available)) {
        let mut groups: Vec<&Group> = of(purpose).collect();
        groups.sort_by_key(|g| mix(g.first as u64));
        let mut n = 0;
        chosen.extend(groups.into_iter().take_while(|g| {
            let wanted = n < quota;
            n += g.n as u64;
            wanted
        }));
    }
    chosen.sort_by_key(|g| g.first);
    chosen
}
