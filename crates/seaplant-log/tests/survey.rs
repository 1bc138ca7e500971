//! Surveys of large files agree with complete readings.
//!
//! The tests of each format check complete readings; here the logs are long and even, by the
//! writers of other projects (`reference/make_survey.py`).

use std::path::Path;

use seaplant_log::{Channel, Figure, ReadOptions, Survey, Thoroughness, read, survey};

use crate::common::python::made;
use crate::common::{Sample, data, without_folder};

/// Parts so small that logs of some hundred kilobytes are large.
const HOW: Thoroughness = Thoroughness { whole_up_to: 1 << 16, parts: 6, part_bytes: 1 << 13 };

/// Relative tolerance of estimates of steady logs: records of two kinds are unevenly spread over
/// parts of 8 KiB.
const NEAR: f64 = 0.05;

fn surveyed(path: &Path) -> Survey {
    survey(path, &ReadOptions::default(), HOW).unwrap_or_else(|error| panic!("{error}"))
}

/// Checks every channel of a survey against the complete file: each sample that was read is one of
/// the file's, numbers marked exact are exact, and estimates are within `near`.
fn agrees(path: &Path, survey: &Survey, near: f64) {
    let whole = read(path, &ReadOptions::default()).unwrap();
    let columns: Vec<&str> = whole.channels().iter().map(|c| c.column.as_str()).collect();
    let found: Vec<&str> = survey.channels().iter().map(|c| c.read.column.as_str()).collect();
    assert_eq!(found, columns, "{}", path.display());
    for (seen, all) in survey.channels().iter().zip(whole.channels()) {
        let name = &all.column;
        assert_eq!(seen.read.unit, all.unit, "{name}");
        is_part(&seen.read, all);
        let close = |found: f64, real: f64, scale: f64| (found - real).abs() <= near * scale;
        let count = all.len() as f64;
        match seen.count {
            Figure::Exact(found) => assert_eq!(found, all.len() as u64, "{name}"),
            Figure::About(found) => {
                assert!(close(found as f64, count, count), "{name}: {found} of {count}");
            }
        }
        let ends = [(seen.first_s, all.time_s()[0]), (seen.last_s, all.time_s()[all.len() - 1])];
        for (found, real) in ends {
            let exact = !found.is_estimate() && found.value() == real;
            let about = found.is_estimate() && close(found.value(), real, all.span_s());
            assert!(exact || about, "{name}: {found:?}, {real}");
        }
        let (rate, real) = (seen.rate_hz.unwrap().value(), all.rate_hz().unwrap());
        assert!(close(rate, real, real), "{name}: {rate} Hz, {real} Hz");
    }
}

/// Checks that every sample of one is in the other.
fn is_part(part: &Channel, all: &Channel) {
    for (time, value) in part.time_s().iter().zip(part.values()) {
        let place = all.time_s().binary_search_by(|t| t.total_cmp(time));
        let real = place.map(|place| all.values()[place]);
        assert_eq!(real, Ok(*value), "{} at {time} s", all.column);
    }
}

/// Returns whether only parts were read, a few hundredths to a third of the file.
fn in_parts(survey: &Survey) -> bool {
    let [file] = survey.files() else { panic!("one file") };
    assert_eq!(file.sha256.is_none(), file.parts.is_some());
    file.parts.is_some_and(|parts| parts.count > 3 && 3 * parts.bytes < file.bytes)
}

#[test]
fn files_without_an_index_are_surveyed_by_parts() {
    let Some(made) = made("survey") else { return };
    for name in ["log.csv", "log.BIN", "log.tlog"] {
        let path = made.file(name);
        let survey = surveyed(&path);
        assert!(in_parts(&survey), "{name}");
        agrees(&path, &survey, NEAR);
        assert!(survey.channels().iter().all(|channel| channel.count.is_estimate()));
        // The first channel has a sample at both ends.
        let first = &survey.channels()[0];
        assert!(!first.first_s.is_estimate() && !first.last_s.is_estimate(), "{name}");
    }
}

#[test]
fn bags_are_surveyed_by_their_index() {
    let Some(made) = made("survey") else { return };
    for name in ["log.mcap", "packed.mcap", "log.bag"] {
        let path = made.file(name);
        let survey = surveyed(&path);
        assert!(in_parts(&survey), "{name}");
        agrees(&path, &survey, NEAR);
        for channel in survey.channels() {
            let ends = [channel.first_s, channel.last_s];
            assert!(!channel.count.is_estimate(), "{name}: {}", channel.read.column);
            assert!(!ends.iter().any(|end| end.is_estimate()), "{name}: {}", channel.read.column);
        }
        // A topic of six seconds in the middle of two minutes.
        let middle = survey.channels().iter().find(|c| c.read.column == "/temperature/temperature");
        assert_eq!(middle.map(|channel| channel.count), Some(Figure::Exact(300)), "{name}");
    }
}

#[test]
fn a_parquet_file_is_surveyed_by_rows() {
    let Some(made) = made("survey") else { return };
    let path = made.file("log.parquet");
    let survey = surveyed(&path);
    assert!(in_parts(&survey));
    agrees(&path, &survey, NEAR);
    for channel in survey.channels() {
        assert!(!channel.count.is_estimate() && !channel.last_s.is_estimate());
    }
}

#[test]
fn an_sqlite_bag_is_surveyed_by_pages() {
    let Some(made) = made("survey") else { return };
    let path = made.file("log.db3");
    let survey = surveyed(&path);
    assert!(in_parts(&survey));
    let whole = read(&path, &ReadOptions::default()).unwrap();
    for seen in survey.channels() {
        is_part(&seen.read, whole.channel(&seen.read.column).unwrap());
    }
    let pressure = &survey.channels()[0];
    assert_eq!(pressure.read.column, "/pressure/fluid_pressure");
    let count = pressure.count.value() as f64;
    assert!(
        pressure.count.is_estimate() && (count - 6000.0).abs() < NEAR * 6000.0 + 300.0,
        "{count}"
    );
    assert_eq!(pressure.first_s, Figure::Exact(1_700_000_000.0));
}

#[test]
fn a_doppler_log_is_surveyed_by_ensembles() {
    let Some(path) = data("formats/pd0/RDI_withBT.000") else { return };
    let survey = surveyed(&path);
    assert!(in_parts(&survey));
    let whole = read(&path, &ReadOptions::default()).unwrap();
    for seen in survey.channels() {
        let all = whole.channel(&seen.read.column).unwrap();
        is_part(&seen.read, all);
        // Bottom lock is lost now and then, also at the start.
        let first_s = all.time_s()[0];
        assert!(seen.first_s.is_estimate() || seen.first_s.value() == first_s);
    }
    let heading = survey.channels().iter().find(|c| c.read.name == "heading").unwrap();
    let count = whole.channel("heading").unwrap().len() as f64;
    // A dozen ensembles in each part.
    assert!((heading.count.value() as f64 - count).abs() < 0.1 * count, "{:?}", heading.count);
}

#[test]
fn a_small_file_is_read_completely() {
    let Some(made) = made("survey") else { return };
    let path = made.file("log.csv");
    let survey = survey(&path, &ReadOptions::default(), Thoroughness::default()).unwrap();
    let whole = read(&path, &ReadOptions::default()).unwrap();
    let [file] = survey.files() else { panic!("one file") };
    assert_eq!(file.sha256.as_ref(), Some(&whole.sources()[0].sha256));
    assert!(file.parts.is_none());
    agrees(&path, &survey, 0.0);
    assert!(survey.channels().iter().all(|channel| !channel.count.is_estimate()));
}

#[test]
fn a_file_that_is_cut_off_is_surveyed_up_to_the_cut() {
    let Some(made) = made("survey") else { return };
    for name in ["log.BIN", "log.tlog"] {
        let bytes = std::fs::read(made.file(name)).unwrap();
        let cut = Sample::new(name, &bytes[..bytes.len() - 5]);
        let survey = surveyed(cut.path());
        assert!(in_parts(&survey), "{name}");
        let whole = read(cut.path(), &ReadOptions::default()).unwrap();
        let words = |notes: &[seaplant_log::Note]| {
            let all = notes.iter().map(ToString::to_string);
            all.filter(|note| note.contains("cut off")).collect::<Vec<_>>()
        };
        assert_eq!(words(survey.notes()), words(whole.notes()));
        assert_eq!(words(survey.notes()).len(), 1);
    }
    // The index is at the end: everything before the truncation is read.
    for name in ["log.mcap", "log.bag", "log.db3"] {
        let bytes = std::fs::read(made.file(name)).unwrap();
        let cut = Sample::new(name, &bytes[..bytes.len() / 2]);
        let survey = surveyed(cut.path());
        assert!(survey.files()[0].parts.is_none(), "{name}");
        agrees(cut.path(), &survey, 0.0);
    }
}

/// Makes a table of 40 000 rows; `row` gives the text of each.
fn table(row: impl Fn(usize) -> String) -> Sample {
    let rows: String = (0..40_000).map(row).collect();
    Sample::new("log.csv", format!("time [s],u [m/s],what\n{rows}"))
}

#[test]
fn a_table_with_cells_of_several_lines_is_read_completely() {
    let sample = table(|k| match k % 50 {
        0 => format!("{k},1.5,\"dive\n{k},9,9\"\n"),
        _ => format!("{k},1.5,\n"),
    });
    let survey = surveyed(sample.path());
    assert!(survey.files()[0].parts.is_none());
    let u = &survey.channels()[0];
    assert_eq!((u.read.min(), u.read.max()), (Some(1.5), Some(1.5)));
}

#[test]
fn a_note_on_a_line_that_cannot_be_counted_names_none() {
    let sample = table(|k| match k {
        39_990 => format!("{k},1.5,3,4\n"),
        _ => format!("{k},1.5,3\n"),
    });
    let survey = surveyed(sample.path());
    assert!(in_parts(&survey));
    let notes: Vec<String> = survey.notes().iter().map(ToString::to_string).collect();
    let [note] = &notes[..] else { panic!("{notes:?}") };
    let expected = "log.csv: in the parts that were read, 1 row does not have 3 cells (here 4); \
                    absent cells count as missing, further ones are dropped";
    assert_eq!(without_folder(note, sample.path()), expected);
}

#[test]
fn a_clock_that_steps_between_parts_is_read_completely() {
    let sample = table(|k| format!("{},1.5,3\n", if k < 20_000 { k } else { k - 8_000 }));
    let error = survey(sample.path(), &ReadOptions::default(), HOW).unwrap_err();
    let whole = read(sample.path(), &ReadOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), whole.to_string());
}

#[test]
fn damage_in_a_part_causes_a_complete_reading() {
    let Some(made) = made("survey") else { return };
    for name in ["log.BIN", "log.mcap", "log.bag"] {
        let mut bytes = std::fs::read(made.file(name)).unwrap();
        // In the first part, after the header of a bag, across several records.
        bytes[7_000..7_200].fill(0x55);
        let damaged = Sample::new(name, bytes);
        let survey = surveyed(damaged.path());
        assert!(survey.files()[0].parts.is_none(), "{name}");
        let notes: Vec<String> = survey.notes().iter().map(ToString::to_string).collect();
        assert!(notes.iter().any(|note| note.contains("damaged")), "{name}: {notes:?}");
    }
}
