//! Compiles a message definition to a flat program that finds the numbers in a message's bytes.

use super::definition::{Definitions, Dialect, Field, HEADER, Kind, Many, Number};
use super::units;

/// Maximum number of elements of arrays and lists that make channels.
pub(crate) const MOST_ELEMENTS: u64 = 32;
/// Maximum nesting depth, and number of fields, of plausible definitions.
const DEEPEST: usize = 32;
const LONGEST: usize = 20_000;

/// Reason why a part of a message, or all of it, makes no channel, in words that follow its name.
type Why = &'static str;

pub(crate) const TOO_LONG: Why = "is a list of more than 32 elements";
pub(crate) const VARYING: Why = "is a list of varying length";
const TEXT: Why = "holds text";
const COVARIANCE: Why = "is a covariance";
const NESTED: Why = "is a list within a list";

/// One step through a message. Columns are relative to the current element, which in a message
/// outside of lists is the first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Step {
    /// A number becomes a column.
    Number {
        number: Number,
        column: usize,
    },
    /// Each number of an array becomes a column.
    Numbers {
        number: Number,
        count: usize,
        column: usize,
    },
    /// Seconds and nanoseconds become one column.
    Time {
        signed: [bool; 2],
        column: usize,
    },
    /// Seconds and nanoseconds are the time of the message.
    Stamp {
        signed: [bool; 2],
    },
    /// Numbers of `size` bytes each are skipped.
    Skip {
        size: usize,
        count: u64,
    },
    /// A list of numbers of `size` bytes each is skipped.
    SkipList {
        size: usize,
    },
    Text,
    WideText,
    /// An array, or without `count` a list, of what the next `steps` steps read is skipped.
    Repeat {
        count: Option<u64>,
        steps: usize,
    },
    /// A list, each element of which the next `steps` steps read.
    List {
        list: usize,
        steps: usize,
    },
    /// Names of the elements of the lists, stored as a list of texts.
    Names,
}

/// A number in a message.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Leaf {
    /// Path such as `twist.linear.x`; in a list, the part after the element, such as `.velocity` or
    /// nothing.
    pub(crate) path: String,
    pub(crate) unit: Option<&'static str>,
}

/// A list whose elements may become columns, once its length is known.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct List {
    pub(crate) path: String,
    /// Columns of one element.
    pub(crate) leaves: Vec<Leaf>,
    /// Size in bytes of an element that is one number.
    pub(crate) size: Option<usize>,
}

/// First column of a quaternion (x, y, z, w), and first column of its three angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Quaternion {
    pub(crate) from: usize,
    pub(crate) to: usize,
}

/// Positions of the numbers in a type of message.
#[derive(Debug, Default)]
pub(crate) struct Layout {
    pub(crate) steps: Vec<Step>,
    pub(crate) leaves: Vec<Leaf>,
    pub(crate) lists: Vec<List>,
    pub(crate) quaternions: Vec<Quaternion>,
    pub(crate) left_out: Vec<(String, Why)>,
}

impl Layout {
    /// Compiles the definition of `name`.
    ///
    /// # Errors
    /// Why it cannot be.
    pub(crate) fn compile(
        definitions: &Definitions,
        name: &str,
        dialect: Dialect,
    ) -> Result<Self, Why> {
        let fields = definitions.fields(name).ok_or(NO_DEFINITION)?;
        let names = fields.iter().any(is_names);
        let mut compiler = Compiler {
            definitions,
            dialect,
            layout: Self::default(),
            element: None,
            skipping: false,
            visits: 0,
            names: names && fields.iter().any(|f| f.many == Many::List && !is_names(f)),
        };
        compiler.message(&Place { path: String::new(), unit: None, depth: 0 }, name)?;
        Ok(compiler.layout)
    }

    /// Makes the stamp a column, where it is not used as the time of the message.
    pub(crate) fn show_stamp(&mut self) {
        let column = self.leaves.len();
        if let Some(step) = self.steps.iter_mut().find(|step| matches!(step, Step::Stamp { .. })) {
            let Step::Stamp { signed } = *step else { return };
            *step = Step::Time { signed, column };
            self.leaves.push(Leaf { path: "header.stamp".to_owned(), unit: Some("s") });
        }
    }
}

const NO_DEFINITION: Why = "has no message definition in the file; record it with one";
const TOO_DEEP: Why = "has a message definition that is too deep or too large";

/// Returns whether a field names the elements of the lists next to it, as in
/// `sensor_msgs/JointState`.
fn is_names(field: &Field) -> bool {
    field.kind == Kind::Text && field.many == Many::List && field.name == "name"
}

struct Compiler<'a> {
    definitions: &'a Definitions,
    dialect: Dialect,
    layout: Layout,
    /// Path of a list and columns of its element, while the element's steps are compiled.
    element: Option<(String, Vec<Leaf>)>,
    /// True while nothing becomes a column.
    skipping: bool,
    /// Number of fields visited.
    visits: usize,
    names: bool,
}

/// Position of a field in a message.
#[derive(Clone)]
struct Place {
    path: String,
    unit: Option<&'static str>,
    depth: usize,
}

impl Place {
    fn field(&self, message: &str, field: &str) -> Self {
        let dot = if self.depth == 0 { "" } else { "." };
        let unit = units::unit(message, field).or(self.unit);
        Self { path: format!("{}{dot}{field}", self.path), unit, depth: self.depth + 1 }
    }

    fn element(&self, k: u64) -> Self {
        Self { path: format!("{}[{k}]", self.path), ..self.clone() }
    }
}

impl Compiler<'_> {
    fn message(&mut self, place: &Place, name: &str) -> Result<(), Why> {
        let fields = self.definitions.fields(name).ok_or(NO_DEFINITION)?;
        self.visits += 1;
        if fields.is_empty() && self.dialect == Dialect::Ros2 {
            // IDL has no empty structures, so ROS 2 fills them with a byte.
            self.push(Step::Skip { size: 1, count: 1 });
        }
        let from = self.columns().len();
        for field in fields {
            self.field(&place.field(name, &field.name), field, name)?;
        }
        if name == "geometry_msgs/Quaternion" && !self.skipping && self.element.is_none() {
            self.angles(place, from);
        }
        Ok(())
    }

    fn field(&mut self, place: &Place, field: &Field, message: &str) -> Result<(), Why> {
        self.visits += 1;
        if place.depth > DEEPEST || self.visits > LONGEST {
            return Err(TOO_DEEP);
        }
        if let Many::One = field.many {
            return match &field.kind {
                Kind::Time { signed } if place.path == "header.stamp" && message == HEADER => {
                    self.push(Step::Stamp { signed: *signed });
                    Ok(())
                }
                kind => self.one(place, kind),
            };
        }
        if place.depth == 1 && self.names && is_names(field) {
            self.leave_out(place, TEXT);
            self.push(Step::Names);
            return Ok(());
        }
        let covariance = ["covariance", "_covar"].iter().any(|end| field.name.ends_with(end));
        match field.many {
            _ if matches!(field.kind, Kind::Text | Kind::WideText) => self.skip(place, TEXT, field),
            _ if covariance => self.skip(place, COVARIANCE, field),
            Many::Array(0) => Ok(()),
            Many::Array(count) if count > MOST_ELEMENTS => self.skip(place, TOO_LONG, field),
            Many::Array(count) => self.array(place, &field.kind, count),
            _ if self.skipping || self.element.is_some() => self.skip(place, NESTED, field),
            _ => self.list(place, &field.kind),
        }
    }

    /// Compiles a single value, which may be a message.
    fn one(&mut self, place: &Place, kind: &Kind) -> Result<(), Why> {
        match kind {
            Kind::Message(name) => return self.message(place, name),
            Kind::Text | Kind::WideText => {
                self.leave_out(place, TEXT);
                self.push(if *kind == Kind::Text { Step::Text } else { Step::WideText });
            }
            Kind::Number(number) => match self.column(place, place.unit) {
                Some(column) => self.push(Step::Number { number: *number, column }),
                None => self.push(Step::Skip { size: number.size(), count: 1 }),
            },
            Kind::Time { signed } => match self.column(place, Some("s")) {
                Some(column) => self.push(Step::Time { signed: *signed, column }),
                None => self.push(Step::Skip { size: 4, count: 2 }),
            },
        }
        Ok(())
    }

    fn array(&mut self, place: &Place, kind: &Kind, count: u64) -> Result<(), Why> {
        if let (Kind::Number(number), false) = (kind, self.skipping) {
            let columns = (0..count).map(|k| self.column(&place.element(k), place.unit));
            let columns: Vec<Option<usize>> = columns.collect();
            if let Some(&Some(column)) = columns.first() {
                let (number, count) = (*number, columns.len());
                self.push(Step::Numbers { number, count, column });
            }
            return Ok(());
        }
        (0..count).try_for_each(|k| self.one(&place.element(k), kind))
    }

    fn list(&mut self, place: &Place, kind: &Kind) -> Result<(), Why> {
        let (at, list) = (self.layout.steps.len(), self.layout.lists.len());
        self.push(Step::List { list, steps: 0 });
        self.element = Some((place.path.clone(), Vec::new()));
        // Paths within start at the element.
        let within = Place { path: String::new(), ..place.clone() };
        self.one(&within, kind)?;
        let (path, leaves) = self.element.take().unwrap_or_default();
        let steps = self.layout.steps.len() - at - 1;
        let size = match kind {
            Kind::Number(number) => Some(number.size()),
            _ => None,
        };
        self.layout.steps[at] = if leaves.is_empty() {
            Step::Repeat { count: None, steps }
        } else {
            self.layout.lists.push(List { path, leaves, size });
            Step::List { list, steps }
        };
        Ok(())
    }

    /// Compiles an array or a list that makes no columns.
    fn skip(&mut self, place: &Place, why: Why, field: &Field) -> Result<(), Why> {
        self.leave_out(place, why);
        let count = match field.many {
            Many::Array(count) => Some(count),
            _ => None,
        };
        if let Kind::Number(number) = field.kind {
            let size = number.size();
            self.push(count.map_or(Step::SkipList { size }, |count| Step::Skip { size, count }));
            return Ok(());
        }
        let at = self.layout.steps.len();
        self.push(Step::Repeat { count, steps: 0 });
        let before = std::mem::replace(&mut self.skipping, true);
        self.one(place, &field.kind)?;
        self.skipping = before;
        let steps = self.layout.steps.len() - at - 1;
        // Elements without bytes, which ROS 1 allows, need no steps, and would take endless time.
        if steps > 0 || count.is_none() {
            self.layout.steps[at] = Step::Repeat { count, steps };
        } else {
            self.layout.steps.truncate(at);
        }
        Ok(())
    }

    fn push(&mut self, step: Step) {
        self.layout.steps.push(step);
    }

    fn columns(&mut self) -> &mut Vec<Leaf> {
        self.element.as_mut().map_or(&mut self.layout.leaves, |(_, leaves)| leaves)
    }

    fn column(&mut self, place: &Place, unit: Option<&'static str>) -> Option<usize> {
        if self.skipping {
            return None;
        }
        let path = place.path.clone();
        let columns = self.columns();
        columns.push(Leaf { path, unit });
        Some(columns.len() - 1)
    }

    fn leave_out(&mut self, place: &Place, why: Why) {
        if self.skipping {
            return;
        }
        let path = match &self.element {
            Some((list, _)) => format!("{list}[]{}", place.path),
            None => place.path.clone(),
        };
        self.layout.left_out.push((path, why));
    }

    /// Adds the attitude angles of the preceding quaternion.
    fn angles(&mut self, place: &Place, from: usize) {
        let to = self.layout.leaves.len();
        if to - from != 4 {
            return;
        }
        let dot = if place.depth == 0 { "" } else { "." };
        for angle in ["roll", "pitch", "yaw"] {
            let path = format!("{}{dot}{angle}", place.path);
            self.layout.leaves.push(Leaf { path, unit: Some("rad") });
        }
        self.layout.quaternions.push(Quaternion { from, to });
    }
}
