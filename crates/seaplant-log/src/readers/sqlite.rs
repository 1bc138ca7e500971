//! SQLite databases: ROS 2 bags.

mod database;

use std::collections::HashMap;
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};

use self::database::{Database, Value};
use crate::content::Content;
use crate::note::Note;
use crate::readers::ros::{Connection, Encoding, Recording};
use crate::{Error, Log, ReadOptions};

const FORMAT: &str = "an SQLite database";

/// Whether bytes start like an SQLite database.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"SQLite format 3")
}

/// Reads a ROS 2 bag kept in an SQLite database.
///
/// # Errors
/// [`Error::Io`], [`Error::NoSamples`]; [`Error::Corrupt`] where the database cannot be made sense
/// of, [`Error::Unsupported`] of one that is no bag.
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    let (origin, file) = content.seekable()?;
    let database = Database::open(file).map_err(|error| origin.failed(error))?;
    let Some(mut database) = database else {
        let found = "a header that states no page size or no UTF-8".to_owned();
        return Err(Error::Corrupt { path, format: FORMAT, byte: 16, found });
    };
    let mut bag =
        Bag { recording: Recording::new(database.length(), options), topics: HashMap::new() };
    let tables = tables(&mut database).map_err(|error| origin.failed(error))?;
    if !["topics", "messages"].iter().all(|name| tables.contains_key(*name)) {
        return Err(no_bag(path, &database, &tables));
    }
    bag.read(&mut database, &tables).map_err(|error| origin.failed(error))?;
    let mut log = bag.recording.log(origin, options, FORMAT, "ROS 2 bag (SQLite)")?;
    log.notes.extend(write_ahead(&path));
    Ok(log)
}

/// A table: where it starts, and its columns.
struct Table {
    root: u64,
    columns: Vec<String>,
}

impl Table {
    fn value<'a>(&self, values: &[Value<'a>], column: &str) -> Option<Value<'a>> {
        let index = self.columns.iter().position(|name| name == column)?;
        values.get(index).copied()
    }
}

type Tables = HashMap<String, Table>;

/// The tables that the first page tells of.
fn tables(database: &mut Database) -> io::Result<Tables> {
    let mut tables = Tables::new();
    database.rows(1, &mut |values, _| {
        let [_, name, _, root, sql] = values else { return false };
        let root = root.integer().and_then(|root| u64::try_from(root).ok());
        if let (Some(name), Some(root @ 1..), Some(sql)) = (name.text(), root, sql.text()) {
            tables.insert(name, Table { root, columns: columns(&sql) });
        }
        true
    })?;
    Ok(tables)
}

/// The names of the columns of `CREATE TABLE name(column kind, ...)`.
fn columns(sql: &str) -> Vec<String> {
    let within = sql.split_once('(').map_or("", |(_, within)| within);
    let word = |column: &str| {
        let word = column.split_whitespace().next().unwrap_or_default();
        word.trim_matches(|c: char| !(c.is_alphanumeric() || c == '_')).to_lowercase()
    };
    within.split(',').map(word).collect()
}

fn no_bag(path: PathBuf, database: &Database, tables: &Tables) -> Error {
    if tables.is_empty() || database.found.missing.is_some() {
        let found = "no list of tables".to_owned();
        return Error::Corrupt { path, format: FORMAT, byte: 100, found };
    }
    let detail = "without the tables of a ROS 2 bag".to_owned();
    let advice = "export the table of interest as CSV";
    Error::Unsupported { path, format: FORMAT, detail, advice }
}

/// A note of what SQLite wrote beside the database and has not moved into it.
fn write_ahead(path: &Path) -> Option<Note> {
    let mut beside = OsString::from(path);
    beside.push("-wal");
    let length = std::fs::metadata(&beside).map_or(0, |metadata| metadata.len());
    let columns = vec![beside.to_string_lossy().into_owned()];
    let why = "has the last messages, for the recorder did not end well; `sqlite3 FILE 'PRAGMA \
               wal_checkpoint'` moves them into the database";
    (length > 0).then(|| Note::LeftOut { path: path.to_owned(), columns, why })
}

struct Bag {
    recording: Recording,
    /// By their numbers; `None` of those that cannot be read.
    topics: HashMap<i64, Option<usize>>,
}

impl Bag {
    fn read(&mut self, database: &mut Database, tables: &Tables) -> io::Result<()> {
        let definitions = match tables.get("message_definitions") {
            Some(table) => definitions(database, table)?,
            None => HashMap::new(),
        };
        let table = &tables["topics"];
        database
            .rows(table.root, &mut |values, _| self.topic(table, values, &definitions).is_some())?;
        let table = &tables["messages"];
        let page_size = database.page_size();
        let mut take = |values: &[Value<'_>], page: u64| {
            self.message(table, values, page.saturating_sub(1) * page_size).is_some()
        };
        database.rows(table.root, &mut take)?;
        let found = std::mem::take(&mut database.found);
        if found.missing.is_some() || !found.damaged.is_empty() {
            database.orphans(&mut take)?;
        }
        let mut damaged = found.damaged;
        damaged.sort_unstable();
        damaged.dedup();
        for page in damaged {
            self.recording.damaged(database.byte_of(page), page_size);
        }
        if let Some(page) = found.missing {
            self.recording.truncated(database.byte_of(page));
        }
        Ok(())
    }

    fn topic(
        &mut self,
        table: &Table,
        values: &[Value<'_>],
        definitions: &HashMap<String, Definition>,
    ) -> Option<()> {
        let text = |column| table.value(values, column)?.text();
        let id = table.value(values, "id")?.integer()?;
        let (topic, kind) = (text("name")?, text("type")?);
        let definition = match definitions.get(&kind) {
            Some(Definition::Message(text)) => Ok(Some(text.clone())),
            Some(Definition::Other) => Err("has a definition in IDL, not as a ROS message"),
            None => Ok(None),
        };
        let cdr = text("serialization_format").is_none_or(|format| format == "cdr");
        let index = match definition {
            Ok(definition) if cdr => {
                let connection = Connection { topic, kind, encoding: Encoding::Cdr, definition };
                self.recording.topic(&connection)
            }
            Ok(_) => {
                self.recording.leave_out(topic, "is in no message encoding of ROS");
                None
            }
            Err(why) => {
                self.recording.leave_out(topic, why);
                None
            }
        };
        self.topics.insert(id, index);
        Some(())
    }

    fn message(&mut self, table: &Table, values: &[Value<'_>], byte: u64) -> Option<()> {
        let integer = |column| table.value(values, column)?.integer();
        let topic = *self.topics.get(&integer("topic_id")?)?;
        let (receipt, data) = (integer("timestamp")?, table.value(values, "data")?.bytes()?);
        if let Some(topic) = topic {
            self.recording.message(topic, receipt, data, byte);
        }
        Some(())
    }
}

/// What a bag says of a type.
enum Definition {
    Message(String),
    /// In another language.
    Other,
}

fn definitions(database: &mut Database, table: &Table) -> io::Result<HashMap<String, Definition>> {
    let mut definitions = HashMap::new();
    database.rows(table.root, &mut |values, _| {
        let text = |column| table.value(values, column)?.text();
        let Some(kind) = text("topic_type") else { return false };
        let definition = match (text("encoding").as_deref(), text("encoded_message_definition")) {
            (Some("ros2msg"), Some(text)) => Definition::Message(text),
            (Some("unknown") | None, _) | (_, None) => return true,
            _ => Definition::Other,
        };
        definitions.insert(kind, definition);
        true
    })?;
    Ok(definitions)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_named_in_the_definition_of_a_table() {
        let sql = "CREATE TABLE messages(id INTEGER PRIMARY KEY,\"topic_id\" INTEGER NOT NULL, \
                   `data` BLOB NOT NULL)";
        assert_eq!(columns(sql), ["id", "topic_id", "data"]);
    }
}
