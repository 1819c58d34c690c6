//! How likely recordings are under a loop with free numbers, and the numbers at which they are likeliest: one model of the noise
//! ([`noise`]), one filter ([`innovations`]), one likelihood ([`likelihood`]), one search ([`fit`]) for all that is concluded from
//! recordings.

#[cfg(test)]
mod all_at_once;
mod begin;
mod bounded;
pub mod directions;
pub mod driven;
pub mod filter_batch;
mod filter_forced;
mod filter_servo;
pub mod first_look;
pub mod fit;
pub mod free;
pub mod gains;
pub mod hypothesis;
pub mod inner_product;
pub mod innovations;
pub mod jumps;
pub mod lanes;
pub mod lattice;
pub mod law_replay;
pub mod level;
pub mod likelihood;
pub mod linear_part;
pub mod measure;
pub mod noise;
mod rest;
mod side_by_side;
pub mod signals;
pub mod waves;
pub mod whiten;
