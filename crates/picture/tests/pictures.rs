//! Pictures contain their data, escape names, and are identical for identical data.

use metaplan_picture::{
    Axis, Bound, Change, Checked, Curve, Design, Group, Happening, Kind, Log, Map, Part, Place, Plan, Points,
    Progress, Reason, Report, Rows, Sheet, Step,
};
use roxmltree::Document;

const HOSTILE: &str = "</title></text><script>alert(1)</script>\"'&\u{1}\u{202e}";

fn plan(steps: usize, name: &str) -> Plan {
    let count = steps.max(3);
    let step = |index: usize| Step {
        label: format!("{name}move p{index}"),
        start: index as f64,
        end: index as f64 + 1.0,
        start_text: index.to_string(),
        duration_text: "1".to_owned(),
        cost_text: "2".to_owned(),
        configuration: vec![
            (format!("{name}f_1"), format!("{name}fd_{}", index / 3 % 4)),
            (format!("{name}f_2"), format!("{name}fd_x")),
        ],
        reconfigured: if index > 0 && index.is_multiple_of(3) {
            vec![(format!("{name}f_1"), format!("{name}fd_old"))]
        } else {
            Vec::new()
        },
        way: Some((index % count, (index + 1) % count)),
    };
    let place = |index: usize| Place {
        name: format!("{name}p{index}"),
        position: None,
        is_start: index == 0,
        is_goal: index == 1,
    };
    let reason = Reason {
        text: name.to_owned() + "why",
        supports: vec![Reason { text: name.to_owned(), supports: Vec::new() }],
    };
    Plan {
        verdict: format!("{name}Cost 8: optimal."),
        steps: (0..steps).map(step).collect(),
        axis: Axis::Time,
        curves: vec![Curve {
            name: format!("{name}battery"),
            points: (0..=steps).map(|index| (index as f64, 100.0 - index as f64)).collect(),
            bounds: vec![Bound { from: 0.0, to: 1.0, value: 2.0, text: format!("{name}needs") }],
        }],
        map: Some(Map {
            places: (0..count).map(place).collect(),
            ways: (0..count).map(|index| (index, (index + 1) % count)).collect(),
        }),
        search: vec![
            Progress { cost: None, lower_bound: 1.0, text: name.to_owned() },
            Progress { cost: Some(8.0), lower_bound: 8.0, text: name.to_owned() },
        ],
        designs: vec![Design {
            name: format!("{name}fd_x"),
            functions: vec![name.to_owned()],
            available: false,
            estimations: vec![name.to_owned()],
            needs: vec![name.to_owned()],
            steps: vec![1],
            because: vec![reason],
        }],
    }
}

fn report(steps: usize, name: &str) -> Report {
    Report {
        name: name.to_owned() + "mission",
        description: name.to_owned(),
        situation: vec![name.to_owned()],
        before: Some(plan(2, name)),
        plan: plan(steps, name),
        changes: vec![Change { text: name.to_owned(), because: vec![Reason::default()] }],
        checked: Some(Checked {
            verified: true,
            stopped: false,
            verdict: name.to_owned(),
            parts: vec![(name.to_owned(), true, name.to_owned())],
        }),
    }
}

fn values<'a>(document: &'a Document<'_>, attribute: &str) -> Vec<&'a str> {
    document.descendants().filter_map(|node| node.attribute(attribute)).collect()
}

#[test]
fn lanes_places_and_designs_are_in_the_pictures() {
    let report = report(10, "");
    let pictures = report.pictures();
    let find = |name: &str| &pictures.iter().find(|(file, _)| file == name).expect(name).1;
    let timeline = Document::parse(find("timeline.svg")).expect("XML");
    assert_eq!(values(&timeline, "data-lane"), ["actions", "f_1", "f_2"]);
    assert_eq!(values(&timeline, "data-mark"), ["4", "7", "10"]);
    let bars = timeline.descendants().filter(|node| node.attribute("class") == Some("bar")).count();
    assert_eq!(bars, 30);
    let map = Document::parse(find("map.svg")).expect("XML");
    let places: Vec<String> = (0..10).map(|index| format!("p{index}")).collect();
    assert_eq!(values(&map, "data-place"), places);
    assert_eq!(values(&map, "data-way").len(), 10);
    for (name, text) in &pictures {
        assert!(!text.contains("<script"), "{name}");
        assert!(text.contains("<text"), "{name}: texts are texts");
    }
    let names: Vec<&str> = pictures.iter().map(|(name, _)| name.as_str()).collect();
    let parts = ["timeline.svg", "number-1.svg", "map.svg", "search.svg"];
    let expected: Vec<String> = parts
        .iter()
        .map(|name| (*name).to_owned())
        .chain(parts.iter().map(|name| format!("before-{name}")))
        .collect();
    assert_eq!(names, expected);
    let page = report.html();
    for text in [
        "data-lane=\"f_2\"",
        "data-mark=\"10\"",
        "data-place=\"p9\"",
        "data-design=\"fd_x\"",
        "data-curve=\"battery\"",
    ] {
        assert!(page.contains(text), "{text}");
    }
}

#[test]
fn names_are_escaped_whatever_they_are() {
    let report = report(4, HOSTILE);
    for (name, text) in report.pictures() {
        let document = Document::parse(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(document.descendants().all(|node| node.tag_name().name() != "script"), "{name}");
    }
    let page = report.html();
    assert_eq!(page.matches("<script").count(), 1, "the page's own");
    assert_eq!(page.matches("</script").count(), 1);
    assert!(!page.contains('\u{1}'));
    assert!(page.contains("&lt;script&gt;alert(1)"));
}

#[test]
fn the_same_data_give_the_same_bytes() {
    let (one, other) = (report(30, ""), report(30, ""));
    assert_eq!(one.html(), other.html());
    assert_eq!(one.pictures(), other.pictures());
}

#[test]
fn pages_grow_with_the_number_of_steps() {
    let size = |steps: usize| report(steps, "").html().len();
    assert!(report(1000, "").html().contains("data-step=\"1000\""));
    // Unlike a time, the size of the page does not depend on the machine.
    assert!(size(1000) < 3 * size(500), "{} and {} bytes", size(1000), size(500));
}

#[test]
fn overlapping_actions_do_not_cover_each_other() {
    let mut plan = plan(3, "");
    for step in &mut plan.steps {
        (step.start, step.end) = (0.0, 3.0);
    }
    let text = plan.svg();
    let document = Document::parse(&text).expect("XML");
    let bars = document.descendants().filter(|node| node.attribute("class") == Some("bar"));
    let places = bars.filter_map(|bar| {
        let shape = bar.children().find(|node| node.has_tag_name(("http://www.w3.org/2000/svg", "rect")))?;
        Some((shape.attribute("x")?, shape.attribute("y")?))
    });
    let mut places: Vec<_> = places.collect();
    places.sort_unstable();
    let count = places.len();
    places.dedup();
    assert_eq!((places.len(), count), (9, 9));
    assert_eq!(plan.text(100), None, "lines cannot show that");
}

#[test]
fn a_terminal_shows_the_lanes() {
    let mut plan = plan(4, "");
    plan.steps.iter_mut().for_each(|step| step.configuration.truncate(1));
    let expected = "\
actions  ▕move p0············▕move p1············▕move p2···········▕move p3············
    f_1  ▕fd_0···············▕fd_0···············▕fd_0··············◆fd_1···············
   time  0                   1                   2                  3                  4
";
    assert_eq!(plan.text(88).as_deref(), Some(expected));
    assert_eq!(plan.text(59), None);
    assert_eq!(Plan::default().text(100), None);
}

#[test]
fn terminals_of_60_to_139_columns_hold_the_picture() {
    let mut night = plan(16, "");
    let mut now = 0.0;
    for (step, index) in night.steps.iter_mut().zip(0..) {
        step.start = now;
        now += if index == 6 { 90.0 } else { 4.5 };
        step.end = now;
    }
    for columns in 60..140 {
        let text = night.text(columns).expect("a picture");
        let widest = text.lines().map(|line| line.chars().count()).max();
        assert!(widest <= Some(columns), "{columns}:\n{text}");
        for index in 0..16 {
            assert!(text.contains("move"), "{text}");
            let start = &night.steps[index].start.to_string();
            assert!(text.split_whitespace().any(|word| word == start), "{columns}: {start}:\n{text}");
        }
        assert_eq!(text.matches('◆').count(), 5, "{text}");
    }
    assert_eq!(plan(200, "").text(80), None, "more than an overview");
}

#[test]
fn bands_are_not_wider_than_the_terminal() {
    for steps in 1..60 {
        for columns in 60..100 {
            let Some(text) = plan(steps, "").text(columns) else { continue };
            let widest = text.lines().map(|line| line.chars().count()).max();
            assert!(widest <= Some(columns), "{steps} steps, {columns} columns:\n{text}");
        }
    }
}

/// Returns the drawings that a column of this width shows: name, width, and whether the drawing is
/// scrolled.
fn shown(page: &str, column: f64) -> Vec<(String, f64, bool)> {
    let class = match column {
        wide if wide >= 1146.0 => "in-wide",
        half if half >= 560.0 => "in-half",
        _ => "in-narrow",
    };
    let attribute = |tag: &str, name: &str| {
        let value = tag.split(&format!("{name}=\"")).nth(1).and_then(|rest| rest.split('"').next());
        value.unwrap_or_default().to_owned()
    };
    let tags = page.split("<svg ").skip(1).map(|rest| rest.split('>').next().unwrap_or_default());
    let shown = tags.filter(|tag| attribute(tag, "class").split(' ').any(|own| own == class));
    let drawing = |tag: &str| {
        let width = attribute(tag, "width").parse().expect("a width");
        (attribute(tag, "aria-labelledby"), width, attribute(tag, "class").contains("long"))
    };
    shown.map(drawing).collect()
}

#[test]
fn pictures_fit_their_column() {
    let alone = Report { before: None, ..report(20, "") };
    for (page, columns, pictures) in [
        (report(20, "").html(), &[592.0, 560.0, 368.0, 328.0][..], 8),
        (alone.html(), &[1216.0, 1146.0, 800.0, 560.0, 368.0, 328.0], 4),
        (sheet("x").html(), &[1216.0, 800.0, 368.0], 6),
        (log(50, "").html(), &[1216.0, 800.0, 368.0], 1),
    ] {
        for column in columns {
            let drawn = shown(&page, *column);
            assert_eq!(drawn.len(), pictures, "{column}: {drawn:?}");
            for (name, width, is_long) in drawn {
                assert!(width <= *column && !is_long, "{column}: {name} is {width} wide");
            }
        }
    }
}

#[test]
fn long_plans_are_scrolled() {
    let page = Report { before: None, ..report(1000, "") }.html();
    for column in [1216.0, 800.0, 368.0] {
        let drawn = shown(&page, column);
        let timeline = drawn.iter().find(|(name, ..)| name.contains("timeline")).expect("a timeline");
        assert!(timeline.1 > 4000.0 && timeline.2, "{column}: {timeline:?}");
    }
    assert_eq!(page.matches("-timeline-1-title").count(), 2, "an id, and who refers to it");
    assert_eq!(page.matches("-timeline-2-title").count(), 0);
}

#[test]
fn before_and_after_share_one_axis() {
    let mut report = report(14, "");
    for (step, index) in report.plan.steps.iter_mut().zip(0..) {
        (step.start, step.end) = (f64::from(index) * 60.0, f64::from(index + 1) * 60.0);
    }
    let page = report.html();
    let ticks = |plan: &str| -> Vec<Vec<(String, String)>> {
        let section = page.split(&format!("data-plan=\"{plan}\"")).nth(1).expect("a plan");
        let section = section.split("</section>").next().unwrap_or_default();
        let pictures = section.split("<svg ").skip(1);
        let pictures = pictures.filter(|text| {
            let tag = text.split('>').next().unwrap_or_default();
            tag.contains("in-half") && (tag.contains("timeline") || tag.contains("number"))
        });
        let axis = |text: &str| -> Vec<(String, String)> {
            let document = format!("<svg {}</svg>", text.split("</svg>").next().unwrap_or_default());
            let document = Document::parse(&document).expect("XML");
            let texts = document.descendants().filter(|node| node.attribute("text-anchor") == Some("middle"));
            texts
                .map(|node| {
                    (
                        node.text().unwrap_or_default().to_owned(),
                        node.attribute("x").unwrap_or_default().to_owned(),
                    )
                })
                .collect()
        };
        pictures.map(axis).collect()
    };
    let (before, after) = (ticks("before"), ticks("after"));
    assert_eq!(before.len(), 2, "a timeline and a number");
    assert_eq!(before, after, "the same numbers at the same places");
    // The fluent falls to 98 in one plan and to 86 in the other; both curves are drawn on their
    // common range.
    let values = |plan: &str| -> Vec<String> {
        let section = page.split(&format!("data-plan=\"{plan}\"")).nth(1).expect("a plan");
        let picture = section.split("number-1-1-title").nth(2).and_then(|rest| rest.split("</svg>").next());
        let ends = picture.expect("a picture").split("text-anchor=\"end\">").skip(1);
        let texts = ends.filter_map(|rest| rest.split('<').next());
        texts.filter(|text| text.parse::<f64>().is_ok()).map(str::to_owned).collect()
    };
    assert!(values("before").len() > 2, "{:?}", values("before"));
    assert_eq!(values("before"), values("after"), "one scale upwards");
    assert!(before[0] == before[1], "one axis for timeline and numbers");
    let last = after[0].last().expect("ticks");
    assert_eq!(last.0, "800", "of 840");
    assert!(last.1.parse::<f64>().is_ok_and(|x| x < 560.0), "{last:?}");
}

#[test]
fn designs_of_one_function_in_one_step_share_a_bar() {
    let mut plan = plan(3, "");
    plan.steps[1].configuration.push(("f_1".to_owned(), "fd_9".to_owned()));
    let text = plan.text(150).expect("a picture");
    assert!(text.lines().any(|line| line.contains("f_1") && line.contains("fd_0, fd_9")), "{text}");
    let end = text.lines().next().map(|line| line.chars().count());
    assert!(text.lines().take(3).all(|line| Some(line.chars().count()) == end), "{text}");
}

/// The end of a step is the sum of two doubles, and may be greater than the start of the next step.
#[test]
fn rounding_errors_of_times_do_not_make_bars_overlap() {
    let mut plan = plan(2, "");
    (plan.steps[0].start, plan.steps[0].end) = (0.0, 3.0 + 4e-16);
    (plan.steps[1].start, plan.steps[1].end) = (3.0 - 4e-16, 6.0);
    for columns in 60..200 {
        let text = plan.text(columns).expect("a picture");
        let length = text.lines().next().map(|line| line.chars().count());
        assert_eq!(length, Some(columns), "{text}");
    }
}

#[test]
fn bars_have_their_name_or_step_number_or_no_text() {
    let mut plan = plan(30, "");
    plan.steps[29].end = 300.0;
    let text = plan.svg();
    let document = Document::parse(&text).expect("XML");
    let lane = document.descendants().find(|node| node.attribute("data-lane") == Some("actions"));
    let bars = lane.expect("a lane").children().filter(|node| node.attribute("class") == Some("bar"));
    let texts = bars.map(|bar| {
        let step = bar.attribute("data-step").unwrap_or_default().to_owned();
        (
            step,
            bar.children()
                .find(|child| child.tag_name().name() == "text")
                .and_then(|text| text.text().map(str::to_owned)),
        )
    });
    for (step, text) in texts {
        let is_known = text.as_ref().is_none_or(|text| *text == step || text.starts_with("move"));
        assert!(is_known, "{step}: {text:?}");
    }
    let narrow = Report { before: None, plan: plan.clone(), ..Report::default() }.html();
    // Only the drawing counts: the table of the page names all steps.
    let is_narrow = |part: &&str| part.split('>').next().is_some_and(|tag| tag.contains("in-narrow"));
    let drawing = narrow.split("<svg").filter(is_narrow).find(|part| part.contains("data-lane=\"actions\""));
    let mut lanes = drawing.expect("a timeline").split("data-lane=\"");
    let actions = lanes.find(|lane| lane.starts_with("actions\"")).expect("a lane");
    assert!(actions.contains(">30<") || actions.contains("move p29"), "the long one is named: {actions}");
}

/// A plot without values has no numbers on its axis.
#[test]
fn nothing_is_said_in_words() {
    let group = |values: Vec<(f64, String)>| Group {
        name: "greedy".to_owned(),
        values,
        mean: None,
        nothing: "none of its 20 missions was accomplished".to_owned(),
    };
    let page = |groups: Vec<Group>| {
        let rows = Rows { title: "cost".to_owned(), axis: "cost".to_owned(), groups };
        Sheet { parts: vec![Part::Rows(rows)], ..Sheet::default() }
    };
    let empty = page(vec![group(Vec::new())]);
    let picture = &empty.pictures()[0].1;
    assert!(picture.contains(">none of its 20 missions was accomplished<"), "{picture}");
    assert!(!picture.contains("text-anchor=\"middle\""), "no numbers: {picture}");
    let some = page(vec![group(Vec::new()), group(vec![(1.0, String::new())])]);
    assert_eq!(some.pictures()[0].1.matches("none of its 20").count(), 1);
}

fn log(events: u64, name: &str) -> Log {
    let happening = |record: u64| Happening {
        record,
        time: record as f64 / 10.0,
        kind: if record.is_multiple_of(10) { Kind::ALL[(record / 10 % 4 + 1) as usize] } else { Kind::Event },
        text: format!("{name}{record}"),
        because: if record.is_multiple_of(10) {
            vec![Reason { text: name.to_owned(), supports: Vec::new() }]
        } else {
            Vec::new()
        },
    };
    Log {
        name: name.to_owned(),
        verdict: name.to_owned(),
        parts: vec![name.to_owned()],
        messages: vec![name.to_owned()],
        happenings: (0..events).map(happening).collect(),
    }
}

#[test]
fn a_long_journal_is_a_page_that_opens() {
    let log = log(100_000, "event ");
    let page = log.html();
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
    assert_eq!(page.matches("data-record=").count(), 1000);
    let picture = log.svg();
    let document = Document::parse(&picture).expect("XML");
    let counts = values(&document, "data-count");
    let all: u64 = counts.iter().map(|count| count.parse::<u64>().expect("a number")).sum();
    assert_eq!(all, 100_000, "each happening is in a mark");
    assert_eq!(values(&document, "data-lane"), ["events", "inferences", "plans", "effects", "refusals"]);
}

fn sheet(name: &str) -> Sheet {
    let points = Points {
        title: name.to_owned(),
        axes: [name.to_owned(), name.to_owned()],
        line: vec![(1.0, 2.0), (2.0, 1.0)],
        points: (1..4).map(|own| (format!("{name}{own}"), name.to_owned(), f64::from(own), 2.0)).collect(),
    };
    let group = Group {
        name: format!("{name}group"),
        values: vec![(1.0, name.to_owned()); 40],
        mean: Some((1.0, 0.5)),
        nothing: String::new(),
    };
    Sheet {
        name: name.to_owned(),
        description: name.to_owned(),
        verdict: name.to_owned(),
        parts: vec![
            Part::Heading(name.to_owned()),
            Part::Sentences(vec![Change { text: name.to_owned(), because: vec![Reason::default()] }]),
            Part::Points(points),
            Part::Rows(Rows { title: name.to_owned(), axis: name.to_owned(), groups: vec![group] }),
            Part::Table(name.to_owned(), vec![name.to_owned()], vec![vec![name.to_owned()]]),
            Part::Plans(vec![(name.to_owned(), plan(3, name))]),
        ],
    }
}

#[test]
fn all_pages_escape_names() {
    for page in [log(30, HOSTILE).html(), sheet(HOSTILE).html()] {
        assert_eq!(page.matches("<script").count(), 1, "the page's own");
        assert!(page.contains("&lt;script&gt;alert(1)") && !page.contains('\u{1}'));
    }
    let pictures = sheet(HOSTILE).pictures().into_iter().map(|(_, text)| text);
    for picture in pictures.chain([log(30, HOSTILE).svg()]) {
        let document = Document::parse(&picture).expect("XML");
        assert!(document.descendants().all(|node| node.tag_name().name() != "script"));
    }
}

#[test]
fn fronts_and_distributions_have_all_values() {
    let sheet = sheet("x");
    let pictures = sheet.pictures();
    let [(_, points), (_, rows)] = &pictures[..] else { panic!("{}", pictures.len()) };
    let document = Document::parse(points).expect("XML");
    assert_eq!(values(&document, "data-point"), ["x1", "x2", "x3"]);
    let document = Document::parse(rows).expect("XML");
    assert_eq!(values(&document, "data-group"), ["xgroup"]);
    assert_eq!(values(&document, "class").iter().filter(|class| **class == "point").count(), 40);
    assert_eq!(sheet.html().matches("data-plan=").count(), 1);
}
