//! Detection of users' mistakes in the logs: signs, exchanged channels, frames, mounting, units.
//!
//! Each mistake is a change of the log. Least squares on the equation of motion, with coefficients
//! of physically possible sign, yields the share of the change of velocity that the forces explain
//! with and without it. It needs no filter and no initial values, and takes a fraction of a second.

mod angles;
mod change;
mod instruments;
mod units;
mod weak;

use change::{Change, view};
use weak::{Explained, Settings, View, choose_settings, explained};

use crate::trial::{Logged, Miswired};
use crate::{Caveat, CaveatCode, Dof, Role, Trial, Vehicle};

/// A mistake that explains the logs, and its correction.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mistake {
    /// The axes whose motion it explains.
    pub(crate) axes: Vec<Dof>,
    /// Description, improvement, and the line to change.
    pub(crate) message: String,
    /// The thrusters that do not follow their own log, if it is that.
    pub(crate) thrusters: Option<Miswired>,
}

impl Mistake {
    /// Returns the mistake as a caveat of plants.
    pub(crate) fn caveat(&self) -> Caveat {
        Caveat::severe(CaveatCode::LikelyMistake, self.message.clone())
    }
}

/// A change is reported if it reduces the unexplained variance to below this fraction, as a product
/// over all axes: without a mistake no change reduces it to below 0.9 …
const MUCH_BETTER: f64 = 0.4;
/// … in one axis to below this fraction, …
const BETTER: f64 = 0.6;
/// … and to below this fraction of the variance, so that forces explain most of the motion; …
const EXPLAINS: f64 = 0.5;
/// … in no axis increases it by more than this factor, which chance may do if little is explained;
/// …
const NOT_WORSE: f64 = 2.0;
/// … and increases log-likelihood by this much: for one parameter, chance does so in one of a
/// million logs, and some dozens of changes are tested.
///
/// In waves, forces explain little of the motion. A change is then reported that is as sure in one axis and in all
/// together, if a force pushes that axis with it and does not as logged.
const SURE: f64 = 25.0;

/// An axis is listed as explained by a change that reduces its unexplained variance to below this
/// fraction.
const NOTICED: f64 = 0.8;

/// Other changes are listed if their product of unexplained variances is at most this factor
/// greater.
const AS_GOOD: f64 = 1.3;

/// Penalty per changed channel, in log of unexplained variance.
const PRICE: f64 = 0.05;

/// Largest number of mistakes to search.
const MOST: usize = 3;

/// Finds the mistakes that explain the logs of fitted trials.
pub(crate) fn mistakes(vehicle: &Vehicle, trials: &[Trial]) -> Vec<Mistake> {
    let logs = fitted_logs(trials);
    let Some(bench) = Bench::new(&logs) else {
        return instruments::mistakes(&logs, &vehicle.sensors, &[]);
    };
    let Found { mistakes, changes, axes } = bench.search(vehicle);
    let reversed = |dof: &Dof| {
        changes.iter().any(|change| matches!(change, Change::Reversed(axes) if axes.contains(dof)))
    };
    let is_right = |(dof, found): &&AxisFit| found.unexplained < EXPLAINS && !reversed(dof);
    let right: Vec<Dof> = axes.iter().filter(is_right).map(|(dof, _)| *dof).collect();
    let mut all = instruments::mistakes(&logs, &vehicle.sensors, &right);
    all.extend(mistakes);
    all.extend(units::far_thruster(vehicle));
    all.extend(units::mistakes(vehicle, &logs, &axes));
    all
}

/// Finds the translations along which least squares gives a vehicle less mass than it has in air: thrust is of another
/// unit or scale there.
pub(crate) fn light_translations(dry_kg: f64, trials: &[Trial]) -> Vec<Dof> {
    let logs = fitted_logs(trials);
    Bench::new(&logs).map_or_else(Vec::new, |bench| units::light(dry_kg, &bench.axes(&[])))
}

fn fitted_logs(trials: &[Trial]) -> Vec<&Logged> {
    let fitted = trials.iter().filter(|trial| trial.role() == Role::Fit);
    fitted.filter_map(Trial::logged).collect()
}

/// Finds the mistakes that are certain whatever a plant predicts, as it may predict well in a wrong unit:
/// thrusters outside the vehicle, and a unit of vertical velocity that depth contradicts. `heave_kg` is the
/// mass of a plant in heave.
pub(crate) fn certain(vehicle: &Vehicle, trials: &[Trial], heave_kg: Option<f64>) -> Vec<Mistake> {
    let dry_kg = units::mass_in_air(vehicle);
    let of_velocity = instruments::unit_of_velocity(&fitted_logs(trials), heave_kg, dry_kg);
    units::far_thruster(vehicle).into_iter().chain(of_velocity).collect()
}

/// The result of a search.
struct Found {
    mistakes: Vec<Mistake>,
    changes: Vec<Change>,
    /// The unexplained variance with all of them.
    axes: Vec<AxisFit>,
}

/// The unexplained variance of an axis.
type AxisFit = (Dof, Explained);

/// The unexplained variance of an axis without a change and with it.
#[derive(Clone, Copy)]
struct Pair<'a> {
    as_is: &'a Explained,
    with: &'a Explained,
    /// Factor of the unexplained variance.
    times: f64,
}

impl Pair<'_> {
    /// Returns the increase of log-likelihood.
    fn likelihood(&self) -> f64 {
        -0.5 * self.as_is.windows as f64 * self.times.ln()
    }

    fn is_better(&self) -> bool {
        self.times < BETTER && self.with.unexplained < EXPLAINS
    }

    fn pushes(&self) -> bool {
        self.as_is.alpha == 0.0 && self.with.alpha > 0.0 && self.likelihood() > SURE
    }
}

/// Returns the pairs of all axes.
///
/// If a heading turns the velocity, a wrong one makes it turn about, which kinematics explains well: then the
/// variance itself counts, not its share of that of the turned velocity, as turning does not change speed.
fn pairs<'a>(as_is: &'a [AxisFit], with: &'a [AxisFit], change: &Change) -> Vec<Pair<'a>> {
    let is_turned = |dof: &Dof| change.turns() && !dof.is_rotation();
    let pair = |((dof, as_is), (_, with)): (&'a AxisFit, &'a AxisFit)| {
        let share = with.unexplained / as_is.unexplained;
        let times = if is_turned(dof) { share * with.variation / as_is.variation } else { share };
        Pair { as_is, with, times }
    };
    as_is.iter().zip(with).map(pair).collect()
}

/// Returns the decrease of log unexplained variance, summed over all axes.
fn worth(pairs: &[Pair]) -> f64 {
    -pairs.iter().map(|pair| pair.times.ln()).sum::<f64>()
}

/// Returns whether a change explains the logs well enough to be reported.
fn is_sure(pairs: &[Pair]) -> bool {
    let is_much_better = || worth(pairs) > -MUCH_BETTER.ln() && pairs.iter().any(Pair::is_better);
    (is_much_better() || pairs.iter().any(Pair::pushes))
        && pairs.iter().all(|pair| pair.times < NOT_WORSE)
        && pairs.iter().map(Pair::likelihood).sum::<f64>() > SURE
}

/// The logs, and the test functions of each axis.
struct Bench<'a> {
    logs: &'a [&'a Logged],
    settings: Vec<(Dof, Settings)>,
}

impl<'a> Bench<'a> {
    fn new(logs: &'a [&'a Logged]) -> Option<Self> {
        // No sign and no exchange changes what all terms explain, but a wrong heading leaves nothing of a velocity.
        let turning = Change::all(logs).into_iter().filter(Change::turns).map(|one| vec![one]);
        let as_is_or_turned = std::iter::once(Vec::new()).chain(turning);
        let views_of = |changes: Vec<Change>| -> Vec<View> {
            logs.iter().map(|log| view(log, &changes)).collect()
        };
        let views: Vec<Vec<View>> = as_is_or_turned.map(views_of).collect();
        let with_settings = |dof: &Dof| {
            let found =
                views.iter().filter_map(|views| choose_settings(&on_axis(logs, views, *dof), *dof));
            let best = found.min_by(|a, b| a.1.unexplained.total_cmp(&b.1.unexplained));
            Some((*dof, best?.0))
        };
        let settings: Vec<(Dof, Settings)> = Dof::ALL.iter().filter_map(with_settings).collect();
        (!settings.is_empty()).then_some(Self { logs, settings })
    }

    /// Searches the changes that explain the logs clearly better, the best first, and returns what
    /// they leave unexplained.
    fn search(&self, vehicle: &Vehicle) -> Found {
        let all = Change::all(self.logs);
        let (mut made, mut found) = (Vec::<Change>::new(), Vec::new());
        let mut as_is = self.axes(&made);
        while found.len() < MOST {
            let tried = |change: &Change| {
                let with: Vec<Change> = made.iter().chain([change]).cloned().collect();
                let axes = self.axes(&with);
                let pairs = pairs(&as_is, &axes, change);
                if as_is.len() != axes.len() || !is_sure(&pairs) {
                    return None;
                }
                let worth = worth(&pairs) - PRICE * change.channels() as f64;
                Some((change.clone(), axes, worth))
            };
            let mut tried: Vec<(Change, Vec<AxisFit>, f64)> =
                all.iter().filter_map(tried).collect();
            tried.sort_by(|a, b| b.2.total_cmp(&a.2));
            let Some((best, axes, worth)) = tried.first().cloned() else { break };
            let is_as_good =
                |(_, _, other): &&(Change, Vec<AxisFit>, f64)| *other > worth - AS_GOOD.ln();
            let others: Vec<&Change> =
                tried.iter().skip(1).filter(is_as_good).map(|(change, ..)| change).collect();
            found.push(self.mistake(vehicle, &best, &others, [&as_is, &axes]));
            made.push(best);
            as_is = axes;
        }
        Found { mistakes: found, changes: made, axes: as_is }
    }

    /// Returns the unexplained variance of each axis with changes.
    fn axes(&self, changes: &[Change]) -> Vec<AxisFit> {
        let views: Vec<View> = self.logs.iter().map(|log| view(log, changes)).collect();
        let fit_of = |(dof, settings): &(Dof, Settings)| {
            Some((*dof, explained(&on_axis(self.logs, &views, *dof), *dof, *settings)?))
        };
        self.settings.iter().filter_map(fit_of).collect()
    }

    fn mistake(
        &self,
        vehicle: &Vehicle,
        change: &Change,
        others: &[&Change],
        [as_is, with]: [&[AxisFit]; 2],
    ) -> Mistake {
        let of_axes = pairs(as_is, with, change);
        let mut better: Vec<(Dof, Pair)> = as_is
            .iter()
            .zip(of_axes)
            .map(|((dof, _), pair)| (*dof, pair))
            .filter(|(_, pair)| pair.times < NOTICED)
            .collect();
        better.sort_by(|a, b| a.1.times.total_cmp(&b.1.times));
        let part =
            |explained: &Explained| format!("{:.0} %", 100.0 * (1.0 - explained.unexplained));
        let said = |(dof, pair): &(Dof, Pair)| {
            if change.turns() && !dof.is_rotation() {
                let times = format!("{:.1} %", 100.0 * pair.times);
                return format!(
                    "all but {times} of the changes of {dof} velocity that it does not explain as logged"
                );
            }
            let (with, as_is) = (part(pair.with), part(pair.as_is));
            format!("{with} of the changes of {dof} velocity in place of {as_is}")
        };
        let most: Vec<String> = better.iter().take(2).map(said).collect();
        let advice = |change: &Change| change.advice(self.logs, &vehicle.sensors);
        let mut message = format!(
            "{}: if so, least squares explains {}; {}",
            change.words(self.logs),
            most.join(", and "),
            advice(change)
        );
        for other in others.iter().take(2) {
            message += &format!(
                "; or {}, which explains as much: {}",
                other.words(self.logs),
                advice(other)
            );
        }
        let mut axes: Vec<Dof> = better.iter().map(|(dof, ..)| *dof).collect();
        axes.sort();
        let thrusters = match change {
            Change::Thrusters(which) => Some(which.clone()),
            _ => None,
        };
        Mistake { axes, message, thrusters }
    }
}

/// Returns the views of the trials that identify an axis.
fn on_axis<'v>(logs: &[&Logged], views: &'v [View], dof: Dof) -> Vec<&'v View> {
    let both = logs.iter().zip(views);
    both.filter(|(log, _)| log.axes.contains(&dof)).map(|(_, view)| view).collect()
}
