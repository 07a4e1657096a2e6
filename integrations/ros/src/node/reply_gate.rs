//! Delays requests to a service until the client can receive the reply.
//!
//! A server discovers the request writer and the reply reader of a client separately. A reply that
//! is written before the reply reader is matched is lost, and the client waits forever.
//! `rmw_send_response` of `rmw_fastrtps` and `rmw_cyclonedds` therefore waits up to 100 ms for the
//! reader. Here, the requests wait instead, each for at most 100 ms, so that a server never blocks.

use std::collections::{BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use ros2_client::Gid;
use ros2_client::request_id::RmwRequestId;
use smol::Timer;

use crate::node::graph::{Graph, Topics};

/// Upper limit on the time that a request waits for the reply reader of its client, as in the
/// middlewares of ROS 2.
const TIMEOUT: Duration = Duration::from_millis(100);

const RECHECK: Duration = Duration::from_millis(1);

/// Upper limit on the number of clients in [`ReplyGate::admitted`]. All clients are removed when
/// the limit is reached.
const MAX_CLIENTS: usize = 4096;

#[derive(Debug)]
pub(crate) struct ReplyGate<T> {
    topics: Topics,
    waiting: VecDeque<Waiting<T>>,
    /// Clients of which a request has already left the queue. Their further requests pass at once.
    admitted: BTreeSet<Gid>,
}

#[derive(Debug)]
struct Waiting<T> {
    since: Instant,
    id: RmwRequestId,
    request: T,
}

impl<T> ReplyGate<T> {
    pub(crate) fn new(service: &str) -> Self {
        Self { topics: Topics::of(service), waiting: VecDeque::new(), admitted: BTreeSet::new() }
    }

    pub(crate) fn push(&mut self, id: RmwRequestId, request: T) {
        self.waiting.push_back(Waiting { since: Instant::now(), id, request });
    }

    /// Removes and returns the first request whose client can receive the reply, or which has
    /// waited for [`TIMEOUT`]. The requests of one client keep their order.
    pub(crate) fn pop(&mut self, graph: &Graph) -> Option<(RmwRequestId, T)> {
        self.pop_if(|topics, client| graph.can_reply(topics, client))
    }

    fn pop_if(&mut self, can_reply: impl Fn(&Topics, Gid) -> bool) -> Option<(RmwRequestId, T)> {
        let mut blocked = BTreeSet::new();
        let index = self.waiting.iter().position(|waiting| {
            let client = waiting.id.writer_gid;
            let passes = !blocked.contains(&client)
                && (self.admitted.contains(&client)
                    || waiting.since.elapsed() >= TIMEOUT
                    || can_reply(&self.topics, client));
            if !passes {
                blocked.insert(client);
            }
            passes
        })?;
        let Waiting { id, request, .. } = self.waiting.remove(index)?;
        if self.admitted.len() >= MAX_CLIENTS {
            self.admitted.clear();
        }
        self.admitted.insert(id.writer_gid);
        Some((id, request))
    }

    /// Completes when waiting requests should be checked again; never if no request waits.
    pub(crate) fn recheck(&self) -> impl Future<Output = ()> + Send + use<T> {
        let is_empty = self.waiting.is_empty();
        async move {
            if is_empty {
                std::future::pending::<()>().await;
            }
            Timer::after(RECHECK).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{ReplyGate, RmwRequestId, TIMEOUT};

    fn id(client: u8, sequence_number: i64) -> RmwRequestId {
        let gid = serde_json::from_value(serde_json::json!(vec![client; 16])).expect("a GID");
        RmwRequestId { writer_gid: gid, sequence_number }
    }

    #[test]
    fn requests_wait_for_the_reply_reader_of_their_client() {
        let mut gate = ReplyGate::new("/service");
        for (client, number) in [(1, 1), (2, 1), (1, 2)] {
            gate.push(id(client, number), (client, number));
        }
        assert_eq!(
            gate.pop_if(|_, client| client == id(2, 0).writer_gid).map(|(_, request)| request),
            Some((2, 1))
        );
        assert_eq!(gate.pop_if(|_, _| false), None, "client 1 is not matched");
        assert_eq!(gate.pop_if(|_, _| true).map(|(_, request)| request), Some((1, 1)), "in order");
        assert_eq!(gate.pop_if(|_, _| false).map(|(_, request)| request), Some((1, 2)), "an admitted client");
        gate.push(id(3, 1), (3, 1));
        assert_eq!(gate.pop_if(|_, _| false), None);
        std::thread::sleep(TIMEOUT);
        assert_eq!(gate.pop_if(|_, _| false).map(|(_, request)| request), Some((3, 1)), "after the timeout");
    }
}
