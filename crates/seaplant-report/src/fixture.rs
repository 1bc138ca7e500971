//! A small identification with hostile names, for tests.

use std::collections::BTreeMap;

use seaplant::estimate::{Candidate, Filters, Innovations};
use seaplant::exchange::Consequence;
use seaplant::results::*;
use seaplant::signal::LowPass;
use seaplant::signal::amplitude_spectrum;
use seaplant::{
    Agreement, Caveat, CaveatCode, Comparison, Dof, LumpedParameters, Method, PhysicalParameters,
    Role, ScoredMotion, Stability, Term,
};

pub(crate) const HOSTILE: &str = "<script>alert('x')</script>/..\\\"&\u{7}\u{1b}[2J\u{202e}日本 1";

pub(crate) fn parameter(value: f64, std: f64, unit: &str) -> Parameter {
    let unit = unit.to_owned();
    Parameter { value, std, low95: value - 1.96 * std, high95: value + 1.96 * std, unit }
}

fn score(trial: &str, e: Option<f64>) -> PlantScore {
    let one = Score {
        mean_abs_error: e,
        null_error: 0.11,
        best_null: Some(NullScore { model: NullModel::SteadySpeed, mean_abs_error: 0.07 }),
        r_squared: e.map(|e| 1.0 - e),
        offset_free_error: e.map(|e| 0.9 * e),
        samples: 4800,
        ..Score::default()
    };
    PlantScore::of_axis(Dof::Surge, one, [(trial.to_owned(), one)])
}

fn coefficient(x: &Parameter, on: &[Dof]) -> Coefficient {
    let Parameter { value, std, low95, high95, unit } = x.clone();
    let told_by = if value == 0.0 { ToldBy::Limit } else { ToldBy::Data };
    Coefficient { value, std, low95, high95, unit, on: on.to_vec(), told_by }
}

pub(crate) fn plant() -> PlantResult {
    let physical = PhysicalParameters {
        mass: 12970.2,
        d_quadratic: 2230.9,
        d_linear: 0.0,
        bias_force: -255.5,
    };
    let mass = parameter(12970.2, 253.0, "kg");
    let drag = parameter(2230.9, 61.0, "N/(m/s)²");
    let bias = parameter(-255.5, 9.4, "N");
    let named = [("mass.surge", &mass), ("surge: |u|u", &drag), ("surge: 1", &bias)];
    let own = |(name, x): (&str, &Parameter)| (name.to_owned(), coefficient(x, &[Dof::Surge]));
    let matrix = |x: f64| MatrixResult { value: vec![vec![x]], std: vec![vec![0.1 * x]] };
    PlantResult {
        parameters: named.into_iter().map(own).collect(),
        correlation: Correlation {
            names: named.map(|(name, _)| name.to_owned()).to_vec(),
            value: [[1.0, -0.5, 0.1], [-0.5, 1.0, 0.2], [0.1, 0.2, 1.0]].map(Vec::from).into(),
        },
        by_axis: BTreeMap::from([(
            Dof::Surge,
            Parameters {
                mass,
                quadratic_drag: Some(drag),
                linear_drag: None,
                bias_force: Some(bias),
                added_mass: Some(parameter(9570.2, 253.0, "kg")),
            },
        )]),
        mass_matrix: matrix(12970.2),
        linear_damping: matrix(0.0),
        quadratic_damping: matrix(2230.9),
        samples: 4790,
        alone: Some(Alone {
            terms: vec![Term::Force, Term::Quadratic, Term::Bias],
            stable: true,
            stability: Stability::Stable,
            lumped: physical.to_lumped(),
            lumped_std: LumpedParameters::default(),
            steady_test: None,
            thrust_part: None,
            regression: RegressionResult {
                effective_samples: 312.4,
                condition: 2.31,
                variance_inflation: BTreeMap::from([(Term::Force, 1.21), (Term::Quadratic, 1.22)]),
                residual_rms: 0.0123,
                filters: Filters {
                    velocity: Some(LowPass { cutoff_hz: 1.5, order: 2 }),
                    every_term: Some(LowPass { cutoff_hz: 0.5, order: 2 }),
                },
            },
        }),
        nuisances: BTreeMap::from([("delay".to_owned(), parameter(0.21, 0.02, "s"))]),
        structure: vec![TermDecision {
            candidate: Candidate::LinearDrag.name().to_owned(),
            admitted: false,
            likelihood_ratio: 1.23,
            p_value: None,
            needed: Some(8.48),
            size: None,
        }],
        innovations: vec![Innovations {
            trial: HOSTILE.to_owned(),
            samples: 4790,
            autocorrelation: vec![1.0, 0.02, -0.01],
        }],
        fit: score(HOSTILE, Some(0.0185)),
        hold_out: Some(score("held & out", Some(0.021))),
        whiteness: Some(1.4),
        verdict: Verdict {
            good_for: Some(GoodFor {
                words: format!("surge at -0.5 to 0.5 m/s; not motion as in `{HOSTILE}` (surge)"),
                ..GoodFor::default()
            }),
            may_be_off: vec![MayBeOff {
                number: "mass".to_owned(),
                part: Some(0.3),
                because: OffBecause::Method { method: Method::OutputError },
                limit: 0.1,
            }],
            ..Verdict::new(
                Trust::DoNotUse,
                "severe caveat: mass below dry mass",
                vec![CaveatCode::MassBelowDryMass],
            )
        },
        caveats: vec![Caveat::note(CaveatCode::ThrustScale, "the scale of thrust <is> unseen")],
        ..PlantResult::empty(vec![Dof::Surge], Method::RECOMMENDED)
    }
}

fn paper_plant() -> PlantResult {
    let alone = plant().alone.map(|alone| Alone {
        stable: false,
        stability: Stability::StableBelow { speed: 0.4 },
        ..alone
    });
    PlantResult {
        method: Method::Paper,
        alone,
        fit: score(HOSTILE, None),
        hold_out: None,
        caveats: vec![
            Caveat::severe(
                CaveatCode::FilterAttenuatesExcitation,
                "mass comes out 1/|H| = 2.0 times",
            ),
            Caveat::warning(CaveatCode::UnequalFiltering, "drag from a weakened velocity"),
        ],
        ..plant()
    }
}

fn steady() -> SteadyResult {
    let segment = |trial: &str, force: f64| SegmentResult {
        trial: trial.to_owned(),
        from_s: 40.0,
        to_s: 90.0,
        force,
        force_part: force.abs() / 1500.0,
        velocity: 0.4 * force.signum(),
        velocity_std: 0.001,
        quadratic_drag: parameter(5660.6, 40.0, "N/(m/s)²"),
        mean_abs_error: 0.0038,
        joint_error: None,
    };
    SteadyResult {
        segments: vec![segment("down <30> %", 700.0), segment("up 30 %", -700.0)],
        mean_quadratic_drag: 5660.6,
        quadratic_drag: Some(parameter(5501.0, 33.0, "N/(m/s)²")),
        bias_force: None,
        pairs: vec![PairResult {
            positive: "down <30> %".to_owned(),
            negative: "up 30 %".to_owned(),
            bias_force: parameter(248.0, 12.0, "N"),
        }],
        caveats: vec![Caveat::warning(CaveatCode::SteadyPairsContradict, "pairs contradict")],
    }
}

fn trial(name: &str, role: Role, dof: Dof) -> TrialResult {
    let axis = AxisResult {
        from_s: 20.0,
        to_s: 500.0,
        sample_hz: 10.0,
        source_hz: 10.0,
        motion: "velocity".to_owned(),
        dominant_hz: Some(0.125),
        dominant_amplitude: 1790.0,
        force_max: 2100.0,
        force_rms: 1300.0,
        stroke: Some(3.1),
        keulegan_carpenter: Some(1.15),
        speed_max: Some(0.31),
        speed_rms: Some(0.17),
        gap_s: 0.0,
    };
    let files = vec!["a.csv".to_owned()];
    let (name, offsets) = (name.to_owned(), Vec::new());
    TrialResult { name, role, files, offsets, axes: BTreeMap::from([(dof, axis)]) }
}

pub(crate) fn comparison(trial: &str, method: Method, role: Role) -> ComparisonFigure {
    let time_s: Vec<f64> = (0..3000).map(|k| 0.1 * f64::from(k)).collect();
    let measured: Vec<f64> = time_s.iter().map(|t| 0.3 * (0.785 * t).sin()).collect();
    let simulated: Vec<f64> = measured.iter().map(|v| 0.97 * v + 0.004).collect();
    let force: Vec<f64> = time_s.iter().map(|t| 1800.0 * (0.785 * t).cos()).collect();
    let velocity = Agreement::of(&measured, &simulated, 0.0);
    let dof = Dof::Surge;
    let trial = trial.to_owned();
    let comparison = Comparison {
        quantity: ScoredMotion::Velocity,
        dof,
        trial,
        time_s,
        force,
        measured,
        simulated,
        velocity,
        position: None,
    };
    ComparisonFigure { plant: None, method, role, comparison }
}

/// Returns motion of the plant of sway and yaw.
fn together(dof: Dof, role: Role) -> ComparisonFigure {
    let mut figure = comparison("held & out", Method::FilterError, role);
    figure.plant = Some("sway-yaw".to_owned());
    figure.comparison.dof = dof;
    figure
}

fn series() -> Vec<Series> {
    let force: Vec<f64> = (0..3000).map(|k| 1800.0 * (0.0785 * f64::from(k)).sin()).collect();
    let velocity: Vec<f64> = force.iter().map(|f| f / 6000.0).collect();
    let time_s: Vec<f64> = (0..1000).map(|k| 0.1 * f64::from(k)).collect();
    vec![
        Series::Comparison(comparison(HOSTILE, Method::RECOMMENDED, Role::Fit)),
        Series::Comparison(comparison("held & out", Method::RECOMMENDED, Role::HoldOut)),
        Series::Comparison(comparison("held / out", Method::RECOMMENDED, Role::HoldOut)),
        Series::Comparison(comparison(HOSTILE, Method::Paper, Role::Fit)),
        Series::Comparison(together(Dof::Sway, Role::HoldOut)),
        Series::Comparison(together(Dof::Yaw, Role::HoldOut)),
        Series::Spectrum(SpectrumFigure {
            dof: Dof::Surge,
            trial: HOSTILE.to_owned(),
            force: amplitude_spectrum(&force, 10.0),
            velocity: amplitude_spectrum(&velocity, 10.0),
        }),
        Series::Steady(SteadyFigure {
            dof: Dof::Heave,
            trial: "down <30> %".to_owned(),
            velocity: time_s.iter().map(|t| 0.4 * (t / 20.0).tanh()).collect(),
            force: vec![700.0; time_s.len()],
            position_time_s: time_s.iter().step_by(17).copied().collect(),
            position: time_s.iter().step_by(17).map(|t| 0.4 * t).collect(),
            time_s,
        }),
    ]
}

/// Content of a report.
pub(crate) struct Found {
    pub(crate) results: Results,
    pub(crate) series: Vec<Series>,
}

/// Returns a plant of two axes, one with damping at its limit.
pub(crate) fn plant_of_several_axes() -> PlantResult {
    let coefficient = |value: f64, std: f64, unit: &str, on: &[Dof]| {
        coefficient(&parameter(value, std, unit), on)
    };
    let matrix = |value: [[f64; 2]; 2]| MatrixResult {
        value: value.map(Vec::from).into(),
        std: value.map(|row| row.map(|x| 0.1 * x).to_vec()).into(),
    };
    let part = |value: f64| Part { value, std: 0.01, low95: value - 0.02, high95: value + 0.02 };
    let change =
        LikelyChange { mass: part(0.01), drag: part(-0.03), whiteness: 1.1, surprise: 0.9 };
    let score = |e: Option<f64>| {
        let axis = Score {
            mean_abs_error: e,
            null_error: 0.3,
            likely_change: Some(change),
            r_squared: e.map(|e| 1.0 - e),
            samples: 900,
            ..Score::default()
        };
        let by_axis = BTreeMap::from([(Dof::Sway, axis), (Dof::Yaw, axis)]);
        PlantScore { by_trial: BTreeMap::from([(HOSTILE.to_owned(), by_axis.clone())]), by_axis }
    };
    let parameters = BTreeMap::from([
        ("mass.sway".to_owned(), coefficient(180.0, 2.0, "kg", &[Dof::Sway])),
        ("mass.yaw".to_owned(), coefficient(40.0, 0.5, "kg m²", &[Dof::Yaw])),
        ("sway: v".to_owned(), coefficient(0.0, 1.5, "N/(m/s)", &[Dof::Sway])),
        ("yaw: |v|r".to_owned(), coefficient(3.0, 0.4, "N m/((m/s)(rad/s))", &[Dof::Yaw])),
    ]);
    let mut by_axis = Parameters::by_axis(&[Dof::Sway, Dof::Yaw], &parameters);
    by_axis.entry(Dof::Sway).and_modify(|own| own.added_mass = Some(parameter(80.0, 2.0, "kg")));
    PlantResult {
        by_axis,
        verdict: Verdict::new(Trust::Doubtful, HOSTILE, vec![CaveatCode::NotDetermined]),
        verdicts: BTreeMap::from([
            (
                Dof::Sway,
                Verdict::new(Trust::UsableWithCare, "predicts held-out trials", Vec::new()),
            ),
            (Dof::Yaw, Verdict::new(Trust::Doubtful, HOSTILE, vec![CaveatCode::NotDetermined])),
        ]),
        symmetry: seaplant::plant::Symmetry::PortStarboard,
        parameters,
        mass_matrix: matrix([[180.0, 12.0], [12.0, 40.0]]),
        rigid_body_mass_matrix: Some(vec![vec![100.0, 0.0], vec![0.0, 20.0]]),
        added_mass: Some(vec![vec![80.0, 12.0], vec![12.0, 20.0]]),
        linear_damping: matrix([[0.0, 0.0], [0.0, 2.0]]),
        quadratic_damping: matrix([[250.0, 0.0], [0.0, 4.0]]),
        correlation: Correlation {
            names: vec!["mass.sway".to_owned(), "sway: v".to_owned()],
            value: vec![vec![1.0, -0.9], vec![-0.9, 1.0]],
        },
        nuisances: BTreeMap::from([(
            format!("current north: {HOSTILE}"),
            parameter(0.1, 0.01, "m/s"),
        )]),
        nondimensional: Some(PrimeSystem {
            length_m: 3.4,
            depth_m: 3.4,
            density_kg_m3: 1025.0,
            speed_m_s: 0.5,
            coefficients: BTreeMap::from([(
                "yaw: |v|r".to_owned(),
                PrimeCoefficient {
                    symbol: "N'_|v|r".to_owned(),
                    value: -0.003,
                    std: 0.0004,
                    low95: -0.0038,
                    high95: -0.0022,
                },
            )]),
        }),
        identifiability: Some(Identifiability {
            coefficients: 8,
            rank: 7,
            variance_inflation: BTreeMap::from([("mass.sway".to_owned(), 3.0)]),
            not_told: Vec::new(),
        }),
        structure: vec![TermDecision {
            candidate: "sway: r".to_owned(),
            admitted: false,
            likelihood_ratio: 1.2,
            p_value: Some(0.27),
            needed: None,
            size: None,
        }],
        samples: 1800,
        log_likelihood: Some(5432.1),
        fit: score(Some(0.01)),
        hold_out: Some(score(None)),
        single_axes: BTreeMap::from([(Dof::Sway, Score::default())]),
        caveats: vec![Caveat::note(CaveatCode::UndrivenAxis, "no moment acts on yaw")],
        ..PlantResult::empty(vec![Dof::Sway, Dof::Yaw], Method::FilterError)
    }
}

/// Returns an identification with everything that results can contain, under hostile names.
pub(crate) fn identification() -> Found {
    let surge = BTreeMap::from([(Method::RECOMMENDED, plant()), (Method::Paper, paper_plant())]);
    let results = Results {
        schema: SCHEMA.to_owned(),
        version: "0.1.0".to_owned(),
        vehicle: format!("Vehicle {HOSTILE}"),
        dry_mass_kg: Some(3400.0),
        size_m: Some([3.4, 2.2, 2.4]),
        rigid_body: None,
        buoyancy: None,
        provenance: Provenance {
            command: format!("seaplant identify '{HOSTILE}'"),
            inputs: vec![InputFile {
                path: format!("{HOSTILE}.csv"),
                bytes: 123_456,
                sha256: "ab".repeat(32),
            }],
            seed: Some(7),
            settings: BTreeMap::from([("paper.cutoff_hz".to_owned(), "0.125".to_owned())]),
        },
        plants: BTreeMap::from([
            ("surge".to_owned(), plant()),
            ("sway-yaw".to_owned(), plant_of_several_axes()),
        ]),
        steering: Vec::new(),
        methods: BTreeMap::from([("surge".to_owned(), surge)]),
        subsets: BTreeMap::from([(
            Dof::Surge,
            vec![SubsetResult {
                terms: vec![Term::Force, Term::Linear],
                lumped: LumpedParameters { alpha: 7.71e-5, beta: 0.0, mu: -0.12, bias: 0.0 },
                stable: true,
                fit_error: Some(0.033),
                hold_out_error: None,
                condition: 1.4,
            }],
        )]),
        steady: BTreeMap::from([(Dof::Heave, steady())]),
        thrusters: vec![ThrusterResult {
            name: format!("port {HOSTILE}"),
            position_m: [-1.0, -0.6, 0.0],
            direction: [1.0, 0.0, 0.0],
            input: "speed".to_owned(),
            curve: "0.0402 forward, 0.0328 reverse".to_owned(),
            thrust_std: Some([0.03, 0.05]),
            law: None,
        }],
        bollard_pull: Some(bollard_pull()),
        sensors: vec![SensorResult {
            name: "dvl".to_owned(),
            position_m: [0.5, 0.0, 0.8],
            rotation_deg: [0.0, 0.0, 45.0],
            std: Some(0.003),
            unit: "m/s".to_owned(),
            rate_hz: Some(10.0),
        }],
        trials: vec![
            trial(HOSTILE, Role::Fit, Dof::Surge),
            trial("held & out", Role::HoldOut, Dof::Surge),
        ],
        truth: Some(BTreeMap::from([
            ("mass.surge".to_owned(), 12970.0),
            ("surge: |u|u".to_owned(), 2400.0),
        ])),
        consequences: vec![Consequence {
            name: "top speed at 1000 N".to_owned(),
            axis: Dof::Surge,
            value: 0.67,
            interval95: Some([0.65, 0.69]),
            unit: "m/s".to_owned(),
        }],
        plan: Some(plan_outcome()),
        failures: vec![Failure {
            dof: Dof::Yaw,
            method: Method::Paper.name().to_owned(),
            message: format!("trial {HOSTILE} lacks heading"),
        }],
        caveats: vec![Caveat::note(CaveatCode::Log, format!("dropped a line of {HOSTILE}"))],
    };
    Found { results, series: series() }
}

fn plan_outcome() -> PlanOutcome {
    PlanOutcome {
        file: format!("plan/{HOSTILE}.json"),
        vehicle: HOSTILE.to_owned(),
        minutes_planned: 5.0,
        minutes_driven: 2.5,
        manoeuvres: vec![ManoeuvreOutcome {
            name: HOSTILE.to_owned(),
            axes: vec![Dof::Surge],
            minutes_planned: 5.0,
            minutes_driven: 2.5,
            stretches: vec![DrivenStretch { trial: HOSTILE.to_owned(), from_s: 3.2, to_s: 153.2 }],
            force_ratio: Some(0.93),
        }],
        axes: BTreeMap::from([(
            Dof::Surge,
            AxisOutcome {
                minutes_planned: 5.0,
                minutes_driven: 2.5,
                velocity_planned: [-0.6, 0.7],
                velocity_reached: Some([-0.55, 0.61]),
            },
        )]),
        goals: vec![GoalOutcome {
            name: "mass.surge".to_owned(),
            unit: "kg".to_owned(),
            believed: 12_000.0,
            value: Some(12_970.0),
            promised: 600.0,
            promised_range90: Some([450.0, 800.0]),
            obtained: Some(900.0),
            wanted: 648.5,
            is_met: false,
        }],
        open: vec![format!("{HOSTILE} was driven for 2.5 of 5 min")],
        doubts: vec![format!("the plan is of `{HOSTILE}`")],
    }
}

pub(crate) fn bollard_pull() -> BollardPullResult {
    BollardPullResult {
        file: "bollard.csv".to_owned(),
        input_unit: "rad/s".to_owned(),
        neutral: 0.0,
        forward: Some(parameter(0.0402, 0.0004, "N/(rad/s)²")),
        reverse: Some(parameter(0.0328, 0.0003, "N/(rad/s)²")),
        deadband: None,
        residual_rms: 3.2,
        r_squared: 0.9991,
        points: (-8..=8)
            .map(|k| 20.0 * f64::from(k))
            .map(|w| (w, if w < 0.0 { -0.0328 * w * w } else { 0.0402 * w * w } + 2.0))
            .collect(),
        caveats: vec![Caveat::warning(CaveatCode::WeakDrag, "few points in reverse")],
    }
}

/// Returns an identification without plants.
pub(crate) fn empty() -> Found {
    let Found { results, .. } = identification();
    let results = Results {
        dry_mass_kg: None,
        size_m: None,
        rigid_body: None,
        buoyancy: None,
        provenance: Provenance::default(),
        plants: BTreeMap::new(),
        steering: Vec::new(),
        methods: BTreeMap::new(),
        subsets: BTreeMap::new(),
        steady: BTreeMap::new(),
        thrusters: Vec::new(),
        bollard_pull: None,
        sensors: Vec::new(),
        trials: Vec::new(),
        truth: None,
        plan: None,
        caveats: Vec::new(),
        ..results
    };
    Found { results, series: Vec::new() }
}
