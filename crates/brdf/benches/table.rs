//! `table`: the time of a BRDF table. The goal for an Ashikhmin-Shirley table of 128 x 128 views is 3 s on
//! two cores. `checks`: the albedos and the reciprocity of a material, which each import of one computes.
//! `projection`: its coefficients at degrees that are cut later, for a light.

#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark may panic")]

use brdf::{
    AshikhminShirley, Choice, Material, MeasuredAnisotropic, PoulinFournier, Standard, StandardParameters,
    Ward, checks, from_half_and_difference, project, tabulate,
};
use criterion::{Criterion, criterion_group, criterion_main};
use sh::{Degree, Stop};

/// A brushed metal as it is after measuring.
fn measured(metal: &Material) -> Material {
    let shape @ [_, n_phi, n_d, n_psi] = [36, 48, 24, 12];
    let value = |entry: usize| {
        let (row, m) = (entry / n_psi, entry % n_psi);
        let place = [row / n_d / n_phi, row / n_d % n_phi, row % n_d, m];
        let [light, view] = from_half_and_difference(MeasuredAnisotropic::node(shape, place));
        let rho_hat = metal.rho_hat(light, view);
        rho_hat.map(|value| (value / light.vector().z.max(1e-3)).min(100.0) as f32)
    };
    let values = (0..shape.iter().product()).map(value).collect();
    Material::MeasuredAnisotropic(MeasuredAnisotropic::new(shape, values).unwrap())
}

fn tables(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("table");
    group.sample_size(10);
    let metal = AshikhminShirley::new([24.0, 8.0], [0.0; 3], [0.9; 3]).unwrap();
    let brushed = Ward::new([0.15, 0.45], [1.0; 3]).unwrap();
    let satin = PoulinFournier::new(20.0, [0.3; 3], [0.7; 3], 2.0, 1.0).unwrap();
    let brushed = Material::Ward(brushed);
    let materials = [
        ("measured-anisotropic", measured(&brushed)),
        ("ashikhmin-shirley", Material::AshikhminShirley(metal)),
        ("ward", brushed),
        ("poulin-fournier", Material::PoulinFournier(satin)),
    ];
    for (name, material) in &materials {
        for degree in [4, 14] {
            let degree = Degree::new(degree).unwrap();
            group.bench_function(format!("{name}/{}", degree.get()), |bencher| {
                bencher.iter(|| tabulate(material, degree, 128, Stop::NEVER).unwrap());
            });
        }
    }
    group.finish();
}

fn one_material(criterion: &mut Criterion) {
    let gold = StandardParameters {
        base_color: [1.0, 0.77, 0.34],
        metallic: 1.0,
        roughness: 0.3,
        ..StandardParameters::default()
    };
    let gold = Material::Standard(Standard::new(gold).unwrap());
    criterion.bench_function("checks/standard", |bencher| bencher.iter(|| checks(&gold)));
    criterion.bench_function("projection/standard", |bencher| {
        bencher.iter(|| project(&gold, Choice::Full, Stop::NEVER).unwrap());
    });
}

criterion_group!(benches, tables, one_material);
criterion_main!(benches);
