//! Small files designed to be expensive: reading them takes time and memory in proportion to their
//! size, or they are refused.

use std::io::{Cursor, Write};
use std::path::Path;

use seaplant_log::{Log, ReadOptions, read_bytes};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::harness::{Limits, replay};

/// Reads a file within the limits of all readers, with less memory for large files.
fn stands(name: &str, bytes: &[u8]) -> Option<Log> {
    let limits = Limits { memory_factor: 10, ..Limits::default() };
    replay(name, bytes, &ReadOptions::default(), limits)
}

fn error(bytes: &[u8]) -> String {
    let read = read_bytes(Path::new("log"), bytes, &ReadOptions::default());
    read.expect_err("a hostile file").to_string()
}

/// Builds a ULog file of messages: a letter and a body each.
fn ulog(messages: impl IntoIterator<Item = (u8, Vec<u8>)>) -> Vec<u8> {
    let mut file = b"ULog\x01\x12\x35\x01\0\0\0\0\0\0\0\0".to_vec();
    for (letter, body) in messages {
        file.extend((body.len() as u16).to_le_bytes());
        file.push(letter);
        file.extend(body);
    }
    file
}

fn defined(text: &str) -> (u8, Vec<u8>) {
    (b'F', text.as_bytes().to_vec())
}

fn subscribed(instance: u8, number: u16, name: &str) -> (u8, Vec<u8>) {
    let number = number.to_le_bytes();
    (b'A', [&[instance][..], &number, name.as_bytes()].concat())
}

#[test]
fn ulog_subscriptions_to_a_topic_of_too_many_fields() {
    let fields = defined("a:uint64_t timestamp;float[9000] x;");
    let subscriptions = (0..150_000).map(|k| subscribed(0, k as u16, "a"));
    let file = ulog(std::iter::once(fields).chain(subscriptions));
    assert!(stands("ulog-subscriptions", &file).is_none());
}

#[test]
fn ulog_topics_of_many_fields_without_records() {
    let topics = (0..5_000_u16).flat_map(|k| {
        let name = format!("t{k}");
        let text = format!("{name}:uint64_t timestamp;float[2000] x;");
        [defined(&text), subscribed(0, k, &name)]
    });
    let file = ulog(topics);
    assert!(stands("ulog-topics", &file).is_none());
    assert!(error(&file).starts_with("log names more than 100000 columns"), "{}", error(&file));
}

#[test]
fn ulog_topics_of_many_fields_with_a_record() {
    let topics = (0..600_u16).flat_map(|k| {
        let name = format!("t{k}");
        let text = format!("{name}:uint64_t timestamp;uint8_t[2000] x;");
        let record = [&k.to_le_bytes()[..], &[1; 2008]].concat();
        [defined(&text), subscribed(0, k, &name), (b'D', record)]
    });
    assert!(stands("ulog-records", &ulog(topics)).is_none());
}

#[test]
fn ulog_topics_of_as_many_fields_as_a_log_may_have() {
    let topics = (0..49_u16).flat_map(|k| {
        let name = format!("t{k}");
        let text = format!("{name}:uint64_t timestamp;uint8_t[2000] x;");
        let record = [&k.to_le_bytes()[..], &[1; 2008]].concat();
        [defined(&text), subscribed(0, k, &name), (b'D', record)]
    });
    let log = stands("ulog-most", &ulog(topics)).expect("a log");
    assert_eq!(log.channels().len(), 49 * 2000);
}

#[test]
fn ulog_arrays_of_empty_topics() {
    let text = "a:uint64_t timestamp;e[200000000] x;";
    let file = ulog([defined("e:;"), defined(text), subscribed(0, 0, "a")]);
    assert!(stands("ulog-empty", &file).is_none());
}

#[test]
fn ulog_long_names() {
    let messages = (0..15_u16).flat_map(|k| {
        let name = format!("t{k}");
        let text = format!("{name}:uint64_t timestamp;uint8_t[2000] {};", "x".repeat(60_000));
        [defined(&text), subscribed(0, k, &name)]
    });
    assert!(stands("ulog-names", &ulog(messages)).is_none());
}

/// Builds a workbook with one sheet.
fn workbook(sheet: &str) -> Vec<u8> {
    let mut workbook = ZipWriter::new(Cursor::new(Vec::new()));
    let start = r#"<?xml version="1.0" encoding="UTF-8"?>"#;
    let main = r#"xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main""#;
    let kinds = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    let packed = "http://schemas.openxmlformats.org/package/2006";
    for (part, text) in [
        ("[Content_Types].xml", format!(r#"<Types xmlns="{packed}/content-types"/>"#)),
        (
            "_rels/.rels",
            format!(
                r#"<Relationships xmlns="{packed}/relationships"><Relationship Id="r1" Type="{kinds}/officeDocument" Target="xl/workbook.xml"/></Relationships>"#
            ),
        ),
        (
            "xl/workbook.xml",
            format!(
                r#"<workbook {main} xmlns:r="{kinds}"><sheets><sheet name="log" sheetId="1" r:id="r1"/></sheets></workbook>"#
            ),
        ),
        (
            "xl/_rels/workbook.xml.rels",
            format!(
                r#"<Relationships xmlns="{packed}/relationships"><Relationship Id="r1" Type="{kinds}/worksheet" Target="worksheets/sheet1.xml"/></Relationships>"#
            ),
        ),
        (
            "xl/worksheets/sheet1.xml",
            format!("<worksheet {main}><sheetData>{sheet}</sheetData></worksheet>"),
        ),
    ] {
        workbook.start_file(part, SimpleFileOptions::default()).expect("a part");
        workbook.write_all(format!("{start}{text}").as_bytes()).expect("a part");
    }
    workbook.finish().expect("a workbook").into_inner()
}

#[test]
fn workbooks_with_cells_in_the_last_column() {
    let mut sheet = r#"<row r="1"><c r="A1" t="inlineStr"><is><t>time [s]</t></is></c><c r="XFD1" t="inlineStr"><is><t>u [m/s]</t></is></c></row>"#.to_owned();
    for row in 2..60_000 {
        sheet += &format!(
            r#"<row r="{row}"><c r="A{row}"><v>{row}</v></c><c r="XFD{row}"><v>1</v></c></row>"#
        );
    }
    let file = workbook(&sheet);
    assert!(stands("xlsx-far", &file).is_none());
    let words = "it holds more cells, empty ones included, than its size allows";
    assert!(error(&file).contains(words), "{}", error(&file));
}

#[test]
fn a_header_of_millions_of_commas() {
    let text = format!("time [s]{}\n{}", ",".repeat(30_000_000), "1,2\n2,3\n");
    assert!(stands("text-commas", text.as_bytes()).is_none());
    let message = error(text.as_bytes());
    assert!(message.starts_with("log names more than 100000 columns"), "{message}");
}

#[test]
fn a_name_of_a_million_characters() {
    let mut text = format!("time [s],{}\n", "x".repeat(1_000_000));
    for k in 0..1000 {
        text += &format!("{k},1\n");
    }
    assert!(stands("text-name", text.as_bytes()).is_none());
    let message = error(text.as_bytes());
    let words = "log names a column with 1000000 bytes (starting \"xxxx";
    assert!(message.starts_with(words) && message.len() < 300, "{message}");
}
