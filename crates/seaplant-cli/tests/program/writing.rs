//! Output that cannot be written: no incomplete file remains, and no existing one is lost.
//!
//! Permissions do not bind every account that runs tests, so a file blocks the path instead.

use crate::workshop::Workshop;

const IDENTIFY: [&str; 4] = ["identify", "campaign.toml", "--out", "out"];

#[test]
fn a_file_in_place_of_the_folder_stays() {
    let workshop = Workshop::quick();
    workshop.write("out", "mine");
    assert_eq!(
        workshop.refusal(),
        "cannot write to out; nothing was changed there: out is a file where a folder is needed; \
         move it away"
    );
}

#[test]
fn a_file_above_the_folder_stays() {
    let workshop = Workshop::quick();
    workshop.write("taken", "mine");
    assert_eq!(
        workshop.failure(&["identify", "campaign.toml", "--out", "taken/deep/out"]),
        "cannot write to taken/deep/out; nothing was changed there: taken is a file where a \
         folder is needed; move it away"
    );
}

#[test]
fn results_stay_complete_if_a_later_file_cannot_be_moved() {
    let workshop = Workshop::quick();
    workshop.success(&IDENTIFY);
    std::fs::remove_dir_all(workshop.join("out/figures")).expect("a folder");
    workshop.write("out/figures", "a file in the way");
    workshop.change("campaign.toml", "run 1", "another run");
    let before = workshop.everything();
    assert_eq!(
        workshop.refusal(),
        "cannot write to out; nothing was changed there: out/figures is a file where a folder is \
         needed; move it away"
    );
    assert_eq!(workshop.everything(), before);
}

#[test]
fn results_stay_complete_if_a_folder_is_in_the_place_of_a_file() {
    let workshop = Workshop::quick();
    workshop.write("out/report.html/mine.txt", "a folder in the way");
    assert_eq!(
        workshop.refusal(),
        "cannot write to out; nothing was changed there: out/report.html is a folder where a file \
         is needed; move it away"
    );
}

#[test]
fn new_output_replaces_the_old_and_leaves_other_files() {
    let workshop = Workshop::quick();
    workshop.success(&IDENTIFY);
    workshop.write("out/notes.txt", "mine");
    workshop.change("campaign.toml", "run 1", "run 2");
    workshop.success(&IDENTIFY);
    assert!(workshop.read("out/report.html").contains("run 2"));
    assert!(workshop.read("out/results.json").contains("seaplant/results/2"));
    assert_eq!(workshop.read("out/notes.txt"), "mine");
    let hidden = workshop.everything().into_iter().find(|(path, _)| {
        path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'))
    });
    assert_eq!(hidden, None);
}

#[test]
fn a_demo_that_cannot_be_written_leaves_nothing() {
    let workshop = Workshop::empty();
    workshop.write("demo/logs", "a file in the way");
    assert_eq!(
        workshop.failure(&["demo", "--out", "demo"]),
        "cannot write to demo; nothing was changed there: demo/logs is a file where a folder is \
         needed; move it away"
    );
}

#[test]
fn init_does_not_overwrite_files_without_force() {
    let workshop = Workshop::new();
    assert_eq!(
        workshop.failure(&["init", "log.csv"]),
        "./vehicle.toml exists; choose another --out, or overwrite it with --force"
    );
    workshop.success(&["init", "log.csv", "--force"]);
    assert!(
        workshop
            .read("vehicle.toml")
            .starts_with("# A first version of the vehicle, from its log.")
    );
}

#[test]
fn a_plot_is_svg_or_png() {
    let workshop = Workshop::empty();
    workshop.write("pull.csv", "speed [rad/s],thrust [N]\n-20,-4\n-10,-1\n0,0\n10,1\n20,4\n");
    let plot = |name: &str| ["thruster", "pull.csv", "--plot", name].map(str::to_owned);
    let refused = plot("curve.pdf");
    let refused: Vec<&str> = refused.iter().map(String::as_str).collect();
    assert_eq!(
        workshop.failure(&refused),
        "cannot draw to curve.pdf; give a path that ends in .svg or .png"
    );
    workshop.success(&["thruster", "pull.csv", "--plot", "curve.svg"]);
    assert!(workshop.read("curve.svg").contains("<svg"));
}

#[test]
fn a_single_file_is_written_completely_or_not_at_all() {
    let workshop = Workshop::quick();
    workshop.success(&["identify", "campaign.toml", "--out", "out", "-q"]);
    workshop.write("taken", "mine");
    let simulate = ["simulate", "out/results.json", "log.csv", "--out"];
    let message = workshop.failure(&[&simulate[..], &["taken/run.csv"]].concat());
    assert!(message.starts_with("cannot write taken/run.csv; it was not changed: "), "{message}");
    let message = workshop.failure(&[&simulate[..], &["out"]].concat());
    assert_eq!(message, "cannot write out; it was not changed: it is a folder; name a file in it");
    workshop.success(&[&simulate[..], &["run.csv"]].concat());
    let first = "time [s],force [N],measured [m/s],simulated [m/s],difference [m/s]\n";
    assert!(workshop.read("run.csv").starts_with(first));
}

#[cfg(unix)]
#[test]
fn a_single_file_gets_the_permissions_that_other_files_get() {
    use std::os::unix::fs::PermissionsExt;
    let workshop = Workshop::quick();
    workshop.success(&["identify", "campaign.toml", "--out", "out", "-q"]);
    workshop.success(&["simulate", "out/results.json", "log.csv", "--out", "run.csv"]);
    let mode = |name: &str| {
        let data = std::fs::metadata(workshop.join(name)).expect("a file");
        data.permissions().mode()
    };
    assert_eq!(mode("run.csv"), mode("log.csv"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_device_is_an_error_and_stays_a_device() {
    use std::os::unix::fs::FileTypeExt;
    let workshop = Workshop::quick();
    workshop.success(&["identify", "campaign.toml", "--out", "out", "-q"]);
    let words = ["simulate", "out/results.json", "log.csv", "--out", "/dev/full"];
    let message = workshop.failure(&words);
    assert!(message.starts_with("cannot write /dev/full: No space left on device"), "{message}");
    let kind = std::fs::metadata("/dev/full").expect("a device").file_type();
    assert!(kind.is_char_device());
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_an_error() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("a device");
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin!("seaplant"));
    let output = command.args(["schema", "twin"]).stdout(full).output().expect("it runs");
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.starts_with("error: cannot print: No space left on device"), "{said}");
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_nothing_half_written() {
    // While logs are written and plants are fitted, which takes seconds more.
    assert_eq!(interrupted(|folder| folder.join("logs").exists()), Some(130));
    // While the report is written, unless it is complete by then.
    interrupted(|folder| folder.join("campaign.toml").exists() && unfinished(folder) > 0);
}

#[test]
fn a_kill_while_results_are_replaced_leaves_those_before_or_those_after() {
    let workshop = Workshop::quick();
    workshop.write("pull.csv", "speed [rad/s],thrust [N]\n-20,-4\n-10,-1\n0,0\n10,1\n20,4\n");
    let draw = ["thruster", "pull.csv", "--plot", "out/curve.svg"];
    workshop.success(&[&IDENTIFY[..], &["-q"]].concat());
    for run in ["run 2", "run 3", "run 4"] {
        let before = workshop.everything_in("out");
        let campaign = workshop.read("campaign.toml");
        let last = campaign.lines().find(|line| line.starts_with("name")).expect("a name");
        workshop.change("campaign.toml", last, &format!("name = \"{run}\""));
        kill_while_files_are_moved(&workshop);
        // The next run that writes to the folder restores it.
        workshop.success(&draw);
        std::fs::remove_file(workshop.join("out/curve.svg")).expect("a file");
        if workshop.everything_in("out") != before {
            assert!(workshop.read("out/report.html").contains(run));
            workshop.success(&["validate", "out/results.json", "campaign.toml"]);
        }
    }
}

/// Kills a run as soon as the folder's list records that its files are replaced, or lets it end.
fn kill_while_files_are_moved(workshop: &Workshop) {
    let list = workshop.join("out/seaplant-files.json");
    let is_moving =
        || std::fs::read_to_string(&list).is_ok_and(|text| text.contains("\"complete\": false"));
    let mut run = std::process::Command::new(assert_cmd::cargo::cargo_bin!("seaplant"))
        .current_dir(workshop.path())
        .args(IDENTIFY)
        .arg("--quiet")
        .spawn()
        .expect("it starts");
    while !is_moving() && run.try_wait().expect("a child").is_none() {}
    let _ = run.kill();
    run.wait().expect("it ends");
}

/// Lists temporary folders: first that of the logs, then that of the report.
#[cfg(unix)]
fn unfinished(folder: &std::path::Path) -> usize {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(".seaplant-")).count()
}

/// Interrupts a demonstration at a given moment; returns its exit code, after checking what it
/// left.
#[cfg(unix)]
fn interrupted(at: impl Fn(&std::path::Path) -> bool) -> Option<i32> {
    let workshop = Workshop::new();
    let folder = workshop.join("out");
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin!("seaplant"))
        .current_dir(workshop.path())
        .args(["demo", "--out", "out", "--quiet"])
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("it starts");
    while !at(&folder) && child.try_wait().expect("a child").is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let interrupt = ["-INT", &child.id().to_string()];
    // The process may have ended already.
    let _ = std::process::Command::new("kill").args(interrupt).output().expect("kill");
    let code = child.wait().expect("it ends").code();
    assert_eq!(unfinished(&folder), 0);
    let names = ["report.html", "results.json", "figures", "tables"];
    let made = names.map(|name| folder.join(name).exists());
    match code {
        Some(130) => assert_eq!(made, [false; 4]),
        _ => assert_eq!((code, made), (Some(0), [true; 4])),
    }
    code
}
