//! Conversion of fits and trials to results.

use std::collections::BTreeMap;

use super::IdentifyOptions;
use crate::diagnose::force_spectrum;
use crate::estimate::online::OnlineOptions;
use crate::estimate::steady::SteadyFit;
use crate::estimate::{
    EquationError, Fit, Loss, Method, Nuisances, OutputErrorIntervals, PhysicalEstimates,
    SteadyTest,
};
use crate::excursion::Excursion;
use crate::judge::box_pierce;
use crate::plant::{Basis, RigidBody, own_terms};
use crate::quantity::{Attitude, Axis, World};
use crate::regression::Intervals;
use crate::results::{
    AccumulatedPlant, Alone, AxisResult, BuoyancyResult, Coefficient, Correlation, CurveResult,
    MatrixResult, PairResult, Parameter, Parameters, PlantResult, PlantScore, Provenance,
    RegressionResult, Results, RigidBodyResult, SCHEMA, SegmentResult, SensorResult, SteadyResult,
    SteadyTestResult, TermDecision, ThrustPart, ThrusterResult, ToldBy, TrialResult,
};
use crate::{
    Caveat, Dof, Error, Estimate, LumpedParameters, Model, Motion, Quantity, Sensor, Term, Terms,
    ThrustCurve, ThrustUncertainty, Thruster, Trial, Vehicle, VelocitySource, lever_axes,
};

/// Prediction scores of a plant.
pub(super) struct Scores {
    pub(super) fit: PlantScore,
    pub(super) hold_out: Option<PlantScore>,
    pub(super) left_out: Option<PlantScore>,
}

pub(super) fn plant_result(
    fit: &Fit,
    body: Option<&RigidBody>,
    scores: Scores,
    caveats: Vec<Caveat>,
) -> PlantResult {
    let (dof, stability) = (fit.dof, fit.lumped.stability());
    let std = |j: usize| fit.covariance[(j, j)].sqrt();
    let (parameters, correlation) = coefficients(fit);
    let [(mass, _), (quadratic, _), (linear, _), _] = own_terms(dof);
    let matrix = |term: Basis| {
        let of = |x: fn(&Coefficient) -> f64| parameters.get(&term.to_string()).map_or(0.0, x);
        MatrixResult { value: vec![vec![of(|x| x.value)]], std: vec![vec![of(|x| x.std)]] }
    };
    let rigid = body.map(|body| body.mass_matrix()[(dof.index(), dof.index())]);
    let mass = matrix(mass);
    PlantResult {
        by_axis: Parameters::by_axis(&[dof], &parameters),
        rigid_body_mass_matrix: rigid.map(|rigid| vec![vec![rigid]]),
        added_mass: rigid.map(|rigid| vec![vec![mass.value[0][0] - rigid]]),
        linear_damping: matrix(linear),
        quadratic_damping: matrix(quadratic),
        mass_matrix: mass,
        parameters,
        correlation,
        nuisances: nuisances(fit),
        structure: fit.structure.iter().map(TermDecision::from).collect(),
        samples: fit.samples,
        alone: Some(Alone {
            terms: fit.terms.fitted(),
            stable: stability.is_stable(),
            stability,
            lumped: fit.lumped,
            lumped_std: LumpedParameters { alpha: std(0), beta: std(1), mu: std(2), bias: std(3) },
            steady_test: fit.steady_test.map(|test| steady_test(&test, dof)),
            thrust_part: thrust_part(fit),
            regression: regression(fit),
        }),
        innovations: fit.innovations.clone(),
        whiteness: box_pierce(&fit.innovations),
        history: fit.history.clone(),
        fit: scores.fit,
        hold_out: scores.hold_out,
        left_out: scores.left_out,
        caveats,
        ..PlantResult::empty(vec![dof], fit.method)
    }
}

/// Returns the coefficients of a fit of one axis by name, with their correlations.
fn coefficients(fit: &Fit) -> (BTreeMap<String, Coefficient>, Correlation) {
    let (dof, units) = (fit.dof, fit.dof.units());
    let PhysicalEstimates { mass, d_quadratic, d_linear, bias_force } = fit.estimates();
    let estimates = [Some(mass), d_quadratic, d_linear, bias_force];
    let units = [units.mass, units.quadratic_drag, units.linear_drag, units.force];
    let own = own_terms(dof);
    let fitted: Vec<(usize, Basis, Estimate)> = own
        .into_iter()
        .zip(estimates)
        .enumerate()
        .filter_map(|(k, ((term, sign), estimate))| Some((k, term, estimate?.times(sign))))
        .collect();
    let named = |(k, term, estimate): &(usize, Basis, Estimate)| {
        let Estimate { value, std, low95, high95 } = *estimate;
        // A constant force may well be zero.
        let is_open = *k < 3 && high95 - low95 > 2.0 * value.abs();
        let told_by = if is_open { ToldBy::Nothing } else { ToldBy::Data };
        let (unit, on) = (units[*k].to_owned(), vec![dof]);
        (term.to_string(), Coefficient { value, std, low95, high95, unit, on, told_by })
    };
    let all = fit.correlation();
    let row = |(i, ..): &(usize, Basis, Estimate)| {
        fitted.iter().map(|(j, ..)| own[*i].1 * own[*j].1 * all[(*i, *j)]).collect()
    };
    let correlation = Correlation {
        names: fitted.iter().map(|(_, term, _)| term.to_string()).collect(),
        value: fitted.iter().map(row).collect(),
    };
    (fitted.iter().map(named).collect(), correlation)
}

fn parameters(estimates: &PhysicalEstimates, dof: Dof) -> Parameters {
    let units = dof.units();
    Parameters {
        mass: Parameter::new(estimates.mass, units.mass),
        quadratic_drag: estimates.d_quadratic.map(|d| Parameter::new(d, units.quadratic_drag)),
        linear_drag: estimates.d_linear.map(|d| Parameter::new(d, units.linear_drag)),
        bias_force: estimates.bias_force.map(|b| Parameter::new(b, units.force)),
        added_mass: None,
    }
}

fn steady_test(test: &SteadyTest, dof: Dof) -> SteadyTestResult {
    let SteadyTest { likelihood_ratio, numbers, p_value, agrees, unsteady, steady } = test;
    SteadyTestResult {
        likelihood_ratio: *likelihood_ratio,
        numbers: *numbers,
        p_value: *p_value,
        agrees: *agrees,
        unsteady: parameters(unsteady, dof),
        steady: parameters(steady, dof),
    }
}

fn thrust_part(fit: &Fit) -> Option<ThrustPart> {
    let all = fit.lumped.physical_covariance(&fit.covariance);
    let of_thrust = fit.lumped.physical_covariance(&fit.thrust_covariance);
    let part = |term: Term| {
        let j = term as usize;
        of_thrust[(j, j)] / all[(j, j)]
    };
    let drag = fit.terms.has(Term::Quadratic).then(|| part(Term::Quadratic));
    (fit.thrust_covariance[(0, 0)] > 0.0)
        .then(|| ThrustPart { mass: part(Term::Force), quadratic_drag: drag })
}

fn regression(fit: &Fit) -> RegressionResult {
    RegressionResult {
        effective_samples: fit.effective_samples,
        condition: fit.condition,
        variance_inflation: fit.inflation.iter().copied().collect(),
        residual_rms: fit.residual_rms,
        filters: fit.filters,
    }
}

/// Converts a fit that was not scored because no trial was available as a whole.
pub(super) fn accumulated(fit: &Fit) -> AccumulatedPlant {
    AccumulatedPlant {
        dof: fit.dof,
        terms: fit.terms.fitted(),
        parameters: parameters(&fit.estimates(), fit.dof),
        lumped: fit.lumped,
        samples: fit.samples,
        regression: regression(fit),
        caveats: fit.caveats.clone(),
    }
}

/// Returns the nuisances by their names in `results.json`.
fn nuisances(fit: &Fit) -> BTreeMap<String, Parameter> {
    let Nuisances {
        lag_s,
        delay_s,
        reverse_ratio,
        inflow,
        lag_ratio,
        falling_lag_ratio,
        slew_s,
        inflow_ahead,
        exponent,
        dead_band,
        full_speed,
        voltage_exponent,
        mean_voltage_v,
        change_within,
        change_between,
        between: _,
        velocity_scale,
        sensor_lag_s,
        sensor_window_s,
        swell,
        thrust_jitter_s,
        current_drift,
        current,
        turning,
        lever_m,
        disturbance,
        correlation_s,
        velocity_noise,
        position_noise,
        acceleration_noise,
        leak,
        leak_correlation_s,
    } = &fit.nuisances;
    let units = fit.dof.units();
    let named = [
        ("lag", lag_s, "s"),
        ("delay", delay_s, "s"),
        ("reverse_ratio", reverse_ratio, "1"),
        ("inflow", inflow, "N/(n v)"),
        ("lag_ratio", lag_ratio, "1"),
        ("falling_lag_ratio", falling_lag_ratio, "1"),
        ("slew", slew_s, "s"),
        ("inflow_ahead", inflow_ahead, "N/(n v)"),
        ("thrust_exponent", exponent, "1"),
        ("dead_band", dead_band, "1"),
        ("voltage_exponent", voltage_exponent, "1"),
        ("thrust_change_within", change_within, "1"),
        ("thrust_change_between", change_between, "1"),
        ("velocity_scale", velocity_scale, "1"),
        ("sensor_lag", sensor_lag_s, "s"),
        ("sensor_window", sensor_window_s, "s"),
        ("thrust_jitter", thrust_jitter_s, "s"),
        ("current_drift", current_drift, units.velocity),
        ("turning", turning, "1"),
        ("disturbance", disturbance, units.acceleration),
        ("disturbance_correlation", correlation_s, "s"),
        ("velocity_noise", velocity_noise, units.velocity),
        ("position_noise", position_noise, units.position),
        ("acceleration_noise", acceleration_noise, units.acceleration),
        ("gravity_leak", leak, units.acceleration),
        ("gravity_leak_correlation", leak_correlation_s, "s"),
    ];
    let mut all: BTreeMap<String, Parameter> = named
        .into_iter()
        .filter_map(|(name, estimate, unit)| {
            Some((name.to_owned(), Parameter::new((*estimate)?, unit)))
        })
        .collect();
    if let Some(waves) = swell {
        all.insert("swell".to_owned(), Parameter::new(waves.strength, units.acceleration));
        all.insert("swell_period".to_owned(), Parameter::new(waves.period_s, "s"));
        all.insert("swell_damping".to_owned(), Parameter::new(waves.damping, "1"));
    }
    if [slew_s, exponent, dead_band].into_iter().any(Option::is_some) {
        let known = Estimate::new(*full_speed, 0.0, 1.0);
        all.insert("full_speed".to_owned(), Parameter::new(known, "rad/s"));
    }
    if voltage_exponent.is_some() {
        let known = Estimate::new(*mean_voltage_v, 0.0, 1.0);
        all.insert("mean_voltage".to_owned(), Parameter::new(known, "V"));
    }
    let axes = lever_axes(fit.dof).unwrap_or_default();
    for (axis, estimate) in axes.into_iter().zip(lever_m) {
        if let Some(estimate) = estimate {
            all.insert(format!("lever_{axis}"), Parameter::new(*estimate, "m"));
        }
    }
    for (trial, estimate) in current {
        all.insert(Model::current_name(trial), Parameter::new(*estimate, units.velocity));
    }
    all
}

pub(super) fn steady_result(fit: &SteadyFit) -> SteadyResult {
    let units = fit.dof.units();
    let greatest = fit.segments.iter().fold(0.0_f64, |greatest, s| greatest.max(s.tau.abs()));
    SteadyResult {
        segments: fit
            .segments
            .iter()
            .map(|s| SegmentResult {
                trial: s.trial.clone(),
                from_s: s.from_s,
                to_s: s.to_s,
                force: s.tau,
                force_part: s.tau / greatest,
                velocity: s.v,
                velocity_std: s.v_std,
                quadratic_drag: Parameter::new(s.d_quadratic, units.quadratic_drag),
                mean_abs_error: s.mean_abs_error,
                joint_error: s.joint_error,
            })
            .collect(),
        mean_quadratic_drag: fit.mean_d_quadratic,
        quadratic_drag: fit.joint.map(|j| Parameter::new(j.d_quadratic, units.quadratic_drag)),
        bias_force: fit.joint.map(|j| Parameter::new(j.bias_force, units.force)),
        pairs: fit
            .pairs
            .iter()
            .map(|pair| PairResult {
                positive: fit.segments[pair.positive].trial.clone(),
                negative: fit.segments[pair.negative].trial.clone(),
                bias_force: Parameter::new(pair.bias_force, units.force),
            })
            .collect(),
        caveats: fit.caveats.clone(),
    }
}

pub(super) fn empty_results(
    vehicle: &Vehicle,
    trials: &[Trial],
    options: &IdentifyOptions,
) -> Results {
    Results {
        schema: SCHEMA.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        vehicle: vehicle.name.clone(),
        dry_mass_kg: vehicle.dry_mass_kg,
        size_m: vehicle.size_m,
        rigid_body: vehicle.rigid_body.as_ref().map(RigidBodyResult::of),
        buoyancy: vehicle.buoyancy.as_ref().map(BuoyancyResult::of),
        provenance: Provenance {
            settings: settings(options),
            seed: drawn_seed(options),
            ..Default::default()
        },
        plants: BTreeMap::new(),
        steering: Vec::new(),
        methods: BTreeMap::new(),
        subsets: BTreeMap::new(),
        steady: BTreeMap::new(),
        thrusters: vehicle.thrusters.iter().map(thruster_result).collect(),
        bollard_pull: None,
        sensors: sensor_results(vehicle, trials),
        trials: trials.iter().map(|trial| trial_result(trial, vehicle)).collect(),
        truth: None,
        consequences: Vec::new(),
        plan: None,
        failures: Vec::new(),
        caveats: Vec::new(),
    }
}

/// Returns the seed of the bootstrap, if any.
fn drawn_seed(options: &IdentifyOptions) -> Option<u64> {
    let EquationError { intervals, bootstrap, .. } = options.equation_error;
    let draws = options.methods.contains(&Method::EquationError);
    (draws && intervals == Intervals::BlockBootstrap).then_some(bootstrap.seed)
}

fn settings(options: &IdentifyOptions) -> BTreeMap<String, String> {
    let methods: Vec<&str> = options.methods.iter().map(|method| method.name()).collect();
    let ee = options.equation_error;
    let steady = options.steady;
    let candidates: Vec<&str> =
        options.filter_error.candidates.iter().map(|candidate| candidate.name()).collect();
    let mut settings = BTreeMap::from([
        ("methods".to_owned(), methods.join(", ")),
        (
            "terms".to_owned(),
            options.terms.map_or_else(
                || format!("{}; linear drag if filter-error finds it", Terms::default()),
                |terms| terms.to_string(),
            ),
        ),
        (
            "output-error: loss".to_owned(),
            match options.output_error.loss {
                Loss::Squares => "squares".to_owned(),
                Loss::Huber(limit) => format!("Huber's, {limit} robust standard deviations"),
            },
        ),
        (
            "output-error: intervals".to_owned(),
            match options.output_error.intervals {
                OutputErrorIntervals::Sandwich => "sandwich".to_owned(),
                OutputErrorIntervals::Bootstrap { draws, seed } => {
                    format!("bootstrap, {draws} draws, seed {seed}")
                }
            },
        ),
        (
            "velocity".to_owned(),
            match options.velocity {
                None => {
                    "from position for the paper's method, as measured for the others".to_owned()
                }
                Some(VelocitySource::Measured) => "as measured".to_owned(),
                Some(VelocitySource::Position) => "from position".to_owned(),
            },
        ),
        ("filter-error: candidates".to_owned(), candidates.join(", ")),
        (
            "paper: velocity filter".to_owned(),
            format!(
                "{} Hz, order {}",
                options.paper.velocity_filter.cutoff_hz, options.paper.velocity_filter.order
            ),
        ),
        (
            "equation-error: filters".to_owned(),
            format!(
                "{} Hz, order {} on velocity; {} Hz, order {} on every term",
                ee.velocity_filter.cutoff_hz,
                ee.velocity_filter.order,
                ee.term_filter.cutoff_hz,
                ee.term_filter.order
            ),
        ),
        (
            "equation-error: intervals".to_owned(),
            match ee.intervals {
                Intervals::BatchMeans => "batch means".to_owned(),
                Intervals::BlockBootstrap => format!(
                    "{} resamples in blocks of {} s, seed {}",
                    ee.bootstrap.resamples, ee.bootstrap.block_s, ee.bootstrap.seed
                ),
            },
        ),
        (
            "steady".to_owned(),
            format!(
                "windows of {} s, drift below {} per s², thrust within {} %",
                steady.window_s,
                steady.slope,
                100.0 * steady.thrust_part
            ),
        ),
    ]);
    if options.methods.iter().any(|method| method.scheme().is_some()) {
        settings.insert("online".to_owned(), online(&options.online));
    }
    for (dof, terms) in &options.terms_of {
        settings.insert(format!("terms: {dof}"), terms.to_string());
    }
    settings
}

/// Describes the settings of methods that work sample by sample in a sentence.
fn online(options: &OnlineOptions) -> String {
    let memory = options.memory_s.map_or("unlimited".to_owned(), |s| format!("{s} s"));
    format!(
        "start {} s, observer rate {} 1/s, adaptation in {} s, cutoff {} Hz, memory {memory}, wander {} per minute, change threshold {}, longest step {} s",
        options.start_s,
        options.observer_rate,
        options.adaptation_s,
        options.cutoff_hz,
        options.wander_per_minute,
        options.change_threshold,
        options.longest_step_s
    )
}

fn thruster_result(thruster: &Thruster) -> ThrusterResult {
    let input = thruster.curve.input();
    let curve = match &thruster.curve {
        ThrustCurve::Quadratic { law, .. } => format!(
            "{} forward, {} reverse, N/({}){}, deadband {}{}",
            law.forward,
            law.reverse,
            input.unit(),
            if law.exponent == 2.0 { "²".to_owned() } else { format!("^{}", law.exponent) },
            law.deadband,
            law.voltage.map_or_else(String::new, |volts| format!(", at {volts} V"))
        ),
        ThrustCurve::Table { tables, .. } => {
            let points: usize = tables.iter().map(|table| table.points().count()).sum();
            let voltages: Vec<String> =
                tables.iter().filter_map(|table| table.voltage).map(|v| format!("{v} V")).collect();
            format!("table of {points} points {}", voltages.join(", "))
        }
    };
    ThrusterResult {
        name: thruster.name.clone(),
        position_m: thruster.position_body.into(),
        direction: thruster.direction_body.into(),
        input: input.name().to_owned(),
        curve: curve.trim_end().to_owned(),
        thrust_std: (thruster.uncertainty != ThrustUncertainty::default())
            .then_some([thruster.uncertainty.forward, thruster.uncertainty.reverse]),
        law: Some(CurveResult::of(&thruster.curve)),
    }
}

fn sensor_results(vehicle: &Vehicle, trials: &[Trial]) -> Vec<SensorResult> {
    let sensors = &vehicle.sensors;
    let all = [
        ("dvl", &sensors.dvl, Quantity::DvlVelocity(Axis::X), "m/s"),
        ("depth", &sensors.depth, Quantity::Depth, "m"),
        ("attitude", &sensors.attitude, Quantity::Attitude(Attitude::Heading), "rad"),
        ("position", &sensors.position, Quantity::Position(World::North), "m"),
        ("imu", &sensors.imu, Quantity::Acceleration(Axis::X), "m/s²"),
    ];
    let result = |(name, sensor, quantity, unit): (&str, &Sensor, Quantity, &str)| {
        let rate_hz = trials.iter().find_map(|trial| trial.rate_hz(&quantity));
        let used = rate_hz.is_some() || *sensor != Sensor::default();
        used.then(|| SensorResult {
            name: name.to_owned(),
            position_m: sensor.position_body.into(),
            rotation_deg: sensor.rotation_rad.map(f64::to_degrees),
            std: sensor.std,
            unit: unit.to_owned(),
            rate_hz,
        })
    };
    all.into_iter().filter_map(result).collect()
}

fn trial_result(trial: &Trial, vehicle: &Vehicle) -> TrialResult {
    let axis = |&dof: &Dof| Some((dof, axis_result(dof, trial, vehicle).ok()?));
    TrialResult {
        name: trial.name().to_owned(),
        role: trial.role(),
        files: Vec::new(),
        offsets: Vec::new(),
        axes: trial.dofs().iter().filter_map(axis).collect(),
    }
}

fn axis_result(dof: Dof, trial: &Trial, vehicle: &Vehicle) -> Result<AxisResult, Error> {
    let axis = trial.axis(dof, VelocitySource::Measured)?;
    let ready = axis.ready(0)?;
    let force = force_spectrum(&ready);
    let velocity = match axis.knows_velocity() {
        true => Some(axis.velocity()?),
        false => None,
    };
    let excursion = match velocity {
        Some(_) => Excursion::of(&axis, trial.role(), vehicle)?,
        None => None,
    };
    let motion = axis.motion.series();
    let max = |x: &[f64]| x.iter().fold(0.0_f64, |max, x| max.max(x.abs()));
    let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
    Ok(AxisResult {
        from_s: motion.first_s(),
        to_s: motion.last_s(),
        sample_hz: ready.sample_hz,
        source_hz: ready.source_hz,
        motion: match axis.motion {
            Motion::Velocity(_) => "velocity".to_owned(),
            Motion::Position(_) => "position".to_owned(),
            Motion::Acceleration(_) => "acceleration".to_owned(),
        },
        dominant_hz: force.dominant_hz(),
        dominant_amplitude: force.amplitude.iter().skip(1).copied().fold(0.0, f64::max),
        force_max: max(axis.force.values()),
        force_rms: rms(axis.force.values()),
        stroke: excursion.map(|excursion| excursion.stroke),
        keulegan_carpenter: excursion.and_then(|excursion| excursion.keulegan_carpenter),
        speed_max: velocity.as_ref().map(|velocity| max(velocity.values())),
        speed_rms: velocity.as_ref().map(|velocity| rms(velocity.values())),
        gap_s: ready.gaps.iter().map(|gap| gap.to_s - gap.from_s).sum(),
    })
}
