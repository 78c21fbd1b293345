//! Writes light as Haar wavelets or as a mipmap of equal areas: the hierarchies by which renderers sample it.
//!
//! ```toml
//! [stage.wavelets]
//! kind = "export-wavelets"
//! input = "lighting"
//! form = "haar"
//! count = 200
//! path = "{environment}/wavelets"
//! ```
//!
//! The sphere is divided into cells of equal area: `rows` equal in z, and twice as many columns equal in
//! azimuth. Row 0 is at +Z, column 0 begins at azimuth 0, toward +X, and azimuth grows toward +Y. So a point
//! of the unit square that is uniform stays uniform: z = 1 - 2 v, azimuth = 2 pi u. Of a lighting, the values
//! are the exact means of the series over the cells; the integrals of the talk of Jarosz, Carr and Jensen
//! are these times the area of a cell, 4 pi / (2 rows^2) sr [JCJ09]. Lights beside the series are not in
//! them. Of an environment, they are the exact means of its texels over the cells.
//!
//! | `form` | tensors, 32-bit floats |
//! | --- | --- |
//! | `mipmap` | `level0` [rows, 2 rows, 3], the means over the cells; `level1` [rows / 2, rows, 3], ... to [1, 2, 3], and the mean over the sphere, [1, 1, 3] |
//! | `haar` | `haar` [rows, 2 rows, 3]; with `count` or `tolerance` only the largest: `index` \[n\] u32, each a row times 2 rows and the column, and `haar` [n, 3] |
//!
//! The wavelets are orthonormal over the sphere, in the usual (non-standard) order: the upper left quarter of
//! `haar` belongs to the coarser steps. To the right of it are the differences between left and right, below
//! those between upper and lower, and in the lower right part those of both. The last step has one row and
//! two columns. Coefficient 0 is the mean times the root of 4 pi. It is always kept, and the first of the
//! sparse list; the others follow by size. `error` in the metadata is what the dropped ones leave: the root
//! mean square, relative to that of the light.
//!
//! ```python
//! from safetensors.numpy import load_file
//! file = load_file("wavelets.safetensors")
//! a = numpy.zeros((rows * 2 * rows, 3)); a[file["index"]] = file["haar"]; a = a.reshape(rows, 2 * rows, 3)
//! block = numpy.sqrt(0.5) * numpy.concatenate([a[:1, :1] + a[:1, 1:2], a[:1, :1] - a[:1, 1:2]], 1)
//! while len(block) < rows or block.shape[1] < 2 * rows:
//!     r, c = block.shape[:2]
//!     right, below, both = a[:r, c:2 * c], a[r:2 * r, :c], a[r:2 * r, c:2 * c]
//!     fine = numpy.empty((2 * r, 2 * c, 3))
//!     fine[0::2, 0::2] = block + right + below + both
//!     fine[0::2, 1::2] = block - right + below - both
//!     fine[1::2, 0::2] = block + right - below - both
//!     fine[1::2, 1::2] = block - right - below + both
//!     block = fine / 2
//! radiance = block / numpy.sqrt(4 * numpy.pi / block[..., 0].size)
//! ```

use containers::tensors::{self, Wavelets};
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, choice, parameters};
use rayon::prelude::*;
use sampling::{Haar, LeafGrid};
use sh::{CellGrid, CellTransform};

use super::kept_wavelets::{KeptWavelets, Wanted, given_twice};
use super::series_alone::{check_degree, warn_of_lights};
use crate::engines::nearest_power_of_two;
use crate::values::artifacts;

choice! {
    /// What is written.
    pub(crate) enum Form {
        /// Haar wavelets.
        Haar = "haar",
        /// Means of cells, and of larger and larger ones.
        Mipmap = "mipmap",
    }
}

/// The most rows.
const MAX_ROWS: usize = 4096;

parameters! {
    /// Parameters of `export-wavelets`.
    pub(crate) struct Parameters {
        /// What is written; see the table.
        form: Form = Form::Haar,
        /// The rows of the cells, a power of two; there are twice as many columns. Default: of a lighting,
        /// what sampling takes, the least power of two of 3 (degree + 1) or more and 16; of an environment,
        /// the power of two nearest to its rows.
        #[range(1..=MAX_ROWS)]
        rows: Option<usize> = None,
        /// With form "haar": only so many wavelets are written, the largest. Default: all.
        #[range(1..)]
        count: Option<usize> = None,
        /// With form "haar": the largest error, instead of a number. As many wavelets are written as it
        /// needs.
        #[range(0.0..1.0)]
        tolerance: Option<f64> = None,
    }
}

/// The kind `export-wavelets`.
pub(crate) struct ExportWavelets;

/// The port.
const LIGHT: &str = "light";

impl Kind for ExportWavelets {
    type Parameters = Parameters;

    const NAME: &'static str = "export-wavelets";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[sampling::revisions::HAAR];
    const TEXT: &'static str = include_str!("export_wavelets.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Lighting>(LIGHT).or::<artifacts::Environment>()]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".safetensors".into()])
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        if let Some(rows) = parameters.rows.filter(|rows| !rows.is_power_of_two()) {
            let nearest = nearest_power_of_two(rows);
            errors.push(("rows", format!("{rows} is not a power of two; the nearest is {nearest}")));
        }
        errors.extend(given_twice(parameters.count, parameters.tolerance));
        if parameters.form == Form::Mipmap {
            let given =
                [("count", parameters.count.is_some()), ("tolerance", parameters.tolerance.is_some())];
            let given = given.into_iter().filter(|(_, is_given)| *is_given);
            errors.extend(given.map(|(name, _)| (name, "only form = \"haar\" uses it".into())));
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let (inputs, reporter) = (&context.inputs, &context.reporter);
        let (rows, means) = if inputs.type_at(LIGHT) == Some(artifacts::Environment::TYPE) {
            let environment = &inputs.get::<artifacts::Environment>(LIGHT)?.0;
            let nearest = nearest_power_of_two(environment.grid().height).min(MAX_ROWS);
            let rows = parameters.rows.unwrap_or(nearest);
            (rows, environment.means_of_equal_areas(rows, 2 * rows))
        } else {
            let lighting = &inputs.get::<artifacts::Lighting>(LIGHT)?.0;
            let degree = lighting.series.degree();
            check_degree(degree, "project-sh")?;
            warn_of_lights(lighting, "written", reporter);
            let rows = parameters.rows.unwrap_or(LeafGrid::for_degree(degree).rows());
            let cells = CellTransform::new(CellGrid::equal_area(rows, 2 * rows), degree);
            let means = cells.means(lighting.series.coefficients());
            (rows, means.into_par_iter().map(|mean| mean.map(|value| value as f32)).collect())
        };
        reporter.check_cancelled()?;
        let wavelets = match parameters.form {
            Form::Mipmap => Wavelets::Mipmap(levels(rows, means)),
            Form::Haar => {
                let area = 4.0 * std::f64::consts::PI / (2 * rows * rows) as f64;
                let haar = Haar::new(&vec![area; rows], &vec![1.0; 2 * rows], means);
                let wanted = parameters.tolerance.map(Wanted::Error).or(parameters.count.map(Wanted::Count));
                let place = |index: usize| haar.in_blocks(index);
                match wanted {
                    None => {
                        let mut blocks = vec![[0.0; 3]; 2 * rows * rows];
                        for (index, value) in haar.coefficients().iter().enumerate() {
                            blocks[place(index)] = *value;
                        }
                        Wavelets::All(blocks)
                    }
                    Some(wanted) => {
                        let kept = KeptWavelets::of(&haar, wanted);
                        reporter.note(kept.note());
                        let kept_one = |index: &u32| {
                            let index = *index as usize;
                            (place(index) as u32, haar.coefficients()[index])
                        };
                        let error = kept.error;
                        Wavelets::Largest { wavelets: kept.indices.iter().map(kept_one).collect(), error }
                    }
                }
            }
        };
        Ok(Output::files(vec![tensors::encode_wavelets(rows, &wavelets, Some(context.recipe()))?]))
    }
}

/// The means of cells, and of larger and larger ones, down to that of the sphere.
fn levels(rows: usize, means: Vec<[f32; 3]>) -> Vec<Vec<[f32; 3]>> {
    let mut size = [rows, 2 * rows];
    let mut levels = vec![means];
    while let Some(finer) = levels.last().filter(|_| size != [1, 1]) {
        let [rows, columns] = size;
        let coarse = size.map(|side| side.div_ceil(2));
        let mean = |index: usize| {
            let (row, column) = (index / coarse[1] * 2, index % coarse[1] * 2);
            // A side of 1 is met twice, which is its mean.
            let at =
                |r: usize, c: usize| finer[(row + r).min(rows - 1) * columns + (column + c).min(columns - 1)];
            let four = [at(0, 0), at(0, 1), at(1, 0), at(1, 1)];
            std::array::from_fn(|c| (four.iter().map(|cell| f64::from(cell[c])).sum::<f64>() / 4.0) as f32)
        };
        levels.push((0..coarse[0] * coarse[1]).map(mean).collect());
        size = coarse;
    }
    levels
}
