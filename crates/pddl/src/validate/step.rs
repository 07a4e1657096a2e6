//! Resolves the steps of a plan to instances of action schemas, with their conditions and effects at a given time.

use diagnostics::nearest;
use num_rational::BigRational;

use crate::ast::{Action, ActionBody, Condition, ConditionTime, Effect, EffectTime, Name, Term};

use super::evaluate::{Binding, Bindings};
use super::plan::PlanStep;
use super::verdict::{Violation, ViolationKind};
use super::world::{Symbol, World};

#[derive(Debug, Clone)]
pub(super) struct Step<'p> {
    /// Number of the step in the plan's text, from 1.
    pub(super) number: usize,
    pub(super) text: &'p PlanStep,
    /// Possible instances: several if schemas share a name and the arguments fit several of them.
    pub(super) instances: Vec<Instance<'p>>,
}

#[derive(Debug, Clone)]
pub(super) struct Instance<'p> {
    pub(super) action: &'p Action,
    pub(super) bindings: Bindings<'p>,
}

impl Step<'_> {
    pub(super) fn show(&self) -> String {
        let words: Vec<_> =
            std::iter::once(&self.text.action).chain(&self.text.arguments).map(Name::as_str).collect();
        format!("({})", words.join(" "))
    }

    pub(super) fn violation(
        &self,
        time: &BigRational,
        kind: ViolationKind,
        message: impl Into<String>,
    ) -> Box<Violation> {
        Box::new(Violation {
            step: Some(self.number),
            action: Some(self.show()),
            time: time.clone(),
            kind,
            message: message.into(),
            unmet: Vec::new(),
        })
    }
}

/// Finds all schemas that fit the name and the objects of a step. A schema whose condition at start
/// requires two different objects to be equal is omitted, unless this holds for all of them.
/// `instances` is empty if no schema fits.
pub(super) fn resolve<'p>(world: &World<'p>, number: usize, text: &'p PlanStep) -> Step<'p> {
    let objects: Option<Vec<Symbol>> = text.arguments.iter().map(|name| world.object(name)).collect();
    let schemas = world.domain.actions.iter().filter(|action| action.identifier.name == text.action);
    let mut instances: Vec<Instance<'p>> =
        schemas.filter_map(|action| instantiate(world, action, objects.as_deref()?)).collect();
    if instances.iter().any(|instance| !requires_other_objects(world, instance)) {
        instances.retain(|instance| !requires_other_objects(world, instance));
    }
    Step { number, text, instances }
}

/// Returns `true` if a conjunct of the condition at start is an equality between different objects.
fn requires_other_objects(world: &World<'_>, instance: &Instance<'_>) -> bool {
    let object = |term: &Term| match term {
        Term::Variable(identifier) => instance.bindings.get(&identifier.name),
        Term::Constant(identifier) => world.object(&identifier.name),
    };
    let mut conjuncts: Vec<&Condition> = conditions(instance, ConditionTime::AtStart).collect();
    while let Some(condition) = conjuncts.pop() {
        match condition {
            Condition::And(parts) => conjuncts.extend(parts),
            Condition::Equal(left, right, _) if object(left) != object(right) => return true,
            _ => {}
        }
    }
    false
}

/// Returns all readings of a plan: each chooses one instance for every ambiguous step. Empty if there is only
/// one reading or if there are more than `limit`. Readings are created one by one, because each is a copy of the plan.
#[expect(clippy::arithmetic_side_effects, reason = "each step has a way at least")]
pub(super) fn readings<'s, 'p>(
    steps: &'s [Step<'p>],
    limit: usize,
) -> impl Iterator<Item = Vec<Step<'p>>> + use<'s, 'p> {
    let choice_count = |step: &Step<'p>| step.instances.len().max(1);
    let count = steps.iter().try_fold(1_usize, |count, step| count.checked_mul(choice_count(step)));
    let count = count.filter(|count| (2..=limit).contains(count)).unwrap_or(0);
    let reading = move |mut number: usize| {
        let chosen = steps.iter().map(|step| {
            // The number of the reading is a mixed-radix number with one digit per step.
            let choice = number % choice_count(step);
            number /= choice_count(step);
            let instances = step.instances.get(choice).cloned().into_iter().collect();
            Step { number: step.number, text: step.text, instances }
        });
        chosen.collect::<Vec<_>>()
    };
    (0..count).map(reading)
}

fn instantiate<'p>(world: &World<'p>, action: &'p Action, objects: &[Symbol]) -> Option<Instance<'p>> {
    let fits = action.parameters.len() == objects.len()
        && action.parameters.iter().zip(objects).all(|(entry, object)| world.is_a(*object, &entry.r#type));
    let bind = |(entry, object): (&'p crate::ast::TypedName, &Symbol)| Binding {
        variable: &entry.identifier.name,
        r#type: &entry.r#type,
        object: Some(*object),
    };
    let bindings = Bindings(action.parameters.iter().zip(objects).map(bind).collect());
    // `zip` would hide a wrong number of objects, which `fits` excludes.
    fits.then_some(Instance { action, bindings })
}

/// Conditions that an action has at the given time. A precondition counts as a condition at start.
pub(super) fn conditions<'p>(
    instance: &Instance<'p>,
    when: ConditionTime,
) -> impl Iterator<Item = &'p Condition> + use<'p> {
    let (single, several) = match &instance.action.body {
        ActionBody::Instantaneous { precondition, .. } => {
            ((when == ConditionTime::AtStart).then_some(precondition), [].as_slice())
        }
        ActionBody::Durative { conditions, .. } => (None, conditions.as_slice()),
    };
    let several = several.iter().filter(move |(time, _)| *time == when).map(|(_, condition)| condition);
    single.into_iter().chain(several)
}

pub(super) fn effects<'p>(
    instance: &Instance<'p>,
    when: EffectTime,
) -> impl Iterator<Item = &'p Effect> + use<'p> {
    let (single, several) = match &instance.action.body {
        ActionBody::Instantaneous { effect, .. } => {
            ((when == EffectTime::AtStart).then_some(effect), [].as_slice())
        }
        ActionBody::Durative { effects, .. } => (None, effects.as_slice()),
    };
    let several = several.iter().filter(move |(time, _)| *time == when).map(|(_, effect)| effect);
    single.into_iter().chain(several)
}

pub(super) fn unresolved(world: &World<'_>, step: &Step<'_>, time: &BigRational) -> Box<Violation> {
    let name = &step.text.action;
    let mut same_name = world.domain.actions.iter().filter(|action| action.identifier.name == *name);
    let Some(action) = same_name.next() else {
        let names = world.domain.actions.iter().map(|action| action.identifier.name.as_str());
        let proposal = nearest(name.as_str(), names).map(|name| format!(", did you mean `{name}`?"));
        let message = format!("unknown action `{name}`{}", proposal.unwrap_or_default());
        return step.violation(time, ViolationKind::UnknownAction, message);
    };
    if let Some(unknown) = step.text.arguments.iter().find(|name| world.object(name).is_none()) {
        return step.violation(time, ViolationKind::UnknownObject, format!("unknown object `{unknown}`"));
    }
    let (expected, actual) = (action.parameters.len(), step.text.arguments.len());
    if same_name.next().is_none() && expected != actual {
        let message = format!("`{name}` takes {expected} arguments, found {actual}");
        return step.violation(time, ViolationKind::Arguments, message);
    }
    let message = format!("the types of these objects are not those of the parameters of `{name}`");
    step.violation(time, ViolationKind::Arguments, message)
}
