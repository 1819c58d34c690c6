//! A PI loop with a simulated plant: it learns its own baseline, rides out a disturbance, and then its actuator
//! fades. Prints what the monitor says whenever that changes. The expected output lies beside this program.
#![no_std]
#![no_main]

#[cfg(feature = "defmt")]
mod frames;
#[cfg(not(feature = "defmt"))]
mod text;

#[cfg(feature = "defmt")]
use frames as output;
#[cfg(not(feature = "defmt"))]
use text as output;

use drift_core::{
    Channel, ChannelKind, Commissioning, Config, Decision, FullMonitor, Index, Report, Verdict,
};
use scenario::DETECTORS;
use scenario::pi::Pi;
use scenario::plant::{Plant, Reference};

/// 8 blocks of 50 ticks: a window of 0.4 s at 1 kHz.
type Monitor = FullMonitor<f32, 8>;
const KINDS: [ChannelKind; 3] =
    [ChannelKind::EnergyError(Index::Iae), ChannelKind::Effort, ChannelKind::Activity];
const HEALTHY_WINDOWS: u32 = 300;

struct Loop {
    pi: Pi,
    plant: Plant,
    reference: Reference,
    tick: u32,
}

impl Loop {
    /// One period of the control interrupt; what the monitor is given.
    fn tick(&mut self) -> (f32, f32, f32) {
        let r = self.reference.at(self.tick);
        let y = self.plant.measure();
        let u = self.pi.tick(r, y);
        self.plant.drive(u);
        self.tick = self.tick.wrapping_add(1);
        (r, y, u)
    }
}

fn main_loop() -> Option<()> {
    let mut control = Loop {
        pi: Pi { kp: 2.0, ki_ts: 0.02, u_min: -10.0, u_max: 10.0, integral: 0.0 },
        plant: Plant::new(1),
        reference: Reference::new(2),
        tick: 0,
    };
    let learning = Config::new(0.001, 50, 8, KINDS.map(Channel::unlearned));
    let mut monitor = Monitor::new(learning).ok()?;
    let mut commissioning = Commissioning::<3>::new();
    while commissioning.windows() < HEALTHY_WINDOWS {
        let (r, y, u) = control.tick();
        if let Some(report) = monitor.tick(r, y, u) {
            // The loop settles first.
            if report.hop >= 5 {
                commissioning.learn(report);
            }
        }
    }
    output::learnt(commissioning.windows());
    let channels = commissioning.channels(KINDS, DETECTORS).ok()?;
    let decision = Decision { confirm_hops: 20, ..Decision::DEFAULT };
    let config = Config::new(0.001, 50, 8, channels).with_decision(decision);
    let mut monitor = Monitor::new(config).ok()?;
    let mut before = Verdict::Healthy;
    loop {
        let (r, y, u) = control.tick();
        let Some(report) = monitor.tick(r, y, u) else { continue };
        if report.verdict != before {
            output::changed(report);
            before = report.verdict;
        }
        if !happens(&mut control.plant, report) {
            output::last(report);
            return Some(());
        }
    }
}

/// The script: a load from hop 40 to 45, a fading actuator from hop 100 on, the end at hop 180.
fn happens(plant: &mut Plant, report: &Report<3>) -> bool {
    plant.load = if (40..45).contains(&report.hop) { 0.5 } else { 0.0 };
    if report.hop >= 100 && plant.gain > 0.7 {
        plant.gain -= 0.01;
    }
    report.hop < 180
}

#[board::entry]
fn main() -> ! {
    board::exit(main_loop().is_some())
}
