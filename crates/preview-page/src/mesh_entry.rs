//! The meshes of a page: parts, each with the triangles of one material.

use std::collections::BTreeMap;

use brdf::TexturePlacement;
use mesh::Mesh;
use preview::Framing;
use preview::web::WebTransfer;
use serde::Serialize;

use crate::blobs::{Blobs, Numbers, TransferEntry};

/// The steps of coordinates in a texture: a 64th of a texel of the largest.
const STEPS: f64 = 65536.0;

/// A mesh: its name, a ball around it, and its parts.
#[derive(Debug, Serialize)]
pub struct MeshEntry {
    name: String,
    centre: [f64; 3],
    radius: f64,
    parts: Vec<PartEntry>,
}

/// A part of a mesh: where its numbers are.
#[derive(Debug, Serialize)]
struct PartEntry {
    material: Option<usize>,
    /// The places of vertices less the centre, divided by the radius; -1 to 1 is written as -32767 to 32767.
    positions: Numbers,
    /// The normals of vertices, written in the same way.
    normals: Numbers,
    /// The tangents of vertices, written in the same way.
    tangents: Numbers,
    /// The places of vertices in the textures of materials, by the places of the materials, in steps of
    /// 1/65536.
    coordinates: BTreeMap<usize, Numbers>,
    /// The numbers of the vertices of each triangle.
    triangles: Numbers,
    /// The vectors of its matte transfer.
    #[serde(skip_serializing_if = "Option::is_none")]
    transfer: Option<TransferEntry>,
}

/// The triangles of a mesh that have one material.
#[derive(Debug)]
pub struct MeshPart<'a> {
    /// The triangles, in the coordinates of the whole mesh.
    pub mesh: &'a Mesh,
    /// The material that the triangles have by themselves: its place in the document, if it is there.
    pub material: Option<usize>,
    /// The materials that show a texture here, and how each places it.
    pub textures: Vec<(usize, TexturePlacement)>,
    /// The vectors of its matte transfer, if there is one.
    pub transfer: Option<WebTransfer>,
}

impl MeshEntry {
    /// Adds the numbers of the parts of a mesh, which a camera frames.
    pub fn new(name: String, framing: Framing, parts: &[MeshPart<'_>], blobs: &mut Blobs) -> Self {
        let parts = parts.iter().map(|part| PartEntry::new(part, framing, blobs)).collect();
        Self { name, centre: framing.centre.to_array(), radius: framing.radius, parts }
    }
}

impl PartEntry {
    fn new(part: &MeshPart<'_>, framing: Framing, blobs: &mut Blobs) -> Self {
        let MeshPart { mesh, material, textures, transfer } = part;
        let mut words = |values: &mut dyn Iterator<Item = f64>| {
            let words: Vec<_> =
                values.map(|value| ((32767.0 * value).round() as i16).to_le_bytes()).collect();
            blobs.numbers(&words, 3)
        };
        let (centre, radius) = (framing.centre.to_array(), framing.radius);
        let places = mesh.positions().iter();
        let places = places.flat_map(|place| [0, 1, 2].map(|k| (f64::from(place[k]) - centre[k]) / radius));
        let positions = words(&mut { places });
        let normals = words(&mut mesh.normals().as_flattened().iter().map(|value| f64::from(*value)));
        let tangents = mesh.tangents().iter().flat_map(|[x, y, z, _]| [*x, *y, *z].map(f64::from));
        let tangents = words(&mut { tangents });
        let coordinates = textures.iter().filter_map(|(material, placement)| {
            let at = mesh.coordinates()?.iter().flat_map(|at| placement.coordinates(*at));
            let steps: Vec<_> = at.map(|at| ((STEPS * f64::from(at)).round() as i32).to_le_bytes()).collect();
            Some((*material, blobs.numbers(&steps, 2)))
        });
        let coordinates = coordinates.collect();
        let corners = mesh.triangles().as_flattened();
        let triangles = match mesh.positions().len() <= 1 << 16 {
            true => blobs
                .numbers(&corners.iter().map(|corner| (*corner as u16).to_le_bytes()).collect::<Vec<_>>(), 1),
            false => blobs.numbers(&corners.iter().map(|corner| corner.to_le_bytes()).collect::<Vec<_>>(), 1),
        };
        let transfer = transfer.as_ref().map(|transfer| blobs.transfer(transfer));
        Self { material: *material, positions, normals, tangents, coordinates, triangles, transfer }
    }
}
