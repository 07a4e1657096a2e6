//! Managed node (ROS 2 design article "Managed nodes"): primary states, and the services for
//! transitions between them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};

use metaplan::message::Message;

use crate::interfaces::lifecycle_msgs::msg::{State, Transition, TransitionDescription, TransitionEvent};
use crate::interfaces::lifecycle_msgs::srv::{
    ChangeState, ChangeStateResponse, GetAvailableStates, GetAvailableStatesResponse,
    GetAvailableTransitions, GetAvailableTransitionsResponse, GetState, GetStateResponse,
};
use crate::interfaces::lyrical::lifecycle_msgs::msg as lyrical;
use crate::node::{Node, Publisher, Severity, depth, is_lyrical, now};

/// Primary state of a managed node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// The node has read nothing.
    Unconfigured,
    /// The node has read its mission and is idle.
    Inactive,
    /// The node works.
    Active,
    /// The node is shutting down.
    Finalized,
}

/// Transition between primary states.
struct Way {
    id: u8,
    label: &'static str,
    from: Phase,
    to: Phase,
    /// Transition state.
    via: (u8, &'static str),
}

const WAYS: [Way; 7] = [
    way(
        Transition::TRANSITION_CONFIGURE,
        "configure",
        Phase::Unconfigured,
        Phase::Inactive,
        10,
        "configuring",
    ),
    way(Transition::TRANSITION_CLEANUP, "cleanup", Phase::Inactive, Phase::Unconfigured, 11, "cleaningup"),
    way(Transition::TRANSITION_ACTIVATE, "activate", Phase::Inactive, Phase::Active, 13, "activating"),
    way(Transition::TRANSITION_DEACTIVATE, "deactivate", Phase::Active, Phase::Inactive, 14, "deactivating"),
    way(
        Transition::TRANSITION_UNCONFIGURED_SHUTDOWN,
        "shutdown",
        Phase::Unconfigured,
        Phase::Finalized,
        12,
        "shuttingdown",
    ),
    way(
        Transition::TRANSITION_INACTIVE_SHUTDOWN,
        "shutdown",
        Phase::Inactive,
        Phase::Finalized,
        12,
        "shuttingdown",
    ),
    way(
        Transition::TRANSITION_ACTIVE_SHUTDOWN,
        "shutdown",
        Phase::Active,
        Phase::Finalized,
        12,
        "shuttingdown",
    ),
];

const fn way(id: u8, label: &'static str, from: Phase, to: Phase, via: u8, name: &'static str) -> Way {
    Way { id, label, from, to, via: (via, name) }
}

impl Phase {
    fn state(self) -> State {
        let (id, label) = match self {
            Self::Unconfigured => (State::PRIMARY_STATE_UNCONFIGURED, "unconfigured"),
            Self::Inactive => (State::PRIMARY_STATE_INACTIVE, "inactive"),
            Self::Active => (State::PRIMARY_STATE_ACTIVE, "active"),
            Self::Finalized => (State::PRIMARY_STATE_FINALIZED, "finalized"),
        };
        State { id, label: label.to_owned() }
    }
}

impl Way {
    fn transition(&self) -> Transition {
        Transition { id: self.id, label: self.label.to_owned() }
    }

    fn via(&self) -> State {
        State { id: self.via.0, label: self.via.1.to_owned() }
    }
}

/// Publisher of transitions, in the message type of the distribution.
enum Events {
    /// Message type up to Kilted.
    Nanoseconds(Publisher<TransitionEvent>),
    /// Message type from Lyrical on.
    Stamp(Publisher<lyrical::TransitionEvent>),
}

impl Events {
    fn new(node: &Node, is_lyrical: bool) -> Result<Self, Message> {
        let topic = "~/transition_event";
        Ok(if is_lyrical {
            Self::Stamp(node.publisher(topic, depth(1))?)
        } else {
            Self::Nanoseconds(node.publisher(topic, depth(1))?)
        })
    }
}

/// Lifecycle of a managed node.
pub struct Lifecycle {
    /// A weak reference, because the node holds its services, which hold this.
    node: Weak<Node>,
    phase: Mutex<Phase>,
    events: Events,
    /// Performs a transition. On failure the node keeps its state.
    change: Box<dyn Fn(Phase) -> bool + Send + Sync>,
}

impl std::fmt::Debug for Lifecycle {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("Lifecycle").field(&self.phase()).finish()
    }
}

impl Lifecycle {
    /// Serves the lifecycle of a node that starts in the active state. Returns a flag that is set
    /// while the node is active.
    ///
    /// # Errors
    /// A topic cannot be created.
    pub(crate) fn activated(node: &Arc<Node>) -> Result<Arc<AtomicBool>, Message> {
        let active = Arc::new(AtomicBool::new(true));
        let hear = Arc::clone(&active);
        let lifecycle = Self::serve(node, move |phase| {
            hear.store(phase == Phase::Active, Ordering::Relaxed);
            true
        })?;
        lifecycle.go(Phase::Inactive);
        lifecycle.go(Phase::Active);
        Ok(active)
    }

    /// Serves the lifecycle of a node that starts unconfigured. `change` is called before each
    /// transition with the target state.
    ///
    /// # Errors
    /// A topic cannot be created.
    pub fn serve(
        node: &Arc<Node>,
        change: impl Fn(Phase) -> bool + Send + Sync + 'static,
    ) -> Result<Arc<Self>, Message> {
        let events = Events::new(node, is_lyrical())?;
        let served = Arc::new(Self {
            node: Arc::downgrade(node),
            phase: Mutex::new(Phase::Unconfigured),
            events,
            change: Box::new(change),
        });
        let lifecycle = Arc::clone(&served);
        node.serve::<ChangeState>("~/change_state", move |request, answer| {
            answer.send(ChangeStateResponse { success: lifecycle.take(&request.transition) });
        })?;
        let lifecycle = Arc::clone(&served);
        node.serve::<GetState>("~/get_state", move |_, answer| {
            answer.send(GetStateResponse { current_state: lifecycle.phase().state() });
        })?;
        node.serve::<GetAvailableStates>("~/get_available_states", |_, answer| {
            let phases = [Phase::Unconfigured, Phase::Inactive, Phase::Active, Phase::Finalized];
            let unknown = State { id: State::PRIMARY_STATE_UNKNOWN, label: "unknown".to_owned() };
            let mut available_states = vec![unknown];
            available_states.extend(phases.map(Phase::state));
            for way in &WAYS {
                if !available_states.contains(&way.via()) {
                    available_states.push(way.via());
                }
            }
            answer.send(GetAvailableStatesResponse { available_states });
        })?;
        let lifecycle = Arc::clone(&served);
        node.serve::<GetAvailableTransitions>("~/get_available_transitions", move |_, answer| {
            let phase = lifecycle.phase();
            answer.send(described(|way| way.from == phase));
        })?;
        node.serve::<GetAvailableTransitions>("~/get_transition_graph", |_, answer| {
            answer.send(described(|_| true));
        })?;
        Ok(served)
    }

    /// Returns the current state.
    pub fn phase(&self) -> Phase {
        *self.phase.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Performs a transition to a state. Returns `false` if there is no such transition or if it
    /// fails.
    pub fn go(&self, to: Phase) -> bool {
        let from = self.phase();
        WAYS.iter().find(|way| way.from == from && way.to == to).is_some_and(|way| self.walk(way))
    }

    fn take(&self, wanted: &Transition) -> bool {
        let from = self.phase();
        // As in rcl_lifecycle, a label is used if there is no id, and every id of a shutdown has
        // the label of the current state.
        let is_it = |way: &&Way| {
            way.from == from && if wanted.id == 0 { way.label == wanted.label } else { way.id == wanted.id }
        };
        let Some(way) = WAYS.iter().find(is_it) else {
            let text = format!("no transition {} ({}) from {}", wanted.id, wanted.label, from.state().label);
            if let Some(node) = self.node.upgrade() {
                node.log(Severity::Warn, &text);
            }
            return false;
        };
        self.walk(way)
    }

    fn walk(&self, way: &Way) -> bool {
        self.tell(way, way.from.state(), way.via());
        let success = (self.change)(way.to);
        let end = if success { way.to } else { way.from };
        *self.phase.lock().unwrap_or_else(PoisonError::into_inner) = end;
        self.tell(way, way.via(), end.state());
        success
    }

    fn tell(&self, way: &Way, start_state: State, goal_state: State) {
        let (stamp, transition) = (now(), way.transition());
        match &self.events {
            Events::Nanoseconds(events) => {
                let timestamp =
                    u64::try_from(stamp.sec).unwrap_or_default() * 1_000_000_000 + u64::from(stamp.nanosec);
                events.publish(TransitionEvent { timestamp, transition, start_state, goal_state });
            }
            Events::Stamp(events) => {
                events.publish(lyrical::TransitionEvent { stamp, transition, start_state, goal_state });
            }
        }
    }
}

fn described(wanted: impl Fn(&&Way) -> bool) -> GetAvailableTransitionsResponse {
    let describe = |way: &Way| TransitionDescription {
        transition: way.transition(),
        start_state: way.from.state(),
        goal_state: way.to.state(),
    };
    GetAvailableTransitionsResponse {
        available_transitions: WAYS.iter().filter(wanted).map(describe).collect(),
    }
}
