//! Maps: each step number is nearer to the arrow of its own move than to every other arrow, for
//! various maps and plans.

use metaplan_picture::{Map, Place, Plan, Report, Step};
use roxmltree::{Document, Node};

type Point = (f64, f64);

/// Width of a character and height of a line in the pictures' font.
const CHARACTER: (f64, f64) = (6.75, 13.0);

struct Leg {
    from: String,
    to: String,
    steps: Vec<usize>,
    /// Centre and tip.
    arrow: [Point; 2],
    /// Centre of the step numbers, and their text.
    label: Option<(Point, String)>,
}

fn plan(positions: &[Option<Point>], moves: &[(usize, usize)], designs: &[&str]) -> Plan {
    let place = |(index, position): (usize, &Option<Point>)| Place {
        name: format!("place_{index}"),
        position: *position,
        is_start: index == 0,
        is_goal: index == 1,
    };
    let step = |(index, way): (usize, &(usize, usize))| Step {
        label: format!("go {} {}", way.0, way.1),
        start: index as f64,
        end: index as f64 + 1.0,
        configuration: vec![("f".to_owned(), designs[index % designs.len()].to_owned())],
        way: Some(*way),
        ..Step::default()
    };
    let mut ways: Vec<(usize, usize)> =
        moves.iter().filter(|(a, b)| a != b).map(|(a, b)| (*a.min(b), *a.max(b))).collect();
    ways.sort_unstable();
    ways.dedup();
    Plan {
        steps: moves.iter().enumerate().map(step).collect(),
        map: Some(Map { places: positions.iter().enumerate().map(place).collect(), ways }),
        ..Plan::default()
    }
}

fn numbers(text: &str) -> Vec<f64> {
    let parts = text.split(|character: char| !(character.is_ascii_digit() || ".-".contains(character)));
    parts.filter(|part| !part.is_empty()).map(|part| part.parse().expect("a number")).collect()
}

fn legs(picture: Node<'_, '_>) -> Vec<Leg> {
    let is_leg = |node: &Node<'_, '_>| node.attribute("data-from").is_some();
    let leg = |node: Node<'_, '_>| {
        let child = |name: &str| node.children().find(|child| child.tag_name().name() == name);
        let corners = numbers(child("path").and_then(|path| path.attribute("d")).expect("an arrow"));
        let [x1, y1, x2, y2, x3, y3] = corners[..] else { panic!("{corners:?}") };
        let label = child("text").map(|text| {
            let at =
                |name| text.attribute(name).and_then(|value| value.parse::<f64>().ok()).expect("a number");
            let shown = text.text().unwrap_or_default().to_owned();
            let wide = shown.chars().count() as f64 * CHARACTER.0;
            ((at("x") + wide / 2.0, at("y") - 4.0), shown)
        });
        let steps = node.attribute("data-step").expect("steps").split(' ');
        Leg {
            from: node.attribute("data-from").expect("a place").to_owned(),
            to: node.attribute("data-to").expect("a place").to_owned(),
            steps: steps.map(|step| step.parse().expect("a number")).collect(),
            arrow: [((x1 + x2 + x3) / 3.0, (y1 + y2 + y3) / 3.0), (x1, y1)],
            label,
        }
    };
    picture.descendants().filter(is_leg).map(leg).collect()
}

fn distance(one: Point, other: Point) -> f64 {
    (one.0 - other.0).hypot(one.1 - other.1)
}

/// Checks a drawn map. Each move must be in the leg of its direction, and the arrow must point in
/// this direction. Step numbers must be nearer to the arrow of their leg than to every other arrow,
/// and must not overlap. Returns the number of legs without step numbers.
fn check(name: &str, picture: Node<'_, '_>, moves: &[(usize, usize)]) -> usize {
    let legs = legs(picture);
    let at = |name: &str| {
        let place = picture.descendants().find(|node| node.attribute("data-place") == Some(name));
        let circle =
            place.and_then(|place| place.children().find(|child| child.tag_name().name() == "circle"));
        let circle = circle.expect("a place");
        ["cx", "cy"]
            .map(|own| circle.attribute(own).and_then(|text| text.parse::<f64>().ok()).expect("a number"))
    };
    for (number, (from, to)) in (1..).zip(moves) {
        let own = legs.iter().filter(|leg| leg.steps.contains(&number)).collect::<Vec<_>>();
        let [leg] = own[..] else { panic!("{name}: step {number} is in {} legs", own.len()) };
        assert_eq!(
            (&leg.from, &leg.to),
            (&format!("place_{from}"), &format!("place_{to}")),
            "{name}: {number}"
        );
    }
    for leg in &legs {
        let ([x1, y1], [x2, y2]) = (at(&leg.from), at(&leg.to));
        let [middle, tip] = leg.arrow;
        let forward = (tip.0 - middle.0) * (x2 - x1) + (tip.1 - middle.1) * (y2 - y1);
        assert!(leg.from == leg.to || forward > 0.0, "{name}: the arrow of {:?} points back", leg.steps);
        let Some((label, text)) = &leg.label else { continue };
        let first: Vec<String> = leg.steps.iter().take(3).map(ToString::to_string).collect();
        assert!(text.starts_with(&first.join(",")), "{name}: {text} for {:?}", leg.steps);
        let own = distance(*label, middle);
        for other in legs.iter().filter(|other| !std::ptr::eq(*other, leg)) {
            let far = distance(*label, other.arrow[0]);
            assert!(own < far, "{name}: {text} is nearer to the arrow of {:?}: {own} {far}", other.steps);
        }
    }
    let labels: Vec<&(Point, String)> = legs.iter().filter_map(|leg| leg.label.as_ref()).collect();
    for (index, (one, text)) in labels.iter().enumerate() {
        for (other, more) in &labels[..index] {
            let wide = (text.chars().count() + more.chars().count()) as f64 * CHARACTER.0 / 2.0;
            let apart = (one.0 - other.0).abs() >= wide || (one.1 - other.1).abs() >= CHARACTER.1;
            assert!(apart, "{name}: {text} and {more} lie on top of each other");
        }
    }
    legs.iter().filter(|leg| leg.label.is_none()).count()
}

fn drawings(plan: &Plan) -> Vec<(String, String)> {
    let report = Report { plan: plan.clone(), before: Some(plan.clone()), ..Report::default() };
    let file = report.pictures().into_iter().find(|(name, _)| name == "map.svg").expect("a map").1;
    let page = report.html() + &Report { plan: plan.clone(), ..Report::default() }.html();
    let mut all = vec![("map.svg".to_owned(), file)];
    for part in page.split("<svg ").skip(1) {
        let text = format!("<svg {}", part.split("</svg>").next().unwrap_or_default()) + "</svg>";
        if text.contains("data-place") {
            let name = text.split("aria-labelledby=\"").nth(1).and_then(|rest| rest.split('-').next());
            all.push((format!("{} {}", name.unwrap_or_default(), all.len()), text));
        }
    }
    assert_eq!(all.len(), 1 + 2 + 2 + 3, "a drawing for each width of a column");
    all
}

fn check_all(name: &str, positions: &[Option<Point>], moves: &[(usize, usize)], designs: &[&str]) {
    for (drawing, text) in drawings(&plan(positions, moves, designs)) {
        let document = Document::parse(&text).expect("XML");
        let missing = check(&format!("{name}, {drawing}"), document.root(), moves);
        assert_eq!(missing, 0, "{name}, {drawing}: each leg has its numbers");
    }
}

fn known(positions: &[Point]) -> Vec<Option<Point>> {
    positions.iter().copied().map(Some).collect()
}

#[test]
fn numbers_stand_at_the_arrow_of_their_direction() {
    let cross = known(&[(0.0, 0.0), (10.0, 0.0), (10.0, 20.0), (25.0, 0.0), (10.0, -12.0), (33.0, 0.0)]);
    let unknown = vec![None; 6];
    let moves = [(0, 1), (1, 3), (3, 5), (5, 3), (3, 1), (1, 0), (0, 1), (1, 4), (4, 1), (1, 2), (2, 1)];
    check_all("to and fro", &cross, &moves, &["fd_a"]);
    check_all("places without positions", &unknown, &moves, &["fd_a"]);
    check_all("several configurations", &cross, &moves, &["fd_a", "fd_b", "fd_c"]);
    let star = known(&[(0.0, 0.0), (4.0, 0.0), (8.0, 3.0), (8.0, -3.0), (12.0, 0.0)]);
    let bed = |bed: usize| [(0, 1), (1, bed), (bed, 1), (1, 0)];
    check_all("a star", &star, &[bed(2), bed(3), bed(4)].concat(), &["fd_a"]);
    // A short way and a long way, in various directions.
    for turn in 0..16 {
        let (sin, cos) = (f64::from(turn) * std::f64::consts::PI / 8.0).sin_cos();
        let turned = |(x, y): Point| (x * cos - y * sin, x * sin + y * cos);
        let places = known(&[turned((0.0, 0.0)), turned((3.0, 0.0)), turned((30.0, 0.0))]);
        check_all(&format!("turned {turn}"), &places, &[(0, 1), (1, 2), (2, 1), (1, 0)], &["fd_a"]);
    }
}

#[test]
fn ways_taken_again_and_again_have_step_numbers() {
    let moves: Vec<(usize, usize)> =
        (0..30).map(|index| if index % 2 == 0 { (0, 1) } else { (1, 0) }).collect();
    check_all("a shuttle", &known(&[(0.0, 0.0), (5.0, 0.0)]), &moves, &["fd_a"]);
    let around: Vec<(usize, usize)> = (0..12).map(|index| (index % 3, (index + 1) % 3)).collect();
    check_all("around", &known(&[(0.0, 0.0), (5.0, 0.0), (2.0, 4.0)]), &around, &["fd_a", "fd_b"]);
}

#[test]
fn moves_that_end_where_they_begin_are_loops() {
    let moves = [(0, 0), (0, 1), (1, 1), (1, 0), (0, 0)];
    check_all("loops", &known(&[(0.0, 0.0), (5.0, 0.0)]), &moves, &["fd_a"]);
    let text = plan(&known(&[(0.0, 0.0), (5.0, 0.0)]), &moves, &["fd_a"]);
    let (_, text) = &drawings(&text)[0];
    assert_eq!(text.matches("class=\"loop\"").count(), 2);
    assert!(!text.contains("NaN"), "{text}");
}

#[test]
fn places_at_one_position_are_told_apart() {
    let positions = known(&[(0.0, 0.0), (10.0, 0.0), (10.0, 0.0), (10.0, 0.001), (20.0, 0.0)]);
    let moves = [(0, 1), (1, 2), (2, 1), (2, 3), (3, 4), (4, 2)];
    for (drawing, text) in drawings(&plan(&positions, &moves, &["fd_a"])) {
        let document = Document::parse(&text).expect("XML");
        // There is not enough space for all numbers here, but no number may be nearest to the arrow
        // of a different leg.
        check(&drawing, document.root(), &moves);
        let circles = document.descendants().filter(|node| node.attribute("data-place").is_some());
        let at = |node: Node<'_, '_>| {
            let circle = node.children().find(|child| child.tag_name().name() == "circle").expect("a circle");
            numbers(&format!("{} {}", circle.attribute("cx").expect("x"), circle.attribute("cy").expect("y")))
        };
        let points: Vec<Vec<f64>> = circles.map(at).collect();
        for one in 0..points.len() {
            for other in 0..one {
                let far = distance((points[one][0], points[one][1]), (points[other][0], points[other][1]));
                assert!(far > 14.0, "{drawing}: {one} and {other} lie on top of each other");
            }
        }
    }
    let one = known(&[(3.0, 4.0), (3.0, 4.0)]);
    for (drawing, text) in drawings(&plan(&one, &[(0, 1), (1, 0)], &["fd_a"])) {
        let document = Document::parse(&text).expect("XML");
        check(&drawing, document.root(), &[(0, 1), (1, 0)]);
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    }
}

#[test]
fn no_number_of_a_random_walk_stands_at_another_arrow() {
    let mut seed = 7_u64;
    let mut random = move |below: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % below
    };
    let (mut missing, mut all) = (0, 0);
    for walk in 0..60 {
        let count = 2 + random(8);
        let positions: Vec<Option<Point>> =
            (0..count).map(|_| Some((random(12) as f64, random(8) as f64))).collect();
        let mut at = 0;
        let moves: Vec<(usize, usize)> = (0..=random(19))
            .map(|_| {
                let from = at;
                at = random(count);
                (from, at)
            })
            .collect();
        for (drawing, text) in drawings(&plan(&positions, &moves, &["fd_a", "fd_b"])) {
            let document = Document::parse(&text).expect("XML");
            missing += check(&format!("walk {walk}, {drawing}"), document.root(), &moves);
            all += legs(document.root()).len();
        }
    }
    assert!(missing * 10 < all, "{missing} of {all} legs have no numbers");
}
