//! From a loop to text. Numbers are written in the shortest form that reads back to the same value.

use std::fmt::Write;

use crate::control_loop::Loop;
use crate::controller::{Controller, Limits, VelocityRule};
use crate::measured_input::{Enters, Gain};
use crate::plant::{Output, Plant};

/// Writing to a String can't fail; this says so once.
struct Text(String);

impl Text {
    fn line(&mut self, args: std::fmt::Arguments<'_>) {
        let _ = self.0.write_fmt(args);
        self.0.push('\n');
    }

    fn number(&mut self, key: &str, value: f64) {
        self.line(format_args!("{key} = {value:?}"));
    }

    fn text(&mut self, key: &str, value: &str) {
        self.line(format_args!("{key} = {}", toml::Value::String(value.to_string())));
    }

    fn list(&mut self, key: &str, values: &[f64]) {
        self.line(format_args!("{key} = {values:?}"));
    }

    fn limits(&mut self, limits: Limits) {
        for (key, value) in [("u_min", limits.u_min), ("u_max", limits.u_max)] {
            if value.is_finite() {
                self.number(key, value);
            }
        }
    }
}

/// The name of a choice.
fn name_of<T: PartialEq>(choices: &[(&'static str, T)], value: &T) -> &'static str {
    choices.iter().find(|(_, choice)| choice == value).map_or("", |(name, _)| name)
}

pub(super) fn text(model: &Loop) -> String {
    let mut out = Text(String::new());
    out.line(format_args!("[loop]"));
    out.number("sample_time_s", model.sample_time_s);
    write_units(&mut out, model);
    write_controller(&mut out, &model.controller);
    write_plant(&mut out, &model.plant);
    if model.sensor.noise > 0.0 {
        out.line(format_args!("\n[sensor]"));
        out.number("noise", model.sensor.noise);
    }
    for input in &model.inputs {
        out.line(format_args!("\n[[inputs]]"));
        out.text("column", &input.column);
        for (key, column) in [("minus", &input.minus), ("times", &input.times)] {
            if let Some(column) = column {
                out.text(key, column);
            }
        }
        out.text("enters", name_of(&Enters::ALL, &input.enters));
        match input.gain {
            Gain::Identify => out.text("gain", Gain::IDENTIFY),
            gain => out.number("gain", gain.value()),
        }
    }
    for term in &model.physics {
        out.line(format_args!("\n[[physics]]"));
        out.text("kind", term.kind.name);
        for (parameter, value) in term.kind.parameters.iter().zip(&term.parameters) {
            out.number(parameter.name, *value);
        }
        if term.onset_s > 0.0 {
            out.number("onset_s", term.onset_s);
        }
        if !term.spans.is_empty() {
            let spans: Vec<[f64; 2]> = term.spans.iter().map(|(from, to)| [*from, *to]).collect();
            out.line(format_args!("spans = {spans:?}"));
        }
    }
    out.0
}

fn write_units(out: &mut Text, model: &Loop) {
    let units = &model.units;
    let given = [("r", &units.r), ("y", &units.y), ("u", &units.u), ("force", &units.force)];
    if given.iter().any(|(_, unit)| unit.is_some()) {
        out.line(format_args!("\n[units]"));
    }
    for (key, unit) in given {
        if let Some(unit) = unit {
            out.text(key, unit);
        }
    }
}

fn write_controller(out: &mut Text, controller: &Controller) {
    out.line(format_args!("\n[controller]"));
    out.text("kind", controller.kind());
    let windup = match controller {
        Controller::Pi(law) => {
            out.number("kp", law.kp);
            out.number("ki", law.ki);
            !law.anti_windup
        }
        Controller::Pid(law) => {
            out.number("kp", law.kp);
            out.number("ki", law.ki);
            out.number("kd", law.kd);
            out.number("derivative_filter_s", law.derivative_filter_s);
            !law.anti_windup
        }
        Controller::PVelocity(law) => {
            out.number("kp", law.kp);
            out.number("kv", law.kv);
            out.text("velocity", name_of(&VelocityRule::ALL, &law.velocity));
            false
        }
        Controller::Recorded => false,
    };
    out.limits(controller.limits());
    if windup {
        out.line(format_args!("anti_windup = false"));
    }
}

fn write_plant(out: &mut Text, plant: &Plant) {
    out.line(format_args!("\n[plant]"));
    out.text("kind", plant.kind());
    match plant {
        Plant::Servo(p) => {
            out.text("output", name_of(&Output::ALL, &p.output));
            out.number("inertia", p.inertia);
            out.number("viscous", p.viscous);
            out.number("actuator_gain", p.actuator_gain);
        }
        Plant::FirstOrder(p) => {
            out.number("gain", p.gain);
            out.number("time_constant_s", p.time_constant_s);
            out.number("delay_s", p.delay_s);
            out.number("offset", p.offset);
        }
        Plant::StateSpace(p) => {
            out.line(format_args!("a = {:?}", p.a));
            out.line(format_args!("b = {:?}", p.b.iter().map(|b| [*b]).collect::<Vec<_>>()));
            out.line(format_args!("c = {:?}", [&p.c]));
            out.line(format_args!("d = {:?}", [[p.d]]));
        }
        Plant::TransferFunction(p) => {
            out.list("num", &p.num);
            out.list("den", &p.den);
            out.number("delay_s", p.delay_s);
            if p.offset != 0.0 {
                out.number("offset", p.offset);
            }
        }
        Plant::Tank(p) => {
            out.number("area", p.area);
            out.number("inflow_gain", p.inflow_gain);
            out.number("outflow", p.outflow);
        }
        Plant::Identify => {}
    }
}
