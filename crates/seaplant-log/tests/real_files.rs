//! Logs measured by third parties. They are looked for in the folder in `SEAPLANT_DATA`, relative
//! to the workspace, else in `../shared/data`; a test whose files are absent reports it.

use std::path::{Path, PathBuf};

use seaplant_log::{Dimension, Error, Note, ReadOptions, Unit, read, read_table};

use crate::common::{data, notes, open};

fn files_in(folder: &str, extension: &str) -> Vec<PathBuf> {
    let Some(folder) = data(folder) else { return Vec::new() };
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        entries.filter(|p| p.extension().is_some_and(|e| e == extension)).collect();
    files.sort();
    files
}

/// Reads a column of a spreadsheet export with the simplest possible reader.
fn plainly(path: &Path, column: usize) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap();
    let cells = text.lines().skip(1).map(|line| line.split(',').nth(column).unwrap_or_default());
    cells.filter_map(|cell| cell.trim().parse().ok()).filter(|x: &f64| x.is_finite()).collect()
}

#[test]
fn every_log_reads_as_a_plain_reader_has_it() {
    for folder in ["bolt-auv", "esso-osaka", "t200-dynamics"] {
        for path in files_in(folder, "csv") {
            let log = open(&path);
            for (k, channel) in log.channels().iter().enumerate() {
                assert_eq!(channel.values(), plainly(&path, k + 1), "{}", path.display());
                assert!(channel.unit.is_some(), "{}", channel.column);
            }
            assert_eq!(log.channels()[0].time_s(), plainly(&path, 0), "{}", path.display());
        }
    }
}

#[test]
fn rows_of_nothing_are_dropped_and_counted() {
    let Some(path) = data("esso-osaka/zigzag_31-Jul-2020_13_50_28.csv") else { return };
    let log = open(&path);
    assert!(matches!(log.notes(), [Note::MissingTime { count: 327, first_line: 1703, .. }]));
    assert!(notes(&log)[0].ends_with(":1703: 327 rows have no readable time; dropped"));
    assert_eq!(log.channels().len(), 12);
    for channel in log.channels() {
        assert_eq!((channel.len(), channel.missing), (1701, 327), "{}", channel.column);
        assert!(channel.shares_time_with(&log.channels()[0]));
    }
}

#[test]
fn the_units_of_the_tanker_are_known() {
    for path in files_in("esso-osaka", "csv") {
        let log = open(&path);
        for (name, symbol, dimension) in [
            ("u_velo", "m/s", Dimension::Velocity),
            ("psi_hat", "rad", Dimension::Angle),
            ("r_angvelo", "rad/s", Dimension::AngularVelocity),
            ("n_prop", "rps", Dimension::AngularVelocity),
            ("delta_rudder", "rad", Dimension::Angle),
        ] {
            let channel = log.channel(name).unwrap();
            let unit = channel.unit.as_ref().unwrap();
            assert_eq!((unit.symbol(), unit.dimension()), (symbol, dimension));
            // Times are printed to 0.1 s.
            assert!((channel.rate_hz().unwrap() - 10.0).abs() < 1e-9);
        }
    }
}

#[test]
fn pulses_and_pounds_of_the_thruster_log_are_read() {
    for path in files_in("t200-dynamics", "csv") {
        let log = open(&path);
        let input = log.channel("input").unwrap();
        let force = log.channel("force (lb)").unwrap();
        assert_eq!(input.len(), 15_001);
        assert_eq!(input.unit.as_ref().unwrap().dimension(), Dimension::PulseWidth);
        assert!(input.min().unwrap() >= 1600.0 && input.max().unwrap() <= 1900.0);
        let pound = force.unit.as_ref().unwrap().resolve(Dimension::Force).unwrap();
        assert!((pound.factor() - 4.448_221_615).abs() < 1e-8);
    }
}

#[test]
fn bench_tables_are_read_without_time() {
    for path in files_in("t200-static", "csv") {
        let table = read_table(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((table.rows(), table.columns.len()), (201, 7), "{}", path.display());
        let pulse = table.column("PWM").unwrap();
        assert_eq!(pulse.unit.as_ref().unwrap().dimension(), Dimension::PulseWidth);
        assert_eq!((pulse.values[0], pulse.values[200]), (Some(1100.0), Some(1900.0)));
        let force = table.column("Force (Kg f)").unwrap();
        assert_eq!(force.unit.as_ref().map(Unit::dimension), Some(Dimension::Force));
        assert_eq!(force.missing(), 0);
        let error = read(&path, &ReadOptions::default()).unwrap_err();
        let Error::NoTime { columns, .. } = error else { panic!("{error}") };
        assert_eq!(columns.len(), 7);
    }
}

#[test]
fn workbooks_hold_what_their_twins_in_csv_hold() {
    for path in files_in("bolt-auv", "xlsx") {
        let twin = path.with_extension("csv");
        let name = twin.file_name().unwrap().to_str().unwrap().to_lowercase();
        let (workbook, text) = (open(&path), open(&path.with_file_name(name)));
        // The workbooks also number their rows, in a column without a name.
        assert_eq!(workbook.channels().len(), text.channels().len() + 1);
        assert_eq!(workbook.channels()[0].column, "column 1");
        for expected in text.channels() {
            let found = workbook.channel(&expected.name).unwrap();
            assert_eq!(found.time_s(), expected.time_s(), "{}: {}", path.display(), found.name);
            assert_eq!(found.values(), expected.values(), "{}: {}", path.display(), found.name);
        }
        assert_eq!(notes(&workbook), [""; 0]);
    }
}
