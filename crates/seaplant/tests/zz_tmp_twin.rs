use seaplant::estimate::*;
use seaplant::twin::{Disturbance, TwinSpec, make};
use seaplant::{Dof, Role, Terms, Trial, TrialSetup, VelocitySource};
fn med(mut v: Vec<f64>) -> f64 { v.sort_by(f64::total_cmp); if v.is_empty() {f64::NAN} else {v[v.len()/2]} }
#[test]
fn measure() {
    for (case, seeds) in [("none", 40u64), ("tether", 40), ("current", 8), ("lag", 8), ("delay", 8)] {
        let camps: Vec<_> = (1..=seeds).map(|seed| make(&TwinSpec{seed, disturbances: Disturbance::parse_list(case).unwrap(), ..TwinSpec::jason2()}).unwrap()).collect();
        for (dof, diff) in [(Dof::Surge,false), (Dof::Sway,false), (Dof::Heave,false), (Dof::Yaw,false),(Dof::Yaw,true)] {
            let (mut m, mut d) = (vec![], vec![]);
            let mut cov = [0; 3]; let mut fails = 0; let mut neff = vec![]; let mut tf=vec![];
            for (i,c) in camps.iter().enumerate() {
                let made = c.trials.iter().find(|t| t.dof == dof && t.role == Role::Fit).unwrap();
                let setup = TrialSetup { name: made.name.clone(), role: made.role, dofs: vec![dof], ..Default::default() };
                let mut axis = [Trial::new(setup, &made.recording, &c.vehicle).unwrap().axis(dof, VelocitySource::Measured).unwrap()];
                let terms = Terms::default(); if diff { axis[0].motion = seaplant::Motion::Velocity(axis[0].velocity().unwrap()); }
                let start = fit_equation_error(dof, &axis, terms, &EquationErrorOptions::default()).unwrap();
                match fit_output_error(dof, &axis, terms, &start.lumped, &OutputErrorOptions::default()) {
                    Err(e) => { fails += 1; println!("{e}"); }
                    Ok(f) => {
                        let e = f.estimates(); let t = c.truth.plants[&dof];
                        if i < 8 { m.push(100.0*(e.mass.value/t.mass-1.0).abs()); d.push(100.0*(e.d_quadratic.unwrap().value/t.quadratic_drag-1.0).abs()); }
                        cov[0] += usize::from(e.mass.covers(t.mass));
                        cov[1] += usize::from(e.d_quadratic.unwrap().covers(t.quadratic_drag));
                        cov[2] += usize::from(e.bias_force.unwrap().covers(t.bias_force));
                        neff.push(f.effective_samples); tf.push(f.t_freedom);
                    }
                }
            }
            println!("{case:8} {dof:6} mass {:.2} dQ {:.2}  cover {:?}/{} fails {fails} neff {:.0} t {:.0}", med(m), med(d), cov, seeds, med(neff), med(tf));
        }
    }
}
