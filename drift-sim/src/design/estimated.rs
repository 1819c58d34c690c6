//! What a chart really promises when its baseline was estimated from few windows, and the threshold that promises it anyway.
//!
//! With the mean off by `d` sigmas and the sigma by a factor `s`, the chart that was designed with (k, h) runs as one with
//! (k s, h s) on data of mean -d. d is N(0, 1/m) and (nu s^2) is chi-square with nu degrees of freedom. So the in-control
//! run length is itself random, from one commissioning to the next: its mean hides that half of all
//! devices may get less than half of it (Jones, Champ & Rigdon 2004). The **guaranteed** threshold is the one with which a wanted
//! share of all commissionings (the confidence, say 90 %) reaches the wanted run length.
//!
//! For a given d the run length grows with s, so its distribution is one integral over d of the chi-square law at one root: deterministic,
//! without sampling.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::cusum::Cusum;
use super::quadrature;
use super::{check, cusum, normal, root};
use crate::sentences::typed;
use crate::{Error, Result};

/// How well a baseline is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatedBaseline {
    windows: f64,
    degrees_of_freedom: f64,
}

/// Nodes over the error of the mean.
const NODES: usize = 24;
/// Where the normal law of that error ends, in its deviations.
const END: f64 = 6.0;
/// The largest threshold, in sigmas, that is computed here: the integral takes thousands of run lengths.
const LARGEST_H: f64 = 20.0;
/// How exactly a root is found here, relative to its size.
const EXACT: f64 = 1e-7;

impl EstimatedBaseline {
    /// Mean and sigma from `windows` independent windows.
    ///
    /// # Errors
    /// Fewer than 25 windows or more than 1e7.
    pub fn independent(windows: f64) -> Result<Self> {
        Self::new(windows, windows - 1.0)
    }

    /// From `windows` windows whose residuals are a first-order autoregression with lag-1 correlation `rho`: they count as
    /// `m (1 - rho)/(1 + rho)` for the mean and `m (1 - rho^2)/(1 + rho^2)` for the sigma.
    ///
    /// # Errors
    /// `rho` is not between -1 and 1; effectively fewer than 25 windows or more than 1e7.
    pub fn autocorrelated(windows: f64, rho: f64) -> Result<Self> {
        let for_mean = windows / super::siegmund::omega_squared(rho)?;
        Self::new(for_mean, windows * (1.0 - rho * rho) / (1.0 + rho * rho) - 1.0)
    }

    fn new(windows: f64, degrees_of_freedom: f64) -> Result<Self> {
        if (25.0..=1e7).contains(&windows) && (24.0..=1e7).contains(&degrees_of_freedom) {
            Ok(Self { windows, degrees_of_freedom })
        } else {
            Err(Error::new(format!("the baseline has {} (effective) windows", typed(windows)))
                .allowed("25 to 1e7"))
        }
    }

    /// P(the in-control run length is below `arl0`), over all commissionings.
    pub fn probability_below(&self, chart: &Cusum, arl0: f64) -> f64 {
        let Ok(sigma) = ChiSquared::new(self.degrees_of_freedom) else { return f64::NAN };
        let deviation = 1.0 / self.windows.sqrt();
        let rule = quadrature::gauss_legendre(NODES);
        // Equal sides don't care for the sign of d.
        let (from, share) = if chart.up() == chart.down() { (0.0, 2.0) } else { (-END, 1.0) };
        let below = |d: f64| {
            let s = self.sigma_ratio_that_gives(chart, d, arl0);
            sigma.cdf(self.degrees_of_freedom * s * s)
        };
        quadrature::panels(&rule, from, END, END)
            .iter()
            .map(|node| share * node.weight * normal::density(node.at) * below(node.at * deviation))
            .sum()
    }

    /// The sigma ratio at which the run length is `arl0` with the mean off by `d`; an end of the possible range if there is none.
    fn sigma_ratio_that_gives(&self, chart: &Cusum, d: f64, arl0: f64) -> f64 {
        // Wilson & Hilferty's approximation bounds what can occur, far out.
        let spread = 2.0 / (9.0 * self.degrees_of_freedom);
        let ratio = |deviations: f64| (1.0 - spread + deviations * spread.sqrt()).max(0.05).powf(1.5);
        let log_arl = |s: f64| chart.arl_of(-d / s, 1.0 / s).min(f64::MAX).ln() - arl0.ln();
        root::bracketed_to(log_arl, ratio(-END), ratio(END), EXACT)
    }

    /// The in-control run length that a share `probability` of all commissionings stays below.
    ///
    /// # Errors
    /// `probability` is not between 0 and 1, or a threshold of the chart is above 20 sigmas.
    pub fn arl0_quantile(&self, chart: &Cusum, probability: f64) -> Result<f64> {
        let h = chart.up().h().max(chart.down().h());
        if h > LARGEST_H {
            return Err(Error::new(format!("h is {}", typed(h)))
                .allowed(format!("up to {LARGEST_H} where the baseline is estimated")));
        }
        check::probability("probability", probability)?;
        let at = |log_arl: f64| self.probability_below(chart, log_arl.exp()) - probability;
        Ok(root::bracketed_to(at, 0.0, cusum::LARGEST_ARL0.ln(), EXACT).exp())
    }

    /// The two-sided CUSUM of which a share `confidence` of all commissionings reaches the in-control run length `arl0` (decisions).
    ///
    /// # Errors
    /// As [`Cusum::with_arl0`]; `confidence` is not between 0.5 and 0.9999; `k` is 0, when no threshold
    /// can promise anything about a mean that is off; or the threshold would be above 20 sigmas.
    pub fn guaranteed(&self, k: f64, arl0: f64, confidence: f64, head_start: f64) -> Result<Cusum> {
        if !(0.5..=0.9999).contains(&confidence) {
            return Err(Error::new(format!("confidence is {}", typed(confidence))).allowed("0.5 to 0.9999"));
        }
        if k <= 0.0 {
            return Err(
                Error::new(format!("k is {}", typed(k))).allowed("above 0 where the baseline is estimated")
            );
        }
        let certain = Cusum::with_arl0(k, arl0, head_start)?;
        let of = |h: f64| Cusum::new(k, h, head_start);
        let misses = |h: f64| of(h).map_or(1.0, |c| self.probability_below(&c, arl0)) - (1.0 - confidence);
        let mut enough = certain.up().h().min(LARGEST_H);
        while misses(enough) > 0.0 {
            if enough >= LARGEST_H {
                return Err(Error::new(format!(
                    "arl0 {arl0} can't be promised with {} windows",
                    self.windows
                ))
                .allowed("more windows, a larger k, a smaller arl0 or less confidence"));
            }
            enough = f64::min(1.5 * enough, LARGEST_H);
        }
        of(root::bracketed_to(misses, 0.5 * certain.up().h(), enough, EXACT))
    }
}
