//! `paper.json`: every number, with the published one beside it where there is one.

use drift_core::Index;
use serde_json::{Value, json};

use super::baseline::{NominalRelation, OverSeeds};
use super::delay::{Delay, DelayStudy, SchemeResult};
use super::detection::DetectionCase;
use super::line;
use super::overlap::{HealthyChart, Overlap};
use super::published;
use super::ranking::{Rank, Ranking};
use super::spread::{Share, Spread};
use super::{Paper, settings};
use crate::calibrate::regression::Fit;

pub(super) fn text(paper: &Paper) -> String {
    let value = json!({
        "settings": made_with(paper),
        "eigenvalues": {
            "ours": paper.eigenvalues.iter().map(complex).collect::<Vec<_>>(),
            "published": published::EIGENVALUES.iter().map(complex).collect::<Vec<_>>(),
        },
        "baseline": baseline(&paper.baseline),
        "ranking": paper.rankings.first().map_or(Value::Null, |r| ranks(r, true)),
        "ranking_other_readings": paper.rankings.iter().skip(1).map(|r| json!({
            "sigma_growth": r.reading.says,
            "ranking": ranks(r, false),
        })).collect::<Vec<_>>(),
        "detection": paper.detection.iter().map(detection).collect::<Vec<_>>(),
        "overlap": overlap(&paper.overlap),
        "delay": delay(&paper.delay),
    });
    // Of plain numbers and text there is nothing that can't be written.
    let mut text = format!("{value:#}");
    text.push('\n');
    text
}

fn made_with(paper: &Paper) -> Value {
    let s = &paper.settings;
    json!({
        "seed": s.seed,
        "sample_time_s": settings::SAMPLE_TIME_S,
        "reference": {
            "mean": settings::REFERENCE_MEAN,
            "sd": settings::REFERENCE_SD,
            "hold_ticks": settings::HOLD_TICKS,
        },
        "window_s": settings::WINDOW_S,
        "hop_s": settings::HOP_S,
        "short_run_s": settings::SHORT_RUN_S,
        "long_run_s": settings::LONG_RUN_S,
        "index": "iae",
        "mu_levels": settings::MU_LEVELS,
        "kp": settings::KP,
        "sigma_levels": settings::SIGMA_LEVELS,
        "sigma_growth": paper.rankings.first().map(|r| r.reading.says),
        "cusum": { "k": settings::CUSUM_K, "h": settings::CUSUM_H },
        "shewhart_limit": settings::SHEWHART_LIMIT,
        "sprt": { "shift": settings::SPRT_SHIFT, "alpha": settings::SPRT_ERROR, "beta": settings::SPRT_ERROR },
        "filter_s": settings::FILTER_S,
        "repeats": s.repeats,
        "healthy_runs": s.healthy_runs,
        "streams": s.streams,
        "stream_s": s.stream_s,
        "delay_runs": s.delay_runs,
        "delay_onset_s": settings::DELAY_ONSET_S,
        "delay_cap_s": settings::DELAY_CAP_S,
        "false_alarm_every_s": settings::FALSE_ALARM_EVERY_S,
    })
}

fn complex((re, im): &(f64, f64)) -> Value {
    json!([re, im])
}

fn spread(s: &Spread) -> Value {
    json!({ "n": s.n, "mean": s.mean, "se": s.se, "median": s.median, "min": s.min, "max": s.max })
}

fn share(s: &Share) -> Value {
    json!({ "share": s.share, "se": s.se })
}

fn fit(l: &Fit) -> Value {
    json!({
        "b0": l.b0, "b1": l.b1,
        "b0_ci95": l.b0_ci95, "b1_ci95": l.b1_ci95,
        "b0_ci95_hac": l.b0_ci95_hac, "b1_ci95_hac": l.b1_ci95_hac,
        "r2": l.r2, "adj_r2": l.adj_r2, "rmse": l.rmse, "n": l.n, "lag1": line::lag1(&l.residuals),
    })
}

fn baseline(ours: &NominalRelation) -> Value {
    let theirs = &published::BASELINE;
    let mut value = fit(&ours.line);
    value["published"] = json!({
        "b0": theirs.b0, "b1": theirs.b1,
        "b0_ci95": [theirs.b0_ci95.0, theirs.b0_ci95.1], "b1_ci95": [theirs.b1_ci95.0, theirs.b1_ci95.1],
        "r2": theirs.r2, "adj_r2": theirs.adj_r2, "rmse": theirs.rmse,
    });
    value["over_seeds"] = over_seeds(&ours.over_seeds);
    value["over_seeds_with_kp_200"] = over_seeds(&ours.with_other_kp);
    value["with_itae"] = fit(&ours.itae);
    value["itae_per_iae_s"] = json!(ours.itae_per_iae);
    value
}

fn over_seeds(over: &OverSeeds) -> Value {
    json!({
        "b0": spread(&over.b0), "b1": spread(&over.b1), "r2": spread(&over.r2),
        "rmse": spread(&over.rmse), "lag1": spread(&over.lag1),
    })
}

pub(super) fn name(index: Index) -> &'static str {
    match index {
        Index::Iae => "iae",
        Index::Ise => "ise",
        Index::Itae => "itae",
        Index::Itse => "itse",
    }
}

fn ranks(ranking: &Ranking, beside_published: bool) -> Value {
    let of = |rank: &Rank| {
        let mut value = json!({
            "index": name(rank.index), "delta_mu": rank.delta_mu, "delta_sigma": rank.delta_sigma,
            "ratio": rank.ratio(),
        });
        let theirs = published::RANKING.iter().find(|p| p.index == rank.index);
        if let (true, Some(p)) = (beside_published, theirs) {
            value["published"] =
                json!({ "delta_mu": p.delta_mu, "delta_sigma": p.delta_sigma, "ratio": p.ratio });
        }
        value
    };
    ranking.ranks.iter().map(of).collect()
}

fn detection(case: &DetectionCase) -> Value {
    let run = &case.run;
    let theirs = published::DETECTION.iter().find(|p| p.mu_max == run.mu_max && run.sigma_growth == 0.0);
    json!({
        "mu_max": run.mu_max,
        "sigma_growth": run.sigma_growth,
        "shewhart_outside_pct": run.outside_pct(),
        "cusum_s": run.cusum_s(),
        "sprt_s": run.sprt_s(),
        "b0_fault": run.fault.b0,
        "b1_fault": run.fault.b1,
        "published": theirs.map(|p| json!({ "cusum_s": p.cusum_s, "sprt_s": p.sprt_s, "says": p.says })),
        "over_seeds": {
            "shewhart_outside_pct": spread(&case.outside_pct),
            "cusum_s": spread(&case.cusum_s),
            "sprt_s": spread(&case.sprt_s),
            "b0_shift": spread(&case.b0_shift),
            "b1_ratio": spread(&case.b1_ratio),
        },
        "monitor": {
            "verdict": run.verdict,
            "fault_curve": run.fault_curve,
        },
    })
}

fn overlap(study: &Overlap) -> Value {
    let chart = |c: &HealthyChart| {
        json!({
            "says": c.says, "hop_s": c.hop_s, "h": c.h, "alarmed_in_100_s": share(&c.alarmed),
            "between_false_alarms_s": c.between_s.as_ref().map(spread),
        })
    };
    json!({
        "lag1_overlapping": spread(&study.lag1_overlapping),
        "lag1_hop_is_window": study.lag1_apart,
        "textbook_arl0_decisions": study.textbook_arl0,
        "healthy_runs": study.runs,
        "charts": study.charts.iter().map(chart).collect::<Vec<_>>(),
    })
}

fn delay(study: &DelayStudy) -> Value {
    let at_mu = |d: &Delay| {
        json!({
            "mu_max": d.mu_max, "delay_s": spread(&d.delay_s),
            "detected_in_ramp": share(&d.within_ramp), "alarmed": share(&d.alarmed),
        })
    };
    let scheme = |result: &SchemeResult| {
        json!({
            "scheme": result.scheme.name,
            "hop_s": result.scheme.hop_s(),
            "h": result.h,
            "between_false_alarms_s": spread(&result.between_false_alarms_s),
            "ramp_then_hold": result.holding.iter().map(at_mu).collect::<Vec<_>>(),
            "ramp_goes_on": result.going_on.iter().map(at_mu).collect::<Vec<_>>(),
        })
    };
    json!({
        "runs": study.runs,
        "schemes": study.schemes.iter().map(scheme).collect::<Vec<_>>(),
        "effects_at_mu_max_1": study.effects.iter().map(|e| json!({
            "channel": e.channel, "lag1": e.lag1, "mean_sigmas": spread(&e.mean_sigmas), "last_sigmas": spread(&e.last_sigmas),
        })).collect::<Vec<_>>(),
    })
}
