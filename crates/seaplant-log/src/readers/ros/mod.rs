//! Messages and message definitions, which bags of ROS 1 and ROS 2 share.

mod bundled;
mod chunks;
mod decode;
mod definition;
mod layout;
mod packing;
mod recording;
mod topic;
mod units;
mod window;

pub(crate) use chunks::{Choice, Chunk, choose};
pub(crate) use decode::Encoding;
pub(crate) use packing::Packing;
pub(crate) use recording::{Connection, Recording};
pub(crate) use window::Window;
