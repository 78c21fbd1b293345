//! The suns and lamps beside a reflected field (`shrm::Lamps`). A map that is looked up has the soft light;
//! each lamp adds its flux times rho_hat of the reflection's own material ([`super::material`]), in the
//! surface's frame:
//!
//! > max(soft, 0) + sum over the points of the lamps of flux rho_hat(direction of the point, V).
//!
//! This is `shrm::Lamps::radiance` with the same points for every pixel ([`Lamps::points`]): a sun is one, a
//! lamp that is large beside the material's highlight has some hundred, and all of them together have about a
//! thousand at most, each of which costs a look at the material.
//! An anisotropic material is taken in the mean over some turns of the surface about its normal, because the
//! map that the lamps are added to has no tangent; it costs that many times more.
//!
//! Directions are in the light's frame, so that lamps turn with the light. The elements, of four f32:
//!
//! | elements | what |
//! | --- | --- |
//! | 1 | the number of points; 1 if the soft light is cut at 0, otherwise 0; the number of turns |
//! | per point 2 | its direction; its flux, RGB |

use std::f32::consts::TAU;

use glam::{Mat3, Vec3};
use shrm::{Lamps, Reflection};

use super::material::PackedMaterial;
use super::surface::Surface;
use crate::RenderError;

/// The lamps of a reflection and their material, as the shader reads them.
#[derive(Clone, Debug)]
pub struct PackedLamps {
    elements: Vec<[f32; 4]>,
    material: Option<PackedMaterial>,
}

impl PackedLamps {
    /// Packs the lamps of a reflection; an imported map has none.
    ///
    /// # Errors
    /// The errors of [`PackedMaterial::new`].
    pub fn new(reflection: Option<&Reflection>) -> Result<Self, RenderError> {
        let lamps = reflection.and_then(Reflection::lamps).filter(|lamps| !lamps.lights.is_empty());
        let is_cut = lamps.is_some() || reflection.is_some_and(Reflection::is_for_light);
        let points = lamps.map(Lamps::points).unwrap_or_default();
        let turns = lamps.map_or(1, |lamps| lamps.material.turns());
        let mut elements = vec![[points.len() as f32, f32::from(u8::from(is_cut)), turns as f32, 0.0]];
        for (direction, flux) in points {
            let direction = direction.vector().as_vec3();
            elements.extend([direction, glam::DVec3::from(flux).as_vec3()].map(|v| [v.x, v.y, v.z, 0.0]));
        }
        let material = lamps.map(|lamps| PackedMaterial::new(&lamps.material)).transpose()?;
        Ok(Self { elements, material })
    }

    /// The elements: the buffer `lamps` of the shader.
    pub fn elements(&self) -> &[[f32; 4]] {
        &self.elements
    }

    /// The words of the material: the buffer `material` of the shader. Without lamps it has no layer.
    pub fn material(&self) -> &[u32] {
        self.material.as_ref().map_or(&[0], PackedMaterial::words)
    }
}

/// The radiance toward the viewer of a surface whose map shows `soft`.
pub fn lamps(lamps: &PackedLamps, soft: Vec3, surface: &Surface) -> Vec3 {
    let [_, is_cut, turns, _] = lamps.elements[0];
    let soft = if is_cut == 1.0 { soft.max(Vec3::ZERO) } else { soft };
    let Some(material) = &lamps.material else { return soft };
    let frame = Mat3::from_cols(surface.tangent, surface.normal.cross(surface.tangent), surface.normal);
    let to_surface = frame.transpose();
    let view = to_surface * surface.view;
    let mut sum = soft;
    for [direction, flux] in lamps.elements[1..].as_chunks().0 {
        let [direction, flux] = [direction, flux].map(|[x, y, z, _]| Vec3::new(*x, *y, *z));
        let incident = to_surface * direction;
        for turn in 0..turns as u32 {
            let (sine, cosine) = math::sin_cos(TAU * turn as f32 / turns);
            let turned =
                Mat3::from_cols(Vec3::new(cosine, sine, 0.0), Vec3::new(-sine, cosine, 0.0), Vec3::Z);
            sum += flux * material.evaluate(turned * incident, turned * view) / turns;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::material::tests::{allowed, materials};
    #[cfg(feature = "gpu")]
    use crate::shading::on_device;
    use crate::shading::testkit::{apart, lights, reflection, surfaces};
    use brdf::Material;
    use sphere::{DVec3, Direction};

    /// Materials of every model, with their sharpness, and their lamps: anisotropic ones have fewer, which
    /// cost more.
    fn cases() -> Vec<(Lamps, f64)> {
        let of_material = |(material, s): (Material, f64)| {
            let count = if material.turns() == 1 { 8 } else { 2 };
            (Lamps { lights: lights().into_iter().take(count).collect(), material }, s)
        };
        materials().into_iter().map(of_material).collect()
    }

    fn packed(lamps: &Lamps) -> PackedLamps {
        PackedLamps::new(Some(&reflection(lamps.material.centre(), 2, 1).with_lamps(lamps.clone()))).unwrap()
    }

    /// The error of a sum of lamps: the largest of their materials' relative errors ([`allowed`]). Turning
    /// the light and the view into the surface's frame moves them by three more roundings.
    fn error(lamps: &Lamps, s: f64, surface: &Surface, radiance: [f64; 3]) -> f64 {
        let largest = radiance.into_iter().fold(0.0, f64::max);
        let of_point = |(direction, _): &(sphere::Direction, [f64; 3])| {
            allowed(largest, s, [direction.vector().as_vec3(), surface.view])
        };
        4.0 * lamps.points().iter().map(of_point).fold(0.0, f64::max) + 1e-5
    }

    /// Points on the horizon may be on either side of it.
    fn is_clear(lamps: &Lamps, surface: &Surface) -> bool {
        let points = lamps.points();
        let mut heights =
            points.iter().map(|(direction, _)| surface.normal.dot(direction.vector().as_vec3()).abs());
        heights.all(|height| height > 1e-5)
    }

    /// The sum over the points of lamps by the material itself, in the frame of a surface.
    fn sum(lamps: &Lamps, [normal, tangent, view]: [Direction; 3]) -> [f64; 3] {
        let (n, t) = (normal.vector(), tangent.vector());
        let local = |direction: Direction| {
            let d = direction.vector();
            Direction::normalised(DVec3::new(d.dot(t), d.dot(n.cross(t)), d.dot(n)))
        };
        let (turns, mut sum) = (lamps.material.turns(), [0.0; 3]);
        for (direction, flux) in lamps.points() {
            let rho = lamps.material.mean_over_turns(turns, local(direction), local(view));
            (0..3).for_each(|channel| sum[channel] += flux[channel] * rho[channel]);
        }
        sum
    }

    #[test]
    fn radiance_matches_the_kernel() {
        let mut count = 0;
        for (beside, s) in cases() {
            let packed = packed(&beside);
            for (surface, axes) in surfaces().into_iter().step_by(3) {
                if !is_clear(&beside, &surface) {
                    continue;
                }
                let expected = sum(&beside, axes);
                let found = lamps(&packed, Vec3::splat(-3.0), &surface);
                let allowed = error(&beside, s, &surface, expected);
                assert!(
                    apart(found, expected) < allowed,
                    "{:?} {surface:?}: {found} {expected:?}, {allowed:e}",
                    beside.material
                );
                count += usize::from(expected[0] > 0.01);
            }
        }
        assert!(count > 10_000, "{count}");
    }

    /// Soft light is cut at 0 before lamps are added, or if its degrees were chosen for this light.
    #[test]
    fn negative_soft_light_is_cut_unless_its_degrees_were_given() {
        let (surface, _) = surfaces()[7];
        let soft = Vec3::new(-1.0, 0.5, -0.1);
        let shown =
            |reflection: Option<&Reflection>| lamps(&PackedLamps::new(reflection).unwrap(), soft, &surface);
        let given = reflection(brdf::Centre::Normal, 2, 1);
        assert_eq!(shown(Some(&given)), soft);
        assert_eq!(shown(None), soft);
        assert_eq!(shown(Some(&given.clone().marked_for_light())), soft.max(Vec3::ZERO));
        let black = Material::Lambert(brdf::Lambert::new([0.0; 3]).unwrap());
        let lit = given.with_lamps(Lamps { lights: lights(), material: black });
        assert_eq!(shown(Some(&lit)), soft.max(Vec3::ZERO));
    }

    #[cfg(feature = "gpu")]
    #[test]
    fn the_shader_matches_its_twin() {
        let Some(device) = on_device::device("the_shader_matches_its_twin") else { return };
        let source = [
            include_str!("surface.wgsl"),
            include_str!("angles.wgsl"),
            &crate::shading::material::shader(),
            include_str!("lamps.wgsl"),
            "fn answer(k: u32) -> vec3f {
                let surface = Surface(asked[3u * k].xyz, asked[3u * k + 1u].xyz, asked[3u * k + 2u].xyz);
                return lamps_added(surface, vec3f(-1.0, 0.5, 2.0));
            }",
        ]
        .concat();
        let soft = Vec3::new(-1.0, 0.5, 2.0);
        let surfaces: Vec<Surface> = surfaces().into_iter().map(|(surface, _)| surface).step_by(7).collect();
        let vectors = surfaces.iter().flat_map(|surface| [surface.normal, surface.tangent, surface.view]);
        let asked: Vec<[f32; 4]> = vectors.map(|v| v.extend(0.0).to_array()).collect();
        for (beside, s) in cases() {
            let packed = packed(&beside);
            let [material, elements] =
                [bytemuck::cast_slice(packed.material()), bytemuck::cast_slice(packed.elements())];
            let buffers: [&[u8]; 4] = [&[], material, &[], elements];
            let answers = on_device::answers(&device, &source, &asked, surfaces.len(), &buffers);
            for (surface, found) in surfaces.iter().zip(answers) {
                if !is_clear(&beside, surface) {
                    continue;
                }
                let expected = lamps(&packed, soft, surface).as_dvec3().to_array();
                let allowed = error(&beside, s, surface, expected);
                assert!(
                    apart(found.into(), expected) < allowed,
                    "{:?} {surface:?}: {found:?} {expected:?}, {allowed:e}",
                    beside.material
                );
            }
        }
        // Without lamps there is no light and no layer.
        for is_cut in [false, true] {
            let given = reflection(brdf::Centre::Normal, 2, 1);
            let given = if is_cut { given.marked_for_light() } else { given };
            let none = PackedLamps::new(Some(&given)).unwrap();
            let [material, elements] =
                [bytemuck::cast_slice(none.material()), bytemuck::cast_slice(none.elements())];
            let buffers: [&[u8]; 4] = [&[], material, &[], elements];
            let expected = if is_cut { soft.max(Vec3::ZERO) } else { soft };
            let answers = on_device::answers(&device, &source, &asked, surfaces.len(), &buffers);
            assert!(answers.into_iter().all(|found| Vec3::from(found) == expected));
        }
    }
}
