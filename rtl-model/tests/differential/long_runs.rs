//! Long runs, ignored by default: plain seeded words through the same classes, on all threads.
//!
//! `PAIRS_SEED=N` chooses another seed than 1. A mismatch names its seed and place and prints the pair with all wires.

use std::thread;
use std::time::Instant;

use rtl_model::fixed::Formats;

use crate::agreement::{Kind, Tally, check};
use crate::cases::{CLASSES, Class, Pair, SETS, any_formats, format_set};
use crate::draw::{Draw, SplitMix, Words};

/// How many of [`CLASSES`], the first ones, are no adversaries.
const RANDOM_CLASSES: usize = 2;

fn seed() -> u64 {
    std::env::var("PAIRS_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(1)
}

/// Pairs of one stream of words: which pairs a run has does not depend on the number of threads.
const BLOCK: u64 = 1 << 12;

/// Pairs built by turns from the classes; what they were, and the first mismatch of each thread.
fn run(seed: u64, pairs: u64, build: impl Fn(u64, &Words) -> (Formats, Pair) + Sync) -> (Tally, Vec<String>) {
    let threads = thread::available_parallelism().map_or(1, |count| count.get());
    let (mut sum, mut mismatches) = (Tally::default(), Vec::new());
    thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|worker| {
                let build = &build;
                scope.spawn(move || {
                    let mut tally = Tally::default();
                    for block in (0..pairs.div_ceil(BLOCK)).skip(worker).step_by(threads) {
                        // Streams of SplitMix64 from well-spread states.
                        let stream = (seed << 32 | block).wrapping_mul(0xd134_2543_de82_ef95);
                        let mut words = SplitMix::new(stream);
                        for n in block * BLOCK..((block + 1) * BLOCK).min(pairs) {
                            let (formats, pair) = build(n, &words.words());
                            if let Err(mismatch) = check(&formats, &pair, &mut tally) {
                                return (tally, Some(format!("seed {seed}, pair {n}\n{mismatch}")));
                            }
                        }
                    }
                    (tally, None)
                })
            })
            .collect();
        for worker in workers {
            let (tally, mismatch) = worker.join().expect("a worker panicked");
            sum.add(&tally);
            mismatches.extend(mismatch);
        }
    });
    (sum, mismatches)
}

fn report(name: &str, pairs: u64, start: Instant, outcome: (Tally, Vec<String>)) {
    let (tally, mismatches) = outcome;
    println!("{name}: {tally}; {} mismatches; {:.1} s", mismatches.len(), start.elapsed().as_secs_f64());
    assert!(mismatches.is_empty(), "{}", mismatches.join("\n\n"));
    assert_eq!(tally.count(Kind::Pair), pairs);
    assert!(tally.count(Kind::Hit) > 0 && tally.count(Kind::Behind) > 0 && tally.count(Kind::EdgeZero) > 0);
}

#[test]
#[ignore = "minutes: 10^7 random and 10^6 adversarial pairs at each of five format sets"]
fn ten_million_pairs_at_each_format_set_board_equals_oracle() {
    let seed = seed();
    for set in 0..SETS {
        let at = |classes: &'static [Class]| {
            move |n: u64, words: &Words| {
                let mut draw = Draw::new(words);
                let formats = format_set(set, &mut draw);
                (formats, classes[n as usize % classes.len()].pair(&formats, &mut draw))
            }
        };
        let (random, adversarial) = CLASSES.split_at(RANDOM_CLASSES);
        let Formats { coord_frac_bits, dir_frac_bits, t_frac_bits, cross_keep_bits, .. } =
            format_set(set, &mut Draw::new(&[0; 32]));
        let name = format!(
            "F {coord_frac_bits} D {dir_frac_bits} T {t_frac_bits} K {cross_keep_bits:?} seed {seed}"
        );
        for (kind, classes, pairs) in
            [("random", random, 10_000_000), ("adversarial", adversarial, 1_000_000)]
        {
            let start = Instant::now();
            let stream = seed << 8 | u64::from(set) << 1 | u64::from(kind == "random");
            report(&format!("{name} {kind}"), pairs, start, run(stream, pairs, at(classes)));
        }
    }
}

#[test]
#[ignore = "many minutes: 10^8 pairs of all classes, half of them at random formats"]
fn hundred_million_pairs_of_all_classes_board_equals_oracle() {
    let (seed, pairs, start) = (seed(), 100_000_000, Instant::now());
    let outcome = run(seed << 8 | 0xff, pairs, |n, words| {
        let class = CLASSES[n as usize / 2 % CLASSES.len()];
        if n % 2 == 0 {
            return class.pair_at_a_set(words);
        }
        let mut draw = Draw::new(words);
        let formats = any_formats(&mut draw);
        (formats, class.pair(&formats, &mut draw))
    });
    report(&format!("all classes, seed {seed}"), pairs, start, outcome);
}
