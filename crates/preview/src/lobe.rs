//! The lobe that the samples of a view follow: rho_hat of the shown material over all incident directions,
//! toward the camera.
//!
//! The surface leans back from the camera by [`LEAN`]: its normal is between the view and the camera's up. A
//! mirror ball has this normal at half of its radius above the middle, where a perfect mirror's lobe would
//! be. The surface moves with the camera, so that the lobe's coefficients in the frame of the surface depend
//! on the material alone, and a turn only rotates them.

use std::f64::consts::FRAC_PI_6;

use brdf::Views;
use glam::{DMat3, DQuat, DVec3, Mat3, Vec3};
use sh::{Degree, Expansion, rotate, synthesise_cube};
use sphere::{Cube, Direction, Rotation};

use crate::mirror_ball::camera_axes;
use crate::shading::cube;
use crate::{Look, Shot};

/// The angle between the normal and the view: 30 degrees.
const LEAN: f64 = FRAC_PI_6;

/// The highest degree of a lobe. More would cost more than a frame has time for.
const MAX_DEGREE: usize = 19;

/// A lobe in the frame of its surface: x is the camera's right, z the normal.
#[derive(Debug)]
pub(crate) struct Lobe {
    coefficients: Expansion,
    /// The positive part of the lobe, divided by the largest value of all channels.
    texels: Vec<[f32; 3]>,
    cube: Cube,
    largest: f32,
}

/// The frame of the surface that a shot sees, in the light's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceFrame {
    axes: DMat3,
    back: Mat3,
}

impl Lobe {
    /// The lobe of a look's material: from the coefficients of its reflection, as they are, or from the
    /// material itself.
    ///
    /// # Errors
    /// Why there is none, as a caption.
    pub(crate) fn of(look: &Look) -> Result<Self, &'static str> {
        let most = Degree::new(MAX_DEGREE).unwrap_or(Degree::ZERO);
        let view = Direction::normalised(DVec3::new(0.0, -math::sin(LEAN), math::cos(LEAN)));
        let coefficients = match (look.reflection(), look.material()) {
            (Some(reflection), _) => {
                let lobe = reflection.brdf().at_view(Direction::Z, Direction::X, view);
                lobe.to_degree(lobe.degree().min(most))
            }
            (None, Some(material)) => {
                let seen = Views::new(material, most).coefficients(view);
                let seen = seen.map_err(|_| "the material is not finite")?;
                Expansion::from_coefficients(most, seen.c).ok_or("the material is not finite")?
            }
            (None, None) => return Err(NO_MATERIAL),
        };
        let edge = (4 * (coefficients.degree().get() + 1)).next_power_of_two().max(16);
        let cube = Cube { edge };
        let mut texels: Vec<[f32; 3]> =
            synthesise_cube(&coefficients, cube).map_err(|_| "the lobe has no size")?;
        let largest = texels.iter().flatten().fold(0.0, |largest: f32, value| largest.max(*value));
        if !largest.is_finite() || largest <= 0.0 {
            return Err(NO_LOBE);
        }
        texels.iter_mut().flatten().for_each(|value| *value = value.max(0.0) / largest);
        Ok(Self { coefficients, texels, cube, largest })
    }

    /// The highest degree of the lobe's coefficients.
    pub(crate) fn degree(&self) -> Degree {
        self.coefficients.degree()
    }

    /// The largest value of all channels, in 1/sr: the unit of [`Lobe::value`].
    pub(crate) fn largest(&self) -> f64 {
        f64::from(self.largest)
    }

    /// The lobe's coefficients in the light's frame.
    pub(crate) fn turned(&self, frame: SurfaceFrame) -> Expansion {
        rotate(&self.coefficients, frame.rotation())
    }

    /// The positive part of the lobe toward a direction in the light's frame, of any length; 1 is the lobe's
    /// largest value.
    pub(crate) fn value(&self, frame: SurfaceFrame, direction: Vec3) -> Vec3 {
        cube::sample(self.cube.edge as u32, &self.texels, frame.back * direction)
    }
}

/// The caption of a lobe of a map that was read back without its material.
pub(crate) const NO_MATERIAL: &str = "the material is not known";

/// The caption of a lobe without a positive value.
pub(crate) const NO_LOBE: &str = "the lobe is nowhere positive";

impl SurfaceFrame {
    /// The frame of the surface in a shot.
    pub(crate) fn new(shot: &Shot) -> Self {
        let axes = camera_axes(shot);
        let [right, up, toward] = [axes.x_axis, axes.y_axis, axes.z_axis];
        let (sine, cosine) = math::sin_cos(LEAN);
        let axes = DMat3::from_cols(right, up * cosine - toward * sine, toward * cosine + up * sine);
        Self { axes, back: axes.transpose().as_mat3() }
    }

    fn rotation(self) -> Rotation {
        let DQuat { x, y, z, w } = DQuat::from_mat3(&self.axes);
        Rotation::from_quaternion(x, y, z, w).unwrap_or(Rotation::IDENTITY)
    }
}
