use rtl_model::board::{Board, Work};
use rtl_model::datapath::PatchWords;
use rtl_model::datapath::RayWords;
use rtl_model::memory_image::MemoryImage;
use rtl_model::record::RecordKey;
use rtl_model::spec::BoardSpec;

use super::*;
use crate::framed_file::HEADER_BYTES;
use crate::framed_file::tests::{assert_damage_is_refused, reframed};
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

fn decode(bytes: &[u8]) -> Result<WorkRecord, FramedFileError> {
    let path = Path::new("dir/a.radtrace");
    KIND.decode(path, &KIND.read_from(path, bytes, bytes.len() as u64)?)
}

#[test]
fn record_encoded_and_decoded_is_the_same_and_replays() {
    let (spec, image, record) = recorded();
    let read = decode(&to_bytes(&record)).unwrap();
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
    assert_damage_is_refused(&KIND, &to_bytes(&recorded().2), &|bytes| decode(bytes).map(|_| ()));
}

/// Damage that the checksum does not see, as of a file made by another program: an error, or a replay; never a panic.
#[test]
fn record_file_with_a_byte_changed_and_a_good_checksum_is_refused_or_replayed_without_a_panic() {
    let (spec, image, record) = recorded();
    let good = to_bytes(&record);
    let (mut refused, mut replayed) = (0, 0);
    for at in HEADER_BYTES..good.len() {
        for bits in [1, 0x80, 0xff] {
            let bytes = reframed(&KIND, &good, |body| body[at - HEADER_BYTES] ^= bits);
            let Ok(damaged) = decode(&bytes) else {
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
