//! Proposes an initial vehicle.toml and campaign.toml from a log.
//!
//! Values that the log does not contain are left out, so that reading the files reports them; a
//! placeholder read by accident would be a wrong number that looks right.

use std::path::{Path, PathBuf};

use seaplant::Dof;
use seaplant_log::{Log, ReadOptions};

mod activity;
mod campaign_text;
mod together;
mod trial;
mod vehicle_text;
mod write;

use activity::{Window, driven, thrust_varies, windows};
use trial::ProposedTrial;
use write::relative;

use crate::columns::{Mapped, Session, map, sessions};
use crate::preset::VehiclePreset;

/// Two files to finish by hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// The text of vehicle.toml.
    pub vehicle_toml: String,
    /// The text of campaign.toml.
    pub campaign_toml: String,
    /// Decisions left to the user, a line each; the files say the same where it matters.
    pub open_questions: Vec<String>,
}

/// Proposes the files for a log.
///
/// `files` are the log's files as the user named them, in the log's order; the campaign names them
/// relative to `base`, the folder that it will be written to. `options` are those with which they
/// were read, so that the campaign reads them alike; `preset` is the vehicle, if the user states a
/// known one.
pub fn propose(
    log: &Log,
    files: &[PathBuf],
    base: &Path,
    options: &ReadOptions,
    preset: Option<VehiclePreset>,
) -> Proposal {
    let sessions = sessions(log);
    let mapping = map(log, &sessions);
    let mut trials: Vec<ProposedTrial> = Vec::new();
    for (index, session) in sessions.iter().enumerate() {
        trials.extend(trials_of(log, files, base, index, session, &mapping.sessions[index]));
    }
    make_names_differ(&mut trials);
    hold_out_the_last(&mut trials);
    let (vehicle_toml, of_vehicle) = vehicle_text::write(log, &mapping, preset);
    let (campaign_toml, of_campaign) = campaign_text::write(log, &mapping, &trials, options);
    let open_questions = [("vehicle.toml", of_vehicle), ("campaign.toml", of_campaign)]
        .into_iter()
        .flat_map(|(file, all)| all.into_iter().map(move |question| format!("{file}: {question}")))
        .collect();
    Proposal { vehicle_toml, campaign_toml, open_questions }
}

fn trials_of(
    log: &Log,
    files: &[PathBuf],
    base: &Path,
    index: usize,
    session: &Session,
    mapped: &[Mapped],
) -> Vec<ProposedTrial> {
    let named = |&source: &usize| files.get(source).unwrap_or(&log.sources()[source].path);
    let logs: Vec<String> =
        session.sources.iter().map(|source| relative(named(source), base)).collect();
    let name = session_name(&session.sources.iter().map(named).collect::<Vec<_>>());
    let windows = windows(log, session, mapped);
    let several = windows.len() > 1;
    let trial = |(k, window): (usize, Window)| {
        let scores = driven(log, session, mapped, &window);
        ProposedTrial {
            name: if several { format!("{name} {}", k + 1) } else { name.clone() },
            logs: logs.clone(),
            session: index,
            window,
            dof: scores.first().map_or(Dof::Surge, |(dof, _)| *dof),
            together: together::moved(log, session, mapped, &window),
            scores,
            varies: thrust_varies(log, session, mapped, &window),
            hold_out: false,
        }
    };
    windows.into_iter().enumerate().map(trial).collect()
}

/// Returns a file's name without extension; for several files, their folder's.
fn session_name(files: &[&PathBuf]) -> String {
    let of_folder = || files.first()?.parent()?.file_name();
    let of_file = || files.first()?.file_stem();
    let name = if files.len() > 1 { of_folder().or_else(of_file) } else { of_file() };
    name.map_or_else(|| "trial".to_owned(), |name| name.to_string_lossy().into_owned())
}

fn make_names_differ(trials: &mut [ProposedTrial]) {
    for k in 0..trials.len() {
        let name = trials[k].name.clone();
        let taken = |name: &str| trials[..k].iter().any(|before| before.name == name);
        let free = (2..).map(|n| format!("{name} ({n})")).find(|name| !taken(name));
        if let Some(free) = free.filter(|_| taken(&name)) {
            trials[k].name = free;
        }
    }
}

/// Holds out the last trial of each degree of freedom with two trials or more, and of the trials
/// that move several axes together; one of constant thrust only if there is no better.
fn hold_out_the_last(trials: &mut [ProposedTrial]) {
    for kind in Dof::ALL.into_iter().map(Some).chain([None]) {
        let of_kind = |k: &usize| trials[*k].alone() == kind;
        let of_dof: Vec<usize> = (0..trials.len()).filter(of_kind).collect();
        let varied: Vec<usize> = of_dof.iter().copied().filter(|&k| trials[k].varies).collect();
        let candidates = if varied.len() > 1 { varied } else { of_dof };
        if let [_, .., last] = candidates[..] {
            trials[last].hold_out = true;
        }
    }
}
