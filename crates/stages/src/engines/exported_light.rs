//! What an export of light says of its files, for a preview that reads them back.

use containers::{ReadOptions, Texture, read_image};
use engine::Failure;
use envmap::{CubeMap, Environment, Image, Layout};
use sh::Light;
use sphere::Cube;

use super::definition::{Engine, read_cube};
use super::engine_format::EngineFormat;
use super::engine_lights::read_lights;

/// The light in the first file of an export. A kind that exports light returns this as its
/// [`Kind::details`](engine::Kind::details).
#[derive(Clone, Copy)]
pub(crate) enum ExportedLight {
    /// It is for an engine.
    Engine {
        /// The engine.
        engine: &'static Engine,
        /// How its texels are stored.
        format: EngineFormat,
        /// The place, among the export's files, of the JSON of suns and lamps that are lights beside the
        /// image, if they are.
        lights_file: Option<usize>,
    },
    /// It is a texture for a renderer of anybody's: if the export was given a prefiltered cube, with its
    /// levels.
    Texture,
}

/// Light as a file holds it, in our frame.
pub(crate) enum LightInFile {
    /// The levels of a cube, the sharpest first.
    Cube(Vec<CubeMap>),
    /// An image that the engine filters itself.
    Image(Environment),
}

impl ExportedLight {
    /// Reads the light from the export's first file, as the reader does for which it was written.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn read(self, bytes: &[u8]) -> Result<LightInFile, Failure> {
        let Self::Engine { engine, format, .. } = self else {
            return levels(&read_cube(bytes)?, |face| face.pixels().to_vec());
        };
        match engine.cube() {
            Some(cube) => {
                let unknown = || Failure::new(format!("{} loads no {}", engine.name, format.name()));
                let files = cube.files(format).ok_or_else(unknown)?;
                levels(&(files.read)(bytes)?, |faces| engine.turned_back(faces))
            }
            None => {
                let image = read_image(bytes, &ReadOptions::default())?.image;
                Ok(LightInFile::Image(Environment::from_image(image, Layout::LatLong, None)?))
            }
        }
    }

    /// The place of the file of the lights that stand beside the light of the first, if there is one.
    pub(crate) fn lights_file(self) -> Option<usize> {
        match self {
            Self::Engine { lights_file, .. } => lights_file,
            Self::Texture => None,
        }
    }

    /// Reads the lights of that file, in our frame.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn read_lights(self, bytes: &[u8]) -> Result<Vec<Light>, Failure> {
        match self {
            Self::Engine { engine, .. } => read_lights(bytes, |direction| engine.to_file_frame(direction)),
            Self::Texture => Ok(Vec::new()),
        }
    }

    /// What white metal under it does not show as the engine would, if there is something.
    pub(crate) fn remark(self) -> Option<String> {
        let Self::Engine { engine, .. } = self else { return None };
        let name = engine.name;
        let remark =
            || format!("{name} filters the image itself; the metal is lit by the image as it is stored");
        (!engine.loads_cube()).then(remark)
    }

    /// The level of a cube that a surface of some roughness reads. `size` is the number of texels along the
    /// edge of a face of the first level; `of_levels` are the roughnesses of the levels, in place of what an
    /// engine knows.
    pub(crate) fn level(self, roughness: f64, size: usize, of_levels: &[f64]) -> f64 {
        match self {
            Self::Engine { engine, .. } => engine.level(roughness, size).unwrap_or_default(),
            Self::Texture => place_in(of_levels, roughness),
        }
    }
}

/// The levels of a cube, each with its faces turned from where the file has them.
fn levels(texture: &Texture, turned: impl Fn(&Image) -> Vec<[f32; 3]>) -> Result<LightInFile, Failure> {
    let level = |texels: &[[f32; 3]]| {
        let edge = (texels.len() / 6).isqrt();
        let faces = Image::new(edge, 6 * edge, texels.to_vec())?;
        CubeMap::new(Cube { edge }, turned(&faces))
    };
    let levels: Option<Vec<_>> = texture.levels().map(level).collect();
    levels.map(LightInFile::Cube).ok_or_else(|| Failure::new("the texture is not a cube"))
}

/// The place of a value between those of a list, which it is interpolated in; the nearest one if it lies
/// between no neighbours.
fn place_in(list: &[f64], value: f64) -> f64 {
    let between = |pair: &[f64]| (pair[0] - value) * (pair[1] - value) <= 0.0 && pair[0] != pair[1];
    if let Some(low) = list.windows(2).position(between) {
        return low as f64 + (value - list[low]) / (list[low + 1] - list[low]);
    }
    let away = |at: &usize| (list[*at] - value).abs();
    (0..list.len()).min_by(|one, other| away(one).total_cmp(&away(other))).unwrap_or_default() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_roughness_lies_between_those_of_two_levels() {
        let list = [0.0, 0.2, 0.6];
        for (roughness, level) in [(0.0, 0.0), (0.1, 0.5), (0.2, 1.0), (0.5, 1.75), (0.6, 2.0), (1.0, 2.0)] {
            assert!((place_in(&list, roughness) - level).abs() < 1e-12, "{roughness}");
        }
        assert!((place_in(&[0.6, 0.2], 0.4) - 0.5).abs() < 1e-12, "rough levels may come first");
        assert_eq!(place_in(&[0.3], 0.9), 0.0);
        assert_eq!(place_in(&[0.5, 0.5], 0.5), 0.0);
    }
}
