//! The light at a mesh, in the modes `table` and `transfer` [KSS02, sec. 4].
//!
//! Light and viewer are brought into the mesh's own coordinates, in which neither its frames nor its transfer
//! matrices change. Under a light field or light probes, each vertex has the light of its own place. Frames
//! and light are interpolated over a triangle; at each sample of the picture the light is turned into the
//! frame there, and the table is looked up. With transfer, the light at a vertex is what arrives there,
//! turned back from its frame, so that frames which differ much between vertices do no harm either. The light
//! is kept while only the camera moves. Suns and lamps beside the coefficients are not in it: the material
//! itself reflects them at each sample ([`crate::shading::lamps`]).

use std::sync::Arc;

use brdf::BrdfTable;
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
use mesh::Mesh;
use rayon::prelude::*;
use sh::{Degree, Expansion, rotate};
use sphere::Rotation;
use transfer::{Frames, LightField, Transfer, arriving, quarter_turns};

use crate::light_at_places::{LightAtMesh, upside_down};
use crate::shading::table::{TableUniforms, Turn, table_radiance};
use crate::shading::turned_light::{MAX_DEGREE, angles_of, frame_at};
use crate::{Mode, Object, RenderError, Shot};

/// Light and viewer in the coordinates of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MeshView {
    pub(crate) light: MeshLight,
    pub(crate) viewer: [f64; 3],
}

/// The light of a mesh, in its coordinates.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum MeshLight {
    /// Distant light, which is the same at all vertices.
    Distant(Expansion),
    /// Other light at each vertex, a blend of that at some points.
    Near(LightField),
    /// Other light at each vertex, by its place and its normal.
    AtPlaces(LightAtMesh),
}

impl MeshLight {
    /// The degree of the distant light, or of the light at each point.
    fn degree(&self) -> Degree {
        match self {
            Self::Distant(light) => light.degree(),
            Self::Near(field) => field.lights()[0].degree(),
            Self::AtPlaces(light) => light.degree,
        }
    }
}

/// The light at vertices.
#[derive(Debug, Default)]
pub(crate) struct LightAtVertices {
    /// The number of coefficients of a channel.
    pub(crate) rows: usize,
    /// [V, rows, 3], or [rows, 3] if the light is the same at all vertices.
    pub(crate) values: Vec<f32>,
    /// Whether each vertex has a light of its own.
    pub(crate) of_vertices: bool,
    /// The turns about x of its bands ([`quarter_turns`]), with which it is turned into the frame of each
    /// point.
    pub(crate) quarter_turns: Vec<[f32; 2]>,
}

/// A mesh that a BRDF table shades.
#[derive(Clone, Debug)]
pub(crate) struct ShadedMesh {
    pub(crate) mesh: Arc<Mesh>,
    pub(crate) table: Arc<BrdfTable>,
    /// The matrices for [`Mode::Transfer`].
    transfer: Option<Arc<Vec<Transfer>>>,
    /// The places of vertices among the materials of a table of several.
    blend: Option<Arc<Vec<[f32; 2]>>>,
}

impl ShadedMesh {
    /// The mesh of an object in a mode.
    ///
    /// # Errors
    /// [`RenderError::Missing`] if the object lacks what the mode needs.
    pub(crate) fn new(object: &Object, mode: Mode) -> Result<Self, RenderError> {
        let missing = |missing| RenderError::Missing { what: "this mode", missing };
        let table = object.look.table().ok_or(missing("the BRDF table of the material"))?;
        if table.degree().get() > MAX_DEGREE {
            let degree = table.degree().get();
            return Err(RenderError::maps(format!("a BRDF table of degree {degree} is above {MAX_DEGREE}")));
        }
        let transfer = match mode {
            Mode::Transfer if object.offers(mode) => object.transfer.clone(),
            Mode::Transfer => return Err(missing("the transfer of the mesh")),
            _ => None,
        };
        let blend = object.blend.clone().filter(|blend| blend.len() == object.mesh.positions().len());
        Ok(Self { mesh: Arc::clone(&object.mesh), table: Arc::clone(table), transfer, blend })
    }

    /// Whether both meshes consist of the same values.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        fn same<T>(one: &Option<Arc<T>>, other: &Option<Arc<T>>) -> bool {
            match (one, other) {
                (Some(one), Some(other)) => Arc::ptr_eq(one, other),
                (one, other) => one.is_none() && other.is_none(),
            }
        }
        Arc::ptr_eq(&self.mesh, &other.mesh)
            && Arc::ptr_eq(&self.table, &other.table)
            && same(&self.transfer, &other.transfer)
            && same(&self.blend, &other.blend)
    }

    /// The frames of its vertices.
    ///
    /// # Errors
    /// If a normal and a tangent are not orthonormal.
    pub(crate) fn frames(&self) -> Result<Frames, RenderError> {
        let frames = Frames::of(&self.mesh).map_err(|error| RenderError::maps(error.to_string()))?;
        Ok(match &self.blend {
            Some(blend) => frames.with_blend(blend),
            None => frames,
        })
    }

    /// Light and viewer of a shot in the coordinates of an object with this mesh. The light is cut to what
    /// the table or the transfer takes.
    pub(crate) fn view(&self, object: &Object, shot: &Shot) -> MeshView {
        let taken = self.transfer.as_ref().map_or(self.table.degree(), |transfer| transfer[0].input());
        let (axes, mirrored) = axes(object);
        let turned = |light: &Expansion| {
            let light = rotate(&light.to_degree(taken.min(light.degree())), axes.inverse().after(shot.turn));
            if mirrored { upside_down(light) } else { light }
        };
        let light = match (object.look.light_at_places(), object.look.light_field()) {
            (None, None) => MeshLight::Distant(turned(object.look.table_light())),
            (Some(light), _) => MeshLight::AtPlaces(LightAtMesh {
                degree: taken.min(light.degree()),
                light: Arc::clone(light),
                to_light: DAffine3::from_mat3(shot.turn.inverse().matrix()) * object.place,
                turn: axes.inverse().after(shot.turn),
                is_mirrored: mirrored,
            }),
            (None, Some(field)) => {
                let to_mesh = object.place.inverse();
                let place = |point: &[f64; 3]| {
                    to_mesh.transform_point3(shot.turn.matrix() * DVec3::from_array(*point)).to_array()
                };
                let points = field.points().iter().map(place).collect();
                let lights = field.lights().iter().map(turned).collect();
                // An object without a size is not seen.
                LightField::new(points, lights)
                    .map_or_else(|_| MeshLight::Distant(Expansion::zero(Degree::ZERO)), MeshLight::Near)
            }
        };
        MeshView { light, viewer: object.place.inverse().transform_point3(shot.camera.eye()).to_array() }
    }

    /// The light at the vertices, or what of it arrives there.
    pub(crate) fn light(&self, frames: &Frames, light: &MeshLight) -> LightAtVertices {
        let transfer = self.transfer.as_deref();
        let degree = transfer.map_or(light.degree(), |transfer| transfer[0].output());
        let row = |rgb: &[f64; 3]| rgb.map(|value| value as f32);
        let all = |light: &Expansion| light.coefficients().iter().flat_map(row).collect::<Vec<_>>();
        let (values, of_vertices) = match (light, transfer) {
            (MeshLight::Distant(light), None) => (all(light), false),
            (MeshLight::Distant(light), Some(transfer)) => (arriving(frames, transfer, light), true),
            (MeshLight::Near(field), None) => {
                let at = |place: &[f32; 3]| all(&field.at(place.map(f64::from)));
                (frames.positions().par_iter().flat_map_iter(at).collect(), true)
            }
            (MeshLight::Near(field), Some(transfer)) => (field.arriving(frames, transfer), true),
            (MeshLight::AtPlaces(light), None) => (light.at_vertices(frames), true),
            (MeshLight::AtPlaces(light), Some(transfer)) => (light.arriving(frames, transfer), true),
        };
        LightAtVertices { rows: degree.rows(), values, of_vertices, quarter_turns: quarter_turns(degree) }
    }
}

/// The light at an object's vertices on the CPU.
#[derive(Debug)]
pub(crate) struct VertexLight {
    of: ShadedMesh,
    frames: Frames,
    view: Option<MeshView>,
    table: TableUniforms,
    light: LightAtVertices,
    viewer: Vec3,
    passes: u32,
}

impl VertexLight {
    /// A mesh to which no light was brought before.
    ///
    /// # Errors
    /// If a normal and a tangent are not orthonormal.
    pub(crate) fn new(of: ShadedMesh) -> Result<Self, RenderError> {
        let (frames, table) = (of.frames()?, TableUniforms::new(&of.table, 0));
        Ok(Self {
            of,
            frames,
            view: None,
            table,
            light: LightAtVertices::default(),
            viewer: Vec3::ZERO,
            passes: 0,
        })
    }

    /// Whether it is the light at this mesh.
    pub(crate) fn is_of(&self, mesh: &ShadedMesh) -> bool {
        self.of.is_same(mesh)
    }

    /// Brings the light of a shot to the vertices of an object, unless it is there.
    pub(crate) fn update(&mut self, object: &Object, shot: &Shot) {
        let view = self.of.view(object, shot);
        self.viewer = DVec3::from(view.viewer).as_vec3();
        if self.view.as_ref().is_none_or(|before| before.light != view.light) {
            self.light = self.of.light(&self.frames, &view.light);
            self.table = TableUniforms::new(&self.of.table, self.light.rows);
            self.passes += 1;
        }
        self.view = Some(view);
    }

    /// The radiance toward the viewer at a point of a triangle of the mesh, in its coordinates, RGB; signed.
    pub(crate) fn radiance(&self, triangle: usize, at: Vec3) -> Vec3 {
        let corners = self.of.mesh.triangles()[triangle].map(|vertex| vertex as usize);
        let shares = shares(corners.map(|vertex| self.frames.positions()[vertex].into()), at);
        let (mut tangent, mut normal) = (Vec3::ZERO, Vec3::ZERO);
        let (mut toward, mut blend) = (Vec3::ZERO, Vec2::ZERO);
        for (vertex, share) in corners.into_iter().zip(shares) {
            let [x, _, n] = self.frames.axes(vertex).map(Vec3::from);
            tangent += x * share;
            normal += n * share;
            toward += (self.viewer - Vec3::from(self.frames.positions()[vertex])) * share;
            blend += Vec2::from(self.frames.blend(vertex)) * share;
        }
        let frame = frame_at(tangent, normal);
        let view = Vec3::from(frame.map(|axis| axis.dot(toward))).try_normalize().unwrap_or(Vec3::Z);
        let LightAtVertices { rows, values, of_vertices, quarter_turns } = &self.light;
        let lights = corners.map(|vertex| {
            let first = if *of_vertices { vertex * 3 * rows } else { 0 };
            &values[first..][..3 * rows]
        });
        let turn = Turn { quarter_turns, angles: angles_of(frame) };
        table_radiance(self.table, self.of.table.values(), (lights, shares), turn, view, blend)
    }

    /// The number of times that a light was brought to the vertices.
    pub(crate) fn passes(&self) -> u32 {
        self.passes
    }
}

/// The shares of a triangle's corners in a point of its plane.
fn shares([a, b, c]: [Vec3; 3], at: Vec3) -> [f32; 3] {
    let normal = (b - a).cross(c - a);
    let area = |p: Vec3, q: Vec3| (p - at).cross(q - at).dot(normal).max(0.0);
    let areas = [area(b, c), area(c, a), area(a, b)];
    let sum: f32 = areas.iter().sum();
    if sum > 0.0 { areas.map(|area| area / sum) } else { [1.0, 0.0, 0.0] }
}

/// The rotation of an object, and whether a mirror image along z comes before it.
fn axes(object: &Object) -> (Rotation, bool) {
    let linear = object.place.matrix3;
    let mirrored = linear.determinant() < 0.0;
    let scale = math::cbrt(linear.determinant().abs());
    let mut axes = linear * scale.recip();
    if mirrored {
        axes *= DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0));
    }
    let q = glam::DQuat::from_mat3(&axes);
    // An object without a size is not seen.
    (Rotation::from_quaternion(q.x, q.y, q.z, q.w).unwrap_or(Rotation::IDENTITY), mirrored)
}
