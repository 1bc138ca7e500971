use super::plausible::is_coarse;
use super::{LEAST_SAMPLES, ThrusterTrack, count};
use crate::navigation::{MeanAcceleration, Motion};
use crate::signal::{Stretches, differentiate, slope_around, uniform_stretches};
use crate::{Caveat, CaveatCode, Dof, Error, Gap, Grid, Timed};

/// What one trial says of one degree of freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisRecord {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Which trial.
    pub trial: String,
    /// Force or moment, held from each sample to the next; N or N m.
    pub force: Timed,
    /// The thrusters that make it; empty if only the force is known.
    pub thrusters: Vec<ThrusterTrack>,
    /// Velocity, or the position that it is derived from; or acceleration, where neither was
    /// measured.
    pub motion: Motion,
    /// What an accelerometer shows beside position, or by itself; absent where an instrument
    /// measures velocity.
    pub acceleration: Option<MeanAcceleration>,
    /// What a metre of lever arm adds to the measured velocity, along the axes that
    /// [`lever_axes`] names; absent for positions, rotations and logs without attitude.
    pub lever_rates: Option<[Timed; 2]>,
    /// What turning does to the velocity of a rigid body along this axis, `−(ω × v)`, m/s²:
    /// r v − q w in surge, p w − r u in sway, q u − p v in heave; absent in rotations and
    /// where the log lacks turning or the other velocities.
    pub turning: Option<Timed>,
    /// Position measured along this degree of freedom, where there is one.
    pub position: Option<Timed>,
    /// Gaps across which position is known but for an offset, as heading is after turns that
    /// nobody saw.
    pub cuts: Vec<Gap>,
}

/// Thrust before a record starts is kept for so long, s: with a delay it acts later.
pub(super) const HISTORY_S: f64 = 5.0;

/// A vehicle starts from rest if its first speed is below this part of its greatest …
const REST_PART: f64 = 0.1;
/// … samples of velocity that tell its first speed.
const REST_SAMPLES: usize = 5;

/// How long before the first logged thrust a vehicle at rest had none, s.
const OFF_BEFORE_S: f64 = 1.0;

/// The two body axes along which a velocity sensor's lever arm shows in a translation:
/// (ω × r) has no part along its own axis.
pub const fn lever_axes(dof: Dof) -> Option<[char; 2]> {
    match dof {
        Dof::Surge => Some(['y', 'z']),
        Dof::Sway => Some(['x', 'z']),
        Dof::Heave => Some(['x', 'y']),
        Dof::Roll | Dof::Pitch | Dof::Yaw => None,
    }
}

/// Only an instrument that moves with the hull is misled by its turning.
pub(super) const fn is_moved_by_turning(motion: &Motion) -> bool {
    matches!(motion, Motion::Velocity(_))
}

/// The angular velocities that a lever arm along those axes is multiplied with.
pub(super) fn lever_rates(dof: Dof, rates: &[Timed; 3]) -> Option<[Timed; 2]> {
    let [p, q, r] = rates;
    let minus = |rate: &Timed| rate.map(|x| -x);
    match dof {
        // ω × r = (q z − r y, r x − p z, p y − q x).
        Dof::Surge => Some([minus(r), q.clone()]),
        Dof::Sway => Some([r.clone(), minus(p)]),
        Dof::Heave => Some([minus(q), p.clone()]),
        Dof::Roll | Dof::Pitch | Dof::Yaw => None,
    }
}

/// A stretch of one degree of freedom on a uniform grid.
#[derive(Clone, Debug, PartialEq)]
pub struct UniformStretch {
    /// Its instants.
    pub grid: Grid,
    /// Force averaged over the interval around each instant; N or N m, shape (n,).
    pub tau: Vec<f64>,
    /// Velocity, unfiltered; m/s or rad/s, shape (n,).
    pub v: Vec<f64>,
}

/// A degree of freedom of a trial on uniform grids, cut at its gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct UniformAxis {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Rate of the grids, Hz.
    pub sample_hz: f64,
    /// Rate at which motion was measured, Hz.
    pub source_hz: f64,
    /// The stretches, each without a gap.
    pub stretches: Vec<UniformStretch>,
    /// What was left out between them.
    pub gaps: Vec<Gap>,
}

/// Regressions gain nothing above this rate: vehicles of a tonne move below 1 Hz.
const HIGHEST_RATE_HZ: f64 = 20.0;

/// A simulation is carried through a gap of motion of so many seconds, or sampling periods: in
/// more, a vehicle forgets what speed it had, and every step costs.
const LONGEST_BRIDGED_S: f64 = 30.0;
const BRIDGED_PERIODS: f64 = 5.0;

/// Velocity is the slope of positions within so many seconds on either side: stamps that are off
/// by part of a sample, and noise, would else be most of it.
const SLOPE_HALF_S: f64 = 0.5;

/// Steps longer than so many sampling periods, and so many seconds, are gaps in motion.
const LONG_STEP_PERIODS: f64 = 5.0;
const LONG_STEP_S: f64 = 1.0;

/// What a [`UniformAxis`] is made of.
pub(crate) struct ReadyAxis {
    pub sample_hz: f64,
    pub source_hz: f64,
    pub stretches: Vec<ReadyStretch>,
    pub gaps: Vec<Gap>,
}

/// A stretch that can be brought to any part of its grid.
pub(crate) struct ReadyStretch {
    /// Its instants.
    pub grid: Grid,
    motion: Motion,
    force: Timed,
}

impl ReadyStretch {
    /// Force and velocity at the instants of a part of the grid.
    ///
    /// # Errors
    /// [`Error::TooShort`] for one instant, if velocity is derived from position;
    /// [`Error::NoVelocity`] without either.
    pub fn on(&self, grid: Grid) -> Result<UniformStretch, Error> {
        let v = self.velocity(grid)?;
        Ok(UniformStretch { grid, tau: self.force(grid), v })
    }

    /// Force around each instant of a part of the grid.
    pub fn force(&self, grid: Grid) -> Vec<f64> {
        self.force.held_means(grid)
    }

    /// Velocity at each instant of a part of the grid.
    ///
    /// # Errors
    /// As [`ReadyStretch::on`].
    pub fn velocity(&self, grid: Grid) -> Result<Vec<f64>, Error> {
        let values = self.motion.series().interpolate(grid);
        match self.motion {
            Motion::Velocity(_) => Ok(values),
            Motion::Position(_) => differentiate(&values, grid.period_s),
            Motion::Acceleration(_) => Err(Error::NoVelocity),
        }
    }

    /// Velocity as it was measured at each instant of a grid; where position was, what leads from
    /// one instant to the next, in the middle between them.
    ///
    /// # Errors
    /// [`Error::NoVelocity`] without either.
    pub fn velocity_between(&self, grid: Grid) -> Result<(Grid, Vec<f64>), Error> {
        let values = self.motion.series().interpolate(grid);
        match self.motion {
            Motion::Velocity(_) => Ok((grid, values)),
            Motion::Position(_) => {
                let slope = |pair: &[f64]| (pair[1] - pair[0]) / grid.period_s;
                let start_s = grid.start_s + 0.5 * grid.period_s;
                let between = Grid { start_s, len: grid.len.saturating_sub(1), ..grid };
                Ok((between, values.windows(2).map(slope).collect()))
            }
            Motion::Acceleration(_) => Err(Error::NoVelocity),
        }
    }
}

impl ReadyAxis {
    /// The stretch with most instants.
    pub fn longest(&self) -> Option<&ReadyStretch> {
        self.stretches.iter().max_by_key(|stretch| stretch.grid.len)
    }
}

impl Motion {
    /// The samples as measured: velocity or position.
    pub fn series(&self) -> &Timed {
        match self {
            Self::Velocity(series) | Self::Position(series) | Self::Acceleration(series) => series,
        }
    }

    /// Another series of the same kind.
    pub(crate) fn with(&self, series: Timed) -> Self {
        match self {
            Self::Velocity(_) => Self::Velocity(series),
            Self::Position(_) => Self::Position(series),
            Self::Acceleration(_) => Self::Acceleration(series),
        }
    }
}

impl AxisRecord {
    /// The part of the record in a span, s; `None` without motion or force in it.
    pub(crate) fn window(&self, [from_s, to_s]: [f64; 2]) -> Option<Self> {
        let cut = |series: &Timed| series.window(from_s, to_s);
        let motion = self.motion.with(cut(self.motion.series())?);
        let tracks = self.thrusters.iter();
        Some(Self {
            force: self.force.window_held(from_s - HISTORY_S, to_s)?,
            thrusters: tracks.filter_map(|track| track.window(from_s - HISTORY_S, to_s)).collect(),
            motion,
            acceleration: self.acceleration.as_ref().and_then(|all| all.window(from_s, to_s)),
            position: self.position.as_ref().and_then(cut),
            cuts: within(&self.cuts, (from_s, to_s)),
            ..self.clone()
        })
    }

    /// How long motion was seen, without gaps, s.
    pub(crate) fn seconds(&self) -> f64 {
        let motion = self.motion.series();
        let gaps = motion.gaps((LONG_STEP_PERIODS * motion.period_s()).max(LONG_STEP_S));
        let lost_s: f64 = gaps.iter().map(|gap| gap.to_s - gap.from_s).sum();
        motion.last_s() - motion.first_s() - lost_s
    }

    /// The record with propellers at rest before its first thrust, if the vehicle still is:
    /// whatever had pushed it before would show.
    pub(super) fn starting_from_rest(self) -> Self {
        let motion = self.motion.series();
        let has_history = self.force.first_s() < motion.first_s() - motion.period_s();
        let Ok(velocity) = self.velocity() else { return self };
        let greatest = velocity.values().iter().fold(0.0_f64, |max, v| max.max(v.abs()));
        let first = &velocity.values()[..velocity.len().min(REST_SAMPLES)];
        let is_at_rest =
            first.iter().sum::<f64>().abs() / (first.len() as f64) < REST_PART * greatest;
        if has_history || !is_at_rest {
            return self;
        }
        let off_before = |track: &ThrusterTrack| ThrusterTrack {
            speed: track.speed.preceded_by(OFF_BEFORE_S, 0.0),
            ..track.clone()
        };
        // Regressions go by the force that was logged; only what lags or comes late asks for
        // what was before.
        Self { thrusters: self.thrusters.iter().map(off_before).collect(), ..self }
    }

    /// The thrusters, or one that stands for them all where only the force is known.
    pub fn tracks(&self) -> Vec<ThrusterTrack> {
        if self.thrusters.is_empty() {
            vec![ThrusterTrack::of_force(1.0, &self.force)]
        } else {
            self.thrusters.clone()
        }
    }

    /// Whether an instrument measures its velocity; else it is derived from position.
    pub(crate) fn measures_velocity(&self) -> bool {
        matches!(self.motion, Motion::Velocity(_))
    }

    /// Whether velocity was measured, or position that it can be derived from.
    pub(crate) fn knows_velocity(&self) -> bool {
        !matches!(self.motion, Motion::Acceleration(_))
    }

    /// Whether thrust was logged so slowly, while it changed, that what it did between samples
    /// matters.
    pub(crate) fn thrust_is_slow(&self) -> bool {
        self.tracks().iter().any(|track| is_coarse(&track.speed))
    }

    /// The same with thrust moved to later.
    pub(crate) fn delayed(&self, delay_s: f64) -> Self {
        Self { force: self.force.shifted(delay_s), ..self.clone() }
    }

    /// The note on gaps of heading in which turns were lost.
    pub(super) fn lost_turns(&self) -> Option<Caveat> {
        let length = |gap: &Gap| gap.to_s - gap.from_s;
        let longest = self.cuts.iter().max_by(|a, b| length(a).total_cmp(&length(b)))?;
        let message = format!(
            "trial `{}`: {} of heading, {:.1} s in all, in which the vehicle may have turned half around or more, the longest from {:.1} to {:.1} s; the number of turns is unknown, so that the record is split there; log rate.yaw beside heading to bridge them",
            self.trial,
            count(self.cuts.len(), "gap", "gaps"),
            self.cuts.iter().map(length).sum::<f64>(),
            longest.from_s,
            longest.to_s
        );
        Some(Caveat::note(CaveatCode::Gaps, message))
    }

    /// Velocity at the times of its own samples: as measured, or the slope of position over
    /// half a second to either side, or to the next samples where those are further away.
    ///
    /// # Errors
    /// [`Error::TooShort`] if it must be derived from fewer than two positions;
    /// [`Error::NoVelocity`] if only acceleration was measured.
    pub fn velocity(&self) -> Result<Timed, Error> {
        let motion = self.motion.series();
        if !matches!(self.motion, Motion::Position(_)) || self.cuts.is_empty() {
            return self.velocity_of(motion);
        }
        let (mut times, mut slopes) = (Vec::new(), Vec::new());
        for part in self.between_cuts(motion).iter().filter(|part| part.len() > 1) {
            times.extend_from_slice(part.time_s());
            slopes.extend_from_slice(self.velocity_of(part)?.values());
        }
        Timed::new("velocity", times, slopes)
    }

    /// [`AxisRecord::velocity`], of motion without cuts; measured or simulated.
    pub(crate) fn velocity_of(&self, motion: &Timed) -> Result<Timed, Error> {
        match self.motion {
            Motion::Velocity(_) => Ok(motion.clone()),
            Motion::Position(_) => slope_around(motion, SLOPE_HALF_S),
            Motion::Acceleration(_) => Err(Error::NoVelocity),
        }
    }

    /// The parts of a position between cuts.
    fn between_cuts(&self, position: &Timed) -> Vec<Timed> {
        let mut from_s = f64::NEG_INFINITY;
        let ends = self.cuts.iter().map(|cut| (cut.from_s, cut.to_s));
        let part = |(to_s, next_s)| position.window(std::mem::replace(&mut from_s, next_s), to_s);
        ends.chain([(f64::INFINITY, f64::INFINITY)]).filter_map(part).collect()
    }

    /// The spans, s, in each of which motion can be followed from one state at the start: without
    /// gaps of force, long gaps of motion, or cuts.
    pub(crate) fn parts(&self) -> Vec<(f64, f64)> {
        let motion = self.motion.series();
        let longest_s = LONGEST_BRIDGED_S.max(BRIDGED_PERIODS * motion.period_s());
        let mut ends = [motion.gaps(longest_s), self.force_gaps(), self.cuts.clone()].concat();
        ends.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
        let (mut parts, mut from_s) = (Vec::new(), motion.first_s());
        for gap in ends {
            if gap.from_s >= from_s {
                parts.push((from_s, gap.from_s));
            }
            from_s = gap.to_s.max(from_s);
        }
        parts.push((from_s, motion.last_s()));
        parts
    }

    /// Force and velocity on uniform grids, cut at gaps of either, each stretch with
    /// at least `least` instants.
    ///
    /// The rate is that of the faster of the two, at most 20 Hz.
    ///
    /// # Errors
    /// [`Error::TooShort`] if no stretch is long enough.
    pub fn uniform(&self, least: usize) -> Result<UniformAxis, Error> {
        let ready = self.ready(least)?;
        let ReadyAxis { sample_hz, source_hz, stretches, gaps } = ready;
        let stretches =
            stretches.iter().map(|ready| ready.on(ready.grid)).collect::<Result<_, _>>()?;
        Ok(UniformAxis { dof: self.dof, sample_hz, source_hz, stretches, gaps })
    }

    /// As [`AxisRecord::uniform`], for reading part by part: a long record on its grids
    /// would be twice as large again.
    pub(crate) fn ready(&self, least: usize) -> Result<ReadyAxis, Error> {
        let motion = self.motion.series();
        let source_hz = rate_hz(motion);
        let sample_hz = source_hz.max(rate_hz(&self.force)).min(HIGHEST_RATE_HZ);
        let least = least.max(LEAST_SAMPLES);
        let Stretches { stretches: found, mut gaps } =
            self.uniform_between_cuts(1.0 / sample_hz, least)?;
        let force_gaps = self.force_gaps();
        let mut stretches = Vec::new();
        for whole in found {
            let motion = self.motion.with(whole.series);
            let parts = without(whole.grid, &force_gaps, least).into_iter();
            stretches.extend(parts.map(|grid| ReadyStretch {
                grid,
                motion: motion.clone(),
                force: self.force.clone(),
            }));
        }
        if stretches.is_empty() {
            let span = ((motion.last_s() - motion.first_s()) * sample_hz) as usize + 1;
            return Err(Error::TooShort {
                name: format!(
                    "trial `{}`, at {sample_hz:.1} Hz and without its gaps, in {}",
                    self.trial, self.dof
                ),
                found: span,
                needed: least,
            });
        }
        gaps.extend(force_gaps);
        gaps.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
        Ok(ReadyAxis { sample_hz, source_hz, stretches, gaps })
    }

    fn uniform_between_cuts(&self, period_s: f64, least: usize) -> Result<Stretches, Error> {
        let motion = self.motion.series();
        if !matches!(self.motion, Motion::Position(_)) || self.cuts.is_empty() {
            return uniform_stretches(motion, period_s, least);
        }
        let mut all = Stretches { stretches: Vec::new(), gaps: self.cuts.clone() };
        for part in self.between_cuts(motion) {
            let Stretches { stretches, gaps } = uniform_stretches(&part, period_s, least)?;
            all.stretches.extend(stretches);
            all.gaps.extend(gaps);
        }
        Ok(all)
    }

    /// Intervals in which thrust was not logged, though it usually is.
    ///
    /// Thrust that is logged when it changes has long intervals by nature, so a gap
    /// is measured against the longest tenth of them.
    pub fn force_gaps(&self) -> Vec<Gap> {
        self.force.gaps(self.force.longest_usual_s())
    }
}

/// The gaps that lie in a window, s.
pub(super) fn within(gaps: &[Gap], (from_s, to_s): (f64, f64)) -> Vec<Gap> {
    gaps.iter().filter(|gap| gap.from_s >= from_s && gap.to_s <= to_s).copied().collect()
}

pub(super) fn rate_hz(series: &Timed) -> f64 {
    let period = series.period_s();
    if period > 0.0 { 1.0 / period } else { 0.0 }
}

/// The parts of a grid outside of gaps that have at least `least` instants.
fn without(grid: Grid, gaps: &[Gap], least: usize) -> Vec<Grid> {
    let mut parts = Vec::new();
    let mut from = 0;
    for gap in gaps {
        let until = ((gap.from_s - grid.start_s) / grid.period_s).floor();
        let next = ((gap.to_s - grid.start_s) / grid.period_s).ceil();
        if next <= from as f64 || until >= grid.len as f64 {
            continue;
        }
        parts.push((from, (until.max(0.0) as usize).min(grid.len)));
        from = (next.max(0.0) as usize).min(grid.len);
    }
    parts.push((from, grid.len));
    parts
        .into_iter()
        .filter(|(from, to)| *to >= from + least)
        .map(|(from, to)| Grid {
            start_s: grid.time(from),
            period_s: grid.period_s,
            len: to - from,
        })
        .collect()
}
