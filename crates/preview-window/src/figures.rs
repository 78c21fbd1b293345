//! What the inspector tells of a scene: degrees, energies and sizes. It may take a moment: a thread works it out.

use brdf::Centre;
use sh::{energy_per_degree, image_energy};
use shrm::accuracy::Accuracy;

use preview::{Look, Scene};

/// Figures of a scene, of its first look where it has several.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Figures {
    pub(crate) triangles: usize,
    pub(crate) objects: usize,
    pub(crate) centre: &'static str,
    /// The degree of the lighting in the reflection; not known of a map that was made elsewhere.
    pub(crate) f: Option<usize>,
    /// The degree in the view.
    pub(crate) p: usize,
    /// Rows and columns of the environment.
    pub(crate) environment: [usize; 2],
    /// The share of the environment's energy in each degree.
    pub(crate) lighting: Vec<f64>,
    /// The share of the reflected field's energy in each degree; empty where no reflection is known.
    pub(crate) reflected: Vec<f64>,
    /// The share of the reflected field's energy that does not change with the view, all that a plain map holds.
    pub(crate) plain: Option<f64>,
    /// The bytes of each map as 32-bit numbers, RGB.
    pub(crate) maps: Vec<(String, u64)>,
}

impl Figures {
    pub(crate) fn of(scene: &Scene) -> Self {
        let Some(first) = scene.objects.first() else { return Self::default() };
        let look = first.look.as_ref();
        let reflection = look.reflection();
        let grid = look.light().environment().grid();
        let total: f64 = image_energy(grid, look.light().environment().pixels()).iter().sum();
        let held =
            energy_per_degree(reflection.map_or_else(|| look.light().lighting(), |made| made.lighting()));
        let known: f64 = held.as_flattened().iter().sum();
        let share = |energy: &[f64; 3]| ratio(energy.iter().sum(), total.max(known));
        let accuracy = reflection.map(|reflection| Accuracy::of(reflection, [0.0; 3], 0.0));
        let p = reflection.map_or_else(
            || look.local().map_or(0, |map| map.p().get()),
            |reflection| reflection.brdf().p().get(),
        );
        Self {
            triangles: scene.objects.iter().map(|object| object.mesh.triangles().len()).sum(),
            objects: scene.objects.len(),
            centre: match look.centre() {
                Centre::Reflection => "reflection vector",
                Centre::Normal => "normal",
                Centre::Tangent => "tangent",
            },
            f: reflection.map(|reflection| reflection.lighting().degree().get()),
            p,
            environment: [grid.height, grid.width],
            lighting: held.iter().map(share).collect(),
            reflected: accuracy.as_ref().map(reflected).unwrap_or_default(),
            plain: accuracy.map(|accuracy| 1.0 - accuracy.at(accuracy.f(), 0).truth),
            maps: maps(look, p),
        }
    }

    /// The share of the environment's energy that the lighting holds.
    pub(crate) fn captured(&self) -> f64 {
        self.lighting.iter().sum()
    }
}

/// What each degree adds to what is held up to the one before.
fn reflected(accuracy: &Accuracy) -> Vec<f64> {
    let mut before = 1.0;
    let curve = accuracy.curve(accuracy.p());
    let gained =
        |estimate: shrm::accuracy::Estimate| std::mem::replace(&mut before, estimate.truth) - estimate.truth;
    curve.into_iter().map(gained).collect()
}

fn maps(look: &Look, p: usize) -> Vec<(String, u64)> {
    let sizes = look.sizes();
    let texel = 3 * size_of::<f32>() as u64;
    let face = 6 * (sizes.edge as u64).pow(2) * texel;
    let coefficients = (p as u64 + 1).pow(2);
    let grid = look.light().environment().grid();
    let edge = sizes.edge;
    vec![
        (format!("SHRM, cube {edge}, {coefficients} rows"), coefficients * face),
        (format!("Cabral, cube {edge}, 12 maps"), 12 * face),
        (format!("Kautz-McCool, cube {edge}, {} slices", sizes.slices), sizes.slices as u64 * face),
        (format!("prefiltered, cube {edge}"), face),
        ("irradiance, 9 rows".into(), 9 * texel),
        (format!("environment, {} x {}", grid.width, grid.height), grid.len() as u64 * texel),
    ]
}

fn ratio(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit;

    #[test]
    fn a_white_sphere_under_a_bright_sky_has_these_figures() {
        let figures = Figures::of(&testkit::scene());
        assert_eq!((figures.f, figures.p, figures.centre), (Some(7), 0, "normal"));
        assert_eq!(figures.triangles, mesh::shape("sphere").unwrap().triangles().len());
        assert_eq!(figures.environment, [16, 32]);
        // Radiance 2 above and 1 below is 1.5 + 0.5 sign(z). Of its energy, 4 pi 2.5, the mean holds 4 pi 2.25, and
        // degree 1 holds 4 pi 0.25 3/4; 16 rows do not see the edge sharply.
        assert!((figures.lighting[0] - 0.9).abs() < 1e-3, "{:?}", figures.lighting);
        assert!((figures.lighting[1] - 0.075).abs() < 2e-3, "{:?}", figures.lighting);
        assert!((0.98..1.0).contains(&figures.captured()), "{}", figures.captured());
        // A diffuse surface loses most of what light changes; all degrees together are all of it, seen from anywhere.
        assert!((figures.reflected.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(figures.reflected[0] > figures.lighting[0], "{:?}", figures.reflected);
        assert!((figures.plain.unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(figures.maps[0], ("SHRM, cube 8, 1 rows".into(), 6 * 64 * 12));
    }

    #[test]
    fn an_empty_scene_has_none() {
        let scene = Scene { objects: Vec::new(), ..testkit::scene() };
        assert_eq!(Figures::of(&scene), Figures::default());
    }
}
