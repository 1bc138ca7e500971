//! Checks every error by its message.

use std::path::Path;

use seaplant_log::{Error, Log, ReadOptions, read, read_table};

use crate::common::{Sample, failure, failure_with, options, read_text, without_folder};

const THREE_ROWS: &str = "time [s],u [m/s]\n0,1\n1,2\n2,3\n";

#[test]
fn a_file_that_is_not_there_is_reported_with_its_path() {
    let error = read(Path::new("no-such-folder/log.csv"), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::Io { .. }));
    let message = error.to_string();
    assert!(message.starts_with("cannot read no-such-folder/log.csv: "), "{message}");
    assert!(message.ends_with("; check the spelling and the folder"), "{message}");
}

#[test]
fn a_file_that_may_not_be_read_says_so() {
    let source = std::io::Error::from(std::io::ErrorKind::PermissionDenied);
    let message = Error::Io { path: "log.csv".into(), source }.to_string();
    assert!(message.starts_with("cannot read log.csv: "), "{message}");
    assert!(message.ends_with("; allow this account to read it"), "{message}");
}

#[test]
fn a_folder_is_not_a_log() {
    let folder = tempfile::tempdir().unwrap();
    let error = read(folder.path(), &ReadOptions::default()).unwrap_err();
    let expected = format!("{} is a folder; name the log file inside it", folder.path().display());
    assert_eq!(error.to_string(), expected);
}

#[test]
fn no_file_at_all_is_refused() {
    let error = Log::open(&[]).unwrap_err();
    assert_eq!(error.to_string(), "no log file was given; name at least one");
}

#[test]
fn binary_files_are_named_by_their_format() {
    let tar = [&[b'a'; 257][..], b"ustar\0"].concat();
    let cases: [(&[u8], &str); 8] = [
        (b"PK\x03\x04....", "a zip archive (unpack it first)"),
        (b"\xd0\xcf\x11\xe0....", "an Excel workbook of the old kind (.xls) or with a password"),
        (
            b"PK\x03\x04..........................mimetypeapplication/vnd.oasis.opendocument",
            "an OpenDocument file",
        ),
        (b"\x93NUMPY\x01\0", "a NumPy array"),
        (&tar, "a tar archive (unpack it first)"),
        (b"CDF\x01....", "a NetCDF file"),
        (b"BZh9", "a bzip2 archive (unpack it first)"),
        (b"time,u\n0,\0\n", "binary data"),
    ];
    for (bytes, name) in cases {
        let expected = format!("log.csv: unsupported format (looks like {name}); export it as CSV");
        assert_eq!(failure(bytes), expected);
    }
}

#[test]
fn an_empty_file_and_one_of_blank_lines_are_empty() {
    for content in ["", "\n\n  \r\n", "\u{feff}"] {
        assert_eq!(
            failure(content),
            "log.csv is empty; check that the recording was saved and copied whole"
        );
    }
}

#[test]
fn prose_is_not_a_table() {
    assert_eq!(
        failure("We went to the pool,\nand it rained.\n"),
        "log.csv holds no table: none of its first 2 rows is mostly numbers; give a CSV file with \
         one header row above rows of numbers"
    );
}

#[test]
fn numbers_without_a_header_are_refused_at_their_line() {
    assert_eq!(
        failure("\n0.0,1500,2\n0.1,1500,3\n"),
        "log.csv:2: the numbers start here without a header row above; add a first line that \
         names each of the 3 columns, units in brackets, such as \"time [s]\""
    );
}

#[test]
fn a_header_that_does_not_fit_its_rows_is_refused() {
    assert_eq!(
        failure("pool 3\ntime,u,v\n0,1,2,3\n1,1,2,3\n"),
        "log.csv:2: the header names 3 columns, but the rows from line 3 hold 4 cells, so names \
         and numbers cannot be matched; correct the header or put names that hold the separator \
         in quotes"
    );
}

#[test]
fn a_header_alone_and_a_single_row_are_distinguished() {
    let message = |rows, needed| {
        format!(
            "log.csv holds {rows} usable row(s) of data and at least {needed} are needed; check \
             that the recording was saved and copied whole"
        )
    };
    assert_eq!(failure("time [s],u [m/s]\n"), message(0, 1));
    assert_eq!(failure("time [s],u [m/s]\n0.0,1.0\n"), message(1, 2));
    assert_eq!(failure("time [s],u [m/s]\n5,1.0\n5,2.0\n"), message(1, 2));
}

#[test]
fn a_table_needs_one_row_only() {
    let sample = Sample::new("curve.csv", "PWM (us),Force (N)\n1500,0\n");
    assert_eq!(read_table(sample.path()).unwrap().rows(), 1);
    let sample = Sample::new("curve.csv", "PWM (us),Force (N)\n");
    let error = read_table(sample.path()).unwrap_err();
    assert!(matches!(error, Error::TooFewRows { rows: 0, needed: 1, .. }));
}

#[test]
fn a_quote_that_nothing_closes_is_found_at_its_line() {
    let message = |line| {
        format!(
            "log.csv:{line}: a quotation mark opens here and is never closed, so the rest of the \
             file is one cell; close or remove it"
        )
    };
    let rows = "0,1\n1,2\n2,3\n";
    assert_eq!(failure(format!("time,u\n{rows}3,\"4\n5,6\n")), message(5));
    assert_eq!(failure(format!("time,u\r\n{rows}3,\"4\r\n5,6")), message(5));
    assert_eq!(failure(format!("time,\"u\n{rows}")), message(1));
    let closed = read_text(format!("time,u,remark\n{rows}3,4,\"two\nlines\"")).unwrap();
    assert_eq!(closed.channel("u").unwrap().len(), 4);
}

#[test]
fn a_log_without_time_lists_its_columns_and_the_ways_out() {
    assert_eq!(
        failure("rpm,u [m/s]\n0,1\n1,2\n"),
        "log.csv: no column is recognised as time; name it in campaign.toml under [time], or give \
         an equal sampling rate there if the rows are equally spaced; the columns are \"rpm\", \
         \"u [m/s]\""
    );
}

#[test]
fn a_unit_that_is_not_of_time_is_refused_for_time() {
    let of = |column, unit| failure_with(THREE_ROWS, &options(column, unit));
    let message = |column, unit| {
        format!(
            "log.csv: the time column \"{column}\" has the unit \"{unit}\", which is not one of \
             time; write one of s, ms, us, ns, min, h"
        )
    };
    assert_eq!(of("u", None), message("u [m/s]", "m/s"));
    assert_eq!(of("time", Some("fortnight")), message("time [s]", "fortnight"));
}

#[test]
fn a_time_column_that_is_not_there_is_suggested() {
    assert_eq!(
        failure_with(THREE_ROWS, &options("tme", None)),
        "no column \"tme\" in log.csv; did you mean \"time [s]\"? the columns are \"time [s]\", \
         \"u [m/s]\""
    );
}

#[test]
fn times_that_cannot_be_read_are_shown() {
    assert_eq!(
        failure("time,u,v\nnoon,1,2\nlater,2,3\n"),
        "log.csv:2: the time column \"time\" holds no readable time (here \"noon\"); give numbers \
         or ISO 8601 such as 2020-07-31T13:50:28.5Z"
    );
}

#[test]
fn a_clock_that_was_reset_is_refused_where_it_was() {
    let mut text = "time [s],u [m/s]\n".to_owned();
    for k in 0..60 {
        text.push_str(&format!("{},{k}\n", if k < 40 { 100 + k } else { k - 40 }));
    }
    let message = "log.csv:42: time goes back from 139 s to 0 s and stays behind; split the file \
                   there, correct the row before if its time is wrong, or name another time column in campaign.toml under [time]";
    assert_eq!(failure(&text), message);

    // The second clock overtakes the first, so that the log ends on its latest time.
    let mut text = "time [s],u [m/s]\n".to_owned();
    for k in 0..60 {
        text.push_str(&format!("{},{k}\n", if k < 40 { 100 + k } else { 105 + 3 * (k - 40) }));
    }
    assert!(failure(&text).starts_with("log.csv:42: time goes back from 139 s to 105 s"));
}

#[test]
fn options_that_cannot_be_are_refused() {
    let rate = |rate| ReadOptions { equal_sampling_hz: Some(rate), ..ReadOptions::default() };
    for (found, shown) in [(0.0, "0"), (-10.0, "-10"), (f64::NAN, "NaN")] {
        let expected = format!(
            "log.csv: the sampling rate is {shown}, and must be a positive number of hertz"
        );
        assert_eq!(failure_with(THREE_ROWS, &rate(found)), expected);
    }
    let both = ReadOptions { equal_sampling_hz: Some(10.0), ..options("time", None) };
    assert_eq!(
        failure_with(THREE_ROWS, &both),
        "log.csv: the sampling rate is 10, and must be left out where a time column is named"
    );
    let offset = ReadOptions { offset_s: f64::INFINITY, ..ReadOptions::default() };
    assert_eq!(
        failure_with(THREE_ROWS, &offset),
        "log.csv: the time offset is inf, and must be a finite number of seconds"
    );
    let lost = ReadOptions { offset_s: 1e300, ..rate(10.0) };
    assert_eq!(
        failure_with(THREE_ROWS, &lost),
        "log.csv: the sampling rate is 10, and must be such that rows differ in time"
    );
}

#[test]
fn an_unknown_column_is_answered_with_the_nearest_and_the_first_twelve() {
    let names: Vec<String> = (1..=15).map(|k| format!("T{k} (us)")).collect();
    let row = vec!["1500"; 15].join(",");
    let text = format!("time [s],u_velo [m/s],{}\n0,1,{row}\n1,2,{row}\n", names.join(","));
    let sample = Sample::new("esso.csv", text);
    let log = read(sample.path(), &ReadOptions::default()).unwrap();
    let message = log.channel("u_vel").unwrap_err().to_string();
    let message = without_folder(&message, sample.path());
    assert!(
        message.starts_with(
            "no column \"u_vel\" in esso.csv; did you mean \"u_velo [m/s]\"? the columns are \
             \"u_velo [m/s]\", \"T1 (us)\", "
        ),
        "{message}"
    );
    assert!(message.ends_with("\"T11 (us)\" and 4 more"), "{message}");
    let message = log.channel("qqq").unwrap_err().to_string();
    assert!(!message.contains("did you mean"), "{message}");
}

#[test]
fn a_name_in_two_files_requires_the_file() {
    let a = Sample::new("dvl.csv", THREE_ROWS);
    let b = Sample::new("nav.csv", THREE_ROWS);
    let files = [&a, &b].map(|s| (s.path().to_owned(), ReadOptions::default()));
    let log = Log::open(&files).unwrap();
    assert_eq!(
        log.channel("u").unwrap_err().to_string(),
        "column \"u\" is ambiguous; write FILE:COLUMN with the header's full text: \
         dvl.csv:u [m/s] or nav.csv:u [m/s]"
    );
    for name in ["nav.csv:u", "nav:u [m/s]", "nav : U"] {
        assert_eq!(log.channel(name).unwrap().source, 1, "{name}");
    }
    let message = log.channel("nav:w").unwrap_err().to_string();
    let message = without_folder(&message, b.path());
    assert_eq!(message, "no column \"w\" in nav.csv; the columns are \"u [m/s]\"");
}

#[test]
fn files_of_one_name_are_distinguished_by_their_folders() {
    let a = Sample::new("dvl.csv", THREE_ROWS);
    let b = Sample::new("dvl.csv", THREE_ROWS);
    let files = [&a, &b].map(|s| (s.path().to_owned(), ReadOptions::default()));
    let log = Log::open(&files).unwrap();
    let Err(Error::Ambiguous { choices, .. }) = log.channel("dvl:u") else {
        panic!("two files are called dvl.csv");
    };
    assert_eq!(choices[1], format!("{}:u [m/s]", b.path().display()));
    assert_eq!(log.channel(&choices[1]).unwrap().source, 1);
}

#[test]
fn a_column_without_a_value_is_not_called_unknown() {
    let sample = Sample::new("log.csv", "time [s],u [m/s],mode\n0,NaN,MANUAL\n1,,AUTO\n2,NA,\n");
    let log = read(sample.path(), &ReadOptions::default()).unwrap();
    let message = |name| without_folder(&log.channel(name).unwrap_err().to_string(), sample.path());
    assert_eq!(
        message("u"),
        "column \"u [m/s]\" of log.csv is empty: no value in any of its 3 rows; choose another, \
         or check that the instrument was on"
    );
    assert_eq!(
        message("mode"),
        "log.csv:2: column \"mode\" holds text such as \"MANUAL\" and no number; choose another"
    );
    let table = read_table(sample.path()).unwrap();
    assert!(matches!(table.column("u"), Err(Error::AllMissing { rows: 3, .. })));
    assert!(matches!(table.column("mode"), Err(Error::AllText { line: 2, .. })));
    assert!(matches!(table.column("w"), Err(Error::NoChannel { .. })));
}
