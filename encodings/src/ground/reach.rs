//! Relaxed reachability: which instances of each schema can ever become applicable if nothing is ever deleted.
//!
//! The lifted task becomes a Datalog program for the rule engine [1]. A schema with slots has one auxiliary
//! relation for each slot, which says for which other arguments *some* design fits; the designs themselves never
//! enter the relation of the schema, so its size does not depend on how many designs there are.
//!
//! [1] M. Helmert: Concise finite-domain representations for PDDL planning tasks, Artificial Intelligence 173, 2009.

use rules::{Atom, Engine, Fact, Program, Rule, RuleIdentity, Symbol, Symbols, Term as RuleTerm, Variable};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::configuration::{SlotParameter, conjuncts};
use crate::error::Error;
use crate::ground::evaluate::Binding;
use crate::lifted::{Arguments, Effect, Formula, Lifted, ObjectId, PredicateId, Schema, Term};

/// What relaxed reachability finds.
pub(crate) struct Reached {
    /// For each schema the bindings of its parameters apart from slots, ascending.
    pub(crate) instances: Vec<Vec<Binding>>,
    /// The fluent atoms that can become true.
    pub(crate) atoms: FxHashSet<(PredicateId, Arguments)>,
}

/// Runs the relaxed task to its fixpoint.
///
/// # Errors
/// `Error::Rules` if the rule engine refuses the program.
pub(crate) fn reach(lifted: &Lifted, slots: &[Vec<SlotParameter>]) -> Result<Reached, Error> {
    let mut builder = Builder::new(lifted);
    let applicable: Vec<_> = lifted
        .schemas
        .iter()
        .zip(slots)
        .map(|(schema, slots)| builder.schema(lifted, schema, slots))
        .collect();
    let predicates = builder.predicates.clone();
    let objects: FxHashMap<Symbol, ObjectId> =
        builder.objects.iter().copied().zip((0..).map(ObjectId)).collect();
    let engine =
        Engine::new(builder.symbols, Program { rules: builder.rules }, builder.facts).map_err(|errors| {
            Error::Rules(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
        })?;
    let read = |row: &[Symbol]| -> Arguments {
        row.iter().filter_map(|symbol| objects.get(symbol)).copied().collect()
    };

    let mut atoms = FxHashSet::default();
    for (predicate, id) in lifted.predicates.iter().zip((0..).map(PredicateId)).filter(|(p, _)| p.fluent) {
        let any = vec![None; predicate.arity];
        atoms.extend(engine.matching(predicates[id.index()], &any).map(|row| (id, read(row))));
    }
    let mut instances = Vec::new();
    for ((schema, slots), (symbol, core)) in lifted.schemas.iter().zip(slots).zip(applicable) {
        debug_assert_eq!(core.len() + slots.len(), schema.parameters.len());
        let any = vec![None; core.len()];
        let mut bindings: Vec<Binding> = engine
            .matching(symbol, &any)
            .map(|row| {
                let mut binding = vec![None; schema.parameters.len()];
                for (parameter, object) in core.iter().zip(read(row).iter()) {
                    binding[*parameter as usize] = Some(*object);
                }
                binding
            })
            .collect();
        bindings.sort_unstable();
        instances.push(bindings);
    }
    Ok(Reached { instances, atoms })
}

struct Builder {
    symbols: Symbols,
    objects: Vec<Symbol>,
    predicates: Vec<Symbol>,
    types: FxHashMap<Vec<ObjectId>, Symbol>,
    facts: Vec<Fact>,
    rules: Vec<Rule>,
}

impl Builder {
    fn new(lifted: &Lifted) -> Self {
        let mut symbols = Symbols::new();
        let objects: Vec<_> =
            (0..lifted.objects.len()).map(|i| symbols.name(&format!("object {i}"))).collect();
        let predicates: Vec<_> =
            (0..lifted.predicates.len()).map(|i| symbols.name(&format!("predicate {i}"))).collect();
        let facts = lifted
            .facts
            .iter()
            .map(|(predicate, arguments)| Fact {
                predicate: predicates[predicate.index()],
                arguments: arguments.iter().map(|object| objects[object.index()]).collect(),
            })
            .collect();
        Self { symbols, objects, predicates, types: FxHashMap::default(), facts, rules: Vec::new() }
    }

    /// The unary relation that holds the candidates of a parameter.
    fn candidates(&mut self, candidates: &[ObjectId]) -> Symbol {
        if let Some(symbol) = self.types.get(candidates) {
            return *symbol;
        }
        let symbol = self.symbols.name(&format!("type {}", self.types.len()));
        for object in candidates {
            let arguments = std::iter::once(self.objects[object.index()]).collect();
            self.facts.push(Fact { predicate: symbol, arguments });
        }
        self.types.insert(candidates.to_vec(), symbol);
        symbol
    }

    fn atom(&self, predicate: PredicateId, terms: &[Term]) -> Atom {
        let arguments = terms
            .iter()
            .map(|term| match term {
                Term::Parameter(parameter) => RuleTerm::Variable(Variable(*parameter as u16)),
                Term::Object(object) => RuleTerm::Constant(self.objects[object.index()]),
            })
            .collect();
        Atom::Relation { predicate: self.predicates[predicate.index()], arguments }
    }

    fn relation(predicate: Symbol, parameters: &[u32]) -> Atom {
        let arguments = parameters.iter().map(|p| RuleTerm::Variable(Variable(*p as u16))).collect();
        Atom::Relation { predicate, arguments }
    }

    fn rule(&mut self, head: Vec<Atom>, body: Vec<Atom>) {
        let identity = RuleIdentity::new("relaxed reachability", self.rules.len() as u32);
        self.rules.push(Rule::new(identity, head, body));
    }

    /// Adds the rules of a schema; returns the relation of its instances and the parameters that it ranges over.
    fn schema(&mut self, lifted: &Lifted, schema: &Schema, slots: &[SlotParameter]) -> (Symbol, Vec<u32>) {
        let number = self.rules.len();
        let is_slot = |parameter: &u32| slots.iter().any(|slot| slot.parameter == *parameter);
        let core: Vec<u32> = (0..schema.parameters.len() as u32).filter(|p| !is_slot(p)).collect();
        let literals = positive_literals(lifted, schema);
        let mentions =
            |terms: &[Term], slot: &SlotParameter| terms.contains(&Term::Parameter(slot.parameter));

        let mut body = Vec::new();
        for (slot, position) in slots.iter().zip(0..) {
            let own: Vec<_> = literals
                .iter()
                .filter(|(_, terms)| {
                    mentions(terms, slot) && slots.iter().filter(|s| mentions(terms, s)).count() == 1
                })
                .collect();
            let mut others: Vec<u32> = own
                .iter()
                .flat_map(|(_, terms)| terms.iter())
                .copied()
                .filter_map(parameter)
                .filter(|p| !is_slot(p))
                .collect();
            others.sort_unstable();
            others.dedup();
            let relation = self.symbols.name(&format!("slot {position} of {number}"));
            let mut fits: Vec<_> =
                own.iter().map(|(predicate, terms)| self.atom(*predicate, terms)).collect();
            let candidates = self.candidates(&schema.parameters[slot.parameter as usize].candidates);
            fits.push(Self::relation(candidates, &[slot.parameter]));
            body.push(Self::relation(relation, &others));
            self.rule(vec![Self::relation(relation, &others)], fits);
        }
        for (predicate, terms) in &literals {
            if !slots.iter().any(|slot| mentions(terms, slot)) {
                body.push(self.atom(*predicate, terms));
            }
        }
        for parameter in &core {
            let candidates = self.candidates(&schema.parameters[*parameter as usize].candidates);
            body.push(Self::relation(candidates, &[*parameter]));
        }
        let applicable = self.symbols.name(&format!("applicable {number}"));
        self.rule(vec![Self::relation(applicable, &core)], body);
        let added: Vec<_> = schema
            .start_effects
            .iter()
            .chain(&schema.end_effects)
            .filter_map(|e| {
                if let Effect::Add(predicate, terms) = e { Some(self.atom(*predicate, terms)) } else { None }
            })
            .collect();
        if !added.is_empty() {
            self.rule(added, vec![Self::relation(applicable, &core)]);
        }
        (applicable, core)
    }
}

fn parameter(term: Term) -> Option<u32> {
    if let Term::Parameter(parameter) = term { Some(parameter) } else { None }
}

/// The atoms that every instance needs before it starts: positive conjuncts, apart from those of the middle
/// condition that its own start effects may provide.
fn positive_literals<'a>(lifted: &Lifted, schema: &'a Schema) -> Vec<(PredicateId, &'a [Term])> {
    let provided: Vec<_> = schema
        .start_effects
        .iter()
        .filter_map(|effect| if let Effect::Add(predicate, _) = effect { Some(*predicate) } else { None })
        .collect();
    let literal = |formula: &'a Formula| match formula {
        Formula::Literal { positive: true, predicate, terms } => Some((*predicate, terms.as_slice())),
        _ => None,
    };
    let middle =
        conjuncts(&schema.middle_condition).into_iter().filter_map(literal).filter(|(predicate, _)| {
            !lifted.predicates[predicate.index()].fluent || !provided.contains(predicate)
        });
    conjuncts(&schema.start_condition).into_iter().filter_map(literal).chain(middle).collect()
}
