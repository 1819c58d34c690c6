//! The missing drive: the force, heat or flow that the recorded motion needed beyond what the model applied.
//!
//! The prediction error of the refitted model is what a linear plant makes of that drive, plus sensor noise. A Kalman
//! smoother on the plant with a random-walk drive undoes it and gives a band for free (Rauch, Tung & Striebel 1965). How
//! fast the drive may walk is chosen by likelihood.

use nalgebra::{DMatrix, DVector};

use crate::plant::{StateSpace, zero_order_hold};

use super::fit::mean_square;

/// The drive that the model lacks, in the drive's unit, added to the drive.
#[derive(Debug, Clone)]
pub struct MissingDrive {
    /// At each sample.
    pub value: Vec<f64>,
    /// Its standard deviation once the filter has settled.
    pub deviation: f64,
}

/// The plant, sampled, with the drive as one more state.
struct Augmented {
    f: DMatrix<f64>,
    c: DVector<f64>,
}

impl Augmented {
    fn of(plant: &StateSpace, sample_time_s: f64) -> Option<Self> {
        let held = zero_order_hold::discretise(plant, sample_time_s).ok()?;
        let n = plant.order();
        let f = DMatrix::from_fn(n + 1, n + 1, |row, column| match (row < n, column < n) {
            (true, true) => held.phi.get(row * n + column).copied().unwrap_or(0.0),
            (true, false) => held.gamma.get(row).copied().unwrap_or(0.0),
            (false, true) => 0.0,
            (false, false) => 1.0,
        });
        let c = DVector::from_fn(n + 1, |row, _| plant.c.get(row).copied().unwrap_or(0.0));
        Some(Self { f, c })
    }
}

/// Constant gains of the settled filter and smoother.
struct Gains {
    kalman: DVector<f64>,
    smoother: DMatrix<f64>,
    innovation: f64,
    deviation: f64,
}

fn settle(model: &Augmented, walk: f64, noise: f64) -> Option<Gains> {
    let n = model.f.nrows();
    let mut p = DMatrix::identity(n, n) * (noise + walk).max(1e-12);
    let (mut kalman, mut innovation) = (DVector::zeros(n), noise);
    let (mut predicted, mut filtered) = (p.clone(), p.clone());
    for _ in 0..20_000 {
        predicted = &model.f * &p * model.f.transpose();
        predicted[(n - 1, n - 1)] += walk;
        innovation = model.c.dot(&(&predicted * &model.c)) + noise;
        let next = &predicted * &model.c / innovation;
        filtered = &predicted - &next * next.transpose() * innovation;
        filtered = (&filtered + filtered.transpose()) * 0.5;
        let moved = (&next - &kalman).norm();
        kalman = next;
        p.copy_from(&filtered);
        if moved <= 1e-9 * kalman.norm() {
            break;
        }
    }
    // An undetectable state's covariance grows for ever, without reaching the output: keep it out of the inverse.
    let inverse = predicted.clone().pseudo_inverse(1e-12 * predicted.norm()).ok()?;
    let smoother = &filtered * model.f.transpose() * inverse;
    let ok = kalman.iter().chain(smoother.iter()).all(|v| v.is_finite());
    let deviation = libm::sqrt(filtered[(n - 1, n - 1)].max(0.0));
    ok.then_some(Gains { kalman, smoother, innovation, deviation })
}

impl MissingDrive {
    /// From the prediction error of a model of the plant; `None` where the plant has no linear description.
    pub fn of(plant: &StateSpace, error: &[f64], sample_time_s: f64) -> Option<Self> {
        let model = Augmented::of(plant, sample_time_s)?;
        let noise = noise_floor(error);
        let scale = drive_scale(plant, error, sample_time_s);
        let best = (0..9)
            .filter_map(|i| {
                let walk = scale * scale * libm::pow(10.0, f64::from(i) - 8.0);
                let gains = settle(&model, walk, noise)?;
                Some((likelihood(&model, &gains, error), gains))
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(smooth(&model, &best.1, error))
    }
}

/// Sensor noise, from second differences: what changes from sample to sample faster than a plant can.
pub fn noise_floor(error: &[f64]) -> f64 {
    let second: Vec<f64> = error.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]).collect();
    (mean_square(&second) / 6.0).max(1e-30)
}

/// A drive that would make errors of the size seen: by the plant's largest gain over the recording.
fn drive_scale(plant: &StateSpace, error: &[f64], sample_time_s: f64) -> f64 {
    let Ok(held) = zero_order_hold::discretise(plant, sample_time_s) else { return 1.0 };
    let n = plant.order();
    let mut x = vec![0.0; n];
    let mut largest: f64 = 0.0;
    for _ in 0..error.len().min(5000) {
        x = (0..n)
            .map(|row| {
                let moved: f64 =
                    (0..n).map(|k| held.phi.get(row * n + k).copied().unwrap_or(0.0) * x[k]).sum();
                moved + held.gamma.get(row).copied().unwrap_or(0.0)
            })
            .collect();
        let y: f64 = x.iter().zip(&plant.c).map(|(x, c)| x * c).sum();
        largest = largest.max(y.abs());
    }
    libm::sqrt(mean_square(error)) / largest.max(1e-300)
}

fn likelihood(model: &Augmented, gains: &Gains, error: &[f64]) -> f64 {
    let mut sum = 0.0;
    filter(model, gains, error, |_, innovation| sum += innovation * innovation);
    let n = error.len() as f64;
    -0.5 * (n * libm::log(gains.innovation.max(1e-300)) + sum / gains.innovation)
}

fn filter(model: &Augmented, gains: &Gains, error: &[f64], mut each: impl FnMut(&DVector<f64>, f64)) {
    let n = model.f.nrows();
    let (mut x, mut next) = (DVector::zeros(n), DVector::zeros(n));
    for e in error {
        let innovation = e - model.c.dot(&x);
        x.axpy(innovation, &gains.kalman, 1.0);
        each(&x, innovation);
        next.gemv(1.0, &model.f, &x, 0.0);
        x.copy_from(&next);
    }
}

fn smooth(model: &Augmented, gains: &Gains, error: &[f64]) -> MissingDrive {
    let n = model.f.nrows();
    let mut filtered: Vec<DVector<f64>> = Vec::with_capacity(error.len());
    filter(model, gains, error, |x, _| filtered.push(x.clone()));
    let mut value = vec![0.0; error.len()];
    let mut later: Option<DVector<f64>> = None;
    for (slot, x) in value.iter_mut().zip(&filtered).rev() {
        let smoothed = match &later {
            None => x.clone(),
            Some(later) => x + &gains.smoother * (later - &model.f * x),
        };
        *slot = smoothed[n - 1];
        later = Some(smoothed);
    }
    MissingDrive { value, deviation: gains.deviation }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A load of 2 that switches on at half time, through a first-order plant, comes out as itself.
    #[test]
    fn a_step_of_drive_is_recovered() {
        let plant = StateSpace { a: vec![vec![-0.5]], b: vec![0.5], c: vec![1.0], d: 0.0 };
        let held = zero_order_hold::discretise(&plant, 0.1).unwrap();
        let mut y = 0.0;
        let error: Vec<f64> = (0..2000)
            .map(|n| {
                let drive = if n >= 1000 { -2.0 } else { 0.0 };
                let now = y + 0.01 * libm::sin(n as f64 * 1.7);
                y = held.phi[0] * y + held.gamma[0] * drive;
                now
            })
            .collect();
        let missing = MissingDrive::of(&plant, &error, 0.1).unwrap();
        assert!((missing.value[1500] + 2.0).abs() < 0.1, "{}", missing.value[1500]);
        assert!(missing.value[500].abs() < 0.1);
    }
}
