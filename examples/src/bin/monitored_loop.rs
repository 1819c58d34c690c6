//! A PI loop as a firmware has it, with the monitor in its tick: learns its baseline in place, then watches.
//!
//! ```sh
//! cargo run --release -p drift-examples --bin monitored_loop
//! ```
//!
//! The plant is a small heater, simulated here in five lines. From hour 40 on its sensor drifts by 0.2 degC an hour: the
//! temperature shown stays at the set-point, the real one does not.

use drift_core::{
    Channel, ChannelKind, Commissioning, Config, Cusum, Detectors, FullMonitor, Index, Shewhart, Verdict,
};

const TICK_S: f32 = 1.0;
const KINDS: [ChannelKind; 3] =
    [ChannelKind::EnergyError(Index::Iae), ChannelKind::Effort, ChannelKind::Activity];
/// 8 blocks of 150 s: windows of 20 minutes, far longer than the loop's own time constants.
const LEARNING: Config<f32, 3> = Config::new(
    TICK_S,
    150,
    8,
    [Channel::unlearned(KINDS[0]), Channel::unlearned(KINDS[1]), Channel::unlearned(KINDS[2])],
);
/// One window in many thousands alarms falsely if the baseline is known well: `drift design --k 0.5 --arl0 20000`.
const DETECTORS: Detectors = Detectors {
    cusum: Some(Cusum::new(0.5, 8.75)),
    shewhart: Some(Shewhart::symmetric(6.0)),
    ..Detectors::NONE
};

/// Plant, sensor and controller: what the monitor looks at from outside.
struct Heater {
    temperature: f32,
    integral: f32,
    tick: u32,
    random: u32,
}

impl Heater {
    /// The next (r, y, u).
    fn tick(&mut self) -> (f32, f32, f32) {
        // Every 20 minutes another set-point, so that the loop has something to do.
        let r = 60.0 + ((self.tick / 1200).wrapping_mul(7919) % 11) as f32 - 5.0;
        let drift = (self.tick.saturating_sub(40 * 3600)) as f32 * (0.2 / 3600.0);
        let y = self.temperature + drift + 0.02 * self.noise();
        let e = r - y;
        self.integral += 0.025 * e * TICK_S;
        let u = (4.0 * e + self.integral).clamp(0.0, 100.0);
        self.temperature += (21.0 + 0.8 * u - self.temperature) / 180.0 * TICK_S;
        self.tick += 1;
        (r, y, u)
    }

    /// Four bytes of a linear congruential generator, added up: near enough to Gaussian.
    fn noise(&mut self) -> f32 {
        self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let sum: f32 = self.random.to_le_bytes().iter().map(|b| f32::from(*b)).sum();
        (sum - 510.0) / 148.0
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut heater = Heater { temperature: 60.0, integral: 48.0, tick: 0, random: 1 };
    let mut learning = FullMonitor::<f32, 8>::new(LEARNING)?;
    let mut commissioning = Commissioning::<3>::new();
    while commissioning.windows() < 100 {
        let (r, y, u) = heater.tick();
        if let Some(report) = learning.tick(r, y, u) {
            commissioning.learn(report);
        }
    }
    println!(
        "learnt from {} windows of {} s",
        commissioning.windows(),
        LEARNING.window_ticks() as f32 * TICK_S
    );
    if let Some(cusum) = DETECTORS.cusum {
        println!(
            "nine of ten such baselines keep {:.0} windows between false alarms",
            commissioning.honest_arl0(&cusum)
        );
    }

    let config = Config { channels: commissioning.channels(KINDS, DETECTORS)?, ..LEARNING };
    let mut monitor = FullMonitor::<f32, 8>::new(config)?;
    let mut last = Verdict::Healthy;
    while heater.tick < 80 * 3600 {
        let (r, y, u) = heater.tick();
        let Some(report) = monitor.tick(r, y, u) else { continue };
        if report.verdict != last {
            last = report.verdict;
            let hours = heater.tick as f32 / 3600.0;
            println!(
                "hour {hours:5.1}: {last:?} {:?}; y is {:.2} from r on average",
                report.location(),
                report.indices.mean_e
            );
        }
    }
    let state = {
        let mut bytes = vec![0; FullMonitor::<f32, 8>::STATE_BYTES];
        let used = monitor.save(&mut bytes)?;
        bytes.truncate(used);
        bytes
    };
    FullMonitor::<f32, 8>::new(config)?.restore(&state)?;
    println!("state saved and restored: {} bytes", state.len());
    Ok(())
}
