//! The parameters of the filter error method, and where each starts.

/// One unknown of the model or of its noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Unknown {
    /// α, 1/kg.
    Alpha,
    /// β, 1/m.
    Beta,
    /// μ, 1/s.
    Mu,
    /// bias, m/s².
    Bias,
    /// Current along the degree of freedom, m/s; one for each trial.
    Current,
    /// First-order lag of propeller speed, s.
    Lag,
    /// Logarithm of the lag of a propeller that slows down over that of one that speeds up.
    LogLagRatio,
    /// Time that a propeller of limited rate needs from rest to full speed, s.
    Slew,
    /// Delay of thrust, s.
    Delay,
    /// Logarithm of the reverse-thrust ratio κ.
    LogReverseRatio,
    /// Logarithm of positive thrust over what its curve says; cannot be fitted, but its doubt
    /// carries over.
    LogForwardRatio,
    /// Thrust lost to inflow, k_in.
    Inflow,
    /// Thrust lost to inflow by propellers that push the way the vehicle goes, beside
    /// [`Unknown::Inflow`].
    InflowAhead,
    /// Exponent of thrust over propeller speed, less 2.
    Exponent,
    /// Lever arm of the velocity sensor that navigation did not know, first axis, m.
    LeverFirst,
    /// The same along the second axis, m.
    LeverSecond,
    /// What turning does to body velocity, as a part of what it does to a rigid body.
    Turning,
    /// What the velocity sensor reads at rest, m/s; seen beside position, one for each trial.
    VelocityOffset,
    /// What the velocity sensor reads too much, as a part of velocity; seen beside position.
    VelocityScale,
    /// Logarithm of the first-order lag of the velocity sensor, s.
    LogSensorLag,
    /// Logarithm of the time over which the velocity sensor averages, s.
    LogSensorWindow,
    /// Logarithm of the standard deviation of the disturbance, m/s².
    LogDisturbance,
    /// Logarithm of its correlation time, s.
    LogCorrelation,
    /// Logarithm of the standard deviation of what waves do, m/s².
    LogSwell,
    /// Logarithm of the waves' angular frequency, rad/s.
    LogSwellFrequency,
    /// Logarithm of the waves' relative damping: how narrow their band is.
    LogSwellDamping,
    /// Logarithm of the standard deviation of what the current varies by in a trial, m/s.
    LogDrift,
    /// Logarithm of the standard deviation of a velocity sample, m/s.
    LogVelocityNoise,
    /// Logarithm of the standard deviation of a position sample, m.
    LogPositionNoise,
    /// Logarithm of the standard deviation of a mean acceleration, m/s².
    LogAccelerationNoise,
    /// What the accelerometer reads at rest, m/s²; one for each trial.
    AccelerationOffset,
    /// Logarithm of the standard deviation of what gravity leaks into acceleration, m/s².
    LogLeak,
    /// Logarithm of its correlation time, s.
    LogLeakCorrelation,
}

impl Unknown {
    /// Whether each trial has its own: a current is of a place and a day.
    pub(crate) const fn is_of_trial(self) -> bool {
        matches!(self, Self::Current | Self::VelocityOffset | Self::AccelerationOffset)
    }

    /// Whether it says how much is left to chance.
    pub(crate) const fn is_noise(self) -> bool {
        matches!(
            self,
            Self::LogDisturbance
                | Self::LogVelocityNoise
                | Self::LogPositionNoise
                | Self::LogAccelerationNoise
                | Self::LogLeak
        )
    }
}

/// How many unknowns there are.
pub(crate) const UNKNOWNS: usize = Unknown::LogLeakCorrelation as usize + 1;

/// Values of all unknowns for one trial; those that are not fitted keep theirs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Values {
    numbers: [f64; UNKNOWNS],
    /// What thrust is made of beside the unknowns.
    pub(crate) shape: Shape,
}

/// What is known of thrust, or decided by trying both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shape {
    /// The greatest propeller speed: where another exponent leaves thrust as it is, and what
    /// a propeller of limited rate needs its time for.
    pub(crate) full_speed: f64,
    /// Whether logged speeds move linearly from sample to sample; else they are held.
    pub(crate) linear: bool,
    /// Whether the velocity sensor lags or averages.
    pub(crate) sensor: Sensor,
    /// Whether waves push.
    pub(crate) swell: bool,
    /// Whether the current varies in a trial.
    pub(crate) drift: bool,
    /// Whether the slope of thrust by its exponent is asked for.
    pub(crate) exponent: bool,
    /// What is usual, which says where numbers mean something.
    pub(crate) usual: Usual,
}

/// What is usual in the fitted trials; zero of what is not known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Usual {
    /// Root mean square, m/s or rad/s.
    pub(crate) speed: f64,
    /// Root mean square, N or N m.
    pub(crate) thrust: f64,
    /// The α of the plant that the search starts from.
    pub(crate) alpha: f64,
}

/// What a velocity sensor does to velocity before it is logged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Sensor {
    /// Nothing.
    #[default]
    Prompt,
    /// A first-order lag.
    Lag,
    /// An average over a window.
    Window,
}

impl Default for Shape {
    fn default() -> Self {
        let sensor = Sensor::Prompt;
        let usual = Usual::default();
        Self {
            full_speed: 1.0,
            linear: false,
            sensor,
            swell: false,
            drift: false,
            exponent: false,
            usual,
        }
    }
}

impl Values {
    /// All zero: no term, no nuisance.
    pub(crate) fn none(shape: Shape) -> Self {
        Self { numbers: [0.0; UNKNOWNS], shape }
    }

    pub(crate) fn get(&self, unknown: Unknown) -> f64 {
        self.numbers[unknown as usize]
    }

    pub(crate) fn set(&mut self, unknown: Unknown, value: f64) {
        self.numbers[unknown as usize] = value;
    }
}

/// Which unknowns are fitted, in which order: the columns of every sensitivity.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Active {
    /// The fitted unknowns.
    pub(crate) unknowns: Vec<Unknown>,
    column: [Option<usize>; UNKNOWNS],
}

impl Active {
    pub(crate) fn new(unknowns: &[Unknown]) -> Self {
        let mut column = [None; UNKNOWNS];
        for (j, unknown) in unknowns.iter().enumerate() {
            column[*unknown as usize] = Some(j);
        }
        Self { unknowns: unknowns.to_vec(), column }
    }

    pub(crate) fn len(&self) -> usize {
        self.unknowns.len()
    }

    /// The column of an unknown, if it is fitted.
    pub(crate) fn column(&self, unknown: Unknown) -> Option<usize> {
        self.column[unknown as usize]
    }
}
