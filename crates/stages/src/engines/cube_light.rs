//! A prefiltered cube as an engine loads it: turned to where the engine looks, with its irradiance.

use std::borrow::Borrow;

use containers::lighting_json::{self, Preset};
use containers::{Encoded, TexelFormat, Texture, write_dds, write_ktx2_zstd};
use engine::Failure;
use envmap::CubeMap;
use rayon::prelude::*;
use sh::Expansion;
use shrm::{Distribution, PrefilterKernel, prefilter_series};
use sphere::{Cube, DVec3, Direction, Face, from_file, to_cube};

/// The direction, in the frame of files (+Y up, the centre of a lat-long image looks along +Z), of which the
/// texel at cube coordinates c (KTX2's face table) holds the light.
pub(crate) type DirectionAt = fn(DVec3) -> DVec3;

/// The number of texels along the edge of a cube of irradiance, which is smooth.
const IRRADIANCE_EDGE: usize = 32;

/// What the files of a cube are made of.
pub(crate) struct CubeLight<'a> {
    /// The levels, in the order of the engine's file.
    pub(crate) texture: Texture,
    /// How its texels are stored.
    pub(crate) texels: TexelFormat,
    /// Where its texels look.
    pub(crate) direction_at: DirectionAt,
    /// The series of the light.
    pub(crate) series: &'a Expansion,
    /// The part of the series that few coefficients hold without ringing.
    pub(crate) irradiance: &'a Expansion,
    /// How the files are made, for `specula inspect`.
    pub(crate) recipe: Option<&'a str>,
}

impl CubeLight<'_> {
    /// The cube as KTX2.
    pub(crate) fn ktx2(&self) -> Result<Encoded, Failure> {
        Ok(write_ktx2_zstd(&self.texture, self.texels, self.recipe, &[])?)
    }

    /// The cube as DDS.
    pub(crate) fn dds(&self) -> Result<Encoded, Failure> {
        Ok(write_dds(&self.texture, self.texels)?)
    }

    /// The irradiance as JSON, in the convention of a preset.
    pub(crate) fn irradiance_json(&self, preset: Preset) -> Result<Vec<u8>, Failure> {
        Ok(lighting_json::encode(&self.irradiance.clone().into(), preset, self.recipe)?)
    }

    /// The irradiance over pi, in all degrees that the light holds, as a cube of one level.
    pub(crate) fn irradiance_cube(&self) -> Result<Texture, Failure> {
        let kernel = PrefilterKernel::new(Distribution::Lambert, 1.0)
            .map_err(|error| Failure::new(error.to_string()))?;
        let cube = Cube { edge: IRRADIANCE_EDGE };
        let mut texels =
            prefilter_series(self.series, &kernel, cube).map_err(|error| Failure::new(error.to_string()))?;
        texels.as_flattened_mut().iter_mut().for_each(|value| *value = value.max(0.0));
        let map = CubeMap::new(cube, texels).ok_or_else(|| Failure::new("a cube without texels"))?;
        Ok(texture([&map], self.direction_at))
    }

    /// The rows of a preset's one table of irradiance.
    pub(crate) fn irradiance_rows(&self, preset: Preset) -> Vec<[f64; 3]> {
        let tables = preset.convert(self.irradiance);
        let rows = tables.iter().flat_map(|table| &table.rows);
        rows.filter_map(|row| row.first_chunk::<3>().copied()).collect()
    }
}

/// For each texel of an engine's cube, in the order of its file, the texel of a cube by KTX2's table in the
/// frame of files that holds the same light.
pub(crate) fn texels(cube: Cube, direction_at: DirectionAt) -> impl IndexedParallelIterator<Item = usize> {
    let edge = cube.edge;
    (0..cube.len()).into_par_iter().map(move |index| {
        let (face, row, column) = (index / (edge * edge), index / edge % edge, index % edge);
        let c = to_cube(cube.direction(Face::ALL[face], row, column).vector());
        let direction = Direction::normalised(from_file(direction_at(c)));
        // The centre of a texel again, for the map permutes axes and flips their signs.
        let (face, s, t) = cube.position(direction);
        let at = |share: f64| ((share * edge as f64) as usize).min(edge - 1);
        (face as usize * edge + at(t)) * edge + at(s)
    })
}

/// Makes a texture of an engine's from levels. Those that are given as values are freed one by one.
pub(crate) fn texture(
    levels: impl IntoIterator<Item = impl Borrow<CubeMap>>,
    direction_at: DirectionAt,
) -> Texture {
    let mut texture = Texture { faces: 6, ..Texture::default() };
    for (level, map) in levels.into_iter().enumerate() {
        let map = map.borrow();
        let pixels = texels(map.cube(), direction_at).map(|texel| map.pixels()[texel]).collect();
        if level == 0 {
            (texture.width, texture.height) = (map.cube().edge, map.cube().edge);
            texture.pixels = pixels;
        } else {
            texture.smaller_levels.push(pixels);
        }
    }
    texture
}
