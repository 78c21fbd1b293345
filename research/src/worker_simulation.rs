//! A build of very many items on very many workers: the real engine and the real client of the Remote
//! Execution API, and a model of its server whose workers only wait.
//!
//! The client builds the frozen sample of `frozen-workers/` with many environments and materials
//! ([`Project`]); no kind ever runs in it. The server ([`server`]) has everything in memory. An action waits
//! for a free worker, holds it as long as an item of its kind took in the sample (`measured.tsv`), and leaves
//! as many bytes, which depend on the item alone. Client and server are two processes, so that what the
//! client needs is measured by itself.

mod chart;
mod client;
mod measured;
mod metered;
mod model;
mod outcome;
mod process;
mod project;
pub mod server;

pub use chart::charts;
pub use client::{Client, build};
pub use measured::{Item, Measured};
pub use outcome::{Case, Outcome, run_case};
pub use project::{MANIFEST, Project, kinds};
