//! The meshes of a page, and what their parts are shown in.

use std::collections::BTreeMap;

use brdf::TexturePlacement;
use engine::{Context, Digest, Failure, ItemKey};
use mesh::Mesh;
use preview::Framing;
use preview::web::WebTransfer;
use preview_page::{Blobs, MeshEntry, MeshPart};
use transfer::StoredTransfer;

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
        let transfers = context.inputs.many::<artifacts::Transfer>("transfer")?;
        let digests = match transfers.is_empty() {
            true => Vec::new(),
            false => {
                context.inputs.many_bytes("mesh")?.iter().map(|bytes| Digest::of(bytes).to_string()).collect()
            }
        };
        if let Some((key, _)) = transfers.iter().find(|(_, transfer)| !digests.contains(&transfer.0.mesh)) {
            return Err(Failure::new(format!("the transfer{} belongs to no mesh of the page", named(key)))
                .help("connect the mesh that precompute-transfer used to `mesh`, including its tangents"));
        }
        let mut meshes = Vec::new();
        for (place, (key, mesh)) in context.inputs.many::<artifacts::Mesh>("mesh")?.into_iter().enumerate() {
            let stem = key.stems().collect::<Vec<_>>().join(" · ");
            let transfer =
                transfers.iter().find(|(_, transfer)| digests.get(place) == Some(&transfer.0.mesh));
            let transfer = transfer.map(|(_, transfer)| &transfer.0.value);
            let parts = parts(&stem, &mesh.0, materials, textures, transfer);
            if transfer.is_some() && parts.iter().any(|part| part.transfer.is_none()) {
                return Err(Failure::new(format!("the transfer{} is not matte", named(&key))).help(
                    "a page shows the transfer of matte meshes: form = \"matte\" of precompute-transfer",
                ));
            }
            let name = if stem.is_empty() { "mesh".into() } else { stem };
            meshes.push(PageMesh { name, framing: framing(&mesh.0), parts });
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

    /// Adds them to a page.
    pub(crate) fn entries(&self, blobs: &mut Blobs) -> Vec<MeshEntry> {
        let entry = |PageMesh { name, framing, parts }: &PageMesh| {
            let parts = parts.iter().map(|Part { mesh, material, textures, transfer }| MeshPart {
                mesh,
                material: *material,
                textures: textures.clone(),
                transfer: transfer.clone(),
            });
            let parts: Vec<_> = parts.collect();
            MeshEntry::new(name.clone(), *framing, &parts, blobs)
        };
        self.0.iter().map(entry).collect()
    }
}

/// An item's key after the name of what it is.
fn named(key: &ItemKey) -> String {
    if key.is_empty() { String::new() } else { format!(" {key}") }
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
) -> Vec<Part> {
    let vectors = |vertices: &[u32]| transfer.and_then(|transfer| WebTransfer::of(transfer, vertices));
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
        return vec![Part { mesh: mesh.clone(), material: None, textures, transfer: vectors(&all) }];
    }
    let part = |material: Option<usize>| {
        let (mesh, vertices) = mesh.of_materials(|of| own(of) == material);
        let textures = all.clone().filter(|(of, _)| has_coordinates && Some(*of) == material).collect();
        Part { mesh, material, textures, transfer: vectors(&vertices) }
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
