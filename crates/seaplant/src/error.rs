use crate::Dof;

/// Why the mathematics could not be done; each message ends in what to do about it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A name that is none of the six degrees of freedom.
    #[error("unknown degree of freedom `{found}`; expected surge, sway, heave, roll, pitch or yaw")]
    UnknownDof {
        /// What was written.
        found: String,
    },
    /// A name that is none of the terms of the model.
    #[error("unknown term `{found}`; expected force, quadratic, linear or bias")]
    UnknownTerm {
        /// What was written.
        found: String,
    },
    /// A term of a coupled plant that cannot be read.
    #[error("the term \"{text}\" {reason} (at character {at})")]
    PlantTerm {
        /// What was written.
        text: String,
        /// Where it is wrong, in characters from 1.
        at: usize,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// A coupled plant that cannot be.
    #[error("the plant of {axes}: {reason}")]
    Plant {
        /// Its axes.
        axes: String,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// A table of a plant that cannot be read.
    #[error("{key} {reason}")]
    PlantTable {
        /// Which key of it.
        key: String,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// A number of results that contradicts another, or that no estimate has.
    #[error("{key} {reason}; identify again, or restore the results as they were written")]
    ResultsNumber {
        /// Which number: `plants.surge.parameters.mass`.
        key: String,
        /// What is wrong.
        reason: String,
    },
    /// A rigid body that cannot be.
    #[error("the rigid body {reason}")]
    RigidBody {
        /// What is wrong, and what to do.
        reason: String,
    },
    /// A choice of terms that is no plant model.
    #[error(
        "the terms [{found}] do not make a plant model; keep `force` and at least one of quadratic and linear"
    )]
    Terms {
        /// The chosen terms.
        found: String,
    },
    /// A name that is none of the methods.
    #[error("unknown method `{found}`; expected {known}")]
    UnknownMethod {
        /// What was written.
        found: String,
        /// What there is.
        known: String,
    },
    /// A name that is no quantity.
    #[error("unknown quantity `{found}`; {advice}")]
    UnknownQuantity {
        /// What was written.
        found: String,
        /// The near ones, or all.
        advice: String,
    },
    /// Series that must have equal length do not.
    #[error("{name} has {found} values for {expected} times; give one for each")]
    Length {
        /// Whose.
        name: String,
        /// Values given.
        found: usize,
        /// Values needed.
        expected: usize,
    },
    /// Too few samples for an operation.
    #[error("{name} has {found} samples and needs at least {needed}; use a longer stretch of log")]
    TooShort {
        /// Whose.
        name: String,
        /// Samples given.
        found: usize,
        /// Samples needed.
        needed: usize,
    },
    /// A number that is NaN or infinite.
    #[error("{name} is not finite at sample {index}; drop such samples first")]
    NotFinite {
        /// Whose.
        name: String,
        /// Which sample, from 0.
        index: usize,
    },
    /// Time that stands still or runs backwards.
    #[error(
        "time of {name} goes from {from_s} s to {to_s} s at sample {index}; sort the samples and drop repeated ones"
    )]
    TimeOrder {
        /// Whose.
        name: String,
        /// Which sample, from 0.
        index: usize,
        /// The time before, s.
        from_s: f64,
        /// The time there, s.
        to_s: f64,
    },
    /// A setting that is outside of its range.
    #[error("{name} is {found}; it must be {expected}")]
    Setting {
        /// Which setting, by the names of the fields that lead to it.
        name: String,
        /// What it is.
        found: String,
        /// What it must be.
        expected: String,
    },
    /// A filter that cannot be made.
    #[error(
        "a low-pass of order {order} at {cutoff_hz} Hz cannot be made for samples at {sample_hz} Hz; use an order from 1 to {highest} and a cut-off between 0 and half the sampling rate"
    )]
    Cutoff {
        /// The cut-off asked for, Hz.
        cutoff_hz: f64,
        /// The sampling rate, Hz.
        sample_hz: f64,
        /// The order asked for.
        order: usize,
        /// The highest order on offer.
        highest: usize,
    },
    /// A limit of Huber's loss that is none.
    #[error(
        "the threshold of Huber's loss is {found} standard deviations; use a number above 0, such as 1.345"
    )]
    HuberLimit {
        /// What was asked for.
        found: f64,
    },
    /// A bootstrap that says nothing.
    #[error(
        "a bootstrap of {resamples} resamples in blocks of {block_s} s gives no interval; use 100 to 1000000 resamples and blocks of 1 s or longer"
    )]
    Bootstrap {
        /// How many were asked for.
        resamples: usize,
        /// Their length, s.
        block_s: f64,
    },
    /// Too few draws for a covariance.
    #[error(
        "{found} draws of a bootstrap converged, and a covariance needs {needed}; use more draws, or the sandwich estimate"
    )]
    FewDraws {
        /// How many there are.
        found: usize,
        /// How many it takes.
        needed: usize,
    },
    /// A thruster that cannot be.
    #[error("thruster `{name}`: {reason}")]
    Thruster {
        /// Which.
        name: String,
        /// Why.
        reason: String,
    },
    /// A rudder or fin that cannot be.
    #[error("{what} `{name}`: {reason}")]
    Fin {
        /// What it is.
        what: &'static str,
        /// Which.
        name: String,
        /// Why.
        reason: String,
    },
    /// A thrust table that cannot be used.
    #[error("a thrust table {reason}; check its columns and units")]
    ThrustTable {
        /// Why.
        reason: String,
    },
    /// Bollard-pull points that do not determine a curve.
    #[error("the bollard-pull points {reason}; {advice}")]
    BollardPull {
        /// Why.
        reason: String,
        /// What to do.
        advice: String,
    },
    /// A trial lacks a channel that its degree of freedom needs.
    #[error("trial `{trial}` has no {what}; {advice}")]
    MissingChannel {
        /// Which trial.
        trial: String,
        /// What it lacks.
        what: String,
        /// What would do.
        advice: String,
    },
    /// Channels that share no time.
    #[error(
        "trial `{trial}`: {first} and {second} do not overlap; check the clocks of the files (offset_s), the time units, and from_s and to_s"
    )]
    NoOverlap {
        /// Which trial.
        trial: String,
        /// One channel, with its span.
        first: String,
        /// Another, with its span.
        second: String,
    },
    /// Records of one trial that do not tell how far their clocks are apart.
    #[error(
        "cannot estimate the clock offset ({found}); set it in seconds, or log irregular yaw manoeuvres"
    )]
    ClockOffset {
        /// What was compared, and what came of it.
        found: String,
        /// How many pairs of signals could be compared.
        pairs: usize,
    },
    /// A fit that did not reach an optimum.
    #[error(
        "the {dof} fit did not converge after {iterations} steps; drop a term or a nuisance, or use a trial with more variation of thrust and speed"
    )]
    NotConverged {
        /// Which degree of freedom.
        dof: Dof,
        /// After how many iterations it was given up.
        iterations: usize,
    },
    /// A method without a trial to work on.
    #[error("no trial to fit {dof} with; give one with role = \"fit\" and dof = [\"{dof}\"]")]
    NoTrial {
        /// For which degree of freedom.
        dof: Dof,
    },
    /// A fit of no record.
    #[error("there is no record to fit; give one or more of the same degree of freedom")]
    NoRecord,
    /// Records of several axes for a fit of one.
    #[error(
        "the records to fit {dof} with hold one of {other}, of trial `{trial}`; fit each degree of freedom by its own records, or several of them as one plant of these axes"
    )]
    OtherAxis {
        /// Which degree of freedom the first record is of.
        dof: Dof,
        /// Which another is of.
        other: Dof,
        /// The trial of that one.
        trial: String,
    },
    /// Trials that do not tell the parameters apart.
    #[error(
        "the {dof} trial excites {rank} of the {needed} requested terms: thrust or speed is constant, or zero, or one follows the other; drop a term or use a trial with more variation of thrust and speed"
    )]
    NotExciting {
        /// Which degree of freedom.
        dof: Dof,
        /// How many terms can be told apart.
        rank: usize,
        /// How many were requested.
        needed: usize,
    },
    /// An accelerometer whose readings are not specific force in m/s² along the body's axes.
    #[error("trial `{trial}`: {reason}")]
    Accelerometer {
        /// Which trial.
        trial: String,
        /// What it reads, what was expected, and what to do.
        reason: String,
    },
    /// A method that needs velocity, of a log that has acceleration only.
    #[error(
        "neither velocity nor position was measured, only acceleration; use the filter error method, which takes acceleration by itself"
    )]
    NoVelocity,
    /// Numbers whose products a double cannot hold.
    #[error(
        "the {dof} trial holds numbers so large that their squares are not finite; check the units of thrust and motion, and drop faulty samples"
    )]
    TooLarge {
        /// For which degree of freedom.
        dof: Dof,
    },
    /// A simulation that left all bounds.
    #[error(
        "the simulated {dof} velocity diverges after {after_s:.1} s; the plant is unstable at this thrust"
    )]
    Diverged {
        /// Which degree of freedom.
        dof: Dof,
        /// When, s from the start.
        after_s: f64,
    },
    /// No stretch is steady.
    #[error(
        "no steady stretch in trial `{trial}`: {reason}; give them as segments_s = [[from, to]]"
    )]
    NotSteady {
        /// Which trial.
        trial: String,
        /// What was looked for.
        reason: String,
    },
    /// A shard of a record that cannot be reduced, or put together with others.
    #[error("the shard of `{record}` {reason}")]
    Shard {
        /// Which record.
        record: String,
        /// Why, and what to do.
        reason: String,
    },
    /// An identification that came to nothing.
    #[error("no plant could be identified:{reasons}")]
    NothingFound {
        /// Why, method by method, a line each.
        reasons: String,
    },
    /// A plant that results do not hold.
    #[error("the results hold {found}")]
    NoPlant {
        /// What they lack, and what they have.
        found: String,
    },
    /// A twin that cannot be made.
    #[error("the twin's {name} is {found}; it must be {expected}")]
    TwinSpec {
        /// Which setting.
        name: String,
        /// What it is.
        found: String,
        /// What it must be.
        expected: String,
    },
}

impl Error {
    pub(crate) fn setting(name: &str, found: impl ToString, expected: impl Into<String>) -> Self {
        let (name, found, expected) = (name.to_owned(), found.to_string(), expected.into());
        Self::Setting { name, found, expected }
    }

    /// The same error of a setting that lies within another.
    pub(crate) fn within(self, outer: &str) -> Self {
        match self {
            Self::Setting { name, found, expected } => {
                Self::Setting { name: format!("{outer}.{name}"), found, expected }
            }
            other => other,
        }
    }
}
