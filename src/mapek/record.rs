//! Serialisation of the loop: decisions for the journal, and snapshots of the beliefs.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use pddl::ast::{Atom, Identifier, InitialElement, Name, Span, Term};
use serde_json::{Map, Value, json};

use crate::knowledge::{Knowledge, Part, Statement, Statements, Waiting};
use crate::mapek::analyze::available;
use crate::mapek::answer::{Command, Effect};
use crate::mapek::beliefs::{Beliefs, Retry, Running, Wait};
use crate::mapek::filter::FilterStates;
use crate::mapek::receipts::Receipts;
use crate::mapek::sequence::Numbers;
use crate::mapek::step::{PlannedStep, configuration_from_record};
use crate::message::Message;

/// Answers of one reaction or deliberation, with the plans computed for them, as stored in the journal.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// Answers, as JSON objects of the loop's output.
    pub answers: Vec<Value>,
    /// Plans computed for the answers, in a form for replay.
    pub plans: Vec<Value>,
}

impl Decision {
    /// Returns `true` if the answers equal `written`, the recorded answers, apart from explanations. Explanations are
    /// not compared because the choice among several correct ones depends on events before the snapshot.
    pub fn agrees(&self, written: &[Value]) -> bool {
        let essence = |answers: &[Value]| answers.iter().cloned().map(essence).collect::<Vec<_>>();
        essence(&self.answers) == essence(written)
    }
}

fn essence(mut answer: Value) -> Value {
    let kind = answer["answer"].as_str().unwrap_or_default().to_owned();
    let mut strip = |list: &str, field: &str| {
        let objects = answer.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten();
        for object in objects.filter_map(Value::as_object_mut) {
            object.remove(field);
        }
    };
    match kind.as_str() {
        "inferred" => {
            strip("designs", "because");
            strip("objectives", "because");
        }
        "contradicted" => strip("contradictions", "facts"),
        // In the loop of `run --configure`, the reasons for a design are explanations, too.
        "reconfigure" | "unserved" => {
            if let Some(object) = answer.as_object_mut() {
                object.remove("because");
            }
        }
        _ => {}
    }
    answer
}

/// State of a loop as JSON, from which the loop can be restored.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot(pub Value);

pub(super) fn snapshot(beliefs: &Beliefs) -> Snapshot {
    let mut fields = fields(beliefs);
    let facts = beliefs.mission.problem().init.iter().filter_map(element_to_record);
    fields.insert("init".to_owned(), facts.collect());
    Snapshot(Value::Object(fields))
}

/// Returns the fields of the snapshot except the pending deliberation and the facts (`init`), which can be large.
pub(super) fn fields(beliefs: &Beliefs) -> Map<String, Value> {
    let statements = beliefs.mission.knowledge().map(Knowledge::statements).unwrap_or_default();
    let steps = |steps: &VecDeque<PlannedStep>| steps.iter().map(PlannedStep::to_record).collect::<Vec<_>>();
    let running = beliefs.running.as_ref().map(|running| {
        json!([
            running.action,
            running.step.to_record(),
            running.progress.to_string(),
            running.cancelling,
            running.suspended,
            running.provisional,
            running.request,
            microseconds(running.last_report),
            running.overdue,
            running.progressed,
            running.started,
            running.resumed,
            running.sent_configuration,
            running
                .applied
                .iter()
                .map(|(function, change)| json!([function, change.to_string()]))
                .collect::<Vec<_>>(),
        ])
    });
    let fields = json!({
        "goal": beliefs.goal,
        "added": statements.added.iter().map(statement_to_record).collect::<Vec<_>>(),
        "removed": statements.removed.iter().map(statement_to_record).collect::<Vec<_>>(),
        "available": beliefs.available,
        "statuses": beliefs.statuses,
        "violated": beliefs.violated,
        "waiting": beliefs.mission.knowledge().map(|base| base.waiting().to_record()),
        "configuration": beliefs.configuration,
        "plan": beliefs.plan.as_ref().map(steps),
        "running": running,
        "reached": beliefs.reached,
        "stuck": beliefs.stuck,
        "unproved": beliefs.unproved,
        "retry": beliefs.retry.map(|entry| json!([microseconds(entry.at), entry.attempt])),
        "failures": beliefs.failures.as_ref().map(|(step, count)| json!([step.to_record(), count])),
        "hopes": beliefs.improvement_causes,
        "hoped": microseconds(beliefs.improvement_since),
        "actions": beliefs.actions,
        "effects": beliefs.effects,
        "outstanding": beliefs.outstanding.values().map(effect_to_record).collect::<Vec<_>>(),
        "receipts": beliefs.receipts.to_record(),
        "waits": beliefs.waits.iter().map(|(number, entry)| json!([number, microseconds(entry.since), entry.repeats])).collect::<Vec<_>>(),
        "reports_actions": beliefs.reports_actions,
        "lines": beliefs.lines,
        "has_times": beliefs.has_times,
        "numbers": beliefs.numbers.to_record(),
        "now": microseconds(beliefs.now),
        "considered": microseconds(beliefs.considered),
        "filters": beliefs.filters.to_record(),
    });
    match fields {
        Value::Object(fields) => fields,
        _ => Map::new(),
    }
}

pub(super) fn restore(beliefs: &mut Beliefs, snapshot: &Snapshot) -> Result<(), Message> {
    let wrong = |what: &str| Message::error("M320", format!("the snapshot does not fit the mission: {what}"));
    restore_mission(beliefs, &snapshot.0).ok_or_else(|| wrong("facts or statements"))?;
    restore_work(beliefs, &snapshot.0).ok_or_else(|| wrong("plan or effects"))?;
    if let Some(base) = beliefs.mission.knowledge()
        && available(base) != beliefs.available
    {
        return Err(wrong("other designs are available"));
    }
    Ok(())
}

fn restore_mission(beliefs: &mut Beliefs, data: &Value) -> Option<()> {
    let records = |name: &str| data.get(name).and_then(Value::as_array);
    let statements =
        |name: &str| records(name)?.iter().map(statement_from_record).collect::<Option<Vec<_>>>();
    let statements = Statements { added: statements("added")?, removed: statements("removed")? };
    if let Some(base) = beliefs.mission.knowledge_mut() {
        base.restore(&statements).ok()?;
        base.set_waiting(Waiting::from_record(data.get("waiting").unwrap_or(&Value::Null))?);
        beliefs.fault = base.fault().cloned();
    }
    let timed = beliefs.mission.problem().init.iter().filter(|e| matches!(e, InitialElement::Timed(..)));
    let mut init: Vec<InitialElement> = timed.cloned().collect();
    init.extend(records("init")?.iter().map(element_from_record).collect::<Option<Vec<_>>>()?);
    beliefs.mission.set_init(init);
    beliefs.goal = data.get("goal")?.as_str().map(ToOwned::to_owned);
    if let Some(goal) = &beliefs.goal {
        let goal = beliefs.mission.goal(goal).ok()?;
        beliefs.mission.set_goal(goal);
    }
    Some(())
}

fn restore_work(beliefs: &mut Beliefs, data: &Value) -> Option<()> {
    let number = |name: &str| data.get(name).and_then(Value::as_u64);
    let truth = |name: &str| data.get(name).and_then(Value::as_bool);
    let text = |value: &Value| value.as_str().map(ToOwned::to_owned);
    let texts = |value: &Value| value.as_array()?.iter().map(text).collect::<Option<Vec<_>>>();
    let pairs = |name: &str| data.get(name).and_then(Value::as_object);
    beliefs.available = texts(data.get("available")?)?.into_iter().collect();
    let status = |(name, value): (&String, &Value)| Some((name.clone(), texts(value)?));
    beliefs.statuses = pairs("statuses")?.iter().map(status).collect::<Option<BTreeMap<_, _>>>()?;
    beliefs.violated = texts(data.get("violated")?)?.into_iter().collect();
    let pair = |(name, value): (&String, &Value)| Some((name.clone(), text(value)?));
    beliefs.configuration = pairs("configuration")?.iter().map(pair).collect::<Option<BTreeMap<_, _>>>()?;
    beliefs.plan = match data.get("plan")? {
        Value::Null => None,
        steps => Some(steps.as_array()?.iter().map(PlannedStep::from_record).collect::<Option<_>>()?),
    };
    beliefs.running = match data.get("running")? {
        Value::Null => None,
        record => Some(running_from_record(record)?),
    };
    beliefs.failures = match data.get("failures")? {
        Value::Null => None,
        record => Some((PlannedStep::from_record(record.get(0)?)?, record.get(1)?.as_u64()? as u32)),
    };
    (beliefs.reached, beliefs.stuck) = (truth("reached")?, truth("stuck")?);
    beliefs.unproved = truth("unproved")?;
    beliefs.retry = match data.get("retry")? {
        Value::Null => None,
        record => Some(Retry {
            at: Duration::from_micros(record.get(0)?.as_u64()?),
            attempt: u32::try_from(record.get(1)?.as_u64()?).ok()?,
        }),
    };
    beliefs.improvement_causes = texts(data.get("hopes")?)?.into_iter().collect();
    beliefs.improvement_since = Duration::from_micros(number("hoped")?);
    (beliefs.actions, beliefs.effects, beliefs.lines) =
        (number("actions")?, number("effects")?, number("lines")?);
    beliefs.has_times = truth("has_times").unwrap_or_default();
    beliefs.numbers = Numbers::from_record(data.get("numbers")?)?;
    beliefs.now = Duration::from_micros(number("now")?);
    beliefs.considered = Duration::from_micros(number("considered")?);
    beliefs.filters = FilterStates::from_record(data.get("filters")?)?;
    beliefs.receipts = Receipts::from_record(data.get("receipts")?)?;
    let wait = |record: &Value| {
        let (since, repeats) = (record.get(1)?.as_u64()?, record.get(2)?.as_u64()?);
        let wait = Wait { since: Duration::from_micros(since), repeats: u32::try_from(repeats).ok()? };
        Some((record.get(0)?.as_u64()?, wait))
    };
    beliefs.waits = data.get("waits")?.as_array()?.iter().map(wait).collect::<Option<_>>()?;
    beliefs.reports_actions = truth("reports_actions")?;
    let effects = data.get("outstanding")?.as_array()?.iter().map(effect_from_record);
    beliefs.outstanding =
        effects.collect::<Option<Vec<_>>>()?.into_iter().map(|effect| (effect.number, effect)).collect();
    Some(())
}

fn microseconds(time: Duration) -> u64 {
    u64::try_from(time.as_micros()).unwrap_or(u64::MAX)
}

fn running_from_record(record: &Value) -> Option<Running> {
    let applied =
        |entry: &Value| Some((entry.get(0)?.as_str()?.to_owned(), entry.get(1)?.as_str()?.parse().ok()?));
    Some(Running {
        action: record.get(0)?.as_u64()?,
        step: PlannedStep::from_record(record.get(1)?)?,
        progress: record.get(2)?.as_str()?.parse().ok()?,
        cancelling: record.get(3)?.as_bool()?,
        suspended: record.get(4)?.as_bool()?,
        provisional: record.get(5)?.as_bool()?,
        request: record.get(6)?.as_u64()?,
        last_report: Duration::from_micros(record.get(7)?.as_u64()?),
        overdue: u32::try_from(record.get(8)?.as_u64()?).ok()?,
        progressed: record.get(9)?.as_bool()?,
        started: record.get(10)?.as_bool()?,
        resumed: record.get(11)?.as_bool()?,
        sent_configuration: configuration_from_record(record.get(12)?)?,
        applied: record.get(13)?.as_array()?.iter().map(applied).collect::<Option<_>>()?,
    })
}

fn effect_to_record(effect: &Effect) -> Value {
    let command = match &effect.command {
        Command::Reconfigure { function, from, to } => json!(["reconfigure", function, from, to]),
        Command::Request { step } => json!(["request", step.to_record()]),
        Command::Cancel { because } => json!(["cancel", because]),
        Command::Suspend { because } => json!(["suspend", because]),
        Command::Resume { configuration } => json!(["resume", configuration]),
    };
    json!([effect.number, effect.action, command, effect.supersedes])
}

fn effect_from_record(record: &Value) -> Option<Effect> {
    let text = |value: &Value| value.as_str().map(ToOwned::to_owned);
    let command = record.get(2)?;
    let command = match command.get(0)?.as_str()? {
        "reconfigure" => Command::Reconfigure {
            function: text(command.get(1)?)?,
            from: text(command.get(2)?),
            to: text(command.get(3)?)?,
        },
        "request" => Command::Request { step: PlannedStep::from_record(command.get(1)?)? },
        "cancel" => Command::Cancel { because: text(command.get(1)?)? },
        "suspend" => Command::Suspend { because: text(command.get(1)?)? },
        "resume" => Command::Resume { configuration: configuration_from_record(command.get(1)?)? },
        _ => return None,
    };
    let (number, action) = (record.get(0)?.as_u64()?, record.get(1)?.as_u64()?);
    let supersedes = record.get(3)?.as_array()?.iter().map(Value::as_u64).collect::<Option<_>>()?;
    Some(Effect { number, action, command, repeated: false, supersedes })
}

pub(crate) fn statement_to_record(statement: &Statement) -> Value {
    let part = |part: &Part| match part {
        Part::Name(name) => json!(name),
        Part::Literal(lexical, datatype) => json!([lexical, datatype]),
    };
    json!([statement.predicate, statement.arguments.iter().map(part).collect::<Vec<_>>()])
}

pub(crate) fn statement_from_record(record: &Value) -> Option<Statement> {
    let text = |value: &Value| value.as_str().map(ToOwned::to_owned);
    let part = |part: &Value| match part {
        Value::Array(pair) => Some(Part::Literal(text(pair.first()?)?, text(pair.get(1)?)?)),
        name => Some(Part::Name(text(name)?)),
    };
    let arguments = record.get(1)?.as_array()?.iter().map(part).collect::<Option<_>>()?;
    Some(Statement { predicate: text(record.get(0)?)?, arguments })
}

/// Serialises an element of `:init`. Returns `None` for timed initial literals, which never change.
pub(super) fn element_to_record(element: &InitialElement) -> Option<Value> {
    let words = |atom: &Atom| -> Vec<String> {
        let arguments = atom.arguments.iter().map(Term::name);
        std::iter::once(&atom.predicate.name).chain(arguments).map(ToString::to_string).collect()
    };
    match element {
        InitialElement::Fact(atom) => Some(json!([words(atom), true])),
        InitialElement::NegatedFact(atom) => Some(json!([words(atom), false])),
        InitialElement::Value(atom, value, _) => Some(json!([words(atom), value.to_string()])),
        InitialElement::Timed(..) => None,
    }
}

pub(super) fn element_from_record(record: &Value) -> Option<InitialElement> {
    let identifier =
        |value: &Value| Some(Identifier { name: Name::new(value.as_str()?), span: Span::default() });
    let words = record.get(0)?.as_array()?;
    let (predicate, arguments) = words.split_first()?;
    let arguments = arguments.iter().map(|word| identifier(word).map(Term::Constant));
    let atom = Atom {
        predicate: identifier(predicate)?,
        arguments: arguments.collect::<Option<_>>()?,
        span: Span::default(),
    };
    match record.get(1)? {
        Value::Bool(true) => Some(InitialElement::Fact(atom)),
        Value::Bool(false) => Some(InitialElement::NegatedFact(atom)),
        value => Some(InitialElement::Value(atom, value.as_str()?.parse().ok()?, Span::default())),
    }
}
