//! The designs of a knowledge base, with the reasons for their availability.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use ontology::tomasys::{Component, FunctionDesign, Measurement, Requirement};
use picture::{Design, Reason, Step};
use rules::{Derivation, Reason as Why, Symbols};

use crate::explain::{Causes, causes, disagreement};
use crate::knowledge::Knowledge;
use crate::mapek::{fact_text, unavailable};
use crate::mission::Mission;
use crate::number::decimal;

/// Maximum depth of a tree of reasons. A page shows fewer levels.
const DEPTH: usize = 100;

/// Returns all designs of the mission's knowledge base, each with the numbers of the steps that use
/// it.
pub fn designs(mission: &Mission, steps: &[Step]) -> Vec<Design> {
    let Some(knowledge) = mission.knowledge() else { return Vec::new() };
    let (components, measurements) = (knowledge.view().components(), knowledge.view().measurements());
    let problem = mission.current();
    let picture = |design: &FunctionDesign| {
        let available = mission.is_available(&problem, design);
        design_picture(knowledge, (design, available), (&components, &measurements), steps)
    };
    knowledge.catalogue().designs().iter().map(picture).collect()
}

fn design_picture(
    knowledge: &Knowledge,
    (design, available): (&FunctionDesign, bool),
    (components, measurements): (&[Component], &[Measurement]),
    steps: &[Step],
) -> Design {
    let name = design.individual.name.clone();
    let uses = |step: &Step| step.configuration.iter().any(|(_, chosen)| *chosen == name);
    let components = design.components.iter().map(|required_component| {
        let component = components.iter().find(|component| component.individual == *required_component);
        match component.and_then(|component| component.status.as_deref()) {
            Some(status) => format!("{} ({status})", required_component.name),
            None => required_component.name.clone(),
        }
    });
    let requirements = design.requirements.iter().map(|requirement| required(requirement, measurements));
    Design {
        functions: design.solves.iter().map(|function| function.name.clone()).collect(),
        available,
        estimations: design
            .estimations
            .iter()
            .map(|(name, value)| format!("{name} {}", decimal(value)))
            .collect(),
        needs: components.chain(requirements).collect(),
        steps: (1..).zip(steps).filter(|(_, step)| uses(step)).map(|(number, _)| number).collect(),
        because: because(knowledge, &name, available),
        name,
    }
}

fn required(requirement: &Requirement, measurements: &[Measurement]) -> String {
    let mut text = requirement.attribute.clone();
    for (word, bound) in [("at least", &requirement.minimum), ("at most", &requirement.maximum)] {
        if let Some(bound) = bound {
            // Writing to a string does not fail.
            let _ = write!(text, " {word} {}", decimal(bound));
        }
    }
    let measured = measurements.iter().find(|measurement| measurement.attribute == requirement.attribute);
    match measured.and_then(|measured| measured.value.as_ref()) {
        Some(value) => format!("{text} (now {})", decimal(value)),
        None => text,
    }
}

/// Returns the reasons why a design is available or not. For an unavailable design, these are
/// derivations from the causes, or the fault that stopped the reasoning.
pub(super) fn because(knowledge: &Knowledge, design: &str, available: bool) -> Vec<Reason> {
    let design = knowledge.catalogue().designs().iter().find(|candidate| candidate.individual.name == design);
    if let Some(text) = design.and_then(|design| disagreement(design, available)) {
        return vec![Reason { text: text.to_owned(), supports: Vec::new() }];
    }
    if available {
        let text = "no fact states or implies that the design is not realisable or not available".to_owned();
        return vec![Reason { text, supports: Vec::new() }];
    }
    if let Some(fault) = knowledge.fault() {
        let text = format!("the conclusions are unknown: {}", fault.message);
        return vec![Reason { text, supports: Vec::new() }];
    }
    let Some(design) = design else { return Vec::new() };
    let Causes { causes, suffice_together } = causes(knowledge, design);
    let count = causes.len();
    let introduction = if suffice_together {
        format!(
            "{count} causes make the design unavailable; if all of them were removed, it would be available:"
        )
    } else {
        format!("{count} causes make the design unavailable:")
    };
    let introduction = (count > 1).then(|| Reason { text: introduction, supports: Vec::new() });
    // If neither a component nor a measurement is a cause, the conclusions from the unchanged
    // knowledge are the reason.
    let states: Vec<&Knowledge> = match count {
        0 => vec![knowledge],
        _ => causes.iter().map(|cause| &cause.knowledge).collect(),
    };
    let trees = states.into_iter().flat_map(|knowledge| {
        let symbols = knowledge.engine().symbols();
        let derivations = unavailable(knowledge, &design.individual.name);
        let trees =
            derivations.iter().map(|derivation| tree(derivation, 0, symbols, &mut BTreeSet::new(), 0));
        trees.collect::<Vec<_>>()
    });
    introduction.into_iter().chain(trees).collect()
}

/// Converts the step `at` of a derivation to a tree of reasons. Names facts that are already in `explained`, and
/// facts below [`DEPTH`] levels, without their reasons.
fn tree(
    derivation: &Derivation,
    at: usize,
    symbols: &Symbols,
    explained: &mut BTreeSet<usize>,
    depth: usize,
) -> Reason {
    let step = &derivation.steps[at];
    let fact = fact_text(&step.fact, symbols);
    let leaf = |text: String| Reason { text, supports: Vec::new() };
    if matches!(step.reason, Why::Asserted) {
        return leaf(format!("{fact} is stated"));
    }
    // Trees are converted, drawn and dropped by recursion, so the stack limits their depth.
    if depth == DEPTH {
        return leaf(format!("{fact} follows from further facts"));
    }
    // A derivation is a directed acyclic graph. Shared facts are expanded once.
    if !explained.insert(at) {
        return leaf(format!("{fact}, as above"));
    }
    let mut under = Vec::new();
    let (by, supports) = match &step.reason {
        Why::Asserted => return leaf(fact),
        Why::Equality { supports } => ("equality of names".to_owned(), supports.clone()),
        Why::Rule { identity, supports, absent, aggregates, .. } => {
            under.extend(
                absent.iter().map(|fact| leaf(format!("{} does not hold", fact_text(fact, symbols)))),
            );
            let counted = aggregates.iter().flat_map(|aggregate| aggregate.matches.iter().flatten());
            let label = identity.label.as_ref().map(ToString::to_string);
            let label = label.unwrap_or_else(|| identity.to_string());
            (format!("the rule “{label}”"), supports.iter().chain(counted).copied().collect())
        }
    };
    under.extend(supports.iter().map(|support| tree(derivation, *support, symbols, explained, depth + 1)));
    Reason { text: format!("{fact} follows by {by}"), supports: under }
}

#[cfg(test)]
mod tests {
    use rules::{DerivationStep, Fact};

    use super::*;

    #[test]
    fn long_derivations_end_at_the_maximum_depth() {
        let mut symbols = Symbols::new();
        let fact = Fact::new(symbols.name("http://x.org/p"), [symbols.name("http://x.org/a")]);
        let step = |at: usize| DerivationStep {
            fact: fact.clone(),
            reason: Why::Equality { supports: vec![at + 1] },
        };
        let mut steps: Vec<DerivationStep> = (0..100_000).map(step).collect();
        steps.push(DerivationStep { fact: fact.clone(), reason: Why::Asserted });
        let mut reason = tree(&Derivation { steps }, 0, &symbols, &mut BTreeSet::new(), 0);
        let mut depth = 0;
        while let Some(support) = reason.supports.pop() {
            reason = support;
            depth += 1;
        }
        assert_eq!(depth, DEPTH);
    }
}
