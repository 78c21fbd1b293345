//! The files of `export-shrm` with `form = "components"`.

use containers::{Encoded, Texture, tensors};
use engine::{Context, Failure, OrAuto, Steps, choice};
use sh::Light;
use shrm::Reflection;
use shrm::components::{
    ComponentBasis, ComponentCount, ComponentError, ComponentMap, ComponentOptions, FittedComponents, fit,
};

use super::degree_choice::{ACCEPT, Accept};
use crate::values::{Container, Content, Encoding, FileFormat, Resolution, UntilStopped};

choice! {
    /// What a map's numbers are.
    pub(crate) enum FormName {
        /// Coefficients of spherical harmonics of the view.
        Harmonics = "harmonics",
        /// Principal components of the material, on a cube.
        Components = "components",
    }
}

/// The lights that the map does not hold, and the entries that a texture has for them.
pub(crate) type Beside<'a> = (&'a [Light], &'a [(String, String)]);

/// The texels along the edge of a face, if the manifest does not say: half a lobe of roughness 0.3.
pub(crate) const EDGE: usize = 32;

/// What the manifest says of the components.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Components {
    pub(crate) resolution: Option<Resolution>,
    pub(crate) count: Option<OrAuto<usize>>,
    pub(crate) accept: Option<Accept>,
    pub(crate) packed: bool,
    pub(crate) bake: bool,
}

impl Components {
    /// The endings of the files of one map.
    pub(crate) fn endings(container: Container) -> Vec<String> {
        let ending = container.ending();
        match container {
            Container::Ktx2 => vec![ending.into(), format!("-weights{ending}")],
            _ => vec![ending.into()],
        }
    }

    /// The files of one map. The error is noted, and a tolerance that is missed is a warning.
    pub(crate) fn files<F: FileFormat + Copy>(
        self,
        reflection: &Reflection,
        lamps: Beside<'_>,
        encoding: Encoding<F>,
        steps: &Steps<'_>,
        context: &Context<'_>,
    ) -> Result<Vec<Vec<u8>>, Failure> {
        let (beside, entries) = lamps;
        let fitted = self.fitted(reflection, steps)?;
        let map = &fitted.map;
        let recipe = Some(context.recipe());
        let files = match (encoding.container(), self.packed) {
            (Container::Safetensors, true) => vec![tensors::encode_packed_components(map, beside, recipe)?],
            (Container::Safetensors, false) => vec![tensors::encode_components(map, beside, recipe)?],
            _ => textures(map, entries, encoding, context)?.map(|file| file.bytes).into(),
        };
        let bytes: usize = files.iter().map(Vec::len).sum();
        context.reporter.note(format!("{bytes} bytes"));
        Ok(files)
    }

    /// The components of a reflection.
    fn fitted(self, reflection: &Reflection, steps: &Steps<'_>) -> Result<FittedComponents, Failure> {
        let reporter = steps.reporter();
        let edge = match self.resolution {
            Some(Resolution::Fixed(edge)) => edge,
            Some(Resolution::Auto) | None => EDGE,
        };
        let (asked, Accept(accept)) = (self.count, self.accept.unwrap_or(ACCEPT));
        let count = match asked {
            Some(OrAuto::Fixed(count)) => ComponentCount::Fixed(count),
            Some(OrAuto::Auto) | None => ComponentCount::Accept(accept),
        };
        let options = ComponentOptions { edge, count, half: self.packed, bake: self.bake };
        let material = reflection.material().ok_or_else(|| failure(ComponentError::NoMaterial))?;
        let basis = ComponentBasis::of(material).map_err(|error| failure(error.into()))?;
        let steps = steps.part(1, options.steps(&basis));
        let fitted = steps.until_stopped(|stop| fit(reflection, &basis, options, stop).map_err(failure))?;
        let (count, [p95, p99]) = (fitted.map.basis().components().len(), fitted.error);
        reporter.note(format!(
            "{count} components on a cube of {edge}: 95 % of views are within {p95:.3} stops, 99 % within {p99:.3}"
        ));
        // The choice is made by look-ups near the samples; the map's own differ a little.
        let is_missed = p95 > 1.05 * accept[0] || p99 > 1.05 * accept[1];
        if is_missed && !matches!(asked, Some(OrAuto::Fixed(_))) {
            reporter.warn(format!(
                "no number of components is enough here: 5 % of the views are off by more than {p95:.2} \
                 stops, 1 % by more than {p99:.2}, but accept = {accept:?}; {}",
                if self.bake && reflection.lamps().is_some() {
                    "lamps = \"separate\" leaves the suns and lamps, which need more, to the renderer"
                } else {
                    "a larger roughness needs fewer texels, and `resolution` sets more"
                }
            ));
        }
        Ok(fitted)
    }
}

/// The failure of a fit, with what to do.
fn failure(error: ComponentError) -> Failure {
    let help = match error {
        ComponentError::NoMaterial => {
            "leave out `degree` and `tolerance` in project-sh and project-brdf, so that the reflection has its material"
        }
        ComponentError::Tangent => "form = \"harmonics\" holds any material",
        _ => return error.into(),
    };
    Failure::new(error.to_string()).help(help)
}

/// The texture of the components, a layer for each face of each, and that of the weights, of which a texel
/// has four.
fn textures<F: FileFormat + Copy>(
    map: &ComponentMap,
    lamps: &[(String, String)],
    encoding: Encoding<F>,
    context: &Context<'_>,
) -> Result<[Encoded; 2], Failure> {
    let (count, side) = (map.basis().components().len(), map.edge(0) + 2);
    let pixels: Vec<[f32; 3]> = (0..count).flat_map(|k| map.values(k).iter().copied()).collect();
    let writer = encoding.writer(&pixels, Content::Values, context)?;
    let mut entries: Vec<(String, String)> =
        tensors::component_metadata(map).map(|(key, value)| (format!("specula.{key}"), value)).to_vec();
    entries.extend_from_slice(lamps);
    let entries: Vec<(&str, &str)> =
        entries.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect();
    let texture = Texture { width: side, height: side, layers: 6 * count, pixels, ..Texture::default() };
    let components = writer.texture(&texture, &entries)?;
    let (edge, layers) = (tensors::WEIGHTS, count.div_ceil(4));
    let values = map.basis().textures(edge);
    let texel = |index: usize| {
        let (layer, place) = (index / (edge * edge), index % (edge * edge));
        let weight = |k: usize| values.get(k * edge * edge + place).copied().unwrap_or(0.0);
        std::array::from_fn(|part| weight(4 * layer + part))
    };
    let rgba: Vec<[f32; 4]> = (0..layers * edge * edge).map(texel).collect();
    let sizes = Texture { width: edge, height: edge, layers, ..Texture::default() };
    let weights = writer.ktx2_rgba(&sizes, &rgba, &entries)?;
    Ok([components, weights])
}
