//! A waveform (`.fst`, for viewers like GTKWave and Surfer) of what every block did and what every link held.
//!
//! ```text
//! (cycle, Seen) --> values of signals, cycle by cycle --fst-writer--> FILE.fst
//! ```
//! Scopes are the board's: `board`, `cluster0`, `module0`, `icu`... Signals:
//!
//! | scope | signal | bits | what |
//! |---|---|---|---|
//! | board | `cycle` | 48 | the board's clock cycle; time itself is in picoseconds of the board's clock |
//! | board | `command` | 32 | commands begun |
//! | a block | `cause` | 4 | its cause in this cycle, as its number in [`Cause::ALL`]; fill and drain show as starved or idle |
//! | a block | `cause_name` | 88 | the same in ASCII, eleven characters |
//! | a link | `occupancy` | as needed | tokens inside at the start of the cycle |
//! | a link | `depth` | as needed | its entries, constant |
//! | a link | `push`, `pop` | 1 | a token goes in or out in this cycle |
//! | a link | `token` | 28 | payload of the token that went in last |
//!
//! The format has no table of names for codes here, hence the ASCII. Before a block's first
//! cycle its cause is idle, before the window nothing is known.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use fst_writer::{
    FstBodyWriter, FstFileType, FstHeaderWriter, FstInfo, FstScopeType, FstSignalId, FstSignalType,
    FstVarDirection, FstVarType, FstWriteError,
};
use rtl_model::observe::{Places, Seen};
use rtl_model::sim::{Cause, CommandMark, Cycle};

use super::{TraceError, Window};

/// Characters of the longest name of a cause.
const NAME_CHARS: usize = 11;
/// Bytes that the encoder may hold before they go to the file; so few in tests that they go there many times.
const MAX_BUFFER_BYTES: usize = if cfg!(test) { 1 << 13 } else { 1 << 26 };

/// A signal: its handle, its width, its value as it will be written next.
#[derive(Clone, Debug)]
struct Signal {
    id: FstSignalId,
    bits: u32,
    value: u64,
    is_dirty: bool,
}

/// Numbers of a link's signals in `Wave::signals`; `depth` stands after `occupancy`.
#[derive(Clone, Copy, Debug)]
struct LinkSignals {
    occupancy: usize,
    push: usize,
    pop: usize,
    token: usize,
}

/// A scope of the hierarchy while it is laid out.
#[derive(Default)]
struct Scope {
    scopes: BTreeMap<String, Scope>,
    block: Option<usize>,
    link: Option<usize>,
}

/// Writes a waveform.
pub struct Wave<W: Write + Seek> {
    body: FstBodyWriter<W>,
    window: Window,
    force: bool,
    ps_per_cycle: f64,
    signals: Vec<Signal>,
    dirty: Vec<usize>,
    /// By block: its `cause`.
    causes: Vec<usize>,
    links: Vec<LinkSignals>,
    /// By block: the ASCII twin of `cause`.
    names: Vec<FstSignalId>,
    /// By signal: the block whose cause it is.
    block_of: Vec<Option<usize>>,
    /// What the next cycle begins with: changes of occupancy, and pulses that end.
    deferred: Vec<(usize, i8)>,
    pulses: Vec<usize>,
    now: Cycle,
    has_begun: bool,
}

const CYCLE: usize = 0;
const COMMAND: usize = 1;

impl<W: Write + Seek> Wave<W> {
    /// Begins a waveform of a board called `board` with a clock of `clock_mhz`.
    ///
    /// # Errors
    /// When nothing can be written.
    pub fn new(
        out: W,
        places: &Places,
        board: &str,
        clock_mhz: f64,
        window: Window,
        force: bool,
    ) -> Result<Wave<W>, TraceError> {
        let info = FstInfo {
            start_time: 0,
            timescale_exponent: -12,
            // The format's fields have fixed lengths; nothing here depends on when it is written.
            version: concat!("radeng ", env!("CARGO_PKG_VERSION")).to_owned(),
            date: String::new(),
            file_type: FstFileType::Verilog,
        };
        let mut layout = Layout {
            header: FstHeaderWriter::new(out, &info).map_err(fault)?,
            signals: Vec::new(),
            block_of: Vec::new(),
            names: vec![None; places.blocks.len()],
            causes: vec![0; places.blocks.len()],
            links: vec![LinkSignals { occupancy: 0, push: 0, pop: 0, token: 0 }; places.links.len()],
        };
        let mut root = Scope::default();
        for (number, block) in places.blocks.iter().enumerate() {
            root.at(&block.name).block = Some(number);
        }
        for (number, link) in places.links.iter().enumerate() {
            root.at(&link.name).link = Some(number);
        }
        let codes = Cause::ALL.iter().map(|cause| format!("{} {}", *cause as u8, cause.name()));
        let codes = codes.collect::<Vec<_>>().join(", ");
        let component = format!("{board}; causes: {codes}");
        layout.header.scope("board", component, FstScopeType::Module).map_err(fault)?;
        layout.signal("cycle", 48, 0, FstVarType::Integer)?;
        layout.signal("command", 32, 0, FstVarType::Integer)?;
        layout.scopes(&root, places)?;
        layout.header.up_scope().map_err(fault)?;
        let Layout { header, signals, block_of, names, causes, links } = layout;
        Ok(Wave {
            body: header.finish().map_err(fault)?,
            window,
            force,
            ps_per_cycle: 1e6 / clock_mhz,
            signals,
            dirty: Vec::new(),
            causes,
            links,
            names: names.into_iter().flatten().collect(),
            block_of,
            deferred: Vec::new(),
            pulses: Vec::new(),
            now: 0,
            has_begun: false,
        })
    }

    /// Takes what a decoder saw.
    ///
    /// # Errors
    /// When the window is too long or nothing can be written.
    pub fn see(&mut self, now: Cycle, seen: &Seen) -> Result<(), TraceError> {
        if now > self.now {
            self.window.check_run(self.force, now)?;
            self.advance(now)?;
        }
        match *seen {
            Seen::Activity { block, cause } => self.set(self.causes[usize::from(block)], cause as u64),
            Seen::Push { link, payload } => {
                let link = self.links[usize::from(link)];
                self.set(link.push, 1);
                self.set(link.token, u64::from(payload));
                self.pulses.push(link.push);
                self.deferred.push((link.occupancy, 1));
            }
            Seen::Pop { link, .. } => {
                let link = self.links[usize::from(link)];
                self.set(link.pop, 1);
                self.pulses.push(link.pop);
                self.deferred.push((link.occupancy, -1));
            }
            Seen::Command(CommandMark::Nearest | CommandMark::Any) => {
                self.set(COMMAND, self.signals[COMMAND].value + 1);
            }
            Seen::Command(_) | Seen::Rays { .. } | Seen::Bundle { .. } => {}
        }
        Ok(())
    }

    /// Ends the waveform of a run of `n_cycles`.
    ///
    /// # Errors
    /// When the window begins after it, or nothing can be written.
    pub fn finish(mut self, n_cycles: Cycle) -> Result<W, TraceError> {
        self.window.check_end(n_cycles)?;
        self.advance(n_cycles.max(self.now + 1))?;
        let end = n_cycles.min(self.window.end(self.force));
        self.body.time_change(self.time(end)).map_err(fault)?;
        self.body.finish().map_err(fault)
    }

    fn set(&mut self, signal: usize, value: u64) {
        let place = &mut self.signals[signal];
        if place.value != value {
            place.value = value;
            if !place.is_dirty {
                place.is_dirty = true;
                self.dirty.push(signal);
            }
        }
    }

    fn time(&self, cycle: Cycle) -> u64 {
        (cycle as f64 * self.ps_per_cycle).round() as u64
    }

    /// Ends cycle `self.now` and goes on to `now`.
    fn advance(&mut self, now: Cycle) -> Result<(), TraceError> {
        self.write(self.now)?;
        for (occupancy, by) in std::mem::take(&mut self.deferred) {
            let tokens = self.signals[occupancy].value;
            self.set(occupancy, tokens.saturating_add_signed(i64::from(by)));
        }
        for pulse in std::mem::take(&mut self.pulses) {
            self.set(pulse, 0);
        }
        if now > self.now + 1 {
            self.write(self.now + 1)?;
        }
        if !self.has_begun && now > self.window.from {
            self.begin()?;
        }
        self.now = now;
        Ok(())
    }

    /// Writes the signals that have changed, as of `cycle`.
    fn write(&mut self, cycle: Cycle) -> Result<(), TraceError> {
        if cycle < self.window.from || cycle >= self.window.end(self.force) {
            return Ok(());
        }
        if !self.has_begun {
            return self.begin();
        }
        if self.dirty.is_empty() {
            return Ok(());
        }
        self.body.time_change(self.time(cycle)).map_err(fault)?;
        self.set(CYCLE, cycle);
        for signal in std::mem::take(&mut self.dirty) {
            self.put(signal)?;
        }
        if self.body.size() > MAX_BUFFER_BYTES {
            self.body.flush().map_err(fault)?;
        }
        Ok(())
    }

    /// Writes every signal at the start of the window.
    fn begin(&mut self) -> Result<(), TraceError> {
        self.has_begun = true;
        self.body.time_change(self.time(self.window.from)).map_err(fault)?;
        self.signals[CYCLE].value = self.window.from;
        self.dirty.clear();
        (0..self.signals.len()).try_for_each(|signal| self.put(signal))
    }

    fn put(&mut self, signal: usize) -> Result<(), TraceError> {
        let Signal { id, bits, value, is_dirty } = &mut self.signals[signal];
        *is_dirty = false;
        let mut text = [b'0'; 64];
        let text = &mut text[..*bits as usize];
        for (bit, place) in text.iter_mut().rev().enumerate() {
            *place += (*value >> bit & 1) as u8;
        }
        self.body.signal_change(*id, text).map_err(fault)?;
        if let Some(block) = self.block_of[signal] {
            let name = Cause::ALL.get(*value as usize).map_or("", |cause| cause.name());
            self.body.signal_change(self.names[block], &ascii_bits(name)).map_err(fault)?;
        }
        Ok(())
    }
}

/// A name as bits, its first character in the highest byte, filled up with spaces.
fn ascii_bits(name: &str) -> [u8; 8 * NAME_CHARS] {
    let mut bits = [b'0'; 8 * NAME_CHARS];
    let characters = name.bytes().chain(std::iter::repeat(b' '));
    for (place, character) in bits.chunks_mut(8).zip(characters) {
        for (bit, place) in place.iter_mut().rev().enumerate() {
            *place += character >> bit & 1;
        }
    }
    bits
}

/// The hierarchy while it is written.
struct Layout<W: Write + Seek> {
    header: FstHeaderWriter<W>,
    signals: Vec<Signal>,
    block_of: Vec<Option<usize>>,
    names: Vec<Option<FstSignalId>>,
    causes: Vec<usize>,
    links: Vec<LinkSignals>,
}

impl<W: Write + Seek> Layout<W> {
    fn signal(&mut self, name: &str, bits: u32, value: u64, kind: FstVarType) -> Result<usize, TraceError> {
        let form = FstSignalType::bit_vec(bits);
        let id = self.header.var(name, form, kind, FstVarDirection::Implicit, None).map_err(fault)?;
        self.signals.push(Signal { id, bits, value, is_dirty: false });
        self.block_of.push(None);
        Ok(self.signals.len() - 1)
    }

    fn scopes(&mut self, scope: &Scope, places: &Places) -> Result<(), TraceError> {
        for (name, inner) in &scope.scopes {
            self.header.scope(name, "", FstScopeType::Module).map_err(fault)?;
            if let Some(block) = inner.block {
                let cause = self.signal("cause", 4, Cause::Idle as u64, FstVarType::Reg)?;
                (self.causes[block], self.block_of[cause]) = (cause, Some(block));
                let form = FstSignalType::bit_vec(8 * NAME_CHARS as u32);
                let (kind, direction) = (FstVarType::Reg, FstVarDirection::Implicit);
                let id = self.header.var("cause_name", form, kind, direction, None).map_err(fault)?;
                self.names[block] = Some(id);
            }
            if let Some(link) = inner.link {
                let depth = places.links[link].depth;
                let bits = u32::BITS - depth.leading_zeros();
                let occupancy = self.signal("occupancy", bits, 0, FstVarType::Integer)?;
                self.signal("depth", bits, u64::from(depth), FstVarType::Parameter)?;
                let push = self.signal("push", 1, 0, FstVarType::Wire)?;
                let pop = self.signal("pop", 1, 0, FstVarType::Wire)?;
                let token = self.signal("token", 28, 0, FstVarType::Wire)?;
                self.links[link] = LinkSignals { occupancy, push, pop, token };
            }
            self.scopes(inner, places)?;
            self.header.up_scope().map_err(fault)?;
        }
        Ok(())
    }
}

impl Scope {
    /// The scope of a hierarchical name.
    fn at(&mut self, name: &str) -> &mut Scope {
        name.split('.').fold(self, |scope, part| scope.scopes.entry(part.to_owned()).or_default())
    }
}

fn fault(error: FstWriteError) -> TraceError {
    match error {
        FstWriteError::Io(e) => TraceError::Write(e),
        other => TraceError::Write(std::io::Error::other(other.to_string())),
    }
}

#[cfg(test)]
#[path = "fst_tests.rs"]
mod tests;
