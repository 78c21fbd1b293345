//! What engines expect of a prefiltered environment: which roughness a level of detail holds, how small the
//! last level is, and which direction a texel looks in.
//!
//! Each fact was read in the engine's source, and seen in the engine where it runs in a browser.

use engine::{Choice, choice};
use envmap::Image;
use sphere::{Cube, DVec3, Direction, Face, from_file, to_cube};

choice! {
    /// An engine that loads light.
    pub(crate) enum EnginePreset {
        /// three.js from r187 on.
        Three = "three",
        /// Filament.
        Filament = "filament",
        /// Babylon.js.
        Babylon = "babylon",
        /// Bevy.
        Bevy = "bevy",
        /// EXT_lights_image_based, as Babylon.js reads it.
        Gltf = "gltf",
        /// Godot.
        Godot = "godot",
        /// Blender.
        Blender = "blender",
        /// Unity.
        Unity = "unity",
        /// Unreal Engine.
        Unreal = "unreal",
    }
}

choice! {
    /// How the texels of an engine's file are stored.
    pub(crate) enum EngineFormat {
        /// Four halves.
        Rgba16F = "rgba16f",
        /// Four floats.
        Rgba32F = "rgba32f",
        /// Three mantissas with one exponent, 4 bytes.
        Rgb9E5 = "rgb9e5",
        /// Three small floats, 4 bytes.
        R11G11B10F = "r11g11b10f",
        /// Blocks of BC6H, 1 byte.
        Bc6h = "bc6h",
        /// PNG with a divisor in its alpha, up to 255.
        Rgbd = "rgbd",
        /// An OpenEXR image in halves, or in 32-bit floats if halves cannot hold a value.
        Exr = "exr",
        /// A Radiance image.
        Hdr = "hdr",
    }
}

impl EngineFormat {
    /// The format's word in a manifest.
    pub(crate) fn name(self) -> &'static str {
        Self::words().into_iter().find(|(.., format)| *format == self).map_or("", |(word, ..)| word)
    }
}

/// The levels of detail of a preset's cube.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Levels {
    /// Quadratic levels r = 1 - sqrt(1 - l / n): the engine looks up level n r (2 - r).
    Quadratic,
    /// Linear levels r = l / n.
    Linear,
    /// Levels r^2 = 2^(l / 0.8) / size, at most 1; level 0 is a mirror.
    Halving,
    /// Levels r^2 = size^(l / n - 1); level 0 is a mirror.
    Geometric,
}

impl EnginePreset {
    /// The spacing of the levels, and the edge of the last; `None` if the engine filters a lat-long image
    /// itself.
    fn levels(self) -> Option<(Levels, usize)> {
        match self {
            Self::Three => Some((Levels::Quadratic, 8)),
            Self::Filament => Some((Levels::Quadratic, 16)),
            Self::Babylon => Some((Levels::Halving, 1)),
            Self::Bevy => Some((Levels::Linear, 16)),
            Self::Gltf => Some((Levels::Geometric, 16)),
            Self::Godot | Self::Blender | Self::Unity | Self::Unreal => None,
        }
    }

    /// The preset's word in a manifest.
    pub(crate) fn name(self) -> &'static str {
        Self::words().into_iter().find(|(.., preset)| *preset == self).map_or("", |(word, ..)| word)
    }

    /// The formats that the engine loads, the one to prefer first.
    pub(crate) fn formats(self) -> &'static [EngineFormat] {
        use EngineFormat::{Bc6h, Exr, Hdr, R11G11B10F, Rgb9E5, Rgba16F, Rgba32F, Rgbd};
        match self {
            Self::Three => &[Rgba16F, Bc6h],
            Self::Filament => &[R11G11B10F, Rgba16F],
            Self::Babylon => &[Rgbd, Rgba16F, Rgba32F],
            Self::Bevy => &[Rgb9E5, Rgba16F, Bc6h],
            Self::Gltf => &[Rgbd],
            Self::Godot | Self::Blender | Self::Unity => &[Exr, Hdr],
            Self::Unreal => &[Hdr],
        }
    }

    /// The direction, in the frame of files (+Y up, the centre of a lat-long image looks along +Z), of which
    /// the texel at cube coordinates c (KTX2's face table) holds the light.
    ///
    /// A cube lies where the engine lays the same lat-long image, so each is the engine's own lookup of cubes
    /// after that of lat-long images. Bevy loads no lat-long image; its centre is +X, as for three.js.
    pub(crate) fn direction_at(self, c: DVec3) -> DVec3 {
        match self {
            Self::Three => DVec3::new(-c.z, c.y, -c.x),
            Self::Filament => c,
            Self::Bevy => DVec3::new(c.z, c.y, c.x),
            _ => DVec3::new(-c.x, c.y, c.z),
        }
    }

    /// For each texel of the engine's cube, in the order of its file, the texel of a cube by KTX2's table in
    /// the frame of files that holds the same light.
    pub(crate) fn texels(self, cube: Cube) -> impl Iterator<Item = usize> {
        let edge = cube.edge;
        (0..cube.len()).map(move |index| {
            let (face, row, column) = (index / (edge * edge), index / edge % edge, index % edge);
            let c = to_cube(cube.direction(Face::ALL[face], row, column).vector());
            let direction = Direction::normalised(from_file(self.direction_at(c)));
            // The centre of a texel again, for the map permutes axes and flips their signs.
            let (face, s, t) = cube.position(direction);
            let at = |share: f64| ((share * edge as f64) as usize).min(edge - 1);
            (face as usize * edge + at(t)) * edge + at(s)
        })
    }

    /// The preset of the kind that wrote a file with this recipe.
    pub(crate) fn of_recipe(recipe: &str) -> Option<Self> {
        let recipe: serde_json::Value = serde_json::from_str(recipe).ok()?;
        let name = recipe.pointer("/parameters/preset")?.as_str()?;
        Self::words().into_iter().find(|(word, ..)| *word == name).map(|(.., preset)| preset)
    }

    /// Whether the engine loads a cube with prefiltered levels.
    pub(crate) fn has_levels(self) -> bool {
        self.levels().is_some()
    }

    /// The roughness of each level of a cube whose faces are `size` texels wide, a power of two; the error
    /// says which size fits.
    pub(crate) fn roughness(self, size: usize) -> Result<Vec<f64>, String> {
        let Some((levels, last)) = self.levels() else {
            return Err(format!(
                "{} loads a lat-long image, which it filters itself; use `export-engine`",
                self.name()
            ));
        };
        // One level cannot be interpolated; the roughest level stays at the size that the engine wants.
        let least = (2 * last).max(16);
        if !size.is_power_of_two() || size < least {
            let nearest = nearest_power_of_two(size).max(least);
            return Err(format!(
                "the faces for {} are a power of two from {least} texels on; the nearest size that fits is {nearest}",
                self.name()
            ));
        }
        let n = (size / last).ilog2();
        let edge = size as f64;
        let roughness = |l: u32| {
            let share = f64::from(l) / f64::from(n);
            match levels {
                Levels::Quadratic => 1.0 - (1.0 - share).sqrt(),
                Levels::Linear => share,
                Levels::Halving | Levels::Geometric if l == 0 => 0.0,
                Levels::Halving => math::exp2(f64::from(l) / 0.8).min(edge).sqrt() / edge.sqrt(),
                Levels::Geometric => math::pow(edge, 0.5 * (share - 1.0)),
            }
        };
        Ok((0..=n).map(roughness).collect())
    }

    /// The edge of a cube with as many levels as are given.
    pub(crate) fn size_with(self, levels: usize) -> Option<usize> {
        let (_, last) = self.levels()?;
        let size = u32::try_from(levels.max(1) - 1).ok().and_then(|n| last.checked_shl(n))?;
        Some(size.max(2 * last).max(16))
    }
}

/// The power of two with the least ratio to a size; of two, the larger.
pub(crate) fn nearest_power_of_two(size: usize) -> usize {
    let above = size.max(1).checked_next_power_of_two().unwrap_or(1 << (usize::BITS - 1));
    let below = (above / 2).max(1);
    // size / below < above / size, in logarithms.
    if (size as f64) * (size as f64) < (above as f64) * (below as f64) { below } else { above }
}

/// The faces of an engine's file, below each other, in the order of KTX2's table in the frame of files.
pub(crate) fn turned_back(image: &Image, preset: EnginePreset) -> Vec<[f32; 3]> {
    let mut pixels = vec![[0.0; 3]; image.pixels().len()];
    let texels = preset.texels(Cube { edge: image.width() });
    texels.zip(image.pixels()).for_each(|(texel, pixel)| pixels[texel] = *pixel);
    pixels
}

/// Says what is wrong with a format for an engine, if something is.
pub(crate) fn check_format(
    preset: EnginePreset,
    format: Option<EngineFormat>,
) -> Option<(&'static str, String)> {
    let known = preset.formats();
    if format.is_none_or(|format| known.contains(&format)) {
        return None;
    }
    let words: Vec<String> = known.iter().map(|format| format!("{:?}", format.name())).collect();
    Some(("format", format!("{} loads {}", preset.name(), words.join(" or "))))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WITH_LEVELS: [EnginePreset; 5] = [
        EnginePreset::Three,
        EnginePreset::Filament,
        EnginePreset::Babylon,
        EnginePreset::Bevy,
        EnginePreset::Gltf,
    ];

    #[test]
    fn levels_rise_from_a_mirror_to_roughness_1() {
        for preset in WITH_LEVELS {
            for size in [32, 64, 256, 1024] {
                let roughness = preset.roughness(size).unwrap();
                assert_eq!((roughness[0], *roughness.last().unwrap()), (0.0, 1.0), "{preset:?} {size}");
                assert!(roughness.is_sorted(), "{preset:?} {roughness:?}");
                assert_eq!(preset.size_with(roughness.len()), Some(size));
            }
        }
    }

    /// The level that each engine's shader looks up for a roughness.
    #[test]
    fn an_engine_finds_the_roughness_at_its_level() {
        for size in [64, 256] {
            for preset in WITH_LEVELS {
                let roughness = preset.roughness(size).unwrap();
                let n = (roughness.len() - 1) as f64;
                for (l, &r) in roughness.iter().enumerate().skip(1) {
                    let edge = size as f64;
                    let (level, expected) = match preset {
                        // three: bicubicCubeUV; Filament: perceptualRoughnessToLod, both r (2 - r).
                        EnginePreset::Three | EnginePreset::Filament => (n * r * (2.0 - r), l as f64),
                        EnginePreset::Bevy => (n * r, l as f64),
                        // Babylon: log2(size alpha) * lodGenerationScale.
                        EnginePreset::Babylon => (0.8 * (edge * r * r).log2(), (l as f64).min(0.8 * n)),
                        // The loader sets the scale n / log2(size).
                        _ => (n / edge.log2() * (edge * r * r).log2(), l as f64),
                    };
                    assert!(
                        (level - expected).abs() < 1e-9,
                        "{preset:?} {size}: level {l} is found at {level}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_nearest_size_is_named() {
        let message = |preset: EnginePreset, size| preset.roughness(size).unwrap_err();
        assert!(message(EnginePreset::Three, 200).ends_with("256"));
        assert!(message(EnginePreset::Three, 180).ends_with("128"));
        assert!(message(EnginePreset::Filament, 8).ends_with("32"));
        assert!(message(EnginePreset::Blender, 256).contains("export-engine"));
    }
}
