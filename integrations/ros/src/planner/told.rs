//! Publication of planning results: the cost of a plan or the reason for its absence in the log, and the best plan
//! as JSON on the topic `~/plan`. The JSON contains the designs, for which PlanSys2's plans have no field.

use std::sync::Arc;

use metaplan::message::Errors;

use crate::interfaces::std_msgs::msg::String as Text;
use crate::node::{Node, Publisher, Severity, latched};
use crate::planner::{Found, NoPlan};

#[derive(Debug)]
pub(crate) struct PlanPublisher {
    node: Arc<Node>,
    plans: Publisher<Text>,
}

impl PlanPublisher {
    pub(crate) fn new(node: &Arc<Node>) -> Result<Self, Errors> {
        let plans = node.publisher("~/plan", latched(1))?;
        Ok(Self { node: Arc::clone(node), plans })
    }

    pub(crate) fn publish_result(&self, found: &Result<Found, NoPlan>) {
        match found {
            Ok(found) => {
                let actions = found.plans.first().map_or(0, Vec::len);
                let text =
                    format!("a plan of {actions} actions that costs {}: {}", found.cost, found.verdict);
                self.node.log(Severity::Info, &text);
                self.plans.publish(Text { data: found.to_json().to_string() });
            }
            Err(none) => self.node.log(Severity::Warn, &none.text()),
        }
    }
}
