//! Tests of the comparison of wires: one wrong bit anywhere is found and named.

use crate::datapath::ray_patch::{Taps, taps};
use crate::datapath::test_support::formats;
use crate::datapath::{PatchWords, RayWords};
use crate::oracle::{WireName, Wires, wires};

fn quad() -> (Wires, Taps) {
    let formats = formats(8, 8, 8);
    let ray = RayWords { origin: [3, -4, 5], dir: [200, 30, -7], t_max: 1024 };
    let corners = [[90, -60, -50], [100, 70, -60], [80, 65, 77], [85, -71, 66]];
    let patch = PatchWords { corners, is_triangle: false, id: 1 };
    (wires(&formats, &ray, &patch), taps(&formats, &ray, &patch))
}

#[test]
fn difference_of_equal_wires_is_none_and_all_are_listed() {
    let (wires, taps) = quad();
    assert_eq!(wires.difference(&taps), None);
    let rows = wires.side_by_side(&taps);
    // a, c, e, and of each triangle: present, inside, n, den, num, both shifted.
    assert_eq!(rows.len(), 4 * 3 + 5 * 3 + 5 + 2 * (2 + 3 + 4));
    assert!(rows.iter().all(|row| row.board == row.oracle));
    let mut names: Vec<String> = rows.iter().map(|row| row.wire.to_string()).collect();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), rows.len());
    assert_eq!(
        rows[0].to_string().split_whitespace().collect::<Vec<_>>(),
        ["a[0].x", "board", "87", "oracle", "87"]
    );
}

#[test]
fn difference_of_any_one_wrong_bit_names_its_wire() {
    let mut wrong: Vec<(WireName, Taps)> = Vec::new();
    let mut with = |name, change: &dyn Fn(&mut Taps)| {
        let mut taps = quad().1;
        change(&mut taps);
        wrong.push((name, taps));
    };
    for k in 0..3 {
        for i in 0..4 {
            with(WireName::A(i, k), &|taps| taps.a[i][k] ^= 1);
        }
        for i in 0..5 {
            with(WireName::C(i, k), &|taps| taps.c[i][k] ^= 1);
        }
    }
    for i in 0..5 {
        with(WireName::E(i), &|taps| taps.e[i] ^= 1);
    }
    for i in 0..2 {
        with(WireName::Present(i), &|taps| taps.triangles[i] = None);
        let mut inner = |name, change: fn(&mut crate::datapath::ray_patch::TriangleTaps)| {
            with(name, &|taps| taps.triangles[i].iter_mut().for_each(change));
        };
        inner(WireName::Inside(i), |t| t.inside ^= true);
        inner(WireName::N(i, 0), |t| t.n[0] ^= 1);
        inner(WireName::N(i, 1), |t| t.n[1] ^= 1);
        inner(WireName::N(i, 2), |t| t.n[2] ^= 1);
        inner(WireName::Den(i), |t| t.den ^= 1);
        inner(WireName::Num(i), |t| t.num ^= 1);
        inner(WireName::NumShifted(i), |t| t.num_shifted ^= 1);
        inner(WireName::DenShifted(i), |t| t.den_shifted ^= 1);
    }
    let (wires, right) = quad();
    assert_eq!(wrong.len(), wires.side_by_side(&right).len());
    for (name, taps) in wrong {
        let difference = wires.difference(&taps).expect("a wrong bit");
        assert_eq!(difference.wire, name);
        assert_ne!(difference.board, difference.oracle);
        assert!(difference.to_string().contains("differs"));
    }
}
