//! Margins, growth and regulators against python-control and SciPy: tests/reference/margins.py.

use seaplant::Dof;
use seaplant::plant::{Plant, Structure, Symmetry};
use seaplant_control::{Actuators, Design, Error, Gains, Law, LqrWeights, Tuning, design};

/// An axis, its specification, and the reference's result.
struct Case {
    /// Mass, linear and quadratic drag.
    plant: [f64; 3],
    speed: f64,
    /// Bandwidth, damping, integral time, lag, delay, samples a second.
    loops: [f64; 6],
    law: Law,
    /// Phase margin in degrees, gain margin, delay margin in s, crossover in Hz.
    margins: [f64; 4],
}

const CASES: [Case; 8] = [
    Case {
        plant: [100.0, 20.0, 80.0],
        speed: 0.5,
        loops: [0.1, 1.0, 0.0, 0.0, 0.0, 10.0],
        law: Law::NonExact,
        margins: [81.4299, 15.9152, 1.11095, 0.203604],
    },
    Case {
        plant: [100.0, 20.0, 80.0],
        speed: 0.5,
        loops: [0.15, 0.7, 0.0, 0.3, 0.0, 10.0],
        law: Law::Pd,
        margins: [46.0037, 13.5624, 0.59448, 0.214958],
    },
    Case {
        plant: [100.0, 20.0, 80.0],
        speed: 0.5,
        loops: [0.1, 1.0, 0.0, 0.3, 0.2, 10.0],
        law: Law::Exact,
        margins: [48.6659, 3.95937, 0.808706, 0.16716],
    },
    Case {
        plant: [12970.0, 0.0, 2231.0],
        speed: 0.5,
        loops: [0.05, 1.0, 40.0, 0.4, 0.1, 5.0],
        law: Law::Pid,
        margins: [54.6189, 8.06986, 1.53174, 0.0990499],
    },
    Case {
        plant: [0.5, 0.1, 1.5],
        speed: 0.3,
        loops: [0.3, 0.6, 4.0, 0.1, 0.05, 20.0],
        law: Law::Pid,
        margins: [36.1063, 5.44645, 0.255141, 0.393097],
    },
    // Heave of a BlueROV2 Heavy: its phase margin at rest is 117.5°, and at 0.5 m/s, where drag
    // lowers the crossover to the corner of the plant, 99.8°; the smaller one counts.
    Case {
        plant: [32.18, 33.0, 190.0],
        speed: 0.0,
        loops: [0.1, 1.0, 0.0, 0.0, 0.0, 10.0],
        law: Law::NonExact,
        margins: [117.457, 15.9252, 2.3833, 0.136898],
    },
    Case {
        plant: [32.18, 33.0, 190.0],
        speed: 0.5,
        loops: [0.1, 1.0, 0.0, 0.0, 0.0, 10.0],
        law: Law::NonExact,
        margins: [99.8025, 15.9252, 2.3833, 0.00922002],
    },
    Case {
        plant: [100.0, 20.0, 80.0],
        speed: 0.5,
        loops: [0.1, 1.0, 0.0, 0.2, 0.13, 10.0],
        law: Law::NonExact,
        margins: [58.2067, 4.86584, 0.818483, 0.197543],
    },
];

/// Relative tolerance: both evaluate margins on grids of a hundredth of a decade.
const READING: f64 = 0.01;

fn surge([mass, linear, quadratic]: [f64; 3]) -> Plant {
    let structure = Structure::of(&[Dof::Surge], Symmetry::None).expect("surge");
    Plant::new(structure, vec![mass, linear, quadratic]).expect("possible")
}

fn gains(case: &Case, draws: &[Plant]) -> Gains {
    let [hz, damping, integral_s, lag_s, delay_s, sample_hz] = case.loops;
    let integral_s = Some(integral_s).filter(|s| *s > 0.0);
    let tuning = Tuning { integral_s, ..Tuning::new(hz, damping) };
    let asked = Design {
        law: case.law,
        tuning: [(Dof::Surge, tuning)].into(),
        sample_hz,
        speed: [case.speed; 6],
        ..Design::default()
    };
    let actuators = Actuators { lag_s: [lag_s; 6], delay_s: [delay_s; 6], ..Actuators::default() };
    design(&surge(case.plant), draws, &actuators, &asked).expect("sound")
}

#[test]
fn margins_are_those_of_python_control() {
    for case in &CASES {
        let found = gains(case, &[]).axes[&Dof::Surge].margins;
        let found = [found.phase_deg, found.gain, found.delay_s, found.crossover_hz];
        for (found, reference) in found.into_iter().zip(case.margins) {
            let off = (found / reference - 1.0).abs();
            assert!(off < READING, "{:?}: {found} against {reference}", case.loops);
        }
    }
}

/// Ratio of the vehicle's masses to the model's, and the growth per step of the loop of the fourth
/// case and of the fifth.
const GROWTH: [(f64, [f64; 2]); 5] = [
    (0.1, [1.112958, 1.067954]),
    (0.2, [0.993775, 0.984049]),
    (0.4, [0.993794, 0.984198]),
    (1.0, [0.993851, 0.984596]),
    (3.0, [0.994018, 0.990227]),
];

#[test]
fn draws_with_which_the_loop_is_unstable_are_those_of_its_eigenvalues() {
    for (place, case) in CASES[3..5].iter().enumerate() {
        for (part, growth) in GROWTH {
            let [mass, linear, quadratic] = case.plant;
            let draw = surge([part * mass, linear, quadratic]);
            let unstable = gains(case, &[draw]).probability_unstable;
            assert_eq!(unstable > 0.5, growth[place] > 1.0, "{part} of {mass} kg");
        }
        let draws = GROWTH.map(|(part, _)| {
            let [mass, linear, quadratic] = case.plant;
            surge([part * mass, linear, quadratic])
        });
        let found = gains(case, &draws);
        assert_eq!(found.probability_unstable, 0.2);
        assert!(
            found.notes.iter().any(|note| note.contains("20 % of 5 draws")),
            "{:?}",
            found.notes
        );
    }
}

#[test]
fn a_bandwidth_that_would_do_does_although_much_lower_ones_do_not() {
    // By tests/reference/margins.py the phase margin is 17° at 0.01 Hz, 53° at 0.1 Hz, 41° at 0.2 Hz, 24°
    // at 0.25 Hz and 11° at 0.3 Hz.
    let plant = surge([32.18, 33.0, 190.0]);
    let asked = |hz: f64| Design {
        law: Law::Pid,
        tuning: [(Dof::Surge, Tuning::new(hz, 1.0))].into(),
        ..Design::default()
    };
    let lagging = Actuators { lag_s: [0.3; 6], delay_s: [0.2; 6], ..Actuators::default() };
    design(&plant, &[], &lagging, &asked(0.2)).expect("enough phase");
    let error = design(&plant, &[], &lagging, &asked(0.3)).expect_err("too fast");
    let Error::Bandwidth { reachable_hz: Some(hz), .. } = error else { panic!("{error}") };
    assert!((0.2..0.25).contains(&hz), "{hz}");
    design(&plant, &[], &lagging, &asked(hz)).expect("what would do does");
    design(&plant, &[], &lagging, &asked(0.01)).expect_err("too slow");
}

#[test]
fn regulators_are_those_of_the_riccati_equation() {
    // Mass, linear drag, error, force; K_p and K_d of scipy.linalg.solve_continuous_are.
    for ([mass, damping, error, force], [kp, kd]) in [
        ([100.0, 20.0, 0.1, 40.0], [400.0, 263.548938]),
        ([0.5, 0.2, 0.05, 1.0], [20.0, 4.27660586]),
        ([12970.0, 0.0, 0.5, 900.0], [1800.0, 6833.15447]),
    ] {
        let tuning = LqrWeights { error, force }.tuning(mass, damping).expect("sound");
        let omega = std::f64::consts::TAU * tuning.bandwidth_hz;
        let found = [mass * omega * omega, 2.0 * tuning.damping * omega * mass];
        assert!(
            (found[0] / kp - 1.0).abs() < 1e-8 && (found[1] / kd - 1.0).abs() < 1e-8,
            "{found:?}"
        );
    }
}
