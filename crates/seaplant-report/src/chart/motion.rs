//! Measured and simulated motion of one trial, by every method, with the force that drove it.

use seaplant::results::{ComparisonFigure, Results};
use seaplant::{Comparison, Dof, Method, PositionComparison, Role, ScoredMotion};

use super::values::Cut;
use super::{Chart, Horizontal, Line, Panel, Subject, Values, memory};
use crate::figure::{Ink, comparison_description};
use crate::paths::Paths;
use crate::words;

/// Motions, each by several methods.
#[derive(Default)]
pub(super) struct Motions(Vec<Motion>);

/// Motion of one trial of one degree of freedom.
struct Motion {
    quantity: ScoredMotion,
    dof: Dof,
    trial: String,
    role: Role,
    recommended: Method,
    description: String,
    /// Stem of the recommended method, else of the first.
    stem: String,
    cut: Cut,
    samples: usize,
    velocity: Vec<Line>,
    difference: Vec<Line>,
    position: Option<(Cut, Vec<Line>)>,
    force: Values,
    memory: Vec<memory::Memory>,
}

impl Motions {
    /// Adds a method's simulation; `stem` names its files.
    pub(super) fn add(&mut self, figure: &ComparisonFigure, results: &Results, stem: &str) {
        let Comparison { dof, trial, .. } = &figure.comparison;
        let known = self.0.iter().position(|known| known.dof == *dof && known.trial == *trial);
        let place = known.unwrap_or_else(|| {
            let plant = results.plants.get(dof.name());
            self.0.push(Motion::new(figure, plant.map_or(figure.method, |p| p.method)));
            self.0.len() - 1
        });
        self.0[place].add(figure, stem);
    }

    /// Returns the charts, and for each degree of freedom one of the errors' autocorrelation.
    pub(super) fn charts(self, ids: &mut Paths) -> Vec<Chart> {
        let mut charts = Vec::new();
        for dof in Dof::ALL {
            let of_dof = || self.0.iter().filter(|motion| motion.dof == dof);
            charts.extend(of_dof().map(|motion| motion.chart(ids)));
            let memories = of_dof().flat_map(|motion| &motion.memory);
            charts.extend(memory::chart(dof, memories.collect(), ids));
        }
        charts
    }
}

impl Motion {
    fn new(figure: &ComparisonFigure, recommended: Method) -> Self {
        let Comparison { dof, trial, time_s, force, measured, position, .. } = &figure.comparison;
        let cut = Cut::new(time_s);
        let position = position.as_ref().map(|PositionComparison { time_s, measured, .. }| {
            let cut = Cut::new(time_s);
            let line = Line::new("measured", Ink::Measured, cut.pack(measured));
            (cut, vec![line])
        });
        Self {
            quantity: figure.comparison.quantity,
            dof: *dof,
            trial: trial.clone(),
            role: figure.role,
            recommended,
            description: String::new(),
            stem: String::new(),
            samples: time_s.len(),
            velocity: vec![Line::new("measured", Ink::Measured, cut.pack(measured))],
            difference: Vec::new(),
            position,
            force: cut.pack(force),
            memory: Vec::new(),
            cut,
        }
    }

    fn add(&mut self, figure: &ComparisonFigure, stem: &str) {
        let Comparison { time_s, measured, simulated, position, .. } = &figure.comparison;
        // Every method is compared with the same measurements.
        debug_assert_eq!(time_s.len(), self.samples);
        let is_recommended = figure.method == self.recommended;
        if is_recommended || self.stem.is_empty() {
            self.description = comparison_description(figure);
            stem.clone_into(&mut self.stem);
        }
        let name = words::method(figure.method);
        let line = |y: Values| {
            Line::new(name.clone(), ink(figure.method, self.recommended), y)
                .shown_if(is_recommended)
        };
        let difference: Vec<f64> = simulated.iter().zip(measured).map(|(s, m)| s - m).collect();
        let (velocity, of_difference) =
            (line(self.cut.pack(simulated)), line(self.cut.pack(&difference)));
        if let (Some((cut, lines)), Some(position)) = (&mut self.position, position) {
            lines.push(line(cut.pack(&position.simulated)));
        }
        self.velocity.push(velocity);
        self.difference.push(of_difference);
        if is_recommended {
            self.memory.extend(memory::Memory::new(&self.trial, self.role, time_s, &difference));
        }
    }

    fn chart(&self, ids: &mut Paths) -> Chart {
        let units = self.dof.units();
        let panel = |label: &str, unit: &str, height, lines: &[Line]| Panel {
            label: format!("{label}, {unit}"),
            height,
            x: self.cut.times(),
            lines: self.ordered(lines),
            ..Panel::default()
        };
        let unit = self.quantity.unit(self.dof);
        let name = words::capitalised(self.quantity.name());
        let mut panels = vec![panel(&name, unit, 220, &self.velocity)];
        panels.push(Panel {
            levels: vec![0.0],
            ..panel("Simulated − measured", unit, 130, &self.difference)
        });
        panels.extend(self.position.as_ref().map(|(cut, lines)| Panel {
            x: cut.times(),
            ..panel(position_name(self.dof), units.position, 180, lines)
        }));
        let force = [Line::new("force", Ink::Force, self.force.clone())];
        panels.push(panel("Force", units.force, 130, &force));
        Chart {
            subject: Subject::Motion(self.role),
            id: ids.unique(&["motion", self.dof.name(), &self.trial]),
            title: format!("{} · {} trial", self.trial, words::role(self.role)),
            description: self.description(),
            files: ["svg", "png", "csv"].map(|kind| file(kind, &self.stem)).to_vec(),
            plant: self.dof.name().to_owned(),
            stills: Vec::new(),
            x: Horizontal::seconds("time"),
            panels,
        }
    }

    /// Orders the recommended method before the others.
    fn ordered(&self, lines: &[Line]) -> Vec<Line> {
        let mut lines = lines.to_vec();
        lines.sort_by_key(|line| !line.shown);
        lines
    }

    fn description(&self) -> String {
        let mut text = self.description.clone();
        let part = self.cut.samples_a_part;
        if part > 1 {
            text.push_str(&format!(
                " Of every {part} samples the least and the greatest are drawn; the CSV file has all."
            ));
        }
        text
    }
}

pub(super) fn position_name(dof: Dof) -> &'static str {
    match dof {
        Dof::Heave => "Depth",
        Dof::Yaw => "Heading",
        _ => "Position",
    }
}

/// Returns a file of a figure: its kind and path.
pub(super) fn file(kind: &str, stem: &str) -> (String, String) {
    let folder = if kind == "csv" { "series" } else { "figures" };
    (kind.to_uppercase(), format!("{folder}/{stem}.{kind}"))
}

/// Returns the ink: the recommended method looks as in the figures, the others are distinct.
fn ink(method: Method, recommended: Method) -> Ink {
    if method == recommended {
        return Ink::Simulated;
    }
    let others = [Ink::Other1, Ink::Other2, Ink::Other3, Ink::Other4];
    let rest = Method::ALL.iter().filter(|other| **other != recommended);
    let place = rest.clone().position(|other| *other == method).unwrap_or_default();
    others[place % others.len()]
}
