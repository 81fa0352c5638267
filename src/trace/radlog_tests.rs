//! Logs written and read back, cut at every byte, changed at every byte.

use super::*;
use rtl_model::sim::EventKind;

fn header() -> Header {
    Header {
        board: "test".to_owned(),
        clock_mhz: 25.0,
        workload: "primary".to_owned(),
        scene: Some(PathBuf::from("a/scene.toml")),
        picture: Some(Picture { width: 8, height: 4, samples: 2 }),
        directory: Directory { blocks: vec!["dram".to_owned()], links: vec![("fetches".to_owned(), 2)] },
    }
}

fn events(n: u64) -> Vec<Event> {
    (0..n).map(|i| Event::new(i, EventKind::Push, (i % 7) as u16, (i * 31) as u32)).collect()
}

const COMMANDS: [CommandFact; 2] = [
    CommandFact { purpose: Purpose::Primary, rays: 64 },
    CommandFact { purpose: Purpose::FormFactor, rays: 3 },
];

fn write(path: &Path, chunks: &[Vec<Event>]) {
    let mut writer = Writer::create(path, &header()).unwrap();
    chunks.iter().for_each(|chunk| writer.events(chunk).unwrap());
    writer.finish(COMMANDS.to_vec()).unwrap().commit().unwrap();
}

fn read_all(path: &Path) -> Result<Vec<Event>, RadlogError> {
    let mut reader = Reader::open(path)?;
    assert_eq!(reader.header(), &header());
    let mut all = Vec::new();
    while let Some(events) = reader.next_chunk()? {
        all.extend_from_slice(events);
    }
    assert_eq!(reader.trailer().commands, COMMANDS);
    Ok(all)
}

#[test]
fn radlog_read_back_is_what_was_written_whatever_the_chunks() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.radlog");
    for sizes in [&[][..], &[0, 1, 5], &[40_000, 3, 70_000]] {
        let chunks: Vec<Vec<Event>> = sizes.iter().map(|n| events(*n)).collect();
        write(&path, &chunks);
        assert_eq!(read_all(&path).unwrap(), chunks.concat());
    }
    // As the table in the module's header has it.
    let bytes = std::fs::read(&path).unwrap();
    let header_bytes = u32::from_le_bytes(*bytes[12..].first_chunk().unwrap()) as usize;
    assert!(bytes.starts_with(b"RADLOG\r\n\x01\0\0\0") && bytes.ends_with(b"END\n"));
    assert_eq!((bytes[16], bytes[15 + header_bytes]), (b'{', b'}'));
    assert_eq!(bytes[16 + header_bytes..][..8], events(1)[0].0.to_le_bytes());
    let crc = crc32fast::hash(&bytes[..bytes.len() - 8]);
    assert_eq!(bytes[bytes.len() - 8..][..4], crc.to_le_bytes());
}

#[test]
fn radlog_is_not_in_place_before_it_is_committed() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.radlog");
    std::fs::write(&path, "old").unwrap();
    let mut writer = Writer::create(&path, &header()).unwrap();
    writer.events(&events(10)).unwrap();
    let file = writer.finish(Vec::new()).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
    drop(file);
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "no half file is left");
}

#[test]
fn radlog_cut_after_any_byte_is_refused_as_cut_off() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.radlog");
    write(&path, &[events(20)]);
    let whole = std::fs::read(&path).unwrap();
    for length in 0..whole.len() {
        std::fs::write(&path, &whole[..length]).unwrap();
        let e = read_all(&path).unwrap_err();
        let expected = if length == 0 { "not an event log: begins with \"\"" } else { "cut off: " };
        assert!(e.to_string().starts_with(expected), "{length} bytes: {e}");
    }
}

#[test]
fn radlog_with_any_bit_changed_is_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.radlog");
    write(&path, &[events(20)]);
    let whole = std::fs::read(&path).unwrap();
    for at in 0..whole.len() {
        for bit in [0, 3, 7] {
            let mut changed = whole.clone();
            changed[at] ^= 1 << bit;
            std::fs::write(&path, &changed).unwrap();
            // A changed header may still be one: its CRC tells.
            let refused = Reader::open(&path).and_then(|mut reader| {
                while reader.next_chunk()?.is_some() {}
                Ok(())
            });
            assert!(refused.is_err(), "bit {bit} of byte {at}");
        }
    }
}

#[test]
fn radlog_of_another_kind_or_version_says_which() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.radlog");
    let fault = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        Reader::open(&path).unwrap_err().to_string()
    };
    assert!(fault(b"\x89PNG\r\n\x1a\n and more bytes").contains("begins with \"\\x89PNG\\r\\n\\x1a\\n\""));
    assert!(fault(b"RADLOG\r\n\x02\0\0\0\0\0\0\0").contains("version 2 of the event log, expected 1"));
    // A text-mode copy turns the line end.
    assert!(fault(b"RADLOG\n\x01\0\0\0").contains("not an event log"));
    let missing = Reader::open(&dir.path().join("none.radlog")).unwrap_err();
    assert!(matches!(missing, RadlogError::Io(_)));
    assert!(Reader::open(dir.path()).is_err());
}
