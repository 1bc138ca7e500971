use seaplant::twin::{TwinSpec, make};
use seaplant::{Dof, Quantity, Recording, estimate_offset};

#[test]
fn explore() {
    let spec = TwinSpec { duration_s: 240.0, seed: 3, ..TwinSpec::jason2() };
    let dive = make(&spec).unwrap();
    for log in &dive.trials {
        let all: Vec<String> = log.recording.iter().map(|(q, x)| format!("{q}@{:.1}Hz", 1.0 / x.period_s())).collect();
        println!("{} {:?}", log.name, all);
        let is_thrust = |q: &Quantity| q.is_of_thrust();
        for (name, mine) in [
            ("thrust", Box::new(is_thrust) as Box<dyn Fn(&Quantity) -> bool>),
            ("dvl", Box::new(|q: &Quantity| q.to_string().contains("dvl"))),
            ("heading", Box::new(|q: &Quantity| q.to_string().contains("heading"))),
            ("depth", Box::new(|q: &Quantity| q.to_string().contains("depth"))),
        ] {
            let (other, reference): (Recording, Recording) = log
                .recording
                .clone()
                .into_iter()
                .map(|(q, x)| if mine(&q) { (q, x.shifted(-7.77)) } else { (q, x) })
                .partition(|(q, _)| mine(q));
            let start = std::time::Instant::now();
            match estimate_offset(&reference, &other, &dive.vehicle) {
                Ok(found) => {
                    println!("  {name}: {:.4} ± {:.4} in {:?}", found.offset_s, found.std_s, start.elapsed());
                    for p in &found.pairs { println!("     {p:?}"); }
                }
                Err(e) => println!("  {name}: {e}"),
            }
        }
    }
    let _ = Dof::ALL;
}
