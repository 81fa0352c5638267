//! The `.radsol` file: a solution on disk, refused when damaged or made for another scene.
//!
//! ```text
//! frame of framed_file.rs, magic "RADSOL\r\n"; its body, sections one behind the other, each in postcard's encoding:
//!   GEOM   hash of the mesh; numbers of its elements, vertices, patches
//!   TREE   how the patches are cut into elements, where less than C1 continues -> Subdivision
//!   LITE   emission and reflection of every surface, lights                 -> Lighting
//!   OPTS   options that it was solved with                                  -> SolveOptions
//!   FACT   energy account, counts, errors of the form factors               -> Facts
//!   ELEM   irradiance of every element         VERT   of every vertex
//!   REST   unshot radiosity of every patch     SHOT   record of every patch whose form factors were cast
//! ```
//! docs/radsol.md describes every byte.

use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::lighting::Lighting;
use super::{EarlierWork, EnergyAccount, ErrorEstimate, ReciprocityError, RowSumError, ShooterRecord};
use super::{Solution, SolveOptions, SplitIrradiance, UnshotRadiosity};
use crate::framed_file::{FramedFileError, Kind, encode, put_section};
use crate::mesh::{Mesh, Subdivision};
use crate::scene::Scene;

/// The kind of these files.
const KIND: Kind = Kind { magic: *b"RADSOL\r\n", version: 4, name: "a solution file", sectioned: true };

/// Why a solution file was not written or not read.
#[derive(Debug, thiserror::Error)]
pub enum SolutionFileError {
    /// It cannot be read or written.
    #[error(transparent)]
    File(#[from] FramedFileError),
    /// The solution belongs to another geometry, or to another mesh of it.
    #[error(
        "{}: made for another geometry or another mesh of it: {what}; a solution is of use for the scene, --elements and \
         kind of meshing that it was solved with", path.display()
    )]
    OtherGeometry {
        /// The file.
        path: PathBuf,
        /// What differs.
        what: String,
    },
    /// The solution belongs to the same geometry, lit or reflecting otherwise.
    #[error(
        "{}: made with {what}: the geometry is the same, `radeng solve --continue-from` goes on from it",
        path.display()
    )]
    OtherLighting {
        /// The file.
        path: PathBuf,
        /// What differs.
        what: String,
    },
}

/// A solution with what it was made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    /// The solution.
    pub solution: Solution,
    /// The options that it was solved with.
    pub options: SolveOptions,
    /// The lighting that it was solved for.
    pub lighting: Lighting,
}

impl Stored {
    /// A checksum of what a solve that goes on from it depends on.
    pub(super) fn crc(&self) -> u32 {
        let Solution { element_irradiance, vertex_irradiance, unshot, .. } = &self.solution;
        crc32fast::hash(&encode(&(&self.lighting, element_irradiance, vertex_irradiance, unshot)))
    }
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Geometry {
    hash: u64,
    n_elements: u64,
    n_vertices: u64,
    n_patches: u64,
}

impl Geometry {
    fn of(scene: &Scene, mesh: &Mesh) -> Geometry {
        Geometry {
            hash: geometry_hash(scene, mesh),
            n_elements: mesh.elements.len() as u64,
            n_vertices: mesh.vertices.len() as u64,
            n_patches: mesh.patches.len() as u64,
        }
    }

    fn difference(&self, now: &Geometry) -> Option<String> {
        let counts = |g: &Geometry| {
            format!("{} elements, {} vertices, {} patches", g.n_elements, g.n_vertices, g.n_patches)
        };
        if self == now {
            None
        } else if counts(self) != counts(now) {
            Some(format!("{}, the scene has {}", counts(self), counts(now)))
        } else {
            Some(format!(
                "the positions of its vertices (hash {:016x}, the scene has {:016x})",
                self.hash, now.hash
            ))
        }
    }
}

/// What is told of a solution in few bytes.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Facts {
    account: EnergyAccount,
    n_shots: u64,
    n_shooters: u64,
    n_rays: u64,
    row_sum_error: RowSumError,
    reciprocity: ReciprocityError,
    error_estimate: Option<ErrorEstimate>,
    earlier: Option<EarlierWork>,
    exact: bool,
}

/// Writes a solution, replacing the file atomically.
///
/// # Errors
/// [`FramedFileError::Io`] when the file system refuses; the previous file is then untouched.
pub fn save(
    path: &Path,
    scene: &Scene,
    mesh: &Mesh,
    options: &SolveOptions,
    solution: &Solution,
) -> Result<(), SolutionFileError> {
    let body =
        body_of(&Geometry::of(scene, mesh), &mesh.subdivision(), &Lighting::of(scene), options, solution);
    Ok(KIND.write(path, &body)?)
}

/// Reads a solution of `scene` as meshed in `mesh`, and the options that it was made with.
///
/// # Errors
/// One [`SolutionFileError`] for every way in which the file can be wrong.
pub fn load(path: &Path, scene: &Scene, mesh: &Mesh) -> Result<(Solution, SolveOptions), SolutionFileError> {
    let Stored { solution, options, lighting } = load_of_geometry(path, scene, mesh)?;
    match lighting.difference(scene) {
        None => Ok((solution, options)),
        Some(what) => Err(SolutionFileError::OtherLighting { path: path.to_path_buf(), what }),
    }
}

/// Reads a solution of the geometry of `scene` as meshed in `mesh`, whatever its lighting.
///
/// # Errors
/// As [`load`].
pub fn load_of_geometry(path: &Path, scene: &Scene, mesh: &Mesh) -> Result<Stored, SolutionFileError> {
    let (geometry, stored) = decode(path, &KIND.read(path)?)?;
    match geometry.difference(&Geometry::of(scene, mesh)) {
        None => Ok(stored),
        Some(what) => Err(SolutionFileError::OtherGeometry { path: path.to_path_buf(), what }),
    }
}

/// The mesh of `scene` that a solution was made on, where the file cuts the patches of `mesh` otherwise than it does.
///
/// `None` also where the file is of another number of patches: [`load`] says so then.
///
/// # Errors
/// As [`load`], of a file that is damaged.
pub fn remeshed(path: &Path, scene: &Scene, mesh: &Mesh) -> Result<Option<Mesh>, SolutionFileError> {
    let body = KIND.read(path)?;
    let rest = &mut &*body;
    let _: Geometry = KIND.section(path, rest, *b"GEOM")?;
    let subdivision: Subdivision = KIND.section(path, rest, *b"TREE")?;
    if subdivision.n_patches() as usize != mesh.patches.len() || subdivision == mesh.subdivision() {
        return Ok(None);
    }
    let remeshed = Mesh::build_with(scene, &subdivision);
    Ok(Some(remeshed.map_err(|fault| KIND.fault(path, format!("TREE: {fault}")))?))
}

fn body_of(
    geometry: &Geometry,
    subdivision: &Subdivision,
    lighting: &Lighting,
    options: &SolveOptions,
    solution: &Solution,
) -> Vec<u8> {
    let facts = Facts {
        account: solution.account,
        n_shots: solution.n_shots as u64,
        n_shooters: solution.n_shooters as u64,
        n_rays: solution.n_rays,
        row_sum_error: solution.row_sum_error,
        reciprocity: solution.reciprocity,
        error_estimate: solution.error_estimate.clone(),
        earlier: solution.earlier,
        exact: solution.exact,
    };
    let mut body = Vec::new();
    put_section(&mut body, *b"GEOM", geometry);
    put_section(&mut body, *b"TREE", subdivision);
    put_section(&mut body, *b"LITE", lighting);
    put_section(&mut body, *b"OPTS", options);
    put_section(&mut body, *b"FACT", &facts);
    put_section(&mut body, *b"ELEM", &solution.element_irradiance);
    put_section(&mut body, *b"VERT", &solution.vertex_irradiance);
    put_section(&mut body, *b"REST", &solution.unshot);
    put_section(&mut body, *b"SHOT", &solution.shooters);
    body
}

fn decode(path: &Path, body: &[u8]) -> Result<(Geometry, Stored), FramedFileError> {
    let rest = &mut &*body;
    let geometry: Geometry = KIND.section(path, rest, *b"GEOM")?;
    let _: Subdivision = KIND.section(path, rest, *b"TREE")?;
    let lighting: Lighting = KIND.section(path, rest, *b"LITE")?;
    let options: SolveOptions = KIND.section(path, rest, *b"OPTS")?;
    let facts: Facts = KIND.section(path, rest, *b"FACT")?;
    let element_irradiance: Vec<SplitIrradiance> = KIND.section(path, rest, *b"ELEM")?;
    let vertex_irradiance: Vec<SplitIrradiance> = KIND.section(path, rest, *b"VERT")?;
    let unshot: Vec<UnshotRadiosity> = KIND.section(path, rest, *b"REST")?;
    let shooters: Vec<ShooterRecord> = KIND.section(path, rest, *b"SHOT")?;
    KIND.end(path, rest)?;
    let fault = |what: String| Err(KIND.fault(path, what));
    for (name, found, stated) in [
        ("ELEM", element_irradiance.len(), geometry.n_elements),
        ("VERT", vertex_irradiance.len(), geometry.n_vertices),
        ("REST", unshot.len(), geometry.n_patches),
    ] {
        if found as u64 != stated {
            return fault(format!("{found} entries in {name}, GEOM says {stated}"));
        }
    }
    let finite = |e: &SplitIrradiance| e.direct.is_finite() && e.indirect.is_finite();
    for (name, list) in [("ELEM", &element_irradiance), ("VERT", &vertex_irradiance)] {
        if let Some(i) = list.iter().position(|e| !finite(e)) {
            return fault(format!("entry {i} of {name} is no finite irradiance"));
        }
    }
    if let Some(i) = unshot.iter().position(|u| !(u.emitted.is_finite() && u.reflected.is_finite())) {
        return fault(format!("entry {i} of REST is no finite radiosity"));
    }
    if let Some(what) = lighting.fault() {
        return fault(what);
    }
    let solution = Solution {
        element_irradiance,
        vertex_irradiance,
        account: facts.account,
        n_shots: facts.n_shots as usize,
        n_shooters: facts.n_shooters as usize,
        n_rays: facts.n_rays,
        row_sum_error: facts.row_sum_error,
        reciprocity: facts.reciprocity,
        error_estimate: facts.error_estimate,
        unshot,
        shooters,
        earlier: facts.earlier,
        exact: facts.exact,
    };
    Ok((geometry, Stored { solution, options, lighting }))
}

/// A hash of a scene's geometry as meshed: equal for equal input, on every machine.
///
/// Source: FNV-1a, 64 bits, over the bits of the numbers. A guard against mistakes, not against malice.
pub fn geometry_hash(scene: &Scene, mesh: &Mesh) -> u64 {
    let mut hash = Fnv::default();
    hash.count(scene.surfaces.len());
    for surface in &scene.surfaces {
        hash.count(usize::from(surface.two_sided));
    }
    hash.count(mesh.vertices.len());
    for vertex in &mesh.vertices {
        hash.point(vertex.position);
        hash.point(vertex.normal);
    }
    hash.count(mesh.elements.len());
    for element in &mesh.elements {
        hash.count(element.patch.0 as usize);
        for corner in element.corners.vertices() {
            hash.count(corner.0 as usize);
        }
    }
    hash.count(mesh.patches.len());
    for patch in &mesh.patches {
        hash.count(patch.surface.0 as usize);
        hash.count(patch.twin.map_or(usize::MAX, |t| t.0 as usize));
    }
    hash.0
}

/// A hash of everything that pass 1 reads of a scene and its mesh.
pub fn fingerprint(scene: &Scene, mesh: &Mesh) -> u64 {
    let mut hash = Fnv(geometry_hash(scene, mesh));
    for byte in encode(&Lighting::of(scene)) {
        hash.byte(byte);
    }
    hash.0
}

struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Fnv {
        Fnv(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    fn count(&mut self, n: usize) {
        self.bits(n as u64);
    }

    fn bits(&mut self, bits: u64) {
        for byte in bits.to_le_bytes() {
            self.byte(byte);
        }
    }

    fn byte(&mut self, byte: u8) {
        self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
    }

    /// Adding 0 makes -0 and 0 the same.
    fn point(&mut self, p: DVec3) {
        for c in p.to_array() {
            self.bits((c + 0.0).to_bits());
        }
    }
}

#[cfg(test)]
#[path = "solution_file_tests.rs"]
mod tests;
