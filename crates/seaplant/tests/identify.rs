//! The whole identification, as those see it who wait for it.

use seaplant::twin::{TwinSpec, make};
use seaplant::{
    Dof, IdentifyOptions, Method, Stage, Trial, TrialSetup, identify, identify_watched,
};

#[test]
fn each_fit_is_told_before_it_is_made() {
    let dofs = [Dof::Surge, Dof::Yaw];
    let spec = TwinSpec { dofs: dofs.into(), duration_s: 60.0, ..TwinSpec::jason2() };
    let dive = make(&spec).expect("a dive");
    let logs = dive.trials.iter();
    let trials: Vec<Trial> = logs
        .map(|log| {
            let (name, role, dofs) = (log.name.clone(), log.role, log.dofs.clone());
            let setup = TrialSetup { name, role, dofs, ..TrialSetup::default() };
            Trial::new(setup, &log.recording, &dive.vehicle).expect("a trial")
        })
        .collect();
    let methods = vec![Method::EquationError, Method::Paper];
    let options = IdentifyOptions { methods: methods.clone(), ..IdentifyOptions::default() };
    let mut told = Vec::new();
    let found =
        identify_watched(&dive.vehicle, &trials, &options, &mut |stage: Stage| told.push(stage));
    let fits = dofs.iter().flat_map(|dof| methods.iter().map(|method| (*dof, *method)));
    let expected: Vec<Stage> =
        fits.enumerate().map(|(done, (dof, method))| Stage { dof, method, done, of: 4 }).collect();
    assert_eq!(told, expected);
    assert_eq!(found, identify(&dive.vehicle, &trials, &options));
}
