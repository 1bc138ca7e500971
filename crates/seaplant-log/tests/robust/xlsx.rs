//! Excel workbooks, damaged directly, and each part within a valid archive.

use std::io::{Cursor, Read, Write};

use seaplant_log::ReadOptions;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use crate::common::python::made;
use crate::harness::{Limits, hammer, hammer_within};

#[test]
fn workbooks() {
    let Some(made) = made("xlsx") else { return };
    let seed = std::fs::read(made.file("seed.xlsx")).unwrap();
    hammer("xlsx", &seed, &ReadOptions::default(), Limits::default(), |_| {});
}

#[test]
fn parts_of_workbooks() {
    let Some(made) = made("xlsx") else { return };
    let seed = std::fs::read(made.file("seed.xlsx")).unwrap();
    let mut archive = ZipArchive::new(Cursor::new(seed)).unwrap();
    let parts: Vec<(String, Vec<u8>)> = (0..archive.len())
        .map(|k| {
            let mut part = archive.by_index(k).unwrap();
            let mut bytes = Vec::new();
            part.read_to_end(&mut bytes).unwrap();
            (part.name().unwrap().into_owned(), bytes)
        })
        .collect();
    for name in
        ["xl/worksheets/sheet1.xml", "xl/sharedStrings.xml", "xl/styles.xml", "xl/workbook.xml"]
    {
        let part = parts.iter().find(|(part, _)| part == name).unwrap();
        let kind = format!("xlsx-{}", name.rsplit('/').next().unwrap());
        hammer_within(&kind, &part.1, &ReadOptions::default(), Limits::default(), |damaged| {
            let mut workbook = ZipWriter::new(Cursor::new(Vec::new()));
            let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
            for (part, bytes) in &parts {
                workbook.start_file(part.as_str(), stored).unwrap();
                workbook.write_all(if part == name { damaged } else { bytes }).unwrap();
            }
            workbook.finish().unwrap().into_inner()
        });
    }
}
