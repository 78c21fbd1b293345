//! Numbers out of buffers (section 3.6.2). Each range is checked against what is there before the first
//! number is read.

use gltf::json::Accessor;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;

use super::buffers::Buffers;
use super::document::{Document, size};
use crate::error::Error;

pub(super) struct Accessors<'a> {
    pub(super) document: &'a Document,
    pub(super) buffers: &'a Buffers<'a>,
}

/// Elements of one size at even distances.
#[derive(Clone, Copy)]
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
}

impl<'a> Elements<'a> {
    fn at(&self, index: usize) -> &'a [u8] {
        &self.bytes[index * self.stride..][..self.size]
    }
}

/// The number in the bytes of a component; a normalised integer is a share of the largest.
fn number(component: ComponentType, bytes: &[u8], normalized: bool) -> f32 {
    let (value, largest) = match component {
        ComponentType::I8 => (f32::from(bytes[0] as i8), 127.0),
        ComponentType::I16 => (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
        ComponentType::F32 => return f32::from_bits(word(bytes)),
        ComponentType::U8 => (f32::from(bytes[0]), 255.0),
        ComponentType::U16 => (f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
        ComponentType::U32 => (word(bytes) as f32, u32::MAX as f32),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}

/// The index in the bytes of a component; `None` if the type is not one of an index.
fn index(component: ComponentType, bytes: &[u8]) -> Option<u32> {
    match component {
        ComponentType::U8 => Some(bytes[0].into()),
        ComponentType::U16 => Some(u16::from_le_bytes([bytes[0], bytes[1]]).into()),
        ComponentType::U32 => Some(word(bytes)),
        ComponentType::I8 | ComponentType::I16 | ComponentType::F32 => None,
    }
}

fn word(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

impl Accessors<'_> {
    /// Vectors of N numbers, as many as the mesh has vertices if that is known.
    pub(super) fn vectors<const N: usize>(
        &self,
        index: usize,
        vertices: Option<usize>,
    ) -> Result<Vec<[f32; N]>, Error> {
        let shape = [Type::Vec2, Type::Vec3, Type::Vec4][N - 2];
        self.numbers(index, shape, vertices.map(|vertices| (vertices, "positions")))
    }

    /// The first number of each element, of one number or a vector: one for each vertex.
    pub(super) fn firsts(&self, index: usize, vertices: usize) -> Result<Vec<f32>, Error> {
        let needed = Some((vertices, "positions"));
        match self.document.accessor(index)?.0.type_ {
            Checked::Valid(Type::Vec3) => Ok(self
                .numbers::<3>(index, Type::Vec3, needed)?
                .into_iter()
                .map(|[first, ..]| first)
                .collect()),
            Checked::Valid(Type::Vec4) => Ok(self
                .numbers::<4>(index, Type::Vec4, needed)?
                .into_iter()
                .map(|[first, ..]| first)
                .collect()),
            _ => {
                Ok(self.numbers::<1>(index, Type::Scalar, needed)?.into_iter().map(|[first]| first).collect())
            }
        }
    }

    /// Matrices by columns, one for each joint.
    pub(super) fn matrices(&self, index: usize, joints: usize) -> Result<Vec<[f32; 16]>, Error> {
        self.numbers(index, Type::Mat4, Some((joints, "joints")))
    }

    /// Elements of N numbers, as many as there are of something if that is known.
    fn numbers<const N: usize>(
        &self,
        index: usize,
        shape: Type,
        needed: Option<(usize, &str)>,
    ) -> Result<Vec<[f32; N]>, Error> {
        let (accessor, component, count) = self.accessor(index, shape)?;
        if let Some((needed, of)) = needed.filter(|&(needed, _)| needed != count) {
            return Err(Error::damaged(format!(
                "accessors[{index}]: the count is {count}, and there are {needed} {of}"
            )));
        }
        let element = |bytes: &[u8]| {
            let numbers = bytes.chunks_exact(component.size());
            let mut element = [0.0; N];
            for (slot, bytes) in element.iter_mut().zip(numbers) {
                *slot = number(component, bytes, accessor.normalized);
            }
            element
        };
        let values = self.values(accessor, count, N * component.size(), [0.0; N], element);
        values.map_err(|error| error.within(format!("accessors[{index}]")))
    }

    /// Indices of vertices.
    pub(super) fn indices(&self, at: usize) -> Result<Vec<u32>, Error> {
        let (accessor, component, count) = self.accessor(at, Type::Scalar)?;
        let here = |error: Error| error.within(format!("accessors[{at}]"));
        if index(component, &[0; 4]).is_none() {
            let code = component.as_gl_enum();
            return Err(here(Error::damaged(format!("componentType {code} is not one of an index"))));
        }
        let value = |bytes: &[u8]| index(component, bytes).unwrap_or(0);
        self.values(accessor, count, component.size(), 0, value).map_err(here)
    }

    /// An accessor of this type, that of its numbers, and how many elements it has.
    fn accessor(&self, index: usize, shape: Type) -> Result<(&Accessor, ComponentType, usize), Error> {
        let (accessor, count) = self.document.accessor(index)?;
        let (Checked::Valid(found), Checked::Valid(component)) = (accessor.type_, accessor.component_type)
        else {
            return Err(Error::damaged(format!("accessors[{index}]: the type is not one that glTF allows")));
        };
        if found == shape {
            return Ok((accessor, component.0, count));
        }
        Err(Error::damaged(format!(
            "accessors[{index}]: expected elements of the type {shape:?}, found {found:?}"
        )))
    }

    /// All values. Those without a buffer view are zero unless a sparse accessor gives them.
    fn values<T: Clone>(
        &self,
        accessor: &Accessor,
        count: usize,
        bytes: usize,
        zero: T,
        value: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, Error> {
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.unwrap_or_default().0;
                let elements = self.elements(view.value(), offset, bytes, count, true)?;
                (0..count).map(|k| value(elements.at(k))).collect()
            }
            None => vec![zero; count],
        };
        let Some(sparse) = &accessor.sparse else { return Ok(values) };
        let Checked::Valid(component) = sparse.indices.component_type else {
            return Err(Error::damaged("sparse.indices: the componentType is not one of an index"));
        };
        let (component, replaced) = (component.0, size(sparse.count.0));
        let (view, offset) = (sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0);
        let at = self.elements(view, offset, component.size(), replaced, false);
        let at = at.map_err(|error| error.within("sparse.indices"))?;
        let (view, offset) = (sparse.values.buffer_view.value(), sparse.values.byte_offset.0);
        let by = self.elements(view, offset, bytes, replaced, false);
        let by = by.map_err(|error| error.within("sparse.values"))?;
        for k in 0..replaced {
            let place = index(component, at.at(k)).map(|index| index as usize);
            let slot = place.and_then(|place| values.get_mut(place)).ok_or_else(|| {
                Error::damaged(format!("sparse.indices: entry {k} is not an index below {count}"))
            })?;
            *slot = value(by.at(k));
        }
        Ok(values)
    }

    /// Elements of a buffer view, all of them within it.
    fn elements(
        &self,
        view: usize,
        offset: u64,
        bytes: usize,
        count: usize,
        strided: bool,
    ) -> Result<Elements<'_>, Error> {
        let (declared, content) = self.buffers.view(view)?;
        let stride = match declared.byte_stride.filter(|_| strided).map(|stride| stride.0) {
            None | Some(0) => bytes,
            Some(stride) if stride >= bytes => stride,
            Some(stride) => {
                return Err(Error::damaged(format!(
                    "bufferViews[{view}]: a stride of {stride} bytes is less than the {bytes} of an element"
                )));
            }
        };
        let needed = match count {
            0 => Some(0),
            _ => stride.checked_mul(count - 1).and_then(|last| last.checked_add(bytes)),
        };
        let rest = content.get(size(offset)..);
        let enough = rest.zip(needed).filter(|(rest, needed)| needed <= &rest.len());
        let (rest, _) = enough.ok_or_else(|| {
            Error::truncated(format!(
                "{count} elements of {bytes} bytes, {stride} apart, from byte {offset} on are more than the {} bytes of buffer view {view}",
                content.len()
            ))
        })?;
        Ok(Elements { bytes: rest, stride, size: bytes })
    }
}
