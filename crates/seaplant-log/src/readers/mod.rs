//! One module for each format.

pub(crate) mod arrow_ipc;
pub(crate) mod bytes;
pub(crate) mod columnar;
pub(crate) mod dataflash;
pub(crate) mod gzip;
pub(crate) mod hdf5;
pub(crate) mod mat5;
pub(crate) mod mcap;
pub(crate) mod nmea;
mod number;
pub(crate) mod parquet;
pub(crate) mod parquet_file;
pub(crate) mod parquet_pages;
pub(crate) mod pd0;
pub(crate) mod ros;
pub(crate) mod rosbag1;
pub(crate) mod sqlite;
pub(crate) mod text;
pub(crate) mod tlog;
pub(crate) mod ulog;
mod window;
pub(crate) mod workspace;
pub(crate) mod xlsx;
pub(crate) mod zstd;
