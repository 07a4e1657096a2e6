//! Roles of objects and individuals: the classes within which names of the problem and of the
//! knowledge base are compared.
//!
//! A type of the domain that is bound to a class gives its objects the role of that class. If no type is bound to a
//! class, the role follows from facts whose predicates are bound. For example, if a fact states that a design solves a
//! function, its first argument is a design and its second one a function.

use std::collections::BTreeSet;

use ontology::tomasys::Individual;
use ontology::vocab::local_name;
use pddl::TypeHierarchy;
use pddl::ast::{Atom, Domain, InitialElement, Name, Problem, Span, Term, TypeExpression, TypedName};

use crate::binding::{Bindings, identifier};
use crate::knowledge::Knowledge;

pub(super) const FUNCTION: &str = "Function";
pub(super) const DESIGN: &str = "FunctionDesign";
pub(super) const ACTION: &str = "Action";
const COMPONENT: &str = "Component";

#[derive(Debug, Clone)]
pub(super) struct Object {
    pub(super) name: Name,
    pub(super) span: Span,
    pub(super) in_domain: bool,
}

#[derive(Debug)]
pub(super) struct Role {
    /// The local name of the class.
    pub(super) class: String,
    pub(super) types: TypeExpression,
    pub(super) individuals: Vec<Individual>,
    /// Objects with this role, each once.
    pub(super) objects: Vec<Object>,
}

#[derive(Debug)]
pub(super) struct Roles {
    roles: Vec<Role>,
}

impl Roles {
    pub(super) fn new(
        domain: &Domain,
        problem: &Problem,
        knowledge: &Knowledge,
        bindings: &Bindings,
    ) -> Self {
        let (view, catalogue) = (knowledge.view(), knowledge.catalogue());
        let individuals = |class: &str| match class {
            FUNCTION => view.functions(),
            DESIGN => catalogue.designs().iter().map(|design| design.individual.clone()).collect(),
            ACTION => catalogue.actions().iter().map(|action| action.individual.clone()).collect(),
            COMPONENT => view.components().into_iter().map(|component| component.individual).collect(),
            _ => Vec::new(),
        };
        let mut roles: Vec<Role> = [FUNCTION, DESIGN, ACTION, COMPONENT]
            .map(|class| Role {
                class: class.to_owned(),
                types: TypeExpression::default(),
                individuals: individuals(class),
                objects: Vec::new(),
            })
            .into();
        for declared in &domain.types {
            let name = &declared.identifier.name;
            let Some(class) = bindings.class(name) else { continue };
            let class_members = catalogue.members(&view, &class);
            let class = local_name(&class);
            let index = roles.iter().position(|role| role.class == class).unwrap_or_else(|| {
                let (class, types) = (class.to_owned(), TypeExpression::default());
                roles.push(Role { class, types, individuals: Vec::new(), objects: Vec::new() });
                roles.len() - 1
            });
            let role = &mut roles[index];
            let members: BTreeSet<Individual> =
                role.individuals.drain(..).chain(class_members.iter().cloned()).collect();
            role.individuals = members.into_iter().collect();
            role.types.alternatives.push(identifier(name));
        }
        let mut roles = Self { roles };
        roles.place(domain, problem);
        roles.place_by_facts(domain, problem, bindings);
        roles
    }

    pub(super) fn all(&self) -> &[Role] {
        &self.roles
    }

    pub(super) fn of(&self, class: &str) -> &Role {
        self.roles.iter().find(|role| role.class == class).expect("invariant: TOMASys' own roles are there")
    }

    fn place(&mut self, domain: &Domain, problem: &Problem) {
        let types = TypeHierarchy::of(domain);
        let constants = domain.constants.iter().map(|constant| (constant, true));
        for (object, in_domain) in constants.chain(problem.objects.iter().map(|object| (object, false))) {
            for role in &mut self.roles {
                if !role.types.alternatives.is_empty() && types.fits(&object.r#type, &role.types) {
                    role.add(object, in_domain);
                }
            }
        }
    }

    fn place_by_facts(&mut self, domain: &Domain, problem: &Problem, bindings: &Bindings) {
        let constants = domain.constants.iter().map(|constant| (constant, true));
        let declared: Vec<_> =
            constants.chain(problem.objects.iter().map(|object| (object, false))).collect();
        for (class, name) in facts(problem).flat_map(|atom| said(atom, bindings)) {
            let object = declared.iter().find(|(object, _)| object.identifier.name == *name);
            let index = self.roles.iter().position(|role| role.class == class);
            if let (Some((object, in_domain)), Some(index)) = (object, index)
                && self.roles[index].types.alternatives.is_empty()
            {
                self.roles[index].add(object, *in_domain);
            }
        }
    }
}

impl Role {
    fn add(&mut self, object: &TypedName, in_domain: bool) {
        let name = &object.identifier.name;
        if !self.has(name) {
            self.objects.push(Object { name: name.clone(), span: object.identifier.span, in_domain });
        }
    }

    pub(super) fn has(&self, name: &Name) -> bool {
        self.objects.iter().any(|object| object.name == *name)
    }

    pub(super) fn knows(&self, name: &Name) -> bool {
        self.individuals.iter().any(|individual| Name::new(&individual.name) == *name)
    }
}

pub(super) fn facts(problem: &Problem) -> impl Iterator<Item = &Atom> {
    problem.init.iter().filter_map(|element| match element {
        InitialElement::Fact(atom) => Some(atom),
        _ => None,
    })
}

pub(super) fn arguments(atom: &Atom) -> Vec<&Name> {
    let name = |term| match term {
        &Term::Constant(ref identifier) | &Term::Variable(ref identifier) => &identifier.name,
    };
    atom.arguments.iter().map(name).collect()
}

/// Returns the arguments of a fact to which its predicate assigns a class, each with this class.
fn said<'p>(atom: &'p Atom, bindings: &Bindings) -> Vec<(&'static str, &'p Name)> {
    let (predicate, arguments) = (&atom.predicate.name, arguments(atom));
    if bindings.solves().contains(predicate) && arguments.len() == 2 {
        return vec![(DESIGN, arguments[0]), (FUNCTION, arguments[1])];
    }
    if bindings.is_availability(predicate) && arguments.len() == 1 {
        return vec![(DESIGN, arguments[0])];
    }
    if bindings.is_requirement(predicate) && !arguments.is_empty() {
        let functions = arguments[1..].iter().map(|function| (FUNCTION, *function));
        return std::iter::once((ACTION, arguments[0])).chain(functions).collect();
    }
    Vec::new()
}
