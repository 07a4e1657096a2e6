//! Converts a Pareto front of two objectives to a picture.

use picture::{Part, Points, Sheet};
use planner::{Front, Status};

use crate::report::plan::plan_picture;
use crate::report::seen::Seen;

/// Returns the picture of a Pareto front. `objectives` contains the texts of the two objectives.
/// Each step of the plans must have all arguments of its action in the mission's domain, including
/// the designs.
pub fn front_sheet(seen: Seen<'_>, objectives: &[String], front: &Front) -> Sheet {
    let solved: Vec<_> = front.points.iter().filter(|point| point.solution.plan.is_some()).collect();
    let verdict = match front.status {
        Status::Optimal => format!("{} plans on the front, proved: there are no others.", solved.len()),
        Status::Feasible => {
            format!("{} plans on the front; whether there are others is not proved.", solved.len())
        }
        _ => "There is no plan to show.".to_owned(),
    };
    let titles: Vec<String> = (1..)
        .zip(&solved)
        .map(|(number, point)| {
            let values =
                objectives.iter().zip(&point.values).map(|(text, value)| format!("{text} = {value}"));
            format!("point {number}: {}", values.collect::<Vec<_>>().join(", "))
        })
        .collect();
    let place =
        |index: usize| solved[index].values.get(..2).map(|values| (values[0].to_f64(), values[1].to_f64()));
    let places: Vec<(f64, f64)> = (0..solved.len()).filter_map(place).collect();
    let mut line = places.clone();
    line.sort_by(|left, right| left.0.total_cmp(&right.0));
    // The line bounds the values that these plans dominate, so it is a staircase.
    let corners = line.windows(2).flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]);
    let line: Vec<(f64, f64)> = corners.chain(line.last().copied()).collect();
    let points = (1..).zip(&titles).zip(&places);
    let points = Points {
        title: "the front".to_owned(),
        axes: [0, 1].map(|axis| objectives.get(axis).cloned().unwrap_or_default()),
        line,
        points: points.map(|((number, title), (x, y))| (number.to_string(), title.clone(), *x, *y)).collect(),
    };
    let plans =
        titles.into_iter().zip(&solved).map(|(title, point)| (title, plan_picture(seen, &point.solution)));
    Sheet {
        name: format!("{}: {}", seen.mission.name, objectives.join(" against ")),
        description: "Plans that no other plan improves in one objective without being worse in the other."
            .to_owned(),
        verdict,
        parts: vec![
            Part::Heading("Front".to_owned()),
            Part::Points(points),
            Part::Heading("Plans".to_owned()),
            Part::Plans(plans.collect()),
        ],
    }
}
