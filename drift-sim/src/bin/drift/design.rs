//! `drift design`: a detector's threshold from the wanted run length between false alarms, or the reverse.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{ArgGroup, Args, ValueEnum};
use drift_sim::design::{Design, DetectorKind, QUANTILES, Request};
use drift_sim::{Error, Result, output};

use crate::number_argument::count;
use crate::progress::Progress;

/// Designs a detector: its threshold from the wanted ARL0, or its ARL0 from the threshold.
///
/// Run lengths count decisions (one a hop), the residual being standardised, independent and normal.
#[derive(Args)]
#[command(after_help = "\
Examples:
  drift design --k 0.5 --h 5
  drift design --k 0.5 --arl0 2000 --windows 200 --hop-s 3
  drift design --detector shewhart --arl0 2000 --shift 2", group(ArgGroup::new("threshold").required(true).args(["h", "arl0"])))]
pub struct Arguments {
    /// Which detector.
    #[arg(long, value_enum, default_value_t = Detector::Cusum)]
    detector: Detector,
    /// Allowance in sigmas (0 to 10): half the shift to be found. The SPRT looks for a shift of 2k; Shewhart has none.
    #[arg(long)]
    k: Option<f64>,
    /// EWMA: weight of the newest residual (0.01 to 1) [default: 0.1].
    #[arg(long, value_name = "LAMBDA")]
    lambda: Option<f64>,
    /// Threshold in sigmas, up to 100 (CUSUM), 30 (Shewhart); the EWMA's limit; the SPRT's upper log-likelihood ratio.
    #[arg(long)]
    h: Option<f64>,
    /// Wanted mean number of decisions to a false alarm: above 1, up to 1e15 (SPRT 1e9).
    #[arg(long, value_name = "N")]
    arl0: Option<f64>,
    /// The shift of the mean in sigmas that arl1 is for [default: 2k; Shewhart 1].
    #[arg(long, value_name = "D")]
    shift: Option<f64>,
    /// CUSUM: start at this fraction of h (0 to below 1).
    #[arg(long, value_name = "F")]
    head_start: Option<f64>,
    /// Also the run length under a drift of this many sigmas a decision (1e-5 to 100).
    #[arg(long, value_name = "S")]
    slope: Option<f64>,
    /// Watch for a rise only.
    #[arg(long)]
    one_sided: bool,
    /// CUSUM: mean and sigma come from this many independent windows (25 to 1e7); the threshold then keeps --arl0 in a share
    /// --confidence of all commissionings.
    #[arg(long, value_name = "M")]
    windows: Option<f64>,
    /// That share (0.5 to 0.9999).
    #[arg(long, value_name = "C", default_value_t = 0.9, requires = "windows")]
    confidence: f64,
    /// Also the probability of an alarm within this many decisions.
    #[arg(long, value_name = "N", value_parser = count)]
    mission: Option<u64>,
    /// Seconds from one decision to the next: prints run lengths in hours too.
    #[arg(long, value_name = "SECONDS")]
    hop_s: Option<f64>,
    /// SPRT: also look for a deviation that is this many times the healthy one (0.5 to 5).
    #[arg(long, value_name = "R")]
    ratio: Option<f64>,
    /// SPRT: probability to miss, which sets the lower boundary at ln(beta) [default: 0.01].
    #[arg(long, value_name = "B")]
    beta: Option<f64>,
    /// Write the numbers as JSON; - is standard output, and nothing else is printed then.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Detector {
    Cusum,
    Ewma,
    Shewhart,
    Sprt,
}

/// Designs, prints, writes.
pub fn run(arguments: Arguments) -> Result<ExitCode> {
    let progress = Progress::of_unknown("computing run lengths");
    let design = arguments.request().design()?;
    drop(progress);
    if let Some(path) = &arguments.json {
        let text = serde_json::to_string_pretty(&design.to_json())
            .map_err(|e| Error::new(format!("JSON can't be written: {e}")))?;
        output::write_text(path, &format!("{text}\n"))?;
    }
    if arguments.json.as_deref() != Some(Path::new("-")) {
        output::write_text(Path::new("-"), &as_text(&arguments, &design))?;
    }
    Ok(ExitCode::SUCCESS)
}

impl Arguments {
    fn request(&self) -> Request {
        Request {
            detector: match self.detector {
                Detector::Cusum => DetectorKind::Cusum,
                Detector::Ewma => DetectorKind::Ewma,
                Detector::Shewhart => DetectorKind::Shewhart,
                Detector::Sprt => DetectorKind::Sprt,
            },
            k: self.k,
            lambda: self.lambda,
            h: self.h,
            arl0: self.arl0,
            shift: self.shift,
            head_start: self.head_start,
            slope: self.slope,
            one_sided: self.one_sided,
            windows: self.windows,
            confidence: Some(self.confidence),
            mission: self.mission,
            hop_s: self.hop_s,
            ratio: self.ratio,
            beta: self.beta,
        }
    }
}

/// One screen that says what the numbers mean. Writing to a `String` can't fail.
fn as_text(arguments: &Arguments, design: &Design) -> String {
    let mut text = String::new();
    let span = |decisions: f64| match arguments.hop_s {
        Some(hop_s) => format!("{} decisions ({} h)", number(decisions), number(decisions * hop_s / 3600.0)),
        None => format!("{} decisions", number(decisions)),
    };
    let sides = if arguments.one_sided { "one-sided (a rise)" } else { "two-sided" };
    let name = match design.detector {
        "cusum" => "CUSUM",
        "ewma" => "EWMA",
        "shewhart" => "Shewhart chart",
        _ => "repeated SPRT",
    };
    let parameters = match (design.k, design.lower) {
        (Some(k), Some(lower)) => {
            format!(
                "shift sought {}, boundaries {lower:.6} and h = {:.6} (log-likelihood ratio)",
                2.0 * k,
                design.h
            )
        }
        (Some(k), None) => format!("k = {k}, h = {:.6} sigma", design.h),
        _ => match design.lambda {
            Some(lambda) => format!("lambda = {lambda}, limit h = {:.6} sigma", design.h),
            None => format!("limit h = {:.6} sigma", design.h),
        },
    };
    let _ = writeln!(text, "{name}, {sides}: {parameters}");
    if let Some(f) = arguments.head_start.filter(|f| *f > 0.0) {
        let _ = writeln!(text, "head start: the statistic begins at {:.4} ({f} of h)", f * design.h);
    }
    let _ = writeln!(text, "\nfalse alarm every  {} on average (ARL0)", span(design.arl0));
    let found = span(design.arl1);
    let _ = writeln!(
        text,
        "alarm after        {found} on average, the mean having moved by {} sigma (ARL1)",
        design.shift
    );
    if let Some(runs) = &design.run_lengths {
        for (run, when) in runs.iter().zip(["in health", "shifted"]) {
            let [p05, p50, p95] = QUANTILES.map(|p| number(run.quantile(p)));
            let _ = writeln!(
                text,
                "{when:<19}5 % of runs alarm within {p05} decisions, 50 % within {p50}, 95 % within {p95}"
            );
        }
        if let Some(mission) = arguments.mission {
            let [health, shifted] = [&runs[0], &runs[1]].map(|run| 100.0 * run.alarm_within(mission));
            let _ = writeln!(
                text,
                "in {mission} decisions   an alarm with probability {health:.4} % in health, {shifted:.4} % shifted"
            );
        }
    }
    if let (Some(slope), Some(arl)) = (arguments.slope, design.drift_arl) {
        let _ = writeln!(
            text,
            "drift              of {slope} sigmas a decision: alarm after {} on average",
            span(arl)
        );
    }
    if let (Some(windows), Some([p05, p10, p50, p90])) = (arguments.windows, design.commissioned) {
        let [p05, p10, p50, p90] = [p05, p10, p50, p90].map(number);
        let _ = writeln!(
            text,
            "\nwith mean and sigma from {windows} windows the real ARL0 differs from one commissioning to the next:"
        );
        let _ = writeln!(
            text,
            "5 % get less than {p05} decisions, 10 % less than {p10}, half less than {p50}, 90 % less than {p90}"
        );
    }
    let _ = writeln!(
        text,
        "\nA decision falls once a hop. The numbers hold for independent normal residuals: a hop as long as the\nwindow, and a window of at least 20 time constants of the loop."
    );
    text
}

/// Seven significant digits at most, whole numbers as they are.
fn number(value: f64) -> String {
    if value >= 1e9 {
        return format!("{value:.4e}");
    }
    let decimals = (6.0 - value.abs().max(1.0).log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
