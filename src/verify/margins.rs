//! How far each wire of the width table was used.
//!
//! ```text
//! tests, cells, bundles --largest magnitude per wire--> Seen --width table--> WireMargin: bits that nothing needed
//! ```
//! `t` is that of hits; `end_product` is that of a ray's last cell, and of every cell of a ray that hits nothing: in
//! between the limit of t is not observed. `cell_product` is the largest of the products that decide the crossing.
//! Wires of bundles are those of the descriptors of all verified rays; of n x m rays they are largest at a corner.
//!
//! Not observed: the wires of the hemisphere's table and of a direction before its scale is halved once more, which the
//! datapath keeps to itself. They have a row without magnitudes, and so has a wire on which
//! nothing but 0 was seen: a scene that does not exercise a wire says nothing about its spare bits.

use rtl_model::datapath::bundle::{BundleWords, JITTER_BITS};
use rtl_model::datapath::ray_patch::Taps;
use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::fixed::{Formats, Rounding, WireWidth};
use rtl_model::functional::RayTrace;
use rtl_model::memory_image::MemoryImage;

use super::WireMargin;

/// Largest magnitudes seen, by wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Seen {
    coordinate: u128,
    direction: u128,
    a: u128,
    c: u128,
    e: u128,
    n: u128,
    den: u128,
    num: u128,
    num_shifted: u128,
    den_shifted: u128,
    t: u128,
    cell_plane: u128,
    cell_num: u128,
    cell_den: u128,
    cell_product: u128,
    cell_num_shifted: u128,
    end_product: u128,
    tile_product: u128,
    tile_direction: u128,
    target_direction: u128,
    fan_product: u128,
    fan_num: u128,
    fan_den: u128,
}

/// Wires that carry no sign.
const UNSIGNED: [&str; 7] =
    ["t", "cell_num", "cell_den", "cell_product", "cell_num_shifted", "end_product", "fan_den"];

impl Seen {
    /// The larger of both, wire by wire.
    pub fn max(mut self, other: &Seen) -> Seen {
        let mut theirs = *other;
        for ((_, mine), (_, their)) in self.wires().into_iter().zip(theirs.wires()) {
            *mine = (*mine).max(*their);
        }
        self
    }

    /// Every wire with its name in the width table.
    fn wires(&mut self) -> [(&'static str, &mut u128); 23] {
        [
            ("coordinate", &mut self.coordinate),
            ("direction", &mut self.direction),
            ("a", &mut self.a),
            ("c", &mut self.c),
            ("e", &mut self.e),
            ("n", &mut self.n),
            ("den", &mut self.den),
            ("num", &mut self.num),
            ("num_shifted", &mut self.num_shifted),
            ("den_shifted", &mut self.den_shifted),
            ("t", &mut self.t),
            ("cell_plane", &mut self.cell_plane),
            ("cell_num", &mut self.cell_num),
            ("cell_den", &mut self.cell_den),
            ("cell_product", &mut self.cell_product),
            ("cell_num_shifted", &mut self.cell_num_shifted),
            ("end_product", &mut self.end_product),
            ("tile_product", &mut self.tile_product),
            ("tile_direction", &mut self.tile_direction),
            ("target_direction", &mut self.target_direction),
            ("fan_product", &mut self.fan_product),
            ("fan_num", &mut self.fan_num),
            ("fan_den", &mut self.fan_den),
        ]
    }

    /// One ray x patch test.
    pub fn test(&mut self, ray: &RayWords, patch: &PatchWords, taps: &Taps, hit: Option<HitWords>) {
        raise_words(&mut self.coordinate, patch.corners.iter().chain([&ray.origin]));
        raise_words(&mut self.direction, [&ray.dir]);
        raise(&mut self.a, taps.a.iter().flatten().map(|w| w.unsigned_abs()));
        raise(&mut self.c, taps.c.iter().flatten().map(|w| w.unsigned_abs()));
        raise(&mut self.e, taps.e.iter().map(|w| w.unsigned_abs()));
        for triangle in taps.triangles.iter().flatten() {
            raise(&mut self.n, triangle.n.iter().map(|w| w.unsigned_abs()));
            raise(&mut self.den, [triangle.den.unsigned_abs()]);
            raise(&mut self.num, [triangle.num.unsigned_abs()]);
            raise(&mut self.den_shifted, [triangle.den_shifted.unsigned_abs()]);
            raise(&mut self.num_shifted, [triangle.num_shifted.unsigned_abs()]);
        }
        raise(&mut self.t, hit.map(|hit| hit.t));
    }

    /// The cells that a traced ray entered: the walk depends on the ray alone, its end on the trace.
    pub fn cells(&mut self, image: &MemoryImage, ray: &RayWords, trace: &RayTrace) {
        let (formats, grid) = (&image.formats, &image.grid);
        let (up, down) = formats.t_shifts();
        let limit_t = trace.hit.map_or(ray.t_max, |hit| hit.t);
        let cube = 1i64 << formats.coord_frac_bits;
        let mut cell = grid.cell_of(formats, ray.origin);
        for number in 1..=trace.cells {
            let crossing = grid.crossing(formats, ray, cell);
            let (num, den) = (u128::from(crossing.num), u128::from(crossing.den));
            raise(&mut self.cell_num, [num]);
            raise(&mut self.cell_den, [den]);
            raise(&mut self.cell_num_shifted, [num << up]);
            for k in (0..3).filter(|&k| ray.dir[k] != 0) {
                let plane = i64::from(cell.0[k]) + i64::from(ray.dir[k] > 0);
                let plane = (plane << grid.cell_log2(formats)) - cube;
                let ahead = plane - i64::from(ray.origin[k]);
                raise(&mut self.cell_plane, [plane.unsigned_abs()]);
                raise(&mut self.cell_product, [u128::from(ahead.unsigned_abs()) * den]);
            }
            if trace.hit.is_none() || number == trace.cells {
                raise(&mut self.end_product, [(2 * u128::from(limit_t) + 1) * (den << down)]);
            }
            let Some(next) = crossing.next else { break };
            cell = next;
        }
    }

    /// A descriptor.
    pub fn bundle(&mut self, bundle: &BundleWords) {
        match bundle {
            BundleWords::Tile { corner, step_u, step_v, n, m, .. } => {
                for k in 0..3 {
                    let (u, v) = (i64::from(n - 1) * step_u[k], i64::from(m - 1) * step_v[k]);
                    let sums = [corner[k] + u, corner[k] + v, corner[k] + u + v];
                    raise(&mut self.tile_product, [u, v].map(i64::unsigned_abs));
                    raise(&mut self.tile_direction, [corner[k], step_u[k], step_v[k]].map(i64::unsigned_abs));
                    raise(&mut self.tile_direction, sums.map(i64::unsigned_abs));
                }
            }
            BundleWords::Fan { apex, vertices, n, m, jitter } => {
                let (n, m) = (i128::from(*n), i128::from(*m));
                let [js, jt] = jitter.map(i128::from);
                let den = (n * m) << JITTER_BITS;
                raise(&mut self.fan_den, [den.unsigned_abs()]);
                for k in 0..3 {
                    let [v0, v1, v2] = vertices.map(|vertex| i128::from(vertex[k]));
                    let along_u = [0, n - 1].map(|i| ((i << JITTER_BITS) + js) * (v1 - v0) * m);
                    let along_v = [0, m - 1].map(|j| ((j << JITTER_BITS) + jt) * (v2 - v0) * n);
                    raise(&mut self.fan_product, along_u.iter().chain(&along_v).map(|w| w.unsigned_abs()));
                    for num in along_u.iter().flat_map(|u| along_v.map(|v| v0 * den + u + v)) {
                        let point = Rounding::NearestEven.divide(num, den);
                        raise(&mut self.fan_num, [num.unsigned_abs()]);
                        raise(&mut self.target_direction, [(point - i128::from(apex[k])).unsigned_abs()]);
                    }
                }
            }
            BundleWords::Targets { apex, points } => {
                let along = |p: &[i32; 3], k: usize| (i64::from(p[k]) - i64::from(apex[k])).unsigned_abs();
                raise(
                    &mut self.target_direction,
                    points.iter().flat_map(|p| (0..3).map(move |k| along(p, k))),
                );
            }
            BundleWords::Hemisphere { .. } => {}
        }
    }

    /// Against the width table.
    pub fn margins(mut self, formats: &Formats) -> Vec<WireMargin> {
        let observed = self.wires().map(|(wire, seen)| (wire, *seen));
        let row = |row: WireWidth| {
            let largest = observed.iter().find(|(wire, _)| *wire == row.wire).map(|(_, seen)| *seen);
            let seen = largest.filter(|seen| *seen > 0);
            let signed = !UNSIGNED.contains(&row.wire);
            let needed = |seen: u128| u128::BITS - seen.leading_zeros() + u32::from(signed);
            WireMargin {
                wire: row.wire,
                bits: row.bits,
                signed,
                max_magnitude: row.max_magnitude.unsigned_abs(),
                observed: largest.is_some(),
                seen,
                // -2^F takes no more bits than 2^F - 1.
                spare_bits: seen.map(|seen| row.bits.saturating_sub(needed(seen))),
            }
        };
        formats.width_table().into_iter().map(row).collect()
    }
}

fn raise<T: Into<u128>>(largest: &mut u128, values: impl IntoIterator<Item = T>) {
    *largest = values.into_iter().map(Into::into).fold(*largest, u128::max);
}

fn raise_words<'a>(largest: &mut u128, words: impl IntoIterator<Item = &'a [i32; 3]>) {
    raise(largest, words.into_iter().flatten().map(|w| w.unsigned_abs()));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// See the module's header.
    const NOT_OBSERVED: [&str; 4] =
        ["hemisphere_word", "hemisphere_product", "hemisphere_direction", "direction_rounded"];

    #[test]
    fn margins_have_a_row_for_every_wire_of_the_table_and_magnitudes_only_of_what_was_seen() {
        let formats = Formats::default();
        let margins = Seen { den: 1, ..Seen::default() }.margins(&formats);
        let table = formats.width_table();
        let wires: Vec<_> = margins.iter().map(|m| m.wire).collect();
        assert_eq!(wires, table.iter().map(|row| row.wire).collect::<Vec<_>>());
        let without: Vec<_> = margins.iter().filter(|m| !m.observed).map(|m| m.wire).collect();
        assert_eq!(without, NOT_OBSERVED);
        assert!(UNSIGNED.iter().all(|wire| wires.contains(wire)));
        for margin in &margins {
            assert_eq!(margin.seen, (margin.wire == "den").then_some(1), "{margin:?}");
            assert_eq!(margin.spare_bits.is_some(), margin.wire == "den", "{margin:?}");
        }
    }

    #[test]
    fn margin_beyond_2_to_53_is_a_decimal_string_in_json_and_of_nothing_seen_null() {
        let seen = Seen { num: (1 << 60) + 1, ..Seen::default() };
        let margins = serde_json::to_value(seen.margins(&Formats::default())).unwrap();
        let of = |wire: &str| margins.as_array().unwrap().iter().find(|m| m["wire"] == wire).unwrap().clone();
        assert_eq!(of("num")["seen"], "1152921504606846977");
        assert_eq!(of("coordinate")["max_magnitude"], "16777216");
        assert!(of("e")["seen"].is_null() && of("e")["spare_bits"].is_null());
    }

    #[test]
    fn seen_of_a_fan_at_the_cubes_corners_is_as_by_hand() {
        let vertices = [[-16, 0, 0], [15, 0, 0], [-16, 8, 0]];
        let fan = BundleWords::Fan { apex: [15, 0, 1], vertices, n: 2, m: 4, jitter: [2048, 0] };
        let mut seen = Seen::default();
        seen.bundle(&fan);
        assert_eq!(seen.fan_den, 8 * 4096);
        // Along x: place 3/4 of an edge of 31 words; along y: 3/4 of 8.
        assert_eq!(seen.fan_product, 31 * 8 * 4096 * 3 / 4);
        // At x = -16 + 31/4 = -8.25 and 7.25, y = 0 to 6.
        assert_eq!(seen.fan_num, 33 * 2 * 4096);
        assert_eq!(seen.target_direction, 23, "from 15 to -8");
    }

    #[test]
    fn margins_of_known_magnitudes_count_the_bits_above_them_and_the_sign() {
        let formats = Formats::default();
        let one = 1u128 << 24;
        let seen = Seen { coordinate: one, direction: one / 2 - 1, t: 4 * one, ..Seen::default() };
        let margins = seen.max(&Seen { a: 1, t: 1, ..Seen::default() }).margins(&formats);
        let spare = |wire| margins.iter().find(|m| m.wire == wire).map(|m| (m.bits, m.spare_bits));
        assert_eq!(spare("coordinate"), Some((25, Some(0))), "the word -1.0");
        assert_eq!(spare("direction"), Some((25, Some(1))));
        assert_eq!(spare("t"), Some((27, Some(0))));
        assert_eq!(spare("a"), Some((26, Some(24))));
        assert_eq!(spare("c"), Some((52, None)), "not exercised");
    }
}
