//! The page that shows materials under light in a browser, live: as one file, or filled by a server.
//!
//! A [`Document`] is what a page shows, and its [`Blobs`] are the textures, shaders and meshes that it is
//! drawn with. The kind `export-page` makes a file of them. [`serve`] sends the same page over HTTP and fills
//! it with what a preview shows, as a window would.

mod blobs;
mod document;
mod form;
mod mesh_entry;
mod server;

pub use blobs::{BaseColorEntry, Blobs, ViewEntry};
pub use document::{Document, EnvironmentEntry, FormEntry, FormError, MeasuredBy, PairEntry};
pub use form::Form;
pub use mesh_entry::{MeshEntry, MeshPart};
pub use server::{PageServer, serve};
