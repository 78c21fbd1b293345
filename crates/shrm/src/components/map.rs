//! The map of components and its fit.

use std::f64::consts::TAU;

use brdf::{Centre, Material};
use rayon::prelude::*;
use sh::Stop;
use sphere::{Cube, DMat3, Direction, Face};

use super::basis::{ComponentBasis, RADII, shares};
use super::chart::{bordered_direction, bordered_taps, disc, face_frame};
use super::field::{Baked, Field, ORDERS, VIEWS, turns, view_angles, view_places};
use super::lobes::{Lobes, PointTable};
use super::options::{ComponentError, ComponentOptions, FULL_SIZE_COMPONENTS};
use super::solve::Factor;
use crate::Reflection;
use crate::degrees::BLACK_SHARE;

/// Reflected light as components: B(C, V) = sum over k of U_k(C) w_k(x, y), see the module's text.
#[derive(Clone, Debug, PartialEq)]
pub struct ComponentMap {
    basis: ComponentBasis,
    planes: Vec<Plane>,
}

/// One U_k.
#[derive(Clone, Debug, PartialEq)]
struct Plane {
    edge: usize,
    /// [face, row, column], bordered.
    values: Vec<[f32; 3]>,
}

impl ComponentMap {
    /// The functions w_k of the view.
    pub fn basis(&self) -> &ComponentBasis {
        &self.basis
    }

    /// The texels along the edge of a face of U_k, without its border.
    ///
    /// # Panics
    /// If there is no such component.
    pub fn edge(&self, k: usize) -> usize {
        self.planes[k].edge
    }

    /// U_k, shape [6, edge + 2, edge + 2], RGB: faces in the order +X -X +Y -Y +Z -Z, each with a border of
    /// one texel. Texel (row, column) looks toward s = (column - 1/2) / edge, t = (row - 1/2) / edge, also
    /// past the face's own edges, and its value is in the frame of [`face_frame`](super::face_frame) there.
    ///
    /// # Panics
    /// If there is no such component.
    pub fn values(&self, k: usize) -> &[[f32; 3]] {
        &self.planes[k].values
    }

    /// Returns the map with other values of each U_k, of which `change` gets the number: what a file holds
    /// after rounding.
    #[must_use]
    pub fn mapped(&self, mut change: impl FnMut(usize, &[[f32; 3]]) -> Vec<[f32; 3]>) -> Self {
        let of_plane = |(k, plane): (usize, &Plane)| {
            let values = change(k, &plane.values);
            let fits = values.len() == plane.values.len();
            Plane { edge: plane.edge, values: if fits { values } else { plane.values.clone() } }
        };
        let planes = self.planes.iter().enumerate().map(of_plane).collect();
        Self { basis: self.basis.clone(), planes }
    }

    /// The radiance toward `view` of a surface with this central direction, both in the world: bilinear, as
    /// hardware filters a bordered face. Views below the horizon see what the rim does.
    pub fn radiance(&self, central: Direction, view: Direction) -> [f64; 3] {
        let other = match self.basis.centre {
            Centre::Reflection => (central.vector() + view.vector()).try_normalize(),
            _ => Some(view.vector()),
        };
        let (face, s, t) = Cube { edge: 1 }.position(central);
        let frame = face_frame(face, central);
        let place = disc(&frame, other.unwrap_or(frame.x_axis));
        self.at(face, [s, t], &self.basis.at(place)).map(|value| value.max(0.0))
    }

    /// The sum with these values of the components, without a limit at black.
    pub(super) fn at(&self, face: Face, [s, t]: [f64; 2], w: &[f64]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut last = (0, bordered_taps(1, s, t));
        for (plane, w) in self.planes.iter().zip(w) {
            if plane.edge != last.0 {
                last = (plane.edge, bordered_taps(plane.edge, s, t));
            }
            let first = face as usize * (plane.edge + 2) * (plane.edge + 2);
            for (index, weight) in last.1 {
                let value = plane.values[first + index];
                (0..3).for_each(|channel| sum[channel] += w * weight * f64::from(value[channel]));
            }
        }
        sum
    }
}

/// What all texels of a fit share.
pub(super) struct Fit<'a> {
    field: Field<'a>,
    pub(super) basis: &'a ComponentBasis,
    options: ComponentOptions,
    /// w_k at the views, [view, component].
    w: Vec<f64>,
    /// Cosines and sines of m times the azimuth of a view, up to twice the highest order, [azimuth, m].
    turns: Vec<Vec<[f64; 2]>>,
    dark: f64,
}

/// The normal equations of a texel, for each channel.
pub(super) struct Texel {
    factors: [Factor; 3],
}

impl<'a> Fit<'a> {
    pub(super) fn new(
        reflection: &'a Reflection,
        material: &Material,
        basis: &'a ComponentBasis,
        options: ComponentOptions,
    ) -> Result<Self, ComponentError> {
        let (angles, lighting) = (view_angles(), reflection.lighting());
        let dark = BLACK_SHARE * reflection.light_mean();
        let lobes = Lobes::new(material, &angles, lighting.degree(), ORDERS)?;
        let baked = reflection.lamps().filter(|_| options.bake).map(|lamps| Baked {
            table: PointTable::new(material, &angles),
            points: lamps.points(),
            dark: dark as f32,
        });
        let w = view_places().into_iter().flat_map(|place| basis.at(place)).collect();
        let highest = basis.components().iter().map(|component| component.order).max().unwrap_or(0);
        let turns = (0..VIEWS).map(|view| turns(TAU * view as f64 / VIEWS as f64, 2 * highest)).collect();
        Ok(Self { field: Field::new(lighting, lobes, baked), basis, options, w, turns, dark })
    }

    /// The edge of a component's faces.
    pub(super) fn edge(&self, k: usize) -> usize {
        if self.options.half && k >= FULL_SIZE_COMPONENTS {
            self.options.edge.div_ceil(2)
        } else {
            self.options.edge
        }
    }

    /// The normal equations of a texel of a bordered face, for what `known` leaves of the light: the values
    /// [component, RGB] that are subtracted.
    pub(super) fn texel(&self, edge: usize, face: Face, index: usize, known: Option<&[[f64; 3]]>) -> Texel {
        let (row, column) = (index / (edge + 2), index % (edge + 2));
        let frame: DMat3 = face_frame(face, bordered_direction(edge, face, row, column));
        let values = self.field.views(&frame);
        let n = self.basis.components().len();
        let factor = |channel: usize| {
            let mut weights = vec![[0.0; RADII]; VIEWS];
            let mut targets = weights.clone();
            for (azimuth, (weights, targets)) in weights.iter_mut().zip(&mut targets).enumerate() {
                for radius in 0..RADII {
                    let value = values[(azimuth * 3 + channel) * RADII + radius];
                    let w = &self.w[(azimuth * RADII + radius) * n..][..n];
                    let rest =
                        value - known.map_or(0.0, |known| (0..n).map(|k| known[k][channel] * w[k]).sum());
                    let seen = value + self.dark.max(f64::MIN_POSITIVE);
                    weights[radius] = 1.0 / (seen * seen);
                    targets[radius] = rest / (seen * seen);
                }
            }
            self.normal(&self.series(&weights), &self.series(&targets))
        };
        Texel { factors: [factor(0), factor(1), factor(2)] }
    }

    /// The sums over the azimuths of values times cos(m phi) and sin(m phi), at each radius.
    fn series(&self, values: &[[f64; RADII]]) -> Vec<[[f64; RADII]; 2]> {
        let mut series = vec![[[0.0; RADII]; 2]; self.turns[0].len()];
        for (values, turns) in values.iter().zip(&self.turns) {
            for (series, turn) in series.iter_mut().zip(turns) {
                for (series, turn) in series.iter_mut().zip(turn) {
                    (0..RADII).for_each(|radius| series[radius] += turn * values[radius]);
                }
            }
        }
        series
    }

    /// The normal equations, from the series of the weights and of the weighted light. Products of two
    /// components are sums of the cosines, or sines, of the sum and the difference of their orders.
    fn normal(&self, weights: &[[[f64; RADII]; 2]], targets: &[[[f64; RADII]; 2]]) -> Factor {
        let (components, shares) = (self.basis.components(), shares());
        let n = components.len();
        let (mut matrix, mut right) = (vec![0.0; n * n], vec![0.0; n]);
        for (i, a) in components.iter().enumerate() {
            let radial: [f64; RADII] = std::array::from_fn(|radius| shares[radius] * a.radial[radius]);
            let target = &targets[a.order][usize::from(a.sine)];
            right[i] = (0..RADII).map(|radius| radial[radius] * target[radius]).sum();
            for (j, b) in components[..=i].iter().enumerate() {
                let part = usize::from(a.sine != b.sine);
                let (sum, difference) =
                    (&weights[a.order + b.order][part], &weights[a.order.abs_diff(b.order)][part]);
                // cos a cos b, sin a sin b; sin a cos b, cos a sin b.
                let signs = match (a.sine, b.sine) {
                    (false, false) => [0.5, 0.5],
                    (true, true) => [-0.5, 0.5],
                    (true, false) => [0.5, if a.order > b.order { 0.5 } else { -0.5 }],
                    (false, true) => [0.5, if b.order > a.order { 0.5 } else { -0.5 }],
                };
                let at = |radius: usize| {
                    let both = signs[0] * sum[radius] + signs[1] * difference[radius];
                    radial[radius] * b.radial[radius] * both
                };
                matrix[i * n + j] = (0..RADII).map(at).sum();
            }
        }
        Factor::new(n, &matrix, &right)
    }

    /// The map with the first components.
    pub(super) fn map(&self, count: usize, stop: Stop<'_>) -> Result<ComponentMap, ComponentError> {
        let full = if self.options.half { count.min(FULL_SIZE_COMPONENTS) } else { count };
        let basis = self.basis.first(count);
        // First the coarse components, then the others for what these leave.
        let coarse = self.planes(full..count, count, None, stop)?;
        let coarse = ComponentMap { basis: basis.clone(), planes: coarse };
        let known = (count > full).then_some((full, &coarse));
        let mut planes = self.planes(0..full, full, known, stop)?;
        planes.extend(coarse.planes);
        Ok(ComponentMap { basis, planes })
    }

    /// The maps with the first components, for each of these numbers of them, all of full resolution.
    pub(super) fn maps(&self, counts: &[usize], stop: Stop<'_>) -> Result<Vec<ComponentMap>, ComponentError> {
        let (edge, most) = (self.options.edge, self.basis.components().len());
        let side = edge + 2;
        let counts: Vec<usize> = counts.iter().map(|count| (*count).clamp(most.min(1), most)).collect();
        let row = |row: usize| {
            stop.check()?;
            let texel = |column: usize| {
                let texel = self.texel(edge, Face::ALL[row / side], row % side * side + column, None);
                counts.iter().map(|count| texel.solution(*count)).collect::<Vec<_>>()
            };
            Ok((0..side).map(texel).collect::<Vec<_>>())
        };
        let rows: Result<Vec<_>, ComponentError> = (0..6 * side).into_par_iter().map(row).collect();
        let texels: Vec<Vec<Vec<[f64; 3]>>> = rows?.into_iter().flatten().collect();
        let map = |(place, count): (usize, &usize)| {
            let plane = |k: usize| {
                let value = |texel: &Vec<Vec<[f64; 3]>>| texel[place][k].map(|value| value as f32);
                Plane { edge, values: texels.iter().map(value).collect() }
            };
            ComponentMap { basis: self.basis.first(*count), planes: (0..*count).map(plane).collect() }
        };
        Ok(counts.iter().enumerate().map(map).collect())
    }

    /// The planes of some components, of a fit of the first `count`; `known` are those from a number on that
    /// are fitted already.
    fn planes(
        &self,
        components: std::ops::Range<usize>,
        count: usize,
        known: Option<(usize, &ComponentMap)>,
        stop: Stop<'_>,
    ) -> Result<Vec<Plane>, ComponentError> {
        if components.is_empty() {
            return Ok(Vec::new());
        }
        let edge = self.edge(components.start);
        let (side, n) = (edge + 2, self.basis.components().len());
        let row = |row: usize| {
            stop.check()?;
            let face = Face::ALL[row / side];
            let texel = |column: usize| {
                let index = row % side * side + column;
                let left = known.map(|(first, map)| {
                    let mut left = vec![[0.0; 3]; n];
                    let place = |at: usize| (at as f64 - 0.5) / edge as f64;
                    map.rest(face, [place(column), place(row % side)], &mut left[first..]);
                    left
                });
                self.texel(edge, face, index, left.as_deref()).solution(count)
            };
            Ok((0..side).map(texel).collect::<Vec<_>>())
        };
        let rows: Result<Vec<_>, ComponentError> = (0..6 * side).into_par_iter().map(row).collect();
        let texels: Vec<Vec<[f64; 3]>> = rows?.into_iter().flatten().collect();
        let plane = |k: usize| {
            let values = texels.iter().map(|texel| texel[k].map(|value| value as f32)).collect();
            Plane { edge, values }
        };
        Ok(components.map(plane).collect())
    }
}

impl ComponentMap {
    /// The values of this map's planes at a place, also a little past the face's edge.
    fn rest(&self, face: Face, [s, t]: [f64; 2], values: &mut [[f64; 3]]) {
        for (plane, value) in self.planes.iter().zip(values) {
            let first = face as usize * (plane.edge + 2) * (plane.edge + 2);
            for (index, weight) in bordered_taps(plane.edge, s, t) {
                let texel = plane.values[first + index];
                (0..3).for_each(|channel| value[channel] += weight * f64::from(texel[channel]));
            }
        }
    }
}

impl Texel {
    /// U_k of the fit of the first components, [component, RGB].
    pub(super) fn solution(&self, count: usize) -> Vec<[f64; 3]> {
        let mut found = vec![[0.0; 3]; count];
        let mut of_channel = vec![0.0; count];
        for (channel, factor) in self.factors.iter().enumerate() {
            factor.solve_into(&mut of_channel);
            found.iter_mut().zip(&of_channel).for_each(|(found, value)| found[channel] = *value);
        }
        found
    }
}

/// A whole turn times the golden section: azimuths of samples.
pub(super) const GOLDEN_TURN: f64 = 0.618_033_988_749_894_9 * TAU;
