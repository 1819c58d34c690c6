//! The step of a damped least-squares fit within bounds: the least of a quadratic in a box, by the primal active-set method (Nocedal & Wright 2006,
//! "Numerical Optimization", chapter 16). A step that is solved for without bounds and cut off at them afterwards leads the other numbers to where they would belong
//! if nothing had been cut off, and often uphill.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Part of a bound's width, and of the slope, below which a number is at the bound, or nothing pulls it off.
const NONE: f64 = 1e-12;

/// A step and what it was solved from.
pub struct Bounded {
    /// By how much each number moves.
    pub by: DVector<f64>,
    /// The numbers that no bound holds.
    free: Vec<usize>,
    /// The curvature over these.
    curvature: Cholesky<f64, Dyn>,
}

impl Bounded {
    /// The step at which `slope by + by curvature by / 2` is least within `bounds`, each of them from a number of 0 or less to one of 0 or more; `None` where the
    /// curvature is not positive.
    pub fn least(curvature: &DMatrix<f64>, slope: &DVector<f64>, bounds: &[(f64, f64)]) -> Option<Self> {
        let count = slope.len();
        let mut by = DVector::zeros(count);
        let mut is_held = vec![false; count];
        // Each bound is met and left at most a few times; where rounding makes it more, the step so far is one within the bounds all the same.
        for _ in 0..4 * count + 4 {
            let free: Vec<usize> = (0..count).filter(|i| !is_held[*i]).collect();
            let pull = slope + curvature * &by;
            let solved = over(curvature, &free).cholesky()?;
            let more = solved.solve(&DVector::from_fn(free.len(), |i, _| -pull[free[i]]));
            let reach = free.iter().zip(more.iter()).map(|(i, more)| (*i, reach(by[*i], *more, bounds[*i])));
            let (first, part) = reach.fold(
                (None, 1.0),
                |least, (i, part)| {
                    if part < least.1 { (Some(i), part) } else { least }
                },
            );
            for (i, more) in free.iter().zip(more.iter()) {
                by[*i] = (by[*i] + part * more).clamp(bounds[*i].0, bounds[*i].1);
            }
            if let Some(met) = first {
                is_held[met] = true;
                continue;
            }
            let pull = slope + curvature * &by;
            let inward = |i: &usize| if by[*i] >= bounds[*i].1 { pull[*i] } else { -pull[*i] };
            let pulled = (0..count).filter(|i| is_held[*i] && inward(i) > NONE * slope.amax());
            match pulled.max_by(|a, b| inward(a).total_cmp(&inward(b))) {
                Some(left) => is_held[left] = false,
                None => return Some(Self { by, free, curvature: solved }),
            }
        }
        let free: Vec<usize> = (0..count).filter(|i| !is_held[*i]).collect();
        let solved = over(curvature, &free).cholesky()?;
        Some(Self { by, free, curvature: solved })
    }

    /// By how much the numbers that no bound holds move more under another slope.
    pub fn more(&self, slope: &DVector<f64>) -> DVector<f64> {
        let solved = self.curvature.solve(&DVector::from_fn(self.free.len(), |i, _| -slope[self.free[i]]));
        let mut more = DVector::zeros(slope.len());
        self.free.iter().zip(solved.iter()).for_each(|(i, solved)| more[*i] = *solved);
        more
    }
}

/// The rows and columns of some numbers.
fn over(curvature: &DMatrix<f64>, free: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(free.len(), free.len(), |i, j| curvature[(free[i], free[j])])
}

/// What part of a move leads to a bound.
fn reach(from: f64, by: f64, (low, high): (f64, f64)) -> f64 {
    let room = if by > 0.0 { high - from } else { low - from };
    let is_past = by != 0.0 && (room / by) < 1.0 && (by - room).abs() > NONE * by.abs();
    if is_past { (room / by).max(0.0) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quadratic at a step.
    fn value(curvature: &DMatrix<f64>, slope: &DVector<f64>, by: &DVector<f64>) -> f64 {
        slope.dot(by) + 0.5 * (curvature * by).dot(by)
    }

    /// Two numbers of which the second would leave its bound: the first goes to where it is best with the second at the bound, by hand.
    #[test]
    fn the_others_follow_what_a_bound_holds() {
        let curvature = DMatrix::from_row_slice(2, 2, &[2.0, 1.8, 1.8, 2.0]);
        let slope = DVector::from_vec(vec![-1.0, -2.0]);
        let step = Bounded::least(&curvature, &slope, &[(-10.0, 10.0), (-1.0, 0.5)]).unwrap();
        assert!((step.by[1] - 0.5).abs() < 1e-12);
        // 2 a + 1.8 / 2 = 1.
        assert!((step.by[0] - 0.05).abs() < 1e-12, "{}", step.by[0]);
    }

    /// A bound that is met first and is not where the least is gets left again.
    #[test]
    fn a_bound_is_left_where_the_least_is_elsewhere() {
        let curvature = DMatrix::from_row_slice(2, 2, &[1.0, 0.9, 0.9, 1.0]);
        let slope = DVector::from_vec(vec![-1.0, -0.6]);
        let bounds = [(0.0, 0.4), (-0.05, 1.0)];
        let step = Bounded::least(&curvature, &slope, &bounds).unwrap();
        let least = value(&curvature, &slope, &step.by);
        for i in 0..=200 {
            for j in 0..=200 {
                let at = |k: usize, n: usize| bounds[k].0 + (bounds[k].1 - bounds[k].0) * n as f64 / 200.0;
                let by = DVector::from_vec(vec![at(0, i), at(1, j)]);
                assert!(least <= value(&curvature, &slope, &by) + 1e-12, "{by}");
            }
        }
    }

    /// Nothing holds it: the step is Newton's.
    #[test]
    fn without_bounds_it_is_the_least_of_all() {
        let curvature = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 3.0]);
        let slope = DVector::from_vec(vec![1.0, 2.0]);
        let step = Bounded::least(&curvature, &slope, &[(-9.0, 9.0); 2]).unwrap();
        assert!((&curvature * &step.by + &slope).amax() < 1e-12);
        assert!((step.more(&slope) - &step.by).amax() < 1e-12);
    }

    /// All numbers at their bounds and pulled outward: no step.
    #[test]
    fn nothing_moves_out_of_the_bounds() {
        let curvature = DMatrix::identity(2, 2);
        let step =
            Bounded::least(&curvature, &DVector::from_vec(vec![-1.0, 1.0]), &[(-1.0, 0.0), (0.0, 1.0)]);
        assert_eq!(step.unwrap().by, DVector::zeros(2));
    }
}
