//! Imports between the files of the crate form no cycle.

use std::path::Path;

use crate::imports::{Sources, circle};

#[test]
fn no_module_imports_one_that_imports_it() {
    let sources = Sources::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    let files = sources.arrows(|module| module.join("/"));
    assert!(files.contains_key(&("weigh".to_owned(), "drive".to_owned())), "{files:?}");
    let around = circle(&files);
    assert!(around.is_none(), "a circle of imports:\n{}", around.unwrap_or_default());
}
