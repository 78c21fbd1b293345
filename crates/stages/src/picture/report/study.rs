//! Measures pairs of a material and an environment: calls the kernels and fills the figures.

use std::cell::OnceCell;
use std::collections::HashMap;

use engine::{Failure, Reporter, Steps};
use envmap::{ToneMap, to_srgb8};
use rayon::prelude::*;
use sh::{Degree, Expansion, Light};
use shrm::MOST_P;
use shrm::{MapGrid, MeanLight, Reflection, Shrm, View};
use sphere::{Cube, Direction};
use taps::{Accuracy, AnyTable, Trade};

use crate::map::{Accept, DegreeChoice, has_facets};
use crate::picture::report::advice;
use crate::picture::report::advice::best;
use crate::picture::report::explicit_maps::ExplicitMaps;
use crate::picture::report::exported::PairFiles;
use crate::picture::report::figures::{Change, Errors, Export, Method, PairFigures, Settings, Trial};
use crate::picture::report::lit::{BAND, Lit, TRUTH};
use crate::picture::report::page::Pictures;
use crate::picture::report::readers::Reader;
use crate::picture::report::shrm_maps::{Seen, ShrmMaps};
use crate::picture::report::sphere::{Lattice, Sphere};
use crate::picture::report::studied::{Studied, reflection_of};
use crate::picture::report::taps_on_sphere::{beside_taps, compact_bytes, shown_by_taps};
use crate::picture::report::trade_advice;
use crate::values::{LampsName, UntilStopped, quantity};

/// The error in stops of 95 of 100 samples above which a ring beside a highlight shows.
const RING: f64 = 0.1;

/// The shares of the errors of a good export that an SHRM of a higher P may have by its cut.
const CUT_SHARES: [f64; 2] = [0.5, 0.06];

/// A reflection that is exported in every way.
#[derive(Clone, Copy)]
pub(crate) struct StudiedReflection<'a> {
    /// The reflection of the material under the environment.
    pub(crate) reflection: &'a Reflection,
    /// Whether it is what the stages make by default.
    pub(crate) is_default: bool,
    /// The files that the pipeline exports of it.
    pub(crate) files: PairFiles,
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
    let shrms = shrms(studied, settings.resolution, Some(&soft), steps.reporter())?;
    let explicit = [Method::ReflectionMap, Method::KautzMccool, Method::Cabral].map(|method| {
        let together = studied.files.are_together(method);
        let of = (material, reflection);
        ExplicitMaps::new(method, of, &soft, together, settings.resolution, steps.reporter())
    });
    let explicit = explicit.into_iter().collect::<Result<Vec<_>, Failure>>()?;
    let made = PairMaps { explicit, shrms, lights_of_parts: OnceCell::new() };
    let mut before = None;
    let (scene, mut measured) = loop {
        let scene = StudyScene::new(lit, material, reflection, sphere, before.as_ref(), &steps)?;
        let measured = scene.exports(lit, material, reflection, &made, settings, &steps)?;
        let is_known = measured.iter().all(|(export, _)| settings.limits.are_known(&export.errors));
        match scene.sphere.lattice().finer() {
            Some(finer) if !is_known => {
                sphere = Sphere::on(finer, settings.sphere);
                before = Some(scene);
            }
            _ => break (scene, measured),
        }
    };
    // To fit maps takes so long that they are measured once, at as many pixels as there is time for.
    for fitted in made.shrms.iter().filter(|maps| maps.are_fitted()) {
        measured.push(scene.shrm(fitted)?);
    }
    measured.sort_by_key(|(export, _)| export.method as usize);
    let mut pictures = Pictures {
        truth: scene.shown(scene.sphere.lattice(), &scene.truth, lit.exposure),
        exports: Vec::new(),
    };
    let mut exports = Vec::new();
    for (export, (lattice, values)) in measured {
        let shown = [&values, &scene.truth].map(|values| scene.shown(lattice, values, lit.exposure));
        pictures.exports.push(shown);
        let file = studied.files.size(export.method, reflection.lamps().is_some());
        exports.push(Export { file, ..export });
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

/// The maps of a pair, which are made once.
struct PairMaps<'a> {
    explicit: Vec<ExplicitMaps<'a>>,
    shrms: Vec<ShrmMaps<'a>>,
    /// What each part of the material reflects of the lamps in the mean over all views.
    lights_of_parts: OnceCell<Vec<MeanLight>>,
}

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

    /// Measures every export but maps that are fitted to lamps; returns each with the radiance that its
    /// readers see and the lattice where that was measured.
    fn exports(
        &self,
        lit: &Lit<'_>,
        material: &Studied<'_>,
        reflection: &Reflection,
        made: &PairMaps<'_>,
        settings: &Settings,
        steps: &Steps<'_>,
    ) -> Result<Vec<(Export, Seen)>, Failure> {
        let mut found = Vec::new();
        for method in Method::ALL {
            steps.step()?;
            let explicit = made.explicit.iter().find(|maps| maps.method() == method);
            let shrm = made.shrms.iter().find(|maps| maps.method() == method && !maps.are_fitted());
            found.push(match (method, material.maps(), explicit, shrm) {
                (Method::Taps, ..) => self.compact(lit, material)?,
                (Method::PartMaps, Some(parts), ..) => {
                    self.part_maps(lit, (material, parts), reflection, &made.lights_of_parts, settings)?
                }
                (_, _, Some(maps), _) => self.explicit(maps)?,
                (.., Some(maps)) => self.shrm(maps)?,
                _ => continue,
            });
        }
        Ok(found)
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
        Reader::of(&self.central, reflection)
    }

    /// Measures a spherical harmonic reflection map, and the radiance that its readers see.
    fn shrm(&self, maps: &ShrmMaps<'_>) -> Result<(Export, Seen), Failure> {
        let (lattice, values) = maps.seen(&self.sphere, self.reporter)?;
        Ok((maps.export(self.errors(&values, lattice), lattice), (lattice, values)))
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
            maps: 1,
            texture: [quantity::count(taps, "tap"), quantity::count(lights, "light")].join(", "),
            one_of: lattice.one_of(),
        };
        Ok((export, (lattice, values)))
    }

    /// Measures a plain map of each part, and the sum of both that readers see.
    fn part_maps(
        &self,
        lit: &Lit<'_>,
        (material, parts): (&Studied<'_>, &[Studied<'static>]),
        reflection: &Reflection,
        known: &OnceCell<Vec<MeanLight>>,
        settings: &Settings,
    ) -> Result<(Export, Seen), Failure> {
        let edge = settings.resolution;
        let cube = Cube { edge };
        let mut values = vec![[0.0_f32; 3]; self.central.len()];
        let (series, lights) = self.light(lit, reflection)?;
        let of_lights = || {
            let disks = material.disks(lights);
            parts.iter().map(|part| part.mean().over(lights, &disks)).collect()
        };
        for (part, light) in parts.iter().zip(known.get_or_init(of_lights)) {
            self.reporter.check_cancelled()?;
            let central = self.sphere.central(part.material.centre());
            let reader = Reader { central: &central, least: 0.0 };
            let field = part.mean().reflect(series, reflection.brdf().f());
            let seen = reader.plain(&field, Some(light), cube)?;
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
                maps: count,
                one_of: lattice.one_of(),
            },
            (lattice, values),
        ))
    }

    /// Measures plain maps, 3D textures or Cabral's maps, and the radiance that their readers see.
    fn explicit(&self, maps: &ExplicitMaps<'_>) -> Result<(Export, Seen), Failure> {
        self.reporter.check_cancelled()?;
        let (lattice, values) = (self.sphere.lattice(), maps.seen(&self.sphere)?);
        Ok((maps.export(self.errors(&values, lattice), lattice), (lattice, values)))
    }

    /// Tries SHRMs that might help, if no export is good or given degrees show: measured until something is
    /// good. First without given degrees, then of a higher P, then with more texels, and in light without
    /// lamps with the highest degrees.
    fn trials(
        &self,
        lit: &Lit<'_>,
        material: &Studied<'_>,
        studied: StudiedReflection<'_>,
        exports: &[Export],
        settings: &Settings,
    ) -> Result<Vec<Trial>, Failure> {
        let (limits, reporter) = (&settings.limits, self.reporter);
        let is_good = |export: &Export| limits.excess(&export.errors) <= 1.0;
        let shows = |export: &Export| export.errors.p95 > RING || export.errors.negative > 0.0;
        // What may be changed are the maps of the reflection.
        let exports: Vec<Export> =
            exports.iter().filter(|export| export.method != Method::Taps).cloned().collect();
        let StudiedReflection { reflection, is_default, files } = studied;
        let cut_shows = !reflection.is_for_light() && best(&exports, limits).is_some_and(shows);
        if exports.iter().any(is_good) && !cut_shows {
            return Ok(Vec::new());
        }
        let (mut tried, mut change) = (Vec::new(), Change::default());
        let by_light = if is_default { None } else { Some(reflection_of(lit, material, None, reporter)?) };
        let reflection = match by_light.as_ref().filter(|by_light| *by_light != reflection) {
            Some(by_light) => {
                change.no_degree = true;
                let studied = StudiedReflection { reflection: by_light, ..studied };
                for maps in shrms(studied, settings.resolution, None, reporter)?.iter().rev() {
                    tried.push(Trial { change, export: self.shrm(maps)?.0 });
                }
                by_light
            }
            None => reflection,
        };
        let nothing_is_good = |tried: &[Trial]| !tried.iter().any(|trial| is_good(&trial.export));
        // The most exact form costs least here.
        let mut form = files.shrm(LampsName::Separate, reflection.lamps().is_some(), settings.resolution);
        // Of what is good in all, the cut in the view may take a part.
        for share in CUT_SHARES.into_iter().filter(|_| reflection.is_for_light()) {
            if !nothing_is_good(&tried) {
                break;
            }
            let accept = limits.stops().map(|stops| (1e3 * share * stops).round() / 1e3);
            let degree = DegreeChoice { accept: Some(Accept(accept)), error: None, most_p: Some(MOST_P) };
            let finer = form.with_degree(degree);
            let [less, more] = [form, finer].map(|form| ShrmMaps::new(&form, reflection, None, reporter));
            let more = more?;
            if more.degrees() != less?.degrees() {
                (change.accept, change.most_p, form) = (Some(accept), Some(MOST_P), finer);
                tried.push(Trial { change, export: self.shrm(&more)?.0 });
            }
        }
        let finer = 2 * settings.resolution;
        if nothing_is_good(&tried) && finer <= crate::values::MAX_RESOLUTION {
            (change.resolution, form) = (Some(finer), form.with_cube(finer));
            let maps = ShrmMaps::new(&form, reflection, None, reporter)?;
            tried.push(Trial { change, export: self.shrm(&maps)?.0 });
        }
        if nothing_is_good(&tried) && reflection.lamps().is_none() {
            let (lighting, brdf) = (&lit.full(reporter)?.series, material.full(reporter)?);
            let p = Degree::new(MOST_P)?;
            let highest = Reflection::convolve(lighting, &brdf.cut_to(Degree::MAX, p));
            let degree = [highest.brdf().f().get(), highest.brdf().p().get()];
            if lit.full(reporter)?.lights.is_empty()
                && (degree[0] > reflection.brdf().f().get() || degree[1] > reflection.brdf().p().get())
            {
                // Degrees that project-brdf names are those of the map.
                let form = form.with_degree(DegreeChoice::default());
                let resolution = change.resolution;
                let change = Change { degree: Some(degree), resolution, ..Change::default() };
                let maps = ShrmMaps::new(&form, &highest, None, reporter)?;
                tried.push(Trial { change, export: self.shrm(&maps)?.0 });
            }
        }
        Ok(tried)
    }
}

/// The spherical harmonic reflection maps of a reflection, as the pipeline exports them, or else as they are
/// exported by default at a resolution of a cube: that with the lamps in it, and that without. `soft` is a
/// map of the reflection without lamps.
fn shrms<'a>(
    studied: StudiedReflection<'a>,
    edge: usize,
    soft: Option<&'a Shrm>,
    reporter: &Reporter,
) -> Result<Vec<ShrmMaps<'a>>, Failure> {
    let has_lamps = studied.reflection.lamps().is_some();
    let forms = [LampsName::Baked, LampsName::Separate].into_iter().take(if has_lamps { 2 } else { 1 });
    let maps = forms.map(|lamps| {
        let settings = studied.files.shrm(lamps, has_lamps, edge);
        ShrmMaps::new(&settings, studied.reflection, soft, reporter)
    });
    maps.collect()
}
