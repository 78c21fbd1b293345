//! Directions, frames and the mappings between a sphere and an image.
//!
//! This crate alone defines the conventions in `CONVENTIONS.md`: no other crate flips an axis or decides
//! where a pixel centre lies.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod angular_probe;
mod cube;
mod direction;
mod frame;
mod lat_long;
mod mirror_ball;
mod nearest_direction;
mod openexr_cube;
mod openexr_lat_long;
mod rotation;
mod spiral;

pub use angular_probe::AngularProbe;
pub use cube::{Cube, Face};
pub use direction::Direction;
pub use frame::{from_cube, from_file, to_cube, to_file};
pub use glam::{DMat3, DQuat, DVec3};
pub use lat_long::LatLong;
pub use mirror_ball::MirrorBall;
pub use nearest_direction::NearestDirection;
pub use openexr_cube::OpenExrCube;
pub use openexr_lat_long::OpenExrLatLong;
pub use rotation::{Rotation, Zyz};
pub use spiral::spiral;
