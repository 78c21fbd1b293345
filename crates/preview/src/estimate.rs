//! The reflection of a material that has no maps yet, made quickly: of low degree, with suns and lamps beside
//! it. A page shows it while somebody edits a material, until the maps are built.

use std::sync::Arc;

use brdf::{Choice, Material, project};
use sh::{Degree, Stop, Window};
use shrm::{Lamps, Reflection};

use crate::{Look, MapSizes, RenderError};

/// The degree P of the view; that of the light is [`crate::Light::separated`]'s.
const P: usize = 4;

/// The texels along the edge of a face: four for each wave of degree F.
const EDGE: usize = 32;

impl Look {
    /// The look with the reflection of its light off its material at F = 32 and P = 4, softened so that it
    /// does not ring (a Lanczos window). Highlights of suns and lamps, which are beside it, are as sharp as
    /// the material makes them; reflections of everything else show nothing narrower than about 6 degrees.
    ///
    /// # Errors
    /// [`RenderError::Missing`] if the material is unknown, [`RenderError::Cancelled`] if it was stopped, and
    /// if the material has a value that is not finite.
    pub fn estimated(&self, stop: Stop<'_>) -> Result<Self, RenderError> {
        let material = self.material().ok_or_else(|| RenderError::maps("the material is unknown"))?;
        let lighting = self.light().separated();
        let choice = Choice::Sketch { f: lighting.series.degree() };
        let p = Degree::new(P).unwrap_or(Degree::ZERO);
        let reflected = |material: &Material| -> Result<_, RenderError> {
            let projection = project(material, choice, stop).map_err(|error| match error {
                brdf::ProjectionError::Stopped(_) => RenderError::Cancelled,
                error => RenderError::maps(error.to_string()),
            })?;
            let coefficients = projection.coefficients.cut_to(Degree::MAX, p);
            let reflection = Reflection::convolve(&lighting.series, &coefficients).windowed(Window::Lanczos);
            let (lights, material) = (lighting.lights.clone(), material.clone());
            let is_lit = !lights.is_empty();
            Ok(if is_lit { reflection.with_lamps(Lamps { lights, material }) } else { reflection })
        };
        let mut reflection = reflected(material)?;
        if let Some([diffuse, specular]) = material.split() {
            reflection = reflection.with_parts([reflected(&diffuse)?, reflected(&specular)?]);
        }
        let sizes = MapSizes { edge: EDGE, ..self.sizes() };
        Ok(Self::new(Arc::clone(self.light()), reflection, Some(material.clone()), sizes))
    }
}

#[cfg(test)]
mod tests {
    use brdf::{Standard, StandardParameters};
    use envmap::Environment;
    use sphere::{LatLong, Rotation};

    use super::*;
    use crate::{Background, Camera, Cpu, Light, Mode, PointSet, Renderer, Scene, Shot, Show};

    /// A sky with a sun.
    fn light() -> Arc<Light> {
        let grid = LatLong::with_rows(64);
        let pixels = (0..grid.len()).map(|pixel| {
            let (row, column) = (pixel / grid.width, pixel % grid.width);
            let is_sun = (14..16).contains(&row) && (30..32).contains(&column);
            let sky = 1.0 - row as f32 / 80.0;
            if is_sun { [900.0; 3] } else { [0.4 * sky, 0.6 * sky, sky] }
        });
        Arc::new(Light::new(Environment::new(grid, pixels.collect()).unwrap(), None))
    }

    #[test]
    fn an_estimate_is_near_brute_force() {
        for (metallic, roughness) in [(1.0, 0.25), (1.0, 0.6), (0.0, 0.4)] {
            let parameters = StandardParameters { metallic, roughness, ..StandardParameters::default() };
            let material = Material::Standard(Standard::new(parameters).unwrap());
            let plain = Look::without_maps(light(), material, MapSizes::default());
            let estimated = plain.estimated(Stop::NEVER).unwrap();
            assert!(estimated.reflection().unwrap().lamps().is_some(), "the sun is beside it");
            assert_eq!(estimated.local().unwrap().len(), if metallic == 0.0 { 2 } else { 1 });
            let mesh = Arc::new(mesh::shape("sphere").unwrap());
            let drawn = |mode, look| {
                let scene = Scene::of(Arc::clone(&mesh), Arc::new(look));
                let shot = Shot {
                    size: [48, 48],
                    samples: 1,
                    camera: Camera::new(scene.framing()),
                    turn: Rotation::IDENTITY,
                    show: Show::One(mode),
                    background: Background::Environment,
                    exposure: 0.0,
                    tone: envmap::ToneMap::Filmic,
                    light_samples: 2048,
                    points: PointSet::Even,
                };
                Cpu::new().render(&scene, &shot, Stop::NEVER).unwrap()
            };
            let (found, expected) = (drawn(Mode::LocalShrm, estimated), drawn(Mode::BruteForce, plain));
            let [p95, p99] = found.stops(&expected, 0.01).unwrap();
            assert!(p95 < 0.25 && p99 < 0.5, "{metallic}, roughness {roughness}: {p95} and {p99} stops");
        }
    }

    #[test]
    fn a_look_without_a_material_has_no_estimate() {
        let look = Look::of_light(light(), None, MapSizes::default());
        assert!(look.estimated(Stop::NEVER).is_err());
    }
}
