//! Imports between the files of a crate, read from its sources; those of tests left out.
//!
//! Tests of `seaplant-log`, `seaplant-campaign`, `seaplant-plan` and `bindings/python` include it by
//! path.

mod tokens;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use tokens::{Import, imports, inline_paths, names, without_tests};

/// A module by its path from the crate's root.
type Module = Vec<String>;

/// One file with what it declares and uses.
struct File {
    /// Each imported name, its path, and whether the import is a re-export.
    imports: Vec<Import>,
    /// Paths outside of `use`, such as `crate::a::b`.
    inline: Vec<Vec<String>>,
    /// Every name that stands outside of `use`.
    names: BTreeSet<String>,
}

/// The files of a crate.
pub struct Sources {
    files: BTreeMap<Module, File>,
}

/// Who imports what: from one room to another, with "file: path" of each import.
pub type Arrows = BTreeMap<(String, String), BTreeSet<String>>;

impl Sources {
    /// Reads every `.rs` file below a folder, which is the `src` of a crate.
    pub fn read(src: &Path) -> Self {
        let mut texts = Vec::new();
        collect(src, src, &mut texts);
        Self::of(texts.iter().map(|(path, text)| (path.as_str(), text.as_str())))
    }

    /// Files by their path below `src`, with their text.
    pub fn of<'a>(texts: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let file = |(path, text): (&str, &str)| {
            let tokens = without_tests(tokens::read(text));
            let (imports, rest) = imports(&tokens);
            let (inline, names) = (inline_paths(&rest), names(&rest));
            (module_of(path), File { imports, inline, names })
        };
        Self { files: texts.into_iter().filter(|(path, _)| !is_test(path)).map(file).collect() }
    }

    /// Imports between rooms; `room` names that of a module, such as its first part.
    pub fn arrows(&self, room: impl Fn(&[String]) -> String) -> Arrows {
        let mut arrows = Arrows::new();
        for (module, file) in self.files.iter().filter(|(module, _)| !module.is_empty()) {
            for path in self.used(module, file) {
                let Some(target) = self.home(&path, 0).filter(|target| !target.is_empty()) else {
                    continue;
                };
                let (from, to) = (room(module), room(&target));
                if from != to {
                    let seen = format!("{}: {}", module.join("/"), path.join("::"));
                    arrows.entry((from, to)).or_default().insert(seen);
                }
            }
        }
        arrows
    }

    /// The absolute paths that a file uses. A name that it only passes on from a module below it is
    /// not used.
    fn used(&self, module: &Module, file: &File) -> Vec<Vec<String>> {
        let mut used = Vec::new();
        for import in &file.imports {
            let path = self.absolute(module, &import.path);
            let is_below = path.len() > module.len() && path.starts_with(module);
            if !(import.is_public && is_below && !file.names.contains(&import.name)) {
                used.push(path);
            }
        }
        let inline = file.inline.iter().filter(|path| self.goes_elsewhere(module, file, &path[0]));
        used.extend(inline.map(|path| self.absolute(module, path)));
        used
    }

    /// Whether a path that starts so leaves its file; one that starts with an imported type does
    /// not: its import has been counted.
    fn goes_elsewhere(&self, module: &Module, file: &File, first: &str) -> bool {
        let is_type = first.starts_with(char::is_uppercase);
        ["crate", "self", "super"].contains(&first)
            || self.is_child(module, first)
            || !is_type && file.imports.iter().any(|import| import.name == first)
    }

    fn is_child(&self, module: &Module, name: &str) -> bool {
        self.files.contains_key(&[module.as_slice(), &[name.to_owned()]].concat())
    }

    /// A path from the crate's root; one into another crate starts with that crate's name.
    fn absolute(&self, module: &Module, path: &[String]) -> Vec<String> {
        match path[0].as_str() {
            "crate" => path[1..].to_vec(),
            "self" => [module, &path[1..]].concat(),
            "super" => {
                let up = path.iter().take_while(|part| *part == "super").count();
                [&module[..module.len().saturating_sub(up)], &path[up..]].concat()
            }
            first => {
                let file = &self.files[module];
                let known = file.imports.iter().find(|import| {
                    import.name == first && import.path[0] != first && import.path != path
                });
                match known {
                    _ if self.is_child(module, first) => [module, path].concat(),
                    Some(import) => {
                        [self.absolute(module, &import.path), path[1..].to_vec()].concat()
                    }
                    None => [&["extern".to_owned()], path].concat(),
                }
            }
        }
    }

    /// The module whose file defines what an absolute path names, through re-exports.
    fn home(&self, path: &[String], depth: usize) -> Option<Module> {
        let mut module = Module::new();
        for (k, part) in path.iter().enumerate() {
            if self.is_child(&module, part) {
                module.push(part.clone());
                continue;
            }
            let file = self.files.get(&module)?;
            let Some(import) = file.imports.iter().find(|import| import.name == *part) else {
                break;
            };
            let target = [self.absolute(&module, &import.path), path[k + 1..].to_vec()].concat();
            return if depth > 16 { None } else { self.home(&target, depth + 1) };
        }
        (path.first()? != "extern").then_some(module)
    }
}

/// A circle of rooms, each with the next one's imports, if there is one.
pub fn circle(arrows: &Arrows) -> Option<String> {
    let mut done = BTreeSet::new();
    let rooms: BTreeSet<&str> = arrows.keys().map(|(from, _)| from.as_str()).collect();
    rooms.into_iter().find_map(|room| walk(room, arrows, &mut Vec::new(), &mut done))
}

fn walk<'a>(
    room: &'a str,
    arrows: &'a Arrows,
    way: &mut Vec<&'a str>,
    done: &mut BTreeSet<&'a str>,
) -> Option<String> {
    if let Some(start) = way.iter().position(|before| *before == room) {
        let around = [&way[start..], &[room]].concat();
        let steps = around.windows(2).map(|pair| shown(arrows, pair[0], pair[1]));
        return Some(steps.collect::<Vec<_>>().join("\n"));
    }
    if !done.insert(room) {
        return None;
    }
    way.push(room);
    let to = arrows.keys().filter(|(from, _)| from == room).map(|(_, to)| to.as_str());
    let found = to.into_iter().find_map(|next| walk(next, arrows, way, done));
    way.pop();
    found
}

/// "`a` imports from `b`: a/x: b::Y, …".
pub fn shown(arrows: &Arrows, from: &str, to: &str) -> String {
    let imports = &arrows[&(from.to_owned(), to.to_owned())];
    let imports: Vec<&str> = imports.iter().map(String::as_str).collect();
    format!("`{from}` imports from `{to}` ({})", imports.join(", "))
}

fn collect(src: &Path, folder: &Path, texts: &mut Vec<(String, String)>) {
    for entry in fs::read_dir(folder).expect("the folder is readable") {
        let path = entry.expect("the folder is readable").path();
        if path.is_dir() {
            collect(src, &path, texts);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let below = path.strip_prefix(src).expect("below src").to_string_lossy().into_owned();
            texts.push((below, fs::read_to_string(&path).expect("sources are text")));
        }
    }
}

/// `a/b.rs` and `a/b/mod.rs` are module `a::b`, `lib.rs` is the root.
fn module_of(path: &str) -> Module {
    let parts = path.trim_end_matches(".rs").replace('\\', "/");
    let parts = parts.split('/').filter(|part| !["lib", "mod"].contains(part));
    parts.map(str::to_owned).collect()
}

/// A module of tests in a file of its own.
fn is_test(path: &str) -> bool {
    path.ends_with("tests.rs")
}
