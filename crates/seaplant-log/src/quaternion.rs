//! Attitudes that are logged as quaternions.

use std::collections::HashMap;

use crate::Unit;
use crate::column::Column;

/// Computes roll, pitch and yaw of a quaternion x, y, z, w, rad: turns about z, then y, then x.
///
/// `NaN` where the numbers are zero or not finite, so that they form no quaternion.
pub(crate) fn angles([x, y, z, w]: [f64; 4]) -> [f64; 3] {
    let square = x * x + y * y + z * z + w * w;
    if !(square > 0.0 && square.is_finite()) {
        return [f64::NAN; 3];
    }
    let roll = (2.0 * (w * x + y * z)).atan2(w * w - x * x - y * y + z * z);
    let sine = (2.0 * (w * y - z * x) / square).clamp(-1.0, 1.0);
    let yaw = (2.0 * (w * z + x * y)).atan2(w * w + x * x - y * y - z * z);
    [roll, sine.asin(), yaw]
}

/// Last words of the names of quaternions, without the component's letter.
const NAMES: &[&str] = &["quaternion", "quat", "q", "orientation", "attitude", "rotation"];
/// Tolerance on the unit norm of a quaternion, for numbers of few digits.
const NORM_WITHIN: f64 = 0.02;

/// Makes columns of roll, pitch and yaw, rad, of each quaternion among the columns of a table.
///
/// `imu.orientation.x`, `.y`, `.z` and `.w` give `imu.orientation.roll`, `.pitch` and `.yaw`;
/// `qx` to `qw` give `q.roll`. A table that has a column of such a name keeps its own.
pub(crate) fn attitudes(columns: &[Column], rows: usize) -> Vec<Column> {
    let named: HashMap<&str, &Column> =
        columns.iter().rev().map(|column| (column.heading.name.as_str(), column)).collect();
    let mut found = Vec::new();
    for last in columns {
        let Some(stem) = stem(&last.heading.name) else { continue };
        let beside = siblings(&last.heading.name).map(|name| named.get(name.as_str()).copied());
        let [Some(x), Some(y), Some(z)] = beside else { continue };
        let names = ["roll", "pitch", "yaw"].map(|angle| format!("{stem}.{angle}"));
        if names.iter().any(|name| named.contains_key(name.as_str())) {
            continue;
        }
        let numbers = [x, y, z, last].map(|column| column.samples.to_dense(rows));
        let Some(angles) = series(&numbers, rows) else { continue };
        let unit = || Unit::find("rad");
        found.extend(names.into_iter().zip(angles).map(|(name, of)| Column::new(name, unit(), of)));
    }
    found
}

/// Returns the name of the quaternion whose component w has this name.
fn stem(name: &str) -> Option<&str> {
    let stem = name.strip_suffix(['w', 'W'])?.trim_end_matches(is_mark);
    let word = stem.rsplit(is_mark).next()?.to_lowercase();
    NAMES
        .iter()
        .any(|known| word.ends_with(known) && (known.len() > 1 || word == *known))
        .then_some(stem)
}

fn is_mark(c: char) -> bool {
    !c.is_alphanumeric()
}

/// Returns the names of x, y and z that belong to that of w.
fn siblings(name: &str) -> [String; 3] {
    let letters = if name.ends_with('W') { ['X', 'Y', 'Z'] } else { ['x', 'y', 'z'] };
    letters.map(|letter| format!("{}{letter}", &name[..name.len() - 1]))
}

/// Computes the angles row by row; `None` if a row holds no unit quaternion.
fn series(numbers: &[Vec<f64>; 4], rows: usize) -> Option<[Vec<f64>; 3]> {
    let mut found: [Vec<f64>; 3] = Default::default();
    for quaternion in (0..rows).map(|row| [0, 1, 2, 3].map(|k| numbers[k][row])) {
        let norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
        // In messages, all zeros mean that there is no attitude.
        if norm.is_finite() && norm != 0.0 && (norm - 1.0).abs() > NORM_WITHIN {
            return None;
        }
        for (angle, value) in found.iter_mut().zip(angles(quaternion)) {
            angle.push(value);
        }
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(names: [&str; 4], rows: &[[f64; 4]]) -> Vec<Column> {
        let column = |k: usize| {
            Column::new(names[k].to_owned(), None, rows.iter().map(|row| row[k]).collect())
        };
        (0..4).map(column).collect()
    }

    fn names(columns: &[Column]) -> Vec<&str> {
        columns.iter().map(|column| column.heading.name.as_str()).collect()
    }

    #[test]
    fn a_turn_about_one_axis_is_one_angle() {
        let half = 0.3f64;
        for axis in 0..3 {
            let mut quaternion = [0.0, 0.0, 0.0, half.cos()];
            quaternion[axis] = half.sin();
            let angles = angles(quaternion);
            for (k, angle) in angles.into_iter().enumerate() {
                let expected = if k == axis { 0.6 } else { 0.0 };
                assert!((angle - expected).abs() < 1e-12, "{axis} {angle}");
            }
        }
        assert!(angles([0.0; 4]).iter().all(|angle| angle.is_nan()));
    }

    #[test]
    fn quaternions_are_found_by_their_names() {
        let turned = [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]];
        let of = |prefix: &str| ["x", "y", "z", "w"].map(|letter| format!("{prefix}{letter}"));
        for (prefix, stem) in [
            ("pose.orientation.", "pose.orientation"),
            ("quaternion_", "quaternion"),
            ("q", "q"),
            ("imu_q_", "imu_q"),
        ] {
            let headers = of(prefix);
            let found = attitudes(&table(headers.each_ref().map(String::as_str), &turned), 2);
            assert_eq!(names(&found), ["roll", "pitch", "yaw"].map(|a| format!("{stem}.{a}")));
            assert!((found[2].samples.values[1] - std::f64::consts::PI).abs() < 1e-12);
        }
        let others = table(["force_x", "force_y", "force_z", "force_w"], &turned);
        assert!(attitudes(&others, 2).is_empty());
    }

    #[test]
    fn numbers_of_another_norm_are_no_quaternion() {
        let columns =
            table(["qx", "qy", "qz", "qw"], &[[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 2.0, 1.0]]);
        assert!(attitudes(&columns, 2).is_empty());
        let absent = table(["qx", "qy", "qz", "qw"], &[[0.0, 0.0, 0.0, 1.0], [0.0; 4]]);
        assert_eq!(attitudes(&absent, 2)[0].samples.values.len(), 1);
    }
}
