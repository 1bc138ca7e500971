//! The record of one degree of freedom as the record of a trial, for the filter of any axes.

use nalgebra::Vector6;

use super::gained::{between, gained};
use super::slopes::slope;
use super::trial_record::{held_means, means};
use super::{AxisRecord, PlacedThruster, ThrusterTrack, TrialRecord};
use crate::navigation::Motion;
use crate::plant::Signal;
use crate::{Dof, Error, Timed};

impl AxisRecord {
    /// Returns the degree of freedom that stands for its own in [`Self::as_trial`]: surge for a
    /// translation, yaw for a rotation. Alone in a plant, each has the same equation of motion as
    /// others of its kind, and a position of its own.
    pub(crate) const fn stand_in(dof: Dof) -> Dof {
        if dof.is_rotation() { Dof::Yaw } else { Dof::Surge }
    }

    /// Returns the record as that of a trial straight ahead or of a turn on the spot, with thrusters
    /// named by number.
    ///
    /// Motion within gaps of the force is left out.
    ///
    /// # Errors
    /// [`Error::TooShort`] without motion beside a force; those of [`Timed::new`].
    pub(crate) fn as_trial(&self) -> Result<TrialRecord, Error> {
        let axis = Self::stand_in(self.dof).index();
        let mut record = TrialRecord::empty(&self.trial);
        record.thrusters = self.placed(axis);
        record.signals = record.thrusters.iter().flat_map(PlacedThruster::signals).collect();
        if let Some(turning) = &self.turning {
            record.signals.insert(Self::turning_signal(), turning.map(root));
        }
        let force = held_means(&self.force);
        let changes = force.time_s().to_vec();
        record.force[axis] = Some(force);
        let motion = self.beside_force()?;
        match &self.motion {
            Motion::Velocity(_) => {
                let (velocity, spread) = means(&motion, &changes);
                (record.velocity[axis], record.spread[axis]) = (Some(velocity), spread);
            }
            Motion::Position(_) => {
                record.velocity[axis] = Some(slope(&motion)?);
                record.by_slope[axis] = true;
                let position = means(&motion, &[]).0;
                match self.dof.is_rotation() {
                    true => record.heading = Some(position),
                    false => record.fixes = Some([Some(position), None]),
                }
            }
            Motion::Acceleration(_) => {}
        }
        if let Some(felt) = self.acceleration.as_ref().filter(|_| !self.dof.is_rotation()) {
            record.acceleration[axis] = Some(between(felt, felt.mean.time_s())?);
            record.by_acceleration = gained(&record.acceleration, None, &mut record.velocity)?;
        }
        record.window_s = self.common_window(&motion)?;
        Ok(record)
    }

    /// Returns the signal of [`Self::as_trial`] whose square with its sign is [`Self::turning`], so that the force
    /// that turning makes is that of a propeller of unknown strength.
    pub(crate) fn turning_signal() -> Signal {
        Signal::Drive("turning".to_owned())
    }

    fn placed(&self, axis: usize) -> Vec<PlacedThruster> {
        let place = |(k, track): (usize, ThrusterTrack)| {
            let mut wrench = Vector6::zeros();
            wrench[axis] = track.lever;
            let track = ThrusterTrack { lever: 1.0, ..track };
            PlacedThruster { name: (k + 1).to_string(), track, wrench }.thinned()
        };
        self.tracks().into_iter().enumerate().map(place).collect()
    }

    /// Returns its motion while its force is known.
    fn beside_force(&self) -> Result<Timed, Error> {
        let (motion, parts) = (self.motion.series(), self.parts());
        let is_known = |t: f64| parts.iter().any(|(from_s, to_s)| (*from_s..=*to_s).contains(&t));
        let samples = motion.time_s().iter().zip(motion.values());
        let (time_s, values): (Vec<f64>, Vec<f64>) =
            samples.filter(|(t, _)| is_known(**t)).map(|(t, x)| (*t, *x)).unzip();
        Timed::new("motion", time_s, values)
    }

    /// Returns from when to when both motion and force are known, s.
    pub(crate) fn common_window_s(&self) -> (f64, f64) {
        self.window_beside(self.motion.series())
    }

    fn window_beside(&self, motion: &Timed) -> (f64, f64) {
        let held_s = if self.force.len() == 1 { f64::INFINITY } else { self.force.period_s() };
        let from_s = motion.first_s().max(self.force.first_s());
        (from_s, motion.last_s().min(self.force.last_s() + held_s))
    }

    fn common_window(&self, motion: &Timed) -> Result<(f64, f64), Error> {
        let (from_s, to_s) = self.window_beside(motion);
        match from_s < to_s {
            true => Ok((from_s, to_s)),
            false => Err(Error::TooShort {
                name: format!("motion beside force in {} of trial `{}`", self.dof, self.trial),
                found: 0,
                needed: 2,
            }),
        }
    }
}

fn root(x: f64) -> f64 {
    x.abs().sqrt().copysign(x)
}

impl TrialRecord {
    /// Returns what was measured of the motion of a record of one axis: velocity, position or heading; `None`
    /// if acceleration alone was.
    pub(crate) fn measured_alone(&self) -> Option<&Timed> {
        let velocity = || {
            let is_measured = |dof: &Dof| self.is_measured(*dof);
            Dof::ALL
                .into_iter()
                .find(is_measured)
                .and_then(|dof| self.velocity[dof.index()].as_ref())
        };
        let position = self.fixes.iter().flatten().flatten().next();
        position.or(self.heading.as_ref()).or_else(velocity)
    }

    /// Returns a record of one axis without the samples of its motion at some times, s.
    ///
    /// # Errors
    /// As [`Timed::new`], if none is left.
    pub(crate) fn without_samples(mut self, times: &[f64]) -> Result<Self, Error> {
        if times.is_empty() {
            return Ok(self);
        }
        let left = |series: &Timed| {
            let kept = series.time_s().iter().zip(series.values());
            let kept = kept.filter(|(t, _)| !times.contains(*t));
            let (time_s, values): (Vec<f64>, Vec<f64>) = kept.map(|(t, x)| (*t, *x)).unzip();
            Timed::new("motion", time_s, values)
        };
        for (axis, velocity) in self.velocity.iter_mut().enumerate() {
            let (Some(series), false) = (velocity.as_mut(), self.by_slope[axis]) else { continue };
            *series = left(series)?;
            if let Some(spread) = self.spread[axis].as_mut() {
                *spread = left(spread)?;
            }
        }
        for (axis, position) in [(0, self.fixes.as_mut().and_then(|both| both[0].as_mut()))]
            .into_iter()
            .chain([(5, self.heading.as_mut())])
        {
            let Some(position) = position else { continue };
            *position = left(position)?;
            self.velocity[axis] = Some(slope(position)?);
        }
        Ok(self)
    }
}
