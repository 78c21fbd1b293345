//! Maps of the light that a material reflects, in each of the formats of [RH02, app. C].

// The kinds.
mod convolve;
mod dfg;
mod export_cabral;
mod export_kautz_mccool;
mod export_reflection_map;
mod export_shrm;
mod export_view_maps;
mod import_reflection_maps;
mod prefilter;
mod reference;

// What they share.
mod map_index;
mod map_input;
mod map_pictures;
pub(crate) mod map_source;

pub(crate) use convolve::Convolve;
pub(crate) use dfg::Dfg;
pub(crate) use export_cabral::ExportCabral;
pub(crate) use export_kautz_mccool::ExportKautzMcCool;
pub(crate) use export_reflection_map::ExportReflectionMap;
pub(crate) use export_shrm::ExportShrm;
pub(crate) use export_view_maps::ExportViewMaps;
pub(crate) use import_reflection_maps::ImportReflectionMaps;
#[cfg(test)]
pub(crate) use map_pictures::texels;
pub(crate) use map_pictures::{Layout, MapPictures, endings};
pub(crate) use prefilter::Prefilter;
pub(crate) use reference::ReferenceMap;
