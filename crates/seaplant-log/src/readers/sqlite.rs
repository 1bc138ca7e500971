//! SQLite databases: ROS 2 bags.

mod database;

use std::collections::HashMap;
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};

use self::database::{Database, Value};
use crate::content::{Content, Origin};
use crate::glance::{Glance, Thoroughness};
use crate::note::Note;
use crate::readers::ros::{Connection, Encoding, Recording};
use crate::{Error, Log, ReadOptions};

const FORMAT: &str = "an SQLite database";

/// Returns whether bytes start like an SQLite database.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"SQLite format 3")
}

/// Reads a ROS 2 bag in an SQLite database.
///
/// # Errors
/// [`Error::Io`], [`Error::NoSamples`]; [`Error::Corrupt`] where the database cannot be made sense
/// of, [`Error::Unsupported`] of one that is no bag.
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let (origin, mut database, tables) = open(content)?;
    let mut bag = Bag::new(&database, options);
    bag.read(&mut database, &tables).map_err(|error| origin.failed(error))?;
    bag.log(origin, options)
}

/// Reads some pages of a ROS 2 bag in an SQLite database; `None` where the table of messages is
/// incomplete.
///
/// # Errors
/// As [`read`].
pub(crate) fn glance(
    content: Content,
    options: &ReadOptions,
    how: Thoroughness,
) -> Result<Option<Glance>, Error> {
    let (mut origin, mut database, tables) = open(content)?;
    let mut bag = Bag::new(&database, options);
    let read = bag.glance(&mut database, &tables, how).map_err(|error| origin.failed(error))?;
    let Some(bytes) = read.filter(|_| !bag.recording.is_damaged()) else { return Ok(None) };
    origin.reads_in_part(database.length());
    let (first_ns, last_ns) = bag.span_ns;
    let unread = 1.0 - bytes as f64 / database.length().max(1) as f64;
    let span_s = 1e-9 * last_ns.saturating_sub(first_ns) as f64;
    let (parts, has_ends) = (how.parts, false);
    let pause_s = 0.5 * span_s * unread / (parts.max(2) - 1) as f64;
    let log = bag.log(origin, options)?;
    Ok(Some(Glance { log, parts, bytes, pause_s, has_ends }))
}

/// Opens a database that has the tables of a bag.
fn open(content: Content) -> Result<(Origin, Database, Tables), Error> {
    let path = content.path().to_owned();
    let (origin, file) = content.seekable()?;
    let database = Database::open(file).map_err(|error| origin.failed(error))?;
    let Some(mut database) = database else {
        let found = "a header that states no page size or no UTF-8".to_owned();
        return Err(Error::Corrupt { path, format: FORMAT, byte: 16, found });
    };
    let tables = tables(&mut database).map_err(|error| origin.failed(error))?;
    if !["topics", "messages"].iter().all(|name| tables.contains_key(*name)) {
        return Err(no_bag(path, &database, &tables));
    }
    Ok((origin, database, tables))
}

/// Root page and columns of a table.
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

/// Returns the tables listed on the first page.
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

/// Parses the column names of `CREATE TABLE name(column kind, ...)`.
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

/// Returns a note if SQLite left a write-ahead log that is not yet in the database.
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
    /// Topics by number; `None` for those that cannot be read.
    topics: HashMap<i64, Option<usize>>,
    /// First and last time of receipt, ns.
    span_ns: (i64, i64),
}

impl Bag {
    fn new(database: &Database, options: &ReadOptions) -> Self {
        let recording = Recording::new(database.length(), options);
        Self { recording, topics: HashMap::new(), span_ns: (i64::MAX, i64::MIN) }
    }

    fn log(self, origin: Origin, options: &ReadOptions) -> Result<Log, Error> {
        let path = origin.path().to_owned();
        let mut log = self.recording.log(origin, options, FORMAT, "ROS 2 bag (SQLite)")?;
        log.notes.extend(write_ahead(&path));
        Ok(log)
    }

    /// Reads the topics.
    fn read_topics(&mut self, database: &mut Database, tables: &Tables) -> io::Result<()> {
        let definitions = match tables.get("message_definitions") {
            Some(table) => definitions(database, table)?,
            None => HashMap::new(),
        };
        let table = &tables["topics"];
        database
            .rows(table.root, &mut |values, _| self.topic(table, values, &definitions).is_some())
    }

    /// Reads messages from parts of their table and estimates the total from their numbers. Returns
    /// the number of bytes read, or `None` where the table is incomplete.
    fn glance(
        &mut self,
        database: &mut Database,
        tables: &Tables,
        how: Thoroughness,
    ) -> io::Result<Option<u64>> {
        self.read_topics(database, tables)?;
        let table = &tables["messages"];
        let Some(leaves) = database.leaves(table.root)? else { return Ok(None) };
        let page_size = database.page_size();
        let each = (how.part_bytes as u64 / page_size).max(1) as usize;
        let (all, parts) = (leaves.len(), how.parts.max(2));
        if all < each.saturating_mul(parts + 1) {
            return Ok(None);
        }
        let (mut numbers, mut rows) = (None, 0_u64);
        for part in 0..parts {
            let from = part * (all - each) / (parts - 1);
            for &leaf in &leaves[from..from + each] {
                database.leaf_rows(leaf, &mut |values, _| {
                    let number = table.value(values, "id").and_then(Value::integer);
                    let (first, last) = *numbers.get_or_insert((number, number));
                    numbers = Some((first.min(number), last.max(number)));
                    rows += 1;
                    self.message(table, values, 0).is_some()
                })?;
            }
        }
        let found = &database.found;
        let Some((Some(first), Some(last))) = numbers else { return Ok(None) };
        let messages = last.abs_diff(first).saturating_add(1);
        if found.missing.is_some() || !found.damaged.is_empty() || messages < rows {
            return Ok(None);
        }
        self.recording.holds_about(messages, rows);
        Ok(Some((each * parts) as u64 * page_size))
    }

    fn read(&mut self, database: &mut Database, tables: &Tables) -> io::Result<()> {
        self.read_topics(database, tables)?;
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
                self.recording.leave_out(topic, "has no message encoding of ROS");
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
        self.span_ns = (self.span_ns.0.min(receipt), self.span_ns.1.max(receipt));
        if let Some(topic) = topic {
            self.recording.message(topic, receipt, data, byte);
        }
        Some(())
    }
}

/// A bag's definition of a type.
enum Definition {
    Message(String),
    /// In an unsupported language.
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
