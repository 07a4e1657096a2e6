//! Syntax tree to lifted task: names become ids, quantifiers are expanded over the objects of their type,
//! negation moves inwards to the atoms, and the two times of durative conditions and effects are sorted apart.
//!
//! The files have passed `pddl::check`; what the planner does not handle yet (conditional effects, derived
//! predicates, timed initial literals, duration inequalities) is refused here, with its place.

mod objects;

use num_rational::BigRational;
use num_traits::ToPrimitive;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::error::{Error, File, Place};
use crate::lifted::{
    Effect, Expression, Formula, Function, FunctionId, Lifted, Metric, ObjectId, Parameter, Predicate,
    PredicateId, Rational, Schema, Term,
};
use crate::pddl::ast::{self, ConditionTime, EffectTime, Identifier, Name, Span, TypedName};

/// Resolves and simplifies a domain and a problem.
///
/// # Errors
/// All constructs that the planner does not handle, and all names that are declared nowhere.
pub(crate) fn normalize(domain: &ast::Domain, problem: &ast::Problem) -> Result<Lifted, Vec<Error>> {
    let mut normalizer = Normalizer::new(domain, problem);
    let schemas = domain.actions.iter().map(|action| normalizer.schema(action)).collect();
    for axiom in &domain.derived {
        normalizer.unsupported(
            "a derived predicate",
            "the same condition written into the actions",
            File::Domain,
            axiom.span,
        );
    }
    let (facts, values) = normalizer.initial_state(problem);
    let goal = normalizer.condition(&problem.goal, true, &mut Scope::new(File::Problem));
    let metric = problem.metric.as_ref().map(|metric| Metric {
        direction: metric.direction,
        expression: normalizer.expression(&metric.expression, &mut Scope::new(File::Problem)),
        place: Place { file: File::Problem, span: metric.span },
    });
    if !normalizer.errors.is_empty() {
        return Err(normalizer.errors);
    }
    let mut lifted = Lifted {
        objects: normalizer.objects,
        predicates: normalizer.predicates,
        functions: normalizer.functions,
        schemas,
        facts,
        values,
        goal,
        metric,
    };
    mark_fluents(&mut lifted);
    Ok(lifted)
}

/// A predicate or function is a fluent if some action changes it.
fn mark_fluents(lifted: &mut Lifted) {
    for effect in
        lifted.schemas.iter().flat_map(|schema| schema.start_effects.iter().chain(&schema.end_effects))
    {
        match effect {
            Effect::Add(predicate, _) | Effect::Delete(predicate, _) => {
                lifted.predicates[predicate.index()].fluent = true;
            }
            Effect::Assign { function, .. } => lifted.functions[function.index()].fluent = true,
        }
    }
}

/// The variables in sight, each with what it stands for, and the file that is read.
struct Scope {
    file: File,
    variables: Vec<(Name, Term)>,
    /// What `?duration` stands for.
    duration: Option<Expression>,
}

impl Scope {
    fn new(file: File) -> Self {
        Self { file, variables: Vec::new(), duration: None }
    }

    fn place(&self, span: Span) -> Place {
        Place { file: self.file, span }
    }
}

struct Normalizer {
    objects: Vec<Name>,
    object_ids: FxHashMap<Name, ObjectId>,
    /// Objects of each type, ascending, subtypes included.
    members: FxHashMap<Name, Vec<ObjectId>>,
    predicates: Vec<Predicate>,
    predicate_ids: FxHashMap<Name, PredicateId>,
    functions: Vec<Function>,
    function_ids: FxHashMap<Name, FunctionId>,
    errors: Vec<Error>,
}

impl Normalizer {
    fn new(domain: &ast::Domain, problem: &ast::Problem) -> Self {
        let predicates: Vec<_> = domain
            .predicates
            .iter()
            .map(|declared| Predicate {
                name: declared.identifier.name.clone(),
                arity: declared.parameters.len(),
                fluent: false,
            })
            .collect();
        let mut functions: Vec<_> = domain
            .functions
            .iter()
            .map(|declared| Function { name: declared.identifier.name.clone(), fluent: false })
            .collect();
        let total_cost = Name::new("total-cost");
        if functions.iter().all(|function| function.name != total_cost) {
            functions.push(Function { name: total_cost, fluent: false });
        }
        let predicate_ids =
            predicates.iter().zip(0..).map(|(p, id)| (p.name.clone(), PredicateId(id))).collect();
        let function_ids =
            functions.iter().zip(0..).map(|(f, id)| (f.name.clone(), FunctionId(id))).collect();
        let mut normalizer = Self {
            objects: Vec::new(),
            object_ids: FxHashMap::default(),
            members: FxHashMap::default(),
            predicates,
            predicate_ids,
            functions,
            function_ids,
            errors: Vec::new(),
        };
        normalizer.declare_objects(domain, problem);
        normalizer
    }

    fn unsupported(&mut self, construct: &str, instead: &str, file: File, span: Span) {
        self.errors.push(Error::Unsupported {
            construct: construct.into(),
            instead: instead.into(),
            place: Place { file, span },
        });
    }

    fn unknown(&mut self, kind: &'static str, identifier: &Identifier, file: File) {
        let place = Place { file, span: identifier.span };
        self.errors.push(Error::Unknown { kind, name: identifier.name.to_string(), place });
    }

    fn schema(&mut self, action: &ast::Action) -> Schema {
        let mut scope = Scope::new(File::Domain);
        let mut parameters = Vec::new();
        for (parameter, index) in action.parameters.iter().zip(0..) {
            scope.variables.push((parameter.identifier.name.clone(), Term::Parameter(index)));
            parameters.push(Parameter { candidates: self.candidates(&parameter.r#type) });
        }
        let mut schema = Schema {
            name: action.identifier.name.clone(),
            parameters,
            start_condition: Formula::truth(),
            start_effects: Vec::new(),
            middle_condition: Formula::truth(),
            end_effects: Vec::new(),
            duration: None,
        };
        match &action.body {
            ast::ActionBody::Instantaneous { precondition, effect } => {
                schema.start_condition = self.condition(precondition, true, &mut scope);
                self.effect(effect, &mut scope, &mut schema.end_effects);
            }
            ast::ActionBody::Durative { duration, conditions, effects } => {
                schema.duration = Some(self.duration(duration, action, &mut scope));
                scope.duration.clone_from(&schema.duration);
                let (mut start, mut middle) = (Vec::new(), Vec::new());
                for (time, condition) in conditions {
                    let formula = self.condition(condition, true, &mut scope);
                    if *time == ConditionTime::AtStart { &mut start } else { &mut middle }.push(formula);
                }
                (schema.start_condition, schema.middle_condition) =
                    (Formula::And(start), Formula::And(middle));
                for (time, effect) in effects {
                    let target = match time {
                        EffectTime::AtStart => &mut schema.start_effects,
                        EffectTime::AtEnd => &mut schema.end_effects,
                    };
                    self.effect(effect, &mut scope, target);
                }
            }
        }
        schema
    }

    fn duration(
        &mut self,
        bounds: &[ast::DurationConstraint],
        action: &ast::Action,
        scope: &mut Scope,
    ) -> Expression {
        if let [bound] = bounds
            && bound.operator == ast::Comparison::Equal
            && bound.time == EffectTime::AtStart
        {
            return self.expression(&bound.expression, scope);
        }
        let span = bounds.first().map_or(action.span, |bound| bound.span);
        self.unsupported(
            "a duration that is not fixed at the start",
            "one `(= ?duration …)`",
            File::Domain,
            span,
        );
        Expression::Number(Rational::from_integer(0))
    }

    fn condition(&mut self, condition: &ast::Condition, positive: bool, scope: &mut Scope) -> Formula {
        use ast::Condition as C;
        let all = |parts| if positive { Formula::And(parts) } else { Formula::Or(parts) };
        let any = |parts| if positive { Formula::Or(parts) } else { Formula::And(parts) };
        match condition {
            C::And(parts) => all(parts.iter().map(|part| self.condition(part, positive, scope)).collect()),
            C::Or(parts) => any(parts.iter().map(|part| self.condition(part, positive, scope)).collect()),
            C::Not(inner) => self.condition(inner, !positive, scope),
            C::Imply(premise, conclusion) => any(vec![
                self.condition(premise, !positive, scope),
                self.condition(conclusion, positive, scope),
            ]),
            C::ForAll(variables, body) => {
                all(self.expand(variables, scope, &mut |this, scope| this.condition(body, positive, scope)))
            }
            C::Exists(variables, body) => {
                any(self.expand(variables, scope, &mut |this, scope| this.condition(body, positive, scope)))
            }
            C::Atom(atom) => {
                let predicate = self.predicate(atom, scope.file);
                Formula::Literal { positive, predicate, terms: self.terms(atom, scope) }
            }
            C::Equal(left, right, _) => {
                Formula::Equal { positive, left: self.term(left, scope), right: self.term(right, scope) }
            }
            C::Compare(comparison, left, right, span) => {
                self.comparison(*comparison, left, right, *span, positive, scope)
            }
        }
    }

    fn comparison(
        &mut self,
        comparison: ast::Comparison,
        left: &ast::Expression,
        right: &ast::Expression,
        span: Span,
        positive: bool,
        scope: &mut Scope,
    ) -> Formula {
        use ast::Comparison as Op;
        let (left, right) = (self.expression(left, scope), self.expression(right, scope));
        let place = scope.place(span);
        let negated = match comparison {
            _ if positive => comparison,
            Op::Less => Op::GreaterOrEqual,
            Op::LessOrEqual => Op::Greater,
            Op::GreaterOrEqual => Op::Less,
            Op::Greater => Op::LessOrEqual,
            Op::Equal => {
                let less = Formula::Compare(Op::Less, left.clone(), right.clone(), place);
                return Formula::Or(vec![less, Formula::Compare(Op::Greater, left, right, place)]);
            }
        };
        Formula::Compare(negated, left, right, place)
    }

    /// What `each` makes of every assignment of objects to the variables.
    fn expand<T>(
        &mut self,
        variables: &[TypedName],
        scope: &mut Scope,
        each: &mut dyn FnMut(&mut Self, &mut Scope) -> T,
    ) -> Vec<T> {
        let Some((first, rest)) = variables.split_first() else {
            return vec![each(self, scope)];
        };
        let mut all = Vec::new();
        for object in self.candidates(&first.r#type) {
            scope.variables.push((first.identifier.name.clone(), Term::Object(object)));
            all.extend(self.expand(rest, scope, each));
            scope.variables.pop();
        }
        all
    }

    fn effect(&mut self, effect: &ast::Effect, scope: &mut Scope, out: &mut Vec<Effect>) {
        match effect {
            ast::Effect::And(parts) => parts.iter().for_each(|part| self.effect(part, scope, out)),
            ast::Effect::Add(atom) => {
                let predicate = self.predicate(atom, scope.file);
                out.push(Effect::Add(predicate, self.terms(atom, scope)));
            }
            ast::Effect::Delete(atom) => {
                let predicate = self.predicate(atom, scope.file);
                out.push(Effect::Delete(predicate, self.terms(atom, scope)));
            }
            ast::Effect::ForAll(variables, body) => {
                let parts = self.expand(variables, scope, &mut |this, scope| {
                    let mut parts = Vec::new();
                    this.effect(body, scope, &mut parts);
                    parts
                });
                out.extend(parts.into_iter().flatten());
            }
            ast::Effect::When(_, inner) => {
                let span = effect_span(inner);
                self.unsupported("a conditional effect", "one action for each case", scope.file, span);
            }
            ast::Effect::Assign(assignment, atom, expression, span) => {
                let function = self.function(atom, scope.file);
                let terms = self.terms(atom, scope);
                let expression = self.expression(expression, scope);
                out.push(Effect::Assign {
                    assignment: *assignment,
                    function,
                    terms,
                    expression,
                    place: scope.place(*span),
                });
            }
        }
    }

    fn expression(&mut self, expression: &ast::Expression, scope: &mut Scope) -> Expression {
        use ast::Arithmetic as Op;
        match expression {
            ast::Expression::Number(number, span) => {
                Expression::Number(self.number(number, scope.place(*span)))
            }
            ast::Expression::Fluent(atom) => {
                let function = self.function(atom, scope.file);
                Expression::Function(function, self.terms(atom, scope), scope.place(atom.span))
            }
            ast::Expression::Duration(span) => scope.duration.clone().unwrap_or_else(|| {
                self.unsupported(
                    "`?duration`",
                    "a number: the action has no duration here",
                    scope.file,
                    *span,
                );
                Expression::Number(Rational::from_integer(0))
            }),
            ast::Expression::TotalTime(_) => Expression::TotalTime,
            ast::Expression::Operation(op, operands, span) => {
                let place = scope.place(*span);
                let mut operands: Vec<_> =
                    operands.iter().map(|operand| self.expression(operand, scope)).collect();
                match op {
                    Op::Add => Expression::Sum(operands),
                    Op::Multiply => Expression::Product(operands, place),
                    Op::Subtract => {
                        let negated = operands.split_off(usize::from(operands.len() > 1));
                        operands
                            .extend(negated.into_iter().map(|operand| Expression::Negate(Box::new(operand))));
                        Expression::Sum(operands)
                    }
                    Op::Divide => operands
                        .into_iter()
                        .reduce(|left, right| Expression::Quotient(Box::new(left), Box::new(right), place))
                        .unwrap_or(Expression::Sum(Vec::new())),
                }
            }
        }
    }

    fn number(&mut self, number: &BigRational, place: Place) -> Rational {
        if let (Some(numerator), Some(denominator)) = (number.numer().to_i128(), number.denom().to_i128()) {
            return Rational::new(numerator, denominator);
        }
        self.unsupported("a number of more than 38 digits", "a shorter one", place.file, place.span);
        Rational::from_integer(0)
    }

    fn predicate(&mut self, atom: &ast::Atom, file: File) -> PredicateId {
        self.predicate_ids.get(&atom.predicate.name).copied().unwrap_or_else(|| {
            self.unknown("predicate", &atom.predicate, file);
            PredicateId(0)
        })
    }

    fn function(&mut self, atom: &ast::Atom, file: File) -> FunctionId {
        self.function_ids.get(&atom.predicate.name).copied().unwrap_or_else(|| {
            self.unknown("function", &atom.predicate, file);
            FunctionId(0)
        })
    }

    fn terms(&mut self, atom: &ast::Atom, scope: &mut Scope) -> Vec<Term> {
        atom.arguments.iter().map(|term| self.term(term, scope)).collect()
    }

    fn term(&mut self, term: &ast::Term, scope: &mut Scope) -> Term {
        let (kind, identifier, found) = match term {
            ast::Term::Variable(identifier) => {
                let found = scope.variables.iter().rev().find(|(name, _)| *name == identifier.name);
                ("variable", identifier, found.map(|(_, term)| *term))
            }
            ast::Term::Constant(identifier) => {
                let found = self.object_ids.get(&identifier.name);
                ("object", identifier, found.map(|object| Term::Object(*object)))
            }
        };
        found.unwrap_or_else(|| {
            self.unknown(kind, identifier, scope.file);
            Term::Object(ObjectId(0))
        })
    }

    #[allow(clippy::type_complexity)]
    fn initial_state(
        &mut self,
        problem: &ast::Problem,
    ) -> (Vec<(PredicateId, Box<[ObjectId]>)>, Vec<(FunctionId, Box<[ObjectId]>, Rational)>) {
        let (mut facts, mut values) = (Vec::new(), Vec::new());
        let mut seen = FxHashSet::default();
        for element in &problem.init {
            match element {
                ast::InitialElement::Fact(atom) => {
                    let fact = (self.predicate(atom, File::Problem), self.objects(atom));
                    if seen.insert(fact.clone()) {
                        facts.push(fact);
                    }
                }
                ast::InitialElement::NegatedFact(_) => {}
                ast::InitialElement::Value(atom, number, span) => {
                    let number = self.number(number, Place { file: File::Problem, span: *span });
                    values.push((self.function(atom, File::Problem), self.objects(atom), number));
                }
                ast::InitialElement::Timed(_, _, _, span) => {
                    self.unsupported(
                        "a timed initial literal",
                        "a fact that holds from the start",
                        File::Problem,
                        *span,
                    );
                }
            }
        }
        (facts, values)
    }

    fn objects(&mut self, atom: &ast::Atom) -> Box<[ObjectId]> {
        let terms = self.terms(atom, &mut Scope::new(File::Problem));
        terms
            .iter()
            .filter_map(|term| if let Term::Object(object) = term { Some(*object) } else { None })
            .collect()
    }
}

/// Where an effect stands: the span of the first atom in it.
fn effect_span(effect: &ast::Effect) -> Span {
    match effect {
        ast::Effect::And(parts) => parts.first().map_or(Span::default(), effect_span),
        ast::Effect::Add(atom) | ast::Effect::Delete(atom) => atom.span,
        ast::Effect::ForAll(_, inner) | ast::Effect::When(_, inner) => effect_span(inner),
        ast::Effect::Assign(_, _, _, span) => *span,
    }
}
