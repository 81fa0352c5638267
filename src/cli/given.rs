//! Which flags stand on the command line, as opposed to those that have their default value.
//!
//! ```text
//! ArgMatches --value_source--> names of the arguments as typed; a flag without use is refused even at its default
//! ```

use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, FromArgMatches};

/// The arguments that were typed. As a flattened field it must come before the others, which take theirs away.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Given {
    ids: Vec<String>,
}

impl Given {
    /// True when the argument of the field `id` was typed.
    pub fn has(&self, id: &str) -> bool {
        self.ids.iter().any(|given| given == id)
    }
}

impl FromArgMatches for Given {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Given, clap::Error> {
        let typed = |id: &&clap::Id| matches.value_source(id.as_str()) == Some(ValueSource::CommandLine);
        Ok(Given { ids: matches.ids().filter(typed).map(ToString::to_string).collect() })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Given::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for Given {
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}
