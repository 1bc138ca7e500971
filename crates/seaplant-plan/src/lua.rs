//! Writes a script for ArduPilot.

use std::fmt::Write as _;

use seaplant::{ThrustCurve, ThrusterInput};

use crate::Error;
use crate::drive::{Pilot, TAKEN, TAKEN_BACK};
use crate::hold::{DAMPING, TICK_S};
use crate::manoeuvre::Manoeuvre;
use crate::plan::Plan;
use crate::prior::Prior;
use crate::rig::Rig;
use crate::wave::Wave;

/// Part of the script that is common to all vehicles.
const SCRIPT: &str = include_str!("../templates/plan.lua");

/// Pulse widths of command 0 and from there to ±1, µs.
const COMMAND_US: (f64, f64) = (1500.0, 400.0);

/// Writes a Lua script for ArduPilot that drives the manoeuvres of a plan: excitation, controller
/// and limits as [`plan`](crate::plan()) simulates them, and aborts on stick input, lost heartbeat,
/// depth, attitude and position.
///
/// # Errors
/// [`Error::Setting`] if a thruster takes neither a command nor a pulse width.
pub fn lua_script(prior: &Prior, plan: &Plan) -> Result<String, Error> {
    let request = &plan.request;
    let rig = Rig::new(&prior.model, request.limits.thrust_part, request.full_input)?;
    if !rig.takes_servo_output() {
        return Err(Error::Setting {
            name: "the input of the thrusters",
            found: "propeller speed or force".to_owned(),
            expected: "a command or a pulse width for an ArduPilot script; play commands/*.csv instead",
        });
    }
    let Some(first) = plan.manoeuvres.first() else {
        return Err(Error::NoMotion { reason: "the plan has no manoeuvre".to_owned() });
    };
    let pilot = Pilot::new(&prior.model.plant, &rig, &request.limits, &first.manoeuvre);
    let limits = &request.limits;
    let mut text = String::new();
    let mut put = |line: String| {
        text.push_str(&line);
        text.push('\n');
    };
    put(format!(
        "-- Seaplant: {}, {:.1} min. Reference frames: north-east-down, forward-starboard-down.",
        one_line(&plan.vehicle),
        plan.minutes
    ));
    put(
        "-- Check CHANNEL, the servo output of each thruster counted from 0, before the first run."
            .to_owned(),
    );
    for (k, thruster) in rig.thrusters.iter().enumerate() {
        put(format!("--   {k}: {}", one_line(&thruster.name)));
    }
    let channels: Vec<String> = (0..rig.thrusters.len()).map(|k| k.to_string()).collect();
    put(format!("local CHANNEL = {{ {} }}", channels.join(", ")));
    put(format!(
        "local START_DEPTH_M, DEPTH_M = {}, {}",
        number(limits.start_depth_m),
        list(&limits.depth_m)
    ));
    put(format!("local BOX_M, SPEED_M_S = {}, {}", list(&limits.box_m), number(limits.speed_m_s)));
    put(format!(
        "local RATE_RAD_S, TILT_RAD = {}, {}",
        number(limits.rate_rad_s),
        number(limits.tilt_rad)
    ));
    put(format!("local TETHER_M = {}", limits.tether_m.map_or("nil".to_owned(), number)));
    put(format!(
        "local STOP_S2, TRIM_N = {}, {}",
        number(pilot.stop.distance_s2),
        number(pilot.trim_n)
    ));
    put(format!("local SWING_S = {}", list(&pilot.stop.swing_s)));
    put(format!(
        "local TAKEN_BACK, TAKEN, BACK_RAD_S, DAMPING = {TAKEN_BACK}, {TAKEN}, {}, {DAMPING}",
        list(&pilot.back_rad_s())
    ));
    put(format!("local MASS = {}", list(&pilot.mass)));
    put(format!("local MOST = {}", list(&rig.most)));
    let rows = |k: usize| list(&rig.share.row(k).iter().copied().collect::<Vec<f64>>());
    let share: Vec<String> = (0..rig.thrusters.len()).map(rows).collect();
    put(format!("local SHARE = {{\n  {},\n}}", share.join(",\n  ")));
    let allowed: Vec<String> = rig.allowed.iter().map(|ends| list(ends)).collect();
    put(format!("local ALLOWED = {{ {} }}", allowed.join(", ")));
    let slew = |ends: &[f64; 2]| {
        let full = ends[0].abs().max(ends[1].abs()) / limits.thrust_part;
        limits.slew_per_s * full * TICK_S
    };
    put(format!("local SLEW_N = {}", list(&rig.allowed.iter().map(slew).collect::<Vec<f64>>())));
    let curves: Vec<String> = rig.thrusters.iter().map(|t| curve(&t.curve)).collect();
    put(format!("local CURVES = {{\n  {},\n}}", curves.join(",\n  ")));
    let all: Vec<String> =
        plan.manoeuvres.iter().map(|one| manoeuvre(&one.manoeuvre, one.minutes)).collect();
    put(format!("local MANOEUVRES = {{\n{}}}", all.concat()));
    text.push('\n');
    text.push_str(SCRIPT);
    Ok(text)
}

/// Returns a name that ends no comment.
fn one_line(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Formats a number in single precision, which Lua uses on board.
fn number(x: f64) -> String {
    if x.is_finite() { format!("{x:.7e}") } else { "nil".to_owned() }
}

fn list(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(|x| number(*x)).collect();
    format!("{{ {} }}", all.join(", "))
}

fn curve(curve: &ThrustCurve) -> String {
    let (still, scale) = match curve.input() {
        ThrusterInput::Command => COMMAND_US,
        _ => (0.0, 1.0),
    };
    match curve {
        ThrustCurve::Quadratic { law, .. } => format!(
            "{{ still = {}, scale = {}, forward = {}, reverse = {}, exponent = {}, deadband = {} }}",
            number(still + scale * law.neutral),
            number(scale),
            number(law.forward),
            number(law.reverse),
            number(law.exponent),
            number(law.deadband)
        ),
        ThrustCurve::Table { tables, .. } => {
            let points = tables.iter().take(1).flat_map(|table| table.points());
            let rows: Vec<String> =
                points.map(|(x, force)| list(&[still + scale * x, force])).collect();
            let neutral = number(still + scale * curve.neutral());
            format!("{{ still = {neutral}, points = {{ {} }} }}", rows.join(", "))
        }
    }
}

fn wave(wave: &Wave) -> String {
    match wave {
        Wave::Sines { sines } => {
            let rows: Vec<String> = sines.iter().map(|row| list(row)).collect();
            format!("{{ sines = {{ {} }} }}", rows.join(", "))
        }
        Wave::Sum { waves } => {
            let all: Vec<String> = waves.iter().map(self::wave).collect();
            format!("{{ sum = {{ {} }} }}", all.join(", "))
        }
        Wave::Steps { steps, period_s } => {
            let rows: Vec<String> = steps.iter().map(|row| list(row)).collect();
            format!("{{ period_s = {}, steps = {{ {} }} }}", number(*period_s), rows.join(", "))
        }
    }
}

fn manoeuvre(manoeuvre: &Manoeuvre, minutes: f64) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(text, "  {{ name = '{}', seconds = {:.1},", manoeuvre.name, 60.0 * minutes);
    let _ = writeln!(text, "    hold_rad_s = {},", list(&manoeuvre.hold_rad_s));
    if let Some((thrusts, own)) = &manoeuvre.opposing {
        let _ = writeln!(
            text,
            "    opposing = {{ thrusts = {}, wave = {} }},",
            list(thrusts),
            wave(own)
        );
    }
    let _ = writeln!(text, "    waves = {{");
    for (dof, own) in &manoeuvre.waves {
        let _ = writeln!(text, "      [{}] = {},", dof.index() + 1, wave(own));
    }
    let _ = writeln!(text, "    }} }},");
    text
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use mlua::{Lua, Table, Value};
    use seaplant::motion::State;

    use super::*;
    use crate::limits::Limits;
    use crate::request::Request;

    /// ArduPilot's bindings, replaced by a recorder: the script's inputs are in `world`, its
    /// outputs in `done`.
    const BINDINGS: &str = r"
        world = { ms = 100000, heartbeat = 100000, armed = true, angles = {0, 0, 0}, gyro = {0, 0, 0},
                  place = {0, 0, 0}, moving = {0, 0, 0}, depth = 5, pwm = {1500, 1500, 1500, 1500, 1500, 1500},
                  lost = false }
        done = { outputs = {}, said = {}, logged = 0 }
        values = {}
        local function u32(x) return { tofloat = function() return x end } end
        local function vector(v) return { x = function() return v[1] end, y = function() return v[2] end, z = function() return v[3] end } end
        function millis() return u32(world.ms) end
        param = { add_table = function() return true end,
                  add_param = function(_, _, _, name, value) values['SPLN_' .. name] = value return true end,
                  get = function(_, name) return values[name] end,
                  set = function(_, name, value) values[name] = value return true end }
        arming = { is_armed = function() return world.armed end }
        gcs = { last_seen = function() return u32(world.heartbeat) end,
                send_text = function(_, _, text) table.insert(done.said, text) end }
        rc = { get_pwm = function(_, channel) return world.pwm[channel] end }
        ahrs = { get_roll = function() return world.angles[1] end, get_pitch = function() return world.angles[2] end,
                 get_yaw = function() return world.angles[3] end, get_gyro = function() return vector(world.gyro) end,
                 get_relative_position_NED_origin = function() if world.lost then return nil end return vector(world.place) end,
                 get_velocity_NED = function() return vector(world.moving) end }
        baro = { get_altitude = function() return -world.depth end }
        logger = { write = function() done.logged = done.logged + 1 end }
        SRV_Channels = { set_output_pwm_chan_timeout = function(_, channel, pwm) done.outputs[channel + 1] = pwm end }
    ";

    /// A plan of six axes and eight thrusters, for one draw.
    static PLANNED: LazyLock<(Prior, Plan, Limits)> = LazyLock::new(|| {
        let path = "published:bluerov2-heavy-von-benzon-2022".as_ref();
        let file = seaplant_campaign::read_plant_file(path).expect("read").expect("a table");
        let model = file.model().expect("a plant");
        let prior = Prior::of_model(&model, &[]).expect("thrusters");
        let vehicle = seaplant::Vehicle {
            thrusters: model.thrusters.clone(),
            ..seaplant::Vehicle::default()
        };
        let request = Request { minutes: Some(10.0), draws: 1, checks: 0, ..Request::default() };
        let plan = crate::plan(&prior, &vehicle, &request).expect("a plan");
        (prior, plan, request.limits)
    });

    struct Script {
        lua: Lua,
    }

    impl Script {
        fn loaded(text: &str) -> Self {
            let lua = Lua::new();
            lua.load(BINDINGS).exec().expect("bindings");
            lua.load(text).exec().expect("the script loads");
            Self { lua }
        }

        fn run(&self, code: &str) {
            self.lua.load(code).exec().expect("runs");
        }

        fn number(&self, code: &str) -> f64 {
            self.lua.load(code).eval().expect("a number")
        }

        fn said(&self) -> String {
            self.lua.load("return table.concat(done.said, '\\n')").eval().expect("text")
        }

        fn outputs(&self) -> Vec<f64> {
            let outputs: Table = self.lua.load("return done.outputs").eval().expect("a table");
            outputs.sequence_values::<f64>().map(|x| x.expect("a pulse width")).collect()
        }
    }

    #[test]
    fn the_script_drives_as_the_simulation_and_aborts() {
        let (prior, plan, limits) = &*PLANNED;
        let text = lua_script(prior, plan).expect("commands");
        let rig = Rig::new(&prior.model, limits.thrust_part, None).expect("thrusters");
        for (which, one) in plan.manoeuvres.iter().enumerate() {
            let script = Script::loaded(&text);
            let pilot = Pilot::new(&prior.model.plant, &rig, limits, &one.manoeuvre);
            let driven =
                crate::drive::drive(&prior.model.plant, &pilot, 12.0, None).expect("moves");
            script.run(&format!("values['SPLN_RUN'] = {}", which + 1));
            for (tick, state) in driven.states.iter().enumerate() {
                script.run(&world(state, limits, tick));
                script.run("update()");
                for (k, pulse) in script.outputs().into_iter().enumerate() {
                    let wanted = 1500.0 + 400.0 * driven.inputs[k][tick];
                    // Whole microseconds.
                    assert!(
                        (pulse - wanted).abs() < 0.6,
                        "{}, thruster {k} at {tick}: {pulse} and {wanted}",
                        one.manoeuvre.name
                    );
                }
            }
            assert_eq!(script.outputs().len(), 8);
            assert!(script.number("return done.logged") > 100.0);
        }
        let aborts = [
            ("world.pwm[3] = 1600", "stick input"),
            ("world.ms = world.ms + 10000", "no heartbeat"),
            ("world.depth = 0.5", "depth"),
            ("world.angles = {0.5, 0, 0}", "attitude"),
            ("world.armed = false", "disarmed"),
            ("world.lost = true", "position lost"),
            ("world.place = {11, 0, 0}", "left its box"),
        ];
        for (what, why) in aborts {
            let script = Script::loaded(&text);
            script.run("values['SPLN_RUN'] = 1 update()");
            assert_eq!(script.outputs().len(), 8, "{what}: it began");
            script.run(&format!("{what} done.outputs = {{}} update()"));
            assert!(script.said().contains(&format!("aborted: {why}")), "{}", script.said());
            assert!(script.outputs().is_empty(), "{what}: outputs return to the autopilot");
            assert_eq!(script.number("return values['SPLN_RUN']"), 0.0);
        }
    }

    #[test]
    fn the_script_begins_only_where_the_plan_does() {
        let (prior, plan, _) = &*PLANNED;
        let text = lua_script(prior, plan).expect("commands");
        for (what, why) in [
            ("world.armed = false", "arm first"),
            ("world.lost = true", "no position"),
            ("world.depth = 9.5", "go to 5.0 m"),
            ("values['SPLN_RUN'] = 99", "there is no manoeuvre 99"),
        ] {
            let script = Script::loaded(&text);
            script.run(&format!("values['SPLN_RUN'] = 1 {what} update()"));
            assert!(script.said().contains(why), "{}", script.said());
            assert!(script.outputs().is_empty());
        }
        let script = Script::loaded(&text);
        script.run("update()");
        assert!(script.outputs().is_empty() && script.said().is_empty());
        let nothing: Value = script.lua.load("return values['SPLN_RUN']").eval().expect("a value");
        assert_eq!(nothing.as_f64().or(nothing.as_i64().map(|x| x as f64)), Some(0.0));
    }

    fn world(state: &State, limits: &Limits, tick: usize) -> String {
        let turn = nalgebra::Rotation3::from_euler_angles(state[3], state[4], state[5]);
        let v = turn * nalgebra::Vector3::new(state[6], state[7], state[8]);
        let ms = 100_000 + 100 * tick;
        format!(
            "world.ms, world.heartbeat = {ms}, {ms}
             world.angles = {{ {}, {}, {} }}
             world.gyro = {{ {}, {}, {} }}
             world.place = {{ {}, {}, {} }}
             world.moving = {{ {}, {}, {} }}
             world.depth = {}",
            state[3],
            state[4],
            state[5],
            state[9],
            state[10],
            state[11],
            state[0],
            state[1],
            state[2],
            v.x,
            v.y,
            v.z,
            limits.start_depth_m + state[2]
        )
    }
}
