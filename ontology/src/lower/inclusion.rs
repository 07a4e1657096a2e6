//! Inclusions between restrictions: rules scm-svf1, scm-svf2, scm-avf1 and scm-avf2 of OWL 2 RL ([1], table
//! 9).
//!
//! In this text, p and q are properties, C and D are classes. An individual of `∃p.C` has a value that rules
//! cannot name, but the individual is in `∃q.D` if `p ⊑ q` and `C ⊑ D`. Suppose that one axiom concludes the
//! first restriction, and another axiom has the second restriction as a condition. Then both restrictions get
//! an auxiliary relation, and a rule derives the second relation from the first. Universal restrictions are
//! analogous, with `q ⊑ p`.
//!
//! The inclusions of classes and properties are a transitive closure. It consists of the stated inclusions,
//! `C ⊑ owl:Thing`, `C ⊓ D ⊑ C`, `C ⊑ C ⊔ D`, and the inclusions between restrictions that this module finds.
//!
//! [1] OWL 2 Web Ontology Language Profiles, W3C 2012, section 4.3.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use crate::owl::{Atom, Axiom, Bound, ClassExpression, Iri, ObjectPropertyExpression as Property, Ontology};
use crate::vocab::owl;

#[derive(Default)]
pub(crate) struct Inclusions {
    /// Maps each restriction that an axiom or rule concludes to the restrictions that include it and are
    /// conditions of axioms or rules.
    concluded: BTreeMap<ClassExpression, BTreeSet<ClassExpression>>,
    conditions: HashSet<ClassExpression>,
}

impl Inclusions {
    pub(crate) fn new(ontology: &Ontology) -> Self {
        let mut uses = Uses::default();
        uses.collect(ontology);
        // In most ontologies, either no condition or no conclusion is such a restriction.
        if uses.conditions.is_empty() || uses.concluded.is_empty() {
            return Self::default();
        }
        let graph = InclusionGraph::new(ontology, uses.conditions);
        let mut memo = Memo::default();
        let mut inclusions = Self::default();
        for restriction in uses.concluded {
            let mut including = graph.including(&restriction, graph.depth, &mut memo);
            // If only one axiom or rule contains the restriction, its inclusion in itself derives nothing new.
            if !uses.shared.contains(&restriction) {
                including.remove(&restriction);
            }
            if !including.is_empty() {
                inclusions.conditions.extend(including.iter().cloned());
                inclusions.concluded.insert(restriction, including);
            }
        }
        inclusions
    }

    /// Returns the restriction that is equivalent to `class`, if the restriction is a condition that
    /// includes a concluded restriction.
    pub(crate) fn condition(&self, class: &ClassExpression) -> Option<ClassExpression> {
        restriction(class, false).filter(|restriction| self.conditions.contains(restriction))
    }

    /// Returns the restriction that follows from `class`, if a condition includes this restriction.
    pub(crate) fn conclusion(&self, class: &ClassExpression) -> Option<ClassExpression> {
        restriction(class, true).filter(|restriction| self.concluded.contains_key(restriction))
    }

    pub(crate) fn pairs(&self) -> Vec<[ClassExpression; 2]> {
        let pairs =
            self.concluded.iter().flat_map(|(sub, including)| including.iter().map(move |sup| (sub, sup)));
        pairs.filter(|(sub, sup)| sub != sup).map(|(sub, sup)| [sub.clone(), sup.clone()]).collect()
    }
}

/// Returns the existential or universal restriction that is equivalent to a class. If `is_concluded`, it
/// is sufficient that the restriction follows from the class. Returns `None` if there is no such
/// restriction.
fn restriction(class: &ClassExpression, is_concluded: bool) -> Option<ClassExpression> {
    use ClassExpression as C;
    match class {
        C::SomeValuesFrom(..) | C::AllValuesFrom(..) => Some(class.clone()),
        C::Cardinality(bound, number, property, filler)
            if (*bound, *number) == (Bound::Min, 1)
                || (is_concluded && *bound != Bound::Max && *number > 0) =>
        {
            Some(C::SomeValuesFrom(property.clone(), filler.clone()))
        }
        _ => None,
    }
}

#[derive(Default)]
struct Uses {
    concluded: BTreeSet<ClassExpression>,
    conditions: HashSet<ClassExpression>,
    positions: HashMap<ClassExpression, usize>,
    shared: HashSet<ClassExpression>,
    position: usize,
}

impl Uses {
    fn collect(&mut self, ontology: &Ontology) {
        for annotated in &ontology.axioms {
            self.position += 1;
            match &annotated.axiom {
                Axiom::SubClassOf(sub, sup) => {
                    self.condition(sub);
                    self.conclusion(sup);
                }
                Axiom::EquivalentClasses(classes) => {
                    for class in classes {
                        self.condition(class);
                        self.conclusion(class);
                    }
                }
                Axiom::DisjointClasses(classes) | Axiom::DisjointUnion(_, classes) => {
                    for class in classes {
                        self.condition(class);
                    }
                }
                Axiom::ObjectPropertyDomain(_, class)
                | Axiom::ObjectPropertyRange(_, class)
                | Axiom::DataPropertyDomain(_, class)
                | Axiom::ClassAssertion(class, _) => self.conclusion(class),
                Axiom::HasKey(class, ..) => self.condition(class),
                _ => {}
            }
        }
        for rule in &ontology.rules {
            self.position += 1;
            for (atoms, is_condition) in [(&rule.body, true), (&rule.head, false)] {
                for atom in atoms {
                    match atom {
                        Atom::Class(class, _) if is_condition => self.condition(class),
                        Atom::Class(class, _) => self.conclusion(class),
                        _ => {}
                    }
                }
            }
        }
    }

    fn record(&mut self, restriction: &ClassExpression) {
        if *self.positions.entry(restriction.clone()).or_insert(self.position) != self.position {
            self.shared.insert(restriction.clone());
        }
    }

    fn condition(&mut self, class: &ClassExpression) {
        use ClassExpression as C;
        if let Some(restriction) = restriction(class, false) {
            self.record(&restriction);
            self.conditions.insert(restriction);
        }
        match class {
            C::IntersectionOf(classes) | C::UnionOf(classes) => {
                for class in classes {
                    self.condition(class);
                }
            }
            C::SomeValuesFrom(_, filler) | C::Cardinality(Bound::Min, 1, _, filler) => self.condition(filler),
            _ => {}
        }
    }

    fn conclusion(&mut self, class: &ClassExpression) {
        use ClassExpression as C;
        if let Some(restriction) = restriction(class, true) {
            self.record(&restriction);
            self.concluded.insert(restriction);
        }
        match class {
            C::IntersectionOf(classes) => {
                for class in classes {
                    self.conclusion(class);
                }
            }
            C::AllValuesFrom(_, filler) => self.conclusion(filler),
            C::ComplementOf(class) => self.condition(class),
            C::Cardinality(Bound::Max | Bound::Exact, 0 | 1, _, filler) => self.condition(filler),
            _ => {}
        }
    }
}

/// Limit on the nesting of restrictions that are compared. Inclusions that depend on deeper nesting are not
/// concluded.
const MAX_DEPTH: usize = 3;

/// Keys are a class or restriction and the depth to which nested restrictions are compared.
#[derive(Default)]
struct Memo {
    supers: HashMap<(ClassExpression, usize), BTreeSet<ClassExpression>>,
    including: HashMap<(ClassExpression, usize), BTreeSet<ClassExpression>>,
}

struct InclusionGraph {
    classes: HashMap<ClassExpression, Vec<ClassExpression>>,
    properties: HashMap<Property, Vec<Property>>,
    subproperties: HashMap<Property, Vec<Property>>,
    conditions: HashSet<ClassExpression>,
    /// Nesting depth to which restrictions are compared; 0 if the filler of every condition is a named class.
    depth: usize,
    condition_properties: HashSet<Property>,
    condition_fillers: HashSet<ClassExpression>,
    thing: ClassExpression,
}

impl InclusionGraph {
    fn new(ontology: &Ontology, conditions: HashSet<ClassExpression>) -> Self {
        let condition_properties =
            conditions.iter().filter_map(parts).map(|(property, _)| property.clone()).collect();
        let condition_fillers: HashSet<ClassExpression> =
            conditions.iter().filter_map(parts).map(|(_, filler)| filler.clone()).collect();
        let (classes, properties, subproperties) = (HashMap::new(), HashMap::new(), HashMap::new());
        let thing = ClassExpression::Class(Iri::from(owl::THING));
        let is_nested = |condition: &ClassExpression| {
            parts(condition).is_some_and(|(_, filler)| !matches!(filler, ClassExpression::Class(_)))
        };
        let depth = if conditions.iter().any(is_nested) { MAX_DEPTH } else { 0 };
        let mut graph = Self {
            classes,
            properties,
            subproperties,
            conditions,
            depth,
            condition_properties,
            condition_fillers: HashSet::new(),
            thing,
        };
        for filler in &condition_fillers {
            graph.members(filler);
        }
        graph.condition_fillers = condition_fillers;
        for annotated in &ontology.axioms {
            match &annotated.axiom {
                Axiom::SubClassOf(sub, sup) => graph.class(sub, sup),
                Axiom::EquivalentClasses(classes) => {
                    for (sub, sup) in classes.iter().zip(classes.iter().cycle().skip(1)) {
                        graph.class(sub, sup);
                    }
                }
                Axiom::SubObjectPropertyOf(sub, sup) => graph.property(sub, sup),
                Axiom::EquivalentObjectProperties(properties) => {
                    for (sub, sup) in properties.iter().zip(properties.iter().cycle().skip(1)) {
                        graph.property(sub, sup);
                    }
                }
                Axiom::InverseObjectProperties(first, second) => {
                    let (first, second) = (first.clone(), second.clone());
                    let (direct, inverted) = (Property::Property(first), Property::Inverse(second));
                    graph.property(&direct, &inverted);
                    graph.property(&inverted, &direct);
                }
                _ => {}
            }
        }
        graph
    }

    fn class(&mut self, sub: &ClassExpression, sup: &ClassExpression) {
        self.classes.entry(sub.clone()).or_default().push(sup.clone());
        self.members(sub);
        self.members(sup);
    }

    fn members(&mut self, class: &ClassExpression) {
        if let ClassExpression::UnionOf(members) = class {
            for member in members {
                self.classes.entry(member.clone()).or_default().push(class.clone());
            }
        }
    }

    fn property(&mut self, sub: &Property, sup: &Property) {
        // `p ⊑ q` implies `p⁻ ⊑ q⁻`.
        for (sub, sup) in [(sub.clone(), sup.clone()), (inverse(sub), inverse(sup))] {
            self.properties.entry(sub.clone()).or_default().push(sup.clone());
            self.subproperties.entry(sup).or_default().push(sub);
        }
    }

    /// Returns the restrictions that are conditions and include `restriction`. Nested restrictions are compared up to
    /// `depth` levels.
    fn including(
        &self,
        restriction: &ClassExpression,
        depth: usize,
        memo: &mut Memo,
    ) -> BTreeSet<ClassExpression> {
        let Some((property, filler)) = parts(restriction) else { return BTreeSet::new() };
        let key = (restriction.clone(), depth);
        if let Some(including) = memo.including.get(&key) {
            return including.clone();
        }
        // `∀p.C ⊑ ∀q.D` if `q ⊑ p` and `C ⊑ D`: universal restrictions are antitone in the property.
        let is_universal = matches!(restriction, ClassExpression::AllValuesFrom(..));
        let related = if is_universal { &self.subproperties } else { &self.properties };
        let mut properties = reachable(property, related);
        // Only properties that occur in a condition can contribute. Without such properties, the superclasses of the filler
        // need not be computed.
        properties.retain(|property| self.condition_properties.contains(property));
        if properties.is_empty() {
            return BTreeSet::new();
        }
        let fillers = self.supers(filler, depth, memo);
        let mut including = BTreeSet::new();
        for property in properties {
            for filler in &fillers {
                let (property, filler) = (property.clone(), Box::new(filler.clone()));
                let candidate = if is_universal {
                    ClassExpression::AllValuesFrom(property, filler)
                } else {
                    ClassExpression::SomeValuesFrom(property, filler)
                };
                including.extend(self.conditions.get(&candidate).cloned());
            }
        }
        memo.including.insert(key, including.clone());
        including
    }

    /// Returns the superclasses of a class that follow from the stated inclusions, including `class` itself, if they are
    /// fillers of conditions. Nested restrictions are compared up to `depth` levels.
    fn supers(&self, class: &ClassExpression, depth: usize, memo: &mut Memo) -> BTreeSet<ClassExpression> {
        let key = (class.clone(), depth);
        if let Some(supers) = memo.supers.get(&key) {
            return supers.clone();
        }
        let mut supers = BTreeSet::from([class.clone(), self.thing.clone()]);
        let mut open = vec![class.clone()];
        while let Some(class) = open.pop() {
            let mut next: Vec<ClassExpression> =
                self.classes.get(&class).into_iter().flatten().cloned().collect();
            if let ClassExpression::IntersectionOf(members) = &class {
                next.extend(members.iter().cloned());
            }
            if let Some(restriction) = restriction(&class, true).filter(|_| depth > 0) {
                next.extend(self.including(&restriction, depth - 1, memo));
            }
            open.extend(next.into_iter().filter(|sup| supers.insert(sup.clone())));
        }
        // Only these are compared, and all superclasses of all classes would take quadratic memory.
        supers.retain(|class| self.condition_fillers.contains(class));
        memo.supers.insert(key, supers.clone());
        supers
    }
}

fn parts(restriction: &ClassExpression) -> Option<(&Property, &ClassExpression)> {
    match restriction {
        ClassExpression::SomeValuesFrom(property, filler)
        | ClassExpression::AllValuesFrom(property, filler) => Some((property, filler)),
        _ => None,
    }
}

fn inverse(property: &Property) -> Property {
    match property {
        Property::Property(name) => Property::Inverse(name.clone()),
        Property::Inverse(name) => Property::Property(name.clone()),
    }
}

fn reachable(from: &Property, edges: &HashMap<Property, Vec<Property>>) -> BTreeSet<Property> {
    let mut visited = BTreeSet::from([from.clone()]);
    let mut open = vec![from];
    while let Some(property) = open.pop() {
        let next = edges.get(property).into_iter().flatten();
        open.extend(next.filter(|next| visited.insert((*next).clone())));
    }
    visited
}
