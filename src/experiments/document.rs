//! Findings as text: of the terminal, and of `docs/board.md`.
//!
//! ```text
//! [(Experiment, Findings)] --> Markdown: question, what was run, tables, plot, what it says, checks
//! ```

use std::fmt::Write as _;

use super::{Experiment, Extent, Findings};

/// Widest line of running text.
const LINE: usize = 120;

/// Tables, sentences and checks for the terminal.
pub fn terminal_text(experiment: &Experiment, findings: &Findings) -> String {
    let mut out = format!("{}: {}\n\n", experiment.name, experiment.title);
    for table in &findings.tables {
        out += &(table.text() + "\n");
    }
    for sentence in &findings.says {
        out += &wrapped(sentence, "- ", "  ");
    }
    for check in &findings.checks {
        let _ = writeln!(out, "{} {}", if check.holds { "holds: " } else { "FAILS: " }, check.what);
    }
    out
}

/// The document of all experiments. `folder` is where their plots lie, as seen from the document.
pub fn document(all: &[(Experiment, Findings)], extent: Extent, folder: &str) -> String {
    let flag = extent.pick("", " --quick");
    let mut out = format!(
        "# What the board does: experiments\n\n\
         Made by `radeng experiment all{flag}`; every number and every sentence under \"What it says\" comes from that run.\n\
         One experiment again: `radeng experiment NAME`. Rows as CSV lie beside the plots.\n\n\
         Cycles are those of this model: clock, word lengths, cache and FIFO sizes and the bus of the historical board are not\n\
         public, and ours are parameters (`radeng info delft-1992`). \"The default board\" is the preset `delft-1992`. A speed-up of\n\
         5 % means that the same rays take 1/1.05 of the cycles. Scenes are meshed coarsely and only some of their rays are run, so\n\
         that all of this takes minutes; other loads give other numbers.\n\n"
    );
    for (experiment, _) in all {
        let title = format!("{}: {}", experiment.name, experiment.title);
        let _ = writeln!(out, "- [{title}](#{})", anchor(&title));
    }
    for (experiment, findings) in all {
        let _ = write!(out, "\n## {}: {}\n\n", experiment.name, experiment.title);
        section(&mut out, experiment, findings, folder);
    }
    out
}

/// The document of an experiment of the host, by its name. `folder` is where its plot, pictures and rows lie, as seen from
/// the document.
pub fn host_document(name: &str, findings: &Findings, extent: Extent, folder: &str) -> String {
    let flag = extent.pick("", " --quick");
    let (title, experiment, made) = match name {
        "adaptive" => (
            "Adaptive meshing: elements for the same error",
            &super::adaptive::EXPERIMENT,
            "Scenes are read from the repository's root. How refinement works: the header of `src/radiosity/refine/mod.rs`. \
             `simulate` and `verify` mesh uniformly whatever the scene says.",
        ),
        "reconstruction" => (
            "Reconstruction without Mach bands",
            &super::reconstruction::EXPERIMENT,
            "Every number and every sentence under \"What it says\" comes from that run.",
        ),
        "two-pass" => (
            "What the two-pass method saves",
            &super::two_pass::EXPERIMENT,
            "How sources are selected and sampled: the headers of `src/direct/`.",
        ),
        _ => (
            "Pass 1 against closed forms",
            &super::VALIDATION,
            "Every row is asserted by `cargo test --release --lib validation` as well.",
        ),
    };
    let mut out = format!("# {title}\n\n");
    let made = format!(
        "Made by `radeng experiment {name}{flag}`, which ends with exit status 1 when a check fails. {made} Rows as CSV lie in \
         `{folder}/`."
    );
    out += &wrapped(&made, "", "");
    out += "\n";
    section(&mut out, experiment, findings, folder);
    out
}

/// Rows of pictures as Markdown tables.
fn pictures(out: &mut String, rows: &[Vec<super::Picture>], folder: &str) {
    for row in rows.iter().filter(|row| !row.is_empty()) {
        let line = |cell: &dyn Fn(&super::Picture) -> String| {
            format!("| {} |\n", row.iter().map(cell).collect::<Vec<_>>().join(" | "))
        };
        *out += "\n";
        *out += &line(&|p| p.title.clone());
        *out += &line(&|_| "---".to_owned());
        *out += &line(&|p| format!("![{}]({folder}/{})", p.title, p.file));
    }
}

/// Question, what was run, plot, pictures, tables, what it says, checks.
fn section(out: &mut String, experiment: &Experiment, findings: &Findings, folder: &str) {
    *out += &wrapped(&format!("**Question.** {}", findings.question), "", "");
    *out += "\n";
    *out += &wrapped(&format!("**What was run.** {}", findings.method), "", "");
    let _ = write!(out, "\n![{}]({folder}/{}.svg)\n", experiment.title, experiment.name);
    pictures(out, &findings.pictures, folder);
    for table in &findings.tables {
        let _ = write!(out, "\n{}:\n\n{}", table.title, table.markdown());
    }
    *out += "\n**What it says.**\n\n";
    for sentence in &findings.says {
        *out += &wrapped(sentence, "- ", "  ");
    }
    *out += "\n**Checked in the run.**\n\n";
    for check in &findings.checks {
        let mark = if check.holds { "holds" } else { "FAILS" };
        *out += &wrapped(&format!("{mark}: {}", check.what), "- ", "  ");
    }
}

/// The anchor that a heading gets.
fn anchor(heading: &str) -> String {
    let kept = heading.to_lowercase();
    let kept = kept.chars().filter(|c| c.is_alphanumeric() || *c == ' ' || *c == '-');
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// Text in lines of at most [`LINE`] characters.
fn wrapped(text: &str, first: &str, next: &str) -> String {
    let mut out = String::new();
    let mut line = first.to_owned();
    let mut is_empty = true;
    for word in text.split_whitespace() {
        if !is_empty && line.chars().count() + 1 + word.chars().count() > LINE {
            out += &(std::mem::replace(&mut line, next.to_owned()) + "\n");
            is_empty = true;
        }
        if !is_empty {
            line.push(' ');
        }
        line += word;
        is_empty = false;
    }
    out + &line + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapped_text_keeps_every_word_and_no_line_too_long() {
        let text = "word and ".repeat(60);
        let lines = wrapped(&text, "- ", "  ");
        assert!(lines.lines().count() > 3 && lines.lines().all(|l| l.len() <= LINE));
        assert_eq!(lines.replace("- ", "").split_whitespace().count(), 120);
    }

    #[test]
    fn anchor_of_a_heading_is_lower_case_with_hyphens() {
        assert_eq!(anchor("shells-2d: 1990: shells against"), "shells-2d-1990-shells-against");
    }
}
