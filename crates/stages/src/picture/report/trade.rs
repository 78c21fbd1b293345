//! Measures what techniques of every size cost for a pair, and how far they are off: the trade of error
//! against bytes and look-ups, as figure 7 of [RH02] has it for spherical harmonic reflection maps.
//!
//! All are compared with the ground truth of the exports, at its pixels.

use brdf::{Centre, Part};
use engine::{Failure, Reporter};
use rayon::prelude::*;
use sh::Degree;
use shrm::components::{ComponentBasis, ComponentError, fit_counts};
use shrm::{Lamps, MOST_P, MapGrid, MeanLobe, Plain, Reflection, Shrm, View};
use sphere::{Cube, Direction};
use taps::AnyTable;

use crate::map::COMPONENT_EDGE;
use crate::picture::report::figures::{Export, Method, Settings, Technique, Trade, TradePoint, TradeSeries};
use crate::picture::report::lit::Lit;
use crate::picture::report::readers::{Reader, add, lamps_seen};
use crate::picture::report::shrm_maps::SeenPixels;
use crate::picture::report::sphere::{Lattice, Sphere};
use crate::picture::report::studied::Studied;
use crate::picture::report::study::StudyScene;
use crate::picture::report::taps_on_sphere::{LIGHT_BYTES, beside_taps, compact_bytes, shown_by_taps};
use crate::picture::report::trade_advice;
use crate::values::UntilStopped;

/// The degrees P of spherical harmonic reflection maps, those of [RH02, fig. 7] and more.
const DEGREES: [usize; 8] = [0, 1, 2, 3, 4, 6, 8, MOST_P];

/// The numbers of components.
const COMPONENTS: [usize; 3] = [4, 8, 16];

/// The number of coefficients of a map with lamps that are fitted for each degree.
const FITTED: usize = 1 << 16;

/// The steps of 1 - cos(theta_v) between the nodes of a directional albedo.
const ALBEDOS: usize = 32;

/// The azimuths of the mean albedo of a material that depends on its tangent.
const AZIMUTHS: usize = 4;

/// The bytes of a texel of four halves.
const HALVES: usize = 8;

/// What is made of a material once, for all environments.
pub(crate) struct Traded {
    /// The components; none of a material about the tangent.
    basis: Option<ComponentBasis>,
    /// The split sum of each part; none of a material about the tangent.
    split: Vec<SplitPart>,
}

impl Traded {
    pub(crate) fn new(material: &Studied<'_>, reporter: &Reporter) -> Result<Self, Failure> {
        let of = &*material.material;
        if of.centre() == Centre::Tangent {
            return Ok(Self { basis: None, split: Vec::new() });
        }
        reporter.check_cancelled()?;
        let basis = Some(ComponentBasis::of(of).map_err(ComponentError::from)?);
        reporter.check_cancelled()?;
        let split = match [Part::Diffuse, Part::Specular].map(|part| of.part(part)) {
            [Some(diffuse), Some(specular)] => vec![SplitPart::new(&diffuse), SplitPart::new(&specular)],
            _ => vec![SplitPart::new(of)],
        };
        Ok(Self { basis, split })
    }
}

/// A part of a material as the split sum of engines has it.
struct SplitPart {
    centre: Centre,
    /// The lobe that is seen head on.
    lobe: MeanLobe,
    /// The directional albedo as a share of the one head on, RGB, at even steps of 1 - cos(theta_v).
    albedos: Vec<[f64; 3]>,
}

impl SplitPart {
    fn new(part: &brdf::Material) -> Self {
        let azimuths = if part.is_isotropic() { 1 } else { AZIMUTHS };
        let albedo = |node: usize| {
            // The last is not quite the horizon, where materials are singular.
            let theta = math::acos((1.0 - node as f64 / ALBEDOS as f64).max(1e-3));
            let mut mean = [0.0; 3];
            for turn in 0..azimuths {
                let phi = std::f64::consts::PI * (turn as f64 + 0.5) / AZIMUTHS as f64;
                let found = brdf::albedo(part, Direction::from_angles(theta, phi));
                (0..3).for_each(|channel| mean[channel] += found[channel] / azimuths as f64);
            }
            mean
        };
        let mut albedos: Vec<[f64; 3]> = (0..=ALBEDOS).into_par_iter().map(albedo).collect();
        let first = albedos[0];
        let share = |value: f64, first: f64| if first > 0.0 { value / first } else { 0.0 };
        for albedo in &mut albedos {
            *albedo = std::array::from_fn(|channel| share(albedo[channel], first[channel]));
        }
        Self { centre: part.centre(), lobe: MeanLobe::plain(part, Plain::HeadOn), albedos }
    }

    fn albedo(&self, cosine: f64) -> [f64; 3] {
        let place = (1.0 - cosine).clamp(0.0, 1.0) * ALBEDOS as f64;
        let node = (place as usize).min(ALBEDOS - 1);
        let [a, b] = [self.albedos[node], self.albedos[node + 1]];
        std::array::from_fn(|channel| a[channel] + (place - node as f64) * (b[channel] - a[channel]))
    }
}

/// A pair, and what the exports left of it.
pub(crate) struct TradePair<'a> {
    pub(crate) lit: &'a Lit<'a>,
    pub(crate) material: &'a Studied<'a>,
    pub(crate) traded: &'a Traded,
    pub(crate) reflection: &'a Reflection,
    pub(crate) scene: &'a StudyScene<'a>,
    /// The map of the reflection without lamps.
    pub(crate) soft: &'a Shrm,
    /// The exports that were measured.
    pub(crate) exports: &'a [Export],
    pub(crate) settings: &'a Settings,
}

impl TradePair<'_> {
    /// Measures every technique at every degree.
    pub(crate) fn measure(&self) -> Result<Trade, Failure> {
        let mut series = Vec::new();
        for (method, technique, fetches) in
            [(Method::ReflectionMap, Technique::ReflectionMap, 1), (Method::PartMaps, Technique::PartMaps, 1)]
        {
            series.extend(self.exported(method, technique, fetches));
        }
        series.extend(self.split_sum()?);
        // Linear between two slices; three of twelve views.
        for (method, technique, fetches) in
            [(Method::KautzMccool, Technique::KautzMccool, 2), (Method::Cabral, Technique::Cabral, 3)]
        {
            series.extend(self.exported(method, technique, fetches));
        }
        let lamps = self.reflection.lamps().map(|lamps| lamps_seen(&self.scene.central, lamps));
        series.extend(self.harmonics(lamps.as_deref())?);
        series.extend(self.components(lamps.as_deref())?);
        series.extend(self.taps()?);
        let advice = trade_advice::of_series(&series);
        Ok(Trade { series, advice })
    }

    /// An export of one degree, as it was measured.
    fn exported(&self, method: Method, technique: Technique, fetches: usize) -> Option<TradeSeries> {
        let export = self.export(method)?;
        Some(TradeSeries { technique, lights: 0, points: vec![of_export(export, export.maps * fetches)] })
    }

    fn export(&self, method: Method) -> Option<&Export> {
        self.exports.iter().find(|export| export.method == method)
    }

    /// The figures of values at every pixel of the scene.
    fn point(&self, values: &[[f32; 3]], degree: usize, bytes: usize, fetches: usize) -> TradePoint {
        self.point_on(self.scene.sphere.lattice(), values, degree, bytes, fetches)
    }

    fn point_on(
        &self,
        lattice: Lattice,
        values: &[[f32; 3]],
        degree: usize,
        bytes: usize,
        fetches: usize,
    ) -> TradePoint {
        TradePoint {
            degree: Some(degree),
            errors: self.scene.errors(values, lattice),
            bytes: bytes as u64,
            fetches,
            one_of: lattice.one_of(),
        }
    }

    /// The split sum of engines: the light as the lobe that is seen head on blurs it, times the directional
    /// albedo toward the view. All light is in the prefiltered cube.
    fn split_sum(&self) -> Result<Option<TradeSeries>, Failure> {
        let (scene, edge) = (self.scene, self.settings.resolution);
        if self.traded.split.is_empty() {
            return Ok(None);
        }
        let (series, lights) = self.scene.light(self.lit, self.reflection)?;
        let normals = scene.sphere.central(Centre::Normal);
        let mut values = vec![[0.0_f32; 3]; scene.central.len()];
        for part in &self.traded.split {
            scene.reporter.check_cancelled()?;
            let central = scene.sphere.central(part.centre);
            let reader = Reader { central: &central, least: 0.0 };
            let field = part.lobe.reflect(series, self.reflection.brdf().f());
            let seen = reader.plain(&field, Some(&part.lobe.of(lights)), Cube { edge })?;
            for ((value, seen), normal) in values.iter_mut().zip(seen).zip(&normals) {
                let albedo = part.albedo(normal.dot(Sphere::view()));
                (0..3).for_each(|channel| value[channel] += seen[channel] * albedo[channel] as f32);
            }
        }
        // A cube with all its mips, of which two are looked up; one of a matte part needs no mips.
        let mips = std::iter::successors(Some(edge), |edge| (*edge > 1).then_some(edge / 2));
        let texels: usize = mips.map(|edge| Cube { edge }.len()).sum();
        let is_glossy = |part: &&SplitPart| part.centre == Centre::Reflection;
        let glossy = self.traded.split.iter().filter(is_glossy).count();
        let matte = self.traded.split.len() - glossy;
        let bytes = HALVES * (glossy * texels + matte * Cube { edge }.len());
        let point = TradePoint { degree: None, ..self.point(&values, 0, bytes, 2 * glossy + matte) };
        Ok(Some(TradeSeries { technique: Technique::SplitSum, lights: 0, points: vec![point] }))
    }

    /// Spherical harmonic reflection maps of more and more degrees; in light with lamps with these in the map
    /// and beside it, with this radiance at each pixel.
    fn harmonics(&self, beside: Option<&[[f64; 3]]>) -> Result<Vec<TradeSeries>, Failure> {
        let (scene, reflection) = (self.scene, self.reflection);
        let (f, full) = (reflection.brdf().f(), self.material.full(scene.reporter)?);
        let most = Degree::new(MOST_P)?.min(Degree::new(full.highest().0)?);
        let degrees = || DEGREES.into_iter().filter(|p| *p <= most.get());
        let own;
        let whole = if self.soft.p() == most {
            self.soft
        } else {
            let grid = MapGrid::Cube(Cube { edge: self.settings.resolution });
            let reflection = Reflection::convolve(reflection.lighting(), &full.cut_to(f, most));
            own = scene.reporter.until_stopped(|stop| reflection.synthesise(grid, View::Local, stop))?;
            &own
        };
        let lamps = reflection.lamps();
        let lights = lamps.map_or(0, |lamps| lamps.lights.len());
        let reader = scene.reader(reflection);
        let mut points = Vec::new();
        for p in degrees() {
            scene.reporter.check_cancelled()?;
            let map = whole.cut(Degree::new(p)?);
            let mut values = reader.shrm(&map);
            if let Some(beside) = beside {
                add(&mut values, beside);
            }
            let bytes = HALVES * map.rows() * map.grid().len() + LIGHT_BYTES * lights;
            points.push(self.point(&values, p, bytes, map.rows()));
        }
        if lamps.is_none() {
            return Ok(vec![TradeSeries { technique: Technique::Shrm, lights: 0, points }]);
        }
        let separate = TradeSeries { technique: Technique::ShrmSeparate, lights, points };
        let mut points = Vec::new();
        for p in degrees() {
            let pixels = SeenPixels { sphere: &scene.sphere, central: &scene.central };
            let (map, lattice) = pixels.fitted(reflection, self.soft, p, FITTED, scene.reporter)?;
            let values = reader.shrm(&map);
            let bytes = HALVES * map.rows() * map.grid().len();
            points.push(self.point_on(lattice, &values, p, bytes, map.rows()));
        }
        Ok(vec![TradeSeries { technique: Technique::Shrm, lights: 0, points }, separate])
    }

    /// Principal components, with the lamps beside them, of this radiance at each pixel.
    fn components(&self, beside: Option<&[[f64; 3]]>) -> Result<Option<TradeSeries>, Failure> {
        // A black material has none.
        let basis = self.traded.basis.as_ref().filter(|basis| !basis.components().is_empty());
        let Some(basis) = basis else { return Ok(None) };
        let (scene, edge) = (self.scene, COMPONENT_EDGE);
        let known;
        let reflection = match self.reflection.material() {
            Some(material) if *material == *self.material.material => self.reflection,
            _ => {
                let lights = self.reflection.lamps().map(|lamps| lamps.lights.clone()).unwrap_or_default();
                let material = self.material.material.clone().into_owned();
                known = self.reflection.clone().with_lamps(Lamps { lights, material });
                &known
            }
        };
        let most = basis.components().len();
        let mut counts: Vec<usize> = COMPONENTS.into_iter().map(|count| count.min(most)).collect();
        counts.dedup();
        let maps = scene.reporter.until_stopped(|stop| {
            fit_counts(reflection, basis, edge, &counts, stop).map_err(Failure::from)
        })?;
        let lamps = reflection.lamps();
        let lights = lamps.map_or(0, |lamps| lamps.lights.len());
        let view = Sphere::view();
        let mut points = Vec::new();
        for (map, count) in maps.iter().zip(counts) {
            let look = |central: &Direction| map.radiance(*central, view).map(|value| value as f32);
            let mut values: Vec<[f32; 3]> = scene.central.par_iter().map(look).collect();
            if let Some(beside) = beside {
                add(&mut values, beside);
            }
            let bytes = HALVES * count * 6 * (edge + 2) * (edge + 2) + LIGHT_BYTES * lights;
            // Four functions of the view are one texel.
            points.push(self.point(&values, count, bytes, count + count.div_ceil(4)));
        }
        Ok(Some(TradeSeries { technique: Technique::Components, lights, points }))
    }

    /// Taps, with more and more lights beside the scale space.
    fn taps(&self) -> Result<Vec<TradeSeries>, Failure> {
        let (scene, material) = (self.scene, &*self.material.material);
        let mut tables = self.material.tables(scene.reporter)?;
        tables.sort_by_key(AnyTable::taps);
        let mut beside = vec![[0.0; 3]; scene.central.len()];
        let mut kept = 0;
        let mut series = Vec::new();
        for space in self.lit.spaces(scene.reporter)? {
            scene.reporter.check_cancelled()?;
            let lights = space.lights();
            let more = beside_taps(&scene.sphere, &lights[kept..], material);
            beside.par_iter_mut().zip(more).for_each(|(beside, more)| {
                (0..3).for_each(|channel| beside[channel] += more[channel]);
            });
            kept = lights.len();
            let point = |table: &AnyTable<'_>| {
                let values = shown_by_taps(&scene.sphere, *table, space, &beside);
                let fetches = 2 * (table.taps() + table.normals());
                self.point(&values, table.taps(), compact_bytes(space, *table), fetches)
            };
            let points = tables.iter().map(point).collect();
            series.push(TradeSeries { technique: Technique::Taps, lights: kept, points });
        }
        Ok(series)
    }
}

/// An export of one degree as a point of a series.
fn of_export(export: &Export, fetches: usize) -> TradePoint {
    TradePoint { degree: None, errors: export.errors, bytes: export.bytes, fetches, one_of: export.one_of }
}
