//! Fills templates.

/// Fills the placeholders `@NAME@` of a template.
///
/// A placeholder without value, or a value without placeholder, is a bug of this crate that its
/// tests find.
pub(crate) fn fill(template: &str, places: &[(&str, String)]) -> String {
    let mut text = String::with_capacity(template.len());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once('@') {
        text += before;
        let place = after.split_once('@').and_then(|(name, after)| {
            let (_, value) = places.iter().find(|(known, _)| *known == name)?;
            Some((value, after))
        });
        match place {
            Some((value, after)) => {
                text += value;
                rest = after;
            }
            None => {
                text.push('@');
                rest = after;
            }
        }
    }
    text + rest
}

#[cfg(test)]
mod tests {
    use super::fill;

    #[test]
    fn placeholders_are_filled_once_and_other_text_is_kept() {
        let places = [("A", "@B@".to_owned()), ("B", "x".to_owned())];
        assert_eq!(fill("a @A@ b @B@ c@d @", &places), "a @B@ b x c@d @");
    }
}
