//! Reasons to doubt a result, as data that travels with it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How much a caveat matters.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// The numbers may be off by more than their intervals say.
    Warning,
    /// Do not use the numbers.
    Severe,
}

/// What gives reason to doubt.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum CaveatCode {
    /// The filter weakens velocity, but not thrust, at the excited frequency.
    FilterAttenuatesExcitation,
    /// Drag is formed from a velocity that lost amplitude.
    UnequalFiltering,
    /// Mass, drag or linear drag has a sign that no vehicle has.
    WrongSign,
    /// Methods differ by more than their intervals allow.
    MethodsDisagree,
    /// Fewer than twenty independent samples.
    FewEffectiveSamples,
    /// Terms that can hardly be told apart.
    Collinear,
    /// An axis of a plant of several on which nothing pushes.
    UndrivenAxis,
    /// Trials drift further than polynomials of sway and yaw rate hold, or than those fitted.
    DriftBeyond,
    /// Yaw without surge and sway, on a vehicle that drifts under way.
    MunkMoment,
    /// A rudder beyond its limit, or at it most of the time.
    RudderSaturated,
    /// Damping that gives power to the vehicle.
    NotDissipative,
    /// Restoring forces that are not those of the stated weight and buoyancy.
    RestoringContradicts,
    /// Thrust takes two values only.
    TwoLevelThrust,
    /// Thrust never changes sign.
    OneSignedThrust,
    /// A channel, sign, place or unit that explains the logs far better if it is changed.
    LikelyMistake,
    /// Thrust pushes the other way than its log says.
    ThrustReversed,
    /// A thruster that stands still, pushes the other way or gives much less than others.
    ThrusterFault,
    /// Thrusters whose gains, lags or dead bands differ.
    ThrusterGains,
    /// Thrust answers velocity, as under a controller.
    ThrustFollowsVelocity,
    /// The vehicle keeps one speed nearly always.
    OneSpeed,
    /// Drag is a small part of thrust.
    WeakDrag,
    /// Identified mass is below the mass in air.
    MassBelowDryMass,
    /// A bias force that thrust errors or a current can make.
    BiasOneDirection,
    /// Pairs of steady runs up and down that no single bias explains.
    SteadyPairsContradict,
    /// Steady and unsteady drag differ.
    SteadyUnsteadyDisagree,
    /// The error is that of the trial that was fitted.
    ScoredOnFit,
    /// The model predicts no better than standing still.
    NoBetterThanNull,
    /// Another method predicts held-out trials clearly better.
    AnotherPredictsBetter,
    /// Another method's plant is recommended than that of the first method.
    RecommendedByPrediction,
    /// Simulated trials ask for another mass or drag.
    AnotherPlantFits,
    /// The plant changes from one third of the record to another.
    PlantDrifts,
    /// Other axes move this one, and its plant with it.
    CoupledAxes,
    /// Mass or drag could be nearly anything.
    NotDetermined,
    /// Mass or drag is known less well than a user takes a usable plant for.
    WideInterval,
    /// Reverse thrust is off its curve, which this degree of freedom cannot see.
    ReverseThrust,
    /// Less than a minute of motion.
    ShortTrial,
    /// The plant does not come to rest by itself.
    Unstable,
    /// A thruster input beyond its measured curve.
    ThrusterSaturated,
    /// A trial that is too short for a method.
    TrialLeftOut,
    /// A mass or a drag that no body of the vehicle's size has.
    Implausible,
    /// Stretches without samples.
    Gaps,
    /// Samples removed as outliers.
    Outliers,
    /// An instrument or attitude that navigation had to do without.
    Navigation,
    /// A channel whose values do not look like its unit.
    SuspiciousUnit,
    /// An accelerometer that is at the end of its range.
    ClippedAccelerometer,
    /// An accelerometer that reads much at rest: it is tilted beside the attitude sensor.
    TiltedAccelerometer,
    /// Two instruments that do not tell of the same motion.
    InstrumentsDisagree,
    /// The filter could not be as designed at this sampling rate.
    SampledSlowly,
    /// Terms that were decided on a part of a long record.
    SearchedOnPart,
    /// Thrust that was logged slowly and changed in between.
    ThrustBetweenSamples,
    /// Thrust acts later than it was logged.
    LagOrDelay,
    /// The lags of propeller and vehicle exchange: another mass explains the logs as well.
    LagOrMass,
    /// Lag, delay, current and terms that another method found.
    TakenFromAnother,
    /// Fits that a test of their difference does not suit.
    NotComparable,
    /// What the model fails to predict is correlated in time.
    ResidualsNotWhite,
    /// Thrust scale cannot be seen in motion.
    ThrustScale,
    /// Known forces fix the scale of thrust.
    ThrustScaleKnown,
    /// Thrusters that sit where a preset has them.
    PresetGeometry,
    /// The clock of a file was moved by what its data tell.
    ClockOffset,
    /// An instrument sits elsewhere than is stated.
    InstrumentElsewhere,
    /// The log reader dropped or corrected something.
    Log,
}

impl CaveatCode {
    /// Returns the code as words: "wrong sign".
    pub fn words(self) -> String {
        let mut words = String::new();
        for letter in format!("{self:?}").chars() {
            if letter.is_uppercase() && !words.is_empty() {
                words.push(' ');
            }
            words.extend(letter.to_lowercase());
        }
        words
    }
}

/// A reason to doubt a result, and what to do about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Caveat {
    /// What it is.
    pub code: CaveatCode,
    /// How much it matters.
    pub severity: Severity,
    /// In words that a pilot understands.
    pub message: String,
}

impl Caveat {
    /// Creates a caveat that is information only.
    pub fn note(code: CaveatCode, message: impl Into<String>) -> Self {
        Self { code, severity: Severity::Note, message: message.into() }
    }

    /// Creates a caveat for numbers that may be wrong by more than their intervals.
    pub fn warning(code: CaveatCode, message: impl Into<String>) -> Self {
        Self { code, severity: Severity::Warning, message: message.into() }
    }

    /// Creates a caveat for numbers that must not be used.
    pub fn severe(code: CaveatCode, message: impl Into<String>) -> Self {
        Self { code, severity: Severity::Severe, message: message.into() }
    }
}

/// Formats a number for a sentence: three significant digits, or all digits before the point.
pub fn spoken(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    if x.abs() >= 1e7 {
        return format!("{x:.2e}");
    }
    let decimals = (2 - x.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{x:.decimals$}")
}

/// Formats an estimate and its standard deviation for a sentence, as the report's tables do: the
/// standard deviation's second significant digit is the last of both.
pub(crate) fn estimated(value: f64, std: f64) -> String {
    if !(std > 0.0 && std.is_finite() && value.abs().max(std) < 1e7) {
        return format!("{} ± {}", spoken(value), spoken(std));
    }
    let place = std.log10().floor() as i32 - 1;
    let step = 10f64.powi(place.max(0));
    let decimals = (-place).clamp(0, 9) as usize;
    let [value, std] = [value, std].map(|x| if place > 0 { (x / step).round() * step } else { x });
    format!("{value:.decimals$} ± {std:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::{CaveatCode, estimated, spoken};

    #[test]
    fn formats_a_code_as_words() {
        assert_eq!(CaveatCode::MassBelowDryMass.words(), "mass below dry mass");
    }

    #[test]
    fn the_deviation_decides_the_digits_of_an_estimate() {
        let said: Vec<String> =
            [(16364.2, 14.2), (12970.2, 253.0), (0.27812, 0.0341), (2230.9, 0.0), (-7.0, 0.4)]
                .map(|(value, std)| estimated(value, std))
                .into();
        let expected = ["16364 ± 14", "12970 ± 250", "0.278 ± 0.034", "2231 ± 0", "-7.00 ± 0.40"];
        assert_eq!(said, expected);
    }

    #[test]
    fn formats_numbers_to_three_digits() {
        let spoken: Vec<String> =
            [12970.2, 0.27544, -250.04, 7.5, 1e-6, -4.34e18].map(spoken).into();
        assert_eq!(spoken, ["12970", "0.275", "-250", "7.50", "0.00000100", "-4.34e18"]);
    }
}
