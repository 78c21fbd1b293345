//! Numbers out of buffers (section 3.6.2). Each range is checked against what is there before the first number is read.

use super::buffers::Buffers;
use super::document::{Accessor, Document, Sparse};
use crate::error::Error;

/// The accessors of a document.
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

/// The type of a number.
#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Result<Self, Error> {
        Ok(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return Err(Error::damaged(format!("componentType {code} is none of glTF's"))),
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number in [`Component::size`] bytes; a normalised integer is a share of the largest.
    fn number(self, bytes: &[u8], normalized: bool) -> f32 {
        let (value, largest) = match self {
            Self::I8 => (f32::from(bytes[0] as i8), 127.0),
            Self::I16 => (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
            Self::F32 => return f32::from_bits(word(bytes)),
            Self::U8 => (f32::from(bytes[0]), 255.0),
            Self::U16 => (f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
            Self::U32 => (word(bytes) as f32, u32::MAX as f32),
        };
        if normalized { (value / largest).max(-1.0) } else { value }
    }

    /// The index in as many bytes; `None` where the type is none of an index.
    fn index(self, bytes: &[u8]) -> Option<u32> {
        match self {
            Self::U8 => Some(bytes[0].into()),
            Self::U16 => Some(u16::from_le_bytes([bytes[0], bytes[1]]).into()),
            Self::U32 => Some(word(bytes)),
            Self::I8 | Self::I16 | Self::F32 => None,
        }
    }
}

fn word(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

impl Accessors<'_> {
    /// Vectors of N numbers, as many as the mesh has vertices where that is known.
    pub(super) fn vectors<const N: usize>(
        &self,
        index: usize,
        vertices: Option<usize>,
    ) -> Result<Vec<[f32; N]>, Error> {
        self.numbers(index, &format!("VEC{N}"), vertices.map(|vertices| (vertices, "positions")))
    }

    /// Matrices by columns, one for each joint.
    pub(super) fn matrices(&self, index: usize, joints: usize) -> Result<Vec<[f32; 16]>, Error> {
        self.numbers(index, "MAT4", Some((joints, "joints")))
    }

    /// Elements of N numbers, as many as there are of something where that is known.
    fn numbers<const N: usize>(
        &self,
        index: usize,
        shape: &str,
        needed: Option<(usize, &str)>,
    ) -> Result<Vec<[f32; N]>, Error> {
        let accessor = self.accessor(index, shape)?;
        if let Some((needed, of)) = needed.filter(|&(needed, _)| needed != accessor.count) {
            return Err(Error::damaged(format!(
                "accessors[{index}]: the count is {}, and there are {needed} {of}",
                accessor.count
            )));
        }
        let read = || {
            let component = Component::of(accessor.component_type)?;
            self.values(accessor, N * component.size(), [0.0; N], |bytes| {
                std::array::from_fn(|k| component.number(&bytes[k * component.size()..], accessor.normalized))
            })
        };
        read().map_err(|error| error.within(format!("accessors[{index}]")))
    }

    /// Indices of vertices.
    pub(super) fn indices(&self, index: usize) -> Result<Vec<u32>, Error> {
        let accessor = self.accessor(index, "SCALAR")?;
        let read = || {
            let component = Component::of(accessor.component_type)?;
            if component.index(&[0; 4]).is_none() {
                let code = accessor.component_type;
                return Err(Error::damaged(format!("componentType {code} is none of an index")));
            }
            self.values(accessor, component.size(), 0, |bytes| component.index(bytes).unwrap_or(0))
        };
        read().map_err(|error| error.within(format!("accessors[{index}]")))
    }

    fn accessor(&self, index: usize, shape: &str) -> Result<&Accessor, Error> {
        match self.document.accessors.get(index) {
            None => Err(Error::damaged(format!("there is no accessor {index}"))),
            Some(Accessor { shape: found, .. }) if found != shape => {
                Err(Error::damaged(format!("accessors[{index}]: the type is {found:?}, not {shape}")))
            }
            Some(accessor) => Ok(accessor),
        }
    }

    /// All values; those without a buffer view are zero where they are not sparse.
    fn values<T: Clone>(
        &self,
        accessor: &Accessor,
        size: usize,
        zero: T,
        value: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, Error> {
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let elements = self.elements(view, accessor.byte_offset, size, accessor.count, true)?;
                (0..accessor.count).map(|k| value(elements.at(k))).collect()
            }
            None => vec![zero; accessor.count],
        };
        if let Some(Sparse { count, indices, values: replaced }) = &accessor.sparse {
            let component = Component::of(indices.component_type)?;
            let at = self.elements(indices.buffer_view, indices.byte_offset, component.size(), *count, false);
            let at = at.map_err(|error| error.within("sparse.indices"))?;
            let by = self.elements(replaced.buffer_view, replaced.byte_offset, size, *count, false);
            let by = by.map_err(|error| error.within("sparse.values"))?;
            for k in 0..*count {
                let index = component.index(at.at(k)).map(|index| index as usize);
                let slot = index.and_then(|index| values.get_mut(index)).ok_or_else(|| {
                    Error::damaged(format!("sparse.indices: entry {k} is no index below {}", accessor.count))
                })?;
                *slot = value(by.at(k));
            }
        }
        Ok(values)
    }

    /// Elements of a buffer view, all of them within it.
    fn elements(
        &self,
        view: usize,
        offset: usize,
        size: usize,
        count: usize,
        strided: bool,
    ) -> Result<Elements<'_>, Error> {
        let there = self.document.buffer_views.get(view);
        let there = there.ok_or_else(|| Error::damaged(format!("there is no buffer view {view}")))?;
        let stride = match there.byte_stride.filter(|_| strided) {
            None | Some(0) => size,
            Some(stride) if stride >= size => stride,
            Some(stride) => {
                return Err(Error::damaged(format!(
                    "bufferViews[{view}]: a stride of {stride} bytes is less than the {size} of an element"
                )));
            }
        };
        let buffer = self.buffers.get(there.buffer);
        let buffer = buffer.ok_or_else(|| {
            Error::damaged(format!("bufferViews[{view}]: there is no buffer {}", there.buffer))
        })?;
        let bytes = buffer.get(there.byte_offset..).and_then(|bytes| bytes.get(..there.byte_length));
        let bytes = bytes.ok_or_else(|| {
            Error::truncated(format!(
                "bufferViews[{view}]: {} bytes from byte {} on are more than the {} of buffer {}",
                there.byte_length,
                there.byte_offset,
                buffer.len(),
                there.buffer
            ))
        })?;
        let needed = match count {
            0 => Some(0),
            _ => stride.checked_mul(count - 1).and_then(|last| last.checked_add(size)),
        };
        let within = |needed: &usize| *needed <= bytes.len().saturating_sub(offset);
        needed.filter(within).filter(|_| offset <= bytes.len()).ok_or_else(|| {
            Error::truncated(format!(
                "{count} elements of {size} bytes, {stride} apart, from byte {offset} on are more than the {} bytes of buffer view {view}",
                bytes.len()
            ))
        })?;
        Ok(Elements { bytes: &bytes[offset..], stride, size })
    }
}
