//! Invariants for arbitrary bytes.

use proptest::prelude::*;
use seaplant_log::{Log, ReadOptions, Unit, read, read_table};

use crate::common::{Sample, read_text};

/// Checks the invariants of a [`Log`]'s channels.
fn check(log: &Log) {
    for channel in log.channels() {
        assert!(!channel.is_empty());
        assert_eq!(channel.time_s().len(), channel.len());
        assert!(channel.values().iter().all(|value| value.is_finite()));
        assert!(channel.time_s().iter().all(|time| time.is_finite()));
        assert!(channel.time_s().windows(2).all(|w| w[0] < w[1]));
        assert!(channel.source < log.sources().len());
    }
    for note in log.notes() {
        assert!(!note.to_string().is_empty());
    }
}

/// Reads bytes in every way; none may panic.
fn read_all_ways(bytes: &[u8]) {
    let sample = Sample::new("log.csv", bytes);
    let equal = ReadOptions { equal_sampling_hz: Some(10.0), ..ReadOptions::default() };
    for options in [ReadOptions::default(), equal] {
        match read(sample.path(), &options) {
            Ok(log) => check(&log),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
    if let Ok(table) = read_table(sample.path()) {
        assert!(table.columns.iter().all(|column| column.values.len() == table.rows()));
    }
}

/// Generates text that resembles a table: cells, delimiters and newlines that cause errors.
fn nearly_a_table() -> impl Strategy<Value = String> {
    let cell = prop_oneof![
        4 => (-1e3..1e3_f64).prop_map(|x| format!("{x:.3}")),
        2 => (0..9_u8).prop_map(|x| x.to_string()),
        1 => prop::sample::select(vec![
            "", "NaN", "u [m/s]", "t", "\"", "\"a\nb\"", "#", "1,5", "2020-07-31", "12:00:01", "é",
            "1e999", "//", " ", "(", "[", "\u{feff}", "µs", "- ",
        ]).prop_map(str::to_owned),
    ];
    let delimiter = prop::sample::select(vec![",", ";", "\t", " ", "  "]);
    let newline = prop::sample::select(vec!["\n", "\r\n", "\r", "\n\n"]);
    let rows = prop::collection::vec(prop::collection::vec(cell, 1..6), 0..30);
    (any::<bool>(), rows, delimiter, newline).prop_map(|(headed, rows, delimiter, newline)| {
        let mut text = String::new();
        if headed {
            text.push_str(&["time [s]", "u [m/s]", "T1 (us)"].join(delimiter));
            text.push_str(newline);
        }
        for row in rows {
            text.push_str(&row.join(delimiter));
            text.push_str(newline);
        }
        text
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        read_all_ways(&bytes);
    }

    #[test]
    fn no_text_makes_it_panic(text in "\\PC{0,200}") {
        read_all_ways(text.as_bytes());
    }

    #[test]
    fn nothing_like_a_table_makes_it_panic(text in nearly_a_table()) {
        read_all_ways(text.as_bytes());
    }

    #[test]
    fn every_number_comes_back_as_written(
        values in prop::collection::vec(prop::num::f64::NORMAL | prop::num::f64::ZERO, 2..50)
    ) {
        let rows: String = values.iter().enumerate().map(|(k, v)| format!("{k},{v:e}\n")).collect();
        let log = read_text(format!("time [s],u\n{rows}")).unwrap();
        prop_assert_eq!(log.channel("u").unwrap().values(), &values[..]);
    }

    #[test]
    fn late_rows_end_where_they_belong(late in 2_usize..90, by in 1_usize..5) {
        let mut order: Vec<usize> = (0..100).collect();
        let row = order.remove(late);
        order.insert((late + by).min(99), row);
        let rows: String = order.iter().map(|k| format!("{k},{}\n", 2 * k)).collect();
        let log = read_text(format!("time [s],u\n{rows}")).unwrap();
        let expected: Vec<f64> = (0..100).map(|k| 2.0 * f64::from(k)).collect();
        prop_assert_eq!(log.channel("u").unwrap().values(), &expected[..]);
    }

    #[test]
    fn no_text_makes_a_unit_panic(text in "\\PC{0,12}") {
        if let Ok(unit) = Unit::parse(&text) {
            prop_assert!(unit.factor().is_finite() && unit.factor() > 0.0);
        }
    }
}
