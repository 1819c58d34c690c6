//! u, or the size of the error, at another level than before while r stood still: the means of ten blocks against those of the ten before them.

use std::collections::VecDeque;

use super::{Kind, Stretch};

/// Samples of a block.
const BLOCK: u64 = 100;
/// Blocks on either side of the change.
const SIDE: usize = 10;
/// Standard errors from which on two sides differ. Blocks of a slow loop are correlated: three standard errors would be found everywhere.
const CLEAR: f64 = 12.0;

#[derive(Debug, Clone, Copy, Default)]
struct Block {
    from_s: f64,
    to_s: f64,
    samples: u64,
    u: f64,
    abs_e: f64,
}

/// Looks for it.
#[derive(Debug, Clone, Default)]
pub(super) struct Changes {
    r: Option<f64>,
    now: Block,
    blocks: VecDeque<Block>,
    /// The clearest place of the change that is being passed.
    open: Option<Stretch>,
}

impl Changes {
    pub fn sample(&mut self, t_s: f64, r: f64, e: f64, u: f64) -> Option<Stretch> {
        if self.r != Some(r) {
            self.r = Some(r);
            self.blocks.clear();
            self.now = Block::default();
        }
        let now = &mut self.now;
        if now.samples == 0 {
            now.from_s = t_s;
        }
        now.samples += 1;
        now.u += u / BLOCK as f64;
        now.abs_e += e.abs() / BLOCK as f64;
        now.to_s = t_s;
        if now.samples < BLOCK {
            return None;
        }
        let block = std::mem::take(now);
        self.blocks.push_back(block);
        if self.blocks.len() > 2 * SIDE {
            self.blocks.pop_front();
        }
        self.compare()
    }

    fn compare(&mut self) -> Option<Stretch> {
        if self.blocks.len() < 2 * SIDE {
            return self.end();
        }
        let score = [|b: &Block| b.u, |b: &Block| b.abs_e]
            .map(|of| self.distance(of))
            .into_iter()
            .fold(0.0, f64::max);
        if score < CLEAR {
            return self.end();
        }
        let (first, last) = (self.blocks.front()?, self.blocks.back()?);
        let here = Stretch { kind: Kind::Change, from_s: first.from_s, to_s: last.to_s, score };
        if self.open.is_none_or(|open| open.score < score) {
            self.open = Some(here);
        }
        None
    }

    /// How far the means of both sides are apart, standard errors; 0 where nothing varies.
    fn distance(&self, of: fn(&Block) -> f64) -> f64 {
        let side = |from: usize| {
            let values = self.blocks.iter().skip(from).take(SIDE).map(of);
            let mean = values.clone().sum::<f64>() / SIDE as f64;
            (mean, values.map(|x| (x - mean).powi(2)).sum::<f64>() / (SIDE - 1) as f64)
        };
        let ((a, va), (b, vb)) = (side(0), side(SIDE));
        let error = ((va + vb) / SIDE as f64).sqrt();
        if error > 0.0 { (a - b).abs() / error } else { 0.0 }
    }

    pub fn end(&mut self) -> Option<Stretch> {
        self.open.take()
    }
}
