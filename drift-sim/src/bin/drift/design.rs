//! `drift design`: a detector's threshold from the wanted run length between false alarms, or the reverse.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{ArgGroup, Args, ValueEnum};
use drift_sim::design::{
    Alternative, Cusum, EstimatedBaseline, Ewma, OneSided, RunLength, Shewhart, Sprt, check_shift,
};
use drift_sim::{Error, Result, output};
use serde_json::{Value, json};

use crate::progress::Progress;

/// Designs a detector: its threshold from the wanted ARL0, or its ARL0 from the threshold.
///
/// Run lengths count decisions (one a hop), the residual being standardised, independent and normal.
#[derive(Args)]
#[command(allow_negative_numbers = true, after_help = "\
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
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
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

/// What was designed, whichever the detector.
struct Design {
    detector: &'static str,
    k: Option<f64>,
    /// EWMA: the weight.
    lambda: Option<f64>,
    h: f64,
    shift: f64,
    arl0: f64,
    arl1: f64,
    /// Where it was computed.
    one_sided: Option<[f64; 2]>,
    run_lengths: Option<[RunLength; 2]>,
    drift_arl: Option<f64>,
    /// SPRT: the lower boundary.
    lower: Option<f64>,
    /// In-control run lengths that 5, 10, 50, 90 % of commissionings stay below.
    commissioned: Option<[f64; 4]>,
}

const COMMISSIONED: [f64; 4] = [0.05, 0.1, 0.5, 0.9];
const QUANTILES: [f64; 3] = [0.05, 0.5, 0.95];

/// Designs, prints, writes.
pub fn run(arguments: Arguments) -> Result<ExitCode> {
    if let Some(hop_s) = arguments.hop_s
        && !(hop_s > 0.0 && hop_s.is_finite())
    {
        return Err(Error::new(format!("hop_s is {hop_s}")).allowed("a number of seconds above 0"));
    }
    let progress = Progress::of_unknown("computing run lengths");
    let design = match arguments.detector {
        Detector::Cusum => cusum(&arguments)?,
        Detector::Ewma => ewma(&arguments)?,
        Detector::Shewhart => shewhart(&arguments)?,
        Detector::Sprt => sprt(&arguments)?,
    };
    drop(progress);
    let one_sided = design.one_sided.iter().flatten();
    if ![design.arl0, design.arl1].iter().chain(one_sided).all(|l| l.is_finite()) {
        return Err(Error::new("the run length is beyond all numbers").allowed("a smaller h or k"));
    }
    if let Some(path) = &arguments.json {
        let text = serde_json::to_string_pretty(&as_json(&arguments, &design))
            .map_err(|e| Error::new(format!("JSON can't be written: {e}")))?;
        output::write_text(path, &format!("{text}\n"))?;
    }
    if arguments.json.as_deref() != Some(Path::new("-")) {
        output::write_text(Path::new("-"), &as_text(&arguments, &design))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Refuses what the chosen detector has no meaning for.
fn refuse(given: &[(&str, bool)], detector: &str) -> Result<()> {
    match given.iter().find(|(_, given)| *given) {
        Some((flag, _)) => Err(Error::new(format!("{flag} does not go with {detector}"))),
        None => Ok(()),
    }
}

fn k(arguments: &Arguments) -> Result<f64> {
    arguments.k.ok_or_else(|| Error::new("--k is missing").allowed("half the shift to be found, in sigmas"))
}

fn shift(arguments: &Arguments, default: f64) -> Result<f64> {
    let shift = arguments.shift.unwrap_or(default);
    check_shift(shift).map(|()| shift)
}

fn cusum(arguments: &Arguments) -> Result<Design> {
    let given = [
        ("--ratio", arguments.ratio.is_some()),
        ("--beta", arguments.beta.is_some()),
        ("--lambda", arguments.lambda.is_some()),
    ];
    refuse(&given, "a CUSUM")?;
    let k = k(arguments)?;
    let shift = shift(arguments, if k > 0.0 { 2.0 * k } else { 1.0 })?;
    let head_start = arguments.head_start.unwrap_or(0.0);
    if arguments.one_sided {
        refuse(&[("--windows", arguments.windows.is_some())], "--one-sided")?;
    }
    let baseline = arguments.windows.map(EstimatedBaseline::independent).transpose()?;
    let chart = match (arguments.h, arguments.arl0, baseline) {
        (Some(h), _, _) => Cusum::new(k, h, head_start)?,
        (_, Some(arl0), Some(baseline)) => baseline.guaranteed(k, arl0, arguments.confidence, head_start)?,
        (_, Some(arl0), None) if arguments.one_sided => {
            let side = OneSided::with_arl0(k, arl0, head_start)?;
            Cusum::new(k, side.h(), head_start)?
        }
        (_, Some(arl0), None) => Cusum::with_arl0(k, arl0, head_start)?,
        (None, None, _) => return Err(Error::new("neither --h nor --arl0 is given")),
    };
    let side = chart.up();
    let one_sided = [side.arl(0.0), side.arl(shift)];
    let [arl0, arl1] = if arguments.one_sided { one_sided } else { [chart.arl(0.0), chart.arl(shift)] };
    let run_length =
        |mean: f64| if arguments.one_sided { side.run_length(mean) } else { chart.run_length(mean) };
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
        detector: "cusum",
        k: Some(k),
        lambda: None,
        h: side.h(),
        shift,
        arl0,
        arl1,
        one_sided: Some(one_sided),
        run_lengths: Some([run_length(0.0), run_length(shift)]),
        drift_arl: arguments.slope.map(|slope| side.drift_arl(slope)).transpose()?,
        lower: None,
        commissioned,
    })
}

fn ewma(arguments: &Arguments) -> Result<Design> {
    let given = [
        ("--k", arguments.k.is_some()),
        ("--head-start", arguments.head_start.is_some()),
        ("--windows", arguments.windows.is_some()),
        ("--ratio", arguments.ratio.is_some()),
        ("--beta", arguments.beta.is_some()),
        ("--slope", arguments.slope.is_some()),
        ("--mission", arguments.mission.is_some()),
        ("--one-sided", arguments.one_sided),
    ];
    refuse(&given, "an EWMA")?;
    let shift = shift(arguments, 1.0)?;
    let lambda = arguments.lambda.unwrap_or(0.1);
    let chart = match (arguments.h, arguments.arl0) {
        (Some(limit), _) => Ewma::new(lambda, limit)?,
        (_, Some(arl0)) => Ewma::with_arl0(lambda, arl0)?,
        (None, None) => return Err(Error::new("neither --h nor --arl0 is given")),
    };
    let [arl0, arl1] = [chart.arl(0.0), chart.arl(shift)];
    Ok(Design {
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

fn shewhart(arguments: &Arguments) -> Result<Design> {
    let given = [
        ("--k", arguments.k.is_some()),
        ("--head-start", arguments.head_start.is_some()),
        ("--windows", arguments.windows.is_some()),
        ("--ratio", arguments.ratio.is_some()),
        ("--beta", arguments.beta.is_some()),
        ("--lambda", arguments.lambda.is_some()),
    ];
    refuse(&given, "a Shewhart chart")?;
    let shift = shift(arguments, 1.0)?;
    let chart = match (arguments.h, arguments.arl0, arguments.one_sided) {
        (Some(h), _, true) => Shewhart::new(h, f64::INFINITY)?,
        (Some(h), _, false) => Shewhart::new(h, h)?,
        (_, Some(arl0), true) => Shewhart::one_sided_with_arl0(arl0)?,
        (_, Some(arl0), false) => Shewhart::with_arl0(arl0)?,
        (None, None, _) => return Err(Error::new("neither --h nor --arl0 is given")),
    };
    let side = Shewhart::new(chart.upper(), f64::INFINITY)?;
    Ok(Design {
        detector: "shewhart",
        k: None,
        lambda: None,
        h: chart.upper(),
        shift,
        arl0: chart.arl(0.0),
        arl1: chart.arl(shift),
        one_sided: Some([side.arl(0.0), side.arl(shift)]),
        run_lengths: Some([chart.run_length(0.0), chart.run_length(shift)]),
        drift_arl: arguments.slope.map(|slope| chart.drift_arl(slope)).transpose()?,
        lower: None,
        commissioned: None,
    })
}

fn sprt(arguments: &Arguments) -> Result<Design> {
    let given = [
        ("--head-start", arguments.head_start.is_some()),
        ("--windows", arguments.windows.is_some()),
        ("--slope", arguments.slope.is_some()),
        ("--mission", arguments.mission.is_some()),
        ("--lambda", arguments.lambda.is_some()),
    ];
    refuse(&given, "an SPRT")?;
    let k = k(arguments)?;
    let shift = shift(arguments, 2.0 * k)?;
    let alternative = Alternative::new(2.0 * k, arguments.ratio.unwrap_or(1.0))?;
    let beta = arguments.beta.unwrap_or(0.01);
    if !(beta > 0.0 && beta < 1.0) {
        return Err(Error::new(format!("beta is {beta}")).allowed("between 0 and 1"));
    }
    let lower = beta.ln();
    let sides = if arguments.one_sided { 1.0 } else { 2.0 };
    let test = match (arguments.h, arguments.arl0) {
        (Some(h), _) => Sprt::new(alternative, lower, h)?,
        // In control both sides have the same run length, and together half of it.
        (_, Some(arl0)) => Sprt::repeated_with_arl0(alternative, lower, arl0 * sides)?,
        (None, None) => return Err(Error::new("neither --h nor --arl0 is given")),
    };
    let one_sided = [0.0, shift].map(|mean| test.repeated_arl(mean, 1.0));
    let [arl0, arl1] =
        if arguments.one_sided { one_sided } else { [0.0, shift].map(|mean| test.two_sided_arl(mean, 1.0)) };
    Ok(Design {
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

fn as_json(arguments: &Arguments, design: &Design) -> Value {
    let quantiles = |run: &RunLength| {
        let [p05, p50, p95] = QUANTILES.map(|p| run.quantile(p));
        json!({ "p05": p05, "p50": p50, "p95": p95 })
    };
    let mut all = json!({
        "detector": design.detector,
        "unit": "decisions",
        "sides": if arguments.one_sided { 1 } else { 2 },
        "k": design.k,
        "h": design.h,
        "shift": design.shift,
        "arl0": design.arl0,
        "arl1": design.arl1,
        "one_sided": design.one_sided.map(|[arl0, arl1]| json!({ "arl0": arl0, "arl1": arl1 })),
        "quantiles": design.run_lengths.as_ref().map(|[in_control, shifted]| {
            json!({ "in_control": quantiles(in_control), "shifted": quantiles(shifted) })
        }),
    });
    if let Some(lambda) = design.lambda {
        all["lambda"] = json!(lambda);
    }
    if design.detector == "cusum" {
        all["head_start"] = json!(arguments.head_start.unwrap_or(0.0));
    }
    if let Some(lower) = design.lower {
        all["lower"] = json!(lower);
        all["ratio"] = json!(arguments.ratio.unwrap_or(1.0));
    }
    if let (Some(slope), Some(arl)) = (arguments.slope, design.drift_arl) {
        all["drift"] = json!({ "slope": slope, "arl": arl });
    }
    if let (Some(mission), Some([in_control, shifted])) = (arguments.mission, &design.run_lengths) {
        all["mission"] = json!({
            "decisions": mission,
            "false_alarm_probability": in_control.alarm_within(mission),
            "alarm_probability": shifted.alarm_within(mission),
        });
    }
    if let (Some(windows), Some([p05, p10, p50, p90])) = (arguments.windows, design.commissioned) {
        all["baseline"] = json!({
            "windows": windows,
            "confidence": arguments.arl0.map(|_| arguments.confidence),
            "arl0_quantiles": { "p05": p05, "p10": p10, "p50": p50, "p90": p90 },
        });
    }
    if let Some(hop_s) = arguments.hop_s {
        all["hop_s"] = json!(hop_s);
        all["arl0_hours"] = json!(design.arl0 * hop_s / 3600.0);
        all["arl1_hours"] = json!(design.arl1 * hop_s / 3600.0);
    }
    all
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
        (Some(k), None) => format!("k = {k}, h = {:.6} sigmas", design.h),
        _ => match design.lambda {
            Some(lambda) => format!("lambda = {lambda}, limit h = {:.6} sigmas", design.h),
            None => format!("limit h = {:.6} sigmas", design.h),
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
        "alarm after        {found} on average, the mean having moved by {} sigmas (ARL1)",
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
