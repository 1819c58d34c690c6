//! Mean of u sign(dy) against the speed: what it takes to move.

use super::ChannelMeaning;
use crate::index::Indices;
use crate::report::Location;

pub(super) const fn coordinates(of: &Indices) -> (f32, f32) {
    (of.speed, of.motion_effort)
}

pub(super) const MEANING: ChannelMeaning = ChannelMeaning {
    location: Location::Friction,
    place: 1,
    chosen_by: Some("motion"),
    remembers: false,
    x_is_y: false,
    x_axis: "speed / (y/s)",
    value_axis: |_| "u along the motion",
    looks_at: "the effort along the motion",
    above: "It takes more effort to move than it did,",
    below: "It takes less effort to move than it did,",
    cause_above: "Friction, a load against the motion, or lost drive gain would do that.",
    cause_below: "Less friction, a load along the motion, or more drive gain would do that.",
    change_of_u: Some("mean change of u along the motion"),
    x_is_constant: "its x never varies",
};
