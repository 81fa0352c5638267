//! Random mutations of small valid files end in a picture or in one named error: no panic, in time, in bounds.
//!
//! A few hundred in every run; ten thousand by
//! `cargo test --release --test mutated_models -- --ignored --nocapture`.

use std::path::Path;
use std::time::Instant;

use radiosity_engine::frame::{self, CasterChoice, FrameOptions, PassOne};
use radiosity_engine::radiosity::SolveOptions;
use radiosity_engine::render::RenderOptions;

#[path = "common/models.rs"]
mod models;

use models::{Room, glb};

/// Longest that one file may take (s).
const MAX_S: f64 = 5.0;

/// Most memory of the whole run (KiB).
const MAX_KIB: u64 = 1 << 20;

/// A generator of repeatable choices (splitmix64).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

const NUMBERS: [&str; 30] = [
    "0",
    "-1",
    "1",
    "2",
    "3",
    "7",
    "24",
    "25",
    "255",
    "65535",
    "65536",
    "-0",
    "0.5",
    "1e-30",
    "1e30",
    "-1e30",
    "1e38",
    "1e39",
    "1e308",
    "1e400",
    "4294967295",
    "4294967296",
    "2147483648",
    "-2147483649",
    "9223372036854775807",
    "18446744073709551615",
    "18446744073709551616",
    "nan",
    "inf",
    "1e-320",
];

/// One mutation of bytes that may be text.
fn mutate(bytes: &mut Vec<u8>, dice: &mut Dice) {
    let n = bytes.len();
    match dice.below(9) {
        0 => {
            let at = dice.below(n);
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << dice.below(8);
            }
        }
        1 => bytes.truncate(dice.below(n)),
        2 => {
            let (at, byte) = (dice.below(n), dice.next() as u8);
            bytes.insert(at.min(n), byte);
        }
        3 => {
            let at = dice.below(n);
            let end = (at + 1 + dice.below(16)).min(n);
            bytes.drain(at.min(end)..end);
        }
        4 => {
            // A piece twice.
            let at = dice.below(n);
            let piece = bytes[at..(at + 1 + dice.below(64)).min(n).max(at)].to_vec();
            let to = dice.below(n);
            bytes.splice(to..to, piece);
        }
        5..=7 => {
            // A number becomes another one.
            let spans = spans(bytes, |b| b.is_ascii_digit() || b"+-.eE".contains(&b));
            let numbers: Vec<_> =
                spans.into_iter().filter(|s| bytes[s.clone()].iter().any(u8::is_ascii_digit)).collect();
            if let Some(span) = numbers.get(dice.below(numbers.len())) {
                let new = NUMBERS[dice.below(NUMBERS.len())].bytes();
                bytes.splice(span.clone(), new);
            }
        }
        _ => {
            // Two words change places.
            let words = spans(bytes, |b| !b.is_ascii_whitespace());
            if words.len() > 1 {
                let (i, j) = (dice.below(words.len()), dice.below(words.len()));
                let (a, b) = (words[i.min(j)].clone(), words[i.max(j)].clone());
                let (first, second) = (bytes[a.clone()].to_vec(), bytes[b.clone()].to_vec());
                if i != j {
                    bytes.splice(b, first);
                    bytes.splice(a, second);
                }
            }
        }
    }
}

fn spans(bytes: &[u8], inside: impl Fn(u8) -> bool) -> Vec<std::ops::Range<usize>> {
    let mut list = Vec::new();
    let mut start = None;
    for (i, &b) in bytes.iter().chain([&0]).enumerate() {
        match (start, i < bytes.len() && inside(b)) {
            (None, true) => start = Some(i),
            (Some(s), false) => {
                list.push(s..i);
                start = None;
            }
            _ => {}
        }
    }
    list
}

/// Renders a tiny picture; the length of the error when there is one.
fn render(path: &Path) -> Option<String> {
    let options = FrameOptions {
        adaptive: None,
        elements: Some(60),
        caster: CasterChoice::Software,
        pass_1: PassOne::Solve(SolveOptions { max_shots: 30, ..SolveOptions::default() }),
    };
    let picture = RenderOptions { width: 6, height: 6, ..RenderOptions::default() };
    frame::render_frame(path, &options, &picture, &mut |_| {}).err().map(|e| e.to_string())
}

fn run(n: u64, seed: u64) {
    let room = Room { bulb: true, ..Room::default() };
    let camera =
        "[camera]\neye = [0.5, 0.1, 0.5]\ntarget = [0.5, 0.9, 0.5]\nup = [0, 0, 1]\nfov_y_deg = 60\n";
    let mesh = "[[mesh]]\nfile = \"room.obj\"\nunit = \"cm\"\nscale = 100\nrotate_deg = [0, 0, 0]\ntranslate = [0, 0, 0.5]\n";
    let small = room.toml();
    let toml = small.split("[[surface]]").take(3).collect::<Vec<_>>().join("[[surface]]") + camera + mesh;
    let (mut n_pictures, mut n_errors, mut longest) = (0, 0, 0.0_f64);
    let mut slow = Vec::new();
    for k in 0..n {
        let mut dice = Dice(seed.wrapping_mul(1_000_003).wrapping_add(k));
        let folder = tempfile::tempdir().unwrap();
        let files = room.write(folder.path());
        let [_, obj, gltf, glb_path] = &files[..] else { panic!("four files") };
        std::fs::write(folder.path().join("room.toml"), &toml).unwrap();
        let mutated = |bytes: &[u8], dice: &mut Dice| {
            let mut bytes = bytes.to_vec();
            for _ in 0..1 + dice.below(3) {
                if !bytes.is_empty() {
                    mutate(&mut bytes, dice);
                }
            }
            bytes
        };
        let write = |name: &str, bytes: Vec<u8>| {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            path
        };
        let load = match k % 7 {
            0 => write("room.obj", mutated(room.obj().as_bytes(), &mut dice)),
            1 => {
                write("room.mtl", mutated(room.mtl().as_bytes(), &mut dice));
                obj.clone()
            }
            2 => write("room.glb", mutated(&room.glb(), &mut dice)),
            3 => {
                // The container stays whole: what it holds is mutated.
                let json = mutated(room.gltf(None).as_bytes(), &mut dice);
                write("room.glb", glb(&String::from_utf8_lossy(&json), &room.buffer()))
            }
            4 => {
                let buffer = mutated(&room.buffer(), &mut dice);
                write("room.glb", glb(&room.gltf(None), &buffer))
            }
            5 => write("room.gltf", mutated(room.gltf(Some("room.bin")).as_bytes(), &mut dice)),
            _ => write("room.toml", mutated(toml.as_bytes(), &mut dice)),
        };
        debug_assert!(gltf.exists() && glb_path.exists());
        let start = Instant::now();
        match render(&load) {
            None => n_pictures += 1,
            Some(error) => {
                n_errors += 1;
                assert!(
                    !error.is_empty() && error.len() < 2000 && !error.contains('\n'),
                    "mutation {k}: {error}"
                );
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        longest = longest.max(seconds);
        if k % 1000 == 999 {
            println!("{} of {n}, longest so far {longest:.2} s", k + 1);
        }
        if seconds > MAX_S {
            slow.push((k, seconds));
        }
    }
    let peak_kib = peak_kib();
    println!(
        "{n} mutations: {n_pictures} pictures, {n_errors} named errors, longest {longest:.2} s, peak {peak_kib} KiB"
    );
    assert!(slow.is_empty(), "over {MAX_S} s: {slow:?}");
    assert!(peak_kib < MAX_KIB, "{peak_kib} KiB");
    assert!(n_pictures > n / 20 && n_errors > n / 20, "{n_pictures} pictures, {n_errors} errors");
}

/// Largest resident memory of this process so far; 0 where the system does not tell.
fn peak_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

#[test]
fn mutated_files_end_in_a_picture_or_a_named_error() {
    run(350, 1);
}

#[test]
#[ignore = "minutes: cargo test --release --test mutated_models -- --ignored --nocapture"]
fn ten_thousand_mutated_files_end_in_a_picture_or_a_named_error() {
    run(10_000, 2);
}
