//! The frames of a mesh whose material varies over it.

use brdf::BrdfTable;
use engine::{Context, Digest, Failure};
use mesh::Mesh;
use transfer::Frames;

use super::artifacts;

/// The frames of the mesh at the port `mesh`, with what the optional port `blend` says about the materials of
/// a table. A warning says so if a part of the blend has no effect, or the blend does not use the table's
/// second parameter.
///
/// # Errors
/// If a normal and a tangent are not orthonormal, or the blend is of another mesh than the one at the port
/// `mesh`, or missing where the table has several materials.
pub fn blended_frames(context: &Context<'_>, mesh: &Mesh, table: &BrdfTable) -> Result<Frames, Failure> {
    let frames = Frames::of(mesh)?;
    Ok(match blend(context, mesh, table)? {
        Some(blend) => frames.with_blend(&blend),
        None => frames,
    })
}

/// The place of each vertex of the mesh among the materials of a table, from the optional port `blend`.
///
/// # Errors
/// If the blend is of another mesh than the one at the port `mesh`, or missing where the table has several
/// materials.
pub(crate) fn blend(
    context: &Context<'_>,
    mesh: &Mesh,
    table: &BrdfTable,
) -> Result<Option<Vec<[f32; 2]>>, Failure> {
    let Some(blend) = context.inputs.optional::<artifacts::VertexBlend>("blend")? else {
        return match table.count() {
            1 => Ok(None),
            count => {
                let what = format!("the table has {count} materials, but nothing places them on the mesh");
                Err(Failure::new(what).help("connect a blend: a stage of the kind vertex-blend"))
            }
        };
    };
    let digest = match context.inputs.type_at("mesh") {
        Some(_) => Digest::of(&context.inputs.bytes("mesh")?).to_string(),
        None => String::new(),
    };
    if blend.0.mesh != digest {
        return Err(Failure::new("the blend belongs to another mesh")
            .help("connect the mesh that vertex-blend used, including its tangents"));
    }
    if blend.0.value.len() != mesh.positions().len() {
        return Err(Failure::new("the blend does not have a place for each vertex of the mesh"));
    }
    let has_second = blend.0.value.iter().any(|place| place[1] != 0.0);
    match table.grid() {
        [1, 1] => context.reporter.warn("the table has only one material, so the blend has no effect"),
        [_, 1] if has_second => context
            .reporter
            .warn("only one parameter of the table varies, so the second number of the blend has no effect"),
        [_, across] if across > 1 && !has_second => context.reporter.warn(
            "the second number of the blend is 0 everywhere, so the table's second parameter does not vary; \
             `vertex-blend` takes it from `second-texture`, `second-channel` or `second-attribute`",
        ),
        _ => {}
    }
    Ok(Some(blend.0.value.clone()))
}
