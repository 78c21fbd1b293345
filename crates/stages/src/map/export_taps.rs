//! Writes compact maps: the scale space of an environment (`scale-space`), the taps of a material (`fit-taps`), or
//! both in one file.
//!
//! A renderer needs one scale space for each environment and one table for each material. Connect one of them to
//! write it once, or both for one file of a pair. For a pair the build measures how far the taps are from the sum
//! over the pixels of the environment, toward 500 views as a ball shows them, and warns if 95 % or 99 % of them are
//! not within `accept`.
//!
//! ## Files
//!
//! `.safetensors` after the item's `path` has, as far as they are connected:
//!
//! | tensor | shape | content |
//! | --- | --- | --- |
//! | `level_00`, `level_01`, ... | [6, n, n, 3] f32 | M, faces in the order +X -X +Y -Y +Z -Z, n as `scale-space` says |
//! | `std` | \[levels\] f64 | the standard deviation s_k of each level, in radians |
//! | `normal_0` to `normal_3` | [6, 16, 16, 3] f32 | the light about the normal, by the kernels y = 0, 1/3, 2/3 and 1 |
//! | `diffuse` | [9, 3] f64 | the radiance of a white diffuse surface: its dot with the nine harmonics Y(N), row l*l + l + m |
//! | `lights` | [n, 7] f64 | direction x, y, z, angular radius in radians, irradiance r, g, b of each light beside M |
//! | `taps` | [65, J, 5] f64 | delta, s, r, g, b of look-up j toward the view with 1 - cos(theta_v) = i / 64 |
//! | `normals` | [65, K, 4] f64 | y, r, g, b of the look-ups about the normal |
//!
//! Directions are in Specula's frame, right-handed with +Z up; a cube is sampled with (-y, z, x).
//!
//! ## In a renderer
//!
//! ```glsl
//! vec3 reflected(vec3 N, vec3 V) {
//!     float nv = max(dot(N, V), 0.0);
//!     vec3 R = 2.0 * nv * N - V;
//!     vec3 T = N - nv * R;                     // toward the normal: dot(N, R) is dot(N, V)
//!     T *= inversesqrt(max(dot(T, T), 1e-12));
//!     vec3 sum = vec3(0.0);
//!     for (int j = 0; j < J; ++j) {            // rows of the table, linear in 1 - nv
//!         sum += weight[j] * M(cos(delta[j]) * R + sin(delta[j]) * T, std[j]);
//!     }
//!     for (int k = 0; k < K; ++k) sum += normal_weight[k] * H(N, y[k]);
//!     return sum;                              // + each light, by the material's own formula
//! }
//! ```
//!
//! M is looked up in two levels, with x = 4 log2(s / s_0) between 0 and the last: level k = floor(x) and the next,
//! mixed by (2^((x - k) / 2) - 1) (1 + sqrt(2)), which is linear in the variance. H is linear in 3 y between two
//! kernels. docs/taps.md has the whole of it.
//!
//! ## Example
//!
//! ```toml
//! [stage.compact]
//! kind = "export-taps"
//! inputs = { scale-space = "light", taps = "taps" }
//! path = "{environment}/{material}/taps"
//! ```

use containers::tensors;
use engine::{
    Context, Diagnostic, Failure, Kind, Output, Parameter, Port, Product, Value, ValueKind, choice,
    parameters, unexpected,
};
use taps::{Accuracy, Truth};

use crate::values::{UntilStopped, artifacts, quantity};

choice! {
    /// The container.
    pub(crate) enum TapsFormat {
        /// Safetensors.
        Safetensors = "safetensors",
    }
}

/// The error that is accepted: `[p95, p99]`, in stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Accept(pub(crate) Accuracy);

impl Accept {
    /// Within a tenth of a stop.
    const DEFAULT: Self = Self(Accuracy { p95: 0.1, p99: 0.25 });
}

impl Parameter for Accept {
    fn expected() -> String {
        "[p95, p99], two numbers of stops above 0".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let stops = |value: &Value| f64::parse(value).ok().filter(|stops| *stops > 0.0 && stops.is_finite());
        let pair = match &value.kind {
            ValueKind::Array(values) => match values.as_slice() {
                [p95, p99] => stops(p95).zip(stops(p99)),
                _ => None,
            },
            _ => None,
        };
        let pair = pair.map(|(p95, p99)| Self(Accuracy { p95, p99 }));
        pair.ok_or_else(|| unexpected(value, &Self::expected()))
    }

    fn canonical(&self) -> serde_json::Value {
        vec![self.0.p95, self.0.p99].into()
    }

    fn schema() -> serde_json::Value {
        let stops = serde_json::json!({ "type": "number", "exclusiveMinimum": 0 });
        serde_json::json!({ "type": "array", "items": stops, "minItems": 2, "maxItems": 2 })
    }
}

parameters! {
    /// Parameters of `export-taps`.
    pub(crate) struct Parameters {
        /// The container.
        format: TapsFormat = TapsFormat::Safetensors,
        /// The errors [p95, p99] of a pair, in stops, up to which there is no warning.
        accept: Accept = Accept::DEFAULT,
    }
}

/// The views toward which a pair is measured.
const VIEWS: usize = 500;

/// The kind `export-taps`.
pub(crate) struct ExportTaps;

impl Kind for ExportTaps {
    type Parameters = Parameters;

    const NAME: &'static str = "export-taps";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[brdf::revisions::MODELS];
    const TEXT: &'static str = include_str!("export_taps.rs");

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::ScaleSpace>("scale-space").optional(),
            Port::one::<artifacts::Taps>("taps").optional(),
        ]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![
            match parameters.format {
                TapsFormat::Safetensors => ".safetensors",
            }
            .into(),
        ])
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let scales = context.inputs.optional::<artifacts::ScaleSpace>("scale-space")?;
        let taps = context.inputs.optional::<artifacts::Taps>("taps")?;
        if let (Some(scales), Some(taps)) = (&scales, &taps) {
            measure(&scales.0, &taps.0, parameters.accept.0, context)?;
        }
        if scales.is_none() && taps.is_none() {
            return Err(Failure::new("neither scale-space nor taps is connected")
                .help("inputs = { scale-space = \"light\", taps = \"taps\" }, or one of them"));
        }
        let (space, table) =
            (scales.as_ref().map(|scales| &scales.0.space), taps.as_ref().map(|taps| &taps.0.fitted.table));
        let bytes = match parameters.format {
            TapsFormat::Safetensors => tensors::encode_compact_map(space, table, Some(context.recipe()))?,
        };
        context.reporter.note(quantity::size(bytes.len() as u64));
        Ok(Output::files(vec![bytes]))
    }
}

/// Notes how far the taps are from the sum over the environment's pixels, or warns.
fn measure(
    scales: &tensors::EnvironmentScales,
    taps: &tensors::MaterialTaps,
    accept: Accuracy,
    context: &Context<'_>,
) -> Result<(), Failure> {
    let reporter = &context.reporter;
    let truth = reporter.until_stopped(|stop| {
        Truth::new(&scales.points, &taps.material, VIEWS, stop).map_err(Failure::from)
    })?;
    let Accuracy { p95, p99 } = truth.error(&taps.fitted.table, &scales.space, &taps.material);
    let lights = scales.space.lights().len();
    let text = format!(
        "{} taps and {} lights: 95 % of views are within {p95:.2} stops, 99 % within {p99:.2}",
        taps.fitted.table.taps(),
        lights
    );
    if p95 <= accept.p95 && p99 <= accept.p99 {
        reporter.note(text);
    } else {
        reporter.warn(format!(
            "{text}; `accept` is [{}, {}]. More `lights` of scale-space help if lamps are bright, a larger `resolution` \
             if the highlight is sharp, more `taps` of fit-taps otherwise",
            accept.p95, accept.p99
        ));
    }
    Ok(())
}
