//! Random closed meshes of board patches and rays from inside them, for the tests and the measurement of
//! watertightness.
//!
//! ```text
//! seed -> surface (corners shared by index) -> quantised, cut into quads and triangles -> mesh
//!                                   mesh, seed -> origin inside (odd number of crossings) -> rays at corners and edges
//! ```
//! Every mesh is closed by construction: an edge belongs to an even number of triangles, and its corners are the same
//! words in all of them.

pub mod inside;
pub mod leaks;
pub mod random;
pub mod rays;
pub mod surfaces;

use rtl_model::datapath::PatchWords;

use random::Random;
use surfaces::Surface;

/// What faces are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Faces {
    /// Two triangle patches a face, either diagonal.
    Triangles,
    /// One quad patch a face.
    Quads,
    /// Some of each.
    Mixed,
}

impl Faces {
    /// All of them.
    pub const ALL: [Faces; 3] = [Faces::Triangles, Faces::Quads, Faces::Mixed];
}

/// A closed mesh in coordinate words.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// F.
    pub coord_frac_bits: u32,
    /// All corners.
    pub vertices: Vec<[i32; 3]>,
    /// All patches, ids in order.
    pub patches: Vec<PatchWords>,
    /// Points that are likely inside.
    pub cores: Vec<[i32; 3]>,
}

impl Mesh {
    /// Quantises a surface to multiples of `snap` steps, so that edges have `snap` - 1 points that are words, and cuts its
    /// faces. Where a face starts, which way it runs round and where it is cut is random: watertightness must not depend
    /// on it.
    pub fn new(surface: &Surface, f: u32, snap: i32, faces: Faces, random: &mut Random) -> Mesh {
        let one = 1_i32 << f;
        let word = |x: f64| {
            let place = (x * f64::from(one) / f64::from(snap)).round() as i32;
            place.clamp(-(one / snap), (one - 1) / snap) * snap
        };
        let vertices: Vec<[i32; 3]> = surface.vertices.iter().map(|v| v.map(word)).collect();
        let mut patches = Vec::new();
        for face in &surface.faces {
            let start = random.below(4);
            let turn = if random.below(2) == 0 { 1 } else { 3 };
            let corners = [0, 1, 2, 3].map(|k| vertices[face[(start + turn * k) % 4]]);
            let as_quad = match faces {
                Faces::Triangles => false,
                Faces::Quads => true,
                Faces::Mixed => random.below(2) == 0,
            };
            let mut push = |corners, is_triangle| {
                let id = u32::try_from(patches.len()).expect("a small mesh");
                patches.push(PatchWords { corners, is_triangle, id });
            };
            let [v0, v1, v2, v3] = corners;
            if as_quad {
                push(corners, false);
            } else {
                push([v0, v1, v2, v2], true);
                push([v2, v3, v0, v0], true);
            }
        }
        let cores = surface.cores.iter().map(|v| v.map(word)).collect();
        Mesh { coord_frac_bits: f, vertices, patches, cores }
    }

    /// A random shape with random faces.
    pub fn any(f: u32, snap: i32, random: &mut Random) -> Mesh {
        let shape = surfaces::Shape::ALL[random.below(surfaces::Shape::ALL.len())];
        let faces = Faces::ALL[random.below(Faces::ALL.len())];
        Mesh::new(&Surface::any(shape, random), f, snap, faces, random)
    }

    /// All triangles: a triangle patch is one, a quad is two that share the diagonal v0 v2.
    pub fn triangles(&self) -> impl Iterator<Item = [[i32; 3]; 3]> {
        self.patches.iter().flat_map(|patch| {
            let [v0, v1, v2, v3] = patch.corners;
            let second = (!patch.is_triangle).then_some([v0, v2, v3]);
            [Some([v0, v1, v2]), second].into_iter().flatten()
        })
    }

    /// A random edge of a random patch, a quad's diagonal included.
    pub fn edge(&self, random: &mut Random) -> [[i32; 3]; 2] {
        let patch = &self.patches[random.below(self.patches.len())];
        let edges: &[(usize, usize)] = if patch.is_triangle {
            &[(0, 1), (1, 2), (2, 0)]
        } else {
            &[(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)]
        };
        let (i, j) = edges[random.below(edges.len())];
        [patch.corners[i], patch.corners[j]]
    }
}
