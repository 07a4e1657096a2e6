//! Helpers for tests with nodes. Consecutive tests use different ROS domains.

use std::sync::Arc;
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::{Duration, Instant};

use metaplan_ros::node::{Network, Node, Opening, Rmw, RosArguments};

/// First ROS domain for tests. Concurrent runs on one machine need different domains.
const FIRST: u16 = 20;

/// Returns the next of the ten ROS domains of this process, in turn.
pub fn domain() -> u16 {
    static USED: AtomicU16 = AtomicU16::new(0);
    let slot = (std::process::id() % 20) as u16 * 10;
    FIRST + slot + USED.fetch_add(1, Ordering::Relaxed) % 10
}

/// Creates a node on the loopback network. `words` are the arguments after `--ros-args`.
pub fn node(domain: u16, name: &str, words: &str) -> Arc<Node> {
    let words = ["p", "--ros-args"].into_iter().chain(words.split_whitespace()).map(str::to_owned);
    let (_, arguments) = RosArguments::split(words).expect("arguments");
    let network = Network { domain, loopback: true };
    let opening = Opening { name: name.to_owned(), arguments, network, rmw: Rmw::Auto };
    Node::open(opening).expect("a node")
}

/// Waits until a condition holds; `what` describes the condition if the time runs out.
pub fn until(what: &str, mut is_so: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !is_so() {
        assert!(begun.elapsed() < Duration::from_secs(20), "{what}: not within 20 s");
        std::thread::sleep(Duration::from_millis(5));
    }
}
