//! What reaches the plant under a recorded u, remembered: a search asks for the same again for each number of the plant that it moves.

use std::sync::{Arc, Mutex, PoisonError};

use crate::simulate::Simulation;
use crate::simulate::batch::{Driven, Reached};

use super::signals::Signals;

/// Answers that are kept: those of a base, of a few kinds beside it and of what moves now.
const KEPT: usize = 8;

/// What reaches plants under one recording, the latest answers first.
#[derive(Debug, Default)]
pub struct Memory(Mutex<Vec<(Reached, Arc<Driven>)>>);

impl Memory {
    /// What reaches a plant that was just started, over the first samples at least.
    pub fn driven(&self, simulation: &mut Simulation, signals: &Signals, samples: usize) -> Arc<Driven> {
        let by = simulation.reached_by();
        if let Some(known) = self.known(&by, samples) {
            return known;
        }
        let u = signals.u.get(..samples).unwrap_or(&[]);
        let made = Arc::new(simulation.driven(u, &signals.inputs));
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.insert(0, (by, made.clone()));
        kept.truncate(KEPT);
        made
    }

    fn known(&self, by: &Reached, samples: usize) -> Option<Arc<Driven>> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let at = kept.iter().position(|(of, driven)| of == by && driven.held.len() >= samples)?;
        let found = kept.remove(at);
        let driven = found.1.clone();
        kept.insert(0, found);
        Some(driven)
    }
}
