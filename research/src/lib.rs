//! What the programs in `src/bin` are made of: figures of the documents, drawn and measured, and the tables
//! of [RH02, sec. 7.4] on this machine. `README.md` lists the programs.

pub mod compact_tables;
pub mod paper;
pub mod sampling_figures;
pub mod turns;
pub mod worker_simulation;
