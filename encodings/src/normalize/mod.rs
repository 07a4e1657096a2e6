//! Syntax tree to lifted task: names become ids, negation moves inwards to the atoms, and the two times of
//! durative conditions and effects are sorted apart.
//!
//! The files have passed `pddl::check`; what the planner does not handle (such as durations that effects depend on and
//! that are not fixed) is refused here, with its place.

mod condition;
pub(crate) mod duration;
pub(crate) mod events;
mod objects;
pub(crate) mod zero;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::configuration::{is_static, recursive_through_forall};
use crate::error::{Error, File, Place};
use crate::lifted::{
    Axiom, Change, Event, Expression, Formula, Function, FunctionId, Lifted, Metric, ObjectId, Parameter,
    Predicate, PredicateId, Rational, Schema, Term, Time,
};
use crate::number::dense;
use pddl::ast::{self, ConditionTime, EffectTime, Identifier, Name, Span, TypedName};

/// Resolves and simplifies a domain and a problem, to be measured by `objectives` (the most important first) or, if
/// there are none, by the metric of the problem.
///
/// # Errors
/// All constructs that the planner does not handle, and all names that are declared nowhere.
pub(crate) fn normalize(
    domain: &ast::Domain,
    problem: &ast::Problem,
    objectives: &[ast::Metric],
) -> Result<Lifted, Vec<Error>> {
    let mut normalizer = Normalizer::new(domain, problem);
    let written = if objectives.is_empty() { problem.metric.as_slice() } else { objectives };
    let metrics: Vec<_> = written
        .iter()
        .map(|metric| Metric {
            direction: metric.direction,
            expression: normalizer.expression(&metric.expression, &mut Scope::new(File::Problem)),
            place: Place { file: File::Problem, span: metric.span },
        })
        .collect();
    let has_events = problem.init.iter().any(|element| matches!(element, ast::InitialElement::Timed(..)));
    // What happens by itself may be worth waiting for, in the midst of an action, too.
    normalizer.longest = if has_events { None } else { duration::is_rewarded(&metrics) };
    let schemas = domain.actions.iter().zip(0..);
    let schemas = schemas.map(|(action, index)| normalizer.schema(action, index)).collect();
    let axioms = domain.derived.iter().map(|axiom| normalizer.axiom(axiom)).collect();
    let (mut facts, values) = normalizer.initial_state(problem);
    let events = normalizer.events(problem);
    let mut scope = Scope::new(File::Problem);
    let goal = normalizer.condition(&problem.goal, true, &mut scope);
    if !normalizer.errors.is_empty() {
        return Err(normalizer.errors);
    }
    let time = normalizer.time(&events);
    if !events.is_empty() {
        facts.push((time.phase, [time.first_phase].into()));
    }
    let mut lifted = Lifted {
        objects: normalizer.objects,
        predicates: normalizer.predicates,
        functions: normalizer.functions,
        schemas,
        axioms,
        facts,
        values,
        events,
        time,
        goal,
        goal_variables: scope.bound as usize,
        metrics,
    };
    mark_fluents(&mut lifted);
    Ok(lifted)
}

/// A predicate or function is a fluent if some action changes it, and a derived predicate if it depends on a fluent.
fn mark_fluents(lifted: &mut Lifted) {
    for effect in
        lifted.schemas.iter().flat_map(|schema| schema.start_effects.iter().chain(&schema.end_effects))
    {
        match &effect.change {
            Change::Add(predicate, _) | Change::Delete(predicate, _) => {
                lifted.predicates[predicate.index()].fluent = true;
            }
            Change::Assign { function, .. } => lifted.functions[function.index()].fluent = true,
        }
    }
    for (predicate, ..) in lifted.events.iter().flat_map(|event| &event.changes) {
        lifted.predicates[predicate.index()].fluent = true;
    }
    // The rule engine negates only what is complete; what recurs through a quantifier is evaluated by itself.
    // So is a comparison below one: where a value is missing it does not hold, and neither does its negation.
    let compares = lifted.axioms.iter().filter(|axiom| compares_for_all(&axiom.condition, false));
    let compares: Vec<_> = compares.map(|axiom| axiom.predicate).collect();
    for predicate in recursive_through_forall(lifted).into_iter().chain(compares) {
        lifted.predicates[predicate.index()].fluent = true;
    }
    loop {
        let depends = |axiom: &&Axiom| {
            !lifted.predicates[axiom.predicate.index()].fluent && !is_static(lifted, &axiom.condition)
        };
        let more: Vec<_> = lifted.axioms.iter().filter(depends).map(|axiom| axiom.predicate).collect();
        if more.is_empty() {
            return;
        }
        for predicate in more {
            lifted.predicates[predicate.index()].fluent = true;
        }
    }
}

/// Whether numbers are compared below a universal quantifier.
fn compares_for_all(formula: &Formula, below: bool) -> bool {
    match formula {
        Formula::And(parts) | Formula::Or(parts) => parts.iter().any(|part| compares_for_all(part, below)),
        Formula::Exists(_, body) => compares_for_all(body, below),
        Formula::ForAll(_, body) => compares_for_all(body, true),
        Formula::Literal { .. } | Formula::Equal { .. } => false,
        Formula::Compare(..) => below,
    }
}

/// What `?duration` stands for.
enum Duration {
    /// The action has none.
    Instantaneous,
    Fixed(Expression),
    /// The planner chooses it.
    Open,
}

/// The variables in sight, each with what it stands for, and the file that is read.
struct Scope {
    file: File,
    variables: Vec<(Name, Term)>,
    /// How many variables have been bound so far, in sight or not.
    bound: u32,
    /// What `?duration` stands for.
    duration: Duration,
}

impl Scope {
    fn new(file: File) -> Self {
        Self { file, variables: Vec::new(), bound: 0, duration: Duration::Instantaneous }
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
    /// Whether the metric rewards time, so that actions should take as long as they may.
    longest: Option<bool>,
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
            longest: None,
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

    fn schema(&mut self, action: &ast::Action, index: u32) -> Schema {
        let mut scope = Scope::new(File::Domain);
        let mut schema = Schema {
            name: action.identifier.name.clone(),
            parameters: self.parameters(&action.parameters, &mut scope),
            variables: 0,
            start_condition: Formula::truth(),
            start_effects: Vec::new(),
            middle_condition: Formula::truth(),
            over_all: Formula::truth(),
            at_end: Formula::truth(),
            end_effects: Vec::new(),
            duration: None,
            is_chosen: false,
            joint: None,
            action: index,
            place: scope.place(action.span),
        };
        match &action.body {
            ast::ActionBody::Instantaneous { precondition, effect } => {
                schema.start_condition = self.condition(precondition, true, &mut scope);
                self.effect(effect, &mut scope, &mut schema.end_effects);
            }
            ast::ActionBody::Durative { duration, conditions, effects } => {
                let (mut start, mut middle) = (Vec::new(), Vec::new());
                let (mut over_all, mut at_end) = (Vec::new(), Vec::new());
                schema.duration = Some(self.duration(duration, action, &mut scope, &mut start));
                schema.is_chosen = matches!(scope.duration, Duration::Open) && self.longest == Some(false);
                for (time, condition) in conditions {
                    let formula = self.condition(condition, true, &mut scope);
                    match time {
                        ConditionTime::OverAll => over_all.push(formula.clone()),
                        ConditionTime::AtEnd => at_end.push(formula.clone()),
                        ConditionTime::AtStart => {}
                    }
                    if *time == ConditionTime::AtStart { &mut start } else { &mut middle }.push(formula);
                }
                (schema.start_condition, schema.middle_condition) =
                    (Formula::And(start), Formula::And(middle));
                (schema.over_all, schema.at_end) = (Formula::And(over_all), Formula::And(at_end));
                for (time, effect) in effects {
                    let target = match time {
                        EffectTime::AtStart => &mut schema.start_effects,
                        EffectTime::AtEnd => &mut schema.end_effects,
                    };
                    self.effect(effect, &mut scope, target);
                }
            }
        }
        schema.variables = scope.bound as usize;
        schema
    }

    fn axiom(&mut self, axiom: &ast::Derived) -> Axiom {
        let mut scope = Scope::new(File::Domain);
        let parameters = self.parameters(&axiom.head.parameters, &mut scope);
        let predicate = self.predicate_ids.get(&axiom.head.identifier.name).copied().unwrap_or_else(|| {
            self.unknown("predicate", &axiom.head.identifier, File::Domain);
            PredicateId(0)
        });
        let condition = self.condition(&axiom.condition, true, &mut scope);
        Axiom { predicate, parameters, variables: scope.bound as usize, condition }
    }

    fn parameters(&mut self, written: &[TypedName], scope: &mut Scope) -> Vec<Parameter> {
        let bound = self.bind(written, scope);
        bound.into_iter().map(|bound| Parameter { candidates: bound.candidates }).collect()
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
                ast::InitialElement::NegatedFact(_) | ast::InitialElement::Timed(..) => {}
                ast::InitialElement::Value(atom, number, _) => {
                    let number = Rational::from_big(number.clone());
                    values.push((self.function(atom, File::Problem), self.objects(atom), number));
                }
            }
        }
        (facts, values)
    }

    /// Symbols for time. Their names have a space, so that no file can mean them.
    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    fn time(&mut self, events: &[Event]) -> Time {
        let time = Time {
            clock: FunctionId(dense(self.functions.len())),
            moment: FunctionId(dense(self.functions.len() + 1)),
            phase: PredicateId(dense(self.predicates.len())),
            first_phase: ObjectId(dense(self.objects.len())),
            waited: PredicateId(dense(self.predicates.len() + 1)),
        };
        if !events.is_empty() {
            let predicate = |name, arity| Predicate {
                name: Name::new(name),
                arity,
                fluent: true,
                derived: false,
                running: false,
            };
            let function = |name| Function { name: Name::new(name), fluent: true };
            self.functions.extend([function("the clock"), function("a moment")]);
            self.predicates.extend([predicate("the phase", 1), predicate("has waited", 0)]);
            self.objects.extend((0..=events.len()).map(|number| Name::new(&format!("phase {number}"))));
        }
        time
    }

    /// The timed initial literals by time; of two of one time about one atom, the later one prevails.
    fn events(&mut self, problem: &ast::Problem) -> Vec<Event> {
        let mut events: Vec<Event> = Vec::new();
        for element in &problem.init {
            let ast::InitialElement::Timed(time, atom, holds, _) = element else { continue };
            let time = Rational::from_big(time.clone());
            let change = (self.predicate(atom, File::Problem), self.objects(atom), *holds);
            let position = events.partition_point(|event| event.time < time);
            match events.get_mut(position).filter(|event| event.time == time) {
                Some(event) => event.changes.push(change),
                None => events.insert(position, Event { time, changes: vec![change] }),
            }
        }
        events
    }

    fn objects(&mut self, atom: &ast::Atom) -> Box<[ObjectId]> {
        let terms = self.terms(atom, &mut Scope::new(File::Problem));
        terms
            .iter()
            .filter_map(|term| if let Term::Object(object) = term { Some(*object) } else { None })
            .collect()
    }
}
