//! Texts of a robot's mission: knowledge base, domain and problem.

use std::fmt::Write as _;

use super::{CHARGING, Design, FULL, Form, Robot, Situation};

const CHANGES: &str = "(:derived (unset ?f - function) (not (exists (?d - functiondesign) (at_work ?d ?f))))
   (:action set :parameters (?f - function ?d - functiondesign)
      :precondition (and (unset ?f) (fd_solve_f ?d ?f) (fd_available ?d)) :effect (at_work ?d ?f))
   (:action reconfigure :parameters (?f - function ?old ?new - functiondesign)
      :precondition (and (at_work ?old ?f) (fd_solve_f ?new ?f) (fd_available ?new) (not (= ?old ?new)))
      :effect (and (not (at_work ?old ?f)) (at_work ?new ?f) (increase (total-cost) (change ?new))))\n";

impl Robot {
    /// In the renamed form, functions and designs get the prefix `k`. The name map removes it, and maps `kd0` to `prime`.
    pub(super) fn document(
        form: Form,
        functions: usize,
        designs: &[Design],
        bounds: [Option<i64>; 3],
    ) -> String {
        let prefix = if form == Form::Renamed { "k" } else { "" };
        let mut text = "@prefix : <urn:m#> .\n@prefix owl: <http://www.w3.org/2002/07/owl#> .\n\
            @prefix t: <http://metacontrol.org/tomasys#> .\n\
            <urn:m> a owl:Ontology ; owl:imports <http://metacontrol.org/tomasys> .\n"
            .to_owned();
        for attribute in ["slowness", "energy", "safety", "change", "visibility", "watt_hours"] {
            let _ = writeln!(text, ":{attribute} a t:QualityAttributeType .");
        }
        for (observed, value) in [("visibility", 3), ("watt_hours", FULL)] {
            let _ = writeln!(
                text,
                ":obs_{observed} a t:QAvalue ; t:isQAtype :{observed} ; t:isMeasured true ; t:hasValue {value}.0 ."
            );
        }
        let required: Vec<_> = (0..functions).map(|function| format!(":{prefix}f{function}")).collect();
        let kinds = [
            ("careful", "safety", "hasMinimum", Some("narrow")),
            ("silent", "energy", "hasMaximum", Some("quiet")),
            ("quick", "slowness", "hasMaximum", None),
        ];
        let mut requirements = Vec::new();
        for ((name, attribute, bound, context), value) in kinds.into_iter().zip(bounds) {
            let Some(value) = value.filter(|_| form.is_native()) else { continue };
            let context = context.map_or_else(String::new, |context| format!(" ; t:inContext \"{context}\""));
            let _ = writeln!(
                text,
                ":{name} a t:Requirement ; t:isQAtype :{attribute} ; t:{bound} {value}.0{context} ."
            );
            requirements.push(format!(":{name}"));
        }
        let requirements = if requirements.is_empty() {
            String::new()
        } else {
            format!(" ; t:requiresQuality {}", requirements.join(" , "))
        };
        let _ = writeln!(text, ":a_move a t:Action ; t:requiresF {}{requirements} .", required.join(" , "));
        for component in 0..2 {
            let _ = writeln!(text, ":c{component} a t:Component .");
        }
        for function in 0..functions {
            let _ = writeln!(text, ":{prefix}f{function} a t:Function .");
        }
        for (number, design) in designs.iter().enumerate() {
            let name = format!("{prefix}d{number}");
            let mut values =
                vec![("slowness", design.slowness), ("energy", design.energy), ("change", design.change)];
            values.extend(design.safety.map(|safety| ("safety", safety)));
            let estimations: Vec<_> =
                values.iter().map(|(attribute, _)| format!(":{name}_{attribute}")).collect();
            let mut needs = String::new();
            if let Some(component) = design.component {
                let _ = write!(needs, " ; t:requiresC :c{component}");
            }
            if let Some(min_visibility) = design.visibility {
                let _ = write!(needs, " ; t:hasRequirement :{name}_sees");
                let _ = writeln!(
                    text,
                    ":{name}_sees a t:Requirement ; t:isQAtype :visibility ; t:hasMinimum {min_visibility}.0 ."
                );
            }
            let _ = writeln!(
                text,
                ":{name} a t:FunctionDesign ; t:solvesF :{prefix}f{}{needs} ; t:hasQAestimation {} .",
                design.function,
                estimations.join(" , ")
            );
            for (attribute, value) in values {
                let _ = writeln!(
                    text,
                    ":{name}_{attribute} a t:QAvalue ; t:isQAtype :{attribute} ; t:hasValue {value}.0 ."
                );
            }
        }
        text
    }

    pub(super) fn renamed(&self, text: &str) -> String {
        let names: &[(&str, &str)] = match self.form {
            Form::Explicit | Form::Native => return text.to_owned(),
            Form::Renamed => &[
                ("functiondesign", "means"),
                ("function", "role"),
                ("fd_solve_f", "good_for"),
                ("fd_available", "usable"),
                ("slowness", "slow"),
                ("energy", "hunger"),
                ("battery", "charge_left"),
                ("d0", "prime"),
            ],
            Form::NativeBound => {
                &[("move", "go"), ("slowness", "slow"), ("energy", "hunger"), ("battery", "charge_left")]
            }
        };
        let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '?' || c == '-' || c == ':';
        let mut renamed = String::new();
        let mut remainder = text;
        while !remainder.is_empty() {
            let end = remainder.find(|c| !is_word(c)).unwrap_or(remainder.len());
            let (word, tail) = remainder.split_at(end);
            renamed.push_str(names.iter().find(|(from, _)| *from == word).map_or(word, |(_, to)| to));
            let gap = tail.find(is_word).unwrap_or(tail.len());
            renamed.push_str(&tail[..gap]);
            remainder = &tail[gap..];
        }
        renamed
    }

    pub(super) fn files(&self, situation: &Situation) -> (String, String) {
        let native = self.form.is_native();
        let each = |text: &dyn Fn(usize) -> String| -> String {
            (0..if native { 0 } else { self.functions }).map(|f| text(f) + " ").collect()
        };
        let sum = |attribute: &str| {
            if native {
                return format!("({attribute})");
            }
            format!("(+ 0 {})", each(&|f| format!("({attribute} ?d{f})")))
        };
        let (slowness, energy) = (sum("slowness"), sum("energy"));
        let bounds = |name: &str| {
            let mut text = String::new();
            if !native && name == "squeeze" {
                let _ = write!(text, "(>= (safety ?d0) {}) ", self.safety);
            }
            if let Some(max) = self.quiet.filter(|_| !native) {
                text += &each(&|f| format!("(or (not (quiet ?a)) (<= (energy ?d{f}) {max}))"));
            }
            if let Some(max) = self.quick.filter(|_| !native) {
                text += &each(&|f| format!("(<= (slowness ?d{f}) {max})"));
            }
            text
        };
        let works = |at: &str| {
            let close = if at.is_empty() { "" } else { ")" };
            let condition = |f: usize| format!("{at}(at_work ?d{f} f{f}){close}");
            if self.reconfiguration { each(&condition) } else { String::new() }
        };
        let effect =
            if self.reconfiguration && native { "(increase (total-cost) (reconfigured))" } else { "" };
        let price = format!("(+ (length ?a ?b) (* (length ?a ?b) {slowness}))");
        let moving = |name: &str, way: &str| {
            let parameters = each(&|f| format!("?d{f}")) + if native { "" } else { "- functiondesign" };
            let is_usable = each(&|f| format!("(fd_solve_f ?d{f} f{f}) (fd_available ?d{f})"));
            let conditions = format!("(at ?a) {way} {is_usable} {}", bounds(name));
            let battery_condition = format!("(>= (battery) (* (length ?a ?b) {energy}))");
            let battery_effect = format!("(decrease (battery) (* (length ?a ?b) {energy}))");
            if self.is_timed {
                let effect = if effect.is_empty() { String::new() } else { format!("(at end {effect})") };
                return format!(
                    "(:durative-action {name} :parameters (?a ?b - place {parameters}) :duration (= ?duration {price})
                       :condition (and (at start (and {conditions} {battery_condition})) {})
                       :effect (and (at start (not (at ?a))) (at end (at ?b)) (at end {battery_effect}) {effect}))\n",
                    works("(over all ")
                );
            }
            format!(
                "(:action {name} :parameters (?a ?b - place {parameters})
                   :precondition (and {conditions} {} {battery_condition})
                   :effect (and (not (at ?a)) (at ?b) {battery_effect} (increase (total-cost) {price}) {effect}))\n",
                works("")
            )
        };
        let moves = if native {
            moving("move", "(or (wide ?a ?b) (narrow ?a ?b))")
        } else {
            moving("move", "(wide ?a ?b)") + &moving("squeeze", "(narrow ?a ?b)")
        };
        let charge = if self.is_timed {
            format!(
                "(:durative-action charge :parameters (?p - place) :duration (= ?duration {CHARGING})
                   :condition (at start (and (at ?p) (charger ?p))) :effect (at end (assign (battery) {FULL})))\n"
            )
        } else {
            format!(
                "(:action charge :parameters (?p - place) :precondition (and (at ?p) (charger ?p))
                   :effect (and (assign (battery) {FULL}) (increase (total-cost) {CHARGING})))\n"
            )
        };
        let change = if self.reconfiguration && !native { CHANGES } else { "" };
        let predicates = "(at ?p - place) (wide ?a ?b - place) (narrow ?a ?b - place) (quiet ?a - place) (charger ?p - place)";
        let domain = if native {
            let reconfigured = if self.reconfiguration { "(reconfigured)" } else { "" };
            format!(
                "(define (domain m) (:types place) (:predicates {predicates})
                  (:functions (total-cost) (battery) (length ?a ?b - place) (slowness) (energy) {reconfigured})
                  {moves} {charge})"
            )
        } else {
            format!(
                "(define (domain m) (:types place functiondesign function) (:constants {}- function)
                  (:predicates {predicates} (fd_solve_f ?d - functiondesign ?f - function) (fd_available ?d - functiondesign)
                    (at_work ?d - functiondesign ?f - function) (unset ?f - function))
                  (:functions (total-cost) (battery) (length ?a ?b - place) (slowness ?d - functiondesign)
                    (energy ?d - functiondesign) (safety ?d - functiondesign) (change ?d - functiondesign))
                  {change} {moves} {charge})",
                each(&|f| format!("f{f}"))
            )
        };
        (domain, self.problem(situation))
    }

    fn problem(&self, situation: &Situation) -> String {
        let mut init = format!("(at p0) (charger p{}) (= (total-cost) 0)", situation.charger);
        if !self.form.is_bound() {
            let _ = write!(init, " (= (battery) {})", situation.battery);
        }
        for ((a, b), (is_narrow, length)) in &situation.ways {
            let kind = if *is_narrow { "narrow" } else { "wide" };
            let _ = write!(init, " ({kind} p{a} p{b}) (= (length p{a} p{b}) {length})");
        }
        for place in &situation.quiet {
            let _ = write!(init, " (quiet p{place})");
        }
        let mut objects = "p0 p1 p2 p3 - place".to_owned();
        if self.form == Form::Renamed {
            for number in 0..self.designs.len() {
                let _ = write!(objects, " d{number} - functiondesign");
            }
        }
        let metric = if self.is_timed { "(+ (total-time) (total-cost))" } else { "(total-cost)" };
        format!(
            "(define (problem p) (:domain m) (:objects {objects}) (:init {init}) (:goal (at p3))
              (:metric minimize {metric}))"
        )
    }
}
