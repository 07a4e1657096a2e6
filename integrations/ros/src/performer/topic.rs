//! Performer of an action of the environment, which ends when a `std_msgs/Bool` on a topic is true.

use std::sync::{Arc, Mutex, PoisonError};

use metaplan::message::Message;

use crate::interfaces::std_msgs::msg::Bool;
use crate::node::{Node, depth};
use crate::perform::{Call, End, Perform, Running};

#[derive(Debug)]
pub(super) struct Awaited {
    waiting: Arc<Mutex<Vec<smol::channel::Sender<()>>>>,
}

impl Awaited {
    pub(super) fn new(node: &Arc<Node>, topic: &str) -> Result<Self, Message> {
        let waiting = Arc::new(Mutex::new(Vec::<smol::channel::Sender<()>>::new()));
        let listeners = Arc::clone(&waiting);
        // A volatile subscription matches both transient-local and volatile publishers.
        node.subscribe::<Bool>(topic, depth(10), move |message| {
            if message.data {
                for listener in listeners.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
                    let _ = listener.try_send(());
                }
            }
        })?;
        Ok(Self { waiting })
    }
}

impl Perform for Awaited {
    fn start(&self, _: Call) -> Running {
        let (running, performance) = Running::pair();
        let (sender, receiver) = smol::channel::bounded(1);
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner).push(sender);
        smol::spawn(async move {
            let end = {
                let received = async {
                    match receiver.recv().await {
                        Ok(()) => End::Succeeded,
                        Err(_) => End::Failed("the topic is no longer received".to_owned()),
                    }
                };
                let canceled = async {
                    performance.canceled().await;
                    End::Canceled
                };
                smol::future::or(received, canceled).await
            };
            performance.end(end);
        })
        .detach();
        running
    }
}
