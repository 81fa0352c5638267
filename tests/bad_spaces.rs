//! Bad design spaces: each is refused with one line that names file, line, value and expectation; nothing panics.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use proptest::prelude::*;
use radiosity_engine::explore::space::Space;

#[path = "common/damage.rs"]
mod damage;

use damage::{apply, damage};

/// A good space: line by line what the cases replace.
const GOOD: &str = r#"version = 1
question = "Good?"
base = "delft-1992"
technology = "osu-0.35um"
clock = "derived"

[axes]
"icu.depth" = [2, 4, 8, 16]
"ctu.contexts" = { from = 4, to = 16, step = 4 }
"patch_cache.bytes" = { from = 1024, to = 4096, scale = "powers-of-two" }
entries = [8, 16]

[set]
"fifos.ctu_icu" = "max(entries, icu.depth)"
"dram.row_miss_cycles" = "ceil(240 * clock_mhz / 1000)"

[[constraint]]
require = "patch_cache.bytes + list_cache.bytes <= 6144"

[[workload]]
scene = "scenes/cornell-box/scene.toml"
rays = "primary"

[objectives]
minimise = ["seconds", "area_mm2"]

[search]
strategy = "grid"
"#;

/// A space file in the project's folder, that is not there: scenes are found from it.
fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("test.toml")
}

/// What is replaced, by what, the line of the fault, and words of the message.
type Case = (&'static str, &'static str, usize, &'static [&'static str]);

const CASES: &[Case] = &[
    // Syntax, version, keys.
    ("[axes]", "[axes", 7, &["unclosed table"]),
    ("version = 1\n", "", 1, &["missing key `version`"]),
    ("version = 1", "version = 2", 1, &["version 2, expected 1"]),
    ("question =", "qestion =", 2, &["unknown key \"qestion\"", "did you mean \"question\"?"]),
    ("[[constraint]]", "[[constrain]]", 17, &["unknown key", "did you mean \"constraint\"?"]),
    ("require =", "requires =", 18, &["did you mean \"require\"?"]),
    ("question = \"Good?\"", "question = 3", 2, &["question"]),
    // Base, technology, clock.
    ("delft-1992", "delft-1993", 3, &["no preset of this name", "delft-1992, minimal", "did you mean"]),
    ("osu-0.35um", "osu-0.36um", 4, &["unknown technology", "ecp5", "did you mean \"osu-0.35um\"?"]),
    ("\"derived\"", "\"derivd\"", 5, &["unknown clock", "did you mean \"derived\"?"]),
    ("clock = \"derived\"", "clock = true", 5, &["expected a string"]),
    // Axes.
    ("\"icu.depth\" =", "\"icu.dept\" =", 8, &["unknown board parameter", "did you mean \"icu.depth\"?"]),
    ("\"icu.depth\" = [", "icu.dept = [", 8, &["unknown board parameter", "did you mean \"icu.depth\"?"]),
    ("[2, 4, 8, 16]", "[]", 8, &["icu.depth: an axis without values"]),
    ("[2, 4, 8, 16]", "{ }", 8, &["a range without `from`"]),
    ("[2, 4, 8, 16]", "3", 8, &["icu.depth = 3, expected a list of values"]),
    ("[2, 4, 8, 16]", "[2, 4, 2]", 8, &["icu.depth: 2 stands twice"]),
    ("[2, 4, 8, 16]", "[2, 4, 2.0]", 8, &["icu.depth: 2 stands twice"]),
    ("[2, 4, 8, 16]", "[2, \"four\"]", 8, &["icu.depth = \"four\": expected a whole number"]),
    ("[2, 4, 8, 16]", "[2, 4.5]", 8, &["icu.depth = 4.5: expected a whole number"]),
    ("[2, 4, 8, 16]", "[2, [4]]", 8, &["expected a number, a word"]),
    ("[2, 4, 8, 16]", "[2, nan]", 8, &["nan, expected a finite number"]),
    ("[2, 4, 8, 16]", "[0, 4]", 8, &["icu.depth = 0: expected 1 to 4096"]),
    ("[2, 4, 8, 16]", "[-2, 4]", 8, &["icu.depth = -2: expected 0 or more"]),
    ("[2, 4, 8, 16]", "[5000000000]", 8, &["icu.depth = 5000000000: expected at most 4294967295"]),
    ("\"icu.depth\" = [2", "\"patch_cache.ways\" = [3, 2", 8, &["patch_cache.ways = 3: expected a power"]),
    ("\"icu.depth\" = [2, 4, 8, 16]", "partition = [\"shell\"]", 8, &["grid, shells", "mean \"shells\"?"]),
    ("\"icu.depth\" = [2, 4, 8, 16]", "grid_log2 = [\"automatic\"]", 8, &["a whole number or \"auto\""]),
    ("\"icu.depth\" = [2, 4, 8, 16]", "shells.prefetch = [1]", 8, &["expected true or false"]),
    ("\"icu.depth\" = [2", "\"icu.depth\" = [4]\nicu.depth = [2", 9, &["icu.depth stands twice in [axes]"]),
    ("from = 4, to = 16", "from = 4, to = 2", 9, &["ctu.contexts: the range ends at 2, before its start 4"]),
    ("to = 16, step = 4", "to = 16, step = 0", 9, &["step = 0, expected over 0"]),
    ("to = 16, step = 4", "to = 16, step = -4", 9, &["step = -4, expected over 0"]),
    (
        "from = 4, to = 16, step",
        "from = 4, too = 16, step",
        9,
        &["unknown key \"too\"", "did you mean \"to\"?"],
    ),
    ("from = 4, to = 16, step = 4", "from = 4", 9, &["a range without `to`"]),
    ("to = 16, step = 4", "to = 1e12, step = 1", 9, &["more than 1048576 values"]),
    ("from = 1024, to = 4096", "from = 1000, to = 4096", 10, &["1000 is no power of two"]),
    ("from = 1024, to = 4096", "from = 1024, to = 5000", 10, &["5000 is no power of two"]),
    ("to = 4096, scale", "to = 4096, step = 2, scale", 10, &["step has no use"]),
    ("\"powers-of-two\"", "\"power-of-two\"", 10, &["expected \"linear\" or \"powers-of-two\""]),
    ("entries = [8, 16]", "entrys = [8, 16]", 14, &["unknown name \"entries\"", "did you mean \"entrys\"?"]),
    (
        "entries = [8, 16]",
        "entries = [8, 16]\nspare = [1]",
        12,
        &["spare is no board parameter, and no expression"],
    ),
    ("entries = [8, 16]", "entries = [8, 16]\narea_mm2 = [1]", 12, &["area_mm2 is the name of a cost"]),
    (
        "entries = [8, 16]",
        "entries = [8, 16]\nclock_mhz = [20, 25]",
        12,
        &["clock_mhz follows from the critical path"],
    ),
    (
        "entries = [8, 16]",
        "entries = [8, 16]\n\"big\" = { from = 1, to = 1000000 }\n\"bus.dma_setup_cycles\" = { from = 1, to = 1000000 }",
        13,
        &["more than 2^40 combinations"],
    ),
    // Expressions.
    ("\"fifos.ctu_icu\" =", "\"fifo.ctu_icu\" =", 14, &["did you mean \"fifos.ctu_icu\"?"]),
    ("\"fifos.ctu_icu\" =", "\"ctu.contexts\" =", 14, &["ctu.contexts is an axis already"]),
    ("max(entries, icu.depth)", "max(entries, icu.dept)", 14, &["unknown name \"icu.dept\"", "did you mean"]),
    ("max(entries, icu.depth)", "maximum(entries, icu.depth)", 14, &["unknown function \"maximum\""]),
    ("max(entries, icu.depth)", "max(entries, icu.depth", 14, &["a parenthesis is not closed"]),
    ("max(entries, icu.depth)", "entries +", 14, &["an operator lacks a value"]),
    ("max(entries, icu.depth)", "", 14, &["an expression was expected"]),
    ("max(entries, icu.depth)", "entries = 3", 14, &["write == to compare"]),
    ("max(entries, icu.depth)", "entries / 3", 14, &["expected a whole number: ceil(), floor() or round()"]),
    ("max(entries, icu.depth)", "entries > 3", 14, &["fifos.ctu_icu = true: expected a whole number"]),
    ("max(entries, icu.depth)", "entries + partition", 14, &["numbers and words do not mix here"]),
    ("max(entries, icu.depth)", "entries * seconds", 14, &["seconds is not known before a run"]),
    (
        "max(entries, icu.depth)",
        "fifos.results",
        11,
        &["entries is no board parameter, and no expression uses it"],
    ),
    (
        "max(entries, icu.depth)",
        "max(entries, fifos.ctu_icu)",
        14,
        &["in a circle: fifos.ctu_icu <- fifos.ctu_icu"],
    ),
    (
        "\"fifos.ctu_icu\" = \"max(entries, icu.depth)\"",
        "\"fifos.ctu_icu\" = \"fifos.results + entries\"\n\"fifos.results\" = \"2 * fifos.ctu_icu\"",
        14,
        &["expressions in a circle", "fifos.ctu_icu", "fifos.results"],
    ),
    (
        "max(entries, icu.depth)",
        "min(4000, ceil(entries * area_mm2))",
        14,
        &["fifos.ctu_icu follows from the cost and changes it"],
    ),
    ("\"max(entries, icu.depth)\"", "0", 14, &["fifos.ctu_icu = 0: expected 1 to 4096"]),
    (
        "ceil(240 * clock_mhz / 1000)",
        "240 * clock_mhz / 1000",
        15,
        &["dram.row_miss_cycles", "expected a whole number"],
    ),
    // Constraints.
    (
        "patch_cache.bytes + list_cache.bytes <= 6144",
        "patch_cache.bytes + list_cache.bytes",
        18,
        &["expected true or false"],
    ),
    ("<= 6144", "<= 1024", 18, &["no combination satisfies", "tried all 96 combinations"]),
    (
        "[[workload]]",
        "[[constraint]]\nrequire = \"icu.depth > 4\"\n[[constraint]]\nrequire = \"icu.depth < 8\"\n[[workload]]",
        23,
        &[
            "contradict each other",
            "\"icu.depth > 4\" in line 21 leaves 48 of 96",
            "\"icu.depth < 8\" in line 23 leaves 48 of 96",
        ],
    ),
    ("<= 6144", "<= lines", 18, &["unknown name \"lines\""]),
    // Boards that cannot be, all of them.
    (
        "\"icu.depth\" = [2, 4, 8, 16]",
        "\"icu.depth\" = [2]\n\"patch_cache.ways\" = [4]\n\"patch_cache.miss_registers\" = [2]\n\"list_cache.bytes\" = [64]\n\"list_cache.ways\" = [2]",
        8,
        &["no combination is a board that can be", "list_cache.bytes = 64"],
    ),
    // Workloads.
    ("cornell-box/scene.toml", "cornel-box/scene.toml", 21, &["no scene file", "cornel-box"]),
    ("\"primary\"", "\"primaries\"", 22, &["unknown rays \"primaries\"", "radiosity"]),
    ("\"primary\"", "\"primary\"\nwidth = 0", 23, &["0, expected a whole number from 1 to 32768"]),
    ("\"primary\"", "\"primary\"\nheigth = 64", 23, &["did you mean \"height\"?"]),
    (
        "[objectives]",
        "[[workload]]\nscene = \"scenes/cornell-box/scene.toml\"\n[objectives]",
        24,
        &["two workloads are named"],
    ),
    (
        "[[workload]]\nscene = \"scenes/cornell-box/scene.toml\"\nrays = \"primary\"\n",
        "",
        1,
        &["without workloads"],
    ),
    // Objectives.
    ("\"seconds\", ", "\"second\", ", 25, &["unknown metric \"second\"", "did you mean \"seconds\"?"]),
    ("minimise =", "minimize =", 25, &["did you mean \"minimise\"?"]),
    ("[\"seconds\", \"area_mm2\"]", "[]", 24, &["no objective"]),
    ("[objectives]\nminimise = [\"seconds\", \"area_mm2\"]", "", 1, &["no objective"]),
    ("\"area_mm2\"]", "\"area_mm2\"]\nmaximise = [\"seconds\"]", 26, &["seconds is an objective twice"]),
    ("osu-0.35um", "ecp5", 25, &["area_mm2 is not known of ecp5"]),
    ("\"area_mm2\"]", "\"luts\"]", 25, &["luts is not known of osu-0.35um, which is no FPGA"]),
    // Search.
    ("\"grid\"", "\"gird\"", 28, &["unknown strategy \"gird\"", "did you mean \"grid\"?"]),
    ("\"grid\"", "\"random\"", 28, &["needs an end: `points` or `minutes`"]),
    ("\"grid\"", "\"grid\"\npopulation = 20", 29, &["population is an option of strategy = \"nsga2\""]),
    ("\"grid\"", "\"sobol\"\npoints = 9\nkeep = 0.5", 30, &["keep is an option of strategy = \"halving\""]),
    ("\"grid\"", "\"halving\"\nkeep = 1.5", 29, &["keep = 1.5, expected over 0 and under 1"]),
    ("\"grid\"", "\"nsga2\"\npoints = 10\npopulation = 20", 29, &["points = 10: a population of 20 is more"]),
    ("\"grid\"", "\"random\"\nminutes = -1.0", 29, &["minutes = -1, expected over 0"]),
    ("\"grid\"", "\"random\"\npoints = 0", 29, &["0, expected a whole number from 1"]),
];

#[test]
fn good_space_loads_and_its_candidates_follow_the_expressions() {
    let space = Space::parse(GOOD, &file()).unwrap();
    assert_eq!(space.n_combinations(), 4 * 4 * 3 * 2);
    // The last axis is fastest: depth 2, 4 contexts, 1024 B, then 16 entries.
    let candidate = space.candidate(1).unwrap();
    assert_eq!(candidate.choice, [0, 0, 0, 1]);
    assert_eq!((candidate.spec.icu.depth, candidate.spec.fifos.ctu_icu), (2, 16));
    assert_eq!(candidate.spec.patch_cache.bytes, 1024);
    let deepest = space.candidate(space.ordinal(&[3, 0, 0, 0])).unwrap();
    assert_eq!((deepest.spec.icu.depth, deepest.spec.fifos.ctu_icu), (16, 16));
}

#[test]
fn each_bad_space_is_refused_with_file_line_value_and_expectation() {
    let mut wrong = Vec::new();
    for (from, to, line, words) in CASES {
        assert!(GOOD.contains(from), "{from:?} is not in the good space");
        let text = GOOD.replacen(from, to, 1);
        let shown = match Space::parse(&text, &file()) {
            Ok(_) => {
                wrong.push(format!("{to:?}: accepted"));
                continue;
            }
            Err(error) => error.to_string(),
        };
        let place = format!("{}:{line}:", file().display());
        let lacks: Vec<_> = words.iter().filter(|w| !shown.contains(**w)).collect();
        if !lacks.is_empty() || shown.contains('\n') || !shown.starts_with(&place) {
            wrong.push(format!("{to:?}: expected line {line} and {lacks:?}, is\n    {shown}"));
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), CASES.len(), wrong.join("\n"));
}

#[test]
fn impossible_boards_in_the_middle_of_a_range_are_listed_with_their_reason_and_the_space_stands() {
    // Two ways need 128 bytes at least; 100 and 6 are no powers of two whatever the ways.
    let text = GOOD
        .replace(
            "\"icu.depth\" = [2, 4, 8, 16]",
            "\"clusters.modules\" = [1, 4]\n\"clusters.bundle_slots\" = { from = 1, to = 8 }",
        )
        .replace("icu.depth", "clusters.modules");
    let space = Space::parse(&text, &file()).unwrap();
    let listed = space.impossible(0..space.n_combinations());
    assert_eq!(listed.n_asked, 2 * 8 * 4 * 3 * 2);
    // Four modules with one, two or three slots.
    assert_eq!(listed.list.len(), 3 * 4 * 3 * 2);
    assert_eq!(listed.by_reason.len(), 3);
    for (reason, n) in &listed.by_reason {
        assert!(reason.starts_with("clusters.bundle_slots = ") && reason.contains("at least one per module"));
        assert_eq!(*n, 4 * 3 * 2);
    }
    for impossible in &listed.list {
        let choice = space.choice(impossible.ordinal);
        assert!(choice[0] == 1 && choice[1] < 3, "{choice:?}");
    }
}

/// The texts of all shipped spaces and the good one.
fn texts() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/spaces");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "toml"));
    files.sort();
    assert!(files.len() >= 8);
    let shipped = files.iter().map(|path| std::fs::read_to_string(path).unwrap());
    shipped.chain([GOOD.replace("scenes/", "../")]).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn damaged_spaces_end_in_a_space_or_in_one_line_with_a_place_within_a_second(
        which in any::<prop::sample::Index>(),
        damages in prop::collection::vec(damage(), 1..4),
        ordinals in prop::collection::vec(any::<u64>(), 4),
    ) {
        thread_local! {
            static TEXTS: Vec<String> = texts();
        }
        let mut bytes = TEXTS.with(|texts| which.get(texts).clone().into_bytes());
        for damage in &damages {
            apply(&mut bytes, damage);
        }
        let text = String::from_utf8_lossy(&bytes);
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/spaces/test.toml");
        let start = Instant::now();
        match Space::parse(&text, &file) {
            Ok(space) => {
                for ordinal in ordinals {
                    let _ = space.candidate(ordinal % space.n_combinations());
                }
            }
            Err(error) => {
                let shown = error.to_string();
                prop_assert!(!shown.contains('\n') && shown.starts_with(&file.display().to_string()), "{shown}");
                let place = error.place.expect("a damaged file still has text to point into");
                prop_assert!((1..=text.matches('\n').count() + 1).contains(&place.line), "{shown}");
            }
        }
        prop_assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
    }
}

/// Expressions of random pieces, most of them nonsense.
fn random_expression() -> impl Strategy<Value = String> {
    let pieces = prop::sample::select(vec![
        "1",
        "2.5",
        "1e",
        "e-3",
        "0x1f",
        "icu.depth",
        "entries",
        "partition",
        "clock_mhz",
        "area_mm2",
        "(",
        "((",
        ")",
        "))",
        "+",
        "-",
        "*",
        "/",
        "%",
        "^",
        "==",
        "!=",
        "<",
        ">=",
        "&&",
        "||",
        "!",
        "=",
        "+=",
        ",",
        ";",
        "min(",
        "max(",
        "if(",
        "ceil(",
        "math::ln(",
        "true",
        "'",
        "\\\"",
        "/*",
        "*/",
        "//",
        " ",
        "&",
        "|",
        "inf",
        "nan",
        "9223372036854775807",
        "ä",
    ]);
    prop::collection::vec(pieces, 1..14).prop_map(|pieces| pieces.concat())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn nonsense_in_expressions_never_panics_and_is_named_at_its_line(
        text in random_expression(),
        in_constraint in any::<bool>(),
    ) {
        let (from, line) = if in_constraint {
            ("patch_cache.bytes + list_cache.bytes <= 6144", 18)
        } else {
            ("max(entries, icu.depth)", 14)
        };
        if let Err(error) = Space::parse(&GOOD.replacen(from, &text, 1), &file()) {
            let shown = error.to_string();
            let at = error.place.expect("a text to point into").line;
            // Without an expression that uses it, `entries` is without use; a value may be impossible everywhere.
            prop_assert!(at == line || at == 11 || at == 8, "line {at}: {shown}");
        }
    }
}

/// A space of random axes, some of whose values clash with others.
fn random_space() -> impl Strategy<Value = String> {
    let axis = |name: &'static str, pool: &'static [&'static str]| {
        prop::sample::subsequence(pool, 0..=pool.len()).prop_shuffle().prop_map(move |values| {
            if values.is_empty() { String::new() } else { format!("{name:?} = [{}]\n", values.join(", ")) }
        })
    };
    (
        axis("icu.depth", &["1", "3", "8", "22", "100"]),
        axis("clusters.modules", &["1", "2", "4"]),
        axis("clusters.bundle_slots", &["1", "2", "3", "8"]),
        axis("partition", &["\"grid\"", "\"shells\"", "\"shells+static\""]),
        axis("shells.prefetch", &["true", "false"]),
        axis("grid_log2", &["\"auto\"", "2", "7"]),
        axis("patch_cache.bytes", &["0", "64", "256", "1024"]),
        axis("patch_cache.ways", &["1", "4", "16"]),
    )
        .prop_map(|(a, b, c, d, e, f, g, h)| {
            let axes = [a, b, c, d, e, f, g, h].concat();
            let axes = if axes.is_empty() { "\"icu.depth\" = [3]\n".to_owned() } else { axes };
            format!(
                "version = 1\n[axes]\n{axes}[set]\n\"fifos.results\" = \"2 * clusters.modules\"\n\
                 [[workload]]\nscene = \"scenes/lit-cube/scene.toml\"\n[objectives]\nminimise = [\"cycles\"]\n"
            )
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn choices_and_ordinals_of_random_spaces_are_inverse_and_candidates_are_valid(
        text in random_space(),
        picks in prop::collection::vec(any::<u64>(), 20),
    ) {
        // All boards of it may be impossible: that is told.
        let space = match Space::parse(&text, &file()) {
            Ok(space) => space,
            Err(e) => {
                prop_assert!(e.to_string().contains("no combination is a board that can be"), "{e}\n{text}");
                return Ok(());
            }
        };
        for pick in picks {
            let ordinal = pick % space.n_combinations();
            let choice = space.choice(ordinal);
            prop_assert_eq!(choice.len(), space.axes.len());
            prop_assert!(choice.iter().zip(&space.axes).all(|(place, axis)| *place < axis.values.len()));
            prop_assert_eq!(space.ordinal(&choice), ordinal);
            match space.candidate(ordinal) {
                Ok(candidate) => {
                    prop_assert_eq!((candidate.ordinal, &candidate.choice), (ordinal, &choice));
                    prop_assert_eq!(candidate.spec.validate(), Ok(()));
                    prop_assert_eq!(candidate.spec.fifos.results, 2 * candidate.spec.clusters.modules);
                }
                Err(impossible) => prop_assert!(!impossible.reason.is_empty() && impossible.ordinal == ordinal),
            }
        }
    }
}
