//! Writes files completely or not at all, never over inputs, nor over files of others.

mod exchange;
#[cfg(all(test, unix))]
mod forged_lists;
mod listed_path;
mod manifest;
mod staging;

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use seaplant_log::is_bag;

pub use manifest::{Made, is_complete};
pub use staging::{StagedFiles, leave_nothing_behind};

use exchange::{Exchange, recover};
use listed_path::first_link;
use manifest::Manifest;
use staging::{TemporaryFolder, placing};

/// A file to write, its path relative to a folder.
pub struct File {
    /// Path.
    pub path: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Files that may be overwritten.
#[derive(Clone, Copy, Debug)]
pub struct Permit<'a> {
    /// Input files, which are never overwritten.
    pub inputs: &'a [PathBuf],
    /// True if files that Seaplant did not write may be, too.
    pub force: bool,
    /// Name of the flag for that.
    pub flag: &'static str,
}

impl<'a> Permit<'a> {
    /// Creates a permit with `--force`.
    pub fn new(inputs: &'a [PathBuf], force: bool) -> Self {
        Self { inputs, force, flag: "--force" }
    }

    /// Refuses to overwrite an input.
    fn check_input(self, target: &Path) -> Result<()> {
        let Ok(there) = target.canonicalize() else { return Ok(()) };
        // Files in the folder of a bag are inputs, too.
        let is_it = |input: &PathBuf| {
            input
                .canonicalize()
                .is_ok_and(|input| input == there || (is_bag(&input) && there.starts_with(&input)))
        };
        if self.inputs.iter().any(is_it) {
            bail!(
                "{} is an input and would be overwritten; choose another --out",
                target.display()
            );
        }
        Ok(())
    }
}

/// A folder to write to.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    /// The folder.
    pub folder: &'a Path,
    /// Kind of files, where the folder keeps a list of them; without one, the caller decides what
    /// may be overwritten.
    pub made: Option<Made>,
    /// Files that may be overwritten.
    pub permit: Permit<'a>,
}

impl Target<'_> {
    /// Does the same as [`fill_folder`](Self::fill), with files in memory.
    pub fn write(&self, files: &[File]) -> Result<()> {
        self.fill(|staging| {
            let mut put = |file: &File| staging.write(&file.path, |out| out.write_all(&file.bytes));
            files.iter().try_for_each(&mut put)
        })
    }

    /// Checks that files can be written, before they are made at some cost.
    pub fn check(&self, paths: &[&str]) -> Result<()> {
        let check = || {
            let _alone = lock(self.folder);
            recover(self.folder, self.permit)?;
            let manifest = Manifest::read(self.folder)?;
            paths.iter().try_for_each(|path| self.check_file(path, &manifest))
        };
        check().with_context(|| self.cannot())
    }

    /// Writes files into the folder, all or none: they are written to a temporary folder first and
    /// moved into place when all are complete. If one cannot be moved, those already moved are
    /// moved back; if the program is killed, the next run that writes there moves them back.
    ///
    /// Files of the same kind that an earlier run made, and this one does not, are removed. Others
    /// remain. While files are moved, the folder's list records it.
    pub fn fill(&self, fill: impl FnOnce(&mut StagedFiles) -> Result<()>) -> Result<()> {
        let mut made = Vec::new();
        let written = self.fill_into(fill, &mut made);
        if written.is_err() {
            // Only an empty folder can be removed, so nothing of value is lost.
            made.iter().rev().for_each(|folder| _ = fs::remove_dir(folder));
        }
        written.with_context(|| self.cannot())
    }

    fn cannot(&self) -> String {
        format!("cannot write to {}; nothing was changed there", self.folder.display())
    }

    fn fill_into(
        &self,
        fill: impl FnOnce(&mut StagedFiles) -> Result<()>,
        made: &mut Vec<PathBuf>,
    ) -> Result<()> {
        make_folder(self.folder, made)?;
        let mut staging = StagedFiles::new(TemporaryFolder::in_folder(self.folder, made)?);
        fill(&mut staging)?;
        // From here to the end another run that writes to the folder waits.
        let _alone = lock(self.folder);
        recover(self.folder, self.permit)?;
        let before = Manifest::read(self.folder)?;
        staging.paths().try_for_each(|path| self.check_file(path, &before))?;
        let after = self.made.map(|kind| before.with(kind, staging.hashes()));
        let stale = after.as_ref().zip(self.made);
        let stale = stale.map_or(Vec::new(), |(after, kind)| self.stale(kind, &before, after));
        let exchange = Exchange::new(self.made.map(|_| before), stale, &staging);
        // Comparing files with the list can take long; from here to the end interrupts are
        // deferred.
        let _placing = placing();
        exchange.make(self.folder, &mut staging, after.as_ref(), made)
    }

    /// Returns files of an earlier run that this one does not replace; never an input, whatever the
    /// list names.
    fn stale(&self, kind: Made, before: &Manifest, after: &Manifest) -> Vec<String> {
        let mut stale = before.stale(kind, after, self.folder);
        stale.retain(|path| self.permit.check_input(&self.folder.join(path)).is_ok());
        stale
    }

    /// Refuses to overwrite an input or a foreign file, or to write through a link.
    fn check_file(&self, path: &str, manifest: &Manifest) -> Result<()> {
        let target = self.folder.join(path);
        let inner = Path::new(path).parent().unwrap_or(Path::new(""));
        if let Some(link) = first_link(self.folder, inner) {
            bail!("{} is a symbolic link, which may point elsewhere; remove it", link.display());
        }
        if target.is_dir() {
            bail!("{} is a folder where a file is needed; move it away", target.display());
        }
        self.permit.check_input(&target)?;
        let is_foreign = || target.symlink_metadata().is_ok() && !manifest.made(path, self.folder);
        if self.made.is_some() && !self.permit.force && is_foreign() {
            bail!(
                "{} exists and is not as Seaplant wrote it; choose another --out, or overwrite it \
                 with {}",
                target.display(),
                self.permit.flag
            );
        }
        Ok(())
    }
}

/// Creates a folder and its parents; the new ones are added to `made`.
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

/// Locks a folder against other runs until dropped, where the system can.
fn lock(folder: &Path) -> Option<fs::File> {
    let file = fs::File::open(folder).ok()?;
    file.lock().ok().map(|()| file)
}

/// Flushes a folder to disk, where the system can, so that moves survive a loss of power.
fn sync_folder(folder: &Path) {
    let _ = fs::File::open(folder).and_then(|folder| folder.sync_all());
}

/// Writes one file, completely or not at all; a device or a pipe is written to directly.
///
/// An existing one is overwritten if `is_ours` recognises its first bytes.
pub fn write_file(
    path: &Path,
    bytes: &[u8],
    permit: Permit<'_>,
    is_ours: impl Fn(&[u8]) -> bool,
) -> Result<()> {
    let cannot = || format!("cannot write {}; it was not changed", path.display());
    let is_special = fs::metadata(path).is_ok_and(|data| !data.is_file() && !data.is_dir());
    if is_special {
        return create_with(path, |out| out.write_all(bytes)).map(drop);
    }
    check_writable(path, permit, is_ours).with_context(cannot)?;
    let folder = folder_of(path);
    let write = || -> Result<()> {
        let alone = lock(folder);
        recover(folder, permit)?;
        drop(alone);
        // In a folder of its own, a file gets the default permissions of this place.
        let staging = TemporaryFolder::in_folder(folder, &[])?;
        let new = staging.path().join("new");
        create_with(&new, |out| out.write_all(bytes))?.sync_all()?;
        fs::rename(new, path)?;
        sync_folder(folder);
        Ok(())
    };
    write().with_context(cannot)
}

/// Checks that one file can be in its place, before it is made at some cost.
pub fn check_writable(
    path: &Path,
    permit: Permit<'_>,
    is_ours: impl Fn(&[u8]) -> bool,
) -> Result<()> {
    let folder = folder_of(path);
    if !folder.is_dir() {
        bail!("there is no folder {}; make it, or name a file elsewhere", folder.display());
    }
    check_replaceable(path, permit, is_ours)
}

/// Checks that one file may be overwritten.
pub fn check_replaceable(
    path: &Path,
    permit: Permit<'_>,
    is_ours: impl Fn(&[u8]) -> bool,
) -> Result<()> {
    if path.is_dir() {
        bail!("it is a folder; name a file in it");
    }
    permit.check_input(path)?;
    if path.is_file() && !permit.force && !is_ours(&first_bytes(path)) {
        let flag = permit.flag;
        bail!(
            "it exists and was not written by this command; name another, or overwrite it with {flag}"
        );
    }
    Ok(())
}

/// Returns the folder that a file is in.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// Reads enough bytes to recognise a file; empty if it cannot be read.
fn first_bytes(path: &Path) -> Vec<u8> {
    const ENOUGH: u64 = 4096;
    let mut bytes = Vec::new();
    let _ = fs::File::open(path).and_then(|file| file.take(ENOUGH).read_to_end(&mut bytes));
    bytes
}

fn create_with(
    path: &Path,
    content: impl FnOnce(&mut fs::File) -> io::Result<()>,
) -> Result<fs::File> {
    let mut file = fs::File::create(path)?;
    content(&mut file)
        .and_then(|()| file.flush())
        .with_context(|| format!("cannot write {}", path.display()))?;
    Ok(file)
}
