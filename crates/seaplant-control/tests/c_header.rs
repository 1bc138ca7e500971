//! The C controller on the exported C plant, beside the controller here on the plant here.

#![allow(clippy::print_stderr, reason = "a skipped test must be seen")]

use std::fs;
use std::process::Command;

use nalgebra::{Quaternion, UnitQuaternion, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use seaplant::Dof;
use seaplant::exchange::PlantModel;
use seaplant_campaign::read_plant_file;
use seaplant_control::{
    Actuators, Controller, Design, Law, Reference, State, Tuning, c_header, design,
};
use seaplant_export::{Permission, export, exporter};

/// The same arithmetic in another order, N and N m of some hundred.
const SAME: f64 = 1e-8;

/// Reads states and references, writes forces; then follows a step for a minute.
const MAIN: &str = r#"
#include <stdio.h>
#include "seaplant_control.h"
int main(void)
{
    double x[13], tau[6], y[19], current[3] = {0.0, 0.0, 0.0};
    struct seaplant_reference to;
    struct seaplant_memory memory = {{0.0}};
    int i, k, n;
    if (scanf("%d", &n) != 1)
        return 1;
    for (k = 0; k < n; ++k) {
        struct seaplant_memory fresh = {{0.0}};
        for (i = 0; i < 13; ++i)
            if (scanf("%lf", &x[i]) != 1)
                return 1;
        for (i = 0; i < 19; ++i)
            if (scanf("%lf", &y[i]) != 1)
                return 1;
        for (i = 0; i < 3; ++i) {
            to.position[i] = y[i];
            to.velocity[i] = y[3 + i];
            to.acceleration[i] = y[6 + i];
            to.turning[i] = y[13 + i];
            to.turning_rate[i] = y[16 + i];
        }
        for (i = 0; i < 4; ++i)
            to.attitude[i] = y[9 + i];
        seaplant_control(x, &to, &fresh, tau);
        for (i = 0; i < 6; ++i)
            printf("%.17g ", tau[i]);
        printf("\n");
    }
    for (i = 0; i < 13; ++i)
        x[i] = i == 3 ? 1.0 : 0.0;
    for (i = 0; i < 3; ++i)
        to.position[i] = to.velocity[i] = to.acceleration[i] = to.turning[i] = to.turning_rate[i] = 0.0;
    for (i = 0; i < 4; ++i)
        to.attitude[i] = i == 0 ? 1.0 : 0.0;
    to.position[0] = 0.5;
    for (k = 0; k < 1200; ++k) {
        if (k % 2 == 0)
            seaplant_control(x, &to, &memory, tau);
        seaplant_step(x, tau, current, 0.025);
    }
    printf("%.17g\n", x[0]);
    return 0;
}
"#;

fn model() -> PlantModel {
    let name = "published:bluerov2-heavy-von-benzon-2022";
    let file = read_plant_file(std::path::Path::new(name)).expect("readable").expect("a table");
    file.model().expect("possible")
}

fn random(rng: &mut ChaCha8Rng) -> (State, Reference) {
    let mut vector = |size: f64| Vector3::from_fn(|_, _| rng.random_range(-size..size));
    let attitude = UnitQuaternion::from_scaled_axis(vector(0.6));
    let (v, omega) = (vector(1.0), vector(0.5));
    let state = State {
        position_ned: vector(2.0),
        attitude,
        velocity: Vector6::new(v.x, v.y, v.z, omega.x, omega.y, omega.z),
    };
    let reference = Reference {
        position_ned: vector(2.0),
        velocity_ned: vector(0.5),
        acceleration_ned: vector(0.3),
        attitude: UnitQuaternion::from_scaled_axis(vector(0.6)),
        turning: vector(0.3),
        turning_rate: vector(0.2),
    };
    (state, reference)
}

fn line(state: &State, to: &Reference) -> String {
    let quaternion = |q: &UnitQuaternion<f64>| {
        let Quaternion { coords } = **q;
        [coords.w, coords.x, coords.y, coords.z]
    };
    let mut all: Vec<f64> = state.position_ned.iter().copied().collect();
    all.extend(quaternion(&state.attitude));
    all.extend(state.velocity.iter());
    for part in [&to.position_ned, &to.velocity_ned, &to.acceleration_ned] {
        all.extend(part.iter());
    }
    all.extend(quaternion(&to.attitude));
    all.extend(to.turning.iter().chain(to.turning_rate.iter()));
    all.iter().map(|x| format!("{x:?} ")).collect::<String>() + "\n"
}

#[test]
fn the_c_controller_gives_the_same_forces_and_settles_on_the_exported_plant() {
    if Command::new("cc").arg("--version").output().is_err() {
        eprintln!("passed over: there is no cc");
        return;
    }
    let model = model();
    for law in [Law::Pd, Law::Pid, Law::Exact, Law::NonExact] {
        let tuning =
            [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw].map(|dof| (dof, Tuning::new(0.15, 1.0)));
        let asked = Design { law, tuning: tuning.into(), sample_hz: 20.0, ..Design::default() };
        let mut actuators = Actuators::default();
        actuators.limit[0] = Some(60.0);
        let gains = design(&model.plant, &[], &actuators, &asked).expect("sound");
        let folder = tempfile::tempdir().expect("a folder");
        let plant = export(exporter("c").expect("known"), &model, Permission::Checked);
        for file in plant.expect("exported").files {
            fs::write(folder.path().join(file.path), file.bytes).expect("written");
        }
        let header = c_header(&model.name, &gains).expect("has a place");
        fs::write(folder.path().join("seaplant_control.h"), header).expect("written");
        fs::write(folder.path().join("main.c"), MAIN).expect("written");
        let warnings = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"];
        let built = Command::new("cc")
            .args(warnings)
            .args(["-o", "main", "main.c", "-lm"])
            .current_dir(folder.path())
            .output()
            .expect("cc runs");
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let cases: Vec<(State, Reference)> = (0..50).map(|_| random(&mut rng)).collect();
        let input: String = cases.iter().map(|(state, to)| line(state, to)).collect();
        fs::write(folder.path().join("input"), format!("{}\n{input}", cases.len()))
            .expect("written");
        let ran = Command::new(folder.path().join("main"))
            .stdin(fs::File::open(folder.path().join("input")).expect("there"))
            .output()
            .expect("it runs");
        let printed = String::from_utf8(ran.stdout).expect("numbers");
        let rows: Vec<Vec<f64>> = printed
            .lines()
            .map(|row| row.split_whitespace().map(|x| x.parse().expect("a number")).collect())
            .collect();
        for ((state, to), row) in cases.iter().zip(&rows) {
            let mut controller = Controller::new(model.plant.clone(), gains.clone(), &asked.speed);
            let force = controller.command(state, to);
            for i in 0..6 {
                assert!((force[i] - row[i]).abs() < SAME, "{law:?}: {force} against {row:?}");
            }
        }
        let end = rows.last().expect("the end")[0];
        assert!((end - 0.5).abs() < 0.02, "{law:?} ends at {end} m");
    }
}
