//! Suns: lights beside a sky's series, as lamps of parallel light.

use probes::{Lamp, LampKind};
use sh::Light;

/// The lamp whose light comes from the middle of a light's disk, with an irradiance of 1.
///
/// Its name has its direction, so that `light-probes` finds the column of a light, and of no other.
pub(crate) fn lamp(light: &Light) -> Lamp {
    let toward = light.direction.vector();
    Lamp {
        name: format!("sun toward [{}, {}, {}]", toward.x, toward.y, toward.z),
        kind: LampKind::Directional,
        position: [0.0; 3],
        direction: (-toward).to_array().map(|x| x as f32),
        color: [1.0; 3],
        intensity: 1.0,
        range: None,
    }
}
