//! Modules of the library import one way.

use std::collections::BTreeSet;
use std::path::Path;

use crate::imports::{Sources, circle, shown};

/// The top-level modules; each imports only from those before it.
const ORDER: [&str; 33] = [
    // Names, errors and numbers.
    "dof",
    "error",
    "axes",
    "caveat",
    "parallel",
    "exact",
    "random",
    "series",
    "quantity",
    "signal",
    "statistics",
    // The plant and the vehicle.
    "plant",
    "thrust",
    "vehicle",
    "terms",
    "regression",
    "motion",
    "simulate",
    // What was recorded.
    "navigation",
    "trial",
    "clock",
    "excursion",
    // What is concluded from it.
    "estimate",
    "bollard",
    "evaluate",
    "judge",
    "results",
    "diagnose",
    // What is done with that.
    "exchange",
    "compare",
    "twin",
    "identify",
    "monte_carlo",
];

fn first(module: &[String]) -> String {
    module[0].clone()
}

#[test]
fn modules_of_the_library_import_only_from_those_before_them() {
    let sources = Sources::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    let arrows = sources.arrows(first);
    let rooms: BTreeSet<&str> = arrows.keys().flat_map(|(from, to)| [&**from, &**to]).collect();
    let unlisted: Vec<&&str> = rooms.iter().filter(|room| !ORDER.contains(room)).collect();
    assert!(unlisted.is_empty(), "give {unlisted:?} a place in this test's list of modules");
    let around = circle(&arrows);
    assert!(around.is_none(), "a circle of imports:\n{}", around.unwrap_or_default());
    let place = |name: &str| ORDER.iter().position(|listed| *listed == name);
    let back: Vec<String> = arrows
        .keys()
        .filter(|(from, to)| place(from) < place(to))
        .map(|(from, to)| shown(&arrows, from, to))
        .collect();
    assert!(back.is_empty(), "these import from a later module:\n{}", back.join("\n"));
}

#[test]
fn a_circle_is_named_with_its_imports() {
    let sources = Sources::of([
        ("lib.rs", "mod a; mod b; mod c; pub use b::inner::Name;"),
        ("a.rs", "use crate::Name; // crate::c::comment\nconst TEXT: &str = \"crate::c::text\";"),
        ("b.rs", "pub(crate) mod inner;"),
        ("b/inner.rs", "use super::super::c::{self, Deep as Other};\npub struct Name;"),
        (
            "c.rs",
            "fn f<'a>(x: &'a str) -> char { crate::a::g(x); '\"' }\n#[cfg(test)]\nmod tests { use crate::b::inner; }",
        ),
    ]);
    let arrows = sources.arrows(first);
    let seen: Vec<(&str, &str)> = arrows.keys().map(|(a, b)| (a.as_str(), b.as_str())).collect();
    assert_eq!(seen, [("a", "b"), ("b", "c"), ("c", "a")]);
    let named = circle(&arrows).expect("a circle");
    assert!(named.contains("`b` imports from `c` (b/inner: c, b/inner: c::Deep)"), "{named}");
    assert!(named.contains("`c` imports from `a` (c: a::g)"), "{named}");
}

#[test]
fn passing_a_name_on_is_no_import_but_using_it_is() {
    let of = |text: &str| {
        let sources = Sources::of([
            ("lib.rs", "mod a;"),
            ("a.rs", text),
            ("a/b.rs", "use super::Shared;\npub(crate) struct Own;"),
        ]);
        circle(&sources.arrows(|module| module.join("/")))
    };
    assert_eq!(of("mod b;\npub(crate) use b::Own;\npub(crate) struct Shared;"), None);
    assert!(of("mod b;\nuse b::Own;\npub(crate) struct Shared(Own);").is_some());
    assert!(of("mod b;\npub(crate) use b::Own;\npub(crate) struct Shared(Own);").is_some());
    assert!(of("mod b;\npub(crate) struct Shared(b::Own);").is_some());
}
