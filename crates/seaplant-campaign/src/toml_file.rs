//! Reads TOML files strictly: an unknown key is an error that suggests the nearest known one.

use std::path::{Path, PathBuf};

use seaplant::results::InputFile;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

use crate::bounded::{MOST_BYTES, read_bounded, text_of};
use crate::{Error, excerpt};

/// Reads a TOML file strictly: unknown keys are errors that suggest the nearest known one.
///
/// # Errors
/// [`Error::Io`] or [`Error::Toml`].
pub fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, Error> {
    Ok(read(path)?.0)
}

/// Reads values that a program gives in place of a file, as strictly; messages call them `path`.
///
/// # Errors
/// [`Error::Toml`].
pub fn of_json<T: DeserializeOwned>(path: &Path, value: serde_json::Value) -> Result<T, Error> {
    serde_json::from_value(value).map_err(|error| {
        let message = error.to_string();
        let advice = suggestion(&message, "");
        Error::Toml { path: path.to_owned(), message, advice }
    })
}

/// Reads a TOML file, and its provenance.
pub(crate) fn read<T: DeserializeOwned>(path: &Path) -> Result<(T, InputFile), Error> {
    let bytes = read_bounded(path, MOST_BYTES)?;
    let input = InputFile {
        path: path.display().to_string(),
        bytes: bytes.len() as u64,
        sha256: Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect(),
    };
    let text = String::from_utf8(bytes).map_err(|_| Error::Toml {
        path: path.to_owned(),
        message: "is not UTF-8 text".to_owned(),
        advice: "; give a TOML file here, and logs under log = [...]".to_owned(),
    })?;
    Ok((parse(path, &text)?, input))
}

pub(crate) fn parse<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, Error> {
    if let Some((found, place)) = excerpt::not_finite(text) {
        let message = format!("holds `{found}`, but a setting must be a finite number{place}");
        let advice = "\nwrite a number, or leave the key out".to_owned();
        return Err(Error::Toml { path: path.to_owned(), message, advice });
    }
    toml::from_str(text).map_err(|error| Error::Toml {
        path: path.to_owned(),
        message: plainly(error.to_string().trim_end()),
        advice: suggestion(error.message(), text),
    })
}

/// Removes the names of our types from a message: `expected struct TrialEntry` becomes a table.
fn plainly(message: &str) -> String {
    const STRUCT: &str = "expected struct ";
    let Some(at) = message.find(STRUCT) else { return message.to_owned() };
    let (before, named) = (&message[..at], &message[at + STRUCT.len()..]);
    let end = named.find(|c: char| !c.is_alphanumeric()).unwrap_or(named.len());
    format!("{before}expected a table, as [name] or {{ key = value }}{}", &named[end..])
}

/// Returns the error and advice for a missing key that the file's form does not require.
pub(crate) fn missing(path: &Path, key: &str) -> String {
    // A file that was read before but no longer exists has no comment to fill in.
    let text = text_of(path);
    let message = format!("missing field `{key}`");
    let advice = suggestion(&message, &text);
    message + &advice
}

/// Resolves a path in a file: `~` and `${VARIABLE}` are expanded, and relative paths start at the
/// folder of that file.
pub(crate) fn resolve(file: &Path, named: &Path) -> Result<PathBuf, Error> {
    let text = named.to_string_lossy();
    let full = shellexpand::full(&text).map_err(|error| {
        let reason = format!(
            "the environment variable `{}` is not set; set it, or write the path out",
            error.var_name
        );
        Error::value(file, format!("path \"{text}\""), reason)
    })?;
    Ok(file.parent().unwrap_or(Path::new("")).join(full.as_ref()))
}

/// Keys that are written in double brackets.
const LISTS: [&str; 3] = ["trial", "thruster", "plant"];

/// Derives advice from a message such as ``unknown field `postion_m`, expected one of `name`,
/// `position_m` ``.
fn suggestion(message: &str, text: &str) -> String {
    if message.ends_with("expected a sequence") {
        let is_table = message.starts_with("invalid type: map");
        let how = if is_table { "its name in double brackets: [[...]]" } else { "a list: [...]" };
        return format!("\nwrite {how}");
    }
    if message.starts_with("invalid type: string") && message.ends_with("expected f64") {
        return "\nwrite a number, without quotation marks".to_owned();
    }
    if let Some(key) = message.strip_prefix("missing field ") {
        let key = key.trim_matches('`');
        if LISTS.contains(&key) {
            return format!("\nadd [[{key}]] with what belongs to it");
        }
        let is_comment = |line: &str| line.strip_prefix('#').is_some_and(|l| names(l, key));
        let waits = text.lines().any(|line| is_comment(line.trim_start()));
        let how = if waits { "; the file holds it as a comment to fill in" } else { "" };
        return format!("\nadd `{key} = ...` there{how}");
    }
    let Some((found, expected)) = message
        .strip_prefix("unknown field ")
        .or_else(|| message.strip_prefix("unknown variant "))
        .and_then(|rest| rest.split_once(", expected "))
    else {
        return String::new();
    };
    let found = found.trim_matches('`');
    let known = expected.split('`').skip(1).step_by(2);
    nearest(found, known).map_or_else(String::new, |near| format!("\ndid you mean `{near}`?"))
}

/// Returns whether a line gives a value to a key.
fn names(line: &str, key: &str) -> bool {
    line.trim_start().strip_prefix(key).is_some_and(|rest| rest.trim_start().starts_with('='))
}

/// Returns the known name that is most similar to the given one, if any is similar.
pub(crate) fn nearest<'a>(
    found: &str,
    known: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    known
        .into_iter()
        .map(|name| (strsim::jaro_winkler(&found.to_lowercase(), &name.to_lowercase()), name))
        .filter(|(likeness, _)| *likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only its errors matter here")]
    struct Sample {
        position_m: [f64; 3],
        direction: [f64; 3],
    }

    #[test]
    fn an_unknown_key_brings_its_line_and_the_near_one() {
        let text = "direction = [1.0, 0.0, 0.0]\npostion_m = [0.0, 0.0, 0.0]\n";
        let error = parse::<Sample>(Path::new("vehicle.toml"), text).expect_err("misspelt");
        let message = error.to_string();
        assert!(message.contains("line 2, column 1"), "{message}");
        assert!(message.ends_with("did you mean `position_m`?"), "{message}");
    }

    #[derive(Debug, serde::Deserialize)]
    struct Holder {
        #[expect(dead_code, reason = "only its errors matter here")]
        sample: Sample,
    }

    #[test]
    fn a_value_where_a_table_belongs_is_reported_in_words_of_the_file() {
        let error = parse::<Holder>(Path::new("vehicle.toml"), "sample = 3\n").expect_err("3");
        let message = error.to_string();
        assert!(message.contains("expected a table, as [name] or { key = value }"), "{message}");
        assert!(!message.contains("Sample"), "{message}");
    }

    #[test]
    fn a_path_with_an_unset_variable_is_refused_by_name() {
        let named = Path::new("${SEAPLANT_NO_SUCH_VARIABLE}/dive.csv");
        let error = resolve(Path::new("dives/campaign.toml"), named).expect_err("unset");
        let message = error.to_string();
        assert!(message.contains("`SEAPLANT_NO_SUCH_VARIABLE` is not set"), "{message}");
    }

    #[test]
    fn a_relative_path_starts_at_the_file_that_names_it() {
        let found = resolve(Path::new("dives/campaign.toml"), Path::new("12/dvl.csv"));
        assert_eq!(found.expect("plain"), Path::new("dives/12/dvl.csv"));
    }

    #[test]
    fn a_key_like_no_other_brings_no_guess() {
        let error = parse::<Sample>(Path::new("v.toml"), "zzz = 1").expect_err("unknown");
        assert!(!error.to_string().contains("did you mean"));
    }
}
