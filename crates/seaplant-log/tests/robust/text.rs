//! Text tables.

use seaplant_log::{ReadOptions, TimeColumn};

use crate::harness::{Limits, hammer};

fn table(delimiter: &str, rows: usize) -> String {
    let mut text = format!("# a comment\ntime [s]{delimiter}u [m/s]{delimiter}\"T1 (us)\"\n");
    for k in 0..rows {
        let row =
            [format!("{:.2}", 0.1 * k as f64), format!("{}e-3", k % 7), (1500 + k).to_string()];
        text += &format!("{}\n", row.join(delimiter));
    }
    text
}

#[test]
fn tables_of_every_delimiter() {
    for delimiter in [",", ";", "\t", "  "] {
        let text = table(delimiter, 60);
        hammer("text", text.as_bytes(), &ReadOptions::default(), Limits::default(), |_| {});
    }
}

#[test]
fn a_table_with_dates_and_decimal_commas() {
    let mut text = "when;u [m/s];state\n".to_owned();
    for k in 0..60 {
        text += &format!("2020-07-31T13:50:{k:02}.5Z;0,{k};idle\n");
    }
    let time = TimeColumn { column: Some("when".to_owned()), unit: None };
    let options = ReadOptions { time: Some(time), ..ReadOptions::default() };
    hammer("text-dates", text.as_bytes(), &options, Limits::default(), |_| {});
}

#[test]
fn a_table_in_utf_16() {
    let text = table("\t", 40);
    let bytes: Vec<u8> =
        "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    hammer("text-utf-16", &bytes, &ReadOptions::default(), Limits::default(), |_| {});
}
