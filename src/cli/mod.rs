//! The command line: as typed (`args.rs`), as meant (`plan.rs`), one file per subcommand.
//!
//! ```text
//! CommandLine --plan.rs: resolved, outputs checked--> Plan --frame.rs--> outcome --> files, then text for stdout
//! ```
//! Commands return what is to be printed; `main.rs` prints it. Only progress bars write to stderr from here.
//! Files are put in place at the very end, together: a command that fails leaves none.

pub mod args;
mod compare;
mod error;
mod experiment;
#[cfg(feature = "explore")]
mod explore;
mod film;
mod generate;
mod given;
mod info;
mod interrupt;
mod look;
pub mod method;
mod plan;
mod probe;
mod progress;
mod rays;
mod recorded;
mod render;
mod simulate;
mod solve;
mod sweep;
mod trace;
mod vectors;
mod vectors_text;
mod verify;

pub use args::{Command, CommandLine};
pub use error::CliError;

/// Of every thread: that of a main thread on Linux, since commands run on one of the pool.
const STACK_BYTES: usize = 8 << 20;

/// What a command has to say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// For stdout.
    pub text: String,
    /// For stderr, one by one.
    pub warnings: Vec<String>,
    /// A check failed: exit status 1.
    pub check_failed: bool,
    /// Stopped by Ctrl-C, with what there was: exit status 130.
    pub stopped: bool,
}

/// Runs a command.
///
/// # Errors
/// A bad input, named: exit status 2.
pub fn run(line: &CommandLine) -> Result<Outcome, CliError> {
    let pool = rayon::ThreadPoolBuilder::new().stack_size(STACK_BYTES);
    match line.threads {
        Some(n) => (pool.num_threads(n as usize).build_global())
            .map_err(|e| CliError::Threads { n, what: e.to_string() })?,
        // A pool that is there already serves as well.
        None => pool.build_global().unwrap_or_default(),
    }
    // On a thread of the pool: a loop that is handed in from outside waits for two switches of threads, and pass 1 of a small
    // scene has 20,000 short ones.
    rayon::scope(|_| command(&line.command))
}

fn command(command: &Command) -> Result<Outcome, CliError> {
    match command {
        Command::Render(args) => render::run(args),
        Command::Solve(args) => solve::run(args),
        Command::Probe(args) => probe::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::Trace(args) => trace::run(args),
        Command::Verify(args) => verify::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Info(args) => info::run(args),
        Command::Generate(args) => generate::run(args),
        Command::Experiment(args) => experiment::run(args),
        #[cfg(feature = "explore")]
        Command::Explore(args) => explore::run(args),
    }
}
