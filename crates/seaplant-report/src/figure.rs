//! Figures: drawn once by plotters, written as SVG and as PNG.

mod axis;
mod chart;
mod comparison;
mod curves;
mod font;
mod ink;
mod png_writer;
mod scene;
mod spectrum;
mod steady;
mod svg_writer;
mod thrust;
mod thumbnail;

use seaplant::results::{Results, Series};
use seaplant::{Dof, Method, Role};

use crate::Error;

pub(crate) use comparison::description as comparison_description;
pub(crate) use curves::scene as curves_scene;
pub(crate) use ink::{Ink, hex, style_sheet};
pub(crate) use scene::Scene;
pub(crate) use spectrum::{Amplitude, view as spectrum_view};
pub(crate) use steady::{description as steady_description, segments as steady_segments};
pub(crate) use svg_writer::inline as inline_svg;
pub(crate) use thrust::scene as thrust;
pub(crate) use thumbnail::Thumbnails;

/// A figure as files.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// A complete SVG document that follows the reader's light or dark setting.
    pub svg: Vec<u8>,
    /// 1280 pixels wide, on white.
    pub png: Vec<u8>,
}

/// Subject of a figure.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Subject {
    /// `plant` is the name of a plant of several axes.
    Comparison {
        plant: Option<String>,
        method: Method,
        role: Role,
    },
    Spectrum,
    Steady,
    Thrust,
}

/// A figure with its placement on the page.
#[derive(Clone, Debug)]
pub(crate) struct PlacedFigure {
    pub(crate) subject: Subject,
    /// Absent for a figure of the complete vehicle.
    pub(crate) dof: Option<Dof>,
    /// Empty for a figure of the complete vehicle.
    pub(crate) trial: String,
    /// Name of its files, without folder and extension.
    pub(crate) stem: String,
    pub(crate) caption: String,
    /// SVG for the page, which provides styles and title itself.
    pub(crate) inline: String,
    pub(crate) svg: Vec<u8>,
    /// `None` for a method that is not recommended.
    pub(crate) png: Option<Vec<u8>>,
}

impl Scene {
    /// Writes the scene as files.
    pub(crate) fn paint(&self) -> Result<Figure, Error> {
        Ok(Figure { svg: self.svg(), png: self.png()? })
    }

    fn svg(&self) -> Vec<u8> {
        svg_writer::document(self).into_bytes()
    }

    fn png(&self) -> Result<Vec<u8>, Error> {
        png_writer::document(self)
    }
}

/// A figure before it is painted.
struct Draft {
    subject: Subject,
    dof: Option<Dof>,
    trial: String,
    stem: String,
    scene: Scene,
    has_png: bool,
}

/// Figures of a report, drawn one by one and written in parallel.
#[derive(Default)]
pub(crate) struct FigureSet {
    drafts: Vec<Draft>,
}

impl FigureSet {
    /// Draws a figure from a series, which may then be dropped. `stem` is the name of its files.
    pub(crate) fn draw(
        &mut self,
        series: &Series,
        results: &Results,
        stem: &str,
    ) -> Result<(), Error> {
        let (subject, dof, trial, scene) = match series {
            Series::Comparison(figure) => (
                Subject::Comparison {
                    plant: figure.plant.clone(),
                    method: figure.method,
                    role: figure.role,
                },
                figure.comparison.dof,
                &figure.comparison.trial,
                comparison::scene(figure)?,
            ),
            Series::Spectrum(figure) => {
                (Subject::Spectrum, figure.dof, &figure.trial, spectrum::scene(figure, results)?)
            }
            Series::Steady(figure) => {
                (Subject::Steady, figure.dof, &figure.trial, steady::scene(figure, results)?)
            }
        };
        let recommended = results.plants.get(dof.name()).map(|plant| plant.method);
        let has_png = match &subject {
            Subject::Comparison { plant: None, method, .. } => {
                recommended.is_none_or(|recommended| recommended == *method)
            }
            _ => true,
        };
        let (dof, trial, stem) = (Some(dof), trial.clone(), stem.to_owned());
        self.drafts.push(Draft { subject, dof, trial, stem, scene, has_png });
        Ok(())
    }

    /// Writes every figure, with that of bollard pull if there is one.
    pub(crate) fn placed(mut self, results: &Results) -> Result<Vec<PlacedFigure>, Error> {
        if let Some(bollard_pull) = &results.bollard_pull {
            self.drafts.push(Draft {
                subject: Subject::Thrust,
                dof: None,
                trial: String::new(),
                stem: "thrust".to_owned(),
                scene: thrust(bollard_pull)?,
                has_png: true,
            });
        }
        painted(self.drafts)
    }
}

fn painted(drafts: Vec<Draft>) -> Result<Vec<PlacedFigure>, Error> {
    let workers = std::thread::available_parallelism().map_or(1, usize::from).min(drafts.len());
    if workers < 2 {
        return drafts.into_iter().map(Draft::paint).collect();
    }
    let shares = shared_out(drafts, workers);
    let painted: Vec<Result<Vec<PlacedFigure>, Error>> = std::thread::scope(|scope| {
        let running: Vec<_> = shares
            .into_iter()
            .map(|share| scope.spawn(|| share.into_iter().map(Draft::paint).collect()))
            .collect();
        running.into_iter().map(joined).collect()
    });
    painted.into_iter().try_fold(Vec::new(), |mut all, share| {
        all.extend(share?);
        Ok(all)
    })
}

type Share<'scope> = std::thread::ScopedJoinHandle<'scope, Result<Vec<PlacedFigure>, Error>>;

fn joined(share: Share<'_>) -> Result<Vec<PlacedFigure>, Error> {
    share.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// Splits into consecutive shares of about equal length.
fn shared_out(mut drafts: Vec<Draft>, workers: usize) -> Vec<Vec<Draft>> {
    let length = drafts.len().div_ceil(workers);
    let mut shares = Vec::new();
    while drafts.len() > length {
        let rest = drafts.split_off(length);
        shares.push(std::mem::replace(&mut drafts, rest));
    }
    shares.push(drafts);
    shares
}

impl Draft {
    fn paint(self) -> Result<PlacedFigure, Error> {
        Ok(PlacedFigure {
            subject: self.subject,
            dof: self.dof,
            trial: self.trial,
            stem: self.stem,
            inline: inline_svg(&self.scene),
            svg: self.scene.svg(),
            png: self.has_png.then(|| self.scene.png()).transpose()?,
            caption: self.scene.description,
        })
    }
}
