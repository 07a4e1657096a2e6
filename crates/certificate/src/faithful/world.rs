//! The static context given by the PDDL files: objects, initial state, static facts, timed events,
//! and rules of derived predicates.

use num_rational::BigRational;
use num_traits::Zero;
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::SmallVec;

use crate::faithful::key::{CLOCK, Key, PHASE, WAITED};
use crate::faithful::timeline::{self, Timeline};
use crate::faithful::verdict::Cause;
use pddl::TypeHierarchy;
use pddl::ast::{
    Action, ActionBody, Atom, Derived, Domain, Effect, InitialElement, Name, Problem, Term, TypeExpression,
};

pub(super) struct World<'w> {
    pub(super) problem: &'w Problem,
    types: TypeHierarchy,
    symbols: FxHashMap<Name, u32>,
    names: Vec<Name>,
    objects: Vec<(u32, Vec<&'w TypeExpression>)>,
    by_name: FxHashMap<u32, usize>,
    facts: FxHashSet<Key>,
    /// Arguments of the initial facts of each predicate, without the changes by events at time 0.
    /// `rows_with` contains the indices of rows by predicate, argument position and object.
    rows: FxHashMap<u32, Vec<Vec<u32>>>,
    rows_with: FxHashMap<(u32, usize, u32), Vec<usize>>,
    values: FxHashMap<Key, BigRational>,
    changing: FxHashSet<u32>,
    pub(super) timeline: Timeline,
    rules: FxHashMap<u32, Vec<&'w Derived>>,
}

fn undeclared(name: &Name) -> Cause {
    Cause::unsupported(format!("{name}, which is declared nowhere"))
}

impl<'w> World<'w> {
    pub(super) fn new(domain: &'w Domain, problem: &'w Problem) -> Result<Self, Cause> {
        let mut world = Self {
            problem,
            types: TypeHierarchy::of(domain),
            symbols: FxHashMap::default(),
            names: Vec::new(),
            objects: Vec::new(),
            by_name: FxHashMap::default(),
            facts: FxHashSet::default(),
            rows: FxHashMap::default(),
            rows_with: FxHashMap::default(),
            values: FxHashMap::default(),
            changing: FxHashSet::default(),
            timeline: Timeline::default(),
            rules: FxHashMap::default(),
        };
        let has_preferences = domain.actions.iter().any(|action| !action.preferences.is_empty());
        if has_preferences || !domain.constraints.is_empty() || !problem.constraints.is_empty() {
            return Err(Cause::unsupported("preferences, or constraints on trajectories"));
        }
        for declaration in domain.predicates.iter().chain(&domain.functions) {
            world.intern(&declaration.identifier.name);
        }
        let is_function = |name: &Name| domain.functions.iter().any(|own| own.identifier.name == *name);
        if !domain.derived.is_empty() && domain.predicates.iter().any(|own| is_function(&own.identifier.name))
        {
            return Err(Cause::unsupported(
                "derived predicates beside a predicate and a function of one name",
            ));
        }
        let total_cost = (world.intern(&Name::new("total-cost")), SmallVec::new());
        for entry in domain.constants.iter().chain(&problem.objects) {
            let symbol = world.intern(&entry.identifier.name);
            let place = *world.by_name.entry(symbol).or_insert(world.objects.len());
            if place == world.objects.len() {
                world.objects.push((symbol, Vec::new()));
            }
            world.objects[place].1.push(&entry.r#type);
        }
        for action in &domain.actions {
            match &action.body {
                ActionBody::Instantaneous { effect, .. } => world.note_changes(effect)?,
                ActionBody::Durative { effects, .. } => {
                    effects.iter().try_for_each(|(_, effect)| world.note_changes(effect))?;
                }
            }
        }
        for rule in &domain.derived {
            let symbol = world.symbol(&rule.head.identifier.name)?;
            world.rules.entry(symbol).or_default().push(rule);
        }
        // `total-cost` starts at 0 unless `:init` sets it.
        world.values.insert(total_cost, BigRational::zero());
        for element in &problem.init {
            world.state(element)?;
        }
        world.begin();
        let timed = world.timeline.events.iter().flat_map(|event| event.truths.keys());
        if world.facts.iter().chain(timed).any(|fact| world.rules.contains_key(&fact.0)) {
            return Err(Cause::unsupported("derived predicates that hold by themselves"));
        }
        Ok(world)
    }

    #[expect(clippy::cast_possible_truncation, reason = "names are held in memory")]
    fn intern(&mut self, name: &Name) -> u32 {
        if let Some(symbol) = self.symbols.get(name) {
            return *symbol;
        }
        let symbol = self.names.len() as u32;
        self.symbols.insert(name.clone(), symbol);
        self.names.push(name.clone());
        symbol
    }

    fn note_changes(&mut self, effect: &Effect) -> Result<(), Cause> {
        match effect {
            Effect::And(parts) => parts.iter().try_for_each(|part| self.note_changes(part)),
            Effect::Add(atom) | Effect::Delete(atom) | Effect::Assign(_, atom, ..) => {
                let symbol = self.symbol(&atom.predicate.name)?;
                self.changing.insert(symbol);
                Ok(())
            }
            Effect::ForAll(_, inner) | Effect::When(_, inner) => self.note_changes(inner),
        }
    }

    fn state(&mut self, element: &InitialElement) -> Result<(), Cause> {
        match element {
            InitialElement::Fact(atom) => {
                let key = self.key(atom, &FxHashMap::default())?;
                if self.facts.insert(key.clone()) {
                    let rows = self.rows.entry(key.0).or_default();
                    for (place, object) in key.1.iter().enumerate() {
                        self.rows_with.entry((key.0, place, *object)).or_default().push(rows.len());
                    }
                    rows.push(key.1.to_vec());
                }
            }
            InitialElement::NegatedFact(_) => {}
            InitialElement::Value(atom, value, _) => {
                let key = self.key(atom, &FxHashMap::default())?;
                self.values.insert(key, value.clone());
            }
            InitialElement::Timed(time, atom, holds, _) => {
                let key = self.key(atom, &FxHashMap::default())?;
                self.changing.insert(key.0);
                self.timeline.add(time, key, *holds);
            }
        }
        Ok(())
    }

    /// Applies the events at time 0 to the initial state, and adds the initial phase and clock. Does nothing
    /// without timed events.
    fn begin(&mut self) {
        if self.timeline.is_empty() {
            return;
        }
        for event in &self.timeline.events[..self.timeline.begun] {
            for (key, holds) in &event.truths {
                if *holds {
                    self.facts.insert(key.clone())
                } else {
                    self.facts.remove(key)
                };
            }
        }
        self.facts.insert(timeline::phase(self.timeline.begun));
        self.values.insert(timeline::clock(), BigRational::zero());
        self.changing.extend([PHASE, WAITED, CLOCK]);
    }

    pub(super) fn symbol(&self, name: &Name) -> Result<u32, Cause> {
        self.symbols.get(name).copied().ok_or_else(|| undeclared(name))
    }

    pub(super) fn object(&self, term: &Term, binding: &FxHashMap<&Name, u32>) -> Result<u32, Cause> {
        self.bound(term, binding).ok_or_else(|| match term {
            Term::Variable(identifier) => Cause::unsupported(format!("{}, which is free", identifier.name)),
            Term::Constant(identifier) => undeclared(&identifier.name),
        })
    }

    pub(super) fn bound(&self, term: &Term, binding: &FxHashMap<&Name, u32>) -> Option<u32> {
        match term {
            Term::Variable(identifier) => binding.get(&identifier.name).copied(),
            Term::Constant(identifier) => self.symbols.get(&identifier.name).copied(),
        }
    }

    pub(super) fn key(&self, atom: &Atom, binding: &FxHashMap<&Name, u32>) -> Result<Key, Cause> {
        let objects = atom.arguments.iter().map(|term| self.object(term, binding));
        Ok((self.symbol(&atom.predicate.name)?, objects.collect::<Result<_, _>>()?))
    }

    pub(super) fn show(&self, key: &Key) -> String {
        match (key.0, &key.1[..]) {
            (PHASE, [number]) => return format!("(the phase phase {number})"),
            (WAITED, _) => return "(has waited)".to_owned(),
            (CLOCK, _) => return "(the clock)".to_owned(),
            _ => {}
        }
        let words = std::iter::once(&key.0).chain(&key.1);
        let words: Vec<String> = words.map(|symbol| self.name(*symbol).to_ascii_lowercase()).collect();
        format!("({})", words.join(" "))
    }

    pub(super) fn call(&self, action: &Action, arguments: &[u32]) -> String {
        let words = arguments.iter().map(|object| self.name(*object));
        let words: Vec<&str> = std::iter::once(action.identifier.name.as_str()).chain(words).collect();
        format!("({})", words.join(" "))
    }

    pub(super) fn name(&self, symbol: u32) -> &str {
        self.names.get(symbol as usize).map_or("?", Name::as_str)
    }

    /// Parses an atom or fluent, including the phase, clock and `waited` of the timeline. Returns
    /// `None` if the text is malformed or a symbol is unknown.
    pub(super) fn written(&self, text: &str) -> Option<Key> {
        let phase = || {
            let number = text.strip_prefix("(the phase phase ")?.strip_suffix(')')?.parse().ok()?;
            (number <= self.timeline.events.len()).then(|| timeline::phase(number))
        };
        let timeline_keys = phase().into_iter().chain([timeline::waited(), timeline::clock()]);
        let mut timeline_keys =
            timeline_keys.filter(|key| !self.timeline.is_empty() && self.show(key) == text);
        timeline_keys.next().or_else(|| self.of_files(text))
    }

    fn of_files(&self, text: &str) -> Option<Key> {
        let inner = text.strip_prefix('(')?.strip_suffix(')')?;
        let mut words =
            inner.split_ascii_whitespace().map(|word| self.symbols.get(&Name::new(word)).copied());
        Some((words.next()??, words.collect::<Option<_>>()?))
    }

    /// Returns `true` if actions or timed events change a predicate or function. Returns `false`
    /// for derived predicates.
    pub(super) fn changes(&self, symbol: u32) -> bool {
        self.changing.contains(&symbol)
    }

    pub(super) fn rules(&self, symbol: u32) -> Option<&[&'w Derived]> {
        self.rules.get(&symbol).map(Vec::as_slice)
    }

    pub(super) fn is_derived(&self, atom: &Atom) -> bool {
        !self.rules.is_empty()
            && self.symbol(&atom.predicate.name).is_ok_and(|own| self.rules.contains_key(&own))
    }

    pub(super) fn derived(&self) -> impl Iterator<Item = (u32, &[&'w Derived])> {
        self.rules.iter().map(|(symbol, rules)| (*symbol, rules.as_slice()))
    }

    pub(super) fn holds_initially(&self, key: &Key) -> bool {
        self.facts.contains(key)
    }

    pub(super) fn initial_atoms(&self) -> impl Iterator<Item = Key> + '_ {
        self.facts.iter().cloned()
    }

    pub(super) fn initial_values(&self) -> impl Iterator<Item = (&Key, &BigRational)> {
        self.values.iter()
    }

    pub(super) fn initial_value(&self, key: &Key) -> Option<&BigRational> {
        self.values.get(key)
    }

    pub(super) fn is_of(&self, object: u32, wanted: &TypeExpression) -> bool {
        let place = self.by_name.get(&object);
        place.is_some_and(|place| self.objects[*place].1.iter().any(|given| self.types.fits(given, wanted)))
    }

    pub(super) fn objects_of(&self, wanted: &TypeExpression) -> Vec<u32> {
        let objects = self.objects.iter().map(|(object, _)| *object);
        objects.filter(|object| self.is_of(*object, wanted)).collect()
    }

    pub(super) fn count(&self, predicate: u32, place: Option<(usize, u32)>) -> usize {
        match place {
            None => self.rows.get(&predicate).map_or(0, Vec::len),
            Some((place, object)) => self.rows_with.get(&(predicate, place, object)).map_or(0, Vec::len),
        }
    }

    pub(super) fn rows(&self, predicate: u32, place: Option<(usize, u32)>) -> Vec<&Vec<u32>> {
        let Some(rows) = self.rows.get(&predicate) else { return Vec::new() };
        match place {
            None => rows.iter().collect(),
            Some((place, object)) => {
                let rows_with_object = self.rows_with.get(&(predicate, place, object));
                rows_with_object.into_iter().flatten().map(|row| &rows[*row]).collect()
            }
        }
    }
}
