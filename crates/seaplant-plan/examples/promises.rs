//! What plans promise and what fits obtain, over vehicles drawn at random.
//!
//! ```sh
//! cargo run --release -p seaplant-plan --example promises -- 12   # so many vehicles
//! ```
//!
//! Each vehicle is believed by hull formulas; the one that drives has a plant drawn from that belief. Its
//! logs are fitted by the filter error method, and the standard deviations that the fit states are set
//! beside those that the plan promised, both as parts of the coefficient.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use seaplant::estimate::fit_coupled;
use seaplant::{
    CoupledRecord, QuadraticThrust, Role, ThrustCurve, Thruster, ThrusterInput, TrialSetup, Vehicle,
};
use seaplant_plan::{Kind, Prior, Rehearsal, Request, plan, rehearse};

type Failure = Box<dyn std::error::Error>;

/// Half of a 95 % interval in standard deviations.
const HALF_95: f64 = 1.959_964;

/// A vehicle of two, three or six axes.
fn vehicle(random: &mut ChaCha8Rng, kind: usize) -> Result<Vehicle, Failure> {
    let length = random.random_range(0.4..1.5);
    let size =
        [length, length * random.random_range(0.5..0.9), length * random.random_range(0.4..0.8)];
    let mass = 1025.0 * size.iter().product::<f64>() * random.random_range(0.3..0.6);
    let full = 300.0 * size[1] * size[2] * random.random_range(0.8..1.5);
    let law = QuadraticThrust {
        forward: full,
        reverse: full * random.random_range(0.75..1.0),
        ..QuadraticThrust::default()
    };
    let curve = ThrustCurve::Quadratic { input: ThrusterInput::Command, law };
    let (x, y) = (0.35 * size[0], 0.4 * size[1]);
    let mut thrusters = Vec::new();
    let mut add = |position: [f64; 3], direction: [f64; 3]| {
        let name = format!("t{}", thrusters.len() + 1);
        thrusters.push(Thruster::new(&name, position, direction, curve.clone())?);
        Ok::<(), seaplant::Error>(())
    };
    if kind < 2 {
        add([0.0, -y, 0.0], [1.0, 0.0, 0.0])?;
        add([0.0, y, 0.0], [1.0, 0.0, 0.0])?;
    }
    if kind == 1 {
        add([0.0; 3], [0.0, 0.0, -1.0])?;
    }
    if kind == 2 {
        for (fore, side) in [(1.0, -1.0), (1.0, 1.0), (-1.0, -1.0), (-1.0, 1.0)] {
            add([fore * x, side * y, 0.0], [1.0, -fore * side, 0.0])?;
            add([fore * x, side * y, 0.0], [0.0, 0.0, -1.0])?;
        }
    }
    Ok(Vehicle {
        name: "drawn".to_owned(),
        dry_mass_kg: Some(mass),
        size_m: Some(size),
        thrusters,
        ..Vehicle::default()
    })
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

#[allow(clippy::print_stdout, reason = "an example that prints a table")]
fn main() -> Result<(), Failure> {
    let count: u64 = std::env::args().nth(1).map_or(Ok(6), |count| count.parse())?;
    let mut ratios = Vec::new();
    let (mut inside, mut gap, mut runs, mut broken) = (0, 0.0_f64, 0, 0);
    let mut factors: Vec<(Kind, Vec<f64>)> =
        vec![(Kind::SinusoidAndJoystick, Vec::new()), (Kind::Sweep, Vec::new())];
    for k in 0..count {
        let vehicle = vehicle(&mut ChaCha8Rng::seed_from_u64(k), (k % 3) as usize)?;
        let prior = Prior::of_vehicle(&vehicle, &[])?;
        let request = Request {
            minutes: Some(12.0),
            checks: 1000 / count as usize + 1,
            compare: true,
            seed: k + 1,
            ..Request::default()
        };
        let began = std::time::Instant::now();
        let made = plan(&prior, &vehicle, &request)?;
        let seconds = began.elapsed().as_secs_f64();
        let rehearsal = Rehearsal { seed: k, hold_out_s: 0.0 };
        let dive = rehearse(&prior, &vehicle, &made, rehearsal)?;
        let fitted = dive.trials.iter().filter(|trial| trial.role == Role::Fit);
        let records: Vec<CoupledRecord> = fitted
            .map(|trial| {
                let setup = TrialSetup { name: trial.name.clone(), ..TrialSetup::default() };
                CoupledRecord::new(&setup, &trial.recording, &dive.vehicle, &made.axes)
            })
            .collect::<Result<_, _>>()?;
        let all: Vec<&CoupledRecord> = records.iter().collect();
        let structure = dive.coupled[0].structure(&dive.vehicle, |_| false)?;
        let fit = fit_coupled(&structure, &all, None, false)?;
        let truth = dive.truth.vehicle.map(|own| own.coefficients).unwrap_or_default();
        let mut own = Vec::new();
        for forecast in made.coefficients.iter().filter(|one| one.value != 0.0) {
            let Some(at) = fit.plant.structure().names().iter().position(|n| *n == forecast.name)
            else {
                continue;
            };
            let (std, value) = (fit.covariance[(at, at)].sqrt(), truth[&forecast.name]);
            own.push(std / value / (forecast.after / HALF_95 / forecast.value));
            inside += usize::from((fit.plant.coefficients()[at] - value).abs() < HALF_95 * std);
        }
        println!(
            "{k}: {} axes, {} min, planned in {seconds:.1} s, gap {:.2} %, stated over promised {:.2} (median of {})",
            made.axes.len(),
            made.minutes,
            100.0 * made.certificate.gap,
            median(own.clone()),
            own.len()
        );
        for (kind, factors) in &mut factors {
            if let (Some(Some(minutes)), Some(needed)) =
                (made.unplanned.get(kind), made.minutes_needed)
            {
                factors.push(minutes / needed);
            }
        }
        ratios.extend(own);
        gap = gap.max(made.certificate.gap);
        runs += made.check.runs;
        broken += made.check.broken;
    }
    let near = ratios.iter().filter(|ratio| (**ratio - 1.0).abs() <= 0.2).count();
    let total = ratios.len();
    println!(
        "{total} coefficients of {count} vehicles: {near} stated within 20 % of the promise, median {:.2}",
        median(ratios)
    );
    println!("{inside} of {total} intervals of the fit include the truth");
    for (kind, factors) in factors {
        println!(
            "{}: {:.1} times the minutes (median of {})",
            kind.name(),
            median(factors.clone()),
            factors.len()
        );
    }
    println!(
        "largest certified gap {:.2} %, limits broken in {broken} of {runs} runs",
        100.0 * gap
    );
    Ok(())
}
