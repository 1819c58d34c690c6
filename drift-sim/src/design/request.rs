//! One detector designed from what a person states: its threshold from the wanted run length between false alarms, or the
//! reverse, with all that is told of it.

use serde_json::{Value, json};

use super::{Alternative, Cusum, EstimatedBaseline, Ewma, OneSided, RunLength, Shewhart, Sprt, check_shift};
use crate::sentences::typed;
use crate::{Error, Result};

/// Which detector.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum DetectorKind {
    /// Sums of deviations, both ways.
    #[default]
    Cusum,
    /// Exponentially weighted mean.
    Ewma,
    /// A limit on each residual.
    Shewhart,
    /// Wald's test, repeated.
    Sprt,
}

impl DetectorKind {
    /// All, as commands name them.
    pub const ALL: [(&'static str, Self); 4] =
        [("cusum", Self::Cusum), ("ewma", Self::Ewma), ("shewhart", Self::Shewhart), ("sprt", Self::Sprt)];
}

/// What is asked for; one of `h` and `arl0` is needed. What the detector has no meaning for is refused where it is given.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Request {
    /// Which detector.
    pub detector: DetectorKind,
    /// Allowance in sigmas (0 to 10): half the shift to be found. The SPRT looks for a shift of 2k; Shewhart has none.
    pub k: Option<f64>,
    /// EWMA: weight of the newest residual (0.01 to 1); 0.1 where nothing is said.
    pub lambda: Option<f64>,
    /// Threshold in sigmas, up to 100 (CUSUM), 30 (Shewhart); the EWMA's limit; the SPRT's upper log-likelihood ratio.
    pub h: Option<f64>,
    /// Wanted mean number of decisions to a false alarm: above 1, up to 1e15 (SPRT 1e9).
    pub arl0: Option<f64>,
    /// The shift of the mean in sigmas that arl1 is for; 2k where nothing is said, 1 for Shewhart and EWMA.
    pub shift: Option<f64>,
    /// CUSUM: start at this fraction of h (0 to below 1).
    pub head_start: Option<f64>,
    /// Also the run length under a drift of this many sigmas a decision (1e-5 to 100).
    pub slope: Option<f64>,
    /// Watch for a rise only.
    pub one_sided: bool,
    /// CUSUM: mean and sigma come from this many independent windows (25 to 1e7).
    pub windows: Option<f64>,
    /// Share of commissionings from so many windows that keeps `arl0` (0.5 to 0.9999); 0.9 where nothing is said.
    pub confidence: Option<f64>,
    /// Also the probability of an alarm within this many decisions.
    pub mission: Option<u64>,
    /// Seconds from one decision to the next: run lengths in hours too.
    pub hop_s: Option<f64>,
    /// SPRT: also look for a deviation that is this many times the healthy one (0.5 to 5).
    pub ratio: Option<f64>,
    /// SPRT: probability to miss, which sets the lower boundary at ln(beta); 0.01 where nothing is said.
    pub beta: Option<f64>,
}

/// Share of commissionings that is to keep the promise where nothing is said.
const CONFIDENCE: f64 = 0.9;

/// What was designed, whichever the detector.
#[derive(Debug, Clone)]
pub struct Design {
    /// What was asked for.
    pub request: Request,
    /// The detector's name.
    pub detector: &'static str,
    /// CUSUM, SPRT: the allowance, sigmas.
    pub k: Option<f64>,
    /// EWMA: the weight.
    pub lambda: Option<f64>,
    /// The threshold.
    pub h: f64,
    /// The shift that `arl1` is for, sigmas.
    pub shift: f64,
    /// Mean decisions to a false alarm.
    pub arl0: f64,
    /// Mean decisions to the alarm after the shift.
    pub arl1: f64,
    /// ARL0 and ARL1 of one side, where they were computed.
    pub one_sided: Option<[f64; 2]>,
    /// Distribution of the run length in health and shifted, where it was computed.
    pub run_lengths: Option<[RunLength; 2]>,
    /// Mean decisions to the alarm under the asked drift.
    pub drift_arl: Option<f64>,
    /// SPRT: the lower boundary.
    pub lower: Option<f64>,
    /// In-control run lengths that 5, 10, 50, 90 % of commissionings stay below.
    pub commissioned: Option<[f64; 4]>,
}

/// Quantiles of commissionings.
const COMMISSIONED: [f64; 4] = [0.05, 0.1, 0.5, 0.9];
/// Quantiles of run lengths that are told.
pub const QUANTILES: [f64; 3] = [0.05, 0.5, 0.95];

impl Request {
    /// Designs the detector.
    ///
    /// # Errors
    /// What is asked for is impossible, contradicts itself or has no meaning for the detector.
    pub fn design(&self) -> Result<Design> {
        if let Some(hop_s) = self.hop_s
            && !(hop_s > 0.0 && hop_s.is_finite())
        {
            return Err(
                Error::new(format!("hop_s is {}", typed(hop_s))).allowed("a number of seconds above 0")
            );
        }
        let design = match self.detector {
            DetectorKind::Cusum => cusum(self)?,
            DetectorKind::Ewma => ewma(self)?,
            DetectorKind::Shewhart => shewhart(self)?,
            DetectorKind::Sprt => sprt(self)?,
        };
        let one_sided = design.one_sided.iter().flatten();
        if ![design.arl0, design.arl1].iter().chain(one_sided).all(|l| l.is_finite()) {
            return Err(Error::new("the run length is beyond all numbers").allowed("a smaller h or k"));
        }
        Ok(design)
    }
}

/// Refuses what the chosen detector has no meaning for.
fn refuse(given: &[(&str, bool)], detector: &str) -> Result<()> {
    match given.iter().find(|(_, given)| *given) {
        Some((flag, _)) => Err(Error::new(format!("{flag} does not go with {detector}"))),
        None => Ok(()),
    }
}

fn k(request: &Request) -> Result<f64> {
    request.k.ok_or_else(|| Error::new("--k is missing").allowed("half the shift to be found, in sigmas"))
}

fn shift(request: &Request, default: f64) -> Result<f64> {
    let shift = request.shift.unwrap_or(default);
    check_shift(shift).map(|()| shift)
}

fn cusum(request: &Request) -> Result<Design> {
    let given = [
        ("--ratio", request.ratio.is_some()),
        ("--beta", request.beta.is_some()),
        ("--lambda", request.lambda.is_some()),
    ];
    refuse(&given, "a CUSUM")?;
    let k = k(request)?;
    let shift = shift(request, if k > 0.0 { 2.0 * k } else { 1.0 })?;
    let head_start = request.head_start.unwrap_or(0.0);
    if request.one_sided {
        refuse(&[("--windows", request.windows.is_some())], "--one-sided")?;
    }
    let baseline = request.windows.map(EstimatedBaseline::independent).transpose()?;
    let chart = match (request.h, request.arl0, baseline) {
        (Some(h), _, _) => Cusum::new(k, h, head_start)?,
        (_, Some(arl0), Some(baseline)) => {
            baseline.guaranteed(k, arl0, request.confidence.unwrap_or(CONFIDENCE), head_start)?
        }
        (_, Some(arl0), None) if request.one_sided => {
            let side = OneSided::with_arl0(k, arl0, head_start)?;
            Cusum::new(k, side.h(), head_start)?
        }
        (_, Some(arl0), None) => Cusum::with_arl0(k, arl0, head_start)?,
        (None, None, _) => return Err(Error::new("neither --h nor --arl0 is given")),
    };
    let side = chart.up();
    let one_sided = [side.arl(0.0), side.arl(shift)];
    let [arl0, arl1] = if request.one_sided { one_sided } else { [chart.arl(0.0), chart.arl(shift)] };
    let run_length =
        |mean: f64| if request.one_sided { side.run_length(mean) } else { chart.run_length(mean) };
    let commissioned = match baseline {
        Some(baseline) => {
            let mut found = [0.0; 4];
            for (found, p) in found.iter_mut().zip(COMMISSIONED) {
                *found = baseline.arl0_quantile(&chart, p)?;
            }
            Some(found)
        }
        None => None,
    };
    Ok(Design {
        request: *request,
        detector: "cusum",
        k: Some(k),
        lambda: None,
        h: side.h(),
        shift,
        arl0,
        arl1,
        one_sided: Some(one_sided),
        run_lengths: Some([run_length(0.0), run_length(shift)]),
        drift_arl: request.slope.map(|slope| side.drift_arl(slope)).transpose()?,
        lower: None,
        commissioned,
    })
}

fn ewma(request: &Request) -> Result<Design> {
    let given = [
        ("--k", request.k.is_some()),
        ("--head-start", request.head_start.is_some()),
        ("--windows", request.windows.is_some()),
        ("--ratio", request.ratio.is_some()),
        ("--beta", request.beta.is_some()),
        ("--slope", request.slope.is_some()),
        ("--mission", request.mission.is_some()),
        ("--one-sided", request.one_sided),
    ];
    refuse(&given, "an EWMA")?;
    let shift = shift(request, 1.0)?;
    let lambda = request.lambda.unwrap_or(0.1);
    let chart = match (request.h, request.arl0) {
        (Some(limit), _) => Ewma::new(lambda, limit)?,
        (_, Some(arl0)) => Ewma::with_arl0(lambda, arl0)?,
        (None, None) => return Err(Error::new("neither --h nor --arl0 is given")),
    };
    let [arl0, arl1] = [chart.arl(0.0), chart.arl(shift)];
    Ok(Design {
        request: *request,
        detector: "ewma",
        k: None,
        lambda: Some(lambda),
        h: chart.limit(),
        shift,
        arl0,
        arl1,
        one_sided: None,
        run_lengths: None,
        drift_arl: None,
        lower: None,
        commissioned: None,
    })
}

fn shewhart(request: &Request) -> Result<Design> {
    let given = [
        ("--k", request.k.is_some()),
        ("--head-start", request.head_start.is_some()),
        ("--windows", request.windows.is_some()),
        ("--ratio", request.ratio.is_some()),
        ("--beta", request.beta.is_some()),
        ("--lambda", request.lambda.is_some()),
    ];
    refuse(&given, "a Shewhart chart")?;
    let shift = shift(request, 1.0)?;
    let chart = match (request.h, request.arl0, request.one_sided) {
        (Some(h), _, true) => Shewhart::new(h, f64::INFINITY)?,
        (Some(h), _, false) => Shewhart::new(h, h)?,
        (_, Some(arl0), true) => Shewhart::one_sided_with_arl0(arl0)?,
        (_, Some(arl0), false) => Shewhart::with_arl0(arl0)?,
        (None, None, _) => return Err(Error::new("neither --h nor --arl0 is given")),
    };
    let side = Shewhart::new(chart.upper(), f64::INFINITY)?;
    Ok(Design {
        request: *request,
        detector: "shewhart",
        k: None,
        lambda: None,
        h: chart.upper(),
        shift,
        arl0: chart.arl(0.0),
        arl1: chart.arl(shift),
        one_sided: Some([side.arl(0.0), side.arl(shift)]),
        run_lengths: Some([chart.run_length(0.0), chart.run_length(shift)]),
        drift_arl: request.slope.map(|slope| chart.drift_arl(slope)).transpose()?,
        lower: None,
        commissioned: None,
    })
}

fn sprt(request: &Request) -> Result<Design> {
    let given = [
        ("--head-start", request.head_start.is_some()),
        ("--windows", request.windows.is_some()),
        ("--slope", request.slope.is_some()),
        ("--mission", request.mission.is_some()),
        ("--lambda", request.lambda.is_some()),
    ];
    refuse(&given, "an SPRT")?;
    let k = k(request)?;
    let shift = shift(request, 2.0 * k)?;
    let alternative = Alternative::new(2.0 * k, request.ratio.unwrap_or(1.0))?;
    let beta = request.beta.unwrap_or(0.01);
    if !(beta > 0.0 && beta < 1.0) {
        return Err(Error::new(format!("beta is {}", typed(beta))).allowed("between 0 and 1"));
    }
    let lower = beta.ln();
    let sides = if request.one_sided { 1.0 } else { 2.0 };
    let test = match (request.h, request.arl0) {
        (Some(h), _) => Sprt::new(alternative, lower, h)?,
        // In control both sides have the same run length, and together half of it.
        (_, Some(arl0)) => Sprt::repeated_with_arl0(alternative, lower, arl0 * sides)?,
        (None, None) => return Err(Error::new("neither --h nor --arl0 is given")),
    };
    let one_sided = [0.0, shift].map(|mean| test.repeated_arl(mean, 1.0));
    let [arl0, arl1] =
        if request.one_sided { one_sided } else { [0.0, shift].map(|mean| test.two_sided_arl(mean, 1.0)) };
    Ok(Design {
        request: *request,
        detector: "sprt",
        k: Some(k),
        lambda: None,
        h: test.upper(),
        shift,
        arl0,
        arl1,
        one_sided: Some(one_sided),
        run_lengths: None,
        drift_arl: None,
        lower: Some(test.lower()),
        commissioned: None,
    })
}

impl Design {
    /// All numbers as JSON, as `drift design --json` writes them.
    pub fn to_json(&self) -> Value {
        let quantiles = |run: &RunLength| {
            let [p05, p50, p95] = QUANTILES.map(|p| run.quantile(p));
            json!({ "p05": p05, "p50": p50, "p95": p95 })
        };
        let mut all = json!({
            "detector": self.detector,
            "unit": "decisions",
            "sides": if self.request.one_sided { 1 } else { 2 },
            "k": self.k,
            "h": self.h,
            "shift": self.shift,
            "arl0": self.arl0,
            "arl1": self.arl1,
            "one_sided": self.one_sided.map(|[arl0, arl1]| json!({ "arl0": arl0, "arl1": arl1 })),
            "quantiles": self.run_lengths.as_ref().map(|[in_control, shifted]| {
                json!({ "in_control": quantiles(in_control), "shifted": quantiles(shifted) })
            }),
        });
        if let Some(lambda) = self.lambda {
            all["lambda"] = json!(lambda);
        }
        if self.detector == "cusum" {
            all["head_start"] = json!(self.request.head_start.unwrap_or(0.0));
        }
        if let Some(lower) = self.lower {
            all["lower"] = json!(lower);
            all["ratio"] = json!(self.request.ratio.unwrap_or(1.0));
        }
        if let (Some(slope), Some(arl)) = (self.request.slope, self.drift_arl) {
            all["drift"] = json!({ "slope": slope, "arl": arl });
        }
        if let (Some(mission), Some([in_control, shifted])) = (self.request.mission, &self.run_lengths) {
            all["mission"] = json!({
                "decisions": mission,
                "false_alarm_probability": in_control.alarm_within(mission),
                "alarm_probability": shifted.alarm_within(mission),
            });
        }
        if let (Some(windows), Some([p05, p10, p50, p90])) = (self.request.windows, self.commissioned) {
            all["baseline"] = json!({
                "windows": windows,
                "confidence": self.request.arl0.map(|_| self.request.confidence.unwrap_or(CONFIDENCE)),
                "arl0_quantiles": { "p05": p05, "p10": p10, "p50": p50, "p90": p90 },
            });
        }
        if let Some(hop_s) = self.request.hop_s {
            all["hop_s"] = json!(hop_s);
            all["arl0_hours"] = json!(self.arl0 * hop_s / 3600.0);
            all["arl1_hours"] = json!(self.arl1 * hop_s / 3600.0);
        }
        all
    }
}
