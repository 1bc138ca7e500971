//! A prediction as one page that opens in any browser without a network.

use seaplant::Dof;
use seaplant::exchange::{PlantModel, Prediction};

use crate::Error;
use crate::figure::{inline_svg, prediction_scene, style_sheet};
use crate::words::escaped;

/// The page of a prediction: what was driven, a chart for each axis, what to mind.
///
/// # Errors
/// [`Error::Figure`].
pub fn prediction_page(
    model: &PlantModel,
    prediction: &Prediction,
    lines: &[String],
) -> Result<Vec<u8>, Error> {
    let mut charts = String::new();
    for &dof in model.plant.axes() {
        let scene = prediction_scene(prediction, dof)?;
        charts += &format!(
            "<figure>{}<figcaption>{}</figcaption></figure>\n",
            inline_svg(&scene),
            escaped(&scene.description)
        );
    }
    let lines: String = lines.iter().map(|line| format!("<li>{}</li>\n", escaped(line))).collect();
    let name = escaped(&model.name);
    let unknown: Vec<&str> = model.unknown_axes().iter().map(|dof: &Dof| dof.name()).collect();
    let unknown = match unknown.is_empty() {
        true => String::new(),
        false => {
            format!("<p>Axes without a plant, which do not move: {}.</p>\n", unknown.join(", "))
        }
    };
    let page = format!(
        "{MARK}\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{name}: prediction</title>\n<style>body{{font-family:sans-serif;max-width:44rem;margin:1rem auto;padding:0 1rem}}figure{{margin:0 0 1rem}}\n{}</style></head>\n<body><h1>{name}: predicted motion</h1>\n{unknown}<ul>\n{lines}</ul>\n{charts}</body></html>\n",
        style_sheet()
    );
    Ok(page.into_bytes())
}

/// What every such page begins with.
const MARK: &str = "<!DOCTYPE html><!-- seaplant simulate -->";

/// Whether a file begins as such a page.
pub fn is_prediction_page(bytes: &[u8]) -> bool {
    bytes.starts_with(MARK.as_bytes())
}
