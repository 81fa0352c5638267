//! Numbers of a buffer, read one by one: any component type, any stride, every byte inside.
//!
//! ```text
//! accessor -> buffer view -> buffer:  offset + (count - 1) stride + size <= view <= buffer, before anything is read
//! ```

use gltf::json::Index;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;

use super::File;

/// Most values of one accessor: corners of the most faces.
const MAX_COUNT: u64 = 3 * crate::scene::MAX_FACES as u64;

/// A checked accessor.
pub(super) struct Values<'a> {
    /// From the first value on; `None`: all zero.
    bytes: Option<&'a [u8]>,
    count: usize,
    stride: usize,
    component: ComponentType,
    n_components: usize,
    normalized: bool,
}

impl<'a> Values<'a> {
    /// The accessor's values, when they are `kind` and all inside their buffer.
    pub(super) fn new(file: &File<'a>, index: Index<Accessor>, kind: Type) -> Result<Values<'a>, String> {
        let at = format!("accessor {}", index.value());
        let accessor =
            file.root.get(index).ok_or_else(|| format!("{at} of {}", file.root.accessors.len()))?;
        if accessor.sparse.is_some() {
            return Err(format!("{at} is sparse, which is not read: expected plain values"));
        }
        let (Checked::Valid(component), Checked::Valid(type_)) = (&accessor.component_type, &accessor.type_)
        else {
            return Err(format!("{at} has no valid type"));
        };
        if *type_ != kind {
            return Err(format!("{at} holds {type_:?}, expected {kind:?}"));
        }
        let count = accessor.count.0;
        if count > MAX_COUNT {
            return Err(format!("{at} of {count} values, expected at most {MAX_COUNT}"));
        }
        let n_components = kind.multiplicity();
        let size = (n_components * component.0.size()) as u64;
        let mut values = Values {
            bytes: None,
            count: count as usize,
            stride: size as usize,
            component: component.0,
            n_components,
            normalized: accessor.normalized,
        };
        let Some(view_index) = accessor.buffer_view else { return Ok(values) };
        let view = file
            .root
            .get(view_index)
            .ok_or_else(|| format!("{at}: no buffer view {}", view_index.value()))?;
        let stride = view.byte_stride.map_or(size, |s| s.0 as u64);
        if stride < size {
            return Err(format!("{at}: byteStride {stride} of values of {size} bytes"));
        }
        let bytes = view_bytes(file, view_index)?;
        let start = accessor.byte_offset.map_or(0, |o| o.0);
        let length = if count == 0 { 0 } else { (count - 1).saturating_mul(stride).saturating_add(size) };
        let end = start.saturating_add(length);
        if end > bytes.len() as u64 {
            return Err(format!(
                "{at}: {count} values end at byte {end} of buffer view {}, which has {}",
                view_index.value(),
                bytes.len()
            ));
        }
        values.bytes = Some(&bytes[start as usize..]);
        values.stride = stride as usize;
        Ok(values)
    }

    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Whether the components may serve as indices.
    pub(super) fn is_unsigned(&self) -> bool {
        matches!(self.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
    }

    /// Components of value `index`, which must be under [`Values::len`]; the others are 0.
    pub(super) fn get(&self, index: usize) -> [f64; 4] {
        let mut out = [0.0; 4];
        let Some(bytes) = self.bytes else { return out };
        let value = &bytes[index * self.stride..];
        let size = self.component.size();
        for (c, slot) in out.iter_mut().enumerate().take(self.n_components) {
            let b = &value[c * size..(c + 1) * size];
            let (number, largest) = match self.component {
                ComponentType::I8 => (f64::from(b[0] as i8), 127.0),
                ComponentType::U8 => (f64::from(b[0]), 255.0),
                ComponentType::I16 => (f64::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
                ComponentType::U16 => (f64::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
                ComponentType::U32 => {
                    (f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])), f64::from(u32::MAX))
                }
                ComponentType::F32 => (f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])), 1.0),
            };
            *slot = if self.normalized { (number / largest).max(-1.0) } else { number };
        }
        out
    }
}

/// The bytes of a buffer view.
pub(super) fn view_bytes<'a>(
    file: &File<'a>,
    index: Index<gltf::json::buffer::View>,
) -> Result<&'a [u8], String> {
    let at = format!("buffer view {}", index.value());
    let view = file.root.get(index).ok_or_else(|| format!("{at} of {}", file.root.buffer_views.len()))?;
    let bytes = file.buffers.get(view.buffer.value()).ok_or_else(|| format!("{at}: no such buffer"))?;
    let start = view.byte_offset.map_or(0, |o| o.0);
    let end = start.saturating_add(view.byte_length.0);
    if end > bytes.len() as u64 {
        return Err(format!(
            "{at} ends at byte {end} of buffer {}, which has {}",
            view.buffer.value(),
            bytes.len()
        ));
    }
    Ok(&bytes[start as usize..end as usize])
}
