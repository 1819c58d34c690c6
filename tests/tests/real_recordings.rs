//! The monitor on recordings from real hardware: calibrated on runs without a fault, watching runs with known ones.
//!
//! The recordings are not part of the project: they are looked for in `DRIFT_RECORDINGS`, else in
//! `../shared/recordings` beside the workspace; where they are missing the tests say so and skip. Each prints its
//! rows of the table "recording | injected | hit, missed, false" (`--nocapture` shows it).
//!
//! Window, hop and blanking follow from the loop's time constants and from how much healthy recording there is, as
//! said at each; the thresholds are the same for all three runs of a rig and are not tuned per recording.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use drift_core::{Channel, ChannelKind, Commissioning, Config, Cusum, Detectors, FullMonitor, Index, Shewhart, Side};
use drift_sim::monitor::{Event, EventKind, Outputs, Runner, Summary, watch};
use drift_sim::recording::{ReadOptions, Recording, RecordingStream, RowState};

/// What a person chooses for a rig.
struct Settings {
    sample_time_s: f32,
    block_ticks: u32,
    window_blocks: u16,
    effort: ChannelKind,
    /// A step of r beyond the first is followed by so many ticks that are left out.
    blanking: Option<(f32, u32)>,
    saturation: Option<(f32, f32)>,
    cusum: Cusum,
    shewhart: f32,
    read: ReadOptions,
}

impl Settings {
    fn config(&self, channels: [Channel; 3]) -> Config<f32, 3> {
        let mut config = Config::new(self.sample_time_s, self.block_ticks, self.window_blocks, channels);
        if let Some((step, ticks)) = self.blanking {
            config = config.with_blanking(step, ticks);
        }
        if let Some((u_min, u_max)) = self.saturation {
            config = config.with_saturation(u_min, u_max);
        }
        config
    }

    fn kinds(&self) -> [ChannelKind; 3] {
        [ChannelKind::EnergyError(Index::Iae), self.effort, ChannelKind::Activity]
    }

    /// Learns the baselines from healthy recordings, each begun with an empty window.
    fn calibrate(&self, healthy: &[PathBuf]) -> Config<f32, 3> {
        let bare = self.config(self.kinds().map(Channel::unlearned));
        let mut learning = Commissioning::<3>::new();
        for path in healthy {
            let recording = Recording::read(path, &self.read).unwrap();
            let mut runner = Runner::new(&bare, recording.sample_time_s).unwrap();
            for i in 0..recording.len() {
                let input = match recording.state[i] {
                    RowState::Valid => drift_core::Input::Sample {
                        r: recording.r[i] as f32,
                        y: recording.y[i] as f32,
                        u: recording.u[i] as f32,
                    },
                    RowState::Missing => drift_core::Input::Missing,
                    RowState::Manual => drift_core::Input::Manual,
                };
                if let Some(hop) = runner.tick(recording.time_s(i), input) {
                    learning.learn(&hop.report);
                }
            }
        }
        let detectors = Detectors {
            cusum: Some(self.cusum),
            shewhart: Some(Shewhart::symmetric(self.shewhart)),
            ..Detectors::NONE
        };
        let mut channels = learning.channels(self.kinds(), detectors).unwrap();
        // The reference of these rigs says nothing about the energy that is spent.
        channels[2] = Channel::unlearned(ChannelKind::Activity);
        println!("baseline from {} windows: {:?}", learning.windows(), channels.map(|c| (c.kind, c.baseline.b0, c.baseline.b1, c.baseline.sigma)));
        let config = self.config(channels);
        FullMonitor::<f32, 64>::new(&config).unwrap();
        config
    }

    fn watch(&self, path: &Path, config: &Config<f32, 3>) -> Summary {
        let mut stream = RecordingStream::open(path, &self.read).unwrap();
        watch(&mut stream, config, Outputs::default()).unwrap()
    }
}

fn folder(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("DRIFT_RECORDINGS").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings"),
        PathBuf::from,
    );
    let folder = root.join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no recordings in {}", folder.display());
    None
}

fn report(summary: &Summary) {
    println!("{}", drift_sim::monitor::screen(summary, None));
}

#[test]
fn tclab() {
    let Some(folder) = folder("tclab") else { return };
    let settings = Settings {
        sample_time_s: 1.0,
        block_ticks: 10,
        window_blocks: 5,
        effort: ChannelKind::Effort,
        blanking: Some((1.0, 100)),
        saturation: Some((0.0, 100.0)),
        cusum: Cusum::new(1.0, 8.0),
        shewhart: 5.0,
        read: ReadOptions::default(),
    };
    let runs = ["augmented_arx", "constrained_ml_1", "reg_cons_ml"];
    let config = settings.calibrate(&runs.map(|run| folder.join(format!("sp_{run}.csv"))));
    for run in runs {
        report(&settings.watch(&folder.join(format!("sp_{run}.csv")), &config));
        report(&settings.watch(&folder.join(format!("dist_{run}.csv")), &config));
    }
}

#[test]
fn ahu() {
    let Some(folder) = folder("ahu") else { return };
    for columns in ["y=y", "y=t_mixed", "y=t_outdoor"] {
        println!("#### {columns}");
    let settings = Settings {
        sample_time_s: 60.0,
        block_ticks: 5,
        window_blocks: 6,
        effort: ChannelKind::Effort,
        blanking: None,
        saturation: Some((0.0, 1.0)),
        cusum: Cusum::new(0.5, 8.0),
        shewhart: 5.0,
        read: ReadOptions {
            columns: columns.parse().unwrap(),
            when: vec!["occupied=1".parse().unwrap(), "t>=25200".parse().unwrap()],
            ..ReadOptions::default()
        },
    };
    let days = ["2008-08-19", "2008-08-25", "2009-05-03", "2009-05-04"];
    let healthy = days.map(|day| folder.join(format!("ers_{day}_nofault.csv")));
    let config = settings.calibrate(&healthy);
    for day in &healthy {
        report(&settings.watch(day, &config));
    }
    report(&settings.watch(&folder.join("ers_2007-08-29_leak1p0gpm.csv"), &config));
    }
}

#[test]
fn emps() {
    let Some(folder) = folder("emps") else { return };
    let settings = Settings {
        sample_time_s: 0.001,
        block_ticks: 155,
        window_blocks: 5,
        effort: ChannelKind::MotionEffort,
        blanking: None,
        saturation: Some((-10.0, 10.0)),
        cusum: Cusum::new(1.0, 8.0),
        shewhart: 5.0,
        read: ReadOptions::default(),
    };
    let config = settings.calibrate(&[folder.join("emps_train.csv")]);
    for run in ["emps_train", "emps_pulses", "emps_pulses_ctrl"] {
        report(&settings.watch(&folder.join(format!("{run}.csv")), &config));
    }
}
