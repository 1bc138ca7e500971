//! The vehicle of these tests.

use std::path::Path;

use seaplant::exchange::PlantModel;
use seaplant_campaign::read_plant_file;

/// Returns the published BlueROV2 Heavy.
pub fn bluerov() -> PlantModel {
    let file = read_plant_file(Path::new("published:bluerov2-heavy-von-benzon-2022"));
    file.expect("readable").expect("a table").model().expect("possible")
}
