//! Vectors as a reader gathers them: every record is checked against the formats and against those before it.

use std::collections::HashMap;

use rtl_model::datapath::{HitWords, PatchError, PatchWords, RayError};
use rtl_model::fixed::Formats;
use rtl_model::packet::PATCH_ID_BITS;

use super::{Expected, Fault, MAX_PATCHES, MAX_RAYS, MAX_TESTS, RayVector, TestVector, Vectors};

/// Finest grid of the board: log2 of its cells a side; the coarsest has 2^1.
pub(super) const MAX_GRID_LOG2: u32 = 7;
/// Largest patch id.
pub(super) const MAX_ID: u32 = (1 << PATCH_ID_BITS) - 1;

/// Vectors so far.
#[derive(Debug)]
pub(super) struct Builder {
    vectors: Vectors,
    /// Places of the patches by id.
    places: HashMap<u32, usize>,
}

impl Builder {
    /// No records yet, words of `formats`.
    pub(super) fn new(formats: Formats) -> Result<Builder, Fault> {
        formats.validate().map_err(|e| Fault::new(e.name, e.value, format!("{} to {}", e.min, e.max)))?;
        let (patches, rays, tests) = (Vec::new(), Vec::new(), Vec::new());
        let vectors = Vectors { formats, grid_log2: None, patches, rays, tests };
        Ok(Builder { vectors, places: HashMap::new() })
    }

    pub(super) fn formats(&self) -> &Formats {
        &self.vectors.formats
    }

    pub(super) fn patches(&self) -> &[PatchWords] {
        &self.vectors.patches
    }

    /// Patches, rays and tests so far.
    pub(super) fn counts(&self) -> [usize; 3] {
        [self.vectors.patches.len(), self.vectors.rays.len(), self.vectors.tests.len()]
    }

    /// The grid, which stands once and before every record.
    pub(super) fn grid(&mut self, log2_cells: u32) -> Result<(), Fault> {
        if !(1..=MAX_GRID_LOG2).contains(&log2_cells) {
            return Err(Fault::new("the grid", log2_cells, format!("1 to {MAX_GRID_LOG2}")));
        }
        if let Some(first) = self.vectors.grid_log2 {
            return Err(Fault::new("the grid", "there twice", format!("once: it is {first} already")));
        }
        if self.counts() != [0; 3] {
            return Err(Fault::new("the grid", "behind other records", "before patches, rays and tests"));
        }
        self.vectors.grid_log2 = Some(log2_cells);
        Ok(())
    }

    /// The place of the patch with this id.
    pub(super) fn place_of(&self, id: u32) -> Option<usize> {
        self.places.get(&id).copied()
    }

    pub(super) fn patch(&mut self, patch: PatchWords) -> Result<(), Fault> {
        limit("patch", self.vectors.patches.len(), MAX_PATCHES)?;
        patch.validate(self.formats()).map_err(|e| match e {
            PatchError::Word { field, value, min, max } => {
                Fault::new(field, value, format!("{min} to {max}"))
            }
            PatchError::FourthCorner { fourth, third } => {
                Fault::new("corner 3 of a triangle", format!("{fourth:?}"), format!("{third:?}, as corner 2"))
            }
        })?;
        let place = self.vectors.patches.len();
        if let Some(first) = self.places.insert(patch.id, place) {
            let expected = format!("another: patch {} of the file has it already", first + 1);
            return Err(Fault::new("the id", patch.id, expected));
        }
        self.vectors.patches.push(patch);
        Ok(())
    }

    pub(super) fn ray(&mut self, ray: RayVector) -> Result<(), Fault> {
        limit("ray", self.vectors.rays.len(), MAX_RAYS)?;
        ray.words.validate(self.formats()).map_err(|e| match e {
            RayError::Word { field, value, min, max } => Fault::new(field, value, format!("{min} to {max}")),
            RayError::NoDirection => Fault::new("the direction", "0,0,0", "at least one word other than 0"),
        })?;
        match (&ray.expected, ray.any_hit) {
            (Some(Expected::Nearest(hit)), false) => self.hit(*hit)?,
            (Some(Expected::Any(_)), true) | (None, _) => {}
            (Some(Expected::Nearest(_)), true) => {
                return Err(Fault::new("the answer of an any-hit ray", "a hit record", "miss or hit"));
            }
            (Some(Expected::Any(_)), false) => {
                return Err(Fault::new("the answer of a nearest-hit ray", "one bit", "miss or t,patch,side"));
            }
        }
        self.vectors.rays.push(ray);
        Ok(())
    }

    pub(super) fn test(&mut self, test: TestVector) -> Result<(), Fault> {
        limit("test", self.vectors.tests.len(), MAX_TESTS)?;
        let place = |field, place: usize, count: usize| match place < count {
            true => Ok(()),
            false => Err(Fault::new(
                field,
                place,
                format!("the number of one before it, of which there are {count}"),
            )),
        };
        place("the test's ray", test.ray, self.vectors.rays.len())?;
        place("the test's patch", test.patch, self.vectors.patches.len())?;
        self.hit(test.hit)?;
        let two = !self.vectors.patches[test.patch].is_triangle;
        if test.wires.triangles.map(|t| t.is_some()) != [true, two] {
            return Err(Fault::new(
                "the number of triangles with wires",
                "another",
                if two { "2" } else { "1" },
            ));
        }
        self.vectors.tests.push(test);
        Ok(())
    }

    /// A hit record that the board could write.
    fn hit(&self, hit: Option<HitWords>) -> Result<(), Fault> {
        let Some(hit) = hit else { return Ok(()) };
        let limit = self.formats().t_limit();
        if hit.t > limit {
            return Err(Fault::new("t of the hit", hit.t, format!("0 to {limit}")));
        }
        if hit.patch > MAX_ID {
            return Err(Fault::new("patch of the hit", hit.patch, format!("0 to {MAX_ID}")));
        }
        Ok(())
    }

    /// The file, complete.
    pub(super) fn finish(self) -> Vectors {
        self.vectors
    }
}

fn limit(what: &str, so_far: usize, most: usize) -> Result<(), Fault> {
    if so_far < most {
        return Ok(());
    }
    Err(Fault::new(
        format!("the number of {what} records"),
        format!("over {most}"),
        format!("at most {most}"),
    ))
}
