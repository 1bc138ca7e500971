//! Writes TOML: safely quoted strings, and comments next to what they explain.

use std::fmt::Write;
use std::path::{Component, Path, PathBuf};

/// A TOML file under construction.
#[derive(Default)]
pub(super) struct Page {
    pub text: String,
}

/// Column at which comments after a line start.
const MARGIN: usize = 44;

impl Page {
    pub fn line(&mut self, code: &str) {
        self.text.push_str(code);
        self.text.push('\n');
    }

    /// Writes a line and the reason for it.
    pub fn explained(&mut self, code: &str, comment: &str) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{code:<MARGIN$} # {comment}");
    }

    pub fn comment(&mut self, text: &str) {
        self.line(format!("# {text}").trim_end());
    }

    /// Writes a list of comments under a heading, unless it is empty.
    pub fn list(&mut self, heading: &str, items: &[String]) {
        if items.is_empty() {
            return;
        }
        self.comment(heading);
        for item in items {
            self.comment(&format!("  - {item}"));
        }
    }
}

/// Quotes a string for a value, a key or a comment, on one line whatever its content.
///
/// TOML's own writer spreads a string with line ends over several lines, which a key or a
/// comment must not. JSON's strings are TOML's basic strings, but for DEL.
pub(super) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string().replace('\u{7f}', "\\u007f")
}

/// Formats seconds with a decimal point, as TOML's floats have it.
pub(super) fn seconds(t: f64) -> String {
    format!("{t:?}")
}

/// Returns `file` relative to the folder `base`, with `/` between parts; absolute if no relative
/// path leads there.
pub(super) fn relative(file: &Path, base: &Path) -> String {
    let (file, base) = (resolved(file), resolved_folder(base));
    let (parts, from): (Vec<Component<'_>>, Vec<Component<'_>>) =
        (file.components().collect(), base.components().collect());
    let shared = parts.iter().zip(&from).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return literal(&file.to_string_lossy());
    }
    let up = from[shared..].iter().map(|_| "..".to_owned());
    let down = parts[shared..].iter().map(|part| part.as_os_str().to_string_lossy().into_owned());
    literal(&up.chain(down).collect::<Vec<String>>().join("/"))
}

/// Escapes a path against the expansion of `~` and `$VARIABLE`.
fn literal(path: &str) -> String {
    let path = path.replace('$', "$$");
    if path.starts_with('~') { format!("./{path}") } else { path }
}

/// Returns the absolute path, with links in its folder resolved; the file itself may be a link and
/// keeps its name.
fn resolved(file: &Path) -> PathBuf {
    match (file.parent(), file.file_name()) {
        (Some(folder), Some(name)) => resolved_folder(folder).join(name),
        _ => resolved_folder(file),
    }
}

/// Returns the absolute path without links, as far as it exists.
fn resolved_folder(folder: &Path) -> PathBuf {
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let absolute = std::path::absolute(here).unwrap_or_else(|_| here.to_owned());
    let mut missing = Vec::new();
    let mut existing = absolute.as_path();
    loop {
        if let Ok(real) = existing.canonicalize() {
            return missing.iter().rev().fold(real, |path, part| path.join(part));
        }
        let (Some(parent), Some(name)) = (existing.parent(), existing.file_name()) else {
            return absolute;
        };
        missing.push(name.to_owned());
        existing = parent;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_string_stays_on_its_line_and_reads_back() {
        for text in
            ["plain", "a \"b\" 'c' \\", "line\nend\r\t\u{7f}\u{1}", "☃ # ]", "", "'''\"\"\""]
        {
            let line = format!("{0} = {0}", quoted(text));
            assert_eq!(line.lines().count(), 1, "{line}");
            let table: toml::Table = line.parse().unwrap_or_else(|error| panic!("{line}: {error}"));
            assert_eq!(table[text].as_str(), Some(text));
        }
    }

    #[test]
    fn paths_lead_from_the_folder_to_the_file() {
        let base = Path::new("/nowhere/campaign");
        assert_eq!(relative(Path::new("/nowhere/campaign/a/log.csv"), base), "a/log.csv");
        assert_eq!(relative(Path::new("/nowhere/logs/log.csv"), base), "../logs/log.csv");
        assert_eq!(relative(Path::new("/nowhere/campaign/~a/$b"), base), "./~a/$$b");
    }
}
