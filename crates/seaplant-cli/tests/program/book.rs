//! The book and the README: commands work and print what is shown, and links lead somewhere.
//!
//! Each page is processed block by block in a folder of its own:
//!
//! - a block in `sh` that begins with `seaplant` is run;
//! - a block in `text` right below it is the expected output; a line `…` stands for any lines;
//! - `<!-- file: NAME -->` above a block: the block is that file;
//! - `<!-- needs SEAPLANT_DATA -->`: run if the third-party logs are available;
//! - `<!-- not run: WHY -->`: for a log that only the reader has.
#![cfg(unix)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::real_data::{data, workspace};
use crate::workshop::{Workshop, seaplant};

/// Number of blocks marked as not run: for logs that only the reader has, downloads, or commands of
/// more than a minute.
const NOT_RUN: usize = 8;

/// Minimum number of commands that are run.
const LEAST_RUN: usize = 30;

/// A file in Markdown.
struct Page {
    path: PathBuf,
    text: String,
}

/// A fenced block of a page.
#[derive(Debug, Default)]
struct Block {
    /// Its first line, counted from 1.
    line: usize,
    /// Language after its fence.
    language: String,
    text: String,
    /// The comment directly above it.
    mark: String,
    /// True if only blank lines separate it from the block before it.
    follows: bool,
}

impl Page {
    fn read(path: PathBuf) -> Self {
        let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Self { path, text }
    }

    /// Splits the page into lines outside of blocks, and the blocks.
    fn parts(&self) -> (Vec<&str>, Vec<Block>) {
        let (mut prose, mut blocks, mut open) = (Vec::new(), Vec::new(), None::<Block>);
        let mut before = "";
        let mut follows = false;
        for (k, line) in self.text.lines().enumerate() {
            if let Some(mut block) = open.take() {
                if line == "```" {
                    blocks.push(block);
                    follows = true;
                } else {
                    block.text += line;
                    block.text.push('\n');
                    open = Some(block);
                }
            } else if let Some(language) = line.strip_prefix("```") {
                let mark = before.strip_prefix("<!-- ").and_then(|m| m.strip_suffix(" -->"));
                let (language, mark) = (language.to_owned(), mark.unwrap_or("").to_owned());
                open = Some(Block { line: k + 1, language, mark, follows, ..Block::default() });
            } else {
                prose.push(line);
                follows &= line.is_empty();
            }
            before = line;
        }
        assert!(open.is_none(), "{}: a block does not end", self.path.display());
        (prose, blocks)
    }

    /// Returns the anchors of headings.
    fn anchors(&self) -> BTreeSet<String> {
        let headings = self.parts().0.into_iter().filter(|line| line.starts_with('#'));
        let slug = |heading: &str| -> String {
            let words = heading.trim_start_matches('#').trim().to_lowercase();
            let kept = words.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
            kept.map(|c| if c == ' ' { '-' } else { c }).collect()
        };
        headings.map(slug).collect()
    }

    /// Returns the targets of links `](…)` in prose, outside of `code`.
    fn links(&self) -> Vec<String> {
        let mut links = Vec::new();
        for line in self.parts().0 {
            let prose: String = line.split('`').step_by(2).collect();
            let ends = prose.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
            links.extend(ends.map(|(link, _)| link.to_owned()));
        }
        links
    }
}

fn source() -> PathBuf {
    workspace().join("docs/src").canonicalize().expect("the book is there")
}

/// Returns every page of the book except its summary.
fn book() -> Vec<Page> {
    fn below(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                below(&path, found);
            } else if path.extension().is_some_and(|e| e == "md") && !path.ends_with("SUMMARY.md") {
                found.push(path);
            }
        }
    }
    let mut paths = Vec::new();
    below(&source(), &mut paths);
    paths.sort();
    paths.into_iter().map(Page::read).collect()
}

/// Returns the Markdown files outside of the book.
fn beside() -> Vec<Page> {
    let root = workspace().canonicalize().expect("the workspace is there");
    ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| Page::read(root.join(name))).into()
}

/// Results of a page's blocks.
#[derive(Default)]
struct Told {
    run: usize,
    not_run: usize,
    wrong: Vec<String>,
}

/// Follows a page's instructions.
fn follow(page: &Page, told: &mut Told) {
    let workshop = Workshop::empty();
    std::os::unix::fs::symlink(source().join("../../examples"), workshop.join("examples"))
        .expect("a link can be made");
    let mut printed = None;
    for block in page.parts().1 {
        let place = format!("{}:{}", page.path.display(), block.line);
        if let Some(name) = block.mark.strip_prefix("file: ") {
            workshop.write(name, &block.text);
        } else if block.language == "sh" {
            printed = run(&block, &place, &workshop, told);
        } else if block.language == "text"
            && block.follows
            && let Some(printed) = printed.take()
            && !is_as_shown(&block.text, &printed)
        {
            told.wrong
                .push(format!("{place}: this is shown\n{}and this printed\n{printed}", block.text));
        }
    }
}

/// Returns the output of a block's commands, if they are run.
fn run(block: &Block, place: &str, workshop: &Workshop, told: &mut Told) -> Option<String> {
    let commands = || block.text.lines().filter(|line| line.starts_with("seaplant "));
    if !block.text.starts_with("seaplant ") {
        assert_eq!(commands().count(), 0, "{place}: begin the block with its `seaplant`");
        return None;
    }
    if block.mark.starts_with("not run: ") {
        told.not_run += 1;
        return None;
    }
    let mut shell = Command::new("sh");
    if block.mark == "needs SEAPLANT_DATA" {
        shell.env("SEAPLANT_DATA", data("")?);
    }
    let program = PathBuf::from(seaplant().get_program());
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let own = program.parent().expect("in a folder").to_owned();
    let path = std::env::join_paths([own].into_iter().chain(std::env::split_paths(&folders)));
    let output = shell
        .args(["-euc", &format!("exec 2>&1\n{}", block.text)])
        .current_dir(workshop.path())
        .env("PATH", path.expect("folders"))
        .output()
        .expect("there is a shell");
    told.run += commands().count();
    let printed = String::from_utf8(output.stdout).expect("UTF-8");
    if !output.status.success() {
        told.wrong.push(format!("{place}: fails\n{}{printed}", block.text));
        return None;
    }
    Some(printed)
}

/// Returns whether output matches what a page shows, with `…` for any lines.
fn is_as_shown(shown: &str, printed: &str) -> bool {
    fn matches(shown: &[&str], printed: &[&str]) -> bool {
        match (shown, printed) {
            ([], rest) => rest.is_empty(),
            (["…", later @ ..], rest) => (0..=rest.len()).any(|k| matches(later, &rest[k..])),
            ([line, later @ ..], [first, rest @ ..]) => line == first && matches(later, rest),
            _ => false,
        }
    }
    fn lines(text: &str) -> Vec<&str> {
        text.trim_end().lines().map(str::trim_end).collect()
    }
    matches(&lines(shown), &lines(printed))
}

#[test]
fn every_command_of_the_book_runs_and_prints_what_is_shown() {
    let mut told = Told::default();
    for page in book().iter().chain(&beside()) {
        follow(page, &mut told);
    }
    assert!(told.wrong.is_empty(), "{}", told.wrong.join("\n\n"));
    assert_eq!(told.not_run, NOT_RUN, "blocks are marked as not run");
    assert!(told.run >= LEAST_RUN, "{} commands were run", told.run);
}

#[test]
fn every_link_leads_somewhere() {
    let (source, book, beside) = (source(), book(), beside());
    let summary = Page::read(source.join("SUMMARY.md"));
    for page in book.iter().chain(&beside).chain([&summary]) {
        let in_book = page.path.starts_with(&source);
        for link in page.links().iter().filter(|link| !link.starts_with("http")) {
            let place = format!("{}: link to {link}", page.path.display());
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let folder = page.path.parent().expect("in a folder");
            let to = if file.is_empty() { page.path.clone() } else { folder.join(file) };
            let to = to.canonicalize().unwrap_or_else(|error| panic!("{place}: {error}"));
            assert!(!in_book || to.starts_with(&source), "{place} leaves the book");
            if !anchor.is_empty() {
                assert!(Page::read(to).anchors().contains(anchor), "{place}: no such heading");
            }
        }
    }
}

#[test]
fn the_summary_lists_every_page_once() {
    let source = source();
    let listed = Page::read(source.join("SUMMARY.md")).links();
    let pages: BTreeSet<String> = book()
        .iter()
        .map(|page| page.path.strip_prefix(&source).expect("in the book"))
        .map(|path| path.to_str().expect("UTF-8").to_owned())
        .collect();
    assert_eq!(listed.len(), pages.len(), "a page is listed twice, or not at all");
    assert_eq!(listed.into_iter().collect::<BTreeSet<_>>(), pages);
}

/// Returns the values of an enumeration in the schema of a file.
fn values_of(kind: &str, name: &str) -> BTreeSet<String> {
    let output = seaplant().args(["schema", kind]).output().expect("the program runs");
    let schema: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let values = schema["$defs"][name]["oneOf"].as_array().expect("values with descriptions");
    values.iter().map(|value| value["const"].as_str().expect("a name").to_owned()).collect()
}

#[test]
fn every_caveat_has_its_section() {
    let page = Page::read(source().join("caveats.md"));
    let codes = page.parts().0.into_iter().filter_map(|line| {
        line.strip_prefix("### `").and_then(|code| code.strip_suffix('`')).map(str::to_owned)
    });
    assert_eq!(codes.collect::<BTreeSet<_>>(), values_of("results", "CaveatCode"));
}

#[test]
fn every_method_is_in_the_overview() {
    let overview = Page::read(source().join("methods/overview.md")).text;
    for method in values_of("results", "Method") {
        assert!(overview.contains(&format!("`{method}`")), "{method} is not there");
    }
}

#[test]
fn every_disturbance_is_in_the_chapter_on_the_twin() {
    let page = Page::read(source().join("twin.md"));
    let rows = page.parts().0.into_iter().filter_map(|line| {
        line.strip_prefix("| `")
            .and_then(|row| row.split_once('`'))
            .map(|(name, _)| name.to_owned())
    });
    assert_eq!(rows.collect::<BTreeSet<_>>(), values_of("twin", "Disturbance"));
}

#[test]
fn omitted_lines_match_any() {
    assert!(is_as_shown("a\n…\nd\n", "a\nb\nc\nd\n"));
    assert!(is_as_shown("a\n…\n", "a  \n"));
    assert!(!is_as_shown("a\n…\nd\n", "a\nb\n"));
    assert!(!is_as_shown("a\n", "a\nb\n"));
}

#[test]
fn every_setting_in_the_pages_of_methods_is_known() {
    let methods = source().join("methods");
    for page in book().iter().filter(|page| page.path.starts_with(&methods)) {
        let settings =
            page.parts().1.into_iter().filter(|b| b.language == "toml" && b.mark.is_empty());
        for block in settings {
            let workshop = Workshop::quick();
            let campaign = workshop.read("campaign.toml");
            workshop.write("campaign.toml", format!("{campaign}\n{}", block.text));
            workshop.success(&["identify", "campaign.toml"]);
        }
    }
}

#[test]
fn the_published_schemas_are_the_programs() {
    for kind in ["results", "vehicle", "campaign", "twin", "plant", "profile", "request", "plan"] {
        let path = source().join(format!("schemas/{kind}.schema.json"));
        let output = seaplant().args(["schema", kind]).output().expect("the program runs");
        let current = String::from_utf8(output.stdout).expect("UTF-8");
        let published = fs::read_to_string(&path).unwrap_or_default();
        assert!(
            published == current,
            "{} is not current: `seaplant schema {kind}` prints it anew",
            path.display()
        );
    }
}

#[test]
fn every_row_of_a_table_has_as_many_cells_as_its_head() {
    let cells = |row: &str| row.replace("\\|", "").matches('|').count();
    for page in book().into_iter().chain(beside()) {
        let mut head = None;
        for line in page.parts().0 {
            let count = line.starts_with('|').then(|| cells(line));
            if let (Some(head), Some(count)) = (head, count) {
                assert_eq!(count, head, "{}: {line}", page.path.display());
            }
            head = head.filter(|_| count.is_some()).or(count);
        }
    }
}
