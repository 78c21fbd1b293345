//! A texture at a sample of a surface.
//!
//! Colours are linear between the middles of texels, and between two levels of which each has half as many
//! texels along a side as the finer one, and their means in linear light. The level is log2 of the texels
//! along the longer step of the texture's coordinates to the next sample, across or down (OpenGL 4.6,
//! section 8.14), without its limits of precision. All levels have texels of 8 bits, sRGB codes.

use std::sync::LazyLock;

use brdf::{BaseColorTexture, TexturePlacement, Wrap};
use envmap::{ToneMap, box_filtered, srgb_decode, to_srgb8};
use glam::{UVec2, Vec2, Vec3};

use super::numbers;

/// The most levels of a texture.
pub const MOST_LEVELS: usize = BaseColorTexture::LONGEST_SIDE.ilog2() as usize + 1;

/// The texture's coordinates at a sample, and their steps to the next ones: derivatives by column and row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureSpot {
    /// The coordinates, (0, 0) at the upper left corner of the texture and (1, 1) at the lower right one.
    pub at: Vec2,
    /// The step to the sample on the right.
    pub across: Vec2,
    /// The step to the sample below.
    pub down: Vec2,
}

/// A texture as shaders read it.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedTexture {
    /// Red, the lowest byte, green and blue of each texel, level after level, rows from the top.
    words: Vec<u32>,
    levels: Vec<TextureLevel>,
    placement: TexturePlacement,
}

/// Where the texels of a level are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureLevel {
    /// The place of the first texel.
    pub first: u32,
    /// The width and the height in texels.
    pub size: UVec2,
}

/// The linear value of each code.
static DECODED: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| srgb_decode(code as f32 / 255.0)));

impl PackedTexture {
    /// All levels of a texture.
    pub fn new(texture: &BaseColorTexture) -> Self {
        let decode = |rgb: &[u8; 3]| rgb.map(|code| DECODED[usize::from(code)]);
        let mut packed = Self { words: Vec::new(), levels: Vec::new(), placement: *texture.placement() };
        packed.push(texture.size(), texture.texels());
        let mut size = texture.size();
        let mut linear: Vec<[f32; 3]> = texture.texels().iter().map(decode).collect();
        while size != [1, 1] {
            let coarse = size.map(|side| (side / 2).max(1));
            linear = box_filtered(size, coarse, |texel| linear[texel]);
            size = coarse;
            packed.push(size, &to_srgb8(&linear, 0.0, ToneMap::Plain));
        }
        packed
    }

    fn push(&mut self, size: [usize; 2], texels: &[[u8; 3]]) {
        let size = UVec2::from_array(size.map(|side| side as u32));
        self.levels.push(TextureLevel { first: self.words.len() as u32, size });
        self.words
            .extend(texels.iter().map(|&[red, green, blue]| u32::from_le_bytes([red, green, blue, 255])));
    }

    /// The texels of all levels: red in the lowest byte, green, blue, and 255.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The struct `TextureUniforms` of shaders, in words.
    pub fn uniforms(&self) -> Vec<u32> {
        let TexturePlacement { factor, is_nearest, wrap, .. } = self.placement;
        let [red, green, blue] = factor.map(|factor| (factor as f32).to_bits());
        let [u, v] = wrap.map(numbers::wrap);
        let head = [red, green, blue, u32::from(is_nearest), u, v, self.levels.len() as u32, 0];
        let levels = self.levels.iter().flat_map(|level| [level.first, level.size.x, level.size.y, 0]);
        let mut words: Vec<u32> = head.into_iter().chain(levels).collect();
        words.resize(head.len() + 4 * MOST_LEVELS, 0);
        words
    }

    /// This texture with only those of its levels that have at most `longest_side` texels along a side. The
    /// coarsest level stays in any case.
    #[must_use]
    pub fn within(&self, longest_side: usize) -> Self {
        let is_small = |level: &TextureLevel| level.size.max_element() as usize <= longest_side;
        let kept = self.levels.iter().position(is_small).unwrap_or(self.levels.len() - 1);
        let first = self.levels[kept].first;
        let level = |level: &TextureLevel| TextureLevel { first: level.first - first, ..*level };
        Self {
            words: self.words[first as usize..].to_vec(),
            levels: self.levels[kept..].iter().map(level).collect(),
            placement: self.placement,
        }
    }

    /// The levels, the finest first.
    pub fn levels(&self) -> &[TextureLevel] {
        &self.levels
    }

    /// How a mesh shows the texture.
    pub fn placement(&self) -> &TexturePlacement {
        &self.placement
    }
}

/// The linear colour at a sample, times the factor.
pub fn texture(texture: &PackedTexture, spot: &TextureSpot) -> Vec3 {
    let [finest, .., last] = texture.levels.as_slice() else {
        return texture.levels.first().map_or(Vec3::ZERO, |only| one_level(texture, only, spot.at, false));
    };
    let size = finest.size.as_vec2();
    let (across, down) = (spot.across * size, spot.down * size);
    let square = across.dot(across).max(down.dot(down));
    // A step that is not a number is none.
    let level = if square > 1.0 { 0.5 * math::log2(square) } else { 0.0 };
    if level == 0.0 {
        return one_level(texture, finest, spot.at, texture.placement.is_nearest);
    }
    let most = texture.levels.len() - 1;
    if level >= most as f32 {
        return one_level(texture, last, spot.at, false);
    }
    let fine = level as usize;
    let [one, other] = [fine, fine + 1].map(|k| one_level(texture, &texture.levels[k], spot.at, false));
    one + (other - one) * (level - fine as f32)
}

/// The colour of one level.
fn one_level(texture: &PackedTexture, level: &TextureLevel, at: Vec2, is_nearest: bool) -> Vec3 {
    let TexturePlacement { factor, wrap, .. } = texture.placement;
    let size = level.size;
    let texel = |column: i32, row: i32| {
        let (column, row) = (wrapped(column, size.x as i32, wrap[0]), wrapped(row, size.y as i32, wrap[1]));
        let word = texture.words[(level.first + row as u32 * size.x + column as u32) as usize];
        let [red, green, blue, _] = word.to_le_bytes().map(|code| DECODED[usize::from(code)]);
        Vec3::new(red, green, blue)
    };
    let factor = Vec3::from_array(factor.map(|factor| factor as f32));
    let place = at * size.as_vec2();
    if is_nearest {
        let first = place.floor();
        return factor * texel(first.x as i32, first.y as i32);
    }
    let place = place - 0.5;
    let first = place.floor();
    let (share, column, row) = (place - first, first.x as i32, first.y as i32);
    let above = texel(column, row) + (texel(column + 1, row) - texel(column, row)) * share.x;
    let below = texel(column, row + 1) + (texel(column + 1, row + 1) - texel(column, row + 1)) * share.x;
    factor * (above + (below - above) * share.y)
}

/// The texel of a line of so many that stands for any index.
fn wrapped(index: i32, count: i32, wrap: Wrap) -> i32 {
    match wrap {
        Wrap::Repeat => index.rem_euclid(count),
        Wrap::Mirror => {
            let twice = index.rem_euclid(2 * count);
            twice.min(2 * count - 1 - twice)
        }
        Wrap::Clamp => index.clamp(0, count - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The red of a row of texels at u, with steps to the next samples of so many texels.
    fn at(codes: &[u8], wrap: Wrap, is_nearest: bool, u: f32, texels: f32) -> f32 {
        let placement =
            TexturePlacement { wrap: [wrap; 2], is_nearest, factor: [0.5; 3], ..TexturePlacement::default() };
        let row = codes.iter().map(|code| [*code, 0, 0]).collect();
        let packed = PackedTexture::new(&BaseColorTexture::new([codes.len(), 1], row, placement).unwrap());
        let step = Vec2::new(texels / codes.len() as f32, 0.0);
        super::texture(&packed, &TextureSpot { at: Vec2::new(u, 0.3), across: step, down: Vec2::ZERO }).x
    }

    fn near(found: f32, expected: f32) {
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }

    #[test]
    fn texels_are_linear_and_repeated_mirrored_or_go_on() {
        let codes = [0, 120, 255];
        let [black, grey, white] = codes.map(|code| 0.5 * DECODED[usize::from(code)]);
        for (u, repeated, mirrored, clamped) in [
            (0.5, grey, grey, grey),
            (2.0 / 3.0, 0.5 * (grey + white), 0.5 * (grey + white), 0.5 * (grey + white)),
            (1.0, 0.5 * (white + black), white, white),
            (7.0 / 6.0, black, white, white),
            (-1.0 / 6.0, white, black, black),
            (1.5, grey, grey, white),
            (-20.5, grey, grey, black),
        ] {
            near(at(&codes, Wrap::Repeat, false, u, 0.1), repeated);
            near(at(&codes, Wrap::Mirror, false, u, 0.1), mirrored);
            near(at(&codes, Wrap::Clamp, false, u, 0.1), clamped);
        }
        for (u, expected) in [(0.01, black), (0.32, black), (0.34, grey), (0.99, white), (1.01, black)] {
            near(at(&codes, Wrap::Repeat, true, u, 1.0), expected);
        }
    }

    /// What is far away looks the same, and what is near is the mean of its texels.
    #[test]
    fn a_smaller_texture_lacks_its_finest_levels() {
        let texels = [[0; 3], [255; 3], [0; 3], [0; 3]];
        let whole = BaseColorTexture::new([4, 1], texels.to_vec(), TexturePlacement::default()).unwrap();
        let whole = PackedTexture::new(&whole);
        assert_eq!(whole.within(4), whole);
        let half = whole.within(3);
        assert_eq!((half.words(), half.levels().len()), (&whole.words()[4..], 2));
        for texels in [2.0, 3.0, 9.0] {
            let step = Vec2::new(texels / 4.0, 0.0);
            let spot = TextureSpot { at: Vec2::new(0.25, 0.5), across: step, down: Vec2::ZERO };
            assert_eq!(super::texture(&half, &spot), super::texture(&whole, &spot));
        }
        assert_eq!(whole.within(0).levels(), [TextureLevel { first: 0, size: UVec2::ONE }]);
        assert_eq!(half.uniforms()[6..16], [2, 0, 0, 2, 1, 0, 2, 1, 1, 0]);
    }

    /// Levels of 4, 2 and 1 texels; the step chooses between them by its logarithm.
    #[test]
    fn steps_choose_the_level() {
        let codes = [0, 255, 0, 0];
        let half = 0.5 * DECODED[188];
        let quarter = 0.5 * DECODED[137];
        near(at(&codes, Wrap::Repeat, false, 0.375, 1.0), 0.5);
        near(at(&codes, Wrap::Repeat, false, 0.25, 2.0), half);
        near(at(&codes, Wrap::Repeat, false, 0.25, 2.0_f32.sqrt()), 0.5 * (0.25 + half));
        near(at(&codes, Wrap::Repeat, false, 0.25, 2.0 * 2.0_f32.sqrt()), 0.5 * (half + quarter));
        for far in [4.0, 5.0, 1e30, f32::INFINITY] {
            near(at(&codes, Wrap::Repeat, true, 0.6, far), quarter);
        }
        near(at(&codes, Wrap::Repeat, false, 0.375, f32::NAN), 0.5);
        near(at(&[255], Wrap::Repeat, true, 0.6, 7.0), 0.5);
    }
}
