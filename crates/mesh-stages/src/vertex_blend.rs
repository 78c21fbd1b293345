//! Places the materials of a table on a mesh, with a number for each vertex from 0, the first material, to
//! 1, the last, or with two numbers.
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
//! 4). If two parameters of the table vary, such as roughness and anisotropy, a second picture has the number
//! for the second, or another channel of the same one:
//!
//! ```toml
//! [stage.worn]
//! kind = "vertex-blend"
//! input = "mesh"
//! texture = "assets/worn.png"
//! channel = "green"
//! second-channel = "blue"              # of second-texture, if there is one
//! ```
//!
//! The numbers come from one of two places:
//!
//! - `texture`, a PNG, JPEG or WebP, is read at the mesh's texture coordinates, with interpolation; it
//!   repeats outside 0 to 1. The values of `channel` are used as stored, because they are data and not a
//!   colour.
//! - `attribute`, in the glTF file `gltf` that the mesh was imported from, has one number at each vertex
//!   (`_BLEND`), or several, of which the first is used (`COLOR_0`). `second-attribute` has the second
//!   number.
//!
//! Numbers below 0 and above 1 are clamped, and a warning counts them. The blend belongs to the input mesh
//! including its tangents, so brush the mesh first.

use std::path::Path;

use containers::tensors::OfMesh;
use containers::{DataTexture, Wrap, read_gltf_attribute};
use engine::{Artifact, Context, Digest, Failure, Kind, Output, Port, Product, choice, parameters};
use mesh::Mesh;
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
        /// The picture of the second number. Default: `texture`, if `second-channel` is given.
        second_texture: Option<String> = None,
        /// Its channel. Default: red, if `second-texture` is given.
        second_channel: Option<Channel> = None,
        /// The attribute of the vertices in the glTF file.
        attribute: Option<String> = None,
        /// The attribute with the second number.
        second_attribute: Option<String> = None,
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
        let Parameters { texture, second_texture, second_channel, attribute, second_attribute, gltf, .. } =
            parameters;
        if texture.is_some() {
            let of_vertices = [
                ("attribute", attribute.is_some()),
                ("second-attribute", second_attribute.is_some()),
                ("gltf", gltf.is_some()),
            ];
            let given = of_vertices.into_iter().find(|(_, given)| *given);
            return given
                .map(|(name, _)| (name, "cannot be combined with `texture`".into()))
                .into_iter()
                .collect();
        }
        let mut errors = Vec::new();
        for (name, given) in
            [("second-texture", second_texture.is_some()), ("second-channel", second_channel.is_some())]
        {
            if given {
                errors.push((name, "also needs the picture of the first number: texture = \"...\"".into()));
            }
        }
        match (attribute, gltf) {
            (Some(_), None) => errors.push(("attribute", "also needs the file: gltf = \"...\"".into())),
            (None, Some(_)) => {
                errors.push(("gltf", "also needs the attribute to read: attribute = \"...\"".into()));
            }
            (None, None) if second_attribute.is_some() => errors.push((
                "second-attribute",
                "also needs that of the first number and the file: attribute = \"...\", gltf = \"...\""
                    .into(),
            )),
            _ => {}
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let mesh = &context.inputs.get::<artifacts::Mesh>("mesh")?.0;
        let digest = Digest::of(&context.inputs.bytes("mesh")?).to_string();
        let [first, second] = match (&parameters.texture, &parameters.attribute, &parameters.gltf) {
            (_, Some(attribute), Some(file)) => {
                let of = |attribute: &str| of_attribute(context, mesh, file, attribute);
                [Some(of(attribute)?), parameters.second_attribute.as_deref().map(of).transpose()?]
            }
            (Some(texture), ..) => {
                let of = |file: &str, channel| of_texture(context, mesh, file, channel);
                let second = match (&parameters.second_texture, parameters.second_channel) {
                    (None, None) => None,
                    (file, channel) => {
                        Some(of(file.as_ref().unwrap_or(texture), channel.unwrap_or(Channel::Red))?)
                    }
                };
                [Some(of(texture, parameters.channel)?), second]
            }
            _ => [None, None],
        };
        let first = first.ok_or_else(|| {
            Failure::new("nothing says which material is where")
                .help("give a texture, or an attribute and its gltf file")
        })?;
        let second = second.unwrap_or_else(|| vec![0.0; first.len()]);
        let mut value: Vec<[f32; 2]> =
            first.into_iter().zip(second).map(|(first, second)| [first, second]).collect();
        let is_outside = |place: &&[f32; 2]| place.iter().any(|number| !(0.0..=1.0).contains(number));
        let outside = value.iter().filter(is_outside).count();
        if outside > 0 {
            context.reporter.warn(format!("{outside} of {} vertices are outside of 0 to 1", value.len()));
            for number in value.as_flattened_mut() {
                *number = if number.is_nan() { 0.0 } else { number.clamp(0.0, 1.0) };
            }
        }
        Output::artifact(artifacts::VertexBlend(OfMesh { value, mesh: digest }))
    }
}

/// The first number of an attribute at each vertex.
fn of_attribute(
    context: &Context<'_>,
    mesh: &Mesh,
    file: &str,
    attribute: &str,
) -> Result<Vec<f32>, Failure> {
    let bytes = context.files.read(Path::new(file))?;
    let folder = Path::new(file).parent().unwrap_or(Path::new(""));
    let mut beside = |other: &str| context.files.read(&folder.join(other));
    let numbers = read_gltf_attribute(&bytes, attribute, &mut beside)
        .map_err(|failure: Failure| failure.context(format!("cannot read {attribute} of {file}")))?;
    let (found, expected) = (numbers.len(), mesh.positions().len());
    if found != expected {
        return Err(Failure::new(format!("{file} has {found} vertices, and the mesh has {expected}"))
            .help("name the file that the mesh was imported from"));
    }
    Ok(numbers)
}

/// A channel of a picture at the texture coordinates of each vertex.
fn of_texture(context: &Context<'_>, mesh: &Mesh, file: &str, channel: Channel) -> Result<Vec<f32>, Failure> {
    let texture =
        DataTexture::read(&context.files.read(Path::new(file))?).map_err(|error| error.within(file))?;
    let coordinates = mesh.coordinates().ok_or_else(|| {
        Failure::new("the mesh has no texture coordinates").help("use an attribute of its vertices")
    })?;
    let at = |place: &[f32; 2]| {
        let [value] = texture.at(*place, [Wrap::Repeat; 2], |texel| [texel[channel as usize]]);
        value
    };
    Ok(coordinates.iter().map(at).collect())
}
