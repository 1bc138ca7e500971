//! Compares predicted intervals of plans with those of fits, over vehicles drawn at random.
//!
//! ```sh
//! cargo run -p seaplant-plan --example promises -- 12 0   # vehicles, and the first seed
//! ```
//!
//! The prior of each vehicle comes from hull formulas. Its plan is driven twice: by the prior's
//! plant, and by a plant drawn from the prior. A plan for the prior's plant alone, which no spread
//! makes uncertain, is driven by that plant. The logs are fitted by the filter error method; the
//! standard deviations of the fits are divided by those that the plan predicted, of the prior's plant or in the mean over
//! plants, both in SI units.

mod vehicles;

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use seaplant::estimate::fit_plant;
use seaplant::{Role, TrialRecord, TrialSetup, Vehicle};
use seaplant_plan::{Kind, Plan, Prior, Rehearsal, Request, plan, rehearse};

use vehicles::vehicle;

type Failure = Box<dyn std::error::Error>;

/// Half of a 95 % interval in standard deviations.
const HALF_95: f64 = 1.959_964;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n => 0.5 * (values[(n - 1) / 2] + values[n / 2]),
    }
}

/// Ratios of fitted to predicted uncertainty.
#[derive(Default)]
struct Tally {
    /// Fitted over predicted standard deviations.
    ratios: Vec<f64>,
    /// Errors over fitted standard deviations.
    errors: Vec<f64>,
    /// Whether a fitted interval is within the promised range, and the ratio of that range's ends.
    ranged: Vec<(bool, f64)>,
}

impl Tally {
    fn line(&self, of: &str) -> String {
        let n = self.ratios.len() as f64;
        let part = |count: usize| 100.0 * count as f64 / n;
        let near = self.ratios.iter().filter(|ratio| (**ratio - 1.0).abs() <= 0.2).count();
        let inside = self.errors.iter().filter(|error| error.abs() < HALF_95).count();
        let rms = (self.errors.iter().map(|x| x * x).sum::<f64>() / n).sqrt();
        let mut sorted = self.ratios.clone();
        sorted.sort_by(f64::total_cmp);
        let at = |part: f64| sorted[(part * (n - 1.0)).round() as usize];
        format!(
            "{of}: {n} coefficients; stated over promised: median {:.2}, 5 to 95 % from {:.2} to {:.2}, {:.0} % within 20 %; \
             {:.0} % within the promised range, whose ends have a ratio of {:.2} in the median; \
             errors over stated: rms {rms:.2}, {:.0} % of intervals include the truth",
            at(0.5),
            at(0.05),
            at(0.95),
            part(near),
            part(self.ranged.iter().filter(|(is_within, _)| *is_within).count()),
            median(self.ranged.iter().map(|(_, ratio)| *ratio).collect()),
            part(inside)
        )
    }

    fn add(&mut self, other: Self) {
        self.ratios.extend(other.ratios);
        self.errors.extend(other.errors);
        self.ranged.extend(other.ranged);
    }
}

/// Drives a plan and fits its logs.
fn driven(
    prior: &Prior,
    vehicle: &Vehicle,
    made: &Plan,
    rehearsal: Rehearsal,
) -> Result<Tally, Failure> {
    let dive = rehearse(prior, vehicle, made, rehearsal)?;
    let fitted = dive.trials.iter().filter(|trial| trial.role == Role::Fit);
    let records: Vec<TrialRecord> = fitted
        .map(|trial| {
            let setup = TrialSetup { name: trial.name.clone(), ..TrialSetup::default() };
            TrialRecord::new(&setup, &trial.recording, &dive.vehicle, &made.axes)
        })
        .collect::<Result<_, _>>()?;
    let all: Vec<&TrialRecord> = records.iter().collect();
    let structure = dive.together[0].structure(&dive.vehicle, |_| false)?;
    let fit = fit_plant(&structure, &all, None, false)?;
    let truth = dive.truth.vehicle.map(|own| own.coefficients).unwrap_or_default();
    let names = fit.plant.structure().names();
    let mut tally = Tally::default();
    for forecast in &made.coefficients {
        let Some(at) = names.iter().position(|name| *name == forecast.name) else { continue };
        let std = fit.covariance[(at, at)].sqrt();
        let promised = if rehearsal.is_believed { forecast.as_believed } else { forecast.after };
        tally.ratios.push(std * HALF_95 / promised);
        if let Some([low, high]) = forecast.range90 {
            let half = std * HALF_95;
            tally.ranged.push((half >= low && half <= high, high / low));
        }
        tally.errors.push((fit.plant.coefficients()[at] - truth[&forecast.name]) / std);
    }
    Ok(tally)
}

#[allow(clippy::print_stdout, reason = "an example that prints a table")]
fn main() -> Result<(), Failure> {
    let numbers: Vec<u64> =
        std::env::args().skip(1).map(|text| text.parse()).collect::<Result<_, _>>()?;
    let count = numbers.first().copied().unwrap_or(6);
    let first = numbers.get(1).copied().unwrap_or(0);
    let [mut believed, mut drawn, mut known] =
        [Tally::default(), Tally::default(), Tally::default()];
    let mut gap = 0.0_f64;
    let mut checked: BTreeMap<usize, [usize; 2]> = BTreeMap::new();
    let mut factors: BTreeMap<Kind, Vec<f64>> = BTreeMap::new();
    for k in first..first + count {
        let vehicle = vehicle(&mut ChaCha8Rng::seed_from_u64(k), (k % 3) as usize)?;
        let prior = Prior::of_vehicle(&vehicle, &[])?;
        let request = Request {
            minutes: Some(12.0),
            checks: 60,
            compare: true,
            seed: k + 1,
            ..Request::default()
        };
        let began = std::time::Instant::now();
        let made = plan(&prior, &vehicle, &request)?;
        let seconds = began.elapsed().as_secs_f64();
        println!(
            "{k}: {} axes, {:.0} kg, {} min, planned in {seconds:.1} s, gap {:.2} %, {} of {} runs broke a limit, at most {:.2} of {}",
            made.axes.len(),
            vehicle.dry_mass_kg.unwrap_or_default(),
            made.minutes,
            100.0 * made.certificate.gap,
            made.check.broken,
            made.check.runs,
            made.check.greatest,
            made.check.of
        );
        let needed = made.minutes_needed.map(|minutes| format!("{minutes:.1}"));
        println!(
            "   goals need {} min, unplanned {:.1?}",
            needed.unwrap_or_default(),
            made.unplanned
        );
        let alone = Request { draws: 1, checks: 0, compare: false, ..request };
        let alone = plan(&prior, &vehicle, &alone)?;
        for (of, made, is_believed, sum) in [
            ("believed plant", &made, true, &mut believed),
            ("drawn plant", &made, false, &mut drawn),
            ("known plant", &alone, true, &mut known),
        ] {
            let rehearsal = Rehearsal { seed: k, hold_out_s: 0.0, is_believed };
            match driven(&prior, &vehicle, made, rehearsal) {
                Ok(own) => {
                    println!("   {}", own.line(of));
                    sum.add(own);
                }
                Err(error) => println!("   {of}: {error}"),
            }
        }
        for (kind, minutes) in &made.unplanned {
            // Infinite for a plan that never reaches the goals.
            let minutes = minutes.unwrap_or(f64::INFINITY);
            if let Some(needed) = made.minutes_needed {
                factors.entry(*kind).or_default().push(minutes / needed);
            }
        }
        gap = gap.max(made.certificate.gap);
        let [broken, runs] = checked.entry(made.axes.len()).or_default();
        *broken += made.check.broken;
        *runs += made.check.runs;
    }
    println!("{}", believed.line("believed plants"));
    println!("{}", drawn.line("drawn plants"));
    println!("{}", known.line("known plants"));
    for (kind, factors) in factors {
        let count = factors.len();
        println!("{}: {:.1} times the minutes (median of {count})", kind.name(), median(factors));
    }
    for (axes, [broken, runs]) in checked {
        println!("{axes} axes: limits broken in {broken} of {runs} runs");
    }
    println!("largest certified gap {:.2} %", 100.0 * gap);
    Ok(())
}
