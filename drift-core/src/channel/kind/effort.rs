//! Mean u against mean y: what it takes to hold y.

use super::ChannelMeaning;
use crate::index::Indices;
use crate::report::Location;

pub(super) const fn coordinates(of: &Indices) -> (f32, f32) {
    (of.mean_y, of.mean_u)
}

pub(super) const MEANING: ChannelMeaning = ChannelMeaning {
    location: Location::OperatingPoint,
    place: 1,
    chosen_by: Some("holding"),
    remembers: true,
    x_is_y: true,
    x_axis: "mean y",
    value_axis: |_| "mean u",
    looks_at: "the effort to hold y",
    above: "It takes more effort to hold y than it did,",
    below: "It takes less effort to hold y than it did,",
    cause_above: "A load, a leak, lost gain, or a sensor that reads low would do that.",
    cause_below: "A load that is gone, more gain, or a sensor that reads high would do that.",
    change_of_u: Some("mean change of u at the same y"),
    x_is_constant: "its x never varies",
};
