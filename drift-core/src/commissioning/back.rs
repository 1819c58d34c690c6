//! Commissioning with a memory: what the windows before add to a channel is learnt in place too.

use core::fmt::Debug;

use super::{Commissioning, NotReady, Owner, Reader, StateError, Writer, honest_arl0};
use crate::channel::{Baseline, Channel, ChannelReport};
use crate::config::Config;
use crate::detector::Cusum;
use crate::index::IndicesAt;
use crate::math;
use crate::memory::{LastWindows, Memory, MemoryKind, Remembering};
use crate::number::Number;
use crate::operating_point::OperatingPoint;
use crate::report::{Report, WindowStatus};
use crate::store::{CHECKSUM_BYTES, HEADER_BYTES};
use crate::triangle::{self, Columns, MOST_COLUMNS, Solution, Triangle, cells, first, has};

/// Stands where a monitor's saved state has its index set.
const COMMISSIONING_BACK_TAG: u8 = 0x82;
/// Beyond this the next window's weight is lost to rounding.
const MOST_WINDOWS: f32 = 16_777_216.0;

/// How many windows back is learnt at most, and whether a measured operating point is learnt with it, as a type: [`Order`] or
/// [`OrderAt`]. Sealed.
pub trait LearntOrder: Copy + Debug + PartialEq + sealed::Sealed + 'static {
    /// The sums.
    type Cells: Copy + Debug + PartialEq + AsRef<[f32]> + AsMut<[f32]>;
    /// No window yet.
    const EMPTY: Self::Cells;
    /// Windows back, at most.
    const ORDER: usize;
    /// With an operating point.
    const POINT: bool;
}

mod sealed {
    pub trait Sealed {}
}

/// A memory of up to `WINDOWS` windows, 1 to 3.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Order<const WINDOWS: usize>;

/// The same, and the weight of a measured operating point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OrderAt<const WINDOWS: usize>;

macro_rules! orders {
    ($($Order:ident: $point:literal, $($windows:literal)*;)*) => {
        $($(
            impl sealed::Sealed for $Order<$windows> {}
            impl LearntOrder for $Order<$windows> {
                type Cells = [f32; cells(columns($windows, $point))];
                const EMPTY: Self::Cells = [0.0; cells(columns($windows, $point))];
                const ORDER: usize = $windows;
                const POINT: bool = $point;
            }
        )*)*
    };
}

orders! {
    Order: false, 1 2 3;
    OrderAt: true, 1 2 3;
}

/// Coefficients of a relation: 1, x, the point, x and value of each window before.
const fn columns(order: usize, point: bool) -> usize {
    2usize.saturating_add(point as usize).saturating_add(order.saturating_mul(2))
}

/// Learns one channel's relation with what the windows before add to it, from the reports of a healthy loop: as
/// [`Commissioning`] for a channel whose kind [remembers](crate::ChannelMeaning::remembers). `K` is how far back it reaches at most.
///
/// Feed it every report in order, of windows that do not overlap. What is missing, and a gap in [`Report::hop`], is a hole: the windows
/// behind it are not held against those before it. 124, 176 and 244 bytes for [`Order`] of 1, 2 and 3 windows; nothing of it is
/// linked where it is not used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MemoryCommissioning<K: LearntOrder> {
    place: u8,
    /// Windows come with a point.
    at: bool,
    next_hop: u32,
    last: LastWindows,
    /// x, value and point of the first window: sums are of what lies apart from it.
    origin: [f32; 3],
    x_range: (f32, f32),
    point_range: (f32, f32),
    residual_ss: f32,
    cells: K::Cells,
}

/// A relation and how many coefficients it has.
struct Fitted {
    order: usize,
    coefficients: usize,
    of: Solution,
}

impl<K: LearntOrder> MemoryCommissioning<K> {
    /// Windows for each of a relation's coefficients: fewer teach noise. A memory of one window needs 100, of three 200; 25
    /// more with an operating point.
    pub const WINDOWS_PER_COEFFICIENT: u32 = 25;

    /// Bytes that [`MemoryCommissioning::save`] needs.
    pub const STATE_BYTES: usize =
        HEADER_BYTES + 6 + Remembering::BYTES + 4 * (8 + cells(columns(K::ORDER, K::POINT))) + CHECKSUM_BYTES;

    /// Nothing learnt yet of the channel at this place of the configuration, from 0.
    pub const fn of_channel(place: u8) -> Self {
        Self {
            place,
            at: false,
            next_hop: 0,
            last: Remembering::START,
            origin: [0.0; 3],
            x_range: (f32::MAX, f32::MIN),
            point_range: (f32::MAX, f32::MIN),
            residual_ss: 0.0,
            cells: K::EMPTY,
        }
    }

    /// Adds one healthy decision: with a memory of three windows 1 500 instructions on a Cortex-M4F. The relation, which is asked for once,
    /// takes up to 11 000 there; both together up to 109 000 on a Cortex-M0.
    pub fn learn<const C: usize, I, X, D, F>(&mut self, report: &Report<C, I, X, ChannelReport<D, F>>) {
        self.learn_report(report, f32::NAN);
    }

    /// The same with the report's operating point.
    pub fn learn_at<const C: usize, X, D, F>(
        &mut self,
        report: &Report<C, IndicesAt, X, ChannelReport<D, F>>,
    ) {
        self.learn_report(report, report.indices.operating_point);
    }

    fn learn_report<const C: usize, I, X, D, F>(
        &mut self,
        report: &Report<C, I, X, ChannelReport<D, F>>,
        point: f32,
    ) {
        let channel = report.channels.get(usize::from(self.place));
        let valid = channel.filter(|_| report.status == WindowStatus::Valid);
        let (x, value) = valid.map_or((f32::NAN, f32::NAN), |channel| (channel.x, channel.value));
        self.learn_window(report.hop, x, value, point);
    }

    /// Adds one healthy window by its number ([`Report::hop`]), its coordinates and the point's mean, which is NaN where there is none. What
    /// is not finite is a hole.
    pub fn learn_window(&mut self, hop: u32, x: f32, value: f32, point: f32) {
        if hop != self.next_hop {
            Remembering::forget(&mut self.last);
        }
        self.next_hop = hop.wrapping_add(1);
        if self.windows() == 0 {
            self.at = K::POINT && point.is_finite();
        }
        if !(x.is_finite() && value.is_finite() && (point.is_finite() || !self.at)) {
            Remembering::forget(&mut self.last);
            return;
        }
        if usize::from(self.last.windows()) >= K::ORDER {
            self.include(x, value, point);
        }
        self.last.push(x, value);
    }

    /// Into the triangle. What would overflow is passed over; at 2^24 windows it stops learning.
    fn include(&mut self, x: f32, value: f32, point: f32) {
        if self.windows() == 0 {
            self.origin = [x, value, if self.at { point } else { 0.0 }];
        }
        let [x0, value0, point0] = self.origin;
        let mut row = [0.0; MOST_COLUMNS + 1];
        let mut length = 0usize;
        let mut put = |number: f32| {
            if let Some(place) = row.get_mut(length) {
                *place = number;
                length = length.wrapping_add(1);
            }
        };
        put(1.0);
        put(x - x0);
        if K::POINT {
            put(if self.at { point - point0 } else { 0.0 });
        }
        for (x, value) in self.last.pairs().take(K::ORDER) {
            put(x - x0);
            put(value - value0);
        }
        put(value - value0);
        let mut next = self.cells;
        let Some(row) = row.get_mut(..length) else { return };
        let residual_ss = self.residual_ss + triangle::include(next.as_mut(), row);
        let finite = residual_ss.is_finite() && next.as_ref().iter().all(|cell| cell.is_finite());
        if !finite || Self::triangle(&next).own(0) > MOST_WINDOWS {
            return;
        }
        (self.cells, self.residual_ss) = (next, residual_ss);
        widen(&mut self.x_range, x);
        if self.at {
            widen(&mut self.point_range, point);
        }
    }

    fn triangle(cells: &K::Cells) -> Triangle<'_> {
        Triangle::new(cells.as_ref(), columns(K::ORDER, K::POINT))
    }

    /// The channel's place in the configuration, from 0.
    pub const fn place(&self) -> u8 {
        self.place
    }

    /// Windows learnt from: those with [`LearntOrder::ORDER`] windows before them.
    pub fn windows(&self) -> u32 {
        Self::triangle(&self.cells).own(0) as u32
    }

    /// The relation with the order that pays, up to `K`'s: baseline, operating point, memory. An order is taken if a new window is
    /// predicted 1 % better than by the orders below it, reckoned from the residual's size and the number of coefficients (Akaike's final
    /// prediction error, 1969). Order 0 where none pays.
    ///
    /// `drift calibrate` takes the order behind which a lasting shift is seen soonest, by a simulation, and makes thresholds for
    /// the correlation that is left. In place thresholds are given for independent windows, so that the residual has to be white;
    /// [`Memory::visible`] says how much of a lasting shift the memory hides for it.
    ///
    /// # Errors
    /// Fewer windows than an order of 1 needs, an index that does not scatter, a point that stands still.
    pub fn relation(&self) -> Result<(Baseline, OperatingPoint, Memory), NotReady> {
        self.enough(1)?;
        let counting = self.counting()?;
        let mut best = self.fitted(0, counting);
        let mut least = self.prediction_error(&best);
        for order in (1..=K::ORDER).filter(|&order| self.enough(order).is_ok()) {
            let fitted = self.fitted(order, counting);
            let error = self.prediction_error(&fitted);
            if error < 0.99 * least {
                (best, least) = (fitted, error);
            }
        }
        self.described(&best)
    }

    /// The relation with a memory of exactly `order` windows, `K`'s at most.
    ///
    /// # Errors
    /// As [`MemoryCommissioning::relation`], of this order.
    pub fn relation_of(&self, order: usize) -> Result<(Baseline, OperatingPoint, Memory), NotReady> {
        let order = order.min(K::ORDER);
        self.enough(order)?;
        self.described(&self.fitted(order, self.counting()?))
    }

    /// Puts [`MemoryCommissioning::relation`] into a channel, whose detectors stay as they are.
    ///
    /// # Errors
    /// As [`MemoryCommissioning::relation`]; then nothing is written.
    pub fn finish(&self, channel: &mut Channel) -> Result<(), NotReady> {
        (channel.baseline, channel.operating_point, channel.memory) = self.relation()?;
        Ok(())
    }

    /// The mean run length to a false alarm (decisions) that nine of ten devices keep: [`Commissioning::honest_arl0`] of half the windows.
    /// What is wrong with a memory's coefficients goes on from window to window, which a CUSUM adds up; simulated from 200 to 1000
    /// windows, devices keep 0.9 to 1.25 of it.
    pub fn honest_arl0(&self, cusum: &Cusum) -> f32 {
        honest_arl0(cusum, self.windows() / 2)
    }

    fn enough(&self, order: usize) -> Result<(), NotReady> {
        let coefficients = columns(order, self.at) as u32;
        let needed = Self::WINDOWS_PER_COEFFICIENT.saturating_mul(coefficients);
        let windows = self.windows();
        if windows < needed { Err(NotReady::TooFewWindows { windows, needed }) } else { Ok(()) }
    }

    /// The columns that vary.
    fn counting(&self) -> Result<Columns, NotReady> {
        let [x, value, point] = self.origin;
        let levels = if K::POINT {
            [1.0, x, point, x, value, x, value, x, value]
        } else {
            [1.0, x, x, value, x, value, x, value, 0.0]
        };
        let counting = Self::triangle(&self.cells).varying(&levels);
        if self.at && counting & 4 == 0 {
            return Err(NotReady::PointStandsStill { channel: self.place });
        }
        Ok(counting)
    }

    /// Least squares with this order; the sum of the value's own coefficients is held at its bound.
    #[inline(never)]
    fn fitted(&self, order: usize, counting: Columns) -> Fitted {
        let triangle = Self::triangle(&self.cells);
        let columns_here = counting & first(columns(order, K::POINT));
        let mut of = triangle.solve(columns_here);
        // The value's own are every other one behind the point.
        let own: Columns = if K::POINT { 0b1_0101_0000 } else { 0b1010_1000 };
        let mut excess = -Memory::MOST_OWN;
        for (_, c) in (0..MOST_COLUMNS).zip(&of.coefficients).filter(|(i, _)| has(own, *i)) {
            excess += c;
        }
        if excess > 0.0 {
            triangle.hold(&mut of, columns_here, own, excess);
        }
        of.residual_ss += self.residual_ss;
        Fitted { order, coefficients: columns(order, self.at), of }
    }

    /// Residual variance of the windows learnt from.
    fn variance(&self, of: &Fitted) -> f32 {
        of.of.residual_ss / self.windows().saturating_sub(of.coefficients as u32).max(1) as f32
    }

    /// Mean squared error of a new window (Akaike 1969).
    fn prediction_error(&self, of: &Fitted) -> f32 {
        self.variance(of) * (1.0 + of.coefficients as f32 / self.windows().max(1) as f32)
    }

    fn described(&self, of: &Fitted) -> Result<(Baseline, OperatingPoint, Memory), NotReady> {
        let triangle = Self::triangle(&self.cells);
        let [x0, value0, point0] = self.origin;
        let variance = self.variance(of);
        let rounding = 1e-6 * value0;
        if variance <= rounding * rounding {
            return Err(NotReady::NoScatter { channel: self.place });
        }
        let (memory, point) = (self.memory(of), self.point(of));
        let windows = self.windows() as f32;
        let mut terms = of.of.coefficients.into_iter();
        let (level, b1) = (terms.next().unwrap_or(0.0), terms.next().unwrap_or(0.0));
        let [a, b, c] = memory.x;
        // What the memory's coefficients spend is known from these windows alone: a new window scatters more by that.
        let spent = 2.0 * of.order as f32 / windows;
        let baseline = Baseline {
            b0: level + value0 * memory.visible() - x0 * (b1 + a + b + c) - point0 * point.weight,
            b1,
            sigma: math::sqrt(variance * (1.0 + spent)),
            windows,
            x_mean: x0 + triangle.share(0, 1),
            // Without a slope there is no leverage to account for.
            x_ss: if b1 == 0.0 { 0.0 } else { triangle.own(1) },
            x_min: self.x_range.0,
            x_max: self.x_range.1,
        };
        Ok((baseline, point, memory))
    }

    fn memory(&self, of: &Fitted) -> Memory {
        let mut memory = Memory { order: of.order as u8, ..Memory::NONE };
        let mut terms = of.of.coefficients.into_iter().skip(columns(0, K::POINT));
        for (x, value) in memory.x.iter_mut().zip(&mut memory.value).take(of.order) {
            (*x, *value) = (terms.next().unwrap_or(0.0), terms.next().unwrap_or(0.0));
        }
        // Rounded, the bound may be passed by the last bits.
        let over = (1.0 - Memory::MOST_OWN) - memory.visible();
        if let Some(first) = memory.value.first_mut().filter(|_| over > 0.0) {
            *first -= over + 2.0 * f32::EPSILON;
        }
        memory
    }

    fn point(&self, of: &Fitted) -> OperatingPoint {
        if !self.at {
            return OperatingPoint::NONE;
        }
        let triangle = Self::triangle(&self.cells);
        let [.., point0] = self.origin;
        OperatingPoint {
            weight: of.of.coefficients.get(2).copied().unwrap_or(0.0),
            mean: point0 + triangle.share(0, 2),
            per_x: triangle.share(1, 2),
            ss: triangle.own(2),
            min: self.point_range.0,
            max: self.point_range.1,
        }
    }

    /// As [`Commissioning::save`].
    ///
    /// # Errors
    /// [`StateError::BufferTooSmall`].
    pub fn save<N: Number, const C: usize>(
        &self,
        config: &Config<N, C>,
        into: &mut [u8],
    ) -> Result<usize, StateError> {
        Writer::envelope(into, Self::owner(config), |to| {
            to.u8(self.place);
            to.u8(u8::from(self.at));
            to.u32(self.next_hop);
            Remembering::write(&self.last, to);
            triangle::write(&self.words(), to);
            triangle::write(self.cells.as_ref(), to);
        })
    }

    fn words(&self) -> [f32; 8] {
        let [x, value, point] = self.origin;
        let (x_range, point_range) = (self.x_range, self.point_range);
        [x, value, point, x_range.0, x_range.1, point_range.0, point_range.1, self.residual_ss]
    }

    /// As [`Commissioning::restore`].
    ///
    /// # Errors
    /// As [`Commissioning::restore`].
    pub fn restore<N: Number, const C: usize>(
        &mut self,
        config: &Config<N, C>,
        from: &[u8],
    ) -> Result<(), StateError> {
        let mut payload = Reader::open(from, Self::owner(config))?;
        let restored = Self::read(&mut payload).filter(|_| payload.is_empty());
        *self = restored.ok_or(StateError::Impossible)?;
        Ok(())
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let mut read = Self::of_channel(from.u8()?);
        read.at = match from.u8()? {
            0 => false,
            1 if K::POINT => true,
            _ => return None,
        };
        read.next_hop = from.u32()?;
        read.last = Remembering::read(from)?;
        let mut words = [0.0; 8];
        triangle::read(&mut words, from)?;
        triangle::read(read.cells.as_mut(), from)?;
        let [x, value, point, x_min, x_max, point_min, point_max, residual_ss] = words;
        read.origin = [x, value, point];
        (read.x_range, read.point_range) = ((x_min, x_max), (point_min, point_max));
        read.residual_ss = residual_ss;
        let ordered = read.windows() == 0 || x_min <= x_max && (!read.at || point_min <= point_max);
        let possible = triangle::possible(read.cells.as_ref(), columns(K::ORDER, K::POINT));
        (possible && ordered && words.iter().all(|w| w.is_finite()) && residual_ss >= 0.0).then_some(read)
    }

    fn owner<N: Number, const C: usize>(config: &Config<N, C>) -> Owner {
        let capacity = (columns(K::ORDER, K::POINT)) as u16;
        Owner { set: COMMISSIONING_BACK_TAG, capacity, ..Commissioning::<C>::owner(config) }
    }
}

/// `f32::min` would call fminf, which a C firmware may not link.
#[inline]
fn widen(range: &mut (f32, f32), x: f32) {
    *range = (if x < range.0 { x } else { range.0 }, if x > range.1 { x } else { range.1 });
}

#[cfg(feature = "defmt")]
impl<K: LearntOrder> defmt::Format for MemoryCommissioning<K> {
    fn format(&self, to: defmt::Formatter<'_>) {
        defmt::write!(to, "{} windows with {} before them", self.windows(), K::ORDER);
    }
}
