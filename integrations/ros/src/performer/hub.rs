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

/// Queue depth in PlanSys2.
pub(super) const DEPTH: usize = 100;

/// Period of the requests for a performer.
const AGAIN: Duration = Duration::from_secs(1);

/// Timeout of the search for a performer.
const PATIENCE: Duration = Duration::from_secs(30);

/// The topic and its listeners.
pub(super) struct Hub {
    name: String,
    publisher: Publisher<ActionExecution>,
    listeners: Arc<Mutex<Vec<Sender<ActionExecution>>>>,
}

impl Hub {
    pub(super) fn new(node: &Arc<Node>) -> Result<Arc<Self>, Message> {
        let listeners = Arc::new(Mutex::new(Vec::<Sender<ActionExecution>>::new()));
        let heard = Arc::clone(&listeners);
        node.subscribe::<ActionExecution>("actions_hub", depth(DEPTH), move |message| {
            let mut listeners = heard.lock().unwrap_or_else(PoisonError::into_inner);
            // Listeners that were dropped are removed.
            listeners.retain(|listener| listener.try_send(message.clone()).is_ok());
        })?;
        let publisher = node.publisher("actions_hub", depth(DEPTH))?;
        let full = node.full_name();
        let name = full.rsplit('/').next().unwrap_or(&full).to_owned();
        Ok(Arc::new(Self { name, publisher, listeners }))
    }

    /// Name of this participant in messages.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn say(&self, message: ActionExecution) {
        self.publisher.publish(message);
    }

    /// Returns a receiver of all future messages.
    pub(super) fn listen(&self) -> Receiver<ActionExecution> {
        let (sender, receiver) = channel::unbounded();
        self.listeners.lock().unwrap_or_else(PoisonError::into_inner).push(sender);
        receiver
    }
}

/// Request of an action, from the view of the executor.
#[derive(Debug)]
struct Asking {
    executor: String,
    action: String,
    arguments: Vec<String>,
    performer: Option<String>,
}

/// Reaction to a message.
#[derive(Debug, PartialEq)]
enum Heard {
    Nothing,
    Reply(ActionExecution),
    Progress(Progress),
    End(End),
}

impl Asking {
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

    fn hear(&mut self, message: &ActionExecution) -> Heard {
        if message.action != self.action || message.arguments != self.arguments {
            return Heard::Nothing;
        }
        let sender = &message.node_id;
        let is_ours = self.performer.as_ref() == Some(sender);
        match message.r#type {
            ActionExecution::RESPONSE if self.performer.is_none() || is_ours => {
                self.performer = Some(sender.clone());
                Heard::Reply(self.message(ActionExecution::CONFIRM, sender))
            }
            ActionExecution::RESPONSE => Heard::Reply(self.message(ActionExecution::REJECT, sender)),
            ActionExecution::FEEDBACK if is_ours => {
                Heard::Progress(feedback(Some(message.completion), message.status.clone()))
            }
            ActionExecution::FINISH if is_ours && message.success => Heard::End(End::Succeeded),
            ActionExecution::FINISH if is_ours => {
                Heard::End(End::Failed(format!("{sender} has failed: {}", message.status)))
            }
            _ => Heard::Nothing,
        }
    }
}

impl Perform for Arc<Hub> {
    fn start(&self, call: Call) -> Running {
        let (running, performance) = Running::pair();
        let (hub, heard) = (Arc::clone(self), self.listen());
        let asking = Asking {
            executor: self.name.clone(),
            action: call.action,
            arguments: call.arguments,
            performer: None,
        };
        smol::spawn(async move {
            let end = ask(&hub, asking, &heard, &performance).await;
            performance.end(end);
        })
        .detach();
        running
    }
}

async fn ask(
    hub: &Hub,
    mut asking: Asking,
    heard: &Receiver<ActionExecution>,
    performance: &Performance,
) -> End {
    /// The next event.
    enum Next {
        Heard(Option<ActionExecution>),
        Canceled,
        Time,
    }
    let begun = Instant::now();
    hub.say(asking.request());
    let mut last_request = Instant::now();
    loop {
        let hears = async { Next::Heard(heard.recv().await.ok()) };
        let canceled = async {
            performance.canceled().await;
            Next::Canceled
        };
        let time = async {
            smol::Timer::after(AGAIN.saturating_sub(last_request.elapsed())).await;
            Next::Time
        };
        match smol::future::or(hears, smol::future::or(canceled, time)).await {
            Next::Heard(None) => return End::Failed("actions_hub is heard no more".to_owned()),
            Next::Heard(Some(message)) => match asking.hear(&message) {
                Heard::Nothing => {}
                Heard::Reply(reply) => hub.say(reply),
                Heard::Progress(progress) => performance.tell(progress),
                Heard::End(end) => return end,
            },
            Next::Canceled => {
                let performer = asking.performer.clone().unwrap_or_default();
                hub.say(asking.message(ActionExecution::CANCEL, &performer));
                return End::Canceled;
            }
            Next::Time => {
                last_request = Instant::now();
                if asking.performer.is_none() {
                    if begun.elapsed() > PATIENCE {
                        let seconds = PATIENCE.as_secs();
                        let text = format!("no performer of PlanSys2 has answered for {seconds} s");
                        return End::Failed(text);
                    }
                    hub.say(asking.request());
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asking() -> Asking {
        Asking {
            executor: "metaplan".to_owned(),
            action: "move".to_owned(),
            arguments: vec!["r".to_owned(), "a".to_owned()],
            performer: None,
        }
    }

    fn said(r#type: i16, node_id: &str) -> ActionExecution {
        asking().message(r#type, node_id)
    }

    #[test]
    fn the_first_responder_is_confirmed_and_others_are_rejected() {
        let mut asking = asking();
        assert_eq!(asking.hear(&said(ActionExecution::FINISH, "one")), Heard::Nothing);
        let confirmed = Heard::Reply(said(ActionExecution::CONFIRM, "one"));
        assert_eq!(asking.hear(&said(ActionExecution::RESPONSE, "one")), confirmed);
        let rejected = Heard::Reply(said(ActionExecution::REJECT, "two"));
        assert_eq!(asking.hear(&said(ActionExecution::RESPONSE, "two")), rejected);
        // A lost confirmation is repeated.
        assert_eq!(asking.hear(&said(ActionExecution::RESPONSE, "one")), confirmed);
        let told = ActionExecution {
            completion: 0.5,
            status: "half".to_owned(),
            ..said(ActionExecution::FEEDBACK, "one")
        };
        let other = ActionExecution { node_id: "two".to_owned(), ..told.clone() };
        assert_eq!(asking.hear(&told), Heard::Progress(feedback(Some(0.5), "half")));
        assert_eq!(asking.hear(&other), Heard::Nothing);
        let failed = ActionExecution { status: "stuck".to_owned(), ..said(ActionExecution::FINISH, "one") };
        assert_eq!(asking.hear(&failed), Heard::End(End::Failed("one has failed: stuck".to_owned())));
        let done = ActionExecution { success: true, ..failed };
        assert_eq!(asking.hear(&done), Heard::End(End::Succeeded));
    }

    #[test]
    fn messages_about_other_actions_are_ignored() {
        let mut asking = asking();
        let response = said(ActionExecution::RESPONSE, "one");
        let arguments = ActionExecution { arguments: vec!["r".to_owned()], ..response.clone() };
        let action = ActionExecution { action: "stay".to_owned(), ..response };
        for message in [arguments, action, said(ActionExecution::REQUEST, "executor")] {
            assert_eq!(asking.hear(&message), Heard::Nothing);
        }
    }
}
