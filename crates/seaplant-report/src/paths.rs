//! Makes file names from names that users choose.

use std::collections::HashSet;

/// Maximum length: with folder and extension names must fit every file system.
const LONGEST: usize = 60;

/// Allocates unique file names.
#[derive(Debug, Default)]
pub(crate) struct Paths {
    taken: HashSet<String>,
}

impl Paths {
    /// Returns a file name without extension from parts of any text, different from all before.
    pub(crate) fn unique(&mut self, parts: &[&str]) -> String {
        let slugs: Vec<String> = parts.iter().map(|part| slug(part)).collect();
        let stem = slugs.join(".");
        let mut name = stem.clone();
        let mut count = 1;
        while !self.taken.insert(name.clone()) {
            count += 1;
            name = format!("{stem}-{count}");
        }
        name
    }
}

/// Reduces text to lower-case ASCII letters and digits with single hyphens between; never empty.
pub(crate) fn slug(text: &str) -> String {
    let mut slug = String::new();
    for c in text.chars().flat_map(char::to_lowercase) {
        if slug.len() >= LONGEST {
            break;
        }
        if c.is_ascii_alphanumeric() {
            slug.push(c);
        } else if !slug.is_empty() && !slug.ends_with('-') {
            slug.push('-');
        }
    }
    let slug = slug.trim_end_matches('-');
    if slug.is_empty() { "unnamed".to_owned() } else { slug.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn makes_any_name_safe() {
        assert_eq!(slug("Surge 1"), "surge-1");
        assert_eq!(slug("../../etc/passwd"), "etc-passwd");
        assert_eq!(slug("<script>alert(1)</script>"), "script-alert-1-script");
        assert_eq!(slug("日本"), "unnamed");
        assert!(slug(&"x".repeat(500)).len() <= LONGEST);
    }

    #[test]
    fn hands_out_no_name_twice() {
        let mut paths = Paths::default();
        assert_eq!(paths.unique(&["a b", "surge"]), "a-b.surge");
        assert_eq!(paths.unique(&["a/b", "surge"]), "a-b.surge-2");
        assert_eq!(paths.unique(&["a:b", "surge"]), "a-b.surge-3");
    }
}
