//! Colours and sizes of a sheet: a neutral dark surround that does not influence how the pictures look.

use preview::drawing::{Style, Weight};

pub(crate) const BACKGROUND: [u8; 3] = [24, 24, 25];
pub(crate) const SURFACE: [u8; 3] = [32, 32, 34];
pub(crate) const RULE: [u8; 3] = [54, 54, 57];
pub(crate) const GRID: [u8; 3] = [44, 44, 47];
pub(crate) const BRIGHT: [u8; 3] = [236, 236, 238];
pub(crate) const DIM: [u8; 3] = [150, 150, 156];
/// The colour of the energy of each degree.
pub(crate) const AMBER: [u8; 3] = [238, 172, 86];
/// The colour of the energy up to each degree.
pub(crate) const BLUE: [u8; 3] = [112, 178, 240];
/// The colour of other curves.
pub(crate) const RED: [u8; 3] = [236, 112, 104];
pub(crate) const GREEN: [u8; 3] = [112, 200, 128];
pub(crate) const VIOLET: [u8; 3] = [204, 140, 232];

pub(crate) const TITLE: Style = Style { weight: Weight::SemiBold, size: 34.0, colour: BRIGHT };
pub(crate) const SUBTITLE: Style = Style { weight: Weight::Regular, size: 16.0, colour: DIM };
pub(crate) const SECTION: Style = Style { weight: Weight::SemiBold, size: 19.0, colour: BRIGHT };
pub(crate) const NAME: Style = Style { weight: Weight::SemiBold, size: 15.0, colour: BRIGHT };
pub(crate) const DETAIL: Style = Style { weight: Weight::Regular, size: 14.0, colour: DIM };
pub(crate) const TICK: Style = Style { weight: Weight::Regular, size: 13.0, colour: DIM };
