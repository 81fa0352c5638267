//! Damages of a text file, for tests that nothing panics on what is left.

use proptest::prelude::*;

/// One damage of a file.
#[derive(Clone, Debug)]
pub enum Damage {
    Replace(usize, u8),
    Insert(usize, char),
    Truncate(usize),
    DeleteLine(usize),
    DoubleLine(usize),
    SwapWords(usize, usize),
}

/// Any damage.
pub fn damage() -> impl Strategy<Value = Damage> {
    let at = any::<usize>();
    // Characters that mean something to TOML and to numbers hit more than random ones.
    let telling =
        prop::sample::select(vec!['"', '\'', '[', ']', '{', '}', '=', '#', '.', '-', 'e', '9', 'ß', '\0']);
    prop_oneof![
        (at, any::<u8>()).prop_map(|(at, byte)| Damage::Replace(at, byte)),
        (at, telling).prop_map(|(at, c)| Damage::Insert(at, c)),
        at.prop_map(Damage::Truncate),
        at.prop_map(Damage::DeleteLine),
        at.prop_map(Damage::DoubleLine),
        (at, at).prop_map(|(a, b)| Damage::SwapWords(a, b)),
    ]
}

/// Damages a file.
pub fn apply(bytes: &mut Vec<u8>, damage: &Damage) {
    if bytes.is_empty() {
        return;
    }
    let n = bytes.len();
    let pieces = |bytes: &[u8], by: u8| bytes.split(|b| *b == by).map(<[u8]>::to_vec).collect::<Vec<_>>();
    match *damage {
        Damage::Replace(at, byte) => bytes[at % n] = byte,
        Damage::Insert(at, c) => {
            let at = at % n;
            bytes.splice(at..at, c.to_string().into_bytes());
        }
        Damage::Truncate(at) => bytes.truncate(at % n),
        Damage::DeleteLine(at) => {
            let mut lines = pieces(bytes, b'\n');
            lines.remove(at % lines.len());
            *bytes = lines.join(&b'\n');
        }
        Damage::DoubleLine(at) => {
            let mut lines = pieces(bytes, b'\n');
            let at = at % lines.len();
            lines.insert(at, lines[at].clone());
            *bytes = lines.join(&b'\n');
        }
        Damage::SwapWords(a, b) => {
            let mut words = pieces(bytes, b' ');
            let n = words.len();
            words.swap(a % n, b % n);
            *bytes = words.join(&b' ');
        }
    }
}
