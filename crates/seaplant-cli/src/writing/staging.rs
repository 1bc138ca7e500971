//! Temporary folders of files that are complete and not yet in place, and their removal if the
//! program ends.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::Result;
use tempfile::TempDir;

use super::create_with;
use super::manifest::hash_of;

/// A temporary folder, which is removed on drop, or when the program is interrupted, or, if the
/// program was killed, when the next one writes to the same place.
pub(super) struct TemporaryFolder {
    /// Locked while the program runs; released before the folder.
    _lock: fs::File,
    folder: TempDir,
    /// True if it is left for the next run to clear.
    kept: bool,
}

/// Prefix of the names of temporary folders.
const PREFIX: &str = ".seaplant-";

/// Lock file in such a folder that shows whether its program runs.
const LOCK: &str = "lock";

/// A temporary folder, and the folders that were made for it, the innermost last.
struct Unfinished {
    staging: PathBuf,
    made: Vec<PathBuf>,
}

static UNFINISHED: Mutex<Vec<Unfinished>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<Unfinished>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Defers interrupts until the returned guard is dropped.
pub(super) fn placing() -> impl Sized {
    unfinished()
}

impl TemporaryFolder {
    /// Creates one in a folder; `made` were made for it.
    pub(super) fn in_folder(folder: &Path, made: &[PathBuf]) -> io::Result<Self> {
        let mut unfinished = unfinished();
        let staging = tempfile::Builder::new().prefix(PREFIX).tempdir_in(folder)?;
        let lock = fs::File::create(staging.path().join(LOCK))?;
        // Where files cannot be locked, only age identifies leftovers.
        let _ = lock.try_lock();
        unfinished.push(Unfinished { staging: staging.path().to_owned(), made: made.to_owned() });
        Ok(Self { _lock: lock, folder: staging, kept: false })
    }

    pub(super) fn path(&self) -> &Path {
        self.folder.path()
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        // An interrupt waits until the folder is removed.
        let mut unfinished = unfinished();
        if self.kept {
            self.folder.disable_cleanup(true);
        } else {
            let _ = fs::remove_dir_all(self.folder.path());
        }
        unfinished.retain(|of| of.staging != self.folder.path());
    }
}

/// A temporary folder whose program was killed. Its lock is held, so that no other run clears it.
pub(super) struct Leftover {
    folder: PathBuf,
    _lock: Option<fs::File>,
}

impl Leftover {
    pub(super) fn path(&self) -> &Path {
        &self.folder
    }

    /// Removes it. Failure does no harm, as it may be another user's.
    pub(super) fn remove(self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Finds temporary folders that killed runs left in a folder.
pub(super) fn leftovers(folder: &Path) -> impl Iterator<Item = Leftover> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter_map(|entry| {
        let is_ours = entry.file_name().to_string_lossy().starts_with(PREFIX);
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_ours && is_folder { left_over(entry.path()) } else { None }
    })
}

/// Returns a temporary folder, if the program that made it has ended.
fn left_over(folder: PathBuf) -> Option<Leftover> {
    let lock = folder.join(LOCK);
    match lock.symlink_metadata() {
        // A pipe or a link is not ours, and opening a pipe would never return.
        Ok(data) if !data.is_file() => None,
        Ok(_) => {
            let lock = fs::File::options().write(true).open(lock).ok()?;
            lock.try_lock().ok()?;
            Some(Leftover { folder, _lock: Some(lock) })
        }
        // A folder that was just made has no lock yet.
        Err(_) if age(&folder).is_some_and(|age| age > YOUNG) => {
            Some(Leftover { folder, _lock: None })
        }
        Err(_) => None,
    }
}

/// Time in which any program makes the first file of its folder.
const YOUNG: Duration = Duration::from_secs(60);

fn age(path: &Path) -> Option<Duration> {
    fs::metadata(path).ok()?.modified().ok()?.elapsed().ok()
}

/// Handles Ctrl-C and requests to end: completes moves in progress, removes temporary folders, and
/// ends the program.
pub fn leave_nothing_behind() {
    /// Exit code of an interrupted program, by the convention of shells.
    const INTERRUPTED: i32 = 130;
    /// Files written meanwhile prevent the removal of a folder, but not for long.
    const TRIES: usize = 1000;
    let end = || {
        // Held to the end, so that nothing new begins.
        let all = unfinished();
        for Unfinished { staging, made } in all.iter() {
            for _ in 0..TRIES {
                if fs::remove_dir_all(staging).is_ok() || !staging.exists() {
                    break;
                }
                std::thread::sleep(Duration::from_millis(1));
            }
            // Only an empty folder can be removed.
            made.iter().rev().for_each(|folder| _ = fs::remove_dir(folder));
        }
        std::process::exit(INTERRUPTED);
    };
    // A file server may remove the folder concurrently.
    #[cfg(target_family = "wasm")]
    let _ = end;
    // Without the handler the system ends the program, as any other.
    #[cfg(not(target_family = "wasm"))]
    let _ = ctrlc::set_handler(end);
}

/// Files that are complete and not yet in place.
pub struct StagedFiles {
    folder: TemporaryFolder,
    /// Target path of each, relative to the folder, and its hash.
    files: Vec<(String, String)>,
}

impl StagedFiles {
    pub(super) fn new(folder: TemporaryFolder) -> Self {
        Self { folder, files: Vec::new() }
    }

    /// Writes a file whose target path is relative to the folder.
    pub fn write(
        &mut self,
        path: &str,
        content: impl FnOnce(&mut fs::File) -> io::Result<()>,
    ) -> Result<()> {
        let new = Self::new_file(self.path(), self.files.len());
        create_with(&new, content)?.sync_all()?;
        self.files.push((path.to_owned(), hash_of(&new)?));
        Ok(())
    }

    pub(super) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Iterates over the target paths, in the order of writing.
    pub(super) fn paths(&self) -> impl Iterator<Item = &str> {
        self.files.iter().map(|(path, _)| path.as_str())
    }

    /// Returns each path with its hash.
    pub(super) fn hashes(&self) -> &[(String, String)] {
        &self.files
    }

    /// Leaves the folder to the next run, which restores its files.
    pub(super) fn keep(&mut self) {
        self.folder.kept = true;
    }

    /// Returns the path of a file within the temporary folder, by its number.
    pub(super) fn new_file(staging: &Path, k: usize) -> PathBuf {
        staging.join(format!("{k}.new"))
    }
}
