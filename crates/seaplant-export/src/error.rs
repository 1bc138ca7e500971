/// Reason why a plant could not be exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An unknown format.
    #[error("unknown export format `{found}`; expected {known}")]
    UnknownFormat {
        /// The requested name.
        found: String,
        /// The known names.
        known: String,
    },
    /// A plant that should not be used.
    #[error(
        "this plant should not be used: {reasons}; identify a better one, or export it all the same with --anyway"
    )]
    DoNotUse {
        /// The reasons.
        reasons: String,
    },
    /// A plant that the format cannot represent.
    #[error("{format} cannot hold this plant: {reason}")]
    Unsuitable {
        /// The format.
        format: &'static str,
        /// The problem, with advice.
        reason: String,
    },
    /// An archive that could not be made.
    #[error("the archive could not be made: {reason}")]
    Write {
        /// The reason.
        reason: String,
    },
}
