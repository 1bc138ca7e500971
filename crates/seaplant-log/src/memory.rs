//! Logs of numbers in memory.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::assemble::{Assembly, Group};
use crate::column::Column;
use crate::content::Content;
use crate::heading::Heading;
use crate::log::Source;
use crate::{Epoch, Error, Log, ReadOptions, TimeColumn, Unit, epoch, time};

/// Columns that share their times.
#[derive(Debug, Clone, PartialEq)]
pub struct MemoryTable {
    /// Name in messages.
    pub name: String,
    /// Time of each row, s; `NaN` where it has none.
    pub time_s: Vec<f64>,
    /// The columns, each with one value a row.
    pub columns: Vec<MemoryColumn>,
}

/// One column of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct MemoryColumn {
    /// Header, which may state the unit: `depth [m]`.
    pub header: String,
    /// Unit, in place of the header's.
    pub unit: Option<String>,
    /// A value for each row; values that are not finite are missing.
    pub values: Vec<f64>,
}

impl Log {
    /// Makes a log of tables in memory, as [`read`](crate::read()) makes one of a file: rows are
    /// sorted by time, repeated times and missing values dropped, and [`Log::notes`] reports it.
    ///
    /// `name` identifies the log in messages and provenance; the hash is that of the numbers, in
    /// order, as eight bytes each, little-endian.
    ///
    /// # Errors
    /// [`Error::Rows`] of a column that has not one value a row, [`Error::UnknownUnit`],
    /// [`Error::NoSamples`] without a finite number.
    ///
    /// ```
    /// use seaplant_log::{Log, MemoryColumn, MemoryTable};
    /// let depth = MemoryColumn { header: "depth [m]".into(), unit: None, values: vec![5.0, 5.5] };
    /// let table = MemoryTable { name: "dive".into(), time_s: vec![0.0, 1.0], columns: vec![depth] };
    /// let log = Log::of_tables("dive", vec![table])?;
    /// assert_eq!(log.channel("depth")?.values(), [5.0, 5.5]);
    /// # Ok::<(), seaplant_log::Error>(())
    /// ```
    pub fn of_tables(name: &str, tables: Vec<MemoryTable>) -> Result<Self, Error> {
        let path = Path::new(name);
        let (origin, _) = Content::of_bytes(path, Vec::new())?.stream();
        let mut assembly = Assembly::new(origin, &ReadOptions::default());
        let mut numbers = Numbers::default();
        for MemoryTable { name, time_s, columns } in tables {
            numbers.add(&time_s);
            let rows = time_s.len();
            let take = |column| column_of(path, rows, column, &mut numbers);
            let columns = columns.into_iter().map(take).collect::<Result<_, _>>()?;
            assembly.group(Group { name, time_s, columns, of: None });
        }
        let mut log = assembly.log(FORMAT)?;
        let epoch = log.sources.first().map_or(Epoch::Unstated, |source| source.epoch);
        log.sources = vec![numbers.source(path.to_owned(), epoch)];
        Ok(log)
    }
}

/// Finds the time column, as [`read`](crate::read()) finds it in a file, and the seconds in its
/// unit, if one is stated. Each column is given by its header and a unit in place of the header's.
///
/// # Errors
/// [`Error::NoTime`]; of what was wanted: [`Error::NoChannel`], [`Error::Ambiguous`],
/// [`Error::TimeUnit`].
///
/// ```
/// use seaplant_log::{TimeColumn, time_column};
/// let headers = ["u [m/s]", "Time [ms]"].map(|header| (header.to_owned(), None));
/// let wanted = TimeColumn { column: None, unit: None };
/// assert_eq!(time_column(&headers, &wanted)?, (1, Some(1e-3)));
/// # Ok::<(), seaplant_log::Error>(())
/// ```
pub fn time_column(
    headers: &[(String, Option<String>)],
    wanted: &TimeColumn,
) -> Result<(usize, Option<f64>), Error> {
    let heading = |(header, unit): &(String, Option<String>)| {
        let mut heading = Heading::parse(header);
        heading.unit = unit.as_deref().and_then(Unit::find).or(heading.unit);
        heading
    };
    let headings: Vec<Heading> = headers.iter().map(heading).collect();
    let chosen = time::choose(Some(wanted), &headings, Path::new("the table"))?;
    Ok((chosen.index, chosen.seconds))
}

/// Returns the seconds in the unit of times that state none: the magnitude of counts since 1970
/// determines it; all others are in seconds.
///
/// ```
/// assert_eq!(seaplant_log::calendar_second(&[1.7e12, 1.7e12 + 100.0]), 1e-3);
/// assert_eq!(seaplant_log::calendar_second(&[0.0, 0.1]), 1.0);
/// ```
pub fn calendar_second(times: &[f64]) -> f64 {
    let known: Vec<f64> = times.iter().copied().filter(|time| time.is_finite()).collect();
    epoch::unit_since_1970(&known).map_or(1.0, |(second, _)| second)
}

/// Format of such a log in its source.
const FORMAT: &str = "numbers in memory";

fn column_of(
    path: &Path,
    rows: usize,
    column: MemoryColumn,
    numbers: &mut Numbers,
) -> Result<Column, Error> {
    let MemoryColumn { header, unit, values } = column;
    if values.len() != rows {
        let (path, found) = (path.to_owned(), values.len());
        return Err(Error::Rows { path, column: header, found, expected: rows });
    }
    numbers.add(&values);
    let heading = Heading::parse(&header);
    let unit = unit.as_deref().map(Unit::parse).transpose()?.or(heading.unit);
    let mut column = Column::new(header, unit, values);
    column.heading.name = heading.name;
    Ok(column)
}

/// All numbers, counted and hashed.
#[derive(Default)]
struct Numbers {
    hash: Sha256,
    bytes: u64,
}

impl Numbers {
    fn add(&mut self, values: &[f64]) {
        values.iter().for_each(|value| self.hash.update(value.to_le_bytes()));
        self.bytes += 8 * values.len() as u64;
    }

    fn source(self, path: PathBuf, epoch: Epoch) -> Source {
        let sha256 = self.hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        Source { path, bytes: self.bytes, sha256, format: FORMAT.to_owned(), epoch }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(time_s: &[f64], columns: &[(&str, Option<&str>, &[f64])]) -> MemoryTable {
        let column = |&(header, unit, values): &(&str, Option<&str>, &[f64])| MemoryColumn {
            header: header.to_owned(),
            unit: unit.map(str::to_owned),
            values: values.to_owned(),
        };
        let columns = columns.iter().map(column).collect();
        MemoryTable { name: "dvl".to_owned(), time_s: time_s.to_owned(), columns }
    }

    #[test]
    fn a_stated_unit_goes_before_that_of_the_header() {
        let columns =
            [("u [m/s]", None, &[1.0, 2.0][..]), ("rpm [rad/s]", Some("rpm"), &[3.0, 4.0])];
        let log = Log::of_tables("dive", vec![table(&[0.0, 1.0], &columns)]).expect("numbers");
        let symbol = |name: &str| {
            let channel = log.channel(name).expect("there");
            channel.unit.as_ref().expect("stated").symbol().to_owned()
        };
        assert_eq!((symbol("u"), symbol("rpm")), ("m/s".to_owned(), "rpm".to_owned()));
    }

    #[test]
    fn rows_are_sorted_and_missing_values_dropped_as_of_a_file() {
        let columns = [("depth", None, &[3.0, f64::NAN, 1.0][..])];
        let log = Log::of_tables("dive", vec![table(&[2.0, 3.0, 1.0], &columns)]).expect("numbers");
        let depth = log.channel("depth").expect("there");
        assert_eq!((depth.time_s(), depth.values()), (&[1.0, 2.0][..], &[1.0, 3.0][..]));
        assert_eq!(log.notes().len(), 1);
        // Python: hashlib.sha256(numpy.array([2, 3, 1, 3, nan, 1]).tobytes()).
        let expected = "ab9c057704486a9745995ec426c93e0077d4aee6464e9d38bfb25fd559535ece";
        assert_eq!((log.sources()[0].bytes, log.sources()[0].sha256.as_str()), (48, expected));
    }

    #[test]
    fn refuses_a_column_of_another_length_and_a_unit_that_there_is_not() {
        let refused = |columns: &[(&str, Option<&str>, &[f64])]| {
            Log::of_tables("dive", vec![table(&[0.0, 1.0], columns)])
                .expect_err("refused")
                .to_string()
        };
        assert_eq!(
            refused(&[("u", None, &[1.0])]),
            "column \"u\" of dive has 1 value for 2 times; give one for each"
        );
        let unit = refused(&[("u", Some("m/sec^9"), &[1.0, 2.0])]);
        assert!(unit.contains("m/sec^9"), "{unit}");
    }
}
