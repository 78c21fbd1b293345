//! The meshes of a page, and what their parts are shown in.

use std::collections::BTreeMap;
use std::sync::Arc;

use brdf::TexturePlacement;
use engine::{Context, Digest, Failure};
use mesh::Mesh;
use preview::web::WebTransfer;
use preview::{Framing, RenderError};
use preview_page::{Blobs, MeshEntry, MeshPart};
use transfer::StoredTransfer;

use super::pairs::name;
use crate::values::artifacts;

/// The meshes of a page.
pub(crate) struct Meshes(Vec<PageMesh>);

struct PageMesh {
    name: String,
    framing: Framing,
    parts: Vec<Part>,
}

/// The triangles of a mesh that have one material.
struct Part {
    mesh: Mesh,
    /// The material of the page that the triangles have in their file.
    material: Option<usize>,
    /// The materials that show their texture here.
    textures: Vec<(usize, TexturePlacement)>,
    transfer: Option<WebTransfer>,
}

impl Meshes {
    /// The connected meshes, and our own. `materials` are the names of the page's materials, and `textures`
    /// the placements of the textures of some of them.
    pub(crate) fn of(
        context: &Context<'_>,
        materials: &[String],
        textures: &BTreeMap<usize, TexturePlacement>,
    ) -> Result<Self, Failure> {
        let mut meshes = Vec::new();
        let transfers = transfers(context)?;
        for ((key, mesh), transfer) in context.inputs.many::<artifacts::Mesh>("mesh")?.iter().zip(transfers) {
            let stem = key.stems().collect::<Vec<_>>().join(" · ");
            let transfer = transfer.as_ref().map(|transfer| &transfer.0.value);
            let parts = parts(&stem, &mesh.0, materials, textures, transfer).map_err(|error| {
                Failure::new(format!("the transfer of {}: {error}", name(key, "the mesh")))
                    .help("a page shows that of matte meshes: form = \"matte\" of precompute-transfer")
            })?;
            meshes.push(PageMesh { name: name(key, "mesh"), framing: framing(&mesh.0), parts });
        }
        for name in ["torus-knot", "sphere"] {
            meshes.extend(mesh::shape(name).map(|mesh| PageMesh {
                name: name.to_owned(),
                framing: framing(&mesh),
                parts: vec![Part { mesh, material: None, textures: Vec::new(), transfer: None }],
            }));
        }
        Ok(Self(meshes))
    }

    /// Whether a part shows the texture of a material.
    pub(crate) fn show_texture(&self, material: usize) -> bool {
        let parts = self.0.iter().flat_map(|mesh| &mesh.parts);
        parts.flat_map(|part| &part.textures).any(|(of, _)| *of == material)
    }

    /// Adds them to a page. A transfer that would take more than so many bytes is left out, and named.
    pub(crate) fn entries(
        &self,
        blobs: &mut Blobs,
        most: usize,
        left_out: &mut Vec<String>,
    ) -> Vec<MeshEntry> {
        let mut entry = |mesh: &PageMesh| {
            let first = blobs.next();
            let whole = mesh.entry(true, blobs);
            if mesh.parts.iter().all(|part| part.transfer.is_none()) || blobs.since(first) <= most {
                return whole;
            }
            left_out.push(format!("the transfer of {}", mesh.name));
            blobs.forget(first);
            mesh.entry(false, blobs)
        };
        self.0.iter().map(&mut entry).collect()
    }
}

impl PageMesh {
    /// Adds it to a page, with its transfer or without.
    fn entry(&self, has_transfer: bool, blobs: &mut Blobs) -> MeshEntry {
        let parts = self.parts.iter().map(|Part { mesh, material, textures, transfer }| MeshPart {
            mesh,
            material: *material,
            textures: textures.clone(),
            transfer: transfer.clone().filter(|_| has_transfer),
        });
        let parts: Vec<_> = parts.collect();
        MeshEntry::new(self.name.clone(), self.framing, &parts, blobs)
    }
}

/// The transfer of each connected mesh, by the mesh that it was computed for.
fn transfers(context: &Context<'_>) -> Result<Vec<Option<Arc<artifacts::Transfer>>>, Failure> {
    let transfers = context.inputs.many::<artifacts::Transfer>("transfer")?;
    let mut found = vec![None; context.inputs.many::<artifacts::Mesh>("mesh")?.len()];
    if transfers.is_empty() {
        return Ok(found);
    }
    let digests = context.inputs.many_bytes("mesh")?;
    let digests: Vec<_> = digests.iter().map(|bytes| Digest::of(bytes).to_string()).collect();
    for (key, transfer) in transfers {
        let place = digests.iter().position(|digest| *digest == transfer.0.mesh).ok_or_else(|| {
            Failure::new(format!("{} belongs to no mesh of the page", name(&key, "the transfer")))
                .help("connect the mesh that precompute-transfer used to `mesh`, including its tangents")
        })?;
        if found[place].replace(transfer).is_some() {
            return Err(Failure::new(format!("{} has two transfers", name(&key, "the mesh")))
                .help("connect one to the page: it shows one form of a matte mesh"));
        }
    }
    Ok(found)
}

fn framing(mesh: &Mesh) -> Framing {
    let (centre, radius) = mesh.bounds();
    Framing::ball(centre.into(), if radius > 0.0 { radius } else { 1.0 })
}

/// The triangles of each material of the page that a mesh has in its file, and the rest. A mesh that has none
/// of them shows any material on the whole of it, with its texture.
fn parts(
    stem: &str,
    mesh: &Mesh,
    materials: &[String],
    textures: &BTreeMap<usize, TexturePlacement>,
    transfer: Option<&StoredTransfer>,
) -> Result<Vec<Part>, RenderError> {
    let vectors = |vertices: &[u32]| transfer.map(|transfer| WebTransfer::of(transfer, vertices)).transpose();
    let own: Vec<_> = mesh.materials().iter().map(|name| own_material(stem, name, materials)).collect();
    let own = |material: Option<u32>| own.get(material? as usize).copied().flatten();
    let worn = mesh.material_ranges().iter().map(|range| own(range.material));
    let mut worn: Vec<Option<usize>> = worn.collect();
    worn.sort_unstable();
    worn.dedup();
    let has_coordinates = mesh.coordinates().is_some();
    let all = textures.iter().map(|(material, placement)| (*material, *placement));
    if worn.iter().all(Option::is_none) {
        let textures = all.filter(|_| has_coordinates).collect();
        let all: Vec<u32> = (0..mesh.positions().len() as u32).collect();
        return Ok(vec![Part { mesh: mesh.clone(), material: None, textures, transfer: vectors(&all)? }]);
    }
    let part = |material: Option<usize>| {
        let (mesh, vertices) = mesh.of_materials(|of| own(of) == material);
        let textures = all.clone().filter(|(of, _)| has_coordinates && Some(*of) == material).collect();
        Ok(Part { mesh, material, textures, transfer: vectors(&vertices)? })
    };
    worn.into_iter().map(part).collect()
}

/// The material of a page that has the name of one of a mesh's file, as `specula init` names material files.
fn own_material(stem: &str, name: &str, materials: &[String]) -> Option<usize> {
    let plain = |letter: char| if letter.is_alphanumeric() || "-_ ".contains(letter) { letter } else { '-' };
    let names = [name.to_owned(), format!("{stem}-{name}")];
    let named = |names: &[String]| materials.iter().position(|material| names.contains(material));
    named(&names).or_else(|| named(&names.clone().map(|name| name.chars().map(plain).collect())))
}
