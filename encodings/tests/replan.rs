//! The live planner against planning anew: the same plan, for random changes of state and availability.
#![expect(clippy::print_stdout, reason = "times are what one of these tests is for")]

#[expect(dead_code, reason = "the oracle is for other tests")]
mod missions;
mod random;

use metaplan_encodings::pddl::ast::{Atom, Domain, Identifier, InitialElement, Name, Problem, Span, Term};
use metaplan_encodings::pddl::{Source, read};
use metaplan_encodings::validate::metric_after;
use metaplan_encodings::{
    Config, GroundConfig, Limits, Query, Replanned, Replanner, Solution, Status, alternatives, ground,
    optimize,
};
use missions::Mission;
use num_rational::BigRational;
use random::Random;

fn parse(domain: &str, problem: &str) -> (Domain, Problem) {
    let sources = (Source::new("domain", domain), Source::new("problem", problem));
    let (domain, problem, _) = read(&sources.0, &sources.1).expect("PDDL");
    (domain, problem)
}

fn atom(words: &str) -> Atom {
    let mut words = words.split(' ').map(|word| Identifier { name: Name::new(word), span: Span::default() });
    let predicate = words.next().expect("a symbol");
    Atom { predicate, arguments: words.map(Term::Constant).collect(), span: Span::default() }
}

fn words(atom: &Atom) -> Vec<String> {
    let term = |term: &Term| match term {
        Term::Variable(identifier) | Term::Constant(identifier) => identifier.name.to_string(),
    };
    std::iter::once(atom.predicate.name.to_string()).chain(atom.arguments.iter().map(term)).collect()
}

/// What can change in a mission: names of its fact of place, of its places and designs, and the battery's capacity.
struct Changes {
    at: &'static str,
    places: Vec<String>,
    designs: Vec<String>,
    capacity: i64,
}

impl Changes {
    fn of(problem: &Problem, at: &'static str, place: &str, design: &str) -> Self {
        let of_type = |name: &str| {
            let own = problem
                .objects
                .iter()
                .filter(|object| object.r#type.alternatives.iter().any(|kind| kind.name == Name::new(name)));
            own.map(|object| object.identifier.name.to_string()).collect()
        };
        let battery = problem.init.iter().find_map(|element| match element {
            InitialElement::Value(function, value, _) if words(function) == ["battery"] => {
                Some(value.to_integer())
            }
            _ => None,
        });
        let capacity = battery.and_then(|value| value.try_into().ok()).unwrap_or(0);
        Self { at, places: of_type(place), designs: of_type(design), capacity }
    }

    /// Something happens to the robot.
    fn happen(&self, problem: &mut Problem, random: &mut Random) {
        match random.below(5) {
            0 => {
                let place = &self.places[random.below(self.places.len() as u64) as usize];
                problem.init.retain(
                    |element| !matches!(element, InitialElement::Fact(fact) if words(fact)[0] == self.at),
                );
                problem.init.push(InitialElement::Fact(atom(&format!("{} {place}", self.at))));
            }
            1 => {
                // Tenths, so that the numbers of the task have another unit.
                let value = BigRational::new((random.below(10 * self.capacity as u64 + 1)).into(), 10.into());
                for element in &mut problem.init {
                    if let InitialElement::Value(function, known, _) = element
                        && words(function) == ["battery"]
                    {
                        known.clone_from(&value);
                    }
                }
            }
            _ => {
                let design = &self.designs[random.below(self.designs.len() as u64) as usize];
                let fact = atom(&format!("fd_available {design}"));
                let is_own = |element: &InitialElement| matches!(element, InitialElement::Fact(other) if words(other) == words(&fact));
                let before = problem.init.len();
                problem.init.retain(|element| !is_own(element));
                if problem.init.len() == before {
                    problem.init.push(InitialElement::Fact(fact));
                }
            }
        }
    }
}

fn from_scratch(domain: &Domain, problem: &Problem) -> Solution {
    let task = ground(domain, problem, &GroundConfig::default()).expect("a task");
    optimize(&task, &Config::default(), &mut |_| {})
}

fn live(replanner: &mut Replanner, domain: &Domain, problem: &Problem) -> Replanned {
    let zero = BigRational::default();
    let metric = metric_after(domain, problem, &zero).expect("a metric");
    let limits = Limits::none();
    replanner.plan(&Query { problem, first: &[], metric, close_to: None, limits: &limits })
}

fn new(domain: &Domain, problem: &Problem) -> Replanner {
    let available = [Name::new("fd_available")];
    Replanner::new(domain, problem, &available, &GroundConfig::default()).expect("the domain is suited")
}

/// Both answers are the same plan, or none.
fn compare(expected: &Solution, found: &Replanned, context: &dyn Fn() -> String) {
    match (&expected.plan, found) {
        (Some(plan), Replanned::Optimal { steps, metric, .. }) => {
            assert_eq!(expected.status, Status::Optimal, "{}", context());
            let names = |steps: &[metaplan_encodings::Step]| {
                let name = |step: &metaplan_encodings::Step| (step.action.clone(), step.arguments.clone());
                steps.iter().map(name).collect::<Vec<_>>()
            };
            assert_eq!(names(&plan.steps), names(steps), "{}", context());
            let cost = BigRational::new(plan.cost.numerator.into(), plan.cost.denominator.into());
            assert_eq!(cost, *metric, "{}", context());
        }
        (None, Replanned::Unsolvable) => assert_eq!(expected.status, Status::Unsolvable, "{}", context()),
        _ => panic!("{:?} and {found:?}: {}", expected.status, context()),
    }
}

/// So many changes of a mission, one after the other, each answered in both ways; how often it had to be ground anew.
fn check(seed: u64, changes: usize) -> usize {
    let mission = Mission::random(seed);
    let (domain, mut problem) = parse(&mission.domain(), &mission.problem());
    let mut random = Random(seed ^ 0x5eed);
    let possible = Changes::of(&problem, "at", "waypoint", "design");
    let mut replanner = new(&domain, &problem);
    let mut misfits = 0;
    for number in 0..changes {
        let mut found = live(&mut replanner, &domain, &problem);
        if found == Replanned::Misfit {
            misfits += 1;
            replanner = new(&domain, &problem);
            found = live(&mut replanner, &domain, &problem);
        }
        let context = || format!("seed {seed}, change {number}: {mission:?}: {:?}", problem.init);
        compare(&from_scratch(&domain, &problem), &found, &context);
        possible.happen(&mut problem, &mut random);
    }
    misfits
}

#[test]
fn answers_are_those_of_planning_anew() {
    let misfits: usize = (0..40).map(|seed| check(seed, 12)).sum();
    assert!(misfits < 240, "{misfits} of 480 had to be ground anew");
}

#[test]
#[ignore = "takes minutes"]
fn ten_thousand_answers_are_those_of_planning_anew() {
    let misfits: usize = (1_000..1_500).map(|seed| check(seed, 20)).sum();
    println!("{misfits} of 10000 had to be ground anew");
}

type Named = Vec<(String, Vec<String>)>;

fn named(steps: &[metaplan_encodings::Step]) -> Named {
    steps.iter().map(|step| (step.action.clone(), step.arguments.clone())).collect()
}

/// After a change the plan that stays close to the old one is a best one with fewest steps, and of all of those, as the SAT solver
/// enumerates them, none has more steps of the old one. Returns whether that was not the plan that is chosen otherwise.
fn check_close(seed: u64) -> bool {
    let mission = Mission::random(seed);
    let (domain, mut problem) = parse(&mission.domain(), &mission.problem());
    let mut random = Random(seed ^ 0xc105e);
    let possible = Changes::of(&problem, "at", "waypoint", "design");
    let mut replanner = new(&domain, &problem);
    let Replanned::Optimal { steps: old, .. } = live(&mut replanner, &domain, &problem) else { return false };
    let old = named(&old);
    possible.happen(&mut problem, &mut random);
    let metric = metric_after(&domain, &problem, &BigRational::default()).expect("a metric");
    let limits = Limits::none();
    let query = Query { problem: &problem, first: &[], metric, close_to: Some(&old), limits: &limits };
    let Replanned::Optimal { steps, metric, .. } = replanner.plan(&query) else { return false };
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    let others = alternatives(&task, &solution, 200, &Config::default());
    let Some(others) = others.filter(|others| others.complete) else { return false };
    let best = solution.plan.as_ref().expect("a plan");
    let cost = BigRational::new(best.cost.numerator.into(), best.cost.denominator.into());
    assert_eq!(cost, metric, "seed {seed}");
    assert_eq!(steps.len(), best.steps.len(), "seed {seed}");
    let kept = |plan: &Named| plan.iter().filter(|step| old.contains(step)).count();
    let as_long = others.plans.iter().chain([best]).filter(|plan| plan.steps.len() == steps.len());
    let most = as_long.map(|plan| kept(&named(&plan.steps))).max();
    assert_eq!(Some(kept(&named(&steps))), most, "seed {seed}: {old:?} {steps:?}");
    kept(&named(&best.steps)) < kept(&named(&steps))
}

#[test]
fn plans_stay_close_to_the_old_one() {
    let closer = (0..150).filter(|seed| check_close(*seed)).count();
    assert!(closer > 0, "no plan is closer to the old one than the one that is chosen otherwise");
}

/// What blocks a mission is minimal: alone it leaves no plan, and without any part of it there is one.
fn check_blocking(seed: u64) -> bool {
    let mission = Mission::random(seed);
    let (domain, mut problem) = parse(&mission.domain(), &mission.problem());
    let designs = Changes::of(&problem, "at", "waypoint", "design").designs;
    let is_available = |element: &InitialElement| matches!(element, InitialElement::Fact(fact) if words(fact)[0] == "fd_available");
    let mut random = Random(seed ^ 0xb10c);
    problem.init.retain(|element| !is_available(element) || random.below(3) == 0);
    let mut replanner = new(&domain, &problem);
    let metric = metric_after(&domain, &problem, &BigRational::default()).expect("a metric");
    let limits = Limits::none();
    let query = Query { problem: &problem, first: &[], metric, close_to: None, limits: &limits };
    if replanner.plan(&query) != Replanned::Unsolvable {
        return false;
    }
    let blocking = replanner.blocking(&query).expect("an answer");
    let solvable_without = |blocked: &[&String]| {
        let mut problem = problem.clone();
        problem.init.retain(|element| !is_available(element));
        for design in designs.iter().filter(|design| !blocked.contains(design)) {
            problem.init.push(InitialElement::Fact(atom(&format!("fd_available {design}"))));
        }
        from_scratch(&domain, &problem).plan.is_some()
    };
    let all: Vec<&String> = blocking.iter().collect();
    assert!(!solvable_without(&all), "seed {seed}: {blocking:?} does not suffice");
    if blocking.is_empty() {
        return false;
    }
    for one in &all {
        let rest: Vec<&String> = all.iter().copied().filter(|other| other != one).collect();
        assert!(solvable_without(&rest), "seed {seed}: {blocking:?} needs not {one}");
    }
    true
}

#[test]
fn what_blocks_a_mission_is_minimal() {
    let found = (0..150).filter(|seed| check_blocking(*seed)).count();
    assert!(found > 10, "{found}");
}
