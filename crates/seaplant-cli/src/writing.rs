//! What is written: whole or not at all, never over what is read, nor over what is not ours.

mod aside;
mod exchange;
#[cfg(all(test, unix))]
mod forged_lists;
mod listed_path;
mod manifest;

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use seaplant_log::is_bag;

pub use aside::{Aside, leave_nothing_behind};
pub use manifest::{Made, is_complete};

use aside::{Hidden, placing};
use exchange::{Exchange, recover};
use listed_path::first_link;
use manifest::Manifest;

/// A file to write, its path relative to a folder.
pub struct File {
    /// Where.
    pub path: String,
    /// What.
    pub bytes: Vec<u8>,
}

/// What may be written over.
#[derive(Clone, Copy, Debug)]
pub struct Permit<'a> {
    /// What was read, which never is.
    pub inputs: &'a [PathBuf],
    /// Whether files that Seaplant did not write are, too.
    pub force: bool,
    /// The flag that says so.
    pub flag: &'static str,
}

impl<'a> Permit<'a> {
    /// With `--force`.
    pub fn of(inputs: &'a [PathBuf], force: bool) -> Self {
        Self { inputs, force, flag: "--force" }
    }

    /// Refuses to write over what was read.
    fn check_input(self, target: &Path) -> Result<()> {
        let Ok(there) = target.canonicalize() else { return Ok(()) };
        // What is in the folder of a bag was read, too.
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
    /// Which.
    pub folder: &'a Path,
    /// What the files are, where the folder keeps a list of them; without one, whoever calls
    /// decides what may be written over.
    pub made: Option<Made>,
    /// What may be written over.
    pub permit: Permit<'a>,
}

impl Target<'_> {
    /// [`fill_folder`](Self::fill), from files in memory.
    pub fn write(&self, files: &[File]) -> Result<()> {
        self.fill(|aside| {
            let mut put = |file: &File| aside.write(&file.path, |out| out.write_all(&file.bytes));
            files.iter().try_for_each(&mut put)
        })
    }

    /// Refuses files that could not be written, before they are made at some cost.
    pub fn check(&self, paths: &[&str]) -> Result<()> {
        let check = || {
            let _alone = lock(self.folder);
            recover(self.folder, self.permit)?;
            let manifest = Manifest::read(self.folder)?;
            paths.iter().try_for_each(|path| self.check_file(path, &manifest))
        };
        check().with_context(|| self.cannot())
    }

    /// Writes files into the folder, all or none: they are written aside first and moved into
    /// place when every one is complete. If one cannot be moved, all that were are moved back; if
    /// the program is killed, the next run that writes there moves them back.
    ///
    /// Files of the same kind that an earlier run made, and this one does not, are removed. Others
    /// stay as they are. While files are moved, the folder's list says so.
    pub fn fill(&self, fill: impl FnOnce(&mut Aside) -> Result<()>) -> Result<()> {
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
        fill: impl FnOnce(&mut Aside) -> Result<()>,
        made: &mut Vec<PathBuf>,
    ) -> Result<()> {
        make_folder(self.folder, made)?;
        let mut aside = Aside::new(Hidden::in_folder(self.folder, made)?);
        fill(&mut aside)?;
        // From here to the end another run that writes here waits.
        let _alone = lock(self.folder);
        recover(self.folder, self.permit)?;
        let before = Manifest::read(self.folder)?;
        aside.paths().try_for_each(|path| self.check_file(path, &before))?;
        let after = self.made.map(|kind| before.with(kind, aside.hashes()));
        let stale = after.as_ref().zip(self.made);
        let stale = stale.map_or(Vec::new(), |(after, kind)| self.stale(kind, &before, after));
        let exchange = Exchange::new(self.made.map(|_| before), stale, &aside);
        // Comparing files with the list can take long; from here to the end an interrupt waits.
        let _placing = placing();
        exchange.make(self.folder, &mut aside, after.as_ref(), made)
    }

    /// Files of an earlier run that this one does not replace; no input is among them, whatever
    /// the list says.
    fn stale(&self, kind: Made, before: &Manifest, after: &Manifest) -> Vec<String> {
        let mut stale = before.stale(kind, after, self.folder);
        stale.retain(|path| self.permit.check_input(&self.folder.join(path)).is_ok());
        stale
    }

    /// Refuses to write over an input, or what is not ours, or through a link.
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

/// Keeps other runs from writing to a folder until it is dropped, where the system can.
fn lock(folder: &Path) -> Option<fs::File> {
    let file = fs::File::open(folder).ok()?;
    file.lock().ok().map(|()| file)
}

/// Makes what was moved in a folder last through a loss of power, where the system can.
fn sync_folder(folder: &Path) {
    let _ = fs::File::open(folder).and_then(|folder| folder.sync_all());
}

/// Writes one file, whole or not at all; a device or a pipe is written to as it is.
///
/// One that is there already is written over if `is_ours` knows it by its first bytes.
pub fn write_file(
    path: &Path,
    bytes: &[u8],
    permit: Permit<'_>,
    is_ours: impl Fn(&[u8]) -> bool,
) -> Result<()> {
    let cannot = || format!("cannot write {}; it was not changed", path.display());
    let is_special = fs::metadata(path).is_ok_and(|data| !data.is_file() && !data.is_dir());
    if is_special {
        return write_whole(path, |out| out.write_all(bytes)).map(drop);
    }
    check_single(path, permit, is_ours).with_context(cannot)?;
    let folder = match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    let write = || -> Result<()> {
        let alone = lock(folder);
        recover(folder, permit)?;
        drop(alone);
        // In a folder of its own, a file gets the permissions that files get here.
        let aside = Hidden::in_folder(folder, &[])?;
        let new = aside.path().join("new");
        write_whole(&new, |out| out.write_all(bytes))?.sync_all()?;
        fs::rename(new, path)?;
        sync_folder(folder);
        Ok(())
    };
    write().with_context(cannot)
}

/// Refuses one file that may not be written over, before it is made at some cost.
pub fn check_single(
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

/// Enough to know a file by; none of one that cannot be read.
fn first_bytes(path: &Path) -> Vec<u8> {
    const ENOUGH: u64 = 4096;
    let mut bytes = Vec::new();
    let _ = fs::File::open(path).and_then(|file| file.take(ENOUGH).read_to_end(&mut bytes));
    bytes
}

fn write_whole(
    path: &Path,
    content: impl FnOnce(&mut fs::File) -> io::Result<()>,
) -> Result<fs::File> {
    let mut file = fs::File::create(path)?;
    content(&mut file)
        .and_then(|()| file.flush())
        .with_context(|| format!("cannot write {}", path.display()))?;
    Ok(file)
}
