//! The taps of a material, of either sort.

use sphere::Direction;

use crate::accuracy::Taps;
use crate::facets::{FacetTable, SurfaceFrame};
use crate::scale_space::ScaleSpace;
use crate::shader::TableShape;
use crate::table::TapTable;

/// A table of taps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AnyTable<'a> {
    /// By the angle between normal and view.
    Angle(&'a TapTable),
    /// By the view in the frame of the surface.
    View(&'a FacetTable),
}

impl AnyTable<'_> {
    /// What a shader looks up.
    pub fn shape(&self) -> TableShape {
        match self {
            Self::Angle(_) => TableShape::Angle,
            Self::View(table) => TableShape::Facets { is_quarter: table.is_quarter() },
        }
    }

    /// The number J of look-ups in the levels.
    pub fn taps(&self) -> usize {
        match self {
            Self::Angle(table) => table.taps(),
            Self::View(table) => table.taps(),
        }
    }

    /// The number K of look-ups about the normal.
    pub fn normals(&self) -> usize {
        match self {
            Self::Angle(table) => table.normals(),
            Self::View(table) => table.normals(),
        }
    }
}

impl Taps for AnyTable<'_> {
    fn count(&self) -> usize {
        self.taps()
    }

    fn reflected(&self, light: &ScaleSpace, frame: SurfaceFrame, view: Direction) -> [f64; 3] {
        match self {
            Self::Angle(table) => table.radiance(light, frame.normal(), view),
            Self::View(table) => table.radiance(light, frame, view),
        }
    }
}
