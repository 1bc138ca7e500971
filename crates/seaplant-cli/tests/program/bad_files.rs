//! Campaigns that cannot be identified: each message states where, what and the remedy.

use seaplant::IdentifyOptions;

use crate::workshop::{Workshop, log};

#[test]
fn the_campaign_that_the_others_break_is_sound() {
    let found = Workshop::new().json(&["identify", "campaign.toml", "--json"]);
    assert_eq!(found["failures"], serde_json::json!([]));
    assert!(found["plants"]["surge"].is_object());
}

#[test]
fn a_missing_column_brings_the_near_one() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "\"prop\"", "\"porp\"");
    assert_eq!(
        workshop.refusal(),
        "trial `run 1`, thruster.prop.speed: no column \"porp\" in log.csv; did you mean \
         \"prop [rpm]\"? the columns are \"prop [rpm]\", \"speed [m/s]\""
    );
}

#[test]
fn a_unit_of_another_dimension_in_the_campaign_is_refused() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "\"speed\"", "\"speed\", unit = \"m\"");
    assert_eq!(
        workshop.refusal(),
        "trial `run 1`, velocity.surge, column `speed [m/s]`: \"m\" is a unit of length where one \
         of velocity is needed; write one of m/s, cm/s, mm/s, km/h, kn, ft/s"
    );
}

#[test]
fn a_unit_of_another_dimension_in_the_header_is_refused() {
    let workshop = Workshop::new();
    workshop.change("log.csv", "speed [m/s]", "speed [rpm]");
    let message = workshop.refusal();
    let start = "trial `run 1`, velocity.surge, column `speed [rpm]`: \"rpm\" is a unit of ";
    assert!(message.starts_with(start), "{message}");
    assert!(message.ends_with("write one of m/s, cm/s, mm/s, km/h, kn, ft/s"), "{message}");
}

#[test]
fn an_invalid_unit_suggests_the_nearest_one() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "\"speed\"", "\"speed\", unit = \"m/sec.\"");
    let message = workshop.refusal();
    let start = "trial `run 1`, velocity.surge, column `speed [m/s]`: unknown unit \"m/sec.\"; ";
    assert!(message.starts_with(start), "{message}");
    assert!(message.ends_with("did you mean \"m/s\"?"), "{message}");
}

#[test]
fn an_unstated_unit_is_requested() {
    let workshop = Workshop::new();
    workshop.change("log.csv", "speed [m/s]", "speed");
    assert_eq!(
        workshop.refusal(),
        "trial `run 1`, velocity.surge: column `speed` states no unit; write it in the header, as \
         `speed [m/s]`, or in the campaign, as { column = \"speed\", unit = \"m/s\" }"
    );
}

#[test]
fn an_unknown_key_of_the_campaign_is_shown_in_its_line() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "dof = [\"surge\"]\n", "dof = [\"surge\"]\nform_s = 3.0\n");
    let message = workshop.refusal();
    let start =
        "campaign.toml: TOML parse error at line 6, column 1\n  |\n6 | form_s = 3.0\n  | ^^^^^^\n";
    assert!(message.starts_with(start), "{message}");
    assert!(message.ends_with("\ndid you mean `from_s`?"), "{message}");
}

#[test]
fn an_unknown_key_of_the_vehicle_is_shown_in_its_line() {
    let workshop = Workshop::new();
    workshop.change("vehicle.toml", "position_m", "postion_m");
    let message = workshop.refusal();
    let start = "vehicle.toml: TOML parse error at line 4, column 1\n  |\n4 | postion_m = [0.0, 0.0, 0.0]\n  | ^^^^^^^^^\n";
    assert!(message.starts_with(start), "{message}");
    assert!(message.ends_with("\ndid you mean `position_m`?"), "{message}");
}

#[test]
fn an_unknown_method_is_shown_in_its_line() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "[[trial]]", "methods = [\"papper\"]\n[[trial]]");
    let message = workshop.refusal();
    assert!(
        message.starts_with("campaign.toml: TOML parse error at line 2, column 12"),
        "{message}"
    );
    assert!(message.ends_with("\ndid you mean `paper`?"), "{message}");
}

#[test]
fn a_key_that_is_missing_is_named() {
    let workshop = Workshop::new();
    workshop.change("vehicle.toml", "direction = [1.0, 0.0, 0.0]\n", "");
    let message = workshop.refusal();
    assert!(message.starts_with("vehicle.toml: thruster `"), "{message}");
    let advice = "missing field `direction`\nadd `direction = ...` there\n";
    assert!(message.contains(advice) && message.ends_with("^^^^^^"), "{message}");
}

#[test]
fn an_unknown_quantity_brings_the_near_one() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "velocity.surge", "velcity.surge");
    assert_eq!(
        workshop.refusal(),
        "campaign.toml: channels.\"velcity.surge\": is not a known quantity; did you \
         mean `velocity.surge`?\n  |\n9 | \"velcity.surge\" = { column = \"speed\" }\n  | ^^^^^^^^^^^^^^^"
    );
}

#[test]
fn an_unknown_quantity_of_a_thruster_brings_the_near_one() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "thruster.prop.speed", "thruster.prop.sped");
    assert_eq!(
        workshop.refusal(),
        "campaign.toml: channels.\"thruster.prop.sped\": is not a known quantity; did \
         you mean `thruster.prop.speed`?\n  |\n8 | \"thruster.prop.sped\" = { column = \"prop\" }\n  | ^^^^^^^^^^^^^^^^^^^^"
    );
}

#[test]
fn an_unknown_quantity_like_no_other_brings_all() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "velocity.surge", "zzz");
    let message = workshop.refusal();
    let start =
        "campaign.toml: channels.\"zzz\": unknown quantity `zzz`; it may be thruster.NAME.speed, ";
    assert!(message.starts_with(start), "{message}");
    assert!(message.contains("dvl.velocity.x"), "{message}");
}

#[test]
fn a_thruster_that_the_vehicle_lacks_is_named() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "thruster.prop.speed", "thruster.bow.speed");
    assert_eq!(
        workshop.refusal(),
        "campaign.toml: channels.\"thruster.bow.speed\": the vehicle has no thruster `bow` but \
         prop; add it to the vehicle, or leave this out\n  |\n8 | \"thruster.bow.speed\" = \
         { column = \"prop\" }\n  | ^^^^^^^^^^^^^^^^^^^^"
    );
    workshop.change("campaign.toml", "thruster.bow.speed", "thruster.Prop.speed");
    assert_eq!(
        workshop.refusal(),
        "campaign.toml: channels.\"thruster.Prop.speed\": the vehicle has no thruster `Prop`; did \
         you mean `prop`?\n  |\n8 | \"thruster.Prop.speed\" = { column = \"prop\" }\n  | ^^^^^^^^^^^^^^^^^^^^^"
    );
}

#[test]
fn a_thruster_too_many_is_not_left_out_unseen() {
    let workshop = Workshop::new();
    let bow = "[channels]\n\"thruster.bow.speed\" = { column = \"prop\" }";
    workshop.change("campaign.toml", "[channels]", bow);
    assert!(workshop.refusal().contains("the vehicle has no thruster `bow`"));
}

#[test]
fn a_thruster_that_no_column_drives_is_named() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "\"thruster.prop.speed\" = { column = \"prop\" }\n", "");
    assert_eq!(
        workshop.refusal(),
        "campaign.toml: trial `run 1` has no thruster.prop.speed; map it under [channels]: its \
         curve reads it"
    );
}

#[test]
fn an_empty_log_is_refused() {
    let workshop = Workshop::new();
    workshop.write("log.csv", "");
    assert_eq!(
        workshop.refusal(),
        "trial `run 1`: log.csv is empty; check that the recording was saved and copied whole"
    );
}

#[test]
fn a_log_of_a_header_alone_is_refused() {
    let workshop = Workshop::new();
    workshop.write("log.csv", "time [s],prop [rpm],speed [m/s]\n");
    let message = workshop.refusal();
    assert!(
        message.starts_with("trial `run 1`: log.csv holds 0 usable row(s) of data"),
        "{message}"
    );
    assert!(message.ends_with("check that the recording was saved and copied whole"), "{message}");
}

#[test]
fn a_log_of_one_row_is_refused() {
    let workshop = Workshop::new();
    workshop.write("log.csv", "time [s],prop [rpm],speed [m/s]\n0,1,2\n");
    assert_eq!(
        workshop.refusal(),
        "trial `run 1`: log.csv holds 1 usable row(s) of data and at least 2 are needed; check \
         that the recording was saved and copied whole"
    );
}

#[test]
fn a_log_of_three_rows_is_too_short() {
    let workshop = Workshop::new();
    workshop.write("log.csv", "time [s],prop [rpm],speed [m/s]\n0,1,2\n1,2,3\n2,3,4\n");
    let message = workshop.refusal();
    assert!(message.contains("use a longer stretch of log"), "{message}");
}

#[test]
fn random_bytes_are_no_log() {
    let workshop = Workshop::new();
    // Numerical Recipes' generator: no file format begins so.
    let mut state = 1_u32;
    let bytes: Vec<u8> = std::iter::repeat_with(|| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state.to_be_bytes()[0]
    })
    .take(5000)
    .collect();
    workshop.write("log.csv", bytes);
    assert_eq!(
        workshop.refusal(),
        "trial `run 1`: log.csv: unsupported format (looks like binary data); export it as CSV"
    );
}

#[test]
fn a_packed_log_is_to_be_unpacked() {
    let workshop = Workshop::new();
    workshop.write("log.csv", b"BZh91AY&SY");
    assert_eq!(
        workshop.refusal(),
        "trial `run 1`: log.csv: unsupported format (looks like a bzip2 archive (unpack it \
         first)); export it as CSV"
    );
}

#[test]
fn a_channel_without_a_value_is_refused() {
    let workshop = Workshop::new();
    let text = workshop.read("log.csv");
    let lines = text.lines().enumerate().map(|(k, line)| match line.rsplit_once(',') {
        Some((before, _)) if k > 0 => format!("{before},NaN\n"),
        _ => format!("{line}\n"),
    });
    workshop.write("log.csv", lines.collect::<String>());
    assert_eq!(
        workshop.refusal(),
        "trial `run 1`, velocity.surge: column \"speed [m/s]\" of log.csv is empty: no value in \
         any of its 1200 rows; choose another, or check that the instrument was on"
    );
}

#[test]
fn constant_thrust_determines_no_plant() {
    let workshop = Workshop::new();
    workshop.write("log.csv", log(|_| 80.0));
    let advice = "the surge trial excites 2 of the 3 requested terms: thrust or speed is constant, \
                  or zero, or one follows the other; drop a term or use a trial with more \
                  variation of thrust and speed";
    let methods = IdentifyOptions::default().methods;
    let names: Vec<&str> = methods.iter().map(|method| method.name()).collect();
    let names = names.join(", ");
    let expected = format!("no plant could be identified:\n  surge by {names}: {advice}");
    assert_eq!(workshop.refusal(), expected);
}

#[test]
fn a_failing_method_does_not_stop_the_others() {
    let workshop = Workshop::new();
    let text = workshop.read("log.csv");
    let three_seconds: Vec<&str> = text.lines().take(31).collect();
    workshop.write("log.csv", three_seconds.join("\n") + "\n");
    let why = "surge by paper: trial `run 1`, at 10.0 Hz and without its gaps, in surge has 30 \
               samples and needs at least 80; use a longer stretch of log\n";
    let identify = workshop.seaplant(&["identify", "campaign.toml", "--out", "out"]).assert();
    // Another method identified the axis.
    let output = identify.success().get_output().clone();
    let said = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(said.contains(&format!("failed: {why}")), "{said}");
    assert!(said.contains("surge by filter-error"), "{said}");
    assert!(workshop.join("out/report.html").is_file());
    // Errors are printed even with `-q`.
    let quiet = workshop.seaplant(&["identify", "campaign.toml", "--out", "out", "-q"]).assert();
    quiet.success().stdout("").stderr(format!("error: {why}"));
    // A method that was asked for has to have an answer.
    let chosen = ["--method", "filter-error", "--method", "paper", "--out", "out"];
    workshop.seaplant(&[&["identify", "campaign.toml"], &chosen[..]].concat()).assert().code(1);
}

#[test]
fn files_whose_clocks_share_no_time_are_refused() {
    let workshop = Workshop::new();
    let text = workshop.read("log.csv");
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let props = rows.iter().map(|row| format!("{},{}\n", row[0], row[1]));
    let speeds = rows.iter().map(|row| match row[0].parse::<f64>() {
        Ok(time_s) => format!("{},{}\n", time_s + 1e6, row[2]),
        Err(_) => format!("{},{}\n", row[0], row[2]),
    });
    workshop.write("prop.csv", props.collect::<String>());
    workshop.write("speed.csv", speeds.collect::<String>());
    workshop.change("campaign.toml", "\"log.csv\"", "[\"prop.csv\", \"speed.csv\"]");
    assert_eq!(
        workshop.refusal(),
        "campaign.toml: trial `run 1`: the surge motion, from 1000000.0 to 1000119.9 s, and the \
         surge thrust, from 0.0 to 119.9 s, do not overlap; check the clocks of the files \
         (offset_s), the time units, and from_s and to_s"
    );
}

#[test]
fn a_trial_that_cannot_be_used_is_left_out_by_name_and_the_campaign_goes_on() {
    let workshop = Workshop::quick();
    let campaign = workshop.read("campaign.toml");
    let burst = "[[trial]]\nname = \"burst\"\nlog = \"log.csv\"\ndof = [\"surge\"]\nto_s = 0.5\n\n[channels]";
    workshop.write("campaign.toml", campaign.replace("[channels]", burst));
    let said = workshop.success(&["identify", "campaign.toml", "--out", "out"]);
    assert!(said.contains("surge by equation-error"), "{said}");
    let why = "trial `burst` is left out: the surge motion of trial `burst` has 6 samples";
    assert!(said.contains(why), "{said}");
    // With no other trial to fit, the error stands.
    let workshop = Workshop::quick();
    workshop.write(
        "campaign.toml",
        campaign.replace("dof = [\"surge\"]\n", "dof = [\"surge\"]\nto_s = 0.5\n"),
    );
    let message = workshop.refusal();
    assert!(message.contains("has 6 samples and needs at least 10"), "{message}");
}

#[test]
fn a_window_outside_of_the_log_is_refused() {
    let workshop = Workshop::new();
    let window = "dof = [\"surge\"]\nfrom_s = 500.0\nto_s = 600.0\n";
    workshop.change("campaign.toml", "dof = [\"surge\"]\n", window);
    let message = workshop.refusal();
    assert!(message.contains("trial `run 1`"), "{message}");
    assert!(message.contains("the trial's window, from 500.0 to 600.0 s"), "{message}");
}

#[test]
fn a_clock_that_goes_back_is_reported_with_its_line() {
    let workshop = Workshop::new();
    let text = workshop.read("log.csv");
    let lines: Vec<&str> = text.lines().collect();
    // The second minute repeats the first.
    let again = [&lines[..601], &lines[1..600]].concat();
    workshop.write("log.csv", again.join("\n"));
    assert_eq!(
        workshop.refusal(),
        "trial `run 1`: log.csv:602: time goes back from 59.9 s to 0 s and stays behind; split \
         the file there, correct the row before if its time is wrong, or name another time column \
         in campaign.toml under [time]"
    );
}

#[test]
fn a_variable_that_is_not_set_is_named() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "\"log.csv\"", "\"${SEAPLANT_NO_SUCH_PLACE}/log.csv\"");
    let words = "campaign.toml: path \"${SEAPLANT_NO_SUCH_PLACE}/log.csv\": the environment variable \
         `SEAPLANT_NO_SUCH_PLACE` is not set; set it, or write the path out\n  |\n4 | log = \
         \"${SEAPLANT_NO_SUCH_PLACE}/log.csv\"\n  |       ";
    let mark = "^".repeat("\"${SEAPLANT_NO_SUCH_PLACE}/log.csv\"".len());
    assert_eq!(workshop.refusal(), format!("{words}{mark}"));
}

#[test]
fn a_log_that_is_not_there_is_reported_with_its_path() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "\"log.csv\"", "\"dives/12.csv\"");
    let message = workshop.refusal();
    assert!(message.starts_with("trial `run 1`: cannot read dives/12.csv: "), "{message}");
    assert!(message.ends_with("; check the spelling and the folder"), "{message}");
    assert_eq!(message.matches("cannot read").count(), 1, "{message}");
}

#[test]
fn a_campaign_or_vehicle_that_is_not_there_is_reported_with_its_path() {
    let workshop = Workshop::new();
    let absent = workshop.failure(&["identify", "absent.toml"]);
    assert!(absent.starts_with("cannot read absent.toml: "), "{absent}");
    workshop.change("campaign.toml", "vehicle.toml", "rov.toml");
    let message = workshop.refusal();
    assert!(message.starts_with("cannot read rov.toml: "), "{message}");
    let advice = "; check the spelling (a path inside a file is relative to that file)";
    assert!(message.ends_with(advice), "{message}");
}

#[test]
fn a_log_in_place_of_a_campaign_is_no_toml() {
    let message = Workshop::new().failure(&["identify", "log.csv"]);
    assert!(message.starts_with("log.csv: TOML parse error at line 1, column "), "{message}");
}

#[test]
fn a_campaign_without_a_trial_to_fit_says_so() {
    let workshop = Workshop::quick();
    workshop.change("campaign.toml", "dof = [\"surge\"]", "dof = [\"surge\"]\nrole = \"hold-out\"");
    assert_eq!(
        workshop.refusal(),
        "no plant could be identified:\n  no trial has role = \"fit\" or \"steady\""
    );
}

#[test]
fn an_error_is_json_where_json_was_asked_for() {
    let workshop = Workshop::new();
    workshop.write("log.csv", "");
    let output = workshop.seaplant(&["identify", "campaign.toml", "--json"]).assert().code(1);
    let said: serde_json::Value =
        serde_json::from_slice(&output.get_output().stderr).expect("JSON");
    let message = said["error"].as_str().expect("text");
    assert!(message.starts_with("trial `run 1`: log.csv is empty"), "{message}");
}
