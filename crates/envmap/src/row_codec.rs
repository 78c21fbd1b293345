//! Lossless compression of rows of pixels, fast enough to decode them whenever they are read.
//!
//! Each channel becomes an integer in the order of its value, of as many bits as the rows need ([`Form`]).
//! It is predicted from its neighbours as by LOCO-I (M. J. Weinberger, G. Seroussi, G. Sapiro, "The LOCO-I
//! Lossless Image Compression Algorithm", 2000): the median of left, above, and left + above - upper left.
//! The differences of each run of [`RUN`] pixels and channel are written with the bits that the largest of
//! them needs. Photographs become smaller than by OpenEXR's ZIP and PIZ, because their noise does not repeat.
//!
//! Equal values have equal bytes. Any bytes decode to something, without a panic.
//!
//! Encoder and decoder are compiled for each SIMD level. They compute with integers, and with products by
//! powers of two, which are exact: all levels give the same bits.

use pulp::{Simd, WithSimd};
use sh::f64x4::SimdLevel;

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
    #[inline(always)]
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
#[inline(always)]
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
    SimdLevel::detect().run(Encode { width, rows })
}

/// Decodes rows of `width` pixels.
pub(crate) fn decode(width: usize, bytes: &[u8], rows: &mut [[f32; 3]]) {
    SimdLevel::detect().run(Decode { width, bytes, rows });
}

struct Encode<'a> {
    width: usize,
    rows: &'a [[f32; 3]],
}

impl WithSimd for Encode<'_> {
    type Output = Vec<u8>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<u8> {
        let Self { width, rows } = self;
        let form = Form::of(rows);
        let is_clean = |value: &f32| (*value >= 0.0) & (*value <= f32::MAX);
        let is_clean = rows.as_flattened().iter().fold(true, |clean, value| clean & is_clean(value));
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
}

struct Decode<'a> {
    width: usize,
    bytes: &'a [u8],
    rows: &'a mut [[f32; 3]],
}

impl WithSimd for Decode<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { width, bytes, rows } = self;
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
}

/// The median of the neighbours to the left and above, and of the plane through three of them.
#[inline(always)]
fn predicted(left: i32, above: i32, corner: i32) -> i32 {
    left.wrapping_add(above.wrapping_sub(corner)).max(left.min(above)).min(left.max(above))
}

#[inline(always)]
fn encode_as(width: usize, rows: &[[f32; 3]], form: Form, bytes: &mut Vec<u8>, code: impl Fn(f32) -> i32) {
    // The first pixel is predicted from the one above it, as if that were to its left, too.
    let mut above = vec![[ONE[form as usize]; 3]; width + 1];
    let mut row = above.clone();
    let mut symbols = vec![[0_u32; 3]; width];
    // Most photographs need less.
    bytes.reserve(4 * rows.len());
    let mut writer = BitWriter { bytes, bits: 0, count: 0 };
    for pixels in rows.chunks_exact(width) {
        above[0] = above[1];
        row[0] = above[1];
        let values = row[1..].as_flattened_mut().iter_mut().zip(pixels.as_flattened());
        values.for_each(|(row, value)| *row = code(*value));
        let (left, own) = (row.as_flattened(), row[1..].as_flattened());
        let (corner, upper) = (above.as_flattened(), above[1..].as_flattened());
        let neighbours = left.iter().zip(upper).zip(corner);
        for ((symbol, own), ((left, upper), corner)) in
            symbols.as_flattened_mut().iter_mut().zip(own).zip(neighbours)
        {
            let difference = own.wrapping_sub(predicted(*left, *upper, *corner));
            *symbol = (difference << 1 ^ difference >> 31) as u32;
        }
        let (runs, rest) = symbols.as_chunks::<RUN>();
        runs.iter().for_each(|run| writer.run(run));
        writer.last_run(rest);
        std::mem::swap(&mut above, &mut row);
    }
    writer.finish();
}

#[inline(always)]
fn decode_as(width: usize, codes: &[u8], form: Form, rows: &mut [[f32; 3]], value: impl Fn(i32) -> f32) {
    // The codes of the row above, which those of the row replace; the fourth lane is not used.
    let mut line = vec![[ONE[form as usize]; 4]; width];
    let mut reader = BitReader { bytes: codes, position: 0 };
    for pixels in rows.chunks_exact_mut(width) {
        let mut state = [line[0]; 2];
        let (runs, rest) = pixels.as_chunks_mut::<RUN>();
        let (lines, rest_of_line) = line.as_chunks_mut::<RUN>();
        for (pixels, line) in runs.iter_mut().zip(lines) {
            let symbols = [reader.run(), reader.run(), reader.run()];
            state = add_differences(symbols, state, line, pixels, &value);
        }
        if !rest.is_empty() {
            let length = rest.len();
            let symbols = [reader.last_run(length), reader.last_run(length), reader.last_run(length)];
            add_differences(symbols, state, rest_of_line, rest, &value);
        }
    }
}

/// The pixels of a run, from the codes to the left of it and above that.
#[inline(always)]
fn add_differences(
    symbols: [[u32; RUN]; 3],
    [mut left, mut corner]: [[i32; 4]; 2],
    line: &mut [[i32; 4]],
    pixels: &mut [[f32; 3]],
    value: impl Fn(i32) -> f32,
) -> [[i32; 4]; 2] {
    let mut differences = [[0; 4]; RUN];
    for channel in 0..3 {
        for index in 0..RUN {
            let symbol = symbols[channel][index];
            differences[index][channel] = (symbol >> 1 ^ (symbol & 1).wrapping_neg()) as i32;
        }
    }
    for (above, difference) in line.iter_mut().zip(&differences) {
        let mut own = [0; 4];
        for lane in 0..4 {
            own[lane] = predicted(left[lane], above[lane], corner[lane]).wrapping_add(difference[lane]);
        }
        (left, corner, *above) = (own, *above, own);
    }
    // All lanes at once: without the fourth, values would be converted one by one.
    let mut values = [[0.0; 4]; RUN];
    let converted = values.as_flattened_mut().iter_mut().zip(line.as_flattened());
    converted.for_each(|(to, code)| *to = value(*code));
    for (pixel, value) in pixels.iter_mut().zip(&values) {
        *pixel = [value[0], value[1], value[2]];
    }
    [left, corner]
}

/// Puts numbers of a few bits one after the other, the lowest bits first.
struct BitWriter<'a> {
    bytes: &'a mut Vec<u8>,
    bits: u64,
    /// Below 64.
    count: u32,
}

/// The most bits of a number of which four are written or read at once.
const MAX_WIDTH_OF_FOUR: u32 = 14;

impl BitWriter<'_> {
    /// A number of at most 56 bits.
    #[inline(always)]
    fn write(&mut self, bits: u64, width: u32) {
        self.bits |= bits << self.count;
        let count = self.count + width;
        if count >= 64 {
            self.bytes.extend_from_slice(&self.bits.to_le_bytes());
            self.bits = bits >> (64 - self.count);
        }
        self.count = count % 64;
    }

    /// A run of each channel.
    #[inline(always)]
    fn run(&mut self, run: &[[u32; 3]; RUN]) {
        for channel in 0..3 {
            let mut symbols = [0; RUN];
            for index in 0..RUN {
                symbols[index] = run[index][channel];
            }
            let width = bits_of(&symbols);
            if width > MAX_WIDTH_OF_FOUR {
                self.symbols(&symbols, width);
                continue;
            }
            self.write(u64::from(width), WIDTH);
            for four in symbols.as_chunks::<4>().0 {
                let [a, b, c, d] =
                    [u64::from(four[0]), u64::from(four[1]), u64::from(four[2]), u64::from(four[3])];
                self.write(a | b << width | (c | d << width) << (2 * width), 4 * width);
            }
        }
    }

    /// A run of each channel that the row's end cuts off.
    fn last_run(&mut self, run: &[[u32; 3]]) {
        for channel in 0..3 {
            let mut symbols = [0; RUN];
            symbols.iter_mut().zip(run).for_each(|(symbol, rgb)| *symbol = rgb[channel]);
            if !run.is_empty() {
                self.symbols(&symbols[..run.len()], bits_of(&symbols));
            }
        }
    }

    fn symbols(&mut self, symbols: &[u32], width: u32) {
        self.write(u64::from(width), WIDTH);
        symbols.iter().for_each(|symbol| self.write(u64::from(*symbol), width));
    }

    fn finish(self) {
        let rest = self.count.div_ceil(8) as usize;
        self.bytes.extend_from_slice(&self.bits.to_le_bytes()[..rest]);
        self.bytes.extend_from_slice(&[0; PADDING]);
        self.bytes.shrink_to_fit();
    }
}

/// The bits of the largest of some numbers.
#[inline(always)]
fn bits_of(symbols: &[u32; RUN]) -> u32 {
    u32::BITS - symbols.iter().fold(0, |bits, symbol| bits | symbol).leading_zeros()
}

/// Bytes from which a run of any width can be read, wherever in the first of them it begins.
const WINDOW: usize = 64 + PADDING;

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

    #[inline(always)]
    fn width(&mut self) -> usize {
        self.read(WIDTH as usize).min(32) as usize
    }

    #[inline(always)]
    fn run(&mut self) -> [u32; RUN] {
        let width = self.width();
        let window = self.bytes.get(self.position / 8..).and_then(|bytes| bytes.first_chunk::<WINDOW>());
        let Some(window) = window.filter(|_| width <= MAX_WIDTH_OF_FOUR as usize) else {
            return self.symbols(width, RUN);
        };
        let mut symbols = [0; RUN];
        let mut position = self.position % 8;
        let mask = (1 << width) - 1;
        for four in symbols.as_chunks_mut::<4>().0 {
            // At most 7 + 12 * 14 bits, which the compiler does not find out.
            let at = position / 8 % 64;
            let word = window[at..].first_chunk().map_or(0, |word| u64::from_le_bytes(*word));
            let bits = word >> (position % 8);
            for (index, symbol) in four.iter_mut().enumerate() {
                *symbol = (bits >> (index * width) & mask) as u32;
            }
            position += 4 * width;
        }
        self.position += RUN * width;
        symbols
    }

    /// A run that the row's end cuts off.
    fn last_run(&mut self, length: usize) -> [u32; RUN] {
        let width = self.width();
        self.symbols(width, length)
    }

    fn symbols(&mut self, width: usize, length: usize) -> [u32; RUN] {
        let mut symbols = [0; RUN];
        symbols.iter_mut().take(length).for_each(|symbol| *symbol = self.read(width));
        symbols
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
            for width in [1, 15, 16, 17, 40, 100] {
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
                let portable = SimdLevel::Portable.run(Encode { width, rows: &rows });
                assert_eq!(coded, portable, "{form:?} {width}");
                let mut decoded_portably = vec![[7.0; 3]; rows.len()];
                let decode = Decode { width, bytes: &coded, rows: &mut decoded_portably };
                SimdLevel::Portable.run(decode);
                assert_eq!(bits(&decoded_portably), bits(&rows), "{form:?} {width}");
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

    /// The bytes of rows of RGBE, written bit by bit.
    fn bit_by_bit(width: usize, rows: &[[f32; 3]]) -> Vec<u8> {
        let code = |x: usize, y: usize, c: usize| i64::from(ordered(rows[y * width + x][c].to_bits()) >> 16);
        let mut bits = Vec::new();
        for (y, start) in (0..rows.len() / width).flat_map(|y| (0..width).step_by(RUN).map(move |x| (y, x))) {
            for c in 0..3 {
                let symbol = |x: usize| {
                    let above = |x: usize| if y == 0 { 0x3f80 } else { code(x, y - 1, c) };
                    let left = if x == 0 { above(0) } else { code(x - 1, y, c) };
                    let corner = above(x.saturating_sub(1));
                    let mut guesses = [left, above(x), left + above(x) - corner];
                    guesses.sort_unstable();
                    let difference = code(x, y, c) - guesses[1];
                    if difference < 0 { -2 * difference - 1 } else { 2 * difference }
                };
                let symbols: Vec<i64> = (start..width.min(start + RUN)).map(symbol).collect();
                let count = (0..).find(|count| symbols.iter().all(|symbol| symbol >> count == 0)).unwrap();
                bits.extend((0..WIDTH).map(|bit| count >> bit & 1 == 1));
                symbols.iter().for_each(|symbol| bits.extend((0..count).map(|bit| symbol >> bit & 1 == 1)));
            }
        }
        let byte = |bits: &[bool]| bits.iter().rev().fold(0, |byte, bit| byte << 1 | u8::from(*bit));
        let bytes = bits.chunks(8).map(byte);
        [Form::Upper as u8].into_iter().chain(bytes).chain([0; PADDING]).collect()
    }

    /// Numbers of few bits are written and read four at a time, others one by one.
    #[test]
    fn every_level_writes_what_is_written_bit_by_bit() {
        let mut state = 1_u32;
        let mut next = |most: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((u64::from(state) * u64::from(most)) >> 32) as u32
        };
        for width in [1, 16, 17, 333] {
            for most in [1, 2, 5, 40, 1000, 8000, 0x3000] {
                let value = |noise: u32| f32::from_bits((0x3f80 + noise) << 16);
                let rows: Vec<_> = (0..7 * width).map(|_| [(); 3].map(|()| value(next(most)))).collect();
                let expected = bit_by_bit(width, &rows);
                for level in [SimdLevel::detect(), SimdLevel::Portable] {
                    assert_eq!(level.run(Encode { width, rows: &rows }), expected, "{width} {most}");
                    let mut decoded = vec![[7.0; 3]; rows.len()];
                    level.run(Decode { width, bytes: &expected, rows: &mut decoded });
                    assert_eq!(bits(&decoded), bits(&rows), "{width} {most}");
                }
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
