//! Pictures on surfaces: texels in linear light, their means over squares, and look-ups of the size of what a
//! path sees.

use brdf::Wrap;
use rayon::prelude::*;

use crate::random::hash_words;

/// A picture of a scene: linear RGB and alpha, row by row from the top, 65535 for 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    size: [usize; 2],
    texels: Vec<[u16; 4]>,
}

/// How a material reads a texture. The coordinates of triangles are those of the texture, transforms applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureUse {
    /// The texture, by its place in the scene.
    pub texture: u32,
    /// How coordinates outside of 0 to 1 are read along u and v.
    pub wrap: [Wrap; 2],
    /// Whether enlarged texels are squares of one colour. Otherwise colours are linear between their middles.
    pub is_nearest: bool,
}

impl Texture {
    /// The most texels along a side: a path sees much more of a surface than a texel of a larger picture.
    pub const LONGEST_SIDE: usize = 1024;

    /// A texture; `None` if it has no texels, or not as many as its size says.
    pub fn new(size: [usize; 2], texels: Vec<[u16; 4]>) -> Option<Self> {
        let count = size[0].checked_mul(size[1])?;
        (count > 0 && count == texels.len()).then_some(Self { size, texels })
    }

    /// The number of columns and of rows.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The texels, row by row from the top.
    pub fn texels(&self) -> &[[u16; 4]] {
        &self.texels
    }

    /// A hash of the texels.
    pub(crate) fn digest(&self) -> u64 {
        let word = |&[red, green, blue, alpha]: &[u16; 4]| {
            [green, blue, alpha].iter().fold(u64::from(red), |word, code| word << 16 | u64::from(*code))
        };
        let size = self.size.map(|side| side as u64);
        hash_words(0, size.into_iter().chain(self.texels.iter().map(word)))
    }

    /// Whether red, green and blue are the same in every texel.
    pub fn is_grey(&self) -> bool {
        self.texels.iter().all(|[red, green, blue, _]| red == green && green == blue)
    }
}

/// A texture and its halves: each texel of a level is the mean of up to four of the level before.
pub(crate) struct Levels {
    levels: Vec<Level>,
}

struct Level {
    size: [usize; 2],
    texels: Vec<[f32; 4]>,
}

impl Levels {
    pub(crate) fn all_of(textures: &[Texture]) -> Vec<Self> {
        textures.par_iter().map(Self::of).collect()
    }

    fn of(texture: &Texture) -> Self {
        let linear = |texel: &[u16; 4]| texel.map(|code| f32::from(code) / 65535.0);
        let first = Level { size: texture.size, texels: texture.texels.iter().map(linear).collect() };
        let mut levels = vec![first];
        while let Some(half) = levels.last().and_then(Level::half) {
            levels.push(half);
        }
        Self { levels }
    }

    /// How many texels the finest level has.
    pub(crate) fn texels(&self) -> f32 {
        (self.levels[0].size[0] * self.levels[0].size[1]) as f32
    }

    /// The colour and alpha at coordinates, averaged over about `texels` texels of the finest level.
    pub(crate) fn at(&self, coordinates: [f32; 2], texels: f32, how: &TextureUse) -> [f32; 4] {
        let place = coordinates.map(|x| if x.is_finite() { x.clamp(-1e6, 1e6) } else { 0.0 });
        if texels.is_nan() || texels <= 1.0 {
            return self.levels[0].at(place, how.wrap, how.is_nearest);
        }
        let last = self.levels.len() - 1;
        let level = (0.5 * math::log2(texels)).min(last as f32);
        let (fine, share) = (level as usize, level - level.floor());
        let one = self.levels[fine].at(place, how.wrap, how.is_nearest && fine == 0);
        if fine == last {
            return one;
        }
        let other = self.levels[fine + 1].at(place, how.wrap, false);
        [0, 1, 2, 3].map(|channel| one[channel] + (other[channel] - one[channel]) * share)
    }
}

impl Level {
    /// The level of half the size; `None` after one texel.
    fn half(&self) -> Option<Self> {
        let [width, height] = self.size;
        let size = [width.div_ceil(2), height.div_ceil(2)];
        if size == self.size {
            return None;
        }
        let mut texels = Vec::with_capacity(size[0] * size[1]);
        for row in 0..size[1] {
            for column in 0..size[0] {
                let (mut sum, mut count) = ([0.0; 4], 0.0);
                for y in 2 * row..(2 * row + 2).min(height) {
                    for x in 2 * column..(2 * column + 2).min(width) {
                        let texel = self.texels[y * width + x];
                        sum.iter_mut().zip(texel).for_each(|(sum, value)| *sum += value);
                        count += 1.0;
                    }
                }
                texels.push(sum.map(|sum: f32| sum / count));
            }
        }
        Some(Self { size, texels })
    }

    fn at(&self, coordinates: [f32; 2], wrap: [Wrap; 2], is_nearest: bool) -> [f32; 4] {
        let [width, _] = self.size;
        if is_nearest {
            let [x, y] = [0, 1].map(|axis| {
                let at = f64::from(coordinates[axis]) * self.size[axis] as f64;
                inside(at.floor(), self.size[axis], wrap[axis])
            });
            return self.texels[y * width + x];
        }
        let between = |axis: usize| {
            let at = f64::from(coordinates[axis]) * self.size[axis] as f64 - 0.5;
            let first = at.floor();
            let place = |k: f64| inside(k, self.size[axis], wrap[axis]);
            (place(first), place(first + 1.0), (at - first) as f32)
        };
        let ((left, right, to_right), (top, bottom, to_bottom)) = (between(0), between(1));
        let mut sum = [0.0; 4];
        for (row, weight_v) in [(top, 1.0 - to_bottom), (bottom, to_bottom)] {
            for (column, weight_u) in [(left, 1.0 - to_right), (right, to_right)] {
                let texel = &self.texels[row * width + column];
                sum.iter_mut().zip(texel).for_each(|(sum, value)| *sum += weight_u * weight_v * value);
            }
        }
        sum
    }
}

/// The texel of a row of `size` texels that stands for the k-th of an endless row.
fn inside(k: f64, size: usize, wrap: Wrap) -> usize {
    let n = size as f64;
    let k = match wrap {
        Wrap::Repeat => k.rem_euclid(n),
        Wrap::Mirror => {
            let twice = k.rem_euclid(2.0 * n);
            if twice < n { twice } else { 2.0 * n - 1.0 - twice }
        }
        Wrap::Clamp => k,
    };
    k.clamp(0.0, n - 1.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn levels(size: [usize; 2], code: impl Fn(usize) -> u16) -> Levels {
        let texels = (0..size[0] * size[1]).map(|k| [code(k); 4]).collect();
        Levels::of(&Texture::new(size, texels).unwrap())
    }

    #[test]
    fn a_wide_look_is_the_mean() {
        let board = levels([8, 8], |k| if (k + k / 8) % 2 == 0 { 65535 } else { 0 });
        let how = TextureUse { texture: 0, wrap: [Wrap::Repeat; 2], is_nearest: true };
        assert_eq!(board.at([0.0, 0.0], 0.0, &how)[0], 1.0);
        assert_eq!(board.at([0.13, 0.0], 1.0, &how)[0], 0.0);
        for texels in [4.0, 16.0, 64.0, 1e9, f32::INFINITY] {
            assert!((board.at([0.3, 0.7], texels, &how)[0] - 0.5).abs() < 1e-6, "{texels}");
        }
        assert!(board.at([f32::NAN, 1e30], f32::NAN, &how)[3].is_finite());
    }

    #[test]
    fn texels_are_repeated_mirrored_or_go_on() {
        let row = levels([4, 1], |k| [0, 13107, 26214, 65535][k]);
        let at = |u: f32, wrap: Wrap| {
            row.at([u, 0.0], 0.0, &TextureUse { texture: 0, wrap: [wrap; 2], is_nearest: true })[0]
        };
        for (u, repeated, mirrored, clamped) in [(1.1, 0.0, 1.0, 1.0), (-0.1, 1.0, 0.0, 0.0)] {
            let found = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].map(|wrap| at(u, wrap));
            assert_eq!(found, [repeated, mirrored, clamped], "{u}");
        }
        assert!(Texture::new([2, 2], vec![[0; 4]; 3]).is_none() && Texture::new([0, 0], vec![]).is_none());
    }
}
