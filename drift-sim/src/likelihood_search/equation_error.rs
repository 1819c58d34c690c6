//! Plants with two poles by equation error (Ljung 1999, "System Identification", 7.3): the regression of y on its last two values and on u, in means over so many samples. Noise biases
//! each of them, the more the shorter the means, and a fast loop the more the longer; one that is near enough for a fit is all that is asked. A mode that hardly decays is seldom
//! found another way: a fit from another frequency ends there.

use nalgebra::{DMatrix, DVector};
use realfft::num_complex::Complex;

use crate::estimate::signals::Signals;
use crate::plant::{Plant, StateSpace, TransferFunction};

/// Means of one, two, four samples and so on are tried, so many of them, as long as a recording has so many means.
const MEANS: u32 = 8;
const LEAST: usize = 200;
/// Frequency at which the gain of fast motion is read, in radians for each mean.
const FAST: f64 = 0.5;
/// Part of the largest pivot below which the regressors are taken to say the same.
const SINGULAR: f64 = 1e-12;

/// The plants, each from means over another number of samples, with two poles that are stable.
pub fn plants(of: &[Signals]) -> Vec<Plant> {
    let longest = of.iter().map(Signals::len).max().unwrap_or(0);
    let factors = (0..MEANS).map(|i| 1 << i).take_while(|factor| longest / factor >= LEAST);
    let means = |factor| of.iter().map(|signals| in_means(signals, factor)).collect::<Vec<_>>();
    factors.filter_map(|factor| regressed(&means(factor))).flat_map(|found| found.plants()).collect()
}

/// y and u in means over the same samples: what u does in them shows in y's.
fn in_means(signals: &Signals, factor: usize) -> Signals {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let all = |column: &Vec<f64>| column.chunks_exact(factor).map(mean).collect();
    Signals {
        sample_time_s: factor as f64 * signals.sample_time_s,
        y: all(&signals.y),
        u: all(&signals.u),
        ..Signals::default()
    }
}

/// `y[n] = a[0] y[n-1] + a[1] y[n-2] + b[0] u[n] + b[1] u[n-1] + b[2] u[n-2]` and a constant.
struct Regression {
    sample_time_s: f64,
    a: [f64; 2],
    b: [f64; 3],
    /// u at y = 0 and at rest, with its sign turned:
    offset: f64,
}

/// Regressors, the constant among them.
const COUNT: usize = 6;

fn regressed(of: &[Signals]) -> Option<Regression> {
    let scale = |values: fn(&Signals) -> &Vec<f64>| {
        let known = || of.iter().flat_map(values).filter(|value| value.is_finite());
        let mean = known().sum::<f64>() / known().count().max(1) as f64;
        let size = known().map(|value| (value - mean) * (value - mean)).sum::<f64>();
        (mean, libm::sqrt(size / known().count().max(1) as f64))
    };
    let ((y_mean, y_size), (u_mean, u_size)) = (scale(|signals| &signals.y), scale(|signals| &signals.u));
    let mut products = DMatrix::zeros(COUNT, COUNT);
    let mut along = DVector::zeros(COUNT);
    for signals in of {
        for (y, u) in signals.y.windows(3).zip(signals.u.windows(3)) {
            let (&[y2, y1, y0], &[u2, u1, u0]) = (y, u) else { continue };
            let [y0, y1, y2] = [y0, y1, y2].map(|y| (y - y_mean) / y_size);
            let [u0, u1, u2] = [u0, u1, u2].map(|u| (u - u_mean) / u_size);
            let row = DVector::from_column_slice(&[y1, y2, u0, u1, u2, 1.0]);
            if y0.is_finite() && row.iter().all(|value| value.is_finite()) {
                products += &row * row.transpose();
                along += row * y0;
            }
        }
    }
    let factor = products.cholesky()?;
    let pivots = factor.l_dirty().diagonal();
    if pivots.min() < libm::sqrt(SINGULAR) * pivots.max() {
        return None;
    }
    let found = factor.solve(&along);
    let gain = y_size / u_size;
    let number = |i: usize| found.get(i).copied().filter(|value| value.is_finite());
    let (a, b) = ([number(0)?, number(1)?], [number(2)?, number(3)?, number(4)?]);
    // In deviations of y and u: y (1 - a0 - a1) = (b0 + b1 + b2) u + a constant.
    let (static_y, static_u) = (1.0 - a.iter().sum::<f64>(), b.iter().sum::<f64>());
    let u_of_mean = (static_y * (-y_mean / y_size) - number(5)?) / static_u;
    Some(Regression {
        sample_time_s: of.first()?.sample_time_s,
        a,
        b: b.map(|b| gain * b),
        offset: -(u_mean + u_size * u_of_mean),
    })
}

impl Regression {
    /// The same in continuous time: `(fast s + slow) / (s^2 + damping s + stiffness)`, of which poles, static gain and the answer to fast motion are those of the regression.
    fn plants(&self) -> Vec<Plant> {
        let Some([damping, stiffness, fast, slow]) = self.numbers() else { return Vec::new() };
        let swings = state_space(damping, stiffness, fast, slow);
        swings.into_iter().chain(transfer_function(damping, stiffness, fast, slow, self.offset)).collect()
    }

    /// Damping, stiffness, and what u does fast and slowly; `None` where it is not stable.
    fn numbers(&self) -> Option<[f64; 4]> {
        let ts = self.sample_time_s;
        let (sum, product) = (self.a[0], -self.a[1]);
        let apart = 0.25 * sum * sum - product;
        let (damping, stiffness) = if apart < 0.0 {
            let pole = Complex::new(0.5 * sum, libm::sqrt(-apart)).ln() / ts;
            (-2.0 * pole.re, pole.norm_sqr())
        } else {
            let root = libm::sqrt(apart);
            let [p, q] = [0.5 * sum + root, 0.5 * sum - root].map(|pole| -libm::log(pole) / ts);
            (p + q, p * q)
        };
        if !(damping > 0.0 && stiffness > 0.0 && damping.is_finite() && stiffness.is_finite()) {
            return None;
        }
        let answer = |angle: f64| {
            let late = Complex::from_polar(1.0, -angle);
            (self.b[0] + self.b[1] * late + self.b[2] * late * late)
                / (1.0 - self.a[0] * late - self.a[1] * late * late)
        };
        let slow = answer(0.0).re * stiffness;
        let rate = FAST / ts;
        let denominator = Complex::new(stiffness - rate * rate, damping * rate);
        let fast = (answer(FAST) * denominator).im / rate;
        Some([damping, stiffness, fast, slow])
    }
}

/// The plant in two states, of which y is the first, and which u moves alone; the second has the zero's rate.
fn state_space(damping: f64, stiffness: f64, fast: f64, slow: f64) -> Option<Plant> {
    let zero = slow / fast;
    let coupling = zero * (damping - zero) - stiffness;
    let each = libm::sqrt(coupling.abs());
    let plant = StateSpace {
        a: vec![vec![zero - damping, each], vec![each.copysign(coupling), -zero]],
        b: vec![fast, 0.0],
        c: vec![1.0, 0.0],
        d: 0.0,
    };
    let is_finite = plant.a.iter().flatten().chain([&fast]).all(|value| value.is_finite() && *value != 0.0);
    is_finite.then_some(Plant::StateSpace(plant))
}

/// The plant that a vessel behind a line is: its zero is no unstable one.
fn transfer_function(damping: f64, stiffness: f64, fast: f64, slow: f64, offset: f64) -> Option<Plant> {
    let num = vec![fast / stiffness, slow / stiffness];
    let den = vec![1.0 / stiffness, damping / stiffness, 1.0];
    let is_finite = num.iter().chain(&den).chain([&offset]).all(|value| value.is_finite());
    let plant = TransferFunction { num, den, delay_s: 0.0, offset };
    (is_finite && slow * fast > 0.0).then_some(Plant::TransferFunction(plant))
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    use super::*;
    use crate::estimate::noise::sequence;

    /// A mode of 2.26 rad/s with a damping ratio of 0.075 and a zero at 0.17 under a proportional law of gain 260, whose y carries noise: its state by the exact step of a millisecond, written
    /// out as a rotation.
    #[test]
    fn a_mode_that_a_fast_loop_hides_is_found() {
        let (decay, rate, ts) = (0.17, 2.26, 1e-3);
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let noise = sequence(30_000, 1e-3, 0.0, &mut random);
        let (mut x, mut v) = (0.0, 0.0);
        let (mut y, mut u) = (Vec::new(), Vec::new());
        let shrunk = libm::exp(-decay * ts);
        let (c, s) = (shrunk * libm::cos(rate * ts), shrunk * libm::sin(rate * ts));
        for (n, noise) in noise.iter().enumerate() {
            let r = if (n / 5_000) % 2 == 0 { 1.0 } else { -1.0 };
            y.push(x + noise);
            u.push(260.0 * (r - x - noise));
            x += ts * u[n];
            (x, v) = (c * x + s * v, c * v - s * x);
        }
        let found = plants(&[Signals { y, u, sample_time_s: ts, ..Signals::default() }]);
        let is_near = |plant: &Plant| {
            let Plant::StateSpace(StateSpace { a, b, .. }) = plant else { return false };
            let sum = -a[0][0] - a[1][1];
            let product = a[0][0] * a[1][1] - a[0][1] * a[1][0];
            (libm::sqrt(product) / libm::hypot(rate, decay) - 1.0).abs() < 0.03
                && (0.5 * sum / decay - 1.0).abs() < 0.5
                && (b[0] - 1.0).abs() < 0.1
                && (-a[1][1] / decay - 1.0).abs() < 0.5
        };
        assert!(found.iter().any(is_near), "{found:?}");
    }
}
