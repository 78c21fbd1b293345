use sh::Expansion;
use sphere::Direction;

use super::*;
use crate::{Centre, Choice, Material, Microfacet, project};

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

fn microfacet(sigma: f64, f: usize, p: usize) -> BrdfCoefficients {
    let material = Material::Microfacet(Microfacet::new(sigma, [1.0, 0.5, 0.0]).unwrap());
    project(&material, Choice::Degree { f: degree(f), p: degree(p) }, Stop::NEVER).unwrap().coefficients
}

fn nearest(coefficients: &BrdfCoefficients) -> Result<NearestBrdf, NearestBrdfError> {
    nearest_non_negative(coefficients, Mean::Free, Stop::NEVER)
}

/// rho_hat by its definition, as the sum over both signs of q.
fn rho_hat(coefficients: &BrdfCoefficients, incident: Direction, outgoing: Direction) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let [i, o] = [(coefficients.f(), incident), (coefficients.p(), outgoing)].map(|(degree, direction)| {
        let mut rows = vec![0.0; degree.rows()];
        Basis::new(degree).evaluate_into(direction, &mut rows);
        rows
    });
    for l in 0..=coefficients.f().get() {
        for p in 0..=coefficients.p().get() {
            // Y*_lq(w_i) Y_pq(w_o) and the same for -q: the real harmonics of q and -q.
            for q in 0..=l.min(p) {
                let (row_i, row_o) = (l * l + l, p * p + p);
                let mut product = i[row_i + q] * o[row_o + q];
                if q > 0 {
                    product += i[row_i - q] * o[row_o - q];
                }
                let rho = coefficients.get(l, p, q);
                (0..3).for_each(|channel| sum[channel] += rho[channel] * product);
            }
        }
    }
    sum
}

/// The integral of the product of two functions over both directions.
fn product(a: &BrdfCoefficients, b: &BrdfCoefficients) -> f64 {
    let side = a.p().get() + 1;
    let pairs = a.rho().iter().zip(b.rho()).enumerate();
    let both = |index: usize| if index.is_multiple_of(side) { 1.0 } else { 2.0 };
    pairs.map(|(i, (a, b))| both(i) * (0..3).map(|channel| a[channel] * b[channel]).sum::<f64>()).sum()
}

/// Noise of these degrees, with a mean that leaves it some mass.
fn noise(f: usize, p: usize, seed: u64) -> BrdfCoefficients {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let mut rho = vec![[0.0; 3]; (f + 1) * (p + 1) * (p + 1)];
    for l in 0..=f {
        for (outgoing, q) in (0..=p).flat_map(|outgoing| (0..=outgoing.min(l)).map(move |q| (outgoing, q))) {
            rho[(l * (p + 1) + outgoing) * (p + 1) + q] = [0; 3].map(|_| next());
        }
    }
    rho[0] = rho[0].map(|mean| 1.0 + mean.abs());
    BrdfCoefficients::new(Centre::Reflection, degree(f), degree(p), rho).unwrap()
}

/// The least and the largest value on a grid of three times as many samples along each angle as the search
/// has; from 300 of the lowest places, downhill by ever shorter steps.
fn brute_force(coefficients: &BrdfCoefficients) -> [f64; 2] {
    let search = Search::with_samples(coefficients, 3 * SAMPLES);
    let [_, outgoing, turns] = search.counts;
    let mut found = [f64::INFINITY, f64::NEG_INFINITY];
    for channel in 0..3 {
        let x = search.unknowns(coefficients, channel);
        let values = search.grid(&x);
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        found[1] = values.iter().copied().fold(found[1], f64::max);
        for &i in order.iter().step_by(7).take(300) {
            let [a, b, c] = [i / (outgoing * turns), i / turns % outgoing, i % turns];
            let [si, so, sphi] = search.spacing;
            let mut place = [(a as f64 + 0.5) * si, (b as f64 + 0.5) * so, c as f64 * sphi];
            let (mut least, mut step) = (values[i], 1.0);
            while step > 1e-4 {
                let mut moved = false;
                for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
                    let mut other = place;
                    other[axis] += sign * step * search.spacing[axis];
                    let value = search.value(&x, other);
                    if value < least {
                        (place, least, moved) = (other, value, true);
                    }
                }
                if !moved {
                    step /= 2.0;
                }
            }
            found[0] = found[0].min(least);
        }
    }
    found
}

/// From the places that are the lowest among their neighbours alone, bottoms of -1e-5 to -1e-3 of the largest
/// value would be missed in most of these.
#[test]
fn no_valley_is_missed() {
    let functions = |(f, p)| [noise(f, p, 1), noise(f, p, 2), microfacet(0.15, f, p), microfacet(0.3, f, p)];
    std::thread::scope(|scope| {
        for given in [(7, 7), (5, 5), (9, 3), (3, 9)].into_iter().flat_map(functions) {
            scope.spawn(move || {
                let degrees = [given.f().get(), given.p().get()];
                let found = nearest(&given).unwrap();
                let [least, largest] = brute_force(&found.coefficients);
                assert!(least > -1e-8 * largest, "{degrees:?}: {:e} of the largest", least / largest);
                let [before, _] = brute_force(&given);
                assert!(found.before < before + 1e-8 * largest, "{degrees:?}: {} {before}", found.before);
            });
        }
    });
}

/// The nearest to a function of one angle is a function of one angle.
#[test]
fn without_a_view_it_is_the_nearest_function_on_the_sphere() {
    let u = |l: usize| [1.0, 0.3, 0.0].map(|scale| scale * ((2 * l + 1) as f64).sqrt());
    for f in [3, 8] {
        let given = BrdfCoefficients::new(Centre::Reflection, degree(f), degree(0), (0..=f).map(u).collect());
        let found = nearest(&given.unwrap()).unwrap();
        let mut expansion = Expansion::zero(degree(f));
        (0..=f).for_each(|l| expansion.coefficients_mut()[l * l + l] = u(l));
        let expected = sh::nearest_non_negative(&expansion, Mean::Free, Stop::NEVER).unwrap();
        assert!((found.change - expected.change).abs() < 1e-5, "{} {}", found.change, expected.change);
        for l in 0..=f {
            let (ours, theirs) = (found.coefficients.get(l, 0, 0), expected.expansion.get(l, 0));
            // Distances from f agree to 1e-6, so functions agree to the root of that.
            assert!((0..3).all(|c| (ours[c] - theirs[c]).abs() < 5e-3), "{l}: {ours:?} {theirs:?}");
        }
    }
}

#[test]
fn a_lobe_that_rings_is_nowhere_negative_and_close() {
    for (f, p) in [(5, 2), (9, 3), (7, 7)] {
        let given = microfacet(0.3, f, p);
        let found = nearest(&given).unwrap();
        let g = &found.coefficients;
        assert!(found.before < 0.0 && found.after >= 0.0, "{found:?}");
        let (mut least, mut least_before) = (f64::INFINITY, f64::INFINITY);
        let mut largest: f64 = 0.0;
        for i in 0..4000 {
            let i = f64::from(i);
            let angles = [0.618_034, 0.754_878, 0.569_840].map(|step| (i * step).fract() * PI);
            let incident = Direction::from_angles(angles[0], 0.3 + 2.0 * angles[2]);
            let outgoing = Direction::from_angles(angles[1], 0.3);
            let value = rho_hat(g, incident, outgoing);
            least = least.min(value[0]).min(value[1]);
            largest = largest.max(value[0]);
            least_before = least_before.min(rho_hat(&given, incident, outgoing)[0]);
            assert_eq!(value[2], 0.0, "black stays black");
        }
        assert!(least > -1e-8 * largest && least_before < -1e-3 * largest, "{f} {p}: {least} {least_before}");
        assert!(least_before >= found.before, "{f} {p}: {least_before} {}", found.before);
        // The projection onto a convex cone: (f - g) g = 0, and (f - g) h <= 0 for every h of the cone, such
        // as the nearest to another function.
        let size = product(&given, &given);
        assert!((product(&given, g) - product(g, g)).abs() < 1e-5 * size, "{f} {p}");
        let h = nearest(&microfacet(0.6, f, p)).unwrap().coefficients;
        assert!(product(&given, &h) - product(g, &h) < 1e-5 * size, "{f} {p}");
        let told = (size - 2.0 * product(&given, g) + product(g, g)).sqrt() / size.sqrt();
        assert!((told - found.change).abs() < 1e-6 && told < 0.3, "{f} {p}: {told} {}", found.change);
    }
}

#[test]
fn the_mean_can_be_kept() {
    let given = microfacet(0.3, 9, 3);
    let [free, kept] =
        [Mean::Free, Mean::Kept].map(|mean| nearest_non_negative(&given, mean, Stop::NEVER).unwrap());
    let mean = |found: &BrdfCoefficients| found.get(0, 0, 0);
    assert_eq!(mean(&kept.coefficients), mean(&given));
    assert!(mean(&free.coefficients)[0] > mean(&given)[0], "a free mean rises");
    assert!(
        kept.after >= 0.0 && kept.change > free.change && kept.change < 0.3,
        "{} {}",
        kept.change,
        free.change
    );
    let mut least = f64::INFINITY;
    for i in 0..4000 {
        let angles = [0.618_034, 0.754_878, 0.569_840].map(|step| (f64::from(i) * step).fract() * PI);
        let incident = Direction::from_angles(angles[0], 2.0 * angles[2]);
        least = least.min(rho_hat(&kept.coefficients, incident, Direction::from_angles(angles[1], 0.0))[0]);
    }
    assert!(least > -1e-7, "{least}");
    let negative = vec![[-0.1; 3], [1.0; 3]];
    let negative = BrdfCoefficients::new(Centre::Normal, degree(1), degree(0), negative).unwrap();
    let error = nearest_non_negative(&negative, Mean::Kept, Stop::NEVER).unwrap_err();
    assert!(matches!(error, NearestBrdfError::NoPositiveMean { channel: 0, .. }), "{error}");
}

#[test]
fn functions_without_a_useful_neighbour_are_errors() {
    let rho = |value: f64| vec![[value; 3]; 1];
    let constant = |value| BrdfCoefficients::new(Centre::Normal, degree(0), degree(0), rho(value)).unwrap();
    assert_eq!(nearest(&constant(-1.0)), Err(NearestBrdfError::NoMass { channel: 0 }));
    assert_eq!(nearest(&constant(0.0)).unwrap().change, 0.0);
    let found = nearest(&constant(2.0)).unwrap();
    assert_eq!((found.coefficients, found.change), (constant(2.0), 0.0));
    let many =
        BrdfCoefficients::new(Centre::Normal, degree(40), degree(9), vec![[0.0; 3]; 41 * 100]).unwrap();
    assert!(matches!(nearest(&many), Err(NearestBrdfError::TooMany { f: 40, p: 9, .. })));
    let stopped = nearest_non_negative(&microfacet(0.3, 3, 1), Mean::Free, Stop::when(&|| true));
    assert_eq!(stopped, Err(Stopped.into()));
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let given = microfacet(0.3, 5, 2);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| nearest(&given).unwrap())
    };
    assert_eq!(with(1), with(3));
}
