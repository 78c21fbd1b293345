//! EXT_meshopt_compression: buffer views that meshoptimizer compressed, decoded after the bitstream that the
//! extension's specification describes (Khronos glTF registry, appendix A: attributes, triangles, indices;
//! appendix B: filters).

use crate::error::Error;

/// How the elements of a buffer view are compressed, and what is undone to them afterwards.
pub(super) struct Compression {
    pub(super) mode: Mode,
    pub(super) filter: Filter,
    pub(super) count: usize,
    /// Bytes of an element.
    pub(super) stride: usize,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Mode {
    /// Elements of any meaning, as deltas of bytes.
    Attributes,
    /// The indices of a list of triangles.
    Triangles,
    /// Other indices.
    Indices,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Filter {
    None,
    /// Unit vectors, of 3 + 1 bytes or words.
    Octahedral,
    /// Rotations, of 4 words.
    Quaternion,
    /// Floats with exponents of their own.
    Exponential,
}

/// Elements of a group of attributes.
const GROUP: usize = 16;

impl Compression {
    /// The elements, `count` times `stride` bytes.
    pub(super) fn decode(&self, bytes: &[u8]) -> Result<Vec<u8>, Error> {
        let Self { mode, filter, count, stride } = *self;
        // Bytes of a group that are all zero take two bits: nothing is packed more tightly.
        let size = count.checked_mul(stride).filter(|size| size / 64 <= bytes.len());
        let size = size.ok_or_else(|| {
            Error::truncated(format!("{count} elements of {stride} bytes cannot be in {} bytes", bytes.len()))
        })?;
        let allowed = match (mode, filter) {
            (Mode::Attributes, Filter::None) => stride % 4 == 0 && (4..=256).contains(&stride),
            (Mode::Attributes, Filter::Octahedral) => [4, 8].contains(&stride),
            (Mode::Attributes, Filter::Quaternion) => stride == 8,
            (Mode::Attributes, Filter::Exponential) => stride % 4 == 0 && (4..=256).contains(&stride),
            (Mode::Triangles, Filter::None) => [2, 4].contains(&stride) && count % 3 == 0,
            (Mode::Indices, Filter::None) => [2, 4].contains(&stride),
            (Mode::Triangles | Mode::Indices, _) => false,
        };
        if !allowed {
            return Err(Error::damaged(format!(
                "mode, filter, {count} elements and a stride of {stride} bytes do not go together"
            )));
        }
        let mut decoded = Vec::with_capacity(size);
        let done = match mode {
            Mode::Attributes => attributes(bytes, count, stride, &mut decoded),
            Mode::Triangles => triangles(bytes, count, stride, &mut decoded),
            Mode::Indices => indices(bytes, count, stride, &mut decoded),
        };
        done.ok_or_else(|| Error::damaged("the compressed data are damaged or truncated"))?;
        match filter {
            Filter::None => {}
            Filter::Octahedral if stride == 4 => decoded.as_chunks_mut().0.iter_mut().for_each(octahedral_8),
            Filter::Octahedral => decoded.as_chunks_mut().0.iter_mut().for_each(octahedral_16),
            Filter::Quaternion => decoded.as_chunks_mut().0.iter_mut().for_each(quaternion),
            Filter::Exponential => decoded.as_chunks_mut().0.iter_mut().for_each(exponential),
        }
        Ok(decoded)
    }
}

/// Bytes that are taken from the front; `None` is their end.
struct Stream<'a>(&'a [u8]);

impl<'a> Stream<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn byte(&mut self) -> Option<u8> {
        Some(self.take(1)?[0])
    }

    /// A number of 7 bits a byte, the lowest first.
    fn number(&mut self) -> Option<u32> {
        let mut number = 0;
        for shift in [0, 7, 14, 21, 28] {
            let byte = u32::from(self.byte()?);
            number |= (byte & 127) << shift;
            if byte < 128 {
                break;
            }
        }
        Some(number)
    }

    /// An index that is coded as the signed difference from the last one.
    fn index(&mut self, last: &mut u32) -> Option<u32> {
        let difference = self.number()?;
        *last = last.wrapping_add((difference >> 1) ^ (difference & 1).wrapping_neg());
        Some(*last)
    }
}

fn attributes(bytes: &[u8], count: usize, stride: usize, decoded: &mut Vec<u8>) -> Option<()> {
    let (&header, body) = bytes.split_first()?;
    if header != 0xa0 {
        return None;
    }
    // The tail ends with the element from which the first one differs.
    let (body, tail) = body.split_at_checked(body.len().checked_sub(stride.max(32))?)?;
    let mut last = tail[tail.len() - stride..].to_vec();
    let mut stream = Stream(body);
    let most = ((8192 / stride) & !(GROUP - 1)).min(256);
    decoded.resize(count * stride, 0);
    for block in decoded.chunks_mut(most * stride) {
        let elements = block.len() / stride;
        for (place, last) in last.iter_mut().enumerate() {
            let groups = elements.div_ceil(GROUP);
            let headers = stream.take(groups.div_ceil(4))?;
            for group in 0..groups {
                let differences = group_of_bytes(headers[group / 4] >> (group % 4 * 2) & 3, &mut stream)?;
                for (k, difference) in differences.into_iter().enumerate().take(elements - group * GROUP) {
                    *last = last.wrapping_add((difference >> 1) ^ (difference & 1).wrapping_neg());
                    block[(group * GROUP + k) * stride + place] = *last;
                }
            }
        }
    }
    stream.0.is_empty().then_some(())
}

/// 16 bytes, each in 0, 2, 4 or 8 bits, as `header` says; one whose bits are all set follows them in full.
fn group_of_bytes(header: u8, stream: &mut Stream<'_>) -> Option<[u8; GROUP]> {
    let mut group = [0; GROUP];
    let bits = match header {
        0 => return Some(group),
        1 => 2,
        2 => 4,
        _ => return stream.take(GROUP)?.try_into().ok(),
    };
    let packed = stream.take(GROUP * bits / 8)?;
    let most = (1 << bits) - 1;
    for (k, byte) in group.iter_mut().enumerate() {
        let at = k * bits;
        *byte = packed[at / 8] >> (8 - bits - at % 8) & most;
        if *byte == most {
            *byte = stream.byte()?;
        }
    }
    Some(group)
}

/// The last 16 of something, counted back from the newest, 0.
struct Recent<T> {
    items: [T; 16],
    next: usize,
}

impl<T: Copy + Default> Recent<T> {
    fn new() -> Self {
        Self { items: [T::default(); 16], next: 0 }
    }

    fn push(&mut self, item: T) {
        self.items[self.next % 16] = item;
        self.next += 1;
    }

    fn back(&self, places: u8) -> T {
        self.items[self.next.wrapping_sub(1 + usize::from(places)) % 16]
    }
}

fn triangles(bytes: &[u8], count: usize, stride: usize, decoded: &mut Vec<u8>) -> Option<()> {
    let (&header, body) = bytes.split_first()?;
    if header != 0xe1 {
        return None;
    }
    let (codes, rest) = body.split_at_checked(count / 3)?;
    let (data, table) = rest.split_at_checked(rest.len().checked_sub(16)?)?;
    let mut data = Stream(data);
    let (mut edges, mut vertices) = (Recent::<(u32, u32)>::new(), Recent::<u32>::new());
    let (mut next, mut last) = (0_u32, 0_u32);
    for &code in codes {
        let (high, low) = (code >> 4, code & 15);
        let (a, b, c);
        if high < 15 {
            // An edge that is known and a vertex that is new, recent, beside the last free one, or free.
            (a, b) = edges.back(high);
            c = match low {
                0 => count_up(&mut next),
                1..13 => vertices.back(low),
                13 => last.wrapping_sub(1),
                14 => last.wrapping_add(1),
                _ => data.index(&mut last)?,
            };
            if low >= 13 {
                last = c;
            }
            if !(1..13).contains(&low) {
                vertices.push(c);
            }
        } else {
            // Three vertices: the first is new, or free in the last of these codes.
            let places = if low < 14 { table[usize::from(low)] } else { data.byte()? };
            if low >= 14 && places == 0 {
                next = 0;
            }
            let free = |place: u8| low >= 14 && place == 15;
            let known = |place: u8, next: &mut u32| match place {
                0 => count_up(next),
                _ => vertices.back(place - 1),
            };
            let (second, third) = (places >> 4, places & 15);
            let first = (low < 15).then(|| count_up(&mut next));
            let [known_b, known_c] =
                [second, third].map(|place| (!free(place)).then(|| known(place, &mut next)));
            a = first.map_or_else(|| data.index(&mut last), Some)?;
            b = known_b.map_or_else(|| data.index(&mut last), Some)?;
            c = known_c.map_or_else(|| data.index(&mut last), Some)?;
            vertices.push(a);
            if second == 0 || free(second) {
                vertices.push(b);
            }
            if third == 0 || free(third) {
                vertices.push(c);
            }
            edges.push((b, a));
        }
        edges.push((c, b));
        edges.push((a, c));
        [a, b, c].into_iter().for_each(|index| push_index(index, stride, decoded));
    }
    data.0.is_empty().then_some(())
}

fn indices(bytes: &[u8], count: usize, stride: usize, decoded: &mut Vec<u8>) -> Option<()> {
    let (&header, body) = bytes.split_first()?;
    if header != 0xd1 {
        return None;
    }
    let mut data = Stream(&body[..body.len().checked_sub(4)?]);
    let mut last = [0_u32; 2];
    for _ in 0..count {
        let code = data.number()?;
        let (which, difference) = (&mut last[(code & 1) as usize], code >> 1);
        *which = which.wrapping_add((difference >> 1) ^ (difference & 1).wrapping_neg());
        push_index(*which, stride, decoded);
    }
    data.0.is_empty().then_some(())
}

/// The index of a vertex that was not used before.
fn count_up(next: &mut u32) -> u32 {
    let new = *next;
    *next = next.wrapping_add(1);
    new
}

fn push_index(index: u32, stride: usize, decoded: &mut Vec<u8>) {
    decoded.extend_from_slice(&index.to_le_bytes()[..stride]);
}

/// A unit vector from its octahedral map, whose third number is its 1.
fn octahedral(x: f32, y: f32, one: f32, most: f32) -> [f32; 3] {
    let z = one - x.abs() - y.abs();
    let fold = z.min(0.0);
    let [x, y] = [x, y].map(|value| if value >= 0.0 { value + fold } else { value - fold });
    let length = (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|value| (value * (most / length)).round())
}

fn octahedral_8(element: &mut [u8; 4]) {
    let [x, y, one, _] = element.map(|byte| f32::from(byte as i8));
    let vector = octahedral(x, y, one, 127.0);
    element[..3].copy_from_slice(&vector.map(|value| value as i8 as u8));
}

fn octahedral_16(element: &mut [u8; 8]) {
    let [x, y, one, w] = words(element);
    let [x, y, z] = octahedral(x.into(), y.into(), one.into(), 32767.0).map(|value| value as i16);
    *element = bytes_of([x, y, z, w]);
}

fn quaternion(element: &mut [u8; 8]) {
    let [x, y, z, code] = words(element);
    let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(code | 3);
    let three = [x, y, z].map(|value| f32::from(value) * scale);
    let w = three.iter().fold(1.0, |rest, value| rest - value * value).max(0.0).sqrt();
    let mut rotation = [0_i16; 4];
    let largest = (code & 3) as usize;
    for (k, value) in [w, three[0], three[1], three[2]].into_iter().enumerate() {
        rotation[(largest + k) % 4] = (value * 32767.0).round() as i16;
    }
    *element = bytes_of(rotation);
}

/// A mantissa of 24 bits and an exponent of 8, both signed.
fn exponential(element: &mut [u8; 4]) {
    let code = i32::from_le_bytes(*element);
    let (mantissa, exponent) = (code << 8 >> 8, code >> 24);
    *element = ((f64::from(mantissa) * math::powi(2.0_f64, exponent)) as f32).to_le_bytes();
}

fn words(bytes: &[u8; 8]) -> [i16; 4] {
    std::array::from_fn(|k| i16::from_le_bytes([bytes[2 * k], bytes[2 * k + 1]]))
}

fn bytes_of(words: [i16; 4]) -> [u8; 8] {
    let mut bytes = [0; 8];
    words.iter().zip(bytes.as_chunks_mut().0).for_each(|(word, bytes)| *bytes = word.to_le_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use base64::Engine;
    use base64::prelude::BASE64_STANDARD;
    use serde::Deserialize;

    use super::*;

    #[derive(Deserialize)]
    struct EncodedStream {
        mode: String,
        filter: String,
        count: usize,
        stride: usize,
        encoded: String,
        decoded: String,
    }

    /// Streams of meshoptimizer's encoder and what its decoder makes of them.
    fn streams() -> Vec<(String, Compression, Vec<u8>, Vec<u8>)> {
        let streams: Vec<EncodedStream> =
            serde_json::from_str(include_str!("../../../tests/data/meshopt.json")).unwrap();
        let bytes = |text: &str| BASE64_STANDARD.decode(text).unwrap();
        let parse = |stream: EncodedStream| {
            let EncodedStream { mode, filter, count, stride, encoded, decoded } = stream;
            let name = format!("{mode} {filter} {stride}");
            let mode = match mode.as_str() {
                "ATTRIBUTES" => Mode::Attributes,
                "TRIANGLES" => Mode::Triangles,
                _ => Mode::Indices,
            };
            let filter = match filter.as_str() {
                "OCTAHEDRAL" => Filter::Octahedral,
                "QUATERNION" => Filter::Quaternion,
                "EXPONENTIAL" => Filter::Exponential,
                _ => Filter::None,
            };
            (name, Compression { mode, filter, count, stride }, bytes(&encoded), bytes(&decoded))
        };
        streams.into_iter().map(parse).collect()
    }

    #[test]
    fn streams_of_meshoptimizer_are_decoded() {
        assert_eq!(streams().len(), 11);
        for (name, compression, encoded, decoded) in streams() {
            let found = compression.decode(&encoded).unwrap();
            if compression.filter != Filter::Quaternion {
                assert_eq!(found, decoded, "{name}");
                continue;
            }
            // That decoder is one of SIMD, which rounds a few numbers otherwise.
            let words = |bytes: &[u8]| -> Vec<i16> {
                bytes.as_chunks().0.iter().map(|bytes| i16::from_le_bytes(*bytes)).collect()
            };
            for (found, expected) in words(&found).into_iter().zip(words(&decoded)) {
                assert!((found - expected).abs() <= 1, "{name}: {found}, {expected}");
            }
        }
    }

    #[test]
    fn damaged_streams_are_errors_or_elements() {
        for (name, compression, encoded, decoded) in streams() {
            for length in 0..encoded.len() {
                assert!(compression.decode(&encoded[..length]).is_err(), "{name}: {length}");
            }
            for at in 0..encoded.len() {
                for flip in [0x01, 0x10, 0x80, 0xff] {
                    let mut changed = encoded.clone();
                    changed[at] ^= flip;
                    if let Ok(elements) = compression.decode(&changed) {
                        assert_eq!(elements.len(), decoded.len(), "{name}");
                    }
                }
            }
        }
    }
}
