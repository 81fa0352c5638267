//! Rows of form factors on disk: another solve of the same mesh casts no ray for what they say, whatever its light.
//!
//! ```text
//! FILE.radrow --same mesh and sampling--> rows --Solver asks: at hand, or cast and kept--> rows --written after the solve-->
//! frame of framed_file.rs, magic "RADROW\r\n"; sections
//!   OFWH   what they belong to: mesh, sampling, caster     -> Key
//!   ROWS   shooter, how it was looked at, its row          -> Entry
//! ```
//! Form factors are geometry, and what thin glass passes: emission and reflectances are not in them. But who emits is looked at more closely, so a row
//! belongs to its shooter and to the way in which it was looked at. A solve with such a file has the bits of one without;
//! it counts the rays that it casts itself.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::SolveOptions;
use super::form_factors::Row;
use super::kernel::Kernel;
use super::shooter::Aim;
use super::solution_file::geometry_hash;
use super::stray::StrayShares;
use crate::framed_file::{FramedFileError, Kind, put_section};
use crate::mesh::Mesh;
use crate::raycast::transmit::Panes;
use crate::scene::Scene;

const KIND: Kind =
    Kind { magic: *b"RADROW\r\n", version: 2, name: "a file of form factors (.radrow)", sectioned: true };

/// Why a file of form factors was not read or not written.
#[derive(Debug, thiserror::Error)]
pub enum RowFileError {
    /// It cannot be read or written.
    #[error(transparent)]
    File(#[from] FramedFileError),
    /// They are those of another mesh, or were sampled otherwise.
    #[error("{}: form factors of another solve: {what}; name another file, or remove this one", path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// What differs.
        what: String,
    },
}

/// What rows depend on.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Key {
    geometry_hash: u64,
    panes_hash: u64,
    seed: u64,
    dense_visibility: bool,
    kernel: Kernel,
    max_shooters: usize,
    caster: String,
    surface_offset_m: f64,
}

#[derive(Debug, Serialize, Deserialize)]
struct Entry {
    aim: Aim,
    stray: StrayShares,
    row: Row,
}

/// Rows at hand for one solve.
#[derive(Debug)]
pub struct RowCache {
    path: PathBuf,
    key: Key,
    rows: BTreeMap<Aim, (Row, StrayShares)>,
    n_bytes: u64,
    max_bytes: u64,
    has_more: bool,
}

impl RowCache {
    /// The rows of the file `path` for a solve of `mesh`, none where there is no such file. `caster` says in words what the
    /// answers to rays depend on; rows past `max_row_bytes` of the options are not kept.
    ///
    /// # Errors
    /// [`RowFileError`] of a file that is damaged or of another mesh, sampling or caster.
    pub fn open(
        path: &Path,
        scene: &Scene,
        mesh: &Mesh,
        options: &SolveOptions,
        caster: String,
        surface_offset_m: f64,
    ) -> Result<RowCache, RowFileError> {
        let key = Key {
            geometry_hash: geometry_hash(scene, mesh),
            panes_hash: Panes::of(scene, mesh).hash(),
            seed: options.seed,
            dense_visibility: options.dense_visibility,
            kernel: options.kernel,
            max_shooters: options.max_shooters,
            caster,
            surface_offset_m,
        };
        let mut cache = RowCache {
            path: path.to_path_buf(),
            key,
            rows: BTreeMap::new(),
            n_bytes: 0,
            max_bytes: options.max_row_bytes,
            has_more: false,
        };
        if !path.exists() {
            return Ok(cache);
        }
        let body = KIND.read(path)?;
        let rest = &mut body.as_slice();
        let found: Key = KIND.section(path, rest, *b"OFWH")?;
        if let Some(what) = found.difference(&cache.key) {
            return Err(RowFileError::Other { path: path.to_path_buf(), what });
        }
        let entries: Vec<Entry> = KIND.section(path, rest, *b"ROWS")?;
        KIND.end(path, rest)?;
        let n = [mesh.elements.len(), mesh.vertices.len(), mesh.surfaces.len()];
        if let Some(at) = entries.iter().position(|entry| !entry.is_sound(n)) {
            return Err(KIND.fault(path, format!("row {at} in ROWS is no row of this mesh")).into());
        }
        for Entry { aim, stray, row } in entries {
            cache.keep(aim, &row, stray);
        }
        cache.has_more = false;
        Ok(cache)
    }

    /// The row of a shooter that was looked at in that way.
    pub(super) fn get(&self, aim: &Aim) -> Option<&(Row, StrayShares)> {
        self.rows.get(aim)
    }

    /// Keeps a row that was cast, if there is room.
    pub(super) fn keep(&mut self, aim: Aim, row: &Row, stray: StrayShares) {
        if self.n_bytes + row.n_bytes() <= self.max_bytes {
            self.n_bytes += row.n_bytes();
            self.rows.insert(aim, (row.clone(), stray));
            self.has_more = true;
        }
    }

    /// Writes the file when rows came along, replacing it atomically.
    ///
    /// # Errors
    /// When the file system refuses; the previous file is then untouched.
    pub fn write(&self) -> Result<(), RowFileError> {
        if !self.has_more {
            return Ok(());
        }
        let entries: Vec<_> = self.rows.iter().map(|(aim, (row, stray))| (aim, stray, row)).collect();
        let mut body = Vec::new();
        put_section(&mut body, *b"OFWH", &self.key);
        put_section(&mut body, *b"ROWS", &entries);
        Ok(KIND.write(&self.path, &body)?)
    }
}

impl Key {
    fn difference(&self, now: &Key) -> Option<String> {
        let parts = [
            (
                "of a mesh with hash",
                format!("{:016x}", self.geometry_hash),
                format!("{:016x}", now.geometry_hash),
            ),
            (
                "through thin glass with hash",
                format!("{:016x}", self.panes_hash),
                format!("{:016x}", now.panes_hash),
            ),
            ("sampled with seed", self.seed.to_string(), now.seed.to_string()),
            ("with dense visibility", self.dense_visibility.to_string(), now.dense_visibility.to_string()),
            ("with kernel", format!("{:?}", self.kernel), format!("{:?}", now.kernel)),
            ("with most shooters", self.max_shooters.to_string(), now.max_shooters.to_string()),
            ("cast by", self.caster.clone(), now.caster.clone()),
            ("with offsets (m) of", self.surface_offset_m.to_string(), now.surface_offset_m.to_string()),
        ];
        let (what, then, now) = parts.into_iter().find(|(_, then, now)| then != now)?;
        Some(format!("{what} {then}, this one's is {now}"))
    }
}

impl Entry {
    fn is_sound(&self, [n_elements, n_vertices, n_surfaces]: [usize; 3]) -> bool {
        let share = |x: f64| (0.0..=1.0).contains(&x);
        self.row.elements.is_sound(n_elements)
            && self.row.vertices.is_sound(n_vertices)
            && self.row.spread.iter().all(|(s, v)| (*s as usize) < n_surfaces && v.is_finite() && *v >= 0.0)
            && share(self.stray.lost)
            && share(self.stray.back)
    }
}

#[cfg(test)]
#[path = "row_cache_tests.rs"]
mod tests;
