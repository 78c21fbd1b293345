//! Projects an environment into spherical harmonics: the lighting's coefficients.
//!
//! ```toml
//! [stage.lighting]
//! kind = "project-sh"
//! input = "environment"
//! degree = 30
//! window = "lanczos"
//! ```
//!
//! > L_lm = integral of L(w) Y_lm(w) dw, for l from 0 to `degree`
//!
//! A pixel-centred lat-long image of H rows is integrated exactly up to degree (H - 1) / 2 by Fejér's first
//! rule, and up to H - 1 after its rows are resampled in theta; the number of columns must be more than twice
//! the degree. If the degree is too high, the error names the highest possible one.
//!
//! ## What a pixel is
//!
//! | `quadrature` | the light between the pixels' centres | degree |
//! | --- | --- | --- |
//! | `samples` | smooth: pixels are samples of a function of limited degree, which is integrated exactly | as above |
//! | `texels` | constant over each pixel's area, with a step at its edges: the integral of Y_lm over the area is exact | any |
//!
//! For smooth light, a coefficient differs by a share of about (pi l / H)^2 / 24: 0.06 % at degree 20 for
//! 512 rows. `texels` matches light that is sampled pixel by pixel, as by `sample-light` and path tracers:
//! a sun of one pixel has exactly that pixel's light.
//!
//! ## Lamps
//!
//! Photographs hold suns 10^5 times brighter than their mean. Every truncated series rings around them, by
//! stops. So if you set neither a degree nor a tolerance, suns and lamps leave the series: pixels more than
//! 10 times brighter than the mean over the sphere are cut down to that, and the excess becomes a few
//! `lights`, disks with a direction, an angular radius and an irradiance. The series then has the degree of
//! the image, at most 255, and `convolve` takes from it the degrees that each material shows. Exports put
//! the lights back into their maps, or write them separately (`lamps` of `export-shrm`).
//!
//! With a degree or a tolerance they stay in the series, and a note says so.
//! `lamps = "separate"` takes them out for a given degree too, and `lamps = "series"` never does it.
//!
//! ## Choosing a degree
//!
//! With a `tolerance`, the degree F is the least one that holds 1 - `tolerance` of the energy of the whole
//! light [Ram02, eqs. 5.15 and 5.16]:
//!
//! > sum over l <= F, m of L_lm^2 >= (1 - tolerance) * integral of L(w)^2 dw
//!
//! The energy of an environment with a small bright sun decays slowly, so its degree is high; if no degree
//! of the image holds enough, the highest possible one is used, with a warning. Most materials need less:
//! `convolve` uses the smaller degree of lighting and material. The build notes the degree, its share of
//! the energy, and (up to degree 128) the minimum of the resulting function.
//!
//! ## Windows
//!
//! Cutting a series at degree F makes it ring around bright lights, even below zero. A window scales the
//! coefficients of each l, which trades sharpness for less ringing:
//!
//! | `window` | factor of L_lm |
//! | --- | --- |
//! | `none` | 1 |
//! | `hanning` | (1 + cos(pi l / (F + 1))) / 2 |
//! | `lanczos` | sin(x) / x with x = pi l / (F + 1) |
//! | `laplacian` | 1 / (1 + `lambda` l^2 (l + 1)^2), the least squares with the squared Laplacian as a penalty |
//! | `non-negative` | the weakest `laplacian` window under which the function is not negative |
//!
//! `lambda` = 1 / (F (F + 1))^2 halves the highest degree. With `non-negative` the build notes the function's
//! minimum before and after. Every window keeps the mean of each colour.
//!
//! ## No negative values
//!
//! `non-negative = "nearest"` replaces the function, after its window, with the nearest one that is never
//! negative: among all functions g >= 0 of the same degree, the one with the least integral of (g - f)^2,
//! separately for each colour channel. Lights stay as sharp as the degree allows: a narrow lobe changes by
//! 1 to 20 percent in L2, and by more than 80 percent under the window `non-negative`. The mean may rise by
//! a few percent; `"nearest-same-mean"` takes the nearest function with the same mean, which changes f
//! more. The build notes the change in L2, which is the root of the integral of (g - f)^2 over that of f^2,
//! and the minimum before and after.
//!
//! The time grows with the sixth power of the degree, to about half a minute at degree 32 for a function
//! that is negative in half of all directions. So you must set `degree` or `tolerance`, and a degree above
//! 32 is an error. (Without them the series has up to 255 degrees, and `convolve` truncates it later, which
//! would make it ring again.) A black channel stays black. If an image has negative pixels, the nearest
//! function of a channel can be black although the channel is not: it has no mass, and the item fails. The
//! item also fails if the mean must be kept and is not positive.

use engine::{Artifact, Context, Failure, Kind, OrAuto, Output, Port, Product, Reporter, choice, parameters};
use envmap::Environment;
use sh::{
    CellGrid, CellTransform, Degree, Expansion, Minimum, Penalty, Tolerance, Transform, degree_holding,
    energy_per_degree, image_energy_of_rows, minimum, nearest_non_negative, non_negative,
};
use sphere::LatLong;

use super::full_lighting::{MAX_UNCUT_DEGREE, highest_degree};
use crate::values::{Lamps, NonNegative, SHARE, UntilStopped, Window, artifacts, lamps_text, share};

choice! {
    /// What a pixel is; see What a pixel is.
    pub(crate) enum Quadrature {
        /// A sample of a smooth function.
        Samples = "samples",
        /// The mean over its area.
        Texels = "texels",
    }
}

parameters! {
    /// Parameters of `project-sh`.
    pub(crate) struct Parameters {
        /// The highest l, inclusive, or "auto": as many degrees as a material may show or, with a
        /// `tolerance`, the least degree that meets it.
        #[range(0..=Degree::MAX.get())]
        degree: OrAuto<usize> = OrAuto::Auto,
        /// With degree "auto": the share of the energy that may be lost.
        #[range(SHARE)]
        tolerance: Option<f64> = None,
        /// Where suns and lamps go; see Lamps. Default: "separate" if there is neither a `degree` nor a
        /// `tolerance`, otherwise "series".
        lamps: Option<Lamps> = None,
        /// What a pixel is: a sample of smooth light, or the mean over its area.
        quadrature: Quadrature = Quadrature::Samples,
        /// The window, which reduces ringing; see Windows.
        #[words(Window::None, Window::Hanning, Window::Lanczos, Window::Laplacian, Window::NonNegative)]
        window: Window = Window::None,
        /// With window "laplacian": the weight of the penalty.
        #[range(0.0..)]
        lambda: Option<f64> = None,
        /// Whether and how negative values are avoided; see No negative values.
        non_negative: Option<NonNegative> = None,
    }
}

impl Parameters {
    fn lamps(&self) -> Lamps {
        let default = match (self.degree, self.tolerance) {
            (OrAuto::Auto, None) => Lamps::Separate,
            _ => Lamps::Series,
        };
        self.lamps.unwrap_or(default)
    }
}

/// The minimum of the function is searched and noted up to this degree.
const MINIMUM_UP_TO: usize = 128;

/// The highest degree of a function that becomes the nearest non-negative one.
const NEAREST_UP_TO: usize = 32;

/// The kind `project-sh`.
pub(crate) struct ProjectSh;

impl Kind for ProjectSh {
    type Parameters = Parameters;

    const NAME: &'static str = "project-sh";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[
        sh::revisions::TRANSFORM,
        sh::revisions::CELLS,
        sh::revisions::WINDOW,
        sh::revisions::NEAREST,
        envmap::revisions::LAMPS,
    ];
    const TEXT: &'static str = include_str!("project_sh.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Environment>("environment")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Lighting::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        if parameters.tolerance.is_some() && parameters.degree != OrAuto::Auto {
            errors.push(("tolerance", "only degree = \"auto\" uses it".into()));
        }
        match (parameters.window, parameters.lambda) {
            (Window::Laplacian, None) => {
                errors.push(("window", "\"laplacian\" needs lambda, the weight of its penalty".into()));
            }
            (Window::Laplacian, Some(_)) | (_, None) => {}
            (_, Some(_)) => errors.push(("lambda", "only window = \"laplacian\" uses it".into())),
        }
        if parameters.non_negative.is_some() {
            match (parameters.degree, parameters.tolerance) {
                (OrAuto::Fixed(degree), _) if degree > NEAREST_UP_TO => errors.push((
                    "degree",
                    format!("{degree} is above {NEAREST_UP_TO}, the highest degree for non-negative"),
                )),
                (OrAuto::Auto, None) => errors.push((
                    "non-negative",
                    format!("needs a degree, at most {NEAREST_UP_TO}, or a tolerance"),
                )),
                _ => {}
            }
            if parameters.window == Window::NonNegative {
                let text = "window = \"non-negative\" already prevents negative values";
                errors.push(("non-negative", text.into()));
            }
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let environment = context.inputs.get::<artifacts::Environment>("environment")?;
        let soft;
        let (environment, lights) = match parameters.lamps() {
            Lamps::Series => {
                if parameters.lamps.is_none() {
                    let key = if parameters.tolerance.is_some() { "tolerance" } else { "degree" };
                    reporter.note(format!(
                        "suns and lamps are in the series, because `{key}` is set; lamps = \"separate\" keeps them \
                         beside it, \"series\" says that this is meant"
                    ));
                }
                (&environment.0, Vec::new())
            }
            Lamps::Separate => {
                let separated = reporter.until_stopped(|stop| environment.0.separate_lamps(stop))?;
                soft = separated.soft;
                (&soft, separated.lights)
            }
        };
        if !lights.is_empty()
            && let Some(text) = lamps_text(&lights, environment.integral().iter().sum())
        {
            reporter.note(format!("{text}, kept as lights"));
        }
        let pixels = Pixels { environment, quadrature: parameters.quadrature, reporter };
        let lighting = match (parameters.degree, parameters.tolerance) {
            (OrAuto::Fixed(degree), _) => fixed(&pixels, Degree::new(degree)?, reporter)?,
            (OrAuto::Auto, Some(tolerance)) => least(&pixels, Tolerance::new(tolerance)?, reporter)?,
            (OrAuto::Auto, None) => {
                let degree = highest_degree(environment.grid()).min(Degree::new(MAX_UNCUT_DEGREE)?);
                fixed(&pixels, degree, reporter)?
            }
        };
        reporter.check_cancelled()?;
        let lighting = match parameters.window {
            Window::Laplacian => {
                let penalty = Penalty::new(parameters.lambda.unwrap_or_default())?;
                sh::Window::Laplacian(penalty).apply(&lighting)
            }
            Window::NonNegative => {
                let found = non_negative(&lighting)?;
                reporter.note(format!(
                    "window laplacian with lambda {:.4e}: minimum {} before, {} after",
                    found.penalty.get(),
                    describe(found.before),
                    describe(found.after)
                ));
                return Output::artifact(artifacts::Lighting(sh::Lighting {
                    series: found.expansion,
                    lights,
                }));
            }
            window => match window.fixed() {
                Some(window) => window.apply(&lighting),
                None => lighting,
            },
        };
        if let Some(choice) = parameters.non_negative {
            let series = nearest(&lighting, choice.mean(), reporter)?;
            return Output::artifact(artifacts::Lighting(sh::Lighting { series, lights }));
        }
        if lighting.degree().get() <= MINIMUM_UP_TO {
            reporter.note(format!("minimum {}", describe(minimum(&lighting))));
        }
        Output::artifact(artifacts::Lighting(sh::Lighting { series: lighting, lights }))
    }
}

/// An environment, and the meaning of its pixels.
struct Pixels<'a> {
    environment: &'a Environment,
    quadrature: Quadrature,
    reporter: &'a Reporter,
}

impl Pixels<'_> {
    fn analyse(&self, degree: Degree) -> Result<Expansion, Failure> {
        let grid = self.environment.grid();
        if matches!(self.quadrature, Quadrature::Texels) {
            let transform = CellTransform::new(CellGrid::lat_long(grid), degree);
            let rows = transform.project(self.environment.pixels());
            return Ok(Expansion::from_coefficients(degree, rows).unwrap_or_else(|| Expansion::zero(degree)));
        }
        let LatLong { width, height } = grid;
        let highest = highest_degree(grid);
        let transform = Transform::new(grid, degree).map_err(|error| {
            Failure::from(error)
                .context(format!(
                    "degree {} is too high for an image of {width} x {height}: the highest possible is {}",
                    degree.get(),
                    highest.get()
                ))
                .help(format!("set degree = {} or less, or import a larger image", highest.get()))
        })?;
        self.reporter.until_stopped(|stop| transform.analyse_rows(self.environment, stop))
    }

    /// The integral of the squared radiance over the sphere, all channels together.
    fn energy(&self) -> Result<f64, Failure> {
        let grid = self.environment.grid();
        if !matches!(self.quadrature, Quadrature::Texels) {
            let environment = self.environment;
            let energy = self.reporter.until_stopped(|stop| image_energy_of_rows(grid, environment, stop))?;
            return Ok(energy.iter().sum());
        }
        let pixels = self.environment.pixels();
        let square = |rgb: &[f32; 3]| rgb.iter().map(|value| math::powi(f64::from(*value), 2)).sum::<f64>();
        let row = |(row, pixels): (usize, &[[f32; 3]])| {
            grid.solid_angle(row) * pixels.iter().map(square).sum::<f64>()
        };
        Ok(pixels.chunks_exact(grid.width).enumerate().map(row).sum())
    }
}

/// The coefficients up to a degree that the manifest gives.
fn fixed(pixels: &Pixels<'_>, degree: Degree, reporter: &Reporter) -> Result<Expansion, Failure> {
    let lighting = pixels.analyse(degree)?;
    let held: f64 = energy_per_degree(&lighting).iter().flatten().sum();
    let share = energy_share(held, pixels.energy()?);
    reporter.note(format!("degree {} holds {share} of the energy", degree.get()));
    Ok(lighting)
}

/// The coefficients up to the least degree that meets a tolerance.
fn least(pixels: &Pixels<'_>, tolerance: Tolerance, reporter: &Reporter) -> Result<Expansion, Failure> {
    let highest = highest_degree(pixels.environment.grid());
    let whole = pixels.analyse(highest)?;
    let energy: Vec<f64> = energy_per_degree(&whole).iter().map(|rgb| rgb.iter().sum()).collect();
    let total = pixels.energy()?;
    let enough = degree_holding(&energy, total, tolerance);
    let degree = enough.map_or(Ok(highest), Degree::new)?;
    let held = energy_share(energy[..=degree.get()].iter().sum(), total);
    if enough.is_none() {
        reporter.warn(format!(
            "tolerance {} is missed: degree {}, the highest of this image, holds {held} of the energy; a \
             larger image holds more; without `tolerance` the lamps become separate lights and need no \
             degrees",
            tolerance.get(),
            degree.get()
        ));
    } else {
        reporter.note(format!("degree {} holds {held} of the energy", degree.get()));
    }
    Ok(whole.to_degree(degree))
}

/// The nearest function that is nowhere negative.
fn nearest(series: &Expansion, mean: sh::Mean, reporter: &Reporter) -> Result<Expansion, Failure> {
    let degree = series.degree().get();
    if degree > NEAREST_UP_TO {
        return Err(Failure::new(format!(
            "the tolerance needs degree {degree}, which is above {NEAREST_UP_TO}, the highest degree for non-negative"
        ))
        .help(format!("set degree = {NEAREST_UP_TO} or less instead of a tolerance")));
    }
    let found = reporter.until_stopped(|stop| nearest_non_negative(series, mean, stop))?;
    reporter.note(format!(
        "nearest non-negative function: a change of {:.3} % in L2; minimum {} before, {} after",
        100.0 * found.change,
        describe(found.before),
        describe(found.after)
    ));
    Ok(found.expansion)
}

fn energy_share(held: f64, total: f64) -> String {
    share(if total > 0.0 { (held / total).min(1.0) } else { 1.0 })
}

/// `-0.0123 (blue, at theta 40.0, phi -12.0 degrees)`
fn describe(minimum: Minimum) -> String {
    let channel = ["red", "green", "blue"][minimum.channel.min(2)];
    let (theta, phi) = (minimum.direction.theta().to_degrees(), minimum.direction.phi().to_degrees());
    format!("{:.4} ({channel}, at theta {theta:.1}, phi {phi:.1} degrees)", minimum.value)
}
