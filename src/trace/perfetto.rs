//! Slices for Perfetto (ui.perfetto.dev) or `chrome://tracing`: JSON in the trace event format.
//!
//! ```text
//! (cycle, Seen) --> commands, bundles in slots, stalls of blocks; lives of chosen rays --> {"traceEvents": [...]}
//! ```
//! `ts` and `dur` are microseconds of the board's clock, to a picosecond; `args` hold the exact cycles `from..to`. Processes
//! are the board's clusters, what they share, and the chosen rays; threads are the bundle slots and blocks of a cluster, and
//! a ray each. A slice of a ray is its life, within it one a phase. Work and having nothing to do are no stalls and leave
//! gaps. Slices are clipped to the window.

use std::collections::HashMap;
use std::io::Write;

use rtl_model::observe::{Kind, Places, RayLife, Seen};
use rtl_model::sim::{Cause, CommandMark, Cycle, Phase};

use super::{TraceError, Window};

/// Most slices, unless it is forced.
pub const MAX_SLICES: u64 = 1_000_000;

/// Process of what the clusters share; cluster c is process c + 2.
const SHARED: u32 = 1;
/// Process of the chosen rays.
const RAYS: u32 = 100;
/// Thread of commands.
const COMMANDS: u32 = 1;
/// Threads of bundle slots begin here; those of blocks at `BLOCKS`.
const SLOTS: u32 = 100;
const BLOCKS: u32 = 1000;

/// Something that has begun.
#[derive(Clone, Debug)]
struct Open {
    since: Cycle,
    name: String,
    args: String,
}

/// Writes slices.
pub struct Slices<W: Write> {
    out: W,
    window: Window,
    force: bool,
    ps_per_cycle: f64,
    /// By block: kind, process.
    blocks: Vec<(Kind, u32)>,
    stalls: Vec<Option<(Cycle, Cause)>>,
    /// By process and slot.
    bundles: HashMap<(u32, u8), Open>,
    command: Option<Open>,
    n_commands: u64,
    in_cast: bool,
    n_slices: u64,
    is_first: bool,
}

impl<W: Write> Slices<W> {
    /// Begins the slices of a board called `board` with a clock of `clock_mhz`.
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
    ) -> Result<Slices<W>, TraceError> {
        let process = |cluster: Option<u8>| cluster.map_or(SHARED, |c| u32::from(c) + 2);
        let mut slices = Slices {
            out,
            window,
            force,
            ps_per_cycle: 1e6 / clock_mhz,
            blocks: places.blocks.iter().map(|b| (b.kind, process(b.cluster))).collect(),
            stalls: vec![None; places.blocks.len()],
            bundles: HashMap::new(),
            command: None,
            n_commands: 0,
            in_cast: false,
            n_slices: 0,
            is_first: true,
        };
        write!(
            slices.out,
            "{{\"displayTimeUnit\":\"ns\",\"otherData\":{{\"board\":{},\"clock_mhz\":{},\"ts\":\"microseconds of the \
             board's clock\"}},\n\"traceEvents\":[",
            json(board),
            json(&clock_mhz)
        )?;
        slices.name("process_name", SHARED, 0, &format!("board {board}"))?;
        slices.name("thread_name", SHARED, COMMANDS, "commands")?;
        for cluster in 0..places.n_clusters as u32 {
            slices.name("process_name", cluster + 2, 0, &format!("cluster{cluster}"))?;
            for slot in 0..16 {
                slices.name("thread_name", cluster + 2, SLOTS + slot, &format!("slot {slot}"))?;
            }
        }
        for (number, block) in (0..).zip(&places.blocks) {
            slices.name("thread_name", process(block.cluster), BLOCKS + number, &block.name)?;
        }
        Ok(slices)
    }

    /// Takes what a decoder saw.
    ///
    /// # Errors
    /// When there are too many slices, the window is too long or nothing can be written.
    pub fn see(&mut self, now: Cycle, seen: &Seen) -> Result<(), TraceError> {
        match *seen {
            Seen::Activity { block, cause } => {
                self.window.check_run(self.force, now)?;
                self.end_stall(usize::from(block), now)?;
                self.stalls[usize::from(block)] = is_stall(cause).then_some((now, cause));
            }
            Seen::Bundle { block, slot, job, first_ray } => {
                let process = self.blocks[usize::from(block)].1;
                let what = if self.in_cast { "cast" } else { "bundle" };
                let open = Open {
                    since: now,
                    name: format!("{what} {job}"),
                    args: format!(
                        ",\"command\":{},\"first_ray\":{first_ray}",
                        self.n_commands.saturating_sub(1)
                    ),
                };
                self.bundles.insert((process, slot), open);
            }
            Seen::Rays { block, slot, from: Phase::Returning, to: Phase::Away, .. } => {
                let process = self.blocks[usize::from(block)].1;
                if let Some(open) = self.bundles.remove(&(process, slot)) {
                    self.slice(process, SLOTS + u32::from(slot), &open.name, open.since, now, &open.args)?;
                }
            }
            Seen::Command(mark) => self.mark(now, mark)?,
            Seen::Push { .. } | Seen::Pop { .. } | Seen::Rays { .. } => {}
        }
        Ok(())
    }

    fn mark(&mut self, now: Cycle, mark: CommandMark) -> Result<(), TraceError> {
        match mark {
            CommandMark::Nearest | CommandMark::Any => {
                let what = if mark == CommandMark::Any { "any hit" } else { "nearest hit" };
                let name = format!("command {}, {what}", self.n_commands);
                self.command = Some(Open { since: now, name, args: String::new() });
                self.n_commands += 1;
            }
            CommandMark::LowResolution => self.in_cast = true,
            CommandMark::Bundles => self.in_cast = false,
            CommandMark::End => {
                for block in 0..self.stalls.len() {
                    self.end_stall(block, now)?;
                    self.stalls[block] = None;
                }
                if let Some(open) = self.command.take() {
                    self.slice(SHARED, COMMANDS, &open.name, open.since, now, &open.args)?;
                }
            }
        }
        Ok(())
    }

    fn end_stall(&mut self, block: usize, now: Cycle) -> Result<(), TraceError> {
        let Some((since, cause)) = self.stalls[block] else { return Ok(()) };
        let (process, thread) = (self.blocks[block].1, BLOCKS + block as u32);
        self.slice(process, thread, cause.name(), since, now, "")
    }

    /// Ends the slices of a run of `n_cycles` with the lives of the chosen rays.
    ///
    /// # Errors
    /// As [`Slices::see`]; when the window begins after the run.
    pub fn finish(mut self, n_cycles: Cycle, lives: &[RayLife]) -> Result<W, TraceError> {
        self.window.check_end(n_cycles)?;
        if !lives.is_empty() {
            self.name("process_name", RAYS, 0, "rays")?;
        }
        for (thread, life) in (1..).zip(lives) {
            let name = format!("ray {} of command {}", life.ray, life.command);
            self.name("thread_name", RAYS, thread, &name)?;
            let died = life.died.unwrap_or(n_cycles);
            let args = format!(
                ",\"bundle\":{},\"index\":{},\"cluster\":{},\"slot\":{}",
                life.bundle, life.index, life.cluster, life.slot
            );
            self.slice(RAYS, thread, &name, life.born, died, &args)?;
            let ends = life.spans.iter().skip(1).map(|(cycle, _)| *cycle).chain([died]);
            for ((since, phase), end) in life.spans.iter().zip(ends) {
                self.slice(RAYS, thread, phase.name(), *since, end, "")?;
            }
        }
        writeln!(self.out, "\n]}}")?;
        Ok(self.out)
    }

    /// A complete event, clipped to the window.
    fn slice(
        &mut self,
        process: u32,
        thread: u32,
        name: &str,
        since: Cycle,
        end: Cycle,
        args: &str,
    ) -> Result<(), TraceError> {
        let (from, to) = (since.max(self.window.from), end.min(self.window.end(self.force)));
        if from >= to {
            return Ok(());
        }
        self.n_slices += 1;
        if self.n_slices > MAX_SLICES && !self.force {
            return Err(TraceError::Window(format!(
                "over {MAX_SLICES} slices by cycle {end}: expected a shorter --window FROM..TO, or --force"
            )));
        }
        let (ts, until) = (self.ps(from), self.ps(to));
        self.comma()?;
        write!(
            self.out,
            "{{\"ph\":\"X\",\"name\":{},\"pid\":{process},\"tid\":{thread},\"ts\":{},\"dur\":{},\"args\":{{\"from\":{since},\
             \"to\":{end}{args}}}}}",
            json(name),
            microseconds(ts),
            microseconds(until - ts)
        )?;
        Ok(())
    }

    /// Names a process or thread.
    fn name(&mut self, what: &str, process: u32, thread: u32, name: &str) -> Result<(), TraceError> {
        self.comma()?;
        write!(
            self.out,
            "{{\"ph\":\"M\",\"name\":\"{what}\",\"pid\":{process},\"tid\":{thread},\"ts\":0,\"args\":{{\"name\":{}}}}}",
            json(name)
        )?;
        Ok(())
    }

    fn comma(&mut self) -> Result<(), TraceError> {
        let separator = if std::mem::take(&mut self.is_first) { "\n" } else { ",\n" };
        self.out.write_all(separator.as_bytes())?;
        Ok(())
    }

    fn ps(&self, cycle: Cycle) -> u64 {
        (cycle as f64 * self.ps_per_cycle).round() as u64
    }
}

/// The causes for which a block holds something and waits.
fn is_stall(cause: Cause) -> bool {
    use Cause::{Bus, CacheMiss, Memory, OutputFull, Resource};
    matches!(cause, OutputFull | Resource | CacheMiss | Memory | Bus)
}

/// Picoseconds as exact decimal microseconds.
fn microseconds(ps: u64) -> String {
    format!("{}.{:06}", ps / 1_000_000, ps % 1_000_000)
}

/// A value as JSON. (Strings and numbers always are.)
fn json<T: serde::Serialize + ?Sized>(value: &T) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

#[cfg(test)]
#[path = "perfetto_tests.rs"]
mod tests;
