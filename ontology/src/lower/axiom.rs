//! Lowers axioms to rules, following the tables of OWL 2 RL, and assertions to facts.

use rules::{Atom, RuleIdentity, Term};

use super::class;
use super::context::{Conjunction, Context, Variables, cross, identity};
use super::groups;
use super::range;
use crate::error::Warning;
use crate::owl::{
    AnnotatedAxiom, Axiom, Characteristic, ClassExpression, DataRange, EntityKind, Iri,
    ObjectPropertyExpression as Property,
};
use crate::vocab::owl;

/// Result of lowering an axiom. The error is the reason why the axiom, or a part of it, has no rule form.
type LoweringResult = Result<(), &'static str>;

/// Adds the rules of the axioms, except assertions of named classes and properties, and datatype definitions. Adds a
/// warning for each axiom without a complete rule form and, if there are any, one summary warning.
pub(crate) fn lower_rules(axioms: &[AnnotatedAxiom], context: &mut Context) {
    let mut outside = 0;
    for (position, annotated) in axioms.iter().enumerate() {
        let axiom = &annotated.axiom;
        if is_assertion(axiom) {
            continue;
        }
        // An axiom is used in part if it has rules in spite of its gaps.
        let before = context.rules.len();
        let mut lowering = AxiomLowering { identity: identity(axiom, position), context };
        let result = lowering.axiom(axiom);
        if let Err(reason) = context.take_gaps().and(result) {
            let partly = context.rules.len() > before;
            context.outside(axiom, partly, reason);
            outside += 1;
        }
    }
    if outside > 0 {
        context.warnings.push(Warning::Profile { outside, axioms: axioms.len() });
    }
}

pub(crate) fn lower_assertions(axioms: &[AnnotatedAxiom], context: &mut Context) {
    for annotated in axioms {
        assertion(context, &annotated.axiom);
    }
}

fn is_assertion(axiom: &Axiom) -> bool {
    matches!(
        axiom,
        Axiom::ClassAssertion(ClassExpression::Class(_), _)
            | Axiom::ObjectPropertyAssertion(..)
            | Axiom::DataPropertyAssertion(..)
            | Axiom::DatatypeDefinition(..)
    )
}

/// Adds the facts of an assertion about named classes and properties, `sameAs` or `differentFrom`. Ignores
/// other axioms, and membership in `owl:Thing`.
fn assertion(context: &mut Context, axiom: &Axiom) {
    match axiom {
        // `vocabulary` adds the facts of `owl:Thing` if something depends on them.
        Axiom::ClassAssertion(ClassExpression::Class(class), individual) if &**class != owl::THING => {
            let (class, individual) = (context.iri(class), context.iri(individual));
            context.state(class, [individual]);
        }
        Axiom::ObjectPropertyAssertion(property, from, to) => {
            let (from, to) = (context.iri(from), context.iri(to));
            match property {
                Property::Property(iri) => {
                    let property = context.iri(iri);
                    context.state(property, [from, to]);
                }
                Property::Inverse(iri) => {
                    let property = context.iri(iri);
                    context.state(property, [to, from]);
                }
            }
        }
        Axiom::DataPropertyAssertion(property, from, to) => {
            let (property, from, to) = (context.iri(property), context.iri(from), context.literal(to));
            if context.symbols.value(to).as_literal().is_some_and(rules::Literal::exceeds_limits) {
                context.outside(axiom, true, "a value beyond the limits of the program");
            }
            context.state(property, [from, to]);
        }
        Axiom::SameIndividual(individuals) => {
            let same_as = context.name(owl::SAME_AS);
            // Neighbours are sufficient, because `sameAs` is transitive.
            for pair in individuals.windows(2) {
                let (first, second) = (context.name(&pair[0]), context.name(&pair[1]));
                context.state(same_as, [first, second]);
            }
        }
        Axiom::DifferentIndividuals(individuals) if individuals.len() > groups::MAX_PAIRED_MEMBERS => {
            let member = groups::relation(context, &axiom.to_string());
            for (index, individual) in individuals.iter().enumerate() {
                let (individual, number) = (context.name(individual), groups::number(context, index));
                context.state(member, [individual, number]);
            }
        }
        Axiom::DifferentIndividuals(individuals) => {
            let different_from = context.name(owl::DIFFERENT_FROM);
            for (index, first) in individuals.iter().enumerate() {
                for second in &individuals[index + 1..] {
                    let (first, second) = (context.name(first), context.name(second));
                    context.state(different_from, [first, second]);
                }
            }
        }
        _ => {}
    }
}

struct AxiomLowering<'c, 'a> {
    identity: RuleIdentity,
    context: &'c mut Context<'a>,
}

impl AxiomLowering<'_, '_> {
    fn rule(&mut self, body: Conjunction, head: Vec<Atom>, variables: &Variables) {
        self.context.rule(&self.identity, head, body, variables);
    }

    fn axiom(&mut self, axiom: &Axiom) -> LoweringResult {
        match axiom {
            Axiom::SubClassOf(sub, sup) => {
                self.sub_class(sub, sup);
                Ok(())
            }
            Axiom::EquivalentClasses(classes) => {
                self.equivalent_classes(classes);
                Ok(())
            }
            Axiom::DisjointClasses(classes) => {
                self.disjoint_classes(classes, &axiom.to_string());
                Ok(())
            }
            Axiom::SameIndividual(entities) => {
                self.same_entities(entities);
                Ok(())
            }
            Axiom::DifferentIndividuals(individuals) => {
                if individuals.len() > groups::MAX_PAIRED_MEMBERS {
                    let member = groups::relation(self.context, &axiom.to_string());
                    groups::forbid(self.context, &self.identity, member);
                }
                Ok(())
            }
            Axiom::DisjointUnion(class, parts) => self.disjoint_union(class, parts),
            Axiom::ClassAssertion(class, individual) => {
                let x = self.context.constant(individual);
                let mut variables = Variables::default();
                let conclusions = class::conclusions(self.context, class, x, &mut variables);
                for (body, head) in conclusions {
                    self.rule(body, head, &variables);
                }
                Ok(())
            }
            Axiom::HasKey(class, objects, data) => {
                self.key(class, objects, data);
                Ok(())
            }
            Axiom::ObjectPropertyCharacteristic(characteristic, property) => {
                self.characteristic(*characteristic, property);
                Ok(())
            }
            Axiom::NegativeObjectPropertyAssertion(property, from, to) => {
                let (from, to) = (self.context.constant(from), self.context.constant(to));
                let atom = self.context.property(property, from, to);
                self.rule(vec![atom], Vec::new(), &Variables::default());
                Ok(())
            }
            Axiom::NegativeDataPropertyAssertion(property, from, to) => {
                let (from, to) = (self.context.constant(from), Term::Constant(self.context.literal(to)));
                let atom = self.context.relation(property, [from, to]);
                self.rule(vec![atom], Vec::new(), &Variables::default());
                Ok(())
            }
            _ => self.properties(axiom),
        }
    }

    fn properties(&mut self, axiom: &Axiom) -> LoweringResult {
        let data = |iris: &[Iri]| -> Vec<Property> { iris.iter().cloned().map(Property::Property).collect() };
        let named = |iri: &Iri| Property::Property(iri.clone());
        match axiom {
            Axiom::SubObjectPropertyOf(sub, sup) => self.sub_property(sub, sup),
            Axiom::SubDataPropertyOf(sub, sup) => self.sub_property(&named(sub), &named(sup)),
            Axiom::SubPropertyChainOf(chain, sup) => self.chain(chain, sup),
            Axiom::EquivalentObjectProperties(properties) => self.equivalent_properties(properties),
            Axiom::EquivalentDataProperties(properties) => self.equivalent_properties(&data(properties)),
            Axiom::DisjointObjectProperties(properties) => self.disjoint_properties(properties),
            Axiom::DisjointDataProperties(properties) => self.disjoint_properties(&data(properties)),
            // `first` is equivalent to the inverse of `second`.
            Axiom::InverseObjectProperties(first, second) => {
                let inverse = Property::Inverse(second.clone());
                self.equivalent_properties(&[named(first), inverse]);
            }
            Axiom::ObjectPropertyDomain(property, class) => self.domain_or_range(property, class, true),
            Axiom::ObjectPropertyRange(property, class) => self.domain_or_range(property, class, false),
            Axiom::DataPropertyDomain(property, class) => self.domain_or_range(&named(property), class, true),
            Axiom::DataPropertyRange(property, range) => return self.data_range(property, range),
            Axiom::FunctionalDataProperty(property) => {
                let mut v = Variables::default();
                let (x, y, z) = (v.fresh("x"), v.fresh("y"), v.fresh("z"));
                let first = self.context.relation(property, [x, y]);
                let second = self.context.relation(property, [x, z]);
                self.rule(vec![first, second, Atom::Different(y, z)], Vec::new(), &v);
            }
            _ => return Err("no rule form"),
        }
        Ok(())
    }

    fn sub_class(&mut self, sub: &ClassExpression, sup: &ClassExpression) {
        let mut variables = Variables::default();
        let x = variables.fresh("x");
        let bodies = class::condition(self.context, sub, x, &mut variables);
        let conclusions = class::conclusions(self.context, sup, x, &mut variables);
        for body in &bodies {
            for (conditions, head) in &conclusions {
                let mut body: Conjunction = body.iter().chain(conditions).cloned().collect();
                // A contradiction without a condition (`Thing ⊑ Nothing`) needs no individual. Any other conclusion
                // is about `x`, which the body has to bind. A difference binds no variable.
                let is_open = body.iter().all(|atom| matches!(atom, Atom::Different(..)));
                if is_open && !(body.is_empty() && head.is_empty()) {
                    body.push(self.context.thing(x));
                }
                self.rule(body, head.clone(), &variables);
            }
        }
    }

    fn equivalent_classes(&mut self, classes: &[ClassExpression]) {
        for (sub, sup) in classes.iter().zip(classes.iter().cycle().skip(1)) {
            self.sub_class(sub, sup);
        }
    }

    fn disjoint_classes(&mut self, classes: &[ClassExpression], axiom: &str) {
        if classes.len() > groups::MAX_PAIRED_MEMBERS {
            // Linear in the number of classes; pairs would be quadratic.
            let member = groups::relation(self.context, axiom);
            for (index, class) in classes.iter().enumerate() {
                let mut variables = Variables::default();
                let x = variables.fresh("x");
                let number = Term::Constant(groups::number(self.context, index));
                for body in class::condition(self.context, class, x, &mut variables) {
                    self.rule(body, vec![Atom::relation(member, [x, number])], &variables);
                }
            }
            groups::forbid(self.context, &self.identity, member);
            return;
        }
        for (index, first) in classes.iter().enumerate() {
            for second in &classes[index + 1..] {
                let mut variables = Variables::default();
                let x = variables.fresh("x");
                let left = class::brief_condition(self.context, first, x, &mut variables);
                let right = class::brief_condition(self.context, second, x, &mut variables);
                for body in cross(&left, &right) {
                    self.rule(body, Vec::new(), &variables);
                }
            }
        }
    }

    /// Adds rules by which classes, or properties, that are stated to be the same individual have the
    /// same members (rule eq-rep of OWL 2 RL).
    fn same_entities(&mut self, entities: &[Iri]) {
        let any_is = |context: &Context, kind| entities.iter().any(|iri| context.is(kind, iri));
        let named = |iri: &Iri| Property::Property(iri.clone());
        if any_is(self.context, EntityKind::Class) {
            let classes: Vec<_> = entities.iter().cloned().map(ClassExpression::Class).collect();
            self.equivalent_classes(&classes);
        }
        if any_is(self.context, EntityKind::ObjectProperty) || any_is(self.context, EntityKind::DataProperty)
        {
            self.equivalent_properties(&entities.iter().map(named).collect::<Vec<_>>());
        }
    }

    fn disjoint_union(&mut self, class: &Iri, parts: &[ClassExpression]) -> LoweringResult {
        let text = Axiom::DisjointUnion(class.clone(), parts.to_vec()).to_string();
        let class = ClassExpression::Class(class.clone());
        for part in parts {
            self.sub_class(part, &class);
        }
        // Disjointness and inclusion are lowered; covering would be a disjunctive conclusion.
        self.disjoint_classes(parts, &text);
        Err("that the parts cover the class")
    }

    /// Adds the rules of a key axiom: two members of the class with equal values of all key properties are
    /// the same individual (rule prp-key).
    fn key(&mut self, class: &ClassExpression, objects: &[Property], data: &[Iri]) {
        let mut variables = Variables::default();
        let (x, y) = (variables.fresh("x"), variables.fresh("y"));
        let left = class::brief_condition(self.context, class, x, &mut variables);
        let right = class::brief_condition(self.context, class, y, &mut variables);
        let mut keys = Vec::new();
        for property in objects {
            let value = variables.fresh("v");
            keys.extend([x, y].map(|end| self.context.property(property, end, value)));
        }
        for property in data {
            let value = variables.fresh("v");
            keys.extend([x, y].map(|end| self.context.relation(property, [end, value])));
        }
        for body in cross(&cross(&left, &right), &[keys]) {
            self.context.merge(&self.identity, [x, y], body, &variables);
        }
    }

    fn sub_property(&mut self, sub: &Property, sup: &Property) {
        let mut variables = Variables::default();
        let (x, y) = (variables.fresh("x"), variables.fresh("y"));
        let (Property::Property(name) | Property::Inverse(name)) = sup;
        // Everything is included in the top properties.
        if ![owl::TOP_OBJECT_PROPERTY, owl::TOP_DATA_PROPERTY].contains(&&**name) {
            let body = self.context.property(sub, x, y);
            let head = self.context.property(sup, x, y);
            self.rule(vec![body], vec![head], &variables);
        }
    }

    fn equivalent_properties(&mut self, properties: &[Property]) {
        for (sub, sup) in properties.iter().zip(properties.iter().cycle().skip(1)) {
            self.sub_property(sub, sup);
        }
    }

    fn chain(&mut self, chain: &[Property], sup: &Property) {
        let mut variables = Variables::default();
        let first = variables.fresh("x");
        let (mut body, mut end) = (Vec::new(), first);
        for link in chain {
            let next = variables.fresh("y");
            body.push(self.context.property(link, end, next));
            end = next;
        }
        let head = self.context.property(sup, first, end);
        self.rule(body, vec![head], &variables);
    }

    fn disjoint_properties(&mut self, properties: &[Property]) {
        let mut variables = Variables::default();
        let (x, y) = (variables.fresh("x"), variables.fresh("y"));
        for (index, first) in properties.iter().enumerate() {
            for second in &properties[index + 1..] {
                let body = vec![self.context.property(first, x, y), self.context.property(second, x, y)];
                self.rule(body, Vec::new(), &variables);
            }
        }
    }

    /// Lowers the domain axiom of a property if `subject` is `true`, otherwise its range axiom.
    fn domain_or_range(&mut self, property: &Property, class: &ClassExpression, subject: bool) {
        let mut variables = Variables::default();
        let (x, y) = (variables.fresh("x"), variables.fresh("y"));
        // A top property relates all individuals, so its domain or range applies to every individual.
        let (Property::Property(name) | Property::Inverse(name)) = property;
        let is_top = [owl::TOP_OBJECT_PROPERTY, owl::TOP_DATA_PROPERTY].contains(&&**name);
        let end = if subject { x } else { y };
        let edge = if is_top { self.context.thing(end) } else { self.context.property(property, x, y) };
        for (conditions, head) in class::conclusions(self.context, class, end, &mut variables) {
            let body = std::iter::once(edge.clone()).chain(conditions).collect();
            self.rule(body, head, &variables);
        }
    }

    fn data_range(&mut self, property: &Iri, range: &DataRange) -> LoweringResult {
        let mut variables = Variables::default();
        let (x, value) = (variables.fresh("x"), variables.fresh("v"));
        let edge = self.context.relation(property, [x, value]);
        for body in range::violations(self.context, range, &[edge], value)? {
            self.rule(body, Vec::new(), &variables);
        }
        Ok(())
    }

    fn characteristic(&mut self, characteristic: Characteristic, property: &Property) {
        let mut v = Variables::default();
        let (x, y) = (v.fresh("x"), v.fresh("y"));
        let mut edge = |first, second| self.context.property(property, first, second);
        let (body, head) = match characteristic {
            Characteristic::Functional | Characteristic::InverseFunctional => {
                let z = v.fresh("z");
                let functional = characteristic == Characteristic::Functional;
                let pair = if functional { [edge(x, y), edge(x, z)] } else { [edge(y, x), edge(z, x)] };
                self.context.merge(&self.identity, [y, z], pair.to_vec(), &v);
                return;
            }
            Characteristic::Irreflexive => (vec![edge(x, x)], Vec::new()),
            Characteristic::Symmetric => (vec![edge(x, y)], vec![edge(y, x)]),
            Characteristic::Asymmetric => (vec![edge(x, y), edge(y, x)], Vec::new()),
            Characteristic::Transitive => {
                let z = v.fresh("z");
                (vec![edge(x, y), edge(y, z)], vec![edge(x, z)])
            }
            Characteristic::Reflexive => {
                let head = edge(x, x);
                (vec![self.context.thing(x)], vec![head])
            }
        };
        self.rule(body, head, &v);
    }
}
