//! The degree P of a map: the least at which it is as near to its field as it has to be.
//!
//! A field keeps so many degrees P that no export shows the cut ([`crate::degrees`]). A map of (P + 1)^2
//! coefficients costs memory for each of them, so that it takes the least P that is enough, by a
//! [`DegreeRule`].
//!
//! The errors are measured at views as a ball shows them to a distant camera. A map without lamps is the cut
//! series, and the lamps that a renderer adds are beside both; a map with lamps in it is fitted at some
//! texels, for each P that is tried ([`Reflection::bake`]).

use rayon::prelude::*;
use sh::{Basis, Degree, Stop, Stopped, rotate_orders};
use sphere::{Cube, Direction, spiral};

use crate::degree_rule::{DegreeRule, MapDegree, rms_of_cuts};
use crate::degrees::{BLACK_SHARE, SAMPLES, add, seen};
use crate::lamps::in_frame;
use crate::{LampTables, MapGrid, Reflection, Shrm, SynthesisError, Terms, View, frame, stops};

/// The edge of the cube at whose texels maps with lamps in them are tried: as many as [`SAMPLES`] has.
const EDGE: usize = 4;

/// The share of a fit's errors that the cut of the field may have to which it is fitted. On the fit it has
/// less effect: there it is taken in the mean over many views.
const FIELD_SHARE: f64 = 0.4;

/// What a map is to hold, and what is seen with it.
#[derive(Clone, Copy)]
pub struct MapContent<'a> {
    /// Whether the lamps are in the map, and not beside it.
    pub lamps: bool,
    /// The field of the material's diffuse part, if the map is of its specular part: a renderer adds both.
    pub base: Option<&'a Reflection>,
}

/// A view of a sample: its central direction, the view in that direction's frame, and the radiance.
struct Sample {
    outgoing: Direction,
    /// What is seen beside the map.
    beside: [f64; 3],
    /// The radiance that the map should give.
    right: [f64; 3],
    /// The field cut at each P.
    cuts: Vec<[f64; 3]>,
}

/// The coefficients of a texel, and samples of it.
type SampledTexel = (Vec<[f64; 3]>, Vec<Sample>);

impl Reflection {
    /// Returns the field cut at a lower degree in the view, with its lamps; it has no parts.
    #[must_use]
    pub fn cut_in_view(&self, p: Degree) -> Self {
        let cut = Self::convolve(self.lighting(), &self.brdf().cut_to(Degree::MAX, p));
        let cut = if self.is_for_light() { cut.marked_for_light() } else { cut };
        match self.every_lamp() {
            Some(lamps) => cut.with_lamps(lamps.clone()),
            None => cut,
        }
    }

    /// The share of the energy, over all central directions and views, that changes with the view, as p > 0
    /// does; 0 for a black field.
    pub fn view_dependent_share(&self) -> f64 {
        rms_of_cuts(self.lighting(), self.brdf()).first().map_or(0.0, |rms| rms * rms)
    }

    /// The degree P of a map of this field by a rule, and its errors compared with the field: see the
    /// module's text. `stop` is asked every few milliseconds, on every thread.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn map_degree(
        &self,
        content: MapContent<'_>,
        rule: DegreeRule,
        tables: &mut LampTables,
        stop: Stop<'_>,
    ) -> Result<MapDegree, SynthesisError> {
        let p = self.brdf().p();
        let most = MapDegree { p, p95: 0.0, p99: 0.0, rms: 0.0, is_met: true, enough: None, field: p };
        if !(content.lamps && self.lamps().is_some()) {
            return Ok(rule.choose(&self.cuts(content, stop)?).unwrap_or(most));
        }
        let (soft, samples) = self.sampled_map(content, stop)?;
        let chosen = rule.choose(&self.fits(&soft, &samples, rule, tables, stop)?).unwrap_or(most);
        Ok(MapDegree { field: self.fitted_field(&chosen, &samples), ..chosen })
    }

    /// The errors of a map with the lamps in it at a degree that is given, compared with the field, and
    /// whether they meet the rule's tolerance.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn baked_error(
        &self,
        content: MapContent<'_>,
        p: Degree,
        rule: DegreeRule,
        tables: &mut LampTables,
        stop: Stop<'_>,
    ) -> Result<MapDegree, SynthesisError> {
        let (soft, samples) = self.sampled_map(content, stop)?;
        let found = self.fit(&soft, p, &samples, tables, stop)?;
        let is_met = rule.tolerance.excess([found.p95, found.p99], found.rms) <= 1.0;
        Ok(MapDegree { is_met, field: self.fitted_field(&found, &samples), ..found })
    }

    /// The errors of the field cut at each P, from 0 on.
    fn cuts(&self, content: MapContent<'_>, stop: Stop<'_>) -> Result<Vec<MapDegree>, Stopped> {
        let sampled = self.map_samples(content, |index| spiral(index, SAMPLES[0]), SAMPLES[0], stop)?;
        let samples = sampled.into_iter().flat_map(|(_, samples)| samples).collect::<Vec<_>>();
        let dark = BLACK_SHARE * self.light_mean();
        let rms = rms_of_cuts(self.lighting(), self.brdf());
        let measure = |(p, rms): (usize, &f64)| {
            let [p95, p99] = quantiles(&samples, dark, |_, sample| sample.cuts[p]);
            let p = Degree::new(p).unwrap_or(Degree::MAX);
            MapDegree { p, p95, p99, rms: *rms, is_met: false, enough: None, field: p }
        };
        Ok(rms.iter().enumerate().map(measure).collect())
    }

    /// The errors of maps with the lamps in them at each P from 0 on, up to the first that meets the
    /// tolerance.
    fn fits(
        &self,
        soft: &Shrm,
        samples: &[Sample],
        rule: DegreeRule,
        tables: &mut LampTables,
        stop: Stop<'_>,
    ) -> Result<Vec<MapDegree>, SynthesisError> {
        // Lamps are added exactly to a map that is the same for every view.
        let most = if soft.p().get() == 0 { 0 } else { rule.most_p };
        let mut measured = Vec::new();
        for p in 0..=most {
            let p = Degree::new(p).unwrap_or(Degree::MAX);
            let found = self.fit(soft, p, samples, tables, stop)?;
            measured.push(found);
            if rule.tolerance.excess([found.p95, found.p99], found.rms) <= 1.0 {
                break;
            }
        }
        Ok(measured)
    }

    /// The least degree P of the field, that of the map or more, whose cut has no more than [`FIELD_SHARE`]
    /// of the errors of a fit.
    fn fitted_field(&self, fit: &MapDegree, samples: &[Sample]) -> Degree {
        let (own, dark) = (self.brdf().p(), BLACK_SHARE * self.light_mean());
        let is_enough = |p: &usize| {
            // What the cut leaves of the right value, which has the lamps too.
            let left = |_, sample: &Sample| {
                let (whole, cut) = (sample.cuts[own.get()], sample.cuts[*p]);
                std::array::from_fn(|c| sample.right[c] - whole[c] + cut[c])
            };
            let [p95, p99] = quantiles(samples, dark, left);
            p95 <= FIELD_SHARE * fit.p95 && p99 <= FIELD_SHARE * fit.p99
        };
        // A field of P = 0 would be that of a material that is the same from every view.
        let least = fit.p.get().max(1);
        (least..own.get()).find(is_enough).and_then(|p| Degree::new(p).ok()).unwrap_or(own)
    }

    /// A map of the field without the lamps at few texels, and samples of them.
    fn sampled_map(
        &self,
        content: MapContent<'_>,
        stop: Stop<'_>,
    ) -> Result<(Shrm, Vec<Sample>), SynthesisError> {
        let grid = MapGrid::Cube(Cube { edge: EDGE });
        let sampled = self.map_samples(content, |index| grid.direction(index), grid.len(), stop)?;
        let (p, terms) = (self.brdf().p(), if self.is_azimuth_free() { Terms::Zonal } else { Terms::All });
        let is_kept = |row: usize| match terms {
            Terms::All => true,
            Terms::Zonal => row == row.isqrt() * (row.isqrt() + 1),
        };
        let (mut values, mut samples) = (Vec::new(), Vec::new());
        for (rows, of_texel) in sampled {
            let kept = rows.iter().enumerate().filter(|(row, _)| is_kept(*row));
            values.extend(kept.map(|(_, rgb)| rgb.map(|value| value as f32)));
            samples.extend(of_texel);
        }
        let centre = self.brdf().centre();
        Ok((Shrm { grid, view: View::Local, centre, p, terms, values }, samples))
    }

    /// The errors of a map with the lamps in it, at samples of its texels.
    fn fit(
        &self,
        soft: &Shrm,
        p: Degree,
        samples: &[Sample],
        tables: &mut LampTables,
        stop: Stop<'_>,
    ) -> Result<MapDegree, SynthesisError> {
        let texels: Vec<usize> = (0..soft.grid().len()).collect();
        let map = self.bake_texels(soft, p, &texels, tables, stop)?;
        let views = samples.len() / texels.len().max(1);
        let seen_at = |(texel, samples): (usize, &[Sample])| {
            let (mut lookup, to_world) = (map.lookup(), frame(soft.grid().direction(texel)));
            let seen = |sample: &Sample| lookup.texel(texel, to_world.apply(sample.outgoing)).map(f64::from);
            samples.iter().map(seen).collect::<Vec<_>>()
        };
        let found: Vec<[f64; 3]> =
            samples.par_chunks(views.max(1)).enumerate().map(seen_at).flatten_iter().collect();
        let dark = BLACK_SHARE * self.light_mean();
        let [p95, p99] = quantiles(samples, dark, |index, _| found[index]);
        let (mut lost, mut whole) = (0.0, 0.0);
        for (sample, found) in samples.iter().zip(&found) {
            for (right, found) in sample.right.iter().zip(found) {
                lost += math::powi(found - right, 2);
                whole += right * right;
            }
        }
        let rms = if whole > 0.0 { (lost / whole).sqrt() } else { 0.0 };
        Ok(MapDegree { p, p95, p99, rms, is_met: false, enough: None, field: self.brdf().p() })
    }

    /// The coefficients b_pq of the field at central directions, with [`SAMPLES`] views of each.
    fn map_samples(
        &self,
        content: MapContent<'_>,
        central: impl Fn(usize) -> Direction + Sync,
        count: usize,
        stop: Stop<'_>,
    ) -> Result<Vec<SampledTexel>, Stopped> {
        let basis = Basis::new(self.brdf().p());
        let base = content.base.map(|base| (base, base.lamps().map(crate::Lamps::for_views)));
        let lamps = self.lamps().map(|lamps| (lamps, lamps.points()));
        let at = |index: usize| {
            stop.check()?;
            let central = central(index);
            let side = self.brdf().p().get();
            let light = rotate_orders(self.lighting(), frame(central).inverse(), side);
            let mut rows = vec![[0.0; 3]; self.brdf().p().rows()];
            (0..=self.brdf().f().get()).for_each(|l| add(&mut rows, &light, self.brdf(), l));
            let lights = lamps.as_ref().map(|(lamps, points)| (lamps, in_frame(points, central)));
            let mut y = vec![0.0; rows.len()];
            let sample = |view: usize| {
                let outgoing = seen(self.brdf().centre(), index * SAMPLES[1] + view);
                basis.evaluate_into(outgoing, &mut y);
                let lit = lights.as_ref().map_or([0.0; 3], |(lamps, lights)| lamps.seen(lights, outgoing));
                let mut beside = [0.0; 3];
                if let Some((base, lamps)) = &base {
                    let view = frame(central).apply(outgoing);
                    let normal = central.vector() + view.vector();
                    let normal = if normal.length() > 0.0 { Direction::normalised(normal) } else { central };
                    let lit = lamps.as_ref().map_or([0.0; 3], |lamps| lamps.radiance(normal, view));
                    let soft = base.evaluate(normal, view);
                    (0..3).for_each(|channel| beside[channel] += soft[channel].max(0.0) + lit[channel]);
                }
                let (mut sum, mut cuts) = ([0.0; 3], Vec::with_capacity(side + 1));
                for p in 0..=side {
                    for row in p * p..(p + 1) * (p + 1) {
                        (0..3).for_each(|channel| sum[channel] += rows[row][channel] * y[row]);
                    }
                    cuts.push(sum);
                }
                let mut right = sum;
                let lamps_in = if content.lamps { &mut right } else { &mut beside };
                (0..3).for_each(|channel| lamps_in[channel] += lit[channel]);
                Sample { outgoing, beside, right, cuts }
            };
            let samples = (0..SAMPLES[1]).map(sample).collect();
            Ok((rows, samples))
        };
        (0..count).into_par_iter().with_max_len(2).map(at).collect()
    }
}

/// The errors in stops that 95 and 99 of 100 samples stay below, of what is found at each; what a map leaves
/// below zero is black.
fn quantiles(samples: &[Sample], dark: f64, found: impl Fn(usize, &Sample) -> [f64; 3] + Sync) -> [f64; 2] {
    stops::quantiles_of(samples, |index, sample| {
        let found = found(index, sample);
        let seen = |value: f64, channel: usize| value.max(0.0) + sample.beside[channel];
        [0, 1, 2].map(|c| stops::error(seen(found[c], c), seen(sample.right[c], c), dark))
    })
}

#[cfg(test)]
mod tests {
    use brdf::{Choice, Fresnel, Ggx, Material, project};
    use sh::{Expansion, Light, Lighting};

    use super::*;
    use crate::MapTolerance;
    use crate::accuracy::Accuracy;

    /// A metal under a few bright windows, with a sun if that is asked for.
    fn field(sunny: bool) -> Reflection {
        let degree = Degree::new(16).unwrap();
        let mut series = Expansion::zero(degree);
        series.coefficients_mut()[0] = [1.0; 3];
        for (theta, phi, flux) in [(0.7, 0.3, 4.0), (1.5, 2.5, 3.0), (2.2, -1.5, 2.0)] {
            let window = |l: usize| [flux * (-0.01 * (l * (l + 1)) as f64).exp(); 3];
            let window = Expansion::zonal(Direction::from_angles(theta, phi), degree, window);
            for (sum, more) in series.coefficients_mut().iter_mut().zip(window.coefficients()) {
                (0..3).for_each(|channel| sum[channel] += more[channel]);
            }
        }
        let metal = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
        let material = Material::Ggx(Ggx::new(0.4, metal, [1.0; 3]).unwrap());
        let brdf = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let sun = Light::from_flux(Direction::from_angles(0.9, 0.4), 0.01, [24.0, 20.0, 16.0]);
        let lights = if sunny { vec![sun] } else { Vec::new() };
        Reflection::for_light(&Lighting { series, lights }, &brdf, &material, Stop::NEVER).unwrap().0
    }

    const BESIDE: MapContent<'static> = MapContent { lamps: false, base: None };

    #[test]
    fn the_rms_of_a_cut_is_the_root_of_the_energy_that_it_loses() {
        let field = field(false);
        let accuracy = Accuracy::of(&field, [0.0; 3], 0.0);
        let found = rms_of_cuts(field.lighting(), field.brdf());
        assert_eq!(found.len(), field.brdf().p().get() + 1);
        for (p, found) in found.iter().enumerate() {
            let expected = accuracy.at(accuracy.f(), p).truth.sqrt();
            // The difference of energies of about 1 has an error of some 1e-16, of which this is the root.
            assert!((found - expected).abs() < 1e-7, "{p}: {found} {expected}");
        }
    }

    /// The errors of a map with lamps in it, or beside the field, at other samples than those of the choice.
    fn errors_of(field: &Reflection, map: &Shrm) -> [f64; 2] {
        let (mut lookup, dark, mut errors) = (map.lookup(), BLACK_SHARE * field.light_mean(), Vec::new());
        for texel in 0..map.grid().len() {
            let central = map.grid().direction(texel);
            for k in 0..8 {
                let view = frame(central).apply(seen(map.centre(), 7919 + 8 * texel + k));
                let lit = field.lamps().map_or([0.0; 3], |lamps| lamps.radiance(central, view));
                let right = field.evaluate(central, view);
                for (channel, found) in lookup.texel(texel, view).into_iter().enumerate() {
                    errors.push(stops::error(found, right[channel].max(0.0) + lit[channel], dark));
                }
            }
        }
        stops::quantiles(&mut errors)
    }

    /// The errors are those of the map that is made, with other samples of it.
    #[test]
    fn the_errors_are_those_of_the_map() {
        for (lamps, field) in [(false, field(false)), (true, field(true))] {
            let content = MapContent { lamps, ..BESIDE };
            let rule =
                DegreeRule { tolerance: MapTolerance::Stops([0.2, 0.5]), most_p: 6, terms: Terms::All };
            let chosen = field.map_degree(content, rule, &mut LampTables::default(), Stop::NEVER).unwrap();
            assert!(chosen.is_met && chosen.p95 <= 0.2 && chosen.p99 <= 0.5, "{chosen:?}");
            if chosen.p.get() > 0 {
                let less = DegreeRule { most_p: chosen.p.get() - 1, ..rule };
                assert!(
                    !field.map_degree(content, less, &mut LampTables::default(), Stop::NEVER).unwrap().is_met,
                    "{chosen:?}"
                );
            }
            let grid = MapGrid::Cube(Cube { edge: 7 });
            let map = if lamps {
                field.bake(grid, View::Local, [chosen.p, chosen.field], Stop::NEVER).unwrap()
            } else {
                field.cut_in_view(chosen.p).synthesise(grid, View::Local, Stop::NEVER).unwrap()
            };
            assert_eq!(map.p(), chosen.p);
            let [p95, p99] = errors_of(&field, &map);
            // Both are quantiles of some thousand samples.
            assert!((p95 / chosen.p95 - 1.0).abs() < 0.3, "{lamps}: {p95} {chosen:?}");
            assert!((p99 / chosen.p99 - 1.0).abs() < 0.5, "{lamps}: {p99} {chosen:?}");
        }
    }

    /// A map of few degrees that is fitted to a cut of its field is as near to the lamps and the whole field
    /// as one that is fitted to these.
    #[test]
    fn a_fit_loses_nothing_by_the_cut_of_its_field() {
        let (field, content) = (field(true), MapContent { lamps: true, ..BESIDE });
        let grid = MapGrid::Cube(Cube { edge: 7 });
        let soft = field.synthesise(grid, View::Local, Stop::NEVER).unwrap();
        for p in 1..=4 {
            let tolerance = MapTolerance::Stops([1e-3; 2]);
            let rule = DegreeRule { tolerance, most_p: p, terms: Terms::All };
            let chosen = field.map_degree(content, rule, &mut LampTables::default(), Stop::NEVER).unwrap();
            assert!(chosen.p <= chosen.field && chosen.field < field.brdf().p(), "{chosen:?}");
            let texels: Vec<usize> = (0..grid.len()).collect();
            let errors = |soft: &Shrm| {
                let mut tables = LampTables::default();
                let map = field.bake_texels(soft, chosen.p, &texels, &mut tables, Stop::NEVER).unwrap();
                errors_of(&field, &map)
            };
            let ([p95, p99], [of_whole95, of_whole99]) = (errors(&soft.cut(chosen.field)), errors(&soft));
            assert!(
                p95 < 1.1 * of_whole95 && p99 < 1.1 * of_whole99,
                "{p}: {p95} {p99}, {of_whole95} {of_whole99}"
            );
        }
    }

    /// A matte base beside a highlight hides a part of its error.
    #[test]
    fn beside_a_base_a_cut_shows_less() {
        let (field, rule) = (
            field(false),
            DegreeRule { tolerance: MapTolerance::Stops([1e-6; 2]), most_p: 2, terms: Terms::All },
        );
        let white = Material::Lambert(brdf::Lambert::new([0.8; 3]).unwrap());
        let brdf = project(&white, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let base = Reflection::convolve(&field.lighting().to_degree(Degree::new(4).unwrap()), &brdf);
        let error = |base| {
            field
                .map_degree(MapContent { base, ..BESIDE }, rule, &mut LampTables::default(), Stop::NEVER)
                .unwrap()
                .p95
        };
        assert!(error(Some(&base)) < 0.9 * error(None), "{} {}", error(Some(&base)), error(None));
    }

    #[test]
    fn a_stopped_choice_ends_early() {
        let rule = DegreeRule { tolerance: MapTolerance::Rms(0.1), most_p: 4, terms: Terms::All };
        let stopped = field(true).map_degree(BESIDE, rule, &mut LampTables::default(), Stop::when(&|| true));
        assert_eq!(stopped, Err(Stopped.into()));
    }
}
