//! Definitions of the common ROS 2 message types, for bags that carry none.

use std::sync::OnceLock;

use super::definition::{Definitions, Dialect};

/// Returns every type below.
pub(crate) fn definitions() -> &'static Definitions {
    static ALL: OnceLock<Definitions> = OnceLock::new();
    ALL.get_or_init(|| {
        Definitions::parse("std_msgs/Empty", COMMON, Dialect::Ros2)
            .expect("a test reads the definitions")
    })
}

/// `std_msgs/Empty` comes first, because the text before the first `MSG:` defines the requested
/// type.
const COMMON: &str = include_str!("common.msg");

#[cfg(test)]
mod tests {
    use super::super::layout::Layout;
    use super::*;

    #[test]
    fn every_definition_compiles() {
        let names = COMMON.lines().filter_map(|line| line.strip_prefix("MSG: "));
        let mut count = 0;
        for name in names {
            let layout = Layout::compile(definitions(), name, Dialect::Ros2);
            assert!(layout.is_ok(), "{name}: {layout:?}");
            count += 1;
        }
        assert!(count > 80, "{count}");
    }
}
