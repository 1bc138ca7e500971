//! Motion of a plant of several axes over one trial, axis below axis.

use seaplant::results::ComparisonFigure;
use seaplant::{Comparison, Dof, Role};

use super::values::Cut;
use super::{Chart, Horizontal, Line, Panel, Subject};
use crate::figure::Ink;
use crate::number::{or_absent, significant};
use crate::paths::Paths;
use crate::words;

/// Height of a panel, px.
const PANEL_HEIGHT: u16 = 130;

/// Trials, each by one plant of several axes.
#[derive(Default)]
pub(super) struct Togethers(Vec<Together>);

/// Motion of one trial by one plant.
struct Together {
    plant: String,
    trial: String,
    role: Role,
    panels: Vec<Panel>,
    /// Description of each axis.
    says: Vec<String>,
    stems: Vec<(Dof, String)>,
}

impl Togethers {
    /// Adds one axis of a trial; `stem` names its files.
    pub(super) fn add(&mut self, plant: &str, figure: &ComparisonFigure, stem: &str) {
        let trial = &figure.comparison.trial;
        let known = self.0.iter().position(|known| known.plant == plant && known.trial == *trial);
        let place = known.unwrap_or_else(|| {
            self.0.push(Together {
                plant: plant.to_owned(),
                trial: trial.clone(),
                role: figure.role,
                panels: Vec::new(),
                says: Vec::new(),
                stems: Vec::new(),
            });
            self.0.len() - 1
        });
        self.0[place].add(&figure.comparison, stem);
    }

    /// Returns a chart for each trial.
    pub(super) fn charts(self, ids: &mut Paths) -> Vec<Chart> {
        self.0.into_iter().map(|trial| trial.chart(ids)).collect()
    }
}

impl Together {
    fn add(&mut self, comparison: &Comparison, stem: &str) {
        let Comparison { dof, time_s, measured, simulated, velocity, .. } = comparison;
        let cut = Cut::new(time_s);
        let difference: Vec<f64> = simulated.iter().zip(measured).map(|(s, m)| s - m).collect();
        let lines = vec![
            Line::new("measured", Ink::Measured, cut.pack(measured)),
            Line::new("simulated", Ink::Simulated, cut.pack(simulated)),
            Line::new("simulated − measured", Ink::Difference, cut.pack(&difference)),
        ];
        let unit = dof.units().velocity;
        self.panels.push(Panel {
            label: format!("{}, {unit}", words::capitalised(dof.name())),
            height: PANEL_HEIGHT,
            x: cut.times(),
            lines,
            levels: vec![0.0],
            ..Panel::default()
        });
        self.says.push(format!(
            "{dof} e = {} {unit}, {} for a model that never moves, R² = {}",
            significant(velocity.mean_abs_error, 3),
            significant(velocity.null_error, 3),
            or_absent(velocity.r_squared, 4)
        ));
        self.stems.push((*dof, stem.to_owned()));
    }

    fn chart(self, ids: &mut Paths) -> Chart {
        let role = words::role(self.role);
        let csv =
            |(dof, stem): &(Dof, String)| (format!("{dof} CSV"), format!("series/{stem}.csv"));
        Chart {
            subject: Subject::Motion(self.role),
            id: ids.unique(&["together", &self.plant, &self.trial]),
            title: format!("{} · {role} trial", self.trial),
            description: format!(
                "Trial “{}”, {role}, all axes simulated together from the logged forces. Mean |simulated − measured|: {}.",
                self.trial,
                self.says.join("; ")
            ),
            files: self.stems.iter().map(csv).collect(),
            // In print, the plant's predictions are more informative than its fits.
            stills: match self.role {
                Role::HoldOut => self.stems.into_iter().map(|(_, stem)| stem).collect(),
                _ => Vec::new(),
            },
            plant: self.plant,
            x: Horizontal::seconds("time"),
            panels: self.panels,
        }
    }
}
