//! What a material reflects of many directions toward one view, with rho_hat of several at once.

use sphere::Direction;

use super::material::Material;

/// The directions whose rho_hat is computed at once.
const AT_ONCE: usize = 32;

/// A sum over directions of light of rho_hat, in the mean over some turns, times the light's irradiance of a
/// surface that faces it. Directions are in the frame of the surface: +Z the normal, +X the tangent.
///
/// The sum is that of [`Material::mean_over_turns`], direction after direction, to the bit.
#[derive(Debug)]
pub struct LightSum<'a> {
    material: &'a Material,
    turns: usize,
    pairs: [[Direction; 2]; AT_ONCE],
    fluxes: [[f64; 3]; AT_ONCE],
    count: usize,
    total: [f64; 3],
}

impl<'a> LightSum<'a> {
    /// A sum of nothing yet, toward a view. `turns` is [`Material::turns`], or 1 if the tangent is known.
    pub fn new(material: &'a Material, turns: usize, outgoing: Direction) -> Self {
        Self {
            material,
            turns,
            pairs: [[Direction::Z, outgoing]; AT_ONCE],
            fluxes: [[0.0; 3]; AT_ONCE],
            count: 0,
            total: [0.0; 3],
        }
    }

    /// Adds light of a flux, RGB, from one direction.
    pub fn add(&mut self, incident: Direction, flux: [f64; 3]) {
        self.pairs[self.count][0] = incident;
        self.fluxes[self.count] = flux;
        self.count += 1;
        if self.count == AT_ONCE {
            self.reflect();
        }
    }

    /// The reflected radiance, RGB.
    pub fn total(mut self) -> [f64; 3] {
        self.reflect();
        self.total
    }

    /// Adds what is reflected of the directions that wait.
    fn reflect(&mut self) {
        let mut values = [[0.0; 3]; AT_ONCE];
        let values = &mut values[..self.count];
        self.material.means_over_turns(self.turns, &self.pairs[..self.count], values);
        for (rho, flux) in values.iter().zip(&self.fluxes) {
            (0..3).for_each(|channel| self.total[channel] += flux[channel] * rho[channel]);
        }
        self.count = 0;
    }
}

#[cfg(test)]
mod tests {
    use sphere::spiral;

    use super::*;

    #[test]
    fn the_sum_has_the_bits_of_one_direction_after_another() {
        for material in Material::examples().unwrap() {
            let (turns, outgoing) = (material.turns().min(3), spiral(7, 40));
            for count in [0, 1, 5, AT_ONCE, 3 * AT_ONCE + 2] {
                let mut sum = LightSum::new(&material, turns, outgoing);
                let mut expected = [0.0; 3];
                for index in 0..count {
                    let (incident, flux) = (spiral(index, count), [1.0, 0.3, 7.0].map(|f| f + index as f64));
                    sum.add(incident, flux);
                    let rho = material.mean_over_turns(turns, incident, outgoing);
                    (0..3).for_each(|channel| expected[channel] += flux[channel] * rho[channel]);
                }
                assert_eq!(sum.total(), expected, "{} {count}", material.name());
            }
        }
    }
}
