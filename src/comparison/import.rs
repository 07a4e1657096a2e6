//! Converts a map of Cámara et al. (JSON) to a mission: a knowledge base, PDDL with probabilities,
//! and a manifest.
//!
//! The map's licence forbids redistribution, so users provide their own copy. Data that the file
//! lacks (the robot's configurations, their power, the dark corridors) is taken from [`MapOptions`]
//! and from the tables `DESIGNS` and `SPEEDS`.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::map::{Coordinates, Map, Measured, object};
use crate::message::{Errors, Message, did_you_mean};

/// Options of [`import_map`]: start and goal of the mission, and data that the map lacks.
#[derive(Debug, Clone)]
pub struct MapOptions {
    /// The mission's name.
    pub name: String,
    /// The place of the map at which the mission starts.
    pub start: String,
    /// The place of the map at which the mission ends.
    pub goal: String,
    /// Name of the configuration at the start, such as `amcl-lidar`.
    pub configuration: String,
    /// Pairs of neighbouring places with a dark corridor, in which some configurations do not work.
    pub dark: Vec<(String, String)>,
    /// Energy of the battery at the start, in the map's unit. `None` for a mission without battery.
    pub battery: Option<u32>,
    /// Seconds for enabling or disabling one component.
    pub switch_seconds: u32,
    /// `true` if the probabilities of collisions are imported; otherwise there are no collisions.
    pub collisions: bool,
    /// `true` if the probabilities that a move fails are imported; otherwise moves never fail.
    pub failures: bool,
    /// `true` if each configuration exists with all three speeds, as in the original; `false` for
    /// full speed only.
    pub speeds: bool,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self {
            name: "camara".to_owned(),
            start: "l1".to_owned(),
            goal: "l18".to_owned(),
            configuration: "amcl-lidar".to_owned(),
            dark: Vec::new(),
            battery: Some(32_560),
            switch_seconds: 5,
            collisions: true,
            failures: true,
            speeds: true,
        }
    }
}

/// The files of an imported mission, as texts.
#[derive(Debug, Clone)]
pub struct Files {
    /// Manifest of the mission, the text of `NAME.toml`.
    pub manifest: String,
    /// Knowledge base, the text of `NAME.ttl`.
    pub knowledge: String,
    /// PDDL domain, the text of `domain.pddl`.
    pub domain: String,
    /// PDDL problem, the text of `problem.pddl`.
    pub problem: String,
    /// Coordinates of the places, the text of `positions.csv`.
    pub positions: String,
    /// Warnings about parts of the map that are ignored, and about assumptions that replace missing data.
    pub warnings: Vec<Message>,
}

/// A localisation method of the robot: name, power in milliwatts, `true` if it works in the dark,
/// the name of the method whose measurements apply, and its components.
struct Design(&'static str, f64, bool, &'static str, &'static [&'static str]);

const DESIGNS: [Design; 6] = [
    Design(
        "amcl-kinect",
        17_790.0,
        false,
        "amcl-kinect",
        &["amcl", "kinect", "laserscan_nodelet", "map_server"],
    ),
    Design("amcl-lidar", 19_790.0, false, "amcl-lidar", &["amcl", "lidar", "map_server"]),
    Design(
        "mrpt-kinect",
        18_942.0,
        false,
        "mrpt-kinect",
        &["mrpt", "kinect", "laserscan_nodelet", "map_server"],
    ),
    Design("mrpt-lidar", 20_942.0, false, "mrpt-kinect", &["mrpt", "lidar", "map_server"]),
    Design(
        "aruco",
        16_963.0,
        false,
        "aruco",
        &["marker_localization", "marker_recognizer", "camera", "map_server_obstacles"],
    ),
    Design(
        "aruco-headlamp",
        26_963.0,
        true,
        "aruco",
        &["marker_localization", "marker_recognizer", "camera", "headlamp", "map_server_obstacles"],
    ),
];

/// A speed of the robot: name, metres per second, power in milliwatts in addition to that of the localisation method,
/// and `true` if collisions count at this speed. All measurements of the map are for full speed, the first entry of
/// `SPEEDS`.
struct Speed(&'static str, f64, f64, bool);

const SPEEDS: [Speed; 3] = [
    Speed("full", 0.68, 6026.0, true),
    Speed("half", 0.35, 14_004.0, true),
    Speed("safe", 0.24, 4000.0, false),
];

#[derive(Clone, Copy)]
struct LegalConfiguration {
    design: &'static Design,
    speed: &'static Speed,
    /// `true` if each speed is a component of its own, because there are several speeds.
    several: bool,
}

impl LegalConfiguration {
    fn all(options: &MapOptions) -> impl Iterator<Item = Self> + use<> {
        let several = options.speeds;
        let speeds = &SPEEDS[..if several { SPEEDS.len() } else { 1 }];
        let of = move |design| speeds.iter().map(move |speed| Self { design, speed, several });
        DESIGNS.iter().flat_map(of)
    }

    fn is_full(self) -> bool {
        self.speed.0 == SPEEDS[0].0
    }

    fn object(self) -> String {
        let name = object(self.design.0);
        if self.is_full() { format!("fd_{name}") } else { format!("fd_{name}_{}", self.speed.0) }
    }

    fn components(self) -> Vec<String> {
        let components = self.design.4.iter().map(|name| (*name).to_owned());
        components.chain(self.several.then(|| format!("{}_speed", self.speed.0))).collect()
    }

    fn slowness(self) -> f64 {
        SPEEDS[0].1 / self.speed.1
    }

    fn effort(self) -> f64 {
        self.slowness() * (self.design.1 + self.speed.2) / (self.design.1 + SPEEDS[0].2)
    }
}

/// Full speed in metres per second. The energy of a move is computed from it, and the time if the map has no
/// measurements.
const SPEED: f64 = 0.68;
/// Lower limit on the mean speed that is computed from measurements, in metres per second.
const MIN_SPEED: f64 = 0.001;
/// Factor in the energy of a move at full speed, in the map's unit: length in metres × [`SPEED`] × power in
/// milliwatts × this factor.
const ENERGY: f64 = 0.01;
const MAX_LISTED_PLACES: usize = 20;
/// Energy of the battery that is kept in reserve, in the map's unit.
const RESERVE_LEVELS: u32 = 500;

type Corridor = (String, String);

fn pair(a: &str, b: &str) -> Corridor {
    if a <= b { (a.to_owned(), b.to_owned()) } else { (b.to_owned(), a.to_owned()) }
}

/// Returns the measurement in `field` for each corridor and localisation method that have one, rounded to `digits`
/// decimals. Of several measurements of a corridor, in any direction, the last one is used.
fn measured(
    list: &[Measured<'_>],
    field: &str,
    digits: usize,
) -> BTreeMap<Corridor, BTreeMap<&'static str, f64>> {
    let mut result: BTreeMap<Corridor, BTreeMap<&'static str, f64>> = BTreeMap::new();
    for Measured { from, to, entry, .. } in list {
        let by = result.entry(pair(from, to)).or_default();
        for Design(name, ..) in &DESIGNS {
            if let Some(value) = entry[*name][field].as_f64() {
                by.insert(name, rounded(value, digits));
            }
        }
    }
    result
}

fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.digits$}").parse().unwrap_or(value)
}

/// Converts the text of a map to the files of a mission.
///
/// # Errors
/// The text is not a map of the supported form, or a place, corridor or configuration in `options` does not
/// exist.
pub fn import_map(file: &str, text: &str, options: &MapOptions) -> Result<Files, Errors> {
    let map = Map::read(file, text)?;
    let places = map.places();
    let endpoints =
        [&options.start, &options.goal].into_iter().chain(options.dark.iter().flat_map(|(a, b)| [a, b]));
    let mut problems: Vec<_> = endpoints
        .filter(|name| !places.contains(name.as_str()))
        .map(|name| {
            let suggestion = did_you_mean(name, places.iter().copied());
            let names = places.iter().take(MAX_LISTED_PLACES).copied().collect::<Vec<_>>().join(", ");
            let ellipsis = if places.len() > MAX_LISTED_PLACES { ", …" } else { "" };
            let text = format!("the map has no place `{name}`; it has: {names}{ellipsis}{suggestion}");
            Message::at("M124", file, None, text)
        })
        .collect();
    let arcs = arcs(&map);
    for (a, b) in options.dark.iter().filter(|(a, b)| !arcs.contains(&pair(a, b))) {
        if places.contains(a.as_str()) && places.contains(b.as_str()) {
            let text = format!("the map has no corridor between `{a}` and `{b}`, so it cannot be dark");
            problems.push(Message::at("M124", file, None, text));
        }
    }
    if !DESIGNS.iter().any(|Design(name, ..)| *name == options.configuration) {
        let names: Vec<_> = DESIGNS.iter().map(|Design(name, ..)| *name).collect();
        let text =
            format!("there is no configuration `{}`; there are: {}", options.configuration, names.join(", "));
        problems.push(Message::error("M124", text));
    }
    if !problems.is_empty() {
        return Err(problems.into());
    }
    Ok(Files {
        manifest: manifest(&options.name),
        knowledge: knowledge(options),
        domain: domain(options),
        problem: problem(&map, options),
        positions: positions(&map),
        warnings: map.warnings(file),
    })
}

fn manifest(name: &str) -> String {
    format!(
        "name = \"{name}\"\ndescription = \"A robot crosses a map; one of its configurations moves it along each arc.\"\n\n\
         [knowledge]\nfiles = [\"{name}.ttl\"]\n\n[planning]\ndomain = \"domain.pddl\"\nproblem = \"problem.pddl\"\n\n\
         [report]\npositions = \"positions.csv\"\n\n[probabilistic]\n# One level of the battery in the process; 1 is exact, and the process as much larger.\nbattery_unit = 100\n\n\
         [scenarios.kinect_failure]\ndescription = \"The Kinect fails.\"\nfail = [\"c_kinect\"]\n"
    )
}

fn positions(map: &Map<'_>) -> String {
    map.nodes.iter().fold("place,x,y\n".to_owned(), |text, node| {
        text + &format!("{},{},{}\n", object(&node.id.text), node.coords.x, node.coords.y)
    })
}

fn knowledge(options: &MapOptions) -> String {
    let name = &options.name;
    let mut text = format!(
        "# The configurations of a robot, by the components that they need.\n\n\
         @prefix : <http://metacontrol.org/metaplan/{name}#> .\n\
         @prefix owl: <http://www.w3.org/2002/07/owl#> .\n\
         @prefix t: <http://metacontrol.org/tomasys#> .\n\n\
         <http://metacontrol.org/metaplan/{name}> a owl:Ontology ;\n    \
         owl:imports <http://metacontrol.org/tomasys> .\n\n\
         :f_move a owl:NamedIndividual , t:Function .\n\
         :a_move a owl:NamedIndividual , t:Action ; t:requiresF :f_move .\n\n"
    );
    let components: BTreeSet<String> =
        LegalConfiguration::all(options).flat_map(LegalConfiguration::components).collect();
    for component in components {
        let _ = writeln!(text, ":c_{component} a owl:NamedIndividual , t:Component .");
    }
    text.push('\n');
    for legal in LegalConfiguration::all(options) {
        let components: Vec<_> =
            legal.components().iter().map(|component| format!(":c_{component}")).collect();
        let _ = writeln!(
            text,
            ":{} a owl:NamedIndividual , t:FunctionDesign ; t:solvesF :f_move ;\n    t:requiresC {} .",
            legal.object(),
            components.join(" , ")
        );
    }
    text
}

const DOMAIN: &str = "; A robot moves along arcs in one of its configurations. What a move takes depends on both; the probabilities of
; success and of collisions are for the probabilistic approach, and no action reads them.
(define (domain coadaptation)
  (:requirements :typing :equality :negative-preconditions :numeric-fluents)
  (:types waypoint functiondesign)
  (:predicates
    (robot_at ?at - waypoint)
    (configured ?fd - functiondesign)
    (fd_available ?fd - functiondesign)
    (suits ?fd - functiondesign ?from ?to - waypoint))
  (:functions
    (time ?from ?to - waypoint ?fd - functiondesign)    ; seconds
    (energy ?from ?to - waypoint ?fd - functiondesign)  ; units of the battery
    (success ?from ?to - waypoint ?fd - functiondesign) ; probability of getting there
    (hit ?from ?to - waypoint ?fd - functiondesign)     ; probability of a collision on the way
    (switch_time ?old ?new - functiondesign)            ; seconds
    (battery)
    (reserve)
    (total_time)
    (total_energy))
  (:action move
    :parameters (?fd - functiondesign ?from ?to - waypoint)
    :precondition (and (robot_at ?from) (configured ?fd) (fd_available ?fd) (suits ?fd ?from ?to)
      (>= (battery) (+ (reserve) (energy ?from ?to ?fd))))
    :effect (and (not (robot_at ?from)) (robot_at ?to)
      (decrease (battery) (energy ?from ?to ?fd))
      (increase (total_energy) (energy ?from ?to ?fd))
      (increase (total_time) (time ?from ?to ?fd))))
  (:action reconfigure
    :parameters (?old ?new - functiondesign)
    :precondition (and (configured ?old) (fd_available ?new) (not (= ?old ?new)))
    :effect (and (not (configured ?old)) (configured ?new)
      (increase (total_time) (switch_time ?old ?new)))))
";

fn domain(options: &MapOptions) -> String {
    if options.battery.is_some() {
        return DOMAIN.to_owned();
    }
    let ends = DOMAIN.replace(
        "(suits ?fd ?from ?to)\n      (>= (battery) (+ (reserve) (energy ?from ?to ?fd))))",
        "(suits ?fd ?from ?to))",
    );
    let lines =
        ends.lines().filter(|line| !["(battery)", "(reserve)"].iter().any(|word| line.contains(word)));
    lines.fold(String::new(), |text, line| text + line + "\n")
}

fn arcs(map: &Map<'_>) -> BTreeSet<Corridor> {
    let nodes = map.nodes.iter();
    let neighbours =
        nodes.flat_map(|node| node.neighbours.iter().map(|neighbour| pair(&node.id.text, &neighbour.text)));
    neighbours.collect()
}

fn problem(map: &Map<'_>, options: &MapOptions) -> String {
    let times = measured(&map.time, "mean", 4);
    let hits = measured(&map.hitrate, "hitrate", 9);
    let successes = measured(&map.successrate, "successrate", 9);
    let at: BTreeMap<&str, &Coordinates> =
        map.nodes.iter().map(|node| (node.id.text.as_str(), &node.coords)).collect();
    let arcs = arcs(map);
    let length =
        |(a, b): &Corridor| (at[a.as_str()].x - at[b.as_str()].x).hypot(at[a.as_str()].y - at[b.as_str()].y);
    let dark: BTreeSet<Corridor> = options.dark.iter().map(|(a, b)| pair(a, b)).collect();
    // For an arc without measurement, the mean speed over all measured arcs is assumed.
    let speed = |source: &str| {
        let measured = times.iter().filter(|(arc, _)| arcs.contains(*arc));
        let (metres, seconds) = measured
            .filter_map(|(arc, by)| Some((rounded(length(arc), 6), *by.get(source)?)))
            .filter(|(_, seconds)| *seconds > 0.0)
            .fold((0.0, 0.0), |(m, s), (metres, seconds)| (m + metres, s + seconds));
        // The time of a move with the speed 0 would be infinite.
        rounded(if seconds > 0.0 { metres / seconds } else { SPEED }, 3).max(MIN_SPEED)
    };
    let mut init = String::new();
    for arc in &arcs {
        for legal in LegalConfiguration::all(options) {
            let Design(_, power, sees, source, _) = legal.design;
            if dark.contains(arc) && !sees {
                continue;
            }
            let metres = length(arc);
            let value = |table: &BTreeMap<Corridor, BTreeMap<&'static str, f64>>| {
                table.get(arc)?.get(source).copied()
            };
            let seconds = value(&times)
                .filter(|seconds| *seconds > 0.0)
                .unwrap_or_else(|| rounded(rounded(metres, 6) / speed(source), 4));
            let seconds = if legal.is_full() { seconds } else { rounded(seconds * legal.slowness(), 4) };
            let energy = metres * SPEED * power * ENERGY;
            let energy = (if legal.is_full() { energy } else { energy * legal.effort() }).trunc();
            for (from, to) in [(&arc.0, &arc.1), (&arc.1, &arc.0)] {
                let (from, to, design) = (object(from), object(to), legal.object());
                let _ = writeln!(init, "    (suits {design} {from} {to})");
                let _ = writeln!(init, "    (= (time {from} {to} {design}) {seconds})");
                let _ = writeln!(init, "    (= (energy {from} {to} {design}) {energy})");
                let numbers = [
                    ("success", value(&successes).filter(|_| options.failures), 1.0),
                    ("hit", value(&hits).filter(|_| options.collisions && legal.speed.3), 0.0),
                ];
                for (role, value, usual) in numbers {
                    if let Some(value) = value.filter(|value| (value - usual).abs() > 0.0) {
                        let _ = writeln!(init, "    (= ({role} {from} {to} {design}) {value})");
                    }
                }
            }
        }
    }
    for old in LegalConfiguration::all(options) {
        for new in LegalConfiguration::all(options).filter(|new| new.object() != old.object()) {
            let (before, after) = (old.components(), new.components());
            let off = before.iter().filter(|component| !after.contains(component)).count();
            let on = after.iter().filter(|component| !before.contains(component)).count();
            let seconds = (off + on) as u64 * u64::from(options.switch_seconds);
            let _ = writeln!(init, "    (= (switch_time {} {}) {seconds})", old.object(), new.object());
        }
    }
    let mut places: Vec<_> = arcs.iter().flat_map(|(a, b)| [object(a), object(b)]).collect();
    places.extend([object(&options.start), object(&options.goal)]);
    places.sort_by_key(|name| (name.len(), name.clone()));
    places.dedup();
    let designs: Vec<_> = LegalConfiguration::all(options).map(LegalConfiguration::object).collect();
    let battery = options
        .battery
        .map(|battery| format!("    (= (battery) {battery}) (= (reserve) {RESERVE_LEVELS})\n"));
    let battery = battery.unwrap_or_default();
    let initial = format!("fd_{}", object(&options.configuration));
    format!(
        "(define (problem {})\n  (:domain coadaptation)\n  (:objects\n    {} - waypoint\n    {} - functiondesign)\n  \
         (:init\n    (robot_at {}) (configured {})\n{battery}    \
         (= (total_time) 0) (= (total_energy) 0)\n{init}  )\n  (:goal (robot_at {}))\n  (:metric minimize (total_time)))\n",
        object(&options.name),
        places.join(" "),
        designs.join(" "),
        object(&options.start),
        initial,
        object(&options.goal)
    )
}
