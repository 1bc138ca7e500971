//! Aligns the clocks of files that were logged simultaneously.

use std::path::Path;

use seaplant::{ClockOffset, Recording, Timed, Vehicle, estimate_offset};
use seaplant_log::{Log, Unit};

use crate::columns::{Recognised, recognise};
use crate::units::dimension_of;

/// Returns the motion and thrust in each file of a log, by the names of its columns.
pub(crate) fn recordings(log: &Log) -> Vec<Recording> {
    let of_file = |columns: Vec<Recognised>| {
        let series = |column: &Recognised| Some((column.quantity.clone(), si(log, column)?));
        columns.iter().filter_map(series).collect()
    };
    recognise(log).into_iter().map(of_file).collect()
}

/// Converts a column to SI units; `None` for one without a unit.
fn si(log: &Log, column: &Recognised) -> Option<Timed> {
    let channel = &log.channels()[column.channel];
    let wanted = dimension_of(column.quantity.kind());
    let unit = match (column.unit, &channel.unit) {
        (Some(unit), _) => Unit::parse_as(unit, wanted).ok()?,
        (None, header) => header.as_ref()?.resolve(wanted).ok()?,
    };
    let sign = if column.negate { -1.0 } else { 1.0 };
    let values: Vec<f64> = channel.values().iter().map(|x| sign * unit.to_si(*x)).collect();
    Timed::new(&channel.column, channel.time_s(), values).ok()
}

/// Files, some aligned to one clock; the offsets of the others are estimated one by one.
pub(crate) struct Alignment<'a> {
    pub(crate) vehicle: &'a Vehicle,
    /// Motion and thrust in each file.
    pub(crate) recordings: Vec<Recording>,
    /// True for each file whose clock is that of the trial.
    pub(crate) is_aligned: Vec<bool>,
}

impl Alignment<'_> {
    /// Estimates how far the clock of a file lags the aligned ones.
    pub(crate) fn estimate(&self, file: usize) -> Result<ClockOffset, seaplant::Error> {
        let aligned = self.recordings.iter().zip(&self.is_aligned).filter(|(_, aligned)| **aligned);
        let mut reference = Recording::new();
        for (quantity, series) in aligned.flat_map(|(recording, _)| recording) {
            reference.entry(quantity.clone()).or_insert_with(|| series.clone());
        }
        estimate_offset(&reference, &self.recordings[file], self.vehicle)
    }

    /// Shifts the clock of a file to the common one.
    pub(crate) fn move_by(&mut self, file: usize, offset_s: f64) {
        let moved = self.recordings[file].iter();
        self.recordings[file] =
            moved.map(|(quantity, series)| (quantity.clone(), series.shifted(offset_s))).collect();
        self.is_aligned[file] = true;
    }

    /// Estimates the offsets of files, each against all files aligned before.
    ///
    /// # Errors
    /// The first file whose offset no other tells, and why.
    pub(crate) fn estimate_all(
        &mut self,
        files: &[usize],
    ) -> Result<Vec<(usize, ClockOffset)>, (usize, seaplant::Error)> {
        let mut found = Vec::new();
        let mut open: Vec<usize> = files.to_vec();
        while let Some(&first) = open.first() {
            let mut refused = None;
            let told = open.iter().find_map(|&file| match self.estimate(file) {
                Ok(offset) => Some((file, offset)),
                Err(error) => {
                    refused.get_or_insert(error);
                    None
                }
            });
            match (told, refused) {
                (Some((file, offset)), _) => {
                    self.move_by(file, offset.offset_s);
                    open.retain(|other| *other != file);
                    found.push((file, offset));
                }
                (None, Some(error)) => return Err((first, error)),
                (None, None) => break,
            }
        }
        Ok(found)
    }
}

/// Formats an offset and its source: `+7.770 s ± 0.004 s`, and by which signals.
pub fn in_words(offset: &ClockOffset) -> String {
    let ClockOffset { offset_s, std_s, pairs } = offset;
    let believed = pairs.iter().filter(|pair| pair.offset_s.is_some());
    let told = believed.filter_map(|pair| {
        let (correlation, second) = (pair.correlation?, pair.second_peak?);
        Some(format!(
            "{} and {} (correlation {correlation:.2}; the next best offset has {:.0} % of the evidence)",
            pair.reference,
            pair.other,
            100.0 * second
        ))
    });
    let told = told.collect::<Vec<_>>().join(", ");
    let lag = if pairs.iter().any(|pair| pair.offset_s.is_some() && pair.of_thrust) {
        "; the offset includes any lag of the thrusters"
    } else {
        ""
    };
    // Half a millisecond is the limit of accuracy.
    format!("{offset_s:+.3} s ± {:.3} s, by {told}{lag}", std_s.max(5e-4))
}

/// Returns the line of a trial that states an offset.
pub(crate) fn line(file: &Path, offset_s: f64) -> String {
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
    format!("offset_s = {{ \"{name}\" = {offset_s:.3} }}")
}
