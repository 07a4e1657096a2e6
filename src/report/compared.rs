//! Converts comparisons with probabilistic policies, and simulations of control strategies, to
//! pictures.

use std::collections::BTreeMap;

use picture::{Change, Group, Part, Points, Reason, Rows, Sheet};

use crate::answers::{MEASURES, Pair, Row};
use crate::comparison::Comparison;
use crate::simulate::{Run, Sample, Strategy};

/// Returns the picture of comparisons, each with its pair of start and goal if there are several.
/// `rows` are the rows of the table, including rows that the user has added. Computation times are
/// omitted.
pub fn comparison_sheet(mission: &str, comparisons: &[(Option<Pair>, Comparison)], rows: &[Row]) -> Sheet {
    let mut parts = Vec::new();
    for (pair, comparison) in comparisons {
        let name = pair.as_ref().map(|(start, goal)| format!("From {start} to {goal}"));
        parts.push(Part::Heading(name.unwrap_or_else(|| "Time and safety".to_owned())));
        parts.push(Part::Points(front(comparison)));
        parts.push(Part::Sentences(prices(comparison)));
    }
    parts.push(Part::Heading("All measures".to_owned()));
    parts.push(table(rows));
    let front: usize = comparisons.iter().map(|(_, comparison)| comparison.front.len()).sum();
    Sheet {
        name: format!("{mission}: plans and policies"),
        description: "All candidates are evaluated exactly in one decision process.".to_owned(),
        verdict: format!("{} rows, {front} vertices of Pareto fronts.", rows.len()),
        parts,
    }
}

/// Returns a label for each row or point: its kind, with a number if the kind occurs several times
/// for a pair of start and goal (`a1`, `a2`, `b`).
fn labels<'k>(kinds: &[(&'k Option<Pair>, &'k str)]) -> Vec<String> {
    let mut counts: BTreeMap<&(&Option<Pair>, &str), usize> = BTreeMap::new();
    let label = |kind| {
        let number = counts.entry(kind).or_default();
        *number += 1;
        let is_only = kinds.iter().filter(|other| *other == kind).count() == 1;
        if is_only { kind.1.to_owned() } else { format!("{}{number}", kind.1) }
    };
    kinds.iter().map(label).collect()
}

/// Plots expected time against the probability of success without collision. The Pareto front is a
/// line, and each candidate with a finite time is a point. A point has the label of its row in the
/// table.
fn front(comparison: &Comparison) -> Points {
    let kinds: Vec<String> =
        comparison.candidates.iter().map(|candidate| candidate.kind.to_string()).collect();
    let kinds: Vec<(&Option<Pair>, &str)> = kinds.iter().map(|kind| (&None, kind.as_str())).collect();
    let points = comparison.candidates.iter().zip(labels(&kinds)).filter_map(|(candidate, label)| {
        let (time, success) = (candidate.measures.time?, candidate.measures.goal_without_collision);
        let about =
            format!("{label}, {}: time {}, probability {}", candidate.name, shown(time), shown(success));
        Some((label, about, time, success))
    });
    Points {
        title: "time, and the probability of success without collision".to_owned(),
        axes: ["time".to_owned(), "probability of success without collision".to_owned()],
        line: comparison.front.iter().map(|[time, probability]| (*time, *probability)).collect(),
        points: points.collect(),
    }
}

fn prices(comparison: &Comparison) -> Vec<Change> {
    let leaf = |text: String| Reason { text, supports: Vec::new() };
    let price = |name: &str, value: Option<f64>, because: Vec<Reason>| Change {
        text: format!("{name}: {}", value.map_or_else(|| "not finite".to_owned(), shown)),
        because,
    };
    let of = |kind: char| {
        let candidate = comparison.candidates.iter().find(|candidate| candidate.kind == kind);
        candidate.map(|candidate| {
            let time = candidate.measures.penalised_time.map_or_else(|| "not finite".to_owned(), shown);
            leaf(format!("{}: penalised time {time}", candidate.name))
        })
    };
    let penalty = leaf(format!("a mission that fails costs {}", shown(comparison.penalty)));
    let between =
        |one: char, other: char| of(one).into_iter().chain(of(other)).chain([penalty.clone()]).collect();
    let mut determinism: Vec<Reason> = between('c', 'a');
    determinism.extend(comparison.no_price.map(|why| leaf(format!("provably zero: {why}"))));
    let mut prices = vec![
        price("Price of determinism", comparison.price_of_determinism(), determinism),
        price("Price of the open loop", comparison.price_of_open_loop(), between('b', 'a')),
        price("Value of re-planning", comparison.value_of_replanning(), between('b', 'c')),
    ];
    if let Some(loss) = &comparison.loss {
        let after = |moves: usize, times: [Option<f64>; 4]| {
            let names = ["plan carried on", "new plan", "solved again", "anticipating"];
            let times =
                names.iter().zip(times).filter_map(|(name, time)| Some(format!("{name} {}", shown(time?))));
            leaf(format!("after {moves} moves: {}", times.collect::<Vec<_>>().join(", ")))
        };
        let steps = loss.steps.iter();
        let steps = steps.map(|loss| {
            after(loss.moves, [loss.open_loop, loss.replanned, loss.solved_again, loss.anticipated])
        });
        let text = format!("Cost of the loss of {}, at a rate of {} per move", loss.component, loss.rate);
        prices.push(Change { text, because: steps.collect() });
    }
    prices
}

fn table(rows: &[Row]) -> Part {
    let kinds: Vec<(&Option<Pair>, &str)> = rows.iter().map(|row| (&row.pair, row.kind.as_str())).collect();
    let header = ["point", "candidate"].into_iter().chain(MEASURES).map(|name| name.replace('_', " "));
    let line = |(row, label): (&Row, String)| {
        let name = match &row.pair {
            Some((start, goal)) => format!("{start}-{goal}: {}", row.name),
            None => row.name.clone(),
        };
        let values = row.values.iter().map(|value| value.map_or_else(|| "–".to_owned(), shown));
        [label, name].into_iter().chain(values).collect()
    };
    Part::Table("measures".to_owned(), header.collect(), rows.iter().zip(labels(&kinds)).map(line).collect())
}

/// Returns the picture of simulated missions: for each strategy, the distributions of costs (of accomplished
/// missions), reaction times and reconfigurations over the seeds, and a table of figures.
pub fn simulation_sheet(mission: &str, scenario: &str, strategies: &[Strategy], runs: &[Run]) -> Sheet {
    let cost = |run: &Run| run.accomplished.then_some(run.cost);
    let changes = |run: &Run| Some(run.reconfigurations as f64);
    let parts = vec![
        Part::Heading("Cost of accomplished missions".to_owned()),
        distribution(strategies, runs, ("cost", &none_accomplished), &cost),
        Part::Heading("Reaction".to_owned()),
        distribution(
            strategies,
            runs,
            ("reaction, in the domain's time unit", &|_| "there was nothing to react to".to_owned()),
            &Run::mean_reaction,
        ),
        Part::Heading("Reconfigurations".to_owned()),
        distribution(strategies, runs, ("reconfigurations", &|_| String::new()), &changes),
        Part::Heading("Figures".to_owned()),
        figures(strategies, runs),
    ];
    let done = runs.iter().filter(|run| run.accomplished).count();
    Sheet {
        name: format!("{mission}: {scenario}, simulated"),
        description: "A dot is a mission, the diamond the mean with its interval of 95 percent.".to_owned(),
        verdict: accomplished(done, runs.len()),
        parts,
    }
}

fn accomplished(done: usize, all: usize) -> String {
    match (done, all) {
        (0, 1) => "The mission was not accomplished.".to_owned(),
        (1, 1) => "The mission was accomplished.".to_owned(),
        (0, _) => format!("None of the {all} missions was accomplished."),
        _ if done == all => format!("All {all} missions were accomplished."),
        (1, _) => format!("1 of {all} missions was accomplished."),
        _ => format!("{done} of {all} missions were accomplished."),
    }
}

fn none_accomplished(missions: usize) -> String {
    format!("0 of {missions} accomplished")
}

fn runs_of(runs: &[Run], strategy: Strategy) -> impl Iterator<Item = &Run> {
    runs.iter().filter(move |run| run.strategy == strategy)
}

fn distribution(
    strategies: &[Strategy],
    runs: &[Run],
    (name, nothing): (&str, &dyn Fn(usize) -> String),
    figure: &dyn Fn(&Run) -> Option<f64>,
) -> Part {
    let group = |strategy: &Strategy| {
        let values = runs_of(runs, *strategy).filter_map(|run| {
            let value = figure(run)?;
            Some((value, format!("{}, seed {}: {}", strategy.name(), run.seed, rounded(value))))
        });
        let values: Vec<(f64, String)> = values.collect();
        let sample: Vec<f64> = values.iter().map(|(value, _)| *value).collect();
        let mean = Sample::of(&sample).map(|sample| {
            // A single value has no confidence interval.
            let half_width = if sample.count > 1 { sample.half_width } else { 0.0 };
            (hundredths(sample.mean), hundredths(half_width))
        });
        let nothing = nothing(runs_of(runs, *strategy).count());
        Group { name: strategy.name().to_owned(), values, mean, nothing }
    };
    let groups = strategies.iter().map(group).collect();
    Part::Rows(Rows { title: format!("{name} by strategy"), axis: name.to_owned(), groups })
}

fn figures(strategies: &[Strategy], runs: &[Run]) -> Part {
    let header = ["strategy", "missions", "accomplished", "mean cost, if accomplished", "failed actions"];
    let line = |strategy: &Strategy| {
        let costs: Vec<f64> =
            runs_of(runs, *strategy).filter(|run| run.accomplished).map(|run| run.cost).collect();
        let cost = Sample::of(&costs).map_or_else(|| "none accomplished".to_owned(), |sample| mean(&sample));
        let failed: usize = runs_of(runs, *strategy).map(|run| run.failed).sum();
        let counts = [runs_of(runs, *strategy).count(), costs.len()].map(|count| count.to_string());
        let [missions, accomplished] = counts;
        vec![strategy.name().to_owned(), missions, accomplished, cost, failed.to_string()]
    };
    let header = header.map(str::to_owned).to_vec();
    Part::Table("figures".to_owned(), header, strategies.iter().map(line).collect())
}

fn mean(sample: &Sample) -> String {
    match sample.count {
        1 => rounded(sample.mean),
        _ => format!("{} ± {}", rounded(sample.mean), rounded(sample.half_width)),
    }
}

/// Formats a simulated value with at most two decimals. More digits would only be noise.
fn rounded(value: f64) -> String {
    hundredths(value).to_string()
}

fn hundredths(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

fn shown(value: f64) -> String {
    ((value * 1e6).round() / 1e6).to_string()
}
