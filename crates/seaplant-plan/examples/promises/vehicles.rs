//! Vehicles drawn at random.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use seaplant::{QuadraticThrust, ThrustCurve, Thruster, ThrusterInput, Vehicle};

/// Returns a vehicle of two, three or six axes.
pub fn vehicle(random: &mut ChaCha8Rng, kind: usize) -> Result<Vehicle, seaplant::Error> {
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
