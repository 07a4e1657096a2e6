//! Knowledge base with objectives, for which designs can be chosen and adopted.

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

/// Maximum number of inference steps per update of the knowledge base; see [`rules::Limits`].
const STEPS: u64 = 100_000_000;

/// An objective to pursue: a function to provide, with requirements.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Goal {
    /// Name of the objective.
    pub name: String,
    /// The function to provide, by IRI or local name.
    pub function: String,
    /// Bounds on quality attributes: the attribute type by IRI or local name, and the bound in the type's unit.
    pub requirements: Vec<(String, BigRational)>,
    /// `true` if a better design is also searched for while the objective is fulfilled.
    pub always_improve: bool,
}

impl Goal {
    /// Returns an objective for a function, named `o_` followed by the function's local name, without requirements.
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
    /// Local names of objectives that stay in need, because no design was chosen for them or the robot could not
    /// change the design.
    pub(super) pending: BTreeSet<String>,
}

impl Configurator {
    /// Creates a configurator for a knowledge base.
    ///
    /// # Errors
    /// All attribute types and components of the wishes that are not in the knowledge base, and
    /// negative budgets.
    pub fn new(mut knowledge: Knowledge, wishes: Wishes) -> Result<Self, Errors> {
        knowledge.limit(STEPS);
        let view = knowledge.view();
        let attributes: Vec<String> = view.attribute_types().into_iter().map(|kind| kind.name).collect();
        let components: Vec<String> =
            view.components().into_iter().map(|component| component.individual.name).collect();
        let mut wrong = Vec::new();
        let mut check = |kind: &str, name: &str, known: &[String]| {
            if !known.iter().any(|candidate| candidate == name) {
                let suggestion = did_you_mean(name, known.iter().map(String::as_str));
                let text = format!(
                    "the knowledge base has no {kind} `{name}`; it has: {}{suggestion}",
                    known.join(", ")
                );
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

    /// Returns the knowledge base.
    pub fn knowledge(&self) -> &Knowledge {
        &self.knowledge
    }

    /// Returns the knowledge base for changes, e.g. to assert reports of the robot.
    pub fn knowledge_mut(&mut self) -> &mut Knowledge {
        &mut self.knowledge
    }

    /// Returns the definition of utility and the joint constraints on the chosen designs.
    pub fn wishes(&self) -> &Wishes {
        &self.wishes
    }

    /// Returns all objectives of the knowledge base.
    pub fn objectives(&self) -> Vec<Objective> {
        self.knowledge.runtime().objectives()
    }

    /// Returns the sorted local names of the functions that some design solves. PLANTA's design `fd_unground`, which
    /// solves every function, is ignored.
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

    /// Returns the sorted local names of all functions, including those that no design solves.
    pub fn all_functions(&self) -> Vec<String> {
        let stated = self.knowledge.view().functions().into_iter().map(|function| function.name);
        let names: BTreeSet<String> = stated.chain(self.functions()).collect();
        names.into_iter().collect()
    }

    /// Adds an objective.
    ///
    /// # Errors
    /// The function or an attribute type does not exist, the name cannot be used or already belongs to an objective, or
    /// the rules do not terminate.
    pub fn pursue(&mut self, goal: &Goal) -> Result<(), Message> {
        let bound = |bound: &BigRational| Literal::Decimal(rules::Decimal::from_rational(bound));
        let requirements =
            goal.requirements.iter().map(|(name, value)| (name.as_str(), bound(value))).collect();
        let Goal { name, function, always_improve, .. } = goal;
        let new = NewObjective { name, function, requirements, always_improve: *always_improve };
        self.change(|runtime| runtime.add_objective(&new))
    }

    /// Removes an objective, given by IRI or local name.
    ///
    /// # Errors
    /// The objective does not exist, or the rules do not terminate.
    pub fn give_up(&mut self, objective: &str) -> Result<(), Message> {
        self.change(|runtime| runtime.remove_objective(objective))?;
        self.pending.remove(ontology::vocab::local_name(objective));
        Ok(())
    }

    /// Chooses designs for the objectives in need, without adopting them. An objective is in need if its status or
    /// properties require a design, if it has no design, or if its design is not available. It is also in need if the
    /// last choice or change of its design failed. At a limit, returns the best choice found.
    ///
    /// # Errors
    /// The rules do not terminate.
    pub fn choose(&self, limits: &Limits) -> Result<Configuration, Message> {
        let is_in_need = |objective: &Objective| {
            let is_pending = self.pending.contains(&objective.individual.name);
            objective.wants_design() || objective.groundings.is_empty() || is_pending
        };
        choose(&self.knowledge, &self.wishes, &is_in_need, limits)
    }

    /// Grounds the objective by the chosen design, i.e. makes it the design of the objective. The objective's statuses
    /// are retracted; if it was updatable, so are the reports of recovered components. Recorded failures of designs are
    /// kept. If the design changes, measurements of the previous design's performance no longer count. An objective
    /// without a chosen design stays in need, and keeps its design unless it is [withdrawn](Choice::withdrawn).
    ///
    /// # Errors
    /// The objective or the design does not exist, or the rules do not terminate.
    pub fn adopt(&mut self, choice: &Choice) -> Result<(), Message> {
        let objective = choice.objective.as_str();
        let Some(design) = &choice.design else {
            self.pending.insert(objective.to_owned());
            return if choice.withdrawn.is_some() {
                self.change(|runtime| runtime.unground(objective))
            } else {
                Ok(())
            };
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

    /// Restores the previous design `before` of an objective after the robot could not change the design; `None`
    /// removes the design. The objective stays in need.
    ///
    /// # Errors
    /// The objective or the design does not exist, or the rules do not terminate.
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
