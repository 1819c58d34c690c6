//! Operating characteristic of the sequential probability ratio test: what its thresholds really realise.
//!
//! The log-likelihood ratio of N(mean, deviation^2) against N(0, 1) is summed decision by decision until it leaves
//! (lower, upper): at the top the alternative is accepted, at the bottom it is rejected. Wald (1945) puts the boundaries at
//! `ln(beta/(1 - alpha))` and `ln((1 - beta)/alpha)`. Those are **guaranteed**: the sum overshoots them, so the realised error
//! rates are lower and the test longer than it need be. Siegmund (1985) moves both inwards by the mean overshoot, `0.583 delta`, and
//! realises nearly the nominal rates (mean alternative only).
//!
//! A monitor has no end of test: a rejected alternative starts the next test. Its run length to an alarm is, by Wald's identity over
//! the tests, `E[decisions of one test]/P(it ends at the top)`. Such a **repeated SPRT is a CUSUM** whose statistic goes back
//! to 0 from a lower boundary instead of 0: running both costs twice and adds their false alarms (see [`super::joint_arl`]).
//!
//! Two sides, an upper test and its mirror image, combine as independent detectors, `1/L = 1/L+ + 1/L-`. That's exact only for the CUSUM: after
//! one side alarms the other isn't quite at its start.

use super::quadratic_walk::{QuadraticWalk, Step};
use super::walk::Walk;
use super::{check, root};
use crate::sentences::typed;
use crate::{Error, Result};

/// What the test looks for: z is N(mean, deviation^2) instead of N(0, 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alternative {
    mean: f64,
    deviation: f64,
}

/// A test: the alternative and the two boundaries of the log-likelihood ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sprt {
    alternative: Alternative,
    lower: f64,
    upper: f64,
}

/// How one test ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// P(the sum leaves at the top): alpha where there is no shift, 1 - beta under the alternative.
    pub accepts: f64,
    /// Expected number of decisions until the test ends.
    pub decisions: f64,
}

/// The widest test that is computed, (upper - lower) in standard deviations of one decision's increment.
const WIDEST: f64 = 200.0;
/// The largest run length that a threshold is searched for, in decisions.
const LARGEST_ARL0: f64 = 1e9;

impl Alternative {
    /// A rise of the mean by `mean` sigmas, and a deviation that is `deviation` times the healthy one (1: unchanged).
    ///
    /// # Errors
    /// `mean` is not within 0..=10 or `deviation` not within 0.5..=5, or both leave z as it is.
    pub fn new(mean: f64, deviation: f64) -> Result<Self> {
        if !(0.0..=10.0).contains(&mean) {
            return Err(
                Error::new(format!("the alternative's mean is {}", typed(mean))).allowed("0 to 10 sigmas")
            );
        }
        if !(0.5..=5.0).contains(&deviation) {
            let what = format!("the alternative's deviation is {deviation}");
            return Err(Error::new(what).allowed("0.5 to 5 times the healthy one"));
        }
        if mean < 0.01 && (deviation - 1.0).abs() < 0.01 {
            return Err(Error::new("the alternative is no different from health")
                .allowed("a mean from 0.01 sigmas, or a deviation 1 % from 1"));
        }
        Ok(Self { mean, deviation })
    }

    /// Its mean, in sigmas.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Its deviation, in sigmas.
    pub fn deviation(&self) -> f64 {
        self.deviation
    }

    /// The log-likelihood ratio `(square, linear, constant)`: what one decision z adds is `square z^2 + linear
    /// z + constant`.
    pub fn increment(&self) -> (f64, f64, f64) {
        let precision = 1.0 / (self.deviation * self.deviation);
        (
            0.5 * (1.0 - precision),
            self.mean * precision,
            -0.5 * self.mean * self.mean * precision - libm::log(self.deviation),
        )
    }

    /// Whether only the mean differs: then the increment is linear in z.
    fn is_mean_only(&self) -> bool {
        (self.deviation - 1.0).abs() < 1e-9
    }

    /// Deviation of the increment under health.
    fn increment_deviation(&self) -> f64 {
        let (square, linear, _) = self.increment();
        (2.0 * square * square + linear * linear).sqrt()
    }
}

impl Sprt {
    /// The test with the boundaries given, as log-likelihood ratios.
    ///
    /// # Errors
    /// Not `lower < 0 < upper`, or wider than 200 deviations of one increment.
    pub fn new(alternative: Alternative, lower: f64, upper: f64) -> Result<Self> {
        if !(lower < 0.0 && upper > 0.0) {
            return Err(Error::new(format!("the boundaries are {} and {}", typed(lower), typed(upper)))
                .allowed("one below 0 and one above (larger errors leave no test)"));
        }
        let widest = WIDEST * alternative.increment_deviation();
        if upper - lower > widest {
            return Err(Error::new(format!("the boundaries are {} apart", upper - lower))
                .allowed(format!("up to {widest:.4} for this alternative")));
        }
        Ok(Self { alternative, lower, upper })
    }

    /// Wald's boundaries: false-alarm probability at most about `alpha` and missed at most about `beta`,
    /// guaranteed up to
    /// `alpha/(1 - beta)` and `beta/(1 - alpha)`.
    ///
    /// # Errors
    /// alpha or beta is not between 0 and 1, or `alpha + beta >= 1`.
    pub fn wald(alternative: Alternative, alpha: f64, beta: f64) -> Result<Self> {
        let (lower, upper) = wald_boundaries(alpha, beta)?;
        Self::new(alternative, lower, upper)
    }

    /// Siegmund's boundaries, which realise alpha and beta nearly.
    ///
    /// # Errors
    /// As [`Self::wald`]; the alternative changes the deviation, for which there is no such correction; or it
    /// is so large
    /// that the correction leaves nothing.
    pub fn siegmund(alternative: Alternative, alpha: f64, beta: f64) -> Result<Self> {
        if !alternative.is_mean_only() {
            return Err(Error::new("Siegmund's correction needs an alternative of the mean alone")
                .allowed("Wald's thresholds"));
        }
        let (lower, upper) = wald_boundaries(alpha, beta)?;
        let overshoot = 0.583 * alternative.mean;
        Self::new(alternative, lower + overshoot, upper - overshoot)
    }

    /// The upper boundary with which the repeated test (one side) has the wanted in-control run length in decisions.
    ///
    /// # Errors
    /// `lower` is not below 0; `arl0` is not above 1 and up to 1e9, or can't be had within the widest test.
    pub fn repeated_with_arl0(alternative: Alternative, lower: f64, arl0: f64) -> Result<Self> {
        check::arl0(arl0)?;
        let widest = WIDEST * alternative.increment_deviation();
        if !(lower < 0.0 && -lower < 0.5 * widest) {
            return Err(Error::new(format!("the lower boundary is {}", typed(lower)))
                .allowed(format!("below 0, down to {:.4} for this alternative", -0.5 * widest)));
        }
        if arl0 > LARGEST_ARL0 {
            return Err(
                Error::new(format!("arl0 is {}", typed(arl0))).allowed(format!("up to {LARGEST_ARL0:e}"))
            );
        }
        let at = |upper: f64| Self { alternative, lower, upper }.repeated_arl(0.0, 1.0);
        const SMALLEST: f64 = 1e-6;
        let least = at(SMALLEST);
        if least >= arl0 {
            return Err(Error::new(format!(
                "arl0 {} is less than this test gives without any threshold",
                typed(arl0)
            ))
            .allowed(format!("above {least:.4}")));
        }
        let mut enough = 1.0;
        while at(enough) < arl0 {
            if enough - lower >= widest {
                return Err(Error::new(format!("arl0 {} needs too wide a test", typed(arl0)))
                    .allowed("a smaller arl0 or a larger shift to look for"));
            }
            enough = f64::min(2.0 * enough, widest + lower);
        }
        let upper = root::bracketed(|upper| at(upper).min(f64::MAX).ln() - arl0.ln(), SMALLEST, enough);
        let found = Self::new(alternative, lower, upper)?;
        if (found.repeated_arl(0.0, 1.0) / arl0 - 1.0).abs() < 1e-3 {
            Ok(found)
        } else {
            Err(Error::new(format!("no threshold was found for arl0 {}", typed(arl0)))
                .allowed("a smaller arl0"))
        }
    }

    /// What it looks for.
    pub fn alternative(&self) -> Alternative {
        self.alternative
    }

    /// The lower boundary of the log-likelihood ratio.
    pub fn lower(&self) -> f64 {
        self.lower
    }

    /// The upper boundary, a log-likelihood ratio > 0.
    pub fn upper(&self) -> f64 {
        self.upper
    }

    /// How one test ends when z is N(`mean`, `deviation`^2).
    pub fn outcome(&self, mean: f64, deviation: f64) -> Outcome {
        if self.alternative.is_mean_only() {
            self.linear_outcome(mean, deviation)
        } else {
            self.quadratic_outcome(mean, deviation)
        }
    }

    fn linear_outcome(&self, mean: f64, deviation: f64) -> Outcome {
        let unit = self.alternative.mean * deviation;
        let walk = Walk {
            lower: self.lower / unit,
            upper: self.upper / unit,
            mean: (mean - 0.5 * self.alternative.mean) / deviation,
            restarts: false,
        };
        let chain = walk.discretise();
        Outcome { accepts: chain.ends_up().at_origin(), decisions: chain.steps().at_origin() }
    }

    fn quadratic_outcome(&self, mean: f64, deviation: f64) -> Outcome {
        let step = Step::of(self.alternative.increment(), mean, deviation);
        let (accepts, decisions) = QuadraticWalk { step, lower: self.lower, upper: self.upper }.outcome();
        Outcome { accepts, decisions }
    }

    /// Average run length in decisions to an alarm of the repeated test (one side) when z is N(`mean`,
    /// `deviation`^2).
    pub fn repeated_arl(&self, mean: f64, deviation: f64) -> f64 {
        let outcome = self.outcome(mean, deviation);
        outcome.decisions / outcome.accepts
    }

    /// Of the repeated test and its mirror image together, as independent detectors.
    pub fn two_sided_arl(&self, mean: f64, deviation: f64) -> f64 {
        let joint = super::joint_arl(&[mean, -mean].map(|mean| self.repeated_arl(mean, deviation)));
        // Where both sides alarm at once the rates don't add, and no alarm comes before the first decision.
        joint.max(1.0)
    }
}

/// `(ln(beta/(1 - alpha)), ln((1 - beta)/alpha))`.
fn wald_boundaries(alpha: f64, beta: f64) -> Result<(f64, f64)> {
    check::probability("alpha", alpha)?;
    check::probability("beta", beta)?;
    if alpha + beta >= 1.0 {
        return Err(Error::new(format!("alpha + beta is {}", alpha + beta)).allowed("below 1"));
    }
    Ok((libm::log(beta) - libm::log1p(-alpha), libm::log1p(-beta) - libm::log(alpha)))
}
