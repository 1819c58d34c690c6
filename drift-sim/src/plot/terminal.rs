//! A row of text as a small chart: one sign a column, its height the value. For summaries on a terminal.

use std::ffi::OsString;

/// What heights are drawn with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signs {
    /// Unicode's lower blocks, an eighth to a whole.
    Blocks,
    /// Signs that every terminal has, from low to high.
    Ascii,
}

impl Signs {
    /// Blocks where the locale (`LC_ALL`, else `LC_CTYPE`, else `LANG`) says UTF-8.
    pub fn of_locale() -> Self {
        Self::of(["LC_ALL", "LC_CTYPE", "LANG"].map(std::env::var_os))
    }

    fn of(locale: [Option<OsString>; 3]) -> Self {
        let said = locale.into_iter().flatten().find(|value| !value.is_empty());
        let said = said.map(|value| value.to_string_lossy().to_lowercase().replace('-', ""));
        if said.is_some_and(|said| said.contains("utf8")) { Self::Blocks } else { Self::Ascii }
    }

    /// From the lowest to the highest.
    fn levels(self) -> [char; 8] {
        match self {
            Self::Blocks => ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'],
            Self::Ascii => ['_', '.', ':', '-', '=', '+', '*', '#'],
        }
    }
}

/// One sign for each value, between `low` (the lowest sign) and `high` (the highest); what is beyond stays at
/// the edge,
/// what is not a number is a blank. A range without extent shows the lowest sign.
pub fn row(values: &[f64], (low, high): (f64, f64), signs: Signs) -> String {
    let levels = signs.levels();
    let sign = |value: &f64| {
        if !value.is_finite() {
            return ' ';
        }
        let part = (value - low) / (high - low);
        let level = if part.is_finite() { (part * levels.len() as f64).max(0.0) as usize } else { 0 };
        levels.get(level.min(levels.len() - 1)).copied().unwrap_or(' ')
    };
    values.iter().map(sign).collect()
}

/// Equal stretches of a signal, each as one number by `of`; NaN for a stretch without any known value. At most
/// `columns`.
pub fn stretches(values: &[f64], columns: usize, of: fn(&[f64]) -> f64) -> Vec<f64> {
    let columns = columns.min(values.len());
    (0..columns)
        .map(|column| {
            let edge = |column: usize| column * values.len() / columns;
            let stretch = values.get(edge(column)..edge(column + 1)).unwrap_or(&[]);
            let known: Vec<f64> = stretch.iter().copied().filter(|value| value.is_finite()).collect();
            if known.is_empty() { f64::NAN } else { of(&known) }
        })
        .collect()
}

/// Mean of known values.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Root mean square of known values.
pub fn rms(values: &[f64]) -> f64 {
    libm::sqrt(values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64)
}

/// The value farthest from zero.
pub fn farthest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, |far: f64, value| if value.abs() > far.abs() { value } else { far })
}

/// The least and the greatest of the known values; NaN where there is none.
pub fn range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::NAN, f64::NAN), |(low, high), value| (low.min(*value), high.max(*value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_follow_the_values_and_gaps_stay_blank() {
        let values = [0.0, 1.0, f64::NAN, 8.0, 99.0, -1.0];
        assert_eq!(row(&values, (0.0, 8.0), Signs::Blocks), "▁▂ ██▁");
        assert_eq!(row(&values, (0.0, 8.0), Signs::Ascii), "_. ##_");
        assert_eq!(row(&[3.0, 3.0], (3.0, 3.0), Signs::Ascii), "__");
    }

    #[test]
    fn stretches_cover_the_signal_once() {
        let values: Vec<f64> = (0..10).map(f64::from).collect();
        assert_eq!(stretches(&values, 5, mean), [0.5, 2.5, 4.5, 6.5, 8.5]);
        assert_eq!(stretches(&values, 99, mean), values);
        assert_eq!(stretches(&[1.0, f64::NAN, -3.0, 2.0], 2, farthest), [1.0, -3.0]);
        assert!(stretches(&[f64::NAN, 1.0], 2, rms)[0].is_nan());
        assert!(stretches(&[], 5, mean).is_empty());
    }

    #[test]
    fn the_first_locale_that_is_set_decides() {
        let locale =
            |all: &str, ctype: &str, lang: &str| Signs::of([all, ctype, lang].map(|v| Some(v.into())));
        assert_eq!(locale("", "", "de_DE.UTF-8"), Signs::Blocks);
        assert_eq!(locale("", "C.utf8", "C"), Signs::Blocks);
        assert_eq!(locale("C", "", "de_DE.UTF-8"), Signs::Ascii);
        assert_eq!(Signs::of([None, None, None]), Signs::Ascii);
    }
}
