//! The `.radsol` file: a solution on disk, refused when damaged or made for another scene.
//!
//! ```text
//! byte 0   magic "RADSOL\r\n"          8 bytes
//!      8   version                    u32, little endian
//!     12   length of the body         u64
//!     20   CRC-32 of the body         u32
//!     24   body: postcard of (fingerprint u64, SolveOptions, Solution)
//! ```
//! The fingerprint is a hash of everything that pass 1 reads of scene and mesh: geometry, materials, lights. The
//! file is replaced atomically: readers see the old one or the new one, never half a file.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use atomic_write_file::AtomicWriteFile;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Solution, SolveOptions};
use crate::mesh::Mesh;
use crate::scene::{Light, Scene};
use crate::units::Rgb;

/// First bytes of every solution file; the line end shows transfers in text mode.
const MAGIC: [u8; 8] = *b"RADSOL\r\n";
/// Version of the body's layout.
pub const VERSION: u32 = 2;
/// Bytes before the body.
const HEADER_BYTES: usize = 24;

/// Why a solution file was not written or not read.
#[derive(Debug, thiserror::Error)]
pub enum SolutionFileError {
    /// The file system refused.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        error: io::Error,
    },
    /// Another kind of file.
    #[error("{}: not a solution file (it does not start with RADSOL)", path.display())]
    NotASolution {
        /// The file.
        path: PathBuf,
    },
    /// A layout that this program does not read.
    #[error("{}: version {found} of the format; this program reads version {VERSION}", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// The version it states.
        found: u32,
    },
    /// Bytes are missing or left over.
    #[error("{}: {found_bytes} bytes long, its header says {expected_bytes}", path.display())]
    Length {
        /// The file.
        path: PathBuf,
        /// Length of the file.
        found_bytes: u64,
        /// Length that the header asks for.
        expected_bytes: u64,
    },
    /// The bytes are not those that were written.
    #[error("{}: damaged: checksum {found:08x}, its header says {expected:08x}", path.display())]
    Checksum {
        /// The file.
        path: PathBuf,
        /// Of the body as read.
        found: u32,
        /// In the header.
        expected: u32,
    },
    /// The body does not hold a solution.
    #[error("{}: the body is no solution: {what}", path.display())]
    Body {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// The solution belongs to another scene or another mesh of it.
    #[error(
        "{}: made for another scene, or the scene was changed since (fingerprint {found:016x}, the scene has \
         {expected:016x})", path.display()
    )]
    OtherScene {
        /// The file.
        path: PathBuf,
        /// Fingerprint in the file.
        found: u64,
        /// Fingerprint of the scene.
        expected: u64,
    },
}

/// Writes a solution, replacing the file atomically.
///
/// # Errors
/// [`SolutionFileError::Io`] when the file system refuses; the previous file is then untouched.
pub fn save(
    path: &Path,
    scene: &Scene,
    mesh: &Mesh,
    options: &SolveOptions,
    solution: &Solution,
) -> Result<(), SolutionFileError> {
    let io = |error| SolutionFileError::Io { path: path.to_path_buf(), error };
    let bytes = encode(&Body { fingerprint: fingerprint(scene, mesh), options: *options, solution })
        .map_err(|error| io(io::Error::other(error)))?;
    let mut file = AtomicWriteFile::open(path).map_err(io)?;
    file.write_all(&bytes).map_err(io)?;
    file.commit().map_err(io)
}

/// Reads a solution of `scene` as meshed in `mesh`, and the options that it was made with.
///
/// # Errors
/// One [`SolutionFileError`] for every way in which the file can be wrong.
pub fn load(path: &Path, scene: &Scene, mesh: &Mesh) -> Result<(Solution, SolveOptions), SolutionFileError> {
    let bytes = fs::read(path).map_err(|error| SolutionFileError::Io { path: path.to_path_buf(), error })?;
    let body = decode(path, &bytes)?;
    let expected = fingerprint(scene, mesh);
    if body.fingerprint != expected {
        return Err(SolutionFileError::OtherScene {
            path: path.to_path_buf(),
            found: body.fingerprint,
            expected,
        });
    }
    let lengths = (body.solution.element_irradiance.len(), body.solution.vertex_irradiance.len());
    if lengths != (mesh.elements.len(), mesh.vertices.len()) {
        let what = format!(
            "{} elements and {} vertices, the mesh has {} and {}",
            lengths.0,
            lengths.1,
            mesh.elements.len(),
            mesh.vertices.len()
        );
        return Err(SolutionFileError::Body { path: path.to_path_buf(), what });
    }
    Ok((body.solution, body.options))
}

#[derive(Serialize, Deserialize)]
struct Body<S> {
    fingerprint: u64,
    options: SolveOptions,
    solution: S,
}

fn encode(body: &Body<&Solution>) -> Result<Vec<u8>, postcard::Error> {
    let body = postcard::to_stdvec(body)?;
    let mut bytes = Vec::with_capacity(HEADER_BYTES + body.len());
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend(crc32fast::hash(&body).to_le_bytes());
    bytes.extend(body);
    Ok(bytes)
}

fn decode(path: &Path, bytes: &[u8]) -> Result<Body<Solution>, SolutionFileError> {
    let path = || path.to_path_buf();
    let length = |expected_bytes| SolutionFileError::Length {
        path: path(),
        found_bytes: bytes.len() as u64,
        expected_bytes,
    };
    let magic = &bytes[..bytes.len().min(MAGIC.len())];
    if magic.is_empty() || *magic != MAGIC[..magic.len()] {
        return Err(SolutionFileError::NotASolution { path: path() });
    }
    let Some((header, body)) = bytes.split_first_chunk::<HEADER_BYTES>() else {
        return Err(length(HEADER_BYTES as u64));
    };
    let u32_at = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|i| header[at + i]));
    let found = u32_at(8);
    if found != VERSION {
        return Err(SolutionFileError::Version { path: path(), found });
    }
    let body_bytes = u64::from(u32_at(12)) | u64::from(u32_at(16)) << 32;
    if body_bytes != body.len() as u64 {
        return Err(length(body_bytes.saturating_add(HEADER_BYTES as u64)));
    }
    let (found, expected) = (crc32fast::hash(body), u32_at(20));
    if found != expected {
        return Err(SolutionFileError::Checksum { path: path(), found, expected });
    }
    match postcard::take_from_bytes(body) {
        Ok((body, [])) => Ok(body),
        Ok((_, rest)) => {
            Err(SolutionFileError::Body { path: path(), what: format!("{} bytes left over", rest.len()) })
        }
        Err(error) => Err(SolutionFileError::Body { path: path(), what: error.to_string() }),
    }
}

/// A hash of everything that pass 1 reads of a scene and its mesh: equal for equal input, on every machine.
///
/// Source: FNV-1a, 64 bits, over the bits of the numbers. A guard against mistakes, not against malice.
pub fn fingerprint(scene: &Scene, mesh: &Mesh) -> u64 {
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    hash.count(scene.surfaces.len());
    for surface in &scene.surfaces {
        let material = scene.material(surface);
        for rgb in [surface.exitance, material.reflectance, material.specular, material.transmission] {
            hash.rgb(rgb);
        }
        hash.count(usize::from(surface.two_sided));
    }
    hash.count(scene.lights.len());
    for light in &scene.lights {
        match *light {
            Light::Point { position, intensity } => {
                hash.count(1);
                hash.point(position);
                hash.rgb(intensity);
            }
            Light::Spot { position, direction, intensity, inner_deg, outer_deg } => {
                hash.count(2);
                hash.point(position);
                hash.point(direction);
                hash.rgb(intensity);
                hash.number(inner_deg);
                hash.number(outer_deg);
            }
            Light::Directional { direction, irradiance } => {
                hash.count(3);
                hash.point(direction);
                hash.rgb(irradiance);
            }
        }
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

struct Fnv(u64);

impl Fnv {
    fn bits(&mut self, bits: u64) {
        for byte in bits.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    }

    fn count(&mut self, n: usize) {
        self.bits(n as u64);
    }

    /// Adding 0 makes -0 and 0 the same.
    fn number(&mut self, value: f64) {
        self.bits((value + 0.0).to_bits());
    }

    fn point(&mut self, p: DVec3) {
        for c in p.to_array() {
            self.number(c);
        }
    }

    fn rgb(&mut self, rgb: Rgb) {
        for c in rgb.0 {
            self.number(c);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiosity::{EnergyAccount, RowSumError, SplitIrradiance};

    fn solution() -> Solution {
        let e = SplitIrradiance { direct: Rgb([1.0, 2.0, 3.0]), indirect: Rgb([0.5, 0.25, 1e-300]) };
        Solution {
            element_irradiance: vec![e; 3],
            vertex_irradiance: vec![e; 5],
            account: EnergyAccount { emitted_w: Rgb::WHITE, ..EnergyAccount::default() },
            n_shots: 7,
            n_shooters: 2,
            n_rays: 1 << 40,
            row_sum_error: RowSumError { max: 0.1, mean: 0.01 },
            error_estimate: None,
        }
    }

    fn file() -> Vec<u8> {
        encode(&Body { fingerprint: 42, options: SolveOptions::default(), solution: &solution() })
            .expect("a solution can be encoded")
    }

    fn with_crc(mut bytes: Vec<u8>) -> Vec<u8> {
        let crc = crc32fast::hash(&bytes[HEADER_BYTES..]);
        let n = (bytes.len() - HEADER_BYTES) as u64;
        bytes[12..20].copy_from_slice(&n.to_le_bytes());
        bytes[20..24].copy_from_slice(&crc.to_le_bytes());
        bytes
    }

    #[test]
    fn solution_encoded_and_decoded_is_the_same() {
        let body = decode(Path::new("a.radsol"), &file()).expect("what was written can be read");
        assert_eq!((body.fingerprint, body.options), (42, SolveOptions::default()));
        assert_eq!(body.solution, solution());
    }

    #[test]
    fn solution_file_damaged_in_any_way_is_refused_with_its_own_error() {
        let good = file();
        let edit = |at: usize, value: u8| {
            let mut bytes = good.clone();
            bytes[at] = value;
            bytes
        };
        let mut longer = good.clone();
        longer.push(0);
        let mut garbage = good.clone();
        garbage[HEADER_BYTES..].fill(0xff);
        let mut left_over = good.clone();
        left_over.extend([0; 3]);
        type Check = fn(&SolutionFileError) -> bool;
        let not_ours: Check = |e| matches!(e, SolutionFileError::NotASolution { .. });
        let version: Check = |e| matches!(e, SolutionFileError::Version { found: 9, .. });
        let length: Check = |e| matches!(e, SolutionFileError::Length { .. });
        let checksum: Check = |e| matches!(e, SolutionFileError::Checksum { .. });
        let body: Check = |e| matches!(e, SolutionFileError::Body { .. });
        let table: Vec<(&str, Vec<u8>, Check)> = vec![
            ("empty", Vec::new(), not_ours),
            ("a picture", b"\x89PNG\r\n\x1a\n and more of it, long enough".to_vec(), not_ours),
            ("magic", edit(0, b'X'), not_ours),
            ("text mode", edit(6, b'\n'), not_ours),
            ("version", edit(8, 9), version),
            ("cut in the magic", good[..5].to_vec(), length),
            ("cut in the header", good[..HEADER_BYTES - 1].to_vec(), length),
            ("cut after the header", good[..HEADER_BYTES].to_vec(), length),
            ("cut in the body", good[..good.len() - 1].to_vec(), length),
            ("one byte more", longer, length),
            ("huge length", edit(19, 0xff), length),
            ("checksum", edit(20, good[20] ^ 1), checksum),
            ("first body byte", edit(HEADER_BYTES, good[HEADER_BYTES] ^ 0x80), checksum),
            ("last body byte", edit(good.len() - 1, good[good.len() - 1] ^ 1), checksum),
            ("nonsense with a good checksum", with_crc(garbage), body),
            ("left over with a good checksum", with_crc(left_over), body),
        ];
        for (what, bytes, check) in table {
            let Err(error) = decode(Path::new("dir/a.radsol"), &bytes) else { panic!("{what} was accepted") };
            assert!(check(&error), "{what}: {error}");
            assert!(error.to_string().contains("dir/a.radsol"), "{what}: {error}");
        }
    }

    #[test]
    fn solution_file_with_any_bit_flipped_is_refused() {
        let good = file();
        for at in 0..good.len() {
            for bit in 0..8 {
                let mut bytes = good.clone();
                bytes[at] ^= 1 << bit;
                assert!(decode(Path::new("a"), &bytes).is_err(), "byte {at}, bit {bit}");
            }
        }
    }
}
