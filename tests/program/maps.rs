//! Tests of `metaplan import camara-map`: maps in the format of 2017 (with `coord` and without measurements)
//! and in the later format, errors in maps, and coordinates in pictures. The map is invented.

use std::fmt::Write as _;
use std::path::Path;

use metaplan::comparison::{MapOptions, import_map};

use crate::common::{Outcome, headlines, metaplan_in, steps};

/// Places of the map: name, coordinates, and neighbours. Each arc is listed at one or both of its ends.
const PLACES: [(&str, f64, f64, &str); 6] = [
    ("h1", 0.0, 0.0, "\"h2\", \"c1\""),
    ("h2", 6.8, 0.0, "\"h1\", \"h3\""),
    ("h3", 6.8, 3.4, "\"h2\""),
    ("c1", 0.0, 17.0, "\"h1\""),
    ("h4", 6.8, 10.2, "\"h3\", \"c1\""),
    ("hs", 30.0, 10.2, ""),
];

/// Returns the map as JSON in the format of 2017.
pub fn map() -> String {
    let mut text = "{\"map\": [\n".to_owned();
    for (number, (id, x, y, neighbours)) in (1..).zip(PLACES) {
        let end = if number == PLACES.len() { "" } else { "," };
        let _ = writeln!(
            text,
            "  {{\"node-id\": \"{id}\", \"coord\" : {{\"x\" : {x}, \"y\" : {y}}}, \"connected-to\": [{neighbours}] }}{end}"
        );
    }
    text + "],\n\"unsafe-rects\": [\n  {\"top_y\": 2, \"right_x\": 5.5, \"left_x\": 1.5, \"bottom_y\": 1}\n]\n}\n"
}

fn import(directory: &Path, text: &str, options: &[&str]) -> Outcome {
    std::fs::write(directory.join("map.json"), text).expect("written");
    let arguments = ["import", "camara-map", "map.json", "--start", "h1", "--goal", "h4", "-o", "out"];
    metaplan_in(directory, &[&arguments[..], options].concat(), "")
}

/// Returns the length of the shortest path, by enumeration of all simple paths.
fn shortest(from: &str, to: &str, visited: &[&str]) -> f64 {
    let at = |name: &str| PLACES.iter().find(|place| place.0 == name).expect("a place");
    let are_connected =
        |a: &str, b: &str| at(a).3.contains(&format!("\"{b}\"")) || at(b).3.contains(&format!("\"{a}\""));
    if from == to {
        return 0.0;
    }
    let visited_here: Vec<&str> = visited.iter().copied().chain([from]).collect();
    let neighbours =
        PLACES.iter().filter(|place| are_connected(from, place.0) && !visited_here.contains(&place.0));
    let lengths = neighbours.map(|place| {
        (at(from).1 - place.1).hypot(at(from).2 - place.2) + shortest(place.0, to, &visited_here)
    });
    lengths.fold(f64::INFINITY, f64::min)
}

#[test]
fn maps_of_2017_become_missions() {
    let directory = tempfile::tempdir().expect("a directory");
    let outcome = import(directory.path(), &map(), &["--speeds", "full", "--battery", "1000000"]);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (0, "out/camara.toml\n"), "{outcome:#?}");
    for word in [
        "warning[M132]",
        "no measurements of time",
        "no probabilities",
        "the rectangles in `unsafe-rects` are ignored",
        "`h4`-`c1`, `h4`-`h3`: only one end lists the other",
    ] {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
    let outcome = metaplan_in(directory.path(), &["plan", "out/camara.toml", "--format", "json"], "");
    assert_eq!((outcome.status, outcome.stderr.as_str()), (0, ""), "{outcome:#?}");
    let answer = outcome.json();
    // The robot's full speed is 0.68 m/s.
    let seconds = shortest("h1", "h4", &[]) / 0.68;
    assert!((answer["cost"].as_f64().expect("a cost") - seconds).abs() < 1e-3, "{seconds}: {answer:#}");
    let route: Vec<String> =
        steps(&answer).iter().map(|step| step.split(" | ").next().unwrap_or_default().to_owned()).collect();
    assert_eq!(route.len(), 3, "{route:?}");
    // `hs` is unreachable, but the repeated option is reported first.
    let outcome = import(directory.path(), &map(), &["--goal", "hs"]);
    assert_eq!(outcome.status, 2, "an option is there twice: {outcome:#?}");
}

#[test]
fn both_map_formats_give_the_same_mission() {
    let options = MapOptions { start: "h1".to_owned(), goal: "h4".to_owned(), ..MapOptions::default() };
    // The times of long switches exceed 32 bits.
    let long = MapOptions { switch_seconds: u32::MAX, ..options.clone() };
    let slow = import_map("map", &map(), &long).expect("a map").problem;
    assert!(slow.contains(&format!(" {})", 2 * u64::from(u32::MAX))), "{slow}");
    let (old, new) = (map(), map().replace("\"coord\"", "\"coords\""));
    let [old, new] = [old, new].map(|text| import_map("map", &text, &options).expect("a map"));
    assert_eq!((&old.manifest, &old.knowledge, &old.domain), (&new.manifest, &new.knowledge, &new.domain));
    assert_eq!(old.problem, new.problem);
    // Energy of the first arc at full speed: metres · speed · power in milliwatts · factor of the unit.
    let energy = (6.8 * 0.68 * 17_790.0 * 0.01_f64).trunc();
    assert!(old.problem.contains(&format!("(= (energy h1 h2 fd_amcl_kinect) {energy})")), "{}", old.problem);
    assert!(old.problem.contains("(= (time h1 h2 fd_amcl_kinect) 10)"), "{}", old.problem);
}

#[test]
fn different_measurements_of_a_corridor_are_a_warning() {
    let options = MapOptions { start: "h1".to_owned(), goal: "h4".to_owned(), ..MapOptions::default() };
    let warnings = |back: f64| {
        let rates = format!(
            "\"hitrate\": [{{\"from\": \"h1\", \"to\": \"h2\", \"aruco\": {{\"hitrate\": 0.5}}}},
               {{\"from\": \"h2\", \"to\": \"h1\", \"aruco\": {{\"hitrate\": {back}}}}}],\n\"unsafe-rects\""
        );
        let text = map().replacen("\"unsafe-rects\"", &rates, 1);
        let warnings = import_map("map", &text, &options).expect("a map").warnings;
        warnings.iter().map(|warning| warning.message.clone()).collect::<Vec<_>>().join("\n")
    };
    let expected = "`h1`-`h2`: several measurements differ";
    assert!(warnings(0.25).contains(expected), "{}", warnings(0.25));
    assert!(!warnings(0.5).contains(expected), "{}", warnings(0.5));
}

#[test]
fn map_errors_have_a_position() {
    let check = |old: &str, new: &str, place: &str, words: &str| {
        let text = map();
        assert!(text.contains(old), "no `{old}`");
        let directory = tempfile::tempdir().expect("a directory");
        let outcome = import(directory.path(), &text.replacen(old, new, 1), &[]);
        assert_eq!(outcome.status, 3, "{new}: {outcome:#?}");
        assert!(!directory.path().join("out").exists(), "{new}: nothing is written");
        for word in [&format!("map.json:{place}: error["), words] {
            assert!(headlines(&outcome.stderr).contains(word), "{new}: no `{word}`: {outcome:#?}");
        }
    };
    check("\"coord\"", "\"cord\"", "2:79", "missing field `coords` (or `coord`, in maps of 2017)");
    check("\"x\" : 0,", "\"x\" : \"far\",", "2:42", "expected f64");
    check("\"x\" : 0,", "", "2:40", "missing field `x`");
    check("\"x\" : 0", "\"x\" : 1e999", "2:42", "this is not a map");
    check("\"coord\" :", "\"coords\": {\"x\": 1, \"y\": 1}, \"coord\" :", "2:56", "duplicate field");
    check("\"node-id\": \"h1\"", "\"node-id\": 1", "2:15", "the name of a place is a string");
    check("\"node-id\": \"h3\"", "\"node-id\": \"h1\"", "4:15", "the place `h1` is repeated");
    check("\"node-id\": \"h3\"", "\"node-id\": \"H1\"", "4:15", "`H1` and `h1` would be one object in PDDL");
    check("\"node-id\": \"hs\"", "\"node-id\": \"7\"", "7:15", "it should begin with a letter");
    check(
        "[\"h1\", \"h3\"]",
        "[\"h1\", \"hh3\"]",
        "3:76",
        "`h2` leads to `hh3`, which is not a place; did you mean",
    );
    check("[\"h1\", \"h3\"]", "[\"h1\", \"h2\"]", "3:76", "`h2` leads to itself");
    check("],\n", "],,\n", "8:3", "this is not a map");
    check("\n}\n", "\n", "12:1", "EOF");
    check("],\n", "],\n\"time\": [{\"from\": \"h1\"}],\n", "9:24", "needs the place `to`");
    check("\"x\" : 0,", "\"x\" : 1e308,", "2:15", "a coordinate of `h1` is beyond 1e12 metres");
    let measured = "],\n\"time\": [{\"from\": \"h1\", \"to\": \"h2\", \"aruco\": {\"mean\": 1e308}}],\n";
    check("],\n", measured, "9:10", "the mean of `aruco` is above 1e12 seconds");
}

/// The mean speed of measured corridors applies to the others. Very long times have a mean speed that is
/// rounded to 0.
#[test]
fn times_of_a_map_are_finite() {
    let directory = tempfile::tempdir().expect("a directory");
    let measured = "],\n\"time\": [{\"from\": \"h1\", \"to\": \"h2\", \"aruco\": {\"mean\": 1e11}}],\n";
    let outcome = import(directory.path(), &map().replacen("],\n", measured, 1), &[]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let problem = std::fs::read_to_string(directory.path().join("out/problem.pddl")).expect("a problem");
    assert!(!problem.contains("inf") && !problem.contains("NaN"), "{problem}");
}

#[test]
fn dark_corridors_are_corridors_of_the_map() {
    let directory = tempfile::tempdir().expect("a directory");
    let outcome = import(directory.path(), &map(), &["--dark", "h2-h1,h1-h3"]);
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    assert_eq!(outcome.stderr.matches("error[M124]").count(), 1, "{outcome:#?}");
    assert!(outcome.stderr.contains("no corridor between `h1` and `h3`"), "{outcome:#?}");
}

#[test]
fn all_errors_of_a_map_are_reported() {
    let directory = tempfile::tempdir().expect("a directory");
    let text = map()
        .replace("\"h3\", \"c1\"", "\"h9\", \"c9\"")
        .replace("\"node-id\": \"hs\"", "\"node-id\": \"h1\"");
    let outcome = import(directory.path(), &text, &[]);
    for word in ["map.json:6:73: ", "map.json:6:79: ", "map.json:7:15: "] {
        assert!(headlines(&outcome.stderr).contains(word), "no `{word}`: {outcome:#?}");
    }
    assert_eq!(outcome.stderr.matches("error[M124]").count(), 3, "{outcome:#?}");
    std::fs::write(directory.path().join("map.json"), map()).expect("written");
    let outcome = metaplan_in(directory.path(), &["import", "camara-map", "map.json", "-o", "out"], "");
    for word in
        ["the map has no place `l1`; it has: c1, h1, h2, h3, h4, hs; did you mean `c1`?", "no place `l18`"]
    {
        assert!(outcome.stderr.contains(word), "no `{word}`: {outcome:#?}");
    }
}

#[test]
fn names_that_pddl_does_not_allow_are_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    for name in ["1", "_a", "a-b", ""] {
        let outcome = import(directory.path(), &map(), &["--name", name]);
        assert!(
            outcome.status == 2 && outcome.stderr.contains("begin with a letter"),
            "{name}: {outcome:#?}"
        );
    }
}

#[test]
fn places_are_drawn_at_their_coordinates() {
    let directory = tempfile::tempdir().expect("a directory");
    assert_eq!(import(directory.path(), &map(), &["--speeds", "full", "--battery", "1000000"]).status, 0);
    let outcome =
        metaplan_in(directory.path(), &["report", "out/camara.toml", "--svg", "pictures", "-q"], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    assert!(!outcome.stdout.contains("the layout of places"));
    let picture = std::fs::read_to_string(directory.path().join("pictures/map.svg")).expect("a map");
    let document = roxmltree::Document::parse(&picture).expect("XML");
    let at = |name: &str| {
        let mut nodes = document.descendants();
        let place = nodes.find(|node| node.attribute("data-place") == Some(name)).expect("a place");
        let circle = place.children().find(|node| node.tag_name().name() == "circle").expect("a circle");
        ["cx", "cy"].map(|attribute| {
            circle.attribute(attribute).and_then(|text| text.parse::<f64>().ok()).expect("a number")
        })
    };
    let scale = (at("h2")[0] - at("h1")[0]) / 6.8;
    assert!(scale > 0.0);
    for (name, x, y, _) in PLACES.iter().filter(|place| place.0 != "hs") {
        let [drawn_x, drawn_y] = at(name);
        let (right, up) = (drawn_x - at("h1")[0], at("h1")[1] - drawn_y);
        assert!((right - x * scale).abs() < 0.3 && (up - y * scale).abs() < 0.3, "{name}: {right} {up}");
    }
}

/// Nothing is written if a file with another content exists. The same import can be repeated.
#[test]
fn imports_do_not_overwrite_other_files() {
    let directory = tempfile::tempdir().expect("a directory");
    for _ in 0..2 {
        let outcome = import(directory.path(), &map(), &[]);
        assert_eq!(outcome.status, 0, "{outcome:#?}");
    }
    let out = directory.path().join("out");
    std::fs::write(out.join("domain.pddl"), "mine").expect("written");
    std::fs::remove_file(out.join("positions.csv")).expect("removed");
    let outcome = import(directory.path(), &map(), &["--no-battery"]);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (3, ""), "{outcome:#?}");
    for file in ["out/domain.pddl", "out/problem.pddl"] {
        assert!(headlines(&outcome.stderr).contains(&format!("{file}: error[M133]: ")), "{outcome:#?}");
    }
    assert_eq!(std::fs::read_to_string(out.join("domain.pddl")).expect("text"), "mine");
    assert!(!out.join("positions.csv").exists());
}
