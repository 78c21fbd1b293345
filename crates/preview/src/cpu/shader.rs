//! The modes as shaders of surfaces, and the cache that keeps their maps between pictures.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use brdf::Centre;
use glam::Vec3;

use super::cancellation::PeriodicCheck;
use super::product_sampling::{BandSamplers, ProductSampling};
use super::rasteriser::Hit;
use crate::shading::brute_force::{Prepared, Product, brute_force_past};
use crate::shading::cabral::{Icosahedron, cabral};
use crate::shading::global_shrm::{GlobalShrm, global_shrm, global_update_into};
use crate::shading::irradiance::{Irradiance, irradiance};
use crate::shading::kautz_mccool::kautz_mccool;
use crate::shading::lamps::{PackedLamps, lamps, lamps_past};
use crate::shading::local_shrm::{LocalShrm, local_shrm};
use crate::shading::mirror::mirror;
use crate::shading::prefiltered::{PrefilteredMap, prefiltered};
use crate::shading::product_samples;
use crate::shading::sequence::Sequence;
use crate::shading::shadows::Shadows;
use crate::shading::taps::{Levels, PackedTaps, taps_radiance};
use crate::vertex_light::VertexLight;
use crate::{Look, Mode, RenderError, Scene, Shot};

/// A look and its maps, in the layout in which the shaders read them.
#[derive(Debug)]
pub(super) struct LookCache {
    look: Arc<Look>,
    local: OnceLock<LocalShrm>,
    global: OnceLock<GlobalShrm>,
    lamps: OnceLock<PackedLamps>,
    /// The lights beside the cube of an engine.
    suns: OnceLock<PackedLamps>,
    /// The lights beside a BRDF table, without shadows and with them.
    beside_table: [OnceLock<PackedLamps>; 2],
    taps: OnceLock<(PackedTaps, PackedLamps)>,
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

/// A mode of a look, which shades surfaces.
#[derive(Debug)]
pub(super) enum Shader<'a> {
    Local {
        map: &'a LocalShrm,
        lamps: &'a PackedLamps,
    },
    Global {
        map: &'a GlobalShrm,
        radiance: Vec<[f32; 3]>,
        lamps: &'a PackedLamps,
    },
    Cabral {
        icosahedron: Icosahedron,
        cube: Cube<'a>,
    },
    KautzMcCool {
        count: usize,
        cube: Cube<'a>,
    },
    Prefiltered {
        map: PrefilteredMap<'a>,
        centre: Centre,
        lamps: &'a PackedLamps,
    },
    Taps {
        levels: Levels<'a>,
        taps: &'a PackedTaps,
        lamps: &'a PackedLamps,
    },
    Irradiance(Irradiance),
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
        let cube = |texels| Cube { edge: look.cube().edge as u32, texels, centre: look.centre() };
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
            Mode::LocalShrm => Self::Local {
                map: once(&cache.local, || LocalShrm::new(look.local()?).ok_or_else(no_cube))?,
                lamps: lamps(),
            },
            Mode::GlobalShrm => {
                let map = once(&cache.global, || GlobalShrm::new(look.global()?).ok_or_else(no_cube))?;
                let mut radiance = vec![[0.0; 3]; map.texels()];
                global_update_into(map, view, &mut radiance);
                Self::Global { map, radiance, lamps: lamps() }
            }
            Mode::Cabral => {
                Self::Cabral { icosahedron: Icosahedron::default(), cube: cube(look.cabral()?.maps()) }
            }
            Mode::KautzMcCool => {
                let texture = look.kautz_mccool()?;
                Self::KautzMcCool { count: texture.views().count(), cube: cube(texture.maps()) }
            }
            Mode::Prefiltered => Self::Prefiltered {
                map: PrefilteredMap::of(look)?,
                centre: look.centre(),
                lamps: cache.suns.get_or_init(|| PackedLamps::beside_map(look, mode)),
            },
            Mode::Taps => {
                let map = look.compact_map()?;
                let packed = || (PackedTaps::new(map.taps.table()), PackedLamps::beside(map));
                let (taps, lamps) = cache.taps.get_or_init(packed);
                Self::Taps { levels: Levels::new(&map.scales), taps, lamps }
            }
            Mode::Irradiance => Self::Irradiance(Irradiance::new(look.light().lighting())),
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
            Self::Local { map, lamps: beside } => lamps(beside, local_shrm(map, surface), surface),
            Self::Global { map, radiance, lamps: beside } => {
                lamps(beside, global_shrm(map, radiance, surface), surface)
            }
            Self::Cabral { icosahedron, cube } => {
                cabral(icosahedron, cube.edge, cube.texels, cube.centre, surface)
            }
            Self::KautzMcCool { count, cube } => {
                kautz_mccool(cube.edge, cube.texels, *count, cube.centre, surface)
            }
            Self::Prefiltered { map, centre, lamps: beside } => {
                lamps(beside, prefiltered(map, *centre, surface), surface)
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
