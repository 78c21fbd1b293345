//! The radiance of a mesh's vertices in the modes `table` and `transfer`, and what is kept of it between
//! pictures [KSS02, sec. 4].
//!
//! Shading takes place in the mesh's own coordinates, in which neither its frames nor its transfer matrices
//! change: light and viewer are brought there. While only the camera moves, the light that was turned into
//! the frames (with transfer: what of it arrives there) is kept; while only the light moves, the table's
//! coefficients toward the viewer are.

use std::sync::Arc;

use brdf::BrdfTable;
use glam::{DMat3, DVec3};
use mesh::Mesh;
use sh::{Expansion, rotate};
use sphere::Rotation;
use transfer::{FixedLight, FixedView, Frames, Transfer, Viewer, shade, shade_with_transfer};

use crate::{Mode, Object, RenderError, Shot};

/// The number of times that the vertices of an object were shaded, by what was kept from the picture before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VertexPasses {
    /// The passes in which light and view were new.
    pub both_new: u32,
    /// The passes in which the light in the frames was kept: only the view moved.
    pub light_kept: u32,
    /// The passes in which the coefficients toward the viewer were kept: only the light moved.
    pub view_kept: u32,
}

/// Light and viewer in the coordinates of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VertexView {
    pub(crate) light: Expansion,
    pub(crate) viewer: [f64; 3],
}

/// The change since the picture before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    Nothing,
    View,
    Light,
    Both,
}

/// A mesh whose vertices a table shades.
#[derive(Clone, Debug)]
pub(crate) struct ShadedMesh {
    mesh: Arc<Mesh>,
    pub(crate) table: Arc<BrdfTable>,
    /// The matrices for [`Mode::Transfer`].
    transfer: Option<Arc<Vec<Transfer>>>,
    /// The places of vertices between the materials of a table of several.
    blend: Option<Arc<Vec<f32>>>,
}

impl ShadedMesh {
    /// The mesh of an object in a mode.
    ///
    /// # Errors
    /// [`RenderError::Missing`] if the object lacks what the mode needs.
    pub(crate) fn new(object: &Object, mode: Mode) -> Result<Self, RenderError> {
        let missing = |missing| RenderError::Missing { what: "this mode", missing };
        let table = object.look.table().ok_or(missing("the BRDF table of the material"))?;
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
    pub(crate) fn view(&self, object: &Object, shot: &Shot) -> VertexView {
        let light = object.look.light().lighting();
        let taken = self.transfer.as_ref().map_or(self.table.degree(), |transfer| transfer[0].input());
        let (axes, mirrored) = axes(object);
        let light = rotate(&light.to_degree(taken.min(light.degree())), axes.inverse().after(shot.turn));
        VertexView {
            light: if mirrored { upside_down(light) } else { light },
            viewer: object.place.inverse().transform_point3(shot.camera.eye()).to_array(),
        }
    }

    /// The light in the frames, or the part of it that arrives there.
    pub(crate) fn fixed_light(&self, frames: &Frames, light: &Expansion) -> FixedLight {
        match &self.transfer {
            Some(transfer) => FixedLight::with_transfer(transfer, light),
            None => FixedLight::new(frames, light),
        }
    }

    /// The table's coefficients toward the viewer, in the coordinates of the mesh.
    pub(crate) fn fixed_view(&self, frames: &Frames, viewer: [f64; 3]) -> FixedView {
        match &self.transfer {
            Some(transfer) => FixedView::with_transfer(frames, &self.table, Viewer::At(viewer), transfer),
            None => FixedView::new(frames, &self.table, Viewer::At(viewer)),
        }
    }

    fn shade(&self, frames: &Frames, view: &VertexView) -> Vec<[f32; 3]> {
        let viewer = Viewer::At(view.viewer);
        match self.transfer.as_ref().map(|transfer| transfer.as_slice()) {
            Some([transfer]) => shade_with_transfer(frames, &self.table, viewer, transfer, &view.light),
            Some(_) => self.fixed_light(frames, &view.light).shade(frames, &self.table, viewer),
            None => shade(frames, &self.table, viewer, &view.light),
        }
    }
}

impl VertexView {
    /// Compares light and view with those of the picture before.
    pub(crate) fn change(&self, before: Option<&Self>) -> Change {
        let same = |kept: fn(&Self, &Self) -> bool| before.is_some_and(|before| kept(self, before));
        match (same(|one, other| one.light == other.light), same(|one, other| one.viewer == other.viewer)) {
            (true, true) => Change::Nothing,
            (true, false) => Change::View,
            (false, true) => Change::Light,
            (false, false) => Change::Both,
        }
    }
}

/// The vertices of an object on the CPU, with what is kept for the next picture.
#[derive(Debug)]
pub(crate) struct VertexShading {
    of: ShadedMesh,
    frames: Frames,
    view: Option<VertexView>,
    light: Option<FixedLight>,
    seen: Option<FixedView>,
    radiance: Vec<[f32; 3]>,
    passes: VertexPasses,
}

impl VertexShading {
    /// A mesh that was not shaded before.
    ///
    /// # Errors
    /// If a normal and a tangent are not orthonormal.
    pub(crate) fn new(of: ShadedMesh) -> Result<Self, RenderError> {
        let frames = of.frames()?;
        let (view, light, seen, passes) = (None, None, None, VertexPasses::default());
        Ok(Self { of, frames, view, light, seen, radiance: Vec::new(), passes })
    }

    /// Whether the vertices are the shading of this mesh.
    pub(crate) fn is_of(&self, mesh: &ShadedMesh) -> bool {
        self.of.is_same(mesh)
    }

    /// Shades the vertices of an object, unless nothing changed.
    pub(crate) fn update(&mut self, object: &Object, shot: &Shot) {
        let view = self.of.view(object, shot);
        match view.change(self.view.as_ref()) {
            Change::Nothing => return,
            Change::View => {
                self.seen = None;
                let kept = self.light.get_or_insert_with(|| self.of.fixed_light(&self.frames, &view.light));
                self.radiance = kept.shade(&self.frames, &self.of.table, Viewer::At(view.viewer));
                self.passes.light_kept += 1;
            }
            Change::Light => {
                self.light = None;
                let kept = self.seen.get_or_insert_with(|| self.of.fixed_view(&self.frames, view.viewer));
                self.radiance = kept.shade(&view.light);
                self.passes.view_kept += 1;
            }
            Change::Both => {
                (self.light, self.seen) = (None, None);
                self.radiance = self.of.shade(&self.frames, &view);
                self.passes.both_new += 1;
            }
        }
        self.view = Some(view);
    }

    /// The radiance of each vertex toward the viewer, RGB; signed.
    pub(crate) fn radiance(&self) -> &[[f32; 3]] {
        &self.radiance
    }

    /// The number of times that the vertices were shaded.
    pub(crate) fn passes(&self) -> VertexPasses {
        self.passes
    }
}

impl std::ops::AddAssign for VertexPasses {
    fn add_assign(&mut self, other: Self) {
        self.both_new += other.both_new;
        self.light_kept += other.light_kept;
        self.view_kept += other.view_kept;
    }
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

/// The light with +Z and -Z exchanged: Y_lm(x, y, -z) = (-1)^(l + m) Y_lm. A material looks the same in a
/// mirror, so an object that is a mirror image needs no frames of its own.
fn upside_down(mut light: Expansion) -> Expansion {
    for l in 0..=light.degree().get() {
        for row in l * l..(l + 1) * (l + 1) {
            // row = l^2 + l + m, so that l + m has the parity of row - l^2.
            if (row - l * l) % 2 == 1 {
                light.coefficients_mut()[row] = light.coefficients()[row].map(|value| -value);
            }
        }
    }
    light
}
