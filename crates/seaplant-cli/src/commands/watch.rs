use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use notify::{Event, RecommendedWatcher, RecursiveMode, Watcher};
use seaplant::results::{Coefficient, Results};
use seaplant_campaign::campaign_files;
use seaplant_report::number::{signed_percent, significant};

use crate::args::Watch;
use crate::commands::identify::identified;
use crate::output::{FAINT, Output, STRONG};

pub fn run(arguments: &Watch, output: Output) -> Result<ExitCode> {
    let mut watch = Files::new(&arguments.identify.campaign)?;
    let mut before: Option<Results> = None;
    let mut last = Ok(ExitCode::SUCCESS);
    for round in 1.. {
        last = match identified(&arguments.identify, output) {
            Ok((found, code)) => {
                if let Some(before) = &before {
                    output.say(&moves(before, &found.results))?;
                }
                before = Some(found.results);
                Ok(code)
            }
            Err(error) => Err(error),
        };
        if arguments.rounds == Some(round) {
            break;
        }
        if let Err(error) = &last {
            output.error(error);
        }
        watch.look_again()?;
        output.say(&format!("{FAINT}waiting for a change; Ctrl-C ends{FAINT:#}"))?;
        let changed = watch.wait(Duration::from_secs_f64(arguments.settle_s))?;
        output.say(&format!("\n{STRONG}changed:{STRONG:#} {changed}\n"))?;
    }
    last
}

/// Files of a campaign, watched through their folders, because an absent one may appear.
struct Files {
    campaign: PathBuf,
    files: BTreeSet<PathBuf>,
    folders: BTreeSet<PathBuf>,
    watcher: RecommendedWatcher,
    events: Receiver<notify::Result<Event>>,
}

impl Files {
    fn new(campaign: &Path) -> Result<Self> {
        let (sender, events) = mpsc::channel();
        let watcher = notify::recommended_watcher(sender).context("cannot watch files")?;
        let (files, folders) = Default::default();
        let mut watch = Self { campaign: campaign.to_owned(), files, folders, watcher, events };
        watch.look_again()?;
        Ok(watch)
    }

    /// Updates the watched files from the campaign.
    fn look_again(&mut self) -> Result<()> {
        self.files = campaign_files(&self.campaign).iter().map(|file| absolute(file)).collect();
        for file in &self.files {
            let Some(folder) = file.parent().filter(|folder| folder.is_dir()) else { continue };
            if self.folders.contains(folder) {
                continue;
            }
            self.watcher
                .watch(folder, RecursiveMode::NonRecursive)
                .with_context(|| format!("cannot watch the folder {}", folder.display()))?;
            self.folders.insert(folder.to_owned());
        }
        Ok(())
    }

    /// Waits until a file changes and then none does for a while; returns the changed file.
    fn wait(&self, settle: Duration) -> Result<String> {
        let mut changed = BTreeSet::new();
        while changed.is_empty() {
            let event =
                self.events.recv().map_err(|_| anyhow!("files can no longer be watched"))?;
            self.note(event, &mut changed)?;
        }
        loop {
            match self.events.recv_timeout(settle) {
                Ok(event) => self.note(event, &mut changed)?,
                Err(RecvTimeoutError::Timeout) => break,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(anyhow!("files can no longer be watched"));
                }
            }
        }
        Ok(changed.into_iter().collect::<Vec<_>>().join(", "))
    }

    fn note(&self, event: notify::Result<Event>, changed: &mut BTreeSet<String>) -> Result<()> {
        let event = event.context("cannot watch files")?;
        if event.kind.is_access() {
            return Ok(());
        }
        let ours = event.paths.iter().filter(|path| self.files.contains(&absolute(path)));
        let name = |path: &PathBuf| path.file_name().map(|name| name.display().to_string());
        changed.extend(ours.filter_map(name));
        Ok(())
    }
}

/// Resolves the links of its folder; the file itself may not exist.
fn absolute(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let folder = folder.unwrap_or(Path::new(".")).canonicalize();
    match (folder, path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_owned(),
    }
}

/// Describes the change of each coefficient.
fn moves(before: &Results, after: &Results) -> String {
    let mut text = String::new();
    for (plant, found) in &after.plants {
        let Some(old) = before.plants.get(plant) else {
            text += &format!("{plant}: new\n");
            continue;
        };
        for (name, Coefficient { value, std, .. }) in &found.parameters {
            let Some(old) = old.parameters.get(name).map(|old| old.value) else {
                text += &format!("{plant} {name}: new, {}\n", significant(*value, 4));
                continue;
            };
            if *value == old {
                continue;
            }
            let part = signed_percent(value / old - 1.0);
            let stds = significant((value - old) / std, 2);
            let (old, new) = (significant(old, 5), significant(*value, 5));
            text +=
                &format!("{plant} {name}: {old} → {new} ({part}, {stds} standard deviations)\n");
        }
    }
    if text.is_empty() { "nothing moved".to_owned() } else { text }
}
