(define (domain rover)
  (:requirements :typing :numeric-fluents :action-costs)
  (:types
    place design)
  (:predicates
    (at ?p - place)
    (road ?p ?q - place)
    (usable ?d - design)
    (sampled ?p - place))
  (:functions
    (battery)
    (use ?d - design)
    (price ?d - design)
    (total-cost))
  (:action drive
    :parameters (?p ?q - place ?d - design)
    :precondition (and (at ?p) (road ?p ?q) (usable ?d) (>= (battery) (use ?d)))
    :effect (and
      (not (at ?p))
      (at ?q)
      (decrease (battery) (use ?d))
      (increase (total-cost) (price ?d))))
  (:action sample
    :parameters (?p - place)
    :precondition (at ?p)
    :effect (and (sampled ?p) (increase (total-cost) 1))))
