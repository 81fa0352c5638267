//! The parts of a file: its JSON, and the bytes of its buffers.
//!
//! ```text
//! .glb --crate gltf--> JSON chunk, BIN chunk      .gltf = JSON
//! buffer --no uri: BIN; data: URI --base64; else a file in the scene's folder--> bytes, as many as byteLength says
//! ```

use std::path::Path;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::Root;

use crate::scene::SceneError;
use crate::scene::import::{files, folder_of, shown};

/// Largest JSON of a model (bytes): what it takes once read is several times that.
const MAX_JSON_BYTES: usize = 64 << 20;

/// A file taken apart.
pub(super) struct Container {
    pub(super) root: Root,
    /// Kept while faults may point into it.
    pub(super) json_text: Vec<u8>,
    pub(super) bin: Option<Vec<u8>>,
}

pub(super) fn open(path: &Path) -> Result<Container, SceneError> {
    let bytes = files::read(path, "a model file")?;
    let of_file = |message: String| SceneError::of_file(path, message);
    let (json_text, bin) = if bytes.starts_with(b"glTF") {
        let length = bytes.get(8..12).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        if (length as usize) < 20 || length as usize > bytes.len() {
            return Err(of_file(format!(
                "a GLB of {length} bytes by its header, {} in the file",
                bytes.len()
            )));
        }
        let glb =
            gltf::Glb::from_slice(&bytes).map_err(|e| of_file(format!("not a GLB of version 2: {e}")))?;
        (glb.json.into_owned(), glb.bin.map(|b| b.into_owned()))
    } else if super::super::Format::of(path) == Some(super::super::Format::Glb) {
        let magic = String::from_utf8_lossy(&bytes[..bytes.len().min(4)]).into_owned();
        return Err(of_file(format!("starts with {:?}, expected \"glTF\"", shown(&magic))));
    } else {
        (bytes, None)
    };
    if json_text.len() > MAX_JSON_BYTES {
        return Err(of_file(format!("JSON larger than {} MiB, the limit", MAX_JSON_BYTES >> 20)));
    }
    let root = Root::from_slice(&json_text).map_err(|e| json_fault(path, &json_text, bin.is_none(), &e))?;
    if !root.asset.version.starts_with("2.") {
        return Err(of_file(format!("version {:?} of glTF, expected 2.0", shown(&root.asset.version))));
    }
    Ok(Container { root, json_text, bin })
}

/// A fault of syntax or type; its place is in the file where that is all JSON.
fn json_fault(path: &Path, json: &[u8], is_whole_file: bool, error: &gltf::json::Error) -> SceneError {
    let text = String::from_utf8_lossy(json);
    let message = error.to_string();
    let message = message.rsplit_once(" at line").map_or(message.as_str(), |(what, _)| what);
    if !is_whole_file || error.line() == 0 {
        let place = format!("line {}, column {}", error.line(), error.column());
        return SceneError::of_file(path, format!("JSON, {place}: {}", shown_long(message)));
    }
    let line_start: usize = text.split_inclusive('\n').take(error.line() - 1).map(str::len).sum();
    let at = (line_start + error.column().saturating_sub(1)).min(text.len());
    SceneError::at_line(path, &text, at..at + 1, format!("JSON: {}", shown_long(message)))
}

fn shown_long(message: &str) -> String {
    message.chars().take(200).collect()
}

/// The bytes of every buffer that something is read from.
pub(super) fn buffers(
    path: &Path,
    folder: &Path,
    root: &Root,
    mut bin: Option<Vec<u8>>,
) -> Result<Vec<Vec<u8>>, SceneError> {
    let mut all = Vec::with_capacity(root.buffers.len());
    let mut total = 0_u64;
    for (index, buffer) in root.buffers.iter().enumerate() {
        let fault = |message: String| SceneError::of_file(path, format!("buffer {index}: {message}"));
        let bytes = match &buffer.uri {
            None if index == 0 => bin.take().ok_or_else(|| fault("no uri, and no BIN chunk".to_owned()))?,
            None => return Err(fault("no uri, expected one".to_owned())),
            Some(uri) => referred(path, folder, uri).map_err(fault)?,
        };
        if buffer.byte_length.0 > bytes.len() as u64 {
            return Err(fault(format!(
                "byteLength {}, but {} bytes are there",
                buffer.byte_length.0,
                bytes.len()
            )));
        }
        total += bytes.len() as u64;
        if total > files_limit() {
            return Err(fault(format!("buffers of over {} MiB in all, the limit", files_limit() >> 20)));
        }
        all.push(bytes);
    }
    Ok(all)
}

fn files_limit() -> u64 {
    super::super::MAX_MODEL_BYTES
}

/// The bytes that a URI stands for: data in it, or a file in the scene's folder.
pub(super) fn referred(path: &Path, folder: &Path, uri: &str) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, base64)) = data.split_once(";base64,") else {
            return Err("a data URI that is not base64".to_owned());
        };
        let forgiving = GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
        return GeneralPurpose::new(&STANDARD, forgiving)
            .decode(base64.trim_end())
            .map_err(|e| format!("a data URI of damaged base64: {e}"));
    }
    let file = files::inside(folder, &folder_of(path), &unescaped(uri)?)?;
    files::read(&file, "a file of the model").map_err(|e| e.to_string())
}

/// %20 and the like.
fn unescaped(uri: &str) -> Result<String, String> {
    let fault = || format!("uri {:?}, expected escapes of two hexadecimal digits and UTF-8", shown(uri));
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.bytes();
    while let Some(byte) = rest.next() {
        if byte != b'%' {
            bytes.push(byte);
            continue;
        }
        let mut digit = || rest.next().and_then(|d| char::from(d).to_digit(16));
        let (high, low) = (digit(), digit());
        bytes.push((high.ok_or_else(fault)? * 16 + low.ok_or_else(fault)?) as u8);
    }
    String::from_utf8(bytes).map_err(|_| fault())
}
