//! What arrives at probes from the sky and from emissive materials, before either has a colour.

use sh::{Degree, Expansion};

/// The transport to probes.
#[derive(Clone, Debug, PartialEq)]
pub struct Transport {
    pub(crate) degree: Degree,
    pub(crate) sky_degree: Degree,
    pub(crate) channels: usize,
    pub(crate) emitters: usize,
    pub(crate) sky: Vec<f32>,
    pub(crate) direct: Vec<f32>,
    pub(crate) indirect: Vec<f32>,
    pub(crate) paths: Vec<u32>,
    pub(crate) errors: Vec<f32>,
}

/// The parts of a [`Transport`], unchecked; [`Transport`] has their shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct TransportParts {
    /// The degree F of what arrives.
    pub degree: Degree,
    /// The degree O of the sky.
    pub sky_degree: Degree,
    /// 1 or 3.
    pub channels: usize,
    /// The number of emissive materials.
    pub emitters: usize,
    /// See [`Transport::sky`].
    pub sky: Vec<f32>,
    /// See [`Transport::direct`].
    pub direct: Vec<f32>,
    /// See [`Transport::indirect`].
    pub indirect: Vec<f32>,
    /// See [`Transport::paths`].
    pub paths: Vec<u32>,
    /// See [`Transport::errors`].
    pub errors: Vec<f32>,
}

impl Transport {
    /// A transport of its parts; `None` if their lengths do not belong together, the degree of what arrives
    /// is below 2, or there are not 1 or 3 channels.
    pub fn from_parts(parts: TransportParts) -> Option<Self> {
        let TransportParts { degree, sky_degree, channels, emitters, sky, direct, indirect, paths, errors } =
            parts;
        let rows = degree.rows().checked_mul(paths.len())?;
        let of_sky = rows.checked_mul(sky_degree.rows())?.checked_mul(channels)?;
        let of_emitters = rows.checked_mul(3)?.checked_mul(emitters)?;
        let are_right = sky.len() == of_sky && direct.len() == of_emitters && indirect.len() == of_emitters;
        let is_whole = are_right && errors.len() == paths.len() && [1, 3].contains(&channels);
        let is_whole = is_whole && degree.get() >= 2;
        is_whole.then_some(Self {
            degree,
            sky_degree,
            channels,
            emitters,
            sky,
            direct,
            indirect,
            paths,
            errors,
        })
    }

    /// The transport to no probe.
    pub(crate) fn empty(degree: Degree, sky_degree: Degree, channels: usize, emitters: usize) -> Self {
        let (sky, direct, indirect) = (Vec::new(), Vec::new(), Vec::new());
        let (paths, errors) = (Vec::new(), Vec::new());
        Self { degree, sky_degree, channels, emitters, sky, direct, indirect, paths, errors }
    }

    /// The degrees, channels and emitters.
    pub(crate) fn shape(&self) -> [usize; 4] {
        [self.degree.get(), self.sky_degree.get(), self.channels, self.emitters]
    }

    /// Takes over what arrives at a probe of another transport, which has the same shape.
    pub(crate) fn take_probe(&mut self, own: usize, other: &Self, probe: usize) {
        let rows = self.degree.rows();
        let (of_sky, of_emitters) = (rows * self.sky_degree.rows() * self.channels, 3 * rows * self.emitters);
        for (to, from, length) in [
            (&mut self.sky, &other.sky, of_sky),
            (&mut self.direct, &other.direct, of_emitters),
            (&mut self.indirect, &other.indirect, of_emitters),
        ] {
            to[own * length..][..length].copy_from_slice(&from[probe * length..][..length]);
        }
        (self.paths[own], self.errors[own]) = (other.paths[probe], other.errors[probe]);
    }

    /// The number of probes.
    pub fn len(&self) -> usize {
        self.paths.len()
    }

    /// Whether there are no probes.
    pub fn is_empty(&self) -> bool {
        self.paths.is_empty()
    }

    /// The degree F of what arrives.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// The degree O of the sky.
    pub fn sky_degree(&self) -> Degree {
        self.sky_degree
    }

    /// 1 if the surfaces are grey, else 3.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// The number of emissive materials.
    pub fn emitters(&self) -> usize {
        self.emitters
    }

    /// T: [probe, (F + 1)^2, (O + 1)^2, channel]. Rows are what arrives, columns are the sky.
    pub fn sky(&self) -> &[f32] {
        &self.sky
    }

    /// The light that emitters send straight to the probes, for a radiance of 1: [probe, emitter, (F + 1)^2,
    /// RGB].
    pub fn direct(&self) -> &[f32] {
        &self.direct
    }

    /// The light of emitters that surfaces reflected, for a radiance of 1: [probe, emitter, (F + 1)^2, RGB].
    pub fn indirect(&self) -> &[f32] {
        &self.indirect
    }

    /// The paths that were traced for each probe.
    pub fn paths(&self) -> &[u32] {
        &self.paths
    }

    /// The standard error of each probe's irradiance relative to it, RMS over all directions, if the sky and
    /// all emitters have the radiance 1.
    pub fn errors(&self) -> &[f32] {
        &self.errors
    }

    /// Adds the light of a sky that arrives at a probe, RGB for each row; a sky of a higher degree is cut.
    pub fn add_sky(&self, probe: usize, sky: &Expansion, rows: &mut [[f64; 3]]) {
        let (count, columns, channels) = (self.degree.rows(), self.sky_degree.rows(), self.channels);
        let t = &self.sky[probe * count * columns * channels..][..count * columns * channels];
        for (row, t) in rows.iter_mut().zip(t.chunks_exact(columns * channels)) {
            for (t, sky) in t.chunks_exact(channels).zip(sky.coefficients()) {
                for channel in 0..3 {
                    row[channel] += f64::from(t[channel % channels]) * sky[channel];
                }
            }
        }
    }

    /// Adds the light of an emitter that arrives at a probe, for its radiance; with what it sends straight
    /// there, or without.
    pub fn add_emission(
        &self,
        probe: usize,
        emitter: usize,
        radiance: [f64; 3],
        with_direct: bool,
        rows: &mut [[f64; 3]],
    ) {
        let count = 3 * self.degree.rows();
        let columns = [Some(&self.indirect), with_direct.then_some(&self.direct)];
        for column in columns.into_iter().flatten() {
            let column = &column[(probe * self.emitters + emitter) * count..][..count];
            for (row, column) in rows.iter_mut().zip(column.as_chunks::<3>().0) {
                (0..3).for_each(|channel| row[channel] += radiance[channel] * f64::from(column[channel]));
            }
        }
    }
}
