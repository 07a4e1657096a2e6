//! Resolves names to ids: objects, predicates, functions, and variables in scope.

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::error::{Error, File, Place};
use crate::lifted::{
    Bound, Expression, Function, FunctionId, ObjectId, Parameter, Predicate, PredicateId, Term,
};
use crate::number::dense;
use pddl::ast::{self, Identifier, Name, Span, TypeExpression, TypedName};

pub(super) enum Duration {
    Instantaneous,
    Fixed(Expression),
    /// The duration is variable, and the planner takes its shortest or longest value. Conditions and effects must
    /// not depend on it.
    Open,
}

pub(super) struct Scope {
    pub(super) file: File,
    variables: Vec<Name>,
    /// Terms of each variable name in scope; the innermost declaration comes last.
    terms: FxHashMap<Name, Vec<Term>>,
    /// Number of parameters and quantified variables that already have a number, including those that are out of
    /// scope.
    pub(super) bound: u32,
    pub(super) duration: Duration,
}

impl Scope {
    pub(super) fn new(file: File) -> Self {
        let (variables, terms) = (Vec::new(), FxHashMap::default());
        Self { file, variables, terms, bound: 0, duration: Duration::Instantaneous }
    }

    pub(super) fn place(&self, span: Span) -> Place {
        Place { file: self.file, span }
    }

    fn push(&mut self, name: &Name, term: Term) {
        self.variables.push(name.clone());
        self.terms.entry(name.clone()).or_default().push(term);
    }

    pub(super) fn pop(&mut self, count: usize) {
        for name in self.variables.drain(self.variables.len().saturating_sub(count)..) {
            self.terms.get_mut(&name).map(Vec::pop);
        }
    }

    fn get(&self, name: &Name) -> Option<Term> {
        self.terms.get(name)?.last().copied()
    }
}

pub(super) struct Names {
    pub(super) objects: Vec<Name>,
    object_ids: FxHashMap<Name, ObjectId>,
    /// Objects of each type and its subtypes, in ascending order.
    members: FxHashMap<Name, Vec<ObjectId>>,
    pub(super) predicates: Vec<Predicate>,
    predicate_ids: FxHashMap<Name, PredicateId>,
    pub(super) functions: Vec<Function>,
    function_ids: FxHashMap<Name, FunctionId>,
    pub(super) is_free: bool,
    pub(super) errors: Vec<Error>,
}

impl Names {
    pub(super) fn new(domain: &ast::Domain, problem: &ast::Problem) -> Self {
        let predicates: Vec<_> = domain
            .predicates
            .iter()
            .map(|declared| Predicate {
                name: declared.identifier.name.clone(),
                arity: declared.parameters.len(),
                fluent: false,
                derived: domain
                    .derived
                    .iter()
                    .any(|axiom| axiom.head.identifier.name == declared.identifier.name),
                running: false,
            })
            .collect();
        let mut functions: Vec<_> = domain
            .functions
            .iter()
            .map(|declared| Function {
                name: declared.identifier.name.clone(),
                fluent: false,
                partial: false,
            })
            .collect();
        let total_cost = Name::new("total-cost");
        if functions.iter().all(|function| function.name != total_cost) {
            functions.push(Function { name: total_cost, fluent: false, partial: false });
        }
        let predicate_ids =
            predicates.iter().zip(0..).map(|(p, id)| (p.name.clone(), PredicateId(id))).collect();
        let function_ids =
            functions.iter().zip(0..).map(|(f, id)| (f.name.clone(), FunctionId(id))).collect();
        let mut names = Self {
            objects: Vec::new(),
            object_ids: FxHashMap::default(),
            members: FxHashMap::default(),
            predicates,
            predicate_ids,
            functions,
            function_ids,
            is_free: false,
            errors: Vec::new(),
        };
        names.declare_objects(domain, problem);
        names
    }

    #[expect(clippy::arithmetic_side_effects, reason = "an object was pushed before")]
    fn declare_objects(&mut self, domain: &ast::Domain, problem: &ast::Problem) {
        let mut parents: FxHashMap<Name, Vec<Name>> = FxHashMap::default();
        for entry in &domain.types {
            let above = entry.r#type.alternatives.iter().map(|parent| parent.name.clone());
            parents.entry(entry.identifier.name.clone()).or_default().extend(above);
        }
        for entry in domain.constants.iter().chain(&problem.objects) {
            let name = &entry.identifier.name;
            let id = *self.object_ids.entry(name.clone()).or_insert_with(|| {
                self.objects.push(name.clone());
                ObjectId(dense(self.objects.len()) - 1)
            });
            let mut open: Vec<Name> = entry.r#type.alternatives.iter().map(|t| t.name.clone()).collect();
            open.push(Name::new("object"));
            let mut declared = FxHashSet::default();
            while let Some(name) = open.pop() {
                if declared.insert(name.clone()) {
                    open.extend(parents.get(&name).into_iter().flatten().cloned());
                    self.members.entry(name).or_default().push(id);
                }
            }
        }
        for members in self.members.values_mut() {
            members.sort_unstable();
            members.dedup();
        }
    }

    fn candidates(&self, expression: &TypeExpression) -> Arc<[ObjectId]> {
        let object = Identifier { name: Name::new("object"), span: Span::default() };
        let alternatives = if expression.alternatives.is_empty() {
            std::slice::from_ref(&object)
        } else {
            &expression.alternatives
        };
        let mut objects: Vec<_> =
            alternatives.iter().filter_map(|t| self.members.get(&t.name)).flatten().copied().collect();
        objects.sort_unstable();
        objects.dedup();
        objects.into()
    }

    pub(super) fn unsupported(&mut self, construct: &str, instead: &str, file: File, span: Span) {
        self.errors.push(Error::Unsupported {
            construct: construct.into(),
            instead: instead.into(),
            place: Place { file, span },
        });
    }

    pub(super) fn unknown(&mut self, kind: &'static str, identifier: &Identifier, file: File) {
        let place = Place { file, span: identifier.span };
        self.errors.push(Error::Unknown { kind, name: identifier.name.to_string(), place });
    }

    /// Adds quantified variables to the scope and returns them with their candidates. A variable whose type
    /// has a single object is replaced by the object and not returned.
    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(super) fn quantify(&mut self, variables: &[TypedName], scope: &mut Scope) -> Vec<Bound> {
        let mut bound_variables = Vec::new();
        for variable in variables {
            let candidates = self.candidates(&variable.r#type);
            if let [object] = candidates[..] {
                scope.push(&variable.identifier.name, Term::Object(object));
                continue;
            }
            scope.push(&variable.identifier.name, Term::Parameter(scope.bound));
            bound_variables.push(Bound { variable: scope.bound, candidates });
            scope.bound += 1;
        }
        bound_variables
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(super) fn bind(&mut self, variables: &[TypedName], scope: &mut Scope) -> Vec<Bound> {
        let mut parameters = Vec::with_capacity(variables.len());
        for variable in variables {
            let candidates = self.candidates(&variable.r#type);
            scope.push(&variable.identifier.name, Term::Parameter(scope.bound));
            parameters.push(Bound { variable: scope.bound, candidates });
            scope.bound += 1;
        }
        parameters
    }

    pub(super) fn parameters(&mut self, written: &[TypedName], scope: &mut Scope) -> Vec<Parameter> {
        let bound = self.bind(written, scope);
        bound.into_iter().map(|bound| Parameter { candidates: bound.candidates }).collect()
    }

    pub(super) fn predicate(&mut self, identifier: &Identifier, file: File) -> PredicateId {
        self.predicate_ids.get(&identifier.name).copied().unwrap_or_else(|| {
            self.unknown("predicate", identifier, file);
            PredicateId(0)
        })
    }

    pub(super) fn function(&mut self, identifier: &Identifier, file: File) -> FunctionId {
        self.function_ids.get(&identifier.name).copied().unwrap_or_else(|| {
            self.unknown("function", identifier, file);
            FunctionId(0)
        })
    }

    pub(super) fn terms(&mut self, atom: &ast::Atom, scope: &mut Scope) -> Vec<Term> {
        atom.arguments.iter().map(|term| self.term(term, scope)).collect()
    }

    pub(super) fn term(&mut self, term: &ast::Term, scope: &mut Scope) -> Term {
        let (kind, identifier, resolved) = match term {
            ast::Term::Variable(identifier) => ("variable", identifier, scope.get(&identifier.name)),
            ast::Term::Constant(identifier) => {
                let resolved = self.object_ids.get(&identifier.name);
                ("object", identifier, resolved.map(|object| Term::Object(*object)))
            }
        };
        resolved.unwrap_or_else(|| {
            self.unknown(kind, identifier, scope.file);
            Term::Object(ObjectId(0))
        })
    }
}
