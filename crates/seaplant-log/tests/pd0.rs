//! Teledyne RDI PD0 files.

use seaplant_log::{ReadOptions, read};

use crate::common::python::made;
use crate::common::{Sample, data, notes, open, without_folder};

/// Times are hundredths of seconds since 1970 in doubles, s.
const RESOLUTION_S: f64 = 1e-6;

const CLOCK: &str =
    "times are those of the instrument's clock, taken as UTC: seconds since the Unix epoch";

#[test]
fn velocities_are_named_by_their_frame() {
    let Some(made) = made("pd0") else { return };
    let log = open(&made.file("frames.pd0"));
    made.agrees("frames.pd0", &log, RESOLUTION_S);
    assert_eq!(log.sources()[0].format, "Teledyne RDI PD0");
    assert_eq!(
        notes(&log),
        [
            format!("frames.pd0: {CLOCK}"),
            "frames.pd0: \"velocity profile\" is over cells of depth, not one number a time; left \
             out"
            .to_owned(),
        ]
    );
}

#[test]
fn old_instruments_know_no_century() {
    let Some(made) = made("pd0") else { return };
    made.agrees("old.pd0", &open(&made.file("old.pd0")), RESOLUTION_S);
}

#[test]
fn ensembles_are_read_between_text_and_damage() {
    let Some(made) = made("pd0") else { return };
    let log = open(&made.file("port.pd0"));
    made.agrees("port.pd0", &log, RESOLUTION_S);
    let size = std::fs::metadata(made.file("port.pd0")).unwrap().len();
    let whole = 6 + 2 * 3 + 59 + 65 + 81 + 2;
    assert_eq!(
        notes(&log),
        [
            // The rest of the first ensemble; the damaged one; 204 bytes that are no ensemble.
            format!(
                "port.pd0: 3 stretches are damaged, the first at byte 0; {} bytes skipped",
                whole - 100 + (whole + 67) + 204
            ),
            format!(
                "port.pd0: the file is cut off in the record at byte {}, after 1930089509.030 s; \
                 all before was read",
                size - (whole - 1)
            ),
            format!("port.pd0: {CLOCK}"),
            "port.pd0: \"text between ensembles\" is of another instrument; left out".to_owned(),
        ]
    );
}

#[test]
fn a_file_without_a_whole_ensemble_is_refused() {
    let sample = Sample::new("dvl.pd0", b"\x7f\x7f\x43\x02\x00\x07\x14\x00");
    let error = read(sample.path(), &ReadOptions::default()).unwrap_err();
    assert_eq!(
        without_folder(&error.to_string(), sample.path()),
        "dvl.pd0 (Teledyne RDI PD0) holds no numbers with times; check that the recording was \
         saved and copied whole"
    );
}

#[test]
fn recordings_are_as_another_decoder_has_them() {
    let Some(folder) = data("formats/pd0") else { return };
    let Some(made) = made("pd0_recordings") else { return };
    // The published counts of valid bottom track are those of the first velocity.
    for (name, ensembles, velocity, valid) in [
        ("RDI_withBT.000", 1721, "bottom_track.earth.velocity_east", 901),
        ("RiverPro_test01.PD0", 273, "bottom_track.beam.velocity_1", 271),
    ] {
        let log = open(&folder.join(name));
        made.agrees(name, &log, RESOLUTION_S);
        assert_eq!(log.channel("heading").unwrap().len(), ensembles);
        let velocity = log.channel(velocity).unwrap();
        assert_eq!((velocity.len(), velocity.missing), (valid, ensembles - valid));
    }
}
