//! Spherical harmonic reflection maps as `export-shrm` makes them, and what readers see of them.

use std::borrow::Cow;

use engine::{Failure, Reporter};
use shrm::{LampTables, Lamps, Reflection, Shrm, Terms, View};
use sphere::Direction;

use crate::map::{PlannedMap, ShrmSettings};
use crate::picture::report::figures::{Errors, Export, Method};
use crate::picture::report::readers::{Reader, add, add_map, lamps_seen};
use crate::picture::report::sphere::{Lattice, Sphere};
use crate::picture::report::taps_on_sphere::LIGHT_BYTES;
use crate::values::{LampsName, UntilStopped, quantity};

/// The number of coefficients of a map with lamps that are fitted for one view: about two seconds of one
/// core.
const FITTED: usize = 1 << 20;

/// The lattice of pixels that count, and the radiance that readers see there.
pub(crate) type Seen = (Lattice, Vec<[f32; 3]>);

/// The maps that a file, or a file for each part of a material, holds.
pub(crate) struct ShrmMaps<'a> {
    method: Method,
    reflection: &'a Reflection,
    maps: Vec<MadeMap<'a>>,
}

struct MadeMap<'a> {
    plan: PlannedMap<'a>,
    /// The map, unless its field has lamps that it is to hold: then the map of the field without these, of
    /// the degree P that they are fitted with.
    map: Cow<'a, Shrm>,
    is_fitted: bool,
}

impl<'a> ShrmMaps<'a> {
    /// The maps that these settings ask for. `soft` is a map of the reflection without lamps, of the
    /// reflection's own degrees.
    pub(crate) fn new(
        settings: &ShrmSettings,
        reflection: &'a Reflection,
        soft: Option<&'a Shrm>,
        reporter: &Reporter,
    ) -> Result<Self, Failure> {
        let bakes = settings.lamps() == LampsName::Baked;
        let made = |plan: PlannedMap<'a>| {
            let (field, shape) = (plan.field, plan.shape);
            let is_fitted = bakes && field.lamps().is_some();
            let view = if is_fitted { View::Local } else { shape.view };
            let p = if is_fitted { shape.field } else { shape.p };
            let known = soft.filter(|soft| {
                std::ptr::eq(field, reflection) && soft.grid() == shape.grid && soft.view() == view
            });
            let map = match known {
                Some(soft) if soft.p() == p => Cow::Borrowed(soft),
                Some(soft) => Cow::Owned(soft.cut(p)),
                None => {
                    let cut = field.cut_in_view(p);
                    Cow::Owned(reporter.until_stopped(|stop| cut.synthesise(shape.grid, view, stop))?)
                }
            };
            Ok(MadeMap { plan, map, is_fitted })
        };
        let maps = settings.maps(reflection, reporter)?.into_iter().map(made);
        let maps = maps.collect::<Result<Vec<_>, Failure>>()?;
        let separate = reflection.lamps().is_some() && !bakes;
        let method = if separate { Method::ShrmSeparate } else { Method::Shrm };
        Ok(Self { method, reflection, maps })
    }

    pub(crate) fn method(&self) -> Method {
        self.method
    }

    /// Whether a map is fitted to lamps in it, which takes long.
    pub(crate) fn are_fitted(&self) -> bool {
        self.maps.iter().any(|map| map.is_fitted)
    }

    /// The degrees P of the maps.
    pub(crate) fn degrees(&self) -> Vec<usize> {
        self.maps.iter().map(|map| map.plan.shape.p.get()).collect()
    }

    /// The sum of the maps, and of the lamps that they do not hold, as readers see it at the pixels of a
    /// sphere; if maps are fitted, at as many as there is time for.
    pub(crate) fn seen(&self, sphere: &Sphere, reporter: &Reporter) -> Result<Seen, Failure> {
        let (mut lattice, mut sum) = (sphere.lattice(), vec![[0.0; 3]; sphere.indices().len()]);
        for MadeMap { plan, map, is_fitted } in &self.maps {
            reporter.check_cancelled()?;
            let central = sphere.central(map.centre());
            let reader = Reader { central: &central, least: f32::MIN };
            let values = if *is_fitted {
                let pixels = SeenPixels { sphere, central: &central };
                let (fitted, measured) =
                    pixels.fitted(plan.field, map, plan.shape.p.get(), FITTED, reporter)?;
                lattice = lattice.coarser(measured);
                reader.shrm(&if plan.shape.view == View::Global { fitted.to_global() } else { fitted })
            } else {
                reader.shrm(map)
            };
            add_map(&mut sum, &values);
        }
        if let Some(lamps) = self.beside() {
            add(&mut sum, &lamps_seen(&sphere.central(self.reflection.brdf().centre()), lamps));
        }
        Ok((lattice, sum))
    }

    /// The export with these errors.
    pub(crate) fn export(&self, errors: Errors, lattice: Lattice) -> Export {
        let lights = self.beside().map_or(0, |lamps| lamps.lights.len());
        let (mut bytes, mut texture) = (LIGHT_BYTES * lights, String::new());
        for made in &self.maps {
            let (terms, [faces, height, width]) = (made.terms(), made.map.grid().shape());
            bytes += 8 * terms * made.map.grid().len();
            let terms = quantity::count(terms, "coefficient");
            let of = if faces > 1 { format!("{faces} faces of ") } else { String::new() };
            let plus = if texture.is_empty() { "" } else { " + " };
            texture.push_str(&format!("{plus}{terms} × {of}{width} × {height}"));
        }
        if lights > 0 {
            texture.push_str(&format!(", {}", quantity::count(lights, "light")));
        }
        let degrees = |made: &MadeMap<'_>| (made.plan.field.brdf().f().get(), made.plan.shape.p.get());
        // The map of a highlight comes after that of its matte base, and has the higher degrees.
        let (f, p) = self.maps.last().map(degrees).unwrap_or_default();
        let (method, bytes, one_of) = (self.method, bytes as u64, lattice.one_of());
        Export { method, errors, f, p, bytes, file: None, texture, maps: self.maps.len(), one_of }
    }

    /// The lamps that a renderer adds.
    fn beside(&self) -> Option<&'a Lamps> {
        self.reflection.lamps().filter(|_| self.method == Method::ShrmSeparate)
    }
}

impl MadeMap<'_> {
    /// The number of coefficients of a texel.
    fn terms(&self) -> usize {
        let p = self.plan.shape.p;
        match self.map.terms() {
            _ if !self.is_fitted || self.map.p().get() == 0 => self.map.rows(),
            Terms::Zonal if self.plan.shape.view == View::Local => p.get() + 1,
            _ => p.rows(),
        }
    }
}

/// The pixels of a sphere, and the central direction of a map at each.
pub(crate) struct SeenPixels<'a> {
    pub(crate) sphere: &'a Sphere,
    pub(crate) central: &'a [Direction],
}

impl SeenPixels<'_> {
    /// The map of a degree P with lamps in it, as far as a lattice of pixels sees it of which at most so many
    /// coefficients are fitted: a texel of P = 16 takes some tenths of a millisecond. `soft` is the
    /// reflection's map without lamps.
    pub(crate) fn fitted(
        &self,
        reflection: &Reflection,
        soft: &Shrm,
        p: usize,
        fitted: usize,
        reporter: &Reporter,
    ) -> Result<(Shrm, Lattice), Failure> {
        let p = sh::Degree::new(p)?;
        let rows = match (soft.p().get(), soft.terms()) {
            (0, _) => 0,
            (_, Terms::Zonal) => p.get() + 1,
            (_, Terms::All) => p.rows(),
        };
        // Each pixel sees four texels.
        let own = self.sphere.lattice();
        let lattice = if soft.grid().len() * rows <= fitted {
            own
        } else {
            own.at_most(fitted / (4 * rows), own.one_of() * self.central.len())
        };
        let mut seen: Vec<usize> = (self.central.iter().zip(self.sphere.within(lattice)))
            .filter(|(_, seen)| *seen)
            .flat_map(|(central, _)| soft.grid().taps(*central).index)
            .collect();
        seen.sort_unstable();
        seen.dedup();
        let map = reporter
            .until_stopped(|stop| reflection.bake_texels(soft, p, &seen, &mut LampTables::default(), stop))?;
        Ok((map, lattice))
    }
}
