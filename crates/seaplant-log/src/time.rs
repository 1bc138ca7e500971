//! Which column is time, and in what order its rows are.

use std::path::Path;

use crate::Error;
use crate::grid::Lines;
use crate::heading::Heading;
use crate::lookup::{self, Candidate, fold};
use crate::note::Note;
use crate::read::TimeColumn;
use crate::unit::{Dimension, Unit, symbols_of};

/// Names that time goes by, the surest first.
const NAMES: &[&str] = &[
    "time",
    "t",
    "timestamp",
    "elapsed",
    "elapsed time",
    "elapsed_time",
    "datetime",
    "date_time",
    "date time",
    "date/time",
    "utc",
    "utc time",
    "utc_time",
    "unix_time",
    "unix time",
    "unixtime",
    "epoch",
    "stamp",
    "time stamp",
    "time_stamp",
    "timestamps",
    "seconds",
    "sec",
    "secs",
];

/// Names that state seconds by themselves.
const SECONDS: &[&str] = &["seconds", "sec", "secs"];

/// The time column, and the seconds in its unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chosen {
    pub(crate) index: usize,
    pub(crate) column: String,
    /// `None` where no unit is stated anywhere.
    pub(crate) seconds: Option<f64>,
    /// Others that could have been taken.
    pub(crate) others: Vec<String>,
}

/// The time column: the one `wanted`, else one with a name of time.
///
/// # Errors
/// [`Error::NoTime`], [`Error::TimeUnit`]; those of [`lookup::find`].
pub(crate) fn choose(
    wanted: Option<&TimeColumn>,
    headings: &[Heading],
    path: &Path,
) -> Result<Chosen, Error> {
    let Some(wanted) = wanted else { return recognise(headings, path) };
    let candidates: Vec<Candidate<'_>> = headings
        .iter()
        .map(|h| Candidate { column: &h.column, name: &h.name, path, empty: h.nameless })
        .collect();
    let index = lookup::find(&wanted.column, &candidates)?;
    let heading = &headings[index];
    let column = heading.column.clone();
    let stated = wanted.unit.as_deref().or(heading.unit.as_ref().map(Unit::symbol));
    let seconds = match stated {
        None => suffix_unit(&heading.name),
        Some(symbol) => match Unit::parse_as(symbol, Dimension::Time) {
            Ok(unit) => Some(unit.factor()),
            Err(_) => {
                let accepted = symbols_of(Dimension::Time).collect();
                let (path, unit) = (path.to_owned(), symbol.to_owned());
                return Err(Error::TimeUnit { path, column, unit, accepted });
            }
        },
    };
    Ok(Chosen { index, column, seconds, others: Vec::new() })
}

fn recognise(headings: &[Heading], path: &Path) -> Result<Chosen, Error> {
    let mut ranked: Vec<(usize, usize)> =
        headings.iter().enumerate().filter_map(|(k, h)| Some((rank(h)?, k))).collect();
    ranked.sort_unstable();
    let Some(&(_, index)) = ranked.first() else {
        let named = headings.iter().filter(|h| !h.nameless);
        let columns = named.map(|h| h.column.clone()).collect();
        return Err(Error::NoTime { path: path.to_owned(), columns });
    };
    let heading = &headings[index];
    let stated = heading.unit.as_ref().and_then(|unit| unit.resolve(Dimension::Time).ok());
    Ok(Chosen {
        index,
        column: heading.column.clone(),
        seconds: stated.map(|unit| unit.factor()).or_else(|| suffix_unit(&heading.name)),
        others: ranked[1..].iter().map(|&(_, k)| headings[k].column.clone()).collect(),
    })
}

/// How likely a heading is to be that of time: a place in [`NAMES`], `None` for one that is not.
fn rank(heading: &Heading) -> Option<usize> {
    if heading.unit.as_ref().is_some_and(|unit| unit.resolve(Dimension::Time).is_err()) {
        return None;
    }
    let name = fold(&heading.name);
    let place = |name: &str| NAMES.iter().position(|known| *known == name);
    place(&name).or_else(|| {
        let (base, suffix) = name.rsplit_once('_')?;
        Unit::parse_as(suffix, Dimension::Time).ok()?;
        place(base)
    })
}

/// The unit in a time column's name: `t_ms`, `seconds`. Of no other column is that guessed.
fn suffix_unit(name: &str) -> Option<f64> {
    let name = fold(name);
    if SECONDS.contains(&name.as_str()) {
        return Some(1.0);
    }
    let (_, suffix) = name.rsplit_once('_')?;
    Unit::parse_as(suffix, Dimension::Time).ok().map(|unit| unit.factor())
}

/// Looks for times that go back. Late rows are noted; a clock that was reset is refused.
///
/// `times` holds the rows that have a time, in the order of the file.
///
/// A row is late if an earlier one has a later time. A run of late rows is a reset if it is longer
/// than a tenth of the log, or lasts to the end; a single late row never is.
///
/// # Errors
/// [`Error::TimeGoesBackwards`].
pub(crate) fn check_order(
    times: &[(usize, f64)],
    lines: &Lines,
    path: &Path,
) -> Result<Option<Note>, Error> {
    let mut latest = f64::NEG_INFINITY;
    let (mut count, mut first_line, mut furthest) = (0, 0, 0.0_f64);
    let mut run: Option<(usize, f64, f64)> = None;
    let mut length = 0;
    for (k, &(row, time)) in times.iter().enumerate() {
        if time >= latest {
            latest = time;
            run = None;
            length = 0;
            continue;
        }
        count += 1;
        length += 1;
        furthest = furthest.max(latest - time);
        let line = lines.of(row);
        if count == 1 {
            first_line = line;
        }
        let (start, from_s, to_s) = *run.get_or_insert((row, latest, time));
        let at_end = k + 1 == times.len();
        if length > 1 && (10 * length > times.len() || at_end) {
            let line = lines.of(start);
            return Err(Error::TimeGoesBackwards { path: path.to_owned(), line, from_s, to_s });
        }
    }
    Ok((count > 0).then(|| Note::OutOfOrder {
        path: path.to_owned(),
        count,
        first_line,
        backwards_by_s: furthest,
    }))
}
