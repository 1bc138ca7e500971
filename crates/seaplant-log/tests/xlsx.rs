//! Excel workbooks.

use std::io::{Cursor, Write};
use std::path::Path;

use seaplant_log::{ReadOptions, read, read_bytes, read_table};
use zip::write::SimpleFileOptions;

use crate::common::python::made;
use crate::common::{Sample, notes, open, without_folder};

#[test]
fn a_sheet_is_read_as_openpyxl_wrote_it() {
    let Some(made) = made("xlsx") else { return };
    let log = open(&made.file("log.xlsx"));
    made.agrees("log.xlsx", &log, 0.0);
    assert_eq!(log.sources()[0].format, "Excel workbook, sheet \"Dive 12\"");
    let u = log.channel("u").unwrap();
    assert_eq!((u.missing, u.len() + u.missing), (400 - u.len(), 400));
    assert_eq!(
        notes(&log),
        [
            "log.xlsx: the first sheet, \"Dive 12\", is read, and not \"Ballast\"",
            "log.xlsx:5: column \"state\" holds text (here \"idle\"); left out",
        ]
    );
}

#[test]
fn a_sheet_is_had_by_its_name() {
    let Some(made) = made("xlsx") else { return };
    let path = made.file("log.xlsx");
    let named = |sheet: &str| {
        read(&path, &ReadOptions { sheet: Some(sheet.to_owned()), ..ReadOptions::default() })
    };
    for sheet in ["Ballast", "ballast"] {
        let log = named(sheet).unwrap();
        made.agrees("log.xlsx/Ballast", &log, 0.0);
        assert_eq!(notes(&log), [""; 0]);
    }
    assert_eq!(
        without_folder(&named("Plot").unwrap_err().to_string(), &path),
        "log.xlsx has no sheet \"Plot\"; its sheets are \"Hidden\", \"Dive 12\", \"Ballast\""
    );
}

#[test]
fn date_cells_are_times() {
    /// Resolution of days since 1900 in a double, and rounding to the nearest microsecond, s.
    const RESOLUTION_S: f64 = 1.5e-6;
    let Some(made) = made("xlsx") else { return };
    for name in ["dates.xlsx", "dates-1904.xlsx", "day.xlsx", "spans.xlsx"] {
        let log = open(&made.file(name));
        made.agrees(name, &log, RESOLUTION_S);
        assert_eq!(notes(&log), [""; 0], "{name}");
    }
}

#[test]
fn texts_in_a_table_of_their_own_are_found() {
    let Some(made) = made("xlsx") else { return };
    let log = open(&made.file("shared.xlsx"));
    made.agrees("shared.xlsx", &log, 0.0);
    assert_eq!(
        notes(&log),
        [
            "shared.xlsx:2: column \"state\" holds text (here \"dives\"); left out",
            "shared.xlsx:2: column \"when\" holds text (here \"2020-07-31T13:50:28.5Z\"); left out",
        ]
    );
}

#[test]
fn a_stray_cell_far_away_costs_nothing() {
    let Some(made) = made("xlsx") else { return };
    let log = open(&made.file("far.xlsx"));
    made.agrees("far.xlsx", &log, 0.0);
    assert_eq!(
        notes(&log),
        ["far.xlsx:1048576: 1 row holds a single cell (here \"end\"); skipped"]
    );
}

#[test]
fn a_workbook_may_hold_a_table_without_time() {
    let Some(made) = made("xlsx") else { return };
    let table = read_table(&made.file("log.xlsx")).unwrap();
    assert_eq!((table.rows(), table.line(0), table.header_line), (400, 5, 3));
}

#[test]
fn a_sheet_without_a_table_is_refused() {
    let Some(made) = made("xlsx") else { return };
    let path = made.file("empty.xlsx");
    let error = read(&path, &ReadOptions::default()).unwrap_err();
    assert_eq!(
        without_folder(&error.to_string(), &path),
        "empty.xlsx holds no table: none of its first 0 rows is mostly numbers; give a CSV file \
         with one header row above rows of numbers"
    );
}

#[test]
fn a_workbook_that_is_cut_is_refused() {
    let Some(made) = made("xlsx") else { return };
    let bytes = std::fs::read(made.file("log.xlsx")).unwrap();
    let sample = Sample::new("log.xlsx", &bytes[..bytes.len() / 2]);
    let error = read(sample.path(), &ReadOptions::default()).unwrap_err();
    let message = without_folder(&error.to_string(), sample.path());
    assert!(message.starts_with("log.xlsx cannot be read as an Excel workbook: "), "{message}");
    assert!(
        message.ends_with("; copy the file again from where it was recorded, or export it as CSV"),
        "{message}"
    );
}

#[test]
fn a_part_that_swells_past_any_workbook_is_refused() {
    let mut workbook = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let packed = SimpleFileOptions::default();
    workbook.start_file("[Content_Types].xml", packed).unwrap();
    workbook.start_file("xl/sharedStrings.xml", packed).unwrap();
    workbook.write_all(&vec![b' '; 100 << 20]).unwrap();
    let bytes = workbook.finish().unwrap().into_inner();
    let error = read_bytes(Path::new("log.xlsx"), &bytes, &ReadOptions::default()).unwrap_err();
    assert!(
        error
            .to_string()
            .ends_with("which is not plausible for a log; if it is one, unpack it first"),
        "{error}"
    );
}
