//! The statements of an OBJ file checked one by one, so that a fault has its line and what follows cannot fail.
//!
//! ```text
//! text --join lines at a final \--> statement --numbers finite, indices in range--> the same, without what is not read
//! ```
//! Indices count from 1, negative ones back from the last; as most programs allow, they may point at what comes later:
//! ranges are those of the whole file.

use std::fmt::Write as _;
use std::path::Path;

use crate::scene::SceneError;

/// Most corners of one polygon.
const MAX_CORNERS: usize = 100_000;

/// Largest number that a file may hold; beyond it squares overflow.
const MAX_NUMBER: f64 = 1e30;

/// A checked OBJ file.
#[derive(Debug, Default)]
pub(super) struct Clean {
    /// Only `v`, `vn`, `f`, `o`, `g`, `usemtl`, `mtllib`.
    pub(super) text: String,
    /// About each `f`, in order.
    pub(super) polygons: Vec<Polygon>,
    /// Statements that were left out, each kind once.
    pub(super) left_out: Vec<&'static str>,
}

/// What tobj does not tell of a polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Polygon {
    /// Smooth group, 0 for none.
    pub(super) group: u32,
    /// Every corner has a normal.
    pub(super) has_normals: bool,
}

/// Points and normals of the whole file.
#[derive(Clone, Copy, Default)]
struct Totals {
    points: usize,
    normals: usize,
    textures: usize,
}

pub(super) fn obj(path: &Path, text: &str, max_faces: usize) -> Result<Clean, SceneError> {
    let fault = |line: &Line<'_>, message: String| line.fault(path, text, message);
    let mut totals = Totals::default();
    for line in text.lines() {
        match line.split_whitespace().next() {
            Some("v") => totals.points += 1,
            Some("vn") => totals.normals += 1,
            Some("vt") => totals.textures += 1,
            _ => {}
        }
    }
    let mut clean = Clean::default();
    clean.text.reserve(text.len() / 2);
    let (mut seen, mut group) = (Totals::default(), 0);
    for line in Lines::of(text) {
        let mut words = line.text.split_whitespace();
        let keyword = words.next().unwrap_or("");
        match keyword {
            "v" => {
                let numbers = line.numbers(&mut words, "v").map_err(|m| fault(&line, m))?;
                let [x, y, z] = position(&numbers).map_err(|m| fault(&line, m))?;
                let _ = writeln!(clean.text, "v {x} {y} {z}");
                seen.points += 1;
            }
            "vn" => {
                let numbers = line.numbers(&mut words, "vn").map_err(|m| fault(&line, m))?;
                let [x, y, z] = numbers[..] else {
                    return Err(fault(&line, format!("{} numbers of `vn`, expected 3", numbers.len())));
                };
                let _ = writeln!(clean.text, "vn {x} {y} {z}");
                seen.normals += 1;
            }
            "vt" => {
                line.numbers(&mut words, "vt").map_err(|m| fault(&line, m))?;
                seen.textures += 1;
            }
            "f" | "fo" => {
                if clean.polygons.len() >= max_faces {
                    return Err(fault(
                        &line,
                        format!("more than {max_faces} faces, the limit of imported meshes"),
                    ));
                }
                let start = clean.text.len();
                clean.text.push('f');
                let (mut n, mut n_normals) = (0, 0);
                for word in words.take_while(|w| !w.starts_with('#')) {
                    let [point, normal] = corner(word, seen, totals).map_err(|m| fault(&line, m))?;
                    n += 1;
                    let _ = write!(clean.text, " {point}");
                    if normal != 0 {
                        n_normals += 1;
                        let _ = write!(clean.text, "//{normal}");
                    }
                }
                if n > MAX_CORNERS {
                    return Err(fault(
                        &line,
                        format!("a face of {n} corners, expected at most {MAX_CORNERS}"),
                    ));
                }
                if n < 3 {
                    return Err(fault(&line, format!("a face of {n} corners, expected at least 3")));
                }
                if n_normals != n && n_normals > 0 {
                    // Some corners only: the file's word is not whole, so it counts as none.
                    let plain = clean.text[start..]
                        .split(' ')
                        .map(|c| c.split('/').next().unwrap_or(""))
                        .collect::<Vec<_>>();
                    let plain = plain.join(" ");
                    clean.text.truncate(start);
                    clean.text.push_str(&plain);
                }
                clean.text.push('\n');
                clean.polygons.push(Polygon { group, has_normals: n_normals == n });
            }
            "s" => {
                group = match words.next().unwrap_or("") {
                    "off" | "" => 0,
                    "on" => 1,
                    number => number.parse().map_err(|_| {
                        fault(
                            &line,
                            format!("smooth group {:?}, expected a number or off", super::shown(number)),
                        )
                    })?,
                };
            }
            "o" | "g" | "usemtl" | "mtllib" => {
                let argument = line.text.trim_start()[keyword.len()..].trim();
                if argument.is_empty() && (keyword == "usemtl" || keyword == "mtllib") {
                    return Err(fault(&line, format!("`{keyword}` without a name")));
                }
                let _ = writeln!(clean.text, "{keyword} {argument}");
            }
            "l" | "p" | "curv" | "curv2" | "surf" | "vp" => {
                let what = match keyword {
                    "l" => "lines",
                    "p" => "points",
                    _ => "free-form curves and surfaces",
                };
                if !clean.left_out.contains(&what) {
                    clean.left_out.push(what);
                }
            }
            "" => {}
            _ if keyword.starts_with('#') => {}
            _ if keyword.chars().any(|c| c.is_control() || c == char::REPLACEMENT_CHARACTER) => {
                return Err(fault(&line, "expected a statement of an OBJ file (text)".to_owned()));
            }
            // Display attributes and statements of later versions.
            _ => {}
        }
    }
    if clean.polygons.is_empty() {
        return Err(SceneError::of_file(path, "no faces in it, expected at least one `f` statement"));
    }
    Ok(clean)
}

/// x y z, with a weight w that divides them, or a color r g b that is left out.
fn position(numbers: &[f64]) -> Result<[f64; 3], String> {
    match *numbers {
        [x, y, z] | [x, y, z, _, _, _] | [x, y, z, _, _, _, _] => Ok([x, y, z]),
        [_, _, _, 0.0] => Err("a weight w of 0, expected another".to_owned()),
        [x, y, z, w] => {
            let p = [x / w, y / w, z / w];
            if p.iter().all(|c| c.abs() <= MAX_NUMBER) { Ok(p) } else { Err(format!("a weight w of {w:e}")) }
        }
        _ => Err(format!("{} numbers of `v`, expected 3 (or 4 with w, 6 with a color)", numbers.len())),
    }
}

/// Point and normal (0 for none) of a face's corner, both from 1.
fn corner(word: &str, seen: Totals, totals: Totals) -> Result<[usize; 2], String> {
    let malformed = || format!("corner {:?}, expected v, v/vt, v//vn or v/vt/vn", super::shown(word));
    let mut parts = word.split('/');
    let mut index = |what: &str, n_seen: usize, n_total: usize| match parts.next() {
        None | Some("") => Ok(0),
        Some(part) => {
            let number: i64 = part.parse().map_err(|_| malformed())?;
            let absolute = if number < 0 { n_seen as i64 + 1 + number } else { number };
            if number == 0 || absolute < 1 || absolute > n_total as i64 {
                return Err(format!("corner {:?}: {what} {number} of {n_total}", super::shown(word)));
            }
            Ok(absolute as usize)
        }
    };
    let point = index("point", seen.points, totals.points)?;
    index("texture point", seen.textures, totals.textures)?;
    let normal = index("normal", seen.normals, totals.normals)?;
    if point == 0 || parts.next().is_some() { Err(malformed()) } else { Ok([point, normal]) }
}

/// A statement: one line, or several where a line ends in a backslash.
pub(super) struct Line<'a> {
    pub(super) text: std::borrow::Cow<'a, str>,
    /// Where its first line starts in the text.
    start: usize,
}

impl Line<'_> {
    /// A fault of this statement.
    pub(super) fn fault(&self, path: &Path, text: &str, message: String) -> SceneError {
        let line = text[self.start..].lines().next().unwrap_or("");
        let indent = line.len() - line.trim_start().len();
        let start = self.start + indent;
        // The terminal shows the line, not a file of hundreds of megabytes.
        SceneError::at_line(path, text, start..self.start + line.trim_end().len().max(indent), message)
    }

    /// All numbers that follow; a comment ends them.
    pub(super) fn numbers<'w>(
        &self,
        words: &mut impl Iterator<Item = &'w str>,
        of: &str,
    ) -> Result<Vec<f64>, String> {
        let mut numbers = Vec::with_capacity(4);
        for word in words.take_while(|w| !w.starts_with('#')) {
            let number: f64 =
                word.parse().map_err(|_| format!("{:?} in `{of}`, expected a number", super::shown(word)))?;
            if number.is_nan() || number.abs() > MAX_NUMBER {
                return Err(format!(
                    "{:?} in `{of}`, expected a finite number within +-{MAX_NUMBER:e}",
                    super::shown(word)
                ));
            }
            if numbers.len() >= 8 {
                return Err(format!("more than 8 numbers of `{of}`"));
            }
            numbers.push(number);
        }
        Ok(numbers)
    }
}

/// Statements of a text.
pub(super) struct Lines<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn of(text: &'a str) -> Lines<'a> {
        Lines { text, at: 0 }
    }

    fn physical(&mut self) -> Option<&'a str> {
        let rest = &self.text[self.at..];
        if rest.is_empty() {
            return None;
        }
        let end = rest.find('\n').map_or(rest.len(), |i| i + 1);
        self.at += end;
        Some(rest[..end].trim_end_matches(['\n', '\r']))
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        let start = self.at;
        let first = self.physical()?;
        if !first.ends_with('\\') {
            return Some(Line { text: first.into(), start });
        }
        let mut joined = String::new();
        let mut line = first;
        while let Some(continued) = line.strip_suffix('\\') {
            joined.push_str(continued);
            joined.push(' ');
            line = self.physical().unwrap_or("");
        }
        joined.push_str(line);
        Some(Line { text: joined.into(), start })
    }
}
