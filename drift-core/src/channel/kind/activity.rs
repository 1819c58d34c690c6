//! The control energy against the reference's own activity.

use super::ChannelMeaning;
use crate::index::Indices;
use crate::report::Location;

pub(super) const fn coordinates(of: &Indices) -> (f32, f32) {
    (of.reference_activity, of.e_u)
}

pub(super) const MEANING: ChannelMeaning = ChannelMeaning {
    location: Location::Dynamics,
    place: 2,
    chosen_by: None,
    remembers: false,
    x_is_y: false,
    x_axis: "activity of r / y\u{b2}",
    value_axis: |_| "E_u / (u\u{b2} s)",
    looks_at: "the controller's activity",
    above: "The controller works harder for the same set-point,",
    below: "The controller works less for the same set-point,",
    cause_above: "Other dynamics, another gain, or noise would do that.",
    cause_below: "Other dynamics, another gain, or noise would do that.",
    change_of_u: None,
    x_is_constant: "the reference never moves inside a window",
};
