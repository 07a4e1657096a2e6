//! What differs between a mission as its files have it and in a situation, and why that matters.

use std::collections::{BTreeMap, BTreeSet};

use pddl::ast::{Atom, InitialElement, Name, Term};
use picture::{Change, Plan};

use crate::mission::Mission;
use crate::number::decimal;
use crate::report::designs::because;

/// What a component's or an attribute's state is called where nobody says any.
const UNSAID: &str = "not said";

/// From causes to effects: what is reported, what the task is, which designs that makes available, and what the plan comes to.
pub fn changes(before: (&Mission, &Plan), after: (&Mission, &Plan), costs: [&str; 2]) -> Vec<Change> {
    let mut changes = Vec::new();
    let mut say = |text: String| changes.push(Change { text, because: Vec::new() });
    differences(&components(before.0), &components(after.0), UNSAID).into_iter().for_each(&mut say);
    differences(&measured(before.0), &measured(after.0), UNSAID).into_iter().for_each(&mut say);
    task(before.0, after.0).into_iter().for_each(&mut say);
    changes.extend(designs(before.0, after.0));
    changes
        .extend(plans(before.1, after.1, costs).into_iter().map(|text| Change { text, because: Vec::new() }));
    changes
}

/// `name: old before, new now` for what differs.
fn differences(
    before: &BTreeMap<String, String>,
    after: &BTreeMap<String, String>,
    missing: &str,
) -> Vec<String> {
    let names: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    let of = |all: &BTreeMap<String, String>, name: &String| {
        all.get(name).cloned().unwrap_or_else(|| missing.to_owned())
    };
    let changed = names.into_iter().map(|name| (name, of(before, name), of(after, name)));
    let changed = changed.filter(|(_, old, new)| old != new);
    changed.map(|(name, old, new)| format!("{name}: {old} before, {new} now.")).collect()
}

fn components(mission: &Mission) -> BTreeMap<String, String> {
    let components = mission.knowledge().map(|knowledge| knowledge.view().components()).unwrap_or_default();
    let status = components.into_iter().map(|own| {
        (format!("The status of {}", own.individual.name), own.status.unwrap_or_else(|| UNSAID.to_owned()))
    });
    status.collect()
}

fn measured(mission: &Mission) -> BTreeMap<String, String> {
    let measured = mission.knowledge().map(|knowledge| knowledge.view().measurements()).unwrap_or_default();
    let value = measured.into_iter().filter_map(|own| {
        Some((format!("Measured {} ({})", own.attribute, own.individual.name), decimal(own.value.as_ref()?)))
    });
    value.collect()
}

/// What the problem states otherwise than before.
fn task(before: &Mission, after: &Mission) -> Vec<String> {
    let (old, new) = (stated(before), stated(after));
    let only = |own: &BTreeSet<String>, other: &BTreeSet<String>| {
        own.difference(other).cloned().collect::<Vec<_>>().join(" ")
    };
    let (gone, come) = (only(&old, &new), only(&new, &old));
    match (gone.is_empty(), come.is_empty()) {
        (true, true) => Vec::new(),
        (false, true) => vec![format!("The task: {gone} before, and not now.")],
        (true, false) => vec![format!("The task: {come} now, and not before.")],
        (false, false) => vec![format!("The task: {gone} before, {come} now.")],
    }
}

fn stated(mission: &Mission) -> BTreeSet<String> {
    let text = |element: &InitialElement| match element {
        InitialElement::Fact(atom) => shown(atom),
        InitialElement::NegatedFact(atom) => format!("(not {})", shown(atom)),
        InitialElement::Value(atom, value, _) => format!("(= {} {})", shown(atom), decimal(value)),
        InitialElement::Timed(time, atom, holds, _) => {
            let atom = if *holds { shown(atom) } else { format!("(not {})", shown(atom)) };
            format!("(at {} {atom})", decimal(time))
        }
    };
    mission.problem().init.iter().map(text).collect()
}

fn shown(atom: &Atom) -> String {
    let arguments = atom.arguments.iter().map(|term| match term {
        Term::Constant(own) | Term::Variable(own) => &own.name,
    });
    let words: Vec<&str> = std::iter::once(&atom.predicate.name).chain(arguments).map(Name::as_str).collect();
    format!("({})", words.join(" "))
}

/// The designs that are lost or gained, with the reasons.
fn designs(before: &Mission, after: &Mission) -> Vec<Change> {
    let available = |mission: &Mission| -> BTreeMap<String, bool> {
        let known = mission.knowledge().into_iter().flat_map(|knowledge| knowledge.catalogue().designs());
        known.map(|design| (design.individual.name.clone(), design.available)).collect()
    };
    let (old, new) = (available(before), available(after));
    let changed = new.iter().filter(|(design, now)| old.get(*design) != Some(now));
    let changes = changed.filter_map(|(design, now)| {
        let knowledge = after.knowledge()?;
        let text = if *now { "is available now" } else { "is not available any more" };
        Some(Change { text: format!("{design} {text}"), because: because(knowledge, design, *now) })
    });
    changes.collect()
}

/// How the plans differ.
fn plans(before: &Plan, after: &Plan, [old_cost, new_cost]: [&str; 2]) -> Vec<String> {
    let mut texts = Vec::new();
    if old_cost == new_cost {
        texts.push(format!("The plan costs {new_cost}, as before."));
    } else {
        texts.push(format!("The plan costs {new_cost} now, {old_cost} before."));
    }
    let used = |plan: &Plan| -> BTreeMap<String, BTreeSet<String>> {
        let mut used: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (function, design) in plan.steps.iter().flat_map(|step| &step.configuration) {
            used.entry(function.clone()).or_default().insert(design.clone());
        }
        used
    };
    let words = |used: BTreeMap<String, BTreeSet<String>>| -> BTreeMap<String, String> {
        let join = |designs: BTreeSet<String>| designs.into_iter().collect::<Vec<_>>().join(", ");
        used.into_iter()
            .map(|(function, designs)| (format!("Designs of {function}"), join(designs)))
            .collect()
    };
    texts.extend(differences(&words(used(before)), &words(used(after)), "none"));
    let actions = |plan: &Plan| plan.steps.iter().map(|step| step.label.clone()).collect::<Vec<_>>();
    let (old, new) = (actions(before), actions(after));
    let kept = new.iter().filter(|action| old.contains(action)).count();
    texts.push(format!("{kept} of {} steps do what a step of the {} before did.", new.len(), old.len()));
    texts
}
