//! The meshes of a page, and what their parts are shown in.

use std::collections::BTreeMap;

use brdf::TexturePlacement;
use engine::{Context, Failure};
use mesh::Mesh;
use preview::Framing;
use preview_page::{Blobs, MeshEntry, MeshPart};

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
        for (key, mesh) in context.inputs.many::<artifacts::Mesh>("mesh")? {
            let stem = key.stems().collect::<Vec<_>>().join(" · ");
            let parts = parts(&stem, &mesh.0, materials, textures);
            let name = if stem.is_empty() { "mesh".into() } else { stem };
            meshes.push(PageMesh { name, framing: framing(&mesh.0), parts });
        }
        for name in ["torus-knot", "sphere"] {
            meshes.extend(mesh::shape(name).map(|mesh| PageMesh {
                name: name.to_owned(),
                framing: framing(&mesh),
                parts: vec![Part { mesh, material: None, textures: Vec::new() }],
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
            let parts = parts.iter().map(|Part { mesh, material, textures }| MeshPart {
                mesh,
                material: *material,
                textures: textures.clone(),
            });
            let parts: Vec<_> = parts.collect();
            MeshEntry::new(name.clone(), *framing, &parts, blobs)
        };
        self.0.iter().map(entry).collect()
    }
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
) -> Vec<Part> {
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
        return vec![Part { mesh: mesh.clone(), material: None, textures }];
    }
    let part = |material: Option<usize>| Part {
        mesh: mesh.of_materials(|of| own(of) == material).0,
        material,
        textures: all.clone().filter(|(of, _)| has_coordinates && Some(*of) == material).collect(),
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
