//! Bags of ROS 1 and ROS 2.

use std::path::Path;

use seaplant_log::{ReadOptions, read_bytes};

use crate::common::mcap::McapFile;
use crate::common::python::made;
use crate::harness::{Limits, hammer, hammer_within};

/// Damages a file; `repair` recomputes the checksums of its parts.
fn bag(name: &str, limits: Limits, repair: impl Fn(&mut Vec<u8>)) {
    let Some(made) = made("ros") else { return };
    let seed = std::fs::read(made.file(name)).unwrap();
    hammer(name, &seed, &ReadOptions::default(), limits, repair);
}

#[test]
fn mcap_files() {
    bag("seed-plain.mcap", Limits::default(), |_| {});
    bag("seed-flat.mcap", Limits::default(), |_| {});
    bag("seed-zstd.mcap", Limits::default(), |_| {});
}

#[test]
fn sqlite_bags() {
    bag("seed.db3", Limits::default(), |_| {});
}

#[test]
fn ros_1_bags() {
    bag("seed-plain.bag", Limits::default(), |_| {});
    bag("seed-lz4.bag", Limits::default(), |_| {});
}

#[test]
fn message_definitions() {
    let definition = "std_msgs/Header header\nuint8 KIND=1\nInner[2] pair\nInner[] list\nfloat64[3] xyz\n\
                      float64[<=4] some\nstring[] name\nwstring wide\ngeometry_msgs/Quaternion q\n\
                      int8[400000000] much\nNothing[9] nothing\n\
                      ===\nMSG: a/Inner\nbool yes\nDeep[3] deep\nstring text\n\
                      ===\nMSG: a/Deep\nuint64 n\nNothing none\n===\nMSG: a/Nothing\n\
                      ===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
                      ===\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";
    let content: Vec<u8> = (0..600u32).map(|k| if k % 5 == 0 { 1 } else { 0 }).collect();
    for (name, language, encoding) in [("ros2", "ros2msg", "cdr"), ("ros1", "ros1msg", "ros1")] {
        let wrap = |definition: &[u8]| {
            let definition = String::from_utf8_lossy(definition);
            let mut file = McapFile::new();
            file.channel(0, "/a", "a/msg/Main", (language, &definition), encoding);
            for k in 0..20 {
                let content = &content[..content.len() - 7 * k];
                file.cdr(0, k as u64, content);
            }
            file.finish()
        };
        let (options, limits) = (ReadOptions::default(), Limits::default());
        hammer_within(&format!("definition-{name}"), definition.as_bytes(), &options, limits, wrap);
    }
}

/// Types with thirty-two fields of the next type, thirty deep, with nothing in them.
#[test]
fn a_definition_that_explodes_is_refused() {
    let mut definition = "T0[32] all\n".to_owned();
    for k in 0..30 {
        definition += &format!("===\nMSG: a/T{k}\nT{}[32] all\nT{}[32] more\n", k + 1, k + 1);
    }
    definition += "===\nMSG: a/T30\n";
    let mut file = McapFile::new();
    file.topic(0, "/a", "a/msg/Main", &definition);
    file.cdr(0, 1, &[0; 100]);
    let error = read_bytes(Path::new("a.mcap"), &file.finish(), &ReadOptions::default());
    assert!(error.is_err());
}
