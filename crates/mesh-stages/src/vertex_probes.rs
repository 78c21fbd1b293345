//! The light of probes at the vertices of a mesh.

use containers::tensors::Probes;
use engine::Failure;
use sh::{Degree, Expansion};

/// The rows of light at a probe.
const ROWS: usize = 9;

/// The light of probes at each vertex of a mesh, of degree 2.
#[derive(Clone)]
pub(crate) struct VertexProbes {
    rows: Vec<[[f32; 3]; ROWS]>,
}

impl VertexProbes {
    /// Blends the light of probes at vertices, by the lattices of their volumes and by what they see.
    ///
    /// # Errors
    /// If the probes have no volume.
    pub(crate) fn of(
        probes: &Probes,
        positions: &[[f32; 3]],
        normal: impl Fn(usize) -> [f32; 3],
    ) -> Result<Self, Failure> {
        let at = |(vertex, position): (usize, &[f32; 3])| {
            let light = probes.light.light_at(&probes.places, *position, normal(vertex));
            light.ok_or_else(|| {
                Failure::new("the probes stand at points, between which light is not blended")
                    .help("place them in a box: leave out `points` of place-probes, or add `boxes`")
            })
        };
        Ok(Self { rows: positions.iter().enumerate().map(at).collect::<Result<_, _>>()? })
    }

    /// The degree of the light.
    pub(crate) fn degree() -> Degree {
        Degree::new(2).unwrap_or(Degree::ZERO)
    }

    /// The light at each vertex: row l l + l + m, RGB.
    pub(crate) fn rows(&self) -> &[[[f32; 3]; ROWS]] {
        &self.rows
    }

    /// The light without other degrees than `l`.
    pub(crate) fn only(&self, l: usize) -> Self {
        let mut own = self.clone();
        for rows in &mut own.rows {
            let others = rows.iter_mut().enumerate().filter(|(row, _)| row.isqrt() != l);
            others.for_each(|(_, row)| *row = [0.0; 3]);
        }
        own
    }

    /// What `of` makes of the light at each vertex: a linear function whose result has some colours for each.
    ///
    /// The function is asked for the light of each row alone.
    pub(crate) fn under<E>(
        &self,
        of: impl Fn(&Expansion) -> Result<Vec<[f32; 3]>, E>,
    ) -> Result<Vec<[f32; 3]>, E> {
        let mut sum: Vec<[f32; 3]> = Vec::new();
        for row in 0..ROWS {
            let mut light = Expansion::zero(Self::degree());
            light.coefficients_mut()[row] = [1.0; 3];
            let found = of(&light)?;
            sum.resize(found.len(), [0.0; 3]);
            let each = (found.len() / self.rows.len().max(1)).max(1);
            for ((sums, values), rows) in sum.chunks_mut(each).zip(found.chunks(each)).zip(&self.rows) {
                for (sum, value) in sums.iter_mut().zip(values) {
                    (0..3).for_each(|channel| sum[channel] += value[channel] * rows[row][channel]);
                }
            }
        }
        Ok(sum)
    }
}
