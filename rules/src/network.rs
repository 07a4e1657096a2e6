//! Compiles a program into a network: lowered rules, their plans, and strata that map a changed relation to
//! the plans to run.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::cost::Costs;
use crate::error::{Error, Errors};
use crate::fixpoint::PlanId;
use crate::limits::{Budget, Limits};
use crate::lower::Lowering;
use crate::plan::{Condition, Lowered, Plan, Planner, Template};
use crate::rule::{Atom, Program, Rule, RuleIdentity, Term};
use crate::safety::check;
use crate::store::{RelationId, Store};
use crate::strata::components;
use crate::symbol::Symbols;
use crate::vocabulary::SAME_AS;

#[derive(Clone, Default, Debug)]
pub(crate) struct Network {
    pub rules: Vec<Lowered>,
    pub widths: Vec<usize>,
    pub plans: Vec<Plan>,
    pub strata: Vec<Stratum>,
    /// Indexed by relation: the number of its stratum. A relation has a number at least as large as those on which it
    /// depends. The numbers also count strata without rules, which `strata` omits.
    stratum_of: Vec<usize>,
    /// Relation of `owl:sameAs`, if it is interpreted as equality.
    pub same_as: Option<RelationId>,
    /// Number of rows in the store when the plans were created.
    pub planned_for: usize,
    /// Indexed by relation: the strata whose rules read or derive the relation.
    pub readers: Vec<Vec<u32>>,
    /// For each integrity constraint: the relation of its matches, and its position in the program.
    pub constraints: Vec<(RelationId, usize)>,
}

/// Plans of the rules that derive a set of mutually dependent relations.
#[derive(Clone, Default, Debug)]
pub(crate) struct Stratum {
    /// Plans for the first evaluation, which start from all rows of a relation or (`None`) from the
    /// empty match.
    pub initial: Vec<(Option<RelationId>, PlanId)>,
    /// Plans that start from an inserted or deleted row of a positive body atom, by the relation of the
    /// row.
    pub positive: FxHashMap<RelationId, Vec<PlanId>>,
    /// Plans that start from a deleted or inserted row of a negated body atom, by the relation of the
    /// row.
    pub negative: FxHashMap<RelationId, Vec<PlanId>>,
    /// Plans for inserted or deleted rows over which an aggregate is computed, by the relation of
    /// the row. A plan computes the aggregate of the row's group again.
    pub aggregated: FxHashMap<RelationId, Vec<PlanId>>,
    /// Plans that search for another derivation of a row that lost its support, by the relation of the
    /// row.
    pub rederive: FxHashMap<RelationId, Vec<PlanId>>,
}

/// Compiles a program. On failure, returns the errors of all rules; if the rules by themselves have none, the
/// errors of the stratification; otherwise R304 if planning was interrupted.
pub(crate) fn compile(
    program: &Program,
    symbols: &mut Symbols,
    store: &mut Store,
    limits: &Limits,
) -> Result<Network, Errors> {
    let mut network = without_plans(program, symbols, store)?;
    network.plan(store, false, (program, limits)).map_err(|error| vec![error])?;
    Ok(network)
}

/// Lowers a program to a network without plans. Returns the errors of [`compile`], except R304.
pub(crate) fn without_plans(
    program: &Program,
    symbols: &mut Symbols,
    store: &mut Store,
) -> Result<Network, Errors> {
    let mut errors: Vec<Error> = program.rules.iter().flat_map(check).collect();
    errors.extend(program.rules.iter().filter_map(|rule| unknown_symbols(rule, symbols)));
    errors.extend(program.rules.iter().filter_map(|rule| bad_pattern(rule, symbols)));
    if !errors.is_empty() {
        return Err(errors.into());
    }
    let same_as = program.equality.then(|| store.relation(symbols.name(SAME_AS), 2));
    let mut network = Network { same_as, ..Network::default() };
    // Rules with equal content are compiled once.
    let mut contents = FxHashSet::default();
    let mut lowering = Lowering::new(symbols, store, &mut network.constraints, FxHashSet::default());
    for (position, rule) in program.rules.iter().enumerate() {
        if contents.insert(content(rule)) {
            lowering.rule(position, rule);
        }
    }
    let lowered = lowering.lowered;
    network.stratum_of = stratify(program, symbols, store, &lowered, network.same_as)?;
    network.rules = split_by_stratum(lowered, &network.stratum_of);
    network.widths = network.rules.iter().map(|rule| rule.width).collect();
    Ok(network)
}

pub(crate) struct Revision {
    pub network: Network,
    /// Numbers of the removed compiled rules; the numbers are not reused before the next revision.
    pub removed: FxHashSet<u32>,
    pub added: FxHashSet<u32>,
}

/// Compiles the difference between a program and the program of a network. Unchanged rules keep their
/// numbers, to which recorded derivations refer. Returns `None` if a compiled rule would have to be split,
/// because its heads no longer lie in one stratum.
pub(crate) fn revise(
    network: &Network,
    old: &Program,
    new: &Program,
    symbols: &mut Symbols,
    store: &mut Store,
    limits: &Limits,
) -> Result<Option<Revision>, Errors> {
    let mut errors: Vec<Error> = new.rules.iter().flat_map(check).collect();
    errors.extend(new.rules.iter().filter_map(|rule| unknown_symbols(rule, symbols)));
    errors.extend(new.rules.iter().filter_map(|rule| bad_pattern(rule, symbols)));
    if !errors.is_empty() {
        return Err(errors.into());
    }
    let mut positions = FxHashMap::default();
    for (position, rule) in new.rules.iter().enumerate() {
        positions.entry(content(rule)).or_insert(position);
    }
    let mut revised = Network { constraints: Vec::new(), ..network.clone() };
    let new_position = |position: usize| positions.get(&content(&old.rules[position])).copied();
    let old_constraints = network.constraints.iter();
    revised.constraints = old_constraints.filter_map(|&(id, rule)| Some((id, new_position(rule)?))).collect();
    let (mut removed, mut free_numbers, mut compiled) =
        (FxHashSet::default(), Vec::new(), FxHashSet::default());
    for (number, rule) in revised.rules.iter_mut().enumerate() {
        if rule.heads.is_empty() {
            free_numbers.push(number);
        } else if let Some(position) = new_position(rule.rule) {
            rule.rule = position;
            compiled.insert(position);
        } else {
            // An empty rule takes the place of a removed rule, so that the numbers of other rules do not
            // shift.
            let (heads, body) = (Vec::new(), Vec::new());
            *rule = Lowered { rule: 0, width: rule.width, heads, body, is_closure: false };
            removed.insert(number as u32);
        }
    }
    let mut missing: Vec<usize> = positions.into_values().filter(|p| !compiled.contains(p)).collect();
    missing.sort_unstable();
    let heads = revised.rules.iter().flat_map(|rule| &rule.heads);
    let used_relations = heads.map(|head| head.relation).collect();
    let mut lowering = Lowering::new(symbols, store, &mut revised.constraints, used_relations);
    for position in missing {
        lowering.rule(position, &new.rules[position]);
    }
    let lowered = lowering.lowered;
    let all_rules: Vec<Lowered> = revised.rules.iter().chain(&lowered).cloned().collect();
    revised.stratum_of = stratify(new, symbols, store, &all_rules, revised.same_as)?;
    if split_by_stratum(revised.rules.clone(), &revised.stratum_of).len() != revised.live_rules() {
        return Ok(None);
    }
    let mut added = FxHashSet::default();
    for rule in split_by_stratum(lowered, &revised.stratum_of) {
        let number = free_numbers.pop().unwrap_or(revised.rules.len());
        if number == revised.rules.len() {
            revised.rules.push(rule);
        } else {
            revised.rules[number] = rule;
        }
        added.insert(number as u32);
    }
    revised.widths = revised.rules.iter().map(|rule| rule.width).collect();
    revised.plan(store, true, (new, limits)).map_err(|error| vec![error])?;
    Ok(Some(Revision { network: revised, removed, added }))
}

/// Returns the key by which equal rules are merged. Integrity constraints with different identities are
/// not merged, because each constraint reports its own violations.
fn content(rule: &Rule) -> (&[Atom], &[Atom], Option<&RuleIdentity>) {
    (&rule.head, &rule.body, rule.head.is_empty().then_some(&rule.identity))
}

fn unknown_symbols(rule: &Rule, symbols: &Symbols) -> Option<Error> {
    let atoms = || rule.head.iter().chain(&rule.body).flat_map(|atom| atom.parts().iter().chain([atom]));
    let predicates = atoms().filter_map(|atom| match atom {
        Atom::Relation { predicate, .. } | Atom::Not { predicate, .. } => Some(*predicate),
        _ => None,
    });
    let constants = atoms().flat_map(Atom::terms).filter_map(|term| match term {
        Term::Constant(symbol) => Some(symbol),
        Term::Variable(_) => None,
    });
    let unknown = predicates.chain(constants).find(|symbol| symbol.index() >= symbols.len())?;
    Some(Error::UnknownSymbol { index: unknown.index() })
}

/// Returns an error if a rule contains an invalid constant regular expression, whose built-in would never
/// hold.
fn bad_pattern(rule: &Rule, symbols: &Symbols) -> Option<Error> {
    let atoms = rule.head.iter().chain(&rule.body).flat_map(|atom| atom.parts().iter().chain([atom]));
    atoms.into_iter().find_map(|atom| {
        let (Atom::BuiltIn { built_in, arguments } | Atom::NotBuiltIn { built_in, arguments }) = atom else {
            return None;
        };
        let literal = |position: usize| match arguments.get(position)? {
            Term::Constant(symbol) => symbols.as_literal(*symbol),
            Term::Variable(_) => None,
        };
        let (pattern, reason) = built_in.bad_pattern(&literal)?;
        Some(Error::Pattern { rule: rule.identity.clone(), fault: format!("`{pattern}`: {reason}").into() })
    })
}

/// Computes the stratum of each relation. Every relation depends on equality, but needs no later stratum for this
/// reason, since the rows are rewritten when equality changes. Returns an error for each negation, aggregate or test
/// for unequal names whose relation depends on the conclusions of the rule.
fn stratify(
    program: &Program,
    symbols: &Symbols,
    store: &Store,
    rules: &[Lowered],
    same_as: Option<RelationId>,
) -> Result<Vec<usize>, Errors> {
    let mut successors = vec![Vec::new(); store.relations.len()];
    for rule in rules {
        let heads = || rule.heads.iter().map(|head| head.relation.0 as usize);
        for condition in &rule.body {
            if let Some(relation) = condition.relation() {
                successors[relation.0 as usize].extend(heads());
            }
        }
    }
    let mut strata = components(&successors);
    let own_strata = strata.clone();
    // Negation through equality is an error even though equality adds no strata.
    if let Some(same_as) = same_as {
        let named = |relation: &usize| store.relations[*relation].predicate.is_some();
        successors[same_as.0 as usize].extend((0..store.relations.len()).filter(named));
        for rule in rules.iter().filter(|rule| rule.compares_names()) {
            successors[same_as.0 as usize].extend(rule.heads.iter().map(|head| head.relation.0 as usize));
        }
        strata = components(&successors);
    }
    let name = |relation: RelationId| {
        store
            .get(relation)
            .predicate
            .map(|predicate| symbols.value(predicate).to_string())
            .unwrap_or_default()
    };
    let mut errors = Vec::new();
    for rule in rules {
        let is_recursive = |relation: RelationId| {
            rule.heads.iter().any(|head| strata[head.relation.0 as usize] == strata[relation.0 as usize])
        };
        if let Some(same_as) = same_as.filter(|same_as| rule.compares_names() && is_recursive(*same_as)) {
            let (rule, predicate) = (program.rules[rule.rule].identity.clone(), name(same_as));
            errors.push(Error::Unstratified { rule, predicate });
        }
        for condition in &rule.body {
            let (Condition::Not(relation, _) | Condition::Aggregate { matches: relation, .. }) = condition
            else {
                continue;
            };
            if !is_recursive(*relation) {
                continue;
            }
            let identity = program.rules[rule.rule].identity.clone();
            errors.push(if let Condition::Aggregate { function, .. } = condition {
                Error::UnstratifiedAggregate { rule: identity, aggregate: function.aggregate.name() }
            } else {
                Error::Unstratified { rule: identity, predicate: name(*relation) }
            });
        }
    }
    if errors.is_empty() { Ok(own_strata) } else { Err(errors.into()) }
}

/// Splits a rule whose heads lie in several strata into one rule per stratum. Drops rules without heads.
fn split_by_stratum(rules: Vec<Lowered>, strata: &[usize]) -> Vec<Lowered> {
    let mut split = Vec::with_capacity(rules.len());
    for rule in rules {
        let stratum_of = |head: &Template| strata[head.relation.0 as usize];
        let mut strata_of_heads: Vec<usize> = rule.heads.iter().map(stratum_of).collect();
        strata_of_heads.sort_unstable();
        strata_of_heads.dedup();
        for stratum in strata_of_heads {
            let heads = rule.heads.iter().filter(|head| stratum_of(head) == stratum).cloned().collect();
            split.push(Lowered { heads, ..rule.clone() });
        }
    }
    split
}

impl Network {
    fn live_rules(&self) -> usize {
        self.rules.iter().filter(|rule| !rule.heads.is_empty()).count()
    }

    /// Creates the plans of all rules for the current sizes of the relations. `complete` is `true` if
    /// the rules have been evaluated, so that the sizes of derived relations are known.
    ///
    /// # Errors
    /// Returns R304 if planning was interrupted. The previous plans then remain.
    pub fn plan(
        &mut self,
        store: &mut Store,
        complete: bool,
        (program, limits): (&Program, &Limits),
    ) -> Result<(), Error> {
        let heads = self.rules.iter().flat_map(|rule| &rule.heads);
        let derived: FxHashSet<RelationId> = heads.map(|head| head.relation).collect();
        let costs = Costs::new(store, |relation| !complete && derived.contains(&relation));
        let mut strata = vec![Stratum::default(); self.stratum_of.iter().max().map_or(0, |max| max + 1)];
        let (budget, mut plans) = (Budget::new(limits), Vec::new());
        for (number, lowered) in self.rules.iter().enumerate() {
            let Some(head) = lowered.heads.first() else { continue };
            let planner = Planner { store, lowered, number: number as u32, costs: &costs, budget: &budget };
            plan_rule(planner, &mut plans, &mut strata[self.stratum_of[head.relation.0 as usize]]);
            let identity = |rule: u32| program.rules[self.rules[rule as usize].rule].identity.clone();
            if let Some(error) = budget.error(identity) {
                return Err(error);
            }
        }
        self.plans = plans;
        // A stratum without plans for rederivation has no rules.
        strata.retain(|stratum| !stratum.rederive.is_empty());
        self.readers = vec![Vec::new(); self.stratum_of.len()];
        for (number, stratum) in strata.iter().enumerate() {
            let relations = stratum.positive.keys().chain(stratum.negative.keys());
            let relations = relations.chain(stratum.aggregated.keys()).chain(stratum.rederive.keys());
            for relation in relations.collect::<FxHashSet<_>>() {
                self.readers[relation.0 as usize].push(number as u32);
            }
        }
        self.strata = strata;
        self.planned_for = store.len();
        Ok(())
    }
}

fn plan_rule(mut planner: Planner, plans: &mut Vec<Plan>, stratum: &mut Stratum) {
    let lowered = planner.lowered;
    let mut add = |plan: Option<Plan>| {
        plan.map(|plan| {
            plans.push(plan);
            plans.len() as PlanId - 1
        })
    };
    for (position, condition) in lowered.body.iter().enumerate() {
        let (relation, starts) = match condition {
            Condition::Relation(relation, _) => (*relation, &mut stratum.positive),
            Condition::Not(relation, _) => (*relation, &mut stratum.negative),
            Condition::Aggregate { matches, .. } => (*matches, &mut stratum.aggregated),
            _ => continue,
        };
        let exactly_once = matches!(condition, Condition::Relation(..));
        starts.entry(relation).or_default().extend(add(planner.start_at_condition(position, exactly_once)));
    }
    for (position, head) in lowered.heads.iter().enumerate() {
        stratum.rederive.entry(head.relation).or_default().extend(add(planner.start_at_head(position)));
    }
    // The first evaluation starts from the smallest relation.
    let smallest = lowered.body.iter().enumerate().filter_map(|(position, condition)| match condition {
        Condition::Relation(relation, _) => Some((planner.costs.rows(*relation), position, *relation)),
        _ => None,
    });
    let (start, plan) = match smallest.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((_, position, relation)) => (Some(relation), planner.start_at_condition(position, false)),
        None => (None, planner.start_at_nothing()),
    };
    stratum.initial.extend(add(plan).map(|plan| (start, plan)));
}
