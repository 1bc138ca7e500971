//! What an identification found, as data: the contract of `results.json`.
//!
//! Every number that a report shows stands here, or in the series beside it.

mod coupled;
mod online;
mod steering;
mod vehicle;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::estimate::{Decision, Filters, Innovations};
use crate::exchange::Consequence;
pub use crate::judge::{NullModel, NullScore, Part, PlantChange, Trust, Verdict};
use crate::signal::Spectrum;
use crate::terms::Term;
use crate::{
    Caveat, ClockOffset, Comparison, Dof, Error, Estimate, LumpedParameters, Method, Model, Role,
    ScoredMotion, Stability,
};

pub use online::{CoupledOnline, OnlineHistory, PlantChanged};
pub use steering::{NomotoResult, SecondOrder};
pub use vehicle::{BuoyancyResult, CurveResult, CurveTable, RigidBodyResult};

pub use coupled::{
    AxisScore, Coefficient, Correlation, CoupledPlant, CoupledScore, Identifiability, MatrixResult,
    PrimeCoefficient, PrimeSystem, TermDecision, ToldBy,
};

/// The name and version of this contract.
pub const SCHEMA: &str = "seaplant/results/1";

/// Everything that an identification found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Results {
    /// [`SCHEMA`].
    pub schema: String,
    /// Version of Seaplant that wrote this.
    pub version: String,
    /// The vehicle's name.
    pub vehicle: String,
    /// Its mass in air, kg.
    pub dry_mass_kg: Option<f64>,
    /// Length, width and height of its hull, m.
    #[serde(default)]
    pub size_m: Option<[f64; 3]>,
    /// What is known of it dry.
    #[serde(default)]
    pub rigid_body: Option<RigidBodyResult>,
    /// What the water carries of it.
    #[serde(default)]
    pub buoyancy: Option<BuoyancyResult>,
    /// What it was made from, and how to make it again.
    pub provenance: Provenance,
    /// The recommended plant of each degree of freedom.
    pub plants: BTreeMap<Dof, PlantResult>,
    /// Plants of several axes, by their axes: `surge-sway-yaw`.
    #[serde(default)]
    pub coupled: BTreeMap<String, CoupledPlant>,
    /// Nomoto's models of steering, where a plant has yaw among its axes and a rudder is logged.
    #[serde(default)]
    pub steering: Vec<NomotoResult>,
    /// The same by methods that work sample by sample.
    #[serde(default)]
    pub coupled_online: BTreeMap<String, BTreeMap<Method, CoupledOnline>>,
    /// Every method's plant of each degree of freedom.
    pub methods: BTreeMap<Dof, BTreeMap<Method, PlantResult>>,
    /// The recommended method with every choice of terms.
    pub subsets: BTreeMap<Dof, Vec<SubsetResult>>,
    /// Drag from steady stretches.
    pub steady: BTreeMap<Dof, SteadyResult>,
    /// The thrusters as they were used.
    pub thrusters: Vec<ThrusterResult>,
    /// The thrust curve that bollard-pull data gives, where there are any.
    pub bollard_pull: Option<BollardPullResult>,
    /// The instruments as they were used.
    pub sensors: Vec<SensorResult>,
    /// The trials.
    pub trials: Vec<TrialResult>,
    /// True values, where the logs are a twin's.
    pub truth: Option<BTreeMap<Dof, TruePlant>>,
    /// True coefficients of the plant of several axes, by name, where the logs are those of the
    /// twin of a whole vehicle.
    #[serde(default)]
    pub coupled_truth: Option<BTreeMap<String, f64>>,
    /// What follows from the recommended plants at the greatest force of the trials: top speeds,
    /// time constants, stopping distances, natural periods.
    #[serde(default)]
    pub consequences: Vec<Consequence>,
    /// What could not be done, and why.
    pub failures: Vec<Failure>,
    /// Doubts about the campaign as a whole.
    pub caveats: Vec<Caveat>,
}

impl Results {
    /// Whether anything was found.
    ///
    /// # Errors
    /// [`Error::NothingFound`], with every method's reason, if there is neither a plant nor
    /// steady drag.
    pub fn check(&self) -> Result<(), Error> {
        let has_plant = !(self.plants.is_empty() && self.coupled.is_empty());
        if has_plant || !self.steady.is_empty() || !self.steering.is_empty() {
            return Ok(());
        }
        let reason = |f: &Failure| format!("\n  {} by {}: {}", f.dof, f.method, f.message);
        let mut reasons: String = self.failures.iter().map(reason).collect();
        if reasons.is_empty() {
            reasons = "\n  no trial has role = \"fit\" or \"steady\"".to_owned();
        }
        Err(Error::NothingFound { reasons })
    }

    /// The plant of a degree of freedom: that of a method, or the recommended one.
    ///
    /// # Errors
    /// [`Error::NoPlant`].
    pub fn plant_of(&self, dof: Dof, method: Option<Method>) -> Result<&PlantResult, Error> {
        let refuse = |found: String| Error::NoPlant { found };
        let recommended = self.plants.get(&dof).ok_or_else(|| {
            let all: Vec<&str> = self.plants.keys().map(|dof| dof.name()).collect();
            let all = if all.is_empty() { "none at all".to_owned() } else { all.join(", ") };
            refuse(format!("no {dof} plant, but {all}"))
        })?;
        let Some(method) = method else { return Ok(recommended) };
        let of_dof = self.methods.get(&dof).and_then(|methods| methods.get(&method));
        of_dof.ok_or_else(|| refuse(format!("no {dof} plant by {method}")))
    }
}

/// What results were made from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Provenance {
    /// The command that repeats it.
    pub command: String,
    /// Every file that was read.
    pub inputs: Vec<InputFile>,
    /// The seed of every random number; absent if none was drawn.
    pub seed: Option<u64>,
    /// The settings in force, defaults included.
    pub settings: BTreeMap<String, String>,
}

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InputFile {
    /// Where, as the campaign names it.
    pub path: String,
    /// Its size.
    pub bytes: u64,
    /// SHA-256 of its content, hexadecimal.
    pub sha256: String,
}

/// A parameter with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Parameter {
    /// The estimate.
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Lower end of its 95 % interval.
    pub low95: f64,
    /// Upper end of its 95 % interval.
    pub high95: f64,
    /// Its unit.
    pub unit: String,
}

impl Parameter {
    /// An estimate with its unit.
    pub fn new(estimate: Estimate, unit: &str) -> Self {
        let Estimate { value, std, low95, high95 } = estimate;
        Self { value, std, low95, high95, unit: unit.to_owned() }
    }
}

/// The parameters of `τ = m v̇ + d_Q v|v| + d_L v + b`; absent if not fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Parameters {
    /// Rigid-body plus added mass.
    pub mass: Parameter,
    /// d_Q.
    pub quadratic_drag: Option<Parameter>,
    /// d_L.
    pub linear_drag: Option<Parameter>,
    /// b.
    pub bias_force: Option<Parameter>,
}

/// One method's plant of one degree of freedom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlantResult {
    /// How it was found.
    pub method: Method,
    /// The terms that were fitted.
    pub terms: Vec<Term>,
    /// Whether the plant comes to rest by itself.
    pub stable: bool,
    /// In which way it does or does not.
    pub stability: Stability,
    /// Physical parameters.
    pub parameters: Parameters,
    /// Lumped parameters.
    pub lumped: LumpedParameters,
    /// Standard deviations of the lumped parameters.
    pub lumped_std: LumpedParameters,
    /// Correlations of `[m, d_Q, d_L, b]`.
    pub correlation: [[f64; 4]; 4],
    /// Parameters of the thrusters and the water that were fitted beside the plant.
    pub nuisances: BTreeMap<String, Parameter>,
    /// Why the model has the parts that it has.
    #[serde(default)]
    pub structure: Vec<Decision>,
    /// Whether steady runs agree with it; absent where there were none to fit.
    #[serde(default)]
    pub steady_test: Option<SteadyTestResult>,
    /// The part of the variances of mass and quadratic drag that uncertain thrust curves
    /// make; absent if no curve has an uncertainty.
    #[serde(default)]
    pub thrust_part: Option<ThrustPart>,
    /// How the errors of one-step predictions follow each other, by fitted trial; empty of methods
    /// that make none.
    #[serde(default)]
    pub innovations: Vec<Innovations>,
    /// How the parameters went there; absent of methods that do not work sample by sample.
    #[serde(default)]
    pub history: Option<OnlineHistory>,
    /// How the fit went.
    pub regression: RegressionResult,
    /// Its error on the trials that it was fitted to.
    pub fit: Score,
    /// Its error on trials that it had not seen.
    pub hold_out: Option<Score>,
    /// Where no trial was held out: the error on fitted trials, or thirds of a single one, each
    /// predicted by a plant that was fitted to the others.
    #[serde(default)]
    pub left_out: Option<Score>,
    /// How white innovations are: Box–Pierce over 40 lags, divided by 40; 1 if they are. Absent
    /// of methods that make none.
    #[serde(default)]
    pub whiteness: Option<f64>,
    /// Doubts.
    pub caveats: Vec<Caveat>,
    /// What to make of it.
    #[serde(default)]
    pub verdict: Verdict,
}

/// The plant that equation error finds of a record in shards: not scored, for nobody has the
/// record in one piece.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AccumulatedPlant {
    /// Which degree of freedom.
    pub dof: Dof,
    /// The terms that were fitted.
    pub terms: Vec<Term>,
    /// Physical parameters.
    pub parameters: Parameters,
    /// Lumped parameters.
    pub lumped: LumpedParameters,
    /// How the fit went.
    pub regression: RegressionResult,
    /// Doubts.
    pub caveats: Vec<Caveat>,
}

/// Whether runs at constant thrust ask for the plant that other trials ask for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SteadyTestResult {
    /// Twice what the log-likelihood gains if the two may differ.
    pub likelihood_ratio: f64,
    /// How many numbers may then differ.
    pub numbers: usize,
    /// How often chance alone would make as large a gain.
    pub p_value: f64,
    /// Whether they agree, and steady runs are part of the fit.
    pub agrees: bool,
    /// The plant of unsteady trials, if the two may differ.
    pub unsteady: Parameters,
    /// The plant of steady runs, of the same mass.
    pub steady: Parameters,
}

/// Parts of variances, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThrustPart {
    /// Of the mass.
    pub mass: f64,
    /// Of quadratic drag; absent if it was not fitted.
    pub quadratic_drag: Option<f64>,
}

/// How a regression went.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RegressionResult {
    /// Rows.
    pub samples: usize,
    /// Rows that would say as much if they were independent.
    pub effective_samples: f64,
    /// Condition number of the columns at unit length.
    pub condition: f64,
    /// Variance inflation of each fitted term but the bias.
    pub variance_inflation: BTreeMap<Term, f64>,
    /// Root mean square of what was minimised: of equation errors, m/s² or rad/s², by SRIV
    /// m/s or rad/s; of output errors, in the unit of what was measured.
    pub residual_rms: f64,
    /// The filters that were used.
    pub filters: Filters,
}

/// The error of a plant on some trials; what a diverging simulation has none of is absent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Score {
    /// What was compared: where no velocity was measured, e and R² are of acceleration, in means
    /// over half a second without the accelerometer's offset.
    #[serde(default)]
    pub quantity: ScoredMotion,
    /// e = mean |v_model − v| on raw velocity.
    pub mean_abs_error: Option<f64>,
    /// e of a model that never moves, or of one that never accelerates.
    pub null_error: f64,
    /// The best model without a plant; absent if a simulation diverged.
    #[serde(default)]
    pub best_null: Option<NullScore>,
    /// e with an initial velocity, a constant force and, in translations, a current fitted to each
    /// trial (of long ones, to each 150 s): what methods are compared by.
    #[serde(default)]
    pub offset_free_error: Option<f64>,
    /// The change of the plant that the errors ask for; absent where they do not tell.
    #[serde(default)]
    pub change: Option<PlantChange>,
    /// 1 − Σ(v_model − v)² / Σ(v − mean v)², over all trials.
    pub r_squared: Option<f64>,
    /// Each trial.
    pub trials: Vec<TrialScore>,
}

/// The error of a plant on one trial.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialScore {
    /// Which trial.
    pub trial: String,
    /// e = mean |v_model − v| on raw velocity; absent if the simulation diverged.
    pub mean_abs_error: Option<f64>,
    /// e of a model that never moves.
    pub null_error: f64,
    /// R² of velocity.
    pub r_squared: Option<f64>,
    /// R² of position, where position was measured.
    pub position_r_squared: Option<f64>,
    /// Mean |model − measured| of position, m or rad.
    pub position_mean_abs_error: Option<f64>,
    /// Samples compared.
    pub samples: usize,
}

/// The recommended method with one choice of terms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SubsetResult {
    /// The terms.
    pub terms: Vec<Term>,
    /// The parameters.
    pub lumped: LumpedParameters,
    /// Whether the plant comes to rest by itself.
    pub stable: bool,
    /// e on the fitted trials.
    pub fit_error: Option<f64>,
    /// e on held-out trials.
    pub hold_out_error: Option<f64>,
    /// Condition number of the scaled columns.
    pub condition: f64,
}

/// What steady stretches say of one degree of freedom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SteadyResult {
    /// Every stretch by itself.
    pub segments: Vec<SegmentResult>,
    /// The mean of the stretches' drags.
    pub mean_quadratic_drag: f64,
    /// d_Q of all together, beside a bias force.
    pub quadratic_drag: Option<Parameter>,
    /// Bias force of all together.
    pub bias_force: Option<Parameter>,
    /// Up and down at one thrust.
    pub pairs: Vec<PairResult>,
    /// Doubts.
    pub caveats: Vec<Caveat>,
}

/// One steady stretch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SegmentResult {
    /// Which trial.
    pub trial: String,
    /// Its start, s.
    pub from_s: f64,
    /// Its end, s.
    pub to_s: f64,
    /// Mean force, N or N m.
    pub force: f64,
    /// Force as a part of the greatest of all stretches.
    pub force_part: f64,
    /// Mean velocity, m/s or rad/s.
    pub velocity: f64,
    /// Standard deviation of that mean.
    pub velocity_std: f64,
    /// d_Q = τ / v|v|.
    pub quadratic_drag: Parameter,
    /// e with the stretch's own drag.
    pub mean_abs_error: f64,
    /// e with the joint drag and bias force.
    pub joint_error: Option<f64>,
}

/// Two steady stretches at one thrust, one each way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PairResult {
    /// The stretch with positive force.
    pub positive: String,
    /// The stretch with negative force.
    pub negative: String,
    /// The bias force that explains their difference.
    pub bias_force: Parameter,
}

/// A thruster as it was used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThrusterResult {
    /// Its name.
    pub name: String,
    /// Where it pushes, m.
    pub position_m: [f64; 3],
    /// Unit vector of positive thrust.
    pub direction: [f64; 3],
    /// What its curve reads.
    pub input: String,
    /// Its curve in words.
    pub curve: String,
    /// Standard deviation of its strength ahead and in reverse, as parts of it; absent if
    /// nothing was said.
    #[serde(default)]
    pub thrust_std: Option<[f64; 2]>,
    /// Its curve in numbers; absent of results that were written without them.
    #[serde(default)]
    pub law: Option<CurveResult>,
}

/// A thrust curve fitted to bollard-pull data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BollardPullResult {
    /// The table's file.
    pub file: String,
    /// The input that was measured: rad/s or us.
    pub input_unit: String,
    /// The input that means stop.
    pub neutral: f64,
    /// Coefficient of positive thrust.
    pub forward: Option<Parameter>,
    /// Coefficient of negative thrust.
    pub reverse: Option<Parameter>,
    /// Input that gives no thrust yet.
    pub deadband: Option<Parameter>,
    /// Root mean square misfit, N.
    pub residual_rms: f64,
    /// 1 − Σ misfit² / Σ(thrust − mean)².
    pub r_squared: f64,
    /// The measured points, (input, N).
    pub points: Vec<(f64, f64)>,
    /// Doubts.
    pub caveats: Vec<Caveat>,
}

/// An instrument as it was used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SensorResult {
    /// Which.
    pub name: String,
    /// Where it sits, m.
    pub position_m: [f64; 3],
    /// How it is turned, deg.
    pub rotation_deg: [f64; 3],
    /// Standard deviation of one sample.
    pub std: Option<f64>,
    /// Unit of that.
    pub unit: String,
    /// The rate at which it was logged, Hz, where it was.
    pub rate_hz: Option<f64>,
}

/// A trial as it was used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialResult {
    /// Its name.
    pub name: String,
    /// What it was for.
    pub role: Role,
    /// The files that it was read from.
    pub files: Vec<String>,
    /// The files whose clocks were moved by what the data tell.
    #[serde(default)]
    pub offsets: Vec<FileOffset>,
    /// Each degree of freedom that it exercises.
    pub axes: BTreeMap<Dof, AxisResult>,
}

/// A file whose clock was moved to those of its trial's other files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FileOffset {
    /// Which, as the campaign names it.
    pub file: String,
    /// By how much, and how that was found.
    pub clock: ClockOffset,
}

/// One degree of freedom of a trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AxisResult {
    /// Its start, s.
    pub from_s: f64,
    /// Its end, s.
    pub to_s: f64,
    /// Rate of the regression's grid, Hz.
    pub sample_hz: f64,
    /// Rate at which motion was measured, Hz.
    pub source_hz: f64,
    /// Whether motion was measured as velocity, as position or as acceleration.
    pub motion: String,
    /// Frequency at which force is greatest, Hz.
    pub dominant_hz: Option<f64>,
    /// Amplitude of force there, N or N m.
    pub dominant_amplitude: f64,
    /// Greatest force, N or N m.
    pub force_max: f64,
    /// Root mean square force, N or N m.
    pub force_rms: f64,
    /// Greatest speed, m/s or rad/s; absent where neither velocity nor position was measured.
    pub speed_max: Option<f64>,
    /// Root mean square velocity, m/s or rad/s; absent likewise.
    pub speed_rms: Option<f64>,
    /// How far it goes to and fro, amplitude of velocity times period, m or rad; of a steady
    /// run, all its way.
    #[serde(default)]
    pub stroke: Option<f64>,
    /// The stroke over the size of the hull across it, where that is known.
    #[serde(default)]
    pub keulegan_carpenter: Option<f64>,
    /// Seconds left out for want of samples.
    pub gap_s: f64,
}

/// True values of a twin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TruePlant {
    /// kg or kg m².
    pub mass: f64,
    /// N/(m/s)² or N m/(rad/s)².
    pub quadratic_drag: f64,
    /// N/(m/s) or N m/(rad/s).
    pub linear_drag: f64,
    /// N or N m.
    pub bias_force: f64,
}

/// Something that could not be done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Failure {
    /// For which degree of freedom.
    pub dof: Dof,
    /// By which method: a method's name, or `steady`.
    pub method: String,
    /// Why, and what to do.
    pub message: String,
}

/// The series behind a figure; too long for `results.json`.
#[derive(Clone, Debug, PartialEq)]
pub enum Series {
    /// Simulated and measured motion, by method and trial.
    Comparison(ComparisonFigure),
    /// Spectra of force and velocity of a fitted trial.
    Spectrum(SpectrumFigure),
    /// Motion of a steady trial.
    Steady(SteadyFigure),
}

/// Simulated and measured motion of one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparisonFigure {
    /// Whose plant.
    pub method: Method,
    /// Whether the plant was fitted to the trial.
    pub role: Role,
    /// The motion.
    pub comparison: Comparison,
}

/// Spectra of one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct SpectrumFigure {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Which trial.
    pub trial: String,
    /// Amplitude of force, N or N m.
    pub force: Spectrum,
    /// Amplitude of velocity, m/s or rad/s.
    pub velocity: Spectrum,
}

/// Motion of one steady trial.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyFigure {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Which trial.
    pub trial: String,
    /// Instants of velocity and force, s.
    pub time_s: Vec<f64>,
    /// Velocity, m/s or rad/s.
    pub velocity: Vec<f64>,
    /// Force, N or N m.
    pub force: Vec<f64>,
    /// Instants of position, s; empty if position was not measured.
    pub position_time_s: Vec<f64>,
    /// Position (depth, heading), m or rad.
    pub position: Vec<f64>,
}

/// A plant ready to be driven, and whose it is.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedModel {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Whose.
    pub method: Method,
    /// The plant.
    pub model: Model,
}

/// What was found; [`Identification::series`] gives the series behind its figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Identification {
    /// The numbers.
    pub results: Results,
    /// Every method's plants, in the order in which they were fitted.
    pub models: Vec<FittedModel>,
}
