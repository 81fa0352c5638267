use proptest::prelude::*;

use super::*;

const KIND: Kind = Kind { magic: *b"RADXXX\r\n", version: 3, name: "a test file", sectioned: false };

fn read(kind: &Kind, bytes: &[u8]) -> Result<Vec<u8>, FramedFileError> {
    kind.read_from(Path::new("dir/a"), bytes, bytes.len() as u64)
}

/// The frame around another body, its length and checksum put right.
pub(crate) fn reframed(kind: &Kind, bytes: &[u8], change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut body = bytes[HEADER_BYTES..].to_vec();
    change(&mut body);
    kind.frame(&body)
}

/// Every way in which the bytes of a file can be wrong is refused with its own error, which names the file.
pub(crate) fn assert_damage_is_refused(
    kind: &Kind,
    good: &[u8],
    read: &dyn Fn(&[u8]) -> Result<(), FramedFileError>,
) {
    let edit = |at: usize, value: u8| {
        let mut bytes = good.to_vec();
        bytes[at] = value;
        bytes
    };
    let longer = [good, &[0]].concat();
    type Check = fn(&FramedFileError) -> bool;
    let foreign: Check = |e| matches!(e, FramedFileError::Foreign { .. });
    let version: Check = |e| matches!(e, FramedFileError::Version { .. });
    let length: Check = |e| matches!(e, FramedFileError::Length { .. });
    let checksum: Check = |e| matches!(e, FramedFileError::Checksum { .. });
    let body: Check = |e| matches!(e, FramedFileError::Body { .. });
    let last = good.len() - 1;
    let table: Vec<(&str, Vec<u8>, Check, &str)> = vec![
        ("empty", Vec::new(), foreign, "it is empty"),
        ("a picture", b"\x89PNG\r\n\x1a\n and more, long enough".to_vec(), foreign, "a PNG picture"),
        ("another picture", b"\x76\x2f\x31\x01\x02\0\0\0 and more, long enough".to_vec(), foreign, "OpenEXR"),
        ("an event log", b"RADLOG\r\n\x01\0\0\0 and more, long enough".to_vec(), foreign, "an event log"),
        ("text", b"hello, this is text and no more".to_vec(), foreign, "does not start with RAD"),
        ("a report", b"{\"schema\": \"radeng/solve/1\"}".to_vec(), foreign, "JSON"),
        ("magic", edit(0, b'X'), foreign, "does not start with"),
        ("text mode", edit(6, b'\n'), foreign, "does not start with"),
        ("a newer version", edit(8, 99), version, "version 99 of the format, a newer one"),
        ("an older version", edit(8, 0), version, "version 0 of the format, an older one"),
        ("cut in the magic", good[..5].to_vec(), length, "5 bytes long"),
        ("cut in the header", good[..HEADER_BYTES - 1].to_vec(), length, "23 bytes long"),
        ("cut after the header", good[..HEADER_BYTES].to_vec(), length, "24 bytes long"),
        ("cut in the body", good[..last].to_vec(), length, "bytes long"),
        ("one byte more", longer, length, "bytes long"),
        ("huge length", edit(19, 0xff), length, "its header says"),
        ("checksum", edit(20, good[20] ^ 1), checksum, "damaged"),
        ("first body byte", edit(HEADER_BYTES, good[HEADER_BYTES] ^ 0x80), checksum, "damaged"),
        ("last body byte", edit(last, good[last] ^ 1), checksum, "damaged"),
        ("nonsense, good checksum", reframed(kind, good, |b| b.fill(0xff)), body, kind.name),
        ("left over, good checksum", reframed(kind, good, |b| b.extend([0; 3])), body, kind.name),
        ("cut, good checksum", reframed(kind, good, |b| b.truncate(b.len() - 1)), body, kind.name),
    ];
    for (what, bytes, check, says) in table {
        let Err(error) = read(&bytes) else { panic!("{what} was accepted") };
        let text = error.to_string();
        assert!(check(&error) && text.contains(says), "{what}: {text}");
        assert!(text.starts_with("dir/a"), "{what}: {text}");
    }
    for (at, byte) in good.iter().enumerate() {
        for bit in 0..8 {
            assert!(read(&edit(at, byte ^ 1 << bit)).is_err(), "byte {at}, bit {bit}");
        }
    }
    for n in 0..good.len() {
        assert!(read(&good[..n]).is_err(), "cut to {n} bytes");
    }
}

proptest! {
    #[test]
    fn framed_body_read_back_is_the_same(body in prop::collection::vec(any::<u8>(), 0..200)) {
        let bytes = KIND.frame(&body);
        prop_assert_eq!(bytes.len(), HEADER_BYTES + body.len());
        prop_assert_eq!(read(&KIND, &bytes).unwrap(), body);
    }
}

#[test]
fn framed_file_damaged_in_any_way_is_refused_with_its_own_error() {
    let value = ("a text".to_owned(), vec![1.5f64, -2.0]);
    let good = KIND.frame(&encode(&value));
    let decode = |bytes: &[u8]| -> Result<(String, Vec<f64>), FramedFileError> {
        KIND.decode(Path::new("dir/a"), &read(&KIND, bytes)?)
    };
    assert_eq!(decode(&good).unwrap(), value);
    assert_damage_is_refused(&KIND, &good, &|bytes| decode(bytes).map(|_| ()));
}

#[test]
fn framed_file_without_end_is_refused_after_its_header() {
    let endless = io::repeat(0);
    let error = KIND.read_from(Path::new("a"), endless, 0).unwrap_err();
    assert!(matches!(error, FramedFileError::Foreign { .. }), "{error}");
    // A header that asks for 2^63 bytes allocates none of them.
    let mut bytes = KIND.frame(b"body");
    bytes[19] = 0x80;
    let error = read(&KIND, &bytes).unwrap_err();
    assert!(matches!(error, FramedFileError::Length { .. }), "{error}");
}

#[test]
fn framed_file_written_replaces_the_old_one_and_a_folder_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.rad");
    for body in [b"first".as_slice(), b"second"] {
        KIND.write(&path, body).unwrap();
        assert_eq!(KIND.read(&path).unwrap(), body);
    }
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    let error = KIND.read(dir.path()).unwrap_err().to_string();
    assert!(error.contains("is a folder"), "{error}");
    let error = KIND.write(&dir.path().join("no/a.rad"), b"x").unwrap_err();
    assert!(matches!(error, FramedFileError::Io { .. }), "{error}");
}

#[test]
fn sections_read_back_in_order_are_the_same_and_a_damaged_one_is_named() {
    let kind = Kind { sectioned: true, ..KIND };
    let mut body = Vec::new();
    put_section(&mut body, *b"ONE ", &vec![1.0f64, 2.0]);
    put_section(&mut body, *b"TWO ", &"text");
    let good = kind.frame(&body);
    let path = Path::new("dir/a");
    let decode = |bytes: &[u8]| -> Result<(Vec<f64>, String), FramedFileError> {
        let body = read(&kind, bytes)?;
        let body = &mut body.as_slice();
        let parts = (kind.section(path, body, *b"ONE ")?, kind.section(path, body, *b"TWO ")?);
        kind.end(path, body)?;
        Ok(parts)
    };
    assert_eq!(decode(&good).unwrap(), (vec![1.0, 2.0], "text".to_owned()));
    assert_damage_is_refused(&kind, &good, &|bytes| decode(bytes).map(|_| ()));
    let mut damaged = good.clone();
    *damaged.last_mut().unwrap() ^= 1;
    let error = decode(&damaged).unwrap_err().to_string();
    assert!(error.contains("damaged in its section TWO"), "{error}");
    let swapped = reframed(&kind, &good, |b| b[..4].copy_from_slice(b"SIX "));
    let error = decode(&swapped).unwrap_err().to_string();
    assert!(error.contains("section SIX  stands where ONE  should be"), "{error}");
}
