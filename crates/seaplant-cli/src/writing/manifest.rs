//! The list of files that Seaplant wrote to a folder, which may therefore be overwritten, and
//! whether the list is complete.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read, Write};
use std::path::Path;

use anyhow::{Result, bail};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::listed_path::fault;
use super::{create_with, sync_folder};

/// Its file name.
pub(super) const MANIFEST: &str = "seaplant-files.json";

/// Its version.
const SCHEMA: &str = "seaplant/files/1";

/// Origin of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Made {
    /// A twin: its campaign and logs. Files derived from an earlier one are removed with it.
    Campaign,
    /// A campaign: results, report, figures, tables.
    Report,
    /// A plant, for another tool; those for one tool do not replace those for others.
    Export,
}

impl Made {
    /// Returns whether files of `other` become obsolete once those of this kind are made again.
    const fn replaces(self, other: Self) -> bool {
        matches!((self, other), (Self::Campaign, _) | (Self::Report, Self::Report))
    }
}

/// A file on the list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Entry {
    made: Made,
    sha256: String,
    /// Hash of the file that this one replaces, during the exchange.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    before: Option<String>,
}

/// Files of a folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Manifest {
    schema: String,
    /// True if all files are of one run; false while they are replaced, and after a run that was
    /// killed then.
    complete: bool,
    files: BTreeMap<String, Entry>,
}

/// Returns whether the files of a folder are of one run, according to its list.
pub fn is_complete(folder: &Path) -> bool {
    Manifest::parse(folder).complete
}

impl Manifest {
    /// Reads the list in a folder; an empty one if there is none, or it is invalid.
    ///
    /// # Errors
    /// If an entry is anything but a relative path to a regular file inside the folder, reached
    /// through no link: whoever wrote that means another's files, so no entry is used.
    pub(super) fn read(folder: &Path) -> Result<Self> {
        let manifest = Self::parse(folder);
        for path in manifest.files.keys() {
            if let Some(fault) = fault(folder, path) {
                let list = folder.join(MANIFEST);
                bail!(
                    "{} lists `{}`, but {fault}; a list with such an entry is not used: remove \
                     it, or choose another --out",
                    list.display(),
                    path.chars().take(LONGEST_SHOWN).collect::<String>()
                );
            }
        }
        Ok(manifest)
    }

    /// Parses the list in a folder, without checking its entries.
    fn parse(folder: &Path) -> Self {
        let read = || -> Option<Self> {
            let bytes = seaplant_campaign::read_bounded(&folder.join(MANIFEST), MOST_BYTES).ok()?;
            serde_json::from_slice(&bytes).ok()
        };
        let empty = || Self { schema: SCHEMA.to_owned(), complete: true, files: BTreeMap::new() };
        read().filter(|manifest| manifest.schema == SCHEMA).unwrap_or_else(empty)
    }

    /// Returns whether a file is present and unchanged since Seaplant wrote it.
    pub(super) fn made(&self, path: &str, folder: &Path) -> bool {
        let Some(Entry { sha256, before, .. }) = self.files.get(path) else { return false };
        let found = hash_of(&folder.join(path));
        found.is_ok_and(|found| found == *sha256 || Some(found) == *before)
    }

    /// Returns the list with the new files in place.
    pub(super) fn with(&self, made: Made, new: &[(String, String)]) -> Self {
        let mut files = self.files.clone();
        files.retain(|_, entry| !made.replaces(entry.made));
        for (path, sha256) in new {
            let entry = Entry { made, sha256: sha256.clone(), before: None };
            files.insert(path.clone(), entry);
        }
        Self { schema: SCHEMA.to_owned(), complete: true, files }
    }

    /// Returns the list during the exchange, with the files before and after.
    pub(super) fn beside(&self, after: &Self) -> Self {
        let mut files = self.files.clone();
        for (path, entry) in &after.files {
            let before = self.files.get(path).map(|before| before.sha256.clone());
            files.insert(path.clone(), Entry { before, ..entry.clone() });
        }
        Self { schema: SCHEMA.to_owned(), complete: false, files }
    }

    /// Returns files of this list that the next one lacks and that may be removed: they are
    /// unchanged.
    pub(super) fn stale(&self, made: Made, after: &Self, folder: &Path) -> Vec<String> {
        let is_stale = |(path, entry): &(&String, &Entry)| {
            made.replaces(entry.made) && !after.files.contains_key(*path) && self.made(path, folder)
        };
        self.files.iter().filter(is_stale).map(|(path, _)| path.clone()).collect()
    }

    /// Restores the list; removes it if it is empty.
    pub(super) fn restore(&self, folder: &Path, staging: &Path) -> Result<()> {
        if !self.files.is_empty() {
            return self.write(folder, staging);
        }
        match fs::remove_file(folder.join(MANIFEST)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error.into()),
            _ => Ok(()),
        }
    }

    /// Writes the list, completely or not at all.
    pub(super) fn write(&self, folder: &Path, staging: &Path) -> Result<()> {
        let new = staging.join(MANIFEST);
        let text = serde_json::to_string_pretty(self)? + "\n";
        create_with(&new, |out| out.write_all(text.as_bytes()))?.sync_all()?;
        fs::rename(&new, folder.join(MANIFEST))?;
        sync_folder(folder);
        Ok(())
    }
}

/// Size limit; a hundred thousand files take a few MiB.
const MOST_BYTES: u64 = 64 << 20;

/// Length at which an error truncates a path.
const LONGEST_SHOWN: usize = 200;

/// Computes the SHA-256 of a regular file, in hexadecimal digits.
///
/// # Errors
/// If it cannot be read, or is a link, a pipe or a device, which is not opened.
pub(super) fn hash_of(path: &Path) -> io::Result<String> {
    if !path.symlink_metadata()?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    let (mut hash, mut file) = (Sha256::new(), fs::File::open(path)?);
    let mut part = vec![0; 64 * 1024];
    loop {
        match file.read(&mut part)? {
            0 => break,
            read => hash.update(&part[..read]),
        }
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}
