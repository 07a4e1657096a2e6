//! The constant part of an execution (names, types, objects, axioms, fixed facts) and the states of a plan.

use num_rational::BigRational;
use num_traits::Zero;
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::SmallVec;

use crate::ast::{
    Atom, Derived, Domain, Identifier, InitialElement, Name, Problem, Span, TypeExpression, TypedName,
};
use crate::number::dense;
use crate::types::TypeHierarchy;

use super::axioms::{Stratum, read_by_axioms, strata};
use super::budget::Budget;
use super::changeable::changeable_predicates;

const IS_VIOLATED: &str = "is-violated";

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Symbol(u32);

pub(super) type Arguments = SmallVec<[Symbol; 4]>;

type ColumnKey = (Symbol, usize, Symbol);

#[derive(Debug)]
pub(super) struct World<'p> {
    pub(super) budget: Budget<'p>,
    pub(super) domain: &'p Domain,
    pub(super) problem: &'p Problem,
    types: TypeHierarchy,
    symbols: FxHashMap<Name, Symbol>,
    names: Vec<Name>,
    /// All objects with their declared types, constants first.
    objects: Vec<(Symbol, Vec<&'p TypeExpression>)>,
    position: FxHashMap<Symbol, usize>,
    members: FxHashMap<Name, (Vec<Symbol>, FxHashSet<Symbol>)>,
    pub(super) strata: Vec<Stratum<'p>>,
    /// Axioms of each derived predicate.
    pub(super) axioms: FxHashMap<&'p Name, Vec<&'p Derived>>,
    pub(super) read_by_axioms: FxHashSet<Symbol>,
    changeable: FxHashSet<Symbol>,
    /// Facts of the fixed predicates, which no plan changes, indexed by argument position and object.
    fixed: FxHashMap<ColumnKey, Vec<Arguments>>,
}

#[derive(Debug, Clone, Default)]
pub(super) struct State {
    pub(super) facts: FxHashMap<Symbol, FxHashSet<Arguments>>,
    pub(super) derived: FxHashMap<Symbol, FxHashSet<Arguments>>,
    pub(super) values: FxHashMap<(Symbol, Arguments), BigRational>,
}

impl<'p> World<'p> {
    /// Interns the names and builds the indices, without calling `stop`. Once `stop` returns `true`, loops that use
    /// the world end early with meaningless results.
    pub(super) fn new(domain: &'p Domain, problem: &'p Problem, stop: &'p dyn Fn() -> bool) -> Self {
        let mut world = Self {
            budget: Budget::new(stop),
            domain,
            problem,
            types: TypeHierarchy::of(domain),
            symbols: FxHashMap::default(),
            names: Vec::new(),
            objects: Vec::new(),
            position: FxHashMap::default(),
            members: FxHashMap::default(),
            strata: strata(domain),
            axioms: FxHashMap::default(),
            read_by_axioms: FxHashSet::default(),
            changeable: FxHashSet::default(),
            fixed: FxHashMap::default(),
        };
        for axiom in &domain.derived {
            world.axioms.entry(&axiom.head.identifier.name).or_default().push(axiom);
        }
        // `total-cost` may be used without a declaration.
        world.intern(&Name::new("total-cost"));
        for declaration in domain.predicates.iter().chain(&domain.functions) {
            world.intern(&declaration.identifier.name);
        }
        for entry in domain.constants.iter().chain(&problem.objects) {
            world.insert_object(entry);
        }
        world.intern(&Name::new(IS_VIOLATED));
        for name in world.preferences() {
            world.intern(name);
        }
        let names: Vec<Name> = world.types.names().cloned().collect();
        for name in names {
            let identifier = Identifier { name: name.clone(), span: Span::default() };
            let target = TypeExpression { alternatives: vec![identifier] };
            let fits = |types: &[&TypeExpression]| types.iter().any(|lower| world.types.fits(lower, &target));
            let members = world.objects.iter().filter(|(_, types)| fits(types)).map(|(object, _)| *object);
            let members: Vec<Symbol> = members.collect();
            let set = members.iter().copied().collect();
            world.members.insert(name, (members, set));
        }
        world.read_by_axioms = read_by_axioms(domain).into_iter().map(|name| world.symbol(name)).collect();
        world.changeable =
            changeable_predicates(domain, problem).into_iter().map(|name| world.symbol(name)).collect();
        world.index_fixed();
        world
    }

    fn index_fixed(&mut self) {
        let mut fixed: FxHashMap<ColumnKey, Vec<Arguments>> = FxHashMap::default();
        let mut indexed = FxHashSet::default();
        for element in &self.problem.init {
            let InitialElement::Fact(atom) = element else { continue };
            let (predicate, arguments) = self.ground(atom);
            if self.changeable.contains(&predicate) || !indexed.insert((predicate, arguments.clone())) {
                continue;
            }
            for (column, object) in arguments.iter().enumerate() {
                let rows = fixed.entry((predicate, column, *object)).or_default();
                // An object that occurs twice in a fact has an entry for each of its two columns.
                rows.push(arguments.clone());
            }
        }
        self.fixed = fixed;
    }

    /// Facts of a fixed predicate with the given object at the argument position `column`. `None` if a plan
    /// can change the predicate.
    pub(super) fn fixed_rows(
        &self,
        predicate: Symbol,
        column: usize,
        object: Symbol,
    ) -> Option<&[Arguments]> {
        let is_fixed = !self.changeable.contains(&predicate);
        is_fixed.then(|| self.fixed.get(&(predicate, column, object)).map_or(&[][..], Vec::as_slice))
    }

    fn intern(&mut self, name: &Name) -> Symbol {
        if let Some(symbol) = self.symbols.get(name) {
            return *symbol;
        }
        let symbol = Symbol(dense(self.names.len()));
        self.symbols.insert(name.clone(), symbol);
        self.names.push(name.clone());
        symbol
    }

    fn insert_object(&mut self, entry: &'p TypedName) {
        let symbol = self.intern(&entry.identifier.name);
        if let Some(position) = self.position.get(&symbol) {
            self.objects[*position].1.push(&entry.r#type);
        } else {
            self.position.insert(symbol, self.objects.len());
            self.objects.push((symbol, vec![&entry.r#type]));
        }
    }

    fn preferences(&self) -> impl Iterator<Item = &'p Name> + use<'p> {
        let constraints = self.domain.constraints.iter().chain(&self.problem.constraints);
        let constraint_names = constraints.filter_map(|constraint| constraint.preference.as_ref());
        let action_preferences = self.domain.actions.iter().flat_map(|action| &action.preferences);
        constraint_names.chain(action_preferences.map(|preference| &preference.name)).map(|name| &name.name)
    }

    pub(super) fn has_preferences(&self) -> bool {
        self.preferences().next().is_some()
    }

    pub(super) fn with_violations(&self, violated: &[Name], state: &State) -> State {
        let mut state = state.clone();
        let function = self.symbol(&Name::new(IS_VIOLATED));
        for name in self.preferences() {
            let count = violated.iter().filter(|violation| *violation == name).count();
            let arguments = Arguments::from_slice(&[self.symbol(name)]);
            state.values.insert((function, arguments), BigRational::from_integer(count.into()));
        }
        state
    }

    /// Returns the symbol of a name. All undeclared names have one common symbol, which occurs in no fact of
    /// a checked problem.
    pub(super) fn symbol(&self, name: &Name) -> Symbol {
        self.symbols.get(name).copied().unwrap_or(Symbol(u32::MAX))
    }

    pub(super) fn name_of(&self, symbol: Symbol) -> Option<&Name> {
        self.names.get(symbol.0 as usize)
    }

    pub(super) fn name(&self, symbol: Symbol) -> &str {
        self.names.get(symbol.0 as usize).map_or("?", Name::as_str)
    }

    pub(super) fn object(&self, name: &Name) -> Option<Symbol> {
        self.symbols.get(name).copied().filter(|symbol| self.position.contains_key(symbol))
    }

    pub(super) fn is_a(&self, object: Symbol, target: &TypeExpression) -> bool {
        if let [alternative] = &target.alternatives[..]
            && let Some((_, members)) = self.members.get(&alternative.name)
        {
            return members.contains(&object);
        }
        let types = self.position.get(&object).map(|position| &self.objects[*position].1);
        types.is_some_and(|types| types.iter().any(|declared| self.types.fits(declared, target)))
    }

    pub(super) fn objects_of<'w>(
        &'w self,
        target: &'w TypeExpression,
    ) -> Box<dyn Iterator<Item = Symbol> + 'w> {
        if let [alternative] = &target.alternatives[..]
            && let Some((members, _)) = self.members.get(&alternative.name)
        {
            return Box::new(members.iter().copied());
        }
        Box::new(self.objects.iter().map(|(object, _)| *object).filter(|object| self.is_a(*object, target)))
    }

    pub(super) fn only_object(&self, target: &TypeExpression) -> Option<Symbol> {
        let mut objects = self.objects_of(target);
        objects.next().filter(|_| objects.next().is_none())
    }

    pub(super) fn show(&self, symbol: Symbol, arguments: &[Symbol]) -> String {
        let words: Vec<_> =
            std::iter::once(&symbol).chain(arguments).map(|symbol| self.name(*symbol)).collect();
        format!("({})", words.join(" "))
    }

    pub(super) fn ground(&self, atom: &Atom) -> (Symbol, Arguments) {
        let arguments = atom.arguments.iter().map(|term| self.symbol(term.name()));
        (self.symbol(&atom.predicate.name), arguments.collect())
    }

    /// Returns the initial state, without derived facts.
    pub(super) fn initial_state(&self) -> State {
        let mut state = State::default();
        // `total-cost` starts at 0 unless `:init` sets it.
        state.values.insert((self.symbol(&Name::new("total-cost")), Arguments::new()), BigRational::zero());
        for element in &self.problem.init {
            match element {
                InitialElement::Fact(atom) => {
                    let (predicate, arguments) = self.ground(atom);
                    state.facts.entry(predicate).or_default().insert(arguments);
                }
                InitialElement::Value(atom, value, _) => {
                    state.values.insert(self.ground(atom), value.clone());
                }
                InitialElement::NegatedFact(_) | InitialElement::Timed(..) => {}
            }
        }
        state
    }
}

impl State {
    pub(super) fn holds(&self, predicate: Symbol, arguments: &Arguments) -> bool {
        [&self.facts, &self.derived]
            .iter()
            .any(|facts| facts.get(&predicate).is_some_and(|tuples| tuples.contains(arguments)))
    }

    pub(super) fn tuples(&self, predicate: Symbol) -> impl Iterator<Item = &Arguments> {
        let derived = self.derived.get(&predicate).into_iter().flatten();
        self.facts.get(&predicate).into_iter().flatten().chain(derived)
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(super) fn count(&self, predicate: Symbol) -> usize {
        let count =
            |facts: &FxHashMap<Symbol, FxHashSet<Arguments>>| facts.get(&predicate).map_or(0, FxHashSet::len);
        count(&self.facts) + count(&self.derived)
    }
}
