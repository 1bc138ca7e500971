//! vehicle.toml and campaign.toml: from logs to identified plants.
//!
//! Two small files describe the vehicle and the logs; this crate reads both, converts the logs'
//! columns to SI units and passes the trials to [`seaplant`].

mod bench;
mod bounded;
mod campaign;
mod campaign_file;
mod clocks;
mod columns;
mod doubts;
mod error;
mod excerpt;
mod inspect;
mod known;
mod known_file;
mod missing_code;
mod monte_carlo;
mod pattern;
mod plant_file;
mod preset;
mod profile;
mod propose;
mod published;
mod recording;
mod remarks;
mod toml_file;
mod twin_file;
mod twin_files;
mod units;
mod validate;
mod vehicle_file;
mod words;

pub use bench::{Bench, BenchColumns, read_bench};
pub use bounded::read_bounded;
pub use campaign::{Campaign, bollard_result, campaign_files, fit_bench, read_logs, trial_of_log};
pub use campaign_file::{
    Between, BollardPullEntry, CampaignFile, ChannelEntry, DofEntry, EstimateWord, FileTimeEntry,
    FitEntry, LogEntry, OffsetEntry, StampEntry, SteadyEntry, TimeEntry, TrialEntry,
};
pub use clocks::in_words;
pub use error::Error;
pub use inspect::{
    ChannelSummary, InspectedEpoch, InspectedFile, InspectedOffset, Inspection, inspect,
    inspect_survey,
};
pub use known_file::{KnownEntry, KnownKindEntry};
pub use monte_carlo::{
    MonteCarloTable, VehicleMonteCarloTable, monte_carlo, monte_carlo_of_several_axes,
};
pub use plant_file::{BuoyancyEntry, PlantEntry, RigidBodyEntry};
pub use preset::{CurvePreset, VehiclePreset};
pub use profile::{
    ForceEntry, HoldEntry, ManoeuvreEntry, ManoeuvreKind, Profile, StartEntry, SteadyWindEntry,
    WindFrameName, input_table,
};
pub use propose::{Proposal, propose};
pub use published::{nearest_published, published_names, read_plant_file};
pub use recording::SourcedTrial;
pub use toml_file::{of_json, read_toml};
pub use twin_file::{TwinError, TwinFile};
pub use twin_files::{TextFile, twin_files};
pub use validate::{Simulation, Validation, validate, validate_table};
pub use vehicle_file::{
    AttitudeEntry, CurveEntry, DvlEntry, EstimateCurveEntry, FinEntry, FlowEntry, ImuEntry,
    LiftEntry, OpenWaterEntry, PositionEntry, PresetCurveEntry, QuadraticEntry, SensorEntries,
    SourcedVehicle, StraighteningEntry, TableEntry, ThrusterEntry, UncertaintyEntry, VehicleFile,
    VoltageEntry, WindEntry, read_vehicle,
};
