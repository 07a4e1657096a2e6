//! Formulas of generated missions and their refutations: a false claim has no refutation, and a true claim has
//! one, unless it would need too many steps or the cost is not positive. Changed formulas and
//! legends and wrong proofs are rejected.

use std::cell::RefCell;
use std::io::Write;
use std::rc::Rc;

use certificate::{Claimed, GroundTask, Inputs, check_refutation};
use metaplan_planner::{
    Attempt, Certificate, Config, GroundConfig, Limits, RefutationOutputs, certify, ground, optimize, refute,
};
use num_rational::BigRational;
use pddl::{Source, read};
use serde_json::{Value, json};
use testing::missions::Mission;
use testing::random::Random;

/// Returns a certificate and the optimal cost, or `None` if there is no plan.
fn certified(seed: u64) -> Option<(Certificate, BigRational)> {
    let mission = Mission::random(seed);
    let cost = BigRational::from_integer(mission.oracle()?.into());
    let (domain, problem) = (mission.domain(), mission.problem());
    let (domain, problem, _) =
        read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("a mission");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    Some((certify(&task, &solution, &Limits::none()).expect("a certificate"), cost))
}

/// Field of [`certificate::StepBounds`] that gives the number of steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum StepBound {
    Spent,
    Potential,
}

#[derive(Clone, Default)]
struct Memory(Rc<RefCell<Vec<u8>>>);

impl Memory {
    fn text(&self) -> String {
        String::from_utf8(self.0.take()).expect("text")
    }
}

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

type Files = [String; 4];

fn refutation(
    certificate: &Certificate,
    claim: &BigRational,
    by: StepBound,
) -> Result<(usize, Files), String> {
    let task = GroundTask::read(&certificate.task).map_err(|fault| fault.to_string())?;
    let claimed =
        Claimed::read(&task, &certificate.argument, Some(claim)).map_err(|fault| fault.to_string())?;
    let bounds = claimed.step_bounds(&|| false)?;
    let steps = match by {
        StepBound::Spent => bounds.spent.ok_or("a cheaper plan may have more than 64 steps")?,
        StepBound::Potential => bounds.potential,
    };
    let attempt = Attempt { steps, conflicts: 20_000 };
    let files: [Memory; 4] = Default::default();
    let [mut formula, mut legend, mut proof, mut hints] = files.clone();
    let draft = Memory::default();
    let outputs = RefutationOutputs {
        formula: &mut formula,
        legend: &mut legend,
        draft: Box::new(draft.clone()),
        written_draft: &|| Ok(Box::new(std::io::Cursor::new(draft.0.take()))),
        proof: &mut proof,
        hints: &mut hints,
    };
    refute(&claimed, attempt, outputs, &Limits::none())?;
    Ok((steps, files.map(|file| file.text())))
}

fn verdicts(
    certificate: &Certificate,
    claim: &BigRational,
    steps: usize,
    [formula, legend, proof, hints]: &Files,
) -> [Result<String, String>; 3] {
    let documents = (certificate.task.as_str(), certificate.argument.as_str());
    let inputs = Inputs {
        formula: &mut formula.as_bytes(),
        legend: &mut legend.as_bytes(),
        proof: &mut proof.as_bytes(),
        hints: &mut hints.as_bytes(),
    };
    check_refutation(documents, Some(claim), steps, inputs).map(|(_, result)| result)
}

fn check(seed: u64, by: StepBound) {
    let Some((certificate, cost)) = certified(seed) else { return };
    let more = &cost + BigRational::from_integer(1.into());
    match refutation(&certificate, &cost, by) {
        Ok((steps, files)) => {
            let found = verdicts(&certificate, &cost, steps, &files);
            assert!(found.iter().all(Result::is_ok), "seed {seed}: {found:?}");
            // The formula of the claim that all plans cost more differs, and it has a model.
            let found = verdicts(&certificate, &more, steps, &files);
            assert!(found.iter().any(Result::is_err), "seed {seed}: {found:?}");
            if let Some(fewer) = steps.checked_sub(1) {
                let found = verdicts(&certificate, &cost, fewer, &files);
                assert!(found[0].is_err(), "seed {seed}: {found:?}");
            }
        }
        Err(reason) => {
            let expected = ["more than 64 steps", "costs less than nothing"];
            assert!(expected.iter().any(|part| reason.contains(part)), "seed {seed}: {reason}");
        }
    }
    if let Err(reason) = refutation(&certificate, &more, by) {
        let expected = ["the formula has a model", "more than 64 steps"];
        assert!(expected.iter().any(|part| reason.contains(part)), "seed {seed}: {reason}");
    } else {
        panic!("seed {seed}: refuted that there is a plan of least cost");
    }
}

#[test]
fn only_true_claims_have_a_refutation() {
    for seed in 0..60 {
        check(seed, StepBound::Spent);
        check(seed, StepBound::Potential);
    }
}

#[test]
#[ignore = "minutes"]
fn only_true_claims_of_many_missions_have_a_refutation() {
    (1_000..3_000).for_each(|seed| check(seed, StepBound::Spent));
}

/// One random change: a line is removed, two lines are swapped, or a word is negated. Swapping a
/// line with itself changes nothing.
fn mutate(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let line = random.below(lines.len() as u64) as usize;
    match random.below(4) {
        0 => drop(lines.remove(line)),
        1 => {
            let other = random.below(lines.len() as u64) as usize;
            lines.swap(line, other);
        }
        _ => {
            let mut words: Vec<String> = lines[line].split(' ').map(str::to_owned).collect();
            let word = random.below(words.len() as u64) as usize;
            words[word] = match words[word].strip_prefix('-') {
                Some(positive) => positive.to_owned(),
                None => format!("-{}", words[word]),
            };
            lines[line] = words.join(" ");
        }
    }
    lines.join("\n") + "\n"
}

/// A changed formula or legend must not be accepted for the task. A proof or hints that are replaced by other
/// text, e.g. an empty text, must prove nothing.
#[test]
fn changed_refutations_are_rejected() {
    for seed in 0..40 {
        let Some((certificate, cost)) = certified(seed) else { continue };
        let Ok((steps, files)) = refutation(&certificate, &cost, StepBound::Spent) else { continue };
        let mut random = Random(seed);
        for number in 0..30 {
            let mut mutant = files.clone();
            let file = number % 4;
            mutant[file] = mutate(&files[file], &mut random);
            let found = verdicts(&certificate, &cost, steps, &mutant);
            assert_eq!(
                found[0].is_ok(),
                mutant[0] == files[0] && mutant[1] == files[1],
                "seed {seed}: {found:?}"
            );
        }
        for wrong in ["", "x 0\n", "1 2\n", "99999999 0\n", "1 0", &"1 ".repeat(3_000_000)] {
            for file in [2, 3] {
                let mut mutant = files.clone();
                mutant[file] = wrong.to_owned();
                let found = verdicts(&certificate, &cost, steps, &mutant);
                assert!(found[1].is_err(), "seed {seed}, {wrong}: {found:?}");
            }
        }
    }
}

/// The bound on the number of steps relies on a potential. Without a check, greater values would allow fewer steps.
#[test]
fn steps_are_not_bounded_by_wrong_potentials() {
    let mut tried = 0;
    for seed in 0..40 {
        let Some((mut certificate, cost)) = certified(seed) else { continue };
        let Ok((steps, files)) = refutation(&certificate, &cost, StepBound::Potential) else { continue };
        let mut argument: Value = serde_json::from_str(&certificate.argument).expect("JSON");
        for potential in argument["potentials"].as_array_mut().expect("potentials") {
            for bound in potential["values"].as_array_mut().expect("values") {
                if let Some(number) = bound.as_i64() {
                    *bound = json!(number + 1_000);
                }
            }
        }
        certificate.argument = argument.to_string();
        let found = verdicts(&certificate, &cost, steps, &files);
        assert!(found[2].is_err(), "seed {seed}: {found:?}");
        tried += 1;
    }
    assert!(tried > 0, "no mission has a refutation");
}
