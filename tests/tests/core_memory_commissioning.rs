//! A memory of earlier windows learnt in place: against `calibrate` on the same windows.

use drift_core::{
    Channel, ChannelKind, Commissioning, Config, Everything, Full, FullAt, Index, LearntOrder, Memory,
    MemoryCommissioning, Monitor, NotReady, Order, OrderAt, StateError,
};
use drift_sim::baseline_file::{MOST_COLUMNS, Timing};
use drift_sim::calibrate::{Calibration, Options, WindowRow, calibrate_windows};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Ticks per window, 0.1 s each.
pub(crate) const WINDOW: u32 = 150;
pub(crate) const KINDS: [ChannelKind; 3] =
    [ChannelKind::EnergyError(Index::Iae), ChannelKind::Effort, ChannelKind::Activity];

/// A lag under a PI that follows levels, with sensor noise and a slow random load; r, y, u of each tick.
pub(crate) struct Loop {
    lag: f64,
    kp: f64,
    ki: f64,
    noise: f64,
    random: ChaCha8Rng,
    levels: ChaCha8Rng,
    state: [f64; 5],
    ticks: usize,
}

impl Loop {
    fn new(lag: f64, (kp, ki): (f64, f64), noise: f64, seed: u64) -> Self {
        let random = ChaCha8Rng::seed_from_u64(seed);
        let levels = ChaCha8Rng::seed_from_u64(seed ^ 0xabcd);
        Self { lag, kp, ki, noise, random, levels, state: [1.0, 1.0, 1.0, 0.0, 1.0], ticks: 0 }
    }

    /// `load` is taken off the drive.
    pub(crate) fn tick(&mut self, load: f64) -> [f64; 3] {
        let mut normal = || -> f64 { StandardNormal.sample(&mut self.random) };
        let [mut level, mut r, mut integral, mut slow, mut x] = self.state;
        if self.ticks.is_multiple_of(225) {
            level = self.levels.random_range(0.5..1.5);
        }
        let keep: f64 = 1.0 - 1.0 / 300.0;
        r += (level - r) / 30.0;
        slow = keep * slow + 0.01 * (1.0 - keep * keep).sqrt() * normal();
        let y = x + self.noise * normal();
        let e = r - y;
        integral += self.ki * e;
        let u = self.kp * e + integral;
        x += (u - slow - load - x) / self.lag;
        self.state = [level, r, integral, slow, x];
        self.ticks += 1;
        [r, y, u]
    }
}

pub(crate) fn loops(seed: u64) -> [(&'static str, Loop); 3] {
    [
        ("slow", Loop::new(120.0, (2.0, 0.02), 0.01, seed)),
        ("fast, noisy", Loop::new(20.0, (0.8, 0.04), 0.1, seed)),
        ("slowest", Loop::new(300.0, (1.5, 0.01), 0.003, seed)),
    ]
}

pub(crate) fn unlearned<N: drift_core::Number>() -> Config<N, 3> {
    Config::new(0.1, WINDOW, 1, KINDS.map(Channel::unlearned))
}

/// A count of the converter.
const UNIT: f64 = 1.0 / 8192.0;

/// What the effort channel learns of so many windows, and the windows.
fn learnt<K: LearntOrder>(
    mut of: Loop,
    windows: usize,
    counts: bool,
) -> (MemoryCommissioning<K>, Vec<WindowRow>) {
    let mut floats = Monitor::<f32, Full, Everything<1>, 3>::new(unlearned()).unwrap();
    let config = unlearned::<i32>().with_units(UNIT as f32, UNIT as f32);
    let mut integers = Monitor::<i32, Full, Everything<1>, 3>::new(config).unwrap();
    let mut learning = MemoryCommissioning::of_channel(1);
    let mut rows = Vec::new();
    while rows.len() < windows {
        let sample = of.tick(0.0);
        let report = if counts {
            let [r, y, u] = sample.map(|v| (v / UNIT).round() as i32);
            integers.tick(r, y, u)
        } else {
            let [r, y, u] = sample.map(|v| v as f32);
            floats.tick(r, y, u)
        };
        let Some(report) = report else { continue };
        learning.learn(report);
        rows.push(WindowRow {
            recording: 0,
            hop: report.hop,
            end_s: f64::from(report.hop + 1) * 15.0,
            x: report.channels.each_ref().map(|c| c.x),
            value: report.channels.each_ref().map(|c| c.value),
            columns: [0.0; MOST_COLUMNS],
        });
    }
    (learning, rows)
}

fn calibrated(rows: &[WindowRow], order: Option<u8>) -> Calibration {
    let timing = Timing { sample_time_s: 0.1, block_ticks: WINDOW, window_blocks: 1, hop_blocks: 1 };
    let options = Options {
        channels: [false, true, false],
        detectors: "cusum".parse().unwrap(),
        effort_memory: order,
        simulated_decisions: 20_000,
        false_alarm_every_h: 1.0,
        ..Options::default()
    };
    calibrate_windows(rows.to_vec(), timing, &options).unwrap()
}

/// The largest of each coefficient's difference times the standard deviation of its regressor, in sigmas: how far apart two
/// monitors' residuals would be.
fn apart(rows: &[WindowRow], host: &Calibration, of: &MemoryCommissioning<Order<3>>, order: u8) -> f64 {
    let (baseline, _, memory) = of.relation_of(usize::from(order)).unwrap();
    let entry = host.channels[0].entry().channel;
    assert_eq!((memory.order, entry.memory.order), (order, order));
    let deviation = |of: &dyn Fn(&WindowRow) -> f32| {
        let mean = rows.iter().map(|r| f64::from(of(r))).sum::<f64>() / rows.len() as f64;
        (rows.iter().map(|r| (f64::from(of(r)) - mean).powi(2)).sum::<f64>() / rows.len() as f64).sqrt()
    };
    let (x_sd, value_sd) = (deviation(&|r| r.x[1]), deviation(&|r| r.value[1]));
    let mut worst = f64::from(baseline.b1 - entry.baseline.b1).abs() * x_sd;
    for j in 0..Memory::MOST {
        worst = worst.max(f64::from(memory.x[j] - entry.memory.x[j]).abs() * x_sd);
        worst = worst.max(f64::from(memory.value[j] - entry.memory.value[j]).abs() * value_sd);
    }
    // Where the relation lies in the middle of the windows.
    let x = f64::from(baseline.x_mean);
    let value = rows.iter().map(|r| f64::from(r.value[1])).sum::<f64>() / rows.len() as f64;
    let level = |b: &drift_core::Baseline, m: &Memory| {
        let [a, c] = [m.x, m.value].map(|m| m.iter().map(|&m| f64::from(m)).sum::<f64>());
        f64::from(b.b0) + (f64::from(b.b1) + a) * x + c * value
    };
    let levels = level(&baseline, &memory) - level(&entry.baseline, &entry.memory);
    let sigma =
        f64::from(baseline.sigma) / (1.0 + 2.0 * f64::from(order) / f64::from(baseline.windows)).sqrt();
    let scale = sigma / f64::from(entry.baseline.sigma);
    assert!((scale - 1.0).abs() < 2e-3, "order {order}: sigma {scale} of the host's");
    assert!((f64::from(baseline.x_mean) - f64::from(entry.baseline.x_mean)).abs() < 1e-5);
    worst.max(levels.abs()) / sigma
}

/// Floats and counts, three loops, each order: the residuals of what is learnt in place in `f32` and of what `calibrate` makes in
/// `f64` of the same windows are within a hundredth of a standard deviation.
#[test]
fn the_learnt_memory_is_that_of_calibrate() {
    let mut worst: f64 = 0.0;
    for counts in [false, true] {
        for windows in [210, 600] {
            for (name, of) in loops(7) {
                let (learning, rows) = learnt::<Order<3>>(of, windows, counts);
                assert_eq!(learning.windows(), windows as u32 - 3);
                for order in 1..=3u8 {
                    // The host has a row more for each order less: those that this learner can't have.
                    let host = calibrated(&rows[3 - usize::from(order)..], Some(order));
                    let apart = apart(&rows, &host, &learning, order);
                    let visible = host.channels[0].memory.visible();
                    println!(
                        "{name}, counts {counts}, {windows} windows, order {order}: {apart:.1e} sigma apart, visible {visible:.2}"
                    );
                    worst = worst.max(apart);
                }
            }
        }
    }
    println!("worst {worst:.1e}");
    assert!(worst < 0.01, "{worst} sigmas");
}

/// In place an order is chosen by what it predicts, on the host by the simulated delay of a shift, which takes a computer: they
/// differ in the order, by one as a rule, not in whether there is a memory.
#[test]
fn a_memory_is_taken_where_calibrate_takes_one() {
    let (mut same, mut near, mut memory, mut all) = (0, 0, 0, 0);
    for windows in [110, 160, 210, 400, 800] {
        for seed in 0..8 {
            for (_, of) in loops(100 + seed) {
                let (learning, rows) = learnt::<Order<3>>(of, windows, false);
                let host = calibrated(&rows, None).channels[0].memory.order;
                let here = learning.relation().unwrap().2.order;
                same += usize::from(host == here);
                near += usize::from(host.abs_diff(here) <= 1);
                memory += usize::from((host > 0) == (here > 0));
                all += 1;
            }
        }
    }
    println!("of {all}: the same order in {same}, within one in {near}; a memory or none in {memory}");
    assert!(memory * 20 >= all * 19 && near * 10 >= all * 8, "{memory}, {near} of {all}");
}

/// Windows of a relation with memory, one number after the other: x wanders, the value follows.
pub(crate) struct Windows {
    random: ChaCha8Rng,
    x: [f32; 3],
    value: [f32; 2],
    own: [f32; 2],
}

impl Windows {
    pub(crate) fn new(seed: u64, own: [f32; 2]) -> Self {
        Self { random: ChaCha8Rng::seed_from_u64(seed), x: [5.0; 3], value: [20.0; 2], own }
    }

    pub(crate) fn next(&mut self, shift: f32) -> (f32, f32) {
        let mut normal = || -> f32 { StandardNormal.sample(&mut self.random) };
        let [x1, x2, _] = self.x;
        let x = 5.0 + 0.5 * (x1 - 5.0) + normal();
        let [v1, v2] = self.value;
        let level = 20.0 * (1.0 - self.own[0] - self.own[1]);
        let value = level + 2.0 * (x - 5.0) - 0.7 * (x1 - 5.0)
            + 0.2 * (x2 - 5.0)
            + self.own[0] * v1
            + self.own[1] * v2
            + 0.3 * normal()
            + shift;
        (self.x, self.value) = ([x, x1, x2], [value, v1]);
        (x, value)
    }
}

/// One tick is one window: x = mean y, value = mean u.
pub(crate) fn one_tick(channel: Channel) -> Monitor<f32, Full, Everything<1>, 1> {
    Monitor::new(Config::new(1.0, 1, 1, [channel])).unwrap()
}

#[test]
fn what_the_windows_cannot_carry_is_refused() {
    let learn = |windows: u32, next: &mut dyn FnMut(u32) -> (f32, f32, f32)| {
        let mut learning = MemoryCommissioning::<OrderAt<3>>::of_channel(2);
        for hop in 0..windows {
            let (x, value, point) = next(hop);
            learning.learn_window(hop, x, value, point);
        }
        learning
    };
    let mut healthy = Windows::new(1, [0.4, 0.1]);
    let few = learn(102, &mut |_| {
        let (x, value) = healthy.next(0.0);
        (x, value, f32::NAN)
    });
    let refused = NotReady::TooFewWindows { windows: 99, needed: 100 };
    assert_eq!(few.relation(), Err(refused));
    let mut channel = Channel::unlearned(ChannelKind::Effort);
    assert_eq!(few.finish(&mut channel), Err(refused));
    assert_eq!(channel, Channel::unlearned(ChannelKind::Effort), "nothing is written");
    assert!(few.relation_of(0).is_ok());
    // With a point 25 more are needed; one that stands still, or goes with x alone, can't be learnt.
    let mut healthy = Windows::new(2, [0.4, 0.1]);
    let still = learn(300, &mut |_| {
        let (x, value) = healthy.next(0.0);
        (x, value, 21.5)
    });
    assert_eq!(still.relation(), Err(NotReady::PointStandsStill { channel: 2 }));
    let mut healthy = Windows::new(2, [0.4, 0.1]);
    let along = learn(300, &mut |_| {
        let (x, value) = healthy.next(0.0);
        (x, value, 3.0 - 2.0 * x)
    });
    assert_eq!(along.relation(), Err(NotReady::PointStandsStill { channel: 2 }));
    // A loop that stands still, and one that scatters by its rounding alone.
    for wobble in [0.0, 1e-7f32] {
        let constant = learn(300, &mut |hop| (5.0, 0.3 * (1.0 + wobble * (hop % 3) as f32), f32::NAN));
        assert_eq!(constant.relation(), Err(NotReady::NoScatter { channel: 2 }));
    }
    // What holds no number is a hole: three windows behind it are not held against those before it.
    let mut healthy = Windows::new(3, [0.4, 0.1]);
    let holes = learn(400, &mut |hop| {
        let (x, value) = healthy.next(0.0);
        (x, if hop % 10 == 9 { f32::NAN } else { value }, f32::NAN)
    });
    assert_eq!(holes.windows(), 40 * 6);
    let mut skipped = MemoryCommissioning::<Order<3>>::of_channel(0);
    for hop in (0..400).filter(|hop| hop % 10 != 9) {
        let (x, value) = healthy.next(0.0);
        skipped.learn_window(hop, x, value, f32::NAN);
    }
    assert_eq!(skipped.windows(), 40 * 6);
    // Numbers that would overflow are passed over.
    let before = holes;
    let mut after = holes;
    for hop in 400..420 {
        after.learn_window(hop, 1e30, -1e38, f32::NAN);
    }
    assert_eq!((after.windows(), after.relation()), (before.windows(), before.relation()));
}

/// x that stands still, or a past that goes with it, has no coefficient; the rest is learnt.
#[test]
fn what_does_not_vary_has_no_coefficient() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut learning = MemoryCommissioning::<Order<2>>::of_channel(0);
    let mut value = 0.0f32;
    for hop in 0..2000 {
        let noise: f32 = StandardNormal.sample(&mut random);
        value = 0.6 * value + noise;
        learning.learn_window(hop, 7.0, 100.0 + value, f32::NAN);
    }
    let (baseline, _, memory) = learning.relation_of(1).unwrap();
    assert_eq!((baseline.b1, baseline.x_ss, memory.x), (0.0, 0.0, [0.0; 3]));
    assert!((memory.value[0] - 0.6).abs() < 0.05 && (baseline.sigma - 1.0).abs() < 0.05, "{memory:?}");
    assert!((baseline.b0 - 40.0).abs() < 5.0, "{baseline:?}");
}

/// A value that is a random walk asks for a sum of 1: it is held where a fifth of a lasting shift stays visible, as `calibrate`
/// holds it.
#[test]
fn the_sum_of_its_own_coefficients_is_held() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut learning = MemoryCommissioning::<Order<3>>::of_channel(1);
    let (mut x, mut value, mut rows) = (0.0f32, 0.0f32, Vec::new());
    for hop in 0..500u32 {
        let mut normal = || -> f32 { StandardNormal.sample(&mut random) };
        x = 0.7 * x + normal();
        value += 0.2 * normal();
        let window = (x, 3.0 + 2.0 * x + value);
        learning.learn_window(hop, window.0, window.1, f32::NAN);
        rows.push(WindowRow {
            recording: 0,
            hop,
            end_s: f64::from(hop),
            x: [window.0; 3],
            value: [window.1; 3],
            columns: [0.0; MOST_COLUMNS],
        });
    }
    for order in 1..=3u8 {
        let (.., memory) = learning.relation_of(usize::from(order)).unwrap();
        assert!((memory.visible() - 0.2).abs() < 1e-5, "order {order}: {}", memory.visible());
        let mut channel = Channel::unlearned(ChannelKind::Effort);
        channel.memory = memory;
        one_tick(channel);
        let host = calibrated(&rows[3 - usize::from(order)..], Some(order));
        let apart = apart(&rows, &host, &learning, order);
        println!("order {order}: {apart:.1e} sigma apart");
        assert!(apart < 0.01, "order {order}: {apart} sigmas");
    }
}

/// Weight and memory at once: value = 1 + 2 x + 0.25 point + 0.4 of the value before.
#[test]
fn a_point_is_learnt_beside_the_memory() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let config: Config<f32, 1> = Config::new(1.0, 1, 1, [Channel::unlearned(ChannelKind::Effort)]);
    let mut monitor = Monitor::<f32, FullAt, Everything<1>, 1>::new(config).unwrap();
    let mut learning = MemoryCommissioning::<OrderAt<3>>::of_channel(0);
    let mut value = 10.0f32;
    for _ in 0..3000 {
        let x: f32 = random.random_range(4.0..16.0);
        let point = 20.0 + 0.5 * x + random.random_range(-3.0..3.0f32);
        let noise: f32 = StandardNormal.sample(&mut random);
        value = 1.0 + 2.0 * x + 0.25 * point + 0.4 * value + 0.05 * noise;
        learning.learn_at(monitor.tick_at(x, x, value, point).unwrap());
    }
    let (baseline, point, memory) = learning.relation().unwrap();
    let near =
        |got: f32, want: f32, within: f32| assert!((got - want).abs() < within, "{got} instead of {want}");
    near(baseline.b0, 1.0, 0.05);
    near(baseline.b1, 2.0, 2e-3);
    near(point.weight, 0.25, 2e-3);
    near(memory.value[0], 0.4, 5e-3);
    near(baseline.sigma, 0.05, 2e-3);
    // What x does not explain of the point: a uniform number's variance of 3, from each window.
    near(point.ss / baseline.windows, 3.0, 0.3);
    near(point.per_x, 0.5, 0.03);
    assert!((point.min..point.max).contains(&point.mean));
}

#[test]
fn learning_a_memory_survives_a_reset() {
    let config: Config<f32, 1> = Config::new(1.0, 1, 1, [Channel::unlearned(ChannelKind::Effort)]);
    let mut healthy = Windows::new(9, [0.4, 0.1]);
    let mut learning = MemoryCommissioning::<Order<2>>::of_channel(0);
    let mut learn = |into: &mut [&mut MemoryCommissioning<Order<2>>], hops: std::ops::Range<u32>| {
        for hop in hops {
            let (x, value) = healthy.next(0.0);
            into.iter_mut().for_each(|l| l.learn_window(hop, x, value, f32::NAN));
        }
    };
    learn(&mut [&mut learning], 0..50);
    let mut bytes = [0; MemoryCommissioning::<Order<2>>::STATE_BYTES];
    assert_eq!(learning.save(&config, &mut bytes[..40]), Err(StateError::BufferTooSmall));
    assert_eq!(learning.save(&config, &mut bytes), Ok(bytes.len()));
    let fresh = MemoryCommissioning::<Order<2>>::of_channel(0);
    let mut restored = fresh;
    for at in 0..bytes.len() {
        let mut damaged = bytes;
        damaged[at] ^= 4;
        assert!(restored.restore(&config, &damaged).is_err(), "byte {at}");
        assert!(restored.restore(&config, &bytes[..at]).is_err(), "{at} bytes");
        assert_eq!(restored, fresh);
    }
    restored.restore(&config, &bytes).unwrap();
    learn(&mut [&mut learning, &mut restored], 50..300);
    assert_eq!(restored, learning);
    // Another length of memory is another learner.
    let mut other = MemoryCommissioning::<OrderAt<2>>::of_channel(0);
    assert_eq!(other.restore(&config, &bytes), Err(StateError::OtherMonitor));
    assert!(Commissioning::<1>::new().restore(&config, &bytes).is_err());
}
