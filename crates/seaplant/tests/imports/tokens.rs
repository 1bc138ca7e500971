//! Names and marks of Rust source text, without comments, strings and tests.

use std::collections::BTreeSet;

/// One imported name.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Import {
    /// The name in the file; `*` of a glob.
    pub(super) name: String,
    /// Where it is from, as written.
    pub(super) path: Vec<String>,
    /// Whether others may take it from here.
    pub(super) is_public: bool,
}

/// Names, and marks of one character; `::` is one mark.
pub(super) fn read(text: &str) -> Vec<String> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = skipped(rest).unwrap_or_else(|| {
            let token = token(rest, first);
            if !first.is_whitespace() {
                tokens.push(rest[..token].to_owned());
            }
            token
        });
        rest = &rest[length..];
    }
    tokens
}

/// The length of the comment, string or character that text starts with.
fn skipped(text: &str) -> Option<usize> {
    let until = |from: usize, end: &str| {
        text[from..].find(end).map_or(text.len(), |at| from + at + end.len())
    };
    if text.starts_with("//") {
        return Some(until(2, "\n"));
    }
    if text.starts_with("/*") {
        return Some(until(2, "*/"));
    }
    if text.starts_with("r\"") {
        return Some(until(2, "\""));
    }
    if text.starts_with("r#\"") {
        return Some(until(3, "\"#"));
    }
    if let Some(inner) = text.strip_prefix('"') {
        return Some(1 + quoted(inner, '"'));
    }
    // A lifetime has no second quote after one character.
    let inner = text.strip_prefix('\'')?;
    let mut after = inner.chars();
    let is_character = after.next() == Some('\\') || after.next() == Some('\'');
    is_character.then(|| 1 + quoted(inner, '\''))
}

/// The length up to and with the closing quote; a backslash takes its next character along.
fn quoted(text: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices() {
        if !escaped && c == quote {
            return at + c.len_utf8();
        }
        escaped = !escaped && c == '\\';
    }
    text.len()
}

fn token(text: &str, first: char) -> usize {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    match text {
        _ if is_name(first) => text.find(|c| !is_name(c)).unwrap_or(text.len()),
        _ if text.starts_with("::") => 2,
        _ => first.len_utf8(),
    }
}

/// Tokens without items under `#[cfg(test)]`.
pub(super) fn without_tests(tokens: Vec<String>) -> Vec<String> {
    const MARK: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut kept = Vec::new();
    let mut rest = tokens.as_slice();
    while let Some(first) = rest.first() {
        if rest.len() >= MARK.len() && rest.iter().zip(MARK).all(|(token, mark)| token == mark) {
            rest = &rest[MARK.len() + item(&rest[MARK.len()..])..];
        } else {
            kept.push(first.clone());
            rest = &rest[1..];
        }
    }
    kept
}

/// The number of tokens of the item that comes first: up to its `;`, or the end of its braces.
fn item(tokens: &[String]) -> usize {
    let mut depth = 0_usize;
    for (k, token) in tokens.iter().enumerate() {
        match token.as_str() {
            "{" | "(" | "[" => depth += 1,
            "}" if depth == 1 => return k + 1,
            "}" | ")" | "]" => depth = depth.saturating_sub(1),
            ";" if depth == 0 => return k + 1,
            _ => {}
        }
    }
    tokens.len()
}

/// What `use` imports, and the other tokens.
pub(super) fn imports(tokens: &[String]) -> (Vec<Import>, Vec<String>) {
    let (mut found, mut rest) = (Vec::new(), Vec::new());
    let mut k = 0;
    while k < tokens.len() {
        let is_use = tokens[k] == "use" && tokens.get(k + 1).is_some_and(|next| next != "<");
        if !is_use {
            rest.push(tokens[k].clone());
            k += 1;
            continue;
        }
        // `pub use` or `pub(crate) use`; a block's own `use` follows `{` or `;`.
        let is_public = k > 0 && (tokens[k - 1] == "pub" || tokens[k - 1] == ")");
        let end = k + tokens[k..].iter().position(|token| token == ";").unwrap_or(1);
        tree(&tokens[k + 1..end], &[], is_public, &mut found);
        k = end + 1;
    }
    (found, rest)
}

/// Reads one tree of a `use`: a path, or a path before `{…}`.
fn tree(tokens: &[String], before: &[String], is_public: bool, found: &mut Vec<Import>) {
    let mut path = before.to_vec();
    for (k, token) in tokens.iter().enumerate() {
        match token.as_str() {
            "::" => {}
            "{" => {
                for part in parts(&tokens[k + 1..tokens.len() - 1]) {
                    tree(part, &path, is_public, found);
                }
                return;
            }
            "as" => {
                found.push(Import { name: tokens[k + 1].clone(), path, is_public });
                return;
            }
            "self" if !path.is_empty() => {}
            _ => path.push(token.clone()),
        }
    }
    if let Some(name) = path.last().cloned() {
        found.push(Import { name, path, is_public });
    }
}

/// Parts between the commas that stand in no braces.
fn parts(tokens: &[String]) -> Vec<&[String]> {
    let (mut depth, mut from, mut parts) = (0, 0, Vec::new());
    for (k, token) in tokens.iter().enumerate() {
        match token.as_str() {
            "{" => depth += 1,
            "}" => depth -= 1,
            "," if depth == 0 => {
                parts.push(&tokens[from..k]);
                from = k + 1;
            }
            _ => {}
        }
    }
    parts.push(&tokens[from..]);
    parts.retain(|part: &&[String]| !part.is_empty());
    parts
}

/// Paths of two parts or more.
pub(super) fn inline_paths(tokens: &[String]) -> Vec<Vec<String>> {
    let is_name = |token: &String| token.chars().all(|c| c.is_alphanumeric() || c == '_');
    let (mut paths, mut k) = (Vec::new(), 0);
    while k < tokens.len() {
        let mut path = Vec::new();
        while k < tokens.len() && is_name(&tokens[k]) {
            path.push(tokens[k].clone());
            let goes_on = tokens.get(k + 1).is_some_and(|token| token == "::");
            k += if goes_on { 2 } else { 1 };
            if !goes_on {
                break;
            }
        }
        match path.len() {
            0 => k += 1,
            1 => {}
            _ => paths.push(path),
        }
    }
    paths
}

/// Every name among tokens.
pub(super) fn names(tokens: &[String]) -> BTreeSet<String> {
    tokens.iter().cloned().collect()
}
