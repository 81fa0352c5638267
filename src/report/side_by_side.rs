//! A ray on which answers differ, for whoever looks for the fault: everyone's answer, then every wire of the tests
//! concerned, board and oracle side by side.
//!
//! ```text
//! Case {ray, answers, patches} --taps, oracle::wires--> lines: wire, bits, board, oracle, mark where they differ
//! ```

use std::fmt::Write as _;

use rtl_model::datapath::ray_patch::{intersect, taps};
use rtl_model::datapath::{HitWords, PatchWords, RayWords};
use rtl_model::fixed::Formats;
use rtl_model::oracle::{self, Wires};

use super::terminal::purpose_name;
use super::verify::describe;
use crate::vectors::{Expected, Vectors, Wrong, board_wires, side, wire_names, wire_values};
use crate::verify::{Compared, Mismatch, Model};

/// What stands at the end of a line whose values differ.
const DIFFERS: &str = "  <-- differ";

/// A ray with everyone's answers.
#[derive(Clone, Debug)]
pub struct Case<'a> {
    /// Formats of all words.
    pub formats: &'a Formats,
    /// The ray.
    pub ray: &'a RayWords,
    /// Who answered what.
    pub answers: Vec<(&'static str, Expected)>,
    /// The patches concerned: those that an answer names come out in full, and of the others those whose wires differ.
    pub patches: &'a [PatchWords],
    /// Wires and answer that a file has for the first patch.
    pub file: Option<(&'a Wires, Option<HitWords>)>,
}

/// The case as text.
pub fn side_by_side(case: &Case<'_>) -> String {
    let mut out = String::new();
    let f = case.formats;
    let mut ray_row = |name: &str, words: [i32; 3], bits: u32| {
        let [x, y, z] = words;
        let _ = writeln!(out, "  {name:<10} {x:>12} {y:>12} {z:>12}   words of 2^-{bits}");
    };
    ray_row("origin", case.ray.origin, f.coord_frac_bits);
    ray_row("direction", case.ray.dir, f.dir_frac_bits);
    let _ =
        writeln!(out, "  {:<10} {:>12} {:>28} words of 2^-{}", "t_max", case.ray.t_max, "", f.t_frac_bits);
    let _ = writeln!(
        out,
        "\n  {:<18} {:>12} {:>10}  {:<6} t in units of the direction",
        "who", "t", "patch", "side"
    );
    for (who, answer) in &case.answers {
        let _ = writeln!(out, "  {who:<18} {}", answer_columns(f, *answer));
    }
    let named: Vec<u32> = case.answers.iter().filter_map(|(_, a)| a.hit()).map(|hit| hit.patch).collect();
    let mut silent = 0;
    for (i, patch) in case.patches.iter().enumerate() {
        let file = case.file.filter(|_| i == 0);
        let table = PatchTable::new(f, case.ray, patch, file);
        if file.is_some() || named.contains(&patch.id) || table.differs() {
            table.write(&mut out);
        } else {
            silent += 1;
        }
    }
    if silent > 0 {
        let _ = writeln!(out, "\n  tested too: {silent} patches, on whose every wire board and oracle agree");
    }
    out
}

fn answer_columns(f: &Formats, answer: Expected) -> String {
    match answer {
        Expected::Any(true) => "hit".to_owned(),
        Expected::Any(false) | Expected::Nearest(None) => "miss".to_owned(),
        Expected::Nearest(Some(HitWords { t, patch, facing })) => {
            let units = t as f64 / f64::from(f.t_frac_bits).exp2();
            format!("{t:>12} {patch:>10}  {:<6} {units:.9}", side(facing))
        }
    }
}

/// What does not hold in a file of vectors, as text.
pub fn wrong_text(vectors: &Vectors, wrong: &Wrong) -> String {
    let (answers, Wrong::Ray { place, .. } | Wrong::Test { place, .. }) = (wrong.answers(), wrong);
    let file = answers.expected.map(|a| ("file", a));
    let clocked = answers.clocked.map(|a| ("board, clocked", a));
    let others = [("board, functional", answers.functional), ("oracle", answers.oracle)];
    let answers = file.into_iter().chain(clocked).chain(others).collect();
    let formats = &vectors.formats;
    match wrong {
        Wrong::Ray { patches, .. } => {
            let ray = &vectors.rays[*place];
            let mode = if ray.any_hit { "any" } else { "nearest" };
            let case = Case { formats, ray: &ray.words, answers, patches, file: None };
            format!(
                "\nfirst wrong answer: ray {place} of the file (from 0), {mode} hit\n{}",
                side_by_side(&case)
            )
        }
        Wrong::Test { .. } => {
            let test = &vectors.tests[*place];
            let ray = &vectors.rays[test.ray].words;
            let patches = &vectors.patches[test.patch..=test.patch];
            let case = Case { formats, ray, answers, patches, file: Some((&test.wires, test.hit)) };
            format!(
                "\nfirst wrong answer: test {place} of the file (from 0), its ray {} with patch {}\n{}",
                test.ray,
                patches[0].id,
                side_by_side(&case)
            )
        }
    }
}

/// The first mismatch of a verification as text; `title` says of which run.
pub fn mismatch_text(title: &str, formats: &Formats, m: &Mismatch) -> String {
    let (board, oracle) = match m.compared {
        Compared::AnyHit { board, oracle } => (Expected::Any(board), Expected::Any(oracle)),
        _ => (Expected::Nearest(m.board), Expected::Nearest(m.oracle)),
    };
    let who = match m.model {
        Model::Functional => "board, functional",
        Model::Clocked => "board, clocked",
    };
    let case = Case {
        formats,
        ray: &m.ray,
        answers: vec![(who, board), ("oracle", oracle)],
        patches: &m.patches,
        file: None,
    };
    format!(
        "\nfirst mismatch: {title}{} ray {}, {}\n{}",
        purpose_name(m.purpose),
        m.index,
        describe(&m.compared),
        side_by_side(&case)
    )
}

/// All wires of one test, a column for each of those who have them.
struct PatchTable {
    title: String,
    /// Board, oracle, and the file where it has wires.
    columns: Vec<(&'static str, Vec<String>)>,
    names: Vec<String>,
    bits: Vec<Option<u32>>,
}

impl PatchTable {
    fn new(
        f: &Formats,
        ray: &RayWords,
        patch: &PatchWords,
        file: Option<(&Wires, Option<HitWords>)>,
    ) -> PatchTable {
        let values = |wires: &Wires, hit: Option<HitWords>| {
            let mut column: Vec<String> = wire_values(wires).iter().map(ToString::to_string).collect();
            column.push(hit.map_or("miss".to_owned(), |h| h.t.to_string()));
            column.push(hit.map_or("-".to_owned(), |h| side(h.facing).to_owned()));
            column
        };
        let mut columns = vec![
            ("board", values(&board_wires(&taps(f, ray, patch)), intersect(f, ray, patch))),
            ("oracle", values(&oracle::wires(f, ray, patch), oracle::intersect(f, ray, patch))),
        ];
        columns.extend(file.map(|(wires, hit)| ("file", values(wires, hit))));
        let widths = f.width_table();
        let mut names = wire_names(patch.is_triangle);
        let bits_of = |name: &String| {
            let wire = name.trim_end_matches(|c: char| c == '.' || "xyz0123456789".contains(c));
            widths.iter().find(|w| w.wire == wire).map(|w| w.bits)
        };
        let mut bits: Vec<Option<u32>> = names.iter().map(bits_of).collect();
        names.extend(["t".to_owned(), "side".to_owned()]);
        bits.extend([widths.iter().find(|w| w.wire == "t").map(|w| w.bits), None]);
        let n = if patch.is_triangle { 3 } else { 4 };
        let corners: Vec<String> =
            patch.corners[..n].iter().map(|[x, y, z]| format!("({x} {y} {z})")).collect();
        let kind = if patch.is_triangle { "triangle" } else { "quad" };
        let title = format!("patch {}, {kind} {}", patch.id, corners.join(" "));
        PatchTable { title, columns, names, bits }
    }

    fn row_differs(&self, row: usize) -> bool {
        let first = &self.columns[0].1[row];
        self.columns.iter().any(|(_, column)| column[row] != *first)
    }

    fn differs(&self) -> bool {
        (0..self.names.len()).any(|row| self.row_differs(row))
    }

    fn write(&self, out: &mut String) {
        let name = self.names.iter().map(String::len).max().unwrap_or(0);
        let longest = |column: &[String]| column.iter().map(String::len).max().unwrap_or(0);
        let width = self.columns.iter().map(|(_, c)| longest(c)).max().unwrap_or(0).max(6);
        let _ = write!(out, "\n{}\n  {:<name$} {:>4}", self.title, "wire", "bits");
        for (who, _) in &self.columns {
            let _ = write!(out, "  {who:>width$}");
        }
        out.push('\n');
        for (row, wire) in self.names.iter().enumerate() {
            let bits = self.bits[row].map_or(String::new(), |b| b.to_string());
            let _ = write!(out, "  {wire:<name$} {bits:>4}");
            for (_, column) in &self.columns {
                let _ = write!(out, "  {:>width$}", column[row]);
            }
            out.push_str(if self.row_differs(row) { DIFFERS } else { "" });
            out.push('\n');
        }
    }
}
