//! MATLAB files of both kinds, and other HDF5 files.

use std::path::Path;

use seaplant_log::{Log, ReadOptions, read};

use crate::common::python::made;
use crate::common::{Sample, notes, open, options, without_folder};

fn failure(path: &Path) -> String {
    without_folder(&read(path, &ReadOptions::default()).unwrap_err().to_string(), path)
}

const ASSUMED: [&str; 2] = [
    "the time column \"t\" states no unit; seconds assumed, so a row every 0.100000 s",
    "the time column \"dvl.time\" states no unit; seconds assumed, so a row every 0.020000 s",
];

/// Fields left out of the logs of every version, with the reasons.
const LEFT_OUT: [&str; 7] = [
    "\"steps\" is a cell array: save what it holds as variables of their own; left out",
    "\"mass\" is a single number; left out",
    "\"grid\" is a sparse matrix; left out",
    "\"none\" is empty; left out",
    "\"gains\" is not as long as its vector of times; left out",
    "\"echo\" holds complex numbers; left out",
    "\"vehicle\" holds text; left out",
];

/// Returns the notes of a file without its name, sorted.
fn sorted_notes(log: &Log, name: &str) -> Vec<String> {
    let mut notes: Vec<String> = notes(log);
    notes.iter_mut().for_each(|note| *note = note.replace(&format!("{name}: "), ""));
    notes.sort();
    notes
}

fn sorted(of: &[&[&str]]) -> Vec<String> {
    let mut all: Vec<String> = of.concat().into_iter().map(str::to_owned).collect();
    all.sort();
    all
}

#[test]
fn version_5_is_read_as_scipy_wrote_it() {
    let Some(made) = made("matlab") else { return };
    for name in ["v5.mat", "v7.mat"] {
        let log = open(&made.file(name));
        made.agrees(name, &log, 0.0);
        assert_eq!(log.sources()[0].format, "MATLAB");
        let structs = ["\"thrusters\" is an array of structs: save one struct of arrays; left out"];
        assert_eq!(sorted_notes(&log, name), sorted(&[&ASSUMED, &LEFT_OUT, &structs]));
        assert_eq!(log.channel("c_float32").unwrap().missing, 1);
        assert!(
            log.channel("dvl.u")
                .unwrap()
                .shares_time_with(log.channel("dvl.beams.ranges(:,2)").unwrap())
        );
    }
}

#[test]
fn version_7_3_is_read_as_h5py_wrote_it() {
    let Some(made) = made("matlab") else { return };
    let log = open(&made.file("v73.mat"));
    made.agrees("v73.mat", &log, 0.0);
    assert_eq!(log.sources()[0].format, "MATLAB 7.3");
    let others = [
        "\"thrusters.x\" is an array of structs: save one struct of arrays; left out",
        "\"trials\" is an object, such as a table, timetable, datetime or string: save its columns \
         as arrays of numbers, times by posixtime or seconds; left out",
    ];
    assert_eq!(sorted_notes(&log, "v73.mat"), sorted(&[&ASSUMED, &LEFT_OUT, &others]));
}

#[test]
fn the_other_byte_order_is_read() {
    let Some(made) = made("matlab") else { return };
    made.agrees("big.mat", &open(&made.file("big.mat")), 0.0);
}

#[test]
fn time_is_had_by_any_name() {
    let Some(made) = made("matlab") else { return };
    let path = made.file("named.mat");
    assert_eq!(
        failure(&path),
        "named.mat: no column is recognised as time; name it in campaign.toml under [time], or \
         give an equal sampling rate there if the rows are equally spaced; the columns are \"u\", \
         \"ms\", \"log.v\""
    );
    // Rounding error of a conversion to milliseconds and back, s.
    made.agrees("named.mat", &read(&path, &options("ms", Some("ms"))).unwrap(), 1e-6);
    let error = read(&path, &options("mss", None)).unwrap_err().to_string();
    assert!(
        error.contains("no column \"mss\"") && error.contains("did you mean \"ms\""),
        "{error}"
    );
}

#[test]
fn time_may_be_a_column_of_a_matrix() {
    let Some(made) = made("matlab") else { return };
    let path = made.file("matrix.mat");
    assert!(failure(&path).ends_with("the columns are \"log(:,1)\", \"nav.rows(:,1)\""));
    let log = read(&path, &options("log(:,1)", Some("s"))).unwrap();
    made.agrees("matrix.mat", &log, 0.0);
    assert_eq!(
        notes(&log),
        ["matrix.mat: \"nav.rows\" is not as long as its vector of times; left out"]
    );
    let log = read(&path, &options("nav.rows(1,:)", Some("s"))).unwrap();
    made.agrees("matrix.mat/rows", &log, 0.0);
}

#[test]
fn days_of_the_calendar_are_seconds_since_1970() {
    let Some(made) = made("matlab") else { return };
    let log = open(&made.file("days.mat"));
    // Resolution of days since the year 0 in a double, 10 us, in s.
    made.agrees("days.mat", &log, 1e-5);
    assert_eq!(
        notes(&log),
        ["days.mat: times are days of the calendar in \"time\" (datenum), taken as UTC: seconds \
          since the Unix epoch"]
    );
}

#[test]
fn equal_sampling_is_of_the_commonest_length() {
    let Some(made) = made("matlab") else { return };
    let equal = ReadOptions { equal_sampling_hz: Some(4.0), ..ReadOptions::default() };
    let log = read(&made.file("even.mat"), &equal).unwrap();
    made.agrees("even.mat", &log, 0.0);
    assert_eq!(notes(&log), ["even.mat: \"odd\" is not as long as most others; left out"]);
}

#[test]
fn columns_of_hdf5_are_channels_too() {
    let Some(made) = made("matlab") else { return };
    let log = open(&made.file("log.h5"));
    made.agrees("log.h5", &log, 0.0);
    assert_eq!(
        notes(&log),
        [
            "log.h5: \"imu.name\" holds text; left out",
            "log.h5: each of 2 fields was not written, or in part only; left out: \"imu.begun\", \
             \"imu.planned\""
        ]
    );
}

#[test]
fn a_file_that_is_cut_gives_the_variables_before() {
    let Some(made) = made("matlab") else { return };
    let bytes = std::fs::read(made.file("v5.mat")).unwrap();
    let whole = open(&made.file("v5.mat"));
    let sample = Sample::new("v5.mat", &bytes[..bytes.len() - 9000]);
    let log = open(sample.path());
    let count = log.channels().len();
    assert!(count > 10 && count < whole.channels().len(), "{count} channels");
    for (found, expected) in log.channels().iter().zip(whole.channels()) {
        assert_eq!((&found.column, found.values()), (&expected.column, expected.values()));
    }
    let note = &notes(&log)[0];
    assert!(note.starts_with("v5.mat: the file is cut off in the record at byte "), "{note}");
}

#[test]
fn a_damaged_variable_costs_no_other() {
    let Some(made) = made("matlab") else { return };
    let mut bytes = std::fs::read(made.file("v7.mat")).unwrap();
    // The second element is a variable: the first starts after the header.
    let length = u32::from_le_bytes(bytes[132..136].try_into().unwrap()) as usize;
    let second = 128 + 8 + length;
    let size = u32::from_le_bytes(bytes[second + 4..second + 8].try_into().unwrap());
    bytes[second + 8..second + 16].fill(0xff);
    let sample = Sample::new("v7.mat", &bytes);
    let log = open(sample.path());
    assert_eq!(log.channels().len() + 1, open(&made.file("v7.mat")).channels().len());
    assert_eq!(
        notes(&log)[0],
        format!(
            "v7.mat: 1 stretch is damaged, the first at byte {second}; {} bytes skipped",
            size + 8
        )
    );
}

#[test]
fn a_damaged_matlab_file_is_refused() {
    let sample = Sample::new("log.mat", [b"MATLAB 5.0 MAT-file".as_slice(), &[b' '; 109]].concat());
    assert_eq!(
        failure(sample.path()),
        "log.mat cannot be read as a MATLAB file: at byte 0, the header does not say in which \
         order bytes are, as version 5 and later do; copy the file again from where it was \
         recorded, or export it as CSV"
    );
    let Some(made) = made("matlab") else { return };
    let bytes = std::fs::read(made.file("v73.mat")).unwrap();
    let sample = Sample::new("v73.mat", &bytes[..2000]);
    let message = failure(sample.path());
    assert!(
        message.starts_with("v73.mat cannot be read as an HDF5 file or a MATLAB 7.3 file: "),
        "{message}"
    );
}

#[test]
fn files_that_matlab_wrote_are_read_as_scipy_has_them() {
    let Some(made) = made("matlab") else { return };
    let equal = ReadOptions { equal_sampling_hz: Some(1.0), ..ReadOptions::default() };
    for kind in ["double", "matrix"] {
        for version in ["6.1_SOL2", "6.5.1_GLNX86", "7.1_GLNX86", "7.4_GLNX86"] {
            let name = format!("test{kind}_{version}.mat");
            let log = read(&made.file(&name), &equal).unwrap_or_else(|error| panic!("{error}"));
            made.agrees(&name, &log, 0.0);
        }
    }
    // Written by MATLAB 7.4, of 2007, in an early form of HDF5 that the library does not support.
    let message = failure(&made.file("testhdf5_7.4_GLNX86.mat"));
    assert!(message.contains("\"testdouble\" is damaged, or stored in a way of HDF5"), "{message}");
}

#[test]
fn content_that_is_not_numeric_is_reported() {
    let Some(made) = made("matlab") else { return };
    assert_eq!(
        failure(&made.file("table.mat")),
        "table.mat is a file of arrays without a series of numbers (\"trials\" is an object, such \
         as a table, timetable, datetime or string: save its columns as arrays of numbers, times by \
         posixtime or seconds), which is not supported; save each series as an array of numbers, with \
         one of times beside it"
    );
    let message = failure(&made.file("datetime.mat"));
    assert!(
        message.contains("without a vector of times (\"t\" is an object, such as a table"),
        "{message}"
    );
}
