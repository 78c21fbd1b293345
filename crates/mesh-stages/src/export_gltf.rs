//! Writes a mesh as a binary glTF, with the values computed at its vertices as attributes: as a new file,
//! or as a copy of the asset that it was imported from.
//!
//! ```toml
//! [stage.glb]
//! kind = "export-gltf"
//! inputs = { mesh = "mesh", radiance = "shaded", transfer = "matte-transfer", environment = "environment" }
//! path = "{environment}/knot"
//! ```
//!
//! | input | attributes | content |
//! | --- | --- | --- |
//! | `radiance` | `COLOR_0` VEC3 | the radiance, exposed, clamped to 0 to 1, linear; viewers show it as it is |
//! | | `_RADIANCE` VEC3 | the radiance itself, signed, in the unit of the light |
//! | `transfer`, `matte` | `_TRANSFER_0` to `_TRANSFER_6` VEC4 | t_j: component j % 4 of attribute j / 4; zeros after the last |
//! | `transfer`, with `matrices` | `_TRANSFER_X` and `_TRANSFER_Z` VEC4 | two axes of the vertex's frame; then the column and the row of its first texel |
//! | `table` | `_TRANSFER_n` VEC4 | the vectors of a fixed view, as above |
//! | `lighting` | `_SH_DEGREE_l_COEF_n` VEC3 | the light's coefficients at the vertex, m = n - l |
//!
//! All numbers are 32-bit floats. Attributes with an underscore all have the width of the widest of them,
//! padded with zeros, because Blender before 5.1 cannot read a mixture of widths.
//!
//! `radiance` comes from `shade-vertices`, `transfer` from `precompute-transfer`; both must be of this mesh.
//! Without any of them only the mesh is written, including tangents, with a matte white material.
//!
//! ## The original asset
//!
//! With `gltf`, the file that the mesh was imported from, the attributes are added to the primitives of that
//! file:
//!
//! ```toml
//! [stage.helmet]
//! kind = "export-gltf"
//! inputs = { mesh = "mesh", transfer = "matte-transfer" }
//! gltf = "assets/meshes/{mesh}.gltf"   # {mesh}: the name of the item's file, as in `path`
//! path = "{mesh}"
//! ```
//!
//! Nodes, names, materials, textures, animations, skins, morph targets and extensions stay as they are, and
//! so do the numbers of the asset, byte for byte. Buffers and pictures next to a `.gltf` become part of the
//! `.glb`. Attributes with the same names are replaced, with a warning. The mesh must be the whole file, as
//! `import-mesh` reads it; `brush-mesh` may have turned its tangents.
//!
//! - If a vertex of the asset became several vertices (the corners of triangles if the asset has no
//!   normals, or a vertex with several computed tangents), it gets their mean. A warning says how many of
//!   them differ, and by how much.
//! - If several nodes use one mesh, each after the first gets a copy with the same positions and its own
//!   attributes. Instances (`EXT_mesh_gpu_instancing`) cannot have attributes of their own, so they are an
//!   error.
//! - The values of animated meshes were computed in the rest pose, as `import-mesh` describes.
//! - `COLOR_0` is not written, because the asset's materials would multiply their base colour by it:
//!   `_RADIANCE` holds the same, and `exposure` and `environment` do not matter.
//!
//! ## Transfer
//!
//! With the coefficients L_j of a light, of the preset `specula` of `export-sh`,
//!
//! > albedo times the sum over j of t_j L_j
//!
//! is the radiance of a matte surface at that vertex, with the shadows of the mesh, and with
//! interreflection if that was baked. docs/relighting.md has the shader for three.js, Unity and Unreal. If
//! red, green and blue each have a transfer, the names are `_RED_TRANSFER_0`, `_GREEN_TRANSFER_0` and so
//! on. `precompute-transfer` makes vectors with `form = "matte"`.
//!
//! ## Matrices
//!
//! Glossy and brushed materials need the matrices T of the other forms, and the material's table:
//!
//! ```toml
//! [stage.glossy]
//! kind = "export-gltf"
//! inputs = { mesh = "mesh", transfer = "transfer" }
//! matrices = "half"
//! path = "{mesh}"                      # {mesh}/mesh.glb and {mesh}/matrices.ktx2
//! ```
//!
//! `matrices.ktx2` is an RGBA16F texture, or RGBA32F with `"float"`, named as `matrices` in the `extras` of
//! the mesh. A vertex has a run of texels in one row of the texture. The fourth number of `_TRANSFER_X` is
//! the column where it begins, and that of `_TRANSFER_Z` its row. A texel has four entries: T_0,0 to T_0,3,
//! then T_0,4 to T_0,7 and so on, with zeros after the last of a row of the matrix; then row 1 follows. If
//! red, green and blue each have a transfer, all rows of green follow those of red. With the coefficients
//! L_j of a light, and c_i(v) of `export-brdf-table` at the view v in the frame of the vertex,
//!
//! > the sum over i of c_i(v) times the sum over j of T_ij L_j
//!
//! is the radiance toward v, as `shade-vertices` computes it. The matrices convert light to the frame of
//! the vertex, so a shader rotates only the view. The axes x, the tangent, and z, the normal, of this frame
//! are the first three numbers of `_TRANSFER_X` and `_TRANSFER_Z`, in the axes of the scene, wherever nodes
//! put the mesh; y = z x x. docs/relighting.md has the shader for three.js.
//!
//! `precompute-transfer` stores halves, so `"half"` loses nothing of `form = "matrices"`. The matrices of
//! `visibility` are made here, and `"half"` rounds each entry by at most 2.4e-4 of itself. At degree 4 a
//! vertex has 175 texels: 1.4 kB in halves. The texture has at most 4096 columns and 8192 rows, enough for
//! 188,416 vertices, or 57,344 if red, green and blue each have a transfer. With `gltf`, it is an error if
//! a vertex of the asset became several vertices: give the asset normals and tangents.
//!
//! ## A fixed view
//!
//! If only the light moves, the view of each vertex is fixed, and so are the coefficients c_i of its material
//! for that view (Kautz, Sloan and Snyder 2002, section 4.1). Then a vector is enough, even for a brushed
//! material with shadows. Connect the `table` (`tabulate-brdf`), a `transfer` of matrices if the mesh is to
//! shadow itself, and `blend` (`vertex-blend`) if the table has several materials:
//!
//! ```toml
//! [stage.posed]
//! kind = "export-gltf"
//! inputs = { mesh = "mesh", table = "table", transfer = "transfer" }
//! camera = [4, 0, 1]
//! path = "{mesh}/posed"
//! ```
//!
//! `_TRANSFER_n` then has t_j = the sum over i of c_i T_ij, or without a transfer the c_i turned from the
//! frame of the vertex to that of the mesh, and the sum over j of t_j L_j is the radiance toward the viewer.
//! The shader is that of matte vectors, with an albedo of 1. A table of colours has `_RED_TRANSFER_n` and so
//! on. `degree` truncates the vectors.
//!
//! ## Light at the vertices
//!
//! `lighting` is written for each vertex in the frame of the mesh, not of the vertex, so that a shader can
//! evaluate it with a normal or a reflection vector. It may be that of light probes (`light-probes`), of
//! which those around each vertex are blended that see it.
//!
//! - with a transfer of matrices (any form but `matte`): the light that reaches the vertex, with the
//!   shadows of the mesh: T L rotated back to the mesh's frame;
//! - with a `matte` transfer, or none: the light itself, without the shadows of the mesh, which are in the
//!   vectors t_j.
//!
//! If the light is fixed and the view moves, a shader multiplies the light by c_i(v) of `export-brdf-table`,
//! which are in the frame of the vertex (x the tangent, z the normal, y = z x x). With `light-frame =
//! "vertex"` the light is in that frame too, so nothing is left to rotate.
//!
//! A `light-field` gives each vertex the light at its position. Suns and lamps are part of the
//! coefficients. `degree` truncates them, so near a lamp they ring below zero, as every truncated series
//! does.
//!
//! ## Coefficients
//!
//! Positions, normals and tangents are in the frame of glTF, +Y up. Coefficients are not rotated: row l*l +
//! l + m is the real orthonormal harmonic, without the Condon-Shortley phase, of Specula's (x, y, z), which
//! is (z, x, y) of the file. So they match the files of `export-sh`, and a rotation about the vertical is
//! one about their polar axis. (The attributes of `KHR_gaussian_splatting` with similar names have the
//! phase, and z of the file as their axis.) `extras` of the mesh repeat this.
//!
//! ## Exposure
//!
//! With `radiance` the material is `KHR_materials_unlit`: viewers show `COLOR_0` and add no light. It is
//! the radiance times 2 to the power of `exposure`. With `environment` connected, an environment or a
//! lighting, `exposure` is relative to the exposure of pictures under it, as in `preview` and
//! `contact-sheet`. There is no tone curve. A note says how many numbers are clamped, or a warning if they
//! are more than 1 % of all; `_RADIANCE` keeps them all.
//!
//! ## Files
//!
//! `.glb` after the item's `path`; with `matrices`, `/matrices.ktx2` and `/mesh.glb`.

use std::path::Path;

use containers::{GlbText, Precision, VertexAttribute, write_glb, write_into_gltf};
use engine::{Context, Digest, Failure, ItemKey, Kind, Output, Port, Product, Reporter, choice, parameters};
use mesh::Mesh;
use stages::artifacts;
use stages::plugin::{Place, STOPS, Vector, blended_frames, picture_exposure, report_loss, size};
use transfer::{Frames, StoredTransfer};

use crate::transfer_texture::{MatrixTexture, matrix_texture};
use crate::vertex_coefficients::{light_at_vertices, matte_vectors, vertex_light, view_vectors};
use crate::viewer::{given_twice, viewer};

choice! {
    /// The numbers of the texture of matrices.
    pub(crate) enum Matrices {
        /// There is no texture.
        None = "none",
        /// 16 bits.
        Half = "half",
        /// 32 bits.
        Float = "float",
    }
}

choice! {
    /// The frame of the light at a vertex.
    pub(crate) enum LightFrame {
        /// That of the mesh.
        Mesh = "mesh",
        /// That of the vertex.
        Vertex = "vertex",
    }
}

impl Matrices {
    /// The precision of the texture, if there is one.
    fn precision(self) -> Option<Precision> {
        match self {
            Self::None => None,
            Self::Half => Some(Precision::Half),
            Self::Float => Some(Precision::Float),
        }
    }
}

parameters! {
    /// Parameters of `export-gltf`.
    pub(crate) struct Parameters {
        /// The glTF file that the mesh was imported from, relative to the manifest; the export keeps its
        /// materials, textures and nodes. `{STAGE}` stands for the name of the item's file of a source
        /// stage.
        gltf: Option<String> = None,
        /// Stops by which radiance is multiplied for `COLOR_0`; with `environment`, relative to the
        /// exposure of its pictures.
        #[range(STOPS)]
        exposure: f64 = 0.0,
        /// With `table`: the direction from the mesh toward a distant viewer. Default: [1, 0, 0].
        view: Option<Vector> = None,
        /// With `table`: the position of the viewer, in the mesh's unit, instead of `view`.
        camera: Option<Place> = None,
        /// With `lighting`: the frame of the light at a vertex; see Light at the vertices.
        light_frame: LightFrame = LightFrame::Mesh,
        /// With `lighting` or `table`: the highest l that is written, if they have it.
        #[range(0..=8)]
        degree: usize = 4,
        /// Whether the matrices of the transfer are written into a texture next to the file, with 16-bit or
        /// 32-bit numbers; see Matrices.
        matrices: Matrices = Matrices::None,
    }
}

/// The description of the coefficients in the file, the text of `extras`.
const BASIS: &str = "real orthonormal spherical harmonics without Condon-Shortley phase, row l*l + l + m, of \
                     the directions (x, y, z) = (z, x, y) of this file: +Z is up";

/// The name of the texture of matrices, beside the file of the mesh.
const MATRICES: &str = "matrices.ktx2";

/// The kind `export-gltf`.
pub(crate) struct ExportGltf;

impl Kind for ExportGltf {
    type Parameters = Parameters;

    const NAME: &'static str = "export-gltf";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[transfer::revisions::SHADING, probes::revisions::BLEND];
    const TEXT: &'static str = include_str!("export_gltf.rs");
    const SHOWS_KEYS: bool = true;

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Mesh>("mesh"),
            Port::one::<artifacts::VertexRadiance>("radiance").optional(),
            Port::one::<artifacts::Transfer>("transfer").optional(),
            Port::one::<artifacts::BrdfTable>("table").optional(),
            Port::one::<artifacts::VertexBlend>("blend").optional(),
            Port::one::<artifacts::Lighting>("lighting")
                .or::<artifacts::LightField>()
                .or::<artifacts::Probes>()
                .optional(),
            Port::one::<artifacts::Environment>("environment").or::<artifacts::Lighting>().optional(),
        ]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(match parameters.matrices {
            Matrices::None => vec![".glb".into()],
            Matrices::Half | Matrices::Float => vec![format!("/{MATRICES}"), "/mesh.glb".into()],
        })
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        if parameters.gltf.is_some() && parameters.exposure != 0.0 {
            errors.push(("exposure", "has no effect with gltf, because COLOR_0 is not written".into()));
        }
        errors.extend(given_twice(parameters.camera, parameters.view));
        errors
    }

    fn check_inputs(parameters: &Parameters, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
        let needs = [
            ("view", parameters.view.is_some(), "table"),
            ("camera", parameters.camera.is_some(), "table"),
            ("light-frame", parameters.light_frame == LightFrame::Vertex, "lighting"),
        ];
        let has = |port: &str| types.iter().any(|(name, _)| *name == port);
        let needs = needs.into_iter().filter(|(_, is_given, port)| *is_given && !has(port));
        let errors = needs.map(|(name, _, port)| (name, format!("only an input `{port}` uses it")));
        let blend = (has("blend") && !has("table")).then(|| ("inputs", "`blend` needs a `table`".into()));
        errors.chain(blend).collect()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let mesh = &context.inputs.get::<artifacts::Mesh>("mesh")?.0;
        if mesh.triangles().is_empty() {
            return Err(Failure::new("the mesh has no triangles"));
        }
        let digest = Digest::of(&context.inputs.bytes("mesh")?).to_string();
        let (mut attributes, mut extras) = (Vec::new(), Vec::new());
        let radiance = context.inputs.optional::<artifacts::VertexRadiance>("radiance")?;
        let stops = match (&radiance, &parameters.gltf) {
            (Some(_), None) => exposure(parameters, context)?,
            _ => 0.0,
        };
        let exposed_by = format!("COLOR_0 is _RADIANCE times 2^{stops}, clamped to 0 to 1");
        if let Some(radiance) = &radiance {
            check_mesh("radiance", "shade-vertices", &radiance.0.mesh, &digest)?;
            let of_radiance = attribute("_RADIANCE", 3, radiance.0.value.as_flattened().to_vec());
            if parameters.gltf.is_none() {
                attributes.push(colours(&radiance.0.value, stops, reporter));
                extras.push(("exposure", exposed_by.as_str()));
            }
            attributes.push(of_radiance);
            extras.push(("radiance", "linear Rec. 709, in the unit of the light"));
        }
        let transfer = context.inputs.optional::<artifacts::Transfer>("transfer")?;
        let transfer = match &transfer {
            Some(transfer) => {
                check_mesh("transfer", "precompute-transfer", &transfer.0.mesh, &digest)?;
                Some(&transfer.0.value)
            }
            None => None,
        };
        let table = context.inputs.optional::<artifacts::BrdfTable>("table")?;
        let matte = transfer.and_then(matte_vectors);
        let vectors = match &table {
            Some(_) if matte.is_some() => {
                return Err(Failure::new("a matte transfer has no matrices, which the table needs")
                    .help("bake the transfer with form = \"matrices\", or leave out `table`"));
            }
            Some(table) => {
                let viewer = viewer(parameters.camera, parameters.view);
                let frames = blended_frames(context, mesh, &table.0)?;
                Some(view_vectors(&frames, &table.0, viewer, transfer, parameters.degree)?)
            }
            None => matte,
        };
        let light = vertex_light(&context.inputs, mesh)?;
        let texture = matrices(parameters, mesh, transfer, context.recipe())?;
        if transfer.is_some() && vectors.is_none() && light.is_none() && texture.is_none() {
            return Err(Failure::new("the transfer is not matte, so it has no vectors to write").help(
                "set matrices = \"half\" to write its matrices as a texture, bake the transfer with form = \
                 \"matte\", or connect `lighting` to write the light that reaches the vertices",
            ));
        }
        if transfer.is_some() || light.is_some() {
            extras.push(("basis", BASIS));
        }
        if let Some(light) = &light {
            let in_frames = parameters.light_frame == LightFrame::Vertex;
            attributes.extend(light_at_vertices(mesh, transfer, light, parameters.degree, in_frames)?);
        }
        attributes.extend(vectors.into_iter().flatten());
        if let Some(MatrixTexture { file, size: [columns, rows], attributes: frame }) = &texture {
            attributes.extend_from_slice(frame);
            extras.push(("matrices", MATRICES));
            reporter.note(format!("{MATRICES} has {columns} x {rows} texels: {}", size(file.len() as u64)));
        }
        widen(&mut attributes);
        reporter.check_cancelled()?;
        let text = GlbText { unlit: radiance.is_some(), extras: &extras, recipe: Some(context.recipe()) };
        let file = match &parameters.gltf {
            Some(name) => into_asset(name, mesh, &attributes, text, context, texture.is_some())?,
            None => write_glb(mesh, &attributes, text)?,
        };
        reporter.note(format!("{} vertices: {}", mesh.positions().len(), size(file.len() as u64)));
        Ok(Output::files(texture.map(|texture| texture.file).into_iter().chain([file]).collect()))
    }
}

/// The texture of matrices, if the parameters ask for it.
fn matrices(
    parameters: &Parameters,
    mesh: &Mesh,
    transfer: Option<&StoredTransfer>,
    recipe: &str,
) -> Result<Option<MatrixTexture>, Failure> {
    let Some(precision) = parameters.matrices.precision() else { return Ok(None) };
    let Some(transfer) = transfer else {
        return Err(Failure::new("`matrices` needs a transfer, but none is connected")
            .help("inputs = { mesh = \"mesh\", transfer = \"transfer\" }"));
    };
    matrix_texture(transfer, &Frames::of(mesh)?, precision, recipe).map(Some)
}

/// The asset of a name with these attributes, of which no vertex has a mean if they name texels.
fn into_asset(
    name: &str,
    mesh: &Mesh,
    attributes: &[VertexAttribute],
    text: GlbText<'_>,
    context: &Context<'_>,
    name_texels: bool,
) -> Result<Vec<u8>, Failure> {
    let file = of_item(name, context.key())?;
    let path = Path::new(&file);
    let bytes = context.files.read(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut beside = |other: &str| context.files.read(&folder.join(other));
    let written = write_into_gltf(&bytes, mesh, attributes, text, &mut beside);
    let written = written.map_err(|failure: Failure| failure.context(format!("cannot write into {file}")))?;
    if name_texels && written.means > 0 {
        let message =
            format!("{} vertices of {file} became several vertices, each with its own matrix", written.means);
        return Err(Failure::new(message).help("give the asset normals and tangents, or leave out `gltf`"));
    }
    written.notes.into_iter().for_each(|note| context.reporter.note(note));
    written.warnings.into_iter().for_each(|warning| context.reporter.warn(warning));
    Ok(written.bytes)
}

/// A file's name, in which `{STAGE}` stands for the name of the item's file of that stage.
fn of_item(name: &str, key: Option<&ItemKey>) -> Result<String, Failure> {
    let (mut made, mut rest) = (String::new(), name);
    while let Some((before, after)) = rest.split_once('{') {
        let Some((stage, behind)) = after.split_once('}') else {
            return Err(Failure::new(format!("gltf = {name:?} has an unmatched brace")));
        };
        let stem = key.and_then(|key| key.get(stage)).ok_or_else(|| {
            let known: Vec<String> =
                key.into_iter().flat_map(ItemKey::iter).map(|(stage, _)| format!("{{{stage}}}")).collect();
            let help = match known.is_empty() {
                true => "the items of this stage have no names: write the name of the file".to_owned(),
                false => format!("expected one of: {}", known.join(", ")),
            };
            Failure::new(format!(
                "gltf = {name:?} names {{{stage}}}, but this stage depends on no source stage with that name"
            ))
            .help(help)
        })?;
        made += before;
        made += stem;
        rest = behind;
    }
    Ok(made + rest)
}

/// Gives all attributes that are not of the specification the width of the widest: Blender before 5.1 fails
/// to read a file in which they differ (KhronosGroup/glTF-Blender-IO, issue 2658).
fn widen(attributes: &mut [VertexAttribute]) {
    let own = |attribute: &&mut VertexAttribute| attribute.name.starts_with('_');
    let width = attributes.iter_mut().filter(own).map(|attribute| attribute.width).max().unwrap_or(0);
    for attribute in attributes.iter_mut().filter(own).filter(|attribute| attribute.width < width) {
        let zeros = vec![0.0; width - attribute.width];
        let vertices = attribute.values.chunks_exact(attribute.width);
        attribute.values = vertices.flat_map(|vertex| [vertex, &zeros].concat()).collect();
        attribute.width = width;
    }
}

/// Refuses values of another mesh.
fn check_mesh(what: &str, kind: &str, of: &str, mesh: &str) -> Result<(), Failure> {
    if of == mesh {
        return Ok(());
    }
    let help = format!("connect the mesh that {kind} used, including its tangents");
    Err(Failure::new(format!("the {what} belongs to another mesh")).help(help))
}

/// The stops of `COLOR_0`.
fn exposure(parameters: &Parameters, context: &Context<'_>) -> Result<f64, Failure> {
    if context.inputs.type_at("environment").is_none() {
        return Ok(parameters.exposure);
    }
    picture_exposure(context, parameters.exposure)
}

/// Makes the attribute `COLOR_0`.
fn colours(radiance: &[[f32; 3]], stops: f64, reporter: &Reporter) -> VertexAttribute {
    let exposed = radiance.as_flattened().iter().map(|value| f64::from(*value) * math::exp2(stops));
    let exposed: Vec<f32> = exposed.map(|value| value as f32).collect();
    let count = |outside: fn(f32) -> bool| exposed.iter().filter(|value| outside(**value)).count();
    let (below, above) = (count(|value| value < 0.0), count(|value| value > 1.0));
    if below + above > 0 {
        let of = exposed.len();
        let what = format!(
            "the numbers of COLOR_0 are clamped: {below} of {of} were below 0 and turn black, {above} were \
             above 1"
        );
        let help = match above {
            0 => "read _RADIANCE, which keeps them all",
            _ => "lower `exposure`, or read _RADIANCE, which keeps them all",
        };
        report_loss(reporter, (below + above) as f64 / of as f64, &what, help);
    }
    attribute("COLOR_0", 3, exposed.iter().map(|value| value.clamp(0.0, 1.0)).collect())
}

pub(crate) fn attribute(name: &str, width: usize, values: Vec<f32>) -> VertexAttribute {
    VertexAttribute { name: name.into(), width, values }
}
