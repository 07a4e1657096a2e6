//! Small tasks whose optimal costs were determined by hand.

pub struct Example {
    pub name: &'static str,
    pub domain: &'static str,
    pub problem: &'static str,
    pub optimum: Option<&'static str>,
}

pub const TASKS: &[Example] = &[
    // The direct route from a to c costs 5; the route through b costs 2 + 2.
    Example {
        name: "ways",
        domain: "(define (domain d) (:predicates (at ?p) (way ?a ?b)) (:functions (far ?a ?b) (total-cost))
          (:action go :parameters (?a ?b) :precondition (and (at ?a) (way ?a ?b))
            :effect (and (at ?b) (not (at ?a)) (increase (total-cost) (far ?a ?b)))))",
        problem: "(define (problem p) (:domain d) (:objects a b c)
          (:init (at a) (way a b) (way b c) (way a c) (way c a)
            (= (far a b) 2) (= (far b c) 2) (= (far a c) 5) (= (far c a) 1) (= (total-cost) 0))
          (:goal (at c)) (:metric minimize (total-cost)))",
        optimum: Some("4"),
    },
    // The route with cost 4 consumes 6 of the battery, so the battery must be filled at a cost of 3.
    Example {
        name: "battery",
        domain: "(define (domain d) (:predicates (at ?p) (way ?a ?b)) (:functions (battery) (use ?a ?b) (total-cost))
          (:action go :parameters (?a ?b)
            :precondition (and (at ?a) (way ?a ?b) (>= (battery) (use ?a ?b)))
            :effect (and (at ?b) (not (at ?a)) (decrease (battery) (use ?a ?b)) (increase (total-cost) 2)))
          (:action fill :parameters () :precondition (<= (battery) 5)
            :effect (and (assign (battery) 6.5) (increase (total-cost) 3))))",
        problem: "(define (problem p) (:domain d) (:objects a b c)
          (:init (at a) (way a b) (way b c) (way c a) (= (battery) 5) (= (use a b) 2.5) (= (use b c) 3.5)
            (= (use c a) 9) (= (total-cost) 0))
          (:goal (at c)) (:metric minimize (total-cost)))",
        optimum: Some("7"),
    },
    // `lift` takes 4 units of time and returns the hand at its end; `carry` takes 2.5 and never returns the
    // hand.
    Example {
        name: "durative",
        domain: "(define (domain d) (:predicates (free) (up) (done) (sure))
          (:durative-action lift :parameters () :duration (= ?duration 4)
            :condition (and (at start (free)) (over all (sure)) (at end (not (free))))
            :effect (and (at start (not (free))) (at end (free)) (at end (up))))
          (:durative-action carry :parameters () :duration (= ?duration 2.5)
            :condition (and (at start (up)) (at start (free)))
            :effect (and (at start (not (free))) (at end (done)) (at start (not (sure))))))",
        problem: "(define (problem p) (:domain d) (:init (free) (sure)) (:goal (and (done) (up))))",
        optimum: Some("13/2"),
    },
    // An action switches a lamp, and a second conditional effect depends on the previous state of the lamp.
    Example {
        name: "switch",
        domain: "(define (domain d) (:types lamp) (:predicates (on ?l - lamp) (seen ?l - lamp) (dark))
          (:action press :parameters (?l - lamp) :precondition ()
            :effect (and (when (on ?l) (and (not (on ?l)) (dark))) (when (not (on ?l)) (on ?l))))
          (:action look :parameters () :precondition (not (dark))
            :effect (forall (?l - lamp) (when (on ?l) (seen ?l))))
          (:action wake :parameters () :precondition () :effect (not (dark))))",
        problem: "(define (problem p) (:domain d) (:objects x y - lamp) (:init (on x) (dark))
          (:goal (and (seen x) (seen y) (not (on x)))))",
        optimum: Some("4"),
    },
    // Conditional numeric effects: a strike adds more if the first strike has warmed the material.
    Example {
        name: "strokes",
        domain: "(define (domain d) (:predicates (warm) (p)) (:functions (work) (total-cost))
          (:action strike :parameters () :precondition (<= (work) 20)
            :effect (and (when (warm) (increase (work) 4)) (when (not (warm)) (increase (work) 1)) (warm)
              (increase (total-cost) 3)))
          (:action rest :parameters () :precondition () :effect (and (not (warm)) (increase (total-cost) 1))))",
        problem: "(define (problem p) (:domain d) (:init (= (work) 0) (= (total-cost) 0)) (:goal (>= (work) 9))
          (:metric minimize (total-cost)))",
        optimum: Some("9"),
    },
    // The door can be opened with one of two keys, or if the house is empty.
    Example {
        name: "door",
        domain: "(define (domain d) (:types key room) (:predicates (have ?k - key) (fits ?k - key) (home ?r - room) (in))
          (:action fetch :parameters (?k - key) :precondition (not (have ?k)) :effect (have ?k))
          (:action leave :parameters (?r - room) :precondition (home ?r) :effect (not (home ?r)))
          (:action enter :parameters ()
            :precondition (or (exists (?k - key) (and (have ?k) (fits ?k))) (forall (?r - room) (not (home ?r))))
            :effect (in))
          (:action lock :parameters () :precondition (imply (in) (exists (?r - room) (home ?r))) :effect (not (in))))",
        problem: "(define (problem p) (:domain d) (:objects k1 k2 k3 - key r1 r2 r3 - room)
          (:init (fits k2) (fits k3) (home r1) (home r2) (home r3)) (:goal (in)))",
        optimum: Some("2"),
    },
    // A switch joins two lines. A derived predicate follows from the joined lines.
    Example {
        name: "lines",
        domain: "(define (domain d) (:constants b c d) (:predicates (line ?a ?b) (joined ?a ?b) (live ?a) (source ?a) (safe))
          (:derived (live ?a) (or (source ?a) (exists (?b) (and (live ?b) (joined ?b ?a)))))
          (:derived (safe) (not (live b)))
          (:action join :parameters (?a ?b) :precondition (and (line ?a ?b) (not (joined ?a ?b)))
            :effect (joined ?a ?b))
          (:action cut :parameters (?a ?b) :precondition (joined ?a ?b) :effect (not (joined ?a ?b)))
          (:action ring :parameters () :precondition (live c) :effect (source d)))",
        problem: "(define (problem p) (:domain d) (:objects a e)
          (:init (line a b) (line b c) (line a e) (line e c) (source a) (joined a b)) (:goal (and (safe) (source d))))",
        optimum: Some("3"),
    },
    // Lines that form a cycle: the derived predicate `live` depends on itself.
    Example {
        name: "ring",
        domain: "(define (domain d) (:predicates (joined ?a ?b) (live ?a) (source ?a) (lit ?a))
          (:derived (live ?a) (or (source ?a) (exists (?b) (and (joined ?b ?a) (live ?b)))))
          (:action join :parameters (?a ?b) :precondition (and (not (= ?a ?b)) (not (joined ?a ?b)))
            :effect (joined ?a ?b))
          (:action end :parameters (?a) :precondition (source ?a) :effect (not (source ?a)))
          (:action light :parameters (?a) :precondition (live ?a) :effect (lit ?a))
          (:action move :parameters (?a ?b) :precondition (and (joined ?a ?b) (not (live ?a)))
            :effect (and (source ?b) (not (joined ?a ?b)))))",
        problem: "(define (problem p) (:domain d) (:objects a b c) (:init (source a) (joined a b))
          (:goal (and (lit c) (not (live a)) (live b))))",
        optimum: Some("4"),
    },
    // The start has one of two effects, and the end depends on which of them occurred.
    Example {
        name: "start",
        domain: "(define (domain d) (:predicates (wet) (dry) (tried) (won))
          (:durative-action try :parameters () :duration (= ?duration 3)
            :condition (and (at start (not (won))) (at end (dry)))
            :effect (and (at start (when (wet) (not (dry)))) (at start (when (not (wet)) (dry))) (at end (won))
              (at start (tried))))
          (:durative-action wipe :parameters () :duration (= ?duration 2) :condition (at start (wet))
            :effect (at end (not (wet)))))",
        problem: "(define (problem p) (:domain d) (:init (wet) (dry)) (:goal (and (won) (tried))))",
        optimum: Some("5"),
    },
    // The numbers never suffice for one of the actions.
    Example {
        name: "bounds",
        domain: "(define (domain d) (:predicates (p) (q)) (:functions (level) (total-cost))
          (:action jump :parameters () :precondition (>= (level) 10)
            :effect (and (q) (increase (total-cost) 1)))
          (:action climb :parameters () :precondition (<= (level) 6)
            :effect (and (increase (level) 2) (increase (total-cost) 2)))
          (:action walk :parameters () :precondition (>= (level) 7)
            :effect (and (q) (increase (total-cost) 9))))",
        problem: "(define (problem p) (:domain d) (:init (= (level) 1) (= (total-cost) 0)) (:goal (q))
          (:metric minimize (total-cost)))",
        optimum: Some("15"),
    },
    // Three tasks without a plan: no action makes (at c) true, the numbers do not suffice, or the goal
    // requires two places at once.
    Example {
        name: "island",
        domain: "(define (domain d) (:predicates (at ?p) (way ?a ?b))
          (:action go :parameters (?a ?b) :precondition (and (at ?a) (way ?a ?b))
            :effect (and (at ?b) (not (at ?a)))))",
        problem: "(define (problem p) (:domain d) (:objects a b c) (:init (at a) (way a b) (way b a) (way c a))
          (:goal (at c)))",
        optimum: None,
    },
    Example {
        name: "shallow",
        domain: "(define (domain d) (:predicates (q)) (:functions (level))
          (:action climb :parameters () :precondition (< (level) 3) :effect (increase (level) 1))
          (:action jump :parameters () :precondition (>= (level) 4) :effect (q)))",
        problem: "(define (problem p) (:domain d) (:init (= (level) 0)) (:goal (q)))",
        optimum: None,
    },
    Example {
        name: "both",
        domain: "(define (domain d) (:predicates (at ?p) (way ?a ?b))
          (:action go :parameters (?a ?b) :precondition (and (at ?a) (way ?a ?b))
            :effect (and (at ?b) (not (at ?a)))))",
        problem: "(define (problem p) (:domain d) (:objects a b) (:init (at a) (way a b) (way b a))
          (:goal (and (at a) (at b))))",
        optimum: None,
    },
    // The shop closes at 6; preparing and buying can end exactly then. Ordering takes longer.
    Example {
        name: "shop",
        domain: "(define (domain d) (:predicates (open) (money) (have) (home))
          (:durative-action prepare :parameters () :duration (= ?duration 4.5) :condition (at start (not (money)))
            :effect (at end (money)))
          (:durative-action buy :parameters () :duration (= ?duration 1.5)
            :condition (and (at start (money)) (at start (open)) (over all (open))) :effect (at end (have)))
          (:durative-action order :parameters () :duration (= ?duration 9) :condition () :effect (at end (have)))
          (:durative-action go :parameters () :duration (= ?duration 1) :condition (at start (have))
            :effect (at end (home))))",
        problem: "(define (problem p) (:domain d) (:init (at 3 (open)) (at 6 (not (open)))) (:goal (home)))",
        optimum: Some("7"),
    },
    // The action must start between 2 and 5, while no event occurs.
    Example {
        name: "between",
        domain: "(define (domain d) (:predicates (p) (q) (done))
          (:durative-action long :parameters () :duration (= ?duration 10) :condition (and (at start (p)) (at end (q)))
            :effect (at end (done)))
          (:durative-action dear :parameters () :duration (= ?duration 100) :condition () :effect (at end (done))))",
        problem: "(define (problem p) (:domain d) (:init (p) (at 5 (not (p))) (at 12 (q))) (:goal (done)))",
        optimum: Some("10"),
    },
    // The action must start less than 1/1000 after 3, and the next action must end by 6.
    Example {
        name: "moment",
        domain: "(define (domain d) (:predicates (p) (q) (r) (done))
          (:durative-action tight :parameters () :duration (= ?duration 1.999)
            :condition (and (at start (p)) (at end (q))) :effect (at end (r)))
          (:durative-action next :parameters () :duration (= ?duration 1)
            :condition (and (at start (r)) (over all (p))) :effect (at end (done)))
          (:durative-action dearer :parameters () :duration (= ?duration 50) :condition (at start (r))
            :effect (at end (done))))",
        problem: "(define (problem p) (:domain d) (:init (q) (at 3 (p)) (at 5 (not (q))) (at 6 (not (p)))) (:goal (done)))",
        optimum: Some("2999/1000"),
    },
    // Events during an action matter at its end, whether they make a condition true or false.
    Example {
        name: "on the way",
        domain: "(define (domain d) (:predicates (lit) (seen) (wet) (done)) (:functions (total-cost))
          (:durative-action pass :parameters () :duration (= ?duration 4)
            :condition (and (at start (not (seen))) (at end (lit)))
            :effect (and (at start (not (lit))) (when (at end (not (wet))) (at end (seen)))
              (at end (increase (total-cost) 3))))
          (:action switch :parameters () :precondition (seen)
            :effect (and (done) (when (wet) (not (done))) (increase (total-cost) 1)))
          (:action give-up :parameters () :precondition () :effect (and (done) (increase (total-cost) 20))))",
        problem: "(define (problem p) (:domain d) (:init (lit) (wet) (= (total-cost) 0)
            (at 2 (lit)) (at 2 (not (wet))) (at 6.5 (wet)) (at 9 (not (lit))))
          (:goal (done)) (:metric minimize (total-cost)))",
        optimum: Some("4"),
    },
    // Events at time 0, an event that interferes with a start, and an event after which the goal is
    // unreachable.
    Example {
        name: "late",
        domain: "(define (domain d) (:predicates (up) (key) (in) (out))
          (:durative-action climb :parameters () :duration (= ?duration 2) :condition (at start (up)) :effect (at end (in)))
          (:action leave :parameters () :precondition (and (in) (key)) :effect (out)))",
        problem: "(define (problem p) (:domain d) (:init (key) (at 0 (up)) (at 2 (not (key)))) (:goal (out)))",
        optimum: None,
    },
    Example {
        name: "in time",
        domain: "(define (domain d) (:predicates (up) (key) (in) (out))
          (:durative-action climb :parameters () :duration (= ?duration 2) :condition (at start (up)) :effect (at end (in)))
          (:durative-action wait-for-key :parameters () :duration (= ?duration 30) :condition () :effect (at end (key)))
          (:action leave :parameters () :precondition (and (in) (key)) :effect (out)))",
        problem: "(define (problem p) (:domain d) (:init (key) (at 0 (up)) (at 2.001 (not (key)))) (:goal (out)))",
        optimum: Some("2"),
    },
    // The remaining amount is maximised, and the detour consumes less.
    Example {
        name: "left",
        domain: "(define (domain d) (:predicates (at ?p) (way ?a ?b)) (:functions (fuel) (use ?a ?b))
          (:action go :parameters (?a ?b) :precondition (and (at ?a) (way ?a ?b) (>= (fuel) (use ?a ?b)))
            :effect (and (at ?b) (not (at ?a)) (decrease (fuel) (use ?a ?b)))))",
        problem: "(define (problem p) (:domain d) (:objects a b c d)
          (:init (at a) (way a b) (way b c) (way a c) (way c d) (= (fuel) 20) (= (use a b) 2) (= (use b c) 2.5)
            (= (use a c) 5) (= (use c d) 3))
          (:goal (at d)) (:metric maximize (* 2 (fuel))))",
        optimum: Some("25"),
    },
    // Actions take their shortest durations: 0.5 for clearing c, and 2.5 for the work on c.
    Example {
        name: "as little",
        domain: "(define (domain d) (:predicates (p ?x) (q)) (:functions (least ?x))
          (:durative-action work :parameters (?x)
            :duration (and (>= ?duration (least ?x)) (<= ?duration 9)) :condition (at start (p ?x)) :effect (at end (q)))
          (:durative-action clear :parameters (?x) :duration (and (>= ?duration 0.5)) :condition ()
            :effect (at end (p ?x))))",
        problem: "(define (problem p) (:domain d) (:objects a b c)
          (:init (p a) (= (least a) 5.25) (= (least b) 10) (= (least c) 2.5)) (:goal (q)))",
        optimum: Some("3"),
    },
    // With the duration 0, there is no state to which the condition over all applies.
    Example {
        name: "at once",
        domain: "(define (domain d) (:predicates (ok ?x) (ready) (done))
          (:durative-action skip :parameters (?x) :duration (= ?duration 0) :condition (over all (ok ?x))
            :effect (at end (ready)))
          (:durative-action prepare :parameters () :duration (= ?duration 5) :condition () :effect (at end (ready)))
          (:durative-action work :parameters () :duration (= ?duration 1) :condition (at start (ready))
            :effect (at end (done))))",
        problem: "(define (problem p) (:domain d) (:objects o) (:init) (:goal (done)))",
        optimum: Some("1"),
    },
];
