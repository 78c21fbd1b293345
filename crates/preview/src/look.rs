//! Looks: a material under a light, and the maps that renderers shade it with.

mod maps;

use std::sync::{Arc, OnceLock};

use brdf::{BaseColorTexture, BrdfTable, Centre, Material, Standard, StandardParameters};
use sh::{Degree, Expansion, Light as Sun};
use shrm::{Lamps, Reflection, Shrm, ViewSet};
use sphere::Cube;
use transfer::LightField;

use crate::shading::base_color::BaseColorMap;
use crate::{CompactMap, Light, LightAtPlaces, PrefilteredCube, RenderError};

/// The sizes of the maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapSizes {
    /// The texels along the edge of a cube's face, in every map.
    pub edge: usize,
    /// The number of slices of Kautz and McCool's texture.
    pub slices: usize,
}

impl Default for MapSizes {
    /// Faces of 64 texels and 16 slices, the defaults of the exports.
    fn default() -> Self {
        Self { edge: 64, slices: 16 }
    }
}

/// A map that is made when it is first needed.
type Made<T> = OnceLock<Result<T, RenderError>>;

/// A plain reflection map, with texels in the order of [`sphere::Cube`].
pub type PlainMap = Vec<[f32; 3]>;

/// A plain map whose radiance, times a weight, is a part of what is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlainPart<'a> {
    /// The texels along the edge of a face.
    pub(crate) edge: u32,
    /// The texels, in the order of [`sphere::Cube`].
    pub(crate) texels: &'a [[f32; 3]],
    /// The direction of a look-up.
    pub(crate) centre: Centre,
    /// What its radiance is multiplied by.
    pub(crate) weight: f32,
}

/// The source of a look's maps.
#[derive(Clone, Debug)]
enum Field {
    Reflection(Reflection),
    Map(Shrm),
}

/// A material under a light. Each map is computed when it is first needed.
///
/// The maps are optional: before anything is made that they come from, a look has only a light and a material
/// ([`Look::without_maps`]).
#[derive(Debug)]
pub struct Look {
    light: Arc<Light>,
    field: Option<Field>,
    material: Option<Material>,
    table: Option<Arc<BrdfTable>>,
    compact_map: Option<Arc<CompactMap>>,
    base_color: Option<Arc<BaseColorTexture>>,
    /// The cube that an engine lights the surface with, and the level that it reads.
    prefiltered_cube: Option<(Arc<PrefilteredCube>, f64)>,
    /// The lights that an engine lights the surface with beside the cube.
    suns: Vec<Sun>,
    /// The light at points around the mesh, in place of the distant light, for BRDF tables.
    light_field: Option<Arc<LightField>>,
    /// The light at places with normals, in place of both.
    light_at_places: Option<Arc<dyn LightAtPlaces>>,
    /// Whether the look shows a light, and no material of anybody's.
    shows_light: bool,
    sizes: MapSizes,
    /// Whether the SHRMs hold the lamps.
    holds_lamps: bool,
    /// Whether one map holds both parts of a material that has two.
    joins_parts: bool,
    /// The degrees in the view that the SHRMs have, and those of the fields that lamps are fitted with, if
    /// they are not those of the reflections.
    degrees_in_view: Option<Vec<[Degree; 2]>>,
    soft: Made<Vec<Shrm>>,
    local: Made<Vec<Shrm>>,
    global: Made<Vec<Shrm>>,
    cabral: Made<Vec<ViewSet>>,
    kautz_mccool: Made<Vec<ViewSet>>,
    prefiltered: Made<Vec<PlainMap>>,
    base_color_map: OnceLock<Option<BaseColorMap>>,
    table_light: OnceLock<Expansion>,
}

impl Look {
    /// The look of a reflection, the light's coefficients times the material's. Brute force needs `material`.
    pub fn new(
        light: Arc<Light>,
        reflection: Reflection,
        material: Option<Material>,
        sizes: MapSizes,
    ) -> Self {
        Self::of(light, Some(Field::Reflection(reflection)), material, sizes)
    }

    /// The look of an existing spherical harmonic reflection map; a lat-long map is resampled to a cube.
    pub fn from_map(light: Arc<Light>, map: Shrm, material: Option<Material>, sizes: MapSizes) -> Self {
        Self::of(light, Some(Field::Map(map)), material, sizes)
    }

    /// The look of a material without maps. [`crate::Scene::available`] replaces the modes that need one by
    /// brute force.
    pub fn without_maps(light: Arc<Light>, material: Material, sizes: MapSizes) -> Self {
        Self::of(light, None, Some(material), sizes)
    }

    /// The look of a material without maps, which may be unknown: then there are only the modes that need
    /// none.
    pub fn of_light(light: Arc<Light>, material: Option<Material>, sizes: MapSizes) -> Self {
        Self::of(light, None, material, sizes)
    }

    /// The look of a light alone: a white metal of some roughness, which loses no light, shows it. With a
    /// cube of an engine and the level that it reads for that roughness, [`crate::Mode::Prefiltered`] shows
    /// that, and the lights that the engine has beside the cube ([`Look::with_suns`]).
    ///
    /// # Errors
    /// If the roughness is above 1 or not a number.
    pub fn of_white_metal(
        light: Arc<Light>,
        roughness: f64,
        cube: Option<(Arc<PrefilteredCube>, f64)>,
    ) -> Result<Self, RenderError> {
        // A mirror is the sharpest that the model has.
        let roughness = roughness.max(0.01);
        let parameters = StandardParameters { metallic: 1.0, roughness, ..StandardParameters::default() };
        let metal = Standard::new(parameters).map_err(|error| RenderError::maps(error.to_string()))?;
        let look = Self::of(light, None, Some(Material::Standard(metal)), MapSizes::default());
        Ok(Self { prefiltered_cube: cube, shows_light: true, ..look })
    }

    fn of(light: Arc<Light>, field: Option<Field>, material: Option<Material>, sizes: MapSizes) -> Self {
        Self {
            light,
            field,
            material,
            table: None,
            compact_map: None,
            base_color: None,
            prefiltered_cube: None,
            suns: Vec::new(),
            light_field: None,
            light_at_places: None,
            shows_light: false,
            sizes,
            holds_lamps: false,
            joins_parts: false,
            degrees_in_view: None,
            soft: OnceLock::new(),
            local: OnceLock::new(),
            global: OnceLock::new(),
            cabral: OnceLock::new(),
            kautz_mccool: OnceLock::new(),
            prefiltered: OnceLock::new(),
            base_color_map: OnceLock::new(),
            table_light: OnceLock::new(),
        }
    }

    /// Returns the same look with the BRDF table of its material, which the modes `table` and `transfer` look
    /// up.
    #[must_use]
    pub fn with_table(self, table: Option<Arc<BrdfTable>>) -> Self {
        Self { table, ..self }
    }

    /// Returns the same look with the lights that stand beside the cube of an engine.
    #[must_use]
    pub fn with_suns(self, suns: Vec<Sun>) -> Self {
        Self { suns, ..self }
    }

    /// Returns the same look with BRDF tables under light at places with normals, in place of a light field.
    #[must_use]
    pub fn with_light_at_places(self, light_at_places: Option<Arc<dyn LightAtPlaces>>) -> Self {
        Self { light_at_places, ..self }
    }

    /// Returns the same look under a light field, in the coordinates of the scene, in the modes `table` and
    /// `transfer`: it takes the place of all distant light there. Other modes and the background do not show
    /// it.
    #[must_use]
    pub fn with_light_field(self, light_field: Option<Arc<LightField>>) -> Self {
        Self { light_field, ..self }
    }

    /// Returns the same look with the compact map of its light and its material, which [`crate::Mode::Taps`]
    /// needs.
    #[must_use]
    pub fn with_compact_map(self, compact_map: Option<Arc<CompactMap>>) -> Self {
        Self { compact_map, ..self }
    }

    /// Returns the same look with the picture of its material's base colour, which meshes with coordinates
    /// show. Its maps stay those of the material.
    #[must_use]
    pub fn with_base_color(self, base_color: Option<Arc<BaseColorTexture>>) -> Self {
        Self { base_color, ..self }
    }

    /// Returns the same look with the lamps of its reflection in the SHRMs, as `export-shrm` bakes them, or
    /// beside them.
    #[must_use]
    pub fn with_lamps_in_maps(self, holds_lamps: bool) -> Self {
        Self { holds_lamps, ..self }
    }

    /// Returns the same look with one map of a material that has two parts, about the reflection vector, or
    /// with a map of each part.
    #[must_use]
    pub fn with_parts_in_one_map(self, joins_parts: bool) -> Self {
        Self { joins_parts, ..self }
    }

    /// Returns the same look with SHRMs of the first degree of each pair in the view, as an export has them,
    /// fitted to the field up to the second if the lamps are in them: a pair for each map. Maps of other
    /// forms are made from the whole reflection.
    #[must_use]
    pub fn with_degrees_in_view(self, degrees_in_view: Option<Vec<[Degree; 2]>>) -> Self {
        Self { degrees_in_view, ..self }
    }

    /// The light.
    pub fn light(&self) -> &Arc<Light> {
        &self.light
    }

    /// Whether the look has maps, or what they are computed from.
    pub fn has_maps(&self) -> bool {
        self.field.is_some()
    }

    /// The BRDF table of the look's material, if there is one.
    pub fn table(&self) -> Option<&Arc<BrdfTable>> {
        self.table.as_ref()
    }

    /// The light at places with normals that BRDF tables are under, if there is one.
    pub fn light_at_places(&self) -> Option<&Arc<dyn LightAtPlaces>> {
        self.light_at_places.as_ref()
    }

    /// The light field that BRDF tables are under, if there is one.
    pub fn light_field(&self) -> Option<&Arc<LightField>> {
        self.light_field.as_ref()
    }

    /// Whether BRDF tables are under other light at each place, and not under distant light.
    pub fn has_near_light(&self) -> bool {
        self.light_field.is_some() || self.light_at_places.is_some()
    }

    /// The compact map of the look's light and material.
    ///
    /// # Errors
    /// [`RenderError::Missing`] if there is none.
    pub fn compact_map(&self) -> Result<&Arc<CompactMap>, RenderError> {
        let missing = RenderError::Missing { what: "this mode", missing: "a scale space and taps" };
        self.compact_map.as_ref().ok_or(missing)
    }

    /// The picture of the material's base colour, if there is one.
    pub fn base_color(&self) -> Option<&Arc<BaseColorTexture>> {
        self.base_color.as_ref()
    }

    /// The picture of the base colour as shaders read it, and the response of the material to it; `None`
    /// without a picture, and of a material that is not of the model `standard`, or a part of one.
    pub(crate) fn base_color_map(&self) -> Option<&BaseColorMap> {
        let make = || match (&self.base_color, &self.material) {
            (Some(texture), Some(Material::Standard(standard))) if standard.part().is_none() => {
                Some(BaseColorMap::new(texture, standard, self.light.lighting()))
            }
            _ => None,
        };
        self.base_color_map.get_or_init(make).as_ref()
    }

    /// The cube that an engine lights the surface with, and the level that it reads.
    pub fn prefiltered_cube(&self) -> Option<(&Arc<PrefilteredCube>, f64)> {
        self.prefiltered_cube.as_ref().map(|(cube, level)| (cube, *level))
    }

    /// Whether the look shows a light by a white metal, and no material of anybody's.
    pub fn shows_light(&self) -> bool {
        self.shows_light
    }

    /// The material, if it is known.
    pub fn material(&self) -> Option<&Material> {
        self.material.as_ref()
    }

    /// The reflection, if the look was made from one.
    pub fn reflection(&self) -> Option<&Reflection> {
        match &self.field {
            Some(Field::Reflection(reflection)) => Some(reflection),
            Some(Field::Map(_)) | None => None,
        }
    }

    /// The reflection whose lamps modes that look up an SHRM add to it; `None` if the map holds them, or the
    /// look was made from a map.
    pub fn beside(&self) -> Option<&Reflection> {
        self.reflection().filter(|_| !self.bakes())
    }

    /// The lights beside the cube of an engine, and the white metal that reflects them; `None` if there are
    /// none.
    pub fn beside_cube(&self) -> Option<Lamps> {
        let material = self.prefiltered_cube.as_ref().and(self.material.clone())?;
        (!self.suns.is_empty()).then(|| Lamps { lights: self.suns.clone(), material })
    }

    /// The suns and lamps that the modes `table` and `transfer` take out of the light's coefficients, and the
    /// material that reflects them by itself [KSS02, sec. 7]; `None` if there are none, under near
    /// light, and if the table is not that of one known material.
    pub fn beside_table(&self) -> Option<Lamps> {
        if self.has_near_light() {
            return None;
        }
        self.table().filter(|table| table.count() == 1)?;
        let lights = self.lamps().map_or(self.light.lamps(), |lamps| &lamps.lights);
        let material = self.material.as_ref().or(self.lamps().map(|lamps| &lamps.material))?;
        (!lights.is_empty()).then(|| Lamps { lights: lights.to_vec(), material: material.clone() })
    }

    /// The light's coefficients without [`Look::beside_table`].
    pub(crate) fn table_light(&self) -> &Expansion {
        let Some(Lamps { lights, .. }) = self.beside_table() else { return self.light.lighting() };
        self.table_light.get_or_init(|| {
            let mut soft = self.light.lighting().clone();
            for light in lights {
                let series = light.series(soft.degree());
                for (row, of_light) in soft.coefficients_mut().iter_mut().zip(series.coefficients()) {
                    (0..3).for_each(|channel| row[channel] -= of_light[channel]);
                }
            }
            soft
        })
    }

    /// Whether the SHRMs have lamps baked into them.
    fn bakes(&self) -> bool {
        self.holds_lamps && self.lamps().is_some()
    }

    /// The lamps that the reflection has beside it.
    fn lamps(&self) -> Option<&Lamps> {
        self.reflection().and_then(Reflection::lamps)
    }

    fn field(&self) -> Result<&Field, RenderError> {
        self.field
            .as_ref()
            .ok_or(RenderError::Missing { what: "this mode", missing: "the maps of the material" })
    }

    /// The central direction of one map of the whole material: reflection vector, normal or tangent. Without
    /// maps it is that of the material.
    pub fn centre(&self) -> Centre {
        match &self.field {
            Some(Field::Reflection(reflection)) => reflection.brdf().centre(),
            Some(Field::Map(map)) => map.centre(),
            None => self.material.as_ref().map_or(Centre::Reflection, Material::centre),
        }
    }

    /// The cube that all maps lie on.
    pub fn cube(&self) -> Cube {
        Cube { edge: self.sizes.edge }
    }

    /// The sizes of the maps.
    pub fn sizes(&self) -> MapSizes {
        self.sizes
    }
}
