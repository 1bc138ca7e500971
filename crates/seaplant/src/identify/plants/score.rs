//! How far a plant's free motion is from what was measured.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{DVector, Vector6};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{LEVERS, MISALIGNMENTS};
use crate::estimate::{Actuator, PlantFit};
use crate::exchange::{Actuation, GRID_S, PlantModel, after};
use crate::judge::{Expected, Nulls, Outcome, scores};
use crate::motion::{Inputs, Simulated, body_from_world, interpolated_attitude, simulate};
use crate::plant::{Plant, own_terms};
use crate::random::{gauss_markov, normal, stochastic_cycle};
use crate::results::{Parameter, PlantResult, PlantScore, plant_of_result};
use crate::series::union;
use crate::signal::sample_noise;
use crate::statistics::root;
use crate::{
    Agreement, Comparison, Dof, Error, LumpedParameters, Method, Model, PhysicalParameters,
    ScoredMotion, SteeringGear, ThrustCurve, ThrusterTrack, Timed, Trial, TrialRecord, Vehicle,
    VelocityReport, parallel,
};

/// The error of a plant of several axes on trials, each simulated freely from its start.
///
/// Water is taken to move as in the trials that the plant was fitted to, in their mean.
///
/// # Errors
/// That of the first trial, if none was read for the plant's axes; as [`plant_of_result`].
pub fn score_fitted_plant(result: &PlantResult, trials: &[&Trial]) -> Result<PlantScore, Error> {
    let plant = plant_of_result(result)?;
    let exchanged = |record: &TrialRecord| record.with_all_exchanged(&result.thrusters_exchanged);
    let read: Vec<_> =
        trials.iter().map(|trial| trial.record(&result.axes).and_then(exchanged)).collect();
    let records: Vec<&TrialRecord> = read.iter().filter_map(|x| x.as_ref().ok()).collect();
    if let (true, Some(Err(error))) = (records.is_empty(), read.first()) {
        return Err(error.clone());
    }
    let current = mean_current(result);
    score(&plant, &Standing::of_result(result), (&[], &records), |_| current)
}

/// The error of a table of several axes on trials, each simulated freely from its start in water
/// that stands still.
///
/// Thrust acts behind the lag, delay and reverse ratio that the table states for its first axis, and
/// is that of the table's curves where these read the inputs of the trials' `vehicle`.
///
/// # Errors
/// That of the first trial, if none was read for the table's axes; as [`simulate`].
pub fn score_table(
    model: &PlantModel,
    vehicle: &Vehicle,
    trials: &[&Trial],
) -> Result<PlantScore, Error> {
    let axes = model.plant.axes();
    let of = |trial: &&Trial| with_curves_of(model, vehicle, trial.record(axes)?);
    let records = trials.iter().map(of).collect::<Result<Vec<_>, Error>>()?;
    let records: Vec<&TrialRecord> = records.iter().collect();
    score(&model.plant, &Standing::of_table(model), (&[], &records), |_| [0.0; 2])
}

/// A record with the thrust that the curves of a plant give, those of a published table aside, which are no more of it
/// than of a vehicle; with what lags of single thrusters leave of it; and with a logged wrench scaled as where the
/// plant was fitted.
fn with_curves_of(
    model: &PlantModel,
    vehicle: &Vehicle,
    record: &TrialRecord,
) -> Result<TrialRecord, Error> {
    let of_axis = |dof: &Dof| model.actuation.get(dof)?.thrust_scale.as_ref();
    let scale = model.plant.axes().iter().find_map(of_axis).map_or(1.0, |scale| scale.value);
    let mut record = record.with_wrench_scaled(scale)?;
    let first = model.plant.axes().first().and_then(|dof| model.actuation.get(dof));
    let late = first.filter(|actuation| !actuation.lag_of.is_empty());
    for own in &model.thrusters {
        if let Some(actuation) = late {
            let lag_s = actuation.lag_s(&own.name);
            record = record.with_track(&own.name, |track| behind(track, lag_s))?;
        }
        let same = vehicle.thrusters.iter().find(|other| other.name == own.name);
        let same = same.filter(|same| !model.driven.is_empty() && own.curve.replaces(&same.curve));
        if let Some(same) = same {
            let by_own = |track: &ThrusterTrack| Ok(by_curve(track, &own.curve, &same.curve));
            record = record.with_track(&own.name, by_own)?;
        }
    }
    Ok(record)
}

/// A track with the thrust of one curve where it has that of another.
fn by_curve(track: &ThrusterTrack, now: &ThrustCurve, before: &ThrustCurve) -> ThrusterTrack {
    let speed = track.speed.map(|n| {
        let input = before.input_for(track.thrust(n), None).unwrap_or_else(|| before.neutral());
        let thrust = now.force(input, None);
        let strength = if thrust < 0.0 { track.reverse } else { track.forward };
        (thrust.abs() / strength.max(f64::MIN_POSITIVE)).sqrt().copysign(thrust)
    });
    ThrusterTrack { speed, ..track.clone() }
}

/// A track whose propeller follows its log by a lag, with its speed in the middle of each step.
fn behind(track: &ThrusterTrack, lag_s: f64) -> Result<ThrusterTrack, Error> {
    let told = &track.speed;
    let count = ((told.last_s() - told.first_s()) / GRID_S).ceil() as usize;
    let grid: Vec<f64> = (0..=count).map(|k| told.first_s() + GRID_S * k as f64).collect();
    let times = union([told.time_s(), grid.as_slice()].into_iter());
    let mut speed = told.values()[0];
    let lengths = times.windows(2).map(|step| step[1] - step[0]).chain([GRID_S]);
    let middle = times.iter().zip(lengths).map(|(t, length_s)| {
        let goal = told.held_at(t + 0.5 * length_s);
        let middle = after(speed, goal, 0.5 * length_s, lag_s);
        speed = after(speed, goal, length_s, lag_s);
        middle
    });
    let values: Vec<f64> = middle.collect();
    let speed = Timed::new("propeller speed", times, values)?;
    Ok(ThrusterTrack { speed, ..track.clone() })
}

/// Measured and simulated velocity of each axis over a trial, simulated freely from its start with
/// the current of that trial, or of a trial that was not fitted with the mean of the others.
///
/// A simulation that runs away has none.
///
/// # Errors
/// That of the trial, if it was not read for the plant's axes; as [`plant_of_result`].
pub fn compare_fitted_plant(result: &PlantResult, trial: &Trial) -> Result<Vec<Comparison>, Error> {
    let plant = plant_of_result(result)?;
    let record = &trial.record(&result.axes)?.with_all_exchanged(&result.thrusters_exchanged)?;
    let own = |direction: &str| {
        result.nuisances.get(&format!("{direction}{}", record.trial)).map(|x| x.value)
    };
    let own = own(CURRENT_NORTH).zip(own(CURRENT_EAST)).map(|(north, east)| [north, east]);
    let current = own.unwrap_or_else(|| mean_current(result));
    let motions = motions(&plant, &Standing::of_result(result), record, current)?;
    let comparison = |motion: &AxisMotion| motion.comparison(record, &motion.spans(false));
    Ok(motions.iter().filter_map(comparison).collect())
}

/// How results name the current of a trial.
const CURRENT_NORTH: &str = "current north: ";
const CURRENT_EAST: &str = "current east: ";

/// The mean of the currents that were fitted, each by its certainty, m/s north and east.
fn mean_current(result: &PlantResult) -> [f64; 2] {
    [CURRENT_NORTH, CURRENT_EAST].map(|direction| {
        let own = result.nuisances.iter().filter(|(name, _)| name.starts_with(direction));
        let weighted = own.map(|(_, x)| (x.value, 1.0 / (x.std * x.std).max(f64::MIN_POSITIVE)));
        let (sum, weight) = weighted.fold((0.0, 0.0), |(s, w), (x, own)| (s + own * x, w + own));
        if weight > 0.0 { sum / weight } else { 0.0 }
    })
}

/// Simulates trials freely from their start, with thrust as it acts, and compares velocities.
///
/// The plant is simulated again with draws of what nobody knows: the disturbance that was found on
/// each axis, the start, the coefficients within their covariance. So far does that alone take the
/// true plant from what is measured, and far where motion is unstable.
///
/// `fitted` are the trials that models without a plant are fitted to.
///
/// # Errors
/// [`Error::Plant`] if M is singular; a simulation that diverges is no error but has no score.
pub(super) fn score(
    plant: &Plant,
    stands: &Standing<'_>,
    (fitted, records): (&[&TrialRecord], &[&TrialRecord]),
    current: impl Fn(&TrialRecord) -> [f64; 2],
) -> Result<PlantScore, Error> {
    let mut outcomes: BTreeMap<Dof, Vec<Outcome>> = BTreeMap::new();
    for record in records {
        for motion in motions(plant, stands, record, current(record))? {
            let noise = record.by_slope[motion.dof.index()].then(|| stands.noise(motion.dof));
            outcomes.entry(motion.dof).or_default().push(motion.outcome(record, noise));
        }
    }
    let mut all = PlantScore::default();
    for (dof, outcomes) in outcomes {
        let model = Model::from(lumped(plant, dof));
        let windows: Vec<_> = outcomes.iter().flat_map(|one| one.windows(&model)).collect();
        let driven = fitted.iter().filter_map(|record| {
            record.velocity[dof.index()].as_ref().zip(record.force[dof.index()].as_ref())
        });
        let (score, trials) = scores(&outcomes, &windows, &Nulls::steady(driven));
        all.by_axis.insert(dof, score);
        for (trial, score) in trials {
            all.by_trial.entry(trial).or_default().insert(dof, score);
        }
    }
    Ok(all)
}

/// Returns mass, drag by its own velocity and constant force of one axis of a plant.
fn lumped(plant: &Plant, dof: Dof) -> LumpedParameters {
    let own = own_terms(dof).map(|(term, sign)| sign * plant.coefficient(&term).unwrap_or(0.0));
    let [mass, d_quadratic, d_linear, bias_force] = own;
    PhysicalParameters { mass, d_quadratic, d_linear, bias_force }.to_lumped()
}

/// Velocity of one axis over a trial.
struct AxisMotion {
    dof: Dof,
    measured: Timed,
    /// At the instants of `measured`; `None` if the simulation runs away.
    simulated: Option<Vec<f64>>,
    /// The same with each draw of what is not known that does not run away.
    drawn: Vec<Vec<f64>>,
    /// Of roll and pitch: simulated anew from the beginning of each span of [`RESTARTED_S`], and as
    /// it is at that beginning.
    restarted: Option<[Vec<f64>; 2]>,
}

/// Simulates a trial freely from its start, with thrust as it acts, and again with draws of what is
/// not known.
fn motions(
    plant: &Plant,
    stands: &Standing<'_>,
    record: &TrialRecord,
    current: [f64; 2],
) -> Result<Vec<AxisMotion>, Error> {
    let record = &record.with_translations_in_time(&stands.report);
    let (from, to) = record.window_s;
    let velocity = |dof: Dof| record.velocity[dof.index()].as_ref();
    let measured: Vec<(Dof, Timed)> = plant
        .axes()
        .iter()
        .filter_map(|&dof| Some((dof, velocity(dof)?.window(from, to)?)))
        .collect();
    let mut times: Vec<f64> =
        measured.iter().flat_map(|(_, series)| series.time_s()).copied().collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let first = times.first().copied().unwrap_or(from);
    let start = record.velocity_at(first);
    let inputs = stands.inputs(plant, record, current)?;
    let followed = |plant: &Plant, inputs: &Inputs, start: &Vector6<f64>| match simulate(
        plant, inputs, start, &times,
    ) {
        Ok(mut simulated) => {
            simulated.velocity = record.as_gained(&times, &simulated.velocity);
            Ok(Some(simulated))
        }
        Err(Error::Diverged { .. }) => Ok(None),
        Err(other) => Err(other),
    };
    let simulated = followed(plant, &inputs, &start)?;
    let drawn = parallel::map(&stands.draws(), |draw| {
        let (plant, inputs, start) = draw.of(plant, &inputs, &start, record)?;
        let water = draw.water(record)?;
        Ok(followed(&plant, &inputs, &start)?.map(|motion| (motion, water)))
    });
    let drawn: Vec<Option<_>> = drawn.into_iter().collect::<Result<_, Error>>()?;
    let drawn: Vec<(Simulated, Option<Water>)> = drawn.into_iter().flatten().collect();
    let swings = |(dof, _): &(Dof, Timed)| matches!(dof, Dof::Roll | Dof::Pitch);
    let anew = match measured.iter().any(swings) {
        true => restarted(plant, &inputs, record, &times)?,
        false => None,
    };
    let motion = |(dof, measured): (Dof, Timed)| {
        let at = |t: &f64| times.partition_point(|known| known < t);
        let places: Vec<usize> = measured.time_s().iter().map(at).collect();
        let is_reported = record.may_be_late(dof.index());
        let report = if is_reported { stands.report } else { VelocityReport::default() };
        let reported = |moved: Vec<f64>| report.behind_lag(measured.time_s(), moved);
        let moved = |found: &Simulated| -> Vec<f64> {
            places.iter().map(|k| found.velocity[*k][dof.index()]).collect()
        };
        let of = |found: &Simulated| reported(moved(found));
        let in_water = |(found, water): &(Simulated, Option<Water>)| {
            let seen = |t: f64| water.as_ref().map_or(0.0, |water| water.seen(record, dof, t));
            let moved = moved(found).into_iter().zip(measured.time_s());
            reported(moved.map(|(v, t)| v + seen(*t)).collect())
        };
        let drawn = drawn.iter().map(in_water).collect();
        let own = |of: &[Vector6<f64>]| places.iter().map(|k| of[*k][dof.index()]).collect();
        let anew = anew.as_ref().filter(|_| matches!(dof, Dof::Roll | Dof::Pitch));
        let restarted = anew.map(|[simulated, kept]| [own(simulated), own(kept)]);
        AxisMotion { dof, simulated: simulated.as_ref().map(of), drawn, restarted, measured }
    };
    Ok(measured.into_iter().map(motion).collect())
}

/// Roll and pitch are simulated anew after so long, s: a few swings.
const RESTARTED_S: f64 = 10.0;

/// Velocity at some instants, simulated anew from the first of each span of [`RESTARTED_S`], and as it
/// is there; none if a simulation runs away.
fn restarted(
    plant: &Plant,
    inputs: &Inputs,
    record: &TrialRecord,
    times: &[f64],
) -> Result<Option<[Vec<Vector6<f64>>; 2]>, Error> {
    let Some(first) = times.first() else { return Ok(None) };
    let span = |t: &f64| ((t - first) / RESTARTED_S).floor();
    let (mut simulated, mut kept) = (Vec::new(), Vec::new());
    for few in times.chunk_by(|a, b| span(a) == span(b)) {
        let start = record.velocity_at(few[0]);
        match simulate(plant, inputs, &start, few) {
            Ok(motion) => simulated.extend(motion.velocity),
            Err(Error::Diverged { .. }) => return Ok(None),
            Err(other) => return Err(other),
        }
        kept.extend(few.iter().map(|_| start));
    }
    Ok(Some([simulated, kept]))
}

impl AxisMotion {
    /// Compares the simulation with the samples; with means of them over spans if they are slopes of a position, of
    /// which `noise` is the standard deviation.
    fn outcome(&self, record: &TrialRecord, noise: Option<f64>) -> Outcome {
        let spans = self.spans(noise.is_some());
        let Some(comparison) = self.comparison(record, &spans) else {
            return Outcome::diverged(&record.trial, &means(self.measured.values(), &spans));
        };
        let mean = |errors: &mut dyn Iterator<Item = f64>| errors.sum::<f64>() / spans.len() as f64;
        // What one slope is too large by its neighbour is too small by: their sum has the noise
        // of one.
        let noise = MEAN_OF_NORMAL * noise.unwrap_or(0.0);
        let drawn = self.drawn.iter().map(|other| {
            let other = means(other, &spans);
            let off = other.iter().zip(&comparison.simulated).zip(&spans);
            mean(&mut off.map(|((x, y), span)| (x - y).hypot(noise / span.len() as f64)))
        });
        let disturbance = drawn.sum::<f64>() / self.drawn.len() as f64;
        let off = |model: &Vec<f64>| {
            let model = means(model, &spans);
            mean(&mut model.iter().zip(&comparison.measured).map(|(x, y)| (x - y).abs()))
        };
        let expected = Expected {
            // Nothing is known where there are no draws.
            disturbance: Some(disturbance).filter(|x| x.is_finite()),
            restarted: self.restarted.as_ref().map(|[restarted, _]| off(restarted)),
            kept: self.restarted.as_ref().map(|[_, kept]| off(kept)),
        };
        Outcome::Compared(Box::new(comparison), expected)
    }

    /// Returns the index range of each sample, or of the samples in each [`SPAN_OF_SLOPES_S`].
    fn spans(&self, are_slopes: bool) -> Vec<Range<usize>> {
        let time_s = self.measured.time_s();
        let span = |t: f64| ((t - time_s[0]) / SPAN_OF_SLOPES_S).floor();
        let mut from = 0;
        let few = time_s.chunk_by(|a, b| are_slopes && span(*a) == span(*b));
        few.map(|few| {
            from += few.len();
            from - few.len()..from
        })
        .collect()
    }

    /// Returns measured and simulated velocity, averaged over spans of samples; `None` if the simulation diverges.
    fn comparison(&self, record: &TrialRecord, spans: &[Range<usize>]) -> Option<Comparison> {
        let (time_s, measured) = (self.measured.time_s(), self.measured.values());
        let (time_s, measured) = (means(time_s, spans), means(measured, spans));
        let simulated = means(self.simulated.as_ref()?, spans);
        let force = record.force[self.dof.index()].as_ref();
        Some(Comparison {
            quantity: ScoredMotion::Velocity,
            dof: self.dof,
            trial: record.trial.clone(),
            force: time_s.iter().map(|t| force.map_or(0.0, |force| force.held_at(*t))).collect(),
            velocity: Agreement::of(&measured, &simulated, 0.0),
            time_s,
            measured,
            simulated,
            position: None,
        })
    }
}

/// Averages values over each span.
fn means(x: &[f64], spans: &[Range<usize>]) -> Vec<f64> {
    let mean = |span: &Range<usize>| x[span.clone()].iter().sum::<f64>() / span.len() as f64;
    spans.iter().map(mean).collect()
}

/// Mean |x| of a normal x with a standard deviation of one.
const MEAN_OF_NORMAL: f64 = 0.797_884_56;

/// Slopes of positions are compared as means over so long, s, in which their noise cancels.
const SPAN_OF_SLOPES_S: f64 = 1.0;

/// What stands beside a plant: how thrust acts, and what is not known.
pub(super) struct Standing<'a> {
    actuator: Actuator,
    /// How late translations are measured.
    report: VelocityReport,
    /// The fit, where it knows what disturbs the axes.
    fit: Option<&'a PlantFit>,
}

/// A draw of how the current changes: north and east, m/s.
struct Water([Timed; 2]);

impl Water {
    /// What it adds to the velocity of an axis over ground.
    fn seen(&self, record: &TrialRecord, dof: Dof, t: f64) -> f64 {
        if dof.is_rotation() {
            return 0.0;
        }
        let angle = |angle: &Option<_>| interpolated_attitude(angle.as_ref(), t);
        let body = body_from_world(record.attitude.each_ref().map(angle));
        let Self([north, east]) = self;
        body[(dof.index(), 0)] * north.at(t) + body[(dof.index(), 1)] * east.at(t)
    }
}

/// A disturbance is drawn anew after this part of its correlation time …
const DRAWN_PART: f64 = 0.1;
/// … and no more often than so, s.
const LEAST_DRAW_S: f64 = 0.05;

/// The draws are the same at every call.
const DRAW_SEED: u64 = 5;

/// How many there are.
const DRAWS: u64 = 3;

impl<'a> Standing<'a> {
    /// What a fit found beside its plant; output error takes all misfit for the measurement's.
    pub(super) fn beside(fit: &'a PlantFit) -> Self {
        let has_disturbances = fit.method != Method::OutputError;
        Self { actuator: fit.actuator, report: fit.report, fit: has_disturbances.then_some(fit) }
    }

    /// Standard deviation of a sample of an axis's velocity, m/s or rad/s; zero if not known.
    fn noise(&self, dof: Dof) -> f64 {
        let of_axis = self.fit.and_then(|fit| fit.disturbances.get(&dof));
        of_axis.map_or(0.0, |noise| noise.velocity.0)
    }

    fn draws(&self) -> Vec<Draw<'a>> {
        let of = |fit| (0..DRAWS).map(move |k| Draw { fit, seed: DRAW_SEED + k });
        self.fit.into_iter().flat_map(of).collect()
    }

    /// What results hold of it; they do not keep the disturbances as they were fitted.
    fn of_result(result: &PlantResult) -> Self {
        let number = |name: &str| result.nuisances.get(name).map_or(0.0, |x| x.value);
        let ratio = |name: &str| result.nuisances.get(name).map_or(1.0, |x| x.value);
        let exponent = result.nuisances.get("thrust_exponent");
        let actuator = Actuator {
            lag_s: number("lag").max(number("force_lag")),
            delay_s: number("delay"),
            log_reverse_ratio: ratio("reverse_ratio").ln(),
            log_lag_ratio: ratio("lag_ratio").ln(),
            log_falling_lag_ratio: ratio("falling_lag_ratio").ln(),
            beyond_square: exponent.map_or(0.0, |exponent| exponent.value - 2.0),
            log_change_within: number("thrust_change_within").ln_1p(),
            slew_s: number("slew"),
            voltage_exponent: number("voltage_exponent"),
            dead_band: number("dead_band"),
            ln_voltage: [ratio("mean_voltage").ln(); 2],
            log_change_between: number("thrust_change_between").ln_1p(),
            log_change_loaded: number("thrust_change_loaded").ln_1p(),
            log_scale: ratio("thrust_scale").ln(),
            full_speed: ratio("full_speed"),
            between: result.between_samples(),
            steering: SteeringGear::new(
                result.nuisances.get("steering_delay").map(|x| x.value),
                result.nuisances.get("steering_rate").map(|x| x.value),
            ),
        };
        let report = VelocityReport {
            delay_s: number("translation_delay"),
            lag_s: number("translation_lag"),
            lever_m: LEVERS.map(number),
            misalignment_rad: MISALIGNMENTS.map(number),
        };
        Self { actuator, report, fit: None }
    }

    /// What a table states of it.
    fn of_table(model: &PlantModel) -> Self {
        let first = model.plant.axes().first().and_then(|dof| model.actuation.get(dof));
        let value = |of: fn(&Actuation) -> &Option<Parameter>, otherwise: f64| {
            let found = first.and_then(|actuation| of(actuation).as_ref());
            found.map_or(otherwise, |parameter| parameter.value)
        };
        let actuator = Actuator {
            // Records are behind lags of single thrusters.
            lag_s: match first {
                Some(actuation) if !actuation.lag_of.is_empty() => 0.0,
                _ => value(|x| &x.lag, 0.0).max(value(|x| &x.force_lag, 0.0)),
            },
            delay_s: value(|x| &x.delay, 0.0),
            log_reverse_ratio: value(|x| &x.reverse_ratio, 1.0).ln(),
            voltage_exponent: value(|x| &x.voltage_exponent, 0.0),
            ln_voltage: [value(|x| &x.mean_voltage, 1.0).ln(); 2],
            steering: first.map(Actuation::steering_gear).unwrap_or_default(),
            ..Actuator::default()
        };
        Self { actuator, report: VelocityReport::default(), fit: None }
    }

    /// What drives a trial, with thrust as it acts.
    fn inputs(
        &self,
        plant: &Plant,
        record: &TrialRecord,
        current: [f64; 2],
    ) -> Result<Inputs, Error> {
        Ok(Inputs {
            force: self.actuator.acting(record)?,
            velocity: record.velocity.clone(),
            attitude: record.attitude.clone(),
            current,
            signals: self.actuator.signals(record, plant)?,
            wind: None,
            known: record.known.clone(),
        })
    }
}

/// A draw of what is not known beside a fit.
struct Draw<'a> {
    fit: &'a PlantFit,
    seed: u64,
}

/// Streams of a draw, after those of the axes.
const OF_WATER: usize = 6;
const OF_START: usize = 8;
const OF_PLANT: usize = 9;
const OF_WAVES: usize = 10;

impl Draw<'_> {
    fn random(&self, stream: usize) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(stream as u64);
        random
    }

    /// The plant within its covariance; inputs with a Gauss–Markov force on each axis; a start with
    /// the noise of the instruments.
    fn of(
        &self,
        plant: &Plant,
        inputs: &Inputs,
        start: &Vector6<f64>,
        record: &TrialRecord,
    ) -> Result<(Plant, Inputs, Vector6<f64>), Error> {
        let (mut inputs, mut start) = (inputs.clone(), *start);
        let mut random = self.random(OF_START);
        for (dof, noise) in &self.fit.disturbances {
            let k = dof.index();
            start[k] += noise.velocity.0 * normal(&mut random);
            let process = (noise.disturbance.0, noise.correlation_s.0);
            push(&mut inputs.force[k], drawn(self.random(k), process, record.window_s)?)?;
            if let Some(waves) = self.waves(*dof, record.window_s)? {
                push(&mut inputs.force[k], waves)?;
            }
        }
        for angle in inputs.attitude.iter_mut().flatten() {
            let off = sample_noise([&*angle]).unwrap_or(0.0) * normal(&mut random);
            *angle = angle.map(|x| x + off);
        }
        Ok((self.plant(plant), inputs, start))
    }

    /// One that no vehicle can have is as it was.
    fn plant(&self, plant: &Plant) -> Plant {
        // Thrust and plant of another scale move alike.
        let covariance = &self.fit.covariance - &self.fit.thrust_covariance;
        if covariance.nrows() != plant.coefficients().len() {
            return plant.clone();
        }
        let mut random = self.random(OF_PLANT);
        let unit = DVector::from_fn(covariance.nrows(), |_, _| normal(&mut random));
        let off = root(&covariance) * unit;
        let coefficients = plant.coefficients().iter().zip(off.iter()).map(|(x, off)| x + off);
        let drawn = Plant::new(plant.structure().clone(), coefficients.collect());
        let is_possible = |plant: &Plant| plant.mass_matrix().cholesky().is_some();
        drawn.ok().filter(is_possible).unwrap_or_else(|| plant.clone())
    }

    /// The force of waves on an axis, if there are any.
    fn waves(&self, dof: Dof, window_s: (f64, f64)) -> Result<Option<Timed>, Error> {
        let Some(swell) = &self.fit.swell else { return Ok(None) };
        let (period_s, std) = (swell.period_s.0, swell.force[&dof].0);
        let times = draw_times(DRAWN_PART * period_s, window_s);
        let angle = TAU * (times[1] - times[0]) / period_s;
        let step = (angle, (-swell.damping.0 * angle).exp());
        let random = self.random(OF_WAVES + dof.index());
        let path = stochastic_cycle(random, std, step, times.len());
        Timed::new("waves", times, path).map(Some)
    }

    /// How the current changes, if it does.
    fn water(&self, record: &TrialRecord) -> Result<Option<Water>, Error> {
        let Some(drift) = self.fit.current_drift else { return Ok(None) };
        let process = (drift.std_m_s.0, drift.correlation_s.0);
        let of = |k: usize| drawn(self.random(OF_WATER + k), process, record.window_s);
        Ok(Some(Water([of(0)?, of(1)?])))
    }
}

/// A Gauss–Markov process of some standard deviation and correlation time over a trial.
fn drawn(
    random: ChaCha8Rng,
    (std, correlation_s): (f64, f64),
    (from, to): (f64, f64),
) -> Result<Timed, Error> {
    let times = draw_times(DRAWN_PART * correlation_s, (from, to));
    let path = gauss_markov(random, std, correlation_s / (times[1] - times[0]), times.len());
    Timed::new("disturbance", times, path)
}

/// The instants at which a force is drawn anew over a trial, two at least.
fn draw_times(period_s: f64, (from, to): (f64, f64)) -> Vec<f64> {
    let h = period_s.max(LEAST_DRAW_S);
    let count = ((to - from) / h).ceil().max(2.0) as usize;
    (0..count).map(|k| from + k as f64 * h).collect()
}

/// Adds a force to one that may not have been logged.
fn push(force: &mut Option<Timed>, added: Timed) -> Result<(), Error> {
    *force = Some(match force.take() {
        Some(force) => held_sum(&force, &added)?,
        None => added,
    });
    Ok(())
}

/// The sum of two held series.
fn held_sum(a: &Timed, b: &Timed) -> Result<Timed, Error> {
    let times = union([a.time_s(), b.time_s()].into_iter());
    let values: Vec<f64> = times.iter().map(|t| a.held_at(*t) + b.held_at(*t)).collect();
    Timed::new("force", times, values)
}
