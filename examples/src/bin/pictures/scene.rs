//! The four healthy loops of the pictures, each with a reference that lets its physics show.

use drift_sim::Result;
use drift_sim::control_loop::{Loop, Sensor};
use drift_sim::simulate::Start;

const AXIS: &str = include_str!("../../../loops/servo.toml");
const FLOW: &str = include_str!("../../../loops/flow.toml");
const HEATER: &str = include_str!("../../../loops/heater.toml");
const ARM: &str = r#"
[loop]
sample_time_s = 0.001
[units]
r = "rad"
y = "rad"
u = "V"
force = "N m"
[controller]
kind = "p-velocity"
kp = 15.0
kv = 20.0
[plant]
kind = "servo"
output = "position"
inertia = 0.5
viscous = 0.4
actuator_gain = 1.5
"#;

/// A loop without physics and without noise, what it is asked to do, and the part of the run that is drawn.
pub struct Scene {
    /// The healthy loop.
    pub healthy: Loop,
    /// The reference, one value a sample.
    pub r: Vec<f64>,
    /// Where the run starts.
    pub start: Start,
    /// First and last time drawn, in seconds; times in the picture count from the first.
    pub shown_s: (f64, f64),
}

/// The loop of a file without its physics and its noise.
fn bare(text: &str, name: &str) -> Result<Loop> {
    let mut model = Loop::parse(text, name)?;
    model.physics.clear();
    model.sensor = Sensor::default();
    Ok(model)
}

/// A reference that rests and moves in turn: each leg is (rest in s, move in s, where to), moved along half a cosine.
fn legs(from: f64, sample_time_s: f64, legs: &[(f64, f64, f64)]) -> Vec<f64> {
    let (mut at, mut r) = (from, Vec::new());
    for (rest_s, move_s, to) in legs {
        let ticks = |s: f64| libm::round(s / sample_time_s) as usize;
        r.extend(std::iter::repeat_n(at, ticks(*rest_s)));
        let moving = ticks(*move_s);
        r.extend((1..=moving).map(|n| {
            let phase = std::f64::consts::PI * n as f64 / moving as f64;
            at + 0.5 * (to - at) * (1.0 - libm::cos(phase))
        }));
        at = *to;
    }
    r
}

impl Scene {
    /// A linear axis that goes out fast, back slowly, and rests in between.
    pub fn axis() -> Result<Self> {
        let healthy = bare(AXIS, "servo.toml")?;
        let r = legs(
            0.0,
            healthy.sample_time_s,
            &[(0.4, 1.2, 0.25), (0.5, 3.0, -0.1), (0.5, 1.8, 0.0), (0.6, 0.0, 0.0)],
        );
        Ok(Self { start: Start::default(), shown_s: (0.0, 8.0), healthy, r })
    }

    /// The axis under softer gains, stepped.
    pub fn stepped_axis() -> Result<Self> {
        let mut healthy = bare(&AXIS.replace("kv = 240.0", "kv = 60.0"), "servo.toml")?;
        healthy.sample_time_s = 0.0005;
        let r = legs(0.0, healthy.sample_time_s, &[(0.1, 0.0, 0.002), (0.9, 0.0, 0.002)]);
        Ok(Self { start: Start::default(), shown_s: (0.0, 1.0), healthy, r })
    }

    /// An arm that swings over half a turn and back.
    pub fn arm() -> Result<Self> {
        let healthy = bare(ARM, "arm.toml")?;
        let r = legs(
            0.0,
            healthy.sample_time_s,
            &[(0.3, 3.0, 1.5), (0.4, 4.0, -1.5), (0.4, 2.5, 0.0), (0.4, 0.0, 0.0)],
        );
        Ok(Self { start: Start::default(), shown_s: (0.0, 11.0), healthy, r })
    }

    /// A heater that holds one level after the other.
    pub fn heater() -> Result<Self> {
        let healthy = bare(HEATER, "heater.toml")?;
        let r = legs(
            40.0,
            healthy.sample_time_s,
            &[(2500.0, 0.0, 60.0), (1000.0, 0.0, 80.0), (1000.0, 0.0, 50.0), (1000.0, 0.0, 50.0)],
        );
        Ok(Self { start: Start::held(40.0, 23.75), shown_s: (2000.0, 5500.0), healthy, r })
    }

    /// The heater around a large and a small step.
    pub fn stepped_heater() -> Result<Self> {
        let healthy = bare(HEATER, "heater.toml")?;
        let r =
            legs(50.0, healthy.sample_time_s, &[(1550.0, 0.0, 60.0), (450.0, 0.0, 65.0), (400.0, 0.0, 65.0)]);
        Ok(Self { start: Start::held(50.0, 36.25), shown_s: (1500.0, 2400.0), healthy, r })
    }

    /// A flow loop that is led slowly up and slowly down again.
    pub fn flow() -> Result<Self> {
        let healthy = bare(FLOW, "flow.toml")?;
        let r = legs(
            30.0,
            healthy.sample_time_s,
            &[(150.0, 0.0, 30.0), (0.0, 200.0, 50.0), (40.0, 200.0, 30.0), (60.0, 0.0, 30.0)],
        );
        Ok(Self { start: Start::held(30.0, 30.0), shown_s: (100.0, 650.0), healthy, r })
    }
}
