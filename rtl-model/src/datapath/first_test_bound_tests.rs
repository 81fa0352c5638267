//! Tests of the bound: its specification in i128, that errors keep and nearly reach it, and the shares by width.

use super::*;

type Wide = [i128; 3];

fn cross_wide(p: Wide, q: Wide) -> Wide {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

fn inner(p: Wide, q: Wide) -> i128 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

/// The largest sum over sign patterns: the sum of magnitudes.
fn largest_sum(x: Wide) -> i128 {
    (0..8).map(|signs| (0..3).map(|k| if signs >> k & 1 == 0 { x[k] } else { -x[k] }).sum()).max().unwrap()
}

/// The largest sum of two magnitudes.
fn largest_pair(x: Wide) -> i128 {
    [[0, 1], [1, 2], [2, 0]].map(|[k, l]| largest_sum([x[k], x[l], 0])).into_iter().max().unwrap()
}

/// Smallest shift after which every word fits.
fn shift_of(bits: u32, words: &[Wide]) -> u32 {
    let range = -(1_i128 << bits)..1 << bits;
    (0..).find(|s| words.iter().flatten().all(|w| range.contains(&w.div_euclid(1 << s)))).unwrap()
}

/// Nearest words, ties up.
fn nearest(x: Wide, s: u32) -> Wide {
    x.map(|w| (2 * w + (1 << s)).div_euclid(2 << s))
}

/// Exact corners and direction, in i128.
fn wide(ray: &RayWords, patch: &PatchWords) -> (Vec<Wide>, Wide) {
    let n = if patch.is_triangle { 3 } else { 4 };
    let a =
        patch.corners[..n].iter().map(|v| [0, 1, 2].map(|k| i128::from(v[k]) - i128::from(ray.origin[k])));
    (a.collect(), ray.dir.map(i128::from))
}

/// Twice the value and twice the bound of each edge 01, 12, 02, 23, 30, from the module's text, in another order.
fn specified_edges(formats: &Formats, bits: u32, ray: &RayWords, patch: &PatchWords) -> Vec<(i128, i128)> {
    let (a, d) = wide(ray, patch);
    let (s, r) = (shift_of(bits, &a), shift_of(bits, &[d]));
    let (sigma, rho) = (i128::from(s != 0), i128::from(r != 0));
    let (a, d): (Vec<Wide>, Wide) = (a.iter().map(|x| nearest(*x, s)).collect(), nearest(d, r));
    let pairs: &[[usize; 2]] =
        if a.len() == 3 { &[[0, 1], [1, 2], [0, 2]] } else { &[[0, 1], [1, 2], [0, 2], [2, 3], [3, 0]] };
    let edge = |[i, j]: &[usize; 2]| {
        let (x, y) = (a[*i], a[*j]);
        let first = [cross_wide(x, d), cross_wide(y, d), d].map(largest_sum).iter().sum::<i128>();
        let apart = largest_sum([0, 1, 2].map(|k| x[k] - y[k]));
        let second = (apart + 3 * sigma) * (largest_pair(x) + sigma).min(largest_pair(y) + sigma);
        let drop = formats.cross_drop();
        let weight = if formats.rounding == Rounding::Floor { 2 } else { 1 };
        let third = weight * (largest_sum(d) + 2 * rho) * (1 << drop);
        let third = if drop == 0 { 0 } else { (third + (1 << (2 * s)) - 1).div_euclid(1 << (2 * s)) };
        (2 * inner(cross_wide(x, y), d), sigma * first + rho * second + third)
    };
    pairs.iter().map(edge).collect()
}

/// Every combination of signs that the intervals allow, put through the inside rule.
fn specified_answer(edges: &[(i128, i128)]) -> FirstTest {
    let inside = |signs: [i32; 3]| signs.contains(&-1) != signs.contains(&1);
    let allowed = |(value, bound): &(i128, i128)| -> Vec<i32> {
        let (low, high) = (value - bound, value + bound);
        (-1..=1).filter(|sign| [low < 0, low <= 0 && high >= 0, high > 0][(sign + 1) as usize]).collect()
    };
    let mut combinations = vec![vec![]];
    for edge in edges {
        let longer =
            |c: &Vec<i32>| allowed(edge).into_iter().map(|sign| [c.as_slice(), &[sign]].concat()).collect();
        combinations = combinations.iter().flat_map(|c| -> Vec<Vec<i32>> { longer(c) }).collect();
    }
    let answers: Vec<bool> = combinations
        .iter()
        .map(|e| inside([e[0], e[1], -e[2]]) || e.len() == 5 && inside([e[2], e[3], e[4]]))
        .collect();
    match (answers.contains(&true), answers.contains(&false)) {
        (true, false) => FirstTest::Inside,
        (false, true) => FirstTest::Miss,
        _ => FirstTest::Undecided,
    }
}

#[test]
fn first_test_any_width_equals_its_specification() {
    let tally = Tally::default();
    let count = |cell: &Cell<u32>| cell.set(cell.get() + 1);
    let strategy = (widths(), 1_u32..=28, any::<bool>()).prop_flat_map(|((f, d, t), bits, rounded)| {
        let full = formats(f, d, t);
        let formats = if rounded { roundings(full).boxed() } else { Just(full).boxed() };
        (formats, Just(bits), hard_patch(f), prop::collection::vec((ray(f, d, t), 0_i64..=16), 4))
    });
    for_all(1500, strategy, |(formats, bits, patch, rays)| {
        for (ray, share) in &rays {
            for ray in aimed(&formats, ray, &patch, *share, [1, 0, -1]) {
                let specified = specified_edges(&formats, bits, &ray, &patch);
                let edges = narrow_edges(&formats, bits, &ray, &patch);
                for (edge, expected) in edges.iter().zip(&specified) {
                    prop_assert_eq!((edge.twice_value, edge.twice_bound), *expected);
                }
                let (a, d) = wide(&ray, &patch);
                let behind = (0..3)
                    .any(|k| a.iter().all(|a| a[k] * d[k].signum() < 0 || d[k] == 0 && a[k] > 0))
                    || (0..3).any(|k| d[k] == 0 && a.iter().all(|a| a[k] < 0));
                let expected = match specified_answer(&specified) {
                    _ if behind && formats.cross_drop() == 0 => FirstTest::Miss,
                    answer => answer,
                };
                prop_assert_eq!(first_test(&formats, bits, &ray, &patch), expected, "{:?}", ray);
                let believed: Vec<_> = specified.iter().map(|(value, _)| (*value, 0)).collect();
                let believed = specified_answer(&believed) == FirstTest::Inside;
                prop_assert_eq!(narrow_inside(&formats, bits, &ray, &patch), believed, "{:?}", ray);
                count(&tally.pairs);
                count(match expected {
                    FirstTest::Miss => &tally.miss,
                    FirstTest::Inside => &tally.inside,
                    FirstTest::Undecided => &tally.undecided,
                });
            }
        }
        Ok(())
    });
    tally.assert_covers(2000);
}

/// The largest share of its bound that the error of a quad's edge values takes; panics when one takes more than all.
fn error_share(formats: &Formats, bits: u32, ray: &RayWords, patch: &PatchWords) -> f64 {
    let (a, d) = wide(ray, patch);
    let unit = 1_i128 << (2 * shift_of(bits, &a) + shift_of(bits, &[d]));
    let exact = taps(formats, ray, patch).e;
    let share = |(edge, e): (&NarrowEdge, &i128)| {
        let error = ((e << (formats.cross_drop() + 1)) - edge.twice_value * unit).abs();
        assert!(error <= edge.twice_bound * unit, "{error} of {edge:?} in {unit}, {ray:?}, {patch:?}");
        if error == 0 { 0.0 } else { error as f64 / (edge.twice_bound * unit) as f64 }
    };
    narrow_edges(formats, bits, ray, patch).iter().zip(&exact).map(share).fold(0.0, f64::max)
}

#[test]
fn bound_random_quads_at_all_widths_is_kept() {
    let pairs = Cell::new(0);
    let strategy = widths().prop_flat_map(|(f, d, t)| {
        (roundings(formats(f, d, t)), hard_patch(f), prop::collection::vec((ray(f, d, t), 0_i64..=16), 4))
    });
    for_all(1000, strategy, |(rounded, patch, rays)| {
        let quad = PatchWords { is_triangle: false, ..patch };
        let full = Formats { cross_keep_bits: None, ..rounded };
        for (ray, share) in &rays {
            for ray in aimed(&full, ray, &quad, *share, [0, 1, 1]) {
                for bits in [1, 2, 3, 4, 6, 8, 12, 16, 20, 24] {
                    error_share(&full, bits, &ray, &quad);
                    error_share(&rounded, bits, &ray, &quad);
                    pairs.set(pairs.get() + 1);
                }
            }
        }
        Ok(())
    });
    assert!(pairs.get() >= 500_000, "{}", pairs.get());
}

/// splitmix64: the same inputs in every run.
struct Random(u64);

impl Random {
    fn within(&mut self, least: i32, most: i32) -> i32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        (i64::from(least) + (mixed >> 33) as i64 % (i64::from(most) - i64::from(least) + 1)) as i32
    }
}

/// `word` in steps of 2^s, pushed off its narrow word as far as rounding allows, toward `sign`.
fn pushed(word: i64, s: u32, sign: i128) -> i32 {
    let off = match (s, sign >= 0) {
        (0, _) => 0,
        (_, true) => (1 << (s - 1)) - 1,
        (_, false) => -(1 << (s - 1)),
    };
    i32::try_from((word << s) + off).unwrap()
}

/// The largest share over `n` adversarial edges: words of 10 bits, shifted by `s` and `r`, every rounding error against
/// the same side, the edge along the axis where the corner's word is smallest.
fn worst_share(s: u32, r: u32, n: u32) -> f64 {
    let formats = formats(28, 28, 24);
    let mut random = Random(7);
    let mut worst = 0.0_f64;
    for _ in 0..n {
        let x = [random.within(512, 1000), random.within(-1000, 1000), random.within(-40, 40)].map(i64::from);
        let y = [x[0], x[1], x[2] + i64::from(random.within(-30, 30))];
        let d =
            [random.within(512, 1000), random.within(-1000, 1000), random.within(-1000, 1000)].map(i64::from);
        let [xw, yw, dw] = [x, y, d].map(|v| v.map(i128::from));
        let (by_x, by_y, by_d) = (cross_wide(yw, dw), cross_wide(dw, xw), cross_wide(xw, yw));
        let corner = |v: [i64; 3], toward: Wide| [0, 1, 2].map(|k| pushed(v[k], s, toward[k]));
        let (v0, v1) = (corner(x, by_x), corner(y, by_y));
        let patch = PatchWords { corners: [v0, v1, v1, v1], is_triangle: false, id: 0 };
        let dir = [0, 1, 2].map(|k| pushed(d[k], r, by_d[k]));
        let ray = RayWords { origin: [0; 3], dir, t_max: formats.t_limit() };
        worst = worst.max(error_share(&formats, 10, &ray, &patch));
    }
    worst
}

#[test]
fn bound_adversarial_words_is_nearly_reached_by_each_part_alone_and_by_both() {
    for (s, r, reached) in [(17, 0, 0.99), (0, 17, 0.99), (17, 17, 0.97)] {
        let worst = worst_share(s, r, 3000);
        assert!(worst > reached, "s = {s}, r = {r}: {worst}");
    }
}

#[test]
fn bound_rounded_products_is_nearly_reached() {
    for (rounding, reached) in
        [(Rounding::Floor, 0.9), (Rounding::NearestEven, 0.9), (Rounding::HalfAway, 0.9)]
    {
        let formats = Formats { rounding, cross_keep_bits: Some(10), ..formats(8, 8, 8) };
        let mut random = Random(3);
        let mut worst = 0.0_f64;
        for _ in 0..20_000 {
            let mut point = || [(); 3].map(|()| random.within(-255, 255));
            let (v0, v1, v2, v3) = (point(), point(), point(), point());
            let patch = PatchWords { corners: [v0, v1, v2, v3], is_triangle: false, id: 0 };
            let dir = [(); 3].map(|()| random.within(100, 255));
            let ray = RayWords { origin: [0; 3], dir, t_max: formats.t_limit() };
            worst = worst.max(error_share(&formats, 9, &ray, &patch));
        }
        assert!(worst > reached, "{rounding:?}: {worst}");
    }
}

/// Rays toward random patches of a height field of 32 x 32 quads, each with a patch at most two rows and columns away.
fn mesh_pairs(n: u32) -> Vec<(RayWords, PatchWords)> {
    let formats = Formats::default();
    let vertex = |i: i32, j: i32| {
        let height = (i * 37 + j * 59) % 64 * 4000 + (i - 16).pow(2) * 20_000 - (j - 10).pow(2) * 15_000;
        [(i - 16) * 1_000_003 - 77, (j - 16) * 1_000_033 + 1234, height - (1 << 23)]
    };
    let mut random = Random(5);
    let mut pairs = Vec::new();
    for id in 0..n {
        let (i, j) = (random.within(2, 29), random.within(2, 29));
        let (k, l) = (i + random.within(-2, 2), j + random.within(-2, 2));
        let corners = [vertex(k, l), vertex(k + 1, l), vertex(k + 1, l + 1), vertex(k, l + 1)];
        let side = (1 << 24) - 1;
        let origin = [random.within(-side, side), random.within(-side, side), random.within(0, side)];
        let target = [0, 1, 2].map(|m| i64::from(vertex(i, j)[m]) + i64::from(random.within(0, 1_000_000)));
        let toward = [0, 1, 2].map(|m| target[m] - i64::from(origin[m]));
        let dir = along(&formats, toward).unwrap();
        let ray = RayWords { origin, dir, t_max: formats.t_limit() };
        pairs.push((ray, PatchWords { corners, is_triangle: false, id }));
    }
    pairs
}

#[test]
fn shares_on_a_mesh_fall_with_width_under_the_stated_figures() {
    let formats = Formats::default();
    let pairs = mesh_pairs(10_000);
    let mut undecided = Vec::new();
    let mut wrong = Vec::new();
    for bits in WIDTHS {
        let open = |(ray, patch): &&_| first_test(&formats, bits, ray, patch) == FirstTest::Undecided;
        let differs = |(ray, patch): &&_| {
            narrow_inside(&formats, bits, ray, patch) != exactly_inside(&formats, ray, patch)
        };
        undecided.push(pairs.iter().filter(open).count());
        wrong.push(pairs.iter().filter(differs).count());
    }
    // The list begins at 4 bits.
    let at = |bits: usize| undecided[bits - 4];
    assert!(undecided.is_sorted_by(|wide, narrow| wide >= narrow), "{undecided:?}");
    // Measured: 95.6, 18.9, 0.60 and 0.04 %; alone, 0.79 % are wrong at 8 bits.
    assert!(at(4) > 9_000 && at(8) < 2_200 && at(12) < 75 && at(16) < 10, "{undecided:?}");
    assert!(wrong[4] > 50 && wrong[12] < 10, "{wrong:?}");
}
