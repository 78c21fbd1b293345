//! The modes as shaders of surfaces, and the cache that keeps their maps between pictures.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use brdf::Centre;
use glam::Vec3;
use shrm::ViewSet;

use super::cancellation::PeriodicCheck;
use super::product_sampling::{BandSamplers, ProductSampling};
use super::rasteriser::Hit;
use crate::look::PlainPart;
use crate::shading::brute_force::{Prepared, Product, brute_force_past};
use crate::shading::cabral::{Icosahedron, cabral};
use crate::shading::global_shrm::{GlobalShrm, global_shrm, global_update_into};
use crate::shading::irradiance::{Irradiance, irradiance};
use crate::shading::kautz_mccool::kautz_mccool;
use crate::shading::lamps::{PackedLamps, lamps, lamps_past};
use crate::shading::local_shrm::{LocalShrm, local_shrm};
use crate::shading::mirror::mirror;
use crate::shading::prefiltered::prefiltered;
use crate::shading::product_samples;
use crate::shading::sequence::Sequence;
use crate::shading::shadows::Shadows;
use crate::shading::taps::{Levels, PackedTaps, taps_radiance};
use crate::vertex_light::VertexLight;
use crate::{Look, Mode, PlainMap, RenderError, Scene, Shot};

/// A look and its maps, in the layout in which the shaders read them.
#[derive(Debug)]
pub(super) struct LookCache {
    look: Arc<Look>,
    local: OnceLock<Vec<LocalShrm>>,
    global: OnceLock<Vec<GlobalShrm>>,
    lamps: OnceLock<PackedLamps>,
    /// The lights beside the cube of an engine.
    suns: OnceLock<PackedLamps>,
    /// The lights beside a BRDF table, without shadows and with them.
    beside_table: [OnceLock<PackedLamps>; 2],
    taps: OnceLock<(PackedTaps, PackedLamps)>,
    irradiance: OnceLock<Irradiance>,
    brute: OnceLock<Prepared>,
    product: OnceLock<Option<ProductSampling>>,
}

impl LookCache {
    /// Drops the caches of looks that the scene does not use, and adds those of new ones.
    pub(super) fn update(caches: &mut Vec<Self>, scene: &Scene) {
        caches.retain(|cache| scene.objects.iter().any(|object| Arc::ptr_eq(&object.look, &cache.look)));
        for object in &scene.objects {
            if Self::index(caches, &object.look).is_none() {
                let look = Arc::clone(&object.look);
                caches.push(Self {
                    look,
                    local: OnceLock::new(),
                    global: OnceLock::new(),
                    lamps: OnceLock::new(),
                    suns: OnceLock::new(),
                    beside_table: [OnceLock::new(), OnceLock::new()],
                    taps: OnceLock::new(),
                    irradiance: OnceLock::new(),
                    brute: OnceLock::new(),
                    product: OnceLock::new(),
                });
            }
        }
    }

    /// The index of a look's cache.
    pub(super) fn index(caches: &[Self], look: &Arc<Look>) -> Option<usize> {
        caches.iter().position(|cache| Arc::ptr_eq(&cache.look, look))
    }
}

/// What an object has beside its look, if the mode needs it.
#[derive(Clone, Copy)]
pub(super) struct ObjectState<'a> {
    /// The light at its vertices; the inner side of its triangles has none.
    pub(super) light: Option<&'a VertexLight>,
    /// Its shadows on itself.
    pub(super) shadows: Option<&'a Shadows>,
}

/// What the samples of a band share while they are shaded.
pub(super) struct BandState<'a> {
    /// Whether the picture is still wanted.
    pub(super) check: PeriodicCheck<'a>,
    /// The samplers of products with lobes, for the next samples.
    pub(super) samplers: BandSamplers,
}

/// A mode of a look, which shades surfaces. What several maps show is added.
#[derive(Debug)]
pub(super) enum Shader<'a> {
    Local {
        maps: &'a [LocalShrm],
        lamps: &'a PackedLamps,
    },
    Global {
        /// Each with its radiance toward the viewer.
        maps: Vec<(&'a GlobalShrm, PlainMap)>,
        lamps: &'a PackedLamps,
    },
    Cabral {
        icosahedron: Icosahedron,
        cubes: Vec<Cube<'a>>,
    },
    KautzMcCool {
        count: usize,
        cubes: Vec<Cube<'a>>,
    },
    Prefiltered {
        parts: Vec<PlainPart<'a>>,
        lamps: &'a PackedLamps,
    },
    Taps {
        levels: Levels<'a>,
        taps: &'a PackedTaps,
        lamps: &'a PackedLamps,
    },
    Irradiance(&'a Irradiance),
    Mirror {
        size: [u32; 2],
        pixels: &'a [[f32; 3]],
    },
    /// A BRDF table under the light at an object's vertices.
    Table(&'a PackedLamps),
    /// A BRDF table under the light that the object does not hide from itself.
    Transfer(&'a PackedLamps),
    BruteForce(&'a Prepared, Option<&'a ProductSampling>),
    /// Brute force with the light that the object does not hide from itself.
    Shadowed(&'a Prepared, Option<&'a ProductSampling>),
}

/// Cube maps about a central direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cube<'a> {
    edge: u32,
    texels: &'a [[f32; 3]],
    centre: Centre,
}

impl<'a> Shader<'a> {
    /// The shader of a mode of a look; `view` is the direction toward a distant viewer.
    pub(super) fn new(
        mode: Mode,
        cache: &'a LookCache,
        view: Vec3,
        shot: &Shot,
    ) -> Result<Self, RenderError> {
        let look = &*cache.look;
        let edge = look.cube().edge as u32;
        let cubes = |sets: &'a [ViewSet]| {
            let sets = sets.iter().zip(look.centres());
            sets.map(|(set, centre)| Cube { edge, texels: set.maps(), centre }).collect()
        };
        let lamps = || cache.lamps.get_or_init(|| PackedLamps::beside_map(look, mode));
        let beside_table =
            |k: usize| cache.beside_table[k].get_or_init(|| PackedLamps::beside_map(look, mode));
        let brute = || once(&cache.brute, || Prepared::new(look));
        let product = || match product_samples::is_worth(shot) {
            true => cache.product.get_or_init(|| ProductSampling::new(look)).as_ref(),
            false => None,
        };
        let no_cube = || RenderError::maps("the look's map does not lie on a cube");
        Ok(match mode {
            Mode::LocalShrm => {
                let made =
                    || look.local()?.iter().map(|map| LocalShrm::new(map).ok_or_else(no_cube)).collect();
                Self::Local { maps: once(&cache.local, made)?, lamps: lamps() }
            }
            Mode::GlobalShrm => {
                let made =
                    || look.global()?.iter().map(|map| GlobalShrm::new(map).ok_or_else(no_cube)).collect();
                let updated = |map: &'a GlobalShrm| {
                    let mut radiance = vec![[0.0; 3]; map.texels()];
                    global_update_into(map, view, &mut radiance);
                    (map, radiance)
                };
                let maps = once(&cache.global, made)?.iter().map(updated).collect();
                Self::Global { maps, lamps: lamps() }
            }
            Mode::Cabral => {
                Self::Cabral { icosahedron: Icosahedron::default(), cubes: cubes(look.cabral()?) }
            }
            Mode::KautzMcCool => {
                let textures = look.kautz_mccool()?;
                let count = textures.first().map_or(0, |texture| texture.views().count());
                Self::KautzMcCool { count, cubes: cubes(textures) }
            }
            Mode::Prefiltered => Self::Prefiltered {
                parts: look.plain_parts()?,
                lamps: cache.suns.get_or_init(|| PackedLamps::beside_map(look, mode)),
            },
            Mode::Taps => {
                let map = look.compact_map()?;
                let packed = || (PackedTaps::new(map.taps.table()), PackedLamps::beside(map));
                let (taps, lamps) = cache.taps.get_or_init(packed);
                Self::Taps { levels: Levels::new(&map.scales), taps, lamps }
            }
            Mode::Irradiance => {
                let made = || Irradiance::new(look.light().lighting());
                Self::Irradiance(cache.irradiance.get_or_init(made))
            }
            Mode::Mirror => {
                let environment = look.light().environment();
                let grid = environment.grid();
                let size = [grid.width as u32, grid.height as u32];
                Self::Mirror { size, pixels: environment.pixels() }
            }
            Mode::Table => Self::Table(beside_table(0)),
            Mode::Transfer => Self::Transfer(beside_table(1)),
            Mode::BruteForce => Self::BruteForce(brute()?, product()),
            Mode::ShadowedBruteForce => Self::Shadowed(brute()?, product()),
            Mode::Samples => return Err(RenderError::maps("a diagram shades no surface")),
        })
    }

    /// The radiance toward the viewer at a sample of the picture. `sequence` has the points of the sample;
    /// `of` is what the object has beside its look.
    ///
    /// # Errors
    /// [`RenderError::Cancelled`].
    pub(super) fn radiance(
        &self,
        hit: &Hit,
        sequence: Sequence,
        light_samples: u32,
        of: ObjectState<'_>,
        state: &mut BandState<'_>,
    ) -> Result<Vec3, RenderError> {
        let BandState { check, samplers } = state;
        let surface = &hit.surface;
        Ok(match self {
            Self::Local { maps, lamps: beside } => {
                let sum = maps.iter().map(|map| local_shrm(map, surface)).sum();
                lamps(beside, sum, surface)
            }
            Self::Global { maps, lamps: beside } => {
                let sum = maps.iter().map(|(map, radiance)| global_shrm(map, radiance, surface)).sum();
                lamps(beside, sum, surface)
            }
            Self::Cabral { icosahedron, cubes } => {
                let of = |cube: &Cube<'_>| cabral(icosahedron, cube.edge, cube.texels, cube.centre, surface);
                cubes.iter().map(of).sum()
            }
            Self::KautzMcCool { count, cubes } => {
                let of = |cube: &Cube<'_>| kautz_mccool(cube.edge, cube.texels, *count, cube.centre, surface);
                cubes.iter().map(of).sum()
            }
            Self::Prefiltered { parts, lamps: beside } => {
                let of = |part: &PlainPart<'_>| {
                    part.weight * prefiltered(part.edge, part.texels, part.centre, surface)
                };
                lamps(beside, parts.iter().map(of).sum(), surface)
            }
            Self::Taps { levels, taps, lamps: beside } => {
                lamps(beside, taps_radiance(levels, taps, surface), surface)
            }
            Self::Irradiance(light) => irradiance(light, surface),
            Self::Mirror { size, pixels } => mirror(*size, pixels, surface),
            Self::Table(beside) | Self::Transfer(beside) => {
                let Some(light) = of.light.filter(|_| hit.front) else { return Ok(Vec3::ZERO) };
                let soft = light.radiance(hit.triangle, hit.position);
                match (self, of.shadows) {
                    (Self::Transfer(_), Some(shadows)) if beside.material().is_some() => {
                        let point = shadows.at(surface, hit.position);
                        lamps_past(beside, soft, surface, |direction| point.sees(direction))
                    }
                    _ => lamps(beside, soft, surface),
                }
            }
            Self::BruteForce(prepared, product) => {
                let product = product.and_then(|of| samplers.get(of, surface.normal, surface.view));
                let product = product.map(|sampler| Product::always(sampler));
                let sum = |samples| brute_force_past(prepared, product, surface, sequence, samples, |_| true);
                averaged(light_samples, check, sum)?
            }
            Self::Shadowed(prepared, product) => {
                let Some(shadows) = of.shadows else { return Ok(Vec3::ZERO) };
                let point = shadows.at(surface, hit.position);
                let sees = |direction| point.sees(direction);
                let product = product.and_then(|of| samplers.get(of, surface.normal, surface.view));
                let product = product.map(|sampler| Product::always(sampler));
                let sum = |samples| brute_force_past(prepared, product, surface, sequence, samples, sees);
                averaged(light_samples, check, sum)?
            }
        })
    }
}

/// The mean over all light samples; `sum` adds those of a range.
fn averaged(
    light_samples: u32,
    check: &mut PeriodicCheck<'_>,
    sum: impl Fn(Range<u32>) -> Vec3,
) -> Result<Vec3, RenderError> {
    let (total, mut done, mut whole) = (light_samples.max(1), 0, Vec3::ZERO);
    while done < total {
        let next = total.min(done.saturating_add(PeriodicCheck::LIGHT_SAMPLES));
        check.count(next - done)?;
        whole += sum(done..next);
        done = next;
    }
    Ok(whole / total as f32)
}

/// The value of a cell, computed once; an error is not stored.
fn once<T>(cell: &OnceLock<T>, make: impl FnOnce() -> Result<T, RenderError>) -> Result<&T, RenderError> {
    if let Some(made) = cell.get() {
        return Ok(made);
    }
    let made = make()?;
    Ok(cell.get_or_init(|| made))
}
