//! How much of a reflected light field a truncation to degrees (F, P) loses: the true loss, what the BRDF and
//! the lighting alone say about it, and a bound that is certain ([Ram02, eqs. 5.15 to 5.19];
//! [RH02, sec. 5.1 and app. B]).
//!
//! Functions D^l_mq(alpha) e^(i m beta) are orthogonal over the sphere of central directions with norm
//! Lambda_l^2 = 4 pi / (2 l + 1), and Y_pq(w_o) are orthonormal over views, so that the energy of the field,
//! the integral of B^2 over both, is
//!
//! sum over l, m, p, q of Lambda_l^2 |L_lm|^2 |rho_lpq|^2, q of both signs,
//!
//! for each channel by itself: with L_l and rho_lp the energies of lighting and BRDF by degree, the sum of
//! Lambda_l^2 L_l rho_lp. What a truncation loses is the part of that sum that it cuts.
//!
//! Without the field there are estimates. A share of energy that the BRDF loses, or the lesser one of BRDF
//! and lighting, tends to be more than the field loses, because light falls off with l too. Lighting has no
//! P, so that the lesser one is taken of what F cuts, and what P cuts of the BRDF is added. [Ram02, eq. 5.19]
//! bounds the loss by putting all residual energy into degree F + 1, with Lambda_(F+1) as printed, where an
//! energy carries its square, and without what P cuts at l <= F.
//! [`TruncationEstimate::bound_with_p`] has both:
//!
//! Lambda_(F+1)^2 L(l > F) rho(l > F) + sum over l <= F of Lambda_l^2 L_l rho_l(p > P).
//!
//! BRDF energy that the given coefficients lack lies at unknown (l, p): it is counted at the degrees where it
//! weighs most, so that the bound holds against the whole field and not only up to the degree at hand.

use std::f64::consts::PI;

use sh::{energy_per_degree, lambda};

use crate::Reflection;

/// Energies by degree of a field known to a high degree.
#[derive(Clone, Debug, PartialEq)]
pub struct Accuracy {
    /// The energies L_l of the lighting, RGB.
    lighting: Vec<[f64; 3]>,
    /// The energies rho_lp over both signs of q, shape [F+1, P+1], RGB.
    brdf: Vec<[f64; 3]>,
    p: usize,
    lighting_total: [f64; 3],
    /// The BRDF's energy past the high degrees, in any channel.
    brdf_unknown: f64,
}

/// Shares of the field's energy that a truncation to degrees (F, P) loses, each 0 to 1, all channels
/// together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruncationEstimate {
    /// The degree in the central direction.
    pub f: usize,
    /// The degree in the view.
    pub p: usize,
    /// The share of the field at the high degrees that the truncation loses.
    pub truth: f64,
    /// The share of the lighting's own energy that the lighting loses [Ram02, eq. 5.15]; it does not depend
    /// on P.
    pub by_light: f64,
    /// The share of the BRDF's own energy that the BRDF loses [Ram02, eq. 5.18].
    pub by_brdf: f64,
    /// The lesser one of the shares that BRDF and lighting lose past F, and what the BRDF loses past P at l
    /// <= F.
    pub by_min: f64,
    /// The bound of [Ram02, eq. 5.19] as it is printed.
    pub bound_printed: f64,
    /// The bound that holds: see the module's text.
    pub bound_with_p: f64,
}

impl Accuracy {
    /// The energies of a field known to high degrees.
    ///
    /// The totals are the integrals of L^2 over the sphere, RGB ([`sh::image_energy`]), and of rho_hat^2 over
    /// both directions, summed over channels ([`brdf::Projection::total`]): what the coefficients' energies
    /// add up to if no degree is cut. A total below that sum, as rounding makes it, counts as that sum.
    pub fn of(high: &Reflection, lighting_total: [f64; 3], brdf_total: f64) -> Self {
        let (coefficients, lighting) = (high.brdf(), energy_per_degree(high.lighting()));
        let p = coefficients.p().get();
        let mut brdf = vec![[0.0; 3]; lighting.len() * (p + 1)];
        for (index, energy) in brdf.iter_mut().enumerate() {
            let (l, p) = (index / (p + 1), index % (p + 1));
            for q in 0..=l.min(p) {
                let signs = if q == 0 { 1.0 } else { 2.0 };
                let rho = coefficients.get(l, p, q);
                for channel in 0..3 {
                    energy[channel] += signs * rho[channel] * rho[channel];
                }
            }
        }
        let known = |channel| lighting.iter().map(|energy: &[f64; 3]| energy[channel]).sum();
        let lighting_total = std::array::from_fn(|channel| lighting_total[channel].max(known(channel)));
        let brdf_unknown = (brdf_total - brdf.as_flattened().iter().sum::<f64>()).max(0.0);
        Self { lighting, brdf, p, lighting_total, brdf_unknown }
    }

    /// The high degree F.
    pub fn f(&self) -> usize {
        self.lighting.len() - 1
    }

    /// The high degree P.
    pub fn p(&self) -> usize {
        self.p
    }

    /// The integral of B^2 over central directions and views, RGB, of the field at the high degrees.
    pub fn energy(&self) -> [f64; 3] {
        std::array::from_fn(|channel| self.held(channel, self.f(), self.p))
    }

    /// The root mean square of what a share of the energy means: over all central directions, views and
    /// channels, in the unit of radiance.
    pub fn rms(&self, share: f64) -> f64 {
        let directions = math::powi(4.0 * PI, 2);
        (share * self.energy().iter().sum::<f64>() / (3.0 * directions)).sqrt()
    }

    /// The shares that a truncation to (f, p) loses; degrees past the high ones cut nothing.
    ///
    /// # Example: a truncation that cuts nothing loses nothing
    /// ```
    /// use brdf::{Choice, Lambert, Material, project};
    /// use sh::{Degree, Expansion};
    /// let sky = Expansion::from_coefficients(Degree::ZERO, vec![[1.0; 3]]).unwrap();
    /// let white = Material::Lambert(Lambert::new([1.0; 3])?);
    /// let degrees = Choice::Degree { f: Degree::ZERO, p: Degree::ZERO };
    /// let brdf = project(&white, degrees, sh::Stop::NEVER)?.coefficients;
    /// let field = shrm::Reflection::convolve(&sky, &brdf);
    /// let accuracy = shrm::accuracy::Accuracy::of(&field, [1.0; 3], 2.0);
    /// assert_eq!(accuracy.at(0, 0).truth, 0.0);
    /// assert_eq!(accuracy.at(0, 0).by_min, 0.0, "the sky has no other degree");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn at(&self, f: usize, p: usize) -> TruncationEstimate {
        let (f, p) = (f.min(self.f()), p.min(self.p));
        let sum = |of: &dyn Fn(usize) -> f64| (0..3).map(of).sum::<f64>();
        let whole = sum(&|channel| self.energy()[channel]);
        let held = sum(&|channel| self.held(channel, f, p));
        let brdf_left = sum(&|channel| self.brdf_left(channel, f, p)) + self.brdf_unknown;
        let brdf_total = self.brdf.as_flattened().iter().sum::<f64>() + self.brdf_unknown;
        let by_brdf = share(brdf_left, brdf_total);
        let by_light = share(sum(&|channel| self.light_left(channel, f)), self.lighting_total.iter().sum());
        let past_f = sum(&|channel| self.brdf_left(channel, f, self.p)) + self.brdf_unknown;
        let by_min = by_light.min(share(past_f, brdf_total)) + share(brdf_left - past_f, brdf_total);
        let most_light = (0..3).map(|channel| self.light_left(channel, f)).fold(0.0, f64::max);
        let printed = lambda(f + 1)
            * (sum(&|channel| self.light_left(channel, f) * self.brdf_left(channel, f, p))
                + most_light * self.brdf_unknown);
        let heaviest = (0..3).map(|channel| self.heaviest(channel, f)).fold(0.0, f64::max);
        let certain = sum(&|channel| self.lost(channel, f, p)) + heaviest * self.brdf_unknown;
        TruncationEstimate {
            f,
            p,
            truth: share((whole - held).max(0.0), whole),
            by_light,
            by_brdf,
            by_min: by_min.min(1.0),
            bound_printed: share(printed, held + printed),
            bound_with_p: share(certain, held + certain),
        }
    }

    /// [`Accuracy::at`] for every F up to the high one.
    pub fn curve(&self, p: usize) -> Vec<TruncationEstimate> {
        (0..=self.f()).map(|f| self.at(f, p)).collect()
    }

    /// The degrees [F, P] at which the BRDF alone loses at most this share of its energy: first the least P
    /// at the high F, then the least F at that P [RH02, sec. 5.1 and app. C]. `None` if the high degrees lose
    /// more.
    pub fn least_degrees(&self, tolerance: f64) -> Option<[usize; 2]> {
        let is_enough = |f: usize, p: usize| self.at(f, p).by_brdf <= tolerance;
        let p = (0..=self.p).find(|p| is_enough(self.f(), *p))?;
        let f = (0..=self.f()).find(|f| is_enough(*f, p))?;
        Some([f, p])
    }

    fn brdf(&self, l: usize, p: usize) -> [f64; 3] {
        self.brdf[l * (self.p + 1) + p]
    }

    /// Lambda_l^2 L_l.
    fn weight(&self, channel: usize, l: usize) -> f64 {
        lambda(l) * lambda(l) * self.lighting[l][channel]
    }

    /// The energy of the field up to (f, p).
    fn held(&self, channel: usize, f: usize, p: usize) -> f64 {
        let of = |l| self.weight(channel, l) * (0..=p).map(|p| self.brdf(l, p)[channel]).sum::<f64>();
        (0..=f).map(of).sum()
    }

    /// The energy of the lighting past degree f.
    fn light_left(&self, channel: usize, f: usize) -> f64 {
        let held: f64 = self.lighting[..=f].iter().map(|energy| energy[channel]).sum();
        (self.lighting_total[channel] - held).max(0.0)
    }

    /// The energy of the BRDF's coefficients past (f, p).
    fn brdf_left(&self, channel: usize, f: usize, p: usize) -> f64 {
        let of = |l| (if l <= f { p + 1 } else { 0 }..=self.p).map(move |p| self.brdf(l, p)[channel]);
        (0..=self.f()).flat_map(of).sum()
    }

    /// The most energy that the field can have past l = f, for each unit of the BRDF's energy there.
    fn past_f(&self, channel: usize, f: usize) -> f64 {
        lambda(f + 1) * lambda(f + 1) * self.light_left(channel, f)
    }

    /// The most that the coefficients of the BRDF can have of the field past (f, p).
    fn lost(&self, channel: usize, f: usize, p: usize) -> f64 {
        let cut_by_p = |l| (p + 1..=self.p).map(|p| self.brdf(l, p)[channel]).sum::<f64>();
        let past_p: f64 = (0..=f).map(|l| self.weight(channel, l) * cut_by_p(l)).sum();
        self.past_f(channel, f) * self.brdf_left(channel, f, self.p) + past_p
    }

    /// The most of the field that a unit of the BRDF's energy can make outside what a truncation to f holds.
    fn heaviest(&self, channel: usize, f: usize) -> f64 {
        (0..=f).map(|l| self.weight(channel, l)).fold(self.past_f(channel, f), f64::max)
    }
}

/// The share that a part has of a whole; 0 if the whole is 0.
fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { (part / whole).clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame;
    use brdf::{BrdfCoefficients, Centre};
    use sh::{Degree, Expansion, quadrature::gauss_legendre};
    use sphere::Direction;

    /// Numbers between -1 and 1 without a pattern that matters here.
    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    fn degree(l: usize) -> Degree {
        Degree::new(l).unwrap()
    }

    /// A lighting and a BRDF of random coefficients that fall with l and p as (1 + l)^-fall, (1 + p)^-fall.
    fn field(seed: u64, f: usize, p: usize, fall: f64) -> Reflection {
        let mut next = noise(seed);
        let mut colour = |scale: f64| std::array::from_fn(|_| scale * next());
        let mut lighting = Expansion::zero(degree(f));
        for l in 0..=f {
            lighting.coefficients_mut()[l * l..(l + 1) * (l + 1)]
                .fill_with(|| colour((1.0 + l as f64).powf(-0.5 * fall)));
        }
        let mut rho = vec![[0.0; 3]; (f + 1) * (p + 1) * (p + 1)];
        for l in 0..=f {
            for at in 0..=p {
                for q in 0..=l.min(at) {
                    rho[(l * (p + 1) + at) * (p + 1) + q] =
                        colour(((1.0 + l as f64) * (1.0 + at as f64)).powf(-fall));
                }
            }
        }
        let brdf = BrdfCoefficients::new(Centre::Reflection, degree(f), degree(p), rho).unwrap();
        Reflection::convolve(&lighting, &brdf)
    }

    /// Returns the field with its coefficients cut to degrees f and p.
    fn cut(field: &Reflection, f: usize, p: usize) -> Reflection {
        let (brdf, side) = (field.brdf(), p + 1);
        let at = |i: usize| brdf.get(i / (side * side), i / side % side, i % side);
        let rho = (0..(f + 1) * side * side).map(at).collect();
        let brdf = BrdfCoefficients::new(brdf.centre(), degree(f), degree(p), rho).unwrap();
        Reflection::convolve(&field.lighting().to_degree(degree(f)), &brdf)
    }

    fn totals(field: &Reflection) -> ([f64; 3], f64) {
        let accuracy = Accuracy::of(field, [0.0; 3], 0.0);
        (accuracy.lighting_total, accuracy.brdf.as_flattened().iter().sum())
    }

    /// The integral of the squared difference over central directions and views, by quadrature that is exact
    /// for it: its degree is 2 F in the central direction and 2 P in the view.
    #[test]
    fn the_energy_cut_is_the_mean_square_of_the_difference() {
        let (f, p) = (5, 3);
        let high = field(7, f, p, 0.3);
        let accuracy = Accuracy::of(&high, [0.0; 3], 0.0);
        let directions = |l: usize| {
            let (theta, weights) = gauss_legendre(l + 1);
            let columns = 2 * l + 2;
            let azimuth = std::f64::consts::TAU / columns as f64;
            let mut all = Vec::new();
            for (theta, weight) in theta.into_iter().zip(weights) {
                for column in 0..columns {
                    all.push((Direction::from_angles(theta, azimuth * column as f64), weight * azimuth));
                }
            }
            all
        };
        let (centrals, views) = (directions(f), directions(p));
        for (low_f, low_p) in [(5, 2), (2, 3), (3, 1), (0, 0)] {
            let low = cut(&high, low_f, low_p);
            let (mut lost, mut whole) = (0.0, 0.0);
            for &(central, weight) in &centrals {
                for &(outgoing, solid_angle) in &views {
                    let view = frame(central).apply(outgoing);
                    let (a, b) = (high.evaluate(central, view), low.evaluate(central, view));
                    for channel in 0..3 {
                        lost += weight * solid_angle * (a[channel] - b[channel]).powi(2);
                        whole += weight * solid_angle * a[channel] * a[channel];
                    }
                }
            }
            let energy: f64 = accuracy.energy().iter().sum();
            assert!((whole / energy - 1.0).abs() < 1e-11, "{whole} {energy}");
            let truth = accuracy.at(low_f, low_p).truth;
            assert!((lost / whole - truth).abs() < 1e-11, "[{low_f}, {low_p}]: {} {truth}", lost / whole);
            let rms = (lost / (3.0 * (4.0 * PI).powi(2))).sqrt();
            assert!((accuracy.rms(truth) / rms - 1.0).abs() < 1e-9);
        }
    }

    /// Compares the bound with a field of which the coefficients at hand hold only a part.
    #[test]
    fn the_bound_holds_for_the_whole_field_whatever_is_known_of_it() {
        let mut tightest = 0.0_f64;
        for seed in 1..40 {
            let fall = [0.0, 0.5, 1.0, 2.0][seed as usize % 4];
            let world = field(seed, 10, 6, fall);
            let (light, brdf) = totals(&world);
            let true_error = Accuracy::of(&world, light, brdf);
            for known in [world.clone(), cut(&world, 7, 4), cut(&world, 10, 2)] {
                let accuracy = Accuracy::of(&known, light, brdf);
                for f in 0..=accuracy.f() {
                    for p in 0..=accuracy.p() {
                        let (truth, bound) = (true_error.at(f, p).truth, accuracy.at(f, p).bound_with_p);
                        assert!(truth <= bound + 1e-12, "seed {seed} [{f}, {p}]: {truth} {bound}");
                        tightest = tightest.max(truth / bound.max(1e-300));
                    }
                }
            }
        }
        assert!(tightest > 0.9, "somewhere it is nearly met: {tightest}");
    }

    /// With P cut to 0 the printed bound takes the loss at l <= F for none: at the high F it is 0, and the
    /// loss is not.
    #[test]
    fn the_printed_bound_does_not_see_what_p_cuts() {
        let world = field(3, 8, 4, 0.5);
        let (light, brdf) = totals(&world);
        let estimate = Accuracy::of(&world, light, brdf).at(8, 0);
        assert!(estimate.truth > 0.1 && estimate.bound_printed < 1e-12, "{estimate:?}");
        assert!(
            (estimate.bound_with_p - estimate.truth).abs() < 1e-12,
            "what is known is exact: {estimate:?}"
        );
    }

    #[test]
    fn nothing_is_lost_if_either_factor_is_band_limited() {
        let world = field(5, 8, 0, 0.2);
        let mut lighting = world.lighting().to_degree(degree(4)).to_degree(degree(8));
        lighting.coefficients_mut()[24] = [1.0; 3];
        let field = Reflection::convolve(&lighting, world.brdf());
        let (light, brdf) = totals(&field);
        let estimate = Accuracy::of(&field, light, brdf).at(4, 0);
        assert_eq!((estimate.truth, estimate.by_min, estimate.bound_with_p), (0.0, 0.0, 0.0));
        assert!(estimate.by_brdf > 0.1);
    }

    /// The lesser share is that of light and BRDF where only F cuts, and has all that P cuts; the least
    /// degrees lose what they may, and one degree less loses more.
    #[test]
    fn light_lowers_what_f_cuts_alone() {
        let world = field(9, 8, 4, 0.5);
        let (light, brdf) = totals(&world);
        let accuracy = Accuracy::of(&world, light, brdf);
        for f in 0..=8 {
            let cut = accuracy.at(f, 4);
            assert!((cut.by_min - cut.by_brdf.min(cut.by_light)).abs() < 1e-12, "{cut:?}");
        }
        let cut = accuracy.at(8, 1);
        assert!(cut.by_light < 1e-12 && cut.by_brdf > 0.1, "{cut:?}");
        assert!((cut.by_min - cut.by_brdf).abs() < 1e-12, "{cut:?}");
        let [f, p] = accuracy.least_degrees(0.2).unwrap();
        let lost = |f: usize, p: usize| accuracy.at(f, p).by_brdf;
        assert!(lost(f, p) <= 0.2 && lost(f - 1, p) > 0.2 && lost(8, p - 1) > 0.2, "[{f}, {p}]");
        assert_eq!(Accuracy::of(&world, light, 4.0 * brdf).least_degrees(0.2), None, "most is unknown");
    }

    #[test]
    fn a_black_field_loses_nothing() {
        let black = BrdfCoefficients::new(Centre::Normal, degree(3), degree(1), vec![[0.0; 3]; 16]).unwrap();
        let field = Reflection::convolve(field(1, 3, 1, 0.0).lighting(), &black);
        let estimate = Accuracy::of(&field, [1.0; 3], 0.0).at(1, 0);
        assert_eq!((estimate.truth, estimate.by_brdf, estimate.bound_with_p), (0.0, 0.0, 0.0));
    }
}
