//! Converts a table to a log: finds the time column, orders the rows, makes the channels.

use std::path::Path;

use crate::assemble::Assembly;
use crate::column::Column;
use crate::epoch::{self, DAY_S};
use crate::grid::{ChooseTime, Grid};
use crate::log::{Log, median_period};
use crate::note::Note;
use crate::order::{Order, Times};
use crate::quaternion;
use crate::time::{self, Chosen};
use crate::wrap::{self, Wrapped};
use crate::{Epoch, Error, ReadOptions};

/// Reads a table as a log; `read_grid` reads the table and lets the caller choose the time column.
///
/// # Errors
/// [`Error::NoTime`], [`Error::NoChannel`] for a column that `options` name, [`Error::TimeUnit`],
/// [`Error::TimeNotReadable`], [`Error::TimeGoesBackwards`], [`Error::TooFewRows`]; those of
/// `read_grid`.
pub(crate) fn read(
    path: &Path,
    options: &ReadOptions,
    read_grid: impl FnOnce(ChooseTime<'_>) -> Result<Grid, Error>,
) -> Result<Log, Error> {
    let mut chosen: Option<Chosen> = None;
    let mut grid = read_grid(&mut |headings| {
        if options.equal_sampling_hz.is_none() {
            chosen = Some(time::choose(options.time.as_ref(), headings, path)?);
        }
        Ok(chosen.as_ref().map(|chosen| chosen.index))
    })?;
    let times = match chosen {
        Some(chosen) => row_times(&mut grid, chosen, options, path)?,
        None => equal_times(grid.rows, options, path)?,
    };
    assemble(grid, &times, options)
}

fn assemble(grid: Grid, times: &Times, options: &ReadOptions) -> Result<Log, Error> {
    let path = grid.origin.path().to_owned();
    let mut assembly = Assembly::new(grid.origin, options);
    if let Some(epoch) = grid.epoch {
        assembly.epoch(epoch);
    }
    grid.notes.into_iter().for_each(|note| assembly.note(note));
    let attitudes = quaternion::attitudes(&grid.columns, grid.rows);
    for column in grid.columns.into_iter().filter(|column| !column.is_margin()) {
        column.note(&path, grid.rows).into_iter().for_each(|note| assembly.note(note));
        assembly.column(times, grid.rows, column);
    }
    attitudes.into_iter().for_each(|column| assembly.column(times, grid.rows, column));
    grid.left_out.into_iter().for_each(|(column, why)| assembly.leave_out(column, why));
    assembly.table(grid.format)
}

/// Removes the time column from a grid, and notes its irregularities.
fn row_times(
    grid: &mut Grid,
    chosen: Chosen,
    options: &ReadOptions,
    path: &Path,
) -> Result<Times, Error> {
    let beside = chosen.nanoseconds.filter(|_| !grid.stamped);
    let nanoseconds = beside.map(|column| grid.columns[column].samples.to_dense(grid.rows));
    let Column { samples, text, .. } = grid.columns.remove(chosen.index);
    if samples.values.is_empty() && grid.rows > 0 {
        let (line, text) = text.map_or((grid.lines.line(0), String::new()), |t| (t.line, t.text));
        let (path, column) = (path.to_owned(), chosen.column);
        return Err(Error::TimeNotReadable { path, column, line, text });
    }
    let clock = Clock { column: chosen.column, seconds: chosen.seconds, stamped: grid.stamped };
    let mut time = samples.dense(grid.rows);
    if let Some(nanoseconds) = nanoseconds {
        time::add_nanoseconds(&mut time, &nanoseconds);
    }
    let (mut time_s, epoch) = clock.seconds(time, grid, path);
    time_s.iter_mut().for_each(|time| *time += options.offset_s);
    let (times, period_s) = order(&time_s, grid, path)?;
    let (path, column) = (path.to_owned(), clock.column);
    if !chosen.others.is_empty() {
        let (path, column, others) = (path.clone(), column.clone(), chosen.others);
        grid.notes.push(Note::TimeChosen { path, column, others });
    }
    if let Some([header, stated]) = chosen.replaced.filter(|_| !clock.stamped) {
        let (path, column) = (path.clone(), column.clone());
        grid.notes.push(Note::TimeUnitReplaced { path, column, header, stated });
    }
    if clock.seconds.is_none() && !clock.stamped && epoch.is_none() {
        grid.notes.push(Note::TimeUnitAssumed { path, column, period_s });
    }
    grid.epoch = epoch;
    Ok(times)
}

/// The time column of a table.
struct Clock {
    column: String,
    /// Seconds in its unit, if one is stated.
    seconds: Option<f64>,
    /// True if it holds date-times or times of day, which are in seconds whatever unit the header
    /// states.
    stamped: bool,
}

impl Clock {
    /// Returns the times in seconds, continued where the clock restarted, and their epoch, if
    /// determined. Each decision is noted.
    fn seconds(
        &self,
        mut time: Vec<f64>,
        grid: &mut Grid,
        path: &Path,
    ) -> (Vec<f64>, Option<Epoch>) {
        if self.stamped {
            let of_day = time.iter().all(|t| t.is_nan() || (0.0..DAY_S).contains(t));
            let wrapped = if of_day { wrap::carry_on_days(&mut time) } else { None };
            self.note_wrap(wrapped, grid, path);
            return (time, Some(if of_day { Epoch::Midnight } else { Epoch::Unix }));
        }
        if self.seconds.is_none()
            && let Some((scaled, clock)) = self.of_calendar(&time)
        {
            grid.notes.push(Note::Clock { path: path.to_owned(), clock });
            return (scaled, Some(Epoch::Unix));
        }
        let second = self.seconds.unwrap_or(1.0);
        let wrapped = wrap::carry_on_counts(&mut time, 1.0 / second);
        let epoch = wrapped.as_ref().filter(|w| w.cycle == wrap::DAY).map(|_| Epoch::Midnight);
        self.note_wrap(wrapped, grid, path);
        time.iter_mut().for_each(|t| *t *= second);
        (time, epoch)
    }

    /// Converts times without a unit that can only be calendar days to seconds since 1970, and
    /// describes them.
    fn of_calendar(&self, time: &[f64]) -> Option<(Vec<f64>, String)> {
        let known: Vec<f64> = time.iter().copied().filter(|t| t.is_finite()).collect();
        if let Some((second, unit)) = epoch::unit_since_1970(&known) {
            let clock = format!("{unit} since the Unix epoch, by their size: no unit is stated");
            return Some((time.iter().map(|t| t * second).collect(), clock));
        }
        let period = median_period(&known)?;
        if !epoch::are_datenums(&known, period) {
            return None;
        }
        let seconds = time.iter().map(|day| (day - epoch::UNIX_EPOCH_DAY) * DAY_S).collect();
        Some((seconds, epoch::datenums_in_words(&self.column)))
    }

    fn note_wrap(&self, wrapped: Option<Wrapped>, grid: &mut Grid, path: &Path) {
        grid.notes.extend(wrapped.map(|Wrapped { count, row, step, cycle }| {
            let (path, line) = (path.to_owned(), grid.lines.line(row));
            Note::ClockWrapped { path, line, cycle, count, step }
        }));
    }
}

/// Orders the times of the rows and notes late, repeated or absent times. Also returns the median
/// period, s.
fn order(time_s: &[f64], grid: &mut Grid, path: &Path) -> Result<(Times, f64), Error> {
    let lines = &grid.lines;
    let order = Order::new(time_s).map_err(|reset| Error::TimeGoesBackwards {
        path: path.to_owned(),
        line: lines.line(reset.row),
        from_s: reset.from_s,
        to_s: reset.to_s,
    })?;
    let path = path.to_owned();
    if let Some(odd) = order.timeless {
        let (path, rows, count, first_line) =
            (path.clone(), grid.rows, odd.count, lines.line(odd.row));
        grid.notes.push(Note::MissingTime { path, count, rows, first_line });
    }
    if let Some((odd, backwards_by_s)) = order.late {
        let (path, count, first_line) = (path.clone(), odd.count, lines.line(odd.row));
        grid.notes.push(Note::OutOfOrder { path, count, first_line, backwards_by_s });
    }
    if let Some(odd) = order.repeated {
        let (path, rows, count, first_line) =
            (path.clone(), grid.rows, odd.count, lines.line(odd.row));
        grid.notes.push(Note::RepeatedTime { path, count, rows, first_line });
    }
    match order.period_s {
        Some(period_s) => Ok((order.times, period_s)),
        None => Err(Error::TooFewRows { path, rows: order.distinct, needed: NEEDED }),
    }
}

/// Fewer rows make no interval.
const NEEDED: usize = 2;

fn equal_times(rows: usize, options: &ReadOptions, path: &Path) -> Result<Times, Error> {
    let rate = options.equal_sampling_hz.expect("a time column is chosen unless a rate is given");
    if rows < NEEDED {
        return Err(Error::TooFewRows { path: path.to_owned(), rows, needed: NEEDED });
    }
    let times: Vec<f64> = (0..rows).map(|row| row as f64 / rate + options.offset_s).collect();
    if times.windows(2).all(|w| w[0] < w[1]) && times[rows - 1].is_finite() {
        return Ok(Times::Clean(times.into()));
    }
    Err(Error::Option {
        path: path.to_owned(),
        option: "the sampling rate",
        found: rate.to_string(),
        expected: "such that rows differ in time",
    })
}
