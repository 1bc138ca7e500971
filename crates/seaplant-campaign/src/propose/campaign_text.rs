//! Writes campaign.toml as far as a log determines it.

use seaplant::quantity::Attitude;
use seaplant::{Dof, Quantity};
use seaplant_log::{Log, Note, ReadOptions, Stamp, TimeColumn};

use super::together::measures_all;
use super::trial::ProposedTrial;
use super::vehicle_text::is_of_receiver;
use super::write::{Page, quoted, seconds};
use crate::columns::{Mapped, Mapping, UNTOLD};

/// Returns the file's text, and the decisions left to the user.
pub(super) fn write(
    log: &Log,
    mapping: &Mapping,
    trials: &[ProposedTrial],
    options: &ReadOptions,
) -> (String, Vec<String>) {
    let questions = questions(log, mapping, trials);
    let mut page = Page::default();
    page.comment(
        "A first version of the campaign, from its logs. Lines with `decide:` need your decision.",
    );
    page.list("Still open:", &questions);
    page.line("");
    page.line("vehicle = \"vehicle.toml\"");
    reading(&mut page, log, options);
    for trial in trials {
        write_trial(&mut page, mapping, trial);
    }
    several_axes(&mut page, mapping, trials);
    channels(&mut page, mapping);
    let left_out = by_reason(&mapping.left_out);
    if !left_out.is_empty() {
        page.line("");
    }
    page.list("Columns that are not mapped:", &left_out);
    (page.text, questions)
}

fn questions(log: &Log, mapping: &Mapping, trials: &[ProposedTrial]) -> Vec<String> {
    let mut found = Vec::new();
    found.extend(assumed_time(log).map(|(column, _)| {
        format!("time column {} states no unit; seconds are assumed", quoted(column))
    }));
    let dofs = trials.iter().map(|trial| (&trial.name, dof_question(trial)));
    found.extend(by_question("trial", dofs));
    let idle = trials.iter().filter(|trial| trial.window.active_s.is_none());
    let idle = idle.map(|trial| (&trial.name, IDLE.to_owned()));
    found.extend(by_question("trial", idle));
    let all = mapping.all();
    let doubts =
        all.iter().filter_map(|mapped| Some((&mapped.address, mapped.claim.doubt.clone()?)));
    found.extend(by_question("channel", doubts));
    if mapping.all().is_empty() {
        found.push("no column is recognised; map them under [channels]".to_owned());
    }
    let untold = mapping.left_out.iter().filter(|(_, why)| why == UNTOLD);
    found.extend(by_question("column", untold.map(|(column, why)| (column, why.clone()))));
    found
}

const IDLE: &str = "no mapped thruster is active; set from_s and to_s";

/// Formats `"a", "b" and 7 more: why none of them is mapped`.
fn by_reason(left_out: &[(String, String)]) -> Vec<String> {
    /// Maximum number of columns that are listed; more are counted.
    const NAMED: usize = 12;
    let mut grouped: Vec<(&str, Vec<String>)> = Vec::new();
    for (column, why) in left_out {
        match grouped.iter_mut().find(|(known, _)| known == why) {
            Some((_, columns)) => columns.push(quoted(column)),
            None => grouped.push((why, vec![quoted(column)])),
        }
    }
    let line = |(why, columns): (&str, Vec<String>)| {
        let more = columns.len().saturating_sub(NAMED);
        let named = columns[..columns.len() - more].join(", ");
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("{named}{more}: {why}")
    };
    grouped.into_iter().map(line).collect()
}

/// Formats `trials "a", "b": the question for both`.
fn by_question<'a>(kind: &str, asked: impl Iterator<Item = (&'a String, String)>) -> Vec<String> {
    let mut grouped: Vec<(String, Vec<String>)> = Vec::new();
    for (name, question) in asked {
        match grouped.iter_mut().find(|(known, _)| *known == question) {
            Some((_, names)) => names.push(quoted(name)),
            None => grouped.push((question, vec![quoted(name)])),
        }
    }
    let line = |(question, names): (String, Vec<String>)| {
        let plural = if names.len() > 1 { "s" } else { "" };
        format!("{kind}{plural} {}: {question}", names.join(", "))
    };
    grouped.into_iter().map(line).collect()
}

/// Relative score from which another degree of freedom is mentioned.
const NEAR: f64 = 0.5;

fn dof_question(trial: &ProposedTrial) -> String {
    let [best, others @ ..] = &trial.scores[..] else {
        return "no motion is recognised in it, so its dof is not known; surge is a placeholder"
            .to_owned();
    };
    if !trial.together.is_empty() {
        let axes: Vec<String> = trial.together.iter().map(ToString::to_string).collect();
        return format!(
            "it moves {} together, so one plant of several axes is proposed; if one axis was to be tested, write `dof`",
            axes.join(", ")
        );
    }
    let near = others.iter().filter(|other| other.1 > NEAR * best.1);
    let near: Vec<String> = near.map(|(dof, _)| dof.to_string()).collect();
    let also = match &near[..] {
        [] => String::new(),
        [one] => format!("; {one} responds nearly as much"),
        several => format!("; {} respond nearly as much", several.join(" and ")),
    };
    format!("is this a {0} trial? {0} responds most to the inputs{also}", best.0)
}

/// Returns the first time column whose unit was assumed, and its likely unit.
fn assumed_time(log: &Log) -> Option<(&str, &'static str)> {
    log.notes().iter().find_map(|note| match note {
        Note::TimeUnitAssumed { column, .. } => {
            Some((column.as_str(), note.likely_time_unit().unwrap_or("ms")))
        }
        _ => None,
    })
}

/// Writes how the logs are to be read.
fn reading(page: &mut Page, log: &Log, options: &ReadOptions) {
    if let Some(sheet) = &options.sheet {
        page.line(&format!("sheet = {}", quoted(sheet)));
    }
    let mut time = Vec::new();
    if let Some(TimeColumn { column, unit }) = &options.time {
        time.extend(column.as_ref().map(|column| format!("column = {}", quoted(column))));
        time.extend(unit.as_ref().map(|unit| format!("unit = {}", quoted(unit))));
    }
    time.extend(options.equal_sampling_hz.map(|rate| format!("equal_sampling_hz = {rate:?}")));
    time.extend((options.stamp == Stamp::Receive).then(|| "stamp = \"receive\"".to_owned()));
    if !time.is_empty() {
        page.line(&format!("time = {{ {} }}", time.join(", ")));
    }
    if let Some((column, unit)) = assumed_time(log) {
        page.line("");
        page.comment(
            "decide: the logs' time states no unit, and seconds are assumed; otherwise write",
        );
        let entry = format!("time = {{ column = {}, unit = {} }}", quoted(column), quoted(unit));
        page.comment(&entry);
    }
}

fn write_trial(page: &mut Page, mapping: &Mapping, trial: &ProposedTrial) {
    page.line("\n[[trial]]");
    page.line(&format!("name = {}", quoted(&trial.name)));
    match &trial.logs[..] {
        [only] => page.line(&format!("log = {}", quoted(only))),
        several => {
            page.line("log = [");
            several.iter().for_each(|file| page.line(&format!("    {},", quoted(file))));
            page.line("]");
        }
    }
    // Without `dof` a trial serves only the plant of several axes.
    let mark = if trial.together.is_empty() { "" } else { "# " };
    page.explained(
        &format!("{mark}dof = [\"{}\"]", trial.dof),
        &format!("decide: {}", dof_question(trial)),
    );
    if trial.hold_out {
        page.explained(
            "role = \"hold-out\"",
            "held out: what is fitted to the other trials is tested on it",
        );
    }
    let window = &trial.window;
    if window.active_s.is_some() && !trial.varies && !trial.hold_out {
        page.explained(
            "# role = \"steady\"",
            "decide: thrust hardly changes; remove the `#` if speed is steady, too",
        );
    }
    let why = match window.active_s {
        Some((from, to)) => {
            format!("thrusters work from {from:.1} to {to:.1} s after the log's first sample")
        }
        None => format!("decide: {IDLE}; these are the ends of the log"),
    };
    page.explained(&format!("from_s = {}", seconds(window.from_s)), &why);
    page.line(&format!("to_s = {}", seconds(window.to_s)));
    let own = own_channels(mapping, trial.session);
    if !own.is_empty() {
        page.line("[trial.channels]");
        own.iter()
            .for_each(|mapped| page.explained(&entry(mapped, false), "called otherwise here"));
    }
}

/// Returns the channels for which a session uses another column than [channels] of the campaign.
fn own_channels(mapping: &Mapping, session: usize) -> Vec<&Mapped> {
    let all = mapping.all();
    let differs = |mapped: &&Mapped| {
        let common = all.iter().find(|common| common.quantity() == mapped.quantity());
        common.is_some_and(|common| {
            common.address != mapped.address || common.claim.unit != mapped.claim.unit
        })
    };
    mapping.sessions[session].iter().filter(differs).collect()
}

/// Proposes a plant of several axes: for rudders and fins, whose force acts in several, for boats,
/// which move along three axes at once, and for logs that move or measure several axes.
fn several_axes(page: &mut Page, mapping: &Mapping, trials: &[ProposedTrial]) {
    let is_angle = |quantity: &Quantity| matches!(quantity, Quantity::SurfaceAngle { .. });
    let (is_boat, has_rudder) = (is_boat(mapping), mapping.has(is_angle));
    let together = trials.iter().any(|trial| !trial.together.is_empty());
    if !is_boat && (together || !has_rudder) {
        return axes_moved_together(page, mapping, trials);
    }
    page.line("");
    if is_boat {
        page.comment("A boat under way moves ahead, to the side and about at once.");
    } else {
        page.comment(
            "A rudder acts in a plant of several axes. Remove the `#` from the lines below;",
        );
    }
    let hold = "hold = { \"mass.surge\" = 0.0 }  # decide: dry mass and what the water adds, kg";
    let axes = "axes = [\"surge\", \"sway\", \"yaw\"]";
    if has_rudder {
        page.comment(
            "where no thrust curve is known, hold one mass, which fixes the scale of force.",
        );
    }
    if is_boat {
        page.line("[[plant]]");
        page.line(axes);
    } else {
        page.comment("[[plant]]");
        page.comment(axes);
    }
    if has_rudder {
        page.comment(hold);
    }
}

/// Proposes one plant for the axes that the trials move together; if none does and all are
/// measured, as an alternative.
fn axes_moved_together(page: &mut Page, mapping: &Mapping, trials: &[ProposedTrial]) {
    let axes = plant_axes(mapping, trials);
    let six = measures_all(mapping);
    if axes.is_none() && !six {
        return;
    }
    page.line("");
    if let Some(axes) = axes {
        page.comment("One plant of several axes, with their couplings, for what moves together.");
        page.line("[[plant]]");
        page.explained(&axes, "decide: the axes of one plant");
    } else {
        page.comment(
            "All six axes are measured. If trials move several of them at once, fit one plant",
        );
        page.comment("with their couplings, too: remove the `#` from the two lines below.");
        page.comment("[[plant]]");
        page.comment("axes = \"six\"");
    }
    page.comment(
        "State [rigid_body] and [buoyancy] in vehicle.toml, if they are known: added mass is",
    );
    page.comment("then reported apart.");
}

/// Returns the `axes` line of the plant for all that the trials move together; `None` if they move
/// each axis alone.
fn plant_axes(mapping: &Mapping, trials: &[ProposedTrial]) -> Option<String> {
    let moved = |dof: &Dof| trials.iter().any(|trial| trial.together.contains(dof));
    let axes: Vec<Dof> = Dof::ALL.into_iter().filter(moved).collect();
    let names: Vec<String> = axes.iter().map(|dof| quoted(&dof.to_string())).collect();
    match &axes[..] {
        [] => None,
        [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw] if measures_all(mapping) => {
            Some("axes = \"six\"".to_owned())
        }
        [Dof::Surge, Dof::Sway, Dof::Yaw] => Some("axes = \"planar\"".to_owned()),
        _ => Some(format!("axes = [{}]", names.join(", "))),
    }
}

/// Returns whether a log has satellite navigation or the like and heading, and no signs of diving.
fn is_boat(mapping: &Mapping) -> bool {
    let heading = |x: &Quantity| *x == Quantity::Attitude(Attitude::Heading);
    let dives = |x: &Quantity| matches!(x, Quantity::Depth | Quantity::DvlVelocity(_));
    mapping.has(is_of_receiver) && mapping.has(heading) && !mapping.has(dives)
}

fn channels(page: &mut Page, mapping: &Mapping) {
    page.line("\n[channels]");
    for mapped in mapping.all() {
        let has = |session: &Vec<Mapped>| session.iter().any(|m| m.quantity() == mapped.quantity());
        let optional = !mapping.sessions.iter().all(has);
        page.explained(&entry(mapped, optional), &reasons(mapped, optional));
    }
}

fn entry(mapped: &Mapped, optional: bool) -> String {
    let mut entry = format!("column = {}", quoted(&mapped.address));
    if let Some(unit) = mapped.claim.unit {
        entry += &format!(", unit = {}", quoted(unit));
    }
    if mapped.claim.negate {
        entry += ", negate = true";
    }
    if optional {
        entry += ", optional = true";
    }
    format!("{} = {{ {entry} }}", quoted(&mapped.quantity().to_string()))
}

fn reasons(mapped: &Mapped, optional: bool) -> String {
    let mut reasons = mapped.claim.why.clone();
    if optional {
        reasons += "; some logs lack it";
    }
    if !mapped.others.is_empty() {
        let others: Vec<String> = mapped.others.iter().map(|other| quoted(other)).collect();
        let what = match mapped.quantity() {
            Quantity::Thruster { .. } => "its other inputs",
            _ => "other candidates",
        };
        reasons += &format!("; {what}: {}", others.join(", "));
    }
    if let Some(doubt) = &mapped.claim.doubt {
        reasons += &format!("; decide: {doubt}");
    }
    reasons
}
