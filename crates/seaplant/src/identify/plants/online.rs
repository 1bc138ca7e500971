//! Coupled plants by methods that work sample by sample.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::{MOST_STD, Records, coefficient_of, failure, known, result as of_fit, rivals, score};
use crate::estimate::PlantFit;
use crate::estimate::online::{OnlineFit, OnlineOptions, Scheme, fit_online_plant, logs::doubts};
use crate::judge::scoring;
use crate::motion::{body_from_world, interpolated_attitude};
use crate::plant::RigidBody;
use crate::results::{Failure, Parameters, PlantResult, Trust, Verdict};
use crate::{Caveat, Error, IdentifyOptions, Method, Timed, TrialRecord, Vehicle};

/// The plants of the methods that were asked for, with the terms that filter error found, under
/// thrust as it acts by what it found, scored with its currents; and which methods could
/// not.
pub(super) fn plants(
    found: &PlantFit,
    records: &Records<'_>,
    vehicle: (&Vehicle, Option<&RigidBody>),
    options: &IdentifyOptions,
) -> (BTreeMap<Method, PlantResult>, Vec<Failure>) {
    let asked = options.methods.iter().filter_map(|method| Some((*method, method.scheme()?)));
    let (mut plants, mut failures) = (BTreeMap::new(), Vec::new());
    for (method, scheme) in asked {
        match plant(found, (method, scheme), records, vehicle, &options.online) {
            Ok(plant) => drop(plants.insert(method, plant)),
            Err(error) => {
                let axes = found.plant.axes();
                failures.push(failure(axes, method, &error));
            }
        }
    }
    (plants, failures)
}

fn plant(
    found: &PlantFit,
    (method, scheme): (Method, Scheme),
    records: &Records<'_>,
    (vehicle, body): (&Vehicle, Option<&RigidBody>),
    options: &OnlineOptions,
) -> Result<PlantResult, Error> {
    records.fit.iter().try_for_each(|record| check_velocity(record))?;
    let as_it_acts: Vec<TrialRecord> =
        records.fit.iter().map(|record| acting(found, record)).collect::<Result<_, Error>>()?;
    let as_it_acts: Vec<&TrialRecord> = as_it_acts.iter().collect();
    let structure = found.plant.structure();
    let fit = fit_online_plant(structure, scheme, &as_it_acts, body, options)?;
    let online = PlantFit {
        plant: fit.estimate.plant.clone(),
        covariance: &fit.estimate.covariance + &found.thrust_covariance,
        method,
        samples: fit.samples,
        ..found.clone()
    };
    let mut plant = result(&online, found, &fit, body);
    let as_found = &fit.estimate.plant;
    let beside = score::Standing::beside(found);
    let (fitted, held) = (records.fit.as_slice(), records.hold_out.as_slice());
    let own = |record: &TrialRecord| found.current_of(&record.trial);
    plant.fit = score::score(as_found, &beside, (fitted, fitted), own)?;
    if !held.is_empty() {
        let score = score::score(as_found, &beside, (fitted, held), |_| found.mean_current())?;
        plant.hold_out = Some(score);
    }
    plant.caveats.extend(beside_batch(found, &online, &plant, &records.fit, vehicle));
    plant.caveats.sort_by_key(|caveat| std::cmp::Reverse(caveat.severity));
    let codes = plant.caveats.iter().map(|caveat| caveat.code).collect();
    plant.verdict = Verdict::new(Trust::Doubtful, NOT_JUDGED, codes);
    Ok(plant)
}

/// Why no plant of several axes by a method that works sample by sample is more than doubtful.
const NOT_JUDGED: &str = "plants by methods that work sample by sample are not judged; the recommended plant of these axes is";

/// A method that works sample by sample is fed velocities.
///
/// # Errors
/// [`Error::MissingChannel`] where acceleration alone tells one; [`Error::Plant`] of a trial with known
/// forces.
fn check_velocity(record: &TrialRecord) -> Result<(), Error> {
    if !record.known.is_empty() {
        let reason = format!(
            "methods that work sample by sample do not know of [[trial.known]], which trial `{}` has; leave these methods out, or use a trial without",
            record.trial
        );
        return Err(Error::Plant { axes: "this".to_owned(), reason });
    }
    match record.by_acceleration.contains(&true) {
        false => Ok(()),
        true => Err(Error::MissingChannel {
            trial: record.trial.clone(),
            what: "a velocity of every translation".to_owned(),
            advice: "methods that work sample by sample need one: map velocity or position, or leave these methods out".to_owned(),
        }),
    }
}

/// Doubts that show beside the batch, in what is known of the vehicle, and on trials.
fn beside_batch(
    found: &PlantFit,
    online: &PlantFit,
    plant: &PlantResult,
    records: &[&TrialRecord],
    vehicle: &Vehicle,
) -> Vec<Caveat> {
    let known = known::doubts(online, &plant.parameters, records, vehicle);
    let scores = scoring(&plant.fit, plant.hold_out.as_ref());
    let mut all: Vec<Caveat> = known.into_iter().map(|(_, caveat)| caveat).collect();
    all.extend(rivals::from_batch(found, online, records));
    all.extend(scores);
    all
}

/// A record with thrust as it acts and velocity through the water.
fn acting(found: &PlantFit, record: &TrialRecord) -> Result<TrialRecord, Error> {
    let record = &record.with_translations_before(&found.report);
    // As it acts it is a wrench: what the thrusters do to it is done.
    let (force, thrusters) = (found.actuator.acting(record)?, Vec::new());
    let velocity = through_water(record, found.current_of(&record.trial))?;
    let signals = found.actuator.signals(record, &found.plant)?;
    // Velocity is the origin's, and no reading is through the water.
    let (readings, levers_m) = ([const { None }; 3], Default::default());
    let record = record.clone();
    Ok(TrialRecord { force, thrusters, velocity, readings, levers_m, signals, ..record })
}

/// ν − R(η)ᵀ u_c of a current to the north and east, m/s.
fn through_water(
    record: &TrialRecord,
    [north, east]: [f64; 2],
) -> Result<[Option<Timed>; 6], Error> {
    let mut velocity = record.velocity.clone();
    if [north, east] == [0.0; 2] {
        return Ok(velocity);
    }
    for (axis, series) in velocity.iter_mut().take(3).enumerate() {
        let Some(over_ground) = series else { continue };
        let relative = over_ground.time_s().iter().zip(over_ground.values()).map(|(t, v)| {
            let angles = record.attitude.each_ref().map(|x| interpolated_attitude(x.as_ref(), *t));
            v - (body_from_world(angles) * Vector3::new(north, east, 0.0))[axis]
        });
        let relative: Vec<f64> = relative.collect();
        *series = Some(Timed::new("velocity", over_ground.time_s(), relative)?);
    }
    Ok(velocity)
}

fn result(
    online: &PlantFit,
    found: &PlantFit,
    fit: &OnlineFit,
    body: Option<&RigidBody>,
) -> PlantResult {
    let plant = &fit.estimate.plant;
    let names = plant.structure().names();
    let freedom = fit.estimate.independent_samples;
    let parameter = |(k, name): (usize, &String)| {
        // What nothing tells has no standard deviation that a file could hold.
        let of_thrust = found.thrust_covariance[(k, k)].sqrt();
        let std = fit.estimate.std[k].hypot(of_thrust).min(MOST_STD);
        (name.clone(), coefficient_of(plant, k, std, freedom))
    };
    let parameters = names.iter().enumerate().map(parameter).collect();
    PlantResult {
        by_axis: Parameters::by_axis(plant.axes(), &parameters),
        parameters,
        identifiability: None,
        structure: Vec::new(),
        log_likelihood: None,
        history: Some(fit.history.result(&names, fit)),
        caveats: doubts(&plant.structure().name(), &names, fit),
        ..of_fit(online, body)
    }
}
