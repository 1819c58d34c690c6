//! What repeats, over time or over position: the strongest lines of the innovations' spectrum, each with the size and the phase that two
//! small trials tell.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

use crate::estimate::hypothesis::{Hypothesis, Point};
use crate::estimate::lanes::LANES;
use crate::estimate::likelihood::rows_of_each;
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
/// Waves over the way up to which each is tried, and how many of the best are tried with half a wave more and less.
const FEW_WAVES: usize = 16;
const REFINED: usize = 3;
/// Waves by which two lines over the way differ.
const APART: f64 = 2.0 / std::f64::consts::PI;
/// Bins of the way that the innovations are summed in, and how many times finer than one wave over the way waves are tried.
const BINS: usize = 8 * MOST_WAVES as usize;
const PADDED: usize = 4;

/// The waves.
pub fn waves(base: &Base<'_>, kind: &'static Kind, over: Over) -> Option<Vec<Begin>> {
    let mut begins = Vec::new();
    match over {
        Over::Time => begins.extend(of_lines(base, kind, &over_time(base)?)),
        Over::Position => {
            let way = Way::of(base)?;
            let most = way.resolved();
            let mut lines = way.waves()?;
            let few = (1..=FEW_WAVES).map(|waves| waves as f64).filter(|waves| *waves <= most);
            lines.extend(few.map(|waves| way.length(waves)));
            begins = of_lines(base, kind, &lines);
            begins.sort_by(|a: &(f64, Begin), b| b.1.score.total_cmp(&a.1.score));
            let best: Vec<f64> = begins.iter().take(REFINED).map(|(line, _)| way.way / line).collect();
            let between = best.iter().flat_map(|waves| [waves - 0.5, waves + 0.5]);
            let few = between.filter(|waves| (1.0..=most.min(FEW_WAVES as f64 + 1.0)).contains(waves));
            let finer: Vec<f64> = few.map(|waves| way.length(waves)).collect();
            begins.extend(of_lines(base, kind, &finer));
        }
    }
    Some(begins.into_iter().map(|(_, begin)| begin).collect())
}

/// A wave of some length, and two small trials of it.
struct Line {
    length: f64,
    hypothesis: Hypothesis,
    /// The base's point.
    from: Point,
    trials: [Point; 2],
}

impl Line {
    fn of(base: &Base<'_>, kind: &'static Kind, length: f64, level: f64) -> Self {
        // The parameter's scale follows from the length of the wave.
        let hypothesis = wider(base, kind, vec![0.0, length, 0.0]);
        let from = hypothesis.widen(&base.fit.hypothesis, &base.fit.point);
        let trials = [0.0, std::f64::consts::FRAC_PI_2]
            .map(|phase| hypothesis.started(&from, &Start::of(vec![level, length, phase]), 0.0));
        Self { length, hypothesis, from, trials }
    }

    /// With the size and the phase that the answers to its trials tell, per unit of size.
    fn begin(self, base: &Base<'_>, sine: &[f64], cosine: &[f64]) -> Option<(f64, Begin)> {
        let (ss, cc, sc) = (dot(sine, sine), dot(cosine, cosine), dot(sine, cosine));
        let (zs, zc) = (-dot(sine, &base.rest), -dot(cosine, &base.rest));
        let determinant = ss * cc - sc * sc;
        if determinant <= 1e-12 * ss * cc {
            return None;
        }
        let (a, b) = ((zs * cc - zc * sc) / determinant, (zc * ss - zs * sc) / determinant);
        let score = base.fall(a * zs + b * zc);
        let start = Start::of(vec![libm::hypot(a, b), self.length, libm::atan2(b, a)]);
        let point = self.hypothesis.started(&self.from, &start, 0.0);
        Some((self.length, Begin { score, hypothesis: self.hypothesis, point, onset_s: 0.0 }))
    }
}

/// The waves of these lengths.
fn of_lines(base: &Base<'_>, kind: &'static Kind, lengths: &[f64]) -> Vec<(f64, Begin)> {
    let level = TRIAL * base.fit.hypothesis.scales.drive;
    let lines = |lengths: &[f64]| -> Vec<Line> {
        lengths.iter().map(|length| Line::of(base, kind, *length, level)).collect()
    };
    // The trials of two run side by side.
    let pairs = lengths.chunks(LANES / 2).map(lines);
    let begins = pairs.flat_map(|pair| {
        let trials = pair.iter().flat_map(|line| line.trials.iter().map(|point| (&line.hypothesis, point)));
        let rows = rows_of_each(&trials.collect::<Vec<_>>(), base.data, &base.cache);
        let mut answers = rows.into_iter().map(|rows| Some(base.answer(&rows?, level)));
        let of_each: Vec<_> =
            pair.iter().map(|_| answers.next().flatten().zip(answers.next().flatten())).collect();
        pair.into_iter().zip(of_each).filter_map(|(line, answers)| {
            let (sine, cosine) = answers?;
            line.begin(base, &sine, &cosine)
        })
    });
    begins.collect()
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

/// The way of the first recording, and what was not foretold along it.
struct Way<'a> {
    positions: Vec<f64>,
    low: f64,
    way: f64,
    z: &'a [f64],
}

impl<'a> Way<'a> {
    /// `None` where nothing moves.
    fn of(base: &'a Base<'_>) -> Option<Self> {
        let signals = base.data.recordings.first()?;
        let length = signals.len().min(*base.data.fitted.first()?);
        let y = held(signals.y.get(..length)?);
        let positions = match &base.fit.hypothesis.model.plant {
            Plant::Servo(servo) if servo.output == Output::Speed => integral(&y, signals.sample_time_s),
            _ => y,
        };
        let low = positions.iter().copied().fold(f64::INFINITY, f64::min);
        let high = positions.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let z = base.fit.rows.z.get(..length)?;
        (high > low).then_some(Self { positions, low, way: high - low, z })
    }

    /// The length of a wave of which so many lie on the way, in the unit of the position.
    fn length(&self, waves: f64) -> f64 {
        self.way / waves
    }

    /// Waves over the way, at most, that a force can be told from noise by: at rest a step is the sensor's noise.
    fn resolved(&self) -> f64 {
        let least = SAMPLES_OF_A_WAVE * usual_step(&self.positions).max(1e-300);
        (self.way / least).min(MOST_WAVES)
    }

    /// The lengths of the strongest lines of the spectrum over the way. Of few waves on a way that is not travelled evenly it tells little.
    fn waves(&self) -> Option<Vec<f64>> {
        let n = self.positions.len() as f64;
        let mean = self.z.iter().sum::<f64>() / n;
        let resolved = self.resolved();
        let of_samples = Waves::over(&self.positions, self.low, self.way, |_| 1.0)?;
        let of_z = Waves::over(&self.positions, self.low, self.way, |i| self.z[i] - mean)?;
        let power = |i: usize| of_z.at(i).norm_sqr() / (n - of_samples.at(i).norm_sqr() / n).max(1e-9 * n);
        let mut tried: Vec<(f64, f64)> = (PADDED..(resolved * PADDED as f64) as usize)
            .map(|i| (power(i), i as f64 / PADDED as f64))
            .collect();
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut strongest: Vec<f64> = Vec::new();
        for (_, waves) in tried {
            if strongest.iter().all(|other| (other - waves).abs() > APART) {
                strongest.push(waves);
            }
            if strongest.len() > LINES {
                break;
            }
        }
        Some(strongest.into_iter().map(|waves| self.length(waves)).collect())
    }
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
