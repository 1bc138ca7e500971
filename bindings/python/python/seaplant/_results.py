"""The dataclasses of results; ``generate_results.py`` writes this."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from seaplant._record import Estimated, Floats, Record

__all__ = [
    "AccumulatedPlant",
    "Admission",
    "Assurance",
    "AxisChange",
    "AxisOutcome",
    "AxisResult",
    "AxisScore",
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
    "CoupledOnline",
    "CoupledPlant",
    "CoupledScore",
    "CurveResult",
    "CurveTable",
    "Decision",
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
    "PrimeCoefficient",
    "PrimeSystem",
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
    "ThrusterResult",
    "ToldBy",
    "TrialResult",
    "TrialScore",
    "TrueNuisances",
    "TrueParameters",
    "TruePlant",
    "TrueSteady",
    "TrueVehicle",
    "Trust",
    "Truth",
    "Validation",
    "Verdict",
    "WakeByDrift",
    "WholeMonteCarloTable",
    "WorseTrial",
]

Candidate: TypeAlias = Literal[
    "lag",
    "delay",
    "reverse-ratio",
    "current",
    "inflow",
    "lever-first",
    "lever-second",
    "linear-drag",
    "bias",
    "turning",
    "lag-ratio",
    "slew",
    "inflow-ahead",
    "exponent",
    "velocity-scale",
    "sensor-lag",
    "sensor-window",
    "swell",
    "current-drift",
    "linear-thrust",
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
    "more-than-noise",
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
"""What disturbs the vehicle or misleads its analyst."""

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
    "total-least-squares",
    "sriv",
    "adaptive",
    "recursive",
    "ekf",
]
"""How a plant was found."""

NoiseLevel: TypeAlias = Literal[
    "low",
    "middle",
    "high",
]
"""How noisy the instruments are."""

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
"""What a trial is for."""

RudderLaw: TypeAlias = Literal[
    "proportional",
    "sine",
]
"""How the force of a rudder across the ship grows with its angle."""

ScoredMotion: TypeAlias = Literal[
    "velocity",
    "acceleration",
]
"""What a simulation is compared with."""

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
"""Which axes a vehicle's shape lets M couple."""

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

ToldBy: TypeAlias = Literal[
    "data",
    "limit",
    "nothing",
    "stated",
]
"""Where a number comes from."""

Trust: TypeAlias = Literal[
    "do-not-use",
    "doubtful",
    "usable-with-care",
    "usable",
]
"""How far a plant may be trusted."""


@dataclass(frozen=True, eq=False, repr=False)
class AccumulatedPlant(Record):
    """The plant that equation error finds of a record in shards: not scored, for nobody has
    the record in one piece."""

    dof: Dof
    """Which degree of freedom."""

    terms: tuple[Term, ...]
    """The terms that were fitted."""

    parameters: Parameters
    """Physical parameters."""

    lumped: LumpedParameters
    """Lumped parameters."""

    regression: RegressionResult
    """How the fit went."""

    caveats: tuple[Caveat, ...]
    """Doubts."""


@dataclass(frozen=True, eq=False, repr=False)
class Admission(Record):
    """How often a part was taken into the model: a false alarm, or a detection."""

    dof: Dof
    """Which degree of freedom."""

    method: Method
    """Which method."""

    candidate: Candidate
    """Which part."""

    admitted_percent: float
    """Fits that have it, in %."""

    fits: int
    """Fits that decided."""


@dataclass(frozen=True, eq=False, repr=False)
class Assurance(Record):
    """How often recommended plants are presented as what they are not."""

    dof: Dof
    """Which degree of freedom."""

    plants: int
    """Recommended plants."""

    wrong: int
    """Those that are wrong."""

    wrong_but_usable: int
    """False assurance: those of the wrong ones that are called usable."""

    wrong_but_usable_with_care: int
    """Those of the wrong ones that are called usable with care."""

    good: int
    """Plants that are good."""

    good_but_doubted: int
    """False alarms: those of the good ones that are called doubtful, or not to be used."""


@dataclass(frozen=True, eq=False, repr=False)
class AxisChange(Record):
    """What trials that were not fitted would have of an axis: a step of their own likelihood
    from the plant, with the disturbances that were found, and a current of each trial's own,
    beside it."""

    mass: Part
    """The part by which they would have the mass greater; its interval is that of a
    difference."""

    drag: Part
    """The same of the drag at the usual speed."""

    whiteness: float
    """Whether what the filter fails to predict of them is white: Box and Pierce's statistic
    over 40 lags, divided by 40; 1 if it is."""

    surprise: float
    """Mean square of that in parts of what the filter expects of it: 1 if noise and
    disturbances are as in the fitted trials."""


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
    """Whether motion was measured as velocity, as position or as acceleration."""

    dominant_amplitude: float
    """Amplitude of force there, N or N m."""

    force_max: float
    """Greatest force, N or N m."""

    force_rms: float
    """Root mean square force, N or N m."""

    gap_s: float
    """Seconds left out for want of samples."""

    dominant_hz: float | None
    """Frequency at which force is greatest, Hz."""

    keulegan_carpenter: float | None
    """The stroke over the size of the hull across it, where that is known."""

    speed_max: float | None
    """Greatest speed, m/s or rad/s; absent where neither velocity nor position was
    measured."""

    speed_rms: float | None
    """Root mean square velocity, m/s or rad/s; absent likewise."""

    stroke: float | None
    """How far it oscillates, amplitude of velocity times period, m or rad; of a steady run,
    all its way."""


@dataclass(frozen=True, eq=False, repr=False)
class AxisScore(Record):
    """The error of a plant in one axis; what a simulation that runs away has none of is
    absent."""

    null_error: float
    """The same of a model that never moves."""

    samples: int
    """Samples compared."""

    change: AxisChange | None
    """What held-out trials would have of mass and drag."""

    disturbance_error: float | None
    """Mean change of the model's velocity by a draw of the disturbance that was found, m/s or
    rad/s: so far does that alone take the true plant from what is measured; with the noise of
    velocities that are slopes of positions."""

    kept_error: float | None
    """The same of a rate that stays as it is at each beginning."""

    mean_abs_error: float | None
    """Mean |model − measured| of velocity, m/s or rad/s."""

    r2: float | None
    """1 − Σ(model − measured)² / Σ(measured − mean)²."""

    restarted_error: float | None
    """Mean |model − measured| of roll and pitch where the model begins anew every 10 s from
    what is measured, rad/s: they swing about their rest, and who has lost their phase once is
    as far off as one that knows nothing of them."""


@dataclass(frozen=True, eq=False, repr=False)
class BollardPullResult(Record):
    """A thrust curve fitted to bollard-pull data."""

    file: str
    """The table's file."""

    input_unit: str
    """The input that was measured: rad/s or us."""

    neutral: float
    """The input that means stop."""

    residual_rms: float
    """Root mean square misfit, N."""

    r_squared: float
    """1 − Σ misfit² / Σ(thrust − mean)²."""

    points: Floats
    """The measured points, (input, N)."""

    caveats: tuple[Caveat, ...]
    """Doubts."""

    deadband: Parameter | None
    """Input that gives no thrust yet."""

    forward: Parameter | None
    """Coefficient of positive thrust."""

    reverse: Parameter | None
    """Coefficient of negative thrust."""


@dataclass(frozen=True, eq=False, repr=False)
class BuoyancyResult(Record):
    """What the water carries of a vehicle."""

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
    """What determines it."""


@dataclass(frozen=True, eq=False, repr=False)
class CoefficientRow(Record):
    """Errors and coverage of one coefficient over all seeds."""

    name: str
    """Its name."""

    unit: str
    """Its unit."""

    truth: float
    """As it is; zero of one that the vehicle does not have."""

    median_abs_error: float
    """Median of |error|, in its unit."""

    median_error: float
    """Median error, in its unit: what is left of it is bias."""

    coverage_percent: float
    """Part of the 95 % intervals that hold the truth, in %."""

    answers: int
    """Plants that have it."""


@dataclass(frozen=True, eq=False, repr=False)
class ConfirmedMotion(Record):
    """The motion of an axis in the trials that confirm a plant there: each range holds 95 %
    of it."""

    trials: tuple[str, ...]
    """The trials."""

    acceleration: Floats | None
    """Lowest and highest acceleration, m/s² or rad/s²."""

    speed: Floats | None
    """Lowest and highest speed, m/s or rad/s; absent where speed was not measured."""


@dataclass(frozen=True, eq=False, repr=False)
class Consequence(Record):
    """A number that follows from a plant's coefficients."""

    name: str
    """What it is, and under which force."""

    axis: Dof
    """Of which axis."""

    value: float
    """The number."""

    unit: str
    """Its unit."""

    interval95: Floats | None
    """Its 95 % interval; absent if the covariance is not known, or leaves it open."""


@dataclass(frozen=True, eq=False, repr=False)
class Correlation(Record):
    """Correlations."""

    names: tuple[str, ...]
    """Rows and columns."""

    value: Floats
    """Correlations, −1 to 1."""


@dataclass(frozen=True, eq=False, repr=False)
class CoupledOnline(Record):
    """A plant of several axes, found sample by sample."""

    axes: tuple[Dof, ...]
    """Its axes."""

    method: Method
    """How it was found."""

    symmetry: Symmetry
    """Which axes M may couple."""

    parameters: dict[str, Coefficient]
    """Its coefficients by name, as those of a coupled plant."""

    history: OnlineHistory
    """How they went there."""

    samples: int
    """Numbers measured."""

    fit: CoupledScore
    """Its error on the trials that it was fitted to."""

    caveats: tuple[Caveat, ...]
    """Doubts."""

    hold_out: CoupledScore | None
    """Its error on trials that it had not seen."""


@dataclass(frozen=True, eq=False, repr=False)
class CoupledPlant(Record):
    """A plant of several axes: ``M ν̇_r + C(M, ν_r) ν_r + D(ν_r) ν_r + … + g(η) = τ`` with
    ν_r relative to the water."""

    axes: tuple[Dof, ...]
    """Its axes, in SNAME order: rows and columns of every matrix."""

    method: Method
    """How it was found."""

    symmetry: Symmetry
    """Which axes M may couple."""

    parameters: dict[str, Coefficient]
    """Its coefficients by name: ``mass.surge``, ``mass.surge-pitch``, ``yaw: |v|r``,
    ``weight-minus-buoyancy``, ``lever.z``, and those of ``effects``."""

    mass_matrix: MatrixResult
    """M: rigid body plus added mass."""

    linear_damping: MatrixResult
    """What multiplies ν_r; zero where no term is."""

    quadratic_damping: MatrixResult
    """What multiplies |ν|ν of each axis; zero where no term is."""

    correlation: Correlation
    """Correlations of the coefficients."""

    nuisances: dict[str, Parameter]
    """Currents by trial; disturbance and noise by axis."""

    identifiability: Identifiability
    """How well the trials determine the coefficients."""

    samples: int
    """Numbers measured."""

    log_likelihood: float
    """ln-likelihood at the optimum."""

    fit: CoupledScore
    """Its error on the trials that it was fitted to, simulated freely from their start."""

    caveats: tuple[Caveat, ...]
    """Doubts."""

    added_mass: Floats | None
    """What the water adds, where the dry vehicle is known."""

    driven: dict[str, Driven]
    """How far each axis was driven in its trials."""

    effects: tuple[Effect, ...]
    """Forces of rudders, fins, propellers of unknown strength and wind."""

    hold_out: CoupledScore | None
    """Its error on trials that it had not seen."""

    nondimensional: PrimeSystem | None
    """Coefficients without dimension, where the vehicle's length is known."""

    rigid_body_mass_matrix: Floats | None
    """M of the dry vehicle, where that is known."""

    single_axes: dict[str, AxisScore]
    """The error, on the same trials, of each driven axis with a plant of its own: what
    coupling explains is what this has more."""

    structure: tuple[TermDecision, ...]
    """The terms that were tried beside the usual ones."""

    thruster_estimates: dict[str, ThrusterEstimate]
    """What each thruster gives over what its curve says, where most others give what theirs
    say; without those of which the trials do not determine it."""

    thruster_faults: tuple[ThrusterFault, ...]
    """Thrusters that stood still or pushed the other way in a trial; they were taken to do
    so."""

    thrusters_exchanged: tuple[tuple[str, ...], ...]
    """Pairs of thrusters of which each does what the log of the other says; they were taken
    to do so."""

    verdict: Verdict
    """What to make of it."""

    verdicts: dict[str, Verdict]
    """What to make of each of its axes: a plant is doubtful if one of them is."""


@dataclass(frozen=True, eq=False, repr=False)
class CoupledScore(Record):
    """The error of a plant on some trials, simulated freely."""

    by_axis: dict[str, AxisScore]
    """Over all trials."""

    trials: dict[str, dict[str, AxisScore]]
    """By trial."""


@dataclass(frozen=True, eq=False, repr=False)
class CurveResult(Record):
    """A thrust curve in numbers."""

    input: ThrusterInput
    """What it reads."""

    kind: str
    """One of quadratic, table."""

    deadband: float | None = None
    """Inputs this close to neutral give no thrust."""

    forward: float | None = None
    """c for s > 0, N per squared unit of input."""

    neutral: float | None = None
    """The input that means stop."""

    reverse: float | None = None
    """c for s < 0, N per squared unit of input."""

    tables: tuple[CurveTable, ...] | None = None
    """One for each supply voltage."""


@dataclass(frozen=True, eq=False, repr=False)
class CurveTable(Record):
    """Measured points at one supply voltage."""

    points: Floats
    """(input, N)."""

    voltage: float | None
    """Supply voltage, V."""


@dataclass(frozen=True, eq=False, repr=False)
class Decision(Record):
    """Why a candidate was taken into the model, or left out."""

    candidate: Candidate
    """Which."""

    likelihood_ratio: float
    """Twice the gain in log-likelihood, at least 0: fitted, or where a fit was not worth it,
    by the score test."""

    needed: float
    """What the extended Bayesian information criterion asks for: numbers added times ln n,
    and 2 ln P of P candidates that are tried."""

    admitted: bool
    """Whether it is part of the model."""

    hold_out_ratio: float | None
    """Twice the gain in a bounded log-likelihood on held-out trials, with everything held
    that was fitted but what each trial has by itself and the noise; absent without such
    trials, or if it was not asked for."""

    size: float | None
    """How much it does, for a term: linear drag as a part of quadratic drag at the usual
    speed, zero unless both brake; a bias force, at the end of its interval that is farther
    from zero, as a part of the usual thrust."""


@dataclass(frozen=True, eq=False, repr=False)
class Driven(Record):
    """How far an axis was driven in the trials that a plant was identified from."""

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
    """A force that one coefficient scales, by its name."""

    name: str
    """What results call its coefficient: ``rudder.lift``, ``wind.sway``."""

    force: EffectForce
    """What it does."""


@dataclass(frozen=True, eq=False, repr=False)
class EffectForce(Record):
    """What scales with one coefficient."""

    kind: str
    """One of lift, slipstream, race, steering, open-water, thrust, advance, inflow, gain,
    astern, wind, wind-across."""

    foil: Foil | None = None
    """The rudder."""

    propeller: str | None = None
    """The propeller."""

    squared: bool | None = None
    """Whether the drive is a speed or command n, so that T is n²."""

    behind: OpenWater | None = None
    """The propeller ahead of it."""

    flow: RudderFlow | None = None
    """What hull and race do to its flow."""

    curve: OpenWater | None = None
    """The propeller."""

    direction: Floats | None = None
    """The way of positive thrust, a unit vector."""

    position_m: Floats | None = None
    """Where it pushes, m."""

    ahead: bool | None = None
    """Whether only of those that push the way they move: none gains where it brakes."""

    thrusters: tuple[Pusher, ...] | None = None
    """The thrusters, at most 16."""

    reverse: bool | None = None
    """Whether only of thrust below zero."""

    thruster: Pusher | None = None
    """The thruster."""

    way: Floats | None = None
    """Force and moment by axis."""

    on: Dof | None = None
    """On which axis."""

    scale: float | None = None
    """``½ρ_a A L``; 1 if areas are not known."""


@dataclass(frozen=True, eq=False, repr=False)
class Failure(Record):
    """Something that could not be done."""

    dof: Dof
    """For which degree of freedom."""

    method: str
    """By which method: a method's name, or ``steady``."""

    message: str
    """Why, and what to do."""


@dataclass(frozen=True, eq=False, repr=False)
class FileOffset(Record):
    """A file whose clock was moved to those of its trial's other files."""

    file: str
    """Which, as the campaign names it."""

    clock: ClockOffset
    """By how much, and how that was found."""


@dataclass(frozen=True, eq=False, repr=False)
class Filters(Record):
    """The filters of a regression."""

    every_term: LowPass | None
    """On every term alike, after that."""

    velocity: LowPass | None
    """On velocity, before v|v| is formed and v differentiated."""


@dataclass(frozen=True, eq=False, repr=False)
class Foil(Record):
    """A control surface as its force reads it."""

    kind: Surface
    """What it is."""

    name: str
    """What channels call it."""

    position_m: Floats
    """Where its force acts, m, body frame."""

    axis: Floats
    """The axis that it turns about, a unit vector."""

    stall_rad: float | None
    """Its stall angle, rad: beyond it, lift grows no more."""


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

    value: float | None
    """The estimate; absent if the fit has no such number."""


@dataclass(frozen=True, eq=False, repr=False)
class GoodFor(Record):
    """The motion for which unseen trials confirm a plant: that of those which it predicts."""

    words: str
    """The same in words."""

    motion: dict[str, ConfirmedMotion]
    """The motion of each axis in the trials that confirm it."""

    not_as_in: tuple[WorseTrial, ...]
    """Trials that the plant predicts worse than a model without a plant: it is not good for
    their kind of motion."""

    drift_deg: Floats | None
    """Drift angles under way in the trials that confirm sway, deg; absent of plants without
    surge and sway."""


@dataclass(frozen=True, eq=False, repr=False)
class Identifiability(Record):
    """How well trials determine coefficients."""

    coefficients: int
    """How many coefficients there are."""

    rank: int
    """How many combinations of them the motion determines."""

    variance_inflation: dict[str, float]
    """What each coefficient's variance is multiplied with because others look like it."""

    not_told: tuple[str, ...]
    """Coefficients whose interval is wider than the number itself."""


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
    """Where, as the campaign names it."""

    bytes: int
    """Its size."""

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
class LowPass(Record):
    """A Butterworth low-pass filter."""

    cutoff_hz: float
    """Frequency at which a single pass halves power, Hz."""

    order: int
    """The order of a single pass, 1 to 8."""


@dataclass(frozen=True, eq=False, repr=False)
class LumpedParameters(Record):
    """``v̇ = α τ + β v|v| + μ v + bias``."""

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
    """The numbers."""

    std: Floats
    """Their standard deviations; zero where there is no term."""


@dataclass(frozen=True, eq=False, repr=False)
class MayBeOff(Record):
    """By how much a number may be off, and what says so."""

    number: str
    """Which number: "mass", or "surge: drag at 0.4 m/s" of a plant of several axes."""

    because: OffBecause
    """What says so."""

    limit: float
    """By so much a user takes the number of a usable plant to be off at most."""

    part: float | None
    """By which part of it: 0.3 where the truth may be 30 % more or less, 2 where it may be
    three times as much or a third; absent where it may be anything."""


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
    """Nomoto's model of how yaw rate follows a rudder: ``T ṙ + r + α r³ = K (δ − δ₀)``, or
    ``T₁T₂ r̈ + (T₁ + T₂) ṙ + r + α r³ = K (δ − δ₀ + T₃ δ̇)``; by ``rudder_law`` ``sine`` with
    ``½ sin 2δ`` in the place of δ."""

    rudder: str
    """The rudder."""

    order: int
    """First or second order."""

    rudder_law: RudderLaw
    """What stands for δ: the law that explains more."""

    gain: Parameter
    """K."""

    time: Parameter
    """T, or T₁ + T₂ − T₃."""

    neutral_angle: Parameter
    """δ₀: the angle that keeps the course."""

    is_stable: bool
    """Whether a straight course is kept."""

    fit_r2: float
    """R² of yaw rate on the trials that it was fitted to, simulated freely from their
    start."""

    hold_out_r2: dict[str, float | None]
    """The same on held-out trials, by trial, from the start of each that fits it best, as
    that of the fitted ones; none of one in which it runs away."""

    caveats: tuple[Caveat, ...]
    """Doubts."""

    cubic: Parameter | None
    """α, where r³ explains more."""

    second: SecondOrder | None
    """The times of the second order."""


@dataclass(frozen=True, eq=False, repr=False)
class NullScore(Record):
    """A model without a plant, and its error."""

    model: NullModel
    """Which."""

    mean_abs_error: float
    """e = mean |v_model − v|, m/s or rad/s."""


@dataclass(frozen=True, eq=False, repr=False)
class OffBecause(Record):
    """What says that a number may be off."""

    kind: str
    """One of interval, another-plant-fits, method."""

    method: Method | None = None
    """Which."""


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
    """How parameters went to where they ended."""

    time_s: Floats
    """Motion so far, s, over all fitted trials in turn."""

    parameters: dict[str, Floats]
    """Each parameter at these instants."""

    settled_s: dict[str, float | None]
    """When each came within 5 % of its last value to stay there, s of motion; absent if it
    had not before the last tenth."""

    excitation: float
    """The least eigenvalue of the information at a unit diagonal: 1 if each parameter is
    determined by itself, 0 if some combination is not at all."""

    changes: tuple[PlantChanged, ...]
    """When the plant seemed to change."""

    noticeable_change: float | None
    """By what part every mass would have had to change at once to be noticed within two
    minutes; absent where the motion is too short to tell."""


@dataclass(frozen=True, eq=False, repr=False)
class OpenWater(Record):
    """A propeller whose open-water curve is known."""

    propeller: str
    """What channels call it."""

    position_m: Floats
    """Where it is, m."""

    direction: Floats
    """The way of positive thrust, a unit vector."""

    diameter_m: float
    """Diameter D, m."""

    k_t: Floats
    """k₀, k₁, k₂."""

    wake: float
    """Wake fraction w, straight ahead."""

    density_kg_m3: float
    """Density of the water ρ, kg/m³."""

    wake_by_drift: WakeByDrift | None
    """How the wake changes with drift, if it does."""


@dataclass(frozen=True, eq=False, repr=False)
class PairResult(Record):
    """Two steady stretches at one thrust, one each way."""

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

    bias_force: Parameter | None
    """b."""

    linear_drag: Parameter | None
    """d_L."""

    quadratic_drag: Parameter | None
    """d_Q."""


@dataclass(frozen=True, eq=False, repr=False)
class Part(Record):
    """A part of something, and how sure that is."""

    value: float
    """The part."""

    std: float
    """Its standard deviation, from what batches of the trials say."""

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
    """The change of a plant that trials ask for, in parts of it: least squares on the errors
    of its simulation, linear in the change, beside an initial velocity, a constant force and
    a current of each trial's own."""

    mass: Part
    """Of the mass: 0.1 where a tenth more would fit better."""

    drag: Part
    """Of the drag at the speeds of the trials."""

    explained: float
    """The part of the errors, squared, that it explains in halves of the trials that it was
    not found in."""


@dataclass(frozen=True, eq=False, repr=False)
class PlantChanged(Record):
    """A change of the plant that was noticed."""

    trial: str
    """In which trial."""

    since_s: float
    """When it began, to blocks of 15 s, s of the log."""

    noticed_s: float
    """When it was noticed, s of the log."""

    statistic: float
    """The sum of what blocks exceed the usual by, in standard deviations."""


@dataclass(frozen=True, eq=False, repr=False)
class PlantResult(Record):
    """One method's plant of one degree of freedom."""

    method: Method
    """How it was found."""

    terms: tuple[Term, ...]
    """The terms that were fitted."""

    stable: bool
    """Whether the plant comes to rest by itself."""

    stability: Stability
    """In which way it does or does not."""

    parameters: Parameters
    """Physical parameters."""

    lumped: LumpedParameters
    """Lumped parameters."""

    lumped_std: LumpedParameters
    """Standard deviations of the lumped parameters."""

    correlation: Floats
    """Correlations of ``[m, d_Q, d_L, b]``."""

    nuisances: dict[str, Parameter]
    """Parameters of the thrusters and the water that were fitted beside the plant."""

    regression: RegressionResult
    """How the fit went."""

    fit: Score
    """Its error on the trials that it was fitted to."""

    caveats: tuple[Caveat, ...]
    """Doubts."""

    history: OnlineHistory | None
    """How the parameters went there; absent of methods that do not work sample by sample."""

    hold_out: Score | None
    """Its error on trials that it had not seen."""

    innovations: tuple[Innovations, ...]
    """How the errors of one-step predictions follow each other, by fitted trial; empty of
    methods that make none."""

    left_out: Score | None
    """Where no trial was held out: the error on fitted trials, or thirds of a single one,
    each predicted by a plant that was fitted to the others."""

    steady_test: SteadyTestResult | None
    """Whether steady runs agree with it; absent where there were none to fit."""

    structure: tuple[Decision, ...]
    """Why the model has the parts that it has."""

    thrust_part: ThrustPart | None
    """The part of the variances of mass and quadratic drag that uncertain thrust curves make;
    absent if no curve has an uncertainty."""

    verdict: Verdict
    """What to make of it."""

    whiteness: float | None
    """How white innovations are: Box–Pierce over 40 lags, divided by 40; 1 if they are.
    Absent of methods that make none."""


@dataclass(frozen=True, eq=False, repr=False)
class PrimeCoefficient(Record):
    """A coefficient without dimension."""

    symbol: str
    """How tables call it: ``Y'_vvr``, with the sign of a force on the vehicle; ``m22'`` is a
    mass."""

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
    """T, m: the draught, or L where no draught is stated."""

    density_kg_m3: float
    """ρ, kg/m³."""

    speed_m_s: float
    """U, m/s: the mean speed of the fitted trials. Coefficients of second degree do not
    depend on it."""

    coefficients: dict[str, PrimeCoefficient]
    """By the names of the coefficients."""


@dataclass(frozen=True, eq=False, repr=False)
class Provenance(Record):
    """What results were made from."""

    command: str
    """The command that repeats it."""

    inputs: tuple[InputFile, ...]
    """Every file that was read."""

    settings: dict[str, str]
    """The settings in force, defaults included."""

    seed: int | None
    """The seed of every random number; absent if none was drawn."""


@dataclass(frozen=True, eq=False, repr=False)
class Pusher(Record):
    """A thruster as inflow acts on it."""

    name: str
    """What channels call it."""

    position_m: Floats
    """Where it pushes, m."""

    direction: Floats
    """The way of positive thrust, a unit vector."""


@dataclass(frozen=True, eq=False, repr=False)
class RegressionResult(Record):
    """How a regression went."""

    samples: int
    """Rows."""

    effective_samples: float
    """Rows that would say as much if they were independent."""

    condition: float
    """Condition number of the columns at unit length."""

    variance_inflation: dict[str, float]
    """Variance inflation of each fitted term but the bias."""

    residual_rms: float
    """Root mean square of what was minimised: of equation errors, m/s² or rad/s², by SRIV m/s
    or rad/s; of output errors, in the unit of what was measured."""

    filters: Filters
    """The filters that were used."""


@dataclass(frozen=True, eq=False, repr=False)
class Results(Record):
    """Everything that an identification found."""

    schema: str
    """``SCHEMA``."""

    version: str
    """Version of Seaplant that wrote this."""

    vehicle: str
    """The vehicle's name."""

    provenance: Provenance
    """What it was made from, and how to make it again."""

    plants: dict[str, PlantResult]
    """The recommended plant of each degree of freedom."""

    methods: dict[str, dict[str, PlantResult]]
    """Every method's plant of each degree of freedom."""

    subsets: dict[str, tuple[SubsetResult, ...]]
    """The recommended method with every choice of terms."""

    steady: dict[str, SteadyResult]
    """Drag from steady stretches."""

    thrusters: tuple[ThrusterResult, ...]
    """The thrusters as they were used."""

    sensors: tuple[SensorResult, ...]
    """The instruments as they were used."""

    trials: tuple[TrialResult, ...]
    """The trials."""

    failures: tuple[Failure, ...]
    """What could not be done, and why."""

    caveats: tuple[Caveat, ...]
    """Doubts about the campaign as a whole."""

    bollard_pull: BollardPullResult | None
    """The thrust curve that bollard-pull data gives, where there are any."""

    buoyancy: BuoyancyResult | None
    """What the water carries of it."""

    consequences: tuple[Consequence, ...]
    """What follows from the recommended plants at the greatest force of the trials: top
    speeds, time constants, stopping distances, natural periods."""

    coupled: dict[str, CoupledPlant]
    """Plants of several axes, by their axes: ``surge-sway-yaw``."""

    coupled_online: dict[str, dict[str, CoupledOnline]]
    """The same by methods that work sample by sample."""

    coupled_truth: dict[str, float] | None
    """True coefficients of the plant of several axes, by name, where the logs are those of
    the twin of a whole vehicle."""

    dry_mass_kg: float | None
    """Its mass in air, kg."""

    plan: PlanOutcome | None
    """The plan of the dive compared with what was driven and found, if one was named."""

    rigid_body: RigidBodyResult | None
    """What is known of it dry."""

    size_m: Floats | None
    """Length, width and height of its hull, m."""

    steering: tuple[NomotoResult, ...]
    """Nomoto's models of steering, where a plant has yaw among its axes and a rudder is
    logged."""

    truth: dict[str, TruePlant] | None
    """True values, where the logs are a twin's."""


@dataclass(frozen=True, eq=False, repr=False)
class RigidBodyResult(Record):
    """A vehicle dry."""

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
    """Which degree of freedom."""

    method: Method
    """Which method."""

    parameter: ParameterName
    """Which parameter."""

    median_abs_error_percent: float
    """Median of |error|, in % of the truth."""

    median_error_percent: float
    """Median error, in % of the truth: what is left of it is bias."""

    coverage_percent: float
    """Part of the 95 % intervals that hold the truth, in %."""

    answers: int
    """Fits that gave an answer."""

    failures: int
    """Fits that gave none."""


@dataclass(frozen=True, eq=False, repr=False)
class RudderFlow(Record):
    """How hull and propeller change the flow at a rudder, and what the hull adds to its
    force."""

    wake_ratio: float
    """ε: the wake at the rudder over that at the propeller, ``(1 − w_R)/(1 − w_P)``."""

    race_factor: float
    """κ: how far the race has been sped up where the rudder is."""

    diameter_to_span: float
    """η: the propeller's diameter over the rudder's span."""

    straightening: Floats
    """γ_R: how much of the hull's sideways flow reaches the rudder, where that comes from
    starboard and where from port."""

    flow_at_m: float
    """l_R: at which x the sideways flow is that of the hull, m."""

    steering_deduction: float
    """t_R: the part of the rudder's drag that the hull takes back."""

    hull_increase: float
    """a_H: what the hull adds to the rudder's side force, as a part of it."""

    hull_at_m: float
    """x_H: where it adds that, m."""


@dataclass(frozen=True, eq=False, repr=False)
class Score(Record):
    """The error of a plant on some trials; what a diverging simulation has none of is
    absent."""

    null_error: float
    """e of a model that never moves, or of one that never accelerates."""

    trials: tuple[TrialScore, ...]
    """Each trial."""

    best_null: NullScore | None
    """The best model without a plant; absent if a simulation diverged."""

    change: PlantChange | None
    """The change of the plant that would make the errors least; absent where they do not
    determine it."""

    mean_abs_error: float | None
    """e = mean |v_model − v| on raw velocity."""

    offset_free_error: float | None
    """e with an initial velocity, a constant force and, in translations, a current fitted to
    each trial (of long ones, to each 150 s): what methods are compared by."""

    quantity: ScoredMotion
    """What was compared: where no velocity was measured, e and R² are of acceleration, in
    means over half a second without the accelerometer's offset."""

    r_squared: float | None
    """1 − Σ(v_model − v)² / Σ(v − mean v)², over all trials."""


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
    """Which trial."""

    from_s: float
    """Its start, s."""

    to_s: float
    """Its end, s."""

    force: float
    """Mean force, N or N m."""

    force_part: float
    """Force as a part of the greatest of all stretches."""

    velocity: float
    """Mean velocity, m/s or rad/s."""

    velocity_std: float
    """Standard deviation of that mean."""

    quadratic_drag: Parameter
    """d_Q = τ / v|v|."""

    mean_abs_error: float
    """e with the stretch's own drag."""

    joint_error: float | None
    """e with the joint drag and bias force."""


@dataclass(frozen=True, eq=False, repr=False)
class SensorResult(Record):
    """An instrument as it was used."""

    name: str
    """Which."""

    position_m: Floats
    """Where it sits, m."""

    rotation_deg: Floats
    """How it is turned, deg."""

    unit: str
    """Unit of that."""

    rate_hz: float | None
    """The rate at which it was logged, Hz, where it was."""

    std: float | None
    """Standard deviation of one sample."""


@dataclass(frozen=True, eq=False, repr=False)
class Stability(Record):
    """What becomes of a plant that is left alone."""

    kind: str
    """One of stable, stable-below, unstable-at-rest, unstable."""

    speed: float | None = None
    """That speed, m/s or rad/s."""


@dataclass(frozen=True, eq=False, repr=False)
class SteadyResult(Record):
    """What steady stretches say of one degree of freedom."""

    segments: tuple[SegmentResult, ...]
    """Every stretch by itself."""

    mean_quadratic_drag: float
    """The mean of the stretches' drags."""

    pairs: tuple[PairResult, ...]
    """Up and down at one thrust."""

    caveats: tuple[Caveat, ...]
    """Doubts."""

    bias_force: Parameter | None
    """Bias force of all together."""

    quadratic_drag: Parameter | None
    """d_Q of all together, beside a bias force."""


@dataclass(frozen=True, eq=False, repr=False)
class SteadyTestResult(Record):
    """Whether runs at constant thrust ask for the plant that other trials ask for."""

    likelihood_ratio: float
    """Twice what the log-likelihood gains if the two may differ."""

    numbers: int
    """How many numbers may then differ."""

    p_value: float
    """How often chance alone would make as large a gain."""

    agrees: bool
    """Whether they agree, and steady runs are part of the fit."""

    unsteady: Parameters
    """The plant of unsteady trials, if the two may differ."""

    steady: Parameters
    """The plant of steady runs, of the same mass."""


@dataclass(frozen=True, eq=False, repr=False)
class SubsetResult(Record):
    """The recommended method with one choice of terms."""

    terms: tuple[Term, ...]
    """The terms."""

    lumped: LumpedParameters
    """The parameters."""

    stable: bool
    """Whether the plant comes to rest by itself."""

    condition: float
    """Condition number of the scaled columns."""

    fit_error: float | None
    """e on the fitted trials."""

    hold_out_error: float | None
    """e on held-out trials."""


@dataclass(frozen=True, eq=False, repr=False)
class TermDecision(Record):
    """A term that was tried, and what came of it."""

    terms: tuple[str, ...]
    """The term, or terms that go together."""

    admitted: bool
    """Whether the plant has it."""

    likelihood_ratio: float
    """Twice what the log-likelihood gains by it."""

    p_value: float
    """How often chance alone would make as large a gain."""


@dataclass(frozen=True, eq=False, repr=False)
class ThrustPart(Record):
    """Parts of variances, 0 to 1."""

    mass: float
    """Of the mass."""

    quadratic_drag: float | None
    """Of quadratic drag; absent if it was not fitted."""


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
    """A thruster that gave another part of its thrust in a trial than its log says."""

    trial: str
    """Which trial."""

    thruster: str
    """Which thruster."""

    gain: float
    """The part: 0 of one that stood still, −1 of one that pushed the other way."""


@dataclass(frozen=True, eq=False, repr=False)
class ThrusterResult(Record):
    """A thruster as it was used."""

    name: str
    """Its name."""

    position_m: Floats
    """Where it pushes, m."""

    direction: Floats
    """Unit vector of positive thrust."""

    input: str
    """What its curve reads."""

    curve: str
    """Its curve in words."""

    law: CurveResult | None
    """Its curve in numbers; absent of results that were written without them."""

    thrust_std: Floats | None
    """Standard deviation of its strength ahead and in reverse, as parts of it; absent if
    nothing was said."""


@dataclass(frozen=True, eq=False, repr=False)
class TrialResult(Record):
    """A trial as it was used."""

    name: str
    """Its name."""

    role: Role
    """What it was for."""

    files: tuple[str, ...]
    """The files that it was read from."""

    axes: dict[str, AxisResult]
    """Each degree of freedom that it exercises."""

    offsets: tuple[FileOffset, ...]
    """The files whose clocks were moved by an estimated offset."""


@dataclass(frozen=True, eq=False, repr=False)
class TrialScore(Record):
    """The error of a plant on one trial."""

    trial: str
    """Which trial."""

    null_error: float
    """e of a model that never moves."""

    samples: int
    """Samples compared."""

    mean_abs_error: float | None
    """e = mean |v_model − v| on raw velocity; absent if the simulation diverged."""

    offset_free_error: float | None
    """e with an initial velocity, a constant force and, in translations, a current fitted to
    the trial; absent where velocity is not what is compared."""

    position_mean_abs_error: float | None
    """Mean |model − measured| of position, m or rad."""

    position_r_squared: float | None
    """R² of position, where position was measured."""

    r_squared: float | None
    """R² of velocity."""


@dataclass(frozen=True, eq=False, repr=False)
class TrueNuisances(Record):
    """True values of what an estimator may fit beside the plant; where it is off 0, of a
    ratio 1, of the exponent 2."""

    averaging_s: float
    """Time over which the DVL takes the mean, s."""

    current_m_s: float
    """Mean current, m/s, of which each trial's own deviates."""

    delay_s: float
    """Delay of the propellers, s."""

    drift_std_m_s: float
    """Standard deviation of the drifting current, m/s."""

    dvl_scale: float
    """What the DVL reads over what is true."""

    inflow: float
    """k_in of ``F = k n|n| − k_in |n| v``, N s²/(rad m)."""

    inflow_one_sided: float
    """k_in of a propeller that advances, where only such lose thrust, N s²/(rad m)."""

    lag_down_s: float
    """Time constant with which they slow down, s."""

    lag_s: float
    """Time constant of the propellers, s, where it is one both ways."""

    lag_up_s: float
    """Time constant with which propellers speed up, s."""

    lever_m: float
    """By how much the DVL sits ahead of, and below, where the analyst has it, m."""

    reverse_ratio: float
    """Thrust in reverse over what the analyst's curve gives."""

    sag_part: float
    """Part of thrust that is lost by the end of a degree of freedom's last trial."""

    slew_s: float
    """Time of a propeller from rest to its greatest speed, s."""

    swell_n: float
    """Amplitude of the swell, N."""

    swell_std_n: float
    """Standard deviation of the narrow-band swell, N."""

    tether_correlation_s: float
    """Correlation time of the tether's pull, s."""

    tether_n: float
    """Standard deviation of the tether's pull, N."""

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
class TruePlant(Record):
    """True values of a twin."""

    mass: float
    """kg or kg m²."""

    quadratic_drag: float
    """N/(m/s)² or N m/(rad/s)²."""

    linear_drag: float
    """N/(m/s) or N m/(rad/s)."""

    bias_force: float
    """N or N m."""


@dataclass(frozen=True, eq=False, repr=False)
class TrueSteady(Record):
    """The truth of steady runs."""

    quadratic_drag: float
    """d_Q, N/(m/s)²."""

    bias_force: float
    """b, N."""


@dataclass(frozen=True, eq=False, repr=False)
class TrueVehicle(Record):
    """What is true of a whole vehicle."""

    name: str
    """What its plant is called."""

    coefficients: dict[str, float]
    """Its coefficients, by the names that results have for them."""

    tether: dict[str, float]
    """Standard deviation of the tether's pull on each driven axis, N or N m."""

    mean_current_m_s: dict[str, Floats]
    """The mean current in each trial, north and east, m/s."""


@dataclass(frozen=True, eq=False, repr=False)
class Truth(Record):
    """The twin's true values, in the units of the results."""

    seed: int
    """The seed of every random number."""

    noise: NoiseLevel
    """How noisy the instruments were."""

    disturbances: tuple[Disturbance, ...]
    """What disturbed the vehicle or misled its analyst."""

    plants: dict[str, TrueParameters]
    """The plant of each degree of freedom."""

    steady: dict[str, TrueSteady]
    """The drag in steady runs, by degree of freedom."""

    nuisances: TrueNuisances
    """What the disturbances did to an analysis that knows them."""

    mean_current_m_s: dict[str, float]
    """The mean current in each trial, m/s: along the degree of freedom, in yaw to the
    north."""

    vehicle: TrueVehicle | None
    """The whole vehicle, where several of its axes move at once."""


@dataclass(frozen=True, eq=False, repr=False)
class Validation(Record):
    """A plant's score on some trials."""

    dof: Dof
    """The degree of freedom."""

    axes: tuple[Dof, ...]
    """The axes that are simulated together; only ``dof`` for a plant of one axis."""

    score: Score
    """Its errors."""

    fitted_to: tuple[str, ...]
    """Trials that the plant was fitted to: their scores are optimistic."""

    method: Method | None
    """The method of the plant; absent for a published table."""


@dataclass(frozen=True, eq=False, repr=False)
class Verdict(Record):
    """What to make of a plant."""

    trust: Trust
    """How far it may be trusted."""

    reason: str
    """Why, in one sentence without its first capital and full stop."""

    codes: tuple[CaveatCode, ...]
    """The caveats that decided it, the worst first."""

    good_for: GoodFor | None
    """The motion that unseen trials confirm; absent where no trial was held out or left out
    in turn."""

    may_be_off: tuple[MayBeOff, ...]
    """By how much numbers may be off: all of a doubtful plant, else those that are known less
    well than a user takes them for."""


@dataclass(frozen=True, eq=False, repr=False)
class WakeByDrift(Record):
    """How flow at a propeller changes with drift."""

    rate: float
    """C₁, 1/rad."""

    greatest: Floats
    """C₂: flow at great drift over that straight ahead, where it comes from starboard and
    where from port."""


@dataclass(frozen=True, eq=False, repr=False)
class WholeMonteCarloTable(Record):
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
class WorseTrial(Record):
    """An axis of a trial that is predicted worse than by a model without a plant."""

    trial: str
    """Which trial."""

    axis: Dof
    """Which axis."""

    than: NullModel
    """The model that does as well or better, and its error where that is known."""

    null_error: float
    """The error of a model that never moves."""

    is_explained: bool
    """Whether forces that are not logged, or a current of the trial's own, explain it."""

    mean_abs_error: float | None
    """Mean |model − measured|; absent if the simulation diverges."""

    r_squared: float | None
    """R²; absent if nothing moved or the simulation diverges."""
