//! Tabulates a material for every view, as coefficients with which any soft light shades a surface.
//!
//! ```toml
//! [stage.table]
//! kind = "tabulate-brdf"
//! input = "material"
//! degree = 4
//! ```
//!
//! > c_i(v) = integral over s of rho_hat(s, v) Y_i(s)
//!
//! rho_hat is the BRDF times the cosine of the incident angle, as a function of the incident direction s
//! and the view v in the frame of the surface: x is the tangent, z the normal (Kautz, Sloan and Snyder
//! 2002, section 3). Under light with the coefficients L_i in that frame, the radiance of the surface is
//! the sum of L_i c_i(v): 25 products for degree 4. Unlike `project-brdf`, the table represents any
//! material, brushed or not, and keeps the view sharp. It suits low-frequency light on curved surfaces, on
//! which degree 4 shows little of the shape of a lamp. These are the errors under six soft lamps, as a
//! share of the radiance of a sphere:
//!
//! | ashikhmin-shirley, exponents | degree 2 | 4 | 6 | 8 | 14 |
//! | --- | --- | --- | --- | --- | --- |
//! | 12 along, 4 across | 6.9 % | 1.8 % | 0.5 % | 0.09 % | 0.001 % |
//! | 24, 8 | 10 % | 2.5 % | 0.7 % | 0.13 % | 0.001 % |
//! | 48, 16 | 14 % | 3.8 % | 1.3 % | 0.22 % | 0.003 % |
//!
//! ## The map of views
//!
//! The views are the texels of a parabolic map of the hemisphere: x = v_x / (1 + v_z) and y alike run from
//! -1 to 1, row 0 is at +y, and a texel's centre is its view. Texels outside the unit disk repeat its rim,
//! so that a bilinear look-up has no dark edge. The rim, and every view lower than 0.25 degrees, is
//! computed at 0.25 degrees above the horizon. Views from below the horizon, which interpolated normals
//! cause, are looked up on the rim (`below` is `clamped`); for kajiya-kay, which has no horizon, they are
//! looked up at their mirror image (`mirrored`).
//!
//! Every entry is integrated by rules that are refined until they agree, also at the horizon and near
//! grazing angles, to 1e-7 of the largest coefficient for smooth models; the build notes the error. `phong`
//! and `kajiya-kay` reflect light from below the horizon, and their tables include it (`incident` is
//! `sphere`). `phong` and `lambert` are closed forms.
//!
//! `poulin-fournier` is integrated to 1e-4, and measured surfaces to 1e-3: they have kinks, measured
//! surfaces between all of their nodes. Those that depend on the tangent take half a minute.
//!
//! ## Materials that vary over a surface
//!
//! A table can hold several materials (Q in the tensor's shape). `shade-vertices` blends between them by a
//! number at each vertex (`vertex-blend`), or by two if two parameters vary: 0 is the first material, 1 the
//! last, and the others are evenly spaced. Either one parameter of a material varies from one value to
//! another,
//!
//! ```toml
//! [stage.table]
//! kind = "tabulate-brdf"
//! input = "material"
//! vary = "exponent_y"
//! from = 8
//! to = 200
//! count = 5
//! ```
//!
//! or two of its parameters do, with a material for each pair of values,
//!
//! ```toml
//! [stage.table]
//! kind = "tabulate-brdf"
//! input = "material"
//! vary = "roughness"                   # of ward: along the scratches
//! from = 0.1
//! to = 0.5
//! second-vary = "roughness_y"          # across them
//! second-from = 0.1
//! second-to = 0.9
//! second-count = 3
//! ```
//!
//! or the materials are those of several items, in the order of their names:
//!
//! ```toml
//! [stage.table]
//! kind = "tabulate-brdf"
//! inputs = { materials = "material" }
//! ```
//!
//! Half-way between two materials, the reflection is the mean of both. If the two are similar, that is
//! close to the reflection with the mean parameters, so more materials are more accurate. In layers, a
//! varied parameter must belong to only one layer. A table has at most 256 materials.

use brdf::{BrdfTable, MODELS, Material, Value, ValueType, tabulate};
use engine::{Artifact, Context, Failure, Inputs, Kind, Output, Port, Product, nearest, parameters};
use sh::Degree;
use stages::artifacts;
use stages::plugin::{UntilStopped, size};

parameters! {
    /// Parameters of `tabulate-brdf`.
    pub(crate) struct Parameters {
        /// F, the degree over the incident direction: (F + 1)^2 coefficients for each view.
        #[range(0..=14)]
        degree: usize = 4,
        /// N: the map has N x N views.
        #[range(2..=512)]
        resolution: usize = 128,
        /// The parameter that varies over the surface: a numeric parameter of the material's model.
        vary: Option<String> = None,
        /// Its value for a blend of 0.
        from: Option<f64> = None,
        /// Its value for a blend of 1.
        to: Option<f64> = None,
        /// The number of materials, including both ends. Default: 5.
        #[range(2..=256)]
        count: Option<usize> = None,
        /// A second parameter that varies, by the second number of the blend.
        second_vary: Option<String> = None,
        /// Its value for a second number of 0.
        second_from: Option<f64> = None,
        /// Its value for a second number of 1.
        second_to: Option<f64> = None,
        /// The number of its values, including both ends. Default: 5.
        #[range(2..=256)]
        second_count: Option<usize> = None,
    }
}

/// The number of values of a parameter that varies.
const COUNT: usize = 5;

/// The most materials of a table.
const MAX_MATERIALS: usize = 256;

/// A parameter that varies over a surface.
struct Variation<'a> {
    name: &'a str,
    from: f64,
    to: f64,
    count: usize,
}

impl Variation<'_> {
    /// Its values, in order.
    fn values(&self) -> impl Iterator<Item = f64> {
        let (from, to, last) = (self.from, self.to, self.count - 1);
        (0..=last).map(move |step| from + (to - from) * step as f64 / last as f64)
    }
}

impl Parameters {
    /// The parameters that vary: none, the first, or both.
    fn variations(&self) -> impl Iterator<Item = Variation<'_>> {
        let first = (&self.vary, self.from, self.to, self.count);
        let second = (&self.second_vary, self.second_from, self.second_to, self.second_count);
        [first, second].into_iter().filter_map(|(name, from, to, count)| {
            Some(Variation { name: name.as_deref()?, from: from?, to: to?, count: count.unwrap_or(COUNT) })
        })
    }
}

/// The share of the greatest coefficient past which the error is worth a warning.
const UNCERTAIN: f64 = 2e-3;

/// The kind `tabulate-brdf`.
pub(crate) struct TabulateBrdf;

impl Kind for TabulateBrdf {
    type Parameters = Parameters;

    const NAME: &'static str = "tabulate-brdf";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[brdf::revisions::MODELS, brdf::revisions::TABLE];
    const TEXT: &'static str = include_str!("tabulate_brdf.rs");

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Material>("material").optional(),
            Port::many::<artifacts::Material>("materials").optional(),
        ]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::BrdfTable::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let Parameters { vary, from, to, count, second_vary, second_from, second_to, second_count, .. } =
            parameters;
        let mut errors = Vec::new();
        for (vary, name, given) in [
            (vary, "vary", [("from", from.is_some()), ("to", to.is_some()), ("count", count.is_some())]),
            (
                second_vary,
                "second-vary",
                [
                    ("second-from", second_from.is_some()),
                    ("second-to", second_to.is_some()),
                    ("second-count", second_count.is_some()),
                ],
            ),
        ] {
            if vary.is_some() {
                let missing = given[..2].iter().filter(|(_, given)| !given);
                errors.extend(
                    missing.map(|(end, _)| (name, format!("also needs `{end}`: the values at both ends"))),
                );
            } else {
                let unused = given.into_iter().filter(|(_, given)| *given);
                let what = format!("only a varying parameter uses it: {name} = \"roughness\"");
                errors.extend(unused.map(|(name, _)| (name, what.clone())));
            }
        }
        match (vary, second_vary) {
            (None, Some(_)) => errors.push(("second-vary", "also needs a first one: vary = \"...\"".into())),
            (Some(first), Some(second)) if first == second => {
                errors.push(("second-vary", format!("`vary` has {first:?} too: name another parameter")));
            }
            _ => {}
        }
        let materials: usize = parameters.variations().map(|variation| variation.count).product();
        if materials > MAX_MATERIALS {
            let name = if second_count.is_some() { "second-count" } else { "count" };
            errors.push((
                name,
                format!("a table has at most {MAX_MATERIALS} materials, and these are {materials}"),
            ));
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let materials = materials(parameters, &context.inputs)?;
        let degree = Degree::new(parameters.degree)?;
        let (mut tables, mut error) = (Vec::new(), 0.0f64);
        for material in &materials {
            let (table, uncertain) =
                reporter.until_stopped(|stop| tabulate(material, degree, parameters.resolution, stop))?;
            tables.push(table);
            error = error.max(uncertain);
        }
        let across = parameters.variations().nth(1).map_or(1, |second| second.count);
        let table = BrdfTable::joined(&tables)
            .and_then(|table| table.with_grid([tables.len() / across, across]))
            .ok_or_else(|| Failure::new("there is no material"))?;
        let greatest = table.values().iter().fold(0.0f32, |most, value| most.max(value.abs()));
        if error > UNCERTAIN * f64::from(greatest) {
            reporter.warn(format!(
                "the material changes too fast to be integrated exactly: coefficients of up to {greatest:.3} are \
                 uncertain by up to {error:.1e}; a larger roughness avoids that"
            ));
        }
        let colour = if table.channels() == 1 { "grey" } else { "RGB" };
        let each = match table.grid() {
            [1, 1] => String::new(),
            [count, 1] => format!(" of {count} materials"),
            [along, across] => format!(" of {along} x {across} materials"),
        };
        reporter.note(format!(
            "{} coefficients, {colour}, for {} x {} views{each}: {}, within {error:.0e}",
            degree.rows(),
            table.size(),
            table.size(),
            size(4 * table.values().len() as u64)
        ));
        Output::artifact(artifacts::BrdfTable(table))
    }
}

/// The materials of the table, in order.
fn materials(parameters: &Parameters, inputs: &Inputs) -> Result<Vec<Material>, Failure> {
    let one = inputs.optional::<artifacts::Material>("material")?;
    let several = inputs.many::<artifacts::Material>("materials")?;
    match (one, several.is_empty()) {
        (Some(_), false) => Err(Failure::new("both material and materials are connected")
            .help("connect one of them: material makes a table of each item, materials one of all items")),
        (None, true) => Err(Failure::new("no material is connected").help("input = \"material\"")),
        (None, false) if parameters.vary.is_some() => {
            Err(Failure::new("`vary` is for one material, but several are connected")
                .help("input = \"material\", or leave out `vary`"))
        }
        (None, false) => Ok(several.into_iter().map(|(_, material)| material.0.clone()).collect()),
        (Some(material), true) => {
            let mut materials = vec![material.0.clone()];
            for variation in parameters.variations() {
                let each =
                    |material| variation.values().map(move |value| with(material, variation.name, value));
                materials = materials.iter().flat_map(each).collect::<Result<_, _>>()?;
            }
            Ok(materials)
        }
    }
}

/// Returns the material with another value of a parameter of its model, or of the only layer that has it.
fn with(material: &Material, name: &str, value: f64) -> Result<Material, Failure> {
    let mut layers: Vec<Material> = material.leaves().into_iter().cloned().collect();
    let numbers = |material: &Material| -> Vec<&'static str> {
        let model = MODELS.iter().find(|model| model.name == material.name());
        let parameters = model.map_or(&[][..], |model| model.parameters);
        let numbers =
            parameters.iter().filter(|parameter| matches!(parameter.value_type, ValueType::Number(_)));
        numbers.map(|parameter| parameter.name).collect()
    };
    let known: Vec<(usize, &'static str)> = layers
        .iter()
        .enumerate()
        .flat_map(|(index, layer)| numbers(layer).into_iter().map(move |name| (index, name)))
        .collect();
    let mut having = known.iter().filter(|(_, known)| *known == name);
    let (index, name) = match (having.next(), having.next()) {
        (Some(one), None) => *one,
        (Some(_), Some(_)) => {
            return Err(Failure::new(format!("several layers have a parameter {name:?}"))
                .help("make a material file for each value, and connect them as `materials`"));
        }
        (None, _) => {
            let names = || known.iter().map(|(_, known)| *known);
            let help = match nearest(name, names()) {
                Some(near) => format!("did you mean {near:?}?"),
                None if known.is_empty() => {
                    "it has no numeric parameter: make a material file for each value, and connect them as \
                     `materials`"
                        .to_owned()
                }
                None => format!("expected one of: {}", names().collect::<Vec<_>>().join(", ")),
            };
            let message = format!("{} has no numeric parameter {name:?} that could vary", material.name());
            return Err(Failure::new(message).help(help));
        }
    };
    let layer = &mut layers[index];
    let values = layer.values().with(name, Value::Number(value));
    match Material::analytic(layer.name(), &values) {
        Some(Ok(varied)) => *layer = varied,
        Some(Err(error)) => return Err(Failure::new(error.to_string())),
        None => {}
    }
    match layers.len() {
        1 => Ok(layers.swap_remove(0)),
        _ => Material::layers(layers).map_err(|error| Failure::new(error.to_string())),
    }
}
