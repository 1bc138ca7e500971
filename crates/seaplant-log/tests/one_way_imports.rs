//! Imports between the files of the crate form no cycle.

use std::path::Path;

use crate::imports::{Sources, circle};

#[test]
fn no_module_imports_one_that_imports_it() {
    let sources = Sources::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    let files = sources.arrows(|module| module.join("/"));
    assert!(files.contains_key(&("format".to_owned(), "readers/mcap".to_owned())), "{files:?}");
    let top = sources.arrows(|module| module[0].clone());
    let around = circle(&files).or_else(|| circle(&top));
    assert!(around.is_none(), "a circle of imports:\n{}", around.unwrap_or_default());
}
