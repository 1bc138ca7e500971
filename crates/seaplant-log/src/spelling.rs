//! Compares names by similarity, and lists them in messages.

/// Number of names that a message lists before "and N more".
const LISTED: usize = 12;

/// Normalises case and spacing.
pub(crate) fn fold(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase()
}

/// Returns the targets of the spellings most similar to `wanted`, at most `limit`, the nearest
/// first.
pub(crate) fn nearest<'a>(
    wanted: &str,
    spellings: impl Iterator<Item = (&'a str, &'a str)>,
    limit: usize,
) -> Vec<&'a str> {
    /// Jaro–Winkler similarity below which two names have little but letters in common.
    const ALIKE: f64 = 0.8;
    let wanted = fold(wanted);
    let mut scored: Vec<(f64, &str)> = spellings
        .map(|(spelling, target)| (strsim::jaro_winkler(&wanted, &fold(spelling)), target))
        .filter(|(score, _)| *score >= ALIKE)
        .collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut found: Vec<&str> = Vec::new();
    for (_, target) in scored {
        if found.len() < limit && !found.contains(&target) {
            found.push(target);
        }
    }
    found
}

/// Lists names in quotes: the first twelve, then "and N more".
pub(crate) fn list(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().take(LISTED).map(|n| format!("{n:?}")).collect();
    match names.len().saturating_sub(LISTED) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_comes_first_and_strangers_never() {
        let names = ["depth", "heading", "heave"];
        let near = |wanted| nearest(wanted, names.iter().map(|n| (*n, *n)), 3);
        assert_eq!(near("heav"), ["heave", "heading"]);
        assert_eq!(near("xyz"), Vec::<&str>::new());
    }
}
