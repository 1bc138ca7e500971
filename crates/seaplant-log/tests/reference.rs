//! Compares the values of a file with those that Python's csv module reads.

use std::path::Path;

use seaplant_log::{ReadOptions, read};

#[test]
fn agrees_with_another_reader() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference");
    let text = std::fs::read_to_string(folder.join("log.json")).unwrap();
    let reference: serde_json::Value = serde_json::from_str(&text).unwrap();
    let columns = reference["columns"].as_object().unwrap();
    let log = read(&folder.join("log.csv"), &ReadOptions::default()).unwrap();
    assert_eq!(log.channels().len(), columns.len());
    for channel in log.channels() {
        let expected = &columns[&channel.column];
        let number = |key: &str| expected[key].as_f64().unwrap();
        let (time_s, values) = (channel.time_s(), channel.values());
        let last = channel.len() - 1;
        assert_eq!(channel.len() as u64, expected["count"].as_u64().unwrap());
        assert_eq!((values[0], values[last]), (number("first"), number("last")));
        assert_eq!((time_s[0], time_s[last]), (number("first_time"), number("last_time")));
        // The reference sum is exactly rounded, ours is not.
        let magnitude: f64 = values.iter().map(|value| value.abs()).sum();
        let sum: f64 = values.iter().sum();
        assert!((sum - number("sum")).abs() <= 1e-13 * magnitude, "{}", channel.column);
    }
}
