//! Forged lists of files: nothing outside of the folder changes, and no entry of a list with an
//! invalid entry is used.

use std::fs;
use std::io::Write;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use serde_json::json;
use tempfile::TempDir;

use super::manifest::{MANIFEST, hash_of};
use super::{File, Made, Permit, Target};

/// Files inside the folder that a list may name.
const INSIDE: [&str; 2] = ["listed.txt", "deep/listed.txt"];

/// Links, a pipe and a folder inside it, which a list may not name.
const NOT_FILES: [&str; 4] = ["file-link", "folder-link", "pipe", "deep"];

/// A folder `out` with files, links and a pipe, next to a file outside of it.
struct Sandbox(TempDir);

impl Sandbox {
    fn new() -> Self {
        let sandbox = Self(tempfile::tempdir().expect("a temporary folder can be made"));
        let out = sandbox.out();
        fs::create_dir_all(out.join("deep")).expect("a folder");
        for file in INSIDE.map(|path| out.join(path)).into_iter().chain([sandbox.secret()]) {
            fs::write(&file, file.to_string_lossy().as_bytes()).expect("a file");
        }
        symlink(sandbox.secret(), out.join("file-link")).expect("a link");
        symlink(sandbox.0.path(), out.join("folder-link")).expect("a link");
        make_pipe(&out.join("pipe"));
        sandbox
    }

    fn out(&self) -> PathBuf {
        self.0.path().join("out")
    }

    fn secret(&self) -> PathBuf {
        self.0.path().join("secret.txt")
    }

    /// Writes a list of a report with these paths, each with the right hash if it leads to a
    /// regular file anywhere.
    fn forge(&self, paths: &[String]) {
        let entry = |path: &String| {
            let there = self.out().join(path).canonicalize().and_then(|file| hash_of(&file));
            let sha256 = there.unwrap_or_default();
            (path.clone(), json!({ "made": "report", "sha256": sha256 }))
        };
        let files: serde_json::Map<_, _> = paths.iter().map(entry).collect();
        let list = json!({ "schema": "seaplant/files/1", "complete": true, "files": files });
        fs::write(self.out().join(MANIFEST), list.to_string()).expect("a file");
    }

    fn write(&self, made: Made) -> anyhow::Result<()> {
        let (folder, permit) = (&self.out(), Permit::new(&[], false));
        let file = File { path: "new.txt".to_owned(), bytes: b"new".to_vec() };
        Target { folder, made: Some(made), permit }.write(&[file])
    }

    /// Returns every path with its kind, and the content of regular files.
    fn everything(&self) -> Vec<(PathBuf, String)> {
        let mut found = Vec::new();
        let mut folders = vec![self.0.path().to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).expect("a folder") {
                let path = entry.expect("an entry").path();
                let kind = path.symlink_metadata().expect("it is there").file_type();
                let content = kind.is_file().then(|| hash_of(&path).expect("a file"));
                found.push((path.clone(), format!("{kind:?} {content:?}")));
                folders.extend(kind.is_dir().then_some(path));
            }
        }
        found.sort();
        found
    }
}

/// Returns whether a path in the sandbox may be listed, from the sandbox's content.
fn may_be_listed(path: &str) -> bool {
    let parts: Vec<&str> = path.split('/').collect();
    let leads_elsewhere = parts.iter().any(|part| ["", ".", ".."].contains(part));
    let passes_a_link = ["file-link", "folder-link"].contains(&parts[0]);
    !leads_elsewhere && !passes_a_link && !NOT_FILES.contains(&path)
}

/// Generates paths of one to four parts, some of them absolute.
fn path() -> impl Strategy<Value = String> {
    let part = prop::sample::select(vec![
        "..",
        ".",
        "",
        "out",
        "secret.txt",
        "listed.txt",
        "deep",
        "file-link",
        "folder-link",
        "pipe",
        "absent",
    ]);
    prop::collection::vec(part, 1..4).prop_map(|parts| parts.join("/"))
}

/// Generates lists, about half of them valid.
fn paths() -> impl Strategy<Value = Vec<String>> {
    let good = prop::sample::select(INSIDE.to_vec()).prop_map(str::to_owned);
    prop_oneof![prop::collection::vec(good, 0..3), prop::collection::vec(path(), 0..4),]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_forged_list_changes_nothing_outside_and_a_bad_entry_refuses_all(
        paths in paths(),
        campaign: bool,
    ) {
        let sandbox = Sandbox::new();
        let made = if campaign { Made::Campaign } else { Made::Report };
        sandbox.forge(&paths);
        let before = sandbox.everything();
        let written = sandbox.write(made);
        prop_assert!(sandbox.secret().exists());
        if paths.iter().all(|path| may_be_listed(path)) {
            prop_assert!(written.is_ok(), "{:?}", written);
            for path in INSIDE {
                let is_listed = paths.iter().any(|listed| listed == path);
                prop_assert_eq!(sandbox.out().join(path).exists(), !is_listed);
            }
        } else {
            prop_assert!(written.is_err());
            prop_assert_eq!(sandbox.everything(), before);
        }
    }
}

#[test]
fn a_refused_list_is_named_with_its_entry_and_the_fault() {
    let sandbox = Sandbox::new();
    let absolute = sandbox.secret().display().to_string();
    let outside = "that is not a relative path inside the folder";
    for (path, fault) in [
        ("../secret.txt", outside),
        (absolute.as_str(), outside),
        ("deep/../listed.txt", outside),
        ("", outside),
        ("folder-link/secret.txt", "folder-link is a symbolic link"),
        ("file-link", "file-link is a symbolic link"),
        ("pipe", "pipe is not a regular file"),
        ("deep", "deep is not a regular file"),
    ] {
        sandbox.forge(&[path.to_owned()]);
        let error = sandbox.write(Made::Report).expect_err("a forged list");
        let said = format!("{error:#}");
        let list = sandbox.out().join(MANIFEST);
        let start = format!("{} lists `{path}`, but ", list.display());
        let end = "; a list with such an entry is not used: remove it, or choose another --out";
        assert!(said.contains(&start) && said.ends_with(&format!("{fault}{end}")), "{said}");
    }
}

#[test]
fn an_input_stays_even_if_the_list_has_it_as_a_file_of_an_earlier_run() {
    let sandbox = Sandbox::new();
    sandbox.forge(&INSIDE.map(str::to_owned));
    let inputs = [sandbox.out().join("listed.txt")];
    let permit = Permit::new(&inputs, false);
    let target = Target { folder: &sandbox.out(), made: Some(Made::Report), permit };
    let new =
        |staging: &mut super::StagedFiles| staging.write("new.txt", |out| out.write_all(b"new"));
    target.fill(new).expect("it can be written");
    assert_eq!(INSIDE.map(|path| sandbox.out().join(path).exists()), [true, false]);
}

#[test]
fn a_pipe_in_place_of_a_lock_or_of_the_list_ends_nothing() {
    let sandbox = Sandbox::new();
    let left = sandbox.out().join(".seaplant-left");
    fs::create_dir(&left).expect("a folder");
    for pipe in [left.join("lock"), sandbox.out().join(MANIFEST)] {
        make_pipe(&pipe);
    }
    sandbox.write(Made::Report).expect("it can be written");
    assert!(left.join("lock").exists());
}

/// Makes a pipe without a child process, which would hold the locks of concurrent tests until it
/// has started.
fn make_pipe(path: &Path) {
    nix::unistd::mkfifo(path, nix::sys::stat::Mode::S_IRWXU).expect("a pipe");
}
