//! A cube with levels of detail that an engine lights surfaces with.

use envmap::CubeMap;

/// The light about the direction of a mirror, blurred for several roughnesses: a level of detail each, from
/// the sharpest on, in the light's frame.
///
/// A surface reads the level that suits its roughness; between two levels it blends them.
#[derive(Clone, Debug, PartialEq)]
pub struct PrefilteredCube {
    levels: Vec<CubeMap>,
}

impl PrefilteredCube {
    /// Makes a cube of its levels; `None` if there are none.
    pub fn new(levels: Vec<CubeMap>) -> Option<Self> {
        (!levels.is_empty()).then_some(Self { levels })
    }

    /// The levels, the sharpest first.
    pub fn levels(&self) -> &[CubeMap] {
        &self.levels
    }

    /// The level that is read for a number, which may lie past the ends: never below the first level or above
    /// the last.
    pub fn nearest(&self, level: f64) -> f64 {
        level.max(0.0).min((self.levels.len() - 1) as f64)
    }

    /// The two levels around a number of a level, and the share of the second.
    pub(crate) fn around(&self, level: f64) -> ([&CubeMap; 2], f32) {
        let level = self.nearest(level);
        let low = (level as usize).min(self.levels.len() - 1);
        let high = (low + 1).min(self.levels.len() - 1);
        ([&self.levels[low], &self.levels[high]], (level - low as f64) as f32)
    }
}

#[cfg(test)]
mod tests {
    use sphere::Cube;

    use super::*;

    #[test]
    fn levels_past_the_ends_are_the_ends() {
        assert!(PrefilteredCube::new(Vec::new()).is_none());
        let level = |edge| CubeMap::new(Cube { edge }, vec![[0.0; 3]; 6 * edge * edge]).unwrap();
        let cube = PrefilteredCube::new([4, 2, 1].map(level).into()).unwrap();
        let around = |level| {
            let (levels, share) = cube.around(level);
            (levels.map(|level| level.cube().edge), share)
        };
        assert_eq!(around(0.25), ([4, 2], 0.25));
        assert_eq!(around(1.0), ([2, 1], 0.0));
        for past in [f64::NEG_INFINITY, -1.0, f64::NAN] {
            assert_eq!(around(past), ([4, 2], 0.0), "{past}");
        }
        assert_eq!(around(7.5), ([1, 1], 0.0));
    }
}
