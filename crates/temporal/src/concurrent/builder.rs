//! Builder of the temporal task: pairs starts with ends, and computes the read and write sets of
//! all operators.

use rustc_hash::{FxHashMap, FxHashSet};
use task::context::Context;
use task::error::{Error, Errors};
use task::ground::evaluate::reads::Reads;
use task::ground::vocabulary::atom::{AtomId, Binding};
use task::ground::vocabulary::reached::RelaxedReachability;
use task::ground::vocabulary::world::World;
use task::lifted::{Change, Effect, Expression, ObjectId, Rational};
use task::limits::Limits;
use task::number::dense;
use task::task::quantity::NumericId;
use task::task::{Argument, Operator, OperatorId, Task};

use crate::concurrent::duration_fluents::{DURATION_PREFIX, FLEXIBLE_DURATION_PREFIX, depends_on_state};
use crate::concurrent::footprint::{Footprint, Footprints};
use crate::concurrent::happening::{Happening, Instance, Role};
use crate::concurrent::interference::{Designs, Keys, prune};
use crate::concurrent::split::{Half, Split};
use crate::concurrent::time_number::TimeNumber;
use crate::concurrent::unit::{StaticDurations, Unit};

/// The operators into which an action instance is split: starts, over-all condition and ends. There are
/// several starts and ends if numeric effects are conditional.
#[derive(Clone, Default)]
struct Halves {
    starts: Vec<OperatorId>,
    over_all: Option<OperatorId>,
    ends: Vec<OperatorId>,
}

fn object(argument: Argument) -> Option<ObjectId> {
    if let Argument::Object(object) = argument { Some(object) } else { None }
}

fn designs(task: &Task, operator: OperatorId) -> Designs {
    let configuration = &task.operators[operator.index()].configuration;
    let mut designs: Designs =
        configuration.iter().filter_map(|(function, design)| Some((*function, object(*design)?))).collect();
    designs.sort_unstable();
    designs
}

fn binding(operator: &Operator, variables: usize) -> Binding {
    let mut binding: Binding = operator.arguments.iter().copied().map(object).collect();
    binding.resize(variables, None);
    binding
}

type InstanceKey = (usize, Vec<ObjectId>);

pub(super) struct Builder<'a> {
    footprints: Footprints<'a>,
    split: &'a Split,
    written: Vec<Footprint>,
    /// Operators of duration 0 that combine a start and an end, with the write sets of start and
    /// end.
    joined: Vec<(OperatorId, [Footprint; 2])>,
    instances: FxHashMap<InstanceKey, Halves>,
    order: Vec<InstanceKey>,
    /// Schemas of the domain whose over-all condition can change.
    held: FxHashSet<usize>,
}

impl<'a> Builder<'a> {
    pub(super) fn new(split: &'a Split, reached: &'a RelaxedReachability, limits: &'a Limits) -> Self {
        let over_all_origins = split.origins.iter().filter(|origin| origin.half == Half::OverAll);
        Self {
            footprints: Footprints::new(World::new(&split.lifted, reached, limits)),
            split,
            written: Vec::new(),
            joined: Vec::new(),
            instances: FxHashMap::default(),
            order: Vec::new(),
            held: over_all_origins.map(|origin| origin.schema).collect(),
        }
    }

    pub(super) fn collect(&mut self, context: Context<'_>) -> Result<(), Errors> {
        let Context { task, limits } = context;
        let mut errors = Vec::new();
        let mut refused = FxHashSet::default();
        for item in limits.watch(task.operators.iter().zip((0..).map(OperatorId))) {
            let (operator, id) = item?;
            let origin = self.split.origins[operator.schema as usize];
            let schema = &self.split.lifted.schemas[operator.schema as usize];
            let arguments: Vec<ObjectId> = operator.arguments.iter().copied().filter_map(object).collect();
            let mut binding: Binding = arguments.iter().map(|object| Some(*object)).collect();
            binding.resize(schema.variables, None);
            let is_none = matches!(origin.half, Half::OverAll | Half::Choice | Half::Judge);
            let effects = if is_none { &[] } else { &schema.end_effects[..] };
            // Auxiliary predicates (running actions, event counters, waiting) do not occur in the
            // PDDL files, so a plan validator does not require a separation for them.
            let time = (!self.split.events.is_empty()).then_some(self.split.lifted.time);
            let is_auxiliary =
                |predicate| time.is_some_and(|time| [time.phase, time.waited].contains(&predicate));
            let effects: Vec<Effect> = effects
                .iter()
                .filter(|effect| match effect.change {
                    Change::Add(predicate, _) | Change::Delete(predicate, _) => {
                        !is_auxiliary(predicate) && !self.split.lifted.predicates[predicate.index()].running
                    }
                    Change::Assign { function, .. } => !self.split.durations.contains(&function),
                })
                .cloned()
                .collect();
            let written = self.footprints.writes(&effects, &binding).and_then(|footprint| {
                if origin.half == Half::Whole {
                    self.join(id, origin.schema, &binding)?;
                }
                Ok(footprint)
            });
            match written {
                Ok(footprint) => self.written.push(footprint),
                Err(error) => {
                    if refused.insert(origin.schema) {
                        errors.push(error);
                    }
                    self.written.push(Footprint::default());
                }
            }
            if matches!(origin.half, Half::Whole | Half::Timed(_) | Half::Choice | Half::Judge) {
                continue;
            }
            let key = (origin.schema, arguments);
            if !self.instances.contains_key(&key) {
                self.order.push(key.clone());
            }
            let halves = self.instances.entry(key).or_default();
            match origin.half {
                Half::Start => halves.starts.push(id),
                Half::End => halves.ends.push(id),
                _ => halves.over_all = Some(id),
            }
        }
        if errors.is_empty() { Ok(()) } else { Err(errors.into()) }
    }

    /// Creates a start and an end for each combination of a start and an end of an instance, by copying
    /// operators. An instance has several of them if its numeric effects are conditional. Returns `true` if
    /// any operator was copied. Simultaneous runs of different combinations are not searched.
    pub(super) fn pair(&mut self, task: &mut Task) -> bool {
        let before = task.operators.len();
        for key in &self.order {
            let Some(halves) = self.instances.get_mut(key) else { continue };
            let mut copy = |original: OperatorId| {
                task.operators.push(task.operators[original.index()].clone());
                self.written.push(self.written[original.index()].clone());
                OperatorId(dense(task.operators.len().saturating_sub(1)))
            };
            let (mut starts, mut ends) = (Vec::new(), Vec::new());
            for (first, start) in halves.starts.iter().enumerate() {
                for (second, end) in halves.ends.iter().enumerate() {
                    starts.push(if second == 0 { *start } else { copy(*start) });
                    ends.push(if first == 0 { *end } else { copy(*end) });
                }
            }
            (halves.starts, halves.ends) = (starts, ends);
        }
        task.operators.len() > before
    }

    pub(super) fn instances<T: TimeNumber>(
        &self,
        context: Context<'_>,
        (unit, separation): (&Unit, T),
        fixed: &StaticDurations,
        roles: &mut [Role],
    ) -> Result<Vec<Instance<T>>, Error> {
        let Context { task, limits } = context;
        let mut instances = Vec::new();
        let pairs = self.order.iter().flat_map(|key| {
            let Halves { starts, over_all, ends } = &self.instances[key];
            starts.iter().zip(ends).map(move |(start, end)| (key, *start, *over_all, *end))
        });
        for pair in limits.watch(pairs) {
            let (key, start, over_all, end) = pair?;
            // Without this operator, the over-all condition is unreachable.
            if self.held.contains(&key.0) && over_all.is_none() {
                continue;
            }
            let unit_divisor = Rational::from_integer(1);
            let divisor = fixed.divisors.get(&start).unwrap_or(&unit_divisor);
            let schema = &self.split.schemas[key.0];
            let placed = |error: Error| error.within(&format!("`{}`", schema.name), Some(schema.place));
            let factor = |timer| unit.factor::<T>(task, timer, divisor).map(|factor| (timer, factor));
            let is_chosen = self.split.chosen[key.0];
            // The duration variable is found in the effects of an operator. A start assigns the duration only if it
            // depends on the state. If the planner chooses the duration, only the end assigns the variable: it resets
            // it to 0.
            let timer = timer(task, if is_chosen { end } else { start });
            let timer = timer.map(factor).transpose().map_err(placed)?;
            // A duration that depends on the state is compared with the separation when the action
            // starts.
            let duration = match timer {
                None if !is_chosen => {
                    let duration = fixed.durations.get(&start).ok_or_else(|| Error::overflow("a duration"));
                    duration.and_then(|duration| unit.of::<T>(duration)).map_err(placed)?
                }
                _ => separation,
            };
            if duration < separation {
                let construct =
                    format!("an instance of `{}` that takes less time than the separation", schema.name);
                let instead = "a smaller `--epsilon`".into();
                return Err(Error::Unsupported { construct, instead, place: schema.place });
            }
            roles[start.index()] = Role::Start(dense(instances.len()));
            roles[end.index()] = Role::End(dense(instances.len()));
            let designs = designs(task, start);
            let joint = Vec::new();
            instances.push(Instance {
                start,
                end,
                over_all,
                duration,
                timer,
                is_chosen,
                designs,
                joint,
                most: 1,
                under_way: None,
                counts_by_end: false,
                compressible: false,
            });
        }
        Ok(instances)
    }

    fn join(&mut self, id: OperatorId, schema: usize, binding: &Binding) -> Result<(), Error> {
        let schema = &self.split.schemas[schema];
        if schema.duration.is_some() {
            let start = self.footprints.writes(&schema.start_effects, binding)?;
            let end = self.footprints.writes(&schema.end_effects, binding)?;
            self.joined.push((id, [start, end]));
        }
        Ok(())
    }

    /// Durations that do not depend on the state, and divisors of those that do.
    ///
    /// # Errors
    /// Fails if a divisor is not a positive constant, a duration cannot be computed, or a limit is reached.
    pub(super) fn static_durations(
        &mut self,
        Context { task, limits }: Context<'_>,
    ) -> Result<StaticDurations, Error> {
        let mut fixed = StaticDurations::default();
        let depends = |duration| depends_on_state(&self.split.lifted, duration);
        let schemas = &self.split.schemas;
        let is_static: Vec<bool> = schemas
            .iter()
            .map(|schema| schema.duration.as_ref().is_some_and(|duration| !depends(duration)))
            .collect();
        for key in limits.watch(&self.order) {
            let key = key?;
            let schema = &self.split.schemas[key.0];
            let starts = &self.instances[key].starts;
            let Some(start) = starts.first() else { continue };
            let binding = binding(&task.operators[start.index()], schema.variables);
            let duration = match schema.duration.as_ref().filter(|_| is_static[key.0]) {
                Some(Expression::Number(number)) => Some(number.clone()),
                Some(duration) => self.footprints.constant(duration, &binding)?,
                None => None,
            };
            if let Some(duration) = duration {
                fixed.durations.extend(starts.iter().map(|start| (*start, duration.clone())));
            }
            let Some(divisor) = &self.split.divisors[key.0] else { continue };
            let divisor = self.footprints.constant(divisor, &binding)?.filter(Rational::is_positive);
            let divisor = divisor.ok_or_else(|| Error::Unsupported {
                construct: format!("a duration of `{}` that is divided by no positive number", schema.name),
                instead: "a positive divisor".into(),
                place: schema.place,
            })?;
            fixed.divisors.extend(starts.iter().map(|start| (*start, divisor.clone())));
        }
        Ok(fixed)
    }

    /// Operators of duration 0 whose start and end interfere, although both are one happening.
    pub(super) fn contradictory(&self, context: Context<'_>) -> Result<FxHashSet<OperatorId>, Error> {
        let Context { task, limits } = context;
        let index = self.footprints.index();
        let contradicts = |(id, [start, end]): &(OperatorId, [Footprint; 2])| {
            let operator = &task.operators[id.index()];
            let schema = &self.split.schemas[self.split.origins[operator.schema as usize].schema];
            let binding = binding(operator, schema.variables);
            let complete = |written: &Footprint, condition, effects, duration: Option<&Expression>| {
                let mut reads = Reads::default();
                reads.condition(&self.split.lifted, condition, &binding);
                reads.effects(&self.split.lifted, effects, &binding);
                if let Some(duration) = duration {
                    reads.expression(duration, &binding);
                }
                let (reads, reads_numbers) = index.look_up(&reads);
                Footprint { reads, reads_numbers, ..written.clone() }
            };
            let duration = schema.duration.as_ref();
            let start = complete(start, &schema.start_condition, &schema.start_effects, duration);
            start.interferes(&complete(end, &schema.at_end, &schema.end_effects, None)).then_some(*id)
        };
        let contradictory = limits.watch(&self.joined).filter_map(|pair| match pair {
            Ok(pair) => contradicts(pair).map(Ok),
            Err(interrupted) => Some(Err(interrupted.into())),
        });
        contradictory.collect()
    }

    /// Returns `true` if some write set contains an effect whose condition depends on the state.
    pub(super) fn assumes_conflicts(&self) -> bool {
        self.footprints.supposes
    }

    /// Returns the temporal properties of each operator, and the number of access keys. Also sets
    /// [`Instance::joint`].
    pub(super) fn happenings<T: TimeNumber>(
        mut self,
        context: Context<'_>,
        separation: T,
        roles: &[Role],
        instances: &mut [Instance<T>],
    ) -> Result<(Vec<Happening<T>>, usize), Error> {
        let Context { task, limits } = context;
        let whole = (0..roles.len()).filter(|id| roles[*id] == Role::Whole);
        let whole = whole.flat_map(|id| designs(task, OperatorId::of(id)));
        let used = instances.iter().flat_map(|instance| instance.designs.iter().copied());
        let mut keys = Keys::new(separation, used.chain(whole).collect());
        let index = self.footprints.index();
        let mut happenings = Vec::new();
        let written = std::mem::take(&mut self.written);
        for item in limits.watch((0..).map(OperatorId).zip(roles.iter().zip(written))) {
            let (id, (role, mut written)) = item?;
            let mut happening = Happening { role: *role, ..Happening::default() };
            if let Role::Timed(_) = role {
                happening.accesses = keys.of(&written);
                happening.writes = writes(&written);
            } else if let Some((reads, over_all)) = self.reads(task, id, *role) {
                (written.reads, written.reads_numbers) = index.look_up(&reads);
                let over_all = index.look_up(&over_all);
                happening.accesses = keys.of(&written);
                join(&mut happening, &mut keys, &over_all, instances, (task, id));
                happening.writes = writes(&written);
            }
            happenings.push(happening);
        }
        prune(happenings.iter_mut().map(|happening| &mut happening.accesses));
        Ok((happenings, keys.len()))
    }

    /// Returns what an operator reads in its happening (start, end or both), and what its over-all condition reads.
    /// Returns `None` if the operator never happens or is a timed initial literal.
    fn reads(&self, task: &Task, id: OperatorId, role: Role) -> Option<(Reads, Reads)> {
        let operator = &task.operators[id.index()];
        let origin = self.split.origins[operator.schema as usize];
        let schema = self.split.schemas.get(origin.schema).filter(|_| role != Role::Never)?;
        let lifted = &self.split.lifted;
        let binding = binding(operator, schema.variables);
        let (mut reads, mut over_all) = (Reads::default(), Reads::default());
        if !matches!(role, Role::End(_)) {
            reads.condition(lifted, &schema.start_condition, &binding);
            reads.effects(lifted, &schema.start_effects, &binding);
            if let Some(duration) = &schema.duration {
                reads.expression(duration, &binding);
            }
        }
        if !matches!(role, Role::Start(_)) {
            reads.condition(lifted, &schema.at_end, &binding);
            reads.effects(lifted, &schema.end_effects, &binding);
        }
        over_all.condition(lifted, &schema.over_all, &binding);
        Some((reads, over_all))
    }
}

/// Number that holds the duration of an instance, i.e. a duration variable that the operator `id`
/// sets or clears. Returns `None` if the duration is constant.
fn timer(task: &Task, id: OperatorId) -> Option<NumericId> {
    let mut variables = task.operators[id.index()].numeric_effects.iter().map(|effect| effect.variable);
    variables.find(|number| {
        let name = &task.number_names[number.index()];
        name.starts_with(DURATION_PREFIX) || name.starts_with(FLEXIBLE_DURATION_PREFIX)
    })
}

/// Adds the interference constraints of over-all conditions (with the reads `over_all`) and of
/// designs to a happening. Also sets [`Instance::joint`].
fn join<T: TimeNumber>(
    happening: &mut Happening<T>,
    keys: &mut Keys<T>,
    over_all: &(Vec<AtomId>, Vec<NumericId>),
    instances: &mut [Instance<T>],
    (task, id): (&Task, OperatorId),
) {
    let accesses = &mut happening.accesses;
    match happening.role {
        Role::Start(instance) => {
            let instance = &mut instances[instance as usize];
            accesses.join(&keys.over_all(over_all));
            accesses.after.extend(keys.designs(&instance.designs));
            happening.designs.clone_from(&instance.designs);
            if instance.over_all.is_some_and(|id| is_joint(task, id)) {
                instance.joint = ids(&over_all.0, over_all.1.iter().copied());
            }
        }
        Role::End(instance) => {
            accesses.marks.extend(keys.over_all(over_all).marks);
            accesses.marks.extend(keys.used(&instances[instance as usize].designs, false));
        }
        _ => {
            happening.designs = designs(task, id);
            accesses.after.extend(keys.designs(&happening.designs));
            accesses.marks.extend(keys.used(&happening.designs, true));
        }
    }
}

/// Returns `true` if several simultaneous happenings can maintain the condition of `over_all`
/// jointly, because it has a disjunction, a comparison or a derived fact.
fn is_joint(task: &Task, over_all: OperatorId) -> bool {
    let condition = &task.operators[over_all.index()].condition;
    !condition.clauses.is_empty()
        || !condition.comparisons.is_empty()
        || condition.facts.iter().any(|fact| fact.variable.index() >= task.basic)
}

fn writes(written: &Footprint) -> Vec<u32> {
    let atoms: Vec<AtomId> = written.added.iter().chain(&written.deleted).copied().collect();
    ids(&atoms, written.numbers.iter().map(|(number, _)| *number))
}

/// Common numbering of atoms and numbers, ascending: `2a` for atom `a`, `2n + 1` for number `n`.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "atoms and numbers are held in memory with their names: there are fewer than 2^31"
)]
fn ids(atoms: &[AtomId], numbers: impl Iterator<Item = NumericId>) -> Vec<u32> {
    let atoms = atoms.iter().map(|atom| 2 * atom.0);
    let mut ids: Vec<u32> = atoms.chain(numbers.map(|number| 2 * number.0 + 1)).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}
