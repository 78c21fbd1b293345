//! What is seen: meshes, each with its look, before one environment.

use std::sync::Arc;

use glam::DAffine3;
use transfer::Mesh;

use crate::{Light, Look};

/// A mesh somewhere, with its look.
#[derive(Clone, Debug)]
pub struct Object {
    /// Its shape, in its own coordinates.
    pub mesh: Arc<Mesh>,
    /// Where it is: rotation, uniform scale and translation into the world.
    pub place: DAffine3,
    /// The light that it reflects.
    pub look: Arc<Look>,
}

/// Meshes before an environment.
///
/// Light is distant: each object reflects the light of its own look, none shades another.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The light that is seen behind them.
    pub light: Arc<Light>,
    /// The meshes.
    pub objects: Vec<Object>,
}

impl Scene {
    /// One mesh with one look, where it is.
    pub fn of(mesh: Arc<Mesh>, look: Arc<Look>) -> Self {
        let object = Object { mesh, place: DAffine3::IDENTITY, look };
        Self { light: Arc::clone(object.look.light()), objects: vec![object] }
    }
}
