//! What a record depends on, and hashes of what is too large to keep.
//!
//! ```text
//! BoardSpec, MemoryImage --> RecordKey --other key--> the first difference, both values       Work --> hash
//! ```
//! Of a board only what changes answers is in the key. Source of the hash: FNV-1a, 64 bits, over 32-bit words: a guard
//! against mistakes, not against malice.

use serde::{Deserialize, Serialize};

use crate::board::Work;
use crate::fixed::Formats;
use crate::memory_image::MemoryImage;
use crate::packet::{BundlePacket, pack_bundle, pack_ray};
use crate::spec::{BoardSpec, DramSpec, Partition, ShellSpec};

/// Everything that the answers to a given command depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordKey {
    /// Number formats.
    pub formats: Formats,
    /// 2^g cells a side.
    pub grid_log2: u32,
    /// Partition.
    pub partition: Partition,
    /// Shells, without their prefetching, which changes no answer; the default in grid partition.
    pub shells: ShellSpec,
    /// With partition `shells+static`: bundles for each ray of the low-resolution cast, and the fewest that have one.
    pub low_resolution: Option<(u32, u32)>,
    /// Patches.
    pub n_patches: u32,
    /// Hash of the memory image.
    pub image: u64,
}

/// Two keys that are not the same.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyDifference {
    /// What differs.
    pub what: &'static str,
    /// As recorded.
    pub recorded: String,
    /// As asked for.
    pub given: String,
}

/// A part of a key, in words.
type Words<'a> = &'a dyn Fn(&RecordKey) -> String;

impl RecordKey {
    /// The key of a board of `spec` that holds `image`.
    pub fn of(spec: &BoardSpec, image: &MemoryImage) -> RecordKey {
        let dispatch = &spec.dispatch;
        let shells = if spec.partition.is_shells() { spec.shells } else { ShellSpec::default() };
        RecordKey {
            formats: spec.formats,
            grid_log2: image.grid.log2_cells,
            partition: spec.partition,
            shells: ShellSpec { prefetch: false, ..shells },
            low_resolution: (spec.partition == Partition::ShellsStatic)
                .then_some((dispatch.low_resolution_every, dispatch.low_resolution_min_bundles)),
            n_patches: image.n_patches,
            image: hash_image(image),
        }
    }

    /// What differs first from `given`, if anything does; `self` is the record's.
    pub fn difference(&self, given: &RecordKey) -> Option<KeyDifference> {
        let of_grid = |key: &RecordKey| format!("{0} x {0} x {0} cells", 1_u64 << key.grid_log2.min(63));
        let of_shells = |key: &RecordKey| {
            let ShellSpec { cells, growth, entries, .. } = key.shells;
            format!("cells = {cells}, growth = {growth:?}, entries = {entries}").to_lowercase()
        };
        let of_cast = |key: &RecordKey| match key.low_resolution {
            Some((every, min)) => {
                format!("dispatch.low_resolution_every = {every}, low_resolution_min_bundles = {min}")
            }
            None => "none".to_owned(),
        };
        let of_formats = |key: &RecordKey| {
            let Formats { coord_frac_bits, dir_frac_bits, t_frac_bits, cross_keep_bits, rounding } =
                key.formats;
            let keep = cross_keep_bits.map_or("all".to_owned(), |bits| bits.to_string());
            format!(
                "coord {coord_frac_bits}, dir {dir_frac_bits}, t {t_frac_bits} bits, cross_keep_bits {keep}, \
                 {rounding:?}"
            )
        };
        let of_partition = |key: &RecordKey| {
            match key.partition {
                Partition::Grid => "grid",
                Partition::Shells => "shells",
                Partition::ShellsStatic => "shells+static",
            }
            .to_owned()
        };
        let of_image = |key: &RecordKey| format!("{:016x} ({} patches)", key.image, key.n_patches);
        let rows: [(&'static str, Words<'_>); 6] = [
            ("number formats", &of_formats),
            ("grid", &of_grid),
            ("partition", &of_partition),
            ("shells", &of_shells),
            ("low-resolution cast", &of_cast),
            ("scene (hash of the memory image)", &of_image),
        ];
        rows.into_iter().find_map(|(what, of)| {
            let (recorded, given) = (of(self), of(given));
            (recorded != given).then_some(KeyDifference { what, recorded, given })
        })
    }
}

impl BoardSpec {
    /// The default board with all of this one that canonical work depends on, and a patch memory that holds any scene:
    /// boards with equal canonical boards answer alike, and a record of one serves all of them.
    ///
    /// An automatic grid is coarser in a memory that is too small for the wanted one: such a board needs a record of its
    /// own ([`RecordKey`] tells).
    pub fn canonical(&self) -> BoardSpec {
        let default = BoardSpec::default();
        let shells = if self.partition.is_shells() { self.shells } else { default.shells };
        let mut dispatch = default.dispatch;
        if self.partition == Partition::ShellsStatic {
            dispatch.low_resolution_every = self.dispatch.low_resolution_every;
            dispatch.low_resolution_min_bundles = self.dispatch.low_resolution_min_bundles;
        }
        BoardSpec {
            name: "canonical".into(),
            formats: self.formats,
            grid_log2: self.grid_log2,
            partition: self.partition,
            shells: ShellSpec { prefetch: false, ..shells },
            dispatch,
            dram: DramSpec { bytes: 1 << 34, layout: self.dram.layout, ..default.dram },
            ..default
        }
    }
}

struct Fnv(u64);

impl Fnv {
    fn new() -> Fnv {
        Fnv(0xcbf2_9ce4_8422_2325)
    }

    fn words(&mut self, words: &[u32]) {
        for word in words {
            self.0 = (self.0 ^ u64::from(*word)).wrapping_mul(0x100_0000_01b3);
            // The product moves bits up only.
            self.0 ^= self.0 >> 32;
        }
    }
}

fn hash_image(image: &MemoryImage) -> u64 {
    let mut hash = Fnv::new();
    hash.words(&[image.header_base, image.list_base, image.patch_base, image.n_patches]);
    hash.words(&image.words);
    hash.0
}

/// A hash of a command's rays or bundles, as the bus carries them.
pub fn hash_work(formats: &Formats, work: Work<'_>) -> u64 {
    let mut hash = Fnv::new();
    match work {
        Work::Rays(rays) => {
            hash.words(&[0, rays.len() as u32]);
            rays.iter().for_each(|ray| hash.words(&pack_ray(formats, ray, 0)));
        }
        Work::Bundles(bundles) => {
            hash.words(&[1, bundles.len() as u32]);
            for bundle in bundles {
                let packet = BundlePacket { bundle: bundle.clone(), any_hit: false, tag: 0 };
                hash.words(&pack_bundle(formats, &packet));
            }
        }
    }
    hash.0
}
