//! Parts of a sweep on several machines, and their merge.
//!
//! ```text
//! plan: ordinals in order --i/n: places i-1, i-1+n, ...--> the part of shard i   its store says: shard, n, plan, version
//! shards' stores --check: same sweep, each shard once, none missing, none unfinished--> evaluations in one store
//! ```
//! Shards interleave, so that each has its share of cheap and dear candidates. Only searches whose candidates are known
//! beforehand can be cut. Nothing here schedules: that is the work of Slurm and its like (docs/slurm.md).

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::store::{Store, StoreError, StoredPoint, version};

/// Shard `index` of `n`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    pub index: u32,
    /// How many there are.
    pub n: u32,
}

/// Most shards of a sweep.
const MAX_SHARDS: u32 = 100_000;

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let expected = || format!("'{text}': expected i/n with 1 <= i <= n <= {MAX_SHARDS}, such as 3/8");
        let (index, n) = text.split_once('/').ok_or_else(expected)?;
        let whole = |digits: &str| digits.trim().parse::<u32>().map_err(|_| expected());
        let (index, n) = (whole(index)?, whole(n)?);
        if index == 0 || index > n || n > MAX_SHARDS { Err(expected()) } else { Ok(Shard { index, n }) }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.n)
    }
}

impl Shard {
    /// Its part of a plan.
    pub fn part(self, plan: &[u64]) -> Vec<u64> {
        plan.iter().copied().skip(self.index as usize - 1).step_by(self.n as usize).collect()
    }
}

/// Keys of a store's notes.
pub(super) mod key {
    pub(in crate::explore) const SPACE: &str = "space";
    pub(in crate::explore) const VERSION: &str = "version";
    pub(in crate::explore) const SHARD: &str = "shard";
    pub(in crate::explore) const PLAN: &str = "plan";
    pub(in crate::explore) const COMPLETE: &str = "complete";
}

/// Shards that do not make one sweep.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// One of the stores.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// They do not fit.
    #[error("{0}")]
    Shards(String),
}

/// The sweep that shards must be parts of.
#[derive(Clone, Copy, Debug)]
pub struct Whole<'a> {
    /// Hash of the space and its search.
    pub space: &'a str,
    /// Hash of the plan.
    pub plan: &'a str,
    /// All that was planned.
    pub ordinals: &'a [u64],
}

/// The stores of the shards in `folders`, which make the whole sweep.
///
/// # Errors
/// A folder without store, a shard of another sweep or version, one that is there twice, is not finished, lacks points or
/// has others, or is missing.
pub fn parts(folders: &[PathBuf], whole: Whole<'_>) -> Result<Vec<Store>, MergeError> {
    let wrong = |folder: &Path, what: String| MergeError::Shards(format!("{}: {what}", folder.display()));
    let mut shards: BTreeMap<u32, (PathBuf, Store)> = BTreeMap::new();
    let mut n = None;
    for folder in folders {
        let file = folder.join(super::STORE_FILE);
        if !file.is_file() {
            let what = format!("no {}: not the folder of a shard", super::STORE_FILE);
            return Err(wrong(folder, what));
        }
        let part = Store::read(&file)?;
        let Some(shard) = part.meta(key::SHARD)? else {
            return Err(wrong(folder, "a whole sweep, not a shard".to_owned()));
        };
        let shard: Shard = shard.parse().map_err(|what| wrong(folder, what))?;
        let named = |what: &str| wrong(folder, format!("shard {shard} {what}"));
        if part.meta(key::VERSION)?.as_deref() != Some(&version()) {
            let other = part.meta(key::VERSION)?.unwrap_or_default();
            return Err(named(&format!("is of {other}, expected {}", version())));
        }
        if part.meta(key::SPACE)?.as_deref() != Some(whole.space)
            || part.meta(key::PLAN)?.as_deref() != Some(whole.plan)
        {
            return Err(named("is of another space, search or seed"));
        }
        if *n.get_or_insert(shard.n) != shard.n {
            return Err(named(&format!("beside shards of {}: two ways to cut the sweep", n.unwrap_or(0))));
        }
        if let Some((first, _)) = shards.get(&shard.index) {
            return Err(named(&format!("is in {} as well", first.display())));
        }
        if part.meta(key::COMPLETE)?.is_none() {
            let (done, all) = (part.points()?.len(), shard.part(whole.ordinals).len());
            return Err(named(&format!("is not finished: {done} of {all} points")));
        }
        let mut wanted = shard.part(whole.ordinals);
        wanted.sort_unstable();
        let found: Vec<u64> = part.points()?.into_iter().map(|StoredPoint { ordinal, .. }| ordinal).collect();
        if found != wanted {
            let (found, wanted) = (found.len(), wanted.len());
            return Err(named(&format!(
                "has other points than the plan gives it: {found}, expected {wanted}"
            )));
        }
        shards.insert(shard.index, (folder.clone(), part));
    }
    let n = n.ok_or_else(|| MergeError::Shards("expected at least one shard".to_owned()))?;
    let missing: Vec<String> =
        (1..=n).filter(|i| !shards.contains_key(i)).map(|i| Shard { index: i, n }.to_string()).collect();
    if !missing.is_empty() {
        let plural = if missing.len() == 1 { "shard is" } else { "shards are" };
        return Err(MergeError::Shards(format!(
            "{} {plural} missing: {}",
            missing.len(),
            missing.join(", ")
        )));
    }
    Ok(shards.into_values().map(|(_, part)| part).collect())
}

#[cfg(test)]
#[path = "shard_tests.rs"]
mod tests;
