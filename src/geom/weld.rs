//! Points that are one, and sets that grow together: the two small indices that meshing needs.
//!
//! ```text
//! point --grid hash, 27 cells--> (id, the first point seen within the tolerance)
//! ```

use std::collections::HashMap;

use crate::geom::DVec3;

/// Gives points within a tolerance of each other one id and one position.
pub(crate) struct Welder {
    tolerance_m: f64,
    cell_m: f64,
    points: Vec<DVec3>,
    /// Next point of the same cell.
    next: Vec<u32>,
    /// First point of each occupied cell.
    first: HashMap<[i64; 3], u32>,
}

const NONE: u32 = u32::MAX;

impl Welder {
    pub(crate) fn new(tolerance_m: f64) -> Welder {
        // Cells much larger than the tolerance: nearly every look-up needs one cell only.
        let cell_m = 64.0 * tolerance_m;
        Welder { tolerance_m, cell_m, points: Vec::new(), next: Vec::new(), first: HashMap::new() }
    }

    /// The id of the point and the position that all points of that id share.
    pub(crate) fn weld(&mut self, point: DVec3) -> (u32, DVec3) {
        let low = self.cell(point - DVec3::splat(self.tolerance_m));
        let high = self.cell(point + DVec3::splat(self.tolerance_m));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    if let Some(id) = self.find_in([x, y, z], point) {
                        return (id, self.points[id as usize]);
                    }
                }
            }
        }
        let id = self.points.len() as u32;
        self.points.push(point);
        let head = self.first.insert(self.cell(point), id);
        self.next.push(head.unwrap_or(NONE));
        (id, point)
    }

    fn find_in(&self, cell: [i64; 3], point: DVec3) -> Option<u32> {
        let mut id = *self.first.get(&cell)?;
        while id != NONE {
            if self.points[id as usize].distance(point) <= self.tolerance_m {
                return Some(id);
            }
            id = self.next[id as usize];
        }
        None
    }

    fn cell(&self, point: DVec3) -> [i64; 3] {
        (point / self.cell_m).to_array().map(|c| c.floor() as i64)
    }
}

/// Disjoint sets over `0..n`, the smallest member is the root.
pub(crate) struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    pub(crate) fn new(n: usize) -> DisjointSets {
        DisjointSets { parent: (0..n as u32).collect() }
    }

    pub(crate) fn find(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            let up = self.parent[self.parent[i as usize] as usize];
            self.parent[i as usize] = up;
            i = up;
        }
        i
    }

    pub(crate) fn union(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn welder_points_within_the_tolerance_share_the_first_position() {
        let mut welder = Welder::new(1e-6);
        let mut n = 0;
        for k in 0..1000 {
            let p = DVec3::new(64e-6 * f64::from(k), -1.0, 1.0 / 3.0);
            let (id, at) = welder.weld(p);
            let (near, near_at) = welder.weld(p + DVec3::new(-5e-7, 5e-7, 0.0));
            assert_eq!((id, at), (near, near_at), "point {k}");
            assert_ne!(welder.weld(p + DVec3::new(3e-6, 0.0, 0.0)).0, id);
            n += 1;
        }
        assert_eq!(n, 1000);
    }

    #[test]
    fn disjoint_sets_chain_of_unions_has_one_root() {
        let mut sets = DisjointSets::new(10);
        for i in (0..8).rev() {
            sets.union(i + 1, i);
        }
        assert!((0..9).all(|i| sets.find(i) == 0));
        assert_eq!(sets.find(9), 9);
    }
}
