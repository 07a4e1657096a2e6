//! Exports a plan as a behaviour tree of BehaviorTree.CPP 4: a sequence of actions, with the
//! changes of designs between them.
//!
//! An action is a node with the name of its schema and a port for each parameter. Before an action that needs another
//! design of a function than the one chosen last, a node `ChangeMode` activates this design. Its ports are
//! `service_name`, the `system_modes` service of the function, and `mode_name`. `TreeNodesModel` declares all nodes, as
//! Groot2 requires.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use ::mission::Mission;
use num_rational::BigRational;
use planner::{Plan, Step};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};

const CHANGE_NODE: &str = "ChangeMode";
/// Attribute names that BehaviorTree.CPP reserves, so that ports cannot have them.
const RESERVED: [&str; 2] = ["name", "ID"];

struct Node {
    id: String,
    name: String,
    ports: Vec<(String, String)>,
}

/// Returns the XML of a behaviour tree for a sequential plan without waits, see [`first_wait`]. The plan's arguments must
/// be those of the domain's file, without the designs that the knowledge base has added.
pub fn btcpp_text(mission: &Mission, plan: &Plan) -> String {
    let mut text = Vec::new();
    // Writing to memory does not fail.
    let _ = write(&mut Writer::new_with_indent(&mut text, b' ', 2), &mission.name, &nodes(mission, plan));
    String::from_utf8(text).unwrap_or_default() + "\n"
}

/// Returns the first action of a sequential plan before which the robot waits for a timed initial literal.
pub fn first_wait(plan: &Plan) -> Option<&Step> {
    let mut end = BigRational::default();
    plan.steps.iter().find(|step| {
        let start = step.start.to_rational();
        let is_late = start > end;
        end = start + step.duration.to_rational();
        is_late
    })
}

fn nodes(mission: &Mission, plan: &Plan) -> Vec<Node> {
    let mut nodes = Vec::new();
    let mut at_work: BTreeMap<&str, &str> = BTreeMap::new();
    for (step, number) in plan.steps.iter().zip(1..) {
        for (function, design) in &step.configuration {
            if at_work.insert(function, design) != Some(design) {
                let service = ("service_name".to_owned(), format!("/{function}/change_mode"));
                let ports = vec![service, ("mode_name".to_owned(), design.clone())];
                nodes.push(Node {
                    id: CHANGE_NODE.to_owned(),
                    name: format!("{function} = {design}"),
                    ports,
                });
            }
        }
        let words: Vec<&str> =
            std::iter::once(&step.action).chain(&step.arguments).map(String::as_str).collect();
        let name = format!("{number}: {}", words.join(" "));
        nodes.push(Node { id: step.action.clone(), name, ports: ports(mission, step) });
    }
    nodes
}

fn ports(mission: &Mission, step: &Step) -> Vec<(String, String)> {
    let named = |action: &&pddl::ast::Action| {
        action.identifier.name.as_str().eq_ignore_ascii_case(&step.action)
            && action.parameters.len() >= step.arguments.len()
    };
    let schema = mission.domain().actions.iter().find(named);
    let parameters = schema.map(|action| action.parameters.as_slice()).unwrap_or_default();
    let names = parameters.iter().map(|parameter| port(parameter.identifier.name.as_str()));
    names.zip(step.arguments.iter().cloned()).collect()
}

/// Converts the name of a parameter to a port name, which begins with a letter and is not reserved.
fn port(parameter: &str) -> String {
    let is_taken = RESERVED.iter().any(|reserved| reserved.eq_ignore_ascii_case(parameter));
    let begins = parameter.starts_with(|first: char| first.is_ascii_alphabetic());
    if begins && !is_taken { parameter.to_owned() } else { format!("p_{parameter}") }
}

fn write<W: io::Write>(writer: &mut Writer<W>, mission: &str, nodes: &[Node]) -> io::Result<()> {
    let tree = if mission.is_empty() { "plan" } else { mission };
    writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let root = writer.create_element("root").with_attribute(("BTCPP_format", "4"));
    root.with_attribute(("main_tree_to_execute", tree)).write_inner_content(|writer| {
        let behaviour = writer.create_element("BehaviorTree").with_attribute(("ID", tree));
        behaviour.write_inner_content(|writer| {
            writer.create_element("Sequence").with_attribute(("name", tree)).write_inner_content(
                |writer| {
                    nodes.iter().try_for_each(|node| {
                        let element =
                            writer.create_element("Action").with_attribute(("ID", node.id.as_str()));
                        let element = element.with_attribute(("name", node.name.as_str()));
                        let ports = node.ports.iter().map(|(port, value)| (port.as_str(), value.as_str()));
                        element.with_attributes(ports).write_empty().map(drop)
                    })
                },
            )?;
            Ok(())
        })?;
        writer.create_element("TreeNodesModel").write_inner_content(|writer| declare(writer, nodes))?;
        Ok(())
    })?;
    Ok(())
}

fn declare<W: io::Write>(writer: &mut Writer<W>, nodes: &[Node]) -> io::Result<()> {
    let mut kinds: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for node in nodes {
        kinds.entry(&node.id).or_default().extend(node.ports.iter().map(|(port, _)| port.as_str()));
    }
    kinds.iter().try_for_each(|(id, ports)| {
        let kind = writer.create_element("Action").with_attribute(("ID", *id));
        let written = kind.write_inner_content(|writer| {
            ports.iter().try_for_each(|port| {
                let element = writer.create_element("input_port").with_attribute(("name", *port));
                element.with_attribute(("type", "std::string")).write_empty().map(drop)
            })
        });
        written.map(drop)
    })
}
