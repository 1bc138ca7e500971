//! Checks of the paths that a folder's list of files names.

use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

/// Returns the fault of a path in a folder's list; `None` if the path may be used.
///
/// A usable path is relative, leads through no link, and names a regular file inside the folder or
/// nothing. The file is not opened: a pipe would never answer.
///
/// This is checked by hand because the whole list has to be refused before any file is touched.
/// Directory handles (`cap-std`) would keep operations inside the folder, but follow links there,
/// open pipes and fail one entry at a time, so every check here would still be needed.
pub(super) fn fault(folder: &Path, path: &str) -> Option<String> {
    if !is_plain(path) {
        return Some("that is not a relative path inside the folder".to_owned());
    }
    if let Some(link) = first_link(folder, Path::new(path)) {
        return Some(format!("{} is a symbolic link", link.display()));
    }
    let file = folder.join(path);
    match file.symlink_metadata() {
        Ok(data) if data.is_file() => None,
        Ok(_) => Some(format!("{} is not a regular file", file.display())),
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            None
        }
        Err(error) => Some(format!("{} cannot be examined: {error}", file.display())),
    }
}

/// Finds the first symbolic link on the way from a folder along a relative path.
pub(super) fn first_link(folder: &Path, path: &Path) -> Option<PathBuf> {
    let mut reached = folder.to_owned();
    path.components().find_map(|part| {
        reached.push(part);
        reached.is_symlink().then(|| reached.clone())
    })
}

/// Reports whether a path is names joined by `/`, without `.`, `..`, a root or a drive.
fn is_plain(path: &str) -> bool {
    let name = |part| match part {
        Component::Normal(name) => name.to_str(),
        _ => None,
    };
    let names: Option<Vec<&str>> = Path::new(path).components().map(name).collect();
    names.is_some_and(|names| !names.is_empty() && names.join("/") == path)
}
