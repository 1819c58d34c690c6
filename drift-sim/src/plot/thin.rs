//! Long lines made short without losing a spike: clipped to the panel, then thinned to the least and the greatest
//! value in each column of pixels.

/// A place on the panel, px: x to the right and y down from its upper left corner.
pub(super) type Place = (f64, f64);

/// Consecutive points in one column up to which all are kept.
const FEW: usize = 4;

/// The pieces of a line that lie inside a panel of this size, thinned. `None` in the points breaks the line.
pub(super) fn pieces(
    points: impl Iterator<Item = Option<Place>>,
    width: f64,
    height: f64,
) -> Vec<Vec<Place>> {
    let mut pieces: Vec<Vec<Place>> = Vec::new();
    let mut current = Column::default();
    let mut piece: Vec<Place> = Vec::new();
    let mut before: Option<Place> = None;
    let mut end = |piece: &mut Vec<Place>, current: &mut Column| {
        current.close_into(piece);
        if !piece.is_empty() {
            pieces.push(std::mem::take(piece));
        }
    };
    let mut pen: Option<Place> = None;
    for point in points {
        let Some(point) = point else {
            end(&mut piece, &mut current);
            (before, pen) = (None, None);
            continue;
        };
        if let Some(from) = before {
            match clip(from, point, width, height) {
                Some((start, stop)) => {
                    if pen != Some(start) {
                        end(&mut piece, &mut current);
                        current.add(start, &mut piece);
                    }
                    current.add(stop, &mut piece);
                    pen = Some(stop);
                }
                None => pen = None,
            }
        }
        before = Some(point);
    }
    end(&mut piece, &mut current);
    pieces
}

/// Consecutive points of one column of pixels.
#[derive(Default)]
struct Column {
    index: i64,
    count: usize,
    first: [Place; FEW],
    /// With the order in which they came.
    least: (usize, Place),
    greatest: (usize, Place),
}

impl Column {
    fn add(&mut self, point: Place, piece: &mut Vec<Place>) {
        let index = libm::floor(point.0) as i64;
        if self.count > 0 && index != self.index {
            self.close_into(piece);
        }
        if self.count == 0 {
            self.index = index;
            self.least = (0, point);
            self.greatest = (0, point);
        }
        if let Some(slot) = self.first.get_mut(self.count) {
            *slot = point;
        }
        if point.1 < self.least.1.1 {
            self.least = (self.count, point);
        }
        if point.1 > self.greatest.1.1 {
            self.greatest = (self.count, point);
        }
        self.count += 1;
    }

    fn close_into(&mut self, piece: &mut Vec<Place>) {
        if self.count <= FEW {
            piece.extend(self.first.iter().take(self.count));
        } else if self.least.0 == self.greatest.0 {
            piece.push(self.least.1);
        } else {
            let (a, b) = (self.least.min_by_order(self.greatest), self.least.max_by_order(self.greatest));
            piece.extend([a, b]);
        }
        self.count = 0;
    }
}

/// The earlier and the later of two.
trait ByOrder {
    fn min_by_order(self, other: Self) -> Place;
    fn max_by_order(self, other: Self) -> Place;
}

impl ByOrder for (usize, Place) {
    fn min_by_order(self, other: Self) -> Place {
        if self.0 <= other.0 { self.1 } else { other.1 }
    }

    fn max_by_order(self, other: Self) -> Place {
        if self.0 > other.0 { self.1 } else { other.1 }
    }
}

/// The part of a stroke inside the panel (Liang and Barsky, ACM Transactions on Graphics 3(1), 1984).
fn clip(from: Place, to: Place, width: f64, height: f64) -> Option<(Place, Place)> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (p, q) in [(-dx, from.0), (dx, width - from.0), (-dy, from.1), (dy, height - from.1)] {
        if p == 0.0 {
            if q < 0.0 {
                return None;
            }
        } else if p < 0.0 {
            enter = enter.max(q / p);
        } else {
            leave = leave.min(q / p);
        }
    }
    let at = |s: f64| {
        if s == 0.0 {
            from
        } else if s == 1.0 {
            to
        } else {
            (from.0 + s * dx, from.1 + s * dy)
        }
    };
    (enter <= leave).then(|| (at(enter), at(leave)))
}

/// Points that would be drawn over each other left out: one a cell of this size, px.
pub(super) fn apart(points: impl Iterator<Item = Place>, cell_px: f64) -> Vec<Place> {
    let mut taken = std::collections::HashSet::new();
    points
        .filter(|(x, y)| taken.insert((libm::round(x / cell_px) as i64, libm::round(y / cell_px) as i64)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_points_keep_their_one_spike() {
        let points = (0..1_000_000).map(|i| {
            let y = if i == 654_321 { 3.0 } else { 50.0 + f64::from(i % 7) };
            Some((f64::from(i) * 8e-4, y))
        });
        let pieces = pieces(points, 800.0, 100.0);
        assert_eq!(pieces.len(), 1);
        assert!(pieces[0].len() <= 1602, "{}", pieces[0].len());
        assert!(pieces[0].iter().any(|(_, y)| *y == 3.0));
    }

    #[test]
    fn few_points_are_kept_as_they_are_and_gaps_break_the_line() {
        let a = [(0.5, 1.0), (10.0, 2.0), (11.0, 3.0)];
        let b = [(20.0, 1.0), (30.0, 9.0)];
        let points = a.iter().map(|p| Some(*p)).chain([None]).chain(b.iter().map(|p| Some(*p)));
        assert_eq!(pieces(points, 100.0, 100.0), [a.to_vec(), b.to_vec()]);
    }

    #[test]
    fn lines_end_at_the_edge_of_the_panel() {
        let points = [(-10.0, 50.0), (50.0, 50.0), (50.0, 150.0), (90.0, 150.0), (90.0, 50.0)];
        let inside = pieces(points.iter().map(|p| Some(*p)), 100.0, 100.0);
        assert_eq!(
            inside,
            [vec![(0.0, 50.0), (50.0, 50.0), (50.0, 100.0)], vec![(90.0, 100.0), (90.0, 50.0)]]
        );
    }
}
