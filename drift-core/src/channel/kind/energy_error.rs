//! The paper's pair: an error index against the control energy (equations 2, 3 and 5).

use super::ChannelMeaning;
use crate::index::{Index, Indices};
use crate::report::Location;

pub(super) const fn coordinates(of: &Indices, index: Index) -> (f32, f32) {
    (of.e_u, of.error_index(index))
}

pub(super) const MEANING: ChannelMeaning = ChannelMeaning {
    location: Location::Tracking,
    place: 0,
    chosen_by: None,
    remembers: false,
    x_is_y: false,
    x_axis: "E_u / (u\u{b2} s)",
    value_axis: |index| match index {
        Index::Iae => "J_e = IAE / (y s)",
        Index::Ise => "J_e = ISE / (y\u{b2} s)",
        Index::Itae => "J_e = ITAE / (y s\u{b2})",
        Index::Itse => "J_e = ITSE / (y\u{b2} s\u{b2})",
    },
    looks_at: "the error for the energy spent",
    above: "The loop tracks worse for the energy that it spends,",
    below: "The loop tracks better for the energy that it spends,",
    cause_above: "Slower dynamics, a disturbance, or noise would do that.",
    cause_below: "The error may have become smaller, or energy is spent that it does not ask for.",
    change_of_u: None,
    x_is_constant: "its x never varies",
};
