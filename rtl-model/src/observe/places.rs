//! What a directory's names mean: the kind of each block, its cluster, and the two blocks at the ends of each link.
//!
//! ```text
//! "cluster0.module1.icu" -> Icu of cluster 0        "cluster0.module1.jobs" -> from its patch_loader to its icu
//! ```
//! The board's links are fixed, so their ends follow from their names; shells and grid differ in who stands before and
//! after a CTU.

use std::collections::HashMap;

use super::StreamError;
use crate::sim::Directory;

/// Kinds of blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Bus and DMA.
    HostLink,
    /// Deals out bundles.
    Dispatcher,
    /// Expands bundles.
    BundleGenerator,
    /// Takes bundles through shells.
    ShellTracker,
    /// Steps rays.
    Ctu,
    /// Fetches lists and records.
    PatchLoader,
    /// Tests.
    Icu,
    /// Keeps the nearest hits.
    Reducer,
    /// Sends results on.
    ResultMerge,
    /// A cluster's memory.
    ClusterBuffer,
    /// The board's memory.
    Dram,
}

impl Kind {
    /// Every kind, in the order in which rays meet them.
    pub const ALL: [Kind; 11] = [
        Kind::HostLink,
        Kind::Dispatcher,
        Kind::BundleGenerator,
        Kind::ShellTracker,
        Kind::Ctu,
        Kind::PatchLoader,
        Kind::Icu,
        Kind::Reducer,
        Kind::ResultMerge,
        Kind::ClusterBuffer,
        Kind::Dram,
    ];

    /// The name in directories and reports.
    pub fn name(self) -> &'static str {
        match self {
            Kind::HostLink => "host_link",
            Kind::Dispatcher => "dispatcher",
            Kind::BundleGenerator => "bundle_generator",
            Kind::ShellTracker => "shell_tracker",
            Kind::Ctu => "ctu",
            Kind::PatchLoader => "patch_loader",
            Kind::Icu => "icu",
            Kind::Reducer => "reducer",
            Kind::ResultMerge => "result_merge",
            Kind::ClusterBuffer => "cluster_buffer",
            Kind::Dram => "dram",
        }
    }

    /// The kind of a block of this name.
    fn of(name: &str) -> Option<Kind> {
        let last = name.rsplit('.').next().unwrap_or(name);
        let last = last.trim_end_matches(|c: char| c.is_ascii_digit());
        Kind::ALL.into_iter().find(|kind| kind.name() == last)
    }
}

/// A block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockPlace {
    /// Hierarchical name.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Its cluster; none for what the clusters share.
    pub cluster: Option<u8>,
}

/// A link.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkPlace {
    /// Hierarchical name.
    pub name: String,
    /// Entries.
    pub depth: u32,
    /// The block that pushes.
    pub from: u16,
    /// The block that pops.
    pub to: u16,
}

/// Blocks and links by the numbers that events carry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Places {
    /// Blocks.
    pub blocks: Vec<BlockPlace>,
    /// Links.
    pub links: Vec<LinkPlace>,
    /// By block: the links that it pushes into, in the order of their numbers.
    pub outputs: Vec<Vec<u16>>,
    /// Clusters.
    pub n_clusters: usize,
}

/// Most clusters of a board.
const MAX_CLUSTERS: u8 = 16;

impl Places {
    /// The places of a directory.
    ///
    /// # Errors
    /// [`StreamError::Directory`]: a name that no board's block or link has, or one twice.
    pub fn new(directory: &Directory) -> Result<Places, StreamError> {
        let fault = |what: String| StreamError::Directory(what);
        let limit = 1 << 12;
        if directory.blocks.len() > limit || directory.links.len() > limit {
            return Err(fault(format!("more than {limit} blocks or links")));
        }
        let (mut blocks, mut numbers) = (Vec::new(), HashMap::new());
        for (number, name) in (0..).zip(&directory.blocks) {
            let kind = Kind::of(name).ok_or_else(|| fault(format!("'{name}' is no block of a board")))?;
            let cluster = cluster_of(name);
            let shared = matches!(kind, Kind::HostLink | Kind::Dispatcher | Kind::Dram);
            if cluster.is_none() != shared {
                return Err(fault(format!("block '{name}' is not where such blocks are")));
            }
            if numbers.insert(name.as_str(), number).is_some() {
                return Err(fault(format!("two blocks are called '{name}'")));
            }
            blocks.push(BlockPlace { name: name.clone(), kind, cluster });
        }
        let mut links = Vec::new();
        let mut outputs = vec![Vec::new(); blocks.len()];
        for (number, (name, depth)) in (0..).zip(&directory.links) {
            let ends = ends_of(name, |block| numbers.get(block).copied());
            let (from, to) = ends.ok_or_else(|| fault(format!("'{name}' is no link of a board")))?;
            if *depth == 0 {
                return Err(fault(format!("link '{name}' has no entries")));
            }
            outputs[usize::from(from)].push(number);
            links.push(LinkPlace { name: name.clone(), depth: *depth, from, to });
        }
        let n_clusters = blocks.iter().filter_map(|b| b.cluster).max().map_or(0, |c| usize::from(c) + 1);
        Ok(Places { blocks, links, outputs, n_clusters })
    }
}

/// `cluster3.module0.icu` -> 3.
fn cluster_of(name: &str) -> Option<u8> {
    let first = name.split('.').next()?.strip_prefix("cluster")?;
    first.parse().ok().filter(|c| *c < MAX_CLUSTERS)
}

/// Who pushes into a link, and who pops.
fn ends_of(name: &str, block: impl Fn(&str) -> Option<u16>) -> Option<(u16, u16)> {
    if name == "fetches" {
        return Some((block("dispatcher")?, block("host_link")?));
    }
    let (scope, link) = name.rsplit_once('.')?;
    let cluster = name.split('.').next()?;
    let within = |part: &str| block(&format!("{scope}.{part}"));
    let of_cluster = |part: &str| block(&format!("{cluster}.{part}"));
    // Rays go to a CTU (grid), or to the module's tracker (shells).
    let walker = || block(scope).or_else(|| within("shell_tracker"));
    match link {
        "commands" => Some((block("host_link")?, within("bundle_generator")?)),
        "results" => Some((within("result_merge")?, block("host_link")?)),
        "estimates" => Some((within("result_merge")?, block("dispatcher")?)),
        "dram_requests" => Some((within("cluster_buffer")?, block("dram")?)),
        "dram_responses" => Some((block("dram")?, within("cluster_buffer")?)),
        "rays" => Some((of_cluster("bundle_generator")?, walker()?)),
        "ends" => Some((walker()?, of_cluster("result_merge")?)),
        "entries" => Some((within("shell_tracker")?, within("patch_loader")?)),
        "jobs" => Some((within("patch_loader")?, within("icu")?)),
        "test_results" => Some((within("icu")?, within("reducer")?)),
        "list_misses" | "patch_misses" | "mask_misses" => {
            Some((within("patch_loader")?, of_cluster("cluster_buffer")?))
        }
        _ => {
            if let Some(ctu) = link.strip_suffix("_requests") {
                return match within("shell_tracker") {
                    Some(tracker) => Some((tracker, within(ctu)?)),
                    None => Some((within(ctu)?, within("patch_loader")?)),
                };
            }
            Some((within(link.strip_suffix("_visits")?)?, within("shell_tracker")?))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Board;
    use crate::memory_image::MemoryImage;
    use crate::spec::{BoardSpec, Partition};

    fn places(partition: Partition) -> Places {
        let spec = BoardSpec { partition, ..BoardSpec::default() };
        let image = MemoryImage::build(&spec.formats, &[], Some(1));
        Places::new(&Board::new(&spec, image).unwrap().directory()).unwrap()
    }

    fn ends(places: &Places, link: &str) -> (String, String) {
        let link = places.links.iter().find(|l| l.name == link).unwrap();
        let name = |block: u16| places.blocks[usize::from(block)].name.clone();
        (name(link.from), name(link.to))
    }

    #[test]
    fn places_of_grid_and_shells_have_the_ends_that_the_blocks_module_draws() {
        let (grid, shells) = (places(Partition::Grid), places(Partition::ShellsStatic));
        let named = |a: &str, b: &str| (a.to_owned(), b.to_owned());
        let (ctu, tracker) = ("cluster1.module0.ctu2", "cluster1.module0.shell_tracker");
        let loader = "cluster1.module0.patch_loader";
        assert_eq!(ends(&grid, "cluster1.module0.ctu2_requests"), named(ctu, loader));
        assert_eq!(ends(&shells, "cluster1.module0.ctu2_requests"), named(tracker, ctu));
        assert_eq!(ends(&shells, "cluster1.module0.ctu2_visits"), named(ctu, tracker));
        assert_eq!(ends(&grid, "cluster1.module0.ctu2.rays"), named("cluster1.bundle_generator", ctu));
        assert_eq!(ends(&shells, "cluster1.module0.rays"), named("cluster1.bundle_generator", tracker));
        assert_eq!(ends(&shells, "cluster1.module0.ends"), named(tracker, "cluster1.result_merge"));
        assert_eq!(ends(&grid, "cluster2.estimates"), named("cluster2.result_merge", "dispatcher"));
        assert!(grid.outputs.iter().flatten().count() == grid.links.len());
        assert_eq!(shells.n_clusters, 4);
    }

    #[test]
    fn places_of_foreign_names_are_refused_by_name() {
        let directory = |blocks: &[&str], links: &[(&str, u32)]| Directory {
            blocks: blocks.iter().map(|b| (*b).to_owned()).collect(),
            links: links.iter().map(|(l, d)| ((*l).to_owned(), *d)).collect(),
        };
        for (blocks, links, expected) in [
            (&["host_link", "gpu"][..], &[][..], "'gpu' is no block"),
            (&["cluster99.icu"], &[], "'cluster99.icu' is not where"),
            (&["dram", "dram"], &[], "two blocks are called 'dram'"),
            (&["dispatcher", "host_link"], &[("pipe", 2)], "'pipe' is no link"),
            (&["dispatcher", "host_link"], &[("fetches", 0)], "'fetches' has no entries"),
        ] {
            let e = Places::new(&directory(blocks, links)).unwrap_err().to_string();
            assert!(e.contains(expected), "{e}");
        }
    }
}
