//! The suns and lamps beside a reflected field (`shrm::Lamps`). A map that is looked up has the soft light;
//! each lamp adds its flux times rho_hat of the reflection's own material ([`super::material`]), in the
//! surface's frame:
//!
//! > max(soft, 0) + sum over the points of the lamps of flux rho_hat(direction of the point, V).
//!
//! This is `shrm::Lamps::radiance`: a lamp that is large beside the material's highlight has some hundred or
//! thousand points where it is reflected, and few or one where its reflection is far away. Each point costs a
//! look at the material. An anisotropic material is taken in the mean over some turns of the surface about
//! its normal if the map that the lamps are added to has no tangent; it costs that many times more. Beside
//! taps that know the tangent the surface is not turned, and each lamp has the finest of its points
//! everywhere, because a streak is narrow far from the highlight's peak too: `LampPoints::surface_radiance`.
//! So it is beside a BRDF table, whose soft light is not cut at 0.
//!
//! With shadows, a point whose direction is hidden adds nothing. Each level then has at least `SHADOW_RAYS`
//! points, spread over the lamp's disk, so that the edges of shadows are soft, and at most
//! `MOST_SHADOW_RAYS` if a coarser level does. The device adds lamp after lamp.
//!
//! Directions are in the light's frame, so that lamps turn with the light. The elements, of four f32:
//!
//! | elements | what |
//! | --- | --- |
//! | 1 | the number of lamps; 1 if the soft light is cut at 0, otherwise 0; the number of turns |
//! | 1 | what points are chosen by: `shrm::LampPoints::choice` |
//! | per lamp 3 | the direction of its centre, its radius; its flux, RGB; the place of its levels, their number |
//! | per level 1 | the place of its points, their number; the first level is the centre alone, the others go from fine to coarse |
//! | per point 1 | its direction, its share of the flux |

use std::f32::consts::{FRAC_PI_2, TAU};

use brdf::Material;
use glam::{Mat3, Vec3};
use shrm::{LampLevels, LampPoints, Lamps, Reflection};
use sphere::Direction;

use super::material;
use super::surface::Surface;
use crate::{CompactMap, CompactTaps, Look, Mode};

/// The number of elements before the lamps, and that of each lamp.
const HEAD: usize = 2;
const LAMP: usize = 3;

/// The fewest points of a lamp that casts shadows, as many as the default of the kind `shade-vertices`.
const SHADOW_RAYS: usize = 16;

/// A lamp whose centre is lower than its radius, by this much more than rounding moves its points, is below
/// the horizon.
const ROUNDING: f32 = 1e-4;

/// The most points of a lamp that casts shadows: a device traces all rays toward a lamp at once.
const MOST_SHADOW_RAYS: usize = 256;

/// The lamps of a reflection and their material, as the shader reads them.
#[derive(Clone, Debug)]
pub struct PackedLamps {
    elements: Vec<[f32; 4]>,
    material: Option<Material>,
}

impl PackedLamps {
    /// Packs the lamps of a reflection; an imported map has none.
    pub fn new(reflection: Option<&Reflection>) -> Self {
        let is_for_light = reflection.is_some_and(Reflection::is_for_light);
        let lamps = reflection.and_then(Reflection::lamps);
        Self::of(lamps, Packing { is_cut: is_for_light || has_lights(lamps), ..Packing::default() })
    }

    /// Packs the lights beside the map of a mode of a look.
    pub fn beside_map(look: &Look, mode: Mode) -> Self {
        match mode {
            Mode::Prefiltered => {
                let lamps = look.beside_cube();
                let is_cut = has_lights(lamps.as_ref());
                Self::of(lamps.as_ref(), Packing { is_cut, ..Packing::default() })
            }
            Mode::Table | Mode::Transfer => {
                let lamps = look.beside_table();
                let has_tangent = lamps.as_ref().is_some_and(|lamps| lamps.material.turns() > 1);
                let casts_shadows = mode == Mode::Transfer;
                Self::of(lamps.as_ref(), Packing { has_tangent, casts_shadows, is_cut: false })
            }
            _ => Self::new(look.beside()),
        }
    }

    /// Packs the lights beside a compact map.
    pub fn beside(map: &CompactMap) -> Self {
        let (lamps, has_tangent) = (map.lamps(), matches!(*map.taps, CompactTaps::View(_)));
        let is_cut = has_lights(Some(&lamps));
        Self::of(Some(&lamps), Packing { is_cut, has_tangent, ..Packing::default() })
    }

    fn of(lamps: Option<&Lamps>, packing: Packing) -> Self {
        let Packing { is_cut, has_tangent, casts_shadows } = packing;
        let lamps = lamps.filter(|lamps| !lamps.lights.is_empty());
        let turns = lamps.map_or(1, |lamps| if has_tangent { 1 } else { lamps.material.turns() });
        let points = lamps.map(Lamps::for_views);
        let lights = points.as_ref().map(LampPoints::lamps).unwrap_or_default();
        let mut elements = vec![
            [lights.len() as f32, f32::from(u8::from(is_cut)), turns as f32, 0.0],
            points.as_ref().map_or([0.0; 4], |points| points.choice().map(|value| value as f32)),
        ];
        let element =
            |direction: Direction, last: f64| direction.vector().as_vec3().extend(last as f32).into();
        elements.resize(HEAD + LAMP * lights.len(), [0.0; 4]);
        for (index, LampLevels { light, flux, levels, .. }) in lights.iter().enumerate() {
            let [red, green, blue] = flux.map(|flux| flux as f32);
            let centre = [(light.direction, 1.0)];
            let all = levels;
            let levels = if has_tangent { &levels[..levels.len().min(1)] } else { &levels[..] };
            let spread: Vec<(Direction, f64)> = light
                .directions(SHADOW_RAYS)
                .map(|direction| (direction, 1.0 / SHADOW_RAYS as f64))
                .collect();
            let levels = std::iter::once(centre.as_slice()).chain(levels.iter().map(Vec::as_slice));
            let finest = || finest_below(MOST_SHADOW_RAYS, all);
            let levels: Vec<&[(Direction, f64)]> = levels
                .map(|level| match level.len() {
                    _ if !casts_shadows => level,
                    ..SHADOW_RAYS => &spread,
                    SHADOW_RAYS..=MOST_SHADOW_RAYS => level,
                    _ => finest(),
                })
                .collect();
            let mut place = elements.len();
            elements[HEAD + LAMP * index..][..LAMP].copy_from_slice(&[
                element(light.direction, light.radius),
                [red, green, blue, 0.0],
                [place as f32, levels.len() as f32, 0.0, 0.0],
            ]);
            place += levels.len();
            for level in &levels {
                elements.push([place as f32, level.len() as f32, 0.0, 0.0]);
                place += level.len();
            }
            elements.extend(levels.concat().into_iter().map(|(direction, share)| element(direction, share)));
        }
        Self { elements, material: lamps.map(|lamps| lamps.material.clone()) }
    }

    /// The elements: the buffer `lamps` of the shader.
    pub fn elements(&self) -> &[[f32; 4]] {
        &self.elements
    }

    /// The number of lamps.
    pub(crate) fn count(&self) -> u32 {
        self.elements[0][0] as u32
    }

    /// The material of the lamps, if there are any, which a
    /// [`PackedMaterial`](material::PackedMaterial) brings into the buffer `material` of the shader.
    pub fn material(&self) -> Option<&Material> {
        self.material.as_ref()
    }
}

/// How lamps are packed.
#[derive(Clone, Copy, Default)]
struct Packing {
    /// Whether soft light below zero is cut.
    is_cut: bool,
    /// Whether the material reflects the lamps with the surface's tangent.
    has_tangent: bool,
    /// Whether the mesh may hide the lamps.
    casts_shadows: bool,
}

/// The finest level with so many points at most; otherwise the coarsest.
fn finest_below(most: usize, levels: &[Vec<(Direction, f64)>]) -> &[(Direction, f64)] {
    levels.iter().find(|level| level.len() <= most).or(levels.last()).map_or(&[], Vec::as_slice)
}

fn has_lights(lamps: Option<&Lamps>) -> bool {
    lamps.is_some_and(|lamps| !lamps.lights.is_empty())
}

/// The radiance toward the viewer of a surface whose map shows `soft`.
pub fn lamps(lamps: &PackedLamps, soft: Vec3, surface: &Surface) -> Vec3 {
    lamps_past(lamps, soft, surface, |_| true)
}

/// [`lamps`] of the light that arrives: `sees` says for a direction, in the light's frame, whether light from
/// there does.
pub(crate) fn lamps_past(
    lamps: &PackedLamps,
    soft: Vec3,
    surface: &Surface,
    sees: impl Fn(Vec3) -> bool,
) -> Vec3 {
    let [_, is_cut, turns, _] = lamps.elements[0];
    let soft = if is_cut == 1.0 { soft.max(Vec3::ZERO) } else { soft };
    let Some(of) = &lamps.material else { return soft };
    let frame = Mat3::from_cols(surface.tangent, surface.normal.cross(surface.tangent), surface.normal);
    let to_surface = frame.transpose();
    let view = to_surface * surface.view;
    let mirrored = Vec3::new(-view.x, -view.y, view.z);
    let turned = |turn: u32| {
        let (sine, cosine) = math::sin_cos(TAU * turn as f32 / turns);
        let turned = Mat3::from_cols(Vec3::new(cosine, sine, 0.0), Vec3::new(-sine, cosine, 0.0), Vec3::Z);
        (turned, material::direction(turned * view))
    };
    let views: Vec<(Mat3, Direction)> = (0..turns as u32).map(turned).collect();
    // The points of all lamps, and the number of those before each lamp's end.
    let (mut points, mut shares, mut ends) = (Vec::new(), Vec::new(), Vec::new());
    let has_horizon = of.has_horizon();
    let all = &lamps.elements[HEAD..].as_chunks::<LAMP>().0[..lamps.elements[0][0] as usize];
    for lamp in all {
        let [x, y, z, radius] = lamp[0];
        let centre = to_surface * Vec3::new(x, y, z);
        if has_horizon && centre.z < -math::sin(radius.min(FRAC_PI_2)) - ROUNDING {
            ends.push(points.len());
            continue;
        }
        let level =
            lamp[2][0] as usize + chosen_level(lamps.elements[1], lamp[2][1], radius, centre, mirrored);
        let [place, count, ..] = lamps.elements[level].map(|value| value as usize);
        for [x, y, z, share] in &lamps.elements[place..place + count] {
            let direction = Vec3::new(*x, *y, *z);
            if sees(direction) {
                points.push(to_surface * direction);
                shares.push(*share / turns);
            }
        }
        ends.push(points.len());
    }
    let toward = |(turned, outgoing): &(Mat3, Direction)| {
        let incident: Vec<_> = points.iter().map(|point| material::direction(*turned * *point)).collect();
        material::rho_hats(of, *outgoing, &incident)
    };
    let values: Vec<Vec<Vec3>> = views.iter().map(toward).collect();
    let (mut sum, mut start) = (soft, 0);
    for (lamp, end) in all.iter().zip(ends) {
        let mut reflected = Vec3::ZERO;
        for point in start..end {
            for of_turn in &values {
                reflected += shares[point] * of_turn[point];
            }
        }
        sum += Vec3::from_slice(&lamp[1]) * reflected;
        start = end;
    }
    sum
}

/// The index of the level of a lamp that is seen, of so many: its centre alone is the first. The directions
/// of the lamp's centre and of the view's mirror image are in the surface's frame.
fn chosen_level(
    [width, tail, widest, point]: [f32; 4],
    levels: f32,
    radius: f32,
    centre: Vec3,
    mirrored: Vec3,
) -> usize {
    if levels <= 2.0 {
        return 1;
    }
    let away = 2.0 * math::asin((0.5 * centre.distance(mirrored)).min(1.0)) - radius;
    let feature = (tail * away).min(widest);
    let is_whole = centre.z.abs() > math::sin(radius.min(FRAC_PI_2));
    if is_whole && radius <= point * feature {
        return 0;
    }
    if feature < 2.0 * width {
        return 1;
    }
    (1 + math::log2(feature / width) as usize).min(levels as usize - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::material::tests::{allowed, materials};
    use crate::shading::testkit::{apart, facet_table, lights, reflection, scale_space, surfaces};
    #[cfg(feature = "gpu")]
    use crate::shading::{material::PackedMaterial, on_device, shadows::NO_SHADOWS};
    use sphere::{DMat3, DVec3, Direction};
    use std::sync::Arc;

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
        PackedLamps::new(Some(&reflection(lamps.material.centre(), 2, 1).with_lamps(lamps.clone())))
    }

    /// The sum over the points of lamps that the kernel chooses for a surface with these axes, and the
    /// points.
    fn by_kernel(
        lamps: &LampPoints<'_>,
        material: &Material,
        axes: [DVec3; 3],
    ) -> ([f64; 3], Vec<Direction>) {
        let [normal, tangent, view] = axes;
        let local = |d: DVec3| DVec3::new(d.dot(tangent), d.dot(normal.cross(tangent)), d.dot(normal));
        let (turns, view) = (material.turns(), local(view));
        let (mut sum, mut points) = ([0.0; 3], Vec::new());
        for lamp in lamps.lamps() {
            let mirrored = DVec3::new(-view.x, -view.y, view.z);
            for (direction, share) in lamp.points(local(lamp.light.direction.vector()), mirrored) {
                let incident = Direction::normalised(local(direction.vector()));
                let rho = material.mean_over_turns(turns, incident, Direction::normalised(view));
                (0..3).for_each(|channel| sum[channel] += lamp.flux[channel] * share * rho[channel]);
                points.push(*direction);
            }
        }
        (sum, points)
    }

    /// The error of a sum of lamps: the largest of their materials' relative errors ([`allowed`]). Turning
    /// the light and the view into the surface's frame moves them by three more roundings.
    fn error(points: &[Direction], s: f64, surface: &Surface, radiance: [f64; 3]) -> f64 {
        let largest = radiance.into_iter().fold(0.0, f64::max);
        let of_point =
            |direction: &Direction| allowed(largest, s, [direction.vector().as_vec3(), surface.view]);
        4.0 * points.iter().map(of_point).fold(0.0, f64::max) + 1e-5
    }

    /// Points on the horizon may be on either side of it.
    fn is_clear(points: &[Direction], surface: &Surface) -> bool {
        points.iter().all(|direction| surface.normal.dot(direction.vector().as_vec3()).abs() > 1e-5)
    }

    /// The number of sums among which rounding may choose other points in one.
    const OTHER_POINTS: usize = 200;

    #[test]
    fn radiance_matches_the_kernel() {
        let (mut count, mut others) = (0, 0);
        for (beside, s) in cases() {
            let (packed, all) = (packed(&beside), beside.for_views());
            for (surface, axes) in surfaces().into_iter().step_by(3) {
                let (expected, points) = by_kernel(&all, &beside.material, axes.map(Direction::vector));
                if !is_clear(&points, &surface) {
                    continue;
                }
                let found = lamps(&packed, Vec3::splat(-3.0), &surface);
                let is_other = apart(found, expected) >= error(&points, s, &surface, expected);
                others += usize::from(is_other);
                count += usize::from(expected[0] > 0.01);
            }
        }
        assert!(others * OTHER_POINTS < count, "{others} of {count}");
        assert!(count > 10_000, "{count}");
    }

    /// Beside taps that know the tangent, an anisotropic material is not turned.
    #[test]
    fn lamps_beside_facets_are_reflected_with_the_tangent() {
        let (mut count, mut others) = (0, 0);
        for (beside, s) in cases().into_iter().filter(|(beside, _)| beside.material.turns() > 1) {
            let packed = PackedLamps::beside(&CompactMap {
                scales: Arc::new(scale_space(8, beside.lights.clone())),
                taps: Arc::new(CompactTaps::View(facet_table(true, 1, 0))),
                material: beside.material.clone(),
            });
            let all = beside.for_views();
            for (surface, [normal, tangent, view]) in surfaces().into_iter().step_by(3) {
                let [z, x] = [normal, tangent].map(Direction::vector);
                let expected = all.surface_radiance(DMat3::from_cols(x, z.cross(x), z), view);
                let points = all.lamps().iter().flat_map(|lamp| &lamp.levels[0]);
                let points: Vec<Direction> = points.map(|(direction, _)| *direction).collect();
                if !is_clear(&points, &surface) {
                    continue;
                }
                let found = lamps(&packed, Vec3::splat(-3.0), &surface);
                others += usize::from(apart(found, expected) >= error(&points, s, &surface, expected));
                count += usize::from(expected[0] > 0.01);
            }
        }
        assert!(others == 0 && count > 500, "{others} of {count}");
    }

    /// Soft light is cut at 0 before lamps are added, or if its degrees were chosen for this light.
    #[test]
    fn negative_soft_light_is_cut_unless_its_degrees_were_given() {
        let (surface, _) = surfaces()[7];
        let soft = Vec3::new(-1.0, 0.5, -0.1);
        let shown = |reflection: Option<&Reflection>| lamps(&PackedLamps::new(reflection), soft, &surface);
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
            &crate::shading::material::shader(&crate::shading::material::all_models()),
            NO_SHADOWS,
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
        let (mut count, mut others) = (0, 0);
        for (beside, s) in cases() {
            let (packed, all) = (packed(&beside), beside.for_views());
            let material = PackedMaterial::new(packed.material()).unwrap();
            let [material, elements] =
                [bytemuck::cast_slice(material.words()), bytemuck::cast_slice(packed.elements())];
            let buffers: [&[u8]; 4] = [&[], material, &[], elements];
            let answers = on_device::answers(&device, &source, &asked, surfaces.len(), &buffers);
            for (surface, found) in surfaces.iter().zip(answers) {
                let axes = [surface.normal, surface.tangent, surface.view].map(|axis| axis.as_dvec3());
                let (_, points) = by_kernel(&all, &beside.material, axes);
                if !is_clear(&points, surface) {
                    continue;
                }
                let expected = lamps(&packed, soft, surface).as_dvec3().to_array();
                let is_other = apart(found.into(), expected) >= error(&points, s, surface, expected);
                (count, others) = (count + 1, others + usize::from(is_other));
            }
        }
        assert!(others * OTHER_POINTS < count, "{others} of {count}");
        assert!(count > 10_000, "{count}");
        // Without lamps there is no light and no layer.
        for is_cut in [false, true] {
            let given = reflection(brdf::Centre::Normal, 2, 1);
            let given = if is_cut { given.marked_for_light() } else { given };
            let none = PackedLamps::new(Some(&given));
            let material = PackedMaterial::new(none.material()).unwrap();
            let [material, elements] =
                [bytemuck::cast_slice(material.words()), bytemuck::cast_slice(none.elements())];
            let buffers: [&[u8]; 4] = [&[], material, &[], elements];
            let expected = if is_cut { soft.max(Vec3::ZERO) } else { soft };
            let answers = on_device::answers(&device, &source, &asked, surfaces.len(), &buffers);
            assert!(answers.into_iter().all(|found| Vec3::from(found) == expected));
        }
    }
}
