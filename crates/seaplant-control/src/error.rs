use seaplant::Dof;

/// Three significant digits, rounded down: what would do does as it is written.
fn three_digits(x: f64) -> String {
    let decimals = (2.0 - x.abs().log10().floor()).clamp(0.0, 12.0);
    let scale = 10_f64.powf(decimals);
    format!("{}", (x * scale).floor() / scale)
}

/// What can be wrong with a controller.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A law that is none.
    #[error("`{found}` is no control law; use {known}")]
    UnknownLaw {
        /// What was given.
        found: String,
        /// All laws.
        known: String,
    },
    /// A setting that cannot be.
    #[error("{name} is {found}; it must be {expected}")]
    Setting {
        /// Which.
        name: String,
        /// What was given.
        found: String,
        /// What it must be.
        expected: String,
    },
    /// An axis that the plant does not have.
    #[error("the plant has no {dof}; it has {known}")]
    NoAxis {
        /// Which.
        dof: Dof,
        /// The axes that it has.
        known: String,
    },
    /// A bandwidth that lag, delay and sampling do not allow.
    #[error(
        "a {dof} bandwidth of {asked_hz:.3} Hz leaves a phase margin of {phase_deg:.0}°, less than {least_deg:.0}°, with {late}; {}more damping, a shorter lag or faster sampling may do",
        reachable_hz.map_or("no lower bandwidth has more; ".to_owned(), |hz| format!("{} Hz would do, and ", three_digits(hz)))
    )]
    Bandwidth {
        /// Of which axis.
        dof: Dof,
        /// What was asked for, Hz.
        asked_hz: f64,
        /// The phase margin that it has, degrees.
        phase_deg: f64,
        /// The least that is taken, degrees.
        least_deg: f64,
        /// What makes thrust late.
        late: String,
        /// The greatest bandwidth below that has that margin, Hz; absent if none has.
        reachable_hz: Option<f64>,
    },
    /// A closed loop that runs away.
    #[error(
        "the closed loop is unstable: disturbances grow by {growth:.3} in each step of {period_s} s; {}",
        part.map_or("no lower bandwidth is stable: shorten lag or delay, or sample faster".to_owned(), |part| format!("{} times the bandwidths would be stable", three_digits(part)))
    )]
    Unstable {
        /// By how much in a step.
        growth: f64,
        /// The controller's period, s.
        period_s: f64,
        /// The greatest part of the bandwidths that is stable; absent if none is.
        part: Option<f64>,
    },
    /// A vehicle under control whose speed grows without end.
    #[error("the controlled vehicle diverges: the loop is unstable; lower the bandwidth")]
    RunsAway,
    /// An integral that acts too fast.
    #[error(
        "a {dof} integral time of {asked_s:.1} s makes the loop unstable; it must be more than {least_s:.1} s"
    )]
    Integral {
        /// Of which axis.
        dof: Dof,
        /// What was asked for, s.
        asked_s: f64,
        /// The least, s.
        least_s: f64,
    },
    /// A law that a format has no place for.
    #[error("{format} has no place for the law {law}; use {known}")]
    Unsuitable {
        /// Which format.
        format: &'static str,
        /// Which law.
        law: &'static str,
        /// Laws that it has a place for.
        known: &'static str,
    },
    /// A plant that should not be used.
    #[error(
        "the plant should not be used: {reasons}; identify it better, or make a controller for it with --anyway"
    )]
    DoNotUse {
        /// Why.
        reasons: String,
    },
    /// A file of gains that cannot be read.
    #[error("the gains {reason}")]
    Gains {
        /// What is wrong.
        reason: String,
    },
    /// What the plant itself has to say.
    #[error(transparent)]
    Plant(#[from] seaplant::Error),
}
