//! Finds the manoeuvres of a plan in the forces of logs.
//!
//! A manoeuvre is looked for at every instant at which it may have begun, by the correlation of
//! logged and planned forces on the axes that it drives:
//!
//! ```text
//! r = Σ f x / √(Σ f² Σ x²),   f logged, x planned, each axis over its own root mean square
//! ```
//!
//! The controller that holds the vehicle near its start adds forces of its own, so that r is below 1.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use seaplant::motion::{KnownForce, KnownKind};
use seaplant::{Dof, Motion, Timed, Trial, VelocitySource};

use crate::manoeuvre::Manoeuvre;
use crate::plan::Planned;

/// Sample period of the comparison, s.
const STEP_S: f64 = 0.2;
/// Least length of a block that is compared, s …
const BLOCK_S: f64 = 20.0;
/// … and as a fraction of the manoeuvre's period.
const BLOCK_PART: f64 = 1.0 / 3.0;
/// Least correlation of a block that follows the plan …
const FOLLOWS: f64 = 0.6;
/// … and of all blocks of a stretch together.
const FOLLOWS_TOGETHER: f64 = 0.75;
/// Least duration of a stretch, s, …
const LEAST_S: f64 = 40.0;
/// … and as a fraction of the planned one.
const LEAST_PART: f64 = 0.1;
/// Least fraction of a stretch that follows the plan.
const DENSE: f64 = 0.6;
/// Planned forces below this fraction of their root mean square are a rest.
const REST: f64 = 0.1;
/// Instants at which a manoeuvre may begin, for each of its periods.
const BEGINNINGS: f64 = 60.0;

/// Forces and velocities of a trial.
pub(crate) struct Log {
    pub(crate) trial: String,
    from_s: f64,
    to_s: f64,
    force: BTreeMap<Dof, Timed>,
    velocity: BTreeMap<Dof, Timed>,
    /// Known weights that hung on the vehicle, N.
    weights_n: Vec<f64>,
}

impl Log {
    /// Collects what a trial says of some axes: from the plants of several axes that it serves, and
    /// from its single axes.
    pub(crate) fn new(trial: &Trial, axes: &[Dof]) -> Self {
        let (mut force, mut velocity) = (BTreeMap::new(), BTreeMap::new());
        let of_plants = trial.setup().together.iter().filter_map(|own| trial.record(own).ok());
        for record in of_plants {
            for dof in axes {
                let own = record.force[dof.index()].clone();
                own.into_iter().for_each(|own| _ = force.entry(*dof).or_insert(own));
                let own = record.velocity[dof.index()].clone();
                own.into_iter().for_each(|own| _ = velocity.entry(*dof).or_insert(own));
            }
        }
        for dof in axes {
            let Ok(record) = trial.axis(*dof, VelocitySource::Measured) else { continue };
            force.entry(*dof).or_insert(record.force);
            if let Motion::Velocity(own) = record.motion {
                velocity.entry(*dof).or_insert(own);
            }
        }
        let from_s = force.values().map(Timed::first_s).fold(f64::INFINITY, f64::min);
        let to_s = force.values().map(Timed::last_s).fold(f64::NEG_INFINITY, f64::max);
        let is_weight = |one: &&KnownForce| matches!(one.kind, KnownKind::Weight { .. });
        let weights_n =
            trial.setup().known.iter().filter(is_weight).map(KnownForce::size_n).collect();
        Self { trial: trial.name().to_owned(), from_s, to_s, force, velocity, weights_n }
    }

    pub(crate) fn axes(&self) -> BTreeSet<Dof> {
        self.force.keys().copied().collect()
    }

    /// Returns the least and the greatest velocity of an axis without its extreme samples.
    pub(crate) fn velocity(&self, dof: Dof) -> Option<[f64; 2]> {
        let mut values = self.velocity.get(&dof)?.values().to_vec();
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let left_out = (EXTREME_PART * last as f64) as usize;
        Some([values[left_out], values[last - left_out]])
    }

    fn sampled(&self) -> Sampled {
        let count = ((self.to_s - self.from_s) / STEP_S).max(0.0) as usize;
        let values = |series: &Timed| {
            (0..count).map(|k| series.held_at(self.from_s + k as f64 * STEP_S)).collect()
        };
        let force = self.force.iter().map(|(dof, series)| (*dof, values(series))).collect();
        Sampled { force, is_free: vec![true; count] }
    }
}

/// Fraction of samples that are left out at each end of a range.
const EXTREME_PART: f64 = 0.01;

/// Forces of a trial on a grid, and the samples that no manoeuvre has taken yet.
struct Sampled {
    force: BTreeMap<Dof, Vec<f64>>,
    is_free: Vec<bool>,
}

/// A stretch of a log that follows a manoeuvre.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stretch {
    /// Index of the manoeuvre.
    pub(crate) manoeuvre: usize,
    /// Index of the log.
    pub(crate) log: usize,
    /// Its start and end in the log's time, s.
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
    /// Seconds of it in which forces follow the plan.
    pub(crate) seconds: f64,
    /// Root mean square of logged over planned forces.
    pub(crate) force_ratio: f64,
}

/// Forces of a manoeuvre on a grid, each axis over its root mean square.
struct Template {
    axes: Vec<(Dof, f64, Vec<f64>)>,
    block: usize,
    stride: usize,
    length: usize,
}

impl Template {
    fn new(planned: &Planned) -> Option<Self> {
        let Manoeuvre { waves, period_s, .. } = &planned.manoeuvre;
        let length = (60.0 * planned.minutes / STEP_S).round() as usize;
        let of = |(dof, wave): (&Dof, &crate::wave::Wave)| {
            let values: Vec<f64> = (0..length).map(|k| wave.at(k as f64 * STEP_S)).collect();
            let rms = (values.iter().map(|x| x * x).sum::<f64>() / length as f64).sqrt();
            (rms > 0.0).then(|| (*dof, rms, values.iter().map(|x| x / rms).collect()))
        };
        let axes: Vec<(Dof, f64, Vec<f64>)> = waves.iter().filter_map(of).collect();
        let block_s = BLOCK_S.max(BLOCK_PART * period_s).min(60.0 * planned.minutes);
        let stride = (period_s / BEGINNINGS / STEP_S).round().max(1.0) as usize;
        let block = (block_s / STEP_S).round() as usize;
        (!axes.is_empty() && block > 0).then_some(Self { axes, block, stride, length })
    }

    /// Returns the range of samples of a block.
    fn block(&self, b: usize) -> Range<usize> {
        b * self.block..((b + 1) * self.block).min(self.length)
    }

    fn blocks(&self) -> usize {
        self.length.div_ceil(self.block)
    }
}

/// Sums over a range of samples: logged squared, planned squared, and their product.
#[derive(Clone, Copy, Default)]
struct Sums {
    ff: f64,
    xx: f64,
    fx: f64,
}

impl Sums {
    fn plus(self, other: Self) -> Self {
        Self { ff: self.ff + other.ff, xx: self.xx + other.xx, fx: self.fx + other.fx }
    }

    fn correlation(&self) -> f64 {
        let both = (self.ff * self.xx).sqrt();
        if both > 0.0 { self.fx / both } else { 0.0 }
    }
}

/// The best place of a manoeuvre in a log.
#[derive(Clone)]
struct Match {
    stretch: Stretch,
    samples: Range<usize>,
    score: f64,
}

/// Finds where logs follow manoeuvres; no sample follows two of them.
pub(crate) fn followed(planned: &[Planned], logs: &[Log]) -> Vec<Stretch> {
    let mut found = with_weight(planned, logs);
    let templates: Vec<Option<Template>> = planned.iter().map(Template::new).collect();
    for (l, log) in logs.iter().enumerate() {
        let mut sampled = log.sampled();
        let search = |sampled: &Sampled, m: usize| {
            best(templates[m].as_ref()?, sampled, log.from_s).map(|(stretch, samples, score)| {
                Match { stretch: Stretch { manoeuvre: m, log: l, ..stretch }, samples, score }
            })
        };
        let mut places: Vec<Option<Match>> =
            (0..planned.len()).map(|m| search(&sampled, m)).collect();
        loop {
            let all = places.iter().flatten();
            let longest = all.max_by(|a, b| a.score.total_cmp(&b.score));
            let Some(Match { stretch, samples, .. }) = longest.cloned() else { break };
            sampled.is_free[samples.clone()].fill(false);
            for (m, place) in places.iter_mut().enumerate() {
                let own = place.as_ref().map(|own| own.samples.clone());
                let is_taken =
                    own.is_some_and(|own| own.start < samples.end && samples.start < own.end);
                if is_taken {
                    *place = search(&sampled, m);
                }
            }
            found.push(stretch);
        }
    }
    found
}

/// Returns the trials in which the weight of a manoeuvre hung on the vehicle: hovering has no planned
/// forces.
fn with_weight(planned: &[Planned], logs: &[Log]) -> Vec<Stretch> {
    let of = |(m, one): (usize, &Planned)| {
        let weight = one.manoeuvre.weight?;
        let is_hung = |log: &&Log| {
            log.weights_n.iter().any(|own| (own / weight.weight_n - 1.0).abs() < SAME_WEIGHT)
        };
        let own = move |log: usize, from_s: f64, to_s: f64| {
            let seconds = (to_s - from_s).min(60.0 * one.minutes);
            Stretch { manoeuvre: m, log, from_s, to_s, seconds, force_ratio: 1.0 }
        };
        let (log, found) = logs.iter().enumerate().find(|(_, log)| is_hung(log))?;
        Some(own(log, found.from_s, found.to_s))
    };
    planned.iter().enumerate().filter_map(of).collect()
}

/// Relative difference below which a weight of a log is that of a plan.
const SAME_WEIGHT: f64 = 0.1;

/// Returns the stretch of free samples that follows a manoeuvre longest.
fn best(
    template: &Template,
    sampled: &Sampled,
    from_s: f64,
) -> Option<(Stretch, Range<usize>, f64)> {
    let (length, logged) = (template.length as isize, sampled.is_free.len() as isize);
    let least = template.block as isize;
    let at = |offset: isize| placed(template, sampled, offset);
    let longest = |offsets: &mut dyn Iterator<Item = isize>| {
        let mut best: Option<Found> = None;
        for found in offsets.filter_map(at) {
            if best.as_ref().is_none_or(|best| found.score > best.score) {
                best = Some(found);
            }
        }
        best
    };
    let coarse = longest(&mut (least - length..=logged - least).step_by(template.stride))?;
    let near = template.stride as isize;
    let fine = longest(&mut (coarse.offset - near..=coarse.offset + near))?;
    let Found { samples, seconds, sums, score, .. } = fine;
    let least_s = LEAST_S.max(LEAST_PART * template.length as f64 * STEP_S);
    let is_followed = seconds >= least_s.min(template.length as f64 * STEP_S)
        && sums.correlation() >= FOLLOWS_TOGETHER
        && seconds >= DENSE * samples.len() as f64 * STEP_S;
    is_followed.then(|| {
        let stretch = Stretch {
            manoeuvre: 0,
            log: 0,
            from_s: from_s + samples.start as f64 * STEP_S,
            to_s: from_s + samples.end as f64 * STEP_S,
            seconds,
            force_ratio: (sums.ff / sums.xx).sqrt(),
        };
        (stretch, samples, score)
    })
}

/// Blocks that follow a manoeuvre which begins at an offset from the log's first sample.
struct Found {
    offset: isize,
    samples: Range<usize>,
    seconds: f64,
    sums: Sums,
    /// Followed seconds times their correlation: of two offsets a period apart the longer one, of
    /// two close ones the better one.
    score: f64,
}

/// Returns the part of a block that the log contains, in the template's samples and in its own; half
/// of a block at least, and nothing that another manoeuvre has taken.
fn logged_part(
    block: Range<usize>,
    offset: isize,
    sampled: &Sampled,
) -> Option<(Range<usize>, Range<usize>)> {
    let logged = sampled.is_free.len() as isize;
    let start = (block.start as isize + offset).clamp(0, logged);
    let end = (block.end as isize + offset).clamp(0, logged);
    let own = usize::try_from(start).ok()?..usize::try_from(end).ok()?;
    let planned = usize::try_from(start - offset).ok()?..usize::try_from(end - offset).ok()?;
    let is_free = 2 * own.len() >= block.len() && sampled.is_free[own.clone()].iter().all(|x| *x);
    is_free.then_some((planned, own))
}

fn placed(template: &Template, sampled: &Sampled, offset: isize) -> Option<Found> {
    let (mut ends, mut seconds, mut sums) = (None, 0.0, Sums::default());
    let mut is_before = false;
    for b in 0..template.blocks() {
        let Some((range, own)) = logged_part(template.block(b), offset, sampled) else {
            is_before = false;
            continue;
        };
        let of_block = summed(template, sampled, &range, &own);
        let samples = (range.len() * template.axes.len()) as f64;
        let is_rest = of_block.xx < REST * REST * samples;
        // A rest belongs to what was driven before it.
        let follows = match is_rest {
            true => is_before && of_block.ff < REST * samples,
            false => of_block.correlation() >= FOLLOWS,
        };
        is_before = follows;
        if follows {
            let start = ends.map_or(own.start, |(start, _)| start);
            ends = Some((start, own.end));
            seconds += range.len() as f64 * STEP_S;
            sums = sums.plus(of_block);
        }
    }
    let (start, end) = ends?;
    let score = seconds * sums.correlation();
    Some(Found { offset, samples: start..end, seconds, sums, score })
}

fn summed(
    template: &Template,
    sampled: &Sampled,
    planned: &Range<usize>,
    logged: &Range<usize>,
) -> Sums {
    let mut sums = Sums::default();
    for (dof, rms, values) in &template.axes {
        let x = &values[planned.clone()];
        let Some(force) = sampled.force.get(dof) else {
            sums.xx += x.iter().map(|x| x * x).sum::<f64>();
            continue;
        };
        for (f, x) in force[logged.clone()].iter().zip(x) {
            let f = f / rms;
            sums = sums.plus(Sums { ff: f * f, xx: x * x, fx: f * x });
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manoeuvre::Kind;
    use crate::wave::Wave;
    use crate::weight::HungWeight;

    fn planned(name: &str, waves: Vec<(Dof, Wave)>, period_s: f64, minutes: f64) -> Planned {
        let manoeuvre = Manoeuvre {
            name: name.to_owned(),
            kind: Kind::Multisine,
            axes: waves.iter().map(|(dof, _)| *dof).collect(),
            period_s,
            waves: waves.into_iter().collect(),
            opposing: None,
            weight: None,
            hold_rad_s: [0.0; 6],
        };
        Planned {
            manoeuvre,
            minutes,
            share: 0.5,
            velocity: BTreeMap::new(),
            limited_by: String::new(),
            words: String::new(),
        }
    }

    fn library() -> Vec<Planned> {
        let surge = |seed| Wave::multisine(20.0, 20.0, &[1, 2, 3, 4], seed);
        let doublet =
            Wave::Steps { steps: vec![[0.0, 5.0], [12.0, -5.0], [24.0, 0.0]], period_s: 30.0 };
        vec![
            planned("one", vec![(Dof::Surge, surge(1))], 20.0, 2.0),
            planned("other", vec![(Dof::Surge, surge(2))], 20.0, 2.0),
            planned("turn", vec![(Dof::Yaw, doublet)], 30.0, 2.0),
        ]
    }

    /// A log of forces by axis, every 0.1 s.
    fn log(length_s: f64, force: impl Fn(Dof, f64) -> f64) -> Log {
        let times: Vec<f64> = (0..(10.0 * length_s) as usize).map(|k| 0.1 * k as f64).collect();
        let series = |dof: Dof| {
            let values: Vec<f64> = times.iter().map(|t| force(dof, *t)).collect();
            (dof, Timed::new("force", times.clone(), values).expect("increasing"))
        };
        let force = [Dof::Surge, Dof::Yaw].map(series).into();
        let to_s = times[times.len() - 1];
        Log {
            trial: "all".to_owned(),
            from_s: 0.0,
            to_s,
            force,
            velocity: BTreeMap::new(),
            weights_n: Vec::new(),
        }
    }

    /// A hover has no planned forces: it was driven where its weight hung on the vehicle.
    #[test]
    fn a_hover_is_found_by_its_weight() {
        let mut hover = planned("hover", Vec::new(), 120.0, 3.0);
        let weight = HungWeight { weight_n: 20.0, mass_kg: 2.5, position_m: [0.0; 3] };
        hover.manoeuvre.weight = Some(weight);
        let of = |weights_n: Vec<f64>| Log { weights_n, ..log(200.0, |_, _| 0.1) };
        let logs = [of(vec![]), of(vec![35.0]), of(vec![20.4, 20.4])];
        let found = followed(&[hover], &logs);
        assert_eq!(found.iter().map(|one| (one.manoeuvre, one.log)).collect::<Vec<_>>(), [(0, 2)]);
        assert!((found[0].seconds - 180.0).abs() < 1e-9, "{:?}", found[0]);
    }

    /// One log: 90 s of the second manoeuvre from 30 s on, then the third from 150 s on, and none of
    /// the first.
    #[test]
    fn manoeuvres_are_found_in_one_log_where_they_were_driven() {
        let plan = library();
        let wave = |k: usize, dof: Dof| plan[k].manoeuvre.waves[&dof].clone();
        let (surge, yaw) = (wave(1, Dof::Surge), wave(2, Dof::Yaw));
        let log = log(300.0, |dof, t| match dof {
            Dof::Surge if (30.0..120.0).contains(&t) => 0.8 * surge.at(t - 30.0) + 1.0,
            Dof::Yaw if (150.0..270.0).contains(&t) => yaw.at(t - 150.0) + 0.3,
            _ => 0.2,
        });
        let mut found = followed(&plan, &[log]);
        found.sort_by_key(|stretch| stretch.manoeuvre);
        assert_eq!(found.iter().map(|one| one.manoeuvre).collect::<Vec<_>>(), [1, 2]);
        let (surge, turn) = (&found[0], &found[1]);
        assert!(
            (surge.from_s - 30.0).abs() < 0.5 && (surge.seconds - 90.0).abs() < 15.0,
            "{surge:?}"
        );
        assert!((surge.force_ratio - 0.8).abs() < 0.05, "{surge:?}");
        assert!(
            (turn.from_s - 150.0).abs() < 0.5 && (turn.seconds - 120.0).abs() < 1.0,
            "{turn:?}"
        );
    }

    #[test]
    fn a_manoeuvre_that_is_driven_twice_counts_twice_and_other_driving_does_not() {
        let plan = library();
        let wave = plan[0].manoeuvre.waves[&Dof::Surge].clone();
        let twice = log(300.0, |dof, t| match dof {
            Dof::Surge if t < 120.0 => wave.at(t),
            Dof::Surge if t > 170.0 => wave.at(t - 170.0),
            _ => 0.0,
        });
        let found = followed(&plan, &[twice]);
        let seconds: f64 = found.iter().map(|one| one.seconds).sum();
        assert!(found.iter().all(|one| one.manoeuvre == 0), "{found:?}");
        assert!((seconds - 240.0).abs() < 12.0, "{seconds}");
        let joystick = Wave::joystick(20.0, [3.0, 9.0], 5);
        let found = followed(&plan, &[log(300.0, |_, t| joystick.at(t))]);
        let seconds: f64 = found.iter().map(|one| one.seconds).sum();
        assert!(seconds < 45.0, "{found:?}");
    }
}
