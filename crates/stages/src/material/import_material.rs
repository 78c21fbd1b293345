//! Reads a material: a TOML file that names a reflection model and its parameters, a preset, a measured BRDF,
//! or a material of a glTF, OpenPBR or MaterialX file.
//!
//! ```toml
//! [stage.material]
//! kind = "import-material"
//! source = "assets/materials/*.toml"
//!
//! [stage.pot]
//! kind = "import-material"
//! material = "copper"                # a preset, without a file
//! ```
//!
//! Every file that `source` matches gives one item. All errors of a file are reported together, each with its
//! line and column. A colour is `[red, green, blue]` in linear Rec. 709, or one number for a grey.
//!
//! ```toml
//! # gold.toml
//! model = "standard"
//! base_color = [1.0, 0.77, 0.34]
//! metallic = 1
//! roughness = 0.3
//! ```
//!
//! A material that reflects more light than falls on it is accepted with a warning. `specula inspect` shows
//! the albedo of a material file by angle, and whether the material is reciprocal. With `--picture` it also
//! draws the material to a PNG: the lobes for light from four angles, the albedo by angle as curves, and a
//! ball.
//!
//! ## Presets
//!
//! A preset is a material with a name, whose colour was measured: `material = "copper"` in a stage without
//! `source`, or in a material file and its layers, where other keys replace the preset's:
//!
//! ```toml
//! # pot.toml
//! material = "copper"
//! roughness = 0.6
//! ```
//!
//! All presets are of the model `standard`. `specula init --materials` writes them as files, which say where
//! the numbers come from; `specula inspect copper` and `specula preview copper` show them.
//!
//! | preset | what it is |
//! | --- | --- |
//! {list: presets}
//!
//! ## Models
//!
//! {list: models}
//!
//! ## Measured materials
//!
//! `model = "measured"` reads a table. The table's file is part of the material: the item is rerun if either
//! file changes.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `file` | a path from this file's folder; required | the measured BRDF |
//! | `format` | `merl`, `cornell`, `curet` or `table`; default: by the file's ending, `.binary`, `.brdf`, `.curet` or `.csv` | the format of the file |
//! | `sample` | a number from 1 on | the sample of the CURET database; `file` is then the folder of its files |
//! | `scale` | a colour, each a number from 0 to 1e6; default 1 | what the table is multiplied by |
//!
//! `source` may also name such a file itself.
//!
//! A `.csv` has one measurement a line, on a grid or scattered: where the light and the view are, in degrees
//! or as vectors, and the BRDF in 1/sr. Its first line says which, and whether the surface has a direction
//! (brushed metal, cloth), x being the tangent:
//!
//! ```csv
//! theta_i,theta_o,phi,r,g,b
//! theta_i,phi_i,theta_o,phi_o,r,g,b
//! x_i,y_i,z_i,x_o,y_o,z_o,r,g,b
//! ```
//!
//! Measurements of both kinds become a smooth table: a layered model is fitted to them, and their error is
//! smoothed and fades away from them, so that no lobe appears where nothing was measured. The build notes how
//! well a fit meets measurements that it has not seen. Past the last measured angle the BRDF stays constant.
//!
//! ### CURET
//!
//! The files of the Columbia-Utrecht database are read as they are published: `table.txt` with the directions
//! of the 205 measurements, and `rbrdf.dat`, `gbrdf.dat` and `bbrdf.dat` with the values of all 61 samples.
//!
//! ```toml
//! # velvet.toml
//! model = "measured"
//! file = "curet"
//! sample = 7
//! ```
//!
//! What their calibration left below zero counts as 0. A `.curet` file is a layout of our own for one sample
//! or for measurements that are as few: the first line is `degrees` or `radians`, then each of 205 lines has
//! `theta_v phi_v theta_i phi_i r g b`, the angles of the view, those of the light, and the BRDF in 1/sr,
//! with blanks between them; `#` starts a comment.
//!
//! 205 measurements are too few for a table. As in the papers that use them, they are fitted with Zernike
//! polynomials, here the 55 reciprocal and isotropic products up to order 8, and cut at 0 (Koenderink and van
//! Doorn 1998). The build notes the error at the measurements. For the 61 samples, in the mean of the
//! colours, it is 6 % (half of the samples have less), and 11 % at measurements that a trial left out, a
//! fifth at a time. Known surfaces, measured as in the database, show how it is where nothing is measured, up
//! to 80 degrees from the normal. All are RMS errors, as shares of the RMS value:
//!
//! | surface | at the measurements | elsewhere | elsewhere, as a `.csv` |
//! | --- | --- | --- | --- |
//! | `oren-nayar`, sigma 30 degrees | 0.4 % | 2.0 % | 4.1 % |
//! | `standard` with sheen, roughness 1 | 0.1 % | 0.9 % | 3.1 % |
//! | `standard`, roughness 0.7 | 0.5 % | 9.6 % | 2.8 % |
//! | `standard`, roughness 0.5 | 6 % | 51 % | 2.1 % |
//! | `standard`, roughness 0.3 | 30 % | 100 % | 15 % |
//!
//! So the fit is for matte surfaces and cloth. Write a sample with a highlight as a `.csv` instead.
//!
//! ## Materials of glTF files
//!
//! `source` may name a `.gltf` or `.glb` file. If it has several materials, `material` says which one is
//! meant:
//!
//! ```toml
//! [stage.lens]
//! kind = "import-material"
//! source = "assets/helmet.glb"
//! material = "LensesMat"
//! ```
//!
//! A stage reads one material of a file. For several, write a material file for each, which `source` can
//! match together, with `model = "gltf"`:
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `file` | a path from this file's folder; required | the `.gltf` or `.glb` file |
//! | `material` | a name, or a number from 0 on; required if there are several | the material of the file |
//!
//! Materials of one name are told apart by their numbers, which the error lists: `material = 1`.
//!
//! The material becomes one of the model `standard`: `pbrMetallicRoughness` and the extensions
//! `KHR_materials_ior`, `KHR_materials_specular`, `KHR_materials_clearcoat` and `KHR_materials_sheen` are
//! read. A material here is the same everywhere, so a texture becomes the mean of all its texels (colours
//! decoded from sRGB first, alpha ignored, whatever part of it the mesh shows), times its factor; notes
//! name what was averaged. The picture of the base colour stays beside the material: previews show it on
//! meshes of the file, at most 1024 texels along a side, and everything else uses the mean. Textures are
//! read as PNG, JPEG or WebP, also from files beside a `.gltf` or in other folders (`../textures/a.png`):
//! the item is rerun if one of them changes. Normal and occlusion textures are ignored, and a roughness
//! below the least of the model becomes the least. Warnings name other extensions, transparency, emitted
//! light, vertex colours, and a `KHR_texture_transform` that may show a part of a texture. If the file
//! *requires* an extension that is not read, the material is an error, unless the extension belongs to
//! other materials of the file, or to meshes, lights or animations.
//!
//! ## OpenPBR and MaterialX
//!
//! `source` may name a `.mtlx` file, with `material` if it has several, and `model = "materialx"` names one
//! in a material file, as `gltf` does. Surface shaders of the kinds `standard_surface` and `open_pbr_surface`
//! become a material of the model `standard`; C is the weight of the coat, T = 1 + C (coat_color - 1):
//!
//! | `standard` | `standard_surface` | `open_pbr_surface` |
//! | --- | --- | --- |
//! | `base_color` | T base base_color | T base_weight base_color; of a metal times specular_weight |
//! | `metallic` | metalness | base_metalness |
//! | `roughness` | specular_roughness; coat_affect_roughness blurs it under a coat | specular_roughness; a rough coat blurs it |
//! | `ior` | specular_IOR | specular_ior, divided by coat_ior under a coat, with specular_weight on F_0 |
//! | `specular`, `specular_color` | specular, T specular_color | less than 1 below F_0 = 0.02, T specular_color |
//! | `clearcoat`, `clearcoat_roughness` | coat, coat_roughness | coat_weight, coat_roughness |
//! | `sheen`, `sheen_roughness` | sheen sheen_color, the root of sheen_roughness | fuzz_weight fuzz_color, fuzz_roughness^1.25 |
//!
//! The base of what transmits light is darker by that share, and light that scatters below the surface leaves
//! it at once, in subsurface_color. Warnings, each with its line, name these and what is left out: emitted
//! light, opacity, anisotropy, thin films, the rough base, a metal's tinted edge, the coat's own index and
//! what it does to the colours below. Values of connected `constant` nodes are read; textures and other nodes
//! are not, and the shader's default stands for them. Colours of the spaces `srgb_texture` and
//! `acescg` are converted.
//!
//! ## Layers
//!
//! `layers` sums several materials, each a table with its `model`. A layer's weight is in its own parameters.
//!
//! ```toml
//! # lacquer.toml
//! layers = [
//!     { model = "lambert", albedo = [0.4, 0.05, 0.02] },
//!     { model = "torrance-sparrow", roughness = 0.1, ior = 1.5 },
//! ]
//! ```
//!
//! If all layers are centred on one direction, so is their sum. Otherwise layers that are centred on the
//! normal are projected about the reflection vector, which takes more degrees. `kajiya-kay` is centred on the
//! tangent and cannot be combined with other models. Layers may hold layers, at most 32 deep.

use containers::MaterialChoice;
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, Reporter, parameters};

use super::material_file::{check_material, read_material};
use super::material_manual;
use super::presets::{self, Preset};
use crate::values::{ChosenMaterial, artifacts};

parameters! {
    /// Parameters of `import-material`; those of a material are in its file.
    pub(crate) struct Parameters {
        /// The material of a glTF or MaterialX file (default: the only one), or, without `source`, the name
        /// of a preset.
        material: Option<ChosenMaterial> = None,
    }
}

/// The kind `import-material`.
pub(crate) struct ImportMaterial;

impl Kind for ImportMaterial {
    type Parameters = Parameters;

    const NAME: &'static str = "import-material";
    const REVISION: u32 = 2;
    const TEXT: &'static str = include_str!("import_material.rs");
    const SOURCE: bool = true;
    const BUILT_IN: Option<&'static str> = Some(presets::KEY);

    fn manual(text: String) -> String {
        material_manual::fill_in(&text)
    }

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Material::TYPE)
    }

    fn built_in(parameters: &Parameters) -> Result<Option<String>, String> {
        match &parameters.material {
            Some(ChosenMaterial(MaterialChoice::Name(name))) => {
                Preset::named(name).map(|preset| Some(preset.name.to_owned()))
            }
            _ => Ok(None),
        }
    }

    fn check_source(parameters: &Parameters, context: &Context<'_>) -> Result<(), Failure> {
        let path = context.files.source()?;
        if context.files.is_folder(path) {
            return Err(folder(&path.file_name().unwrap_or(path.as_os_str()).to_string_lossy()));
        }
        let choice = parameters.material.as_ref().map(|ChosenMaterial(choice)| choice);
        check_material(path, choice, &|path| context.files.open(path))
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        if let (Err(_), Ok(Some(name))) = (context.files.source(), Self::built_in(parameters)) {
            let preset = Preset::named(&name).map_err(Failure::new)?;
            let found = read_material(&name, preset.text.as_bytes(), None, &|path| context.files.read(path))?;
            return Output::artifact(artifacts::Material(found.material));
        }
        let reporter = &context.reporter;
        let path = context.files.source()?;
        let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let read = context.files.read(path);
        let bytes =
            read.map_err(|failure| if context.files.is_folder(path) { folder(&file) } else { failure })?;
        let choice = parameters.material.as_ref().map(|ChosenMaterial(choice)| choice);
        let found = read_material(&file, &bytes, choice, &|path| context.files.read(path))?;
        found.notes.into_iter().for_each(|note| reporter.note(note));
        found.warnings.into_iter().for_each(|warning| reporter.warn(warning));
        warn_of_excess(&found.material, reporter);
        artifacts::Material(found.material).output_with_texture(found.base_color.as_ref())
    }
}

fn folder(name: &str) -> Failure {
    Failure::new(format!("{name} is a folder, not a material"))
        .help("name a file, or every file in it: source = \"folder/*.toml\"")
}

/// Warns of a material that reflects more than it receives.
fn warn_of_excess(material: &brdf::Material, reporter: &Reporter) {
    let checks = brdf::checks(material);
    if checks.makes_light() {
        let most = checks.greatest();
        reporter.warn(format!(
            "the material reflects more light than falls on it: {:.3} times as much when viewed {} degrees from the normal",
            most.greatest(),
            most.theta,
        ));
    }
}
