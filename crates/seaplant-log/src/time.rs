//! Which column is time, and in what order its rows are.

use std::collections::HashMap;
use std::path::Path;

use crate::Error;
use crate::cell::{Cell, stamp};
use crate::heading::Heading;
use crate::lookup::{self, Candidate};
use crate::spelling::fold;
use crate::symbol::symbols_of;
use crate::{Dimension, TimeColumn, Unit};

/// Names that time goes by, the surest first.
#[rustfmt::skip]
const NAMES: &[&str] = &[
    "time", "t", "timestamp", "elapsed", "elapsed time", "elapsed_time", "datetime", "date_time",
    "date time", "date/time", "utc", "utc time", "utc_time", "unix_time", "unix time", "unixtime",
    "epoch", "__time", "stamp", "time stamp", "time_stamp", "timestamps", "seconds", "sec", "secs",
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
    /// The header's unit and the one that was stated in its place, where they differ.
    pub(crate) replaced: Option<[String; 2]>,
    /// The column of nanoseconds beside one of whole seconds.
    pub(crate) nanoseconds: Option<usize>,
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

/// The seconds in a unit that somebody wrote down as one of time.
fn stated_unit(symbol: &str, column: &str, path: &Path) -> Result<f64, Error> {
    Unit::find_as(symbol, Dimension::Time).map(|unit| unit.factor()).ok_or_else(|| {
        let accepted = symbols_of(Dimension::Time).collect();
        let (path, unit, column) = (path.to_owned(), symbol.to_owned(), column.to_owned());
        Error::TimeUnit { path, column, unit, accepted }
    })
}

fn recognise(headings: &[Heading], path: &Path) -> Result<Chosen, Error> {
    let names = folded(headings);
    // Whole seconds with nanoseconds beside them come after all names of time.
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

/// Spellings of whole seconds and of the nanoseconds after them, as ROS stamps are written.
const STAMPS: [[&str; 2]; 4] =
    [["secs", "nsecs"], ["sec", "nanosec"], ["sec", "nsec"], ["seconds", "nanoseconds"]];

/// The folded names of columns, each with the first column of that name.
fn folded(headings: &[Heading]) -> HashMap<String, usize> {
    headings.iter().enumerate().rev().map(|(k, heading)| (fold(&heading.name), k)).collect()
}

/// The column of nanoseconds beside that of whole seconds: `stamp.nsecs` beside `stamp.secs`.
fn nanoseconds_of(heading: &Heading, names: &HashMap<String, usize>) -> Option<usize> {
    let name = fold(&heading.name);
    let beside = |[whole, rest]: [&str; 2]| {
        let stem =
            name.strip_suffix(whole).filter(|stem| !stem.ends_with(char::is_alphanumeric))?;
        names.get(&format!("{stem}{rest}")).copied()
    };
    STAMPS.into_iter().find_map(beside)
}

/// Adds the nanoseconds after whole seconds, if all of them are less than a second.
pub(crate) fn add_nanoseconds(time_s: &mut [f64], nanoseconds: &[f64]) {
    let is_part = |rest: &f64| rest.is_nan() || (0.0..1e9).contains(rest);
    if time_s.len() == nanoseconds.len() && nanoseconds.iter().all(is_part) {
        time_s.iter_mut().zip(nanoseconds).for_each(|(second, rest)| *second += 1e-9 * rest);
    }
}

/// Whether a column holds the nanoseconds after the whole seconds of another.
fn is_nanoseconds(heading: &Heading, names: &HashMap<String, usize>) -> bool {
    let name = fold(&heading.name);
    let after = |[whole, rest]: [&str; 2]| {
        let stem = name.strip_suffix(rest);
        stem.is_some_and(|stem| names.contains_key(&format!("{stem}{whole}")))
    };
    STAMPS.into_iter().any(after)
}

/// The seconds in a unit, if it measures time.
fn seconds(unit: &Unit) -> Option<f64> {
    Unit::find_as(unit.symbol(), Dimension::Time).map(|unit| unit.factor())
}

/// How likely a heading is to be that of time: a place in [`NAMES`], `None` for one that is not.
fn rank(heading: &Heading) -> Option<usize> {
    if heading.unit.as_ref().is_some_and(|unit| seconds(unit).is_none()) {
        return None;
    }
    let name = fold(&heading.name);
    let place = |name: &str| NAMES.iter().position(|known| *known == name);
    place(&name).or_else(|| place(suffixed(&name)?.0))
}

/// The unit in a time column's name: `t_ms`, `seconds`. Of no other column is that guessed.
fn suffix_unit(name: &str) -> Option<f64> {
    let name = fold(name);
    if SECONDS.contains(&name.as_str()) {
        return Some(1.0);
    }
    suffixed(&name).map(|(_, unit)| unit.factor())
}

/// `t_ms` or `timeus` as name and unit of time.
fn suffixed(name: &str) -> Option<(&str, Unit)> {
    /// Units told without a separator; `s` is not one, for "times" is a plural.
    const JOINED: &[&str] = &["us", "ms", "ns", "sec"];
    let joined = || {
        let (base, unit) =
            JOINED.iter().find_map(|unit| Some((name.strip_suffix(unit)?, *unit)))?;
        NAMES.contains(&base).then_some((base, unit))
    };
    let (base, unit) = name.rsplit_once(['_', ' ', '-']).or_else(joined)?;
    Some((base, Unit::find_as(unit, Dimension::Time)?))
}

/// Reads a cell of the time column, which holds numbers or date-times, never both: the first
/// readable one tells.
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
    fn whole_seconds_are_joined_with_the_nanoseconds_beside_them() {
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
    fn the_surest_name_is_taken_wherever_it_stands() {
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
