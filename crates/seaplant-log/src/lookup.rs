//! Finds a column by a name that a user wrote.

use std::path::Path;

use crate::Error;
use crate::spelling::{fold, nearest};

/// A column that may be requested.
pub(crate) struct Candidate<'a> {
    pub(crate) column: &'a str,
    pub(crate) name: &'a str,
    pub(crate) path: &'a Path,
    /// True if it holds no value, so that a column of the same name with values is preferred.
    pub(crate) empty: bool,
}

/// Finds `wanted` among `candidates`: by header text, by name, then without regard to case; or as
/// `FILE:COLUMN`.
///
/// # Errors
/// [`Error::Ambiguous`] and [`Error::NoChannel`].
pub(crate) fn find(wanted: &str, candidates: &[Candidate<'_>]) -> Result<usize, Error> {
    let all: Vec<usize> = (0..candidates.len()).collect();
    let mut tried = (wanted, all.clone());
    if let Some(found) = pick(wanted, wanted, &all, candidates)? {
        return Ok(found);
    }
    for (colon, _) in wanted.match_indices(':') {
        let (file, column) = (wanted[..colon].trim(), wanted[colon + 1..].trim());
        let of_file: Vec<usize> =
            all.iter().copied().filter(|&k| names_file(file, candidates[k].path)).collect();
        if of_file.is_empty() {
            continue;
        }
        if let Some(found) = pick(wanted, column, &of_file, candidates)? {
            return Ok(found);
        }
        tried = (column, of_file);
    }
    Err(missing(tried.0, &tried.1, candidates))
}

/// Returns the candidate among `among` that `text` names, if any.
fn pick(
    wanted: &str,
    text: &str,
    among: &[usize],
    candidates: &[Candidate<'_>],
) -> Result<Option<usize>, Error> {
    let folded = fold(text);
    let passes: [&dyn Fn(&Candidate<'_>) -> bool; 3] =
        [&|c| c.column == text.trim(), &|c| c.name == text.trim(), &|c| {
            fold(c.name) == folded || fold(c.column) == folded
        }];
    for pass in passes {
        let mut hits: Vec<usize> =
            among.iter().copied().filter(|&k| pass(&candidates[k])).collect();
        if hits.iter().any(|&k| !candidates[k].empty) {
            hits.retain(|&k| !candidates[k].empty);
        }
        match hits[..] {
            [] => {}
            [only] => return Ok(Some(only)),
            _ => {
                let choices = hits.iter().map(|&k| address(&candidates[k], candidates)).collect();
                return Err(Error::Ambiguous { wanted: wanted.to_owned(), choices });
            }
        }
    }
    Ok(None)
}

/// Returns whether `file` names `path`: its last components, or its name without extension.
fn names_file(file: &str, path: &Path) -> bool {
    !file.is_empty() && (path.ends_with(file) || path.file_stem().is_some_and(|s| s == file))
}

/// Returns `FILE:COLUMN`, with as much of the path as distinguishes the file from the others.
fn address(candidate: &Candidate<'_>, all: &[Candidate<'_>]) -> String {
    let name = candidate.path.file_name();
    let shared = all.iter().any(|c| c.path != candidate.path && c.path.file_name() == name);
    match name {
        Some(name) if !shared => format!("{}:{}", name.to_string_lossy(), candidate.column),
        _ => format!("{}:{}", candidate.path.display(), candidate.column),
    }
}

fn missing(wanted: &str, among: &[usize], candidates: &[Candidate<'_>]) -> Error {
    let mut paths = Vec::new();
    for &k in among {
        if !paths.iter().any(|p| p == candidates[k].path) {
            paths.push(candidates[k].path.to_owned());
        }
    }
    let filled = || among.iter().map(|&k| &candidates[k]).filter(|c| !c.empty);
    let spellings = filled().flat_map(|c| [(c.column, c.column), (c.name, c.column)]);
    let near = nearest(wanted, spellings, 3).into_iter().map(str::to_owned).collect();
    let available = filled().map(|c| c.column.to_owned()).collect();
    Error::NoChannel { wanted: wanted.to_owned(), paths, nearest: near, available }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate<'a>(column: &'a str, name: &'a str, path: &'a str) -> Candidate<'a> {
        Candidate { column, name, path: Path::new(path), empty: false }
    }

    #[test]
    fn the_header_goes_before_the_name_and_the_name_before_its_case() {
        let all = [
            candidate("u [m/s]", "u", "a/dvl.csv"),
            candidate("u", "u", "a/dvl.csv"),
            candidate("U", "U", "a/dvl.csv"),
            candidate("Heave  Rate [m/s]", "Heave  Rate", "a/dvl.csv"),
        ];
        let found = |name| find(name, &all).unwrap();
        assert_eq!((found("u"), found(" u [m/s] "), found("U")), (1, 0, 2));
        assert_eq!((found("heave rate"), found("heave rate [M/S]")), (3, 3));
    }

    #[test]
    fn a_column_may_hold_a_colon() {
        let all = [candidate("a:b", "a:b", "log.csv"), candidate("b", "b", "a.csv")];
        assert_eq!((find("a:b", &all).unwrap(), find("a.csv:b", &all).unwrap()), (0, 1));
        assert_eq!(find("log:a:b", &all).unwrap(), 0);
    }
}
