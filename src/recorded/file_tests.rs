use rtl_model::board::{Board, Work};
use rtl_model::datapath::PatchWords;
use rtl_model::datapath::RayWords;
use rtl_model::memory_image::MemoryImage;
use rtl_model::record::RecordKey;
use rtl_model::spec::BoardSpec;

use super::*;
use crate::raycast::Purpose;
use crate::recorded::Setting;

/// A board, its image, and a record of a ray at each of two patches.
fn recorded() -> (BoardSpec, MemoryImage, WorkRecord) {
    let spec = BoardSpec::default();
    let h = 1 << (spec.formats.coord_frac_bits - 1);
    let patch = |id: u32, z: i32| {
        let corners = [[-h, -h, z], [h, -h, z], [h, h, z], [-h, h, z]];
        PatchWords { corners, is_triangle: false, id }
    };
    let image = MemoryImage::build(&spec.formats, &[patch(0, h / 2), patch(1, h)], Some(3));
    let mut board = Board::new(&spec, image.clone()).unwrap();
    let rays: Vec<RayWords> = (0..100)
        .map(|i| RayWords {
            origin: [i * h / 99 - h / 2, 1, 0],
            dir: [0, 0, h],
            t_max: spec.formats.t_limit(),
        })
        .collect();
    let (hits, nearest) = board.record_nearest(Work::Rays(&rays)).unwrap();
    assert!(hits.iter().all(Option::is_some));
    let (_, any) = board.record_any(Work::Rays(&rays[..3])).unwrap();
    let settings = vec![Setting { name: "workload".to_owned(), value: "rays".to_owned() }];
    let key = RecordKey::of(&spec, &image);
    let commands = vec![(Purpose::Primary, nearest), (Purpose::Shadow, any)];
    (spec, image, WorkRecord { settings, key, commands })
}

fn with_crc(mut bytes: Vec<u8>) -> Vec<u8> {
    let crc = crc32fast::hash(&bytes[HEADER_BYTES..]);
    let n = (bytes.len() - HEADER_BYTES) as u64;
    bytes[12..20].copy_from_slice(&n.to_le_bytes());
    bytes[20..24].copy_from_slice(&crc.to_le_bytes());
    bytes
}

#[test]
fn record_encoded_and_decoded_is_the_same_and_replays() {
    let (spec, image, record) = recorded();
    let read = decode(Path::new("a.radtrace"), &to_bytes(&record).unwrap()).unwrap();
    assert_eq!(read, record);
    assert_eq!((read.n_jobs(), read.n_rays()), (3, 103));
    let mut board = Board::new(&spec, image).unwrap();
    for (_, command) in &read.commands {
        command.check(&spec, board.image()).unwrap();
        board.replay(command).unwrap();
    }
    assert_eq!(board.statistics().canonical.hits, 103);
}

#[test]
fn record_file_damaged_in_any_way_is_refused_with_its_own_error() {
    let good = to_bytes(&recorded().2).unwrap();
    let edit = |at: usize, value: u8| {
        let mut bytes = good.clone();
        bytes[at] = value;
        bytes
    };
    let mut longer = good.clone();
    longer.push(0);
    let mut garbage = good.clone();
    garbage[HEADER_BYTES..].fill(0xff);
    let mut left_over = good.clone();
    left_over.extend([0; 3]);
    type Check = fn(&RecordFileError) -> bool;
    let not_ours: Check = |e| matches!(e, RecordFileError::NotARecord { .. });
    let version: Check = |e| matches!(e, RecordFileError::Version { found: 9, .. });
    let length: Check = |e| matches!(e, RecordFileError::Length { .. });
    let checksum: Check = |e| matches!(e, RecordFileError::Checksum { .. });
    let body: Check = |e| matches!(e, RecordFileError::Body { .. });
    let table: Vec<(&str, Vec<u8>, Check)> = vec![
        ("empty", Vec::new(), not_ours),
        ("a solution", b"RADSOL\r\n and more of it, long enough".to_vec(), not_ours),
        ("text mode", edit(6, b'\n'), not_ours),
        ("version", edit(8, 9), version),
        ("cut in the magic", good[..5].to_vec(), length),
        ("cut in the header", good[..HEADER_BYTES - 1].to_vec(), length),
        ("cut in the body", good[..good.len() - 1].to_vec(), length),
        ("one byte more", longer, length),
        ("checksum", edit(20, good[20] ^ 1), checksum),
        ("last body byte", edit(good.len() - 1, good[good.len() - 1] ^ 1), checksum),
        ("nonsense with a good checksum", with_crc(garbage), body),
        ("left over with a good checksum", with_crc(left_over), body),
    ];
    for (what, bytes, check) in table {
        let Err(error) = decode(Path::new("dir/a.radtrace"), &bytes) else { panic!("{what} was accepted") };
        assert!(check(&error), "{what}: {error}");
        assert!(error.to_string().contains("dir/a.radtrace"), "{what}: {error}");
    }
}

#[test]
fn record_file_with_any_bit_flipped_or_cut_anywhere_is_refused() {
    let good = to_bytes(&recorded().2).unwrap();
    for at in 0..good.len() {
        for bit in 0..8 {
            let mut bytes = good.clone();
            bytes[at] ^= 1 << bit;
            assert!(decode(Path::new("a"), &bytes).is_err(), "byte {at}, bit {bit}");
        }
        assert!(decode(Path::new("a"), &good[..at]).is_err(), "cut at {at}");
    }
}

/// Damage that the checksum does not see, as of a file made by another program: an error, or a replay; never a panic.
#[test]
fn record_file_with_a_byte_changed_and_a_good_checksum_is_refused_or_replayed_without_a_panic() {
    let (spec, image, record) = recorded();
    let good = to_bytes(&record).unwrap();
    let (mut refused, mut replayed) = (0, 0);
    for at in HEADER_BYTES..good.len() {
        for bits in [1, 0x80, 0xff] {
            let mut bytes = good.clone();
            bytes[at] ^= bits;
            let Ok(damaged) = decode(Path::new("a"), &with_crc(bytes)) else {
                refused += 1;
                continue;
            };
            let mut board = Board::new(&spec, image.clone()).unwrap();
            let all = damaged
                .commands
                .iter()
                .all(|(_, command)| command.check(&spec, &image).is_ok() && board.replay(command).is_ok());
            if all { replayed += 1 } else { refused += 1 }
        }
    }
    assert!(refused > 100 && replayed > 100, "{refused} refused, {replayed} replayed");
}

#[test]
fn record_of_other_work_is_refused_with_what_differs_and_both_values() {
    let (spec, image, record) = recorded();
    record.check(&record.settings, &record.key).unwrap();
    let settings = vec![Setting { name: "workload".to_owned(), value: "primary".to_owned() }];
    let message = record.check(&settings, &record.key).unwrap_err().to_string();
    assert_eq!(message, "recorded for other work: workload of the record: rays; asked for: primary");
    let more =
        [record.settings.clone(), vec![Setting { name: "camera".to_owned(), value: "here".to_owned() }]];
    let message = record.check(&more.concat(), &record.key).unwrap_err().to_string();
    assert_eq!(message, "recorded for other work: camera of the record: none; asked for: here");
    let mut other = spec.clone();
    other.partition = rtl_model::spec::Partition::Grid;
    let message = record.check(&record.settings, &RecordKey::of(&other, &image)).unwrap_err().to_string();
    assert_eq!(message, "recorded for other work: partition of the record: shells+static; asked for: grid");
}
