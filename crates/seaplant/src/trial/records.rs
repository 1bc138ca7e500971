//! The raw records of one degree of freedom, cut to the trial's window once.

use super::axis::{HISTORY_S, is_moved_by_turning, lever_rates, within};
use super::force::Thrust;
use super::{AxisRecord, LEAST_SAMPLES, TrialSetup, VelocitySource};
use crate::navigation::{Motion, Navigated};
use crate::series::Cutter;
use crate::{Dof, Error, Timed};

/// The records of a degree of freedom, by source of velocity.
#[derive(Clone, Debug)]
pub(super) struct Records {
    measured: AxisRecord,
    by_position: Result<AxisRecord, Error>,
}

impl Records {
    /// Creates the records of a degree of freedom.
    ///
    /// # Errors
    /// As [`Trial::new`](super::Trial::new).
    pub(super) fn new(
        setup: &TrialSetup,
        dof: Dof,
        thrust: Thrust,
        navigated: &Navigated,
        cutter: &mut Cutter,
    ) -> Result<Self, Error> {
        let mut uncut = Uncut { setup, dof, thrust, navigated, cutter };
        let by_position = navigated.by_position.get(&dof);
        let Some(velocity) = navigated.measured.get(&dof) else {
            let accelerated = navigated.acceleration.get(&dof);
            let alone = accelerated.map(|found| Motion::Acceleration(found.mean.clone()));
            let position = by_position.or(alone.as_ref()).ok_or_else(|| Error::MissingChannel {
                trial: setup.name.clone(),
                what: format!("velocity, position or acceleration for {dof}"),
                advice: motion_advice(dof).to_owned(),
            })?;
            let (_, record) = uncut.record(position, None)?;
            return Ok(Self { by_position: Ok(record.clone()), measured: record });
        };
        let measured = uncut.record(&Motion::Velocity(velocity.clone()), None)?;
        let by_position = by_position
            .map(|motion| Ok(uncut.record(motion, Some(&measured))?.1))
            .unwrap_or_else(|| Ok(measured.1.clone()));
        Ok(Self { measured: measured.1, by_position })
    }

    /// Returns the record with velocity from a source.
    ///
    /// # Errors
    /// As [`Trial::new`](super::Trial::new), if velocity from position is requested.
    pub(super) fn from(&self, source: VelocitySource) -> Result<AxisRecord, Error> {
        match source {
            VelocitySource::Measured => Ok(self.measured.clone()),
            VelocitySource::Position => self.by_position.clone(),
        }
    }
}

/// A record and its window, s.
type Windowed = ((f64, f64), AxisRecord);

/// One degree of freedom before it is cut to the window.
struct Uncut<'a> {
    setup: &'a TrialSetup,
    dof: Dof,
    thrust: Thrust,
    navigated: &'a Navigated,
    cutter: &'a mut Cutter,
}

impl Uncut<'_> {
    /// Creates the record of one motion, sharing data with another of the same window.
    fn record(&mut self, motion: &Motion, other: Option<&Windowed>) -> Result<Windowed, Error> {
        let window_s = self.overlap(motion.series())?;
        let samples = self.cutter.window(motion.series(), window_s);
        let found = samples.as_ref().map_or(0, Timed::len);
        let too_short = || Error::TooShort {
            name: format!("the {} motion of trial `{}`", self.dof, self.setup.name),
            found,
            needed: LEAST_SAMPLES,
        };
        let samples = samples.filter(|_| found >= LEAST_SAMPLES).ok_or_else(too_short)?;
        let motion = motion.with(samples);
        let is_same = |(window, record): &&Windowed| {
            *window == window_s
                && is_moved_by_turning(&record.motion) == is_moved_by_turning(&motion)
        };
        let record = match other.filter(is_same) {
            Some((_, same)) => AxisRecord { motion, ..same.clone() },
            None => self.cut(window_s, motion).ok_or_else(|| Error::TooShort {
                name: format!("the {} thrust of trial `{}`", self.dof, self.setup.name),
                found: 0,
                needed: 1,
            })?,
        };
        Ok((window_s, record))
    }

    fn cut(&mut self, window_s: (f64, f64), motion: Motion) -> Option<AxisRecord> {
        let Self { setup, dof, thrust, navigated, cutter } = self;
        let rates = navigated.rates.as_ref().filter(|_| is_moved_by_turning(&motion));
        let rates = rates.and_then(|rates| lever_rates(*dof, rates));
        let position = navigated.position.get(dof);
        let accelerated = navigated.acceleration.get(dof);
        let turning = navigated.turning.get(dof);
        let with_history = (window_s.0 - HISTORY_S, window_s.1);
        let tracks = thrust.tracks.iter();
        let record = AxisRecord {
            dof: *dof,
            trial: setup.name.clone(),
            force: cutter.window_held(&thrust.force, with_history)?,
            thrusters: tracks.filter_map(|track| track.cut(cutter, with_history)).collect(),
            motion,
            acceleration: accelerated.and_then(|all| all.window(window_s.0, window_s.1)),
            lever_rates: rates.map(|rates| rates.map(|rate| cutter.around(&rate, window_s))),
            turning: turning.map(|turning| cutter.around(turning, window_s)),
            position: position.and_then(|path| cutter.window(path, window_s)),
            cuts: match dof {
                Dof::Yaw => within(&navigated.heading_cuts, window_s),
                _ => Vec::new(),
            },
        };
        Some(record.starting_from_rest())
    }

    /// Returns the part of the trial's window in which force and motion overlap, s.
    fn overlap(&self, motion: &Timed) -> Result<(f64, f64), Error> {
        let (dof, force) = (self.dof, &self.thrust.force);
        let wanted_from = self.setup.from_s.unwrap_or(f64::NEG_INFINITY);
        let wanted_to = self.setup.to_s.unwrap_or(f64::INFINITY);
        let span = |what: &str, from_s: f64, to_s: f64| {
            format!("{what}, from {from_s:.1} to {to_s:.1} s,")
        };
        let refuse = |second: String| Error::NoOverlap {
            trial: self.setup.name.clone(),
            first: span(&format!("the {dof} motion"), motion.first_s(), motion.last_s()),
            second,
        };
        // Thrust logged once is held to the end of the trial; otherwise for one more period.
        let held_to = if force.len() == 1 { f64::INFINITY } else { force.last_s() };
        let held_to = held_to + force.period_s();
        if motion.first_s() > held_to || motion.last_s() < force.first_s() {
            let thrust = format!("the {dof} thrust");
            return Err(refuse(span(&thrust, force.first_s(), force.last_s())));
        }
        if motion.first_s() > wanted_to || motion.last_s() < wanted_from {
            return Err(refuse(span("the trial's window", wanted_from, wanted_to)));
        }
        Ok((
            wanted_from.max(motion.first_s()).max(force.first_s()),
            wanted_to.min(motion.last_s()).min(held_to),
        ))
    }
}

fn motion_advice(dof: Dof) -> &'static str {
    match dof {
        Dof::Surge => {
            "map velocity.surge, dvl.velocity.x, position.north and .east with attitude.heading, or acceleration.x with attitude.roll and .pitch"
        }
        Dof::Sway => {
            "map velocity.sway, dvl.velocity.y, position.north and .east with attitude.heading, or acceleration.y with attitude.roll and .pitch"
        }
        Dof::Heave => "map depth, velocity.heave or dvl.velocity.z",
        Dof::Roll => "map attitude.roll or rate.roll",
        Dof::Pitch => "map attitude.pitch or rate.pitch",
        Dof::Yaw => "map attitude.heading or rate.yaw",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Trial;
    use crate::twin::{TwinSpec, make};

    #[test]
    fn a_window_equals_that_part_of_the_whole_trial() {
        let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 60.0, ..TwinSpec::jason2() };
        let twin = make(&spec).expect("valid");
        let log = &twin.trials[0];
        let trial = |from_s, to_s| {
            let setup = TrialSetup { dofs: vec![Dof::Surge], from_s, to_s, ..Default::default() };
            Trial::new(setup, &log.recording, &twin.vehicle).expect("complete")
        };
        let (whole, part) = (trial(None, None), trial(Some(20.03), Some(40.0)));
        for source in [VelocitySource::Measured, VelocitySource::Position] {
            let record = |trial: &Trial| trial.axis(Dof::Surge, source).expect("there");
            let (whole, part) = (record(&whole), record(&part));
            let motion = part.motion.series();
            assert_eq!(*motion, whole.motion.series().window(20.03, 40.0).expect("samples"));
            let with_history = whole.force.window_held(20.03 - HISTORY_S, 40.0);
            assert_eq!(part.force, with_history.expect("samples"));
            let (whole, part) =
                (whole.lever_rates.expect("turns"), part.lever_rates.expect("turns"));
            for (whole, part) in whole.iter().zip(&part) {
                assert!(part.len() < whole.len() / 2);
                assert!(motion.time_s().iter().all(|&t| part.at(t) == whole.at(t)));
            }
        }
    }
}
