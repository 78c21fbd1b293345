//! Pictures of meshes under distant light, shaded with the maps that Specula makes.
//!
//! A [`Scene`] holds meshes, each with a [`Look`]: a material under a light, and the maps made of the pair. A [`Shot`]
//! says how it is seen: camera, size, which map shades it, exposure. A [`Renderer`] makes a [`Picture`] of both. There are
//! two: one on the CPU, the same to the bit for any number of threads, and one through wgpu. Every shader `x.wgsl` in `shading/`
//! has its twin `x.rs` beside it, which the CPU runs; both make the same picture within [`Tolerance::of`].
//!
//! The frame is that of `sphere`: right-handed, +Z up. Radiance is linear Rec. 709; pictures are sRGB.

mod camera;
mod cpu;
mod error;
#[cfg(feature = "gpu")]
mod gpu;
mod light;
mod look;
mod mode;
mod picture;
mod renderer;
mod scene;
pub mod shading;
mod shot;
mod subject;
mod update;
mod view_settings;
mod view_transform;

pub use camera::{Camera, Framing};
pub use cpu::Cpu;
pub use error::RenderError;
#[cfg(feature = "gpu")]
pub use gpu::{Drawn, Gpu, Health};
pub use light::Light;
pub use look::{Look, MapSizes};
pub use mode::{Background, Mode, Show};
pub use picture::{Picture, SAME_LIGHT, SAME_PICTURE, Tolerance};
pub use renderer::{Renderer, graphics_device};
pub use scene::{Object, Scene};
pub use shot::Shot;
pub use subject::{Catalog, List, Subject, SubjectRequest};
pub use update::{Export, PreviewUpdate, SubjectDetails};
pub use view_settings::{Aim, Arrangement, Backdrop, InitialView, Tone, ViewSettings};
pub use view_transform::{Placed, ViewTransform};
