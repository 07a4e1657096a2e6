//! Bounds with which rules compare measured values, as alterations that change the outcome of a comparison.
//!
//! A comparison is examined if one side is a measured value and the other side is a number in the rule. Comparisons
//! with the bounds or the estimations of a design are examined elsewhere. Rules with other comparisons of measured
//! values, such as comparisons of computed values, are listed by name.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use num_rational::BigRational;
use ontology::tomasys::Measurement;
use ontology::vocab::local_name;
use rules::{Atom, BuiltIn, Engine, Fact, Rule, Symbol, Term, Variable};

use crate::explain::parts::{Alteration, Target};
use crate::knowledge::Knowledge;

const VALUE: &[&str] = &["hasValue", "qa_has_value"];
const TYPE: &[&str] = &["isQAtype"];
const ESTIMATION: &[&str] = &["hasQAestimation"];
const BOUND: &[&str] = &["hasMinimum", "hasMaximum"];
const AVAILABILITY: &[&str] = &["fd_realisability", "fd_available"];

/// Result of [`rule_bounds`].
#[derive(Debug, Clone, Default)]
pub(super) struct RuleBounds {
    /// Comparisons of measured values with numbers.
    pub bounds: Vec<RuleBound>,
    /// Names of the rules that can affect the availability of designs and have comparisons that are not in `bounds`.
    pub unexamined: BTreeSet<String>,
}

/// An alteration of a measured value that changes the outcome of a comparison in a rule.
#[derive(Debug, Clone)]
pub(super) struct RuleBound {
    pub alteration: Alteration,
    /// `true` if the conclusion of the rule can affect the availability of designs.
    is_deciding: bool,
    /// IRIs of the designs about which the rule concludes; `None` if it may conclude about any design.
    designs: Option<BTreeSet<String>>,
    /// `true` if the rule itself rules designs out, and the alteration only satisfies the comparison.
    is_harmful: bool,
}

impl RuleBound {
    /// Returns `true` if the rule can affect the availability of a design.
    pub fn concerns(&self, iri: &str) -> bool {
        self.is_deciding && self.designs.as_ref().is_none_or(|designs| designs.contains(iri))
    }

    /// Returns `true` unless the alteration can only rule out designs about which the rule concludes.
    pub fn can_help(&self) -> bool {
        !self.is_harmful
    }

    /// Returns `true` if the rule can affect the availability of any design.
    pub fn is_deciding(&self) -> bool {
        self.is_deciding
    }
}

impl RuleBounds {
    /// Describes the comparisons that are not among the bounds.
    pub fn unexamined_comparisons(&self) -> Vec<String> {
        self.unexamined
            .iter()
            .map(|rule| format!("comparisons of measurements in the rule `{rule}`"))
            .collect()
    }
}

/// Returns the bounds with which the rules of a knowledge base compare measured values.
pub(super) fn rule_bounds(knowledge: &Knowledge) -> RuleBounds {
    let measurements = knowledge.view().measurements();
    let reader = Reader { engine: knowledge.engine(), measurements: &measurements };
    let deciding = reader.deciding();
    let carriers = reader.carriers();
    let mut result = RuleBounds::default();
    for rule in &reader.engine.program().rules {
        let is_deciding = concluded(rule).any(|predicate| deciding.contains(&predicate));
        let is_examined = reader.read(rule, &carriers, is_deciding, &mut result.bounds);
        if is_deciding && !is_examined {
            let label = rule.identity.label.as_ref().map(ToString::to_string);
            result.unexamined.insert(label.unwrap_or_else(|| rule.identity.to_string()));
        }
    }
    result
}

/// Variables of a rule whose values depend on measured values.
struct Values<'a> {
    /// Variables whose values are measured values, with the possible measurements.
    direct: BTreeMap<Variable, Vec<&'a Measurement>>,
    /// All variables whose values depend on measured values.
    dependent: BTreeSet<Variable>,
}

impl Values<'_> {
    fn contain(&self, term: Term) -> bool {
        term.as_variable().is_some_and(|variable| self.dependent.contains(&variable))
    }
}

struct Reader<'a> {
    engine: &'a Engine,
    measurements: &'a [Measurement],
}

impl<'a> Reader<'a> {
    fn is_named(&self, predicate: Symbol, names: &[&str]) -> bool {
        let iri = self.engine.symbols().value(predicate).as_name();
        iri.is_some_and(|iri| names.contains(&local_name(iri)))
    }

    /// Returns the predicates on which the availability of designs can depend.
    fn deciding(&self) -> BTreeSet<Symbol> {
        let rules = &self.engine.program().rules;
        let heads = rules.iter().flat_map(concluded);
        let mut deciding: BTreeSet<Symbol> =
            heads.filter(|predicate| self.is_named(*predicate, AVAILABILITY)).collect();
        loop {
            let before = deciding.len();
            for rule in rules {
                if concluded(rule).any(|predicate| deciding.contains(&predicate)) {
                    deciding.extend(atoms(rule).into_iter().filter_map(predicate_of));
                }
            }
            if deciding.len() == before {
                return deciding;
            }
        }
    }

    /// Returns the predicates of conclusions that contain values which depend on measured values.
    fn carriers(&self) -> BTreeSet<Symbol> {
        let mut carriers = BTreeSet::new();
        loop {
            let before = carriers.len();
            for rule in &self.engine.program().rules {
                let values = self.values(rule, &carriers);
                let heads =
                    rule.head.iter().filter(|atom| atom.terms().iter().any(|term| values.contain(*term)));
                carriers.extend(heads.filter_map(predicate_of));
            }
            if carriers.len() == before {
                return carriers;
            }
        }
    }

    fn values(&self, rule: &Rule, carriers: &BTreeSet<Symbol>) -> Values<'a> {
        let mut values = Values { direct: BTreeMap::new(), dependent: BTreeSet::new() };
        for atom in atoms(rule) {
            let Atom::Relation { predicate, arguments } = atom else { continue };
            if self.is_named(*predicate, VALUE) {
                if let [holder, Term::Variable(value)] = arguments[..] {
                    let measurements = self.measurements_of(rule, holder);
                    if !measurements.is_empty() {
                        values.direct.insert(value, measurements);
                        values.dependent.insert(value);
                    }
                }
            } else if carriers.contains(predicate) {
                values.dependent.extend(arguments.iter().filter_map(|term| term.as_variable()));
            }
        }
        loop {
            let before = values.dependent.len();
            for atom in atoms(rule) {
                let terms: Vec<Term> = match atom {
                    Atom::BuiltIn { built_in, arguments } if !is_comparison(*built_in) => arguments.clone(),
                    Atom::Aggregate { aggregate, result, .. } => {
                        std::iter::once(*result).chain(aggregate.value()).collect()
                    }
                    _ => continue,
                };
                if terms.iter().any(|term| values.contain(*term)) {
                    values.dependent.extend(terms.iter().filter_map(|term| term.as_variable()));
                }
            }
            if values.dependent.len() == before {
                return values;
            }
        }
    }

    /// Returns `true` if a rule requires that a term is an estimation of a design.
    fn is_estimation(&self, rule: &Rule, term: Term) -> bool {
        rule.body.iter().any(|atom| match atom {
            Atom::Relation { predicate, arguments } => {
                self.is_named(*predicate, ESTIMATION) && arguments.get(1) == Some(&term)
            }
            _ => false,
        })
    }

    /// Returns the measurements whose individual a term of a rule can denote.
    fn measurements_of(&self, rule: &Rule, holder: Term) -> Vec<&'a Measurement> {
        if self.is_estimation(rule, holder) {
            return Vec::new();
        }
        let symbols = self.engine.symbols();
        let mut types: Vec<(Symbol, Symbol)> = Vec::new();
        for atom in atoms(rule) {
            if let Atom::Relation { predicate, arguments } = atom
                && let [subject, Term::Constant(kind)] = arguments[..]
                && subject == holder
                && self.is_named(*predicate, TYPE)
            {
                types.push((*predicate, kind));
            }
        }
        let is_possible = |measurement: &&Measurement| {
            let iri = measurement.individual.iri.as_str();
            match holder {
                Term::Constant(symbol) => symbols.value(symbol).as_name() == Some(iri),
                Term::Variable(_) => symbols.find_name(iri).is_some_and(|individual| {
                    let has = |(predicate, kind): &(Symbol, Symbol)| {
                        self.engine.holds(&Fact::new(*predicate, [individual, *kind]))
                    };
                    types.iter().all(has)
                }),
            }
        };
        self.measurements.iter().filter(is_possible).collect()
    }

    /// Adds the bounds of a rule to `bounds`. Returns `false` if the rule depends on measured values in another way.
    fn read(
        &self,
        rule: &Rule,
        carriers: &BTreeSet<Symbol>,
        is_deciding: bool,
        bounds: &mut Vec<RuleBound>,
    ) -> bool {
        let values = self.values(rule, carriers);
        let designs = self.designs(rule);
        // With an aggregate, a comparison that is not satisfied may rule a design out.
        let is_direct = !rule.head.is_empty()
            && rule
                .head
                .iter()
                .all(|atom| predicate_of(atom).is_some_and(|name| self.is_named(name, AVAILABILITY)))
            && !rule.body.iter().any(|atom| matches!(atom, Atom::Aggregate { .. }));
        let mut is_examined = true;
        for atom in atoms(rule) {
            let Atom::BuiltIn { built_in, arguments } = atom else {
                is_examined &= self.is_independent(rule, atom, &values, carriers);
                continue;
            };
            let is_range = matches!(built_in, BuiltIn::DataRange | BuiltIn::OutsideDataRange);
            if is_range || !arguments.iter().any(|term| values.contain(*term)) {
                continue;
            }
            let Some(changes) = self.changes(rule, *built_in, arguments, &values) else {
                is_examined = false;
                continue;
            };
            bounds.extend(changes.into_iter().map(|(alteration, is_satisfied)| RuleBound {
                alteration,
                is_deciding,
                designs: designs.clone(),
                is_harmful: is_direct && !is_satisfied,
            }));
        }
        let concludes_value = rule.head.iter().any(|atom| {
            predicate_of(atom).is_some_and(|name| self.is_named(name, VALUE))
                && atom.terms().iter().any(|term| values.contain(*term))
        });
        is_examined && !concludes_value
    }

    /// Returns `true` unless an atom that is not a built-in tests or aggregates measured values.
    fn is_independent(
        &self,
        rule: &Rule,
        atom: &Atom,
        values: &Values<'_>,
        carriers: &BTreeSet<Symbol>,
    ) -> bool {
        match atom {
            Atom::Relation { predicate, arguments } => match arguments[..] {
                [holder, Term::Constant(_)] if self.is_named(*predicate, VALUE) => {
                    self.measurements_of(rule, holder).is_empty()
                }
                _ => true,
            },
            Atom::Not { predicate, .. } => !carriers.contains(predicate) && !self.is_named(*predicate, VALUE),
            Atom::Aggregate { aggregate, .. } => !aggregate.value().is_some_and(|term| values.contain(term)),
            _ => true,
        }
    }

    /// Returns the IRIs of the designs whose availability a rule concludes, if it concludes nothing else and names
    /// each design.
    fn designs(&self, rule: &Rule) -> Option<BTreeSet<String>> {
        let design = |atom: &Atom| match atom {
            Atom::Relation { predicate, arguments } if self.is_named(*predicate, AVAILABILITY) => {
                let Term::Constant(design) = *arguments.first()? else { return None };
                self.engine.symbols().value(design).as_name().map(ToOwned::to_owned)
            }
            _ => None,
        };
        rule.head.iter().map(design).collect()
    }

    /// Returns the alterations that change the outcome of a comparison, with `true` if the comparison is satisfied
    /// now. Returns `None` if they are not known.
    fn changes(
        &self,
        rule: &Rule,
        built_in: BuiltIn,
        arguments: &[Term],
        values: &Values<'_>,
    ) -> Option<Vec<(Alteration, bool)>> {
        if !is_comparison(built_in) {
            return None;
        }
        let direct = |term: Term| values.direct.get(&term.as_variable()?);
        let (measurements, other, is_swapped) = match *arguments {
            [left, right] => match (direct(left), direct(right)) {
                (Some(measurements), None) => (measurements, right, false),
                (None, Some(measurements)) => (measurements, left, true),
                _ => return None,
            },
            _ => return None,
        };
        let bound = match other {
            Term::Constant(symbol) => self.engine.symbols().value(symbol).as_literal()?.as_rational()?,
            Term::Variable(_) => {
                let is_static = !values.contain(other) && self.is_value_of_design(rule, other);
                return is_static.then(Vec::new);
            }
        };
        let mut changes = Vec::new();
        for measurement in measurements {
            let from = measurement.value.as_ref()?;
            let is_satisfied = holds(built_in, if is_swapped { bound.cmp(from) } else { from.cmp(&bound) });
            for to in targets(built_in, is_swapped, &bound, from)? {
                let (name, from) = (measurement.attribute.clone(), Some(from.clone()));
                changes.push((Alteration { name, from, to }, is_satisfied));
            }
        }
        Some(changes)
    }

    /// Returns `true` if a variable is bound by a bound or an estimation of a design.
    fn is_value_of_design(&self, rule: &Rule, variable: Term) -> bool {
        rule.body.iter().any(|atom| match atom {
            Atom::Relation { predicate, arguments } => match arguments[..] {
                [holder, value] if value == variable => {
                    self.is_named(*predicate, BOUND)
                        || self.is_named(*predicate, VALUE) && self.is_estimation(rule, holder)
                }
                _ => false,
            },
            _ => false,
        })
    }
}

/// Returns the atoms in the body of a rule, and those in its aggregates.
fn atoms(rule: &Rule) -> Vec<&Atom> {
    rule.body.iter().flat_map(|atom| std::iter::once(atom).chain(atom.parts())).collect()
}

fn predicate_of(atom: &Atom) -> Option<Symbol> {
    match atom {
        Atom::Relation { predicate, .. } | Atom::Not { predicate, .. } => Some(*predicate),
        _ => None,
    }
}

fn concluded(rule: &Rule) -> impl Iterator<Item = Symbol> {
    rule.head.iter().filter_map(predicate_of)
}

fn is_comparison(built_in: BuiltIn) -> bool {
    matches!(
        built_in,
        BuiltIn::Equal
            | BuiltIn::NotEqual
            | BuiltIn::LessThan
            | BuiltIn::LessThanOrEqual
            | BuiltIn::GreaterThan
            | BuiltIn::GreaterThanOrEqual
    )
}

/// Returns the outcome of a comparison of two values with this order.
fn holds(built_in: BuiltIn, order: Ordering) -> bool {
    match built_in {
        BuiltIn::LessThan => order.is_lt(),
        BuiltIn::LessThanOrEqual => order.is_le(),
        BuiltIn::GreaterThan => order.is_gt(),
        BuiltIn::GreaterThanOrEqual => order.is_ge(),
        BuiltIn::NotEqual => order.is_ne(),
        _ => order.is_eq(),
    }
}

/// Returns the targets for the value `from` that change the outcome of its comparison with `bound`. With
/// `is_swapped`, the bound is the first argument. Returns `None` if the value would have to equal the bound.
fn targets(
    built_in: BuiltIn,
    is_swapped: bool,
    bound: &BigRational,
    from: &BigRational,
) -> Option<Vec<Target>> {
    let bound = bound.clone();
    let order = from.cmp(&bound);
    // `true` if the outcome at the bound is that of smaller values.
    let changes_above = match built_in {
        BuiltIn::GreaterThan | BuiltIn::LessThanOrEqual => !is_swapped,
        BuiltIn::LessThan | BuiltIn::GreaterThanOrEqual => is_swapped,
        _ => return order.is_eq().then(|| vec![Target::Below(bound.clone()), Target::Above(bound)]),
    };
    Some(vec![match (changes_above, order) {
        (true, Ordering::Greater) => Target::AtMost(bound),
        (true, _) => Target::Above(bound),
        (false, Ordering::Less) => Target::AtLeast(bound),
        (false, _) => Target::Below(bound),
    }])
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;
    use rules::BuiltIn;

    use super::{Target, targets};

    #[test]
    fn targets_are_the_nearest_values_with_another_outcome() {
        let number = |value: i64| BigRational::from_integer(value.into());
        let check = |built_in, is_swapped, from: i64, expected: Option<Vec<Target>>| {
            assert_eq!(
                targets(built_in, is_swapped, &number(5), &number(from)),
                expected,
                "{built_in:?} {from}"
            );
        };
        check(BuiltIn::GreaterThan, false, 6, Some(vec![Target::AtMost(number(5))]));
        check(BuiltIn::GreaterThan, false, 5, Some(vec![Target::Above(number(5))]));
        check(BuiltIn::GreaterThan, true, 5, Some(vec![Target::Below(number(5))]));
        check(BuiltIn::LessThan, false, 4, Some(vec![Target::AtLeast(number(5))]));
        check(BuiltIn::LessThan, true, 6, Some(vec![Target::AtMost(number(5))]));
        check(BuiltIn::GreaterThanOrEqual, false, 5, Some(vec![Target::Below(number(5))]));
        check(BuiltIn::LessThanOrEqual, false, 5, Some(vec![Target::Above(number(5))]));
        check(BuiltIn::Equal, false, 5, Some(vec![Target::Below(number(5)), Target::Above(number(5))]));
        check(BuiltIn::NotEqual, false, 4, None);
    }
}
