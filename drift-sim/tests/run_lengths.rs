//! Run lengths and thresholds against published tables. "Exact" columns were computed by an independent program to the digits given;
//! published ones are rounded by their authors.

use approx::assert_relative_eq;
use drift_sim::design::{Alternative, Cusum, EstimatedBaseline, OneSided, Shewhart, Sprt, siegmund};

#[track_caller]
fn agrees(what: &str, ours: f64, published: f64, relative: f64) {
    assert!((ours / published - 1.0).abs() < relative, "{what}: ours {ours:.12}, published {published}");
}

fn two_sided(k: f64, h: f64, head_start: f64) -> Cusum {
    Cusum::new(k, h, head_start).unwrap()
}

fn one_sided(k: f64, h: f64) -> OneSided {
    OneSided::new(k, h, 0.0).unwrap()
}

/// Lucas & Crosier 1982, Table 1, k = 0.5: mu; h = 4 published, exact; the same with head start h/2;
/// h = 5 exact without and with head start h/2.
const LUCAS_CROSIER: [[f64; 7]; 11] = [
    [0.0, 168.0, 167.6837888, 149.0, 148.69565, 465.443506, 430.3908392],
    [0.25, 74.2, 74.22402789, 62.7, 62.69824123, 139.4936898, 121.6879446],
    [0.5, 26.6, 26.63020309, 20.1, 20.06396194, 37.99614319, 28.66583019],
    [0.75, 13.3, 13.28508838, 8.97, 8.967975015, 17.04832594, 11.23582641],
    [1.0, 8.38, 8.38313187, 5.29, 5.286886215, 10.37596992, 6.346850468],
    [1.5, 4.75, 4.747168199, 2.86, 2.862038547, 5.747217703, 3.371950033],
    [2.0, 3.34, 3.342770129, 2.01, 2.01437489, 4.008871061, 2.362290941],
    [2.5, 2.62, 2.619518912, 1.59, 1.585807404, 3.113688391, 1.856169304],
    [3.0, 2.19, 2.194480909, 1.32, 1.325393122, 2.573252051, 1.539642545],
    [4.0, 1.71, 1.708457163, 1.07, 1.067000456, 2.012567523, 1.159371153],
    [5.0, 1.31, 1.308740514, 1.01, 1.006210016, 1.693801347, 1.022752227],
];

#[test]
fn two_sided_cusum_with_and_without_head_start_is_lucas_and_crosiers_table() {
    for [mu, plain, plain_exact, fast, fast_exact, h5, h5_fast] in LUCAS_CROSIER {
        let what = format!("mu = {mu}");
        agrees(&what, two_sided(0.5, 4.0, 0.0).arl(mu), plain_exact, 5e-10);
        agrees(&what, two_sided(0.5, 4.0, 0.5).arl(mu), fast_exact, 2e-9);
        agrees(&what, two_sided(0.5, 5.0, 0.0).arl(mu), h5, 5e-10);
        agrees(&what, two_sided(0.5, 5.0, 0.5).arl(mu), h5_fast, 5e-10);
        agrees(&what, two_sided(0.5, 4.0, 0.0).arl(-mu), plain, 5e-3);
        agrees(&what, two_sided(0.5, 4.0, 0.5).arl(-mu), fast, 5e-3);
    }
}

#[test]
fn one_sided_cusum_is_the_known_table() {
    let table = [
        (1.0, 11.20885639, 2.631963875),
        (2.0, 38.54752744, 4.449400642),
        (3.0, 117.5957042, 6.403908893),
        (4.0, 335.3675776, 8.38320213),
        (5.0, 930.8870121, 10.3759753),
        (6.0, 2553.119718, 12.37330789),
        (8.0, 18965.72755, 16.37195986),
        (10.0, 140264.979510015, 20.37177766),
    ];
    for (h, arl0, arl1) in table {
        agrees(&format!("h = {h}, mu = 0"), one_sided(0.5, h).arl(0.0), arl0, 5e-10);
        agrees(&format!("h = {h}, mu = 1"), one_sided(0.5, h).arl(1.0), arl1, 5e-10);
    }
}

#[test]
fn other_authors_cusum_numbers() {
    agrees("Brook & Evans 1972", one_sided(0.5, 3.0).arl(0.0), 117.59, 1e-4);
    agrees("Brook & Evans 1972, mu = 1.5", one_sided(0.5, 3.0).arl(1.5), 3.75, 5e-4);
    let vance = [
        (-0.25, 2071.51),
        (-0.125, 400.28),
        (0.0, 124.66),
        (0.125, 59.30),
        (0.25, 36.71),
        (0.5, 20.37),
        (0.75, 14.06),
        (1.0, 10.75),
    ];
    for (mu, published) in vance {
        agrees(&format!("Vance 1986, mu = {mu}"), one_sided(0.0, 10.0).arl(mu), published, 5e-4);
    }
    for (mu, published) in [(-0.5, 1963.0), (0.0, 117.4), (0.5, 17.35)] {
        agrees(&format!("Waldmann 1986, mu = {mu}"), one_sided(0.5, 3.0).arl(mu), published, 2e-3);
    }
    agrees("SAS/QC", two_sided(0.25, 8.0, 0.0).arl(2.5), 4.1500836225, 1e-7);
    agrees("SAS/QC, head start 0.1", two_sided(0.25, 8.0, 0.1 / 8.0).arl(2.5), 4.1061588131, 1e-7);
}

/// Two-sided h for ARL0 = 100, 200, 370.398, 500, 1000, 5000, 10000.
const THRESHOLDS: [(f64, [f64; 7]); 6] = [
    (0.25, [5.597425, 6.851597, 8.010339, 8.585058, 9.931185, 13.111312, 14.491676]),
    (0.5, [3.502037, 4.171316, 4.774893, 5.070704, 5.757350, 7.360786, 8.053049]),
    (0.75, [2.480964, 2.933172, 3.339685, 3.538425, 3.998593, 5.069566, 5.531363]),
    (1.0, [1.873840, 2.213685, 2.516791, 2.665058, 3.009355, 3.813731, 4.160440]),
    (1.25, [1.457787, 1.740665, 1.986651, 2.105356, 2.378583, 3.015712, 3.292451]),
    (1.5, [1.131104, 1.386717, 1.604473, 1.707979, 1.942410, 2.472955, 2.699976]),
];

#[test]
fn thresholds_for_a_wanted_arl0() {
    // The table's third column is for a Shewhart chart's 1/P(|z| > 3), printed as 370.398.
    let arl0s = [100.0, 200.0, 370.39834737, 500.0, 1000.0, 5000.0, 10000.0];
    for (k, row) in THRESHOLDS {
        for (arl0, h) in arl0s.into_iter().zip(row) {
            let ours = Cusum::with_arl0(k, arl0, 0.0).unwrap();
            let error = (ours.up().h() - h).abs();
            assert!(error < 6e-7, "k = {k}, ARL0 = {arl0}: {} published {h}", ours.up().h());
            assert_relative_eq!(ours.arl(0.0), arl0, max_relative = 1e-11);
        }
    }
    for (arl0, h) in [(500.0, 4.389130), (5000.0, 6.669267), (50000.0, 8.968762)] {
        assert!((OneSided::with_arl0(0.5, arl0, 0.0).unwrap().h() - h).abs() < 6e-7, "ARL0 = {arl0}");
    }
}

#[test]
fn a_threshold_with_head_start_gives_its_arl0() {
    for (k, arl0, head_start) in [(0.5, 465.0, 0.5), (0.1, 1e5, 0.25), (1.0, 1e12, 0.9), (2.0, 30.0, 0.5)] {
        let chart = Cusum::with_arl0(k, arl0, head_start).unwrap();
        assert_relative_eq!(chart.arl(0.0), arl0, max_relative = 1e-10);
    }
}

#[test]
fn impossible_designs_are_refused_in_one_line() {
    let refused = [
        Cusum::with_arl0(0.5, 1.0, 0.0).err(),
        Cusum::with_arl0(0.5, f64::NAN, 0.0).err(),
        Cusum::with_arl0(0.5, 1e300, 0.0).err(),
        Cusum::with_arl0(0.5, 1.4, 0.0).err(),
        Cusum::with_arl0(0.0, 1e9, 0.0).err(),
        Cusum::with_arl0(f64::INFINITY, 500.0, 0.0).err(),
        Cusum::new(-0.5, 5.0, 0.0).err(),
        Cusum::new(0.5, f64::NAN, 0.0).err(),
        Cusum::new(0.5, 5.0, 1.0).err(),
        Cusum::asymmetric(one_sided(0.5, 5.0), one_sided(0.5, 7.0)).err(),
        one_sided(0.5, 5.0).drift_arl(0.0).err().map(|e| e.to_string()).map(drift_sim::Error::new),
    ];
    for (i, error) in refused.into_iter().enumerate() {
        let text = error.unwrap_or_else(|| panic!("number {i} was not refused")).to_string();
        assert!(text.contains("; ") && !text.contains('\n'), "{text}");
    }
}

/// The tail of a huge run length keeps its digits: the mean found by carrying the density forward agrees.
#[test]
fn huge_and_tiny_run_lengths_agree_by_two_roads() {
    for (k, h, mean) in
        [(0.5, 27.0, 0.0), (1.0, 14.0, 0.0), (0.5, 5.0, 0.0), (0.5, 0.01, 5.0), (3.0, 5.0, 0.0)]
    {
        let chart = two_sided(k, h, 0.0);
        assert_relative_eq!(chart.run_length(mean).mean(), chart.arl(mean), max_relative = 1e-10);
    }
    // The same equation solved with 30-digit arithmetic and 110 nodes.
    assert_relative_eq!(one_sided(0.5, 27.0).arl(0.0), 3388682652048.452, max_relative = 1e-13);
    assert_relative_eq!(two_sided(0.5, 5.0, 0.0).arl(60.0), 1.0, epsilon = 1e-12);
    let chart = two_sided(0.5, 5.0, 0.5);
    for mean in [-1.0, 0.0, 0.25] {
        assert_relative_eq!(chart.run_length(mean).mean(), chart.arl(mean), max_relative = 1e-10);
    }
}

#[test]
fn run_length_quantiles_are_waldmanns() {
    // Waldmann 1986 prints 345, 82, 9 as bounds: the first is one decision short of the exact value.
    let run = one_sided(0.5, 3.0).run_length(0.0);
    assert_eq!([0.95, 0.5, 0.05].map(|p| run.quantile(p)), [346.0, 82.0, 9.0]);
    assert!(run.alarm_within(346) >= 0.95 && run.alarm_within(345) < 0.95);
}

/// "A trap", say users of a default CUSUM: 88 % of healthy streams of 1000 decisions alarm. They do.
#[test]
fn a_textbook_cusum_alarms_in_88_percent_of_healthy_missions_of_1000() {
    let within = two_sided(0.5, 5.0, 0.0).run_length(0.0).alarm_within(1000);
    assert!((within - 0.883).abs() < 0.003, "{within}");
}

/// Gan 1992, Table 1, k = 0.25, h = 8. For a slope of 0.005 the print says 76.3; recomputed it is 77.17.
#[test]
fn linear_drift_is_gans_table() {
    let table = [
        (0.001, 186.79, 187.0),
        (0.002, 129.22, 129.0),
        (0.005, 77.17, 77.17),
        (0.01, 51.96, 52.0),
        (0.02, 35.20, 35.2),
        (0.05, 21.44, 21.4),
        (0.1, 14.99, 15.0),
        (0.5, 6.95, 6.95),
        (1.0, 5.16, 5.16),
        (3.0, 3.30, 3.30),
    ];
    for (slope, computed, published) in table {
        let ours = one_sided(0.25, 8.0).drift_arl(slope).unwrap();
        assert!((ours - computed).abs() < 0.0051, "slope {slope}: {ours}, computed {computed}");
        agrees(&format!("slope {slope}"), ours, published, 5e-3);
    }
}

/// A very slow drift is hardly one: at decision 118 the mean has moved by 0.0012 sigmas, which takes half a percent.
#[test]
fn a_slow_drift_tends_to_the_in_control_run_length() {
    let side = one_sided(0.5, 3.0);
    let ratio = side.drift_arl(1e-5).unwrap() / side.arl(0.0);
    assert!(ratio < 1.0 && ratio > 0.99, "{ratio}");
}

#[test]
fn shewhart_charts() {
    for (limit, arl0) in [(3.0, 370.3983), (3.09023, 500.0), (3.5, 2149.34), (4.0, 15787.19)] {
        agrees(&format!("limit {limit}"), Shewhart::new(limit, limit).unwrap().arl(0.0), arl0, 1e-5);
        assert!((Shewhart::with_arl0(arl0).unwrap().upper() - limit).abs() < 1e-5);
    }
    let chart = Shewhart::new(3.0, 3.0).unwrap();
    agrees("1 sigma", chart.arl(1.0), 43.89, 2e-4);
    agrees("2 sigma", chart.arl(-2.0), 6.303, 2e-4);
    let uneven = Shewhart::new(2.0, 3.0).unwrap();
    let sides = [2.0, 3.0].map(|limit| Shewhart::new(limit, f64::INFINITY).unwrap().arl(0.0));
    assert_relative_eq!(1.0 / uneven.arl(0.0), 1.0 / sides[0] + 1.0 / sides[1], max_relative = 1e-12);
    assert_relative_eq!(uneven.run_length(0.5).mean(), uneven.arl(0.5), max_relative = 1e-10);
    assert!(Shewhart::new(f64::INFINITY, f64::INFINITY).is_err() && Shewhart::new(f64::NAN, 3.0).is_err());
}

/// Siegmund's closed form is off by what its documentation says, h = 3..8.
#[test]
fn siegmunds_closed_form_is_as_wrong_as_documented() {
    for (mean, least, most) in
        [(0.0, 0.0, 0.009), (0.5, -0.001, 0.001), (1.0, -0.0065, -0.001), (2.0, -0.048, -0.015)]
    {
        for h in 3..=8 {
            let h = f64::from(h);
            let error = siegmund::two_sided_arl(0.5, h, mean) / two_sided(0.5, h, 0.0).arl(mean) - 1.0;
            assert!((least..=most).contains(&error), "mean {mean}, h {h}: {error}");
        }
    }
}

/// CUSUM(0.5, 5) on a first-order autoregression: what the formula promises, and what was simulated (which is never less).
#[test]
fn autocorrelated_residuals_get_less_than_designed_and_the_formula_never_promises_too_much() {
    let table = [
        (0.02, 391.0, 408.0),
        (0.05, 302.0, 334.0),
        (0.10, 202.0, 244.0),
        (0.20, 101.0, 148.0),
        (0.30, 56.0, 97.5),
        (0.50, 21.0, 51.8),
        (0.70, 8.9, 34.1),
        (0.90, 3.2, 28.7),
    ];
    for (rho, formula, simulated) in table {
        let omega_squared = siegmund::omega_squared(rho).unwrap();
        let promised = siegmund::autocorrelated_arl0(0.5, 5.0, omega_squared);
        agrees(&format!("rho = {rho}"), promised, formula, 0.01);
        assert!(promised < simulated);
        let h = siegmund::autocorrelated_threshold(0.5, 465.0, omega_squared).unwrap();
        assert_relative_eq!(siegmund::autocorrelated_arl0(0.5, h, omega_squared), 465.0, max_relative = 1e-9);
    }
}

/// CUSUM(0.5, 5) whose mean and sigma came from m windows: m; 5 %, 10 %, 50 %, 90 % quantile of its ARL0; P(ARL0 < 200).
const ESTIMATED: [(f64, [f64; 4], f64); 7] = [
    (25.0, [37.0, 51.0, 206.0, 1360.0], 0.49),
    (30.0, [44.0, 61.0, 228.0, 1274.0], 0.45),
    (50.0, [72.0, 95.0, 286.0, 1066.0], 0.35),
    (100.0, [126.0, 156.0, 352.0, 881.0], 0.19),
    (200.0, [189.0, 222.0, 398.0, 750.0], 0.07),
    (500.0, [270.0, 299.0, 434.0, 643.0], 0.00),
    (1000.0, [320.0, 344.0, 449.0, 590.0], 0.00),
];

#[test]
fn an_estimated_baseline_gives_the_simulated_distribution_of_arl0() {
    let chart = two_sided(0.5, 5.0, 0.0);
    for (windows, quantiles, below_200) in ESTIMATED {
        let baseline = EstimatedBaseline::independent(windows).unwrap();
        let ours = baseline.probability_below(&chart, 200.0);
        assert!((ours - below_200).abs() < 0.008, "m = {windows}: P(ARL0 < 200) = {ours}");
        // P(ARL0 <= the table's quantile) must be that quantile's probability: the table is a simulation of about 1 %.
        for (p, arl0) in [0.05, 0.1, 0.5, 0.9].into_iter().zip(quantiles) {
            let ours = baseline.probability_below(&chart, arl0);
            assert!((ours - p).abs() < 0.008, "m = {windows}: P(ARL0 < {arl0}) = {ours}, table {p}");
        }
    }
}

#[test]
fn a_guaranteed_threshold_keeps_its_promise_in_the_share_asked_for() {
    let mut last = f64::INFINITY;
    for windows in [50.0, 200.0, 1e6] {
        let baseline = EstimatedBaseline::independent(windows).unwrap();
        let chart = baseline.guaranteed(0.5, 465.0, 0.9, 0.0).unwrap();
        assert_relative_eq!(baseline.arl0_quantile(&chart, 0.1).unwrap(), 465.0, max_relative = 1e-5);
        assert!(chart.up().h() < last, "more windows need less threshold");
        last = chart.up().h();
    }
    let certain = Cusum::with_arl0(0.5, 465.0, 0.0).unwrap().up().h();
    assert!((last / certain - 1.0).abs() < 0.003, "with a million windows it is the plain design");
    let independent =
        EstimatedBaseline::independent(100.0).unwrap().guaranteed(0.5, 465.0, 0.9, 0.0).unwrap();
    let correlated =
        EstimatedBaseline::autocorrelated(100.0, 0.3).unwrap().guaranteed(0.5, 465.0, 0.9, 0.0).unwrap();
    assert!(correlated.up().h() > independent.up().h());
}

#[test]
fn sprt_realises_less_error_than_wald_and_nearly_siegmunds() {
    let alternative = Alternative::new(1.0, 1.0).unwrap();
    // Nominal alpha = beta; realised by Wald's and by Siegmund's thresholds (2e5 simulated tests each).
    for (nominal, wald, siegmund) in [(0.05, 0.0289, 0.0502), (0.01, 0.0056, 0.0101)] {
        let outcome = |test: Sprt, mean| test.outcome(mean, 1.0);
        let (guaranteed, corrected) = (
            Sprt::wald(alternative, nominal, nominal).unwrap(),
            Sprt::siegmund(alternative, nominal, nominal).unwrap(),
        );
        agrees("Wald", outcome(guaranteed, 0.0).accepts, wald, 0.02);
        agrees("Siegmund", outcome(corrected, 0.0).accepts, siegmund, 0.01);
        assert_relative_eq!(
            1.0 - outcome(guaranteed, 1.0).accepts,
            outcome(guaranteed, 0.0).accepts,
            epsilon = 1e-12
        );
        let saved = 1.0 - outcome(corrected, 0.0).decisions / outcome(guaranteed, 0.0).decisions;
        assert!((0.11..0.20).contains(&saved), "{saved}");
    }
    agrees("E N", Sprt::wald(alternative, 0.05, 0.05).unwrap().outcome(0.0, 1.0).decisions, 6.92, 1e-3);
}

/// Brook & Evans 1972: the statistic in `states` cells, as a Markov chain; the run length from (I - R) L = 1.
fn brook_and_evans(k: f64, h: f64, states: usize) -> f64 {
    use statrs::distribution::{ContinuousCDF, Normal};
    let normal = Normal::standard();
    let width = 2.0 * h / (2.0 * states as f64 - 1.0);
    let matrix = nalgebra::DMatrix::from_fn(states, states, |i, j| {
        let edge = |half: f64| normal.cdf(k + (j as f64 - i as f64 + half) * width);
        let stays = if j == 0 { edge(0.5) } else { edge(0.5) - edge(-0.5) };
        f64::from(u8::from(i == j)) - stays
    });
    matrix.lu().solve(&nalgebra::DVector::from_element(states, 1.0)).unwrap()[0]
}

#[test]
fn the_markov_chain_is_another_road_to_the_same_run_length() {
    // Its error falls with the square of the cells' width: extrapolated it meets the integral equation.
    for (k, h) in [(0.5, 4.0), (0.25, 6.0), (1.0, 2.5)] {
        let [coarse, fine] = [101, 201].map(|states| brook_and_evans(k, h, states));
        let ratio = (2.0 * 201.0 - 1.0) / (2.0 * 101.0 - 1.0);
        let extrapolated = fine + (fine - coarse) / (ratio * ratio - 1.0);
        agrees(&format!("k = {k}, h = {h}"), one_sided(k, h).arl(0.0), extrapolated, 1e-6);
    }
}

/// Against the whole distribution, also where what is asked for lies near what there is.
#[test]
fn whether_an_alarm_is_likely_within_so_many_decisions_is_told_as_by_the_whole_distribution() {
    for (k, h) in [(0.25, 8.0), (0.5, 5.0), (0.5, 9.0), (1.0, 2.5), (0.0, 12.0)] {
        let chart = one_sided(k, h);
        for mean in [-0.2, 0.0, 0.1, 0.3, 0.5, 0.77, 1.0, 2.0, 5.0, 50.0] {
            let whole = chart.run_length(mean);
            for decisions in [0, 1, 2, 5, 12, 50, 333, 1666, 100_000] {
                let there_is = whole.alarm_within(decisions);
                let asked = [0.001, 0.1, 0.5, 0.9, 0.999];
                let near = [0.98, 0.999, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.001, 1.02].map(|x| x * there_is);
                for probability in asked.into_iter().chain(near).filter(|p| *p > 0.0 && *p < 1.0) {
                    assert_eq!(
                        chart.alarms_within(mean, decisions, probability),
                        there_is >= probability,
                        "k {k} h {h} mean {mean}: {probability} within {decisions}, {there_is}"
                    );
                }
            }
        }
    }
}
