//! Lists of a fixed length as files have them: one that is longer is an error, not cut short.

use serde::{Deserialize, Deserializer};

/// Reads exactly `N` numbers.
///
/// # Errors
/// That of the format, if there are fewer or more.
pub fn numbers<'de, D: Deserializer<'de>, const N: usize>(from: D) -> Result<[f64; N], D::Error> {
    of_list(Vec::deserialize(from)?)
}

/// [`numbers`], where there may be none.
///
/// # Errors
/// As [`numbers`].
pub fn some_numbers<'de, D: Deserializer<'de>, const N: usize>(
    from: D,
) -> Result<Option<[f64; N]>, D::Error> {
    Option::<Vec<f64>>::deserialize(from)?.map(of_list).transpose()
}

/// A list of lists, each as of [`numbers`].
///
/// # Errors
/// As [`numbers`].
pub fn rows_of_numbers<'de, D: Deserializer<'de>, const N: usize>(
    from: D,
) -> Result<Vec<[f64; N]>, D::Error> {
    Vec::<Vec<f64>>::deserialize(from)?.into_iter().map(of_list).collect()
}

fn of_list<E: serde::de::Error, const N: usize>(list: Vec<f64>) -> Result<[f64; N], E> {
    let found = list.len();
    list.try_into().map_err(|_| E::invalid_length(found, &format!("{N} numbers").as_str()))
}
