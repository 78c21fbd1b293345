//! Pictures and pages for people: previews, contact sheets, reports.

// The kinds.
mod contact_sheet;
mod export_page;
mod preview;
mod report;

// What they share.
mod ball_camera;
mod data_uri;
mod exposure;
mod material_picture;
mod report_schema;
mod sheet;
mod table_picture;

use engine::Kinds;

pub(crate) use data_uri::data_uri;

pub use exposure::picture_exposure;
pub use material_picture::material_picture;
pub use sheet::Picture;
pub use table_picture::table_picture;

/// Adds the kinds of this folder to a list, in the order in which a pipeline uses them.
pub(crate) fn add_to(kinds: Kinds) -> Kinds {
    kinds
        .with(contact_sheet::ContactSheet)
        .with(report::ReportKind)
        .with(preview::Preview)
        .with(export_page::ExportPage)
}
