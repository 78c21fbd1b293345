//! Pictures and pages for people: previews, contact sheets, reports.

// The kinds.
mod contact_sheet;
mod preview;
mod report;

// What they share.
mod ball_camera;
mod exposure;
mod material_picture;
mod sheet;
mod table_picture;

pub(crate) use contact_sheet::ContactSheet;
pub use exposure::picture_exposure;
pub use material_picture::material_picture;
pub(crate) use preview::Preview;
pub(crate) use report::ReportKind;
pub use sheet::Picture;
pub use table_picture::table_picture;
