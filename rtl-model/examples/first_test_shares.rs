//! Shares of the first test by width, as a markdown table: tests saved, known inside, undecided, and what its narrow
//! words alone would get wrong.
//!
//! ```text
//! a seeded height field of 64 x 64 quads -> rays toward a random quad -> each with the 5 x 5 quads around it -> counts
//! ```
//! Run: `cargo run --release -p rtl-model --example first_test_shares [PAIRS]`. Shares are of all pairs; "wrong alone"
//! is the classification of the ray's line with no second test, for which 0.25 % is the published yardstick.

use std::process::ExitCode;

use rtl_model::datapath::first_test::{FirstTest, first_test, narrow_inside};
use rtl_model::datapath::ray_patch::{self, taps};
use rtl_model::datapath::{PatchWords, RayWords};
use rtl_model::fixed::Formats;

/// Quads on a side of the height field.
const SIDE: i32 = 64;
/// Quads on a side of the neighbourhood that a ray is tested with.
const NEAR: i32 = 5;

/// splitmix64: the same inputs in every run.
struct Random(u64);

impl Random {
    /// A value in 0..1.
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        (mixed >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A whole number in least..=most.
    fn whole(&mut self, least: i32, most: i32) -> i32 {
        least + (self.share() * f64::from(most - least + 1)) as i32
    }
}

/// A real number in (-1, 1) as a word of `bits` fraction bits.
fn word(value: f64, bits: u32) -> i32 {
    (value * f64::from(1_i32 << bits)).round() as i32
}

/// The place of a vertex of the height field.
fn vertex(i: i32, j: i32) -> [f64; 3] {
    let (x, y) = (f64::from(2 * i - SIDE) / f64::from(SIDE), f64::from(2 * j - SIDE) / f64::from(SIDE));
    let height = 0.3 * (3.0 * x + 1.0).sin() * (2.0 * y).cos() + 0.03 * (17.0 * x * y).sin();
    [0.9 * x, 0.9 * y, height - 0.5]
}

/// A ray toward a random point of the quad's diagonals.
fn ray_at(formats: &Formats, random: &mut Random, i: i32, j: i32) -> RayWords {
    let origin = [2.0 * random.share() - 1.0, 2.0 * random.share() - 1.0, 0.95 * random.share()];
    let (u, v) = (random.share(), random.share());
    let corners = [vertex(i, j), vertex(i + 1, j), vertex(i, j + 1), vertex(i + 1, j + 1)];
    let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
    let toward = [0, 1, 2].map(|k| (0..4).map(|c| weights[c] * corners[c][k]).sum::<f64>() - origin[k]);
    let most = toward.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    // The largest component anywhere in [1/2, 1), as the host's scaling by powers of two leaves it.
    let scale = (0.5 + 0.499 * random.share()) / most;
    RayWords {
        origin: origin.map(|x| word(x, formats.coord_frac_bits)),
        dir: toward.map(|x| word(x * scale, formats.dir_frac_bits)),
        t_max: formats.t_limit(),
    }
}

/// Every pair of the scene: rays toward a quad with the quads around it.
fn pairs(formats: &Formats, n: usize) -> Vec<(RayWords, PatchWords)> {
    let mut random = Random(1);
    let mut pairs = Vec::with_capacity(n);
    let reach = NEAR / 2;
    while pairs.len() < n {
        let (i, j) = (random.whole(reach, SIDE - 1 - reach), random.whole(reach, SIDE - 1 - reach));
        let ray = ray_at(formats, &mut random, i, j);
        for (k, l) in (-reach..=reach).flat_map(|di| (-reach..=reach).map(move |dj| (i + di, j + dj))) {
            let corner = |i, j| vertex(i, j).map(|x| word(x, formats.coord_frac_bits));
            let corners = [corner(k, l), corner(k + 1, l), corner(k + 1, l + 1), corner(k, l + 1)];
            let id = (k * SIDE + l).unsigned_abs();
            pairs.push((ray, PatchWords { corners, is_triangle: false, id }));
        }
    }
    pairs.truncate(n);
    pairs
}

fn main() -> ExitCode {
    let argument = std::env::args().nth(1);
    let Ok(n) = argument.as_deref().unwrap_or("1000000").parse::<usize>() else {
        eprintln!("first_test_shares: the number of pairs is a whole number, not {argument:?}");
        return ExitCode::from(2);
    };
    let formats = Formats::default();
    let pairs = pairs(&formats, n);
    let percent = |count: usize| 100.0 * count as f64 / pairs.len().max(1) as f64;
    let hits =
        pairs.iter().filter(|(ray, patch)| ray_patch::intersect(&formats, ray, patch).is_some()).count();
    println!("{n} pairs, F = D = 24, full products; {:.2} % of them hit.\n", percent(hits));
    println!("| bits | saved % | inside % | undecided % | wrong alone % |");
    println!("|---|---|---|---|---|");
    for bits in 4..=24 {
        let (mut saved, mut inside, mut undecided, mut wrong) = (0, 0, 0, 0);
        for (ray, patch) in &pairs {
            match first_test(&formats, bits, ray, patch) {
                FirstTest::Miss => saved += 1,
                FirstTest::Inside => inside += 1,
                FirstTest::Undecided => undecided += 1,
            }
            let meets = taps(&formats, ray, patch).triangles.iter().flatten().any(|t| t.inside);
            wrong += usize::from(narrow_inside(&formats, bits, ray, patch) != meets);
        }
        let columns = [saved, inside, undecided, wrong].map(|count| format!("{:.3}", percent(count)));
        println!("| {bits} | {} |", columns.join(" | "));
    }
    ExitCode::SUCCESS
}
