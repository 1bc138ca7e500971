//! Ambiguous numbers in text tables: read correctly, or refused with their line.

use seaplant_log::{Log, ReadOptions, read, read_table};

use crate::common::{Sample, failure, notes, read_text, without_folder};

fn values<'a>(log: &'a Log, name: &str) -> &'a [f64] {
    log.channel(name).unwrap().values()
}

#[test]
fn a_last_row_without_a_line_end_is_left_out() {
    let whole = "time [s],T1 (us)\n0,1588\n1,1588\n2,1588";
    for (cut, last) in [(0, "1588"), (1, "158"), (3, "1"), (4, ""), (5, "2")] {
        let text = &whole[..whole.len() - cut];
        let log = read_text(text).unwrap();
        assert_eq!(values(&log, "T1"), [1588.0, 1588.0], "{text}");
        let expected = format!(
            "log.csv:4: the last row has no line end, so its last cell, \"{last}\", may be cut short; \
             the row is left out: add a line end if it is complete"
        );
        assert_eq!(notes(&log), [expected]);
    }
}

#[test]
fn a_last_row_that_is_complete_is_read() {
    for end in ["2,1588\n", "2,1588\r\n", "2,\"1588\"", "2,1588\n# end", "2,1588\n  "] {
        let log = read_text(format!("time [s],T1 (us)\n0,1588\n1,1588\n{end}")).unwrap();
        assert_eq!(values(&log, "T1"), [1588.0; 3], "{end:?}");
        assert_eq!(notes(&log), [""; 0]);
    }
}

#[test]
fn a_table_without_time_needs_its_last_row() {
    let sample = Sample::new("curve.csv", "PWM (us),Force (N)\n1100,-40\n1500,0\n1900,5");
    let message = read_table(sample.path()).unwrap_err().to_string();
    assert_eq!(
        without_folder(&message, sample.path()),
        "curve.csv:4: the last row has no line end, so its last cell, \"5\", may be cut short; add a \
         line end if the row is complete"
    );
}

#[test]
fn a_row_of_units_that_contradicts_the_header_is_refused() {
    for (units, line) in [("s,kgf", 2), ("# s,kgf", 2), ("[s],[kgf]", 2)] {
        assert_eq!(
            failure(format!("time [s],thrust [N]\n{units}\n0,1\n1,2\n")),
            format!(
                "log.csv:{line}: the row of units gives \"kgf\" for column \"thrust [N]\", whose \
                 header states \"N\"; correct one of the two"
            )
        );
    }
}

#[test]
fn a_row_of_units_that_agrees_with_the_header_is_read() {
    for units in ["s,kgf,us", "sec,kg,\u{b5}s", "-,kgf,-", ",,us"] {
        let text = format!("time [s],thrust [kg],T1 [us]\n{units}\n0,1,1500\n1,2,1500\n");
        assert_eq!(values(&read_text(text).unwrap(), "thrust"), [1.0, 2.0], "{units}");
    }
    let log = read_text("time,thrust\n# s, kgf\n0,1\n1,2\n").unwrap();
    assert_eq!(log.channel("thrust").unwrap().unit.as_ref().unwrap().symbol(), "kgf");
}

#[test]
fn points_between_thousands_are_determined_by_the_other_numbers() {
    let decimals = read_text("t [s];rpm\n0,5;588\n1,0;1.588\n1,5;-12.588\n").unwrap();
    assert_eq!(values(&decimals, "rpm"), [588.0, 1588.0, -12_588.0]);
    assert!(notes(&decimals).contains(
        &"log.csv:3: column \"rpm\" has 2 cells with separated thousands; \"1.588\" is read as 1588"
            .to_owned()
    ));
    let groups = read_text("t [s];count\n0;999\n1;1.588\n2;12.345.678\n").unwrap();
    assert_eq!(values(&groups, "count"), [999.0, 1588.0, 12_345_678.0]);
    let both = read_text("t [s];F [N]\n0;0,5\n1;1.588\n2;1.234,5\n").unwrap();
    assert_eq!(values(&both, "F"), [0.5, 1588.0, 1234.5]);
    let english = read_text("t [s]\tF [N]\n0\t0.5\n1\t1,588.5\n2\t1,588\n").unwrap();
    assert_eq!(values(&english, "F"), [0.5, 1588.5, 1588.0]);
}

#[test]
fn points_before_decimals_are_determined_by_the_other_numbers() {
    let log = read_text("t [s];depth\n1.000;1.588\n1.125;0.588\n1.250;1.5\n").unwrap();
    assert_eq!(values(&log, "depth"), [1.588, 0.588, 1.5]);
    assert_eq!(log.channel("depth").unwrap().time_s(), [1.0, 1.125, 1.25]);
    assert_eq!(notes(&log), [""; 0]);
    // Tabs and blanks make points likely, semicolons commas.
    for (text, expected) in [
        ("t [s]\tdepth\n1\t1.588\n2\t1.589\n", [1.588, 1.589]),
        ("t [s] depth\n1 1.588\n2 1.589\n", [1.588, 1.589]),
        ("t [s];depth\n1;1,588\n2;1,589\n", [1.588, 1.589]),
    ] {
        assert_eq!(values(&read_text(text).unwrap(), "depth"), expected);
    }
}

#[test]
fn ambiguous_thousands_are_refused() {
    let message = |line, column, text| {
        format!(
            "log.csv:{line}: \"{text}\" in column \"{column}\" may have decimals or thousands, and no \
             other number shows which; write thousands without a sign between them, or \
             decimals with another number of digits"
        )
    };
    assert_eq!(
        failure("t [s];rpm;F\n0;588;1\n1;588;2\n2;1.588;3\n3;1.588;4.588\n"),
        message(4, "rpm", "1.588")
    );
    assert_eq!(failure("t [s]\trpm\n0\t1,588\n1\t1,589\n"), message(2, "rpm", "1,588"));
    // Points are decimal signs elsewhere in the file; only this column is left out.
    let sample = Sample::new("log.csv", "t [s];rpm;u\n0;588;0.5\n1;1.588;0.6\n2;2.588;0.7\n");
    let log = read(sample.path(), &ReadOptions::default()).unwrap();
    assert_eq!(values(&log, "u"), [0.5, 0.6, 0.7]);
    let error = log.channel("rpm").unwrap_err().to_string();
    assert_eq!(without_folder(&error, sample.path()), message(3, "rpm", "1.588"));
    assert_eq!(
        notes(&log),
        [
            "log.csv:3: column \"rpm\" has whole numbers and numbers such as \"1.588\", which may have \
          decimals or thousands; left out"
        ]
    );
    // Where times are ambiguous, nothing can be read.
    assert_eq!(
        failure("t [s];u\n998;0.5\n999;0.6\n1.000;0.7\n1.001;0.8\n"),
        message(4, "t [s]", "1.000")
    );
}

#[test]
fn a_header_that_comes_again_with_other_words_is_refused() {
    let first = "time [s],thrust [N],u [m/s]\n0,1,2\n1,2,3\n";
    for (second, found, expected) in [
        ("time [ms],thrust [N],u [m/s]", "time [ms]", "time [s]"),
        ("time [s],u [m/s],thrust [N]", "u [m/s]", "thrust [N]"),
        ("time [s],thrust [N]", "2 columns", "3 columns"),
        ("Zeit [s],Schub [N],u [m/s]", "Zeit [s]", "time [s]"),
        ("s,kgf,m/s", "kgf", "N"),
        ("# time [s],thrust [kN],u [m/s]", "thrust [kN]", "thrust [N]"),
    ] {
        assert_eq!(
            failure(format!("{first}{second}\n2,3,4\n3,4,5\n")),
            format!(
                "log.csv:4: a second header starts here, with {found:?} where the first has \
                 {expected:?}; split the file there, so that each part has one header"
            )
        );
    }
}

#[test]
fn the_same_header_in_other_spelling_is_skipped() {
    for second in ["TIME [sec], u [m s-1]", "\"time [s]\",\"u [m/s]\"", "s,m/s"] {
        let log = read_text(format!("time [s],u [m/s]\n0,1\n{second}\n1,2\n")).unwrap();
        assert_eq!(notes(&log), ["log.csv:3: 1 row repeats the header; skipped"], "{second}");
        assert_eq!(values(&log, "u"), [1.0, 2.0]);
    }
}

#[test]
fn rows_of_text_are_no_headers() {
    for row in ["paused,by hand", "-,-", "nan,nan", "none,none", "# depth, held"] {
        let log = read_text(format!("time [s],u [m/s]\n0,1\n{row}\n1,2\n")).unwrap();
        assert_eq!(values(&log, "u"), [1.0, 2.0], "{row}");
    }
}

#[test]
fn negative_numbers_of_spreadsheets_are_read() {
    let log = read_text("time [s],u\n0,\u{2013}1.5\n1,(2.5)\n2,\u{2212}3.5\n3,4\n").unwrap();
    assert_eq!(values(&log, "u"), [-1.5, -2.5, -3.5, 4.0]);
    assert_eq!(notes(&log), [""; 0]);
    let log = read_text(b"time [s];u\n0;\x961,5\n1;(2,5)\n").unwrap();
    assert_eq!(values(&log, "u"), [-1.5, -2.5]);
}
