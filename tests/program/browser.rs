//! Tests of HTML pages in a browser: no console messages, all foldable parts open, no overlapping elements.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use test_resources::{Resource, program};

use crate::common::{metaplan, metaplan_in, root};
use crate::live::Run;

const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];
/// Screen widths in pixels: a desktop and a telephone.
const WIDTHS: [u32; 2] = [1280, 400];

/// Mission with two functions and a tank. The robot uses ways repeatedly in both directions, and recharges.
const GREENHOUSE: &str = "tests/program/greenhouse/mission.toml";

/// Script of the page that surrounds the tested pages. It collects the results for the pages in the frames.
const QUESTIONS: &str = include_str!("browser.js");

pub fn browser() -> Option<PathBuf> {
    program(Resource::Browser, &NAMES)
}

/// Opens a page in the browser. Returns the console messages and the final document.
pub fn open(browser: &Path, page: &Path, profile: &Path) -> (Vec<String>, String) {
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"])
        .args([
            "--enable-logging=stderr",
            "--virtual-time-budget=10000",
            "--window-size=1400,1000",
            "--dump-dom",
        ])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("the browser starts");
    let log = String::from_utf8_lossy(&output.stderr);
    let console = log.lines().filter(|line| line.contains("CONSOLE")).map(str::to_owned).collect();
    (console, String::from_utf8_lossy(&output.stdout).into_owned())
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('"', "&quot;")
}

/// Opens pages at each width of [`WIDTHS`]. All are frames of one surrounding page, because the start of a browser takes
/// seconds. Returns the console messages and, for each page, the results for each width.
fn inspect(browser: &Path, pages: &[&str]) -> (Vec<String>, Vec<Vec<Value>>) {
    let folder = tempfile::tempdir().expect("a folder");
    let frames = pages.iter().flat_map(|page| {
        WIDTHS.map(|width| {
            format!(
                "<iframe style=\"border:0;width:{width}px;height:900px\" srcdoc=\"{}\"></iframe>",
                escaped(page)
            )
        })
    });
    let surrounding = format!(
        "<!DOCTYPE html><html><body style=\"margin:0\">{}<pre id=\"found\"></pre><script>{QUESTIONS}</script></body></html>",
        frames.collect::<String>()
    );
    let outer = folder.path().join("around.html");
    std::fs::write(&outer, surrounding).expect("the page is written");
    let (console, document) = open(browser, &outer, folder.path());
    let answers =
        document.rsplit("<pre id=\"found\">").next().and_then(|remainder| remainder.split("</pre>").next());
    let answers = answers.expect("answers").replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    let answers: Vec<Value> =
        serde_json::from_str(&answers).unwrap_or_else(|error| panic!("{error}: {console:#?}: {answers}"));
    assert_eq!(answers.len(), pages.len() * WIDTHS.len());
    (console, answers.chunks(WIDTHS.len()).map(<[Value]>::to_vec).collect())
}

fn faults(results: &[Value]) -> Vec<&Value> {
    results.iter().flat_map(|result| result["wrong"].as_array().expect("a list")).collect()
}

/// Asserts that pages have no errors at any width; `pages` contains names and texts. Returns the results for the last
/// width.
fn check_all(browser: &Path, pages: &[(String, String)]) -> Vec<Value> {
    let texts: Vec<&str> = pages.iter().map(|(_, text)| text.as_str()).collect();
    let (console, mut results) = inspect(browser, &texts);
    let names: Vec<&str> = pages.iter().map(|(name, _)| name.as_str()).collect();
    assert!(console.is_empty(), "{names:?}: {console:#?}");
    for (name, results) in names.iter().zip(&results) {
        assert!(faults(results).is_empty(), "{name} at {WIDTHS:?} pixels: {results:#?}");
    }
    results.iter_mut().map(|results| results.pop().expect("a result")).collect()
}

fn check(browser: &Path, name: &str, page: &str) -> Value {
    check_all(browser, &[(name.to_owned(), page.to_owned())]).pop().expect("a result")
}

fn page(arguments: &[&str]) -> String {
    let command: Vec<&str> = ["report"].iter().chain(arguments).copied().collect();
    let outcome = metaplan(&command);
    assert_eq!(outcome.status, 0, "{outcome:?}");
    outcome.stdout
}

#[test]
fn pages_of_plans_work_in_a_browser() {
    let Some(browser) = browser() else { return };
    let missions: [&[&str]; 7] = [
        &[GREENHOUSE],
        &[GREENHOUSE, "--scenario", "gusts"],
        &["missions/ugv.toml"],
        &["missions/ugv.toml", "--scenario", "kinect_failure"],
        &["missions/ugv_plain.toml", "--scenario", "bright_sun"],
        &["missions/uuv.toml", "--scenario", "murky_water"],
        &["missions/camara_like.toml", "--scenario", "kinect_failure"],
    ];
    let pages = missions.map(|arguments| (arguments.join(" "), page(arguments)));
    for (arguments, results) in missions.iter().zip(check_all(&browser, &pages)) {
        assert!(results["unfolding"].as_u64() > Some(1), "{arguments:?}: {results}");
        assert!(results["pictures"].as_u64() > Some(1), "{arguments:?}: {results}");
    }
}

/// Ways that are used in both directions show the numbers of all their steps, each next to its own arrow;
/// `check_all` tests this at both widths. Two plans are shown on a common time axis.
#[test]
fn ways_in_both_directions_and_late_steps_are_visible() {
    let Some(browser) = browser() else { return };
    let pages = [
        ("to and fro".to_owned(), page(&[GREENHOUSE])),
        ("beside each other".to_owned(), page(&[GREENHOUSE, "--scenario", "gusts"])),
    ];
    let results = check_all(&browser, &pages);
    let [single_page, comparison_page] = &results[..] else { panic!("{results:?}") };
    let steps = metaplan(&["plan", GREENHOUSE, "--format", "json"]).json();
    let steps = steps["steps"].as_array().expect("steps").iter().zip(1..);
    let mut ways: std::collections::BTreeMap<String, Vec<String>> = std::collections::BTreeMap::new();
    for (step, number) in steps.filter(|(step, _)| step["action"] == "go") {
        let way = step["arguments"].as_array().expect("arguments").iter().filter_map(Value::as_str);
        let places = way.filter(|word| !word.starts_with('f')).collect::<Vec<_>>().join(" ");
        ways.entry(places).or_default().push(number.to_string());
    }
    assert!(ways.len() == 8 && ways.values().any(|steps| steps.len() == 3), "{ways:?}");
    let mut expected: Vec<String> = ways.into_values().map(|steps| steps.join(",")).collect();
    let shown_numbers = single_page["numbers"].as_array().expect("numbers").iter();
    let mut shown_numbers: Vec<String> = shown_numbers.filter_map(Value::as_str).map(str::to_owned).collect();
    shown_numbers.sort();
    expected.sort();
    assert_eq!(shown_numbers, expected);
    let axis = comparison_page["axis"].as_array().expect("numbers of the axis");
    let last_number =
        axis.last().and_then(Value::as_str).and_then(|text| text.split(' ').next()).expect("a number");
    assert!(
        last_number.parse::<f64>().is_ok_and(|last_number| last_number > 293.0 * 0.6),
        "of 293: {comparison_page}"
    );
}

#[test]
fn other_pages_work_in_a_browser() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("page.html").display().to_string();
    let commands: [&[&str]; 3] = [
        &["plan", "missions/camara_like.toml", "--pareto", "total_time,total_energy"],
        &["compare", "missions/camara_like.toml", "--battery-unit", "1000"],
        &["simulate", "missions/ugv.toml", "--scenario", "kinect_comes_and_goes", "--runs", "3"],
    ];
    let mut pages = commands
        .map(|arguments| {
            let command: Vec<&str> = arguments.iter().copied().chain(["--report", &file, "-q"]).collect();
            let outcome = metaplan(&command);
            assert_eq!(outcome.status, 0, "{outcome:?}");
            (arguments.join(" "), std::fs::read_to_string(&file).expect("a page"))
        })
        .to_vec();
    let journal = folder.path().join("journal").display().to_string();
    let events = "{\"event\":\"component_status\",\"component\":\"c_kinect\",\"status\":\"FALSE\"}\n{\"event\":\"none\"}\n";
    let outcome = metaplan_in(&root(), &["run", "missions/ugv.toml", "--journal", &journal, "-q"], events);
    assert_eq!(outcome.status, 0, "{outcome:?}");
    let text = page(&["--journal", &journal]);
    for kind in ["events", "inferences", "plans", "effects", "refusals"] {
        assert!(text.contains(&format!("<td>{kind}</td>")), "{kind}");
    }
    pages.push(("journal".to_owned(), text));
    let results = check_all(&browser, &pages);
    let Some((journal, others)) = results.split_last() else { panic!("{results:?}") };
    assert!(journal["unfolding"].as_u64() > Some(1), "{journal}");
    assert!(others.iter().all(|page| page["pictures"].as_u64() > Some(0)), "{others:?}");
}

/// Returns the page of a run as one self-contained file: style and script inline, and the program's responses
/// as constants.
fn self_contained_page(run: &Run, lines: &[String], has_ended: bool) -> String {
    let get = |path: &str| run.get(path, "").1;
    let text = |text: String| Value::String(text).to_string().replace('<', "\\u003c");
    let messages = lines.iter().map(|line| text(line.clone())).collect::<Vec<_>>().join(",");
    let mock_connection = format!(
        "const PLAN = {}, LINES = [{messages}]; self.fetch = async () => ({{ ok: true, text: async () => PLAN }}); \
         self.EventSource = class {{ constructor() {{ this.heard = {{}}; queueMicrotask(() => {{ this.heard.begin({{}}); \
         LINES.forEach(data => this.heard.message({{ data }})); if ({has_ended}) this.heard.end({{}}); }}); }} addEventListener(name, own) {{ this.heard[name] = own; }} close() {{}} }};",
        text(get("/plan"))
    );
    let page = get("/");
    let link = "<link rel=\"stylesheet\" href=\"/live.css\">";
    let script = "<script src=\"/live.js\" defer></script>";
    assert!(page.contains(link) && page.contains(script), "{page}");
    let page = page.replace(link, &format!("<style>{}</style>", get("/live.css"))).replace(script, "");
    page.replace(
        "</body>",
        &format!("<script>{mock_connection}</script><script>{}</script></body>", get("/live.js")),
    )
}

#[test]
fn the_page_of_a_run_works_in_a_browser() {
    let Some(browser) = browser() else { return };
    let mut run = Run::begin(&["--serve=0"]);
    let mut events = run.events();
    let input_lines = [
        "{\"event\":\"action_started\",\"action\":1}",
        "{\"event\":\"action_succeeded\",\"action\":1}",
        "{\"event\":\"component_status\",\"component\":\"c_kinect\",\"status\":\"FALSE\"}",
        "{\"event\":\"action_cancelled\",\"action\":2}",
        "{\"event\":\"action_started\",\"action\":3}",
        "{\"event\":\"action_succeeded\",\"action\":3}",
        "{\"event\":\"nonsense <b>\"}",
    ];
    run.send(input_lines.map(str::to_owned), input_lines.len() as u64);
    let is_last =
        |line: &Value| line["said"]["answer"] == "handled" && line["said"]["line"] == input_lines.len();
    let lines = events.until(is_last);
    // The first message only marks the beginning of the stream.
    let lines: Vec<String> = lines.iter().skip(1).map(Value::to_string).collect();
    let page = self_contained_page(&run, &lines, false);
    let results = check(&browser, "a run", &page);
    // Plan after the failure: from wp2 via wp3 and wp6 to wp9. One lane shows actions, one shows designs.
    assert_eq!(results["pictures"], 5, "timeline, cost, two numbers of the battery, map: {results}");
    assert_eq!(results["done"], 2, "{results}");
    assert_eq!(results["now"], serde_json::json!(["2", "2"]), "{results}");
    assert_eq!(results["status"], "Action 4: move wp3 wp6", "{results}");
    assert!(results["unfolding"].as_u64() > Some(1), "designs that are lost have reasons: {results}");
    run.end();
}

/// The headline reports "no plan" as long as there is no plan, and no longer. This holds for a client from
/// the beginning, for a client that connects after most lines were discarded, and at the end.
#[test]
fn headline_shows_whether_there_is_a_plan() {
    let Some(browser) = browser() else { return };
    let status = |component: &str, status: &str| {
        json!({"event": "component_status", "component": component, "status": status}).to_string()
    };
    let mut run = Run::begin(&["--serve=0"]);
    let mut events = run.events();
    let mut lines: Vec<String> = Vec::new();
    let mut until = |is_last: &dyn Fn(&Value) -> bool| {
        // The first message only marks the beginning of the stream.
        lines.extend(events.until(is_last).iter().filter(|news| *news != &json!({})).map(Value::to_string));
        lines.clone()
    };
    let check_headline = |run: &Run, lines: &[String], has_ended: bool, status: &str, about: &str| {
        let results = check(&browser, status, &self_contained_page(run, lines, has_ended));
        assert_eq!((&results["status"], &results["about"]), (&json!(status), &json!(about)), "{results}");
    };
    let started = json!({"event": "action_started", "action": 1}).to_string();
    let failures = ["c_kinect", "c_lidar", "c_camera"].map(|component| status(component, "FALSE"));
    run.send([started].into_iter().chain(failures), 4);
    let lines_without_plan =
        until(&|news: &Value| news["said"]["answer"] == "handled" && news["said"]["line"] == 4);
    check_headline(
        &run,
        &lines_without_plan,
        false,
        "There is no plan",
        "There is no plan: no plan reaches the goal",
    );
    run.send([status("c_lidar", "RECOVERED")], 5);
    // A component that recovers is used again when it has been healthy for `heal_time` seconds.
    let lines_with_plan = until(&|news: &Value| news["said"]["answer"] == "resume_action");
    let (action, cost) = ("Action 1: move wp1 wp2", "Cost 516, proved optimal.");
    check_headline(&run, &lines_with_plan, false, action, cost);
    check_headline(&run, &lines_with_plan, true, &format!("{action} (the run has ended)"), cost);
    let notes = (0..2500).map(|_| json!({"event": "note", "text": "x"}).to_string());
    run.send(notes, 2505);
    // The first lines have been discarded. A client that connects now receives the current state.
    let mut late_lines: Vec<String> = Vec::new();
    // The server discards old lines asynchronously, so the test waits up to 5 s.
    for _ in 0..50 {
        let is_last = |news: &Value| news["said"]["answer"] == "handled" && news["said"]["line"] == 2505;
        let messages = run.events().until_or_end(is_last).unwrap_or_default();
        late_lines = messages.iter().filter(|news| *news != &json!({})).map(Value::to_string).collect();
        if !late_lines.is_empty()
            && !late_lines.iter().any(|line| line.contains("c_camera") && line.contains("heard"))
        {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    assert!(
        late_lines.iter().any(|line| line.contains("plan_none")) && late_lines.len() < 4000,
        "{} lines",
        late_lines.len()
    );
    check_headline(&run, &late_lines, false, action, cost);
    run.end();
}

#[test]
fn page_errors_are_detected() {
    let Some(browser) = browser() else { return };
    let good = page(&["missions/ugv.toml"]);
    let paired = page(&["missions/ugv.toml", "--scenario", "kinect_failure"]);
    let style = "<style>.pair [data-plan=after] .axis { transform: translateX(9px) }</style></section>";
    let overlap = "<main><p style=\"margin-bottom:-3rem\">on top</p>";
    let wide = "<main><p style=\"width:2000px;max-width:none\">wide</p>";
    let damaged = [
        ("no drawing for a telephone", good.replace(" in-narrow", "")),
        ("a picture that is cut", good.replace("max-width: 100%", "min-width: 700px")),
        ("two axes", paired.replacen("</section>", style, 1)),
        (
            "numbers elsewhere",
            good.replace("<style>", "<style>.leg text { transform: translate(60px, 60px) }"),
        ),
        ("an overlap", good.replace("<main>", overlap)),
        ("too wide", good.replace("<main>", wide)),
    ];
    let pages: Vec<&str> = [&good, &paired]
        .into_iter()
        .chain(damaged.iter().map(|(_, page)| page))
        .map(String::as_str)
        .collect();
    let (_, results) = inspect(&browser, &pages);
    assert!(results[..2].iter().all(|results| faults(results).is_empty()), "pages as they are: {results:#?}");
    for ((fault, _), results) in damaged.iter().zip(&results[2..]) {
        assert!(!faults(results).is_empty(), "{fault}");
    }
    let forbidden = [
        ("a script that is not ours", "<script>alert(1)</script>"),
        ("the network", "<img src=\"https://example.org/x.png\" alt=\"\">"),
    ];
    for (fault, element) in forbidden {
        let (console, _) = inspect(&browser, &[&good.replace("<main>", &format!("<main>{element}"))]);
        assert!(!console.is_empty(), "{fault}");
    }
}
