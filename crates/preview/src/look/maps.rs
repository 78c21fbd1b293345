//! The maps of a look, each made when it is first needed: one of the whole material, or one of each part.

use brdf::Centre;
use envmap::CubeMap;
use sh::{Degree, Stop};
use shrm::{MOST_P, MOST_VALUES, MapGrid, MapViews, Plain, Reflection, Shrm, Terms, View, ViewSet};

use super::{Field, Look, PlainMap, PlainPart};
use crate::RenderError;

impl Look {
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
    use std::sync::Arc;

    use brdf::{Choice, KajiyaKay, Material, project};
    use envmap::Environment;
    use sh::Expansion;
    use sphere::{Cube, LatLong};

    use super::*;
    use crate::{Light, MapSizes};

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
