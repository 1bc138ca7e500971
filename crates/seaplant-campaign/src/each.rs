//! Trials that are alike: one for each log of a pattern.

use std::path::{Path, PathBuf};

use crate::campaign_file::{LogEntry, TrialEntry};
use crate::{Error, toml_file};

/// More trials than these are a pattern that matches what was not meant.
const MOST_TRIALS: usize = 10_000;

/// The trials of a campaign with each pattern replaced by the trials that it stands for.
///
/// # Errors
/// [`Error::Value`] if a trial has both `log` and `each`, or a pattern matches no file.
pub(crate) fn expanded(path: &Path, trials: Vec<TrialEntry>) -> Result<Vec<TrialEntry>, Error> {
    let mut all = Vec::new();
    for trial in trials {
        let Some(each) = &trial.each else {
            all.push(trial);
            continue;
        };
        let refuse = |reason: String| Error::value(path, format!("trial `{}`", trial.name), reason);
        if !trial.log.files().is_empty() {
            return Err(refuse("has both log and each; keep one".to_owned()));
        }
        let mut logs = Vec::new();
        for pattern in each.files() {
            let found = matching(path, pattern)?;
            if found.is_empty() {
                let shown = pattern.display();
                return Err(refuse(format!(
                    "each = \"{shown}\" matches no file; check the folder and the name"
                )));
            }
            logs.extend(found);
        }
        if logs.len() > MOST_TRIALS {
            return Err(refuse(format!(
                "each matches {} files; name them more closely",
                logs.len()
            )));
        }
        all.extend(logs.into_iter().map(|log| one(&trial, log)));
    }
    Ok(all)
}

/// The trial of one log of a pattern.
fn one(of: &TrialEntry, log: PathBuf) -> TrialEntry {
    let stem = log.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = if of.name.is_empty() { stem } else { format!("{} {stem}", of.name) };
    TrialEntry { name, log: LogEntry::One(log), each: None, ..of.clone() }
}

/// The files of a pattern in order, as they would be named in the campaign; a name without `*`
/// and `?` is itself.
fn matching(path: &Path, pattern: &Path) -> Result<Vec<PathBuf>, Error> {
    let name = pattern.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if !name.contains(['*', '?']) {
        return Ok(vec![pattern.to_owned()]);
    }
    let folder = pattern.parent().unwrap_or(Path::new(""));
    let place = toml_file::resolve(path, &folder.join("."))?;
    let failed = |source| Error::Io { path: place.clone(), source };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(&place).map_err(failed)? {
        let file = entry.map_err(failed)?.file_name();
        if matches(name.as_bytes(), file.to_string_lossy().as_bytes()) {
            found.push(folder.join(file));
        }
    }
    found.sort();
    Ok(found)
}

/// Whether a name is of a pattern in which `*` stands for any text and `?` for one byte.
fn matches(pattern: &[u8], name: &[u8]) -> bool {
    let (mut p, mut n) = (0, 0);
    // Where the last `*` stands, and what it stood for when it was last tried.
    let mut star: Option<(usize, usize)> = None;
    while n < name.len() {
        match pattern.get(p) {
            Some(b'*') => {
                star = Some((p, n));
                p += 1;
            }
            Some(&c) if c == b'?' || c == name[n] => {
                p += 1;
                n += 1;
            }
            _ => {
                let Some((at, stood_for)) = star else { return false };
                star = Some((at, stood_for + 1));
                p = at + 1;
                n = stood_for + 1;
            }
        }
    }
    pattern[p..].iter().all(|c| *c == b'*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_stand_for_any_text() {
        let is = |pattern: &str, name: &str| matches(pattern.as_bytes(), name.as_bytes());
        assert!(is("zigzag_*.csv", "zigzag_31-Jul.csv") && is("*", "") && is("a*b*c", "aXbYbZc"));
        assert!(!is("zigzag_*.csv", "turn.csv") && !is("a?c", "ac") && is("a?c", "abc"));
        let many = "*a".repeat(200);
        assert!(!is(&many, &"a".repeat(150)));
    }
}
