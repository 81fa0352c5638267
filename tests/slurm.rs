//! A sweep as a job array on a real Slurm of one node: a worker is killed on the way, and the merged results are those of
//! one machine, byte for byte.
//!
//! Skipped, and said so, where Slurm is not installed (Debian: `apt-get install slurm-wlm munge`; `.ci/system-tools`).

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::thread::sleep;
use std::time::{Duration, Instant};

const N_SHARDS: usize = 4;

/// The program, as it was built for this test.
const RADENG: &str = env!("CARGO_BIN_EXE_radeng");

/// 240 boards that differ in timing, on 128 x 128 camera rays.
const SPACE: &str = r#"version = 1
question = "Does a cluster of machines answer as one machine does?"

[axes]
"icu.depth" = { from = 4, to = 22, step = 2 }
"ctu.contexts" = [4, 8, 16]
"patch_cache.bytes" = [1024, 4096]
"dram.row_miss_cycles" = [4, 6, 8, 12]

[[workload]]
scene = "SCENE"
rays = "primary"
width = 128
height = 128

[objectives]
minimise = ["seconds", "area_mm2"]
"#;

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// A Slurm of one node in a folder; it ends with the test, however that ends.
struct OneNode {
    folder: PathBuf,
}

impl OneNode {
    fn script(folder: &Path, what: &str) -> Output {
        let script = project("scripts/slurm/one-node-slurm.sh");
        Command::new(script).arg(what).arg(folder).env("CPUS", "2").output().unwrap()
    }

    fn start(folder: &Path) -> OneNode {
        let started = OneNode::script(folder, "start");
        assert!(started.status.success(), "{}", text(&started));
        OneNode { folder: folder.to_owned() }
    }

    fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", self.folder.join("slurm.conf"));
        command
    }

    /// Jobs that wait or run, as `squeue` lists them.
    fn jobs(&self) -> String {
        text(&self.command("squeue").args(["--noheader", "--array"]).output().unwrap())
    }
}

impl Drop for OneNode {
    fn drop(&mut self) {
        let _ = self.command("scancel").args(["--name=radeng-merge,radeng-shard"]).output();
        OneNode::script(&self.folder, "stop");
    }
}

/// What of Slurm is not here.
fn missing() -> Vec<&'static str> {
    let found = |tool: &&str| {
        let places = std::env::var("PATH").unwrap_or_default() + ":/usr/sbin:/sbin";
        std::env::split_paths(&places).any(|folder| folder.join(tool).is_file())
    };
    ["slurmctld", "slurmd", "munged", "sbatch", "squeue"].into_iter().filter(|t| !found(t)).collect()
}

/// The process whose arguments name all of `words`.
fn process(words: &[&str]) -> Option<u32> {
    std::fs::read_dir("/proc").ok()?.flatten().find_map(|entry| {
        let pid: u32 = entry.file_name().to_str()?.parse().ok()?;
        let arguments = std::fs::read(entry.path().join("cmdline")).ok()?;
        let arguments = String::from_utf8_lossy(&arguments).replace('\0', " ");
        (arguments.starts_with(RADENG) && words.iter().all(|w| arguments.contains(w))).then_some(pid)
    })
}

/// Waits until `what` is there.
fn wait<T>(seconds: u64, what: &str, mut look: impl FnMut() -> Option<T>, then: impl Fn() -> String) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(start.elapsed() < Duration::from_secs(seconds), "no {what} after {seconds} s\n{}", then());
        sleep(Duration::from_millis(20));
    }
}

#[test]
fn sweep_on_slurm_with_a_killed_worker_is_complete_and_equals_that_of_one_machine() {
    let missing = missing();
    if !missing.is_empty() {
        println!("SKIPPED: no Slurm on this machine ({} not found)", missing.join(", "));
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let scene = project("scenes/cornell-box/scene.toml");
    let space = folder.path().join("timing.toml");
    std::fs::write(&space, SPACE.replace("SCENE", scene.to_str().unwrap())).unwrap();
    let space = space.to_str().unwrap();
    let out = folder.path().join("sweep");
    let node = OneNode::start(&folder.path().join("slurm"));

    let script = project("scripts/slurm/explore-array.sh");
    let submitted = node
        .command(script)
        .args([space, "-o", out.to_str().unwrap(), "-n", &N_SHARDS.to_string()])
        .env("RADENG", RADENG)
        .output()
        .unwrap();
    assert!(submitted.status.success(), "{}", text(&submitted));

    // Shard 2 is killed when its store holds some of its 60 points: an empty one has 54 kB of log.
    let log = |name: &str| std::fs::read_to_string(out.join("logs").join(name)).unwrap_or_default();
    let all_logs = || {
        let names = (1..=N_SHARDS).map(|i| format!("shard-{i}.log")).chain(["merge.log".to_owned()]);
        names.map(|name| log(&name)).collect::<String>() + &node.jobs()
    };
    let store_log = out.join("shard-2/sweep.sqlite-wal");
    let holds_points = || std::fs::metadata(&store_log).is_ok_and(|file| file.len() > 100_000).then_some(());
    wait(120, "points in the store of shard 2", holds_points, all_logs);
    let pid = wait(30, "process of shard 2", || process(&["--shard 2/4"]), all_logs);
    let killed = Command::new("kill").args(["-9", &pid.to_string()]).status().unwrap();
    assert!(killed.success());

    wait(600, "merged results", || out.join("merged").exists().then_some(()), all_logs);
    let shard_2 = log("shard-2.log");
    assert!(shard_2.contains("ended with status 137"), "the kill came too late\n{shard_2}");
    assert!(shard_2.contains("start 2"), "{shard_2}");
    assert!(shard_2.contains("found in the store"), "points were run again\n{shard_2}");

    // One machine, no shards.
    let alone = folder.path().join("alone");
    let run = Command::new(RADENG).args(["explore", space, "-o", alone.to_str().unwrap()]).output().unwrap();
    assert!(run.status.success(), "{}", text(&run));
    let results = |folder: &Path| std::fs::read_to_string(folder.join("results.csv")).unwrap();
    let (merged, single) = (results(&out), results(&alone));
    assert_eq!(single.lines().filter(|line| line.contains(",simulated,")).count(), 240);
    assert!(merged == single, "the merged results are not those of one machine");
    for file in ["results.parquet", "page.html"] {
        let [a, b] = [&out, &alone].map(|folder| std::fs::read(folder.join(file)).unwrap());
        assert!(a == b, "{file} differs");
    }

    // A shard that is lost, and one that is there twice.
    let merge = |folders: &[&str], into: &str| {
        let into = folder.path().join(into);
        let shards = folders.iter().map(|name| out.join(name));
        let run = Command::new(RADENG)
            .args(["explore", space, "-o", into.to_str().unwrap(), "--merge"])
            .args(shards)
            .output()
            .unwrap();
        assert!(!into.join("results.csv").exists(), "results of {folders:?}");
        assert_eq!(run.status.code(), Some(2), "{}", text(&run));
        text(&run)
    };
    let lost = merge(&["shard-1", "shard-2", "shard-4"], "lost");
    assert!(lost.contains("missing: 3/4"), "{lost}");
    let copy = Command::new("cp").arg("-r").args([out.join("shard-3"), out.join("copy")]).status().unwrap();
    assert!(copy.success());
    let twice = merge(&["shard-1", "shard-2", "shard-3", "copy", "shard-4"], "twice");
    assert!(twice.contains("shard 3/4") && twice.contains("as well"), "{twice}");
}
