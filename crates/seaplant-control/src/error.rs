use seaplant::Dof;

/// Formats three significant digits, rounded down, so that the written value is still valid.
fn three_digits(x: f64) -> String {
    let decimals = (2.0 - x.abs().log10().floor()).clamp(0.0, 12.0);
    let scale = 10_f64.powf(decimals);
    format!("{}", (x * scale).floor() / scale)
}

/// Errors of designing a controller.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An unknown law.
    #[error("`{found}` is no control law; use {known}")]
    UnknownLaw {
        /// The given name.
        found: String,
        /// All laws.
        known: String,
    },
    /// An invalid setting.
    #[error("{name} is {found}; it must be {expected}")]
    Setting {
        /// Its name.
        name: String,
        /// The given value.
        found: String,
        /// The accepted values.
        expected: String,
    },
    /// An axis that the plant does not have.
    #[error("the plant has no {dof}; it has {known}")]
    NoAxis {
        /// The axis.
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
        /// The axis.
        dof: Dof,
        /// The requested bandwidth, Hz.
        asked_hz: f64,
        /// Its phase margin, degrees.
        phase_deg: f64,
        /// The smallest accepted one, degrees.
        least_deg: f64,
        /// Causes of delay.
        late: String,
        /// The greatest bandwidth below with that margin, Hz; absent if there is none.
        reachable_hz: Option<f64>,
    },
    /// An unstable closed loop.
    #[error(
        "the closed loop is unstable: disturbances grow by {growth:.3} in each step of {period_s} s; {}",
        part.map_or("no lower bandwidth is stable: shorten lag or delay, or sample faster".to_owned(), |part| format!("{} times the bandwidths would be stable", three_digits(part)))
    )]
    Unstable {
        /// Growth per step.
        growth: f64,
        /// The controller's period, s.
        period_s: f64,
        /// The greatest stable fraction of the bandwidths; absent if there is none.
        part: Option<f64>,
    },
    /// A controlled vehicle whose speed diverges.
    #[error("the controlled vehicle diverges: the loop is unstable; lower the bandwidth")]
    RunsAway,
    /// An integral time that is too short.
    #[error(
        "a {dof} integral time of {asked_s:.1} s makes the loop unstable; it must be more than {least_s:.1} s"
    )]
    Integral {
        /// The axis.
        dof: Dof,
        /// The requested value, s.
        asked_s: f64,
        /// The smallest valid value, s.
        least_s: f64,
    },
    /// A law that a format cannot represent.
    #[error("{format} has no place for the law {law}; use {known}")]
    Unsuitable {
        /// The format.
        format: &'static str,
        /// The law.
        law: &'static str,
        /// The laws that it supports.
        known: &'static str,
    },
    /// A plant that should not be used.
    #[error(
        "the plant should not be used: {reasons}; identify it better, or make a controller for it with --anyway"
    )]
    DoNotUse {
        /// The reasons.
        reasons: String,
    },
    /// An unreadable file of gains.
    #[error("the gains {reason}")]
    Gains {
        /// The reason.
        reason: String,
    },
    /// An error of the plant itself.
    #[error(transparent)]
    Plant(#[from] seaplant::Error),
}
