//! A material under a light, and the maps that renderers shade it with.

use std::sync::{Arc, OnceLock};

use brdf::{Centre, Material};
use shrm::{Cabral, KautzMcCool, MapGrid, Plain, Reflection, Shrm, View};
use sphere::Cube;

use crate::{Light, RenderError};

/// How large the maps are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapSizes {
    /// Texels along the edge of a cube's face, of every map.
    pub edge: usize,
    /// Slices of Kautz and McCool's texture.
    pub slices: usize,
}

impl Default for MapSizes {
    /// Faces of 64 texels and 16 slices, as the exports have them.
    fn default() -> Self {
        Self { edge: 64, slices: 16 }
    }
}

/// Where a look's maps come from.
#[derive(Clone, Debug)]
enum Field {
    Reflection(Reflection),
    Map(Shrm),
}

/// A material under a light. Each map is made when it is first wanted, and kept.
#[derive(Debug)]
pub struct Look {
    light: Arc<Light>,
    field: Field,
    material: Option<Material>,
    sizes: MapSizes,
    local: OnceLock<Result<Shrm, RenderError>>,
    global: OnceLock<Result<Shrm, RenderError>>,
    cabral: OnceLock<Result<Cabral, RenderError>>,
    kautz_mccool: OnceLock<Result<KautzMcCool, RenderError>>,
    prefiltered: OnceLock<Result<Vec<[f32; 3]>, RenderError>>,
}

impl Look {
    /// The look of a reflection, which holds the light's coefficients times the material's. Brute force needs the
    /// material itself.
    pub fn new(
        light: Arc<Light>,
        reflection: Reflection,
        material: Option<Material>,
        sizes: MapSizes,
    ) -> Self {
        Self::of(light, Field::Reflection(reflection), material, sizes)
    }

    /// The look of a spherical harmonic reflection map that exists already; a lat-long map is resampled to a cube.
    pub fn from_map(light: Arc<Light>, map: Shrm, material: Option<Material>, sizes: MapSizes) -> Self {
        Self::of(light, Field::Map(map), material, sizes)
    }

    fn of(light: Arc<Light>, field: Field, material: Option<Material>, sizes: MapSizes) -> Self {
        Self {
            light,
            field,
            material,
            sizes,
            local: OnceLock::new(),
            global: OnceLock::new(),
            cabral: OnceLock::new(),
            kautz_mccool: OnceLock::new(),
            prefiltered: OnceLock::new(),
        }
    }

    /// The light.
    pub fn light(&self) -> &Arc<Light> {
        &self.light
    }

    /// The material, where it is known.
    pub fn material(&self) -> Option<&Material> {
        self.material.as_ref()
    }

    /// The reflection, where the look was made of one.
    pub fn reflection(&self) -> Option<&Reflection> {
        match &self.field {
            Field::Reflection(reflection) => Some(reflection),
            Field::Map(_) => None,
        }
    }

    /// The direction that the maps are about: reflection vector, normal or tangent.
    pub fn centre(&self) -> Centre {
        match &self.field {
            Field::Reflection(reflection) => reflection.brdf().centre(),
            Field::Map(map) => map.centre(),
        }
    }

    /// The cube that all maps lie on.
    pub fn cube(&self) -> Cube {
        Cube { edge: self.sizes.edge }
    }

    /// How large the maps are.
    pub fn sizes(&self) -> MapSizes {
        self.sizes
    }

    /// The local SHRM on [`Look::cube`].
    ///
    /// # Errors
    /// Where the map would be too large.
    pub fn local(&self) -> Result<&Shrm, RenderError> {
        self.local.get_or_init(|| self.map(View::Local)).as_ref().map_err(Clone::clone)
    }

    /// The global SHRM on [`Look::cube`].
    ///
    /// # Errors
    /// As [`Look::local`].
    pub fn global(&self) -> Result<&Shrm, RenderError> {
        let made = self.global.get_or_init(|| match &self.field {
            Field::Reflection(_) => Ok(self.local()?.to_global()),
            Field::Map(_) => self.map(View::Global),
        });
        made.as_ref().map_err(Clone::clone)
    }

    /// Cabral's twelve maps.
    ///
    /// # Errors
    /// As [`Look::local`].
    pub fn cabral(&self) -> Result<&Cabral, RenderError> {
        let made = self.cabral.get_or_init(|| Ok(Cabral::from_shrm(self.local()?)));
        made.as_ref().map_err(Clone::clone)
    }

    /// Kautz and McCool's texture.
    ///
    /// # Errors
    /// As [`Look::local`], and where there are fewer than two slices.
    pub fn kautz_mccool(&self) -> Result<&KautzMcCool, RenderError> {
        let made = self.kautz_mccool.get_or_init(|| {
            let angles = KautzMcCool::even_angles(self.sizes.slices);
            let texture = KautzMcCool::from_shrm(self.local()?, angles);
            texture.ok_or_else(|| RenderError::maps(format!("{} slices are no texture", self.sizes.slices)))
        });
        made.as_ref().map_err(Clone::clone)
    }

    /// The plain reflection map, the mean over all views as `export-reflection-map` makes it; texels as
    /// [`sphere::Cube`] counts them.
    ///
    /// # Errors
    /// As [`Look::local`].
    pub fn prefiltered(&self) -> Result<&[[f32; 3]], RenderError> {
        let made = self.prefiltered.get_or_init(|| match &self.field {
            Field::Reflection(reflection) => {
                let field = reflection.plain(Plain::Mean);
                sh::synthesise_cube(&field, self.cube()).map_err(|error| RenderError::maps(error.to_string()))
            }
            // The mean over all views is the term p = 0, in either frame.
            Field::Map(_) => {
                let (map, y_00) = (self.local()?, (0.25 / std::f32::consts::PI).sqrt());
                Ok((0..map.grid().len()).map(|texel| map.texel(texel)[0].map(|value| value * y_00)).collect())
            }
        });
        made.as_ref().map(Vec::as_slice).map_err(Clone::clone)
    }

    fn map(&self, view: View) -> Result<Shrm, RenderError> {
        let grid = MapGrid::Cube(self.cube());
        match &self.field {
            Field::Reflection(reflection) => {
                reflection.synthesise(grid, view).map_err(|error| RenderError::maps(error.to_string()))
            }
            Field::Map(map) => Ok(map.resampled(grid, view)),
        }
    }
}
