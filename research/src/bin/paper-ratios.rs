//! Prints [RH02, tabs. 4 and 5] beside what this machine measures, all in one run: the medians of kernels
//! that take turns. `paper-builds` has the stages of a build.
//!
//! `cargo run --release --manifest-path research/Cargo.toml --bin paper-ratios`

use research::paper::{GRID, TABLE4, TABLE5, Table4, Table5, difference};
use research::turns::{median_seconds, run};

fn main() {
    println!("Table 4: phong, 128 x 128; milliseconds of processor time");
    println!(
        "{:>4} {:>4} {:>10} {:>10} {:>8} {:>8} {:>11}",
        "s", "F", "angular", "frequency", "ratio", "paper's", "difference"
    );
    for row in TABLE4 {
        let case = Table4::new(row.s);
        let seconds = median_seconds(&mut [run(|| case.angular()), run(|| case.frequency())]);
        let (angular, frequency) = (seconds[0], seconds[1]);
        println!(
            "{:>4} {:>4} {:>10.3} {:>10.3} {:>8.1} {:>8.1} {:>11.4}",
            row.s,
            case.degree(),
            1e3 * angular,
            1e3 * frequency,
            angular / frequency,
            row.angular / row.frequency,
            difference(GRID, &case.angular(), &case.frequency()),
        );
    }

    println!();
    println!("Table 5: microfacet, 128 x 128, 100 maps; milliseconds of processor time");
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
        let seconds = median_seconds(&mut [
            run(|| case.angular(toward)),
            run(|| case.shrm()),
            run(|| case.maps(&shrm)),
        ]);
        let (angular, to_shrm, to_maps) = (100.0 * seconds[0], seconds[1], seconds[2]);
        println!(
            "{:>5} {:>8} {:>10.1} {:>10.3} {:>10.3} {:>8.1} {:>8.1} {:>11.4}",
            row.sigma,
            format!("{:?}", case.degrees()),
            1e3 * angular,
            1e3 * to_shrm,
            1e3 * (to_shrm + to_maps),
            angular / (to_shrm + to_maps),
            100.0 * row.angular / row.frequency,
            difference(GRID, &case.angular(toward), maps.map(view)),
        );
    }
}
