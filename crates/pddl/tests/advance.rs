//! Compares [`advance`] in a reduced problem, without the facts and values that the step cannot read, with
//! the step in the whole problem.
//!
//! Problems of domains with derived predicates are never reduced. The oracle is therefore the same domain
//! with one additional derived predicate.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use metaplan_pddl::ast::{Condition, Domain, InitialElement, Name, Problem, Term};
use metaplan_pddl::validate::{
    Options, PlanStep, PlanText, advance, advance_each, may_read, metric_after, metric_of, validate,
};
use metaplan_pddl::{BigRational, Source, read};

/// Number of random ground steps that are compared for each action schema in each state.
const STEPS: u64 = 150;

/// Maximum number of states of a random walk from the initial state, in which steps are compared.
const WALK: usize = 6;

struct Sequence(u64);

impl Sequence {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % limit as u64) as usize
    }
}

fn tasks() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut folders: Vec<PathBuf> = [
        "encodings",
        "missions/templates",
        "integrations/ros/examples",
        "docs/how-to/examples",
        "tests/program",
    ]
    .iter()
    .flat_map(|folder| std::fs::read_dir(root.join(folder)).expect("a folder"))
    .map(|entry| entry.expect("an entry").path())
    .filter(|folder| folder.join("domain.pddl").exists() && folder.join("problem.pddl").exists())
    .collect();
    folders.sort();
    folders
}

/// Parses the domain and the problem of a folder. If `is_whole` is set, a derived predicate that nothing
/// reads is added, which prevents the reduction.
fn task(folder: &Path, is_whole: bool) -> (Domain, Problem) {
    let text = |name: &str| std::fs::read_to_string(folder.join(name)).expect("a file");
    let mut domain = text("domain.pddl");
    if is_whole {
        let end = domain.rfind(')').expect("a definition");
        domain.insert_str(end, "\n(:derived (oracle_only) (and))\n");
        domain = domain.replacen("(:predicates", "(:predicates (oracle_only)", 1);
    }
    let sources = (Source::new("domain.pddl", domain), Source::new("problem.pddl", text("problem.pddl")));
    let (domain, problem, _) = read(&sources.0, &sources.1).expect("the files are correct");
    (domain, problem)
}

#[test]
fn a_step_changes_the_reduced_problem_as_it_changes_the_whole_one() {
    let folders = tasks();
    assert!(folders.len() >= 8, "{folders:?}");
    let (mut possible, mut impossible) = (0, 0);
    for folder in folders {
        let (domain, mut problem) = task(&folder, false);
        let (whole_domain, mut whole_problem) = task(&folder, true);
        let objects: Vec<String> = domain
            .constants
            .iter()
            .chain(&problem.objects)
            .map(|object| object.identifier.name.to_string())
            .collect();
        let mut sequence = Sequence(7);
        for _ in 0..WALK {
            let mut next = None;
            for action in &domain.actions {
                let steps: Vec<PlanStep> = (0..STEPS)
                    .map(|_| {
                        let arguments = (0..action.parameters.len())
                            .map(|_| objects[sequence.below(objects.len())].clone())
                            .collect::<Vec<_>>()
                            .join(" ");
                        let text = format!("({} {arguments})", action.identifier.name);
                        PlanText::parse(&Source::new("plan", text)).expect("a step").steps.remove(0)
                    })
                    .collect();
                let (metric, each) = advance_each(&domain, &problem, &steps);
                assert_eq!(metric, metric_after(&whole_domain, &whole_problem, &BigRational::default()));
                for (step, of_each) in steps.iter().zip(each) {
                    for is_forced in [false, true] {
                        let reduced = advance(&domain, &problem, step, is_forced);
                        let whole = advance(&whole_domain, &whole_problem, step, is_forced);
                        let text = |result: &Result<_, Box<_>>| format!("{result:?}");
                        let is_same = match (&reduced, &whole) {
                            (Ok(reduced), Ok(whole)) => format!("{reduced:?}") == format!("{whole:?}"),
                            (Err(reduced), Err(whole)) => reduced.message == whole.message,
                            _ => false,
                        };
                        assert!(is_same, "{folder:?} {step:?}\n{}\n{}", text(&reduced), text(&whole));
                        if !is_forced {
                            assert_eq!(of_each.is_ok(), reduced.is_ok(), "{folder:?} {step:?}");
                            *(if reduced.is_ok() { &mut possible } else { &mut impossible }) += 1;
                            check_read(step, (&domain, &problem), &objects[sequence.below(objects.len())]);
                            check_metric(step, (&domain, &problem), (&whole_domain, &whole_problem));
                            next = reduced.ok().or(next);
                        }
                    }
                }
            }
            let Some(change) = next else { break };
            change.apply(&mut problem.init);
            change.apply(&mut whole_problem.init);
        }
    }
    assert!(possible > 200 && impossible > 200, "{possible} steps are possible, {impossible} are not");
}

fn check_metric(step: &PlanStep, reduced: (&Domain, &Problem), whole: (&Domain, &Problem)) {
    let mut plan = PlanText::default();
    plan.steps.push(step.clone());
    for goal in [&reduced.1.goal, &Condition::And(Vec::new())] {
        let with_goal = |problem: &Problem| Problem { goal: goal.clone(), ..problem.clone() };
        let expected = validate(whole.0, &with_goal(whole.1), &plan, &Options::default()).metric;
        assert_eq!(metric_of(reduced.0, &with_goal(reduced.1), &plan), expected, "{step:?}");
    }
}

/// Checks that a step that may not read facts about an object is executed in the same way without these facts.
fn check_read(step: &PlanStep, (domain, problem): (&Domain, &Problem), object: &str) {
    let object = Name::new(object);
    if may_read(domain, problem, step, &BTreeSet::from([object.clone()])) {
        return;
    }
    let is_object = |term: &Term| matches!(term, Term::Constant(identifier) if identifier.name == object);
    let mut without = problem.clone();
    without.init.retain(
        |element| !matches!(element, InitialElement::Fact(atom) if atom.arguments.iter().any(is_object)),
    );
    let text = |problem: &Problem| match advance(domain, problem, step, false) {
        Ok(change) => format!("{change:?}"),
        Err(violation) => violation.message.clone(),
    };
    assert_eq!(text(&without), text(problem), "{step:?} without {object}");
}
