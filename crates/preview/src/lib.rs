//! Pictures of meshes under distant light, shaded with the maps that Specula makes.
//!
//! A [`Scene`] holds meshes, each with a [`Look`]: a material under a light, and the maps made from the pair.
//! The maps are optional: until they exist, brute force takes the place of the modes that need them.
//! A [`Shot`] holds the camera, the size, the map that shades the meshes, and the exposure. A [`Renderer`]
//! draws a [`Picture`] of a scene and a shot. There are two: one on the CPU, whose pictures are bit-identical
//! for any number of threads, and one through wgpu. Every shader `x.wgsl` in `shading/` has a twin `x.rs`
//! that the CPU runs; both draw the same picture within [`Tolerance::of`].
//!
//! The frame is that of `sphere`: right-handed, +Z up. Radiance is linear Rec. 709; pictures are sRGB.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod camera;
mod compact_map;
mod cpu;
mod diagram;
pub mod drawing;
mod error;
mod estimate;
#[cfg(feature = "gpu")]
mod gpu;
mod graphics_device;
mod host;
mod layered_map;
mod light;
mod light_at_places;
mod light_image;
mod light_points;
mod lobe;
mod look;
mod material_form;
mod mirror_ball;
mod mode;
mod named;
mod picture;
mod point_set;
mod prefiltered_cube;
mod renderer;
mod sample_sets;
mod scene;
pub mod shading;
mod shot;
mod subject;
mod update;
mod vertex_light;
mod view_settings;
mod view_transform;
pub mod web;

pub use camera::{Camera, Framing};
pub use compact_map::{CompactMap, CompactTaps};
pub use cpu::{Cpu, cpu_steps};
pub use error::RenderError;
#[cfg(feature = "gpu")]
pub use gpu::{DeviceStatus, DrawProgress, Gpu};
pub use graphics_device::graphics_device;
pub use host::Host;
pub use light::Light;
pub use light_at_places::LightAtPlaces;
pub use light_image::lit;
pub use look::{Look, MapSizes, PlainMap};
pub use material_form::{FormField, FormSection, MaterialForm};
pub use mode::{Background, Mode, Show};
pub use named::Named;
pub use picture::{Picture, SAME_LIGHT, SAME_PICTURE, Tolerance};
pub use point_set::PointSet;
pub use prefiltered_cube::PrefilteredCube;
pub use renderer::Renderer;
pub use scene::{Object, Scene, ScenePart};
pub use shot::Shot;
pub use subject::{Catalog, List, Subject, SubjectRequest};
pub use update::{Export, PreviewUpdate, SubjectDetails};
pub use view_settings::{Aim, Arrangement, InitialView, ViewSettings};
pub use view_transform::{Placed, ViewTransform};
