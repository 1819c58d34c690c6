//! The file's text, written by hand: `f32` in the fewest digits, tables in reading order.

use std::fmt::Write as _;

use drift_core::{Detectors, Index};

use super::{BaselineFile, ChannelEntry, SCHEMA};

pub(super) fn write(file: &BaselineFile) -> String {
    let mut text = String::new();
    // Writing into a String can't fail.
    let _ = head(&mut text, file);
    for entry in &file.channels {
        let _ = channel(&mut text, entry);
    }
    text
}

fn head(text: &mut String, file: &BaselineFile) -> std::fmt::Result {
    let (timing, samples, decision) = (&file.timing, &file.samples, &file.decision);
    writeln!(text, "schema = \"{SCHEMA}\"\n")?;
    writeln!(
        text,
        "[timing]   # window = window_blocks*block_ticks ticks, a decision every hop_blocks blocks"
    )?;
    writeln!(text, "sample_time_s = {}", float(timing.sample_time_s))?;
    writeln!(text, "block_ticks = {}", timing.block_ticks)?;
    writeln!(text, "window_blocks = {}", timing.window_blocks)?;
    writeln!(text, "hop_blocks = {}\n", timing.hop_blocks)?;
    writeln!(text, "[samples]\nmin_valid = {}", float(samples.min_valid))?;
    if let Some(s) = &samples.saturation {
        writeln!(text, "saturation = {{ u_min = {}, u_max = {} }}", float(s.u_min), float(s.u_max))?;
    }
    if let Some(b) = &samples.blanking {
        let step = float(b.reference_step);
        writeln!(text, "blanking = {{ reference_step = {step}, ticks = {} }}", b.ticks)?;
    }
    writeln!(text, "\n[decision]\nconfirm_hops = {}", decision.confirm_hops)?;
    writeln!(text, "log_odds = {}", float(decision.log_odds))?;
    writeln!(text, "smallest_shift = {}", float(decision.smallest_shift))?;
    if let Some(promise) = &file.promise {
        writeln!(text, "\n[promise]   # of all channels and detectors together")?;
        writeln!(text, "false_alarm_every_h = {:?}", promise.false_alarm_every_h)?;
        writeln!(text, "decisions = {:?}", promise.decisions)?;
        writeln!(text, "confidence = {:?}", promise.confidence)?;
    }
    if let Some(point) = &file.operating_point {
        let columns: Vec<String> = point.columns.iter().map(|c| string(c)).collect();
        let scales: Vec<String> = point.scales.iter().map(|x| float(*x)).collect();
        writeln!(text, "\n[operating_point]   # the monitor's number is the sum of scale*column")?;
        writeln!(text, "columns = [{}]\nscales = [{}]", columns.join(", "), scales.join(", "))?;
    }
    let files: Vec<String> = file.calibration.files.iter().map(|f| string(f)).collect();
    writeln!(text, "\n[calibration]\nfiles = [{}]", files.join(", "))?;
    writeln!(text, "windows = {}", file.calibration.windows)?;
    writeln!(text, "effective_windows = {:?}", file.calibration.effective_windows)
}

fn channel(text: &mut String, entry: &ChannelEntry) -> std::fmt::Result {
    let channel = &entry.channel;
    writeln!(text, "\n[[channel]]\nkind = \"{}\"", channel.kind.name())?;
    if let Some(index) = channel.kind.index() {
        writeln!(text, "index = \"{}\"", index_name(index))?;
    }
    let detectors = &channel.detectors;
    if entry.learned() {
        let b = &channel.baseline;
        writeln!(text, "\n[channel.baseline]")?;
        let numbers = [
            ("b0", b.b0),
            ("b1", b.b1),
            ("sigma", b.sigma),
            ("windows", b.windows),
            ("x_mean", b.x_mean),
            ("x_ss", b.x_ss),
            ("x_min", b.x_min),
            ("x_max", b.x_max),
        ];
        numbers.iter().try_for_each(|(key, x)| writeln!(text, "{key} = {}", float(*x)))?;
    }
    if channel.memory.order > 0 {
        let m = &channel.memory;
        let list = |of: &[f32]| of.iter().map(|x| float(*x)).collect::<Vec<_>>().join(", ");
        writeln!(text, "\n[channel.memory]\norder = {}", m.order)?;
        writeln!(text, "x = [{}]\nvalue = [{}]", list(&m.x), list(&m.value))?;
    }
    if channel.operating_point.counts() {
        let p = &channel.operating_point;
        writeln!(text, "\n[channel.operating_point]")?;
        let numbers = [
            ("weight", p.weight),
            ("mean", p.mean),
            ("per_x", p.per_x),
            ("ss", p.ss),
            ("min", p.min),
            ("max", p.max),
        ];
        numbers.iter().try_for_each(|(key, x)| writeln!(text, "{key} = {}", float(*x)))?;
    }
    if *detectors != Detectors::NONE {
        writeln!(text, "\n[channel.detectors]")?;
    }
    for row in Detectors::ROWS {
        let mut numbers = Vec::new();
        if (row.numbers)(detectors, &mut |x| numbers.push(float(x))) {
            let pairs: Vec<String> =
                row.fields.iter().zip(&numbers).map(|(name, x)| format!("{name} = {x}")).collect();
            writeln!(text, "{} = {{ {} }}", row.name, pairs.join(", "))?;
        }
    }
    if let Some(s) = &entry.statistics {
        writeln!(text, "\n[channel.statistics]\nn = {}\nn_effective = {:?}", s.n, s.n_effective)?;
        writeln!(text, "b0_ci95 = {:?}\nb1_ci95 = {:?}", s.b0_ci95, s.b1_ci95)?;
        writeln!(text, "r2 = {:?}\nadj_r2 = {:?}\nrmse = {:?}", s.r2, s.adj_r2, s.rmse)?;
        writeln!(text, "lag1 = {:?}\nskewness = {:?}", s.lag1, s.skewness)?;
    }
    Ok(())
}

pub(super) fn index_name(index: Index) -> &'static str {
    match index {
        Index::Iae => "iae",
        Index::Ise => "ise",
        Index::Itae => "itae",
        Index::Itse => "itse",
    }
}

/// The fewest digits that give the same `f32` back, also by way of the `f64` that TOML readers make of them.
fn float(x: f32) -> String {
    let short = format!("{x:?}");
    match short.parse::<f64>() {
        Ok(back) if back as f32 == x => short,
        _ => format!("{:?}", f64::from(x)),
    }
}

fn string(s: &str) -> String {
    toml::Value::String(s.to_owned()).to_string()
}
