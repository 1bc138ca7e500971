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
    /// Delay of thrust, s.
    Delay,
    /// Logarithm of the reverse-thrust ratio κ.
    LogReverseRatio,
    /// Logarithm of positive thrust over what its curve says; cannot be fitted, but its doubt
    /// carries over.
    LogForwardRatio,
    /// Thrust lost to inflow, k_in.
    Inflow,
    /// Lever arm of the velocity sensor that navigation did not know, first axis, m.
    LeverFirst,
    /// The same along the second axis, m.
    LeverSecond,
    /// What turning does to body velocity, as a part of what it does to a rigid body.
    Turning,
    /// What the velocity sensor reads at rest, m/s; seen beside position, one for each trial.
    VelocityOffset,
    /// Logarithm of the standard deviation of the disturbance, m/s².
    LogDisturbance,
    /// Logarithm of its correlation time, s.
    LogCorrelation,
    /// Logarithm of the standard deviation of a velocity sample, m/s.
    LogVelocityNoise,
    /// Logarithm of the standard deviation of a position sample, m.
    LogPositionNoise,
}

impl Unknown {
    /// Whether each trial has its own: a current is of a place and a day.
    pub(crate) const fn is_of_trial(self) -> bool {
        matches!(self, Self::Current | Self::VelocityOffset)
    }
}

/// How many unknowns there are.
pub(crate) const UNKNOWNS: usize = 18;

/// Values of all unknowns for one trial; those that are not fitted keep theirs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Values(pub(crate) [f64; UNKNOWNS]);

impl Values {
    pub(crate) fn get(&self, unknown: Unknown) -> f64 {
        self.0[unknown as usize]
    }

    pub(crate) fn set(&mut self, unknown: Unknown, value: f64) {
        self.0[unknown as usize] = value;
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
