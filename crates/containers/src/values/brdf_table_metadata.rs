//! What a file with a BRDF table says about itself, in any container, so that a renderer needs nothing else.

use brdf::{BelowHorizon, BrdfTable};

/// The word for what a table shows to a view from below the horizon.
pub(crate) const fn below_name(below: BelowHorizon) -> &'static str {
    match below {
        BelowHorizon::Clamped => "clamped",
        BelowHorizon::Mirrored => "mirrored",
    }
}

/// The word for where the light comes from that a table's material reflects.
pub(crate) const fn incident_name(lit_from_below: bool) -> &'static str {
    if lit_from_below { "sphere" } else { "hemisphere" }
}

/// The entries of a table, sorted by key; `kind` is left to the container.
///
/// | key | value |
/// | --- | --- |
/// | `basis` | the spherical harmonics, and what a value is |
/// | `below` | `clamped` or `mirrored`: where a view from below the horizon is looked up |
/// | `channels` | 1 if the table is grey, else 3 |
/// | `degree` | F |
/// | `frame` | the frame of the surface, and the views of the texels |
/// | `grid` | Q_a x Q_b, the materials along both parameters, if two vary |
/// | `incident` | where light is reflected from: the `hemisphere` above the surface, or the whole `sphere` |
pub fn brdf_table_metadata(table: &BrdfTable) -> Vec<(&'static str, String)> {
    let basis = "real, orthonormal, no Condon-Shortley phase, row l*l + l + m, of the incident direction in the surface's \
                 frame; the sum over rows of c_i times the lighting's coefficients in that frame is radiance";
    let frame = "right-handed, +X the tangent, +Z the normal; texels are views v: v_x / (1 + v_z) = 2 (column + 0.5) / N \
                 - 1, v_y / (1 + v_z) = 1 - 2 (row + 0.5) / N; texels outside the unit disk repeat its rim";
    let grid = match table.grid() {
        [_, 1] => None,
        [along, across] => Some(("grid", format!("{along} x {across}"))),
    };
    let of_all = [
        ("basis", basis.to_owned()),
        ("below", below_name(table.below()).to_owned()),
        ("channels", table.channels().to_string()),
        ("degree", table.degree().get().to_string()),
        ("frame", frame.to_owned()),
    ];
    let incident = ("incident", incident_name(table.lit_from_below()).to_owned());
    of_all.into_iter().chain(grid).chain([incident]).collect()
}

/// The names of a table's rows, in order: `l1mm1` is l = 1, m = -1; `l1m0`; `l1m1`.
///
/// Letters and digits alone, so that every program takes them for a layer's name.
pub fn coefficient_names(degree: usize) -> Vec<String> {
    let name = |l: usize, m: isize| match m {
        0.. => format!("l{l}m{m}"),
        _ => format!("l{l}mm{}", -m),
    };
    (0..=degree).flat_map(|l| (-(l as isize)..=l as isize).map(move |m| name(l, m))).collect()
}
