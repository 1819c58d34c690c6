//! Which loop shows which kind of physics, with which numbers.

use drift_sim::Result;
use drift_sim::physics::{Kind, Term};

use crate::scene::Scene;
use crate::signature::Against::{Acceleration, Command, Output, Speed, Time, Transmitted};
use crate::signature::{Case, Left};

/// The picture of a kind; `None` where nobody has thought of one yet.
pub fn case(kind: &Kind) -> Result<Option<Case>> {
    let name = kind.name;
    let case = |scene: Result<Scene>, parameters: &[(&str, f64)], onset_s: f64, left: Left| {
        Ok(Some(Case { scene: scene?, term: Term::new(name, parameters)?.from_s(onset_s), left }))
    };
    match name {
        "coulomb_friction" => case(Scene::axis(), &[("level", 20.0)], 0.0, Left::Drive(Speed)),
        "stribeck_friction" => case(
            Scene::axis(),
            &[("coulomb", 12.0), ("breakaway", 25.0), ("stribeck_speed", 0.05)],
            0.0,
            Left::Drive(Speed),
        ),
        "directional_friction" => case(
            Scene::axis(),
            &[("coulomb_pos", 25.0), ("coulomb_neg", 10.0), ("viscous_pos", 60.0), ("viscous_neg", 0.0)],
            0.0,
            Left::Drive(Speed),
        ),
        "load_dependent_friction" => {
            case(loaded_axis(), &[("coefficient", 0.25)], 0.0, Left::Drive(Transmitted))
        }
        "quadratic_drag" => case(Scene::axis(), &[("coefficient", 300.0)], 0.0, Left::Drive(Speed)),
        "viscous_friction" => case(Scene::axis(), &[("ratio", 1.6)], 0.0, Left::Drive(Speed)),
        "inertia_change" => case(Scene::axis(), &[("ratio", 1.4)], 0.0, Left::Drive(Acceleration)),
        "cogging" => case(
            Scene::axis(),
            &[("amplitude", 10.0), ("period", 0.04), ("phase", 0.0)],
            0.0,
            Left::Drive(Output),
        ),
        "stiffness" => case(Scene::axis(), &[("stiffness", 120.0)], 0.0, Left::Drive(Output)),
        "gravity" => case(Scene::arm(), &[("amplitude", 2.0), ("phase", 0.0)], 0.0, Left::Drive(Output)),
        "flexible_mode" => {
            case(Scene::stepped_axis(), &[("frequency_hz", 12.0), ("damping", 0.2)], 0.0, Left::Drive(Time))
        }
        "radiation" => case(Scene::heater(), &[("coefficient", 2e-9)], 0.0, Left::Drive(Output)),
        "leak" => case(Scene::heater(), &[("coefficient", 0.2)], 0.0, Left::Drive(Output)),
        "nonlinear_gain" => case(Scene::heater(), &[("exponent", 0.96)], 0.0, Left::Drive(Command)),
        "gain_loss" => case(Scene::heater(), &[("loss", 0.2)], 3000.0, Left::Drive(Command)),
        "dead_zone" => case(Scene::axis(), &[("half_width", 0.5)], 0.0, Left::Drive(Command)),
        "saturation" => case(Scene::heater(), &[("lower", 15.0), ("upper", 78.0)], 0.0, Left::Drive(Command)),
        "rate_limit" => case(Scene::stepped_heater(), &[("limit_per_s", 0.5)], 0.0, Left::Drive(Time)),
        "backlash" => case(Scene::flow(), &[("width", 3.0)], 0.0, Left::Drive(Command)),
        "stiction" => {
            case(Scene::flow(), &[("stick_band", 2.0), ("slip_jump", 1.0)], 0.0, Left::Drive(Command))
        }
        "delay" => case(Scene::stepped_heater(), &[("delay_s", 20.0)], 0.0, Left::Drive(Time)),
        "unmodelled_lag" => {
            case(Scene::stepped_heater(), &[("time_constant_s", 20.0)], 0.0, Left::Drive(Time))
        }
        "sensor_bias" => case(Scene::heater(), &[("bias", 4.0)], 3000.0, Left::Output(Time)),
        "sensor_drift" => case(
            Scene::heater(),
            &[("rate_per_s", 0.004), ("noise_growth_per_s", 0.0)],
            3000.0,
            Left::Output(Time),
        ),
        "sensor_noise" => case(noisy_heater(), &[("ratio", 4.0)], 3500.0, Left::Output(Time)),
        "sensor_lag" => case(Scene::stepped_heater(), &[("time_constant_s", 20.0)], 0.0, Left::Output(Time)),
        "sensor_hysteresis" => case(Scene::axis(), &[("width", 0.01)], 0.0, Left::Output(Time)),
        "quantization" => case(Scene::stepped_heater(), &[("step", 0.5)], 0.0, Left::Output(Time)),
        "load_step" => case(Scene::heater(), &[("level", 8.0)], 3000.0, Left::Drive(Time)),
        "load_ramp" => case(Scene::heater(), &[("rate_per_s", 0.004)], 3000.0, Left::Drive(Time)),
        "periodic_load" => {
            case(Scene::axis(), &[("amplitude", 12.0), ("frequency_hz", 1.5)], 0.0, Left::Drive(Time))
        }
        "injected_signal" => {
            let term = Term::new(name, &[("level", 0.8)])?.within(&[(1.0, 1.4), (3.0, 3.8), (6.5, 6.7)]);
            Ok(Some(Case { scene: Scene::axis()?, term, left: Left::Drive(Time) }))
        }
        "controller_gain" => case(Scene::axis(), &[("ratio", 0.8)], 0.0, Left::Law(Command)),
        "controller_delay" => case(Scene::stepped_axis(), &[("delay_s", 0.006)], 0.0, Left::Law(Time)),
        _ => Ok(None),
    }
}

/// The axis pushes against a known load of 60 N.
fn loaded_axis() -> Result<Scene> {
    let mut scene = Scene::axis()?;
    scene.healthy = scene.healthy.with(Term::new("load_step", &[("level", 60.0)])?);
    Ok(scene)
}

/// The heater with the noise that the ratio needs.
fn noisy_heater() -> Result<Scene> {
    let mut scene = Scene::heater()?;
    scene.healthy.sensor.noise = 0.1;
    Ok(scene)
}
