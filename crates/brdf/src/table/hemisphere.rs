//! Integrals of a function over a hemisphere of incident directions, times each harmonic.
//!
//! theta_i is measured from the normal, phi from the azimuth of the mirrored view R, where highlights are:
//! circles of [`Azimuths`], on panels in theta_i which are halved until Kronrod's and Gauss' rule agree. A
//! kink at the horizon, and one where light and view are equally high (max(N.L, N.V)), lie between panels.

use std::f64::consts::{FRAC_PI_2, PI};

use sh::{Basis, Degree};
use sphere::{DVec3, Direction};

use super::azimuths::{Azimuths, CircleMoments, Steps};
use crate::quadrature::{Panel, RULE};
use crate::{Lobe, Material};

/// The error that is aimed at, as a share of the greatest coefficient of a smooth model. Models whose kinks
/// lie anywhere have another, and so has a table, which has kinks between all of its nodes and is no more
/// accurate itself.
const ACCURACY: f64 = 4e-7;
const ACCURACY_OF_KINKS: f64 = 1e-4;
const ACCURACY_OF_TABLES: f64 = 1e-3;
/// The share of the error aimed at that a panel may have.
const SHARE: f64 = 0.125;
/// The most halvings of a panel.
const DEEPEST: usize = 24;
/// The most values for one view of a model; tables have fewer. What is left unrefined shows in the error.
const MOST_EVALUATIONS: usize = 250_000;
const MOST_EVALUATIONS_OF_TABLES: usize = 20_000;

/// Coefficients c_i in the frame of the surface, and how far they may be off.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewCoefficients {
    /// The coefficients c_i, row l*l + l + m, RGB.
    pub c: Vec<[f64; 3]>,
    /// The difference of two rules of quadrature: many times the error if rho_hat is smooth, about the error
    /// if it has kinks. 0 for a closed form.
    pub error: f64,
}

/// A value that is NaN or infinite: its incident direction.
pub(super) struct NotFiniteIncident(pub(super) Direction);

/// A half of the sphere.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Half {
    Upper,
    Lower,
}

/// The harmonics, rules and limits that are the same for every view.
pub(super) struct Hemisphere {
    basis: Basis,
    azimuths: Azimuths,
    /// The least width of a highlight: the tangent of the half vector's angle.
    width: f64,
    /// Whether a narrow highlight can be at another azimuth than that of R.
    strays: bool,
    /// The error that is aimed at, as a share of the greatest coefficient.
    accuracy: f64,
    /// The most values for one view.
    most: usize,
}

/// A panel in theta_i and what both rules find on it.
struct PanelIntegral {
    panel: Panel,
    kronrod: Vec<[f64; 3]>,
    error: f64,
}

impl Hemisphere {
    /// Prepares the integrals of a material's coefficients up to a degree.
    pub(super) fn new(material: &Material, degree: Degree) -> Self {
        let width = |lobe: &Lobe| match *lobe {
            Lobe::Cosine => 1.0,
            Lobe::Facets { x, y } => f64::from(x.min(y)),
            Lobe::Power { n, .. } => math::pow(f64::from(n) + 1.0, -0.5),
            Lobe::Band { width } => f64::from(width),
        };
        let accuracy = |leaf: &&Material| match leaf {
            Material::Measured(_) | Material::MeasuredAnisotropic(_) => ACCURACY_OF_TABLES,
            Material::PoulinFournier(_) => ACCURACY_OF_KINKS,
            _ => ACCURACY,
        };
        let accuracy = material.leaves().iter().map(accuracy).fold(ACCURACY, f64::max);
        Self {
            accuracy,
            most: if accuracy < ACCURACY_OF_TABLES { MOST_EVALUATIONS } else { MOST_EVALUATIONS_OF_TABLES },
            basis: Basis::new(degree),
            azimuths: Azimuths::new(degree.get()),
            width: material.lobes().iter().map(width).fold(1.0, f64::min),
            strays: !material.is_isotropic(),
        }
    }

    /// The integral of `value(incident)` times each harmonic over half of the sphere, for a view with z >= 0.
    pub(super) fn integrate(
        &self,
        half: Half,
        view: Direction,
        value: &dyn Fn(Direction) -> [f64; 3],
    ) -> Result<ViewCoefficients, NotFiniteIncident> {
        let theta_o = view.theta().min(FRAC_PI_2);
        let mut circle = CircleMoments::new(self.basis.degree().get());
        let ends = [[0.0, theta_o], [theta_o, FRAC_PI_2]].into_iter();
        let mut panels: Vec<Panel> = ends
            .flat_map(|[from, to]| Panel::split(from, to, 0.8))
            .filter(|panel| panel.from < panel.to)
            .collect();
        let mut parts = Vec::new();
        if self.accuracy > ACCURACY {
            // Circles far from the highlight need be no more accurate than the highlight makes worthwhile.
            let from_view = |panel: &Panel| (0.5 * (panel.from + panel.to) - theta_o).abs();
            panels.sort_by(|a, b| from_view(a).total_cmp(&from_view(b)));
        }
        let mut size: f64 = 0.0;
        for panel in panels {
            let allowed = if self.accuracy > ACCURACY { self.accuracy * SHARE * size } else { 0.0 };
            let part = self.part(panel, half, view, value, allowed, &mut circle)?;
            size = part.kronrod.as_flattened().iter().fold(size, |most, c| most.max(c.abs()));
            parts.push(part);
        }
        let mut sum = ViewCoefficients { c: vec![[0.0; 3]; self.basis.degree().rows()], error: 0.0 };
        parts.iter().for_each(|part| sum.add(&part.kronrod));
        let size = sum.c.as_flattened().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        let allowed = self.accuracy * SHARE * size;
        // The worst panel first, so that what is left when the values run out is the least.
        loop {
            let errors = parts.iter().map(|part| if part.panel.depth < DEEPEST { part.error } else { 0.0 });
            let worst = errors.enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b));
            let Some((worst, _)) = worst.filter(|(_, error)| *error > allowed) else { break };
            if circle.evaluations > self.most {
                break;
            }
            let halves = parts.swap_remove(worst).panel.halves();
            for panel in halves {
                parts.push(self.part(panel, half, view, value, allowed, &mut circle)?);
            }
        }
        sum.c.fill([0.0; 3]);
        for part in &parts {
            sum.add(&part.kronrod);
            sum.error += part.error;
        }
        turn(&mut sum.c, view.phi() + PI);
        Ok(sum)
    }

    /// Both rules on a panel.
    fn part(
        &self,
        panel: Panel,
        half: Half,
        view: Direction,
        value: &dyn Fn(Direction) -> [f64; 3],
        allowed: f64,
        circle: &mut CircleMoments,
    ) -> Result<PanelIntegral, NotFiniteIncident> {
        let degree = self.basis.degree();
        let mut rows = vec![0.0; degree.rows()];
        let mut part = PanelIntegral { panel, kronrod: vec![[0.0; 3]; degree.rows()], error: 0.0 };
        let mut gauss = part.kronrod.clone();
        let v = view.vector();
        // The azimuth of R is that of the view and half a turn.
        let (cos_r, sin_r) = (-math::cos(view.phi()), -math::sin(view.phi()));
        let sin_o = math::hypot(v.x, v.y);
        for node in RULE {
            let theta = panel.at(node);
            let (sine, cosine) = math::sin_cos(theta);
            let area = panel.radius() * sine;
            // The half vector's slope grows by 1 / (2 cot(theta)) along the circle.
            let width = 2.0 * self.width * (cosine + v.z.max(0.0)) / (sine + sin_o).max(1e-9);
            let steps = Steps::for_feature(width.max(1e-4), self.strays, 0.25 * self.accuracy);
            let up = if half == Half::Upper { cosine } else { -cosine };
            let at = |cos_phi: f64, sin_phi: f64| {
                let (x, y) = (cos_phi * cos_r - sin_phi * sin_r, sin_phi * cos_r + cos_phi * sin_r);
                Direction::from_unit(DVec3::new(sine * x, sine * y, up))
            };
            let mut place = Direction::Z;
            let sampled = self.azimuths.integrate(steps, allowed / (2.0 * area), circle, |c, s| {
                place = at(c, s);
                let rgb = value(place);
                rgb.iter().all(|value| value.is_finite()).then_some(rgb)
            });
            sampled.ok_or(NotFiniteIncident(place))?;
            part.error += area * node.kronrod * circle.error;
            self.basis.evaluate_into(at_zero_azimuth(sine, up), &mut rows);
            for l in 0..=degree.get() {
                let middle = l * l + l;
                for m in 0..=l {
                    let y = area * rows[middle + m];
                    for channel in 0..3 {
                        let moments = &circle.moments[channel];
                        let columns = if m == 0 { [0, 0] } else { [2 * m - 1, 2 * m] };
                        let c = y * moments[columns[0]];
                        part.kronrod[middle + m][channel] += node.kronrod * c;
                        gauss[middle + m][channel] += node.gauss * c;
                        if m > 0 {
                            let s = y * moments[columns[1]];
                            part.kronrod[middle - m][channel] += node.kronrod * s;
                            gauss[middle - m][channel] += node.gauss * s;
                        }
                    }
                }
            }
        }
        let found = part.kronrod.as_flattened().iter().zip(gauss.as_flattened());
        let (difference, size) = found.fold((0.0, 0.0), |(d, s): (f64, f64), (kronrod, gauss)| {
            (d.max((kronrod - gauss).abs()), s.max(kronrod.abs()))
        });
        // The longer rule's error is about the 1.6th power of the shorter one's.
        let shrinks = if size > 0.0 { 10.0 * (difference / size).sqrt() } else { 1.0 };
        part.error += difference * shrinks.min(1.0);
        Ok(part)
    }
}

fn at_zero_azimuth(sine: f64, cosine: f64) -> Direction {
    Direction::from_unit(DVec3::new(sine, 0.0, cosine))
}

/// The coefficients after a turn about the normal.
pub(super) fn turn(c: &mut [[f64; 3]], angle: f64) {
    for l in 0..c.len().isqrt() {
        let middle = l * l + l;
        for m in 1..=l {
            let (y, x) = math::sin_cos(m as f64 * angle);
            let (cosine, sine) = (c[middle + m], c[middle - m]);
            for channel in 0..3 {
                c[middle + m][channel] = cosine[channel] * x - sine[channel] * y;
                c[middle - m][channel] = cosine[channel] * y + sine[channel] * x;
            }
        }
    }
}

impl ViewCoefficients {
    fn add(&mut self, c: &[[f64; 3]]) {
        for (sum, c) in self.c.iter_mut().zip(c) {
            (0..3).for_each(|channel| sum[channel] += c[channel]);
        }
    }
}
