//! Scenes: meshes with their looks in front of an environment.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use mesh::Mesh;
use sphere::Direction;
use transfer::Transfer;

use crate::shading::base_color::BaseColorMap;
use crate::{Framing, Light, Look, Mode, RenderError, Show};

/// A mesh with its place and its look.
#[derive(Clone, Debug)]
pub struct Object {
    /// The object's mesh, in its own coordinates.
    pub mesh: Arc<Mesh>,
    /// The mesh that the object's mesh is a part of, in the same coordinates, if it is one: all of it hides
    /// light from the object, and a camera frames all of it.
    pub whole: Option<Arc<Mesh>>,
    /// The rotation, uniform scale and translation from the mesh's coordinates to the world.
    pub place: DAffine3,
    /// The object's material under its light.
    pub look: Arc<Look>,
    /// The transfer matrices of the mesh, for [`Mode::Transfer`]: for all channels, or for each of red, green
    /// and blue.
    pub transfer: Option<Arc<Vec<Transfer>>>,
    /// The place of each vertex between the first material of its look's table, 0, and the last, 1, along
    /// both parameters of the table. Without it, or if it is of another mesh, only the first is seen.
    pub blend: Option<Arc<Vec<[f32; 2]>>>,
}

/// The distance of neighbours in a row, in radii.
const GAP: f64 = 2.2;

/// The triangles of a mesh that have one look, for [`Scene::of_parts`].
#[derive(Clone, Debug)]
pub struct ScenePart {
    /// The triangles, in the coordinates of the whole mesh.
    pub mesh: Arc<Mesh>,
    /// The look of the triangles.
    pub look: Arc<Look>,
    /// The transfer matrices of the vertices of this part, as [`Object::transfer`] has them.
    pub transfer: Option<Arc<Vec<Transfer>>>,
    /// The places of the vertices of this part among the materials of the table, as [`Object::blend`] has it.
    pub blend: Option<Arc<Vec<[f32; 2]>>>,
}

/// Meshes in front of an environment.
///
/// Light is distant: each object reflects the light of its own look. No object casts a shadow on another; on
/// itself it does in the modes that say so. A mesh of several materials is several objects, each with the
/// triangles of one, which are parts of one whole and shadow each other.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The light in the background.
    pub light: Arc<Light>,
    /// The meshes.
    pub objects: Vec<Object>,
}

impl Scene {
    /// Makes a scene of one mesh with one look, in its own coordinates.
    pub fn of(mesh: Arc<Mesh>, look: Arc<Look>) -> Self {
        let place = DAffine3::IDENTITY;
        let object = Object { mesh, whole: None, place, look, transfer: None, blend: None };
        Self { light: Arc::clone(object.look.light()), objects: vec![object] }
    }

    /// Makes a scene of one mesh with several looks under a light: side by side in their order, from the left
    /// to the right of a camera at rest.
    pub fn row(light: Arc<Light>, mesh: &Arc<Mesh>, looks: &[Arc<Look>]) -> Self {
        let (_, radius) = mesh.bounds();
        let middle = (looks.len() as f64 - 1.0) / 2.0;
        let object = |(number, look): (usize, &Arc<Look>)| Object {
            mesh: Arc::clone(mesh),
            whole: None,
            place: DAffine3::from_translation(DVec3::Y * ((number as f64 - middle) * GAP * radius)),
            look: Arc::clone(look),
            transfer: None,
            blend: None,
        };
        Self { light, objects: looks.iter().enumerate().map(object).collect() }
    }

    /// Makes a scene of a mesh of several materials, in its own coordinates. What a scene of one look says of
    /// its first object, such as the diagram of [`Mode::Samples`], is that of the first part.
    pub fn of_parts(whole: &Arc<Mesh>, light: Arc<Light>, parts: Vec<ScenePart>) -> Self {
        let object = |ScenePart { mesh, look, transfer, blend }| {
            let (whole, place) = (Some(Arc::clone(whole)), DAffine3::IDENTITY);
            Object { mesh, whole, place, look, transfer, blend }
        };
        Self { light, objects: parts.into_iter().map(object).collect() }
    }

    /// Returns the same scene with the transfer matrices of its first object's mesh.
    #[must_use]
    pub fn with_transfer(mut self, transfer: Option<Arc<Vec<Transfer>>>) -> Self {
        if let Some(object) = self.objects.first_mut() {
            object.transfer = transfer;
        }
        self
    }

    /// Returns the same scene with the place of each vertex of its first object's mesh among the materials
    /// of the table.
    #[must_use]
    pub fn with_blend(mut self, blend: Option<Arc<Vec<[f32; 2]>>>) -> Self {
        if let Some(object) = self.objects.first_mut() {
            object.blend = blend;
        }
        self
    }

    /// Returns the same scene with the disks of its light in other directions, in order; `None` if the light
    /// has not as many. Its maps were made of the light before: the looks keep their materials and tables,
    /// but no map.
    pub fn with_disks_at(&self, directions: &[Direction]) -> Option<Self> {
        let light = Arc::new(self.light.with_disks_at(directions)?);
        let mut scene = self.clone();
        for object in &mut scene.objects {
            let look = &object.look;
            if Arc::ptr_eq(look.light(), &self.light) {
                let (material, sizes) = (look.material()?.clone(), look.sizes());
                let moved = Look::without_maps(Arc::clone(&light), material, sizes);
                let moved = moved.with_table(look.table().cloned());
                let moved = moved.with_light_field(look.light_field().cloned());
                let moved = moved.with_light_at_places(look.light_at_places().cloned());
                object.look = Arc::new(moved.with_base_color(look.base_color().cloned()));
            }
        }
        scene.light = light;
        Some(scene)
    }

    /// Whether every object has its maps, a BRDF table or the cube of an engine.
    pub fn has_maps(&self) -> bool {
        self.objects
            .iter()
            .map(|object| &object.look)
            .all(|look| look.has_maps() || look.table().is_some() || look.prefiltered_cube().is_some())
    }

    /// Whether it shows a light, and no material of anybody's.
    pub fn shows_light(&self) -> bool {
        !self.objects.is_empty() && self.objects.iter().all(|object| object.look.shows_light())
    }

    /// Whether every object has the inputs of a mode beside light and material.
    pub fn offers(&self, mode: Mode) -> bool {
        self.objects.iter().all(|object| object.offers(mode))
    }

    /// The mode to show as long as nobody has chosen one: taps if there are some, otherwise the local SHRM;
    /// of a light alone the cube of an engine, or brute force if there is none.
    pub fn first_mode(&self) -> Mode {
        match (self.offers(Mode::Taps), self.shows_light()) {
            (true, _) => Mode::Taps,
            (_, false) => Mode::LocalShrm,
            (_, true) if self.offers(Mode::Prefiltered) => Mode::Prefiltered,
            (_, true) => Mode::BruteForce,
        }
    }

    /// The modes in which it can be drawn in place of these. If an object lacks what a mode needs, brute
    /// force replaces the mode on all objects ([`Mode::reference`]); if both sides of a comparison are the
    /// same then, there is only one.
    pub fn available(&self, show: Show) -> Show {
        show.among(|mode| self.offers(mode))
    }

    /// Whether a ray meets a triangle, from either side (Möller and Trumbore, "Fast, Minimum Storage
    /// Ray/Triangle Intersection", 1997).
    pub fn is_hit(&self, origin: DVec3, ray: DVec3) -> bool {
        self.objects.iter().any(|object| {
            let to_mesh = object.place.inverse();
            let (origin, ray) = (to_mesh.transform_point3(origin), to_mesh.transform_vector3(ray));
            let place =
                |vertex: u32| DVec3::from_array(object.mesh.positions()[vertex as usize].map(f64::from));
            object.mesh.triangles().iter().any(|corners| {
                let [a, b, c] = corners.map(place);
                let (along, across, from) = (b - a, c - a, origin - a);
                let p = ray.cross(across);
                let scale = along.dot(p).recip();
                let (u, q) = (from.dot(p) * scale, from.cross(along));
                let v = ray.dot(q) * scale;
                scale.is_finite() && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && across.dot(q) * scale > 0.0
            })
        })
    }

    /// A ball around all objects, and their height, for a camera. For a single mesh it is [`Mesh::bounds`] at
    /// its place. If nothing has a size, its radius is 1.
    pub fn framing(&self) -> Framing {
        let balls: Vec<(DVec3, f64)> = self.objects.iter().filter_map(Object::ball).collect();
        let least = balls.iter().map(|(centre, radius)| centre - DVec3::splat(*radius)).reduce(DVec3::min);
        let most = balls.iter().map(|(centre, radius)| centre + DVec3::splat(*radius)).reduce(DVec3::max);
        let centre = least.zip(most).map_or(DVec3::ZERO, |(least, most)| (least + most) / 2.0);
        let reach = |(at, radius): &(DVec3, f64)| at.distance(centre) + radius;
        let radius = balls.iter().map(reach).fold(0.0, f64::max);
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let rise = |(at, radius): &(DVec3, f64)| (at.z - centre.z).abs() + radius;
        // One ball is as high as it is wide, whatever rounding does.
        let height = if balls.len() > 1 { balls.iter().map(rise).fold(0.0, f64::max) } else { radius };
        Framing { centre, radius, height }
    }
}

impl Object {
    /// The object's mesh in the coordinates of the scene.
    ///
    /// # Errors
    /// If a position becomes too large there.
    pub fn mesh_in_scene(&self) -> Result<Arc<Mesh>, RenderError> {
        if self.place == DAffine3::IDENTITY {
            return Ok(Arc::clone(&self.mesh));
        }
        let mesh = self.mesh.transformed(&self.place);
        mesh.map(Arc::new).map_err(|error| RenderError::maps(error.to_string()))
    }

    /// The mesh that hides light from the object: the whole that it is a part of, or its own.
    pub(crate) fn occluder(&self) -> &Arc<Mesh> {
        self.whole.as_ref().unwrap_or(&self.mesh)
    }

    /// The texture of the base colour, if the mesh has coordinates for it.
    pub(crate) fn base_color_map(&self) -> Option<&BaseColorMap> {
        self.look.base_color_map().filter(|_| self.mesh.coordinates().is_some())
    }

    /// Whether the object has the inputs of a mode beside light and material.
    pub fn offers(&self, mode: Mode) -> bool {
        let is_of_this_mesh = |transfer: &Arc<Vec<Transfer>>| {
            transfer.iter().all(|transfer| transfer.len() == self.mesh.positions().len())
        };
        match mode {
            Mode::Table => self.look.table().is_some(),
            Mode::Transfer => {
                self.look.table().is_some() && self.transfer.as_ref().is_some_and(is_of_this_mesh)
            }
            Mode::Taps => self.look.compact_map().is_ok(),
            Mode::Prefiltered if self.look.prefiltered_cube().is_some() => true,
            mode => !mode.needs_maps() || self.look.has_maps(),
        }
    }

    /// The ball around the triangles of the object, or of the whole that it is a part of, in the world;
    /// `None` if there are none.
    fn ball(&self) -> Option<(DVec3, f64)> {
        let mesh = self.occluder();
        if mesh.triangles().is_empty() {
            return None;
        }
        let (centre, radius) = mesh.bounds();
        let axes = self.place.matrix3;
        let scale = axes.col(0).length().max(axes.col(1).length()).max(axes.col(2).length());
        Some((self.place.transform_point3(DVec3::from_array(centre)), radius * scale))
    }
}

#[cfg(test)]
mod tests {
    use brdf::{Choice, Lambert, Material, project};
    use envmap::Environment;
    use sh::{Degree, Expansion, Stop};
    use shrm::Reflection;
    use sphere::LatLong;

    use super::*;
    use crate::MapSizes;

    fn scene(places: &[DAffine3], mesh: Mesh) -> Scene {
        let grid = LatLong::with_rows(4);
        let light = Arc::new(Light::new(Environment::new(grid, vec![[1.0; 3]; grid.len()]).unwrap(), None));
        let white = Material::Lambert(Lambert::new([1.0; 3]).unwrap());
        let flat = Choice::Degree { f: Degree::ZERO, p: Degree::ZERO };
        let reflection = Reflection::convolve(
            &Expansion::zero(Degree::ZERO),
            &project(&white, flat, Stop::NEVER).unwrap().coefficients,
        );
        let look = Arc::new(Look::new(Arc::clone(&light), reflection, None, MapSizes::default()));
        let mesh = Arc::new(mesh);
        let object = |place: &DAffine3| Object {
            mesh: Arc::clone(&mesh),
            whole: None,
            place: *place,
            look: Arc::clone(&look),
            transfer: None,
            blend: None,
        };
        Scene { light, objects: places.iter().map(object).collect() }
    }

    #[test]
    fn one_mesh_is_framed_by_its_own_ball() {
        let sphere = mesh::shape("sphere").unwrap();
        let place = DAffine3::from_scale_rotation_translation(
            DVec3::splat(2.0),
            glam::DQuat::from_rotation_y(0.4),
            DVec3::new(1.0, -3.0, 0.5),
        );
        let framing = scene(&[place], sphere).framing();
        assert!(framing.centre.distance(DVec3::new(1.0, -3.0, 0.5)) < 1e-6, "{framing:?}");
        assert!((framing.radius - 2.0).abs() < 1e-6, "{framing:?}");
    }

    #[test]
    fn two_balls_side_by_side_are_framed_by_one_that_touches_both() {
        let places = [-2.0, 2.0].map(|y| DAffine3::from_translation(DVec3::new(0.0, y, 0.0)));
        let framing = scene(&places, mesh::shape("sphere").unwrap()).framing();
        assert!(framing.centre.length() < 1e-6 && (framing.radius - 3.0).abs() < 1e-6, "{framing:?}");
    }

    #[test]
    fn parts_are_framed_as_the_whole_is() {
        let plane = mesh::shape("plane").unwrap();
        let half = mesh::MaterialRange { material: Some(0), triangles: 1 };
        let rest = mesh::MaterialRange { material: None, triangles: 1 };
        let whole = Arc::new(plane.with_materials(vec!["half".to_owned()], &[half, rest]).unwrap());
        let one = scene(&[DAffine3::IDENTITY], Mesh::clone(&whole));
        let part = |material| ScenePart {
            mesh: Arc::new(whole.of_materials(|of| of == material).0),
            look: Arc::clone(&one.objects[0].look),
            transfer: None,
            blend: None,
        };
        let parts = Scene::of_parts(&whole, Arc::clone(&one.light), vec![part(Some(0)), part(None)]);
        assert_eq!(parts.framing(), one.framing());
        assert!(parts.objects.iter().all(|object| object.mesh.triangles().len() == 1));
    }

    #[test]
    fn a_mesh_without_triangles_is_framed_by_the_unit_ball() {
        let empty = Mesh::new(Vec::new(), Vec::new(), Vec::new(), None, Vec::new()).unwrap();
        let framing = scene(&[DAffine3::IDENTITY], empty).framing();
        assert_eq!(framing, Framing::ball(DVec3::ZERO, 1.0));
    }
}
