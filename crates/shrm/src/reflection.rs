//! The reflected light field B in spherical harmonics: lighting times BRDF [RH02, eqs. 5 and 14].
//!
//! B(R, w_o) = sum over l, m, p, q of L_lm rho_lpq D^l_mq(alpha) e^(i m beta) Y_pq(w_o). If rho_hat depends
//! only on the angle between w_i and the central direction, p = q = 0. Then D^l_m0(alpha) e^(i m beta) =
//! Lambda_l Y_lm(alpha, beta), Lambda_l = sqrt(4 pi / (2 l + 1)), and the field is a function of the central
//! direction alone: a reflection map with coefficients
//!
//! B_lm = Lambda_l rho_l00 Y_00 L_lm.

use std::f64::consts::PI;

use brdf::{BrdfCoefficients, Centre, Material};
use sh::{Expansion, Window, lambda, zonal_into};
use sphere::Rotation;

use crate::lamps::Lamps;
use crate::mean_lobe::MeanLobe;
use crate::plain::{Plain, mean_views};

/// The highest P of a map whose degrees were chosen for its light: (16 + 1)^2 coefficients.
pub const MOST_P: usize = 16;

/// Rows of views in a mean: far more than a map has degrees.
const MEAN_ROWS: usize = 256;

/// B_lmpq = L_lm rho_lpq, held as its two factors, both cut to the smaller degree, and the lamps beside it:
/// what this crate calls the field is without them unless it says otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Reflection {
    lighting: Expansion,
    brdf: BrdfCoefficients,
    lamps: Option<Lamps>,
    for_light: bool,
    parts: Option<Box<[Reflection; 2]>>,
}

/// A reflection depends on the view beyond the central direction, but one map cannot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the material depends on the view up to degree {p}: one reflection map cannot hold it")]
pub struct ViewDependent {
    /// The highest p with a coefficient that is not zero.
    pub p: usize,
}

impl Reflection {
    /// The reflection of `lighting` by a material: both cut to the smaller of their degrees, because the
    /// product has no degree that one of them lacks.
    pub fn convolve(lighting: &Expansion, brdf: &BrdfCoefficients) -> Self {
        let degree = lighting.degree().min(brdf.f());
        Self {
            lighting: lighting.to_degree(degree),
            brdf: brdf.cut(degree),
            lamps: None,
            for_light: false,
            parts: None,
        }
    }

    /// Returns the reflection with lights beside the lighting, which the series does not hold, and with the
    /// material; there may be no lights.
    #[must_use]
    pub fn with_lamps(self, lamps: Lamps) -> Self {
        Self { lamps: Some(lamps), ..self }
    }

    /// Returns the reflection without the lights beside the lighting; it still knows its material.
    #[must_use]
    pub fn without_lamps(self) -> Self {
        let parts = self.parts.map(|parts| Box::new(parts.map(Self::without_lamps)));
        let lamps = self.lamps.map(|lamps| Lamps { lights: Vec::new(), ..lamps });
        Self { lamps, parts, ..self }
    }

    /// Returns the reflection with the fields of its material's diffuse and specular part, whose sum it is:
    /// each is about its own centre, and has the lamps that it reflects.
    #[must_use]
    pub fn with_parts(self, parts: [Self; 2]) -> Self {
        Self { parts: Some(Box::new(parts)), ..self }
    }

    /// The fields of the material's diffuse and specular part, if it has two centres: engines look one up by
    /// the normal and the other by the reflection vector, and add them.
    pub fn parts(&self) -> Option<&[Self; 2]> {
        self.parts.as_deref()
    }

    /// Returns the reflection with the lamps in the lighting's series, cut at its degree.
    #[must_use]
    pub fn with_whole_light(&self) -> Self {
        let lights = self.lamps.as_ref().map(|lamps| lamps.lights.clone()).unwrap_or_default();
        let lighting = sh::Lighting { series: self.lighting.clone(), lights }.whole();
        Self { lighting, brdf: self.brdf.clone(), lamps: None, for_light: self.for_light, parts: None }
    }

    /// Returns the reflection marked as cut at degrees that were chosen for its light: see
    /// [`Reflection::is_for_light`].
    #[must_use]
    pub fn marked_for_light(self) -> Self {
        Self { for_light: true, ..self }
    }

    /// Whether the degrees were chosen for this light, so that what the cut leaves below zero is too little
    /// to be seen: exports set it to zero.
    pub fn is_for_light(&self) -> bool {
        self.for_light
    }

    /// Returns the reflection with a window on its series, which makes it ring less and blurs it.
    #[must_use]
    pub fn windowed(&self, window: Window) -> Self {
        let parts =
            self.parts.as_ref().map(|parts| Box::new(parts.each_ref().map(|part| part.windowed(window))));
        Self { lighting: window.apply(&self.lighting), parts, ..self.clone() }
    }

    /// Returns the reflection of the light after a rotation, lamps included: what [`Reflection::convolve`]
    /// makes of the turned light. It is exact, because the coefficients B_lmpq = L_lm rho_lpq [RH02, eq. 5]
    /// turn with L_lm. The material does not turn: it knows the light about its central direction.
    ///
    /// # Example: light from +X, turned by 90 degrees about +Z, is reflected toward +Y
    /// ```
    /// use brdf::{Choice, Lambert, Material, project};
    /// use sh::{Degree, Expansion};
    /// let mut light = Expansion::zero(Degree::new(1)?);
    /// light.coefficients_mut()[3] = [1.0; 3]; // Y_1,1, along x
    /// let white = Material::Lambert(Lambert::new([1.0; 3])?);
    /// let degrees = Choice::Degree { f: Degree::new(1)?, p: Degree::ZERO };
    /// let brdf = project(&white, degrees, sh::Stop::NEVER)?.coefficients;
    /// let field = shrm::Reflection::convolve(&light, &brdf);
    /// let quarter = sphere::Rotation::from_yaw_pitch_roll(std::f64::consts::FRAC_PI_2, 0.0, 0.0);
    /// let [x, y] = [sphere::Direction::X, sphere::Direction::Y];
    /// let [before, after] = [field.evaluate(x, x), field.rotated(quarter).evaluate(y, y)];
    /// assert!((after[0] - before[0]).abs() < 1e-15);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn rotated(&self, rotation: Rotation) -> Self {
        let lights = self.lamps.as_ref().map(|lamps| lamps.lights.clone()).unwrap_or_default();
        let turned = sh::Lighting { series: self.lighting.clone(), lights }.rotated(rotation);
        let lamps = self.lamps.as_ref();
        Self {
            lighting: turned.series,
            brdf: self.brdf.clone(),
            lamps: lamps.map(|lamps| Lamps { lights: turned.lights, material: lamps.material.clone() }),
            for_light: self.for_light,
            parts: self.parts().map(|parts| Box::new(parts.each_ref().map(|part| part.rotated(rotation)))),
        }
    }

    /// The lights beside the lighting's series, and the material that reflects them; `None` if the series
    /// holds all light.
    pub fn lamps(&self) -> Option<&Lamps> {
        self.lamps.as_ref().filter(|lamps| !lamps.lights.is_empty())
    }

    /// The lights beside the series, of which there may be none, and the material, if it is known.
    pub(crate) fn every_lamp(&self) -> Option<&Lamps> {
        self.lamps.as_ref()
    }

    /// The material of the reflection, if it is known: it is with [`Reflection::with_lamps`].
    pub fn material(&self) -> Option<&Material> {
        self.lamps.as_ref().map(|lamps| &lamps.material)
    }

    /// The mean radiance of the light, lamps included, over the sphere and the three channels.
    pub fn light_mean(&self) -> f64 {
        let lights = self.lamps.as_ref().map(|lamps| lamps.lights.clone()).unwrap_or_default();
        sh::Lighting { series: self.lighting.clone(), lights }.mean()
    }

    /// The lighting's coefficients L_lm.
    pub fn lighting(&self) -> &Expansion {
        &self.lighting
    }

    /// The BRDF's coefficients rho_lpq.
    pub fn brdf(&self) -> &BrdfCoefficients {
        &self.brdf
    }

    /// Reflected radiance as a function of the central direction, for a radially symmetric material.
    ///
    /// Its value at the direction that the material is centred on (the reflection vector R, or the normal N)
    /// is the radiance toward the viewer. Exact up to the degree; tests compare it with brute force.
    ///
    /// # Errors
    /// If a coefficient with p > 0 is not zero.
    ///
    /// # Example: a white surface reflects a constant sky unchanged
    /// ```
    /// use brdf::{Choice, Lambert, Material, project};
    /// use sh::{Degree, Expansion};
    /// let sky = Expansion::from_coefficients(Degree::ZERO, vec![[0.2, 0.3, 0.5]]).unwrap();
    /// let white = Material::Lambert(Lambert::new([1.0; 3])?);
    /// let degrees = Choice::Degree { f: Degree::ZERO, p: Degree::ZERO };
    /// let brdf = project(&white, degrees, sh::Stop::NEVER)?.coefficients;
    /// let reflected = shrm::Reflection::convolve(&sky, &brdf).radial()?;
    /// assert!((reflected.get(0, 0)[2] - 0.5).abs() < 1e-15);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn radial(&self) -> Result<Expansion, ViewDependent> {
        if let Some(p) = self.highest_p() {
            return Err(ViewDependent { p });
        }
        Ok(self.plain(Plain::Mean))
    }

    /// One map of the central direction alone, however the material depends on the view: the coefficients
    ///
    /// B_lm = Lambda_l L_lm sum over p of rho_lp0 Y_p0(w_o),
    ///
    /// in the mean over views or head on. Exact for a radially symmetric material, for which both are
    /// the same.
    ///
    /// Terms with q > 0 have no part in it: they are zero at w_o = +Z, and in the mean around the central
    /// direction.
    ///
    /// Head on is the pole of w_o, where a cut at degree P adds up all that it rings: by several percent,
    /// although it is right in the mean. So if the material is known, its own value there is taken.
    pub fn plain(&self, view: Plain) -> Expansion {
        if let (Plain::HeadOn, Some(material)) = (view, self.material()) {
            return MeanLobe::plain(material, view).reflect(&self.lighting, self.brdf.f());
        }
        let mut y_p0 = vec![0.0; self.brdf.p().get() + 1];
        match (view, self.brdf.centre()) {
            // Seen from all sides, the views about R are spread evenly: only p = 0 has a mean.
            (Plain::Mean, Centre::Reflection) => y_p0[0] = 1.0 / (4.0 * PI).sqrt(),
            (Plain::Mean, centre) => {
                let mut row = y_p0.clone();
                for (theta, weight) in mean_views(centre, MEAN_ROWS) {
                    zonal_into(math::cos(theta), &mut row);
                    y_p0.iter_mut().zip(&row).for_each(|(sum, y)| *sum += weight * y);
                }
            }
            (Plain::HeadOn, Centre::Tangent) => zonal_into(0.0, &mut y_p0),
            (Plain::HeadOn, _) => zonal_into(1.0, &mut y_p0),
        }
        let mut field = self.lighting.clone();
        let rows = field.coefficients_mut();
        for l in 0..=self.brdf.f().get() {
            let mut factor = [0.0; 3];
            for (p, y) in y_p0.iter().enumerate() {
                let rho = self.brdf.get(l, p, 0);
                for channel in 0..3 {
                    factor[channel] += lambda(l) * rho[channel] * y;
                }
            }
            for row in &mut rows[l * l..(l + 1) * (l + 1)] {
                for channel in 0..3 {
                    row[channel] *= factor[channel];
                }
            }
        }
        field
    }

    /// Whether the light reflected about any central direction is the same all around it: every rho_lpq with
    /// q > 0 is zero.
    pub fn is_azimuth_free(&self) -> bool {
        let side = self.brdf.p().get() + 1;
        self.brdf.rho().chunks_exact(side).all(|row| row[1..].iter().all(|rho| *rho == [0.0; 3]))
    }

    /// The highest p > 0 that has a coefficient.
    fn highest_p(&self) -> Option<usize> {
        let side = self.brdf.p().get() + 1;
        let used = |p: usize| {
            (0..=self.brdf.f().get()).any(|l| (0..side).any(|q| self.brdf.get(l, p, q) != [0.0; 3]))
        };
        (1..side).rev().find(|&p| used(p))
    }
}
