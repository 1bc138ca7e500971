//! Exchanges a folder's files for new ones, and undoes the exchange unless it is complete.
//!
//! A folder of results may be the campaign's own, a mount point or the current folder, and may hold
//! files of others, so it cannot be exchanged as one. Its files are moved one by one, and a record
//! of the exchange is kept with the replaced files. If the program is killed, the next run that
//! writes to the folder moves them back.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};

use super::listed_path::fault;
use super::manifest::{Manifest, hash_of};
use super::staging::{StagedFiles, leftovers};
use super::{Permit, create_with, make_folder, sync_folder};

/// File with the record of an exchange, in the temporary folder of replaced files.
const RECORD: &str = "exchange.json";

/// Size limit of a record: it holds a list and the paths of another.
const MOST_BYTES: u64 = 128 << 20;

/// Changes of an exchange in a folder.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Exchange {
    /// The folder's list before, where it keeps one.
    before: Option<Manifest>,
    /// New files, with their SHA-256.
    new: Vec<(String, String)>,
    /// Files that are removed and not replaced.
    stale: Vec<String>,
}

/// A file's move from one place to another.
#[derive(Debug, PartialEq)]
struct Move {
    from: PathBuf,
    to: PathBuf,
}

impl Exchange {
    /// Creates an exchange of stale files, and of those that new ones replace.
    pub(super) fn new(before: Option<Manifest>, stale: Vec<String>, staging: &StagedFiles) -> Self {
        Self { before, new: staging.hashes().to_vec(), stale }
    }

    /// Exchanges the files: all, or none if one cannot be moved. `after` is the folder's new list,
    /// where it keeps one; folders that are created are added to `made`.
    ///
    /// # Errors
    /// If a file cannot be moved. If files cannot be moved back either, all stay where they are,
    /// and the next run moves them back.
    pub(super) fn make(
        &self,
        folder: &Path,
        staging: &mut StagedFiles,
        after: Option<&Manifest>,
        made: &mut Vec<PathBuf>,
    ) -> Result<()> {
        let Err(error) = self.try_make(folder, staging.path(), after, made) else { return Ok(()) };
        if let Err(second) = self.undo(folder, staging.path()) {
            staging.keep();
            let kept = staging.path().display();
            return Err(error.context(format!(
                "files of the run before are in {kept} ({second:#}); the next run puts them back"
            )));
        }
        Err(error)
    }

    fn try_make(
        &self,
        folder: &Path,
        staging: &Path,
        after: Option<&Manifest>,
        made: &mut Vec<PathBuf>,
    ) -> Result<()> {
        let record = serde_json::to_vec(self)?;
        create_with(&staging.join(RECORD), |out| out.write_all(&record))?.sync_all()?;
        sync_folder(staging);
        if let (Some(before), Some(after)) = (&self.before, after) {
            before.beside(after).write(folder, staging)?;
        }
        let mut folders = vec![folder.to_owned()];
        for (path, _) in &self.new {
            let parent = folder.join(path).parent().unwrap_or(folder).to_owned();
            if !folders.contains(&parent) {
                make_folder(&parent, made)?;
                folders.push(parent);
            }
        }
        self.moves(folder, staging).iter().try_for_each(Move::make)?;
        folders.iter().for_each(|folder| sync_folder(folder));
        if let Some(after) = after {
            after.write(folder, staging)?;
        }
        end(staging)
    }

    /// Moves every moved file back, the last one first, and restores the list.
    fn undo(&self, folder: &Path, staging: &Path) -> Result<()> {
        self.moves(folder, staging).iter().rev().try_for_each(Move::undo)?;
        if let Some(before) = &self.before {
            before.restore(folder, staging)?;
        }
        sync_folder(folder);
        end(staging)
    }

    /// Returns every move in order. A file that is moved away or never existed leaves its path
    /// empty, so that the files present reveal which moves were made.
    fn moves(&self, folder: &Path, staging: &Path) -> Vec<Move> {
        let stale = self.stale.iter().enumerate().map(|(k, path)| Move {
            from: folder.join(path),
            to: staging.join(format!("{k}.stale")),
        });
        let replaced = self.new.iter().enumerate().flat_map(|(k, (path, _))| {
            let (place, old) = (folder.join(path), staging.join(format!("{k}.old")));
            let new = StagedFiles::new_file(staging, k);
            [Move { from: place.clone(), to: old }, Move { from: new, to: place }]
        });
        stale.chain(replaced).collect()
    }

    /// Returns the record of an incomplete exchange, if a folder has one. An incomplete record
    /// precedes all moves.
    fn left_in(staging: &Path) -> Option<Self> {
        let bytes = seaplant_campaign::read_bounded(&staging.join(RECORD), MOST_BYTES).ok()?;
        serde_json::from_slice(&bytes).ok()
    }

    /// Refuses to undo changes to files outside of the folder, to inputs, or to files that were
    /// changed after the exchange.
    fn check(&self, folder: &Path, staging: &Path, permit: Permit<'_>) -> Result<()> {
        let paths = self.new.iter().map(|(path, _)| path).chain(&self.stale);
        for path in paths {
            if let Some(fault) = fault(folder, path) {
                let record = staging.join(RECORD);
                bail!("{} names `{path}`, but {fault}; remove that folder", record.display());
            }
            let place = folder.join(path);
            if permit.check_input(&place).is_err() {
                bail!(
                    "{} is an input, and a run that wrote it was ended before it was complete; \
                     repeat that run first",
                    place.display()
                );
            }
        }
        for (k, (path, sha256)) in self.new.iter().enumerate() {
            let place = folder.join(path);
            let is_placed = !StagedFiles::new_file(staging, k).exists() && place.exists();
            if is_placed && hash_of(&place)? != *sha256 {
                bail!(
                    "{} was changed after a run was ended that wrote it; move it away, so that \
                     what it was before can be put back",
                    place.display()
                );
            }
        }
        Ok(())
    }
}

impl Move {
    fn make(&self) -> Result<()> {
        if !is_there(&self.from) {
            return Ok(());
        }
        let cannot = || format!("cannot put {} in place", self.to.display());
        fs::rename(&self.from, &self.to).with_context(cannot)
    }

    fn undo(&self) -> Result<()> {
        Move { from: self.to.clone(), to: self.from.clone() }.make_if_free()
    }

    fn make_if_free(&self) -> Result<()> {
        if is_there(&self.to) { Ok(()) } else { self.make() }
    }
}

/// Removes the record of an exchange: from here on there is nothing to undo, in whatever order the
/// other files are removed.
fn end(staging: &Path) -> Result<()> {
    let removed = fs::remove_file(staging.join(RECORD));
    sync_folder(staging);
    match removed {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error.into()),
        _ => Ok(()),
    }
}

fn is_there(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// Undoes the exchanges of killed runs, and removes their other leftovers in a folder.
///
/// The folder's lock must be held.
///
/// # Errors
/// If an exchange cannot be undone, or must not be; its files then stay where they are.
pub(super) fn recover(folder: &Path, permit: Permit<'_>) -> Result<()> {
    for leftover in leftovers(folder) {
        if let Some(exchange) = Exchange::left_in(leftover.path()) {
            exchange.check(folder, leftover.path(), permit)?;
            exchange.undo(folder, leftover.path())?;
        }
        leftover.remove();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{File, Made, Target};
    use super::*;
    use crate::writing::staging::TemporaryFolder;

    fn permit() -> Permit<'static> {
        Permit::new(&[], true)
    }

    fn file(path: &str, text: &str) -> File {
        File { path: path.to_owned(), bytes: text.as_bytes().to_vec() }
    }

    /// Makes a folder with a report of two files, and one file of the user's.
    fn written() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("mine.txt"), "mine").expect("a file");
        let target = Target { folder: folder.path(), made: Some(Made::Report), permit: permit() };
        target.write(&[file("report.html", "1"), file("figures/a.svg", "1")]).expect("written");
        folder
    }

    /// Simulates a run that is killed after this many moves of an exchange, in which one file
    /// replaces another, one a user's file, one is new and one is removed; `None` if there are
    /// fewer moves.
    fn killed_after(moves: usize, folder: &Path) -> Option<()> {
        let mut staging =
            StagedFiles::new(TemporaryFolder::in_folder(folder, &[]).expect("a folder"));
        for path in ["report.html", "mine.txt", "b.svg"] {
            staging.write(path, |out| out.write_all(b"2")).expect("a file");
        }
        let before = Manifest::read(folder).expect("a list");
        let after = before.with(Made::Report, staging.hashes());
        let stale = before.stale(Made::Report, &after, folder);
        assert_eq!(stale, ["figures/a.svg"]);
        let exchange = Exchange::new(Some(before), stale, &staging);
        let record = serde_json::to_vec(&exchange).expect("JSON");
        fs::write(staging.path().join(RECORD), record).expect("a file");
        let before = exchange.before.as_ref().expect("a list");
        before.beside(&after).write(folder, staging.path()).expect("a list");
        let all = exchange.moves(folder, staging.path());
        all.iter().take(moves).for_each(|one| one.make().expect("it can be moved"));
        staging.keep();
        (moves <= all.len()).then_some(())
    }

    fn everything(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
        let mut found = Vec::new();
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            match path.is_dir() {
                true => found.extend(everything(&path)),
                false => found.push((path.clone(), fs::read(&path).expect("a file"))),
            }
        }
        found.sort();
        found
    }

    #[test]
    fn a_run_that_is_killed_after_any_move_is_undone_by_the_next() {
        let mut moves = 0;
        loop {
            let folder = written();
            let before = everything(folder.path());
            let Some(()) = killed_after(moves, folder.path()) else { break };
            assert!(!super::super::is_complete(folder.path()));
            recover(folder.path(), permit()).expect("it can be undone");
            assert_eq!(everything(folder.path()), before, "after {moves} moves");
            moves += 1;
        }
        assert_eq!(moves, 8);
    }

    #[test]
    fn a_recovery_that_is_killed_is_completed_by_the_next() {
        for undone in 0..7 {
            let folder = written();
            let before = everything(folder.path());
            killed_after(7, folder.path()).expect("there are seven moves");
            let left = leftovers(folder.path()).next().expect("a leftover");
            let exchange = Exchange::left_in(left.path()).expect("a record");
            let all = exchange.moves(folder.path(), left.path());
            all.iter().rev().take(undone).for_each(|one| one.undo().expect("it can be moved"));
            drop(left);
            recover(folder.path(), permit()).expect("it can be undone");
            assert_eq!(everything(folder.path()), before, "after {undone} moves");
        }
    }

    #[test]
    fn a_file_that_was_changed_after_the_kill_stays_and_so_does_the_old_one() {
        let folder = written();
        killed_after(7, folder.path()).expect("there are seven moves");
        fs::write(folder.path().join("report.html"), "notes").expect("a file");
        let before = everything(folder.path());
        let error = recover(folder.path(), permit()).expect_err("refused").to_string();
        assert!(error.contains("report.html was changed after a run was ended"), "{error}");
        assert_eq!(everything(folder.path()), before);
    }

    #[test]
    fn a_forged_record_moves_nothing_outside_of_the_folder() {
        let outer = tempfile::tempdir().expect("a folder");
        let (folder, secret) = (outer.path().join("out"), outer.path().join("secret.txt"));
        fs::write(&secret, "mine").expect("a file");
        fs::create_dir_all(folder.join(".seaplant-forged")).expect("a folder");
        let staging = folder.join(".seaplant-forged");
        fs::write(staging.join("lock"), "").expect("a file");
        fs::write(staging.join("0.old"), "theirs").expect("a file");
        let sha256 = hash_of(&secret).expect("a file");
        for path in ["../secret.txt", secret.to_str().expect("UTF-8")] {
            let (new, stale) = (vec![(path.to_owned(), sha256.clone())], vec![]);
            for exchange in [
                Exchange { before: None, new, stale },
                Exchange { before: None, new: vec![], stale: vec![path.to_owned()] },
            ] {
                let record = serde_json::to_vec(&exchange).expect("JSON");
                fs::write(staging.join(RECORD), record).expect("a file");
                let before = everything(outer.path());
                let error = recover(&folder, permit()).expect_err("refused").to_string();
                assert!(error.contains("not a relative path inside the folder"), "{error}");
                assert_eq!(everything(outer.path()), before);
            }
        }
    }

    #[test]
    fn an_input_is_not_put_back() {
        let folder = written();
        killed_after(7, folder.path()).expect("there are seven moves");
        let inputs = [folder.path().join("report.html")];
        let error = recover(folder.path(), Permit::new(&inputs, true)).expect_err("refused");
        assert!(error.to_string().contains("is an input, and a run that wrote it"), "{error}");
    }
}
