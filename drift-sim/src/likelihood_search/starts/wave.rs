//! What repeats, over time or over position: the strongest lines of the innovations' spectrum, each with the size and the phase that two
//! small trials tell.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

use crate::estimate::measure::integral;
use crate::estimate::signals::held;
use crate::physics::{Kind, Over, Start};
use crate::plant::{Output, Plant};

use super::{Base, Begin, dot, wider};

/// Size of a trial, in the drive's deviation.
const TRIAL: f64 = 0.05;
/// Lines tried.
const LINES: usize = 4;
/// Waves over the way, at most; and how many samples one takes at least at the usual speed: in fewer a force can't be told from noise.
const MOST_WAVES: f64 = 2000.0;
const SAMPLES_OF_A_WAVE: f64 = 4.0;
/// Waves over the way up to which each is tried, by halves.
const FEW_WAVES: usize = 16;
/// Bins of the way that the innovations are summed in, and how many times finer than one wave over the way waves are tried.
const BINS: usize = 8 * MOST_WAVES as usize;
const PADDED: usize = 4;

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
    let z = base.fit.rows.z.get(..length)?;
    let mean = z.iter().sum::<f64>() / length as f64;
    let waves_resolved = (way / (SAMPLES_OF_A_WAVE * usual_step(&positions).max(1e-300))).min(MOST_WAVES);
    let of_samples = Waves::over(&positions, low, way, |_| 1.0)?;
    let of_z = Waves::over(&positions, low, way, |i| z[i] - mean)?;
    let n = length as f64;
    let power = |i: usize| of_z.at(i).norm_sqr() / (n - of_samples.at(i).norm_sqr() / n).max(1e-9 * n);
    let base_wave = std::f64::consts::TAU / way;
    let mut tried: Vec<(f64, f64)> = (PADDED..(waves_resolved * PADDED as f64) as usize)
        .map(|i| (power(i), base_wave * i as f64 / PADDED as f64))
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
    // Of few waves on a way that is not travelled evenly a spectrum tells little: each is tried.
    let few = (2..=2 * FEW_WAVES).map(|halves| base_wave * halves as f64 / 2.0);
    Some(few.chain(waves).map(|wave| std::f64::consts::TAU / wave).collect())
}

/// A signal's waves over position: its samples are summed in bins of the way, which one transform takes.
struct Waves {
    transformed: Vec<Complex<f64>>,
}

impl Waves {
    fn over(positions: &[f64], low: f64, way: f64, signal: impl Fn(usize) -> f64) -> Option<Self> {
        let mut bins = vec![0.0; PADDED * BINS];
        for (i, x) in positions.iter().enumerate() {
            let bin = ((x - low) / way * BINS as f64) as usize;
            *bins.get_mut(bin.min(BINS - 1))? += signal(i);
        }
        let transform = RealFftPlanner::<f64>::new().plan_fft_forward(bins.len());
        let mut transformed = transform.make_output_vec();
        transform.process(&mut bins, &mut transformed).ok()?;
        Some(Self { transformed })
    }

    /// What a wave takes of it of which so many, over [`PADDED`], lie on the way.
    fn at(&self, waves: usize) -> Complex<f64> {
        self.transformed.get(waves).copied().unwrap_or_default()
    }
}

/// How far the position moves in a sample, where it moves.
fn usual_step(positions: &[f64]) -> f64 {
    let mut steps: Vec<f64> = positions.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    steps.retain(|step| *step > 0.0);
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}
