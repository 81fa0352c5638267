//! The element's mean.

use super::field::Field;
use crate::mesh::{Mesh, SurfacePoint};
use crate::units::Rgb;

/// One value per element.
#[derive(Debug)]
pub(super) struct Constant {
    means: Vec<Rgb>,
}

impl Constant {
    pub(super) fn new(means: &[Rgb]) -> Constant {
        Constant { means: means.to_vec() }
    }
}

impl Field for Constant {
    fn value(&self, _: &Mesh, at: SurfacePoint) -> Rgb {
        self.means[at.element.0 as usize]
    }

    fn gradient(&self, _: &Mesh, _: SurfacePoint) -> [Rgb; 3] {
        [Rgb::BLACK; 3]
    }

    fn memory_bytes(&self) -> usize {
        self.means.capacity() * size_of::<Rgb>()
    }
}
