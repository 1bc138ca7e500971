//! What is printed and what is written: nothing half-written stays behind.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anstyle::{AnsiColor, Style};
use anyhow::{Context, Result, bail};
use serde::Serialize;
use serde_json::json;
use tempfile::TempDir;

/// How much a command says, and in what form.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// As JSON.
    pub json: bool,
    /// Nothing but errors and what was asked for.
    pub quiet: bool,
}

/// Bold red.
pub const SEVERE: Style = AnsiColor::Red.on_default().bold();
/// Bold yellow.
pub const WARNING: Style = AnsiColor::Yellow.on_default().bold();
/// Bold.
pub const STRONG: Style = Style::new().bold();
/// Faint.
pub const FAINT: Style = Style::new().dimmed();

impl Output {
    /// Says something that a person may want to know and a program does not.
    pub fn say(self, text: &str) -> Result<()> {
        if self.json || self.quiet {
            return Ok(());
        }
        print(text)
    }

    /// Gives the result: as JSON if that was asked for, else in words.
    pub fn give(self, value: &impl Serialize, words: impl FnOnce() -> String) -> Result<()> {
        if self.json {
            return print(&serde_json::to_string_pretty(value)?);
        }
        if self.quiet { Ok(()) } else { print(&words()) }
    }

    /// Says why nothing could be done.
    pub fn error(self, error: &anyhow::Error) {
        // An error that cannot be printed cannot be helped either.
        if self.json {
            let message = json!({ "error": reasons(error) });
            let _ = writeln!(anstream::stderr(), "{message:#}");
        } else {
            let _ = writeln!(anstream::stderr(), "{SEVERE}error:{SEVERE:#} {}", reasons(error));
        }
    }
}

/// An error with its causes, but not those that its own words hold already.
fn reasons(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text += &format!(": {cause}");
        }
    }
    text
}

/// Prints to standard output; a reader that has gone away, such as `head`, is no error.
pub fn print(text: &str) -> Result<()> {
    match writeln!(anstream::stdout(), "{}", text.trim_end_matches('\n')) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(error).context("cannot print")
        }
        _ => Ok(()),
    }
}

/// A file to write, its path relative to a folder.
pub struct File {
    /// Where.
    pub path: String,
    /// What.
    pub bytes: Vec<u8>,
}

/// [`fill_folder`], from files in memory.
pub fn write_folder(folder: &Path, files: &[File]) -> Result<()> {
    fill_folder(folder, |aside| {
        files.iter().try_for_each(|file| aside.write(&file.path, |out| out.write_all(&file.bytes)))
    })
}

/// Writes files into a folder, all or none: they are written aside first and moved into
/// place when every one is complete; if one cannot be moved, all that were are taken back.
///
/// Other files in the folder stay as they are.
pub fn fill_folder(folder: &Path, fill: impl FnOnce(&mut Aside) -> Result<()>) -> Result<()> {
    let mut made = Vec::new();
    let written = fill_into(folder, fill, &mut made);
    if written.is_err() {
        // Only an empty folder can be removed, so nothing of value is lost.
        made.iter().rev().for_each(|folder| _ = fs::remove_dir(folder));
    }
    written
        .with_context(|| format!("cannot write to {}; nothing was changed there", folder.display()))
}

/// A folder for what is not complete; it goes with this, or when the program is interrupted.
struct Hidden(TempDir);

/// Names of what is not complete begin so.
const ASIDE: &str = ".seaplant-";

/// Folders that hold what is not complete.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Hidden {
    fn in_folder(folder: &Path) -> io::Result<Self> {
        let mut unfinished = unfinished();
        let made = tempfile::Builder::new().prefix(ASIDE).tempdir_in(folder)?;
        unfinished.push(made.path().to_owned());
        Ok(Self(made))
    }

    fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Drop for Hidden {
    fn drop(&mut self) {
        unfinished().retain(|path| path != self.0.path());
    }
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
        let folders = unfinished();
        for folder in folders.iter() {
            for _ in 0..TRIES {
                if fs::remove_dir_all(folder).is_ok() || !folder.exists() {
                    break;
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        std::process::exit(INTERRUPTED);
    };
    // Without the handler the system ends the program, as it would any other.
    let _ = ctrlc::set_handler(end);
}

fn fill_into(
    folder: &Path,
    fill: impl FnOnce(&mut Aside) -> Result<()>,
    made: &mut Vec<PathBuf>,
) -> Result<()> {
    make_folder(folder, made)?;
    let mut aside = Aside { aside: Hidden::in_folder(folder)?, paths: Vec::new() };
    fill(&mut aside)?;
    // From here to the end an interrupt waits.
    let _placing = unfinished();
    let mut placed = Vec::new();
    let moved = aside.paths.iter().enumerate().try_for_each(|(k, path)| {
        let target = folder.join(path);
        make_folder(target.parent().unwrap_or(folder), made)?;
        let old = aside.aside.path().join(format!("{k}.old"));
        placed.push(Placed::put(&aside.new_file(k), target, old)?);
        anyhow::Ok(())
    });
    if moved.is_err() {
        placed.iter().rev().for_each(Placed::take_back);
    }
    moved
}

/// Files that are complete and not yet in place.
pub struct Aside {
    aside: Hidden,
    /// Where they go, relative to the folder.
    paths: Vec<String>,
}

impl Aside {
    /// Writes a file that will go to a path relative to the folder.
    pub fn write(
        &mut self,
        path: &str,
        content: impl FnOnce(&mut fs::File) -> io::Result<()>,
    ) -> Result<()> {
        write_whole(&self.new_file(self.paths.len()), content)?;
        self.paths.push(path.to_owned());
        Ok(())
    }

    fn new_file(&self, k: usize) -> PathBuf {
        self.aside.path().join(format!("{k}.new"))
    }
}

/// Makes a folder and those that it lies in; the new ones are added to `made`.
fn make_folder(folder: &Path, made: &mut Vec<PathBuf>) -> Result<()> {
    let missing = folder.ancestors().take_while(|path| *path != Path::new("") && !path.exists());
    let missing: Vec<PathBuf> = missing.map(Path::to_owned).collect();
    let there = missing.last().map_or(Some(folder), |first| first.parent());
    if let Some(file) = there.filter(|path| path.is_file()) {
        bail!("{} is a file where a folder is needed; move it away", file.display());
    }
    let result = fs::create_dir_all(folder);
    made.extend(missing.into_iter().rev());
    result.with_context(|| format!("cannot make the folder {}", folder.display()))
}

/// A file that was put in place, and where that is kept which it replaced.
struct Placed {
    target: PathBuf,
    old: Option<PathBuf>,
}

impl Placed {
    fn put(new: &Path, target: PathBuf, old: PathBuf) -> Result<Self> {
        let cannot = || format!("cannot put {} in place", target.display());
        if target.is_dir() {
            bail!("{} is a folder where a file is needed; move it away", target.display());
        }
        let replaces = target.exists();
        if replaces {
            // Not every file system can name a file twice.
            fs::hard_link(&target, &old)
                .or_else(|_| fs::copy(&target, &old).map(drop))
                .with_context(cannot)?;
        }
        fs::rename(new, &target).with_context(cannot)?;
        Ok(Self { old: replaces.then_some(old), target })
    }

    /// As well as can be: the error that led here is the one to tell.
    fn take_back(&self) {
        let _ = match &self.old {
            Some(old) => fs::rename(old, &self.target),
            None => fs::remove_file(&self.target),
        };
    }
}

/// Writes one file, whole or not at all; a device or a pipe is written to as it is.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    let cannot = || format!("cannot write {}; it was not changed", path.display());
    let is_special = fs::metadata(path).is_ok_and(|data| !data.is_file() && !data.is_dir());
    if is_special {
        return write_whole(path, |out| out.write_all(bytes));
    }
    let folder = match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    let write = || -> Result<()> {
        if path.is_dir() {
            bail!("it is a folder; name a file in it");
        }
        // In a folder of its own, a file gets the permissions that files get here.
        let aside = Hidden::in_folder(folder)?;
        let new = aside.path().join("new");
        write_whole(&new, |out| out.write_all(bytes))?;
        fs::rename(new, path)?;
        Ok(())
    };
    write().with_context(cannot)
}

fn write_whole(path: &Path, content: impl FnOnce(&mut fs::File) -> io::Result<()>) -> Result<()> {
    let mut file = fs::File::create(path)?;
    content(&mut file)
        .and_then(|()| file.flush())
        .with_context(|| format!("cannot write {}", path.display()))
}
