//! Bags of ROS 1 and ROS 2.

use seaplant_log::{Error, Log, ReadOptions, Stamp, read};

use crate::common::mcap::McapFile;
use crate::common::python::made;
use crate::common::{Sample, notes, open, without_folder};

/// Resolution of seconds since 1970 in a double, for stamps and receipts in nanoseconds.
const RESOLUTION_S: f64 = 2.5e-7;

#[test]
fn mcap_files_are_read_as_independent_software_wrote_them() {
    let Some(made) = made("ros") else { return };
    for name in [
        "zstd.mcap",
        "lz4.mcap",
        "plain.mcap",
        "unchunked.mcap",
        "big.mcap",
        "rosbags.mcap",
        "ros1.mcap",
    ] {
        let log = open(&made.file(name));
        made.agrees(name, &log, RESOLUTION_S);
        assert_eq!(log.sources()[0].format, "MCAP");
    }
}

#[test]
fn sqlite_bags_are_read_as_independent_software_wrote_them() {
    let Some(made) = made("ros") else { return };
    for name in ["iron.db3", "packed.db3", "foxy.db3"] {
        let log = open(&made.file(name));
        made.agrees(name, &log, RESOLUTION_S);
        assert_eq!(log.sources()[0].format, "ROS 2 bag (SQLite)");
    }
}

#[test]
fn ros_1_bags_are_read_as_independent_software_wrote_them() {
    let Some(made) = made("ros") else { return };
    for name in ["plain.bag", "bz2.bag", "lz4.bag"] {
        let log = open(&made.file(name));
        made.agrees(name, &log, RESOLUTION_S);
        assert_eq!(log.sources()[0].format, "ROS 1 bag");
    }
}

#[test]
fn times_of_receipt_are_had_by_choice() {
    let Some(made) = made("ros") else { return };
    let options = ReadOptions { stamp: Stamp::Receive, ..ReadOptions::default() };
    let log = read(&made.file("zstd.mcap"), &options).unwrap();
    made.agrees("zstd.mcap/receive", &log, RESOLUTION_S);
    let clock = "zstd.mcap: times are those of receipt, seconds since the Unix epoch";
    assert_eq!(notes(&log)[0], clock);
}

#[test]
fn decisions_and_omissions_are_reported() {
    let Some(made) = made("ros") else { return };
    let log = open(&made.file("zstd.mcap"));
    assert_eq!(
        notes(&log),
        [
            "zstd.mcap: times are header stamps, seconds since the Unix epoch; of \"/state\", \
             \"/cmd_vel\", without stamps, those of receipt",
            "zstd.mcap: each of 17 fields holds text; left out: \"/everything/header.frame_id\", \
             \"/everything/inner.label\", \"/everything/inners[0].label\", \
             \"/everything/inners[1].label\", \"/everything/many[].label\", \
             \"/everything/nested[].label\", \"/everything/short_text\", \"/everything/text\", \
             \"/everything/two_texts\", \"/everything/words\", \"/imu/data/header.frame_id\", \
             \"/joints/header.frame_id\" and 5 more",
            "zstd.mcap: each of 6 fields is a covariance; left out: \
             \"/everything/some_covariance\", \"/imu/data/angular_velocity_covariance\", \
             \"/imu/data/linear_acceleration_covariance\", \
             \"/imu/data/orientation_covariance\", \"/odometry/pose.covariance\", \
             \"/odometry/twist.covariance\"",
            "zstd.mcap: each of 4 fields is a list of more than 32 elements; left out: \
             \"/everything/blob\", \"/everything/far_too_long\", \"/everything/many\", \
             \"/everything/thousand\"",
            "zstd.mcap: \"/everything/varying\" is a list of varying length; left out",
        ]
    );
    let error = log.channel("/everything/text").unwrap_err();
    assert_eq!(
        without_folder(&error.to_string(), &made.file("zstd.mcap")),
        "column \"/everything/text\" of zstd.mcap holds text; choose another"
    );
    let log = open(&made.file("foxy.db3"));
    let sonar = notes(&log).into_iter().find(|note| note.contains("/sonar"));
    assert_eq!(
        sonar.as_deref(),
        Some(
            "foxy.db3: \"/sonar\" is of a type without definition in the file, which is not one of \
             the common types; record it as MCAP; left out"
        )
    );
}

/// Counts the messages of a topic that lie completely before each byte of a file without chunks.
fn messages_before(bytes: &[u8], topic: &str) -> Vec<usize> {
    let number = |at: usize, size: usize| {
        bytes[at..at + size].iter().rev().fold(0, |n, &byte| n << 8 | usize::from(byte))
    };
    let (mut at, mut id, mut ends) = (8, None, Vec::new());
    while bytes[at] != 15 {
        let (kind, content, length) = (bytes[at], at + 9, number(at + 1, 8));
        at = content + length;
        match kind {
            4 if bytes[content + 8..].starts_with(topic.as_bytes()) => {
                id = Some(number(content, 2))
            }
            5 if Some(number(content, 2)) == id => ends.push(at),
            _ => {}
        }
    }
    ends
}

#[test]
fn a_file_that_is_cut_gives_all_messages_before_the_cut() {
    let Some(made) = made("ros") else { return };
    let bytes = std::fs::read(made.file("unchunked.mcap")).unwrap();
    let whole = open(&made.file("unchunked.mcap"));
    let whole = whole.channel("/imu/data/angular_velocity.z").unwrap();
    let ends = messages_before(&bytes, "/imu/data");
    assert_eq!(ends.len(), 240);
    for cut in [ends[3], ends[3] + 4, ends[100] - 1, ends[200], ends[200] + 17] {
        let sample = Sample::new("cut.mcap", &bytes[..cut]);
        let log = open(sample.path());
        let channel = log.channel("/imu/data/angular_velocity.z").unwrap();
        let expected = ends.iter().filter(|&&end| end <= cut).count();
        assert_eq!(channel.len(), expected, "cut at {cut}");
        assert_eq!(channel.values(), &whole.values()[..expected]);
        let note = &notes(&log)[0];
        assert!(note.starts_with("cut.mcap: the file is cut off in the record at byte "), "{note}");
    }
}

#[test]
fn a_truncated_chunk_gives_its_intact_part() {
    let Some(made) = made("ros") else { return };
    for name in ["plain.mcap", "zstd.mcap", "lz4.mcap", "plain.bag", "lz4.bag", "iron.db3"] {
        let bytes = std::fs::read(made.file(name)).unwrap();
        let whole = open(&made.file(name));
        let whole = whole.channel("/everything/f64").unwrap();
        // The longer the remaining file, the more is read; the parts of the file are about equal.
        for tenth in 3..9 {
            let sample = Sample::new("cut", &bytes[..bytes.len() * tenth / 10]);
            let log = open(sample.path());
            let channel = log.channel("/everything/f64").unwrap();
            assert!(channel.len() * 10 >= whole.len() * (tenth - 2), "{name}, {tenth}");
            assert_eq!(channel.values(), &whole.values()[..channel.len()], "{name}, {tenth}");
            let told =
                notes(&log).iter().any(|note| note.starts_with("cut: the file is cut off in"));
            assert!(told, "{name}, {tenth}: {:?}", notes(&log));
        }
    }
}

#[test]
fn damage_costs_only_the_damaged_records() {
    let Some(made) = made("ros") else { return };
    for name in [
        "plain.mcap",
        "zstd.mcap",
        "lz4.mcap",
        "unchunked.mcap",
        "plain.bag",
        "bz2.bag",
        "iron.db3",
    ] {
        let mut bytes = std::fs::read(made.file(name)).unwrap();
        let whole = open(&made.file(name));
        let whole = whole.channel("/imu/data/angular_velocity.z").unwrap();
        // The first chunk, which declares all topics, and lengths further on.
        let third = bytes.len() / 3;
        bytes[20_000..20_200].fill(0xff);
        bytes[third..third + 4000].fill(0xff);
        let sample = Sample::new("damaged", &bytes);
        let log = open(sample.path());
        let channel = log.channel("/imu/data/angular_velocity.z").unwrap();
        assert!(channel.len() * 3 > whole.len(), "{name}: {}", channel.len());
        let told = notes(&log).iter().any(|note| note.contains("damaged, the first at byte"));
        assert!(told, "{name}: {:?}", notes(&log));
        // The values present are right.
        for (time, value) in channel.time_s().iter().zip(channel.values()) {
            let at = whole.time_s().iter().position(|t| t == time).unwrap();
            assert_eq!(*value, whole.values()[at], "{name}");
        }
    }
}

#[test]
fn a_bag_that_was_never_indexed_is_read() {
    let Some(made) = made("ros") else { return };
    let mut bytes = std::fs::read(made.file("plain.bag")).unwrap();
    let field = b"index_pos=";
    let at = bytes.windows(field.len()).position(|window| window == field).unwrap() + field.len();
    let index = u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    bytes[at..at + 8].fill(0);
    bytes.truncate(index as usize);
    let sample = Sample::new("plain.bag", &bytes);
    made.agrees("plain.bag", &open(sample.path()), RESOLUTION_S);
}

#[test]
fn a_bag_in_an_archive_is_read() {
    let Some(made) = made("ros") else { return };
    for name in ["iron.db3", "plain.mcap", "plain.bag"] {
        let bytes = std::fs::read(made.file(name)).unwrap();
        let sample = Sample::new(&format!("{name}.zstd"), zstd::encode_all(&bytes[..], 1).unwrap());
        made.agrees(name, &open(sample.path()), RESOLUTION_S);
    }
}

/// Reads a file of one topic `/a` whose messages are one second apart.
fn file(definition: &str, messages: &[&[u8]]) -> Result<Log, Error> {
    let mut file = McapFile::new();
    file.topic(0, "/a", "a/msg/A", definition);
    for (k, message) in (1..).zip(messages) {
        file.cdr(0, k * 1_000_000_000, message);
    }
    let sample = Sample::new("a.mcap", file.finish());
    read(sample.path(), &ReadOptions::default())
}

const STAMPED: &str = "std_msgs/Header header\nuint8 a\n===\nMSG: std_msgs/Header\n\
                       builtin_interfaces/Time stamp\nstring frame_id\n";

/// Encodes a stamped message without a frame name.
fn stamped(s: u8, value: u8) -> Vec<u8> {
    [&[s, 0, 0, 0], &[0; 4][..], &[1, 0, 0, 0, 0, value]].concat()
}

#[test]
fn unset_stamps_are_replaced_by_receipt() {
    let log = file(STAMPED, &[&stamped(0, 5), &stamped(0, 6)]).unwrap();
    assert_eq!(log.channel("/a/a").unwrap().time_s(), [1.0, 2.0]);
    let clock = "a.mcap: times are those of receipt, seconds since the Unix epoch; no message has a \
                 stamp";
    assert_eq!(notes(&log)[0], clock);
    let log = file(STAMPED, &[&stamped(0, 5), &stamped(2, 6), &stamped(3, 7)]).unwrap();
    assert_eq!(log.channel("/a/a").unwrap().time_s(), [2.0, 3.0]);
    let timeless = "a.mcap: of 3 records of \"/a\" 1 has no readable time; dropped";
    assert_eq!(notes(&log)[1], timeless);
}

#[test]
fn clocks_that_differ_are_reported() {
    let log = file(STAMPED, &[&stamped(101, 5), &stamped(102, 6)]).unwrap();
    let clock = "a.mcap: times are header stamps, seconds since the Unix epoch; the first stamp of \"/a\" \
                 is 100.000 s after its receipt: the clocks differ, so take `stamp = \"receive\"` \
                 if topics must agree";
    assert_eq!(notes(&log)[0], clock);
}

#[test]
fn a_quaternion_of_zeros_is_none() {
    let text = "geometry_msgs/Quaternion q\n===\nMSG: geometry_msgs/Quaternion\nfloat64 x\n\
                float64 y\nfloat64 z\nfloat64 w\n";
    let quarter: Vec<u8> = [0.0f64, 0.0, 2.0, 2.0].iter().flat_map(|q| q.to_le_bytes()).collect();
    let log = file(text, &[&[0; 32], &quarter]).unwrap();
    let yaw = log.channel("/a/q.yaw").unwrap();
    assert_eq!((yaw.values(), yaw.missing), (&[std::f64::consts::FRAC_PI_2][..], 1));
}

#[test]
fn wide_texts_are_passed_over_in_either_width() {
    for width in [2, 4] {
        let mut message = [&[3, 0, 0, 0][..], &[b'a'; 12][..3 * width]].concat();
        message.resize(message.len().next_multiple_of(4), 0);
        message.extend([7, 0, 0, 0]);
        let log = file("wstring wide\nuint32 after\n", &[&message, &message]).unwrap();
        assert_eq!(log.channel("/a/after").unwrap().values(), [7.0, 7.0], "{width}");
    }
}

#[test]
fn messages_that_do_not_fit_their_definition_are_counted() {
    let log = file("float32 a\n", &[&[0; 4], &[0; 12], &[0; 4]]).unwrap();
    assert_eq!(log.channel("/a/a").unwrap().len(), 2);
    let damage = "a.mcap: 1 stretch is damaged, the first at byte 149; 16 bytes skipped";
    assert_eq!(notes(&log)[0], damage);
    let error = file("float32 a\n", &[&[0; 12], &[0; 12]]).unwrap_err();
    assert!(error.to_string().ends_with(
        "a.mcap is an MCAP file in which \"/a\" has messages that are not as their definition \
         says, which is not supported; record topics of numbers as ROS messages, with their definitions"
    ));
}

#[test]
fn elements_that_change_names_are_left_out() {
    let message =
        |name: u8| [&[1, 0, 0, 0, 2, 0, 0, 0, name, 0, 0, 0][..], &[1, 0, 0, 0, 9]].concat();
    let log = file(
        "string[] name\nuint8[] v\nuint8 w\n",
        &[&[message(b'a'), vec![1]].concat(), &[message(b'b'), vec![2]].concat()],
    )
    .unwrap();
    assert_eq!(log.channels().len(), 1);
    assert_eq!(notes(&log)[1], "a.mcap: \"/a/v\" changes what its elements are; left out");
}

#[test]
fn a_file_that_is_not_a_bag_is_refused() {
    let refused = |bytes: &[u8]| {
        let sample = Sample::new("a.log", bytes);
        let error = read(sample.path(), &ReadOptions::default()).unwrap_err();
        without_folder(&error.to_string(), sample.path())
    };
    assert_eq!(
        refused(b"\x89MCAP9\r\n\0\0\0"),
        "a.log is an MCAP file of an unknown version, which is not supported; convert it with the \
         `mcap` command, or copy it again if it is damaged"
    );
    assert_eq!(
        refused(b"#ROSBAG V1.2\n\0\0\0"),
        "a.log is a ROS 1 bag of another version than 2.0, which is not supported; run `rosbag \
         migrate` on it, or copy it again if it is damaged"
    );
    assert_eq!(
        refused(b"SQLite format 3\0\0\0"),
        "a.log cannot be read as an SQLite database: at byte 16, a header that states no page size \
         or no UTF-8; copy the file again from where it was recorded, or export it as CSV"
    );
    let mut file = McapFile::new();
    file.channel(0, "/scan", "foxglove.Scan", ("protobuf", ""), "protobuf");
    assert_eq!(
        refused(&file.finish()),
        "a.log is an MCAP file in which \"/scan\" has no message encoding of ROS, which is not \
         supported; record topics of numbers as ROS messages, with their definitions"
    );
}

#[test]
fn negative_times_and_the_second_version_of_cdr_are_read() {
    // A duration of -1 s and -5e8 ns, as ROS 1 encodes it.
    let mut file = McapFile::new();
    file.channel(0, "/a", "a/A", ("ros1msg", "duration d\n"), "ros1");
    let content = [(-1i32).to_le_bytes(), (-500_000_000i32).to_le_bytes()].concat();
    file.message(0, 1, &content);
    // Doubles are aligned to four bytes.
    file.topic(1, "/b", "b/msg/B", "uint32 n\nfloat64 x\n");
    let content = [&[0, 7, 0, 0][..], &[1, 0, 0, 0], &2.5f64.to_le_bytes()].concat();
    file.message(1, 1, &content);
    let sample = Sample::new("a.mcap", file.finish());
    let log = open(sample.path());
    assert_eq!(log.channel("/a/d").unwrap().values(), [-1.5]);
    assert_eq!(log.channel("/b/x").unwrap().values(), [2.5]);
}

#[test]
fn chunks_that_swell_past_any_log_are_refused() {
    let mut records = Vec::new();
    for _ in 0..20_000 {
        records.push(5);
        records.extend(30u64.to_le_bytes());
        records.extend([&[0; 22][..], &[0, 1, 0, 0, 0, 0, 0, 0]].concat());
    }
    let packed = zstd::encode_all(&records[..], 19).unwrap();
    let size = (records.len() as u64).to_le_bytes();
    let head = [&[0; 16][..], &size, &[0; 4], &[4, 0, 0, 0], b"zstd"].concat();
    let chunk = [&head, &(packed.len() as u64).to_le_bytes()[..], &packed].concat();
    let mut file = McapFile::new();
    file.topic(0, "/a", "a/msg/A", "float32 a\n");
    for _ in 0..100 {
        file.record(6, &chunk);
    }
    let sample = Sample::new("a.mcap", file.finish());
    let Error::TooMuch { packed, unpacked, .. } =
        read(sample.path(), &ReadOptions::default()).unwrap_err()
    else {
        panic!("it is something else")
    };
    assert!(unpacked > 200 * packed);
}

#[test]
fn a_write_ahead_log_beside_a_bag_is_reported() {
    let Some(made) = made("ros") else { return };
    let sample = Sample::new("iron.db3", std::fs::read(made.file("iron.db3")).unwrap());
    std::fs::write(sample.folder().join("iron.db3-wal"), "frames").unwrap();
    let told = notes(&open(sample.path()));
    assert_eq!(
        told.last().map(String::as_str),
        Some(
            "iron.db3: \"iron.db3-wal\" has the last messages, for the recorder did not end well; \
             `sqlite3 FILE 'PRAGMA wal_checkpoint'` moves them into the database; left out"
        )
    );
}

#[test]
fn a_packing_that_is_not_known_is_named() {
    let mut file = McapFile::new();
    file.topic(0, "/a", "a/msg/A", "float32 a\n");
    let head = [&[0; 16][..], &[9, 0, 0, 0, 0, 0, 0, 0], &[0; 4], &[3, 0, 0, 0], b"lzo"].concat();
    file.record(6, &[&head[..], &[4, 0, 0, 0, 0, 0, 0, 0], b"\x01\x02\x03\x04"].concat());
    let sample = Sample::new("a.mcap", file.finish());
    let error = read(sample.path(), &ReadOptions::default()).unwrap_err();
    assert_eq!(
        without_folder(&error.to_string(), sample.path()),
        "a.mcap is an MCAP file whose chunks are packed by \"lzo\", which is not supported; convert it: \
         `mcap convert` or `mcap compress` write zstd"
    );
}

#[test]
fn the_folder_of_a_bag_that_was_split_is_one_log() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let index = "rosbag2_bagfile_information:\n  relative_file_paths:\n  - a.csv\n  - b.csv\n";
    std::fs::write(path.join("metadata.yaml"), index).unwrap();
    std::fs::write(path.join("a.csv"), "time [s],u [m/s]\n0,1\n1,2\n2,3\n").unwrap();
    let missing = read(path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(missing.starts_with("cannot read ") && missing.contains("b.csv"), "{missing}");
    std::fs::write(path.join("b.csv"), "time [s],u [m/s]\n3,4\n4,5\n5,6\n").unwrap();
    let log = open(path);
    let u = log.channel("u").unwrap();
    assert_eq!(u.time_s(), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    assert_eq!(u.values(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let [source] = log.sources() else { panic!("{:?}", log.sources()) };
    assert_eq!((source.path.as_path(), source.bytes), (path, 58));
    // `sha256sum *.csv | cut -c1-64 | sha256sum` of GNU coreutils.
    let expected = "c4658ccaaca4c90cc106f4676500027dde30d71600b0dfd61f057e9164116599";
    assert_eq!(source.sha256, expected);
    assert_eq!(
        seaplant_log::Survey::open(&[(path.to_owned(), ReadOptions::default())])
            .unwrap()
            .channels()
            .len(),
        1
    );
}
