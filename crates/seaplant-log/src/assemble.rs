//! Assembles a log from the samples that a reader decoded.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::hash::{DefaultHasher, Hasher};
use std::path::Path;
use std::sync::Arc;

use crate::column::{Column, Samples, tell_apart};
use crate::content::Origin;
use crate::figure::{Figure, Portion};
use crate::heading::Heading;
use crate::limits::{MOST_COLUMNS, check_names, too_many_columns};
use crate::log::{Channel, LeftOut, Log, Reason};
use crate::note::Note;
use crate::order::{Order, Times};
use crate::{Epoch, Error, ReadOptions};

/// Largest forward jump of a clock that is not taken for a clock adjustment, s.
const STEP_S: f64 = 86_400.0;

/// Records of one kind, such as those of a topic or a type of message: times and columns of equal
/// length, in file order.
pub(crate) struct Group {
    /// Name in messages.
    pub(crate) name: String,
    /// The time of each record, s; `NaN` where it has none.
    pub(crate) time_s: Vec<f64>,
    pub(crate) columns: Vec<Column>,
    /// Number of such records in the file, if only some of them were read.
    pub(crate) of: Option<Figure<u64>>,
}

/// A log under construction.
pub(crate) struct Assembly {
    origin: Origin,
    offset_s: f64,
    /// Epoch that the reader stated.
    epoch: Option<Epoch>,
    log: Log,
    /// Time bases in use, shared between channels.
    bases: Bases,
    odd: Odd,
}

impl Assembly {
    pub(crate) fn new(origin: Origin, options: &ReadOptions) -> Self {
        let (log, bases, odd) = (Log::default(), Bases::new(), Odd::default());
        Self { origin, offset_s: options.offset_s, epoch: None, log, bases, odd }
    }

    pub(crate) fn note(&mut self, note: Note) {
        self.log.notes.push(note);
    }

    /// Adds records: each column becomes a channel, sorted by time; of equal times the first is
    /// kept.
    ///
    /// Records after a backward step of the clock that persists are left out, with a note: two
    /// sessions of one clock cannot be ordered.
    pub(crate) fn group(&mut self, mut group: Group) {
        for time in &mut group.time_s {
            *time += self.offset_s;
        }
        let (times, kept) = self.times(&group.name, &group.time_s);
        let portion = group.of.map(|of| Portion { read: group.time_s.len(), of });
        for mut column in group.columns {
            column.samples.truncate(kept);
            let heading = column.heading.clone();
            match channel(&times, &mut self.bases, kept, column) {
                Ok(channel) => self.log.channels.push(Channel { portion, ..channel }),
                Err(left_out) => {
                    self.odd.empty.push(heading.column);
                    self.log.left_out.push(left_out);
                }
            }
        }
    }

    /// Returns the time base of a group's records, and the number of records kept.
    fn times(&mut self, name: &str, time_s: &[f64]) -> (Times, usize) {
        let records = time_s.len();
        let mut until = records;
        let mut reset = None;
        // A run of late records that is short in the complete log may be long in the part that is
        // kept.
        let order = loop {
            match Order::new(&time_s[..until]) {
                Ok(order) => break order,
                Err(found) => until = reset.insert(found).row,
            }
        };
        let forward = order.times.steps().find(|[from_s, to_s]| to_s - from_s > STEP_S);
        let backward = reset.map(|reset| [reset.from_s, reset.to_s]);
        self.odd.stepped.extend(backward.or(forward).map(|[from_s, to_s]| Step {
            group: name.to_owned(),
            from_s,
            to_s,
            left_out: records - until,
        }));
        if let Some(timeless) = order.timeless {
            self.odd.timeless.add(name, timeless.count, records);
        }
        if let Some((late, by_s)) = order.late {
            self.odd.late.add(name, late.count, records);
            self.odd.late_by_s = self.odd.late_by_s.max(by_s);
        }
        if let Some(repeated) = order.repeated {
            self.odd.repeated.add(name, repeated.count, records);
        }
        (order.times, until)
    }

    /// Adds one column of a table of `rows` rows.
    pub(crate) fn column(&mut self, times: &Times, rows: usize, column: Column) {
        match channel(times, &mut self.bases, rows, column) {
            Ok(channel) => self.log.channels.push(channel),
            Err(left_out) => self.log.left_out.push(left_out),
        }
    }

    /// Records a field that makes no channel, with the reason in words that follow its name: "is a
    /// list of varying length".
    pub(crate) fn leave_out(&mut self, column: String, why: &'static str) {
        self.odd.left_out.entry(why).or_default().insert(column.clone());
        let (name, reason) = (column.clone(), Reason::Kind(why));
        self.log.left_out.push(LeftOut { column, name, source: 0, rows: 0, reason });
    }

    /// Sets the epoch of times whose magnitude does not determine it.
    pub(crate) fn epoch(&mut self, epoch: Epoch) {
        self.epoch = Some(epoch);
    }

    /// Records a vehicle setting.
    pub(crate) fn setting(&mut self, name: String, value: f64) {
        self.log.settings.insert(name, value);
    }

    /// Returns the finished log. `format` names the file format: "MCAP".
    ///
    /// # Errors
    /// [`Error::NoSamples`] of a log without a channel; those of [`Self::table`].
    pub(crate) fn log(mut self, format: &str) -> Result<Log, Error> {
        let path = self.origin.path().to_owned();
        if self.log.channels.len() > MOST_COLUMNS {
            return Err(too_many_columns(&path));
        }
        if self.log.channels.is_empty() {
            return Err(Error::NoSamples { path, format: format.to_owned() });
        }
        let names = self.log.channels.iter_mut().map(|c| (&mut c.column, &mut c.name));
        tell_apart(names, &path, &mut self.log.notes);
        self.table(format.to_owned())
    }

    /// Returns the log of a table, which may hold no number.
    ///
    /// # Errors
    /// [`Error::Io`]; those of [`check_names`].
    pub(crate) fn table(mut self, format: String) -> Result<Log, Error> {
        let (channels, left_out) = (&self.log.channels, &self.log.left_out);
        check_names(channels.iter().map(|channel| channel.name.as_str()), self.origin.path())?;
        check_names(left_out.iter().map(|column| column.name.as_str()), self.origin.path())?;
        self.odd.notes(self.origin.path(), &mut self.log.notes);
        self.log.notes.extend(self.origin.notes());
        let first_s = self.log.channels.iter().filter_map(|c| c.time_s().first()).copied();
        let first_s = first_s.fold(f64::INFINITY, f64::min) - self.offset_s;
        let mut source = self.origin.source(format)?;
        source.epoch = self.epoch.unwrap_or_else(|| Epoch::of_time(first_s));
        self.log.sources.push(source);
        Ok(self.log)
    }
}

/// Returns the channel of a column of `rows` rows, unless the column has no sample.
fn channel(
    times: &Times,
    bases: &mut Bases,
    rows: usize,
    column: Column,
) -> Result<Channel, LeftOut> {
    let missing = rows - column.samples.values.len();
    let reason = column.reason();
    let (time_s, values) = timed(times, bases, rows, column.samples);
    let Heading { column: header, name, unit, .. } = column.heading;
    if values.is_empty() {
        return Err(LeftOut { column: header, name, source: 0, rows, reason });
    }
    let (source, portion) = (0, None);
    Ok(Channel { name, column: header, unit, source, missing, time_s, values, portion })
}

/// Iterates over the samples of a column in time order.
fn timed(
    times: &Times,
    bases: &mut Bases,
    rows: usize,
    samples: Samples,
) -> (Arc<[f64]>, Vec<f64>) {
    let (time_s, mut values) = match times {
        Times::Clean(base) if samples.rows.is_none() => (Arc::clone(base), samples.values),
        Times::Clean(base) => {
            let time_s = samples.iter().map(|(row, _)| base[row]).collect();
            (share(bases, time_s), samples.values)
        }
        Times::Rough(sorted) => {
            let dense = samples.dense(rows);
            let timed = sorted.iter().map(|&(time, row)| (time, dense[row]));
            let mut timed: Vec<(f64, f64)> = timed.filter(|(_, value)| !value.is_nan()).collect();
            timed.dedup_by(|later, first| later.0 == first.0);
            let (time_s, values): (Vec<f64>, Vec<f64>) = timed.into_iter().unzip();
            (share(bases, time_s), values)
        }
    };
    values.shrink_to_fit();
    (time_s, values)
}

/// Time bases in use, keyed by a hash, so that none of thousands of columns is compared with all
/// others.
type Bases = HashMap<u64, Vec<Arc<[f64]>>>;

/// Returns the shared allocation of equal time bases.
fn share(bases: &mut Bases, time_s: Vec<f64>) -> Arc<[f64]> {
    let mut hasher = DefaultHasher::new();
    time_s.iter().for_each(|time| hasher.write_u64(time.to_bits()));
    let alike = bases.entry(hasher.finish()).or_default();
    if let Some(base) = alike.iter().find(|base| ***base == *time_s) {
        return Arc::clone(base);
    }
    let base: Arc<[f64]> = time_s.into();
    alike.push(Arc::clone(&base));
    base
}

/// Irregularities of groups of records, reported in few notes however many groups there are.
#[derive(Default)]
struct Odd {
    timeless: Records,
    late: Records,
    late_by_s: f64,
    repeated: Records,
    stepped: Vec<Step>,
    empty: Vec<String>,
    left_out: BTreeMap<&'static str, BTreeSet<String>>,
}

/// A clock adjustment.
struct Step {
    group: String,
    from_s: f64,
    to_s: f64,
    /// Number of records after it that were left out, if the clock went back.
    left_out: usize,
}

/// Records with one irregularity: their number, the total, and their groups.
#[derive(Default)]
struct Records {
    groups: Vec<String>,
    count: usize,
    of: usize,
}

impl Records {
    fn add(&mut self, group: &str, count: usize, of: usize) {
        self.groups.push(group.to_owned());
        self.count += count;
        self.of += of;
    }
}

impl Odd {
    fn notes(self, path: &Path, notes: &mut Vec<Note>) {
        let path = || path.to_owned();
        let Self { timeless, late, repeated, stepped, empty, left_out, late_by_s } = self;
        let backwards_by_s = late_by_s;
        if let Some(Step { from_s, to_s, .. }) = stepped.first() {
            let (from_s, to_s) = (*from_s, *to_s);
            let left_out = stepped.iter().map(|step| step.left_out).sum();
            let groups = stepped.into_iter().map(|step| step.group).collect();
            notes.push(Note::ClockStepped { path: path(), groups, from_s, to_s, left_out });
        }
        if let Records { groups, count: count @ 1.., of } = timeless {
            notes.push(Note::RecordsWithoutTime { path: path(), groups, count, of });
        }
        if let Records { groups, count: count @ 1.., of } = late {
            notes.push(Note::LateRecords { path: path(), groups, count, of, backwards_by_s });
        }
        if let Records { groups, count: count @ 1.., of } = repeated {
            notes.push(Note::RepeatedTimes { path: path(), groups, count, of });
        }
        if !empty.is_empty() {
            let why = "has no value in any record";
            notes.push(Note::LeftOut { path: path(), columns: empty, why });
        }
        for (why, columns) in left_out {
            let columns = columns.into_iter().collect();
            notes.push(Note::LeftOut { path: path(), columns, why });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::content::Content;

    fn assembly() -> Assembly {
        let (origin, _) =
            Content::of_bytes(Path::new("log.bin"), b"abc".to_vec()).unwrap().stream();
        Assembly::new(origin, &ReadOptions { offset_s: 10.0, ..ReadOptions::default() })
    }

    fn column(name: &str, values: &[f64]) -> Column {
        Column::new(name.to_owned(), None, values.to_owned())
    }

    fn group(time_s: &[f64], columns: Vec<Column>) -> Group {
        Group { name: "imu".to_owned(), time_s: time_s.to_owned(), columns, of: None }
    }

    fn notes(log: &Log) -> Vec<String> {
        log.notes().iter().map(ToString::to_string).collect()
    }

    #[test]
    fn channels_of_a_group_share_its_times_where_they_can() {
        let mut assembly = assembly();
        let (a, b) = (column("a", &[1.0, 2.0, 3.0]), column("b", &[4.0, f64::NAN, 6.0]));
        let c = column("c", &[7.0, f64::INFINITY, 9.0]);
        assembly.group(group(&[0.0, 1.0, 2.0], vec![a, b, c]));
        let log = assembly.log("test").unwrap();
        let [a, b, c] = log.channels() else { panic!("three channels") };
        assert_eq!((a.time_s(), a.missing), (&[10.0, 11.0, 12.0][..], 0));
        assert_eq!((b.time_s(), b.values(), b.missing), (&[10.0, 12.0][..], &[4.0, 6.0][..], 1));
        assert!(b.shares_time_with(c) && !a.shares_time_with(b));
        assert_eq!(notes(&log), [""; 0]);
        let source = &log.sources()[0];
        assert_eq!((source.bytes, source.format.as_str()), (3, "test"));
        // FIPS 180-4, example of "abc".
        assert!(source.sha256.starts_with("ba7816bf8f01cfea414140de5dae2223"));
    }

    #[test]
    fn late_repeated_and_timeless_records_are_handled_and_reported_once() {
        let mut assembly = assembly();
        for name in ["a", "b"] {
            let column = column(name, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
            assembly.group(group(&[0.0, 2.0, 1.0, 2.0, f64::NAN, 3.0], vec![column]));
        }
        let log = assembly.log("test").unwrap();
        for channel in log.channels() {
            assert_eq!(channel.time_s(), [10.0, 11.0, 12.0, 13.0]);
            assert_eq!(channel.values(), [0.0, 2.0, 1.0, 5.0]);
        }
        assert_eq!(
            notes(&log),
            [
                "log.bin: of 12 records of \"imu\", \"imu\" 2 have no readable time; dropped",
                "log.bin: of 12 records of \"imu\", \"imu\" 2 are earlier than one before, by up to \
                 1.000000 s; sorted by time",
                "log.bin: of 12 records of \"imu\", \"imu\" 2 repeat the time of another; each \
                 channel keeps its first sample at a time",
            ]
        );
    }

    #[test]
    fn a_clock_that_went_back_ends_its_group() {
        let mut assembly = assembly();
        assembly.group(group(
            &[0.0, 1.0, 2.0, 0.5, 1.5, 2.5, 3.5],
            vec![column("a", &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0])],
        ));
        let log = assembly.log("test").unwrap();
        assert_eq!(log.channels()[0].values(), [0.0, 1.0, 2.0]);
        assert_eq!(
            notes(&log),
            [
                "log.bin: the clock of \"imu\" leaps from 12.000000 s to 10.500000 s and stays behind; \
              4 records from there on are left out: split the log there"
            ]
        );
    }

    #[test]
    fn a_clock_that_leaps_ahead_is_reported() {
        let mut assembly = assembly();
        assembly.group(group(&[0.0, 1.0, 1.7e9], vec![column("a", &[0.0, 1.0, 2.0])]));
        let log = assembly.log("test").unwrap();
        assert_eq!(log.channels()[0].len(), 3);
        assert_eq!(
            notes(&log),
            ["log.bin: the clock of \"imu\" leaps from 11.000000 s to 1700000010.000000 s; check \
              what set it"]
        );
    }

    #[test]
    fn fields_without_channel_can_be_requested() {
        let mut assembly = assembly();
        assembly.leave_out("image".to_owned(), "is a list of varying length");
        let (a, b) = (column("a", &[1.0, 2.0]), column("b", &[f64::NAN, f64::NAN]));
        assembly.group(group(&[0.0, 1.0], vec![a, b, column("a", &[3.0, 4.0])]));
        let log = assembly.log("test").unwrap();
        let columns: Vec<&str> = log.channels().iter().map(|c| c.column.as_str()).collect();
        assert_eq!(columns, ["a", "a.2"]);
        assert_eq!(
            log.channel("image").unwrap_err().to_string(),
            "column \"image\" of log.bin is a list of varying length; choose another"
        );
        assert!(matches!(log.channel("b"), Err(Error::AllMissing { rows: 2, .. })));
        assert_eq!(
            notes(&log),
            [
                "log.bin: a second column is headed \"a\"; it is named \"a.2\" here",
                "log.bin: \"b\" has no value in any record; left out",
                "log.bin: \"image\" is a list of varying length; left out",
            ]
        );
    }

    #[test]
    fn a_log_without_a_number_is_refused() {
        let error = assembly().log("an MCAP file").unwrap_err();
        assert_eq!(
            error.to_string(),
            "log.bin (an MCAP file) holds no numbers with times; check that the recording was saved \
             and copied whole"
        );
    }
}
