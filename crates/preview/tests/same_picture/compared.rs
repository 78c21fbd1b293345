//! Compares pictures of both renderers.
//!
//! If `SPECULA_PICTURES` names a folder, the pictures are saved there: the CPU's, the device's, and forty
//! times their difference.

use std::collections::BTreeMap;

use preview::{Cpu, Gpu, Picture, RenderError, Renderer, Scene, Shot, Tolerance};
use sh::Stop;

/// Both renderers, and the results so far.
pub(crate) struct Compared {
    test: &'static str,
    cpu: Cpu,
    gpu: Gpu,
    worst: BTreeMap<String, Apart>,
    wrong: Vec<String>,
}

/// The difference of two pictures.
#[derive(Clone, Copy, Debug, Default)]
struct Apart {
    /// The share of pixels whose codes differ by more than the tolerance.
    outliers: f64,
    /// The relative RMS of radiance over the other pixels.
    relative_rms: f64,
    /// The largest difference of a code over the other pixels.
    codes: u8,
}

impl Compared {
    /// Without a graphics adapter, `None` and a message.
    pub(crate) fn new(test: &'static str) -> Option<Self> {
        if Gpu::adapters().is_empty() {
            test_data::skip(test, "there is no graphics adapter");
            return None;
        }
        let gpu = Gpu::new().unwrap_or_else(|error| panic!("{test}: {error}"));
        Some(Self { test, cpu: Cpu::new(), gpu, worst: BTreeMap::new(), wrong: Vec::new() })
    }

    /// The picture of each renderer.
    pub(crate) fn both(&mut self, scene: &Scene, shot: &Shot) -> [Result<Picture, RenderError>; 2] {
        [self.cpu.render(scene, shot, Stop::NEVER), self.gpu.render(scene, shot, Stop::NEVER)]
    }

    /// Compares the pictures of a scene. [`Compared::finish`] reports the largest differences of each kind.
    pub(crate) fn add(&mut self, kind: &str, case: &str, scene: &Scene, shot: &Shot) {
        let name = format!("{kind} {case}");
        let [cpu, gpu] =
            self.both(scene, shot).map(|made| made.unwrap_or_else(|error| panic!("{name}: {error}")));
        assert_eq!((cpu.size, cpu.codes.len()), (gpu.size, gpu.codes.len()), "{name}");
        if let Some(folder) = std::env::var_os("SPECULA_PICTURES") {
            save(std::path::Path::new(&folder), &name.trim().replace([' ', ','], "-"), &cpu, &gpu);
        }
        let allowed = Tolerance::of(shot.show);
        let apart = Apart::of(&cpu, &gpu, allowed);
        let worst = self.worst.entry(kind.to_owned()).or_default();
        worst.outliers = worst.outliers.max(apart.outliers);
        worst.relative_rms = worst.relative_rms.max(apart.relative_rms);
        worst.codes = worst.codes.max(apart.codes);
        let far = apart.outliers > allowed.outliers || apart.relative_rms > allowed.relative_rms;
        // The RMS includes the outlines.
        let same_rms = match (cpu.relative_rms, gpu.relative_rms) {
            (Some(cpu), Some(gpu)) => (cpu - gpu).abs() <= allowed.relative_rms * cpu.max(1e-3),
            (cpu, gpu) => cpu == gpu,
        };
        if far || !same_rms {
            let rms = [cpu.relative_rms, gpu.relative_rms];
            self.wrong.push(format!("{name}: {apart:?}, relative RMS {rms:?}"));
        }
    }

    /// Reports the largest differences.
    ///
    /// # Panics
    /// If two pictures differ by more than their tolerance.
    pub(crate) fn finish(self) {
        eprintln!("{}, {} against the CPU:", self.test, self.gpu.name());
        eprintln!("{:>30} {:>10} {:>6} {:>10}", "", "outliers", "codes", "RMS");
        for (kind, Apart { outliers, relative_rms, codes }) in &self.worst {
            eprintln!("{kind:>30} {outliers:>10.5} {codes:>6} {relative_rms:>10.1e}");
        }
        assert!(
            self.wrong.is_empty(),
            "{} of the pictures differ:\n{}",
            self.wrong.len(),
            self.wrong.join("\n")
        );
        assert!(!self.worst.is_empty(), "no pictures were compared");
    }
}

impl Apart {
    fn of(cpu: &Picture, gpu: &Picture, allowed: Tolerance) -> Self {
        let (mut counted, mut most, mut square, mut difference) = (0, 0, 0.0, 0.0);
        for k in 0..cpu.codes.len() {
            let codes = (0..3).map(|channel| cpu.codes[k][channel].abs_diff(gpu.codes[k][channel])).max();
            let codes = codes.unwrap_or_default();
            // On an outline, over an eighth of a pixel's samples hit a surface in only one of the pictures.
            let outline = (cpu.radiance[k][3] - gpu.radiance[k][3]).abs() > 0.125;
            if codes > allowed.codes || outline {
                counted += 1;
                continue;
            }
            most = most.max(codes);
            for channel in 0..3 {
                let (a, b) = (f64::from(cpu.radiance[k][channel]), f64::from(gpu.radiance[k][channel]));
                assert!(b.is_finite(), "{b} at {k}");
                square += a * a;
                difference += (a - b) * (a - b);
            }
        }
        let relative_rms = if difference == 0.0 { 0.0 } else { (difference / square).sqrt() };
        Self { outliers: f64::from(counted) / cpu.codes.len() as f64, relative_rms, codes: most }
    }
}

/// Saves both pictures and their difference, side by side.
fn save(folder: &std::path::Path, name: &str, cpu: &Picture, gpu: &Picture) {
    let [width, height] = cpu.size.map(|side| side as usize);
    let mut codes = Vec::new();
    for row in 0..height {
        let row = row * width..(row + 1) * width;
        codes.extend_from_slice(&cpu.codes[row.clone()]);
        codes.extend_from_slice(&gpu.codes[row.clone()]);
        codes.extend(row.map(|k| {
            [0, 1, 2].map(|channel| cpu.codes[k][channel].abs_diff(gpu.codes[k][channel]).saturating_mul(40))
        }));
    }
    let bytes = containers::write_png(3 * width, height, &codes, None);
    std::fs::write(folder.join(format!("{name}.png")), bytes.unwrap()).unwrap();
}
