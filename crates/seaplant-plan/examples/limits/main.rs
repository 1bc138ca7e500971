//! Counts the simulated runs of plans that break a limit, over vehicles drawn at random.
//!
//! ```sh
//! cargo run -p seaplant-plan --example limits -- 4 0 250   # vehicles, the first seed, runs each
//! ```
//!
//! Each vehicle has six axes. Every run has another plant drawn from the prior, disturbances, and
//! noise of the instruments.

#[path = "../promises/vehicles.rs"]
mod vehicles;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use seaplant_plan::{Prior, Request, plan};

#[allow(clippy::print_stdout, reason = "an example that prints a table")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers: Vec<u64> =
        std::env::args().skip(1).map(|text| text.parse()).collect::<Result<_, _>>()?;
    let number = |k: usize, usual: u64| numbers.get(k).copied().unwrap_or(usual);
    let (count, first, checks) = (number(0, 4), number(1, 0), number(2, 250));
    let (mut broken, mut runs, mut greatest) = (0, 0, 0.0_f64);
    for k in first..first + count {
        // Every third vehicle of the comparison of promises has six axes.
        let k = 3 * k + 2;
        let vehicle = vehicles::vehicle(&mut ChaCha8Rng::seed_from_u64(k), 2)?;
        let prior = Prior::of_vehicle(&vehicle, &[])?;
        let request = Request {
            minutes: Some(12.0),
            checks: checks as usize,
            seed: k + 1,
            ..Request::default()
        };
        let began = std::time::Instant::now();
        let made = plan(&prior, &vehicle, &request)?;
        let seconds = began.elapsed().as_secs_f64();
        let check = &made.check;
        let widest = made.goals.iter().map(|goal| goal.after / goal.goal.unwrap_or(goal.after));
        println!(
            "{k}: {} of {} runs broke a limit, at most {:.2} of {}; widest interval {:.2} of its goal; {seconds:.1} s; {:?}",
            check.broken,
            check.runs,
            check.greatest,
            check.of,
            widest.fold(0.0, f64::max),
            check.by_limit
        );
        broken += check.broken;
        runs += check.runs;
        greatest = greatest.max(check.greatest);
    }
    println!("limits broken in {broken} of {runs} runs; at most {greatest:.2} of one was used");
    Ok(())
}
