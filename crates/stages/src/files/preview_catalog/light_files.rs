//! The light in the files that an item exports, as an engine lights a surface with it.

use engine::{Digest, Failure, ItemIndex, Plan, ResultsSnapshot};
use envmap::Environment;
use preview::PrefilteredCube;
use sh::Light;

use super::last_build::handle;
use super::light_alone::{ROUGHNESSES, exported_light, prefiltered};
use crate::engines::{ExportedLight, LightInFile};
use crate::values::artifacts;

/// What an export lights a surface with.
pub(super) enum LitBy {
    /// A cube, and the level that each of [`ROUGHNESSES`] reads.
    Cube(PrefilteredCube, [f64; ROUGHNESSES.len()]),
    /// An image, which the engine filters itself.
    Image(Environment),
}

/// The files of an export that light a surface.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct LightFiles {
    /// The image or the cube.
    image: Digest,
    /// The lights beside it, if they have a file.
    lights: Option<Digest>,
}

impl LightFiles {
    /// The files of an item, if the last build has written them.
    pub(super) fn of(plan: &Plan, results: &ResultsSnapshot, item: ItemIndex) -> Option<Self> {
        let lights = exported_light(plan, item)?.lights_file();
        let lights = lights.and_then(|file| results.file_digest(item, file));
        Some(Self { image: results.file_digest(item, 0)?, lights })
    }
}

/// The light in the files of an item: that of the image, and the lights beside it.
pub(super) fn lit_by(
    plan: &Plan,
    results: &ResultsSnapshot,
    item: ItemIndex,
    files: LightFiles,
) -> Result<(LitBy, Vec<Light>), Failure> {
    let light = exported_light(plan, item).ok_or_else(|| Failure::new("this stage does not export light"))?;
    let suns = match files.lights {
        Some(file) => light.read_lights(&results.read_file(file)?)?,
        None => Vec::new(),
    };
    let levels = match light.read(&results.read_file(files.image)?)? {
        LightInFile::Image(image) => return Ok((LitBy::Image(image), suns)),
        LightInFile::Cube(levels) => levels,
    };
    let of_levels = match light {
        ExportedLight::Engine { .. } => Vec::new(),
        ExportedLight::Texture => roughness_of_levels(plan, results, item)?,
    };
    let cube = PrefilteredCube::new(levels).ok_or_else(|| Failure::new("the cube has no levels"))?;
    let size = cube.levels()[0].cube().edge;
    let level = |roughness| cube.nearest(light.level(roughness, size, &of_levels));
    let levels = ROUGHNESSES.map(level);
    Ok((LitBy::Cube(cube, levels), suns))
}

/// The roughness of each level of the cube that an item exports.
fn roughness_of_levels(plan: &Plan, results: &ResultsSnapshot, item: ItemIndex) -> Result<Vec<f64>, Failure> {
    let item = prefiltered(plan, item).ok_or_else(|| Failure::new("the cube is not prefiltered"))?;
    let cube = handle(plan, results, item)?.get::<artifacts::Prefiltered>()?;
    Ok(cube.0.levels.iter().map(|level| level.roughness).collect())
}
