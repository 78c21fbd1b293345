//! How a texel of a texture is stored: the formats, and packing and unpacking them.

use half::f16;
use rayon::prelude::*;

use super::bc6h;
use crate::images::srgb_to_linear;
use crate::precision::{Precision, to_half};
use crate::rounding;

/// The stored numbers of a texture. Those that are not in [`TexelFormat::ALL`] are read and not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TexelFormat {
    /// Four halves, the last 1.
    Rgba16F,
    /// Four floats, the last 1.
    Rgba32F,
    /// Two halves: red and green.
    Rg16F,
    /// Three mantissas of 9 bits with an exponent of 5 bits together: nothing negative.
    Rgb9E5,
    /// Two floats of 11 bits and one of 10, without a sign.
    R11G11B10F,
    /// Blocks of 4 x 4 texels in 16 bytes (BC6H, unsigned): nothing negative.
    Bc6h,
    /// Blocks of 4 x 4 texels in 16 bytes (BC6H, signed).
    Bc6hSigned,
    /// Three halves.
    Rgb16F,
    /// Three floats.
    Rgb32F,
    /// A byte of red, whose 255 stands for 1.
    R8,
    /// Bytes, whose 255 stands for 1.
    Bytes(ByteFormat),
}

/// How colours are stored in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ByteFormat {
    /// The number of channels of a texel: three, or four with an alpha.
    pub channels: usize,
    /// Whether blue is the first.
    pub is_bgr: bool,
    /// Whether the bytes are sRGB's codes, or else linear.
    pub is_srgb: bool,
}

/// What a number becomes that a format does not hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Rounding {
    /// One of the two that enclose it, so that tiles of 8 x 8 texels keep their light; a block of BC6H passes
    /// on to the next what it loses. An integral over the texture does not change.
    #[default]
    KeepLight,
    /// The nearest. BC6H has the nearest texels in logarithms that its blocks allow. A look-up at one place
    /// errs least.
    Nearest,
}

/// How the texels of a file are stored: a format, and how numbers become those of the format.
///
/// A [`TexelFormat`] or a [`Precision`] stands for itself with [`Rounding::KeepLight`]. Halves are rounded to
/// the nearest in any case.
///
/// # Example: the nearest number is stored, although the tile of texels gets darker
/// ```
/// use containers::{TexelFormat, Texture, read_ktx2, write_ktx2};
/// // Steps of 1/256 below 2, and of 1/128 for all channels if one is 2.
/// let pixels = vec![[2.0, 1.0, 1.003]; 64];
/// let texture = Texture { width: 8, height: 8, pixels, ..Texture::default() };
/// let file = write_ktx2(&texture, TexelFormat::Rgb9E5.nearest(), None, &[])?;
/// assert!(read_ktx2(&file.bytes)?.pixels.iter().all(|texel| *texel == [2.0, 1.0, 1.0]));
/// # Ok::<(), containers::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TexelEncoding {
    /// The stored numbers.
    pub format: TexelFormat,
    /// What a number becomes that the format does not hold.
    pub rounding: Rounding,
}

impl From<TexelFormat> for TexelEncoding {
    fn from(format: TexelFormat) -> Self {
        Self { format, rounding: Rounding::KeepLight }
    }
}

impl From<Precision> for TexelEncoding {
    fn from(precision: Precision) -> Self {
        TexelFormat::from(precision).into()
    }
}

impl TexelFormat {
    /// Every format that is written.
    pub const ALL: [Self; 6] =
        [Self::Rgba16F, Self::Rgba32F, Self::Rg16F, Self::Rgb9E5, Self::R11G11B10F, Self::Bc6h];

    /// The name that people call the format by.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rgba16F => "RGBA16F",
            Self::Rgba32F => "RGBA32F",
            Self::Rg16F => "RG16F",
            Self::Rgb9E5 => "RGB9E5",
            Self::R11G11B10F => "R11G11B10F",
            Self::Bc6h => "BC6H",
            Self::Bc6hSigned => "signed BC6H",
            Self::Rgb16F => "RGB16F",
            Self::Rgb32F => "RGB32F",
            Self::R8 => "R8",
            Self::Bytes(ByteFormat { is_srgb: true, .. }) => "8 bits, sRGB",
            Self::Bytes(_) => "8 bits, linear",
        }
    }

    /// The formats that are read and not written.
    fn only_read() -> impl Iterator<Item = Self> {
        let bytes = [3, 4].into_iter().flat_map(|channels| {
            [false, true].into_iter().flat_map(move |is_bgr| {
                [false, true].map(|is_srgb| Self::Bytes(ByteFormat { channels, is_bgr, is_srgb }))
            })
        });
        [Self::Bc6hSigned, Self::Rgb16F, Self::Rgb32F, Self::R8].into_iter().chain(bytes)
    }

    /// Every format that is read.
    pub(crate) fn read() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().chain(Self::only_read())
    }

    /// The format with each number rounded to the nearest.
    pub fn nearest(self) -> TexelEncoding {
        TexelEncoding { format: self, rounding: Rounding::Nearest }
    }

    /// Whether the format holds light brighter than its white.
    pub fn is_high_dynamic_range(self) -> bool {
        !matches!(self, Self::Bytes(_) | Self::R8)
    }

    /// The largest number that the format holds.
    pub fn largest(self) -> f32 {
        match self {
            Self::Rgba32F | Self::Rgb32F => f32::MAX,
            Self::Bytes(_) | Self::R8 => 1.0,
            // The exponent 31 is of infinity; BC6H interpolates halves.
            Self::Rgba16F | Self::Rg16F | Self::Rgb16F | Self::Bc6h | Self::Bc6hSigned => 65504.0,
            Self::Rgb9E5 => 65408.0,
            // Of the channel with 5 bits of mantissa, so that all three end together.
            Self::R11G11B10F => 64512.0,
        }
    }

    /// Whether the format holds negative numbers.
    pub fn is_signed(self) -> bool {
        !matches!(self, Self::Rgb9E5 | Self::R11G11B10F | Self::Bc6h | Self::Bytes(_) | Self::R8)
    }

    /// The format's VkFormat.
    pub(crate) fn vulkan(self) -> u32 {
        match self {
            Self::Rgba16F => 97,
            Self::Rgba32F => 109,
            Self::Rg16F => 83,
            Self::Rgb9E5 => 123,
            Self::R11G11B10F => 122,
            Self::Bc6h => 143,
            Self::Bc6hSigned => 144,
            Self::Rgb16F => 90,
            Self::Rgb32F => 106,
            Self::R8 => 9,
            Self::Bytes(ByteFormat { channels, is_bgr, is_srgb }) => {
                let first = match (channels, is_bgr) {
                    (3, false) => 23,
                    (3, true) => 30,
                    (_, false) => 37,
                    (_, true) => 44,
                };
                if is_srgb { first + 6 } else { first }
            }
        }
    }

    /// The format's DXGI_FORMAT; 0 if there is none.
    pub(crate) fn dxgi(self) -> u32 {
        match self {
            Self::Rgba16F => 10,
            Self::Rgba32F => 2,
            Self::Rg16F => 34,
            Self::Rgb9E5 => 67,
            Self::R11G11B10F => 26,
            Self::Bc6h => 95,
            Self::Bc6hSigned => 96,
            Self::Rgb32F => 6,
            Self::R8 => 61,
            Self::Bytes(ByteFormat { channels: 4, is_bgr, is_srgb: true }) => {
                if is_bgr {
                    91
                } else {
                    29
                }
            }
            Self::Rgb16F | Self::Bytes(_) => 0,
        }
    }

    /// The formats with their numbers, for messages.
    pub(crate) fn listed(number: fn(Self) -> u32) -> String {
        let formats = Self::read().filter(|format| number(*format) != 0);
        let names: Vec<_> = formats.map(|format| format!("{} ({})", number(format), format.name())).collect();
        names.join(", ")
    }

    /// The bytes of a block, and the texels along its edge.
    pub(crate) fn block(self) -> (usize, usize) {
        match self {
            Self::Rgba16F => (8, 1),
            Self::Rgba32F => (16, 1),
            Self::Rg16F | Self::Rgb9E5 | Self::R11G11B10F => (4, 1),
            Self::Bc6h | Self::Bc6hSigned => (16, bc6h::EDGE),
            Self::Rgb16F => (6, 1),
            Self::Rgb32F => (12, 1),
            Self::R8 => (1, 1),
            Self::Bytes(ByteFormat { channels, .. }) => (channels, 1),
        }
    }

    /// The bytes of an image; `None` if they overflow.
    pub(crate) fn image_bytes(self, width: usize, height: usize) -> Option<usize> {
        let (bytes, edge) = self.block();
        width.div_ceil(edge).checked_mul(height.div_ceil(edge))?.checked_mul(bytes)
    }

    /// Images of `width` x `height` texels, one after the other, as they are stored in a format that is
    /// written.
    pub(crate) fn pack(self, rounding: Rounding, width: usize, height: usize, texels: &[[f32; 3]]) -> Packed {
        let negative = match self.is_signed() {
            true => 0,
            false => texels.par_iter().flatten().filter(|value| **value < 0.0).count(),
        };
        let words = |around: fn(&[f32; 3]) -> Enclosing| -> Vec<u8> {
            if rounding == Rounding::Nearest {
                let word = |texel: &[f32; 3]| {
                    let around = around(texel);
                    // NaN is 0 by `max`.
                    let held = texel.map(|value| value.max(0.0).min(self.largest()));
                    around.word(around.nearer(held)).to_le_bytes()
                };
                return texels.par_iter().map(word).collect::<Vec<_>>().into_flattened();
            }
            let upper = rounding::upper(width, height, texels, |texel| around(texel).values());
            let word = |(texel, upper): (&[f32; 3], [bool; 3])| around(texel).word(upper).to_le_bytes();
            texels.par_iter().zip(upper).map(word).collect::<Vec<_>>().into_flattened()
        };
        let half = |value: f32| u32::from(to_half(value).to_bits());
        let bytes = match self {
            Self::Rgba16F => {
                let texel =
                    |[r, g, b]: &[f32; 3]| [*r, *g, *b, 1.0].map(|value| to_half(value).to_le_bytes());
                texels.par_iter().map(texel).collect::<Vec<_>>().into_flattened().into_flattened()
            }
            Self::Rgba32F => {
                let texel = |[r, g, b]: &[f32; 3]| [*r, *g, *b, 1.0].map(f32::to_le_bytes);
                texels.par_iter().map(texel).collect::<Vec<_>>().into_flattened().into_flattened()
            }
            Self::Rg16F => texels
                .par_iter()
                .map(|[r, g, _]| (half(*r) | half(*g) << 16).to_le_bytes())
                .collect::<Vec<_>>()
                .into_flattened(),
            Self::Rgb9E5 => words(shared_exponent),
            Self::R11G11B10F => words(packed_floats),
            Self::Bc6h => match rounding {
                Rounding::KeepLight => bc6h::encode(width, height, texels),
                Rounding::Nearest => bc6h::encode_nearest(width, height, texels),
            },
            Self::Bc6hSigned | Self::Rgb16F | Self::Rgb32F | Self::R8 | Self::Bytes(_) => Vec::new(),
        };
        Packed { bytes, negative }
    }

    /// The colours of images of `width` x `height` texels, whose bytes are complete; an alpha is ignored, and
    /// channels that the format lacks are 0.
    pub(crate) fn unpack(self, width: usize, height: usize, bytes: &[u8]) -> Vec<[f32; 3]> {
        let half = |bytes: &[u8]| f16::from_le_bytes([bytes[0], bytes[1]]).to_f32();
        let float = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        let word = |bytes: &[u8]| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        let texels = bytes.par_chunks_exact(self.block().0);
        match self {
            Self::Rgba16F => texels.map(|b| [half(b), half(&b[2..]), half(&b[4..])]).collect(),
            Self::Rgba32F => texels.map(|b| [float(b), float(&b[4..]), float(&b[8..])]).collect(),
            Self::Rg16F => texels.map(|b| [half(b), half(&b[2..]), 0.0]).collect(),
            Self::Rgb9E5 => texels.map(|b| of_shared_exponent(word(b))).collect(),
            Self::R11G11B10F => texels.map(|b| of_packed_floats(word(b))).collect(),
            Self::Bc6h | Self::Bc6hSigned => bc6h::decode(width, height, bytes, self == Self::Bc6hSigned),
            Self::Rgb16F => texels.map(|b| [half(b), half(&b[2..]), half(&b[4..])]).collect(),
            Self::Rgb32F => texels.map(|b| [float(b), float(&b[4..]), float(&b[8..])]).collect(),
            Self::R8 => texels.map(|b| [f32::from(b[0]) / 255.0, 0.0, 0.0]).collect(),
            Self::Bytes(ByteFormat { is_bgr, is_srgb, .. }) => {
                let value = |code: u8| {
                    let value = f64::from(code) / 255.0;
                    (if is_srgb { srgb_to_linear(value) } else { value }) as f32
                };
                let values: Vec<f32> = (0..=u8::MAX).map(value).collect();
                let [r, b] = if is_bgr { [2, 0] } else { [0, 2] };
                texels.map(|texel| [r, 1, b].map(|channel| values[usize::from(texel[channel])])).collect()
            }
        }
    }
}

/// The name of a VkFormat that is not read, if it is one that others often write.
pub(crate) fn foreign_vulkan(number: u32) -> Option<&'static str> {
    Some(match number {
        0 => "Basis Universal (UASTC or ETC1S)",
        131..=142 => "BC1 to BC5",
        145 | 146 => "BC7",
        147..=156 => "ETC2 or EAC",
        157..=184 | 1_000_066_000..=1_000_066_013 => "ASTC",
        _ => return None,
    })
}

/// The name of a DXGI_FORMAT that is not read, if it is one that others often write.
pub(crate) fn foreign_dxgi(number: u32) -> Option<&'static str> {
    Some(match number {
        70..=84 => "BC1 to BC5",
        97..=99 => "BC7",
        _ => return None,
    })
}

impl From<Precision> for TexelFormat {
    fn from(precision: Precision) -> Self {
        match precision {
            Precision::Half => Self::Rgba16F,
            Precision::Float => Self::Rgba32F,
        }
    }
}

/// Stored texels, and how many numbers lost their sign.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Packed {
    pub(crate) bytes: Vec<u8>,
    /// Negative numbers that became 0.
    pub(crate) negative: usize,
}

/// The codes that enclose a texel's numbers in a format of 4 bytes, and the number of a code.
struct Enclosing {
    codes: [[u32; 2]; 3],
    /// Where the code of each channel begins.
    shifts: [u32; 3],
    /// The bits that all channels share.
    rest: u32,
    value: fn(&Self, usize, u32) -> f64,
}

impl Enclosing {
    fn values(&self) -> [[f64; 2]; 3] {
        [0, 1, 2].map(|channel| self.codes[channel].map(|code| (self.value)(self, channel, code)))
    }

    /// Whether each number is nearer to the upper of its two codes.
    fn nearer(&self, texel: [f32; 3]) -> [bool; 3] {
        let values = self.values();
        [0, 1, 2].map(|channel| {
            let [low, high] = values[channel];
            let value = f64::from(texel[channel]);
            high - value < value - low
        })
    }

    fn word(&self, upper: [bool; 3]) -> u32 {
        (0..3).fold(self.rest, |word, channel| {
            word | self.codes[channel][usize::from(upper[channel])] << self.shifts[channel]
        })
    }
}

/// RGB9E5 (EXT_texture_shared_exponent): red in the lowest 9 bits, the exponent in the highest 5.
fn shared_exponent(texel: &[f32; 3]) -> Enclosing {
    const BIAS: i32 = 15;
    const MANTISSA: i32 = 9;
    // NaN is 0 by `max`.
    let rgb = texel.map(|value| f64::from(value.max(0.0).min(TexelFormat::Rgb9E5.largest())));
    let largest = rgb.iter().fold(0.0_f64, |a, b| a.max(*b));
    // The exponent of 2^-(BIAS + 1) is stored as 0.
    let floor = if largest > 0.0 { exponent(largest) } else { i32::MIN };
    let shared = floor.max(-BIAS - 1) + 1 + BIAS;
    let scaled = |shared: i32| rgb.map(|value| value * power(BIAS + MANTISSA - shared));
    // What rounds up to 1 takes the next exponent.
    let shared = if scaled(shared).iter().any(|value| *value >= 511.5) { shared + 1 } else { shared };
    Enclosing {
        codes: scaled(shared).map(|value| [value as u32, (value as u32 + 1).min(511)]),
        shifts: [0, 9, 18],
        rest: (shared as u32) << 27,
        value: |of, _, code| f64::from(code) * power((of.rest >> 27) as i32 - 24),
    }
}

fn of_shared_exponent(word: u32) -> [f32; 3] {
    let scale = power((word >> 27) as i32 - 24) as f32;
    [word, word >> 9, word >> 18].map(|bits| (bits & 511) as f32 * scale)
}

/// R11G11B10F: red in the lowest 11 bits.
fn packed_floats(texel: &[f32; 3]) -> Enclosing {
    const MANTISSAS: [i32; 3] = [6, 6, 5];
    let rgb = texel.map(|value| f64::from(value.max(0.0).min(TexelFormat::R11G11B10F.largest())));
    let codes = |channel: usize| {
        let code = unsigned_float(rgb[channel], MANTISSAS[channel]);
        [code, (code + 1).min((31 << MANTISSAS[channel]) - 1)]
    };
    Enclosing {
        codes: [0, 1, 2].map(codes),
        shifts: [0, 11, 22],
        rest: 0,
        value: |_, channel, code| f64::from(of_unsigned_float(code, MANTISSAS[channel])),
    }
}

fn of_packed_floats(word: u32) -> [f32; 3] {
    [
        of_unsigned_float(word & 0x7ff, 6),
        of_unsigned_float(word >> 11 & 0x7ff, 6),
        of_unsigned_float(word >> 22, 5),
    ]
}

/// The float with 5 bits of exponent and `mantissa` bits that is next below a value.
fn unsigned_float(value: f64, mantissa: i32) -> u32 {
    if value < power(-14) {
        return (value * power(14 + mantissa)) as u32;
    }
    let exponent = exponent(value);
    let fraction = (value * power(mantissa - exponent)) as i32 - (1 << mantissa);
    (((exponent + 15) << mantissa) + fraction) as u32
}

fn of_unsigned_float(code: u32, mantissa: i32) -> f32 {
    let (exponent, fraction) = (code >> mantissa, code & ((1 << mantissa) - 1));
    match (exponent, fraction) {
        (31, 0) => f32::INFINITY,
        (31, _) => f32::NAN,
        (0, _) => fraction as f32 * power(-14 - mantissa) as f32,
        _ => ((1 << mantissa) + fraction) as f32 * power(exponent as i32 - 15 - mantissa) as f32,
    }
}

/// floor(log2(value)) of a positive, normal number.
fn exponent(value: f64) -> i32 {
    ((value.to_bits() >> 52) & 0x7ff) as i32 - 1023
}

/// 2^exponent, for the exponents of floats.
fn power(exponent: i32) -> f64 {
    math::exp2(f64::from(exponent))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One texel, packed and unpacked.
    fn through(format: TexelFormat, texel: [f32; 3]) -> [f32; 3] {
        format.unpack(1, 1, &format.pack(Rounding::KeepLight, 1, 1, &[texel]).bytes)[0]
    }

    /// Every code comes back, and a number goes to the nearest code.
    #[test]
    fn every_unsigned_float_comes_back() {
        for (channel, mantissa) in [(2, 5), (0, 6)] {
            for code in 0..31 << mantissa {
                let value = of_unsigned_float(code, mantissa);
                assert_eq!(unsigned_float(f64::from(value), mantissa), code);
                let next = of_unsigned_float(code + 1, mantissa);
                // Past 64512 blue has no number, and red and green are not to have one either.
                if value < 64512.0 && next.is_finite() {
                    let found = |share: f32| {
                        let value = (1.0 - share) * value + share * next;
                        through(TexelFormat::R11G11B10F, [value; 3])[channel]
                    };
                    assert_eq!((found(0.49), found(0.51)), (value, next));
                }
            }
        }
    }

    #[test]
    fn a_shared_exponent_is_within_half_a_step() {
        let through = |texel| through(TexelFormat::Rgb9E5, texel);
        for step in 0..50_000_u32 {
            let value = |k: u32| (f64::from(step.wrapping_mul(k) % 65_537) / 2048.0 - 16.0).exp2() as f32;
            let texel = [value(7), value(31), value(127)];
            let largest = texel.iter().fold(0.0_f32, |a, b| a.max(*b));
            let found = through(texel);
            let step = f64::from(largest) / 256.0 + power(-24);
            for (found, given) in found.iter().zip(texel) {
                let clamped = given.min(65408.0);
                assert!(f64::from((found - clamped).abs()) <= 0.5001 * step, "{texel:?} became {found:?}");
            }
        }
        assert_eq!(through([1.0, 0.5, 2.0]), [1.0, 0.5, 2.0]);
        assert_eq!(through([-1.0, 1e9, f32::NAN]), [0.0, 65408.0, 0.0]);
        assert_eq!(through([0.0; 3]), [0.0; 3]);
        // 511.75 / 512 rounds up to 1, which takes the next exponent.
        assert_eq!(through([511.75 / 512.0; 3]), [1.0; 3]);
    }

    /// Texels of many tints beside each other, and the largest numbers, of which none passes into infinity.
    #[test]
    fn nearest_is_within_half_a_step_for_every_texel_of_an_image() {
        let noise = |k: u32| f64::from(k.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
        let number = |k: u32| ((40.0 * noise(k)) - 22.0).exp2() as f32;
        let tinted = (0..64 * 64).map(|texel| [3 * texel, 3 * texel + 1, 3 * texel + 2].map(number));
        let ends = [[65408.0, 65280.0, 1.0], [65407.9, 65472.0, 1e9], [f32::INFINITY, 0.0, 40_000.0]];
        let texels: Vec<[f32; 3]> = tinted.chain(ends.into_iter().cycle().take(64)).collect();
        let pack = |format: TexelFormat| format.pack(Rounding::Nearest, 64, 65, &texels).bytes;
        let found = TexelFormat::Rgb9E5.unpack(64, 65, &pack(TexelFormat::Rgb9E5));
        for (found, texel) in found.iter().zip(&texels) {
            let given = texel.map(|value| f64::from(value.min(65408.0)));
            let largest = given.iter().fold(0.0_f64, |a, b| a.max(*b));
            // The exponent for which the largest mantissa rounds to 511 at most.
            let step = (0..32).map(|shared| power(shared - 24)).find(|step| largest / step < 511.5);
            for (found, given) in found.iter().zip(given) {
                let error = (f64::from(*found) - given).abs();
                assert!(error <= 0.5 * step.unwrap(), "{texel:?}: {found}");
            }
        }
        let found = TexelFormat::R11G11B10F.unpack(64, 65, &pack(TexelFormat::R11G11B10F));
        for (found, texel) in found.iter().zip(&texels) {
            for (channel, mantissa) in [(0, 6), (1, 6), (2, 5)] {
                let given = f64::from(texel[channel].min(64512.0));
                let step = power(exponent(given.max(power(-14))) - mantissa);
                let error = (f64::from(found[channel]) - given).abs();
                assert!(error <= 0.5 * step, "{texel:?}: {found:?}");
            }
        }
    }

    #[test]
    fn negative_numbers_are_counted_if_the_format_has_no_sign() {
        let texels = [[-1.0, 1e6, 0.5], [0.25, -0.5, 70000.0]];
        let negative = |format: TexelFormat| format.pack(Rounding::KeepLight, 2, 1, &texels).negative;
        for format in TexelFormat::ALL {
            assert_eq!(negative(format), if format.is_signed() { 0 } else { 2 }, "{format:?}");
        }
    }
}
