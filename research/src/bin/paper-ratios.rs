//! Prints [RH02, tabs. 4 and 5] beside what this machine measures, all in one run.
//!
//! `cargo run --release --manifest-path research/Cargo.toml --bin paper-ratios`

use std::time::Instant;

use research::paper::{TABLE4, TABLE5, Table4, Table5, difference};

/// The least seconds of some runs, after one to warm up; at least five, and until half a second has gone.
fn seconds<T>(mut run: impl FnMut() -> T) -> f64 {
    std::hint::black_box(run());
    let (mut least, begun, mut runs) = (f64::INFINITY, Instant::now(), 0);
    while runs < 5 || begun.elapsed().as_secs_f64() < 0.5 {
        let start = Instant::now();
        std::hint::black_box(run());
        least = least.min(start.elapsed().as_secs_f64());
        runs += 1;
    }
    least
}

fn main() {
    println!("Table 4: phong, 128 x 128; milliseconds");
    println!(
        "{:>4} {:>4} {:>10} {:>10} {:>8} {:>8} {:>11}",
        "s", "F", "angular", "frequency", "ratio", "paper's", "difference"
    );
    for row in TABLE4 {
        let case = Table4::new(row.s);
        let (angular, frequency) = (seconds(|| case.angular()), seconds(|| case.frequency()));
        println!(
            "{:>4} {:>4} {:>10.3} {:>10.3} {:>8.1} {:>8.1} {:>11.4}",
            row.s,
            case.degree(),
            1e3 * angular,
            1e3 * frequency,
            angular / frequency,
            row.angular / row.frequency,
            difference(&case.angular(), &case.frequency()),
        );
    }

    println!();
    println!("Table 5: microfacet, 128 x 128, 100 maps; milliseconds");
    println!(
        "{:>5} {:>8} {:>10} {:>10} {:>10} {:>8} {:>8} {:>11}",
        "sigma", "[F, P]", "100 x ang.", "SHRM", "+ maps", "ratio", "paper's", "difference"
    );
    for row in TABLE5 {
        let case = Table5::new(row.sigma);
        let shrm = case.shrm();
        let maps = case.maps(&shrm);
        let view = 35;
        let toward = maps.views().directions()[view];
        let angular = 100.0 * seconds(|| case.angular(toward));
        let (to_shrm, to_maps) = (seconds(|| case.shrm()), seconds(|| case.maps(&shrm)));
        println!(
            "{:>5} {:>8} {:>10.1} {:>10.3} {:>10.3} {:>8.1} {:>8.1} {:>11.4}",
            row.sigma,
            format!("{:?}", case.degrees()),
            1e3 * angular,
            1e3 * to_shrm,
            1e3 * (to_shrm + to_maps),
            angular / (to_shrm + to_maps),
            100.0 * row.angular / row.frequency,
            difference(&case.angular(toward), maps.map(view)),
        );
    }
}
