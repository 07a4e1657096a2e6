//! Missions with the possible reports of their robots: shipped missions, SUAVE's knowledge base, and
//! generated missions.

use std::fmt::Write as _;
use std::path::Path;

use fastrand::Rng;
use metaplan::mapek::{Loop, Settings};
use metaplan::setup::Setup;
use num_rational::BigRational;

#[derive(Debug, Clone)]
pub struct Design {
    pub name: String,
    pub components: Vec<String>,
    /// Quality bounds: attribute, minimum and maximum.
    pub bounds: Vec<(String, Option<BigRational>, Option<BigRational>)>,
}

pub struct Place {
    pub name: String,
    pub started: Loop,
    pub components: Vec<String>,
    /// Attributes with possible values: on and around their bounds, and beyond. Without any bounds, all measured
    /// attributes have fixed values.
    pub attributes: Vec<(String, Vec<String>)>,
    pub designs: Vec<Design>,
    /// Pairs of a component and a component that it depends on.
    pub depends: Vec<(String, String)>,
    /// Whether the shipped rules and the dependencies alone determine the availability of designs.
    pub is_plain: bool,
}

impl Place {
    fn new(name: &str, manifest: &Path, depends: Vec<(String, String)>, is_plain: bool) -> Self {
        let mission = Setup::read(manifest).unwrap_or_else(|errors| panic!("{name}: {errors:?}")).mission;
        let settings = Settings::immediate().with_time_limit(None);
        let mut started = Loop::new(mission, settings).expect("the mission can be planned for");
        started.start();
        let knowledge = started.beliefs().mission().knowledge().expect("a knowledge base");
        let view = knowledge.view();
        let components = view.components().into_iter().map(|component| component.individual.name).collect();
        let designs: Vec<Design> = view
            .function_designs()
            .into_iter()
            .map(|design| Design {
                name: design.individual.name,
                components: design.components.into_iter().map(|component| component.name).collect(),
                bounds: design
                    .requirements
                    .into_iter()
                    .map(|bound| (bound.attribute, bound.minimum, bound.maximum))
                    .collect(),
            })
            .collect();
        let mut attributes: Vec<(String, Vec<String>)> = Vec::new();
        for (attribute, minimum, maximum) in designs.iter().flat_map(|design| &design.bounds) {
            let index = attributes.iter().position(|(name, _)| name == attribute).unwrap_or_else(|| {
                attributes.push((attribute.clone(), vec!["0".to_owned(), "1000".to_owned()]));
                attributes.len() - 1
            });
            for bound in minimum.iter().chain(maximum) {
                for difference in [-1, 0, 1] {
                    let value = bound + BigRational::new(difference.into(), 100.into());
                    attributes[index].1.push(rules::Decimal::from_rational(&value).to_string());
                }
            }
        }
        if attributes.is_empty() {
            let measured = view.measurements().into_iter().map(|m| (m.attribute, Vec::new()));
            attributes.extend(measured);
            for (_, values) in &mut attributes {
                values.extend(["0", "0.5", "1.2", "2", "2.4", "3", "4"].map(ToOwned::to_owned));
            }
        }
        Self { name: name.to_owned(), started, components, attributes, designs, depends, is_plain }
    }
}

pub fn shipped() -> Vec<Place> {
    let place = |name: &str| {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("missions/{name}.toml"));
        Place::new(name, &manifest, Vec::new(), true)
    };
    ["ugv", "uuv", "ugv_plain", "uuv_plain", "camara_like"].map(place).into()
}

pub fn suave() -> Option<Place> {
    let directory = crate::fleet::files()?;
    Some(Place::new("suave", &directory.path().join("m.toml"), Vec::new(), false))
}

const PREFIXES: &str = "@prefix : <http://example.org/m#> .\n\
    @prefix owl: <http://www.w3.org/2002/07/owl#> .\n\
    @prefix t: <http://metacontrol.org/tomasys#> .\n\
    <http://example.org/m> a owl:Ontology ; owl:imports <http://metacontrol.org/tomasys> .\n\
    :dependsOn a owl:ObjectProperty .\n";

/// Rule: a component fails if a component that it depends on has failed, regardless of its own reports.
const DEPENDENCY: &str = "@prefix : <http://example.org/m#> .\n@prefix t: <http://metacontrol.org/tomasys#> .\n\
    [dependency] :dependsOn(?a, ?b) ^ t:c_status(?b, \"FALSE\") -> t:c_status(?a, \"FALSE\") .\n";

const DOMAIN: &str = "(define (domain m) (:requirements :typing :fluents :durative-actions)
  (:types place)
  (:predicates (robot_at ?p - place) (way ?from ?to - place) (done ?p - place))
  (:functions (usage))
  (:durative-action move :parameters (?from ?to - place) :duration (= ?duration (+ 1 (usage)))
    :condition (and (at start (robot_at ?from)) (over all (way ?from ?to)))
    :effect (and (at start (not (robot_at ?from))) (at end (robot_at ?to))))
  (:durative-action work :parameters (?p - place) :duration (= ?duration (+ 2 (usage)))
    :condition (over all (robot_at ?p)) :effect (at end (done ?p))))";

pub fn generated(seed: u64) -> Place {
    let (directory, depends) = files(seed);
    Place::new(&format!("generated {seed}"), &directory.path().join("m.toml"), depends, true)
}

pub fn own_files(seed: u64) -> tempfile::TempDir {
    files(seed).0
}

/// Returns the directory, and pairs of a component and a component that it depends on.
fn files(seed: u64) -> (tempfile::TempDir, Vec<(String, String)>) {
    let mut random = Rng::with_seed(seed);
    let (functions, components) = (random.usize(1..=2), random.usize(3..=5));
    let mut text = PREFIXES.to_owned();
    text += ":usage a t:QualityAttributeType .\n";
    for attribute in ["light", "depth"] {
        let _ = writeln!(text, ":{attribute} a t:QualityAttributeType .");
        let _ = writeln!(
            text,
            ":obs_{attribute} a t:QAvalue ; t:isQAtype :{attribute} ; t:isMeasured true ; t:hasValue 0.5 ."
        );
    }
    for component in 0..components {
        let _ = writeln!(text, ":c_{component} a t:Component .");
    }
    let mut depends = Vec::new();
    for component in 1..components {
        if random.u32(..3) == 0 {
            let dependency = random.usize(..component);
            let _ = writeln!(text, ":c_{component} :dependsOn :c_{dependency} .");
            depends.push((format!("c_{component}"), format!("c_{dependency}")));
        }
    }
    for function in 0..functions {
        let _ = writeln!(text, ":f_{function} a t:Function .");
        for number in 0..random.usize(2..=4) {
            let design = format!("fd_{function}_{number}");
            let _ = writeln!(text, ":{design} a t:FunctionDesign ; t:solvesF :f_{function} .");
            for _ in 0..random.usize(0..=2) {
                let _ = writeln!(text, ":{design} t:requiresC :c_{} .", random.usize(..components));
            }
            let usage = random.u32(..5);
            let _ = writeln!(
                text,
                ":{design} t:hasQAestimation :u_{design} . :u_{design} a t:QAvalue ; t:isQAtype :usage ; t:hasValue {usage}.0 ."
            );
            for attribute in ["light", "depth"] {
                let side = ["hasMinimum 0.3", "hasMaximum 0.7"][random.usize(..2)];
                if random.u32(..3) == 0 {
                    let _ = writeln!(
                        text,
                        ":{design} t:hasRequirement :r_{design}_{attribute} . :r_{design}_{attribute} a t:Requirement ; t:isQAtype :{attribute} ; t:{side} ."
                    );
                }
            }
        }
    }
    text += ":a_move a t:Action ; t:requiresF :f_0 .\n:a_work a t:Action ; t:requiresF :f_0";
    text += if functions == 2 { " , :f_1 .\n" } else { " .\n" };
    let places = random.usize(3..=5);
    let mut problem = "(define (problem p) (:domain m) (:objects".to_owned();
    for place in 0..places {
        let _ = write!(problem, " p{place}");
    }
    problem += " - place) (:init (robot_at p0)";
    for place in 0..places {
        let next = (place + 1) % places;
        let _ = write!(problem, " (way p{place} p{next}) (way p{next} p{place})");
    }
    problem += ") (:goal (and (done p1) (done p2) (robot_at p0))) (:metric minimize (total-time)))";
    let manifest = "name = \"m\"\n[knowledge]\nfiles = [\"kb.ttl\"]\nrules = [\"coadaptation\", \"own.swrl\"]\n\
        [planning]\ndomain = \"domain.pddl\"\nproblem = \"problem.pddl\"\n";
    let directory = tempfile::tempdir().expect("a directory");
    let files = [
        ("kb.ttl", text.as_str()),
        ("own.swrl", DEPENDENCY),
        ("domain.pddl", DOMAIN),
        ("problem.pddl", &problem),
        ("m.toml", manifest),
    ];
    for (name, text) in files {
        std::fs::write(directory.path().join(name), text).expect("a file");
    }
    (directory, depends)
}
