//! What a material reflects of many directions toward one view, with rho_hat of several at once.

use pulp::{Simd, WithSimd};
use sh::f64x4::{F64x4, LANES, SimdLevel, load, store};
use sphere::{DMat3, DVec3, Direction};

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
    /// What turns given directions into the frame of the surface.
    into_surface: Option<DMat3>,
    outgoing: Direction,
    turns: Vec<Turn>,
    incident: [Direction; AT_ONCE],
    fluxes: [[f64; 3]; AT_ONCE],
    count: usize,
    total: [f64; 3],
}

/// A turn of the surface about its normal, and the view after it.
#[derive(Debug)]
struct Turn {
    sine: f64,
    cosine: f64,
    outgoing: Direction,
}

impl Turn {
    fn apply(sine: f64, cosine: f64, direction: Direction) -> Direction {
        let v = direction.vector();
        Direction::from_unit(DVec3::new(cosine * v.x - sine * v.y, sine * v.x + cosine * v.y, v.z))
    }
}

impl<'a> LightSum<'a> {
    /// A sum of nothing yet, toward a view. `turns` is [`Material::turns`], or 1 if the tangent is known.
    pub fn new(material: &'a Material, turns: usize, outgoing: Direction) -> Self {
        Self::with(material, turns, outgoing, None)
    }

    /// [`LightSum::new`] of directions in another frame, from which a rotation turns them into that of the
    /// surface; `outgoing` is in the frame of the surface.
    pub fn turned(material: &'a Material, turns: usize, outgoing: Direction, into_surface: DMat3) -> Self {
        Self::with(material, turns, outgoing, Some(into_surface))
    }

    fn with(material: &'a Material, turns: usize, outgoing: Direction, into_surface: Option<DMat3>) -> Self {
        let turned = |turn: usize| {
            let (sine, cosine) = math::sin_cos(std::f64::consts::TAU * turn as f64 / turns as f64);
            Turn { sine, cosine, outgoing: Turn::apply(sine, cosine, outgoing) }
        };
        Self {
            material,
            into_surface,
            outgoing,
            turns: if turns == 1 { Vec::new() } else { (0..turns).map(turned).collect() },
            incident: [Direction::Z; AT_ONCE],
            fluxes: [[0.0; 3]; AT_ONCE],
            count: 0,
            total: [0.0; 3],
        }
    }

    /// Adds light of a flux, RGB, from one direction.
    #[inline]
    pub fn add(&mut self, incident: Direction, flux: [f64; 3]) {
        self.incident[self.count] = incident;
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
        let incident = &mut self.incident[..self.count];
        if let Some(into_surface) = self.into_surface {
            SimdLevel::detect().run(IntoSurface { into_surface, directions: incident });
        }
        let mut values = [[0.0; 3]; AT_ONCE];
        let values = &mut values[..self.count];
        if self.turns.is_empty() {
            self.material.rho_hats_toward(self.outgoing, incident, values);
        }
        let (mut turned, mut of_turn) = ([Direction::Z; AT_ONCE], [[0.0; 3]; AT_ONCE]);
        for Turn { sine, cosine, outgoing } in &self.turns {
            for (turned, incident) in turned.iter_mut().zip(&*incident) {
                *turned = Turn::apply(*sine, *cosine, *incident);
            }
            let of_turn = &mut of_turn[..self.count];
            self.material.rho_hats_toward(*outgoing, &turned[..self.count], of_turn);
            for (sum, value) in values.iter_mut().zip(of_turn) {
                (0..3).for_each(|channel| sum[channel] += value[channel] / self.turns.len() as f64);
            }
        }
        for (rho, flux) in values.iter().zip(&self.fluxes) {
            (0..3).for_each(|channel| self.total[channel] += flux[channel] * rho[channel]);
        }
        self.count = 0;
    }
}

/// Turns directions into the frame of a surface, four at a time: `Direction::normalised` of the product of
/// the matrix and each, to the bit.
struct IntoSurface<'a> {
    into_surface: DMat3,
    directions: &'a mut [Direction],
}

impl WithSimd for IntoSurface<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let columns = self.into_surface.to_cols_array_2d().map(|column| column.map(|v| simd.splat_f64s(v)));
        for directions in self.directions.chunks_mut(LANES) {
            let last = directions.len() - 1;
            let vectors: [DVec3; LANES] = std::array::from_fn(|lane| directions[lane.min(last)].vector());
            let [x, y, z] = [vectors.map(|v| v.x), vectors.map(|v| v.y), vectors.map(|v| v.z)]
                .map(|lanes| load(simd, &F64x4(lanes)));
            let turned: [S::f64s; 3] = std::array::from_fn(|row| {
                let sum = simd.add_f64s(simd.mul_f64s(columns[0][row], x), simd.mul_f64s(columns[1][row], y));
                simd.add_f64s(sum, simd.mul_f64s(columns[2][row], z))
            });
            let [x2, y2, z2] = turned.map(|value| simd.mul_f64s(value, value));
            let length = simd.sqrt_f64s(simd.add_f64s(simd.add_f64s(x2, y2), z2));
            let scale = simd.div_f64s(simd.splat_f64s(1.0), length);
            let [x, y, z] = turned.map(|value| {
                let mut lanes = F64x4::ZERO;
                store(simd, simd.mul_f64s(value, scale), &mut lanes);
                lanes.0
            });
            for (lane, direction) in directions.iter_mut().enumerate() {
                *direction = Direction::from_unit(DVec3::new(x[lane], y[lane], z[lane]));
            }
        }
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

    #[test]
    fn directions_are_turned_to_the_bit() {
        let frame = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(1.1) * DMat3::from_rotation_z(2.3);
        for material in Material::examples().unwrap() {
            let turns = material.turns().min(3);
            let mut sum = LightSum::new(&material, turns, spiral(11, 40));
            let mut turned = LightSum::turned(&material, turns, spiral(11, 40), frame);
            for index in 0..AT_ONCE + 7 {
                let (incident, flux) = (spiral(index, AT_ONCE + 7), [1.0, 0.3, 2.0 + index as f64]);
                turned.add(incident, flux);
                sum.add(Direction::normalised(frame * incident.vector()), flux);
            }
            assert_eq!(turned.total(), sum.total(), "{}", material.name());
        }
    }
}
