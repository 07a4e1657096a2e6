//! Tests of `metaplan report`, of pictures of plans and of behaviour trees: they contain the whole answer, and
//! hostile names are escaped.

use std::fmt::Write as _;
use std::time::Instant;

use roxmltree::Document;
use serde_json::Value;

use crate::common::{copy_of_mission, edit, metaplan, metaplan_in, root};

/// Number of drawings of each picture on a page, for columns of different widths. Plans shown side by side have
/// two drawings. No picture in these tests is too wide for the narrow columns, for which it would not be drawn.
const DRAWINGS: usize = 3;
const MAX_PAGE_BYTES: usize = 500_000;

fn page(arguments: &[&str]) -> String {
    let command: Vec<&str> = ["report"].iter().chain(arguments).copied().collect();
    let outcome = metaplan(&command);
    assert_eq!(outcome.status, 0, "{outcome:?}");
    outcome.stdout
}

fn count(page: &str, attribute: &str, value: &str) -> usize {
    page.matches(&format!("{attribute}=\"{value}\"")).count()
}

#[test]
fn page_contains_the_whole_answer() {
    for (mission, places) in [("ugv", 9), ("ugv_plain", 9), ("uuv", 0), ("uuv_plain", 0), ("camara_like", 24)]
    {
        let file = format!("missions/{mission}.toml");
        let page = page(&[&file]);
        assert!(page.len() <= MAX_PAGE_BYTES, "{mission}: {} bytes", page.len());
        assert_eq!(page.matches("data-place=").count(), DRAWINGS * places, "{mission}");
        let answer = metaplan(&["plan", &file, "--format", "json"]).json();
        let steps = answer["steps"].as_array().expect("steps");
        let mut marks = 0;
        for (step, number) in steps.iter().zip(1..) {
            assert!(count(&page, "data-step", &number.to_string()) >= 2, "{mission}: step {number}");
            for (function, design) in step["configuration"].as_object().expect("a configuration") {
                assert_eq!(count(&page, "data-lane", function), DRAWINGS, "{mission}: {function}");
                assert!(page.contains(design.as_str().expect("a name")), "{mission}: {design}");
            }
            marks += step["reconfigured"].as_array().map_or(0, Vec::len);
        }
        assert_eq!(page.matches("data-mark=").count(), DRAWINGS * marks, "{mission}");
        let reason = metaplan(&[
            "reason",
            &format!("ontology/kb/{}.ttl", mission.trim_end_matches("_plain")),
            "--format",
            "json",
        ]);
        for design in reason.json()["designs"].as_array().expect("designs") {
            assert_eq!(count(&page, "data-design", design["name"].as_str().expect("a name")), 1, "{mission}");
        }
    }
}

#[test]
fn pages_are_deterministic() {
    for arguments in [&["missions/uuv.toml"][..], &["missions/ugv.toml", "--scenario", "kinect_failure"]] {
        assert_eq!(page(arguments), page(arguments), "{arguments:?}");
    }
}

#[test]
fn plans_before_and_after_are_compared_with_reasons() {
    let page = page(&["missions/ugv.toml", "--fail", "c_kinect", "--set", "robot_at=wp2"]);
    for text in [
        "The status of c_kinect: unknown before, FALSE now.",
        "The task: (robot_at wp1) before, (robot_at wp2) now.",
        "fd_amcl_kinect is not available any more",
        "c_status(c_kinect, &quot;FALSE&quot;) is stated",
        "The plan costs 412 now, 408 before.",
        "Designs of f_localization: fd_amcl_kinect before, fd_amcl_lidar now.",
        "data-plan=\"before\"",
        "data-plan=\"after\"",
    ] {
        assert!(page.contains(text), "{text}");
    }
}

/// The plan of the current situation must not use up the time for the plan before.
#[test]
fn missions_from_standard_input_are_compared() {
    let manifest = std::fs::read_to_string(root().join("missions/ugv.toml")).expect("the manifest");
    let arguments = ["report", "-", "--fail", "c_kinect"];
    let outcome = metaplan_in(&root(), &arguments, &manifest.replace("../", ""));
    assert_eq!(outcome.status, 0, "{}", outcome.stderr);
    assert_eq!(outcome.stdout, page(&["missions/ugv.toml", "--fail", "c_kinect"]));
}

#[test]
fn both_plans_are_shown_at_the_time_limit() {
    let directory = tempfile::tempdir().expect("a directory");
    let write = |name: &str, text: &str| {
        let path = directory.path().join(name);
        std::fs::write(&path, text).expect("written");
        path.to_str().expect("UTF-8").to_owned()
    };
    let domain = "(define (domain d) (:requirements :strips :typing :numeric-fluents) (:types loc pkg trk)
        (:predicates (at ?t - trk ?l - loc) (pat ?p - pkg ?l - loc) (in ?p - pkg ?t - trk))
        (:functions (c) (w ?a ?b - loc))
        (:action drive :parameters (?t - trk ?a ?b - loc) :precondition (at ?t ?a)
          :effect (and (not (at ?t ?a)) (at ?t ?b) (increase (c) (w ?a ?b))))
        (:action load :parameters (?p - pkg ?t - trk ?a - loc) :precondition (and (at ?t ?a) (pat ?p ?a))
          :effect (and (not (pat ?p ?a)) (in ?p ?t) (increase (c) 1)))
        (:action unload :parameters (?p - pkg ?t - trk ?a - loc) :precondition (and (at ?t ?a) (in ?p ?t))
          :effect (and (not (in ?p ?t)) (pat ?p ?a) (increase (c) 1))))";
    let (mut init, mut goal) = ("(= (c) 0) (at t0 l0) (at t1 l5)".to_owned(), String::new());
    for a in 0..12 {
        for b in 0..12 {
            let _ = write!(init, " (= (w l{a} l{b}) {})", 2 + (a * 7 + b * 5 + a * b) % 19);
        }
        let _ = write!(init, " (pat p{a} l{})", a * 5 % 12);
        let _ = write!(goal, " (pat p{a} l{})", (a * 7 + 3) % 12);
    }
    let names =
        |letter: &str| (0..12).map(|number| format!("{letter}{number} ")).collect::<Vec<_>>().concat();
    let objects = format!("{}- loc {}- pkg t0 t1 - trk", names("l"), names("p"));
    let problem = format!(
        "(define (problem p) (:domain d) (:objects {objects}) (:init {init}) (:goal (and {goal}))
         (:metric minimize (c)))"
    );
    let (domain, problem) = (write("d.pddl", domain), write("p.pddl", &problem));
    let outcome = metaplan(&["report", &domain, &problem, "--set", "c=1", "--time-limit", "8"]);
    assert!(outcome.status <= 1, "{}", outcome.stderr);
    for plan in ["data-plan=\"before\"", "data-plan=\"after\""] {
        assert!(outcome.stdout.contains(plan), "{plan}: {}", outcome.stderr);
    }
}

#[test]
fn missing_plan_is_stated_plainly() {
    let outcome = metaplan(&["report", "missions/ugv.toml", "--set", "battery=1"]);
    assert_eq!(outcome.status, 10, "{}", outcome.stderr);
    assert!(outcome.stdout.contains("<p>There is no plan now. The plan before costs 408.</p>"));
    for text in ["nothing: there is none", "0 of 0", "none now"] {
        assert!(!outcome.stdout.contains(text), "{text}");
    }
}

#[test]
fn all_causes_of_an_unavailable_design_are_listed() {
    let sentence =
        "2 causes make the design unavailable; if all of them were removed, it would be available:";
    let kinect = "c_status(c_kinect, &quot;FALSE&quot;) is stated";
    let sun = "hasValue(obs_ambient_light, &quot;0.9&quot;^^decimal) is stated";
    let check = |situation: &[&str], has_kinect: bool, has_sun: bool| {
        let arguments: Vec<&str> = ["missions/ugv.toml"].iter().chain(situation).copied().collect();
        let page = page(&arguments);
        let row = page.split("data-design=\"fd_amcl_kinect\"").nth(1).expect("a design");
        let row = row.split("</tr>").next().unwrap_or_default();
        assert_eq!(row.contains(kinect), has_kinect, "{situation:?}: {row}");
        assert_eq!(row.contains(sun), has_sun, "{situation:?}: {row}");
        assert_eq!(row.contains(sentence), has_kinect && has_sun, "{situation:?}: {row}");
        let changes =
            page.split("id=\"changes\"").nth(1).and_then(|section| section.split("</section>").next());
        assert_eq!(changes.expect("changes").contains(sentence), has_kinect && has_sun, "{situation:?}");
    };
    check(&["--fail", "c_kinect"], true, false);
    check(&["--set", "ambient_light=0.9"], false, true);
    check(&["--fail", "c_kinect", "--set", "ambient_light=0.9"], true, true);
}

fn values(picture: &str) -> Vec<(f64, f64)> {
    let document = Document::parse(picture).expect("XML");
    let points = document.descendants().filter(|node| node.attribute("class") == Some("point"));
    let value = |node: roxmltree::Node<'_, '_>| {
        let text = node.children().find_map(|child| child.text().map(str::to_owned)).expect("a title");
        let (value, at) = text
            .split_once(" = ")
            .and_then(|(_, value_and_time)| value_and_time.split_once(" at "))
            .expect("a value");
        (at.parse().expect("a time"), value.parse().expect("a value"))
    };
    points.map(value).collect()
}

#[test]
fn failed_simulations_are_reported_and_figures_are_rounded() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("page.html").display().to_string();
    let simulated = |mission: &str, scenario: &str, strategies: &[&str]| {
        let mut command =
            vec!["simulate", mission, "--scenario", scenario, "--runs", "3", "--report", &file, "-q"];
        command.extend(strategies.iter().flat_map(|name| ["--strategy", *name]));
        let outcome = metaplan(&command);
        assert_eq!(outcome.status, 0, "{outcome:?}");
        std::fs::read_to_string(&file).expect("a page")
    };
    let failed_page = simulated("missions/ugv.toml", "kinect_at_wp2", &["none"]);
    for text in
        ["None of the 3 missions was accomplished.", ">0 of 3 accomplished<", "<td>none accomplished</td>"]
    {
        assert!(failed_page.contains(text), "{text}");
    }
    let mixed_page = simulated("missions/ugv.toml", "kinect_comes_and_goes", &[]);
    for page in [failed_page, mixed_page] {
        let page = page.split("<main>").nth(1).and_then(|main| main.split("</main>").next()).expect("a page");
        let numbers = page.split(|character: char| !(character.is_ascii_digit() || character == '.'));
        let long_numbers = numbers
            .filter(|character| character.split_once('.').is_some_and(|(_, decimals)| decimals.len() > 2));
        assert_eq!(long_numbers.collect::<Vec<_>>(), [""; 0], "no figure is that exact");
    }
}

#[test]
fn first_uses_of_functions_are_reported() {
    let page = page(&["missions/uuv.toml", "--scenario", "battery_drop"]);
    assert!(page.contains("Designs of f_recharge: none before, fd_recharge now."));
}

#[test]
fn curves_show_the_bounds_of_conditions() {
    let page = page(&["missions/uuv.toml"]);
    assert!(page.contains("data-curve=\"battery\""));
    assert!(page.contains("needs battery &gt;= "), "bounds have a reserve in them");
    assert!(page.contains("data-curve=\"cost\""));
}

#[test]
fn certificates_are_verified_and_shown() {
    let folder = tempfile::tempdir().expect("a folder");
    let certificate = folder.path().join("certificate").display().to_string();
    assert_eq!(metaplan(&["plan", "missions/ugv.toml", "--certificate", &certificate]).status, 0);
    let verified_page = page(&["missions/ugv.toml", "--certificate", &certificate]);
    assert!(
        verified_page.contains(">Verification<")
            && verified_page.contains("verified: the plan is optimal, metric 408")
    );
    let missing = folder.path().join("nope").display().to_string();
    for (scenario, directory) in [("bright_sun", &certificate), ("kinect_failure", &missing)] {
        let outcome =
            metaplan(&["report", "missions/ugv.toml", "--scenario", scenario, "--certificate", directory]);
        assert_eq!(outcome.status, 30, "{directory}: {}", outcome.stderr);
        assert!(outcome.stdout.contains("NOT verified"), "{directory}");
        let verdict = format!("{directory}: NOT verified");
        assert!(outcome.stderr.contains(&verdict), "{}", outcome.stderr);
    }
}

/// The metric does not matter if there is no plan.
#[test]
fn certificates_without_a_plan_are_verified_for_every_objective() {
    let folder = tempfile::tempdir().expect("a folder");
    let domain =
        "(define (domain d) (:requirements :numeric-fluents) (:predicates (at ?p)) (:functions (cost))
      (:action go :parameters (?p) :precondition (at ?p) :effect (increase (cost) 2)))";
    let problem =
        "(define (problem p) (:domain d) (:objects a b) (:init (at a) (= (cost) 0)) (:goal (at b)))";
    std::fs::write(folder.path().join("d.pddl"), domain).expect("a file");
    std::fs::write(folder.path().join("p.pddl"), problem).expect("a file");
    let plan = ["plan", "d.pddl", "p.pddl", "--minimize", "cost", "--certificate", "certificate"];
    assert_eq!(metaplan_in(folder.path(), &plan, "").status, 10);
    let report = ["report", "d.pddl", "p.pddl", "--certificate", "certificate"];
    let outcome = metaplan_in(folder.path(), &report, "");
    assert_eq!(outcome.status, 10, "{}", outcome.stderr);
    assert!(outcome.stdout.contains("verified: there is no plan"), "{}", outcome.stderr);
}

/// If planning takes all the time, the certificate is not checked, so it is not rejected either.
#[cfg(unix)]
#[test]
fn certificates_are_not_rejected_at_the_time_limit() {
    let folder = tempfile::tempdir().expect("a folder");
    let certificate = folder.path().join("certificate").display().to_string();
    assert_eq!(metaplan(&["plan", "missions/ugv.toml", "--certificate", &certificate]).status, 0);
    let (domain, problem) = crate::limits::round_trip(24);
    std::fs::write(folder.path().join("domain.pddl"), domain).expect("a file");
    std::fs::write(folder.path().join("problem.pddl"), problem).expect("a file");
    let arguments =
        ["report", "domain.pddl", "problem.pddl", "--time-limit", "3", "--certificate", "certificate"];
    let outcome = metaplan_in(folder.path(), &arguments, "");
    assert_eq!(outcome.status, 1, "{}", outcome.stderr);
    let verdict = "not checked: interrupted, or a limit on time or memory was reached";
    assert!(outcome.stdout.contains(verdict) && outcome.stderr.contains(verdict), "{}", outcome.stderr);
    assert!(!outcome.stdout.contains(">failed<") && !outcome.stdout.contains("NOT verified"));
}

#[test]
fn hostile_names_are_escaped() {
    let hostile = "</script><script>alert(1)</script>\u{202e}";
    let mission = copy_of_mission("ugv");
    edit(mission.path(), "missions/ugv.toml", "An unmanned ground vehicle", hostile);
    edit(mission.path(), "missions/ugv.toml", "name = \"ugv\"", &format!("name = \"{hostile}\""));
    let files = "files = [\"../ontology/kb/ugv.ttl\"]";
    let with_rules = format!("{files}\nrules = [\"coadaptation\", \"hostile.swrl\"]");
    edit(mission.path(), "missions/ugv.toml", files, &with_rules);
    let rule = format!(
        "@prefix t: <http://metacontrol.org/tomasys#> .\n[{hostile}]\nt:requiresC(?fd, <http://metacontrol.org/metaplan/ugv#c_camera>) \
         -> t:fd_realisability(?fd, false) .\n"
    );
    std::fs::write(mission.path().join("missions/hostile.swrl"), rule).expect("a file");
    let outcome = metaplan_in(mission.path(), &["report", "missions/ugv.toml", "--svg", "pictures"], "");
    assert_eq!(outcome.status, 0, "{outcome:?}");
    assert_eq!(outcome.stdout.matches("<script").count(), 1, "the page's own");
    assert!(outcome.stdout.matches("&lt;/script&gt;&lt;script&gt;alert(1)").count() >= 3);
    assert!(!outcome.stdout.contains('\u{202e}'), "nothing turns the text around");
    for file in std::fs::read_dir(mission.path().join("pictures")).expect("pictures") {
        let text = std::fs::read_to_string(file.expect("a file").path()).expect("text");
        assert!(Document::parse(&text).is_ok() && !text.contains("<script"));
    }
}

#[test]
fn places_are_drawn_at_positions_of_the_manifest() {
    let mission = copy_of_mission("ugv");
    let lines: Vec<String> =
        (0..9).map(|index| format!("wp{},{},{}", index + 1, index % 3, -(index / 3))).collect();
    let heading = "place,x,y\n".to_owned();
    std::fs::write(mission.path().join("missions/places.csv"), heading.clone() + &lines.join("\n"))
        .expect("a file");
    edit(
        mission.path(),
        "missions/ugv.toml",
        "[planning]",
        "[report]\npositions = \"places.csv\"\n\n[planning]",
    );
    let report = || metaplan_in(mission.path(), &["report", "missions/ugv.toml", "--svg", "pictures"], "");
    let outcome = report();
    assert_eq!(outcome.status, 0, "{outcome:?}");
    assert!(!outcome.stdout.contains("the layout of places"));
    let map = std::fs::read_to_string(mission.path().join("pictures/map.svg")).expect("a map");
    let document = Document::parse(&map).expect("XML");
    let place = |name: &str| {
        let group =
            document.descendants().find(|node| node.attribute("data-place") == Some(name)).expect("a place");
        let circle = group.children().find(|node| node.tag_name().name() == "circle").expect("a circle");
        let number = |attribute| {
            circle.attribute(attribute).and_then(|text| text.parse::<f64>().ok()).expect("a number")
        };
        (number("cx"), number("cy"))
    };
    let (wp1, wp3, wp7) = (place("wp1"), place("wp3"), place("wp7"));
    assert!(wp1.0 < wp3.0 && wp1.1 < wp7.1 && (wp1.1 - wp3.1).abs() < 0.2 && (wp1.0 - wp7.0).abs() < 0.2);
    std::fs::write(mission.path().join("missions/places.csv"), heading + "wp1,0\nwp2,0,1\nwp2,1,1\n")
        .expect("a file");
    let outcome = report();
    assert_eq!(outcome.status, 3, "{outcome:?}");
    assert!(outcome.stderr.contains("places.csv:2:1"), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("places.csv:4:1"), "{}", outcome.stderr);
}

#[test]
fn pages_of_thousand_steps_are_fast() {
    let mission = copy_of_mission("ugv");
    let places: Vec<String> = (0..=1000).map(|index| format!("w{index}")).collect();
    let ways = places.windows(2).map(|pair| {
        let [from, to] = [&pair[0], &pair[1]];
        format!("(corridor {from} {to}) (= (travel_time {from} {to}) 1)\n")
    });
    let problem = format!(
        "(define (problem long) (:domain ugv) (:objects {} - waypoint)\n(:init (robot_at w0) (= (battery) 9000) (= (battery_used) 0)\n{})\n\
         (:goal (robot_at w1000)) (:metric minimize (+ (* 100 (total-time)) (battery_used))))",
        places.join(" "),
        ways.collect::<Vec<_>>().concat()
    );
    std::fs::write(mission.path().join("encodings/ugv/problem.pddl"), problem).expect("a file");
    let planning_started = Instant::now();
    let plain = metaplan_in(mission.path(), &["plan", "missions/ugv.toml", "-q"], "");
    let planned = planning_started.elapsed();
    assert_eq!(plain.status, 0, "{}", plain.stderr);
    let report_started = Instant::now();
    let outcome = metaplan_in(mission.path(), &["report", "missions/ugv.toml", "-q"], "");
    assert_eq!(outcome.status, 0, "{}", outcome.stderr);
    assert!(count(&outcome.stdout, "data-step", "1000") >= 2);
    let drawn = report_started.elapsed().saturating_sub(planned);
    // The time limit is for debug builds; release builds take a tenth of the time.
    assert!(drawn.as_secs_f64() < 20.0, "{drawn:?} beside {planned:?} for the plan");
}

#[test]
fn plans_are_drawn_for_papers_and_terminals() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("plan.svg");
    let arguments =
        ["plan", "missions/ugv.toml", "--svg", &file.display().to_string(), "--picture", "always"];
    let outcome = metaplan(&arguments);
    let text = std::fs::read_to_string(file).expect("a picture");
    let document = Document::parse(&text).expect("XML");
    let lanes: Vec<&str> = document.descendants().filter_map(|node| node.attribute("data-lane")).collect();
    assert_eq!(lanes, ["actions", "f_localization"]);
    let expected = "       actions  ▕move wp1 wp2········▕move_with_obstacles…▕move wp5 wp8········▕move wp8 wp9········\n\
                    f_localization  ▕fd_amcl_kinect······▕fd_amcl_kinect······▕fd_amcl_kinect······▕fd_amcl_kinect······\n          \
                    time  0                    1                    2                    3                   4\n";
    assert!(outcome.stdout.starts_with(expected), "{}", outcome.stdout);
    let plain = metaplan(&arguments[..2]);
    assert!(
        outcome.stdout.ends_with(&plain.stdout),
        "the table is the same, and without a terminal there is no more"
    );
}

#[test]
fn plans_are_exported_as_behaviour_trees() {
    let outcome =
        metaplan(&["plan", "missions/ugv.toml", "--scenario", "kinect_failure", "--plan-format", "btcpp"]);
    assert_eq!(outcome.status, 0, "{outcome:?}");
    let document = Document::parse(&outcome.stdout).expect("XML");
    assert_eq!(document.root_element().attribute("BTCPP_format"), Some("4"));
    let sequence = document.descendants().find(|node| node.has_tag_name("Sequence")).expect("a sequence");
    let nodes = sequence.children().filter(roxmltree::Node::is_element);
    let nodes: Vec<String> = nodes
        .map(|node| {
            let attributes =
                node.attributes().filter(|attribute| !["ID", "name"].contains(&attribute.name()));
            let ports: Vec<String> =
                attributes.map(|attribute| format!("{}={}", attribute.name(), attribute.value())).collect();
            format!("{} {}", node.attribute("ID").unwrap_or_default(), ports.join(" "))
        })
        .collect();
    let move_ports = "f=f_localization fd=fd_amcl_lidar";
    assert_eq!(
        nodes,
        [
            "ChangeMode service_name=/f_localization/change_mode mode_name=fd_amcl_lidar".to_owned(),
            format!("move {move_ports} from=wp2 to=wp3"),
            format!("move {move_ports} from=wp3 to=wp6"),
            format!("move_in_the_dark {move_ports} from=wp6 to=wp9"),
        ]
    );
    let model = document.descendants().find(|node| node.has_tag_name("TreeNodesModel")).expect("a model");
    let kinds: Vec<&str> = model.children().filter_map(|node| node.attribute("ID")).collect();
    assert_eq!(kinds, ["ChangeMode", "move", "move_in_the_dark"]);
    let refused = metaplan(&["plan", "missions/ugv.toml", "--plan-format", "btcpp", "--concurrent"]);
    assert_eq!(refused.status, 2, "{refused:?}");
}

#[test]
fn reports_have_no_json_format() {
    let refused = metaplan(&["report", "missions/ugv.toml", "--format", "json"]);
    assert_eq!(refused.status, 2);
    let error: Value = serde_json::from_str(&refused.stdout).expect("JSON");
    assert_eq!(error["messages"][0]["code"], "M107");
}

#[test]
fn overlapping_actions_are_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = "(define (domain two) (:requirements :durative-actions :numeric-fluents) (:predicates (done ?x)) (:functions (left))
        (:durative-action work :parameters (?x) :duration (= ?duration 4) :condition (at start (>= (left) 1))
         :effect (and (at end (done ?x)) (at start (decrease (left) 1)))))";
    let problem = "(define (problem p) (:domain two) (:objects a b) (:init (= (left) 3)) (:goal (and (done a) (done b)))
        (:metric minimize (total-time)))";
    for (name, text) in [("domain.pddl", domain), ("problem.pddl", problem)] {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    let arguments = ["report", "domain.pddl", "problem.pddl", "--concurrent", "--svg", "pictures", "-q"];
    let outcome = metaplan_in(folder.path(), &arguments, "");
    assert_eq!(outcome.status, 0, "{outcome:?}");
    assert!(outcome.stdout.contains("data-curve=\"left\""), "the number that the actions share");
    let timeline = std::fs::read_to_string(folder.path().join("pictures/timeline.svg")).expect("a picture");
    let document = Document::parse(&timeline).expect("XML");
    let rows = document.descendants().filter(|node| node.attribute("class") == Some("action"));
    let rows: Vec<_> = rows.filter_map(|node| Some((node.attribute("x")?, node.attribute("y")?))).collect();
    assert!(matches!(rows[..], [first, second] if first.1 != second.1), "{rows:?}");
    let cost = std::fs::read_to_string(folder.path().join("pictures/number-1.svg")).expect("a picture");
    let cost = values(&cost);
    assert_eq!(cost.first(), Some(&(0.0, 0.0)), "nothing is spent before anything is done: {cost:?}");
    assert!(
        cost.len() > 2 && cost.iter().all(|(at, value)| (at - value).abs() < 1e-6),
        "the metric is the time: {cost:?}"
    );
}

#[test]
fn all_answers_write_their_pictures_to_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    let commands: [(&[&str], &str, &[&str]); 3] = [
        (&["plan", "missions/camara_like.toml", "--pareto", "total_time,total_energy"], "front.svg", &["."]),
        (&["compare", "missions/camara_like.toml", "--battery-unit", "1000"], "compared", &["picture-1.svg"]),
        (
            &["simulate", "missions/ugv.toml", "--scenario", "kinect_comes_and_goes"],
            "simulated",
            &["picture-1.svg", "picture-2.svg", "picture-3.svg"],
        ),
    ];
    for (arguments, name, files) in commands {
        let path = at(name);
        let command: Vec<&str> = arguments.iter().copied().chain(["--svg", &path, "-q"]).collect();
        assert_eq!(metaplan(&command).status, 0, "{arguments:?}");
        for file in files {
            let file = if *file == "." { path.clone() } else { format!("{path}/{file}") };
            let text = std::fs::read_to_string(&file).expect("a picture");
            let document = Document::parse(&text).expect("XML");
            assert!(
                document.descendants().any(|node| node.has_tag_name("circle")),
                "{file}: something is drawn"
            );
            let mut points: Vec<&str> =
                document.descendants().filter_map(|node| node.attribute("data-point")).collect();
            let point_count = points.len();
            points.sort_unstable();
            points.dedup();
            assert_eq!(points.len(), point_count, "{file}: each point has a name of its own");
        }
    }
}

#[test]
fn pictures_of_the_book_are_up_to_date() {
    let folder = tempfile::tempdir().expect("a folder");
    let directory = folder.path().display().to_string();
    let missions = [
        ("ugv", "kinect_failure", [("timeline", "timeline"), ("map", "map")]),
        ("uuv", "murky_water", [("timeline", "timeline"), ("number-2", "battery")]),
    ];
    for (mission, scenario, pictures) in missions {
        page(&[&format!("missions/{mission}.toml"), "--scenario", scenario, "--svg", &directory]);
        for (current, published) in pictures {
            let current =
                std::fs::read_to_string(folder.path().join(format!("{current}.svg"))).expect("a picture");
            let file = format!("docs/pictures/{mission}-{published}.svg");
            let published = std::fs::read_to_string(root().join(&file)).expect("a picture");
            assert!(current == published, "{file} is another picture than `metaplan report --svg` draws");
        }
    }
}
