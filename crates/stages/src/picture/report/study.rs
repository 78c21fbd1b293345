//! Measures pairs of a material and an environment: calls the kernels and fills the figures.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::collections::HashMap;

use brdf::{BrdfCoefficients, Choice, Part, project};
use containers::tensors::MaterialTaps;
use engine::{Failure, Reporter, Steps};
use envmap::{ToneMap, to_srgb8};
use rayon::prelude::*;
use sh::{Degree, Expansion, Light};
use shrm::MOST_P;
use shrm::{Lamps, MapGrid, MapViews, MeanLobe, Plain, Reflection, Shrm, Terms, View};
use sphere::{Cube, Direction, LatLong};
use taps::{Accuracy, AnyTable, Trade};

use crate::map::{default_taps, has_facets, tap_tables};
use crate::picture::report::advice;
use crate::picture::report::advice::best;
use crate::picture::report::figures::{
    Change, Errors, Export, FileSizes, Method, PairFigures, Settings, Trial,
};
use crate::picture::report::lit::{BAND, Lit, TRUTH};
use crate::picture::report::page::Pictures;
use crate::picture::report::readers::Reader;
use crate::picture::report::sphere::{Lattice, Sphere};
use crate::picture::report::taps_on_sphere::{LIGHT_BYTES, beside_taps, compact_bytes, shown_by_taps};
use crate::picture::report::trade_advice;
use crate::values::UntilStopped;

/// The number of angles of a Kautz-McCool texture, as `export-kautz-mccool` has them by default.
const SLICES: usize = 16;

/// The error in stops of 95 of 100 samples above which a ring beside a highlight shows.
const RING: f64 = 0.1;

/// The number of coefficients of a map with lamps that are fitted for one view: about two seconds of one
/// core.
const FITTED: usize = 1 << 20;

/// A material, and the lobes and coefficients that are made from it once.
pub(crate) struct Studied<'a> {
    pub(crate) name: String,
    pub(crate) material: Cow<'a, brdf::Material>,
    /// The diffuse and the specular part, of a material that has both.
    parts: OnceCell<Option<Box<[Studied<'static>; 2]>>>,
    full: OnceCell<BrdfCoefficients>,
    /// The coefficients of degrees that the report's parameters give.
    given: OnceCell<BrdfCoefficients>,
    /// The material's lobe for a small light, in the mean over all views.
    mean: OnceCell<MeanLobe>,
    /// The material's lobes for a small light, in the mean over the views at each angle of a 3D texture.
    rings: OnceCell<Vec<MeanLobe>>,
    /// The look-ups into a scale space, with more and more of them.
    taps: OnceCell<MaterialTaps>,
}

impl<'a> Studied<'a> {
    pub(crate) fn new(name: String, material: Cow<'a, brdf::Material>) -> Self {
        let (parts, full, given, mean, rings, taps) = Default::default();
        Self { name, material, parts, full, given, mean, rings, taps }
    }

    fn mean(&self) -> &MeanLobe {
        self.mean.get_or_init(|| MeanLobe::plain(&self.material, Plain::Mean))
    }

    fn rings(&self) -> &[MeanLobe] {
        let ring = |angle: &f64| MeanLobe::ring(&self.material, *angle);
        self.rings.get_or_init(|| MapViews::even_angles(SLICES).angles().iter().map(ring).collect())
    }

    /// The diffuse and the specular part, of a material that has both.
    fn parts(&self) -> Option<&[Studied<'static>; 2]> {
        let part = |part| Some(Studied::new(self.name.clone(), Cow::Owned(self.material.part(part)?)));
        let parts = || Some(Box::new([part(Part::Diffuse)?, part(Part::Specular)?]));
        self.parts.get_or_init(parts).as_deref()
    }

    /// The tables of look-ups that `fit-taps` makes by default.
    pub(crate) fn tables(&self, reporter: &Reporter) -> Result<Vec<AnyTable<'_>>, Failure> {
        if let Some(taps) = self.taps.get() {
            return Ok(tap_tables(taps));
        }
        let made = default_taps(&self.material, reporter)?;
        Ok(tap_tables(self.taps.get_or_init(|| made)))
    }

    /// The coefficients that `project-brdf` makes by default.
    pub(crate) fn full(&self, reporter: &Reporter) -> Result<&BrdfCoefficients, Failure> {
        projected(&self.full, &self.material, Choice::Full, reporter)
    }
}

fn projected<'a>(
    cell: &'a OnceCell<BrdfCoefficients>,
    material: &brdf::Material,
    choice: Choice,
    reporter: &Reporter,
) -> Result<&'a BrdfCoefficients, Failure> {
    if let Some(made) = cell.get() {
        return Ok(made);
    }
    let made = reporter.until_stopped(|stop| project(material, choice, stop))?.coefficients;
    Ok(cell.get_or_init(|| made))
}

/// The reflection of a pair as the stages make it by default, or with these degrees.
pub(crate) fn reflection(
    lit: &Lit<'_>,
    material: &Studied<'_>,
    choice: Option<Choice>,
    reporter: &Reporter,
) -> Result<Reflection, Failure> {
    Ok(match choice {
        None => {
            let (lighting, brdf) = (lit.full(reporter)?, material.full(reporter)?);
            let found = reporter
                .until_stopped(|stop| Reflection::for_light(lighting, brdf, &material.material, stop));
            found?.0
        }
        Some(choice) => {
            let brdf = projected(&material.given, &material.material, choice, reporter)?;
            Reflection::convolve(&lit.full(reporter)?.whole(), brdf)
        }
    })
}

/// A reflection that is exported in every way.
#[derive(Clone, Copy)]
pub(crate) struct StudiedReflection<'a> {
    /// The reflection of the material under the environment.
    pub(crate) reflection: &'a Reflection,
    /// Whether it is what the stages make by default.
    pub(crate) is_default: bool,
    /// The sizes of the files that the pipeline exports of it.
    pub(crate) files: FileSizes,
}

/// What was found of a pair, and what further measurements begin with.
pub(crate) struct StudiedPair<'a> {
    pub(crate) figures: PairFigures,
    pub(crate) pictures: Pictures,
    pub(crate) scene: StudyScene<'a>,
    /// The map of the reflection without lamps.
    pub(crate) soft: Shrm,
}

/// Renders a material under an environment in every way.
pub(crate) fn pair<'a>(
    lit: &Lit<'_>,
    material: &Studied<'_>,
    studied: StudiedReflection<'_>,
    settings: &Settings,
    steps: &Steps<'a>,
) -> Result<StudiedPair<'a>, Failure> {
    let reflection = studied.reflection;
    let lattice = Lattice::first(Sphere::new(settings.sphere).indices().len());
    let mut sphere = Sphere::on(lattice, settings.sphere);
    let steps = steps.part(1, sphere.indices().len().div_ceil(BAND) + Method::ALL.len());
    let soft = soft(reflection, settings.resolution, steps.reporter())?;
    let mut before = None;
    let (scene, mut measured) = loop {
        let scene = StudyScene::new(lit, material, reflection, sphere, before.as_ref(), &steps)?;
        let measured = scene.exports(lit, material, reflection, &soft, settings, &steps)?;
        let is_known = measured.iter().all(|(export, _)| settings.limits.are_known(&export.errors));
        match scene.sphere.lattice().finer() {
            Some(finer) if !is_known => {
                sphere = Sphere::on(finer, settings.sphere);
                before = Some(scene);
            }
            _ => break (scene, measured),
        }
    };
    if reflection.lamps().is_some() {
        // To fit it takes so long that it is measured once, at as many pixels as there is time for.
        measured.push(scene.measure(Method::Shrm, material, reflection, &soft, settings.resolution)?);
        measured.sort_by_key(|(export, _)| export.method as usize);
    }
    let mut pictures = Pictures {
        truth: scene.shown(scene.sphere.lattice(), &scene.truth, lit.exposure),
        exports: Vec::new(),
    };
    let mut exports = Vec::new();
    for (export, (lattice, values)) in measured {
        let shown = [&values, &scene.truth].map(|values| scene.shown(lattice, values, lit.exposure));
        pictures.exports.push(shown);
        exports.push(Export { file: studied.files[export.method as usize], ..export });
    }
    let tried = scene.trials(lit, material, studied, &exports, settings)?;
    let degrees = [reflection.brdf().f().get(), reflection.brdf().p().get()];
    let given = (!reflection.is_for_light()).then_some(degrees);
    let figures = PairFigures {
        environment: lit.name.clone(),
        material: material.name.clone(),
        f: degrees[0],
        p: degrees[1],
        lamps: reflection.lamps().map_or(0, |lamps| lamps.lights.len()),
        for_light: reflection.is_for_light(),
        advice: advice::of_pair(&lit.name, &exports, &tried, given, &settings.limits),
        exports,
        tried,
        trade: None,
    };
    Ok(StudiedPair { figures, pictures, scene, soft })
}

/// The lattice of pixels that count, and the radiance that readers see there.
type Seen = (Lattice, Vec<[f32; 3]>);

/// The map without lamps.
fn soft(reflection: &Reflection, edge: usize, reporter: &Reporter) -> Result<Shrm, Failure> {
    let grid = MapGrid::Cube(Cube { edge });
    reporter.until_stopped(|stop| reflection.synthesise(grid, View::Local, stop))
}

/// A sphere under one light, with its ground truth; brushed along +Z if the material depends on its tangent.
pub(crate) struct StudyScene<'a> {
    pub(crate) sphere: Sphere,
    /// The central direction at each pixel.
    pub(crate) central: Vec<Direction>,
    truth: Vec<[f32; 3]>,
    dark: f64,
    pub(crate) reporter: &'a Reporter,
}

impl<'a> StudyScene<'a> {
    fn new(
        lit: &Lit<'_>,
        material: &Studied<'_>,
        reflection: &Reflection,
        sphere: Sphere,
        before: Option<&StudyScene<'_>>,
        steps: &Steps<'a>,
    ) -> Result<Self, Failure> {
        let mut known = HashMap::new();
        if let Some(before) = before {
            known.extend(before.sphere.indices().zip(before.truth.iter().copied()));
        }
        let pixels: Vec<usize> = sphere.indices().collect();
        let central = sphere.central(reflection.brdf().centre());
        let (tree, material, view) = (&lit.tree, &*material.material, Sphere::view());
        let (dark, mut truth) = (lit.dark, vec![[0.0_f32; 3]; central.len()]);
        let brushed = has_facets(material).then(|| sphere.brushed());
        let sum = |place: usize| match &brushed {
            Some(frames) => tree.surface_radiance(material, frames[place], view, TRUTH, dark),
            None => tree.radiance(material, central[place], view, TRUTH, dark),
        };
        for (band, values) in truth.chunks_mut(BAND).enumerate() {
            steps.step()?;
            let radiance = |place: usize| match known.get(&pixels[place]) {
                Some(radiance) => *radiance,
                None => sum(place).map(|value| value as f32),
            };
            values
                .par_iter_mut()
                .enumerate()
                .for_each(|(place, value)| *value = radiance(band * BAND + place));
        }
        Ok(Self { sphere, central, truth, dark, reporter: steps.reporter() })
    }

    /// Measures every export but the map with lamps in it; returns each with the radiance that its readers
    /// see and the lattice where that was measured.
    fn exports(
        &self,
        lit: &Lit<'_>,
        material: &Studied<'_>,
        reflection: &Reflection,
        soft: &Shrm,
        settings: &Settings,
        steps: &Steps<'_>,
    ) -> Result<Vec<(Export, Seen)>, Failure> {
        let mut made = Vec::new();
        for method in Method::ALL {
            steps.step()?;
            let without = if reflection.lamps().is_some() { Method::Shrm } else { Method::ShrmSeparate };
            if method == without {
                continue;
            }
            made.push(match (method, material.parts()) {
                (Method::Taps, _) => self.compact(lit, material)?,
                (Method::PartMaps, None) => continue,
                (Method::PartMaps, Some(parts)) => self.part_maps(lit, parts, reflection, settings)?,
                _ => self.measure(method, material, reflection, soft, settings.resolution)?,
            });
        }
        Ok(made)
    }

    /// A picture of values that were measured on a lattice.
    fn shown(&self, lattice: Lattice, values: &[[f32; 3]], exposure: f64) -> Vec<[u8; 3]> {
        let filled = self.sphere.filled(lattice, values);
        self.sphere.picture(&to_srgb8(&filled, exposure, ToneMap::Filmic))
    }

    /// The errors of values that readers see at the pixels of a lattice.
    pub(crate) fn errors(&self, values: &[[f32; 3]], lattice: Lattice) -> Errors {
        self.sphere.errors(values, &self.truth, self.dark, lattice)
    }

    /// The readers of the maps of a reflection.
    pub(crate) fn reader(&self, reflection: &Reflection) -> Reader<'_> {
        Reader { central: &self.central, least: if reflection.is_for_light() { 0.0 } else { f32::MIN } }
    }

    /// The radiance of lamps alone at each pixel.
    pub(crate) fn lamps(&self, lamps: &Lamps) -> Vec<[f64; 3]> {
        let (lamps, view) = (lamps.for_views(), Sphere::view());
        self.central.par_iter().map(|central| lamps.radiance(*central, view)).collect()
    }

    /// The light as it is beside the reflection; without lamps there, as the stages make it by default.
    pub(crate) fn light<'b>(
        &self,
        lit: &'b Lit<'_>,
        reflection: &'b Reflection,
    ) -> Result<(&'b Expansion, &'b [Light]), Failure> {
        if reflection.is_for_light() {
            let lights = reflection.lamps().map(|lamps| &lamps.lights[..]).unwrap_or_default();
            return Ok((reflection.lighting(), lights));
        }
        let full = lit.full(self.reporter)?;
        Ok((&full.series, &full.lights[..]))
    }

    /// Measures a compact map with the least taps that are good enough, and the sum of its taps and lights
    /// that readers see.
    fn compact(&self, lit: &Lit<'_>, material: &Studied<'_>) -> Result<(Export, Seen), Failure> {
        let (space, tables) = (lit.space(self.reporter)?, material.tables(self.reporter)?);
        let beside = beside_taps(&self.sphere, space.lights(), &material.material);
        let lattice = self.sphere.lattice();
        let lights = space.lights().len();
        let seen = |table: &AnyTable<'_>| {
            let values = shown_by_taps(&self.sphere, *table, space, &beside);
            (self.errors(&values, lattice), values)
        };
        let mut all: Vec<_> = tables.iter().map(seen).collect();
        let trades = all.iter().zip(&tables).enumerate().map(|(index, ((errors, _), table))| Trade {
            table: index,
            taps: table.taps(),
            lights,
            accuracy: Accuracy { p95: errors.p95, p99: errors.p99 },
        });
        let chosen = Trade::cheapest(&trades.collect::<Vec<_>>(), trade_advice::LIMITS.stops());
        let index = chosen.map_or(0, |chosen| chosen.table);
        let (table, (errors, values)) = (tables[index], all.swap_remove(index));
        let taps = table.taps();
        let export = Export {
            method: Method::Taps,
            errors,
            f: 0,
            p: 0,
            bytes: compact_bytes(space, table) as u64,
            file: None,
            texture: format!("{taps} taps, {lights} {}", if lights == 1 { "light" } else { "lights" }),
            one_of: lattice.one_of(),
        };
        Ok((export, (lattice, values)))
    }

    /// Measures a plain map of each part, and the sum of both that readers see.
    fn part_maps(
        &self,
        lit: &Lit<'_>,
        parts: &[Studied<'static>],
        reflection: &Reflection,
        settings: &Settings,
    ) -> Result<(Export, Seen), Failure> {
        let edge = settings.resolution;
        let cube = Cube { edge };
        let mut values = vec![[0.0_f32; 3]; self.central.len()];
        let (series, lights) = self.light(lit, reflection)?;
        for part in parts {
            self.reporter.check_cancelled()?;
            let central = self.sphere.central(part.material.centre());
            let reader = Reader { central: &central, least: 0.0 };
            let field = part.mean().reflect(series, reflection.brdf().f());
            let seen = reader.plain(&field, Some((part.mean(), lights)), cube)?;
            for (value, seen) in values.iter_mut().zip(seen) {
                (0..3).for_each(|channel| value[channel] += seen[channel]);
            }
        }
        let lattice = self.sphere.lattice();
        let errors = self.errors(&values, lattice);
        let (count, texture) = (parts.len(), format!("{} × 6 faces of {edge} × {edge}", parts.len()));
        let bytes = (8 * count * cube.len()) as u64;
        Ok((
            Export {
                method: Method::PartMaps,
                errors,
                f: reflection.brdf().f().get(),
                p: 0,
                bytes,
                file: None,
                texture,
                one_of: lattice.one_of(),
            },
            (lattice, values),
        ))
    }

    /// Measures one export, and the radiance that its readers see; `soft` is the reflection's map without
    /// lamps.
    fn measure(
        &self,
        method: Method,
        material: &Studied<'_>,
        reflection: &Reflection,
        soft: &Shrm,
        edge: usize,
    ) -> Result<(Export, Seen), Failure> {
        self.reporter.check_cancelled()?;
        let (reader, lamps) = (self.reader(reflection), reflection.lamps());
        // A reflection that is connected may be of other parameters.
        let other;
        let lit_by = match lamps {
            Some(lamps) if lamps.material != *material.material => {
                other = Studied::new(material.name.clone(), Cow::Owned(lamps.material.clone()));
                &other
            }
            _ => material,
        };
        let grid = MapGrid::Cube(Cube { edge });
        let faces = format!("6 faces of {edge} × {edge}");
        let of_map = |map: &Shrm| {
            let terms = map.rows();
            let unit = if terms == 1 { "coefficient" } else { "coefficients" };
            (8 * terms * grid.len(), format!("{terms} {unit} × {faces}"))
        };
        let (mut p, mut lattice) = (reflection.brdf().p().get(), self.sphere.lattice());
        let (values, (bytes, texture)) = match method {
            Method::Taps | Method::ReflectionMap | Method::PartMaps => {
                p = 0;
                let lights = lamps.map(|lamps| (lit_by.mean(), &lamps.lights[..]));
                let values = reader.plain(&reflection.plain(Plain::Mean), lights, Cube { edge })?;
                (values, (8 * grid.len(), faces))
            }
            Method::KautzMccool => {
                // Slices of a 3D texture are lat-long images, as dense at the equator as the cubes.
                let rows = LatLong::with_rows(2 * edge);
                let lights = lamps.map(|lamps| (lit_by.rings(), &lamps.lights[..]));
                let angles = MapViews::even_angles(SLICES);
                let values = reader.kautz_mccool(&zonal(reflection, rows, self.reporter)?, &angles, lights);
                let size = format!("{SLICES} angles × {} × {}", rows.width, rows.height);
                (values, (8 * SLICES * rows.len(), size))
            }
            Method::Cabral => {
                (reader.cabral(soft, lamps), (8 * 12 * grid.len(), format!("12 views × {faces}")))
            }
            Method::Shrm if lamps.is_some() => {
                let (map, measured) = self.baked(reflection, soft, MOST_P.max(soft.p().get()), FITTED)?;
                (lattice, p) = (measured, map.p().get());
                (reader.shrm(&map, None), of_map(&map))
            }
            Method::Shrm => (reader.shrm(soft, None), of_map(soft)),
            Method::ShrmSeparate => {
                let values = reader.shrm(soft, lamps);
                let count = lamps.map_or(0, |lamps| lamps.lights.len());
                let (bytes, texture) = of_map(soft);
                let unit = if count == 1 { "light" } else { "lights" };
                (values, (bytes + LIGHT_BYTES * count, format!("{texture}, {count} {unit}")))
            }
        };
        let export = Export {
            method,
            errors: self.errors(&values, lattice),
            f: reflection.brdf().f().get(),
            p,
            bytes: bytes as u64,
            file: None,
            texture,
            one_of: lattice.one_of(),
        };
        Ok((export, (lattice, values)))
    }

    /// The map of a degree P with lamps in it, as far as a lattice of pixels sees it of which at most so many
    /// coefficients are fitted: a texel of P = 16 takes some tenths of a millisecond.
    pub(crate) fn baked(
        &self,
        reflection: &Reflection,
        soft: &Shrm,
        p: usize,
        fitted: usize,
    ) -> Result<(Shrm, Lattice), Failure> {
        let p = Degree::new(p)?;
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
        let map = self.reporter.until_stopped(|stop| reflection.bake_texels(soft, p, &seen, stop))?;
        Ok((map, lattice))
    }

    /// Tries other exports that might help, if no export is good or given degrees show: measured until
    /// something is good. First without given degrees, then with more texels, and in light without lamps with
    /// the highest degrees.
    fn trials(
        &self,
        lit: &Lit<'_>,
        material: &Studied<'_>,
        StudiedReflection { reflection, is_default, .. }: StudiedReflection<'_>,
        exports: &[Export],
        settings: &Settings,
    ) -> Result<Vec<Trial>, Failure> {
        let limits = &settings.limits;
        let is_good = |export: &Export| limits.excess(&export.errors) <= 1.0;
        let shows = |export: &Export| export.errors.p95 > RING || export.errors.negative > 0.0;
        // What may be changed are the maps of the reflection.
        let exports: Vec<Export> =
            exports.iter().filter(|export| export.method != Method::Taps).cloned().collect();
        let cut_shows = !reflection.is_for_light() && best(&exports, limits).is_some_and(shows);
        if exports.iter().any(is_good) && !cut_shows {
            return Ok(Vec::new());
        }
        let (mut tried, mut change) = (Vec::new(), Change::default());
        let by_light =
            if is_default { None } else { Some(self::reflection(lit, material, None, self.reporter)?) };
        let reflection = match by_light.as_ref().filter(|by_light| *by_light != reflection) {
            Some(by_light) => {
                change.no_degree = true;
                let soft = soft(by_light, settings.resolution, self.reporter)?;
                for method in shrms(by_light) {
                    let (export, _) =
                        self.measure(*method, material, by_light, &soft, settings.resolution)?;
                    tried.push(Trial { change, export });
                }
                by_light
            }
            None => reflection,
        };
        // The most exact form costs least here.
        let method = shrms(reflection)[0];
        let finer = 2 * settings.resolution;
        if !tried.iter().any(|trial| is_good(&trial.export)) && finer <= crate::values::MAX_RESOLUTION {
            change.resolution = Some(finer);
            let soft = soft(reflection, finer, self.reporter)?;
            let (export, _) = self.measure(method, material, reflection, &soft, finer)?;
            tried.push(Trial { change, export });
        }
        if !tried.iter().any(|trial| is_good(&trial.export)) && reflection.lamps().is_none() {
            let (lighting, brdf) = (&lit.full(self.reporter)?.series, material.full(self.reporter)?);
            let p = Degree::new(MOST_P)?;
            let highest = Reflection::convolve(lighting, &brdf.cut_to(Degree::MAX, p));
            let degree = [highest.brdf().f().get(), highest.brdf().p().get()];
            if lit.full(self.reporter)?.lights.is_empty()
                && (degree[0] > reflection.brdf().f().get() || degree[1] > reflection.brdf().p().get())
            {
                let edge = change.resolution.unwrap_or(settings.resolution);
                let change = Change { no_degree: false, degree: Some(degree), ..change };
                let soft = soft(&highest, edge, self.reporter)?;
                let (export, _) = self.measure(Method::Shrm, material, &highest, &soft, edge)?;
                tried.push(Trial { change, export });
            }
        }
        Ok(tried)
    }
}

/// The forms of a spherical harmonic reflection map that a reflection has, the most exact first.
fn shrms(reflection: &Reflection) -> &'static [Method] {
    if reflection.lamps().is_some() { &[Method::ShrmSeparate, Method::Shrm] } else { &[Method::Shrm] }
}

/// The map of a reflection's terms without azimuth, which are all that a 3D texture holds.
pub(crate) fn zonal(reflection: &Reflection, grid: LatLong, reporter: &Reporter) -> Result<Shrm, Failure> {
    let brdf = reflection.brdf();
    let side = brdf.p().get() + 1;
    let without_azimuth = |(index, rho): (usize, &[f64; 3])| if index % side == 0 { *rho } else { [0.0; 3] };
    let rho = brdf.rho().iter().enumerate().map(without_azimuth).collect();
    let zonal = BrdfCoefficients::new(brdf.centre(), brdf.f(), brdf.p(), rho).unwrap_or_else(|| brdf.clone());
    let zonal = Reflection::convolve(reflection.lighting(), &zonal);
    let grid = MapGrid::LatLong(grid);
    let map = reporter.until_stopped(|stop| zonal.synthesise(grid, View::Local, stop))?;
    debug_assert_eq!(map.terms(), Terms::Zonal);
    Ok(map)
}
