//! Layouts of text tables.

use seaplant_log::{Dimension, Error, Log, ReadOptions, Unit, read, read_table};

use crate::common::{Sample, notes, options, read_text};

/// Returns the values of `u` with their times.
fn u(log: &Log) -> Vec<(f64, f64)> {
    let u = log.channel("u").expect("the log has a column u");
    u.time_s().iter().copied().zip(u.values().iter().copied()).collect()
}

const EXPECTED: [(f64, f64); 3] = [(0.0, 1.5), (0.5, -2.0), (1.0, 1e-3)];

#[test]
fn delimiters_and_newlines_are_determined_by_content() {
    let cells = ["time [s]", "u [m/s]", "0", "1.5", "0.5", "-2", "1.0", "1e-3"];
    for delimiter in [",", ";", "\t", " ", "   ", " \t", ", "] {
        for newline in ["\n", "\r\n", "\r", "\n\n", "\r\n\r\n"] {
            let rows: Vec<String> = cells.chunks(2).map(|row| row.join(delimiter)).collect();
            let text = rows.join(newline);
            for text in [format!("{text}{newline}"), format!("\u{feff}{text}{newline}")] {
                let log = read_text(&text).unwrap_or_else(|e| panic!("{text:?}: {e}"));
                assert_eq!(u(&log), EXPECTED, "{text:?}");
                assert_eq!(log.notes(), [], "{text:?}");
            }
        }
    }
}

#[test]
fn the_delimiter_is_part_of_the_format() {
    let format = |text: &str| read_text(text).unwrap().sources()[0].format.clone();
    assert_eq!(format("time,u\n0,1\n1,2\n"), "comma-separated text");
    assert_eq!(format("time;u\n0;1\n1;2\n"), "semicolon-separated text");
    assert_eq!(format("time\tu\n0\t1\n1\t2\n"), "tab-separated text");
    assert_eq!(format("time  u\n0  1\n1  2\n"), "blank-separated text");
}

#[test]
fn quoted_cells_and_outer_blanks_do_not_matter() {
    let log = read_text("\"time [s]\" , u \n\"0\", \"1.5\"\n 0.5,-2 \n1.0,\"1e-3\"\n");
    assert_eq!(u(&log.unwrap()), EXPECTED);
    let log = read_text("time [s],\"force, port [N]\"\n0,1\n1,2\n").unwrap();
    assert_eq!(log.channel("force, port").unwrap().unit, Unit::parse("N").ok());
}

#[test]
fn lines_above_the_header_are_skipped() {
    let rows = "time [s],u,v\n0,1.5,0\n0.5,-2,0\n1.0,1e-3,0\n";
    for preamble in [
        "# recorded in the pool, 3 people, fine weather\n",
        "% MATLAB export\n// and a comment\n\n",
        "Pool test 7\n\nVehicle,Bolt\n",
        "Rate,10\nMass,244.6\nLength,3.0\n",
        "Title,,\n,,\n",
        "sep=,\n",
    ] {
        let log = read_text(format!("{preamble}{rows}")).unwrap();
        assert_eq!(u(&log), EXPECTED, "{preamble}");
    }
    let preamble: String = (1..=49).map(|k| format!("Setting {k}: on\n")).collect();
    assert_eq!(u(&read_text(format!("{preamble}{rows}")).unwrap()), EXPECTED);
}

#[test]
fn a_header_behind_a_comment_mark_is_a_header() {
    for header in ["# time [s],u\n", "#time [s],u\n", "% time [s],u\n", "// time [s], u\n"] {
        let log = read_text(format!("{header}0,1.5\n0.5,-2\n1.0,1e-3\n")).unwrap();
        assert_eq!(u(&log), EXPECTED, "{header}");
    }
    let log = read_text("# time u\n0 1.5\n0.5 -2\n1.0 1e-3\n").unwrap();
    assert_eq!(u(&log), EXPECTED);
    let log = read_text("time,u\n# both of them, in SI\n0,1.5\n0.5,-2\n1.0,1e-3\n").unwrap();
    assert_eq!(u(&log), EXPECTED);
}

#[test]
fn a_row_of_units_below_the_names_is_read() {
    let log =
        read_text("time,u,T1,mode\nms,m/s,(us),\n0,1.5,1500,1\n500,-2,1500,1\n1000,1e-3,1,1\n");
    let log = log.unwrap();
    assert_eq!(u(&log), EXPECTED);
    assert_eq!(log.channel("u").unwrap().unit.as_ref().unwrap().symbol(), "m/s");
    let pulse = log.channel("T1").unwrap().unit.clone().unwrap();
    assert_eq!(pulse.dimension(), Dimension::PulseWidth);
    assert_eq!(log.channel("mode").unwrap().unit, None);
    assert_eq!(log.notes(), []);
}

#[test]
fn units_are_taken_from_brackets_and_nowhere_else() {
    let header = "time_s,u_velo [m/s],T1 (us),PWM (µs),Force (Kg f),rpm(rpm),depth_m,mode (raw),\
                  thruster (1),command [1],Efficiency (g/W)";
    let row = "1,".repeat(10);
    let log = read_text(format!("{header}\n0,{row}\n1,{row}\n")).unwrap();
    let found: Vec<(&str, Option<&str>)> = log
        .channels()
        .iter()
        .map(|c| (c.name.as_str(), c.unit.as_ref().map(Unit::symbol)))
        .collect();
    assert_eq!(
        found,
        [
            ("u_velo", Some("m/s")),
            ("T1", Some("us")),
            ("PWM", Some("µs")),
            ("Force", Some("Kg f")),
            ("rpm", Some("rpm")),
            ("depth_m", None),
            ("mode (raw)", None),
            ("thruster (1)", None),
            ("command", Some("1")),
            ("Efficiency (g/W)", None),
        ]
    );
}

#[test]
fn time_is_recognised_by_name_and_scaled_by_its_unit() {
    for (header, cells) in [
        ("time [s]", ["0", "0.5", "1"]),
        ("Time (ms)", ["0", "500", "1000"]),
        ("TIME [µs]", ["0", "500000", "1e6"]),
        ("time (us)", ["0", "500000", "1e6"]),
        ("t_ms", ["0", "500", "1000"]),
        ("timestamp_ns", ["0", "5e8", "1e9"]),
        ("t [min]", ["0", "0.0083333333333333333", "0.016666666666666666"]),
        ("Seconds", ["0", "0.5", "1"]),
        ("elapsed [h]", ["0", "0.00013888888888888889", "0.00027777777777777778"]),
        ("timestamp_s", ["0", "0.5", "1"]),
        ("utc", ["1970-01-01T00:00:00Z", "1970-01-01T01:00:00.5+01:00", "1970-01-01 00:00:01"]),
        ("DateTime", ["1970/01/01 00:00:00", "1970/01/01 00:00:00.500", "1970/01/01 00:00:01"]),
        ("time", ["00:00:00", "00:00:00.5", "00:00:01"]),
    ] {
        let rows: Vec<String> =
            cells.iter().zip(["1.5", "-2", "1e-3"]).map(|(t, u)| format!("{t},{u}")).collect();
        let log = read_text(format!("{header},u\n{}\n", rows.join("\n"))).unwrap();
        for (found, expected) in u(&log).iter().zip(EXPECTED) {
            // Rounding of a quotient such as 0.5/3600 written to 17 digits.
            assert!((found.0 - expected.0).abs() < 1e-15, "{header}: {found:?}");
            assert_eq!(found.1, expected.1);
        }
        assert_eq!(log.notes(), [], "{header}");
    }
}

#[test]
fn a_date_time_is_seconds_since_the_epoch() {
    let log = read_text("utc,u\n2020-07-31T13:50:28.5Z,1\n2020-07-31T13:50:29Z,2\n").unwrap();
    assert_eq!(log.channel("u").unwrap().time_s(), [1_596_203_428.5, 1_596_203_429.0]);
}

#[test]
fn a_stated_unit_does_not_scale_date_times() {
    let rows = "1970-01-01T00:00:01Z,1\n1970-01-01T00:00:02Z,2\n";
    let log = read_text(format!("time [ms],u\n{rows}")).unwrap();
    assert_eq!(log.channel("u").unwrap().time_s(), [1.0, 2.0]);
}

#[test]
fn a_version_number_above_decides_no_decimal_sign() {
    let log = read_text("Version;1.2\n\nt [s];u\n0,0;1,5\n0,5;-2\n1,0;1e-3\n").unwrap();
    assert_eq!(u(&log), EXPECTED);
}

#[test]
fn a_column_whose_unit_is_not_time_is_not_taken_for_time() {
    let log = read_text("t [N],stamp [s],u\n5,0,1\n5,1,2\n").unwrap();
    assert_eq!(log.channel("t").unwrap().values(), [5.0, 5.0]);
    let error = read_text("t [N],u\n5,0\n5,1\n").unwrap_err();
    assert!(matches!(error, Error::NoTime { .. }));
}

#[test]
fn time_may_be_named_and_its_unit_stated() {
    let sample = Sample::new("log.csv", "tick,time [s],u\n0,7,1.5\n500,8,-2\n1000,9,1e-3\n");
    let log = read(sample.path(), &options("Tick", Some("ms"))).unwrap();
    assert_eq!(u(&log), EXPECTED);
    assert_eq!(log.notes(), []);
    assert_eq!(log.channel("time").unwrap().values(), [7.0, 8.0, 9.0]);
}

#[test]
fn the_offset_is_added_after_the_unit() {
    let sample = Sample::new("log.csv", "t_ms,u\n1000,1\n1500,2\n");
    let options = ReadOptions { offset_s: -1.0, ..ReadOptions::default() };
    let log = read(sample.path(), &options).unwrap();
    assert_eq!(log.channel("u").unwrap().time_s(), [0.0, 0.5]);
}

#[test]
fn equal_sampling_counts_rows_and_keeps_every_column() {
    let sample = Sample::new("log.csv", "time [s],u\n7,1\n7,NaN\n7,3\n");
    let options =
        ReadOptions { equal_sampling_hz: Some(2.0), offset_s: 10.0, ..ReadOptions::default() };
    let log = read(sample.path(), &options).unwrap();
    assert_eq!(u(&log), [(10.0, 1.0), (11.0, 3.0)]);
    assert_eq!(log.channel("time").unwrap().time_s(), [10.0, 10.5, 11.0]);
    let sample = Sample::new("one.txt", "u [m/s]\n1\n2\n");
    let log = read(sample.path(), &options).unwrap();
    assert_eq!(u(&log), [(10.0, 1.0), (10.5, 2.0)]);
}

#[test]
fn words_for_no_value_are_missing_without_a_note() {
    let words =
        ["", "NaN", "nan", "NA", "n/a", "null", "None", "-", "inf", "-Inf", "#N/A", "-1.#IND"];
    let rows: String = words.iter().enumerate().map(|(k, w)| format!("{},{w}\n", k + 1)).collect();
    let log = read_text(format!("time [s],u\n0,1\n{rows}99,2\n")).unwrap();
    assert_eq!(u(&log), [(0.0, 1.0), (99.0, 2.0)]);
    assert_eq!(log.channel("u").unwrap().missing, words.len());
    assert_eq!(log.notes(), []);
}

#[test]
fn channels_of_one_pattern_share_their_times() {
    let log = read_text("time [s],a,b,c,d\n0,1,1,,\n1,1,1,2,3\n2,1,1,2,3\n").unwrap();
    let [a, b, c, d] = ["a", "b", "c", "d"].map(|name| log.channel(name).unwrap());
    assert!(a.shares_time_with(b) && c.shares_time_with(d) && !a.shares_time_with(c));
}

#[test]
fn delimiters_at_the_end_of_lines_make_no_column() {
    for text in
        ["time [s],u,\n0,1,\n1,2,\n", "time [s],u\n0,1,\n1,2,\n", "time [s],u,,\n0,1\n1,2\n"]
    {
        let log = read_text(text).unwrap();
        assert_eq!(log.channels().len(), 1, "{text}");
        assert!(!log.notes().iter().any(|n| n.to_string().contains("column 3")), "{text}");
    }
    let log = read_text("time [s],u,\n0,1,5\n1,2,6\n").unwrap();
    assert_eq!(log.channel("column 3").unwrap().values(), [5.0, 6.0]);
}

#[test]
fn rates_gaps_and_extremes_describe_a_channel() {
    let log = read_text("time [s],u,k\n0,1,7\n0.5,-3,7\n1,2,7\n5,4,7\n5.5,0,7\n").unwrap();
    let u = log.channel("u").unwrap();
    assert_eq!((u.len(), u.is_empty(), u.span_s()), (5, false, 5.5));
    assert_eq!((u.period_s(), u.rate_hz()), (Some(0.5), Some(2.0)));
    assert_eq!((u.min(), u.max()), (Some(-3.0), Some(4.0)));
    let gaps = u.gaps(3.0);
    assert_eq!((gaps.len(), gaps[0].from_s, gaps[0].to_s), (1, 1.0, 5.0));
    assert!(!u.is_constant() && log.channel("k").unwrap().is_constant());
}

#[test]
fn several_files_keep_their_own_times() {
    let thrust = Sample::new("thrust.csv", "time [s],T1 (us)\n0,1500\n0.1,1500\n0.2,1588\n");
    let depth = Sample::new("depth.csv", "time [s],depth (m)\n0,2\n1.7,3\n");
    let late = ReadOptions { offset_s: 0.25, ..ReadOptions::default() };
    let files =
        [(thrust.path().to_owned(), ReadOptions::default()), (depth.path().to_owned(), late)];
    let log = Log::open(&files).unwrap();
    assert_eq!(log.channel("T1").unwrap().time_s(), [0.0, 0.1, 0.2]);
    assert_eq!(log.channel("depth").unwrap().time_s(), [0.25, 1.95]);
    let source = &log.sources()[log.channel("depth").unwrap().source];
    assert_eq!((source.path.as_path(), source.bytes), (depth.path(), 29));
}

#[test]
fn a_source_carries_the_hash_of_its_bytes() {
    // `printf 'time,u\n0,1\n1,2\n' | sha256sum`
    let expected = "04e93c3970c009fff9bb6c278c9609ad9e9d80be35485e73cde5a5b7f5c5ea76";
    let log = read_text("time,u\n0,1\n1,2\n").unwrap();
    assert_eq!(log.sources()[0].sha256, expected);
}

#[test]
fn a_namesake_with_values_is_preferred() {
    let full = Sample::new("a.csv", "time [s],u\n0,1\n1,2\n");
    let empty = Sample::new("b.csv", "time [s],v,u\n0,1,\n1,2,\n");
    let files = [&empty, &full].map(|s| (s.path().to_owned(), ReadOptions::default()));
    let log = Log::open(&files).unwrap();
    assert_eq!(log.channel("u").unwrap().source, 1);
    assert!(matches!(log.channel("b:u"), Err(Error::AllMissing { .. })));
}

#[test]
fn a_table_keeps_its_rows_and_lines() {
    let text = "# bollard pull\r\n\r\n PWM (µs), Force (Kg f),\r\n1100,-2.31,\r\n\r\n1500,,\r\n1900,3,\r\n";
    let sample = Sample::new("curve.csv", text);
    let table = read_table(sample.path()).unwrap();
    let force = table.column("force").unwrap();
    assert_eq!(force.values, [Some(-2.31), None, Some(3.0)]);
    assert_eq!((force.missing(), force.is_empty(), table.rows()), (1, false, 3));
    assert_eq!((table.header_line, table.first_line), (3, 4));
    assert_eq!((table.line(1), table.line(2)), (6, 7));
    assert_eq!(table.columns.len(), 2);
    let unit = force.unit.as_ref().unwrap().resolve(Dimension::Force).unwrap();
    assert!((unit.to_si(1.0) - 9.80665).abs() < 1e-12);
    assert_eq!(table.notes(), []);
}

#[test]
fn rows_of_growing_length_are_all_read() {
    // The first thousand rows are short, so that the file seems to have more rows than it has; then
    // the other way round.
    let short = |k: usize| format!("{k},1\n");
    let long = |k: usize| format!("{k}.{:040},1.{:0200}\n", 0, 0);
    let (early, late) = (0..2000, 2000..5000);
    let growing = early.clone().map(short).chain(late.clone().map(long)).collect::<String>();
    let shrinking = early.map(long).chain(late.map(short)).collect::<String>();
    for rows in [growing, shrinking] {
        let log = read_text(format!("time [s],u\n{rows}")).unwrap();
        let u = log.channel("u").unwrap();
        assert_eq!((u.len(), u.missing, u.span_s()), (5000, 0, 4999.0));
        assert!(u.values().iter().all(|u| *u == 1.0));
    }
}

#[test]
fn files_of_equal_times_keep_them_once() {
    let file = |name: &str, unit: &str| {
        Sample::new(&format!("{name}.csv"), format!("time [s],{name} [{unit}]\n0,1\n0.5,2\n1,3\n"))
    };
    let (u, v) = (file("u", "m/s"), file("v", "m/s"));
    let w = Sample::new("w.csv", "time [s],w\n0,1\n0.5,2\n2,3\n");
    let files = [&u, &v, &w].map(|file| (file.path().to_owned(), ReadOptions::default()));
    let log = Log::open(&files).unwrap();
    let channel = |name| log.channel(name).unwrap();
    assert!(channel("u").shares_time_with(channel("v")));
    assert!(!channel("u").shares_time_with(channel("w")));
    assert_eq!(log.place("v").unwrap(), 1);
    let channels = log.into_channels();
    let (time_s, values) = channels.into_iter().nth(2).unwrap().into_samples();
    assert_eq!((&time_s[..], values), (&[0.0, 0.5, 2.0][..], vec![1.0, 2.0, 3.0]));
}

#[test]
fn thousands_of_columns_are_all_read() {
    const COLUMNS: usize = 5000;
    const ROWS: usize = 100;
    let name = |k: usize| format!("a rather long name of channel number {k} [m/s]");
    let header: Vec<String> = (0..COLUMNS).map(name).collect();
    let mut text = format!("time [s],{}\n", header.join(","));
    for row in 0..ROWS {
        text += &format!("{row}");
        for column in 0..COLUMNS {
            // Each column lacks other values than its neighbours, so that few columns share their
            // times.
            let missing = column % ROWS == row || column / ROWS == row;
            text += &if missing { ",".to_owned() } else { format!(",{}.5", row * column) };
        }
        text.push('\n');
    }
    assert!(
        text.find('\n').unwrap() > 200_000,
        "the header is longer than what is looked at first"
    );
    let log = read_text(text).unwrap();
    assert_eq!((log.channels().len(), log.notes().len()), (COLUMNS, 0));
    let last = log.channel(&name(COLUMNS - 1)).unwrap();
    assert_eq!((last.len(), last.missing), (ROWS - 2, 2));
    assert_eq!(last.values()[10], 10.0 * (COLUMNS - 1) as f64 + 0.5);
}

#[test]
fn bytes_that_are_no_utf_8_spoil_no_more_than_their_cell() {
    // Windows-1252: a degree sign, a micro sign; then a corrupted byte.
    let text =
        b"t (s),heading (\xb0),T1 (\xb5s)\n0,10,1500\n1,1\x92,1510\n2,12,15\xff0\n3,13,1530\n";
    let log = read_text(text).unwrap();
    let heading = log.channel("heading").unwrap();
    assert_eq!(
        (heading.column.as_str(), heading.values()),
        ("heading (°)", &[10.0, 12.0, 13.0][..])
    );
    assert_eq!(heading.unit.as_ref().map(Unit::dimension), Some(Dimension::Angle));
    let pulse = log.channel("T1").unwrap();
    assert_eq!((pulse.time_s(), pulse.missing), (&[0.0, 1.0, 3.0][..], 1));
    assert_eq!(
        notes(&log),
        [
            "log.csv: the text is not UTF-8; read as windows-1252",
            "log.csv:3: column \"heading (°)\" has 1 cell that is not a number (here \"1’\"); counted \
             as missing",
            "log.csv:4: column \"T1 (µs)\" has 1 cell that is not a number (here \"15ÿ0\"); counted as \
             missing",
        ]
    );
}

#[test]
fn garbled_bytes_in_the_rows_alone_are_reported() {
    let log = read_text(b"t (s),u (m/s)\n0,1\n1,\x80\xc6\xfe\n2,3\n").unwrap();
    assert_eq!(log.channel("u").unwrap().values(), [1.0, 3.0]);
    assert_eq!(
        notes(&log),
        ["log.csv:3: column \"u (m/s)\" has 1 cell that is not a number (here \"€Æþ\"); counted \
          as missing"]
    );
}

#[test]
fn integer_seconds_and_nanoseconds_of_two_columns_are_one_time() {
    let text = "header_stamp_secs,header_stamp_nsecs,u\n1700000000,5000000,1\n\
                1700000000,950000000,2\n1700000001,0,3\n";
    let log = read_text(text).unwrap();
    let times: Vec<f64> = log.channel("u").unwrap().time_s().to_vec();
    let since: Vec<f64> = times.iter().map(|t| t - 1.7e9).collect();
    for (found, expected) in since.iter().zip([0.005, 0.95, 1.0]) {
        assert!((found - expected).abs() < 1e-6, "{since:?}");
    }
    assert_eq!(log.sources()[0].epoch, seaplant_log::Epoch::Unix);
    assert_eq!(notes(&log), [""; 0]);
}

#[test]
fn a_quaternion_in_a_table_gives_its_angles() {
    let half = 0.25f64;
    let (sin, cos) = half.sin_cos();
    let text = format!(
        "time [s],orientation_x,orientation_y,orientation_z,orientation_w\n\
         0,0,0,0,1\n1,0,0,{sin},{cos}\n2,,,,\n"
    );
    let log = read_text(&text).unwrap();
    let yaw = log.channel("orientation.yaw").unwrap();
    assert_eq!((yaw.values().len(), yaw.missing), (2, 1));
    assert!((yaw.values()[1] - 0.5).abs() < 1e-12);
    assert_eq!(yaw.unit.as_ref().map(|unit| unit.symbol()), Some("rad"));
}
