//! One kind of physics as a picture: y, u, and what the model can't explain against what that depends on.

use drift_sim::control_loop::{Loop, Sensor};
use drift_sim::controller::Law;
use drift_sim::physics::Term;
use drift_sim::plant::{Plant, zero_order_hold};
use drift_sim::plot::{Colour, Figure, Layer, LegendPosition, Panel};
use drift_sim::simulate::{Trace, replay, simulate};
use drift_sim::{Error, Result};

use crate::scene::Scene;

/// Points of a line: enough for the eye, few enough for a small file.
const POINTS: usize = 320;

/// Characters that fit into a line over a picture.
const TITLE_CHARACTERS: usize = 100;

/// The part of the x axis from which a step between two points is a jump.
const JUMP: f64 = 0.04;

/// What the third panel shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Left {
    /// The missing drive: what the motion needed, less what the model applies under the same u.
    Drive(Against),
    /// Measured y less the model's y under the same u.
    Output(Against),
    /// Recorded u less the stated law's, from the same r and y.
    Law(Against),
}

/// What the third panel's x axis is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Against {
    /// Time.
    Time,
    /// dy/dt.
    Speed,
    /// d2y/dt2.
    Acceleration,
    /// y.
    Output,
    /// u as it reaches the plant's input, after the model's dead time.
    Command,
    /// The force through the middle of a servo's drive train: half of the actuator's and the known load's sum.
    Transmitted,
}

/// One picture.
pub struct Case {
    /// The loop and what it does.
    pub scene: Scene,
    /// What is added to it.
    pub term: Term,
    /// What the third panel shows.
    pub left: Left,
}

impl Case {
    /// Draws it.
    pub fn figure(&self) -> Result<Figure> {
        let Scene { healthy: model, r, start, .. } = &self.scene;
        let healthy = simulate(model, r, &[], 1, Some(start))?;
        let with = simulate(&model.clone().with(self.term.clone()), r, &[], 1, Some(start))?;
        let names = model.unit_names();
        let time = |values: &[f64]| self.over_time(values);
        let y = Panel {
            x_label: "time / s".into(),
            y_label: format!("y / {}", names.y),
            layers: vec![
                Layer::line("without", Colour::Sky, time(&healthy.y)),
                Layer::line("with", Colour::Vermilion, time(&with.y)),
                Layer::dashed("r", Colour::Black, time(r)),
            ],
            ..Panel::default()
        };
        let u = Panel {
            x_label: "time / s".into(),
            y_label: format!("u / {}", names.u),
            layers: vec![
                Layer::line("", Colour::Sky, time(&healthy.u)),
                Layer::line("", Colour::Vermilion, time(&with.u)),
            ],
            legend: LegendPosition::Hidden,
            ..Panel::default()
        };
        let panels = vec![y, u, self.left_panel(&with)?];
        Ok(Figure { width_px: 1000, panel_height_px: 210, ..Figure::grid(self.title(), 3, panels) })
    }

    /// The term in words, as far as they fit over the picture.
    fn title(&self) -> String {
        let says = self.term.says(&self.scene.healthy.unit_names());
        let fitting = says.char_indices().take(TITLE_CHARACTERS).last().map_or(0, |(at, _)| at);
        match says.get(..fitting).and_then(|start| start.rsplit_once([',', ';'])) {
            Some((start, _)) if says.chars().count() > TITLE_CHARACTERS => start.to_string(),
            _ => says,
        }
    }

    fn left_panel(&self, with: &Trace) -> Result<Panel> {
        let model = &self.scene.healthy;
        let names = model.unit_names();
        let (values, against, y_label) = match self.left {
            Left::Drive(against) => {
                (missing_drive(model, with)?, against, format!("missing drive / {}", names.drive))
            }
            Left::Output(against) => {
                let quiet = Loop { sensor: Sensor::default(), ..model.clone() };
                let model_y = replay(&quiet, &with.u, &[], 1, Some(&self.scene.start))?.y;
                (difference(&with.y, &model_y), against, format!("y beyond the model / {}", names.y))
            }
            Left::Law(against) => {
                (difference(&with.u, &self.law(with)), against, format!("u beyond the law / {}", names.u))
            }
        };
        let (points, x_label) = self.against(against, &values, with);
        Ok(Panel {
            x_label,
            y_label,
            layers: vec![
                Layer::HorizontalLine { y: 0.0, name: String::new(), colour: Colour::Sky, dashed: false },
                Layer::line("", Colour::Vermilion, points),
            ],
            legend: LegendPosition::Hidden,
            ..Panel::default()
        })
    }

    /// u as the stated law makes it of the recorded r and y.
    fn law(&self, with: &Trace) -> Vec<f64> {
        let Scene { healthy: model, r, start, .. } = &self.scene;
        let mut law = Law::new(&model.controller, model.sample_time_s);
        law.start(start.integrator, start.y, start.velocity, start.u);
        r.iter().zip(&with.y).map(|(r, y)| law.step(*r, *y)).collect()
    }

    fn against(&self, against: Against, values: &[f64], with: &Trace) -> (Vec<(f64, f64)>, String) {
        let model = &self.scene.healthy;
        let names = model.unit_names();
        let ts = model.sample_time_s;
        let x: Vec<f64> = match against {
            Against::Time => return (self.over_time(values), "time / s".into()),
            Against::Speed => around(&with.y, |a, _, c| (c - a) / (2.0 * ts)),
            Against::Acceleration => around(&with.y, |a, b, c| (c - 2.0 * b + a) / (ts * ts)),
            Against::Output => with.y.clone(),
            Against::Command => applied_u(model, &with.u),
            Against::Transmitted => {
                with.u.iter().map(|u| 0.5 * (model.plant.drive_gain() * u + known_load(model))).collect()
            }
        };
        let label = match against {
            Against::Time => "time / s".into(),
            Against::Speed => format!("speed / {}", names.speed),
            Against::Acceleration => format!("acceleration / {}^2", names.speed),
            Against::Output => format!("y / {}", names.y),
            Against::Command => format!("u / {}", names.u),
            Against::Transmitted => format!("transmitted force / {}", names.drive),
        };
        let pairs: Vec<_> = x.into_iter().zip(values.iter().copied()).collect();
        (unjumped(self.thinned(&pairs, 3 * POINTS)), label)
    }

    fn over_time(&self, values: &[f64]) -> Vec<(f64, f64)> {
        let (from, ts) = (self.scene.shown_s.0, self.scene.healthy.sample_time_s);
        let points: Vec<_> = values.iter().enumerate().map(|(n, v)| (n as f64 * ts - from, *v)).collect();
        self.thinned(&points, POINTS)
    }

    /// The part that is shown, in even steps.
    fn thinned(&self, points: &[(f64, f64)], most: usize) -> Vec<(f64, f64)> {
        let ts = self.scene.healthy.sample_time_s;
        let tick = |s: f64| libm::round(s / ts) as usize;
        let (from, to) = (tick(self.scene.shown_s.0), tick(self.scene.shown_s.1).min(points.len()));
        let shown = points.get(from..to).unwrap_or(&[]);
        shown.iter().step_by(shown.len().div_ceil(most).max(1)).copied().collect()
    }
}

/// Points with a break wherever x jumps: a chord across would look like a curve.
fn unjumped(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let (low, high) = points.iter().fold((f64::MAX, f64::MIN), |(a, b), (x, _)| (a.min(*x), b.max(*x)));
    let mut last = f64::NAN;
    let mut joined = Vec::with_capacity(points.len());
    for (x, y) in points {
        if (x - last).abs() > JUMP * (high - low) {
            joined.push((f64::NAN, f64::NAN));
        }
        joined.push((x, y));
        last = x;
    }
    joined
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// A function of each sample and its two neighbours; zero at the ends.
fn around(values: &[f64], f: impl Fn(f64, f64, f64) -> f64) -> Vec<f64> {
    let inner = values.windows(3).map(|w| match w {
        [a, b, c] => f(*a, *b, *c),
        _ => 0.0,
    });
    std::iter::once(0.0).chain(inner).chain([0.0]).take(values.len()).collect()
}

/// u as it arrives after the model's own dead time: its mean over each sample.
fn applied_u(model: &Loop, u: &[f64]) -> Vec<f64> {
    let samples = model.plant.delay_s() / model.sample_time_s;
    let (whole, part) = (samples as usize, samples - libm::floor(samples));
    let at = |n: usize, late: usize| u.get(n.saturating_sub(late)).copied().unwrap_or(0.0);
    (0..u.len()).map(|n| (1.0 - part) * at(n, whole) + part * at(n, whole + 1)).collect()
}

/// What the measured y needed, less what the model applies under the recorded u.
fn missing_drive(model: &Loop, with: &Trace) -> Result<Vec<f64>> {
    let applied = applied_u(model, &with.u)
        .into_iter()
        .map(|u| model.plant.drive_gain() * u + model.plant.drive_offset() - known_load(model));
    let applied: Vec<f64> = applied.collect();
    let ts = model.sample_time_s;
    match &model.plant {
        Plant::Servo(servo) => {
            let needed = around(&with.y, |a, b, c| {
                servo.inertia * (c - 2.0 * b + a) / (ts * ts) + servo.viscous * (c - a) / (2.0 * ts)
            });
            // The difference around a sample sees the mean of the drives before and after it.
            let mean = around(&applied, |a, b, _| 0.5 * (a + b));
            Ok(difference(&needed, &mean))
        }
        Plant::FirstOrder(_) => {
            let Some(linear) = model.plant.linear()? else { return Ok(Vec::new()) };
            let held = zero_order_hold::discretise(&linear, ts)?;
            let (Some(keeps), Some(gains)) = (held.phi.first(), held.gamma.first()) else {
                return Ok(Vec::new());
            };
            let needed = around(&with.y, |_, b, c| (c - keeps * b) / gains);
            Ok(difference(&needed, &applied))
        }
        other => Err(Error::new(format!("no picture for a {} plant", other.kind()))),
    }
}

/// A load that belongs to the healthy loop.
fn known_load(model: &Loop) -> f64 {
    model.physics.iter().filter(|t| t.kind.name == "load_step").filter_map(|t| t.value("level")).sum()
}
