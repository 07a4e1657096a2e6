//! Subscriptions that begin once a topic has a publisher. If only the arrival of messages matters, the type is
//! that of the publisher and need not be known to this program.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use futures::StreamExt as _;
use metaplan::message::Message;
use ros2_client::CreateResult;
use ros2_client::MessageTypeName;
use ros2_client::dds::Subscription;
use smol::Timer;

use crate::node::graph::Graph;
use crate::node::{Node, Severity, client_name, creation_error, qos};
use crate::types::MessageType;

const SEARCH_PERIOD: Duration = Duration::from_millis(100);

#[derive(Debug, Clone, Default)]
pub(crate) struct Arrivals {
    last: Arc<Mutex<Option<Instant>>>,
}

impl Arrivals {
    pub(crate) fn is_after(&self, since: Instant) -> bool {
        self.last.lock().unwrap_or_else(PoisonError::into_inner).is_some_and(|last| last >= since)
    }
}

impl Node {
    /// Waits until at least `count` subscribers of a topic are matched with a publisher of this program, at most for
    /// `within`. Returns their number.
    pub(crate) async fn await_subscribers(&self, name: &str, count: usize, within: Duration) -> usize {
        let topic = format!("rt{}", self.resolve(name));
        let enough = |graph: &Graph| (graph.matched_readers(&topic) >= count).then_some(());
        self.graph.wait(within, enough).await;
        self.graph.matched_readers(&topic)
    }

    pub(crate) fn arrivals(self: &Arc<Self>, name: &str) -> Result<Arrivals, Message> {
        let arrivals = Arrivals::default();
        let last = Arc::clone(&arrivals.last);
        self.subscribe_any(name, move || {
            *last.lock().unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
        })?;
        Ok(arrivals)
    }

    /// Subscribes to a topic with the type of a publisher, once there is one, and calls `arrived`
    /// for each message. The content of the messages is not read.
    pub(crate) fn subscribe_any(
        self: &Arc<Self>,
        name: &str,
        mut arrived: impl FnMut() + Send + 'static,
    ) -> Result<(), Message> {
        let full = self.resolve(name);
        let topic_name = client_name(&full)?;
        let weak = Arc::downgrade(self);
        self.spawn(async move {
            let kind = loop {
                let Some(node) = weak.upgrade() else { return };
                if let Some(writer) = node.graph.writer(&format!("rt{full}")) {
                    break writer.type_name;
                }
                drop(node);
                Timer::after(SEARCH_PERIOD).await;
            };
            let Some(node) = weak.upgrade() else { return };
            let Some((package, message)) = message_type(&kind) else {
                node.log(
                    Severity::Warn,
                    &format!("{full} has the type {kind}, which is not a message type of ROS 2"),
                );
                return;
            };
            let subscription = match node.raw_subscription(&topic_name, package, message) {
                Ok(subscription) => subscription,
                Err(error) => {
                    node.log(Severity::Error, &creation_error(&full, &error).message);
                    return;
                }
            };
            drop(node);
            let mut samples = Box::pin(subscription.async_stream());
            while let Some(sample) = samples.next().await {
                if sample.is_ok() {
                    arrived();
                } else {
                    // A repeated error must not consume all of the processor time.
                    Timer::after(Duration::from_millis(1)).await;
                }
            }
        });
        Ok(())
    }
}

impl Node {
    fn raw_subscription(
        &self,
        topic: &ros2_client::Name,
        package: &str,
        message: &str,
    ) -> CreateResult<Subscription<()>> {
        let profile = qos::sensor_data();
        let mut inner = self.inner();
        let topic = inner.create_topic(topic, MessageTypeName::new(package, message), &profile)?;
        inner.create_subscription(&topic, Some(profile))
    }

    /// Subscribes to a topic once it has a publisher; see [`Node::subscribe_raw`]. If this
    /// publisher is latched (reliable, and keeps samples for late subscribers), samples are
    /// received reliably, beginning with the last one. Otherwise, only new samples are received,
    /// with best effort. A failed subscription is logged.
    pub(crate) fn subscribe_when_published(
        self: &Arc<Self>,
        name: &str,
        kind: &Arc<MessageType>,
        take: impl FnMut(Vec<u8>, SystemTime) + Send + 'static,
    ) -> Result<(), Message> {
        let full = self.resolve(name);
        client_name(&full)?;
        let weak = Arc::downgrade(self);
        let (name, kind) = (name.to_owned(), Arc::clone(kind));
        self.spawn(async move {
            loop {
                let Some(node) = weak.upgrade() else { return };
                if let Some(writer) = node.graph.writer(&format!("rt{full}")) {
                    let profile = if writer.is_latched { qos::latched(1) } else { qos::sensor_data() };
                    if let Err(error) = node.subscribe_raw(&name, &kind, profile, take) {
                        node.log(Severity::Error, &error.message);
                    }
                    return;
                }
                drop(node);
                Timer::after(SEARCH_PERIOD).await;
            }
        });
        Ok(())
    }
}

/// Returns package and name of a message type from its DDS name, such as `std_msgs::msg::dds_::Bool_`.
/// Returns `None` for other types.
fn message_type(dds: &str) -> Option<(&str, &str)> {
    let (package, name) = dds.split_once("::msg::dds_::")?;
    Some((package, name.strip_suffix('_')?))
}

#[cfg(test)]
mod tests {
    use super::message_type;

    #[test]
    fn types_of_messages_are_recognised() {
        assert_eq!(message_type("sensor_msgs::msg::dds_::LaserScan_"), Some(("sensor_msgs", "LaserScan")));
        assert_eq!(message_type("std_srvs::srv::dds_::Trigger_Request_"), None);
        assert_eq!(message_type("Square"), None);
    }
}
