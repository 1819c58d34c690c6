//! What the integral equations say against plain simulation with fixed seeds: within three standard errors.

use drift_sim::design::{Alternative, Cusum, OneSided, Sprt};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Mean and standard error of `runs` draws.
fn simulated(seed: u64, runs: usize, mut draw: impl FnMut(&mut dyn FnMut() -> f64) -> f64) -> (f64, f64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..runs {
        let value = draw(&mut || StandardNormal.sample(&mut random));
        sum += value;
        squares += value * value;
    }
    let mean = sum / runs as f64;
    (mean, ((squares / runs as f64 - mean * mean) / runs as f64).sqrt())
}

#[track_caller]
fn within_three_errors(what: &str, computed: f64, (mean, error): (f64, f64)) {
    assert!(
        (computed - mean).abs() < 3.0 * error,
        "{what}: computed {computed}, simulated {mean} +- {error}"
    );
}

/// One test: (1 if it ends at the top, decisions).
fn one_test(test: &Sprt, mean: f64, deviation: f64, normal: &mut dyn FnMut() -> f64) -> (f64, f64) {
    let (square, linear, constant) = test.alternative().increment();
    let (mut sum, mut decisions) = (0.0, 0.0);
    loop {
        let z = mean + deviation * normal();
        sum += (square * z + linear) * z + constant;
        decisions += 1.0;
        if sum >= test.upper() {
            return (1.0, decisions);
        } else if sum <= test.lower() {
            return (0.0, decisions);
        }
    }
}

#[test]
fn sprt_outcomes() {
    // The alternative's (mean, deviation): the mean alone, a growth, noise alone, a shrinking.
    for (mean, deviation) in [(1.0, 1.0), (1.0, 1.5), (0.0, 2.0), (0.5, 0.7), (0.3, 1.05)] {
        let test = Sprt::wald(Alternative::new(mean, deviation).unwrap(), 0.05, 0.1).unwrap();
        for (m, d) in [(0.0, 1.0), (mean, deviation), (-0.4, 1.2)] {
            let what = format!("alternative {mean}, {deviation} under {m}, {d}");
            let outcome = test.outcome(m, d);
            let runs = 20_000;
            within_three_errors(&what, outcome.accepts, simulated(11, runs, |n| one_test(&test, m, d, n).0));
            within_three_errors(
                &what,
                outcome.decisions,
                simulated(12, runs, |n| one_test(&test, m, d, n).1),
            );
        }
    }
}

#[test]
fn repeated_sprt_and_its_threshold() {
    for (mean, deviation) in [(1.0, 1.0), (1.0, 1.5)] {
        let alternative = Alternative::new(mean, deviation).unwrap();
        let test = Sprt::repeated_with_arl0(alternative, (0.01f64).ln(), 300.0).unwrap();
        assert!((test.repeated_arl(0.0, 1.0) / 300.0 - 1.0).abs() < 1e-6);
        let until_alarm = |normal: &mut dyn FnMut() -> f64| {
            let mut total = 0.0;
            loop {
                let (accepted, decisions) = one_test(&test, 0.0, 1.0, normal);
                total += decisions;
                if accepted == 1.0 {
                    return total;
                }
            }
        };
        within_three_errors(&format!("{mean}, {deviation}"), 300.0, simulated(13, 10_000, until_alarm));
    }
}

/// The mean-and-deviation test whose deviation hardly differs is the mean test: two methods, one answer.
#[test]
fn the_two_sprt_methods_meet() {
    let of = |deviation| Sprt::wald(Alternative::new(1.0, deviation).unwrap(), 0.01, 0.01).unwrap();
    let (linear, above, below) = (of(1.0).outcome(0.2, 1.1), of(1.0001), of(0.9999));
    let middle = 0.5 * (above.outcome(0.2, 1.1).accepts + below.outcome(0.2, 1.1).accepts);
    assert!((middle / linear.accepts - 1.0).abs() < 1e-6, "{middle} {}", linear.accepts);
}

/// Two sides at once, with their head starts and of their own allowance and threshold, run as the code of a monitor does.
#[test]
fn two_sided_cusum_with_unequal_sides_and_head_start() {
    let up = OneSided::new(0.5, 3.5, 0.5).unwrap();
    let down = OneSided::new(0.3, 4.0, 0.25).unwrap();
    let chart = Cusum::asymmetric(up, down).unwrap();
    for mean in [0.0, 0.4, -0.4] {
        let run = |normal: &mut dyn FnMut() -> f64| {
            let (mut high, mut low, mut n) = (0.5 * 3.5, 0.25 * 4.0, 0.0);
            while high <= 3.5 && low <= 4.0 {
                let z = mean + normal();
                high = f64::max(0.0, high + z - 0.5);
                low = f64::max(0.0, low - z - 0.3);
                n += 1.0;
            }
            n
        };
        within_three_errors(&format!("mean {mean}"), chart.arl(mean), simulated(14, 40_000, run));
        let early = |normal: &mut dyn FnMut() -> f64| f64::from(run(normal) <= 20.0);
        let within = chart.run_length(mean).alarm_within(20);
        within_three_errors(&format!("within 20, mean {mean}"), within, simulated(15, 40_000, early));
    }
}

/// Both sides of a repeated SPRT are taken as independent detectors. How wrong is that? Under 3 % here, the truth being known to 1 %.
#[test]
fn two_sided_repeated_sprt_is_near_the_sum_of_its_sides() {
    let alternative = Alternative::new(1.0, 1.0).unwrap();
    let test = Sprt::repeated_with_arl0(alternative, (0.01f64).ln(), 400.0).unwrap();
    let run = |normal: &mut dyn FnMut() -> f64| {
        let (mut high, mut low, mut n) = (0.0, 0.0, 0.0);
        loop {
            let z = normal();
            n += 1.0;
            high += z - 0.5;
            low += -z - 0.5;
            if high >= test.upper() || low >= test.upper() {
                return n;
            }
            high = if high <= test.lower() { 0.0 } else { high };
            low = if low <= test.lower() { 0.0 } else { low };
        }
    };
    let (mean, error) = simulated(16, 20_000, run);
    let computed = test.two_sided_arl(0.0, 1.0);
    println!("two-sided repeated SPRT: computed {computed}, simulated {mean} +- {error}");
    assert!(
        (computed / mean - 1.0).abs() < 0.03 + 3.0 * error / mean,
        "{computed}, simulated {mean} +- {error}"
    );
}
