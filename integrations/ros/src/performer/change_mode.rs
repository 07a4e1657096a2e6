//! Performer that sets the design of a function by the service `/<function>/change_mode` of
//! `system_modes`.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, PoisonError};

use crate::interfaces::system_modes_msgs::srv::{ChangeMode as Service, ChangeModeRequest};
use crate::node::{Caller, Node};
use crate::perform::{Call, End, Perform, Running};
use crate::performer::action;
use crate::performer::settings::argument;

/// Performer that executes an action by a call of `change_mode`. The fields `function` and `design` are the positions
/// of these values among the arguments of the action, counted from 1. Without a position, the last argument but one is
/// the function, and the last argument is the design.
#[derive(Debug)]
pub(super) struct ChangeMode {
    node: Arc<Node>,
    function: Option<NonZeroUsize>,
    design: Option<NonZeroUsize>,
    /// Clients of the functions that actions have named. A new client for each action could receive no reply: the
    /// server matches it only after some time.
    callers: Mutex<BTreeMap<String, Arc<Caller<Service>>>>,
}

impl ChangeMode {
    pub(super) fn new(
        node: &Arc<Node>,
        function: Option<NonZeroUsize>,
        design: Option<NonZeroUsize>,
    ) -> Self {
        Self { node: Arc::clone(node), function, design, callers: Mutex::default() }
    }

    fn caller(&self, function: &str) -> Arc<Caller<Service>> {
        let mut callers = self.callers.lock().unwrap_or_else(PoisonError::into_inner);
        let new = || Arc::new(self.node.caller::<Service>(&format!("/{function}/change_mode")));
        Arc::clone(callers.entry(function.to_owned()).or_insert_with(new))
    }
}

impl Perform for ChangeMode {
    fn start(&self, call: Call) -> Running {
        let (running, performance) = Running::pair();
        let function = argument(&call.arguments, self.function, 1);
        let design = argument(&call.arguments, self.design, 0);
        match (function, design) {
            (Ok(function), Ok(design)) => {
                let caller = self.caller(function);
                let request = ChangeModeRequest { mode_name: design.to_owned() };
                smol::spawn(async move {
                    let end = match action::call(&caller, request, &performance).await {
                        Ok(answer) if answer.success => End::Succeeded,
                        Ok(_) => End::Failed(format!("{} has refused it", caller.service())),
                        Err(end) => end,
                    };
                    performance.end(end);
                })
                .detach();
            }
            (Err(because), _) | (_, Err(because)) => {
                performance.end(End::Failed(format!("{}: {because}", call.text())));
            }
        }
        running
    }
}
