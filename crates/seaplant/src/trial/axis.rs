use super::{LEAST_SAMPLES, ThrusterTrack, count};
use crate::navigation::{MeanAcceleration, Motion};
use crate::signal::{Stretches, differentiate, slope_around, uniform_stretches};
use crate::{Caveat, CaveatCode, Dof, Error, Gap, Grid, Timed};

/// The record of one degree of freedom in one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisRecord {
    /// The degree of freedom.
    pub dof: Dof,
    /// Name of the trial.
    pub trial: String,
    /// Force or moment, each sample held until the next; N or N m.
    pub force: Timed,
    /// The thrusters that produce it; empty if only the force is known.
    pub thrusters: Vec<ThrusterTrack>,
    /// Measured velocity, otherwise position, otherwise acceleration.
    pub motion: Motion,
    /// Measured acceleration, in addition to position or alone; absent if an instrument measures
    /// velocity.
    pub acceleration: Option<MeanAcceleration>,
    /// Change of the measured velocity per metre of lever arm, along the axes of [`lever_axes`];
    /// absent for positions, rotations and logs without attitude.
    pub lever_rates: Option<[Timed; 2]>,
    /// Coriolis acceleration of a rigid body along this axis, `−(ω × v)`, m/s²: r v − q w in surge,
    /// p w − r u in sway, q u − p v in heave; absent in rotations and if the log lacks rotation or
    /// the other velocities.
    pub turning: Option<Timed>,
    /// Measured position along this degree of freedom, if any.
    pub position: Option<Timed>,
    /// Gaps with an unknown offset of position, as of heading after unobserved turns.
    pub cuts: Vec<Gap>,
}

/// Thrust history before the start of a record, s, for delays.
pub(super) const HISTORY_S: f64 = 5.0;

/// Ratio of first to greatest speed below which a vehicle starts from rest …
const REST_PART: f64 = 0.1;
/// … and the number of samples for its first speed.
const REST_SAMPLES: usize = 5;

/// Time without thrust before the first logged thrust of a vehicle at rest, s.
const OFF_BEFORE_S: f64 = 1.0;

/// Returns the two body axes of a velocity sensor's lever arm that affect a translation: (ω × r)
/// has no component from its own axis.
pub const fn lever_axes(dof: Dof) -> Option<[char; 2]> {
    match dof {
        Dof::Surge => Some(['y', 'z']),
        Dof::Sway => Some(['x', 'z']),
        Dof::Heave => Some(['x', 'y']),
        Dof::Roll | Dof::Pitch | Dof::Yaw => None,
    }
}

/// Returns whether the hull's rotation moves the instrument of a motion.
pub(super) const fn is_moved_by_turning(motion: &Motion) -> bool {
    matches!(motion, Motion::Velocity(_))
}

/// Returns the angular velocities that multiply a lever arm along those axes.
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
    /// The degree of freedom.
    pub dof: Dof,
    /// Rate of the grids, Hz.
    pub sample_hz: f64,
    /// Rate at which motion was measured, Hz.
    pub source_hz: f64,
    /// The stretches, each without a gap.
    pub stretches: Vec<UniformStretch>,
    /// Gaps between them.
    pub gaps: Vec<Gap>,
}

/// Highest rate of the grids, Hz: vehicles of a tonne move below 1 Hz.
const HIGHEST_RATE_HZ: f64 = 20.0;

/// Longest gap of motion that a simulation bridges, in seconds or sampling periods, whichever is
/// longer: a longer one has no correlation of velocity, and costs time.
const LONGEST_BRIDGED_S: f64 = 30.0;
const BRIDGED_PERIODS: f64 = 5.0;

/// Half-width of the window for the derivative of position, s, against noise and errors of time
/// stamps.
const SLOPE_HALF_S: f64 = 0.5;

/// Steps longer than this, in sampling periods and in seconds, are gaps in motion.
const LONG_STEP_PERIODS: f64 = 5.0;
const LONG_STEP_S: f64 = 1.0;

/// A [`UniformAxis`] before resampling.
pub(crate) struct ReadyAxis {
    pub sample_hz: f64,
    pub source_hz: f64,
    pub stretches: Vec<ReadyStretch>,
    pub gaps: Vec<Gap>,
}

/// A stretch to be resampled to any part of its grid.
pub(crate) struct ReadyStretch {
    /// Its instants.
    pub grid: Grid,
    motion: Motion,
    force: Timed,
}

impl ReadyStretch {
    /// Returns force and velocity at the instants of a part of the grid.
    ///
    /// # Errors
    /// [`Error::TooShort`] for one instant, if velocity is derived from position;
    /// [`Error::NoVelocity`] without either.
    pub fn on(&self, grid: Grid) -> Result<UniformStretch, Error> {
        let v = self.velocity(grid)?;
        Ok(UniformStretch { grid, tau: self.force(grid), v })
    }

    /// Returns the mean force around each instant of a part of the grid.
    pub fn force(&self, grid: Grid) -> Vec<f64> {
        self.force.held_means(grid)
    }

    /// Returns velocity at each instant of a part of the grid.
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

    /// Returns measured velocity at each instant of a grid, or the difference quotients of measured
    /// position in the middle between instants.
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
    /// Returns the stretch with most instants.
    pub fn longest(&self) -> Option<&ReadyStretch> {
        self.stretches.iter().max_by_key(|stretch| stretch.grid.len)
    }
}

impl Motion {
    /// Returns the measured samples.
    pub fn series(&self) -> &Timed {
        match self {
            Self::Velocity(series) | Self::Position(series) | Self::Acceleration(series) => series,
        }
    }

    /// Returns another series of the same kind.
    pub(crate) fn with(&self, series: Timed) -> Self {
        match self {
            Self::Velocity(_) => Self::Velocity(series),
            Self::Position(_) => Self::Position(series),
            Self::Acceleration(_) => Self::Acceleration(series),
        }
    }
}

impl AxisRecord {
    /// Returns the record in a time window, s; `None` without motion or force in it.
    pub(crate) fn window(&self, [from_s, to_s]: [f64; 2]) -> Option<Self> {
        let cut = |series: &Timed| series.window(from_s, to_s);
        let with_ends = |series: &Timed| {
            let step_s = series.period_s();
            series.window(from_s - step_s, to_s + step_s)
        };
        let motion = self.motion.with(cut(self.motion.series())?);
        let tracks = self.thrusters.iter();
        Some(Self {
            force: self.force.window_held(from_s - HISTORY_S, to_s)?,
            thrusters: tracks.filter_map(|track| track.window(from_s - HISTORY_S, to_s)).collect(),
            motion,
            acceleration: self.acceleration.as_ref().and_then(|all| all.window(from_s, to_s)),
            position: self.position.as_ref().and_then(cut),
            lever_rates: self
                .lever_rates
                .as_ref()
                .and_then(|[first, second]| Some([with_ends(first)?, with_ends(second)?])),
            turning: self.turning.as_ref().and_then(with_ends),
            cuts: within(&self.cuts, (from_s, to_s)),
            ..self.clone()
        })
    }

    /// Returns a velocity without what a lever arm of its sensor adds, m; `None` if the rates of turn are unknown.
    pub(crate) fn without_lever(&self, velocity: &Timed, lever: [f64; 2]) -> Option<Timed> {
        let rates = self.lever_rates.as_ref()?;
        let turning =
            |t: f64| rates.iter().zip(lever).map(|(rate, arm)| arm * rate.at(t)).sum::<f64>();
        let samples = velocity.time_s().iter().zip(velocity.values());
        velocity.with_values("velocity", samples.map(|(t, v)| v - turning(*t)).collect()).ok()
    }

    /// Returns the record with a velocity sensor without this lever arm, m.
    pub(crate) fn with_lever(&self, lever: [f64; 2]) -> Self {
        let motion = match &self.motion {
            Motion::Velocity(velocity) => self.without_lever(velocity, lever).map(Motion::Velocity),
            _ => None,
        };
        Self { motion: motion.unwrap_or_else(|| self.motion.clone()), ..self.clone() }
    }

    /// Returns the duration of measured motion, without gaps, s.
    pub(crate) fn seconds(&self) -> f64 {
        let motion = self.motion.series();
        let gaps = motion.gaps((LONG_STEP_PERIODS * motion.period_s()).max(LONG_STEP_S));
        let lost_s: f64 = gaps.iter().map(|gap| gap.to_s - gap.from_s).sum();
        motion.last_s() - motion.first_s() - lost_s
    }

    /// Returns the record with propellers at rest before its first thrust, if the vehicle is at
    /// rest too: earlier thrust would have moved it.
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
        // Regressions use the logged force; only lag and delay depend on earlier thrust.
        Self { thrusters: self.thrusters.iter().map(off_before).collect(), ..self }
    }

    /// Returns the thrusters, or an equivalent one if only the force is known.
    pub fn tracks(&self) -> Vec<ThrusterTrack> {
        if self.thrusters.is_empty() {
            vec![ThrusterTrack::of_force(1.0, &self.force)]
        } else {
            self.thrusters.clone()
        }
    }

    /// Returns whether an instrument measures its velocity; otherwise it is derived from position.
    pub(crate) fn measures_velocity(&self) -> bool {
        matches!(self.motion, Motion::Velocity(_))
    }

    /// Returns whether velocity was measured, or can be derived from position.
    pub(crate) fn knows_velocity(&self) -> bool {
        !matches!(self.motion, Motion::Acceleration(_))
    }

    /// Returns whether thrust was logged so slowly that its values between samples matter.
    pub(crate) fn thrust_is_slow(&self) -> bool {
        self.tracks().iter().any(ThrusterTrack::is_slow)
    }

    /// Returns whether a supply voltage was logged that no curve accounts for.
    pub(crate) fn has_supply(&self) -> bool {
        self.thrusters.iter().any(|track| track.supply.is_some())
    }

    /// Returns the record with delayed thrust.
    pub(crate) fn delayed(&self, delay_s: f64) -> Self {
        Self { force: self.force.shifted(delay_s), ..self.clone() }
    }

    /// Returns a note on gaps of heading with an unknown number of turns.
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

    /// Returns velocity at the times of its samples: as measured, or the derivative of position
    /// over half a second to either side, or to the next samples if those are further away.
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

    /// Returns [`AxisRecord::velocity`] for measured or simulated motion without cuts.
    pub(crate) fn velocity_of(&self, motion: &Timed) -> Result<Timed, Error> {
        match self.motion {
            Motion::Velocity(_) => Ok(motion.clone()),
            Motion::Position(_) => slope_around(motion, SLOPE_HALF_S),
            Motion::Acceleration(_) => Err(Error::NoVelocity),
        }
    }

    /// Splits a position at the cuts.
    fn between_cuts(&self, position: &Timed) -> Vec<Timed> {
        let mut from_s = f64::NEG_INFINITY;
        let ends = self.cuts.iter().map(|cut| (cut.from_s, cut.to_s));
        let part = |(to_s, next_s)| position.window(std::mem::replace(&mut from_s, next_s), to_s);
        ends.chain([(f64::INFINITY, f64::INFINITY)]).filter_map(part).collect()
    }

    /// Returns the time intervals, s, that can be simulated from one initial state: without gaps of
    /// force, long gaps of motion, or cuts.
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

    /// Resamples force and velocity to uniform grids, cut at gaps of either, each stretch with at
    /// least `least` instants.
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

    /// Prepares [`AxisRecord::uniform`] for reading in parts: a long record on its grids would take
    /// three times the memory.
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

    /// Returns gaps of the thrust log.
    ///
    /// Thrust logged on change has long intervals without a gap, so that the limit follows from the
    /// longest tenth of them.
    pub fn force_gaps(&self) -> Vec<Gap> {
        self.force.gaps(self.force.longest_usual_s())
    }
}

/// Returns the gaps within a window, s.
pub(super) fn within(gaps: &[Gap], (from_s, to_s): (f64, f64)) -> Vec<Gap> {
    gaps.iter().filter(|gap| gap.from_s >= from_s && gap.to_s <= to_s).copied().collect()
}

pub(super) fn rate_hz(series: &Timed) -> f64 {
    let period = series.period_s();
    if period > 0.0 { 1.0 / period } else { 0.0 }
}

/// Returns the parts of a grid outside gaps with at least `least` instants.
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
