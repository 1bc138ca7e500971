//! What is printed and what is written: nothing half-written stays behind.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anstyle::{AnsiColor, Style};
use anyhow::{Context, Result};
use serde::Serialize;
use serde_json::json;

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
            let message = json!({ "error": format!("{error:#}") });
            let _ = writeln!(anstream::stderr(), "{message:#}");
        } else {
            let _ = writeln!(anstream::stderr(), "{SEVERE}error:{SEVERE:#} {error:#}");
        }
    }
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

/// Writes files into a folder, all or none: they are written aside first and moved into
/// place when every one is complete.
///
/// Other files in the folder stay as they are.
pub fn write_folder(folder: &Path, files: &[File]) -> Result<()> {
    let cannot = || format!("cannot write to {}; nothing was changed there", folder.display());
    let is_new = !folder.exists();
    fs::create_dir_all(folder).with_context(cannot)?;
    let written =
        write_aside(folder, files).and_then(|aside| move_into(folder, aside.path(), files));
    if written.is_err() && is_new {
        // Only an empty folder can be removed, so nothing of value is lost.
        let _ = fs::remove_dir(folder);
    }
    written.with_context(cannot)
}

fn write_aside(folder: &Path, files: &[File]) -> Result<tempfile::TempDir> {
    let aside = tempfile::Builder::new().prefix(".seaplant-").tempdir_in(folder)?;
    for file in files {
        let path = aside.path().join(&file.path);
        let parent = path.parent().unwrap_or(aside.path());
        fs::create_dir_all(parent)?;
        write_whole(&path, &file.bytes)?;
    }
    Ok(aside)
}

fn move_into(folder: &Path, aside: &Path, files: &[File]) -> Result<()> {
    for file in files {
        let target = folder.join(&file.path);
        fs::create_dir_all(target.parent().unwrap_or(folder))?;
        fs::rename(aside.join(&file.path), &target)
            .with_context(|| format!("cannot put {} in place", target.display()))?;
    }
    Ok(())
}

/// Writes one file, whole or not at all.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    let cannot = || format!("cannot write {}; it was not changed", path.display());
    let folder = match path.parent() {
        Some(parent) if parent != Path::new("") => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    let write = || -> Result<()> {
        let mut aside = tempfile::NamedTempFile::new_in(&folder)?;
        aside.write_all(bytes)?;
        aside.flush()?;
        aside.persist(path)?;
        Ok(())
    };
    write().with_context(cannot)
}

fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = fs::File::create(path)?;
    file.write_all(bytes)
        .and_then(|()| file.flush())
        .with_context(|| format!("cannot write {}", path.display()))
}
