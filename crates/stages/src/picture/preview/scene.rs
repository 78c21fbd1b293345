//! The scene of a preview: the mesh with the look of what is connected.

use std::sync::Arc;

use engine::{Context, Digest, Failure, Inputs};
use envmap::Environment;
use preview::{CompactMap, Look, MapSizes, Mode, Scene};

use super::probes_at_places::ProbesAtPlaces;
use super::values::BuiltInMesh;
use crate::light::{light, light_mismatch};
use crate::map::ShrmSettings;
use crate::values::{artifacts, blend};

/// What a scene is made of beside the inputs.
pub(super) struct SceneSettings {
    /// The modes that are drawn.
    pub(super) modes: Vec<Mode>,
    /// The mesh if none is connected.
    pub(super) mesh: BuiltInMesh,
    /// The sizes of the maps.
    pub(super) sizes: MapSizes,
    /// Whether the SHRMs hold the lamps.
    pub(super) holds_lamps: bool,
}

/// The mesh with its look.
pub(super) fn scene(settings: &SceneSettings, context: &Context<'_>) -> Result<Scene, Failure> {
    let material =
        context.inputs.optional::<artifacts::Material>("material")?.map(|material| material.0.clone());
    // A built-in mesh is not that of the material's file.
    let texture = match ["material", "mesh"].map(|port| context.inputs.type_at(port)) {
        [Some(_), Some(_)] => artifacts::Material::texture(&context.inputs.bytes("material")?)?,
        _ => None,
    };
    let table =
        context.inputs.optional::<artifacts::BrdfTable>("table")?.map(|table| Arc::new(table.0.clone()));
    for mode in settings.modes.iter().copied() {
        let port = match mode {
            Mode::BruteForce | Mode::ShadowedBruteForce => "material",
            Mode::Table => "table",
            Mode::Transfer if table.is_none() => "table",
            Mode::Transfer => "transfer",
            Mode::Samples if context.inputs.type_at("reflection").is_none() => "material",
            Mode::Taps if context.inputs.type_at("scale-space").is_none() => "scale-space",
            Mode::Taps => "taps",
            mode if mode.needs_maps() => "reflection",
            _ => continue,
        };
        if context.inputs.type_at(port).is_none() {
            let mode = mode.name();
            let what = if port == "taps" { "the taps of a material".into() } else { format!("a {port}") };
            return Err(Failure::new(format!("{mode} needs {what}, but the port {port} is not connected"))
                .help(format!("add {port} = \"...\" to the stage's inputs")));
        }
    }
    let mesh = match context.inputs.optional::<artifacts::Mesh>("mesh")? {
        Some(mesh) => mesh.0.clone(),
        None => built_in(settings.mesh)?,
    };
    if mesh.triangles().is_empty() {
        context.reporter.warn("the mesh has no triangles: only the background is seen");
    }
    let light = Arc::new(light(&context.inputs)?);
    let sizes = settings.sizes;
    let look = match context.inputs.type_at("reflection") {
        Some(name) if name == <artifacts::Shrm as engine::Artifact>::TYPE => {
            let map = context.inputs.get::<artifacts::Shrm>("reflection")?.0.clone();
            Look::from_map(light, map, material, sizes)
        }
        Some(_) => {
            let reflection = context.inputs.get::<artifacts::Reflection>("reflection")?.0.clone();
            if let Some(difference) = light_mismatch::difference(light.environment(), &reflection) {
                context.reporter.warn(difference);
            }
            let holds_lamps = settings.holds_lamps && reflection.lamps().is_some();
            let has_shrm =
                settings.modes.iter().any(|mode| matches!(mode, Mode::LocalShrm | Mode::GlobalShrm));
            let exported = ShrmSettings::of_default_stage().filter(|_| holds_lamps && has_shrm);
            let sizes_of = |settings: ShrmSettings| settings.sizes(&reflection, &context.reporter);
            let degrees = exported.map(sizes_of).transpose()?.map(|sizes| sizes.degrees_in_view);
            let look = Look::new(light, reflection, material, sizes);
            look.with_lamps_in_maps(holds_lamps).with_degrees_in_view(degrees)
        }
        None => Look::of_light(light, material, sizes),
    };
    let compact_map = compact_map(context, look.light().environment())?;
    let transfer = transfer(&context.inputs, &mesh)?;
    let blend = match &table {
        Some(table) => blend(context, &mesh, table)?.map(Arc::new),
        None => None,
    };
    let look = look.with_table(table).with_compact_map(compact_map).with_base_color(texture);
    let look = near_light(look, settings, context)?;
    let scene = Scene::of(Arc::new(mesh), Arc::new(look));
    Ok(scene.with_transfer(transfer).with_blend(blend))
}

/// The look under the light field or the probes, if they are connected; a mode ought to show them.
fn near_light(look: Look, settings: &SceneSettings, context: &Context<'_>) -> Result<Look, Failure> {
    let Some(found) = context.inputs.type_at("light-field") else { return Ok(look) };
    if !settings.modes.iter().any(|mode| mode.looks_up_table()) {
        context.reporter.warn("no mode shows the light-field: \"table\" and \"transfer\" do");
    }
    if found == <artifacts::Probes as engine::Artifact>::TYPE {
        let probes = context.inputs.get::<artifacts::Probes>("light-field")?.0.clone();
        return Ok(look.with_light_at_places(Some(Arc::new(ProbesAtPlaces::new(probes)?))));
    }
    let field = context.inputs.get::<artifacts::LightField>("light-field")?.0.clone();
    Ok(look.with_light_field(Some(Arc::new(field))))
}

/// The compact map of a scale space and taps, if both are connected; the scale space ought to be that of this
/// environment.
fn compact_map(context: &Context<'_>, environment: &Environment) -> Result<Option<Arc<CompactMap>>, Failure> {
    let scales = context.inputs.optional::<artifacts::ScaleSpace>("scale-space")?;
    let taps = context.inputs.optional::<artifacts::Taps>("taps")?;
    let (Some(scales), Some(taps)) = (scales, taps) else { return Ok(None) };
    let (scales, taps) = (&scales.0.space, &taps.0);
    if let Some(difference) = light_mismatch::difference_from_scales(environment, scales) {
        context.reporter.warn(difference);
    }
    Ok(Some(Arc::new(CompactMap {
        scales: Arc::new(scales.clone()),
        taps: Arc::new(taps.table().into()),
        material: taps.material.clone(),
    })))
}

/// The transfer of the mesh, if there is one.
fn transfer(inputs: &Inputs, mesh: &mesh::Mesh) -> Result<Option<Arc<Vec<transfer::Transfer>>>, Failure> {
    let Some(transfer) = inputs.optional::<artifacts::Transfer>("transfer")? else { return Ok(None) };
    let digest = match inputs.type_at("mesh") {
        Some(_) => Digest::of(&inputs.bytes("mesh")?).to_string(),
        None => String::new(),
    };
    if transfer.0.mesh != digest {
        return Err(Failure::new("the transfer belongs to another mesh")
            .help("connect the mesh that precompute-transfer used, including its tangents"));
    }
    let matrices = transfer.0.value.matrices(&transfer::Frames::of(mesh)?).ok_or_else(|| {
        Failure::new("the preview shows matrices, and this transfer is matte")
            .help("bake it in another form for the preview: form = \"matrices\"")
    })?;
    Ok(Some(matrices.into()))
}

fn built_in(shape: BuiltInMesh) -> Result<mesh::Mesh, Failure> {
    let name = match shape {
        BuiltInMesh::Sphere => "sphere",
        BuiltInMesh::TorusKnot => "torus-knot",
        BuiltInMesh::Plane => "plane",
    };
    mesh::shape(name).ok_or_else(|| Failure::new(format!("there is no built-in mesh {name:?}")))
}

#[cfg(test)]
mod tests {
    use engine::Parameter;

    use super::*;

    #[test]
    fn every_shape_has_its_word() {
        let shapes = mesh::SHAPES.map(|name| format!("{name:?}"));
        assert_eq!(BuiltInMesh::expected(), shapes.join(" or "));
        for shape in [BuiltInMesh::Sphere, BuiltInMesh::TorusKnot, BuiltInMesh::Plane] {
            assert!(built_in(shape).is_ok());
        }
    }
}
