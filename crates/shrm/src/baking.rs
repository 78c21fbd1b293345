//! Lamps put into a map, for readers that only look it up.
//!
//! Cut at degree P, the reflection of a sun rings into all views: the view opposite to the reflection vector
//! is singular, the horizon cuts the highlight off, and dark views show in stops what bright ones lose. So
//! the views of each texel are not cut but fitted: its coefficients x minimise the relative error over a grid
//! of views w_k,
//!
//! > sum over k of ((sum over rows of x Y(w_k) - b_k) / (b_k + e))^2,
//!
//! where b_k is the soft field and the lamps together, and e the radiance below which black is black. The
//! views are weighted by their projected area, as a ball shows them to a distant camera; about R they are
//! uniform over the sphere. The method of conjugate gradients starts at the projection and ends as soon as a
//! few steps gain little: after one or two, if P is so small that its matrix is factored (`normal_matrix`).
//! On the grid of views, harmonics are sums over p and then over q, so that a step takes O(P^3). The map's P
//! may be less than that of the field ([`MapDegree::field`](crate::MapDegree)).
//!
//! What a lamp adds to the views depends on its angle from R, its azimuth and its radius alone, and comes
//! from tables that all texels share: sums over the points of each lamp would take many times as long as the
//! fits. Neighbouring lamps are one disk for texels that are far from them (`lamp_groups`).
//!
//! A material that is the same from every view needs no fit: its lamps are added exactly.

mod lamp_groups;
mod light_table;
mod normal_matrix;
mod solver;
mod view_grid;
mod view_sums;

use std::f64::consts::PI;
use std::sync::Arc;

use rayon::prelude::*;
use sh::f64x4::SimdLevel;
use sh::{Degree, Stop, Stopped};
use sphere::Direction;

use crate::degrees::BLACK_SHARE;
use crate::lamps::Lamps;
use crate::{MOST_VALUES, MapGrid, Reflection, Shrm, SynthesisError, Terms, View};
use light_table::{AddLights, LightTable, PlacedLamp};
use normal_matrix::NormalMatrix;
use solver::Solve;
use view_grid::ViewGrid;
use view_sums::F32x8;

/// Texels that are fitted at once: before each such block the baking asks whether to stop.
pub const BAKED_AT_ONCE: usize = view_sums::LANES;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 5;

/// The tables of the lamps of one reflection, which its maps share: those of all degrees P with as many views
/// are the same.
#[derive(Default)]
pub struct LampTables(Vec<((usize, bool), Arc<LightTable>)>);

impl LampTables {
    fn serving(&mut self, lamps: &Lamps, views: &ViewGrid) -> Arc<LightTable> {
        let key = (views.rows.len(), views.orders() == 0);
        if let Some((_, table)) = self.0.iter().find(|(other, _)| *other == key) {
            return Arc::clone(table);
        }
        let table = Arc::new(LightTable::new(lamps, views));
        self.0.push((key, Arc::clone(&table)));
        table
    }
}

impl Reflection {
    /// The mean radiance of all light, lamps included, times [`BLACK_SHARE`]: e of the module's text.
    fn dark(&self) -> f64 {
        let lights = self.lamps().map(|lamps| lamps.lights.clone()).unwrap_or_default();
        BLACK_SHARE * sh::Lighting { series: self.lighting().clone(), lights }.mean()
    }

    /// The spherical harmonic reflection map on a grid, with the lamps in it; without lamps it is
    /// [`Reflection::synthesise`]'s. With lamps its degree in the view is `p`, if the material depends on the
    /// view, and it is fitted to the field up to its degree `field` in the view.
    ///
    /// `stop` is asked between blocks of texels.
    ///
    /// # Errors
    /// The errors of [`Reflection::synthesise`].
    pub fn bake(
        &self,
        grid: MapGrid,
        view: View,
        [p, field]: [Degree; 2],
        stop: Stop<'_>,
    ) -> Result<Shrm, SynthesisError> {
        let texels: Vec<usize> = (0..grid.len()).collect();
        let field = if self.lamps().is_some() { &self.cut_in_view(field) } else { self };
        let soft = field.synthesise(grid, View::Local, stop)?;
        let local = self.bake_texels(&soft, p, &texels, &mut LampTables::default(), stop)?;
        Ok(if view == View::Global { local.to_global() } else { local })
    }

    /// Some texels of [`Reflection::bake`]'s local map of degree `p`, from the local map that
    /// [`Reflection::synthesise`] makes; if they have to be fitted, texels that are not listed are black. The
    /// work is that of the listed texels. `tables` serve this reflection alone. `stop` is asked between
    /// blocks of texels.
    ///
    /// # Errors
    /// The errors of [`Reflection::synthesise`].
    ///
    /// # Panics
    /// If a texel is not one of the map.
    pub fn bake_texels(
        &self,
        soft: &Shrm,
        p: Degree,
        texels: &[usize],
        tables: &mut LampTables,
        stop: Stop<'_>,
    ) -> Result<Shrm, SynthesisError> {
        match self.lamps().filter(|lamps| !lamps.lights.is_empty()) {
            None => Ok(soft.clone()),
            Some(lamps) if soft.p().get() == 0 => Ok(added(soft.clone(), lamps)),
            Some(lamps) => {
                let fit = TexelFit::new(self, soft, lamps, p, tables);
                fit.texels(texels, stop)
            }
        }
    }
}

impl TexelFit<'_> {
    /// The listed texels fitted to the soft field and the lamps.
    fn texels(&self, texels: &[usize], stop: Stop<'_>) -> Result<Shrm, SynthesisError> {
        let (soft, p) = (self.soft, self.p);
        let (grid, terms) = (soft.grid(), soft.terms());
        let rows = if terms == Terms::Zonal { p.get() + 1 } else { p.rows() };
        if grid.len().saturating_mul(rows) > MOST_VALUES {
            return Err(SynthesisError::TooLarge { texels: grid.len(), rows });
        }
        let level = SimdLevel::detect();
        let mut fitted = vec![[0.0_f32; 3]; texels.len() * rows];
        let blocks =
            fitted.par_chunks_mut(BAKED_AT_ONCE * rows).zip(texels.par_chunks(BAKED_AT_ONCE)).with_max_len(8);
        blocks.try_for_each(|(values, texels)| {
            stop.check()?;
            let lit = self.light(texels, level);
            for (channel, lit) in lit.into_iter().enumerate() {
                let coefficients = self.solve(lit, level);
                for (lane, out) in values.chunks_exact_mut(rows).enumerate() {
                    for (rows, values) in self.pairs.iter().zip(&coefficients) {
                        for (row, value) in rows.iter().zip(values) {
                            row.iter().for_each(|row| out[*row][channel] = value.0[lane]);
                        }
                    }
                }
            }
            Ok::<(), Stopped>(())
        })?;
        let mut values = vec![[0.0_f32; 3]; grid.len() * rows];
        for (texel, fitted) in texels.iter().zip(fitted.chunks_exact(rows)) {
            values[texel * rows..][..rows].copy_from_slice(fitted);
        }
        Ok(Shrm { grid, view: View::Local, centre: soft.centre(), p, terms, values })
    }
}

/// What the fits of all texels share.
struct TexelFit<'a> {
    soft: &'a Shrm,
    /// The map's P.
    p: Degree,
    /// The radiance e below which a value counts as black.
    dark: f32,
    /// The views, and the harmonics that are fitted there.
    views: ViewGrid,
    matrix: Option<NormalMatrix>,
    /// The rows of the coefficients that are fitted.
    pairs: Vec<[Option<usize>; 2]>,
    /// The soft field's harmonics at the same views, and the rows of its coefficients.
    field_views: ViewGrid,
    field_pairs: Vec<[Option<usize>; 2]>,
    table: Arc<LightTable>,
    lamps: Vec<PlacedLamp>,
}

/// One channel of the light at eight texels.
struct Lit {
    /// The coefficients of the soft field, in pairs.
    field: Vec<[F32x8; 2]>,
    /// The radiance of the lamps at each view.
    lamps: Vec<F32x8>,
}

impl<'a> TexelFit<'a> {
    fn new(
        reflection: &Reflection,
        soft: &'a Shrm,
        lamps: &Lamps,
        p: Degree,
        tables: &mut LampTables,
    ) -> Self {
        let views = ViewGrid::new(p.get(), p.get(), soft.terms(), soft.centre());
        let field_views = ViewGrid::new(soft.p().get(), p.get(), soft.terms(), soft.centre());
        let (pairs, field_pairs) = (views.rows_of_pairs(), field_views.rows_of_pairs());
        let table = tables.serving(lamps, &views);
        let lamps = table.placed(&table.groups);
        let dark = reflection.dark() as f32;
        let matrix = NormalMatrix::new(&views, soft.centre());
        Self { soft, p, dark, views, matrix, pairs, field_views, field_pairs, table, lamps }
    }

    /// The light of each channel at up to eight texels.
    fn light(&self, texels: &[usize], level: SimdLevel) -> [Lit; 3] {
        let mut lit = [0; 3].map(|_| Lit {
            field: vec![[F32x8::ZERO; 2]; self.field_pairs.len()],
            lamps: vec![F32x8::ZERO; self.views.len()],
        });
        for (lane, &texel) in texels.iter().enumerate() {
            let values = self.soft.texel(texel);
            for (pair, rows) in self.field_pairs.iter().enumerate() {
                for (part, row) in rows.iter().enumerate() {
                    let Some(row) = row else { continue };
                    let value = values[*row];
                    (0..3).for_each(|channel| lit[channel].field[pair][part].0[lane] = value[channel]);
                }
            }
        }
        let centrals: Vec<Direction> =
            texels.iter().map(|texel| self.soft.grid().direction(*texel)).collect();
        let (table, dark, views) = (&self.table, self.dark, &self.views);
        let of_lamps = lit.each_mut().map(|lit| &mut lit.lamps[..]);
        level.run(AddLights { table, lamps: &self.lamps, centrals: &centrals, dark, views, lit: of_lamps });
        lit
    }

    /// The coefficients of one channel, in pairs.
    fn solve(&self, mut lit: Lit, level: SimdLevel) -> Vec<[F32x8; 2]> {
        let mut coefficients = vec![[F32x8::ZERO; 2]; self.pairs.len()];
        let (mut kept, mut field) = (&mut coefficients[..], &lit.field[..]);
        for (count, of_field) in self.views.counts().zip(self.field_views.counts()) {
            let (of_q, others) = kept.split_at_mut(count);
            let (of_field, rest) = field.split_at(of_field);
            of_q.iter_mut().zip(of_field).for_each(|(pair, value)| *pair = *value);
            (kept, field) = (others, rest);
        }
        level.run(Solve {
            views: &self.views,
            matrix: self.matrix.as_ref(),
            dark: self.dark,
            field: (&self.field_views, &lit.field),
            coefficients: &mut coefficients,
            lit: &mut lit.lamps,
        });
        coefficients
    }
}

/// Adds the lamps to a map without a view.
fn added(mut map: Shrm, lamps: &Lamps) -> Shrm {
    let scale = (4.0 * PI).sqrt() as f32;
    let plain = lamps.plain(crate::plain::Plain::HeadOn, map.grid());
    for (value, lamps) in map.values.iter_mut().zip(plain) {
        (0..3).for_each(|channel| value[channel] += scale * lamps[channel]);
    }
    map
}

#[cfg(test)]
mod tests {
    use brdf::{Choice, Fresnel, Ggx, KajiyaKay, Material, Microfacet, Phong, project};
    use sh::{Expansion, Light, Lighting};
    use sphere::{Cube, Direction};

    use super::lamp_groups::LampGroup;
    use super::*;
    use crate::MOST_P;
    use crate::degrees::seen;

    fn most_p() -> Degree {
        Degree::new(MOST_P).unwrap()
    }

    /// A soft sky of mean 1 with a sun that gives ten times as much.
    fn lighting() -> Lighting {
        let degree = Degree::new(6).unwrap();
        let mut rows = vec![[0.0; 3]; degree.rows()];
        rows[0] = [3.5; 3];
        rows[2] = [1.2, 1.0, 0.8];
        rows[7] = [0.2, -0.3, 0.4];
        rows[20] = [-0.1, 0.1, 0.1];
        let sun = Light::from_flux(Direction::from_angles(1.2, 0.4), 0.005, [12.0, 10.0, 8.0]);
        Lighting { series: Expansion::from_coefficients(degree, rows).unwrap(), lights: vec![sun] }
    }

    fn materials() -> Vec<Material> {
        let metal = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
        vec![
            Material::Phong(Phong::new(10.0, [1.0, 0.8, 0.5]).unwrap()),
            Material::Microfacet(Microfacet::new(0.3, [1.0; 3]).unwrap()),
            Material::Ggx(Ggx::new(0.3, metal, [1.0; 3]).unwrap()),
            Material::KajiyaKay(KajiyaKay::new(32.0, [1.0; 3]).unwrap()),
        ]
    }

    /// Errors in stops of what `value` gives at texels and views against the soft field and the lamps
    /// together.
    fn stops(reflection: &Reflection, map: &Shrm, dark: f64) -> Vec<f64> {
        let lamps = reflection.lamps().unwrap();
        let mut errors = Vec::new();
        for texel in (0..map.grid().len()).step_by(3) {
            let central = map.grid().direction(texel);
            for k in 0..24 {
                let outgoing = seen(map.centre(), 24 * texel + k);
                let view = Direction::normalised(crate::frame(central).matrix() * outgoing.vector());
                let (soft, lit) = (reflection.evaluate(central, view), lamps.radiance(central, view));
                let found = map.lookup().texel(texel, view);
                for channel in 0..3 {
                    let truth = soft[channel].max(0.0) + lit[channel] + dark;
                    errors.push(((found[channel].max(0.0) + dark) / truth).log2().abs());
                }
            }
        }
        errors.sort_by(f64::total_cmp);
        errors
    }

    /// The limits of a baked map: 0.15 stops for 95 % of views, 0.5 for 99 %. A cut of the same degree misses
    /// them by far, which shows that they are worth something.
    #[test]
    fn a_baked_sun_stays_within_the_limits() {
        let (lighting, grid) = (lighting(), MapGrid::Cube(Cube { edge: 5 }));
        for material in materials() {
            let brdf = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
            let (reflection, _) = Reflection::for_light(&lighting, &brdf, &material, Stop::NEVER).unwrap();
            let map = reflection.bake(grid, View::Local, [most_p(), Degree::MAX], Stop::NEVER).unwrap();
            assert!(map.p().get() <= MOST_P);
            let errors = stops(&reflection, &map, reflection.dark());
            let at = |share: f64| errors[(share * errors.len() as f64) as usize];
            assert!(at(0.95) < 0.15 && at(0.99) < 0.5, "{}: {} {}", material.name(), at(0.95), at(0.99));
            if map.p().get() > 0 {
                let whole = Reflection::convolve(&lighting.whole(), &brdf.cut_to(Degree::MAX, map.p()));
                let cut = stops(
                    &reflection,
                    &whole.synthesise(grid, View::Local, Stop::NEVER).unwrap(),
                    reflection.dark(),
                );
                assert!(cut[(0.95 * cut.len() as f64) as usize] > 0.5, "{}", material.name());
            }
        }
    }

    #[test]
    fn global_maps_hold_the_same_light_and_a_cancelled_map_ends_early() {
        let material = &materials()[1];
        let brdf = project(material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let (reflection, _) = Reflection::for_light(&lighting(), &brdf, material, Stop::NEVER).unwrap();
        let grid = MapGrid::Cube(Cube { edge: 2 });
        let [local, global] = [View::Local, View::Global]
            .map(|view| reflection.bake(grid, view, [most_p(), Degree::MAX], Stop::NEVER).unwrap());
        for texel in 0..grid.len() {
            let view = Direction::from_angles(0.3 * texel as f64 % 3.0, texel as f64);
            let [a, b] = [&local, &global].map(|map| map.lookup().texel(texel, view));
            assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-3 * (1.0 + a[c].abs())), "{a:?} {b:?}");
        }
        // Some texels alone are those of the whole map.
        let soft = reflection.synthesise(grid, View::Local, Stop::NEVER).unwrap();
        let some = reflection
            .bake_texels(&soft, most_p(), &[3, 17], &mut LampTables::default(), Stop::NEVER)
            .unwrap();
        assert_eq!((some.texel(3), some.texel(17)), (local.texel(3), local.texel(17)));
        assert!(some.texel(4).iter().all(|value| *value == [0.0; 3]));
        let stop = Stop::when(&|| true);
        assert_eq!(
            reflection.bake_texels(&soft, most_p(), &[3, 17], &mut LampTables::default(), stop),
            Err(Stopped.into())
        );
        assert_eq!(reflection.bake(grid, View::Local, [most_p(), Degree::MAX], stop), Err(Stopped.into()));
    }

    /// Five lamps of different sizes over the soft sky.
    fn studio() -> Lighting {
        let lamp = |k: usize| {
            let radius = [0.004, 0.02, 0.05, 0.11, 0.3][k];
            Light::from_flux(sphere::spiral(k, 5), radius, [0.5 + 0.1 * k as f64, 0.6, 0.4])
        };
        Lighting { lights: (0..5).map(lamp).collect(), ..lighting() }
    }

    /// Two soft boxes, each of eighteen lamps, one of which is warm and bright at one end.
    fn soft_boxes() -> Lighting {
        let lamp = |k: usize| {
            let (across, along) = ((k / 2 % 6) as f64, (k / 12) as f64);
            let ([theta, phi], flux) = match k.is_multiple_of(2) {
                true => ([0.8, 1.6], [0.3, 0.32, 0.35]),
                false => ([1.6, -1.1], [0.7 - 0.12 * across, 0.4 - 0.03 * across, 0.1 + 0.04 * across]),
            };
            let direction = Direction::from_angles(theta + 0.03 * across, phi + 0.04 * along);
            Light::from_flux(direction, 0.015 + 0.0003 * k as f64, flux)
        };
        Lighting { lights: (0..36).map(lamp).collect(), ..lighting() }
    }

    /// The reflection of the studio and its local map without lamps, with the lamps' light that is tabulated
    /// for the fits of degree P, and the same as sums over the points of the lamps.
    fn tabulated(
        material: &Material,
        p: usize,
        check: impl Fn(&Reflection, &Shrm, &TexelFit, [Lit; 2], usize),
    ) {
        let brdf = project(material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let (reflection, _) = Reflection::for_light(&studio(), &brdf, material, Stop::NEVER).unwrap();
        let soft = reflection.synthesise(MapGrid::Cube(Cube { edge: 8 }), View::Local, Stop::NEVER).unwrap();
        let lamps = reflection.lamps().unwrap();
        let fit =
            TexelFit::new(&reflection, &soft, lamps, Degree::new(p).unwrap(), &mut LampTables::default());
        for first in (0..soft.grid().len()).step_by(3 * BAKED_AT_ONCE) {
            let texels: Vec<usize> = (first..soft.grid().len()).take(BAKED_AT_ONCE).collect();
            let [_, lit, _] = fit.light(&texels, SimdLevel::detect());
            let mut exact = vec![F32x8::ZERO; lit.lamps.len()];
            for (lane, texel) in texels.iter().enumerate() {
                let central = soft.grid().direction(*texel);
                let outgoing = fit.views.rows.iter().flat_map(|(theta, _)| {
                    let azimuths = (0..fit.views.quarter.len()).flat_map(|j| fit.views.azimuths(j));
                    azimuths.map(move |phi| Direction::from_angles(*theta, phi))
                });
                for (value, outgoing) in exact.iter_mut().zip(outgoing) {
                    let view = crate::frame(central).apply(outgoing);
                    value.0[lane] = lamps.radiance(central, view)[1] as f32;
                }
            }
            let exact = Lit { field: lit.field.clone(), lamps: exact };
            check(&reflection, &soft, &fit, [lit, exact], first);
        }
    }

    /// Between the nodes of the angle, the azimuth and the radius.
    #[test]
    fn the_light_of_lamps_of_all_sizes_is_the_sum_over_their_points() {
        for material in &materials()[1..] {
            let stops = std::sync::Mutex::new(Vec::new());
            tabulated(material, 4, |reflection, _, _, [found, exact], _| {
                let dark = reflection.dark() as f32;
                let pairs = found.lamps.iter().flat_map(|v| v.0).zip(exact.lamps.iter().flat_map(|v| v.0));
                stops.lock().unwrap().extend(pairs.map(|(a, b)| ((a + dark) / (b + dark)).log2().abs()));
            });
            let mut stops = stops.into_inner().unwrap();
            stops.sort_by(f32::total_cmp);
            let at = |share: f64| stops[(share * stops.len() as f64) as usize];
            assert!(at(0.95) < 0.03 && at(0.99) < 0.1, "{}: {} {}", material.name(), at(0.95), at(0.99));
        }
    }

    /// Groups of lamps are as good as each lamp by itself, from the same tables: they lose at most two thirds
    /// of what those may lose between their nodes.
    #[test]
    fn far_lamps_are_one_disk() {
        let lighting = soft_boxes();
        for material in materials() {
            let brdf = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
            let (reflection, _) = Reflection::for_light(&lighting, &brdf, &material, Stop::NEVER).unwrap();
            let grid = MapGrid::Cube(Cube { edge: 8 });
            let soft = reflection.synthesise(grid, View::Local, Stop::NEVER).unwrap();
            let lamps = reflection.lamps().unwrap();
            let fit = || {
                let mut tables = LampTables::default();
                TexelFit::new(&reflection, &soft, lamps, Degree::new(4).unwrap(), &mut tables)
            };
            let (grouped, mut alone) = (fit(), fit());
            let lamp = |light: &Light| LampGroup { light: *light, least_angle: 0.0, descendants: 0 };
            alone.lamps = alone.table.placed(&lighting.lights.iter().map(lamp).collect::<Vec<_>>());
            assert_ne!(alone.lamps.len(), grouped.lamps.len());
            let mut stops = Vec::new();
            for first in (0..grid.len()).step_by(BAKED_AT_ONCE) {
                let texels: Vec<usize> = (first..first + BAKED_AT_ONCE).collect();
                let [found, right] = [&grouped, &alone].map(|fit| fit.light(&texels, SimdLevel::detect()));
                let numbers = |lit: [Lit; 3]| {
                    let values = lit.into_iter().flat_map(|lit| lit.lamps).flat_map(|value| value.0);
                    values.map(|value| value + reflection.dark() as f32).collect::<Vec<_>>()
                };
                let pairs = numbers(found).into_iter().zip(numbers(right));
                stops.extend(pairs.map(|(found, right)| (found / right).log2().abs()));
            }
            stops.sort_by(f32::total_cmp);
            let at = |share: f64| stops[(share * stops.len() as f64) as usize];
            assert!(at(0.95) < 0.02 && at(0.99) < 0.066, "{}: {} {}", material.name(), at(0.95), at(0.99));
        }
    }

    /// Where lamps are in groups and the matrix is factored, texels do not depend on those beside them.
    #[test]
    fn texels_in_groups_of_lamps_are_those_of_the_whole_map() {
        let (material, p) = (&materials()[2], Degree::new(4).unwrap());
        let brdf = project(material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let (reflection, _) = Reflection::for_light(&soft_boxes(), &brdf, material, Stop::NEVER).unwrap();
        let soft = reflection.synthesise(MapGrid::Cube(Cube { edge: 5 }), View::Local, Stop::NEVER).unwrap();
        let bake = |texels: &[usize]| {
            reflection.bake_texels(&soft, p, texels, &mut LampTables::default(), Stop::NEVER).unwrap()
        };
        let (whole, some) = (bake(&(0..150).collect::<Vec<_>>()), bake(&[131, 3, 17, 64]));
        for texel in [3, 17, 64, 131] {
            assert_eq!(some.texel(texel), whole.texel(texel));
        }
        assert!(whole.texel(9).as_flattened().iter().all(|value| value.is_finite()));
    }

    /// A fit of few degrees loses nothing by the tables: it is as near to brute force as that of the exact
    /// light.
    #[test]
    fn few_degrees_are_fitted_as_well_as_they_are_to_the_sum_over_points() {
        for (material, p) in [(&materials()[1], 2), (&materials()[1], 4), (&materials()[2], 3)] {
            let errors = std::sync::Mutex::new([Vec::new(), Vec::new()]);
            tabulated(material, p, |reflection, soft, fit, lit, first| {
                let basis = sh::Basis::new(Degree::new(p).unwrap());
                let mut y = vec![0.0; (p + 1) * (p + 1)];
                let (lamps, dark) = (reflection.lamps().unwrap(), reflection.dark());
                for (lit, errors) in lit.into_iter().zip(errors.lock().unwrap().iter_mut()) {
                    let coefficients = fit.solve(lit, SimdLevel::detect());
                    for lane in 0..BAKED_AT_ONCE {
                        let central = soft.grid().direction(first + lane);
                        for k in 0..24 {
                            let outgoing = seen(soft.centre(), 24 * (first + lane) + k);
                            basis.evaluate_into(outgoing, &mut y);
                            let rows = fit.pairs.iter().flatten().zip(coefficients.as_flattened());
                            let found = rows.filter_map(|(row, x)| Some(f64::from(x.0[lane]) * y[(*row)?]));
                            let found = found.sum::<f64>().max(0.0) + dark;
                            let view = crate::frame(central).apply(outgoing);
                            let soft = reflection.evaluate(central, view)[1].max(0.0);
                            let right = soft + lamps.radiance(central, view)[1] + dark;
                            errors.push((found / right).log2().abs());
                        }
                    }
                }
            });
            let [found, best] = errors.into_inner().unwrap().map(|mut errors| {
                errors.sort_by(f64::total_cmp);
                errors[errors.len() * 95 / 100]
            });
            assert!(found < 1.02 * best, "{} P = {p}: {found} {best}", material.name());
        }
    }

    /// The soft field keeps all of its degrees in what is fitted, of which the map has fewer.
    #[test]
    fn a_map_of_fewer_degrees_than_the_field_is_fitted_to_the_whole_field() {
        let material = &materials()[1];
        let brdf = project(material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let dim = Light { irradiance: [1e-9; 3], ..lighting().lights[0] };
        let lighting = Lighting { lights: vec![dim], ..lighting() };
        let brdf = brdf.cut_to(Degree::new(6).unwrap(), Degree::new(6).unwrap());
        let reflection = Reflection::convolve(&lighting.series, &brdf)
            .with_lamps(Lamps { lights: lighting.lights.clone(), material: material.clone() });
        let grid = MapGrid::Cube(Cube { edge: 4 });
        let [few, cut] = [true, false].map(|fitted| {
            let p = Degree::new(2).unwrap();
            let map = if fitted {
                reflection.bake(grid, View::Local, [p, Degree::MAX], Stop::NEVER).unwrap()
            } else {
                let cut = Reflection::convolve(&lighting.series, &brdf.cut_to(brdf.f(), p));
                cut.synthesise(grid, View::Local, Stop::NEVER).unwrap()
            };
            assert_eq!((map.p(), map.rows()), (p, 9));
            let errors = stops(&reflection, &map, reflection.dark());
            errors.iter().map(|error| error * error).sum::<f64>()
        });
        assert!(few <= cut, "{few} {cut}");
    }
}
