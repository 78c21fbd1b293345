//! The transfer of a matte mesh, which pages show at its vertices.

use sh::{Degree, Expansion};
use transfer::{Form, StoredTransfer, quarter_turns};

use super::elements::padded;
use super::texture::{ELEMENTS, WebTexels, WebTexture};
use crate::RenderError;
use crate::shading::turned_light::MAX_DEGREE;

/// The vectors of a part of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct WebTransfer {
    /// The texture of the vectors.
    pub texture: WebTexture,
    /// The values of uniforms, by their names.
    pub uniforms: Vec<(&'static str, f64)>,
}

impl WebTransfer {
    /// The vectors of some vertices of a mesh, in this order.
    ///
    /// # Errors
    /// If the transfer is not matte, of more degrees than a page turns, or of fewer vertices.
    pub fn of(transfer: &StoredTransfer, vertices: &[u32]) -> Result<Self, RenderError> {
        let rows = transfer.form().input().rows();
        let is_known = |vertex: &u32| (*vertex as usize) < transfer.len();
        let degree = transfer.form().input().get();
        if degree > MAX_DEGREE {
            return Err(RenderError::maps(format!("its degree {degree} is above {MAX_DEGREE}")));
        }
        if !vertices.iter().all(is_known) {
            return Err(RenderError::maps("it has fewer vertices than the mesh"));
        }
        let values = |form: &'_ Form| match form {
            Form::Matte(matte) => Some(matte.values().to_vec()),
            _ => None,
        };
        let channels: Option<Vec<_>> = transfer.channels().iter().map(values).collect();
        let channels = channels.ok_or_else(|| RenderError::maps("it is not matte"))?;
        let vectors = vertices.iter().flat_map(|vertex| {
            channels.iter().flat_map(move |values| {
                let vector = &values[*vertex as usize * rows..][..rows];
                vector.chunks(4).map(|of| {
                    let mut element = [0.0; 4];
                    element[..of.len()].copy_from_slice(of);
                    element
                })
            })
        });
        let elements = padded(&vectors.collect::<Vec<_>>(), [0.0; 4]);
        let texture = WebTexture {
            name: "transfer_vectors",
            size: [ELEMENTS, elements.len() / ELEMENTS, 1],
            is_array: false,
            is_linear: false,
            texels: WebTexels::Halves(elements),
        };
        let uniforms = vec![
            ("transfer_uniforms.rows", rows as f64),
            ("transfer_uniforms.channels", channels.len() as f64),
        ];
        Ok(Self { texture, uniforms })
    }
}

/// The coefficients of a light up to a degree, and the turns of its bands.
pub(super) fn turned_elements(light: &Expansion, degree: Degree) -> [Vec<[f32; 4]>; 2] {
    let row = |[r, g, b]: &[f64; 3]| [*r as f32, *g as f32, *b as f32, 0.0];
    let light = light.coefficients().iter().take(degree.rows()).map(row).collect();
    let turn = |[there, back]: [f32; 2]| [there, back, 0.0, 0.0];
    [light, quarter_turns(degree).into_iter().map(turn).collect()]
}
