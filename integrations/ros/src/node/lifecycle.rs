//! Managed node (ROS 2 design article "Managed nodes"): primary states, and the services for
//! transitions between them.

use std::fmt;
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
    /// The node is not configured and does not perform its role.
    Unconfigured,
    /// The node is configured. The planner performs its role in this state too.
    Inactive,
    /// The node is configured and performs its role.
    Active,
    /// The node is shutting down.
    Finalized,
}

/// Primary state that a client requests of a lifecycle node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum PrimaryState {
    Unconfigured,
    Inactive,
    Active,
}

impl PrimaryState {
    /// Converts the answer of `get_state`. Returns `None` in a transition, and for a finalized node.
    pub(crate) fn of(state: &State) -> Option<Self> {
        match state.id {
            State::PRIMARY_STATE_UNCONFIGURED => Some(Self::Unconfigured),
            State::PRIMARY_STATE_INACTIVE => Some(Self::Inactive),
            State::PRIMARY_STATE_ACTIVE => Some(Self::Active),
            _ => None,
        }
    }

    /// Returns the next transition on the way to another state, or `None` if the state is reached. Active and
    /// unconfigured nodes pass through the inactive state.
    pub(crate) fn toward(self, target: Self) -> Option<Transition> {
        let (id, label) = match (self, target) {
            (Self::Unconfigured, Self::Inactive | Self::Active) => {
                (Transition::TRANSITION_CONFIGURE, "configure")
            }
            (Self::Inactive, Self::Active) => (Transition::TRANSITION_ACTIVATE, "activate"),
            (Self::Active, Self::Inactive | Self::Unconfigured) => {
                (Transition::TRANSITION_DEACTIVATE, "deactivate")
            }
            (Self::Inactive, Self::Unconfigured) => (Transition::TRANSITION_CLEANUP, "cleanup"),
            _ => return None,
        };
        Some(Transition { id, label: label.to_owned() })
    }
}

impl fmt::Display for PrimaryState {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Unconfigured => "unconfigured",
            Self::Inactive => "inactive",
            Self::Active => "active",
        })
    }
}

struct PhaseChange {
    id: u8,
    label: &'static str,
    from: Phase,
    to: Phase,
    /// Id and label of the transition state.
    via: (u8, &'static str),
}

const PHASE_CHANGES: [PhaseChange; 7] = [
    phase_change(
        Transition::TRANSITION_CONFIGURE,
        "configure",
        Phase::Unconfigured,
        Phase::Inactive,
        10,
        "configuring",
    ),
    phase_change(
        Transition::TRANSITION_CLEANUP,
        "cleanup",
        Phase::Inactive,
        Phase::Unconfigured,
        11,
        "cleaningup",
    ),
    phase_change(
        Transition::TRANSITION_ACTIVATE,
        "activate",
        Phase::Inactive,
        Phase::Active,
        13,
        "activating",
    ),
    phase_change(
        Transition::TRANSITION_DEACTIVATE,
        "deactivate",
        Phase::Active,
        Phase::Inactive,
        14,
        "deactivating",
    ),
    phase_change(
        Transition::TRANSITION_UNCONFIGURED_SHUTDOWN,
        "shutdown",
        Phase::Unconfigured,
        Phase::Finalized,
        12,
        "shuttingdown",
    ),
    phase_change(
        Transition::TRANSITION_INACTIVE_SHUTDOWN,
        "shutdown",
        Phase::Inactive,
        Phase::Finalized,
        12,
        "shuttingdown",
    ),
    phase_change(
        Transition::TRANSITION_ACTIVE_SHUTDOWN,
        "shutdown",
        Phase::Active,
        Phase::Finalized,
        12,
        "shuttingdown",
    ),
];

const fn phase_change(
    id: u8,
    label: &'static str,
    from: Phase,
    to: Phase,
    via: u8,
    name: &'static str,
) -> PhaseChange {
    PhaseChange { id, label, from, to, via: (via, name) }
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

impl PhaseChange {
    fn transition(&self) -> Transition {
        Transition { id: self.id, label: self.label.to_owned() }
    }

    fn via(&self) -> State {
        State { id: self.via.0, label: self.via.1.to_owned() }
    }
}

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
    /// A weak reference, because the node holds its services, which hold this lifecycle.
    node: Weak<Node>,
    phase: Mutex<Phase>,
    events: Events,
    /// Performs a transition to the given state. Returns `false` on failure; the node then keeps its state.
    change: Box<dyn Fn(Phase) -> bool + Send + Sync>,
}

impl fmt::Debug for Lifecycle {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Lifecycle").field(&self.phase()).finish()
    }
}

impl Lifecycle {
    /// Serves the lifecycle of a node that starts in the active state. Returns a flag that is set
    /// while the node is active.
    pub(crate) fn activated(node: &Arc<Node>) -> Result<Arc<AtomicBool>, Message> {
        let active = Arc::new(AtomicBool::new(true));
        let flag = Arc::clone(&active);
        let lifecycle = Self::serve(node, move |phase| {
            flag.store(phase == Phase::Active, Ordering::Relaxed);
            true
        })?;
        lifecycle.go(Phase::Inactive);
        lifecycle.go(Phase::Active);
        Ok(active)
    }

    /// Serves the lifecycle of a node that starts unconfigured. `change` is called in each transition with
    /// the target state. If it returns `false`, the node keeps its state.
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
            answer.send(ChangeStateResponse { success: lifecycle.change_state(&request.transition) });
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
            for phase_change in &PHASE_CHANGES {
                // Several transitions share a transition state.
                if !available_states.contains(&phase_change.via()) {
                    available_states.push(phase_change.via());
                }
            }
            answer.send(GetAvailableStatesResponse { available_states });
        })?;
        let lifecycle = Arc::clone(&served);
        node.serve::<GetAvailableTransitions>("~/get_available_transitions", move |_, answer| {
            let phase = lifecycle.phase();
            answer.send(described(|phase_change| phase_change.from == phase));
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
        PHASE_CHANGES
            .iter()
            .find(|phase_change| phase_change.from == from && phase_change.to == to)
            .is_some_and(|phase_change| self.perform(phase_change))
    }

    fn change_state(&self, requested: &Transition) -> bool {
        let from = self.phase();
        // A label is used only if the id is 0. In rclcpp_lifecycle, by contrast, a label takes precedence over
        // the id. The label `shutdown` has a different id in each state.
        let is_requested = |phase_change: &&PhaseChange| {
            phase_change.from == from
                && if requested.id == 0 {
                    phase_change.label == requested.label
                } else {
                    phase_change.id == requested.id
                }
        };
        let Some(phase_change) = PHASE_CHANGES.iter().find(is_requested) else {
            let text =
                format!("no transition {} ({}) from {}", requested.id, requested.label, from.state().label);
            if let Some(node) = self.node.upgrade() {
                node.log(Severity::Warn, &text);
            }
            return false;
        };
        self.perform(phase_change)
    }

    fn perform(&self, phase_change: &PhaseChange) -> bool {
        self.publish(phase_change, phase_change.from.state(), phase_change.via());
        let success = (self.change)(phase_change.to);
        let end = if success { phase_change.to } else { phase_change.from };
        *self.phase.lock().unwrap_or_else(PoisonError::into_inner) = end;
        self.publish(phase_change, phase_change.via(), end.state());
        success
    }

    fn publish(&self, phase_change: &PhaseChange, start_state: State, goal_state: State) {
        let (stamp, transition) = (now(), phase_change.transition());
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

fn described(is_selected: impl Fn(&&PhaseChange) -> bool) -> GetAvailableTransitionsResponse {
    let describe = |phase_change: &PhaseChange| TransitionDescription {
        transition: phase_change.transition(),
        start_state: phase_change.from.state(),
        goal_state: phase_change.to.state(),
    };
    GetAvailableTransitionsResponse {
        available_transitions: PHASE_CHANGES.iter().filter(is_selected).map(describe).collect(),
    }
}
