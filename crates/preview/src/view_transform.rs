//! The matrices and rays of a shot for both renderers, computed in f64 and rounded once.

use glam::{DMat3, DVec3, Mat3, Mat4, Vec3};

use crate::{Object, Shot};

/// A shot as the shaders read it. Directions are in the light's frame: rotated by its inverse rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewTransform {
    /// The size of the picture in samples.
    pub size: [u32; 2],
    /// The number of samples along each side of a pixel, 1 to 4.
    pub samples: u32,
    /// The ray through the upper left corner of the picture.
    pub corner: Vec3,
    /// The step to the next sample on the right.
    pub across: Vec3,
    /// The step to the next sample below.
    pub down: Vec3,
    /// The direction toward the one distant viewer of [`crate::Mode::GlobalShrm`].
    pub view: Vec3,
    /// The factor 2^exposure.
    pub gain: f32,
    projection: glam::DMat4,
    back: DMat3,
}

/// An object as the shaders read it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// The matrix from the mesh's coordinates to clip coordinates.
    pub clip: Mat4,
    /// The matrix from the mesh's normals to the light's frame, of any length.
    pub normal: Mat3,
    /// The matrix from the mesh's tangents to the light's frame, of any length.
    pub tangent: Mat3,
    /// Whether the object is a mirror image, whose counter-clockwise triangles appear clockwise.
    pub mirrored: bool,
}

impl ViewTransform {
    /// The transform of a shot.
    pub fn new(shot: &Shot) -> Self {
        let samples = shot.samples.clamp(1, 4);
        let size = shot.size.map(|side| side.saturating_mul(samples));
        let [width, height] = shot.size.map(f64::from);
        let back = shot.turn.inverse().matrix();
        let ray = |at: [f64; 2]| back * shot.camera.ray(shot.size, at);
        let corner = ray([0.0, 0.0]);
        let step = |to: DVec3, count: u32| ((to - corner) / f64::from(count.max(1))).as_vec3();
        Self {
            size,
            samples,
            corner: corner.as_vec3(),
            across: step(ray([width, 0.0]), size[0]),
            down: step(ray([0.0, height]), size[1]),
            view: (back * shot.camera.view().vector()).as_vec3(),
            gain: math::exp2(shot.exposure) as f32,
            projection: shot.camera.projection(shot.size),
            back,
        }
    }

    /// The ray through the middle of a sample, from the eye, of any length.
    pub fn ray(&self, column: u32, row: u32) -> Vec3 {
        self.corner + self.across * (column as f32 + 0.5) + self.down * (row as f32 + 0.5)
    }

    /// The matrices of an object of the scene.
    ///
    /// Normals are transformed with the cofactors of the object's matrix: a singular one causes no NaN.
    pub fn place(&self, object: &Object) -> Placed {
        let linear = object.place.matrix3;
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
        let mirrored = linear.determinant() < 0.0;
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let outward = if mirrored { -cofactors } else { cofactors };
        // The lengths are free, but the squares of small ones would leave f32's range.
        let unit = |matrix: DMat3| {
            let largest =
                matrix.to_cols_array().into_iter().fold(0.0, |most: f64, value| most.max(value.abs()));
            if largest > 0.0 { matrix * largest.recip() } else { matrix }
        };
        Placed {
            clip: (self.projection * glam::DMat4::from(object.place)).as_mat4(),
            normal: (self.back * unit(outward)).as_mat3(),
            tangent: (self.back * unit(linear)).as_mat3(),
            mirrored,
        }
    }
}
