//! The paper's tables and figures, for this campaign.

use seaplant::results::{Alone, Parameter, PlantResult, Results, SegmentResult, SteadyResult};
use seaplant::{Dof, Method};
use serde::Serialize;

use super::plant_section::with_interval;
use super::table::{Row, Table};
use super::{ChartView, FigureView, Pictures};
use crate::chart;
use crate::figure::{PlacedFigure, Subject};
use crate::number::{ABSENT, Rounded, chosen, or_absent, significant};
use crate::words;

#[derive(Serialize)]
pub(crate) struct PaperSection {
    table_2: Table,
    table_3: Table,
    thrusters: Table,
    table_4: Table,
    table_5: Table,
    table_6: Vec<Table>,
    /// For each trial the paper's method and the recommended one.
    comparisons: Vec<Vec<FigureView>>,
    steady: Vec<ChartView>,
}

pub(crate) fn view(results: &Results, pictures: Pictures<'_>) -> PaperSection {
    PaperSection {
        table_2: table_2(results),
        table_3: table_3(results),
        thrusters: thrusters(results),
        table_4: table_4(results),
        table_5: table_5(results),
        table_6: results.steady.iter().flat_map(|(dof, s)| table_6(*dof, s)).collect(),
        comparisons: comparisons(results, pictures.placed),
        steady: pictures.charts(|chart| chart.subject == chart::Subject::Steady),
    }
}

fn comparisons(results: &Results, placed: &[PlacedFigure]) -> Vec<Vec<FigureView>> {
    let mut pairs: Vec<Vec<&PlacedFigure>> = Vec::new();
    for figure in placed {
        let Subject::Comparison { plant: None, method, .. } = figure.subject else { continue };
        let recommended = figure.dof.and_then(|dof| results.plants.get(dof.name()));
        let is_paper = method == Method::Paper;
        if !is_paper && recommended.is_none_or(|plant| plant.method != method) {
            continue;
        }
        let is_of_same = |pair: &Vec<&PlacedFigure>| {
            pair.iter().any(|known| known.dof == figure.dof && known.trial == figure.trial)
        };
        match pairs.iter_mut().find(|pair| is_of_same(pair)) {
            Some(pair) if is_paper => pair.insert(0, figure),
            Some(pair) => pair.push(figure),
            None => pairs.push(vec![figure]),
        }
    }
    pairs.into_iter().map(|pair| pair.into_iter().map(FigureView::new).collect()).collect()
}

/// Returns definitions, then both kinds of parameter of each recommended plant.
fn table_2(results: &Results) -> Table {
    let head =
        ["DOF", "α = 1/m", "β = −d_Q/m", "μ = −d_L/m", "bias = −b/m", "m", "d_Q", "d_L", "b"];
    let rows = results.alone().map(|(dof, _, alone)| {
        let lumped = alone.lumped;
        let physical = lumped.to_physical();
        let all = [
            lumped.alpha,
            lumped.beta,
            lumped.mu,
            lumped.bias,
            physical.mass,
            physical.d_quadratic,
            physical.d_linear,
            physical.bias_force,
        ];
        Row::new(
            std::iter::once(words::capitalised(dof.name()))
                .chain(all.map(|value| significant(value, 4))),
        )
    });
    Table::new(
        "Lumped and physical parameters of the recommended plants, as Table 2",
        head,
        rows.collect(),
    )
}

fn table_3(results: &Results) -> Table {
    let head = [
        "Instrument",
        "Standard deviation of one sample",
        "Rate, Hz",
        "Position, m",
        "Rotation, deg",
    ];
    let rows = results.sensors.iter().map(|sensor| {
        let std = sensor.std.map(|std| format!("{} {}", chosen(std), sensor.unit));
        Row::new([
            sensor.name.clone(),
            std.unwrap_or_else(|| ABSENT.to_owned()),
            sensor.rate_hz.map_or_else(|| ABSENT.to_owned(), chosen),
            vector(&sensor.position_m),
            vector(&sensor.rotation_deg),
        ])
    });
    Table::new("Instruments, as Table 3", head, rows.collect()).left(1)
}

fn thrusters(results: &Results) -> Table {
    let head = ["Thruster", "Input", "Curve", "Uncertain by, %", "Position, m", "Direction"];
    let rows = results.thrusters.iter().map(|thruster| {
        Row::new([
            thruster.name.clone(),
            thruster.input.clone(),
            thruster.curve.clone(),
            thruster.thrust_std.map_or(ABSENT.to_owned(), |[forward, reverse]| {
                format!("{} ahead, {} in reverse", chosen(100.0 * forward), chosen(100.0 * reverse))
            }),
            vector(&thruster.position_m),
            vector(&thruster.direction),
        ])
    });
    Table::new("Thrusters", head, rows.collect()).left(4)
}

fn vector(values: &[f64; 3]) -> String {
    values.map(chosen).join(", ")
}

/// Relative amplitude of force below which an oscillation is rounding error of a constant.
const LEAST_OSCILLATION: f64 = 1e-3;

fn span(from_s: f64, to_s: f64) -> String {
    format!("{} to {}", chosen(from_s), chosen(to_s))
}

fn table_4(results: &Results) -> Table {
    let head = [
        "Trial",
        "DOF",
        "Use",
        "Span, s",
        "Dominant, Hz",
        "Dominant, rad/s",
        "Amplitude there",
        "Greatest force",
        "Greatest speed",
        "Motion from",
        "Rate, Hz",
        "Gaps, s",
    ];
    let mut rows = Vec::new();
    for trial in &results.trials {
        for (dof, axis) in &trial.axes {
            let units = dof.units();
            let oscillates = axis.dominant_amplitude > LEAST_OSCILLATION * axis.force_max.abs();
            let dominant_hz = axis.dominant_hz.filter(|_| oscillates);
            let with_unit = |value: f64, unit: &str| format!("{} {unit}", significant(value, 3));
            rows.push(Row::new([
                trial.name.clone(),
                dof.name().to_owned(),
                words::role(trial.role).to_owned(),
                span(axis.from_s, axis.to_s),
                or_absent(dominant_hz, 3),
                or_absent(dominant_hz.map(|hz| std::f64::consts::TAU * hz), 3),
                dominant_hz.map_or_else(
                    || ABSENT.to_owned(),
                    |_| with_unit(axis.dominant_amplitude, units.force),
                ),
                with_unit(axis.force_max, units.force),
                axis.speed_max
                    .map_or_else(|| ABSENT.to_owned(), |speed| with_unit(speed, units.velocity)),
                axis.motion.clone(),
                chosen(axis.source_hz),
                chosen(axis.gap_s),
            ]));
        }
    }
    Table::new("Trials, as Table 4", head, rows).left(4)
}

/// Returns the recommended method and the paper's, side by side.
fn table_5(results: &Results) -> Table {
    let head = [
        "DOF",
        "Method",
        "α",
        "β",
        "μ",
        "bias",
        "e fitted",
        "e held out",
        "Mass or inertia",
        "d_Q",
        "b",
    ];
    let mut rows = Vec::new();
    for (dof, plant, alone) in results.alone() {
        rows.extend(row_5(dof, plant, alone).map(|row| row.strong_if(true)));
        let paper = results.methods_of(dof).find(|(method, ..)| *method == Method::Paper);
        let paper = paper.filter(|(method, ..)| *method != plant.method);
        rows.extend(paper.and_then(|(_, plant, alone)| row_5(dof, plant, alone)));
    }
    let note = "The paper’s method filters velocity but not thrust, which inflates mass by about one over the filter’s gain at the excited frequency. That this explains the masses of the paper itself is plausible and unproven: no logs survive.";
    Table::new("Identified plants, as Table 5", head, rows).left(2).noted(note)
}

fn row_5(dof: Dof, plant: &PlantResult, alone: &Alone) -> Option<Row> {
    let (lumped, parameters) = (&alone.lumped, plant.by_axis.get(&dof)?);
    let units = dof.units();
    let absent = || ABSENT.to_owned();
    let e = |e: Option<f64>| {
        e.map_or_else(absent, |e| format!("{} {}", significant(e, 3), units.velocity))
    };
    let value = |parameter: Option<&Parameter>| {
        parameter.map_or_else(absent, |p| format!("{} {}", Rounded::of(p).value, p.unit))
    };
    Some(Row::new([
        words::capitalised(dof.name()),
        words::method(plant.method),
        significant(lumped.alpha, 3),
        significant(lumped.beta, 3),
        significant(lumped.mu, 3),
        significant(lumped.bias, 3),
        e(plant.fitted(dof).and_then(|score| score.mean_abs_error)),
        e(plant.held_out(dof).and_then(|score| score.mean_abs_error)),
        value(Some(&parameters.mass)),
        value(parameters.quadratic_drag.as_ref()),
        value(parameters.bias_force.as_ref()),
    ]))
}

fn table_6(dof: Dof, steady: &SteadyResult) -> Vec<Table> {
    let mut tables = vec![segments(dof, steady), joint(dof, steady)];
    if !steady.pairs.is_empty() {
        tables.push(pairs(dof, steady));
    }
    tables
}

fn segments(dof: Dof, steady: &SteadyResult) -> Table {
    let units = dof.units();
    let head = [
        "Trial".to_owned(),
        "Stretch, s".to_owned(),
        "Direction".to_owned(),
        "Thrust, %".to_owned(),
        format!("Force, {}", units.force),
        format!("Velocity, {}", units.velocity),
        format!("d_Q, {}", units.quadratic_drag),
        format!("e, {}", units.velocity),
        format!("e of the joint fit, {}", units.velocity),
    ];
    let rows = steady.segments.iter().map(|segment| {
        Row::new([
            segment.trial.clone(),
            span(segment.from_s, segment.to_s),
            direction(dof, segment).to_owned(),
            significant(100.0 * segment.force_part.abs(), 2),
            significant(segment.force, 4),
            significant(segment.velocity, 3),
            with_interval(Some(&segment.quadratic_drag)),
            significant(segment.mean_abs_error, 3),
            or_absent(segment.joint_error, 3),
        ])
    });
    let caption = format!("Drag from steady stretches, {dof}, as Table 6");
    Table::new(&caption, head, rows.collect()).left(3)
}

fn direction(dof: Dof, segment: &SegmentResult) -> &'static str {
    let positive = segment.force >= 0.0;
    match (dof, positive) {
        (Dof::Heave, true) => "down",
        (Dof::Heave, false) => "up",
        (Dof::Surge, true) => "forward",
        (Dof::Surge, false) => "aft",
        (_, true) => "positive",
        (_, false) => "negative",
    }
}

fn joint(dof: Dof, steady: &SteadyResult) -> Table {
    let units = dof.units();
    let of =
        |name: &str, value: String, unit: &str| Row::new([name.to_owned(), value, unit.to_owned()]);
    let rows = vec![
        of(
            "Mean of the stretches’ d_Q",
            significant(steady.mean_quadratic_drag, 5),
            units.quadratic_drag,
        ),
        of(
            "d_Q of all together",
            with_interval(steady.quadratic_drag.as_ref()),
            units.quadratic_drag,
        ),
        of("b of all together", with_interval(steady.bias_force.as_ref()), units.force),
    ];
    let caption = format!("All steady stretches together, {dof}: τ = d_Q v|v| + b");
    Table::new(&caption, ["", "Value ± standard deviation [95 % interval]", "Unit"], rows)
}

fn pairs(dof: Dof, steady: &SteadyResult) -> Table {
    let head = [
        "Positive force".to_owned(),
        "Negative force".to_owned(),
        format!("b that explains both, {}", dof.units().force),
    ];
    let rows = steady.pairs.iter().map(|pair| {
        Row::new([
            pair.positive.clone(),
            pair.negative.clone(),
            with_interval(Some(&pair.bias_force)),
        ])
    });
    Table::new(&format!("Pairs at one thrust, {dof}"), head, rows.collect()).left(2)
}
