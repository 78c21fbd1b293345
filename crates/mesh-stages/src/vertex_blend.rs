//! Places the materials of a table on a mesh, with a number for each vertex from 0, the first material, to
//! 1, the last.
//!
//! ```toml
//! [stage.blend]
//! kind = "vertex-blend"
//! input = "mesh"
//! texture = "assets/noise.png"
//! ```
//!
//! A table of several materials (`tabulate-brdf` with `vary` or `materials`) and this number at
//! `shade-vertices` make a surface whose roughness or direction varies (Kautz, Sloan and Snyder 2002, figure
//! 4). The number comes from one of two places:
//!
//! - `texture`, a PNG, JPEG or WebP, is read at the mesh's texture coordinates, with interpolation; it
//!   repeats outside 0 to 1. The values of `channel` are used as stored, because they are data and not a
//!   colour.
//! - `attribute`, in the glTF file `gltf` that the mesh was imported from, has one number at each vertex
//!   (`_BLEND`), or several, of which the first is used (`COLOR_0`).
//!
//! Numbers below 0 and above 1 are clamped, and a warning counts them. The blend belongs to the input mesh
//! including its tangents, so brush the mesh first.

use std::path::Path;

use containers::tensors::OfMesh;
use containers::{DataTexture, Wrap, read_gltf_attribute};
use engine::{Artifact, Context, Digest, Failure, Kind, Output, Port, Product, choice, parameters};
use stages::artifacts;

choice! {
    /// A channel of a picture.
    pub(crate) enum Channel {
        /// Red, or the grey of a grey picture.
        Red = "red",
        /// Green.
        Green = "green",
        /// Blue.
        Blue = "blue",
        /// Alpha; 1 if there is none.
        Alpha = "alpha",
    }
}

parameters! {
    /// Parameters of `vertex-blend`.
    pub(crate) struct Parameters {
        /// The picture, relative to the manifest.
        texture: Option<String> = None,
        /// Its channel.
        channel: Channel = Channel::Red,
        /// The attribute of the vertices in the glTF file.
        attribute: Option<String> = None,
        /// The glTF file that the mesh was imported from, relative to the manifest.
        gltf: Option<String> = None,
    }
}

/// The kind `vertex-blend`.
pub(crate) struct VertexBlendKind;

impl Kind for VertexBlendKind {
    type Parameters = Parameters;

    const NAME: &'static str = "vertex-blend";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("vertex_blend.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Mesh>("mesh")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::VertexBlend::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        match (&parameters.texture, &parameters.attribute, &parameters.gltf) {
            (_, None, None) | (None, Some(_), Some(_)) => Vec::new(),
            (None, Some(_), None) => vec![("attribute", "also needs the file: gltf = \"...\"".into())],
            (None, None, Some(_)) => {
                vec![("gltf", "also needs the attribute to read: attribute = \"...\"".into())]
            }
            (Some(_), ..) => vec![("texture", "cannot be combined with attribute and gltf".into())],
        }
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let mesh = &context.inputs.get::<artifacts::Mesh>("mesh")?.0;
        let digest = Digest::of(&context.inputs.bytes("mesh")?).to_string();
        let mut value = match (&parameters.texture, &parameters.attribute, &parameters.gltf) {
            (_, Some(attribute), Some(file)) => {
                let bytes = context.files.read(Path::new(file))?;
                let folder = Path::new(file).parent().unwrap_or(Path::new(""));
                let mut beside = |other: &str| context.files.read(&folder.join(other));
                let numbers =
                    read_gltf_attribute(&bytes, attribute, &mut beside).map_err(|failure: Failure| {
                        failure.context(format!("cannot read {attribute} of {file}"))
                    })?;
                let (found, expected) = (numbers.len(), mesh.positions().len());
                if found != expected {
                    return Err(Failure::new(format!(
                        "{file} has {found} vertices, and the mesh has {expected}"
                    ))
                    .help("name the file that the mesh was imported from"));
                }
                numbers
            }
            (texture, ..) => {
                let file = texture.as_deref().ok_or_else(|| {
                    Failure::new("nothing says which material is where")
                        .help("give a texture, or an attribute and its gltf file")
                })?;
                let texture = DataTexture::read(&context.files.read(Path::new(file))?)
                    .map_err(|error| error.within(file))?;
                let coordinates = mesh.coordinates().ok_or_else(|| {
                    Failure::new("the mesh has no texture coordinates")
                        .help("use an attribute of its vertices")
                })?;
                let channel = parameters.channel as usize;
                let at = |place: &[f32; 2]| {
                    let [value] = texture.at(*place, [Wrap::Repeat; 2], |texel| [texel[channel]]);
                    value
                };
                coordinates.iter().map(at).collect()
            }
        };
        let outside = value.iter().filter(|value| !(0.0..=1.0).contains(*value)).count();
        if outside > 0 {
            context.reporter.warn(format!("{outside} of {} vertices are outside of 0 to 1", value.len()));
            value
                .iter_mut()
                .for_each(|value| *value = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) });
        }
        Output::artifact(artifacts::VertexBlend(OfMesh { value, mesh: digest }))
    }
}
