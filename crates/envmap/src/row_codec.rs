//! Lossless compression of rows of pixels, fast enough to decode them whenever they are read.
//!
//! Each channel becomes an integer in the order of its value, of as many bits as the rows need ([`Form`]).
//! It is predicted from its neighbours as by LOCO-I (M. J. Weinberger, G. Seroussi, G. Sapiro, "The LOCO-I
//! Lossless Image Compression Algorithm", 2000): the median of left, above, and left + above - upper left.
//! The differences of each run of [`RUN`] pixels and channel are written with the bits that the largest of
//! them needs. Photographs become smaller than by OpenEXR's ZIP and PIZ, because their noise does not repeat.
//!
//! Equal values have equal bytes. Any bytes decode to something, without a panic.

/// Pixels whose differences have the same number of bits.
const RUN: usize = 16;

/// Bits of that number.
const WIDTH: u32 = 6;

/// Zeros after the numbers, so that eight bytes can be read from each of them.
const PADDING: usize = 8;

/// How the values of some rows are written: the first that holds all of them exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// The upper 16 bits of f32, which hold each value of an RGBE picture.
    Upper = 1,
    /// 16-bit floats, but no infinity and no NaN.
    Half = 2,
    /// Finite 32-bit floats.
    Float = 3,
    /// 32-bit floats of any value, not compressed.
    Raw = 0,
}

/// 2^112, by which the exponents of halves and floats differ.
const HALF_SCALE: f32 = f32::from_bits((112 + 127) << 23);
/// 2^-112.
const HALF_UNSCALE: f32 = f32::from_bits((127 - 112) << 23);

impl Form {
    fn of(rows: &[[f32; 3]]) -> Self {
        let values = rows.as_flattened();
        // Bits are gathered without branches, which vector instructions do.
        let is_half = |value: f32| {
            let bits = (value.abs() * HALF_UNSCALE).to_bits();
            let is_exact = f32::from_bits(bits) * HALF_SCALE == value.abs();
            (bits & 0x1fff == 0) & (bits < 0x7c00 << 13) & is_exact
        };
        if !values.iter().fold(true, |finite, value| finite & value.is_finite()) {
            Self::Raw
        } else if values.iter().fold(0, |bits, value| bits | value.to_bits()) & 0xffff == 0 {
            Self::Upper
        } else if values.iter().fold(true, |all, value| all & is_half(*value)) {
            Self::Half
        } else {
            Self::Float
        }
    }
}

/// The bits of a float, as a signed integer whose lowest bits are 0 if there are fewer than 32, as an integer
/// in the order of the values; and back.
#[inline(always)]
fn ordered(bits: u32) -> i32 {
    let bits = bits as i32;
    bits ^ ((bits >> 31) as u32 >> 1) as i32
}

/// A value of f32, or 0 in place of one that is not finite, which only damage can bring.
fn finite(bits: u32) -> f32 {
    let value = f32::from_bits(bits);
    if value.is_finite() { value } else { 0.0 }
}

/// The code of 1.0, from which the first pixel is predicted.
const ONE: [i32; 4] = [0, 0x3f80, 0x3c00, 0x3f80_0000];

/// Set beside the form if a value is negative, infinite or NaN.
const BAD: u8 = 4;

/// Whether no value is negative, infinite or NaN.
pub(crate) fn is_clean(coded: &[u8]) -> bool {
    coded.first().is_some_and(|form| form & BAD == 0)
}

/// Whether no value is infinite or NaN.
pub(crate) fn is_finite(coded: &[u8]) -> bool {
    coded.first().is_some_and(|form| form & !BAD != Form::Raw as u8)
}

/// Whether bytes have the length of so many pixels.
pub(crate) fn is_complete(width: usize, height: usize, coded: &[u8]) -> bool {
    let Some((form, codes)) = coded.split_first() else { return false };
    if form & !BAD == Form::Raw as u8 {
        return codes.len() == 12 * width * height;
    }
    let mut reader = BitReader { bytes: codes, position: 0 };
    // A row without a bit has at least the widths of its runs.
    if form & !BAD > Form::Float as u8 || codes.len() < width.div_ceil(RUN) * height {
        return false;
    }
    for start in (0..height).flat_map(|_| (0..width).step_by(RUN)) {
        for _ in 0..3 {
            let bits = reader.read(WIDTH as usize) as usize;
            reader.position += bits.min(32) * RUN.min(width - start);
        }
    }
    reader.position.div_ceil(8) + PADDING == codes.len()
}

/// The codes of rows of `width` pixels.
pub(crate) fn encode(width: usize, rows: &[[f32; 3]]) -> Vec<u8> {
    let form = Form::of(rows);
    let is_clean =
        rows.as_flattened().iter().fold(true, |clean, value| clean & (0.0..=f32::MAX).contains(value));
    let mut bytes = vec![form as u8 | if is_clean { 0 } else { BAD }];
    match form {
        Form::Raw => {
            bytes.reserve_exact(12 * rows.len());
            bytes.extend(rows.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        }
        Form::Upper => encode_as(width, rows, form, &mut bytes, |value| ordered(value.to_bits()) >> 16),
        Form::Half => encode_as(width, rows, form, &mut bytes, |value| {
            let sign = value.to_bits() & 1 << 31;
            ordered((value.abs() * HALF_UNSCALE).to_bits() << 3 | sign) >> 16
        }),
        Form::Float => encode_as(width, rows, form, &mut bytes, |value| ordered(value.to_bits())),
    }
    bytes
}

/// Decodes rows of `width` pixels.
pub(crate) fn decode(width: usize, bytes: &[u8], rows: &mut [[f32; 3]]) {
    let Some((form, codes)) = bytes.split_first() else { return };
    match form & !BAD {
        0 => {
            let values = rows.as_flattened_mut().iter_mut().zip(codes.as_chunks::<4>().0);
            values.for_each(|(value, word)| *value = f32::from_le_bytes(*word));
        }
        1 => decode_as(width, codes, Form::Upper, rows, |code| {
            finite(ordered((code << 16) as u32) as u32 & 0xffff_0000)
        }),
        2 => decode_as(width, codes, Form::Half, rows, |code| {
            let bits = ordered((code << 16) as u32) as u32 & 0xffff_0000;
            let value = f32::from_bits((bits & 0x7fff_0000) >> 3) * HALF_SCALE;
            f32::from_bits(value.to_bits() | bits & 1 << 31)
        }),
        3 => decode_as(width, codes, Form::Float, rows, |code| finite(ordered(code as u32) as u32)),
        _ => {}
    }
}

/// The median of the neighbours to the left and above, and of the plane through three of them.
#[inline(always)]
fn predicted(left: i32, above: i32, corner: i32) -> i32 {
    left.wrapping_add(above).wrapping_sub(corner).max(left.min(above)).min(left.max(above))
}

fn encode_as(width: usize, rows: &[[f32; 3]], form: Form, bytes: &mut Vec<u8>, code: impl Fn(f32) -> i32) {
    // The first pixel is predicted from the one above it, as if that were to its left, too.
    let mut above = vec![[ONE[form as usize]; 3]; width + 1];
    let mut row = above.clone();
    let mut symbols = vec![[0_u32; 3]; width];
    let mut writer = BitWriter { bytes, bits: 0, count: 0 };
    for pixels in rows.chunks_exact(width) {
        above[0] = above[1];
        row[0] = above[1];
        row[1..].iter_mut().zip(pixels).for_each(|(row, pixel)| *row = pixel.map(&code));
        let (left, own) = (row.as_flattened(), row[1..].as_flattened());
        let (corner, upper) = (above.as_flattened(), above[1..].as_flattened());
        let neighbours = left.iter().zip(upper).zip(corner);
        for ((symbol, own), ((left, upper), corner)) in
            symbols.as_flattened_mut().iter_mut().zip(own).zip(neighbours)
        {
            let difference = own.wrapping_sub(predicted(*left, *upper, *corner));
            *symbol = (difference << 1 ^ difference >> 31) as u32;
        }
        for symbols in symbols.chunks(RUN) {
            (0..3).for_each(|channel| writer.run(symbols, channel));
        }
        std::mem::swap(&mut above, &mut row);
    }
    writer.finish();
}

fn decode_as(width: usize, codes: &[u8], form: Form, rows: &mut [[f32; 3]], value: impl Fn(i32) -> f32) {
    let mut above = vec![[ONE[form as usize]; 3]; width];
    let mut reader = BitReader { bytes: codes, position: 0 };
    for pixels in rows.chunks_exact_mut(width) {
        let mut left = above[0];
        let mut corner = above[0];
        for (pixels, above) in pixels.chunks_mut(RUN).zip(above.chunks_mut(RUN)) {
            let mut symbols = [[0_u32; RUN]; 3];
            symbols.iter_mut().for_each(|symbols| reader.run(&mut symbols[..pixels.len()]));
            let [red, green, blue] = &symbols;
            for ((((pixel, above), red), green), blue) in
                pixels.iter_mut().zip(above).zip(red).zip(green).zip(blue)
            {
                let symbols = [*red, *green, *blue];
                for channel in 0..3 {
                    let symbol = symbols[channel];
                    let difference = (symbol >> 1 ^ (symbol & 1).wrapping_neg()) as i32;
                    let guess = predicted(left[channel], above[channel], corner[channel]);
                    left[channel] = guess.wrapping_add(difference);
                }
                corner = *above;
                *above = left;
                *pixel = left.map(&value);
            }
        }
    }
}

/// Puts numbers of a few bits one after the other, the lowest bits first.
struct BitWriter<'a> {
    bytes: &'a mut Vec<u8>,
    bits: u64,
    count: u32,
}

impl BitWriter<'_> {
    /// A number of at most 32 bits.
    #[inline(always)]
    fn write(&mut self, bits: u32, count: u32) {
        self.bits |= u64::from(bits) << self.count;
        self.count += count;
        if self.count >= 32 {
            self.bytes.extend_from_slice(&(self.bits as u32).to_le_bytes());
            self.bits >>= 32;
            self.count -= 32;
        }
    }

    #[inline(always)]
    fn run(&mut self, symbols: &[[u32; 3]], channel: usize) {
        let width = u32::BITS - symbols.iter().fold(0, |bits, rgb| bits | rgb[channel]).leading_zeros();
        self.write(width, WIDTH);
        symbols.iter().for_each(|rgb| self.write(rgb[channel], width));
    }

    fn finish(self) {
        let rest = self.count.div_ceil(8) as usize;
        self.bytes.extend_from_slice(&self.bits.to_le_bytes()[..rest]);
        self.bytes.extend_from_slice(&[0; PADDING]);
        self.bytes.shrink_to_fit();
    }
}

struct BitReader<'a> {
    bytes: &'a [u8],
    /// In bits.
    position: usize,
}

impl BitReader<'_> {
    /// A number of at most 32 bits; zeros are read past the end.
    #[inline(always)]
    fn read(&mut self, width: usize) -> u32 {
        let word = self.bytes.get(self.position / 8..).and_then(|bytes| bytes.first_chunk());
        let bits = word.map_or(0, |word| u64::from_le_bytes(*word) >> (self.position % 8));
        self.position += width;
        (bits & ((1 << width) - 1)) as u32
    }

    fn run(&mut self, symbols: &mut [u32]) {
        let width = self.read(WIDTH as usize).min(32) as usize;
        symbols.iter_mut().for_each(|symbol| *symbol = self.read(width));
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn decoded(width: usize, count: usize, coded: &[u8]) -> Vec<[f32; 3]> {
        let mut rows = vec![[7.0; 3]; count];
        decode(width, coded, &mut rows);
        rows
    }

    fn bits(rows: &[[f32; 3]]) -> Vec<u32> {
        rows.as_flattened().iter().map(|value| value.to_bits()).collect()
    }

    /// Values of each form come back bit for bit: RGBE, halves with subnormal ones, floats, and all others.
    #[test]
    fn rows_of_every_form_come_back() {
        let rgbe = |bits: u32| f32::from_bits(bits & 0x7f7f_0000);
        let half = |bits: u32| {
            let magnitude = f32::from_bits(((bits & 0x7fff) % 0x7c00) << 13) * HALF_SCALE;
            if bits & 0x8000 == 0 { magnitude } else { -magnitude }
        };
        let float = |bits: u32| finite(bits);
        let forms: [(Form, &dyn Fn(u32) -> f32); 4] =
            [(Form::Upper, &rgbe), (Form::Half, &half), (Form::Float, &float), (Form::Raw, &f32::from_bits)];
        for (form, value) in forms {
            for width in [1, 15, 16, 17, 40] {
                let mut state = 1_u32;
                let mut next = || {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    value(state.rotate_left(15))
                };
                let mut rows: Vec<[f32; 3]> = (0..5 * width).map(|_| [0; 3].map(|_| next())).collect();
                if form == Form::Raw {
                    rows[0][1] = f32::NAN;
                }
                let coded = encode(width, &rows);
                // A single random value may fit an earlier form.
                assert!(width == 1 || coded[0] & !BAD == form as u8, "{form:?} {width}: {}", coded[0]);
                assert!(is_complete(width, 5, &coded));
                assert_eq!(bits(&decoded(width, rows.len(), &coded)), bits(&rows), "{form:?} {width}");
                assert_eq!(
                    is_clean(&coded),
                    rows.iter().flatten().all(|value| (0.0..=f32::MAX).contains(value))
                );
                assert_eq!(is_finite(&coded), rows.iter().flatten().all(|value| value.is_finite()));
            }
        }
    }

    #[test]
    fn smooth_rows_become_small() {
        let width = 512;
        let rows: Vec<_> = (0..32 * width).map(|i| [((i % width) as f32).floor(); 3]).collect();
        let coded = encode(width, &rows);
        assert!(8 * coded.len() < 6 * rows.len(), "{} bytes for {} pixels", coded.len(), rows.len());
    }

    proptest! {
        /// Damaged bytes decode to some finite values, and a wrong length is noticed.
        #[test]
        fn damaged_bytes_decode_to_something(at in 0_usize..4000, byte: u8, cut in 0_usize..4000) {
            let rows: Vec<_> = (0..3 * 40).map(|i| [i as f32, 0.1, 1.5]).collect();
            let mut coded = encode(40, &rows);
            let cut = cut % coded.len();
            prop_assert!(!is_complete(40, 3, &coded[..cut]));
            decoded(40, rows.len(), &coded[..cut]);
            let at = at % coded.len();
            coded[at] = byte;
            is_complete(40, 3, &coded);
            if coded[0] & !BAD != 0 {
                prop_assert!(decoded(40, rows.len(), &coded).as_flattened().iter().all(|value| value.is_finite()));
            }
        }
    }
}
