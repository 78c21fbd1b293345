//! The settings of tables 4 and 5 of Ramamoorthi and Hanrahan [RH02, sec. 7.4]: what prefiltering costs by
//! integration over angles and in spherical harmonics.
//!
//! Environment and maps are of 128 x 128 texels (lat-long), all of them lit. The angular side is
//! [`shrm::reference`]: in vectors, on all threads, culled to the cap that holds 1 - 0.05 of the lobe
//! [RH02, app. D]. The frequency side goes from pixels to pixels: lighting to coefficients, material to
//! coefficients, product, synthesis. What depends on grid and degree alone (the transform's plan, which a
//! build shares between its environments) or on the environment alone (the angular side's tables) is made
//! before, for both.
//!
//! Table 5's side chooses its degrees by the tolerance, as [RH02, app. C] does in its first step. RH02 does
//! not say whether its seconds hold that search; here one table of the BRDF serves the search and the
//! coefficients, and a few outgoing directions more tell how high the table must reach.

use brdf::{Absent, BrdfCoefficients, Choice, MODELS, Material, Value, Values, project};
use envmap::Environment;
use sh::{Degree, Stop, Tolerance, Transform, unstopped};
use shrm::reference::{Cull, Reference};
use shrm::{MapGrid, MapViews, Reflection, Shrm, View, ViewSet};
use sphere::{Direction, LatLong};

/// S_L = S_B = 128.
pub const GRID: LatLong = LatLong { width: 128, height: 128 };

/// What the angular side may leave out of a lobe.
pub const ANGULAR_EPSILON: f64 = 0.05;

/// A row of [RH02, tab. 4]: the exponent and its seconds.
#[derive(Clone, Copy, Debug)]
pub struct Row4 {
    /// Phong's exponent.
    pub s: usize,
    /// Integration over angles.
    pub angular: f64,
    /// Spherical harmonics.
    pub frequency: f64,
}

/// Table 4.
pub const TABLE4: [Row4; 7] = [
    Row4 { s: 8, angular: 67.28, frequency: 0.081 },
    Row4 { s: 16, angular: 38.03, frequency: 0.114 },
    Row4 { s: 32, angular: 21.80, frequency: 0.159 },
    Row4 { s: 64, angular: 11.94, frequency: 0.227 },
    Row4 { s: 128, angular: 7.17, frequency: 0.328 },
    Row4 { s: 256, angular: 3.55, frequency: 0.461 },
    Row4 { s: 512, angular: 2.28, frequency: 0.686 },
];

/// A row of [RH02, tab. 5]: the roughness, its degrees and seconds.
#[derive(Clone, Copy, Debug)]
pub struct Row5 {
    /// The microfacet model's width.
    pub sigma: f64,
    /// F and P at a tolerance of 0.03.
    pub degrees: [usize; 2],
    /// Integration over angles, for one map.
    pub angular: f64,
    /// Spherical harmonics with all 100 maps.
    pub frequency: f64,
    /// Spherical harmonics up to the SHRM.
    pub shrm: f64,
}

/// Table 5.
pub const TABLE5: [Row5; 5] = [
    Row5 { sigma: 0.1, degrees: [24, 3], angular: 9.23, frequency: 2.70, shrm: 1.55 },
    Row5 { sigma: 0.2, degrees: [12, 2], angular: 27.44, frequency: 1.55, shrm: 0.72 },
    Row5 { sigma: 0.3, degrees: [7, 2], angular: 57.31, frequency: 1.49, shrm: 0.67 },
    Row5 { sigma: 0.4, degrees: [5, 2], angular: 90.34, frequency: 1.47, shrm: 0.65 },
    Row5 { sigma: 0.5, degrees: [5, 2], angular: 125.80, frequency: 1.45, shrm: 0.64 },
];

/// T_B: explicit maps for 10 x 10 views.
pub const VIEWS: usize = 10;

/// The share of the BRDF's energy that table 5 gives up.
pub const TABLE5_EPSILON: f64 = 0.03;

/// A lighting without dark or constant parts: slow waves, fast ones and a sun.
pub fn environment(grid: LatLong) -> Environment {
    let sun = Direction::from_angles(0.7, 1.0);
    let pixels = (0..grid.len()).map(|texel| {
        let w = grid.direction(texel / grid.width, texel % grid.width);
        let v = w.vector();
        let waves = (9.0 * v.x + 4.0 * v.y).sin() * (7.0 * v.z).cos();
        let sun = 40.0 * (200.0 * (w.dot(sun) - 1.0)).exp();
        [1.2 + 0.5 * v.z + sun, 1.1 + 0.3 * waves + sun, 1.3 + 0.4 * waves * v.x + 0.8 * sun]
            .map(|value| value as f32)
    });
    Environment::new(grid, pixels.collect()).expect("finite values")
}

/// F for Phong with exponent `s` [RH02, sec. 7.4]: 1 + sqrt(6 s), rounded down.
pub fn phong_degree(s: usize) -> usize {
    1 + (6.0 * s as f64).sqrt() as usize
}

/// One row of table 4, prepared.
pub struct Table4 {
    environment: Environment,
    material: Material,
    reference: Reference,
    transform: Transform,
}

impl Table4 {
    /// Phong with exponent `s`, of degree [`phong_degree`]: up to 640, whose degree 128 columns hold.
    pub fn new(s: usize) -> Self {
        let environment = environment(GRID);
        let material = material("phong", "exponent", s as f64);
        let reference = Reference::at_centres(&environment, &material, cull());
        let degree = Degree::new(phong_degree(s)).expect("a degree");
        let transform = Transform::new(GRID, degree).expect("128 columns hold degree 63");
        Self { environment, material, reference, transform }
    }

    /// W, the part of the sphere that the angular side sums over.
    pub fn width(&self) -> f64 {
        self.reference.width()
    }

    /// F.
    pub fn degree(&self) -> usize {
        self.transform.degree().get()
    }

    /// The map by integration over angles.
    pub fn angular(&self) -> Vec<[f32; 3]> {
        self.reference.map(MapGrid::LatLong(GRID), Direction::Z)
    }

    /// The map by spherical harmonics: lighting coefficients, BRDF coefficients, product, synthesis.
    pub fn frequency(&self) -> Vec<[f32; 3]> {
        let choice = Choice::Degree { f: self.transform.degree(), p: Degree::ZERO };
        let brdf = project(&self.material, choice, Stop::NEVER).expect("the degrees are low").coefficients;
        let lighting = self.transform.analyse(self.environment.pixels());
        let field = Reflection::convolve(&lighting, &brdf).radial().expect("phong is radially symmetric");
        self.transform.synthesise(&field)
    }
}

/// One row of table 5, prepared.
pub struct Table5 {
    environment: Environment,
    material: Material,
    reference: Reference,
    transform: Transform,
    p: usize,
}

impl Table5 {
    /// The microfacet model of width `sigma`.
    pub fn new(sigma: f64) -> Self {
        let environment = environment(GRID);
        let material = material("microfacet", "sigma", sigma);
        let reference = Reference::at_centres(&environment, &material, cull());
        let brdf = coefficients(&material);
        let transform = Transform::new(GRID, brdf.f()).expect("128 rows hold degree 24");
        Self { environment, material, reference, transform, p: brdf.p().get() }
    }

    /// F and P.
    pub fn degrees(&self) -> [usize; 2] {
        [self.transform.degree().get(), self.p]
    }

    /// The map toward one local view by integration over angles.
    pub fn angular(&self, view: Direction) -> Vec<[f32; 3]> {
        self.reference.local_map(MapGrid::LatLong(GRID), view)
    }

    /// The SHRM, from pixels and material: the choice of degrees, BRDF coefficients, lighting coefficients,
    /// product, synthesis.
    pub fn shrm(&self) -> Shrm {
        let brdf = coefficients(&self.material);
        let lighting = self.transform.analyse(self.environment.pixels());
        let field = Reflection::convolve(&lighting, &brdf);
        field.synthesise(MapGrid::LatLong(GRID), View::Local, Stop::NEVER).expect("a map of 128 x 128")
    }

    /// The explicit maps of an SHRM for all 100 views.
    pub fn maps(&self, shrm: &Shrm) -> ViewSet {
        let views = MapViews::Table { side: VIEWS, view: View::Local };
        unstopped(|stop| ViewSet::from_shrm(shrm, views, stop)).expect("10 x 10 views")
    }
}

fn coefficients(material: &Material) -> BrdfCoefficients {
    let tolerance = Tolerance::new(TABLE5_EPSILON).expect("between 0 and 1");
    project(material, Choice::Tolerance(tolerance), Stop::NEVER).expect("the lobe is wide").coefficients
}

/// What the angular side leaves out: [`ANGULAR_EPSILON`].
pub fn cull() -> Cull {
    Cull::Energy(Tolerance::new(ANGULAR_EPSILON).expect("between 0 and 1"))
}

/// A material of which one parameter is given; the others have their defaults.
pub fn material(name: &str, parameter: &'static str, value: f64) -> Material {
    let model = MODELS.iter().find(|model| model.name == name).expect("a model of this name");
    let mut values = Values::default();
    for parameter in model.parameters {
        if let Absent::Default(value) = parameter.absent {
            values.set(parameter.name, Value::Number(value));
        }
    }
    values.set(parameter, Value::Number(value));
    Material::analytic(name, &values).expect("a model of this name").expect("a good value")
}

/// RMS of the difference of two maps over RMS of the second, texels weighted by solid angle.
pub fn difference(grid: LatLong, a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let (mut lost, mut whole) = (0.0, 0.0);
    for (texel, (a, b)) in a.iter().zip(b).enumerate() {
        let weight = grid.solid_angle(texel / grid.width);
        for channel in 0..3 {
            lost += weight * f64::from(a[channel] - b[channel]).powi(2);
            whole += weight * f64::from(b[channel]).powi(2);
        }
    }
    (lost / whole).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The angular side loses 5 percent of the lobe and the frequency side 1 percent of its energy at most.
    #[test]
    fn both_sides_of_table_4_make_the_same_map() {
        for row in [TABLE4[0], TABLE4[3], TABLE4[6]] {
            let case = Table4::new(row.s);
            let difference = difference(GRID, &case.angular(), &case.frequency());
            assert!(difference < 0.06, "s = {}: {difference}", row.s);
        }
    }

    /// The angular side loses 5 percent of the lobe, the frequency side 3 percent of its energy: some 17
    /// percent if the lighting were white noise, and less for any other.
    #[test]
    fn both_sides_of_table_5_make_the_same_maps() {
        for row in [TABLE5[1], TABLE5[4]] {
            let case = Table5::new(row.sigma);
            let maps = case.maps(&case.shrm());
            for view in [4, 27, 61] {
                let angular = case.angular(maps.views().directions()[view]);
                let difference = difference(GRID, &angular, maps.map(view));
                assert!(difference < 0.1, "sigma = {}, view {view}: {difference}", row.sigma);
            }
            for (found, paper) in case.degrees().into_iter().zip(row.degrees) {
                assert!(found.abs_diff(paper) <= 1, "sigma = {}: {:?}", row.sigma, case.degrees());
            }
        }
    }
}
