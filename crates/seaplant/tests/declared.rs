//! Every file of tests is a module of `tests/main.rs`; Cargo runs no others.
//!
//! The tests of `seaplant-log`, `seaplant-campaign`, `seaplant-control` and `seaplant-plan` include
//! it by path.

use std::fs;
use std::path::Path;

#[test]
fn every_file_of_tests_is_a_module_of_main() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let main = fs::read_to_string(folder.join("main.rs")).expect("sources are text");
    let modules: Vec<&str> =
        main.lines().filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';')).collect();
    for entry in fs::read_dir(&folder).expect("the folder is readable") {
        let file = entry.expect("the folder is readable").file_name();
        let Some(name) = file.to_str().and_then(|file| file.strip_suffix(".rs")) else { continue };
        let runs = name == "main" || modules.contains(&name);
        assert!(runs, "tests/{name}.rs does not run: add `mod {name};` to tests/main.rs");
    }
}
