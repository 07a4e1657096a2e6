//! Bounds with which rules compare measured values, as alterations that change the outcome of a comparison.
//!
//! A comparison is examined if one side is a measured value and the other side is a number in the rule. Comparisons
//! with the bounds or the estimations of a design are examined elsewhere. Rules with other comparisons of measured
//! values, such as comparisons of computed values, are listed by name. Components whose status rules read are listed,
//! too.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use num_rational::BigRational;
use ontology::tomasys::Measurement;
use ontology::vocab::local_name;
use rules::{Atom, BuiltIn, Engine, Rule, Symbol, Term, Variable};

use crate::explain::parts::{Alteration, Target};
use crate::knowledge::{Knowledge, VALUE_PROPERTIES, ValueRead};

const BOUND: &[&str] = &["hasMinimum", "hasMaximum"];
const AVAILABILITY: &[&str] = &["fd_realisability", "fd_available"];
const STATUS: &[&str] = &["c_status"];
const REQUIRED: &[&str] = &["requiresC", "requiredBy"];

#[derive(Debug, Clone, Default)]
pub(super) struct RuleBounds {
    /// Comparisons of measured values with numbers.
    pub bounds: Vec<RuleBound>,
    /// Components whose status is read by rules that can affect the availability of designs.
    pub status_reads: Vec<StatusRead>,
    /// Rules that can affect the availability of designs and have comparisons that are not in `bounds`, in words.
    pub unexamined: Vec<String>,
}

#[derive(Debug, Clone)]
pub(super) struct RuleBound {
    pub alteration: Alteration,
    /// `true` if the conclusion of the rule can affect the availability of designs.
    pub is_deciding: bool,
    /// IRIs of the designs about which the rule concludes; `None` if it may conclude about any design.
    designs: Option<BTreeSet<String>>,
    /// `true` if the rule itself rules designs out, and the alteration only satisfies the comparison.
    pub is_harmful: bool,
}

impl RuleBound {
    /// Returns `true` if the rule can affect the availability of a design.
    pub fn concerns(&self, iri: &str) -> bool {
        self.is_deciding && self.designs.as_ref().is_none_or(|designs| designs.contains(iri))
    }
}

/// A condition of a rule on the status of a component that is not necessarily one of the design's own components.
#[derive(Debug, Clone)]
pub(super) struct StatusRead {
    /// IRI of the component; `None` if the condition may concern any component.
    component: Option<String>,
    /// IRIs of the designs about which the rule concludes; `None` if it may conclude about any design.
    designs: Option<BTreeSet<String>>,
}

impl StatusRead {
    /// Returns `true` if the status of a component can affect the availability of a design.
    pub fn concerns(&self, component: &str, design: &str) -> bool {
        self.component.as_ref().is_none_or(|name| name == component)
            && self.designs.as_ref().is_none_or(|designs| designs.contains(design))
    }
}

pub(super) fn rule_bounds(knowledge: &Knowledge) -> RuleBounds {
    let measurements = knowledge.view().measurements();
    let engine = knowledge.engine();
    let rules = engine.program().rules.iter().zip(knowledge.value_reads());
    let rules = rules.map(|(rule, reads)| RuleReads::new(engine, &measurements, rule, reads)).collect();
    let reader = Reader { engine, rules };
    let deciding = reader.deciding();
    let carriers = reader.carriers();
    let (mut bounds, mut status_reads, mut unexamined) = (Vec::new(), Vec::new(), BTreeSet::new());
    for reads in &reader.rules {
        let rule = reads.rule;
        let is_deciding = concluded(rule).any(|predicate| deciding.contains(&predicate));
        let is_examined = reader.read(reads, &carriers, is_deciding, &mut bounds);
        if is_deciding {
            status_reads.extend(reader.status_reads(rule));
        }
        if is_deciding && !is_examined {
            let label = rule.identity.label.as_ref().map(ToString::to_string);
            unexamined.insert(label.unwrap_or_else(|| rule.identity.to_string()));
        }
    }
    let words = |rule: &String| format!("comparisons of measurements in the rule `{rule}`");
    RuleBounds { bounds, status_reads, unexamined: unexamined.iter().map(words).collect() }
}

struct RuleReads<'a> {
    rule: &'a Rule,
    reads: &'a [ValueRead],
    /// Variables whose values are measured values, with the possible measurements.
    measured: BTreeMap<Variable, Vec<&'a Measurement>>,
    /// `true` if a condition requires that a measured value is a constant.
    has_constant: bool,
}

impl<'a> RuleReads<'a> {
    fn new(engine: &Engine, measurements: &'a [Measurement], rule: &'a Rule, reads: &'a [ValueRead]) -> Self {
        let mut result = Self { rule, reads, measured: BTreeMap::new(), has_constant: false };
        for read in reads {
            let Some(value) = read.value else { continue };
            let possible = measurements.iter().filter(|measurement| read.can_be(measurement, engine));
            let possible: Vec<&Measurement> = possible.collect();
            match value {
                _ if possible.is_empty() => {}
                Term::Variable(variable) => drop(result.measured.insert(variable, possible)),
                Term::Constant(_) => result.has_constant = true,
            }
        }
        result
    }
}

struct Reader<'a> {
    engine: &'a Engine,
    rules: Vec<RuleReads<'a>>,
}

impl Reader<'_> {
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
                    deciding.extend(atoms(rule).filter_map(predicate_of));
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
            for reads in &self.rules {
                let dependent = self.dependent(reads, &carriers);
                let heads = reads.rule.head.iter().filter(|atom| contain(&dependent, &atom.terms()));
                carriers.extend(heads.filter_map(predicate_of));
            }
            if carriers.len() == before {
                return carriers;
            }
        }
    }

    fn dependent(&self, reads: &RuleReads<'_>, carriers: &BTreeSet<Symbol>) -> BTreeSet<Variable> {
        let mut dependent: BTreeSet<Variable> = reads.measured.keys().copied().collect();
        for atom in atoms(reads.rule) {
            if let Atom::Relation { predicate, arguments } = atom
                && carriers.contains(predicate)
                && !self.is_named(*predicate, &VALUE_PROPERTIES)
            {
                dependent.extend(arguments.iter().filter_map(|term| term.as_variable()));
            }
        }
        loop {
            let before = dependent.len();
            for atom in atoms(reads.rule) {
                let terms: Vec<Term> = match atom {
                    Atom::BuiltIn { built_in, arguments } if !is_comparison(*built_in) => arguments.clone(),
                    Atom::Aggregate { aggregate, result, .. } => {
                        std::iter::once(*result).chain(aggregate.value()).collect()
                    }
                    _ => continue,
                };
                if contain(&dependent, &terms) {
                    dependent.extend(terms.iter().filter_map(|term| term.as_variable()));
                }
            }
            if dependent.len() == before {
                return dependent;
            }
        }
    }

    /// Adds the bounds of a rule to `bounds`. Returns `false` if the rule depends on measured values in another way.
    fn read(
        &self,
        reads: &RuleReads<'_>,
        carriers: &BTreeSet<Symbol>,
        is_deciding: bool,
        bounds: &mut Vec<RuleBound>,
    ) -> bool {
        let rule = reads.rule;
        let dependent = self.dependent(reads, carriers);
        let designs = self.designs(rule);
        // With an aggregate, a comparison that is not satisfied may rule a design out.
        let is_direct = !rule.head.is_empty()
            && rule
                .head
                .iter()
                .all(|atom| predicate_of(atom).is_some_and(|name| self.is_named(name, AVAILABILITY)))
            && !rule.body.iter().any(|atom| matches!(atom, Atom::Aggregate { .. }));
        let mut is_examined = !reads.has_constant;
        for atom in atoms(rule) {
            let (built_in, arguments) = match atom {
                Atom::BuiltIn { built_in, arguments } | Atom::NotBuiltIn { built_in, arguments } => {
                    (*built_in, arguments)
                }
                Atom::Not { predicate, .. } => {
                    is_examined &=
                        !carriers.contains(predicate) && !self.is_named(*predicate, &VALUE_PROPERTIES);
                    continue;
                }
                Atom::Aggregate { aggregate, .. } => {
                    is_examined &= !aggregate.value().is_some_and(|term| contain(&dependent, &[term]));
                    continue;
                }
                _ => continue,
            };
            let is_range = matches!(built_in, BuiltIn::DataRange | BuiltIn::OutsideDataRange);
            if is_range || !contain(&dependent, arguments) {
                continue;
            }
            let Some(changes) = self.changes(reads, built_in, arguments, &dependent) else {
                is_examined = false;
                continue;
            };
            bounds.extend(changes.into_iter().map(|(alteration, is_satisfied)| RuleBound {
                alteration,
                is_deciding,
                designs: designs.clone(),
                // An alteration changes the outcome of a comparison and of its negation alike.
                is_harmful: is_direct && is_satisfied == atom.is_negated(),
            }));
        }
        let concludes_value = rule.head.iter().any(|atom| {
            predicate_of(atom).is_some_and(|name| self.is_named(name, &VALUE_PROPERTIES))
                && contain(&dependent, &atom.terms())
        });
        is_examined && !concludes_value
    }

    /// Returns the conditions of a rule on the status of components, without those on components that are required by
    /// the design of the conclusion.
    fn status_reads(&self, rule: &Rule) -> Vec<StatusRead> {
        let is_atom_of = |atom: &Atom, names: &[&str]| {
            predicate_of(atom).is_some_and(|predicate| self.is_named(predicate, names))
        };
        let subjects: Vec<Term> = rule.head.iter().flat_map(Atom::terms).collect();
        let is_required = |component: Term| {
            let is_of_subject = |terms: &[Term]| {
                terms.contains(&component)
                    && terms.iter().any(|term| *term != component && subjects.contains(term))
            };
            rule.body.iter().any(|atom| is_atom_of(atom, REQUIRED) && is_of_subject(&atom.terms()))
        };
        let components = atoms(rule).filter(|atom| is_atom_of(atom, STATUS));
        let components = components.filter_map(|atom| atom.terms().first().copied());
        let designs = self.designs(rule);
        let read = |term: Term| {
            let component = match term {
                Term::Constant(name) => Some(self.engine.symbols().value(name).as_name()?.to_owned()),
                Term::Variable(_) if is_required(term) => return None,
                Term::Variable(_) => None,
            };
            Some(StatusRead { component, designs: designs.clone() })
        };
        components.filter_map(read).collect()
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
        reads: &RuleReads<'_>,
        built_in: BuiltIn,
        arguments: &[Term],
        dependent: &BTreeSet<Variable>,
    ) -> Option<Vec<(Alteration, bool)>> {
        if !is_comparison(built_in) {
            return None;
        }
        let measured = |term: Term| reads.measured.get(&term.as_variable()?);
        let (measurements, other, is_swapped) = match *arguments {
            [left, right] => match (measured(left), measured(right)) {
                (Some(measurements), None) => (measurements, right, false),
                (None, Some(measurements)) => (measurements, left, true),
                _ => return None,
            },
            _ => return None,
        };
        let bound = match other {
            Term::Constant(symbol) => self.engine.symbols().value(symbol).as_literal()?.as_rational()?,
            Term::Variable(_) => {
                let is_static = !contain(dependent, &[other]) && self.is_value_of_design(reads, other);
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
    fn is_value_of_design(&self, reads: &RuleReads<'_>, variable: Term) -> bool {
        let is_bound = |atom: &Atom| match atom {
            Atom::Relation { predicate, arguments } => {
                self.is_named(*predicate, BOUND) && arguments.get(1) == Some(&variable)
            }
            _ => false,
        };
        reads.reads.iter().any(|read| read.is_estimation && read.value == Some(variable))
            || reads.rule.body.iter().any(is_bound)
    }
}

fn contain(variables: &BTreeSet<Variable>, terms: &[Term]) -> bool {
    terms.iter().any(|term| term.as_variable().is_some_and(|variable| variables.contains(&variable)))
}

fn atoms(rule: &Rule) -> impl Iterator<Item = &Atom> {
    rule.body.iter().flat_map(|atom| std::iter::once(atom).chain(atom.parts()))
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
    // `true` if the comparison has the same outcome at the bound as below it, so that it changes just above the bound.
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
