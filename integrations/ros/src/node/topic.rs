//! Publishers and subscriptions.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use futures::StreamExt as _;
use metaplan::message::Message;
use ros2_client::MessageTypeName;
use ros2_client::message_info::MessageInfo;
use ros2_client::qos::{Durability, QosProfile};
use smol::Timer;

use crate::interfaces::{Msg, Structure};
use crate::node::graph::Expected;
use crate::node::{Node, Severity, client_name, creation_error, dds_type};
use crate::types::{MessageType, Raw};

/// Number of invalid samples of a subscription per log message about them. The first invalid sample is logged.
const INVALID_PER_LOG_MESSAGE: u64 = 1000;

/// Time after the creation of a subscription during which it discards samples that are older than
/// the subscription.
const AGE_CHECK_PERIOD: Duration = Duration::from_secs(5);

/// Upper limit on the time for which a writer keeps samples for a killed reader of this program: the lease of 50 s,
/// and a margin. A sample with a lower stamp is a new one of a writer whose clock is behind.
const MAX_KEPT_TIME: Duration = Duration::from_secs(60);

/// Filter of samples that were published before the subscription existed. A writer keeps the
/// samples that a killed reader has not acknowledged. It sends them to the next reader, even if
/// this reader has not requested old samples.
struct Old {
    since: SystemTime,
    is_wanted: bool,
}

impl Old {
    fn is_old(&self, published: Option<SystemTime>) -> bool {
        let age = published.and_then(|published| self.since.duration_since(published).ok());
        !self.is_wanted && age.is_some_and(|age| !age.is_zero() && age <= MAX_KEPT_TIME)
    }
}

/// Returns the time at which a sample was published, by the clock of its writer, or `None` if the writer does not
/// state it.
fn published(info: &MessageInfo) -> Option<SystemTime> {
    let stamp = info.source_timestamp().and_then(|stamp| u64::try_from(stamp.to_nanos()).ok());
    stamp.map(|nanoseconds| UNIX_EPOCH + Duration::from_nanos(nanoseconds))
}

struct TopicType<'n> {
    package: &'n str,
    name: &'n str,
    hash: Cow<'static, str>,
}

impl<'n> From<&'n MessageType> for TopicType<'n> {
    fn from(kind: &'n MessageType) -> Self {
        Self { package: &kind.package, name: &kind.name, hash: kind.hash.clone().into() }
    }
}

/// Publisher of messages on a topic.
pub struct Publisher<M: Structure> {
    inner: ros2_client::dds::Publisher<M>,
}

impl<M: Structure> std::fmt::Debug for Publisher<M> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("Publisher").field(&M::TYPE).finish()
    }
}

impl<M: Structure> Publisher<M> {
    /// Publishes a message. A message that cannot be written is lost without an error.
    pub fn publish(&self, message: M) {
        // Slow readers lose samples, because the publisher does not wait for them.
        let _ = self.inner.publish(message);
    }
}

impl Node {
    /// Creates a publisher of messages on a topic.
    ///
    /// # Errors
    /// Fails if the name is invalid, or the topic exists with another type.
    pub fn publisher<M: Msg>(&self, name: &str, qos: QosProfile) -> Result<Publisher<M>, Message> {
        self.publisher_as(
            name,
            &TopicType { package: M::PACKAGE, name: M::NAME, hash: M::RIHS01.into() },
            qos,
        )
    }

    pub(crate) fn raw_publisher(
        &self,
        name: &str,
        kind: &MessageType,
        qos: QosProfile,
    ) -> Result<Publisher<Raw>, Message> {
        self.publisher_as(name, &kind.into(), qos)
    }

    fn publisher_as<M: Structure>(
        &self,
        name: &str,
        kind: &TopicType<'_>,
        qos: QosProfile,
    ) -> Result<Publisher<M>, Message> {
        let full = self.resolve(name);
        let topic_name = client_name(&full)?;
        let mut node = self.inner();
        let created = node
            .create_topic(&topic_name, MessageTypeName::new(kind.package, kind.name), &qos)
            .and_then(|topic| node.create_publisher(&topic, Some(qos)));
        drop(node);
        let inner = created.map_err(|error| creation_error(&full, &error))?;
        self.expect_message(&full, kind);
        Ok(Publisher { inner })
    }

    /// Subscribes to a topic for the lifetime of the node. `take` receives each valid message of a writer
    /// with the expected type. Unless `qos` is transient local, messages that arrive in the first five seconds of the
    /// subscription, and were published less than a minute before it by the clock of their writer, are discarded. The
    /// first one is logged.
    ///
    /// # Errors
    /// Fails if the name is invalid, or the topic exists with another type.
    pub fn subscribe<M: Msg>(
        self: &Arc<Self>,
        name: &str,
        qos: QosProfile,
        mut take: impl FnMut(M) + Send + 'static,
    ) -> Result<(), Message> {
        let names = TopicType { package: M::PACKAGE, name: M::NAME, hash: M::RIHS01.into() };
        self.subscribe_as(name, &names, qos, move |message, _| take(message))
    }

    /// Subscribes to a topic of a type that is known at run time, as [`Node::subscribe`] does.
    /// `take` receives the encoded message and the time at which it was published (if unknown, the
    /// time of its arrival).
    pub(crate) fn subscribe_raw(
        self: &Arc<Self>,
        name: &str,
        kind: &MessageType,
        qos: QosProfile,
        mut take: impl FnMut(Vec<u8>, SystemTime) + Send + 'static,
    ) -> Result<(), Message> {
        self.subscribe_as::<Raw>(name, &kind.into(), qos, move |Raw(bytes), published| take(bytes, published))
    }

    fn subscribe_as<M: Structure>(
        self: &Arc<Self>,
        name: &str,
        kind: &TopicType<'_>,
        qos: QosProfile,
        mut take: impl FnMut(M, SystemTime) + Send + 'static,
    ) -> Result<(), Message> {
        let full = self.resolve(name);
        let topic_name = client_name(&full)?;
        let qos_wants_old = qos.durability == Durability::TransientLocal;
        let mut node = self.inner();
        let created = node
            .create_topic(&topic_name, MessageTypeName::new(kind.package, kind.name), &qos)
            .and_then(|topic| node.create_subscription::<M>(&topic, Some(qos)));
        drop(node);
        let subscription = created.map_err(|error| creation_error(&full, &error))?;
        self.expect_message(&full, kind);
        let type_name = format!("{}/msg/{}", kind.package, kind.name);
        let (weak, start) = (Arc::downgrade(self), Instant::now());
        let old = Old { since: SystemTime::now(), is_wanted: qos_wants_old };
        self.spawn(async move {
            let mut samples = Box::pin(subscription.async_stream());
            let (mut invalid_count, mut is_logged) = (0, false);
            while let Some(sample) = samples.next().await {
                let Some(node) = weak.upgrade() else { return };
                match sample {
                    Ok((_, info)) if node.graph.is_unfit(info.publisher_gid()) => {}
                    Ok((_, info)) if start.elapsed() < AGE_CHECK_PERIOD && old.is_old(published(&info)) => {
                        if !std::mem::replace(&mut is_logged, true) {
                            let text = format!(
                                "messages on {full} that were published before this program subscribed are discarded; if they \
                                 are new, the clock of their publisher is behind the clock of this host"
                            );
                            node.log(Severity::Info, &text);
                        }
                    }
                    Ok((message, info)) => take(message, published(&info).unwrap_or_else(SystemTime::now)),
                    Err(error) => {
                        if invalid_count % INVALID_PER_LOG_MESSAGE == 0 {
                            let text = format!("a message on {full} is not a {type_name}: {error}");
                            node.log(Severity::Warn, &text);
                        }
                        invalid_count += 1;
                        drop(node);
                        // A repeated error must not consume all of the processor time.
                        Timer::after(Duration::from_millis(1)).await;
                    }
                }
            }
        });
        Ok(())
    }

    fn expect_message(&self, full: &str, kind: &TopicType<'_>) {
        let type_name = dds_type(kind.package, "msg", kind.name);
        self.graph.expect(format!("rt{full}"), Expected { type_name, hash: kind.hash.clone() });
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, UNIX_EPOCH};

    use super::Old;

    #[test]
    fn samples_are_old_if_a_writer_can_have_kept_them() {
        let hour = Duration::from_secs(3600);
        let old = Old { since: UNIX_EPOCH + hour * 24, is_wanted: false };
        let published = |before: Duration| Some(old.since - before);
        assert!(old.is_old(published(Duration::from_millis(1))));
        assert!(old.is_old(published(Duration::from_secs(50))));
        assert!(!old.is_old(published(hour)), "the clock of the writer is an hour behind");
        assert!(!old.is_old(Some(UNIX_EPOCH)), "the host of the writer has no clock");
        assert!(!old.is_old(published(Duration::ZERO)));
        assert!(!old.is_old(Some(old.since + hour)));
        assert!(!old.is_old(None));
        let latched = Old { is_wanted: true, ..old };
        assert!(!latched.is_old(Some(latched.since - Duration::from_secs(1))));
    }
}
