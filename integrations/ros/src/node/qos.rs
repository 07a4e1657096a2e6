//! Quality-of-service profiles of the ROS 2 interfaces.

use ros2_client::qos::{Durability, History, QosProfile, WhenFull};

/// Reliable and volatile with a history of `depth` samples, as in `rclcpp`.
pub fn depth(depth: usize) -> QosProfile {
    QosProfile::default().reliability_reliable(WhenFull::DEFAULT).history(History::KeepLast { depth })
}

/// Reliable and volatile with unlimited history.
pub fn keep_all() -> QosProfile {
    QosProfile::default().reliability_reliable(WhenFull::DEFAULT).history(History::KeepAll)
}

/// Reliable and transient local: late subscribers receive the last samples.
pub fn latched(depth: usize) -> QosProfile {
    self::depth(depth).durability(Durability::TransientLocal)
}

/// Best effort and volatile: receives new samples of every publisher.
pub(crate) fn sensor_data() -> QosProfile {
    QosProfile::default().reliability_best_effort().history(History::KeepLast { depth: 5 })
}

pub(crate) fn service() -> QosProfile {
    depth(10)
}
