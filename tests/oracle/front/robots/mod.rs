//! Samples of robots' missions with a knowledge base: in the explicit form, in the native form with contexts,
//! and with bindings and name maps.
//!
//! A robot with a battery moves over a map. Moving requires one or two functions. Their designs differ in
//! slowness, energy and safety, and require components and visibility. A change of design can have a price.
//! The oracle is Dijkstra's algorithm over place, battery and current designs, written from the documentation
//! of plain domains and bindings.

mod files;

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use std::path::Path;

use fastrand::Rng;
use metaplan::knowledge::{COADAPTATION, Knowledge, Sources};
use metaplan::mission::{Bindings, Mission, Names};
use ontology::ReadOptions;
use pddl::Source;
use rules::Limits as StepLimits;

use super::{Reference, Sample, whole};
use crate::judge::Mode;

const FULL: i64 = 12;
/// Price of charging, or its duration in timed missions.
const CHARGING: i64 = 5;
const PLACES: usize = 4;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Designs are parameters of actions.
    Explicit,
    /// The domain does not mention designs.
    Native,
    /// Explicit form with other names for types, predicates and functions.
    Renamed,
    /// Native form with other names for functions and actions.
    NativeBound,
}

impl Form {
    fn is_native(self) -> bool {
        matches!(self, Self::Native | Self::NativeBound)
    }

    fn is_bound(self) -> bool {
        matches!(self, Self::Renamed | Self::NativeBound)
    }
}

#[derive(Debug, Clone)]
struct Design {
    function: usize,
    slowness: i64,
    energy: i64,
    safety: Option<i64>,
    change: i64,
    component: Option<usize>,
    /// Minimum visibility, if any.
    visibility: Option<i64>,
}

#[derive(Debug)]
pub struct Robot {
    form: Form,
    functions: usize,
    designs: Vec<Design>,
    /// Minimum safety of a design on narrow ways.
    safety: i64,
    /// Maximum energy of each design at quiet places, if any.
    quiet: Option<i64>,
    /// Maximum slowness of each design at all places, if any.
    quick: Option<i64>,
    /// Whether a change of design has a price.
    reconfiguration: bool,
    /// Whether moving takes time. The metric then contains the total time.
    is_timed: bool,
    knowledge: Knowledge,
}

#[derive(Debug)]
struct Situation {
    /// For each connected pair of places: `true` for a narrow way, and the length.
    ways: BTreeMap<(usize, usize), (bool, i64)>,
    quiet: BTreeSet<usize>,
    charger: usize,
    battery: i64,
    failed: BTreeSet<usize>,
    visibility: i64,
}

impl Robot {
    pub fn new(seed: u64, form: Form, directory: &Path) -> Self {
        let mut rng = Rng::with_seed(seed);
        let functions = rng.usize(1..3);
        let mut designs = Vec::new();
        for function in 0..functions {
            for number in 0..rng.usize(2..5) {
                // The first design of a function needs no component, so failures do not affect it.
                let is_first = number == 0;
                designs.push(Design {
                    function,
                    slowness: rng.i64(1..5),
                    energy: rng.i64(1..5),
                    safety: (function == 0 && (is_first || rng.u32(0..5) > 0)).then(|| rng.i64(0..5)),
                    change: rng.i64(0..4),
                    component: (!is_first && rng.u32(0..3) == 0).then(|| rng.usize(0..2)),
                    visibility: (rng.u32(0..4) == 0).then(|| rng.i64(1..4)),
                });
            }
        }
        let (safety, reconfiguration, is_timed) = (rng.i64(1..4), rng.bool(), rng.bool());
        let (quiet, quick) = (rng.bool().then(|| rng.i64(1..4)), rng.bool().then(|| rng.i64(3..5)));
        let text = Self::document(form, functions, &designs, [Some(safety), quiet, quick]);
        let file = directory.join("kb.ttl");
        std::fs::write(&file, text).expect("a file");
        let sources = Sources {
            documents: vec![file],
            rules: vec![COADAPTATION.to_owned()],
            options: ReadOptions::default(),
            limits: StepLimits::default(),
        };
        let knowledge = Knowledge::read(&sources).expect("a knowledge base");
        Self { form, functions, designs, safety, quiet, quick, reconfiguration, is_timed, knowledge }
    }

    pub fn sample(&self, seed: u64) -> Sample {
        // The random numbers of the situation must differ from those of the robot, so the seed is changed.
        let mut rng = Rng::with_seed(seed ^ 0x0b07);
        let situation = Situation::new(&mut rng);
        let (domain, problem) = self.files(&situation);
        let mut mission = Mission::new(
            "robot",
            Some(Ok(self.knowledge.clone())),
            self.bindings(),
            Ok(Source::new("domain.pddl", self.renamed(&domain))),
            Ok(Source::new("problem.pddl", self.renamed(&problem))),
        )
        .unwrap_or_else(|messages| panic!("{messages:#?}\n{domain}\n{problem}"));
        for component in &situation.failed {
            mission.fail(&format!("c{component}")).expect("a component");
        }
        mission.set("visibility", &situation.visibility.to_string()).expect("an attribute");
        if self.form.is_bound() {
            mission.set("watt_hours", &situation.battery.to_string()).expect("an attribute");
        }
        Sample {
            mission,
            mode: Mode::Sequential,
            maximize: false,
            reference: Reference::All(self.best(&situation).map(whole)),
        }
    }

    fn bindings(&self) -> Bindings {
        let bound: &[(&str, &str)] = match self.form {
            Form::Native if self.reconfiguration => &[("reconfigured", "reconfigured:change")],
            Form::Explicit | Form::Native => &[],
            Form::Renamed => &[
                ("means", "class:FunctionDesign"),
                ("role", "class:Function"),
                ("good_for", "solves"),
                ("usable", "available"),
                ("slow", "estimation:slowness"),
                ("hunger", "estimation:energy"),
                ("charge_left", "measured:watt_hours"),
            ],
            Form::NativeBound if self.reconfiguration => &[
                ("go", "action:a_move"),
                ("slow", "chosen:slowness"),
                ("hunger", "chosen:energy"),
                ("charge_left", "measured:watt_hours"),
                ("reconfigured", "reconfigured:change"),
            ],
            Form::NativeBound => &[
                ("go", "action:a_move"),
                ("slow", "chosen:slowness"),
                ("hunger", "chosen:energy"),
                ("charge_left", "measured:watt_hours"),
            ],
        };
        let owned = |(name, query): &(&str, &str)| ((*name).to_owned(), (*query).to_owned());
        let bindings = Bindings::with(&bound.iter().map(owned).collect()).expect("bindings");
        if self.form != Form::Renamed {
            return bindings;
        }
        let mut names = Names::default();
        names.add("k*", "*", None);
        names.add("kd0", "prime", None);
        bindings.naming(names)
    }

    /// Returns the combinations of designs, one per function, with which the robot can leave `from` on a
    /// narrow or wide way.
    fn configurations(&self, situation: &Situation, from: usize, is_narrow: bool) -> Vec<Vec<usize>> {
        let is_suitable = |design: &Design| {
            let has_component =
                design.component.is_none_or(|component| !situation.failed.contains(&component));
            let has_visibility = design.visibility.is_none_or(|min| situation.visibility >= min);
            // Only designs of function 0 have an estimated safety, and only they must be safe.
            let is_safe = !is_narrow
                || design.function != 0
                || design.safety.is_some_and(|safety| safety >= self.safety);
            let is_silent =
                self.quiet.is_none_or(|max| !situation.quiet.contains(&from) || design.energy <= max);
            let is_quick = self.quick.is_none_or(|max| design.slowness <= max);
            has_component && has_visibility && is_safe && is_silent && is_quick
        };
        let mut combinations = vec![Vec::new()];
        for function in 0..self.functions {
            let candidates = self.designs.iter().enumerate();
            let candidates: Vec<usize> = candidates
                .filter(|(_, design)| design.function == function && is_suitable(design))
                .map(|(at, _)| at)
                .collect();
            combinations = combinations
                .iter()
                .flat_map(|partial| candidates.iter().map(move |at| [&partial[..], &[*at]].concat()))
                .collect();
        }
        combinations
    }

    fn best(&self, situation: &Situation) -> Option<i64> {
        /// State of the search: place, battery, and current design of each function.
        type Node = (usize, i64, Vec<Option<usize>>);
        let start: Node = (0, situation.battery, vec![None; self.functions]);
        let mut open = BinaryHeap::from([Reverse((0, start))]);
        let mut closed = BTreeSet::new();
        while let Some(Reverse((cost, state))) = open.pop() {
            let (place, battery, at_work) = &state;
            if *place == PLACES - 1 {
                return Some(cost);
            }
            if !closed.insert(state.clone()) {
                continue;
            }
            if *place == situation.charger {
                open.push(Reverse((cost + CHARGING, (*place, FULL, at_work.clone()))));
            }
            for ((from, to), (is_narrow, length)) in &situation.ways {
                if from != place {
                    continue;
                }
                for configuration in self.configurations(situation, *from, *is_narrow) {
                    let sum = |value: &dyn Fn(&Design) -> i64| -> i64 {
                        configuration.iter().map(|design| value(&self.designs[*design])).sum()
                    };
                    let remaining = battery - length * sum(&|design| design.energy);
                    if remaining < 0 {
                        continue;
                    }
                    let mut price = length + length * sum(&|design| design.slowness);
                    let mut next = at_work.clone();
                    // The first design of a function is free; only replacements have a price.
                    if self.reconfiguration {
                        for (current, design) in next.iter_mut().zip(&configuration) {
                            if current.is_some_and(|current| current != *design) {
                                price += self.designs[*design].change;
                            }
                            *current = Some(*design);
                        }
                    }
                    open.push(Reverse((cost + price, (*to, remaining, next))));
                }
            }
        }
        None
    }
}

impl Situation {
    fn new(rng: &mut Rng) -> Self {
        let mut ways = BTreeMap::new();
        for a in 0..PLACES {
            for b in 0..PLACES {
                if a != b && rng.bool() {
                    ways.insert((a, b), (rng.u32(0..3) == 0, rng.i64(1..4)));
                }
            }
        }
        Self {
            ways,
            quiet: (0..PLACES).filter(|_| rng.u32(0..4) == 0).collect(),
            charger: rng.usize(0..PLACES),
            battery: rng.i64(4..=FULL),
            failed: (0..2).filter(|_| rng.u32(0..3) == 0).collect(),
            visibility: rng.i64(0..5),
        }
    }
}
