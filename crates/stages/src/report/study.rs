//! Measures pairs of a material and an environment: calls the kernels and fills the figures.

use std::borrow::Cow;
use std::cell::OnceCell;

use brdf::{BrdfCoefficients, Choice, Part, project_unless};
use engine::{Context, Failure};
use envmap::{Environment, ToneMap, to_srgb8};
use rayon::prelude::*;
use sh::{Degree, Lighting};
use shrm::MOST_P;
use shrm::degrees::DARK;
use shrm::reference::LightTree;
use shrm::{Cabral, KautzMcCool, Lamps, MapGrid, Plain, Reflection, Shrm, Terms, View};
use sphere::{Cube, Direction, LatLong};

use crate::report::advice::{self, best};
use crate::report::figures::{Change, Export, Method, PairFigures, Settings, Trial};
use crate::report::page::Pictures;
use crate::report::sphere::{Lattice, Sphere};
use crate::{export_reflection_map, project_sh};

/// The angles of a Kautz-McCool texture, as `export-kautz-mccool` has them by default.
const SLICES: usize = 16;

/// Bytes of a light: direction, radius and irradiance as seven 32-bit numbers.
const LIGHT_BYTES: usize = 28;

/// Errors in stops of 95 of 100 samples above this show a ring beside a highlight.
const RING: f64 = 0.1;

/// Coefficients of a map with lamps that are fitted for one view: about half a second of one core.
const FITTED: usize = 1 << 18;

/// Pixels between two checks for cancellation.
const BAND: usize = 512;

/// The error of the ground truth: about 0.01 stops.
const TRUTH: f64 = 0.005;

/// An environment, and what is made from it once.
pub(crate) struct Lit<'a> {
    pub(crate) name: String,
    pub(crate) environment: &'a Environment,
    /// Stops.
    exposure: f64,
    tree: LightTree,
    /// The radiance below which black is black.
    dark: f64,
    full: OnceCell<Lighting>,
}

impl<'a> Lit<'a> {
    pub(crate) fn new(name: String, environment: &'a Environment, exposure: f64) -> Self {
        let tree = LightTree::new(environment);
        // Over the sphere and the three channels.
        let mean = environment.integral().iter().sum::<f64>() / (12.0 * std::f64::consts::PI);
        Self { name, environment, exposure, tree, dark: DARK * mean, full: OnceCell::new() }
    }

    /// The lighting that `project-sh` makes by default.
    fn full(&self) -> Result<&Lighting, Failure> {
        if let Some(full) = self.full.get() {
            return Ok(full);
        }
        let made = project_sh::full(self.environment)?;
        Ok(self.full.get_or_init(|| made))
    }
}

/// A material, and what is made from it once.
pub(crate) struct Studied<'a> {
    pub(crate) name: String,
    pub(crate) material: Cow<'a, brdf::Material>,
    /// The diffuse and the specular part, of a material that has both.
    parts: OnceCell<Option<Box<[Studied<'static>; 2]>>>,
    full: OnceCell<BrdfCoefficients>,
    /// Of degrees that the report's parameters give.
    given: OnceCell<BrdfCoefficients>,
}

impl<'a> Studied<'a> {
    pub(crate) fn new(name: String, material: Cow<'a, brdf::Material>) -> Self {
        Self { name, material, parts: OnceCell::new(), full: OnceCell::new(), given: OnceCell::new() }
    }

    /// The diffuse and the specular part, of a material that has both.
    fn parts(&self) -> Option<&[Studied<'static>; 2]> {
        let part = |part| Some(Studied::new(self.name.clone(), Cow::Owned(self.material.part(part)?)));
        let parts = || Some(Box::new([part(Part::Diffuse)?, part(Part::Specular)?]));
        self.parts.get_or_init(parts).as_deref()
    }

    /// The coefficients that `project-brdf` makes by default.
    fn full(&self, context: &Context<'_>) -> Result<&BrdfCoefficients, Failure> {
        projected(&self.full, &self.material, Choice::Full, context)
    }
}

fn projected<'a>(
    cell: &'a OnceCell<BrdfCoefficients>,
    material: &brdf::Material,
    choice: Choice,
    context: &Context<'_>,
) -> Result<&'a BrdfCoefficients, Failure> {
    if let Some(made) = cell.get() {
        return Ok(made);
    }
    let made = project_unless(material, choice, &|| context.check_cancelled().is_err());
    context.check_cancelled()?;
    let made = made?.coefficients;
    Ok(cell.get_or_init(|| made))
}

/// The reflection of a pair as the stages make it by default, or with these degrees.
pub(crate) fn reflection(
    lit: &Lit<'_>,
    material: &Studied<'_>,
    choice: Option<Choice>,
    context: &Context<'_>,
) -> Result<Reflection, Failure> {
    Ok(match choice {
        None => {
            let stop = || context.check_cancelled().is_err();
            let full = (lit.full()?, material.full(context)?);
            let found = Reflection::for_light_unless(full.0, full.1, &material.material, &stop);
            found.ok_or_else(Failure::cancelled)?.0
        }
        Some(choice) => {
            let brdf = projected(&material.given, &material.material, choice, context)?;
            Reflection::convolve(&lit.full()?.whole(), brdf)
        }
    })
}

/// The reflection of a part of a material, cut as that of the whole.
fn of_part(
    lit: &Lit<'_>,
    part: &Studied<'_>,
    whole: &BrdfCoefficients,
    context: &Context<'_>,
) -> Result<Reflection, Failure> {
    let (light, brdf) = (lit.full()?, part.full(context)?.cut_to(whole.f(), whole.p()));
    let field = Reflection::convolve(&light.series.to_degree(brdf.f()), &brdf).marked_for_light();
    Ok(if light.lights.is_empty() {
        field
    } else {
        field.with_lamps(Lamps { lights: light.lights.clone(), material: part.material.clone().into_owned() })
    })
}

/// Renders a material under an environment in every way. `is_default` says that `reflection` is what the
/// stages make by default.
pub(crate) fn pair(
    lit: &Lit<'_>,
    material: &Studied<'_>,
    (reflection, is_default): (&Reflection, bool),
    settings: &Settings,
    context: &Context<'_>,
) -> Result<(PairFigures, Pictures), Failure> {
    let scene = Scene::new(lit, material, reflection, settings, context)?;
    let soft = scene.soft(reflection, settings.resolution)?;
    let mut pictures = Pictures { truth: scene.shown(&scene.truth, lit.exposure), exports: Vec::new() };
    let mut exports = Vec::new();
    for method in Method::ALL {
        if method == Method::ShrmSeparate && reflection.lamps().is_none() {
            continue;
        }
        let made = match (method, material.parts()) {
            (Method::PartMaps, None) => continue,
            (Method::PartMaps, Some(parts)) => scene.part_maps(lit, parts, reflection, settings)?,
            _ => scene.measure(method, reflection, &soft, settings.resolution)?,
        };
        let (export, values) = made;
        let lattice = Lattice { step: export.step };
        pictures.exports.push(scene.shown_on(lattice, &values, lit.exposure));
        exports.push(export);
    }
    let tried = scene.trials(lit, material, (reflection, is_default), &exports, settings)?;
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
    };
    Ok((figures, pictures))
}

/// A sphere under one light, with its ground truth.
struct Scene<'a> {
    sphere: Sphere,
    central: Vec<Direction>,
    truth: Vec<[f32; 3]>,
    dark: f64,
    context: &'a Context<'a>,
}

impl<'a> Scene<'a> {
    fn new(
        lit: &Lit<'_>,
        material: &Studied<'_>,
        reflection: &Reflection,
        settings: &Settings,
        context: &'a Context<'a>,
    ) -> Result<Self, Failure> {
        let sphere = Sphere::new(settings.sphere);
        let central = sphere.central(reflection.brdf().centre());
        let (tree, material, view) = (&lit.tree, &material.material, Sphere::view());
        let (dark, mut truth) = (lit.dark, vec![[0.0_f32; 3]; central.len()]);
        for (pixels, central) in truth.chunks_mut(BAND).zip(central.chunks(BAND)) {
            context.check_cancelled()?;
            let radiance = |central: &Direction| {
                tree.radiance(material, *central, view, TRUTH, dark).map(|value| value as f32)
            };
            pixels.par_iter_mut().zip(central).for_each(|(pixel, central)| *pixel = radiance(central));
        }
        Ok(Self { sphere, central, truth, dark, context })
    }

    /// A picture of values.
    fn shown(&self, values: &[[f32; 3]], exposure: f64) -> Vec<[u8; 3]> {
        self.sphere.picture(&to_srgb8(values, exposure, ToneMap::Filmic))
    }

    /// The same, and the ground truth, as mosaics of the pixels that were measured.
    fn shown_on(&self, lattice: Lattice, values: &[[f32; 3]], exposure: f64) -> [Vec<[u8; 3]>; 2] {
        [values, &self.truth].map(|values| self.shown(&self.sphere.mosaic(lattice, values), exposure))
    }

    /// What each pixel sees.
    fn look(&self, of: impl Fn(Direction) -> [f32; 3] + Sync) -> Vec<[f32; 3]> {
        self.central.par_iter().map(|central| of(*central)).collect()
    }

    /// The map without lamps.
    fn soft(&self, reflection: &Reflection, edge: usize) -> Result<Shrm, Failure> {
        self.context.check_cancelled()?;
        Ok(reflection.synthesise(MapGrid::Cube(Cube { edge }), View::Local)?)
    }

    /// What the readers of a plain map see, who look it up by these directions.
    fn plain(
        &self,
        reflection: &Reflection,
        central: &[Direction],
        grid: MapGrid,
    ) -> Result<Vec<[f32; 3]>, Failure> {
        let texels = export_reflection_map::texels(reflection, Plain::Mean, grid)?;
        let look = |central: &Direction| grid.taps(*central).blend(&texels).map(|value| value as f32);
        Ok(central.par_iter().map(look).collect())
    }

    /// A plain map of each part, and what readers see who add both.
    fn part_maps(
        &self,
        lit: &Lit<'_>,
        parts: &[Studied<'static>],
        reflection: &Reflection,
        settings: &Settings,
    ) -> Result<(Export, Vec<[f32; 3]>), Failure> {
        let edge = settings.resolution;
        let grid = MapGrid::Cube(Cube { edge });
        let mut values = vec![[0.0_f32; 3]; self.central.len()];
        for part in parts {
            self.context.check_cancelled()?;
            let part_reflection = of_part(lit, part, reflection.brdf(), self.context)?;
            let seen = self.plain(&part_reflection, &self.sphere.central(part.material.centre()), grid)?;
            for (value, seen) in values.iter_mut().zip(seen) {
                (0..3).for_each(|channel| value[channel] += seen[channel]);
            }
        }
        let errors = self.sphere.errors(&values, &self.truth, self.dark, Lattice::ALL);
        let (count, texture) = (parts.len(), format!("{} × 6 faces of {edge} × {edge}", parts.len()));
        let bytes = (8 * count * grid.len()) as u64;
        Ok((
            Export {
                method: Method::PartMaps,
                errors,
                f: reflection.brdf().f().get(),
                p: 0,
                bytes,
                texture,
                step: 1,
            },
            values,
        ))
    }

    /// One export, and what its readers see; `soft` is the reflection's map without lamps.
    fn measure(
        &self,
        method: Method,
        reflection: &Reflection,
        soft: &Shrm,
        edge: usize,
    ) -> Result<(Export, Vec<[f32; 3]>), Failure> {
        self.context.check_cancelled()?;
        let (view, lamps) = (Sphere::view(), reflection.lamps());
        let grid = MapGrid::Cube(Cube { edge });
        let faces = format!("6 faces of {edge} × {edge}");
        let of_map = |map: &Shrm| {
            let terms = map.rows();
            let unit = if terms == 1 { "coefficient" } else { "coefficients" };
            (8 * terms * grid.len(), format!("{terms} {unit} × {faces}"))
        };
        let (mut p, mut lattice) = (reflection.brdf().p().get(), Lattice::ALL);
        let (values, (bytes, texture)) = match method {
            Method::ReflectionMap | Method::PartMaps => {
                p = 0;
                (self.plain(reflection, &self.central, grid)?, (8 * grid.len(), faces))
            }
            Method::KautzMccool => {
                // Slices of a 3D texture are lat-long images, as dense at the equator as the cubes.
                let rows = LatLong::with_rows(2 * edge);
                let texture = kautz_mccool(reflection, rows)?;
                let size = format!("{SLICES} angles × {} × {}", rows.width, rows.height);
                (self.look(|c| texture.radiance(c, view)), (8 * SLICES * rows.len(), size))
            }
            Method::Cabral => {
                let maps = Cabral::from_shrm(soft);
                let maps = if let Some(lamps) = lamps { maps.with_lamps(lamps) } else { maps };
                let maps = Cabral::new(grid, maps.centre(), finished(reflection, maps.maps()))
                    .ok_or_else(|| Failure::new("Cabral's maps have a texel"))?;
                (self.look(|c| maps.radiance(c, view)), (8 * 12 * grid.len(), format!("12 views × {faces}")))
            }
            Method::Shrm if lamps.is_some() => {
                let (map, measured) = self.baked(reflection, soft)?;
                (lattice, p) = (measured, map.p().get());
                (self.look(|c| map.radiance(c, view)), of_map(&map))
            }
            Method::Shrm => (self.look(|c| soft.radiance(c, view)), of_map(soft)),
            Method::ShrmSeparate => {
                let lit = |central| lamps.map_or([0.0; 3], |lamps| lamps.radiance(central, view));
                let values = self.look(|central| {
                    let (soft, lit) = (soft.radiance(central, view), lit(central));
                    std::array::from_fn(|channel| soft[channel] + lit[channel] as f32)
                });
                let count = lamps.map_or(0, |lamps| lamps.lights.len());
                let (bytes, texture) = of_map(soft);
                let unit = if count == 1 { "light" } else { "lights" };
                (values, (bytes + LIGHT_BYTES * count, format!("{texture}, {count} {unit}")))
            }
        };
        let export = Export {
            method,
            errors: self.sphere.errors(&values, &self.truth, self.dark, lattice),
            f: reflection.brdf().f().get(),
            p,
            bytes: bytes as u64,
            texture,
            step: lattice.step,
        };
        Ok((export, values))
    }

    /// The map with lamps in it, as far as a lattice of pixels sees it: a texel takes some tenths of a
    /// millisecond.
    fn baked(&self, reflection: &Reflection, soft: &Shrm) -> Result<(Shrm, Lattice), Failure> {
        let p = soft.p().get().max(MOST_P);
        let rows = match (soft.p().get(), soft.terms()) {
            (0, _) => 0,
            (_, Terms::Zonal) => p + 1,
            (_, Terms::All) => (p + 1) * (p + 1),
        };
        let step = if soft.grid().len() * rows <= FITTED {
            1
        } else {
            // Each pixel sees four texels.
            ((4 * self.central.len() * rows) as f64 / FITTED as f64).sqrt().ceil().max(1.0) as usize
        };
        let lattice = Lattice { step };
        let mut seen: Vec<usize> = (self.central.iter().zip(self.sphere.within(lattice)))
            .filter(|(_, seen)| *seen)
            .flat_map(|(central, _)| soft.grid().taps(*central).index)
            .collect();
        seen.sort_unstable();
        seen.dedup();
        let cancelled = || self.context.check_cancelled().is_err();
        let map = reflection.bake_texels(soft, &seen, &cancelled)?;
        self.context.check_cancelled()?;
        Ok((map, lattice))
    }

    /// What else might help, if no export is good or given degrees show: measured until something is good.
    /// First without given degrees, then with more texels, and in light without lamps with the highest
    /// degrees.
    fn trials(
        &self,
        lit: &Lit<'_>,
        material: &Studied<'_>,
        (reflection, is_default): (&Reflection, bool),
        exports: &[Export],
        settings: &Settings,
    ) -> Result<Vec<Trial>, Failure> {
        let limits = &settings.limits;
        let is_good = |export: &Export| limits.excess(&export.errors) <= 1.0;
        let shows = |export: &Export| export.errors.p95 > RING || export.errors.negative > 0.0;
        let cut_shows = !reflection.is_for_light() && best(exports, limits).is_some_and(shows);
        if exports.iter().any(is_good) && !cut_shows {
            return Ok(Vec::new());
        }
        let (mut tried, mut change) = (Vec::new(), Change::default());
        let by_light =
            if is_default { None } else { Some(self::reflection(lit, material, None, self.context)?) };
        let reflection = match by_light.as_ref().filter(|by_light| *by_light != reflection) {
            Some(by_light) => {
                change.no_degree = true;
                let soft = self.soft(by_light, settings.resolution)?;
                for method in shrms(by_light) {
                    let (export, _) = self.measure(*method, by_light, &soft, settings.resolution)?;
                    tried.push(Trial { change, export });
                }
                by_light
            }
            None => reflection,
        };
        // The most exact form costs least here.
        let method = shrms(reflection)[0];
        let finer = 2 * settings.resolution;
        if !tried.iter().any(|trial| is_good(&trial.export)) && finer <= crate::choices::MOST {
            change.resolution = Some(finer);
            let soft = self.soft(reflection, finer)?;
            let (export, _) = self.measure(method, reflection, &soft, finer)?;
            tried.push(Trial { change, export });
        }
        if !tried.iter().any(|trial| is_good(&trial.export)) && reflection.lamps().is_none() {
            let (lighting, brdf) = (&lit.full()?.series, material.full(self.context)?);
            let p = Degree::new(MOST_P)?;
            let highest = Reflection::convolve(lighting, &brdf.cut_to(Degree::MAX, p));
            let degree = [highest.brdf().f().get(), highest.brdf().p().get()];
            if lit.full()?.lights.is_empty()
                && (degree[0] > reflection.brdf().f().get() || degree[1] > reflection.brdf().p().get())
            {
                let edge = change.resolution.unwrap_or(settings.resolution);
                let change = Change { no_degree: false, degree: Some(degree), ..change };
                let soft = self.soft(&highest, edge)?;
                let (export, _) = self.measure(Method::Shrm, &highest, &soft, edge)?;
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

/// The 3D texture of a reflection. It holds the terms without azimuth alone, so only they are synthesised.
fn kautz_mccool(reflection: &Reflection, grid: LatLong) -> Result<KautzMcCool, Failure> {
    let brdf = reflection.brdf();
    let side = brdf.p().get() + 1;
    let without_azimuth = |(index, rho): (usize, &[f64; 3])| if index % side == 0 { *rho } else { [0.0; 3] };
    let rho = brdf.rho().iter().enumerate().map(without_azimuth).collect();
    let zonal = BrdfCoefficients::new(brdf.centre(), brdf.f(), brdf.p(), rho).unwrap_or_else(|| brdf.clone());
    let map = Reflection::convolve(reflection.lighting(), &zonal)
        .synthesise(MapGrid::LatLong(grid), View::Local)?;
    debug_assert_eq!(map.terms(), Terms::Zonal);
    let too_few = || Failure::new("a 3D texture needs at least 2 angles");
    let texture = KautzMcCool::from_shrm(&map, KautzMcCool::even_angles(SLICES)).ok_or_else(too_few)?;
    let texture = match reflection.lamps() {
        Some(lamps) => texture.with_lamps(lamps),
        None => texture,
    };
    let slices = finished(reflection, texture.slices());
    KautzMcCool::new(texture.grid(), texture.centre(), texture.angles().to_vec(), slices).ok_or_else(too_few)
}

/// Pixels as the exports write them: see `map_source.rs`.
fn finished(reflection: &Reflection, pixels: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let least = if reflection.is_for_light() { 0.0 } else { f32::MIN };
    pixels.iter().map(|pixel| pixel.map(|value| value.max(least))).collect()
}
