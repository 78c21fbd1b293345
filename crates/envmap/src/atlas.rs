//! The levels of a cube in one picture without levels of its own, for engines that have no cube arrays.

use crate::image::Image;

/// The faces of a cube.
const FACES: usize = 6;

/// The texels of a border on both sides of a face.
const BORDERS: usize = 2;

/// Where the faces of all levels of a cube lie in a picture that has no levels of its own, for engines that
/// have no cube arrays.
///
/// Level k is in octave o = k div p, with p levels to an octave, and its faces have n_o = n_0 / 2^o texels
/// along an edge. Each face has a border of one texel, which holds what a look-up past its edge is to find,
/// so that hardware filtering stays within a square of t_o = n_o + 2 texels. Octave 0 is a block of p columns
/// and 6 rows of such squares, at the left; the other octaves are such blocks, one below the other, to the
/// right of it:
///
/// ```text
/// x = min(o, 1) p t_0 + (k mod p) t_o
/// y = 6 max(n_0 - 2 n_o + 2 (o - 1), 0) + f t_o
/// ```
///
/// is the corner of face f of level k, rows counted from the top: the edges of the octaves between 0 and o
/// add up to n_0 - 2 n_o, and their borders to 2 (o - 1). Of the 400 x 432 texels for 24 levels, 4 to an
/// octave, of 64 texels and less, five in six are used. A shader finds the light in a direction that falls on
/// face f at (s, t), each in [0, 1], with N = n_0 and P = p, as
///
/// ```glsl
/// vec3 level(vec2 st, float f, float k) {
///     float o = floor(k / P), n = exp2(-o) * N;
///     vec2 corner = vec2(min(o, 1.0) * P * (N + 2.0) + mod(k, P) * (n + 2.0),
///                        6.0 * max(N - 2.0 * n + 2.0 * (o - 1.0), 0.0) + f * (n + 2.0));
///     return textureLod(atlas, (corner + 1.0 + st * n) / vec2(textureSize(atlas, 0)), 0.0).rgb;
/// }
/// ```
///
/// Formats of blocks do not suit such a picture, because a block would have texels of several faces.
///
/// # Example: the second octave is beside the first
/// ```
/// use envmap::Atlas;
/// let atlas = Atlas::new(64, 4, 24).unwrap();
/// assert_eq!((atlas.width, atlas.height), (400, 432));
/// // Level 5 is the second of the second octave, whose faces have 32 texels and a border.
/// assert_eq!(atlas.placement(5, 2), [4 * 66 + 34, 2 * 34, 34]);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Atlas {
    /// The columns of the picture.
    pub width: usize,
    /// The rows of the picture.
    pub height: usize,
    /// Where each face of each level lies, in file order: the column and the row of the first texel of its
    /// border, and the texels along an edge, borders included. Rows are counted from the top.
    pub placements: Vec<[usize; 3]>,
}

impl Atlas {
    /// The places of so many levels, of which `per_octave` after another have the same size and the next
    /// half of it; the largest faces have `edge` texels along an edge.
    ///
    /// `None` if there are no levels, or if the edge cannot be halved for each octave without a remainder.
    pub fn new(edge: usize, per_octave: usize, levels: usize) -> Option<Self> {
        let last = levels.checked_sub(1)?.checked_div(per_octave)?;
        let smallest = edge.checked_shr(u32::try_from(last).ok()?)?;
        if smallest == 0 || smallest << last != edge {
            return None;
        }
        let placement = |level: usize, face: usize| {
            let octave = level / per_octave;
            let inner = edge >> octave;
            let size = inner + BORDERS;
            let [left, top] = match octave {
                0 => [0, 0],
                _ => [per_octave * (edge + BORDERS), FACES * (edge - 2 * inner + BORDERS * (octave - 1))],
            };
            [left + level % per_octave * size, top + face * size, size]
        };
        let faces = |level: usize| (0..FACES).map(move |face| placement(level, face));
        let placements: Vec<[usize; 3]> = (0..levels).flat_map(faces).collect();
        let end = |axis: usize| placements.iter().map(|place| place[axis] + place[2]).max();
        Some(Self { width: end(0)?, height: end(1)?, placements })
    }

    /// The column and the row of the first texel of a face's border, and the texels along an edge, borders
    /// included.
    ///
    /// # Panics
    /// If there is no such level or face.
    pub fn placement(&self, level: usize, face: usize) -> [usize; 3] {
        assert!(face < FACES, "a cube has {FACES} faces");
        self.placements[FACES * level + face]
    }

    /// The picture of all levels. Each level is its six faces in file order, with their borders, row by row
    /// from the top; texels between them are black.
    ///
    /// `None` if the levels are not those of the atlas, or one has not the pixels of its faces.
    pub fn pack<L: AsRef<[[f32; 3]]>>(&self, levels: &[L]) -> Option<Image> {
        if FACES * levels.len() != self.placements.len() {
            return None;
        }
        let mut pixels = vec![[0.0; 3]; self.width * self.height];
        for (level, places) in levels.iter().zip(self.placements.chunks_exact(FACES)) {
            let (level, [.., size]) = (level.as_ref(), places[0]);
            if level.len() != FACES * size * size {
                return None;
            }
            for (face, [x, y, _]) in level.chunks_exact(size * size).zip(places) {
                for (row, texels) in face.chunks_exact(size).enumerate() {
                    pixels[(y + row) * self.width + x..][..size].copy_from_slice(texels);
                }
            }
        }
        Image::new(self.width, self.height, pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_lie_apart_and_inside() {
        for (edge, per_octave, levels) in [(64, 4, 24), (64, 4, 23), (32, 2, 9), (128, 4, 1), (48, 3, 15)] {
            let atlas = Atlas::new(edge, per_octave, levels).unwrap();
            assert_eq!(atlas.placements.len(), 6 * levels);
            let mut owners = vec![0; atlas.width * atlas.height];
            for &[x, y, size] in &atlas.placements {
                for texel in 0..size * size {
                    owners[(y + texel / size) * atlas.width + x + texel % size] += 1;
                }
            }
            assert!(owners.iter().all(|owners| *owners <= 1), "{edge} {per_octave} {levels}");
        }
        let atlas = Atlas::new(64, 4, 24).unwrap();
        let used: usize = atlas.placements.iter().map(|[.., size]| size * size).sum();
        assert!(6 * used > 4 * atlas.width * atlas.height + atlas.width * atlas.height / 2);
    }

    /// The formula that shaders use, in their numbers.
    #[test]
    fn a_shader_finds_every_face_by_the_formula() {
        for (edge, per_octave, levels) in [(64, 4, 24), (32, 2, 9), (48, 3, 15)] {
            let atlas = Atlas::new(edge, per_octave, levels).unwrap();
            let (n0, p) = (edge as f32, per_octave as f32);
            for (index, &[x, y, size]) in atlas.placements.iter().enumerate() {
                let (k, f) = ((index / 6) as f32, (index % 6) as f32);
                let o = (k / p).floor();
                let n = (-o).exp2() * n0;
                let left = o.min(1.0) * p * (n0 + 2.0) + (k % p) * (n + 2.0);
                let top = 6.0 * (n0 - 2.0 * n + 2.0 * (o - 1.0)).max(0.0) + f * (n + 2.0);
                assert_eq!([left, top, n + 2.0], [x as f32, y as f32, size as f32], "level {k}, face {f}");
                assert_eq!(atlas.placement(index / 6, index % 6), [x, y, size]);
            }
        }
    }

    #[test]
    fn every_texel_is_at_its_place() {
        let atlas = Atlas::new(4, 2, 3).unwrap();
        let level = |level: usize| -> Vec<[f32; 3]> {
            let size = atlas.placement(level, 0)[2];
            (0..6 * size * size).map(|texel| [level as f32, texel as f32, 1.0]).collect()
        };
        let levels = [level(0), level(1), level(2)];
        let picture = atlas.pack(&levels).unwrap();
        for (level, texels) in levels.iter().enumerate() {
            let size = atlas.placement(level, 0)[2];
            for (index, texel) in texels.iter().enumerate() {
                let (face, row, column) = (index / (size * size), index / size % size, index % size);
                let [x, y, _] = atlas.placement(level, face);
                assert_eq!(picture.pixels()[(y + row) * atlas.width + x + column], *texel);
            }
        }
        let filled = picture.pixels().iter().filter(|texel| texel[2] == 1.0).count();
        assert_eq!(filled, levels.iter().map(Vec::len).sum::<usize>());
        assert_eq!(atlas.pack(&levels[..2]), None);
        assert_eq!(atlas.pack(&[level(0), level(1), level(1)]), None);
    }

    #[test]
    fn an_edge_is_halved_without_a_remainder() {
        assert_eq!(Atlas::new(64, 4, 0), None);
        assert_eq!(Atlas::new(64, 0, 4), None);
        assert_eq!(Atlas::new(24, 4, 17), None);
        assert_eq!(Atlas::new(4, 1, 4), None);
        assert_eq!(Atlas::new(4, 1, 70), None);
        assert!(Atlas::new(24, 4, 16).is_some() && Atlas::new(4, 1, 3).is_some());
    }
}
