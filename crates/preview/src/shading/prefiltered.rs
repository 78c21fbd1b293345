//! One reflection map: a look-up in the central direction, the same for every view. It may lie between two
//! levels of detail, which are blended.

use brdf::Centre;
use glam::Vec3;

use super::cube;
use super::surface::Surface;
use crate::{Look, RenderError};

/// The reflection map of a look.
#[derive(Clone, Copy, Debug)]
pub struct PrefilteredMap<'a> {
    /// The cube, and the next level of detail: edges and texels in the order of `sphere::Cube`. Without
    /// levels both are the same.
    pub levels: [(u32, &'a [[f32; 3]]); 2],
    /// The share of the second.
    pub share: f32,
}

impl<'a> PrefilteredMap<'a> {
    /// The map of a look: the levels of its prefiltered cube, or else the mean of its reflection over all
    /// views.
    ///
    /// # Errors
    /// The errors of [`Look::prefiltered`].
    pub fn of(look: &'a Look) -> Result<Self, RenderError> {
        if let Some((cube, level)) = look.prefiltered_cube() {
            let (levels, share) = cube.around(level);
            let levels = levels.map(|level| (level.cube().edge as u32, level.pixels()));
            return Ok(Self { levels, share });
        }
        Ok(Self { levels: [(look.cube().edge as u32, look.prefiltered()?); 2], share: 0.0 })
    }
}

/// The radiance toward the viewer.
pub fn prefiltered(map: &PrefilteredMap<'_>, centre: Centre, surface: &Surface) -> Vec3 {
    let central = surface.central(centre);
    let [fine, coarse] = map.levels;
    let of_fine = cube::sample(fine.0, fine.1, central);
    if map.share == 0.0 {
        return of_fine;
    }
    of_fine + (cube::sample(coarse.0, coarse.1, central) - of_fine) * map.share
}
