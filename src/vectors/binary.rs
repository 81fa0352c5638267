//! Vectors as packed records: the file is a row of little-endian 32-bit words, laid out as in the module's header.
//!
//! ```text
//! Vectors --to_binary--> header, patches, rays, tests, CRC --from_binary: header, length, CRC, records--> Vectors
//! ```
//! Nothing is copied or reserved by a count before the length of the file agrees with the counts.

use rtl_model::datapath::{PatchWords, RayWords};
use rtl_model::fixed::Formats;
use rtl_model::packet::{
    PacketError, hit_bytes, pack_hit, pack_patch, pack_ray, patch_bytes, ray_bytes, unpack_hit, unpack_patch,
    unpack_ray,
};

use super::build::{Builder, MAX_GRID_LOG2};
use super::csv_write::ROUNDINGS;
use super::wires::{from_values, n_wires};
use super::{
    Expected, Fault, MAX_PATCHES, MAX_RAYS, MAX_TESTS, Place, RayVector, TestVector, Vectors, VectorsError,
    wire_names, wire_values,
};

/// The first bytes of a file.
pub(super) const MAGIC: &[u8] = b"RVEC";
/// Version of the layout.
const VERSION: u32 = 1;
/// K of formats that keep all bits.
const KEEP_ALL: u32 = u32::MAX;
/// Words of the header.
const HEADER_WORDS: usize = 11;
/// Words of a wire.
const WIRE_WORDS: usize = 4;

/// The file's bytes.
pub fn to_binary(vectors: &Vectors) -> Vec<u8> {
    let f = &vectors.formats;
    let rounding = ROUNDINGS.iter().position(|(_, mode)| *mode == f.rounding).unwrap_or(0);
    let mut words = vec![
        u32::from_le_bytes([MAGIC[0], MAGIC[1], MAGIC[2], MAGIC[3]]),
        VERSION,
        f.coord_frac_bits,
        f.dir_frac_bits,
        f.t_frac_bits,
        f.cross_keep_bits.unwrap_or(KEEP_ALL),
        rounding as u32,
        vectors.patches.len() as u32,
        vectors.rays.len() as u32,
        vectors.tests.len() as u32,
        vectors.grid_log2.unwrap_or(0),
    ];
    for patch in &vectors.patches {
        words.extend(pack_patch(f, patch));
    }
    for (i, ray) in vectors.rays.iter().enumerate() {
        words.extend(ray_words(f, i, ray));
    }
    for test in &vectors.tests {
        words.extend([test.ray as u32, test.patch as u32]);
        words.extend(pack_hit(f, test.hit));
        for value in wire_values(&test.wires) {
            words.extend((0..WIRE_WORDS).map(|i| (value >> (32 * i)) as u32));
        }
    }
    let mut bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let crc = crc32fast::hash(&bytes);
    bytes.extend(crc.to_le_bytes());
    bytes
}

fn ray_words(f: &Formats, i: usize, ray: &RayVector) -> Vec<u32> {
    let mut words = pack_ray(f, &ray.words, (i & 0x7fff) as u16);
    let (hit, bit) = match ray.expected {
        Some(Expected::Nearest(hit)) => (hit, false),
        Some(Expected::Any(bit)) => (None, bit),
        None => (None, false),
    };
    words.push(u32::from(ray.any_hit) | u32::from(ray.expected.is_some()) << 1 | u32::from(bit) << 2);
    words.extend(pack_hit(f, hit));
    words
}

/// Vectors from a file's bytes. Header and length are checked before any record is read, then the CRC.
///
/// # Errors
/// The first fault with the byte at which its record starts.
pub fn from_binary(bytes: &[u8]) -> Result<Vectors, VectorsError> {
    let fault = |byte: usize, field: &str, value: String, expected: String| {
        Fault::new(field, value, expected).at(Place::Byte(byte as u64))
    };
    if bytes.is_empty() {
        return Err(fault(0, "the file", "empty".to_owned(), "test vectors".to_owned()));
    }
    let magic = &bytes[..bytes.len().min(MAGIC.len())];
    if magic != MAGIC {
        return Err(fault(0, "the magic", format!("'{}'", magic.escape_ascii()), "RVEC".to_owned()));
    }
    let least = 4 * (HEADER_WORDS + 1);
    if bytes.len() < least || !bytes.len().is_multiple_of(4) {
        let expected = format!("a multiple of 4, at least {least} bytes");
        return Err(fault(bytes.len(), "the length of the file", format!("{} bytes", bytes.len()), expected));
    }
    let (body, last) = bytes.split_at(bytes.len() - 4);
    let mut reader = Reader { body, at: 0 };
    let (mut builder, counts) = header(&mut reader)?;
    check_length(bytes.len() as u64, builder.formats(), counts)
        .map_err(|fault| fault.at(Place::Byte(bytes.len() as u64)))?;
    let stored = u32::from_le_bytes([last[0], last[1], last[2], last[3]]);
    let crc = crc32fast::hash(body);
    if stored != crc {
        let expected = format!("{crc:#010x}, that of the bytes before it");
        return Err(fault(body.len(), "the CRC", format!("{stored:#010x}"), expected));
    }
    let [n_patches, n_rays, n_tests] = counts;
    for _ in 0..n_patches {
        reader.record(|r| patch(r, &mut builder))?;
    }
    for i in 0..n_rays {
        reader.record(|r| ray(r, i as usize, &mut builder))?;
    }
    for _ in 0..n_tests {
        reader.record(|r| test(r, &mut builder))?;
    }
    reader.record(|r| match r.n_words_left() {
        0 => Ok(()),
        more => Err(Fault::new("the end of the records", format!("followed by {more} words"), "the CRC")),
    })?;
    Ok(builder.finish())
}

/// The file is as long as its counts say; a test takes between the wires of a triangle and those of a quad.
fn check_length(n_bytes: u64, f: &Formats, [n_patches, n_rays, n_tests]: [u32; 3]) -> Result<(), Fault> {
    let n_hit = u64::from(hit_bytes(f));
    let frame = 4 * (HEADER_WORDS as u64 + 1);
    let patches = u64::from(n_patches) * u64::from(patch_bytes(f));
    let rays = u64::from(n_rays) * (u64::from(ray_bytes(f)) + 4 + n_hit);
    let [least, most] = [true, false].map(|is_triangle| {
        let wires = 4 * (WIRE_WORDS * n_wires(is_triangle)) as u64;
        frame + patches + rays + u64::from(n_tests) * (8 + n_hit + wires)
    });
    if (least..=most).contains(&n_bytes) {
        return Ok(());
    }
    let range = if least == most { least.to_string() } else { format!("{least} to {most}") };
    let expected = format!("{range} bytes for {n_patches} patches, {n_rays} rays, {n_tests} tests");
    Err(Fault::new("the length of the file", format!("{n_bytes} bytes"), expected))
}

/// The bytes of a file without its CRC, read one record after the other.
struct Reader<'a> {
    body: &'a [u8],
    /// Bytes read.
    at: usize,
}

impl Reader<'_> {
    /// Reads a record; a fault gets the byte at which it starts.
    fn record<T>(&mut self, read: impl FnOnce(&mut Self) -> Result<T, Fault>) -> Result<T, VectorsError> {
        let byte = self.at as u64;
        read(self).map_err(|fault| fault.at(Place::Byte(byte)))
    }

    fn n_words_left(&self) -> usize {
        (self.body.len() - self.at) / 4
    }

    fn take(&mut self, record: &str, n: usize) -> Result<Vec<u32>, Fault> {
        let left = self.n_words_left();
        if left < n {
            let value = format!("cut off after {left} of its words");
            return Err(Fault::new(format!("the {record}"), value, format!("{n} words")));
        }
        let bytes = &self.body[self.at..][..4 * n];
        self.at += 4 * n;
        Ok(bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
    }
}

/// The formats, and the numbers of patches, rays and tests.
fn header(reader: &mut Reader<'_>) -> Result<(Builder, [u32; 3]), VectorsError> {
    let mut word = |field: &'static str, least: u32, most: u32| {
        reader.record(|r| {
            let value = r.take("header", 1)?[0];
            if (least..=most).contains(&value) {
                return Ok(value);
            }
            let expected = if least == most { most.to_string() } else { format!("{least} to {most}") };
            Err(Fault::new(field, value, expected))
        })
    };
    // The magic was compared before.
    word("the magic", 0, u32::MAX)?;
    word("the version", VERSION, VERSION)?;
    let formats_byte = 8;
    let any = u32::MAX;
    let coord_frac_bits = word("coord_frac_bits", 0, any)?;
    let dir_frac_bits = word("dir_frac_bits", 0, any)?;
    let t_frac_bits = word("t_frac_bits", 0, any)?;
    let keep = word("cross_keep_bits", 0, any)?;
    let rounding = ROUNDINGS[word("the rounding", 0, ROUNDINGS.len() as u32 - 1)? as usize].1;
    let counts = [
        word("the number of patches", 0, MAX_PATCHES as u32)?,
        word("the number of rays", 0, MAX_RAYS as u32)?,
        word("the number of tests", 0, MAX_TESTS as u32)?,
    ];
    let grid = word("the grid", 0, MAX_GRID_LOG2)?;
    let cross_keep_bits = if keep == KEEP_ALL { None } else { Some(keep) };
    let formats = Formats { coord_frac_bits, dir_frac_bits, t_frac_bits, cross_keep_bits, rounding };
    let with_grid = Builder::new(formats).and_then(|mut builder| {
        if grid > 0 {
            builder.grid(grid)?;
        }
        Ok(builder)
    });
    Ok((with_grid.map_err(|fault| fault.at(Place::Byte(formats_byte)))?, counts))
}

fn short(error: PacketError) -> Fault {
    Fault::new("a record", error, "a whole one")
}

/// Padding and unused fields are zeros: what was read packs to the same words.
fn same_words(record: &str, read: &[u32], packed: &[u32]) -> Result<(), Fault> {
    if read == packed {
        return Ok(());
    }
    Err(Fault::new(format!("a bit of the {record} outside its fields"), 1, "0"))
}

fn patch(reader: &mut Reader<'_>, builder: &mut Builder) -> Result<(), Fault> {
    let formats = *builder.formats();
    let words = reader.take("patch record", patch_bytes(&formats) as usize / 4)?;
    let patch: PatchWords = unpack_patch(&formats, &words).map_err(short)?;
    same_words("patch record", &words, &pack_patch(&formats, &patch))?;
    builder.patch(patch)
}

fn ray(reader: &mut Reader<'_>, i: usize, builder: &mut Builder) -> Result<(), Fault> {
    let formats = *builder.formats();
    let n_ray = ray_bytes(&formats) as usize / 4;
    let words = reader.take("ray record", n_ray + 1 + hit_bytes(&formats) as usize / 4)?;
    let (ray_words_read, _): (RayWords, u16) = unpack_ray(&formats, &words).map_err(short)?;
    let control = words[n_ray];
    if control > 7 {
        return Err(Fault::new("the ray's control word", control, "0 to 7"));
    }
    let any_hit = control & 1 != 0;
    let hit = unpack_hit(&formats, &words[n_ray + 1..]).map_err(short)?;
    let expected = (control & 2 != 0).then_some(match any_hit {
        true => Expected::Any(control & 4 != 0),
        false => Expected::Nearest(hit),
    });
    let ray = RayVector { words: ray_words_read, any_hit, expected };
    same_words("ray record", &words, &ray_words(&formats, i, &ray))?;
    builder.ray(ray)
}

fn test(reader: &mut Reader<'_>, builder: &mut Builder) -> Result<(), Fault> {
    let formats = *builder.formats();
    let n_hit = hit_bytes(&formats) as usize / 4;
    let places = reader.take("test record", 2 + n_hit)?;
    let (ray, patch) = (places[0] as usize, places[1] as usize);
    let hit = unpack_hit(&formats, &places[2..]).map_err(short)?;
    same_words("test's hit record", &places[2..], &pack_hit(&formats, hit))?;
    let Some(is_triangle) = builder.patches().get(patch).map(|p| p.is_triangle) else {
        let expected = format!("the number of a patch, of which there are {}", builder.patches().len());
        return Err(Fault::new("the test's patch", patch, expected));
    };
    if let Some(hit) = hit.filter(|hit| hit.patch != builder.patches()[patch].id) {
        let expected = format!("{}, that of the test's patch", builder.patches()[patch].id);
        return Err(Fault::new("the id in the test's hit", hit.patch, expected));
    }
    let words = reader.take("test record", WIRE_WORDS * n_wires(is_triangle))?;
    let value =
        |w: &[u32]| w.iter().rev().fold(0_u128, |high, word| high << 32 | u128::from(*word)).cast_signed();
    let values: Vec<i128> = words.chunks_exact(WIRE_WORDS).map(value).collect();
    let wires = from_values(is_triangle, &values).map_err(|(i, expected)| {
        let names = wire_names(is_triangle);
        let name = names.get(i).map_or("the wires", String::as_str);
        Fault::new(name, values.get(i).copied().unwrap_or(0), expected)
    })?;
    builder.test(TestVector { ray, patch, hit, wires })
}
