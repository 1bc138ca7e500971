//! Converts arrays by name, as MATLAB saves them, to channels: identifies the time vectors and the
//! arrays of equal length.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;

use crate::assemble::{Assembly, Group};
use crate::column::Column;
use crate::epoch::{DAY_S, UNIX_EPOCH_DAY, are_datenums, datenums_in_words};
use crate::heading::Heading;
use crate::log::median_period;
use crate::note::Note;
use crate::time::{self, Chosen};
use crate::{Error, Log, ReadOptions, Unit};

/// Structs nested deeper are left out.
pub(crate) const DEEPEST: usize = 32;

/// Maximum number of columns of a matrix that each make a channel.
const MOST_COLUMNS: usize = 4096;

/// Reasons why variables are left out, in words that follow their name.
pub(crate) const CELLS: &str = "is a cell array: save what it holds as variables of their own";
pub(crate) const STRUCTS: &str = "is an array of structs: save one struct of arrays";
pub(crate) const OBJECT: &str = "is an object, such as a table, timetable, datetime or string: save its \
     columns as arrays of numbers, times by posixtime or seconds";
pub(crate) const TEXT: &str = "holds text";
pub(crate) const SPARSE: &str = "is a sparse matrix";
pub(crate) const COMPLEX: &str = "holds complex numbers";
pub(crate) const FUNCTION: &str = "is a function";
pub(crate) const DEEP: &str = "is nested too deeply";
pub(crate) const EMPTY: &str = "is empty";

/// An array of numbers with at most two dimensions that are not 1.
struct Array {
    /// `struct.field`.
    name: String,
    unit: Option<Unit>,
    rows: usize,
    columns: usize,
    /// Column-major.
    values: Vec<f64>,
}

impl Array {
    /// Returns the struct that contains it; empty for a variable.
    fn scope(&self) -> &str {
        self.name.rsplit_once('.').map_or("", |(scope, _)| scope)
    }

    fn field(&self) -> &str {
        self.name.rsplit_once('.').map_or(self.name.as_str(), |(_, field)| field)
    }

    fn is_vector(&self) -> bool {
        self.rows == 1 || self.columns == 1
    }

    /// Returns whether it has a value, or a row or column, for each of `times` times.
    fn fits(&self, times: usize) -> bool {
        match self.is_vector() {
            true => self.values.len() == times,
            false => self.rows == times || self.columns == times,
        }
    }

    /// Returns a column or row of a matrix by its name, `log(:,1)` or `log(1,:)`.
    fn part(&self, name: &str) -> Option<Self> {
        let place = name.strip_prefix(&self.name)?.strip_prefix('(')?.strip_suffix(')')?;
        let (row, column) = place.split_once(',')?;
        let within = |text: &str, count: usize| {
            text.trim().parse::<usize>().ok()?.checked_sub(1).filter(|k| *k < count)
        };
        let values: Vec<f64> = match (row.trim(), column.trim()) {
            (":", column) => {
                let k = within(column, self.columns)?;
                self.values[k * self.rows..][..self.rows].to_vec()
            }
            (row, ":") => {
                let k = within(row, self.rows)?;
                self.values[k..].iter().step_by(self.rows).copied().collect()
            }
            _ => return None,
        };
        let (rows, unit) = (values.len(), self.unit.clone());
        Some(Self { name: name.to_owned(), unit, rows, columns: 1, values })
    }

    /// Returns the name that selects it as time: for a matrix, that of its first column.
    fn as_time(&self) -> String {
        if self.is_vector() { self.name.clone() } else { format!("{}(:,1)", self.name) }
    }

    /// Splits it into columns of `times` numbers each; a square matrix into its columns.
    fn into_columns(self, times: usize) -> Vec<Column> {
        let Self { name, unit, rows, columns, values } = self;
        if values.len() == times {
            return vec![Column::new(name, unit, values)];
        }
        let column = |name: String, values: Vec<f64>| Column::new(name, unit.clone(), values);
        if rows == times {
            let parts = values.chunks_exact(rows).enumerate();
            return parts
                .map(|(k, v)| column(format!("{name}(:,{})", k + 1), v.to_vec()))
                .collect();
        }
        let row = |k: usize| values[k..].iter().step_by(rows).copied().collect();
        let number = if columns == times { rows } else { 0 };
        (0..number).map(|k| column(format!("{name}({},:)", k + 1), row(k))).collect()
    }
}

/// The arrays of a file.
#[derive(Default)]
pub(crate) struct Workspace {
    arrays: Vec<Array>,
    left_out: Vec<(String, &'static str)>,
}

/// A vector of times.
struct Base {
    /// Index of the array.
    array: usize,
    name: String,
    time_s: Vec<f64>,
    /// Columns of equal length.
    columns: Vec<Column>,
}

impl Workspace {
    /// Adds an array: `values` in column-major order, so that the first of `dimensions` varies
    /// fastest.
    pub(crate) fn add(
        &mut self,
        name: String,
        unit: Option<Unit>,
        dimensions: &[usize],
        values: Vec<f64>,
    ) {
        let mut long = dimensions.iter().copied().filter(|&length| length != 1);
        let (first, second, third) = (long.next(), long.next(), long.next());
        let [rows, columns] = match dimensions {
            [rows, columns] => [*rows, *columns],
            _ => [first.unwrap_or(1), second.unwrap_or(1)],
        };
        let why = match values.len() {
            0 => EMPTY,
            1 => "is a single number",
            _ if third.is_some() => "has more than two dimensions",
            count if rows.checked_mul(columns) != Some(count) => "holds fewer numbers than it says",
            _ if rows.min(columns) > MOST_COLUMNS => "has too many columns for channels",
            _ => return self.arrays.push(Array { name, unit, rows, columns, values }),
        };
        self.leave_out(name, why);
    }

    pub(crate) fn leave_out(&mut self, name: String, why: &'static str) {
        self.left_out.push((name, why));
    }

    /// Returns whether there are no arrays.
    pub(crate) fn is_empty(&self) -> bool {
        self.arrays.is_empty() && self.left_out.is_empty()
    }

    /// Makes channels of the arrays that are as long as a time vector.
    ///
    /// The time vector is one with a time-like name in the same or an enclosing struct, or else the
    /// one that `options` name; with equal sampling, the most common length is used.
    ///
    /// # Errors
    /// [`Error::NoTime`], [`Error::NoSamples`], [`Error::TimeUnit`], [`Error::NoChannel`] for a
    /// vector that `options` name; [`Error::Unsupported`] where all, or perhaps time, is in what is
    /// left out.
    pub(crate) fn log(
        mut self,
        mut assembly: Assembly,
        options: &ReadOptions,
        path: &Path,
        format: &str,
    ) -> Result<Log, Error> {
        if self.arrays.is_empty() && !self.left_out.is_empty() {
            return Err(self.unsupported("series of numbers", path, |_| true));
        }
        if let Some(rate) = options.equal_sampling_hz {
            self.sample_equally(rate, &mut assembly);
        } else {
            self.sample(options, path, &mut assembly)?;
        }
        for (name, why) in self.left_out {
            assembly.leave_out(name, why);
        }
        assembly.log(format)
    }

    fn sample_equally(&mut self, rate_hz: f64, assembly: &mut Assembly) {
        // In MATLAB the rows of a matrix follow each other in time.
        let length = |array: &Array| match array.is_vector() {
            true => array.values.len(),
            false => array.rows,
        };
        let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
        for array in &self.arrays {
            *counts.entry(length(array)).or_default() += 1;
        }
        let commonest = counts.into_iter().max_by_key(|&(length, count)| (count, length));
        let Some((times, _)) = commonest else { return };
        let time_s = (0..times).map(|k| k as f64 / rate_hz).collect();
        let mut columns = Vec::new();
        for array in std::mem::take(&mut self.arrays) {
            if length(&array) == times {
                columns.extend(array.into_columns(times));
            } else {
                self.leave_out(array.name, "is not as long as most others");
            }
        }
        assembly.group(Group { name: "variables".to_owned(), time_s, columns, of: None });
    }

    fn sample(
        &mut self,
        options: &ReadOptions,
        path: &Path,
        assembly: &mut Assembly,
    ) -> Result<(), Error> {
        let (mut bases, fallback) = self.bases(options, path, assembly)?;
        let times: BTreeSet<usize> = bases.values().map(|base| base.array).collect();
        for (k, array) in std::mem::take(&mut self.arrays).into_iter().enumerate() {
            if times.contains(&k) {
                continue;
            }
            let around = scopes(array.scope()).chain(fallback.as_deref());
            let around: Vec<&str> = around.filter(|scope| bases.contains_key(*scope)).collect();
            let fitting = around.iter().find(|scope| array.fits(bases[**scope].time_s.len()));
            let base = fitting.map(|scope| (*scope).to_owned());
            let Some(base) = base.and_then(|scope| bases.get_mut(&scope)) else {
                let why = match around.is_empty() {
                    true => "has no vector of times beside it",
                    false => "is not as long as its vector of times",
                };
                self.left_out.push((array.name, why));
                continue;
            };
            let found = array.into_columns(base.time_s.len()).into_iter();
            // A column whose name is that of time is no channel.
            base.columns.extend(found.filter(|column| column.heading.column != base.name));
        }
        for Base { name, time_s, columns, .. } in bases.into_values() {
            assembly.group(Group { name, time_s, columns, of: None });
        }
        Ok(())
    }

    /// Returns the time vectors by struct, and the struct of the one that the user named.
    fn bases(
        &mut self,
        options: &ReadOptions,
        path: &Path,
        assembly: &mut Assembly,
    ) -> Result<(BTreeMap<String, Base>, Option<String>), Error> {
        let mut chosen = self.recognise(options, path)?;
        let mut named_in = None;
        if let Some(named) = self.named(options, path)? {
            let scope = self.arrays[named.index].scope().to_owned();
            named_in = Some(scope.clone());
            chosen.insert(scope, named);
        }
        if chosen.is_empty() && self.left_out.iter().any(|(_, why)| *why == OBJECT) {
            return Err(self.unsupported("vector of times", path, |why| why == OBJECT));
        }
        if chosen.is_empty() {
            let columns = self.arrays.iter().map(Array::as_time).collect();
            return Err(Error::NoTime { path: path.to_owned(), columns });
        }
        let bases = chosen.into_iter();
        let bases = bases.map(|(scope, chosen)| (scope, self.base(chosen, path, assembly)));
        Ok((bases.collect(), named_in))
    }

    /// Returns the error for a file that lacks something, which may be in the left-out variables.
    fn unsupported(&self, lacks: &str, path: &Path, may_be: impl Fn(&str) -> bool) -> Error {
        /// Maximum number of variables in a message.
        const TOLD: usize = 3;
        let found = self.left_out.iter().filter(|(_, why)| may_be(why)).take(TOLD);
        let found: Vec<String> = found.map(|(name, why)| format!("{name:?} {why}")).collect();
        let detail = format!("without a {lacks} ({})", found.join("; "));
        let advice = "save each series as an array of numbers, with one of times beside it";
        Error::Unsupported { path: path.to_owned(), format: "a file of arrays", detail, advice }
    }

    /// Returns the vector that the user named as time, or the column of a matrix.
    fn named(&mut self, options: &ReadOptions, path: &Path) -> Result<Option<Chosen>, Error> {
        let Some(wanted) = &options.time else { return Ok(None) };
        let Some(column) = &wanted.column else { return Ok(None) };
        let matrices = self.arrays.iter().filter(|array| !array.is_vector());
        if let Some(part) = matrices.filter_map(|array| array.part(column.trim())).next() {
            self.arrays.push(part);
        }
        let vectors = || self.arrays.iter().enumerate().filter(|(_, array)| array.is_vector());
        let headings: Vec<Heading> =
            vectors().map(|(_, array)| heading(array, &array.name)).collect();
        let mut chosen = time::choose(Some(wanted), &headings, path)?;
        chosen.index = vectors().nth(chosen.index).map_or(0, |(k, _)| k);
        Ok(Some(chosen))
    }

    /// Finds in each struct the vector with a time-like name, if there is one.
    fn recognise(
        &self,
        options: &ReadOptions,
        path: &Path,
    ) -> Result<BTreeMap<String, Chosen>, Error> {
        // A unit given with a named column applies to that column.
        let wanted = options.time.as_ref().filter(|time| time.column.is_none());
        let mut scopes: HashMap<&str, Vec<usize>> = HashMap::new();
        for (k, array) in self.arrays.iter().enumerate().filter(|(_, array)| array.is_vector()) {
            scopes.entry(array.scope()).or_default().push(k);
        }
        let mut found = BTreeMap::new();
        for (scope, vectors) in scopes {
            let of = |k: &usize| heading(&self.arrays[*k], self.arrays[*k].field());
            let headings: Vec<Heading> = vectors.iter().map(of).collect();
            match time::choose(wanted, &headings, path) {
                Ok(mut chosen) => {
                    chosen.index = vectors[chosen.index];
                    chosen.nanoseconds = chosen.nanoseconds.map(|k| vectors[k]);
                    chosen.column.clone_from(&self.arrays[chosen.index].name);
                    found.insert(scope.to_owned(), chosen);
                }
                Err(error @ Error::TimeUnit { .. }) => return Err(error),
                // A struct without time vectors uses those of the enclosing ones.
                Err(_) => {}
            }
        }
        Ok(found)
    }

    /// Converts a vector to times in seconds.
    fn base(&mut self, chosen: Chosen, path: &Path, assembly: &mut Assembly) -> Base {
        let Chosen { index, column, seconds, others, replaced, nanoseconds } = chosen;
        let mut time_s = std::mem::take(&mut self.arrays[index].values);
        if let Some(nanoseconds) = nanoseconds {
            time::add_nanoseconds(&mut time_s, &self.arrays[nanoseconds].values);
        }
        if !others.is_empty() {
            let (path, column) = (path.to_owned(), column.clone());
            assembly.note(Note::TimeChosen { path, column, others });
        }
        let path = path.to_owned();
        if let Some([header, stated]) = replaced {
            let (path, column) = (path.clone(), column.clone());
            assembly.note(Note::TimeUnitReplaced { path, column, header, stated });
        }
        let finite: Vec<f64> = time_s.iter().copied().filter(|time| time.is_finite()).collect();
        match (seconds, median_period(&finite)) {
            (Some(seconds), _) => time_s.iter_mut().for_each(|time| *time *= seconds),
            (None, Some(period)) if are_datenums(&finite, period) => {
                time_s.iter_mut().for_each(|time| *time = (*time - UNIX_EPOCH_DAY) * DAY_S);
                let clock = datenums_in_words(&column);
                assembly.note(Note::Clock { path, clock });
            }
            (None, Some(period_s)) => {
                let column = column.clone();
                assembly.note(Note::TimeUnitAssumed { path, column, period_s });
            }
            (None, None) => {}
        }
        Base { array: index, name: column, time_s, columns: Vec::new() }
    }
}

fn heading(array: &Array, name: &str) -> Heading {
    let (column, name, unit) = (array.name.clone(), name.to_owned(), array.unit.clone());
    Heading { column, name, unit, nameless: false, instant: false }
}

/// Iterates over a struct and the enclosing ones, the innermost first; the last is that of
/// variables.
fn scopes(scope: &str) -> impl Iterator<Item = &str> {
    std::iter::successors(Some(scope), |scope| {
        let outer = |scope: &&str| scope.rfind('.').unwrap_or(0);
        (!scope.is_empty()).then(|| &scope[..outer(scope)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn structs_are_looked_through_outwards() {
        assert_eq!(scopes("a.b").collect::<Vec<_>>(), ["a.b", "a", ""]);
        assert_eq!(scopes("").collect::<Vec<_>>(), [""]);
    }

    #[test]
    fn days_are_distinguished_from_seconds() {
        // 31 July 2020, ten a second; nine days of uptime, ten a second.
        let every = |start: f64, step: f64| (0..9).map(|k| start + step * f64::from(k)).collect();
        let days: Vec<f64> = every(738_003.5, 0.1 / DAY_S);
        let uptime: Vec<f64> = every(738_003.5, 0.1);
        assert!(are_datenums(&days, median_period(&days).unwrap()));
        assert!(!are_datenums(&uptime, median_period(&uptime).unwrap()));
    }
}
