//! Maps columns to quantities in every session.

use std::collections::BTreeSet;
use std::path::Path;

use seaplant::quantity::{Attitude, Axis};
use seaplant::{Dof, Quantity, ThrusterInput};
use seaplant_log::{Channel, Log};

use super::claim::{Claim, NO_AXIS, NOT_NEEDED, VELOCITY_SAYS_MORE};
use super::names::claim;
use super::session::Session;
use super::{angles, autopilot, pd0, px4, ros};
use crate::remarks::{Remark, remarks, short};

/// A quantity of a session and its channel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mapped {
    pub claim: Claim,
    /// Index into the log's channels.
    pub channel: usize,
    /// Name of the column in the campaign.
    pub address: String,
    /// Columns with weaker claims to the same quantity.
    pub others: Vec<String>,
}

impl Mapped {
    pub fn quantity(&self) -> &Quantity {
        &self.claim.quantity
    }

    /// Returns the thruster whose input it is.
    pub fn thruster(&self) -> Option<&str> {
        match self.quantity() {
            Quantity::Thruster { name, .. } => Some(name),
            _ => None,
        }
    }
}

/// Mapped columns of each session, and the others with reasons.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Mapping {
    /// In the order of the sessions.
    pub sessions: Vec<Vec<Mapped>>,
    /// Columns and reasons, each column once.
    pub left_out: Vec<(String, String)>,
}

pub(crate) fn map(log: &Log, sessions: &[Session]) -> Mapping {
    let mut mapping = Mapping::default();
    let moving: BTreeSet<&str> = log
        .channels()
        .iter()
        .filter(|channel| !channel.is_constant())
        .map(|channel| channel.column.as_str())
        .collect();
    for session in sessions {
        let mut claims = mapping.claims(log, session, &moving);
        angles::state_units(log, &mut claims);
        name_axes_of_forces(&mut claims);
        let mut of_session = choose(log, session, claims);
        mapping.leave_out_acceleration(&mut of_session);
        for mapped in &of_session {
            let quantity = mapped.quantity();
            for other in &mapped.others {
                mapping.leave_out(other, format!("another column is mapped to {quantity}"));
            }
        }
        mapping.sessions.push(of_session);
    }
    // Another session may have what one lacks.
    let mapped = mapping.sessions.iter().flatten();
    let mapped: BTreeSet<&str> =
        mapped.map(|m| log.channels()[m.channel].column.as_str()).collect();
    mapping.left_out.retain(|(column, _)| !mapped.contains(column.as_str()));
    mapping
}

impl Mapping {
    /// Returns the claims of a session's channels; channels without a claim are omitted.
    fn claims(
        &mut self,
        log: &Log,
        session: &Session,
        moving: &BTreeSet<&str>,
    ) -> Vec<(usize, Claim)> {
        let mut claims = Vec::new();
        for (index, channel) in session.channels(log) {
            match claim_moving(log, channel, moving) {
                Ok(claim) => claims.push((index, claim)),
                // An autopilot logs hundreds of channels.
                Err(reason) if reason == NOT_NEEDED => {}
                Err(reason) => self.leave_out(&channel.column, reason),
            }
        }
        claims
    }

    /// Leaves out an accelerometer where velocity is logged, because it adds no information.
    fn leave_out_acceleration(&mut self, session: &mut Vec<Mapped>) {
        let moves = |quantity: &Quantity| match quantity {
            Quantity::DvlVelocity(_) => true,
            Quantity::Velocity(dof) => !dof.is_rotation(),
            _ => false,
        };
        if !session.iter().any(|mapped| moves(mapped.quantity())) {
            return;
        }
        let felt = |mapped: &Mapped| matches!(mapped.quantity(), Quantity::Acceleration(_));
        for mapped in session.iter().filter(|mapped| felt(mapped)) {
            self.leave_out(&mapped.address, VELOCITY_SAYS_MORE.to_owned());
        }
        session.retain(|mapped| !felt(mapped));
    }

    fn leave_out(&mut self, column: &str, reason: String) {
        if !self.left_out.iter().any(|(known, _)| known == column) {
            self.left_out.push((column.to_owned(), reason));
        }
    }

    /// Returns every quantity with the first session that has it; thrusters in the order of
    /// columns.
    pub fn all(&self) -> Vec<&Mapped> {
        let mut found: Vec<&Mapped> = Vec::new();
        for mapped in self.sessions.iter().flatten() {
            if !found.iter().any(|known| known.quantity() == mapped.quantity()) {
                found.push(mapped);
            }
        }
        found.sort_by_key(|mapped| place(mapped.quantity()));
        found
    }

    /// Returns the thrusters, with the first session's input.
    pub fn thrusters(&self) -> Vec<(&str, &Mapped)> {
        self.all().into_iter().filter_map(|mapped| Some((mapped.thruster()?, mapped))).collect()
    }

    pub fn has(&self, wanted: impl Fn(&Quantity) -> bool) -> bool {
        self.sessions.iter().flatten().any(|mapped| wanted(mapped.quantity()))
    }
}

/// Returns the sort key of a quantity in the file: inputs, then motion.
fn place(quantity: &Quantity) -> (u8, Option<&Quantity>) {
    match quantity {
        Quantity::Thruster { .. } => (0, None),
        Quantity::SupplyVoltage => (1, None),
        other => (2, Some(other)),
    }
}

/// Returns the claim of a channel that varies: a thruster may rest, a sensor may not.
fn claim_moving(log: &Log, channel: &Channel, moving: &BTreeSet<&str>) -> Result<Claim, String> {
    let path = &log.sources()[channel.source].path;
    let context = path.file_stem().unwrap_or_default().to_string_lossy();
    let known = [autopilot::claim, px4::claim, ros::claim, pd0::claim];
    let claim = match known.iter().find_map(|claim| claim(log, channel)) {
        Some(claim) => claim?,
        None => angles::ask_frame(log, channel, claim(channel, &context)?),
    };
    if matches!(claim.quantity, Quantity::Thruster { .. }) {
        return Ok(claim);
    }
    if !moving.contains(channel.column.as_str()) {
        let value = channel.min().map(short).unwrap_or_default();
        return Err(format!("constant at {value}, so not measured"));
    }
    if remarks(channel).contains(&Remark::Clock) {
        return Err(Remark::Clock.to_string());
    }
    Ok(claim)
}

/// Takes a force whose name has no axis for that of the only translation that is measured, and a moment likewise.
fn name_axes_of_forces(claims: &mut [(usize, Claim)]) {
    let moves = |claim: &Claim| match claim.quantity {
        Quantity::Velocity(dof) => Some(dof),
        Quantity::DvlVelocity(Axis::X) => Some(Dof::Surge),
        Quantity::DvlVelocity(Axis::Y) => Some(Dof::Sway),
        Quantity::DvlVelocity(Axis::Z) | Quantity::Depth => Some(Dof::Heave),
        Quantity::Rate(Axis::X) | Quantity::Attitude(Attitude::Roll) => Some(Dof::Roll),
        Quantity::Rate(Axis::Y) | Quantity::Attitude(Attitude::Pitch) => Some(Dof::Pitch),
        Quantity::Rate(Axis::Z) | Quantity::Attitude(Attitude::Heading) => Some(Dof::Yaw),
        _ => None,
    };
    let measured: BTreeSet<Dof> = claims.iter().filter_map(|(_, claim)| moves(claim)).collect();
    for (_, claim) in claims {
        let Quantity::Wrench(dof) = &mut claim.quantity else { continue };
        let alike: Vec<Dof> =
            measured.iter().copied().filter(|own| own.is_rotation() == dof.is_rotation()).collect();
        if let (Some(NO_AXIS), [only]) = (claim.doubt.as_deref(), alike.as_slice()) {
            *dof = *only;
        }
    }
}

/// Returns the strongest claim to each quantity, and one input for each thruster.
fn choose(log: &Log, session: &Session, claims: Vec<(usize, Claim)>) -> Vec<Mapped> {
    let mut found: Vec<Mapped> = Vec::new();
    for (channel, claim) in claims {
        let address = address(log, session, channel);
        let rival = found.iter_mut().find(|known| is_rival(known.quantity(), &claim.quantity));
        let Some(known) = rival else {
            found.push(Mapped { claim, channel, address, others: Vec::new() });
            continue;
        };
        let rank = |claim: &Claim, channel: usize| {
            let constant = log.channels()[channel].is_constant();
            (input_rank(&claim.quantity), !constant, claim.strength)
        };
        if rank(&claim, channel) > rank(&known.claim, known.channel) {
            known.others.push(std::mem::replace(&mut known.address, address));
            (known.claim, known.channel) = (claim, channel);
        } else {
            known.others.push(address);
        }
    }
    found
}

fn is_rival(one: &Quantity, other: &Quantity) -> bool {
    match (one, other) {
        (Quantity::Thruster { name: one, .. }, Quantity::Thruster { name: other, .. }) => {
            one == other
        }
        _ => one == other,
    }
}

/// Ranks inputs: the closer to thrust, the greater.
fn input_rank(quantity: &Quantity) -> u8 {
    match quantity {
        Quantity::Thruster { input: ThrusterInput::Speed, .. } => 3,
        Quantity::Thruster { input: ThrusterInput::Force, .. } => 2,
        Quantity::Thruster { input: ThrusterInput::Pwm, .. } => 1,
        _ => 0,
    }
}

/// Returns the header, or `FILE:HEADER` where several files of the session have it.
fn address(log: &Log, session: &Session, channel: usize) -> String {
    let Channel { column, source, .. } = &log.channels()[channel];
    let twice = session.channels(log).any(|(_, c)| c.column == *column && c.source != *source);
    if !twice {
        return column.clone();
    }
    let path = &log.sources()[*source].path;
    let others = || session.sources.iter().filter(|other| *other != source);
    let tail = |parts: usize| -> std::path::PathBuf {
        let all: Vec<_> = path.components().collect();
        all[all.len().saturating_sub(parts)..].iter().collect()
    };
    let tells = |tail: &Path| others().all(|&other| !log.sources()[other].path.ends_with(tail));
    let lengths = 1..=path.components().count();
    let file = lengths.map(tail).find(|tail| tells(tail)).unwrap_or_else(|| path.clone());
    format!("{}:{column}", file.display())
}
