//! NMEA 0183 sentences.

use std::path::Path;

use seaplant_log::{ReadOptions, read};

use crate::common::python::made;
use crate::common::{Sample, data, notes, open, without_folder};

/// Rounding of microseconds since 1970 in doubles, and of times of receipt to the millisecond, s.
const RESOLUTION_S: f64 = 1e-6;

fn failure(path: &Path) -> String {
    without_folder(&read(path, &ReadOptions::default()).unwrap_err().to_string(), path)
}

#[test]
fn every_sentence_is_read_at_its_time_of_receipt() {
    const DATE: &str = "those of receipt before the sentences, taken as UTC where no offset is \
                        stated: seconds since the Unix epoch";
    const EPOCH: &str = "those of receipt before the sentences: seconds since the Unix epoch";
    let Some(made) = made("nmea") else { return };
    for (name, clock) in [
        ("iso.log", DATE),
        ("words.log", DATE),
        ("python.log", DATE),
        ("epoch.log", EPOCH),
        ("millis.log", EPOCH),
        ("day.log", "those of receipt before the sentences: seconds since midnight"),
        ("run.log", "those of receipt before the sentences, taken as seconds"),
    ] {
        let log = open(&made.file(name));
        made.agrees(name, &log, RESOLUTION_S);
        assert_eq!(log.sources()[0].format, "NMEA 0183");
        assert_eq!(notes(&log), [format!("{name}: times are {clock}")]);
    }
}

#[test]
fn damaged_sentences_are_skipped_and_counted() {
    let Some(made) = made("nmea") else { return };
    let path = made.file("rough.log");
    let log = open(&path);
    made.agrees("rough.log", &log, 0.0);
    let text = std::fs::read_to_string(&path).unwrap();
    let wrong: Vec<&str> =
        text.split('\n').filter(|l| l.contains(",t*") || l.ends_with(",T")).collect();
    let bytes: usize = wrong.iter().map(|line| line.len() - line.find('$').unwrap()).sum();
    assert_eq!(wrong.len(), 8);
    let first = text.find(wrong[0]).unwrap() + wrong[0].find('$').unwrap();
    assert_eq!(
        notes(&log),
        [
            format!(
                "rough.log: 8 stretches are damaged, the first at byte {first}; {bytes} bytes \
                 skipped"
            ),
            format!(
                "rough.log: the file is cut off in the record at byte {}, after 1956527994.750 s; \
                 all before was read",
                text.rfind('$').unwrap()
            ),
            "rough.log: times are those of receipt before the sentences: seconds since the Unix \
             epoch"
                .to_owned(),
            "rough.log: \"lines without a sentence\" are other text; left out".to_owned(),
            "rough.log: \"GP-GSV\" is a sentence whose fields are not known; left out".to_owned(),
        ]
    );
}

#[test]
fn sentences_without_a_time_before_them_lie_between_those_with_utc() {
    let Some(made) = made("nmea") else { return };
    let log = open(&made.file("bare.log"));
    made.agrees("bare.log", &log, RESOLUTION_S);
    assert_eq!(
        notes(&log),
        [
            "bare.log: times are the UTC in the sentences: seconds since the Unix epoch; sentences \
             without it are spread evenly between those with it, and up to 2.0 s off",
            "bare.log: of 156 records of \"HE-HDT\" 4 have no readable time; dropped",
        ]
    );
    assert_eq!(
        failure(&made.file("timeless.log")),
        "timeless.log is NMEA 0183 text without a time in any sentence or before it, which is not \
         supported; log again with the time of receipt before each sentence, or with RMC or ZDA \
         sentences among them"
    );
}

#[test]
fn sentences_as_a_phins_sent_them_are_read() {
    let text = "10:00:00.0 $PIXSE,ATITUD,-0.729,-15.705*58\n\
                10:00:00.1 $PIXSE,POSITI,39.27301545,14.38044597,-731.923*4D\n\
                10:00:00.2 $PIXSE,SPEED_,0.972,1.082,0.412*61\n\
                10:00:00.3 $PIXSE,HEAVE_,-0.211,0.031,-6.256*7E\n\
                10:00:00.4 $HETHS,191.75,A*16\n";
    let sample = Sample::new("phins.log", text);
    let log = open(sample.path());
    for (channel, value) in [
        ("PIXSE-ATITUD.roll", -0.729),
        ("PIXSE-ATITUD.pitch", -15.705),
        ("PIXSE-POSITI.latitude", 39.273_015_45),
        ("PIXSE-SPEED_.speed_north", 1.082),
        ("PIXSE-HEAVE_.heave", -6.256),
        ("HE-THS.heading", 191.75),
    ] {
        assert_eq!(log.channel(channel).unwrap().values(), [value], "{channel}");
    }
}

#[test]
fn a_recording_is_as_another_decoder_has_it() {
    let Some(path) = data("formats/ardusub/nmea_log.txt") else { return };
    let Some(made) = made("nmea_recordings") else { return };
    let log = open(&path);
    made.agrees("nmea_log.txt", &log, RESOLUTION_S);
    assert_eq!(
        notes(&log),
        [
            // The recorder wrote local time.
            "nmea_log.txt: times are those of receipt before the sentences, taken as UTC where no \
             offset is stated: seconds since the Unix epoch; they are 25200.0 s behind the UTC in \
             the sentences",
            "nmea_log.txt: \"GP-HDT.heading\" has no value in any record; left out",
            "nmea_log.txt: \"lines without a sentence\" are other text; left out",
        ]
    );
}
