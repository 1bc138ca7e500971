//! Explanation of each caveat, with advice, from the book's sections.

use seaplant::CaveatCode;
use serde::Serialize;

/// The book's page of caveats, with a section for each code.
const BOOK: &str = include_str!("../../../../docs/src/caveats.md");

/// A section of the book.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Advice {
    /// The caveat's code, as `results.json` writes it.
    pub(crate) code: String,
    /// Its meaning.
    pub(crate) means: String,
    /// The advice.
    pub(crate) action: String,
}

/// Returns the book's section on a caveat.
pub(crate) fn explain(code: CaveatCode) -> Advice {
    let name = serde_json::to_value(code).ok();
    let code = name.as_ref().and_then(|name| name.as_str()).unwrap_or_default().to_owned();
    let (means, action) = section(&code).unwrap_or_default();
    Advice { code, means, action }
}

/// Returns the text of a section before and after **Do**.
fn section(code: &str) -> Option<(String, String)> {
    let (_, after) = BOOK.split_once(&format!("### `{code}`"))?;
    let end = after.find("\n#").unwrap_or(after.len());
    let (means, action) = after[..end].split_once("**Do**:").unwrap_or((&after[..end], ""));
    Some((plain(means), plain(action)))
}

/// Converts Markdown to one line of text, with links replaced by their text.
fn plain(text: &str) -> String {
    let mut joined = text.split_whitespace().collect::<Vec<_>>().join(" ");
    while let Some(middle) = joined.find("](") {
        let (Some(open), Some(close)) = (joined[..middle].rfind('['), joined[middle..].find(')'))
        else {
            break;
        };
        joined.replace_range(middle..=middle + close, "");
        joined.remove(open);
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_become_their_text() {
        assert_eq!(
            plain("drive\nlonger ([planning](planning.md)), `x`"),
            "drive longer (planning), `x`"
        );
    }

    #[test]
    fn a_caveat_has_its_section() {
        let advice = explain(CaveatCode::WrongSign);
        assert_eq!(advice.code, "wrong-sign");
        assert!(advice.action.starts_with("check the signs of thrust"), "{}", advice.action);
        assert!(!advice.means.is_empty() && !advice.means.contains('#'));
    }
}
