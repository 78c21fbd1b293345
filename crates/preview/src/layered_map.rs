//! The map of a mode as shaders read it: cubes in the layers of a texture, six for each, and what a look-up
//! has to know of them.

use shrm::{Shrm, Terms};

#[cfg(feature = "gpu")]
use crate::Light;
use crate::shading::numbers::centre;
use crate::shading::prefiltered::PrefilteredMap;
use crate::{Look, Mode, RenderError};

/// The properties of a map: `MapUniforms` of map.wgsl.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct MapProperties {
    /// The central direction of the texels.
    pub(crate) centre: u32,
    /// The texels along the edge of a face.
    pub(crate) edge: u32,
    /// P.
    pub(crate) degree: u32,
    /// Whether there are only coefficients of q = 0.
    pub(crate) zonal: bool,
    /// The slices of Kautz and McCool's texture.
    pub(crate) slices: u32,
    /// The texels along the edge of a face of the next level of detail.
    pub(crate) coarse_edge: u32,
    /// The share of that level.
    pub(crate) share: f32,
}

/// The texels of a map.
pub(crate) struct LayeredMap<'a> {
    /// Its name in errors.
    pub(crate) what: &'static str,
    pub(crate) properties: MapProperties,
    /// The number of cubes.
    pub(crate) count: usize,
    texel: Box<dyn Fn(usize, usize) -> [f32; 3] + Sync + 'a>,
}

impl<'a> LayeredMap<'a> {
    fn new(
        what: &'static str,
        properties: MapProperties,
        count: usize,
        texel: impl Fn(usize, usize) -> [f32; 3] + Sync + 'a,
    ) -> Self {
        Self { what, properties, count, texel: Box::new(texel) }
    }

    /// The map of a mode; `None` of modes that read none, or make theirs for each view from another
    /// ([`LayeredMap::coefficients`]).
    ///
    /// # Errors
    /// If the look cannot make it, or it has no texels.
    pub(crate) fn of(look: &'a Look, mode: Mode) -> Result<Option<Self>, RenderError> {
        let properties = MapProperties {
            centre: centre(look.centre()),
            edge: look.cube().edge as u32,
            ..MapProperties::default()
        };
        let map = match mode {
            Mode::LocalShrm => Self::coefficients(look.local()?),
            Mode::Cabral => {
                let maps = look.cabral()?;
                Self::new("Cabral's maps", properties, 12, |vertex, texel| maps.map(vertex)[texel])
            }
            Mode::KautzMcCool => {
                let texture = look.kautz_mccool()?;
                let count = texture.views().count();
                let properties = MapProperties { slices: count as u32, ..properties };
                Self::new("Kautz and McCool's texture", properties, count, |k, texel| texture.map(k)[texel])
            }
            Mode::Prefiltered => {
                let PrefilteredMap { levels: [(edge, fine), (coarse_edge, coarse)], share } =
                    PrefilteredMap::of(look)?;
                let properties = MapProperties { edge, coarse_edge, share, ..properties };
                let count = if share == 0.0 { 1 } else { 2 };
                let [edge, coarse_edge] = [edge, coarse_edge].map(|edge| edge as usize);
                Self::new("the reflection map", properties, count, move |level, texel| {
                    let (row, column) = (texel / edge % edge, texel % edge);
                    match level {
                        0 => fine[texel],
                        _ if row >= coarse_edge || column >= coarse_edge => [0.0; 3],
                        _ => coarse[(texel / (edge * edge) * coarse_edge + row) * coarse_edge + column],
                    }
                })
            }
            Mode::GlobalShrm | Mode::Irradiance | Mode::Mirror | Mode::BruteForce => return Ok(None),
            Mode::ShadowedBruteForce | Mode::Table | Mode::Transfer | Mode::Samples => return Ok(None),
            Mode::Taps => return Ok(None),
        };
        map.checked().map(Some)
    }

    /// Returns the map unchanged if it has texels.
    ///
    /// # Errors
    /// If it has none: a texture of no size cannot be made.
    pub(crate) fn checked(self) -> Result<Self, RenderError> {
        if self.properties.edge == 0 || self.count == 0 {
            return Err(RenderError::maps(format!("{} has no texels", self.what)));
        }
        Ok(self)
    }

    /// A spherical harmonic reflection map on a cube: one cube for each row of coefficients.
    pub(crate) fn coefficients(map: &'a Shrm) -> Self {
        let properties = MapProperties {
            centre: centre(map.centre()),
            edge: map.grid().shape()[1] as u32,
            degree: map.p().get() as u32,
            zonal: map.terms() == Terms::Zonal,
            ..MapProperties::default()
        };
        Self::new("the SHRM", properties, map.rows(), |row, texel| map.texel(texel)[row])
    }

    /// The light as its coefficients describe it, [`Light::reconstruction`].
    #[cfg(feature = "gpu")]
    pub(crate) fn reconstruction(light: &'a Light) -> Self {
        let (cube, texels) = light.reconstruction();
        let properties = MapProperties { edge: cube.edge as u32, ..MapProperties::default() };
        Self::new("the background", properties, 1, |_, texel| texels[texel])
    }

    /// The texels of a cube, in the order of `sphere::Cube`.
    pub(crate) fn cube(&self, number: usize) -> impl Iterator<Item = [f32; 3]> {
        let edge = self.properties.edge as usize;
        (0..6 * edge * edge).map(move |texel| (self.texel)(number, texel))
    }
}
