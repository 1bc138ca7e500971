//! The whole identification, as those see it who wait for it.

use seaplant::twin::{TwinCampaign, TwinSpec, make};
use seaplant::{
    Compared, Dof, IdentifyOptions, Method, Stage, Trial, TrialSetup, differences, identify,
    identify_watched, stages,
};

/// Returns a twin of some axes, one minute each, with its trials.
fn dive(dofs: &[Dof]) -> (TwinCampaign, Vec<Trial>) {
    let dofs = dofs.iter().copied().collect();
    let spec = TwinSpec { dofs, duration_s: 60.0, ..TwinSpec::jason2() };
    let dive = make(&spec).expect("a dive");
    let logs = dive.trials.iter();
    let trials = logs.map(|log| {
        let (name, role, dofs) = (log.name.clone(), log.role, log.dofs.clone());
        let setup = TrialSetup { name, role, dofs, ..TrialSetup::default() };
        Trial::new(setup, &log.recording, &dive.vehicle).expect("a trial")
    });
    let trials = trials.collect();
    (dive, trials)
}

#[test]
fn plants_of_a_method_are_compared_also_where_none_is_recommended() {
    let (dive, trials) = dive(&[Dof::Surge]);
    let methods = vec![Method::EquationError];
    let options = IdentifyOptions { methods, ..IdentifyOptions::default() };
    let mut results = identify(&dive.vehicle, &trials, &options).results;
    results.plants.clear();
    assert!(results.method_of(Dof::Surge, Method::EquationError).is_some());
    assert!(results.method_of(Dof::Surge, Method::Paper).is_none());
    let both = [Compared::Fit(&results), Compared::Fit(&results)];
    let found = differences(&both, Some(Method::EquationError));
    assert_eq!(found.dofs.keys().collect::<Vec<_>>(), [&Dof::Surge]);
    assert!(differences(&both, None).dofs.is_empty());
}

#[test]
fn each_fit_is_told_before_it_is_made() {
    let dofs = [Dof::Surge, Dof::Yaw];
    let (dive, trials) = dive(&dofs);
    let methods = vec![Method::EquationError, Method::Paper];
    let options = IdentifyOptions { methods: methods.clone(), ..IdentifyOptions::default() };
    let mut told = Vec::new();
    let mut watch = |stage: &Stage| told.push(stage.clone());
    let found = identify_watched(&dive.vehicle, &trials, &options, &mut watch);
    let fits = dofs.iter().flat_map(|dof| methods.iter().map(|method| (vec![*dof], *method)));
    let expected = stages(&dive.vehicle, &trials, &options);
    let named = expected.iter().map(|stage| (stage.axes.clone(), stage.method));
    assert!(named.eq(fits));
    // One trial of 60 s at 10 Hz in each.
    assert!(told.iter().enumerate().all(|(k, stage)| stage.done == k && stage.samples == 601));
    // Axes take their turns as processors are free; each takes its methods in order.
    for dof in dofs {
        let of_axis = |stages: &[Stage]| -> Vec<Method> {
            stages.iter().filter(|stage| stage.axes == [dof]).map(|stage| stage.method).collect()
        };
        assert_eq!(of_axis(&told), of_axis(&expected));
    }
    assert!(told.iter().all(|stage| 0.0 < stage.cost_s.0 && stage.cost_s.0 < stage.cost_s.1));
    assert_eq!(found, identify(&dive.vehicle, &trials, &options));
}
