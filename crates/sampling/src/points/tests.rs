use super::*;

fn hammersley(count: u32) -> Points<'static> {
    Points::Hammersley { count: NonZeroU32::new(count).unwrap() }
}

fn all(set: Points<'_>, first: u64, count: usize) -> Vec<[f32; 2]> {
    let mut points = vec![[f32::NAN; 2]; count];
    set.fill(first, &mut points);
    points
}

const GIVEN: [[f32; 2]; 3] = [[0.1, 0.2], [0.3, 0.4], [0.0, 0.9]];

fn every_set() -> [Points<'static>; 7] {
    [
        Points::Random { seed: 7 },
        Points::Halton,
        hammersley(1000),
        hammersley(u32::MAX),
        Points::Sobol { seed: None },
        Points::Sobol { seed: Some(7) },
        Points::Given(GivenPoints::new(&GIVEN).unwrap()),
    ]
}

#[test]
fn a_batch_holds_the_points_of_its_indices() {
    for set in every_set() {
        for first in [0, 1, 37, 2180, (1 << 32) - 50, 1 << 33, u64::MAX - 200] {
            let points = all(set, first, 131);
            for (i, point) in points.iter().enumerate() {
                assert_eq!(set.get(first.wrapping_add(i as u64)), *point, "{set:?}, {first} + {i}");
            }
            assert_eq!(points[3..100], all(set, first.wrapping_add(3), 97), "{set:?}, {first}");
        }
    }
}

#[test]
fn every_coordinate_is_at_least_0_and_below_1() {
    assert_eq!([unit(0), unit(u32::MAX)], [0.0, 1.0_f32.next_down()]);
    for set in every_set() {
        for first in [0, (1 << 31) - 5000, (1 << 32) - 5000, 3_u64.pow(20) - 5000] {
            let points = all(set, first, 10_000);
            assert!(points.as_flattened().iter().all(|u| (0.0..1.0).contains(u)), "{set:?}, {first}");
        }
    }
    let last = hammersley(u32::MAX).get(u64::from(u32::MAX) - 1);
    assert_eq!(last[0], 1.0_f32.next_down());
}

/// The answers that the authors of Philox publish with their code (Random123, `kat_vectors`).
#[test]
fn random_points_are_those_of_philox_2x32_10() {
    for (counter, seed, expected) in [
        (0, 0, [0xff1d_ae59, 0x6cd1_0df2]),
        (u64::MAX, u32::MAX, [0x2c3f_628b, 0xab4f_d7ad]),
        (0x85a3_08d3_243f_6a88, 0x1319_8a2e, [0xdd7c_e038, 0xf62a_4c12]),
    ] {
        assert_eq!(RandomBlock { seed }.make(counter), expected.map(|bits| [bits]));
    }
}

/// (chi^2 / n)^(1/3) is nearly normal with mean 1 - 2 / (9 n) and variance 2 / (9 n) (Wilson and Hilferty);
/// the result is its distance from the mean in standard deviations.
fn deviation(pairs: impl Iterator<Item = [f32; 2]>) -> f64 {
    const SIDE: usize = 64;
    let mut cells = vec![0_u32; SIDE * SIDE];
    for [x, y] in pairs {
        cells[(y * SIDE as f32) as usize * SIDE + (x * SIDE as f32) as usize] += 1;
    }
    let expected = f64::from(cells.iter().sum::<u32>()) / cells.len() as f64;
    let chi_square: f64 = cells.iter().map(|cell| (f64::from(*cell) - expected).powi(2) / expected).sum();
    let free = (cells.len() - 1) as f64;
    let spread = 2.0 / (9.0 * free);
    ((chi_square / free).cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// 16 tests of what is fixed: 4 deviations are passed by chance once in 1000 such lists.
#[test]
fn random_points_are_uniform_and_independent() {
    for seed in [0, 1, 2, u32::MAX] {
        let points = all(Points::Random { seed }, 0, 1_000_000);
        let far = all(Points::Random { seed }, 1 << 40, 1_000_000);
        let next = all(Points::Random { seed: seed.wrapping_add(1) }, 0, 1_000_000);
        for (what, found) in [
            ("points", deviation(points.iter().copied())),
            ("far points", deviation(far.iter().copied())),
            ("neighbours", deviation(points.windows(2).map(|pair| [pair[0][0], pair[1][0]]))),
            ("seeds", deviation(points.iter().zip(&next).map(|(a, b)| [a[0], b[0]]))),
        ] {
            assert!(found.abs() < 4.0, "{what} of seed {seed}: {found}");
        }
    }
    let nets = deviation(all(Points::Sobol { seed: None }, 0, 1 << 20).into_iter());
    assert!(nets < -50.0, "the test notices points that are too even: {nets}");
}

/// v_k = v_(k-1) xor v_(k-1) / 2: the direction numbers of x + 1, Sobol's second polynomial.
#[test]
fn the_second_sobol_coordinate_has_its_direction_numbers() {
    for index in (0..1000).chain([u32::MAX, 0x8000_0001, 0x1234_5678]) {
        let (mut expected, mut direction) = (0, 1_u32 << 31);
        for bit in 0..32 {
            if index >> bit & 1 == 1 {
                expected ^= direction;
            }
            direction ^= direction >> 1;
        }
        assert_eq!(pascal(index).reverse_bits(), expected, "{index}");
    }
}

/// 2^k points from a multiple of 2^k on: one in each rectangle 2^-a x 2^-b, a + b = k.
#[test]
fn sobol_points_fill_every_elementary_interval() {
    for seed in [None, Some(0), Some(1), Some(2), Some(u32::MAX)] {
        for k in 0..=12 {
            for start in [0, 1, 5, (1_u64 << (32 - k)) - 1] {
                let points = all(Points::Sobol { seed }, start << k, 1 << k);
                for a in 0..=k {
                    let mut taken = vec![false; 1 << k];
                    for [x, y] in &points {
                        let column = (x * (1 << a) as f32) as usize;
                        let row = (y * (1 << (k - a)) as f32) as usize;
                        let cell = &mut taken[row << a | column];
                        assert!(!*cell, "{seed:?}: 2^{k} points from {start} 2^{k}, a = {a}");
                        *cell = true;
                    }
                }
            }
        }
    }
}

/// A scrambling that only moved the points together would keep their differences.
#[test]
fn sobol_seeds_scramble_apart() {
    for seed in 0..50 {
        let (a, b) =
            (all(Points::Sobol { seed: Some(seed) }, 0, 64), all(Points::Sobol { seed: None }, 0, 64));
        for axis in 0..2 {
            let shift = |i: usize| (a[i][axis] - b[i][axis]).rem_euclid(1.0);
            assert!((1..64).any(|i| (shift(i) - shift(0)).abs() > 0.01), "seed {seed}, axis {axis}");
        }
    }
    // Of each coordinate of one index, over seeds.
    let at = |seed: u32| Points::Sobol { seed: Some(seed) }.get(12_345);
    let found = deviation((0..400_000).map(at));
    assert!(found.abs() < 4.0, "{found}");
}

/// The radical inverse by its definition, as an integer over base^digits.
fn radical_inverse(index: u64, base: u64) -> f64 {
    let (mut rest, mut mirrored, mut power) = (index, 0, 1_u64);
    while rest > 0 {
        mirrored = base * mirrored + rest % base;
        rest /= base;
        power *= base;
    }
    mirrored as f64 / power as f64
}

#[test]
fn halton_points_are_radical_inverses_rounded_down() {
    for first in [0, 2180, 6_000_000, (1 << 32) - 400] {
        for (i, point) in all(Points::Halton, first, 400).into_iter().enumerate() {
            for (base, u) in [2, 3].into_iter().zip(point) {
                let below = radical_inverse(first + i as u64, base) - f64::from(u);
                // 24 bits, and twice 32 bits in base 3.
                assert!((0.0..6.02e-8).contains(&below), "{first} + {i}, base {base}: {below:e}");
            }
        }
    }
}

/// 2^a 3^b points in sequence: one in each rectangle of 2^-a x 3^-b.
#[test]
fn halton_points_fill_every_elementary_interval() {
    for (a, b) in [(0, 7), (5, 3), (11, 0), (3, 5), (6, 4)] {
        let (columns, rows) = (1_usize << a, 3_usize.pow(b));
        for first in [0, 1000] {
            let mut taken = vec![false; columns * rows];
            for [x, y] in all(Points::Halton, first, columns * rows) {
                // Rounded down, thirds lie just below themselves.
                let row = ((f64::from(y) + 1e-7) * rows as f64) as usize;
                let cell = &mut taken[row * columns + (x * columns as f32) as usize];
                assert!(!*cell, "a = {a}, b = {b} from {first}");
                *cell = true;
            }
        }
    }
}

#[test]
fn hammersley_points_are_even_in_x_and_mirrored_in_y() {
    for count in [1, 3, 1000, 4096] {
        let points = all(hammersley(count), 0, count as usize);
        for (i, point) in points.iter().enumerate() {
            let below = i as f64 / f64::from(count) - f64::from(point[0]);
            assert!((0.0..5.97e-8).contains(&below), "{i} of {count}: {below:e}");
            assert_eq!(f64::from(point[1]), radical_inverse(i as u64, 2));
        }
        assert_eq!(all(hammersley(count), u64::from(count) * 3, 7), all(hammersley(count), 0, 7));
    }
}

/// The slope of log(RMS error) against log(N) over N = 2^5 ... 2^14, in the integrals of four smooth
/// functions: the errors of one may change their sign.
fn slope(set: impl Fn(u32, usize) -> Vec<[f32; 2]>) -> f64 {
    const FUNCTIONS: [[f64; 2]; 4] = [[1.0, 2.0], [-1.0, 1.5], [2.0, -0.5], [-1.5, -1.0]];
    const RUNS: u32 = 16;
    let errors = (5..=14).map(|log| {
        let mut squares = 0.0;
        for run in 0..RUNS {
            let points = set(run, 1 << log);
            for [a, b] in FUNCTIONS {
                let values = points.iter().map(|[x, y]| (a * f64::from(*x) + b * f64::from(*y)).exp());
                let integral = (a.exp() - 1.0) / a * (b.exp() - 1.0) / b;
                squares += (values.sum::<f64>() / points.len() as f64 - integral).powi(2);
            }
        }
        (f64::from(log), squares.log2() / 2.0)
    });
    let errors: Vec<_> = errors.collect();
    let mean = |f: fn(&(f64, f64)) -> f64| errors.iter().map(f).sum::<f64>() / errors.len() as f64;
    let (x, y) = (mean(|e| e.0), mean(|e| e.1));
    let above: f64 = errors.iter().map(|e| (e.0 - x) * (e.1 - y)).sum();
    above / errors.iter().map(|e| (e.0 - x).powi(2)).sum::<f64>()
}

/// Nets err by N^-1, scrambled nets by N^-1.5, random points by N^-0.5. Halton's and Hammersley's sets err by
/// log(N) / N, whose slope is that of 1 / N plus 1 / ln(N): 0.15 at the middle of these N.
#[test]
fn errors_of_nets_fall_with_the_number_of_points() {
    let blocks =
        |set: Points<'static>| move |run: u32, count: usize| all(set, u64::from(run) * count as u64, count);
    for (name, slope, expected) in [
        ("random", slope(|seed, count| all(Points::Random { seed }, 0, count)), -0.6..-0.4),
        ("scrambled", slope(|seed, count| all(Points::Sobol { seed: Some(seed) }, 0, count)), -1.6..-1.3),
        ("sobol", slope(blocks(Points::Sobol { seed: None })), -1.1..-0.9),
        ("halton", slope(blocks(Points::Halton)), -1.1..-0.9 + 0.15),
        ("hammersley", slope(|_, count| all(hammersley(count as u32), 0, count)), -1.1..-0.9 + 0.15),
    ] {
        println!("{name}: {slope:.3}");
        assert!(expected.contains(&slope), "{name}: {slope}");
    }
}

#[test]
fn given_points_are_checked_and_repeated() {
    assert_eq!(GivenPoints::new(&[]), Err(GivenPointsError::Empty));
    for bad in [1.0, -0.1, f32::NAN, f32::INFINITY] {
        let error = GivenPoints::new(&[[0.5, 0.5], [0.0, bad]]).unwrap_err();
        assert!(matches!(error, GivenPointsError::Outside { index: 1, .. }), "{error}");
    }
    let set = Points::Given(GivenPoints::new(&GIVEN).unwrap());
    assert_eq!(all(set, 2, 5), [GIVEN[2], GIVEN[0], GIVEN[1], GIVEN[2], GIVEN[0]]);
}
