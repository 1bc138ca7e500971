//! Displacement of the vehicle's origin, computed in one pass and not stored.

use std::collections::BTreeMap;

use nalgebra::{Rotation3, Vector3};

use super::TRANSLATIONS;
use super::attitude::AttitudeRecord;
use crate::signal::{check_differentiable, slope_of_parabola};
use crate::{Dof, Error, Timed};

/// World-fixed displacement `[north, east, down]`, m.
pub(super) struct Track<'a> {
    /// The series that defines the instants.
    base: &'a Timed,
    attitude: &'a AttitudeRecord,
    way: Source<'a>,
}

/// The source of displacement.
enum Source<'a> {
    /// Positions north and east, and the lever arm of their sensor.
    Positioned { east: &'a Timed, lever: Vector3<f64> },
    /// Body velocities along [`TRANSLATIONS`]; those not measured are zero.
    Reckoned([Option<&'a Timed>; 3]),
}

/// An instant of a track.
#[derive(Clone, Copy)]
struct Instant {
    t_s: f64,
    to_world: Rotation3<f64>,
    displacement: Vector3<f64>,
}

impl<'a> Track<'a> {
    /// Creates a track from measured positions.
    pub(super) fn positioned(
        north: &'a Timed,
        east: &'a Timed,
        lever: Vector3<f64>,
        attitude: &'a AttitudeRecord,
    ) -> Self {
        Self { base: north, attitude, way: Source::Positioned { east, lever } }
    }

    /// Creates a track from body velocities; `None` if none was measured.
    pub(super) fn reckoned(
        velocity: &'a BTreeMap<Dof, Timed>,
        attitude: &'a AttitudeRecord,
    ) -> Option<Self> {
        let parts = TRANSLATIONS.map(|dof| velocity.get(&dof));
        let base = parts.iter().flatten().max_by_key(|part| part.len())?;
        if attitude.is_empty() && parts.iter().flatten().count() < 2 {
            // One axis without attitude: displacement along that axis, which needs no frame.
            return None;
        }
        Some(Self { base, attitude, way: Source::Reckoned(parts) })
    }

    /// Returns displacement at every instant.
    pub(super) fn displacement(&self) -> Result<[Timed; 3], Error> {
        let mut paths = [Vec::new(), Vec::new(), Vec::new()];
        self.walk(|place| {
            let parts = paths.iter_mut().zip(place.displacement.iter());
            parts.for_each(|(path, x)| path.push(*x));
        });
        let [n, e, d] = paths.map(|path| self.base.with_values("displacement", path));
        Ok([n?, e?, d?])
    }

    /// Returns the derivative of displacement in body axes, along some of [`TRANSLATIONS`].
    ///
    /// # Errors
    /// [`Error::TooShort`] with fewer than two instants.
    pub(super) fn body_velocity(&self, rows: &[usize]) -> Result<Vec<Timed>, Error> {
        check_differentiable(self.base.len())?;
        let mut velocities = vec![Vec::with_capacity(self.base.len()); rows.len()];
        let mut add = |before: Option<Instant>, now: Instant, after: Option<Instant>| {
            let point = |place: Instant, n: usize| [place.t_s, place.displacement[n]];
            let slope = |n: usize| {
                let (before, after) = (before.map(|b| point(b, n)), after.map(|a| point(a, n)));
                slope_of_parabola(before, point(now, n), after)
            };
            let world = Vector3::from_fn(|n, _| slope(n));
            let body = now.to_world.inverse() * world;
            velocities.iter_mut().zip(rows).for_each(|(v, row)| v.push(body[*row]));
        };
        let (mut before, mut now) = (None, None);
        self.walk(|place| {
            if let Some(now) = now {
                add(before, now, Some(place));
            }
            (before, now) = (now, Some(place));
        });
        if let Some(now) = now {
            add(before, now, None);
        }
        let series = |v| self.base.with_values("navigated velocity", v);
        velocities.into_iter().map(series).collect()
    }

    /// Calls a function at every instant, in order; dead reckoning integrates
    /// `p(t) = ∫ R v dt` by the trapezoidal rule.
    fn walk(&self, mut visit: impl FnMut(Instant)) {
        let mut attitude = self.attitude.reader();
        let samples = self.base.time_s().iter().zip(self.base.values());
        match &self.way {
            Source::Positioned { east, lever } => {
                let mut east = east.reader();
                for (&t_s, north) in samples {
                    let to_world = attitude.at(t_s);
                    let offset = to_world * lever;
                    let displacement = Vector3::new(north - offset.x, east.at(t_s) - offset.y, 0.0);
                    visit(Instant { t_s, to_world, displacement });
                }
            }
            Source::Reckoned(parts) => {
                let mut parts = parts.map(|part| part.map(Timed::reader));
                let mut displacement = Vector3::zeros();
                let mut before: Option<(f64, Vector3<f64>)> = None;
                for (&t_s, _) in samples {
                    let to_world = attitude.at(t_s);
                    let read = parts.iter_mut();
                    let v = Vector3::from_iterator(
                        read.map(|part| part.as_mut().map_or(0.0, |part| part.at(t_s))),
                    );
                    let v = to_world * v;
                    if let Some((t_before, v_before)) = before {
                        displacement += 0.5 * (t_s - t_before) * (v + v_before);
                    }
                    before = Some((t_s, v));
                    visit(Instant { t_s, to_world, displacement });
                }
            }
        }
    }
}
