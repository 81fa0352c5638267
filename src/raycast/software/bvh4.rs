//! A four-wide tree of conservative f32 boxes, four slab tests at a time.
//!
//! ```text
//! patches --obvhs PLOC + reinsertion--> binary tree --collapse by area--> nodes of 4 boxes
//! ray --clip to the scene, f32--> traverse: visits leaves front to back until the visitor has enough
//! ```
//! Space: the scene's box scaled to [-1, 1]^3 about its centre, so that f32 carries 2^-24 absolutely. Conservative
//! because each box grows by [`PAD`] = 2^-21: rounding box and origin takes 2 x 2^-24 (origins are first clipped to
//! [-1.001, 1.001] in f64), f64 normalisation under 2^-40 for origins up to 2^10 scene sizes away. The slab
//! distance (b - o) / d rounds three times: 3 x 2^-24 relative, so far distances grow by 2^-20.
//! Source: Wald et al. 2008 (wide trees); Ize 2013 (robust slabs).

use glam::{DVec3, Vec3A, Vec4};
use obvhs::aabb::Aabb as BvhBox;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

use crate::geom::Aabb;

/// Growth of every box, in half scene sizes.
const PAD: f32 = 1.0 / (1 << 21) as f32;
/// Growth of far distances.
const FAR_SLACK: f32 = 1.0 + 1.0 / (1 << 20) as f32;
/// Largest slab factor: a finite stand-in for 1/0 beyond any distance in the normalised scene.
const MAX_INVERSE: f64 = 1e30;

const LEAF: u32 = 1 << 31;
const LEAF_COUNT_SHIFT: u32 = 27;
const EMPTY: u32 = u32::MAX;
const MAX_LEAF: u32 = 4;

/// Four boxes: per axis the lower, then the upper bounds; then what is in them.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Node {
    bounds: [[Vec4; 2]; 3],
    child: [u32; 4],
}

/// The tree. Leaves hold ranges of primitives in [`Bvh4::order`].
#[derive(Clone, Debug)]
pub(super) struct Bvh4 {
    pub nodes: Vec<Node>,
    /// Primitive at each place of the leaves' ranges.
    pub order: Vec<u32>,
    center: DVec3,
    inv_half: f64,
}

struct PrimitiveBox(BvhBox);

impl Boundable for PrimitiveBox {
    fn aabb(&self) -> BvhBox {
        self.0
    }
}

/// A subtree that still has to be visited.
pub(super) type Pending = (u32, f32);

impl Bvh4 {
    /// Builds over the boxes of primitives (m), all finite.
    pub fn build(boxes: &[Aabb]) -> Bvh4 {
        let scene =
            boxes.iter().fold(Aabb::EMPTY, |s, b| Aabb { min: s.min.min(b.min), max: s.max.max(b.max) });
        if scene.is_empty() {
            return Bvh4 { nodes: Vec::new(), order: Vec::new(), center: DVec3::ZERO, inv_half: 1.0 };
        }
        let center = 0.5 * (scene.min + scene.max);
        let inv_half = 2.0 / scene.size().max_element().max(f64::MIN_POSITIVE.sqrt());
        let primitives: Vec<PrimitiveBox> = boxes
            .iter()
            .map(|b| {
                let min = ((b.min - center) * inv_half).as_vec3a();
                let max = ((b.max - center) * inv_half).as_vec3a();
                PrimitiveBox(BvhBox::new(min - Vec3A::splat(PAD), max + Vec3A::splat(PAD)))
            })
            .collect();
        let params = BvhBuildParams { max_prims_per_leaf: MAX_LEAF, ..BvhBuildParams::medium_build() };
        let binary = build_bvh2(&primitives, params, &mut std::time::Duration::default());
        let mut tree = Bvh4 { nodes: Vec::new(), order: Vec::new(), center, inv_half };
        let root = &binary.nodes[0];
        let top = if root.is_leaf() { vec![0] } else { widen(&binary.nodes, root.first_index as usize) };
        tree.collapse(&binary, top);
        tree
    }

    /// Turns the binary nodes `slots` (at most four) into one wide node, depth first without recursion.
    fn collapse(&mut self, binary: &obvhs::bvh2::Bvh2, top: Vec<usize>) {
        let mut work = vec![(top, None::<(usize, usize)>)];
        while let Some((slots, parent)) = work.pop() {
            let index = self.nodes.len();
            if let Some((node, slot)) = parent {
                self.nodes[node].child[slot] = index as u32;
            }
            let mut bounds = [[[f32::INFINITY; 4], [f32::NEG_INFINITY; 4]]; 3];
            let mut child = [EMPTY; 4];
            for (slot, &b) in slots.iter().enumerate() {
                let node = &binary.nodes[b];
                for (axis, [lower, upper]) in bounds.iter_mut().enumerate() {
                    lower[slot] = node.aabb().min[axis];
                    upper[slot] = node.aabb().max[axis];
                }
                if node.is_leaf() {
                    let first = self.order.len() as u32;
                    let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
                    self.order.extend_from_slice(&binary.primitive_indices[range]);
                    child[slot] = LEAF | (node.prim_count - 1) << LEAF_COUNT_SHIFT | first;
                } else {
                    work.push((widen(&binary.nodes, node.first_index as usize), Some((index, slot))));
                }
            }
            self.nodes.push(Node { bounds: bounds.map(|b| b.map(Vec4::from_array)), child });
        }
    }

    /// Visits leaves that the ray `origin + t dir` (scene space, any length of `dir`) may meet in
    /// `t_min..=limit`, front to back. `visit(range of order)` returns the new limit; a negative-infinite limit ends.
    #[inline]
    pub fn traverse(
        &self,
        stack: &mut Vec<Pending>,
        origin: DVec3,
        dir: DVec3,
        t_min: f64,
        mut limit: f64,
        mut visit: impl FnMut(std::ops::Range<usize>) -> f64,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        let d = dir * self.inv_half;
        let scale = d.abs().max_element();
        let d = d / scale;
        let o = (origin - self.center) * self.inv_half;
        let Some(enter) = clip(o, d) else { return };
        let o = o + enter * d;
        // Distances in the clipped, normalised frame: (t * scale - enter), widened outward to f32.
        let to_frame = |t: f64| (t * scale - enter) as f32;
        let widen_by = |x: f32| x.abs() * (FAR_SLACK - 1.0) + PAD;
        let low = to_frame(t_min);
        let low = Vec4::splat(low - widen_by(low));
        let mut high = to_frame(limit);
        high += widen_by(high);

        let inv = DVec3::from_array(d.to_array().map(|x| (1.0 / x).clamp(-MAX_INVERSE, MAX_INVERSE)));
        // 1 where the ray runs toward smaller coordinates: there the upper bound is the near one. The sign is that of
        // the inverse, since 1 / -0.0 is negative too.
        let [sx, sy, sz] = [inv.x < 0.0, inv.y < 0.0, inv.z < 0.0].map(usize::from);
        let o = o.as_vec3();
        let inv = inv.as_vec3();
        let (ox, oy, oz) = (Vec4::splat(o.x), Vec4::splat(o.y), Vec4::splat(o.z));
        let (ix, iy, iz) = (Vec4::splat(inv.x), Vec4::splat(inv.y), Vec4::splat(inv.z));

        stack.clear();
        let mut current = 0u32;
        loop {
            if current & LEAF == 0 {
                let node = &self.nodes[current as usize];
                let [x, y, z] = &node.bounds;
                let (near_x, far_x) = ((x[sx] - ox) * ix, (x[1 - sx] - ox) * ix);
                let (near_y, far_y) = ((y[sy] - oy) * iy, (y[1 - sy] - oy) * iy);
                let (near_z, far_z) = ((z[sz] - oz) * iz, (z[1 - sz] - oz) * iz);
                let near = near_x.max(near_y).max(near_z).max(low);
                let far = (far_x.min(far_y).min(far_z) * FAR_SLACK).min(Vec4::splat(high));
                let mut mask = near.cmple(far).bitmask();
                if mask != 0 {
                    if mask & (mask - 1) == 0 {
                        current = node.child[mask.trailing_zeros() as usize & 3];
                        continue;
                    }
                    let near = near.to_array();
                    let first = stack.len();
                    while mask != 0 {
                        let slot = mask.trailing_zeros() as usize & 3;
                        mask &= mask - 1;
                        stack.push((node.child[slot], near[slot]));
                        // Farthest first, so that the nearest is popped next; at most four: insertion.
                        let mut i = stack.len() - 1;
                        while i > first && stack[i - 1].1 < stack[i].1 {
                            stack.swap(i - 1, i);
                            i -= 1;
                        }
                    }
                }
            } else {
                let first = (current & ((1 << LEAF_COUNT_SHIFT) - 1)) as usize;
                let count = ((current & !LEAF) >> LEAF_COUNT_SHIFT) as usize + 1;
                let new_limit = visit(first..first + count);
                if new_limit < limit {
                    if new_limit == f64::NEG_INFINITY {
                        return;
                    }
                    limit = new_limit;
                    high = to_frame(limit);
                    high += widen_by(high);
                }
            }
            loop {
                match stack.pop() {
                    None => return,
                    Some((next, near)) if near <= high => {
                        current = next;
                        break;
                    }
                    Some(_) => {}
                }
            }
        }
    }
}

/// Two binary children, the larger inner ones replaced by their children until there are four.
fn widen(nodes: &[obvhs::bvh2::node::Bvh2Node], first: usize) -> Vec<usize> {
    let mut slots = vec![first, first + 1];
    while slots.len() < 4 {
        let area = |&i: &usize| nodes[slots[i]].aabb().half_area();
        let largest = (0..slots.len())
            .filter(|&i| !nodes[slots[i]].is_leaf())
            .max_by(|a, b| area(a).total_cmp(&area(b)));
        let Some(largest) = largest else { break };
        let child = nodes[slots[largest]].first_index as usize;
        slots[largest] = child;
        slots.push(child + 1);
    }
    slots
}

/// Distance by which a far origin is moved along `d` to the slightly grown normalised scene; 0 when it is inside,
/// `None` when the line never comes near.
fn clip(o: DVec3, d: DVec3) -> Option<f64> {
    const SIDE: f64 = 1.001;
    if o.abs().max_element() <= SIDE {
        return Some(0.0);
    }
    let (mut near, mut far) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        if d[axis] == 0.0 {
            if o[axis].abs() > SIDE {
                return None;
            }
            continue;
        }
        let a = (-SIDE - o[axis]) / d[axis];
        let b = (SIDE - o[axis]) / d[axis];
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    (near <= far).then_some(near)
}
