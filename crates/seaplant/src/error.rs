use crate::Dof;

/// An error of the mathematics; each message ends in advice.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A name that matches none of the six degrees of freedom.
    #[error("unknown degree of freedom `{found}`; expected surge, sway, heave, roll, pitch or yaw")]
    UnknownDof {
        /// The text given.
        found: String,
    },
    /// A name that matches none of the terms of the model.
    #[error("unknown term `{found}`; expected force, quadratic, linear or bias")]
    UnknownTerm {
        /// The text given.
        found: String,
    },
    /// A term of a plant that cannot be parsed.
    #[error("the term \"{text}\" {reason} (at character {at})")]
    PlantTerm {
        /// The text given.
        text: String,
        /// Position of the error, in characters from 1.
        at: usize,
        /// The cause and the remedy.
        reason: String,
    },
    /// An inconsistent plant of several axes.
    #[error("the plant of {axes}: {reason}")]
    Plant {
        /// Its axes.
        axes: String,
        /// The cause and the remedy.
        reason: String,
    },
    /// An invalid table of a plant.
    #[error("{key} {reason}")]
    PlantTable {
        /// The offending key.
        key: String,
        /// The cause and the remedy.
        reason: String,
    },
    /// A number in a results file that contradicts another, or that no estimate can have.
    #[error("{key} {reason}; identify again, or restore the results as they were written")]
    ResultsNumber {
        /// The number's key: `plants.surge.by_axis.surge.mass`.
        key: String,
        /// The cause.
        reason: String,
    },
    /// A physically impossible rigid body.
    #[error("the rigid body {reason}")]
    RigidBody {
        /// The cause and the remedy.
        reason: String,
    },
    /// A choice of terms that makes no plant model.
    #[error(
        "the terms [{found}] do not make a plant model; keep `force` and at least one of quadratic and linear"
    )]
    Terms {
        /// The chosen terms.
        found: String,
    },
    /// A name that matches none of the methods.
    #[error("unknown method `{found}`; expected {known}")]
    UnknownMethod {
        /// The text given.
        found: String,
        /// The names of all methods.
        known: String,
    },
    /// A name that matches no quantity.
    #[error("unknown quantity `{found}`; {advice}")]
    UnknownQuantity {
        /// The text given.
        found: String,
        /// The most similar names, or all.
        advice: String,
    },
    /// Series whose lengths differ though they must be equal.
    #[error("{name} has {found} values for {expected} times; give one for each")]
    Length {
        /// Name of the series.
        name: String,
        /// Values given.
        found: usize,
        /// Values needed.
        expected: usize,
    },
    /// Too few samples for an operation.
    #[error("{name} has {found} samples and needs at least {needed}; use a longer stretch of log")]
    TooShort {
        /// Name of the series.
        name: String,
        /// Samples given.
        found: usize,
        /// Samples needed.
        needed: usize,
    },
    /// A number that is NaN or infinite.
    #[error("{name} is not finite at sample {index}; drop such samples first")]
    NotFinite {
        /// Name of the series.
        name: String,
        /// Index of the sample, from 0.
        index: usize,
    },
    /// Times that do not increase strictly.
    #[error(
        "time of {name} goes from {from_s} s to {to_s} s at sample {index}; sort the samples and drop repeated ones"
    )]
    TimeOrder {
        /// Name of the series.
        name: String,
        /// Index of the sample, from 0.
        index: usize,
        /// The time of the sample before, s.
        from_s: f64,
        /// The time of the sample, s.
        to_s: f64,
    },
    /// A setting outside its range.
    #[error("{name} is {found}; it must be {expected}")]
    Setting {
        /// Name of the setting, as a path of fields.
        name: String,
        /// The value given.
        found: String,
        /// The values allowed.
        expected: String,
    },
    /// A filter that cannot be designed.
    #[error(
        "a low-pass of order {order} at {cutoff_hz} Hz cannot be made for samples at {sample_hz} Hz; use an order from 1 to {highest} and a cut-off between 0 and half the sampling rate"
    )]
    Cutoff {
        /// The requested cut-off, Hz.
        cutoff_hz: f64,
        /// The sampling rate, Hz.
        sample_hz: f64,
        /// The requested order.
        order: usize,
        /// The highest order supported.
        highest: usize,
    },
    /// An invalid threshold of Huber's loss.
    #[error(
        "the threshold of Huber's loss is {found} standard deviations; use a number above 0, such as 1.345"
    )]
    HuberLimit {
        /// The requested threshold, in standard deviations.
        found: f64,
    },
    /// Bootstrap settings that give no interval.
    #[error(
        "a bootstrap of {resamples} resamples in blocks of {block_s} s gives no interval; use 100 to 1000000 resamples and blocks of 1 s or longer"
    )]
    Bootstrap {
        /// The requested number of resamples.
        resamples: usize,
        /// The length of a block, s.
        block_s: f64,
    },
    /// Too few converged draws for a covariance.
    #[error(
        "{found} draws of a bootstrap converged, and a covariance needs {needed}; use more draws, or the sandwich estimate"
    )]
    FewDraws {
        /// The number of converged draws.
        found: usize,
        /// The number needed.
        needed: usize,
    },
    /// An invalid thruster.
    #[error("thruster `{name}`: {reason}")]
    Thruster {
        /// Name of the thruster.
        name: String,
        /// The cause and the remedy.
        reason: String,
    },
    /// An invalid rudder or fin.
    #[error("{what} `{name}`: {reason}")]
    Fin {
        /// The type of surface: rudder or fin.
        what: &'static str,
        /// Name of the surface.
        name: String,
        /// The cause and the remedy.
        reason: String,
    },
    /// An invalid thrust table.
    #[error("a thrust table {reason}; check its columns and units")]
    ThrustTable {
        /// The cause.
        reason: String,
    },
    /// Bollard-pull points that do not determine a thrust curve.
    #[error("the bollard-pull points {reason}; {advice}")]
    BollardPull {
        /// The cause.
        reason: String,
        /// The remedy.
        advice: String,
    },
    /// A trial without a channel that its degree of freedom needs.
    #[error("trial `{trial}` has no {what}; {advice}")]
    MissingChannel {
        /// Name of the trial.
        trial: String,
        /// The missing channel.
        what: String,
        /// The channels that would do instead.
        advice: String,
    },
    /// Channels that do not overlap in time.
    #[error(
        "trial `{trial}`: {first} and {second} do not overlap; check the clocks of the files (offset_s), the time units, and from_s and to_s"
    )]
    NoOverlap {
        /// Name of the trial.
        trial: String,
        /// One channel, with its time span.
        first: String,
        /// Another, with its time span.
        second: String,
    },
    /// Records of one trial that do not determine the offset between their clocks.
    #[error(
        "cannot estimate the clock offset ({found}); set it in seconds, or log irregular yaw manoeuvres"
    )]
    ClockOffset {
        /// The signals compared and the outcome.
        found: String,
        /// The number of pairs of signals that could be compared.
        pairs: usize,
    },
    /// A fit that did not converge.
    #[error(
        "the {dof} fit did not converge after {iterations} steps; drop a term or a nuisance, or use a trial with more variation of thrust and speed"
    )]
    NotConverged {
        /// The degree of freedom.
        dof: Dof,
        /// The number of iterations after which the fit stopped.
        iterations: usize,
    },
    /// A method without a trial to fit.
    #[error("no trial to fit {dof} with; give one with role = \"fit\" and dof = [\"{dof}\"]")]
    NoTrial {
        /// The degree of freedom.
        dof: Dof,
    },
    /// A fit without a record.
    #[error("there is no record to fit; give one or more of the same degree of freedom")]
    NoRecord,
    /// Records of several axes given to a fit of one.
    #[error(
        "the records to fit {dof} with hold one of {other}, of trial `{trial}`; fit each degree of freedom by its own records, or several of them as one plant of these axes"
    )]
    OtherAxis {
        /// The degree of freedom of the first record.
        dof: Dof,
        /// The degree of freedom of the other record.
        other: Dof,
        /// The trial of the other record.
        trial: String,
    },
    /// Trials that do not determine all requested parameters.
    #[error(
        "the {dof} trial excites {rank} of the {needed} requested terms: thrust or speed is constant, or zero, or one follows the other; drop a term or use a trial with more variation of thrust and speed"
    )]
    NotExciting {
        /// The degree of freedom.
        dof: Dof,
        /// The number of terms that the trials determine.
        rank: usize,
        /// The number of requested terms.
        needed: usize,
    },
    /// Accelerometer readings that are not specific force in m/s² along the body's axes.
    #[error("trial `{trial}`: {reason}")]
    Accelerometer {
        /// Name of the trial.
        trial: String,
        /// The readings, those expected, and the remedy.
        reason: String,
    },
    /// A method that needs velocity, applied to a log that has acceleration only.
    #[error(
        "neither velocity nor position was measured, only acceleration; use the filter error method, which takes acceleration by itself"
    )]
    NoVelocity,
    /// Numbers whose products overflow a double.
    #[error(
        "the {dof} trial holds numbers so large that their squares are not finite; check the units of thrust and motion, and drop faulty samples"
    )]
    TooLarge {
        /// The degree of freedom.
        dof: Dof,
    },
    /// A diverging simulation.
    #[error(
        "the simulated {dof} velocity diverges after {after_s:.1} s; the plant is unstable at this thrust"
    )]
    Diverged {
        /// The degree of freedom.
        dof: Dof,
        /// The time of divergence, s from the start.
        after_s: f64,
    },
    /// A trial without a steady stretch.
    #[error(
        "no steady stretch in trial `{trial}`: {reason}; give them as segments_s = [[from, to]]"
    )]
    NotSteady {
        /// Name of the trial.
        trial: String,
        /// The criteria of steadiness and the cause.
        reason: String,
    },
    /// A shard of a record that cannot be reduced or merged with others.
    #[error("the shard of `{record}` {reason}")]
    Shard {
        /// Name of the record.
        record: String,
        /// The cause and the remedy.
        reason: String,
    },
    /// An identification without any plant.
    #[error("no plant could be identified:{reasons}")]
    NothingFound {
        /// The cause for each method, one line each.
        reasons: String,
    },
    /// A plant that the results do not include.
    #[error("the results hold {found}")]
    NoPlant {
        /// The missing plant and those present.
        found: String,
    },
    /// An invalid specification of the twin.
    #[error("the twin's {name} is {found}; it must be {expected}")]
    TwinSpec {
        /// Name of the setting.
        name: String,
        /// The value given.
        found: String,
        /// The values allowed.
        expected: String,
    },
}

impl Error {
    pub(crate) fn setting(name: &str, found: impl ToString, expected: impl Into<String>) -> Self {
        let (name, found, expected) = (name.to_owned(), found.to_string(), expected.into());
        Self::Setting { name, found, expected }
    }

    /// Prefixes the name of a [`Error::Setting`] with that of the setting which contains it.
    pub(crate) fn within(self, outer: &str) -> Self {
        match self {
            Self::Setting { name, found, expected } => {
                Self::Setting { name: format!("{outer}.{name}"), found, expected }
            }
            other => other,
        }
    }
}
