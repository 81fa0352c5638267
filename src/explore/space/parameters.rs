//! Board parameters by their dotted names: what kind of value each has, and boards made of them.
//!
//! ```text
//! base BoardSpec --> TOML table --set("icu.depth", 8)--> table --> BoardSpec
//! ```
//! A parameter that may be absent (`grid_log2`, `formats.cross_keep_bits`) has a word for that: `"auto"`, `"all"`.

use std::collections::BTreeMap;
use std::ops::Range;

use rtl_model::spec::{BoardSpec, MemoryLevels, Partition};

use super::super::value::Value;
use super::faults::Fault;
use crate::scene::toml::faults::suggest;
use crate::scene::toml::source::Source;

/// What a parameter's values are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Bool,
    Integer,
    Float,
    Text,
}

#[derive(Clone, Debug)]
struct Parameter {
    kind: Kind,
    /// The word for its absence, where it may be absent.
    absent: Option<String>,
}

/// The parameters of a base board.
#[derive(Clone, Debug)]
pub(super) struct Parameters {
    base: toml::Table,
    known: BTreeMap<String, Parameter>,
    /// Boards in which a value that depends on others is most likely possible.
    permissive: Vec<toml::Table>,
}

/// A value that no board can have.
pub(super) struct NoSuchValue {
    what: String,
    /// A word, and the words that are possible.
    word: Option<(String, Vec<String>)>,
}

impl NoSuchValue {
    /// As a fault at a place.
    pub(super) fn at(self, source: &Source<'_>, at: Range<usize>) -> Fault {
        let fault = source.fault(at, self.what);
        match self.word {
            Some((given, known)) => suggest(fault, &given, known.iter().map(String::as_str)),
            None => fault,
        }
    }
}

impl Parameters {
    /// Those of `base`.
    pub(super) fn of(base: &BoardSpec) -> Parameters {
        let absent_ones = BoardSpec { grid_log2: None, ..BoardSpec::default() };
        let mut present = BoardSpec { grid_log2: Some(1), ..BoardSpec::default() };
        present.formats.cross_keep_bits = Some(1);
        let (absent_table, present) = (table(&absent_ones), table(&present));
        let known = absent_ones.parameters().into_iter().filter_map(|row| {
            let kind = match get(&present, row.name)? {
                toml::Value::Boolean(_) => Kind::Bool,
                toml::Value::Integer(_) => Kind::Integer,
                toml::Value::Float(_) => Kind::Float,
                _ => Kind::Text,
            };
            let absent = get(&absent_table, row.name).is_none().then_some(row.value);
            Some((row.name.to_owned(), Parameter { kind, absent }))
        });
        let known = known.collect();
        let permissive = permissive().iter().map(table).collect();
        Parameters { base: table(base), known, permissive }
    }

    /// Whether a parameter has this name.
    pub(super) fn is_known(&self, name: &str) -> bool {
        self.known.contains_key(name)
    }

    /// All names.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.known.keys().map(String::as_str)
    }

    /// Sets a value of the base board.
    pub(super) fn set_base(&mut self, name: &str, value: &Value) {
        set(&self.known, &mut self.base, name, value);
    }

    /// The base board's value.
    pub(super) fn base_value(&self, name: &str) -> Value {
        match get(&self.base, name) {
            Some(toml::Value::Boolean(b)) => Value::Bool(*b),
            Some(toml::Value::Integer(n)) => Value::Integer(*n),
            Some(toml::Value::Float(x)) => Value::Float(*x),
            Some(other) => Value::Text(other.as_str().unwrap_or_default().to_owned()),
            None => Value::Text(self.known.get(name).and_then(|p| p.absent.clone()).unwrap_or_default()),
        }
    }

    /// `value` as parameter `name` takes it: 8.0 is 8 where whole numbers are wanted.
    ///
    /// # Errors
    /// What it expects instead.
    pub(super) fn convert(&self, name: &str, value: &Value) -> Result<Value, String> {
        let Some(Parameter { kind, absent }) = self.known.get(name) else {
            return Ok(value.clone());
        };
        let absent_word = match (absent, value) {
            (Some(word), Value::Text(given)) => word == given,
            _ => false,
        };
        let or_absent = absent.as_ref().map_or(String::new(), |word| format!(" or {word:?}"));
        let expected = match (kind, value) {
            _ if absent_word => return Ok(value.clone()),
            (Kind::Bool, Value::Bool(_))
            | (Kind::Integer, Value::Integer(_))
            | (Kind::Text, Value::Text(_)) => {
                return Ok(value.clone());
            }
            (Kind::Float, Value::Float(x)) => return Ok(Value::Float(*x)),
            (Kind::Float, Value::Integer(n)) => return Ok(Value::Float(*n as f64)),
            (Kind::Integer, Value::Float(x)) => {
                // Beyond 2^53 neighbours of a float are no whole numbers apart.
                if x.fract() == 0.0 && x.abs() <= (1_u64 << 53) as f64 {
                    return Ok(Value::Integer(*x as i64));
                }
                "a whole number: ceil(), floor() or round() make one"
            }
            (Kind::Bool, _) => "true or false",
            (Kind::Integer, _) => "a whole number",
            (Kind::Float, _) => "a number",
            (Kind::Text, _) => "a word in quotes",
        };
        Err(format!("{name} = {}: expected {expected}{or_absent}", shown(value)))
    }

    /// Whether a board can have this value, whatever its other parameters.
    ///
    /// # Errors
    /// What it expects instead.
    pub(super) fn possible(&self, name: &str, value: &Value) -> Result<(), NoSuchValue> {
        let mut first = None;
        for base in self.permissive.iter().chain([&self.base]) {
            let mut table = base.clone();
            // The clocks' ratio has limits: the other one follows.
            if ["clock_mhz", "bus.clock_mhz"].contains(&name) {
                set(&self.known, &mut table, "clock_mhz", value);
                set(&self.known, &mut table, "bus.clock_mhz", value);
            }
            set(&self.known, &mut table, name, value);
            let fault = match spec(table) {
                Ok(spec) => match spec.validate() {
                    Ok(()) => return Ok(()),
                    Err(e) => NoSuchValue { what: e.to_string(), word: None },
                },
                Err(e) => unreadable(name, value, e.message()),
            };
            first.get_or_insert(fault);
        }
        first.map_or(Ok(()), Err)
    }

    /// The board of the base's values and `changes`.
    ///
    /// # Errors
    /// The change that no board can have.
    pub(super) fn spec<'c>(
        &self,
        changes: impl Iterator<Item = (&'c str, &'c Value)> + Clone,
    ) -> Result<BoardSpec, String> {
        let mut table = self.base.clone();
        for (name, value) in changes.clone() {
            set(&self.known, &mut table, name, value);
        }
        spec(table).map_err(|e| {
            // The decoder does not say which key: the change that fails by itself.
            let alone = |(name, value): (&str, &Value)| {
                let mut table = self.base.clone();
                set(&self.known, &mut table, name, value);
                Some(unreadable(name, value, spec(table).err()?.message()).what)
            };
            changes.clone().find_map(alone).unwrap_or_else(|| e.message().to_owned())
        })
    }
}

/// Boards under which a value of one parameter is possible if it is under any: nothing else is in its way.
fn permissive() -> [BoardSpec; 2] {
    let mut grid = BoardSpec {
        partition: Partition::Grid,
        memory: MemoryLevels::Hierarchical,
        watchdog_cycles: 1_000_000_000,
        ..BoardSpec::default()
    };
    grid.formats.coord_frac_bits = 28;
    (grid.clusters.modules, grid.clusters.bundle_slots) = (1, 16);
    (grid.division.table_bits, grid.division.iterations) = (12, 5);
    for (bytes, ways) in [
        (&mut grid.patch_cache.bytes, &mut grid.patch_cache.ways),
        (&mut grid.list_cache.bytes, &mut grid.list_cache.ways),
        (&mut grid.mask_cache.bytes, &mut grid.mask_cache.ways),
        (&mut grid.cluster_buffer.bytes, &mut grid.cluster_buffer.ways),
    ] {
        (*bytes, *ways) = (0, 1);
    }
    grid.bus.width_bits = 8;
    // The watchdog must outlast all latencies: none are long.
    (grid.icu.depth, grid.ctu.depth, grid.cluster_buffer.cycles) = (1, 1, 1);
    (grid.dram.row_hit_cycles, grid.dram.row_miss_cycles) = (0, 0);
    (grid.bus.arbitration_cycles, grid.bus.dma_setup_cycles, grid.dispatch.rebalance_cycles) = (0, 0, 0);
    let shells = BoardSpec { partition: Partition::Shells, ..grid.clone() };
    [grid, shells]
}

fn unreadable(name: &str, value: &Value, message: &str) -> NoSuchValue {
    if let (Some(rest), Value::Text(given)) = (message.strip_prefix("unknown variant "), value) {
        let known: Vec<String> = rest.split('`').skip(3).step_by(2).map(str::to_owned).collect();
        let what = format!("{name} = {given:?}: expected one of {}", known.join(", "));
        return NoSuchValue { what, word: Some((given.clone(), known)) };
    }
    let expected = match value {
        Value::Integer(n) if *n < 0 => "0 or more".to_owned(),
        Value::Integer(_) => "at most 4294967295".to_owned(),
        _ => message.to_owned(),
    };
    NoSuchValue { what: format!("{name} = {}: expected {expected}", shown(value)), word: None }
}

/// A value as it stands in a file.
pub(super) fn shown(value: &Value) -> String {
    match value {
        Value::Text(text) => format!("{text:?}"),
        other => other.to_string(),
    }
}

fn table(spec: &BoardSpec) -> toml::Table {
    // A board is a struct of numbers and words: a test turns every preset into a table and back.
    toml::Table::try_from(spec).unwrap_or_default()
}

fn spec(table: toml::Table) -> Result<BoardSpec, toml::de::Error> {
    table.try_into()
}

fn get<'t>(table: &'t toml::Table, name: &str) -> Option<&'t toml::Value> {
    match name.split_once('.') {
        Some((group, key)) => table.get(group)?.as_table()?.get(key),
        None => table.get(name),
    }
}

/// Sets a value; the word for its absence removes it.
fn set(known: &BTreeMap<String, Parameter>, table: &mut toml::Table, name: &str, value: &Value) {
    let absent = known.get(name).and_then(|p| p.absent.as_deref());
    let (table, key) = match name.split_once('.') {
        Some((group, key)) => match table.get_mut(group).and_then(toml::Value::as_table_mut) {
            Some(inner) => (inner, key),
            None => return,
        },
        None => (table, name),
    };
    let value = match value {
        Value::Bool(b) => toml::Value::Boolean(*b),
        Value::Integer(n) => toml::Value::Integer(*n),
        Value::Float(x) => toml::Value::Float(*x),
        Value::Text(text) if absent == Some(text) => {
            table.remove(key);
            return;
        }
        Value::Text(text) => toml::Value::String(text.clone()),
    };
    match table.get_mut(key) {
        Some(place) => *place = value,
        None => {
            table.insert(key.to_owned(), value);
        }
    }
}
