//! Bollard-pull tables: thrust against the thruster's command or measured speed.

use std::path::Path;

use schemars::JsonSchema;
use seaplant::ThrusterInput;
use seaplant::results::InputFile;
use seaplant_log::{Dimension, Table, TableColumn, Unit, read_table};
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::units::dimension_of_input;

/// Columns of a bollard-pull table to read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BenchColumns {
    /// The column of inputs; recognised by its unit and name if left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input: Option<String>,
    /// Its unit, if the header does not state it: rad/s, rpm, us, 1, or (rad/s)^2.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input_unit: Option<String>,
    /// The column of forces; recognised by its unit if left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<String>,
    /// Its unit, if the header does not state it: N, kgf, lbf.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_unit: Option<String>,
}

impl BenchColumns {
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// A bollard-pull table, in rad/s, us or as a ratio, and N.
#[derive(Clone, Debug, PartialEq)]
pub struct Bench {
    /// Kind of input.
    pub input: ThrusterInput,
    /// The header of the input column.
    pub input_column: String,
    /// The header of the force column.
    pub force_column: String,
    /// (input, N).
    pub points: Vec<(f64, f64)>,
    /// Number of rows without one of the two.
    pub missing: usize,
    /// The file, for provenance.
    pub source: InputFile,
}

impl Bench {
    /// Builds a table from points in memory, in units as a table's header states them.
    ///
    /// # Errors
    /// [`Error::Value`] for a unit that is none of a force, or none of an input, and for
    /// lists of different length.
    pub fn from_points(
        inputs: &[f64],
        input_unit: &str,
        forces: &[f64],
        force_unit: &str,
    ) -> Result<Self, Error> {
        let path = Path::new(MEMORY);
        let refuse = |key: &str, reason: String| Error::value(path, key, reason);
        if inputs.len() != forces.len() {
            let reason = format!("there are {} for {} inputs", forces.len(), inputs.len());
            return Err(refuse("forces", reason));
        }
        let force = Unit::parse_as(force_unit, Dimension::Force)
            .map_err(|error| refuse("force_unit", error.to_string()))?;
        let reading = INPUTS.into_iter().find_map(|input| stated(input_unit, input));
        let reading = reading.ok_or_else(|| {
            let reason = "is no speed (rad/s, rpm, (rad/s)^2), pulse width (us) or command (1)";
            refuse("input_unit", format!("`{input_unit}` {reason}"))
        })?;
        let pairs = inputs.iter().zip(forces).filter(|(x, f)| x.is_finite() && f.is_finite());
        let points: Vec<_> = pairs.map(|(x, f)| (reading.convert(*x), force.to_si(*f))).collect();
        let source = InputFile { path: MEMORY.to_owned(), bytes: 0, sha256: String::new() };
        let (input_column, force_column) = (input_unit.to_owned(), force_unit.to_owned());
        let (input, missing) = (reading.input(), inputs.len() - points.len());
        Ok(Self { input, input_column, force_column, points, missing, source })
    }
}

/// Name of the source of points that come from no file.
const MEMORY: &str = "points in memory";

/// Spellings of the unit of squared speed.
const SQUARED_SPEED: [&str; 3] = ["(rad/s)^2", "(rad/s)²", "rad²/s²"];

/// Reads a bollard-pull table.
///
/// `wanted` selects the input where the table holds several (pulse width and rpm, say); without it
/// pulse width is preferred to speed, and speed to command.
///
/// # Errors
/// [`Error::Table`] for a table or column that cannot be read, [`Error::Value`] if no
/// column is a force, or an input.
pub fn read_bench(
    path: &Path,
    columns: &BenchColumns,
    wanted: Option<ThrusterInput>,
) -> Result<Bench, Error> {
    let table = read_table(path).map_err(|error| Error::Table(Box::new(error)))?;
    let force = force_column(path, &table, columns)?;
    let (input_column, reading) = input_column(path, &table, columns, wanted)?;
    let pairs = input_column.values.iter().zip(&force.0.values);
    let points: Vec<(f64, f64)> =
        pairs.filter_map(|(x, f)| Some((reading.convert((*x)?), force.1.to_si((*f)?)))).collect();
    Ok(Bench {
        input: reading.input(),
        input_column: input_column.column.clone(),
        force_column: force.0.column.clone(),
        missing: table.rows() - points.len(),
        points,
        source: InputFile {
            path: path.display().to_string(),
            bytes: table.source.bytes,
            sha256: table.source.sha256.clone(),
        },
    })
}

/// Conversion of a column of inputs to the input of a curve.
enum Reading {
    /// A unit of the input itself.
    Plain(ThrusterInput, Unit),
    /// ω|ω| or ω².
    SquaredSpeed,
}

impl Reading {
    fn input(&self) -> ThrusterInput {
        match self {
            Self::Plain(input, _) => *input,
            Self::SquaredSpeed => ThrusterInput::Speed,
        }
    }

    fn convert(&self, x: f64) -> f64 {
        match self {
            Self::Plain(_, unit) => unit.to_si(x),
            Self::SquaredSpeed => x.abs().sqrt().copysign(x),
        }
    }
}

fn force_column<'a>(
    path: &Path,
    table: &'a Table,
    columns: &BenchColumns,
) -> Result<(&'a TableColumn, Unit), Error> {
    let stated = columns.force_unit.as_deref();
    let unit_of = |column: &TableColumn| match stated {
        Some(unit) => Unit::parse_as(unit, Dimension::Force).ok(),
        None => column.unit.as_ref().and_then(|unit| unit.resolve(Dimension::Force).ok()),
    };
    if let Some(name) = &columns.force {
        let column = table.column(name).map_err(|error| Error::Table(Box::new(error)))?;
        let unit = unit_of(column).ok_or_else(|| {
            let reason = "states no unit of force; add force_unit = \"N\", \"kgf\" or \"lbf\"";
            Error::value(path, format!("column `{}`", column.column), reason)
        })?;
        return Ok((column, unit));
    }
    table.columns.iter().find_map(|column| Some((column, unit_of(column)?))).ok_or_else(|| {
        let reason = "no column states a unit of force; name one and its unit (N, kgf, lbf)";
        Error::value(path, "force", reason)
    })
}

/// Order of preference of a table's inputs.
const INPUTS: [ThrusterInput; 3] =
    [ThrusterInput::Pwm, ThrusterInput::Speed, ThrusterInput::Command];

fn input_column<'a>(
    path: &Path,
    table: &'a Table,
    columns: &BenchColumns,
    wanted: Option<ThrusterInput>,
) -> Result<(&'a TableColumn, Reading), Error> {
    let candidates: Vec<ThrusterInput> =
        INPUTS.into_iter().filter(|input| wanted.is_none_or(|wanted| wanted == *input)).collect();
    let read =
        |column: &TableColumn| candidates.iter().find_map(|&input| reading(column, columns, input));
    let found = match &columns.input {
        Some(name) => {
            let column = table.column(name).map_err(|error| Error::Table(Box::new(error)))?;
            read(column).map(|reading| (column, reading))
        }
        None => candidates.iter().find_map(|&input| {
            let of = |column| Some((column, reading(column, columns, input)?));
            table.columns.iter().find_map(of)
        }),
    };
    found.ok_or_else(|| {
        let key = columns.input.as_ref().map_or("input".to_owned(), |name| format!("column `{name}`"));
        let reason = "no unit says that this is a speed (rad/s, rpm, (rad/s)^2), a pulse width (us) or a command (1); name the column and its unit";
        Error::value(path, key, reason)
    })
}

fn reading(column: &TableColumn, columns: &BenchColumns, input: ThrusterInput) -> Option<Reading> {
    if let Some(unit) = &columns.input_unit {
        return stated(unit, input);
    }
    let (dimension, speed) = (dimension_of_input(input), input == ThrusterInput::Speed);
    if speed && SQUARED_SPEED.iter().any(|unit| column.column.contains(unit)) {
        return Some(Reading::SquaredSpeed);
    }
    // Bench tables often head a column with its unit alone: `RPM`.
    let by_name = || Unit::parse_as(column.name.trim(), dimension).ok();
    let by_header = column.unit.as_ref().map(|unit| unit.resolve(dimension).ok());
    by_header.unwrap_or_else(by_name).map(|unit| Reading::Plain(input, unit))
}

/// Returns the conversion of inputs of a stated unit, if the unit is one of theirs.
fn stated(unit: &str, input: ThrusterInput) -> Option<Reading> {
    if input == ThrusterInput::Speed && SQUARED_SPEED.contains(&unit.trim()) {
        return Some(Reading::SquaredSpeed);
    }
    let unit = Unit::parse_as(unit, dimension_of_input(input)).ok()?;
    Some(Reading::Plain(input, unit))
}
