//! Expands `log = "runs/*.csv"` to a trial for each file that the pattern matches.

use std::fs;
use std::path::{Component, Path, PathBuf};

use seaplant_log::is_bag;

use crate::campaign_file::{LogEntry, TrialEntry};
use crate::toml_file::resolve;
use crate::{CampaignFile, Error};

/// Limit on matches; a pattern with more is a mistake.
const MOST_MATCHES: usize = 10_000;

/// Limit on the trials of a campaign: the logs of each are read, even if they are the same for all.
const MOST_TRIALS: usize = 10_000;

impl CampaignFile {
    /// Expands each pattern to a trial per match, in the order of their names; `path` is the file's
    /// own.
    ///
    /// `*` matches any letters and `?` one, within a name between slashes. A folder that matches
    /// stands for its files, logged simultaneously; that of a ROS 2 bag is one log. The trial's
    /// name is that of its entry and the text that the pattern's wildcards match.
    ///
    /// # Errors
    /// [`Error::Value`] for a pattern without a match, or that is one of several logs, and for more
    /// than [`MOST_TRIALS`] trials.
    pub(crate) fn with_patterns(mut self, path: &Path) -> Result<Self, Error> {
        let check_count = |count: usize| match count {
            0..=MOST_TRIALS => Ok(()),
            _ => {
                let reason = format!("makes more than {MOST_TRIALS} trials; split the campaign");
                Err(Error::value(path, "trial", reason))
            }
        };
        check_count(self.trial.len())?;
        let mut trials = Vec::with_capacity(self.trial.len());
        for entry in self.trial {
            trials.extend(expanded(path, entry)?);
            check_count(trials.len())?;
        }
        self.trial = trials;
        Ok(self)
    }
}

fn expanded(path: &Path, entry: TrialEntry) -> Result<Vec<TrialEntry>, Error> {
    let refuse =
        |reason: String| Err(Error::value(path, format!("trial `{}`", entry.name), reason));
    let is_one = |log: &PathBuf| is_pattern(&log.to_string_lossy()) && !exists(path, log);
    let Some(log) = entry.log.files().iter().find(|log| is_one(log)) else {
        return Ok(vec![entry]);
    };
    if entry.log.files().len() > 1 {
        return refuse(format!(
            "has the pattern {} among several logs; give it a log of its own, or match folders: log = \"runs/*\"",
            log.display()
        ));
    }
    let full = resolve(path, log)?;
    let mut found = vec![Match { path: PathBuf::new(), stands_for: Vec::new() }];
    for component in full.components() {
        found = found.into_iter().flat_map(|of| of.step(component)).collect();
        if found.len() > MOST_MATCHES {
            return refuse(format!("{} matches more than {MOST_MATCHES} files", log.display()));
        }
    }
    if found.is_empty() {
        return refuse(format!(
            "{} matches no file; check the folder and the ending",
            log.display()
        ));
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    let base = path.parent().unwrap_or(Path::new(""));
    Ok(found.into_iter().map(|of| of.trial(base, &entry)).collect())
}

/// A path that matches the pattern so far, and the text that its wildcards match.
struct Match {
    path: PathBuf,
    stands_for: Vec<String>,
}

impl Match {
    fn step(self, component: Component<'_>) -> Vec<Self> {
        let wanted = component.as_os_str().to_string_lossy();
        if !is_pattern(&wanted) {
            let path = self.path.join(component);
            return if path.exists() { vec![Self { path, ..self }] } else { Vec::new() };
        }
        let here = if self.path == Path::new("") { Path::new(".") } else { &self.path };
        let names = fs::read_dir(here).into_iter().flatten().flatten();
        let names = names.filter_map(|entry| entry.file_name().into_string().ok());
        let fits = |name: &String| !name.starts_with('.') && matches(&wanted, name);
        let next = |name: String| {
            let path = self.path.join(&name);
            let is_file = path.is_file();
            let stem = if is_file { Path::new(&name).file_stem() } else { None };
            let mut stands_for = self.stands_for.clone();
            stands_for.push(stem.map_or(name.clone(), |stem| stem.to_string_lossy().into_owned()));
            Self { path, stands_for }
        };
        names.filter(fits).map(next).collect()
    }

    fn trial(self, base: &Path, entry: &TrialEntry) -> TrialEntry {
        let relative = |path: &Path| path.strip_prefix(base).unwrap_or(path).to_owned();
        let log = if self.path.is_dir() && !is_bag(&self.path) {
            let inside = fs::read_dir(&self.path).into_iter().flatten().flatten();
            let mut files: Vec<PathBuf> = inside
                .map(|entry| entry.path())
                .filter(|path| path.is_file() && !hidden(path))
                .map(|path| relative(&path))
                .collect();
            files.sort();
            LogEntry::Several(files)
        } else {
            LogEntry::One(relative(&self.path))
        };
        let name = format!("{} {}", entry.name, self.stands_for.join(" "));
        TrialEntry { name: name.trim().to_owned(), log, ..entry.clone() }
    }
}

fn hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'))
}

fn exists(path: &Path, log: &Path) -> bool {
    resolve(path, log).is_ok_and(|full| full.exists())
}

fn is_pattern(text: &str) -> bool {
    text.contains(['*', '?'])
}

/// Returns whether a name matches a pattern of letters, `*` and `?`, in time proportional to the
/// product of their lengths.
fn matches(pattern: &str, name: &str) -> bool {
    let name: Vec<char> = name.chars().collect();
    // Prefixes of the name that match the pattern so far.
    let mut fits = vec![false; name.len() + 1];
    fits[0] = true;
    for wanted in pattern.chars() {
        let mut next = vec![false; name.len() + 1];
        for k in 0..=name.len() {
            next[k] = match wanted {
                '*' => fits[k] || (k > 0 && next[k - 1]),
                '?' => k > 0 && fits[k - 1],
                letter => k > 0 && fits[k - 1] && name[k - 1] == letter,
            };
        }
        fits = next;
    }
    fits[name.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wildcards_match_any_letters_and_one() {
        assert!(matches("*.csv", "a.csv") && !matches("*.csv", "a.txt"));
        assert!(matches("run-?.csv", "run-7.csv") && !matches("run-?.csv", "run-12.csv"));
        assert!(matches("*a*b", "xaxxb") && !matches("*a*b", "xbxa"));
        // The time does not exceed the product of the lengths.
        assert!(!matches(&"*a".repeat(50), &"b".repeat(5000)));
    }

    fn campaign(log: &str) -> (tempfile::TempDir, Result<Vec<TrialEntry>, Error>) {
        let folder = tempfile::tempdir().expect("a folder");
        for file in
            ["runs/2.csv", "runs/10.csv", "runs/notes.txt", "days/mon/dvl.csv", "days/mon/rpm.csv"]
        {
            let path = folder.path().join(file);
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, "").expect("written");
        }
        let text = format!(
            "vehicle = \"v.toml\"\n[[trial]]\nname = \"run\"\nlog = {log}\ndof = [\"surge\"]\n"
        );
        let file: CampaignFile = toml::from_str(&text).expect("a campaign");
        let found = file.with_patterns(&folder.path().join("campaign.toml")).map(|file| file.trial);
        (folder, found)
    }

    #[test]
    fn each_match_is_a_trial_of_its_own() {
        let (_folder, trials) = campaign("\"runs/*.csv\"");
        let trials = trials.expect("two");
        let names: Vec<&str> = trials.iter().map(|trial| trial.name.as_str()).collect();
        assert_eq!(names, ["run 10", "run 2"]);
        assert_eq!(trials[1].log.files(), [PathBuf::from("runs/2.csv")]);
    }

    #[test]
    fn a_folder_stands_for_its_files_side_by_side() {
        let (_folder, trials) = campaign("\"days/*\"");
        let trials = trials.expect("one");
        assert_eq!(trials[0].name, "run mon");
        assert_eq!(trials[0].log.files().len(), 2);
    }

    #[test]
    fn a_pattern_without_a_match_or_among_others_is_refused() {
        let error = |log: &str| campaign(log).1.expect_err("refused").to_string();
        assert!(error("\"runs/*.bag\"").contains("matches no file"));
        assert!(error("[\"runs/*.csv\", \"runs/2.csv\"]").contains("among several logs"));
    }
}
