//! Units from the comments of common message types, which definitions do not contain.

/// Returns the unit of a field of a type, and of all numbers below it.
pub(crate) fn unit(message: &str, field: &str) -> Option<&'static str> {
    let (package, name) = message.split_once('/')?;
    Some(match (package, name, field) {
        ("geometry_msgs", "Twist", "linear") => "m/s",
        ("geometry_msgs", "Twist", "angular") => "rad/s",
        ("geometry_msgs", "Accel", "linear") => "m/s2",
        ("geometry_msgs", "Accel", "angular") => "rad/s2",
        ("geometry_msgs", "Wrench", "force") => "N",
        ("geometry_msgs", "Wrench", "torque") => "N m",
        ("geometry_msgs", "Pose", "position") => "m",
        ("geometry_msgs", "PointStamped", "point") => "m",
        ("geometry_msgs", "Transform", "translation") => "m",
        ("geometry_msgs", "Quaternion", _) => "1",
        ("geometry_msgs", "Pose2D", "x" | "y") => "m",
        ("geometry_msgs", "Pose2D", "theta") => "rad",
        ("sensor_msgs", "Imu", "angular_velocity") => "rad/s",
        ("sensor_msgs", "Imu", "linear_acceleration") => "m/s2",
        ("sensor_msgs", "FluidPressure", "fluid_pressure") => "Pa",
        ("sensor_msgs", "Range", "field_of_view") => "rad",
        ("sensor_msgs", "Range", "min_range" | "max_range" | "range") => "m",
        ("sensor_msgs", "NavSatFix", "latitude" | "longitude") => "deg",
        ("sensor_msgs", "NavSatFix", "altitude") => "m",
        ("sensor_msgs", "BatteryState", "voltage" | "cell_voltage") => "V",
        ("sensor_msgs", "BatteryState", "current") => "A",
        ("mavros_msgs", "RCOut" | "RCIn" | "OverrideRCIn", "channels") => "us",
        ("mavros_msgs", "VFR_HUD" | "VfrHud", "airspeed" | "groundspeed" | "climb") => "m/s",
        ("mavros_msgs", "VFR_HUD" | "VfrHud", "heading") => "deg",
        ("mavros_msgs", "VFR_HUD" | "VfrHud", "altitude") => "m",
        (
            "mavros_msgs",
            "Altitude",
            "monotonic" | "amsl" | "local" | "relative" | "terrain" | "bottom_clearance",
        ) => "m",
        ("mavros_msgs", "PositionTarget", "position") => "m",
        ("mavros_msgs", "PositionTarget", "velocity") => "m/s",
        ("mavros_msgs", "PositionTarget", "yaw") => "rad",
        ("mavros_msgs", "PositionTarget", "yaw_rate") => "rad/s",
        ("mavros_msgs", "ESCStatusItem", "rpm") => "rpm",
        ("mavros_msgs", "ESCStatusItem", "voltage") => "V",
        ("mavros_msgs", "ESCStatusItem", "current") => "A",
        ("marine_acoustic_msgs", "Dvl", "velocity" | "speed_gnd" | "beam_velocity") => "m/s",
        ("marine_acoustic_msgs", "Dvl", "sound_speed") => "m/s",
        ("marine_acoustic_msgs", "Dvl", "altitude" | "range") => "m",
        ("marine_acoustic_msgs", "Dvl", "course_gnd") => "rad",
        ("dvl_msgs" | "waterlinked_a50_ros_driver", "DVL", "velocity") => "m/s",
        ("dvl_msgs" | "waterlinked_a50_ros_driver", "DVL", "altitude") => "m",
        ("dvl_msgs" | "waterlinked_a50_ros_driver", "DVLBeam", "velocity") => "m/s",
        ("dvl_msgs" | "waterlinked_a50_ros_driver", "DVLBeam", "distance") => "m",
        ("dvl_msgs", "DVLDR", "position") => "m",
        ("dvl_msgs", "DVLDR", "roll" | "pitch" | "yaw") => "deg",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use crate::Unit;

    #[test]
    fn every_unit_is_known() {
        let (table, _) = include_str!("units.rs").split_once("_ =>").unwrap();
        let units: Vec<&str> = table
            .lines()
            .filter_map(|line| line.split("=> \"").nth(1)?.split('"').next())
            .collect();
        assert!(units.len() > 30);
        assert!(units.iter().all(|unit| Unit::find(unit).is_some()), "{units:?}");
    }
}
