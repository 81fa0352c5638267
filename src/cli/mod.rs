//! The command line: as typed (`args.rs`), as meant (`plan.rs`), one file per subcommand.
