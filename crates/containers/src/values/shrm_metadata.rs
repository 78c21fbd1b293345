//! What a file with a spherical harmonic reflection map says about itself, in any container, so that a
//! renderer needs nothing else: degree, view, centre, which coefficient each row is, frame and basis.

use brdf::Centre;
use shrm::{MapGrid, Shrm, Terms, View};

/// The word for a centre in files.
pub(crate) const fn centre_name(centre: Centre) -> &'static str {
    match centre {
        Centre::Reflection => "reflection",
        Centre::Normal => "normal",
        Centre::Tangent => "tangent",
    }
}

/// The entries of a map, sorted by key; `kind` is left to the container.
///
/// | key | value |
/// | --- | --- |
/// | `basis` | the spherical harmonics, and what a value is |
/// | `centre` | what the map is looked up by: `reflection`, `normal` or `tangent` |
/// | `degree` | P |
/// | `frame` | the frame of directions and where the texels lie |
/// | `layout` | `lat-long` or `cube` |
/// | `terms` | `all`, or `zonal` if the coefficients with q other than 0 are zero |
/// | `view` | `local`: over the view in the texel's frame; `global`: over the view in the world |
pub fn shrm_metadata(map: &Shrm) -> [(&'static str, String); 7] {
    let frame = match map.grid() {
        MapGrid::LatLong(_) => {
            "right-handed, +Z up; row 0 toward +Z, the image's centre along +X, its left quarter along +Y"
        }
        MapGrid::Cube(_) => {
            "right-handed, +Z up; cube coordinates (-y, z, x), faces +X -X +Y -Y +Z -Z as in KTX2, orientation rd"
        }
    };
    let basis = match map.view() {
        View::Local => {
            "real, orthonormal, no Condon-Shortley phase, row p*p + p + q, of the view in the frame R_z(phi) R_y(theta) \
             of the texel's direction; the sum of rows times basis is radiance"
        }
        View::Global => {
            "real, orthonormal, no Condon-Shortley phase, row p*p + p + q, of the view in the world's frame; \
             the sum of rows times basis is radiance"
        }
    };
    let layout = match map.grid() {
        MapGrid::LatLong(_) => "lat-long",
        MapGrid::Cube(_) => "cube",
    };
    let view = match map.view() {
        View::Local => "local",
        View::Global => "global",
    };
    let terms = match map.terms() {
        Terms::All => "all",
        Terms::Zonal => "zonal",
    };
    [
        ("basis", basis.to_owned()),
        ("centre", centre_name(map.centre()).to_owned()),
        ("degree", map.p().get().to_string()),
        ("frame", frame.to_owned()),
        ("layout", layout.to_owned()),
        ("terms", terms.to_owned()),
        ("view", view.to_owned()),
    ]
}

/// The names of a map's rows, in order: `p1qm1` is p = 1, q = -1; `p1q0`; `p1q1`.
///
/// Letters and digits alone, so that every program takes them for a layer's name; with [`Terms::Zonal`] only
/// those with q = 0.
pub fn row_names(p: usize, terms: Terms) -> Vec<String> {
    let name = |p: usize, q: isize| match q {
        0.. => format!("p{p}q{q}"),
        _ => format!("p{p}qm{}", -q),
    };
    match terms {
        Terms::Zonal => (0..=p).map(|p| name(p, 0)).collect(),
        Terms::All => (0..=p).flat_map(|p| (-(p as isize)..=p as isize).map(move |q| name(p, q))).collect(),
    }
}
