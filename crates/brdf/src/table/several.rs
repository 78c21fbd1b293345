//! Tables of several materials, between which a surface varies.
//!
//! This is a table c_i(v, q) of one more dimension, or of two [KSS02, sec. 3 and fig. 4]. The materials are
//! evenly spaced in q, in a row or on a grid, and what lies between is blended: it reflects the shares of its
//! two or four neighbours, which is not quite what a material with the mean of their parameters reflects.

use super::{BelowHorizon, BrdfTable};

impl BrdfTable {
    /// The tables as one, in their order and in a row; `None` if there are none, or they differ in degree or
    /// size. It is grey if all of them are, mirrors views from below the horizon if all of them do, and is
    /// lit from there if one of them is.
    ///
    /// # Example: half way between black and white is grey
    /// ```
    /// use brdf::{BrdfTable, Lambert, Material, tabulate};
    /// let table = |albedo: f64| -> Result<BrdfTable, Box<dyn std::error::Error>> {
    ///     let chalk = Material::Lambert(Lambert::new([albedo; 3])?);
    ///     Ok(tabulate(&chalk, sh::Degree::ZERO, 2, sh::Stop::NEVER)?.0)
    /// };
    /// let both = BrdfTable::joined(&[table(0.0)?, table(1.0)?]).unwrap();
    /// let mut c = [0.0];
    /// both.blend_into([0.5, 0.0], sphere::Direction::Z, &mut c);
    /// let sky = (4.0 * std::f32::consts::PI).sqrt();
    /// assert!((c[0] * sky - 0.5).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn joined(tables: &[Self]) -> Option<Self> {
        let (degree, size) = (tables.first()?.degree(), tables.first()?.size());
        if tables.iter().any(|table| table.degree() != degree || table.size() != size) {
            return None;
        }
        let channels = tables.iter().map(Self::channels).max()?;
        let mirrored = tables.iter().all(|table| table.below() == BelowHorizon::Mirrored);
        let below = if mirrored { BelowHorizon::Mirrored } else { BelowHorizon::Clamped };
        let mut values = Vec::new();
        for table in tables {
            if table.channels() == channels {
                values.extend_from_slice(table.values());
            } else {
                values.extend(table.values().iter().flat_map(|grey| [*grey; 3]));
            }
        }
        let lit_from_below = tables.iter().any(Self::lit_from_below);
        Some(Self::new(degree, size, channels, below, values)?.with_lit_from_below(lit_from_below))
    }
}

#[cfg(test)]
mod tests {
    use sh::{Degree, Stop};
    use sphere::Direction;

    use super::*;
    use crate::{KajiyaKay, Lambert, Material, Phong, tabulate};

    fn table(material: Material, size: usize) -> BrdfTable {
        tabulate(&material, Degree::new(1).unwrap(), size, Stop::NEVER).unwrap().0
    }

    fn lambert(albedo: [f64; 3]) -> Material {
        Material::Lambert(Lambert::new(albedo).unwrap())
    }

    #[test]
    fn tables_stand_in_their_order_and_are_blended_between() {
        let grey = table(lambert([0.5; 3]), 4);
        let red = table(lambert([1.0, 0.0, 0.0]), 4);
        let phong = table(Material::Phong(Phong::new(3.0, [0.2; 3]).unwrap()), 4);
        let all = BrdfTable::joined(&[grey.clone(), red.clone(), phong.clone()]).unwrap();
        assert_eq!((all.count(), all.channels(), all.texel()), (3, 3, 12));
        let view = Direction::from_angles(0.7, 1.1);
        let at = |q: f32| {
            let mut c = [0.0; 12];
            all.blend_into([0.5 * q, 0.7], view, &mut c);
            c
        };
        let mut alone = [0.0; 12];
        red.lookup_into(0, view, &mut alone);
        assert_eq!(at(1.0), alone);
        let mut one = [0.0; 4];
        grey.lookup_into(0, view, &mut one);
        assert_eq!((at(0.0)[3], at(0.0)[5], at(-7.0)), (one[1], one[1], at(0.0)));
        phong.lookup_into(0, view, &mut one);
        for (row, value) in one.iter().enumerate() {
            for channel in 0..3 {
                let expected = 0.75 * alone[3 * row + channel] + 0.25 * value;
                assert!((at(1.25)[3 * row + channel] - expected).abs() < 1e-6);
            }
        }
        assert_eq!((at(9.0), at(f32::NAN)), (at(2.0), at(0.0)));
    }

    /// The oracle is the bilinear sum of the four materials' own tables.
    #[test]
    fn a_grid_is_blended_along_both_parameters() {
        let phong = |a: usize, b: usize| Phong::new(2.0 + 3.0 * a as f64, [0.1 + 0.2 * b as f64; 3]).unwrap();
        let tables: Vec<BrdfTable> = (0..6).map(|q| table(Material::Phong(phong(q / 3, q % 3)), 4)).collect();
        let all = BrdfTable::joined(&tables).unwrap();
        assert_eq!((all.grid(), all.clone().with_grid([2, 2])), ([6, 1], None));
        let all = all.with_grid([2, 3]).unwrap();
        assert_eq!(all.grid(), [2, 3]);
        let view = Direction::from_angles(0.7, 1.1);
        let of = |q: usize| {
            let mut c = [0.0; 4];
            tables[q].lookup_into(0, view, &mut c);
            c
        };
        for (place, expected) in [
            ([0.0, 0.0], [(0, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)]),
            ([1.0, 1.0], [(5, 1.0), (5, 0.0), (5, 0.0), (5, 0.0)]),
            ([1.0, 0.75], [(4, 0.5), (5, 0.5), (0, 0.0), (0, 0.0)]),
            ([0.25, 0.5], [(1, 0.75), (4, 0.25), (0, 0.0), (0, 0.0)]),
            ([0.25, 0.6], [(1, 0.6), (2, 0.15), (4, 0.2), (5, 0.05)]),
            ([0.999, 0.999], [(1, 2e-6), (2, 9.98e-4), (4, 0.001998), (5, 0.997002)]),
            ([-3.0, 9.0], [(2, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)]),
            ([f32::NAN, f32::NAN], [(0, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)]),
        ] {
            let mut found = [0.0; 4];
            all.blend_into(place, view, &mut found);
            for (row, found) in found.into_iter().enumerate() {
                let expected: f32 = expected.iter().map(|(q, share)| share * of(*q)[row]).sum();
                assert!((found - expected).abs() < 1e-6, "{place:?} {row}: {found} {expected}");
            }
        }
    }

    #[test]
    fn tables_of_other_sizes_do_not_join() {
        assert_eq!(BrdfTable::joined(&[]), None);
        assert_eq!(BrdfTable::joined(&[table(lambert([0.5; 3]), 4), table(lambert([0.5; 3]), 5)]), None);
        let hair = || table(Material::KajiyaKay(KajiyaKay::new(5.0, [0.5; 3]).unwrap()), 4);
        assert_eq!(BrdfTable::joined(&[hair(), hair()]).unwrap().below(), BelowHorizon::Mirrored);
        let mixed = BrdfTable::joined(&[hair(), table(lambert([0.5; 3]), 4)]).unwrap();
        assert!(mixed.below() == BelowHorizon::Clamped && mixed.lit_from_below());
    }
}
