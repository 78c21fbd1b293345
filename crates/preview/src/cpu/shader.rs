//! A mode made ready for a look, and what is kept of that from one picture to the next.

use std::sync::{Arc, OnceLock};

use brdf::Centre;
use glam::Vec3;

use super::stop::Patience;
use crate::shading::brute_force::{Prepared, brute_force};
use crate::shading::cabral::{Icosahedron, cabral};
use crate::shading::global_shrm::{GlobalShrm, global_shrm, global_update_into};
use crate::shading::irradiance::{Irradiance, irradiance};
use crate::shading::kautz_mccool::kautz_mccool;
use crate::shading::local_shrm::{LocalShrm, local_shrm};
use crate::shading::mirror::mirror;
use crate::shading::prefiltered::prefiltered;
use crate::shading::surface::Surface;
use crate::{Look, Mode, RenderError, Scene};

/// A look, and its maps in the order in which they are read here.
#[derive(Debug)]
pub(super) struct Kept {
    look: Arc<Look>,
    local: OnceLock<LocalShrm>,
    global: OnceLock<GlobalShrm>,
    brute: OnceLock<Prepared>,
}

impl Kept {
    /// The looks of a scene, each once, with what is kept of them already; others are dropped.
    pub(super) fn renew(kept: &mut Vec<Self>, scene: &Scene) {
        kept.retain(|kept| scene.objects.iter().any(|object| Arc::ptr_eq(&object.look, &kept.look)));
        for object in &scene.objects {
            if Self::place(kept, &object.look).is_none() {
                let look = Arc::clone(&object.look);
                let (local, global, brute) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
                kept.push(Self { look, local, global, brute });
            }
        }
    }

    /// Where a look is.
    pub(super) fn place(kept: &[Self], look: &Arc<Look>) -> Option<usize> {
        kept.iter().position(|kept| Arc::ptr_eq(&kept.look, look))
    }
}

/// A mode of a look, ready to be asked about surfaces.
#[derive(Debug)]
pub(super) enum Shader<'a> {
    Local(&'a LocalShrm),
    Global { map: &'a GlobalShrm, radiance: Vec<[f32; 3]> },
    Cabral { icosahedron: Icosahedron, cube: Cube<'a> },
    KautzMcCool { count: usize, cube: Cube<'a> },
    Prefiltered(Cube<'a>),
    Irradiance(Irradiance),
    Mirror { size: [u32; 2], pixels: &'a [[f32; 3]] },
    BruteForce(&'a Prepared),
}

/// Cube maps about a central direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cube<'a> {
    edge: u32,
    texels: &'a [[f32; 3]],
    centre: Centre,
}

impl<'a> Shader<'a> {
    /// A mode of a look; `view` is the direction toward a distant viewer.
    pub(super) fn new(mode: Mode, kept: &'a Kept, view: Vec3) -> Result<Self, RenderError> {
        let look = &*kept.look;
        let cube = |texels| Cube { edge: look.cube().edge as u32, texels, centre: look.centre() };
        let no_cube = || RenderError::maps("the look's map does not lie on a cube");
        Ok(match mode {
            Mode::LocalShrm => {
                Self::Local(once(&kept.local, || LocalShrm::new(look.local()?).ok_or_else(no_cube))?)
            }
            Mode::GlobalShrm => {
                let map = once(&kept.global, || GlobalShrm::new(look.global()?).ok_or_else(no_cube))?;
                let mut radiance = vec![[0.0; 3]; map.texels()];
                global_update_into(map, view, &mut radiance);
                Self::Global { map, radiance }
            }
            Mode::Cabral => {
                Self::Cabral { icosahedron: Icosahedron::default(), cube: cube(look.cabral()?.maps()) }
            }
            Mode::KautzMcCool => {
                let texture = look.kautz_mccool()?;
                Self::KautzMcCool { count: texture.angles().len(), cube: cube(texture.slices()) }
            }
            Mode::Prefiltered => Self::Prefiltered(cube(look.prefiltered()?)),
            Mode::Irradiance => Self::Irradiance(Irradiance::new(look.light().lighting())),
            Mode::Mirror => {
                let environment = look.light().environment();
                let grid = environment.grid();
                let size = [grid.width as u32, grid.height as u32];
                Self::Mirror { size, pixels: environment.pixels() }
            }
            Mode::BruteForce => Self::BruteForce(once(&kept.brute, || Prepared::new(look))?),
        })
    }

    /// Radiance toward the viewer at a sample of the picture, whose number tells it from others.
    ///
    /// # Errors
    /// [`RenderError::Cancelled`].
    pub(super) fn radiance(
        &self,
        surface: &Surface,
        number: u32,
        light_samples: u32,
        patience: &mut Patience<'_>,
    ) -> Result<Vec3, RenderError> {
        Ok(match self {
            Self::Local(map) => local_shrm(map, surface),
            Self::Global { map, radiance } => global_shrm(map, radiance, surface),
            Self::Cabral { icosahedron, cube } => {
                cabral(icosahedron, cube.edge, cube.texels, cube.centre, surface)
            }
            Self::KautzMcCool { count, cube } => {
                kautz_mccool(cube.edge, cube.texels, *count, cube.centre, surface)
            }
            Self::Prefiltered(cube) => prefiltered(cube.edge, cube.texels, cube.centre, surface),
            Self::Irradiance(light) => irradiance(light, surface),
            Self::Mirror { size, pixels } => mirror(*size, pixels, surface),
            Self::BruteForce(prepared) => {
                let (total, mut done, mut sum) = (light_samples.max(1), 0, Vec3::ZERO);
                while done < total {
                    let next = total.min(done.saturating_add(Patience::LIGHT_SAMPLES));
                    patience.spend(next - done)?;
                    sum += brute_force(prepared, surface, number, done..next);
                    done = next;
                }
                sum / total as f32
            }
        })
    }
}

/// What is made once, unless it fails.
fn once<T>(cell: &OnceLock<T>, make: impl FnOnce() -> Result<T, RenderError>) -> Result<&T, RenderError> {
    if let Some(made) = cell.get() {
        return Ok(made);
    }
    let made = make()?;
    Ok(cell.get_or_init(|| made))
}
