//! Looks: a material under a light, and the maps that renderers shade it with.

use std::sync::{Arc, OnceLock};

use brdf::{BaseColorTexture, BrdfTable, Centre, Material, Standard, StandardParameters};
use envmap::CubeMap;
use sh::{Degree, Expansion, Light as Sun, Stop};
use shrm::{Lamps, MOST_P, MOST_VALUES, MapGrid, MapViews, Plain, Reflection, Shrm, Terms, View, ViewSet};
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

    /// The reflections that have a map each: those of the two parts of the material, or that of all of it;
    /// none if the look was made from a map.
    fn mapped(&self) -> &[Reflection] {
        let Some(reflection) = self.reflection() else { return &[] };
        match reflection.parts().filter(|_| !self.joins_parts) {
            Some(parts) => parts,
            None => std::slice::from_ref(reflection),
        }
    }

    /// The central directions of the maps, one for each.
    pub fn centres(&self) -> Vec<Centre> {
        match self.mapped() {
            [] => vec![self.centre()],
            mapped => mapped.iter().map(|reflection| reflection.brdf().centre()).collect(),
        }
    }

    /// The degree P of the SHRM of a reflection, and that of the field that lamps in it are fitted with.
    fn degrees_of(&self, place: usize, reflection: &Reflection) -> [Degree; 2] {
        let given = self.degrees_in_view.as_ref().and_then(|degrees| degrees.get(place));
        let p = reflection.brdf().p();
        let is_fitted = self.holds_lamps && reflection.lamps().is_some();
        let own = if is_fitted { p.max(Degree::new(MOST_P).unwrap_or(Degree::MAX)) } else { p };
        given.copied().unwrap_or([own, Degree::MAX])
    }

    /// The degrees P of the SHRMs, one for each; none if the look has no maps.
    pub fn view_degrees(&self) -> Vec<Degree> {
        match &self.field {
            Some(Field::Map(map)) => vec![map.p()],
            _ => (0..).zip(self.mapped()).map(|(place, of)| self.degrees_of(place, of)[0]).collect(),
        }
    }

    /// The local SHRM on [`Look::cube`], or that of each part of the material, whose sum is seen. They are
    /// without the lamps that the reflection has beside it: modes that look them up add them
    /// ([`crate::shading::lamps`]). With the lamps in maps they are what `export-shrm` writes.
    ///
    /// # Errors
    /// If a map would be too large, and [`RenderError::Missing`] if the look has no maps.
    pub fn local(&self) -> Result<&[Shrm], RenderError> {
        if self.mapped().is_empty() || !self.bakes() && self.degrees_in_view.is_none() {
            return self.soft();
        }
        let made = self.local.get_or_init(|| {
            let of = |(place, reflection): (usize, &Reflection)| {
                let [p, field] = self.degrees_of(place, reflection);
                let grid = MapGrid::Cube(self.cube());
                let made = if self.holds_lamps && reflection.lamps().is_some() {
                    within("the local SHRM with lamps", self.texels(), p.rows(), COEFFICIENTS)?;
                    reflection.bake(grid, View::Local, [p, field], Stop::NEVER)
                } else {
                    reflection.cut_in_view(p).synthesise(grid, View::Local, Stop::NEVER)
                };
                made.map_err(|error| RenderError::maps(error.to_string()))
            };
            self.mapped().iter().enumerate().map(of).collect()
        });
        made.as_deref().map_err(Clone::clone)
    }

    /// The local SHRMs without lamps.
    fn soft(&self) -> Result<&[Shrm], RenderError> {
        self.soft.get_or_init(|| self.maps(View::Local)).as_deref().map_err(Clone::clone)
    }

    /// The global SHRMs on [`Look::cube`], with or without lamps as [`Look::local`].
    ///
    /// # Errors
    /// The errors of [`Look::local`].
    pub fn global(&self) -> Result<&[Shrm], RenderError> {
        let made = self.global.get_or_init(|| match self.field()? {
            Field::Reflection(_) => {
                for reflection in self.mapped() {
                    let rows = reflection.brdf().p().rows();
                    within("the global SHRM", self.texels(), rows, COEFFICIENTS)?;
                }
                Ok(self.local()?.iter().map(Shrm::to_global).collect())
            }
            Field::Map(_) => self.maps(View::Global),
        });
        made.as_deref().map_err(Clone::clone)
    }

    /// Cabral's twelve maps, of each part if there is a map of each, with all light in them.
    ///
    /// # Errors
    /// The errors of [`Look::local`].
    pub fn cabral(&self) -> Result<&[ViewSet], RenderError> {
        let made = self.cabral.get_or_init(|| {
            within("the set of Cabral's maps", self.texels(), 12, MAPS)?;
            self.view_sets(MapViews::Icosahedron)
        });
        made.as_deref().map_err(Clone::clone)
    }

    /// Kautz and McCool's texture, of each part if there is a map of each, with all light in it.
    ///
    /// # Errors
    /// The errors of [`Look::local`], and if there is no slice.
    pub fn kautz_mccool(&self) -> Result<&[ViewSet], RenderError> {
        let made = self.kautz_mccool.get_or_init(|| {
            within("Kautz and McCool's texture", self.texels(), self.sizes.slices, SLICES)?;
            self.view_sets(MapViews::even_angles(self.sizes.slices))
        });
        made.as_deref().map_err(Clone::clone)
    }

    /// Explicit maps with all light in them.
    fn view_sets(&self, views: MapViews) -> Result<Vec<ViewSet>, RenderError> {
        let count = views.count();
        let of = |(place, map): (usize, &Shrm)| {
            let set = ViewSet::from_shrm(map, views.clone(), Stop::NEVER)?
                .ok_or_else(|| RenderError::maps(format!("a texture needs at least 1 slice, not {count}")))?;
            Ok(match self.mapped().get(place).and_then(Reflection::lamps) {
                Some(lamps) => set.with_lamps(lamps, Stop::NEVER)?,
                None => set,
            })
        };
        self.soft()?.iter().enumerate().map(of).collect()
    }

    /// The plain reflection map, the mean over all views as in `export-reflection-map`, or that of each part
    /// of the material.
    ///
    /// # Errors
    /// The errors of [`Look::local`].
    pub fn prefiltered(&self) -> Result<&[PlainMap], RenderError> {
        let made = self.prefiltered.get_or_init(|| {
            within("the reflection map", self.texels(), 1, MAPS)?;
            match self.field()? {
                Field::Reflection(_) => self.mapped().iter().map(|of| self.plain_map(of)).collect(),
                // The mean over all views is the term p = 0, in either frame.
                Field::Map(_) => {
                    let y_00 = (0.25 / std::f32::consts::PI).sqrt();
                    let texel = |map: &Shrm, texel| map.texel(texel)[0].map(|value| value * y_00);
                    let of = |map: &Shrm| (0..map.grid().len()).map(|place| texel(map, place)).collect();
                    Ok(self.local()?.iter().map(of).collect())
                }
            }
        });
        made.as_deref().map_err(Clone::clone)
    }

    /// The plain maps whose sum is seen: the two levels of an engine's cube around the one that is read, or
    /// [`Look::prefiltered`].
    ///
    /// # Errors
    /// The errors of [`Look::prefiltered`].
    pub(crate) fn plain_parts<'a>(&'a self) -> Result<Vec<PlainPart<'a>>, RenderError> {
        if let Some((cube, level)) = self.prefiltered_cube() {
            let (levels, share) = cube.around(level);
            let weighted = levels.into_iter().zip([1.0 - share, share]);
            let part = |(level, weight): (&'a CubeMap, f32)| PlainPart {
                edge: level.cube().edge as u32,
                texels: level.pixels(),
                centre: self.centre(),
                weight,
            };
            return Ok(weighted.filter(|(_, weight)| *weight > 0.0).map(part).collect());
        }
        let edge = self.cube().edge as u32;
        let part = |(texels, centre): (&'a PlainMap, _)| PlainPart { edge, texels, centre, weight: 1.0 };
        Ok(self.prefiltered()?.iter().zip(self.centres()).map(part).collect())
    }

    /// The mean of a reflection over all views, with its lamps.
    fn plain_map(&self, reflection: &Reflection) -> Result<PlainMap, RenderError> {
        let field = reflection.plain(Plain::Mean);
        let mut texels: PlainMap =
            sh::synthesise_cube(&field, self.cube()).map_err(|error| RenderError::maps(error.to_string()))?;
        if let Some(lamps) = reflection.lamps() {
            let lit = lamps.plain(Plain::Mean, MapGrid::Cube(self.cube()));
            for (texel, lit) in texels.iter_mut().zip(lit) {
                (0..3).for_each(|channel| texel[channel] += lit[channel]);
            }
        }
        if reflection.is_for_light() {
            texels.as_flattened_mut().iter_mut().for_each(|value| *value = value.max(0.0));
        }
        Ok(texels)
    }

    fn maps(&self, view: View) -> Result<Vec<Shrm>, RenderError> {
        let grid = MapGrid::Cube(self.cube());
        match self.field()? {
            Field::Reflection(_) => {
                let maps = self.mapped().iter().map(|of| of.synthesise(grid, view, Stop::NEVER));
                maps.map(|map| map.map_err(|error| RenderError::maps(error.to_string()))).collect()
            }
            Field::Map(map) => {
                // Local zonal maps stay zonal. All others are blended with all terms, on their own grid.
                let (texels, rows) = match (view, map.terms()) {
                    (View::Local, Terms::Zonal) => (self.texels(), map.rows()),
                    _ => (self.texels().max(map.grid().len()), map.p().rows()),
                };
                let what = if view == View::Local { "the local SHRM" } else { "the global SHRM" };
                within(what, texels, rows, COEFFICIENTS)?;
                Ok(vec![map.resampled(grid, view)])
            }
        }
    }

    /// The number of texels of a map, or the largest number if it overflows.
    fn texels(&self) -> usize {
        self.sizes.edge.saturating_mul(self.sizes.edge).saturating_mul(6)
    }
}

/// The name of the values of each texel, and that of the parameter to lower if there are too many.
type TexelValues = (&'static str, &'static str);

const COEFFICIENTS: TexelValues = ("coefficients", "the resolution or the material's degree P");
const MAPS: TexelValues = ("maps", "the resolution");
const SLICES: TexelValues = ("slices", "the resolution or the number of slices");

/// Rejects a map of more than [`MOST_VALUES`] before it is allocated.
fn within(what: &str, texels: usize, count: usize, (name, lower): TexelValues) -> Result<(), RenderError> {
    if texels.saturating_mul(count) <= MOST_VALUES {
        return Ok(());
    }
    Err(RenderError::maps(format!(
        "{what}: {texels} texels times {count} {name} make more than {MOST_VALUES} values: lower {lower}"
    )))
}

#[cfg(test)]
mod tests {
    use brdf::{Choice, KajiyaKay, project};
    use envmap::Environment;
    use sh::Expansion;
    use sphere::LatLong;

    use super::*;

    fn light() -> Arc<Light> {
        let grid = LatLong::with_rows(4);
        Arc::new(Light::new(Environment::new(grid, vec![[1.0; 3]; grid.len()]).unwrap(), None))
    }

    /// A material whose local maps keep P + 1 coefficients, and whose global ones (P + 1)^2.
    fn fibre(p: usize) -> Reflection {
        let [f, p] = [0, p].map(|degree| Degree::new(degree).unwrap());
        let material = Material::KajiyaKay(KajiyaKay::new(32.0, [1.0; 3]).unwrap());
        let brdf = project(&material, Choice::Degree { f, p }, Stop::NEVER).unwrap().coefficients;
        Reflection::convolve(&Expansion::from_coefficients(Degree::ZERO, vec![[1.0; 3]]).unwrap(), &brdf)
    }

    fn rejected<T>(map: Result<T, RenderError>) -> String {
        map.err().expect("it is too large").to_string()
    }

    /// None of these would fit into memory.
    #[test]
    fn a_map_that_is_too_large_is_rejected_before_it_is_allocated() {
        let sizes = MapSizes { edge: 512, slices: 256 };
        let look = Look::new(light(), fibre(32), None, sizes);
        assert_eq!(
            rejected(look.global()),
            "the global SHRM: 1572864 texels times 1089 coefficients make more than 268435456 values: lower the \
             resolution or the material's degree P"
        );
        assert_eq!(
            rejected(look.kautz_mccool()),
            "Kautz and McCool's texture: 1572864 texels times 256 slices make more than 268435456 values: lower the \
             resolution or the number of slices"
        );
        for edge in [7000, 1 << 30, usize::MAX] {
            let look = Look::new(light(), fibre(0), None, MapSizes { edge, slices: 16 });
            let errors = [
                rejected(look.local()),
                rejected(look.global()),
                rejected(look.cabral()),
                rejected(look.kautz_mccool()),
            ];
            assert!(errors.iter().all(|message| message.contains("lower the resolution")), "{errors:?}");
        }
        let look = Look::new(light(), fibre(0), None, MapSizes { edge: 1 << 30, slices: 16 });
        assert!(rejected(look.prefiltered()).starts_with("the reflection map: "));
    }

    #[test]
    fn without_maps_every_map_is_missing() {
        let material = Material::KajiyaKay(KajiyaKay::new(32.0, [1.0; 3]).unwrap());
        let look = Look::without_maps(light(), material, MapSizes::default());
        assert!(!look.has_maps() && look.material().is_some());
        assert_eq!(look.centre(), Centre::Tangent);
        let missing = "this mode needs the maps of the material";
        assert_eq!(rejected(look.local()), missing);
        assert_eq!(rejected(look.global()), missing);
        assert_eq!(rejected(look.cabral()), missing);
        assert_eq!(rejected(look.kautz_mccool()), missing);
        assert_eq!(rejected(look.prefiltered()), missing);
    }

    #[test]
    fn an_imported_map_is_rejected_if_its_resampled_size_is_too_large() {
        let zonal = fibre(32).synthesise(MapGrid::Cube(Cube { edge: 4 }), View::Local, Stop::NEVER).unwrap();
        assert_eq!(zonal.terms(), Terms::Zonal);
        let look = |edge| Look::from_map(light(), zonal.clone(), None, MapSizes { edge, slices: 2 });
        assert!(rejected(look(512).global()).starts_with("the global SHRM: 1572864 texels times 1089 "));
        assert!(
            rejected(look(1 << 20).local()).starts_with("the local SHRM: 6597069766656 texels times 33 ")
        );
        let small = look(8);
        assert_eq!((small.local().unwrap()[0].rows(), small.global().unwrap()[0].rows()), (33, 33 * 33));
    }
}
