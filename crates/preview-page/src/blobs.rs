//! The binary parts of a page: compressed, each of them once.
//!
//! Numbers are written as differences from the one before, of the same component, and byte by byte: first the
//! highest bytes of all differences, then the next. zlib makes about half as much of that.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use base64::prelude::{BASE64_STANDARD, Engine};
use half::f16;
use miniz_oxide::deflate::compress_to_vec_zlib;
use preview::web::{WebBaseColor, WebProgram, WebTexels, WebTexture, WebTransfer, WebView};
use serde::Serialize;

/// The error in stops of texels with a common exponent, within which 99 % have to be.
const SHARED_STOPS: f32 = 0.01;

/// The bits that half floats do without: seven of ten are left, which is within 0.006 stops.
const SPARE_BITS: u16 = 3;

/// A binary part of numbers: its place, the bytes of each, and the components that take turns.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Numbers {
    blob: usize,
    words: [usize; 2],
}

/// A texture of the page.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TextureEntry {
    #[serde(flatten)]
    numbers: Numbers,
    format: &'static str,
    size: [usize; 3],
    array: bool,
    linear: bool,
}

/// The shaders of a program: the blobs of their texts, and what is defined before both.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct ProgramEntry {
    vertex: usize,
    fragment: usize,
    defines: BTreeMap<String, usize>,
    /// The blob of functions that follow the fragment shader.
    #[serde(skip_serializing_if = "Option::is_none")]
    functions: Option<usize>,
}

/// The shaders, the textures and the uniforms of a view.
#[derive(Clone, Debug, Serialize)]
pub struct ViewEntry {
    #[serde(flatten)]
    program: ProgramEntry,
    /// Whether it shows the material, and thus the texture of its base colour if there is one.
    shows_material: bool,
    #[serde(flatten)]
    read: ReadEntry,
    uniforms: BTreeMap<&'static str, f64>,
}

/// The texture of a base colour.
#[derive(Clone, Debug, Serialize)]
pub struct BaseColorEntry {
    #[serde(flatten)]
    read: ReadEntry,
    /// The texels of it that a pixel reads.
    fetches: usize,
}

/// The textures and the uniform blocks that a shader reads.
#[derive(Clone, Debug, Serialize)]
struct ReadEntry {
    textures: BTreeMap<&'static str, TextureEntry>,
    blocks: BTreeMap<&'static str, Numbers>,
}

/// The vectors of matte transfer of a part of a mesh, which its view reads besides.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TransferEntry {
    textures: BTreeMap<&'static str, TextureEntry>,
    uniforms: BTreeMap<&'static str, f64>,
}

/// All binary parts.
#[derive(Debug)]
pub struct Blobs {
    level: u8,
    packed: BTreeMap<usize, Arc<[u8]>>,
    known: HashMap<blake3::Hash, usize>,
    next: usize,
}

impl Default for Blobs {
    /// The parts of a file, which are as small as possible.
    fn default() -> Self {
        Self { level: 8, packed: BTreeMap::new(), known: HashMap::new(), next: 0 }
    }
}

impl Blobs {
    /// The parts that a server sends, which are packed quickly.
    pub(crate) fn quick() -> Self {
        Self { level: 1, ..Self::default() }
    }

    /// The place of the next part.
    pub fn next(&self) -> usize {
        self.next
    }

    /// The bytes of all parts in a page.
    pub fn bytes(&self) -> usize {
        self.since(0)
    }

    /// The bytes of the parts from one on.
    pub fn since(&self, first: usize) -> usize {
        self.packed.range(first..).map(|(_, packed)| packed.len().div_ceil(3) * 4).sum()
    }

    /// Forgets the parts from one on, whose places are then given to others.
    pub fn forget(&mut self, first: usize) {
        self.forget_for_good(first);
        self.next = first;
    }

    /// Forgets the parts from one on; no other part gets their places.
    pub(crate) fn forget_for_good(&mut self, first: usize) {
        self.packed.split_off(&first);
        self.known.retain(|_, place| *place < first);
    }

    /// A part, packed by zlib.
    pub(crate) fn packed(&self, place: usize) -> Option<Arc<[u8]>> {
        self.packed.get(&place).cloned()
    }

    /// The parts as elements of the page.
    pub(crate) fn elements(&self) -> String {
        let element = |(place, packed): (&usize, &Arc<[u8]>)| {
            let text = BASE64_STANDARD.encode(packed);
            format!("<script type=\"text/plain\" id=\"blob-{place}\">{text}</script>\n")
        };
        self.packed.iter().map(element).collect()
    }

    /// Adds bytes and returns their place.
    pub(crate) fn add(&mut self, bytes: &[u8]) -> usize {
        *self.known.entry(blake3::hash(bytes)).or_insert_with(|| {
            self.packed.insert(self.next, compress_to_vec_zlib(bytes, self.level).into());
            self.next += 1;
            self.next - 1
        })
    }

    /// Adds numbers of `WIDTH` bytes, lowest first, in `components` that take turns.
    pub(crate) fn numbers<const WIDTH: usize>(&mut self, of: &[[u8; WIDTH]], components: usize) -> Numbers {
        let mut planes = vec![0; of.len() * WIDTH];
        for (place, number) in of.iter().enumerate() {
            let before = place.checked_sub(components).map_or([0; WIDTH], |before| of[before]);
            let mut borrow = 0;
            for byte in 0..WIDTH {
                let difference = i16::from(number[byte]) - i16::from(before[byte]) - borrow;
                borrow = i16::from(difference < 0);
                let component = (WIDTH - 1 - byte) * components + place % components;
                planes[component * of.len() / components + place / components] = difference as u8;
            }
        }
        Numbers { blob: self.add(&planes), words: [WIDTH, components] }
    }

    /// Adds what a view reads, and its shaders.
    pub fn view(&mut self, view: WebView) -> ViewEntry {
        let WebView { program, shows_material, textures, blocks, uniforms, .. } = view;
        let read = self.read(textures, blocks);
        let program = self.program(program);
        ViewEntry { program, shows_material, read, uniforms: uniforms.into_iter().collect() }
    }

    /// Adds the shaders of a program.
    pub(crate) fn program(&mut self, program: WebProgram) -> ProgramEntry {
        let WebProgram { vertex, fragment, defines, functions } = program;
        let functions = (!functions.is_empty()).then(|| self.add(functions.as_bytes()));
        let [vertex, fragment] = [vertex, fragment].map(|text| self.add(text.as_bytes()));
        ProgramEntry { vertex, fragment, defines, functions }
    }

    /// Adds the texture of a base colour.
    pub fn base_color(&mut self, base_color: WebBaseColor) -> BaseColorEntry {
        let read = self.read(base_color.textures, base_color.blocks);
        BaseColorEntry { read, fetches: WebBaseColor::FETCHES }
    }

    /// Adds the vectors of a part of a mesh.
    pub(crate) fn transfer(&mut self, transfer: &WebTransfer) -> TransferEntry {
        let WebTransfer { texture, uniforms } = transfer.clone();
        let textures = BTreeMap::from([(texture.name, self.texture(texture))]);
        TransferEntry { textures, uniforms: uniforms.into_iter().collect() }
    }

    fn read(&mut self, textures: Vec<WebTexture>, blocks: Vec<(&'static str, Vec<u32>)>) -> ReadEntry {
        let textures = textures.into_iter().map(|texture| (texture.name, self.texture(texture)));
        let textures = textures.collect();
        let blocks = blocks.into_iter().map(|(name, words)| {
            let words: Vec<_> = words.into_iter().map(u32::to_le_bytes).collect();
            (name, self.numbers(&words, 4))
        });
        ReadEntry { textures, blocks: blocks.collect() }
    }

    fn texture(&mut self, texture: WebTexture) -> TextureEntry {
        let WebTexture { size, is_array, is_linear, texels, .. } = texture;
        let (format, numbers) = match texels {
            WebTexels::Words(words) => {
                let words: Vec<_> = words.into_iter().map(u32::to_le_bytes).collect();
                ("r32ui", self.numbers(&words, 1))
            }
            WebTexels::Codes(codes) => {
                let bytes: Vec<_> = codes.into_flattened().into_iter().map(|code| [code]).collect();
                ("r32ui", self.numbers(&bytes, 4))
            }
            WebTexels::Rgba(texels) => {
                let values: Vec<_> = texels.as_flattened().iter().map(|value| value.to_le_bytes()).collect();
                ("rgba32f", self.numbers(&values, 4))
            }
            WebTexels::Halves(texels) => {
                let halves = texels.as_flattened().iter().map(|value| f16::from_f32(*value).to_le_bytes());
                ("rgba16f", self.numbers(&halves.collect::<Vec<_>>(), 4))
            }
            WebTexels::Rgb(texels) => match shared_exponents(&texels) {
                Some(words) => {
                    let bytes: Vec<_> =
                        words.into_iter().flat_map(u32::to_le_bytes).map(|byte| [byte]).collect();
                    ("rgb9e5", self.numbers(&bytes, 4))
                }
                None => {
                    let halves: Vec<_> = texels.as_flattened().iter().map(|value| half(*value)).collect();
                    ("rgb16f", self.numbers(&halves, 3))
                }
            },
        };
        TextureEntry { numbers, format, size, array: is_array, linear: is_linear }
    }
}

/// A half float of seven bits, lowest byte first.
fn half(value: f32) -> [u8; 2] {
    let most = f16::MAX.to_f32();
    let bits = f16::from_f32(value.clamp(-most, most)).to_bits();
    // Rounding may carry into the exponent, but not out of the finite numbers.
    let rounded = ((bits & 0x7fff) + (1 << (SPARE_BITS - 1))).min(0x7bff) >> SPARE_BITS << SPARE_BITS;
    (rounded | bits & 0x8000).to_le_bytes()
}

/// The texels with a common exponent, `EXT_texture_shared_exponent`; `None` if one is negative or too large,
/// or if more than one in a hundred channels is off by more than [`SHARED_STOPS`], compared with a hundredth
/// of the mean.
fn shared_exponents(texels: &[[f32; 3]]) -> Option<Vec<u32>> {
    const MAX_SHARED: f32 = 65408.0;
    if texels.as_flattened().iter().any(|value| !(0.0..=MAX_SHARED).contains(value)) {
        return None;
    }
    let words: Vec<u32> = texels.iter().map(|texel| shared_exponent(*texel)).collect();
    let count = 3 * texels.len();
    let mean = texels.as_flattened().iter().map(|value| f64::from(*value)).sum::<f64>() / count.max(1) as f64;
    let dark = (0.01 * mean).max(1e-30) as f32;
    let limit = math::exp2(f64::from(SHARED_STOPS)) as f32;
    let is_off = |(value, shown): (&f32, f32)| {
        let ratio = (value + dark) / (shown + dark);
        ratio > limit || ratio < limit.recip()
    };
    let off = texels.iter().zip(&words).map(|(texel, word)| {
        texel.iter().zip(from_shared(*word)).filter(|pair| is_off((pair.0, pair.1))).count()
    });
    (off.sum::<usize>() * 100 <= count).then_some(words)
}

/// One texel: three mantissas of nine bits, red the lowest, and an exponent of five.
fn shared_exponent(texel: [f32; 3]) -> u32 {
    let most = texel.iter().copied().fold(0.0_f32, f32::max);
    if most < power_of_two(-25) {
        return 0;
    }
    // The exponent of the largest channel, from its bits: 2^(e - 1) <= most < 2^e.
    let bits = (most.to_bits() >> 23) as i32 - 126;
    let mut exponent = (bits + 15).max(0);
    let step = |exponent: i32| power_of_two(exponent - 24);
    if (most / step(exponent)).round() > 511.0 {
        exponent += 1;
    }
    let mantissa = |value: f32| (value / step(exponent)).round() as u32;
    let [r, g, b] = texel.map(mantissa);
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

/// 2 to a power of -126 to 127.
fn power_of_two(power: i32) -> f32 {
    f32::from_bits(((power + 127) as u32) << 23)
}

fn from_shared(word: u32) -> [f32; 3] {
    let step = power_of_two((word >> 27) as i32 - 24);
    [word & 511, word >> 9 & 511, word >> 18 & 511].map(|mantissa| mantissa as f32 * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_common_exponent_is_within_half_a_step_of_the_largest_channel() {
        for texel in
            [[0.0; 3], [1.0, 0.5, 0.25], [65408.0, 1.0, 0.0], [1e-7, 3e-6, 0.0], [0.9999, 511.4, 511.6]]
        {
            let found = from_shared(shared_exponent(texel));
            let most = texel.iter().copied().fold(0.0, f32::max);
            for (found, value) in found.into_iter().zip(texel) {
                assert!((found - value).abs() <= most / 510.0 + power_of_two(-25), "{texel:?}: {found}");
            }
        }
    }

    #[test]
    fn colours_that_lose_too_much_are_halves() {
        let even: Vec<_> = (1..2000).map(|k| [k as f32, 0.5 * k as f32, 0.8 * k as f32]).collect();
        assert!(shared_exponents(&even).is_some());
        assert!(shared_exponents(&[[1.0, -0.1, 0.0]]).is_none());
        let saturated: Vec<_> = (1..2000).map(|k| [1000.0, 8.0 + 0.001 * k as f32, 20.0]).collect();
        assert!(shared_exponents(&saturated).is_none());
    }

    /// What the page's script does: the sums of differences.
    fn restored(planes: &[u8], [width, components]: [usize; 2]) -> Vec<u32> {
        let count = planes.len() / width;
        let mut values = vec![0_u32; count];
        for place in 0..count {
            let byte = |k: usize| {
                let component = (width - 1 - k) * components + place % components;
                u32::from(planes[component * count / components + place / components]) << (8 * k)
            };
            let before = place.checked_sub(components).map_or(0, |before| values[before]);
            let mask = u32::MAX >> (32 - 8 * width);
            values[place] = before.wrapping_add((0..width).map(byte).sum()) & mask;
        }
        values
    }

    #[test]
    fn numbers_are_restored_from_their_differences() {
        let mut blobs = Blobs::default();
        let words: Vec<u32> = (0..300_u32).map(|k| k.wrapping_mul(2_654_435_761)).collect();
        let written = |blobs: &Blobs| {
            miniz_oxide::inflate::decompress_to_vec_zlib(blobs.packed.values().last().unwrap()).unwrap()
        };
        for components in [1, 3, 4] {
            let bytes: Vec<_> = words.iter().map(|word| word.to_le_bytes()).collect();
            let Numbers { words: shape, .. } = blobs.numbers(&bytes, components);
            assert_eq!(restored(&written(&blobs), shape), words);
            let halves: Vec<_> = words.iter().map(|word| (*word as u16).to_le_bytes()).collect();
            let Numbers { words: shape, .. } = blobs.numbers(&halves, components);
            let expected: Vec<_> = words.iter().map(|word| u32::from(*word as u16)).collect();
            assert_eq!(restored(&written(&blobs), shape), expected);
        }
    }

    #[test]
    fn halves_keep_seven_bits() {
        for value in [0.0, 1.0, -0.3, 1e-3, 12345.6, 65504.0, -1e9, 3e-6] {
            let found = f16::from_le_bytes(half(value)).to_f32();
            let expected = value.clamp(-65504.0, 65504.0);
            assert!((found - expected).abs() <= expected.abs() / 255.0 + 1e-6, "{value}: {found}");
        }
    }

    #[test]
    fn the_same_bytes_are_kept_once() {
        let mut blobs = Blobs::default();
        assert_eq!([blobs.add(b"sky"), blobs.add(b"gold"), blobs.add(b"sky")], [0, 1, 0]);
        blobs.forget(1);
        assert_eq!((blobs.next(), blobs.add(b"gold")), (1, 1));
        blobs.forget_for_good(1);
        assert_eq!((blobs.packed(1), blobs.add(b"gold")), (None, 2), "a place is not given twice");
        assert!(blobs.elements().starts_with("<script type=\"text/plain\" id=\"blob-0\">"));
    }
}
