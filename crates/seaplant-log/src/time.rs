//! Finds the time column of a table.

use std::collections::HashMap;
use std::path::Path;

use crate::Error;
use crate::cell::{Cell, stamp};
use crate::heading::Heading;
use crate::lookup::{self, Candidate};
use crate::spelling::fold;
use crate::symbol::symbols_of;
use crate::{Dimension, TimeColumn, Unit};

/// Names of time columns, the most certain first.
#[rustfmt::skip]
const NAMES: &[&str] = &[
    "time", "t", "timestamp", "elapsed", "elapsed time", "elapsed_time", "datetime", "date_time",
    "date time", "date/time", "utc", "utc time", "utc_time", "unix_time", "unix time", "unixtime",
    "epoch", "__time", "stamp", "time stamp", "time_stamp", "timestamps", "seconds", "sec", "secs",
];

/// Names that imply seconds.
const SECONDS: &[&str] = &["seconds", "sec", "secs"];

/// The time column, and the seconds in its unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chosen {
    pub(crate) index: usize,
    pub(crate) column: String,
    /// `None` if no unit is stated.
    pub(crate) seconds: Option<f64>,
    /// Other columns that could be time.
    pub(crate) others: Vec<String>,
    /// Unit in the header and the stated one that replaces it, if they differ.
    pub(crate) replaced: Option<[String; 2]>,
    /// Column of nanoseconds that belongs to one of integer seconds.
    pub(crate) nanoseconds: Option<usize>,
}

/// Returns the time column: the `wanted` one, else one with a time-like name.
///
/// # Errors
/// [`Error::NoTime`], [`Error::TimeUnit`]; those of [`lookup::find`].
pub(crate) fn choose(
    wanted: Option<&TimeColumn>,
    headings: &[Heading],
    path: &Path,
) -> Result<Chosen, Error> {
    let Some(wanted) = wanted else { return recognise(headings, path) };
    let mut chosen = match &wanted.column {
        None => recognise(headings, path)?,
        Some(column) => {
            let candidates: Vec<Candidate<'_>> = headings
                .iter()
                .map(|h| Candidate { column: &h.column, name: &h.name, path, empty: h.nameless })
                .collect();
            let index = lookup::find(column, &candidates)?;
            let (column, others) = (headings[index].column.clone(), Vec::new());
            let nanoseconds = nanoseconds_of(&headings[index], &folded(headings));
            Chosen { index, column, seconds: None, others, replaced: None, nanoseconds }
        }
    };
    if chosen.nanoseconds.is_some() {
        chosen.seconds = Some(1.0);
        return Ok(chosen);
    }
    let heading = &headings[chosen.index];
    let of_header = heading.unit.as_ref().map(Unit::symbol);
    chosen.seconds = match wanted.unit.as_deref().or(of_header) {
        None => suffix_unit(&heading.name),
        Some(symbol) => Some(stated_unit(symbol, &chosen.column, path)?),
    };
    if let (Some(stated), Some(of_header)) = (&wanted.unit, of_header)
        && heading.unit.as_ref().and_then(seconds) != chosen.seconds
    {
        chosen.replaced = Some([of_header.to_owned(), stated.clone()]);
    }
    Ok(chosen)
}

/// Returns the seconds in a time unit that a user wrote.
fn stated_unit(symbol: &str, column: &str, path: &Path) -> Result<f64, Error> {
    Unit::find_as(symbol, Dimension::Time).map(|unit| unit.factor()).ok_or_else(|| {
        let accepted = symbols_of(Dimension::Time).collect();
        let (path, unit, column) = (path.to_owned(), symbol.to_owned(), column.to_owned());
        Error::TimeUnit { path, column, unit, accepted }
    })
}

fn recognise(headings: &[Heading], path: &Path) -> Result<Chosen, Error> {
    let names = folded(headings);
    // Integer seconds with a column of nanoseconds rank after all names of time.
    let stamped = |heading| nanoseconds_of(heading, &names).map(|_| NAMES.len());
    let of_time = headings.iter().enumerate().filter(|(_, h)| !is_nanoseconds(h, &names));
    let mut ranked: Vec<(usize, usize)> =
        of_time.filter_map(|(k, h)| Some((rank(h).or_else(|| stamped(h))?, k))).collect();
    let instants = headings.iter().enumerate().filter(|(_, h)| h.instant);
    if let (true, [(only, _)]) = (ranked.is_empty(), &instants.collect::<Vec<_>>()[..]) {
        ranked.push((NAMES.len(), *only));
    }
    ranked.sort_unstable();
    let Some(&(_, index)) = ranked.first() else {
        let named = headings.iter().filter(|h| !h.nameless);
        let columns = named.map(|h| h.column.clone()).collect();
        return Err(Error::NoTime { path: path.to_owned(), columns });
    };
    let heading = &headings[index];
    let nanoseconds = nanoseconds_of(heading, &names);
    let stated = || heading.unit.as_ref().and_then(seconds).or_else(|| suffix_unit(&heading.name));
    Ok(Chosen {
        index,
        column: heading.column.clone(),
        seconds: nanoseconds.map_or_else(stated, |_| Some(1.0)),
        others: ranked[1..].iter().map(|&(_, k)| headings[k].column.clone()).collect(),
        replaced: None,
        nanoseconds,
    })
}

/// Spellings of integer seconds and of their nanoseconds, as ROS stamps are written.
const STAMPS: [[&str; 2]; 4] =
    [["secs", "nsecs"], ["sec", "nanosec"], ["sec", "nsec"], ["seconds", "nanoseconds"]];

/// Maps the folded names of columns to the first column of that name.
fn folded(headings: &[Heading]) -> HashMap<String, usize> {
    headings.iter().enumerate().rev().map(|(k, heading)| (fold(&heading.name), k)).collect()
}

/// Returns the column of nanoseconds that belongs to one of integer seconds: `stamp.nsecs` to
/// `stamp.secs`.
fn nanoseconds_of(heading: &Heading, names: &HashMap<String, usize>) -> Option<usize> {
    let name = fold(&heading.name);
    let beside = |[whole, rest]: [&str; 2]| {
        let stem =
            name.strip_suffix(whole).filter(|stem| !stem.ends_with(char::is_alphanumeric))?;
        names.get(&format!("{stem}{rest}")).copied()
    };
    STAMPS.into_iter().find_map(beside)
}

/// Adds the nanoseconds to integer seconds, if all of them are less than a second.
pub(crate) fn add_nanoseconds(time_s: &mut [f64], nanoseconds: &[f64]) {
    let is_part = |rest: &f64| rest.is_nan() || (0.0..1e9).contains(rest);
    if time_s.len() == nanoseconds.len() && nanoseconds.iter().all(is_part) {
        time_s.iter_mut().zip(nanoseconds).for_each(|(second, rest)| *second += 1e-9 * rest);
    }
}

/// Returns whether a column holds the nanoseconds of another column's integer seconds.
fn is_nanoseconds(heading: &Heading, names: &HashMap<String, usize>) -> bool {
    let name = fold(&heading.name);
    let after = |[whole, rest]: [&str; 2]| {
        let stem = name.strip_suffix(rest);
        stem.is_some_and(|stem| names.contains_key(&format!("{stem}{whole}")))
    };
    STAMPS.into_iter().any(after)
}

/// Returns the seconds in a unit, if it measures time.
fn seconds(unit: &Unit) -> Option<f64> {
    Unit::find_as(unit.symbol(), Dimension::Time).map(|unit| unit.factor())
}

/// Returns the rank of a heading as a time column: an index into [`NAMES`], `None` for other names.
fn rank(heading: &Heading) -> Option<usize> {
    if heading.unit.as_ref().is_some_and(|unit| seconds(unit).is_none()) {
        return None;
    }
    let name = fold(&heading.name);
    let place = |name: &str| NAMES.iter().position(|known| *known == name);
    place(&name).or_else(|| place(suffixed(&name)?.0))
}

/// Returns the unit in a time column's name: `t_ms`, `seconds`. Other columns' units are never
/// inferred so.
fn suffix_unit(name: &str) -> Option<f64> {
    let name = fold(name);
    if SECONDS.contains(&name.as_str()) {
        return Some(1.0);
    }
    suffixed(&name).map(|(_, unit)| unit.factor())
}

/// Splits `t_ms` or `timeus` into name and unit of time.
fn suffixed(name: &str) -> Option<(&str, Unit)> {
    /// Units recognised without a separator; `s` is not one, because "times" is a plural.
    const JOINED: &[&str] = &["us", "ms", "ns", "sec"];
    let joined = || {
        let (base, unit) =
            JOINED.iter().find_map(|unit| Some((name.strip_suffix(unit)?, *unit)))?;
        NAMES.contains(&base).then_some((base, unit))
    };
    let (base, unit) = name.rsplit_once(['_', ' ', '-']).or_else(joined)?;
    Some((base, Unit::find_as(unit, Dimension::Time)?))
}

/// Reads a cell of the time column, which holds either numbers or date-times; the first readable
/// cell decides.
pub(crate) fn time_cell(stamped: &mut Option<bool>, found: Cell, cell: &[u8]) -> Cell {
    match found {
        Cell::Number(_) | Cell::Ambiguous(_) if *stamped.get_or_insert(false) => Cell::Text,
        Cell::Text if *stamped != Some(false) => match stamp(cell) {
            Some(seconds) => {
                *stamped = Some(true);
                Cell::Number(seconds)
            }
            None => Cell::Text,
        },
        found => found,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integer_seconds_are_joined_with_their_nanoseconds() {
        let of = |headers: &[&str]| {
            let headings: Vec<Heading> = headers.iter().map(|h| Heading::parse(h)).collect();
            let chosen = choose(None, &headings, Path::new("log.csv")).ok()?;
            Some((chosen.index, chosen.nanoseconds))
        };
        for [whole, rest] in [
            ["header_stamp_secs", "header_stamp_nsecs"],
            ["header.stamp.sec", "header.stamp.nanosec"],
            ["secs", "nsecs"],
            ["field.stamp.sec", "field.stamp.nsec"],
        ] {
            assert_eq!(of(&["seq", rest, whole]), Some((2, Some(1))), "{whole}");
        }
        assert_eq!(of(&["header.stamp.secs", "Time", "header.stamp.nsecs"]), Some((1, None)));
        assert_eq!(of(&["header_stamp_secs", "x"]), None);
    }

    fn chosen(headers: &[&str]) -> Option<(usize, Option<f64>)> {
        let headings: Vec<Heading> = headers.iter().map(|h| Heading::parse(h)).collect();
        let chosen = choose(None, &headings, Path::new("log.csv")).ok()?;
        Some((chosen.index, chosen.seconds))
    }

    #[test]
    fn the_most_certain_name_is_used_in_any_position() {
        assert_eq!(chosen(&["u", "stamp", "Time [ms]"]), Some((2, Some(1e-3))));
        assert_eq!(chosen(&["seconds", "t"]), Some((1, None)));
        assert_eq!(chosen(&["TimeUS", "Roll"]), Some((0, Some(1e-6))));
        assert_eq!(chosen(&["timestamp_ns"]), Some((0, Some(1e-9))));
        assert_eq!(chosen(&["__time"]), Some((0, None)));
        for header in ["times", "status", "u_ms", "runtime", "T (degC)", "t [m]", "date"] {
            assert_eq!(chosen(&[header]), None, "{header}");
        }
    }
}
