//! Text to vectors, strictly: every field is checked, and the first fault is named with its line.

use rtl_model::datapath::{Facing, HitWords, PatchWords, RayWords};
use rtl_model::fixed::Formats;

use super::build::{Builder, MAX_GRID_LOG2, MAX_ID};
use super::csv_write::{ROUNDINGS, VERSION};
use super::wires::{from_values, n_wires};
use super::{Expected, Fault, Place, RayVector, TestVector, Vectors, VectorsError, wire_names};

/// Vectors from text; a byte order mark before it is skipped.
///
/// # Errors
/// The first line with a fault: the field, what it says and what was expected.
pub fn from_csv(text: &str) -> Result<Vectors, VectorsError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut stage = Stage::Version;
    for (i, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default().trim();
        if content.is_empty() {
            continue;
        }
        stage = stage.read(content).map_err(|fault| fault.at(Place::Line(i + 1)))?;
    }
    match stage {
        Stage::End(builder) => Ok(builder.finish()),
        Stage::Records(builder) => {
            let [patches, rays, tests] = builder.counts();
            let so_far = format!("{patches} patches, {rays} rays, {tests} tests");
            Err(missing(&format!("end,patches,rays,tests after {so_far}"), text))
        }
        Stage::Version => Err(missing("vectors,1", text)),
        Stage::Formats => Err(missing("formats,F,D,T,K,rounding", text)),
    }
}

fn missing(record: &str, text: &str) -> VectorsError {
    Fault::new("the end of the file", "here", format!("a line {record}"))
        .at(Place::Line(text.lines().count().max(1)))
}

/// What the next record may be.
#[derive(Debug)]
enum Stage {
    /// `vectors`.
    Version,
    /// `formats`.
    Formats,
    /// Any of the others.
    Records(Builder),
    /// None: `end` was read.
    End(Builder),
}

impl Stage {
    fn read(self, line: &str) -> Result<Stage, Fault> {
        let mut record = Record { fields: line.split(','), n_read: 0 };
        let kind = record.text("the record", "a record")?;
        Ok(match (self, kind) {
            (Stage::Version, "vectors") => {
                let range = i128::from(VERSION)..=i128::from(VERSION);
                record.whole::<u32>("the version", range)?;
                record.end()?;
                Stage::Formats
            }
            (Stage::Version, other) => {
                return Err(Fault::new("the first record", quoted(other), format!("vectors,{VERSION}")));
            }
            (Stage::Formats, "formats") => Stage::Records(Builder::new(formats(&mut record)?)?),
            (Stage::Formats, other) => {
                return Err(Fault::new("the second record", quoted(other), "formats,F,D,T,K,rounding"));
            }
            (Stage::End(_), other) => {
                return Err(Fault::new("the record", quoted(other), "nothing after the record end"));
            }
            (Stage::Records(builder), "end") => {
                end(&mut record, builder.counts())?;
                Stage::End(builder)
            }
            (Stage::Records(mut builder), kind) => {
                match kind {
                    "grid" => {
                        let log2_cells = record.whole("the grid", 1..=i128::from(MAX_GRID_LOG2))?;
                        record.end()?;
                        builder.grid(log2_cells)?;
                    }
                    "patch" => {
                        let patch = patch(&mut record, &builder)?;
                        builder.patch(patch)?;
                    }
                    "ray" => {
                        let ray = ray(&mut record, &builder)?;
                        builder.ray(ray)?;
                    }
                    "test" => {
                        let test = test(&mut record, &builder)?;
                        builder.test(test)?;
                    }
                    other => return Err(Fault::new("the record", quoted(other), "patch, ray, test or end")),
                }
                Stage::Records(builder)
            }
        })
    }
}

fn quoted(text: &str) -> String {
    // A hostile field may be as long as the file.
    let shown: String = text.chars().take(60).collect();
    format!("'{shown}'")
}

/// The fields of a line, one after the other.
struct Record<'a> {
    fields: std::str::Split<'a, char>,
    n_read: usize,
}

impl<'a> Record<'a> {
    fn optional(&mut self) -> Option<&'a str> {
        let field = self.fields.next()?;
        self.n_read += 1;
        Some(field.trim())
    }

    fn text(&mut self, field: &str, expected: &str) -> Result<&'a str, Fault> {
        self.optional().ok_or_else(|| Fault::new(field, "missing", expected))
    }

    /// One of the named values.
    fn choice<T: Copy>(&mut self, field: &str, choices: &[(&str, T)]) -> Result<T, Fault> {
        let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
        let expected = names.join(" or ");
        let text = self.text(field, &expected)?;
        let found = choices.iter().find(|(name, _)| *name == text);
        found.map(|(_, value)| *value).ok_or_else(|| Fault::new(field, quoted(text), expected))
    }

    /// A whole number in `range`, which `T` must hold.
    fn whole<T: TryFrom<i128>>(
        &mut self,
        field: &str,
        range: std::ops::RangeInclusive<i128>,
    ) -> Result<T, Fault> {
        let text = self.text(field, "a whole number")?;
        whole(field, text, range)
    }

    fn end(&mut self) -> Result<(), Fault> {
        match self.optional() {
            None => Ok(()),
            Some(text) => {
                Err(Fault::new(format!("field {}", self.n_read), quoted(text), "the end of the line"))
            }
        }
    }
}

fn whole<T: TryFrom<i128>>(
    field: &str,
    text: &str,
    range: std::ops::RangeInclusive<i128>,
) -> Result<T, Fault> {
    let value = text.parse::<i128>().ok().filter(|value| range.contains(value));
    value.and_then(|value| T::try_from(value).ok()).ok_or_else(|| {
        let expected = if *range.start() == *range.end() {
            format!("{}", range.start())
        } else if *range.end() == i128::MAX {
            "a whole number of at most 128 bits".to_owned()
        } else {
            format!("a whole number, {} to {}", range.start(), range.end())
        };
        Fault::new(field, quoted(text), expected)
    })
}

fn formats(record: &mut Record<'_>) -> Result<Formats, Fault> {
    // The formats' own check names the ranges.
    let any = || 0..=i128::from(u32::MAX);
    let coord_frac_bits = record.whole("coord_frac_bits", any())?;
    let dir_frac_bits = record.whole("dir_frac_bits", any())?;
    let t_frac_bits = record.whole("t_frac_bits", any())?;
    let keep = record.text("cross_keep_bits", "a whole number or full")?;
    let cross_keep_bits = if keep == "full" { None } else { Some(whole("cross_keep_bits", keep, any())?) };
    let rounding = record.choice("the rounding", &ROUNDINGS)?;
    record.end()?;
    Ok(Formats { coord_frac_bits, dir_frac_bits, t_frac_bits, cross_keep_bits, rounding })
}

/// The last record: a file that was cut off, even between two lines, has none, or not its counts.
fn end(record: &mut Record<'_>, counts: [usize; 3]) -> Result<(), Fault> {
    for (what, count) in ["patches", "rays", "tests"].into_iter().zip(counts) {
        let field = format!("the number of {what} at the end");
        let said: usize = record.whole(&field, 0..=i128::from(u32::MAX))?;
        if said != count {
            return Err(Fault::new(field, said, format!("{count}, as many as stand before it")));
        }
    }
    record.end()
}

fn patch(record: &mut Record<'_>, builder: &Builder) -> Result<PatchWords, Fault> {
    let id = record.whole("the id", 0..=i128::from(MAX_ID))?;
    let is_triangle = record.choice("the kind", &[("triangle", true), ("quad", false)])?;
    let cube = 1_i128 << builder.formats().coord_frac_bits;
    let mut corners = [[0; 3]; 4];
    let n = if is_triangle { 3 } else { 4 };
    for (i, corner) in corners.iter_mut().take(n).enumerate() {
        for (axis, word) in ["x", "y", "z"].iter().zip(corner) {
            *word = record.whole(&format!("{axis}{i}"), -cube..=cube - 1)?;
        }
    }
    if is_triangle {
        corners[3] = corners[2];
    }
    record.end()?;
    Ok(PatchWords { corners, is_triangle, id })
}

fn ray(record: &mut Record<'_>, builder: &Builder) -> Result<RayVector, Fault> {
    let any_hit = record.choice("the mode", &[("nearest", false), ("any", true)])?;
    let formats = builder.formats();
    let (cube, unit) = (1_i128 << formats.coord_frac_bits, 1_i128 << formats.dir_frac_bits);
    let mut words = RayWords { origin: [0; 3], dir: [0; 3], t_max: 0 };
    for (field, word) in ["ox", "oy", "oz"].iter().zip(&mut words.origin) {
        *word = record.whole(field, -cube..=cube - 1)?;
    }
    for (field, word) in ["dx", "dy", "dz"].iter().zip(&mut words.dir) {
        *word = record.whole(field, 1 - unit..=unit - 1)?;
    }
    let most_t = i128::from(formats.t_limit());
    words.t_max = record.whole("t_max", 0..=most_t)?;
    let expected = match (record.optional(), any_hit) {
        (None, _) => None,
        (Some("miss"), true) => Some(Expected::Any(false)),
        (Some("hit"), true) => Some(Expected::Any(true)),
        (Some(other), true) => {
            return Err(Fault::new("the answer of an any-hit ray", quoted(other), "miss or hit"));
        }
        (Some("miss"), false) => Some(Expected::Nearest(None)),
        (Some(t), false) => {
            let t = whole("t of the hit", t, 0..=most_t)?;
            let patch = record.whole("patch of the hit", 0..=i128::from(MAX_ID))?;
            let facing = record.choice("the side of the hit", &SIDES)?;
            Some(Expected::Nearest(Some(HitWords { t, patch, facing })))
        }
    };
    record.end()?;
    Ok(RayVector { words, any_hit, expected })
}

const SIDES: [(&str, Facing); 2] = [("front", Facing::Front), ("back", Facing::Back)];

fn test(record: &mut Record<'_>, builder: &Builder) -> Result<TestVector, Fault> {
    let ray = record.whole("the test's ray", 0..=i128::from(u32::MAX))?;
    let id = record.whole("the test's patch", 0..=i128::from(MAX_ID))?;
    let place = builder.place_of(id);
    let place = place.ok_or_else(|| Fault::new("the test's patch", id, "the id of a patch before it"))?;
    let most_t = i128::from(builder.formats().t_limit());
    let hit = match record.text("the test's answer", "miss or t")? {
        "miss" => {
            record.choice("the side of a miss", &[("-", ())])?;
            None
        }
        t => {
            let t = whole("the test's t", t, 0..=most_t)?;
            Some(HitWords { t, patch: id, facing: record.choice("the side of the hit", &SIDES)? })
        }
    };
    let is_triangle = builder.patches()[place].is_triangle;
    let names = wire_names(is_triangle);
    let mut values = Vec::with_capacity(n_wires(is_triangle));
    for name in &names {
        values.push(record.whole::<i128>(name, i128::MIN..=i128::MAX)?);
    }
    record.end()?;
    let wires = from_values(is_triangle, &values).map_err(|(i, expected)| {
        let name = names.get(i).map_or("the wires", String::as_str);
        Fault::new(name, values.get(i).copied().unwrap_or(0), expected)
    })?;
    Ok(TestVector { ray, patch: place, hit, wires })
}
