//! Draws a contact sheet: an 8-bit picture from environments, maps and numbers.
//!
//! `layout` places the pictures, `plot`, `ball` and `scale` make them. Nothing here knows about stages; all
//! radiance is shown with the same exposure and tone curve.

mod ball;
mod layout;
mod number;
mod plot;
mod scale;
pub(crate) mod theme;

use envmap::{Environment, Exposure, ToneMap, to_srgb8};
use preview::drawing::{Align, Canvas, Rect};
use rayon::prelude::*;
use sh::{Stop, Stopped};
use shrm::{Lamps, Shrm};
use sphere::LatLong;

use layout::{SheetLayout, SheetSection};
use plot::EnergyPlot;

use crate::values::percent;

pub(crate) use number::{power_of_ten, short, stops};

/// The grid on which a reconstruction is shown; one of another size is scaled.
pub(crate) const RECONSTRUCTION: LatLong = LatLong::with_rows(layout::COLUMN / 2);
/// The grid on which a material's map is shown; one of another size is scaled.
pub(crate) const MAP: LatLong = LatLong::with_rows(layout::BALL);

/// The edge of a ball's picture: for each row it asks whether to stop.
pub(crate) const BALL: usize = layout::BALL;

/// Describes an exposure: `exposure −2.4 stops from the log-average`, and how much of that was asked for.
pub(crate) fn described(usual: Exposure, more: f64) -> String {
    let asked = if more == 0.0 { String::new() } else { format!(", {} of them as given", stops(more)) };
    format!("exposure {} from the {}{asked}", stops(usual.stops + more), usual.basis.name())
}

/// The content of a sheet.
pub(crate) struct Sheet<'a> {
    /// The headline.
    pub(crate) title: String,
    /// The facts on the line below the headline.
    pub(crate) subtitle: String,
    pub(crate) environment: &'a Environment,
    pub(crate) lighting: Option<Harmonics>,
    pub(crate) materials: Vec<MaterialPictures>,
    /// The exposure in stops.
    pub(crate) exposure: f64,
    pub(crate) tone: ToneMap,
}

/// The environment in spherical harmonics.
pub(crate) struct Harmonics {
    /// The energy of each degree, as a fraction of the environment's.
    pub(crate) energies: Vec<f64>,
    /// The reconstructions, of ascending degree.
    pub(crate) reconstructions: Vec<Reconstruction>,
}

/// An environment reconstructed from its harmonics up to a degree.
pub(crate) struct Reconstruction {
    pub(crate) degree: usize,
    /// The fraction of the environment's energy that the reconstruction holds.
    pub(crate) captured: f64,
    pub(crate) map: Environment,
}

/// A material under the environment.
pub(crate) struct MaterialPictures {
    pub(crate) name: String,
    pub(crate) detail: String,
    /// Reflected radiance by central direction and view.
    pub(crate) field: Shrm,
    /// The lamps that the field does not hold.
    pub(crate) lamps: Option<Lamps>,
    /// Reflected radiance by central direction, the mean over views.
    pub(crate) map: Environment,
}

/// A finished picture: 8-bit sRGB.
pub struct Picture {
    /// The number of pixels of a row.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
    /// The colours, `width` x `height`, row by row from the top.
    pub pixels: Vec<[u8; 3]>,
}

impl Sheet<'_> {
    /// Draws the sheet.
    pub(crate) fn draw(&self, stop: Stop<'_>) -> Result<Picture, Stopped> {
        let reconstructions = self.lighting.as_ref().map(|lighting| lighting.reconstructions.len());
        let layout = SheetLayout::new(reconstructions, self.materials.len());
        let mut canvas = Canvas::new(layout.width, layout.height, theme::BACKGROUND);
        theme::TITLE.draw(&mut canvas, layout.title, Align::Left, &self.title);
        theme::SUBTITLE.draw(&mut canvas, layout.subtitle, Align::Left, &self.subtitle);

        self.place_map(&mut canvas, layout.environment.picture, self.environment);
        let grid = self.environment.grid();
        let size = format!("{} × {} · seen along +X", grid.width, grid.height);
        caption(&mut canvas, layout.environment.caption, "Environment", &size, &self.range(self.environment));

        if let (Some(lighting), Some(place)) = (&self.lighting, layout.plot) {
            let marks: Vec<_> = lighting.reconstructions.iter().map(|shown| shown.degree).collect();
            EnergyPlot { energies: &lighting.energies, marks: &marks }.draw(&mut canvas, place);
        }
        if let (Some(lighting), Some(section)) = (&self.lighting, layout.harmonics) {
            headline(&mut canvas, section, "Spherical harmonics", "share of the environment's energy");
            for (shown, panel) in lighting.reconstructions.iter().zip(&layout.reconstructions) {
                self.place_map(&mut canvas, panel.picture, &shown.map);
                let name = format!("degree {}", shown.degree);
                caption(&mut canvas, panel.caption, &name, &percent(shown.captured), &self.range(&shown.map));
            }
        }
        if let Some(section) = layout.material_section {
            headline(
                &mut canvas,
                section,
                "Materials",
                "reflected light by direction, and on a ball seen along +X",
            );
            let pictures = self
                .materials
                .par_iter()
                .zip(&layout.materials)
                .map(|(material, panel)| {
                    let ball = ball::ball(
                        self.environment,
                        &material.field,
                        material.lamps.as_ref(),
                        panel.ball.width,
                        stop,
                    )?;
                    Ok((self.shown(&material.map, panel.map), to_srgb8(&ball, self.exposure, self.tone)))
                })
                .collect::<Result<Vec<_>, Stopped>>()?;
            for ((material, panel), (map, ball)) in
                self.materials.iter().zip(&layout.materials).zip(&pictures)
            {
                canvas.place(panel.map, map);
                canvas.place(panel.ball, ball);
                let range = self.range(&material.map);
                caption(&mut canvas, panel.caption, &material.name, &material.detail, &range);
            }
        }
        Ok(Picture { width: canvas.width(), height: canvas.height(), pixels: canvas.pixels().to_vec() })
    }

    fn shown(&self, map: &Environment, place: Rect) -> Vec<[u8; 3]> {
        to_srgb8(&scale::scaled(map, place.width, place.height), self.exposure, self.tone)
    }

    fn place_map(&self, canvas: &mut Canvas, place: Rect, map: &Environment) {
        canvas.place(place, &self.shown(map, place));
    }

    /// The least and the greatest value of any channel, and the mean over the sphere.
    fn range(&self, map: &Environment) -> String {
        let (grid, mut mean) = (map.grid(), 0.0);
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for (row, line) in map.pixels().chunks_exact(grid.width).enumerate() {
            let sum: f64 = line.iter().flatten().map(|value| f64::from(*value)).sum();
            mean += grid.solid_angle(row) * sum / 3.0;
            low = line.iter().flatten().copied().fold(low, f32::min);
            high = line.iter().flatten().copied().fold(high, f32::max);
        }
        let mean = mean / (4.0 * std::f64::consts::PI);
        format!("radiance {} to {}, mean {}", short(low.into()), short(high.into()), short(mean))
    }
}

/// Draws a headline at the left, a note at the right, above a rule.
fn headline(canvas: &mut Canvas, section: SheetSection, text: &str, note: &str) {
    let width = theme::SECTION.draw(canvas, section.title, Align::Left, text).ceil() as usize;
    let rest = Rect::new(
        section.title.x + width + 24,
        section.title.y,
        section.title.width.saturating_sub(width + 24),
        section.title.height,
    );
    theme::DETAIL.draw(canvas, rest, Align::Right, note);
    canvas.fill(section.rule, theme::RULE);
}

/// Draws a name with a fact at its right, and a line below. A long name is shortened for the fact, down to
/// half the line.
fn caption(canvas: &mut Canvas, lines: [Rect; 2], name: &str, fact: &str, below: &str) {
    const GAP: usize = 16;
    let [first, second] = lines;
    let right = (theme::DETAIL.width(fact).ceil() as usize).min(first.width / 2 - GAP);
    let left = first.width - right - GAP;
    theme::NAME.draw(canvas, Rect { width: left, ..first }, Align::Left, name);
    let place = Rect { x: first.right() - right, width: right, ..first };
    theme::DETAIL.draw(canvas, place, Align::Right, fact);
    theme::DETAIL.draw(canvas, second, Align::Left, below);
}

#[cfg(test)]
mod tests {
    use brdf::Centre;
    use sh::Degree;
    use shrm::{MapGrid, Terms, View};

    use super::*;

    /// A map that shows the same toward every view: B_00 Y_00.
    fn field(map: &Environment) -> Shrm {
        let scale = (4.0 * std::f32::consts::PI).sqrt();
        let values = map.pixels().iter().map(|pixel| pixel.map(|value| value * scale)).collect();
        let grid = MapGrid::LatLong(map.grid());
        Shrm::new(grid, View::Local, Centre::Reflection, Degree::ZERO, Terms::All, values).unwrap()
    }

    /// A dim sky with a bright spot toward +X.
    fn sky(rows: usize) -> Environment {
        let grid = LatLong::with_rows(rows);
        let texels = (0..grid.height).flat_map(|row| (0..grid.width).map(move |column| (row, column)));
        let pixels = texels.map(|(row, column)| {
            let v = grid.direction(row, column).vector();
            let spot = if v.x > 0.98 { 30.0 } else { 0.0 };
            [0.2 + 0.1 * v.z as f32 + spot, 0.3 + 0.1 * v.z as f32 + spot, 0.5 + spot]
        });
        Environment::new(grid, pixels.collect()).unwrap()
    }

    fn sheet<'a>(environment: &'a Environment, names: &[&str]) -> Sheet<'a> {
        let reconstruction = |degree: usize| Reconstruction {
            degree,
            captured: 1.0 - 0.5 / (degree + 1) as f64,
            map: sky(RECONSTRUCTION.height),
        };
        Sheet {
            title: "sky".into(),
            subtitle: "a test".into(),
            environment,
            lighting: Some(Harmonics {
                energies: (0..21).map(|l| 0.5 * 0.5_f64.powi(l)).collect(),
                reconstructions: [2, 5, 10, 20].map(reconstruction).into(),
            }),
            materials: names
                .iter()
                .map(|name| MaterialPictures {
                    name: (*name).into(),
                    detail: "about the reflection vector · degree 20".into(),
                    field: field(&sky(64)),
                    lamps: None,
                    map: sky(64),
                })
                .collect(),
            exposure: 0.0,
            tone: ToneMap::Filmic,
        }
    }

    #[test]
    fn sheets_of_any_number_of_materials_can_be_drawn() {
        let environment = sky(64);
        let mut last = 0;
        for count in [0, 1, 3, 30] {
            let names: Vec<_> =
                (0..count).map(|i| if i % 2 == 0 { "gold" } else { "Žofie_素材_\u{301}🙂" }).collect();
            let picture = sheet(&environment, &names).draw(Stop::NEVER).unwrap();
            assert_eq!(picture.pixels.len(), picture.width * picture.height);
            assert!(picture.height > last);
            last = picture.height;
        }
        let bare = Sheet { lighting: None, ..sheet(&environment, &[]) }.draw(Stop::NEVER).unwrap();
        assert_eq!(bare.width, 1680);
    }

    #[test]
    fn one_exposure_and_curve_show_every_picture() {
        // The environment's own map as a material: the same texels in both pictures, however they are scaled.
        let grid = LatLong::with_rows(8);
        let environment = Environment::new(grid, vec![[0.18, 0.09, 0.36]; grid.len()]).unwrap();
        let mut sheet = sheet(&environment, &["flat"]);
        sheet.materials[0].map = environment.clone();
        sheet.materials[0].field = field(&environment);
        (sheet.exposure, sheet.tone) = (1.0, ToneMap::Plain);
        let expected = to_srgb8(&[[0.18, 0.09, 0.36]], 1.0, ToneMap::Plain)[0];
        let picture = sheet.draw(Stop::NEVER).unwrap();
        let layout = SheetLayout::new(Some(4), 1);
        for place in [layout.environment.picture, layout.materials[0].map, layout.materials[0].ball] {
            for (x, y) in [(place.x, place.y), (place.right() - 1, place.bottom() - 1)] {
                assert_eq!(picture.pixels[y * picture.width + x], expected, "{place:?}");
            }
        }
    }

    #[test]
    fn a_sheet_is_mostly_surround_and_has_ink_in_every_caption() {
        let environment = sky(64);
        let picture = sheet(&environment, &["gold", "chalk"]).draw(Stop::NEVER).unwrap();
        let layout = SheetLayout::new(Some(4), 2);
        let lit = |place: Rect| {
            let inside =
                (place.y..place.bottom()).flat_map(|y| (place.x..place.right()).map(move |x| (x, y)));
            let lit = inside.filter(|(x, y)| picture.pixels[y * picture.width + x] != theme::BACKGROUND);
            lit.count() as f64 / (place.width * place.height) as f64
        };
        let captions = layout.reconstructions.iter().flat_map(|panel| panel.caption);
        let captions = captions.chain(layout.materials.iter().flat_map(|panel| panel.caption));
        for place in captions.chain(layout.environment.caption).chain([layout.title, layout.subtitle]) {
            // Small letters cover a few percent of their line, and never half of it.
            assert!((0.005..0.5).contains(&lit(place)), "{place:?}: {}", lit(place));
        }
        assert!(lit(layout.environment.picture) > 0.999 && lit(layout.materials[1].ball) > 0.999);
        assert_eq!(lit(Rect::new(0, 0, 40, layout.height)), 0.0);
    }

    #[test]
    fn the_same_sheet_is_drawn_with_any_number_of_threads() {
        let environment = sky(64);
        let draw = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                sheet(&environment, &["gold", "chalk", "chrome"]).draw(Stop::NEVER).unwrap().pixels
            })
        };
        assert!(draw(1) == draw(2));
    }
}
