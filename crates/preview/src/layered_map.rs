//! The map of a mode as shaders read it: cubes in the layers of a texture, six for each, and what a look-up
//! has to know of them.

use shrm::{Shrm, Terms, ViewSet};

#[cfg(feature = "gpu")]
use crate::Light;
use crate::shading::numbers::centre;
use crate::{Look, Mode, RenderError};

/// The properties of a part of a map: `MapPart` of map.wgsl.
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
    /// The first of its layers.
    pub(crate) first: u32,
    /// What its radiance is multiplied by.
    pub(crate) weight: f32,
}

/// A map whose radiance is a part of what is seen.
struct MapPart<'a> {
    properties: MapProperties,
    /// The number of cubes.
    count: usize,
    texel: Box<dyn Fn(usize, usize) -> [f32; 3] + Sync + 'a>,
}

impl<'a> MapPart<'a> {
    fn new(
        properties: MapProperties,
        count: usize,
        texel: impl Fn(usize, usize) -> [f32; 3] + Sync + 'a,
    ) -> Self {
        Self { properties, count, texel: Box::new(texel) }
    }

    /// A spherical harmonic reflection map on a cube: one cube for each row of coefficients.
    fn coefficients(map: &'a Shrm) -> Self {
        let properties = MapProperties {
            centre: centre(map.centre()),
            edge: map.grid().shape()[1] as u32,
            degree: map.p().get() as u32,
            zonal: map.terms() == Terms::Zonal,
            weight: 1.0,
            ..MapProperties::default()
        };
        Self::new(properties, map.rows(), |row, texel| map.texel(texel)[row])
    }
}

/// The texels of a map.
pub(crate) struct LayeredMap<'a> {
    /// Its name in errors.
    pub(crate) what: &'static str,
    parts: Vec<MapPart<'a>>,
}

impl<'a> LayeredMap<'a> {
    /// The most parts of a map.
    pub(crate) const MOST_PARTS: usize = 2;

    /// The parts, with their layers one after the other.
    fn new(what: &'static str, parts: impl IntoIterator<Item = MapPart<'a>>) -> Self {
        let mut parts: Vec<_> = parts.into_iter().collect();
        debug_assert!(parts.len() <= Self::MOST_PARTS);
        let mut first = 0;
        for part in &mut parts {
            part.properties.first = first;
            first += 6 * part.count as u32;
        }
        Self { what, parts }
    }

    /// The map of a mode; `None` of modes that read none, or make theirs for each view from another
    /// ([`LayeredMap::coefficients`]).
    ///
    /// # Errors
    /// If the look cannot make it, or it has no texels.
    pub(crate) fn of(look: &'a Look, mode: Mode) -> Result<Option<Self>, RenderError> {
        let edge = look.cube().edge as u32;
        let centres = look.centres().into_iter().map(centre);
        let on_cube =
            centres.map(|centre| MapProperties { centre, edge, weight: 1.0, ..MapProperties::default() });
        let map = match mode {
            Mode::LocalShrm => Self::coefficients(look.local()?),
            Mode::Cabral => {
                let part = |(maps, properties): (&'a ViewSet, _)| {
                    MapPart::new(properties, 12, |vertex, texel| maps.map(vertex)[texel])
                };
                Self::new("Cabral's maps", look.cabral()?.iter().zip(on_cube).map(part))
            }
            Mode::KautzMcCool => {
                let part = |(texture, properties): (&'a ViewSet, MapProperties)| {
                    let count = texture.views().count();
                    let properties = MapProperties { slices: count as u32, ..properties };
                    MapPart::new(properties, count, |k, texel| texture.map(k)[texel])
                };
                let parts = look.kautz_mccool()?.iter().zip(on_cube).map(part);
                Self::new("Kautz and McCool's texture", parts)
            }
            Mode::Prefiltered => {
                let parts = look.plain_parts()?.into_iter().map(|part| {
                    let (centre, weight) = (centre(part.centre), part.weight);
                    let properties =
                        MapProperties { centre, edge: part.edge, weight, ..MapProperties::default() };
                    MapPart::new(properties, 1, move |_, texel| part.texels[texel])
                });
                Self::new("the reflection map", parts)
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
        if self.parts.iter().any(|part| part.properties.edge == 0 || part.count == 0) {
            return Err(RenderError::maps(format!("{} has no texels", self.what)));
        }
        Ok(self)
    }

    /// Spherical harmonic reflection maps on cubes, whose sum is seen.
    pub(crate) fn coefficients(maps: &'a [Shrm]) -> Self {
        Self::new("the SHRM", maps.iter().map(MapPart::coefficients))
    }

    /// The light as its coefficients describe it, [`Light::reconstruction`].
    #[cfg(feature = "gpu")]
    pub(crate) fn reconstruction(light: &'a Light) -> Self {
        let (cube, texels) = light.reconstruction();
        let properties = MapProperties { edge: cube.edge as u32, ..MapProperties::default() };
        Self::new("the background", [MapPart::new(properties, 1, |_, texel| texels[texel])])
    }

    /// The properties of its parts, whose radiance is added.
    pub(crate) fn parts(&self) -> impl Iterator<Item = MapProperties> {
        self.parts.iter().map(|part| part.properties)
    }

    /// The texels along the edge of a layer: those of the largest face.
    pub(crate) fn edge(&self) -> usize {
        self.parts().map(|part| part.edge as usize).max().unwrap_or(0)
    }

    /// The highest degree P.
    #[cfg(feature = "gpu")]
    pub(crate) fn degree(&self) -> usize {
        self.parts().map(|part| part.degree as usize).max().unwrap_or(0)
    }

    /// The number of cubes.
    pub(crate) fn count(&self) -> usize {
        self.parts.iter().map(|part| part.count).sum()
    }

    /// The texels of each cube, in the order of `sphere::Cube`, on faces of [`LayeredMap::edge`].
    pub(crate) fn cubes<'b>(&'b self) -> impl Iterator<Item = impl Iterator<Item = [f32; 3]> + 'b> + 'b {
        let whole = self.edge();
        let of_part = |part: &'b MapPart<'a>| (0..part.count).map(move |number| (part, number));
        self.parts.iter().flat_map(of_part).map(move |(part, number)| {
            let edge = part.properties.edge as usize;
            (0..6 * whole * whole).map(move |texel| {
                let (face, row, column) = (texel / (whole * whole), texel / whole % whole, texel % whole);
                let is_inside = row < edge && column < edge;
                if is_inside { (part.texel)(number, (face * edge + row) * edge + column) } else { [0.0; 3] }
            })
        })
    }
}
