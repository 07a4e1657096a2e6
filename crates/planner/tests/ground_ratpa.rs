//! The ground task of generated missions against instantiation by brute force: the same reachable
//! atoms and the same operators, once the choices of function designs are multiplied out.
//!
//! The oracle only reads the syntax tree: it binds parameters one by one, evaluates static
//! conditions, and repeats relaxed reachability with intervals of numbers until nothing is added.
//! Atoms without influence on the goal are left out by its own definition of that. The missions
//! come from a script that is not part of the project.

#![expect(clippy::print_stdout, reason = "a skipped test says so")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use metaplan_planner::{GroundConfig, Task, ground};
use pddl::ast::{
    ActionBody, Arithmetic, Assignment, Atom, Comparison, Condition, Domain, Effect, Expression,
    InitialElement, Name, Problem, Term,
};
use pddl::{Source, read, render};

const TOOL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/tools/gen_ratpa.py");

type Fact = (String, Vec<usize>);
type Interval = (f64, f64);

/// The parts of a condition or an effect that matter here; the missions have no others.
#[derive(Default)]
struct Schema<'d> {
    name: String,
    parameters: Vec<(Name, Vec<usize>)>,
    conditions: Vec<&'d Condition>,
    added: Vec<&'d Atom>,
    deleted: Vec<&'d Atom>,
    changes: Vec<(Assignment, &'d Atom, &'d Expression)>,
}

struct Instance {
    schema: usize,
    arguments: Vec<usize>,
    needs: BTreeSet<Fact>,
    adds: BTreeSet<Fact>,
    deletes: BTreeSet<Fact>,
}

struct World<'d> {
    objects: Vec<String>,
    schemas: Vec<Schema<'d>>,
    facts: BTreeSet<Fact>,
    values: BTreeMap<Fact, f64>,
    /// The predicates and functions that some action changes.
    changing: BTreeSet<String>,
}

fn folded(name: &Name) -> String {
    name.as_str().to_ascii_lowercase()
}

impl<'d> World<'d> {
    fn new(domain: &'d Domain, problem: &'d Problem) -> Self {
        let entries: Vec<_> = domain.constants.iter().chain(&problem.objects).collect();
        let objects: Vec<String> = entries.iter().map(|entry| folded(&entry.identifier.name)).collect();
        let of_type = |wanted: &str| -> Vec<usize> {
            let fits = |index: &usize| {
                entries[*index].r#type.alternatives.iter().any(|one| folded(&one.name) == wanted)
            };
            (0..entries.len()).filter(fits).collect()
        };
        let mut world = Self {
            objects,
            schemas: Vec::new(),
            facts: BTreeSet::new(),
            values: BTreeMap::new(),
            changing: BTreeSet::new(),
        };
        for action in &domain.actions {
            let ActionBody::Instantaneous { precondition, effect } = &action.body else {
                panic!("no durations")
            };
            let mut schema = Schema { name: folded(&action.identifier.name), ..Schema::default() };
            for parameter in &action.parameters {
                let objects = of_type(&folded(&parameter.r#type.alternatives[0].name));
                schema.parameters.push((parameter.identifier.name.clone(), objects));
            }
            conjuncts(precondition, &mut schema.conditions);
            effects(effect, &mut schema);
            let atoms = schema.added.iter().chain(&schema.deleted);
            world.changing.extend(atoms.map(|atom| folded(&atom.predicate.name)));
            world.changing.extend(schema.changes.iter().map(|(_, target, _)| folded(&target.predicate.name)));
            world.schemas.push(schema);
        }
        for element in &problem.init {
            match element {
                InitialElement::Fact(atom) => {
                    world.facts.insert(world.fact(atom, &[], &[]).expect("ground"));
                }
                InitialElement::Value(atom, value, _) => {
                    let value = value.to_string().parse().expect("an integer");
                    world.values.insert(world.fact(atom, &[], &[]).expect("ground"), value);
                }
                InitialElement::NegatedFact(_) | InitialElement::Timed(..) => panic!("no such elements"),
            }
        }
        world
    }

    /// The atom under a binding; nothing while a variable is unbound.
    fn fact(&self, atom: &Atom, parameters: &[(Name, Vec<usize>)], bound: &[usize]) -> Option<Fact> {
        let object = |term: &Term| match term {
            Term::Variable(variable) => {
                let place = parameters.iter().position(|(name, _)| *name == variable.name).expect("declared");
                bound.get(place).copied()
            }
            Term::Constant(name) => self.objects.iter().position(|object| *object == folded(&name.name)),
        };
        let arguments = atom.arguments.iter().map(object).collect::<Option<Vec<_>>>()?;
        Some((folded(&atom.predicate.name), arguments))
    }

    /// All instances whose static conditions hold; numbers are ignored.
    fn instances(&self) -> Vec<Instance> {
        let mut found = Vec::new();
        for index in 0..self.schemas.len() {
            self.bind(index, &mut Vec::new(), &mut found);
        }
        found
    }

    fn bind(&self, index: usize, bound: &mut Vec<usize>, found: &mut Vec<Instance>) {
        let schema = &self.schemas[index];
        let fact = |atom: &Atom| self.fact(atom, &schema.parameters, bound);
        let is_static = |(name, _): &Fact| !self.changing.contains(name);
        let holds = |condition: &&Condition| match condition {
            Condition::Atom(atom) => {
                fact(atom).is_none_or(|fact| !is_static(&fact) || self.facts.contains(&fact))
            }
            Condition::Compare(..) => true,
            other => panic!("{other:?}"),
        };
        if !schema.conditions.iter().all(holds) {
            return;
        }
        if let Some((_, objects)) = schema.parameters.get(bound.len()) {
            for object in objects {
                bound.push(*object);
                self.bind(index, bound, found);
                bound.pop();
            }
            return;
        }
        let atoms = |atoms: &[&Atom]| atoms.iter().filter_map(|atom| fact(atom)).collect::<BTreeSet<_>>();
        let needs = schema.conditions.iter().filter_map(|condition| match condition {
            Condition::Atom(atom) => fact(atom).filter(|fact| !is_static(fact)),
            _ => None,
        });
        let instance = Instance {
            schema: index,
            arguments: bound.clone(),
            needs: needs.collect(),
            adds: atoms(&schema.added),
            deletes: atoms(&schema.deleted),
        };
        found.push(instance);
    }

    /// The values that an expression can have; nothing if it is undefined.
    fn interval(
        &self,
        expression: &Expression,
        instance: &Instance,
        numbers: &BTreeMap<Fact, Interval>,
    ) -> Option<Interval> {
        match expression {
            Expression::Number(value, _) => {
                let value = value.to_string().parse().expect("an integer");
                Some((value, value))
            }
            Expression::Fluent(atom) => {
                let fact = self.fact(atom, &self.schemas[instance.schema].parameters, &instance.arguments)?;
                numbers.get(&fact).copied()
            }
            Expression::Operation(operation, operands, _) => {
                let mut operands = operands.iter().map(|operand| self.interval(operand, instance, numbers));
                let first = operands.next()??;
                operands.try_fold(first, |(low, high), operand| {
                    let (other_low, other_high) = operand?;
                    match operation {
                        Arithmetic::Add => Some((low + other_low, high + other_high)),
                        Arithmetic::Multiply => {
                            let all =
                                [low * other_low, low * other_high, high * other_low, high * other_high];
                            Some((
                                all.iter().copied().fold(f64::MAX, f64::min),
                                all.iter().copied().fold(f64::MIN, f64::max),
                            ))
                        }
                        _ => panic!("{operation:?}"),
                    }
                })
            }
            other => panic!("{other:?}"),
        }
    }

    /// Whether its comparisons can hold somewhere in the intervals, and all that it changes is defined.
    fn is_possible(&self, instance: &Instance, numbers: &BTreeMap<Fact, Interval>) -> bool {
        let schema = &self.schemas[instance.schema];
        let value = |expression| self.interval(expression, instance, numbers);
        schema.changes.iter().all(|(_, _, expression)| value(expression).is_some())
            && schema.conditions.iter().all(|condition| match condition {
                Condition::Compare(Comparison::GreaterOrEqual, left, right, _) => {
                    value(left).zip(value(right)).is_some_and(|(left, right)| left.1 >= right.0)
                }
                Condition::Compare(..) => panic!("{condition:?}"),
                _ => true,
            })
    }

    /// The instances that are reached if nothing is ever deleted, and the atoms.
    fn reached<'i>(
        &self,
        instances: &'i [Instance],
        with_numbers: bool,
    ) -> (Vec<&'i Instance>, BTreeSet<Fact>) {
        let mut numbers: BTreeMap<Fact, Interval> =
            self.values.iter().map(|(fact, value)| (fact.clone(), (*value, *value))).collect();
        let mut facts = self.facts.clone();
        let (mut found, mut open): (Vec<&Instance>, Vec<&Instance>) =
            (Vec::new(), instances.iter().collect());
        if !with_numbers {
            for (fact, interval) in &mut numbers {
                if self.changing.contains(&fact.0) {
                    *interval = (f64::NEG_INFINITY, f64::INFINITY);
                }
            }
        }
        loop {
            let (now, later): (Vec<_>, Vec<_>) = open.into_iter().partition(|instance| {
                instance.needs.is_subset(&facts) && self.is_possible(instance, &numbers)
            });
            open = later;
            if now.is_empty() {
                return (found, facts);
            }
            for instance in now {
                facts.extend(instance.adds.iter().cloned());
                self.widen(instance, &mut numbers);
                found.push(instance);
            }
        }
    }

    fn widen(&self, instance: &Instance, numbers: &mut BTreeMap<Fact, Interval>) {
        let schema = &self.schemas[instance.schema];
        for (assignment, target, expression) in &schema.changes {
            let by = self.interval(expression, instance, numbers).expect("it is defined");
            let target = self.fact(target, &schema.parameters, &instance.arguments).expect("bound");
            let interval = numbers.entry(target).or_insert((0.0, 0.0));
            match assignment {
                Assignment::Assign => *interval = (interval.0.min(by.0), interval.1.max(by.1)),
                Assignment::Increase | Assignment::Decrease => {
                    let by = if *assignment == Assignment::Increase { by } else { (-by.1, -by.0) };
                    *interval = (
                        if by.0 < 0.0 { f64::NEG_INFINITY } else { interval.0 },
                        if by.1 > 0.0 { f64::INFINITY } else { interval.1 },
                    );
                }
                other => panic!("{other:?}"),
            }
        }
    }

    /// Whether something that conditions compare is changed.
    fn changes_compared(&self, instance: &Instance) -> bool {
        let compared = |name: &String| {
            self.schemas.iter().any(|schema| {
                schema.conditions.iter().any(|condition| match condition {
                    Condition::Compare(_, left, right, _) => mentions(left, name) || mentions(right, name),
                    _ => false,
                })
            })
        };
        let changes = &self.schemas[instance.schema].changes;
        changes.iter().any(|(_, target, _)| compared(&folded(&target.predicate.name)))
    }

    fn key(&self, instance: &Instance) -> (String, Vec<String>) {
        let arguments = instance.arguments.iter().map(|object| self.objects[*object].clone());
        (self.schemas[instance.schema].name.clone(), arguments.collect())
    }

    /// The same without designs.
    fn core(&self, (name, arguments): &(String, Vec<String>)) -> (String, Vec<String>) {
        let schema = self.schemas.iter().find(|schema| schema.name == *name).expect("an action");
        let kept = schema.parameters.iter().zip(arguments);
        let kept = kept.filter(|((parameter, _), _)| !parameter.as_str().starts_with("fd"));
        (name.clone(), kept.map(|(_, argument)| argument.clone()).collect())
    }

    fn show(&self, (name, arguments): &Fact) -> String {
        let words = std::iter::once(name).chain(arguments.iter().map(|object| &self.objects[*object]));
        format!("({})", words.map(String::as_str).collect::<Vec<_>>().join(" "))
    }
}

fn conjuncts<'d>(condition: &'d Condition, found: &mut Vec<&'d Condition>) {
    match condition {
        Condition::And(parts) => parts.iter().for_each(|part| conjuncts(part, found)),
        other => found.push(other),
    }
}

fn effects<'d>(effect: &'d Effect, schema: &mut Schema<'d>) {
    match effect {
        Effect::And(parts) => parts.iter().for_each(|part| effects(part, schema)),
        Effect::Add(atom) => schema.added.push(atom),
        Effect::Delete(atom) => schema.deleted.push(atom),
        Effect::Assign(assignment, target, value, _) => schema.changes.push((*assignment, target, value)),
        other => panic!("{other:?}"),
    }
}

fn mentions(expression: &Expression, name: &str) -> bool {
    match expression {
        Expression::Fluent(atom) => folded(&atom.predicate.name) == name,
        Expression::Operation(_, operands, _) => operands.iter().any(|operand| mentions(operand, name)),
        _ => false,
    }
}

/// Leaves out what has no influence on the goal: additions and deletions that nothing reads, and
/// then instances that do nothing at all (their costs are never below zero). Returns the facts that
/// are read.
fn relevant<'i>(
    world: &World<'_>,
    mut instances: Vec<&'i Instance>,
    goal: &BTreeSet<Fact>,
) -> (Vec<&'i Instance>, BTreeSet<Fact>) {
    loop {
        let read: BTreeSet<Fact> =
            instances.iter().flat_map(|instance| &instance.needs).chain(goal).cloned().collect();
        let before = instances.len();
        instances.retain(|instance| {
            let adds = instance.adds.iter().any(|fact| read.contains(fact) && !instance.needs.contains(fact));
            let deletes =
                instance.deletes.iter().any(|fact| read.contains(fact) && !instance.adds.contains(fact));
            adds || deletes || world.changes_compared(instance)
        });
        if instances.len() == before {
            return (instances, read);
        }
    }
}

fn compare(name: &str, domain: &Domain, problem: &Problem, task: &Task) {
    let world = World::new(domain, problem);
    let mut goal = Vec::new();
    conjuncts(&problem.goal, &mut goal);
    let goal: BTreeSet<Fact> = goal
        .into_iter()
        .filter_map(|condition| match condition {
            Condition::Atom(atom) => world.fact(atom, &[], &[]),
            _ => None,
        })
        .collect();
    let instances = world.instances();
    let (loose, _) = world.reached(&instances, false);
    let (strict, facts) = world.reached(&instances, true);
    let (strict, read) = relevant(&world, strict, &goal);

    let loose: BTreeSet<_> = loose.into_iter().map(|instance| world.key(instance)).collect();
    let strict: BTreeSet<_> = strict.into_iter().map(|instance| world.key(instance)).collect();
    let cores: BTreeSet<_> = strict.iter().map(|key| world.core(key)).collect();
    let ours: BTreeSet<_> = task.actions().collect();
    assert_eq!(strict.difference(&ours).next(), None, "{name}: reached, and not ground");
    // Whether the battery suffices for a combination of designs is decided step by step.
    let more: Vec<_> = ours.difference(&strict).collect();
    assert!(
        more.iter().all(|key| loose.contains(key) && cores.contains(&world.core(key))),
        "{name}: {more:?}"
    );
    assert!(more.is_empty() || name.starts_with(['n', 'f', 'o']), "{name}: {more:?}");

    let expected: BTreeSet<_> = read.intersection(&facts).map(|fact| world.show(fact)).collect();
    let atoms: BTreeSet<_> = task.atoms().map(str::to_owned).collect();
    assert_eq!(atoms, expected, "{name}");
    let counts = (task.operator_count(), ours.len());
    assert!(counts.0 <= counts.1, "{name}: {counts:?}");
}

/// Pairs of files of one mission in all encodings; empty if the script is missing.
fn mission(family: &str, seed: u64, sizes: [usize; 3], encodings: &str) -> Vec<(String, Source, Source)> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ratpa");
    let [n, m, k] = sizes.map(|size| size.to_string());
    let (name, seed) = (format!("{family}-{n}-{m}-{k}-{seed}"), seed.to_string());
    let reconfiguration = if seed.ends_with('3') && family == "ugv" { "2" } else { "0" };
    let arguments = [
        ["--family", family, "--seed", &seed],
        ["--n", &n, "--m", &m],
        ["--k", &k, "--name", &name],
        ["--enc", encodings, "--reconf", reconfiguration],
    ];
    let output = Path::new(TOOL).exists().then(|| {
        Command::new("python3").arg(TOOL).args(arguments.as_flattened()).arg("--out").arg(&folder).output()
    });
    match output {
        Some(Ok(output)) if output.status.success() => {}
        Some(Ok(output)) => panic!("{name}: {}", String::from_utf8_lossy(&output.stderr)),
        _ => {
            println!("skipped: gen_ratpa.py or python3 is absent");
            return Vec::new();
        }
    }
    let file = |encoding: &str, kind: &str| {
        let path: PathBuf = folder.join(format!("{name}.{encoding}.{kind}.pddl"));
        let text =
            std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        Source::new(kind, text)
    };
    encodings
        .split(',')
        .map(|encoding| (format!("{encoding} {seed}"), file(encoding, "domain"), file(encoding, "problem")))
        .collect()
}

fn check(family: &str, seed: u64, sizes: [usize; 3], encodings: &str) {
    for (name, domain, problem) in mission(family, seed, sizes, encodings) {
        let (domain, problem) = match read(&domain, &problem) {
            Ok((domain, problem, _)) => (domain, problem),
            Err(found) => panic!("{}", render(&found, &[&domain, &problem], false)),
        };
        let task = ground(&domain, &problem, &GroundConfig::default());
        let task = task.unwrap_or_else(|errors| panic!("{family} {name}: {errors:?}"));
        compare(&format!("{name} {family}"), &domain, &problem, &task);
    }
}

#[test]
fn missions_are_ground_as_by_brute_force() {
    for seed in 1..4 {
        let k = 1 + seed as usize % 2;
        check("ugv", seed, [4, 3, k], "c,n,f,o");
        check("uuv", seed, [1, 2, k], "c,n,f,o");
    }
    // Levels of the battery are objects: many of them.
    check("uuv", 1, [1, 1, 1], "b");
}

/// From the seed `METAPLAN_FIRST_SEED` on, if it is set, so that an interrupted run can be continued.
#[test]
#[ignore = "takes an hour; in release"]
fn two_hundred_seeds_are_ground_as_by_brute_force() {
    let first = std::env::var("METAPLAN_FIRST_SEED").map_or(1, |seed| seed.parse().expect("a seed"));
    for seed in first..=200 {
        let by = |count: usize| seed as usize % count;
        check("ugv", seed, [4 + by(5), 2 + by(3), 1 + by(3)], "c,n,f,o");
        check("ugv", seed, [4 + by(2), 2 + by(2), 1 + by(2)], "b");
        check("uuv", seed, [1 + by(2), 1 + by(4), 1 + by(2)], "c,b,n,f,o");
        println!("seed {seed}");
    }
}
