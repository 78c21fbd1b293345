//! What a file has of light and transfer at each vertex: vectors whose product with a light is radiance, and
//! the light itself.

use brdf::BrdfTable;
use containers::VertexAttribute;
use engine::{Artifact, Failure, Inputs};
use mesh::Mesh;
use sh::{Degree, Expansion};
use stages::artifacts;
use transfer::{FixedView, Form, Frames, LightField, StoredTransfer, Viewer, arriving, turn_into_frames};

use crate::vertex_probes::VertexProbes;

/// The vectors of a matte transfer; `None` for another form.
pub(crate) fn matte_vectors(transfer: &StoredTransfer) -> Option<Vec<VertexAttribute>> {
    let channels = transfer.channels().iter().map(|form| match form {
        Form::Matte(matte) => Some(matte.values().chunks_exact(matte.input().rows())),
        _ => None,
    });
    Some(vectors(channels.collect::<Option<_>>()?))
}

/// The vectors that lead to the radiance toward a viewer, up to a degree, past the mesh if there is a
/// transfer.
pub(crate) fn view_vectors(
    frames: &Frames,
    table: &BrdfTable,
    viewer: Viewer,
    transfer: Option<&StoredTransfer>,
    most: usize,
) -> Result<Vec<VertexAttribute>, Failure> {
    let fixed = match transfer {
        Some(transfer) => FixedView::with_transfer(frames, table, viewer, &matrices(transfer, frames)?),
        None => FixedView::new(frames, table, viewer),
    };
    let (rows, values) = (fixed.degree().rows(), fixed.values());
    let (channels, kept) =
        (values.len() / (rows * frames.len()), fixed.degree().min(Degree::new(most)?).rows());
    let channel = |channel: usize| {
        values.chunks_exact(channels * rows).map(move |vertex| &vertex[channel * rows..][..kept])
    };
    Ok(vectors((0..channels).map(channel).collect()))
}

/// The vectors of each channel as attributes, four components in each.
fn vectors<'a>(channels: Vec<impl Iterator<Item = &'a [f32]> + Clone>) -> Vec<VertexAttribute> {
    let prefixes: &[&str] = if channels.len() == 1 { &[""] } else { &["_RED", "_GREEN", "_BLUE"] };
    let of_channel = |(channel, prefix): (_, &&str)| -> Vec<VertexAttribute> {
        let vertices: Vec<&[f32]> = Iterator::collect(channel);
        let columns = vertices.first().map_or(0, |t| t.len());
        let attribute = |first: usize| {
            let four = |t: &&[f32]| [0, 1, 2, 3].map(|k| t.get(first + k).copied().unwrap_or(0.0));
            let values = vertices.iter().flat_map(four).collect();
            VertexAttribute { name: format!("{prefix}_TRANSFER_{}", first / 4), width: 4, values }
        };
        (0..columns).step_by(4).map(attribute).collect()
    };
    channels.into_iter().zip(prefixes).flat_map(of_channel).collect()
}

/// The matrices of a transfer of this mesh.
fn matrices(transfer: &StoredTransfer, frames: &Frames) -> Result<Vec<transfer::Transfer>, Failure> {
    transfer.matrices(frames).ok_or_else(|| Failure::new("the transfer belongs to another mesh"))
}

/// The light of the mesh's surroundings.
pub(crate) enum VertexLight {
    /// The light is the same everywhere.
    Distant(Expansion),
    /// The light is another at each place.
    Near(LightField),
    /// The light is that of probes around each vertex.
    Probes(VertexProbes),
}

/// The light that is connected as `lighting`, for a mesh.
pub(crate) fn vertex_light(inputs: &Inputs, mesh: &Mesh) -> Result<Option<VertexLight>, Failure> {
    if inputs.type_at("lighting") == Some(artifacts::Probes::TYPE) {
        let probes = &inputs.get::<artifacts::Probes>("lighting")?.0;
        let probes = VertexProbes::of(probes, mesh.positions(), |vertex| mesh.normals()[vertex])?;
        return Ok(Some(VertexLight::Probes(probes)));
    }
    if inputs.type_at("lighting") == Some(artifacts::LightField::TYPE) {
        let field = inputs.get::<artifacts::LightField>("lighting")?;
        return Ok(Some(VertexLight::Near(field.0.clone())));
    }
    let lighting = inputs.optional::<artifacts::Lighting>("lighting")?;
    Ok(lighting.map(|lighting| VertexLight::Distant(lighting.0.whole())))
}

/// The light at each vertex up to a degree, an attribute for each coefficient: past the mesh if the transfer
/// has matrices. In the frame of the mesh, or in those of the vertices.
pub(crate) fn light_at_vertices(
    mesh: &Mesh,
    transfer: Option<&StoredTransfer>,
    light: &VertexLight,
    most: usize,
    in_frames: bool,
) -> Result<Vec<VertexAttribute>, Failure> {
    let (vertices, most) = (mesh.positions().len(), Degree::new(most)?);
    let numbers = |light: &Expansion| -> Vec<f32> {
        let light = light.to_degree(light.degree().min(most));
        light.coefficients().as_flattened().iter().map(|value| *value as f32).collect()
    };
    let is_matte = |transfer: &&StoredTransfer| matches!(transfer.form(), Form::Matte(_));
    let frames = Frames::of(mesh)?;
    let mut values = match transfer.filter(|transfer| !is_matte(transfer)) {
        Some(transfer) => {
            let matrices = matrices(transfer, &frames)?;
            match light {
                VertexLight::Distant(light) => arriving(&frames, &matrices, light),
                VertexLight::Near(field) => field.arriving(&frames, &matrices),
                VertexLight::Probes(probes) => {
                    let arriving = |light: &Expansion| {
                        let values = arriving(&frames, &matrices, light);
                        Ok::<_, Failure>(values.as_chunks::<3>().0.to_vec())
                    };
                    probes.under(arriving)?.into_flattened()
                }
            }
        }
        None => match light {
            VertexLight::Distant(light) => numbers(light).repeat(vertices),
            VertexLight::Near(field) => {
                let at = |place: &[f32; 3]| numbers(&field.at(place.map(f64::from)));
                mesh.positions().iter().flat_map(at).collect()
            }
            VertexLight::Probes(probes) => {
                let kept = VertexProbes::degree().min(most).rows();
                probes.rows().iter().flat_map(|rows| rows[..kept].as_flattened()).copied().collect()
            }
        },
    };
    let rows = values.len() / (3 * vertices);
    if in_frames {
        turn_into_frames(&frames, Degree::new(rows.isqrt() - 1)?, &mut values);
    }
    let row = |row: usize| {
        let l = row.isqrt();
        let values = values.chunks_exact(3 * rows).flat_map(|vertex| &vertex[3 * row..][..3]);
        VertexAttribute {
            name: format!("_SH_DEGREE_{l}_COEF_{}", row - l * l),
            width: 3,
            values: values.copied().collect(),
        }
    };
    Ok((0..rows.min(most.rows())).map(row).collect())
}
