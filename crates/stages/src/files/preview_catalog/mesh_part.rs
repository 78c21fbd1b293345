//! Parts of a mesh: the triangles of some of its materials.

use std::sync::Arc;

use mesh::Mesh;
use transfer::Transfer;

/// The triangles of a mesh that have one look.
pub(super) struct MeshPart {
    pub(super) mesh: Arc<Mesh>,
    pub(super) transfer: Option<Arc<Vec<Transfer>>>,
    pub(super) blend: Option<Arc<Vec<[f32; 2]>>>,
}

impl MeshPart {
    /// The triangles of some materials of a mesh, with what the mesh has at their vertices.
    pub(super) fn of(
        mesh: &Mesh,
        is_kept: impl Fn(Option<u32>) -> bool,
        transfer: &Option<Arc<Vec<Transfer>>>,
        blend: &Option<Arc<Vec<[f32; 2]>>>,
    ) -> Self {
        let (part, vertices) = mesh.of_materials(is_kept);
        let matrices = |transfer: &Transfer| {
            let values = vertices.iter().flat_map(|&vertex| transfer.matrix(vertex as usize)).copied();
            Transfer::new(transfer.output(), transfer.input(), values.collect())
        };
        let transfer =
            transfer.as_ref().filter(|all| all.iter().all(|of| of.len() == mesh.positions().len()));
        let blend = blend.as_ref().filter(|blend| blend.len() == mesh.positions().len());
        Self {
            transfer: transfer.and_then(|all| all.iter().map(matrices).collect::<Option<_>>()).map(Arc::new),
            blend: blend.map(|all| Arc::new(vertices.iter().map(|&vertex| all[vertex as usize]).collect())),
            mesh: Arc::new(part),
        }
    }
}
