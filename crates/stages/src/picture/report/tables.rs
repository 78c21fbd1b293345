//! BRDF tables in a report: what a sphere loses if light and table are cut at a degree, as in
//! [KSS02, fig. 6].
//!
//! The coefficients c_i(v) come from a table of degree 14 that is made here; [KSS02, eq. 1] is evaluated at
//! every pixel. The sphere is brushed along +Z, projected into the surface.

use brdf::{BrdfTable, Material, captured, tabulate};
use engine::{Failure, Reporter, Steps};
use envmap::{Environment, ToneMap, to_srgb8};
use sh::{Degree, Expansion, Transform, Window};
use transfer::{Frames, Viewer, shade};

use crate::picture::report::cuts::{MAX_CUT, PICTURE, SHOWN, TablePictures};
use crate::picture::report::figures::{Cut, Settings, TableFigures, TablePair};
use crate::picture::report::lit::{Lit, brute_force};
use crate::picture::report::sphere::{Lattice, Sphere};
use crate::values::UntilStopped;

/// The number of views along an edge of the table.
const VIEWS: usize = 48;

/// The figures and pictures of named materials under every environment. It takes a step for each pair.
pub(crate) fn study(
    lit: &[&Lit<'_>],
    materials: &[(String, &Material)],
    settings: &Settings,
    steps: &Steps<'_>,
) -> Result<(Vec<TableFigures>, TablePictures), Failure> {
    let series = lit.iter().map(|lit| Series::new(lit)).collect::<Result<Vec<_>, Failure>>()?;
    let (mut figures, mut spheres) = (Vec::new(), Vec::new());
    for (name, material) in materials {
        let tabulated = Tabulated::new(material, steps.reporter())
            .map_err(|failure| failure.context(format!("the table of {name}")))?;
        let (mut pairs, mut pictures) = (Vec::new(), Vec::new());
        for (lit, series) in lit.iter().zip(&series) {
            let (found, shown) = pair(lit, series, material, &tabulated, settings, steps)?;
            pairs.push(found);
            pictures.push(shown);
        }
        // Under every environment: the greatest, if each has one.
        let advised: Option<Vec<usize>> = pairs.iter().map(|pair| pair.advised).collect();
        let advised = advised.and_then(|degrees| degrees.into_iter().max());
        figures.push(TableFigures { material: name.clone(), captured: tabulated.captured, advised, pairs });
        spheres.push(pictures);
    }
    let lights = series.into_iter().map(|series| series.pictures).collect();
    Ok((figures, TablePictures { lights, spheres }))
}

/// A material's table of the highest degree, and the share of its energy that each degree holds.
struct Tabulated {
    table: BrdfTable,
    captured: Vec<f64>,
}

impl Tabulated {
    fn new(material: &Material, reporter: &Reporter) -> Result<Self, Failure> {
        let degree = Degree::new(MAX_CUT)?;
        let (table, _) = reporter.until_stopped(|stop| tabulate(material, degree, VIEWS, stop))?;
        let captured = reporter.until_stopped(|stop| captured(material, degree, stop))?;
        Ok(Self { table, captured })
    }
}

/// An environment as a series with all of its light, and pictures of its cuts.
struct Series {
    light: Expansion,
    /// The pictures of each of [`SHOWN`], and of the environment itself.
    pictures: Vec<Vec<[u8; 3]>>,
}

impl Series {
    fn new(lit: &Lit<'_>) -> Result<Self, Failure> {
        let environment: &Environment = lit.environment;
        let grid = environment.grid();
        let most = MAX_CUT.min(grid.height.saturating_sub(1)).min(grid.width.saturating_sub(1) / 2);
        let light = Transform::new(grid, Degree::new(most)?)?.analyse(environment.pixels());
        let shown = |pixels: &[[f32; 3]]| to_srgb8(pixels, lit.exposure, ToneMap::Filmic);
        let mut pictures = Vec::new();
        for (degree, window) in SHOWN {
            let cut = cut(&light, degree, window);
            let pixels: Vec<[f32; 3]> = Transform::new(PICTURE, cut.degree())?.synthesise(&cut);
            pictures.push(shown(&pixels));
        }
        pictures.push(shown(environment.resized(PICTURE)?.pixels()));
        Ok(Self { light, pictures })
    }
}

/// The light up to a degree, under a window.
fn cut(light: &Expansion, degree: usize, window: Window) -> Expansion {
    let degree = Degree::new(degree).map_or(light.degree(), |degree| degree.min(light.degree()));
    window.apply(&light.to_degree(degree))
}

/// The pixels of a picture, sRGB.
type PicturePixels = Vec<[u8; 3]>;

/// Shades a sphere under an environment with every cut, and by brute force; the pictures are those of
/// [`SHOWN`], and that by brute force.
fn pair(
    lit: &Lit<'_>,
    series: &Series,
    material: &Material,
    tabulated: &Tabulated,
    settings: &Settings,
    steps: &Steps<'_>,
) -> Result<(TablePair, Vec<PicturePixels>), Failure> {
    let sphere = Sphere::new(settings.sphere);
    let axes = sphere.brushed();
    let dark = lit.dark;
    let truth = brute_force(lit, material, &axes, steps)?;
    let frames = Frames::from_axes(&axes);
    let viewer = Viewer::Distant(Sphere::view());
    let seen = |degree: usize, window: Window| {
        let values = shade(&frames, &tabulated.table, viewer, &cut(&series.light, degree, window));
        let errors = sphere.errors(&values, &truth, dark, Lattice::ALL);
        (Cut { degree, rows: (degree + 1).pow(2), windowed: window != Window::None, errors }, values)
    };
    let shown = |values: &[[f32; 3]]| sphere.picture(&to_srgb8(values, lit.exposure, ToneMap::Filmic));
    let cuts: Vec<Cut> = (0..=MAX_CUT).map(|degree| seen(degree, Window::None).0).collect();
    let (mut pictures, mut windowed) = (Vec::new(), None);
    for (degree, window) in SHOWN {
        let (cut, values) = seen(degree, window);
        pictures.push(shown(&values));
        if cut.windowed {
            windowed = Some(cut);
        }
    }
    pictures.push(shown(&truth));
    let advised = cuts.iter().find(|cut| cut.errors.rms <= settings.table_error).map(|cut| cut.degree);
    let figures = TablePair {
        environment: lit.name.clone(),
        advised,
        cuts: cuts.into_iter().chain(windowed).collect(),
    };
    Ok((figures, pictures))
}
