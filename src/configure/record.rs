//! Serialisation of the configuration loop ([`Keeper`]) for its journal: decisions, and snapshots of the state.

use std::collections::BTreeMap;
use std::time::Duration;

use serde_json::{Value, json};

use crate::configure::keeper::{Keeper, KeeperAnswer, PendingChange, Service};
use crate::knowledge::{Statements, Waiting};
use crate::mapek::{
    Decision, FORMAT, FilterStates, Numbers, Observation, Recoverable, Snapshot, Unrecorded, checksum,
    knowledge_parts, statement_from_record, statement_to_record,
};
use crate::message::Message;

impl Recoverable for Keeper {
    type Answer = KeeperAnswer;

    fn digest(&self) -> String {
        let [facts, rules] = knowledge_parts(self.configurator.knowledge());
        checksum(&[
            env!("CARGO_PKG_VERSION").to_owned(),
            FORMAT.to_owned(),
            format!("{:?}", self.configurator.wishes()),
            format!("{:?}", self.limit),
            format!("{:?}", self.filters),
            facts,
            rules,
        ])
    }

    fn unrecorded(&self) -> Unrecorded {
        self.unrecorded
    }

    fn has_agenda(&self) -> bool {
        !self.has_begun
    }

    fn react(&mut self, observation: &Observation, now: Duration) -> Vec<KeeperAnswer> {
        self.handle_at(observation, now)
    }

    fn deliberate(&mut self) -> Vec<KeeperAnswer> {
        if self.has_begun { Vec::new() } else { self.start() }
    }

    fn handle_again(&mut self, observation: &Observation, now: Duration, _: &[Value]) -> Vec<KeeperAnswer> {
        self.handle_at(observation, now)
    }

    fn deliberate_again(&mut self, _: &[Value]) -> Vec<KeeperAnswer> {
        self.deliberate()
    }

    fn decision(&mut self, answers: &[KeeperAnswer]) -> Decision {
        // Serialisation cannot fail: answers consist of texts, numbers and lists.
        let object = |answer: &KeeperAnswer| serde_json::to_value(answer).unwrap_or_default();
        Decision { answers: answers.iter().map(object).collect(), plans: Vec::new() }
    }

    fn repeat(&self) -> Vec<KeeperAnswer> {
        self.outstanding.values().cloned().map(|change| KeeperAnswer::Service(change.repeated())).collect()
    }

    fn effect(answer: &KeeperAnswer) -> Option<u64> {
        match answer {
            KeeperAnswer::Service(Service::Reconfigure { effect, .. }) => Some(*effect),
            _ => None,
        }
    }

    fn checkpoint(&mut self) -> Snapshot {
        let snapshot = snapshot(self);
        // The explanation that is found depends on the order of past assertions. A restored loop and this loop must
        // find the same explanation. Therefore, the statements are asserted again. This also frees the names of former
        // values.
        if let Some(statements) = statements(&snapshot.0) {
            // An error, such as an exceeded budget, leaves the knowledge base unchanged.
            let _ = self.configurator.knowledge_mut().restore(&statements);
        }
        snapshot
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), Message> {
        restore(self, &snapshot.0)
            .ok_or_else(|| Message::error("M320", "the snapshot does not fit the knowledge base"))
    }
}

fn snapshot(keeper: &Keeper) -> Snapshot {
    let knowledge = keeper.configurator.knowledge();
    let statements = knowledge.statements();
    let changes = keeper.pending_changes.iter().map(|(effect, change)| {
        let PendingChange { objective, from, to } = change;
        json!([effect, objective, from, to])
    });
    Snapshot(json!({
        "added": statements.added.iter().map(statement_to_record).collect::<Vec<_>>(),
        "removed": statements.removed.iter().map(statement_to_record).collect::<Vec<_>>(),
        "waiting": knowledge.waiting().to_record(),
        "pending": keeper.configurator.pending,
        "effects": keeper.effects,
        "changes": changes.collect::<Vec<_>>(),
        "outstanding": keeper.outstanding.values().collect::<Vec<_>>(),
        "available": keeper.available,
        "statuses": keeper.statuses,
        "violated": keeper.violated,
        "unserved": keeper.unserved,
        "lines": keeper.lines,
        "has_times": keeper.has_times,
        "numbers": keeper.numbers.to_record(),
        "now": u64::try_from(keeper.now.as_micros()).unwrap_or(u64::MAX),
        "filters": keeper.states.to_record(),
    }))
}

fn statements(data: &Value) -> Option<Statements> {
    let list = |name: &str| {
        data.get(name)?.as_array()?.iter().map(statement_from_record).collect::<Option<Vec<_>>>()
    };
    Some(Statements { added: list("added")?, removed: list("removed")? })
}

/// Restores the state from a snapshot. Returns `None` if the snapshot is damaged; the state may then be partly
/// restored.
fn restore(keeper: &mut Keeper, data: &Value) -> Option<()> {
    let number = |name: &str| data.get(name).and_then(Value::as_u64);
    let knowledge = keeper.configurator.knowledge_mut();
    knowledge.restore(&statements(data)?).ok()?;
    knowledge.set_waiting(Waiting::from_record(data.get("waiting")?)?);
    keeper.fault = knowledge.fault().cloned();
    keeper.configurator.pending = texts(data.get("pending")?)?;
    keeper.effects = number("effects")?;
    keeper.pending_changes = data.get("changes")?.as_array()?.iter().map(change).collect::<Option<_>>()?;
    let services = data.get("outstanding")?.as_array()?.iter().map(service);
    keeper.outstanding = services.collect::<Option<_>>()?;
    keeper.available = texts(data.get("available")?)?;
    keeper.statuses = lists(data.get("statuses")?)?;
    keeper.violated = texts(data.get("violated")?)?;
    keeper.unserved = lists(data.get("unserved")?)?;
    keeper.lines = number("lines")?;
    keeper.has_times = data.get("has_times").and_then(Value::as_bool).unwrap_or_default();
    keeper.numbers = Numbers::from_record(data.get("numbers")?)?;
    keeper.now = Duration::from_micros(number("now")?);
    keeper.states = FilterStates::from_record(data.get("filters")?)?;
    keeper.has_begun = true;
    Some(())
}

fn text(value: &Value) -> Option<String> {
    value.as_str().map(ToOwned::to_owned)
}

fn texts<T: FromIterator<String>>(value: &Value) -> Option<T> {
    value.as_array()?.iter().map(text).collect()
}

fn lists(value: &Value) -> Option<BTreeMap<String, Vec<String>>> {
    value.as_object()?.iter().map(|(name, list)| Some((name.clone(), texts(list)?))).collect()
}

fn change(record: &Value) -> Option<(u64, PendingChange)> {
    let (objective, from) = (text(record.get(1)?)?, text(record.get(2)?));
    Some((record.get(0)?.as_u64()?, PendingChange { objective, from, to: text(record.get(3)?)? }))
}

fn service(record: &Value) -> Option<(u64, Service)> {
    let field = |name: &str| record.get(name).and_then(text);
    let effect = record.get("effect")?.as_u64()?;
    let service = Service::Reconfigure {
        objective: field("objective")?,
        function: field("function"),
        from: field("from"),
        to: field("to"),
        because: texts(record.get("because")?)?,
        optimal: record.get("optimal")?.as_bool()?,
        effect,
        repeated: false,
    };
    Some((effect, service))
}
