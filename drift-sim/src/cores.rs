//! Work on many items by all cores at once, its results in the items' order.
//!
//! All of it goes through one compiled function. rayon's own iterators, whose names these bear, are compiled anew with all their splitting and
//! stealing for every closure that they are given.

use std::sync::{Mutex, PoisonError};

use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// Calls `work` with every number below `count`, each once, in no order.
fn spread(count: usize, work: &(dyn Fn(usize) + Sync)) {
    match count {
        0 => {}
        1 => work(0),
        _ => IntoParallelIterator::into_par_iter(0..count).for_each(work),
    }
}

/// Items to be spread over the cores.
pub(crate) struct Items<T>(Vec<T>);

/// What has items to spread. Only `map`, `filter_map` and `for_each` of [`Items`] do, at once; what stands before and after them is done in order.
pub(crate) trait AcrossCores {
    /// The items themselves.
    fn into_par_iter(self) -> Items<Self::Item>
    where
        Self: IntoIterator + Sized,
    {
        Items(self.into_iter().collect())
    }

    /// References to the items.
    fn par_iter<'a>(&'a self) -> Items<<&'a Self as IntoIterator>::Item>
    where
        &'a Self: IntoIterator,
    {
        Items(self.into_iter().collect())
    }

    /// References to the items, which change.
    fn par_iter_mut<'a>(&'a mut self) -> Items<<&'a mut Self as IntoIterator>::Item>
    where
        &'a mut Self: IntoIterator,
    {
        Items(self.into_iter().collect())
    }
}

impl<T: ?Sized> AcrossCores for T {}

/// An item before and its result after, or neither.
struct Slot<T, R>(Mutex<(Option<T>, Option<R>)>);

impl<T, R> Slot<T, R> {
    fn new(item: T) -> Self {
        Self(Mutex::new((Some(item), None)))
    }

    /// The lock is not held while the work is done: work may spread work of its own, and panic.
    fn done(&self, work: impl FnOnce(T) -> R) {
        let item = self.0.lock().unwrap_or_else(PoisonError::into_inner).0.take();
        if let Some(item) = item {
            let result = work(item);
            self.0.lock().unwrap_or_else(PoisonError::into_inner).1 = Some(result);
        }
    }

    fn result(self) -> Option<R> {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner).1
    }
}

impl<T: Send> Items<T> {
    /// The results of all items.
    pub(crate) fn map<R: Send>(self, work: impl Fn(T) -> R + Sync) -> std::vec::IntoIter<R> {
        let slots: Vec<Slot<T, R>> = self.0.into_iter().map(Slot::new).collect();
        spread(slots.len(), &|i| {
            if let Some(slot) = slots.get(i) {
                slot.done(&work);
            }
        });
        // A panic of the work has gone through `spread`: every slot has its result.
        slots.into_iter().filter_map(Slot::result).collect::<Vec<_>>().into_iter()
    }

    /// The results of the items that have one.
    pub(crate) fn filter_map<R: Send>(
        self,
        work: impl Fn(T) -> Option<R> + Sync,
    ) -> std::iter::Flatten<std::vec::IntoIter<Option<R>>> {
        let found = self.map(work);
        found.flatten()
    }

    /// Does the work on all items.
    pub(crate) fn for_each(self, work: impl Fn(T) + Sync) {
        self.map(work);
    }

    /// The items that are asked for. Not spread: what takes long is a `filter_map`.
    pub(crate) fn filter(mut self, asked: impl FnMut(&T) -> bool) -> Self {
        self.0.retain(asked);
        self
    }

    /// The items with their places.
    pub(crate) fn enumerate(self) -> Items<(usize, T)> {
        Items(self.0.into_iter().enumerate().collect())
    }

    /// The items beside others.
    pub(crate) fn zip<U>(self, others: impl IntoIterator<Item = U>) -> Items<(T, U)> {
        Items(self.0.into_iter().zip(others).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::AcrossCores;

    #[test]
    fn results_stand_in_the_items_order() {
        let squares: Vec<usize> = (0..1000).into_par_iter().map(|i| i * i).collect();
        assert!(squares.iter().enumerate().all(|(i, square)| *square == i * i));
        let odd: Vec<usize> = squares.par_iter().filter_map(|i| (i % 2 == 1).then_some(*i)).collect();
        assert_eq!(odd.len(), 500);
        assert!(odd.is_sorted());
    }

    #[test]
    fn work_spreads_work_of_its_own() {
        let mut sums = vec![0_usize; 50];
        sums.par_iter_mut().enumerate().for_each(|(i, sum)| *sum = (0..i).into_par_iter().map(|k| k).sum());
        assert!(sums.iter().enumerate().all(|(i, sum)| *sum == i * i.saturating_sub(1) / 2));
    }

    #[test]
    fn a_panic_reaches_whoever_asked() {
        let asked = std::panic::catch_unwind(|| (0..8).into_par_iter().for_each(|i| assert!(i != 5)));
        assert!(asked.is_err());
    }
}
