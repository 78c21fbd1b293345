//! Maps of the light that a material reflects, in each of the formats of [RH02, app. C].

// The kinds.
mod convolve;
mod dfg;
mod export_cabral;
mod export_kautz_mccool;
mod export_reflection_map;
mod export_shrm;
mod export_taps;
mod export_view_maps;
mod fit_taps;
mod import_reflection_maps;
mod pair_choice;
mod prefilter;
mod reference;
mod scale_space;

// What they share.
mod compact;
mod component_files;
mod degree_choice;
mod disk_means;
mod map_index;
mod map_input;
mod map_pictures;
pub(crate) mod map_source;
mod shrm_file;
mod shrm_parameters;
mod varied_taps;

use engine::Kinds;

pub(crate) use compact::{RESOLUTION, default_scale_space, default_taps, has_facets, scale_space_of};
pub(crate) use component_files::EDGE as COMPONENT_EDGE;
pub(crate) use degree_choice::{Accept, DegreeChoice};
pub(crate) use disk_means::disk_means;
#[cfg(test)]
pub(crate) use map_pictures::texels;
pub(crate) use map_pictures::{Layout, MapPictures, endings};
pub(crate) use pair_choice::tables as tap_tables;
pub(crate) use shrm_parameters::{PlannedMap, ShrmSettings, ShrmSizes};

/// Adds the kinds of this folder to a list, in the order in which a pipeline uses them.
pub(crate) fn add_to(kinds: Kinds) -> Kinds {
    kinds
        .with(scale_space::ScaleSpaceOfLight)
        .with(fit_taps::FitTaps)
        .with(export_taps::ExportTaps)
        .with(convolve::Convolve)
        .with(prefilter::Prefilter)
        .with(dfg::Dfg)
        .with(export_reflection_map::ExportReflectionMap)
        .with(export_shrm::ExportShrm)
        .with(export_cabral::ExportCabral)
        .with(export_kautz_mccool::ExportKautzMcCool)
        .with(export_view_maps::ExportViewMaps)
        .with(import_reflection_maps::ImportReflectionMaps)
        .with(reference::ReferenceMap)
}
