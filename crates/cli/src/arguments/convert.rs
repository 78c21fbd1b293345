//! The arguments of `specula convert`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::values;

/// What `convert` writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ConvertTarget {
    /// An image or texture of the environment
    Environment,
    /// The scale space, from which compact maps of all materials look up light
    Taps,
}

#[derive(Args, Debug)]
pub(crate) struct ConvertArguments {
    /// Images or textures of environments, folders of six faces or of images, and globs
    #[arg(required = true, value_name = "INPUT")]
    pub(crate) inputs: Vec<PathBuf>,
    /// The file to write, whose extension sets the format; or a folder, for several images, for a cube of
    /// pictures, or for the light of an engine or of compact maps
    #[arg(long, short, value_name = "OUT")]
    pub(crate) output: PathBuf,
    #[arg(long, value_name = "NAME", conflicts_with = "to", value_parser = values::engine, help = values::engines_to_convert_for())]
    pub(crate) engine: Option<String>,
    /// What to make from the environment
    #[arg(long, value_enum, default_value_t = ConvertTarget::Environment)]
    pub(crate) to: ConvertTarget,
    /// With --engine: texels along the edge of a face of the sky, or none [default: as fine as the input, at
    /// most 2048]
    #[arg(long, value_name = "N|none", value_parser = values::sky)]
    pub(crate) sky: Option<String>,
    /// With --engine: whether suns and lamps stay in the image or become separate lights
    #[arg(long, value_name = "image|light")]
    pub(crate) sun: Option<String>,
    /// With --to taps or --sun light: how many of the strongest suns and lamps become separate lights, or
    /// all [default: 8]
    #[arg(long, value_name = "N|all", value_parser = values::lights)]
    pub(crate) lights: Option<String>,
    /// The layout of the input: auto, lat-long, probe, mirror-ball, cube, cube-cross, cube-strip, ...
    #[arg(long, value_name = "LAYOUT")]
    pub(crate) from: Option<String>,
    /// The light of the rest of the sphere if the file declares that the picture shows only a part (a crop
    /// of a panorama, a fisheye): black, mean, edge, or a colour such as 0.1,0.1,0.2 [default: black]
    #[arg(long, value_name = "LIGHT")]
    pub(crate) fill: Option<String>,
    /// The layout to write: lat-long, cube, cube-strip or cube-cross [default: lat-long]; with --to taps
    /// cube-array or atlas [default: cube-array]
    #[arg(long, value_name = "LAYOUT")]
    pub(crate) layout: Option<String>,
    /// Rows of a lat-long image, or texels along the edge of a cube's face [default: as fine as the input;
    /// of an engine's cube 256]; with --to taps those of the finest level [default: 64]
    #[arg(long, short, value_name = "N")]
    pub(crate) resolution: Option<u32>,
    /// The format to write: exr, rgbe, png, ktx2 or dds [default: by the extension of OUT]; with --to taps
    /// ktx2, dds, exr or safetensors [default: ktx2, or safetensors by the extension of OUT]; with --engine
    /// how texels are stored, such as rgba16f or bc6h [default: what the engine prefers]
    #[arg(long, value_name = "FORMAT")]
    pub(crate) format: Option<String>,
    /// The numbers to write: half or float [default: half, or float if a value exceeds the largest half]
    #[arg(long, value_name = "PRECISION")]
    pub(crate) precision: Option<String>,
    /// How to pack the texels of a .ktx2 or .dds: rgb9e5 or bc6h [default: not packed]
    #[arg(long, value_name = "TEXELS")]
    pub(crate) texels: Option<String>,
    /// Write a .ktx2 or .dds with its levels of detail
    #[arg(long)]
    pub(crate) levels: bool,
    /// Compress a .ktx2 with Zstandard, without loss
    #[arg(long)]
    pub(crate) zstd: bool,
    /// Turn the light about the vertical by these degrees, to the left
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) yaw: f64,
    /// Tilt the horizon in front down by these degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) pitch: f64,
    /// Turn the light about the forward direction by these degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) roll: f64,
    /// Make the light brighter by these stops, such as -1.5
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) exposure: f64,
    /// What was white: the temperature of the light in kelvin, such as 3200, or a colour, such as 0.9,0.8,0.6
    #[arg(long, value_name = "KELVIN|COLOUR", conflicts_with = "grey_card")]
    pub(crate) white_balance: Option<String>,
    /// Where the picture shows a grey card, which becomes a grey of 0.18: its left column, upper row, width
    /// and height in pixels, such as 2140,1033,40,30
    #[arg(long, value_name = "X,Y,W,H")]
    pub(crate) grey_card: Option<String>,
    /// What happens to NaN, infinite and negative values: zero-negative, error, zero or clamp [default:
    /// zero-negative]
    #[arg(long, value_name = "WHAT")]
    pub(crate) bad_pixels: Option<String>,
    /// The layer of an OpenEXR file: a part's name, a prefix of channels, or "part.prefix"
    #[arg(long, value_name = "LAYER")]
    pub(crate) layer: Option<String>,
    /// The primaries of the input: rec709, rec2020, acescg, aces2065-1, p3, prophoto, adobergb, xyz, or a
    /// name in OCIO [default: as the file says, or rec709]
    #[arg(long, value_name = "SPACE")]
    pub(crate) colour_space: Option<String>,
    #[arg(long, value_name = "PRESET", help = values::engines_of_cubes())]
    pub(crate) preset: Option<String>,
    /// Print the manifest that does the same, without converting anything
    #[arg(long)]
    pub(crate) manifest: bool,
}
