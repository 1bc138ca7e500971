//! Settings that no fit can use: refused when the file is read, with line and mark.

use crate::workshop::{Workshop, caveat, number};

/// Asserts the errors of a valid campaign with one changed file: each change, the message and the
/// marked text.
fn assert_refused(file: &str, from: &str, cases: &[(&str, &str, &str)]) {
    for (to, words, marked) in cases {
        let workshop = Workshop::quick();
        workshop.change(file, from, to);
        let message = workshop.refusal();
        assert!(message.contains(words), "{to}: {message}");
        let lines: Vec<&str> = message.lines().collect();
        let marks = lines.iter().position(|line| line.trim_start().starts_with("| "));
        let marks = marks.unwrap_or_else(|| panic!("{to}: no mark in {message}"));
        let column = lines[marks].find('^').unwrap_or_else(|| panic!("{to}: {message}"));
        let under = &lines[marks - 1][column..];
        assert!(under.starts_with(marked), "{to}: the mark stands under {under:?}");
        assert!(!message.contains("no plant could be identified"), "{to}: after the fit");
    }
}

const SECTION: &str = "[channels]\n";

fn assert_refused_settings(table: &str, cases: &[(&str, &str, &str)]) {
    let cases: Vec<(String, &str, &str)> = cases
        .iter()
        .map(|(line, words, marked)| (format!("[{table}]\n{line}\n\n{SECTION}"), *words, *marked))
        .collect();
    let cases: Vec<(&str, &str, &str)> =
        cases.iter().map(|(to, words, marked)| (to.as_str(), *words, *marked)).collect();
    assert_refused("campaign.toml", SECTION, &cases);
}

#[test]
fn a_filter_that_cannot_be_made_is_refused_in_its_line() {
    assert_refused_settings(
        "equation-error",
        &[
            (
                "term_filter = { cutoff_hz = -1.0, order = 2 }",
                "equation-error.term_filter.cutoff_hz: is -1; it must be above 0 and at most 1000 Hz",
                "cutoff_hz",
            ),
            ("term_filter = { cutoff_hz = 0.0, order = 2 }", "cutoff_hz: is 0;", "cutoff_hz"),
            ("velocity_filter = { cutoff_hz = 1e300, order = 2 }", "at most 1000 Hz", "cutoff_hz"),
            (
                "velocity_filter = { cutoff_hz = 0.5, order = 0 }",
                "equation-error.velocity_filter.order: is 0; it must be from 1 to 8",
                "order",
            ),
            ("term_filter = { cutoff_hz = 0.5, order = 60 }", "order: is 60;", "order"),
            ("term_filter = { cutoff_hz = 0.5, order = 1000000000 }", "from 1 to 8", "order"),
        ],
    );
    assert_refused_settings(
        "paper",
        &[("velocity_filter = { cutoff_hz = 0.125, order = 9 }", "paper.velocity_filter", "order")],
    );
}

#[test]
fn a_bootstrap_too_small_or_too_large_is_refused_in_its_line() {
    assert_refused_settings(
        "equation-error",
        &[
            ("bootstrap = { resamples = 0 }", "is 0; it must be from 100 to 1000000", "resamples"),
            ("bootstrap = { resamples = 100000000000 }", "from 100 to 1000000", "resamples"),
            (
                "bootstrap = { block_s = 0.0 }",
                "block_s: is 0; it must be from 1 to 86400 s",
                "block_s",
            ),
            ("bootstrap = { block_s = -5.0 }", "block_s: is -5;", "block_s"),
        ],
    );
    assert_refused_settings(
        "output-error",
        &[(
            "intervals = { bootstrap = { draws = 100000000000, seed = 1 } }",
            "output-error.intervals.bootstrap.draws: is 100000000000; it must be from 50 to 10000",
            "draws",
        )],
    );
}

#[test]
fn a_loss_that_turns_nowhere_is_refused_in_its_line() {
    let advice = "it must be above 0 and finite, such as 1.345";
    assert_refused_settings(
        "output-error",
        &[
            ("loss = { huber = 0.0 }", advice, "huber"),
            ("loss = { huber = -1.0 }", advice, "huber"),
        ],
    );
}

#[test]
fn a_gain_that_never_learns_is_refused_in_its_line() {
    assert_refused_settings(
        "online",
        &[
            ("adaptation_s = 0.0", "online.adaptation_s: is 0; it must be", "adaptation_s"),
            ("start_s = -1.0", "online.start_s: is -1;", "start_s"),
            ("cutoff_hz = 1e300", "online.cutoff_hz: is", "cutoff_hz"),
            ("memory_s = 0.0", "online.memory_s: is 0;", "memory_s"),
            ("wander_per_minute = -0.1", "zero or more", "wander_per_minute"),
        ],
    );
}

#[test]
fn invalid_steady_settings_are_refused_in_their_line() {
    assert_refused_settings(
        "steady",
        &[
            ("window_s = 0.0", "steady.window_s: is 0; it must be from 1 to 86400 s", "window_s"),
            ("window_s = -1.0", "window_s: is -1;", "window_s"),
            ("slope_m_s2 = 0.0", "steady.slope_m_s2: is 0; it must be above 0", "slope_m_s2"),
            (
                "thrust_part = 1.5",
                "thrust_part: is 1.5; it must be above 0 and at most 1",
                "thrust",
            ),
        ],
    );
}

#[test]
fn no_setting_is_nan_or_infinite() {
    for line in ["window_s = nan", "slope_m_s2 = inf", "thrust_part = -inf"] {
        let value = line.rsplit(' ').next().expect("a value");
        let words = format!("holds `{value}`, but a setting must be a finite number");
        assert_refused_settings("steady", &[(line, &words, value)]);
    }
    let nested = "bootstrap = { resamples = 500, block_s = nan }";
    assert_refused_settings("equation-error", &[(nested, "holds `nan`", "nan")]);
}

#[test]
fn a_window_or_stretch_that_runs_backward_is_refused_in_its_line() {
    let dof = "dof = [\"surge\"]\n";
    let with = |line: &str| format!("{dof}{line}\n");
    let steady = |segments: &str| format!("{dof}role = \"steady\"\nsegments_s = {segments}\n");
    let cases = [
        (with("from_s = nan"), "holds `nan`", "nan"),
        (with("from_s = 60.0\nto_s = 30.0"), "from_s must be less than to_s", "\"run 1\""),
        (with("segments_s = [[20.0, 50.0]]"), "are used only with role = \"steady\"", "segments_s"),
        (steady("[[50.0, 20.0]]"), "hold [50, 20], whose end is not after its start", "segments_s"),
        (steady("[[20.0, 50.0, 80.0]]"), "expected 2 numbers", "[[20.0"),
        (
            steady("[[40.0, 60.0], [20.0, 50.0]]"),
            "[20, 50] and [40, 60] overlap, so that samples would count twice",
            "segments_s",
        ),
    ];
    let cases: Vec<(&str, &str, &str)> =
        cases.iter().map(|(to, words, marked)| (to.as_str(), *words, *marked)).collect();
    assert_refused("campaign.toml", dof, &cases);
}

#[test]
fn a_vehicle_that_cannot_be_is_refused_in_its_line() {
    let name = "name = \"sled\"\n";
    let with = |line: &str| format!("{name}{line}\n");
    let cases = [
        (with("size_m = [1.0, 2.0, 3.0, 4.0]"), "invalid length 4, expected 3 numbers", "[1.0"),
        (with("size_m = [1.0, 2.0, inf]"), "holds `inf`", "inf"),
        (
            with("[sensor.dvl]\nstd_m_s = -0.01"),
            "sensor.dvl.std_m_s: must be a positive",
            "std_m_s",
        ),
        (with("[sensor.depth]\nstd_m = 0.0"), "sensor.depth.std_m: must be a positive", "std_m"),
        (with("[sensor.dvl]\nstd_m_s = nan"), "holds `nan`", "nan"),
        (with("[sensor.dvl]\nrotation_deg = [0.0, 0.0, inf]"), "holds `inf`", "inf"),
        (with("[sensor.dvl]\nposition_m = [0.0, 0.0]"), "invalid length 2, expected 3", "[0.0"),
    ];
    let cases: Vec<(&str, &str, &str)> =
        cases.iter().map(|(to, words, marked)| (to.as_str(), *words, *marked)).collect();
    assert_refused("vehicle.toml", name, &cases);
}

#[test]
fn a_curve_that_holds_an_input_twice_is_refused() {
    let quadratic = "{ kind = \"quadratic\", forward = 0.04, reverse = 0.04 }";
    let points = "{ kind = \"table\", input = \"speed\", points = [[-200.0, -1600.0], [0.0, 0.0], [0.0, 90.0], [200.0, 1600.0]] }";
    let words = "points hold input 0 twice; give each input one force";
    assert_refused("vehicle.toml", quadratic, &[(points, words, "curve")]);
}

#[test]
fn a_unit_of_time_without_a_column_is_that_of_the_column_with_a_name_of_time() {
    let workshop = Workshop::quick();
    let sound = workshop.json(&["identify", "campaign.toml", "--json"]);
    let text = workshop.read("log.csv");
    let rows = text.lines().skip(1).map(|row| {
        let (time_s, rest) = row.split_once(',').expect("a row");
        format!("{},{rest}\n", 1000.0 * time_s.parse::<f64>().expect("a time"))
    });
    workshop.write("log.csv", format!("time,prop [rpm],speed [m/s]\n{}", rows.collect::<String>()));
    workshop.change("campaign.toml", SECTION, &format!("[time]\nunit = \"ms\"\n\n{SECTION}"));
    let found = workshop.json(&["identify", "campaign.toml", "--json"]);
    let mass = |found| number(found, "plants.surge.by_axis.surge.mass.value");
    // The times are equal but for rounding in the last digit of a double.
    assert!((mass(&found) / mass(&sound) - 1.0).abs() < 1e-9, "{} {}", mass(&found), mass(&sound));
}

#[test]
fn a_unit_that_contradicts_the_header_of_time_is_warned_of() {
    let workshop = Workshop::quick();
    workshop.change("campaign.toml", SECTION, &format!("[time]\nunit = \"min\"\n\n{SECTION}"));
    let found = workshop.json(&["identify", "campaign.toml", "--json"]);
    let warned = caveat(&found["plants"]["surge"], "suspicious-unit");
    assert!(warned.contains("states s, but min was asked for and is used"), "{warned}");
}

#[test]
fn a_contradictory_clock_is_refused_in_its_line() {
    assert_refused_settings(
        "time",
        &[
            ("unit = \"fortnight\"", "unknown unit \"fortnight\"", "unit"),
            ("unit = \"m\"", "\"m\" is a unit of length where one of time is needed", "unit"),
            ("unit = \"s\"\nequal_sampling_hz = 10.0", "beside equal_sampling_hz", "unit"),
            (
                "equal_sampling_hz = 0.0",
                "it must be a positive number of hertz",
                "equal_sampling_hz",
            ),
            ("column = \"time\"\nequal_sampling_hz = 10.0", "leave out one", "equal_sampling_hz"),
        ],
    );
}

#[test]
fn minus_signs_of_typography_are_minus_signs() {
    let workshop = Workshop::quick();
    let sound = workshop.json(&["identify", "campaign.toml", "--json"]);
    workshop.change("log.csv", "-", "\u{2212}");
    let found = workshop.json(&["identify", "campaign.toml", "--json"]);
    assert_eq!(found["plants"], sound["plants"]);
}
