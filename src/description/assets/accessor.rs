//! Reads the numbers of a glTF accessor.
//!
//! An accessor is an array of small vectors inside a view of a buffer, perhaps interleaved with
//! others, perhaps stored as small integers, perhaps with some elements replaced by a sparse list
//! (glTF 2.0 specification, sections 3.6.2 and 2.8 of appendix "quantization"). Every offset and count
//! comes from the file, so each is checked against the bytes that are there.

use super::MAX_MESH_ELEMENTS;
use crate::memory::ask;
use gltf::json::Root;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;

/// The document and the bytes of its buffers.
pub(super) struct Source<'a> {
    pub root: &'a Root,
    pub buffers: &'a [Vec<u8>],
}

/// Elements in a buffer: where each begins and what it is made of.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    component: ComponentType,
}

impl Source<'_> {
    /// Vectors of `N` numbers, integers brought to `[0, 1]` or `[−1, 1]` when they are normalised.
    pub fn vectors<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>, String> {
        let accessor = self.accessor(index, vector_type::<N>())?;
        let component = component(accessor, index)?;
        self.read(
            accessor,
            index,
            |bytes| {
                let size = component.size();
                std::array::from_fn(|i| number(&bytes[i * size..], component, accessor.normalized))
            },
            [0.0; N],
        )
    }

    /// Colours of vertices; their coverage is left out.
    pub fn colors(&self, index: usize) -> Result<Vec<[f32; 3]>, String> {
        let accessor = self.root.accessors.get(index).ok_or_else(|| missing("accessor", index))?;
        if matches!(accessor.type_, Checked::Valid(Type::Vec4)) {
            let with_coverage = self.vectors::<4>(index)?;
            return Ok(with_coverage.into_iter().map(|[r, g, b, _]| [r, g, b]).collect());
        }
        self.vectors::<3>(index)
    }

    /// Indices of vertices.
    pub fn indices(&self, index: usize) -> Result<Vec<u32>, String> {
        let accessor = self.accessor(index, Type::Scalar)?;
        let component = component(accessor, index)?;
        if !matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
            return Err(format!("accessor {index} holds {component:?}, expected unsigned indices"));
        }
        self.read(accessor, index, |bytes| integer(bytes, component), 0)
    }

    fn accessor(&self, index: usize, expected: Type) -> Result<&Accessor, String> {
        let accessor = self.root.accessors.get(index).ok_or_else(|| missing("accessor", index))?;
        match &accessor.type_ {
            Checked::Valid(found) if *found == expected => Ok(accessor),
            Checked::Valid(found) => {
                Err(format!("accessor {index} holds {found:?}, expected {expected:?}"))
            }
            Checked::Invalid => Err(format!("accessor {index} has an unknown type")),
        }
    }

    fn read<T: Copy>(
        &self,
        accessor: &Accessor,
        index: usize,
        decode: impl Fn(&[u8]) -> T,
        zero: T,
    ) -> Result<Vec<T>, String> {
        let Checked::Valid(kind) = &accessor.type_ else { unreachable!("checked by the caller") };
        let component = component(accessor, index)?;
        let count = length(accessor.count.0, index)?;
        // What is read, and its copy in the mesh.
        let bytes = 2 * (count * size_of::<T>()) as u64;
        ask(bytes).map_err(|shortage| format!("accessor {index}, {count} elements: {shortage}"))?;
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let multiplicity = kind.multiplicity();
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let elements = self.elements(view.value(), offset, count, component, multiplicity);
                let elements = elements.map_err(|e| format!("accessor {index}: {e}"))?;
                elements.iter(count).map(&decode).collect()
            }
            None => vec![zero; count],
        };
        if let Some(sparse) = &accessor.sparse {
            let failed = |e| format!("accessor {index}, sparse: {e}");
            let Checked::Valid(index_type) = &sparse.indices.component_type else {
                return Err(failed("unknown type of indices".to_owned()));
            };
            let changed = length(sparse.count.0, index)?;
            let (at, new) = (&sparse.indices, &sparse.values);
            let indices = self
                .elements(at.buffer_view.value(), at.byte_offset.0, changed, index_type.0, 1)
                .map_err(failed)?;
            let replacements = self
                .elements(
                    new.buffer_view.value(),
                    new.byte_offset.0,
                    changed,
                    component,
                    multiplicity,
                )
                .map_err(failed)?;
            for (at, new) in indices.iter(changed).zip(replacements.iter(changed)) {
                let at = integer(at, index_type.0) as usize;
                let value = values
                    .get_mut(at)
                    .ok_or_else(|| failed(format!("replaces element {at} of {count}")))?;
                *value = decode(new);
            }
        }
        Ok(values)
    }

    /// Checks that `count` elements lie inside their view, and the view inside its buffer.
    fn elements(
        &self,
        view: usize,
        offset: u64,
        count: usize,
        component: ComponentType,
        multiplicity: usize,
    ) -> Result<Elements<'_>, String> {
        let found = self.root.buffer_views.get(view).ok_or_else(|| missing("buffer view", view))?;
        let buffer = found.buffer.value();
        let bytes = self.buffers.get(buffer).ok_or_else(|| missing("buffer", buffer))?;
        let slice = |bytes: &'_ [u8], start: u64, length: u64| -> Option<std::ops::Range<usize>> {
            let end = start.checked_add(length)?;
            (end <= bytes.len() as u64).then_some(start as usize..end as usize)
        };
        let start = found.byte_offset.map_or(0, |offset| offset.0);
        let in_buffer = slice(bytes, start, found.byte_length.0).ok_or_else(|| {
            format!("buffer view {view} ends beyond the {} bytes of its buffer", bytes.len())
        })?;
        let bytes = &bytes[in_buffer];
        let size = component.size() * multiplicity;
        let stride = match found.byte_stride {
            // 0 means tightly packed in some files.
            None | Some(gltf::json::buffer::Stride(0)) => size,
            Some(gltf::json::buffer::Stride(stride)) if stride >= size => stride,
            Some(gltf::json::buffer::Stride(stride)) => {
                return Err(format!("elements of {size} bytes at a stride of {stride}"));
            }
        };
        // Elements but the last take a whole stride.
        let length = (count.max(1) as u64 - 1)
            .checked_mul(stride as u64)
            .and_then(|bytes| bytes.checked_add(size as u64))
            .filter(|_| count > 0)
            .unwrap_or(if count == 0 { 0 } else { u64::MAX });
        let in_view = slice(bytes, offset, length).ok_or_else(|| {
            format!("{count} elements end beyond the {} bytes of buffer view {view}", bytes.len())
        })?;
        Ok(Elements { bytes: &bytes[in_view], stride, component })
    }
}

impl Elements<'_> {
    fn iter(&self, count: usize) -> impl Iterator<Item = &[u8]> {
        debug_assert!(self.component.size() <= self.stride);
        (0..count).map(|i| &self.bytes[i * self.stride..])
    }
}

fn missing(what: &str, index: usize) -> String {
    format!("refers to {what} {index}, which does not exist")
}

fn component(accessor: &Accessor, index: usize) -> Result<ComponentType, String> {
    match &accessor.component_type {
        Checked::Valid(component) => Ok(component.0),
        Checked::Invalid => Err(format!("accessor {index} has an unknown type of components")),
    }
}

fn length(count: u64, index: usize) -> Result<usize, String> {
    usize::try_from(count).ok().filter(|&count| count <= MAX_MESH_ELEMENTS).ok_or_else(|| {
        format!("accessor {index} has {count} elements, at most {MAX_MESH_ELEMENTS} are allowed")
    })
}

const fn vector_type<const N: usize>() -> Type {
    match N {
        2 => Type::Vec2,
        3 => Type::Vec3,
        4 => Type::Vec4,
        _ => Type::Scalar,
    }
}

/// One component as a number; normalised integers by the specification's section 3.11.
fn number(bytes: &[u8], component: ComponentType, normalized: bool) -> f32 {
    let (value, greatest) = match component {
        ComponentType::I8 => (f32::from(bytes[0] as i8), f32::from(i8::MAX)),
        ComponentType::U8 => (f32::from(bytes[0]), f32::from(u8::MAX)),
        ComponentType::I16 => {
            (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), f32::from(i16::MAX))
        }
        ComponentType::U16 => {
            (f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), f32::from(u16::MAX))
        }
        ComponentType::U32 => (integer(bytes, component) as f32, u32::MAX as f32),
        ComponentType::F32 => {
            return f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        }
    };
    if normalized { (value / greatest).max(-1.0) } else { value }
}

fn integer(bytes: &[u8], component: ComponentType) -> u32 {
    match component {
        ComponentType::U8 | ComponentType::I8 => u32::from(bytes[0]),
        ComponentType::U16 | ComponentType::I16 => {
            u32::from(u16::from_le_bytes([bytes[0], bytes[1]]))
        }
        ComponentType::U32 | ComponentType::F32 => {
            u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
        }
    }
}
