//! Reflected radiance by its definition: a sum over all pixels of radiance, solid angle and rho_hat.
//!
//! A pixel has one radiance all over its area. Near the central direction, where a lobe may be narrower than
//! a pixel, pixels are divided into 4 x 4 parts, and those again, down to `FINEST`.
//!
//! It shares nothing with what it judges but the material's own formula: no spherical harmonics, no lamps, no
//! tables of the kernels.

use std::f64::consts::{PI, TAU};

use brdf::{Centre, Material};
use envmap::Image;
use rayon::prelude::*;
use sphere::{DVec3, Direction};

/// The height of the finest parts in radians, a fifth of the width of the narrowest lobe.
const FINEST: f64 = 2e-5;

/// Parts are divided if they are less than so many of their heights from the central direction: a tail that
/// falls with the fourth power of the angle is then summed to 16 / (24 12^2) of it.
const NEAR: f64 = 12.0;

/// The pixels of a lat-long image that are not black.
#[derive(Clone, Debug)]
pub struct Pixels {
    /// Each, or in [`Pixels::sum`] a part of one.
    cells: Vec<Cell>,
    /// The direction of each.
    directions: Vec<DVec3>,
    /// Radiance times solid angle, RGB.
    flux: Vec<[f64; 3]>,
    /// Parts of this height are not divided.
    finest: f64,
}

/// A cell of a lat-long grid.
#[derive(Clone, Copy, Debug)]
struct Cell {
    row: usize,
    column: usize,
    height: usize,
    width: usize,
}

impl Cell {
    fn extent(self) -> f64 {
        PI / self.height as f64
    }

    fn direction(self) -> DVec3 {
        let (sin, cos) = (PI * (self.row as f64 + 0.5) / self.height as f64).sin_cos();
        let phi = TAU * (0.5 - (self.column as f64 + 0.5) / self.width as f64);
        DVec3::new(sin * phi.cos(), sin * phi.sin(), cos)
    }

    /// cos(a) - cos(b) without cancellation.
    fn solid_angle(self) -> f64 {
        let middle = PI * (self.row as f64 + 0.5) / self.height as f64;
        TAU / self.width as f64 * 2.0 * middle.sin() * (0.5 * self.extent()).sin()
    }

    /// 4 x 4.
    fn parts(self) -> impl Iterator<Item = Self> {
        (0..16).map(move |part| Self {
            row: 4 * self.row + part / 4,
            column: 4 * self.column + part % 4,
            height: 4 * self.height,
            width: 4 * self.width,
        })
    }
}

impl Pixels {
    /// The pixels of an image, row 0 toward +Z and the centre toward +X.
    pub fn new(image: &Image) -> Self {
        let (width, height) = (image.width(), image.height());
        let mut pixels = Self { cells: Vec::new(), directions: Vec::new(), flux: Vec::new(), finest: FINEST };
        for (index, radiance) in image.pixels().iter().enumerate() {
            if *radiance == [0.0; 3] {
                continue;
            }
            let cell = Cell { row: index / width, column: index % width, height, width };
            pixels.cells.push(cell);
            pixels.directions.push(cell.direction());
            pixels.flux.push(radiance.map(|value| cell.solid_angle() * f64::from(value)));
        }
        pixels
    }

    /// The mean radiance over the sphere and the three channels.
    pub fn mean(&self) -> f64 {
        self.flux.as_flattened().iter().sum::<f64>() / (12.0 * PI)
    }

    /// The sum of radiance, solid angle and a factor that may change fast about a direction.
    fn sum(&self, central: DVec3, factor: impl Fn(DVec3) -> [f64; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut add = |direction, flux: [f64; 3]| {
            let factor = factor(direction);
            (0..3).for_each(|channel| sum[channel] += flux[channel] * factor[channel]);
        };
        let is_near = |cell: Cell, direction: DVec3| {
            let extent = cell.extent();
            extent > self.finest && (direction - central).length() < NEAR * extent
        };
        for ((cell, direction), flux) in self.cells.iter().zip(&self.directions).zip(&self.flux) {
            if !is_near(*cell, *direction) {
                add(*direction, *flux);
                continue;
            }
            let per_solid_angle = flux.map(|flux| flux / cell.solid_angle());
            let mut open: Vec<Cell> = cell.parts().collect();
            while let Some(part) = open.pop() {
                let direction = part.direction();
                if is_near(part, direction) {
                    open.extend(part.parts());
                } else {
                    add(direction, per_solid_angle.map(|radiance| radiance * part.solid_angle()));
                }
            }
        }
        sum
    }
}

/// A surface and a view of it.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    /// The surface's tangent, bitangent and normal.
    axes: [DVec3; 3],
    /// Toward the viewer.
    view: DVec3,
}

impl Pose {
    /// A surface whose central direction is `central`, from a view that three numbers from 0 to 1 choose,
    /// such that the squared sine of the angle between normal and view is uniform: so a sphere shows its
    /// normals to a distant camera. With the centre `reflection` the view then is uniform over the sphere.
    pub fn new(centre: Centre, central: DVec3, [u, v, w]: [f64; 3]) -> Self {
        let any = DVec3::any_orthonormal_vector;
        match centre {
            Centre::Reflection => Self::at(central, any(central), u, v),
            Centre::Normal => Self::seen(central, any(central), u, v),
            Centre::Tangent => {
                let normal = about(central, any(central), 0.0, TAU * w);
                Self::seen(normal, central, u, v)
            }
        }
    }

    /// A surface that reflects a view to `central`. The view is at the height 1 - 2 `u` above the plane
    /// across `central`, and `turn` turns from `x`.
    fn at(central: DVec3, x: DVec3, u: f64, turn: f64) -> Self {
        let view = about(central, x, 1.0 - 2.0 * u, TAU * turn);
        // The sum of both has the length 2 sqrt(1 - u), which may be small.
        let across = about(central, x, 0.0, TAU * turn);
        let normal = unit(central * (1.0 - u).sqrt() + across * u.sqrt());
        let tangent = normal.any_orthonormal_vector();
        Self { axes: [tangent, normal.cross(tangent), normal], view }
    }

    /// A surface with this normal and tangent from a view that is `turn` turns from the tangent, `u` being
    /// the squared sine of its angle from the normal.
    fn seen(normal: DVec3, tangent: DVec3, u: f64, turn: f64) -> Self {
        let view = about(normal, tangent, (1.0 - u).sqrt(), TAU * turn);
        Self { axes: [tangent, normal.cross(tangent), normal], view }
    }

    /// Toward the viewer.
    pub fn view(&self) -> DVec3 {
        self.view
    }

    /// The surface's normal.
    pub fn normal(&self) -> DVec3 {
        self.axes[2]
    }

    fn on_surface(&self, v: DVec3) -> Direction {
        let [x, y, z] = self.axes.map(|axis| axis.dot(v));
        Direction::normalised(DVec3::new(x, y, z))
    }

    /// The BRDF times the cosine for light from a direction.
    pub fn rho_hat(&self, material: &Material, light: DVec3) -> [f64; 3] {
        material.rho_hat(self.on_surface(light), self.on_surface(self.view))
    }

    /// The radiance toward the viewer.
    pub fn reflected(&self, material: &Material, pixels: &Pixels) -> [f64; 3] {
        let outgoing = self.on_surface(self.view);
        let [tangent, _, normal] = self.axes.map(unit);
        let central = match material.centre() {
            Centre::Reflection => 2.0 * normal.dot(self.view) * normal - self.view,
            Centre::Normal => normal,
            Centre::Tangent => tangent,
        };
        pixels.sum(central, |light| material.rho_hat(self.on_surface(light), outgoing))
    }
}

/// The direction at an angle from an axis, given by its cosine, and an azimuth from `x`, which is across the
/// axis.
fn about(axis: DVec3, x: DVec3, cosine: f64, azimuth: f64) -> DVec3 {
    let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
    unit(axis * cosine + (x * azimuth.cos() + axis.cross(x) * azimuth.sin()) * sine)
}

/// The mean of rho_hat over all views, by the angle between light and central direction: of an isotropic
/// material it depends on nothing else.
///
/// It is tabulated in steps of u, u^2 being the sine of half the angle: a step is 3e-4 of the angle's 0.01,
/// where sharp lobes have their width.
pub struct MeanOverViews {
    values: Vec<[f64; 3]>,
}

impl MeanOverViews {
    const STEPS: usize = 1024;
    /// Rows and columns of views.
    const VIEWS: [usize; 2] = [96, 48];

    /// The mean over the views of a material.
    pub fn new(material: &Material) -> Self {
        Self::with_views(material, Self::VIEWS)
    }

    fn with_views(material: &Material, views: [usize; 2]) -> Self {
        let poses = poses(material.centre(), views);
        let mean = |step: usize| {
            let u = step as f64 / Self::STEPS as f64;
            let theta = 2.0 * (u * u).asin();
            let light = DVec3::new(theta.sin(), 0.0, theta.cos());
            let mut sum = [0.0; 3];
            for (pose, weight) in &poses {
                let rho = pose.rho_hat(material, light);
                (0..3).for_each(|channel| sum[channel] += weight * rho[channel]);
            }
            sum
        };
        Self { values: (0..=Self::STEPS).into_par_iter().map(mean).collect() }
    }

    /// The mean radiance, over all views, of surfaces whose central direction is `central`.
    pub fn reflected(&self, central: DVec3, pixels: &Pixels) -> [f64; 3] {
        pixels.sum(central, |light| {
            let place = (0.5 * (light - central).length()).min(1.0).sqrt() * Self::STEPS as f64;
            let step = (place as usize).min(Self::STEPS - 1);
            let (share, [a, b]) = (place - step as f64, [self.values[step], self.values[step + 1]]);
            std::array::from_fn(|channel| a[channel] + share * (b[channel] - a[channel]))
        })
    }
}

/// Views about +Z and their weights, which sum to 1.
///
/// About R the rows crowd toward grazing views, V = -R, and the columns toward the plane of R and the light
/// (at azimuth 0): lobes grow there without bound and become as narrow.
fn poses(centre: Centre, [rows, columns]: [usize; 2]) -> Vec<(Pose, f64)> {
    let middle = |index: usize, count: usize| (index as f64 + 0.5) / count as f64;
    let pose = |index: usize| {
        let (row, column) = (index / columns, index % columns);
        if centre != Centre::Reflection {
            // R3, a sequence of low discrepancy: Roberts 2018, powers of the inverse root of x^4 = x + 1.
            let share = |power: i32| (0.5 + index as f64 * 1.220_744_084_605_759_5_f64.powi(-power)).fract();
            return (Pose::new(centre, DVec3::Z, [share(1), share(2), share(3)]), 1.0);
        }
        let (s, t) = (middle(row, rows), middle(column, columns));
        // Half a turn: the other half is its mirror image. The derivatives are the weights.
        let azimuth = t * t * t * (10.0 + t * (6.0 * t - 15.0));
        let weight = 4.0 * s * s * s * 30.0 * (t * (1.0 - t)).powi(2);
        (Pose::at(DVec3::Z, DVec3::X, 1.0 - s.powi(4), 0.5 * azimuth), weight)
    };
    let poses: Vec<(Pose, f64)> = (0..rows * columns).map(pose).collect();
    let whole: f64 = poses.iter().map(|(_, weight)| weight).sum();
    poses.into_iter().map(|(pose, weight)| (pose, weight / whole)).collect()
}

/// The number at a place of a random sequence, from 0 to 1: splitmix64.
pub fn uniform(seed: u64, index: u64) -> f64 {
    let mut z = (seed << 32).wrapping_add(index).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// A vector of length 1.
pub(super) fn unit(v: DVec3) -> DVec3 {
    v.normalize()
}

#[cfg(test)]
mod tests {
    use brdf::{Fresnel, Ggx, KajiyaKay, Lambert, Microfacet, Phong, Standard, StandardParameters};

    use super::*;

    fn white(width: usize) -> Pixels {
        Pixels::new(&Image::new(width, width / 2, vec![[1.0; 3]; width * width / 2]).unwrap())
    }

    fn ggx(roughness: f64) -> Material {
        let gold = Fresnel::Conductor { n: [0.14, 0.38, 1.44], k: [3.98, 2.39, 1.6] };
        Material::Ggx(Ggx::new(roughness, gold, [1.0; 3]).unwrap())
    }

    /// 128 rows integrate a cosine to 1e-4.
    #[test]
    fn under_a_white_sky_a_white_surface_is_white() {
        let pixels = white(256);
        assert!((pixels.mean() - 1.0).abs() < 1e-12);
        for (material, tolerance) in [
            (Material::Lambert(Lambert::new([1.0; 3]).unwrap()), 1e-3),
            (Material::Phong(Phong::new(20.0, [1.0; 3]).unwrap()), 1e-3),
        ] {
            let pose = Pose::new(material.centre(), unit(DVec3::new(0.3, -0.5, 0.8)), [0.4, 0.1, 0.7]);
            let found = pose.reflected(&material, &pixels)[1];
            assert!((found - 1.0).abs() < tolerance, "{}: {found}", material.name());
        }
    }

    /// One light is given in pixels and in pixels of a sixteenth of the size; the lobes are narrower than
    /// either.
    #[test]
    fn finer_pixels_of_the_same_light_change_no_sharp_reflection() {
        let value = |row: usize, column: usize| {
            if row == 5 && column == 20 { [300.0; 3] } else { [0.2, 0.4, 0.1 + 0.1 * (column % 3) as f32] }
        };
        let image = |factor: usize| {
            let (width, height) = (32 * factor, 16 * factor);
            let pixels = (0..width * height).map(|i| value(i / width / factor, i % width / factor));
            Pixels::new(&Image::new(width, height, pixels.collect()).unwrap())
        };
        let [coarse, fine] = [image(1), image(16)];
        let sun = coarse.directions[5 * 32 + 20];
        for roughness in [0.02, 0.05, 0.1] {
            for k in 0..6_u64 {
                let off = 0.04 * k as f64 * DVec3::new(0.6, -0.7, 0.4);
                let pose = Pose::new(Centre::Reflection, unit(sun + off), [0.1 * k as f64, 0.3, 0.5]);
                let [a, b] = [&coarse, &fine].map(|pixels| pose.reflected(&ggx(roughness), pixels)[0]);
                assert!((a / b).log2().abs() < 0.01, "{roughness} {k}: {a} {b}");
            }
        }
    }

    /// The kernels' own frames give the same values.
    #[test]
    fn a_pose_has_the_frame_of_its_central_direction() {
        let central = unit(DVec3::new(-0.2, 0.4, 0.7));
        let light = unit(DVec3::new(0.1, 0.6, 0.5));
        for material in [
            ggx(0.4),
            Material::Microfacet(Microfacet::new(0.3, [1.0; 3]).unwrap()),
            Material::Lambert(Lambert::new([0.5; 3]).unwrap()),
            Material::KajiyaKay(KajiyaKay::new(8.0, [1.0; 3]).unwrap()),
        ] {
            let pose = Pose::new(material.centre(), central, [0.2, 0.6, 0.3]);
            let local = |v: DVec3| {
                let world = shrm::frame(Direction::normalised(central)).matrix().transpose();
                Direction::normalised(world * v)
            };
            let expected = material.rho_hat_about_centre(local(light), local(pose.view()));
            let found = pose.rho_hat(&material, light);
            assert!(expected[0] > 0.0 && (found[0] / expected[0] - 1.0).abs() < 1e-9, "{}", material.name());
        }
    }

    #[test]
    fn a_sphere_shows_its_normals_with_uniform_squared_sines() {
        for (centre, name) in
            [(Centre::Reflection, "reflection"), (Centre::Normal, "normal"), (Centre::Tangent, "tangent")]
        {
            let mut counts = [0; 4];
            for k in 0..4000_u64 {
                let numbers = [uniform(1, 3 * k), uniform(1, 3 * k + 1), uniform(1, 3 * k + 2)];
                let pose = Pose::new(centre, DVec3::X, numbers);
                let squared = 1.0 - pose.axes[2].dot(pose.view).powi(2);
                counts[((4.0 * squared) as usize).min(3)] += 1;
            }
            // The standard deviation of each is 27.
            assert!(counts.iter().all(|count: &i32| (count - 1000).abs() < 110), "{name}: {counts:?}");
        }
    }

    /// Views that are uniform over the sphere, as many, are up to 14 % off here.
    #[test]
    fn twice_as_many_views_do_not_change_the_mean_of_a_sharp_lobe() {
        let plastic = StandardParameters { roughness: 0.2, base_color: [0.05; 3], ..Default::default() };
        for material in [ggx(0.2), Material::Standard(Standard::new(plastic).unwrap())] {
            let [few, many] = [1, 2].map(|factor| {
                MeanOverViews::with_views(&material, MeanOverViews::VIEWS.map(|count| factor * count))
            });
            // Beyond 147 degrees from R the mean is negligible.
            for step in 0..MeanOverViews::STEPS * 49 / 50 {
                let (few, many) = (few.values[step][0], many.values[step][0]);
                assert!((few / many - 1.0).abs() < 5e-3, "{}, step {step}: {few} {many}", material.name());
            }
        }
    }

    /// Over a small image with a bright pixel: the table, and the mean of sums over pixels.
    #[test]
    fn the_mean_over_views_is_that_of_the_sums() {
        let mut values = vec![[0.2, 0.4, 0.1]; 32 * 16];
        values[5 * 32 + 20] = [300.0; 3];
        // Both sum over the centres of pixels, which is enough to compare them.
        let pixels = Pixels { finest: PI, ..Pixels::new(&Image::new(32, 16, values).unwrap()) };
        for material in [ggx(0.5), ggx(0.2), Material::KajiyaKay(KajiyaKay::new(8.0, [1.0; 3]).unwrap())] {
            let table = MeanOverViews::new(&material);
            for central in [DVec3::new(0.1, 0.2, 0.9), DVec3::new(-0.8, 0.3, -0.4)].map(unit) {
                let found = table.reflected(central, &pixels);
                let views = 20_000;
                let mut sum = 0.0;
                for k in 0..views {
                    let numbers = [uniform(7, 3 * k), uniform(7, 3 * k + 1), uniform(7, 3 * k + 2)];
                    let pose = Pose::new(material.centre(), central, numbers);
                    sum += pose.reflected(&material, &pixels)[0] / views as f64;
                }
                assert!((found[0] / sum - 1.0).abs() < 0.02, "{}: {} {sum}", material.name(), found[0]);
            }
        }
    }
}
