//! Restrictions that include others: rules scm-svf1, scm-svf2, scm-avf1 and scm-avf2 of OWL 2 RL ([1], table 9).
//!
//! An individual of `∃p.C` has a value that no rule can name, but it is in `∃q.D` where `p ⊑ q` and `C ⊑ D`. Where an axiom
//! concludes the first restriction and another has the second as a condition, both get an auxiliary relation, and a rule leads
//! from one to the other. Universal restrictions are treated alike, with `q ⊑ p`. Inclusions of classes and properties are
//! those that axioms state, closed under transitivity, with `C ⊓ D ⊑ C`, `C ⊑ C ⊔ D`, and what this file finds itself.
//!
//! [1] OWL 2 Web Ontology Language Profiles, W3C 2012, section 4.3.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use crate::owl::{Atom, Axiom, Bound, ClassExpression, Iri, ObjectPropertyExpression as Property, Ontology};
use crate::vocab::owl;

/// Restrictions with an auxiliary relation.
#[derive(Default)]
pub(crate) struct Inclusions {
    /// By restriction that an axiom concludes: the conditions that include it.
    concluded: BTreeMap<ClassExpression, BTreeSet<ClassExpression>>,
    /// These conditions.
    conditions: HashSet<ClassExpression>,
}

impl Inclusions {
    /// The inclusions between the restrictions of an ontology.
    pub(crate) fn new(ontology: &Ontology) -> Self {
        let mut uses = Uses::default();
        uses.collect(ontology);
        if uses.conditions.is_empty() || uses.concluded.is_empty() {
            return Self::default();
        }
        let stated = Stated::new(ontology, uses.conditions);
        let mut known = Known::default();
        let mut inclusions = Self::default();
        for restriction in uses.concluded {
            let mut including = stated.including(&restriction, stated.depth, &mut known);
            // A definition by a restriction need not be told that the restriction includes itself.
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

    /// The restriction that a condition is, where a conclusion is included in it.
    pub(crate) fn condition(&self, class: &ClassExpression) -> Option<ClassExpression> {
        restriction(class, false).filter(|restriction| self.conditions.contains(restriction))
    }

    /// The restriction that includes a conclusion, where a condition includes the restriction.
    pub(crate) fn conclusion(&self, class: &ClassExpression) -> Option<ClassExpression> {
        restriction(class, true).filter(|restriction| self.concluded.contains_key(restriction))
    }

    /// Two different restrictions each, of which the second includes the first.
    pub(crate) fn pairs(&self) -> Vec<[ClassExpression; 2]> {
        let pairs =
            self.concluded.iter().flat_map(|(sub, including)| including.iter().map(move |sup| (sub, sup)));
        pairs.filter(|(sub, sup)| sub != sup).map(|(sub, sup)| [sub.clone(), sup.clone()]).collect()
    }
}

/// The existential or universal restriction that a class is, or of which the class is part if it is concluded.
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

/// The restrictions that axioms and rules conclude, and that they have as conditions.
#[derive(Default)]
struct Uses {
    concluded: BTreeSet<ClassExpression>,
    conditions: HashSet<ClassExpression>,
    /// By restriction: the place of the axiom or rule that has it, the first of several.
    places: HashMap<ClassExpression, usize>,
    /// Restrictions that several axioms or rules have.
    shared: HashSet<ClassExpression>,
    /// The place of the axiom or rule that is visited.
    place: usize,
}

impl Uses {
    fn collect(&mut self, ontology: &Ontology) {
        for annotated in &ontology.axioms {
            self.place += 1;
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
            self.place += 1;
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

    fn note(&mut self, restriction: &ClassExpression) {
        if *self.places.entry(restriction.clone()).or_insert(self.place) != self.place {
            self.shared.insert(restriction.clone());
        }
    }

    fn condition(&mut self, class: &ClassExpression) {
        use ClassExpression as C;
        if let Some(restriction) = restriction(class, false) {
            self.note(&restriction);
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
            self.note(&restriction);
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

/// Limit on restrictions within restrictions that are compared; what lies deeper is not concluded.
const MAX_DEPTH: usize = 3;

/// Classes and conditions by what they include and the depth to which restrictions are compared.
#[derive(Default)]
struct Known {
    supers: HashMap<(ClassExpression, usize), BTreeSet<ClassExpression>>,
    including: HashMap<(ClassExpression, usize), BTreeSet<ClassExpression>>,
}

/// Inclusions that axioms state, and the conditions that are compared.
struct Stated {
    classes: HashMap<ClassExpression, Vec<ClassExpression>>,
    properties: HashMap<Property, Vec<Property>>,
    subproperties: HashMap<Property, Vec<Property>>,
    conditions: HashSet<ClassExpression>,
    /// Number of restrictions within restrictions that are compared: none where no condition contains another.
    depth: usize,
    /// The properties of the conditions.
    used: HashSet<Property>,
    thing: ClassExpression,
}

impl Stated {
    fn new(ontology: &Ontology, conditions: HashSet<ClassExpression>) -> Self {
        let used = conditions.iter().filter_map(parts).map(|(property, _)| property.clone()).collect();
        let (classes, properties, subproperties) = (HashMap::new(), HashMap::new(), HashMap::new());
        let thing = ClassExpression::Class(Iri::from(owl::THING));
        let is_nested = |condition: &ClassExpression| {
            parts(condition).is_some_and(|(_, filler)| !matches!(filler, ClassExpression::Class(_)))
        };
        let depth = if conditions.iter().any(is_nested) { MAX_DEPTH } else { 0 };
        let mut stated = Self { classes, properties, subproperties, conditions, depth, used, thing };
        let fillers: Vec<ClassExpression> =
            stated.conditions.iter().filter_map(parts).map(|(_, filler)| filler.clone()).collect();
        for filler in &fillers {
            stated.members(filler);
        }
        for annotated in &ontology.axioms {
            match &annotated.axiom {
                Axiom::SubClassOf(sub, sup) => stated.class(sub, sup),
                Axiom::EquivalentClasses(classes) => {
                    for (sub, sup) in classes.iter().zip(classes.iter().cycle().skip(1)) {
                        stated.class(sub, sup);
                    }
                }
                Axiom::SubObjectPropertyOf(sub, sup) => stated.property(sub, sup),
                Axiom::EquivalentObjectProperties(properties) => {
                    for (sub, sup) in properties.iter().zip(properties.iter().cycle().skip(1)) {
                        stated.property(sub, sup);
                    }
                }
                Axiom::InverseObjectProperties(first, second) => {
                    let (first, second) = (first.clone(), second.clone());
                    let (one, other) = (Property::Property(first), Property::Inverse(second));
                    stated.property(&one, &other);
                    stated.property(&other, &one);
                }
                _ => {}
            }
        }
        stated
    }

    fn class(&mut self, sub: &ClassExpression, sup: &ClassExpression) {
        self.classes.entry(sub.clone()).or_default().push(sup.clone());
        self.members(sub);
        self.members(sup);
    }

    /// Adds that a union includes its members.
    fn members(&mut self, class: &ClassExpression) {
        if let ClassExpression::UnionOf(members) = class {
            for member in members {
                self.classes.entry(member.clone()).or_default().push(class.clone());
            }
        }
    }

    fn property(&mut self, sub: &Property, sup: &Property) {
        for (sub, sup) in [(sub.clone(), sup.clone()), (inverse(sub), inverse(sup))] {
            self.properties.entry(sub.clone()).or_default().push(sup.clone());
            self.subproperties.entry(sup).or_default().push(sub);
        }
    }

    /// The conditions that include a restriction.
    fn including(
        &self,
        restriction: &ClassExpression,
        depth: usize,
        known: &mut Known,
    ) -> BTreeSet<ClassExpression> {
        let Some((property, filler)) = parts(restriction) else { return BTreeSet::new() };
        let key = (restriction.clone(), depth);
        if let Some(including) = known.including.get(&key) {
            return including.clone();
        }
        let is_universal = matches!(restriction, ClassExpression::AllValuesFrom(..));
        let related = if is_universal { &self.subproperties } else { &self.properties };
        let mut properties = reachable(property, related);
        properties.retain(|property| self.used.contains(property));
        if properties.is_empty() {
            return BTreeSet::new();
        }
        let fillers = self.supers(filler, depth, known);
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
        known.including.insert(key, including.clone());
        including
    }

    /// The classes that include a class, itself among them.
    fn supers(&self, class: &ClassExpression, depth: usize, known: &mut Known) -> BTreeSet<ClassExpression> {
        let key = (class.clone(), depth);
        if let Some(supers) = known.supers.get(&key) {
            return supers.clone();
        }
        let mut found = BTreeSet::from([class.clone(), self.thing.clone()]);
        let mut open = vec![class.clone()];
        while let Some(class) = open.pop() {
            let mut next: Vec<ClassExpression> =
                self.classes.get(&class).into_iter().flatten().cloned().collect();
            if let ClassExpression::IntersectionOf(members) = &class {
                next.extend(members.iter().cloned());
            }
            if let Some(restriction) = restriction(&class, true).filter(|_| depth > 0) {
                next.extend(self.including(&restriction, depth - 1, known));
            }
            open.extend(next.into_iter().filter(|sup| found.insert(sup.clone())));
        }
        known.supers.insert(key, found.clone());
        found
    }
}

/// The property and the filler of a restriction.
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

/// A property and all properties that edges lead to from there.
fn reachable(from: &Property, edges: &HashMap<Property, Vec<Property>>) -> BTreeSet<Property> {
    let mut found = BTreeSet::from([from.clone()]);
    let mut open = vec![from];
    while let Some(property) = open.pop() {
        let next = edges.get(property).into_iter().flatten();
        open.extend(next.filter(|next| found.insert((*next).clone())));
    }
    found
}
