//! Objects of MATLAB's own (tables, durations, dates, strings) in its files, whatever the version: where their properties are.
//!
//! A variable that is an object holds a reference only, `[0xDD000000, dimensions .., object, class]`. What it refers to stands in
//! one array of cells for the whole file, the class `FileWrapper__`: its first cell is a table of names, classes, objects and
//! properties as whole numbers of four bytes, the third and those behind it are the properties' values. MathWorks has not
//! published this; it is what independent readers have found (matio by foreverallama, "MCOS").

use super::budget::Budget;
use super::table::Cells;
use crate::Result;

/// How a reference begins.
const REFERENCE: u64 = 0xDD00_0000;
/// A reference to one object: the mark, two dimensions of one, the object, its class.
const ONE_OBJECT: usize = 6;
/// Cells of the wrapper before the first value.
const BEFORE_VALUES: usize = 2;
/// The wrapper's versions whose layout is known.
const VERSIONS: std::ops::RangeInclusive<u64> = 2..=4;
/// Words of the wrapper's table before its eight offsets, and before its text.
const BEFORE_OFFSETS: usize = 2;
const BEFORE_NAMES: usize = 10;

/// The arrays of a file, as far as objects need them.
pub(super) trait Arrays {
    /// Where an array is.
    type Array: Clone;
    fn budget(&self) -> &Budget;
    /// What an array is.
    ///
    /// # Errors
    /// It is damaged, or takes more memory than there is; as all others here.
    fn kind(&mut self, array: &Self::Array) -> Result<Kind<Self::Array>>;
    /// A column of an array of numbers, of complex ones the real part.
    fn column(&mut self, array: &Self::Array, column: usize) -> Result<Cells>;
    /// All of an array of whole numbers, to the last bit; empty where others are stored.
    fn whole_numbers(&mut self, array: &Self::Array) -> Result<Vec<u64>>;
}

/// What an array is.
pub(super) enum Kind<Array> {
    Numbers {
        rows: usize,
        across: usize,
        is_complex: bool,
    },
    Text(String),
    Cells(Vec<Array>),
    /// One struct.
    Fields(Vec<(String, Array)>),
    /// Empty, or of no use here.
    Other,
}

/// All objects of a file.
pub(super) struct Objects<Array> {
    names: Vec<String>,
    classes: Vec<u64>,
    /// Properties of objects that choose what is saved of them, and of all others.
    saved: Vec<u64>,
    objects: Vec<u64>,
    plain: Vec<u64>,
    values: Vec<Array>,
}

/// An object: its class and its properties' values.
pub(super) struct Object<Array> {
    pub class: String,
    properties: Vec<(String, Array)>,
}

impl<Array: Clone> Object<Array> {
    pub fn property(&self, name: &str) -> Option<&Array> {
        self.properties.iter().find(|(own, _)| own == name).map(|(_, value)| value)
    }
}

impl<Array: Clone> Objects<Array> {
    /// Those of the wrapper, or `None` where it is laid out otherwise.
    ///
    /// # Errors
    /// It is damaged, or takes more memory than there is.
    pub fn of(arrays: &mut impl Arrays<Array = Array>, wrapper: &Array) -> Result<Option<Self>> {
        let Kind::Cells(cells) = arrays.kind(wrapper)? else { return Ok(None) };
        let Some(table) = cells.first() else { return Ok(None) };
        let bytes = arrays.whole_numbers(table)?;
        let values = cells.get(BEFORE_VALUES..).unwrap_or_default().to_vec();
        Ok(Self::parse(&bytes, values))
    }

    /// The wrapper's table, one byte a number.
    fn parse(table: &[u64], values: Vec<Array>) -> Option<Self> {
        // In the byte order of the file; every machine that MATLAB runs on today writes the lowest byte first.
        let word = |at: usize| {
            let bytes = table.get(at..at.checked_add(4)?)?;
            bytes
                .iter()
                .rev()
                .try_fold(0, |word, byte| Some((word << 8) | u64::from(u8::try_from(*byte).ok()?)))
        };
        word(0).filter(|version| VERSIONS.contains(version))?;
        let offset = |part: usize| usize::try_from(word((BEFORE_OFFSETS + part) * 4)?).ok();
        let part = |index: usize| {
            (offset(index)?..offset(index + 1)?).step_by(4).map(word).collect::<Option<Vec<u64>>>()
        };
        let text: Vec<u8> = table
            .get(BEFORE_NAMES * 4..offset(0)?)?
            .iter()
            .map(|byte| u8::try_from(*byte).ok())
            .collect::<Option<_>>()?;
        let names = text
            .split(|byte| *byte == 0)
            .filter(|name| !name.is_empty())
            .map(|name| String::from_utf8_lossy(name).into_owned())
            .collect();
        Some(Self { names, classes: part(0)?, saved: part(1)?, objects: part(2)?, plain: part(3)?, values })
    }

    fn name(&self, number: u64) -> Option<&String> {
        // Names count from 1 on.
        self.names.get(usize::try_from(number).ok()?.checked_sub(1)?)
    }

    /// The object that a reference means; `None` for what is no reference to one object.
    pub fn referred(&self, reference: &[u64]) -> Option<Object<Array>> {
        let &[REFERENCE, 2, 1, 1, object, class] = reference else { return None };
        let class = usize::try_from(class).ok()?;
        let &[package, name, ..] = self.classes.get(class.checked_mul(4)?..)? else { return None };
        let class = match package {
            0 => self.name(name)?.clone(),
            package => format!("{}.{}", self.name(package)?, self.name(name)?),
        };
        let object = usize::try_from(object).ok().filter(|object| *object > 0)?;
        let &[_, _, _, saved, plain, ..] = self.objects.get(object.checked_mul(6)?..)? else { return None };
        let listed = if saved > 0 { list(&self.saved, saved)? } else { list(&self.plain, plain)? };
        let properties = listed.chunks_exact(3).filter_map(|property| {
            // The second number says what the third is: 1 is the place of a value.
            let &[name, 1, place] = property else { return None };
            Some((self.name(name)?.clone(), self.values.get(usize::try_from(place).ok()?)?.clone()))
        });
        Some(Object { class, properties: properties.collect() })
    }

    /// The object that an array refers to; `None` for an array of any other content.
    ///
    /// # Errors
    /// It is damaged, or takes more memory than there is.
    pub fn object(
        &self,
        arrays: &mut impl Arrays<Array = Array>,
        array: &Array,
    ) -> Result<Option<Object<Array>>> {
        match arrays.kind(array)? {
            Kind::Numbers { rows, across, is_complex: false }
                if rows.saturating_mul(across) == ONE_OBJECT =>
            {
                Ok(self.referred(&arrays.whole_numbers(array)?))
            }
            _ => Ok(None),
        }
    }
}

/// The list of properties with this number: each list is a count, so many groups of three, and zeros to an even length.
fn list(part: &[u64], number: u64) -> Option<&[u64]> {
    let mut rest = part;
    for at in 0.. {
        let count = usize::try_from(*rest.first()?).ok()?.checked_mul(3)?;
        if at == number {
            return rest.get(1..count.checked_add(1)?);
        }
        rest = rest.get(count.checked_add(1)?.next_multiple_of(2)..)?;
    }
    None
}
