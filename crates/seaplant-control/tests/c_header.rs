//! The C controller on the exported C plant agrees with the controller here on the plant here.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use nalgebra::{Quaternion, UnitQuaternion, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use seaplant::Dof;
use seaplant::exchange::PlantModel;
use seaplant_control::{
    Actuators, Controller, Design, Law, Reference, State, Tuning, c_header, design,
};
use seaplant_export::{Permission, export, exporter};

use crate::vehicle::bluerov;

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
    x[0] = NAN;
    seaplant_control(x, &to, &memory, tau);
    if (tau[0] != 0.0)
        return 2;
    x[0] = 0.0;
    for (k = 0; k < 1200; ++k) {
        if (k % 2 == 0)
            seaplant_control(x, &to, &memory, tau);
        seaplant_step(x, tau, current, 0.025);
    }
    printf("%.17g\n", x[0]);
    return 0;
}
"#;

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

/// Builds a program with the exported plant.
fn build(folder: &Path, model: &PlantModel, main: &str) {
    let plant = export(exporter("c").expect("known"), model, Permission::Checked);
    for file in plant.expect("exported").files {
        fs::write(folder.join(file.path), file.bytes).expect("written");
    }
    fs::write(folder.join("main.c"), main).expect("written");
    let warnings = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"];
    let built = Command::new("cc")
        .args(warnings)
        .args(["-o", "main", "main.c", "-lm"])
        .current_dir(folder)
        .output()
        .expect("cc runs");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
}

fn has_cc() -> bool {
    let found = Command::new("cc").arg("--version").output().is_ok();
    if !found {
        eprintln!("passed over: there is no cc");
    }
    found
}

/// The exported plant alone: reads forces for 0.05 s, writes the state after it.
const PLANT: &str = r#"
#include <stdio.h>
#include "seaplant_plant.h"
int main(void)
{
    double x[13] = {0.0, 0.0, 0.0, 1.0}, tau[6], current[3] = {0.0, 0.0, 0.0};
    int i;
    for (;;) {
        for (i = 0; i < 6; ++i)
            if (scanf("%lf", &tau[i]) != 1)
                return 0;
        seaplant_step(x, tau, current, 0.025);
        seaplant_step(x, tau, current, 0.025);
        for (i = 0; i < 13; ++i)
            printf("%.17g ", x[i]);
        printf("\n");
        fflush(stdout);
    }
}
"#;

/// Returns the state of the exported plant after a minute under a controller, by axis.
fn settled(program: &Path, controller: &mut Controller, to: &Reference) -> State {
    let mut plant = Command::new(program)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it runs");
    let mut forces = plant.stdin.take().expect("piped");
    let mut states = BufReader::new(plant.stdout.take().expect("piped")).lines();
    let mut state = State {
        position_ned: Vector3::zeros(),
        attitude: UnitQuaternion::identity(),
        velocity: Vector6::zeros(),
    };
    for _ in 0..1200 {
        let force = controller.command(&state, to);
        let line: String = force.iter().map(|x| format!("{x:?} ")).collect();
        writeln!(forces, "{line}").expect("it reads");
        let told = states.next().expect("a state").expect("text");
        let x: Vec<f64> = told.split_whitespace().map(|x| x.parse().expect("a number")).collect();
        let attitude = Quaternion::new(x[3], x[4], x[5], x[6]);
        state.position_ned = Vector3::from_column_slice(&x[..3]);
        state.attitude = UnitQuaternion::new_normalize(attitude);
        state.velocity = Vector6::from_column_slice(&x[7..13]);
    }
    drop(forces);
    plant.wait().expect("it ends");
    state
}

#[test]
fn every_law_settles_on_the_exported_plant_fixed_and_adaptive() {
    if !has_cc() {
        return;
    }
    let model = bluerov();
    let folder = tempfile::tempdir().expect("a folder");
    build(folder.path(), &model, PLANT);
    let to = Reference::at(
        Vector3::new(0.5, -0.3, 0.2),
        UnitQuaternion::from_euler_angles(0.0, 0.0, 0.4),
    );
    for (law, adapts) in Law::ALL.into_iter().flat_map(|law| [(law, false), (law, true)]) {
        let tuning = Dof::ALL.map(|dof| (dof, Tuning::new(0.15, 1.0))).into();
        let asked = Design { law, adapts, tuning, sample_hz: 20.0, ..Design::default() };
        let gains = design(&model.plant, &[], &Actuators::default(), &asked).expect("sound");
        let mut controller = Controller::new(model.plant.clone(), gains, &asked.speed);
        let end = settled(&folder.path().join("main"), &mut controller, &to);
        let mut error = end.position_ned - to.position_ned;
        if law == Law::Pd {
            // The controller does not know 1 N of weight.
            error.z -= 9.80665 * 0.1 / controller.gains().axes[&Dof::Heave].kp;
        }
        let turned = end.attitude.angle_to(&to.attitude);
        assert!(error.amax() < 0.01 && turned < 0.01, "{law:?} {adapts}: {error} {turned}");
    }
}

#[test]
fn the_c_controller_gives_the_same_forces_and_settles_on_the_exported_plant() {
    if !has_cc() {
        return;
    }
    let model = bluerov();
    for law in [Law::Pd, Law::Pid, Law::Exact, Law::NonExact] {
        let tuning =
            [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw].map(|dof| (dof, Tuning::new(0.15, 1.0)));
        let asked = Design { law, tuning: tuning.into(), sample_hz: 20.0, ..Design::default() };
        let mut actuators = Actuators::default();
        actuators.limit[0] = Some(60.0);
        let gains = design(&model.plant, &[], &actuators, &asked).expect("sound");
        let folder = tempfile::tempdir().expect("a folder");
        let header = c_header(&model.name, &gains).expect("has a place");
        fs::write(folder.path().join("seaplant_control.h"), header).expect("written");
        build(folder.path(), &model, MAIN);
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
