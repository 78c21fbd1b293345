//! Reads a material: a TOML file that names a reflection model and its parameters, a measured BRDF, or a
//! material of a glTF file.
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
//! ## Models
//!
//! ### `standard`
//!
//! The material of glTF: a dielectric or a metal, with a coat, sheen or neither.
//!
//! Start here: these are the parameters of glTF 2.0 and of most tools for artists. Light that the highlight
//! loses between facets is added to the body of the material, so that a white material is white at any
//! roughness. A file without `metallic` is a dielectric, such as plastic or varnished wood; in a glTF file
//! without `metallicFactor` the material is a metal, and is imported as one.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `base_color` | a colour, each a number from 0 to 1; default 1 | the colour of the matte base, or of the metal |
//! | `metallic` | a number from 0 to 1; default 0 | 0 for a dielectric, 1 for a metal, or between for a mixture |
//! | `roughness` | a number from 0.01 to 1; required | the width of the highlight: alpha is its square |
//! | `ior` | a number from 1 to 10; default 1.5 | the index of refraction of the dielectric (glass 1.5, water 1.33) |
//! | `specular` | a number from 0 to 1; default 1 | the weight of the dielectric's highlight |
//! | `specular_color` | a colour, each a number from 0 to 1e6; default 1 | a factor on the dielectric's reflectance at normal incidence; the product is at most 1 |
//! | `clearcoat` | a number from 0 to 1; default 0 | the weight of the clear coat |
//! | `clearcoat_roughness` | a number from 0.01 to 1; default 0.01 | the width of the coat's highlight |
//! | `sheen` | a colour, each a number from 0 to 1; default 0 | the colour of the sheen |
//! | `sheen_roughness` | a number from 0.1 to 1; default 0.5 | how far the fibres of the sheen lean: small values shine toward grazing only |
//!
//! ### `lambert`
//!
//! Matte, the same from every view.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `albedo` | a colour, each a number from 0 to 1e6; required | the share of light that is reflected, 0 to 1 |
//!
//! ### `oren-nayar`
//!
//! A rough matte surface.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `albedo` | a colour, each a number from 0 to 1e6; required | the share of light that a facet reflects, 0 to 1 |
//! | `sigma` | a number of degrees from 0 to 90; required | the standard deviation of the facets' angle from the surface, in degrees; 0 is lambert |
//!
//! ### `phong`
//!
//! A highlight about the reflection vector, of one shape from every view.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `exponent` | a number from 0 to 1e9; required | the sharpness of the highlight: the power of the cosine |
//! | `specular` | a colour, each a number from 0 to 1e6; default 1 | the weight of the highlight |
//!
//! ### `blinn-phong`
//!
//! A highlight about the half vector.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `exponent` | a number from 0 to 1e9; required | the sharpness of the highlight: the power of the half vector's cosine |
//! | `specular` | a colour, each a number from 0 to 1e6; default 1 | the weight of the highlight |
//!
//! ### `microfacet`
//!
//! The paper's simplified rough surface (equation 11): a Gaussian of the half vector's angle.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `sigma` | a number from 1e-4 to 100; required | the width of the highlight: the angle of the half vector from the normal, in radians, at which it has fallen to 1/e |
//! | `specular` | a colour, each a number from 0 to 1e6; default 1 | the weight of the highlight |
//!
//! ### `torrance-sparrow`
//!
//! A rough surface with Gaussian slopes, masking and Fresnel.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `roughness` | a number from 0.01 to 1; required | the width of the highlight: the tangent of the half vector's angle at which the facets have thinned out to 1/e |
//! | `ior` | a number from 1 to 10; optional | the index of refraction of a dielectric (glass 1.5, water 1.33); or give `n` and `k` |
//! | `n` | a colour, each a number from 0.01 to 50; optional | the index of refraction of a conductor, with `k` |
//! | `k` | a colour, each a number from 0 to 50; optional | the extinction of a conductor, with `n` |
//! | `specular` | a colour, each a number from 0 to 1e6; default 1 | the weight of the highlight |
//!
//! ### `ggx`
//!
//! A rough surface with a long-tailed highlight, stretched or not, masking and Fresnel.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `roughness` | a number from 0.01 to 1; required unless `roughness_x` and `roughness_y` are given | the width of the highlight: alpha is its square |
//! | `roughness_x` | a number from 0.01 to 1; optional | the width along the tangent; default `roughness` |
//! | `roughness_y` | a number from 0.01 to 1; optional | the width across the tangent; default `roughness` |
//! | `ior` | a number from 1 to 10; optional | the index of refraction of a dielectric (glass 1.5, water 1.33); or give `n` and `k` |
//! | `n` | a colour, each a number from 0.01 to 50; optional | the index of refraction of a conductor, with `k` |
//! | `k` | a colour, each a number from 0 to 50; optional | the extinction of a conductor, with `n` |
//! | `specular` | a colour, each a number from 0 to 1e6; default 1 | the weight of the highlight |
//!
//! ### `ward`
//!
//! A Gaussian highlight, stretched along or across the tangent or not.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `roughness` | a number from 0.01 to 1; required unless `roughness_x` and `roughness_y` are given | the width of the highlight: the tangent of the half vector's angle at which it has fallen to 1/e |
//! | `roughness_x` | a number from 0.01 to 1; optional | the width along the tangent; default `roughness` |
//! | `roughness_y` | a number from 0.01 to 1; optional | the width across the tangent; default `roughness` |
//! | `specular` | a colour, each a number from 0 to 1e6; default 1 | the weight of the highlight |
//!
//! ### `ashikhmin-shirley`
//!
//! A highlight with Fresnel, stretched or not, over a matte base.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `exponent` | a number from 0 to 1e9; required unless `exponent_x` and `exponent_y` are given | the sharpness of the highlight: the power of the half vector's cosine |
//! | `exponent_x` | a number from 0 to 1e9; optional | the sharpness along the tangent; default `exponent` |
//! | `exponent_y` | a number from 0 to 1e9; optional | the sharpness across the tangent; default `exponent` |
//! | `diffuse` | a colour, each a number from 0 to 1e6; default 0 | the share of the remaining light that the base reflects |
//! | `specular` | a colour, each a number from 0 to 1; required | the share of light that the highlight reflects at normal incidence |
//!
//! ### `poulin-fournier`
//!
//! Parallel cylinders along the tangent, as of brushed metal or satin.
//!
//! Each point of the cylinders, and of the floor between them, is matte with a highlight; what one cylinder
//! hides of the next does not count (Poulin and Fournier 1990). The highlight is drawn out across the
//! cylinders; higher or closer cylinders draw it out more.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `exponent` | a number from 0 to 1e9; required | the sharpness of a point's highlight: the power of the half vector's cosine |
//! | `diffuse` | a colour, each a number from 0 to 1e6; default 0 | the share of light that a point's matte part reflects |
//! | `specular` | a colour, each a number from 0 to 1e6; default 1 | the weight of the highlight |
//! | `distance` | a number from 2 to 100; default 2 | the distance between the axes of cylinders, in radii; 2 if they touch |
//! | `height` | a number from 0 to 2; default 1 | how far cylinders rise above the floor, in radii; 0 is flat, 1 half a cylinder |
//!
//! ### `lafortune`
//!
//! A matte part and generalised cosine lobes, fitted to measurements; not normalised.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `diffuse` | a colour, each a number from 0 to 1e6; default 0 | the share of light that the matte part reflects |
//! | `lobes` | an array of tables { cx, cz, n, weight }; required | the lobes |
//! | `lobes.cx` | a number from -10 to 10; required | the factor of L_x V_x + L_y V_y; -1 for Phong's lobe |
//! | `lobes.cz` | a number from -10 to 10; required | the factor of L_z V_z; 1 for Phong's lobe |
//! | `lobes.n` | a number from 0 to 1e6; required | the power |
//! | `lobes.weight` | a colour, each a number from 0 to 1e6; default 1 | the weight of the lobe |
//!
//! ### `kajiya-kay`
//!
//! A highlight along a fibre, about the tangent; not normalised.
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `exponent` | a number from 0 to 1e9; required | the sharpness of the highlight: the power of the cosine |
//! | `specular` | a colour, each a number from 0 to 1e6; default 1 | the weight of the highlight |
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
//! decoded from sRGB first, alpha ignored, whatever part of it the mesh shows), times its factor; notes name
//! what was averaged. Textures are read as PNG, JPEG or WebP, also from files beside a `.gltf` or in other
//! folders (`../textures/a.png`): the item is rerun if one of them changes. Normal and occlusion textures are
//! ignored, and a roughness below the least of the model becomes the least. Warnings name other extensions,
//! transparency, emitted light, vertex colours, and a `KHR_texture_transform` that may show a part of a
//! texture. If the file *requires* an extension that is not read, the material is an error, unless the
//! extension belongs to other materials of the file, or to meshes, lights or animations.
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
//!
//! ## Example
//!
//! ```toml
//! [stage.material]
//! kind = "import-material"
//! source = "assets/materials/*.toml"
//! ```

use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, Reporter, parameters};

use super::material_file::{check_material, read_material};
use crate::values::{ChosenMaterial, artifacts};

parameters! {
    /// Parameters of `import-material`; those of a material are in its file.
    pub(crate) struct Parameters {
        /// The material of a glTF file. Default: the only one.
        material: Option<ChosenMaterial> = None,
    }
}

/// The kind `import-material`.
pub(crate) struct ImportMaterial;

impl Kind for ImportMaterial {
    type Parameters = Parameters;

    const NAME: &'static str = "import-material";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("import_material.rs");
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Material::TYPE)
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
        Output::artifact(artifacts::Material(found.material))
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
