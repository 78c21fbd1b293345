//! Shading: each shader `x.wgsl` has a twin `x.rs`, which computes the same on the CPU.
//!
//! Everything is in f32, except that the CPU asks the models of `brdf` for rho_hat ([`material`]), and in the
//! *light's frame*: if the light is rotated, normals, tangents and rays are rotated back
//! ([`crate::ViewTransform`]), so that no mode handles the rotation. Twins have the same formulas, but may
//! sum in another order if that is faster. The tests compare them with the f64 kernels of `shrm`, `envmap`
//! and `sh`.

pub mod angles;
pub mod background;
pub mod base_color;
pub mod brute_force;
pub mod cabral;
pub mod cube;
pub mod develop;
pub mod difference;
pub mod global_shrm;
pub mod harmonics;
pub mod irradiance;
pub mod kautz_mccool;
pub mod lamps;
pub mod lat_long;
pub mod light_samples;
pub mod lobe_sampling;
pub mod local_shrm;
#[cfg(test)]
#[cfg(feature = "gpu")]
mod map_shader_tests;
pub mod material;
pub mod mirror;
pub mod numbers;
#[cfg(test)]
#[cfg(feature = "gpu")]
mod on_device;
pub mod prefiltered;
pub mod product_samples;
pub mod product_tables;
pub mod sequence;
mod shader_constants;
pub mod shadows;
pub mod surface;
pub mod table;
pub mod taps;
#[cfg(test)]
pub(crate) mod testkit;
pub mod texture;
pub mod turned_light;
