//! Converts Arrow columns, the form of Parquet and Arrow files, to a table.

use std::path::Path;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    ArrowPrimitiveType, Date32Type, Date64Type, Decimal32Type, Decimal64Type, Decimal128Type,
    Decimal256Type, DurationMicrosecondType, DurationMillisecondType, DurationNanosecondType,
    DurationSecondType, Float16Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type,
    Int64Type, Time32MillisecondType, Time32SecondType, Time64MicrosecondType,
    Time64NanosecondType, TimestampMicrosecondType, TimestampMillisecondType,
    TimestampNanosecondType, TimestampSecondType, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, RecordBatch, StructArray};
use arrow_buffer::NullBuffer;
use arrow_schema::{ArrowError, DataType, Field, Fields, TimeUnit};

use crate::cell::Decimal;
use crate::column::Column;
use crate::content::Origin;
use crate::error::TooMuch;
use crate::grid::{ChooseTime, Grid, Lines, tell_headings_apart};
use crate::guard::guarded;
use crate::heading::Heading;
use crate::note::Note;
use crate::time::time_cell;
use crate::unpack::limit;
use crate::{Error, Unit};

/// A table under construction.
pub(crate) struct Columnar<'a> {
    path: &'a Path,
    leaves: Vec<Leaf>,
    columns: Vec<Column>,
    left_out: Vec<(String, &'static str)>,
    notes: Vec<Note>,
    time: Option<usize>,
    /// True if the time column holds seconds, whatever its header states.
    stamped: Option<bool>,
    rows: usize,
    /// Size of the file, and the bytes of numbers that it may still unpack to.
    size: u64,
    left: u64,
}

/// A column of single values, given by its path of field indices in the schema.
struct Leaf {
    route: Vec<usize>,
}

impl<'a> Columnar<'a> {
    /// Prepares for the first batch of rows. `size` is that of the file.
    ///
    /// # Errors
    /// Those of `choose_time`.
    pub(crate) fn new(
        fields: &Fields,
        path: &'a Path,
        size: u64,
        choose_time: ChooseTime<'_>,
    ) -> Result<Self, Error> {
        let mut flat = Flat::default();
        flat.add(fields, "", &mut Vec::new());
        let Flat { leaves, mut headings, left_out, temporal } = flat;
        let mut notes = Vec::new();
        tell_headings_apart(&mut headings, path, &mut notes);
        let time = choose_time(&headings)?;
        let stamped = time.filter(|&time| temporal[time]).map(|_| true);
        let columns = headings.into_iter().map(Column::empty).collect();
        let (rows, left) = (0, limit(size));
        Ok(Self { path, leaves, columns, left_out, notes, time, stamped, rows, size, left })
    }

    /// Returns the fields of the schema that hold a column; no others need to be read.
    pub(crate) fn fields(&self) -> Vec<usize> {
        let mut fields: Vec<usize> = self.leaves.iter().map(|leaf| leaf.route[0]).collect();
        fields.dedup();
        fields
    }

    /// Reads all rows. `fields` are the schema indices of the batches' columns; messages call the
    /// file `format`. Damage ends the rows, with a note if there are any before it.
    ///
    /// # Errors
    /// [`Error::TooMuch`], [`Error::Damaged`].
    pub(crate) fn take_all(
        &mut self,
        mut batches: impl Iterator<Item = Result<RecordBatch, ArrowError>>,
        fields: &[usize],
        format: &'static str,
    ) -> Result<(), Error> {
        loop {
            match guarded(self.path, format, || batches.next().transpose()) {
                Ok(Some(batch)) => self.take(&batch, fields)?,
                Ok(None) => return Ok(()),
                Err(Error::Damaged { path, found: reason, .. }) if self.rows > 0 => {
                    let first_row = self.rows as u64 + 1;
                    self.notes.push(Note::UnreadableRows { path, first_row, reason });
                    return Ok(());
                }
                Err(error) => return Err(error),
            }
        }
    }

    fn take(&mut self, batch: &RecordBatch, fields: &[usize]) -> Result<(), Error> {
        let bytes = (batch.num_rows() * self.leaves.len() * size_of::<f64>()) as u64;
        self.left = self.left.checked_sub(bytes).ok_or_else(|| {
            let (packed, unpacked) = (self.size, limit(self.size));
            Error::io(self.path, std::io::Error::other(TooMuch { unpacked, packed }))
        })?;
        for k in 0..self.leaves.len() {
            let route = &self.leaves[k].route;
            let Some(field) = fields.iter().position(|field| *field == route[0]) else { continue };
            let (array, nulls) = follow(batch.column(field), &route[1..]);
            self.extend(k, &array, nulls.as_ref());
        }
        self.rows += batch.num_rows();
        Ok(())
    }

    fn extend(&mut self, k: usize, array: &ArrayRef, nulls: Option<&NullBuffer>) {
        let missing = |row: usize| nulls.is_some_and(|nulls| nulls.is_null(row));
        let (first, column) = (self.rows, &mut self.columns[k]);
        if let Some(value) = numbers(array) {
            for row in 0..array.len() {
                match value(row) {
                    number if number.is_finite() && !missing(row) => {
                        column.samples.push(first + row, number);
                    }
                    _ => column.samples.skip(first + row),
                }
            }
        } else if let Some(text) = texts(array) {
            for row in 0..array.len() {
                let cell = if missing(row) { &b""[..] } else { text(row).as_bytes() };
                let mut found = Decimal::point().read(cell);
                if self.time == Some(k) {
                    found = time_cell(&mut self.stamped, found, cell);
                }
                column.push(first + row, (first + row) as u64 + 1, found, cell);
            }
        } else {
            (0..array.len()).for_each(|row| column.samples.skip(first + row));
        }
    }

    /// Returns the table, once all rows are read. `format` names the file format.
    pub(crate) fn into_grid(self, origin: Origin, format: &str) -> Grid {
        Grid {
            origin,
            format: format.to_owned(),
            columns: self.columns,
            rows: self.rows,
            lines: Lines::of_rows(),
            header_line: 0,
            stamped: self.stamped.unwrap_or(false),
            epoch: None,
            notes: self.notes,
            left_out: self.left_out,
        }
    }
}

/// A schema with its structs flattened.
#[derive(Default)]
struct Flat {
    leaves: Vec<Leaf>,
    headings: Vec<Heading>,
    /// True for each leaf whose type is a time.
    temporal: Vec<bool>,
    left_out: Vec<(String, &'static str)>,
}

impl Flat {
    fn add(&mut self, fields: &Fields, within: &str, route: &mut Vec<usize>) {
        /// Depth limit: no log nests its columns so deeply.
        const DEEP: usize = 32;
        for (place, field) in fields.iter().enumerate() {
            let name = format!("{within}{}", field.name());
            route.push(place);
            match (field.data_type(), unreadable(field.data_type())) {
                (DataType::Struct(inner), _) if route.len() < DEEP => {
                    self.add(inner, &format!("{name}."), route);
                }
                (_, Some(why)) => self.left_out.push((name, why)),
                (kind, None) => {
                    self.leaves.push(Leaf { route: route.clone() });
                    self.headings.push(heading(&name, field));
                    self.temporal.push(kind.is_temporal());
                }
            }
            route.pop();
        }
    }
}

/// Returns a column's header, with the unit from its name or its field's metadata.
fn heading(name: &str, field: &Field) -> Heading {
    let mut heading = Heading::parse(name);
    let is_unit = |key: &str| matches!(key.to_lowercase().as_str(), "unit" | "units");
    let stated = field.metadata().iter().find(|(key, _)| is_unit(key));
    let seconds = || field.data_type().is_temporal().then(|| Unit::find("s")).flatten();
    let unit = heading.unit.take().or_else(|| Unit::find(stated?.1)).or_else(seconds);
    let instant = matches!(field.data_type(), DataType::Timestamp(..));
    Heading { unit, instant, ..heading }
}

/// Returns why a type holds no series of numbers or texts, in words that follow its name; `None` if
/// it holds one.
fn unreadable(kind: &DataType) -> Option<&'static str> {
    match kind {
        DataType::Dictionary(_, values) => unreadable(values),
        DataType::Struct(_) => Some("is nested too deep"),
        DataType::List(_)
        | DataType::LargeList(_)
        | DataType::ListView(_)
        | DataType::LargeListView(_)
        | DataType::FixedSizeList(..) => Some("is a list"),
        DataType::Map(..) => Some("is a map"),
        DataType::Binary
        | DataType::LargeBinary
        | DataType::BinaryView
        | DataType::FixedSizeBinary(_) => Some("holds raw bytes"),
        DataType::Null => Some("has no value in any row"),
        DataType::Union(..) | DataType::RunEndEncoded(..) | DataType::Interval(_) => {
            Some("has a type that is not supported")
        }
        _ => None,
    }
}

/// Returns the array at the end of a route, and the rows where it or a struct around it has no
/// value.
fn follow(array: &ArrayRef, route: &[usize]) -> (ArrayRef, Option<NullBuffer>) {
    let mut array = Arc::clone(array);
    let mut nulls = array.logical_nulls();
    for &place in route {
        let parent: &StructArray = array.as_struct();
        array = Arc::clone(parent.column(place));
        nulls = NullBuffer::union(nulls.as_ref(), array.logical_nulls().as_ref());
    }
    (array, nulls)
}

/// Returns the number of a row, whether or not the row is null.
type Number<'a> = Box<dyn Fn(usize) -> f64 + 'a>;

/// Returns a function that reads the numbers of an array, times in seconds; `None` for an array of
/// other types.
fn numbers(array: &ArrayRef) -> Option<Number<'_>> {
    use DataType as D;
    Some(match array.data_type() {
        D::Boolean => {
            let flags = array.as_boolean();
            Box::new(|row| f64::from(u8::from(flags.value(row))))
        }
        D::Int8 => number::<Int8Type>(array, f64::from),
        D::Int16 => number::<Int16Type>(array, f64::from),
        D::Int32 => number::<Int32Type>(array, f64::from),
        D::Int64 => number::<Int64Type>(array, |n| n as f64),
        D::UInt8 => number::<UInt8Type>(array, f64::from),
        D::UInt16 => number::<UInt16Type>(array, f64::from),
        D::UInt32 => number::<UInt32Type>(array, f64::from),
        D::UInt64 => number::<UInt64Type>(array, |n| n as f64),
        D::Float16 => number::<Float16Type>(array, |n| n.to_f64()),
        D::Float32 => number::<Float32Type>(array, f64::from),
        D::Float64 => number::<Float64Type>(array, |n| n),
        D::Decimal32(_, scale) => decimal::<Decimal32Type>(array, f64::from, *scale),
        D::Decimal64(_, scale) => decimal::<Decimal64Type>(array, |n| n as f64, *scale),
        D::Decimal128(_, scale) => decimal::<Decimal128Type>(array, |n| n as f64, *scale),
        D::Decimal256(_, scale) => {
            let parse = |n: arrow_buffer::i256| n.to_string().parse().unwrap_or(f64::NAN);
            decimal::<Decimal256Type>(array, parse, *scale)
        }
        D::Date32 => number::<Date32Type>(array, |days| f64::from(days) * 86_400.0),
        D::Date64 => number::<Date64Type>(array, parts::<1_000>),
        kind => return seconds(kind, array),
    })
}

fn seconds<'a>(kind: &DataType, array: &'a ArrayRef) -> Option<Number<'a>> {
    use DataType as D;
    use TimeUnit::{Microsecond, Millisecond, Nanosecond, Second};
    Some(match kind {
        D::Timestamp(Second, _) => number::<TimestampSecondType>(array, |n| n as f64),
        D::Timestamp(Millisecond, _) => number::<TimestampMillisecondType>(array, parts::<1_000>),
        D::Timestamp(Microsecond, _) => {
            number::<TimestampMicrosecondType>(array, parts::<1_000_000>)
        }
        D::Timestamp(Nanosecond, _) => {
            number::<TimestampNanosecondType>(array, parts::<1_000_000_000>)
        }
        D::Time32(Second) => number::<Time32SecondType>(array, f64::from),
        D::Time32(_) => number::<Time32MillisecondType>(array, |n| parts::<1_000>(n.into())),
        D::Time64(Microsecond) => number::<Time64MicrosecondType>(array, parts::<1_000_000>),
        D::Time64(_) => number::<Time64NanosecondType>(array, parts::<1_000_000_000>),
        D::Duration(Second) => number::<DurationSecondType>(array, |n| n as f64),
        D::Duration(Millisecond) => number::<DurationMillisecondType>(array, parts::<1_000>),
        D::Duration(Microsecond) => number::<DurationMicrosecondType>(array, parts::<1_000_000>),
        D::Duration(Nanosecond) => number::<DurationNanosecondType>(array, parts::<1_000_000_000>),
        D::Dictionary(..) => {
            let dictionary = array.as_any_dictionary();
            let value = numbers(dictionary.values())?;
            let key = keys(array);
            Box::new(move |row| key(row).map_or(f64::NAN, &value))
        }
        _ => return None,
    })
}

fn number<T: ArrowPrimitiveType>(array: &ArrayRef, as_f64: fn(T::Native) -> f64) -> Number<'_> {
    let array = array.as_primitive::<T>();
    Box::new(move |row| as_f64(array.value(row)))
}

fn decimal<T: ArrowPrimitiveType>(
    array: &ArrayRef,
    as_f64: fn(T::Native) -> f64,
    scale: i8,
) -> Number<'_> {
    let array = array.as_primitive::<T>();
    // Powers of ten up to the 22nd are exact, so that the quotient is the nearest number.
    let ten = 10_f64.powi(i32::from(scale.unsigned_abs()));
    Box::new(move |row| {
        let digits = as_f64(array.value(row));
        if scale < 0 { digits * ten } else { digits / ten }
    })
}

/// Converts a count of parts of a second to seconds; the integer seconds are separate because a
/// double holds them exactly.
fn parts<const IN_A_SECOND: i64>(n: i64) -> f64 {
    let (whole, rest) = (n.div_euclid(IN_A_SECOND), n.rem_euclid(IN_A_SECOND));
    whole as f64 + rest as f64 / IN_A_SECOND as f64
}

/// Returns a function that gives the dictionary index of a row; `None` where there is none.
fn keys(array: &ArrayRef) -> impl Fn(usize) -> Option<usize> + '_ {
    let dictionary = array.as_any_dictionary();
    let values = dictionary.values().len();
    // An empty dictionary has no index for a key.
    let keys = if values == 0 { Vec::new() } else { dictionary.normalized_keys() };
    move |row| keys.get(row).copied().filter(|key| *key < values)
}

/// Returns a function that reads the texts of an array; `None` for an array of other types.
fn texts<'a>(array: &'a ArrayRef) -> Option<Box<dyn Fn(usize) -> &'a str + 'a>> {
    Some(match array.data_type() {
        DataType::Utf8 => {
            let texts = array.as_string::<i32>();
            Box::new(|row| texts.value(row))
        }
        DataType::LargeUtf8 => {
            let texts = array.as_string::<i64>();
            Box::new(|row| texts.value(row))
        }
        DataType::Utf8View => {
            let texts = array.as_string_view();
            Box::new(|row| texts.value(row))
        }
        DataType::Dictionary(..) => {
            let text = texts(array.as_any_dictionary().values())?;
            let key = keys(array);
            Box::new(move |row| key(row).map_or("", &text))
        }
        _ => return None,
    })
}
