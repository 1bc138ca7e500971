/// Reason why a report could not be made or results not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Results of an unsupported schema.
    #[error(
        "the results say schema `{found}` and this version of Seaplant reads `{known}`; identify again with this version, or read them with the one that wrote them"
    )]
    Schema {
        /// Their schema.
        found: String,
        /// The supported schema.
        known: &'static str,
    },
    /// JSON that is not a results file.
    #[error(
        "this is no results.json of Seaplant: it has no `schema` of its own; give the file that `seaplant identify` wrote"
    )]
    NoSchema,
    /// JSON that is damaged or violates the schema.
    #[error("line {line}, column {column}: {cause}; identify again, or correct the file there")]
    Json {
        /// Line, from 1; 0 on writing.
        line: usize,
        /// Column, from 1; 0 on writing.
        column: usize,
        /// The error.
        cause: String,
    },
    /// Numbers that contradict each other.
    #[error(transparent)]
    Number(#[from] seaplant::Error),
    /// A page that could not be filled in.
    #[error("the report's page could not be made: {cause}; please report this with the results")]
    Template {
        /// The reason.
        cause: String,
    },
    /// A figure that could not be drawn.
    #[error("a figure could not be drawn: {cause}; please report this with the results")]
    Figure {
        /// The reason.
        cause: String,
    },
    /// A figure that could not be written as PNG.
    #[error("a figure could not be written as PNG: {0}; please report this with the results")]
    Png(#[from] png::EncodingError),
    /// A table that could not be written as CSV.
    #[error("a table could not be written as CSV: {0}; please report this with the results")]
    Csv(#[from] csv::Error),
}

impl From<serde_json::Error> for Error {
    fn from(cause: serde_json::Error) -> Self {
        let text = cause.to_string();
        // Serde's messages end with the position, with which this one begins.
        let told = text.rfind(" at line ").map_or(text.as_str(), |end| &text[..end]);
        Self::Json { line: cause.line(), column: cause.column(), cause: told.to_owned() }
    }
}

impl From<minijinja::Error> for Error {
    fn from(cause: minijinja::Error) -> Self {
        Self::Template { cause: cause.to_string() }
    }
}
