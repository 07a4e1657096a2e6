//! All that can be reached, by plain enumeration: written from the definition of PDDL 2.2 (states, derived predicates as least
//! fixpoints by strata, sequential actions), for tasks without numbers. It shares nothing with the planner, the validator and the
//! room that completes domains but the syntax tree.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use pddl::ast::{ActionBody, Condition, Domain, Effect, InitialElement, Problem, Term, TypeExpression};

/// A fact or a label: small letters, blanks in between.
pub type Text = String;
type Words = Vec<String>;
type Facts = BTreeMap<String, BTreeSet<Words>>;

/// What can be reached.
#[derive(Debug, Default)]
pub struct Reached {
    /// Every atom that holds in some state, derived ones among them.
    pub atoms: BTreeSet<Text>,
    /// From state to state by which action; states are what actions can change of them.
    pub steps: BTreeSet<(Text, Text, Text)>,
    /// The least number of actions to a goal.
    pub least: Option<usize>,
}

#[derive(Clone, Debug)]
enum Argument {
    Variable(String),
    Object(String),
}

/// A condition whose variables have names of their own.
#[derive(Clone, Debug)]
enum Part {
    And(Vec<Part>),
    Or(Vec<Part>),
    Holds(String, Vec<Argument>),
    Equal(Argument, Argument),
    /// The variable is an object of one of the types.
    Is(String, Vec<String>),
    Exists(Box<Part>),
    Not(Box<Part>),
}

type Binding = HashMap<String, String>;

struct Rule {
    level: usize,
    /// Whether it depends on something that actions change; what does not is the same in every state.
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
    /// Objects with all types that they are of.
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

fn types(of: &TypeExpression) -> Vec<String> {
    of.alternatives.iter().map(|own| low(&own.name)).collect()
}

impl Task {
    pub fn new(domain: &Domain, problem: &Problem) -> Self {
        let mut parents: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for own in &domain.types {
            parents.entry(low(&own.identifier.name)).or_default().extend(types(&own.r#type));
        }
        let mut objects: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for own in domain.constants.iter().chain(&problem.objects) {
            let all = objects.entry(low(&own.identifier.name)).or_default();
            let mut open = types(&own.r#type);
            while let Some(one) = open.pop() {
                open.extend(parents.get(&one).cloned().unwrap_or_default());
                all.insert(one);
            }
        }
        let truth = Part::And(Vec::new());
        let (rules, schemas, initial) = (Vec::new(), Vec::new(), Facts::new());
        let mut task = Self { objects, rules, schemas, initial, goal: truth, counter: 0 };
        for action in &domain.actions {
            let ActionBody::Instantaneous { precondition, effect } = &action.body else {
                panic!("no durations here")
            };
            let mut scope = Binding::new();
            let (parameters, is) = task.declare(&action.parameters, &mut scope);
            let body = task.part(precondition, &scope);
            let (mut adds, mut deletes) = (Vec::new(), Vec::new());
            changes(effect, &scope, &mut adds, &mut deletes);
            let body = Part::And(is.into_iter().chain([body]).collect());
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
                other => panic!("no numbers or events here: {other:?}"),
            }
        }
        task.goal = task.part(&problem.goal, &Binding::new());
        task
    }

    fn rules(&mut self, domain: &Domain) {
        // A level above what is negated, at least the level of what is not.
        let mut levels: BTreeMap<String, usize> =
            domain.derived.iter().map(|own| (low(&own.head.identifier.name), 0)).collect();
        loop {
            let before = levels.clone();
            for axiom in &domain.derived {
                let mut found = Vec::new();
                mentioned(&axiom.condition, false, &mut found);
                let least = found.iter().filter_map(|(other, negated)| {
                    before.get(other).map(|level| level + usize::from(*negated))
                });
                let least = least.max().unwrap_or(0);
                assert!(least <= domain.derived.len(), "negation in a circle");
                let own = levels.entry(low(&axiom.head.identifier.name)).or_default();
                *own = (*own).max(least);
            }
            if levels == before {
                break;
            }
        }
        let mut varies = self.changed();
        loop {
            let before = varies.len();
            for axiom in &domain.derived {
                let mut found = Vec::new();
                mentioned(&axiom.condition, false, &mut found);
                if found.iter().any(|(other, _)| varies.contains(other)) {
                    varies.insert(low(&axiom.head.identifier.name));
                }
            }
            if varies.len() == before {
                break;
            }
        }
        for axiom in &domain.derived {
            let mut scope = Binding::new();
            let (parameters, is) = self.declare(&axiom.head.parameters, &mut scope);
            let body = self.part(&axiom.condition, &scope);
            let body = Part::And(is.into_iter().chain([body]).collect());
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

    /// Variables with names that nothing else has.
    fn declare(&mut self, list: &[pddl::ast::TypedName], scope: &mut Binding) -> (Vec<String>, Vec<Part>) {
        let mut fresh = Vec::new();
        let mut is = Vec::new();
        for own in list {
            self.counter += 1;
            let unique = format!("{}#{}", low(&own.identifier.name), self.counter);
            scope.insert(low(&own.identifier.name), unique.clone());
            is.push(Part::Is(unique.clone(), types(&own.r#type)));
            fresh.push(unique);
        }
        (fresh, is)
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

    /// Calls `each` with every binding under which all parts hold; ends when it says so.
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
        let none = BTreeSet::new();
        let price = |part: &Part| match part {
            part if is_bound(part, binding, &mut Vec::new()) => 0,
            Part::Equal(left, right) if value(left, binding).is_some() || value(right, binding).is_some() => {
                1
            }
            Part::Holds(name, _) => 2 + facts.get(name).map_or(0, BTreeSet::len),
            Part::Or(_) => 1_000_000,
            Part::Is(..) => 2_000_000,
            _ => usize::MAX,
        };
        let Some(at) = (0..open.len()).min_by_key(|at| price(open[*at])) else { return each(binding) };
        let part = open.swap_remove(at);
        if is_bound(part, binding, &mut Vec::new()) && !matches!(part, Part::Or(_)) {
            return self.test(part, binding, facts) && self.solve(open, binding, facts, each);
        }
        match part {
            Part::Holds(name, arguments) => {
                for row in facts.get(name).unwrap_or(&none) {
                    let mut longer = binding.clone();
                    if meet(arguments, row, &mut longer) && self.solve(open.clone(), &mut longer, facts, each)
                    {
                        return true;
                    }
                }
                false
            }
            Part::Equal(left, right) => {
                let (known, other) = match value(left, binding) {
                    Some(known) => (known, right),
                    None => (value(right, binding).expect("one side is known"), left),
                };
                let Argument::Variable(variable) = other else { unreachable!("the other is free") };
                let mut longer = binding.clone();
                longer.insert(variable.clone(), known);
                self.solve(open, &mut longer, facts, each)
            }
            Part::Or(parts) => parts.iter().any(|part| {
                let open = open.iter().copied().chain([part]).collect();
                self.solve(open, &mut binding.clone(), facts, each)
            }),
            Part::Is(variable, wanted) => self.objects.keys().any(|object| {
                let mut longer = binding.clone();
                longer.insert(variable.clone(), object.clone());
                self.is(object, wanted) && self.solve(open.clone(), &mut longer, facts, each)
            }),
            other => unreachable!("every variable has a type: {other:?}"),
        }
    }

    fn is(&self, object: &str, wanted: &[String]) -> bool {
        wanted.is_empty() || wanted.iter().any(|one| one == "object" || self.objects[object].contains(one))
    }

    fn test(&self, part: &Part, binding: &mut Binding, facts: &Facts) -> bool {
        let known = |own: &Argument| value(own, binding).expect("it is bound");
        match part {
            Part::Holds(name, arguments) => {
                let words: Words = arguments.iter().map(known).collect();
                facts.get(name).is_some_and(|rows| rows.contains(&words))
            }
            Part::Equal(left, right) => known(left) == known(right),
            Part::Is(variable, wanted) => self.is(&binding[variable], wanted),
            Part::Not(inner) => !self.solve(vec![inner], &mut binding.clone(), facts, &mut |_| true),
            other => self.solve(vec![other], &mut binding.clone(), facts, &mut |_| true),
        }
    }

    /// The predicates that actions change.
    fn changed(&self) -> BTreeSet<String> {
        let all = self.schemas.iter().flat_map(|own| own.adds.iter().chain(&own.deletes));
        all.map(|(name, _)| name.clone()).collect()
    }

    /// Facts with all that follows by the rules about what varies, or by the others.
    fn closed(&self, mut facts: Facts, varies: bool) -> Facts {
        let highest = self.rules.iter().map(|rule| rule.level).max().unwrap_or(0);
        for level in 0..=highest {
            loop {
                let mut new = Vec::new();
                for rule in self.rules.iter().filter(|rule| rule.level == level && rule.varies == varies) {
                    self.solve(vec![&rule.body], &mut Binding::new(), &facts, &mut |found| {
                        let words: Words = rule.parameters.iter().map(|own| found[own].clone()).collect();
                        new.push((rule.head.clone(), words));
                        false
                    });
                }
                let mut grown = false;
                for (head, words) in new {
                    grown |= facts.entry(head).or_default().insert(words);
                }
                if !grown {
                    break;
                }
            }
        }
        facts
    }

    /// Everything, state by state; none if there are more states than that.
    pub fn explore(&self, limit: usize) -> Option<Reached> {
        let changed = self.changed();
        let fixed = self.initial.iter().filter(|(name, _)| !changed.contains(*name));
        let fixed = self.closed(fixed.map(|(name, rows)| (name.clone(), rows.clone())).collect(), false);
        let shown = |state: &Facts| {
            let own = state.iter().filter(|(name, _)| changed.contains(*name));
            let all = own.flat_map(|(name, rows)| rows.iter().map(move |row| text(name, row)));
            all.collect::<Vec<_>>().join(", ")
        };
        let mut reached = Reached::default();
        let mut seen: BTreeSet<Facts> = BTreeSet::from([self.initial.clone()]);
        let mut layer = vec![self.initial.clone()];
        for depth in 0.. {
            let mut next = Vec::new();
            for state in &layer {
                let own = state.iter().filter(|(name, _)| changed.contains(*name));
                let mut facts = fixed.clone();
                facts.extend(own.map(|(name, rows)| (name.clone(), rows.clone())));
                let facts = self.closed(facts, true);
                let all = facts.iter().flat_map(|(name, rows)| rows.iter().map(move |row| text(name, row)));
                reached.atoms.extend(all);
                if reached.least.is_none() && self.test(&self.goal, &mut Binding::new(), &facts) {
                    reached.least = Some(depth);
                }
                for schema in &self.schemas {
                    let mut found = BTreeSet::new();
                    self.solve(vec![&schema.body], &mut Binding::new(), &facts, &mut |own| {
                        let words: Words = schema.parameters.iter().map(|name| own[name].clone()).collect();
                        found.insert(words);
                        false
                    });
                    for words in found {
                        let own = schema.parameters.iter().cloned().zip(words.iter().cloned()).collect();
                        let after = after(schema, &own, state);
                        reached.steps.insert((shown(state), text(&schema.name, &words), shown(&after)));
                        if seen.insert(after.clone()) {
                            next.push(after);
                        }
                    }
                }
            }
            if seen.len() > limit {
                return None;
            }
            if next.is_empty() {
                break;
            }
            layer = next;
        }
        Some(reached)
    }
}

fn after(schema: &Schema, binding: &Binding, state: &Facts) -> Facts {
    let mut after = state.clone();
    let words = |arguments: &[Argument]| -> Words {
        arguments.iter().map(|own| value(own, binding).expect("a parameter")).collect()
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
        Term::Variable(own) | Term::Constant(own) => &own.name,
    }
}

fn argument(term: &Term, scope: &Binding) -> Argument {
    match term {
        Term::Variable(own) => Argument::Variable(scope[&low(&own.name)].clone()),
        Term::Constant(own) => Argument::Object(low(&own.name)),
    }
}

fn value(argument: &Argument, binding: &Binding) -> Option<String> {
    match argument {
        Argument::Variable(name) => binding.get(name).cloned(),
        Argument::Object(name) => Some(name.clone()),
    }
}

fn meet(arguments: &[Argument], row: &Words, binding: &mut Binding) -> bool {
    arguments.len() == row.len()
        && arguments.iter().zip(row).all(|(own, object)| match (value(own, binding), own) {
            (Some(known), _) => known == *object,
            (None, Argument::Variable(name)) => {
                binding.insert(name.clone(), object.clone());
                true
            }
            (None, Argument::Object(_)) => false,
        })
}

/// Whether all variables of a part are bound, but for those that a quantifier within it binds.
fn is_bound(part: &Part, binding: &Binding, hidden: &mut Vec<String>) -> bool {
    let own = |own: &Argument, hidden: &[String]| match own {
        Argument::Variable(name) => binding.contains_key(name) || hidden.contains(name),
        Argument::Object(_) => true,
    };
    match part {
        Part::And(parts) | Part::Or(parts) => parts.iter().all(|part| is_bound(part, binding, hidden)),
        Part::Holds(_, arguments) => arguments.iter().all(|argument| own(argument, hidden)),
        Part::Equal(left, right) => own(left, hidden) && own(right, hidden),
        Part::Is(name, _) => binding.contains_key(name) || hidden.contains(name),
        Part::Not(inner) => is_bound(inner, binding, hidden),
        Part::Exists(inner) => {
            let Part::And(parts) = &**inner else { unreachable!("made so") };
            let outer = hidden.len();
            hidden.extend(parts.iter().filter_map(|part| match part {
                Part::Is(name, _) => Some(name.clone()),
                _ => None,
            }));
            let bound = is_bound(inner, binding, hidden);
            hidden.truncate(outer);
            bound
        }
    }
}

fn mentioned(condition: &Condition, negated: bool, found: &mut Vec<(String, bool)>) {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                mentioned(part, negated, found);
            }
        }
        Condition::Not(inner) => mentioned(inner, !negated, found),
        Condition::Exists(_, inner) | Condition::ForAll(_, inner) => mentioned(inner, negated, found),
        Condition::Imply(left, right) => {
            mentioned(left, !negated, found);
            mentioned(right, negated, found);
        }
        Condition::Atom(atom) => found.push((low(&atom.predicate.name), negated)),
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
        Effect::Add(own) => adds.push(atom(own)),
        Effect::Delete(own) => deletes.push(atom(own)),
        other => panic!("no such effects here: {other:?}"),
    }
}
