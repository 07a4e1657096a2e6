//! Topic `actions_hub` of PlanSys2, by which its executor and its performers communicate. This client
//! takes the role of the executor, so that a performer of PlanSys2 executes an action of the plan.
//!
//! | type | from | meaning |
//! |---|---|---|
//! | REQUEST | executor | request for a performer, repeated every second |
//! | RESPONSE | performer | offer to perform the action |
//! | CONFIRM, REJECT | executor | confirmation to the first performer, rejection to all others |
//! | FEEDBACK | performer | completed share |
//! | FINISH | performer | end of the action, with or without success |
//! | CANCEL | executor | cancellation, without a reply |

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use metaplan::message::Message;
use smol::channel::{self, Receiver, Sender};

use crate::interfaces::plansys2_msgs::msg::ActionExecution;
use crate::node::{Node, Publisher, depth};
use crate::perform::{Call, End, Perform, Performance, Progress, Running};
use crate::performer::feedback;

/// Queue depth of the topic, as in PlanSys2.
pub(super) const QUEUE_DEPTH: usize = 100;

const REQUEST_PERIOD: Duration = Duration::from_secs(1);

const SEARCH_TIMEOUT: Duration = Duration::from_secs(30);

pub(super) struct Hub {
    name: String,
    publisher: Publisher<ActionExecution>,
    listeners: Arc<Mutex<Vec<Sender<ActionExecution>>>>,
}

impl Hub {
    pub(super) fn new(node: &Arc<Node>) -> Result<Arc<Self>, Message> {
        let listeners = Arc::new(Mutex::new(Vec::<Sender<ActionExecution>>::new()));
        let registered = Arc::clone(&listeners);
        node.subscribe::<ActionExecution>("actions_hub", depth(QUEUE_DEPTH), move |message| {
            let mut listeners = registered.lock().unwrap_or_else(PoisonError::into_inner);
            // Listeners that were dropped are removed.
            listeners.retain(|listener| listener.try_send(message.clone()).is_ok());
        })?;
        let publisher = node.publisher("actions_hub", depth(QUEUE_DEPTH))?;
        let full = node.full_name();
        let name = full.rsplit('/').next().unwrap_or(&full).to_owned();
        Ok(Arc::new(Self { name, publisher, listeners }))
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn send(&self, message: ActionExecution) {
        self.publisher.publish(message);
    }

    pub(super) fn listen(&self) -> Receiver<ActionExecution> {
        let (sender, receiver) = channel::unbounded();
        self.listeners.lock().unwrap_or_else(PoisonError::into_inner).push(sender);
        receiver
    }
}

/// The executor's side of the messages about one action. `performer` is the performer that was confirmed, if there is
/// one.
#[derive(Debug)]
struct Negotiation {
    executor: String,
    action: String,
    arguments: Vec<String>,
    performer: Option<String>,
}

#[derive(Debug, PartialEq)]
enum Reaction {
    Nothing,
    Reply(ActionExecution),
    Progress(Progress),
    End(End),
}

impl Negotiation {
    fn message(&self, r#type: i16, node_id: &str) -> ActionExecution {
        ActionExecution {
            r#type,
            node_id: node_id.to_owned(),
            action: self.action.clone(),
            arguments: self.arguments.clone(),
            ..ActionExecution::default()
        }
    }

    fn request(&self) -> ActionExecution {
        self.message(ActionExecution::REQUEST, &self.executor)
    }

    fn react(&mut self, message: &ActionExecution) -> Reaction {
        if message.action != self.action || message.arguments != self.arguments {
            return Reaction::Nothing;
        }
        let sender = &message.node_id;
        let is_ours = self.performer.as_ref() == Some(sender);
        match message.r#type {
            // A repeated response of the chosen performer means that the confirmation was lost.
            ActionExecution::RESPONSE if self.performer.is_none() || is_ours => {
                self.performer = Some(sender.clone());
                Reaction::Reply(self.message(ActionExecution::CONFIRM, sender))
            }
            ActionExecution::RESPONSE => Reaction::Reply(self.message(ActionExecution::REJECT, sender)),
            ActionExecution::FEEDBACK if is_ours => {
                Reaction::Progress(feedback(Some(message.completion), message.status.clone()))
            }
            ActionExecution::FINISH if is_ours && message.success => Reaction::End(End::Succeeded),
            ActionExecution::FINISH if is_ours => {
                Reaction::End(End::Failed(format!("{sender} has failed: {}", message.status)))
            }
            _ => Reaction::Nothing,
        }
    }
}

impl Perform for Arc<Hub> {
    fn start(&self, call: Call) -> Running {
        let (running, performance) = Running::pair();
        let (hub, messages) = (Arc::clone(self), self.listen());
        let negotiation = Negotiation {
            executor: self.name.clone(),
            action: call.action,
            arguments: call.arguments,
            performer: None,
        };
        smol::spawn(async move {
            let end = negotiate(&hub, negotiation, &messages, &performance).await;
            performance.end(end);
        })
        .detach();
        running
    }
}

async fn negotiate(
    hub: &Hub,
    mut negotiation: Negotiation,
    messages: &Receiver<ActionExecution>,
    performance: &Performance,
) -> End {
    enum Next {
        Message(Option<ActionExecution>),
        Canceled,
        Time,
    }
    let start = Instant::now();
    hub.send(negotiation.request());
    let mut last_request = Instant::now();
    loop {
        let received = async { Next::Message(messages.recv().await.ok()) };
        let canceled = async {
            performance.canceled().await;
            Next::Canceled
        };
        let time = async {
            smol::Timer::after(REQUEST_PERIOD.saturating_sub(last_request.elapsed())).await;
            Next::Time
        };
        match smol::future::or(received, smol::future::or(canceled, time)).await {
            Next::Message(None) => return End::Failed("actions_hub is no longer received".to_owned()),
            Next::Message(Some(message)) => match negotiation.react(&message) {
                Reaction::Nothing => {}
                Reaction::Reply(reply) => hub.send(reply),
                Reaction::Progress(progress) => performance.forward(progress),
                Reaction::End(end) => return end,
            },
            Next::Canceled => {
                let performer = negotiation.performer.clone().unwrap_or_default();
                hub.send(negotiation.message(ActionExecution::CANCEL, &performer));
                return End::Canceled;
            }
            // Requests are repeated, because a performer that starts later has not received the
            // earlier ones.
            Next::Time => {
                last_request = Instant::now();
                if negotiation.performer.is_none() {
                    if start.elapsed() > SEARCH_TIMEOUT {
                        let seconds = SEARCH_TIMEOUT.as_secs();
                        let text = format!("no performer of PlanSys2 has answered for {seconds} s");
                        return End::Failed(text);
                    }
                    hub.send(negotiation.request());
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn negotiation() -> Negotiation {
        Negotiation {
            executor: "metaplan".to_owned(),
            action: "move".to_owned(),
            arguments: vec!["r".to_owned(), "a".to_owned()],
            performer: None,
        }
    }

    fn message_from(r#type: i16, node_id: &str) -> ActionExecution {
        negotiation().message(r#type, node_id)
    }

    #[test]
    fn the_first_responder_is_confirmed_and_others_are_rejected() {
        let mut negotiation = negotiation();
        assert_eq!(negotiation.react(&message_from(ActionExecution::FINISH, "one")), Reaction::Nothing);
        let confirmed = Reaction::Reply(message_from(ActionExecution::CONFIRM, "one"));
        assert_eq!(negotiation.react(&message_from(ActionExecution::RESPONSE, "one")), confirmed);
        let rejected = Reaction::Reply(message_from(ActionExecution::REJECT, "two"));
        assert_eq!(negotiation.react(&message_from(ActionExecution::RESPONSE, "two")), rejected);
        // A lost confirmation is repeated.
        assert_eq!(negotiation.react(&message_from(ActionExecution::RESPONSE, "one")), confirmed);
        let progress = ActionExecution {
            completion: 0.5,
            status: "half".to_owned(),
            ..message_from(ActionExecution::FEEDBACK, "one")
        };
        let from_other = ActionExecution { node_id: "two".to_owned(), ..progress.clone() };
        assert_eq!(negotiation.react(&progress), Reaction::Progress(feedback(Some(0.5), "half")));
        assert_eq!(negotiation.react(&from_other), Reaction::Nothing);
        let failed =
            ActionExecution { status: "stuck".to_owned(), ..message_from(ActionExecution::FINISH, "one") };
        assert_eq!(
            negotiation.react(&failed),
            Reaction::End(End::Failed("one has failed: stuck".to_owned()))
        );
        let done = ActionExecution { success: true, ..failed };
        assert_eq!(negotiation.react(&done), Reaction::End(End::Succeeded));
    }

    #[test]
    fn messages_about_other_actions_are_ignored() {
        let mut negotiation = negotiation();
        let response = message_from(ActionExecution::RESPONSE, "one");
        let arguments = ActionExecution { arguments: vec!["r".to_owned()], ..response.clone() };
        let action = ActionExecution { action: "stay".to_owned(), ..response };
        for message in [arguments, action, message_from(ActionExecution::REQUEST, "executor")] {
            assert_eq!(negotiation.react(&message), Reaction::Nothing);
        }
    }
}
