//! Caveats, the most severe first, each once.

use seaplant::results::Results;
use seaplant::{Caveat, Severity};
use serde::Serialize;

use super::advice::{self, Advice};
use crate::words;

/// Important caveats, and minor notes.
#[derive(Default, Serialize)]
pub(crate) struct Doubts {
    main: Vec<Doubt>,
    notes: Vec<Doubt>,
}

#[derive(Serialize)]
struct Doubt {
    severity: &'static str,
    what: String,
    places: String,
    message: String,
    advice: Advice,
}

/// Returns the doubts about the campaign, its recommended plants, steady stretches and thrust
/// curve.
pub(crate) fn of_campaign(results: &Results) -> Doubts {
    let mut found: Vec<(String, &Caveat)> = Vec::new();
    let alone = results.alone().map(|(_, plant, _)| plant);
    for plant in alone.chain(results.together().map(|(_, plant)| plant)) {
        // A plant of several axes has doubts of its own about the same axis.
        let has_another = plant.is_alone()
            && results.together().any(|(_, other)| other.axes.contains(&plant.first_axis()));
        let name = words::capitalised(&super::plant_section::axes(plant));
        let place = if has_another { format!("{name} by itself") } else { name };
        found.extend(plant.caveats.iter().map(|caveat| (place.clone(), caveat)));
    }
    for (dof, steady) in &results.steady {
        let place = format!("{}, steady", words::capitalised(dof.name()));
        found.extend(steady.caveats.iter().map(|caveat| (place.clone(), caveat)));
    }
    let bollard = results.bollard_pull.iter().flat_map(|pull| &pull.caveats);
    found.extend(bollard.map(|caveat| ("Thrust curve".to_owned(), caveat)));
    found.extend(results.caveats.iter().map(|caveat| ("Campaign".to_owned(), caveat)));
    collected(found)
}

/// Merges equal doubts from several places.
pub(crate) fn collected(found: Vec<(String, &Caveat)>) -> Doubts {
    let mut merged: Vec<(Vec<String>, &Caveat)> = Vec::new();
    for (place, caveat) in found {
        match merged.iter_mut().find(|(_, other)| *other == caveat) {
            Some((places, _)) if places.contains(&place) => {}
            Some((places, _)) => places.push(place),
            None => merged.push((vec![place], caveat)),
        }
    }
    merged.sort_by_key(|(_, caveat)| std::cmp::Reverse(caveat.severity));
    let mut doubts = Doubts::default();
    for (places, caveat) in merged {
        let doubt = Doubt {
            severity: words::severity(caveat.severity),
            what: words::caveat(caveat.code),
            places: places.join(", "),
            message: words::capitalised(&caveat.message),
            advice: advice::explain(caveat.code),
        };
        let list =
            if caveat.severity == Severity::Note { &mut doubts.notes } else { &mut doubts.main };
        list.push(doubt);
    }
    doubts
}

#[cfg(test)]
mod tests {
    use seaplant::{CaveatCode, Dof};

    use super::*;
    use crate::fixture;

    #[test]
    fn doubts_of_an_axis_by_itself_are_told_from_those_of_a_plant_that_has_it() {
        let mut results = fixture::identification().results;
        results.plants.retain(|_, plant| plant.is_alone());
        let caveat = Caveat::warning(CaveatCode::CoupledAxes, "turning moves surge");
        for plant in results.plants.values_mut() {
            plant.caveats = vec![caveat.clone()];
        }
        let places = |results: &Results| {
            let all = of_campaign(results).main.into_iter();
            all.filter(|doubt| doubt.message == "Turning moves surge")
                .map(|doubt| doubt.places)
                .collect::<Vec<_>>()
        };
        assert_eq!(places(&results), ["Surge"]);
        let mut plant = fixture::plant_of_several_axes();
        plant.axes = vec![Dof::Surge, Dof::Yaw];
        results.plants.insert("surge-yaw".to_owned(), plant);
        assert_eq!(places(&results), ["Surge by itself"]);
    }
}
