//! Draws directions that follow light, a material's lobe at a view, or the product of both.
//!
//! ```toml
//! [stage.directions]
//! kind = "sample-directions"
//! input = "lighting"
//! path = "{environment}/directions"
//! ```
//!
//! Each direction comes with its density p and its weight f / p. So a program can integrate with these
//! directions, or compare its own sampling with them [JCJ09]. docs/sampling.md explains how they are drawn.
//!
//! | connected to `function` | directions follow |
//! | --- | --- |
//! | a lighting (`project-sh`) | its series; lights beside it are not sampled |
//! | a brdf (`project-brdf`) | rho_hat, the BRDF with its cosine, as a function of the incident direction, for one view |
//! | an environment | its texels, each constant over its area |
//!
//! If an environment is connected to `environment` as well, directions follow its product with the lighting
//! or the brdf, for example its light times the lobe of a material. An environment at this port alone is the
//! same as one at `function`.
//!
//! ```toml
//! [stage.directions]
//! kind = "sample-directions"
//! inputs = { function = "coefficients", environment = "environment" }
//! view = [1.0, 0.0, 1.0]
//! format = "safetensors"
//! path = "{environment}/{material}/directions"
//! ```
//!
//! The function is a weighted sum of the colour channels (`channels`). Series of at most 255 degrees are
//! sampled.
//!
//! ## The view of a material
//!
//! `normal` is the normal of the surface and `view` the direction toward the viewer, both in the world's
//! frame. Without them, the surface faces +Z and is viewed straight on. Only a material that is expanded
//! about its tangent (kajiya-kay) needs a `tangent`.
//!
//! ## Points
//!
//! A point of the unit square becomes a direction. Even points become even directions:
//!
//! | `points` | the points |
//! | --- | --- |
//! | `sobol` | the Sobol (0, 2)-sequence with Owen's scrambling; another `seed` gives other points |
//! | `plain-sobol` | the same without scrambling |
//! | `random` | independent ones; another `seed` gives other points |
//! | `halton` | the Halton sequence in bases 2 and 3 |
//! | `hammersley` | the Hammersley set of `count` points |
//!
//! Instead, `points-file` names a CSV file with two numbers a line, each 0 or more and less than 1. Its path
//! is relative to the manifest. The first line may be `u,v`, and `#` starts a comment.
//!
//! ## Density
//!
//! With `density = "absolute"`, p follows \|f\| and a weight has the sign of f: the mean of all weights is an
//! unbiased estimate of the integral of f, also where a series rings below zero. With `density = "positive"`,
//! p follows max(f, 0), the weight is max(f, 0) / p, and the mean estimates the integral of the positive
//! part. In an environment, negative texels count as 0. Of a product, the rule is that of the series.
//!
//! A series is drawn from cells of equal area. `leaves` sets the density inside a cell:
//!
//! | `leaves` | inside a cell | Var(f / p) over the squared mean, for a light of degree 19 |
//! | --- | --- | --- |
//! | `flat` | constant, as in the talk | 8e-4 |
//! | `bilinear` | between the values at the corners | 2e-5 |
//! | `analytic` | the series itself | 6e-12 |
//!
//! Cells in which f changes sign are flat, and drawn more often than f requires. `warp` sets how a point
//! finds its cell: `rows` finds a row, then a column in it, in tables; `hierarchical` is the talk's
//! hierarchical sample warping, which descends a tree of halves. Both have the same density.
//!
//! A product is drawn from texels. With `masses = "texels"`, each texel has the exact integral of f over it,
//! and f is constant or bilinear inside (`leaves`). With `masses = "leaves"`, f is constant over each cell,
//! which renderers prefer, because a new f then takes less time.
//!
//! ## Files
//!
//! | `format` | the file |
//! | --- | --- |
//! | `csv` | a line for each direction: `u`, `v`, the point; `x`, `y`, `z`, the direction; `pdf`, in 1/sr; `weight`, in the unit of f times sr; a `.json` file next to it holds the recipe, and the numbers below as text |
//! | `safetensors` | the same as `point` [n, 2], `direction` [n, 3], `pdf` \[n\] and `weight` \[n\], 32-bit; the numbers are metadata |
//! | `exr` | the density in 1/sr at the centre of each texel of a lat-long map, as grey 32-bit floats |
//!
//! Directions are in Specula's frame, +Z up. `count` is the number of directions, `mean` that of the weights,
//! `variance` that of one weight, and `standard-error` the root of `variance` / `count`. The latter is the
//! error to expect of the mean of independent points (`random`); the error of the other sets is usually much
//! smaller. The build notes these numbers too.
//!
//! ```python
//! drawn = safetensors.numpy.load_file("directions.safetensors")
//! radiance = numpy.mean(my_integrand(drawn["direction"]) / drawn["pdf"])
//! ```

use std::num::NonZeroU32;
use std::path::Path;

use brdf::Centre;
use containers::{
    DirectionSamples, Precision, read_csv_points, tensors, texture_sidecar, write_csv_directions, write_exr,
};
use engine::{Artifact, Context, Failure, Kind, NamedPath, Output, Port, Product, choice, parameters};
use sampling::{
    ChannelWeights, Density, LeafShape, Moments, Options, Points, ProductMasses, SUM, UniformShare, Warp,
};
use sphere::{DVec3, Direction, LatLong};

use super::drawn_directions::{Drawing, Drawn, Followed};
use super::series_alone::{check_degree, warn_of_lights};
use crate::values::{MAX_RESOLUTION, Vector, artifacts, image, percent};

choice! {
    /// The container.
    pub(crate) enum DirectionsFormat {
        /// A table of directions.
        Csv = "csv",
        /// Directions for programs.
        Safetensors = "safetensors",
        /// A picture of the density.
        Exr = "exr",
    }
}

choice! {
    /// A set of points of the unit square.
    pub(crate) enum PointSetName {
        /// Sobol's sequence with Owen's scrambling.
        Sobol = "sobol",
        /// Sobol's sequence.
        PlainSobol = "plain-sobol",
        /// Independent points.
        Random = "random",
        /// Halton's sequence.
        Halton = "halton",
        /// Hammersley's set.
        Hammersley = "hammersley",
    }
}

choice! {
    /// Which function of f is the density.
    pub(crate) enum DensityName: Density {
        /// The absolute value of f.
        Absolute = "absolute",
        /// The positive part of f.
        Positive = "positive",
    }
}

choice! {
    /// The density inside a cell or a texel.
    pub(crate) enum LeavesName: LeafShape {
        /// Constant.
        Flat = "flat",
        /// Between the values at the corners.
        Bilinear = "bilinear",
        /// The series itself.
        Exact = "analytic",
    }
}

choice! {
    /// How a point finds its cell.
    pub(crate) enum WarpName: Warp {
        /// A row, then a column in it.
        Rows = "rows",
        /// Down a tree of halves.
        Tree = "hierarchical",
    }
}

choice! {
    /// What has the masses of a product.
    pub(crate) enum MassesName {
        /// Each texel.
        Texels = "texels",
        /// Each cell.
        Leaves = "leaves",
    }
}

choice! {
    /// The weighted sum of the channels that is sampled.
    pub(crate) enum ChannelsName {
        /// The sum.
        Sum = "sum",
        /// The luminance of Rec. 709.
        Luminance = "luminance",
        /// Red alone.
        Red = "red",
        /// Green alone.
        Green = "green",
        /// Blue alone.
        Blue = "blue",
    }
}

impl ChannelsName {
    fn weights(self) -> ChannelWeights {
        match self {
            Self::Sum => SUM,
            Self::Luminance => envmap::LUMINANCE,
            Self::Red => [1.0, 0.0, 0.0],
            Self::Green => [0.0, 1.0, 0.0],
            Self::Blue => [0.0, 0.0, 1.0],
        }
    }
}

/// The most directions of an item.
const MAX_COUNT: usize = 1 << 20;

/// The number of directions, unless one is given.
const DEFAULT_COUNT: usize = 1024;

/// The rows of a picture of the density, unless a number is given or an environment has its own.
const DEFAULT_ROWS: usize = 256;

/// The ports.
const FUNCTION: &str = "function";
const ENVIRONMENT: &str = "environment";

parameters! {
    /// Parameters of `sample-directions`.
    pub(crate) struct Parameters {
        /// What is written; see Files.
        format: DirectionsFormat = DirectionsFormat::Csv,
        /// The points of the unit square that become directions; see Points. Default: "sobol".
        points: Option<PointSetName> = None,
        /// A CSV file of points, instead of `points`; see Points.
        points_file: Option<String> = None,
        /// The number of directions. Default: 1024, or all points of the `points-file`.
        #[range(1..=MAX_COUNT)]
        count: Option<usize> = None,
        /// With points "sobol" or "random": another number gives other points. Default: 0.
        #[range(0..=u32::MAX as usize)]
        seed: Option<usize> = None,
        /// Which function of f is the density; see Density. Default: "absolute".
        density: Option<DensityName> = None,
        /// The share of the density of a series that is uniform over the sphere, for integrands that are not
        /// zero where the series is. Default: 0.
        #[range(0.0..1.0)]
        uniform_share: Option<f64> = None,
        /// The density inside a cell of a series or, of a product, inside a texel; see Density. Default:
        /// "bilinear", or "flat" with masses "leaves".
        leaves: Option<LeavesName> = None,
        /// How a point finds the cell of a series; see Density. Default: "rows".
        warp: Option<WarpName> = None,
        /// Whether each texel or each cell of a product has a mass of its own; see Density. Default:
        /// "texels".
        masses: Option<MassesName> = None,
        /// The sum of colour channels that is sampled.
        channels: ChannelsName = ChannelsName::Sum,
        /// The normal of the surface whose material is sampled. Default: [0, 0, 1].
        normal: Option<Vector> = None,
        /// The direction from the surface toward the viewer, if a material is sampled. Default: the normal.
        view: Option<Vector> = None,
        /// A vector whose part perpendicular to the normal is the tangent, for a material that is expanded
        /// about its tangent. Default: [1, 0, 0].
        tangent: Option<Vector> = None,
        /// With format "exr": rows of the picture, which has twice as many columns. Default: those of the
        /// environment, or 256.
        #[range(1..=MAX_RESOLUTION)]
        resolution: Option<usize> = None,
    }
}

impl Parameters {
    fn density(&self) -> Density {
        self.density.map_or(Density::Absolute, |name| name.0)
    }

    fn uniform_share(&self) -> UniformShare {
        // A share that rounds to 1 is the largest below.
        let share = self.uniform_share.unwrap_or(0.0) as f32;
        UniformShare::new(share.min(1.0 - f32::EPSILON / 2.0)).unwrap_or_default()
    }

    fn normal(&self) -> Direction {
        self.normal.map_or(Direction::Z, Vector::direction)
    }

    fn view(&self) -> Direction {
        self.view.map_or(self.normal(), Vector::direction)
    }

    /// The tangent, unless the vector that is given is the normal or its opposite.
    fn tangent(&self) -> Option<Direction> {
        let normal = self.normal().vector();
        let across = |vector: DVec3| {
            let part = vector - normal * vector.dot(normal);
            (part.length() > 1e-6).then(|| Direction::normalised(part))
        };
        match self.tangent {
            Some(vector) => across(vector.direction().vector()),
            None => across(DVec3::X).or_else(|| across(DVec3::Y)),
        }
    }

    fn drawing(&self) -> Drawing {
        let shape = self.leaves.map_or(LeafShape::Bilinear, |leaves| leaves.0);
        let warp = self.warp.map_or(Warp::Rows, |warp| warp.0);
        let masses = match self.masses {
            Some(MassesName::Leaves) => ProductMasses::Leaves,
            _ if shape == LeafShape::Flat => ProductMasses::FlatTexels,
            _ => ProductMasses::BilinearTexels,
        };
        let (density, uniform_share) = (self.density(), self.uniform_share());
        Drawing { of_series: Options { density, uniform_share, shape, warp }, masses }
    }
}

/// The kind `sample-directions`.
pub(crate) struct SampleDirections;

impl Kind for SampleDirections {
    type Parameters = Parameters;

    const NAME: &'static str = "sample-directions";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[sampling::revisions::SAMPLERS];
    const TEXT: &'static str = include_str!("sample_directions.rs");

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Lighting>(FUNCTION)
                .or::<artifacts::Brdf>()
                .or::<artifacts::Environment>()
                .optional(),
            Port::one::<artifacts::Environment>(ENVIRONMENT).optional(),
        ]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        let endings: &[&str] = match parameters.format {
            DirectionsFormat::Csv => &[".json", ".csv"],
            DirectionsFormat::Safetensors => &[".safetensors"],
            DirectionsFormat::Exr => &[".exr"],
        };
        Product::Files(endings.iter().map(|ending| (*ending).to_owned()).collect())
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        let given = [
            ("points", parameters.points.is_some()),
            ("points-file", parameters.points_file.is_some()),
            ("count", parameters.count.is_some()),
            ("seed", parameters.seed.is_some()),
        ];
        let mut unused = |names: &[_], why: &str| errors.extend(given_in_vain(names, why));
        match parameters.format {
            DirectionsFormat::Exr => unused(&given, "format = \"exr\" is the density, without directions"),
            _ => {
                let only = "only format = \"exr\" uses it";
                unused(&[("resolution", parameters.resolution.is_some())], only);
                if parameters.points_file.is_some() {
                    let why = "points-file already gives the points; leave out one of the two";
                    unused(&[given[0], given[3]], why);
                } else if !matches!(
                    parameters.points,
                    None | Some(PointSetName::Sobol | PointSetName::Random)
                ) {
                    unused(&[given[3]], "only points = \"sobol\" or \"random\" uses it");
                }
            }
        }
        if parameters.masses == Some(MassesName::Leaves)
            && parameters.leaves.is_some_and(|leaves| leaves.0 != LeafShape::Flat)
        {
            errors.push(("leaves", "masses = \"leaves\" needs \"flat\": leave out one of the two".into()));
        }
        if parameters.view().vector().dot(parameters.normal().vector()) <= 0.0 {
            let text = "is not above the surface; expected less than 90 degrees between it and `normal`";
            errors.push(("view", text.into()));
        }
        if parameters.tangent().is_none() {
            errors.push(("tangent", "has the direction of `normal`; expected another one".into()));
        }
        errors
    }

    fn check_inputs(parameters: &Parameters, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
        let function = types.iter().find(|(port, _)| *port == FUNCTION).map(|(_, name)| *name);
        let is_lit = types.iter().any(|(port, _)| *port == ENVIRONMENT);
        let is_series = function.is_some_and(|name| name != artifacts::Environment::TYPE);
        let mut errors = Vec::new();
        if types.is_empty() {
            let text = "connect a lighting, a brdf or an environment: input = \"STAGE\"";
            return vec![("inputs", text.into())];
        }
        if is_lit && function == Some(artifacts::Environment::TYPE) {
            let text = "a product needs a lighting or a brdf as `function`, not a second environment";
            errors.push(("inputs", text.into()));
        }
        let mut unused = |names: &[_], why: &str| errors.extend(given_in_vain(names, why));
        if function != Some(artifacts::Brdf::TYPE) {
            let of_material = [
                ("normal", parameters.normal.is_some()),
                ("view", parameters.view.is_some()),
                ("tangent", parameters.tangent.is_some()),
            ];
            unused(&of_material, "only a material uses it: connect `project-brdf`");
        }
        let of_series = [
            ("density", parameters.density.is_some()),
            ("uniform-share", parameters.uniform_share.is_some()),
            ("leaves", parameters.leaves.is_some()),
        ];
        if !is_series {
            unused(&of_series, "only a series uses it; texels are constant: connect a lighting or a brdf");
        }
        if !is_series || is_lit {
            let of_cells = [("warp", parameters.warp.is_some())];
            unused(&of_cells, "only a series without an environment uses it");
        }
        if is_series && is_lit {
            let is_exact = parameters.leaves == Some(LeavesName(LeafShape::Exact));
            unused(&[("leaves", is_exact)], "a product knows \"flat\" and \"bilinear\"");
        } else {
            let of_product = [("masses", parameters.masses.is_some())];
            unused(&of_product, "only a product uses it: connect a series and an environment");
        }
        errors
    }

    fn named_paths(parameters: &Parameters) -> Vec<NamedPath> {
        let named = |path: &String| NamedPath {
            parameter: "points-file",
            index: 0,
            path: path.into(),
            is_word: false,
            is_read_whole: false,
        };
        parameters.points_file.iter().map(named).collect()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        // A file of points is read first, as its errors are found at once.
        let is_picture = parameters.format == DirectionsFormat::Exr;
        let points = if is_picture { Vec::new() } else { points(parameters, context)? };
        let followed = followed(parameters, context)?;
        context.reporter.check_cancelled()?;
        let source = followed.source(parameters.drawing())?;
        context.reporter.check_cancelled()?;
        let recipe = Some(context.recipe());
        if is_picture {
            let rows = parameters.resolution.or(followed.rows()).unwrap_or(DEFAULT_ROWS);
            let grid = LatLong::with_rows(rows.min(MAX_RESOLUTION));
            let picture = image(grid.width, grid.height, source.density(grid, &context.reporter)?)?;
            return Ok(Output::files(vec![write_exr(&picture, Precision::Float, recipe)?.bytes]));
        }
        let integrand = followed.integrand(parameters.density());
        let drawn = Drawn::new(&points, &source, &integrand, &context.reporter)?;
        let moments = Moments::of(&drawn.weights);
        let error = (moments.variance / points.len() as f64).sqrt();
        context.reporter.note(format!(
            "{} directions: mean weight {:.6}, standard error {} of that for independent points; variance of a weight \
             {:.3e}",
            points.len(),
            moments.mean,
            if moments.mean == 0.0 { "unknown".into() } else { percent(error / moments.mean.abs()) },
            moments.variance
        ));
        let numbers = [
            ("count", points.len().to_string()),
            ("mean", moments.mean.to_string()),
            ("variance", moments.variance.to_string()),
            ("standard-error", error.to_string()),
        ];
        let weights: Vec<f32> = drawn.weights.iter().map(|weight| *weight as f32).collect();
        let samples = DirectionSamples {
            points: &points,
            directions: &drawn.directions,
            densities: &drawn.densities,
            weights: &weights,
        };
        Ok(Output::files(match parameters.format {
            DirectionsFormat::Safetensors => {
                vec![tensors::encode_direction_samples(&samples, &numbers, recipe)?]
            }
            _ => {
                let entries = numbers.each_ref().map(|(name, value)| (*name, value.as_str()));
                vec![texture_sidecar(recipe, &entries)?, write_csv_directions(&samples)?]
            }
        }))
    }
}

/// The errors of those parameters that are given, because of which they have no effect.
fn given_in_vain<'a>(
    names: &'a [(&'static str, bool)],
    why: &'a str,
) -> impl Iterator<Item = (&'static str, String)> + 'a {
    let given = names.iter().filter(|(_, is_given)| *is_given);
    given.map(|(name, _)| (*name, why.to_owned()))
}

/// What is connected.
fn followed(parameters: &Parameters, context: &Context<'_>) -> Result<Followed, Failure> {
    let (inputs, reporter) = (&context.inputs, &context.reporter);
    let mut environment = inputs.optional::<artifacts::Environment>(ENVIRONMENT)?;
    let series = match inputs.type_at(FUNCTION) {
        Some(artifacts::Lighting::TYPE) => {
            let lighting = inputs.get::<artifacts::Lighting>(FUNCTION)?;
            check_degree(lighting.0.series.degree(), "project-sh")?;
            warn_of_lights(&lighting.0, "sampled", reporter);
            Some(lighting.0.series.clone())
        }
        Some(artifacts::Brdf::TYPE) => {
            let coefficients = &inputs.get::<artifacts::Brdf>(FUNCTION)?.0.coefficients;
            check_degree(coefficients.f(), "project-brdf")?;
            if parameters.tangent.is_some() && coefficients.centre() != Centre::Tangent {
                reporter.warn("`tangent` changes nothing: the material is not expanded about its tangent");
            }
            let tangent = parameters.tangent().unwrap_or(Direction::X);
            Some(coefficients.at_view(parameters.normal(), tangent, parameters.view()))
        }
        Some(_) => {
            environment = Some(inputs.get::<artifacts::Environment>(FUNCTION)?);
            None
        }
        None => None,
    };
    Followed::new(environment.as_ref().map(|light| &light.0), series.as_ref(), parameters.channels.weights())
}

/// The points of the unit square.
fn points(parameters: &Parameters, context: &Context<'_>) -> Result<Vec<[f32; 2]>, Failure> {
    if let Some(file) = &parameters.points_file {
        let within = |failure: Failure| failure.context(format!("points-file {file:?}"));
        let bytes = context.files.read(Path::new(file)).map_err(within)?;
        let mut points = read_csv_points(&bytes).map_err(|error| within(error.into()))?;
        let (found, most) = (points.len(), parameters.count.unwrap_or(MAX_COUNT));
        if parameters.count.is_some_and(|count| count > found) {
            return Err(within(Failure::new(format!("it has {found} points, not {most}")))
                .help(format!("set count = {found} or less, or leave it out to use all points")));
        }
        if found > MAX_COUNT && parameters.count.is_none() {
            return Err(within(Failure::new(format!("it has {found} points, more than {MAX_COUNT}")))
                .help(format!("set count = {MAX_COUNT} or less to use the first points")));
        }
        points.truncate(most);
        return Ok(points);
    }
    let mut points = vec![[0.0; 2]; parameters.count.unwrap_or(DEFAULT_COUNT)];
    let seed = u32::try_from(parameters.seed.unwrap_or(0))?;
    let count = u32::try_from(points.len()).ok().and_then(NonZeroU32::new).unwrap_or(NonZeroU32::MIN);
    let set = match parameters.points.unwrap_or(PointSetName::Sobol) {
        PointSetName::Sobol => Points::Sobol { seed: Some(seed) },
        PointSetName::PlainSobol => Points::Sobol { seed: None },
        PointSetName::Random => Points::Random { seed },
        PointSetName::Halton => Points::Halton,
        PointSetName::Hammersley => Points::Hammersley { count },
    };
    set.fill(0, &mut points);
    Ok(points)
}
