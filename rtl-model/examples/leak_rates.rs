//! Prints how many rays escape from closed meshes when the edge normals are rounded to K fraction bits, by K, rounding
//! mode and target, as markdown tables: `cargo run --release -p rtl-model --example leak_rates`.

#[allow(dead_code, reason = "the tests use the rest of it")]
#[path = "../tests/meshes/mod.rs"]
mod meshes;

use rtl_model::fixed::{Formats, Rounding};

use meshes::leaks::{Aim, Cast, casts, escaped};
use meshes::random::Random;
use meshes::rays::Target;

const SEED: u64 = 1992;
const N_RAYS: usize = 20_000;
const MODES: [(&str, Rounding); 3] =
    [("to even", Rounding::NearestEven), ("half away", Rounding::HalfAway), ("floor", Rounding::Floor)];

/// Kept bits, fewer and fewer: in steps of 1, then 2, then 4.
fn kept_bits(full: u32) -> Vec<u32> {
    let steps = (0..).scan(0, |dropped, n| {
        let here = *dropped;
        *dropped += if n < 2 {
            1
        } else if n < 5 {
            2
        } else {
            4
        };
        Some(here)
    });
    steps.take_while(|dropped| full - dropped >= 8).map(|dropped| full - dropped).collect()
}

fn table(coord_frac_bits: u32, dir_frac_bits: u32) {
    let formats = Formats { coord_frac_bits, dir_frac_bits, ..Formats::default() };
    let random = &mut Random::new(SEED);
    let sets: Vec<(&str, Vec<Cast>)> = [
        ("through corners", Aim::Exact, Target::Vertex),
        ("through edges", Aim::Exact, Target::Edge),
        ("aimed at corners", Aim::Rounded, Target::Vertex),
        ("aimed at edges", Aim::Rounded, Target::Edge),
    ]
    .into_iter()
    .map(|(name, aim, target)| (name, casts(&formats, aim, target, N_RAYS, random)))
    .collect();
    println!(
        "F = {coord_frac_bits}, D = {dir_frac_bits}: escaped rays in %, of {N_RAYS} a column from inside random closed \
         meshes, seed {SEED}\n"
    );
    let (mut head, mut rule) = (String::from("| K |"), String::from("|---|"));
    for (name, _) in &sets {
        for (mode, _) in MODES {
            head += &format!(" {name}, {mode} |");
            rule += "---|";
        }
    }
    println!("{head}\n{rule}");
    for keep in kept_bits(2 * coord_frac_bits) {
        let mut row = format!("| {keep} |");
        for (_, casts) in &sets {
            for (_, rounding) in MODES {
                let lost = escaped(&Formats { rounding, cross_keep_bits: Some(keep), ..formats }, casts);
                row += &if lost == 0 {
                    " 0 |".into()
                } else {
                    format!(" {:.2} |", 100.0 * lost as f64 / N_RAYS as f64)
                };
            }
        }
        println!("{row}");
    }
    println!();
}

fn main() {
    table(12, 16);
    table(24, 24);
}
