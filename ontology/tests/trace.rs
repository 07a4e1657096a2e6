//! Replays recorded traces of the unmodified MROS reasoner in latch mode, step by step.

#![allow(clippy::print_stdout)] // steps that are not compared are listed

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::common::{real_directory, recorded, selected};
use ontology::runtime::{Mode, NewObjective, Objective, Runtime};
use ontology::{ReadOptions, lower, read_files, vocab};
use rules::{Delta, Engine, Fact, Literal, Symbols};
use serde_json::{Value, json};

/// Intended differences: the trace, the first step that is not compared, and the reason.
const EXCEPTIONS: [(&str, usize, &str); 3] = [
    (
        "suave_no_measurement_crash",
        1,
        "the original stops with a TypeError where nothing was measured; we select",
    ),
    (
        "suave_cancel_ungrounded",
        1,
        "the original stops with an AttributeError and keeps the objective; we remove it",
    ),
    (
        "suave_unknown_objective_type",
        0,
        "the original keeps an objective without function for ever; we refuse it",
    ),
];

#[test]
fn recorded_traces_of_mros_are_reproduced() {
    let traces = recorded("golden/trace");
    let mut failures = Vec::new();
    for trace in &traces {
        let name = trace["scenario"].as_str().expect("scenario");
        let steps = trace["steps"].as_array().expect("steps");
        let exception = EXCEPTIONS.iter().find(|(scenario, ..)| *scenario == name);
        let compared = exception.map_or(steps.len(), |(_, step, _)| *step);
        let mut replay = Replay { runtime: runtime(trace) };
        for (index, step) in steps[..compared].iter().enumerate() {
            if let Err(difference) = replay.step(step) {
                failures.push(format!("{name}, step {index} ({}): {difference}", step["op"]));
                break;
            }
        }
        if let Some((_, step, reason)) = exception {
            println!("{name} from step {step}: {reason}");
        }
    }
    assert!(failures.is_empty(), "{} of {} differ:\n{}", failures.len(), traces.len(), failures.join("\n"));
}

fn runtime(trace: &Value) -> Runtime {
    let real = real_directory();
    let folder = |file: &str| match file {
        "tomasys.owl" => "mc_mdl_tomasys",
        "suave.owl" => "suave",
        _ => "mros_ontology",
    };
    let files =
        trace["kb_files"].as_array().expect("kb_files").iter().map(|file| file.as_str().expect("file"));
    let files: Vec<PathBuf> = files.map(|file| real.join(folder(file)).join(file)).collect();
    let options = ReadOptions { directories: vec![real], ..ReadOptions::default() };
    let ontology = read_files(&files, &options).expect("readable");
    let mut symbols = Symbols::new();
    let lowered = lower(&ontology, &mut symbols);
    Runtime::new(Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules"), Mode::Latch)
}

struct Replay {
    runtime: Runtime,
}

fn same(subject: &str, ours: &Value, theirs: &Value) -> Result<(), String> {
    if ours == theirs { Ok(()) } else { Err(format!("{subject}\n  ours   {ours}\n  theirs {theirs}")) }
}

fn decimal(text: &str) -> Literal {
    Literal::parse(text, Some(vocab::xsd::DECIMAL), None)
}

impl Replay {
    fn step(&mut self, step: &Value) -> Result<(), String> {
        let text = |key: &str| step[key].as_str().unwrap_or_default().to_owned();
        match step["op"].as_str().expect("op") {
            "objective" => {
                let nfrs = step["nfrs"].as_object().expect("nfrs").iter();
                let requirements =
                    nfrs.map(|(key, value)| (key.as_str(), decimal(value.as_str().expect("text")))).collect();
                let always_improve = step["always_improve"] == true;
                let (name, function) = (&text("id"), &text("type"));
                let objective = NewObjective { name, function, requirements, always_improve };
                self.runtime.add_objective(&objective).map_err(|error| error.to_string())?;
            }
            "cancel" => {
                self.runtime.remove_objective(&text("id")).map_err(|error| error.to_string())?;
            }
            "triple" => {
                let symbols = self.runtime.engine_mut().symbols_mut();
                let [s, p, o] = ["s", "p", "o"].map(|key| symbols.name(&text(key)));
                let delta = Delta { insert: vec![Fact::new(p, [s, o])], delete: Vec::new() };
                self.runtime.apply(delta).map_err(|error| error.to_string())?;
            }
            "diag" => self.report(step)?,
            "cycle" => self.cycle(step)?,
            other => return Err(format!("unknown step {other}")),
        }
        same("state", &self.state(), &step["state"])
    }

    /// Replays a diagnostic message. An unknown name, or a value that is not a number, changes nothing.
    fn report(&mut self, step: &Value) -> Result<(), String> {
        let text = |key: &str| step[key].as_str().unwrap_or_default().to_owned();
        let accepted = match step["message"].as_str().expect("message") {
            "QA status" => self.runtime.measure(&text("key"), decimal(&text("value"))).is_ok(),
            "Component status" => {
                self.runtime.report_component_as(&text("key"), Literal::string(&text("value"))).is_ok()
            }
            _ => {
                let symbols = self.runtime.engine_mut().symbols_mut();
                let grounding = symbols.name(&format!("{}{}", vocab::tomasys::NS, text("name")));
                let property = symbols.name(vocab::tomasys::FG_STATUS);
                let status = symbols.literal(Literal::string("INTERNAL_ERROR"));
                let delta =
                    Delta { insert: vec![Fact::new(property, [grounding, status])], delete: Vec::new() };
                self.runtime.apply(delta).is_ok()
            }
        };
        let theirs = step["returned"] == true || step["returned"] == 1;
        same("accepted", &json!(accepted), &json!(theirs))
    }

    fn cycle(&mut self, step: &Value) -> Result<(), String> {
        let reasoned = !self.runtime.objectives().is_empty();
        same("reasoned", &json!(reasoned), &step["reasoned"])?;
        let consistent = reasoned && self.runtime.conclude().map_err(|error| error.to_string())?.is_empty();
        let mut adaptable = if consistent { self.runtime.objectives() } else { Vec::new() };
        adaptable.retain(Objective::wants_design);
        let mut theirs: Vec<&str> = step["adaptable"]
            .as_array()
            .expect("list")
            .iter()
            .map(|name| name.as_str().expect("name"))
            .collect();
        theirs.sort_unstable();
        let ours: Vec<_> = adaptable.iter().map(|objective| objective.individual.name.as_str()).collect();
        same("adaptable", &json!(ours), &json!(theirs))?;
        same("after analyze", &self.state(), &step["after_analyze"])?;
        let mut plan = BTreeMap::new();
        for objective in &adaptable {
            if objective.updatable {
                self.runtime.note_recoveries().map_err(|error| error.to_string())?;
            }
            let name = &objective.individual.name;
            if let Some(design) = selected(&self.runtime, name) {
                plan.insert(name.clone(), design);
            }
        }
        same("plan", &json!(plan), &step["plan"])?;
        if step["reconfiguration_success"] != false {
            for (objective, design) in &plan {
                self.runtime.ground(objective, design).map_err(|error| error.to_string())?;
            }
        }
        Ok(())
    }

    fn state(&self) -> Value {
        let first_text = |texts: &[String]| texts.first().map_or(Value::Null, |text| json!(text));
        let (mut objectives, mut groundings) = (BTreeMap::new(), BTreeMap::new());
        for objective in self.runtime.objectives() {
            for grounding in &objective.groundings {
                let measurements: Vec<_> = grounding
                    .measurements
                    .iter()
                    .map(|(holder, value)| {
                        let value = value.as_ref().and_then(|value| value.lexical().parse::<f64>().ok());
                        json!([holder.name, value])
                    })
                    .collect();
                groundings.insert(
                    grounding.individual.name.clone(),
                    json!({
                        "typeFD": grounding.design.as_ref().map(|design| &design.name),
                        "solvesO": objective.individual.name,
                        "fg_status": first_text(&grounding.statuses),
                        "hasQAvalue": measurements,
                    }),
                );
            }
            objectives.insert(
                objective.individual.name.clone(),
                json!({
                    "o_status": first_text(&objective.statuses),
                    "o_updatable": objective.updatable.then_some(true),
                    "typeF": objective.function.map(|function| function.name),
                }),
            );
        }
        let components = self.runtime.view().components().into_iter();
        let statuses: BTreeMap<_, _> =
            components.filter_map(|c| Some((c.individual.name, c.status?))).collect();
        let available = self.runtime.available_designs(None).expect("no function named");
        let designs = self.runtime.view().function_designs().into_iter().map(|design| design.individual);
        let unavailable: Vec<_> =
            designs.filter(|design| !available.contains(design)).map(|design| design.name).collect();
        json!({
            "objectives": objectives,
            "groundings": groundings,
            "c_status": statuses,
            "fd_not_realisable": unavailable,
            "fd_error_log": self.error_log(),
        })
    }

    fn error_log(&self) -> BTreeMap<String, Vec<String>> {
        let engine = self.runtime.engine();
        let mut log = BTreeMap::<String, Vec<String>>::new();
        let Some(property) = engine.symbols().find_name(vocab::tomasys::FD_ERROR_LOG) else { return log };
        let name =
            |symbol| vocab::local_name(engine.symbols().value(symbol).as_name().expect("name")).to_owned();
        for row in engine.matching(property, &[None, None]) {
            if engine.is_asserted(&Fact::new(property, row.iter().copied())) {
                log.entry(name(row[0])).or_default().push(name(row[1]));
            }
        }
        log
    }
}
