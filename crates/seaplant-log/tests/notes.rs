//! Checks every note, by its message and by the action that it describes.

use seaplant_log::{Epoch, Note};

use crate::common::{notes, read_text};

#[test]
fn a_clean_log_has_no_notes() {
    let log = read_text("time [s],u [m/s]\n0,1\n1,2\n").unwrap();
    assert_eq!(notes(&log), Vec::<String>::new());
}

#[test]
fn late_rows_are_sorted_into_place() {
    let log = read_text("time [s],u\n0,10\n1,11\n3,13\n2.5,12\n4,14\n").unwrap();
    assert_eq!(
        notes(&log),
        ["log.csv:5: 1 row is earlier than a row before, by up to 0.500000 s; sorted by time"]
    );
    let u = log.channel("u").unwrap();
    assert_eq!(u.time_s(), [0.0, 1.0, 2.5, 3.0, 4.0]);
    assert_eq!(u.values(), [10.0, 11.0, 12.0, 13.0, 14.0]);
    assert!(matches!(log.notes()[0], Note::OutOfOrder { count: 1, first_line: 5, .. }));
}

#[test]
fn of_rows_at_one_time_each_channel_keeps_its_first_sample() {
    let log = read_text("time [s],u,depth\n0,1,\n0,2,5\n1,3,6\n1,4,7\n2,5,8\n").unwrap();
    assert_eq!(
        notes(&log),
        ["log.csv:3: of 5 rows 2 repeat the time of another; each channel keeps its first sample \
          at a time"]
    );
    assert_eq!(log.channel("u").unwrap().values(), [1.0, 3.0, 5.0]);
    assert_eq!(log.channel("depth").unwrap().values(), [5.0, 6.0, 8.0]);
    assert_eq!(log.channel("depth").unwrap().missing, 1);
}

#[test]
fn a_clock_coarser_than_the_sampling_is_pointed_out() {
    let log = read_text("time [s],u\n0,1\n0,2\n0,3\n0,4\n1,5\n1,6\n").unwrap();
    assert!(notes(&log)[0].ends_with("(the clock is coarser than the sampling)"));
}

#[test]
fn rows_without_a_time_are_dropped() {
    let log = read_text("time [s],u\n0,1\n,2\nlate,3\n3,4\n").unwrap();
    assert_eq!(notes(&log), ["log.csv:3: 2 rows have no readable time; dropped"]);
    assert_eq!(log.channel("u").unwrap().values(), [1.0, 4.0]);
}

#[test]
fn ragged_rows_lose_or_lack_cells() {
    let log = read_text("time [s],u,v\n0,1,2\n1,3\n2,5,6,7\n3,7,8\n").unwrap();
    assert_eq!(
        notes(&log),
        ["log.csv:3: 2 rows do not have 3 cells (here 2); absent cells count as missing, further \
          ones are dropped"]
    );
    assert_eq!(log.channel("v").unwrap().time_s(), [0.0, 2.0, 3.0]);
    assert_eq!(log.channel("u").unwrap().len(), 4);
}

#[test]
fn a_row_of_one_cell_is_skipped() {
    let log = read_text("time [s],u\n0,1\nrecording paused\n1,2\n2\n").unwrap();
    assert_eq!(
        notes(&log),
        ["log.csv:3: 2 rows hold a single cell (here \"recording paused\"); skipped"]
    );
    assert_eq!(log.channel("u").unwrap().len(), 2);
}

#[test]
fn a_header_within_the_rows_is_skipped() {
    let log = read_text("time [s],u\n0,1\ntime [s],u\n1,2\n").unwrap();
    assert_eq!(notes(&log), ["log.csv:3: 1 row repeats the header; skipped"]);
    assert_eq!(log.channel("u").unwrap().len(), 2);
}

#[test]
fn a_stray_pair_of_quotes_that_swallows_rows_is_reported() {
    let log = read_text("time [s],u\n0,1\n1,\"2\n2,3\n3,\"4\n4,5\n").unwrap();
    assert_eq!(
        notes(&log)[0],
        "log.csv:3: 1 row holds a quoted cell that runs over several lines; read as one row: \
         check the quotation marks"
    );
    assert_eq!(log.channel("u").unwrap().time_s(), [0.0, 4.0]);
}

#[test]
fn text_among_numbers_is_missing_and_shown() {
    let log = read_text("time [s],u\n0,1\n1,ERR 7\n2,ERR 9\n3,4\n").unwrap();
    assert_eq!(
        notes(&log),
        ["log.csv:3: column \"u\" has 2 cells that are not a number (here \"ERR 7\"); counted as \
          missing"]
    );
    assert_eq!(log.channel("u").unwrap().missing, 2);
}

#[test]
fn long_text_is_shown_in_part() {
    let log = read_text(format!("time [s],u\n0,1\n1,{}\n2,3\n", "é".repeat(500))).unwrap();
    let Note::NotANumber { text, .. } = &log.notes()[0] else { panic!("{:?}", log.notes()) };
    assert!(text.starts_with("éééé") && text.ends_with('…') && text.chars().count() <= 41);
}

#[test]
fn columns_of_text_and_of_nothing_are_left_out() {
    let log = read_text("time [s],u,mode,v\n0,1,MANUAL,nan\n1,2,AUTO,\n").unwrap();
    assert_eq!(
        notes(&log),
        [
            "log.csv:2: column \"mode\" holds text (here \"MANUAL\"); left out",
            "log.csv: column \"v\" has no value in any of 2 rows; left out",
        ]
    );
    assert_eq!(log.channels().len(), 1);
}

#[test]
fn a_second_column_of_one_name_is_renamed() {
    let log = read_text("time [s],u [m/s],u [m/s],u [m/s]\n0,1,2,3\n1,1,2,3\n").unwrap();
    assert_eq!(
        notes(&log),
        [
            "log.csv: a second column is headed \"u [m/s]\"; it is named \"u.2\" here",
            "log.csv: a second column is headed \"u [m/s]\"; it is named \"u.3\" here",
        ]
    );
    let first = |name| log.channel(name).unwrap().values()[0];
    assert_eq!((first("u"), first("u.2"), first("u.3")), (1.0, 2.0, 3.0));
}

#[test]
fn a_choice_between_time_columns_is_reported() {
    let log = read_text("utc,time [s],u\n1600000000,0,1\n1600000001,1,2\n").unwrap();
    assert_eq!(
        notes(&log),
        ["log.csv: column \"time [s]\" is taken as time, though \"utc\" could be too"]
    );
    assert_eq!(log.channel("u").unwrap().time_s(), [0.0, 1.0]);
    assert_eq!(log.channel("utc").unwrap().len(), 2);
}

#[test]
fn seconds_are_assumed_aloud() {
    let log = read_text("t,u\n0,1\n100,2\n200,3\n").unwrap();
    assert_eq!(
        notes(&log),
        ["log.csv: the time column \"t\" states no unit; seconds assumed, so a row every \
          100.000000 s; is it ms?"]
    );
    let unit = |period: f64| {
        let log = read_text(format!("t,u\n0,1\n{period},2\n")).unwrap();
        log.notes()[0].likely_time_unit()
    };
    assert_eq!([10.0, 1e4, 1e7, 2e7].map(unit), [None, Some("ms"), Some("us"), Some("ns")]);
}

#[test]
fn decimal_commas_are_reported() {
    let log = read_text("t [s];u\n0;7\n0,5;8,25\n1;-1,5e1\n").unwrap();
    assert_eq!(
        notes(&log),
        ["log.csv:3: numbers have a decimal comma (here \"0,5\"); read as a decimal point"]
    );
    assert_eq!(log.channel("u").unwrap().values(), [7.0, 8.25, -15.0]);
    assert_eq!(log.channel("u").unwrap().time_s(), [0.0, 0.5, 1.0]);
    assert_eq!(log.sources()[0].format, "semicolon-separated text, decimal comma");
}

#[test]
fn points_among_decimal_commas_are_not_guessed_at() {
    let log = read_text("t [s];u\n0;0,5\n1;1.234\n2;1,5\n").unwrap();
    assert!(notes(&log)[1].contains("not a number (here \"1.234\")"), "{:?}", notes(&log));
}

#[test]
fn another_encoding_is_reported() {
    let log = read_text(b"time [s],H\xf6he [m],T1 [\xb5s]\n0,1,2\n1,2,3\n").unwrap();
    assert_eq!(notes(&log), ["log.csv: the text is not UTF-8; read as windows-1252"]);
    assert_eq!(log.channel("Höhe").unwrap().values(), [1.0, 2.0]);
    assert!(log.channel("T1").unwrap().unit.is_some());
    let text = "\u{feff}time [s]\tu\r\n0\t1\r\n1\t2\r\n";
    let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let log = read_text(wide).unwrap();
    assert_eq!(notes(&log), ["log.csv: the text is not UTF-8; read as UTF-16LE"]);
    assert_eq!(log.channel("u").unwrap().values(), [1.0, 2.0]);
}

#[test]
fn a_time_of_day_carries_on_at_midnight() {
    let log =
        read_text("time,u\n23:59:58.5,1\n23:59:59.5,2\n00:00:00.5,3\n00:00:01.5,4\n").unwrap();
    assert_eq!(
        notes(&log),
        ["log.csv:4: the time goes from 86399.5 to 0.5, where the day runs out; times carry on \
          from there (1 time)"]
    );
    assert_eq!(log.channel("u").unwrap().time_s(), [86_398.5, 86_399.5, 86_400.5, 86_401.5]);
    assert_eq!(log.sources()[0].epoch, Epoch::Midnight);
}

#[test]
fn a_night_between_two_rows_is_still_a_midnight() {
    let log = read_text("time,u\n21:00:00,1\n22:00:00,2\n01:00:00,3\n02:00:00,4\n").unwrap();
    assert_eq!(log.channel("u").unwrap().time_s(), [75_600.0, 79_200.0, 90_000.0, 93_600.0]);
}

#[test]
fn a_counter_that_is_full_carries_on() {
    let full = 4_294_967_296_u64;
    let rows: String =
        (0..40).map(|k| format!("{},{k}\n", (full - 200_000 + 10_000 * k) % full)).collect();
    let log = read_text(format!("time_us,u\n{rows}")).unwrap();
    assert_eq!(
        notes(&log),
        ["log.csv:22: the time goes from 4294957296 to 0, where a counter of 32 bits runs out; \
          times carry on from there (1 time)"]
    );
    let times = log.channel("u").unwrap().time_s();
    assert!(times.windows(2).all(|w| (w[1] - w[0] - 0.01).abs() < 1e-9));
    assert_eq!(log.sources()[0].epoch, Epoch::Unstated);
}

#[test]
fn seconds_of_the_day_and_of_the_week_carry_on() {
    for (full, cycle, epoch) in
        [(86_400.0, "the day", Epoch::Midnight), (604_800.0, "the week", Epoch::Unstated)]
    {
        let rows: String = (0..60)
            .map(|k| format!("{},{k}\n", (full - 3.0 + 0.1 * f64::from(k)) % full))
            .collect();
        let log = read_text(format!("time [s],u\n{rows}")).unwrap();
        assert!(notes(&log)[0].contains(cycle), "{:?}", notes(&log));
        let times = log.channel("u").unwrap().time_s();
        assert!(times.windows(2).all(|w| (w[1] - w[0] - 0.1).abs() < 1e-6), "{cycle}");
        assert_eq!(log.sources()[0].epoch, epoch);
    }
}

#[test]
fn a_log_that_starts_anew_is_still_refused() {
    let error = read_text("time [s],u\n500,1\n501,2\n502,3\n0,4\n1,5\n2,6\n").unwrap_err();
    assert!(matches!(error, seaplant_log::Error::TimeGoesBackwards { line: 5, .. }), "{error}");
}

#[test]
fn days_of_the_calendar_in_a_table_become_seconds_since_1970() {
    // datenum('01-Jan-2020') is 737791, as MATLAB documents.
    let rows: String =
        (0..20).map(|k| format!("{:.9},{k}\n", 737_791.0 + f64::from(k) / 864e3)).collect();
    let log = read_text(format!("time,u\n{rows}")).unwrap();
    assert_eq!(
        notes(&log),
        ["log.csv: times are days of the calendar in \"time\" (datenum), taken as UTC: seconds \
          since the Unix epoch"]
    );
    let times = log.channel("u").unwrap().time_s();
    assert!((times[0] - 1_577_836_800.0).abs() < 1e-3 && (times[10] - times[0] - 1.0).abs() < 1e-3);
    assert_eq!(log.sources()[0].epoch, Epoch::Unix);
}

#[test]
fn counts_that_only_1970_explains_are_taken_as_such() {
    let log =
        read_text("timestamp,u\n1600000000000,1\n1600000000100,2\n1600000000200,3\n").unwrap();
    assert_eq!(
        notes(&log),
        ["log.csv: times are milliseconds since the Unix epoch, by their size: no unit is stated"]
    );
    assert!((log.channel("u").unwrap().time_s()[1] - 1_600_000_000.1).abs() < 1e-6);
    assert_eq!(log.sources()[0].epoch, Epoch::Unix);
}

#[test]
fn the_epoch_of_clean_logs_is_reported_too() {
    for (text, epoch) in [
        ("time [s],u\n0,1\n1,2\n", Epoch::Unstated),
        ("time [s],u\n1600000000.5,1\n1600000001.5,2\n", Epoch::Unix),
        ("time,u\n2020-09-13T12:26:40Z,1\n2020-09-13T12:26:41Z,2\n", Epoch::Unix),
        ("time,u\n12:26:40,1\n12:26:41,2\n", Epoch::Midnight),
    ] {
        assert_eq!(read_text(text).unwrap().sources()[0].epoch, epoch, "{text}");
    }
}
