//! The filter error method on the twin, one disturbance at a time.

use seaplant::monte_carlo::{ParameterName, Row, sample, summarise};
use seaplant::twin::{Disturbance, TwinSpec};
use seaplant::{Dof, IdentifyOptions, Method};

const SEEDS: std::ops::RangeInclusive<u64> = 1..=3;

/// Median errors of surge over a few seeds, %.
fn surge(disturbances: &str) -> Vec<Row> {
    let options = IdentifyOptions { methods: vec![Method::FilterError], ..Default::default() };
    let of_seed = |seed| {
        let spec = TwinSpec {
            seed,
            dofs: [Dof::Surge].into(),
            disturbances: Disturbance::parse_list(disturbances).expect("known"),
            ..TwinSpec::jason2()
        };
        sample(&spec, &options).expect("a valid twin")
    };
    summarise(&SEEDS.flat_map(of_seed).collect::<Vec<_>>())
}

fn error(rows: &[Row], parameter: ParameterName) -> f64 {
    let row = rows.iter().find(|row| row.parameter == parameter).expect("fitted");
    assert_eq!(row.failures, 0, "{row:?}");
    row.median_abs_error_percent
}

/// What one disturbance alone may cost, %: the design's targets.
const MASS_PERCENT: f64 = 2.0;
const DRAG_PERCENT: f64 = 5.0;

#[test]
fn each_disturbance_alone_leaves_mass_and_drag_right() {
    for disturbance in Disturbance::ALL {
        let rows = surge(disturbance.name());
        let (mass, drag) =
            (error(&rows, ParameterName::Mass), error(&rows, ParameterName::QuadraticDrag));
        assert!(mass < MASS_PERCENT, "{disturbance}: mass {mass:.2} %");
        assert!(drag < DRAG_PERCENT, "{disturbance}: drag {drag:.2} %");
    }
}

#[test]
fn all_disturbances_together_leave_mass_right() {
    let mass = error(&surge("all"), ParameterName::Mass);
    assert!(mass < MASS_PERCENT, "mass {mass:.2} %");
}
