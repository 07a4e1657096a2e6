//! Pages in a browser: nothing is wrong by its console, everything unfolds, and nothing lies on top of anything else.
#![expect(clippy::print_stdout, reason = "what is skipped says so")]

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};

use crate::common::{metaplan, metaplan_in, root};
use crate::live::Run;

/// Names of a Chromium, in the order of preference.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];
/// A desktop, and a telephone.
const WIDTHS: [u32; 2] = [1280, 400];

/// A mission with two functions and a tank: the robot goes to and fro, and recharges.
const GREENHOUSE: &str = "tests/program/greenhouse/mission.toml";

/// What a page is asked in the browser, from a page around it that is as wide as the screen should be.
const QUESTIONS: &str = include_str!("browser.js");

/// The browser, or why there is none.
pub fn browser() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let found = NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    let found = found.into_iter().find(|program| program.is_file());
    if found.is_none() {
        println!("skipped: there is no Chromium in PATH (on Debian: apt-get install chromium)");
    }
    found
}

/// Opens a page; what is written to the console, and the document afterwards.
fn open(browser: &Path, page: &Path, profile: &Path) -> (Vec<String>, String) {
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

/// The text as the value of an attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('"', "&quot;")
}

/// Opens a page at each width, in frames of one page since the start of a browser takes seconds, and asserts that nothing is wrong with it. Returns
/// what it shows at the last width.
fn check(browser: &Path, name: &str, page: &str) -> Value {
    let folder = tempfile::tempdir().expect("a folder");
    let frames = WIDTHS.map(|width| {
        format!(
            "<iframe style=\"border:0;width:{width}px;height:900px\" srcdoc=\"{}\"></iframe>",
            escaped(page)
        )
    });
    let around = format!(
        "<!DOCTYPE html><html><body style=\"margin:0\">{}<pre id=\"found\"></pre><script>{QUESTIONS}</script></body></html>",
        frames.concat()
    );
    let outer = folder.path().join("around.html");
    std::fs::write(&outer, around).expect("the page is written");
    let (console, document) = open(browser, &outer, folder.path());
    assert!(console.is_empty(), "{name}: {console:#?}");
    let answers = document.rsplit("<pre id=\"found\">").next().and_then(|rest| rest.split("</pre>").next());
    let answers = answers.expect("answers").replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    let mut answers: Vec<Value> =
        serde_json::from_str(&answers).unwrap_or_else(|error| panic!("{name}: {error}: {answers}"));
    assert_eq!(answers.len(), WIDTHS.len(), "{name}");
    for (answer, width) in answers.iter().zip(WIDTHS) {
        assert_eq!(answer["wrong"], Value::Array(Vec::new()), "{name} at {width} pixels");
    }
    answers.pop().expect("an answer")
}

fn page(arguments: &[&str]) -> String {
    let all: Vec<&str> = ["report"].iter().chain(arguments).copied().collect();
    let outcome = metaplan(&all);
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
    for arguments in missions {
        let found = check(&browser, &arguments.join(" "), &page(arguments));
        assert!(found["unfolding"].as_u64() > Some(1), "{arguments:?}: {found}");
        assert!(found["pictures"].as_u64() > Some(1), "{arguments:?}: {found}");
    }
}

/// Ways there and back have the numbers of all their steps, each at its own arrow, as `check` has seen at both widths; the whole of both plans is
/// on one axis.
#[test]
fn ways_to_and_fro_and_the_later_half_of_a_plan_can_be_seen() {
    let Some(browser) = browser() else { return };
    let alone = check(&browser, "to and fro", &page(&[GREENHOUSE]));
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
    let shown = alone["numbers"].as_array().expect("numbers").iter();
    let mut shown: Vec<String> = shown.filter_map(Value::as_str).map(str::to_owned).collect();
    shown.sort();
    expected.sort();
    assert_eq!(shown, expected);
    let pair = check(&browser, "beside each other", &page(&[GREENHOUSE, "--scenario", "gusts"]));
    let axis = pair["axis"].as_array().expect("numbers of the axis");
    let last = axis.last().and_then(Value::as_str).and_then(|text| text.split(' ').next()).expect("a number");
    assert!(last.parse::<f64>().is_ok_and(|last| last > 293.0 * 0.6), "of 293: {pair}");
}

/// Pages of fronts, comparisons, simulations and journals.
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
    for arguments in commands {
        let all: Vec<&str> = arguments.iter().copied().chain(["--report", &file, "-q"]).collect();
        let outcome = metaplan(&all);
        assert_eq!(outcome.status, 0, "{outcome:?}");
        let text = std::fs::read_to_string(&file).expect("a page");
        let found = check(&browser, &arguments.join(" "), &text);
        assert!(found["pictures"].as_u64() > Some(0), "{arguments:?}: {found}");
    }
    let journal = folder.path().join("journal").display().to_string();
    let events = "{\"event\":\"component_status\",\"component\":\"c_kinect\",\"status\":\"FALSE\"}\n{\"event\":\"none\"}\n";
    let outcome = metaplan_in(&root(), &["run", "missions/ugv.toml", "--journal", &journal, "-q"], events);
    assert_eq!(outcome.status, 0, "{outcome:?}");
    let text = page(&["--journal", &journal]);
    for kind in ["events", "inferences", "plans", "effects", "refusals"] {
        assert!(text.contains(&format!("<td>{kind}</td>")), "{kind}");
    }
    let found = check(&browser, "journal", &text);
    assert!(found["unfolding"].as_u64() > Some(1), "{found}");
}

/// A run as it was seen, in one page: its style, its script, and what it gets from the program.
fn seen(run: &Run, lines: &[String], has_ended: bool) -> String {
    let get = |path: &str| run.get(path, "").1;
    let text = |text: String| Value::String(text).to_string().replace('<', "\\u003c");
    let messages = lines.iter().map(|line| text(line.clone())).collect::<Vec<_>>().join(",");
    let stand_in = format!(
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
        &format!("<script>{stand_in}</script><script>{}</script></body>", get("/live.js")),
    )
}

/// The page of a run: the action under way is marked, what is done, too, and all is well on narrow screens.
#[test]
fn the_page_of_a_run_works_in_a_browser() {
    let Some(browser) = browser() else { return };
    let mut run = Run::begin(&["--serve=0"]);
    let mut events = run.events();
    let told = [
        "{\"event\":\"action_started\",\"action\":1}",
        "{\"event\":\"action_succeeded\",\"action\":1}",
        "{\"event\":\"component_status\",\"component\":\"c_kinect\",\"status\":\"FALSE\"}",
        "{\"event\":\"action_cancelled\",\"action\":2}",
        "{\"event\":\"action_started\",\"action\":3}",
        "{\"event\":\"action_succeeded\",\"action\":3}",
        "{\"event\":\"nonsense <b>\"}",
    ];
    run.tell(told.map(str::to_owned), told.len() as u64);
    let is_last = |line: &Value| line["said"]["answer"] == "handled" && line["said"]["line"] == told.len();
    let lines = events.until(is_last);
    // The first says that it begins.
    let lines: Vec<String> = lines.iter().skip(1).map(Value::to_string).collect();
    let page = seen(&run, &lines, false);
    let found = check(&browser, "a run", &page);
    // The plan of after the failure: from wp2 over wp3 and wp6 to wp9, one lane for actions and one for designs.
    assert_eq!(found["pictures"], 5, "timeline, cost, two numbers of the battery, map: {found}");
    assert_eq!(found["done"], 2, "{found}");
    assert_eq!(found["now"], serde_json::json!(["2", "2"]), "{found}");
    assert_eq!(found["status"], "Action 4: move wp3 wp6", "{found}");
    assert!(found["unfolding"].as_u64() > Some(1), "designs that are lost have reasons: {found}");
    run.end();
}

/// The headline says that there is no plan exactly while this is the case: for a client that watches, for a client
/// that connects after most lines were discarded, and at the end.
#[test]
fn a_run_that_has_a_plan_again_says_so() {
    let Some(browser) = browser() else { return };
    let status = |component: &str, status: &str| {
        json!({"event": "component_status", "component": component, "status": status}).to_string()
    };
    let mut run = Run::begin(&["--serve=0"]);
    let mut events = run.events();
    let mut lines: Vec<String> = Vec::new();
    let mut until = |is_last: &dyn Fn(&Value) -> bool| {
        // The first line says that it begins.
        lines.extend(events.until(is_last).iter().filter(|news| *news != &json!({})).map(Value::to_string));
        lines.clone()
    };
    let is = |run: &Run, lines: &[String], has_ended: bool, status: &str, about: &str| {
        let found = check(&browser, status, &seen(run, lines, has_ended));
        assert_eq!((&found["status"], &found["about"]), (&json!(status), &json!(about)), "{found}");
    };
    let started = json!({"event": "action_started", "action": 1}).to_string();
    let lost = ["c_kinect", "c_lidar", "c_camera"].map(|component| status(component, "FALSE"));
    run.tell([started].into_iter().chain(lost), 4);
    let told = until(&|news: &Value| news["said"]["answer"] == "handled" && news["said"]["line"] == 4);
    is(&run, &told, false, "There is no plan", "There is no plan: no plan reaches the goal");
    run.tell([status("c_lidar", "RECOVERED")], 5);
    // A component that recovers is used again when it has been healthy for `heal` seconds.
    let told = until(&|news: &Value| news["said"]["answer"] == "resume_action");
    let (action, cost) = ("Action 1: move wp1 wp2", "Cost 516, proved optimal.");
    is(&run, &told, false, action, cost);
    is(&run, &told, true, &format!("{action} (the run has ended)"), cost);
    let notes = (0..2500).map(|_| json!({"event": "note", "text": "x"}).to_string());
    run.tell(notes, 2505);
    // The first lines have been discarded. A client that connects now receives the current state.
    let mut late: Vec<String> = Vec::new();
    for _ in 0..50 {
        let is_last = |news: &Value| news["said"]["answer"] == "handled" && news["said"]["line"] == 2505;
        let seen = run.events().before_the_end(is_last).unwrap_or_default();
        late = seen.iter().filter(|news| *news != &json!({})).map(Value::to_string).collect();
        if !late.is_empty() && !late.iter().any(|line| line.contains("c_camera") && line.contains("heard")) {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    assert!(late.iter().any(|line| line.contains("plan_none")) && late.len() < 4000, "{} lines", late.len());
    is(&run, &late, false, action, cost);
    run.end();
}

/// What is wrong is found.
#[test]
fn questions_have_answers() {
    let Some(browser) = browser() else { return };
    let good = page(&["missions/ugv.toml"]);
    let paired = page(&["missions/ugv.toml", "--scenario", "kinect_failure"]);
    let around = |page: &str| {
        let page = page.to_owned();
        let browser = browser.clone();
        std::panic::catch_unwind(move || check(&browser, "made wrong", &page)).is_err()
    };
    assert!(!around(&good) && !around(&paired), "nothing is wrong with pages as they are");
    assert!(around(&good.replace(" in-narrow", "")), "no drawing for a telephone");
    assert!(around(&good.replace("max-width: 100%", "min-width: 700px")), "a picture that is cut");
    assert!(
        around(&paired.replacen(
            "</section>",
            "<style>.pair [data-plan=after] .axis { transform: translateX(9px) }</style></section>",
            1
        )),
        "two axes"
    );
    assert!(
        around(&good.replace("<style>", "<style>.leg text { transform: translate(60px, 60px) }")),
        "numbers elsewhere"
    );
    assert!(around(&good.replace("<main>", "<main><script>alert(1)</script>")), "a script that is not ours");
    assert!(
        around(&good.replace("<main>", "<main><p style=\"margin-bottom:-3rem\">on top</p>")),
        "an overlap"
    );
    assert!(
        around(&good.replace("<main>", "<main><p style=\"width:2000px;max-width:none\">wide</p>")),
        "too wide"
    );
    assert!(
        around(&good.replace("<main>", "<main><img src=\"https://example.org/x.png\" alt=\"\">")),
        "the network"
    );
}
