//! The numbers that the paper prints.

use drift_core::Index;

/// Equation 13: real and imaginary part of the discretised plant's eigenvalues.
pub const EIGENVALUES: [(f64, f64); 3] = [(0.9998, 0.0020), (0.9998, -0.0020), (0.9995, 0.0)];

/// The baseline of section 6.2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PublishedBaseline {
    /// Intercept b0 of the nominal relation (equation 5).
    pub b0: f64,
    /// Slope b1 of the nominal relation (equation 5).
    pub b1: f64,
    /// 95 % confidence interval of the intercept.
    pub b0_ci95: (f64, f64),
    /// 95 % confidence interval of the slope.
    pub b1_ci95: (f64, f64),
    /// Coefficient of determination.
    pub r2: f64,
    /// Adjusted R^2.
    pub adj_r2: f64,
    /// Root mean squared residual.
    pub rmse: f64,
}

/// The nominal relation as section 6.2 prints it.
pub const BASELINE: PublishedBaseline = PublishedBaseline {
    b0: 0.175,
    b1: 1.26e-5,
    b0_ci95: (0.166_616, 0.182_278),
    b1_ci95: (1.2e-5, 1.31e-5),
    r2: 0.91548,
    adj_r2: 0.91504,
    rmse: 1.06e-2,
};

/// One line of Table 1: sensitivity to mu_max, to sigma_growth, and their ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PublishedRank {
    /// Which index.
    pub index: Index,
    /// Mean range over mu_max.
    pub delta_mu: f64,
    /// Mean range over sigma_growth.
    pub delta_sigma: f64,
    /// The first over the second.
    pub ratio: f64,
}

/// Table 1, in its order.
pub const RANKING: [PublishedRank; 4] = [
    PublishedRank { index: Index::Iae, delta_mu: 0.100_326, delta_sigma: 0.000_767, ratio: 130.86 },
    PublishedRank { index: Index::Itae, delta_mu: 0.158_342, delta_sigma: 0.001_325, ratio: 119.55 },
    PublishedRank { index: Index::Itse, delta_mu: 0.013_958, delta_sigma: 0.000_181, ratio: 77.29 },
    PublishedRank { index: Index::Ise, delta_mu: 0.008_087, delta_sigma: 0.000_139, ratio: 58.29 },
];

/// What section 6.3 says of one case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PublishedDetection {
    /// The case's mu_max; its sigma_growth is 0.
    pub mu_max: f64,
    /// Alarm of the CUSUM, about, s.
    pub cusum_s: Option<f64>,
    /// Alarm of the SPRT, about, s; the paper gives two.
    pub sprt_s: &'static [f64],
    /// In its words.
    pub says: &'static str,
}

/// The detection times as section 6.3 prints them.
pub const DETECTION: [PublishedDetection; 3] = [
    PublishedDetection {
        mu_max: 0.0,
        cusum_s: None,
        sprt_s: &[],
        says: "most residuals inside the prediction interval, no alarm of CUSUM or SPRT",
    },
    PublishedDetection {
        mu_max: 1.0,
        cusum_s: Some(40.0),
        sprt_s: &[35.0, 60.0],
        says: "a small but non negligible number of windows outside; CUSUM at about 40 s, SPRT at 35/60 s",
    },
    PublishedDetection { mu_max: 3.0, cusum_s: None, sprt_s: &[], says: "promptly detected by both" },
];
