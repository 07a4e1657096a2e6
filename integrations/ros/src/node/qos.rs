//! Qualities of service, as the interfaces of ROS 2 have them.

use ros2_client::qos::{Durability, History, QosProfile, WhenFull};

/// Reliable and volatile, the last ones kept: what `rclcpp` has for a depth.
pub fn depth(depth: usize) -> QosProfile {
    QosProfile::default().reliability_reliable(WhenFull::DEFAULT).history(History::KeepLast { depth })
}

/// Reliable and volatile, nothing dropped.
pub fn keep_all() -> QosProfile {
    QosProfile::default().reliability_reliable(WhenFull::DEFAULT).history(History::KeepAll)
}

/// Reliable, and kept for those who come later.
pub fn latched(depth: usize) -> QosProfile {
    self::depth(depth).durability(Durability::TransientLocal)
}

/// What services have.
pub(crate) fn service() -> QosProfile {
    depth(10)
}
