//! What the file of an engine says of it: which light it loads, how, and what manuals print.

use containers::lighting_json::Preset;
use containers::{Encoded, TexelFormat, Texture, read_texture, write_dds, write_ktx2_zstd};
use engine::Failure;
use envmap::Image;
use rayon::prelude::*;
use sphere::{Cube, DVec3};
use taps::{LookUp, TableShape, Widths};

use super::cube_light::{CubeLight, DirectionAt, texels};
use super::engine_format::EngineFormat;
use super::engine_lights::EngineLights;
use super::levels::{Levels, nearest_power_of_two};
use super::tap_shaders::TapPreset;

/// An engine that loads light.
pub struct Engine {
    /// The engine's word in a manifest.
    pub name: &'static str,
    /// What the word stands for: a sentence for schemas.
    pub(crate) meaning: &'static str,
    /// The versions of the engine that load these files, for the manual; empty if all do.
    pub(crate) versions: &'static str,
    /// The light that the engine loads.
    pub(crate) light: EngineLight,
    /// Where the centre of a lat-long image, the middle of its left half and its top are in the engine's
    /// world.
    pub(crate) axes: [DVec3; 3],
    /// How the engine gets the suns and lamps that leave the image.
    pub(crate) lights: EngineLights,
    /// How the engine looks taps up; `None` if it has no shaders of ours.
    pub(crate) taps: Option<&'static TapPreset>,
}

/// The light that an engine loads.
pub(crate) enum EngineLight {
    /// A cube with prefiltered levels.
    Cube(EngineCube),
    /// A lat-long image, which the engine filters itself.
    LatLong(EngineImage),
}

/// The cube with prefiltered levels that an engine loads.
pub(crate) struct EngineCube {
    /// The roughness of its levels.
    pub(crate) levels: Levels,
    /// The width of a face of the last level, in texels.
    pub(crate) last: usize,
    /// What the manual says of the levels, after their formula and the last of them.
    pub(crate) levels_remark: &'static str,
    /// Where a texel looks.
    ///
    /// A cube lies where the engine lays the same lat-long image, so this is the engine's own lookup of cubes
    /// after that of lat-long images.
    pub(crate) direction_at: DirectionAt,
    /// Where a texel looks, for the manual: `(-c.x, c.y, c.z)`, and what is to be said of it.
    pub(crate) direction: &'static str,
    /// The files, those of the format to prefer first.
    pub(crate) files: &'static [CubeFiles],
    /// The endings of the files for the manual, with what each holds.
    pub(crate) endings: &'static str,
}

/// The file of the light, and the contents of those beside it.
pub(crate) type LightFiles = Result<(Encoded, Vec<Vec<u8>>), Failure>;

/// The files of a cube in some formats.
pub(crate) struct CubeFiles {
    /// The formats, the one to prefer first.
    pub(crate) formats: &'static [EngineFormat],
    /// What follows the stem in the files' names; the first is that of the light.
    pub(crate) endings: &'static [&'static str],
    /// Makes the file of the light, and the contents of those beside it.
    pub(crate) write: fn(&CubeLight<'_>) -> LightFiles,
    /// Reads the cube back from the file of the light.
    pub(crate) read: fn(&[u8]) -> Result<Texture, Failure>,
    /// The text with the code that loads the files, from the name of the first and of the second.
    pub(crate) readme: fn(&str, &str) -> String,
    /// The sharp cube that the engine shows behind a scene.
    pub(crate) skybox: &'static Skybox,
}

/// The file of the sharp cube, with levels for minification, that an engine shows behind a scene. Its texels
/// lie and are stored as those of the light.
pub(crate) struct Skybox {
    /// What follows the stem in the file's name.
    pub(crate) ending: &'static str,
    /// Makes the file.
    pub(crate) write: fn(&Texture, TexelFormat, Option<&str>) -> Result<Encoded, Failure>,
    /// The code that shows it, from the name of the file.
    pub(crate) readme: fn(&str) -> String,
}

impl Skybox {
    /// A file in KTX2.
    pub(crate) const fn ktx2(readme: fn(&str) -> String) -> Self {
        let write: fn(&Texture, TexelFormat, Option<&str>) -> Result<Encoded, Failure> =
            |cube, texels, recipe| Ok(write_ktx2_zstd(cube, texels, recipe, &[])?);
        Self { ending: "-skybox.ktx2", write, readme }
    }

    /// A file in DDS.
    pub(crate) const fn dds(readme: fn(&str) -> String) -> Self {
        Self { ending: "-skybox.dds", write: |cube, texels, _| Ok(write_dds(cube, texels)?), readme }
    }
}

/// The lat-long image that an engine loads.
pub(crate) struct EngineImage {
    /// The formats, the one to prefer first.
    pub(crate) formats: &'static [EngineFormat],
    /// The convention of the irradiance that is a file beside the image.
    pub(crate) irradiance: Option<Preset>,
    /// The text with the code that loads the files and shows the image behind a scene, from the name of the
    /// first and of the second.
    pub(crate) readme: fn(&str, &str) -> String,
}

/// What follows the stem in the name of a file with irradiance as JSON.
pub(crate) const IRRADIANCE: &str = "-irradiance.json";

/// Reads a cube in KTX2, KTX or DDS.
pub(crate) fn read_cube(bytes: &[u8]) -> Result<Texture, Failure> {
    Ok(read_texture(bytes)?.texture)
}

impl Engine {
    /// An engine of which every version loads a lat-long image, which it filters itself.
    pub(crate) const fn of_image(
        name: &'static str,
        meaning: &'static str,
        image: EngineImage,
        axes: [DVec3; 3],
        lights: EngineLights,
    ) -> Self {
        let light = EngineLight::LatLong(image);
        Self { name, meaning, versions: "", light, axes, lights, taps: None }
    }

    /// Adds to an engine how it looks up the taps of a compact map.
    pub(crate) const fn with_taps(self, taps: &'static TapPreset) -> Self {
        Self { taps: Some(taps), ..self }
    }

    /// A direction in the frame of files (+Y up, the centre of a lat-long image along +Z) in the engine's
    /// world.
    pub(crate) fn world(&self, d: DVec3) -> DVec3 {
        let [centre, left, top] = self.axes;
        d.z * centre + d.x * left + d.y * top
    }

    /// A direction of the engine's world in the frame of files: the inverse of [`Engine::world`].
    pub(crate) fn to_file_frame(&self, d: DVec3) -> DVec3 {
        let [centre, left, top] = self.axes;
        DVec3::new(d.dot(left), d.dot(top), d.dot(centre))
    }

    /// The cube coordinates, as KTX2's table has them, of a direction `d` of the engine's world.
    pub(crate) fn cube_coordinates(&self) -> [&'static str; 3] {
        let [centre, left, top] = self.axes;
        [-left, top, centre].map(|axis| match axis.to_array() {
            [x, 0.0, 0.0] => {
                if x > 0.0 {
                    "d.x"
                } else {
                    "-d.x"
                }
            }
            [0.0, y, 0.0] => {
                if y > 0.0 {
                    "d.y"
                } else {
                    "-d.y"
                }
            }
            [.., z] => {
                if z > 0.0 {
                    "d.z"
                } else {
                    "-d.z"
                }
            }
        })
    }

    /// The look-up of a table of so many taps and taps about the normal, if the engine has one.
    pub(crate) fn look_up(
        &self,
        widths: Widths,
        table: TableShape,
        [taps, normals]: [usize; 2],
    ) -> Option<LookUp> {
        let preset = self.taps?;
        Some(LookUp {
            language: preset.language,
            source: preset.source,
            cube_coordinates: self.cube_coordinates(),
            rows_from_bottom: preset.rows_from_bottom,
            widths,
            taps,
            normals,
            lights: 0, // the engine reflects them as its own
            table,
        })
    }

    /// Whether the engine loads a cube with prefiltered levels, rather than a lat-long image.
    pub fn loads_cube(&self) -> bool {
        self.cube().is_some()
    }

    /// Whether there are shaders with which the engine looks up the taps of a compact map.
    pub fn looks_up_taps(&self) -> bool {
        self.taps.is_some()
    }

    /// The width of a face of the cube's last level, in texels; `None` if the engine loads no cube.
    pub fn last_level(&self) -> Option<usize> {
        self.cube().map(|cube| cube.last)
    }

    /// The level that the engine's shader looks up for a roughness in a cube whose faces are `size` texels
    /// wide; `None` if the engine loads no cube.
    pub fn level(&self, roughness: f64, size: usize) -> Option<f64> {
        let cube = self.cube()?;
        let n = (size / cube.last).max(1).ilog2();
        Some((cube.levels.level)(roughness, f64::from(n), size as f64))
    }

    /// The words of the formats that the engine loads, the one to prefer first.
    pub fn format_names(&self) -> Vec<&'static str> {
        self.formats().into_iter().map(EngineFormat::name).collect()
    }

    /// The word of the first format whose light is a file with an extension such as `ktx2`, and what follows
    /// the stem in that file's name.
    pub fn format_of_extension(&self, extension: &str) -> Option<(&'static str, String)> {
        let light = |format: EngineFormat| self.names(format, "").into_iter().next();
        let ending = |name: String| name.trim_start_matches('/').to_owned();
        let mut all =
            self.formats().into_iter().filter_map(|format| Some((format.name(), ending(light(format)?))));
        all.find(|(_, name)| name.rsplit('.').next() == Some(extension))
    }

    /// The extensions of the file of the light, that of the format to prefer first.
    pub fn extensions(&self) -> Vec<String> {
        let light = self.formats().into_iter().filter_map(|format| self.names(format, "").into_iter().next());
        let mut found: Vec<String> = Vec::new();
        for extension in light.filter_map(|name| Some(name.rsplit('.').next()?.to_owned())) {
            if !found.contains(&extension) {
                found.push(extension);
            }
        }
        found
    }

    /// The formats that the engine loads, the one to prefer first.
    pub(crate) fn formats(&self) -> Vec<EngineFormat> {
        match &self.light {
            EngineLight::Cube(cube) => {
                cube.files.iter().flat_map(|files| files.formats.iter().copied()).collect()
            }
            EngineLight::LatLong(image) => image.formats.to_vec(),
        }
    }

    /// The cube that the engine loads.
    pub(crate) fn cube(&self) -> Option<&EngineCube> {
        match &self.light {
            EngineLight::Cube(cube) => Some(cube),
            EngineLight::LatLong(_) => None,
        }
    }

    /// The convention of the irradiance beside a lat-long image.
    pub(crate) fn irradiance_beside_image(&self) -> Option<Preset> {
        match &self.light {
            EngineLight::Cube(_) => None,
            EngineLight::LatLong(image) => image.irradiance,
        }
    }

    /// The file names, each from its slash on; the first is the light.
    pub(crate) fn names(&self, format: EngineFormat, stem: &str) -> Vec<String> {
        let endings = match &self.light {
            EngineLight::Cube(cube) => cube.files(format).map_or_else(Vec::new, |files| files.endings.into()),
            EngineLight::LatLong(image) => {
                format.image_ending().into_iter().chain(image.irradiance.map(|_| IRRADIANCE)).collect()
            }
        };
        endings.into_iter().map(|ending| format!("/{stem}{ending}")).collect()
    }

    /// The sharp cube that the engine shows behind a scene; `None` if it shows the lat-long image itself.
    pub(crate) fn skybox(&self, format: EngineFormat) -> Option<&'static Skybox> {
        Some(self.cube()?.files(format)?.skybox)
    }

    /// The text beside the files: the code that loads them.
    pub(crate) fn readme(&self, format: EngineFormat, stem: &str) -> String {
        let names = self.names(format, stem);
        let name = |index: usize| names.get(index).map_or("", |name| name.trim_start_matches('/'));
        let readme = match &self.light {
            EngineLight::Cube(cube) => cube.files(format).map(|files| files.readme),
            EngineLight::LatLong(image) => Some(image.readme),
        };
        readme.map_or_else(String::new, |readme| readme(name(0), name(1)))
    }

    /// The roughness of each level of a cube whose faces are `size` texels wide, a power of two; the error
    /// says which size fits.
    pub(crate) fn roughness(&self, size: usize) -> Result<Vec<f64>, String> {
        let Some(cube) = self.cube() else {
            return Err(format!(
                "{} loads a lat-long image, which it filters itself; use `export-engine`",
                self.name
            ));
        };
        let least = cube.least_size();
        if !size.is_power_of_two() || size < least {
            let nearest = nearest_power_of_two(size).max(least);
            return Err(format!(
                "the faces for {} are a power of two from {least} texels on; the nearest size that fits is {nearest}",
                self.name
            ));
        }
        let n = (size / cube.last).ilog2();
        let roughness = |l: u32| match l {
            0 => 0.0,
            _ => (cube.levels.roughness)(f64::from(l), f64::from(n), size as f64),
        };
        Ok((0..=n).map(roughness).collect())
    }

    /// The edge of a cube with as many levels as are given.
    pub(crate) fn size_with(&self, levels: usize) -> Option<usize> {
        let cube = self.cube()?;
        let size = u32::try_from(levels.max(1) - 1).ok().and_then(|n| cube.last.checked_shl(n))?;
        Some(size.max(cube.least_size()))
    }

    /// The faces of the engine's file, below each other, in the order of KTX2's table in the frame of files.
    pub(crate) fn turned_back(&self, image: &Image) -> Vec<[f32; 3]> {
        // A cube of an engine that loads none lies as KTX2's table has it.
        let direction_at = self
            .cube()
            .map_or((|c: DVec3| DVec3::new(-c.x, c.y, c.z)) as DirectionAt, |cube| cube.direction_at);
        let mut pixels = vec![[0.0; 3]; image.pixels().len()];
        let texels: Vec<usize> = texels(Cube { edge: image.width() }, direction_at).collect();
        texels.into_iter().zip(image.pixels()).for_each(|(texel, pixel)| pixels[texel] = *pixel);
        pixels
    }

    /// Says what is wrong with a format for the engine, if something is.
    pub(crate) fn check_format(&self, format: Option<EngineFormat>) -> Option<(&'static str, String)> {
        let known = self.formats();
        if format.is_none_or(|format| known.contains(&format)) {
            return None;
        }
        let words: Vec<String> = known.iter().map(|format| format!("{:?}", format.name())).collect();
        Some(("format", format!("{} loads {}", self.name, words.join(" or "))))
    }
}

impl EngineCube {
    /// The files that have a format.
    pub(crate) fn files(&self, format: EngineFormat) -> Option<&'static CubeFiles> {
        self.files.iter().find(|files| files.formats.contains(&format))
    }

    /// The least width of a face of level 0. One level cannot be interpolated; the roughest level stays at
    /// the size that the engine wants.
    fn least_size(&self) -> usize {
        (2 * self.last).max(16)
    }
}
