//! A knowledge base with objectives, and the designs that serve them.

use std::collections::BTreeSet;

use num_rational::BigRational;
use num_traits::Signed as _;
use ontology::runtime::{NewObjective, Objective};
use planner::Limits;
use rules::Literal;

use crate::configure::choice::{Choice, Configuration, Wishes, Worth, choose};
use crate::knowledge::Knowledge;
use crate::message::{Errors, Message, did_you_mean};
use crate::number::decimal;

/// What follows from what was heard is to be found in so many steps; see [`rules::Limits`].
const STEPS: u64 = 100_000_000;

/// An objective to pursue.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Goal {
    /// Its name.
    pub name: String,
    /// The function to provide, by IRI or local name.
    pub function: String,
    /// Attribute types, by IRI or local name, and bounds in their units.
    pub requirements: Vec<(String, BigRational)>,
    /// Whether to look for a better design also while all is well.
    pub always_improve: bool,
}

impl Goal {
    /// An objective named after its function, without requirements.
    pub fn of(function: &str) -> Self {
        let name = format!("o_{}", ontology::vocab::local_name(function));
        Self { name, function: function.to_owned(), requirements: Vec::new(), always_improve: false }
    }
}

/// Chooses designs for the objectives of a knowledge base.
#[derive(Debug, Clone)]
pub struct Configurator {
    knowledge: Knowledge,
    wishes: Wishes,
    /// Objectives in need that no design could serve, or for which the robot could not change designs: they stay in need.
    pending: BTreeSet<String>,
}

impl Configurator {
    /// Takes over a knowledge base.
    ///
    /// # Errors
    /// All attribute types and components of the wishes that are not in the knowledge base, and negative budgets.
    pub fn new(mut knowledge: Knowledge, wishes: Wishes) -> Result<Self, Errors> {
        knowledge.limit(STEPS);
        let view = knowledge.view();
        let attributes: Vec<String> = view.attribute_types().into_iter().map(|kind| kind.name).collect();
        let components: Vec<String> = view.components().into_iter().map(|own| own.individual.name).collect();
        let mut wrong = Vec::new();
        let mut check = |kind: &str, name: &str, known: &[String]| {
            if !known.iter().any(|own| own == name) {
                let meant = did_you_mean(name, known.iter().map(String::as_str));
                let text =
                    format!("the knowledge base has no {kind} `{name}`; it has: {}{meant}", known.join(", "));
                wrong.push(Message::error("M140", text));
            }
        };
        if let Worth::Most(name) | Worth::Least(name) = &wishes.worth {
            check("quality attribute type", name, &attributes);
        }
        wishes.budgets.iter().for_each(|(name, _)| check("quality attribute type", name, &attributes));
        wishes.exclusive.iter().for_each(|name| check("component", name, &components));
        for (name, most) in wishes.budgets.iter().filter(|(_, most)| most.is_negative()) {
            let text = format!("the budget of `{name}` is {}, but should not be negative", decimal(most));
            wrong.push(Message::error("M142", text));
        }
        if wrong.is_empty() {
            Ok(Self { knowledge, wishes, pending: BTreeSet::new() })
        } else {
            Err(wrong.into())
        }
    }

    /// What is known.
    pub fn knowledge(&self) -> &Knowledge {
        &self.knowledge
    }

    /// What is known, to report what has happened.
    pub fn knowledge_mut(&mut self) -> &mut Knowledge {
        &mut self.knowledge
    }

    /// What is wanted of a configuration as a whole.
    pub fn wishes(&self) -> &Wishes {
        &self.wishes
    }

    /// The objectives.
    pub fn objectives(&self) -> Vec<Objective> {
        self.knowledge.runtime().objectives()
    }

    /// The functions that some design solves, by local name; PLANTA's `fd_unground`, which solves each, does not count.
    pub fn functions(&self) -> Vec<String> {
        let view = self.knowledge.view();
        let designs =
            view.function_designs().into_iter().filter(|design| design.individual.name != "fd_unground");
        let mut names: Vec<String> =
            designs.flat_map(|design| design.solves).map(|function| function.name).collect();
        names.sort();
        names.dedup();
        names
    }

    /// Begins to pursue an objective.
    ///
    /// # Errors
    /// There is no such function or attribute type, or there is an objective of that name.
    pub fn pursue(&mut self, goal: &Goal) -> Result<(), Message> {
        let bound = |bound: &BigRational| Literal::Decimal(rules::Decimal::from_rational(bound));
        let requirements =
            goal.requirements.iter().map(|(name, value)| (name.as_str(), bound(value))).collect();
        let Goal { name, function, always_improve, .. } = goal;
        let new = NewObjective { name, function, requirements, always_improve: *always_improve };
        self.change(|runtime| runtime.add_objective(&new))
    }

    /// Gives an objective up.
    ///
    /// # Errors
    /// There is no such objective.
    pub fn give_up(&mut self, objective: &str) -> Result<(), Message> {
        self.change(|runtime| runtime.remove_objective(objective))?;
        self.pending.remove(ontology::vocab::local_name(objective));
        Ok(())
    }

    /// Designs for the objectives in need.
    ///
    /// # Errors
    /// A rule runs away.
    pub fn choose(&self, limits: &Limits) -> Result<Configuration, Message> {
        let is_in_need = |objective: &Objective| {
            let is_pending = self.pending.contains(&objective.individual.name);
            objective.wants_design() || objective.groundings.is_empty() || is_pending
        };
        choose(&self.knowledge, &self.wishes, &is_in_need, limits)
    }

    /// The chosen design serves the objective from now on. Statuses are forgotten, and so are recoveries that made it updatable; that
    /// a design has failed it is not. An objective that no design can serve keeps the one that it has, and stays in need.
    ///
    /// # Errors
    /// There is no such objective or design, or a rule runs away.
    pub fn adopt(&mut self, choice: &Choice) -> Result<(), Message> {
        let objective = choice.objective.as_str();
        let Some(design) = &choice.design else {
            self.pending.insert(objective.to_owned());
            return Ok(());
        };
        self.change(|runtime| {
            runtime.log_failures(objective)?;
            runtime.ground(objective, design)?;
            if choice.before.as_ref() == Some(design) {
                return Ok(());
            }
            runtime.forget_performance(objective).map(|_| ())
        })?;
        self.pending.remove(objective);
        Ok(())
    }

    /// The robot could not change designs for an objective: it is served as before, and stays in need.
    ///
    /// # Errors
    /// As [`Configurator::adopt`].
    pub fn revert(&mut self, objective: &str, before: Option<&str>) -> Result<(), Message> {
        match before {
            Some(design) => self.change(|runtime| runtime.ground(objective, design)),
            None => self.change(|runtime| runtime.unground(objective)),
        }?;
        self.pending.insert(objective.to_owned());
        Ok(())
    }

    fn change<T>(
        &mut self,
        change: impl FnOnce(&mut ontology::runtime::Runtime) -> Result<T, ontology::Error>,
    ) -> Result<(), Message> {
        change(self.knowledge.runtime_mut()).map(|_| ()).map_err(|error| Message::from_ontology(&error))
    }
}
