//! Completions of arguments' values.

use std::ffi::OsStr;

use clap_complete::engine::{
    ArgValueCompleter, CompletionCandidate, PathCompleter, ValueCompleter,
};

/// Completes a plant: a file, or a published table by its name.
pub fn plants() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| {
        let published = seaplant_campaign::published_names();
        let published = published.into_iter().map(|name| format!("published:{name}"));
        let begun = current.to_string_lossy();
        let mut found: Vec<CompletionCandidate> = published
            .filter(|name| name.starts_with(&*begun))
            .map(CompletionCandidate::new)
            .collect();
        found.extend(PathCompleter::any().complete(current));
        found
    })
}
