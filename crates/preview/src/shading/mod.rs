//! Shading: one unit a file, and beside each shader `x.wgsl` its twin `x.rs`, which does the same on the CPU.
//!
//! All of it is in f32 and in the *light's frame*: a turned light is a picture whose normals, tangents and rays are turned
//! back ([`crate::ViewTransform`]), so that no mode knows of the turn. Twins have the same formulas; where it is quicker they sum in another order.
//! The kernels of `shrm`, `envmap` and `sh`, in f64, are what the tests hold them against.

pub mod angles;
pub mod background;
pub mod brute_force;
pub mod cabral;
pub mod cube;
pub mod develop;
pub mod difference;
pub mod global_shrm;
pub mod harmonics;
pub mod irradiance;
pub mod kautz_mccool;
pub mod lat_long;
pub mod light_samples;
pub mod lobe_sampling;
pub mod local_shrm;
pub mod material;
pub mod mirror;
#[cfg(all(test, feature = "gpu"))]
mod on_device;
pub mod prefiltered;
pub mod sequence;
pub mod surface;
#[cfg(test)]
pub(crate) mod testkit;
