//! The samples at which cuts are compared: central directions spread over the sphere, and at each of them
//! views as a ball shows them to a distant camera.

use brdf::{BrdfCoefficients, Centre};
use rayon::prelude::*;
use sh::f64x4::{F64x4, LANES, SimdLevel};
use sh::{Basis, Degree, Expansion, Stop, Stopped};
use sphere::{Direction, spiral};

use crate::degree_rule::{DegreeRule, rms_of_cuts};
use crate::lamps::{LampPoints, Lamps, in_frame};
use crate::reflection::MOST_P;
use crate::turned_light::{OfViews, Sums, TurnedLight, VIEWS};
use crate::{Reflection, frame};

/// The degrees F that are tried, besides the highest.
const TRIED_F: [usize; 19] = [2, 4, 6, 8, 10, 12, 15, 20, 25, 30, 40, 50, 60, 80, 100, 120, 150, 180, 215];

/// The degrees P that are tried.
const TRIED_P: [usize; 11] = [0, 1, 2, 3, 4, 5, 6, 8, 10, 12, MOST_P];

/// The light that is added to a field before it is seen: a cut shows less beside more light.
#[derive(Clone, Copy)]
pub(super) struct Beside<'a> {
    pub(super) lamps: Option<&'a Lamps>,
    /// The lamps that the diffuse part reflects.
    pub(super) of_diffuse: Option<&'a LampPoints<'a>>,
    /// The field of the same material's diffuse part, about the normal, as it is cut and before; the other is
    /// about the reflection vector.
    pub(super) diffuse: Option<[&'a Reflection; 2]>,
}

impl Beside<'_> {
    /// The radiance of the diffuse part: with its cut, and without.
    fn diffuse(&self, central: Direction, outgoing: Direction) -> [[f64; 3]; 2] {
        let Some(fields) = self.diffuse else { return [[0.0; 3]; 2] };
        let view = frame(central).apply(outgoing);
        let normal = central.vector() + view.vector();
        let normal = if normal.length() > 0.0 { Direction::normalised(normal) } else { central };
        let lit = self.of_diffuse.map_or([0.0; 3], |lamps| lamps.radiance(normal, view));
        fields.map(|field| {
            let soft = field.evaluate(normal, view);
            std::array::from_fn(|channel| soft[channel].max(0.0) + lit[channel])
        })
    }
}

/// Lamps and their points.
type PointedLamps<'a> = (&'a Lamps, &'a [(Direction, [f64; 3])]);

/// The degrees that are tried, and those that they are compared with.
pub(super) struct Trial {
    /// The number of central directions.
    centrals: usize,
    pub(super) f: Vec<usize>,
    pub(super) p: Vec<usize>,
    reference_p: usize,
    centre: Centre,
    /// The RMS of what each P leaves out, as a share.
    pub(super) rms: Vec<f64>,
}

/// Radiance at one central direction and view: what is beside the cut field and beside the field at the
/// highest degrees, that field, and the cut field for each F and P.
pub(super) struct Sample {
    pub(super) beside: [[f64; 3]; 2],
    pub(super) reference: [f64; 3],
    pub(super) cuts: Vec<[f64; 3]>,
}

impl Trial {
    pub(super) fn new(
        lighting: &Expansion,
        brdf: &BrdfCoefficients,
        centrals: usize,
        rule: Option<DegreeRule>,
    ) -> Self {
        let (most_f, most_p) = (brdf.f().min(lighting.degree()).get(), brdf.p().get());
        let mut f: Vec<usize> = TRIED_F.into_iter().filter(|f| *f < most_f).collect();
        f.push(most_f);
        let mut p: Vec<usize> = TRIED_P.into_iter().filter(|p| *p < most_p.min(MOST_P)).collect();
        p.push(most_p.min(MOST_P));
        if let Some(rule) = rule {
            p = (0..=most_p.min(rule.most_p.max(MOST_P))).collect();
        }
        let rms = rms_of_cuts(&lighting.to_degree(lighting.degree().min(brdf.f())), brdf);
        Self { centrals, f, p, reference_p: most_p, centre: brdf.centre(), rms }
    }

    /// A trial of one pair of degrees, at the samples of this one.
    pub(super) fn of_one(self, f: Degree, p: Degree) -> Self {
        Self { f: vec![f.get()], p: vec![p.get()], reference_p: p.get(), ..self }
    }

    /// The samples of all central directions.
    pub(super) fn all_samples(
        &self,
        turned: &TurnedLight,
        brdf: &BrdfCoefficients,
        beside: Beside<'_>,
        stop: Stop<'_>,
    ) -> Result<Vec<Sample>, Stopped> {
        let points = beside.lamps.map(Lamps::points);
        let lamps = beside.lamps.zip(points.as_deref());
        let sample = |index| stop.check().map(|()| self.samples(index, turned, brdf, (lamps, beside)));
        let samples: Result<Vec<_>, Stopped> =
            (0..self.centrals).into_par_iter().with_max_len(2).map(sample).collect();
        Ok(samples?.into_iter().flatten().collect())
    }

    /// The samples of one central direction; the lamps come with their points.
    fn samples(
        &self,
        index: usize,
        turned: &TurnedLight,
        brdf: &BrdfCoefficients,
        (lamps, beside): (Option<PointedLamps<'_>>, Beside<'_>),
    ) -> Vec<Sample> {
        let central = spiral(index, self.centrals);
        let lights = lamps.map(|(lamps, points)| (lamps, in_frame(points, central)));
        let degree = Degree::new(self.reference_p).unwrap_or(Degree::ZERO);
        let basis = Basis::new(degree);
        let mut y = vec![0.0; degree.rows()];
        let mut views: Vec<OfViews> = vec![[F64x4::ZERO; VIEWS / LANES]; degree.rows()];
        let mut beside_views = Vec::with_capacity(VIEWS);
        for view in 0..VIEWS {
            let outgoing = seen(self.centre, index * VIEWS + view);
            basis.evaluate_into(outgoing, &mut y);
            for (views, y) in views.iter_mut().zip(&y) {
                views[view / LANES].0[view % LANES] = *y;
            }
            let lit = lights.as_ref().map_or([0.0; 3], |(lamps, lights)| lamps.seen(lights, outgoing));
            let diffuse = beside.diffuse(central, outgoing);
            beside_views
                .push(diffuse.map(|soft| std::array::from_fn(|channel| lit[channel] + soft[channel])));
        }
        let sums = Sums { light: turned.at(index), brdf, f: &self.f, p: &self.p, views: &views };
        let radiance = SimdLevel::detect().run(sums);
        let at = |sums: &[OfViews; 3], view: usize| {
            std::array::from_fn(|channel| sums[channel][view / LANES].0[view % LANES])
        };
        let sample = |(view, beside)| Sample {
            beside,
            reference: radiance.last().map_or([0.0; 3], |sums| at(sums, view)),
            cuts: radiance[..radiance.len() - 1].iter().map(|sums| at(sums, view)).collect(),
        };
        beside_views.into_iter().enumerate().map(sample).collect()
    }
}

impl Sample {
    /// The errors of a cut, one for each channel.
    pub(super) fn stops(&self, trial: &Trial, f: usize, p: usize, dark: f64) -> [f64; 3] {
        let cut = self.cuts[f * trial.p.len() + p];
        std::array::from_fn(|channel| {
            let seen =
                |value: f64, beside: [f64; 3]| value.max(0.0) + beside[channel] + dark.max(f64::MIN_POSITIVE);
            let [beside_cut, beside_reference] = self.beside;
            let right = seen(self.reference[channel], beside_reference);
            math::log2(seen(cut[channel], beside_cut) / right).abs()
        })
    }
}

/// The view of a sample in the frame of the central direction: as a ball shows views to a distant camera, the
/// squared sine of the angle between normal and view is uniform. About R that is uniform over the sphere.
pub(crate) fn seen(centre: Centre, index: usize) -> Direction {
    // A sequence of low discrepancy in two dimensions (R2: Roberts 2018).
    let share = |step: f64| (0.5 + index as f64 * step).fract();
    let (u, phi) = (share(0.754_877_666_246_692_8), std::f64::consts::TAU * share(0.569_840_290_998_053_3));
    match centre {
        Centre::Reflection => Direction::from_angles(math::acos(1.0 - 2.0 * u), phi),
        Centre::Normal => Direction::from_angles(math::asin(u.sqrt()), phi),
        Centre::Tangent => {
            // About the normal +X, seen from the tangent +Z.
            let v = Direction::from_angles(math::asin(u.sqrt()), phi).vector();
            Direction::normalised(sphere::DVec3::new(v.z, v.y, v.x))
        }
    }
}
