//! Draws a material by itself, for `specula inspect`: its lobes, its albedo by angle, and a ball.
//!
//! `lobe_plot`, `albedo_plot` and `ball` draw one panel each; this file places them in a row, with the canvas
//! and the letters of contact sheets. An anisotropic material has a second row: the same panels with the
//! tangent turned by 90 degrees about the normal.

mod albedo_plot;
mod ball;
mod curve;
mod lobe_plot;

use brdf::Material;
use envmap::{ToneMap, to_srgb8};
use preview::drawing::{Align, Canvas, Rect};

use super::sheet::{Picture, theme};
use albedo_plot::AlbedoPlot;
use lobe_plot::LobePlot;

/// The width of the picture.
const WIDTH: usize = 1680;
const MARGIN: usize = 40;
const GUTTER: usize = 30;
/// The widths of the plots; the ball is as wide as it is high.
const LOBES: usize = 680;
const ALBEDO: usize = 480;
/// The height of every panel.
const PANEL: usize = WIDTH - 2 * (MARGIN + GUTTER) - LOBES - ALBEDO;
/// The height above the first row of panels, which the title takes.
const HEAD: usize = 126;
/// The height of a name and a line of detail above each panel.
const CAPTION: usize = 52;
const ROW_GAP: usize = 34;

/// The plane and the texts of one row of panels.
struct Row {
    /// The azimuth of the plane of the plots about the normal, from the tangent, in radians.
    azimuth: f64,
    /// The text that follows the names of the plots.
    plane: &'static str,
    /// The detail of the ball.
    tangent: &'static str,
}

const ISOTROPIC: [Row; 1] =
    [Row { azimuth: 0.0, plane: "", tangent: "the same light and exposure for every material" }];

const ANISOTROPIC: [Row; 2] = [
    Row { azimuth: 0.0, plane: ", along the tangent", tangent: "tangents along the circles of latitude" },
    Row {
        azimuth: std::f64::consts::FRAC_PI_2,
        plane: ", across the tangent",
        tangent: "tangents along the meridians",
    },
];

/// Draws a material: 8-bit sRGB, 1680 x 598 pixels, 1680 x 1064 if it is anisotropic.
///
/// Each row has three panels. The lobes are rho_hat(w_i, w_o) in the plane of incidence over the angle of the
/// view, for light from four angles: the radiance toward the view for light whose beam has the irradiance 1,
/// on a logarithmic scale. The albedo is that of [`brdf::albedo`], by the angle of the view. The ball is lit
/// by a soft sky and a small lamp and integrated with 144 samples a pixel; the light is the same for every
/// material, and is shown as every environment is ([`envmap::Environment::exposure`]). The picture does not
/// depend on the number of threads.
///
/// # Example: a material that prefers no direction takes one row
/// ```
/// let chalk = brdf::Material::Lambert(brdf::Lambert::new([0.8; 3])?);
/// let picture = stages::material_picture("chalk", &chalk);
/// assert_eq!((picture.width, picture.height), (1680, 598));
/// # Ok::<(), brdf::ParameterError>(())
/// ```
pub fn material_picture(name: &str, material: &Material) -> Picture {
    let rows: &[Row] = if material.is_isotropic() { &ISOTROPIC } else { &ANISOTROPIC };
    let top = |row: usize| HEAD + row * (CAPTION + PANEL + ROW_GAP);
    let mut canvas = Canvas::new(WIDTH, top(rows.len()) - ROW_GAP + MARGIN, theme::BACKGROUND);
    let line = |y: usize, height: usize| Rect::new(MARGIN, y, WIDTH - 2 * MARGIN, height);
    theme::TITLE.draw(&mut canvas, line(32, 42), Align::Left, name);
    theme::SUBTITLE.draw(&mut canvas, line(80, 24), Align::Left, &described(material));
    for (index, row) in rows.iter().enumerate() {
        draw_row(&mut canvas, top(index), row, material);
    }
    Picture { width: canvas.width(), height: canvas.height(), pixels: canvas.pixels().to_vec() }
}

fn draw_row(canvas: &mut Canvas, top: usize, row: &Row, material: &Material) {
    let panel = |x: usize, width: usize| Rect::new(x, top + CAPTION, width, PANEL);
    let lobes = panel(MARGIN, LOBES);
    let albedo = panel(lobes.right() + GUTTER, ALBEDO);
    let ball = panel(albedo.right() + GUTTER, PANEL);

    let albedo_plot = AlbedoPlot::new(material, row.azimuth);
    let lobe_plot = LobePlot::new(material, row.azimuth, albedo_plot.greatest_luminance());
    lobe_plot.draw(canvas, lobes);
    albedo_plot.draw(canvas, albedo);
    let radiance = ball::ball(material, row.azimuth, PANEL, ball::Samples::FEW);
    let mut colours = to_srgb8(&radiance, ball::exposure(), ToneMap::Filmic);
    ball::surround(&mut colours, PANEL, theme::SURFACE);
    canvas.place(ball, &colours);

    let lobe_name = format!("Lobes in the plane of incidence{}", row.plane);
    caption(
        canvas,
        lobes,
        &lobe_name,
        "by the angle of the view: BRDF × cos θ of the light, in 1/sr; the circles are powers of ten",
    );
    let albedo_name = format!("Albedo by the angle of the view{}", row.plane);
    caption(canvas, albedo, &albedo_name, "radiance reflected under a constant sky of radiance 1");
    caption(canvas, ball, "Ball under a sky and a lamp", row.tangent);
}

/// A name and a line of detail above a panel.
fn caption(canvas: &mut Canvas, panel: Rect, name: &str, detail: &str) {
    let line = |y: usize| Rect::new(panel.x, panel.y - CAPTION + y, panel.width, 21);
    theme::NAME.draw(canvas, line(0), Align::Left, name);
    theme::DETAIL.draw(canvas, line(21), Align::Left, detail);
}

/// `standard · isotropic`, `layers: lambert + phong · isotropic`
fn described(material: &Material) -> String {
    let models = match material {
        Material::Layers(_) => {
            let names: Vec<_> = material.leaves().iter().map(|layer| layer.name()).collect();
            format!("layers: {}", names.join(" + "))
        }
        one => one.name().to_owned(),
    };
    let turned = if material.is_isotropic() { "isotropic" } else { "anisotropic" };
    format!("{models} · {turned}")
}

#[cfg(test)]
mod tests {
    use brdf::{KajiyaKay, Lambert, Phong};

    use super::*;

    fn lambert(albedo: [f64; 3]) -> Material {
        Material::Lambert(Lambert::new(albedo).unwrap())
    }

    #[test]
    fn an_anisotropic_material_has_two_rows_that_differ() {
        let hair = Material::KajiyaKay(KajiyaKay::new(16.0, [0.1; 3]).unwrap());
        let picture = material_picture("hair", &hair);
        assert_eq!((picture.width, picture.height), (1680, 1064));
        let row = |index: usize| {
            let top = HEAD + CAPTION + index * (CAPTION + PANEL + ROW_GAP);
            &picture.pixels[top * WIDTH..(top + PANEL) * WIDTH]
        };
        let differing = row(0).iter().zip(row(1)).filter(|(one, other)| one != other).count();
        assert!(differing > PANEL * PANEL / 4, "{differing}");
    }

    #[test]
    fn the_models_of_layers_are_named() {
        let phong = Material::Phong(Phong::new(4.0, [0.5; 3]).unwrap());
        let both = Material::layers(vec![lambert([0.5; 3]), phong.clone()]).unwrap();
        assert_eq!(described(&both), "layers: lambert + phong · isotropic");
        assert_eq!(described(&phong), "phong · isotropic");
    }

    #[test]
    fn any_name_and_unusual_materials_can_be_drawn() {
        let sharp = Material::Phong(Phong::new(1e9, [1e6, 0.0, 1.0]).unwrap());
        for (name, material) in [("", lambert([0.0; 3])), (&"素材_".repeat(80), sharp)] {
            assert_eq!(material_picture(name, &material).pixels.len(), 1680 * 598);
        }
    }

    #[test]
    fn the_same_picture_is_drawn_with_any_number_of_threads() {
        let satin = Material::Phong(Phong::new(16.0, [0.95, 0.93, 0.88]).unwrap());
        let draw = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| material_picture("satin", &satin).pixels)
        };
        assert!(draw(1) == draw(2));
    }
}
