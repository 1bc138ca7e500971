//! Logs in gzip and zstd archives.

use seaplant_log::{Error, ReadOptions, read, read_table};

use crate::common::python::made;
use crate::common::{Sample, notes, without_folder};

#[test]
fn tables_in_archives_are_read_as_python_wrote_them() {
    let Some(made) = made("packed") else { return };
    for (name, format) in [
        ("log.csv.gz", "comma-separated text, gzip"),
        ("members.gz", "comma-separated text, gzip"),
        ("stored.gz", "comma-separated text, gzip"),
        ("log.csv.zst", "comma-separated text, zstd"),
        ("frames.zst", "comma-separated text, zstd"),
        ("unsized.zst", "comma-separated text, zstd"),
        ("twice.zst.gz", "comma-separated text, zstd, gzip"),
    ] {
        let path = made.file(name);
        let log = read(&path, &ReadOptions::default()).unwrap();
        made.agrees(name, &log, 0.0);
        let source = &log.sources()[0];
        assert_eq!((source.format.as_str(), notes(&log).len()), (format, 0));
        // Size and hash are of the archive, which provenance names.
        assert_eq!(source.bytes, std::fs::metadata(&path).unwrap().len());
        assert_eq!(read_table(&path).unwrap().rows(), 20_000);
    }
}

#[test]
fn a_truncated_archive_gives_its_complete_lines() {
    let Some(made) = made("packed") else { return };
    let log = read(&made.file("cut.csv.gz"), &ReadOptions::default()).unwrap();
    made.agrees("cut.csv.gz", &log, 0.0);
    let bytes = std::fs::read_to_string(made.file("cut.bytes")).unwrap();
    let expected = format!(
        "cut.csv.gz: the gzip archive is cut off; the {bytes} bytes that could be unpacked were read"
    );
    assert_eq!(notes(&log), [expected]);
}

#[test]
fn a_wrong_checksum_is_reported() {
    let Some(made) = made("packed") else { return };
    let log = read(&made.file("checksum.csv.gz"), &ReadOptions::default()).unwrap();
    made.agrees("checksum.csv.gz", &log, 0.0);
    let [note] = &notes(&log)[..] else { panic!("{:?}", notes(&log)) };
    assert!(note.starts_with("checksum.csv.gz: the gzip archive is damaged ("), "{note}");
}

#[test]
fn an_archive_that_swells_past_any_log_is_refused() {
    let Some(made) = made("packed") else { return };
    for name in ["bomb.gz", "bomb.zst"] {
        let path = made.file(name);
        let error = read(&path, &ReadOptions::default()).unwrap_err();
        let Error::TooMuch { packed, unpacked, .. } = &error else { panic!("{error}") };
        assert!(*unpacked > 200 * packed, "{error}");
        let expected = format!(
            "{name}: {packed} bytes unpack to more than {unpacked}, which is not plausible for a log; if it is \
             one, unpack it first"
        );
        assert_eq!(without_folder(&error.to_string(), &path), expected);
    }
}

#[test]
fn an_archive_without_content_is_refused() {
    let refused = |bytes: &[u8]| {
        let sample = Sample::new("log.gz", bytes);
        let error = read(sample.path(), &ReadOptions::default()).unwrap_err();
        without_folder(&error.to_string(), sample.path())
    };
    assert_eq!(
        refused(b"\x1f\x8b\x08\0\0\0\0\0\0\x03"),
        "log.gz is a gzip archive that is cut off from its start; copy it again from where it was \
         made"
    );
    // A reserved bit of the frame header is set.
    let damaged = refused(b"\x28\xb5\x2f\xfd\x28\x01\x01\x01\x01\x01\x01\x01\x01\x01\x01\x01");
    assert!(damaged.starts_with("log.gz is a zstd archive that is damaged ("), "{damaged}");
}

#[test]
fn an_archive_in_an_archive_in_an_archive_is_refused() {
    let pack = |bytes: Vec<u8>| {
        // One stored block: only a frame around the bytes.
        let mut packed = b"\x1f\x8b\x08\0\0\0\0\0\0\x03\x01".to_vec();
        packed.extend((bytes.len() as u16).to_le_bytes());
        packed.extend((!(bytes.len() as u16)).to_le_bytes());
        packed.extend(bytes);
        packed
    };
    let sample = Sample::new("log.gz", pack(pack(pack(b"t,u\n0,1\n1,2\n".to_vec()))));
    let error = read(sample.path(), &ReadOptions::default()).unwrap_err();
    assert_eq!(
        without_folder(&error.to_string(), sample.path()),
        "log.gz is an archive in archives in archives, which is not supported; unpack it first"
    );
}
