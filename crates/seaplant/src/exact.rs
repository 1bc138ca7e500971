//! Lists of fixed length in files: a longer one is an error, and is not truncated.

use serde::{Deserialize, Deserializer};

/// Deserialises exactly `N` numbers.
///
/// # Errors
/// An error of the format if there are fewer or more.
pub fn numbers<'de, D: Deserializer<'de>, const N: usize>(from: D) -> Result<[f64; N], D::Error> {
    into_array(Vec::deserialize(from)?)
}

/// Deserialises exactly `N` numbers, or none.
///
/// # Errors
/// As [`numbers`].
pub fn some_numbers<'de, D: Deserializer<'de>, const N: usize>(
    from: D,
) -> Result<Option<[f64; N]>, D::Error> {
    Option::<Vec<f64>>::deserialize(from)?.map(into_array).transpose()
}

/// Deserialises a list whose rows each hold exactly `N` numbers.
///
/// # Errors
/// As [`numbers`].
pub fn rows_of_numbers<'de, D: Deserializer<'de>, const N: usize>(
    from: D,
) -> Result<Vec<[f64; N]>, D::Error> {
    Vec::<Vec<f64>>::deserialize(from)?.into_iter().map(into_array).collect()
}

fn into_array<E: serde::de::Error, const N: usize>(list: Vec<f64>) -> Result<[f64; N], E> {
    let found = list.len();
    list.try_into().map_err(|_| E::invalid_length(found, &format!("{N} numbers").as_str()))
}
