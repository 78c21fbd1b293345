//! The matrices of a transfer as a texture of four channels, and where each vertex finds its own.
//!
//! A vertex has a run of texels within one row of the texture: for each channel of the transfer, for each row
//! i of the matrix, the entries T_i0 to T_i3, then T_i4 to T_i7 and so on, with zeros after the last. As many
//! vertices as fit follow each other in a row.

use containers::{Precision, Texture, VertexAttribute, write_ktx2_rgba};
use engine::Failure;
use transfer::{Frames, StoredTransfer, Transfer};

/// The most columns: every device for graphics has as many.
const WIDTH: usize = 4096;

/// The most rows; devices with fewer are old, or phones.
const HEIGHT: usize = 8192;

/// What the entries are.
const ENTRIES: &str = "row i of a matrix times the light's coefficients is coefficient i of what arrives at the \
                       vertex, in its frame: right-handed, +X the tangent, +Z the normal; real, orthonormal, no \
                       Condon-Shortley phase, row l*l + l + m";

/// How the texels of a vertex follow each other.
const TEXELS: &str = "a vertex has a run of texels, from the column and row on that are the fourth numbers of \
                      _TRANSFER_X and _TRANSFER_Z: for each channel, for each row of its matrix, four entries a \
                      texel, zeros after the last";

/// A texture of matrices.
pub(crate) struct MatrixTexture {
    /// The KTX2 file.
    pub(crate) file: Vec<u8>,
    /// The columns and rows of the texture.
    pub(crate) size: [usize; 2],
    /// The axes x and z of each vertex' frame, in the axes of a glTF file, each with a fourth number: the
    /// column and the row of the vertex' first texel.
    pub(crate) attributes: [VertexAttribute; 2],
}

/// Makes the texture of a transfer, with metadata that says how it is read.
///
/// # Errors
/// If the transfer is matte or of other frames, a number is not finite, or the texture would be too large.
pub(crate) fn matrix_texture(
    transfer: &StoredTransfer,
    frames: &Frames,
    precision: Precision,
    recipe: &str,
) -> Result<MatrixTexture, Failure> {
    let form = transfer.form();
    let Some(output) = form.output() else {
        return Err(Failure::new("the transfer is matte, so it has no matrices")
            .help("leave out `matrices`: the vectors of a matte transfer are attributes of the mesh"));
    };
    let (rows, columns, channels) = (output.rows(), form.input().rows(), transfer.channels().len());
    let fours = columns.div_ceil(4);
    let run = channels * rows * fours;
    let help = "lower `output-degree` or `degree` of precompute-transfer, or reduce the mesh's vertices";
    if run > WIDTH {
        let message =
            format!("the matrices of a vertex take {run} texels, but a row of a texture has {WIDTH}");
        return Err(Failure::new(message).help(help));
    }
    let (vertices, abreast) = (transfer.len(), (WIDTH / run).min(transfer.len()).max(1));
    let size = [abreast * run, vertices.div_ceil(abreast)];
    if size[1] > HEIGHT {
        let most = WIDTH / run * HEIGHT;
        let message = format!(
            "the matrices of {vertices} vertices do not fit into a texture, which has room for {most}"
        );
        return Err(Failure::new(message).help(help));
    }
    let matrices = transfer.matrices(frames).filter(|_| vertices == frames.len());
    let matrices = matrices.ok_or_else(|| Failure::new("the transfer belongs to another mesh"))?;
    check_finite(&matrices)?;
    let mut rgba = Vec::with_capacity(size[0] * size[1]);
    for vertex in 0..vertices {
        for row in matrices.iter().flat_map(|matrices| matrices.matrix(vertex).chunks_exact(columns)) {
            let four = |first: usize| [0, 1, 2, 3].map(|k| row.get(first + k).copied().unwrap_or(0.0));
            rgba.extend((0..columns).step_by(4).map(four));
        }
    }
    rgba.resize(size[0] * size[1], [0.0; 4]);
    let [degree, output_degree, channels] =
        [form.input().get(), output.get(), channels].map(|number| number.to_string());
    let entries = [
        ("specula.channels", channels.as_str()),
        ("specula.degree", &degree),
        ("specula.entries", ENTRIES),
        ("specula.output-degree", &output_degree),
        ("specula.texels", TEXELS),
    ];
    let sizes = Texture { width: size[0], height: size[1], ..Texture::default() };
    let file = write_ktx2_rgba(&sizes, &rgba, precision, Some(recipe), &entries)?.bytes;
    let attribute = |name: &str, axis: usize| {
        let values = (0..vertices).flat_map(|vertex| {
            // A file's x, y and z are our y, z and x.
            let [z, x, y] = frames.axes(vertex)[axis];
            [x, y, z, if axis == 0 { vertex % abreast * run } else { vertex / abreast } as f32]
        });
        VertexAttribute { name: name.to_owned(), width: 4, values: values.collect() }
    };
    let attributes = [attribute("_TRANSFER_X", 0), attribute("_TRANSFER_Z", 2)];
    Ok(MatrixTexture { file, size, attributes })
}

/// Refuses numbers that no texture should hold.
fn check_finite(matrices: &[Transfer]) -> Result<(), Failure> {
    let broken = |matrices: &Transfer| {
        let at = matrices.values().iter().position(|value| !value.is_finite())?;
        Some(at / (matrices.output().rows() * matrices.input().rows()))
    };
    match matrices.iter().find_map(broken) {
        Some(vertex) => {
            Err(Failure::new(format!("a number of the transfer at vertex {vertex} is not finite")))
        }
        None => Ok(()),
    }
}
