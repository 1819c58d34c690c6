//! From text to a loop.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::section::{Section, line_of};
use crate::control_loop::{LARGEST, Loop, SAMPLE_TIMES_S, Sensor};
use crate::controller::{Controller, Limits, PVelocity, Pi, Pid, VelocityRule};
use crate::measured_input::{Enters, Gain, Input};
use crate::physics::{Kind, Range, Term, Units};
use crate::plant::{FirstOrder, Output, Plant, Servo, StateSpace, Tank, TransferFunction};
use crate::sentences::typed;
use crate::{Error, Result};

const SECTIONS: [&str; 7] = ["loop", "units", "controller", "plant", "sensor", "inputs", "physics"];

pub(super) fn parse(text: &str) -> Result<Loop> {
    let root = DeTable::parse(text).map_err(|error| {
        let line = line_of(text, error.span().map_or(0, |span| span.start));
        Error::new(format!("not TOML: {}", error.message())).at_line(line)
    })?;
    let root = root.get_ref();
    Section::new(text, "the file", root, 0).only(&SECTIONS)?;
    let table = |name: &'static str| section(text, root, name);
    let model = Loop {
        sample_time_s: sample_time(&required(table("loop")?, "loop")?)?,
        units: table("units")?.map_or(Ok(Units::default()), |units| read_units(&units))?,
        controller: read_controller(&required(table("controller")?, "controller")?)?,
        plant: read_plant(&required(table("plant")?, "plant")?)?,
        sensor: table("sensor")?.map_or(Ok(Sensor::default()), |sensor| read_sensor(&sensor))?,
        inputs: list(text, root, "inputs")?.iter().map(read_input).collect::<Result<_>>()?,
        physics: Vec::new(),
    };
    list(text, root, "physics")?.iter().try_fold(model, |model, section| {
        let term = read_term(section)?;
        model.check_term(&term).map_err(|error| error.at_line(section.line))?;
        Ok(model.with(term))
    })
}

/// A table of the file's top, where it is there.
fn section<'a>(text: &'a str, root: &'a DeTable<'a>, name: &'static str) -> Result<Option<Section<'a>>> {
    let Some((key, value)) = root.iter().find(|(key, _)| key.get_ref() == name) else { return Ok(None) };
    let line = line_of(text, key.span().start);
    let table = value.get_ref().as_table().ok_or_else(|| {
        Error::new(format!("'{name}' is not a table")).allowed(format!("one [{name}]")).at_line(line)
    })?;
    Ok(Some(Section::new(text, name, table, key.span().start)))
}

fn required<'a>(section: Option<Section<'a>>, name: &str) -> Result<Section<'a>> {
    section.ok_or_else(|| {
        Error::new(format!("the table [{name}] is missing")).allowed("needed: [loop], [controller], [plant]")
    })
}

/// Tables of one list, at most: more terms than there are kinds of physics are a mistake, and cost time in each.
const TABLES_MAX: usize = 256;

/// The tables of a list such as `[[physics]]`.
fn list<'a>(text: &'a str, root: &'a DeTable<'a>, name: &'static str) -> Result<Vec<Section<'a>>> {
    let Some((key, value)) = root.iter().find(|(key, _)| key.get_ref() == name) else {
        return Ok(Vec::new());
    };
    let refuse = |offset: usize| {
        Error::new(format!("'{name}' is not a list of tables"))
            .allowed(format!("[[{name}]]"))
            .at_line(line_of(text, offset))
    };
    let items = value.get_ref().as_array().ok_or_else(|| refuse(key.span().start))?;
    if items.len() > TABLES_MAX {
        return Err(Error::new(format!("{} tables [[{name}]]", items.len()))
            .allowed(format!("at most {TABLES_MAX}"))
            .at_line(line_of(text, key.span().start)));
    }
    let section = |item: &'a Spanned<DeValue<'a>>| {
        let table = item.get_ref().as_table().ok_or_else(|| refuse(item.span().start))?;
        Ok(Section::new(text, name, table, item.span().start))
    };
    items.iter().map(section).collect()
}

fn sample_time(section: &Section) -> Result<f64> {
    section.only(&["sample_time_s"])?;
    let sample_time_s = section.number("sample_time_s", Range::Positive)?;
    if SAMPLE_TIMES_S.contains(&sample_time_s) {
        return Ok(sample_time_s);
    }
    let what = format!("sample_time_s is {}", typed(sample_time_s));
    let allowed = format!(
        "sample_time_s must be from {} to {} s",
        typed(*SAMPLE_TIMES_S.start()),
        typed(*SAMPLE_TIMES_S.end())
    );
    Err(section.refuse("sample_time_s", what, allowed))
}

fn read_units(section: &Section) -> Result<Units> {
    section.only(&["r", "y", "u", "force"])?;
    let unit = |key| section.optional_text(key);
    Ok(Units { r: unit("r")?, y: unit("y")?, u: unit("u")?, force: unit("force")? })
}

fn read_sensor(section: &Section) -> Result<Sensor> {
    section.only(&["noise"])?;
    Ok(Sensor { noise: section.optional_number("noise", Range::NotNegative)?.unwrap_or(0.0) })
}

fn read_input(section: &Section) -> Result<Input> {
    section.only(&["column", "minus", "times", "enters", "gain"])?;
    let gain = match section.optional_number_or_word("gain", Range::Any, Gain::IDENTIFY)? {
        Some(Some(gain)) => Gain::Stated(gain),
        Some(None) => Gain::Identify,
        None => Gain::Stated(1.0),
    };
    let enters = section.choice("enters", &Enters::ALL)?;
    if gain.is_open() && enters == Enters::Sensor {
        // Nothing tells what a sensor adds from where the plant is.
        let allowed = "a number; only inputs at the actuator and at the load are identified";
        return Err(section.refuse(
            "gain",
            "the gain of an input at the sensor can't be identified",
            allowed,
        ));
    }
    Ok(Input {
        column: section.text("column")?,
        minus: section.optional_text("minus")?,
        times: section.optional_text("times")?,
        enters,
        gain,
    })
}

/// The names of kinds as choices.
fn named<const N: usize>(kinds: [&'static str; N]) -> [(&'static str, &'static str); N] {
    kinds.map(|kind| (kind, kind))
}

fn read_controller(section: &Section) -> Result<Controller> {
    let kind = section.choice("kind", &named(Controller::KINDS))?;
    let number = |key| section.number(key, Range::Any);
    let anti_windup = || Ok::<_, Error>(section.optional_switch("anti_windup")?.unwrap_or(true));
    Ok(match kind {
        "pi" => {
            section.only(&["kind", "kp", "ki", "u_min", "u_max", "anti_windup"])?;
            let (kp, ki, limits) = (number("kp")?, number("ki")?, read_limits(section)?);
            Controller::Pi(Pi { kp, ki, limits, anti_windup: anti_windup()? })
        }
        "pid" => {
            section.only(&[
                "kind",
                "kp",
                "ki",
                "kd",
                "derivative_filter_s",
                "u_min",
                "u_max",
                "anti_windup",
            ])?;
            let (kp, ki, kd) = (number("kp")?, number("ki")?, number("kd")?);
            let derivative_filter_s = section.number("derivative_filter_s", Range::NotNegative)?;
            let limits = read_limits(section)?;
            Controller::Pid(Pid { kp, ki, kd, derivative_filter_s, limits, anti_windup: anti_windup()? })
        }
        "p-velocity" => {
            section.only(&["kind", "kp", "kv", "velocity", "u_min", "u_max"])?;
            let velocity =
                section.optional_choice("velocity", &VelocityRule::ALL)?.unwrap_or(VelocityRule::Backward);
            Controller::PVelocity(PVelocity {
                kp: number("kp")?,
                kv: number("kv")?,
                velocity,
                limits: read_limits(section)?,
            })
        }
        _ => {
            section.only(&["kind"])?;
            Controller::Recorded
        }
    })
}

fn read_limits(section: &Section) -> Result<Limits> {
    let bound = |key, none: f64| Ok::<_, Error>(section.optional_number(key, Range::Any)?.unwrap_or(none));
    let limits = Limits { u_min: bound("u_min", f64::NEG_INFINITY)?, u_max: bound("u_max", f64::INFINITY)? };
    if limits.u_min < limits.u_max {
        return Ok(limits);
    }
    let what = format!("u_min = {} is not below u_max = {}", typed(limits.u_min), typed(limits.u_max));
    Err(section.refuse("u_min", what, "u_min must be below u_max"))
}

fn read_plant(section: &Section) -> Result<Plant> {
    let kind = section.choice("kind", &named(Plant::KINDS))?;
    Ok(match kind {
        "servo" => {
            section.only(&["kind", "output", "inertia", "viscous", "actuator_gain"])?;
            Plant::Servo(Servo {
                output: section.choice("output", &Output::ALL)?,
                inertia: section.number("inertia", Range::Positive)?,
                viscous: section.number("viscous", Range::NotNegative)?,
                actuator_gain: section.number("actuator_gain", Range::Any)?,
            })
        }
        "first-order" => {
            section.only(&["kind", "gain", "time_constant_s", "delay_s", "offset"])?;
            Plant::FirstOrder(FirstOrder {
                gain: section.number("gain", Range::Any)?,
                time_constant_s: section.number("time_constant_s", Range::Positive)?,
                delay_s: section.optional_number("delay_s", Range::NotNegative)?.unwrap_or(0.0),
                offset: section.optional_number("offset", Range::Any)?.unwrap_or(0.0),
            })
        }
        "state-space" => read_state_space(section)?,
        "transfer-function" => read_transfer_function(section)?,
        "tank" => {
            section.only(&["kind", "area", "inflow_gain", "outflow"])?;
            Plant::Tank(Tank {
                area: section.number("area", Range::Positive)?,
                inflow_gain: section.number("inflow_gain", Range::Any)?,
                outflow: section.number("outflow", Range::NotNegative)?,
            })
        }
        _ => {
            section.only(&["kind"])?;
            Plant::Identify
        }
    })
}

/// As many states as an exact step has room for.
const MOST_STATES: usize = 16;

fn read_state_space(section: &Section) -> Result<Plant> {
    section.only(&["kind", "a", "b", "c", "d"])?;
    let (a, b, c) = (section.matrix("a")?, section.vector("b")?, section.vector("c")?);
    let d = if section.has("d") { section.vector("d")? } else { vec![0.0] };
    let n = a.len();
    if n == 0 || n > MOST_STATES || a.iter().any(|row| row.len() != n) {
        return Err(section.refuse(
            "a",
            "a is not square",
            format!("n rows of n numbers, n from 1 to {MOST_STATES}"),
        ));
    }
    for (key, length) in [("b", b.len()), ("c", c.len())] {
        if length != n {
            let what = format!("{key} has {length} numbers, a has {n} rows");
            return Err(section.refuse(key, what, format!("{n} numbers (one input, one output)")));
        }
    }
    match d.as_slice() {
        [d] => Ok(Plant::StateSpace(StateSpace { a, b, c, d: *d })),
        _ => Err(section.refuse(
            "d",
            format!("d has {} numbers", d.len()),
            "one number (one input, one output)",
        )),
    }
}

fn read_transfer_function(section: &Section) -> Result<Plant> {
    section.only(&["kind", "num", "den", "delay_s", "offset"])?;
    let (num, den) = (section.vector("num")?, section.vector("den")?);
    let delay_s = section.optional_number("delay_s", Range::NotNegative)?.unwrap_or(0.0);
    if den.first().is_none_or(|lead| *lead == 0.0) || den.len() > MOST_STATES + 1 || den.len() < 2 {
        let allowed =
            format!("2 to {} numbers from the highest power of s down, the first not 0", MOST_STATES + 1);
        return Err(section.refuse("den", "den is no denominator of a plant", allowed));
    }
    if num.len() > den.len() {
        return Err(section.refuse("num", "num is longer than den", "a degree not above that of den"));
    }
    // An integrator has no gain at rest.
    let at_rest = num.last().zip(den.last()).map(|(num, den)| num / den).filter(|gain| gain.is_finite());
    if let Some(gain) = at_rest.filter(|gain| gain.abs() > LARGEST) {
        let what = format!("the gain at rest, the last of num over the last of den, is {}", typed(gain));
        return Err(section.refuse("num", what, format!("it must be within +-{}", typed(LARGEST))));
    }
    let offset = section.optional_number("offset", Range::Any)?.unwrap_or(0.0);
    Ok(Plant::TransferFunction(TransferFunction { num, den, delay_s, offset }))
}

fn read_term(section: &Section) -> Result<Term> {
    let name = section.text("kind")?;
    let kind = Kind::named(&name).map_err(|error| error.at_line(section.line_of("kind")))?;
    let own = kind.parameters.iter().map(|parameter| parameter.name);
    let spans: &[&str] = if kind.takes_spans() { &["spans"] } else { &[] };
    let keys: Vec<&str> =
        ["kind"].into_iter().chain(own).chain(["onset_s"]).chain(spans.iter().copied()).collect();
    section.only(&keys)?;
    let value = |parameter: &crate::physics::Parameter| match parameter.default {
        Some(default) => {
            section.optional_number(parameter.name, parameter.range).map(|x| x.unwrap_or(default))
        }
        None => section.number(parameter.name, parameter.range),
    };
    let parameters = kind.parameters.iter().map(value).collect::<Result<_>>()?;
    let onset_s = section.optional_number("onset_s", Range::NotNegative)?.unwrap_or(0.0);
    Ok(Term { kind, parameters, onset_s, spans: section.optional_pairs("spans")? })
}
