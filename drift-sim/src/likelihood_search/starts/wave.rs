//! What repeats, over time or over position: the strongest lines of the innovations' spectrum, each with the size and the phase that two
//! small trials tell.

use realfft::RealFftPlanner;

use crate::estimate::measure::integral;
use crate::estimate::signals::held;
use crate::physics::{Kind, Over, Start};
use crate::plant::{Output, Plant};

use super::{Base, Begin, dot, wider};

/// Size of a trial, in the drive's deviation.
const TRIAL: f64 = 0.05;
/// Lines tried.
const LINES: usize = 4;
/// Wave numbers tried over position: from one to this many waves over the way, this far apart.
const MOST_WAVES: f64 = 130.0;
const WAVE_STEP: f64 = 0.35;
/// Samples that are enough for the spectrum over position.
const ENOUGH: usize = 4000;

/// The waves.
pub fn waves(base: &Base<'_>, kind: &'static Kind, over: Over) -> Option<Vec<Begin>> {
    let scales = &base.fit.hypothesis.scales;
    let lines = match over {
        Over::Time => over_time(base)?,
        Over::Position => over_position(base)?,
    };
    let mut begins = Vec::new();
    for line in lines {
        // The parameter's scale follows from the length of the wave.
        let own = wider(base, kind, vec![0.0, line, 0.0]);
        let from = own.widen(&base.fit.hypothesis, &base.fit.point);
        let trial = |phase: f64| {
            let level = TRIAL * scales.drive;
            let point = own.started(&from, &Start::of(vec![level, line, phase]), 0.0);
            let rows = base.rows(&own, &point)?;
            let difference = rows.z.iter().zip(&base.fit.rows.z).map(|(a, b)| (a - b) / level);
            Some(base.project(difference.collect()))
        };
        let (Some(sine), Some(cosine)) = (trial(0.0), trial(std::f64::consts::FRAC_PI_2)) else { continue };
        let (ss, cc, sc) = (dot(&sine, &sine), dot(&cosine, &cosine), dot(&sine, &cosine));
        let (zs, zc) = (-dot(&sine, &base.rest), -dot(&cosine, &base.rest));
        let determinant = ss * cc - sc * sc;
        if determinant <= 1e-12 * ss * cc {
            continue;
        }
        let (a, b) = ((zs * cc - zc * sc) / determinant, (zc * ss - zs * sc) / determinant);
        let score = base.fall(a * zs + b * zc);
        let start = Start::of(vec![libm::hypot(a, b), line, libm::atan2(b, a)]);
        let point = own.started(&from, &start, 0.0);
        begins.push(Begin { score, hypothesis: own, point, onset_s: 0.0 });
    }
    Some(begins)
}

/// Frequencies in Hz.
fn over_time(base: &Base<'_>) -> Option<Vec<f64>> {
    let ts = base.fit.hypothesis.model.sample_time_s;
    let duration = base.fit.hypothesis.scales.duration_s;
    let longest = base.data.recordings.iter().map(|s| s.len()).max()?;
    let size = (4 * longest).next_power_of_two();
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(size);
    let mut power = vec![0.0; size / 2 + 1];
    let mut first = 0;
    for (signals, fitted) in base.data.recordings.iter().zip(&base.data.fitted) {
        let length = signals.len().min(*fitted);
        let mut z = base.fit.rows.z.get(first..first + length)?.to_vec();
        first += length;
        z.resize(size, 0.0);
        let mut out = transform.make_output_vec();
        transform.process(&mut z, &mut out).ok()?;
        power.iter_mut().zip(&out).for_each(|(sum, x)| *sum += x.norm_sqr());
    }
    let hz = |i: usize| i as f64 / (size as f64 * ts);
    let place = |hz: f64| ((hz * size as f64 * ts) as usize).min(power.len());
    let (low, high) = (place(1.5 / duration), place((0.1 / ts).min(400.0 / duration)));
    power.iter_mut().enumerate().filter(|(i, _)| *i < low || *i >= high).for_each(|(_, p)| *p = 0.0);
    let mut lines = Vec::new();
    for _ in 0..LINES {
        let (at, best) = power.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
        if *best <= 0.0 {
            break;
        }
        lines.push(hz(at));
        power.iter_mut().skip(at.saturating_sub(4)).take(9).for_each(|p| *p = 0.0);
    }
    Some(lines)
}

/// Periods in the unit of the position.
fn over_position(base: &Base<'_>) -> Option<Vec<f64>> {
    let signals = base.data.recordings.first()?;
    let length = signals.len().min(*base.data.fitted.first()?);
    let y = held(signals.y.get(..length)?);
    let positions = match &base.fit.hypothesis.model.plant {
        Plant::Servo(servo) if servo.output == Output::Speed => integral(&y, signals.sample_time_s),
        _ => y,
    };
    let low = positions.iter().copied().fold(f64::INFINITY, f64::min);
    let high = positions.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let way = high - low;
    if way <= 0.0 {
        return None;
    }
    // Neighbours are averaged where there are more samples than the spectrum needs: the force changes slowly against them.
    let every = (length / ENOUGH).max(1);
    let thin = |x: &[f64]| -> Vec<f64> {
        x.chunks(every).map(|part| part.iter().sum::<f64>() / part.len() as f64).collect()
    };
    let (z, positions) = (thin(base.fit.rows.z.get(..length)?), thin(&positions));
    let base_wave = std::f64::consts::TAU / way;
    let count = ((MOST_WAVES - 1.0) / WAVE_STEP) as usize;
    let power = |wave: f64| {
        let (mut s, mut c, mut zs, mut zc) = (0.0, 0.0, 0.0, 0.0);
        for (z, x) in z.iter().zip(&positions) {
            let (sine, cosine) = (libm::sin(wave * x), libm::cos(wave * x));
            s += sine;
            c += cosine;
            zs += z * sine;
            zc += z * cosine;
        }
        let n = z.len() as f64;
        let mean = z.iter().sum::<f64>() / n;
        let (zs, zc) = (zs - mean * s, zc - mean * c);
        (zs * zs + zc * zc) / (n - (s * s + c * c) / n).max(1e-9 * n)
    };
    let mut tried: Vec<(f64, f64)> = (0..count)
        .map(|i| {
            let wave = base_wave * (1.0 + WAVE_STEP * i as f64);
            (power(wave), wave)
        })
        .collect();
    tried.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut waves: Vec<f64> = Vec::new();
    for (_, wave) in tried {
        if waves.iter().all(|other| (other - wave).abs() > 4.0 / way) {
            waves.push(wave);
        }
        if waves.len() > LINES {
            break;
        }
    }
    Some(waves.into_iter().map(|wave| std::f64::consts::TAU / wave).collect())
}
