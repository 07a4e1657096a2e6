//! Extracts the data of a co-adaptation process from a PDDL problem with the facts of the knowledge base: places,
//! arcs, configurations and their costs. In this decision process, a robot moves between places and changes its
//! configuration.
//!
//! The PDDL symbols have default names; the section `[probabilistic]` of a manifest can give other names.
use std::collections::{BTreeMap, BTreeSet};

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, ToPrimitive, Zero};
use ontology::tomasys::View;
use pddl::ast::{Atom, Condition, Domain, InitialElement, Name, Problem, Term};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::message::{Errors, Message, did_you_mean};
use crate::mission::Mission;

/// The PDDL symbols and the parameters of the co-adaptation process; the section `[probabilistic]` of a manifest.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[allow(missing_docs, reason = "the names are those of the roles")]
pub struct Roles {
    /// The predicate `(robot_at PLACE)`.
    pub location: String,
    /// The predicate `(configured DESIGN)`.
    pub configured: String,
    /// The predicate `(fd_available DESIGN)`.
    pub available: String,
    /// The predicate `(suits DESIGN FROM TO)`.
    pub suits: String,
    /// The function `(time FROM TO DESIGN)`.
    pub time: String,
    /// The function `(energy FROM TO DESIGN)`.
    pub energy: String,
    /// The function `(success FROM TO DESIGN)`, a probability.
    pub success: String,
    /// The function `(hit FROM TO DESIGN)`, the probability of a collision.
    pub hit: String,
    /// The function `(switch_time OLD NEW)`.
    pub switch_time: String,
    /// The function `(switch_energy OLD NEW)`.
    pub switch_energy: String,
    /// The function `(switch_success OLD NEW)`, a probability.
    pub switch_success: String,
    /// The function `(battery)`.
    pub battery: String,
    /// The function `(reserve)`.
    pub reserve: String,
    /// Battery units per level of the process, in the unit of the problem.
    pub battery_unit: u32,
    /// Component that can be lost on the way, if any.
    pub loss_component: Option<String>,
    /// Probability of losing the component, for each move.
    pub loss_rate: f64,
}

impl Default for Roles {
    fn default() -> Self {
        let name = str::to_owned;
        Self {
            location: name("robot_at"),
            configured: name("configured"),
            available: name("fd_available"),
            suits: name("suits"),
            time: name("time"),
            energy: name("energy"),
            success: name("success"),
            hit: name("hit"),
            switch_time: name("switch_time"),
            switch_energy: name("switch_energy"),
            switch_success: name("switch_success"),
            battery: name("battery"),
            reserve: name("reserve"),
            battery_unit: 1,
            loss_component: None,
            loss_rate: 0.0,
        }
    }
}

impl Roles {
    /// Returns the faults of these settings for a mission, each with the key of the faulty value. The domain may lack
    /// symbols with default names, because the process does not need all of them.
    pub fn mistakes(&self, mission: &Mission) -> Vec<(&'static str, Message)> {
        let mut mistakes = self.unknown_symbols(mission.domain());
        if self.battery_unit == 0 {
            let text = "`battery_unit` is 0, but should be at least 1";
            mistakes.push(("battery_unit", Message::error("M105", text)));
        }
        if let Some(component) = &self.loss_component {
            let designs = mission.knowledge().map(|knowledge| knowledge.view().function_designs());
            let designs = designs.unwrap_or_default();
            let components = designs.iter().flat_map(|design| &design.components);
            let required: BTreeSet<&str> = components.map(|component| component.name.as_str()).collect();
            if !required.contains(component.as_str()) {
                let names: Vec<&str> = required.into_iter().collect();
                let remedy = if names.is_empty() {
                    "designs require no components".to_owned()
                } else {
                    let suggestion = did_you_mean(component, names.iter().copied());
                    format!("designs require: {}{suggestion}", names.join(", "))
                };
                let text =
                    format!("no design requires a component `{component}` that could be lost; {remedy}");
                mistakes.push(("loss_component", Message::error("M125", text)));
            }
        }
        if !(0.0..=1.0).contains(&self.loss_rate) {
            let text = format!("`loss_rate` is {}, but should be a probability, from 0 to 1", self.loss_rate);
            mistakes.push(("loss_rate", Message::error("M105", text)));
        }
        mistakes
    }

    /// Returns an error for each symbol that is not the default and that the domain does not declare.
    fn unknown_symbols(&self, domain: &Domain) -> Vec<(&'static str, Message)> {
        let default = Self::default();
        let predicates = [
            ("location", &self.location, &default.location),
            ("configured", &self.configured, &default.configured),
            ("available", &self.available, &default.available),
            ("suits", &self.suits, &default.suits),
        ];
        let functions = [
            ("time", &self.time, &default.time),
            ("energy", &self.energy, &default.energy),
            ("success", &self.success, &default.success),
            ("hit", &self.hit, &default.hit),
            ("switch_time", &self.switch_time, &default.switch_time),
            ("switch_energy", &self.switch_energy, &default.switch_energy),
            ("switch_success", &self.switch_success, &default.switch_success),
            ("battery", &self.battery, &default.battery),
            ("reserve", &self.reserve, &default.reserve),
        ];
        let mut mistakes = Vec::new();
        for (noun, symbols, declarations) in [
            ("predicate", &predicates[..], &domain.predicates),
            ("function", &functions[..], &domain.functions),
        ] {
            let names: Vec<&Name> = declarations.iter().map(|declared| &declared.identifier.name).collect();
            for (key, symbol, _) in symbols.iter().filter(|(_, symbol, default)| symbol != default) {
                if !names.contains(&&Name::new(symbol)) {
                    let suggestion = did_you_mean(symbol, names.iter().map(|name| name.as_str()));
                    let text = format!(
                        "`{key}` is `{symbol}`, but the domain has no {noun} of this name{suggestion}"
                    );
                    mistakes.push((*key, Message::error("M105", text)));
                }
            }
        }
        mistakes
    }
}

/// Cost and risks of traversing an arc with one configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct Traversal {
    /// Time of the traversal, in the mission's time unit.
    pub time: BigRational,
    /// Energy of the traversal, in the mission's unit of energy.
    pub energy: BigRational,
    /// Probability of reaching the end of the arc, with or without a collision.
    pub success: BigRational,
    /// Conditional probability of a collision, given that the end is reached.
    pub hit: BigRational,
}

/// Cost and success probability of a change between two configurations.
#[derive(Debug, Clone, PartialEq)]
pub struct Switch {
    /// Time of the change, in the mission's time unit.
    pub time: BigRational,
    /// Energy of the change, in the mission's unit of energy.
    pub energy: BigRational,
    /// Probability of success; a failed change keeps the old configuration.
    pub success: BigRational,
}

/// A directed arc between two places.
#[derive(Debug, Clone, PartialEq)]
pub struct Arc {
    /// Number of the place at which the arc starts.
    pub from: usize,
    /// Number of the place at which the arc ends.
    pub to: usize,
    /// Traversals by the number of the configuration. `None` if the arc cannot be traversed with the configuration.
    pub by: Vec<Option<Traversal>>,
}

const MAX_PLACES: usize = 1 << 16;
const MAX_CONFIGURATIONS: usize = 1 << 12;

/// A configuration: a design of the function that moving requires.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Configuration {
    /// The design's name.
    pub name: String,
    /// Components that the configuration needs.
    pub components: Vec<String>,
    /// `true` if the configuration is available at the start.
    pub available: bool,
}

/// A battery whose charge is counted in whole levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Battery {
    /// Number of levels at the start.
    pub initial: u32,
    /// Lowest level that is allowed after each action that needs energy.
    pub reserve: u32,
    /// Size of a level, in the mission's unit of energy.
    pub unit: u32,
}

/// A component that may be lost on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Loss {
    /// Name of the component.
    pub component: String,
    /// Probability of the loss at each move.
    pub rate: BigRational,
}

/// Data of a co-adaptation mission: a robot moves between places and changes its configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct Coadaptation {
    /// The names of the places.
    pub places: Vec<String>,
    /// Number of the place at which the mission starts.
    pub start: usize,
    /// Number of the place at which the mission ends.
    pub goal: usize,
    /// The configurations.
    pub configurations: Vec<Configuration>,
    /// Number of the initial configuration.
    pub initial: usize,
    /// The arcs, sorted by start and end.
    pub arcs: Vec<Arc>,
    /// Change from configuration `old` to `new`: `switches[old][new]`. `None` if there is no such change, as for
    /// `old` = `new`.
    pub switches: Vec<Vec<Option<Switch>>>,
    /// The battery, if there is one.
    pub battery: Option<Battery>,
    /// The component that may be lost, if there is one.
    pub loss: Option<Loss>,
}

impl Coadaptation {
    /// Extracts the data from `problem`, which [`Mission::filled`] returned.
    ///
    /// # Errors
    /// Facts or values that are missing in the problem, too many places or configurations, or numbers out of range.
    pub fn new(mission: &Mission, problem: &Problem, roles: &Roles) -> Result<Self, Errors> {
        let facts = Facts::new(problem);
        let mut problems = Vec::new();
        let mut need = |what: &str, found: Option<String>| {
            found.unwrap_or_else(|| {
                let text =
                    format!("the problem has no fact `({what} …)` at the start, which the process needs");
                problems.push(Message::error("M136", text));
                String::new()
            })
        };
        let start = need(&roles.location, facts.single(&roles.location));
        let configured = need(&roles.configured, facts.single(&roles.configured));
        if facts.of(&roles.suits).is_empty() {
            need(&roles.suits, None);
        }
        for role in [&roles.location, &roles.configured] {
            if facts.of(role).iter().collect::<BTreeSet<_>>().len() > 1 {
                let text = format!(
                    "the problem has several facts `({role} …)` at the start; a process of places has one robot and one \
                     configuration"
                );
                problems.push(Message::error("M127", text));
            }
        }
        let goal = goal(&problem.goal, &roles.location);
        if goal.is_none() {
            let text = format!(
                "the goal of a process of places is a single fact `({} PLACE)`, without other conditions",
                roles.location
            );
            problems.push(Message::error("M127", text));
        }
        problems.extend(conditions_on_time(mission.domain(), problem));
        let Some(goal) = goal.filter(|_| problems.is_empty()) else { return Err(problems.into()) };
        let mut places: Vec<String> = vec![start.clone(), goal.clone()];
        let mut designs: Vec<String> = vec![configured.clone()];
        for arguments in facts.of(&roles.suits) {
            if let [design, from, to] = &arguments[..] {
                designs.push(design.clone());
                places.extend([from.clone(), to.clone()]);
            }
        }
        designs.extend(facts.of(&roles.available).iter().filter_map(|arguments| arguments.first().cloned()));
        // Start and goal may occur in no arc, so they were added before.
        natural(&mut places);
        natural(&mut designs);
        fits(places.len(), designs.len())?;
        let place = |name: &str| places.iter().position(|place| place == name).unwrap_or_default();
        let design = |name: &str| designs.iter().position(|design| design == name).unwrap_or_default();
        let view = mission.knowledge().map(crate::knowledge::Knowledge::view);
        let configurations: Vec<_> = designs
            .iter()
            .map(|name| Configuration {
                name: name.clone(),
                components: view.as_ref().map(|view| components(view, name)).unwrap_or_default(),
                available: facts.of(&roles.available).iter().any(|arguments| arguments[..] == [name.clone()]),
            })
            .collect();
        let arcs = facts.arcs(roles, &places, &designs)?;
        let switch = |old: &String, new: &String| {
            let value = |role: &str| facts.value(role, &[old, new]);
            (old != new).then(|| Switch {
                time: value(&roles.switch_time).unwrap_or_else(BigRational::zero),
                energy: value(&roles.switch_energy).unwrap_or_else(BigRational::zero),
                success: value(&roles.switch_success).unwrap_or_else(BigRational::one),
            })
        };
        let switches =
            designs.iter().map(|old| designs.iter().map(|new| switch(old, new)).collect()).collect();
        let unit = BigRational::from(BigInt::from(roles.battery_unit.max(1)));
        let reserve = facts.value(&roles.reserve, &[]).unwrap_or_else(BigRational::zero);
        let reserve = (reserve / &unit).ceil();
        let battery = facts.value(&roles.battery, &[]).map(|value| {
            Ok::<_, Errors>(Battery {
                initial: battery_levels(&roles.battery, &(value / &unit).floor())?,
                reserve: battery_levels(&roles.reserve, &reserve)?,
                unit: roles.battery_unit.max(1),
            })
        });
        let battery = battery.transpose()?;
        let loss = roles.loss_component.clone().map(|component| Loss {
            component,
            rate: probabilistic::number::from_shortest_decimal(roles.loss_rate)
                .unwrap_or_else(BigRational::zero),
        });
        Self {
            start: place(&start),
            goal: place(&goal),
            initial: design(&configured),
            places,
            configurations,
            arcs,
            switches,
            battery,
            loss,
        }
        .checked()
    }

    /// Returns `true` if the problem has initial facts of the predicate `roles.configured` or `roles.suits`, from which
    /// [`Coadaptation::new`] reads places and configurations. Otherwise the states of the task have to be used as places
    /// ([`Tasked`](crate::comparison::Tasked)).
    pub fn is_spelt_out(problem: &Problem, roles: &Roles) -> bool {
        let facts = Facts::new(problem);
        [&roles.configured, &roles.suits].iter().any(|role| !facts.of(role).is_empty())
    }

    /// Checks that some configuration needs the component that may be lost.
    ///
    /// # Errors
    /// No configuration needs this component, so nothing would be lost.
    pub fn check_loss(&self) -> Result<(), Message> {
        let Some(Loss { component, .. }) = &self.loss else { return Ok(()) };
        if (0..self.configurations.len()).any(|configuration| self.lost(configuration)) {
            return Ok(());
        }
        let text = format!("no configuration needs a component `{component}` that could be lost");
        Err(Message::error("M125", text))
    }

    /// Returns `true` if the configuration needs the component that may be lost.
    pub fn lost(&self, configuration: usize) -> bool {
        self.loss
            .as_ref()
            .is_some_and(|loss| self.configurations[configuration].components.contains(&loss.component))
    }

    /// Converts an energy to a number of battery levels, rounded up.
    pub(super) fn levels(&self, energy: &BigRational) -> u32 {
        let unit = self.battery.map_or(1, |battery| battery.unit);
        (energy / BigRational::from(BigInt::from(unit))).ceil().to_integer().to_u32().unwrap_or(u32::MAX)
    }

    pub(super) fn checked(self) -> Result<Self, Errors> {
        let (zero, one) = (BigRational::zero(), BigRational::one());
        let mut problems = Vec::new();
        let mut check = |what: &str, spent: [&BigRational; 2], probabilities: [&BigRational; 2]| {
            if let Some(value) = spent.into_iter().find(|value| **value < zero) {
                let text = format!("{what} takes {value}; time and energy must not be less than zero");
                problems.push(Message::error("M122", text));
            }
            if let Some(value) = probabilities.into_iter().find(|value| **value < zero || **value > one) {
                let text =
                    format!("{what} has a probability of {value}; probabilities must be between 0 and 1");
                problems.push(Message::error("M122", text));
            }
        };
        for arc in &self.arcs {
            for (traversal, design) in arc.by.iter().zip(&self.configurations) {
                let Some(Traversal { time, energy, success, hit }) = traversal else { continue };
                let (from, to) = (&self.places[arc.from], &self.places[arc.to]);
                check(
                    &format!("the move from {from} to {to} with {}", design.name),
                    [time, energy],
                    [success, hit],
                );
            }
        }
        for (old, switches) in self.configurations.iter().zip(&self.switches) {
            for (switch, new) in switches.iter().zip(&self.configurations) {
                let Some(Switch { time, energy, success }) = switch else { continue };
                check(
                    &format!("the change from {} to {}", old.name, new.name),
                    [time, energy],
                    [success, &one],
                );
            }
        }
        if let Some(loss) = &self.loss {
            check("the loss of the component", [&zero, &zero], [&loss.rate, &one]);
        }
        if problems.is_empty() { Ok(self) } else { Err(problems.into()) }
    }

    /// Returns the mission in which all configurations that need `component` are unavailable.
    #[must_use]
    pub fn without(&self, component: &str) -> Self {
        let mut result = self.clone();
        for configuration in &mut result.configurations {
            configuration.available &= !configuration.components.iter().any(|needed| needed == component);
        }
        result
    }
}

fn battery_levels(name: &str, levels: &BigRational) -> Result<u32, Errors> {
    levels.to_integer().to_u32().ok_or_else(|| {
        let text = format!("`{name}` is {levels} battery levels; it must be between 0 and {}", u32::MAX);
        vec![Message::error("M122", text)].into()
    })
}

pub(super) fn fits(places: usize, configurations: usize) -> Result<(), Errors> {
    if places <= MAX_PLACES && configurations <= MAX_CONFIGURATIONS {
        return Ok(());
    }
    let text = format!(
        "a process has at most {MAX_PLACES} places and {MAX_CONFIGURATIONS} configurations, not {places} and {configurations}"
    );
    Err(vec![Message::error("M127", text)].into())
}

/// Returns an error if the domain or the problem has constraints or timed initial literals, which the process does not
/// represent.
fn conditions_on_time(domain: &Domain, problem: &Problem) -> Option<Message> {
    let is_timed = problem.init.iter().any(|element| matches!(element, InitialElement::Timed(..)));
    let is_refused = is_timed || !problem.constraints.is_empty() || !domain.constraints.is_empty();
    let text = "a process of places has no constraints or timed initial literals";
    is_refused.then(|| Message::error("M127", text))
}

/// Sorts names by the part before the first digit (shorter parts first); with equal parts, `l2` precedes `l10`.
/// Removes duplicates.
fn natural(names: &mut Vec<String>) {
    let key = |name: &String| {
        let digits = name.trim_start_matches(|c: char| !c.is_ascii_digit());
        (name.len() - digits.len(), name[..name.len() - digits.len()].to_owned(), digits.len(), name.clone())
    };
    names.sort_by_key(key);
    names.dedup();
}

pub(super) fn components(view: &View<'_>, design: &str) -> Vec<String> {
    let declared = view.function_designs().into_iter().find(|candidate| candidate.individual.name == design);
    declared
        .map(|declared| declared.components.iter().map(|component| component.name.clone()).collect())
        .unwrap_or_default()
}

pub(super) struct Facts {
    facts: BTreeMap<String, Vec<Vec<String>>>,
    values: BTreeMap<Vec<String>, BigRational>,
}

impl Facts {
    pub fn new(problem: &Problem) -> Self {
        let mut result = Self { facts: BTreeMap::new(), values: BTreeMap::new() };
        for element in &problem.init {
            match element {
                InitialElement::Fact(atom) => {
                    let (name, arguments) = words(atom);
                    result.facts.entry(name).or_default().push(arguments);
                }
                InitialElement::Value(atom, value, _) => {
                    let (name, arguments) = words(atom);
                    let key = std::iter::once(name).chain(arguments).collect();
                    result.values.insert(key, value.clone());
                }
                _ => {}
            }
        }
        result
    }

    fn arcs(&self, roles: &Roles, places: &[String], designs: &[String]) -> Result<Vec<Arc>, Errors> {
        let index = |names: &[String], name: &str| {
            names.iter().position(|candidate| candidate == name).unwrap_or_default()
        };
        let (place, design) = (|name: &str| index(places, name), |name: &str| index(designs, name));
        let mut problems = Vec::new();
        let mut arcs: BTreeMap<(usize, usize), Arc> = BTreeMap::new();
        for arguments in self.of(&roles.suits) {
            let [name, from, to] = &arguments[..] else { continue };
            let value = |role: &str| self.value(role, &[from, to, name]);
            let Some(time) = value(&roles.time) else {
                let text = format!("`({} {from} {to} {name})` has no value", roles.time);
                problems.push(Message::error("M137", text));
                continue;
            };
            let traversal = Traversal {
                time,
                energy: value(&roles.energy).unwrap_or_else(BigRational::zero),
                success: value(&roles.success).unwrap_or_else(BigRational::one),
                hit: value(&roles.hit).unwrap_or_else(BigRational::zero),
            };
            let key = (place(from), place(to));
            let arc = arcs.entry(key).or_insert_with(|| Arc {
                from: key.0,
                to: key.1,
                by: vec![None; designs.len()],
            });
            arc.by[design(name)] = Some(traversal);
        }
        if problems.is_empty() { Ok(arcs.into_values().collect()) } else { Err(problems.into()) }
    }

    fn of(&self, name: &str) -> &[Vec<String>] {
        self.facts.get(&name.to_ascii_lowercase()).map_or(&[], Vec::as_slice)
    }

    fn single(&self, name: &str) -> Option<String> {
        self.of(name).first().and_then(|arguments| arguments.last().cloned())
    }

    pub fn value(&self, name: &str, arguments: &[&String]) -> Option<BigRational> {
        let mut key = vec![name.to_ascii_lowercase()];
        key.extend(arguments.iter().map(|argument| (*argument).clone()));
        self.values.get(&key).cloned()
    }
}

fn words(atom: &Atom) -> (String, Vec<String>) {
    let argument = |term: &Term| term.name().to_string();
    (atom.predicate.name.as_str().to_ascii_lowercase(), atom.arguments.iter().map(argument).collect())
}

/// Returns the place of a goal that is a single fact `(location PLACE)`.
fn goal(condition: &Condition, location: &str) -> Option<String> {
    match condition {
        Condition::Atom(atom) => {
            let (name, arguments) = words(atom);
            arguments.last().filter(|_| name == location.to_ascii_lowercase()).cloned()
        }
        Condition::And(parts) => match &parts[..] {
            [part] => goal(part, location),
            _ => None,
        },
        _ => None,
    }
}
