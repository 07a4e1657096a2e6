//! Brute-force state space of tasks without numbers, from the definition of PDDL 2.2: states, derived
//! predicates as least fixpoints by strata, sequential actions. The code shares only the syntax tree with the
//! planner, the validator and the completion of domains.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use num_traits::Signed as _;
use pddl::ast::{
    ActionBody, Comparison, Condition, ConditionTime, Domain, DurationConstraint, Effect, EffectTime,
    Expression, InitialElement, Problem, Term, TypeExpression,
};

/// A fact or a ground action in lower case: its words, separated by spaces.
pub type Text = String;
type Words = Vec<String>;
type Facts = BTreeMap<String, BTreeSet<Words>>;

#[derive(Debug, Default)]
pub struct StateSpace {
    /// All atoms that hold in some reachable state, including derived atoms.
    pub atoms: BTreeSet<Text>,
    /// Transitions: state, action, next state. States are written with only the atoms that actions can
    /// change.
    pub steps: BTreeSet<(Text, Text, Text)>,
    pub least_steps: Option<usize>,
}

#[derive(Clone, Debug)]
enum Argument {
    Variable(String),
    Object(String),
}

/// A condition in which each quantified variable has a unique name.
#[derive(Clone, Debug)]
enum Part {
    And(Vec<Part>),
    Or(Vec<Part>),
    Holds(String, Vec<Argument>),
    Equal(Argument, Argument),
    /// The variable is an object of one of these types. An empty list means all types.
    HasType(String, Vec<String>),
    Exists(Box<Part>),
    Not(Box<Part>),
}

type Binding = HashMap<String, String>;

struct Rule {
    level: usize,
    /// Whether the body depends on predicates that actions change. Other rules derive the same facts in every
    /// state.
    varies: bool,
    head: String,
    parameters: Vec<String>,
    body: Part,
}

struct Schema {
    name: String,
    parameters: Vec<String>,
    body: Part,
    adds: Vec<(String, Vec<Argument>)>,
    deletes: Vec<(String, Vec<Argument>)>,
}

pub struct Task {
    objects: BTreeMap<String, BTreeSet<String>>,
    rules: Vec<Rule>,
    schemas: Vec<Schema>,
    initial: Facts,
    goal: Part,
    counter: usize,
}

fn low(text: &impl ToString) -> String {
    text.to_string().to_ascii_lowercase()
}

fn types(expression: &TypeExpression) -> Vec<String> {
    expression.alternatives.iter().map(|alternative| low(&alternative.name)).collect()
}

impl Task {
    pub fn new(domain: &Domain, problem: &Problem) -> Self {
        let mut parents: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for declaration in &domain.types {
            parents.entry(low(&declaration.identifier.name)).or_default().extend(types(&declaration.r#type));
        }
        let mut objects: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for declaration in domain.constants.iter().chain(&problem.objects) {
            let all_types = objects.entry(low(&declaration.identifier.name)).or_default();
            let mut pending = types(&declaration.r#type);
            while let Some(type_name) = pending.pop() {
                pending.extend(parents.get(&type_name).cloned().unwrap_or_default());
                all_types.insert(type_name);
            }
        }
        let truth = Part::And(Vec::new());
        let (rules, schemas, initial) = (Vec::new(), Vec::new(), Facts::new());
        let mut task = Self { objects, rules, schemas, initial, goal: truth, counter: 0 };
        for action in &domain.actions {
            let (precondition, effect) = joint(&action.body);
            let mut scope = Binding::new();
            let (parameters, type_conditions) = task.declare(&action.parameters, &mut scope);
            let body = task.part(&precondition, &scope);
            let (mut adds, mut deletes) = (Vec::new(), Vec::new());
            changes(&effect, &scope, &mut adds, &mut deletes);
            let body = Part::And(type_conditions.into_iter().chain([body]).collect());
            task.schemas.push(Schema { name: low(&action.identifier.name), parameters, body, adds, deletes });
        }
        task.rules(domain);
        for element in &problem.init {
            match element {
                InitialElement::Fact(atom) => {
                    let words = atom.arguments.iter().map(|term| low(&name(term))).collect();
                    task.initial.entry(low(&atom.predicate.name)).or_default().insert(words);
                }
                InitialElement::NegatedFact(_) => {}
                unsupported => panic!("no numbers or events here: {unsupported:?}"),
            }
        }
        task.goal = task.part(&problem.goal, &Binding::new());
        task
    }

    fn rules(&mut self, domain: &Domain) {
        // Strata by fixpoint: a predicate is above all predicates that it negates, and at least as high as
        // all others that it uses.
        let mut levels: BTreeMap<String, usize> =
            domain.derived.iter().map(|axiom| (low(&axiom.head.identifier.name), 0)).collect();
        loop {
            let previous = levels.clone();
            for axiom in &domain.derived {
                let mut predicates = Vec::new();
                collect_predicates(&axiom.condition, false, &mut predicates);
                let min_level = predicates.iter().filter_map(|(predicate, negated)| {
                    previous.get(predicate).map(|level| level + usize::from(*negated))
                });
                let min_level = min_level.max().unwrap_or(0);
                assert!(min_level <= domain.derived.len(), "negation in a circle");
                let level_of_head = levels.entry(low(&axiom.head.identifier.name)).or_default();
                *level_of_head = (*level_of_head).max(min_level);
            }
            if levels == previous {
                break;
            }
        }
        let mut varies = self.changed_predicates();
        loop {
            let previous_count = varies.len();
            for axiom in &domain.derived {
                let mut predicates = Vec::new();
                collect_predicates(&axiom.condition, false, &mut predicates);
                if predicates.iter().any(|(predicate, _)| varies.contains(predicate)) {
                    varies.insert(low(&axiom.head.identifier.name));
                }
            }
            if varies.len() == previous_count {
                break;
            }
        }
        for axiom in &domain.derived {
            let mut scope = Binding::new();
            let (parameters, type_conditions) = self.declare(&axiom.head.parameters, &mut scope);
            let body = self.part(&axiom.condition, &scope);
            let body = Part::And(type_conditions.into_iter().chain([body]).collect());
            let head = low(&axiom.head.identifier.name);
            self.rules.push(Rule {
                level: levels[&head],
                varies: varies.contains(&head),
                head,
                parameters,
                body,
            });
        }
    }

    /// Declares variables, which get unique names in `scope`. Returns the names and the conditions on their types.
    fn declare(&mut self, list: &[pddl::ast::TypedName], scope: &mut Binding) -> (Vec<String>, Vec<Part>) {
        let mut names = Vec::new();
        let mut type_conditions = Vec::new();
        for variable in list {
            self.counter += 1;
            let unique = format!("{}#{}", low(&variable.identifier.name), self.counter);
            scope.insert(low(&variable.identifier.name), unique.clone());
            type_conditions.push(Part::HasType(unique.clone(), types(&variable.r#type)));
            names.push(unique);
        }
        (names, type_conditions)
    }

    fn part(&mut self, condition: &Condition, scope: &Binding) -> Part {
        match condition {
            Condition::And(parts) => Part::And(parts.iter().map(|part| self.part(part, scope)).collect()),
            Condition::Or(parts) => Part::Or(parts.iter().map(|part| self.part(part, scope)).collect()),
            Condition::Not(inner) => Part::Not(Box::new(self.part(inner, scope))),
            Condition::Imply(left, right) => {
                let left = Part::Not(Box::new(self.part(left, scope)));
                Part::Or(vec![left, self.part(right, scope)])
            }
            Condition::Exists(bound, inner) => {
                let mut scope = scope.clone();
                let (_, mut parts) = self.declare(bound, &mut scope);
                parts.push(self.part(inner, &scope));
                Part::Exists(Box::new(Part::And(parts)))
            }
            Condition::ForAll(bound, inner) => {
                let mut scope = scope.clone();
                let (_, mut parts) = self.declare(bound, &mut scope);
                parts.push(Part::Not(Box::new(self.part(inner, &scope))));
                Part::Not(Box::new(Part::Exists(Box::new(Part::And(parts)))))
            }
            Condition::Atom(atom) => {
                let arguments = atom.arguments.iter().map(|term| argument(term, scope));
                Part::Holds(low(&atom.predicate.name), arguments.collect())
            }
            Condition::Equal(left, right, _) => Part::Equal(argument(left, scope), argument(right, scope)),
            Condition::Compare(..) => panic!("no numbers here"),
        }
    }

    /// Calls `each` for every binding under which all parts hold, until `each` returns `true`. Returns `true`
    /// if `each` did.
    fn solve(
        &self,
        mut open: Vec<&Part>,
        binding: &mut Binding,
        facts: &Facts,
        each: &mut dyn FnMut(&Binding) -> bool,
    ) -> bool {
        while let Some(at) = open.iter().position(|part| matches!(part, Part::And(_) | Part::Exists(_))) {
            match open.swap_remove(at) {
                Part::And(parts) => open.extend(parts),
                Part::Exists(inner) => open.push(inner),
                _ => unreachable!("one of both"),
            }
        }
        let no_rows = BTreeSet::new();
        // Join order: tests first, then the smallest relations. Negations must wait until their variables are bound.
        let price = |part: &Part| match part {
            part if is_bound(part, binding, &mut Vec::new()) => 0,
            Part::Equal(left, right) if value(left, binding).is_some() || value(right, binding).is_some() => {
                1
            }
            Part::Holds(name, _) => 2 + facts.get(name).map_or(0, BTreeSet::len),
            Part::Or(_) => 1_000_000,
            Part::HasType(..) => 2_000_000,
            _ => usize::MAX,
        };
        let Some(at) = (0..open.len()).min_by_key(|at| price(open[*at])) else { return each(binding) };
        let part = open.swap_remove(at);
        if is_bound(part, binding, &mut Vec::new()) && !matches!(part, Part::Or(_)) {
            return self.test(part, binding, facts) && self.solve(open, binding, facts, each);
        }
        match part {
            Part::Holds(name, arguments) => {
                for row in facts.get(name).unwrap_or(&no_rows) {
                    let mut extended = binding.clone();
                    if unify(arguments, row, &mut extended)
                        && self.solve(open.clone(), &mut extended, facts, each)
                    {
                        return true;
                    }
                }
                false
            }
            Part::Equal(left, right) => {
                let (object, free_side) = match value(left, binding) {
                    Some(object) => (object, right),
                    None => (value(right, binding).expect("one side is known"), left),
                };
                let Argument::Variable(variable) = free_side else { unreachable!("the other is free") };
                let mut extended = binding.clone();
                extended.insert(variable.clone(), object);
                self.solve(open, &mut extended, facts, each)
            }
            Part::Or(parts) => parts.iter().any(|part| {
                let open = open.iter().copied().chain([part]).collect();
                self.solve(open, &mut binding.clone(), facts, each)
            }),
            Part::HasType(variable, types) => self.objects.keys().any(|object| {
                let mut extended = binding.clone();
                extended.insert(variable.clone(), object.clone());
                self.has_type(object, types) && self.solve(open.clone(), &mut extended, facts, each)
            }),
            unsupported => unreachable!("every variable has a type: {unsupported:?}"),
        }
    }

    fn has_type(&self, object: &str, types: &[String]) -> bool {
        types.is_empty()
            || types.iter().any(|type_name| type_name == "object" || self.objects[object].contains(type_name))
    }

    fn test(&self, part: &Part, binding: &mut Binding, facts: &Facts) -> bool {
        let object_of = |argument: &Argument| value(argument, binding).expect("it is bound");
        match part {
            Part::Holds(name, arguments) => {
                let words: Words = arguments.iter().map(object_of).collect();
                facts.get(name).is_some_and(|rows| rows.contains(&words))
            }
            Part::Equal(left, right) => object_of(left) == object_of(right),
            Part::HasType(variable, types) => self.has_type(&binding[variable], types),
            Part::Not(inner) => !self.solve(vec![inner], &mut binding.clone(), facts, &mut |_| true),
            connective => self.solve(vec![connective], &mut binding.clone(), facts, &mut |_| true),
        }
    }

    fn changed_predicates(&self) -> BTreeSet<String> {
        let changed_atoms = self.schemas.iter().flat_map(|schema| schema.adds.iter().chain(&schema.deletes));
        changed_atoms.map(|(name, _)| name.clone()).collect()
    }

    /// Returns the closure of facts, stratum by stratum, under the rules whose field `varies` equals the
    /// argument.
    fn closure(&self, mut facts: Facts, varies: bool) -> Facts {
        let highest = self.rules.iter().map(|rule| rule.level).max().unwrap_or(0);
        for level in 0..=highest {
            loop {
                let mut conclusions = Vec::new();
                for rule in self.rules.iter().filter(|rule| rule.level == level && rule.varies == varies) {
                    self.solve(vec![&rule.body], &mut Binding::new(), &facts, &mut |binding| {
                        let words: Words =
                            rule.parameters.iter().map(|parameter| binding[parameter].clone()).collect();
                        conclusions.push((rule.head.clone(), words));
                        false
                    });
                }
                let mut has_grown = false;
                for (head, words) in conclusions {
                    has_grown |= facts.entry(head).or_default().insert(words);
                }
                if !has_grown {
                    break;
                }
            }
        }
        facts
    }

    pub fn explore(&self, limit: usize) -> Option<StateSpace> {
        let changed = self.changed_predicates();
        let fixed = self.initial.iter().filter(|(name, _)| !changed.contains(*name));
        let fixed = self.closure(fixed.map(|(name, rows)| (name.clone(), rows.clone())).collect(), false);
        let text_of_state = |state: &Facts| {
            let changing_facts = state.iter().filter(|(name, _)| changed.contains(*name));
            let atoms = changing_facts.flat_map(|(name, rows)| rows.iter().map(move |row| text(name, row)));
            atoms.collect::<Vec<_>>().join(", ")
        };
        let mut space = StateSpace::default();
        let mut visited: BTreeSet<Facts> = BTreeSet::from([self.initial.clone()]);
        let mut layer = vec![self.initial.clone()];
        for depth in 0.. {
            let mut next = Vec::new();
            for state in &layer {
                let changing_facts = state.iter().filter(|(name, _)| changed.contains(*name));
                let mut facts = fixed.clone();
                facts.extend(changing_facts.map(|(name, rows)| (name.clone(), rows.clone())));
                let facts = self.closure(facts, true);
                let atoms = facts.iter().flat_map(|(name, rows)| rows.iter().map(move |row| text(name, row)));
                space.atoms.extend(atoms);
                if space.least_steps.is_none() && self.test(&self.goal, &mut Binding::new(), &facts) {
                    space.least_steps = Some(depth);
                }
                for schema in &self.schemas {
                    let mut argument_lists = BTreeSet::new();
                    self.solve(vec![&schema.body], &mut Binding::new(), &facts, &mut |binding| {
                        let words: Words =
                            schema.parameters.iter().map(|name| binding[name].clone()).collect();
                        argument_lists.insert(words);
                        false
                    });
                    for words in argument_lists {
                        let binding = schema.parameters.iter().cloned().zip(words.iter().cloned()).collect();
                        let after = after(schema, &binding, state);
                        space.steps.insert((
                            text_of_state(state),
                            text(&schema.name, &words),
                            text_of_state(&after),
                        ));
                        if visited.insert(after.clone()) {
                            next.push(after);
                        }
                    }
                }
            }
            if visited.len() > limit {
                return None;
            }
            if next.is_empty() {
                break;
            }
            layer = next;
        }
        Some(space)
    }
}

/// Returns the condition and the effect of an action. All effects of a durative action must be at its end, so all its
/// conditions apply to the state in which it starts, without those over all if the duration is 0.
fn joint(body: &ActionBody) -> (Condition, Effect) {
    match body {
        ActionBody::Instantaneous { precondition, effect } => (precondition.clone(), effect.clone()),
        ActionBody::Durative { duration, conditions, effects } => {
            let [
                DurationConstraint {
                    operator: Comparison::Equal,
                    expression: Expression::Number(number, _),
                    ..
                },
            ] = &duration[..]
            else {
                panic!("only constant durations here")
            };
            assert!(
                effects.iter().all(|(time, _)| *time == EffectTime::AtEnd),
                "only effects at the end here"
            );
            let is_checked = |time: ConditionTime| number.is_positive() || time != ConditionTime::OverAll;
            let conditions = conditions.iter().filter(|(time, _)| is_checked(*time));
            (
                Condition::And(conditions.map(|(_, condition)| condition.clone()).collect()),
                Effect::And(effects.iter().map(|(_, effect)| effect.clone()).collect()),
            )
        }
    }
}

fn after(schema: &Schema, binding: &Binding, state: &Facts) -> Facts {
    let mut after = state.clone();
    let words = |arguments: &[Argument]| -> Words {
        arguments.iter().map(|argument| value(argument, binding).expect("a parameter")).collect()
    };
    for (name, arguments) in &schema.deletes {
        after.entry(name.clone()).or_default().remove(&words(arguments));
    }
    for (name, arguments) in &schema.adds {
        after.entry(name.clone()).or_default().insert(words(arguments));
    }
    after.retain(|_, rows| !rows.is_empty());
    after
}

fn text(name: &str, words: &Words) -> Text {
    [&[name.to_owned()], &words[..]].concat().join(" ")
}

fn name(term: &Term) -> &pddl::ast::Name {
    match term {
        Term::Variable(identifier) | Term::Constant(identifier) => &identifier.name,
    }
}

fn argument(term: &Term, scope: &Binding) -> Argument {
    match term {
        Term::Variable(identifier) => Argument::Variable(scope[&low(&identifier.name)].clone()),
        Term::Constant(identifier) => Argument::Object(low(&identifier.name)),
    }
}

fn value(argument: &Argument, binding: &Binding) -> Option<String> {
    match argument {
        Argument::Variable(name) => binding.get(name).cloned(),
        Argument::Object(name) => Some(name.clone()),
    }
}

fn unify(arguments: &[Argument], row: &Words, binding: &mut Binding) -> bool {
    arguments.len() == row.len()
        && arguments.iter().zip(row).all(|(argument, object)| match (value(argument, binding), argument) {
            (Some(value_of_argument), _) => value_of_argument == *object,
            (None, Argument::Variable(name)) => {
                binding.insert(name.clone(), object.clone());
                true
            }
            (None, Argument::Object(_)) => false,
        })
}

/// Returns `true` if all variables of a part are bound by `binding` or by an enclosing quantifier.
fn is_bound(part: &Part, binding: &Binding, hidden: &mut Vec<String>) -> bool {
    let is_argument_bound = |is_argument_bound: &Argument, hidden: &[String]| match is_argument_bound {
        Argument::Variable(name) => binding.contains_key(name) || hidden.contains(name),
        Argument::Object(_) => true,
    };
    match part {
        Part::And(parts) | Part::Or(parts) => parts.iter().all(|part| is_bound(part, binding, hidden)),
        Part::Holds(_, arguments) => arguments.iter().all(|argument| is_argument_bound(argument, hidden)),
        Part::Equal(left, right) => is_argument_bound(left, hidden) && is_argument_bound(right, hidden),
        Part::HasType(name, _) => binding.contains_key(name) || hidden.contains(name),
        Part::Not(inner) => is_bound(inner, binding, hidden),
        Part::Exists(inner) => {
            let Part::And(parts) = &**inner else { unreachable!("made so") };
            let outer = hidden.len();
            hidden.extend(parts.iter().filter_map(|part| match part {
                Part::HasType(name, _) => Some(name.clone()),
                _ => None,
            }));
            let is_inner_bound = is_bound(inner, binding, hidden);
            hidden.truncate(outer);
            is_inner_bound
        }
    }
}

/// Collects the predicates of a condition. The flag is `true` in the scope of an odd number of negations.
fn collect_predicates(condition: &Condition, negated: bool, predicates: &mut Vec<(String, bool)>) {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                collect_predicates(part, negated, predicates);
            }
        }
        Condition::Not(inner) => collect_predicates(inner, !negated, predicates),
        Condition::Exists(_, inner) | Condition::ForAll(_, inner) => {
            collect_predicates(inner, negated, predicates);
        }
        Condition::Imply(left, right) => {
            collect_predicates(left, !negated, predicates);
            collect_predicates(right, negated, predicates);
        }
        Condition::Atom(atom) => predicates.push((low(&atom.predicate.name), negated)),
        Condition::Equal(..) | Condition::Compare(..) => {}
    }
}

fn changes(
    effect: &Effect,
    scope: &Binding,
    adds: &mut Vec<(String, Vec<Argument>)>,
    deletes: &mut Vec<(String, Vec<Argument>)>,
) {
    let atom = |atom: &pddl::ast::Atom| {
        let arguments = atom.arguments.iter().map(|term| argument(term, scope)).collect();
        (low(&atom.predicate.name), arguments)
    };
    match effect {
        Effect::And(parts) => parts.iter().for_each(|part| changes(part, scope, adds, deletes)),
        Effect::Add(effect_atom) => adds.push(atom(effect_atom)),
        Effect::Delete(effect_atom) => deletes.push(atom(effect_atom)),
        unsupported => panic!("no such effects here: {unsupported:?}"),
    }
}
