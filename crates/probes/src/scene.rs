//! A scene as light sees it: triangles, matte surfaces, what they emit, and lamps.

use glam::Vec3;

use crate::lamp::{Lamp, LampError};
use crate::material::Material;
use crate::texture::Texture;

/// What a triangle has at a corner beside its position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// The colour and alpha that the base colour is multiplied by, linear.
    pub color: [f32; 4],
    /// The coordinates in the texture of the base colour, transforms applied, v downward.
    pub base: [f32; 2],
    /// The coordinates in the texture of the emission.
    pub emission: [f32; 2],
    /// The coordinates in the texture of the metallic share.
    pub metallic: [f32; 2],
}

impl Default for Corner {
    /// White, at the origin of every texture.
    fn default() -> Self {
        Self { color: [1.0; 4], base: [0.0; 2], emission: [0.0; 2], metallic: [0.0; 2] }
    }
}

/// Consecutive triangles of one node of the file, for messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The name of the node.
    pub name: String,
    /// The number of its triangles.
    pub triangles: usize,
}

/// A box with a name, in which probes may be placed.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedBox {
    /// The name of the node.
    pub name: String,
    /// The least and the greatest coordinates, in metres.
    pub bounds: [[f32; 3]; 2],
}

/// The parts of a [`Scene`], unchecked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneParts {
    /// The corners of each triangle in our frame, in metres, counter-clockwise as seen from its front.
    pub triangles: Vec<[[f32; 3]; 3]>,
    /// What the triangles have at their corners, in order; a triangle without an entry in `attributes_of` has
    /// the default.
    pub attributes: Vec<[Corner; 3]>,
    /// For each triangle, the place of its corners in `attributes`, or [`SceneParts::NONE`].
    pub attributes_of: Vec<u32>,
    /// The material of each triangle.
    pub material_of: Vec<u32>,
    /// The materials.
    pub materials: Vec<Material>,
    /// The textures.
    pub textures: Vec<Texture>,
    /// The lamps.
    pub lamps: Vec<Lamp>,
    /// The nodes that the triangles come from.
    pub parts: Vec<Part>,
    /// The boxes for probes.
    pub boxes: Vec<NamedBox>,
    /// The places of single probes, in metres.
    pub points: Vec<[f32; 3]>,
}

impl SceneParts {
    /// The place of what is not there.
    pub const NONE: u32 = u32::MAX;
}

/// A checked scene: it has triangles, all numbers are finite, and all references lead somewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    parts: SceneParts,
}

/// The reason why something is not a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// There is nothing that light could meet.
    #[error("the scene has no triangles; expected a mesh in a node of the scene")]
    NoTriangles,
    /// Every triangle is a point or a line.
    #[error("none of the {0} triangles of the scene has an area")]
    NoArea(usize),
    /// A coordinate, colour or texture coordinate is not finite.
    #[error("{part}: the {what} of a triangle are not finite numbers")]
    NotFinite {
        /// The node.
        part: String,
        /// What is not finite.
        what: &'static str,
    },
    /// A material has a number outside of its range.
    #[error("the material {material}: {what} is not in its range")]
    Material {
        /// The name of the material.
        material: String,
        /// The number.
        what: &'static str,
    },
    /// A lamp has no light, or a number outside of its range.
    #[error("the lamp {lamp}: {error}")]
    Lamp {
        /// The name of the lamp.
        lamp: String,
        /// What is wrong with it.
        error: LampError,
    },
    /// The parts do not belong together.
    #[error("the {0} of the scene do not belong together")]
    Inconsistent(&'static str),
}

impl Scene {
    /// Checks the parts of a scene.
    ///
    /// # Errors
    /// If it has no triangle with an area, a number is not finite or out of its range, or a reference leads
    /// nowhere.
    pub fn new(parts: SceneParts) -> Result<Self, SceneError> {
        let count = parts.triangles.len();
        if count == 0 {
            return Err(SceneError::NoTriangles);
        }
        let whole = |length: usize, what| {
            if length == count { Ok(()) } else { Err(SceneError::Inconsistent(what)) }
        };
        whole(parts.material_of.len(), "materials of triangles")?;
        whole(parts.attributes_of.len(), "attributes of triangles")?;
        whole(parts.parts.iter().map(|part| part.triangles).sum(), "nodes")?;
        let are_below = |list: &[u32], length: usize| list.iter().all(|&at| (at as usize) < length);
        if !are_below(&parts.material_of, parts.materials.len()) {
            return Err(SceneError::Inconsistent("materials of triangles"));
        }
        let has = |&at: &u32| at == SceneParts::NONE || (at as usize) < parts.attributes.len();
        if !parts.attributes_of.iter().all(has) {
            return Err(SceneError::Inconsistent("attributes of triangles"));
        }
        let scene = Self { parts };
        scene.check_numbers()?;
        let has_area = |corners: &[[f32; 3]; 3]| {
            let [a, b, c] = corners.map(|corner| Vec3::from(corner).as_dvec3());
            (b - a).cross(c - a).length_squared() > 0.0
        };
        if !scene.parts.triangles.iter().any(has_area) {
            return Err(SceneError::NoArea(count));
        }
        Ok(scene)
    }

    /// A scene of parts that are those of a checked one, or less.
    pub(crate) fn of_checked(parts: SceneParts) -> Self {
        Self { parts }
    }

    fn check_numbers(&self) -> Result<(), SceneError> {
        let SceneParts { triangles, attributes, attributes_of, materials, textures, lamps, .. } = &self.parts;
        let not_finite = |triangle: usize, what| {
            Err(SceneError::NotFinite { part: self.part_of(triangle).to_owned(), what })
        };
        if let Some(at) =
            triangles.iter().position(|corners| !corners.as_flattened().iter().all(|x| x.is_finite()))
        {
            return not_finite(at, "positions");
        }
        let is_finite = |Corner { color, base, emission, metallic }: &Corner| {
            let all = color.iter().chain(base).chain(emission).chain(metallic);
            all.into_iter().all(|number| number.is_finite())
        };
        for (triangle, &at) in attributes_of.iter().enumerate() {
            let corners = attributes.get(at as usize);
            if !corners.is_none_or(|corners| corners.iter().all(is_finite)) {
                return not_finite(triangle, "colours or texture coordinates");
            }
        }
        for material in materials {
            if let Some(what) = material.wrong(textures.len()) {
                return Err(SceneError::Material { material: material.name.clone(), what });
            }
        }
        for lamp in lamps {
            lamp.check().map_err(|error| SceneError::Lamp { lamp: lamp.name.clone(), error })?;
        }
        Ok(())
    }

    /// The parts of the scene.
    pub fn parts(&self) -> &SceneParts {
        &self.parts
    }

    /// The name of the node that a triangle comes from.
    pub fn part_of(&self, triangle: usize) -> &str {
        let mut first = 0;
        for part in &self.parts.parts {
            first += part.triangles;
            if triangle < first {
                return &part.name;
            }
        }
        ""
    }

    /// The least and the greatest coordinates of all triangles, in metres.
    pub fn bounds(&self) -> [[f32; 3]; 2] {
        let corners = self.parts.triangles.as_flattened().iter().map(|corner| Vec3::from(*corner));
        let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        corners.fold(none, |[least, most], at| [least.min(at), most.max(at)]).map(|at| at.to_array())
    }

    /// Whether no surface changes the colour of light: the transport then has one channel.
    pub fn is_grey(&self) -> bool {
        let SceneParts { materials, textures, attributes, .. } = &self.parts;
        let equal = |[red, green, blue]: [f32; 3]| red == green && green == blue;
        let is_grey = |material: &Material| {
            let [red, green, blue, _] = material.base;
            let texture = material.base_texture.and_then(|how| textures.get(how.texture as usize));
            material.is_unlit || equal([red, green, blue]) && texture.is_none_or(Texture::is_grey)
        };
        let are_grey = |corners: &[Corner; 3]| {
            corners.iter().all(|Corner { color: [red, green, blue, _], .. }| equal([*red, *green, *blue]))
        };
        materials.iter().all(is_grey) && attributes.iter().all(are_grey)
    }

    /// The materials that emit light, by their places: the columns of emission are in this order.
    pub fn emitters(&self) -> Vec<u32> {
        (0..)
            .zip(&self.parts.materials)
            .filter(|(_, material)| material.emission.is_some())
            .map(|(at, _)| at)
            .collect()
    }
}
