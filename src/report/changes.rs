//! Differences between two situations of a mission (as its files define it, and now). Reasons are given for
//! changes of the availability of designs.

use std::collections::{BTreeMap, BTreeSet};

use pddl::ast::{Atom, InitialElement, Name, Term};
use picture::{Change, Plan};

use crate::mission::Mission;
use crate::number::decimal;
use crate::report::designs::because;

const UNKNOWN: &str = "unknown";

/// The cost of a plan, or the reason why there is no cost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Cost {
    /// The value of the metric, as text.
    Of(String),
    /// The mission is proved to have no plan.
    NoPlan,
    /// No plan was found within the limits.
    NotFound,
}

/// Returns the differences between two situations of a mission and between their plans. The order
/// is from causes to effects: components and measurements, the task, availability of designs, and
/// the plans.
pub fn changes(before: (&Mission, &Plan), after: (&Mission, &Plan), costs: &[Cost; 2]) -> Vec<Change> {
    let mut changes = Vec::new();
    let mut say = |text: String| changes.push(Change { text, because: Vec::new() });
    differences(&components(before.0), &components(after.0), UNKNOWN).into_iter().for_each(&mut say);
    differences(&measured(before.0), &measured(after.0), UNKNOWN).into_iter().for_each(&mut say);
    task(before.0, after.0).into_iter().for_each(&mut say);
    changes.extend(designs(before.0, after.0));
    changes
        .extend(plans(before.1, after.1, costs).into_iter().map(|text| Change { text, because: Vec::new() }));
    changes
}

/// Returns a sentence for each name whose values differ. A name without a value has the value
/// `missing`.
fn differences(
    before: &BTreeMap<String, String>,
    after: &BTreeMap<String, String>,
    missing: &str,
) -> Vec<String> {
    let names: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    let value_of = |values: &BTreeMap<String, String>, name: &String| {
        values.get(name).cloned().unwrap_or_else(|| missing.to_owned())
    };
    let changed = names.into_iter().map(|name| (name, value_of(before, name), value_of(after, name)));
    let changed = changed.filter(|(_, old, new)| old != new);
    changed.map(|(name, old, new)| format!("{name}: {old} before, {new} now.")).collect()
}

fn components(mission: &Mission) -> BTreeMap<String, String> {
    let components = mission.knowledge().map(|knowledge| knowledge.view().components()).unwrap_or_default();
    let status = components.into_iter().map(|component| {
        (
            format!("The status of {}", component.individual.name),
            component.status.unwrap_or_else(|| UNKNOWN.to_owned()),
        )
    });
    status.collect()
}

fn measured(mission: &Mission) -> BTreeMap<String, String> {
    let measured = mission.knowledge().map(|knowledge| knowledge.view().measurements()).unwrap_or_default();
    let value = measured.into_iter().filter_map(|measurement| {
        Some((
            format!("Measured {} ({})", measurement.attribute, measurement.individual.name),
            decimal(measurement.value.as_ref()?),
        ))
    });
    value.collect()
}

fn task(before: &Mission, after: &Mission) -> Vec<String> {
    let (old, new) = (stated(before), stated(after));
    let only = |facts: &BTreeSet<String>, other_facts: &BTreeSet<String>| {
        facts.difference(other_facts).cloned().collect::<Vec<_>>().join(" ")
    };
    let (removed, added) = (only(&old, &new), only(&new, &old));
    match (removed.is_empty(), added.is_empty()) {
        (true, true) => Vec::new(),
        (false, true) => vec![format!("The task: {removed} before, and not now.")],
        (true, false) => vec![format!("The task: {added} now, and not before.")],
        (false, false) => vec![format!("The task: {removed} before, {added} now.")],
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
    let arguments = atom.arguments.iter().map(Term::name);
    let words: Vec<&str> = std::iter::once(&atom.predicate.name).chain(arguments).map(Name::as_str).collect();
    format!("({})", words.join(" "))
}

fn designs(before: &Mission, after: &Mission) -> Vec<Change> {
    let available = |mission: &Mission| -> BTreeMap<String, bool> {
        let (knowledge, problem) = (mission.knowledge(), mission.current());
        let designs = knowledge.into_iter().flat_map(|knowledge| knowledge.catalogue().designs());
        designs
            .map(|design| (design.individual.name.clone(), mission.is_available(&problem, design)))
            .collect()
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

fn plans(before: &Plan, after: &Plan, costs: &[Cost; 2]) -> Vec<String> {
    let text = match costs {
        [Cost::Of(old), Cost::Of(new)] => return cost_and_design_differences(before, after, [old, new]),
        [Cost::Of(old), Cost::NoPlan] => format!("There is no plan now. The plan before costs {old}."),
        [Cost::Of(old), Cost::NotFound] => format!("No plan was found now. The plan before costs {old}."),
        [Cost::NoPlan, Cost::Of(new)] => format!("The plan costs {new} now. Before, there was no plan."),
        [Cost::NotFound, Cost::Of(new)] => format!("The plan costs {new} now. Before, no plan was found."),
        [Cost::NoPlan, Cost::NoPlan] => "There is no plan now, and there was none before.".to_owned(),
        [_, Cost::NoPlan] => "There is no plan now, and none was found before.".to_owned(),
        [Cost::NoPlan, _] => "No plan was found now, and there was none before.".to_owned(),
        [Cost::NotFound, Cost::NotFound] => "No plan was found, now or before.".to_owned(),
    };
    vec![text]
}

fn cost_and_design_differences(before: &Plan, after: &Plan, [old_cost, new_cost]: [&str; 2]) -> Vec<String> {
    let mut texts = Vec::new();
    if old_cost == new_cost {
        texts.push(format!("The plan costs {new_cost}, as before."));
    } else {
        texts.push(format!("The plan costs {new_cost} now, {old_cost} before."));
    }
    let used = |plan: &Plan| -> BTreeMap<String, String> {
        let mut used: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (function, design) in plan.steps.iter().flat_map(|step| &step.configuration) {
            used.entry(function.clone()).or_default().insert(design.clone());
        }
        let join = |designs: BTreeSet<String>| designs.into_iter().collect::<Vec<_>>().join(", ");
        used.into_iter()
            .map(|(function, designs)| (format!("Designs of {function}"), join(designs)))
            .collect()
    };
    texts.extend(differences(&used(before), &used(after), "none"));
    texts.push(shared(before, after));
    texts
}

/// Returns a sentence about the number of actions that both plans contain. An action that occurs several
/// times is counted as often as it occurs in both plans. Designs are ignored.
fn shared(before: &Plan, after: &Plan) -> String {
    let mut old: Vec<&str> = before.steps.iter().map(|step| step.label.as_str()).collect();
    let in_both = after.steps.iter().filter(|step| {
        let position = old.iter().position(|label| *label == step.label);
        // Each action of the old plan is matched at most once.
        position.map(|position| old.swap_remove(position)).is_some()
    });
    let (shared, new, old) = (in_both.count(), after.steps.len(), before.steps.len());
    let plural = |count: usize| if count == 1 { "1 action".to_owned() } else { format!("{count} actions") };
    if new == 0 {
        return format!("The plan has no actions now; it had {} before.", plural(old));
    }
    let are = if shared == 1 || new == 1 { "is" } else { "are" };
    format!("{shared} of {} {are} also in the plan before, which has {}.", plural(new), plural(old))
}

#[cfg(test)]
mod tests {
    use picture::{Plan, Step};

    use super::{Cost, plans};

    fn plan(labels: &[&str]) -> Plan {
        let steps = labels.iter().map(|label| Step { label: (*label).to_owned(), ..Step::default() });
        Plan { steps: steps.collect(), ..Plan::default() }
    }

    fn check(before: &[&str], after: &[&str], costs: &[Cost; 2], expected: &[&str]) {
        assert_eq!(plans(&plan(before), &plan(after), costs), expected, "{before:?} {after:?}");
    }

    #[test]
    fn plan_differences_are_sentences() {
        let of = |cost: &str| Cost::Of(cost.to_owned());
        let (there, back) = ("go a b", "go b a");
        check(
            &[there, back, there, back],
            &[there, there, there],
            &[of("4"), of("3")],
            &[
                "The plan costs 3 now, 4 before.",
                "2 of 3 actions are also in the plan before, which has 4 actions.",
            ],
        );
        check(
            &[there],
            &[there, back],
            &[of("4"), of("4")],
            &[
                "The plan costs 4, as before.",
                "1 of 2 actions is also in the plan before, which has 1 action.",
            ],
        );
        check(
            &[back],
            &[there],
            &[of("1"), of("2")],
            &[
                "The plan costs 2 now, 1 before.",
                "0 of 1 action is also in the plan before, which has 1 action.",
            ],
        );
        check(
            &[back],
            &[],
            &[of("1"), of("0")],
            &["The plan costs 0 now, 1 before.", "The plan has no actions now; it had 1 action before."],
        );
        check(&[there], &[], &[of("4"), Cost::NoPlan], &["There is no plan now. The plan before costs 4."]);
        check(
            &[there],
            &[],
            &[of("4"), Cost::NotFound],
            &["No plan was found now. The plan before costs 4."],
        );
        check(&[], &[there], &[Cost::NoPlan, of("4")], &["The plan costs 4 now. Before, there was no plan."]);
        check(&[], &[], &[Cost::NoPlan, Cost::NoPlan], &["There is no plan now, and there was none before."]);
        check(
            &[],
            &[],
            &[Cost::NoPlan, Cost::NotFound],
            &["No plan was found now, and there was none before."],
        );
    }
}
