//! `paper.md`.
use super::Paper;
pub(super) fn text(_paper: &Paper) -> String { String::new() }
pub(super) fn summary(_paper: &Paper) -> String { String::new() }
