//! The taps of a material over one of its parameters, such as its roughness: a family of tables, between
//! which a look-up interpolates.

use crate::table::TapTable;

/// What the weights of a family of tables are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Weights {
    /// The colour of a tap, RGB.
    Colour,
    /// Two numbers, and a third that is 0: a highlight with Schlick's term of Fresnel reflects F0 times the
    /// first plus the second, F0 being the reflectance head on. Their sums over all taps are what engines
    /// keep in a DFG table.
    ScaleBias,
}

/// Taps over a parameter: tables at even steps of it.
#[derive(Clone, Debug, PartialEq)]
pub struct VariedTable {
    range: [f64; 2],
    tables: Vec<TapTable>,
    weights: Weights,
}

impl VariedTable {
    /// The tables from the first to the last value of the parameter; `None` if there are fewer than two, they
    /// have not the same numbers of taps, or the range does not increase.
    pub fn new(range: [f64; 2], tables: Vec<TapTable>, weights: Weights) -> Option<Self> {
        let counts = |table: &TapTable| [table.taps(), table.normals()];
        let is_even = tables.windows(2).all(|tables| counts(&tables[0]) == counts(&tables[1]));
        let is_range = range.iter().all(|end| end.is_finite()) && range[0] < range[1];
        (tables.len() >= 2 && is_even && is_range).then_some(Self { range, tables, weights })
    }

    /// The first and the last value of the parameter.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// The tables, the i-th of n for the value i / (n - 1) of the way through the range.
    pub fn tables(&self) -> &[TapTable] {
        &self.tables
    }

    /// What the weights are.
    pub fn weights(&self) -> Weights {
        self.weights
    }

    /// The number J of look-ups in the levels.
    pub fn taps(&self) -> usize {
        self.tables[0].taps()
    }

    /// The number K of look-ups about the normal.
    pub fn normals(&self) -> usize {
        self.tables[0].normals()
    }

    /// The table for a value of the parameter: linear between two tables, the width in its logarithm. This is
    /// what a shader finds in the texture of all tables. Outside of the range it is that of the nearer end.
    pub fn at(&self, value: f64) -> TapTable {
        let [first, last] = self.range;
        let x = ((value - first) / (last - first)).clamp(0.0, 1.0) * (self.tables.len() - 1) as f64;
        let low = (x as usize).min(self.tables.len() - 2);
        self.tables[low].between(&self.tables[low + 1], x - low as f64)
    }

    /// [`VariedTable::at`] for a highlight with this reflectance head on, RGB, if the weights are
    /// [`Weights::ScaleBias`].
    pub fn at_reflectance(&self, value: f64, reflectance: [f64; 3]) -> TapTable {
        self.at(value).with_weights(|[scale, bias, _]| reflectance.map(|f0| f0 * scale + bias))
    }
}
