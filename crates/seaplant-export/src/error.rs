/// Why a plant could not be exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A name that is no format.
    #[error("unknown export format `{found}`; expected {known}")]
    UnknownFormat {
        /// What was asked for.
        found: String,
        /// What there is.
        known: String,
    },
    /// A plant that should not be used.
    #[error(
        "this plant should not be used: {reasons}; identify a better one, or export it all the same with --anyway"
    )]
    DoNotUse {
        /// Why.
        reasons: String,
    },
    /// A plant that the format has no place for.
    #[error("{format} cannot hold this plant: {reason}")]
    Unsuitable {
        /// Which format.
        format: &'static str,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// An archive that could not be made.
    #[error("the archive could not be made: {reason}")]
    Write {
        /// Why.
        reason: String,
    },
}
