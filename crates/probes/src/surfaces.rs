//! The surfaces of a scene as rays meet them: which they pass, what they reflect, and how they emit.

use std::cmp::Ordering;

use glam::Vec3;
use rayon::prelude::*;
use transfer::{RayCaster, RayHit};

use crate::material::{Alpha, Emission, MOST_ALBEDO, Material};
use crate::random::{hash, hash_of, share_of};
use crate::scene::{Corner, Scene, SceneParts};
use crate::texture::{Levels, Texture, TextureUse};

/// A scene that rays may be cast into.
pub struct Surfaces<'a> {
    pub(crate) parts: &'a SceneParts,
    pub(crate) caster: RayCaster,
    levels: Vec<Levels>,
    /// Whether rays may pass any surface.
    is_opaque: bool,
    /// For each material, the column of its emission, or [`SceneParts::NONE`].
    pub(crate) column_of: Vec<u32>,
    /// The number of columns of emission.
    pub(crate) columns: usize,
    is_grey: bool,
}

/// A place on a surface that a ray met.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) triangle: u32,
    pub(crate) weights: [f32; 2],
    /// The place itself.
    pub(crate) position: Vec3,
    /// The normal, of length 1, on the side that the ray came from.
    pub(crate) normal: Vec3,
    /// How far above the place rays start.
    pub(crate) clearance: f32,
    /// Whether light is reflected and emitted: it is not on the back of a surface of one side.
    pub(crate) is_lit: bool,
}

impl Place {
    /// Where rays start that leave the surface.
    pub(crate) fn start(&self) -> Vec3 {
        self.position + self.normal * self.clearance
    }
}

/// What surfaces let pass that a ray goes through, each at its distance.
#[derive(Default)]
struct Passed(Vec<(f32, [f32; 3])>);

impl Passed {
    fn add(&mut self, hit: &RayHit, passing: [f32; 3]) {
        if passing != [1.0; 3] && passing != [0.0; 3] {
            self.0.push((hit.distance, passing));
        }
    }

    /// What all of them leave of the ray's light. They are multiplied in the order of their distances: a tree
    /// finds them in any order, and the product is rounded.
    fn left(mut self) -> [f32; 3] {
        self.0.sort_by(|one, other| one.partial_cmp(other).unwrap_or(Ordering::Equal));
        self.0.iter().fold([1.0; 3], |left, (_, passing)| [0, 1, 2].map(|k| left[k] * passing[k]))
    }
}

impl<'a> Surfaces<'a> {
    /// The surfaces of a scene, in a tree.
    pub fn new(scene: &'a Scene) -> Self {
        let parts = scene.parts();
        let mut column_of = vec![SceneParts::NONE; parts.materials.len()];
        let emitters = scene.emitters();
        (0..).zip(&emitters).for_each(|(column, &material)| column_of[material as usize] = column);
        Self {
            parts,
            caster: RayCaster::new(&parts.triangles),
            levels: Levels::all_of(&parts.textures),
            is_opaque: parts.materials.iter().all(Material::is_opaque),
            column_of,
            columns: emitters.len(),
            is_grey: scene.is_grey(),
        }
    }

    /// For each triangle, a hash of all that light sees of it.
    pub(crate) fn digests(&self) -> impl Iterator<Item = u64> {
        let textures: Vec<u64> = self.parts.textures.par_iter().map(Texture::digest).collect();
        let material =
            |(material, column): (&Material, &u32)| hash(material.digest(&textures) ^ u64::from(*column));
        let materials: Vec<u64> = self.parts.materials.iter().zip(&self.column_of).map(material).collect();
        let parts = self.parts;
        (0..parts.triangles.len()).map(move |triangle| {
            let material = materials[parts.material_of[triangle] as usize];
            let digest = hash_of(material, parts.triangles[triangle].into_iter().flatten());
            let corners = parts.attributes.get(parts.attributes_of[triangle] as usize).into_iter().flatten();
            corners.fold(digest, |digest, Corner { color, base, emission, metallic }| {
                let numbers = color.iter().chain(base).chain(emission).chain(metallic);
                hash_of(digest, numbers.copied())
            })
        })
    }

    /// The channels of the transport from the sky: 1 if all surfaces are grey, else 3.
    pub fn channels(&self) -> usize {
        if self.is_grey { 1 } else { 3 }
    }

    pub(crate) fn material(&self, triangle: u32) -> &'a Material {
        &self.parts.materials[self.parts.material_of[triangle as usize] as usize]
    }

    /// What a triangle has at a place, by the weights of its second and third corner.
    fn corner(&self, triangle: u32, [u, v]: [f32; 2]) -> Corner {
        let at = self.parts.attributes_of[triangle as usize];
        let Some([one, two, three]) = self.parts.attributes.get(at as usize) else {
            return Corner::default();
        };
        let w = 1.0 - u - v;
        fn mix<const N: usize>([a, b, c]: [&[f32; N]; 3], [w, u, v]: [f32; 3]) -> [f32; N] {
            std::array::from_fn(|k| w * a[k] + u * b[k] + v * c[k])
        }
        let weights = [w, u, v];
        Corner {
            color: mix([&one.color, &two.color, &three.color], weights),
            base: mix([&one.base, &two.base, &three.base], weights),
            emission: mix([&one.emission, &two.emission, &three.emission], weights),
            metallic: mix([&one.metallic, &two.metallic, &three.metallic], weights),
        }
    }

    /// A texture at coordinates, averaged over an area of the surface in square metres.
    fn look_up(
        &self,
        how: &TextureUse,
        at: [f32; 2],
        triangle: u32,
        area: f32,
        of: fn(&Corner) -> [f32; 2],
    ) -> [f32; 4] {
        let levels = &self.levels[how.texture as usize];
        let mut texels = 0.0;
        if area > 0.0
            && let Some(corners) =
                self.parts.attributes.get(self.parts.attributes_of[triangle as usize] as usize)
        {
            let [[au, av], [bu, bv], [cu, cv]] = [0, 1, 2].map(|k| of(&corners[k]));
            let in_texture = ((bu - au) * (cv - av) - (bv - av) * (cu - au)).abs();
            let on_surface = self.twice_normal(triangle).length();
            texels = area * in_texture * levels.texels() / on_surface;
        }
        levels.at(at, texels, how)
    }

    /// The normal of a triangle's front, whose length is twice its area in square metres.
    pub(crate) fn twice_normal(&self, triangle: u32) -> Vec3 {
        let [a, b, c] = self.parts.triangles[triangle as usize].map(Vec3::from);
        (b - a).cross(c - a)
    }

    /// The base colour and alpha at a place.
    fn base(&self, triangle: u32, corner: &Corner, area: f32) -> [f32; 4] {
        let material = self.material(triangle);
        let texel = match &material.base_texture {
            Some(how) => self.look_up(how, corner.base, triangle, area, |corner| corner.base),
            None => [1.0; 4],
        };
        [0, 1, 2, 3].map(|k| material.base[k] * texel[k] * corner.color[k])
    }

    /// What of a ray passes a surface that it meets, RGB.
    pub(crate) fn passing(&self, hit: &RayHit) -> [f32; 3] {
        let material = self.material(hit.triangle);
        if material.is_opaque() {
            return [0.0; 3];
        }
        let base = self.base(hit.triangle, &self.corner(hit.triangle, hit.weights), 0.0);
        let beside = match material.alpha {
            Alpha::Opaque => 0.0,
            Alpha::Mask(cutoff) => f32::from(u8::from(base[3] < cutoff)),
            Alpha::Blend => 1.0 - base[3].clamp(0.0, 1.0),
        };
        let through = (1.0 - beside) * material.transmission;
        [0, 1, 2].map(|channel| beside + through * base[channel].clamp(0.0, 1.0))
    }

    /// The first surface that a ray meets, and what the surfaces that it passed left of its light.
    ///
    /// A surface that lets a share of light pass ends the ray or not at random: by `seed` and the surface.
    pub(crate) fn closest(&self, origin: Vec3, direction: Vec3, seed: u64) -> (Option<RayHit>, [f32; 3]) {
        if self.is_opaque {
            return (self.caster.closest(origin, direction, |_| true), [1.0; 3]);
        }
        let corners = |hit: &RayHit| self.parts.triangles[hit.triangle as usize].into_iter().flatten();
        let chance = |hit: &RayHit| share_of(hash_of(seed, corners(hit)));
        // The mean of what passes is the chance to pass it; the light that does takes its colour.
        let mean = |[red, green, blue]: [f32; 3]| (red + green + blue) / 3.0;
        let meets = |hit: &RayHit| {
            let material = self.material(hit.triangle);
            material.is_opaque() || {
                let passing = mean(self.passing(hit));
                passing <= 0.0 || passing < 1.0 && chance(hit) >= passing
            }
        };
        let hit = self.caster.closest(origin, direction, meets);
        let mut passed = Passed::default();
        let reach = hit.map_or(f32::INFINITY, |hit| hit.distance);
        // What was passed before the hit: only colours matter.
        self.caster.is_blocked(origin, direction, reach, |surface| {
            if self.material(surface.triangle).transmission > 0.0 && surface.distance < reach {
                let passing = self.passing(surface);
                let mean = mean(passing);
                if mean > 0.0 && chance(surface) < mean {
                    passed.add(surface, passing.map(|passing| passing / mean));
                }
            }
            false
        });
        (hit, passed.left())
    }

    /// What of the light between two places arrives, RGB; `None` if it is nothing.
    pub(crate) fn between(&self, origin: Vec3, direction: Vec3, distance: f32) -> Option<[f32; 3]> {
        let mut passed = Passed::default();
        let is_blocked = self.caster.is_blocked(origin, direction, distance, |hit| {
            let passing = if self.is_opaque { [0.0; 3] } else { self.passing(hit) };
            passed.add(hit, passing);
            passing == [0.0; 3]
        });
        if is_blocked { None } else { Some(passed.left()).filter(|left| *left != [0.0; 3]) }
    }

    /// Where [`Surfaces::between`] finds nothing that arrives: the distance of the first surface that lets
    /// nothing pass, or all the way if it is several that do so together.
    pub(crate) fn blocked_after(&self, origin: Vec3, direction: Vec3, distance: f32) -> f32 {
        let hit =
            self.caster.closest(origin, direction, |hit| self.is_opaque || self.passing(hit) == [0.0; 3]);
        hit.map_or(distance, |hit| hit.distance.min(distance))
    }

    /// The place of a hit.
    pub(crate) fn place(&self, hit: &RayHit) -> Place {
        self.place_on(hit.triangle, hit.weights, hit.front)
    }

    /// The place on a side of a triangle, by the weights of its second and third corner.
    pub(crate) fn place_on(&self, triangle: u32, [u, v]: [f32; 2], front: bool) -> Place {
        let [a, b, c] = self.parts.triangles[triangle as usize].map(Vec3::from);
        let (along, across) = (b - a, c - a);
        let position = a + along * u + across * v;
        let outward = along.cross(across).normalize_or_zero();
        Place {
            triangle,
            weights: [u, v],
            position,
            normal: if front { outward } else { -outward },
            clearance: self.caster.clearance(triangle, position),
            is_lit: front || self.material(triangle).is_double_sided,
        }
    }

    /// The albedo at a place, averaged over an area in square metres.
    pub(crate) fn albedo(&self, place: &Place, area: f32) -> [f32; 3] {
        let material = self.material(place.triangle);
        if material.is_unlit {
            return [0.0; 3];
        }
        let corner = self.corner(place.triangle, place.weights);
        let base = self.base(place.triangle, &corner, area);
        let mut metallic = material.metallic;
        if let Some(how) = &material.metallic_texture {
            metallic *= self.look_up(how, corner.metallic, place.triangle, area, |corner| corner.metallic)[0];
        }
        [0, 1, 2].map(|channel| (base[channel] * (1.0 - metallic)).clamp(0.0, MOST_ALBEDO))
    }

    /// What the radiance of the material's emission is multiplied by at a place, averaged over an area in
    /// square metres, RGB.
    pub(crate) fn emission(&self, triangle: u32, weights: [f32; 2], area: f32) -> [f32; 3] {
        let material = self.material(triangle);
        let Some(Emission { texture, .. }) = &material.emission else { return [0.0; 3] };
        if texture.is_none() && !material.is_unlit {
            return [1.0; 3];
        }
        let corner = self.corner(triangle, weights);
        let texel = match texture {
            Some(how) if material.is_unlit => {
                self.look_up(how, corner.base, triangle, area, |corner| corner.base)
            }
            Some(how) => self.look_up(how, corner.emission, triangle, area, |corner| corner.emission),
            None => [1.0; 4],
        };
        let color = if material.is_unlit { corner.color } else { [1.0; 4] };
        [0, 1, 2].map(|channel| texel[channel] * color[channel])
    }

    /// The column of the emission of a triangle's material, if it emits.
    pub(crate) fn column(&self, triangle: u32) -> Option<usize> {
        let column = self.column_of[self.parts.material_of[triangle as usize] as usize];
        (column != SceneParts::NONE).then_some(column as usize)
    }
}
