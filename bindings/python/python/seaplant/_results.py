"""The dataclasses of results; ``generate_results.py`` writes this."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from seaplant._record import Estimated, Floats, Record

__all__ = [
    "AccumulatedPlant",
    "Admission",
    "Alone",
    "Assurance",
    "AxisOutcome",
    "AxisResult",
    "BollardPullResult",
    "BuoyancyResult",
    "Candidate",
    "Caveat",
    "CaveatCode",
    "ChannelSummary",
    "ClockOffset",
    "Coefficient",
    "CoefficientRow",
    "ConfirmedMotion",
    "Consequence",
    "Correlation",
    "CurveResult",
    "CurveTable",
    "Disturbance",
    "Dof",
    "Driven",
    "DrivenStretch",
    "Effect",
    "EffectForce",
    "Failure",
    "FileOffset",
    "Filters",
    "Foil",
    "GoalOutcome",
    "GoodFor",
    "Identifiability",
    "Innovations",
    "InputFile",
    "InspectedEpoch",
    "InspectedFile",
    "InspectedOffset",
    "Inspection",
    "LikelyChange",
    "LowPass",
    "LumpedParameters",
    "ManoeuvreOutcome",
    "MatrixResult",
    "MayBeOff",
    "Method",
    "MonteCarloTable",
    "NoiseLevel",
    "NomotoResult",
    "NullModel",
    "NullScore",
    "OffBecause",
    "OffsetPair",
    "OnlineHistory",
    "OpenWater",
    "PairResult",
    "Parameter",
    "ParameterName",
    "Parameters",
    "Part",
    "PlanOutcome",
    "PlantChange",
    "PlantChanged",
    "PlantResult",
    "PlantScore",
    "PrimeCoefficient",
    "PrimeSystem",
    "PropellerAhead",
    "Provenance",
    "Pusher",
    "RegressionResult",
    "Results",
    "RigidBodyResult",
    "Role",
    "Row",
    "RudderFlow",
    "RudderLaw",
    "Score",
    "ScoredMotion",
    "SecondOrder",
    "SegmentResult",
    "SensorResult",
    "Severity",
    "Stability",
    "SteadyResult",
    "SteadyTestResult",
    "SubsetResult",
    "Surface",
    "Symmetry",
    "Term",
    "TermDecision",
    "ThrustPart",
    "ThrusterEstimate",
    "ThrusterFault",
    "ThrusterInput",
    "ThrusterNumber",
    "ThrusterResult",
    "ToldBy",
    "TrialResult",
    "TrueNuisances",
    "TrueParameters",
    "TrueSteady",
    "TrueVehicle",
    "Trust",
    "Truth",
    "Validation",
    "VehicleMonteCarloTable",
    "Verdict",
    "WakeByDrift",
    "WorseTrial",
]

Candidate: TypeAlias = Literal[
    "lag",
    "delay",
    "reverse-ratio",
    "current",
    "inflow",
    "lever",
    "linear-drag",
    "bias",
    "turning",
    "lag-ratio",
    "falling-lag-ratio",
    "slew",
    "inflow-ahead",
    "exponent",
    "dead-band",
    "thrust-change-within",
    "thrust-change-between",
    "voltage",
    "velocity-scale",
    "sensor-lag",
    "sensor-window",
    "swell",
    "current-drift",
    "thrust-jitter",
    "smooth-speed",
    "smooth-thrust",
]
"""Something that may or may not be part of the model."""

CaveatCode: TypeAlias = Literal[
    "filter-attenuates-excitation",
    "unequal-filtering",
    "wrong-sign",
    "methods-disagree",
    "few-effective-samples",
    "collinear",
    "undriven-axis",
    "drift-beyond",
    "munk-moment",
    "rudder-saturated",
    "not-dissipative",
    "restoring-contradicts",
    "two-level-thrust",
    "one-signed-thrust",
    "likely-mistake",
    "thrust-reversed",
    "thruster-fault",
    "thruster-gains",
    "thrust-follows-velocity",
    "one-speed",
    "weak-drag",
    "mass-below-dry-mass",
    "bias-one-direction",
    "steady-pairs-contradict",
    "steady-unsteady-disagree",
    "scored-on-fit",
    "no-better-than-null",
    "another-predicts-better",
    "recommended-by-prediction",
    "another-plant-fits",
    "plant-drifts",
    "coupled-axes",
    "not-determined",
    "wide-interval",
    "reverse-thrust",
    "short-trial",
    "unstable",
    "thruster-saturated",
    "trial-left-out",
    "implausible",
    "gaps",
    "outliers",
    "navigation",
    "suspicious-unit",
    "clipped-accelerometer",
    "tilted-accelerometer",
    "instruments-disagree",
    "sampled-slowly",
    "searched-on-part",
    "thrust-between-samples",
    "lag-or-delay",
    "lag-or-mass",
    "taken-from-another",
    "not-comparable",
    "residuals-not-white",
    "thrust-scale",
    "thrust-scale-known",
    "preset-geometry",
    "clock-offset",
    "instrument-elsewhere",
    "log",
]
"""What gives reason to doubt."""

Disturbance: TypeAlias = Literal[
    "tether",
    "current",
    "lag",
    "delay",
    "thrcoef",
    "lever",
    "swell",
    "inflow",
    "lag-two-way",
    "slew",
    "inflow-one-sided",
    "thrust-exponent",
    "dead-band",
    "battery-sag",
    "swell-narrow-band",
    "current-drift",
    "velocity-averaging",
    "velocity-lag",
    "dvl-scale",
    "spikes",
    "dropouts",
    "stamp-jitter",
    "slow-thrust-log",
    "heading-gaps",
    "heading-drift",
]
"""A disturbance of the vehicle, or an error of its analyst."""

Dof: TypeAlias = Literal[
    "surge",
    "sway",
    "heave",
    "roll",
    "pitch",
    "yaw",
]
"""A degree of freedom of a marine vehicle, in SNAME order."""

InspectedEpoch: TypeAlias = Literal[
    "unix",
    "midnight",
    "start",
    "unstated",
]
"""Epoch of a file's times."""

Method: TypeAlias = Literal[
    "paper",
    "equation-error",
    "output-error",
    "filter-error",
    "weighted-least-squares",
    "adaptive",
    "recursive",
    "ekf",
]
"""Estimation method."""

NoiseLevel: TypeAlias = Literal[
    "low",
    "middle",
    "high",
]
"""Noise level of the instruments."""

NullModel: TypeAlias = Literal[
    "never-moves",
    "keeps-initial-speed",
    "keeps-mean-speed",
    "steady-speed",
    "never-accelerates",
    "thrust-alone",
]
"""A model without a plant."""

ParameterName: TypeAlias = Literal[
    "mass",
    "quadratic-drag",
    "bias-force",
]
"""A parameter of the plant."""

Role: TypeAlias = Literal[
    "fit",
    "hold-out",
    "steady",
]
"""The role of a trial."""

RudderLaw: TypeAlias = Literal[
    "proportional",
    "sine",
]
"""Lateral force of a rudder as a function of its angle δ."""

ScoredMotion: TypeAlias = Literal[
    "velocity",
    "acceleration",
]
"""The quantity in which simulation and measurement are compared."""

Severity: TypeAlias = Literal[
    "note",
    "warning",
    "severe",
]
"""How much a caveat matters."""

Surface: TypeAlias = Literal[
    "rudder",
    "fin",
]
"""A control surface."""

Symmetry: TypeAlias = Literal[
    "port-starboard",
    "none",
    "diagonal",
]
"""The axes that M may couple by the symmetry of the vehicle."""

Term: TypeAlias = Literal[
    "force",
    "quadratic",
    "linear",
    "bias",
]
"""One term of ``v̇ = α τ + β v|v| + μ v + bias``."""

ThrusterInput: TypeAlias = Literal[
    "speed",
    "pwm",
    "command",
    "force",
]
"""What a thruster curve reads."""

ThrusterNumber: TypeAlias = Literal[
    "lag",
    "dead-band",
]
"""A number that a thruster may have of its own, beside that of all."""

ToldBy: TypeAlias = Literal[
    "data",
    "limit",
    "nothing",
    "stated",
]
"""Source of a value."""

Trust: TypeAlias = Literal[
    "do-not-use",
    "doubtful",
    "usable-with-care",
    "usable",
]
"""Level of trust in a plant."""


@dataclass(frozen=True, eq=False, repr=False)
class AccumulatedPlant(Record):
    """The plant by equation error of a record in shards; it has no score, as the whole record
    is not available."""

    dof: Dof
    """The degree of freedom."""

    terms: tuple[Term, ...]
    """The fitted terms."""

    parameters: Parameters
    """Physical parameters."""

    lumped: LumpedParameters
    """Lumped parameters."""

    samples: int
    """Number of rows of the regression."""

    regression: RegressionResult
    """Statistics of the regression."""

    caveats: tuple[Caveat, ...]
    """Caveats."""


@dataclass(frozen=True, eq=False, repr=False)
class Admission(Record):
    """The rate at which a candidate is included: of false alarms, or of detections."""

    dof: Dof
    """The degree of freedom."""

    method: Method
    """The method."""

    candidate: Candidate
    """The candidate."""

    admitted_percent: float
    """Fits that include it, in %."""

    fits: int
    """Fits that tested it."""


@dataclass(frozen=True, eq=False, repr=False)
class Alone(Record):
    """What a fit of one axis alone has beyond a plant's coefficients."""

    terms: tuple[Term, ...]
    """The fitted terms."""

    stable: bool
    """True if the plant comes to rest without thrust."""

    stability: Stability
    """Type of its stability."""

    lumped: LumpedParameters
    """Lumped parameters."""

    lumped_std: LumpedParameters
    """Standard deviations of the lumped parameters."""

    regression: RegressionResult
    """Statistics of the regression."""

    steady_test: SteadyTestResult | None
    """The test for agreement with steady runs; absent without such runs."""

    thrust_part: ThrustPart | None
    """Share of uncertain thrust curves in the variances of mass and quadratic drag; absent if
    no curve has an uncertainty."""


@dataclass(frozen=True, eq=False, repr=False)
class Assurance(Record):
    """Counts of recommended plants with a wrong verdict."""

    dof: Dof
    """The degree of freedom."""

    plants: int
    """Recommended plants."""

    wrong: int
    """Wrong plants."""

    wrong_but_usable: int
    """False assurance: wrong plants with the verdict usable."""

    wrong_but_usable_with_care: int
    """Wrong plants with the verdict usable with care."""

    good: int
    """Good plants."""

    good_but_doubted: int
    """False alarms: good plants with the verdict doubtful, or do not use."""


@dataclass(frozen=True, eq=False, repr=False)
class AxisOutcome(Record):
    """An axis that a plan drives."""

    minutes_planned: float
    """Minutes of manoeuvres that drive it."""

    minutes_driven: float
    """Minutes of these that the logs contain."""

    velocity_planned: Floats
    """Least and greatest velocity of the plan, m/s or rad/s."""

    velocity_reached: Floats | None
    """Least and greatest velocity in all fitted trials: the first and the last percent are
    left out; absent where no trial measures it."""


@dataclass(frozen=True, eq=False, repr=False)
class AxisResult(Record):
    """One degree of freedom of a trial."""

    from_s: float
    """Its start, s."""

    to_s: float
    """Its end, s."""

    sample_hz: float
    """Rate of the regression's grid, Hz."""

    source_hz: float
    """Rate at which motion was measured, Hz."""

    motion: str
    """The measured quantity: velocity, position or acceleration."""

    dominant_amplitude: float
    """Amplitude of force at that frequency, N or N m."""

    force_max: float
    """Greatest force, N or N m."""

    force_rms: float
    """Root mean square force, N or N m."""

    gap_s: float
    """Duration of gaps without samples, s."""

    dominant_hz: float | None
    """Dominant frequency of force, Hz."""

    keulegan_carpenter: float | None
    """Ratio of the stroke to the hull's size across it, if known."""

    speed_max: float | None
    """Greatest speed, m/s or rad/s; absent if neither velocity nor position was measured."""

    speed_rms: float | None
    """Root mean square velocity, m/s or rad/s; absent if neither velocity nor position was
    measured."""

    stroke: float | None
    """Stroke of the oscillation, amplitude of velocity times period, m or rad; for a steady
    run, the distance travelled."""


@dataclass(frozen=True, eq=False, repr=False)
class BollardPullResult(Record):
    """A thrust curve fitted to bollard-pull data."""

    file: str
    """File of the table."""

    input_unit: str
    """Unit of the measured input: rad/s or us."""

    neutral: float
    """The input of zero thrust."""

    residual_rms: float
    """Root mean square misfit, N."""

    r_squared: float
    """1 − Σ misfit² / Σ(thrust − mean)²."""

    points: Floats
    """The measured points, (input, N)."""

    caveats: tuple[Caveat, ...]
    """Caveats."""

    deadband: Parameter | None
    """Half-width of the band around neutral without thrust."""

    forward: Parameter | None
    """Coefficient of positive thrust."""

    reverse: Parameter | None
    """Coefficient of negative thrust."""


@dataclass(frozen=True, eq=False, repr=False)
class BuoyancyResult(Record):
    """Displacement of a vehicle."""

    displaced_kg: float
    """Mass of the displaced water, kg."""

    centre_m: Floats
    """Centre of buoyancy from the vehicle's origin, m."""


@dataclass(frozen=True, eq=False, repr=False)
class Caveat(Record):
    """A reason to doubt a result, and what to do about it."""

    code: CaveatCode
    """What it is."""

    severity: Severity
    """How much it matters."""

    message: str
    """In words that a pilot understands."""


@dataclass(frozen=True, eq=False, repr=False)
class ChannelSummary(Record):
    """One channel."""

    file: str
    """The path of its file."""

    column: str
    """Its header."""

    count: int
    """Number of samples."""

    read: int
    """Number of samples read."""

    missing: int
    """Number of rows without a value, among those read."""

    first_s: float
    """The time of the first sample, s, in the file's clock."""

    last_s: float
    """The time of the last sample, s, in the file's clock."""

    min: float
    """The smallest value that was read, in the channel's unit."""

    max: float
    """The largest value that was read, in the channel's unit."""

    remarks: tuple[str, ...]
    """Irregularities of the values that were read, in plain words."""

    estimated: tuple[str, ...]
    """Names of those of ``count``, ``rate_hz``, ``first_s`` and ``last_s`` that are
    estimates."""

    gaps: int | None
    """Number of intervals longer than five median ones and half a second; absent if only
    parts were read."""

    longest_gap_s: float | None
    """The longest of them, s."""

    rate_hz: float | None
    """Samples per second: 1 / median interval; absent for a single sample."""

    unit: str | None
    """The unit that the header states."""


@dataclass(frozen=True, eq=False, repr=False)
class ClockOffset(Record):
    """How far the clock of a recording is behind another, as the data say."""

    offset_s: float
    """Seconds to add to its clock."""

    std_s: float
    """The standard error of that, s."""

    pairs: tuple[OffsetPair, ...]
    """The pairs of signals that were compared: those that determine the offset, then the
    others."""


@dataclass(frozen=True, eq=False, repr=False)
class Coefficient(Estimated):
    """A coefficient with its uncertainty."""

    value: float
    """The estimate."""

    std: float
    """Its standard deviation."""

    low95: float
    """Lower end of its 95 % interval."""

    high95: float
    """Upper end of its 95 % interval."""

    unit: str
    """Its unit."""

    on: tuple[Dof, ...]
    """The axes on which it acts."""

    told_by: ToldBy
    """The source that determines it."""


@dataclass(frozen=True, eq=False, repr=False)
class CoefficientRow(Record):
    """Errors and coverage of one coefficient over all seeds."""

    name: str
    """Its name."""

    unit: str
    """Its unit."""

    truth: float
    """The true value; zero if the vehicle lacks the term."""

    median_abs_error: float
    """Median of |error|, in its unit."""

    median_error: float
    """Median error, in its unit, which is the bias."""

    coverage_percent: float
    """Share of the 95 % intervals that include the truth, in %."""

    answers: int
    """Plants that have it."""


@dataclass(frozen=True, eq=False, repr=False)
class ConfirmedMotion(Record):
    """Motion of an axis in the trials that confirm a plant there; each range includes 95 % of
    it."""

    trials: tuple[str, ...]
    """The trials."""

    acceleration: Floats | None
    """Minimum and maximum acceleration, m/s² or rad/s²."""

    speed: Floats | None
    """Minimum and maximum speed, m/s or rad/s; absent where speed was not measured."""


@dataclass(frozen=True, eq=False, repr=False)
class Consequence(Record):
    """A number that follows from a plant's coefficients."""

    name: str
    """Name, with the force for which it holds."""

    axis: Dof
    """The axis."""

    value: float
    """The value."""

    unit: str
    """Its unit."""

    interval95: Floats | None
    """Its 95 % interval; absent if the covariance is unknown, or if it is unbounded."""


@dataclass(frozen=True, eq=False, repr=False)
class Correlation(Record):
    """Correlations of coefficients."""

    names: tuple[str, ...]
    """Names of rows and columns."""

    value: Floats
    """Correlations, −1 to 1."""


@dataclass(frozen=True, eq=False, repr=False)
class CurveResult(Record):
    """A thrust curve as data."""

    input: ThrusterInput
    """The input."""

    kind: str
    """One of quadratic, table."""

    deadband: float | None = None
    """Half-width of the band around neutral without thrust."""

    exponent: float | None = None
    """The exponent p."""

    forward: float | None = None
    """c for s > 0, N per unit of input to the power p."""

    neutral: float | None = None
    """The input of zero thrust."""

    reverse: float | None = None
    """c for s < 0, N per unit of input to the power p."""

    voltage: float | None = None
    """Supply voltage of the measurement, V."""

    tables: tuple[CurveTable, ...] | None = None
    """One for each supply voltage."""


@dataclass(frozen=True, eq=False, repr=False)
class CurveTable(Record):
    """Measured points at one supply voltage."""

    points: Floats
    """Points (input, N)."""

    voltage: float | None
    """Supply voltage, V."""


@dataclass(frozen=True, eq=False, repr=False)
class Driven(Record):
    """Range of motion and force on an axis in the trials of a plant."""

    speed_max: float
    """Greatest speed, m/s or rad/s."""

    force_max: float
    """Greatest force, N or N m."""


@dataclass(frozen=True, eq=False, repr=False)
class DrivenStretch(Record):
    """A stretch of a trial in which a manoeuvre was driven."""

    trial: str
    """The trial."""

    from_s: float
    """Its start, in the trial's time, s."""

    to_s: float
    """Its end, s."""


@dataclass(frozen=True, eq=False, repr=False)
class Effect(Record):
    """A named force that is proportional to one coefficient."""

    name: str
    """Name of its coefficient in results: ``rudder.lift``, ``wind.sway``."""

    force: EffectForce
    """The force per unit of the coefficient."""


@dataclass(frozen=True, eq=False, repr=False)
class EffectForce(Record):
    """A force per unit of its coefficient."""

    kind: str
    """One of lift, slipstream, steering, open-water, thrust, advance, inflow, gain, own,
    astern, hull-lift, wind, wind-across."""

    foil: Foil | None = None
    """The rudder."""

    propeller_ahead: PropellerAhead | None = None
    """The propeller ahead of it."""

    propeller: str | None = None
    """The propeller."""

    squared: bool | None = None
    """True if the input is a speed or command n, so that T is n²."""

    behind: OpenWater | None = None
    """The propeller ahead of it."""

    flow: RudderFlow | None = None
    """The influence of hull and slipstream on its inflow."""

    curve: OpenWater | None = None
    """The propeller."""

    direction: Floats | None = None
    """Direction of positive thrust, a unit vector."""

    position_m: Floats | None = None
    """Point of application, m."""

    ahead: bool | None = None
    """True if thrusters lose thrust in their direction of motion only, and gain none when
    braking."""

    thrusters: tuple[Pusher, ...] | None = None
    """The thrusters, at most 16."""

    reverse: bool | None = None
    """True if it applies to negative thrust only."""

    thruster: Pusher | None = None
    """The thruster."""

    number: ThrusterNumber | None = None
    """The number."""

    way: Floats | None = None
    """The unit wrench by axis."""

    along: Dof | None = None
    """Sway or heave, along which it acts."""

    at_m: float | None = None
    """x of the place, m."""

    on: Dof | None = None
    """The axis."""

    scale: float | None = None
    """``½ρ_a A L``; 1 if areas are not known."""


@dataclass(frozen=True, eq=False, repr=False)
class Failure(Record):
    """A failed fit."""

    dof: Dof
    """The degree of freedom."""

    method: str
    """The method, or ``steady``."""

    message: str
    """Reason and advice."""


@dataclass(frozen=True, eq=False, repr=False)
class FileOffset(Record):
    """A file with a clock corrected to those of its trial's other files."""

    file: str
    """Path in the campaign."""

    clock: ClockOffset
    """The offset and its estimation."""


@dataclass(frozen=True, eq=False, repr=False)
class Filters(Record):
    """The filters of a regression."""

    every_term: LowPass | None
    """On every term alike, after that."""

    velocity: LowPass | None
    """On velocity, before v|v| is formed and v differentiated."""


@dataclass(frozen=True, eq=False, repr=False)
class Foil(Record):
    """A control surface, for the computation of its force."""

    kind: Surface
    """The type of surface."""

    name: str
    """Name in channels."""

    position_m: Floats
    """Point of application of its force, m, body frame."""

    axis: Floats
    """The axis of rotation, a unit vector."""

    stall_rad: float | None
    """Its stall angle, rad, beyond which lift is constant."""


@dataclass(frozen=True, eq=False, repr=False)
class GoalOutcome(Record):
    """A goal of a plan and its interval after the dive."""

    name: str
    """The goal."""

    unit: str
    """Its unit."""

    believed: float
    """The value that the plan believed."""

    promised: float
    """Half of the 95 % interval that the plan promised, for its own value."""

    wanted: float
    """Half of the widest interval that meets the goal, for the estimate where there is
    one."""

    is_met: bool
    """True if the interval of the fit meets the goal."""

    obtained: float | None
    """Half of the 95 % interval of the fit."""

    promised_range90: Floats | None
    """Half intervals between which the plan promised nine of ten vehicles that its prior
    allows."""

    value: float | None
    """The estimate; absent if the fit has no such number."""


@dataclass(frozen=True, eq=False, repr=False)
class GoodFor(Record):
    """The motion for which unseen trials confirm a plant: that of the trials which it
    predicts."""

    words: str
    """Description in words."""

    motion: dict[str, ConfirmedMotion]
    """Motion of each axis in the trials that confirm it."""

    not_as_in: tuple[WorseTrial, ...]
    """Trials that the plant predicts worse than a model without a plant: it is not valid for
    their kind of motion."""

    drift_deg: Floats | None
    """Drift angles under way in the trials that confirm sway, deg; absent for plants without
    surge and sway."""


@dataclass(frozen=True, eq=False, repr=False)
class Identifiability(Record):
    """Determination of coefficients by trials."""

    coefficients: int
    """Number of coefficients."""

    rank: int
    """Number of combinations that the motion determines."""

    variance_inflation: dict[str, float]
    """Variance inflation factors of the coefficients by collinearity."""

    not_told: tuple[str, ...]
    """Coefficients with an interval wider than the value."""


@dataclass(frozen=True, eq=False, repr=False)
class Innovations(Record):
    """How the errors of one-step predictions follow each other: white noise, if the model of
    the plant, the disturbance and the noise is right."""

    trial: str
    """Which trial."""

    samples: int
    """How many errors."""

    autocorrelation: Floats
    """Their autocorrelation at lags of 0, 1, 2 … samples; of white noise it stays within
    ±1.96/√samples in 95 of 100 lags."""


@dataclass(frozen=True, eq=False, repr=False)
class InputFile(Record):
    """A file that was read."""

    path: str
    """Path in the campaign."""

    bytes: int
    """Size, bytes."""

    sha256: str
    """SHA-256 of its content, hexadecimal."""


@dataclass(frozen=True, eq=False, repr=False)
class InspectedFile(Record):
    """A file that was read."""

    path: str
    """Path."""

    bytes: int
    """Its size."""

    format: str
    """Format, such as "comma-separated text"."""

    surveyed: bool
    """True if only parts of it were read: the numbers listed under ``estimated`` of its
    channels are estimates, and smallest and largest values and remarks refer to these
    parts."""

    parts: int
    """Number of parts read; 1 for a file that was read completely."""

    bytes_read: int
    """Number of bytes read."""

    epoch: InspectedEpoch
    """Epoch of its times."""

    sha256: str | None
    """SHA-256 of its content, hexadecimal; absent for a file that was read in part."""

    span_s: Floats | None
    """The first and the last time of any of its channels, s, in the file's clock."""


@dataclass(frozen=True, eq=False, repr=False)
class InspectedOffset(Record):
    """Offset of a file's clock to that of the first."""

    file: str
    """The file."""

    against: str
    """The first file."""

    overlap_s: float
    """Overlap of both with the recorded clocks, s; below zero the time between them."""

    same_epoch: bool
    """True if both count from the same instant, as far as they state it."""

    by_satellite_s: float | None
    """Seconds to add to the clock of the file, from the satellite time in an autopilot's log;
    accurate to a second."""

    campaign_line: str | None
    """Line for campaign.toml under ``[[trial]]``; absent if the clocks agree."""

    clock: ClockOffset | None
    """Lag of the clock of the file, estimated from the data."""

    refused: str | None
    """Reason why it cannot be estimated; also absent if the files have no comparable
    signals."""


@dataclass(frozen=True, eq=False, repr=False)
class Inspection(Record):
    """Summary of a log."""

    files: tuple[InspectedFile, ...]
    """The files."""

    channels: tuple[ChannelSummary, ...]
    """Their channels, in the order of the files and of their columns."""

    notes: tuple[str, ...]
    """Notes on what the reader decided or dropped."""

    offsets: tuple[InspectedOffset, ...]
    """Offsets of the other files' clocks to the first's."""


@dataclass(frozen=True, eq=False, repr=False)
class LikelyChange(Record):
    """The change of a plant that unseen trials support: a step of their likelihood from the
    plant, with the estimated disturbances and a current for each trial."""

    mass: Part
    """Relative change of mass; its interval is that of a difference."""

    drag: Part
    """Relative change of drag at the usual speed."""

    whiteness: float
    """Whiteness of the filter's innovations on them: Box and Pierce's statistic over 40 lags,
    divided by 40; 1 if they are white."""

    surprise: float
    """Mean square of the innovations, normalised by their predicted variance: 1 if noise and
    disturbances are as in the fitted trials."""


@dataclass(frozen=True, eq=False, repr=False)
class LowPass(Record):
    """A Butterworth low-pass filter."""

    cutoff_hz: float
    """Frequency at which a single pass halves power, Hz."""

    order: int
    """The order of a single pass, 1 to 8."""


@dataclass(frozen=True, eq=False, repr=False)
class LumpedParameters(Record):
    """Lumped parameters of ``v̇ = α τ + β v|v| + μ v + bias``."""

    alpha: float
    """α = 1/m, 1/kg or 1/(kg m²)."""

    beta: float
    """β = −d_Q/m, 1/m or 1."""

    mu: float
    """μ = −d_L/m, 1/s."""

    bias: float
    """−b/m, m/s² or rad/s²."""


@dataclass(frozen=True, eq=False, repr=False)
class ManoeuvreOutcome(Record):
    """A manoeuvre of a plan, as the logs contain it."""

    name: str
    """Its name in the plan."""

    axes: tuple[Dof, ...]
    """The axes that it drives."""

    minutes_planned: float
    """Minutes of the plan."""

    minutes_driven: float
    """Minutes of fitted trials in which the logged forces follow it."""

    stretches: tuple[DrivenStretch, ...]
    """Where."""

    force_ratio: float | None
    """The logged forces there over those of the plan; absent if it was not driven."""


@dataclass(frozen=True, eq=False, repr=False)
class MatrixResult(Record):
    """A matrix with standard deviations, by row and column in the order of the axes."""

    value: Floats
    """The values."""

    std: Floats
    """Their standard deviations; zero without a term."""


@dataclass(frozen=True, eq=False, repr=False)
class MayBeOff(Record):
    """Possible error of a number, with its cause."""

    number: str
    """Name of the number: "mass", or "surge: drag at 0.4 m/s" for a plant of several axes."""

    because: OffBecause
    """Cause."""

    limit: float
    """Relative error up to which the number counts as usable."""

    part: float | None
    """Relative error: 0.3 where the truth may be 30 % more or less, 2 where it may be three
    times as much or a third; absent where it may have any value."""


@dataclass(frozen=True, eq=False, repr=False)
class MonteCarloTable(Record):
    """Table of a study, with its specification."""

    version: str
    """Version of Seaplant that made it."""

    runs: int
    """Number of twins."""

    spec: dict[str, Any]
    """The twin; that of the first run has its seed."""

    rows: tuple[Row, ...]
    """Errors and coverage."""

    admissions: tuple[Admission, ...]
    """Frequency with which parts were admitted to the model."""

    assurance: tuple[Assurance, ...]
    """Frequency with which wrong plants were recommended without warning."""


@dataclass(frozen=True, eq=False, repr=False)
class NomotoResult(Record):
    """Nomoto's model of yaw rate as a response to a rudder: ``T ṙ + r + α r³ = K (δ − δ₀)``,
    or ``T₁T₂ r̈ + (T₁ + T₂) ṙ + r + α r³ = K (δ − δ₀ + T₃ δ̇)``; with ``rudder_law``
    ``sine``, ``½ sin 2δ`` instead of δ."""

    rudder: str
    """The rudder."""

    order: int
    """First or second order."""

    rudder_law: RudderLaw
    """The function of δ that explains more."""

    gain: Parameter
    """K."""

    time: Parameter
    """T, or T₁ + T₂ − T₃."""

    neutral_angle: Parameter
    """δ₀: the angle of a straight course."""

    is_stable: bool
    """True if a straight course is stable."""

    fit_r2: float
    """R² of yaw rate on the fitted trials, simulated in open loop from their start."""

    hold_out_r2: dict[str, float | None]
    """R² on held-out trials, by trial, each from the initial state of best fit, as for the
    fitted ones; null for a trial that diverges."""

    caveats: tuple[Caveat, ...]
    """Caveats."""

    cubic: Parameter | None
    """α, if r³ is significant."""

    second: SecondOrder | None
    """The times of the second order."""


@dataclass(frozen=True, eq=False, repr=False)
class NullScore(Record):
    """A model without a plant, and its error."""

    model: NullModel
    """Model."""

    mean_abs_error: float
    """e = mean |v_model − v|, m/s or rad/s."""


@dataclass(frozen=True, eq=False, repr=False)
class OffBecause(Record):
    """Cause of a possible error of a number."""

    kind: str
    """One of interval, another-plant-fits, method, sensor-place, thrust-scale."""

    method: Method | None = None
    """Method."""


@dataclass(frozen=True, eq=False, repr=False)
class OffsetPair(Record):
    """Two signals that must agree in time, and what they say."""

    reference: str
    """The one whose clock is kept."""

    other: str
    """The one whose clock is moved."""

    of_thrust: bool
    """Whether one of them is force: whatever thrusters lag behind then counts as offset."""

    correlation: float | None
    """The correlation of the two at that offset, −1 to 1; of force and velocity that of force
    and acceleration, both rid of drag."""

    offset_s: float | None
    """Seconds to add to its clock; absent if it was refused."""

    refused: str | None
    """Why it was not believed."""

    second_peak: float | None
    """How much of the evidence for that offset the next best one has, 0 to 1."""

    std_s: float | None
    """The standard error of that, s."""


@dataclass(frozen=True, eq=False, repr=False)
class OnlineHistory(Record):
    """History of the parameter estimates."""

    time_s: Floats
    """Duration of the motion so far, s, over all fitted trials in sequence."""

    parameters: dict[str, Floats]
    """Each parameter at these instants."""

    settled_s: dict[str, float | None]
    """Time, s of motion, after which each parameter stays within 5 % of its last value;
    absent if that is only within the last tenth."""

    excitation: float
    """Smallest eigenvalue of the information at a unit diagonal: 1 if the parameters are
    determined independently of each other, 0 if some combination is not determined at all."""

    changes: tuple[PlantChanged, ...]
    """Detected changes of the plant."""

    noticeable_change: float | None
    """Relative change of all masses at once that would have been detected within two minutes;
    absent where the motion is too short."""


@dataclass(frozen=True, eq=False, repr=False)
class OpenWater(Record):
    """A propeller with a known open-water curve."""

    propeller: str
    """Name in channels."""

    position_m: Floats
    """Position, m."""

    direction: Floats
    """Direction of positive thrust, a unit vector."""

    diameter_m: float
    """Diameter D, m."""

    k_t: Floats
    """k₀, k₁, k₂."""

    wake: float
    """Wake fraction w in straight motion."""

    density_kg_m3: float
    """Density of the water ρ, kg/m³."""

    wake_by_drift: WakeByDrift | None
    """Variation of the wake with drift angle, if any."""


@dataclass(frozen=True, eq=False, repr=False)
class PairResult(Record):
    """Two steady stretches at one thrust in opposite directions."""

    positive: str
    """The stretch with positive force."""

    negative: str
    """The stretch with negative force."""

    bias_force: Parameter
    """The bias force that explains their difference."""


@dataclass(frozen=True, eq=False, repr=False)
class Parameter(Estimated):
    """A parameter with its uncertainty."""

    value: float
    """The estimate."""

    std: float
    """Its standard deviation."""

    low95: float
    """Lower end of its 95 % interval."""

    high95: float
    """Upper end of its 95 % interval."""

    unit: str
    """Its unit."""


@dataclass(frozen=True, eq=False, repr=False)
class Parameters(Record):
    """The parameters of ``τ = m v̇ + d_Q v|v| + d_L v + b``; absent if not fitted."""

    mass: Parameter
    """Rigid-body plus added mass."""

    added_mass: Parameter | None
    """Mass less that of the vehicle itself, if its rigid body is known or, of translations,
    its mass in air."""

    bias_force: Parameter | None
    """b."""

    linear_drag: Parameter | None
    """d_L."""

    quadratic_drag: Parameter | None
    """d_Q."""


@dataclass(frozen=True, eq=False, repr=False)
class Part(Record):
    """A relative change with its uncertainty."""

    value: float
    """Relative change."""

    std: float
    """Its standard deviation, from batches of the trials."""

    low95: float
    """Lower end of its 95 % interval."""

    high95: float
    """Upper end of its 95 % interval."""


@dataclass(frozen=True, eq=False, repr=False)
class PlanOutcome(Record):
    """A plan compared with the logs and the fit: what was driven, what was not, and what is
    still open."""

    file: str
    """The plan's file."""

    vehicle: str
    """The vehicle of the plan."""

    minutes_planned: float
    """Minutes of the plan."""

    minutes_driven: float
    """Minutes of its manoeuvres that the fitted trials contain."""

    manoeuvres: tuple[ManoeuvreOutcome, ...]
    """Its manoeuvres, in its order."""

    axes: dict[str, AxisOutcome]
    """The axes that it drives."""

    goals: tuple[GoalOutcome, ...]
    """Its goals."""

    open: tuple[str, ...]
    """What is still open: minutes that remain, and the next plan."""

    doubts: tuple[str, ...]
    """Doubts about the comparison."""


@dataclass(frozen=True, eq=False, repr=False)
class PlantChange(Record):
    """The change of a plant that trials support, relative to its values: least squares on the
    errors of its simulation, linear in the change, in addition to an initial velocity, a
    constant force and a current of each trial, and to a time shift of the thrust where that
    explains more."""

    mass: Part
    """Change of the mass: 0.1 where a tenth more would fit better."""

    drag: Part
    """Change of the drag at the speeds of the trials."""

    explained: float
    """Fraction of the squared errors that it explains in cross-validation between halves of
    the trials."""


@dataclass(frozen=True, eq=False, repr=False)
class PlantChanged(Record):
    """A detected change of the plant."""

    trial: str
    """The trial."""

    since_s: float
    """Estimated start, to the resolution of blocks of 15 s, s of the log."""

    noticed_s: float
    """Time of detection, s of the log."""

    statistic: float
    """Cumulative sum of the blocks' excess over the normal statistics, in standard
    deviations."""


@dataclass(frozen=True, eq=False, repr=False)
class PlantResult(Record):
    """The plant of some axes by one method: ``M ν̇_r + C(M, ν_r) ν_r + D(ν_r) ν_r + … + g(η)
    = τ`` with ν_r relative to the water; of one axis ``m v̇ + d_Q v|v| + d_L v + b = τ``."""

    axes: tuple[Dof, ...]
    """Its axes, in SNAME order: rows and columns of every matrix."""

    method: Method
    """The method of identification."""

    symmetry: Symmetry
    """The axes that M may couple."""

    parameters: dict[str, Coefficient]
    """Its coefficients by name: ``mass.surge``, ``mass.surge-pitch``, ``surge: |u|u``, ``yaw:
    |v|r``, ``weight-minus-buoyancy``, ``lever.z``, and those of ``effects``."""

    by_axis: dict[str, Parameters]
    """Mass, drag by its own velocity and constant force of each axis, from ``parameters``."""

    mass_matrix: MatrixResult
    """M: rigid body plus added mass."""

    linear_damping: MatrixResult
    """The matrix that multiplies ν_r; zero without a term."""

    quadratic_damping: MatrixResult
    """The matrix that multiplies |ν|ν of each axis; zero without a term."""

    correlation: Correlation
    """Correlations of the coefficients."""

    nuisances: dict[str, Parameter]
    """Fitted parameters of thrusters, water and instruments: lag, delay, currents by trial,
    disturbance and noise."""

    samples: int
    """Number of measured values, or of rows of a regression."""

    fit: PlantScore
    """Its error on the fitted trials, simulated in open loop."""

    caveats: tuple[Caveat, ...]
    """Caveats."""

    added_mass: Floats | None
    """Added mass, if the rigid body is known."""

    alone: Alone | None
    """What a fit of one axis alone has in addition."""

    driven: dict[str, Driven]
    """Range of motion and force on each axis in its trials; for a plant of several axes."""

    effects: tuple[Effect, ...]
    """Forces of rudders, fins, propellers of unknown strength and wind."""

    history: OnlineHistory | None
    """Parameters over time; absent for methods that are not recursive."""

    hold_out: PlantScore | None
    """Its error on unseen trials."""

    identifiability: Identifiability | None
    """Determination of the coefficients of several axes by the trials."""

    innovations: tuple[Innovations, ...]
    """Autocorrelation of the errors of one-step predictions, by fitted trial; empty for
    methods without them."""

    left_out: PlantScore | None
    """Without held-out trials: the error on fitted trials, or thirds of a single one, each
    predicted by a plant fitted to the others."""

    log_likelihood: float | None
    """Log-likelihood at the optimum; absent for methods without one."""

    nondimensional: PrimeSystem | None
    """Dimensionless coefficients, if the vehicle's length is known."""

    rigid_body_mass_matrix: Floats | None
    """M of the rigid body, if known."""

    single_axes: dict[str, Score]
    """The error, on the same trials, of a separate plant of each driven axis, for comparison:
    the difference is due to coupling."""

    structure: tuple[TermDecision, ...]
    """The candidates that were tested: terms, what thrusters and sensors may do, and what
    thrust may do between its logged samples, ``smooth-speed`` and ``smooth-thrust``."""

    thruster_estimates: dict[str, ThrusterEstimate]
    """What each thruster gives over what its curve says, where most others give what theirs
    say; without those of which the trials do not determine it."""

    thruster_faults: tuple[ThrusterFault, ...]
    """Thrusters that were at rest or reversed in a trial, for which the fit allows."""

    thrusters_exchanged: tuple[tuple[str, ...], ...]
    """Pairs of thrusters of which each does what the log of the other says; they were taken
    to do so."""

    verdict: Verdict
    """The verdict."""

    verdicts: dict[str, Verdict]
    """The verdict on each of several axes: a plant is doubtful if one of them is."""

    whiteness: float | None
    """Whiteness of innovations: Box–Pierce over 40 lags, divided by 40; 1 if they are white.
    Absent for methods without innovations."""


@dataclass(frozen=True, eq=False, repr=False)
class PlantScore(Record):
    """The error of a plant on some trials, simulated in open loop."""

    by_axis: dict[str, Score]
    """Over all trials."""

    by_trial: dict[str, dict[str, Score]]
    """By trial."""


@dataclass(frozen=True, eq=False, repr=False)
class PrimeCoefficient(Record):
    """A dimensionless coefficient."""

    symbol: str
    """Symbol: ``Y'_vvr``, with the sign of a force on the vehicle; ``m22'`` for a mass."""

    value: float
    """The estimate."""

    std: float
    """Its standard deviation."""

    low95: float
    """Lower end of its 95 % interval."""

    high95: float
    """Upper end of its 95 % interval."""


@dataclass(frozen=True, eq=False, repr=False)
class PrimeSystem(Record):
    """Coefficients in the prime system: forces over ``½ρ L T U²``, moments over ``½ρ L² T
    U²``, masses over ``½ρ L² T``, velocities over U and rates over U/L."""

    length_m: float
    """L, m."""

    depth_m: float
    """T, m: the draught, or L if no draught is stated."""

    density_kg_m3: float
    """ρ, kg/m³."""

    speed_m_s: float
    """U, m/s: the mean speed of the fitted trials. Coefficients of second degree are
    independent of it."""

    coefficients: dict[str, PrimeCoefficient]
    """Coefficients by name."""


@dataclass(frozen=True, eq=False, repr=False)
class PropellerAhead(Record):
    """The propeller ahead of a fin."""

    propeller: str
    """Name in channels."""

    squared: bool
    """True if the input is a speed or command n, so that T is n²."""


@dataclass(frozen=True, eq=False, repr=False)
class Provenance(Record):
    """Source of the results."""

    command: str
    """The command to repeat them."""

    inputs: tuple[InputFile, ...]
    """Every file that was read."""

    settings: dict[str, str]
    """The effective settings, defaults included."""

    seed: int | None
    """Seed of all random numbers; absent if none was drawn."""


@dataclass(frozen=True, eq=False, repr=False)
class Pusher(Record):
    """Position and direction of a thruster, for the computation of inflow."""

    name: str
    """Name in channels."""

    position_m: Floats
    """Point of application, m."""

    direction: Floats
    """Direction of positive thrust, a unit vector."""


@dataclass(frozen=True, eq=False, repr=False)
class RegressionResult(Record):
    """Statistics of a regression."""

    effective_samples: float
    """Equivalent number of independent rows."""

    condition: float
    """Condition number of the columns, scaled to unit length."""

    variance_inflation: dict[str, float]
    """Variance inflation of each fitted term except the bias."""

    residual_rms: float
    """Root mean square of the residuals: of equation errors, m/s² or rad/s²; of output
    errors, in the unit of the measurement."""

    filters: Filters
    """The filters."""


@dataclass(frozen=True, eq=False, repr=False)
class Results(Record):
    """The results of an identification."""

    schema: str
    """``SCHEMA``."""

    version: str
    """Version of Seaplant that wrote the file."""

    vehicle: str
    """Name of the vehicle."""

    provenance: Provenance
    """Source of the results, and the command to repeat them."""

    plants: dict[str, PlantResult]
    """The recommended plants by their axes: ``surge``, ``surge-sway-yaw``."""

    methods: dict[str, dict[str, PlantResult]]
    """Every method's plants by their axes."""

    subsets: dict[str, tuple[SubsetResult, ...]]
    """The plants of the recommended method for every subset of terms."""

    steady: dict[str, SteadyResult]
    """Drag from steady stretches."""

    thrusters: tuple[ThrusterResult, ...]
    """The thrusters as used."""

    sensors: tuple[SensorResult, ...]
    """The instruments as used."""

    trials: tuple[TrialResult, ...]
    """The trials."""

    failures: tuple[Failure, ...]
    """Failures with their reasons."""

    caveats: tuple[Caveat, ...]
    """Caveats of the campaign."""

    bollard_pull: BollardPullResult | None
    """The thrust curve fitted to bollard-pull data, if any."""

    buoyancy: BuoyancyResult | None
    """Its displacement and centre of buoyancy, if known."""

    consequences: tuple[Consequence, ...]
    """Consequences of the recommended plants at the greatest force of the trials: top speeds,
    time constants, stopping distances, natural periods."""

    dry_mass_kg: float | None
    """Its mass in air, kg."""

    plan: PlanOutcome | None
    """The plan of the dive compared with what was driven and found, if one was named."""

    rigid_body: RigidBodyResult | None
    """Its rigid body, if known."""

    size_m: Floats | None
    """Length, width and height of its hull, m."""

    steering: tuple[NomotoResult, ...]
    """Nomoto's models of steering, if a plant has yaw among its axes and a rudder is
    logged."""

    truth: dict[str, float] | None
    """True coefficients by name, as in a plant's ``parameters``, if the logs are those of a
    twin."""


@dataclass(frozen=True, eq=False, repr=False)
class RigidBodyResult(Record):
    """The rigid body of a vehicle."""

    mass_kg: float
    """Mass in air, kg."""

    centre_of_gravity_m: Floats
    """Centre of gravity from the vehicle's origin, m."""

    inertia_kg_m2: Floats
    """Inertia about the centre of gravity, kg m²."""


@dataclass(frozen=True, eq=False, repr=False)
class Row(Record):
    """Errors and coverage over all seeds."""

    dof: Dof
    """The degree of freedom."""

    method: Method
    """The method."""

    parameter: ParameterName
    """The parameter."""

    median_abs_error_percent: float
    """Median of |error|, in % of the truth."""

    median_error_percent: float
    """Median error, in % of the truth, which is the bias."""

    coverage_percent: float
    """Share of the 95 % intervals that include the truth, in %."""

    answers: int
    """Fits with a result."""

    failures: int
    """Fits without a result."""


@dataclass(frozen=True, eq=False, repr=False)
class RudderFlow(Record):
    """Influence of hull and propeller on the flow at a rudder, and of the rudder on the
    hull's force."""

    wake_ratio: float
    """ε: the wake at the rudder over that at the propeller, ``(1 − w_R)/(1 − w_P)``."""

    race_factor: float
    """κ: acceleration of the slipstream at the rudder."""

    diameter_to_span: float
    """η: the propeller's diameter over the rudder's span."""

    straightening: Floats
    """γ_R: flow-straightening coefficient, for flow from starboard and from port."""

    flow_at_m: float
    """l_R: the x at which the sideways flow equals that at the rudder, m."""

    steering_deduction: float
    """t_R: steering resistance deduction fraction."""

    hull_increase: float
    """a_H: rudder force increase factor of the hull."""

    hull_at_m: float
    """x_H: point of application of the additional force, m."""


@dataclass(frozen=True, eq=False, repr=False)
class Score(Record):
    """The error of a plant on one axis, of some trials or of one; values are absent if the
    simulation diverges, and where a method or an instrument does not give them."""

    null_error: float
    """e of a model that never moves, or that never accelerates."""

    samples: int
    """Number of compared samples."""

    best_null: NullScore | None
    """The best model without a plant; absent if a simulation diverged."""

    change: PlantChange | None
    """The change of the plant that would minimise the errors of its simulation; absent where
    they do not determine it."""

    disturbance_error: float | None
    """Mean change of the model's velocity by a draw of the estimated disturbance, m/s or
    rad/s, which is the expected error of the true plant; includes the noise of velocities
    from differentiated positions."""

    kept_error: float | None
    """The same error of a constant rate from each restart."""

    likely_change: LikelyChange | None
    """The change of the plant that the likelihood of unseen trials supports."""

    mean_abs_error: float | None
    """e = mean |v_model − v| on raw velocity."""

    offset_free_error: float | None
    """e with an initial velocity, a constant force and, for translations, a current fitted to
    each trial (for long ones, to each 150 s): the criterion for comparison of methods."""

    position_mean_abs_error: float | None
    """Mean |model − measured| of position, m or rad; of one trial."""

    position_r_squared: float | None
    """R² of position, where position was measured; of one trial."""

    quantity: ScoredMotion
    """Compared quantity: where velocity was not measured, e and R² are of acceleration, in
    means over half a second after removal of the accelerometer's offset."""

    r_squared: float | None
    """1 − Σ(v_model − v)² / Σ(v − mean v)²."""

    restarted_error: float | None
    """Mean |model − measured| of roll and pitch with the model restarted from the measured
    state every 10 s, rad/s: over a whole trial, an error of phase of these oscillations would
    dominate."""


@dataclass(frozen=True, eq=False, repr=False)
class SecondOrder(Record):
    """Times of the second order."""

    time_sum: Parameter
    """T₁ + T₂."""

    time_product: Parameter
    """T₁ T₂."""

    zero_time: Parameter
    """T₃."""


@dataclass(frozen=True, eq=False, repr=False)
class SegmentResult(Record):
    """One steady stretch."""

    trial: str
    """Name of the trial."""

    from_s: float
    """Its start, s."""

    to_s: float
    """Its end, s."""

    force: float
    """Mean force, N or N m."""

    force_part: float
    """Force as a fraction of the greatest of all stretches."""

    velocity: float
    """Mean velocity, m/s or rad/s."""

    velocity_std: float
    """Standard deviation of the mean velocity."""

    quadratic_drag: Parameter
    """d_Q = τ / v|v|."""

    mean_abs_error: float
    """Mean absolute error e with the stretch's own drag."""

    joint_error: float | None
    """Mean absolute error e with the joint drag and bias force."""


@dataclass(frozen=True, eq=False, repr=False)
class SensorResult(Record):
    """An instrument as used."""

    name: str
    """Name of the instrument."""

    position_m: Floats
    """Position, m."""

    rotation_deg: Floats
    """Roll, pitch and yaw of its alignment, deg."""

    unit: str
    """Unit of the standard deviation."""

    rate_hz: float | None
    """Logging rate, Hz, if it was logged."""

    std: float | None
    """Standard deviation of one sample."""


@dataclass(frozen=True, eq=False, repr=False)
class Stability(Record):
    """Stability of a plant without thrust."""

    kind: str
    """One of stable, stable-below, unstable-at-rest, unstable."""

    speed: float | None = None
    """The limit, m/s or rad/s."""


@dataclass(frozen=True, eq=False, repr=False)
class SteadyResult(Record):
    """Drag of one degree of freedom from steady stretches."""

    segments: tuple[SegmentResult, ...]
    """Each stretch."""

    mean_quadratic_drag: float
    """The mean of the stretches' drags."""

    pairs: tuple[PairResult, ...]
    """Pairs of opposite directions at one thrust."""

    caveats: tuple[Caveat, ...]
    """Caveats."""

    bias_force: Parameter | None
    """Joint estimate of the bias force."""

    quadratic_drag: Parameter | None
    """Joint estimate of d_Q, with a bias force."""


@dataclass(frozen=True, eq=False, repr=False)
class SteadyTestResult(Record):
    """Test for agreement of steady runs with other trials."""

    likelihood_ratio: float
    """Twice the increase of log-likelihood if the two may differ."""

    numbers: int
    """Number of parameters that may then differ."""

    p_value: float
    """Probability of as large an increase by chance."""

    agrees: bool
    """True if they agree, and steady runs are part of the fit."""

    unsteady: Parameters
    """The plant of unsteady trials, if the two may differ."""

    steady: Parameters
    """The plant of steady runs, with the same mass."""


@dataclass(frozen=True, eq=False, repr=False)
class SubsetResult(Record):
    """The plant of the recommended method for a subset of terms."""

    terms: tuple[Term, ...]
    """The terms."""

    lumped: LumpedParameters
    """The parameters."""

    stable: bool
    """True if the plant comes to rest without thrust."""

    condition: float
    """Condition number of the scaled columns."""

    fit_error: float | None
    """Mean absolute error e on the fitted trials."""

    hold_out_error: float | None
    """Mean absolute error e on held-out trials."""


@dataclass(frozen=True, eq=False, repr=False)
class TermDecision(Record):
    """A candidate of the model and the decision on it."""

    candidate: str
    """The term, or what thrust or a sensor may do."""

    admitted: bool
    """True if the model includes it."""

    likelihood_ratio: float
    """Twice the increase of log-likelihood, at least 0: fitted, or by the score test."""

    needed: float | None
    """What the extended Bayesian information criterion asks for, where that decides: numbers
    added times ln n, and 2 ln P of P candidates that are tried."""

    p_value: float | None
    """Probability of as large an increase by chance, where that decides."""

    size: float | None
    """How much a term does, where that decides: linear drag as a part of quadratic drag at
    the usual speed, zero unless both brake; a bias force, at the end of its interval that is
    farther from zero, as a part of the usual thrust."""


@dataclass(frozen=True, eq=False, repr=False)
class ThrustPart(Record):
    """Fractions of variances, 0 to 1."""

    mass: float
    """That of mass."""

    quadratic_drag: float | None
    """That of quadratic drag; absent if it was not fitted."""


@dataclass(frozen=True, eq=False, repr=False)
class ThrusterEstimate(Record):
    """What the trials of a fit say of one thruster."""

    gain: Parameter
    """Thrust over that of its curve, ahead and in reverse unless ``reverse`` differs."""

    is_fitted: bool
    """Whether the plant has these gains; else the trials do not ask for any, and ``gain`` is
    what they say of it to first order."""

    of_curve: Parameter | None
    """Thrust over what its curve says ahead, with the scale of all thrust, where known forces
    reveal it."""

    reverse: Parameter | None
    """The same of thrust below zero, where the trials show that it is another."""


@dataclass(frozen=True, eq=False, repr=False)
class ThrusterFault(Record):
    """A thruster whose thrust in a trial differs from its log."""

    trial: str
    """Name of the trial."""

    thruster: str
    """Name of the thruster."""

    gain: float
    """Ratio of thrust to that of the log: 0 for one at rest, −1 for a reversed one."""


@dataclass(frozen=True, eq=False, repr=False)
class ThrusterResult(Record):
    """A thruster as used."""

    name: str
    """Its name."""

    position_m: Floats
    """Point of application of thrust, m."""

    direction: Floats
    """Unit vector of positive thrust."""

    input: str
    """Input of its curve."""

    curve: str
    """Description of its curve."""

    law: CurveResult | None
    """Its curve; absent from older results."""

    thrust_std: Floats | None
    """Relative standard deviation of its coefficients ahead and in reverse; absent if not
    stated."""


@dataclass(frozen=True, eq=False, repr=False)
class TrialResult(Record):
    """A trial as used."""

    name: str
    """Its name."""

    role: Role
    """Its role."""

    files: tuple[str, ...]
    """The files of its log."""

    axes: dict[str, AxisResult]
    """Each degree of freedom that it excites."""

    offsets: tuple[FileOffset, ...]
    """The files with clocks corrected by an estimated offset."""


@dataclass(frozen=True, eq=False, repr=False)
class TrueNuisances(Record):
    """True values of the nuisance parameters of an estimator. If disabled, a ratio is 1, the
    exponent 2, and others 0."""

    averaging_s: float
    """Averaging window of the DVL, s."""

    current_m_s: float
    """Mean current, m/s, about which that of each trial varies."""

    dead_band: float
    """Part of the greatest command below which propellers do not turn."""

    delay_s: float
    """Delay of the propellers, s."""

    drift_std_m_s: float
    """Standard deviation of the drifting current, m/s."""

    dvl_scale: float
    """Scale factor of the DVL."""

    inflow: float
    """k_in of ``F = k n|n| − k_in |n| v``, N s²/(rad m)."""

    inflow_one_sided: float
    """k_in of a propeller that pushes in the direction of motion, if only such lose thrust, N
    s²/(rad m)."""

    lag_down_s: float
    """Time constant of propellers that slow down, s."""

    lag_s: float
    """Time constant of the propellers, s, if it is equal for speeding up and slowing down."""

    lag_up_s: float
    """Time constant of propellers that speed up, s."""

    lever_m: float
    """Distance by which the DVL is ahead of, and below, its position in the analyst's
    vehicle, m."""

    reverse_ratio: float
    """Ratio of reverse thrust to that of the analyst's curve."""

    sag_part: float
    """Fraction of thrust lost by the end of a degree of freedom's last trial."""

    slew_s: float
    """Time of a propeller from rest to its greatest speed, s."""

    swell_n: float
    """Amplitude of the swell, N."""

    swell_std_n: float
    """Standard deviation of the narrow-band swell, N."""

    tether_correlation_s: float
    """Correlation time of the tether's force, s."""

    tether_n: float
    """Standard deviation of the tether's force, N."""

    thrust_exponent: float
    """p of F ∝ |n|^p."""

    velocity_lag_s: float
    """Time constant of the DVL, s."""


@dataclass(frozen=True, eq=False, repr=False)
class TrueParameters(Record):
    """The true plant of one degree of freedom."""

    mass: float
    """Rigid-body plus added mass, kg or kg m²."""

    quadratic_drag: float
    """d_Q, N/(m/s)² or N m/(rad/s)²."""

    linear_drag: float
    """d_L, N/(m/s) or N m/(rad/s)."""

    bias_force: float
    """b, N or N m."""


@dataclass(frozen=True, eq=False, repr=False)
class TrueSteady(Record):
    """True values of steady runs."""

    quadratic_drag: float
    """d_Q, N/(m/s)²."""

    bias_force: float
    """b, N."""


@dataclass(frozen=True, eq=False, repr=False)
class TrueVehicle(Record):
    """True values of a vehicle of several axes."""

    name: str
    """Name of its plant."""

    coefficients: dict[str, float]
    """Its coefficients, by their names in results."""

    tether: dict[str, float]
    """Standard deviation of the tether's force on each driven axis, N or N m."""

    mean_current_m_s: dict[str, Floats]
    """Mean current in each trial, north and east, m/s."""


@dataclass(frozen=True, eq=False, repr=False)
class Truth(Record):
    """The twin's true values, in the units of the results."""

    seed: int
    """The seed of every random number."""

    noise: NoiseLevel
    """Noise level of the instruments."""

    disturbances: tuple[Disturbance, ...]
    """Disturbances of the vehicle, and errors of its analyst."""

    plants: dict[str, TrueParameters]
    """The plant of each degree of freedom."""

    steady: dict[str, TrueSteady]
    """Drag in steady runs, by degree of freedom."""

    nuisances: TrueNuisances
    """True values of nuisance parameters."""

    mean_current_m_s: dict[str, float]
    """Mean current in each trial, m/s: along the degree of freedom, in yaw to the north."""

    vehicle: TrueVehicle | None
    """The vehicle of several axes, if several move at once."""


@dataclass(frozen=True, eq=False, repr=False)
class Validation(Record):
    """A plant's score on some trials."""

    axes: tuple[Dof, ...]
    """Its axes, which are simulated together."""

    score: PlantScore
    """Its errors."""

    fitted_to: tuple[str, ...]
    """Trials that the plant was fitted to: their scores are optimistic."""

    method: Method | None
    """The method of the plant; absent for a published table."""


@dataclass(frozen=True, eq=False, repr=False)
class VehicleMonteCarloTable(Record):
    """Table of a study of a complete vehicle, with its specification."""

    version: str
    """Version of Seaplant that made it."""

    runs: int
    """Number of twins."""

    spec: dict[str, Any]
    """The twin; that of the first run has its seed."""

    coefficients: tuple[CoefficientRow, ...]
    """Errors and coverage of each coefficient."""

    assurance: tuple[Assurance, ...]
    """Frequency with which axes were presented without warning although wrong."""

    failures: dict[str, str]
    """Reasons why plants were not identified, by seed."""


@dataclass(frozen=True, eq=False, repr=False)
class Verdict(Record):
    """Verdict on a plant."""

    trust: Trust
    """Level of trust."""

    reason: str
    """Reason, in one sentence without initial capital and full stop."""

    codes: tuple[CaveatCode, ...]
    """The caveats that determine it, the most severe first."""

    good_for: GoodFor | None
    """Motion that unseen trials confirm; absent where no trial was held out or used in cross-
    validation."""

    may_be_off: tuple[MayBeOff, ...]
    """Possible errors of numbers: all of a doubtful plant, else those above the limit of a
    usable one."""


@dataclass(frozen=True, eq=False, repr=False)
class WakeByDrift(Record):
    """Variation of the inflow at a propeller with drift angle."""

    rate: float
    """C₁, 1/rad."""

    greatest: Floats
    """C₂: inflow at large drift angles over that in straight motion, for flow from starboard
    and from port."""


@dataclass(frozen=True, eq=False, repr=False)
class WorseTrial(Record):
    """An axis of a trial that is predicted worse than by a model without a plant."""

    trial: str
    """Trial."""

    axis: Dof
    """Axis."""

    than: NullModel
    """The model without a plant that is as good or better."""

    null_error: float
    """Error of a model that never moves."""

    is_explained: bool
    """True if unlogged forces, or a current of the trial, explain it."""

    mean_abs_error: float | None
    """Mean |model − measured|; absent if the simulation diverges."""

    r_squared: float | None
    """R²; absent if nothing moved or the simulation diverges."""
