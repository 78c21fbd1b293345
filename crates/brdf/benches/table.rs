//! The time of a BRDF table. The goal for an Ashikhmin-Shirley table of 128 x 128 views is 3 s on two cores.

#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark may panic")]

use brdf::{AshikhminShirley, Material, PoulinFournier, Ward, tabulate};
use criterion::{Criterion, criterion_group, criterion_main};
use sh::Degree;

fn tables(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("table");
    group.sample_size(10);
    let metal = AshikhminShirley::new([24.0, 8.0], [0.0; 3], [0.9; 3]).unwrap();
    let brushed = Ward::new([0.15, 0.45], [1.0; 3]).unwrap();
    let satin = PoulinFournier::new(20.0, [0.3; 3], [0.7; 3], 2.0, 1.0).unwrap();
    let materials = [
        ("ashikhmin-shirley", Material::AshikhminShirley(metal)),
        ("ward", Material::Ward(brushed)),
        ("poulin-fournier", Material::PoulinFournier(satin)),
    ];
    for (name, material) in &materials {
        for degree in [4, 14] {
            let degree = Degree::new(degree).unwrap();
            group.bench_function(format!("{name}/{}", degree.get()), |bencher| {
                bencher.iter(|| tabulate(material, degree, 128).unwrap());
            });
        }
    }
    group.finish();
}

criterion_group!(benches, tables);
criterion_main!(benches);
