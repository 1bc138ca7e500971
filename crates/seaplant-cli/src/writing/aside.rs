//! Files that are complete and not yet in place, and what becomes of them if the program ends.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::Result;
use tempfile::TempDir;

use super::manifest::hash_of;
use super::write_whole;

/// A folder for what is not complete; it goes with this, or when the program is interrupted, or,
/// if the program was killed, when the next one writes to the same place.
pub(super) struct Hidden {
    /// Locked as long as the program runs; let go before the folder is.
    _lock: fs::File,
    folder: TempDir,
    /// Whether it stays for the next run to clear.
    kept: bool,
}

/// Names of what is not complete begin so.
const ASIDE: &str = ".seaplant-";

/// The file in such a folder that says whether its program runs.
const LOCK: &str = "lock";

/// What is not complete, and the folders that were made for it, the innermost last.
struct Unfinished {
    aside: PathBuf,
    made: Vec<PathBuf>,
}

static UNFINISHED: Mutex<Vec<Unfinished>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<Unfinished>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// As long as this is held, an interrupt waits.
pub(super) fn placing() -> impl Sized {
    unfinished()
}

impl Hidden {
    /// In a folder, of which `made` were made for it.
    pub(super) fn in_folder(folder: &Path, made: &[PathBuf]) -> io::Result<Self> {
        let mut unfinished = unfinished();
        let aside = tempfile::Builder::new().prefix(ASIDE).tempdir_in(folder)?;
        let lock = fs::File::create(aside.path().join(LOCK))?;
        // Where files cannot be locked, age alone tells what is left over.
        let _ = lock.try_lock();
        unfinished.push(Unfinished { aside: aside.path().to_owned(), made: made.to_owned() });
        Ok(Self { _lock: lock, folder: aside, kept: false })
    }

    pub(super) fn path(&self) -> &Path {
        self.folder.path()
    }
}

impl Drop for Hidden {
    fn drop(&mut self) {
        // An interrupt waits until the folder is gone.
        let mut unfinished = unfinished();
        if self.kept {
            self.folder.disable_cleanup(true);
        } else {
            let _ = fs::remove_dir_all(self.folder.path());
        }
        unfinished.retain(|of| of.aside != self.folder.path());
    }
}

/// A hidden folder whose program was killed. Its lock is held, so that no other run clears it.
pub(super) struct Leftover {
    folder: PathBuf,
    _lock: Option<fs::File>,
}

impl Leftover {
    pub(super) fn path(&self) -> &Path {
        &self.folder
    }

    /// Removes it. It may be another's; what cannot be removed does no harm.
    pub(super) fn remove(self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// What runs that were killed left in a folder.
pub(super) fn leftovers(folder: &Path) -> impl Iterator<Item = Leftover> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter_map(|entry| {
        let is_ours = entry.file_name().to_string_lossy().starts_with(ASIDE);
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_ours && is_folder { left_over(entry.path()) } else { None }
    })
}

/// A hidden folder, if the program that made it is gone.
fn left_over(folder: PathBuf) -> Option<Leftover> {
    let lock = folder.join(LOCK);
    match lock.symlink_metadata() {
        // A pipe or a link is not ours, and opening a pipe would never end.
        Ok(data) if !data.is_file() => None,
        Ok(_) => {
            let lock = fs::File::options().write(true).open(lock).ok()?;
            lock.try_lock().ok()?;
            Some(Leftover { folder, _lock: Some(lock) })
        }
        // One that was made a moment ago has no lock yet.
        Err(_) if age(&folder).is_some_and(|age| age > YOUNG) => {
            Some(Leftover { folder, _lock: None })
        }
        Err(_) => None,
    }
}

/// No program takes so long from a folder to its first file.
const YOUNG: Duration = Duration::from_secs(60);

fn age(path: &Path) -> Option<Duration> {
    fs::metadata(path).ok()?.modified().ok()?.elapsed().ok()
}

/// Ends the program at Ctrl-C, or when it is asked to end, with nothing half-written left: what is
/// being put in place is first put there, the rest is removed.
pub fn leave_nothing_behind() {
    /// Of a program that an interrupt ended, as shells know it.
    const INTERRUPTED: i32 = 130;
    /// What is written meanwhile keeps a folder from being removed, but not for long.
    const TRIES: usize = 1000;
    let end = || {
        // Held to the end: nothing new is begun.
        let all = unfinished();
        for Unfinished { aside, made } in all.iter() {
            for _ in 0..TRIES {
                if fs::remove_dir_all(aside).is_ok() || !aside.exists() {
                    break;
                }
                std::thread::sleep(Duration::from_millis(1));
            }
            // Only an empty folder can be removed.
            made.iter().rev().for_each(|folder| _ = fs::remove_dir(folder));
        }
        std::process::exit(INTERRUPTED);
    };
    // A browser drops the whole folder with the page.
    #[cfg(target_family = "wasm")]
    let _ = end;
    // Without the handler the system ends the program, as it would any other.
    #[cfg(not(target_family = "wasm"))]
    let _ = ctrlc::set_handler(end);
}

/// Files that are complete and not yet in place.
pub struct Aside {
    hidden: Hidden,
    /// Where each goes, relative to the folder, and its hash.
    files: Vec<(String, String)>,
}

impl Aside {
    pub(super) fn new(hidden: Hidden) -> Self {
        Self { hidden, files: Vec::new() }
    }

    /// Writes a file that will go to a path relative to the folder.
    pub fn write(
        &mut self,
        path: &str,
        content: impl FnOnce(&mut fs::File) -> io::Result<()>,
    ) -> Result<()> {
        let new = Self::new_file(self.path(), self.files.len());
        write_whole(&new, content)?.sync_all()?;
        self.files.push((path.to_owned(), hash_of(&new)?));
        Ok(())
    }

    pub(super) fn path(&self) -> &Path {
        self.hidden.path()
    }

    /// Where the files go, in the order in which they were written.
    pub(super) fn paths(&self) -> impl Iterator<Item = &str> {
        self.files.iter().map(|(path, _)| path.as_str())
    }

    /// Each path with its hash.
    pub(super) fn hashes(&self) -> &[(String, String)] {
        &self.files
    }

    /// Leaves the folder to the next run, which puts back what is in it.
    pub(super) fn keep(&mut self) {
        self.hidden.kept = true;
    }

    /// The place of a file within the folder, by its number.
    pub(super) fn new_file(aside: &Path, k: usize) -> PathBuf {
        aside.join(format!("{k}.new"))
    }
}
