//! From a text table to a log.

use std::path::Path;
use std::sync::Arc;

use crate::Error;
use crate::grid::{self, Grid, GridColumn, Samples};
use crate::heading::Heading;
use crate::log::{Channel, LeftOut, Log, median_period};
use crate::note::Note;
use crate::time::{self, Chosen};

/// How to read a log.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadOptions {
    /// The time column; `None` to recognise it by its name.
    pub time: Option<TimeColumn>,
    /// Added to every time, s, to bring several files to one clock.
    pub offset_s: f64,
    /// The rate of a log without a time column: row k is at k / `equal_sampling_hz`.
    pub equal_sampling_hz: Option<f64>,
}

/// Where a log's time is.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeColumn {
    /// The column, found as [`Log::channel`] finds channels.
    pub column: String,
    /// Its unit, in place of the one that the header states.
    pub unit: Option<String>,
}

/// Reads a text table as a log.
///
/// Commas, semicolons, tabs or blanks part the cells; lines that start with `#`, `%` or `//`, and
/// whatever stands above the header, are passed over. The header is the row of names above the
/// numbers; `u_velo [m/s]` and `T1 (us)` state units, as does a row of units below the names. Time
/// is the column that `options` name, else one called `time`, `t`, `timestamp` and the like:
/// numbers, ISO 8601 date-times (seconds since the Unix epoch; UTC where no offset is stated), or
/// times of day (seconds since midnight). Empty cells, `NaN`, `NA` and the like are missing: the
/// channel has no sample there. [`Log::notes`] tells whatever else was decided or dropped.
///
/// # Errors
/// Of the file: [`Error::Io`], [`Error::Directory`], [`Error::Binary`], [`Error::Empty`].
/// Of the table: [`Error::NotATable`], [`Error::NoHeader`], [`Error::HeaderCells`],
/// [`Error::OpenQuote`], [`Error::TooFewRows`]. Of time: [`Error::NoTime`], [`Error::NoChannel`]
/// for a column that `options` name, [`Error::TimeUnit`], [`Error::TimeNotReadable`],
/// [`Error::TimeGoesBackwards`]. [`Error::Option`] for a rate or an offset that cannot be.
///
/// # Example
/// ```
/// # use seaplant_log::{ReadOptions, read};
/// # let path = std::env::temp_dir().join("seaplant-log-read-example.csv");
/// std::fs::write(&path, "time [s],u [m/s]\n0.0,0.10\n0.1,0.12\n0.2,0.15\n")?;
/// let log = read(&path, &ReadOptions::default())?;
/// let u = log.channel("u")?;
/// assert_eq!(u.values(), [0.10, 0.12, 0.15]);
/// assert_eq!(u.unit.as_ref().map(|unit| unit.symbol()), Some("m/s"));
/// # std::fs::remove_file(&path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read(path: &Path, options: &ReadOptions) -> Result<Log, Error> {
    check(options, path)?;
    let mut chosen = None;
    let grid = grid::read(path, |headings| {
        if options.equal_sampling_hz.is_none() {
            chosen = Some(time::choose(options.time.as_ref(), headings, path)?);
        }
        Ok(chosen.as_ref().map(|c: &Chosen| c.index))
    })?;
    Ok(Assembly::new(grid, chosen, options, path)?.log())
}

fn check(options: &ReadOptions, path: &Path) -> Result<(), Error> {
    let refuse = |option, found: String, expected| {
        Err(Error::Option { path: path.to_owned(), option, found, expected })
    };
    if !options.offset_s.is_finite() {
        let found = options.offset_s.to_string();
        return refuse("the time offset", found, "a finite number of seconds");
    }
    match options.equal_sampling_hz {
        Some(rate) if !(rate.is_finite() && rate > 0.0) => {
            refuse("the sampling rate", rate.to_string(), "a positive number of hertz")
        }
        Some(rate) if options.time.is_some() => {
            let expected = "left out where a time column is named";
            refuse("the sampling rate", rate.to_string(), expected)
        }
        _ => Ok(()),
    }
}

/// A grid on its way to a log.
struct Assembly<'a> {
    path: &'a Path,
    grid: Grid,
    times: Times,
    /// The time bases in use, for channels to share.
    bases: Vec<Arc<[f64]>>,
}

/// The time of each row.
enum Times {
    /// Strictly increasing, one for each row: what a clean log has.
    Clean(Arc<[f64]>),
    /// In the file's order, perhaps late, repeated or absent.
    Rough(Vec<Option<f64>>),
}

impl<'a> Assembly<'a> {
    fn new(
        mut grid: Grid,
        chosen: Option<Chosen>,
        options: &ReadOptions,
        path: &'a Path,
    ) -> Result<Self, Error> {
        let Some(chosen) = chosen else {
            let times = equal_times(grid.rows, options, path)?;
            return Ok(Self { path, grid, times, bases: Vec::new() });
        };
        let column = grid.columns.remove(chosen.index);
        if column.samples.values.is_empty() && grid.rows > 0 {
            let (line, text) =
                column.text.map_or((grid.lines.of(0), String::new()), |t| (t.line, t.text));
            let (path, column) = (path.to_owned(), chosen.column);
            return Err(Error::TimeNotReadable { path, column, line, text });
        }
        // A date-time is in seconds already, whatever unit the header states.
        let scale = if grid.stamped { 1.0 } else { chosen.seconds.unwrap_or(1.0) };
        let mut samples = column.samples;
        for time in &mut samples.values {
            *time = *time * scale + options.offset_s;
        }
        let (times, period_s) = order(samples, &mut grid, path)?;
        if !chosen.others.is_empty() {
            let (column, others) = (chosen.column.clone(), chosen.others);
            grid.notes.push(Note::TimeChosen { path: path.to_owned(), column, others });
        }
        if chosen.seconds.is_none() && !grid.stamped {
            let column = chosen.column;
            grid.notes.push(Note::TimeUnitAssumed { path: path.to_owned(), column, period_s });
        }
        Ok(Self { path, grid, times, bases: Vec::new() })
    }

    fn log(mut self) -> Log {
        let mut log = Log::default();
        for column in std::mem::take(&mut self.grid.columns) {
            if column.is_margin() {
                continue;
            }
            self.grid.notes.extend(column.note(self.path, self.grid.rows));
            match self.channel(column) {
                Ok(channel) => log.channels.push(channel),
                Err(left_out) => log.left_out.push(left_out),
            }
        }
        log.sources.push(self.grid.source);
        log.notes = self.grid.notes;
        log
    }

    /// The channel that a column makes, unless it has no sample.
    fn channel(&mut self, column: GridColumn) -> Result<Channel, LeftOut> {
        let rows = self.grid.rows;
        let missing = rows - column.samples.values.len();
        let (time_s, values) = self.timed(column.samples);
        let GridColumn { heading, text, .. } = column;
        let Heading { column, name, unit, .. } = heading;
        if values.is_empty() {
            let text = text.map(|text| (text.line, text.text));
            return Err(LeftOut { column, name, source: 0, rows, text });
        }
        Ok(Channel { name, column, unit, source: 0, missing, time_s, values })
    }

    /// The samples of a column in order of time, one at a time.
    fn timed(&mut self, samples: Samples) -> (Arc<[f64]>, Vec<f64>) {
        let (time_s, mut values) = match &self.times {
            Times::Clean(base) if samples.rows.is_none() => (Arc::clone(base), samples.values),
            Times::Clean(base) => {
                let time_s = samples.iter().map(|(row, _)| base[row]).collect();
                (share(&mut self.bases, time_s), samples.values)
            }
            Times::Rough(times) => {
                let timed = samples.iter().filter_map(|(row, value)| Some((times[row]?, value)));
                let mut timed: Vec<(f64, f64)> = timed.collect();
                timed.sort_by(|a, b| a.0.total_cmp(&b.0));
                timed.dedup_by(|later, first| later.0 == first.0);
                let (time_s, values): (Vec<f64>, Vec<f64>) = timed.into_iter().unzip();
                (share(&mut self.bases, time_s), values)
            }
        };
        values.shrink_to_fit();
        (time_s, values)
    }
}

/// One allocation for equal time bases.
fn share(bases: &mut Vec<Arc<[f64]>>, time_s: Vec<f64>) -> Arc<[f64]> {
    if let Some(base) = bases.iter().find(|base| ***base == *time_s) {
        return Arc::clone(base);
    }
    let base: Arc<[f64]> = time_s.into();
    bases.push(Arc::clone(&base));
    base
}

fn equal_times(rows: usize, options: &ReadOptions, path: &Path) -> Result<Times, Error> {
    let rate = options.equal_sampling_hz.expect("a time column is chosen unless a rate is given");
    let times: Arc<[f64]> = (0..rows).map(|row| row as f64 / rate + options.offset_s).collect();
    enough(rows, path)?;
    if times.windows(2).all(|w| w[0] < w[1]) && times[rows - 1].is_finite() {
        return Ok(Times::Clean(times));
    }
    Err(Error::Option {
        path: path.to_owned(),
        option: "the sampling rate",
        found: rate.to_string(),
        expected: "such that rows differ in time",
    })
}

fn enough(rows: usize, path: &Path) -> Result<(), Error> {
    /// Fewer make no interval.
    const NEEDED: usize = 2;
    if rows < NEEDED {
        return Err(Error::TooFewRows { path: path.to_owned(), rows, needed: NEEDED });
    }
    Ok(())
}

/// Judges the times of the rows: what is late, repeated or absent is noted. Gives the median
/// period too, s.
fn order(samples: Samples, grid: &mut Grid, path: &Path) -> Result<(Times, f64), Error> {
    let is_clean = samples.rows.is_none()
        && samples.values.iter().all(|time| time.is_finite())
        && samples.values.windows(2).all(|w| w[0] < w[1]);
    if is_clean {
        enough(grid.rows, path)?;
        let period_s = median_period(&samples.values).expect("there are two times at least");
        return Ok((Times::Clean(samples.values.into()), period_s));
    }
    let timed: Vec<(usize, f64)> = samples.iter().filter(|(_, time)| time.is_finite()).collect();
    let notes = grid.notes.len();
    let missing = grid.rows - timed.len();
    if missing > 0 {
        let first = timed.iter().enumerate().find(|(k, (row, _))| k != row);
        let first_line = grid.lines.of(first.map_or(timed.len(), |(k, _)| k));
        let path = path.to_owned();
        grid.notes.push(Note::MissingTime { path, count: missing, first_line });
    }
    grid.notes.extend(time::check_order(&timed, &grid.lines, path)?);

    let mut sorted = timed.clone();
    sorted.sort_by(|a, b| a.1.total_cmp(&b.1));
    let repeats = sorted.windows(2).filter(|w| w[0].1 == w[1].1).map(|w| w[1].0);
    if let Some(first) = repeats.clone().min() {
        let (path, rows) = (path.to_owned(), grid.rows);
        let (count, first_line) = (repeats.count(), grid.lines.of(first));
        grid.notes.push(Note::RepeatedTime { path, count, rows, first_line });
    }
    let mut distinct: Vec<f64> = sorted.into_iter().map(|(_, time)| time).collect();
    distinct.dedup();
    enough(distinct.len(), path)?;
    let period_s = median_period(&distinct).expect("there are two times at least");
    if grid.notes.len() == notes {
        return Ok((Times::Clean(distinct.into()), period_s));
    }
    let mut times = vec![None; grid.rows];
    for (row, time) in timed {
        times[row] = Some(time);
    }
    Ok((Times::Rough(times), period_s))
}
