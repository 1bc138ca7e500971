//! Logs in binary formats.

use std::io::{Cursor, Write};

use flate2::Compression;
use flate2::write::GzEncoder;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::workshop::{CAMPAIGN, Workshop};

fn gzip(text: &str) -> Vec<u8> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(text.as_bytes()).unwrap();
    packed.finish().unwrap()
}

/// Makes a workbook of sheets, each from comma-separated text: the minimum of the standard
/// (ECMA-376, part 1, 12.3.23 and 12.3.24).
fn workbook(sheets: &[(&str, &str)]) -> Vec<u8> {
    const MAIN: &str = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
    const DOCUMENT: &str = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    const PACKAGE: &str = "http://schemas.openxmlformats.org/package/2006/relationships";
    let mut book = ZipWriter::new(Cursor::new(Vec::new()));
    let mut part = |name: &str, text: String| {
        book.start_file(name, SimpleFileOptions::default()).unwrap();
        book.write_all(text.as_bytes()).unwrap();
    };
    let (mut entries, mut relations) = (String::new(), String::new());
    for (k, (name, text)) in sheets.iter().enumerate() {
        entries += &format!("<sheet name=\"{name}\" sheetId=\"{}\" r:id=\"r{k}\"/>", k + 1);
        relations += &format!(
            "<Relationship Id=\"r{k}\" Type=\"{DOCUMENT}/worksheet\" Target=\"worksheets/{k}.xml\"/>"
        );
        let cell = |cell: &str| match cell.parse::<f64>() {
            Ok(_) => format!("<c><v>{cell}</v></c>"),
            Err(_) => format!("<c t=\"inlineStr\"><is><t>{cell}</t></is></c>"),
        };
        let row =
            |line: &str| format!("<row>{}</row>", line.split(',').map(cell).collect::<String>());
        let rows: String = text.lines().map(row).collect();
        part(
            &format!("xl/worksheets/{k}.xml"),
            format!("<worksheet xmlns=\"{MAIN}\"><sheetData>{rows}</sheetData></worksheet>"),
        );
    }
    part(
        "xl/workbook.xml",
        format!(
            "<workbook xmlns=\"{MAIN}\" xmlns:r=\"{DOCUMENT}\"><sheets>{entries}</sheets></workbook>"
        ),
    );
    part(
        "xl/_rels/workbook.xml.rels",
        format!("<Relationships xmlns=\"{PACKAGE}\">{relations}</Relationships>"),
    );
    part(
        "_rels/.rels",
        format!(
            "<Relationships xmlns=\"{PACKAGE}\"><Relationship Id=\"r\" \
             Type=\"{DOCUMENT}/officeDocument\" Target=\"xl/workbook.xml\"/></Relationships>"
        ),
    );
    book.finish().unwrap().into_inner()
}

#[test]
fn a_log_gives_the_same_plant_packed_or_in_a_sheet() {
    let workshop = Workshop::new();
    let plants = |workshop: &Workshop| {
        let words = ["identify", "campaign.toml", "--method", "equation-error", "--json"];
        workshop.json(&words)["plants"].clone()
    };
    let expected = plants(&workshop);
    assert!(expected["surge"].is_object(), "{expected}");

    let text = workshop.read("log.csv");
    workshop.write("log.csv.gz", gzip(&text));
    workshop.write("campaign.toml", CAMPAIGN.replace("log.csv", "log.csv.gz"));
    assert_eq!(plants(&workshop), expected);

    let notes = "what,when\nfirst dive,today\n";
    workshop.write("log.xlsx", workbook(&[("notes", notes), ("run 1", &text)]));
    let in_sheet = CAMPAIGN.replace("log.csv", "log.xlsx");
    workshop.write("campaign.toml", format!("sheet = \"run 1\"\n{in_sheet}"));
    assert_eq!(plants(&workshop), expected);

    let of_trial = in_sheet.replace("dof =", "sheet = \"Run 1\"\ndof =");
    workshop.write("campaign.toml", format!("sheet = \"notes\"\n{of_trial}"));
    assert_eq!(plants(&workshop), expected);
}

#[test]
fn a_sheet_that_is_not_there_is_reported() {
    let workshop = Workshop::new();
    let text = workshop.read("log.csv");
    workshop.write("log.xlsx", workbook(&[("run 1", &text)]));
    assert_eq!(
        workshop.failure(&["inspect", "log.xlsx", "--sheet", "run 2"]),
        "log.xlsx has no sheet \"run 2\"; its sheets are \"run 1\""
    );
    let words = workshop.success(&["inspect", "log.xlsx"]);
    assert!(words.contains("Excel workbook, sheet \"run 1\""), "{words}");
}

#[test]
fn init_writes_down_how_the_log_is_read() {
    let workshop = Workshop::new();
    let text = workshop.read("log.csv").replace("time [s]", "clock [s]");
    workshop.write("log.xlsx", workbook(&[("notes", "a,b\n1,2\n"), ("run 1", &text)]));
    let reading = ["--time", "clock", "--sheet", "run 1", "--stamp", "receive"];
    workshop.success(&[&["init", "log.xlsx", "--out", "begun", "-q"][..], &reading].concat());
    let campaign = workshop.read("begun/campaign.toml");
    let expected = "sheet = \"run 1\"\ntime = { column = \"clock\", stamp = \"receive\" }\n";
    assert!(campaign.contains(expected), "{campaign}");

    workshop.write("rows.csv", text.replace("clock [s]", "row"));
    workshop.success(&["init", "rows.csv", "--out", "rows", "-q", "--equal-sampling-hz", "10"]);
    let campaign = workshop.read("rows/campaign.toml");
    assert!(campaign.contains("\ntime = { equal_sampling_hz = 10.0 }\n"), "{campaign}");
}

#[test]
fn a_workbook_whose_parts_contradict_each_other_is_one_error() {
    let workshop = Workshop::new();
    // The row number of the cell exceeds every reader's limit.
    let sheet = "t,u\n0,1\n1,2\n";
    let book = workbook(&[("run 1", sheet)]);
    let mut archive = zip::ZipArchive::new(Cursor::new(book)).unwrap();
    let mut damaged = ZipWriter::new(Cursor::new(Vec::new()));
    for k in 0..archive.len() {
        let mut part = archive.by_index(k).unwrap();
        let name = part.name().unwrap().into_owned();
        let mut text = String::new();
        std::io::Read::read_to_string(&mut part, &mut text).unwrap();
        damaged.start_file(name, SimpleFileOptions::default()).unwrap();
        damaged.write_all(text.replace("<c>", "<c r=\"A99999999999\">").as_bytes()).unwrap();
    }
    workshop.write("log.xlsx", damaged.finish().unwrap().into_inner());
    let message = workshop.failure(&["inspect", "log.xlsx"]);
    assert!(message.starts_with("log.xlsx cannot be read as an Excel workbook: "), "{message}");
    assert_eq!(message.lines().count(), 1, "{message}");
}
