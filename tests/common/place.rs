//! A folder to run `radeng` in, from outside: what it prints, its exit status, the files that it leaves.

use std::path::{Path, PathBuf};

use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;
use tempfile::TempDir;

/// A folder to run in; every file that a command leaves shows here.
pub struct Place {
    dir: TempDir,
}

/// What a command did.
pub struct Run {
    /// Exit status; -1 when a signal ended it.
    pub status: i32,
    /// Its output.
    pub stdout: String,
    /// Its progress, warnings and errors.
    pub stderr: String,
}

impl Place {
    /// An empty folder.
    pub fn new() -> Place {
        Place { dir: tempfile::tempdir().unwrap() }
    }

    /// A file's place in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// A file as JSON.
    pub fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&std::fs::read(self.path(name)).unwrap()).unwrap()
    }

    /// Names of the files in it.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.dir.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// Runs the binary there.
    pub fn run(&self, args: &[&str]) -> Run {
        let output = cargo_bin_cmd!("radeng")
            .current_dir(self.dir.path())
            .env("NO_COLOR", "1")
            .args(args)
            .output()
            .unwrap();
        Run {
            status: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Runs and expects this exit status, and no panic.
    pub fn exits(&self, status: i32, args: &[&str]) -> Run {
        let run = self.run(args);
        assert_eq!(run.status, status, "{args:?}\n{}{}", run.stdout, run.stderr);
        assert!(!run.stderr.contains("panicked"), "{args:?}\n{}", run.stderr);
        run
    }

    /// Runs and expects exit status 2, a message that holds `expected`, and no new file.
    pub fn refused(&self, args: &[&str], expected: &str) {
        let before = self.names();
        let stderr = self.exits(2, args).stderr;
        // The terminal's report may break lines anywhere.
        let message = stderr.split_whitespace().filter(|w| *w != "│").collect::<Vec<_>>().join(" ");
        assert!(message.contains(expected), "{args:?}: expected '{expected}' in\n{stderr}");
        assert_eq!(self.names(), before, "{args:?} left a file");
    }
}

/// A shipped scene's file.
pub fn scene(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.toml");
    path.to_str().unwrap().to_owned()
}
