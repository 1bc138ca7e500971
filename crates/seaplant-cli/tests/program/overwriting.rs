//! Outputs never overwrite inputs, nor files that Seaplant did not write.

use sha2::{Digest, Sha256};

use crate::workshop::Workshop;

const IDENTIFY: [&str; 4] = ["identify", "campaign.toml", "--out", "out"];
const THERE: &str =
    "exists and is not as Seaplant wrote it; choose another --out, or overwrite it with --force";

fn identified() -> Workshop {
    let workshop = Workshop::quick();
    workshop.success(&[&IDENTIFY[..], &["-q"]].concat());
    workshop
}

#[test]
fn a_simulation_never_replaces_a_log_a_campaign_or_results() {
    let workshop = identified();
    for input in
        ["log.csv", "./out/../log.csv", "campaign.toml", "vehicle.toml", "out/results.json"]
    {
        for force in [&[][..], &["--force"]] {
            let words = ["simulate", "out/results.json", "log.csv", "--out", input];
            let message = workshop.failure(&[&words[..], force].concat());
            let start = format!("cannot write {input}; it was not changed: {input} is an input");
            assert!(message.starts_with(&start), "{message}");
        }
    }
}

#[test]
fn a_simulation_replaces_its_own_file_and_no_other_unless_forced() {
    let workshop = identified();
    let words = ["simulate", "out/results.json", "log.csv", "--out", "run.csv"];
    workshop.success(&words);
    workshop.success(&words);
    workshop.write("run.csv", "mine");
    let message = workshop.failure(&words);
    let end =
        "it exists and was not written by this command; name another, or overwrite it with --force";
    assert_eq!(message, format!("cannot write run.csv; it was not changed: {end}"));
    workshop.success(&[&words[..], &["--force"]].concat());
    assert!(workshop.read("run.csv").starts_with("time [s],force ["));
}

#[test]
fn a_study_replaces_its_own_table_and_never_its_twin() {
    let workshop = Workshop::new();
    workshop.write("twin.toml", "dofs = [\"surge\"]\nduration_s = 60.0\nhold_out_s = 60.0\n");
    let study = |out| {
        let words = ["monte-carlo", "twin.toml", "--runs", "1", "--method", "equation-error"];
        [&words[..], &["--out", out, "-q"]].concat()
    };
    let message = workshop.failure(&study("twin.toml"));
    assert!(message.contains("twin.toml is an input and would be overwritten"), "{message}");
    let message = workshop.failure(&study("campaign.toml"));
    assert!(message.contains("was not written by this command"), "{message}");
    let message = workshop.failure(&study("tables/table.json"));
    let end = "there is no folder tables; make it, or name a file elsewhere";
    assert_eq!(message, format!("tables/table.json: {end}"));
    workshop.success(&study("table.json"));
    workshop.success(&study("table.json"));
}

#[test]
fn manual_pages_replace_their_own_and_no_other_file() {
    let workshop = Workshop::empty();
    for _ in 0..2 {
        workshop.success(&["man", "--quiet"]);
    }
    workshop.write("man/seaplant-plot.1", "notes of my own");
    let message = workshop.failure(&["man"]);
    assert!(
        message.contains("seaplant-plot.1: it exists and was not written by this"),
        "{message}"
    );
    assert_eq!(workshop.read("man/seaplant-plot.1"), "notes of my own");
    workshop.success(&["man", "--force", "--quiet"]);
}

#[test]
fn a_plot_replaces_its_own_and_never_the_table() {
    let workshop = Workshop::empty();
    workshop.write("pull.svg", "speed [rad/s],thrust [N]\n-20,-4\n-10,-1\n0,0\n10,1\n20,4\n");
    workshop.write("mine.svg", "<svg/>");
    let plot = |name| ["thruster", "pull.svg", "--plot", name];
    assert!(workshop.failure(&plot("pull.svg")).contains("is an input"));
    assert!(workshop.failure(&plot("mine.svg")).contains("overwrite it with --overwrite"));
    workshop.success(&plot("curve.svg"));
    workshop.success(&plot("curve.svg"));
}

#[test]
fn results_replace_no_input_even_if_forced() {
    let workshop = Workshop::quick();
    workshop.write("report.html", workshop.read("log.csv"));
    workshop.change("campaign.toml", "log.csv", "report.html");
    for force in [&[][..], &["--force"]] {
        let message =
            workshop.failure(&[&["identify", "campaign.toml", "--out", "."][..], force].concat());
        assert!(
            message.contains("./report.html is an input and would be overwritten"),
            "{message}"
        );
    }
}

#[test]
fn results_that_somebody_changed_stay_unless_forced() {
    let workshop = identified();
    workshop.write("out/report.html", "my notes");
    let message = workshop.refusal();
    let start = "cannot write to out; nothing was changed there: out/report.html";
    assert_eq!(message, format!("{start} {THERE}"));
    workshop.success(&[&IDENTIFY[..], &["--force"]].concat());
    workshop.success(&IDENTIFY);
}

#[test]
fn a_twin_and_a_demo_replace_no_campaign_but_their_own() {
    let workshop = Workshop::new();
    workshop.write("twin.toml", "dofs = [\"surge\"]\nduration_s = 60.0\nhold_out_s = 60.0\n");
    for words in [&["twin", "twin.toml", "--out", "."][..], &["demo", "--out", "."]] {
        let message = workshop.failure(words);
        assert!(message.ends_with(THERE) && message.contains("./vehicle.toml exists"), "{message}");
    }
    let twin = ["twin", "twin.toml", "--out", "twin"];
    workshop.success(&twin);
    workshop.success(&twin);
    workshop.change("twin/campaign.toml", "[[trial]]", "# mine\n[[trial]]");
    let message = workshop.failure(&twin);
    assert!(message.ends_with(&format!("twin/campaign.toml {THERE}")), "{message}");
    workshop.write("twin/campaign.toml", "dofs = [\"surge\"]");
    let own = ["twin", "twin/campaign.toml", "--out", "twin", "--force"];
    assert!(workshop.failure(&own).contains("twin/campaign.toml is an input"));
}

#[test]
fn results_of_another_twin_go_with_its_logs() {
    let workshop = Workshop::empty();
    let twin = |dof: &str| {
        let spec = format!("dofs = [\"{dof}\"]\nduration_s = 60.0\nhold_out_s = 60.0\n");
        workshop.write("twin.toml", spec);
        workshop.success(&["twin", "twin.toml", "--out", "twin"]);
    };
    twin("surge");
    let identify = ["identify", "twin/campaign.toml", "--method", "equation-error"];
    workshop.success(&[&identify[..], &["--out", "twin"]].concat());
    assert!(workshop.join("twin/report.html").exists());
    assert!(workshop.join("twin/logs/surge-1/dvl.csv").exists());
    twin("sway");
    assert!(!workshop.join("twin/report.html").exists());
    assert!(!workshop.join("twin/logs/surge-1/dvl.csv").exists());
    assert!(workshop.join("twin/logs/sway-1/dvl.csv").exists());
}

#[test]
fn figures_of_an_earlier_run_are_replaced_by_those_of_a_later() {
    let workshop = identified();
    let first = workshop.join("out/series/run-1.surge.equation-error.csv");
    assert!(first.exists());
    workshop.change("campaign.toml", "run 1", "run 2");
    workshop.success(&IDENTIFY);
    assert!(!first.exists());
    assert!(workshop.join("out/series/run-2.surge.equation-error.csv").exists());
}

#[cfg(unix)]
#[test]
fn nothing_is_written_through_a_link() {
    let workshop = Workshop::quick();
    workshop.write("elsewhere/mine.txt", "mine");
    workshop.write("out/notes.txt", "mine");
    let link = |name: &str, to: &str| {
        std::os::unix::fs::symlink(workshop.join(to), workshop.join(name)).expect("a link");
    };
    link("out/figures", "elsewhere");
    let message = workshop.refusal();
    assert!(
        message.ends_with("out/figures is a symbolic link, which may point elsewhere; remove it"),
        "{message}"
    );
    std::fs::remove_file(workshop.join("out/figures")).expect("a link");
    link("out/report.html", "elsewhere/mine.txt");
    assert!(workshop.refusal().ends_with(THERE));
    workshop.success(&[&IDENTIFY[..], &["--force"]].concat());
    assert_eq!(workshop.read("elsewhere/mine.txt"), "mine");
}

#[cfg(unix)]
#[test]
fn a_forged_list_deletes_no_file_outside_of_the_results() {
    let workshop = Workshop::quick();
    let identify = ["identify", "campaign.toml"];
    workshop.success(&[&identify[..], &["-q"]].concat());
    workshop.write("elsewhere/log.csv", workshop.read("log.csv"));
    let link = workshop.join("results/link");
    std::os::unix::fs::symlink(workshop.join("elsewhere"), link).expect("a link");
    let list = workshop.read("results/seaplant-files.json");
    let absolute = workshop.join("log.csv").display().to_string();
    let outside = "that is not a relative path inside the folder";
    for (path, fault) in [
        ("../log.csv", outside),
        (absolute.as_str(), outside),
        ("link/log.csv", "results/link is a symbolic link"),
    ] {
        // With the log's hash, it is taken for a file of an earlier run that this one replaces.
        let sha256 = sha256_of(&workshop.read("log.csv"));
        let entry = format!("\"{path}\": {{ \"made\": \"report\", \"sha256\": \"{sha256}\" }}");
        let forged = list.replace("\"files\": {", &format!("\"files\": {{ {entry},"));
        workshop.write("results/seaplant-files.json", forged);
        for force in [&[][..], &["--force"]] {
            let message = workshop.failure(&[&identify[..], force].concat());
            assert!(message.contains(&format!("lists `{path}`, but {fault}")), "{message}");
        }
    }
}

/// Returns the SHA-256 of a text in hexadecimal digits.
fn sha256_of(text: &str) -> String {
    Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn leftovers_of_a_killed_run_are_cleared_and_a_running_one_is_not() {
    let workshop = Workshop::quick();
    workshop.write("out/.seaplant-dead/lock", "");
    workshop.write("out/.seaplant-dead/0.new", "half");
    workshop.write("out/.seaplant-runs/lock", "");
    let lock = std::fs::File::open(workshop.join("out/.seaplant-runs/lock")).expect("a file");
    lock.lock().expect("this system can lock files");
    workshop.success(&IDENTIFY);
    assert!(!workshop.join("out/.seaplant-dead").exists());
    assert!(workshop.join("out/.seaplant-runs").exists());
}

#[test]
fn the_folders_list_reveals_files_of_two_runs() {
    let workshop = identified();
    // As while files are moved: the state that a killed program leaves.
    workshop.change("out/seaplant-files.json", "\"complete\": true", "\"complete\": false");
    let words = "out/results.json may be of one run and the files beside it of another";
    for command in [
        &["validate", "out/results.json", "campaign.toml"][..],
        &["simulate", "out/results.json", "log.csv"],
        &["compare", "out", "out"],
    ] {
        assert!(workshop.failure(command).starts_with(words), "{command:?}");
    }
    workshop.success(&IDENTIFY);
    workshop.success(&["validate", "out/results.json", "campaign.toml"]);
}
