//! Measurements that no vehicle makes.

use crate::estimate::plant_fit::Fitted;
use crate::estimate::plant_fit::filter::Innovation;
use crate::series::median;
use crate::{Error, Timed, TrialRecord};

/// A sample as many standard deviations of the noise from the median of its neighbours, and as many usual
/// steps from one sample to the next, is wild.
const WILD: f64 = 8.0;

const WILD_STEPS: f64 = 5.0;

/// Samples of which the middle one is compared with their median.
const NEIGHBOURS: usize = 5;

/// Above this part of all samples they are no spikes but the noise of the instrument.
const MOST_SPIKES: f64 = 0.05;

/// An error of prediction beyond this many of its standard deviations may be that of a spike.
const SUSPECT: f64 = 4.0;

/// Returns records without samples that are far from the median of their neighbours, and how many those were.
pub(super) fn without_wild_samples(
    records: Vec<TrialRecord>,
) -> Result<(Vec<TrialRecord>, usize), Error> {
    let mut count = 0;
    let clean = |record: TrialRecord| {
        let series = record.measured_alone();
        let wild = series.map(wild).unwrap_or_default();
        count += wild.len();
        record.without_samples(&wild)
    };
    let clean = records.into_iter().map(clean).collect::<Result<_, Error>>()?;
    Ok((clean, count))
}

/// Returns the times of samples that are far from the median of their neighbours.
fn wild(series: &Timed) -> Vec<f64> {
    let half = NEIGHBOURS / 2;
    let off: Vec<(f64, f64)> = series
        .values()
        .windows(NEIGHBOURS)
        .zip(&series.time_s()[half..])
        .filter_map(|(own, t)| Some((*t, (own[half] - median(&mut own.to_vec())?).abs())))
        .collect();
    let mut sizes: Vec<f64> = off.iter().map(|(_, size)| *size).collect();
    let mut steps: Vec<f64> =
        series.values().windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let (Some(size), Some(step)) = (median(&mut sizes), median(&mut steps)) else {
        return Vec::new();
    };
    let limit = (WILD * size / NORMAL_MEDIAN).max(WILD_STEPS * step);
    let found: Vec<f64> = off.iter().filter(|(_, x)| *x > limit).map(|(t, _)| *t).collect();
    if found.len() as f64 > MOST_SPIKES * series.len() as f64 { Vec::new() } else { found }
}

/// Median of the size of a normal number, in standard deviations.
const NORMAL_MEDIAN: f64 = 0.6745;

/// Returns records without spikes: samples far from what was predicted, of which the next is where it would be
/// without them, and how many those were.
///
/// A filter takes a part K of an error over into its next prediction. After a spike e the next error is −K e;
/// after a jump of the vehicle it is (1 − K) e. Halfway decides.
pub(super) fn without_spikes(
    fitted: &Fitted,
    records: &[&TrialRecord],
) -> Result<(Vec<TrialRecord>, usize), Error> {
    let (problem, optimum) = fitted.parts();
    let found = problem.innovations(&optimum.point)?;
    let mut by_trial = vec![Vec::new(); records.len()];
    for (schedule, own) in problem.schedules.iter().zip(&found) {
        // Where acceleration was measured, errors of its means stand for those of the axis.
        if records[schedule.trial].acceleration.iter().any(Option::is_some) {
            continue;
        }
        let own: Vec<&Innovation> = own.iter().filter(|own| own.axis.is_some()).collect();
        let noise = optimum.point.noise.logarithms();
        let spikes = own.windows(2).filter(|pair| {
            let [now, next] = [pair[0], pair[1]];
            let gain = 1.0 - (2.0 * noise[now.number]).exp() / now.variance;
            now.normalised().abs() > SUSPECT && next.error / now.error < 0.5 - gain
        });
        let times: Vec<f64> =
            spikes.map(|pair| schedule.instants[pair[0].instant].time_s).collect();
        if times.len() as f64 <= MOST_SPIKES * own.len() as f64 {
            by_trial[schedule.trial].extend(times);
        }
    }
    let count = by_trial.iter().map(Vec::len).sum();
    let clean = records
        .iter()
        .zip(&by_trial)
        .map(|(record, times)| (*record).clone().without_samples(times));
    Ok((clean.collect::<Result<_, Error>>()?, count))
}
