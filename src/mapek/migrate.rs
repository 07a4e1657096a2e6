//! Migration: moves a robot to another version of its mission. Changes that the robot has reported are kept, except
//! those that the noise filters still hold back.
//!
//! Facts and values, also those of the knowledge base, are merged three ways: those that differ from the initial state
//! of the former version are taken from the robot, all others from the new version. The plan is not transferred, because
//! the new version needs another one.

use std::collections::{BTreeMap, BTreeSet};

use pddl::ast::InitialElement;
use serde_json::Value;

use crate::knowledge::Knowledge;
use crate::mapek::analyze::{analyze, report_contradictions};
use crate::mapek::answer::Answer;
use crate::mapek::control::Loop;
use crate::mapek::record::{element_from_record, element_to_record};
use crate::message::Message;

impl Loop {
    /// Returns `true` if no action is under way, so that the loop can be replaced by one of another version.
    pub fn is_between_actions(&self) -> bool {
        self.beliefs.running.is_none()
    }

    /// Transfers the state of `robot`, a loop of a former version of the mission, to this loop, which has not started.
    /// `initial` is the loop of the former version before its start. Numbers of actions and effects continue. Returns
    /// the differences that follow from the new version, for example in available designs. [`Loop::start`] then makes
    /// the first plan. After an error, this loop is not usable.
    ///
    /// # Errors
    /// An action is under way, or the robot's facts, statements or goal do not fit the new version.
    pub fn migrate(&mut self, robot: &Self, initial: &Self) -> Result<Vec<Answer>, Message> {
        let wrong = |what: &str| {
            let text = format!("the robot cannot have another version of its mission: {what}");
            Message::error("M309", text)
        };
        if !robot.is_between_actions() {
            return Err(wrong("an action is under way"));
        }
        let (beliefs, former) = (&mut self.beliefs, &robot.beliefs);
        if let Some(base) = beliefs.mission.knowledge_mut() {
            let statements = former.mission.knowledge().map(Knowledge::statements).unwrap_or_default();
            base.restore_over(&statements)?;
            // Applies the reports and objectives that are pending because reasoning failed in the former version.
            let waiting = former.mission.knowledge().map(Knowledge::waiting);
            base.take_over(waiting.cloned().unwrap_or_default());
        }
        // The filters start from the values and statuses of the knowledge base; held reports are lost.
        beliefs.filters = self.monitor.filters().states(beliefs.mission.knowledge());
        let init = merged(
            &initial.beliefs.mission.problem().init,
            &former.mission.problem().init,
            &beliefs.mission.problem().init,
        );
        beliefs.mission.set_init(init);
        if let Some(goal) = &former.goal {
            let condition = beliefs.mission.goal(goal).map_err(|errors| wrong(&errors.to_string()))?;
            beliefs.mission.set_goal(condition);
            beliefs.goal = Some(goal.clone());
        }
        beliefs.mission.filled().map_err(|errors| wrong(&errors.to_string()))?;
        beliefs.available.clone_from(&former.available);
        beliefs.statuses.clone_from(&former.statuses);
        beliefs.violated.clone_from(&former.violated);
        beliefs.fault.clone_from(&former.fault);
        let has_design = |design: &str| {
            beliefs.mission.knowledge().is_none_or(|base| {
                base.catalogue().designs().iter().any(|known| known.individual.name == design)
            })
        };
        let configuration = former.configuration.iter().filter(|(_, design)| has_design(design));
        beliefs.configuration = configuration.map(|(name, design)| (name.clone(), design.clone())).collect();
        (beliefs.actions, beliefs.effects, beliefs.lines) = (former.actions, former.effects, former.lines);
        beliefs.has_times = former.has_times;
        beliefs.outstanding.clone_from(&former.outstanding);
        beliefs.receipts = former.receipts.clone();
        beliefs.waits.clone_from(&former.waits);
        beliefs.reports_actions = former.reports_actions;
        beliefs.numbers = former.numbers.clone();
        (beliefs.now, beliefs.considered) = (former.now, former.considered);
        let mut answers = Vec::new();
        report_contradictions(beliefs, &mut answers);
        analyze(beliefs, &mut answers);
        Ok(answers)
    }
}

/// Merges initial states: elements in which `robot` differs from `former` replace those of `new`. An element
/// of `former` that `robot` lacks is omitted. Timed elements are those of `new`.
fn merged(
    former: &[InitialElement],
    robot: &[InitialElement],
    new: &[InitialElement],
) -> Vec<InitialElement> {
    let by_name = |elements: &[InitialElement]| -> BTreeMap<String, Value> {
        let records = elements.iter().filter_map(element_to_record);
        records.map(|record| (record[0].to_string(), record)).collect()
    };
    let (former, mut robot) = (by_name(former), by_name(robot));
    let by_new = replaced_prefixes(&former, &by_name(new));
    let mut replaced = replaced_prefixes(&former, &robot);
    replaced.retain(|prefix| by_new.contains(prefix));
    let mut init = Vec::new();
    for element in new {
        let Some(record) = element_to_record(element) else {
            init.push(element.clone());
            continue;
        };
        let name = record[0].to_string();
        match (former.get(&name), robot.remove(&name)) {
            // The robot's value differs from that of the former version, so it replaces the new one.
            (before, Some(now)) if before != Some(&now) => init.extend(element_from_record(&now)),
            // The element is in the former version, but not in the state of the robot.
            (Some(_), None) => {}
            // The robot and the new version have replaced the same fact, for example the place of the robot.
            (None, None) if prefix(&record).is_some_and(|prefix| replaced.contains(&prefix)) => {}
            _ => init.push(element.clone()),
        }
    }
    let changed = robot.into_iter().filter(|(name, now)| former.get(name) != Some(now));
    init.extend(changed.filter_map(|(_, now)| element_from_record(&now)));
    init
}

/// Returns the predicate and all arguments but the last of a fact in the form of [`element_to_record`]. Returns `None`
/// for other elements and for facts without arguments.
fn prefix(record: &Value) -> Option<String> {
    let (_, words) = record[0].as_array()?.split_last()?;
    (record[1] == Value::Bool(true) && !words.is_empty()).then(|| Value::from(words).to_string())
}

/// Returns the prefixes with which both `former` and `later` have a single fact, but different ones.
fn replaced_prefixes(former: &BTreeMap<String, Value>, later: &BTreeMap<String, Value>) -> BTreeSet<String> {
    let facts = |elements: &BTreeMap<String, Value>| {
        let mut facts: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for (name, record) in elements {
            if let Some(prefix) = prefix(record) {
                facts.entry(prefix).or_default().push(name.clone());
            }
        }
        facts
    };
    let (before, mut after) = (facts(former), facts(later));
    let is_replaced = |(prefix, names): (String, Vec<String>)| {
        let later_names = after.remove(&prefix)?;
        (names.len() == 1 && later_names.len() == 1 && names != later_names).then_some(prefix)
    };
    before.into_iter().filter_map(is_replaced).collect()
}

#[cfg(test)]
mod tests {
    use super::merged;
    use crate::mapek::record::element_from_record;
    use pddl::ast::InitialElement;
    use serde_json::json;

    #[test]
    fn reports_of_the_robot_and_changes_of_the_mission_are_both_kept() {
        let init = |text: &[(&str, &str)]| -> Vec<InitialElement> {
            let record = |(name, value): &(&str, &str)| {
                let value = if *value == "true" { json!(true) } else { json!(value) };
                element_from_record(&json!([name.split(' ').collect::<Vec<_>>(), value])).expect("an element")
            };
            text.iter().map(record).collect()
        };
        let former = init(&[("at a", "true"), ("battery", "100"), ("road a b", "true"), ("speed", "1")]);
        let robot = init(&[("at b", "true"), ("battery", "40"), ("road a b", "true"), ("speed", "1")]);
        let new = init(&[
            ("at a", "true"),
            ("battery", "90"),
            ("road a b", "true"),
            ("road b c", "true"),
            ("speed", "2"),
        ]);
        let expected = init(&[
            ("battery", "40"),
            ("road a b", "true"),
            ("road b c", "true"),
            ("speed", "2"),
            ("at b", "true"),
        ]);
        assert_eq!(format!("{:?}", merged(&former, &robot, &new)), format!("{expected:?}"));
        // The new version has removed a road, which the robot did not report.
        let without = merged(&former, &robot, &init(&[("at a", "true"), ("battery", "100"), ("speed", "1")]));
        let expected = init(&[("battery", "40"), ("speed", "1"), ("at b", "true")]);
        assert_eq!(format!("{without:?}"), format!("{expected:?}"));
        // The robot is at one place only, also if the new version begins at another one.
        let moved =
            merged(&former, &robot, &init(&[("at c", "true"), ("road a b", "true"), ("done a", "true")]));
        let expected = init(&[("road a b", "true"), ("done a", "true"), ("at b", "true"), ("battery", "40")]);
        assert_eq!(format!("{moved:?}"), format!("{expected:?}"));
        // The new version adds a free place. There can be several.
        let former = init(&[("free a", "true"), ("free b", "true")]);
        let robot = init(&[("free b", "true"), ("free c", "true")]);
        let grown =
            merged(&former, &robot, &init(&[("free a", "true"), ("free b", "true"), ("free d", "true")]));
        let expected = init(&[("free b", "true"), ("free d", "true"), ("free c", "true")]);
        assert_eq!(format!("{grown:?}"), format!("{expected:?}"));
        // The new version adds a blocked place, which the robot did not report.
        let former = init(&[("blocked a", "true")]);
        let robot = init(&[("blocked b", "true")]);
        let grown = merged(&former, &robot, &init(&[("blocked a", "true"), ("blocked c", "true")]));
        let expected = init(&[("blocked c", "true"), ("blocked b", "true")]);
        assert_eq!(format!("{grown:?}"), format!("{expected:?}"));
    }
}
