//! A plant's own numbers, as a fit moves them.

/// What a number is to the plant: how a fit may move it, and what goes with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// What y gains per unit of u: scales as the whole plant does.
    Gain,
    /// A servo's inertia.
    Inertia,
    /// A servo's viscous friction.
    Viscous,
    /// A time constant.
    Time,
    /// A dead time.
    Delay,
    /// y, or the drive, at u = 0.
    Offset,
    /// Any other coefficient of its dynamics.
    Shape,
}

/// One number of a plant.
#[derive(Debug, Clone, PartialEq)]
pub struct Number {
    /// Its key in the loop file, after `plant.`.
    pub name: String,
    /// Its value, in its own unit.
    pub value: f64,
    /// What it is to the plant.
    pub role: Role,
}

impl Number {
    pub(super) fn new(name: impl Into<String>, value: f64, role: Role) -> Self {
        Self { name: name.into(), value, role }
    }
}

/// Puts values into slots, in order; slots beyond the values stay as they are.
pub(super) fn put<'a>(values: &[f64], slots: impl IntoIterator<Item = &'a mut f64>) {
    for (slot, value) in slots.into_iter().zip(values) {
        *slot = *value;
    }
}
