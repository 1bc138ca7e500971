//! Parquet and Arrow files.

use seaplant_log::{Error, ReadOptions, read, read_table};

use crate::common::python::made;
use crate::common::{Sample, notes, open, without_folder};

/// Resolution of seconds since 1970 in a double.
const RESOLUTION_S: f64 = 2.4e-7;

#[test]
fn every_type_is_read_as_pyarrow_wrote_it() {
    let Some(made) = made("arrow") else { return };
    for (name, format) in [("types.parquet", "Parquet"), ("types.feather", "Arrow IPC")] {
        let log = open(&made.file(name));
        made.agrees(name, &log, RESOLUTION_S);
        assert_eq!(log.sources()[0].format, format);
        let told = notes(&log);
        let expect = |note: &str| {
            let note = format!("{name}{note}");
            assert!(told.contains(&note), "{note} is not in {told:#?}");
        };
        expect(": \"ranges\" is a list; left out");
        expect(": \"blob\" holds raw bytes; left out");
        expect(": \"void\" has no value in any row; left out");
        assert!(told.iter().any(|note| note.contains("column \"text\" has ")), "{told:#?}");
        assert!(matches!(log.channel("ranges"), Err(Error::LeftOut { why: "is a list", .. })));
    }
}

#[test]
fn every_compression_and_layout_is_read() {
    let Some(made) = made("arrow") else { return };
    for name in [
        "old.parquet",
        "pages.parquet",
        "lz4.parquet",
        "plain.parquet",
        "legacy.parquet",
        "zstd.feather",
        "plain.arrow",
        "log.arrows",
    ] {
        let log = open(&made.file(name));
        made.agrees(name, &log, RESOLUTION_S);
        assert!(notes(&log).iter().all(|note| note.contains("coded text")), "{:?}", notes(&log));
    }
}

#[test]
fn time_is_an_instant_a_text_or_a_number() {
    let Some(made) = made("arrow") else { return };
    for name in ["index.parquet", "text.parquet", "seconds.parquet"] {
        let log = open(&made.file(name));
        made.agrees(name, &log, RESOLUTION_S);
        assert_eq!(notes(&log), [""; 0], "{name}");
    }
}

#[test]
fn an_arrow_file_that_is_cut_gives_the_batches_before_the_cut() {
    let Some(made) = made("arrow") else { return };
    let log = open(&made.file("cut.arrow"));
    made.agrees("cut.arrow", &log, RESOLUTION_S);
    let told = notes(&log);
    let cut = told.iter().filter(|note| note.starts_with("cut.arrow: the file is cut off in the"));
    assert_eq!(cut.count(), 1, "{told:?}");
}

#[test]
fn an_arrow_file_of_nothing_but_its_mark_is_refused() {
    for bytes in [&b"ARROW1"[..], b"ARROW1\0\0", b"ARROW1\0\0ARROW1"] {
        let sample = Sample::new("log.arrow", bytes);
        let error = read(sample.path(), &ReadOptions::default()).unwrap_err();
        assert!(matches!(error, Error::Damaged { .. }), "{error}");
    }
}

#[test]
fn a_parquet_file_that_is_cut_is_refused() {
    let Some(made) = made("arrow") else { return };
    let bytes = std::fs::read(made.file("old.parquet")).unwrap();
    let sample = Sample::new("log.parquet", &bytes[..bytes.len() - 9]);
    let error = read(sample.path(), &ReadOptions::default()).unwrap_err();
    assert_eq!(
        without_folder(&error.to_string(), sample.path()),
        "log.parquet cannot be read as a Parquet file: it is cut off, and the index at its end is \
         lost; copy the file again from where it was recorded, or export it as CSV"
    );
}

#[test]
fn damage_in_the_middle_leaves_the_rows_before_it() {
    let Some(made) = made("arrow") else { return };
    let mut bytes = std::fs::read(made.file("zstd.feather")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 2000].fill(0x5a);
    let sample = Sample::new("zstd.feather", bytes);
    let log = open(sample.path());
    // Batches are of 600 rows.
    let whole = made.expected("zstd.feather");
    for channel in log.channels() {
        let expected = whole.iter().find(|expected| expected.column == channel.column).unwrap();
        assert!(channel.len() + channel.missing == 600 || channel.len() + channel.missing == 1200);
        assert_eq!(channel.values(), &expected.values[..channel.len()]);
    }
    let told = notes(&log);
    let rows = told.iter().filter(|note| note.starts_with("zstd.feather: the rows from "));
    assert_eq!(rows.count(), 1, "{told:?}");
}

#[test]
fn a_page_that_claims_a_list_of_billions_is_not_believed() {
    let Some(made) = made("arrow") else { return };
    let mut bytes = std::fs::read(made.file("seed-none.parquet")).unwrap();
    // The first header, behind the mark: a list of 2³¹ − 1 doubles in place of its type.
    bytes[4..11].copy_from_slice(&[0x19, 0xf7, 0xff, 0xff, 0xff, 0xff, 0x07]);
    let sample = Sample::new("log.parquet", bytes);
    let error = read(sample.path(), &ReadOptions::default()).unwrap_err();
    assert_eq!(
        without_folder(&error.to_string(), sample.path()),
        "log.parquet cannot be read as a Parquet file: the headers of its pages are damaged; copy \
         the file again from where it was recorded, or export it as CSV"
    );
}

#[test]
fn a_row_group_with_damaged_headers_ends_the_rows() {
    let Some(made) = made("arrow") else { return };
    let mut bytes = std::fs::read(made.file("types.parquet")).unwrap();
    // Four groups of 700 rows at most: half of the file is within the second or third.
    let middle = bytes.len() / 2;
    bytes[middle..middle + 40_000].fill(0xff);
    let sample = Sample::new("types.parquet", bytes);
    let log = open(sample.path());
    let told = notes(&log);
    let cut = told.iter().find(|note| note.starts_with("types.parquet: the rows from "));
    assert!(
        cut.unwrap_or_else(|| panic!("{told:?}")).contains("headers of their pages"),
        "{cut:?}"
    );
    let whole = made.expected("types.parquet");
    for channel in log.channels() {
        let rows = channel.len() + channel.missing;
        assert!(rows == 700 || rows == 1400, "{rows}");
        let expected = whole.iter().find(|expected| expected.column == channel.column).unwrap();
        assert_eq!(channel.values(), &expected.values[..channel.len()], "{}", channel.column);
    }
}

#[test]
fn a_compression_that_is_not_read_is_named() {
    let Some(made) = made("arrow") else { return };
    let path = made.file("brotli.parquet");
    let error = read(&path, &ReadOptions::default()).unwrap_err();
    assert_eq!(
        without_folder(&error.to_string(), &path),
        "brotli.parquet is a Parquet file with BROTLI(BrotliLevel(1)) compression, which is not \
         supported; write it with zstd, snappy, gzip or lz4"
    );
}

#[test]
fn a_file_that_swells_past_any_log_is_refused() {
    let Some(made) = made("arrow") else { return };
    let error = read(&made.file("bomb.parquet"), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::TooMuch { .. }), "{error}");
}

#[test]
fn a_parquet_file_may_hold_a_table_without_time() {
    let Some(made) = made("arrow") else { return };
    let table = read_table(&made.file("old.parquet")).unwrap();
    assert_eq!((table.rows(), table.columns.len()), (2500, 4));
}
