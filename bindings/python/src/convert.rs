//! Conversions between Rust and Python: errors, JSON, arrays; and waiting without Python's lock.

use std::path::Path;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use numpy::PyReadonlyArray1;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use seaplant_campaign::TwinError;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Failures, by Python's exception classes.
#[derive(Debug)]
pub enum Failure {
    /// Invalid input: a `ValueError`.
    Input(String),
    /// A file could not be read: an `OSError`.
    File {
        message: String,
        /// True if the file does not exist: a `FileNotFoundError`.
        missing: bool,
    },
}

impl Failure {
    fn of_log(message: String, error: &seaplant_log::Error) -> Self {
        use seaplant_log::Error as E;
        match error {
            E::Io { source, .. } => Self::of_io(message, source),
            E::Directory { .. } | E::NotAFile { .. } => Self::File { message, missing: false },
            _ => Self::Input(message),
        }
    }

    fn of_io(message: String, error: &std::io::Error) -> Self {
        Self::File { message, missing: error.kind() == std::io::ErrorKind::NotFound }
    }
}

impl From<seaplant::Error> for Failure {
    fn from(error: seaplant::Error) -> Self {
        Self::Input(error.to_string())
    }
}

impl From<seaplant_log::Error> for Failure {
    fn from(error: seaplant_log::Error) -> Self {
        Self::of_log(error.to_string(), &error)
    }
}

impl From<seaplant_campaign::Error> for Failure {
    fn from(error: seaplant_campaign::Error) -> Self {
        use seaplant_campaign::Error as E;
        let message = error.to_string();
        match &error {
            E::Io { source, .. } => Self::of_io(message, source),
            E::NotAFile { .. } | E::TooLarge { .. } => Self::File { message, missing: false },
            E::Log { source, .. } | E::Channel { source, .. } | E::Table(source) => {
                Self::of_log(message, source)
            }
            _ => Self::Input(message),
        }
    }
}

impl From<TwinError> for Failure {
    fn from(error: TwinError) -> Self {
        match error {
            TwinError::File(error) => error.into(),
            TwinError::Twin(error) => error.into(),
        }
    }
}

impl From<seaplant_export::Error> for Failure {
    fn from(error: seaplant_export::Error) -> Self {
        Self::Input(error.to_string())
    }
}

impl From<seaplant_control::Error> for Failure {
    fn from(error: seaplant_control::Error) -> Self {
        Self::Input(error.to_string())
    }
}

impl From<seaplant_report::Error> for Failure {
    fn from(error: seaplant_report::Error) -> Self {
        Self::Input(error.to_string())
    }
}

impl From<serde_json::Error> for Failure {
    fn from(error: serde_json::Error) -> Self {
        Self::Input(error.to_string())
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        let (class, message) = match failure {
            Failure::Input(message) => ("InputError", message),
            Failure::File { message, missing: false } => ("FileError", message),
            Failure::File { message, missing: true } => ("MissingFileError", message),
        };
        Python::attach(|py| {
            let made = py
                .import("seaplant.errors")
                .and_then(|errors| errors.getattr(class)?.call1((message,)));
            made.map_or_else(|error| error, Self::from_value)
        })
    }
}

/// Interval at which the waiting thread checks for Ctrl-C.
const LOOK_OUT: Duration = Duration::from_millis(50);

/// Runs work on a separate thread, and waits for it without Python's lock.
///
/// Ctrl-C ends the wait with `KeyboardInterrupt`. Work that cannot be stopped then continues to its
/// end, and its result is dropped; `on_wait` is called at each check, and its error also ends the
/// wait.
pub fn apart_watched<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Failure> + Send + 'static,
    mut on_wait: impl FnMut(Python<'_>) -> PyResult<()>,
) -> PyResult<T> {
    let (done, wait) = channel();
    // The receiver is dropped if the wait was given up; then the result is not needed.
    let worker = thread::spawn(move || _ = done.send(work()));
    // Other threads can borrow a receiver only within a lock of its own.
    let wait = std::sync::Mutex::new(wait);
    let next = || match wait.lock() {
        Ok(wait) => wait.recv_timeout(LOOK_OUT),
        Err(_) => Err(RecvTimeoutError::Disconnected),
    };
    loop {
        match py.detach(next) {
            Ok(found) => return Ok(found?),
            Err(RecvTimeoutError::Timeout) => {
                py.check_signals()?;
                on_wait(py)?;
            }
            Err(RecvTimeoutError::Disconnected) => {
                let panic = worker.join().err();
                let said = panic.as_ref().and_then(|panic| panic.downcast_ref::<String>().cloned());
                let said = said.unwrap_or_else(|| "it does not say why".to_owned());
                let message = format!("seaplant failed, which is its own fault: {said}");
                return Err(PyRuntimeError::new_err(message));
            }
        }
    }
}

/// Does the same as [`apart_watched`], with nothing to do while waiting.
pub fn apart<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    apart_watched(py, work, |_| Ok(()))
}

/// Parses JSON that a program gives in place of a file; messages call it `name`.
pub fn parse<T: DeserializeOwned>(name: &str, json: &str) -> Result<T, Failure> {
    let value = serde_json::from_str(json)?;
    Ok(seaplant_campaign::of_json(Path::new(name), value)?)
}

/// Formats a value as JSON, as in results.
pub fn json(value: &impl Serialize) -> Result<String, Failure> {
    Ok(serde_json::to_string(value)?)
}

/// Copies the numbers of an array, whatever its strides.
pub fn numbers(array: &PyReadonlyArray1<'_, f64>) -> Vec<f64> {
    array.as_array().iter().copied().collect()
}
