//! Pictures of both renderers, and how far they are apart.
//!
//! `SPECULA_PICTURES` may name a folder in which they are kept: the CPU's, the device's, and forty times their difference.

use std::collections::BTreeMap;

use preview::{Cpu, Gpu, Picture, RenderError, Renderer, Scene, Shot, Tolerance};

/// Both renderers, and what was found so far.
pub(crate) struct Compared {
    test: &'static str,
    cpu: Cpu,
    gpu: Gpu,
    worst: BTreeMap<String, Apart>,
    wrong: Vec<String>,
}

/// How far two pictures are apart.
#[derive(Clone, Copy, Debug, Default)]
struct Apart {
    /// The share of pixels whose codes differ by more than is allowed.
    outliers: f64,
    /// The relative RMS of radiance, over the others.
    relative_rms: f64,
    /// The largest difference of a code, over the others.
    codes: u8,
}

impl Compared {
    /// `None`, told aloud, where there is no graphics adapter.
    pub(crate) fn new(test: &'static str) -> Option<Self> {
        if Gpu::adapters().is_empty() {
            test_data::skip(test, "there is no graphics adapter here");
            return None;
        }
        let gpu = Gpu::new().unwrap_or_else(|error| panic!("{test}: {error}"));
        Some(Self { test, cpu: Cpu::new(), gpu, worst: BTreeMap::new(), wrong: Vec::new() })
    }

    /// The picture of each renderer.
    pub(crate) fn both(&mut self, scene: &Scene, shot: &Shot) -> [Result<Picture, RenderError>; 2] {
        [self.cpu.render(scene, shot, &|| false), self.gpu.render(scene, shot, &|| false)]
    }

    /// Compares the pictures of a scene; the worst figures of each kind are told by [`Compared::judge`].
    pub(crate) fn add(&mut self, kind: &str, case: &str, scene: &Scene, shot: &Shot) {
        let name = format!("{kind} {case}");
        let [cpu, gpu] =
            self.both(scene, shot).map(|made| made.unwrap_or_else(|error| panic!("{name}: {error}")));
        assert_eq!((cpu.size, cpu.codes.len()), (gpu.size, gpu.codes.len()), "{name}");
        if let Some(folder) = std::env::var_os("SPECULA_PICTURES") {
            keep(std::path::Path::new(&folder), &name.trim().replace([' ', ','], "-"), &cpu, &gpu);
        }
        let allowed = Tolerance::of(shot.show);
        let apart = Apart::of(&cpu, &gpu, allowed);
        let worst = self.worst.entry(kind.to_owned()).or_default();
        worst.outliers = worst.outliers.max(apart.outliers);
        worst.relative_rms = worst.relative_rms.max(apart.relative_rms);
        worst.codes = worst.codes.max(apart.codes);
        let far = apart.outliers > allowed.outliers || apart.relative_rms > allowed.relative_rms;
        // Outlines are in the figure too.
        let figures = match (cpu.relative_rms, gpu.relative_rms) {
            (Some(cpu), Some(gpu)) => (cpu - gpu).abs() <= allowed.relative_rms * cpu.max(1e-3),
            (cpu, gpu) => cpu == gpu,
        };
        if far || !figures {
            let rms = [cpu.relative_rms, gpu.relative_rms];
            self.wrong.push(format!("{name}: {apart:?}, relative RMS {rms:?}"));
        }
    }

    /// Tells the worst figures.
    ///
    /// # Panics
    /// Where two pictures were not the same.
    pub(crate) fn judge(self) {
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
        assert!(!self.worst.is_empty(), "something was compared");
    }
}

impl Apart {
    fn of(cpu: &Picture, gpu: &Picture, allowed: Tolerance) -> Self {
        let (mut counted, mut most, mut square, mut difference) = (0, 0, 0.0, 0.0);
        for k in 0..cpu.codes.len() {
            let codes = (0..3).map(|channel| cpu.codes[k][channel].abs_diff(gpu.codes[k][channel])).max();
            let codes = codes.unwrap_or_default();
            // More than an eighth of a pixel's samples see a surface in one picture and not in the other: an outline.
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

/// Both pictures and where they differ, side by side.
fn keep(folder: &std::path::Path, name: &str, cpu: &Picture, gpu: &Picture) {
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
